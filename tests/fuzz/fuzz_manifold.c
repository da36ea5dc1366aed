/* Manifolds of every pair of kinds of shapes, in every pose, against oracles that share no code with them:
 *
 *   - what is given is finite, the normal a unit vector, no feature occurs twice, no point is beyond the limit
 *   - shapes that are farther apart than the limit have no contact; shapes that are nearer have one
 *   - no point is deeper than the shapes are along the normal; where they overlap the normal is nearly the direction in
 *     which they overlap least
 *   - points lie between the surfaces: no farther from either shape than half their separation
 *   - exchanging the two changes neither whether there is a contact nor, but for the choice of an axis, its depth
 */
#include <string.h>

#include "bytes.h"

/* The tools are made for Check: here a failed check ends the program. */
#define ck_assert_int_ge(a, b) MUST((a) >= (b), "%d, %d", a, b)
#define ck_assert_int_le(a, b) MUST((a) <= (b), "%d, %d", a, b)
#define ck_assert_uint_ne(a, b) MUST((a) != (b), "%u", a)
#define ck_assert_double_eq_tol(a, b, tol) MUST(fabs((a) - (b)) <= (tol), "%.17g, %.17g", (double)(a), (double)(b))
#define ck_assert(a) MUST(a, "-")
#include "../manifold_tools.h"
#include "core/math/quat.h"

static void take_rotation(struct bytes *in, double R[9])
{
    double q[4], n2 = 0;
    take_orientation(in, q);
    for (int k = 0; k < 4; ++k) n2 += q[k] * q[k];
    if (!(fabs(n2 - 1) <= 1e-6)) memcpy(q, (double[]){1, 0, 0, 0}, sizeof q);
    mat3 m = q_matrix(q_normalize(q_load(q)));
    for (int k = 0; k < 3; ++k) v3_store(m.r[k], R + 3 * k);
}

static struct solid take_solid(struct bytes *in, int type)
{
    struct solid s = {.type = type};
    int kind = take_choice(in, 4);
    for (int k = 0; k < 3; ++k)
        s.size[k] = kind == 3   ? take_scale(in, 1e-6, 1e6)
                    : kind == 2 ? take_scale(in, 1e-3, 1)
                                : 0.25 * (1 + take_choice(in, 4));
    take_rotation(in, s.R);
    return s;
}

/* A direction to put b in, from a: an axis of either, or any. */
static void take_direction(struct bytes *in, const struct solid *a, const struct solid *b, double d[3])
{
    int kind = take_choice(in, 8), axis = kind % 3;
    double length;
    if (kind < 6) {
        for (int k = 0; k < 3; ++k) d[k] = (kind < 3 ? a : b)->R[3 * k + axis];
    } else {
        for (int k = 0; k < 3; ++k) d[k] = take_in(in, -1, 1);
    }
    length = sqrt(dot3(d, d));
    if (length < 1e-3) d[2] = length = 1;
    for (int k = 0; k < 3; ++k) d[k] /= length;
    length = sqrt(dot3(d, d));
    for (int k = 0; k < 3; ++k) d[k] /= length;
}

/* Concentric, about touching, or anywhere near. */
static double take_distance(struct bytes *in, double touching)
{
    switch (take_choice(in, 4)) {
    case 0: return touching;
    case 1: return touching * (1 + (take_choice(in, 2) ? 1 : -1) * take_scale(in, 1e-17, 0.1));
    case 2: return touching * take_in(in, -1.2, 1.2);
    default: return take_choice(in, 2) ? 0 : touching * take_scale(in, 1e-12, 1);
    }
}

/* ---- a plane and another: exact ---------------------------------------------------------------------------------- */

static void check_plane(const struct solid *plane, const struct solid *b, double limit)
{
    double n[3] = {plane->R[2], plane->R[5], plane->R[8]}, d[3];
    for (int k = 0; k < 3; ++k) d[k] = b->x[k] - plane->x[k];
    double height = dot3(n, d) - shadow(b, n);
    double tolerance = 1e-14 * (sqrt(dot3(d, d)) + radius_of(b) + fabs(limit));
    struct world_manifold m = touch(plane, b, limit, 0);
    if (height > limit + tolerance) MUST(m.count == 0, "%g over the plane, limit %g", height, limit);
    if (height < limit - tolerance) MUST(m.count > 0, "%g over the plane, limit %g", height, limit);
    if (m.count == 0) return;
    MUST(fabs(least_separation(&m) - height) <= tolerance, "%.17g over the plane, not %.17g", height,
         least_separation(&m));
    for (int i = 0; i < m.count; ++i) {
        MUST(m.separation[i] <= limit, "point %d", i);
        double half = 0.5 * fabs(m.separation[i]) + tolerance, p[3];
        for (int k = 0; k < 3; ++k) p[k] = m.position[i][k] - plane->x[k];
        MUST(fabs(dot3(n, p)) <= half, "point %d: %g from the plane", i, dot3(n, p));
        MUST(outside(b, m.position[i]) <= half, "point %d: %g from the solid", i, outside(b, m.position[i]));
    }
}

/* ---- two solids -------------------------------------------------------------------------------------------------- */

struct truth {
    double at_least, at_most; /* bounds of the separation */
    double aside;             /* how far beside the other box's face a corner counts as over it */
    double parallel;          /* how far edges part that count as parallel */
    double scale;             /* what rounding is relative to */
    double thin;              /* thinner extent */
};

/* From above by points of the two, from below by directions: those of the boxes and the one between the points. */
static struct truth truth_of(const struct solid *a, const struct solid *b)
{
    struct truth t = {.at_least = -HUGE_VAL, .scale = radius_of(a) + radius_of(b)};
    double p[3], q[3], d[3], length;
    t.thin = fmin(thickness_of(a), thickness_of(b));
    memcpy(p, a->x, sizeof p);
    for (int i = 0; i < 60; ++i) {
        project_on_core(b, p, q);
        project_on_core(a, q, p);
    }
    for (int k = 0; k < 3; ++k) d[k] = q[k] - p[k];
    length = sqrt(dot3(d, d));
    t.at_most = length - (a->type == SADMM_SHAPE_BOX ? 0 : a->size[0]) - (b->type == SADMM_SHAPE_BOX ? 0 : b->size[0]);
    if (length > 1e-9 * t.scale) {
        for (int k = 0; k < 3; ++k) d[k] /= length;
        t.at_least = separation_along(a, b, d);
    }
    if (a->type == SADMM_SHAPE_BOX && b->type == SADMM_SHAPE_BOX) {
        t.at_least = fmax(t.at_least, box_separation(a, b, NULL));
        t.parallel = sqrt(MANIFOLD_PARALLEL2) * t.scale;
        /* a face, turned in the plane of another */
        t.aside = MANIFOLD_SNAP * M_SQRT2 * fmin(radius_of(a), radius_of(b));
    }
    return t;
}

/* Tangent of the angle between a normal and the nearest face of two boxes; of the normal of a face it is rounding. By
 * the cross product: the cosine of a small angle has lost it. */
static double lean_of(const struct solid *a, const struct solid *b, const double n[3])
{
    double lean = HUGE_VAL;
    for (int k = 0; k < 6; ++k) {
        const double *R = k < 3 ? a->R : b->R, f[3] = {R[k % 3], R[3 + k % 3], R[6 + k % 3]};
        const double cross[3] = {f[1] * n[2] - f[2] * n[1], f[2] * n[0] - f[0] * n[2], f[0] * n[1] - f[1] * n[0]};
        lean = fmin(lean, sqrt(dot3(cross, cross)) / fabs(dot3(f, n)));
    }
    return lean;
}

static void check_solids(const struct solid *a, const struct solid *b, double limit)
{
    struct truth t = truth_of(a, b);
    double rounding = 1e-13 * (t.scale + fabs(limit));
    struct world_manifold m = touch(a, b, limit, 0), w = touch(b, a, limit, 0);
    bool apart = t.at_least > hypot(limit, t.aside) + rounding, near = t.at_most < limit - rounding;
    if (apart) MUST(m.count == 0, "at least %g apart, limit %g", t.at_least, limit);
    if (near) MUST(m.count > 0, "at most %g apart, limit %g", t.at_most, limit);
    if (apart || near) MUST((m.count > 0) == (w.count > 0), "exchanged");
    if (m.count == 0) return;

    double along = separation_along(a, b, m.normal), least = least_separation(&m);
    /* A corner is kept beside the face by the tolerance of clipping: seen along a normal that leans, that is as
     * much. */
    double beside = 0;
    if (a->type == SADMM_SHAPE_BOX && b->type == SADMM_SHAPE_BOX)
        beside = MANIFOLD_SNAP * M_SQRT2 * fmin(radius_of(a), radius_of(b)) * lean_of(a, b, m.normal);
    MUST(least >= along - beside - rounding, "%g deep, but %g along the normal", -least, -along);
    if (a->type == SADMM_SHAPE_BOX && b->type == SADMM_SHAPE_BOX && t.at_least <= 0)
        MUST(along >= t.at_least - 0.05 * fabs(along) - 0.005 * t.thin - t.parallel - rounding,
             "the normal's depth is %g, the least is %g", -along, -t.at_least);
    /* corners stay corners in clipping */
    double slack = MANIFOLD_SNAP * fmin(radius_of(a), radius_of(b)) + rounding;
    for (int i = 0; i < m.count; ++i) {
        MUST(m.separation[i] <= limit + rounding, "point %d: separation %g, limit %g", i, m.separation[i], limit);
        double reach = 0.5 * fabs(m.separation[i]) + slack;
        MUST(outside(a, m.position[i]) <= reach && outside(b, m.position[i]) <= reach,
             "point %d: separation %g, %g outside the one and %g outside the other", i, m.separation[i],
             outside(a, m.position[i]), outside(b, m.position[i]));
    }
    if (w.count == 0 || t.at_least > 0) return;
    MUST(fabs(least - least_separation(&w)) <= 0.1 * fabs(least) + 0.01 * t.thin + t.parallel + rounding,
         "%g deep, exchanged %g", -least, -least_separation(&w));
}

/* FUZZ_SHOW=1: what the bytes mean, for a test of the case. */
static void show(const char *name, const struct solid *s)
{
    fprintf(stderr, "%s: type %d, size {%.17g, %.17g, %.17g}, x {%.17g, %.17g, %.17g}, R {", name, s->type, s->size[0],
            s->size[1], s->size[2], s->x[0], s->x[1], s->x[2]);
    for (int k = 0; k < 9; ++k) fprintf(stderr, "%.17g%s", s->R[k], k < 8 ? ", " : "}\n");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes in = bytes_of(data, size);
    int pair = take_choice(&in, 9); /* three with a plane, six without */
    static const int types[9][2] = {
        {SADMM_SHAPE_PLANE, SADMM_SHAPE_SPHERE},   {SADMM_SHAPE_PLANE, SADMM_SHAPE_CAPSULE},
        {SADMM_SHAPE_PLANE, SADMM_SHAPE_BOX},      {SADMM_SHAPE_SPHERE, SADMM_SHAPE_SPHERE},
        {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE}, {SADMM_SHAPE_SPHERE, SADMM_SHAPE_BOX},
        {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_CAPSULE}, {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX},
        {SADMM_SHAPE_BOX, SADMM_SHAPE_BOX},
    };
    struct solid a = take_solid(&in, types[pair][0]), b = take_solid(&in, types[pair][1]);
    double d[3], side[3];
    take_direction(&in, &a, &b, d);
    bool plane = a.type == SADMM_SHAPE_PLANE;
    double thin = plane ? thickness_of(&b) : fmin(thickness_of(&a), thickness_of(&b));
    double distance = take_distance(&in, (plane ? 0 : shadow(&a, d)) + shadow(&b, d));
    double slide = take_choice(&in, 4) == 3 ? (radius_of(&a) + radius_of(&b)) * take_in(&in, -1, 1) : 0;
    take_direction(&in, &b, &a, side);
    for (int k = 0; k < 3; ++k) b.x[k] = distance * d[k] + slide * side[k];
    double limit = take_choice(&in, 2) ? 0.02 * thin : take_choice(&in, 2) ? thin * take_scale(&in, 1e-12, 1e3) : 0;
    if (getenv("FUZZ_SHOW")) {
        show("a", &a);
        show("b", &b);
        fprintf(stderr, "limit %.17g\n", limit);
    }
    if (plane) check_plane(&a, &b, limit);
    else check_solids(&a, &b, limit);
    return 0;
}
