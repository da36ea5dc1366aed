/* What meshes of triangles and heightfields are made with. */
#ifndef SADMM_COLLISION_MESH_MESH_MAKE_H
#define SADMM_COLLISION_MESH_MESH_MAKE_H

#include <stdbool.h>

#include "mesh.h"

#define MESH_LARGEST 1e6 /* m, of a coordinate */

/* Keep `count` numbers, `per` a vertex, as they were given if one of them would not come back from the block's, which
 * are from `middle`. False: out of memory. */
bool sadmm_mesh_keep_given(sadmm_mesh *mesh, const double *given, const double *inside, size_t count, size_t per,
                           const double *middle);

#endif
