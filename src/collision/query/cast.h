/* How far a shape moves along a line, without turning, until it touches another.
 *
 *   cast.c        along any shape but a mesh
 *   cast_mesh.c   along the triangles of a mesh
 *   cast_steps.c  Newton's steps to where two convex bodies touch
 */
#ifndef SADMM_COLLISION_QUERY_CAST_H
#define SADMM_COLLISION_QUERY_CAST_H

#include "cast_mesh.h"

/* False: it does not touch it within `limit` (m, may be infinite). */
bool sadmm_cast_shape(const struct sadmm_cast *cast, const struct sadmm_placed *other, double limit,
                      struct sadmm_cast_find *find);

#endif
