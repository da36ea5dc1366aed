/* The measure of overlaps in bench/overlap.c: cases with a known depth, the definition of depth by brute force, the
 * sweep against all pairs; and the statistics of depths in bench/depth_counts.c. */
#include <check.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "../bench/depth_counts.h"
#include "../bench/overlap.h"
#include "core/math/quat.h"
#include "run_suite.h"

static const double rounding = 1e-14; /* of a depth, m: lengths below 1 m, some ten operations */

static struct solid shape(sadmm_shape_type type, double x, double y, double z)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    def.type = type;
    def.size[0] = x, def.size[1] = y, def.size[2] = z;
    return solid_of_shape(&def);
}

static struct solid box(double x, double y, double z) { return shape(SADMM_SHAPE_BOX, x, y, z); }
static struct solid sphere(double radius) { return shape(SADMM_SHAPE_SPHERE, radius, 0, 0); }
static struct solid capsule(double radius, double half) { return shape(SADMM_SHAPE_CAPSULE, radius, half, 0); }

/* `turn`: rotation vector. */
static struct solid at(struct solid solid, double x, double y, double z, vec3 turn)
{
    const double position[3] = {x, y, z};
    double orientation[4];
    q_store(q_exp(turn), orientation);
    solid_place(&solid, position, orientation);
    return solid;
}

static const vec3 straight = {0, 0, 0};
static const double quarter = 1.5707963267948966;

static void expect_depth(const struct solid *a, const struct solid *b, double depth, const char *what)
{
    const double found[] = {overlap_depth(a, b), overlap_depth(b, a)}; /* in either order */
    for (int k = 0; k < 2; ++k)
        ck_assert_msg(fabs(found[k] - depth) < rounding, "%s: %.17g, not %.17g", what, found[k], depth);
}

static void expect_apart(const struct solid *a, const struct solid *b, const char *what)
{
    ck_assert_msg(overlap_depth(a, b) <= 0 && overlap_depth(b, a) <= 0, "%s: %g", what, overlap_depth(a, b));
}

/* ---- known depths ---------------------------------------------------------------------------------------------- */

START_TEST(boxes)
{
    const double h = 0.05, d = 0.003, slanted = sqrt(2) * h;
    const struct solid cube = at(box(h, h, h), 0, 0, 0, straight);
    struct solid other = at(box(h, h, 2 * h), 0.01, 0.02, 3 * h - d, straight);
    expect_depth(&cube, &other, d, "face on face");
    other = at(box(h, h, 2 * h), 0.01, 0.02, 3 * h + d, straight);
    expect_apart(&cube, &other, "face above face");
    /* Edges along x and y, one above the other: the depth is along z, on no face normal. */
    const struct solid below = at(box(h, h, h), 0, 0, 0, v3(quarter / 2, 0, 0));
    other = at(box(h, h, h), 0, 0, 2 * slanted - d, v3(0, quarter / 2, 0));
    expect_depth(&below, &other, d, "edge across edge");
    other = at(box(h, h, h), 0, 0, 2 * slanted + d, v3(0, quarter / 2, 0));
    expect_apart(&below, &other, "edge above edge");
    /* An edge in a face, parallel to two of its edges. */
    other = at(box(h, h, h), 0, 0, h + slanted - d, v3(quarter / 2, 0, 0));
    expect_depth(&cube, &other, d, "edge in face");
    /* A corner in a face: the diagonal upright, by a turn about the direction across both. */
    const double angle = acos(1 / sqrt(3));
    other = at(box(h, h, h), 0, 0, h + sqrt(3) * h - d, v3_scale(v3(1 / sqrt(2), -1 / sqrt(2), 0), angle));
    expect_depth(&cube, &other, d, "corner in face");
    /* One within the other. */
    other = at(box(0.01, 0.01, 0.01), 0.02, 0, 0, straight);
    expect_depth(&cube, &other, h - 0.02 + 0.01, "box in box");
}
END_TEST

/* Edges from exactly to barely parallel. About z the depth stays what it is; about x, the lower edge goes down with the
 * angle, and the depth is between that of the faces and that of the edge. */
START_TEST(nearly_parallel_boxes)
{
    const double h = 0.05, d = 0.003;
    const struct solid below = at(box(h, h, h), 0, 0, 0, straight);
    for (double angle = 1; angle > 1e-18; angle *= 0.3) {
        struct solid above = at(box(h, h, h), 0.01, 0, 2 * h - d, v3(0, 0, angle));
        expect_depth(&below, &above, d, "turned about the normal");
        if (angle > 0.1) continue;
        above = at(box(h, h, h), 0.01, 0, 2 * h - d, v3(angle, 0, 0));
        const double depth = overlap_depth(&below, &above), lowest = d - h + h * (cos(angle) + sin(angle));
        ck_assert_msg(depth > d * cos(angle) - h * angle * angle - rounding && depth < lowest + rounding,
                      "turned by %g: %.17g, the faces %.17g, the edge %.17g", angle, depth, d, lowest);
        above = at(box(h, h, h), 0.01, 0, 2 * h - d, v3(angle, angle, angle));
        const double general = overlap_depth(&below, &above);
        ck_assert_msg(general > d - 3 * h * angle - rounding && general < d + 3 * h * angle + rounding,
                      "turned by %g about all: %.17g", angle, general);
    }
}
END_TEST

/* Long bars on edge, one above the other: where they cross at an angle the depth is along z, and along the faces it is
 * more by their length times the angle. */
START_TEST(bars_that_cross_at_a_small_angle)
{
    const double h = 0.01, length = 10, d = 0.003, z = 2 * sqrt(2) * h - d;
    struct solid below = box(length, h, h), above = below;
    below = at(below, 0, 0, 0, v3(quarter / 2, 0, 0));
    for (double angle = 0.3; angle > 3e-4; angle *= 0.7) {
        double orientation[4];
        const double position[3] = {0, 0, z};
        q_store(q_mul(q_exp(v3(0, 0, angle)), q_exp(v3(quarter / 2, 0, 0))), orientation);
        solid_place(&above, position, orientation);
        /* The way along a direction is off by the reach in it times its own rounding, some epsilon over the angle. */
        ck_assert_double_eq_tol(overlap_depth(&below, &above), d, rounding + 10 * length * 1e-16 / angle);
    }
}
END_TEST

START_TEST(round_shapes)
{
    const double r = 0.02, d = 0.003, h = 0.05;
    const struct solid cube = at(box(h, h, h), 0, 0, 0, straight), ball = at(sphere(r), 0, 0, 0, straight);
    struct solid other = at(sphere(0.03), 0.03, 0, 0.04 - d, straight);
    expect_depth(&ball, &other, 0.05 - hypot(0.03, 0.04 - d), "spheres");
    expect_depth(&ball, &ball, 2 * r, "spheres about one centre");
    other = at(sphere(r), 0.01, 0.02, h + r - d, straight);
    expect_depth(&cube, &other, d, "sphere on face");
    other = at(sphere(r), h + 0.012, 0, h + 0.009, straight);
    expect_depth(&cube, &other, r - 0.015, "sphere on edge");
    other = at(sphere(r), h + 0.002, h + 0.006, h + 0.009, straight);
    expect_depth(&cube, &other, r - 0.011, "sphere on corner");
    other = at(sphere(r), h + 0.012, h + 0.012, h + 0.012, straight);
    expect_apart(&cube, &other, "sphere off corner");
    other = at(sphere(r), 0.04, 0, 0.01, straight);
    expect_depth(&cube, &other, r + h - 0.04, "centre of the sphere in the box");

    const struct solid rod = at(capsule(r, 0.1), 0, 0, 0, straight); /* along z */
    other = at(capsule(r, 0.1), 0.03, 0, 0.15, straight);
    expect_depth(&rod, &other, 2 * r - 0.03, "parallel capsules side by side");
    other = at(capsule(r, 0.1), 0.003, 0, 0.2 + 0.004, straight);
    expect_depth(&rod, &other, 2 * r - 0.005, "parallel capsules end to end");
    other = at(capsule(r, 0.1), 0.02, 0.03, 0.05, v3(quarter, 0, 0)); /* along y */
    expect_depth(&rod, &other, 2 * r - 0.02, "crossed capsules");
    other = at(capsule(r, 0.1), 0, 0.03, 0.05, v3(quarter, 0, 0));
    expect_depth(&rod, &other, 2 * r, "capsules whose axes meet");
    other = at(sphere(0.01), 0.02, 0, 0.05, straight);
    expect_depth(&rod, &other, r + 0.01 - 0.02, "sphere beside a capsule");
    other = at(sphere(0.01), 0, 0.006, 0.108, straight);
    expect_depth(&rod, &other, r + 0.01 - 0.01, "sphere at a capsule's end");

    other = at(capsule(r, 0.1), 0, 0.01, h + r - d, v3(0, quarter, 0)); /* lies on the cube, along x */
    expect_depth(&cube, &other, d, "capsule on face");
    other = at(capsule(r, 0.1), 0.01, 0, h + 0.1 + r - d, straight);
    expect_depth(&cube, &other, d, "capsule upright on face");
    other = at(capsule(r, 0.1), h + 0.01, h + 0.01, 0, straight);
    expect_depth(&cube, &other, r - sqrt(2) * 0.01, "capsule along edge");
    other = at(capsule(r, 0.1), h - 0.01, 0, 0.02, straight);
    expect_depth(&cube, &other, r + 0.01, "capsule through the box");
}
END_TEST

START_TEST(half_spaces)
{
    struct solid ground = shape(SADMM_SHAPE_PLANE, 0, 0, 0);
    ground = at(ground, 5, 7, 1, straight);
    const double h = 0.05, d = 0.003, angle = acos(1 / sqrt(3));
    struct solid other = at(box(h, h, h), 0, 0, 1 + sqrt(3) * h - d, v3_scale(v3(1 / sqrt(2), -1 / sqrt(2), 0), angle));
    expect_depth(&ground, &other, d, "corner in the ground");
    other = at(capsule(0.02, 0.1), 0, 0, 1 + 0.1 * cos(0.3) + 0.02 - d, v3(0.3, 0, 0));
    expect_depth(&ground, &other, d, "capsule in the ground");
    other = at(sphere(0.02), 0, 0, 1.021, straight);
    expect_apart(&ground, &other, "sphere above the ground");
    /* A slope: x goes downhill. */
    ground = at(ground, 0, 0, 0, v3(0, 0.4, 0));
    other = at(sphere(0.02), 0.017 * sin(0.4), 0, 0.017 * cos(0.4), straight);
    expect_depth(&ground, &other, 0.003, "sphere in a slope");
    ck_assert(isinf(solid_thickness(&ground)));
    ck_assert_double_eq_tol(solid_thickness(&other), 0.04, rounding);
    other = box(0.3, 0.01, 0.2);
    ck_assert_double_eq_tol(solid_thickness(&other), 0.02, rounding);
    other = capsule(0.02, 0.1);
    ck_assert_double_eq_tol(solid_thickness(&other), 0.04, rounding);
}
END_TEST

/* ---- brute force ----------------------------------------------------------------------------------------------- */

static uint64_t random_state;

/* In [-1, 1). */
static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) * 0x1p-52 - 1;
}

static struct solid random_solid(int kind, double spread)
{
    struct solid s = kind == 0 ? box(0.04 + 0.02 * uniform(), 0.05 + 0.03 * uniform(), 0.06 + 0.04 * uniform())
                   : kind == 1 ? sphere(0.05 + 0.03 * uniform())
                               : capsule(0.03 + 0.02 * uniform(), 0.06 + 0.05 * uniform());
    const double x = spread * uniform(), y = spread * uniform(), z = spread * uniform();
    return at(s, x, y, z, v3(3 * uniform(), 3 * uniform(), 3 * uniform()));
}

/* How far a solid reaches in a direction from its centre, by its corners. */
static double reach(const struct solid *s, vec3 n)
{
    double most = -INFINITY;
    for (int corner = 0; corner < 8; ++corner) {
        vec3 p = v3(0, 0, 0);
        for (int k = 0; k < 3; ++k) p = v3_madd(p, corner >> k & 1 ? s->half[k] : -s->half[k], s->axes[k]);
        most = fmax(most, v3_dot(p, n));
    }
    return most + s->radius;
}

/* How far b must go in direction n until the two are apart. */
static double way_apart(const struct solid *a, const struct solid *b, vec3 n)
{
    return reach(a, n) + reach(b, v3_neg(n)) - v3_dot(v3_sub(b->centre, a->centre), n);
}

static vec3 normalized(vec3 n) { return v3_scale(n, 1 / v3_norm(n)); }

/* The least way over all directions: some thousand of them, and from the best few down in ever smaller steps. */
static double least_way(const struct solid *a, const struct solid *b)
{
    enum { DIRECTIONS = 3000, BEST = 12 };
    vec3 best[BEST];
    double ways[BEST];
    for (int k = 0; k < BEST; ++k) ways[k] = INFINITY;
    for (int i = 0; i < DIRECTIONS; ++i) { /* Fibonacci's sphere: 0.065 rad apart */
        const double z = 1 - (2 * i + 1.0) / DIRECTIONS, turn = i * 2.399963229728653, r = sqrt(1 - z * z);
        const vec3 n = v3(r * cos(turn), r * sin(turn), z);
        const double way = way_apart(a, b, n);
        int worst = 0;
        for (int k = 1; k < BEST; ++k)
            if (ways[k] > ways[worst]) worst = k;
        if (way < ways[worst]) ways[worst] = way, best[worst] = n;
    }
    double least = INFINITY;
    for (int k = 0; k < BEST; ++k) {
        for (double size = 0.1; size > 1e-7; size *= 0.97) {
            const vec3 n = normalized(v3_add(best[k], v3_scale(v3(uniform(), uniform(), uniform()), size)));
            const double way = way_apart(a, b, n);
            if (way < ways[k]) ways[k] = way, best[k] = n, size *= 1.5;
        }
        least = fmin(least, ways[k]);
    }
    return least;
}

START_TEST(depth_is_the_least_way_apart)
{
    const int kinds[][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
    int overlapping = 0, found = 0;
    random_state = 1 + (uint64_t)_i;
    for (int k = 0; k < 60; ++k) {
        const struct solid a = random_solid(kinds[_i][0], 0.06), b = random_solid(kinds[_i][1], 0.06);
        const double depth = overlap_depth(&a, &b), way = least_way(&a, &b);
        /* No direction needs less, to rounding; the search comes close in nearly all cases, from above. */
        ck_assert_msg((depth > 0) == (way > 0), "pair %d: depth %g, least way %g", k, depth, way);
        if (depth <= 0) continue;
        ++overlapping;
        ck_assert_msg(way > depth - rounding, "pair %d: depth %.17g, but %.17g is enough", k, depth, way);
        ck_assert_msg(way < depth + 2e-3, "pair %d: depth %g, least way found %g", k, depth, way);
        found += way < depth + 1e-5;
    }
    ck_assert_int_gt(overlapping, 20);
    ck_assert_int_ge(found, overlapping - overlapping / 10);
}
END_TEST

/* ---- sweep ----------------------------------------------------------------------------------------------------- */

START_TEST(sweep_finds_all_pairs)
{
    enum { COUNT = 120 };
    static struct solid solids[COUNT];
    static double depths[COUNT][COUNT];
    struct overlaps overlaps = {0};
    random_state = 9;
    for (int round = 0; round < 5; ++round) { /* the sweep is used again */
        size_t expected = 0;
        for (int i = 0; i < COUNT; ++i) {
            solids[i] = random_solid(i % 3, 0.2 + 0.05 * round);
            solids[i].body = i / 2; /* two of a body */
            solids[i].fixed = i % 10 < 2;
        }
        solids[60] = at(shape(SADMM_SHAPE_PLANE, 0, 0, 0), 0, 0, -0.1, straight);
        solids[60].body = 30, solids[60].fixed = true;
        for (int i = 0; i < COUNT; ++i)
            for (int j = i + 1; j < COUNT; ++j) {
                const bool may = solids[i].body != solids[j].body && !(solids[i].fixed && solids[j].fixed);
                depths[i][j] = may ? fmax(0, overlap_depth(&solids[i], &solids[j])) : 0;
                expected += depths[i][j] > 0;
            }
        ck_assert(overlaps_find(&overlaps, solids, COUNT));
        ck_assert_uint_gt(expected, 100);
        ck_assert_uint_eq(overlaps.count, expected);
        for (size_t k = 0; k < overlaps.count; ++k) {
            const struct overlap *pair = &overlaps.pairs[k];
            ck_assert_int_lt(pair->a, pair->b);
            ck_assert(pair->depth > 0);
            ck_assert_double_eq_tol(pair->depth, depths[pair->a][pair->b], rounding); /* the other way round, maybe */
            depths[pair->a][pair->b] = -1; /* each once */
        }
    }
    overlaps_free(&overlaps);
}
END_TEST

/* ---- statistics ------------------------------------------------------------------------------------------------ */

/* Depths in a geometric sequence, counted in a shuffled order: the k-th of n is the quantile k / n. */
START_TEST(quantiles_are_those_of_the_depths)
{
    enum { COUNT = 10007 };
    static struct depth_counts counts;
    const double ratio = pow(1e-8 / 0.02, 1.0 / COUNT);
    ck_assert(depth_quantile(&counts, 0.5) == 0);
    int deep = 0;
    for (int k = 0; k < COUNT; ++k) {
        const double depth = 0.02 * pow(ratio, (k * 5003) % COUNT);
        depth_count(&counts, depth, 0.1);
        deep += depth > 0.001;
    }
    depth_count(&counts, 1e-10, 0.1); /* they touch */
    depth_count(&counts, 0, 0.1);
    ck_assert_int_eq(counts.count, COUNT);
    ck_assert_int_eq(counts.deep, deep);
    ck_assert(counts.deepest == 0.02);
    const double shares[] = {1e-4, 0.5, 0.99, 0.999, 1};
    for (size_t k = 0; k < sizeof shares / sizeof *shares; ++k) {
        const double rank = ceil(shares[k] * COUNT), exact = 0.02 * pow(ratio, COUNT - rank);
        /* Half a bin: 2^(1/128) - 1. */
        ck_assert_double_eq_tol(depth_quantile(&counts, shares[k]) / exact, 1, 0.0055);
    }
    ck_assert(depth_quantile(&counts, 1) <= counts.deepest);
    depth_count(&counts, 1e6, 1); /* beyond the last bin */
    ck_assert(counts.deepest == 1e6 && counts.count == COUNT + 1);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("overlap");
    TCase *cases = tcase_create("overlap");
    tcase_add_test(cases, boxes);
    tcase_add_test(cases, nearly_parallel_boxes);
    tcase_add_test(cases, bars_that_cross_at_a_small_angle);
    tcase_add_test(cases, round_shapes);
    tcase_add_test(cases, half_spaces);
    tcase_add_loop_test(cases, depth_is_the_least_way_apart, 0, 6);
    tcase_add_test(cases, sweep_finds_all_pairs);
    tcase_add_test(cases, quantiles_are_those_of_the_depths);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
