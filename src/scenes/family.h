/* One scene of the library, as scenes.c sees it. Every family of scenes has a file that defines some of these and is
 * listed in scenes.c. */
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

extern const struct sadmm_scene_family sadmm_family_sliding_cubes;
extern const struct sadmm_scene_family sadmm_family_vertical_stacks;
extern const struct sadmm_scene_family sadmm_family_oblique_stacks;
extern const struct sadmm_scene_family sadmm_family_card_houses;
extern const struct sadmm_scene_family sadmm_family_pyramid;
extern const struct sadmm_scene_family sadmm_family_pile;
extern const struct sadmm_scene_family sadmm_family_mixed_pile;
extern const struct sadmm_scene_family sadmm_family_sliding_pile;
extern const struct sadmm_scene_family sadmm_family_settled_pile;
extern const struct sadmm_scene_family sadmm_family_kicked_cubes;
extern const struct sadmm_scene_family sadmm_family_burst;
extern const struct sadmm_scene_family sadmm_family_incline;
extern const struct sadmm_scene_family sadmm_family_bounce;
extern const struct sadmm_scene_family sadmm_family_spin_plate;
extern const struct sadmm_scene_family sadmm_family_rolling;
extern const struct sadmm_scene_family sadmm_family_rocking;
extern const struct sadmm_scene_family sadmm_family_two_balls;
extern const struct sadmm_scene_family sadmm_family_dominoes;
extern const struct sadmm_scene_family sadmm_family_falling_chain;
extern const struct sadmm_scene_family sadmm_family_chain;
extern const struct sadmm_scene_family sadmm_family_four_bar;
extern const struct sadmm_scene_family sadmm_family_slider_crank;
extern const struct sadmm_scene_family sadmm_family_bricard;
extern const struct sadmm_scene_family sadmm_family_grippers;
extern const struct sadmm_scene_family sadmm_family_hand_demo;
extern const struct sadmm_scene_family sadmm_family_kapla_tower;
extern const struct sadmm_scene_family sadmm_family_jenga;
extern const struct sadmm_scene_family sadmm_family_bridge;
extern const struct sadmm_scene_family sadmm_family_ragdolls;
extern const struct sadmm_scene_family sadmm_family_mixer;
extern const struct sadmm_scene_family sadmm_family_arch;
extern const struct sadmm_scene_family sadmm_family_dry_stone;
extern const struct sadmm_scene_family sadmm_family_mesh_pile;
extern const struct sadmm_scene_family sadmm_family_peg_in_hole;
extern const struct sadmm_scene_family sadmm_family_terrain;
extern const struct sadmm_scene_family sadmm_family_nuts_and_bolts;
extern const struct sadmm_scene_family sadmm_family_marble_run;

#endif
