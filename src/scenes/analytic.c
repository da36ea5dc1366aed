/* Scenes with a known answer: a block on a slope, bouncing spheres, a spinning plate. */
#include <math.h>

#include "family.h"
#include "place.h"

/* ---- incline: a block on a slope at 0.99 of its friction angle does not creep ---- */

static const double block_friction = 0.5;

static sadmm_status fill_incline(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece block = { .half_extents = { 0.1, 0.1, 0.1 }, .mass = 1.0, .friction = block_friction };
    struct sadmm_frame slope = sadmm_frame_turned(sadmm_frame_world(), 1, atan(0.99 * block_friction));
    sadmm_status status = sadmm_place_plane(world, slope, block_friction, error);

    (void)scene;
    if (status != SADMM_OK) return status;
    return sadmm_place_box(world, sadmm_frame_moved(slope, 0, 0, 0.1), &block, NULL, error);
}

const struct sadmm_scene_family sadmm_family_incline = {
    .info = {
        .name = "incline",
        .arguments = "",
        .description = "a block on a slope at 0.99 of its friction angle: it must not creep",
        .duration = 5.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .fill = fill_incline,
};

/* ---- bounce: spheres with restitution 0, 1/4, ... 1 from 1 m ---- */

static sadmm_status fill_bounce(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const double radius = 0.1, height = 1.0;
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.5, error);

    (void)scene;
    for (int i = 0; i < 5 && status == SADMM_OK; ++i) {
        const struct sadmm_piece sphere = {
            .half_extents = { radius }, .mass = 1.0, .friction = 0.5, .restitution = 0.25 * i
        };
        struct sadmm_frame place = sadmm_frame_moved(sadmm_frame_world(), 0.5 * i, 0, height + radius);
        status = sadmm_place_sphere(world, place, &sphere, NULL, error);
    }
    return status;
}

static void configure_bounce(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.001; /* the fall ends within v dt = 4 mm of the ground */
}

const struct sadmm_scene_family sadmm_family_bounce = {
    .info = {
        .name = "bounce",
        .arguments = "",
        .description = "five spheres with restitution 0 to 1 dropped from 1 m",
        .duration = 3.0,
        .iterations = {[SADMM_METHOD_PAPER] = 50, [SADMM_METHOD_FAST] = 20},
    },
    .configure = configure_bounce,
    .fill = fill_bounce,
};

/* ---- spin_plate: a plate spinning freely at 1000 rad/s keeps its energy ---- */

static sadmm_status fill_spin_plate(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece plate = { .half_extents = { 0.2, 0.1, 0.01 }, .mass = 1.0, .friction = 0.5 };
    sadmm_body_id id;
    sadmm_body_state state;
    sadmm_status status = sadmm_place_box(world, sadmm_frame_world(), &plate, &id, error);

    (void)scene;
    if (status != SADMM_OK) return status;
    status = sadmm_world_body_state(world, id, &state);
    /* Mostly about the middle axis, where the motion is unstable and the plate tumbles. */
    state.angular_velocity[0] = 20.0;
    state.angular_velocity[1] = 999.0;
    state.angular_velocity[2] = 40.0;
    if (status == SADMM_OK) status = sadmm_world_set_body_state(world, id, &state);
    return sadmm_scene_world_error(world, status, error);
}

static void configure_spin_plate(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.001;
    def->settings.gravity[2] = 0.0;
}

const struct sadmm_scene_family sadmm_family_spin_plate = {
    .info = {
        .name = "spin_plate",
        .arguments = "",
        .description = "a free plate tumbling at 1000 rad/s without gravity",
        .duration = 10.0,
        .iterations = {[SADMM_METHOD_PAPER] = 1, [SADMM_METHOD_FAST] = 1}, /* nothing to iterate on */
    },
    .configure = configure_spin_plate,
    .fill = fill_spin_plate,
};
