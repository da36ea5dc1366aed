/* Mesh files: the vertices and triangles of OBJ, STL (text and binary) and PLY (text and binary of either byte order)
 * files, for convex hulls (hull.h), meshes (mesh.h) and other uses.
 *
 * A file that was read never changes: any number of threads may use it at the same time. The same bytes give the same
 * vertices and triangles, in the same order, on every machine and in every locale. The readers are strict: a malformed
 * file is refused, with a message that names the file and the line (in binary files the vertex or face), and what is
 * skipped in a valid file is counted.
 *
 * What is read of each format:
 *
 *   OBJ  v (its first three numbers) and f. Faces refer to earlier vertices, from 1 or, if negative, back from the last
 *        one. All objects and groups make one mesh, unless `object` names one. Normals, texture coordinates, colours,
 *        materials and smoothing are ignored, and no other file is opened; p, l, curv, curv2 and surf are counted. A #
 *        begins a comment, a backslash at its end joins a line to the next. Files with call or csh are refused.
 *   STL  All solids together make one mesh. Normals and colours are ignored: the order of the corners defines the
 *        outside. A file of 84 + 50 x (the number at byte 80) bytes is binary; others begin with "solid".
 *   PLY  Of element vertex the properties x, y and z, of any type; of element face the list vertex_indices or
 *        vertex_index. Other properties are ignored; rows of edge and of other elements are counted. Text files have
 *        one row a line. Triangle strips are refused.
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
    SADMM_MESH_FILE_ANY = 0, /* by the extension (.obj, .stl, .ply, in any case), or else by the bytes: "ply" and a line
                                end, "solid" or the size of a binary STL file, or else OBJ */
    SADMM_MESH_FILE_OBJ,
    SADMM_MESH_FILE_STL,
    SADMM_MESH_FILE_PLY,
    SADMM_MESH_FILE_FORMAT_COUNT
} sadmm_mesh_file_format;

typedef struct sadmm_mesh_file_def {
    size_t struct_size;            /* set by sadmm_mesh_file_def_default() */
    const char *path;              /* the file, or NULL: `bytes` are its content. Default NULL */
    const void *bytes;             /* only read while the call lasts; NULL where there is a path. Default NULL */
    size_t size;                   /* of `bytes`, > 0 with them and 0 without; default 0 */
    sadmm_mesh_file_format format; /* default SADMM_MESH_FILE_ANY */
    double scale;         /* m a unit of the file (0.001: the file is in millimetres), in [1e-9, 1e9]; default 1 */
    const char *object;   /* OBJ only: read only the faces below an "o" line, or a "g" line since the last "o" line,
                             with this name (one word). NULL: all. Default NULL */
    bool merge;           /* merge vertices that are equal bit for bit (STL files repeat them for every triangle).
                             Default true */
    bool drop_degenerate; /* leave out triangles with a height of at most 1e-12 of their longest edge, or with a
                             repeated corner; they are counted in any case. Default true */
} sadmm_mesh_file_def;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_mesh_file_def_init(sadmm_mesh_file_def *def, size_t size);
static inline sadmm_mesh_file_def sadmm_mesh_file_def_default(void)
{
    sadmm_mesh_file_def def;
    sadmm_mesh_file_def_init(&def, sizeof def);
    return def;
}

/* *out: the content of the file, owned by the caller until sadmm_mesh_file_destroy; NULL after an error. Thread-safe.
 * Takes memory of some ten times the file's size (at worst forty) and linear time. Errors: INVALID_ARGUMENT (range;
 * malformed file: the message says where; a coordinate that is not finite or, after scaling, not in [-1e6, 1e6] m; a
 * face with a vertex that does not exist; no triangle), IO (a file that cannot be read, is a folder or another special
 * file, or is empty), UNSUPPORTED (OBJ: call, csh; PLY: triangle strips, a version other than 1.0), LIMIT (more than
 * 2^29 vertices, or than 3 x 2^29 corners of faces; a face of more than 1024 corners that is not convex),
 * OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_mesh_file_read(const sadmm_mesh_file_def *def, sadmm_mesh_file **out);
/* NULL is fine. Thread-safe, once. */
SADMM_API void sadmm_mesh_file_destroy(sadmm_mesh_file *file);

/* All of the following only read, and may run on any number of threads at once. */

/* 0 for NULL; else at least 3 and 1 (fewer than 3 vertices only where degenerate triangles are kept). */
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

/* What the file contained, and what became of it: vertices = vertex_count + merged_vertices + unused_vertices.
 * It may grow (status.h). */
typedef struct sadmm_mesh_file_info {
    sadmm_mesh_file_format format;
    bool binary;
    int64_t vertices;
    int64_t merged_vertices;      /* equal to one before them */
    int64_t unused_vertices;      /* left out: no triangle has them */
    int64_t faces;                /* with three corners or more, of the selected object: these become the triangles */
    int64_t split_faces;          /* of them, those of more than three corners */
    int64_t crossing_faces;       /* of those, the ones that are degenerate, or whose outline crosses or touches itself:
                                     split, but not exactly */
    int64_t degenerate_triangles; /* see drop_degenerate */
    int64_t short_faces;          /* left out: fewer than three corners */
    int64_t other_faces;          /* left out: of objects that were not selected */
    int64_t points, lines;        /* left out: OBJ's p and l, PLY's edges */
    int64_t others;               /* left out: OBJ's curv, curv2 and surf, rows of PLY's other elements */
} sadmm_mesh_file_info;

/* Errors: INVALID_ARGUMENT (NULL). */
SADMM_API sadmm_status sadmm_mesh_file_describe_sized(const sadmm_mesh_file *file, sadmm_mesh_file_info *info,
                                                      size_t size);
static inline sadmm_status sadmm_mesh_file_describe(const sadmm_mesh_file *file, sadmm_mesh_file_info *info)
{
    return sadmm_mesh_file_describe_sized(file, info, sizeof *info);
}

#ifdef __cplusplus
}
#endif
#endif
