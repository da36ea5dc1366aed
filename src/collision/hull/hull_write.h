/* The block of a hull (hull_data.h), written. */
#ifndef SADMM_COLLISION_HULL_HULL_WRITE_H
#define SADMM_COLLISION_HULL_HULL_WRITE_H

#include "hull_mesh.h"

/* Doubles that the block of a closed mesh takes, and the block: vertices 3 numbers each, planes 4 a face;
 * convex_radius: m. At most HULL_MOST_VERTICES vertices and HULL_MOST_EDGES edges. */
size_t sadmm_hull_data_doubles(const struct hull_mesh *mesh);
void sadmm_hull_data_write(const struct hull_mesh *mesh, const double *vertices, const double *planes,
                           double convex_radius, double *block);

/* The blocks that all shape data begins with, HULL_FIRST_OWN doubles. */
void sadmm_hull_prelude(double *data);

#endif
