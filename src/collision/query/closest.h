/* How far two shapes are apart, or how deep in each other, with the points where that is.
 *
 *   closest.c        any two: planes, rounds by formula, polytopes by gjk.h and epa.h, smooth ones by convex_axis.h
 *   closest_mesh.c   with the triangles of a mesh
 */
#ifndef SADMM_COLLISION_QUERY_CLOSEST_H
#define SADMM_COLLISION_QUERY_CLOSEST_H

#include <stdbool.h>

#include "collision/shapes/placed.h"
#include "separation.h"

/* Of the two types, in either order? Two planes and two meshes have no distance. */
bool sadmm_closest_is_known(int type_a, int type_b);
/* False: they are farther apart than `limit` (m, >= 0), which may be infinite. */
bool sadmm_closest(const struct sadmm_placed *a, const struct sadmm_placed *b, double limit,
                   struct sadmm_separation *separation);

#endif
