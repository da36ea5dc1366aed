/* Which format a file has. */
#ifndef SADMM_MESH_FILE_FORMAT_H
#define SADMM_MESH_FILE_FORMAT_H

#include "source.h"

/* The one that was asked for; SADMM_MESH_FILE_ANY: by the end of the path, or the bytes. */
sadmm_mesh_file_format sadmm_mesh_file_format_of(const sadmm_mesh_file_def *def, const struct mesh_source *source);

#endif
