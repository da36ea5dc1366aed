/* N ragdolls of eleven capsules fall on each other: hinges with limits in elbows and knees, ball joints with limits
 * everywhere else. It is as it should be if at the end no joint is apart, none is bent beyond its limits, and nobody
 * has fallen through the ground. */
#include <math.h>
#include <string.h>

#include "compound.h"
#include "core/math/quat.h"
#include "family.h"
#include "subadmm/joint.h"

enum { PARTS = 11, JOINTS = PARTS - 1 };
enum {
    PELVIS, CHEST, HEAD, ARM_LEFT, ARM_RIGHT, HAND_LEFT, HAND_RIGHT, THIGH_LEFT, THIGH_RIGHT, SHIN_LEFT, SHIN_RIGHT
};

/* A standing figure of 1.8 m and 70 kg; z up, y to its left. Capsules along y (arms too, which are stretched out) or z.
 * `bend`, `twist`: limits of the joint to the parent, rad; hinges (twist 0) bend by 0 to `bend` about an axis of the
 * figure's, y for knees, z for elbows. */
static const struct limb {
    double centre[3], joint[3]; /* m */
    double radius, half_length;
    int axis, parent;
    double mass, bend, twist;
} limbs[PARTS] = {
    [PELVIS] = {{0, 0, 1.0}, {0, 0, 0}, 0.11, 0.07, 1, -1, 14, 0, 0},
    [CHEST] = {{0, 0, 1.32}, {0, 0, 1.14}, 0.13, 0.08, 1, PELVIS, 22, 0.5, 0.4},
    [HEAD] = {{0, 0, 1.64}, {0, 0, 1.5}, 0.1, 0.04, 2, CHEST, 5, 0.6, 0.8},
    [ARM_LEFT] = {{0, 0.39, 1.38}, {0, 0.24, 1.38}, 0.05, 0.1, 1, CHEST, 2.5, 1.2, 0.6},
    [ARM_RIGHT] = {{0, -0.39, 1.38}, {0, -0.24, 1.38}, 0.05, 0.1, 1, CHEST, 2.5, 1.2, 0.6},
    [HAND_LEFT] = {{0, 0.68, 1.38}, {0, 0.54, 1.38}, 0.04, 0.1, 1, ARM_LEFT, 2, 2.2, 0},
    [HAND_RIGHT] = {{0, -0.68, 1.38}, {0, -0.54, 1.38}, 0.04, 0.1, 1, ARM_RIGHT, 2, 2.2, 0},
    [THIGH_LEFT] = {{0, 0.11, 0.7}, {0, 0.11, 0.92}, 0.08, 0.14, 2, PELVIS, 7, 1.0, 0.5},
    [THIGH_RIGHT] = {{0, -0.11, 0.7}, {0, -0.11, 0.92}, 0.08, 0.14, 2, PELVIS, 7, 1.0, 0.5},
    [SHIN_LEFT] = {{0, 0.11, 0.28}, {0, 0.11, 0.48}, 0.06, 0.16, 2, THIGH_LEFT, 4, 2.2, 0},
    [SHIN_RIGHT] = {{0, -0.11, 0.28}, {0, -0.11, 0.48}, 0.06, 0.16, 2, THIGH_RIGHT, 4, 2.2, 0},
};

/* Eight dolls one above the other, each with a turn and tilt of its own; then the next eight. */
static struct sadmm_frame doll_at(long i)
{
    const double tower = 1.5 * (double)(i / 8), level = (double)(i % 8);
    struct sadmm_frame at = sadmm_frame_world();
    at = sadmm_frame_moved(at, tower + 0.25 * cos(2.4 * level), 0.25 * sin(2.4 * level), 1.4 + 1.1 * level);
    at = sadmm_frame_turned(sadmm_frame_turned(at, 2, 1.3 * (double)i), 1, 1.2 + 0.3 * (double)(i % 3));
    return sadmm_frame_moved(at, 0, 0, -1);
}

static void limit_ball(sadmm_joint_def *def, double bend, double twist)
{
    for (int k = 3; k < 6; ++k) {
        def->coordinates[k].limited = true;
        def->coordinates[k].upper = k == 5 ? twist : bend;
        def->coordinates[k].lower = -def->coordinates[k].upper;
        def->coordinates[k].friction = 0.5;
    }
}

/* The joint's z is along the limb (balls), or along the hinge's axis. */
static sadmm_status join(sadmm_world *world, struct sadmm_frame doll, int part, const sadmm_body_id *ids,
                         struct sadmm_error *error)
{
    static const double s = 0.70710678118654752440;
    static const double turns[3][4] = {{s, 0, s, 0}, {s, -s, 0, 0}, {1, 0, 0, 0}}; /* z to x, to y, to z */
    const struct limb *l = &limbs[part];
    sadmm_joint_def def = sadmm_joint_def_default();
    int axis = l->axis;
    def.body_a = ids[l->parent];
    def.body_b = ids[part];
    if (l->twist > 0) {
        def.kind = SADMM_JOINT_SPHERICAL;
        limit_ball(&def, l->bend, l->twist);
    } else {
        /* Shins go back, which is about +y; hands forward: about -z on the left, +z on the right. */
        const bool back = part == SHIN_LEFT || part == SHIN_RIGHT || part == HAND_RIGHT;
        axis = l->axis == 2 ? 1 : 2;
        def.kind = SADMM_JOINT_REVOLUTE;
        def.coordinates[5].limited = true;
        def.coordinates[5].lower = back ? 0 : -l->bend;
        def.coordinates[5].upper = back ? l->bend : 0;
        def.coordinates[5].friction = 0.5;
    }
    const struct sadmm_frame at = sadmm_frame_moved(doll, l->joint[0], l->joint[1], l->joint[2]);
    double orientation[4];
    q_store(q_normalize(q_mul(q_load(at.orientation), q_load(turns[axis]))), orientation);
    sadmm_status status = sadmm_world_place_joint(world, &def, at.origin, orientation);
    if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
    return sadmm_scene_world_error(world, status, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    static const double s = 0.70710678118654752440, along_y[4] = {s, -s, 0, 0};
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.6, error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        const struct sadmm_frame doll = doll_at(i);
        sadmm_body_id ids[PARTS];
        for (int k = 0; k < PARTS && status == SADMM_OK; ++k) {
            const struct limb *l = &limbs[k];
            struct sadmm_part part =
                sadmm_part_at(SADMM_SHAPE_CAPSULE, 0, 0, 0, l->radius, l->half_length, 0, l->mass);
            if (l->axis == 1) memcpy(part.shape.orientation, along_y, sizeof along_y);
            const struct sadmm_frame at = sadmm_frame_moved(doll, l->centre[0], l->centre[1], l->centre[2]);
            status = sadmm_place_compound(world, at, &part, 1, NULL, &ids[k], error);
        }
        for (int k = 1; k < PARTS && status == SADMM_OK; ++k) status = join(world, doll, k, ids, error);
    }
    return status;
}

/* How far beyond its limits a coordinate is, rad. */
static double beyond(const sadmm_joint_coordinate *c, double q)
{
    return c->limited ? fmax(0, fmax(c->lower - q, q - c->upper)) : 0;
}

static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt;
    struct sadmm_scene_task *task = &result->tasks[0];
    double apart = 0, over = 0, lowest = INFINITY;
    if (step == 0) {
        result->task_count = 1;
        *task = (struct sadmm_scene_task){
            .name = "fall", .figures = {{"apart", "m", 0}, {"beyond limits", "rad", 0}, {"lowest", "m", 0}},
            .figure_count = 3,
        };
    }
    if (task->finished || t < scene->info->duration - 1e-9) return SADMM_OK;
    for (int32_t k = 0; k < scene->n * JOINTS; ++k) {
        sadmm_joint_id id;
        sadmm_joint_state joint;
        sadmm_joint_def def;
        sadmm_status status = sadmm_world_joint_at(world, k, &id);
        if (status == SADMM_OK) status = sadmm_world_joint_state(world, id, &joint);
        if (status == SADMM_OK) status = sadmm_world_joint_def(world, id, &def);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        apart = fmax(apart, v3_norm(v3_load(joint.position)));
        for (int c = 3; c < 6; ++c) over = fmax(over, beyond(&def.coordinates[c], joint.position[c]));
    }
    for (int32_t k = 0; k < scene->n * PARTS; ++k) {
        sadmm_body_id id;
        sadmm_body_state body;
        sadmm_status status = sadmm_world_body_at(world, 1 + k, &id);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, id, &body);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        lowest = fmin(lowest, body.position[2]);
    }
    task->figures[0].value = apart;
    task->figures[1].value = over;
    task->figures[2].value = lowest;
    task->finished = true;
    /* the thinnest capsule's radius is 0.04 */
    task->passed = apart < 2e-3 && over < 0.02 && lowest > 0.035;
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_ragdolls = {
    .info = {
        .name = "ragdolls",
        .arguments = "[:N]",
        .description = "N ragdolls of eleven capsules fall on each other (N in [1, 1000], default 8)",
        .duration = 6,
        .iterations = {[SADMM_METHOD_PAPER] = 200, [SADMM_METHOD_FAST] = 60},
        .chaotic = true,
    },
    .n_default = 8, .n_min = 1, .n_max = 1000,
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
