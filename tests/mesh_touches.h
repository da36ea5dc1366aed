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

/* A shape on its way over a mesh: its pose, which moves, and the least separation where it is, by what was remembered
 * of each triangle. */
struct soup_walk {
    double *R, *x;
    double limit, thin, reach; /* m: of separations; thickness and radius of the shape */
    double deepest;            /* share of the thickness: deeper, the nearest way out may be another one */
    double (*separation)(const void *beside, double limit, uint32_t *memory, int *points);
    const void *beside;
    uint32_t *memory;
};

/* Some steps of 1e-3 m and 2e-3 rad: the least separation changes no faster than the shape moves, but for what the
 * memory of an axis may keep, 10 % of the depth and 0.5 % of the thickness (manifold.h), and a little for clipping.
 * Returns the steps made. */
static inline int soup_walk_on(const struct soup_walk *w, struct random *r, int path)
{
    const double angle = 2e-3;
    double last = HUGE_VAL, way[3], axis[3];
    for (int k = 0; k < 3; ++k) way[k] = random_in(r, -1e-3, 1e-3);
    for (int k = 0; k < 3; ++k) axis[k] = random_in(r, -1, 1);
    const double length = t_norm(axis), moved = t_norm(way) + angle * w->reach;
    for (int i = 0; i < 60; ++i) {
        double turn_by[9], turned[9];
        int points;
        rotation(turn_by, axis[0] / length, axis[1] / length, axis[2] / length, angle);
        multiply(turn_by, w->R, turned);
        memcpy(w->R, turned, sizeof turned);
        for (int k = 0; k < 3; ++k) w->x[k] += way[k];
        const double separation = w->separation(w->beside, w->limit, w->memory, &points);
        if (separation < -w->deepest * w->thin) return i;
        if (separation < HUGE_VAL && last < HUGE_VAL)
            ck_assert_msg(fabs(separation - last) <= 1.01 * moved + 0.12 * fmax(0, -separation) + 0.006 * w->thin,
                          "path %d, step %d: from %g to %g, moved by %g", path, i, last, separation, moved);
        else if (separation < HUGE_VAL || last < HUGE_VAL) /* comes or goes at the limit */
            ck_assert_msg(fmin(separation, last) >= w->limit - 1.01 * moved - 1e-9 || i == 0,
                          "path %d, step %d: from %g to %g, limit %g", path, i, last, separation, w->limit);
        last = separation;
    }
    return 60;
}

#endif
