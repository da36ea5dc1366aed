/* Convex hulls: the polyhedron around a set of points, a shape for bodies (SADMM_SHAPE_HULL, world.h), with sharp edges or
 * round ones.
 *
 * A hull is made once and never changes. Any number of worlds and threads may use it at the same time; it lives until
 * its maker and every world with shapes of it have let go of it. The same points give the same hull to the last bit, in
 * whatever order they come, but for the numbers of its vertices, which go by the order of the points.
 *
 * Errors are returned as a status; the message is sadmm_last_message.
 */
#ifndef SUBADMM_HULL_H
#define SUBADMM_HULL_H

#include <stddef.h>
#include <stdint.h>

#include "status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_hull sadmm_hull;

typedef struct sadmm_hull_def {
    const double *points; /* 3 numbers a point, m, each in [-1e6, 1e6]; in any frame, order and number of repetitions;
                             those inside do nothing. Only read while the hull is made. No default */
    size_t point_count;   /* in [4, 1e6]; no default */
    double merge;         /* neighbouring faces that are flat to within this share of the largest extent of the points
                             become one face, and points that stand out from it by no more than that are no vertices;
                             never more than 1/20 of how thick the points lie. In [0, 1e-2]; 0: what rounding alone
                             bends; default 1e-6. Where the joined faces make no convex polyhedron, fewer are joined */
    double rounding;      /* m, in [0, 1e6]; default 0: the shape is the set of all that is within this of the polyhedron,
                             its Minkowski sum with a ball. Faces move outward by it, edges and corners are round. A box
                             with round edges is the hull of 8 points, each this much inside of the box */
} sadmm_hull_def;

/* The defaults named above. Thread-safe. */
SADMM_API sadmm_hull_def sadmm_hull_def_default(void);

/* *out: the hull, which belongs to the caller until sadmm_hull_destroy; NULL after an error. Thread-safe.
 * Errors: INVALID_ARGUMENT (range; points that are all within 1e-6 of the largest extent of one point, of a line or of
 * a plane, or within 1e-6 m of it; points that no convex polyhedron was found around), LIMIT (more than 8192 vertices
 * or 32767 edges), OUT_OF_MEMORY, UNAVAILABLE (a library built without qhull). */
SADMM_API sadmm_status sadmm_hull_create(const sadmm_hull_def *def, sadmm_hull **out);
/* Give up the caller's hold of the hull; NULL is fine. Worlds that have shapes of it keep it. Thread-safe, once. */
SADMM_API void sadmm_hull_destroy(sadmm_hull *hull);

/* All of the following only read the hull, and may run on any number of threads at once. */

/* Of NULL: 0. vertices - edges + faces = 2. */
SADMM_API int32_t sadmm_hull_vertex_count(const sadmm_hull *hull);
SADMM_API int32_t sadmm_hull_edge_count(const sadmm_hull *hull);
SADMM_API int32_t sadmm_hull_face_count(const sadmm_hull *hull);

/* The vertices, 3 numbers each, m: those of the points that are corners of the hull, bit for bit, in the order in which
 * they were given. Of NULL: NULL. Valid as long as the hull. */
SADMM_API const double *sadmm_hull_vertices(const sadmm_hull *hull);

/* The definition's rounding, m. Of NULL: 0. What the other functions return is the polyhedron inside. */
SADMM_API double sadmm_hull_rounding(const sadmm_hull *hull);
/* The definition's merge. Of NULL: 0. With it the vertices make the same hull again, bit for bit. */
SADMM_API double sadmm_hull_merge(const sadmm_hull *hull);

typedef struct sadmm_hull_face {
    int32_t corner_count;   /* >= 3 */
    const int32_t *corners; /* vertices, counter-clockwise seen from outside, the lowest first; valid as long as the
                               hull */
    double normal[3];       /* unit, outward, in the frame of the points */
    double offset;          /* m: the largest of normal . corner. The hull is where normal . x <= offset for every face,
                               to within what the faces were merged by */
} sadmm_hull_face;

/* A face, `face` in [0, face_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_hull_face_at(const sadmm_hull *hull, int32_t face, sadmm_hull_face *out);

#ifdef __cplusplus
}
#endif
#endif
