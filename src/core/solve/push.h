/* What overlaps is pushed apart by moving bodies, without a velocity that stays.
 *
 * Baumgarte stabilisation is a separation speed of contacts. As part of a step's velocities it stays when the overlap
 * has gone: bodies fly apart, the faster the shorter the step. So a step of an island with such pushes has two
 * problems, which differ in e alone:
 *
 *     e_0 = 0 where bodies overlap      v_0, lambda_0: the step's velocities, impulses, forces, next warm start
 *     e_1 = -push there                 v_1, from v_0 and lambda_0 on: bodies move by dt (v_1 - v_0) besides
 *
 * The second one is that of the islands that need it, by themselves, solved by the same kernels with a context of its
 * own. What they have then moved by makes no momentum, as impulses do not. Nothing is between two bodies that turn
 * about each other but distance, though: an island in the air is turned by as much as keeps its angular momentum.
 *
 * A push need not be kept out of velocities where gravity takes it back as fast as it shrinks (contact_push_takes in
 * math/contact.h): velocities follow the overlap down, and nothing is left of them. That is so where no push takes more
 * than all of gravity, nor do those that add up on the way from the ground: all of an island's, over the number of
 * pairs that it stands on. Heaps, where nearly everything overlaps a little, are solved once. Islands with constraints
 * given by rows are, too. In double; which islands, and what they move by (model/push_law.h), depends on no threads.
 *
 * Backends that make whole steps do the same by themselves. */
#ifndef SADMM_CORE_SOLVE_PUSH_H
#define SADMM_CORE_SOLVE_PUSH_H

#include "kernels.h"
#include "plan.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_push;

/* NULL: no memory. */
struct sadmm_push *sadmm_push_create(void);
void sadmm_push_destroy(struct sadmm_push *push);

/* Before the step's problem is solved: which islands have two. Their points get the `error` that makes e_0 of e_1, all
 * of the system's have 0 before; system->islands is set. Errors: OUT_OF_MEMORY. */
sadmm_status sadmm_push_choose(struct sadmm_push *push, struct sadmm_system *system,
                               const struct sadmm_settings *settings, int threads, struct sadmm_error *error);

/* Bodies that are pushed in this step. */
int32_t sadmm_push_count(const struct sadmm_push *push);

/* Those of the second problem. */
struct sadmm_settings sadmm_push_settings(const struct sadmm_settings *step);

/* After it: the second problem, from the solution of the first one. contact_rows: of the step's plan. */
sadmm_status sadmm_push_solve(struct sadmm_push *push, const struct sadmm_kernels *kernels, int device,
                              const struct sadmm_system *system, int contact_rows,
                              const struct sadmm_settings *settings, struct sadmm_error *error);

/* The bodies (system->body_count) after the step, by what they are pushed. */
void sadmm_push_move(const struct sadmm_push *push, double dt, struct sadmm_rigid *next);

#ifdef __cplusplus
}
#endif
#endif
