/* Convex hulls: the polyhedron that points make, whatever their order, repetitions and company inside; what is refused,
 * and how it is reported; the block that contact finding reads. */
#include <check.h>

#include "collision/hull/hull_write.h"
#include "core/base/memory.h"
#include "hull_tools.h"
#include "run_suite.h"

static sadmm_hull *make(const struct cloud *c, double merge, double bend)
{
    sadmm_hull *hull = NULL;
    const sadmm_status status = try_hull(c, merge, &hull);
    ck_assert_msg(status == SADMM_OK, "%s", sadmm_last_message());
    check_hull(hull, c, bend);
    return hull;
}

static void expect_counts(const sadmm_hull *hull, int32_t vertices, int32_t edges, int32_t faces)
{
    ck_assert_int_eq(sadmm_hull_vertex_count(hull), vertices);
    ck_assert_int_eq(sadmm_hull_edge_count(hull), edges);
    ck_assert_int_eq(sadmm_hull_face_count(hull), faces);
}

/* ---- shapes that are known ---- */

START_TEST(a_cube)
{
    const struct cloud c = box_cloud(0.1, 0.1, 0.1);
    sadmm_hull *hull = make(&c, 1e-6, 0);
    expect_counts(hull, 8, 12, 6);
    ck_assert_mem_eq(sadmm_hull_vertices(hull), c.x, 24 * sizeof(double));
    for (int32_t f = 0; f < 6; ++f) {
        sadmm_hull_face face;
        ck_assert_int_eq(sadmm_hull_face_at(hull, f, &face), SADMM_OK);
        ck_assert_int_eq(face.corner_count, 4);
        ck_assert_double_eq(face.offset, 0.1);
        ck_assert_double_eq(fabs(face.normal[0]) + fabs(face.normal[1]) + fabs(face.normal[2]), 1);
    }
    /* The frame of the points is kept, and their numbers. */
    const double unit[7] = {1};
    for (int k = 0; k < 3; ++k) ck_assert_double_eq(hull->half[k], 0.1);
    ck_assert_mem_eq(hull->orientation, unit, sizeof hull->orientation);
    ck_assert_mem_eq(hull->position, unit + 1, sizeof hull->position);
    sadmm_hull_destroy(hull);
}
END_TEST

/* The polyhedron stays what it is; what is around it grows. */
START_TEST(a_rounded_box)
{
    const struct cloud c = box_cloud(0.1, 0.2, 0.3);
    sadmm_hull *hull = NULL, *sharp = NULL;
    ck_assert_int_eq(try_hull(&c, 1e-6, &sharp), SADMM_OK);
    ck_assert_int_eq(try_round_hull(&c, 1e-6, 0.05, &hull), SADMM_OK);
    check_hull(hull, &c, 0);
    expect_counts(hull, 8, 12, 6);
    ck_assert_double_eq(sadmm_hull_convex_radius(hull), 0.05);
    ck_assert_double_eq(sadmm_hull_convex_radius(sharp), 0);
    ck_assert_mem_eq(sadmm_hull_vertices(hull), c.x, 24 * sizeof(double));
    for (int k = 0; k < 3; ++k) {
        ck_assert_double_eq(hull->half[k], sharp->half[k] + 0.05);
        ck_assert_double_eq(hull->position[k], sharp->position[k]);
    }
    for (int32_t f = 0; f < 6; ++f) {
        sadmm_hull_face face, same;
        ck_assert_int_eq(sadmm_hull_face_at(hull, f, &face), SADMM_OK);
        ck_assert_int_eq(sadmm_hull_face_at(sharp, f, &same), SADMM_OK);
        ck_assert_double_eq(face.offset, same.offset);
    }
    sadmm_hull_destroy(hull);
    sadmm_hull_destroy(sharp);
}
END_TEST

START_TEST(a_tetrahedron)
{
    const struct cloud c = {.x = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, .count = 4};
    sadmm_hull *hull = make(&c, 1e-6, 0);
    sadmm_hull_face face;
    expect_counts(hull, 4, 6, 4);
    ck_assert_int_eq(sadmm_hull_face_at(hull, 3, &face), SADMM_OK);
    ck_assert(face.corners[0] == 1 && face.corners[1] == 2 && face.corners[2] == 3);
    ck_assert_double_eq_tol(face.offset, 1 / sqrt(3), 1e-16);
    sadmm_hull_destroy(hull);
}
END_TEST

START_TEST(a_ball_of_32_points)
{
    const struct cloud c = ball_cloud();
    sadmm_hull *hull = make(&c, 1e-6, 1e-15);
    expect_counts(hull, 32, 90, 60);
    sadmm_hull_destroy(hull);
}
END_TEST

/* Caps of many corners stay one face each. */
START_TEST(a_prism)
{
    static const double turn[4] = {0.3, -0.5, 0.7, 0.2};
    for (int corners = 3; corners <= 1200; corners *= 20) {
        struct cloud c = prism_cloud(corners, 0.5, 0.2);
        place_cloud(&c, turn, 3, -40, 7);
        sadmm_hull *hull = make(&c, 1e-6, 4e-6);
        expect_counts(hull, 2 * corners, 3 * corners, corners + 2);
        int caps = 0;
        for (int32_t f = 0; f < corners + 2; ++f) {
            sadmm_hull_face face;
            ck_assert_int_eq(sadmm_hull_face_at(hull, f, &face), SADMM_OK);
            caps += face.corner_count == corners;
            ck_assert(face.corner_count == 4 || face.corner_count == corners);
        }
        ck_assert_int_eq(caps, 2);
        sadmm_hull_destroy(hull);
    }
}
END_TEST

/* Faces that are bent by less than `merge` are one; at 0 each piece is its own. */
START_TEST(a_box_that_is_not_quite_one)
{
    struct cloud c = box_cloud(0.1, 0.2, 0.3);
    uint64_t seed = 1;
    for (int k = 0; k < 24; ++k) c.x[k] += 6e-9 * next_number(&seed);
    sadmm_hull *hull = make(&c, 1e-6, 4e-8);
    expect_counts(hull, 8, 12, 6);
    sadmm_hull_destroy(hull);
    hull = make(&c, 0, 1e-15);
    expect_counts(hull, 8, 18, 12);
    sadmm_hull_destroy(hull);
}
END_TEST

/* A bump of less than `merge` on a face is no vertex, nor are points on an edge or in a face. */
START_TEST(points_that_make_no_corner)
{
    struct cloud c = box_cloud(1, 1, 1);
    add_point(&c, 0, 0, 1 + 1e-8);
    add_point(&c, 0.3, -0.2, -1);
    add_point(&c, 1, 1, 0.5);
    add_point(&c, 1, -0.25, 1);
    sadmm_hull *hull = make(&c, 1e-6, 2e-8);
    expect_counts(hull, 8, 12, 6);
    sadmm_hull_destroy(hull);
}
END_TEST

static void expect_same_bits(const sadmm_hull *a, const sadmm_hull *b)
{
    ck_assert_uint_eq(a->doubles, b->doubles);
    ck_assert_mem_eq(a->block, b->block, a->doubles * sizeof *a->block);
    ck_assert_mem_eq(a->half, b->half, sizeof a->half);
    ck_assert_mem_eq(a->position, b->position, sizeof a->position);
    ck_assert_mem_eq(a->orientation, b->orientation, sizeof a->orientation);
    ck_assert_mem_eq(a->axes, b->axes, sizeof a->axes);
    ck_assert_mem_eq(a->moments, b->moments, sizeof a->moments);
    ck_assert(a->volume == b->volume);
}

/* Points inside and repetitions do nothing, wherever they stand. */
START_TEST(company_is_ignored)
{
    struct cloud plain = ball_cloud(), c = {.count = 0};
    uint64_t seed = 2;
    for (size_t i = 0; i < plain.count; ++i) {
        for (int k = 0; k < 40; ++k)
            add_point(&c, 0.4 * next_number(&seed), 0.4 * next_number(&seed), 0.4 * next_number(&seed));
        for (size_t k = 0; k <= i; ++k) add_point(&c, plain.x[3 * k], plain.x[3 * k + 1], plain.x[3 * k + 2]);
    }
    sadmm_hull *a = make(&plain, 1e-6, 1e-15), *b = make(&c, 1e-6, 1e-15);
    expect_same_bits(a, b);
    sadmm_hull_destroy(a);
    sadmm_hull_destroy(b);
}
END_TEST

/* 0 and -0 are one point, read back as it was given first. */
START_TEST(zeros_of_either_sign)
{
    const struct cloud c = {.x = {-0.0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, .count = 5};
    sadmm_hull *hull = make(&c, 1e-6, 0);
    expect_counts(hull, 4, 6, 4);
    ck_assert(signbit(sadmm_hull_vertices(hull)[0]));
    sadmm_hull_destroy(hull);
}
END_TEST

/* Any order of the points: the same faces of the same points, and all numbers that do not go by vertices the same. */
START_TEST(order_does_not_matter)
{
    struct cloud c = {.count = 0};
    uint64_t seed = 3;
    for (int i = 0; i < 300; ++i) { /* on a lattice, so that many points are on one plane, nearly */
        double x[3];
        for (int k = 0; k < 3; ++k) x[k] = round(3 * next_number(&seed)) + 1e-9 * next_number(&seed);
        add_point(&c, x[0], x[1] + 0.3 * x[0], x[2]);
    }
    sadmm_hull *first = make(&c, 1e-6, 4e-5);
    for (int k = 0; k < 20; ++k) {
        shuffle_cloud(&c, (uint64_t)k);
        sadmm_hull *hull = make(&c, 1e-6, 4e-5);
        expect_counts(hull, first->vertex_count, first->edge_count, first->face_count);
        ck_assert_mem_eq(hull->half, first->half, sizeof hull->half);
        ck_assert_mem_eq(hull->position, first->position, sizeof hull->position);
        ck_assert_mem_eq(hull->orientation, first->orientation, sizeof hull->orientation);
        ck_assert_mem_eq(hull->axes, first->axes, sizeof hull->axes);
        ck_assert(hull->volume == first->volume);
        int32_t same = 0; /* faces with the same bits of the normal */
        for (int32_t f = 0; f < hull->face_count; ++f)
            for (int32_t g = 0; g < hull->face_count; ++g) {
                sadmm_hull_face a, b;
                ck_assert_int_eq(sadmm_hull_face_at(hull, f, &a), SADMM_OK);
                ck_assert_int_eq(sadmm_hull_face_at(first, g, &b), SADMM_OK);
                same += a.corner_count == b.corner_count && memcmp(a.normal, b.normal, sizeof a.normal) == 0 &&
                        a.offset == b.offset;
            }
        ck_assert_int_eq(same, hull->face_count);
        sadmm_hull_destroy(hull);
    }
    sadmm_hull_destroy(first);
}
END_TEST

/* A hull's vertices and its merge make it again, also where a point was left out that reached farthest along an axis: a
 * bump on the side that the extent is measured by, and dense points on an ellipsoid, of which many are left out. */
START_TEST(vertices_make_it_again)
{
    enum { COUNT = 3000 };
    static double points[3 * COUNT];
    int left_out_far = 0;
    for (int round = 0; round < 12; ++round) {
        sadmm_hull_def def = sadmm_hull_def_default();
        uint64_t seed = (uint64_t)round + 5;
        struct cloud box = box_cloud(1, 1, 2);
        add_point(&box, 0.1, 0, 2 + 1e-8);
        for (int i = 0; i < COUNT && round > 0; ++i) {
            vec3 x = v3(next_number(&seed), next_number(&seed), next_number(&seed));
            x = v3_scale(x, 1 / v3_norm(x));
            points[3 * i] = (float)x.x, points[3 * i + 1] = (float)(0.7 * x.y), points[3 * i + 2] = (float)(0.6 * x.z);
        }
        def.points = round ? points : box.x;
        def.point_count = round ? COUNT : box.count;
        def.merge = round ? pow(10, -6 + round % 4) : def.merge;
        sadmm_hull *hull, *again;
        ck_assert_int_eq(sadmm_hull_create(&def, &hull), SADMM_OK);
        double most[2] = {-1e9, -1e9};
        for (size_t i = 0; i < def.point_count; ++i) most[0] = fmax(most[0], def.points[3 * i + 2]);
        for (int32_t v = 0; v < hull->vertex_count; ++v) most[1] = fmax(most[1], hull->vertices[3 * v + 2]);
        left_out_far += most[1] < most[0];
        def.points = sadmm_hull_vertices(hull);
        def.point_count = (size_t)sadmm_hull_vertex_count(hull);
        ck_assert_int_eq(sadmm_hull_create(&def, &again), SADMM_OK);
        expect_same_bits(hull, again);
        ck_assert_int_eq(again->vertex_count, hull->vertex_count);
        ck_assert_mem_eq(again->vertices, hull->vertices, 3 * (size_t)hull->vertex_count * sizeof *hull->vertices);
        sadmm_hull_destroy(hull);
        sadmm_hull_destroy(again);
    }
    ck_assert_int_ge(left_out_far, 1);
}
END_TEST

/* The box that stands for a hull is the smallest of those that are tried: a turned box's own, a rod's along it. */
START_TEST(the_box_around)
{
    static const double turn[4] = {0.5, 0.1, -0.7, 0.4};
    struct cloud cube = box_cloud(0.3, 0.3, 0.3), rod = prism_cloud(7, 0.01, 0.5);
    place_cloud(&cube, turn, 1, 2, 3);
    place_cloud(&rod, turn, -1, 0, 2);
    sadmm_hull *hull = make(&cube, 1e-6, 3e-6);
    for (int k = 0; k < 3; ++k) ck_assert_double_eq_tol(hull->half[k], 0.3, 1e-14);
    sadmm_hull_destroy(hull);
    hull = make(&rod, 1e-6, 4e-6);
    ck_assert_double_lt(hull->half[0] * hull->half[1] * hull->half[2], 1.01 * 0.5 * 0.01 * 0.01);
    sadmm_hull_destroy(hull);
}
END_TEST

/* Small, large, and far from the origin. */
START_TEST(sizes)
{
    static const double sizes[] = {2e-6, 1e-3, 1, 1e3, 5e5};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; ++k) {
        struct cloud c = ball_cloud();
        for (size_t i = 0; i < 3 * c.count; ++i) c.x[i] *= sizes[k];
        sadmm_hull *hull = make(&c, 1e-6, 1e-14 * sizes[k]);
        expect_counts(hull, 32, 90, 60);
        sadmm_hull_destroy(hull);
    }
    struct cloud c = box_cloud(0.5, 0.5, 0.5);
    for (size_t i = 0; i < 3 * c.count; ++i) c.x[i] += 999999;
    sadmm_hull *hull = make(&c, 1e-6, 0);
    expect_counts(hull, 8, 12, 6);
    for (int k = 0; k < 3; ++k) ck_assert(hull->half[k] == 0.5 && hull->position[k] == 999999);
    sadmm_hull_destroy(hull);
}
END_TEST

/* So many points that those inside are left out first. */
START_TEST(a_hundred_thousand_points)
{
    enum { MANY = 100000 };
    double *x = malloc(3 * MANY * sizeof *x);
    const struct cloud ball = ball_cloud();
    uint64_t seed = 4;
    for (size_t i = 0; i < 3 * MANY; ++i) x[i] = 0.5 * next_number(&seed);
    for (size_t i = 0; i < ball.count; ++i) memcpy(x + 3 * (MANY - 1 - 3000 * i), ball.x + 3 * i, 3 * sizeof *x);
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_hull *hull = NULL;
    def.points = x;
    def.point_count = MANY;
    ck_assert_msg(sadmm_hull_create(&def, &hull) == SADMM_OK, "%s", sadmm_last_message());
    expect_counts(hull, 32, 90, 60);
    check_edges(hull);
    check_block(hull, 1e-14);
    sadmm_hull_destroy(hull);
    free(x);
}
END_TEST

/* ---- what is refused ---- */

static void expect_refused(const sadmm_hull_def *def, sadmm_status wanted, const char *text)
{
    sadmm_hull *hull = (sadmm_hull *)def;
    const sadmm_status status = sadmm_hull_create(def, &hull);
    ck_assert_msg(status == wanted, "%s for %s", sadmm_status_name(status), text);
    ck_assert_msg(strstr(sadmm_last_message(), text), "no \"%s\" in: %s", text, sadmm_last_message());
    ck_assert_ptr_null(hull);
}

static void expect_cloud_refused(const struct cloud *c, sadmm_status wanted, const char *text)
{
    sadmm_hull_def def = sadmm_hull_def_default();
    def.points = c->x;
    def.point_count = c->count;
    expect_refused(&def, wanted, text);
}

START_TEST(bad_arguments_are_refused)
{
    const sadmm_status bad = SADMM_ERROR_INVALID_ARGUMENT;
    static const double values[] = {NAN, INFINITY, -INFINITY, 1.01e6, -1.01e6};
    struct cloud c = box_cloud(1, 1, 1);
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_hull *hull;
    expect_refused(&def, bad, "def->points = NULL");
    def.points = c.x;
    expect_refused(&def, bad, "def->point_count = 0: must be in [4, 1000000]");
    def.point_count = 3;
    expect_refused(&def, bad, "def->point_count = 3: must be in [4, 1000000]");
    def.point_count = 1000001;
    expect_refused(&def, bad, "def->point_count = 1000001");
    def.point_count = 8;
    static const double merges[] = {NAN, -1e-9, 1.01e-2};
    for (int k = 0; k < 3; ++k) {
        def.merge = merges[k];
        expect_refused(&def, bad, "def->merge");
    }
    static const double radii[] = {NAN, -1e-9, 1.01e6};
    def.merge = 1e-6;
    for (int k = 0; k < 3; ++k) {
        def.convex_radius = radii[k];
        expect_refused(&def, bad, "def->convex_radius");
    }
    def.convex_radius = 0;
    for (size_t k = 0; k < sizeof values / sizeof *values; ++k) {
        c = box_cloud(1, 1, 1);
        c.x[13] = values[k];
        expect_cloud_refused(&c, bad, "def->points[13]");
    }
    ck_assert_int_eq(sadmm_hull_create(&def, NULL), bad);
    ck_assert_int_eq(sadmm_hull_create(NULL, &hull), bad);
    ck_assert_ptr_null(hull);
}
END_TEST

START_TEST(flat_points_are_refused)
{
    const sadmm_status bad = SADMM_ERROR_INVALID_ARGUMENT;
    static const double turn[4] = {0.5, 0.1, -0.7, 0.4};
    struct cloud point = {.count = 0}, line = point, plane = point, thin = box_cloud(1, 1, 0.9e-6);
    for (int k = 0; k < 20; ++k) {
        add_point(&point, 1, 2, 3);
        add_point(&line, 0.1 * k, -0.2 * k, 0.3 * k);
        add_point(&plane, cos(k), sin(k), 0);
    }
    place_cloud(&plane, turn, 1, 2, 3);
    place_cloud(&thin, turn, 1, 2, 3);
    expect_cloud_refused(&point, bad, "lie within 0 m of one point");
    expect_cloud_refused(&line, bad, "of a line");
    expect_cloud_refused(&plane, bad, "of a plane");
    expect_cloud_refused(&thin, bad, "lie within 1.8e-06 m of a plane");
    const struct cloud speck = box_cloud(4e-7, 4e-7, 4e-7);
    expect_cloud_refused(&speck, bad, "must reach farther than 1e-06 m");
    /* Just thick enough. */
    struct cloud card = box_cloud(1, 1, 1.5e-6), splinter = box_cloud(1.1e-6, 1.1e-6, 1);
    place_cloud(&card, turn, 0, 0, 0);
    place_cloud(&splinter, turn, 0, 0, 0);
    sadmm_hull *hull = make(&card, 1e-6, 1e-6);
    expect_counts(hull, 8, 12, 6);
    sadmm_hull_destroy(hull);
    hull = make(&splinter, 1e-6, 1e-6);
    expect_counts(hull, 8, 12, 6);
    sadmm_hull_destroy(hull);
}
END_TEST

/* Points on the unit sphere, no two near one another. */
static double *spiral(int count)
{
    double *x = malloc(3 * (size_t)count * sizeof *x);
    for (int i = 0; i < count; ++i) {
        const double z = (2 * i + 1.0) / count - 1, r = sqrt(1 - z * z), angle = 2.399963229728653 * i;
        x[3 * i] = r * cos(angle), x[3 * i + 1] = r * sin(angle), x[3 * i + 2] = z;
    }
    return x;
}

START_TEST(large_hulls_are_refused)
{
    static const struct {
        int count;
        const char *message;
    } cases[] = {{8192, NULL}, {8193, "8193 vertices and 24573 edges, may have 8192 and 32767"},
                 {40000, "more than 32768 of them are corners"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        double *x = spiral(cases[k].count);
        sadmm_hull_def def = sadmm_hull_def_default();
        sadmm_hull *hull = NULL;
        def.points = x;
        def.point_count = (size_t)cases[k].count;
        def.merge = 0;
        if (cases[k].message) expect_refused(&def, SADMM_ERROR_LIMIT, cases[k].message);
        else {
            ck_assert_msg(sadmm_hull_create(&def, &hull) == SADMM_OK, "%s", sadmm_last_message());
            expect_counts(hull, 8192, 24570, 16380);
            check_edges(hull);
            check_block(hull, 1e-14);
            sadmm_hull_destroy(hull);
        }
        free(x);
    }
}
END_TEST

START_TEST(queries_are_checked)
{
    const struct cloud c = box_cloud(1, 1, 1);
    sadmm_hull *hull = make(&c, 1e-6, 0);
    sadmm_hull_face face = {.corner_count = 77};
    ck_assert_int_eq(sadmm_hull_face_at(hull, -1, &face), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_last_message(), "face = -1: must be in [0, 6)");
    ck_assert_int_eq(sadmm_hull_face_at(hull, 6, &face), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(face.corner_count, 77);
    sadmm_hull_destroy(hull);
}
END_TEST

START_TEST(memory_runs_out)
{
    const struct cloud c = ball_cloud();
    long n = 0;
    for (;; ++n) {
        sadmm_hull *hull = (sadmm_hull *)&n;
        sadmm_test_fail_allocations_after(n);
        const sadmm_status status = try_hull(&c, 1e-6, &hull);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) {
            check_hull(hull, &c, 1e-15);
            sadmm_hull_destroy(hull);
            break;
        }
        ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
        ck_assert_ptr_null(hull);
        ck_assert_ptr_nonnull(strstr(sadmm_last_message(), "out of memory"));
    }
    ck_assert_int_gt(n, 20);
}
END_TEST

/* ---- the blocks that all shape data begins with ---- */

static const struct sadmm_hull_header *header_at(const double *shape_data, int offset)
{
    return (const struct sadmm_hull_header *)(shape_data + offset);
}

/* The farthest vertex in any direction is found, from wherever a search begins: also where merged faces, which are not
 * flat, have more corners than are inspected one by one. */
START_TEST(the_farthest_vertex_is_found)
{
    static const double merges[] = {0, 1e-6, 1e-3};
    struct cloud c = {.count = 0};
    for (int k = 0; k < 600; ++k) { /* a flat ellipsoid, by the golden spiral */
        const double z = 1 - (2 * k + 1.0) / 600, r = sqrt(1 - z * z), angle = k * 2.399963229728653;
        add_point(&c, r * cos(angle), r * sin(angle), 0.05 * z);
    }
    sadmm_hull *hull = NULL;
    ck_assert_int_eq(try_hull(&c, merges[_i], &hull), SADMM_OK);
    struct polytope p;
    polytope_at(hull->block, 0, &p);
    ck_assert_int_gt(p.vertices, POLYTOPE_SCAN);
    for (int k = 0; k < 20000; ++k) {
        const double z = 1 - (2 * k + 1.0) / 20000, r = sqrt(1 - z * z), angle = k * 2.399963229728653;
        const vec3 d = v3(r * cos(angle), r * sin(angle), z);
        double most = -HUGE_VAL;
        for (int v = 0; v < p.vertices; ++v) most = fmax(most, v3_dot(d, polytope_vertex(&p, v)));
        ck_assert_double_ge(v3_dot(d, polytope_vertex(&p, polytope_support(&p, d, k % p.vertices))), most - 1e-14);
    }
    sadmm_hull_destroy(hull);
}
END_TEST

START_TEST(the_first_blocks)
{
    double *shape_data = calloc(HULL_FIRST_OWN, sizeof *shape_data);
    struct polytope cube, segment, point;
    sadmm_hull_prelude(shape_data);
    polytope_at(shape_data, HULL_CUBE, &cube);
    ck_assert(cube.vertices == 8 && cube.faces == 6 && cube.edges == 12);
    ck_assert_int_eq(header_at(shape_data, HULL_CUBE)->doubles, HULL_CUBE_DOUBLES);
    for (int v = 0; v < 8; ++v)
        ck_assert(cube.x[v] == (v & 1 ? 1 : -1) && cube.y[v] == (v & 2 ? 1 : -1) && cube.z[v] == (v & 4 ? 1 : -1));
    for (int f = 0; f < 6; ++f) {
        const double *n[3] = {cube.nx, cube.ny, cube.nz};
        for (int k = 0; k < 3; ++k) ck_assert_double_eq(n[k][f], k != f / 2 ? 0 : (f % 2 ? -1 : 1));
        ck_assert_double_eq(cube.offset[f], 1);
    }
    /* A hull of a cube in that block's place holds all that holds of hulls. */
    struct cloud c = box_cloud(1, 1, 1);
    int32_t first[7], corners[24];
    for (int f = 0; f <= 6; ++f) first[f] = cube.face_first[f];
    for (int k = 0; k < 24; ++k) corners[k] = cube.corner_vertex[k];
    sadmm_hull as_hull = {.vertex_count = 8, .edge_count = 12, .face_count = 6, .block = shape_data + HULL_CUBE,
                          .doubles = HULL_CUBE_DOUBLES, .half = {1, 1, 1}, .orientation = {1, 0, 0, 0},
                          .vertices = c.x, .face_first = first, .corners = corners};
    check_edges(&as_hull);
    check_convex(&as_hull, &c, 0);
    check_block(&as_hull, 0);

    polytope_at(shape_data, HULL_SEGMENT, &segment);
    ck_assert(segment.vertices == 2 && segment.faces == 0 && segment.edges == 1);
    ck_assert_int_eq(header_at(shape_data, HULL_SEGMENT)->doubles, HULL_SEGMENT_DOUBLES);
    ck_assert(segment.x[0] == 0 && segment.x[1] == 0 && segment.y[1] == 0 && segment.z[0] == -1 && segment.z[1] == 1);
    ck_assert(segment.edge_vertex[0] == 0 && segment.edge_vertex[1] == 1);
    ck_assert(segment.vertex_first[1] == 1 && segment.vertex_first[2] == 2);
    ck_assert(segment.vertex_next[0] == 1 && segment.vertex_next[1] == 0);

    polytope_at(shape_data, HULL_POINT, &point);
    ck_assert(point.vertices == 1 && point.faces == 0 && point.edges == 0);
    ck_assert_int_eq(header_at(shape_data, HULL_POINT)->doubles, HULL_POINT_DOUBLES);
    ck_assert(point.x[0] == 0 && point.y[0] == 0 && point.z[0] == 0 && point.vertex_first[1] == 0);
    free(shape_data);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("hull");
    TCase *shapes = tcase_create("shapes"), *refusals = tcase_create("refusals");
    tcase_add_test(shapes, a_cube);
    tcase_add_test(shapes, a_rounded_box);
    tcase_add_test(shapes, a_tetrahedron);
    tcase_add_test(shapes, a_ball_of_32_points);
    tcase_add_test(shapes, a_prism);
    tcase_add_test(shapes, a_box_that_is_not_quite_one);
    tcase_add_test(shapes, points_that_make_no_corner);
    tcase_add_test(shapes, company_is_ignored);
    tcase_add_test(shapes, zeros_of_either_sign);
    tcase_add_test(shapes, order_does_not_matter);
    tcase_add_test(shapes, vertices_make_it_again);
    tcase_add_test(shapes, the_box_around);
    tcase_add_test(shapes, sizes);
    tcase_add_test(shapes, a_hundred_thousand_points);
    tcase_add_loop_test(shapes, the_farthest_vertex_is_found, 0, 3);
    tcase_add_test(shapes, the_first_blocks);
    tcase_add_test(refusals, bad_arguments_are_refused);
    tcase_add_test(refusals, flat_points_are_refused);
    tcase_add_test(refusals, large_hulls_are_refused);
    tcase_add_test(refusals, queries_are_checked);
    tcase_add_test(refusals, memory_runs_out);
    suite_add_tcase(suite, shapes);
    suite_add_tcase(suite, refusals);
    return run_suite(suite);
}
