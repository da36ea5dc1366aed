/* Articulations, bodies connected by constraint rows, and their block direct solve: the method's Step 1 when such
 * bodies are one subsystem.
 *
 * An iteration brings a load along one joint at a time; a chain of a hundred links that holds a thousand times its own
 * weight would take tens of thousands of them. So before the first iteration and after the last one of a world's step
 * velocities and multipliers of the rows are those that solve
 *
 *     (A + C) dv - J^T dlambda = b - A v + J^T lambda + J_c^T lambda_c        every body with rows
 *     gain J (v + dv) + bias + compliance (lambda + dlambda) = 0              every row inside its bounds
 *                             (hard ones: ARTICULATION_REGULARISATION at first, refined where that leaves much)
 *
 * with the contacts' impulses lambda_c as they are, and C = sum B J_c^T J_c over the contacts that press, B the mass
 * that rests on each (math/weight.h). A row whose multiplier leaves its bounds stays at the bound; one that is there
 * against its law is released. Where everything is solved already nothing changes: a solution stays what it is. Islands
 * under rows alone end at their solution whatever the iterations.
 *
 * dlambda by a sparse factor L D L^T of J (A + C)^-1 J^T, a block a constraint, in an order of least degree. In
 * double. */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_H
#define SADMM_CORE_SOLVE_ARTICULATION_H

#include "core/base/error.h"
#include "core/model/system.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_articulations;

/* NULL: no memory. */
struct sadmm_articulations *sadmm_articulations_create(void);
void sadmm_articulations_destroy(struct sadmm_articulations *articulations);

/* Constraints at one body; a part with more of them is left to the iteration, since all are coupled to each other. */
enum { SADMM_ARTICULATION_AROUND = 64 };

/* A step, or sub-step, begins: nothing of the last one is kept, however that ended. */
void sadmm_articulations_begin(struct sadmm_articulations *articulations);

/* system->velocity and the multipliers of system->rows, in place. slots: constraints of these rows, in an order that
 * stays from step to step, so that the factor's does, too: one may have no rows at the time, but has the bodies that it
 * connects when it has. What does not fit the block direct solve is left as it is. stiffened: NULL, or bodies (of the
 * system) whose stiffening has changed since a call before the iterations: parts without any are left as they are.
 * after: the iterations have come; parts without contacts then get back what they had before these, which is their
 * solution. Contacts are then those of that call. Errors: OUT_OF_MEMORY, nothing has changed. */
sadmm_status sadmm_articulations_solve(struct sadmm_articulations *articulations, const struct sadmm_system *system,
                                       const struct sadmm_row_constraint *slots, size_t slot_count,
                                       const struct sadmm_settings *settings, const uint8_t *stiffened, bool after,
                                       struct sadmm_error *error);

/* There are none in this system. Errors: OUT_OF_MEMORY. */
sadmm_status sadmm_articulations_find_none(struct sadmm_articulations *articulations, const struct sadmm_system *system,
                                           struct sadmm_error *error);

/* Has any part a loop (core/model/articulation.h)? */
bool sadmm_articulations_has_loops(const struct sadmm_articulations *articulations);

/* articulation_left of rows of parts with loops, as they were solved last; of others `left` stays what it is. slots: as
 * above. */
void sadmm_articulations_find_left(const struct sadmm_articulations *articulations,
                                   const struct sadmm_row_constraint *slots, double *left);

/* Marks all bodies (of the system) of parts that have a marked one. */
void sadmm_articulations_mark_parts(const struct sadmm_articulations *articulations, uint8_t *bodies);

/* Moves `bodies` (what the step has made of the system's), of parts that have one of `opened`, by the least
 * displacements, weighed by A, that take away the errors (biases) of system->rows, which are hard. speeds: velocities
 * are changed instead of poses, by the least that gives the rows the rates that biases ask for. Parts that cannot be
 * solved stay. slots: as above. Errors: OUT_OF_MEMORY. */
sadmm_status sadmm_articulations_close(struct sadmm_articulations *articulations, const struct sadmm_system *system,
                                       const struct sadmm_row_constraint *slots, size_t slot_count,
                                       const struct sadmm_settings *settings, const uint8_t *opened, bool speeds,
                                       struct sadmm_rigid *bodies, struct sadmm_error *error);

#ifdef __cplusplus
}
#endif
#endif
