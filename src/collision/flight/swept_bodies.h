/* Which shapes a step's hits may be between: candidates of contact finding before their manifolds, and what else a body
 * comes near once a hit has changed its way. */
#ifndef SADMM_COLLISION_FLIGHT_SWEPT_BODIES_H
#define SADMM_COLLISION_FLIGHT_SWEPT_BODIES_H

#include "collision/base/bounds.h"
#include "collision/collision.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a body is to hits, by world body slot. */
enum sadmm_swept_kind { SADMM_SWEPT_NONE, SADMM_SWEPT_FIXED, SADMM_SWEPT_DYNAMIC };

struct sadmm_pair_list;
struct sadmm_rigid;

/* Bodies that a contact of the last set presses on become SADMM_SWEPT_NONE. bodies: the system's. After
 * find_candidates. */
void sadmm_collision_mark_pressed(const struct sadmm_collision *collision, const struct sadmm_contact_set *contacts,
                                  const struct sadmm_rigid *bodies, unsigned char *kinds);

/* The pairs of shapes, as (a << 32 | b) in the order of pairs, that approach faster than the threshold, at least as far
 * as their velocities and boxes show, and of which either has restitution (bounces: any shape has), or which pass
 * (fast_pair.h): other pairs come as far as the surface in the step in which they are found, as the solve has it. After
 * find_candidates. False: out of memory. */
bool sadmm_collision_list_fast(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                               double threshold, bool bounces, struct sadmm_pair_list *list);
/* Are they a dynamic body and another one that the solve might let through each other? Their way within the step is
 * longer than what moves of them is thick. */
bool sadmm_collision_passes(const struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                            uint64_t key);

/* Do both of a pair take part, one of them at least as a dynamic body? */
bool sadmm_collision_may_hit(const struct sadmm_collision *collision, const unsigned char *kinds, uint64_t key);

/* What its contacts have in common. */
void sadmm_collision_pair_law(const struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                              uint64_t key, double *friction, double *restitution);

/* A shape has another box from now on, the one that it sweeps from a hit on. False: out of memory. */
bool sadmm_collision_set_box(struct sadmm_collision *collision, uint32_t slot, const struct sadmm_box3 *swept);
/* The shapes of swept bodies whose boxes meet that of a shape, after set_box of it, as list_fast gives pairs, in any
 * order. */
bool sadmm_collision_list_near(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                               const unsigned char *kinds, uint32_t slot, struct sadmm_pair_list *list);

#ifdef __cplusplus
}
#endif
#endif
