/* A mesh (subadmm/mesh.h) from the inside. Of C alone: its uses are counted by an atomic number.
 *
 *   mesh.c         what callers see of a mesh, its uses
 *   mesh_make.c    from a definition to the block; mesh_heights.c: of a heightfield
 *   mesh_marks.c   which edges and corners are flat
 *   mesh_edges.c   which triangles are beside each other, which vertices
 *   mesh_tree.c    the tree of boxes, and with it the order of the triangles
 *   mesh_archive.c a mesh as bytes and back
 *   mesh_data.h    the block that contact finding reads; mesh_walk.h: what is near
 */
#ifndef SADMM_COLLISION_MESH_MESH_H
#define SADMM_COLLISION_MESH_MESH_H

#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

#include "subadmm/mesh.h"

struct sadmm_mesh {
    _Atomic uint32_t uses; /* the maker's and the worlds' */
    double *block;         /* mesh_data.h */
    size_t doubles;        /* of the block */
    double half[3];        /* of the box around it, m */
    double middle[3];      /* of that box, in the frame of the vertices: the block's origin */
    double *given;         /* vertices (3 numbers each), or heights, as they were given; NULL: the block's, from the
                              middle, come back to the same bits */
    int32_t *source;       /* by triangle, its number in the definition; NULL: the same */
    int64_t left_out;
};

/* One more use; one less: the last one frees it. NULL is fine. Thread-safe. */
void sadmm_mesh_retain(const sadmm_mesh *mesh);
void sadmm_mesh_release(const sadmm_mesh *mesh);

/* As sadmm_hull_archive. */
struct sadmm_archive;
void sadmm_mesh_archive(struct sadmm_archive *archive, sadmm_mesh **mesh);

#endif
