/* Kernel tables driven by hand on the same system as the literal backend: which tables there are, the problems they
 * are driven on, and how far their iterates are apart. */
#ifndef TESTS_TABLE_RUNNER_H
#define TESTS_TABLE_RUNNER_H

#include <float.h>
#include <string.h>

#include "config.h"
#include "core/base/parallel.h"
#include "fixed_work.h"
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
    double growth; /* of rounding in an iteration, scene_tolerance */
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
    p->block_count = 0;
    return p;
}
static struct contact_problem *no_bodies(int seed) { return (void)seed, contact_problem_new(); }

static const struct scene scenes[] = {
    {"stack, mass ratio 1e4", stack, 0, RIGID, false, 0, 10},
    {"stack, mass ratio 1e4, warm", stack, 0, RAW, true, 0, 10},
    {"pyramid", pyramid, 0, RIGID, false, 0, 1},
    {"plates, mu 3, 30 degrees", plates, 0, RIGID, false, 30, 14},
    {"pyramid, frictionless, tilted", pyramid_slippery, 0, RIGID, true, 5, 1},
    {"mixed, rigid", mixed, 1, RIGID, true, 0, 10},
    {"mixed, A and b", mixed, 2, RAW, true, 0, 10},
    {"mixed, cold", mixed, 3, RAW, false, 0, 10},
    {"mixed, rigid, cold", mixed, 4, RIGID, false, 20, 10},
    {"mixed, frictionless geometry", mixed_slippery, 5, RIGID, true, 0, 10},
    {"mixed, frictionless geometry, A", mixed_slippery, 6, RAW, true, 0, 10},
    {"blocks alone", no_contacts, 7, RAW, true, 0, 10},
    {"free bodies", free_bodies, 8, RIGID, true, 0, 1},
    {"no bodies", no_bodies, 0, RAW, true, 0, 0},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

/* Unit roundoff of a table and of the oracle beside it. */
static inline double table_epsilon(const struct sadmm_kernels *table)
{
    return (table->precision == SADMM_F32 ? FLT_EPSILON : DBL_EPSILON) / 2 + DBL_EPSILON / 2;
}

/* How far v and lambda may be from the oracle's, over the largest so far, in a run of 120 iterations.
 *
 * An iteration does not take two states apart in the norm of A + beta C, so that what is rounded in one is passed on at
 * most as it is: 120 times the unit roundoff. In the largest velocity it may show larger by the square root of what
 * that norm differs by between bodies that touch: of their masses' ratio, 100 (growth 10) or 200 (14), or 1. */
static inline double scene_tolerance(const struct scene *scene, const struct sadmm_kernels *table)
{
    return 120 * scene->growth * table_epsilon(table);
}

static sadmm_settings scene_settings(const struct scene *scene)
{
    sadmm_settings s = fixed_settings();
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
    contact_problem_rows(p);
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
