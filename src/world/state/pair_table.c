#include "pair_table.h"

#include <string.h>

#include "collision/base/keys.h"
#include "core/base/memory.h"

uint64_t sadmm_pair_key(size_t a, size_t b) { return unordered_key((uint32_t)a, (uint32_t)b); }

static uint64_t mirror(uint64_t key) { return key << 32 | key >> 32; }

size_t sadmm_pair_table_count(const struct sadmm_pair_table *table) { return sadmm_key_tree_count(&table->pairs); }

const double *sadmm_pair_table_find(const struct sadmm_pair_table *table, uint64_t key)
{
    return sadmm_key_tree_find(&table->pairs, key);
}

uint64_t sadmm_pair_table_at(const struct sadmm_pair_table *table, size_t index, double *value)
{
    const struct sadmm_key_node *node = sadmm_key_tree_at(&table->pairs, index);
    *value = node->value;
    return node->key;
}

sadmm_status sadmm_pair_table_set(struct sadmm_pair_table *table, uint64_t key, double value, struct sadmm_error *error)
{
    if (!sadmm_key_tree_reserve(&table->pairs) || !sadmm_key_tree_reserve(&table->mirrored))
        return sadmm_fail_memory(error, "a pair override");
    sadmm_key_tree_set(&table->pairs, key, value);
    sadmm_key_tree_set(&table->mirrored, mirror(key), value);
    table->listed = false;
    return SADMM_OK;
}

void sadmm_pair_table_remove(struct sadmm_pair_table *table, uint64_t key)
{
    sadmm_key_tree_remove(&table->pairs, key);
    sadmm_key_tree_remove(&table->mirrored, mirror(key));
    table->listed = false;
}

void sadmm_pair_table_lower(struct sadmm_pair_table *table, uint64_t key)
{
    double *value = sadmm_key_tree_find(&table->pairs, key);
    if (!value) return;
    table->listed = false;
    if (--*value <= 0) sadmm_pair_table_remove(table, key);
}

void sadmm_pair_table_forget(struct sadmm_pair_table *table, uint32_t slot)
{
    const uint64_t first = (uint64_t)slot << 32;
    const struct sadmm_key_node *node;
    while ((node = sadmm_key_tree_from(&table->pairs, first)) && node->key >> 32 == slot)
        sadmm_pair_table_remove(table, node->key);
    while ((node = sadmm_key_tree_from(&table->mirrored, first)) && node->key >> 32 == slot)
        sadmm_pair_table_remove(table, mirror(node->key));
}

static void list_below(struct sadmm_pair_table *table, uint32_t at, size_t first)
{
    if (!at) return;
    const struct sadmm_key_node *nodes = table->pairs.nodes, *node = &nodes[at];
    const size_t place = first + nodes[node->below[0]].size;
    table->keys[place] = node->key;
    table->values[place] = node->value;
    list_below(table, node->below[0], first);
    list_below(table, node->below[1], place + 1);
}

sadmm_status sadmm_pair_table_list(struct sadmm_pair_table *table, struct sadmm_error *error)
{
    const size_t count = sadmm_pair_table_count(table);
    if (table->listed) return SADMM_OK;
    if (!SADMM_GROW(table->keys, 0, count) || !SADMM_GROW(table->values, 0, count))
        return sadmm_fail_memory(error, "pair overrides");
    list_below(table, table->pairs.root, 0);
    table->listed = true;
    return SADMM_OK;
}

void sadmm_pair_table_free(struct sadmm_pair_table *table)
{
    sadmm_key_tree_free(&table->pairs);
    sadmm_key_tree_free(&table->mirrored);
    sadmm_free(table->keys);
    sadmm_free(table->values);
    memset(table, 0, sizeof *table);
}
