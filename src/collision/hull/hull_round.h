/* What the convex radius adds to a polyhedron's integrals. */
#ifndef SADMM_COLLISION_HULL_HULL_ROUND_H
#define SADMM_COLLISION_HULL_HULL_ROUND_H

#include "core/math/vec3.h"
#include "hull_mesh.h"

struct hull_integrals {
    double volume, first[3], second[3][3]; /* of 1, x, x x^T; of `second` the lower triangle, until it is complete */
};

/* Add to `sum` what is within r of the polyhedron and outside of it. Vertices 3 numbers each, planes 4 a face; x is
 * measured from `origin`, along the columns of `axes`. */
void sadmm_hull_add_round(const struct hull_mesh *mesh, const double *vertices, const double *planes, double r,
                          vec3 origin, mat3 axes, struct hull_integrals *sum);

#endif
