/* What overlaps is pushed apart by moving bodies: no speed is left of it, in flight, on the ground or in a lift, and
 * overlaps vanish at the rate that the settings ask for. */
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/math/contact.h"
#include "core/math/rigid.h"
#include "body_worlds.h"
#include "fewer.h"

static const double steps_of[] = {0.0005, 0.002, 0.01};
static const double depths[] = {0.0005, 0.005, 0.1};
enum { STEPS = sizeof steps_of / sizeof *steps_of, DEPTHS = sizeof depths / sizeof *depths };
static const double share = 0.2, cap = 1, slop = 1e-5; /* the settings' own */

static sadmm_world_def world_def(double dt, sadmm_method method)
{
    sadmm_world_def def = bodies_def();
    def.settings.dt = dt;
    def.settings.method = method;
    def.settings.iterations = method == SADMM_METHOD_FAST ? 20 : 100;
    return def;
}

/* Of half the size `half`, with a ball's or a cube's moments. */
static sadmm_body_id add_solid(sadmm_world *world, sadmm_shape_type type, double half, double mass, double x, double y,
                               double z)
{
    const double halves[3] = {half, half, half};
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_def def = sadmm_body_def_default();
    def.mass = mass;
    def.position[0] = x, def.position[1] = y, def.position[2] = z;
    shape.type = type;
    for (int k = 0; k < 3; ++k) shape.size[k] = half;
    if (type == SADMM_SHAPE_BOX) sadmm_box_inertia(mass, halves, def.inertia);
    else if (type == SADMM_SHAPE_CAPSULE) sadmm_capsule_inertia(mass, half, half, def.inertia);
    else sadmm_sphere_inertia(mass, half, def.inertia);
    const sadmm_body_id id = add_defined(world, &def);
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* What is left of an overlap after so many steps, if a step takes a share of it, and no more than its speed allows. */
static double left_after(double depth, int steps, double dt)
{
    double beyond = depth - slop;
    for (int k = 0; k < steps; ++k) beyond -= fmin(share * beyond, cap * dt);
    return slop + beyond;
}

/* Steps until 0.1 um is left beyond the slop: of exponential decay, after what goes by the largest speed. */
static int steps_until_apart(double depth, double dt)
{
    int steps = 1;
    while (left_after(depth, steps, dt) > slop + 1e-7) ++steps;
    return steps;
}

/* ---- in the air -------------------------------------------------------------------------------------------------- */

struct two {
    sadmm_world *world;
    sadmm_body_id id[2];
    double mass[2];
};

static const sadmm_shape_type forms[] = {SADMM_SHAPE_SPHERE, SADMM_SHAPE_BOX, SADMM_SHAPE_CAPSULE};
enum { FORMS = sizeof forms / sizeof *forms };

/* Side by side, a little off the line of their centres, so that what parts them turns them. */
static struct two overlapping(int solver, const sadmm_world_def *def, sadmm_shape_type type, double depth)
{
    struct two t = {bodies_world(def, solver), {{0, 0}, {0, 0}}, {8, 1}};
    const double half = 0.1, off = type == SADMM_SHAPE_BOX ? 0.03 : 0;
    t.id[0] = add_solid(t.world, type, half, t.mass[0], 0, 0, 0);
    t.id[1] = add_solid(t.world, type, half, t.mass[1], 2 * half - depth, off, 2 * off);
    return t;
}

/* Speeds at no time but by rounding: the problem of a step has none of its push in it. */
static void expect_still(const struct two *t, double tolerance)
{
    for (int s = 0; s < 2; ++s) {
        const sadmm_body_state state = body_state(t->world, t->id[s]);
        expect_near(norm3(state.linear_velocity), 0, tolerance, "speed");
        expect_near(norm3(state.angular_velocity), 0, tolerance, "spin");
    }
}

static void centre_of(const struct two *t, double centre[3])
{
    for (int k = 0; k < 3; ++k) {
        centre[k] = 0;
        for (int s = 0; s < 2; ++s)
            centre[k] += t->mass[s] * body_state(t->world, t->id[s]).position[k] / (t->mass[0] + t->mass[1]);
    }
}

static void part(int solver, sadmm_method method, int form, double depth, double dt)
{
    sadmm_world_def def = world_def(dt, method);
    memset(def.settings.gravity, 0, sizeof def.settings.gravity);
    struct two t = overlapping(solver, &def, forms[form], depth);
    const int steps = steps_until_apart(depth, dt);
    double before[3], after[3];
    centre_of(&t, before);
    for (int k = 0; k < steps; ++k) {
        step_world(t.world, 1);
        expect_still(&t, 1e-12); /* exact where nothing moves: the solve's start is its solution */
    }
    step_world(t.world, 1);
    /* One point: exactly. What turns may need more steps: no rate is promised, but half of the overlap has gone. */
    const double left = world_report(t.world).penetration_max, wanted = slop + 1e-7;
    if (forms[form] == SADMM_SHAPE_BOX) ck_assert_msg(left < fmax(wanted, depth / 2), "%g m left", left);
    else expect_near(left, fmin(wanted, left_after(depth, steps, dt)), 3e-8, "overlap");
    centre_of(&t, after); /* momentum is restored to 1e-6 of the push in single precision, of 0.1 m in all */
    expect_near(distance(before, after), 0, epsilon_of(solver) * 10 + 1e-13, "centre");
    sadmm_world_destroy(t.world);
}

START_TEST(free_bodies_part_with_no_speed)
{
    const sadmm_method method = _i % 2 ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
    for (int form = 0; form < FORMS; ++form)
        for (int d = 0; d < fewer(DEPTHS); ++d)
            for (int k = solvers[_i / 2].backend == SADMM_BACKEND_REF ? 1 : 0; k < STEPS; ++k)
                part(_i / 2, method, form, depths[d], steps_of[k]);
}
END_TEST

/* Two bodies that go round each other and overlap: parted, they go round more slowly. Moved apart at the same
 * velocities they would have gained what the distance is times their speed. */
static void angular_momentum(const struct two *t, double sum[3])
{
    memset(sum, 0, 3 * sizeof *sum);
    for (int s = 0; s < 2; ++s) {
        const sadmm_body_state state = body_state(t->world, t->id[s]);
        const sadmm_body_def def = body_def(t->world, t->id[s]);
        double own[3];
        v3_store(
            rigid_angular_momentum(q_load(state.orientation), v3_load(def.inertia), v3_load(state.angular_velocity)),
            own);
        for (int k = 0; k < 3; ++k) {
            const int u = (k + 1) % 3, w = (k + 2) % 3;
            sum[k] += own[k] + def.mass * (state.position[u] * state.linear_velocity[w] -
                                           state.position[w] * state.linear_velocity[u]);
        }
    }
}

START_TEST(what_turns_keeps_its_angular_momentum)
{
    for (int form = 0; form < FORMS; ++form) {
        const double dt = 0.002, spin = 2;
        sadmm_world_def def = world_def(dt, SADMM_METHOD_FAST);
        memset(def.settings.gravity, 0, sizeof def.settings.gravity);
        struct two t = overlapping(_i, &def, forms[form], 0.02);
        double before[3], after[3], centre[3];
        centre_of(&t, centre);
        for (int s = 0; s < 2; ++s) {
            sadmm_body_state state = body_state(t.world, t.id[s]);
            state.linear_velocity[0] = -spin * (state.position[1] - centre[1]);
            state.linear_velocity[1] = spin * (state.position[0] - centre[0]);
            state.angular_velocity[2] = spin;
            MUST(t.world, sadmm_world_set_body_state(t.world, t.id[s], &state));
        }
        angular_momentum(&t, before);
        for (int k = 0; k < 40; ++k) {
            step_world(t.world, 1);
            angular_momentum(&t, after);
            /* each step rounds velocities: 40 times epsilon of the whole; left out, the turn is 1e-2 of it */
            expect_near(distance(before, after), 0, 100 * epsilon_of(_i) * norm3(before), "angular momentum");
        }
        ck_assert(world_report(t.world).penetration_max < 1e-3);
        sadmm_world_destroy(t.world);
    }
}
END_TEST

/* ---- on something ------------------------------------------------------------------------------------------------ */

static void come_up(int solver, sadmm_method method, double depth, double dt, bool lift)
{
    const double half = 0.11, up = lift ? 0.7 : 0;
    sadmm_world_def def = world_def(dt, method);
    sadmm_world *world = bodies_world(&def, solver);
    sadmm_body_id floor = {0, 0};
    if (lift) {
        sadmm_body_def body = sadmm_body_def_default();
        body.type = SADMM_BODY_KINEMATIC;
        body.position[2] = -1;
        body.linear_velocity[2] = up;
        floor = add_defined(world, &body);
        give_box(world, floor, 2, 2, 1, 0.5);
    } else {
        add_floor(world, 0.5);
    }
    const sadmm_body_id id = add_solid(world, SADMM_SHAPE_BOX, half, 8, 0, 0, half - depth);
    if (lift) {
        sadmm_body_state state = body_state(world, id);
        state.linear_velocity[2] = up;
        MUST(world, sadmm_world_set_body_state(world, id, &state));
    }
    const int steps = steps_until_apart(depth, dt) + 10;
    for (int k = 0; k < steps; ++k) {
        step_world(world, 1);
        const double ground = lift ? body_state(world, floor).position[2] + 1 : 0,
                     below = half + ground - body_state(world, id).position[2];
        /* At the rate of the settings, to 1 % of the overlap, since iterations end; where velocities have it, the
         * trapezoid correction takes back half of what they change by from step to step (math/trapezoid.h), and it may
         * be a little faster. */
        const double left = left_after(depth, k + 1, dt), within = 0.01 * depth + slop;
        ck_assert_msg(below < left + within && below > 0.9 * left_after(depth, k + 2, dt) - within,
                      "%g m deep after %d steps, wanted %g", below, k + 1, left);
        ck_assert_msg(below > 0, "%g m above the ground", -below);
    }
    expect_near(body_state(world, id).linear_velocity[2], up, 1e-4, "speed at rest"); /* 1e-5 m in a step of 0.1 s */
    sadmm_world_destroy(world);
}

START_TEST(what_is_sunk_comes_up_and_does_not_hop)
{
    const sadmm_method method = _i % 2 ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
    for (int d = 0; d < fewer(DEPTHS); ++d)
        for (int k = 0; k < STEPS; ++k) come_up(_i / 2, method, depths[d], steps_of[k], false);
    come_up(_i / 2, method, 0.01, 0.002, true);
    come_up(_i / 2, method, 0.03, 0.01, false); /* solved once by `fast`; `paper` would hop by 8 mm */
}
END_TEST

/* A stack that was built too low. */
START_TEST(a_sunk_stack_stays_a_stack)
{
    const double depth = 0.004;
    sadmm_world_def def = world_def(0.001, SADMM_METHOD_FAST);
    def.settings.iterations = 60;
    sadmm_world *world = bodies_world(&def, _i);
    sadmm_body_id id[4];
    add_floor(world, 0.5);
    for (int k = 0; k < 4; ++k)
        id[k] = add_solid(world, SADMM_SHAPE_BOX, 0.1, 8, 0, 0, 0.1 + k * 0.2 - (k + 1) * depth);
    for (int k = 0; k < 120; ++k) {
        step_world(world, 1);
        for (int i = 0; i < 4; ++i) /* no box is ever above where it belongs */
            ck_assert(body_state(world, id[i]).position[2] < 0.1 + i * 0.2 + slop);
    }
    for (int i = 0; i < 4; ++i) {
        const sadmm_body_state state = body_state(world, id[i]);
        expect_near(state.position[2], 0.1 + i * 0.2, 2 * (i + 1) * slop, "height");
        expect_near(hypot(state.position[0], state.position[1]), 0, 1e-4, "drift"); /* of 0.8 m */
    }
    sadmm_world_destroy(world);
}
END_TEST

/* ---- the rule ---------------------------------------------------------------------------------------------------- */

/* A cube that is sunk by less than gravity takes back is solved once, and has the push as its velocity. */
START_TEST(small_pushes_stay_in_velocities)
{
    const double dt = 0.005, pull = G * dt, most = pull * dt / (share * share); /* d with share^2 d / dt = pull */
    expect_near(contact_push_takes(share * most / dt, share, pull), 1, 1e-12, "just taken back");
    ck_assert(contact_push_takes(1e-9, share, 0) == INFINITY);
    for (int large = 0; large < 2; ++large) {
        const double depth = (large ? 1.1 : 0.9) * most + slop, push = share * (depth - slop) / dt;
        sadmm_world_def def = world_def(dt, SADMM_METHOD_FAST);
        sadmm_world *world = bodies_world(&def, _i);
        add_floor(world, 0.5);
        const sadmm_body_id id = add_solid(world, SADMM_SHAPE_BOX, 0.1, 8, 0, 0, 0.1 - depth);
        step_world(world, 1);
        expect_near(body_state(world, id).linear_velocity[2], large ? 0 : push, 0.01 * push,
                    "velocity"); /* iterations */
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Ice takes nothing back, and where gravity has no share in a body neither does it. */
START_TEST(what_nothing_takes_back_is_kept_out)
{
    for (int smooth = 0; smooth < 2; ++smooth) {
        sadmm_world_def def = world_def(0.005, SADMM_METHOD_FAST);
        def.settings.iterations = 100; /* the residual of a step stays on ice, 1e-4 m/s with 20 */
        sadmm_world *world = bodies_world(&def, _i);
        add_floor(world, smooth ? 0 : 0.5);
        sadmm_body_id id[2];
        for (int s = 0; s < 2; ++s) {
            id[s] = add_solid(world, SADMM_SHAPE_BOX, 0.1, 8, s * (0.2 - 0.001), 0, 0.1);
            if (!smooth) MUST(world, sadmm_world_set_body_gravity_scale(world, id[s], 0));
        }
        step_world(world, 200);
        for (int s = 0; s < 2; ++s) expect_near(top_speed(world), 0, 1e-6, "speed"); /* single precision, of 1 m/s */
        ck_assert(world_report(world).penetration_max < 2 * slop);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* What is reported of a step is its velocities' problem. */
START_TEST(the_certificate_is_of_the_step)
{
    sadmm_world_def def = world_def(0.002, SADMM_METHOD_FAST);
    def.settings.iterations = 200;
    sadmm_world *world = bodies_world(&def, _i);
    add_floor(world, 0.5);
    const sadmm_body_id id = add_solid(world, SADMM_SHAPE_BOX, 0.1, 8, 0, 0, 0.1 - 0.02);
    const sadmm_certificate certificate = certified_step(world);
    ck_assert_msg(certificate.ncp_max < 1e-6, "natural map %g m/s", certificate.ncp_max); /* of a push of 1 m/s */
    ck_assert(certificate.momentum_max < 1e-5);
    double wrench[6];
    MUST(world, sadmm_world_body_contact_wrench(world, id, wrench));
    expect_near(wrench[2], 8 * G, 1e-3 * 8 * G, "the weight, not the push"); /* a push of 1 m/s in 2 ms: 4000 N */
    sadmm_world_destroy(world);
}
END_TEST

/* ---- the machinery ----------------------------------------------------------------------------------------------- */

/* Two heaps, some pairs in the air and what rests: islands of all kinds, some pushed and some not. */
static sadmm_world *mixture(int solver, int threads)
{
    sadmm_world_def def = world_def(0.002, SADMM_METHOD_FAST);
    def.settings.threads = threads;
    sadmm_world *world = bodies_world(&def, solver);
    add_floor(world, 0.5);
    for (int k = 0; k < 8; ++k)
        for (int i = 0; i < 3; ++i)
            add_solid(world, forms[(i + k) % FORMS], 0.1, 1 + i, k, 0.01 * i, (k % 2 ? 1 : 0.11) + 0.19 * i);
    return world;
}

START_TEST(threads_do_not_matter)
{
    uint64_t hash[4];
    sadmm_test_force_threads(true);
    for (int threads = 1; threads <= 4; ++threads) {
        sadmm_world *world = mixture(_i, threads);
        step_world(world, 10);
        hash[threads - 1] = state_hash(world);
        sadmm_world_destroy(world);
    }
    sadmm_test_force_threads(false);
    for (int k = 1; k < 4; ++k) ck_assert_uint_eq(hash[k], hash[0]);
}
END_TEST

START_TEST(memory_may_run_out)
{
    sadmm_world *well = mixture(_i, 1);
    step_world(well, 1);
    int failures = 0;
    for (long n = 0;; ++n) {
        sadmm_world *world = mixture(_i, 1);
        const uint64_t before = state_hash(world);
        sadmm_test_fail_allocations_after(n);
        const sadmm_status status = sadmm_world_step(world);
        sadmm_test_fail_allocations_after(-1);
        if (status != SADMM_OK) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert_uint_eq(state_hash(world), before);
            step_world(world, 1);
            ++failures;
        }
        ck_assert_uint_eq(state_hash(world), state_hash(well));
        sadmm_world_destroy(world);
        if (status == SADMM_OK) break;
    }
    ck_assert(failures > 20);
    sadmm_world_destroy(well);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("push");
    TCase *cases = tcase_create("push");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, free_bodies_part_with_no_speed, 0, 2 * SOLVERS);
    tcase_add_loop_test(cases, what_turns_keeps_its_angular_momentum, 0, SOLVERS);
    tcase_add_loop_test(cases, what_is_sunk_comes_up_and_does_not_hop, 0, 2 * SOLVERS);
    tcase_add_loop_test(cases, a_sunk_stack_stays_a_stack, 0, SOLVERS);
    tcase_add_loop_test(cases, small_pushes_stay_in_velocities, 0, SOLVERS);
    tcase_add_loop_test(cases, what_nothing_takes_back_is_kept_out, 0, SOLVERS);
    tcase_add_loop_test(cases, the_certificate_is_of_the_step, 0, SOLVERS);
    tcase_add_loop_test(cases, threads_do_not_matter, 0, SOLVERS);
    tcase_add_loop_test(cases, memory_may_run_out, 0, SOLVERS);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
