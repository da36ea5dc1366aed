/* The distance of a shape from a mesh. */
#ifndef SADMM_COLLISION_QUERY_CLOSEST_MESH_H
#define SADMM_COLLISION_QUERY_CLOSEST_MESH_H

#include <stdbool.h>

#include "collision/shapes/placed.h"
#include "separation.h"

/* a in the frame of b: p_b = R p_a + t. */
struct closest_pose {
    mat3 R;
    vec3 t;
};
struct closest_pose sadmm_closest_pose(const struct sadmm_placed *a, const struct sadmm_placed *b);
/* Around a, in the frame of b; rounding makes it larger. */
void sadmm_closest_box(const struct sadmm_placed *a, const struct closest_pose *pose, struct sadmm_box3 *box);
/* a: not a plane; b: a mesh. In the frame of b. */
bool sadmm_closest_on_mesh(const struct sadmm_placed *a, const struct sadmm_placed *b, const struct closest_pose *pose,
                           double limit, struct sadmm_separation *separation);

/* The same of one triangle of it. */
struct mesh_triangle;
bool sadmm_closest_on_triangle(const struct sadmm_placed *a, const struct closest_pose *pose,
                               const struct mesh_triangle *triangle, double limit, struct sadmm_separation *separation);

#endif
