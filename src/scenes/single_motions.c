/* Motions of one or two bodies with a known answer: a sphere that rolls, a block that rocks, two balls that collide. */
#include <math.h>

#include "family.h"
#include "place.h"

/* ---- rolling: a sphere on a slope ---- */

/* tan of the angle: the sphere rolls without sliding where mu >= 2/7 of it, at 5/7 g sin. */
static const double slope = 0.4;

static sadmm_status fill_rolling(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece sphere = {.half_extents = {0.1}, .mass = 1, .friction = 0.5};
    struct sadmm_frame ground = sadmm_frame_turned(sadmm_frame_world(), 1, atan(slope)); /* x goes downhill */
    sadmm_status status = sadmm_place_plane(world, ground, 0.5, error);
    (void)scene;
    if (status != SADMM_OK) return status;
    return sadmm_place_sphere(world, sadmm_frame_moved(ground, 0, 0, sphere.half_extents[0]), &sphere, NULL, error);
}

const struct sadmm_scene_family sadmm_family_rolling = {
    .info = {
        .name = "rolling",
        .arguments = "",
        .description = "a sphere that rolls down a slope at 5/7 g sin alpha",
        .duration = 2.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .fill = fill_rolling,
};

/* ---- rocking: a block let go on one of its lower edges ---- */

/* Housner's block. With R from its centre to the edge and alpha between that line and the block's side, it turns about
 * the edge until the other one hits the ground: at w^2 = 3 g / (2 R) (cos(alpha - tilt) - cos alpha). There the angular
 * momentum about the new edge stays: w' = (1 - 3/2 sin^2 alpha) w. */
static const double block_half[3] = {0.05, 0.1, 0.2};

static sadmm_status fill_rocking(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece block = {
        .half_extents = {block_half[0], block_half[1], block_half[2]}, .mass = 8, .friction = 0.8,
    };
    const double tilt = 0.5 * atan(block_half[0] / block_half[2]); /* of what would tip it over */
    struct sadmm_frame edge = sadmm_frame_turned(sadmm_frame_world(), 1, tilt);
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.8, error);
    (void)scene;
    if (status != SADMM_OK) return status;
    return sadmm_place_box(world, sadmm_frame_moved(edge, -block_half[0], 0, block_half[2]), &block, NULL, error);
}

const struct sadmm_scene_family sadmm_family_rocking = {
    .info = {
        .name = "rocking",
        .arguments = "",
        .description = "a block let go on one edge: it rocks from edge to edge",
        .duration = 1.5,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
    },
    .fill = fill_rocking,
};

/* ---- two_balls: 1 kg hits 3 kg off its centre ---- */

/* The line of centres is 30 degrees off the motion, and friction is too weak to stop the sliding: impulses P along that
 * line and mu P across it. */
static const double ball_radius = 0.1, ball_speed = 2;   /* m, m/s */
static const double flight = 0.25;                       /* s, before they touch */

static sadmm_status fill_balls(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_piece ball = {.half_extents = {ball_radius}, .mass = 3, .friction = 0.1, .restitution = 0.5};
    const double along = sqrt(3) * ball_radius + ball_speed * flight, aside = -ball_radius;
    sadmm_body_id id;
    sadmm_body_state state;
    sadmm_status status = sadmm_place_sphere(world, sadmm_frame_world(), &ball, NULL, error);
    (void)scene;
    ball.mass = 1;
    if (status == SADMM_OK)
        status = sadmm_place_sphere(world, sadmm_frame_moved(sadmm_frame_world(), -along, aside, 0), &ball, &id, error);
    if (status != SADMM_OK) return status;
    status = sadmm_world_body_state(world, id, &state);
    state.linear_velocity[0] = ball_speed;
    if (status == SADMM_OK) status = sadmm_world_set_body_state(world, id, &state);
    return sadmm_scene_world_error(world, status, error);
}

static void configure_balls(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.001; /* they meet within v dt = 2 mm of where they touch */
    def->settings.gravity[2] = 0;
}

const struct sadmm_scene_family sadmm_family_two_balls = {
    .info = {
        .name = "two_balls",
        .arguments = "",
        .description = "a ball of 1 kg hits one of 3 kg off its centre, without gravity",
        .duration = 0.5,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .configure = configure_balls,
    .fill = fill_balls,
};
