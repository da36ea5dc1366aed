/* Momentum that no contact may change is kept whatever the iterations: clusters in flight, bodies on ice; anchored
 * islands stay as they are. */
#include <string.h>

#include "core/base/parallel.h"
#include "core/math/energy_limit.h"
#include "fewer.h"
#include "fixed_work.h"
#include "momentum_worlds.h"
#include "runner.h"

static const int budgets[] = {1, 2, 5, 20, 200};
enum { BUDGETS = sizeof budgets / sizeof *budgets };

static sadmm_world *empty_world(sadmm_backend backend, sadmm_precision precision, sadmm_method method, int iterations,
                                bool gravity)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = backend;
    def.precision = precision;
    def.settings.method = method;
    def.settings.iterations = iterations;
    def.settings.threads = 1;
    if (!gravity) memset(def.settings.gravity, 0, sizeof def.settings.gravity);
    return create_world(&def);
}

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
} engines[] = {{SADMM_BACKEND_REF, SADMM_F64}, {SADMM_BACKEND_CPU, SADMM_F64}, {SADMM_BACKEND_CPU, SADMM_F32}};
enum { ENGINES = sizeof engines / sizeof *engines };

/* ---- the formulas ---------------------------------------------------------------------------------------------- */

static struct momentum_sums some_island(void)
{
    static const double places[3][3] = {{0, 0, 0}, {0.2, 0.1, 0}, {-0.1, 0.3, 0.4}};
    struct momentum_sums sums = {{0}, {0}, 0, {0}, {0}, {0}};
    double A[PACKED6] = {0}, v[6], b[6];
    A[0] = A[2] = A[5] = 2, A[9] = 0.01, A[14] = 0.02, A[20] = 0.03, A[13] = 0.001;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 6; ++k) v[k] = 1 + i - 0.3 * k, b[k] = 0.5 * k - i;
        momentum_add_body(&sums, places[i], A, v, b);
    }
    return sums;
}

/* Of a copy: it loses its gram. */
static void find_motions(struct momentum_sums sums, struct momentum_motions *motions)
{
    momentum_find_motions(&sums, motions);
}

/* What a rigid motion gives the point at r. */
static void velocity_at(const double q[6], const double r[3], double v[3])
{
    for (int k = 0; k < 3; ++k) v[k] = q[k];
    add_cross(q + 3, r, 1, v);
}

/* Motions are orthonormal, contacts do not feel them, and there are as many as there should be. */
START_TEST(motions_are_those_that_contacts_do_not_feel)
{
    static const double up[3] = {0, 0, 1}, side[3] = {1, 0, 0};
    static const struct {
        double point[3];
        const double *normal;
        double friction;
        int left; /* with those before */
    } contacts[] = {
        {{0.1, 0, -0.1}, up, 0, 5}, {{0.3, 0, -0.1}, up, 0, 4}, {{0.5, 0, -0.1}, up, 0, 4}, {{0, 0.2, -0.1}, up, 0, 3},
        {{0, 0.7, -0.1}, up, 0, 3}, {{0, 0, 0}, side, 0, 2},    {{0, 1, 0}, side, 0, 1},    {{0.2, 0.2, 0.2}, up, 1, 0},
    };
    struct momentum_sums sums = some_island();
    struct momentum_motions m;
    find_motions(sums, &m);
    ck_assert_int_eq(m.count, 6);
    for (size_t n = 0; n < sizeof contacts / sizeof *contacts; ++n) {
        momentum_add_contact(sums.gram, contacts[n].normal, contacts[n].friction, contacts[n].point);
        find_motions(sums, &m);
        ck_assert_int_eq(m.count, contacts[n].left);
        for (int k = 0; k < m.count; ++k) {
            double y[6], v[3];
            momentum_mul(&sums, m.motion[k], y);
            for (int i = 0; i < m.count; ++i) /* of numbers of about 1 */
                ck_assert_double_eq_tol(dense6_dot(m.motion[i], y), i == k, 1e-13);
            for (size_t i = 0; i <= n; ++i) {
                velocity_at(m.motion[k], contacts[i].point, v);
                ck_assert_double_eq_tol(dot3(v, contacts[i].normal), 0, 1e-13);
            }
        }
    }
}
END_TEST

/* In the air: six motions, orthonormal about any origin, and what is restored is all that is missed; also where the
 * inertia is nearly that of a line, or of a point. */
START_TEST(islands_in_the_air)
{
    static const double sizes[] = {1, 1e-3, 1e-6};
    for (size_t n = 0; n < sizeof sizes / sizeof *sizes; ++n)
        for (int along = 0; along < 2; ++along) {
            const double size = sizes[n], off[3] = {along ? 0 : 3, 0, along ? 1 : -2};
            struct momentum_sums sums = {{0}, {0}, 0, {0}, {0}, {0}};
            struct momentum_motions m;
            double A[PACKED6] = {0}, v[6], b[6], q[6], y[6];
            A[0] = A[2] = A[5] = 2, A[9] = 0.02 * size, A[14] = 0.03 * size, A[20] = 0.04 * size, A[13] = 0.01 * size;
            for (int i = 0; i < 2; ++i) {
                const double place[3] = {i * off[0], i * off[1], i * off[2]};
                for (int k = 0; k < 6; ++k) v[k] = (1 + i - 0.3 * k), b[k] = (k < 3 ? 1 : size) * (0.5 * k - i);
                momentum_add_body(&sums, place, A, v, b);
            }
            find_motions(sums, &m);
            ck_assert_int_eq(m.count, 6);
            for (int k = 0; k < 6; ++k) {
                momentum_mul(&sums, m.motion[k], y);
                /* products of motions along which the inertia is `size`: rounding over that */
                for (int i = 0; i < 6; ++i) ck_assert_double_eq_tol(dense6_dot(m.motion[i], y), i == k, 1e-12 / size);
            }
            momentum_restoring(&m, 1, q);
            momentum_mul(&sums, q, y);
            /* rounding of terms as large as the motion, some ten times over */
            for (int k = 0; k < 6; ++k)
                ck_assert_double_eq_tol(sums.now[k] + y[k], sums.free[k], 1e-14 * (1 + length3(q) + length3(q + 3)));
        }
}
END_TEST

/* One point with friction leaves turns about it, two the turn about their line, a third beside the line none; a line of
 * points leaves its turn. */
START_TEST(points_with_friction_anchor)
{
    static const double up[3] = {0, 0, 1}, points[3][3] = {{0.1, 0, -0.1}, {0.3, 0.1, -0.1}, {0.2, 0.2, -0.1}};
    struct momentum_sums sums = some_island();
    struct momentum_motions m;
    struct arm_sums arms = {0, {0}, {0}}, line = {0, {0}, {0}};
    for (int n = 0; n < 3; ++n) {
        double v[3];
        momentum_add_contact(sums.gram, up, 0.5, points[n]);
        find_motions(sums, &m);
        ck_assert_int_eq(m.count, n == 0 ? 3 : n == 1 ? 1 : 0);
        for (int k = 0; k < m.count; ++k) {
            velocity_at(m.motion[k], points[0], v);
            ck_assert_double_le(length3(v), 1e-13);
        }
        ck_assert(!momentum_is_anchored(0.5, &arms));
        add_arm(&arms, points[n], 1);
    }
    ck_assert(momentum_is_anchored(0.5, &arms));
    ck_assert(!momentum_is_anchored(0, &arms));
    for (int k = 0; k < 4; ++k) {
        const double r[3] = {0.1 * k + 5, 0.2 * k, 1};
        add_arm(&line, r, 1);
    }
    ck_assert(!momentum_is_anchored(0.5, &line));
}
END_TEST

/* What is restored has the free motion's momentum; the rest of the energies is not negative and is orthogonal to it. */
START_TEST(restored_motion_has_the_momentum)
{
    static const double up[3] = {0, 0, 1}, point[3] = {0.1, 0, -0.1};
    struct momentum_sums sums = some_island();
    struct momentum_motions m;
    double q[6], y[6];
    momentum_add_contact(sums.gram, up, 0.5, point);
    find_motions(sums, &m);
    for (int half = 0; half < 2; ++half) {
        const double factor = half ? 0.5 : 1;
        momentum_restoring(&m, factor, q);
        momentum_mul(&sums, q, y);
        for (int k = 0; k < m.count; ++k) {
            double now = 0;
            for (int j = 0; j < 6; ++j) now += m.motion[k][j] * (factor * sums.now[j] + y[j]);
            ck_assert_double_eq_tol(now, m.free[k], 1e-13 * (1 + fabs(m.free[k])));
        }
    }
    const struct momentum_energies e = momentum_energies_of(&m);
    ck_assert_double_ge(e.now * e.free, e.along * e.along); /* Cauchy */
    ck_assert_double_gt(e.free, 0);
}
END_TEST

/* ---- worlds ---------------------------------------------------------------------------------------------------- */

static const struct cluster clusters[] = {
    {SADMM_SHAPE_SPHERE, 2, 0.15, false}, {SADMM_SHAPE_SPHERE, 37, 0.15, true},  {SADMM_SHAPE_BOX, 27, 0.101, true},
    {SADMM_SHAPE_BOX, 20, 0.09, false},   {SADMM_SHAPE_SPHERE, 500, 0.18, true},
};
enum { CLUSTERS = sizeof clusters / sizeof *clusters, SMALL_CLUSTERS = CLUSTERS - 1 };

static void check_cluster(int engine, const struct cluster *cluster, sadmm_method method, int iterations, int steps)
{
    static const double at[3] = {10, -20, 30};
    sadmm_world *world =
        empty_world(engines[engine].backend, engines[engine].precision, method, iterations, cluster->gravity);
    char what[100];
    add_cluster(world, cluster, at);
    snprintf(what, sizeof what, "engine %d, %d bodies, method %d, %d iterations", engine, cluster->bodies, (int)method,
             iterations);
    for (int k = 0; k < steps; ++k) {
        expect_momentum_kept(world, ALL_MOMENTUM, momentum_tolerance(engines[engine].precision), what);
        if (k == 0) ck_assert_int_ge(world_report(world).contacts, cluster->bodies / 2);
    }
    sadmm_world_destroy(world);
}

/* In flight: all of the momentum, in every step. */
START_TEST(clusters_in_flight)
{
    const int engine = _i % ENGINES, budget = _i / ENGINES;
    for (int c = 0; c < SMALL_CLUSTERS; ++c)
        for (int method = 0; method < 2; ++method)
            check_cluster(engine, &clusters[c], (sadmm_method)method, budgets[budget],
                          engines[engine].backend == SADMM_BACKEND_REF && budgets[budget] > 20 ? 2 : 5);
}
END_TEST

/* What was hit moves by the velocity that it ends with, so that its contacts do not roll (core/model/rolling.h). */
START_TEST(clusters_that_bounce)
{
    sadmm_world *world = empty_world(engines[_i].backend, engines[_i].precision, SADMM_METHOD_FAST, 20, false);
    int hits = 0;
    add_bouncing_balls(world);
    for (int k = 0; k < 30; ++k) {
        expect_momentum_kept(world, ALL_MOMENTUM, momentum_tolerance(engines[_i].precision), "balls that bounce");
        hits += sadmm_world_contact_count(world) - world_report(world).contacts;
    }
    ck_assert_int_gt(hits, 100);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(a_large_cluster)
{
    for (int engine = 1; engine < ENGINES; ++engine) /* ref takes long */
        for (int method = 0; method < 2; ++method)
            check_cluster(engine, &clusters[SMALL_CLUSTERS], (sadmm_method)method, budgets[_i], 2);
}
END_TEST

/* On a floor without friction: along it, and turning on it. */
START_TEST(bodies_on_ice)
{
    const int engine = _i % ENGINES, budget = _i / ENGINES;
    for (int method = 0; method < 2; ++method) {
        sadmm_world *world = empty_world(engines[engine].backend, engines[engine].precision, (sadmm_method)method,
                                         budgets[budget], true);
        add_train(world);
        for (int k = 0; k < 10; ++k)
            expect_momentum_kept(world, ON_ICE, momentum_tolerance(engines[engine].precision), "train");
        ck_assert_int_gt(world_report(world).contacts, 15);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Mechanisms that balls run into: whatever the iterations, in flight all of it, in space, too; on ice along the floor
 * and turning on it; on a joint with the world what turns about that. */
START_TEST(mechanisms)
{
    const int engine = _i % ENGINES, budget = _i / ENGINES % BUDGETS, space = _i / ENGINES / BUDGETS;
    for (int k = 0; k < 4 * MECHANISM_PLACES; ++k) {
        const enum mechanism_place place = (enum mechanism_place)(k / 4);
        const int method = k % 2, rough = k / 2 % 2, steps = place >= MECHANISM_ON_ICE ? 120 : 30;
        sadmm_world *world = empty_world(engines[engine].backend, engines[engine].precision, (sadmm_method)method,
                                         budgets[budget], mechanism_has_weight(place));
        char what[80];
        int touched = 0;
        snprintf(what, sizeof what, "place %d, space %d, method %d, friction %d", place, space, method, rough);
        add_mechanism(world, place, space, rough ? 0.5 : 0);
        for (int step = 0; step < steps; ++step) {
            expect_whole_momentum_kept(world, mechanism_keeps(place, space), place == MECHANISM_HANGS,
                                       momentum_tolerance(engines[engine].precision), what);
            touched += world_report(world).contacts > 0;
        }
        ck_assert_int_gt(touched, 0);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Balls in one place in the air: however few the iterations, they fall as one, and come apart. A push is forgotten with
 * its step, and one or two iterations find little of it: these take longer. */
START_TEST(overlapping_balls_fall_and_come_apart)
{
    const struct cluster balls = {.type = SADMM_SHAPE_SPHERE};
    const double rest[6] = {0};
    const int bodies = 20, steps = budgets[_i] < 5 ? 400 : 60;
    sadmm_world *world = empty_world(SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST, budgets[_i], true);
    const sadmm_settings settings = sadmm_world_settings(world);
    uint64_t seed = 3;
    double before = 0, after = 0;
    for (int i = 0; i < bodies; ++i) {
        double at[3];
        for (int k = 0; k < 3; ++k) at[k] = 0.03 * random_number(&seed);
        add_member(world, &balls, at, rest, 1, 0.5);
        before += at[2] / bodies;
    }
    for (int k = 0; k < steps; ++k) expect_momentum_kept(world, ALL_MOMENTUM, 1e-12, "balls");
    for (int i = 0; i < bodies; ++i) after += body_state(world, body_at(world, i)).position[2] / bodies;
    /* exact; positions are rounded in every step */
    ck_assert_double_eq_tol(after - before, settings.gravity[2] * pow(settings.dt * steps, 2) / 2, 1e-12);
    ck_assert_double_lt(world_report(world).penetration_max, 0.01); /* of 0.2 */
    sadmm_world_destroy(world);
}
END_TEST

/* Boxes that fly into each other, none of which overlap: `fast` makes no energy, however few the iterations; but for
 * what pushing them out of each other is worth, 1 %. */
START_TEST(clusters_gain_no_energy)
{
    static const double at[3] = {0, 0, 0};
    const struct cluster boxes = {SADMM_SHAPE_BOX, 64, 0.11, false};
    for (int engine = 0; engine < ENGINES; ++engine) {
        sadmm_world *world =
            empty_world(engines[engine].backend, engines[engine].precision, SADMM_METHOD_FAST, budgets[_i], false);
        double start = 0, least = INFINITY;
        add_cluster(world, &boxes, at);
        for (int k = 0; k < (engines[engine].backend == SADMM_BACKEND_REF ? 4 : 40); ++k) {
            double energy = 0;
            for (int32_t i = 0; i < boxes.bodies; ++i) {
                const sadmm_body_def def = body_def(world, body_at(world, i));
                const sadmm_body_state s = body_state(world, body_at(world, i));
                energy += def.mass * pow(norm3(s.linear_velocity), 2) / 2 +
                          def.inertia[0] * pow(norm3(s.angular_velocity), 2) / 2;
            }
            if (k == 0) start = energy;
            least = fmin(least, energy);
            ck_assert_double_le(energy, 1.01 * start);
            step_world(world, 1);
        }
        if (engines[engine].backend != SADMM_BACKEND_REF) ck_assert_double_lt(least, 0.99 * start); /* they met */
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Islands are shared among threads, and each is worked out by one. */
START_TEST(threads_do_not_show)
{
    uint64_t hash[2];
    sadmm_test_force_threads(true);
    for (int t = 0; t < 2; ++t) {
        sadmm_world *world = empty_world(SADMM_BACKEND_CPU, (sadmm_precision)(_i % 2), (sadmm_method)(_i / 2), 5, true);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.threads = t ? 3 : 1;
        MUST(world, sadmm_world_set_settings(world, &settings));
        add_plane(world, 0.5);
        for (int n = 0; n < 20; ++n) {
            const double at[3] = {2.0 * n, 0, n % 3 ? 3 : 0.2};
            add_cluster(world, &clusters[n % 4], at);
        }
        step_world(world, 10);
        hash[t] = state_hash(world);
        sadmm_world_destroy(world);
    }
    sadmm_test_force_threads(false);
    ck_assert(hash[0] == hash[1]);
}
END_TEST

/* ---- what is anchored ------------------------------------------------------------------------------------------ */

/* v before and after what ends a step's iterations. */
static void end_step(struct runner *r, double *before, double *after, size_t numbers)
{
    int32_t limited;
    CALL(r, r->k->read_solution(r->c, &r->error));
    memcpy(before, r->p->system.velocity, numbers * sizeof *before);
    CALL(r, r->k->limit_energy(r->c, &limited, &r->error));
    ck_assert_int_eq(limited, 0);
    CALL(r, r->k->read_solution(r->c, &r->error));
    memcpy(after, r->p->system.velocity, numbers * sizeof *after);
}

/* A pyramid on a rough floor is left as it is, to the bit, unsolved; on ice it is not. Gravity pulls it aside. */
START_TEST(anchored_islands_are_left_alone)
{
    for (int engine = 0; engine < ENGINES; ++engine)
        for (int rough = 0; rough < 2; ++rough) {
            struct runner r;
            memset(&r, 0, sizeof r);
            r.k = sadmm_kernels_find(engines[engine].backend, engines[engine].precision, &(const char *){NULL});
            r.p = contact_problem_pyramid(4, 0.5);
            for (size_t k = 0; k < r.p->contacts.pair_count && !rough; ++k) {
                struct sadmm_contact_pair *pair = &r.p->contacts.pairs[k];
                if (pair->body_a < 0 || pair->body_b < 0) pair->friction = 0;
            }
            r.settings = fixed_settings();
            r.settings.method = SADMM_METHOD_PAPER;
            r.settings.warm_start = false;
            r.settings.gravity[0] = 3;
            r.plan = sadmm_plan_make(&r.p->system, &r.settings);
            const size_t numbers = 6 * (size_t)r.plan.bodies;
            double *before = malloc(numbers * sizeof *before), *after = malloc(numbers * sizeof *after);
            CALL(&r, r.k->create(0, &r.c, &r.error));
            CALL(&r, r.k->begin(r.c, &r.p->system, &r.plan, &r.settings, &r.error));
            runner_assemble(&r);
            for (int k = 0; k < 3; ++k) {
                CALL(&r, r.k->update_velocity(r.c, &r.error));
                CALL(&r, r.k->update_constraints(r.c, false, &r.error));
            }
            end_step(&r, before, after, numbers);
            ck_assert_msg((memcmp(before, after, numbers * sizeof *before) == 0) == (rough == 1), "engine %d, %s",
                          engine, rough ? "rough" : "ice");
            free(before);
            free(after);
            runner_stop(&r);
        }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("momentum");
    TCase *formulas = tcase_create("formulas"), *worlds = tcase_create("worlds");
    tcase_add_test(formulas, motions_are_those_that_contacts_do_not_feel);
    tcase_add_test(formulas, islands_in_the_air);
    tcase_add_test(formulas, points_with_friction_anchor);
    tcase_add_test(formulas, restored_motion_has_the_momentum);
    tcase_set_timeout(worlds, 120);
    if (!races_are_looked_for()) {
        tcase_add_loop_test(worlds, clusters_in_flight, 0, ENGINES * BUDGETS);
        tcase_add_loop_test(worlds, clusters_that_bounce, 0, ENGINES);
        tcase_add_loop_test(worlds, a_large_cluster, 0, BUDGETS);
        tcase_add_loop_test(worlds, mechanisms, 0, 2 * ENGINES * BUDGETS);
        tcase_add_loop_test(worlds, bodies_on_ice, 0, ENGINES * BUDGETS);
        tcase_add_loop_test(worlds, overlapping_balls_fall_and_come_apart, 0, BUDGETS);
        tcase_add_loop_test(worlds, clusters_gain_no_energy, 0, BUDGETS);
    }
    tcase_add_loop_test(worlds, threads_do_not_show, 0, 4);
    tcase_add_test(worlds, anchored_islands_are_left_alone);
    suite_add_tcase(suite, formulas);
    suite_add_tcase(suite, worlds);
    return run_suite(suite);
}
