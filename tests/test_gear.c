/* Gears (gear.h): wheels, racks and screws against closed forms, no drift over 1e5 steps, energy and momentum; what the
 * calls say and refuse. */
#include "core/base/memory.h"
#include "fixed_work.h"
#include "scene_tools.h"

static const double UNIT[4] = {1, 0, 0, 0};
static const sadmm_body_id WORLD = {0, 0};

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    double rounding; /* relative, of velocities */
} solvers[] = {{SADMM_BACKEND_CPU, SADMM_F64, 1e-9},
               {SADMM_BACKEND_REF, SADMM_F64, 1e-9},
               {SADMM_BACKEND_CPU, SADMM_F32, 2e-5}};
enum { SOLVERS = 3 };

static sadmm_world *new_world(int solver, double dt)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.iterations = 10;
    def.settings.gravity[2] = 0;
    return create_world(&def);
}

static sadmm_body_id add_body(sadmm_world *world, double x, double mass, double about_z)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = mass;
    def.inertia[0] = def.inertia[1] = 0.6 * about_z;
    def.inertia[2] = about_z;
    def.position[0] = x;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static sadmm_joint_id join(sadmm_world *world, sadmm_joint_kind kind, sadmm_body_id a, sadmm_body_id b, double x)
{
    const double place[3] = {x, 0, 0};
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_joint_id id;
    def.kind = kind;
    def.body_a = a;
    def.body_b = b;
    MUST(world, sadmm_world_place_joint(world, &def, place, UNIT));
    MUST(world, sadmm_world_add_joint(world, &def, &id));
    return id;
}

static sadmm_gear_def gear_def(sadmm_joint_id joint_1, int32_t coordinate_1, sadmm_joint_id joint_2,
                               int32_t coordinate_2, double ratio)
{
    sadmm_gear_def def = sadmm_gear_def_default();
    def.joint_1 = joint_1;
    def.joint_2 = joint_2;
    def.coordinate_1 = coordinate_1;
    def.coordinate_2 = coordinate_2;
    def.ratio = ratio;
    return def;
}

/* Two bodies on the static world, 1 m apart, with a gear between coordinates of their joints. */
struct train {
    sadmm_world *world;
    sadmm_body_id body[2];
    sadmm_joint_id joint[2];
    sadmm_gear_id gear;
    int coordinate[2];
    double mass[2]; /* what moves along the coordinates: kg or kg m^2 */
    double ratio;
};

static struct train new_train(int solver, double dt, sadmm_joint_kind first, sadmm_joint_kind second, double ratio)
{
    struct train t = {.world = new_world(solver, dt), .ratio = ratio};
    const sadmm_joint_kind kinds[2] = {first, second};
    for (int i = 0; i < 2; ++i) {
        const double mass = 2 + i, about_z = 0.05 + 0.15 * i;
        t.body[i] = add_body(t.world, i, mass, about_z);
        t.joint[i] = join(t.world, kinds[i], WORLD, t.body[i], i);
        t.coordinate[i] = kinds[i] == SADMM_JOINT_REVOLUTE ? 5 : 2;
        t.mass[i] = kinds[i] == SADMM_JOINT_REVOLUTE ? about_z : mass;
    }
    const sadmm_gear_def def = gear_def(t.joint[0], t.coordinate[0], t.joint[1], t.coordinate[1], ratio);
    MUST(t.world, sadmm_world_add_gear(t.world, &def, &t.gear));
    return t;
}

static void push(struct train *t, int i, double force)
{
    const double along[3] = {0, 0, force}, none[3] = {0};
    const bool turns = t->coordinate[i] == 5;
    MUST(t->world, sadmm_world_set_body_wrench(t->world, t->body[i], turns ? none : along, turns ? along : none));
}

static sadmm_joint_state joint_state(sadmm_world *world, sadmm_joint_id id)
{
    sadmm_joint_state state;
    MUST(world, sadmm_world_joint_state(world, id, &state));
    return state;
}

static sadmm_gear_state gear_state(sadmm_world *world, sadmm_gear_id id)
{
    sadmm_gear_state state;
    MUST(world, sadmm_world_gear_state(world, id, &state));
    return state;
}

/* ---- the calls --------------------------------------------------------------------------------------------------- */

static void check_refused(sadmm_world *world, sadmm_gear_def def, const char *part)
{
    ck_assert_msg(sadmm_world_add_gear(world, &def, NULL) == SADMM_ERROR_INVALID_ARGUMENT, "%s: not refused", part);
    ck_assert_msg(strstr(sadmm_world_message(world), part) != NULL, "\"%s\" lacks \"%s\"", sadmm_world_message(world),
                  part);
}

START_TEST(gears_come_and_go)
{
    struct train t = new_train(0, 0.005, SADMM_JOINT_REVOLUTE, SADMM_JOINT_REVOLUTE, 2);
    const sadmm_gear_def good = gear_def(t.joint[0], 5, t.joint[1], 5, 2);
    const sadmm_body_id third = add_body(t.world, 2, 1, 1);
    const sadmm_joint_id ball = join(t.world, SADMM_JOINT_SPHERICAL, WORLD, third, 2),
                         planet = join(t.world, SADMM_JOINT_REVOLUTE, t.body[1], third, 2);
    sadmm_gear_def bad = good, read;
    sadmm_gear_state state;
    sadmm_gear_id id;
    bad.coordinate_1 = 4;
    check_refused(t.world, bad, "def->coordinate_1 = 4");
    bad = good, bad.coordinate_2 = 6;
    check_refused(t.world, bad, "def->coordinate_2 = 6");
    bad = good, bad.joint_2 = ball;
    check_refused(t.world, bad, "no rotation of three");
    bad = good, bad.joint_2 = t.joint[0];
    check_refused(t.world, bad, "must be two");
    bad = good, bad.ratio = 0;
    check_refused(t.world, bad, "def->ratio = 0: its size must be in [1e-09, 1e+09]");
    bad = good, bad.ratio = NAN;
    check_refused(t.world, bad, "def->ratio = nan");
    bad = good, bad.offset = INFINITY;
    check_refused(t.world, bad, "def->offset (or NaN: as it is) = inf");
    sadmm_body_state turned = body_state(t.world, t.body[1]);
    const sadmm_body_state straight = turned;
    turned.orientation[0] = cos(1), turned.orientation[3] = sin(1); /* by 2 rad */
    MUST(t.world, sadmm_world_set_body_state(t.world, t.body[1], &turned));
    bad = good, bad.ratio = -1e9;
    check_refused(t.world, bad, "def->offset (NaN: as it is) = -2e+09: must be in [-1e+09, 1e+09]");
    MUST(t.world, sadmm_world_set_body_state(t.world, t.body[1], &straight));
    bad = good, bad.joint_2 = planet;
    check_refused(t.world, bad, "between 3 dynamic bodies, must be 2 at most");
    bad = good, ++bad.joint_1.generation;
    ck_assert_int_eq(sadmm_world_add_gear(t.world, &bad, NULL), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_gear_count(t.world), 1);

    MUST(t.world, sadmm_world_gear_at(t.world, 0, &id));
    ck_assert(id.slot == t.gear.slot && id.generation == t.gear.generation);
    MUST(t.world, sadmm_world_gear_def(t.world, id, &read));
    ck_assert(read.ratio == 2 && read.offset == 0 && read.enabled);
    push(&t, 0, 1);
    step_world(t.world, 1);
    ck_assert(gear_state(t.world, id).force_1 != 0);
    MUST(t.world, sadmm_world_set_gear_enabled(t.world, id, false));
    step_world(t.world, 10);
    ck_assert(gear_state(t.world, id).force_1 == 0 && gear_state(t.world, id).error != 0);
    MUST(t.world, sadmm_world_set_gear_enabled(t.world, id, true)); /* drawn in */
    step_world(t.world, 200);
    ck_assert_double_lt(fabs(gear_state(t.world, id).error), 1e-9);
    MUST(t.world, sadmm_world_set_joint_enabled(t.world, t.joint[1], false));
    step_world(t.world, 1);
    ck_assert(gear_state(t.world, id).force_1 == 0);

    MUST(t.world, sadmm_world_remove_gear(t.world, id));
    ck_assert_int_eq(sadmm_world_remove_gear(t.world, id), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_gear_state(t.world, id, &state), SADMM_ERROR_STALE_ID);
    MUST(t.world, sadmm_world_add_gear(t.world, &good, &id));
    ck_assert(id.slot == t.gear.slot && id.generation == t.gear.generation + 1);
    MUST(t.world, sadmm_world_remove_body(t.world, t.body[1])); /* with its joint, and that with its gear */
    ck_assert_int_eq(sadmm_world_gear_count(t.world), 0);
    step_world(t.world, 2);
    sadmm_world_destroy(t.world);
}
END_TEST

START_TEST(memory_runs_out)
{
    uint64_t hash[2];
    for (int fails = 0; fails < 2; ++fails) {
        struct train t = new_train(0, 0.005, SADMM_JOINT_REVOLUTE, SADMM_JOINT_REVOLUTE, 2);
        const sadmm_gear_def def = gear_def(t.joint[0], 5, t.joint[1], 5, 2);
        sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
        MUST(t.world, sadmm_world_remove_gear(t.world, t.gear));
        for (int k = 0; k < 12; ++k) MUST(t.world, sadmm_world_add_gear(t.world, &def, k == 11 ? &t.gear : NULL));
        push(&t, 0, 1);
        for (long n = 0; fails && status != SADMM_OK; ++n) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            sadmm_test_fail_allocations_after(n);
            status = sadmm_world_step(t.world);
            sadmm_test_fail_allocations_after(-1);
        }
        step_world(t.world, fails ? 9 : 10);
        hash[fails] = state_hash(t.world);
        sadmm_world_destroy(t.world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

/* q_1 = -r q_2: a force F on 1 accelerates it by F / (m_1 + m_2 / r^2), one on 2 that by F / (m_2 + m_1 r^2); the
 * gear's force is what 1 lacks. Two wheels, a rack on a pinion, two sliders. */
START_TEST(trains_accelerate)
{
    static const struct {
        sadmm_joint_kind kinds[2];
        double ratio;
    } trains[] = {{{SADMM_JOINT_REVOLUTE, SADMM_JOINT_REVOLUTE}, 3},
                  {{SADMM_JOINT_REVOLUTE, SADMM_JOINT_REVOLUTE}, -0.25},
                  {{SADMM_JOINT_PRISMATIC, SADMM_JOINT_REVOLUTE}, -0.1},
                  {{SADMM_JOINT_REVOLUTE, SADMM_JOINT_PRISMATIC}, 12},
                  {{SADMM_JOINT_PRISMATIC, SADMM_JOINT_PRISMATIC}, 1}};
    for (size_t k = 0; k < sizeof trains / sizeof *trains; ++k)
        for (int pushed = 0; pushed < 2; ++pushed) {
            struct train t = new_train(_i, 0.005, trains[k].kinds[0], trains[k].kinds[1], trains[k].ratio);
            const double r = t.ratio, m = pushed ? t.mass[1] + t.mass[0] * r * r : t.mass[0] + t.mass[1] / (r * r),
                         a = 20 / m * (pushed ? -r : 1); /* of 1 */
            push(&t, pushed, 20);
            step_world(t.world, 200);
            const sadmm_joint_state states[2] = {joint_state(t.world, t.joint[0]), joint_state(t.world, t.joint[1])};
            const double v = states[0].speed[t.coordinate[0]], close = 10 * solvers[_i].rounding * fabs(a);
            ck_assert_double_eq_tol(v, a, close); /* after 1 s */
            ck_assert_double_eq_tol(states[1].speed[t.coordinate[1]], -a / r, close / fabs(r));
            ck_assert_double_eq_tol(states[0].position[t.coordinate[0]], a / 2, close); /* many turns, some of them */
            const double force = t.mass[0] * a - (pushed ? 0 : 20);
            const sadmm_gear_state gear = gear_state(t.world, t.gear);
            /* in single precision velocities are rounded, and forces are their changes in 5 ms */
            ck_assert_double_eq_tol(gear.force_1, force, (_i == 2 ? 2e-2 : 1e-6) * (20 + fabs(force)));
            ck_assert(gear.force_2 == r * gear.force_1);
            sadmm_world_destroy(t.world);
        }
}
END_TEST

/* The error of the ratio does not add up: 1e5 steps at some 20 rad/s, 400 turns, to and fro. Energy: what the torque
 * gives, F (q - q_0), is in the wheels. */
START_TEST(ratios_do_not_drift)
{
    struct train t = new_train(_i, 0.001, SADMM_JOINT_REVOLUTE, SADMM_JOINT_REVOLUTE, -2.5);
    const int steps = _i ? 10000 : 100000; /* the others would take seconds */
    const double inertia = 0.05 + 0.2 / (2.5 * 2.5);
    double worst = 0, q = 0, work = 0, energy = 0;
    for (int step = 0; step < steps; ++step) {
        const double torque = 2 * cos(1.1 * step * 0.001) + 0.01;
        push(&t, 0, torque);
        step_world(t.world, 1);
        if (step % 10 == 9) worst = fmax(worst, fabs(gear_state(t.world, t.gear).error));
        const sadmm_joint_state state = joint_state(t.world, t.joint[0]);
        work += torque * (state.position[5] - q);
        q = state.position[5];
        energy = inertia * state.speed[5] * state.speed[5] / 2;
    }
    /* single precision: velocities are off by 1e-6 a step */
    ck_assert_msg(worst < (_i == 2 ? 1e-6 : 1e-10), "%g", worst);
    ck_assert_msg(fabs(work - energy) < (_i == 2 ? 1e-3 : 1e-8) * energy + 1e-6, "%g J of %g", work, energy);
    sadmm_world_destroy(t.world);
}
END_TEST

/* A screw in the air: the nut runs along a bolt that turns. No force from outside: momentum and energy stay;
 * q_translation = pitch / 2 pi q_rotation. */
START_TEST(screws_keep_momentum)
{
    const double lead = 0.02; /* m/rad */
    sadmm_world *world = new_world(_i, 0.002);
    const sadmm_body_id bolt = add_body(world, 0, 2, 0.01), nut = add_body(world, 0, 0.5, 0.002);
    const sadmm_joint_id joint = join(world, SADMM_JOINT_CYLINDRICAL, bolt, nut, 0);
    const sadmm_gear_def def = gear_def(joint, 2, joint, 5, -lead);
    sadmm_gear_id gear;
    sadmm_settings settings = sadmm_world_settings(world);
    settings.iterations = 400;
    MUST(world, sadmm_world_set_settings(world, &settings));
    MUST(world, sadmm_world_add_gear(world, &def, &gear));
    sadmm_body_state state = body_state(world, nut);
    state.angular_velocity[2] = 30; /* not yet along: an impulse at the first step */
    MUST(world, sadmm_world_set_body_state(world, nut, &state));
    /* reduced: w = w_n - w_b, v = lead w; L = 0.002 * 30 and p = 0 stay */
    const double L = 0.002 * 30, shared = 0.5 * 2 / 2.5, about = 0.01 * 0.002 / 0.012,
                 w = about * 30 / (about + shared * lead * lead);
    step_world(world, 500);
    const sadmm_body_state b = body_state(world, bolt), n = body_state(world, nut);
    /* motion about one axis has no error of the step: rounding of 500 steps, in single precision that of impulses; the
     * ratio's own error is fed back and does not add up */
    const double close = _i == 2 ? 1e-4 : 1e-9;
    ck_assert_double_eq_tol(0.01 * b.angular_velocity[2] + 0.002 * n.angular_velocity[2], L, close * L);
    ck_assert_double_eq_tol(2 * b.linear_velocity[2] + 0.5 * n.linear_velocity[2], 0, close);
    ck_assert_double_eq_tol(n.angular_velocity[2] - b.angular_velocity[2], w, 10 * close * w);
    ck_assert_double_eq_tol(n.linear_velocity[2] - b.linear_velocity[2], lead * w, 10 * close * lead * w);
    ck_assert_double_lt(fabs(gear_state(world, gear).error), _i == 2 ? 1e-6 : 1e-10);
    sadmm_world_destroy(world);
}
END_TEST

/* A wheel on an arm that turns (a carrier between the static world and the wheel, two bodies): the wheel is geared to
 * the arm's own angle and keeps its direction in space. */
START_TEST(a_wheel_on_an_arm_is_geared_to_it)
{
    sadmm_world *world = new_world(_i, 0.002);
    const sadmm_body_id arm = add_body(world, 0.5, 1, 0.1), wheel = add_body(world, 1, 1, 0.02);
    const sadmm_joint_id axle = join(world, SADMM_JOINT_REVOLUTE, WORLD, arm, 0),
                         pin = join(world, SADMM_JOINT_REVOLUTE, arm, wheel, 1);
    const sadmm_gear_def def = gear_def(pin, 5, axle, 5, 1); /* turns back by what the arm turns */
    sadmm_gear_id gear;
    const double none[3] = {0}, torque[3] = {0, 0, 3};
    MUST(world, sadmm_world_add_gear(world, &def, &gear));
    MUST(world, sadmm_world_set_body_wrench(world, arm, none, torque));
    step_world(world, 500);
    const double inertia = 0.1 + 1 * 0.25 + 1 * 1; /* the wheel as a point */
    ck_assert_double_eq_tol(body_state(world, arm).angular_velocity[2], 3 / inertia, 1e-4); /* of second order */
    ck_assert_double_lt(fabs(body_state(world, wheel).angular_velocity[2]), 1e-5);
    ck_assert_double_lt(fabs(gear_state(world, gear).error), 1e-6);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- on a carrier that moves ------------------------------------------------------------------------------------- */

/* A constant force along a coordinate, as a motor that never gets to its speed. */
static void drive(sadmm_world *world, sadmm_joint_id joint, int k, double force)
{
    sadmm_joint_def def;
    MUST(world, sadmm_world_joint_def(world, joint, &def));
    sadmm_joint_coordinate coordinate = def.coordinates[k];
    coordinate.drive = SADMM_DRIVE_SPEED;
    coordinate.target_speed = force > 0 ? 1e6 : -1e6;
    coordinate.drive_force = fabs(force);
    MUST(world, sadmm_world_set_joint_coordinate(world, joint, k, &coordinate));
}

/* Two wheels that mesh on a carrier that floats, driven against it: momentum stays 0, and so
 *
 *     w = -(I_1 + a I_2) q' / (J + I_1 + I_2),   q'' = F / (I_1 + a^2 I_2 - (I_1 + a I_2)^2 / (J + I_1 + I_2))
 *
 * with a = q_2' / q' = -1 / ratio, w the carrier's angular velocity and J the carrier's moment with the wheels as
 * points, about the common centre of mass. */
START_TEST(wheels_on_a_floating_carrier)
{
    static const double ratios[] = {1, 3, -2, -1};
    for (size_t n = 0; n < sizeof ratios / sizeof *ratios; ++n) {
        sadmm_world *world = new_world(_i, 0.002);
        const double I1 = 0.02, I2 = 0.05, m1 = 1, m2 = 2, mc = 3, a = -1 / ratios[n], torque = 0.4;
        const sadmm_body_id carrier = add_body(world, 0.1, mc, 0.3), one = add_body(world, 0.5, m1, I1),
                            two = add_body(world, -0.4, m2, I2);
        const double x = (0.1 * mc + 0.5 * m1 - 0.4 * m2) / (mc + m1 + m2);
        const double J = 0.3 + mc * (0.1 - x) * (0.1 - x) + m1 * (0.5 - x) * (0.5 - x) + m2 * (0.4 + x) * (0.4 + x);
        const sadmm_joint_id first = join(world, SADMM_JOINT_REVOLUTE, carrier, one, 0.5),
                             second =
                                 join(world, SADMM_JOINT_REVOLUTE, two, carrier, -0.4); /* b carries: q_2 turns back */
        const sadmm_gear_def def = gear_def(first, 5, second, 5, -ratios[n]);
        sadmm_gear_id gear;
        MUST(world, sadmm_world_add_gear(world, &def, &gear));
        drive(world, first, 5, torque);
        step_world(world, 500);
        const double sum = I1 + a * I2, all = J + I1 + I2, rate = torque / (I1 + a * a * I2 - sum * sum / all);
        const double close = _i == 2 ? 2e-4 : 1e-7; /* of second order in the carrier's turn in a step; rounding */
        ck_assert_double_eq_tol(joint_state(world, first).speed[5], rate, close * rate);
        ck_assert_double_eq_tol(joint_state(world, second).speed[5], -a * rate, close * rate);
        ck_assert_double_eq_tol(body_state(world, carrier).angular_velocity[2], -sum / all * rate, close * rate);
        ck_assert_double_lt(fabs(gear_state(world, gear).error), _i == 2 ? 1e-5 : 1e-9);
        const double force = torque - (I1 * (1 - sum / all)) * rate; /* what the motor gives and wheel 1 does not
                                                                        take */
        ck_assert_double_eq_tol(gear_state(world, gear).force_1, -force, (_i == 2 ? 5e-2 : 1e-5) * torque);
        sadmm_world_destroy(world);
    }
}
END_TEST

static void momentum(sadmm_world *world, const sadmm_body_id *bodies, int count, double linear[3], double angular[3])
{
    memset(linear, 0, 3 * sizeof *linear);
    memset(angular, 0, 3 * sizeof *angular);
    for (int n = 0; n < count; ++n) {
        const sadmm_body_state s = body_state(world, bodies[n]);
        const sadmm_body_def def = body_def(world, bodies[n]);
        double w[3] = {0}, R[3][3];
        const double *q = s.orientation;
        for (int k = 0; k < 3; ++k) linear[k] += def.mass * s.linear_velocity[k];
        R[0][0] = 1 - 2 * (q[2] * q[2] + q[3] * q[3]), R[0][1] = 2 * (q[1] * q[2] - q[0] * q[3]),
        R[0][2] = 2 * (q[1] * q[3] + q[0] * q[2]);
        R[1][0] = 2 * (q[1] * q[2] + q[0] * q[3]), R[1][1] = 1 - 2 * (q[1] * q[1] + q[3] * q[3]),
        R[1][2] = 2 * (q[2] * q[3] - q[0] * q[1]);
        R[2][0] = 2 * (q[1] * q[3] - q[0] * q[2]), R[2][1] = 2 * (q[2] * q[3] + q[0] * q[1]),
        R[2][2] = 1 - 2 * (q[1] * q[1] + q[2] * q[2]);
        for (int j = 0; j < 3; ++j) /* in the body's frame, times its moments */
            for (int k = 0; k < 3; ++k) w[j] += R[k][j] * s.angular_velocity[k];
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            for (int c = 0; c < 3; ++c) angular[k] += R[k][c] * def.inertia[c] * w[c];
            angular[k] += def.mass * (s.position[i] * s.linear_velocity[j] - s.position[j] * s.linear_velocity[i]);
        }
    }
}

/* A finger of three links that turns and tumbles in space, its outer joint geared to the inner one, about axes that are
 * at an angle: the middle link is of both joints. Nothing from outside: momentum stays, and energy to the error of the
 * step. */
START_TEST(a_finger_in_space)
{
    sadmm_world *world = new_world(_i, 0.001);
    const sadmm_body_id links[3] = {add_body(world, 0, 1, 0.02), add_body(world, 0.2, 0.4, 0.004),
                                    add_body(world, 0.4, 0.2, 0.001)};
    sadmm_joint_id joints[2];
    sadmm_gear_id gear;
    for (int k = 0; k < 2; ++k) {
        const double place[3] = {0.1 + 0.2 * k, 0, 0}, turn[4] = {cos(0.3 * k), sin(0.3 * k), 0, 0};
        sadmm_joint_def def = sadmm_joint_def_default();
        def.kind = SADMM_JOINT_REVOLUTE;
        def.body_a = links[k], def.body_b = links[k + 1];
        MUST(world, sadmm_world_place_joint(world, &def, place, turn));
        MUST(world, sadmm_world_add_joint(world, &def, &joints[k]));
    }
    const sadmm_gear_def def = gear_def(joints[1], 5, joints[0], 5, -0.7);
    MUST(world, sadmm_world_add_gear(world, &def, &gear));
    for (int k = 0; k < 3; ++k) {
        sadmm_body_state state = body_state(world, links[k]);
        state.angular_velocity[0] = 1, state.angular_velocity[1] = -0.5, state.angular_velocity[2] = 3;
        state.linear_velocity[1] = 3 * state.position[0];
        state.linear_velocity[2] = 0.5 * state.position[0];
        MUST(world, sadmm_world_set_body_state(world, links[k], &state));
    }
    double before[2][3], after[2][3];
    momentum(world, links, 3, before[0], before[1]);
    drive(world, joints[0], 5, 0.01);
    step_world(world, 1000);
    momentum(world, links, 3, after[0], after[1]);
    ck_assert_double_gt(fabs(joint_state(world, joints[0]).position[5]), 0.1); /* it has moved */
    for (int k = 0; k < 3; ++k) {
        /* linear: rounding of 1000 steps. Angular: gears are rows like others, whose error is that of the step; without
         * the gear it is 6e-6 */
        ck_assert_double_eq_tol(after[0][k], before[0][k], _i == 2 ? 1e-4 : 1e-11);
        ck_assert_double_eq_tol(after[1][k], before[1][k], _i == 2 ? 1e-4 : 1e-5);
    }
    ck_assert_double_lt(fabs(gear_state(world, gear).error), _i == 2 ? 1e-4 : 1e-7);
    sadmm_world_destroy(world);
}
END_TEST

/* Two slides that face each other on a hand that floats: refused as one gear, and made of two with a wheel in between.
 * Driven apart they move alike, and the hand stays. */
START_TEST(fingers_by_a_wheel)
{
    const double radius = 0.02;
    sadmm_world *world = new_world(_i, 0.002);
    const sadmm_body_id hand = add_body(world, 0, 1, 0.01), left = add_body(world, 0.05, 0.1, 1e-4),
                        right = add_body(world, -0.05, 0.1, 1e-4), wheel = add_body(world, 0, 1e-3, 2e-7);
    sadmm_joint_id slides[2];
    for (int k = 0; k < 2; ++k) {
        /* along x, and against it */
        const double place[3] = {k ? -0.05 : 0.05, k ? -radius : radius, 0},
                     turn[4] = {sqrt(0.5), 0, k ? -sqrt(0.5) : sqrt(0.5), 0};
        sadmm_joint_def def = sadmm_joint_def_default();
        def.kind = SADMM_JOINT_PRISMATIC;
        def.body_a = hand, def.body_b = k ? right : left;
        MUST(world, sadmm_world_place_joint(world, &def, place, turn));
        MUST(world, sadmm_world_add_joint(world, &def, &slides[k]));
    }
    check_refused(world, gear_def(slides[0], 2, slides[1], 2, -1), "a wheel in between");
    const sadmm_joint_id axle = join(world, SADMM_JOINT_REVOLUTE, hand, wheel, 0);
    sadmm_gear_id gears[2];
    for (int k = 0; k < 2; ++k) {
        const sadmm_gear_def def = gear_def(slides[k], 2, axle, 5, radius);
        MUST(world, sadmm_world_add_gear(world, &def, &gears[k]));
    }
    drive(world, slides[0], 2, 0.05); /* one motor for both */
    step_world(world, 250);
    /* the hand feels the motor's reaction on one side, and the same of the other by the wheel's axle */
    const double mass = 0.1 + 0.1 + 2e-7 / (radius * radius), moved = 0.05 / mass / 2 * 0.25;
    const double close = _i == 2 ? 1e-4 : 1e-6;
    ck_assert_double_eq_tol(joint_state(world, slides[0]).position[2], moved, close);
    ck_assert_double_eq_tol(joint_state(world, slides[1]).position[2], moved, close);
    ck_assert_double_eq_tol(body_state(world, hand).position[0], 0, close);
    ck_assert_double_lt(fabs(gear_state(world, gears[0]).error), close);
    sadmm_world_destroy(world);
}
END_TEST

/* A step of three sub-steps is three steps, to the last bit. */
START_TEST(substeps_are_steps)
{
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        struct train t = new_train(0, k ? 3 * 0.0078125 : 0.0078125, SADMM_JOINT_REVOLUTE, SADMM_JOINT_PRISMATIC, 4);
        sadmm_settings settings = sadmm_world_settings(t.world);
        settings.substeps = k ? 3 : 1;
        settings.iterations = k ? 60 : 20;
        MUST(t.world, sadmm_world_set_settings(t.world, &settings));
        push(&t, 0, 5);
        step_world(t.world, k ? 20 : 60);
        hash[k] = state_hash(t.world);
        sadmm_world_destroy(t.world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("gear");
    TCase *cases = tcase_create("gear");
    tcase_set_timeout(cases, 60);
    suite_add_tcase(suite, cases);
    tcase_add_test(cases, gears_come_and_go);
    tcase_add_test(cases, memory_runs_out);
    tcase_add_loop_test(cases, trains_accelerate, 0, SOLVERS);
    tcase_add_loop_test(cases, ratios_do_not_drift, 0, SOLVERS);
    tcase_add_loop_test(cases, screws_keep_momentum, 0, SOLVERS);
    tcase_add_loop_test(cases, a_wheel_on_an_arm_is_geared_to_it, 0, SOLVERS);
    tcase_add_loop_test(cases, wheels_on_a_floating_carrier, 0, SOLVERS);
    tcase_add_loop_test(cases, a_finger_in_space, 0, SOLVERS);
    tcase_add_loop_test(cases, fingers_by_a_wheel, 0, SOLVERS);
    tcase_add_test(cases, substeps_are_steps);
    return run_suite(suite);
}
