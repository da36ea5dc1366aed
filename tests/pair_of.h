/* Two shapes with poses, and the shape data of their hulls. */
#ifndef SADMM_TESTS_PAIR_OF_H
#define SADMM_TESTS_PAIR_OF_H

#include "hull_shapes.h"
#include "manifold_tools.h"

/* h: of a hull, or as a hull would be. */
struct pair_of {
    struct test_shape_data *shape_data;
    struct test_hull h[2];
    struct sadmm_geometry g[2];
    double R[2][9], x[2][3];
};

static inline struct pair_pose pair_of_pose(const struct pair_of *t)
{
    return pair_pose(false, t->R[0], t->x[0], t->R[1], t->x[1]);
}

#endif
