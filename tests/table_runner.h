/* Kernel tables driven by hand on the same system as the literal backend: which tables there are, the problems they
 * are driven on, and how far their iterates are apart. */
#ifndef TESTS_TABLE_RUNNER_H
#define TESTS_TABLE_RUNNER_H

#include <string.h>

#include "config.h"
#include "core/base/parallel.h"
#include "runner.h"

/* ---- tables -------------------------------------------------------------------------------------------------- */

static const struct sadmm_kernels *tables[16];
static int table_count;

static void add_table(const struct sadmm_kernels *table)
{
    if (!table || table->backend == SADMM_BACKEND_REF) return;
    for (int i = 0; i < table_count; ++i)
        if (tables[i] == table) return;
    tables[table_count++] = table;
}

/* The registered ones, and the CPU variants that the registry passes over for a better one. */
#define CPU_VARIANT(isa)                                           \
    extern const struct sadmm_kernels sadmm_cpu_kernels_f32_##isa; \
    extern const struct sadmm_kernels sadmm_cpu_kernels_f64_##isa; \
    add_table(&sadmm_cpu_kernels_f32_##isa);                       \
    add_table(&sadmm_cpu_kernels_f64_##isa)

static void collect_tables(void)
{
    for (size_t i = 0; sadmm_kernels_at(i); ++i) add_table(sadmm_kernels_at(i));
#ifdef SADMM_HAVE_ISA_SSE2
    {
        CPU_VARIANT(sse2);
    }
#endif
#ifdef SADMM_HAVE_ISA_AVX2
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        CPU_VARIANT(avx2);
    }
#endif
}

/* ---- scenes -------------------------------------------------------------------------------------------------- */

enum { RIGID, RAW };

struct scene {
    const char *name;
    struct contact_problem *(*make)(int seed);
    int seed;
    int form;
    bool warm;
    double tilt; /* of gravity, degrees */
    /* |v - v_ref| and |lambda - lambda_ref| over the largest |v_ref| and |lambda_ref| so far, worst of 120 iterations:
     * rounding (6e-8, 1e-16) times the stiffest over the softest direction of A + beta C (about the mass ratio, but
     * damped because light bodies move with heavy ones). Ten times what was measured, rounded up. */
    double tolerance[2];
};

static struct contact_problem *stack(int seed)
{
    static const double masses[] = {0.01, 1, 100};
    (void)seed;
    return contact_problem_stack(masses, 3, 0.5);
}
static struct contact_problem *pyramid(int seed) { return (void)seed, contact_problem_pyramid(6, 0.5); }
static struct contact_problem *plates(int seed) { return (void)seed, contact_problem_plates(3, 3); }
static struct contact_problem *mixed(int seed) { return contact_problem_mixed((uint64_t)seed, 0.5); }
static struct contact_problem *mixed_slippery(int seed) { return contact_problem_mixed((uint64_t)seed, 0); }
static struct contact_problem *pyramid_slippery(int seed) { return (void)seed, contact_problem_pyramid(5, 0); }
static struct contact_problem *no_contacts(int seed)
{
    struct contact_problem *p = mixed(seed);
    p->contacts.pair_count = p->contacts.point_count = 0;
    return p;
}
static struct contact_problem *free_bodies(int seed)
{
    struct contact_problem *p = no_contacts(seed);
    p->system.block_count = 0;
    return p;
}
static struct contact_problem *no_bodies(int seed) { return (void)seed, contact_problem_new(); }

static const struct scene scenes[] = {
    {"stack, mass ratio 1e4", stack, 0, RIGID, false, 0, {1e-4, 1e-12}},
    {"stack, mass ratio 1e4, warm", stack, 0, RAW, true, 0, {1e-4, 1e-12}},
    {"pyramid", pyramid, 0, RIGID, false, 0, {1e-5, 1e-13}},
    {"plates, mu 3, 30 degrees", plates, 0, RIGID, false, 30, {2e-4, 1e-12}},
    {"pyramid, frictionless, tilted", pyramid_slippery, 0, RIGID, true, 5, {1e-5, 1e-13}},
    {"mixed, rigid", mixed, 1, RIGID, true, 0, {1e-4, 1e-12}},
    {"mixed, A and b", mixed, 2, RAW, true, 0, {1e-4, 1e-12}},
    {"mixed, cold", mixed, 3, RAW, false, 0, {1e-4, 1e-12}},
    {"mixed, rigid, cold", mixed, 4, RIGID, false, 20, {1e-4, 1e-12}},
    {"mixed, frictionless geometry", mixed_slippery, 5, RIGID, true, 0, {1e-4, 1e-12}},
    {"mixed, frictionless geometry, A", mixed_slippery, 6, RAW, true, 0, {1e-4, 1e-12}},
    {"blocks alone", no_contacts, 7, RAW, true, 0, {1e-4, 1e-12}},
    {"free bodies", free_bodies, 8, RIGID, true, 0, {1e-5, 1e-13}},
    {"no bodies", no_bodies, 0, RAW, true, 0, {0, 0}},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

static sadmm_settings scene_settings(const struct scene *scene)
{
    sadmm_settings s = sadmm_settings_default();
    double angle = scene->tilt * 0.017453292519943295;
    s.gravity[0] = 9.81 * sin(angle);
    s.gravity[2] = -9.81 * cos(angle);
    s.warm_start = scene->warm;
    s.iterations = 100;         /* more than the penalty period: plans of the method paper have updates */
    s.measure_residuals = true; /* so that every plan has room for them */
    return s;
}

static struct contact_problem *make_problem(const struct scene *scene)
{
    sadmm_settings s = scene_settings(scene);
    struct contact_problem *p = scene->make(scene->seed);
    contact_problem_seed(42);
    if (scene->form == RAW) contact_problem_raw(p, &s, 0.1);
    if (scene->warm) contact_problem_warm(p, 0.3, 0.2);
    return p;
}

/* ---- one table at work --------------------------------------------------------------------------------------- */

static void runner_start_settings(struct runner *r, const struct sadmm_kernels *k, const sadmm_settings *settings,
                                  const struct contact_problem *problem)
{
    memset(r, 0, sizeof *r);
    r->k = k;
    r->settings = *settings;
    r->p = contact_problem_copy(problem);
    sadmm_test_force_threads(true); /* the problems are too small for more than one */
    r->plan = sadmm_plan_make(&r->p->system, &r->settings);
    CALL(r, k->create(0, &r->c, &r->error));
    CALL(r, k->begin(r->c, &r->p->system, &r->plan, &r->settings, &r->error));
    runner_assemble(r);
}

static inline void runner_start_method(struct runner *r, const struct sadmm_kernels *k, const struct scene *scene,
                                       const struct contact_problem *problem, int threads, sadmm_method method)
{
    sadmm_settings settings = scene_settings(scene);
    settings.threads = threads;
    settings.method = method;
    runner_start_settings(r, k, &settings, problem);
}

static inline void runner_start(struct runner *r, const struct sadmm_kernels *k, const struct scene *scene,
                                const struct contact_problem *problem, int threads)
{
    runner_start_method(r, k, scene, problem, threads, SADMM_METHOD_PAPER);
}

/* v and lambda of two runners; the scales only grow, so that a velocity on its way to 0 is not measured by itself. */
static void compare_solutions(struct runner *got, struct runner *wanted, struct spread *v, struct spread *lambda)
{
    CALL(got, got->k->read_solution(got->c, &got->error));
    CALL(wanted, wanted->k->read_solution(wanted->c, &wanted->error));
    add_velocities(v, got, wanted);
    add_multipliers(lambda, got, wanted);
}

#endif
