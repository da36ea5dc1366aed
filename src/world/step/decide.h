/* Between finding contacts and solving them: what the caller decides of them, and surfaces that move. */
#ifndef SADMM_WORLD_STEP_DECIDE_H
#define SADMM_WORLD_STEP_DECIDE_H

#include "core/math/hit.h"
#include "world/state/world_state.h"

/* Is there anything to decide in this world's steps? */
static inline bool sadmm_world_decides(const sadmm_world *world)
{
    return world->decider.call || world->moving_surfaces > 0;
}

/* The (sub-)step's contacts. INVALID_ARGUMENT, OUT_OF_MEMORY. */
sadmm_status sadmm_world_decide(sadmm_world *world);

/* A hit within the step, before it is solved. */
struct sadmm_hit_decision {
    uint64_t key; /* shapes (a << 32) | b */
    uint32_t subshape;
    const double (*points)[3]; /* m, world: where they touch, as many as the hit has */
    bool enabled; /* out */
};
sadmm_status sadmm_world_decide_hit(sadmm_world *world, struct sadmm_hit_decision *decision, struct hit *hit);

#endif
