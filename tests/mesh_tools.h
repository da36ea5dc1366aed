/* Meshes in tests: forms by formula. */
#ifndef TESTS_MESH_TOOLS_H
#define TESTS_MESH_TOOLS_H

#include <check.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "collision/mesh/mesh.h"
#include "collision/mesh/mesh_triangle.h"
#include "subadmm/subadmm.h"

enum { SOUP_VERTICES = 20000, SOUP_TRIANGLES = 40000 };

/* Triangles as a definition has them. */
struct soup {
    double x[3 * SOUP_VERTICES];
    int32_t corner[3 * SOUP_TRIANGLES];
    size_t vertices, triangles;
};

static inline struct soup *soup_new(void)
{
    struct soup *s = calloc(1, sizeof *s);
    ck_assert_ptr_nonnull(s);
    return s;
}

static inline int32_t soup_vertex(struct soup *s, double x, double y, double z)
{
    const double at[3] = {x, y, z};
    ck_assert_uint_lt(s->vertices, SOUP_VERTICES);
    memcpy(s->x + 3 * s->vertices, at, sizeof at);
    return (int32_t)s->vertices++;
}

static inline void soup_triangle(struct soup *s, int32_t a, int32_t b, int32_t c)
{
    const int32_t corner[3] = {a, b, c};
    ck_assert_uint_lt(s->triangles, SOUP_TRIANGLES);
    memcpy(s->corner + 3 * s->triangles++, corner, sizeof corner);
}

static inline sadmm_mesh *soup_mesh(const struct soup *s)
{
    const sadmm_mesh_def def = {sizeof def, s->x, s->vertices, s->corner, s->triangles};
    sadmm_mesh *mesh = NULL;
    ck_assert_msg(sadmm_mesh_create(&def, &mesh) == SADMM_OK, "%s", sadmm_last_message());
    return mesh;
}

/* [-1, 1), the same for the same seed. */
static inline double soup_number(uint64_t *state)
{
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    return 2 * ((double)((*state * UINT64_C(0x2545F4914F6CDD1D)) >> 11) * 0x1p-53) - 1;
}

/* z = height(x, y) over columns x rows points `spacing` apart about the origin; jitter: of points inside, as a share of
 * the spacing, below 1/4 (cells stay convex); diagonals of either kind. */
static inline struct soup *soup_ground(int columns, int rows, double spacing, double jitter, uint64_t seed,
                                       double (*height)(double x, double y))
{
    struct soup *s = soup_new();
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const bool inside = i > 0 && i < columns - 1 && j > 0 && j < rows - 1;
            double x = (i - 0.5 * (columns - 1)) * spacing, y = (j - 0.5 * (rows - 1)) * spacing;
            if (inside) {
                x += jitter * spacing * soup_number(&seed);
                y += jitter * spacing * soup_number(&seed);
            }
            soup_vertex(s, x, y, height(x, y));
        }
    for (int j = 0; j + 1 < rows; ++j)
        for (int i = 0; i + 1 < columns; ++i) {
            const int32_t a = j * columns + i, b = a + 1, c = a + columns, d = c + 1;
            if (soup_number(&seed) < 0 || jitter == 0) {
                soup_triangle(s, a, b, d);
                soup_triangle(s, a, d, c);
            } else {
                soup_triangle(s, a, b, c);
                soup_triangle(s, b, d, c);
            }
        }
    return s;
}

static inline double soup_flat(double x, double y)
{
    (void)x;
    (void)y;
    return 0;
}

/* A closed box, each side divided n times. */
static inline struct soup *soup_box(const double half[3], int n)
{
    struct soup *s = soup_new();
    for (int axis = 0; axis < 3; ++axis)
        for (int side = -1; side <= 1; side += 2) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            const int32_t first = (int32_t)s->vertices;
            for (int j = 0; j <= n; ++j)
                for (int i = 0; i <= n; ++i) {
                    double x[3];
                    x[axis] = side * half[axis];
                    x[u] = (2.0 * i / n - 1) * half[u];
                    x[v] = (2.0 * j / n - 1) * half[v];
                    soup_vertex(s, x[0], x[1], x[2]);
                }
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) {
                    const int32_t a = first + j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
                    soup_triangle(s, a, side > 0 ? b : d, side > 0 ? d : b);
                    soup_triangle(s, a, side > 0 ? d : c, side > 0 ? c : d);
                }
        }
    return s;
}

/* An octahedron on the unit sphere, each side divided n times, scaled. */
static inline struct soup *soup_ball(const double size[3], int n)
{
    struct soup *s = soup_new();
    for (int side = 0; side < 8; ++side) {
        const double sx = side & 1 ? -1 : 1, sy = side & 2 ? -1 : 1, sz = side & 4 ? -1 : 1;
        const bool turned = sx * sy * sz < 0;
        int32_t row[66], last[66];
        for (int j = 0; j <= n; ++j) {
            for (int i = 0; i <= n - j; ++i) {
                const double x = i, y = j, z = n - i - j, r = sqrt(x * x + y * y + z * z);
                row[i] = soup_vertex(s, sx * x / r * size[0], sy * y / r * size[1], sz * z / r * size[2]);
            }
            for (int i = 0; j > 0 && i <= n - j; ++i) {
                soup_triangle(s, last[i], turned ? row[i] : last[i + 1], turned ? last[i + 1] : row[i]);
                if (i < n - j)
                    soup_triangle(s, last[i + 1], turned ? row[i] : row[i + 1], turned ? row[i + 1] : row[i]);
            }
            memcpy(last, row, sizeof row);
        }
    }
    return s;
}

static inline double soup_waves(double x, double y) { return 0.2 * sin(3 * x) * cos(2 * y) + 0.1 * x; }
static inline double soup_steps(double x, double y) { return 0.3 * floor(2 * x + 0.1) + 0.2 * floor(1.5 * y); }
static inline double soup_peaks(double x, double y)
{
    return fmax(0, 0.5 - fabs(fmod(fabs(3 * x), 2) - 1)) * (y > 0 ? 1 : 0.1);
}

/* Meshes of all kinds. */
enum { SOUP_MESHES = 8 };
static inline sadmm_mesh *soup_some_mesh(int kind)
{
    const double half[3] = {1, 0.6, 0.3}, round[3] = {0.8, 1.1, 0.5};
    struct soup *s = NULL;
    sadmm_mesh *mesh = NULL;
    double z[24 * 20];
    uint64_t seed = 99;
    switch (kind) {
    case 0: s = soup_ground(16, 16, 0.2, 0.24, 5, soup_waves); break;
    case 1: s = soup_ground(21, 21, 0.15, 0.2, 6, soup_steps); break;
    case 2: s = soup_ground(25, 17, 0.13, 0, 7, soup_peaks); break;
    case 3: s = soup_ground(9, 9, 0.4, 0.24, 8, soup_flat); break;
    case 4: s = soup_box(half, 1); break;
    case 5: s = soup_box(half, 6); break;
    case 6: s = soup_ball(round, 8); break;
    default: { /* noise: every corner a peak or a pit */
        const sadmm_heightfield_def def = {sizeof def, z, 24, 20, {0.12, 0.15}};
        for (int i = 0; i < 24 * 20; ++i) z[i] = 0.15 * soup_number(&seed);
        ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
        return mesh;
    }
    }
    mesh = soup_mesh(s);
    free(s);
    return mesh;
}

#endif
