#include "joint_cases.h"
#include "subadmm/world.h"

#include <math.h>
#include <string.h>

#define H 0.70710678118654752440
#define C8 0.92387953251128675613
#define S8 0.38268343236508977173
#define ARM {0.04, 0.1, 0.1}
#define POST {0.1, 0.1, 0.04}
#define IDENTITY {1, 0, 0, 0}
#define ALONG_Y {H, -H, 0, 0} /* turns z to y */
#define SLANTED {C8, -S8, 0, 0}

/* Tolerances: position, velocity, acceleration, orientation, angular velocity and acceleration, force, torque. */
static const struct joint_case cases[] = {
    {"Revolute_Case01", "revolute_joint", "", 5e-4, {1e-3, 1e-4, 2e-2, 1e-3, 1e-2, 1e-2, 2e-2, 1e-2},
     SADMM_JOINT_REVOLUTE, {0, 0, 0}, ALONG_Y, {2, 0, 0}, ALONG_Y, .inertia = ARM},
    {"Revolute_Case02", "revolute_joint", "", 5e-4, {1e-3, 1e-4, 1e-2, 1e-3, 1e-5, 1e-2, 1e-2, 1e-2},
     SADMM_JOINT_REVOLUTE, {1, 2, 3}, SLANTED, {3, 2, 3}, SLANTED, .inertia = ARM},
    {"Spherical_Case01", "spherical_joint", "", 5e-4, {2e-3, 1e-3, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-6},
     SADMM_JOINT_SPHERICAL, {0, 0, 0}, IDENTITY, {2, 0, 0}, IDENTITY, .inertia = ARM},
    {"Spherical_Case02", "spherical_joint", "", 5e-4, {2e-3, 1e-3, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-6},
     SADMM_JOINT_SPHERICAL, {1, 2, 3}, SLANTED, {3, 2, 3}, SLANTED, .inertia = ARM},
    {"Cylindrical_Case01", "cylindrical_joint", "", 5e-4, {1e-2, 1e-4, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-6},
     SADMM_JOINT_CYLINDRICAL, {0, 0, 0}, IDENTITY, {2, 0, 0}, IDENTITY, .inertia = ARM},
    {"Cylindrical_Case02", "cylindrical_joint", "", 5e-4, {1e-2, 1e-4, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-6},
     SADMM_JOINT_CYLINDRICAL, {0, 0, 0}, ALONG_Y, {2, 0, 0}, ALONG_Y, .inertia = ARM},
    {"Cylindrical_Case03", "cylindrical_joint", "", 5e-4, {1e-2, 1e-4, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 5e-1},
     SADMM_JOINT_CYLINDRICAL, {1, 2, 3}, SLANTED, {3, 2, 3}, SLANTED, .inertia = ARM},
    {"Prismatic_Case01", "prismatic_joint", "", 5e-4, {1e-2, 1e-4, 2e-2, 1e-3, 2e-2, 2e-2, 1e-6, 1e-6},
     SADMM_JOINT_PRISMATIC, {0, 0, 0}, IDENTITY, {2, 0, 0}, IDENTITY, .inertia = ARM},
    {"Prismatic_Case02", "prismatic_joint", "", 5e-4, {1e-2, 1e-4, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-1},
     SADMM_JOINT_PRISMATIC, {1, 2, 3}, SLANTED, {3, 2, 3}, SLANTED, .inertia = ARM},
    {"Prismatic_Case03", "prismatic_joint", "", 5e-4, {1e-5, 1e-4, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-3},
     SADMM_JOINT_PRISMATIC, {1, 2, 3}, ALONG_Y, {3, 2, 3}, ALONG_Y, .inertia = ARM},
    {"Universal_Case01", "universal_joint", "", 5e-4, {2e-3, 2e-3, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-6},
     SADMM_JOINT_UNIVERSAL, {0, 0, 0}, {H, H, 0, 0}, {0, 2, 0}, {H, H, 0, 0}, .inertia = POST},
    {"Universal_Case02", "universal_joint", "", 5e-4, {2e-3, 2e-3, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-6},
     SADMM_JOINT_UNIVERSAL, {0, 0, 0}, {H, 0, H, 0}, {-2, 0, 0}, {H, 0, H, 0}, .inertia = POST},
    {"Universal_Case03", "universal_joint", "", 5e-4, {2e-3, 2e-3, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 5e-4},
     SADMM_JOINT_UNIVERSAL, {0, 0, 0}, {H, 0.5, -0.5, 0}, {2 * H, 2 * H, 0}, {H, 0.5, -0.5, 0}, .inertia = POST},
    {"Distance_Case01", "distance_constraint", "", 1e-5, {1e-3, 1e-4, 2e-2, 1e-3, 1e-2, 1e-1, 2e-2, 1e-10},
     SADMM_JOINT_DISTANCE, {0, 0, 0}, IDENTITY, {0, 2, 0}, IDENTITY, .inertia = ARM},
    {"Distance_Case02", "distance_constraint", "", 1e-5, {1e-3, 2e-3, 2, 4e-3, 2e-2, 20, 1e-1, 1e-10},
     SADMM_JOINT_DISTANCE, {1, 2, 3}, IDENTITY, {-1, 4, 3}, IDENTITY, .end = {2, 0, 0}, .inertia = ARM},
    {"Distance_Case03", "distance_constraint", "", 1e-5, {1e-3, 1e-4, 2e-2, 1e-3, 1e-2, 1e-1, 2e-2, 1e-10},
     SADMM_JOINT_DISTANCE, {0, 0, 0}, IDENTITY, {0, 4, 0}, {H, 0, 0, -H}, .end = {2, 0, 0}, .inertia = ARM},
    {"RevSpherical_Case01", "revsph_constraint", "_Body1", 1e-5, {1e-4, 1e-4, 1e-1, 1e-5, 1e-4, 5e-1, 5e-1, 5e-1},
     SADMM_JOINT_LINK, {0, 0, 0}, IDENTITY, {2, 2, 0}, IDENTITY, .end = {0, -2, 0}, .inertia = {0.1, 0.04, 0.1}},
    {"RevSpherical_Case02", "revsph_constraint", "_Body1", 1e-5, {1e-4, 1e-4, 1e-1, 1e-5, 1e-3, 5e-1, 5e-1, 5e-1},
     SADMM_JOINT_LINK, {1, 2, 3}, SLANTED, {3, 4, 3}, IDENTITY, .end = {0, -2, 0}, .inertia = {0.1, 0.04, 0.1}},
    {"RotSpring_Case01", "rotspring_force", "", 2e-4, {1e-3, 5e-4, 2e-2, 1e-3, 1e-3, 5e-3, 5e-3, 1e-2},
     SADMM_JOINT_REVOLUTE, {0, 0, 0}, ALONG_Y, {2, 0, 0}, ALONG_Y, .inertia = ARM, .coordinate = 5,
     .law = {.spring_stiffness = 200, .spring_damping = 10}},
    {"RotSpring_Case02", "rotspring_force", "", 2e-4, {1e-3, 5e-4, 2e-2, 1e-3, 1e-3, 5e-3, 5e-3, 1e-2},
     SADMM_JOINT_REVOLUTE, {0, 0, 0}, ALONG_Y, {2, 0, 0}, ALONG_Y, .inertia = ARM, .coordinate = 5,
     .law = {.spring_stiffness = 50, .spring_damping = 10}, .progressive = 10},
    {"TranSpring_Case01", "transpring_force", "", 1e-4, {1e-3, 3e-4, 2e-2, 1e-10, 1e-10, 1e-10, 5e-3, 0},
     SADMM_JOINT_SPRING, {0, 0, 0}, IDENTITY, {0, 0, 0}, IDENTITY, .inertia = ARM,
     .law = {.spring_stiffness = 10, .spring_damping = 0.5}},
    {"TranSpring_Case02", "transpring_force", "", 1e-4, {1e-3, 3e-4, 2e-2, 1e-10, 1e-10, 1e-10, 5e-3, 0},
     SADMM_JOINT_SPRING, {0, 0, 0}, IDENTITY, {0, 2, 0}, IDENTITY, .inertia = ARM,
     .law = {.spring_stiffness = 100, .spring_damping = 5, .spring_rest = 2}},
    {"TranSpringCB_Case03", "transpringcb_force", "", 1e-5, {1e-4, 5e-4, 1e-3, 5e-5, 5e-3, 5e-2, 5e-3, 0},
     SADMM_JOINT_SPRING, {1, 2, 3}, IDENTITY, {-1, 4, 3}, IDENTITY, .end = {2, 0, 0}, .inertia = ARM,
     .law = {.spring_stiffness = 50, .spring_damping = 5, .spring_rest = 2}, .progressive = 10},
    {"TranSpringCB_Case04", "transpringcb_force", "", 1e-5, {1e-4, 5e-4, 1e-3, 5e-5, 5e-3, 5e-2, 5e-3, 0},
     SADMM_JOINT_SPRING, {0, 0, 0}, IDENTITY, {0, 4, 0}, {H, 0, 0, -H}, .end = {2, 0, 0}, .inertia = ARM,
     .law = {.spring_stiffness = 50, .spring_damping = 5, .spring_rest = 2}, .progressive = 10},
    {"LinActuator_Case01", "lin_actuator", "P", 1e-3, {2e-3, 1e-3, 2e-2, 1e-3, 2e-2, 2e-2, 2e-2, 1e-10},
     SADMM_JOINT_PRISMATIC, {0, 0, 0}, IDENTITY, {0, 0, 0}, IDENTITY, {0, 0, 1}, .inertia = {1, 1, 1},
     .coordinate = 2, .law = {.drive = SADMM_DRIVE_SPEED, .target_speed = 1}},
    {"LinActuator_Case02", "lin_actuator", "P", 1e-3, {2e-3, 1e-3, 2e-2, 1e-3, 2e-2, 2e-2, 3e-1, 5e-3},
     SADMM_JOINT_PRISMATIC, {0, 0, 0}, {C8, 0, S8, 0}, {0, 0, 0}, {C8, 0, S8, 0}, {0.5 * H, 0, 0.5 * H},
     .inertia = {1, 1, 1}, .coordinate = 2, .law = {.drive = SADMM_DRIVE_SPEED, .target_speed = 0.5}},
};

size_t joint_case_count(void) { return sizeof cases / sizeof *cases; }
const struct joint_case *joint_case_at(size_t index) { return index < joint_case_count() ? &cases[index] : NULL; }

static bool is_radial(const struct joint_case *which)
{
    return which->kind == SADMM_JOINT_DISTANCE || which->kind == SADMM_JOINT_SPRING || which->kind == SADMM_JOINT_LINK;
}

/* ---- the world --------------------------------------------------------------------------------------------------- */

static sadmm_status fill(const struct joint_case *which, sadmm_world *world)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_joint_def joint = sadmm_joint_def_default();
    body.mass = 1;
    memcpy(body.inertia, which->inertia, sizeof body.inertia);
    memcpy(body.position, which->position, sizeof body.position);
    memcpy(body.orientation, which->orientation, sizeof body.orientation);
    memcpy(body.linear_velocity, which->velocity, sizeof body.linear_velocity);
    sadmm_status status = sadmm_world_add_body(world, &body, &joint.body_b);
    if (status != SADMM_OK) return status;
    joint.kind = which->kind;
    if (!is_radial(which)) status = sadmm_world_place_joint(world, &joint, which->place, which->frame);
    if (status != SADMM_OK) return status;
    if (is_radial(which)) {
        memcpy(joint.position_a, which->place, sizeof joint.position_a);
        memcpy(joint.orientation_a, which->frame, sizeof joint.orientation_a);
        memcpy(joint.position_b, which->end, sizeof joint.position_b);
    }
    joint.coordinates[which->coordinate] = which->law;
    for (int k = 0; k < 6; ++k) joint.coordinates[k].drive_force = INFINITY;
    return sadmm_world_add_joint(world, &joint, NULL);
}

sadmm_status joint_case_build(const struct joint_case *which, const sadmm_world_def *def, sadmm_world **world)
{
    sadmm_status status = sadmm_world_create(def, world);
    if (status != SADMM_OK) return status;
    status = fill(which, *world);
    if (status == SADMM_OK) return SADMM_OK;
    sadmm_world_destroy(*world);
    *world = NULL;
    return status;
}

/* ---- a run ------------------------------------------------------------------------------------------------------- */

/* A step: velocities at its end, and what acts in it. */
struct step {
    sadmm_body_state state;
    sadmm_joint_state joint;
    double acceleration[6], force[3], torque[3];
};

struct run {
    const struct joint_case *which;
    sadmm_world *world;
    sadmm_body_id body;
    sadmm_joint_id joint;
    sadmm_settings settings;
    struct step last[2]; /* [0] the one before [1] */
};

static void add_cross(const double a[3], const double b[3], double out[3])
{
    out[0] += a[1] * b[2] - a[2] * b[1];
    out[1] += a[2] * b[0] - a[0] * b[2];
    out[2] += a[0] * b[1] - a[1] * b[0];
}

/* z of the joint's frame in the world. */
static void sliding_axis(const struct joint_case *which, double axis[3])
{
    const double *q = which->frame;
    axis[0] = 2 * (q[1] * q[3] + q[0] * q[2]);
    axis[1] = 2 * (q[2] * q[3] - q[0] * q[1]);
    axis[2] = 1 - 2 * (q[1] * q[1] + q[2] * q[2]);
}

/* On the ground, without a drive's. */
static void find_reaction(const struct joint_case *which, struct step *step)
{
    double axis[3], way[3];
    sliding_axis(which, axis);
    for (int k = 0; k < 3; ++k) {
        step->force[k] = step->joint.wrench_a[k] + step->joint.drive_force[2] * axis[k];
        step->torque[k] = step->joint.wrench_a[k + 3];
        way[k] = step->joint.point[k] - which->place[k];
    }
    if (which->kind != SADMM_JOINT_DISTANCE && which->kind != SADMM_JOINT_SPRING)
        add_cross(way, step->force, step->torque);
}

/* A progressive spring as a linear one, its tangent at where the coordinate is. */
static sadmm_status adapt_spring(struct run *run)
{
    const struct joint_case *which = run->which;
    const double stretch = run->last[1].joint.position[which->coordinate] - which->law.spring_rest;
    const double force = -(which->law.spring_stiffness + which->progressive * fabs(stretch)) * stretch;
    sadmm_joint_coordinate law = which->law;
    law.drive_force = INFINITY;
    law.spring_stiffness += 2 * which->progressive * fabs(stretch);
    law.spring_rest += stretch + force / law.spring_stiffness;
    return sadmm_world_set_joint_coordinate(run->world, run->joint, which->coordinate, &law);
}

static sadmm_status read(struct run *run, struct step *step)
{
    sadmm_status status = sadmm_world_body_state(run->world, run->body, &step->state);
    return status == SADMM_OK ? sadmm_world_joint_state(run->world, run->joint, &step->joint) : status;
}

static sadmm_status make_step(struct run *run)
{
    sadmm_status status = run->which->progressive > 0 ? adapt_spring(run) : SADMM_OK;
    if (status == SADMM_OK) status = sadmm_world_step(run->world);
    if (status != SADMM_OK) return status;
    struct step *step = &run->last[1];
    const sadmm_body_state before = step->state;
    run->last[0] = *step;
    status = read(run, step);
    for (int k = 0; k < 3; ++k) {
        step->acceleration[k] = (step->state.linear_velocity[k] - before.linear_velocity[k]) / run->settings.dt;
        step->acceleration[k + 3] = (step->state.angular_velocity[k] - before.angular_velocity[k]) / run->settings.dt;
    }
    find_reaction(run->which, step);
    return status;
}

static double energy_of(const struct run *run, const sadmm_body_state *s)
{
    const double *q = s->orientation, *w = s->angular_velocity, *v = s->linear_velocity;
    const double axes[3][3] = {
        {1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] + q[0] * q[3]), 2 * (q[1] * q[3] - q[0] * q[2])},
        {2 * (q[1] * q[2] - q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] + q[0] * q[1])},
        {2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])}};
    double energy = 0;
    for (int k = 0; k < 3; ++k) {
        const double along = axes[k][0] * w[0] + axes[k][1] * w[1] + axes[k][2] * w[2];
        energy += v[k] * v[k] / 2 + run->which->inertia[k] * along * along / 2 -
                  run->settings.gravity[k] * s->position[k];
    }
    return energy;
}

/* The state after step `at`, and rates there by the shares of the two steps known. */
static void take_sample(const struct run *run, const struct step *at, double of_first, struct joint_sample *sample)
{
    const struct step *a = &run->last[0], *b = &run->last[1];
    const double of_second = 1 - of_first;
    double (*value)[4] = sample->value;
    memset(sample, 0, sizeof *sample);
    memcpy(value[JOINT_ORIENTATION], at->state.orientation, sizeof at->state.orientation);
    for (int k = 0; k < 3; ++k) {
        value[JOINT_POSITION][k] = at->state.position[k];
        value[JOINT_VELOCITY][k] = at->state.linear_velocity[k];
        value[JOINT_ANGULAR_VELOCITY][k] = at->state.angular_velocity[k];
        value[JOINT_ACCELERATION][k] = of_first * a->acceleration[k] + of_second * b->acceleration[k];
        value[JOINT_ANGULAR_ACCELERATION][k] = of_first * a->acceleration[k + 3] + of_second * b->acceleration[k + 3];
        value[JOINT_FORCE][k] = of_first * a->force[k] + of_second * b->force[k];
        value[JOINT_TORQUE][k] = of_first * a->torque[k] + of_second * b->torque[k];
    }
    sample->energy = energy_of(run, &at->state);
}

/* The largest error of what is locked. */
static double violation_of(const sadmm_joint_state *state, uint32_t locks)
{
    double most = 0;
    for (int k = 0; k < 6; ++k)
        if (locks >> k & 1) most = fmax(most, fabs(state->position[k]));
    return most;
}

sadmm_status joint_case_run(const struct joint_case *which, sadmm_world *world, int every, int count,
                            struct joint_sample *samples)
{
    struct run run = {.which = which, .world = world, .settings = sadmm_world_settings(world)};
    struct step start;
    sadmm_joint_def def;
    sadmm_status status = sadmm_world_body_at(world, 0, &run.body);
    if (status == SADMM_OK) status = sadmm_world_joint_at(world, 0, &run.joint);
    if (status == SADMM_OK) status = sadmm_world_joint_def(world, run.joint, &def);
    if (status == SADMM_OK) status = read(&run, &run.last[1]);
    start = run.last[1];
    for (int k = 0; k < count && status == SADMM_OK; ++k) {
        /* until one step after the instant; for the first, two */
        for (int s = k > 1 ? 0 : k == 1 ? 1 : every - 2; s < every && status == SADMM_OK; ++s) status = make_step(&run);
        if (status != SADMM_OK) break;
        if (k == 0) take_sample(&run, &start, 1.5, &samples[k]);
        else take_sample(&run, &run.last[0], 0.5, &samples[k]);
        samples[k].violation = violation_of(k == 0 ? &start.joint : &run.last[0].joint, def.locks);
    }
    return status;
}
