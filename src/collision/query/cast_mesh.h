/* How far a shape moves until it touches a mesh. */
#ifndef SADMM_COLLISION_QUERY_CAST_MESH_H
#define SADMM_COLLISION_QUERY_CAST_MESH_H

#include <stdbool.h>

#include "collision/shapes/placed.h"
#include "separation.h"

struct sadmm_cast {
    const struct sadmm_placed *shape; /* no plane, no mesh */
    struct sadmm_box3 box;            /* around it, where it begins */
    double direction[3];              /* unit, world */
    bool from_inside, from_behind;    /* sadmm_query_filter */
};

struct sadmm_cast_find {
    double distance; /* m */
    vec3 normal;     /* unit, from the shape that moves to the other */
    vec3 point;      /* of the other */
    int32_t triangle;
    bool inside;     /* they overlap where it begins: distance is 0 */
};

/* Of a mesh, whose surface it does not overlap where it begins. */
bool sadmm_cast_on_mesh(const struct sadmm_cast *cast, const struct sadmm_placed *mesh, double limit,
                        struct sadmm_cast_find *find);

#endif
