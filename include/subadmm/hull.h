/* Convex hulls of points, a shape for bodies (SADMM_SHAPE_HULL, world.h), with sharp or round edges.
 *
 * A hull is made once and never changes. Any number of worlds and threads may use it at the same time; it is freed when
 * its creator and every world with shapes of it have released it. The same points give the same hull to the last bit,
 * in any order; only the numbering of the vertices follows the order of the points.
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
    size_t struct_size;   /* set by sadmm_hull_def_default() */
    const double *points; /* 3 numbers a point, m, each in [-1e6, 1e6]; in any frame and order; repeated points and
                             points inside have no effect. Only read while the hull is made. No default */
    size_t point_count;   /* in [4, 1e6]; no default */
    double merge;         /* neighbouring faces that are flat to within this share of the largest extent of the points
                             become one face, and points that stand out by no more than that are dropped; at most 1/20
                             of the smallest thickness of the points. In [0, 1e-2]; 0: only what rounding bends; default
                             1e-6. If merged faces do not make a convex polyhedron, fewer are merged */
    double convex_radius; /* m, in [0, 1e6]; default 0. The shape is the Minkowski sum of the polyhedron and a ball of
                             this radius: faces move outward by it, edges and corners become round. A box with round
                             edges is the hull of 8 points, each inset from the box by this radius */
} sadmm_hull_def;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_hull_def_init(sadmm_hull_def *def, size_t size);
static inline sadmm_hull_def sadmm_hull_def_default(void)
{
    sadmm_hull_def def;
    sadmm_hull_def_init(&def, sizeof def);
    return def;
}

/* *out: the hull, which belongs to the caller until sadmm_hull_destroy; NULL after an error. Thread-safe.
 * Errors: INVALID_ARGUMENT (range; points that lie in one point, line or plane to within 1e-6 of their largest extent,
 * or 1e-6 m; no convex polyhedron was found), LIMIT (more than 8192 vertices or 32767 edges), OUT_OF_MEMORY,
 * UNAVAILABLE (a library built without qhull). */
SADMM_API sadmm_status sadmm_hull_create(const sadmm_hull_def *def, sadmm_hull **out);
/* Release the caller's reference; NULL is fine. Worlds with shapes of the hull keep it. Thread-safe; call once. */
SADMM_API void sadmm_hull_destroy(sadmm_hull *hull);

/* All of the following only read the hull, and may run on any number of threads at once. */

/* Of NULL: 0. vertices - edges + faces = 2. */
SADMM_API int32_t sadmm_hull_vertex_count(const sadmm_hull *hull);
SADMM_API int32_t sadmm_hull_edge_count(const sadmm_hull *hull);
SADMM_API int32_t sadmm_hull_face_count(const sadmm_hull *hull);

/* The vertices, 3 numbers each, m: the given points that are corners of the hull, bit for bit and in the given order.
 * NULL for NULL. Valid as long as the hull. */
SADMM_API const double *sadmm_hull_vertices(const sadmm_hull *hull);

/* The definition's rounding, m. Of NULL: 0. What the other functions return is the polyhedron inside. */
SADMM_API double sadmm_hull_convex_radius(const sadmm_hull *hull);
/* `merge` of the definition; 0 for NULL. With it the vertices make the same hull again, bit for bit. */
SADMM_API double sadmm_hull_merge(const sadmm_hull *hull);

typedef struct sadmm_hull_face {
    int32_t corner_count;   /* >= 3 */
    const int32_t *corners; /* vertices, counter-clockwise seen from outside, the lowest first; valid as long as the
                               hull */
    double normal[3];       /* unit, outward, in the frame of the points */
    double offset;          /* m: the largest normal . corner. The hull is the set with normal . x <= offset for every
                               face, up to what merging has flattened */
} sadmm_hull_face;

/* A face, `face` in [0, face_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_hull_face_at(const sadmm_hull *hull, int32_t face, sadmm_hull_face *out);

#ifdef __cplusplus
}
#endif
#endif
