/* Joints of worlds: what the calls say and refuse, that every kind holds under load, limits, drives, friction and
 * springs against formulas, and that what holds of worlds holds with joints: bits do not depend on threads, backends
 * agree, sub-steps are steps, a step that fails changes nothing, a frozen problem has the rows. */
#include <float.h>

#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/model/joint_law.h"
#include "failed_step.h"
#include "fewer.h"
#include "fixed_work.h"
#include "scene_tools.h"

static const double G = 9.81, UNIT[4] = {1, 0, 0, 0};

static sadmm_world_def joint_world(sadmm_backend backend, sadmm_precision precision)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = backend;
    def.precision = precision;
    def.settings.threads = 1;
    return def;
}

/* 2 kg, with three different moments. */
static sadmm_body_id add_body(sadmm_world *world, double x, double y, double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = 2;
    def.inertia[0] = 0.02, def.inertia[1] = 0.03, def.inertia[2] = 0.04;
    def.position[0] = x, def.position[1] = y, def.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

/* At a place of the world, its axes along the world's. */
static sadmm_joint_id add_joint(sadmm_world *world, sadmm_joint_def def, double x, double y, double z)
{
    const double place[3] = {x, y, z};
    sadmm_joint_id id;
    MUST(world, sadmm_world_place_joint(world, &def, place, UNIT));
    MUST(world, sadmm_world_add_joint(world, &def, &id));
    return id;
}

static sadmm_joint_def joint_def(sadmm_joint_kind kind, sadmm_body_id a, sadmm_body_id b)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = kind;
    def.body_a = a;
    def.body_b = b;
    return def;
}

static const sadmm_body_id WORLD = {0, 0};

static sadmm_joint_state joint_state(sadmm_world *world, sadmm_joint_id id)
{
    sadmm_joint_state state;
    MUST(world, sadmm_world_joint_state(world, id, &state));
    return state;
}

static uint32_t locks_of(sadmm_world *world, sadmm_joint_id id)
{
    sadmm_joint_def def;
    MUST(world, sadmm_world_joint_def(world, id, &def));
    return def.locks;
}

/* The largest error of what the joint locks, m or rad. */
static double violation(sadmm_world *world, sadmm_joint_id id)
{
    const sadmm_joint_state state = joint_state(world, id);
    const uint32_t locks = locks_of(world, id);
    double most = 0;
    for (int k = 0; k < 6; ++k)
        if (locks >> k & 1) most = fmax(most, fabs(state.position[k]));
    return most;
}

/* ---- the calls --------------------------------------------------------------------------------------------------- */

START_TEST(joints_come_and_go)
{
    const sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
    sadmm_world *world = create_world(&def);
    const sadmm_body_id a = add_body(world, 0, 0, 0), b = add_body(world, 1, 0, 0), c = add_body(world, 2, 0, 0);
    sadmm_joint_def read, hinge = joint_def(SADMM_JOINT_REVOLUTE, a, b);
    sadmm_joint_state state;
    sadmm_joint_id id;
    hinge.coordinates[5].friction = 3;
    const sadmm_joint_id first = add_joint(world, hinge, 0.5, 0, 0),
                         second = add_joint(world, joint_def(SADMM_JOINT_DISTANCE, b, c), 1.5, 0, 0);
    ck_assert_int_eq(sadmm_world_joint_count(world), 2);
    MUST(world, sadmm_world_joint_at(world, 1, &id));
    ck_assert(id.slot == second.slot && id.generation == second.generation);
    MUST(world, sadmm_world_joint_def(world, first, &read));
    ck_assert(read.kind == SADMM_JOINT_REVOLUTE && read.locks == 31 && read.coordinates[5].friction == 3);
    ck_assert(read.position_a[0] == 0.5 && read.position_b[0] == -0.5 && read.enabled && !read.collide);
    MUST(world, sadmm_world_joint_def(world, second, &read));
    ck_assert(read.length == 0 && read.locks == 1); /* both ends are at one place */
    step_world(world, 1);
    ck_assert_int_eq(world_report(world).joints, 2);
    MUST(world, sadmm_world_set_joint_enabled(world, second, false));
    step_world(world, 1);
    ck_assert_int_eq(world_report(world).joints, 1);

    MUST(world, sadmm_world_remove_joint(world, first));
    ck_assert_int_eq(sadmm_world_remove_joint(world, first), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_joint_state(world, first, &state), SADMM_ERROR_STALE_ID);
    const sadmm_joint_id third = add_joint(world, hinge, 0.5, 0, 0);
    ck_assert(third.slot == first.slot && third.generation == first.generation + 1);
    MUST(world, sadmm_world_remove_body(world, b)); /* and its joints with it */
    ck_assert_int_eq(sadmm_world_joint_count(world), 0);
    ck_assert_int_eq(sadmm_world_joint_def(world, second, &read), SADMM_ERROR_STALE_ID);
    step_world(world, 2);
    ck_assert_int_eq(world_report(world).joints, 0);
    sadmm_world_destroy(world);
}
END_TEST

static void check_refused(sadmm_world *world, sadmm_joint_def def, const char *part)
{
    ck_assert_msg(sadmm_world_add_joint(world, &def, NULL) == SADMM_ERROR_INVALID_ARGUMENT, "%s: not refused", part);
    ck_assert_msg(strstr(sadmm_world_message(world), part) != NULL, "\"%s\" lacks \"%s\"", sadmm_world_message(world),
                  part);
}

/* What is wrong with one number or another of a coordinate. */
static void check_refused_laws(sadmm_world *world, sadmm_joint_def good)
{
    static const struct {
        sadmm_joint_coordinate law;
        const char *part;
    } bad[] = {
        {{.limited = true, .lower = 1, .upper = -1}, "coordinates[2].lower = 1, upper = -1"},
        {{.limited = true, .lower = NAN}, "coordinates[2].lower = nan"},
        {{.limited = true, .lower = INFINITY, .upper = INFINITY}, "coordinates[2].lower = inf"},
        {{.drive = SADMM_DRIVE_COUNT}, "coordinates[2].drive = 3: must be in [0, 2]"},
        {{.drive = SADMM_DRIVE_SPEED, .target_speed = NAN}, "coordinates[2].target_speed = nan"},
        {{.drive = SADMM_DRIVE_POSITION, .target_position = 1e10}, "coordinates[2].target_position = 1e+10"},
        {{.drive = SADMM_DRIVE_POSITION, .drive_stiffness = -1}, "coordinates[2].drive_stiffness = -1: must be in [0,"},
        {{.drive_damping = INFINITY}, "coordinates[2].drive_damping = inf"},
        {{.drive_force = -1}, "coordinates[2].drive_force = -1: must be in [0, inf]"},
        {{.friction = -1}, "coordinates[2].friction = -1"},
        {{.spring_stiffness = NAN}, "coordinates[2].spring_stiffness = nan"},
        {{.spring_damping = -1}, "coordinates[2].spring_damping = -1"},
        {{.spring_rest = INFINITY}, "coordinates[2].spring_rest = inf"},
        {{.armature = -1}, "coordinates[2].armature = -1: must be in [0,"},
    };
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        sadmm_joint_def def = good;
        def.coordinates[2] = bad[k].law;
        check_refused(world, def, bad[k].part);
    }
}

/* Named with its value and range; and the world goes on as one that was never asked. */
START_TEST(bad_input_is_refused)
{
    const sadmm_world_def world_def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
    uint64_t hash[2];
    for (int asked = 0; asked < 2; ++asked) {
        sadmm_world *world = create_world(&world_def);
        sadmm_body_def still = sadmm_body_def_default();
        sadmm_body_id fixed[2];
        still.type = SADMM_BODY_STATIC;
        const sadmm_body_id a = add_body(world, 0, 0, 1), b = add_body(world, 1, 0, 1);
        for (int k = 0; k < 2; ++k) MUST(world, sadmm_world_add_body(world, &still, &fixed[k]));
        const sadmm_joint_id joint = add_joint(world, joint_def(SADMM_JOINT_PRISMATIC, a, b), 0.5, 0, 1);
        step_world(world, 1);
        if (asked) {
            const sadmm_joint_def good = joint_def(SADMM_JOINT_PRISMATIC, a, b);
            const sadmm_joint_coordinate crossed = {.limited = true, .lower = 2, .upper = 1}, nothing = {0};
            const double zero[4] = {0};
            sadmm_joint_def bad = good;
            char message[64];
            snprintf(message, sizeof message, "def->kind = %d: must be in [0, %d]", SADMM_JOINT_KIND_COUNT,
                     SADMM_JOINT_KIND_COUNT - 1);
            bad.kind = SADMM_JOINT_KIND_COUNT;
            check_refused(world, bad, message);
            bad = good, bad.kind = SADMM_JOINT_CUSTOM, bad.locks = 64;
            check_refused(world, bad, "def->locks = 64: must be in [0, 63]");
            bad = good, bad.body_b = a;
            check_refused(world, bad, "must be two bodies");
            bad = good, bad.body_a = fixed[0], bad.body_b = fixed[1];
            check_refused(world, bad, "one at least must be dynamic");
            bad = good, bad.body_a = WORLD, bad.body_b = fixed[1];
            check_refused(world, bad, "one at least must be dynamic");
            bad = good, bad.body_a = bad.body_b = WORLD;
            check_refused(world, bad, "one at least must be dynamic");
            bad = good, bad.position_a[1] = NAN;
            check_refused(world, bad, "def->position_a[1] = nan");
            bad = good, bad.orientation_b[0] = 0;
            check_refused(world, bad, "def->orientation_b = (0, 0, 0, 0)");
            bad = good, bad.length = -2;
            check_refused(world, bad, "def->length (or -1: as it is) = -2");
            bad = good, bad.break_force = -1;
            check_refused(world, bad, "def->break_force = -1: must be in [0, inf]");
            bad = good, bad.break_torque = NAN;
            check_refused(world, bad, "def->break_torque = nan: must be in [0, inf]");
            bad = good, bad.coordinates[1].friction = 1;
            check_refused(world, bad, "def->coordinates[1]: must be the default, for the joint locks");
            bad = good, bad.kind = SADMM_JOINT_SPRING, bad.coordinates[1].friction = 1;
            check_refused(world, bad, "def->coordinates[1]: must be the default, for the joint does not have");
            check_refused_laws(world, good);
            bad = good, bad.body_a.generation += 1;
            ck_assert_int_eq(sadmm_world_add_joint(world, &bad, NULL), SADMM_ERROR_STALE_ID);
            ck_assert_int_eq(sadmm_world_place_joint(world, &bad, still.position, UNIT), SADMM_ERROR_STALE_ID);
            bad = good;
            ck_assert_int_eq(sadmm_world_place_joint(world, &bad, still.position, zero),
                             SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(memcmp(&bad, &good, sizeof bad), 0);
            ck_assert_int_eq(sadmm_world_set_joint_coordinate(world, joint, 2, &crossed), SADMM_ERROR_INVALID_ARGUMENT);
            for (int k = -1; k < 7; ++k) /* 2 is the free one */
                if (k != 2)
                    ck_assert_int_eq(sadmm_world_set_joint_coordinate(world, joint, k, &nothing),
                                     SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_joint_at(world, 1, &(sadmm_joint_id){0}), SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_remove_joint(world, (sadmm_joint_id){0}), SADMM_ERROR_STALE_ID);
            ck_assert_int_eq(sadmm_world_set_joint_enabled(world, (sadmm_joint_id){9, 1}, true), SADMM_ERROR_STALE_ID);
        }
        step_world(world, 20);
        ck_assert_int_eq(sadmm_world_joint_count(world), 1);
        hash[asked] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* Jointed bodies do not meet, unless asked; as long as one of their joints is there. */
START_TEST(jointed_bodies_do_not_meet)
{
    const sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
    sadmm_world *world = create_world(&def);
    const sadmm_body_id a = add_body(world, 0, 0, 0), b = add_body(world, 0.15, 0, 0);
    sadmm_shape_def ball = sadmm_shape_def_default();
    ball.size[0] = 0.1; /* they overlap */
    MUST(world, sadmm_world_add_shape(world, a, &ball, NULL));
    MUST(world, sadmm_world_add_shape(world, b, &ball, NULL));
    sadmm_joint_id joints[2];
    for (int k = 0; k < 2; ++k)
        joints[k] = add_joint(world, joint_def(SADMM_JOINT_SPHERICAL, k ? a : b, k ? b : a), 0, 0, 0);
    for (int k = 0; k < 2; ++k) {
        step_world(world, 1);
        ck_assert_int_eq(sadmm_world_contact_count(world), 0);
        MUST(world, sadmm_world_remove_joint(world, joints[k]));
    }
    step_world(world, 1);
    ck_assert_int_eq(sadmm_world_contact_count(world), 1);
    sadmm_joint_def meeting = joint_def(SADMM_JOINT_SPHERICAL, a, b);
    meeting.collide = true;
    add_joint(world, meeting, 0, 0, 0);
    step_world(world, 1);
    ck_assert_int_eq(sadmm_world_contact_count(world), 1);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- what is locked holds ---------------------------------------------------------------------------------------- */

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_method method;
    int iterations;
} solvers[] = {
    {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST, 20},
    {SADMM_BACKEND_CPU, SADMM_F32, SADMM_METHOD_FAST, 20},
    {SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_FAST, 20},
    {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_PAPER, 300}, /* slow where moments are small: left out of formulas */
};
enum { SOLVERS = 4, FAST_SOLVERS = 3 };

static sadmm_world *solver_world(int solver, double dt)
{
    sadmm_world_def def = joint_world(solvers[solver].backend, solvers[solver].precision);
    def.settings.method = solvers[solver].method;
    def.settings.iterations = solvers[solver].iterations;
    def.settings.dt = dt;
    return create_world(&def);
}

/* A body on the static world and one on that, pulled by wrenches that turn with time, for 2 s. Errors are of third
 * order in the step: the universal joints, which spin the fastest, are off by 2e-5 m at 2 ms, 3e-6 m at 1 ms. */
START_TEST(kinds_hold)
{
    enum { STEPS = 2000 };
    const int solver = _i / SADMM_JOINT_KIND_COUNT;
    const sadmm_joint_kind kind = (sadmm_joint_kind)(_i % SADMM_JOINT_KIND_COUNT);
    if (!is_its_turn((int)kind, solver)) return;
    sadmm_world *world = solver_world(solver, 0.001);
    const sadmm_body_id bodies[2] = {add_body(world, 0.1, 0, 0), add_body(world, 0.3, 0, 0)};
    sadmm_joint_id joints[2];
    double worst = 0, moved = 0;
    for (int k = 0; k < 2; ++k) {
        sadmm_joint_def def = joint_def(kind, k ? bodies[0] : WORLD, bodies[k]);
        def.locks = 1 + 2 + 16; /* of CUSTOM */
        def.coordinates[0].spring_stiffness = kind == SADMM_JOINT_SPRING ? 500 : 0;
        def.coordinates[0].spring_damping = kind == SADMM_JOINT_SPRING ? 5 : 0;
        const bool radial = joint_is_radial(kind);
        const double place[3] = {k ? 0.2 : 0, 0, 0};
        MUST(world, sadmm_world_place_joint(world, &def, place, UNIT));
        if (radial) def.position_b[0] = def.position_b[1] = 0.02; /* a length of its own */
        MUST(world, sadmm_world_add_joint(world, &def, &joints[k]));
    }
    for (int step = 0; step < STEPS; ++step) {
        const double t = 0.001 * step;
        for (int k = 0; k < 2; ++k) {
            const double force[3] = {5 * sin(3 * t + k), 4 * cos(2 * t), 2 * G + 3 * sin(t)},
                         torque[3] = {0.05 * sin(5 * t), 0.05 * cos(4 * t), 0.05 * sin(2 * t + k)};
            MUST(world, sadmm_world_set_body_wrench(world, bodies[k], force, torque));
        }
        step_world(world, 1);
        for (int k = 0; k < 2; ++k) {
            const sadmm_joint_state state = joint_state(world, joints[k]);
            worst = fmax(worst, violation(world, joints[k]));
            for (int c = 0; c < 6; ++c) moved = fmax(moved, fabs(state.position[c]));
        }
    }
    ck_assert_msg(worst < 1e-5, "kind %d, solver %d: %g", (int)kind, solver, worst);
    ck_assert(kind == SADMM_JOINT_FIXED || moved > 0.01); /* the others went somewhere */
    sadmm_world_destroy(world);
}
END_TEST

/* Frames that do not fit come together, from any side and at large angles, at the speed of corrections at most. */
START_TEST(frames_are_drawn_together)
{
    sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
    def.settings.gravity[2] = 0;
    for (int axis = 0; axis < 3; ++axis) {
        sadmm_world *world = create_world(&def);
        sadmm_joint_def fixed = joint_def(SADMM_JOINT_FIXED, WORLD, add_body(world, 0.1, 0.2, -0.1));
        sadmm_joint_id joint;
        const double angle = 3; /* rad */
        fixed.orientation_b[0] = cos(angle / 2);
        fixed.orientation_b[1 + axis] = sin(angle / 2);
        MUST(world, sadmm_world_add_joint(world, &fixed, &joint));
        double last = joint_state(world, joint).position[3 + axis];
        ck_assert_double_eq_tol(last, angle, 1e-12);
        for (int step = 0; step < 1000; ++step) {
            step_world(world, 1);
            const sadmm_joint_state state = joint_state(world, joint);
            ck_assert(last - state.position[3 + axis] < 1.001 * def.settings.dt * def.settings.correction_speed);
            last = state.position[3 + axis];
        }
        ck_assert_double_lt(violation(world, joint), 1e-12);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* A ring of four bars, closed by a joint too many for the plane: what is redundant does no harm. */
START_TEST(closed_loops_hold)
{
    sadmm_world *world = solver_world(_i, 0.002);
    const double quarter[4] = {sqrt(0.5), sqrt(0.5), 0, 0}; /* z of the joints along the world's y, turned back */
    sadmm_body_id bars[3];
    sadmm_joint_id joints[4];
    double worst = 0;
    for (int k = 0; k < 3; ++k) bars[k] = add_body(world, 0.25 * k, 0, k == 1 ? 0.5 : 0.25);
    for (int k = 0; k < 4; ++k) {
        sadmm_joint_def hinge = joint_def(SADMM_JOINT_REVOLUTE, k ? bars[k - 1] : WORLD, k < 3 ? bars[k] : WORLD);
        const double place[3] = {k < 2 ? 0 : 0.5, 0, k == 1 || k == 2 ? 0.5 : 0};
        MUST(world, sadmm_world_place_joint(world, &hinge, place, quarter));
        MUST(world, sadmm_world_add_joint(world, &hinge, &joints[k]));
    }
    const double push[3] = {10, 0, 0}, none[3] = {0};
    MUST(world, sadmm_world_set_body_wrench(world, bars[1], push, none));
    for (int step = 0; step < 1500; ++step) {
        step_world(world, 1);
        for (int k = 0; k < 4; ++k) worst = fmax(worst, violation(world, joints[k]));
    }
    ck_assert_msg(worst < 1e-5, "%g", worst);
    ck_assert_double_gt(fabs(joint_state(world, joints[0]).position[5]), 0.1); /* it leans over */
    sadmm_world_destroy(world);
}
END_TEST

/* ---- reactions --------------------------------------------------------------------------------------------------- */

/* A body that hangs to the side of what holds it: its weight, and the weight's torque about the joint. */
START_TEST(reactions_carry_the_weight)
{
    sadmm_world *world = solver_world(_i, 0.005);
    const sadmm_body_id body = add_body(world, 0.3, 0, 0);
    const sadmm_joint_id joint = add_joint(world, joint_def(SADMM_JOINT_FIXED, WORLD, body), 0, 0, 0);
    const double expected[6] = {0, 0, 2 * G, 0, -0.3 * 2 * G, 0};
    step_world(world, 200);
    const sadmm_joint_state state = joint_state(world, joint);
    const double rounding = solvers[_i].precision == SADMM_F32 ? 1e-4 : 1e-9; /* of 20 N, after few iterations */
    for (int k = 0; k < 6; ++k) {
        ck_assert_double_eq_tol(state.wrench_b[k], expected[k], rounding);
        ck_assert(state.wrench_a[k] == 0 - state.wrench_b[k]);
        ck_assert_double_eq_tol(state.lock_force[k], expected[k], rounding); /* the frame is the world's */
        ck_assert(fabs(state.point[k % 3]) < 1e-9);
        ck_assert(state.limit_force[k] == 0 && state.drive_force[k] == 0 && state.spring_force[k] == 0);
    }
    MUST(world, sadmm_world_set_joint_enabled(world, joint, false));
    step_world(world, 1);
    ck_assert(joint_state(world, joint).wrench_b[2] == 0);
    ck_assert_double_eq_tol(body_state(world, body).linear_velocity[2], -G * 0.005, 1e-6);
    sadmm_world_destroy(world);
}
END_TEST

/* The same along the axes of a's frame, which is a quarter turn about x from the world's. */
START_TEST(reactions_in_the_joints_frame)
{
    static const double place[3] = {0}, quarter[4] = {0.70710678118654752440, 0.70710678118654752440, 0, 0};
    const double expected[6] = {0, 2 * G, 0, 0, 0, 0.3 * 2 * G};
    sadmm_world *world = solver_world(_i, 0.005);
    sadmm_joint_def def = joint_def(SADMM_JOINT_FIXED, WORLD, add_body(world, 0.3, 0, 0));
    sadmm_joint_id joint;
    MUST(world, sadmm_world_place_joint(world, &def, place, quarter));
    MUST(world, sadmm_world_add_joint(world, &def, &joint));
    step_world(world, 200);
    const double rounding = solvers[_i].precision == SADMM_F32 ? 1e-4 : 1e-9; /* as above */
    for (int k = 0; k < 6; ++k)
        ck_assert_double_eq_tol(joint_state(world, joint).wrench_joint[k], expected[k], rounding);
    sadmm_world_destroy(world);
}
END_TEST

/* A body of 2 kg on a lever of 0.3 m that bears 30 N, or 8 N m: 25 N pull it off, or a torque. */
START_TEST(joints_break)
{
    for (int by_torque = 0; by_torque < 2; ++by_torque) {
        const double zero[3] = {0}, pull[3] = {25, 0, 0}, twist[3] = {0, 0, 8};
        sadmm_world *world = solver_world(_i, 0.005);
        const sadmm_body_id body = add_body(world, 0.3, 0, 0);
        sadmm_joint_def read, def = joint_def(SADMM_JOINT_FIXED, WORLD, body);
        def.break_force = by_torque ? INFINITY : 30;
        def.break_torque = by_torque ? 8 : INFINITY;
        const sadmm_joint_id joint = add_joint(world, def, 0, 0, 0);
        step_world(world, 50);
        ck_assert(!joint_state(world, joint).broken);
        MUST(world, sadmm_world_set_body_wrench(world, body, by_torque ? zero : pull, by_torque ? twist : zero));
        step_world(world, 10); /* long enough for 20 iterations a step to find the load */
        MUST(world, sadmm_world_joint_def(world, joint, &read));
        ck_assert(joint_state(world, joint).broken && !read.enabled && sadmm_world_joint_count(world) == 1);
        ck_assert_double_lt(body_state(world, body).linear_velocity[2], -G * 0.005 / 2); /* it falls */
        step_world(world, 1);
        ck_assert(joint_state(world, joint).broken && world_report(world).joints == 0);

        MUST(world, sadmm_world_set_joint_enabled(world, joint, true));
        MUST(world, sadmm_world_joint_def(world, joint, &read));
        ck_assert(!joint_state(world, joint).broken && read.enabled);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* ---- free coordinates -------------------------------------------------------------------------------------------- */

/* A body of 2 kg, 0.04 kg m^2 about z, that slides along and turns about z without gravity: coordinates 2 and 5. */
struct slider {
    sadmm_world *world;
    sadmm_body_id body;
    sadmm_joint_id joint;
    double inertia[6];
};

static struct slider new_slider(int solver, double dt)
{
    struct slider s = {.world = solver_world(solver, dt), .inertia = {2, 2, 2, 0.02, 0.03, 0.04}};
    sadmm_settings settings = sadmm_world_settings(s.world);
    settings.gravity[2] = 0;
    MUST(s.world, sadmm_world_set_settings(s.world, &settings));
    s.body = add_body(s.world, 0, 0, 0);
    s.joint = add_joint(s.world, joint_def(SADMM_JOINT_CYLINDRICAL, WORLD, s.body), 0, 0, 0);
    return s;
}

static void push(struct slider *s, int coordinate, double force)
{
    double linear[3] = {0}, angular[3] = {0};
    (coordinate == 2 ? linear : angular)[2] = force;
    MUST(s->world, sadmm_world_set_body_wrench(s->world, s->body, linear, angular));
}

static void set_law(struct slider *s, int coordinate, sadmm_joint_coordinate law)
{
    if (law.drive_force == 0) law.drive_force = INFINITY;
    MUST(s->world, sadmm_world_set_joint_coordinate(s->world, s->joint, coordinate, &law));
}

/* Of numbers of about 1: where a law changes, the weights of the step are those of the law before, and 20 iterations
 * leave some 1e-6 of that step's change. */
static const double CLOSE = 1e-5;

#define EACH_COORDINATE(c) for (int c = 2; c < 6; c += 3)

/* Friction holds what is less, and takes its force from what is more. */
START_TEST(friction_holds_and_slips)
{
    EACH_COORDINATE(c) {
        struct slider s = new_slider(_i, 0.005);
        const double m = s.inertia[c];
        set_law(&s, c, (sadmm_joint_coordinate){.friction = 1.5 * m});
        push(&s, c, m);
        step_world(s.world, 100);
        sadmm_joint_state state = joint_state(s.world, s.joint);
        ck_assert_double_lt(fabs(state.position[c]), CLOSE);
        ck_assert_double_eq_tol(state.friction_force[c], -m, CLOSE * m);
        push(&s, c, 2.5 * m);
        step_world(s.world, 200);
        state = joint_state(s.world, s.joint);
        ck_assert_double_eq_tol(state.speed[c], 1, 2 * CLOSE); /* (2.5 - 1.5) for 1 s */
        ck_assert_double_eq_tol(state.position[c], 0.5, 2 * CLOSE);
        ck_assert_double_eq_tol(state.friction_force[c], -1.5 * m, 1e-6 * m);
        sadmm_world_destroy(s.world);
    }
}
END_TEST

/* Half as much again as the body's inertia moves along: the force is m d2q/dt2 + 1.5 m d2q/dt2. */
START_TEST(armature)
{
    EACH_COORDINATE(c) {
        struct slider s = new_slider(_i, 0.005);
        const double m = s.inertia[c];
        /* a speed of 1 is kept to 1.2e-7 in single precision, and the force is its change in a step of 5 ms */
        const double rounding = solvers[_i].precision == SADMM_F32 ? 4 * 1.2e-7 / 0.005 : CLOSE;
        set_law(&s, c, (sadmm_joint_coordinate){.armature = 1.5 * m});
        push(&s, c, 2.5 * m);
        step_world(s.world, 200);
        const sadmm_joint_state state = joint_state(s.world, s.joint);
        ck_assert_double_eq_tol(state.speed[c], 1, 2 * CLOSE); /* 1 m/s^2 for 1 s */
        ck_assert_double_eq_tol(state.position[c], 0.5, 2 * CLOSE);
        ck_assert_double_eq_tol(state.armature_force[c], -1.5 * m, rounding * m);
        sadmm_world_destroy(s.world);
    }
}
END_TEST

/* A drive gives its force until it has its speed, and holds that against a load. */
START_TEST(speed_drive)
{
    EACH_COORDINATE(c) {
        struct slider s = new_slider(_i, 0.005);
        const double m = s.inertia[c];
        set_law(&s, c, (sadmm_joint_coordinate){.drive = SADMM_DRIVE_SPEED, .target_speed = 2, .drive_force = 4 * m});
        step_world(s.world, 50); /* 0.25 s */
        ck_assert_double_eq_tol(joint_state(s.world, s.joint).speed[c], 1, 4 * CLOSE);
        ck_assert_double_eq_tol(joint_state(s.world, s.joint).drive_force[c], 4 * m, 1e-6 * m);
        push(&s, c, -m);
        step_world(s.world, 200);
        ck_assert_double_eq_tol(joint_state(s.world, s.joint).speed[c], 2, CLOSE);
        ck_assert_double_eq_tol(joint_state(s.world, s.joint).drive_force[c], m, 10 * CLOSE * m);
        sadmm_world_destroy(s.world);
    }
}
END_TEST

/* Gains far beyond what explicit ones could have at this step; and a turn of three times around is counted. */
START_TEST(position_drive)
{
    EACH_COORDINATE(c) {
        struct slider s = new_slider(_i, 0.005);
        const double m = s.inertia[c], target = 20;
        sadmm_joint_coordinate law = {.drive = SADMM_DRIVE_POSITION, .target_position = target,
                                      .drive_stiffness = 1e6 * m, .drive_damping = 2e5 * m, .drive_force = 500 * m};
        set_law(&s, c, law);
        step_world(s.world, 800); /* 20 exp(-5 t) at the end */
        sadmm_joint_state state = joint_state(s.world, s.joint);
        ck_assert_double_eq_tol(state.position[c], target, 20 * CLOSE);
        law.target_position = -target; /* at any time */
        set_law(&s, c, law);
        step_world(s.world, 1);
        ck_assert_double_eq_tol(joint_state(s.world, s.joint).drive_force[c], -500 * m, 1e-4 * m);
        sadmm_world_destroy(s.world);
    }
}
END_TEST

/* Limits are met without going beyond by more than the step's share, and carry the load. */
START_TEST(limits_hold)
{
    EACH_COORDINATE(c)
    for (int side = -1; side <= 1; side += 2) {
        struct slider s = new_slider(_i, 0.005);
        const double m = s.inertia[c];
        set_law(&s, c, (sadmm_joint_coordinate){.limited = true, .lower = -0.5, .upper = 0.5});
        push(&s, c, side * 5 * m);
        double most = 0;
        for (int step = 0; step < 300; ++step) {
            step_world(s.world, 1);
            most = fmax(most, fabs(joint_state(s.world, s.joint).position[c]));
        }
        const sadmm_joint_state state = joint_state(s.world, s.joint);
        ck_assert_double_lt(most, 0.5 + 1e-5);
        ck_assert_double_eq_tol(state.position[c], side * 0.5, 1e-5);
        ck_assert_double_eq_tol(state.limit_force[c], -side * 5 * m, 10 * CLOSE * m);
        push(&s, c, -side * 5 * m); /* one-sided: it lets go */
        step_world(s.world, 20);
        ck_assert_double_eq_tol(joint_state(s.world, s.joint).speed[c], -side * 0.5, 10 * CLOSE);
        sadmm_world_destroy(s.world);
    }
}
END_TEST

/* Both limits at one value lock it; one that is infinite is none. */
START_TEST(limits_that_meet_or_are_none)
{
    struct slider s = new_slider(0, 0.005);
    set_law(&s, 2, (sadmm_joint_coordinate){.limited = true, .lower = 0, .upper = 0});
    for (int step = 0; step < 200; ++step) {
        push(&s, 2, 20 * sin(0.1 * step));
        step_world(s.world, 1);
        ck_assert_double_lt(fabs(joint_state(s.world, s.joint).position[2]), 1e-5);
    }
    push(&s, 2, 2);
    set_law(&s, 2, (sadmm_joint_coordinate){.limited = true, .lower = -INFINITY, .upper = INFINITY});
    step_world(s.world, 200);
    ck_assert_double_eq_tol(joint_state(s.world, s.joint).speed[2], 1, 1e-3);
    sadmm_world_destroy(s.world);
}
END_TEST

/* Springs: x(t) of a damped oscillator under a constant force; the error is of second order in the step. */
static double oscillator(double t, double k, double c, double push)
{
    const double rate = c / 2, own = sqrt(k - rate * rate);
    return push / k * (1 - exp(-rate * t) * (cos(own * t) + rate / own * sin(own * t)));
}

static double spring_error(int solver, int c, double dt)
{
    struct slider s = new_slider(solver, dt);
    const double m = s.inertia[c];
    double worst = 0;
    set_law(&s, c, (sadmm_joint_coordinate){.spring_stiffness = 25 * m, .spring_damping = m});
    push(&s, c, 5 * m);
    for (int step = 1; step * dt < 2; ++step) {
        step_world(s.world, 1);
        worst = fmax(worst, fabs(joint_state(s.world, s.joint).position[c] - oscillator(step * dt, 25, 1, 5)));
    }
    sadmm_world_destroy(s.world);
    return worst;
}

START_TEST(springs_are_of_second_order)
{
    EACH_COORDINATE(c) {
        const double coarse = spring_error(_i, c, 0.01), fine = spring_error(_i, c, 0.005);
        ck_assert_msg(coarse < 1e-3, "%g", coarse); /* 0.4 m of way, (w dt)^2 / 12 of the phase */
        ck_assert_msg(coarse / fine > 3.8 && coarse / fine < 4.2, "%g %g", coarse, fine);
    }
}
END_TEST

/* A spring whose period the step does not resolve comes to rest in a few steps, where its force is the load. */
START_TEST(stiff_springs_do_not_ring)
{
    EACH_COORDINATE(c) {
        struct slider s = new_slider(_i, 0.005);
        const double m = s.inertia[c];
        set_law(&s, c, (sadmm_joint_coordinate){.spring_stiffness = 1e8 * m, .spring_rest = 0.01});
        push(&s, c, 5 * m);
        step_world(s.world, 100);
        const sadmm_joint_state state = joint_state(s.world, s.joint);
        ck_assert_double_eq_tol(state.position[c], 0.01 + 5e-8, 1e-8);
        ck_assert_double_lt(fabs(state.speed[c]), 1e-5);
        sadmm_world_destroy(s.world);
    }
}
END_TEST

/* A rope: a point that flies off at 3 m/s is caught at 0.5 m, and goes around. */
START_TEST(rope)
{
    sadmm_world_def world_def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
    world_def.settings.gravity[2] = 0;
    sadmm_world *world = create_world(&world_def);
    const sadmm_body_id body = add_body(world, 0.3, 0, 0);
    sadmm_body_state state = body_state(world, body);
    state.linear_velocity[1] = 3;
    MUST(world, sadmm_world_set_body_state(world, body, &state));
    sadmm_joint_def def = joint_def(SADMM_JOINT_SPRING, WORLD, body);
    def.coordinates[0] = (sadmm_joint_coordinate){.limited = true, .lower = -INFINITY, .upper = 0.5};
    sadmm_joint_id joint;
    MUST(world, sadmm_world_add_joint(world, &def, &joint));
    for (int step = 0; step < 400; ++step) {
        step_world(world, 1);
        ck_assert_double_lt(joint_state(world, joint).position[0], 0.5 + 2e-4); /* dt^2 v^2 / 2 r, once */
    }
    /* the part of the velocity across the rope stays: 3 times 0.3 / 0.5 */
    const double v = norm3(body_state(world, body).linear_velocity);
    ck_assert_double_eq_tol(v, 1.8, 0.03); /* of first order: it turns within the step of the catch */
    ck_assert_double_eq_tol(joint_state(world, joint).limit_force[0], -2 * v * v / 0.5, 1e-3);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- worlds with joints are worlds ------------------------------------------------------------------------------- */

/* A chain of links with shapes over a floor, hung up at one end, whose free end lands. */
static sadmm_world *chain(const sadmm_world_def *def, int links)
{
    sadmm_world *world = create_world(def);
    sadmm_body_def floor = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default(), ball = plane;
    sadmm_body_id ground, last = WORLD;
    floor.type = SADMM_BODY_STATIC;
    floor.environment = -1;
    plane.type = SADMM_SHAPE_PLANE;
    ball.size[0] = 0.04;
    MUST(world, sadmm_world_add_body(world, &floor, &ground));
    MUST(world, sadmm_world_add_shape(world, ground, &plane, NULL));
    for (int k = 0; k < links; ++k) {
        const sadmm_body_id link = add_body(world, 0.05 + 0.1 * k, 0, 0.06 * links);
        MUST(world, sadmm_world_add_shape(world, link, &ball, NULL));
        const sadmm_joint_kind kind = k % 2 ? SADMM_JOINT_UNIVERSAL : SADMM_JOINT_SPHERICAL;
        add_joint(world, joint_def(kind, last, link), 0.1 * k, 0, 0.06 * links);
        last = link;
    }
    return world;
}

START_TEST(threads_do_not_show)
{
    uint64_t hash[3];
    sadmm_test_force_threads(true);
    for (int k = 0; k < 3; ++k) {
        sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, _i ? SADMM_F32 : SADMM_F64);
        def.settings.threads = 1 << k;
        sadmm_world *world = chain(&def, 12);
        step_world(world, 120);
        ck_assert_int_gt(world_report(world).contacts, 0);
        hash[k] = state_hash(world);
        sadmm_world_destroy(world);
    }
    sadmm_test_force_threads(false);
    ck_assert_uint_eq(hash[0], hash[1]);
    ck_assert_uint_eq(hash[0], hash[2]);
}
END_TEST

/* Solved to rounding they take the same way; 40 steps, before anything lands and parts their ways. */
START_TEST(backends_agree)
{
    sadmm_body_state *states[3];
    static const struct {
        sadmm_backend backend;
        sadmm_precision precision;
        double close;
    } tables[3] = {{SADMM_BACKEND_REF, SADMM_F64, 0}, {SADMM_BACKEND_CPU, SADMM_F64, 1e-9},
                   {SADMM_BACKEND_CPU, SADMM_F32, 1e-4}};
    for (int k = 0; k < 3; ++k) {
        sadmm_world_def def = joint_world(tables[k].backend, tables[k].precision);
        def.settings.iterations = 1000;
        def.settings.method = _i ? SADMM_METHOD_FAST : SADMM_METHOD_PAPER;
        if (!_i) def.settings.iterations = 4000;
        sadmm_world *world = chain(&def, 4);
        step_world(world, 20);
        states[k] = all_states(world);
        for (int i = 0; i < sadmm_world_body_count(world); ++i)
            ck_assert_msg(distance(states[k][i].position, states[0][i].position) <= tables[k].close, "%d: %g", k,
                          distance(states[k][i].position, states[0][i].position));
        sadmm_world_destroy(world);
    }
    for (int k = 0; k < 3; ++k) free(states[k]);
}
END_TEST

/* A step of three sub-steps is three steps, to the last bit. */
START_TEST(substeps_are_steps)
{
    uint64_t hash[2];
    sadmm_joint_state states[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
        sadmm_joint_id joint;
        def.settings.substeps = k ? 3 : 1;
        def.settings.dt = k ? 3 * 0.0078125 : 0.0078125;
        def.settings.iterations = k ? 60 : 20;
        sadmm_world *world = chain(&def, 6);
        step_world(world, k ? 20 : 60);
        MUST(world, sadmm_world_joint_at(world, 3, &joint));
        hash[k] = state_hash(world);
        states[k] = joint_state(world, joint);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
    ck_assert_int_eq(memcmp(&states[0], &states[1], sizeof states[0]), 0);
}
END_TEST

/* The frozen problem is the step's: solved from where it started, with as many iterations, it has its impulses. */
START_TEST(frozen_problems_have_the_rows)
{
    sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
    sadmm_world *world = chain(&def, 5);
    sadmm_joint_id joint;
    sadmm_problem *problem;
    sadmm_joint_coordinate law = {.limited = true, .lower = 0, .upper = 0.1, .friction = 0.01, .drive_force = INFINITY};
    MUST(world, sadmm_world_joint_at(world, 1, &joint));
    MUST(world, sadmm_world_set_joint_coordinate(world, joint, 3, &law));
    step_world(world, 60);
    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    MUST(world, sadmm_world_freeze(world, problem));
    ck_assert_int_eq(sadmm_problem_body_count(problem), 5);
    ck_assert_int_eq(sadmm_problem_block_count(problem), 5);
    sadmm_problem_block block;
    ck_assert_int_eq(sadmm_problem_get_block(problem, 0, &block), SADMM_OK);
    ck_assert(block.kind == SADMM_BLOCK_HARD && block.rows == 3 && block.body_a == -1 && block.body_b == 0);
    ck_assert_int_eq(sadmm_problem_get_block(problem, 1, &block), SADMM_OK);
    ck_assert(block.kind == SADMM_BLOCK_ROWS && block.rows > 4 && block.body_a == 0 && block.body_b == 1);

    sadmm_settings settings = sadmm_world_settings(world);
    settings.iterations = 2000;
    sadmm_solve_report report;
    ck_assert_int_eq(sadmm_problem_solve(problem, SADMM_BACKEND_CPU, SADMM_F64, &settings, &report), SADMM_OK);
    ck_assert_double_lt(report.certificate.ncp_max, 1e-9);
    double lambda[5][6];
    ck_assert_int_eq(sadmm_problem_get_solution(problem, NULL, NULL, lambda[0]), SADMM_OK);
    MUST(world, sadmm_world_joint_at(world, 0, &joint));
    const sadmm_joint_state state = joint_state(world, joint);
    for (int k = 0; k < 3; ++k) /* what 20 iterations left out of some 100 N */
        ck_assert_double_eq_tol(lambda[0][k] / settings.dt, state.lock_force[k], 2);
    sadmm_problem_destroy(problem);
    sadmm_world_destroy(world);
}
END_TEST

/* What can be read of the last step is as before, and the next one goes on as if none had failed. */
START_TEST(a_step_that_fails_changes_no_joint)
{
    sadmm_joint_state read[2];
    uint64_t hash[2];
    for (int fails = 0; fails < 2; ++fails) {
        sadmm_world_def def = joint_world(_i ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU, SADMM_F64);
        def.settings.substeps = 2;
        sadmm_world *world = chain(&def, 4);
        const sadmm_body_id top = add_body(world, 9, 9, 9);
        sadmm_joint_id joint;
        step_world(world, 30);
        MUST(world, sadmm_world_joint_at(world, 2, &joint));
        if (fails) fail_a_step(world, top);
        read[fails] = joint_state(world, joint);
        ck_assert(read[fails].wrench_b[2] != 0);
        step_world(world, 10);
        hash[fails] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_int_eq(memcmp(&read[0], &read[1], sizeof read[0]), 0);
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* Memory may run out at any allocation of a call: it says so, and the next call does what it would have done. */
START_TEST(memory_runs_out)
{
    uint64_t hash[2];
    for (int fails = 0; fails < 2; ++fails) {
        const sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
        sadmm_world *world = create_world(&def);
        const sadmm_body_id a = add_body(world, 0, 0, 0), b = add_body(world, 0.3, 0, 0);
        const sadmm_joint_def hinges[2] = {joint_def(SADMM_JOINT_REVOLUTE, WORLD, a),
                                           joint_def(SADMM_JOINT_REVOLUTE, a, b)};
        for (int k = 0; k < 2; ++k) {
            sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
            for (long n = 0; fails && status != SADMM_OK; ++n) {
                ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
                ck_assert_int_eq(sadmm_world_joint_count(world), k);
                sadmm_test_fail_allocations_after(n);
                status = sadmm_world_add_joint(world, &hinges[k], NULL);
                sadmm_test_fail_allocations_after(-1);
            }
            if (!fails) MUST(world, sadmm_world_add_joint(world, &hinges[k], NULL));
        }
        sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
        for (long n = 0; fails && status != SADMM_OK; ++n) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            sadmm_test_fail_allocations_after(n);
            status = sadmm_world_step(world);
            sadmm_test_fail_allocations_after(-1);
        }
        step_world(world, fails ? 9 : 10);
        hash[fails] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* ---- momentum ---------------------------------------------------------------------------------------------------- */

/* Linear momentum and angular momentum about the origin of all dynamic bodies (inertia of add_body). */
static void momenta(sadmm_world *world, double p[6])
{
    memset(p, 0, 6 * sizeof *p);
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        const sadmm_body_def d = body_def(world, body_at(world, i));
        const double *q = d.orientation, *x = d.position, *v = d.linear_velocity, *w = d.angular_velocity;
        const double axes[3][3] = {
            {1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] + q[0] * q[3]), 2 * (q[1] * q[3] - q[0] * q[2])},
            {2 * (q[1] * q[2] - q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] + q[0] * q[1])},
            {2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])}};
        for (int k = 0; k < 3; ++k) {
            const int n = (k + 1) % 3, o = (k + 2) % 3;
            p[k] += d.mass * v[k];
            p[k + 3] += d.mass * (x[n] * v[o] - x[o] * v[n]);
            for (int j = 0; j < 3; ++j)
                p[k + 3] += d.inertia[j] * axes[j][k] * (axes[j][0] * w[0] + axes[j][1] * w[1] + axes[j][2] * w[2]);
        }
    }
}

/* What three jointed bodies in the air lose of their momentum in 1 s: *linear, *angular, relative. planar: they turn in
 * a plane. */
static void lost_momentum(double dt, int iterations, bool planar, double *linear, double *angular)
{
    sadmm_world_def def = joint_world(SADMM_BACKEND_CPU, SADMM_F64);
    def.settings.gravity[2] = 0;
    def.settings.dt = dt;
    def.settings.iterations = iterations;
    sadmm_world *world = create_world(&def);
    double before[6], after[6], off[2] = {0}, size[2] = {0};
    sadmm_body_id last = WORLD;
    for (int k = 0; k < 3; ++k) {
        const sadmm_body_id body = add_body(world, 0.3 * k, 0, 0);
        if (k) add_joint(world, joint_def(SADMM_JOINT_SPHERICAL, last, body), 0.3 * k - 0.15, 0, 0);
        last = body;
    }
    sadmm_body_state state = body_state(world, last);
    state.linear_velocity[1] = 2;
    state.angular_velocity[2] = 2 / 0.15; /* the joint is at rest */
    state.angular_velocity[0] = planar ? 0 : 3;
    MUST(world, sadmm_world_set_body_state(world, last, &state));
    momenta(world, before);
    step_world(world, (int)(1 / dt + 0.5));
    momenta(world, after);
    for (int k = 0; k < 6; ++k) {
        off[k / 3] += (after[k] - before[k]) * (after[k] - before[k]);
        size[k / 3] += before[k] * before[k];
    }
    *linear = sqrt(off[0] / size[0]);
    *angular = sqrt(off[1] / size[1]);
    sadmm_world_destroy(world);
}

/* To rounding, whatever the iterations, in the plane and in space: both bodies of a joint feel what it transmits at one
 * point. */
START_TEST(free_articulations_keep_momentum)
{
    static const int budgets[] = {1, 20, 500};
    for (int k = 0; k < 6; ++k) {
        double linear, angular;
        lost_momentum(0.005, budgets[k / 2], k % 2, &linear, &angular);
        ck_assert_msg(linear < 1e-12 && angular < 1e-12, "%d iterations: %g %g", budgets[k / 2], linear, angular);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("joint");
    TCase *cases = tcase_create("joint");
    tcase_set_timeout(cases, 60);
    suite_add_tcase(suite, cases);
    tcase_add_test(cases, joints_come_and_go);
    tcase_add_test(cases, bad_input_is_refused);
    tcase_add_test(cases, jointed_bodies_do_not_meet);
    if (!races_are_looked_for()) tcase_add_loop_test(cases, kinds_hold, 0, SOLVERS * SADMM_JOINT_KIND_COUNT);
    tcase_add_test(cases, frames_are_drawn_together);
    tcase_add_loop_test(cases, closed_loops_hold, 0, SOLVERS);
    tcase_add_loop_test(cases, reactions_carry_the_weight, 0, SOLVERS);
    tcase_add_loop_test(cases, reactions_in_the_joints_frame, 0, SOLVERS);
    tcase_add_loop_test(cases, joints_break, 0, FAST_SOLVERS);
    tcase_add_loop_test(cases, friction_holds_and_slips, 0, FAST_SOLVERS);
    tcase_add_loop_test(cases, armature, 0, FAST_SOLVERS);
    tcase_add_loop_test(cases, speed_drive, 0, FAST_SOLVERS);
    tcase_add_loop_test(cases, position_drive, 0, FAST_SOLVERS);
    tcase_add_loop_test(cases, limits_hold, 0, FAST_SOLVERS);
    tcase_add_test(cases, limits_that_meet_or_are_none);
    tcase_add_loop_test(cases, springs_are_of_second_order, 0, FAST_SOLVERS);
    tcase_add_loop_test(cases, stiff_springs_do_not_ring, 0, FAST_SOLVERS);
    tcase_add_test(cases, rope);
    tcase_add_loop_test(cases, threads_do_not_show, 0, 2);
    tcase_add_loop_test(cases, backends_agree, 0, 2);
    tcase_add_test(cases, substeps_are_steps);
    tcase_add_test(cases, frozen_problems_have_the_rows);
    tcase_add_loop_test(cases, a_step_that_fails_changes_no_joint, 0, 2);
    tcase_add_test(cases, memory_runs_out);
    tcase_add_test(cases, free_articulations_keep_momentum);
    return run_suite(suite);
}
