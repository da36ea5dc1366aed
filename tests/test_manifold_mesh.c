/* Contact with meshes, triangle by triangle: the nearest points of the whole surface are always among them, nothing is
 * nearer than it is, the inside of a convex mesh is that of its hull, and along paths nothing jumps. */
#include <check.h>

#include "collision/mesh/mesh_walk.h"
#include "fewer.h"
#include "hull_shapes.h"
#include "manifold_tools.h"
#include "mesh_touches.h"
#include "run_suite.h"

/* A shape beside a mesh. */
struct beside {
    struct test_shape_data *shape_data;
    struct test_hull core; /* the shape without its radius */
    struct sadmm_geometry shape, surface;
    struct mesh mesh;
    double R[9], x[3]; /* of the shape, in the frame of the mesh */
};

static const double unturned[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, origin[3] = {0, 0, 0};

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

static void take_mesh(struct beside *b, const sadmm_mesh *mesh)
{
    b->surface = (struct sadmm_geometry){.type = SADMM_SHAPE_MESH, .hull = (uint32_t)b->shape_data->used};
    memcpy(b->surface.size, mesh->half, sizeof mesh->half);
    ck_assert_uint_le(b->shape_data->used + mesh->doubles, TEST_SHAPE_DATA);
    memcpy(b->shape_data->numbers + b->shape_data->used, mesh->block, mesh->doubles * sizeof *mesh->block);
    mesh_at(b->shape_data->numbers, b->surface.hull, &b->mesh);
    b->shape_data->used += mesh->doubles;
}

/* ---- shapes ------------------------------------------------------------------------------------------------------ */

enum { SHAPES = 6 };
static void take_shape(struct beside *b, int kind, double scale)
{
    const double half[3] = {0.2 * scale, 0.1 * scale, 0.15 * scale}, thin[3] = {0.3 * scale, 0.2 * scale, 0.01 * scale};
    uint64_t seed = 3;
    memset(&b->core, 0, sizeof b->core);
    if (kind == 0) {
        b->shape = (struct sadmm_geometry){.type = SADMM_SHAPE_SPHERE, .subshapes = 1, .size = {0.15 * scale}};
        b->core.vertices = 1;
    } else if (kind == 1) {
        b->shape =
            (struct sadmm_geometry){.type = SADMM_SHAPE_CAPSULE, .subshapes = 1, .size = {0.05 * scale, 0.2 * scale}};
        b->core.vertices = 2;
        b->core.edges = 1;
        b->core.edge[0][1] = 1;
        b->core.x[0][2] = -0.2 * scale;
        b->core.x[1][2] = 0.2 * scale;
    } else if (kind == 2 || kind == 3) {
        const double *size = kind == 2 ? half : thin;
        b->shape = (struct sadmm_geometry){.type = SADMM_SHAPE_BOX, .subshapes = 1,
                                           .size = {size[0], size[1], size[2]}};
        box_hull(size, &b->core);
    } else {
        random_hull(&seed, kind == 4 ? 6 : 24, half, &b->core);
        b->shape = test_shape_data_add(b->shape_data, &b->core);
    }
}

static double radius_of_core(const struct beside *b) { return b->core.faces > 0 ? 0 : b->shape.size[0]; }

/* ---- the reference ----------------------------------------------------------------------------------------------- */

static void triangle_hull(const struct mesh *m, int32_t triangle, struct test_hull *h)
{
    int32_t corner[3], opposite[3];
    memset(h, 0, sizeof *h);
    mesh_corners(m, triangle, corner, opposite);
    h->vertices = 3;
    h->edges = 3;
    h->faces = 1;
    h->corners[0] = 3;
    for (int k = 0; k < 3; ++k) {
        v3_store(mesh_vertex(m, corner[k]), h->x[k]);
        h->corner[0][k] = k;
        h->edge[k][0] = k;
        h->edge[k][1] = (k + 1) % 3;
    }
}

/* Does the core cut through the triangle? No direction parts them. */
static bool cuts(const struct beside *b, const struct test_hull *t)
{
    double xa[TEST_HULL_POINTS][3], Ra[3][3], Rb[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, n[3], u[3], v[3];
    memcpy(Ra, b->R, sizeof Ra);
    test_hull_place(&b->core, Ra, b->x, xa);
    struct test_hull two = *t;
    t_sub(t->x[1], t->x[0], u);
    t_sub(t->x[2], t->x[0], v);
    t_cross(u, v, n);
    for (int k = 0; k < 3; ++k) {
        two.plane[0][k] = n[k] / t_norm(n);
        two.plane[1][k] = -two.plane[0][k];
    }
    two.faces = 2;
    return test_hulls_axes(&b->core, (const double(*)[3])xa, Ra, &two, t->x, Rb) < 0;
}

/* From the surface; below 0: the core cuts it. *at_end: where the surface ends it has no inside, and there is no saying
 * what is behind it. */
static double distance_of(const struct beside *b, bool *at_end)
{
    double xa[TEST_HULL_POINTS][3], Ra[3][3], least = HUGE_VAL;
    const double reach = geometry_radius(&b->shape) + 0.2;
    memcpy(Ra, b->R, sizeof Ra);
    test_hull_place(&b->core, Ra, b->x, xa);
    for (int32_t t = 0; t < b->mesh.triangles; ++t) {
        struct test_hull h;
        triangle_hull(&b->mesh, t, &h);
        if (test_point_triangle(b->x, h.x[0], h.x[1], h.x[2]) > reach) continue;
        if (b->core.faces > 0 && cuts(b, &h)) return -1;
        const double here = test_hulls_distance(&b->core, (const double(*)[3])xa, &h, h.x);
        if (here >= least) continue;
        least = here;
        int32_t corner[3], opposite[3];
        mesh_corners(&b->mesh, t, corner, opposite);
        *at_end = opposite[0] < 0 || opposite[1] < 0 || opposite[2] < 0;
    }
    return least - radius_of_core(b);
}

/* ---- what the library finds -------------------------------------------------------------------------------------- */

/* The least separation of all points, HUGE_VAL: none. memory: by triangle, NULL: none. */
static double smallest_separation(const void *beside, double limit, uint32_t *memory, int *points)
{
    const struct beside *b = beside;
    double least = HUGE_VAL;
    const struct pair_pose pose = pair_pose(false, b->R, b->x, unturned, origin);
    *points = 0;
    for (int32_t t = 0; t < b->mesh.triangles; ++t) {
        struct manifold m;
        memset(&m, 0x55, sizeof m);
        m.count = 0;
        m.cache = 0;
        mesh_manifold(&b->shape, &b->surface, b->shape_data->numbers, (uint32_t)t, &pose, limit, memory ? memory[t] : 0,
                      &m);
        ck_assert_int_ge(m.count, 0);
        ck_assert_int_le(m.count, SADMM_MANIFOLD_POINTS);
        if (memory) memory[t] = m.count > 0 ? m.cache : 0; /* what has no points is not remembered */
        *points += m.count;
        least = fmin(least, soup_check_manifold(&m, limit));
    }
    return least;
}

/* Put the shape about `above` over a point of the surface. */
static void place_over(struct beside *b, struct random *r, double above)
{
    double most = 0;
    vec3 n;
    const vec3 on = soup_point_on(&b->mesh, r, &n);
    random_rotation(r, b->R);
    for (int i = 0; i < b->core.vertices; ++i) {
        double turned[3];
        apply(b->R, b->core.x[i], turned);
        most = fmax(most, -v3_dot(n, v3_load(turned)));
    }
    v3_store(v3_madd(on, most + radius_of_core(b) + above, n), b->x);
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

/* Whatever the surface is divided into, the nearest point of all of it is found, with its distance, and
 * nothing nearer. */
START_TEST(the_nearest_point_is_found)
{
    sadmm_mesh *mesh = soup_some_mesh(_i / SHAPES);
    struct beside b = {.shape_data = test_shape_data_new()};
    struct random r = {1000 + (uint64_t)_i};
    const double scale = _i % 2 ? 1 : 3, limit = 0.03;
    int points, within = 0, exact = 0;
    take_mesh(&b, mesh);
    take_shape(&b, _i % SHAPES, scale);
    const double thin = geometry_thickness(&b.shape);
    for (int i = 0; i < 400 && within < fewer(30); ++i) {
        place_over(&b, &r, random_in(&r, 0, 1.3 * limit));
        bool at_end = false;
        const double d = distance_of(&b, &at_end);
        if (d < 1e-6 || at_end) continue; /* or it cuts the surface elsewhere */
        const double separation = smallest_separation(&b, limit, NULL, &points);
        /* A face within 8 degrees of the nearest points is preferred to them, and the separation is taken along it:
         * their distance times the cosine, at least. A corner beside an edge may count as on it, where the separation
         * is wrong by 1e-5 of the thickness (CLIP_SEPARATION); the nearest points are not added to others as near to
         * 1e-4 of it (MANIFOLD_FLAT). */
        const double less = 0.01 * d + 1e-5 * thin + 1e-10, more = 1.1e-4 * thin + 1e-10;
        if (d < limit - more)
            ck_assert_msg(separation <= d + more, "pose %d: found %.12g, distance %.12g", i, separation, d);
        ck_assert_msg(separation >= d - less, "pose %d: found %.12g, distance %.12g", i, separation, d);
        exact += fabs(separation - d) < 1e-10;
        within += d < limit;
    }
    ck_assert_int_gt(within, 3);
    ck_assert_int_gt(2 * exact, within);
    free(b.shape_data);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* A closed convex mesh is its hull: touching, apart and in each other. */
START_TEST(a_convex_mesh_is_its_hull)
{
    struct beside b = {.shape_data = test_shape_data_new()};
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
    ck_assert_int_eq(sadmm_mesh_open_edges(mesh), 0);
    const struct sadmm_geometry hull = test_shape_data_add(b.shape_data, &convex);
    take_mesh(&b, mesh);
    take_shape(&b, _i % SHAPES, 1);
    const double thin = geometry_thickness(&b.shape);
    const double back[3] = {-mesh->middle[0], -mesh->middle[1], -mesh->middle[2]};
    for (int i = 0; i < fewer(100); ++i) {
        static const double separations[] = {-1e-3, -1e-5, -1e-8, 1e-8, 1e-5, 1e-3, 0.015};
        struct manifold m;
        int points;
        place_over(&b, &r, 0.05);
        /* as far apart as wanted: along the normal of the nearest points, twice, since that turns a little */
        for (int again = 0; again < 6; ++again) {
            const struct pair_pose pose = pair_pose(false, b.R, b.x, unturned, back);
            pair_manifold(&b.shape, &hull, b.shape_data->numbers, 0, &pose, SADMM_REAL_MAX, 0, &m);
            ck_assert_int_gt(m.count, 0);
            double at = HUGE_VAL;
            for (int k = 0; k < m.count; ++k) at = fmin(at, m.points[k].separation);
            v3_store(v3_madd(v3_load(b.x), at - separations[i % 7], m.normal), b.x);
        }
        const struct pair_pose pose = pair_pose(false, b.R, b.x, unturned, back);
        pair_manifold(&b.shape, &hull, b.shape_data->numbers, 0, &pose, limit, 0, &m);
        double expected = HUGE_VAL;
        for (int k = 0; k < m.count; ++k) expected = fmin(expected, m.points[k].separation);
        const double found = smallest_separation(&b, limit, NULL, &points);
        /* both prefer faces within 8 degrees by 5 % of the depth and 0.5 % of the thickness (manifold_hull.h), of which
         * a triangle may have another choice */
        const double most = 0.06 * fabs(expected) + 0.006 * thin;
        ck_assert_msg(fabs(found - expected) <= most, "pose %d: %.12g by the mesh, %.12g by the hull", i, found,
                      expected);
    }
    free(s);
    free(b.shape_data);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* Along a path over the surface (soup_walk_on). */
START_TEST(nothing_jumps_along_a_path)
{
    sadmm_mesh *mesh = soup_some_mesh(_i / SHAPES);
    struct beside b = {.shape_data = test_shape_data_new()};
    struct random r = {5000 + (uint64_t)_i};
    take_mesh(&b, mesh);
    take_shape(&b, _i % SHAPES, 1);
    uint32_t *memory = calloc((size_t)b.mesh.triangles, sizeof *memory);
    const double limit = 0.03, thin = geometry_thickness(&b.shape);
    for (int path = 0; path < fewer(3); ++path) {
        const struct soup_walk walk = {.R = b.R,
                                       .x = b.x,
                                       .limit = limit,
                                       .thin = thin,
                                       .reach = geometry_radius(&b.shape),
                                       .deepest = 0.1,
                                       .separation = smallest_separation,
                                       .beside = &b,
                                       .memory = memory};
        place_over(&b, &r, 0.2 * limit);
        bool at_end = false;
        if (distance_of(&b, &at_end) < 1e-6 || at_end) continue;
        memset(memory, 0, (size_t)b.mesh.triangles * sizeof *memory);
        soup_walk_on(&walk, &r, path);
    }
    free(memory);
    free(b.shape_data);
    sadmm_mesh_destroy(mesh);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold_mesh");
    TCase *cases = tcase_create("manifold_mesh");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, the_nearest_point_is_found, 0, SOUP_MESHES * SHAPES);
    tcase_add_loop_test(cases, a_convex_mesh_is_its_hull, 0, 3 * SHAPES);
    tcase_add_loop_test(cases, nothing_jumps_along_a_path, 0, SOUP_MESHES * SHAPES);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
