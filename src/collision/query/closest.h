/* How far two shapes are apart, or how deep in each other, with the points where that is.
 *
 *   closest.c        any two: planes, rounds by formula, polytopes by gjk.h and epa.h, smooth ones by convex_axis.h
 *   closest_mesh.c   with the triangles of a mesh
 */
#ifndef SADMM_COLLISION_QUERY_CLOSEST_H
#define SADMM_COLLISION_QUERY_CLOSEST_H

#include <stdbool.h>

#include "collision/shapes/placed.h"
#include "core/math/vec3.h"

/* In the frame of the second shape, or of the world. */
struct sadmm_separation {
    double distance;  /* m; negative: the depth */
    vec3 normal;      /* unit, from the first to the second */
    vec3 a, b;        /* of either, b - a = distance normal */
    int32_t triangle; /* of a mesh, as its block numbers them; else -1 */
};

/* Of the two types, in either order? Two planes and two meshes have no distance. */
bool sadmm_closest_is_known(int type_a, int type_b);
/* False: they are farther apart than `limit` (m, >= 0), which may be infinite. */
bool sadmm_closest(const struct sadmm_placed *a, const struct sadmm_placed *b, double limit,
                   struct sadmm_separation *separation);

/* ---- for closest.c ---------------------------------------------------------------------------------------------- */

/* a in the frame of b: p_b = R p_a + t. */
struct closest_pose {
    mat3 R;
    vec3 t;
};
/* a: not a plane; b: a mesh. In the frame of b. */
bool sadmm_closest_on_mesh(const struct sadmm_placed *a, const struct sadmm_placed *b, const struct closest_pose *pose,
                           double limit, struct sadmm_separation *separation);

#endif
