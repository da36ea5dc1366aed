/* Hulls that touch: nearest points and depth against a reference that tries all features, points and normals against
 * what the two shapes are, for as many poses as are asked for. */
#ifndef SADMM_TESTS_HULL_TOUCHES_H
#define SADMM_TESTS_HULL_TOUCHES_H

#include <check.h>
#include <stdio.h>

#include "fewer.h"
#include "pair_of.h"

static inline struct manifold touch_two(const struct pair_of *t, double limit, uint32_t cache)
{
    const struct pair_pose pose = pair_of_pose(t);
    struct manifold m;
    memset(&m, 0x55, sizeof m);
    pair_manifold(&t->g[0], &t->g[1], t->shape_data->numbers, 0, &pose, limit, cache, &m);
    ck_assert_int_ge(m.count, 0);
    ck_assert_int_le(m.count, SADMM_MANIFOLD_POINTS);
    return m;
}

static inline void rows_of(const double R[9], double rows[3][3])
{
    memcpy(rows, R, 9 * sizeof *R);
}

/* Distance, or minus the depth, by trying everything. */
static inline double reference(const struct pair_of *t)
{
    double xa[TEST_HULL_POINTS][3], xb[TEST_HULL_POINTS][3], Ra[3][3], Rb[3][3];
    rows_of(t->R[0], Ra);
    rows_of(t->R[1], Rb);
    test_hull_place(&t->h[0], Ra, t->x[0], xa);
    test_hull_place(&t->h[1], Rb, t->x[1], xb);
    const double axes = test_hulls_axes(&t->h[0], (const double(*)[3])xa, Ra, &t->h[1], (const double(*)[3])xb, Rb);
    return axes < 0 ? axes : test_hulls_distance(&t->h[0], (const double(*)[3])xa, &t->h[1], (const double(*)[3])xb);
}

static inline double size_of(const struct pair_of *t)
{
    double size = 0;
    for (int s = 0; s < 2; ++s) size += t_norm(t->g[s].size);
    return size;
}

/* The separation of the two along a direction of b's frame. */
static inline double along(const struct pair_of *t, vec3 n)
{
    double xa[TEST_HULL_POINTS][3], xb[TEST_HULL_POINTS][3], Ra[3][3], Rb[3][3], world[3], local[3];
    rows_of(t->R[0], Ra);
    rows_of(t->R[1], Rb);
    test_hull_place(&t->h[0], Ra, t->x[0], xa);
    test_hull_place(&t->h[1], Rb, t->x[1], xb);
    v3_store(n, local);
    for (int k = 0; k < 3; ++k) world[k] = t_dot(Rb[k], local);
    return test_apart_along((const double(*)[3])xa, t->h[0].vertices, (const double(*)[3])xb, t->h[1].vertices, world);
}

/* What a manifold says is true of the two: its normal parts them nearly as well as any, and its points are on both
 * surfaces, as far apart as they say. */
static inline void check_manifold(const struct pair_of *t, const struct manifold *m, double best, double limit,
                                  const char *what)
{
    const double size = size_of(t), rounding = 1e-10 * size,
                 thin = fmin(geometry_thickness(&t->g[0]), geometry_thickness(&t->g[1]));
    double least = HUGE_VAL;
    if (best > limit + rounding) return;
    ck_assert_msg(m->count > 0 || best > limit - rounding, "%s: no contact at %g (limit %g)", what, best, limit);
    if (m->count == 0) return;
    const double s = along(t, m->normal);
    ck_assert_msg(fabs(v3_norm(m->normal) - 1) < 1e-12, "%s: |n| - 1 = %g", what, v3_norm(m->normal) - 1);
    /* a face is preferred: manifold_hull.h */
    ck_assert_msg(s >= best - 0.1 * fabs(best) - 0.01 * thin - rounding && s <= best + rounding,
                  "%s: separation %g along the normal, best %g", what, s, best);
    for (int i = 0; i < m->count; ++i) {
        const struct manifold_point *p = &m->points[i];
        least = fmin(least, p->separation);
        /* no two planes across the normal are nearer to each other than the shapes */
        ck_assert_msg(p->separation >= s - rounding, "%s: point %d at %g, shapes at %g", what, i, p->separation, s);
        ck_assert_msg(p->separation <= limit + rounding, "%s: point %d at %g, limit %g", what, i, p->separation, limit);
        for (int k = 0; k < i; ++k) ck_assert_uint_ne(p->feature, m->points[k].feature);
        for (int side = 0; side < 2; ++side) { /* on the surface of each: no face of it is above, one is at it */
            double world[3], own[3], local[3], most = -HUGE_VAL;
            const double sign = side == 0 ? -0.5 : 0.5;
            v3_store(v3_madd(p->position, sign * p->separation, m->normal), local);
            for (int k = 0; k < 3; ++k)
                world[k] = t_dot(t->R[1] + 3 * k, local) + t->x[1][k] - t->x[side][k];
            for (int k = 0; k < 3; ++k)
                own[k] = t->R[side][k] * world[0] + t->R[side][3 + k] * world[1] + t->R[side][6 + k] * world[2];
            for (int f = 0; f < t->h[side].faces; ++f)
                most = fmax(most, t_dot(t->h[side].plane[f], own) - t->h[side].plane[f][3]);
            /* clipping is tolerant (MANIFOLD_SNAP), and so is the memory of two edges (MANIFOLD_KEEP_EXTENT); the
             * nearest points are not quite across the normal of a face that is preferred to theirs: each is half the
             * way aside, at up to 8 degrees */
            ck_assert_msg(fabs(most) <= 6e-3 * thin + 0.07 * fabs(p->separation) + rounding,
                          "%s: point %d of %d (%08x) is %g off surface %d, thin %g, separation %g, s %g, best %g", what,
                          i, m->count, p->feature, most, side, thin, p->separation, s, best);
        }
    }
}

/* The nearest features themselves, before any axis is preferred. */
static inline double nearest(const struct pair_of *t, vec3 start)
{
    const struct pair_pose pose = pair_of_pose(t);
    struct polytope_pair pair;
    struct polytope_axis axis;
    vec3 pa, pb;
    uint32_t feature;
    polytope_pair_make(&t->g[0], &t->g[1], t->shape_data->numbers, &pose, &pair);
    ck_assert(hull_nearest(&pair, start, 1e300, &axis, &pa, &pb, &feature));
    /* the points are as far apart as the axis says */
    ck_assert_double_eq_tol(v3_dot(axis.n, v3_sub(pb, pa)), axis.separation, 1e-9 * size_of(t));
    return axis.separation;
}

static inline void random_pose(struct random *r, double reach, struct pair_of *t)
{
    for (int s = 0; s < 2; ++s) random_rotation(r, t->R[s]);
    double d[3], length;
    do {
        for (int k = 0; k < 3; ++k) d[k] = random_in(r, -1, 1);
        length = t_norm(d);
    } while (length > 1 || length < 0.1);
    for (int k = 0; k < 3; ++k) {
        t->x[0][k] = size_of(t) * random_in(r, -1, 1);
        t->x[1][k] = t->x[0][k] + reach * d[k] / length;
    }
}

static inline void turn_by(double R[9], const double axis[3], double angle)
{
    double turn[9];
    rotation(turn, axis[0], axis[1], axis[2], angle);
    multiply(turn, R, R);
}

static inline void column_of(const double R[9], int j, double out[3])
{
    for (int k = 0; k < 3; ++k) out[k] = R[3 * k + j];
}

/* How many poses are tried, of hulls of at most so many corners, of sizes 10^-exponent to 10^exponent m. */
struct extent {
    int poses, corners;
    double exponent;
};

static inline int corners_of(struct random *r, const struct extent *extent)
{
    return 4 + (int)(random_unit(r) * (extent->corners - 3));
}

/* Hulls of many forms, plates, needles and boxes among them, deep, touching and apart; a new one every few poses. */
static inline void touch_hulls(uint64_t seed, const struct extent *extent)
{
    enum { POSES = 8 };
    struct random r = {.state = UINT64_C(88172645463325252) + seed};
    struct pair_of *t = calloc(1, sizeof *t);
    int tried = 0, touching = 0, close_by = 0;
    ck_assert_ptr_nonnull(t);
    t->shape_data = test_shape_data_new();
    for (int form = 0; tried < extent->poses; ++form) {
        double scale = 1;
        t->shape_data->used = HULL_FIRST_OWN;
        for (int s = 0; s < 2; ++s) {
            double size[3];
            const bool needle = form % 5 == 4;
            if (s == 0) scale = pow(10, random_in(&r, -extent->exponent, extent->exponent));
            else scale *= pow(10, random_in(&r, -2, 2));
            const double flat = pow(10, random_in(&r, -3, 0));
            for (int k = 0; k < 3; ++k)
                size[k] = scale * ((k == form % 3) != needle ? flat : random_in(&r, 0.5, 1));
            if (form % 4 == 3) box_hull(size, &t->h[s]);
            else random_hull(&r.state, corners_of(&r, extent), size, &t->h[s]);
            t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
            if (s == 0 && form % 8 == 7) {
                const struct sadmm_geometry box = {.type = SADMM_SHAPE_BOX, .subshapes = 1,
                                                   .size = {size[0], size[1], size[2]}};
                t->g[s] = box;
            }
        }
        for (int pose = 0; pose < POSES; ++pose) {
            char what[80];
            const double size = size_of(t);
            random_pose(&r, size * pow(random_unit(&r), 2), t);
            const double best = reference(t);
            ++tried;
            snprintf(what, sizeof what, "form %d pose %d", form, pose);
            const double found = nearest(t, v3(1, 0, 0));
            ck_assert_msg(fabs(found - best) <= 1e-10 * size, "%s: %g, should be %g (size %g)", what, found, best,
                          size);
            const struct manifold m = touch_two(t, 0.1 * size, 0);
            check_manifold(t, &m, best, 0.1 * size, what);
            /* touching: moved by the distance, and a little less or more */
            for (int touch = -2; touch <= 2 && best > -0.05 * size; ++touch) {
                double n[3], world[3];
                const struct manifold near = touch_two(t, 10 * size, 0);
                if (near.count == 0) break;
                v3_store(near.normal, n);
                for (int k = 0; k < 3; ++k) world[k] = t_dot(t->R[1] + 3 * k, n);
                const double wanted = touch * (touch % 2 ? 1e-12 : 1e-7) * size,
                             way = along(t, near.normal) - wanted;
                for (int k = 0; k < 3; ++k) t->x[1][k] -= way * world[k];
                const double now = reference(t);
                ++tried;
                const double there = nearest(t, near.normal);
                /* needles whose edges are nearly along each other are off by up to 2e-10, few enough of them: below */
                ck_assert_msg(fabs(there - now) <= 4e-10 * size, "%s touching %d: %g, should be %g (size %g)", what,
                              touch, there, now, size);
                close_by += fabs(there - now) <= 1e-10 * size;
                ++touching;
                const struct manifold close = touch_two(t, 0.01 * size, near.cache);
                check_manifold(t, &close, now, 0.01 * size, what);
            }
        }
    }
    ck_assert_int_le(touching - close_by, tried / 20000);
    free(t->shape_data);
    free(t);
}

/* Put b onto a: against its separation along the normal from a to b, with `separation` left. */
static inline void put_together(struct pair_of *t, double separation)
{
    const struct manifold m = touch_two(t, 100 * size_of(t), 0);
    double n[3], world[3];
    ck_assert_int_gt(m.count, 0);
    v3_store(m.normal, n);
    for (int k = 0; k < 3; ++k) world[k] = t_dot(t->R[1] + 3 * k, n);
    const double way = along(t, m.normal) - separation;
    for (int k = 0; k < 3; ++k) t->x[1][k] -= way * world[k];
}

/* Spheres and capsules, as a point and a segment with a radius. */
static inline void touch_round(uint64_t seed, bool capsule, const struct extent *extent)
{
    struct random r = {.state = 31 + seed};
    struct pair_of *t = calloc(1, sizeof *t);
    const double unit[3] = {1, 0.8, 0.6};
    t->shape_data = test_shape_data_new();
    for (int pose = 0; pose < extent->poses; ++pose) {
        const double radius = random_in(&r, 0.05, 0.5), length = capsule ? random_in(&r, 0.05, 1) : 0;
        t->shape_data->used = HULL_FIRST_OWN;
        random_hull(&r.state, corners_of(&r, extent), unit, &t->h[1]);
        t->g[1] = test_shape_data_add(t->shape_data, &t->h[1]);
        memset(&t->h[0], 0, sizeof t->h[0]);
        t->h[0].vertices = length > 0 ? 2 : 1;
        t->h[0].edges = length > 0 ? 1 : 0;
        t->h[0].edge[0][1] = 1;
        t->h[0].x[0][2] = -length;
        t->h[0].x[1][2] = length;
        const struct sadmm_geometry round = {.type = length > 0 ? SADMM_SHAPE_CAPSULE : SADMM_SHAPE_SPHERE,
                                             .subshapes = 1, .size = {radius, length, 0}};
        t->g[0] = round;
        random_pose(&r, random_in(&r, 0, 2), t);
        const double best = reference(t) - radius, found = nearest(t, v3(0, 0, 1));
        ck_assert_msg(fabs(found - best) <= 1e-10, "pose %d: %g, should be %g", pose, found, best);
        const struct manifold m = touch_two(t, 0.2, 0);
        if (best > 0.2 + 1e-10) {
            ck_assert_int_eq(m.count, 0);
            continue;
        }
        ck_assert_int_gt(m.count, 0);
        ck_assert_int_le(m.count, length > 0 ? 3 : 1);
        double least = HUGE_VAL;
        for (int i = 0; i < m.count; ++i) least = fmin(least, m.points[i].separation);
        ck_assert_double_eq_tol(least, best, MANIFOLD_FLAT * radius + 1e-9); /* ends of a capsule that lie evenly */
        ck_assert_double_eq_tol(along(t, m.normal) - radius, best, 1e-9);
    }
    free(t->shape_data);
    free(t);
}

/* How far the rounds of the two reach out of what `reference` and `along` measure. */
static inline double rounds_of(const struct pair_of *t)
{
    return t->h[0].convex_radius + t->h[1].convex_radius;
}

/* A round goes around its hull: as near as the hulls are, less the rounds, along the nearest points' own normal. */
static inline void touch_rounded(uint64_t seed, bool with_boxes, const struct extent *extent)
{
    struct random r = {.state = 131 + seed};
    struct pair_of *t = calloc(1, sizeof *t);
    t->shape_data = test_shape_data_new();
    for (int pose = 0; pose < extent->poses; ++pose) {
        const double scale = pow(10, random_in(&r, -extent->exponent, extent->exponent)),
                     flat = pow(10, random_in(&r, -2, 0));
        t->shape_data->used = HULL_FIRST_OWN;
        for (int s = 0; s < 2; ++s) {
            double size[3];
            for (int k = 0; k < 3; ++k) size[k] = scale * (k == pose % 3 ? flat : random_in(&r, 0.5, 1));
            if (pose % 4 == 3) box_hull(size, &t->h[s]);
            else random_hull(&r.state, corners_of(&r, extent), size, &t->h[s]);
            t->h[s].convex_radius = (pose + s) % 3 ? scale * pow(10, random_in(&r, -2, 0)) : 0;
            t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
        }
        if (with_boxes && pose % 2) { /* a box, which has no round of its own */
            const struct sadmm_geometry box = {.type = SADMM_SHAPE_BOX, .subshapes = 1,
                                               .size = {0.3 * scale, 0.5 * scale, 0.7 * scale}};
            t->g[0] = box;
            box_hull(box.size, &t->h[0]);
        }
        const double size = size_of(t), rounds = rounds_of(t), rounding = 1e-10 * size,
                     thin = fmin(geometry_thickness(&t->g[0]), geometry_thickness(&t->g[1]));
        random_pose(&r, size * random_unit(&r), t);
        for (int near = 0; near < 4; ++near) { /* then with the rounds in each other, the deepest short of the cores */
            const double core = reference(t), best = core - rounds;
            ck_assert_double_eq_tol(nearest(t, v3(1, 0, 0)), best, rounding);
            const struct manifold m = touch_two(t, 0.1 * size, 0);
            ck_assert(m.count > 0 || best > 0.1 * size - rounding);
            if (m.count == 0) break;
            double least = HUGE_VAL;
            for (int i = 0; i < m.count; ++i) least = fmin(least, m.points[i].separation);
            if (rounds > 0 && core > 1e-6 * size) {
                /* of the direction half of the digits: a separation is flat about its best */
                ck_assert_double_eq_tol(along(t, m.normal) - rounds, best, rounding);
                ck_assert_double_eq_tol(least, best, MANIFOLD_FLAT * thin + rounding);
                const struct manifold again = touch_two(t, 0.1 * size, m.cache);
                ck_assert_double_eq_tol(along(t, again.normal) - rounds, best,
                                        2e-5 * thin + rounding); /* MANIFOLD_SNAP */
            }
            /* halfway between the surfaces: no plane across the normal is nearer */
            for (int i = 0; i < m.count; ++i)
                ck_assert_double_ge(m.points[i].separation, along(t, m.normal) - rounds - rounding);
            put_together(t, near == 0 ? 1e-3 * rounds : near == 1 ? rounds : random_unit(&r) * rounds);
        }
    }
    free(t->shape_data);
    free(t);
}

#endif
