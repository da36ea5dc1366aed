/* A kernel table driven by hand on one problem, and how far two of them are apart. */
#ifndef TESTS_RUNNER_H
#define TESTS_RUNNER_H

#include <check.h>
#include <math.h>

#include "contact_problems.h"
#include "core/solve/backends.h"
#include "core/solve/kernels.h"

struct runner {
    const struct sadmm_kernels *k;
    struct sadmm_context *c;
    struct contact_problem *p;
    struct sadmm_plan plan;
    sadmm_settings settings;
    struct sadmm_error error;
};

/* A call that must succeed; r: anything with an `error`. */
#define CALL(r, call)                                                                                         \
    do {                                                                                                      \
        (r)->error.message[0] = 0;                                                                            \
        sadmm_status call_status = (call);                                                                    \
        ck_assert_msg(call_status == SADMM_OK, "%s: %s", sadmm_status_name(call_status), (r)->error.message); \
    } while (0)

static inline const struct sadmm_kernels *literal(void)
{
    const char *reason;
    return sadmm_ref_find(SADMM_F64, &reason);
}

/* After begin. */
static inline void runner_assemble(struct runner *r)
{
    CALL(r, r->k->assemble_bodies(r->c, &r->error));
    if (r->plan.points) CALL(r, r->k->assemble_contacts(r->c, &r->error));
    if (r->plan.row_constraints) CALL(r, r->k->assemble_rows(r->c, &r->error));
    CALL(r, r->k->init_penalty(r->c, &r->error));
    CALL(r, r->k->factorize(r->c, &r->error));
}

static inline void runner_stop(struct runner *r)
{
    r->k->destroy(r->c);
    contact_problem_free(r->p);
}

/* Largest difference, and the largest wanted value. */
struct spread {
    double difference, scale;
};

static inline void add(struct spread *s, double got, double wanted)
{
    ck_assert_msg(isfinite(got) && isfinite(wanted), "got %g, wanted %g", got, wanted);
    s->difference = fmax(s->difference, fabs(got - wanted));
    s->scale = fmax(s->scale, fabs(wanted));
}

static inline double relative(struct spread s) { return s.difference > 0 ? s.difference / s.scale : 0; }

/* What both have read (read_solution). */
static inline void add_velocities(struct spread *s, const struct runner *got, const struct runner *wanted)
{
    for (int32_t i = 0; i < 6 * wanted->p->system.body_count; ++i)
        add(s, got->p->system.velocity[i], wanted->p->system.velocity[i]);
}

static inline void add_multipliers(struct spread *s, const struct runner *got, const struct runner *wanted)
{
    const struct sadmm_system *a = &got->p->system, *b = &wanted->p->system;
    for (size_t k = 0; k < b->contacts->point_count; ++k)
        for (int i = 0; i < 3; ++i) add(s, a->contacts->points[k].impulse[i], b->contacts->points[k].impulse[i]);
    for (size_t r = 0; r < b->rows->row_count; ++r) add(s, a->rows->lambda[r], b->rows->lambda[r]);
}

static inline struct spread velocity_spread(const struct runner *got, const struct runner *wanted)
{
    struct spread s = {0, 0};
    add_velocities(&s, got, wanted);
    return s;
}

static inline struct spread lambda_spread(const struct runner *got, const struct runner *wanted)
{
    struct spread s = {0, 0};
    add_multipliers(&s, got, wanted);
    return s;
}

#endif
