/* The header of a PLY file: which rows of which values follow. */
#ifndef SADMM_MESH_FILE_PLY_HEADER_H
#define SADMM_MESH_FILE_PLY_HEADER_H

#include "parts.h"
#include "text.h"

enum ply_encoding { PLY_TEXT, PLY_LITTLE, PLY_BIG };

enum ply_type { PLY_INT8, PLY_UINT8, PLY_INT16, PLY_UINT16, PLY_INT32, PLY_UINT32, PLY_FLOAT, PLY_DOUBLE, PLY_TYPES };

enum ply_role { PLY_X, PLY_Y, PLY_Z, PLY_CORNERS, PLY_NO_ROLE };

struct ply_property {
    enum ply_role role;
    enum ply_type type;
    bool list;
    enum ply_type count_type; /* of a list */
};

enum ply_kind { PLY_VERTEX, PLY_FACE, PLY_EDGE, PLY_OTHER, PLY_KINDS };

struct ply_element {
    enum ply_kind kind;
    size_t count; /* rows */
    size_t first, properties;
};

struct ply {
    struct mesh_parts *parts;
    struct text text; /* at the header, and then at what follows it */
    enum ply_encoding encoding;
    struct ply_element *elements;
    struct ply_property *properties;
    size_t element_count, property_count;
    size_t vertex_count; /* that the header says */
};

static inline bool ply_is_integer(enum ply_type type) { return type < PLY_FLOAT; }

sadmm_status sadmm_mesh_file_read_ply_header(struct ply *ply);

#endif
