#include "source.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/error.h"
#include "core/base/memory.h"

static sadmm_status fail_io(const struct mesh_source *source, const char *why)
{
    return sadmm_fail(NULL, SADMM_ERROR_IO, "%s: %s", source->name, why);
}

/* All of a regular file; `file` stays open. */
static sadmm_status read_all(int file, struct mesh_source *source)
{
    struct stat status;
    if (fstat(file, &status) != 0) return fail_io(source, strerror(errno));
    if (S_ISDIR(status.st_mode)) return fail_io(source, "is a folder: must be a file");
    if (!S_ISREG(status.st_mode)) return fail_io(source, "must be an ordinary file");
    if (status.st_size == 0) return fail_io(source, "is empty");
    source->size = (size_t)status.st_size;
    source->own = (unsigned char *)sadmm_alloc(source->size, 1);
    if (!source->own) return sadmm_fail_memory(NULL, "the bytes of a mesh file");
    source->bytes = source->own;
    for (size_t got = 0; got < source->size;) {
        const ssize_t more = read(file, source->own + got, source->size - got);
        if (more < 0 && errno == EINTR) continue;
        if (more < 0) return fail_io(source, strerror(errno));
        if (more == 0) return fail_io(source, "became shorter while it was read");
        got += (size_t)more;
    }
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_open(const sadmm_mesh_file_def *def, struct mesh_source *source)
{
    *source = (struct mesh_source){.bytes = (const unsigned char *)def->bytes, .size = def->size};
    if (!def->path) {
        snprintf(source->name, sizeof source->name, "def->bytes");
        return SADMM_OK;
    }
    snprintf(source->name, sizeof source->name, "def->path (%.200s)", def->path);
    /* A pipe nobody writes to would be waited for. */
    const int file = open(def->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) return fail_io(source, strerror(errno));
    const sadmm_status status = read_all(file, source);
    close(file);
    return status;
}

void sadmm_mesh_file_close(struct mesh_source *source) { sadmm_free(source->own); }
