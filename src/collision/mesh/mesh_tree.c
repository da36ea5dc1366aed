#include "mesh_tree.h"

#include <math.h>

#include "core/base/memory.h"

/* Outwards, so that nothing of the triangle is outside. */
static void box_of(const double *vertices, const int32_t corner[3], struct float_box *box)
{
    for (int k = 0; k < 3; ++k) {
        const double x = vertices[3 * (size_t)corner[0] + (size_t)k], y = vertices[3 * (size_t)corner[1] + (size_t)k],
                     z = vertices[3 * (size_t)corner[2] + (size_t)k];
        float_box_set(fmin(x, fmin(y, z)), fmax(x, fmax(y, z)), k, box);
    }
}

bool sadmm_mesh_tree_make(const double *vertices, const int32_t *corners, int32_t triangles, struct box_tree *tree)
{
    struct float_box *boxes = (struct float_box *)sadmm_alloc((size_t)triangles, sizeof *boxes);
    bool made = false;
    *tree = (struct box_tree){0};
    if (boxes) {
        for (int32_t t = 0; t < triangles; ++t) box_of(vertices, corners + 3 * (size_t)t, &boxes[t]);
        made = sadmm_box_tree_make(boxes, triangles, tree);
    }
    sadmm_free(boxes);
    return made;
}
