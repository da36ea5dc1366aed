/* Pairs of shapes in tests: poses, manifolds in the world frame, and independent oracles for distance and depth. */
#ifndef SADMM_TESTS_MANIFOLD_TOOLS_H
#define SADMM_TESTS_MANIFOLD_TOOLS_H

#ifndef ck_assert /* a program without Check brings its own */
#include <check.h>
#endif
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/array3.h"
#include "collision/base/bounds.h"
#include "collision/manifold/pair_manifold.h"

/* A deterministic generator: xorshift64*. */
struct random {
    uint64_t state;
};

static inline double random_unit(struct random *r) /* [0, 1) */
{
    r->state ^= r->state >> 12;
    r->state ^= r->state << 25;
    r->state ^= r->state >> 27;
    return (double)((r->state * UINT64_C(0x2545F4914F6CDD1D)) >> 11) * 0x1p-53;
}

static inline double random_in(struct random *r, double lo, double hi) { return lo + (hi - lo) * random_unit(r); }

/* The geometry of a type and its sizes. */
static inline struct sadmm_geometry geometry_of(int type, const double size[3])
{
    struct sadmm_geometry geometry = {.type = type, .subshapes = 1, .size = {size[0], size[1], size[2]}};
    return geometry;
}

/* A shape with a pose: R row-major, shape to world. */
struct solid {
    int type;
    double size[3];
    double R[9], x[3];
};

static inline void rotation(double R[9], double ax, double ay, double az, double angle)
{
    double n = sqrt(ax * ax + ay * ay + az * az), c = cos(angle), s = sin(angle), v = 1 - c;
    ax /= n;
    ay /= n;
    az /= n;
    R[0] = c + ax * ax * v;
    R[1] = ax * ay * v - az * s;
    R[2] = ax * az * v + ay * s;
    R[3] = ay * ax * v + az * s;
    R[4] = c + ay * ay * v;
    R[5] = ay * az * v - ax * s;
    R[6] = az * ax * v - ay * s;
    R[7] = az * ay * v + ax * s;
    R[8] = c + az * az * v;
}

static inline void random_rotation(struct random *r, double R[9])
{
    double a, b, c;
    do {
        a = random_in(r, -1, 1);
        b = random_in(r, -1, 1);
        c = random_in(r, -1, 1);
    } while (a * a + b * b + c * c > 1 || a * a + b * b + c * c < 1e-3);
    rotation(R, a, b, c, random_in(r, -M_PI, M_PI));
}

static inline void multiply(const double A[9], const double B[9], double out[9])
{
    double t[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) t[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
    memcpy(out, t, sizeof t);
}

static inline void apply(const double R[9], const double v[3], double out[3])
{
    double t[3];
    for (int i = 0; i < 3; ++i) t[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
    memcpy(out, t, sizeof t);
}

static inline double thickness_of(const struct solid *s)
{
    const struct sadmm_geometry geometry = geometry_of(s->type, s->size);
    return geometry_thickness(&geometry);
}

static inline double radius_of(const struct solid *s)
{
    const struct sadmm_geometry geometry = geometry_of(s->type, s->size);
    return geometry_radius(&geometry);
}

static inline struct solid solid_at(int type, double s0, double s1, double s2, double x, double y, double z)
{
    struct solid s = {.type = type, .size = {s0, s1, s2}, .R = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .x = {x, y, z}};
    return s;
}

static inline struct solid box_at(double hx, double hy, double hz, double x, double y, double z)
{
    return solid_at(SADMM_SHAPE_BOX, hx, hy, hz, x, y, z);
}

/* Turn about the solid's centre, in the world. */
static inline void turn(struct solid *s, double ax, double ay, double az, double angle)
{
    double R[9];
    rotation(R, ax, ay, az, angle);
    multiply(R, s->R, s->R);
}

static inline void move_rigidly(struct solid *s, const double R[9], const double x[3])
{
    multiply(R, s->R, s->R);
    apply(R, s->x, s->x);
    for (int k = 0; k < 3; ++k) s->x[k] += x[k];
}

/* A manifold in the world frame; the normal runs from the first solid to the second, in the order they were given. */
struct world_manifold {
    int count;
    double normal[3];
    double position[SADMM_MANIFOLD_POINTS][3];
    double separation[SADMM_MANIFOLD_POINTS];
    uint32_t feature[SADMM_MANIFOLD_POINTS];
    uint32_t cache;
};

static inline struct world_manifold touch(const struct solid *a, const struct solid *b, double limit, uint32_t cache)
{
    bool swap = a->type > b->type;
    const struct solid *first = swap ? b : a, *second = swap ? a : b;
    struct pair_pose pose = pair_pose(first->type == SADMM_SHAPE_PLANE, first->R, first->x, second->R, second->x);
    const struct sadmm_geometry a_is = geometry_of(first->type, first->size),
                                b_is = geometry_of(second->type, second->size);
    struct manifold m;
    struct world_manifold w = {0};

    memset(&m, 0x55, sizeof m); /* nothing may rely on what was there */
    pair_manifold(&a_is, &b_is, NULL, 0, &pose, limit, cache, &m);
    w.count = m.count;
    w.cache = m.cache;
    if (m.count == 0) return w;
    ck_assert_int_ge(m.count, 0);
    ck_assert_int_le(m.count, SADMM_MANIFOLD_POINTS);
    v3_store(m.normal, w.normal);
    ck_assert_double_eq_tol(dot3(w.normal, w.normal), 1, 1e-12); /* a handful of roundings */
    apply(second->R, w.normal, w.normal);
    if (swap)
        for (int k = 0; k < 3; ++k) w.normal[k] = -w.normal[k];
    for (int i = 0; i < m.count; ++i) {
        v3_store(m.points[i].position, w.position[i]);
        apply(second->R, w.position[i], w.position[i]);
        for (int k = 0; k < 3; ++k) w.position[i][k] += second->x[k];
        w.separation[i] = m.points[i].separation;
        w.feature[i] = m.points[i].feature;
        for (int j = 0; j < i; ++j) ck_assert_uint_ne(w.feature[i], w.feature[j]);
        ck_assert(isfinite(w.separation[i]) && isfinite(dot3(w.position[i], w.position[i])));
    }
    return w;
}

static inline double least_separation(const struct world_manifold *m)
{
    double least = HUGE_VAL;
    for (int i = 0; i < m->count; ++i) least = fmin(least, m->separation[i]);
    return least;
}

/* ---- oracles ----------------------------------------------------------------------------------------------------- */

/* Extent of a solid along a direction: half the width of its shadow. Not for planes. */
static inline double shadow(const struct solid *s, const double d[3])
{
    double r = 0;
    if (s->type == SADMM_SHAPE_SPHERE) return s->size[0];
    if (s->type == SADMM_SHAPE_CAPSULE)
        return s->size[0] + s->size[1] * fabs(s->R[2] * d[0] + s->R[5] * d[1] + s->R[8] * d[2]);
    for (int k = 0; k < 3; ++k) r += s->size[k] * fabs(s->R[k] * d[0] + s->R[3 + k] * d[1] + s->R[6 + k] * d[2]);
    return r;
}

/* Separation along the unit direction d, a to b: what b would have to move back along d until they touch. */
static inline double separation_along(const struct solid *a, const struct solid *b, const double d[3])
{
    double t[3] = {b->x[0] - a->x[0], b->x[1] - a->x[1], b->x[2] - a->x[2]};
    return dot3(t, d) - shadow(a, d) - shadow(b, d);
}

/* The k-th of n directions spread evenly over the sphere (golden spiral). */
static inline void spread_direction(int k, int n, double d[3])
{
    double z = 1 - (2 * k + 1.0) / n, r = sqrt(1 - z * z), phi = k * 2.399963229728653;
    d[0] = r * cos(phi);
    d[1] = r * sin(phi);
    d[2] = z;
}

/* Largest separation over n directions: at most the true one, and below it by no more than the separation between
 * directions allows. */
static inline double sweep_separation(const struct solid *a, const struct solid *b, int n)
{
    double best = -HUGE_VAL, d[3];
    for (int k = 0; k < n; ++k) {
        spread_direction(k, n, d);
        best = fmax(best, separation_along(a, b, d));
    }
    return best;
}

/* Largest separation over the 15 axes of two boxes, with no preference for any; *axis: its direction, a to b. */
static inline double box_separation(const struct solid *a, const struct solid *b, double axis[3])
{
    double best = -HUGE_VAL;
    if (axis) memset(axis, 0, 3 * sizeof *axis);
    for (int n = 0; n < 15; ++n) {
        double d[3], length, s;
        for (int k = 0; k < 3; ++k) d[k] = n < 3 ? a->R[3 * k + n] : b->R[3 * k + n % 3];
        if (n >= 6) {
            int i = (n - 6) / 3, j = (n - 6) % 3;
            double e[3] = {a->R[i], a->R[3 + i], a->R[6 + i]}, f[3] = {b->R[j], b->R[3 + j], b->R[6 + j]};
            d[0] = e[1] * f[2] - e[2] * f[1];
            d[1] = e[2] * f[0] - e[0] * f[2];
            d[2] = e[0] * f[1] - e[1] * f[0];
        }
        length = sqrt(dot3(d, d));
        if (length < 1e-6) continue; /* parallel edges: the faces cover them */
        for (int side = -1; side <= 1; side += 2) {
            double u[3] = {side * d[0] / length, side * d[1] / length, side * d[2] / length};
            s = separation_along(a, b, u);
            if (s > best) {
                best = s;
                if (axis) memcpy(axis, u, sizeof u);
            }
        }
    }
    return best;
}

/* Closest point of the solid's core (box; segment or centre without the radius) to p. */
static inline void project_on_core(const struct solid *s, const double p[3], double out[3])
{
    double local[3], d[3] = {p[0] - s->x[0], p[1] - s->x[1], p[2] - s->x[2]};
    for (int k = 0; k < 3; ++k) {
        double h =
            s->type == SADMM_SHAPE_BOX ? s->size[k] : (s->type == SADMM_SHAPE_CAPSULE && k == 2 ? s->size[1] : 0);
        double x = s->R[k] * d[0] + s->R[3 + k] * d[1] + s->R[6 + k] * d[2];
        local[k] = fmin(fmax(x, -h), h);
    }
    apply(s->R, local, out);
    for (int k = 0; k < 3; ++k) out[k] += s->x[k];
}

/* Distance of two solids by projecting back and forth between their cores, less the radii. Converges from above. */
static inline double distance_by_projection(const struct solid *a, const struct solid *b, int iterations)
{
    double p[3], q[3], radii = 0;
    memcpy(p, a->x, sizeof p);
    for (int i = 0; i < iterations; ++i) {
        project_on_core(b, p, q);
        project_on_core(a, q, p);
    }
    if (a->type != SADMM_SHAPE_BOX) radii += a->size[0];
    if (b->type != SADMM_SHAPE_BOX) radii += b->size[0];
    for (int k = 0; k < 3; ++k) p[k] -= q[k];
    return sqrt(dot3(p, p)) - radii;
}

/* How far outside the solid, grown by nothing, a point lies: <= 0 inside. */
static inline double outside(const struct solid *s, const double p[3])
{
    double q[3], d[3], worst = -HUGE_VAL;
    if (s->type != SADMM_SHAPE_BOX) {
        project_on_core(s, p, q);
        for (int k = 0; k < 3; ++k) d[k] = p[k] - q[k];
        return sqrt(dot3(d, d)) - s->size[0];
    }
    for (int k = 0; k < 3; ++k) d[k] = p[k] - s->x[k];
    for (int k = 0; k < 3; ++k)
        worst = fmax(worst, fabs(s->R[k] * d[0] + s->R[3 + k] * d[1] + s->R[6 + k] * d[2]) - s->size[k]);
    return worst;
}

#endif
