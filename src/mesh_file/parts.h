/* What a format's reader puts together: vertices, and faces as lists of them. What becomes of it is the same for all.
 */
#ifndef SADMM_MESH_FILE_PARTS_H
#define SADMM_MESH_FILE_PARTS_H

#include "core/base/error.h"
#include "source.h"

/* 3 x 2^29 triangle corners are counted by 32 bits. */
enum { MESH_MOST_VERTICES = 1 << 29 };
#define MESH_MOST_CORNERS ((size_t)3 << 29)

struct mesh_parts {
    const struct mesh_source *source;
    double scale;
    const char *object;
    double *vertices;   /* 3 each, m */
    int32_t *corners;   /* of all faces, one after the other */
    int32_t *face_size; /* corners of each face */
    size_t vertex_count, corner_count, face_count;
    size_t face_begin; /* the first corner of the face that is being made */
    sadmm_mesh_file_info info;
};

void sadmm_mesh_file_free_parts(struct mesh_parts *parts);

/* Fail at a line of the file; 0: at none. */
#ifdef __GNUC__
__attribute__((format(printf, 4, 5)))
#endif
sadmm_status
sadmm_mesh_file_fail(const struct mesh_parts *parts, size_t line, sadmm_status status, const char *format, ...);

/* In units of the file. */
sadmm_status sadmm_mesh_file_add_vertex(struct mesh_parts *parts, size_t line, const double x[3]);
/* Of the face that is being made. `vertex`: from 0, of `count`, and told from `from` on. */
sadmm_status sadmm_mesh_file_add_corner(struct mesh_parts *parts, size_t line, int64_t vertex, size_t count, int from);
/* The face is made. It counts if `wanted`, and has three corners. */
sadmm_status sadmm_mesh_file_end_face(struct mesh_parts *parts, bool wanted);

#endif
