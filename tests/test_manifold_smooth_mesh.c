/* Cylinders, cones and ellipsoids on meshes, triangle by triangle: the nearest points of the whole surface are always
 * among them, nothing is nearer than it is, the inside of a convex mesh is that of its hull, flat ground gives what a
 * plane gives, and along paths nothing jumps. */
#include <check.h>

#include "convex_tools.h"
#include "fewer.h"
#include "mesh_touches.h"
#include "run_suite.h"

/* A shape, 0, beside a mesh, or one of its triangles, 1, whose frame is the world's. */
struct beside {
    struct pair_of t;
    struct sadmm_geometry surface;
    struct mesh mesh;
};

static struct beside *new_beside(sadmm_mesh *mesh)
{
    static const double unturned[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    struct beside *b = calloc(1, sizeof *b);
    ck_assert_ptr_nonnull(b);
    b->t.shape_data = test_shape_data_new();
    memcpy(b->t.R[1], unturned, sizeof unturned);
    b->surface = (struct sadmm_geometry){.type = SADMM_SHAPE_MESH, .hull = (uint32_t)b->t.shape_data->used};
    memcpy(b->surface.size, mesh->half, sizeof mesh->half);
    ck_assert_uint_le(b->t.shape_data->used + mesh->doubles, TEST_SHAPE_DATA);
    memcpy(b->t.shape_data->numbers + b->t.shape_data->used, mesh->block, mesh->doubles * sizeof *mesh->block);
    mesh_at(b->t.shape_data->numbers, b->surface.hull, &b->mesh);
    b->t.shape_data->used += mesh->doubles;
    return b;
}

static void free_beside(struct beside *b)
{
    free(b->t.shape_data);
    free(b);
}

enum { SHAPES = 6 };
static void take_shape(struct beside *b, int kind, double scale)
{
    static const struct {
        int type;
        double size[3];
    } shapes[SHAPES] = {{SADMM_SHAPE_CYLINDER, {0.15, 0.1, 0}}, {SADMM_SHAPE_CYLINDER, {0.2, 0.01, 0}},
                        {SADMM_SHAPE_CYLINDER, {0.04, 0.25, 0}}, {SADMM_SHAPE_CONE, {0.15, 0.12, 0}},
                        {SADMM_SHAPE_CONE, {0.03, 0.2, 0}}, {SADMM_SHAPE_ELLIPSOID, {0.2, 0.1, 0.13}}};
    b->t.g[0] = (struct sadmm_geometry){.type = shapes[kind].type, .subshapes = 1};
    for (int k = 0; k < 3; ++k) b->t.g[0].size[k] = scale * shapes[kind].size[k];
}

static struct manifold touch_triangle(const struct beside *b, int32_t triangle, double limit, uint32_t cache)
{
    const struct pair_pose pose = pair_of_pose(&b->t);
    struct manifold m;
    memset(&m, 0x55, sizeof m);
    m.count = 0;
    m.cache = 0;
    triangle_manifold(&b->t.g[0], &b->surface, b->t.shape_data->numbers, (uint32_t)triangle, &pose, limit, cache, &m);
    ck_assert_int_ge(m.count, 0);
    ck_assert_int_le(m.count, SADMM_MANIFOLD_POINTS);
    return m;
}

/* Where the shape and the triangle are nearest, whatever the surface around. */
static struct manifold nearest_on_triangle(const struct beside *b, int32_t triangle)
{
    const struct pair_pose pose = pair_of_pose(&b->t);
    struct convex_triangle p;
    struct convex_axis axis;
    struct manifold m;
    uint32_t found;
    memset(&m, 0, sizeof m);
    convex_triangle_make(&b->t.g[0], &b->surface, b->t.shape_data->numbers, (uint32_t)triangle, &pose, &p);
    ck_assert(convex_search(&p.pair, p.front.n, false, SADMM_REAL_MAX, &axis, &found));
    m.normal = axis.n;
    hull_add_nearest(p.pair.thin, axis.pa, axis.pb, polytope_feature(FEATURE_NEAREST, 0, 0), &m);
    m.points[0].position = v3_add(m.points[0].position, p.triangle.origin);
    return m;
}

/* The triangle as shape 1. */
static void take_triangle(struct beside *b, int32_t triangle)
{
    int32_t corner[3], opposite[3];
    mesh_corners(&b->mesh, triangle, corner, opposite);
    memset(&b->t.h[1], 0, sizeof b->t.h[1]);
    b->t.h[1].vertices = 3;
    for (int k = 0; k < 3; ++k) v3_store(mesh_vertex(&b->mesh, corner[k]), b->t.h[1].x[k]);
    b->t.g[1].type = SADMM_SHAPE_HULL;
}

/* From the surface; below 0: the shape cuts it. Certified: two points of the shape and a triangle that are as far from
 * each other as two planes between them. *at_end: where the surface ends there is no saying what is behind it. */
static double distance_of(struct beside *b, bool *at_end)
{
    const double reach = geometry_radius(&b->t.g[0]) + 0.2;
    double least = HUGE_VAL;
    for (int32_t k = 0; k < b->mesh.triangles; ++k) {
        double n[3], world[3];
        take_triangle(b, k);
        const double(*x)[3] = (const double(*)[3])b->t.h[1].x;
        if (test_point_triangle(b->t.x[0], x[0], x[1], x[2]) > reach) continue;
        const struct manifold m = nearest_on_triangle(b, k);
        ck_assert_int_eq(m.count, 1);
        normal_in_world(&b->t, m.normal, n);
        const double here = m.points[0].separation, apart = apart_along(&b->t, n);
        if (here < 1e-6) return -1;
        ck_assert_double_eq_tol(here, apart, 1e-10);
        for (int i = 0; i < 2; ++i) {
            point_in_world(&b->t, v3_madd(m.points[0].position, i ? here / 2 : -here / 2, m.normal), world);
            const double outside = i ? test_point_triangle(world, x[0], x[1], x[2]) : own_outside(&b->t, 0, world);
            ck_assert_double_le(outside, 1e-9);
        }
        if (here >= least) continue;
        int32_t corner[3], opposite[3];
        mesh_corners(&b->mesh, k, corner, opposite);
        *at_end = opposite[0] < 0 || opposite[1] < 0 || opposite[2] < 0;
        least = here;
    }
    return least;
}

/* The least separation of all points, HUGE_VAL: none. memory: by triangle, NULL: none. */
static double smallest_separation(const void *beside, double limit, uint32_t *memory, int *points)
{
    const struct beside *b = beside;
    double least = HUGE_VAL;
    *points = 0;
    for (int32_t k = 0; k < b->mesh.triangles; ++k) {
        const struct manifold m = touch_triangle(b, k, limit, memory ? memory[k] : 0);
        if (memory) memory[k] = m.count > 0 ? m.cache : 0; /* what has no points is not remembered */
        *points += m.count;
        least = fmin(least, soup_check_manifold(&m, limit));
    }
    return least;
}

/* Put the shape about `above` over a point of the surface. */
static void place_over(struct beside *b, struct random *r, double above)
{
    double down[3];
    vec3 n;
    const vec3 on = soup_point_on(&b->mesh, r, &n);
    random_rotation(r, b->t.R[0]);
    v3_store(v3_neg(n), down);
    v3_store(v3_madd(on, own_support(&b->t, 0, down) + above, n), b->t.x[0]);
}

/* Whatever the surface is divided into, the nearest point of all of it is found, with its distance, and nothing
 * nearer. */
START_TEST(the_nearest_point_is_found)
{
    sadmm_mesh *mesh = soup_some_mesh(_i / SHAPES);
    struct beside *b = new_beside(mesh);
    struct random r = {1000 + (uint64_t)_i};
    const double limit = 0.03;
    int points, within = 0, exact = 0;
    take_shape(b, _i % SHAPES, _i % 2 ? 1 : 2);
    const double thin = geometry_thickness(&b->t.g[0]);
    for (int i = 0; i < 300 && within < fewer(25); ++i) {
        place_over(b, &r, random_in(&r, 0, 1.3 * limit));
        bool at_end = false;
        const double d = distance_of(b, &at_end);
        if (d < 0 || at_end) continue; /* or it cuts the surface elsewhere */
        const double separation = smallest_separation(b, limit, NULL, &points);
        /* What is beside a side may count as on it, where the separation is wrong by 1e-5 of the thickness
         * (CLIP_SEPARATION); the nearest points are not added to others as near to 1e-4 of it (MANIFOLD_FLAT). */
        const double less = 1e-5 * thin + 1e-10, more = 1.1e-4 * thin + 1e-10;
        if (d < limit - more)
            ck_assert_msg(separation <= d + more, "pose %d: found %.12g, distance %.12g", i, separation, d);
        ck_assert_msg(separation >= d - less, "pose %d: found %.12g, distance %.12g", i, separation, d);
        exact += fabs(separation - d) < 1e-10;
        within += d < limit;
    }
    ck_assert_int_gt(within, 3);
    ck_assert_int_gt(2 * exact, within);
    free_beside(b);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* Along a path over the surface (soup_walk_on). */
START_TEST(nothing_jumps_along_a_path)
{
    sadmm_mesh *mesh = soup_some_mesh(_i / SHAPES);
    struct beside *b = new_beside(mesh);
    struct random r = {5000 + (uint64_t)_i};
    take_shape(b, _i % SHAPES, 1);
    uint32_t *memory = calloc((size_t)b->mesh.triangles, sizeof *memory);
    const double limit = 0.03, thin = geometry_thickness(&b->t.g[0]);
    int steps = 0;
    for (int path = 0; path < 40 && steps < fewer(120); ++path) {
        const struct soup_walk walk = {.R = b->t.R[0], .x = b->t.x[0], .limit = limit, .thin = thin,
                                       .reach = geometry_radius(&b->t.g[0]), .deepest = MESH_SHALLOW,
                                       .separation = smallest_separation, .beside = b, .memory = memory};
        place_over(b, &r, 0.2 * limit);
        bool at_end = false;
        if (distance_of(b, &at_end) < 0 || at_end) continue;
        memset(memory, 0, (size_t)b->mesh.triangles * sizeof *memory);
        steps += soup_walk_on(&walk, &r, path);
    }
    ck_assert_int_gt(steps, fewer(20));
    free(memory);
    free_beside(b);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* A closed convex mesh is its hull: touching, apart and in each other. */
START_TEST(a_convex_mesh_is_its_hull)
{
    struct random r = {77 + (uint64_t)_i};
    struct test_hull convex;
    uint64_t seed = 5 + (uint64_t)_i;
    const double size[3] = {0.5, 0.7, 0.4}, limit = 0.02;
    random_hull(&seed, 8 + 4 * (_i / SHAPES), size, &convex);
    struct soup *s = soup_new();
    for (int v = 0; v < convex.vertices; ++v) soup_vertex(s, convex.x[v][0], convex.x[v][1], convex.x[v][2]);
    for (int f = 0; f < convex.faces; ++f)
        for (int k = 1; k + 1 < convex.corners[f]; ++k)
            soup_triangle(s, convex.corner[f][0], convex.corner[f][k], convex.corner[f][k + 1]);
    sadmm_mesh *mesh = soup_mesh(s);
    struct beside *b = new_beside(mesh);
    struct pair_of u = {.shape_data = b->t.shape_data};
    take_shape(b, _i % SHAPES, 1);
    u.h[0] = convex;
    u.g[0] = test_shape_data_add(u.shape_data, &convex);
    u.g[1] = b->t.g[0];
    memcpy(u.R[0], b->t.R[1], sizeof u.R[0]);
    for (int k = 0; k < 3; ++k) u.x[0][k] = -mesh->middle[k];
    const double thin = geometry_thickness(&b->t.g[0]);
    for (int i = 0; i < fewer(100); ++i) {
        static const double separations[] = {-1e-3, -1e-5, -1e-8, 1e-8, 1e-5, 1e-3, 0.015};
        struct manifold m;
        int points;
        place_over(b, &r, 0.05);
        memcpy(u.R[1], b->t.R[0], sizeof u.R[1]);
        memcpy(u.x[1], b->t.x[0], sizeof u.x[1]);
        /* as far apart as wanted: along the normal of the nearest points, more than once, since that turns a little */
        double expected = HUGE_VAL;
        for (int again = 0; again < 6; ++again) {
            double n[3];
            m = pair_touch(&u, SADMM_REAL_MAX, 0);
            normal_in_world(&u, m.normal, n);
            expected = HUGE_VAL;
            for (int k = 0; k < m.count; ++k) expected = fmin(expected, m.points[k].separation);
            if (again < 5)
                for (int k = 0; k < 3; ++k) u.x[1][k] -= (expected - separations[i % 7]) * n[k];
        }
        memcpy(b->t.x[0], u.x[1], sizeof u.x[1]);
        const double found = smallest_separation(b, limit, NULL, &points);
        /* what is kept, or preferred, while they overlap may be deeper by 10 % and 0.5 % of the thickness
         * (manifold.h) */
        const double most = MANIFOLD_KEEP_DEPTH * fabs(expected) + 0.006 * thin;
        ck_assert_msg(fabs(found - expected) <= (expected < 0 ? most : 1.1e-4 * thin + 1e-9),
                      "pose %d: %.12g by the mesh, %.12g by the hull", i, found, expected);
    }
    free(s);
    free_beside(b);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* Is there a point like this one in any of the manifolds? */
static bool has_like(const struct manifold *m, int count, const struct manifold_point *p, double tolerance)
{
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < m[i].count; ++k)
            if (v3_norm(v3_sub(m[i].points[k].position, p->position)) <= tolerance &&
                fabs(m[i].points[k].separation - p->separation) <= tolerance)
                return true;
    return false;
}

/* Flat ground, however it is divided: normals are the ground's, a cap has the points that it has on a plane, what lies
 * on its side the two ends of its line, and nothing is above or below what it should be. */
START_TEST(flat_ground_is_a_plane)
{
    static const double tilts[] = {0, 1e-14, 1e-10, 1e-7, 1e-5, 1e-3, 0.02, 0.1, 0.3},
                        separations[] = {-2e-4, -1e-6, -1e-13, 0, 1e-13, 1e-6, 1e-3};
    sadmm_mesh *mesh = soup_some_mesh(3);
    struct beside *b = new_beside(mesh);
    struct random r = {900 + (uint64_t)_i};
    const struct sadmm_geometry plane = {.type = SADMM_SHAPE_PLANE, .subshapes = 1};
    enum { MOST = 128 };
    ck_assert_int_le(b->mesh.triangles, MOST);
    for (int i = 0; i < fewer(600); ++i) {
        double stand[9], turn[9], tilt[9], down[3] = {0, 0, -1};
        struct manifold m[MOST], on_plane;
        take_shape(b, _i % SHAPES, 1);
        const bool lies = i % 2;
        const double *size = b->t.g[0].size, about = 2 * M_PI * random_unit(&r);
        const double lean = b->t.g[0].type == SADMM_SHAPE_CONE ? atan2(size[0], 2 * size[1]) : 0;
        rotation(turn, 0, 0, 1, 2 * M_PI * random_unit(&r));
        rotation(stand, cos(about), sin(about), 0, lies ? M_PI / 2 + lean : 0);
        multiply(stand, turn, b->t.R[0]);
        rotation(tilt, sin(3 * about), cos(3 * about), 0, tilts[i / 2 % 9]);
        multiply(tilt, b->t.R[0], turn);
        memcpy(b->t.R[0], turn, sizeof turn);
        const double separation = separations[(int)(7 * random_unit(&r))], low = own_support(&b->t, 0, down);
        /* now and then over the middle of a line or a corner of the mesh */
        for (int k = 0; k < 2; ++k) b->t.x[0][k] = random_in(&r, -0.8, 0.8);
        if (i % 7 == 0) v3_store(mesh_vertex(&b->mesh, 40), b->t.x[0]);
        b->t.x[0][2] = low + separation;
        const double radius = geometry_radius(&b->t.g[0]), thin = geometry_thickness(&b->t.g[0]),
                     limit = separation + 0.004;
        double least = HUGE_VAL;
        int points = 0;
        for (int32_t k = 0; k < b->mesh.triangles; ++k) {
            m[k] = touch_triangle(b, k, limit, 0);
            for (int q = 0; q < m[k].count; ++q) {
                const struct manifold_point *p = &m[k].points[q];
                double world[3];
                ck_assert_msg(fabs(m[k].normal.z + 1) <= 1e-14, "pose %d: normal %g %g %g", i, m[k].normal.x,
                              m[k].normal.y, m[k].normal.z);
                ck_assert_double_eq_tol(p->position.z, p->separation / 2, 1e-12);
                v3_store(v3_madd(p->position, -p->separation / 2, m[k].normal), world);
                ck_assert_double_le(fabs(own_outside(&b->t, 0, world)), 1e-5 * thin);
                least = fmin(least, p->separation);
                ++points;
            }
        }
        /* the deepest point is there, but for one that is as deep */
        ck_assert_msg(fabs(least - separation) <= MANIFOLD_FLAT * thin + 1e-12 * radius, "pose %d: %g for %g", i, least,
                      separation);
        if (lies && b->t.g[0].type != SADMM_SHAPE_ELLIPSOID) {
            if (tilts[i / 2 % 9] < 1e-4) ck_assert_msg(points >= 2, "pose %d: %d points", i, points);
            continue;
        }
        struct pair_pose pose = pair_pose(true, b->t.R[1], b->t.x[1], b->t.R[0], b->t.x[0]);
        memset(&on_plane, 0, sizeof on_plane);
        pair_manifold(&plane, &b->t.g[0], b->t.shape_data->numbers, 0, &pose, limit, 0, &on_plane);
        if (tilts[i / 2 % 9] > 0.13) continue; /* on a rim: the plane has the lowest point of the upper cap as well */
        for (int k = 0; k < on_plane.count; ++k) {
            struct manifold_point p = on_plane.points[k];
            double own[3], world[3];
            v3_store(p.position, own);
            to_world(b->t.R[0], own, world);
            for (int q = 0; q < 3; ++q) world[q] += b->t.x[0][q];
            p.position = v3_load(world);
            ck_assert_msg(has_like(m, b->mesh.triangles, &p, 1e-9), "pose %d: no %g %g %g, separation %g", i, world[0],
                          world[1], world[2], p.separation);
        }
    }
    free_beside(b);
    sadmm_mesh_destroy(mesh);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("smooth bodies on meshes");
    TCase *cases = tcase_create("smooth bodies on meshes");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, the_nearest_point_is_found, 0, SOUP_MESHES * SHAPES);
    tcase_add_loop_test(cases, a_convex_mesh_is_its_hull, 0, 3 * SHAPES);
    tcase_add_loop_test(cases, nothing_jumps_along_a_path, 0, SOUP_MESHES * SHAPES);
    tcase_add_loop_test(cases, flat_ground_is_a_plane, 0, SHAPES);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
