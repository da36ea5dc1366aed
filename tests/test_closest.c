/* Closest points of two shapes, held by what proves them: two points of the bodies that are as far apart as two planes
 * between them; and where bodies overlap, by all directions that a search of its own comes upon. */
#include <float.h>
#include <stdio.h>

#include "collision/query/closest.h"
#include "convex_tools.h"
#include "mesh_tools.h"
#include "run_suite.h"

static const int types[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,      SADMM_SHAPE_HULL,
                            SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
enum { TYPES = 7 };

static bool brief(void) { return getenv("SADMM_TEST_SHORT") != NULL; }

static struct sadmm_placed placed_of(const struct pair_of *t, int s)
{
    struct sadmm_placed p = {.geometry = t->g[s], .blocks = t->shape_data->numbers};
    memcpy(p.R, t->R[s], sizeof p.R);
    memcpy(p.x, t->x[s], sizeof p.x);
    return p;
}

static void random_pose(struct random *r, struct pair_of *t, int s, double within)
{
    random_rotation(r, t->R[s]);
    for (int k = 0; k < 3; ++k) t->x[s][k] = within * random_in(r, -1, 1);
}

/* The most that the two are apart along any direction, by climbing from many. */
static double most_apart(const struct pair_of *t, struct random *r, int starts)
{
    double most = -HUGE_VAL;
    for (int n = 0; n < starts; ++n) {
        double d[3], now, step = 0.5;
        for (int k = 0; k < 3; ++k) d[k] = random_in(r, -1, 1);
        const double length = t_norm(d);
        for (int k = 0; k < 3; ++k) d[k] /= length;
        now = apart_along(t, d);
        for (int tries = 0; tries < 150; ++tries) {
            double other[3];
            for (int k = 0; k < 3; ++k) other[k] = d[k] + step * random_in(r, -1, 1);
            const double size = t_norm(other);
            for (int k = 0; k < 3; ++k) other[k] /= size;
            const double there = apart_along(t, other);
            if (there > now) {
                now = there;
                memcpy(d, other, sizeof d);
            } else {
                step *= 0.93;
            }
        }
        most = fmax(most, now);
    }
    return most;
}

struct worst {
    double separation, inside, depth, point, beaten;
    double searched; /* what the search of directions is short of the depth, as a share of that and the thickness */
    int apart, overlapping;
};

static void check_pair(const struct pair_of *t, struct random *r, struct worst *worst)
{
    const struct sadmm_placed a = placed_of(t, 0), b = placed_of(t, 1);
    const double size = pair_size(t) + t_norm(t->x[0]) + t_norm(t->x[1]);
    struct sadmm_separation separation, back;
    double n[3], pa[3], pb[3], across[3];
    ck_assert(sadmm_closest(&a, &b, HUGE_VAL, &separation));
    ck_assert(sadmm_closest(&b, &a, HUGE_VAL, &back));
    v3_store(separation.normal, n);
    v3_store(separation.a, pa);
    v3_store(separation.b, pb);
    ck_assert_int_eq(separation.triangle, -1);
    ck_assert_double_eq_tol(t_norm(n), 1, 1e-14);
    for (int k = 0; k < 3; ++k) across[k] = pb[k] - pa[k] - separation.distance * n[k];
    ck_assert_double_le(t_norm(across), 1e-14 * size);
    worst->separation = fmax(worst->separation, fabs(apart_along(t, n) - separation.distance) / size);
    const double outside = fmax(own_outside(t, 0, pa), own_outside(t, 1, pb));
    if (separation.distance >= 0) { /* the points prove that it is no more, the planes that it is no less */
        worst->inside = fmax(worst->inside, outside / size);
        ck_assert_double_eq_tol(back.distance, separation.distance, 1e-11 * size);
        ++worst->apart;
    } else {
        worst->point = fmax(worst->point, outside / size);
        const double best = most_apart(t, r, 60), beaten = best - separation.distance;
        worst->searched = fmax(worst->searched, -beaten / (pair_thin(t) - separation.distance));
        worst->depth = fmax(worst->depth, beaten / (0.02 * -separation.distance + 1e-3 * pair_thin(t)));
        worst->beaten = fmax(worst->beaten, beaten / size);
        ++worst->overlapping;
    }
    /* the limit is that of the distance */
    if (separation.distance > 1e-9 * size) {
        struct sadmm_separation limited;
        ck_assert(!sadmm_closest(&a, &b, separation.distance * 0.999, &limited));
        ck_assert(sadmm_closest(&a, &b, separation.distance * 1.001, &limited));
        ck_assert_double_eq_tol(limited.distance, separation.distance, 1e-11 * size);
    }
}

/* All pairs of types. */
START_TEST(pairs)
{
    const int one = types[_i / TYPES], two = types[_i % TYPES], pairs_of_them = brief() ? 4 : 40;
    struct random r = {(uint64_t)_i * 131 + 7};
    struct worst worst = {0};
    for (int n = 0; n < pairs_of_them; ++n) {
        struct pair_of t = {.shape_data = test_shape_data_new()};
        const double scale = pow(10, random_in(&r, -2, 2));
        random_shape_of(&r, &t, 0, one, scale);
        random_shape_of(&r, &t, 1, two, scale * random_in(&r, 0.3, 1));
        random_pose(&r, &t, 0, n % 3 == 0 ? 0.3 * scale : 3 * scale);
        random_pose(&r, &t, 1, n % 3 == 0 ? 0.3 * scale : 1.5 * scale);
        if (n % 5 == 4) { /* along each other */
            memcpy(t.R[1], t.R[0], sizeof t.R[0]);
            if (n % 2)
                for (int k = 0; k < 3; ++k) t.x[1][k] = t.x[0][k] + 2.1 * scale * t.R[0][3 * k + n % 3];
        }
        check_pair(&t, &r, &worst);
        free(t.shape_data);
    }
    if (!brief()) ck_assert_int_gt(worst.apart, pairs_of_them / 8);
    if (!brief()) ck_assert_int_gt(worst.overlapping, pairs_of_them / 10);
    ck_assert_msg(worst.searched <= 0.02, "types %d and %d: the search is short of the depth by %g", one, two,
                  worst.searched);
    ck_assert_msg(worst.separation <= 1e-12, "types %d and %d: separation off by %g", one, two, worst.separation);
    ck_assert_msg(worst.inside <= 1e-10, "types %d and %d: apart, points outside by %g", one, two, worst.inside);
    ck_assert_msg(worst.point <= 1e-5, "types %d and %d: overlapping, points outside by %g", one, two, worst.point);
    ck_assert_msg(worst.depth <= 1, "types %d and %d: %g of what depth may be off by (%g of the size)", one, two,
                  worst.depth, worst.beaten);
}
END_TEST

/* What has no direction: middles in one place. */
START_TEST(one_in_the_other)
{
    struct pair_of t = {.shape_data = test_shape_data_new()};
    struct random r = {5};
    for (int one = 0; one < TYPES; ++one)
        for (int two = 0; two < TYPES; ++two)
            for (int turned = 0; turned < 2; ++turned) {
                struct worst worst = {0};
                const double unit[3] = {1, 1.2, 0.9}, half[3] = {0.5, 0.4, 0.6};
                t.shape_data->used = HULL_FIRST_OWN;
                for (int s = 0; s < 2; ++s) {
                    const int type = types[s ? two : one];
                    t.g[s] = geometry_of(type, s ? half : unit);
                    memset(t.x[s], 0, sizeof t.x[s]);
                    rotation(t.R[s], 1, 2, 3, turned * s);
                    if (type != SADMM_SHAPE_HULL) continue;
                    box_hull(s ? half : unit, &t.h[s]);
                    t.g[s] = test_shape_data_add(t.shape_data, &t.h[s]);
                }
                check_pair(&t, &r, &worst);
                ck_assert_int_eq(worst.overlapping, 1);
                ck_assert_msg(worst.depth <= 1 && worst.separation <= 1e-12, "types %d and %d: %g, %g", types[one],
                              types[two], worst.depth, worst.separation);
            }
    free(t.shape_data);
}
END_TEST

START_TEST(planes)
{
    struct random r = {31};
    for (int n = 0; n < (brief() ? 20 : 200); ++n) {
        struct pair_of t = {.shape_data = test_shape_data_new()};
        const double unused[3] = {0, 0, 0};
        struct sadmm_separation separation, back;
        double down[3], up[3], way[3], at[3];
        t.g[0] = geometry_of(SADMM_SHAPE_PLANE, unused);
        random_shape_of(&r, &t, 1, types[n % TYPES], 1);
        random_pose(&r, &t, 0, 3);
        random_pose(&r, &t, 1, 3);
        if (n % 4 == 3) memcpy(t.R[1], t.R[0], sizeof t.R[0]);
        for (int k = 0; k < 3; ++k) {
            up[k] = t.R[0][3 * k + 2];
            down[k] = -up[k];
        }
        t_sub(t.x[1], t.x[0], way);
        const double wanted = t_dot(up, way) - own_support(&t, 1, down);
        const struct sadmm_placed a = placed_of(&t, 0), b = placed_of(&t, 1);
        ck_assert(sadmm_closest(&a, &b, HUGE_VAL, &separation));
        ck_assert(sadmm_closest(&b, &a, HUGE_VAL, &back));
        ck_assert_double_eq_tol(separation.distance, wanted, 1e-14);
        ck_assert_double_eq_tol(back.distance, wanted, 1e-14);
        ck_assert_double_eq_tol(v3_norm(v3_add(separation.normal, back.normal)), 0, 1e-15);
        ck_assert_double_eq_tol(v3_norm(v3_sub(separation.normal, v3_load(up))), 0, 1e-14);
        v3_store(separation.b, at);
        ck_assert_double_le(own_outside(&t, 1, at), 1e-13);
        ck_assert_double_eq_tol(v3_norm(v3_sub(v3_madd(separation.a, separation.distance, separation.normal),
                                               separation.b)), 0, 1e-14);
        free(t.shape_data);
    }
    ck_assert(!sadmm_closest_is_known(SADMM_SHAPE_PLANE, SADMM_SHAPE_PLANE));
    ck_assert(!sadmm_closest_is_known(SADMM_SHAPE_MESH, SADMM_SHAPE_MESH));
    for (int type = 0; type < SADMM_SHAPE_TYPE_COUNT; ++type) {
        ck_assert(sadmm_closest_is_known(SADMM_SHAPE_PLANE, type) == (type != SADMM_SHAPE_PLANE));
        ck_assert(sadmm_closest_is_known(type, SADMM_SHAPE_MESH) == (type != SADMM_SHAPE_MESH));
    }
}
END_TEST

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

/* Every triangle as a mesh of its own. */
struct alone {
    sadmm_mesh *mesh;
    double middle[3];
};

static struct alone *take_apart(const struct mesh *m)
{
    struct alone *all = calloc((size_t)m->triangles, sizeof *all);
    for (int32_t t = 0; t < m->triangles; ++t) {
        static const int32_t order[3] = {0, 1, 2};
        int32_t corner[3], opposite[3];
        double x[9];
        const sadmm_mesh_def def = {sizeof def, x, 3, order, 1};
        mesh_corners(m, t, corner, opposite);
        for (int c = 0; c < 3; ++c) v3_store(mesh_vertex(m, corner[c]), x + 3 * c);
        ck_assert_int_eq(sadmm_mesh_create(&def, &all[t].mesh), SADMM_OK);
        memcpy(all[t].middle, all[t].mesh->middle, sizeof all[t].middle);
    }
    return all;
}

/* The nearest triangle, or the deepest, of all; balls by a distance that shares nothing with the library. */
START_TEST(meshes)
{
    struct random r = {(uint64_t)_i * 37 + 5};
    sadmm_mesh *mesh = soup_some_mesh(_i);
    struct mesh m;
    mesh_at(mesh->block, 0, &m);
    struct alone *all = take_apart(&m);
    int apart = 0, overlapping = 0;
    for (int n = 0; n < (brief() ? 4 : 56); ++n) {
        struct pair_of t = {.shape_data = test_shape_data_new()};
        struct sadmm_placed b = {.geometry = {.type = SADMM_SHAPE_MESH}, .blocks = mesh->block};
        struct sadmm_separation separation, back, limited;
        memcpy(b.geometry.size, mesh->half, sizeof mesh->half);
        random_shape_of(&r, &t, 0, types[n % TYPES], random_in(&r, 0.1, 0.6));
        random_pose(&r, &t, 0, n % 4 == 3 ? 6 : 1.2);
        random_rotation(&r, b.R);
        for (int k = 0; k < 3; ++k) b.x[k] = random_in(&r, -0.3, 0.3);
        const struct sadmm_placed a = placed_of(&t, 0);
        ck_assert(sadmm_closest(&a, &b, HUGE_VAL, &separation));
        ck_assert(sadmm_closest(&b, &a, HUGE_VAL, &back));
        ck_assert(back.distance == separation.distance && back.triangle == separation.triangle);
        double least = HUGE_VAL;
        for (int32_t i = 0; i < m.triangles; ++i) {
            struct sadmm_placed single = b;
            struct sadmm_separation one;
            double x[3];
            single.blocks = all[i].mesh->block;
            memcpy(single.geometry.size, all[i].mesh->half, sizeof single.geometry.size);
            apply(b.R, all[i].middle, x);
            for (int k = 0; k < 3; ++k) single.x[k] = b.x[k] + x[k];
            ck_assert(sadmm_closest(&a, &single, HUGE_VAL, &one));
            least = fmin(least, one.distance);
            if (t.g[0].type != SADMM_SHAPE_SPHERE) continue;
            double corner[3][3];
            int32_t numbers[3], opposite[3];
            mesh_corners(&m, i, numbers, opposite);
            for (int c = 0; c < 3; ++c) {
                double own[3];
                v3_store(mesh_vertex(&m, numbers[c]), own);
                apply(b.R, own, corner[c]);
                for (int k = 0; k < 3; ++k) corner[c][k] += b.x[k];
            }
            const double to_ball = test_point_triangle(t.x[0], corner[0], corner[1], corner[2]) - t.g[0].size[0];
            if (to_ball >= 0) ck_assert_double_eq_tol(one.distance, to_ball, 1e-13);
            else ck_assert_double_le(one.distance, to_ball + 1e-13); /* as deep at least: it has one side */
        }
        /* 1e-12 of 10 m; of smooth bodies deep in a triangle the way out is found as exactly as
         * docs/internals/contact-geometry.md says */
        const double tolerance = separation.distance < 0 && geometry_is_smooth(&t.g[0])
                                     ? 1e-3 * geometry_thickness(&t.g[0]) - 0.02 * separation.distance
                                     : 1e-11;
        ck_assert_msg(fabs(separation.distance - least) <= tolerance, "type %d: %.15g, nearest of all is %.15g",
                      t.g[0].type, separation.distance, least);
        if (separation.distance > 1e-6) {
            ck_assert(!sadmm_closest(&a, &b, separation.distance * 0.99, &limited));
            ck_assert(sadmm_closest(&a, &b, separation.distance * 1.01, &limited));
            ck_assert_double_eq_tol(limited.distance, separation.distance, 1e-11);
        }
        double at[3], n_[3];
        v3_store(separation.a, at);
        v3_store(separation.normal, n_);
        if (separation.distance >= 0) { /* the body's point is in it, and the triangle's on it */
            double corner[3][3];
            int32_t numbers[3], opposite[3];
            ck_assert_double_le(own_outside(&t, 0, at), 1e-10);
            mesh_corners(&m, separation.triangle, numbers, opposite);
            for (int c = 0; c < 3; ++c) {
                double own[3];
                v3_store(mesh_vertex(&m, numbers[c]), own);
                apply(b.R, own, corner[c]);
                for (int k = 0; k < 3; ++k) corner[c][k] += b.x[k];
            }
            v3_store(separation.b, at);
            ck_assert_double_le(test_point_triangle(at, corner[0], corner[1], corner[2]), 1e-10);
            ++apart;
        } else {
            ++overlapping;
        }
        free(t.shape_data);
    }
    if (!brief()) ck_assert_int_gt(apart, 5);
    if (!brief()) ck_assert_int_gt(overlapping, 3);
    for (int32_t i = 0; i < m.triangles; ++i) sadmm_mesh_destroy(all[i].mesh);
    free(all);
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* What has sunk into flat ground is as deep as it has sunk, however the ground is divided, and is pushed up. */
START_TEST(sunk_into_ground)
{
    sadmm_mesh *mesh = soup_some_mesh(3);
    struct random r = {8};
    for (int n = 0; n < 70; ++n) {
        struct pair_of t = {.shape_data = test_shape_data_new()};
        struct sadmm_placed b = {.geometry = {.type = SADMM_SHAPE_MESH}, .blocks = mesh->block};
        static const double down[3] = {0, 0, -1};
        struct sadmm_separation separation;
        memcpy(b.geometry.size, mesh->half, sizeof mesh->half);
        rotation(b.R, 1, 0, 0, 0);
        random_shape_of(&r, &t, 0, types[n % TYPES], 0.4);
        random_pose(&r, &t, 0, 0.8);
        const double depth = 0.05 * geometry_thickness(&t.g[0]);
        t.x[0][2] = own_support(&t, 0, down) - depth;
        const struct sadmm_placed a = placed_of(&t, 0);
        ck_assert(sadmm_closest(&a, &b, HUGE_VAL, &separation));
        /* less where the lowest point is near the sides of the triangles that have it: the way past those is shorter */
        ck_assert_double_ge(separation.distance, -depth - 1e-12);
        ck_assert_double_le(separation.distance, -0.2 * depth);
        free(t.shape_data);
    }
    sadmm_mesh_destroy(mesh);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("closest");
    TCase *tcase = tcase_create("closest");
    tcase_add_loop_test(tcase, pairs, 0, TYPES * TYPES);
    tcase_add_test(tcase, one_in_the_other);
    tcase_add_test(tcase, planes);
    tcase_add_loop_test(tcase, meshes, 0, SOUP_MESHES);
    tcase_add_test(tcase, sunk_into_ground);
    suite_add_tcase(suite, tcase);
    return run_suite(suite);
}
