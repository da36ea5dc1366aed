/* What contact finding counts, and the names of what is compiled once for both precisions. */
#ifndef SADMM_CUDA_DEVICE_FOUND_H
#define SADMM_CUDA_DEVICE_FOUND_H

#include <stdint.h>

/* Capacities: more than there was, so that not every new contact repeats a step: half as much again in small scenes,
 * where a heap that spreads gains a third, an eighth in large ones, where it costs memory. */
static inline int64_t generous(int64_t count)
{
    const int64_t half = count / 2, eighth = count / 8 + 8192;
    return count + (half < eighth ? half : eighth) + 256;
}

struct sadmm_cuda_contact_counts {
    int64_t candidates; /* pairs of shapes whose boxes overlap */
    int32_t pairs, points;
    double dt;          /* of the step that the impulses are for, s; 0: of none */
    int32_t fast;       /* not 0: some pair is (collision/flight/fast_pair.h); where that is asked */
};

#ifdef SADMM_CUDA_EMULATED
#define COLLISION(name) sadmm_cuda_collision_##name##_emulated
#else
#define COLLISION(name) sadmm_cuda_collision_##name
#endif

#endif
