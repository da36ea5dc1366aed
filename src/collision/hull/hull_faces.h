/* From points to the faces of their hull, by qhull (qhull.org). */
#ifndef SADMM_COLLISION_HULL_HULL_FACES_H
#define SADMM_COLLISION_HULL_HULL_FACES_H

#include "hull_mesh.h"

enum hull_faces_are {
    HULL_FACES_FOUND,
    HULL_FACES_NOT_FOUND,
    HULL_FACES_TOO_MANY,
    HULL_FACES_NO_MEMORY,
    HULL_FACES_UNAVAILABLE /* a library without qhull */
};

/* Add the faces of the hull of `count` points (3 numbers each, about 1 in size) to an empty mesh, with points as
 * corners. Those flat to within `flat`, in the unit of the points, are joined; where that is 0, those that rounding
 * bends. TOO_MANY: more than `most` points would be corners before faces are joined; 0: any number. Does not print and
 * does not exit, whatever qhull finds. Not the same faces for the points in another order. */
enum hull_faces_are sadmm_hull_faces_find(const double *points, int32_t count, double flat, int32_t most,
                                          struct hull_mesh *mesh);

#endif
