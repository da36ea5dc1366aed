/* Couplings of a world, in slots. */
#ifndef SADMM_WORLD_STATE_WORLD_COUPLING_H
#define SADMM_WORLD_STATE_WORLD_COUPLING_H

#include "core/model/coupling_law.h"
#include "subadmm/coupling.h"
#include "world_joint.h"

/* A coupling slot. */
struct sadmm_world_coupling {
    sadmm_coupling_def def;         /* its target is that in `last` */
    struct sadmm_world_joint joint; /* what a step makes its rows of: position drives of all six coordinates, from the
                                       target, a, whose motion is prescribed, to the frame on the body, b */
    struct sadmm_coupling_memory last, next;
};

#endif
