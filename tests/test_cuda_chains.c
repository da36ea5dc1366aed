/* Chains whose links a step does not resolve, on the device (core/model/stiffening.h, joint_close.h): steps that it
 * makes alone against the same kernels driven by the host, to the last bit on the emulated device; and against the
 * CPU. */
#include "core/model/joint_trapezoid.h"
#include "cuda_worlds.h"
#include "fewer.h"
#include "fixed_work.h"

static const sadmm_body_id WORLD = {0, 0};
static const double LENGTH = 0.2; /* of a link */

static sadmm_world *new_world(int precision, sadmm_method method, int substeps, double dt)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = method;
    def.settings.iterations = 10;
    def.settings.substeps = substeps;
    def.settings.threads = 1;
    def.settings.dt = dt;
    return create_world(&def);
}

static void join(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, double x, double y, double z)
{
    static const double upright[4] = {1, 0, 0, 0};
    const double place[3] = {x, y, z};
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_SPHERICAL;
    def.body_a = a;
    def.body_b = b;
    MUST(world, sadmm_world_place_joint(world, &def, place, upright));
    MUST(world, sadmm_world_add_joint(world, &def, NULL));
}

/* Links of 0.1 kg from a place on, along x or down, behind `last`, which they are joined to; the last one. */
static sadmm_body_id add_links(sadmm_world *world, int count, bool down, const double from[3], sadmm_body_id last)
{
    const double across = 0.1 * LENGTH * LENGTH / 12;
    for (int i = 0; i < count; ++i) {
        sadmm_body_def def = sadmm_body_def_default();
        const double at = (i + 0.5) * LENGTH, begin = i * LENGTH;
        def.mass = 0.1;
        for (int k = 0; k < 3; ++k) {
            def.position[k] = from[k];
            def.inertia[k] = k == (down ? 2 : 0) ? across / 20 : across;
        }
        def.position[down ? 2 : 0] += down ? -at : at;
        sadmm_body_id id;
        MUST(world, sadmm_world_add_body(world, &def, &id));
        join(world, last, id, from[0] + (down ? 0 : begin), from[1], from[2] - (down ? begin : 0));
        last = id;
    }
    return last;
}

static void throw_body(sadmm_world *world, sadmm_body_id id, double x, double y)
{
    sadmm_body_state state = body_state(world, id);
    state.linear_velocity[0] += x;
    state.linear_velocity[1] += y;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
}

/* Four links under 40 kg, kicked; a rope that is let go from the level; two blocks in the air that are thrown apart on
 * links; a block on the floor, thrown so that it goes round on links; one at the end of others, which is hit by a box
 * and by a block that goes round beside it. */
static sadmm_world *chains(int precision, sadmm_method method, int substeps, double dt)
{
    sadmm_world *world = new_world(precision, method, substeps, dt);
    add_floor(world, 0.5);
    const double hung[3] = {0, 0, 3}, level[3] = {2, 0, 3}, air[3] = {6, 0, 3}, floor[3] = {8, 0, 0.1},
                 slack[3] = {12, 0, 0.1}, beside[3] = {12.3, -0.55, 0.11};
    sadmm_body_id last = add_links(world, 4, true, hung, WORLD), weight = add_box(world, 0, 0, 2.1, 0.1, 40, 0.5);
    join(world, last, weight, 0, 0, 2.2);
    throw_body(world, last, 0.5, 0);
    add_links(world, 10, false, level, WORLD);
    const sadmm_body_id block = add_box(world, 5.9, 0, 3, 0.1, 5, 0.5);
    last = add_links(world, 3, false, air, block);
    weight = add_box(world, 6.7, 0, 3, 0.1, 5, 0.5);
    join(world, last, weight, 6.6, 0, 3);
    throw_body(world, weight, 0, 8);
    throw_body(world, block, 0, -8);
    last = add_links(world, 4, false, floor, WORLD);
    weight = add_box(world, 8.9, 0, 0.1, 0.1, 20, 0.5);
    join(world, last, weight, 8.8, 0, 0.1);
    throw_body(world, weight, 0, 6);
    last = add_links(world, 3, false, slack, WORLD);
    weight = add_box(world, 12.7, 0, 0.1, 0.1, 20, 0.5);
    join(world, last, weight, 12.6, 0, 0.1);
    throw_body(world, add_box(world, 12.39, 0.02, 0.3, 0.09, 20, 0.5), 6, 0);
    const sadmm_body_id other = add_box(world, 12.8, -0.55, 0.11, 0.1, 30, 0.5);
    join(world, add_links(world, 2, false, beside, WORLD), other, 12.7, -0.55, 0.11);
    throw_body(world, other, 0, 6);
    return world;
}

/* A rope of four links whose end is swung round. */
static void add_swung_rope(sadmm_world *world)
{
    static const double from[3] = {16.3, 0, 3};
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id hand;
    def.type = SADMM_BODY_KINEMATIC;
    def.position[0] = 16, def.position[2] = 3;
    def.angular_velocity[2] = 25;
    MUST(world, sadmm_world_add_body(world, &def, &hand));
    add_links(world, 4, false, from, hand);
}

/* ---- by the host, and by the device ------------------------------------------------------------------------------ */

static const struct {
    sadmm_method method;
    int substeps, tier;
    double dt;
    bool swung;
} ways[] = {{SADMM_METHOD_FAST, 1, SADMM_CUDA_TIER_AUTO, 0.01, false},
            {SADMM_METHOD_PAPER, 2, SADMM_CUDA_TIER_GRID, 1. / 60, false},
            {SADMM_METHOD_FAST, 2, SADMM_CUDA_TIER_STREAM, 1. / 60, true}};
enum { WAYS = sizeof ways / sizeof *ways };

static bool is_stiffened(const sadmm_world *world, int32_t i)
{
    return world->start.rigid[i].rolls & ROLLING_IS_STIFFENED;
}

/* Bodies that were stiffened in the last step, by the host, and those whose joints were closed; in all, and in islands
 * that something touches. */
struct counts {
    int stiffened[2], closed[2];
};
static void count(sadmm_world *world, struct counts *counts)
{
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        const bool touched = world->joint_touch[world->joint_labels[i]] & ISLAND_TOUCHED;
        for (int k = 0; k <= touched; ++k) {
            counts->stiffened[k] += is_stiffened(world, i);
            counts->closed[k] += world->opened[i];
        }
    }
    memset(world->opened, 0, (size_t)world->dynamic_count); /* it says of the last time that any were */
}

START_TEST(resident_chains_equal_those_by_host)
{
    const int precision = _i / WAYS, way = _i % WAYS, steps = fewer(40);
    sadmm_world *worlds[2];
    struct counts counts = {{0, 0}, {0, 0}};
    char what[80];
    for (int k = 0; k < 2; ++k) {
        worlds[k] = chains(precision, ways[way].method, ways[way].substeps, ways[way].dt);
        if (ways[way].swung) add_swung_rope(worlds[k]);
        use_device(worlds[k], precision, 0);
        if (ways[way].tier != SADMM_CUDA_TIER_AUTO)
            force_tier(tables[precision], worlds[k]->context, (enum sadmm_cuda_tier)ways[way].tier);
    }
    by_host(worlds[0]);
    for (int step = 0; step < steps; ++step) {
        snprintf(what, sizeof what, "way %d, %s, step %d", way, precision ? "f64" : "f32", step);
        for (int k = 0; k < 2; ++k)
            MUST(worlds[k], step % 4 == 2 ? sadmm_world_step_async(worlds[k]) : sadmm_world_step(worlds[k]));
        if (step % 4 == 2) continue;
        ck_assert(!worlds[0]->resident.loaded && worlds[1]->resident.loaded == (step > 0 || way == 1));
        if (EMULATED) {
            expect_same_world(worlds[0], worlds[1], what);
            ck_assert_msg(world_report(worlds[0]).joint_drift == world_report(worlds[1]).joint_drift,
                          "%s: off by %g, %g", what, world_report(worlds[0]).joint_drift,
                          world_report(worlds[1]).joint_drift);
        }
        count(worlds[0], &counts);
    }
    ck_assert_msg(counts.stiffened[0] > counts.stiffened[1] && counts.stiffened[1] > 30 && counts.closed[0] > 10 &&
                      counts.closed[1] > 0,
                  "%d, %d stiffened, %d, %d closed", counts.stiffened[0], counts.stiffened[1], counts.closed[0],
                  counts.closed[1]);
    /* what is read of such a step is the same; on a GPU but for its own sines */
    const sadmm_certificate a = certified_step(worlds[0]), b = certified_step(worlds[1]);
    ck_assert_double_le(fabs(a.momentum_max - b.momentum_max), EMULATED ? 0 : 1e-2);
    ck_assert_double_le(fabs(a.ncp_max - b.ncp_max), EMULATED ? 0 : 1e-2);
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* ---- against the CPU --------------------------------------------------------------------------------------------- */

/* Links under 100 kg that are kicked, and a rope that is let go: both take the block direct solve, in double. */
START_TEST(chains_move_as_on_the_cpu)
{
    static const double steps[] = {0.01, 1. / 60};
    static const int links[] = {20, 120}; /* more than a thread block has room for */
    const double dt = steps[_i % 2], hung[3] = {0, 0, 3}, level[3] = {2, 0, 3};
    const int precision = _i / 2;
    sadmm_world *worlds[2];
    double apart = 0, most = 0, drift = 0;
    for (int k = 0; k < 2; ++k) {
        worlds[k] = new_world(precision, SADMM_METHOD_FAST, 1, dt);
        const sadmm_body_id last = add_links(worlds[k], 12, true, hung, WORLD),
                            weight = add_box(worlds[k], 0, 0, 0.5, 0.1, 100, 0.5);
        join(worlds[k], last, weight, 0, 0, 0.6);
        throw_body(worlds[k], last, 0.2, 0.1);
        add_links(worlds[k], links[_i % 2], false, level, WORLD);
    }
    use_device(worlds[1], precision, 0);
    for (int step = 0; step < fewer(48); ++step) {
        for (int k = 0; k < 2; ++k) step_world(worlds[k], 1);
        for (int32_t k = 0; k < sadmm_world_body_count(worlds[0]); ++k) {
            const sadmm_body_state a = body_state(worlds[0], body_at(worlds[0], k)),
                                   b = body_state(worlds[1], body_at(worlds[1], k));
            apart = fmax(apart, distance(a.position, b.position));
            if (k < 12) most = fmax(most, hypot(b.position[0], b.position[1])); /* of the loaded chain */
        }
        drift = fmax(drift, world_report(worlds[1]).joint_drift);
        apart = fmax(apart, fabs(drift - fmax(drift, world_report(worlds[0]).joint_drift)));
    }
    ck_assert_double_lt(apart, EMULATED ? 1e-12 : 1e-6); /* a GPU has sines of its own */
    ck_assert_double_lt(most, 0.01); /* 0.2 m/s over omega = (3 T / (m l))^1/2 = 380 /s, and what its joints are opened
                                        by at first; by forces along old directions links would go round */
    ck_assert_double_lt(drift, 1e-3 * LENGTH);
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* ---- windows that fold ------------------------------------------------------------------------------------------- */

/* A rod of 1 kg along (x, z) of length 1 about its middle, which moves with `velocity` and turns at `rate` about y. */
static sadmm_body_id add_rod(sadmm_world *world, double middle_x, double middle_z, double angle,
                             const double velocity[3], double rate)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = 1;
    def.inertia[0] = def.inertia[1] = 1. / 12, def.inertia[2] = 1e-3;
    def.position[0] = middle_x, def.position[2] = middle_z;
    def.orientation[0] = cos(angle / 2), def.orientation[2] = sin(angle / 2); /* its z axis goes from z to x */
    memcpy(def.linear_velocity, velocity, sizeof def.linear_velocity);
    def.angular_velocity[1] = rate;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static void hinge(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, double x, double z)
{
    const double place[3] = {x, 0, z}, along_y[4] = {sqrt(0.5), -sqrt(0.5), 0, 0};
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_REVOLUTE;
    def.body_a = a;
    def.body_b = b;
    MUST(world, sadmm_world_place_joint(world, &def, place, along_y));
    MUST(world, sadmm_world_add_joint(world, &def, NULL));
}

/* Three of 1 m in a row, whose posts go down to the right: soon all rods lie in one line. */
static sadmm_world *windows(int precision, int substeps)
{
    enum { POSTS = 4 };
    const double angle = 1.3, rate = 3, x = sin(angle), z = cos(angle), half[3] = {rate * z / 2, 0, -rate * x / 2},
                 whole[3] = {rate * z, 0, -rate * x};
    sadmm_world *world = new_world(precision, SADMM_METHOD_FAST, substeps, 0.01);
    sadmm_body_id last = WORLD;
    for (int i = 0; i < POSTS; ++i) {
        const sadmm_body_id post = add_rod(world, i + x / 2, z / 2, angle, half, rate);
        hinge(world, WORLD, post, i, 0);
        if (i > 0) {
            const sadmm_body_id top = add_rod(world, i - 0.5 + x, z, M_PI / 2, whole, 0);
            hinge(world, last, top, i - 1 + x, z);
            hinge(world, top, post, i + x, z);
        }
        last = post;
    }
    return world;
}

/* On the CPU, by the host, and by the device. Left as they are in the pose they are off by 1e-5 m a step on. */
START_TEST(windows_fold_as_on_the_cpu)
{
    const int precision = _i / 2, substeps = 1 + _i % 2, steps = 20;
    sadmm_world *worlds[3];
    int folding = 0;
    for (int k = 0; k < 3; ++k) {
        worlds[k] = windows(precision, substeps);
        if (k > 0) use_device(worlds[k], precision, 0);
    }
    by_host(worlds[1]);
    for (int step = 0; step < steps; ++step) {
        double apart = 0;
        for (int k = 0; k < 3; ++k) step_world(worlds[k], 1);
        for (int32_t k = 0; k < sadmm_world_body_count(worlds[0]); ++k) {
            folding += worlds[0]->folding[k];
            apart = fmax(apart, distance(body_state(worlds[0], body_at(worlds[0], k)).position,
                                         body_state(worlds[2], body_at(worlds[2], k)).position));
        }
        ck_assert_msg(apart < (EMULATED ? 1e-12 : 1e-6), "step %d: %g m apart", step, apart);
        if (EMULATED) expect_same_world(worlds[1], worlds[2], "windows");
    }
    ck_assert_int_gt(folding, 0);
    for (int k = 0; k < 3; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("cuda_chains");
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    ADD_CASE(suite, resident_chains_equal_those_by_host, 0, tested_precisions() * WAYS);
    ADD_CASE(suite, chains_move_as_on_the_cpu, 0, tested_precisions() * 2);
    ADD_CASE(suite, windows_fold_as_on_the_cpu, 0, 2 * tested_precisions());
    return run_cuda_suite(suite);
}
