/* What was set for pairs of bodies or shapes: disabled pairs, frictions. */
#ifndef SADMM_WORLD_STATE_PAIR_TABLE_H
#define SADMM_WORLD_STATE_PAIR_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/base/key_tree.h"

/* A set of slot pairs, key = low slot << 32 | high slot, each with a value. */
struct sadmm_pair_table {
    struct sadmm_key_tree pairs, mirrored; /* mirrored: by high slot << 32 | low slot */
    uint64_t *keys; /* sorted, with their values: as they were listed last */
    double *values;
    bool listed; /* they are as in `pairs` */
};

size_t sadmm_pair_table_count(const struct sadmm_pair_table *table);
/* NULL: the key is not in the table. */
const double *sadmm_pair_table_find(const struct sadmm_pair_table *table, uint64_t key);
/* The index-th in order, in [0, count). */
uint64_t sadmm_pair_table_at(const struct sadmm_pair_table *table, size_t index, double *value);
sadmm_status sadmm_pair_table_set(struct sadmm_pair_table *table, uint64_t key, double value,
                                  struct sadmm_error *error);
void sadmm_pair_table_remove(struct sadmm_pair_table *table, uint64_t key);
/* Its value, where it is in the table, less 1; the pair goes when nothing is left. */
void sadmm_pair_table_lower(struct sadmm_pair_table *table, uint64_t key);
/* Remove every pair that names the slot. */
void sadmm_pair_table_forget(struct sadmm_pair_table *table, uint32_t slot);
/* `keys` and `values` as they are. OUT_OF_MEMORY. */
sadmm_status sadmm_pair_table_list(struct sadmm_pair_table *table, struct sadmm_error *error);
void sadmm_pair_table_free(struct sadmm_pair_table *table);
uint64_t sadmm_pair_key(size_t a, size_t b);

#endif
