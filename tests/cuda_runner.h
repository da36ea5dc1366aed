/* Scenes of the CUDA backend's test programs, and one kernel table at work on one of them: on a device, or emulated
 * (CUDA_EMULATED). */
#ifndef TESTS_CUDA_RUNNER_H
#define TESTS_CUDA_RUNNER_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/schedule.h"
#include "cuda_suite.h"
#include "fixed_work.h"
#include "runner.h"

#ifdef CUDA_EMULATED
#include "emulation_control.h"
#define force_tier cuda_emulation_force_tier
#define force_cluster cuda_emulation_force_cluster
#define tier_of cuda_emulation_tier_of
#define SYMBOL(name, precision) sadmm_cuda_##name##_emulated_##precision
#else
#include "backend_cuda/device/tier.h"
#define force_tier sadmm_cuda_force_tier
#define force_cluster sadmm_cuda_force_cluster
#define tier_of sadmm_cuda_tier_of
#define SYMBOL(name, precision) sadmm_cuda_##name##_##precision
#endif
#define CUDA(name) SYMBOL(name, f32)
#include "backend_cuda/device/entries.h"
#undef CUDA
#define CUDA(name) SYMBOL(name, f64)
#include "backend_cuda/device/entries.h"
#undef CUDA

static const struct sadmm_kernels *tables[2]; /* by precision */

/* ---- scenes ---------------------------------------------------------------------------------------------------- */

enum form { RIGID, RAW };

/* Stacks that do not touch each other, of different heights, a joint in some: islands for the BLOCK tier. */
static inline struct contact_problem *towers(int count, double friction)
{
    static const double up[3] = {0, 0, 1};
    struct contact_problem *p = contact_problem_new();
    for (int t = 0; t < count; ++t) {
        int32_t below = -1;
        for (int i = 0; i <= t % 4; ++i) {
            int32_t box = contact_problem_box(p, 1 + i, 0.1, 0.1, 0.1, t, 0, 0.1 + 0.2 * i);
            for (int k = 0; k < 4; ++k)
                contact_problem_touch(p, below, box, (double[3]){t + (k & 1 ? 0.1 : -0.1), k & 2 ? 0.1 : -0.1, 0.2 * i},
                                      up, 0, friction, 0);
            if (t % 3 == 1 && below >= 0) {
                sadmm_problem_block *block = contact_problem_block(p, SADMM_BLOCK_HARD, 1, below, box);
                block->jacobian_a[5] = -1; /* no relative turn about z */
                block->jacobian_b[5] = 1;
                block->error[0] = 0.01;
            }
            below = box;
        }
    }
    return p;
}

static inline size_t pick_below(size_t count) { return (size_t)((contact_problem_random() + 1) / 2 * (double)count); }

/* Bodies and pairs in an order that has nothing to do with the islands: slots must undo it. */
static inline struct contact_problem *shuffled_towers(void)
{
    struct contact_problem *p = towers(12, 0.5);
    struct sadmm_contact_set *set = &p->contacts;
    int32_t n = p->system.body_count, *place = malloc((size_t)n * sizeof *place);
    struct sadmm_rigid *bodies = malloc((size_t)n * sizeof *bodies);
    contact_problem_seed(9);
    for (int32_t i = 0; i < n; ++i) {
        size_t other = pick_below((size_t)i + 1);
        place[i] = place[other];
        place[other] = i;
    }
    memcpy(bodies, p->rigid, (size_t)n * sizeof *bodies);
    for (int32_t i = 0; i < n; ++i) p->rigid[place[i]] = bodies[i];
    for (size_t k = 0; k < set->pair_count; ++k) {
        int32_t *a = &set->pairs[k].body_a, *b = &set->pairs[k].body_b;
        if (*a >= 0) *a = place[*a];
        if (*b >= 0) *b = place[*b];
    }
    for (int32_t k = 0; k < p->block_count; ++k) {
        p->blocks[k].body_a = place[p->blocks[k].body_a];
        p->blocks[k].body_b = place[p->blocks[k].body_b];
    }
    for (size_t k = set->pair_count; k-- > 1;) {
        size_t other = pick_below(k + 1);
        struct sadmm_contact_pair pair = set->pairs[k];
        set->pairs[k] = set->pairs[other];
        set->pairs[other] = pair;
    }
    free(bodies);
    free(place);
    return p;
}

/* A manifold of eight points: the larger instances. */
static inline struct contact_problem *octagons(double friction)
{
    static const double up[3] = {0, 0, 1};
    struct contact_problem *p = contact_problem_new();
    for (int i = 0; i < 3; ++i) {
        contact_problem_box(p, 2, 0.1, 0.1, 0.1, 0.01 * i, 0, 0.1 + 0.2 * i);
        for (int k = 0; k < 8; ++k)
            contact_problem_touch(p, i - 1, i, (double[3]){0.1 * cos(0.7 * k), 0.1 * sin(0.7 * k), 0.2 * i}, up, 1e-4,
                                  friction, 0);
    }
    return p;
}

/* No pair has more than one point: one thread a pair. Each ball rests on two of the row below, the lowest on the
 * ground. */
static inline struct contact_problem *balls(double friction)
{
    static const double up[3] = {0, 0, 1};
    struct contact_problem *p = contact_problem_new();
    const double radius = 0.1, height = radius * sqrt(3.0);
    for (int row = 0, below = -1; row < 5; ++row) {
        const int first = below + 1, width = 7 - row;
        for (int i = 0; i < width; ++i) {
            const double x = radius * (2 * i + row), z = radius + height * row;
            int32_t ball = contact_problem_box(p, 1 + 0.1 * i, radius, radius, radius, x, 0, z);
            if (row == 0) contact_problem_touch(p, -1, ball, (double[3]){x, 0, 0}, up, -1e-4, friction, 0);
            for (int side = -1; row > 0 && side <= 1; side += 2)
                contact_problem_touch(p, first - width - 1 + i + (side + 1) / 2, ball,
                                      (double[3]){x + 0.5 * side * radius, 0, z - 0.5 * height},
                                      (double[3]){-0.5 * side, 0, 0.5 * sqrt(3.0)}, 1e-4 * side, friction, 0);
        }
        below = first + width - 1;
    }
    return p;
}

static inline struct contact_problem *scene_balls(void) { return balls(0.5); }
static inline struct contact_problem *scene_slippery_balls(void) { return balls(0); }
static inline struct contact_problem *scene_mixed(void) { return contact_problem_mixed(11, 0.5); }
static inline struct contact_problem *scene_slippery(void) { return contact_problem_mixed(12, 0); }
static inline struct contact_problem *scene_octagons(void) { return octagons(0.4); }
static inline struct contact_problem *scene_slippery_octagons(void) { return octagons(0); }
static inline struct contact_problem *scene_pyramid(void) { return contact_problem_pyramid(7, 0.5); }
static inline struct contact_problem *scene_towers(void) { return towers(25, 0.5); }
static inline struct contact_problem *scene_slippery_towers(void) { return towers(9, 0); }
static inline struct contact_problem *scene_blocks(void)
{
    struct contact_problem *p = contact_problem_mixed(13, 0.5);
    p->contacts.pair_count = p->contacts.point_count = 0;
    return p;
}
static inline struct contact_problem *scene_free(void)
{
    struct contact_problem *p = scene_blocks();
    p->block_count = 0;
    return p;
}
static inline struct contact_problem *scene_empty(void) { return contact_problem_new(); }
/* 17 rows: 289 pairs in one island, more than a thread block takes: parts that exchange velocities. */
static inline struct contact_problem *scene_large(void) { return contact_problem_pyramid(17, 0.5); }

static const struct scene {
    const char *name;
    struct contact_problem *(*make)(void);
    enum form form;
    bool warm;
    int tiers; /* bit SADMM_CUDA_TIER_x: the tier takes this scene */
} scenes[] = {
    {"mixed", scene_mixed, RIGID, true, 30},
    {"mixed, A and b, cold", scene_mixed, RAW, false, 30},
    {"mixed, frictionless", scene_slippery, RAW, true, 30},
    {"pyramid", scene_pyramid, RIGID, false, 30},
    {"towers", scene_towers, RIGID, true, 30},
    {"towers, frictionless", scene_slippery_towers, RIGID, false, 30},
    {"towers, shuffled", shuffled_towers, RIGID, true, 30},
    {"octagons", scene_octagons, RIGID, true, 30},
    {"octagons, frictionless", scene_slippery_octagons, RIGID, false, 30},
    {"balls", scene_balls, RIGID, true, 30},
    {"balls, frictionless", scene_slippery_balls, RIGID, false, 30},
    {"large", scene_large, RIGID, true, 28},
    {"blocks alone", scene_blocks, RAW, true, 30},
    {"free bodies", scene_free, RIGID, true, 30},
    {"nothing", scene_empty, RAW, true, 30},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

static inline const struct scene *find_scene(const char *name)
{
    const struct scene *scene = scenes;
    while (strcmp(scene->name, name) != 0) ++scene;
    return scene;
}

/* ---- one table at work ----------------------------------------------------------------------------------------- */

static inline struct contact_problem *make_problem(const struct scene *scene, const sadmm_settings *settings)
{
    struct contact_problem *p = scene->make();
    contact_problem_seed(42);
    if (scene->form == RAW) contact_problem_raw(p, settings, 0.1);
    if (scene->warm) contact_problem_warm(p, 0.3, 0.2);
    contact_problem_rows(p);
    return p;
}

static inline void runner_create(struct runner *r, const struct sadmm_kernels *k)
{
    memset(r, 0, sizeof *r);
    r->k = k;
    CALL(r, k->create(0, &r->c, &r->error));
}

static inline sadmm_status runner_begin(struct runner *r, const struct scene *scene, sadmm_method method)
{
    r->settings = fixed_settings();
    r->settings.method = method;
    r->settings.iterations = 100; /* more than the penalty period: plans of the method paper have updates */
    r->settings.warm_start = scene->warm;
    r->settings.measure_residuals = true; /* so that every plan has room for them */
    contact_problem_free(r->p);
    r->p = make_problem(scene, &r->settings);
    r->plan = sadmm_plan_make(&r->p->system, &r->settings);
    return r->k->begin(r->c, &r->p->system, &r->plan, &r->settings, &r->error);
}

static inline void runner_start_method(struct runner *r, const struct sadmm_kernels *k, const struct scene *scene,
                                       enum sadmm_cuda_tier tier, sadmm_method method)
{
    runner_create(r, k);
    if (k->backend == SADMM_BACKEND_CUDA) force_tier(k, r->c, tier);
    CALL(r, runner_begin(r, scene, method));
    runner_assemble(r);
    if (k->backend == SADMM_BACKEND_CUDA && tier != SADMM_CUDA_TIER_AUTO)
        ck_assert_int_eq(tier_of(k, r->c, NULL), tier);
}

static inline void runner_start(struct runner *r, const struct sadmm_kernels *k, const struct scene *scene,
                                enum sadmm_cuda_tier tier)
{
    runner_start_method(r, k, scene, tier, SADMM_METHOD_PAPER);
}

static inline void runner_step(struct runner *r, bool measure)
{
    CALL(r, r->k->update_velocity(r->c, &r->error));
    CALL(r, r->k->update_constraints(r->c, measure, &r->error));
}

static inline struct sadmm_residual runner_residual(struct runner *r)
{
    struct sadmm_residual residual;
    CALL(r, r->k->measure_residuals(r->c, &residual, &r->error));
    return residual;
}

static inline void runner_read(struct runner *r) { CALL(r, r->k->read_solution(r->c, &r->error)); }

/* ---- comparing ------------------------------------------------------------------------------------------------- */

/* Not one bit may differ. */
static inline void check_same(struct runner *got, struct runner *wanted, const char *what)
{
    runner_read(got);
    runner_read(wanted);
    struct spread v = velocity_spread(got, wanted), lambda = lambda_spread(got, wanted);
    ck_assert_msg(v.difference == 0 && lambda.difference == 0, "%s: v differs by %g, lambda by %g", what, relative(v),
                  relative(lambda));
}

/* The device's tiers, STREAM last: it is what others are compared with. */
enum { MOST_TIERS = 4 };
static enum sadmm_cuda_tier tiers[MOST_TIERS];
static size_t tier_count;

/* Only devices of compute capability 9.0 and later have clusters; the emulated one has them. */
static inline bool device_has_clusters(const struct sadmm_kernels *table)
{
#ifdef CUDA_EMULATED
    (void)table;
    return true;
#else
    const sadmm_settings settings = fixed_settings();
    struct contact_problem *p = make_problem(&scenes[0], &settings);
    struct sadmm_plan plan = sadmm_plan_make(&p->system, &settings);
    struct sadmm_context *c = NULL;
    struct sadmm_error error = {SADMM_OK, ""};
    sadmm_status status = table->create(0, &c, &error);
    if (status == SADMM_OK) {
        force_tier(table, c, SADMM_CUDA_TIER_CLUSTER);
        status = table->begin(c, &p->system, &plan, &settings, &error);
    }
    table->destroy(c);
    contact_problem_free(p);
    /* What else fails is for the tests to say. */
    return status != SADMM_ERROR_UNSUPPORTED || !strstr(error.message, "the device has no clusters");
#endif
}

/* Before tests are registered, so that none counts that had nothing to test. Returns whether there are clusters. */
static inline bool find_tiers(void)
{
    const bool clusters = device_has_clusters(tables[0]);
    tier_count = 0;
    tiers[tier_count++] = SADMM_CUDA_TIER_BLOCK;
    if (clusters) tiers[tier_count++] = SADMM_CUDA_TIER_CLUSTER;
    tiers[tier_count++] = SADMM_CUDA_TIER_GRID;
    tiers[tier_count++] = SADMM_CUDA_TIER_STREAM;
    if (!clusters) printf("without tests of clusters: the device has none\n");
    return clusters;
}

static inline void set_abort(struct runner *r, enum cuda_abort abort_code)
{
    if (r->k->precision == SADMM_F32) CALL(r, SYMBOL(set_abort, f32)(r->c, abort_code, &r->error));
    else CALL(r, SYMBOL(set_abort, f64)(r->c, abort_code, &r->error));
}

#ifdef CUDA_EMULATED
/* A solve in which runtime calls fail from number `calls` on: a status and a message, never a leak. False: it had
 * fewer. */
static inline bool solve_fails_at(const struct sadmm_kernels *table, enum sadmm_cuda_tier tier,
                                  const struct scene *scene, const sadmm_settings *settings, long calls)
{
    struct contact_problem *p = make_problem(scene, settings);
    struct sadmm_plan plan = sadmm_plan_make(&p->system, settings);
    struct sadmm_solve_report report;
    struct sadmm_context *c = NULL;
    struct sadmm_error error = {SADMM_OK, ""};
    cuda_emulation_calls_left = calls;
    sadmm_status status = table->create(1, &c, &error);
    if (status == SADMM_OK) {
        force_tier(table, c, tier);
        status = sadmm_schedule_solve(table, c, &p->system, settings, &plan, NULL, &report, &error);
    } else {
        ck_assert_ptr_null(c);
    }
    const bool reached = cuda_emulation_calls_left < 0;
    cuda_emulation_calls_left = -1;
    ck_assert_msg(status == (reached ? SADMM_ERROR_DEVICE : SADMM_OK), "call %ld: %s", calls,
                  sadmm_status_name(status));
    if (reached)
        ck_assert_msg(strstr(error.message, "CUDA device 1: ") && strstr(error.message, "launch failure"), "%s",
                      error.message);
    table->destroy(c);
    contact_problem_free(p);
    ck_assert_msg(cuda_emulation_allocations == 0, "call %ld: %ld left", calls, cuda_emulation_allocations);
    return reached;
}
#endif

#endif
