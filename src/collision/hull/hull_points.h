/* The points of a hull, made ready: distinct ones, in an order of their own, about the middle of them all. */
#ifndef SADMM_COLLISION_HULL_HULL_POINTS_H
#define SADMM_COLLISION_HULL_HULL_POINTS_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"

struct hull_point {
    double x[3];    /* less the middle, m */
    int32_t number; /* of the first one there among those given */
};

struct hull_points {
    struct hull_point *at; /* ascending by x, y, z: whatever order they came in */
    int32_t count;
    double middle[3];
    double extent; /* largest side of the box around them, m */
    double thickness; /* once they have been checked: how far they reach from a plane through three of them, m */
};

/* `given`: 3 numbers each, finite. OUT_OF_MEMORY. */
sadmm_status sadmm_hull_points_sort(struct hull_points *points, const double *given, size_t count,
                                    struct sadmm_error *error);
void sadmm_hull_points_free(struct hull_points *points);

/* INVALID_ARGUMENT that says how thin the points lie, where they lie within `share` of their extent, or within `least`
 * (m), of a point, of the line through two of them or of the plane through three. Else `thickness` is set. */
sadmm_status sadmm_hull_points_check(struct hull_points *points, double share, double least,
                                     struct sadmm_error *error);

#endif
