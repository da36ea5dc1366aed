/* Hulls in shape data, as a world has them, made without the library's own code. */
#ifndef SADMM_TESTS_HULL_SHAPES_H
#define SADMM_TESTS_HULL_SHAPES_H

#include <check.h>

#include "collision/shapes/input.h"
#include "hull_reference.h"

enum { TEST_SHAPE_DATA = 200000 };

/* Shape data with hulls of the tests. */
struct test_shape_data {
    double numbers[TEST_SHAPE_DATA];
    size_t used;
};

static inline struct test_shape_data *test_shape_data_new(void)
{
    struct test_shape_data *shape_data = calloc(1, sizeof *shape_data);
    static const double segment[2][3] = {{0, 0, -1}, {0, 0, 1}};
    struct test_hull h;
    double cube[8][3];
    ck_assert_ptr_nonnull(shape_data);
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) cube[v][k] = v >> k & 1 ? 1 : -1;
    test_hull_of((const double(*)[3])cube, 8, 1e-9, &h);
    ck_assert_int_eq(h.faces, 6);
    ck_assert_int_eq(h.edges, 12);
    test_hull_data(&h, shape_data->numbers + HULL_CUBE);
    memset(&h, 0, sizeof h);
    h.vertices = 2;
    h.edges = 1;
    memcpy(h.x, segment, sizeof segment);
    h.edge[0][1] = 1;
    test_hull_data(&h, shape_data->numbers + HULL_SEGMENT);
    memset(&h, 0, sizeof h);
    h.vertices = 1;
    test_hull_data(&h, shape_data->numbers + HULL_POINT);
    shape_data->used = HULL_FIRST_OWN;
    return shape_data;
}

/* Add a hull. */
static inline struct sadmm_geometry test_shape_data_add(struct test_shape_data *shape_data, const struct test_hull *h)
{
    struct sadmm_geometry geometry = {.type = SADMM_SHAPE_HULL, .subshapes = 1, .hull = (uint32_t)shape_data->used};
    ck_assert_uint_le(shape_data->used + (size_t)hull_doubles(h->vertices, h->faces, h->edges), TEST_SHAPE_DATA);
    test_hull_data(h, shape_data->numbers + shape_data->used);
    shape_data->used += (size_t)hull_doubles(h->vertices, h->faces, h->edges);
    for (int i = 0; i < h->vertices; ++i)
        for (int k = 0; k < 3; ++k) geometry.size[k] = fmax(geometry.size[k], fabs(h->x[i][k]) + h->convex_radius);
    return geometry;
}

/* [0, 1), xorshift64*. */
static inline double test_unit(uint64_t *state)
{
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    return (double)((*state * UINT64_C(0x2545F4914F6CDD1D)) >> 11) * 0x1p-53;
}

/* Points on an ellipsoid: each is a corner. */
static inline void random_hull(uint64_t *state, int count, const double size[3], struct test_hull *h)
{
    double x[TEST_HULL_POINTS][3];
    for (int i = 0; i < count; ++i) {
        double length;
        do {
            for (int k = 0; k < 3; ++k) x[i][k] = 2 * test_unit(state) - 1;
            length = t_norm(x[i]);
        } while (length > 1 || length < 0.1);
        for (int k = 0; k < 3; ++k) x[i][k] *= size[k] / length;
    }
    test_hull_of((const double(*)[3])x, count, 0, h);
    ck_assert_int_eq(h->vertices - h->edges + h->faces, 2);
}

static inline void box_hull(const double half[3], struct test_hull *h)
{
    double x[8][3];
    for (int v = 0; v < 8; ++v)
        for (int k = 0; k < 3; ++k) x[v][k] = v >> k & 1 ? half[k] : -half[k];
    test_hull_of((const double(*)[3])x, 8, 1e-9 * half[0], h);
}

/* An upright prism with a regular n-gon of radius 1. */
static inline void prism_hull(int n, double half, struct test_hull *h)
{
    double x[TEST_HULL_POINTS][3];
    for (int i = 0; i < 2 * n; ++i) {
        const double angle = 2 * M_PI * (i / 2) / n;
        x[i][0] = cos(angle);
        x[i][1] = sin(angle);
        x[i][2] = i % 2 ? half : -half;
    }
    test_hull_of((const double(*)[3])x, 2 * n, 1e-9, h);
}

#endif
