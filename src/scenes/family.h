/* One scene of the library, as scenes.c sees it. Every family of scenes has a file that defines some of these. */
#ifndef SADMM_SCENES_FAMILY_H
#define SADMM_SCENES_FAMILY_H

#include "scene.h"

struct sadmm_scene_family {
    struct sadmm_scene_info info;
    long n_default, n_min, n_max; /* the N of "name:N"; n_max = 0: the scene takes no size */
    long m_default, m_min, m_max; /* the M of "name:N:M"; m_max = 0: it takes no second number */

    /* (optional) Fill the settings of the scene (dt, m, margin) in a default definition; iterations are in `info`. */
    void (*configure)(long n, sadmm_world_def *def);
    /* Fill an empty world made from scene->def. */
    sadmm_status (*fill)(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error);
    /* (optional) Scripted input before each step. */
    sadmm_status (*before_step)(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                struct sadmm_error *error);
    /* (optional) Measure success (scenes.h): tasks and figures of `result`, which is zeroed before the first call. A
     * pure function of the world, the step and `result`. */
    sadmm_status (*observe)(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error);
};

/* The one list of families, in the order in which they are shown: F(name) of sadmm_family_name. */
#define SADMM_SCENE_FAMILIES(F) \
    F(sliding_cubes) F(vertical_stacks) F(oblique_stacks) F(card_houses) F(pyramid) F(pile) F(mixed_pile)             \
    F(sliding_pile) F(settled_pile) F(burst) F(kicked_cubes) F(incline) F(bounce) F(spin_plate) F(rolling) F(rocking) \
    F(two_balls) F(dominoes) F(falling_chain) F(chain) F(four_bar) F(slider_crank) F(bricard) F(grippers)             \
    F(hand_demo) F(kapla_tower) F(jenga) F(bridge) F(ragdolls) F(mixer) F(arch) F(dry_stone) F(mesh_pile)             \
    F(peg_in_hole) F(terrain) F(nuts_and_bolts) F(marble_run)

#define SADMM_DECLARE_FAMILY(name) extern const struct sadmm_scene_family sadmm_family_##name;
SADMM_SCENE_FAMILIES(SADMM_DECLARE_FAMILY)

#endif
