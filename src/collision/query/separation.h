/* How far two shapes are apart, and where. */
#ifndef SADMM_COLLISION_QUERY_SEPARATION_H
#define SADMM_COLLISION_QUERY_SEPARATION_H

#include <stdint.h>

#include "core/math/vec3.h"

/* In the frame of the second shape, or of the world. */
struct sadmm_separation {
    double distance;  /* m; negative: the depth */
    vec3 normal;      /* unit, from the first to the second */
    vec3 a, b;        /* of either, b - a = distance normal */
    int32_t triangle; /* of a mesh, as its block numbers them; else -1 */
};

#endif
