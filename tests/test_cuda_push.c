/* What overlaps is pushed apart on the device as by the host: by moving bodies, without a velocity that stays. */
#include "core/model/push_law.h"
#include "cuda_worlds.h"
#include "fewer.h"
#include "fixed_work.h"

static const enum sadmm_cuda_tier tiers[] = {SADMM_CUDA_TIER_BLOCK, SADMM_CUDA_TIER_CLUSTER, SADMM_CUDA_TIER_GRID,
                                             SADMM_CUDA_TIER_STREAM};
enum { TIERS = sizeof tiers / sizeof *tiers, STEPS = 3 };

static sadmm_world *begin_world(int precision, sadmm_method method, int substeps)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = method;
    def.settings.iterations = 12;
    def.settings.substeps = substeps;
    def.settings.dt = 0.002 * substeps;
    def.settings.threads = 1;
    return create_world(&def);
}

static void set_velocity(sadmm_world *world, sadmm_body_id id, int axis, double speed, double spin)
{
    sadmm_body_state state = body_state(world, id);
    state.linear_velocity[axis] = speed;
    state.angular_velocity[2] = spin;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
}

/* A box that goes up, with one sunk into it. */
static void add_lift(sadmm_world *world)
{
    const double half[3] = {0.5, 0.5, 0.1};
    sadmm_body_def lift = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    lift.type = SADMM_BODY_KINEMATIC;
    lift.position[0] = -3;
    lift.linear_velocity[2] = 0.7;
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = 0.5;
    memcpy(shape.size, half, sizeof half);
    MUST(world, sadmm_world_add_body(world, &lift, &id));
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    set_velocity(world, add_box(world, -3, 0, 0.19, 0.1, 2, 0.5), 2, 0.7, 0);
}

/* With all of it the second problem is a cold one; what is sunk alone, a stack, makes it a warm one from the second
 * step on; with a lift, which is kinematic, pushes stay in velocities. */
enum mixture { ALL, SUNK, LIFT, MIXTURES };

/* Islands that are pushed and such that are not: in the air, where some turn, sunk into the ground and into each other,
 * at rest, on ice, in a lift. */
static void add_mixture(sadmm_world *world, enum mixture mixture)
{
    add_floor(world, 0.5);
    for (int k = 0; k < 3 && mixture != SUNK; ++k) {
        const sadmm_shape_type type = k % 2 ? SADMM_SHAPE_BOX : SADMM_SHAPE_SPHERE;
        const sadmm_body_id a = add_solid(world, type, k, 0, 2, 0.1, 1, 0.5),
                            b = add_solid(world, type, k + 0.03, 0.195, 2, 0.1, 1 + k, 0.5);
        set_velocity(world, a, 0, k == 2, 1);
        set_velocity(world, b, 0, 0, 1 + 0.1 * k);
    }
    for (int i = 0; i < (mixture == SUNK ? 4 : 3); ++i) add_box(world, 0, 3, 0.08 + 0.19 * i, 0.1, 2 + i, 0.5);
    for (int i = 0; i < 2; ++i) add_box(world, 1, 3, 0.1 + 0.2 * i, 0.1, 1, 0.5);
    for (int i = 0; i < 2; ++i) add_box(world, 2 + 0.19 * i, 3, 0.1, 0.1, 1, 0);
    if (mixture == LIFT) add_lift(world);
}

/* In the queue and step by step by the host, to the same bits in every tier; in double as on the cpu, but for rounding:
 * of 1e-16, by a factor of ten or so a step where bodies run into each other. Left in velocities, pushes differ by 1
 * m/s. */
START_TEST(mixtures_agree)
{
    const int precision = _i / 4, substeps = 1 + _i % 2;
    const sadmm_method method = _i / 2 % 2 ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
    for (int kind = 0; kind < (_i % 4 == 0 ? MIXTURES : 1); ++kind) {
        const enum mixture mixture = (enum mixture)kind;
        const int runs = 2 * (mixture == ALL && _i % 4 == 0 ? fewer(TIERS) : 1);
        sadmm_world *cpu = begin_world(precision, method, substeps);
        uint64_t hash = 0;
        add_mixture(cpu, mixture);
        step_world(cpu, STEPS);
        for (int t = 0; t < runs; ++t) {
            sadmm_world *world = begin_world(precision, method, substeps);
            use_device(world, precision, 0);
            force_tier(tables[precision], world->context, tiers[t / 2]);
            add_mixture(world, mixture);
            if (t % 2) by_host(world);
            for (int k = 0; k < STEPS; ++k) MUST(world, sadmm_world_step_async(world));
            MUST(world, sadmm_world_wait(world));
            if (mixture != LIFT) ck_assert_int_eq(world_report(world).repeated > 0, t % 2 == 0);
            if (t == 0) hash = state_hash(world);
            ck_assert_msg(state_hash(world) == hash, "mixture %d, tier %d, %s", kind, t / 2, t % 2 ? "host" : "queue");
            double apart = 0;
            for (int32_t i = 0; i < sadmm_world_body_count(cpu); ++i) {
                const sadmm_body_state a = body_state(cpu, body_at(cpu, i)), b = body_state(world, body_at(world, i));
                apart = fmax(apart, distance(a.linear_velocity, b.linear_velocity));
                if (precision == SADMM_F32 || mixture == LIFT) continue;
                ck_assert_double_le(distance(a.position, b.position), 1e-11);
                ck_assert_double_le(distance(a.linear_velocity, b.linear_velocity), 1e-9);
                ck_assert_double_le(distance(a.angular_velocity, b.angular_velocity), 1e-8);
            }
            if (mixture == LIFT) ck_assert_double_gt(apart, 0.5); /* its pushes are in velocities, of up to 1 m/s
                                                                     each */
            sadmm_world_destroy(world);
        }
        sadmm_world_destroy(cpu);
    }
}
END_TEST

START_TEST(which_worlds_are_pushed_apart)
{
    ck_assert(push_is_apart(true, PUSH_CUDA_MOST_BODIES, 0) && !push_is_apart(true, PUSH_CUDA_MOST_BODIES + 1, 0));
    ck_assert(!push_is_apart(true, 1, 1) && push_is_apart(false, PUSH_CUDA_MOST_BODIES + 1, 1));
}
END_TEST

static void place(sadmm_world *world, sadmm_body_id id, double x)
{
    sadmm_body_state state = body_state(world, id);
    state.position[0] = x;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
}

/* Two balls in each other part and are still. Once nothing has been pushed for a while steps have no second problem any
 * more; with the next overlap they have one again: a step is made twice each time one comes. */
START_TEST(plans_come_and_go)
{
    sadmm_world *world = begin_world(_i, SADMM_METHOD_FAST, 1);
    sadmm_settings settings = sadmm_world_settings(world);
    memset(settings.gravity, 0, sizeof settings.gravity);
    MUST(world, sadmm_world_set_settings(world, &settings));
    use_device(world, _i, 0);
    const sadmm_body_id id[2] = {add_solid(world, SADMM_SHAPE_SPHERE, 0, 0, 0, 0.1, 1, 0.5),
                                 add_solid(world, SADMM_SHAPE_SPHERE, 0.3, 0, 0, 0.1, 3, 0.5)};
    step_world(world, 2); /* the first one is the host's */
    for (int round = 0; round < 2; ++round) {
        double x[2];
        place(world, id[0], 0);
        place(world, id[1], 0.195);
        const int64_t before = world_report(world).repeated;
        for (int k = 0; k < 8; ++k) MUST(world, sadmm_world_step_async(world));
        for (int s = 0; s < 2; ++s) {
            const sadmm_body_state state = body_state(world, id[s]);
            ck_assert_double_le(norm3(state.linear_velocity), 1e-12); /* exact: the solve's start is its solution */
            x[s] = state.position[0];
        }
        /* of 5 mm beyond the slop of 10 um a step takes 0.2, at first no more than 1 m/s allows; single precision */
        double left = 0.005 - 1e-5;
        for (int k = 0; k < 8; ++k) left -= fmin(0.2 * left, 0.002);
        ck_assert(fabs(0.2 - (x[1] - x[0]) - 1e-5 - left) < 1e-8);
        ck_assert_int_ge(world_report(world).repeated - before, 1);
        place(world, id[1], 0.3);
        step_world(world, 40);
    }
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    const int parts = tested_precisions();
    Suite *suite = suite_create("cuda_push");
    ADD_CASE(suite, mixtures_agree, 0, 4 * parts);
    ADD_CASE(suite, which_worlds_are_pushed_apart, 0, 1);
    ADD_CASE(suite, plans_come_and_go, 0, parts);
    return run_cuda_suite(suite);
}
