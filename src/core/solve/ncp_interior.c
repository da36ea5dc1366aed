#include <math.h>
#include <string.h>

#include "core/math/cone.h"
#include "ncp_kernels.h"
#include "ncp_linear.h"

enum { MOST_STEPS = 40, MOST_SHORT = 4 };
/* How much of the way to the boundary is gone. Steps shorter than SHORT turn to the middle of the cones instead. */
static const double SHARE = 0.95, SHORT = 0.1;
/* Of the size of scaled velocities, squared: a smaller complementarity gap is rounding. */
static const double LEAST = 1e-18;

/* A law in scaled numbers x = lambda / scale, y = scale u: scales are such that Coulomb's cone is |x_t| <= x_n, and a
 * constraint's own response 1. */
struct cone {
    int32_t at, count;         /* of its numbers among those that are solved for; 3: a contact's cone, 1: a row */
    double lo, hi;             /* row */
    double dual[3], step[3];   /* contact: what is orthogonal to x; row: at lo, at hi */
    double second[3];          /* what the predictor's step leaves in the second order */
    struct cone_scaling by;    /* W */
    double scaled[3];          /* W^-1 x = W dual */
};

struct interior {
    struct ncp_dense *d;
    double *M;                 /* (count x count) of a step, then its factors */
    double *free;              /* (size) u without impulses */
    double *scale, *x, *y, *dx; /* (count), as are */
    double *off;               /* y, with the slip speed added to normals, minus the duals */
    int32_t *number, count, *pivot;
    struct cone *cone;
    int32_t cones, degree;
    double gap;                /* complementarity of x and the duals, by the degree */
};

/* ---- the problem ------------------------------------------------------------------------------------------------- */

static void find_velocities(struct interior *s)
{
    struct ncp_dense *d = s->d;
    for (int32_t i = 0; i < d->size; ++i) {
        const double *G = d->G + (size_t)i * (size_t)d->size;
        d->u[i] = s->free[i];
        for (int32_t k = 0; k < d->size; ++k) d->u[i] += G[k] * d->lambda[k];
    }
}

static void add_number(struct interior *s, int32_t number, double scale)
{
    s->number[s->count] = number;
    s->scale[s->count++] = scale;
}

/* Tangents without friction are left out, and rows whose bounds are one. */
static void add_law(struct interior *s, const struct ncp_law *law)
{
    struct ncp_dense *d = s->d;
    const double scale = 1 / sqrt(law->response);
    struct cone c = {.at = s->count, .count = law->count, .hi = HUGE_VAL};
    for (int32_t k = 0; k < law->count; ++k) d->lambda[law->first + k] = 0;
    if (law->count == 1) {
        if (!(law->lo < law->hi)) {
            d->lambda[law->first] = law->lo;
            return;
        }
        c.lo = law->lo / scale, c.hi = law->hi / scale;
    } else if (!(law->friction > 0)) c.count = 1;
    add_number(s, law->first, c.count == 3 ? scale / law->friction : scale);
    for (int32_t k = 1; k < c.count; ++k) add_number(s, law->first + k, scale);
    s->degree += c.count == 3 ? 1 : (c.lo > -HUGE_VAL) + (c.hi < HUGE_VAL);
    s->cone[s->cones++] = c;
}

/* Well inside, by `size`. */
static void begin(struct interior *s, double size)
{
    for (int32_t i = 0; i < s->cones; ++i) {
        struct cone *c = &s->cone[i];
        double *x = s->x + c->at;
        memset(x, 0, (size_t)c->count * sizeof *x);
        c->dual[0] = c->lo > -HUGE_VAL ? size : 0;
        if (c->count == 3) x[0] = size;
        else {
            const bool low = c->lo > -HUGE_VAL, high = c->hi < HUGE_VAL;
            x[0] = low && high ? c->lo + (c->hi - c->lo) / 2 : low ? c->lo + size : high ? c->hi - size : 0;
            c->dual[1] = high ? size : 0;
        }
    }
}

/* The work, cut up: behind the matrix and what Newton's search keeps meanwhile. */
static void open_work(struct interior *s)
{
    _Static_assert(7 * sizeof(double) + sizeof(struct cone) <= NCP_INTERIOR_VECTORS * sizeof(double), "its vectors");
    const size_t n = (size_t)s->d->size;
    double *at = s->d->work;
    s->M = at, at += n * (n + 3 + NCP_NEWTON_VECTORS);
    double **vectors[] = {&s->free, &s->scale, &s->x, &s->y, &s->off, &s->dx};
    for (size_t k = 0; k < sizeof vectors / sizeof *vectors; ++k) *vectors[k] = at, at += n;
    s->number = (int32_t *)at, at += n;
    s->pivot = s->number + n;
    s->cone = (struct cone *)at;
}

/* y, what it is off by from the duals, and the gap. */
static void measure(struct interior *s)
{
    struct ncp_dense *d = s->d;
    for (int32_t i = 0; i < s->count; ++i) d->lambda[s->number[i]] = s->scale[i] * s->x[i];
    find_velocities(s);
    s->gap = 0;
    for (int32_t i = 0; i < s->count; ++i) s->y[i] = s->off[i] = s->scale[i] * d->u[s->number[i]];
    for (int32_t i = 0; i < s->cones; ++i) {
        const struct cone *c = &s->cone[i];
        const double *x = s->x + c->at;
        double *off = s->off + c->at;
        if (c->count == 3) {
            off[0] += hypot(s->y[c->at + 1], s->y[c->at + 2]);
            for (int k = 0; k < 3; ++k) off[k] -= c->dual[k];
            s->gap += cone_product(x, c->dual);
            continue;
        }
        off[0] -= c->dual[0] - c->dual[1];
        if (c->lo > -HUGE_VAL) s->gap += (x[0] - c->lo) * c->dual[0];
        if (c->hi < HUGE_VAL) s->gap += (c->hi - x[0]) * c->dual[1];
    }
    s->gap /= s->degree > 0 ? s->degree : 1;
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

/* (G + s's derivative + W^-2) dx = right: a dual's step is eliminated. */
static bool make_matrix(struct interior *s)
{
    const size_t n = (size_t)s->count, stride = ncp_stride(s->count), all = (size_t)s->d->size;
    for (size_t r = 0; r < n; ++r) {
        const double *G = s->d->G + (size_t)s->number[r] * all;
        double *M = s->M + r * stride;
        for (size_t c = 0; c < n; ++c) M[c] = s->scale[r] * s->scale[c] * G[s->number[c]];
        for (size_t c = n; c < stride; ++c) M[c] = 0;
    }
    for (int32_t i = 0; i < s->cones; ++i) {
        struct cone *c = &s->cone[i];
        double *M = s->M + (size_t)c->at * stride;
        const double *x = s->x + c->at, *y = s->y + c->at;
        if (c->count == 1) {
            if (c->lo > -HUGE_VAL) M[c->at] += c->dual[0] / (x[0] - c->lo);
            if (c->hi < HUGE_VAL) M[c->at] += c->dual[1] / (c->hi - x[0]);
            continue;
        }
        if (!cone_find_scaling(x, c->dual, &c->by, c->scaled)) return false;
        const double speed = hypot(y[1], y[2]);
        for (size_t k = 0; speed > 0 && k < n; ++k) M[k] += (y[1] * M[stride + k] + y[2] * M[2 * stride + k]) / speed;
        for (size_t r = 0; r < 3; ++r)
            for (size_t k = 0; k < 3; ++k) {
                const double sign = (r > 0) == (k > 0) ? 1 : -1, J = r != k ? 0 : r == 0 ? 1 : -1;
                M[r * stride + (size_t)c->at + k] +=
                    (2 * sign * c->by.middle[r] * c->by.middle[k] - J) / (c->by.size * c->by.size);
            }
    }
    s->d->budget -= ncp_factor_work(s->count) + 4 * (double)(all * all);
    return ncp_factor(s->M, s->pivot, s->count);
}

/* dx and the duals' steps towards products `aim`. Returns how much of them leads to the boundary; 0: they are
 * no numbers. */
static double find_step(struct interior *s, double aim, bool second)
{
    double way = HUGE_VAL, want[3], back[3];
    for (int32_t i = 0; i < s->count; ++i) s->dx[i] = -s->off[i];
    for (int32_t i = 0; i < s->cones; ++i) {
        const struct cone *c = &s->cone[i];
        const double x = s->x[c->at];
        double *right = s->dx + c->at;
        if (c->count == 3) {
            cone_wanted(c->scaled, aim, second ? c->second : NULL, want);
            cone_scale(&c->by, true, want, back);
            for (int k = 0; k < 3; ++k) right[k] += back[k];
            continue;
        }
        if (c->lo > -HUGE_VAL) right[0] += bound_step(aim, second ? c->second[0] : 0, x - c->lo, c->dual[0], 0);
        if (c->hi < HUGE_VAL) right[0] -= bound_step(aim, second ? c->second[1] : 0, c->hi - x, c->dual[1], 0);
    }
    ncp_substitute(s->M, s->pivot, s->count, s->dx);
    for (int32_t i = 0; i < s->count; ++i)
        if (!(fabs(s->dx[i]) < HUGE_VAL)) return 0;
    for (int32_t i = 0; i < s->cones; ++i) {
        struct cone *c = &s->cone[i];
        const double *x = s->x + c->at, *dx = s->dx + c->at;
        if (c->count == 3) {
            double changed[3];
            cone_wanted(c->scaled, aim, second ? c->second : NULL, want);
            cone_scale(&c->by, true, dx, changed);
            for (int k = 0; k < 3; ++k) want[k] -= changed[k];
            cone_scale(&c->by, true, want, c->step);
            way = fmin(way, fmin(cone_way_to_boundary(x, dx), cone_way_to_boundary(c->dual, c->step)));
            continue;
        }
        for (int side = 0; side < 2; ++side) {
            const double nearer = side ? dx[0] : -dx[0], away = side ? c->hi - x[0] : x[0] - c->lo;
            if (!(away < HUGE_VAL)) continue;
            c->step[side] = bound_step(aim, second ? c->second[side] : 0, away, c->dual[side], nearer);
            if (nearer > 0) way = fmin(way, away / nearer);
            if (c->step[side] < 0) way = fmin(way, -c->dual[side] / c->step[side]);
        }
    }
    return way;
}

/* What the whole step would leave of products. */
static void find_second_order(struct interior *s)
{
    for (int32_t i = 0; i < s->cones; ++i) {
        struct cone *c = &s->cone[i];
        const double *dx = s->dx + c->at;
        double a[3], b[3];
        if (c->count == 1) {
            c->second[0] = dx[0] * c->step[0], c->second[1] = -dx[0] * c->step[1];
            continue;
        }
        cone_scale(&c->by, true, dx, a);
        cone_scale(&c->by, false, c->step, b);
        cone_multiply(a, b, c->second);
    }
}

/* Returns the share of the step that was gone; 0: there is none. */
static double make_step(struct interior *s)
{
    if (!make_matrix(s)) return 0;
    const double predicted = fmin(1, find_step(s, 0, false)), left = 1 - predicted;
    find_second_order(s);
    double way = find_step(s, left * left * left * s->gap, true);
    if (way < SHORT) way = find_step(s, s->gap, false);
    way = fmin(1, SHARE * way);
    if (!(way > 0)) return 0;
    for (int32_t i = 0; i < s->count; ++i) s->x[i] += way * s->dx[i];
    for (int32_t i = 0; i < s->cones; ++i)
        for (int k = 0; k < 3; ++k) s->cone[i].dual[k] += way * s->cone[i].step[k];
    return way;
}

double SADMM_KERNEL(ncp_interior)(struct ncp_dense *d, double enough)
{
    struct interior s = {.d = d};
    double size = 0, map;
    open_work(&s);
    for (int32_t i = 0; i < d->size; ++i) {
        s.free[i] = d->u[i];
        for (int32_t k = 0; k < d->size; ++k) s.free[i] -= d->G[(size_t)i * (size_t)d->size + (size_t)k] * d->lambda[k];
    }
    for (int32_t i = 0; i < d->laws; ++i) add_law(&s, &d->law[i]);
    find_velocities(&s);
    for (int32_t i = 0; i < s.count; ++i) size = fmax(size, fabs(s.scale[i] * d->u[s.number[i]]));
    begin(&s, size);
    for (int step = 0, brief = 0;; ++step) {
        measure(&s);
        map = ncp_natural_map(d);
        if (!(map > enough && map < HUGE_VAL) || step == MOST_STEPS || brief == MOST_SHORT || d->budget < 0 ||
            s.gap < LEAST * size * size)
            return map;
        const double way = make_step(&s);
        if (way == 0) return map;
        brief = way < SHORT / 10 ? brief + 1 : 0;
    }
}
