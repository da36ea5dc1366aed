/* Keys of pairs, and what narrow_phase.c has beside the headers it shares with the device (proxy.h, contact_carry.h,
 * pair_manifold.h). The device gives the host's contacts bit for bit: the same operations in the same order, compiled
 * without contraction of a * b + c. tests/test_cuda_collision.c holds the two together.
 */
#ifndef SADMM_CUDA_COLLIDE_FORMULAS_H
#define SADMM_CUDA_COLLIDE_FORMULAS_H

#include "collision/contact_carry.h"
#include "collision/manifold.h"
#include "collision/proxy.h"

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

SADMM_INLINE void rotate_to_world(const double R[9], vec3 v, double out[3])
{
    for (int k = 0; k < 3; ++k)
        out[k] = R[3 * k] * (double)v.x + R[3 * k + 1] * (double)v.y + R[3 * k + 2] * (double)v.z;
}

#endif
