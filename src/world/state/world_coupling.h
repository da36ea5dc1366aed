/* Couplings of a world, in slots. */
#ifndef SADMM_WORLD_STATE_WORLD_COUPLING_H
#define SADMM_WORLD_STATE_WORLD_COUPLING_H

#include "core/model/coupling_law.h"
#include "subadmm/coupling.h"

/* A coupling slot. */
struct sadmm_world_coupling {
    bool alive;
    uint32_t generation;
    sadmm_coupling_def def; /* its target is that in `last` */
    size_t joint;           /* slot */
    struct sadmm_coupling_memory last, next;
};

#endif
