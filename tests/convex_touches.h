/* Two convex bodies that touch, with what certifies it. A direction bounds a distance from below, two points of the
 * bodies bound it from above: where both are the same number there is no other. Of a depth the same pair of points says
 * that no direction nearby is better, and directions all over the sphere that none elsewhere is. */
#ifndef SADMM_TESTS_CONVEX_TOUCHES_H
#define SADMM_TESTS_CONVEX_TOUCHES_H

#include "convex_tools.h"

/* What the library takes for the optimum, before anything is preferred. */
static inline struct convex_axis nearest_axis(const struct pair_of *t)
{
    const struct pair_pose pose = pair_of_pose(t);
    struct convex_pair pair;
    struct convex_axis axis, flat;
    struct convex_active active;
    memset(&axis, 0, sizeof axis);
    convex_pair_make(&t->g[0], &t->g[1], t->shape_data->numbers, &pose, &pair);
    ck_assert(convex_find(&pair, v3_norm2(pair.t) > 0 ? v3_neg(pair.t) : v3(0, 0, 1), false, 1e300, &axis, &active));
    if (convex_flat_beside(&pair, axis.n, &flat) && flat.separation >= axis.separation - 2 * pair.slack) axis = flat;
    else convex_nearest(&pair, &active, &axis);
    return axis;
}

struct found {
    double apart; /* of the two along n, by their own supports */
    double off;   /* how far from a certificate: |separation of two points - apart|, or how far these are outside */
    double n[3];  /* world */
};

static inline double off_by(const struct pair_of *t, vec3 n, vec3 middle, double separation, double apart)
{
    return fmax(fabs(separation - apart), points_outside(t, n, middle, separation));
}

/* By the optimum's own points, or those of the manifold. */
static inline struct found certify(const struct pair_of *t)
{
    const struct convex_axis axis = nearest_axis(t);
    const struct manifold m = pair_touch(t, 1e300, 0);
    struct found f;
    double n[3];
    normal_in_world(t, axis.n, f.n);
    f.apart = apart_along(t, f.n);
    f.off = off_by(t, axis.n, v3_scale(v3_add(axis.pa, axis.pb), 0.5), v3_dot(axis.n, v3_sub(axis.pb, axis.pa)),
                   f.apart);
    normal_in_world(t, m.normal, n);
    const double apart = apart_along(t, n);
    for (int i = 0; i < m.count; ++i) {
        const double off = off_by(t, m.normal, m.points[i].position, m.points[i].separation, apart);
        if (!(off < f.off)) continue;
        f.off = off;
        f.apart = apart;
        memcpy(f.n, n, sizeof n);
    }
    return f;
}

/* The best of directions all over the sphere, and from there up as far as it goes. also: another one to try; NULL:
 * none. */
static inline double best_direction(const struct pair_of *t, const double *also)
{
    enum { ALL = 1500 };
    double best = -HUGE_VAL, from[3] = {0, 0, 1};
    for (int k = also ? -1 : 0; k < ALL; ++k) {
        const double z = 1 - (2 * k + 1.0) / ALL, r = sqrt(fmax(0, 1 - z * z)), angle = k * 2.399963229728653;
        double n[3] = {r * cos(angle), r * sin(angle), z};
        if (k < 0) memcpy(n, also, sizeof n);
        const double s = apart_along(t, n);
        if (s > best) {
            best = s;
            memcpy(from, n, sizeof from);
        }
    }
    for (double step = 0.05; step > 1e-8;) {
        const double before = best;
        double next[3];
        vec3 t1, t2;
        v3_tangents(v3_load(from), &t1, &t2);
        memcpy(next, from, sizeof next);
        for (int k = 0; k < 8; ++k) {
            const vec3 y = v3_madd(v3_madd(v3_load(from), step * cos(k * M_PI / 4), t1), step * sin(k * M_PI / 4), t2);
            double n[3];
            v3_store(v3_scale(y, 1 / v3_norm(y)), n);
            const double s = apart_along(t, n);
            if (s > best) {
                best = s;
                memcpy(next, n, sizeof next);
            }
        }
        memcpy(from, next, sizeof from);
        if (!(best > before + 1e-13 * pair_size(t))) step /= 2;
    }
    return best;
}

static inline struct pair_of *new_pair(void)
{
    struct pair_of *t = calloc(1, sizeof *t);
    ck_assert_ptr_nonnull(t);
    t->shape_data = test_shape_data_new();
    return t;
}

static inline void free_pair(struct pair_of *t)
{
    free(t->shape_data);
    free(t);
}

/* Move b until it is this deep in a along the direction that parts the two now. */
static inline struct found push_together(struct pair_of *t, double depth)
{
    const struct found f = certify(t);
    for (int k = 0; k < 3; ++k) t->x[1][k] -= (f.apart + depth) * f.n[k];
    return f;
}

/* The same two, the other one first. */
static inline void exchange(const struct pair_of *t, struct pair_of *u)
{
    *u = *t;
    for (int s = 0; s < 2; ++s) {
        u->h[s] = t->h[1 - s];
        u->g[s] = t->g[1 - s];
        memcpy(u->R[s], t->R[1 - s], sizeof u->R[s]);
        memcpy(u->x[s], t->x[1 - s], sizeof u->x[s]);
    }
}

static const char *const names[] = {"plane", "sphere", "capsule", "box", "hull", "mesh",
                                    "cylinder", "cone", "ellipsoid"};

/* The next one that is convex. */
static inline int next_type(int type) { return type + 1 == SADMM_SHAPE_MESH ? type + 2 : type + 1; }

#endif
