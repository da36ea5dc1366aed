/* Collision detection on the host: broad phase (FCL, or sort and sweep), pair manifolds, matching with the last step.
 *
 * The result does not depend on the order in which a broad phase finds pairs: pairs come out sorted by
 * (shape_a, shape_b, subshape), where a is the shape of the lower (type, slot) and the normal runs from a to b. Two
 * shapes have a pair for each of their manifolds.
 */
#ifndef SADMM_COLLISION_COLLISION_H
#define SADMM_COLLISION_COLLISION_H

#include "collision/find/check_shape.h"
#include "collision/shapes/input.h"
#include "core/base/contact_set.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_broad_phase_kind;
struct sadmm_collision;
sadmm_status sadmm_collision_create(struct sadmm_collision **out, struct sadmm_error *error);
/* The same with a broad phase of choice (broad/broad_phase.h), and the one that it has otherwise. */
sadmm_status sadmm_collision_create_with(const struct sadmm_broad_phase_kind *kind, struct sadmm_collision **out,
                                         struct sadmm_error *error);
const struct sadmm_broad_phase_kind *sadmm_broad_phase_default(void);
void sadmm_collision_destroy(struct sadmm_collision *collision);

/* Find all contacts. On entry `contacts` holds the previous step's set (with its impulses and caches; points of a new
 * pair or feature start with impulse 0); on success it holds the new one. On failure it is unchanged. */
sadmm_status sadmm_collision_find(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                  struct sadmm_contact_set *contacts, struct sadmm_error *error);

/* The same for a later sub-step of the step that the last sadmm_collision_find was for: what an undo puts back stays
 * the set from before the step. */
sadmm_status sadmm_collision_find_again(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                        struct sadmm_contact_set *contacts, struct sadmm_error *error);

/* Put back the set that the last successful sadmm_collision_find replaced, impulses and caches included (the pipeline
 * keeps it until the next find), so that a step that fails later leaves no trace. Does nothing when the last find
 * failed or was undone already. */
void sadmm_collision_undo(struct sadmm_collision *collision, struct sadmm_contact_set *contacts);

/* Candidates of the step, for hits (flight/swept_bodies.h); sadmm_collision_find then does not search for them
 * again. */
sadmm_status sadmm_collision_find_candidates(struct sadmm_collision *collision,
                                             const struct sadmm_collision_input *input, struct sadmm_error *error);

/* Bodies have other velocities since: sadmm_collision_find finds candidates itself. */
void sadmm_collision_drop_candidates(struct sadmm_collision *collision);

/* "fcl" or "sweep". */
const char *sadmm_collision_broad_phase_name(void);

#ifdef __cplusplus
}
#endif
#endif
