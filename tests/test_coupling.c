/* Virtual couplings (coupling.h): what the calls say and refuse; that what the user feels is what the body's motion and
 * contacts ask for; that any gains are stable; bounds, sub-steps, jumps and spins of the target. */
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/math/rigid.h"
#include "failed_step.h"
#include "fixed_work.h"
#include "scene_tools.h"

static const double G = 9.81, UNIT[4] = {1, 0, 0, 0}, ORIGIN[3] = {0, 0, 0};

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    double rounding; /* relative, of a solve to the end */
} solvers[] = {
    {SADMM_BACKEND_CPU, SADMM_F64, 1e-9},
    {SADMM_BACKEND_REF, SADMM_F64, 1e-9},
    {SADMM_BACKEND_CPU, SADMM_F32, 2e-4}, /* velocities to 1e-7 of some m/s, and forces are their changes in 5 ms */
};
enum { SOLVERS = 3 };

/* exact: iterations until nothing changes any more. */
static sadmm_world *new_world(int solver, double dt, bool exact)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.threads = 1;
    def.settings.dt = dt;
    if (exact) def.settings.iterations = 600;
    return create_world(&def);
}

static sadmm_body_id add_body(sadmm_world *world, double mass, const double inertia[3], double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = mass;
    memcpy(def.inertia, inertia, sizeof def.inertia);
    def.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static const double uneven[3] = {0.02, 0.03, 0.04}, even[3] = {0.03, 0.03, 0.03};

static sadmm_coupling_def coupling_def(sadmm_body_id body, double linear, double angular)
{
    sadmm_coupling_def def = sadmm_coupling_def_default();
    def.body = body;
    def.linear_stiffness = linear;
    def.linear_damping = linear / 20;
    def.angular_stiffness = angular;
    def.angular_damping = angular / 20;
    return def;
}

static sadmm_coupling_id add_coupling(sadmm_world *world, const sadmm_coupling_def *def)
{
    sadmm_coupling_id id;
    MUST(world, sadmm_world_add_coupling(world, def, &id));
    return id;
}

static sadmm_coupling_state coupling_state(sadmm_world *world, sadmm_coupling_id id)
{
    sadmm_coupling_state state;
    MUST(world, sadmm_world_coupling_state(world, id, &state));
    return state;
}

static void turn(double q[4], double x, double y, double z) { q_store(q_exp(v3(x, y, z)), q); }

/* ---- the calls --------------------------------------------------------------------------------------------------- */

START_TEST(couplings_come_and_go)
{
    sadmm_world *world = new_world(0, 0.005, false);
    const sadmm_body_id a = add_body(world, 2, uneven, 0), b = add_body(world, 2, uneven, 5);
    const double half[4] = {0.5, 0.5, 0.5, 0.5}, there[3] = {1, 2, 3}, velocity[6] = {1, 0, 0, 0, 2, 0};
    sadmm_coupling_def read, def = coupling_def(a, 100, 10);
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_coupling_state state;
    sadmm_coupling_id id;
    sadmm_joint_id joints[2], found;
    def.position[0] = 0.1;
    joint.kind = SADMM_JOINT_SPHERICAL;
    joint.body_b = b;
    joint.position_a[2] = 5;
    MUST(world, sadmm_world_add_joint(world, &joint, &joints[0]));
    const sadmm_coupling_id first = add_coupling(world, &def);
    def.body = b;
    const sadmm_coupling_id second = add_coupling(world, &def);
    MUST(world, sadmm_world_add_joint(world, &joint, &joints[1]));

    /* they have ids of their own, and joints know nothing of them */
    ck_assert(sadmm_world_coupling_count(world) == 2 && sadmm_world_joint_count(world) == 2);
    ck_assert(first.slot == 1 && second.slot == 2 && joints[0].slot == 1 && joints[1].slot == 2);
    for (int k = 0; k < 2; ++k) {
        MUST(world, sadmm_world_joint_at(world, k, &found));
        ck_assert(found.slot == joints[k].slot && found.generation == joints[k].generation);
    }
    MUST(world, sadmm_world_coupling_at(world, 1, &id));
    ck_assert(id.slot == second.slot && id.generation == second.generation);
    for (uint32_t slot = 1; slot < 6; ++slot) {
        const bool real = slot == joints[0].slot || slot == joints[1].slot;
        ck_assert_int_eq(sadmm_world_joint_def(world, (sadmm_joint_id){slot, 1}, &joint),
                         real ? SADMM_OK : SADMM_ERROR_STALE_ID);
    }

    MUST(world, sadmm_world_set_coupling_target(world, first, there, half, velocity));
    MUST(world, sadmm_world_coupling_def(world, first, &read));
    ck_assert(read.position[0] == 0.1 && read.linear_stiffness == 100 && read.target_position[1] == 2 &&
              read.target_orientation[3] == 0.5 && read.target_velocity[4] == 2 && read.enabled);
    step_world(world, 2);
    ck_assert(world_report(world).couplings == 2 && world_report(world).joints == 2);
    MUST(world, sadmm_world_coupling_def(world, first, &read)); /* it has moved on */
    ck_assert_double_eq_tol(read.target_position[0], 1.01, 1e-15);
    MUST(world, sadmm_world_set_coupling_gains(world, first, 1, 2, 3, 4));
    MUST(world, sadmm_world_set_coupling_limits(world, first, 5, 6));
    MUST(world, sadmm_world_set_coupling_enabled(world, first, false));
    MUST(world, sadmm_world_coupling_def(world, first, &read));
    ck_assert(read.linear_stiffness == 1 && read.linear_damping == 2 && read.angular_stiffness == 3 &&
              read.angular_damping == 4 && read.max_force == 5 && read.max_torque == 6 && !read.enabled);
    ck_assert_double_eq_tol(read.target_position[0], 1.01, 1e-15);
    step_world(world, 1);
    ck_assert_int_eq(world_report(world).couplings, 1);
    ck_assert(coupling_state(world, first).reaction_force[2] == 0);

    MUST(world, sadmm_world_remove_coupling(world, first));
    ck_assert_int_eq(sadmm_world_remove_coupling(world, first), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_coupling_state(world, first, &state), SADMM_ERROR_STALE_ID);
    def.body = a;
    const sadmm_coupling_id third = add_coupling(world, &def);
    ck_assert(third.slot == first.slot && third.generation == first.generation + 1);
    MUST(world, sadmm_world_remove_body(world, b)); /* and what is on it */
    ck_assert(sadmm_world_coupling_count(world) == 1 && sadmm_world_joint_count(world) == 0);
    ck_assert_int_eq(sadmm_world_coupling_def(world, second, &read), SADMM_ERROR_STALE_ID);
    MUST(world, sadmm_world_add_coupling(world, &def, &id));
    joint.body_b = a;
    MUST(world, sadmm_world_add_joint(world, &joint, &found));
    MUST(world, sadmm_world_joint_at(world, 0, &joints[0]));
    ck_assert(sadmm_world_coupling_count(world) == 2 && sadmm_world_joint_count(world) == 1);
    ck_assert_uint_eq(found.slot, joints[0].slot);
    step_world(world, 2);
    sadmm_world_destroy(world);
}
END_TEST

static void check_refused(sadmm_world *world, sadmm_coupling_def def, const char *part)
{
    ck_assert_msg(sadmm_world_add_coupling(world, &def, NULL) == SADMM_ERROR_INVALID_ARGUMENT, "%s: not refused", part);
    ck_assert_msg(strstr(sadmm_world_message(world), part) != NULL, "\"%s\" lacks \"%s\"", sadmm_world_message(world),
                  part);
}

/* Named with its value and range; and the world goes on as one that was never asked. */
START_TEST(bad_input_is_refused)
{
    uint64_t hash[2];
    for (int asked = 0; asked < 2; ++asked) {
        sadmm_world *world = new_world(0, 0.005, false);
        const sadmm_body_id body = add_body(world, 2, uneven, 1);
        const sadmm_coupling_def good = coupling_def(body, 100, 1);
        const sadmm_coupling_id id = add_coupling(world, &good);
        step_world(world, 1);
        if (asked) {
            const double nan3[3] = {0, NAN, 0}, zero[4] = {0}, endless[6] = {0, 0, 0, 0, 0, INFINITY};
            sadmm_coupling_def bad = good;
            sadmm_body_def still = sadmm_body_def_default();
            still.type = SADMM_BODY_STATIC;
            MUST(world, sadmm_world_add_body(world, &still, &bad.body));
            check_refused(world, bad, "must be dynamic");
            MUST(world, sadmm_world_remove_body(world, bad.body));
            ck_assert_int_eq(sadmm_world_add_coupling(world, &bad, NULL), SADMM_ERROR_STALE_ID);
            bad = good, bad.position[2] = NAN;
            check_refused(world, bad, "def->position[2] = nan");
            bad = good, bad.orientation[0] = 2;
            check_refused(world, bad, "def->orientation = (2, 0, 0, 0)");
            bad = good, bad.target_position[0] = 2e9;
            check_refused(world, bad, "def->target_position[0] = 2e+09");
            bad = good, bad.target_orientation[0] = NAN;
            check_refused(world, bad, "def->target_orientation = (nan");
            bad = good, bad.target_velocity[5] = NAN;
            check_refused(world, bad, "def->target_velocity[5] = nan");
            bad = good, bad.linear_stiffness = -1;
            check_refused(world, bad, "def->linear_stiffness = -1: must be in [0, 1e+15]");
            bad = good, bad.linear_damping = NAN;
            check_refused(world, bad, "def->linear_damping = nan");
            bad = good, bad.angular_stiffness = INFINITY;
            check_refused(world, bad, "def->angular_stiffness = inf");
            bad = good, bad.angular_damping = 2e15;
            check_refused(world, bad, "def->angular_damping = 2e+15");
            bad = good, bad.max_force = -1;
            check_refused(world, bad, "def->max_force = -1: must be in [0, inf]");
            bad = good, bad.max_torque = NAN;
            check_refused(world, bad, "def->max_torque = nan");
            ck_assert_int_eq(sadmm_world_set_coupling_target(world, id, nan3, UNIT, NULL),
                             SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert(strstr(sadmm_world_message(world), "position[1] = nan") != NULL);
            ck_assert_int_eq(sadmm_world_set_coupling_target(world, id, ORIGIN, zero, NULL),
                             SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_set_coupling_target(world, id, ORIGIN, UNIT, endless),
                             SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_set_coupling_target(world, id, NULL, UNIT, NULL),
                             SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_set_coupling_gains(world, id, 1, 1, -1, 1), SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_set_coupling_limits(world, id, NAN, 1), SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_coupling_at(world, 1, &(sadmm_coupling_id){0}), SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_int_eq(sadmm_world_remove_coupling(world, (sadmm_coupling_id){0}), SADMM_ERROR_STALE_ID);
            ck_assert_int_eq(sadmm_world_set_coupling_enabled(world, (sadmm_coupling_id){9, 1}, true),
                             SADMM_ERROR_STALE_ID);
        }
        step_world(world, 20);
        hash[asked] = state_hash(world);
        ck_assert_int_eq(sadmm_world_coupling_count(world), 1);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* ---- reaction ---------------------------------------------------------------------------------------------------- */

/* A body that hangs by a point beside its centre: the spring gives by its weight, and the user holds the weight and its
 * torque. */
START_TEST(the_user_holds_the_weight)
{
    sadmm_world *world = new_world(_i, 0.005, true);
    sadmm_coupling_def def = coupling_def(add_body(world, 2, even, 0), 2000, 50);
    def.position[0] = 0.1;
    def.target_position[0] = 0.1;
    const sadmm_coupling_id id = add_coupling(world, &def);
    step_world(world, 400);
    const sadmm_coupling_state state = coupling_state(world, id);
    const double close = solvers[_i].precision == SADMM_F32 ? 1e-5 : 1e-9; /* relative; oscillations are over */
    const double sag = state.rotation_error[1]; /* the weight, on its arm, tilts the body about y, against the spring */
    ck_assert_double_eq_tol(state.reaction_force[2], -2 * G, 2 * G * close);
    ck_assert_double_eq_tol(state.body_force[2], 2 * G, 2 * G * close);
    ck_assert_double_eq_tol(state.position_error[2], 2 * G / 2000, 2 * G / 2000 * close);
    ck_assert_double_eq_tol(state.reaction_torque[1], -0.1 * cos(sag) * 2 * G, 0.1 * 2 * G * close);
    ck_assert_double_eq_tol(state.reaction_torque[1], -50 * sag, 0.1 * 2 * G * close);
    sadmm_world_destroy(world);
}
END_TEST

static vec3 momentum_of(const sadmm_body_state *state, vec3 inertia)
{
    return rigid_angular_momentum(q_load(state->orientation), inertia, v3_load(state->angular_velocity));
}

/* Of all that turned the body in a step: what its angular momentum in space has changed by. */
static vec3 torque_of(const sadmm_body_state *before, const sadmm_body_state *after, vec3 inertia, double dt)
{
    return v3_scale(v3_sub(momentum_of(after, inertia), momentum_of(before, inertia)), 1 / dt);
}

/* From one step to the next, the body's wrench is m a, and the torque above, less weight and contacts; and the reaction
 * is its reaction, about the target's origin. Returns the largest error over the largest force, or torque. */
static double wrench_error(sadmm_world *world, sadmm_body_id body, sadmm_coupling_id id, const sadmm_body_state *before,
                           const sadmm_coupling_def *target, double dt, const double contact[6])
{
    const sadmm_body_state after = body_state(world, body);
    const sadmm_body_def d = body_def(world, body);
    const sadmm_coupling_state state = coupling_state(world, id);
    const vec3 torque = torque_of(before, &after, v3_load(d.inertia), dt);
    const vec3 center = rigid_move(v3_load(before->position), v3_load(before->linear_velocity), dt / 2),
               origin = rigid_move(v3_load(target->target_position), v3_load(target->target_velocity), dt / 2);
    double force_error = 0, torque_error = 0, size[2] = {1e-3, 1e-3}; /* N and N m, where all is at rest */
    double force[3], own[3], reaction[3];
    for (int k = 0; k < 3; ++k)
        force[k] = d.mass * ((after.linear_velocity[k] - before->linear_velocity[k]) / dt + (k == 2 ? G : 0)) -
                   contact[k];
    v3_store(v3_sub(torque, v3_load(contact + 3)), own);
    v3_store(v3_neg(v3_add(v3_load(own), v3_cross(v3_sub(center, origin), v3_load(force)))), reaction);
    for (int k = 0; k < 3; ++k) {
        size[0] = fmax(size[0], fmax(fabs(force[k]), fabs(contact[k])));
        size[1] = fmax(size[1], fmax(fmax(fabs(own[k]), fabs(reaction[k])), fabs(contact[k + 3])));
        force_error = fmax(force_error, fabs(state.body_force[k] - force[k]));
        force_error = fmax(force_error, fabs(state.reaction_force[k] + force[k]));
        torque_error = fmax(torque_error, fabs(state.body_torque[k] - own[k]));
        torque_error = fmax(torque_error, fabs(state.reaction_torque[k] - reaction[k]));
    }
    return fmax(force_error / size[0], torque_error / size[1]);
}

/* A target that goes about and turns, jumps now and then, and pulls at a body in the air with three different moments,
 * beside its centre. */
START_TEST(reaction_is_inertia_and_weight)
{
    const double dt = 0.005;
    sadmm_world *world = new_world(_i, dt, true);
    const sadmm_body_id body = add_body(world, 2, uneven, 0);
    sadmm_coupling_def def = coupling_def(body, 3000, 40);
    double worst = 0;
    def.position[0] = 0.05, def.position[2] = -0.1;
    turn(def.orientation, 0.3, -0.2, 0.5);
    const sadmm_coupling_id id = add_coupling(world, &def);
    for (int step = 0; step < 300; ++step) {
        const double t = dt * step, *v = def.target_velocity;
        const double there[3] = {0.1 * sin(3 * t), 0.2 * cos(2 * t), step % 97 == 50 ? 0.05 : 0},
                     velocity[6] = {0.3 * cos(3 * t), -0.4 * sin(2 * t), 0, 0.5 * cos(t), 0, 1.5};
        double q[4];
        turn(q, 0.5 * sin(t), 0, 1.5 * t);
        MUST(world, sadmm_world_set_coupling_target(world, id, there, q, velocity));
        MUST(world, sadmm_world_coupling_def(world, id, &def));
        ck_assert(v[5] == 1.5);
        const sadmm_body_state before = body_state(world, body);
        step_world(world, 1);
        worst = fmax(worst, wrench_error(world, body, id, &before, &def, dt, (const double[6]){0}));
    }
    ck_assert_msg(worst < solvers[_i].rounding, "%g", worst);
    sadmm_world_destroy(world);
}
END_TEST

/* A box that is pressed onto a floor with friction and pulled over it; and lifted, and dropped onto an edge. */
START_TEST(reaction_is_contact_inertia_and_weight)
{
    /* single precision: friction takes iterations, and each rounds */
    const double dt = 0.005, rounding = _i == 2 ? 1e-3 : solvers[_i].rounding;
    sadmm_world *world = new_world(_i, dt, true);
    sadmm_settings settings = sadmm_world_settings(world);
    sadmm_shape_def box = sadmm_shape_def_default();
    settings.iterations = 4000;
    MUST(world, sadmm_world_set_settings(world, &settings));
    const sadmm_body_id body = add_body(world, 2, even, 0.1);
    sadmm_coupling_def def = coupling_def(body, 1000, 20);
    double worst = 0, touched = 0;
    box.type = SADMM_SHAPE_BOX;
    for (int k = 0; k < 3; ++k) box.size[k] = 0.1;
    MUST(world, sadmm_world_add_shape(world, body, &box, NULL));
    add_floor(world, 0.5);
    def.position[2] = 0.1;
    const sadmm_coupling_id id = add_coupling(world, &def);
    for (int step = 0; step < 160; ++step) {
        const double t = dt * step, *at = def.target_position;
        const double there[3] = {0.1 * t, 0.05 * sin(5 * t), step < 100 ? 0.19 : 0.25}, still[6] = {0.1};
        double q[4], contact[6];
        turn(q, step < 100 ? 0 : 0.5, 0, 0.3 * t);
        MUST(world, sadmm_world_set_coupling_target(world, id, there, q, still));
        MUST(world, sadmm_world_coupling_def(world, id, &def));
        ck_assert(at[2] == there[2]);
        const sadmm_body_state before = body_state(world, body);
        step_world(world, 1);
        MUST(world, sadmm_world_body_contact_wrench(world, body, contact));
        touched += contact[2] > 0;
        worst = fmax(worst, wrench_error(world, body, id, &before, &def, dt, contact));
    }
    ck_assert_double_gt(touched, 50);
    ck_assert_msg(worst < rounding, "%g", worst);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- stability --------------------------------------------------------------------------------------------------- */

/* 10 g, 10 ms, a tenth of a second to everywhere: the target jumps by 1 m and 2 rad and stays. With any gains the body
 * is never faster than the jump in a step, and with a spring and a damper it arrives. */
START_TEST(any_gains_are_stable)
{
    static const double gains[] = {0, 1e-3, 1, 1e3, 1e6, 1e9, 1e12, 1e15};
    enum { GAINS = sizeof gains / sizeof *gains };
    const double dt = 0.01, small[3] = {1e-6, 3e-6, 4e-6}, there[3] = {1, 0, 0};
    double q[4];
    turn(q, 0, 2, 0);
    for (int k = 0; k < GAINS * GAINS; ++k) {
        sadmm_world *world = new_world(_i, dt, false);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.gravity[2] = 0;
        MUST(world, sadmm_world_set_settings(world, &settings));
        const sadmm_body_id body = add_body(world, 0.01, small, 0);
        sadmm_coupling_def def = coupling_def(body, gains[k / GAINS], gains[k / GAINS] * 1e-3);
        double top[2] = {0};
        def.linear_damping = gains[k % GAINS];
        def.angular_damping = gains[k % GAINS] * 1e-3;
        def.position[0] = 0.01;
        const sadmm_coupling_id id = add_coupling(world, &def);
        step_world(world, 5);
        MUST(world, sadmm_world_set_coupling_target(world, id, there, q, NULL));
        for (int step = 0; step < 300; ++step) {
            step_world(world, 1);
            const sadmm_body_state state = body_state(world, body);
            top[0] = fmax(top[0], norm3(state.linear_velocity));
            top[1] = fmax(top[1], norm3(state.angular_velocity));
        }
        const sadmm_coupling_state state = coupling_state(world, id);
        /* the jump in one step; half as much again for the point being beside the centre, and gyroscopic coupling */
        ck_assert_msg(top[0] < 1.5 * 1.02 / dt && top[1] < 1.5 * 2 / dt, "gains %g, %g: %g m/s, %g rad/s",
                      gains[k / GAINS], gains[k % GAINS], top[0], top[1]);
        /* where the slower of the two rates has been through ten times in the 3 s, and rounding stops none */
        const double stiffness = gains[k / GAINS], damping = gains[k % GAINS];
        if (stiffness > 1 && damping > 0.1 && stiffness / damping > 4 && stiffness < 1e4 * fmax(damping, 1e-2))
            ck_assert_msg(norm3(state.position_error) < 1e-4 && norm3(state.rotation_error) < 1e-4,
                          "gains %g, %g: off by %g m, %g rad", stiffness, damping, norm3(state.position_error),
                          norm3(state.rotation_error));
        sadmm_world_destroy(world);
    }
}
END_TEST

/* The target spins: without friction and weight the body follows it without lag, and there is no reaction. */
START_TEST(spinning_targets_are_followed)
{
    static const double speeds[] = {1, 30, 120}; /* rad/s: up to 0.6 rad a step */
    for (int k = 0; k < 3; ++k) {
        sadmm_world *world = new_world(_i, 0.005, false);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.gravity[2] = 0;
        MUST(world, sadmm_world_set_settings(world, &settings));
        const sadmm_body_id body = add_body(world, 2, uneven, 0);
        sadmm_coupling_def def = coupling_def(body, 1000, 40);
        def.target_velocity[0] = 0.5;
        def.target_velocity[5] = speeds[k]; /* about a principal axis */
        def.angular_damping = 4;
        const sadmm_coupling_id id = add_coupling(world, &def);
        step_world(world, 600);
        const sadmm_body_state body_now = body_state(world, body);
        const sadmm_coupling_state state = coupling_state(world, id);
        const double close = _i == 2 ? 1e-5 : 1e-9; /* relative: what is left of the start, and rounding */
        ck_assert_double_eq_tol(body_now.angular_velocity[2], speeds[k], close * speeds[k]);
        ck_assert_msg(norm3(state.rotation_error) < 10 * close && norm3(state.position_error) < 10 * close, "%g %g",
                      norm3(state.rotation_error), norm3(state.position_error));
        ck_assert_double_lt(norm3(state.reaction_torque), 10 * close * 40);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* ---- bounds ------------------------------------------------------------------------------------------------------ */

/* A target out of reach: the largest force along its axes, exactly, and the acceleration of it. */
START_TEST(forces_are_bounded)
{
    const double dt = 0.005, side = sqrt(0.5);
    sadmm_world *world = new_world(_i, dt, true);
    sadmm_settings settings = sadmm_world_settings(world);
    settings.gravity[2] = 0;
    MUST(world, sadmm_world_set_settings(world, &settings));
    const sadmm_body_id body = add_body(world, 2, even, 0);
    sadmm_coupling_def def = coupling_def(body, 1e6, 1e4);
    def.max_force = 3;
    def.max_torque = 0.02;
    def.target_position[0] = 10;
    turn(def.target_orientation, 0, 0, -0.78539816339744830962); /* its axes x and -y point to (1, -1) and (-1, -1) */
    const sadmm_coupling_id id = add_coupling(world, &def);
    step_world(world, 10);
    const sadmm_coupling_state state = coupling_state(world, id);
    const double close = _i == 2 ? 1e-6 : 1e-12; /* rounding */
    ck_assert_double_eq_tol(state.body_force[0], 3 * 2 * side, 10 * close);
    ck_assert_double_eq_tol(state.body_force[1], 0, 10 * close);
    ck_assert_double_eq_tol(state.body_torque[2], -0.02, close);
    ck_assert_double_eq_tol(body_state(world, body).linear_velocity[0], 6 * side / 2 * 10 * dt, 10 * close);
    ck_assert_double_eq_tol(body_state(world, body).angular_velocity[2], -0.02 / 0.03 * 10 * dt, 10 * close);
    MUST(world, sadmm_world_set_coupling_limits(world, id, 0, 0)); /* none at all */
    const sadmm_body_state before = body_state(world, body);
    step_world(world, 10);
    ck_assert_double_eq_tol(body_state(world, body).linear_velocity[0], before.linear_velocity[0], close);
    ck_assert(coupling_state(world, id).reaction_force[0] == 0);
    sadmm_world_destroy(world);
}
END_TEST

/* Without gains it is not there, to the last bit. */
START_TEST(no_gains_are_no_coupling)
{
    uint64_t hash[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_world *world = new_world(_i, 0.005, false);
        const sadmm_body_id body = add_body(world, 2, uneven, 1);
        const sadmm_coupling_def def = coupling_def(body, 0, 0);
        if (k) add_coupling(world, &def);
        step_world(world, 50);
        ck_assert_int_eq(world_report(world).couplings, 0);
        hash[k] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* ---- steps ------------------------------------------------------------------------------------------------------- */

static sadmm_coupling_id pull(sadmm_world *world)
{
    const sadmm_body_id body = add_body(world, 2, uneven, 0);
    sadmm_coupling_def def = coupling_def(body, 1000, 10);
    def.position[1] = 0.1;
    def.target_velocity[0] = 1;
    def.target_velocity[4] = 2;
    return add_coupling(world, &def);
}

/* A step of three sub-steps is three steps to the last bit, for the target moves on in each; the reaction is the
 * mean. */
START_TEST(substeps_are_steps)
{
    uint64_t hash[2];
    sadmm_coupling_def defs[2];
    double mean[6] = {0}, size = 0;
    for (int k = 0; k < 2; ++k) {
        sadmm_world *world = new_world(0, k ? 3 * 0.0078125 : 0.0078125, false);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = k ? 3 : 1;
        settings.iterations = k ? 60 : 20;
        MUST(world, sadmm_world_set_settings(world, &settings));
        const sadmm_coupling_id id = pull(world);
        for (int step = 0; step < (k ? 10 : 30); ++step) {
            step_world(world, 1);
            const sadmm_coupling_state state = coupling_state(world, id);
            for (int j = 0; j < 3; ++j) {
                if (!k && step >= 27)
                    mean[j] += state.reaction_force[j] / 3, mean[j + 3] += state.reaction_torque[j] / 3;
                if (k && step == 9) mean[j] -= state.reaction_force[j], mean[j + 3] -= state.reaction_torque[j];
                size = fmax(size, fabs(state.reaction_force[j]));
            }
        }
        hash[k] = state_hash(world);
        MUST(world, sadmm_world_coupling_def(world, id, &defs[k]));
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
    ck_assert_int_eq(memcmp(defs[0].target_position, defs[1].target_position, sizeof defs[0].target_position), 0);
    ck_assert_int_eq(memcmp(defs[0].target_orientation, defs[1].target_orientation, sizeof defs[0].target_orientation),
                     0);
    for (int j = 0; j < 6; ++j) ck_assert_double_lt(fabs(mean[j]), 1e-14 * size); /* rounding of the sum */
}
END_TEST

/* After a step that failed targets and forces are as before, and the next one goes on as if none had. */
START_TEST(a_step_that_fails_changes_no_coupling)
{
    sadmm_coupling_state read[2];
    uint64_t hash[2];
    for (int fails = 0; fails < 2; ++fails) {
        sadmm_world *world = new_world(_i, 0.005, false);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.substeps = 2;
        MUST(world, sadmm_world_set_settings(world, &settings));
        const sadmm_coupling_id id = pull(world);
        const sadmm_body_id top = add_body(world, 2, uneven, 9);
        step_world(world, 30);
        if (fails) fail_a_step(world, top);
        read[fails] = coupling_state(world, id);
        ck_assert(read[fails].reaction_force[2] != 0);
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
        sadmm_world *world = new_world(0, 0.005, false);
        const sadmm_coupling_def def = coupling_def(add_body(world, 2, uneven, 0), 100, 10);
        sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
        for (long n = 0; fails && status != SADMM_OK; ++n) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert(sadmm_world_coupling_count(world) == 0 && sadmm_world_joint_count(world) == 0);
            sadmm_test_fail_allocations_after(n);
            status = sadmm_world_add_coupling(world, &def, NULL);
            sadmm_test_fail_allocations_after(-1);
        }
        if (!fails) add_coupling(world, &def);
        status = SADMM_ERROR_OUT_OF_MEMORY;
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

int main(void)
{
    Suite *suite = suite_create("coupling");
    TCase *cases = tcase_create("coupling");
    tcase_set_timeout(cases, 60);
    suite_add_tcase(suite, cases);
    tcase_add_test(cases, couplings_come_and_go);
    tcase_add_test(cases, bad_input_is_refused);
    tcase_add_loop_test(cases, the_user_holds_the_weight, 0, SOLVERS);
    tcase_add_loop_test(cases, reaction_is_inertia_and_weight, 0, SOLVERS);
    tcase_add_loop_test(cases, reaction_is_contact_inertia_and_weight, 0, SOLVERS);
    tcase_add_loop_test(cases, any_gains_are_stable, 0, SOLVERS);
    tcase_add_loop_test(cases, spinning_targets_are_followed, 0, SOLVERS);
    tcase_add_loop_test(cases, forces_are_bounded, 0, SOLVERS);
    tcase_add_loop_test(cases, no_gains_are_no_coupling, 0, SOLVERS);
    tcase_add_test(cases, substeps_are_steps);
    tcase_add_loop_test(cases, a_step_that_fails_changes_no_coupling, 0, SOLVERS);
    tcase_add_test(cases, memory_runs_out);
    return run_suite(suite);
}
