/* Spins: free bodies, tops and gyroscopes, to many turns a step. */
#include "core/math/quat.h"
#include "stress.h"

static const char *const two_steps[] = {"dt 5 ms", "dt 1 ms"};

/* A plate with three moments, about no axis of its own: angular momentum and energy are kept. */
static void free_spin(struct stress *s)
{
    const double w = s->value, seconds = stress_seconds(s, 2, 1000);
    struct stress_body plate = {
        .shape = SADMM_SHAPE_BOX, .size = {0.2, 0.1, 0.02}, .mass = 1, .spin = {0.48 * w, 0.6 * w, 0.64 * w}};
    stress_open(s, 0);
    stress_add(s, &plate);
    const struct stress_sums begin = stress_sum(s);
    while (s->time < seconds && stress_step(s)) {
        const struct stress_sums now = stress_sum(s);
        stress_check(s, "angular momentum, share", stress_distance(now.turning, begin.turning) / begin.turning_scale,
                     stress_by(s, 1e-9, 1e-4));
        stress_check(s, "energy, share", fabs(now.kinetic / begin.kinetic - 1), stress_by(s, 1e-9, 1e-4));
    }
}

/* A top, a capsule on its round end, leans by 0.1 rad. Friction at a round end turns about the contact, so Jellett's
 * product of angular momentum and the way from the centre of mass to the contact is kept, and energy is not gained. */
static void top(struct stress *s)
{
    s->def.settings.dt = s->variant ? 0.001 : 0.005;
    const double w = s->value, lean = 0.1, radius = 0.02, half = 0.03, seconds = stress_seconds(s, 1, 20);
    struct stress_body body = {.shape = SADMM_SHAPE_CAPSULE,
                               .size = {radius, half},
                               .mass = 0.1,
                               .friction = 0.3,
                               .position = {0, 0, radius + half * cos(lean)},
                               .spin = {w * sin(lean), 0, w * cos(lean)},
                               .inertia = {2e-5, 2e-5, 3e-5}};
    stress_turn(1, lean, body.orientation);
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.3, 0);
    const sadmm_body_id id = stress_add(s, &body);
    const struct stress_sums begin = stress_sum(s);
    double first = 0;
    while (s->time < seconds && stress_ok(s)) {
        const sadmm_body_state state = stress_state(s, id);
        const mat3 turn = q_matrix(q_load(state.orientation));
        const vec3 axis = v3(turn.r[0].z, turn.r[1].z, turn.r[2].z), spin = v3_load(state.angular_velocity),
                   own = m3_tmul(turn, spin), momentum = m3_mul(turn, v3(2e-5 * own.x, 2e-5 * own.y, 3e-5 * own.z)),
                   down = v3_add(v3_scale(axis, axis.z > 0 ? -half : half), v3(0, 0, -radius));
        const double jellett = v3_dot(momentum, down);
        const struct stress_sums now = stress_sum(s);
        if (first == 0) first = jellett;
        if (axis.z > 0.3) stress_check(s, "Jellett's constant, share", fabs(jellett / first - 1), 0.01);
        stress_check(s, "energy over the start, share",
                     (now.kinetic + now.potential) / (begin.kinetic + begin.potential) - 1, stress_by(s, 1e-6, 1e-5));
        if (!stress_step(s)) return;
    }
    stress_check(s, "overlap, m", s->overlap, 1e-3);
}

/* A wheel on a level axle that is held at its end by a ball joint. With the axle level, m g l = I w W exactly: it stays
 * level and goes round by W. */
static void gyroscope(struct stress *s)
{
    const double w = s->value, arm = 0.1, moment = 2e-3, mass = 1, rate = mass * STRESS_G * arm / (moment * w),
                 seconds = stress_seconds(s, 2, 1000), bound = 0.01;
    s->def.settings.dt = s->variant ? 0.001 : 0.005;
    struct stress_body wheel = {.shape = SADMM_SHAPE_CYLINDER,
                                .size = {0.06, 0.01},
                                .mass = mass,
                                .ghost = true,
                                .position = {arm, 0, 0},
                                .inertia = {1.2e-3, 1.2e-3, moment},
                                .velocity = {0, rate * arm, 0},
                                .spin = {w, 0, rate}};
    sadmm_joint_def ball = sadmm_joint_def_default();
    stress_turn(1, M_PI / 2, wheel.orientation); /* its z along x */
    stress_open(s, STRESS_G);
    ball.kind = SADMM_JOINT_SPHERICAL;
    ball.body_b = stress_add(s, &wheel);
    stress_join(s, &ball, 0, 0, 0, NULL);
    const double start = stress_sum(s).kinetic;
    double turned = 0, last = 0;
    while (s->time < seconds && stress_step(s)) {
        const struct stress_sums now = stress_sum(s);
        const double *x = stress_state(s, ball.body_b).position, angle = atan2(x[1], x[0]);
        turned += remainder(angle - last, 2 * M_PI);
        last = angle;
        stress_check(s, "energy over the start, share", (now.kinetic + now.potential) / start - 1, 1e-4);
        stress_check(s, "off the level, share of the arm", fabs(x[2]) / arm, bound);
        if (s->time > 1) stress_check(s, "rate of going round, share", fabs(turned / (rate * s->time) - 1), bound);
    }
    stress_check(s, "joint open, share of the arm", s->drift / arm, 0.01);
}

/* In both precisions. */
#define LIMIT(most, why) .precisions = STRESS_BOTH, .bound = most, .reason = why
#define TURNS            "a joint that turns by more than 0.1 rad in a step loses energy (docs/guide/limits.md)"
#define ADDS_UP          "errors of second order in a step's turn add up in 1,000 s: half the step leaves a quarter"
#define GAINS            "a gain of the step's fifth order adds up in 1,000 s: half the step leaves a thirtieth"
#define NODS             "its axis nods by several radians a step: steps of 1 ms follow it"

static const struct stress_case cases[] = {
    {.name = "free_spin",
     .about = "a plate with three moments in free space: angular momentum and energy stay",
     .parameter = "rad/s",
     .values = {1, 10, 100, 1e3, 1e4},
     .value_count = 5,
     .quick = 0x12,
     .run = free_spin},
    {.name = "top",
     .about = "a top on a plane with friction: Jellett's constant stays, energy is not gained",
     .parameter = "rad/s",
     .values = {50, 200, 1e3, 1e4},
     .value_count = 4,
     .quick = 0x6,
     .variants = two_steps,
     .variant_count = 2,
     .run = top,
     .limits = {{.check = "Jellett's constant, share", .from = 1e3, .to = 1e4, .variants = 1, LIMIT(2, NODS)},
                {.check = "overlap, m", .from = 1e3, .to = 1e4, .variants = 1, LIMIT(0.01, NODS)}}},
    {.name = "gyroscope",
     .about = "a wheel on a level axle goes round by m g l / (I w) and stays level",
     .parameter = "rad/s",
     .values = {30, 100, 300, 1e3, 1e4},
     .value_count = 5,
     .quick = 0x5,
     .variants = two_steps,
     .variant_count = 2,
     .run = gyroscope,
     .limits = {{.check = "off the level, share of the arm", .from = 0, .to = 1e5, .variants = 1, LIMIT(1.01, TURNS)},
                {.check = "rate of going round, share", .from = 0, .to = 1e5, .variants = 1, LIMIT(1e3, TURNS)},
                {.check = "joint open, share of the arm", .from = 0, .to = 1e5, .variants = 1, LIMIT(0.1, TURNS)},
                {.check = "off the level, share of the arm", .from = 300, .to = 300, .variants = 2,
                 LIMIT(0.02, ADDS_UP)},
                {.check = "energy over the start, share", .from = 30, .to = 30, .variants = 2, LIMIT(5e-4, GAINS)},
                {.check = "off the level, share of the arm", .from = 1e3, .to = 1e4, .variants = 2, LIMIT(1.01, TURNS)},
                {.check = "rate of going round, share", .from = 1e3, .to = 1e4, .variants = 2, LIMIT(500, TURNS)}}},
};
const struct stress_group stress_spins = {cases, sizeof cases / sizeof *cases};
