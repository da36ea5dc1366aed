/* How deep solids overlap, measured from their poses alone: by separating axes and distances, in double, without the
 * library's contact finding, whose errors it is to show. */
#ifndef BENCH_OVERLAP_H
#define BENCH_OVERLAP_H

#include <stdbool.h>
#include <stddef.h>

#include "core/math/vec3.h"
#include "subadmm/world.h"

/* A box whose surface is moved out by a radius: a box has radius 0, a capsule is a segment along z, a sphere a point.
 * Or a half-space below the xy plane of its frame. */
struct solid {
    bool plane;
    double half[3], radius; /* m */
    vec3 centre;            /* m */
    vec3 axes[3];           /* unit, world */
    int body;               /* solids of one body do not overlap */
    bool fixed;             /* nor do two of bodies that nothing moves */
};

/* The solid of a shape, at the origin of the world. Not of hulls. */
struct solid solid_of_shape(const sadmm_shape_def *shape);
/* To a place in the world: the solid's frame at `position`, turned by the quaternion w x y z. */
void solid_place(struct solid *solid, const double position[3], const double orientation[4]);
/* Least extent, m; infinite for a half-space. */
double solid_thickness(const struct solid *solid);

/* The least distance that one of the two must be moved by to part them, m. Of solids that are apart: a number <= 0. */
double overlap_depth(const struct solid *a, const struct solid *b);

struct overlap {
    int a, b; /* indices of the solids, a < b */
    double depth; /* m, > 0 */
};

/* All pairs that overlap, by sweeping along x, and what the sweep keeps from call to call; starts zeroed. */
struct overlaps {
    struct overlap *pairs;
    size_t count;
    struct interval *intervals;
};

/* False: out of memory. */
bool overlaps_find(struct overlaps *overlaps, const struct solid *solids, int count);
void overlaps_free(struct overlaps *overlaps);

#endif
