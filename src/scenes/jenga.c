/* A tower of 18 levels of three blocks, each level across the one below. From t = 1 s on the middle block of the ninth
 * level is drawn out along itself, by 90 mm in 2 s; the tower has to stand, moved by no more than that block's friction
 * slides what it touches. */
#include <string.h>

#include "built.h"
#include "family.h"
#include "pull.h"

enum { LEVELS = 18, BLOCKS = 3 * LEVELS, DRAWN = 3 * 8 + 1 };

static const double half[3] = {0.0375, 0.0125, 0.0075}; /* m */
static const double gap = 0.0002;                        /* m, between blocks of a level */
static const double begins = 1, ends = 3, way = 0.09;    /* s, s, m */

static struct sadmm_frame block_at(const struct sadmm_scene *scene, int32_t i)
{
    (void)scene;
    const int32_t level = i / 3;
    const double z = half[2] * (2 * level + 1), off = (2 * half[1] + gap) * (i % 3 - 1);
    struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), 0, 0, z);
    if (level % 2) at = sadmm_frame_turned(at, 2, 1.57079632679489661923);
    return sadmm_frame_moved(at, 0, off, 0);
}

static struct sadmm_frame drawn_at(const struct sadmm_scene *scene, double t)
{
    return sadmm_frame_moved(block_at(scene, DRAWN), way * sadmm_smooth((t - begins) / (ends - begins)), 0, 0);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_piece block = {.mass = 0.015, .friction = 0.5};
    sadmm_coupling_def gains = sadmm_coupling_def_default();
    sadmm_body_id id, drawn = {0, 0};
    memcpy(block.half_extents, half, sizeof half);
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.5, error);
    for (int32_t i = 0; i < BLOCKS && status == SADMM_OK; ++i) {
        status = sadmm_place_box(world, block_at(scene, i), &block, &id, error);
        if (i == DRAWN) drawn = id;
    }
    gains.linear_stiffness = 500, gains.linear_damping = 5;
    gains.angular_stiffness = 0.5, gains.angular_damping = 0.005;
    return status == SADMM_OK ? sadmm_add_pull(world, drawn, drawn_at(scene, 0), &gains, error) : status;
}

static sadmm_status before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                struct sadmm_error *error)
{
    const double dt = scene->def.settings.dt, t = (double)step * dt;
    return sadmm_move_pull(world, 0, drawn_at(scene, t), drawn_at(scene, t + dt), dt, error);
}

/* 2 mm: less than what would tip a level that stands on the two outer blocks. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const struct sadmm_built tower = {1, BLOCKS, DRAWN, block_at, .end = scene->info->duration, .most = 2e-3};
    struct sadmm_scene_task *task = &result->tasks[0];
    result->task_count = 1;
    sadmm_status status = sadmm_observe_built(scene, world, step, &tower, task, error);
    sadmm_body_id id;
    sadmm_body_state state;
    if (status == SADMM_OK) status = sadmm_world_body_at(world, 1 + DRAWN, &id);
    if (status == SADMM_OK) status = sadmm_world_body_state(world, id, &state);
    if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
    const double out = state.position[0] - block_at(scene, DRAWN).origin[0];
    task->figure_count = 3;
    task->figures[2] = (struct sadmm_scene_figure){"drawn", "m", out};
    task->passed = task->passed && out > 0.9 * way;
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_jenga = {
    .info = {
        .name = "jenga",
        .arguments = "",
        .description = "a tower of 18 levels of three blocks; one is drawn out",
        .duration = 10,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
    },
    .configure = configure,
    .fill = fill,
    .before_step = before_step,
    .observe = observe,
};
