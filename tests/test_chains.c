/* Chains whose links a step does not resolve: geometric stiffness by the midpoint rule (core/model/stiffening.h),
 * joints closed at the end of a step (core/model/joint_close.h). */
#include "core/math/array3.h"
#include "core/math/rigid.h"
#include "fewer.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "solvers.h"

static const double UNIT[4] = {1, 0, 0, 0};
static const sadmm_body_id WORLD = {0, 0};
static const double GRAVITY = 9.81;

static sadmm_world *new_world(int solver, double dt)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.method = solvers[solver].method;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.gravity[2] = -GRAVITY;
    return create_world(&def);
}

/* A body of `mass` with moments `across`, but `along` about its z axis, that is turned by `angle` about y. */
static sadmm_body_id add_body(sadmm_world *world, double mass, double across, double along, const double position[3],
                              double angle)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = mass;
    def.inertia[0] = def.inertia[1] = across;
    def.inertia[2] = along;
    memcpy(def.position, position, sizeof def.position);
    def.orientation[0] = cos(angle / 2);
    def.orientation[2] = sin(angle / 2);
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static void join(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, const double place[3])
{
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_SPHERICAL;
    def.body_a = a;
    def.body_b = b;
    MUST(world, sadmm_world_place_joint(world, &def, place, UNIT));
    MUST(world, sadmm_world_add_joint(world, &def, NULL));
}

/* ---- under load -------------------------------------------------------------------------------------------------- */

/* Two links (1 kg, 0.2 m) and a block hang straight down; their joint is kicked sideways by 1 mm/s. It vibrates by
 * v/omega, omega^2 = 3 T / (m l) for a tension T. An explicit rule is stable up to omega dt = 2: the block is that many
 * times as heavy as it may be then. With twice the stiffness that this takes (STIFFENING_ROOM) it swings further, to
 * the root of (v/omega)^2 + (v dt/2)^2. */
START_TEST(links_under_any_load_vibrate)
{
    static const double times[] = {0.5, 0.9, 1.1, 3, 10, 1000}, steps[] = {0.001, 0.005, 1. / 60};
    const double length = 0.2, kick = 1e-3, dt = steps[_i / SOLVERS % 3];
    for (int k = 0; k < 6; ++k) {
        const double mass = times[k] * 4 * length / (3 * dt * dt) / GRAVITY, tension = (mass + 1.5) * GRAVITY,
                     swing = hypot(kick / sqrt(3 * tension / length), kick * dt / 2);
        sadmm_world *world = new_world(_i % SOLVERS, dt);
        sadmm_body_id last = WORLD, first = WORLD;
        double most = 0, drift = 0;
        for (int i = 0; i < 3; ++i) {
            const double z = i < 2 ? -(i + 0.5) * length : -2 * length - 0.1, top[3] = {0, 0, -i * length},
                         at[3] = {0, 0, z}, m = i < 2 ? 1 : mass, I = i < 2 ? length * length / 12 : 0.01 * mass;
            const sadmm_body_id body = add_body(world, m, I, i < 2 ? I / 10 : I, at, 0);
            if (i < 2) {
                sadmm_body_state state = body_state(world, body);
                state.linear_velocity[0] = kick / 2;
                state.angular_velocity[1] = (i ? 1 : -1) * kick / length;
                MUST(world, sadmm_world_set_body_state(world, body, &state));
            }
            join(world, last, body, top);
            if (i == 0) first = body;
            last = body;
        }
        for (int step = 0; step < fewer(200); ++step) {
            step_world(world, 1);
            most = fmax(most, 2 * fabs(body_state(world, first).position[0]));
            drift = fmax(drift, world_report(world).joint_drift);
        }
        /* the rule gives omega a dt of its own, on either side by some 20 % where it is near 2; and samples miss the
         * largest swing. Single precision keeps 1e-6 of the step's 10 dt m/s of gravity besides */
        const double rounding = solvers[_i % SOLVERS].precision == SADMM_F32 ? 1e-6 * GRAVITY * dt * dt * 200 : 0;
        ck_assert_msg(most < 1.3 * swing + rounding, "%g times, dt %g: %g m of %g", times[k], dt, most, swing);
        ck_assert_msg(rounding > 0 || most > 0.5 * swing, "%g times, dt %g: %g m of %g", times[k], dt, most, swing);
        ck_assert_double_lt(drift, 1e-5 * length);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* A load swings from a radian beside the vertical on 20 links of 1 g, 0.05 m, whose transverse waves take a hundredth
 * of a step. T = 4 sqrt(l/g) K(sin(1/2)) for a pendulum from there. */
START_TEST(loads_swing_on_light_links)
{
    static const double loads[] = {10, 1000}, steps[] = {0.005, 1. / 60};
    const double load = loads[_i / SOLVERS % 2], dt = steps[_i / SOLVERS / 2], pitch = 0.05, from = 1,
                 across = 0.001 * pitch * pitch / 12, length = 19.5 * pitch,
                 period = 2 * acos(-1.) * sqrt(length / GRAVITY) * 1.0663;
    const int links = 20;
    sadmm_world *world = new_world(_i % SOLVERS, dt);
    sadmm_body_id last = WORLD;
    for (int k = 0; k < links; ++k) {
        const bool end = k + 1 == links;
        const double top[3] = {k * pitch * sin(from), 0, -k * pitch * cos(from)},
                     at[3] = {(k + 0.5) * pitch * sin(from), 0, -(k + 0.5) * pitch * cos(from)};
        const sadmm_body_id body =
            add_body(world, end ? load : 0.001, end ? 1e-4 * load : across, end ? 1e-4 * load : across / 10, at, -from);
        join(world, last, body, top);
        last = body;
    }
    double before = 1, first = 0, way = 0;
    int crossings = 0;
    const double start = body_state(world, last).position[2];
    for (int step = 1; step * dt < 5; ++step) {
        step_world(world, 1);
        const sadmm_body_state s = body_state(world, last);
        const double speed = sqrt(dot3(s.linear_velocity, s.linear_velocity));
        ck_assert_msg(world_report(world).joint_drift < 0.01 * pitch, "%g kg, dt %g, step %d: off by %g m", load, dt,
                      step, world_report(world).joint_drift);
        way = fmax(way, speed * speed / 2 + GRAVITY * (s.position[2] - start));
        if ((s.position[0] < 0) == (before < 0)) {
            before = s.position[0];
            continue;
        }
        const double when = (step - s.position[0] / (s.position[0] - before)) * dt;
        if (crossings++ == 0) first = when;
        else ck_assert_msg(fabs((when - first) / (crossings - 1) / (period / 2) - 1) < 0.01, "%g kg, dt %g: %g s of %g",
                           load, dt, 2 * (when - first) / (crossings - 1), period);
        before = s.position[0];
    }
    ck_assert_int_ge(crossings, 4);
    ck_assert_msg(way < 0.005 * GRAVITY * length, "%g kg, dt %g: %g m too high", load, dt, way / GRAVITY);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- let go ------------------------------------------------------------------------------------------------------ */

enum { MOST_LINKS = 60 };
struct rope {
    sadmm_body_id link[MOST_LINKS];
    int links;
    double mass, across, along, length, weight;
};

static double energy_of(sadmm_world *world, const struct rope *rope)
{
    double energy = 0;
    for (int i = 0; i < rope->links; ++i) {
        const sadmm_body_state s = body_state(world, rope->link[i]);
        const double *q = s.orientation, *w = s.angular_velocity,
                     axis[3] = {2 * (q[1] * q[3] + q[0] * q[2]), 2 * (q[2] * q[3] - q[0] * q[1]),
                                q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]},
                     spin = w[0] * axis[0] + w[1] * axis[1] + w[2] * axis[2],
                     mass = i + 1 < rope->links ? rope->mass : rope->weight;
        energy += mass * GRAVITY * s.position[2];
        for (int k = 0; k < 3; ++k)
            energy += mass * s.linear_velocity[k] * s.linear_velocity[k] / 2 + rope->across * w[k] * w[k] / 2;
        energy += (rope->along - rope->across) * spin * spin / 2;
    }
    return energy;
}

/* Straight and level, or nearly: the first link is held, so far from the origin. */
static struct rope add_rope(sadmm_world *world, int links, double weight, double far)
{
    struct rope rope = {.links = links, .mass = 0.1, .length = 0.25, .weight = weight};
    sadmm_body_id last = WORLD;
    rope.across = rope.mass * rope.length * rope.length / 12;
    rope.along = rope.across / 30;
    for (int i = 0; i < links; ++i) {
        const double from[3] = {far + rope.length * i, 0, 0}, at[3] = {far + rope.length * (i + 0.5), 0, 0};
        rope.link[i] = add_body(world, i + 1 < links ? rope.mass : weight, rope.across, rope.along, at, acos(-1.) / 2);
        join(world, last, rope.link[i], from);
        last = rope.link[i];
    }
    return rope;
}

/* Ropes of 10 to 60 links fall from the level, at 2 to 17 ms: their ends whip by more than a radian a step. */
START_TEST(ropes_stay_whole)
{
    static const double steps[] = {0.002, 0.005, 0.01, 1. / 60};
    static const int links[] = {10, 20, 40, 60};
    /* of a link; at 5 ms rows turn by nearly what a step resolves: joints open by the order of the step, and are
     * left */
    static const double open[] = {1e-3, 1e-2, 1e-3, 1e-3};
    const double dt = steps[_i % 4];
    const int n = links[_i % 4];
    sadmm_world *world = new_world(_i / 4, dt);
    const struct rope rope = add_rope(world, n, _i / 4 % 2 ? 0.1 : 1, 0);
    const double start = energy_of(world, &rope), fall = rope.mass * GRAVITY * n * n * rope.length / 2,
                 time = 1.3 * sqrt(2 * n * rope.length / GRAVITY); /* until it whips, and some more */
    for (int step = 0; step < (int)(time / dt); ++step) {
        step_world(world, 1);
        const double energy = energy_of(world, &rope), drift = world_report(world).joint_drift;
        ck_assert_msg(energy < start + 0.02 * fall, "%d links, dt %g, step %d: %g J of %g", n, dt, step, energy - start,
                      fall);
        ck_assert_msg(drift < open[_i % 4] * rope.length, "%d links, dt %g, step %d: off by %g m", n, dt, step, drift);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* How far it may be open is a matter of its links, not of where in the world it is held: a link that goes round by a
 * radian a step. */
START_TEST(far_links_stay_where_they_are_held)
{
    const double dt = 1. / 60, spin = 1 / dt;
    sadmm_world *world = new_world(_i, dt);
    const struct rope rope = add_rope(world, 1, 0.1, 1000);
    sadmm_body_state state = body_state(world, rope.link[0]);
    double drift = 0;
    state.angular_velocity[2] = spin;
    state.linear_velocity[1] = spin * rope.length / 2;
    MUST(world, sadmm_world_set_body_state(world, rope.link[0], &state));
    for (int step = 0; step < fewer(40); ++step) {
        step_world(world, 1);
        drift = fmax(drift, world_report(world).joint_drift);
    }
    ck_assert_double_lt(drift, 1e-3 * rope.length);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- where it moves ---------------------------------------------------------------------------------------------- */

/* Where three links under 20 kg, which vibrate at up to some 500 rad/s, are after 0.3 s: x and z of each. */
static void swing(double dt, double out[6])
{
    sadmm_world *world = new_world(0, dt);
    const struct rope rope = add_rope(world, 4, 20, 0);
    for (int step = 0; step < (int)(0.3 / dt + 0.5); ++step) step_world(world, 1);
    for (int i = 0; i < 3; ++i) {
        const sadmm_body_state s = body_state(world, rope.link[i]);
        out[2 * i] = s.position[0], out[2 * i + 1] = s.position[2];
    }
    sadmm_world_destroy(world);
}

/* Second order where steps go from what they resolve to what they do not. */
START_TEST(stiffened_chains_are_of_second_order)
{
    double fine[6], error[3] = {0, 0, 0};
    swing(0.3 / 9600, fine);
    for (int k = 0; k < 3; ++k) {
        double coarse[6];
        swing(0.002 / (1 << k), coarse);
        for (int j = 0; j < 6; ++j) error[k] = fmax(error[k], fabs(coarse[j] - fine[j]));
    }
    /* from omega dt of some 1 to 1/4; a quarter of the step: a sixteenth of the error, or nearly */
    ck_assert_msg(error[0] < 0.01 && error[2] < error[0] / 8, "%g %g %g", error[0], error[1], error[2]);
}
END_TEST

/* ---- momentum ---------------------------------------------------------------------------------------------------- */

/* In the air two blocks of 100 kg go round each other on a rope of light links, which a step does not resolve and which
 * is kicked: about the centre of mass. */
static void spinning(sadmm_world *world, const struct rope *rope, double L[3])
{
    double middle[3] = {0, 0, 0}, mass = 0;
    L[0] = L[1] = L[2] = 0;
    for (int pass = 0; pass < 2; ++pass)
        for (int i = 0; i < rope->links; ++i) {
            const sadmm_body_def b = body_def(world, rope->link[i]);
            const vec3 arm = v3_sub(v3_load(b.position), v3_scale(v3_load(middle), pass ? 1 / mass : 0));
            double turn[3], around[3];
            v3_store(rigid_angular_momentum(q_load(b.orientation), v3_load(b.inertia), v3_load(b.angular_velocity)),
                     turn);
            v3_store(v3_scale(v3_cross(arm, v3_load(b.linear_velocity)), b.mass), around);
            if (pass == 0) mass += b.mass;
            for (int k = 0; k < 3; ++k)
                if (pass) L[k] += turn[k] + around[k];
                else middle[k] += b.mass * b.position[k];
        }
}

START_TEST(ropes_in_the_air_keep_their_momentum)
{
    sadmm_world *world = new_world(_i, 0.01);
    sadmm_settings settings = sadmm_world_settings(world);
    struct rope rope = {.links = 6};
    double before[3], after[3];
    settings.gravity[2] = 0;
    MUST(world, sadmm_world_set_settings(world, &settings));
    for (int i = 0; i < rope.links; ++i) {
        const bool block = i == 0 || i + 1 == rope.links;
        const double mass = block ? 100 : 0.1, I = block ? 1 : 0.1 * 0.04 / 12, at[3] = {0.2 * i - 0.5, 0, 0},
                     place[3] = {0.2 * i - 0.6, 0, 0};
        rope.link[i] = add_body(world, mass, I, block ? 1.2 : I / 20, at, acos(-1.) / 2);
        sadmm_body_state state = body_state(world, rope.link[i]);
        state.linear_velocity[1] = 2 * at[0];
        state.linear_velocity[2] = i == 2 ? 0.05 : 0;
        state.angular_velocity[2] = 2;
        MUST(world, sadmm_world_set_body_state(world, rope.link[i], &state));
        if (i > 0) join(world, rope.link[i - 1], rope.link[i], place);
    }
    spinning(world, &rope, before);
    step_world(world, fewer(400));
    spinning(world, &rope, after);
    /* rounding, which single precision has in each step */
    const double most = (solvers[_i].precision == SADMM_F32 ? 1e-5 : 1e-10) * fabs(before[2]);
    for (int k = 0; k < 3; ++k)
        ck_assert_msg(fabs(after[k] - before[k]) < most, "%d: %g of %g", k, after[k] - before[k], before[2]);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("chains");
    TCase *tests = tcase_create("chains");
    tcase_set_timeout(tests, 120);
    tcase_add_loop_test(tests, links_under_any_load_vibrate, 0, 3 * SOLVERS);
    tcase_add_loop_test(tests, loads_swing_on_light_links, 0, 4 * SOLVERS);
    tcase_add_loop_test(tests, ropes_stay_whole, 0, 4 * SOLVERS);
    tcase_add_loop_test(tests, far_links_stay_where_they_are_held, 0, SOLVERS);
    tcase_add_test(tests, stiffened_chains_are_of_second_order);
    tcase_add_loop_test(tests, ropes_in_the_air_keep_their_momentum, 0, SOLVERS);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
