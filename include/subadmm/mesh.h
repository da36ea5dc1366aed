/* Triangle meshes and heightfields: ground, and other static or kinematic geometry (SADMM_SHAPE_MESH, world.h).
 *
 * A mesh is a surface, solid behind: a triangle's corners run counter-clockwise seen from the side where bodies are.
 * Neighbouring triangles know each other. Where bodies slide from one to the next, the edges and corners between them
 * push in no direction that the surface does not (docs/internals/contact-geometry.md, "Meshes and heightfields"), so
 * that flat ground is flat however it is divided.
 *
 * A mesh is made once and never changes. Any number of worlds and threads may use it at the same time; it is freed when
 * its creator and every world with shapes of it have released it. Every world has a copy of its data
 * (sadmm_mesh_bytes), and a device another one.
 *
 * Errors are returned as a status; the message is sadmm_last_message.
 */
#ifndef SUBADMM_MESH_H
#define SUBADMM_MESH_H

#include <stddef.h>
#include <stdint.h>

#include "status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_mesh sadmm_mesh;

typedef struct sadmm_mesh_def {
    size_t struct_size;       /* set by sadmm_mesh_def_default() */
    const double *vertices;   /* 3 numbers each, m, in [-1e6, 1e6]; equal ones are merged. Vertices and triangles are
                                 only read while the mesh is made. No default */
    size_t vertex_count;      /* in [3, 2^26]; no default */
    const int32_t *triangles; /* 3 vertices each, in [0, vertex_count), counter-clockwise seen from outside. Degenerate
                                 triangles (two equal vertices, or a height below 1e-9 of the longest edge) are left out
                                 (sadmm_mesh_left_out). No default */
    size_t triangle_count;    /* in [1, 2^26]; no default */
} sadmm_mesh_def;

/* All other members are 0. Thread-safe. */
SADMM_API void sadmm_mesh_def_init(sadmm_mesh_def *def, size_t size);
static inline sadmm_mesh_def sadmm_mesh_def_default(void)
{
    sadmm_mesh_def def;
    sadmm_mesh_def_init(&def, sizeof def);
    return def;
}

/* *out: the mesh, which belongs to the caller until sadmm_mesh_destroy; NULL after an error. Thread-safe. Errors:
 * INVALID_ARGUMENT (range; no triangle is left), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_mesh_create(const sadmm_mesh_def *def, sadmm_mesh **out);

/* Heights over a regular grid in the x-y plane, centred at the origin; bodies are above. Every cell is two triangles,
 * split by the diagonal from its lowest x and y to its highest. */
typedef struct sadmm_heightfield_def {
    size_t struct_size;       /* set by sadmm_heightfield_def_default() */
    const double *heights;    /* m, in [-1e6, 1e6], columns x rows of them: x runs fastest. Only read while the mesh is
                                 made. No default */
    int32_t columns, rows;    /* heights along x, and along y: each in [2, 16384], their product at most 2^26; no
                                 default */
    double spacing[2];        /* between two of them along x, and along y, m, in [1e-6, 1e6]; no default */
} sadmm_heightfield_def;

/* All other members are 0. Thread-safe. */
SADMM_API void sadmm_heightfield_def_init(sadmm_heightfield_def *def, size_t size);
static inline sadmm_heightfield_def sadmm_heightfield_def_default(void)
{
    sadmm_heightfield_def def;
    sadmm_heightfield_def_init(&def, sizeof def);
    return def;
}
/* As sadmm_mesh_create; takes a tenth of the memory of a mesh of the same surface. The shape's frame is that of the
 * grid. */
SADMM_API sadmm_status sadmm_heightfield_create(const sadmm_heightfield_def *def, sadmm_mesh **out);

/* Release the caller's reference; NULL is fine. Worlds with shapes of the mesh keep it. Thread-safe; call once. */
SADMM_API void sadmm_mesh_destroy(sadmm_mesh *mesh);

/* All of the following only read the mesh, and may run on any number of threads at once. Of NULL: 0. */

/* Number of triangles without those left out. */
SADMM_API int64_t sadmm_mesh_triangle_count(const sadmm_mesh *mesh);
/* Degenerate triangles of the definition that were left out (sadmm_mesh_def). */
SADMM_API int64_t sadmm_mesh_left_out(const sadmm_mesh *mesh);
/* Edges of one triangle only, or of more than two: boundaries of the surface. 0 for a closed surface. */
SADMM_API int64_t sadmm_mesh_open_edges(const sadmm_mesh *mesh);
/* Bytes that a world, and a device, need for it. */
SADMM_API size_t sadmm_mesh_bytes(const sadmm_mesh *mesh);

/* The smallest box around it, in the frame of the vertices (or of the grid), m. Errors: INVALID_ARGUMENT (NULL). */
SADMM_API sadmm_status sadmm_mesh_bounds(const sadmm_mesh *mesh, double lowest[3], double highest[3]);

/* The definition, so that the same mesh can be made again, bit for bit. (Collision detection uses coordinates relative
 * to the middle of the bounding box; where these do not give the definition's again, a mesh keeps both.) */

/* Vertices of the definition that triangles use, in its order, the first of equal ones; of a heightfield all, row by
 * row. 0 for NULL. */
SADMM_API int64_t sadmm_mesh_vertex_count(const sadmm_mesh *mesh);
/* Position of a vertex in the frame of the definition, m; `vertex` in [0, vertex_count). Errors: INVALID_ARGUMENT
 * (range, NULL). */
SADMM_API sadmm_status sadmm_mesh_vertex_at(const sadmm_mesh *mesh, int64_t vertex, double position[3]);
/* The vertices of a triangle, counter-clockwise seen from outside, and its number as contacts have it
 * (sadmm_contact.triangle); `triangle` in [0, triangle_count), in the library's order. Errors: INVALID_ARGUMENT (range,
 * NULL). */
SADMM_API sadmm_status sadmm_mesh_triangle_at(const sadmm_mesh *mesh, int64_t triangle, int32_t vertices[3],
                                              int32_t *number);
/* The grid of a heightfield, as in its definition; for a triangle mesh columns, rows and spacing are 0. Errors:
 * INVALID_ARGUMENT (NULL). */
SADMM_API sadmm_status sadmm_mesh_grid(const sadmm_mesh *mesh, int32_t *columns, int32_t *rows, double spacing[2]);

#ifdef __cplusplus
}
#endif
#endif
