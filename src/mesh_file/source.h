/* The bytes of a file. */
#ifndef SADMM_MESH_FILE_SOURCE_H
#define SADMM_MESH_FILE_SOURCE_H

#include "subadmm/mesh_file.h"

enum { SOURCE_NAME_SIZE = 240 };

struct mesh_source {
    char name[SOURCE_NAME_SIZE]; /* for messages: the argument, and the file */
    const unsigned char *bytes;
    size_t size;
    unsigned char *own; /* the bytes where they were read from a path */
};

/* From the path or the bytes of `def`. `source` is to be freed in any case. */
sadmm_status sadmm_mesh_file_open(const sadmm_mesh_file_def *def, struct mesh_source *source);
void sadmm_mesh_file_close(struct mesh_source *source);

#endif
