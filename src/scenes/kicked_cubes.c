/* Light bodies that are kicked: N heavy cubes of 10 kg in a row, a light one of 10 g on each. Every half second each
 * light cube gets 0.5 m/s, downwards a little, in a direction of its own. Landing takes mu times the 0.1 m/s downwards
 * from it; with the rest it slides v^2 / (2 mu g) = 20.64 mm and stays on top. A solver that keeps impulses and weights
 * from the step before meets a load that is nothing like the last one.
 */
#include <math.h>

#include "family.h"
#include "place.h"

static const double heavy = 0.15, light = 0.03; /* half extents, m */
static const double spacing = 0.5;              /* m */
static const double speed = 0.5, downward = 0.1; /* m/s */
enum { PERIOD_MS = 500 };

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece below = { .half_extents = { heavy, heavy, heavy }, .mass = 10, .friction = 0.5 };
    const struct sadmm_piece above = { .half_extents = { light, light, light }, .mass = 0.01, .friction = 0.5 };
    struct sadmm_frame origin = sadmm_frame_world();
    sadmm_status status = sadmm_place_plane(world, origin, 0.5, error);

    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        double x = spacing * (double)i;
        status = sadmm_place_box(world, sadmm_frame_moved(origin, x, 0, heavy), &below, NULL, error);
        if (status == SADMM_OK)
            status = sadmm_place_box(world, sadmm_frame_moved(origin, x, 0, 2 * heavy + light), &above, NULL, error);
    }
    return status;
}

/* Body 0 is the ground, then heavy and light in turn. Kick k goes k quarter turns on from the first: back and forth. */
static sadmm_status before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                struct sadmm_error *error)
{
    int64_t period = (int64_t)lround(1e-3 * PERIOD_MS / scene->def.settings.dt);
    sadmm_status status = SADMM_OK;
    if (step == 0 || period == 0 || step % period != 0) return SADMM_OK;

    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        double angle = (double)i + 0.5 * 3.14159265358979323846 * (double)(step / period % 4);
        sadmm_body_id id;
        sadmm_body_state state;
        status = sadmm_world_body_at(world, (int32_t)(2 * i + 2), &id);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, id, &state);
        if (status != SADMM_OK) break;
        state.linear_velocity[0] += speed * cos(angle);
        state.linear_velocity[1] += speed * sin(angle);
        state.linear_velocity[2] -= downward;
        status = sadmm_world_set_body_state(world, id, &state);
    }
    return sadmm_scene_world_error(world, status, error);
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_kicked_cubes = {
    .info = {
        .name = "kicked_cubes",
        .arguments = "[:N]",
        .description = "N cubes of 10 g on cubes of 10 kg, kicked every half second (N in [1, 100000], default 20)",
        .duration = 3.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .n_default = 20, .n_min = 1, .n_max = 100000,
    .configure = configure,
    .fill = fill,
    .before_step = before_step,
};
