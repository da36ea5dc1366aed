/* Stable sort of 64-bit keys. */
#ifndef SADMM_COLLISION_BASE_RADIX_SORT_H
#define SADMM_COLLISION_BASE_RADIX_SORT_H

#include <stddef.h>
#include <stdint.h>

/* Sort `keys` by their low `bits` bits (the others are 0); scratch: as long as keys. */
void sadmm_radix_sort(uint64_t *keys, uint64_t *scratch, size_t count, int bits);

#endif
