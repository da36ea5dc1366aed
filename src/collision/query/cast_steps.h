/* The distance of two convex bodies is a convex function of the way that one of them moves: Newton's steps from where
 * it begins come to where they touch, and never beyond. It falls by the way times the way's share along the normal;
 * once it does not fall, it never will. */
#ifndef SADMM_COLLISION_QUERY_CAST_STEPS_H
#define SADMM_COLLISION_QUERY_CAST_STEPS_H

#include <stdbool.h>

#include "collision/base/bounds.h"
#include "separation.h"

/* Distances are exact to 1e-12 of the size: what is nearer touches. */
#define SADMM_CAST_TOUCH 4e-12

/* What touches where it begins is moved into if it moves by more than this share of its way along the normal. A
 * triangle that is met from its front faces the way by as much. */
#define SADMM_CAST_GRAZES 1e-9

/* Does a box that moves by `limit` along d meet another one? *enter: not before it has moved so far. */
bool sadmm_cast_meets(const struct sadmm_box3 *moving, const double d[3], const struct sadmm_box3 *other, double limit,
                      double *enter);

/* Newton's steps. apart: what is apart after a way, as `separation`; size: what it is exact to 1e-12 of, besides the
 * way. */
typedef bool sadmm_cast_apart(const void *pair, double way, struct sadmm_separation *separation);
bool sadmm_cast_go(sadmm_cast_apart *apart, const void *pair, vec3 direction, double size, double enter, double limit,
                   double *way, struct sadmm_separation *separation);

#endif
