/* What contact finding counts, and the names of what is compiled once for both precisions. */
#ifndef SADMM_CUDA_DEVICE_FOUND_H
#define SADMM_CUDA_DEVICE_FOUND_H

#include <stdint.h>

struct sadmm_cuda_contact_counts {
    int64_t candidates; /* pairs of shapes whose boxes overlap */
    int32_t pairs, points;
    double dt;          /* of the step that the impulses are for, s; 0: of none */
};

#ifdef SADMM_CUDA_EMULATED
#define COLLISION(name) sadmm_cuda_collision_##name##_emulated
#else
#define COLLISION(name) sadmm_cuda_collision_##name
#endif

#endif
