/* Cylinders, cones, ellipsoids and what meets them, in tests: supports and membership by their own formulas, nothing of
 * which is shared with the library. */
#ifndef SADMM_TESTS_CONVEX_TOOLS_H
#define SADMM_TESTS_CONVEX_TOOLS_H

#include "pair_of.h"

static inline void to_own(const double R[9], const double v[3], double own[3])
{
    for (int k = 0; k < 3; ++k) own[k] = R[k] * v[0] + R[3 + k] * v[1] + R[6 + k] * v[2];
}
static inline void to_world(const double R[9], const double v[3], double world[3])
{
    for (int k = 0; k < 3; ++k) world[k] = R[3 * k] * v[0] + R[3 * k + 1] * v[1] + R[3 * k + 2] * v[2];
}

/* Farthest that shape s reaches along a unit vector of the world, from its origin. */
static inline double own_support(const struct pair_of *t, int s, const double world[3])
{
    const double *size = t->g[s].size;
    double d[3], most = -HUGE_VAL;
    to_own(t->R[s], world, d);
    switch (t->g[s].type) {
    case SADMM_SHAPE_SPHERE: return size[0];
    case SADMM_SHAPE_CAPSULE: return size[0] + size[1] * fabs(d[2]);
    case SADMM_SHAPE_BOX: return size[0] * fabs(d[0]) + size[1] * fabs(d[1]) + size[2] * fabs(d[2]);
    case SADMM_SHAPE_CYLINDER: return size[0] * hypot(d[0], d[1]) + size[1] * fabs(d[2]);
    case SADMM_SHAPE_CONE: return fmax(size[1] * d[2], size[0] * hypot(d[0], d[1]) - size[1] * d[2]);
    case SADMM_SHAPE_ELLIPSOID: return sqrt(pow(size[0] * d[0], 2) + pow(size[1] * d[1], 2) + pow(size[2] * d[2], 2));
    default: break;
    }
    for (int v = 0; v < t->h[s].vertices; ++v) most = fmax(most, t_dot(t->h[s].x[v], d));
    return most + t->h[s].convex_radius;
}

/* How far a point of the world is outside of shape s, near its surface; negative: inside. */
static inline double own_outside(const struct pair_of *t, int s, const double world[3])
{
    const double *size = t->g[s].size;
    double rel[3], p[3], most = -HUGE_VAL;
    for (int k = 0; k < 3; ++k) rel[k] = world[k] - t->x[s][k];
    to_own(t->R[s], rel, p);
    const double r = hypot(p[0], p[1]), slant = hypot(size[0], 2 * size[1]);
    switch (t->g[s].type) {
    case SADMM_SHAPE_SPHERE: return t_norm(p) - size[0];
    case SADMM_SHAPE_CAPSULE:
        p[2] -= fmax(-size[1], fmin(size[1], p[2]));
        return t_norm(p) - size[0];
    case SADMM_SHAPE_BOX: return fmax(fabs(p[0]) - size[0], fmax(fabs(p[1]) - size[1], fabs(p[2]) - size[2]));
    case SADMM_SHAPE_CYLINDER: return fmax(r - size[0], fabs(p[2]) - size[1]);
    case SADMM_SHAPE_CONE: return fmax(-size[1] - p[2], (2 * size[1] * r + size[0] * (p[2] - size[1])) / slant);
    case SADMM_SHAPE_ELLIPSOID: {
        double q2 = 0, slope = 0; /* to first order */
        for (int k = 0; k < 3; ++k) {
            q2 += pow(p[k] / size[k], 2);
            slope += pow(p[k] / (size[k] * size[k]), 2);
        }
        return slope > 0 ? (q2 - 1) / 2 / sqrt(slope) : -1;
    }
    default: break;
    }
    const struct test_hull *h = &t->h[s];
    for (int f = 0; f < h->faces; ++f) most = fmax(most, t_dot(h->plane[f], p) - h->plane[f][3]);
    if (h->convex_radius > 0 && most > 0) { /* beyond an edge or a corner */
        most = HUGE_VAL;
        for (int f = 0; f < h->faces; ++f)
            for (int c = 2; c < h->corners[f]; ++c)
                most = fmin(most, test_point_triangle(p, h->x[h->corner[f][0]], h->x[h->corner[f][c - 1]],
                                                      h->x[h->corner[f][c]]));
    }
    return most - h->convex_radius;
}

/* The separation of the two along a unit vector of the world, from a to b. */
static inline double apart_along(const struct pair_of *t, const double n[3])
{
    const double back[3] = {-n[0], -n[1], -n[2]};
    double d[3];
    t_sub(t->x[1], t->x[0], d);
    return t_dot(n, d) - own_support(t, 0, n) - own_support(t, 1, back);
}

static inline double pair_size(const struct pair_of *t)
{
    return geometry_radius(&t->g[0]) + geometry_radius(&t->g[1]);
}
static inline double pair_thin(const struct pair_of *t)
{
    return fmin(geometry_thickness(&t->g[0]), geometry_thickness(&t->g[1]));
}

static inline struct manifold pair_touch(const struct pair_of *t, double limit, uint32_t cache)
{
    const struct pair_pose pose = pair_of_pose(t);
    struct manifold m;
    memset(&m, 0x55, sizeof m);
    pair_manifold(&t->g[0], &t->g[1], t->shape_data->numbers, 0, &pose, limit, cache, &m);
    ck_assert_int_ge(m.count, 0);
    ck_assert_int_le(m.count, SADMM_MANIFOLD_POINTS);
    return m;
}

/* A vector, or a point, of b's frame in the world. */
static inline void normal_in_world(const struct pair_of *t, vec3 n, double world[3])
{
    double local[3];
    v3_store(n, local);
    to_world(t->R[1], local, world);
}
static inline void point_in_world(const struct pair_of *t, vec3 x, double world[3])
{
    normal_in_world(t, x, world);
    for (int k = 0; k < 3; ++k) world[k] += t->x[1][k];
}

/* How far the two points that face each other across `separation` are outside of their bodies, the worse of them. */
static inline double points_outside(const struct pair_of *t, vec3 n, vec3 middle, double separation)
{
    double outside = -HUGE_VAL;
    for (int s = 0; s < 2; ++s) {
        double world[3];
        point_in_world(t, v3_madd(middle, s == 0 ? -separation / 2 : separation / 2, n), world);
        outside = fmax(outside, own_outside(t, s, world));
    }
    return outside;
}

/* A shape of any type; hulls: of so many points, rounded now and then. scale: m. */
static inline void random_shape_of(struct random *r, struct pair_of *t, int s, int type, double scale)
{
    struct sadmm_geometry g = {.type = type, .subshapes = 1};
    const double flat = pow(10, random_in(r, -1.5, 0));
    const int thin = (int)(3 * random_unit(r));
    for (int k = 0; k < 3; ++k) g.size[k] = scale * random_in(r, 0.3, 1) * (k == thin ? flat : 1);
    if (type == SADMM_SHAPE_HULL) {
        if (random_unit(r) < 0.3) box_hull(g.size, &t->h[s]);
        else random_hull(&r->state, 5 + (int)(random_unit(r) * 20), g.size, &t->h[s]);
        t->h[s].convex_radius = random_unit(r) < 0.3 ? 0.2 * scale * flat : 0;
        g = test_shape_data_add(t->shape_data, &t->h[s]);
    }
    t->g[s] = g;
}

#endif
