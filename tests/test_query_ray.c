/* Rays against single shapes: solids by certificates that share nothing with the library (a point of the solid that is
 * farthest along the normal, and the bisection of a function that is negative inside), meshes by all triangles. */
#include <float.h>

#include "collision/query/ray.h"
#include "collision/query/ray_box.h"
#include "core/base/names.h"
#include "convex_tools.h"
#include "mesh_tools.h"
#include "run_suite.h"

/* What a ray is off by: this share of its way, and of the shape's size and place. */
#define EXACT 1e-12

static struct sadmm_ray_line line_towards(const double from[3], const double to[3])
{
    struct sadmm_ray_line ray = {.length = HUGE_VAL, .from_inside = true};
    double d[3];
    t_sub(to, from, d);
    const double length = t_norm(d);
    for (int k = 0; k < 3; ++k) {
        ray.origin[k] = from[k];
        ray.direction[k] = d[k] / length;
    }
    return ray;
}

static void at(const struct sadmm_ray_line *ray, double t, double x[3])
{
    for (int k = 0; k < 3; ++k) x[k] = ray->origin[k] + t * ray->direction[k];
}

/* Shape 0 of a pair. */
static struct sadmm_placed placed_of(const struct pair_of *t)
{
    struct sadmm_placed p = {.geometry = t->g[0], .blocks = t->shape_data->numbers};
    memcpy(p.R, t->R[0], sizeof p.R);
    memcpy(p.x, t->x[0], sizeof p.x);
    return p;
}

/* Negative inside of shape 0, and convex along any line. */
static double beyond(const struct pair_of *t, const double x[3])
{
    double rel[3], p[3], q2 = 0;
    if (t->g[0].type != SADMM_SHAPE_ELLIPSOID) return own_outside(t, 0, x);
    t_sub(x, t->x[0], rel);
    to_own(t->R[0], rel, p);
    for (int k = 0; k < 3; ++k) q2 += pow(p[k] / t->g[0].size[k], 2);
    return (sqrt(q2) - 1) * fmin(t->g[0].size[0], fmin(t->g[0].size[1], t->g[0].size[2]));
}

static double beyond_at(const struct pair_of *t, const struct sadmm_ray_line *ray, double way)
{
    double x[3];
    at(ray, way, x);
    return beyond(t, x);
}

/* Where on [0, most] the ray is deepest. */
static double deepest(const struct pair_of *t, const struct sadmm_ray_line *ray, double most)
{
    double a = 0, b = most;
    for (int k = 0; k < 120; ++k) {
        const double third = (b - a) / 3;
        if (beyond_at(t, ray, a + third) < beyond_at(t, ray, b - third)) b -= third;
        else a += third;
    }
    return (a + b) / 2;
}

static double entry(const struct pair_of *t, const struct sadmm_ray_line *ray, double in)
{
    double a = 0, b = in;
    for (int k = 0; k < 100; ++k) {
        const double middle = (a + b) / 2;
        if (beyond_at(t, ray, middle) > 0) a = middle;
        else b = middle;
    }
    return (a + b) / 2;
}

struct tally {
    int hits, misses, inside;
};

static void check_ray(const struct pair_of *t, const struct sadmm_ray_line *ray, double way, struct tally *tally)
{
    const struct sadmm_placed shape = placed_of(t);
    const double radius = geometry_radius(&t->g[0]), tolerance = EXACT * (way + radius + t_norm(t->x[0]));
    const double low = deepest(t, ray, way + 2 * radius), depth = -beyond_at(t, ray, low);
    struct sadmm_ray_find find;
    if (!sadmm_ray_cast(ray, &shape, ray->length, &find)) {
        ck_assert_msg(depth <= tolerance, "type %d: missed what is %g deep in it", t->g[0].type, depth);
        ++tally->misses;
        return;
    }
    ck_assert_int_eq(find.triangle, -1);
    ck_assert_double_eq_tol(t_norm(find.normal), 1, 1e-14);
    if (find.inside) {
        ck_assert(find.distance == 0);
        ck_assert_double_le(beyond(t, ray->origin), tolerance);
        for (int k = 0; k < 3; ++k) ck_assert(find.normal[k] == -ray->direction[k]);
        ++tally->inside;
        return;
    }
    double x[3], rel[3];
    ck_assert_double_ge(find.distance, 0);
    ck_assert_double_le(find.distance, way + 2 * radius);
    at(ray, find.distance, x);
    const double slope = -t_dot(find.normal, ray->direction);
    /* on the surface: in the solid, and none of it is farther along the normal */
    ck_assert_double_le(beyond(t, x), tolerance);
    t_sub(x, t->x[0], rel);
    const double reach = own_support(t, 0, find.normal) - t_dot(find.normal, rel);
    ck_assert_double_ge(reach, -tolerance);
    /* a normal is as exact as where the surface is met: to first order in a needle's radius of curvature */
    ck_assert_msg(reach <= 4 * tolerance, "type %d: %g below the farthest along the normal, may be %g", t->g[0].type,
                  reach, 4 * tolerance);
    ck_assert_double_ge(slope, -1e-9);
    if (depth > tolerance && slope > 0.01)
        ck_assert_double_eq_tol(find.distance, entry(t, ray, low), 2 * tolerance / slope);
    ++tally->hits;
}

/* Of all solids, at all distances. */
START_TEST(enters_solids)
{
    static const int types[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,      SADMM_SHAPE_HULL,
                                SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
    const int type = types[_i], shapes = getenv("SADMM_TEST_SHORT") ? 5 : type == SADMM_SHAPE_HULL ? 30 : 60;
    struct random r = {(uint64_t)_i * 7919 + 11};
    struct tally tally = {0, 0, 0};
    for (int n = 0; n < shapes; ++n) {
        struct pair_of t = {.shape_data = test_shape_data_new()};
        const double scale = pow(10, random_in(&r, -3, 3));
        random_shape_of(&r, &t, 0, type, scale);
        if (n % 4 == 3 && type != SADMM_SHAPE_HULL) t.g[0].size[n / 4 % sadmm_shape_sizes[type]] *= 1e-3; /* a needle */
        random_rotation(&r, t.R[0]);
        for (int k = 0; k < 3; ++k) t.x[0][k] = n % 3 ? scale * random_in(&r, -3, 3) : 0;
        const double radius = geometry_radius(&t.g[0]);
        for (int ray = 0; ray < 60; ++ray) {
            const double far = ray % 10 == 0 ? 1000 : 3;
            double from[3], to[3], own[3];
            for (int k = 0; k < 3; ++k) {
                from[k] = t.x[0][k] + far * radius * random_in(&r, -1, 1);
                own[k] = 1.1 * (sadmm_shape_sizes[type] == 1 ? radius : t.g[0].size[k]) * random_in(&r, -1, 1);
            }
            if (type == SADMM_SHAPE_CYLINDER || type == SADMM_SHAPE_CONE || type == SADMM_SHAPE_CAPSULE) {
                own[0] = 1.1 * t.g[0].size[0] * random_in(&r, -1, 1);
                own[1] = 1.1 * t.g[0].size[0] * random_in(&r, -1, 1);
                own[2] = 1.1 * t.g[0].size[1] * random_in(&r, -1, 1);
            }
            apply(t.R[0], own, to);
            for (int k = 0; k < 3; ++k) to[k] += t.x[0][k];
            const struct sadmm_ray_line line = ray % 7 == 6 ? line_towards(to, from) : line_towards(from, to);
            double d[3];
            t_sub(from, to, d);
            check_ray(&t, &line, t_norm(d), &tally);
        }
        free(t.shape_data);
    }
    ck_assert_int_gt(tally.hits, 15 * shapes);
    ck_assert_int_gt(tally.misses, shapes);
    ck_assert_int_gt(tally.inside, shapes / 4);
}
END_TEST

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

static struct sadmm_placed placed_mesh(const sadmm_mesh *mesh, struct random *r)
{
    struct sadmm_placed p = {.geometry = {.type = SADMM_SHAPE_MESH}, .blocks = mesh->block};
    memcpy(p.geometry.size, mesh->half, sizeof mesh->half);
    random_rotation(r, p.R);
    for (int k = 0; k < 3; ++k) p.x[k] = random_in(r, -5, 5);
    return p;
}

/* The corners of a triangle in the world; `number`: as the block has it. */
static void corners_of(const struct mesh *m, const struct sadmm_placed *p, int32_t number, double x[3][3])
{
    int32_t corner[3], opposite[3];
    mesh_corners(m, number, corner, opposite);
    for (int c = 0; c < 3; ++c) {
        double own[3];
        v3_store(mesh_vertex(m, corner[c]), own);
        apply(p->R, own, x[c]);
        for (int k = 0; k < 3; ++k) x[c][k] += p->x[k];
    }
}

/* Moeller and Trumbore's way. By how much the ray is inside of the triangle, as a share of it; negative: beside it. */
static double meets(const struct sadmm_ray_line *ray, double x[3][3], bool from_behind, double *distance)
{
    double u[3], v[3], p[3], q[3], s[3];
    t_sub(x[1], x[0], u);
    t_sub(x[2], x[0], v);
    t_cross(ray->direction, v, p);
    const double det = t_dot(u, p), size = t_norm(u) * t_norm(v);
    if (fabs(det) < 1e-9 * size || (det < 0 && !from_behind)) return -1;
    t_sub(ray->origin, x[0], s);
    t_cross(s, u, q);
    const double b = t_dot(s, p) / det, c = t_dot(ray->direction, q) / det;
    *distance = t_dot(v, q) / det;
    return *distance >= 0 ? fmin(fmin(b, c), 1 - b - c) : -1;
}

/* Against every triangle: what is hit is hit, and nothing nearer is, but for what is within rounding of a side. */
START_TEST(enters_meshes)
{
    struct random r = {(uint64_t)_i + 3};
    const bool brief = getenv("SADMM_TEST_SHORT") != NULL;
    sadmm_mesh *mesh = soup_some_mesh(_i);
    struct mesh m;
    int hits = 0, behind = 0;
    mesh_at(mesh->block, 0, &m);
    for (int n = 0; n < (brief ? 30 : 400); ++n) {
        const struct sadmm_placed p = placed_mesh(mesh, &r);
        double from[3], to[3], own[3];
        for (int k = 0; k < 3; ++k) {
            from[k] = p.x[k] + random_in(&r, -3, 3);
            own[k] = 1.2 * mesh->half[k] * random_in(&r, -1, 1);
        }
        apply(p.R, own, to);
        for (int k = 0; k < 3; ++k) to[k] += p.x[k];
        struct sadmm_ray_line ray = line_towards(from, to);
        ray.from_behind = n % 2;
        if (n % 5 == 4) ray.length = random_in(&r, 0, 4);
        double surely = HUGE_VAL, perhaps = HUGE_VAL;
        for (int32_t t = 0; t < m.triangles; ++t) {
            double x[3][3], distance = 0;
            corners_of(&m, &p, t, x);
            const double in = meets(&ray, x, ray.from_behind, &distance);
            if (in >= -1e-9 && distance <= ray.length * (1 + 1e-12)) perhaps = fmin(perhaps, distance);
            if (in >= 1e-9 && distance <= ray.length * (1 - 1e-12)) surely = fmin(surely, distance);
        }
        struct sadmm_ray_find find;
        if (!sadmm_ray_cast(&ray, &p, ray.length, &find)) {
            ck_assert_msg(!(surely < HUGE_VAL), "mesh %d, ray %d: missed a triangle at %g", _i, n, surely);
            continue;
        }
        ++hits;
        /* 1e-11: of lengths below 30, at triangles that may be seen at 1e-9 of edge on; as is usual, 1e-13 */
        ck_assert_double_ge(find.distance, perhaps - 1e-11);
        ck_assert_double_le(find.distance, surely + 1e-11);
        double x[3][3], u[3], v[3], normal[3];
        corners_of(&m, &p, find.triangle, x);
        t_sub(x[1], x[0], u);
        t_sub(x[2], x[0], v);
        t_cross(u, v, normal);
        for (int k = 0; k < 3; ++k) ck_assert_double_eq_tol(find.normal[k], normal[k] / t_norm(normal), 1e-12);
        behind += t_dot(find.normal, ray.direction) > 0;
        ck_assert(ray.from_behind || t_dot(find.normal, ray.direction) < 0);
        ck_assert(!find.inside);
    }
    ck_assert_int_gt(hits, brief ? 5 : 100);
    if (!brief && _i != 4) ck_assert_int_gt(behind, 0);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* Rays that are aimed at corners, and at points of edges, of a surface that has no holes. */
START_TEST(no_ray_passes_between)
{
    struct random r = {(uint64_t)_i + 17};
    sadmm_mesh *mesh = soup_some_mesh(_i);
    struct mesh m;
    mesh_at(mesh->block, 0, &m);
    const bool closed = _i >= 4 && _i <= 6;
    for (int n = 0; n < (getenv("SADMM_TEST_SHORT") ? 300 : 5000); ++n) {
        struct sadmm_placed p = placed_mesh(mesh, &r);
        if (n % 3 == 0) { /* along the axes, too, where numbers are even */
            rotation(p.R, 1, 0, 0, 0);
            for (int k = 0; k < 3; ++k) p.x[k] = 0;
        }
        const int32_t triangle = (int32_t)(random_unit(&r) * m.triangles);
        int32_t corner[3], opposite[3];
        double x[3][3], to[3], up[3], from[3];
        const double share = n % 2 ? random_unit(&r) : 0;
        const int c = n % 3;
        mesh_corners(&m, triangle, corner, opposite);
        if (!closed) { /* rays come from above, and corners of the rim are aimed past */
            bool rim = false;
            for (int k = 0; k < 3; ++k) {
                const vec3 v = mesh_vertex(&m, corner[k]);
                rim = rim || fabs(v.x) > mesh->half[0] * (1 - 1e-9) || fabs(v.y) > mesh->half[1] * (1 - 1e-9);
            }
            if (rim) continue;
        }
        corners_of(&m, &p, triangle, x);
        for (int k = 0; k < 3; ++k) to[k] = (1 - share) * x[c][k] + share * x[(c + 1) % 3][k];
        const double own[3] = {closed  ? random_in(&r, -4, 4)
                               : n % 3 ? random_in(&r, -0.05, 0.05)
                                       : 0,
                               closed  ? random_in(&r, -4, 4)
                               : n % 3 ? random_in(&r, -0.05, 0.05)
                                       : 0,
                               closed ? random_in(&r, -4, 4) : 3};
        apply(p.R, own, up);
        for (int k = 0; k < 3; ++k) from[k] = closed ? p.x[k] + up[k] : to[k] + up[k];
        if (closed) { /* the middle of the solid lies behind all of it */
            struct sadmm_ray_line inner = line_towards(from, p.x);
            struct sadmm_ray_find find;
            double back[3];
            t_sub(from, p.x, back);
            const double rel[3] = {own[0] / mesh->half[0], own[1] / mesh->half[1], own[2] / mesh->half[2]};
            if (fmax(fabs(rel[0]), fmax(fabs(rel[1]), fabs(rel[2]))) < 1.01) continue; /* from inside */
            ck_assert(sadmm_ray_cast(&inner, &p, HUGE_VAL, &find));
            ck_assert_double_lt(find.distance, t_norm(back));
            /* on, through the corner or edge: where the surface is convex that is a touch, or a hit; aimed a hair
             * deeper it is one */
            for (int k = 0; k < 3; ++k) to[k] += 1e-9 * (p.x[k] - to[k]);
        }
        const struct sadmm_ray_line ray = line_towards(from, to);
        struct sadmm_ray_find find;
        ck_assert_msg(sadmm_ray_cast(&ray, &p, HUGE_VAL, &find), "mesh %d, ray %d passed at triangle %d", _i, n,
                      triangle);
    }
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* Across a large grid, at all angles: the cells that the ray is in are found. */
START_TEST(crosses_a_grid)
{
    enum { COLUMNS = 300, ROWS = 170 };
    static double z[COLUMNS * ROWS];
    struct random r = {5};
    sadmm_mesh *mesh;
    struct mesh m;
    int hits = 0;
    for (int i = 0; i < COLUMNS * ROWS; ++i) z[i] = 0.05 * sin(0.1 * (i % COLUMNS)) + (i % 37 == 0 ? 0.5 : 0);
    const sadmm_heightfield_def def = {sizeof def, z, COLUMNS, ROWS, {0.1, 0.23}};
    ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
    mesh_at(mesh->block, 0, &m);
    for (int n = 0; n < (getenv("SADMM_TEST_SHORT") ? 10 : 60); ++n) {
        struct sadmm_placed p = placed_mesh(mesh, &r);
        double from[3], to[3], own[3], surely = HUGE_VAL, perhaps = HUGE_VAL;
        for (int k = 0; k < 3; ++k) {
            from[k] = (k < 2 ? 1.3 : 8) * mesh->half[k] * random_in(&r, -1, 1);
            own[k] = mesh->half[k] * random_in(&r, -1, 1);
        }
        if (n % 4 == 1) own[0] = from[0]; /* along the axes */
        if (n % 4 == 2) own[1] = from[1];
        if (n % 4 == 3) from[2] = own[2]; /* level */
        apply(p.R, from, from);
        apply(p.R, own, to);
        for (int k = 0; k < 3; ++k) {
            from[k] += p.x[k];
            to[k] += p.x[k];
        }
        struct sadmm_ray_line ray = line_towards(from, to);
        ray.from_behind = n % 3 == 0;
        for (int32_t t = 0; t < m.triangles; ++t) {
            double x[3][3], distance = 0;
            corners_of(&m, &p, t, x);
            const double in = meets(&ray, x, ray.from_behind, &distance);
            if (in >= -1e-9) perhaps = fmin(perhaps, distance);
            if (in >= 1e-9) surely = fmin(surely, distance);
        }
        struct sadmm_ray_find find;
        if (!sadmm_ray_cast(&ray, &p, HUGE_VAL, &find)) {
            ck_assert_msg(!(surely < HUGE_VAL), "ray %d: missed a triangle at %g", n, surely);
            continue;
        }
        ++hits;
        ck_assert_double_ge(find.distance, perhaps - 1e-10); /* 50 m, seen at 0.01 rad */
        ck_assert_double_le(find.distance, surely + 1e-10);
    }
    ck_assert_int_gt(hits, 5);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* A tree that is deeper than what a walk keeps in mind: every leaf that the ray meets is still come to, once, and none
 * beyond the limit. */
START_TEST(walks_a_deep_tree)
{
    enum { DEPTH = 150, NODES = 2 * DEPTH + 1 };
    static struct mesh_node nodes[NODES];
    const double x[3] = {0, 0, 0}, d[3] = {1, 0, 0}, limits[] = {HUGE_VAL, 930.25};
    /* inner node, its leaf, and what is left, nearer to the ray's origin */
    for (int k = 0; k <= DEPTH; ++k) {
        struct mesh_node *inner = &nodes[2 * k], *leaf = k < DEPTH ? inner + 1 : inner;
        for (int axis = 1; axis < 3; ++axis) {
            inner->lo[axis] = leaf->lo[axis] = -1;
            inner->hi[axis] = leaf->hi[axis] = 1;
        }
        inner->lo[0] = 1000 - DEPTH;
        inner->hi[0] = leaf->hi[0] = (float)(1000 - k) + 0.5f;
        inner->first = -1;
        inner->next = NODES;
        leaf->lo[0] = (float)(1000 - k);
        leaf->first = k << 3 | 1;
        leaf->next = k < DEPTH ? 2 * k + 2 : NODES;
    }
    for (int l = 0; l < 2; ++l) {
        const struct mesh_node *leaf;
        struct ray_walk walk;
        int times[DEPTH + 1] = {0};
        ray_walk_begin(&walk, nodes, NODES, x, d);
        while ((leaf = ray_walk_next(&walk, limits[l]))) ++times[leaf->first >> 3];
        for (int k = 0; k <= DEPTH; ++k) ck_assert_int_eq(times[k], 1000 - k <= limits[l]);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("query_ray");
    TCase *tcase = tcase_create("query_ray");
    tcase_add_loop_test(tcase, enters_solids, 0, 7);
    tcase_add_loop_test(tcase, enters_meshes, 0, SOUP_MESHES);
    tcase_add_loop_test(tcase, no_ray_passes_between, 0, SOUP_MESHES);
    tcase_add_test(tcase, crosses_a_grid);
    tcase_add_test(tcase, walks_a_deep_tree);
    suite_add_tcase(suite, tcase);
    return run_suite(suite);
}
