#include "pair_table.h"

#include <string.h>

#include "collision/keys.h"
#include "core/base/memory.h"

uint64_t sadmm_pair_key(size_t a, size_t b) { return unordered_key((uint32_t)a, (uint32_t)b); }

bool sadmm_pair_table_find(const struct sadmm_pair_table *table, uint64_t key, size_t *at)
{
    *at = (size_t)lower_bound(table->keys, (int64_t)table->count, key);
    return *at < table->count && table->keys[*at] == key;
}

sadmm_status sadmm_pair_table_set(struct sadmm_pair_table *table, uint64_t key, double value, struct sadmm_error *error)
{
    size_t at, count = table->count;
    if (!sadmm_pair_table_find(table, key, &at)) {
        if (!sadmm_grow(&table->keys, &table->key_capacity, count, count + 1, sizeof *table->keys) ||
            !sadmm_grow(&table->values, &table->value_capacity, count, count + 1, sizeof *table->values))
            return sadmm_fail_memory(error, "a pair override");
        memmove(table->keys + at + 1, table->keys + at, (count - at) * sizeof *table->keys);
        memmove(table->values + at + 1, table->values + at, (count - at) * sizeof *table->values);
        table->keys[at] = key;
        ++table->count;
    }
    table->values[at] = value;
    return SADMM_OK;
}

static void remove_at(struct sadmm_pair_table *table, size_t at)
{
    size_t rest = --table->count - at;
    memmove(table->keys + at, table->keys + at + 1, rest * sizeof *table->keys);
    memmove(table->values + at, table->values + at + 1, rest * sizeof *table->values);
}

void sadmm_pair_table_remove(struct sadmm_pair_table *table, uint64_t key)
{
    size_t at;
    if (sadmm_pair_table_find(table, key, &at)) remove_at(table, at);
}

void sadmm_pair_table_forget(struct sadmm_pair_table *table, uint32_t slot)
{
    for (size_t k = table->count; k-- > 0;)
        if (table->keys[k] >> 32 == slot || (uint32_t)table->keys[k] == slot) remove_at(table, k);
}
