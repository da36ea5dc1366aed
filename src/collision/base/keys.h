/* Pairs of slots as keys, and sorted arrays of keys. */
#ifndef SADMM_COLLISION_BASE_KEYS_H
#define SADMM_COLLISION_BASE_KEYS_H

#include "core/math/real.h"

SADMM_INLINE uint64_t ordered_key(uint32_t a, uint32_t b) { return (uint64_t)a << 32 | b; }
SADMM_INLINE uint64_t unordered_key(uint32_t a, uint32_t b) { return a < b ? ordered_key(a, b) : ordered_key(b, a); }

/* Index of the first key >= `key`. */
SADMM_INLINE int64_t lower_bound(const uint64_t *keys, int64_t count, uint64_t key)
{
    int64_t low = 0, high = count;
    while (low < high) {
        int64_t mid = low + (high - low) / 2;
        if (keys[mid] < key) low = mid + 1;
        else high = mid;
    }
    return low;
}

/* Index of `key`, -1: not there. */
SADMM_INLINE int64_t find_key(const uint64_t *keys, int64_t count, uint64_t key)
{
    int64_t at = lower_bound(keys, count, key);
    return at < count && keys[at] == key ? at : -1;
}

/* How many bits the numbers up to `most` take. */
SADMM_INLINE int bits_of(uint64_t most)
{
    int bits = 0;
    while (most >> bits) ++bits;
    return bits;
}

#endif
