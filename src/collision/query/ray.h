/* A ray against a shape: where it enters.
 *
 *   ray.c         one function for all types, in the world
 *   ray_solid.c   what has a formula of its own, and hulls: the stretch of the line that is in the solid
 *   ray_mesh.c    triangle meshes and heightfields
 */
#ifndef SADMM_COLLISION_QUERY_RAY_H
#define SADMM_COLLISION_QUERY_RAY_H

#include <stdbool.h>

#include "collision/shapes/placed.h"

struct sadmm_ray_line {
    double origin[3], direction[3]; /* unit */
    double length;                  /* m; may be infinite */
    bool from_inside;               /* what the origin is in counts, at distance 0 */
    bool from_behind;               /* triangles count from behind as well */
};

struct sadmm_ray_find {
    double distance;  /* m */
    double normal[3]; /* unit, outward, world */
    int32_t triangle; /* of a mesh; else -1 */
    bool inside;      /* the origin is in the solid */
};

/* False: the ray does not meet the shape within `limit` (m, at most the ray's length). */
bool sadmm_ray_cast(const struct sadmm_ray_line *ray, const struct sadmm_placed *shape, double limit,
                    struct sadmm_ray_find *find);

#endif
