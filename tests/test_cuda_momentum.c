/* Momentum that no contact may change on the device: in every tier, the same bits, as on the host. */
#include "cuda_worlds.h"
#include "fewer.h"
#include "fixed_work.h"
#include "momentum_worlds.h"

static const enum sadmm_cuda_tier tiers[] = {SADMM_CUDA_TIER_BLOCK, SADMM_CUDA_TIER_CLUSTER, SADMM_CUDA_TIER_GRID,
                                             SADMM_CUDA_TIER_STREAM};
enum { TIERS = sizeof tiers / sizeof *tiers };

/* Worlds that are asked for in pairs: method and iterations. */
static const struct {
    sadmm_method method;
    int iterations;
} runs[] = {{SADMM_METHOD_PAPER, 1}, {SADMM_METHOD_PAPER, 7}, {SADMM_METHOD_FAST, 1}, {SADMM_METHOD_FAST, 7}};
enum { RUNS = sizeof runs / sizeof *runs };

static sadmm_world *begin_world(int precision, int run, bool gravity)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = runs[run].method;
    def.settings.iterations = runs[run].iterations;
    def.settings.threads = 1;
    if (!gravity) memset(def.settings.gravity, 0, sizeof def.settings.gravity);
    return create_world(&def);
}

static sadmm_world *begin_in_tier(int precision, int run, bool gravity, int tier)
{
    sadmm_world *world = begin_world(precision, run, gravity);
    use_device(world, precision, 0);
    force_tier(tables[precision], world->context, tiers[tier]);
    return world;
}

/* Every step keeps all of it; and in all tiers the same state comes of it. Two bodies and islands of more than a warp's
 * four bodies and than sixteen, the group of a sum; `first`: the first tier that holds so large an island. */
START_TEST(clusters_in_flight)
{
    static const struct cluster clusters[] = {{SADMM_SHAPE_SPHERE, 2, 0.15, false},
                                              {SADMM_SHAPE_SPHERE, 18, 0.19, true},
                                              {SADMM_SHAPE_BOX, 20, 0.09, true},
                                              {SADMM_SHAPE_SPHERE, EMULATED ? 60 : 400, 0.17, true}};
    static const int first[] = {0, 0, 1, 2};
    static const double at[3] = {10, -20, 30};
    const int precision = _i / RUNS, run = _i % RUNS;
    for (size_t c = 0; c < sizeof clusters / sizeof *clusters; ++c) {
        uint64_t hash[TIERS];
        int ran = 0;
        for (int t = first[c]; t < TIERS; ++t) {
            sadmm_world *world = begin_in_tier(precision, run, clusters[c].gravity, t);
            add_cluster(world, &clusters[c], at);
            for (int k = 0; k < 3; ++k)
                expect_momentum_kept(world, ALL_MOMENTUM, momentum_tolerance((sadmm_precision)precision), "in flight");
            ck_assert_int_ge(world_report(world).contacts, clusters[c].bodies / 2);
            hash[ran++] = state_hash(world);
            sadmm_world_destroy(world);
        }
        for (int t = 1; t < ran; ++t) ck_assert_msg(hash[t] == hash[0], "cluster %zu, tier %d", c, first[c] + t);
    }
}
END_TEST

/* As on the host. */
START_TEST(clusters_that_bounce)
{
    const int precision = _i;
    sadmm_world *world = begin_world(precision, RUNS - 1, false);
    use_device(world, precision, 0);
    add_bouncing_balls(world);
    for (int k = 0; k < 12; ++k)
        expect_momentum_kept(world, ALL_MOMENTUM, momentum_tolerance((sadmm_precision)precision), "balls that bounce");
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(bodies_on_ice)
{
    const int precision = _i / RUNS, run = _i % RUNS;
    uint64_t hash[TIERS];
    for (int t = 0; t < TIERS; ++t) {
        sadmm_world *world = begin_in_tier(precision, run, true, t);
        add_train(world);
        for (int k = 0; k < 4; ++k)
            expect_momentum_kept(world, ON_ICE, momentum_tolerance((sadmm_precision)precision), "train");
        hash[t] = state_hash(world);
        ck_assert_msg(hash[t] == hash[0], "tier %d", t);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* To the last bit by the emulated device; a GPU's sines are rounded otherwise, and what is solved in single precision,
 * and where a contact begins, follows. */
static void expect_close_worlds(sadmm_world *a, sadmm_world *b, const char *what)
{
    if (EMULATED) ck_assert_msg(state_hash(a) == state_hash(b), "%s", what);
    for (int32_t i = 0; i < sadmm_world_body_count(a); ++i) {
        sadmm_body_state x, y;
        MUST(a, sadmm_world_body_state(a, body_at(a, i), &x));
        MUST(b, sadmm_world_body_state(b, body_at(b, i), &y));
        for (int k = 0; k < 3; ++k)
            ck_assert_msg(fabs(x.position[k] - y.position[k]) < 1e-3, "%s: body %d", what, i);
    }
}

/* Mechanisms that balls run into, in the plane and in space: in the queue and step by step by the host. */
START_TEST(mechanisms)
{
    const int precision = _i / RUNS, run = _i % RUNS;
    for (int k = 0; k < 2 * MECHANISM_PLACES; ++k) {
        const enum mechanism_place place = (enum mechanism_place)(k / 2);
        const bool space = k % 2;
        char what[40];
        sadmm_world *worlds[2];
        for (int host = 0; host < 2; ++host) {
            sadmm_world *world = worlds[host] = begin_world(precision, run, mechanism_has_weight(place));
            use_device(world, precision, 0);
            if (host) by_host(world);
            add_mechanism(world, place, space, 0.5);
            for (int step = 0; step < fewer(16); ++step)
                expect_whole_momentum_kept(world, mechanism_keeps(place, space), place == MECHANISM_HANGS,
                                           momentum_tolerance((sadmm_precision)precision),
                                           host ? "by the host" : "on the device");
        }
        snprintf(what, sizeof what, "place %d, space %d", (int)place, space);
        expect_close_worlds(worlds[0], worlds[1], what);
        for (int host = 0; host < 2; ++host) sadmm_world_destroy(worlds[host]);
    }
}
END_TEST

/* Anchored stacks, balls that roll, clusters in the air and one on the ground, side by side. */
static void add_mixture(sadmm_world *world)
{
    static const struct cluster kinds[] = {{SADMM_SHAPE_SPHERE, 5, 0.15, true}, {SADMM_SHAPE_BOX, 8, 0.095, true}};
    const struct cluster ball = {.type = SADMM_SHAPE_SPHERE};
    add_plane(world, 0.5);
    for (int n = 0; n < 6; ++n) {
        const double at[3] = {3.0 * n, 0, n < 4 ? 2 : 0.12}, rolling[6] = {1, 0, 0, 0, 10, 0};
        const double on_ground[3] = {3.0 * n, 3, 0.0999};
        add_cluster(world, &kinds[n % 2], at);
        add_member(world, &ball, on_ground, rolling, 1, 0.5);
        for (int i = 0; i < 3; ++i) add_box(world, 3.0 * n, 6 + 0.01 * i, 0.1 + 0.2 * i, 0.1, 1 + i, 0.5);
    }
}

/* In the queue and step by step by the host, to the same bits in every tier; in double as on the cpu, but for rounding:
 * of 1e-16, by a factor of ten or so a step where bodies run into each other. */
START_TEST(mixtures_agree)
{
    const int precision = _i / RUNS, run = _i % RUNS, steps = 6;
    sadmm_world *cpu = begin_world(precision, run, true);
    uint64_t hash = 0;
    add_mixture(cpu);
    step_world(cpu, steps);
    for (int t = 0; t < 2 * TIERS; ++t) {
        sadmm_world *world = begin_in_tier(precision, run, true, t / 2);
        add_mixture(world);
        if (t % 2) by_host(world);
        for (int k = 0; k < steps; ++k) MUST(world, sadmm_world_step_async(world));
        MUST(world, sadmm_world_wait(world));
        if (t == 0) hash = state_hash(world);
        ck_assert_msg(state_hash(world) == hash, "tier %d, %s", t / 2, t % 2 ? "host" : "queue");
        for (int32_t i = 0; i < sadmm_world_body_count(cpu) && precision == SADMM_F64; ++i) {
            const sadmm_body_state a = body_state(cpu, body_at(cpu, i)), b = body_state(world, body_at(world, i));
            ck_assert_double_le(distance(a.linear_velocity, b.linear_velocity), 1e-9);
            ck_assert_double_le(distance(a.angular_velocity, b.angular_velocity), 1e-8);
        }
        ck_assert_int_eq(world_report(world).limited > 0, world_report(cpu).limited > 0);
        sadmm_world_destroy(world);
    }
    sadmm_world_destroy(cpu);
}
END_TEST

int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    Suite *suite = suite_create("cuda_momentum");
    ADD_CASE(suite, clusters_in_flight, 0, RUNS * parts);
    ADD_CASE(suite, clusters_that_bounce, 0, parts);
    ADD_CASE(suite, bodies_on_ice, 0, RUNS * parts);
    ADD_CASE(suite, mechanisms, 0, RUNS * parts);
    ADD_CASE(suite, mixtures_agree, 0, RUNS * parts);
    return run_cuda_suite(suite);
}
