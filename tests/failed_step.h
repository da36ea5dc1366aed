/* A step that fails, and leaves the world before it. */
#ifndef TESTS_FAILED_STEP_H
#define TESTS_FAILED_STEP_H

#include "scene_tools.h"

/* The body, whose moments differ, turns so fast for a step that the square of that is no number. */
static inline void fail_a_step(sadmm_world *world, sadmm_body_id id)
{
    const sadmm_body_state good = body_state(world, id);
    sadmm_body_state bad = good;
    bad.angular_velocity[1] = 1e200;
    MUST(world, sadmm_world_set_body_state(world, id, &bad));
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
    MUST(world, sadmm_world_set_body_state(world, id, &good));
}

#endif
