/* A convex hull (subadmm/hull.h) from the inside. Of C alone: its uses are counted by an atomic number.
 *
 *   hull.c           what callers see: checks of the points, attempts, queries
 *   hull_points.c    distinct points in an order of their own; how thin they lie
 *   hull_faces.c     qhull: points to faces
 *   hull_mesh.c      faces as loops of corners: are they a polyhedron; their order
 *   hull_measure.c   planes, volume, principal axes, the box around it
 *   hull_round.c     what the convex radius adds to the integrals
 *   hull_write.c     the block that contact finding reads (hull_data.h), and those that all shape data begins with
 *   hull_archive.c   a hull as bytes and back
 *
 * Contact finding works in the frame of a box around the hull, not in that of the points: its half extents are bounds
 * and sizes as a box's are. The axes of the box are those of the points, the principal axes of inertia, or those of the
 * largest face and its longest edge, whichever make it smallest (by more than 1 %); its centre is the origin.
 */
#ifndef SADMM_COLLISION_HULL_HULL_H
#define SADMM_COLLISION_HULL_HULL_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "subadmm/hull.h"

struct sadmm_hull {
    _Atomic uint32_t uses;  /* the maker's and the worlds' */
    int32_t vertex_count, edge_count, face_count;
    double *block;          /* hull_data.h */
    size_t doubles;         /* of the block */
    double merge;           /* as it was asked for */
    double convex_radius;   /* m; the vertices are those of the core */
    double half[3];         /* of the box around the hull, convex radius included, m */
    double position[3], orientation[4]; /* the block's frame in that of the points */
    double *vertices;       /* 3 each, as they were given */
    int32_t *face_first;    /* face_count + 1 */
    int32_t *corners;
    /* Of the solid: in the frame of the points, about the centre of mass. */
    double volume;          /* m^3 */
    double centre[3];
    double moments[3];      /* integrals of x^2, y^2, z^2 along the principal axes, m^5 */
    double axes[4];         /* principal axes to the frame of the points */
};

/* One more use; one less: the last one frees it. NULL is fine. Thread-safe. */
void sadmm_hull_retain(const sadmm_hull *hull);
void sadmm_hull_release(const sadmm_hull *hull);

/* Into an archive (core/base/archive.h), or out of it: a new hull, one use, to be released also after a failure unless
 * it is NULL. */
struct sadmm_archive;
void sadmm_hull_archive(struct sadmm_archive *archive, sadmm_hull **hull);

#endif
