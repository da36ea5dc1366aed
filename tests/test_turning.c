/* Joints whose axes and arms turn by more in a step than a step resolves: long steps, fast bodies, distances of next to
 * no length. No mechanism gains energy, whatever its bodies begin with, and none comes to numbers that are not
 * finite. */
#include <float.h>

#include "core/math/rigid.h"
#include "fewer.h"
#include "fixed_work.h"
#include "scene_tools.h"

enum { MOST_BODIES = 8, STEPS = 300 };
static const double dts[] = {0.005, 0.05, 0.2, 0.5, 1};
enum { DTS = sizeof dts / sizeof *dts };

struct mechanism {
    sadmm_world *world;
    sadmm_body_id bodies[MOST_BODIES];
    int count;
    double gravity;
};

static uint64_t state;

/* [-1, 1) */
static double number(void)
{
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(state >> 11) * 0x1p-52 - 1;
}

static void add_body(struct mechanism *m, double x, double moment)
{
    sadmm_body_def def = sadmm_body_def_default();
    def.mass = 1;
    def.inertia[0] = moment, def.inertia[1] = def.inertia[2] = 2 * moment;
    def.position[0] = x;
    MUST(m->world, sadmm_world_add_body(m->world, &def, &m->bodies[m->count++]));
}

static void set_in_motion(struct mechanism *m, double linear, double angular)
{
    for (int b = 0; b < m->count; ++b) {
        sadmm_body_state s = body_state(m->world, m->bodies[b]);
        for (int k = 0; k < 3; ++k)
            s.linear_velocity[k] = linear * number(), s.angular_velocity[k] = angular * number();
        MUST(m->world, sadmm_world_set_body_state(m->world, m->bodies[b], &s));
    }
}

/* a -1: the static world. */
static void join(struct mechanism *m, sadmm_joint_kind kind, int a, int b, double x)
{
    const double place[3] = {x, 0, 0}, along_y[4] = {sqrt(0.5), -sqrt(0.5), 0, 0};
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = kind;
    if (a >= 0) def.body_a = m->bodies[a];
    def.body_b = m->bodies[b];
    MUST(m->world, sadmm_world_place_joint(m->world, &def, place, along_y));
    MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
}

/* Between two bodies, from 0.5 m off the one to as far off the other, whose ends are `length` apart. */
static void connect(struct mechanism *m, double length)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    add_body(m, 0, 0.004);
    add_body(m, 1 + length, 0.004);
    def.kind = SADMM_JOINT_DISTANCE;
    def.body_a = m->bodies[0], def.body_b = m->bodies[1];
    def.position_a[0] = 0.5, def.position_b[0] = -0.5;
    MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
}

static void pendulum(struct mechanism *m, sadmm_joint_kind kind)
{
    add_body(m, 0.5, 0.01);
    join(m, kind, -1, 0, 0);
}

static void chain(struct mechanism *m, sadmm_joint_kind kind, int links)
{
    for (int k = 0; k < links; ++k) {
        add_body(m, 0.1 + 0.2 * k, 0.002);
        join(m, kind, k - 1, k, 0.2 * k);
    }
}

/* In the air. */
static void pair(struct mechanism *m)
{
    add_body(m, 0, 0.01);
    add_body(m, 1, 0.01);
    join(m, SADMM_JOINT_SPHERICAL, 0, 1, 0.5);
}

/* A point of a body in a plane. */
static void in_plane(struct mechanism *m)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    add_body(m, 0.5, 0.01);
    def.kind = SADMM_JOINT_CUSTOM;
    def.locks = 1;
    def.body_b = m->bodies[0];
    def.position_b[0] = -0.5, def.position_b[1] = 0.2;
    MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
}

static void make(struct mechanism *m, int which)
{
    switch (which) {
    case 0: pendulum(m, SADMM_JOINT_REVOLUTE); break;
    case 1: pendulum(m, SADMM_JOINT_SPHERICAL); break;
    case 2: pendulum(m, SADMM_JOINT_UNIVERSAL); break;
    case 3: chain(m, SADMM_JOINT_REVOLUTE, 2); break;
    case 4: chain(m, SADMM_JOINT_SPHERICAL, MOST_BODIES); break;
    case 5: pair(m); break;
    case 6: in_plane(m); break;
    case 7: connect(m, 0.1); break;
    case 8: connect(m, 1e-3); break;
    case 9: connect(m, 1e-9); break;
    default: connect(m, 0); break;
    }
}
enum { MECHANISMS = 11 };

static double energy(struct mechanism *m)
{
    double sum = 0;
    for (int b = 0; b < m->count; ++b) {
        const sadmm_body_def d = body_def(m->world, m->bodies[b]);
        const vec3 spin = m3_tmul(q_matrix(q_load(d.orientation)), v3_load(d.angular_velocity));
        sum += d.mass * (v3_norm2(v3_load(d.linear_velocity)) / 2 + m->gravity * d.position[2]) +
               (d.inertia[0] * spin.x * spin.x + d.inertia[1] * spin.y * spin.y + d.inertia[2] * spin.z * spin.z) / 2;
    }
    return sum;
}

/* Of the energy that there is in motion, or to fall by a link's metre. */
static double gain(int which, double dt, bool heavy, int beginning)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.gravity[2] = heavy ? -9.81 : 0;
    struct mechanism m = {.world = create_world(&def), .gravity = -def.settings.gravity[2]};
    state = (uint64_t)(100 * which + beginning);
    make(&m, which);
    set_in_motion(&m, 1, 3);
    const double first = energy(&m), size = first + m.gravity * m.count;
    double most = first;
    for (int step = 0; step < STEPS; ++step) {
        step_world(m.world, 1);
        most = fmax(most, energy(&m));
    }
    sadmm_world_destroy(m.world);
    return (most - first) / size;
}

/* What there is left: at 5 ms rows turn by less than a step resolves, and the error of the step may be either way; a
 * fall in long steps is off by half a step's, m g^2 dt^2 / 8 a body, once; with steps of 1 s, in which a link falls by
 * five of its lengths, by twice as much where its joint's stiffness is of account. Steps of 0.2 s and more resolve
 * nothing of such a motion: with SADMM_TEST_ALL, of 400 beginnings of a double pendulum 2, 2 and 12 gain more. */
START_TEST(no_mechanism_gains_energy)
{
    const int beginnings = getenv("SADMM_TEST_ALL") ? 400 : fewer(10);
    for (int d = 0; d < DTS; ++d)
        for (int heavy = 0; heavy < 2; ++heavy) {
            int gains = 0;
            for (int beginning = 0; beginning < beginnings; ++beginning)
                gains += gain(_i, dts[d], heavy, beginning) >
                         0.05 + (heavy ? (dts[d] < 1 ? 1 : 2) * 9.81 * dts[d] * dts[d] / 8 : 0);
            if (getenv("SADMM_TEST_ALL"))
                printf("mechanism %d, dt %g, gravity %d: %d of %d gain energy\n", _i, dts[d], heavy, gains, beginnings);
            ck_assert_msg(gains <= (dts[d] < 0.2 ? 0 : (beginnings + 9) / 10),
                          "mechanism %d, dt %g, gravity %d: %d of %d gain energy", _i, dts[d], heavy, gains,
                          beginnings);
        }
}
END_TEST

/* ---- energy for long --------------------------------------------------------------------------------------------- */

static void string(struct mechanism *m)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    add_body(m, 0.5, 0.01);
    def.kind = SADMM_JOINT_DISTANCE;
    def.body_b = m->bodies[0];
    def.length = 0.4;
    def.position_b[0] = -0.1;
    MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
}

static void hinged(struct mechanism *m) { pendulum(m, SADMM_JOINT_REVOLUTE); }
static void cardan(struct mechanism *m) { pendulum(m, SADMM_JOINT_UNIVERSAL); }
static void hinges(struct mechanism *m) { chain(m, SADMM_JOINT_REVOLUTE, 3); }
static void balls(struct mechanism *m) { chain(m, SADMM_JOINT_SPHERICAL, 3); }

/* Ball joints as springs: stiff ones are locks. */
static void springs(struct mechanism *m)
{
    for (int k = 0; k < 3; ++k) {
        sadmm_joint_def def = sadmm_joint_def_default();
        add_body(m, 0.1 + 0.2 * k, 0.002);
        def.kind = SADMM_JOINT_CUSTOM;
        if (k > 0) def.body_a = m->bodies[k - 1], def.position_a[0] = 0.1;
        def.body_b = m->bodies[k];
        def.position_b[0] = -0.1;
        for (int i = 0; i < 3; ++i) def.coordinates[i].spring_stiffness = 1e9;
        MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
    }
}

/* Where a step resolves the turning of rows, locks do no work in the long run (joint_foresee), and all is let go
 * level, with some spin where it may have. Bounds are shares of the energy that there is to fall by a metre. What is
 * lost is of fifth order. */
static const struct {
    const char *name;
    void (*make)(struct mechanism *);
    double dt, seconds, spin, gained, lost;
} swings[] = {
    {"a hinge", hinged, 0.005, 300, 0, 1e-3, 0.01},
    {"a universal joint", cardan, 0.002, 100, 1, 1e-3, 0.01},
    {"a distance", string, 0.002, 100, 1, 1e-3, 0.01},
    {"three hinges", hinges, 0.001, 100, 0, 1e-3, 0.02},
    {"three ball joints", balls, 0.001, 100, 1, 1e-3, 0.02},
    {"three stiff springs", springs, 0.001, 100, 1, 1e-3, 0.02},
};
enum { SWINGS = sizeof swings / sizeof *swings };

START_TEST(what_swings_keeps_its_energy)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = swings[_i].dt;
    def.settings.gravity[2] = -9.81;
    struct mechanism m = {.world = create_world(&def), .gravity = 9.81};
    state = 7;
    swings[_i].make(&m);
    if (swings[_i].spin > 0) set_in_motion(&m, 0, swings[_i].spin);
    step_world(m.world, 1); /* takes what no joint allows */
    const double first = energy(&m), size = m.gravity * m.count;
    double most = first, last = first;
    for (int step = fewer((int)(swings[_i].seconds / swings[_i].dt)); step > 0; --step) {
        step_world(m.world, 1);
        last = energy(&m);
        most = fmax(most, last);
    }
    if (getenv("SADMM_TEST_ALL"))
        printf("%s: gained %g, lost %g\n", swings[_i].name, (most - first) / size, (first - last) / size);
    ck_assert_msg(most - first < swings[_i].gained * size, "%s: %g gained", swings[_i].name, (most - first) / size);
    ck_assert_msg(first - last < swings[_i].lost * size, "%s: %g lost", swings[_i].name, (first - last) / size);
    sadmm_world_destroy(m.world);
}
END_TEST

/* A wheel turns about its own axle: nothing is off its axis, and it goes on for ever, by whatever angle a step. */
START_TEST(a_balanced_wheel_goes_on)
{
    for (int d = 0; d < DTS; ++d) {
        sadmm_world_def def = fixed_world_def();
        def.settings.dt = dts[d];
        def.settings.gravity[2] = 0;
        struct mechanism m = {.world = create_world(&def)};
        add_body(&m, 0, 0.01);
        MUST(m.world, sadmm_world_set_body_mass(m.world, m.bodies[0], 1, (double[]){0.01, 0.01, 0.01}));
        join(&m, SADMM_JOINT_REVOLUTE, -1, 0, 0);
        sadmm_body_state s = body_state(m.world, m.bodies[0]);
        s.angular_velocity[1] = 40;
        MUST(m.world, sadmm_world_set_body_state(m.world, m.bodies[0], &s));
        step_world(m.world, STEPS);
        ck_assert_double_eq_tol(body_state(m.world, m.bodies[0]).angular_velocity[1], 40, 1e-9); /* rounding */
        sadmm_world_destroy(m.world);
    }
}
END_TEST

/* ---- tops -------------------------------------------------------------------------------------------------------- */

/* A symmetric top on a ball joint, by its Lagrangian: where its axis has gone after a second. */
enum { SPIN_STEPS = 20000 };
static const double TOP_ARM = 0.1, TOP_ACROSS = 0.002, TOP_ALONG = 0.003, TOP_TILT = 0.5, G = 9.81;

/* x: tilt, its rate, precession; about the pivot, 1 kg. */
static void top_rates(const double x[3], double spin, double around, double rate[3])
{
    const double moment = TOP_ACROSS + TOP_ARM * TOP_ARM, c = cos(x[0]), s = sin(x[0]),
                 turns = (around - spin * c) / (moment * s * s);
    rate[0] = x[1];
    rate[1] = (turns * turns * moment * s * c - spin * turns * s + G * TOP_ARM * s) / moment;
    rate[2] = turns;
}

static double top_precession(double spin, double turns)
{
    const double moment = TOP_ACROSS + TOP_ARM * TOP_ARM, c = cos(TOP_TILT), s = sin(TOP_TILT),
                 along = TOP_ALONG * (spin + turns * c), around = moment * turns * s * s + along * c,
                 h = 1.0 / SPIN_STEPS;
    double x[3] = {TOP_TILT, 0, 0};
    for (int i = 0; i < SPIN_STEPS; ++i) { /* Runge-Kutta of fourth order: its error is that of doubles */
        static const double share[] = {0, 0.5, 0.5, 1}, weight[] = {1, 2, 2, 1};
        double rate[3] = {0, 0, 0}, sum[3] = {0, 0, 0};
        for (int stage = 0; stage < 4; ++stage) {
            double at[3];
            for (int k = 0; k < 3; ++k) at[k] = x[k] + share[stage] * h * rate[k];
            top_rates(at, along, around, rate);
            for (int k = 0; k < 3; ++k) sum[k] += weight[stage] * rate[k];
        }
        for (int k = 0; k < 3; ++k) x[k] += h / 6 * sum[k];
    }
    return x[2];
}

/* The point of a top hardly turns, however fast the top does, so its rows are resolved, and the error is of second
 * order: 0.015 rad at 5 ms. With the law of rows that are not resolved it is 0.6. */
START_TEST(a_fast_top_precesses)
{
    static const double spins[] = {100, 200}, steps[] = {0.001, 0.002, 0.005};
    const double spin = spins[_i % 2], dt = steps[_i / 2], turns = G * TOP_ARM / (TOP_ALONG * spin);
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = dt;
    sadmm_world *world = create_world(&def);
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_joint_def joint = sadmm_joint_def_default();
    const double axis[3] = {0, -sin(TOP_TILT), cos(TOP_TILT)};
    body.mass = 1;
    body.inertia[0] = body.inertia[1] = TOP_ACROSS, body.inertia[2] = TOP_ALONG;
    body.orientation[0] = cos(TOP_TILT / 2), body.orientation[1] = sin(TOP_TILT / 2);
    for (int k = 0; k < 3; ++k) body.position[k] = TOP_ARM * axis[k], body.angular_velocity[k] = spin * axis[k];
    body.angular_velocity[2] += turns;
    body.linear_velocity[0] = -turns * body.position[1];
    MUST(world, sadmm_world_add_body(world, &body, &joint.body_b));
    joint.kind = SADMM_JOINT_SPHERICAL;
    joint.position_b[2] = -TOP_ARM;
    MUST(world, sadmm_world_add_joint(world, &joint, NULL));
    step_world(world, (int)lround(1 / dt));
    const sadmm_body_state s = body_state(world, joint.body_b);
    const double error = remainder(atan2(s.position[0], -s.position[1]) - top_precession(spin, turns), 2 * M_PI);
    ck_assert_msg(fabs(error) < 1000 * dt * dt, "spin %g, dt %g: off by %g rad", spin, dt, error);
    sadmm_world_destroy(world);
}
END_TEST

/* The exponential of a rotation against the library's sines, from next to nothing to a hundred turns; what is longer
 * than its series is doubled up, each time with one more rounding of the angle. */
START_TEST(turns_are_exact)
{
    state = 1;
    for (int k = 0; k < 20000; ++k) {
        const double angle = pow(10, 4.5 * number() - 1.7);
        const quat q = q_exp(v3(0.6 * angle, 0, -0.8 * angle));
        const double tolerance = 8 * DBL_EPSILON * (angle < 2 ? 1 : angle);
        ck_assert_double_eq_tol(q.w, cos(angle / 2), tolerance);
        ck_assert_double_eq_tol(q.x, 0.6 * sin(angle / 2), tolerance * (angle < 1 ? angle : 1));
        ck_assert_double_eq_tol(q.z, -0.8 * sin(angle / 2), tolerance * (angle < 1 ? angle : 1));
    }
    const quat far = q_exp(v3(0, 1e100, 0)); /* wherever that is */
    ck_assert_double_eq_tol(far.w * far.w + far.y * far.y, 1, 8 * DBL_EPSILON);
}
END_TEST

/* The mean angular velocity of a piece of a tumbling body's motion solves its equation, to rounding: at rates up to
 * 1/3, the most that a piece has. */
START_TEST(the_mean_spin_solves_its_equation)
{
    state = 2;
    for (int k = 0; k < 20000; ++k) {
        const vec3 w = v3(number(), number(), number());
        const double c_x = number() / 3, c_y = number() / 3;
        const vec3 c = v3(c_x, c_y, -(c_x + c_y) / (1 + c_x * c_y)); /* as three moments have them */
        if (v3_max_abs(c) * v3_max_abs(w) > 1. / 3) continue;
        const vec3 m = rigid_mean_spin(w, c);
        ck_assert_double_eq_tol(m.x - w.x + c.x * m.y * m.z, 0, 8 * DBL_EPSILON);
        ck_assert_double_eq_tol(m.y - w.y + c.y * m.z * m.x, 0, 8 * DBL_EPSILON);
        ck_assert_double_eq_tol(m.z - w.z + c.z * m.x * m.y, 0, 8 * DBL_EPSILON);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("turning");
    TCase *cases = tcase_create("turning");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, no_mechanism_gains_energy, 0, MECHANISMS);
    tcase_add_loop_test(cases, what_swings_keeps_its_energy, 0, SWINGS);
    tcase_add_test(cases, a_balanced_wheel_goes_on);
    tcase_add_loop_test(cases, a_fast_top_precesses, 0, 6);
    tcase_add_test(cases, turns_are_exact);
    tcase_add_test(cases, the_mean_spin_solves_its_equation);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
