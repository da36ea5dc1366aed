/* Motions with a known answer, by both methods, in double and in single precision: on every CPU backend here, on CUDA
 * in test_cuda_analytic.c (ANALYTIC_ON_CUDA), which includes this file.
 *
 * Under a constant acceleration velocities and positions are exact (core/math/trapezoid.h): only rounding and the
 * solver's error remain. What happens within a step (a stop, a landing) is known to the length of the step.
 *
 * One file: the tests share `solvers` and their worlds, and test_cuda_analytic.c includes them as a whole.
 */
#include <float.h>

#ifdef ANALYTIC_ON_CUDA
#include "cuda_worlds.h"
#else
#include "run_suite.h"
enum { EMULATED = 0 };
#endif
#include "fixed_work.h"
#include "scene_tools.h"
#include "scenes/place.h"

static const struct {
    sadmm_backend backend;
    sadmm_method method;
    sadmm_precision precision;
} solvers[] = {
#ifdef ANALYTIC_ON_CUDA
    { SADMM_BACKEND_CUDA, SADMM_METHOD_FAST, SADMM_F32 },  { SADMM_BACKEND_CUDA, SADMM_METHOD_FAST, SADMM_F64 },
    { SADMM_BACKEND_CUDA, SADMM_METHOD_PAPER, SADMM_F32 }, { SADMM_BACKEND_CUDA, SADMM_METHOD_PAPER, SADMM_F64 },
#else
    { SADMM_BACKEND_CPU, SADMM_METHOD_FAST, SADMM_F64 },  { SADMM_BACKEND_REF, SADMM_METHOD_FAST, SADMM_F64 },
    { SADMM_BACKEND_CPU, SADMM_METHOD_PAPER, SADMM_F64 }, { SADMM_BACKEND_REF, SADMM_METHOD_PAPER, SADMM_F64 },
    { SADMM_BACKEND_CPU, SADMM_METHOD_FAST, SADMM_F32 },  { SADMM_BACKEND_CPU, SADMM_METHOD_PAPER, SADMM_F32 },
#endif
};
enum { SOLVERS = sizeof solvers / sizeof solvers[0] };

/* Unit roundoff of velocities and impulses; poses are double in both. */
static double epsilon_of(int solver)
{
    return (solvers[solver].precision == SADMM_F32 ? FLT_EPSILON : DBL_EPSILON) / 2;
}

/* What rounding leaves of a step's velocities of about `scale`: an iteration brings two states nearer by 0.963 (a
 * sliding block, the slowest here; SLIDING_ITERATIONS) and rounds, which adds up to 1 / (1 - 0.963) roundings. */
static double rounding_of(int solver, double scale) { return epsilon_of(solver) / (1 - 0.963) * scale; }

/* The world of a solver: as `def`, or by the device's kernels. */
static sadmm_world *solver_world(int solver, const sadmm_world_def *def)
{
#ifdef ANALYTIC_ON_CUDA
    sadmm_world_def host = *def;
    host.backend = SADMM_BACKEND_CPU;
    sadmm_world *world = create_world(&host);
    use_device(world, solvers[solver].precision, 0);
    return world;
#else
    (void)solver;
    return create_world(def);
#endif
}

/* A scene by a solver. */
static sadmm_world *solver_scene(int solver, struct sadmm_scene *scene)
{
    scene->def.precision = solvers[solver].precision;
    scene->def.settings.threads = 1;
    sadmm_scene_set_method(scene, solvers[solver].method);
#ifdef ANALYTIC_ON_CUDA
    scene->def.backend = SADMM_BACKEND_CPU;
    sadmm_world *world = build_scene(scene);
    use_device(world, solvers[solver].precision, 0);
    return world;
#else
    scene->def.backend = solvers[solver].backend;
    return build_scene(scene);
#endif
}

static const double g = 9.81;
static const double degree = 0.017453292519943295;

/* `iterations` are the paper's; a fifth of them is enough for fast, to the same tolerances. */
static sadmm_world_def world_def(int solver, double dt, int iterations)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.method = solvers[solver].method;
    def.settings.dt = dt;
    def.settings.iterations = solvers[solver].method == SADMM_METHOD_PAPER ? iterations : (iterations + 4) / 5;
    def.settings.threads = 1; /* a body or two */
    return def;
}

static void no_gravity(sadmm_world_def *def)
{
    memset(def->settings.gravity, 0, sizeof def->settings.gravity);
}

static sadmm_body_id add_cube(sadmm_world *world, struct sadmm_frame frame, double half, double friction)
{
    const struct sadmm_piece piece = { .half_extents = { half, half, half }, .mass = 1.0, .friction = friction };
    sadmm_body_id id;
    struct sadmm_error error = { 0 };
    ck_assert_msg(sadmm_place_box(world, frame, &piece, &id, &error) == SADMM_OK, "%s", error.message);
    return id;
}

static sadmm_body_id add_sphere(sadmm_world *world, struct sadmm_frame frame, double mass, double restitution)
{
    const struct sadmm_piece piece = {.half_extents = {0.1}, .mass = mass, .friction = 0.5, .restitution = restitution};
    sadmm_body_id id;
    struct sadmm_error error = { 0 };
    ck_assert_msg(sadmm_place_sphere(world, frame, &piece, &id, &error) == SADMM_OK, "%s", error.message);
    return id;
}

static void add_plane(sadmm_world *world, struct sadmm_frame frame, double friction)
{
    struct sadmm_error error = { 0 };
    ck_assert_msg(sadmm_place_plane(world, frame, friction, &error) == SADMM_OK, "%s", error.message);
}

static void set_velocity(sadmm_world *world, sadmm_body_id id, const double linear[3], const double angular[3])
{
    sadmm_body_state state = body_state(world, id);
    memcpy(state.linear_velocity, linear, sizeof state.linear_velocity);
    memcpy(state.angular_velocity, angular, sizeof state.angular_velocity);
    MUST(world, sadmm_world_set_body_state(world, id, &state));
}

/* ---- a block on a slope: the critical angle is tan alpha = mu ---- */

/* heading: of the downhill direction about the vertical; turn: of the block on the slope. With both, no axis of the
 * block, of the contact frame or of the world lies along the motion. */
static const struct {
    double heading, turn;
} slopes[] = { { 0, 0 }, { 30, 0 }, { 0, 30 }, { 30, 30 } };
enum { SLOPES = sizeof slopes / sizeof slopes[0] };

/* A sliding contact's impulse sits on the cone and no longer answers to the velocity, so the velocity follows the
 * momentum balance by (A + beta C)^-1 A alone: for this block (beta = 6.5 kg, 4 contacts) the distance shrinks by 0.963
 * an iteration. 1e-7 of a step's change of speed takes 430 of them. */
enum { SLIDING_ITERATIONS = 500 };

static sadmm_body_id block_on_slope(sadmm_world *world, int slope_index, double alpha, double mu, double downhill[3])
{
    struct sadmm_frame slope = sadmm_frame_turned(sadmm_frame_world(), 2, slopes[slope_index].heading * degree);
    slope = sadmm_frame_turned(slope, 1, alpha);
    add_plane(world, slope, mu);
    struct sadmm_frame along = sadmm_frame_moved(slope, 1, 0, 0);
    for (int i = 0; i < 3; ++i) downhill[i] = along.origin[i];
    struct sadmm_frame place = sadmm_frame_turned(slope, 2, slopes[slope_index].turn * degree);
    return add_cube(world, sadmm_frame_moved(place, 0, 0, 0.1), 0.1, mu);
}

START_TEST(a_block_below_the_critical_angle_does_not_creep)
{
    const double mu = 0.5;
    sadmm_world_def def = world_def(_i / SLOPES, 0.005, 100);
    sadmm_world *world = solver_world(_i / SLOPES, &def);
    double downhill[3];
    sadmm_body_id id = block_on_slope(world, _i % SLOPES, atan(0.99 * mu), mu, downhill);

    step_world(world, 200);
    sadmm_body_state before = body_state(world, id);
    step_world(world, 200);
    sadmm_body_state after = body_state(world, id);
    /* 1e-9 m/s is a millimetre in twelve days; gravity gives 0.05 m/s in one step, and what that is rounded to comes on
     * top. */
    const double creep = 1e-9 + rounding_of(_i / SLOPES, g * 0.005);
    ck_assert_double_lt(distance(before.position, after.position) / (200 * 0.005), creep);
    ck_assert_double_lt(norm3(after.linear_velocity), creep);
    ck_assert_double_lt(norm3(after.angular_velocity), 10 * creep); /* the same at the corners, 0.1 m away */
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(a_block_above_the_critical_angle_slides_as_coulomb_says)
{
    const double mu = 0.5, alpha = atan(1.01 * mu), dt = 0.005;
    const double acceleration = g * (sin(alpha) - mu * cos(alpha));
    sadmm_world_def def = world_def(_i / SLOPES, dt, SLIDING_ITERATIONS);
    sadmm_world *world = solver_world(_i / SLOPES, &def);
    double downhill[3], along = 0, across = 0;
    sadmm_body_id id = block_on_slope(world, _i % SLOPES, alpha, mu, downhill);

    step_world(world, 400);
    sadmm_body_state state = body_state(world, id);
    for (int i = 0; i < 3; ++i) along += state.linear_velocity[i] * downhill[i];
    for (int i = 0; i < 3; ++i) across = fmax(across, fabs(state.linear_velocity[i] - along * downhill[i]));
    /* Coulomb friction of a sliding block is constant: the velocity is exact but for the solver's error and what 400
     * steps round, of gravity's share of a step and of the speed reached. */
    const double speed = 400 * dt * acceleration;
    const double error = 1e-6 * speed + 400 * rounding_of(_i / SLOPES, g * dt + speed);
    ck_assert_double_eq_tol(along, speed, error);
    ck_assert_double_lt(across, error);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- stopping distance v^2 / (2 mu g) ---- */

static double stopping_distance(int solver, double dt, double speed, double mu, double heading)
{
    sadmm_world_def def = world_def(solver, dt, SLIDING_ITERATIONS);
    sadmm_world *world = solver_world(solver, &def);
    add_plane(world, sadmm_frame_world(), mu);
    sadmm_body_id id = add_cube(world, sadmm_frame_moved(sadmm_frame_world(), 0, 0, 0.1), 0.1, mu);
    const double velocity[3] = { speed * cos(heading), speed * sin(heading), 0 }, none[3] = { 0 };
    sadmm_body_state start = body_state(world, id);

    set_velocity(world, id, velocity, none);
    step_world(world, (int)ceil(1.2 * speed / (mu * g) / dt));
    sadmm_body_state state = body_state(world, id);
    ck_assert_double_lt(norm3(state.linear_velocity), 1e-9 + rounding_of(solver, g * dt)); /* it has stopped */
    double moved = distance(state.position, start.position);
    sadmm_world_destroy(world);
    return moved;
}

START_TEST(a_block_stops_where_coulomb_says)
{
    /* mu 0.2: the block neither tips nor lifts an edge */
    const double mu = 0.2, speed = 2.0, exact = speed * speed / (2 * mu * g);

    for (int i = 0; i < 2; ++i) {
        const double dt = i ? 0.0025 : 0.005, lost = mu * g * dt;
        const double n = floor(speed / lost);
        /* the mean of a step's two speeds times dt, summed up; in the last step it is stopped */
        const double discrete = dt * (n * speed - lost * n * (n + 1) / 2) + dt * speed / 2;
        const double moved = stopping_distance(_i, dt, speed, mu, 30 * degree);
        /* n steps, each with a solver error well under 1e-8 m/s, and rounded: what a step adds to the speed moves the
         * block for the rest of the way */
        const double error = 1e-7 + rounding_of(_i, speed) * dt * n * n / 2;
        ck_assert_double_eq_tol(moved, discrete, error);
        /* second order: it is exact but for the last step, in which u < lost is left: (1 - u / lost) u dt / 2 */
        ck_assert_double_eq_tol(moved, exact, lost * dt / 8 + error);
    }
}
END_TEST

/* ---- free flight ---- */

START_TEST(free_fall)
{
    const double dt = 0.005;
    const int n = 200;
    sadmm_world_def def = world_def(_i, dt, 10);
    sadmm_world *world = solver_world(_i, &def);
    sadmm_body_id id = add_cube(world, sadmm_frame_moved(sadmm_frame_world(), 1, 2, 3), 0.1, 0.5);
    const double linear[3] = { 0.5, -0.25, 2 }, angular[3] = { 0, 0, 3 };

    set_velocity(world, id, linear, angular);
    step_world(world, n);
    sadmm_body_state state = body_state(world, id);
    /* Twice 200 roundings of numbers of about 10: of velocities, which over the second of the fall move the body by as
     * much, and of positions. */
    const double rounding = n * 10 * (epsilon_of(_i) + epsilon_of(0));
    ck_assert_double_eq_tol(state.position[0], 1 + 0.5 * n * dt, rounding);
    ck_assert_double_eq_tol(state.position[1], 2 - 0.25 * n * dt, rounding);
    ck_assert_double_eq_tol(state.position[2], 3 + 2 * n * dt - g * n * dt * n * dt / 2, rounding);
    ck_assert_double_eq_tol(state.linear_velocity[2], 2 - g * n * dt, rounding);
    /* a cube keeps its spin, and the exponential map adds up turns about one axis without error */
    ck_assert_double_eq_tol(state.angular_velocity[2], 3, rounding);
    ck_assert_double_eq_tol(fabs(state.orientation[0]), fabs(cos(0.5 * 3 * n * dt)), rounding);
    sadmm_world_destroy(world);
}
END_TEST

/* A constant force and torque on a body in the air: x = f t^2 / 2 m, and a turn of tau t^2 / 2 I about one axis. */
START_TEST(constant_force_and_torque)
{
    const double dt = 0.005, force[3] = {0.6, 0, -0.3}, torque[3] = {0, 0.002, 0}, t = 100 * dt;
    sadmm_world_def def = world_def(_i, dt, 10);
    no_gravity(&def);
    sadmm_world *world = solver_world(_i, &def);
    const sadmm_body_id id = add_cube(world, sadmm_frame_world(), 0.1, 0.5);
    MUST(world, sadmm_world_set_body_wrench(world, id, force, torque));
    step_world(world, 100);
    const sadmm_body_state state = body_state(world, id);
    const double rounding = 100 * (epsilon_of(_i) + epsilon_of(0)); /* of numbers below 1 */
    for (int k = 0; k < 3; ++k) ck_assert_double_eq_tol(state.position[k], force[k] * t * t / 2, rounding);
    const double turn = torque[1] * t * t / 2 / body_def(world, id).inertia[1];
    ck_assert_double_eq_tol(state.orientation[2], sin(turn / 2), rounding);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- where contacts end a motion: positions keep to the gap ---------------------------------------------------- */

/* Thrown up at a ceiling, then down on a floor, within a step and with every phase of it: never deeper than the share
 * of the slop that the trapezoid correction may close (math/trapezoid.h) and what single precision rounds a speed of 3
 * m/s by. */
START_TEST(airborne_bodies_do_not_overlap_what_they_hit)
{
    const double dt = 0.005, none[3] = {0};
    for (int phase = 0; phase < 8; ++phase) {
        const double up[3] = {0, 0, 3 + 0.05 * phase};
        sadmm_world_def def = world_def(_i, dt, 100);
        sadmm_world *world = solver_world(_i, &def);
        const struct sadmm_frame ceiling = sadmm_frame_turned(sadmm_frame_moved(sadmm_frame_world(), 0, 0, 0.5), 0,
                                                              180 * degree);
        add_plane(world, sadmm_frame_world(), 0.5);
        add_plane(world, ceiling, 0.5);
        const sadmm_body_id id = add_sphere(world, sadmm_frame_moved(sadmm_frame_world(), 0, 0, 0.2), 1, 0);
        double top = 0, bottom = 1;
        set_velocity(world, id, up, none);
        for (int k = 0; k < 120; ++k) {
            step_world(world, 1);
            const double z = body_state(world, id).position[2];
            top = fmax(top, z), bottom = fmin(bottom, z);
        }
        const double most = 0.1 * def.settings.slop + 1e-8 + rounding_of(_i, 3) * dt;
        ck_assert_double_le(top, 0.4 + most);
        ck_assert_double_ge(top, 0.4 - most); /* it comes there */
        ck_assert_double_ge(bottom, 0.1 - most);
        ck_assert_double_le(body_state(world, id).position[2], 0.1 + most);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Two cubes, one on the other, slide to a stop: the upper one, which touches nothing static, goes as far. */
START_TEST(a_stack_slides_as_one)
{
    const double dt = 0.005, mu = 0.2, speed = 1, forward[3] = {speed, 0, 0}, none[3] = {0};
    const double lost = mu * g * dt, exact = speed * speed / (2 * mu * g);
    sadmm_world_def def = world_def(_i, dt, SLIDING_ITERATIONS);
    sadmm_world *world = solver_world(_i, &def);
    add_plane(world, sadmm_frame_world(), mu);
    sadmm_body_id id[2];
    for (int k = 0; k < 2; ++k) {
        id[k] = add_cube(world, sadmm_frame_moved(sadmm_frame_world(), 0, 0, 0.1 + 0.2 * k), 0.1, k ? 1 : mu);
        set_velocity(world, id[k], forward, none);
    }
    step_world(world, (int)ceil(1.2 * speed / (mu * g) / dt));
    const double x[2] = {body_state(world, id[0]).position[0], body_state(world, id[1]).position[0]};
    /* As in a_block_stops_where_coulomb_says; 2e-5: two bodies take more iterations than one. */
    const double n = floor(speed / lost), error = 2e-5 + rounding_of(_i, speed) * dt * n * n / 2;
    ck_assert_double_eq_tol(x[0], exact, lost * dt / 8 + error);
    ck_assert_double_eq_tol(x[1], x[0], error);
    sadmm_world_destroy(world);
}
END_TEST

/* v in the body frame of q: R^T v. */
static void to_body(const double q[4], const double v[3], double out[3])
{
    const double w = q[0], *u = &q[1];
    const double c[3] = { u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0] };
    const double d = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    for (int i = 0; i < 3; ++i) out[i] = (2 * w * w - 1) * v[i] - 2 * w * c[i] + 2 * d * u[i];
}

#ifndef ANALYTIC_ON_CUDA /* 100,000 steps, and the gyroscopic term is core's */
START_TEST(a_plate_at_a_thousand_rad_s_keeps_energy_and_momentum)
{
    struct sadmm_scene scene = open_scene("spin_plate");
    sadmm_world *world = solver_scene(_i, &scene);
    sadmm_body_id id = body_at(world, 0);
    sadmm_body_def def = body_def(world, id);
    double start[2] = { 0 }, least_turn = 1e9, most_turn = -1e9;

    for (int step = 0; step <= 100000; ++step) {
        if (step % 100 == 0) {
            sadmm_body_state state = body_state(world, id);
            double w[3], energy = 0, momentum = 0;
            to_body(state.orientation, state.angular_velocity, w);
            for (int i = 0; i < 3; ++i) {
                energy += 0.5 * def.inertia[i] * w[i] * w[i];
                momentum += def.inertia[i] * w[i] * def.inertia[i] * w[i];
            }
            momentum = sqrt(momentum);
            if (step == 0) start[0] = energy, start[1] = momentum;
            /* The midpoint rule keeps both exactly; what is left is rounding, some twenty operations a step that add up
             * like a random walk at best and linearly at worst. */
            const double rounding = 1e5 * 20 * epsilon_of(_i);
            ck_assert_double_eq_tol(energy / start[0], 1.0, rounding);
            ck_assert_double_eq_tol(momentum / start[1], 1.0, rounding);
            least_turn = fmin(least_turn, w[1]);
            most_turn = fmax(most_turn, w[1]);
            ck_assert_double_eq_tol(norm3(state.position), 0, 1e-12);
        }
        if (step < 100000) step_world(world, 1);
    }
    /* It did tumble about its unstable middle axis; a solver that drops the gyroscopic term spins on. */
    ck_assert_double_lt(least_turn, -900);
    ck_assert_double_gt(most_turn, 900);
    sadmm_world_destroy(world);
}
END_TEST
#endif

/* A symmetric body (I1 = I2) without torque: its axis turns about the fixed angular momentum L at the rate |L| / I1.
 * Returns the distance of the axis from where it should be after `time`. */
static double precession_error(int solver, double dt, double time)
{
    sadmm_world_def def = world_def(solver, dt, 1);
    sadmm_body_def body = sadmm_body_def_default();
    const double spin[3] = { 2, 0, 10 };
    sadmm_body_id id;

    no_gravity(&def);
    sadmm_world *world = solver_world(solver, &def);
    body.mass = 1;
    body.inertia[0] = body.inertia[1] = 0.01;
    body.inertia[2] = 0.018;
    memcpy(body.angular_velocity, spin, sizeof spin);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    step_world(world, (int)lround(time / dt));
    sadmm_body_state state = body_state(world, id);
    sadmm_world_destroy(world);

    const double inverse[4] = {state.orientation[0], -state.orientation[1], -state.orientation[2],
                               -state.orientation[3]};
    const double z[3] = { 0, 0, 1 };
    double axis[3], expected[3];
    to_body(inverse, z, axis);
    /* L = (0.02, 0, 0.18), constant; turn z about it (Rodrigues) */
    const double length = hypot(0.02, 0.18), u[3] = { 0.02 / length, 0, 0.18 / length };
    const double angle = length / 0.01 * time, c = cos(angle), s = sin(angle), d = u[2];
    expected[0] = u[1] * s + u[0] * d * (1 - c);
    expected[1] = -u[0] * s + u[1] * d * (1 - c);
    expected[2] = c + u[2] * d * (1 - c);
    return distance(axis, expected);
}

START_TEST(a_symmetric_top_precesses_at_the_right_rate)
{
    /* 0.5 s are 1.4 turns of the axis, on a cone of 6 degrees (radius 0.11) */
    const double coarse = precession_error(_i, 1e-3, 0.5), fine = precession_error(_i, 5e-4, 0.5);
    /* second order: half the step, a quarter of the error; 3.6 leaves room for higher terms. Single precision rounds by
     * more than that is, 6e-8 of the spin a step. */
    ck_assert_double_lt(coarse, 1e-4);
    if (epsilon_of(_i) < 1e-10) ck_assert_double_gt(coarse / fine, 3.6);
}
END_TEST

/* ---- collisions ---- */

struct momenta {
    double linear[3], angular[3]; /* about the origin */
    double scale[2];              /* largest single term of each */
};

/* Of bodies whose principal moments are all equal. */
static struct momenta momenta_of(sadmm_world *world)
{
    struct momenta sum = { 0 };
    for (int32_t k = 0; k < sadmm_world_body_count(world); ++k) {
        sadmm_body_def def = body_def(world, body_at(world, k));
        const double *x = def.position, *v = def.linear_velocity;
        for (int i = 0; i < 3; ++i) {
            int j = (i + 1) % 3, l = (i + 2) % 3;
            sum.linear[i] += def.mass * v[i];
            sum.angular[i] += def.mass * (x[j] * v[l] - x[l] * v[j]) + def.inertia[i] * def.angular_velocity[i];
            sum.scale[0] = fmax(sum.scale[0], def.mass * fabs(v[i]));
            sum.scale[1] = fmax(sum.scale[1], fabs(def.mass * x[j] * v[l]));
        }
    }
    return sum;
}

START_TEST(an_isolated_collision_keeps_momentum)
{
    const bool boxes = _i % 2;
    sadmm_world_def def = world_def(_i / 2, 0.005, 2000); /* enough for the solver to reach rounding */
    struct sadmm_frame left = sadmm_frame_world(), right = sadmm_frame_moved(left, 0.4, 0.05, 0.02);
    const double ahead[3] = { 1, 0.1, 0 }, back[3] = { -0.5, 0, 0.1 }, spin[3] = { 1, 2, -1 }, none[3] = { 0 };
    sadmm_body_id a, b;

    no_gravity(&def);
    def.settings.penalty_period = 0; /* a plain fixed-point iteration to the end */
    sadmm_world *world = solver_world(_i / 2, &def);
    if (boxes) {
        a = add_cube(world, sadmm_frame_turned(left, 1, 0.3), 0.1, 0.5);
        b = add_cube(world, sadmm_frame_turned(right, 0, 0.4), 0.08, 0.5);
    } else {
        a = add_sphere(world, left, 1.0, 0.5);
        b = add_sphere(world, right, 3.0, 0.5);
    }
    set_velocity(world, a, ahead, spin);
    set_velocity(world, b, back, none);

    struct momenta before = momenta_of(world);
    double met = 0;
    for (int i = 0; i < 100; ++i) {
        step_world(world, 1);
        for (int32_t k = 0; k < sadmm_world_contact_count(world); ++k) {
            sadmm_contact contact;
            MUST(world, sadmm_world_contacts(world, k, 1, &contact));
            met = fmax(met, norm3(contact.impulse));
        }
    }
    struct momenta after = momenta_of(world);
    ck_assert_double_gt(met, 0.1); /* they did collide */
    for (int i = 0; i < 3; ++i) {
        /* Up to 100 steps in contact. What is rounded in a step's velocities is an error of momentum by beta, 20 times
         * the mass. Contact arms end in one point for both bodies, so that no couple is left over either. */
        const double rounding = 100 * 20 * rounding_of(_i / 2, 1);
        ck_assert_double_eq_tol(after.linear[i], before.linear[i], rounding * before.scale[0]);
        ck_assert_double_eq_tol(after.angular[i], before.angular[i], rounding * (before.scale[0] + before.scale[1]));
    }
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(a_sphere_leaves_the_ground_with_its_restitution)
{
    const double restitution = 0.25 * (_i % 5);
    struct sadmm_scene scene = open_scene("bounce");
    scene.def.settings.hits = 0; /* the solve's bounce: test_hits.c has the one at its moment */
    sadmm_world *world = solver_scene(_i / 5, &scene);
    sadmm_body_id id = body_at(world, 1 + _i % 5); /* after the ground */
    const double fall = sqrt(2 * g * 1.0), dt = scene.def.settings.dt;
    const double rounding = rounding_of(_i / 5, fall);
    double approach = 0, leave = 0, top = 0, start_top = body_state(world, id).position[2];

    for (int i = 0; i < 900; ++i) {
        sadmm_body_state before = body_state(world, id);
        step_world(world, 1);
        sadmm_body_state after = body_state(world, id);
        if (approach == 0 && after.linear_velocity[2] > before.linear_velocity[2]) {
            approach = -before.linear_velocity[2];
            leave = after.linear_velocity[2];
        }
        if (approach > 0) top = fmax(top, after.position[2]);
    }
    /* It lands at the speed of a fall from 1 m, up to one step of gravity and one of being caught before it touches. */
    ck_assert_double_eq_tol(approach, fall, 2 * g * dt);
    if (restitution > 0) {
        /* Newton's law holds for the step's own approach speed; 1e-9: the solver's error. */
        ck_assert_double_eq_tol(leave, restitution * approach, 1e-9 + rounding);
        /* height e^2 h, first order in dt: (v dt) of the landing and (v dt / 2) of the flight */
        ck_assert_double_eq_tol(top - 0.1, restitution * restitution * 1.0, 2 * fall * dt);
    } else {
        /* What is left of the gap is closed in the step, no more: it rests on the ground without a bounce. */
        ck_assert_double_lt(body_state(world, id).position[2], 0.1 + 1e-9 + rounding * dt);
        ck_assert_double_gt(body_state(world, id).position[2], 0.1 - 2e-5); /* slop */
    }
    /* no bounce gains height: v^2 / 2 g, to the first order in what v was rounded by */
    ck_assert_double_le(top, start_top + 1e-9 + fall / g * rounding);
    sadmm_world_destroy(world);
}
END_TEST

/* At 1 m/s and 1.5 steps from the ground there is a contact already, but no bounce: that is the next step's. */
START_TEST(a_sphere_bounces_when_it_touches)
{
    const double dt = 0.005, none[3] = { 0 }, down[3] = { 0, 0, -1 };
    sadmm_world_def def = world_def(_i, dt, 100);
    no_gravity(&def);
    sadmm_world *world = solver_world(_i, &def);
    add_plane(world, sadmm_frame_world(), 0.5);
    sadmm_body_id id = add_sphere(world, sadmm_frame_moved(sadmm_frame_world(), 0, 0, 0.1 + 1.5 * dt), 1, 0.5);
    set_velocity(world, id, down, none);
    step_world(world, 1);
    ck_assert_int_eq(world_report(world).contacts, 1);
    ck_assert_double_eq_tol(body_state(world, id).linear_velocity[2], -1, rounding_of(_i, 1));
    step_world(world, 1);
    /* 1e-9: the solver's error */
    ck_assert_double_eq_tol(body_state(world, id).linear_velocity[2], 0.5, 1e-9 + rounding_of(_i, 1));
    sadmm_world_destroy(world);
}
END_TEST

/* In the ground by more than the slop: out again by Baumgarte's share of that in a step, at the correction speed at
 * most. No velocity is left of it. */
START_TEST(overlaps_are_pushed_out)
{
    static const double depths[] = { 1e-3, 0.05 };
    const double none[3] = { 0, 0, 0 };
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = world_def(_i, 0.005, 100);
        no_gravity(&def);
        def.settings.correction_speed = 0.5;
        sadmm_world *world = solver_world(_i, &def);
        add_plane(world, sadmm_frame_world(), 0.5);
        sadmm_body_id id = add_sphere(world, sadmm_frame_moved(sadmm_frame_world(), 0, 0, 0.1 - depths[k]), 1, 0);
        set_velocity(world, id, none, none);
        step_world(world, 1);
        const double share = def.settings.correction_factor * (depths[k] - def.settings.slop) / def.settings.dt;
        ck_assert(share < 0.5 || k == 1);
        const sadmm_body_state state = body_state(world, id);
        ck_assert_double_eq_tol(state.position[2], 0.1 - depths[k] + def.settings.dt * fmin(share, 0.5),
                                def.settings.dt * (1e-9 + rounding_of(_i, 0.5)));
        ck_assert_double_eq_tol(state.linear_velocity[2], 0, 1e-9 + rounding_of(_i, 0.5));
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Head-on, masses 1 and 3: velocities after follow from momentum and from v_b' - v_a' = -e (v_b - v_a). */
START_TEST(head_on_spheres_part_as_newton_says)
{
    const double e = 0.25 * (_i % 5), ma = 1, mb = 3, va = 2, vb = -1;
    sadmm_world_def def = world_def(_i / 5, 0.001, 2000);
    const double ahead[3] = { va, 0, 0 }, back[3] = { vb, 0, 0 }, none[3] = { 0 };

    no_gravity(&def);
    def.settings.penalty_period = 0;
    sadmm_world *world = solver_world(_i / 5, &def);
    sadmm_body_id a = add_sphere(world, sadmm_frame_world(), ma, e);
    sadmm_body_id b = add_sphere(world, sadmm_frame_moved(sadmm_frame_world(), 0.35, 0, 0), mb, 0);
    set_velocity(world, a, ahead, none);
    set_velocity(world, b, back, none);
    step_world(world, 100);

    /* With e = 0 the first step closes the gap that is left, the next one stops the approach. */
    const double centre = (ma * va + mb * vb) / (ma + mb);
    const double wa = centre + e * mb / (ma + mb) * (vb - va), wb = centre - e * ma / (ma + mb) * (vb - va);
    /* 1e-9: the solver's error after 2000 iterations, with room. Velocities up to 2 m/s are rounded in each of 100
     * steps. */
    const double tolerance = 1e-9 + 100 * 2 * epsilon_of(_i / 5);
    ck_assert_double_eq_tol(body_state(world, a).linear_velocity[0], wa, tolerance);
    ck_assert_double_eq_tol(body_state(world, b).linear_velocity[0], wb, tolerance);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("analytic");
    TCase *slope = tcase_create("slope"), *flight = tcase_create("flight"), *collision = tcase_create("collision");
#ifdef ANALYTIC_ON_CUDA
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
#endif

    /* The emulated device is thousands of times slower than one: there one of each, by fast in single precision. */
    const int end = EMULATED ? 1 : SOLVERS, slope_first = EMULATED ? SLOPES - 1 : 0, bounce_first = EMULATED ? 2 : 0;
    const int slope_end = EMULATED ? SLOPES : SOLVERS * SLOPES, bounce_end = EMULATED ? 3 : 5 * SOLVERS;
    tcase_add_loop_test(slope, a_block_below_the_critical_angle_does_not_creep, slope_first, slope_end);
    tcase_add_loop_test(slope, a_block_above_the_critical_angle_slides_as_coulomb_says, slope_first, slope_end);
    tcase_add_loop_test(slope, a_block_stops_where_coulomb_says, 0, end);
    tcase_add_loop_test(flight, free_fall, 0, end);
    tcase_add_loop_test(flight, constant_force_and_torque, 0, end);
    tcase_add_loop_test(flight, airborne_bodies_do_not_overlap_what_they_hit, 0, end);
    tcase_add_loop_test(flight, a_stack_slides_as_one, 0, end);
#ifndef ANALYTIC_ON_CUDA
    tcase_add_loop_test(flight, a_plate_at_a_thousand_rad_s_keeps_energy_and_momentum, 0, SOLVERS);
#endif
    tcase_add_loop_test(flight, a_symmetric_top_precesses_at_the_right_rate, 0, end);
    tcase_add_loop_test(collision, an_isolated_collision_keeps_momentum, 0, 2 * end);
    tcase_add_loop_test(collision, a_sphere_leaves_the_ground_with_its_restitution, bounce_first, bounce_end);
    tcase_add_loop_test(collision, a_sphere_bounces_when_it_touches, 0, end);
    tcase_add_loop_test(collision, overlaps_are_pushed_out, 0, end);
    tcase_add_loop_test(collision, head_on_spheres_part_as_newton_says, bounce_first, bounce_end);
    tcase_set_timeout(flight, 60);
    tcase_set_timeout(slope, 60);
    tcase_set_timeout(collision, 60);
    suite_add_tcase(suite, slope);
    suite_add_tcase(suite, flight);
    suite_add_tcase(suite, collision);
#ifdef ANALYTIC_ON_CUDA
    return run_cuda_suite(suite);
#else
    return run_suite(suite);
#endif
}
