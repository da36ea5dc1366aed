/* Shapes on meshes in tests: where to put them, and what holds of every manifold. */
#ifndef SADMM_TESTS_MESH_TOUCHES_H
#define SADMM_TESTS_MESH_TOUCHES_H

#include "manifold_tools.h"
#include "mesh_tools.h"

/* What holds of the manifold with a triangle: a unit normal, points with features of their own within the limit. The
 * least separation, HUGE_VAL: no points. */
static inline double soup_check_manifold(const struct manifold *m, double limit)
{
    double least = HUGE_VAL;
    if (m->count > 0) ck_assert_double_eq_tol(v3_norm(m->normal), 1, 1e-12);
    for (int k = 0; k < m->count; ++k) {
        for (int i = 0; i < k; ++i) ck_assert_uint_ne(m->points[k].feature, m->points[i].feature);
        ck_assert(m->points[k].separation <= limit + 1e-12);
        least = fmin(least, m->points[k].separation);
    }
    return least;
}

/* Some point of the surface; the normal there. */
static inline vec3 soup_point_on(const struct mesh *mesh, struct random *r, vec3 *normal)
{
    int32_t corner[3], opposite[3];
    const int32_t t = (int32_t)(random_unit(r) * mesh->triangles);
    const double u = random_unit(r), w = random_unit(r) * (1 - u);
    struct mesh_triangle triangle;
    mesh_corners(mesh, t, corner, opposite);
    mesh_triangle_of(mesh, t, &triangle);
    *normal = triangle.normal;
    return v3_add(v3_scale(mesh_vertex(mesh, corner[0]), 1 - u - w),
                  v3_add(v3_scale(mesh_vertex(mesh, corner[1]), u), v3_scale(mesh_vertex(mesh, corner[2]), w)));
}

#endif
