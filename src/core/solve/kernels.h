/* The kernel table: one entry per box of the paper's Fig. 4, filled once by every backend and precision.
 *
 * Core owns the schedule (schedule.c) and never knows which backend runs. A context holds everything a backend
 * keeps; there is no global state. Every entry returns a status and leaves its message in `error`.
 *
 * State of the iteration (docs/internals/algorithm.md): v per body, lambda per constraint, and what the next Step 1
 * needs. Between init_penalty and read_solution the schedule is
 *
 *     repeat: update_velocity; update_constraints(measure)      or, fused: iterate(count, goes_on, measure)
 *     after a measured iteration: measure_residuals; then update_penalty(ratio); factorize
 *
 * The method FAST is iterated by `iterate` alone (update_velocity and update_constraints refuse it): an iteration is
 * Steps 2-4, then Step 1, and what is relaxed depends on how far a batch still goes (math/relax.h). update_weights and
 * factorize may follow a batch in the place of update_penalty: such a batch `goes_on`: of islands whose weights stay
 * its last iteration is none, so that they are solved as if there were no update. limit_energy ends the step's
 * iterations, of either method.
 *
 * `measure` asks the iteration (for `iterate`: its last one) to keep what the residuals and a penalty update need; only
 * allowed when the plan's `residuals` is set.
 */
#ifndef SADMM_CORE_SOLVE_KERNELS_H
#define SADMM_CORE_SOLVE_KERNELS_H

#include "core/base/error.h"
#include "plan.h"
#include "resident.h"
#include "core/model/system.h"

struct sadmm_context; /* a backend's own; nothing in it is shared with another context */

struct sadmm_kernels {
    sadmm_backend backend;
    sadmm_precision precision;
    const char *variant; /* e.g. "avx512", "literal" */

    sadmm_status (*create)(int device, struct sadmm_context **out, struct sadmm_error *error);
    void (*destroy)(struct sadmm_context *context);

    /* Bind the step's system, plan and settings (alive until the next begin) and allocate: the only entry that does. */
    sadmm_status (*begin)(struct sadmm_context *, const struct sadmm_system *, const struct sadmm_plan *,
                          const struct sadmm_settings *, struct sadmm_error *error);

    sadmm_status (*assemble_bodies)(struct sadmm_context *, struct sadmm_error *);   /* A: A_i, b_i, start velocity */
    sadmm_status (*assemble_contacts)(struct sadmm_context *, struct sadmm_error *); /* B: contacts given by geometry */
    sadmm_status (*assemble_rows)(struct sadmm_context *, struct sadmm_error *); /* C, D: constraints given by rows */

    sadmm_status (*init_penalty)(struct sadmm_context *,
                                 struct sadmm_error *); /* E-G: C_i (14), beta_i (13); FAST: weights */
    /* FAST, after iterations: weights from the multipliers found by now, of islands that started cold (math/weight.h).
     * Then factorize. */
    sadmm_status (*update_weights)(struct sadmm_context *, struct sadmm_error *);
    sadmm_status (*factorize)(struct sadmm_context *, struct sadmm_error *);    /* H: of A_i + beta_i C_i */

    sadmm_status (*update_velocity)(struct sadmm_context *, struct sadmm_error *); /* I-K: Step 1 (6) */
    sadmm_status (*update_constraints)(struct sadmm_context *, bool measure, struct sadmm_error *); /* L-O: Steps 2-4 */
    sadmm_status (*iterate)(struct sadmm_context *, int count, bool goes_on, bool measure,
                            struct sadmm_error *); /* (optional) fused */

    sadmm_status (*measure_residuals)(struct sadmm_context *, struct sadmm_residual *,
                                      struct sadmm_error *);                                    /* (16), (17) */
    sadmm_status (*update_penalty)(struct sadmm_context *, double ratio,
                                   struct sadmm_error *); /* P: beta *= ratio (15) */

    /* Rigid bodies: restore the momentum of islands that no contact may change (math/momentum.h). FAST: slow down
     * islands under contacts alone with more energy than they may have (math/energy_limit.h). */
    sadmm_status (*limit_energy)(struct sadmm_context *, int32_t *limited, struct sadmm_error *);

    /* v and lambda to system->velocity, ->contacts points' impulse, ->rows' lambda. */
    sadmm_status (*read_solution)(struct sadmm_context *, struct sadmm_error *);
    /* beta_i of every body, kg (tests, dumps). FAST: 1, the weights are in C_i. */
    sadmm_status (*read_penalty)(struct sadmm_context *, double *beta, struct sadmm_error *);

    sadmm_status (*integrate)(struct sadmm_context *, struct sadmm_rigid *next,
                              struct sadmm_error *); /* Q: state after dt */
    sadmm_status (*recover_wrenches)(struct sadmm_context *, double *wrench,
                                     struct sadmm_error *); /* R: (12), (bodies x 6) */

    const struct sadmm_resident_kernels *resident; /* (optional) whole steps without the host (resident.h) */
};

/* One registration list (registry.c). Returns NULL with a reason when not available; `variant` NULL: the best. */
const struct sadmm_kernels *sadmm_kernels_find(sadmm_backend backend, sadmm_precision precision, const char **reason);
/* Every table this machine can run, for tests: index 0.. until NULL. */
const struct sadmm_kernels *sadmm_kernels_at(size_t index);

#endif
