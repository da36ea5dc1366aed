#include "save_parts.h"

#include <string.h>

#include "core/base/utf8.h"

static void archive_field(struct sadmm_archive *archive, const struct sadmm_field *field, void *at)
{
    switch (field->kind) {
    case SADMM_FIELD_REALS:
    case SADMM_FIELD_TURN:
    case SADMM_FIELD_BOUND:
    case SADMM_FIELD_MEASURED: sadmm_archive_bytes(archive, at, (size_t)field->count * sizeof(double)); break;
    case SADMM_FIELD_WHOLE: sadmm_archive_bytes(archive, at, sizeof(int)); break;
    case SADMM_FIELD_BITS: sadmm_archive_bytes(archive, at, sizeof(uint32_t)); break;
    case SADMM_FIELD_NAMED: sadmm_archive_bytes(archive, at, sizeof(sadmm_method)); break; /* as all enumerations */
    case SADMM_FIELD_ID: sadmm_archive_bytes(archive, at, sizeof(sadmm_body_id)); break;   /* as all ids */
    case SADMM_FIELD_FLAG: sadmm_archive_flag(archive, (bool *)at); break;
    case SADMM_FIELD_OTHER: break; /* the caller's */
    }
}

void sadmm_archive_fields(struct sadmm_archive *archive, const struct sadmm_field *fields, size_t count, void *object)
{
    for (size_t k = 0; k < count; ++k) archive_field(archive, &fields[k], (char *)object + fields[k].offset);
}

void sadmm_archive_fail_memory(struct sadmm_archive *archive)
{
    if (archive->status == SADMM_OK) archive->status = sadmm_fail_memory(archive->error, "the state of a world");
}

static void archive_name(struct sadmm_archive *archive, struct sadmm_tags *tags, size_t slot)
{
    char name[SADMM_NAME_SIZE] = "";
    size_t length = archive->reading ? 0 : strlen(sadmm_tags_name(tags, slot));
    sadmm_archive_count(archive, &length, 1, SADMM_NAME_SIZE - 1);
    if (!archive->reading) memcpy(name, sadmm_tags_name(tags, slot), length);
    if (archive->status != SADMM_OK || length == 0) return;
    sadmm_archive_bytes(archive, name, length);
    if (!archive->reading || archive->status != SADMM_OK ||
        !sadmm_archive_expect(archive, sadmm_utf8_fit(name, length) == length, "a name"))
        return;
    if (sadmm_tags_set(tags, slot, name, NULL, archive->error) != SADMM_OK) sadmm_archive_fail_memory(archive);
}

bool sadmm_archive_ids(struct sadmm_archive *archive, struct sadmm_id_pool *pool, void *array, size_t size)
{
    size_t slots = pool->slots;
    sadmm_archive_count(archive, &slots, 5, (size_t)1 << pool->most);
    if (archive->reading) {
        if (!sadmm_archive_room(archive, array, slots, size)) return false;
        if (!sadmm_ids_reserve(pool, slots)) sadmm_archive_fail_memory(archive);
        else pool->slots = slots;
    }
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) {
        bool taken = !archive->reading && sadmm_ids_has(pool, slot);
        sadmm_archive_flag(archive, &taken);
        SADMM_ARCHIVE(archive, pool->generations[slot]);
        if (archive->reading && sadmm_archive_expect(archive, pool->generations[slot] > 0, "an id") && taken)
            sadmm_ids_take(pool, slot);
        if (taken && archive->status == SADMM_OK) archive_name(archive, &pool->tags, slot);
    }
    return archive->status == SADMM_OK;
}

void sadmm_archive_list(struct sadmm_archive *archive, sadmm_world *world, struct sadmm_id_pool *pool, void *array,
                        size_t size, void (*one)(struct sadmm_archive *archive, sadmm_world *world, size_t slot))
{
    if (!sadmm_archive_ids(archive, pool, array, size)) return;
    for (SADMM_OBJECTS(slot, pool))
        if (archive->status == SADMM_OK) one(archive, world, slot);
}

static bool pairs_fit(const struct sadmm_pair_table *table, size_t count, size_t slots)
{
    for (size_t k = 0; k < count; ++k) {
        const uint64_t low = table->keys[k] >> 32, high = table->keys[k] & UINT32_MAX;
        if (high >= slots || low >= high || (k > 0 && table->keys[k - 1] >= table->keys[k]) ||
            !(table->values[k] >= 0 && table->values[k] <= 1e9))
            return false;
    }
    return true;
}

void sadmm_archive_pairs(struct sadmm_archive *archive, struct sadmm_pair_table *table, size_t slots)
{
    size_t count = sadmm_pair_table_count(table), values;
    if (!archive->reading && sadmm_pair_table_list(table, archive->error) != SADMM_OK) {
        archive->status = SADMM_ERROR_OUT_OF_MEMORY;
        return;
    }
    values = count;
    sadmm_archive_array(archive, &table->keys, &count, sizeof *table->keys, SIZE_MAX);
    sadmm_archive_array(archive, &table->values, &values, sizeof *table->values, SIZE_MAX);
    if (!archive->reading ||
        !sadmm_archive_expect(archive, values == count && pairs_fit(table, count, slots), "pairs of bodies or shapes"))
        return;
    for (size_t k = 0; k < count && archive->status == SADMM_OK; ++k)
        if (sadmm_pair_table_set(table, table->keys[k], table->values[k], archive->error) != SADMM_OK)
            sadmm_archive_fail_memory(archive);
}
