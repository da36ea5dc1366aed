/* A ray against what has an inside. */
#ifndef SADMM_COLLISION_QUERY_RAY_SOLID_H
#define SADMM_COLLISION_QUERY_RAY_SOLID_H

#include <stdbool.h>

#include "collision/shapes/geometry.h"
#include "ray_line.h"

/* The stretch of a line that is in a solid. */
struct ray_span {
    double in, out;
    vec3 normal; /* outward where it enters */
};

/* False: the line does not meet it. `line`: x is near where the line is nearest to the shape's origin. Not of planes
 * and meshes. */
bool sadmm_ray_span(const struct sadmm_geometry *geometry, const double *blocks, const struct ray_line *line,
                    struct ray_span *span);

#endif
