/* A ray against triangle meshes and heightfields. */
#ifndef SADMM_COLLISION_QUERY_RAY_MESH_H
#define SADMM_COLLISION_QUERY_RAY_MESH_H

#include <stdbool.h>
#include <stdint.h>

#include "ray_line.h"

/* The nearest triangle within the limit, -1: there is none. */
int32_t sadmm_ray_mesh(const double *blocks, uint32_t at, const struct ray_line *line, double limit, bool from_behind,
                       double *distance, vec3 *normal);

#endif
