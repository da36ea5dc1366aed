#include "archive.h"

#include <string.h>

#include "memory.h"

bool sadmm_archive_expect(struct sadmm_archive *archive, bool fine, const char *what)
{
    if (!fine && archive->status == SADMM_OK)
        archive->status = sadmm_fail(archive->error, SADMM_ERROR_INVALID_ARGUMENT,
                                     "buffer, near byte %zu: not the state of a world (%s)", archive->at, what);
    return archive->status == SADMM_OK;
}

void sadmm_archive_bytes(struct sadmm_archive *archive, void *x, size_t size)
{
    if (archive->reading) {
        if (size == 0) return;
        if (sadmm_archive_expect(archive, size <= archive->size - archive->at, "it is cut short"))
            memcpy(x, archive->in + archive->at, size);
        else memset(x, 0, size);
        if (archive->status != SADMM_OK) return;
    } else if (archive->out && size > 0 && archive->at <= archive->size && size <= archive->size - archive->at) {
        memcpy(archive->out + archive->at, x, size);
    }
    archive->at += size;
}

void sadmm_archive_flag(struct sadmm_archive *archive, bool *x)
{
    unsigned char byte = archive->reading ? 0 : *x;
    sadmm_archive_bytes(archive, &byte, 1);
    if (archive->reading) *x = sadmm_archive_expect(archive, byte <= 1, "a flag is neither 0 nor 1") && byte;
}

void sadmm_archive_count(struct sadmm_archive *archive, size_t *count, size_t unit, size_t most)
{
    uint64_t n = archive->reading ? 0 : *count;
    sadmm_archive_bytes(archive, &n, sizeof n);
    if (!archive->reading) return;
    const size_t left = archive->size - archive->at;
    *count = sadmm_archive_expect(archive, n <= most && n <= left / (unit > 0 ? unit : 1), "a count is too large")
                 ? (size_t)n
                 : 0;
}

void sadmm_archive_count32(struct sadmm_archive *archive, int32_t *count, size_t unit, int32_t most)
{
    size_t n = archive->reading ? 0 : (size_t)*count;
    sadmm_archive_count(archive, &n, unit, (size_t)most);
    if (archive->reading) *count = (int32_t)n;
}

bool sadmm_archive_room(struct sadmm_archive *archive, void *array, size_t count, size_t size)
{
    if (archive->status == SADMM_OK && !sadmm_grow(array, 0, count, size))
        archive->status = sadmm_fail_memory(archive->error, "the state of a world");
    return archive->status == SADMM_OK;
}

void sadmm_archive_array(struct sadmm_archive *archive, void *array, size_t *count, size_t size, size_t most)
{
    void *block;
    sadmm_archive_count(archive, count, size, most);
    if (archive->reading && !sadmm_archive_room(archive, array, *count, size)) {
        *count = 0;
        return;
    }
    memcpy(&block, array, sizeof block);
    if (*count > 0) sadmm_archive_bytes(archive, block, *count * size);
}
