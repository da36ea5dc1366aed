/* Bodies joined by constraint rows, solved directly: what the method's Step 1 is when such bodies are one subsystem.
 *
 * An iteration brings a load along one joint at a time; a chain of a hundred links that holds a thousand times its own
 * weight would take tens of thousands of them. So before the first iteration and after the last one of a world's step
 * velocities and multipliers of the rows are those that solve
 *
 *     (A + C) dv - J^T dlambda = b - A v + J^T lambda + J_c^T lambda_c        every body with rows
 *     gain J (v + dv) + bias + compliance (lambda + dlambda) = 0              every row inside its bounds
 *                             (hard ones: JOINED_GIVE at first, and once more for what they give by where that is much)
 *
 * with the contacts' impulses lambda_c as they are, and C = sum B J_c^T J_c over the contacts that press, B the mass
 * that rests on each (math/weight.h). A row whose multiplier leaves its bounds stays at the bound; one that is held
 * there against its law is let go. Where everything holds already nothing changes: a solution stays what it is. Islands
 * under rows alone end at their solution whatever the iterations.
 *
 * dlambda by a sparse factor L D L^T of J (A + C)^-1 J^T, a block a constraint, in an order of least degree. In
 * double. */
#ifndef SADMM_CORE_SOLVE_JOINED_H
#define SADMM_CORE_SOLVE_JOINED_H

#include "core/base/error.h"
#include "core/model/system.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_joined;

/* NULL: no memory. */
struct sadmm_joined *sadmm_joined_create(void);
void sadmm_joined_destroy(struct sadmm_joined *joined);

/* Constraints at one body; a part with more of them is left to the iteration, since all are coupled to each other. */
enum { SADMM_JOINED_AROUND = 64 };

/* A step, or sub-step, begins: nothing of the last one is kept, however that ended. */
void sadmm_joined_begin(struct sadmm_joined *joined);

/* system->velocity and the multipliers of system->rows, in place. slots: constraints of these rows, at places that stay
 * from step to step, so that the order does, too: one may have no rows at the time, but has the bodies that it joins
 * when it has. What does not fit a direct solve is left as it is.
 * stiffened: NULL, or bodies (of the system) whose stiffening has changed since a call before the iterations: parts
 * without any are left as they are.
 * after: the iterations have come; parts without contacts then get back what they had before these, which is their
 * solution. Contacts are then those of that call.
 * Errors: OUT_OF_MEMORY, nothing has changed. */
sadmm_status sadmm_joined_solve(struct sadmm_joined *joined, const struct sadmm_system *system,
                                const struct sadmm_row_constraint *slots, size_t slot_count,
                                const struct sadmm_settings *settings, const uint8_t *stiffened, bool after,
                                struct sadmm_error *error);

/* Has any part a loop (core/model/joined.h)? */
bool sadmm_joined_has_loops(const struct sadmm_joined *joined);

/* joined_left of rows of parts with loops, as they were solved last; of others `left` stays what it is. slots: as above. */
void sadmm_joined_find_left(const struct sadmm_joined *joined, const struct sadmm_row_constraint *slots, double *left);

/* Marks all bodies (of the system) of parts that have a marked one. */
void sadmm_joined_mark_parts(const struct sadmm_joined *joined, uint8_t *bodies);

/* Moves `bodies` (what the step has made of the system's), of parts that have one of `opened`, by the least displacements,
 * weighed by A, that take away the errors (biases) of system->rows, which are hard. speeds: not places but velocities are
 * changed, by the least that gives the rows the rates that biases ask for. Parts that cannot be solved stay.
 * slots: as above. Errors: OUT_OF_MEMORY. */
sadmm_status sadmm_joined_close(struct sadmm_joined *joined, const struct sadmm_system *system,
                                const struct sadmm_row_constraint *slots, size_t slot_count,
                                const struct sadmm_settings *settings, const uint8_t *opened, bool speeds,
                                struct sadmm_rigid *bodies, struct sadmm_error *error);

#ifdef __cplusplus
}
#endif
#endif
