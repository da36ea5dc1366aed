/* What was set for pairs of bodies or shapes: disabled pairs, frictions. */
#ifndef SADMM_CORE_WORLD_PAIR_TABLE_H
#define SADMM_CORE_WORLD_PAIR_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"

/* A set of slot pairs, key = low slot << 32 | high slot, sorted; `values` where the set has them. */
struct sadmm_pair_table {
    uint64_t *keys;
    double *values;
    size_t count, key_capacity, value_capacity;
};

/* Is `key` in the table? *at is where it is or belongs. */
bool sadmm_pair_table_find(const struct sadmm_pair_table *table, uint64_t key, size_t *at);
sadmm_status sadmm_pair_table_set(struct sadmm_pair_table *table, uint64_t key, double value,
                                  struct sadmm_error *error);
void sadmm_pair_table_remove(struct sadmm_pair_table *table, uint64_t key);
/* Remove every pair that names the slot. */
void sadmm_pair_table_forget(struct sadmm_pair_table *table, uint32_t slot);
uint64_t sadmm_pair_key(size_t a, size_t b);

#endif
