/* Motion in space of bodies whose principal moments differ: alone, under torques, on springs and on joints. What is
 * known of it in closed form, what it keeps, and its order against the same motion by short steps. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/rigid.h"
#include "fewer.h"
#include "fixed_work.h"
#include "momentum_worlds.h"
#include "solvers.h"

static const double G = 9.81;

static sadmm_world *new_world(int solver, double dt, double gravity)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.method = solvers[solver].method;
    def.settings.dt = dt;
    def.settings.gravity[2] = -gravity;
    def.settings.threads = 1;
    return create_world(&def);
}

static sadmm_body_id add_body(sadmm_world *world, double mass, const double inertia[3], const double position[3],
                              quat orientation, const double velocity[6])
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = mass;
    q_store(orientation, def.orientation);
    for (int k = 0; k < 3; ++k) {
        def.inertia[k] = inertia[k];
        def.position[k] = position[k];
        def.linear_velocity[k] = velocity[k];
        def.angular_velocity[k] = velocity[k + 3];
    }
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static quat turned_about(double x, double y, double z) { return q_exp(v3(x, y, z)); }

/* Where its bodies are. */
static void add_joint(sadmm_world *world, sadmm_joint_kind kind, sadmm_body_id a, sadmm_body_id b, vec3 point,
                      quat frame)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_joint_id id;
    double position[3], orientation[4];
    def.kind = kind;
    def.body_a = a, def.body_b = b;
    v3_store(point, position);
    q_store(frame, orientation);
    MUST(world, sadmm_world_place_joint(world, &def, position, orientation));
    MUST(world, sadmm_world_add_joint(world, &def, &id));
}

static vec3 spin_momentum(const sadmm_body_def *body)
{
    return rigid_angular_momentum(q_load(body->orientation), v3_load(body->inertia), v3_load(body->angular_velocity));
}

/* Of all bodies: linear and angular momentum about the origin, and energy. */
struct totals {
    vec3 linear, angular;
    double energy;
};

static struct totals totals_of(sadmm_world *world, double gravity)
{
    struct totals sum = {{0, 0, 0}, {0, 0, 0}, 0};
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        const sadmm_body_def b = body_def(world, body_at(world, i));
        if (b.type != SADMM_BODY_DYNAMIC) continue;
        const vec3 p = v3_scale(v3_load(b.linear_velocity), b.mass), L = spin_momentum(&b);
        sum.linear = v3_add(sum.linear, p);
        sum.angular = v3_add(sum.angular, v3_add(L, v3_cross(v3_load(b.position), p)));
        sum.energy +=
            v3_norm2(p) / b.mass / 2 + v3_dot(L, v3_load(b.angular_velocity)) / 2 + b.mass * gravity * b.position[2];
    }
    return sum;
}

static double off(vec3 a, vec3 b) { return v3_norm(v3_sub(a, b)); }

/* Moments of a body that is no plate: each less than the sum of the others. */
static void random_moments(uint64_t *seed, double size, double moments[3])
{
    double square[3];
    for (int k = 0; k < 3; ++k) square[k] = size * (1.05 + random_number(seed)); /* mean squares of its extents */
    for (int k = 0; k < 3; ++k) moments[k] = square[(k + 1) % 3] + square[(k + 2) % 3];
}

static quat random_turn(uint64_t *seed)
{
    return turned_about(2 * random_number(seed), 2 * random_number(seed), 2 * random_number(seed));
}

/* ---- alone ------------------------------------------------------------------------------------------------------- */

/* Energy and angular momentum in space, its direction too, of any spin. Velocities are of single precision there, and
 * what they are rounded by in a step adds up like a random walk at best and linearly at worst. */
START_TEST(free_bodies_keep_angular_momentum)
{
    enum { STEPS = 1000 };
    const double rounding = solvers[_i].precision == SADMM_F64 ? 1e-15 : 1e-7, most = rounding * STEPS;
    uint64_t seed = 5;
    for (int trial = 0; trial < fewer(12); ++trial) {
        const double spin = trial % 3 == 0 ? 1 : trial % 3 == 1 ? 20 : 700, zero[3] = {0};
        double moments[3], velocity[6] = {0};
        sadmm_world *world = new_world(_i, 0.005, 0);
        random_moments(&seed, 0.1, moments);
        for (int k = 3; k < 6; ++k) velocity[k] = spin * random_number(&seed);
        add_body(world, 1, moments, zero, random_turn(&seed), velocity);
        const struct totals before = totals_of(world, 0);
        step_world(world, STEPS);
        const struct totals after = totals_of(world, 0);
        const double lost = off(after.angular, before.angular) / v3_norm(before.angular),
                     gained = fabs(after.energy / before.energy - 1);
        ck_assert_msg(lost < most && gained < most, "trial %d: %g %g", trial, lost, gained);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* A turn without torque by -dt is the way back, at any speed, from where one by dt gets to. */
START_TEST(turns_can_be_taken_back)
{
    uint64_t seed = 11;
    for (int trial = 0; trial < fewer(400); ++trial) {
        const double dt = 0.01, spin = pow(10, 2 + 2 * random_number(&seed)); /* up to 100 rad in the step */
        double moments[3];
        random_moments(&seed, 0.1, moments);
        const vec3 inertia = v3_load(moments), w = v3(spin * random_number(&seed), spin * random_number(&seed), spin);
        const struct rigid_spin start = {random_turn(&seed), w}, there = rigid_tumble(start, inertia, dt),
                                back = rigid_tumble(there, inertia, -dt);
        const quat p = start.orientation, q = back.orientation;
        const double turned = 1 - fabs(p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z);
        /* about an axis of the middle moment errors grow by e^(angle), 1e-16 to 1e-6 at the largest speeds */
        const double most = spin * dt < 5 ? 1e-12 : 1e-3;
        ck_assert_msg(off(back.angular, w) < most * v3_norm(w) && turned < most * most + 1e-15, "spin %g: %g %g", spin,
                      off(back.angular, w) / v3_norm(w), turned);
        ck_assert(off(there.angular, w) > 1e-9 * v3_norm(w)); /* it has gone somewhere */
    }
}
END_TEST

/* What turns by more than is followed in a step, 1e5 rad here, keeps its energy and its angular momentum. */
START_TEST(any_spin_is_finite)
{
    uint64_t seed = 17;
    for (int trial = 0; trial < fewer(20); ++trial) {
        double moments[3];
        random_moments(&seed, 0.1, moments);
        const vec3 inertia = v3_load(moments), w = v3(4e6, 5e6 * random_number(&seed), 5e6 * random_number(&seed));
        const struct rigid_spin start = {random_turn(&seed), w}, there = rigid_tumble(start, inertia, 0.02);
        const vec3 before = rigid_angular_momentum(start.orientation, inertia, start.angular),
                   after = rigid_angular_momentum(there.orientation, inertia, there.angular);
        /* rounding of 4,096 turns */
        ck_assert_double_lt(off(after, before), 1e-11 * v3_norm(before));
        ck_assert_double_eq_tol(v3_dot(after, there.angular), v3_dot(before, w), 1e-11 * v3_dot(before, w));
    }
}
END_TEST

/* A body that turns about a principal axis turns by spin x time, whatever its moments. */
START_TEST(spins_about_principal_axes_are_exact)
{
    const double moments[3] = {0.1, 0.15, 0.2}, zero[3] = {0}, velocity[6] = {0, 0, 0, 0, 0, 60};
    sadmm_world *world = new_world(0, 0.005, 0);
    const sadmm_body_id body = add_body(world, 1, moments, zero, turned_about(0, 0, 0), velocity);
    step_world(world, 1000);
    const sadmm_body_state state = body_state(world, body);
    /* rounding of a thousand turns of 0.3 rad */
    ck_assert_double_eq_tol(state.orientation[0], cos(150), 1e-12);
    ck_assert_double_eq_tol(state.orientation[3], sin(150), 1e-12);
    sadmm_world_destroy(world);
}
END_TEST

/* Angular momentum in space is what a torque has given by now, to rounding, though the motion is not. */
START_TEST(torques_add_to_angular_momentum)
{
    const double moments[3] = {0.1, 0.15, 0.2}, zero[3] = {0}, velocity[6] = {0, 0, 0, 2, 3, -4},
                 torque[3] = {0.5, -0.3, 0.8}, none[3] = {0};
    sadmm_world *world = new_world(_i, 0.005, 0);
    const sadmm_body_id id = add_body(world, 1, moments, zero, turned_about(0.1, 0.7, -0.2), velocity);
    const struct totals before = totals_of(world, 0);
    for (int step = 0; step < 1000; ++step) {
        MUST(world, sadmm_world_set_body_wrench(world, id, none, torque));
        step_world(world, 1);
    }
    const vec3 wanted = v3_madd(before.angular, 5, v3_load(torque));
    const double lost = off(totals_of(world, 0).angular, wanted) / v3_norm(wanted);
    ck_assert_msg(lost < (solvers[_i].precision == SADMM_F64 ? 1e-12 : 1e-4), "%g", lost); /* as above */
    sadmm_world_destroy(world);
}
END_TEST

/* ---- steady motions ---------------------------------------------------------------------------------------------- */

/* A symmetric body on a ball joint, c from its centre of mass, goes round the vertical with its axis at a constant
 * angle phi from the way down, at the rate w, which turns it, and a spin s about its own axis besides:
 *
 *     (T + m c^2) w^2 cos phi - A w (w cos phi + s) = -+ m g c       T, A: moments across and along the axis
 *
 * above (top) or below (pendulum). The most that the angle is off in `time`, and what energy and L_z change by. */
struct steady {
    double angle, energy, momentum;
};

static struct steady steady_motion(int solver, double dt, double time, double across, double along, double phi,
                                   double rate, bool carrier)
{
    const double m = 1, c = 0.5, still[3] = {0}, bearing[3] = {0.01, 0.01, 0.01};
    const vec3 axis = v3(sin(phi), 0, -cos(phi)); /* from the joint to the centre of mass */
    /* torque of the weight about the joint is dL/dt = w x L, all of it about y */
    const double spin = ((across + m * c * c) * rate * rate * cos(phi) - m * G * c) / (along * rate) - rate * cos(phi);
    const vec3 angular = v3_madd(v3(0, 0, rate), -spin, axis), center = v3_scale(axis, c),
               linear = v3_cross(angular, center);
    const double moments[3] = {across, across, along};
    double position[3], velocity[6];
    struct steady out = {0, 0, 0};
    sadmm_world *world = new_world(solver, dt, G);
    v3_store(center, position);
    v3_store(linear, velocity);
    v3_store(angular, velocity + 3);
    /* its z axis is up along the way from the centre of mass to the joint, from the joint on to -axis */
    const sadmm_body_id body = add_body(world, m, moments, position, turned_about(0, -phi, 0), velocity);
    if (carrier) { /* the joint is two hinges, by a body that goes round */
        const double round[6] = {0, 0, 0, 0, 0, rate};
        const sadmm_body_id first = add_body(world, 1, bearing, still, turned_about(0, 0, 0), round);
        add_joint(world, SADMM_JOINT_REVOLUTE, (sadmm_body_id){0, 0}, first, v3(0, 0, 0), turned_about(0, 0, 0));
        add_joint(world, SADMM_JOINT_REVOLUTE, first, body, v3(0, 0, 0), turned_about(-acos(-1) / 2, 0, 0));
    } else {
        add_joint(world, SADMM_JOINT_SPHERICAL, (sadmm_body_id){0, 0}, body, v3(0, 0, 0), turned_about(0, 0, 0));
    }
    const struct totals before = totals_of(world, G);
    for (int step = 0; step < (int)lround(time / dt); ++step) {
        step_world(world, 1);
        const sadmm_body_state state = body_state(world, body);
        const double now = atan2(hypot(state.position[0], state.position[1]), -state.position[2]);
        out.angle = fmax(out.angle, fabs(now - phi));
        out.energy = fmax(out.energy, fabs(totals_of(world, G).energy - before.energy));
    }
    out.momentum = fabs(totals_of(world, G).angular.z / before.angular.z - 1);
    out.energy /= fabs(before.energy);
    sadmm_world_destroy(world);
    return out;
}

/* A rod that goes round, on a ball joint and on two hinges; tops, whose weight is above; a pendulum that spins, too. */
static const struct {
    double across, along, phi, rate; /* rate 0: that of a rod without a spin of its own */
    bool carrier;
} motions[] = {
    {1.0 / 12, 1e-5, 1.0, 0, false}, {1.0 / 12, 1e-5, 1.0, 0, true}, {0.02, 0.03, 2.6, 3, false},
    {0.02, 0.03, 2.0, -4, false},    {0.05, 0.03, 0.8, 4, false},
};
enum { MOTIONS = sizeof motions / sizeof *motions };

/* Second order: a quarter of the step, a sixteenth of the error; 10 leaves room for higher terms. What energy and L_z
 * are off by is of higher order. */
START_TEST(steady_motions_on_joints)
{
    const int solver = _i / MOTIONS, k = _i % MOTIONS;
    const double across = motions[k].across, along = motions[k].along, phi = motions[k].phi,
                 rate = motions[k].rate != 0 ? motions[k].rate : sqrt(0.5 * G / ((across + 0.25 - along) * cos(phi)));
    struct steady off[2];
    for (int h = 0; h < 2; ++h)
        off[h] = steady_motion(solver, h ? 0.00125 : 0.005, 2, across, along, phi, rate, motions[k].carrier);
    ck_assert_msg(off[1].angle < 2e-3, "%g rad", off[1].angle);
    ck_assert_msg(off[0].angle > 10 * off[1].angle, "%g %g rad", off[0].angle, off[1].angle);
    ck_assert_msg(off[0].energy > 10 * off[1].energy, "%g %g of the energy", off[0].energy, off[1].energy);
    ck_assert_msg(off[0].momentum > 10 * off[1].momentum || off[0].momentum < 1e-10, "%g %g of L", off[0].momentum,
                  off[1].momentum);
}
END_TEST

/* A ball on a stiff spring with a damper whirls round a point: its length stays, so that the damper has nothing to do,
 * whatever it is. */
START_TEST(a_damped_spring_whirls)
{
    static const double springs[][2] = {{1e6, 0}, {1e6, 1e3}, {1e6, 1e5}, {8e5, 4e4}, {1e4, 1e3}};
    const double rate = 10, moments[3] = {1e-3, 1e-3, 1e-3}, stiffness = springs[_i % 5][0],
                 length = stiffness / (stiffness - rate * rate);
    const double position[3] = {length, 0, 0}, velocity[6] = {0, rate * length, 0, 0, 0, 0};
    sadmm_world *world = new_world(0, 0.005, 0);
    const sadmm_body_id ball = add_body(world, 1, moments, position, turned_about(0, 0, 0), velocity);
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_joint_id id;
    def.kind = SADMM_JOINT_SPRING;
    def.body_b = ball;
    if (_i < 5) {
        def.coordinates[0].spring_stiffness = stiffness;
        def.coordinates[0].spring_damping = springs[_i][1];
        def.coordinates[0].spring_rest = 1;
    } else {
        def.coordinates[0].drive = SADMM_DRIVE_POSITION;
        def.coordinates[0].drive_stiffness = stiffness;
        def.coordinates[0].drive_damping = springs[_i % 5][1];
        def.coordinates[0].target_position = 1;
    }
    MUST(world, sadmm_world_add_joint(world, &def, &id));
    step_world(world, 400);
    const sadmm_body_state state = body_state(world, ball);
    /* stretched by 0.1 mm to 1 cm, right to second order: (w dt)^2 of it. A damper that sees a rate of w^2 L dt / 2
     * gives 2.5 mm to 25 mm. */
    ck_assert_double_eq_tol(norm3(state.position), length, (length - 1) * rate * rate * 0.005 * 0.005);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- trees ------------------------------------------------------------------------------------------------------- */

/* Bodies with random moments, each on a ball joint or hinge to one before it, that spin by up to `fast` rad/s an axis;
 * the first one on the world or in the air. */
enum { TREE = 6 };

static sadmm_world *random_tree(int solver, uint64_t seed, double dt, bool floats, double gravity,
                                double fast)
{
    sadmm_world *world = new_world(solver, dt, gravity);
    sadmm_body_id body[TREE];
    vec3 center[TREE], spin[TREE], linear[TREE];
    for (int k = 0; k < TREE; ++k) {
        const int from = k == 0 ? -1 : (int)((random_number(&seed) + 1) / 2 * k);
        const vec3 arm = v3(0.2 * random_number(&seed), 0.2 * random_number(&seed), 0.2 * random_number(&seed));
        const quat q = random_turn(&seed);
        vec3 other = v3(0, 0, 0), point = v3(0, 0, 0), speed = v3(0, 0, 0), axis;
        double moments[3], position[3], velocity[6];
        random_moments(&seed, 0.01, moments);
        if (from >= 0) {
            other = v3(0.2 * random_number(&seed), 0.2 * random_number(&seed), 0.2 * random_number(&seed));
            point = v3_add(center[from], other);
            speed = v3_add(linear[from], v3_cross(spin[from], other));
        }
        const quat frame = random_turn(&seed);
        axis = m3_mul(q_matrix(frame), v3(0, 0, 1));
        const bool hinge = k % 2 == 1;
        spin[k] = hinge ? v3_madd(spin[from], fast * random_number(&seed), axis)
                        : v3(fast * random_number(&seed), fast * random_number(&seed), fast * random_number(&seed));
        center[k] = v3_sub(point, arm);
        linear[k] = v3_sub(speed, v3_cross(spin[k], arm));
        v3_store(center[k], position);
        v3_store(linear[k], velocity);
        v3_store(spin[k], velocity + 3);
        body[k] = add_body(world, 1 + 0.5 * random_number(&seed), moments, position, q, velocity);
        if (from < 0 && floats) continue;
        add_joint(world, hinge ? SADMM_JOINT_REVOLUTE : SADMM_JOINT_SPHERICAL,
                  from >= 0 ? body[from] : (sadmm_body_id){0, 0}, body[k], point, frame);
    }
    return world;
}

/* Root of the mean square way between bodies of two worlds. */
static double apart(sadmm_world *a, sadmm_world *b)
{
    sadmm_body_state *x = all_states(a), *y = all_states(b);
    double sum = 0;
    for (int k = 0; k < TREE; ++k)
        for (int j = 0; j < 3; ++j)
            sum += (x[k].position[j] - y[k].position[j]) * (x[k].position[j] - y[k].position[j]);
    free(x);
    free(y);
    return sqrt(sum / TREE);
}

START_TEST(trees_are_of_second_order)
{
    const bool floats = _i % 2;
    const double time = 0.5, shortest = 0.00025;
    double off[2];
    sadmm_world *fine = random_tree(0, 1 + (uint64_t)_i, shortest, floats, G, 3);
    step_world(fine, (int)lround(time / shortest));
    for (int h = 0; h < 2; ++h) {
        const double dt = h ? 0.00125 : 0.005;
        sadmm_world *world = random_tree(0, 1 + (uint64_t)_i, dt, floats, G, 3);
        step_world(world, (int)lround(time / dt));
        off[h] = apart(world, fine);
        sadmm_world_destroy(world);
    }
    ck_assert_msg(off[1] < 1e-4 && off[0] > 10 * off[1], "%g %g m", off[0], off[1]); /* as above */
    sadmm_world_destroy(fine);
}
END_TEST

/* Momentum to rounding, in space, whatever solves; energy to what the step's length leaves, of third order a step.
 * Those that turn by more than a step resolves (core/model/joint_law.h) lose energy, and never have more than at the
 * start. */
START_TEST(floating_trees_keep_momentum)
{
    const double rounding = solvers[_i].precision == SADMM_F64 ? 1e-12 : 1e-6;
    for (int k = 0; k < fewer(4); ++k) {
        const bool fast = k % 2;
        sadmm_world *world = random_tree(_i, 1 + (uint64_t)k, 0.005, true, 0, fast ? 30 : 3);
        const struct totals before = totals_of(world, 0);
        step_world(world, 600);
        const struct totals after = totals_of(world, 0);
        const double linear = off(after.linear, before.linear) / v3_norm(before.linear),
                     angular = off(after.angular, before.angular) / v3_norm(before.angular),
                     energy = after.energy / before.energy;
        ck_assert_msg(linear < rounding && angular < rounding, "%g %g", linear, angular);
        ck_assert_msg(energy < (fast ? 1 + rounding : 1.001) && energy > (fast ? 0.1 : 0.999), "%g of the energy",
                      energy);
        sadmm_world_destroy(world);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("spatial");
    TCase *cases = tcase_create("spatial");
    tcase_set_timeout(cases, 60);
    suite_add_tcase(suite, cases);
    tcase_add_test(cases, turns_can_be_taken_back);
    tcase_add_test(cases, any_spin_is_finite);
    tcase_add_loop_test(cases, free_bodies_keep_angular_momentum, 0, SOLVERS);
    tcase_add_test(cases, spins_about_principal_axes_are_exact);
    tcase_add_loop_test(cases, torques_add_to_angular_momentum, 0, SOLVERS);
    tcase_add_loop_test(cases, steady_motions_on_joints, 0, MOTIONS * SOLVERS);
    tcase_add_loop_test(cases, a_damped_spring_whirls, 0, 10);
    tcase_add_loop_test(cases, trees_are_of_second_order, 0, 4);
    tcase_add_loop_test(cases, floating_trees_keep_momentum, 0, SOLVERS);
    return run_suite(suite);
}
