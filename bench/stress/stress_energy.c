/* Long runs: what keeps its energy neither gains any nor loses more than the step's own error. */
#include <string.h>

#include "stress.h"

static double energy(struct stress *s)
{
    const struct stress_sums now = stress_sum(s);
    return now.kinetic + now.potential;
}

/* A ball rolls: speed and way. */
static void rolling(struct stress *s)
{
    const double speed = s->value, radius = 0.1, seconds = stress_seconds(s, 10, 1000);
    const struct stress_body ball = {.shape = SADMM_SHAPE_SPHERE,
                                     .size = {radius},
                                     .mass = 1,
                                     .friction = 0.5,
                                     .position = {0, 0, radius},
                                     .velocity = {speed, 0, 0},
                                     .spin = {0, speed / radius, 0}};
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    const sadmm_body_id id = stress_add(s, &ball);
    while (s->time < seconds && stress_step(s)) {
        const sadmm_body_state state = stress_state(s, id);
        stress_check(s, "speed, share", fabs(state.linear_velocity[0] / speed - 1), stress_by(s, 1e-9, 1e-4));
        stress_check(s, "beside its line, m", fabs(state.position[1]), 1e-6 * seconds);
        stress_check(s, "off the ground, m", fabs(state.position[2] - radius), 2e-5);
    }
    stress_check(s, "way, share", fabs(stress_state(s, id).position[0] / (speed * s->time) - 1),
                 stress_by(s, 1e-9, 1e-4));
}

/* An ellipsoid let go on its long side, leaning by 0.3 rad, rocks without sliding: energy stays. */
static void rocking(struct stress *s)
{
    const double a = 0.2 * s->value, c = 0.1 * s->value, lean = 0.3, seconds = stress_seconds(s, 5, 1000),
                 height = sqrt(pow(a * sin(lean), 2) + pow(c * cos(lean), 2)); /* support of the ellipse, downwards */
    struct stress_body body = {
        .shape = SADMM_SHAPE_ELLIPSOID, .size = {a, c, c}, .mass = 1, .friction = 1, .position = {0, 0, height}};
    stress_turn(1, lean, body.orientation);
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 1, 0);
    stress_add(s, &body);
    const double start = energy(s), swing = start - STRESS_G * c;
    double end = start;
    while (s->time < seconds && stress_step(s)) {
        end = energy(s);
        stress_check(s, "energy over the start, share", (end - start) / swing, stress_by(s, 1e-3, 1e-3));
    }
    stress_check(s, "energy lost, share", (start - end) / swing, 0.1);
}

/* A box is thrown on the ground and tumbles to rest. Energy rises by no more than the first order of the steps in which
 * contacts begin and end. */
static void tumbling(struct stress *s)
{
    const double seconds = stress_seconds(s, 3, 30);
    struct stress_body box = {.shape = SADMM_SHAPE_BOX,
                              .size = {0.1, 0.06, 0.03},
                              .mass = 1,
                              .friction = 0.5,
                              .restitution = s->value,
                              .position = {0, 0, 1},
                              .velocity = {3, 1, 2},
                              .spin = {10, -20, 5}};
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    const sadmm_body_id id = stress_add(s, &box);
    double least = energy(s);
    const double start = least;
    while (s->time < seconds && stress_step(s)) {
        const double now = energy(s);
        stress_check(s, "energy over any before, share", (now - least) / start, 1e-3);
        least = fmin(least, now);
    }
    if (s->value < 1) {
        stress_check(s, "last speed, m/s", stress_norm(stress_state(s, id).linear_velocity), 1e-4);
        const double z = stress_state(s, id).position[2];
        stress_check(s, "last height off a face's, m", fmin(fabs(z - 0.03), fmin(fabs(z - 0.06), fabs(z - 0.1))), 1e-4);
    }
}

/* Elastic balls without friction in a box of six walls. */
static void gas(struct stress *s)
{
    const int side = 4, count = side * side * side;
    const double half = 1, seconds = stress_seconds(s, 5, 1000);
    sadmm_body_id ids[64];
    uint64_t seed = 11;
    s->def.settings.restitution_threshold = 0; /* slow ones bounce too */
    stress_open(s, 0);
    for (int k = 0; k < 6; ++k) {
        struct stress_body wall = {.shape = SADMM_SHAPE_PLANE, .restitution = 1};
        const int axis = k / 2;
        const double sign = k % 2 ? 1 : -1;
        wall.position[axis] = sign * half;
        if (axis == 2) stress_turn(0, sign > 0 ? M_PI : 0, wall.orientation); /* its z inwards */
        else stress_turn(axis == 0 ? 1 : 0, (axis == 0 ? -sign : sign) * M_PI / 2, wall.orientation);
        stress_add(s, &wall);
    }
    for (int k = 0; k < count; ++k) {
        struct stress_body ball = {
            .shape = SADMM_SHAPE_SPHERE,
            .size = {0.05},
            .mass = 1 + k % 3,
            .restitution = 1,
            .position = {0.4 * (k % side - 1.5), 0.4 * (k / side % side - 1.5), 0.4 * (k / side / side - 1.5)}};
        for (int j = 0; j < 3; ++j) ball.velocity[j] = s->value * stress_random(&seed);
        ids[k] = stress_add(s, &ball);
    }
    const double start = stress_sum(s).kinetic;
    while (s->time < seconds && stress_step(s)) {
        const double now = stress_sum(s).kinetic;
        stress_check(s, "energy over the start, share", now / start - 1, stress_by(s, 1e-6, 1e-4));
        for (int k = 0; k < count; k += 7) {
            const sadmm_body_state state = stress_state(s, ids[k]);
            for (int j = 0; j < 3; ++j)
                stress_check(s, "out of the box, m", fabs(state.position[j]) - half + 0.05, 1e-3);
        }
    }
    stress_check(s, "energy lost, share", 1 - stress_sum(s).kinetic / start, stress_by(s, 1e-3, 1e-3));
}

/* Rods with moments of their own, in a row from a fixed point, swing from the level. */
static void swing(struct stress *s, int rods, sadmm_joint_kind kind)
{
    const double seconds = stress_seconds(s, 2, 1000), length = 0.3;
    double along_y[4], mass = 0;
    sadmm_joint_def joint = sadmm_joint_def_default();
    stress_turn(0, M_PI / 2, along_y);
    s->def.settings.dt = s->value;
    stress_open(s, STRESS_G);
    joint.kind = kind;
    for (int k = 0; k < rods; ++k) {
        const struct stress_body rod = {.shape = SADMM_SHAPE_BOX,
                                        .size = {length / 2, 0.05, 0.01 * (k + 1)},
                                        .mass = 1 + k,
                                        .ghost = true,
                                        .position = {length * (k + 0.5), 0, 0},
                                        .spin = {kind == SADMM_JOINT_SPHERICAL ? 5 * (k + 1) : 0, 0, 0}};
        joint.body_a = joint.body_b;
        joint.body_b = stress_add(s, &rod);
        stress_join(s, &joint, length * k, 0, 0, along_y);
        mass += rod.mass;
    }
    const double start = energy(s), scale = mass * STRESS_G * rods * length;
    double end = start;
    while (s->time < seconds && stress_step(s)) {
        end = energy(s);
        stress_check(s, "energy over the start, share", (end - start) / scale, 1e-3);
        stress_check(s, "joints open, share of a rod", s->drift / length, 0.01);
    }
    stress_check(s, "energy lost, share", (start - end) / scale, 0.1);
}

static void pendulum(struct stress *s) { swing(s, 1, SADMM_JOINT_REVOLUTE); }

static const char *const links[] = {"hinges", "ball joints"};
static void mechanism(struct stress *s) { swing(s, 3, s->variant ? SADMM_JOINT_SPHERICAL : SADMM_JOINT_REVOLUTE); }

static const struct stress_case cases[] = {
    {.name = "rolling",
     .about = "a ball rolls for long: speed, way, line",
     .parameter = "m/s",
     .values = {0.1, 1, 10},
     .value_count = 3,
     .quick = 0x2,
     .run = rolling},
    {.name = "rocking",
     .about = "an ellipsoid rocks without sliding: energy",
     .parameter = "size, of 0.2 m",
     .values = {0.1, 1, 10},
     .value_count = 3,
     .quick = 0x2,
     .run = rocking,
     .limits = {{.check = "energy lost, share", .from = 0.1, .to = 1, .precisions = STRESS_BOTH, .bound = 1.01,
                 .reason = "each swing loses an energy of second order in the step: half of it leaves a quarter"},
                {.check = "energy over the start, share", .from = 0.1, .to = 0.1, .precisions = STRESS_BOTH,
                 .bound = 0.02, .reason = "a swing takes 30 steps only; by half the step there is no more energy"}}},
    {.name = "tumbling",
     .about = "a box is thrown on the ground: energy never rises, it comes to rest",
     .parameter = "restitution",
     .values = {0, 0.5, 0.9, 1},
     .value_count = 4,
     .quick = 0x3,
     .run = tumbling},
    {.name = "gas",
     .about = "64 elastic balls in a box: energy",
     .parameter = "m/s",
     .values = {0.2, 1, 10},
     .value_count = 3,
     .quick = 0x2,
     .run = gas},
    {.name = "pendulum",
     .about = "a rod on a hinge swings from the level: energy, joint",
     .parameter = "dt, s",
     .values = {2.5e-4, 1e-3, 5e-3},
     .value_count = 3,
     .quick = 0x2,
     .run = pendulum},
    {.name = "mechanism",
     .about = "three rods of unequal moments in a row swing from the level: energy, joints",
     .parameter = "dt, s",
     .values = {2.5e-4, 1e-3, 5e-3},
     .value_count = 3,
     .quick = 0x6,
     .variants = links,
     .variant_count = 2,
     .run = mechanism,
     .limits = {{.check = "energy lost, share",
                 .from = 5e-3,
                 .to = 5e-3,
                 .precisions = STRESS_BOTH,
                 .bound = 1,
                 .reason = "a joint that turns by more than 0.1 rad in a step loses energy (docs/guide/limits.md)"}}},
};
const struct stress_group stress_energy = {cases, sizeof cases / sizeof *cases};
