/* A paddle turns in a bin of N balls, by a motor of 2 rad/s and at most 100 N m. It is as it should be if the paddle
 * has gone round as far as the motor was to turn it, and nothing has left the bin. (Balls, because a row of cubes
 * between blade and wall is a strut of rigid bodies: it stops any motor.) */
#include <math.h>
#include <string.h>

#include "compound.h"
#include "family.h"
#include "subadmm/joint.h"

enum { HEAP = 1 + 4 + 1 }; /* bodies in order of creation: ground, walls, paddle, balls */

static const double bin = 0.4, wall = 0.02, wall_height = 0.3; /* m: half width, half thickness, half height */
static const double large = 0.02, small = 0.016;               /* m, radius of balls */
static const double speed = 2, torque = 100;                   /* rad/s, N m */

static sadmm_status place_wall(sadmm_world *world, int side, struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    const int axis = side / 2;
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    body.environment = -1;
    body.name = "wall";
    body.position[axis] = (side % 2 ? 1 : -1) * (bin + wall);
    body.position[2] = wall_height;
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = 0.4;
    shape.size[axis] = wall;
    shape.size[1 - axis] = bin + 2 * wall;
    shape.size[2] = wall_height;
    sadmm_status status = sadmm_world_add_body(world, &body, &id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, id, &shape, NULL);
    return sadmm_scene_world_error(world, status, error);
}

static struct sadmm_part box(double x, double y, double z, double hx, double hy, double hz, double mass)
{
    struct sadmm_part part = sadmm_part_at(SADMM_SHAPE_BOX, x, y, z, hx, hy, hz, mass);
    part.shape.friction = 0.4;
    return part;
}

/* Two blades in a cross, 10 mm above the ground, so that nothing gets stuck below, and a shaft that is there to look
 * at: it meets nothing. */
static sadmm_status place_paddle(sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_part parts[3] = {
        box(0, 0, 0.025, 0.2, 0.01, 0.015, 1),
        box(0, 0, 0.025, 0.01, 0.2, 0.015, 1),
        box(0, 0, 0.32, 0.02, 0.02, 0.28, 1),
    };
    parts[2].shape.mask = 0;
    static const double unit[4] = {1, 0, 0, 0}, top[3] = {0, 0, 0.6};
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_body_id id;
    sadmm_status status = sadmm_place_compound(world, sadmm_frame_world(), parts, 3, "paddle", &id, error);
    if (status != SADMM_OK) return status;
    def.kind = SADMM_JOINT_REVOLUTE;
    def.body_b = id;
    def.coordinates[5] = (sadmm_joint_coordinate){
        .drive = SADMM_DRIVE_SPEED, .target_speed = speed, .drive_force = torque,
    };
    status = sadmm_world_place_joint(world, &def, top, unit);
    if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
    return sadmm_scene_world_error(world, status, error);
}

/* In layers of a loose grid above the blades. */
static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece load[2] = {{.half_extents = {large}, .mass = 0.04, .friction = 0.4},
                                        {.half_extents = {small}, .mass = 0.02, .friction = 0.4}};
    const double pitch = 2 * large + 0.008;
    const long row = (long)(2 * bin / pitch), layer = row * row;
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.4, error);
    for (int side = 0; side < 4 && status == SADMM_OK; ++side) status = place_wall(world, side, error);
    if (status == SADMM_OK) status = place_paddle(world, error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        const long k = i % layer;
        const double middle = 0.5 * (double)(row - 1);
        struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), pitch * ((double)(k % row) - middle),
                                                  pitch * ((double)(k / row) - middle),
                                                  0.25 + pitch * (double)(i / layer));
        status = sadmm_place_sphere(world, at, &load[i % 2], NULL, error);
    }
    return status;
}

/* Memory: the work of the motor so far, J. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double dt = scene->def.settings.dt, t = (double)step * dt;
    struct sadmm_scene_task *task = &result->tasks[0];
    sadmm_joint_id id;
    sadmm_joint_state joint;
    result->task_count = 1;
    if (task->finished) return SADMM_OK;
    sadmm_status status = sadmm_world_joint_at(world, 0, &id);
    if (status == SADMM_OK) status = sadmm_world_joint_state(world, id, &joint);
    if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
    result->memory[0] += dt * joint.drive_force[5] * joint.speed[5];
    task->name = "mix";
    task->figure_count = 3;
    task->figures[0] = (struct sadmm_scene_figure){"turned", "rad", joint.position[5]};
    task->figures[1] = (struct sadmm_scene_figure){"work", "J", result->memory[0]};
    task->figures[2] = (struct sadmm_scene_figure){"spilled", "", 0};
    if (t < scene->info->duration - 1e-9) return SADMM_OK;
    long spilled = 0;
    for (int32_t i = 0; i < scene->n && status == SADMM_OK; ++i) {
        sadmm_body_id body;
        sadmm_body_state state;
        status = sadmm_world_body_at(world, HEAP + i, &body);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, body, &state);
        const double *p = state.position;
        spilled += !(fabs(p[0]) < bin && fabs(p[1]) < bin && p[2] > 0.9 * small);
    }
    task->figures[2].value = (double)spilled;
    task->finished = true;
    task->passed = joint.position[5] > 0.95 * speed * t && spilled == 0;
    return sadmm_scene_world_error(world, status, error);
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_mixer = {
    .info = {
        .name = "mixer",
        .arguments = "[:N]",
        .description = "a motor turns a paddle in a bin of N balls (N in [1, 800], default 500)",
        .duration = 10,
        .iterations = {[SADMM_METHOD_PAPER] = 200, [SADMM_METHOD_FAST] = 60},
        .chaotic = true,
    },
    .n_default = 500, .n_min = 1, .n_max = 800,
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
