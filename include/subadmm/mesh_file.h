/* Mesh files: the vertices and triangles of OBJ, STL (text and binary) and PLY (text and binary of either byte order)
 * files, for convex hulls (hull.h) and for whatever else takes points or triangles.
 *
 * What is read never changes: any number of threads may look at it at the same time. The same bytes give the same
 * vertices and triangles, in the same order, on every machine and in every locale. The readers are strict: what is no
 * file of its format is refused, with a message that names the file and the line (the number of the vertex or face in
 * binary files), and what is left out of a good one is counted.
 *
 * What is read of each format:
 *
 *   OBJ  v (its first three numbers) and f. Faces name vertices before them, from 1 or, negative, from the last one
 *        back. All objects and groups together make one mesh, unless one is asked for by name. Normals, texture
 *        coordinates, colours, materials and smoothing are passed over, and no other file is opened; p, l, curv, curv2
 *        and surf are counted. A # begins a comment, a backslash at its end joins a line to the next. Files that call
 *        others or commands (call, csh) are refused.
 *   STL  All solids together make one mesh. Normals and colours are passed over: the order of the corners says what is
 *        outside. A file of 84 + 50 x (its number at byte 80) bytes is binary; others begin with "solid".
 *   PLY  Of element vertex the properties x, y and z, of any type; of element face the list vertex_indices or
 *        vertex_index. Other properties are passed over; rows of edge and of other elements are counted. Text files
 *        have one row a line. Triangle strips are refused.
 *
 * Errors are returned as a status; the message is sadmm_last_message.
 */
#ifndef SUBADMM_MESH_FILE_H
#define SUBADMM_MESH_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_mesh_file sadmm_mesh_file;

typedef enum sadmm_mesh_file_format {
    SADMM_MESH_FILE_ANY = 0, /* by the end of the path (.obj, .stl, .ply, in capitals too), or else by the bytes: "ply"
                                and the end of a line, "solid" or the size of a binary STL file, or else OBJ */
    SADMM_MESH_FILE_OBJ,
    SADMM_MESH_FILE_STL,
    SADMM_MESH_FILE_PLY,
    SADMM_MESH_FILE_FORMAT_COUNT
} sadmm_mesh_file_format;

typedef struct sadmm_mesh_file_def {
    const char *path;              /* the file, or NULL: `bytes` are its content. Default NULL */
    const void *bytes;             /* only read while the call lasts; NULL where there is a path. Default NULL */
    size_t size;                   /* of `bytes`, > 0 with them and 0 without; default 0 */
    sadmm_mesh_file_format format; /* default SADMM_MESH_FILE_ANY */
    double scale;         /* m a unit of the file (0.001: the file is in millimetres), in [1e-9, 1e9]; default 1 */
    const char *object;   /* OBJ only: the faces below an "o" line, or a "g" line since the last "o" line, that has
                             this name among its words, and no others; one word. NULL: all. Default NULL */
    bool merge;           /* vertices that are equal bit for bit become one, the first of them; STL files have three
                             vertices for every triangle. Default true */
    bool drop_degenerate; /* leave triangles out that are no higher than 1e-12 of their longest edge, and those
                             with a corner twice; they are counted in any case. Default true */
} sadmm_mesh_file_def;

/* The defaults named above. Thread-safe. */
SADMM_API sadmm_mesh_file_def sadmm_mesh_file_def_default(void);

/* *out: what the file holds, which belongs to the caller until sadmm_mesh_file_destroy; NULL after an error.
 * Thread-safe. Takes some ten times the file's size of memory (forty at worst: one byte a number) and time in
 * proportion to it.
 * Errors: INVALID_ARGUMENT (range; what is no file of its format: the message says where; a coordinate that is not
 * finite or, after scaling, not in [-1e6, 1e6] m; a face of vertices that are not there; no triangle), IO (a file that
 * cannot be read, is a folder or another special file, or is empty), UNSUPPORTED (OBJ: call, csh; PLY: triangle strips,
 * a version other than 1.0), LIMIT (more than 2^29 vertices, or than 3 x 2^29 corners of faces; a face of more than
 * 1024 corners that is not convex), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_mesh_file_read(const sadmm_mesh_file_def *def, sadmm_mesh_file **out);
/* NULL is fine. Thread-safe, once. */
SADMM_API void sadmm_mesh_file_destroy(sadmm_mesh_file *file);

/* All of the following only read what was read, and may run on any number of threads at once. */

/* Of NULL: 0. At least 3 and 1 of others (2 vertices or fewer only where degenerate triangles are kept). */
SADMM_API int32_t sadmm_mesh_file_vertex_count(const sadmm_mesh_file *file);
SADMM_API int32_t sadmm_mesh_file_triangle_count(const sadmm_mesh_file *file);

/* 3 numbers each, m, each in [-1e6, 1e6], no -0: those that triangles use, in the order of the file. Of NULL: NULL.
 * Valid as long as the file. */
SADMM_API const double *sadmm_mesh_file_vertices(const sadmm_mesh_file *file);

/* 3 vertices each, in [0, vertex_count), in the order of the file's faces and with their winding. A face of more than
 * three corners a0 a1 a2 ... becomes triangles one after the other: a convex one the fan a0 a1 a2, a0 a2 a3, ...; of
 * others ears are cut off, in the order of the corners, as seen along the axis that the face points along most. So one
 * that is not convex gets no triangle outside of it. Of NULL: NULL. Valid as long as the file. */
SADMM_API const int32_t *sadmm_mesh_file_triangles(const sadmm_mesh_file *file);

/* What was in the file, and what became of it:
 * vertices = vertex_count + merged_vertices + unused_vertices */
typedef struct sadmm_mesh_file_info {
    sadmm_mesh_file_format format;
    bool binary;
    int64_t vertices;
    int64_t merged_vertices;      /* equal to one before them */
    int64_t unused_vertices;      /* left out: no triangle has them */
    int64_t faces;                /* of three corners or more, of the object asked for: these are the triangles */
    int64_t split_faces;          /* of them, those of more than three corners */
    int64_t crossing_faces;       /* of those, the ones that are flat as a line, or whose outline crosses or touches
                                     itself: no split has their shape, and they were split all the same */
    int64_t degenerate_triangles; /* see drop_degenerate */
    int64_t short_faces;          /* left out: fewer than three corners */
    int64_t other_faces;          /* left out: of objects that were not asked for */
    int64_t points, lines;        /* left out: OBJ's p and l, PLY's edges */
    int64_t others;               /* left out: OBJ's curv, curv2 and surf, rows of PLY's other elements */
} sadmm_mesh_file_info;

/* Errors: INVALID_ARGUMENT (NULL). */
SADMM_API sadmm_status sadmm_mesh_file_describe(const sadmm_mesh_file *file, sadmm_mesh_file_info *info);

#ifdef __cplusplus
}
#endif
#endif
