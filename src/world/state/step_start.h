/* What a step starts from. */
#ifndef SADMM_WORLD_STATE_STEP_START_H
#define SADMM_WORLD_STATE_STEP_START_H

#include "core/model/rows.h"
#include "core/model/system.h"

struct sadmm_world_hit;

/* What the last step started from, for contacts, freeze and the certificate. Bodies that were hit: from where they
 * would have started with the velocity that they have after it. */
struct sadmm_step_start {
    struct sadmm_world_hit *hits;              /* of the step, in the order of time within each sub-step */
    size_t hit_count, hit_first;               /* hit_first: the first one of the last sub-step */
    struct sadmm_rigid *rigid; /* dynamic bodies */
    double *velocity;          /* dynamic bodies x 6: the warm start */
    double *impulse;           /* points x 3: the warm start */
    struct sadmm_rows rows;    /* of joints; their multipliers are the solution */
    double *multiplier;        /* rows: the warm start */
    double *kinematic;         /* kinematic bodies x 6: velocities, m/s, rad/s */
    int32_t kinematic_count;
};

#endif
