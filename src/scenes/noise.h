/* Irregularity that is the same on every machine: numbers and orientations from an integer hash of an index. */
#ifndef SADMM_SCENES_NOISE_H
#define SADMM_SCENES_NOISE_H

#include <stdint.h>

#include "core/math/quat.h"

/* Finaliser of MurmurHash3: all bits of the result depend on all bits of x. */
static inline uint64_t sadmm_hash(uint64_t x)
{
    x ^= x >> 33;
    x *= 0xff51afd7ed558ccdu;
    x ^= x >> 33;
    x *= 0xc4ceb9fe1a85ec53u;
    return x ^ x >> 33;
}

/* The k-th number in [-1, 1) of object i, k < 4096. */
static inline double sadmm_noise(long i, uint64_t k)
{
    return (double)(sadmm_hash((uint64_t)i * 4096 + k + 1) >> 11) * 0x1p-52 - 1.0;
}

/* Uniform over all orientations: a point of the 4-cube that falls into the ball, normalised. A try succeeds with
 * probability 0.31, so the last resort after 1000 is for the proof only. */
static inline quat sadmm_noise_orientation(long i)
{
    for (uint64_t k = 0; k < 4000; k += 4) {
        quat q = {sadmm_noise(i, k), sadmm_noise(i, k + 1), sadmm_noise(i, k + 2), sadmm_noise(i, k + 3)};
        double norm2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
        if (norm2 > 0.01 && norm2 <= 1.0) return q_normalize(q);
    }
    return (quat){1, 0, 0, 0};
}

#endif
