/* A ray in the frame of a shape. */
#ifndef SADMM_COLLISION_QUERY_RAY_LINE_H
#define SADMM_COLLISION_QUERY_RAY_LINE_H

#include "core/math/vec3.h"

/* The line x + t d, d unit. */
struct ray_line {
    vec3 x, d;
};

#endif
