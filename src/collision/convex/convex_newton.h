/* The direction along which two convex bodies are farthest apart, or least deep in each other, by Newton's method from
 * one that is near.
 *
 * A direction n parts the two by s(n) = -h(n), h the support of a - b. h is the largest of a few smooth functions, h_k
 * of pairs of pieces (convex.h), of which at most three meet at a minimum over the sphere. It is where a mean of their
 * points w_k is along n, and all h_k are one; the Hessian along tangents of n is that of the mean, less h. What reaches
 * farther than these three is exchanged for one of them.
 *
 * The same mean says how good a direction is: it is a point of a - b, so that no direction has an h below the mean's
 * part along it. Where that and h differ by rounding the direction is certain: of bodies that are apart it is the only
 * one, while they overlap no other nearby is better.
 */
#ifndef SADMM_COLLISION_CONVEX_CONVEX_NEWTON_H
#define SADMM_COLLISION_CONVEX_CONVEX_NEWTON_H

#include "convex_pair.h"

/* Curvatures that differ by more have a direction without any; and where the larger one is of the pair's own size,
 * which it is not beside a rim's axis: a corner may be that near to a rim. */
#define CONVEX_SINGULAR (sizeof(real) == 4 ? (real)1e-4 : (real)1e-9)
#define CONVEX_SINGULAR_NEAR (sizeof(real) == 4 ? (real)1e-4 : (real)1e-11)
/* Steps along the tangent of the curve where two pairs of pieces reach equally far that are longer (rad) go back to it,
 * so often at most: Newton's next step takes the rest, the square of this, with it. */
#define CONVEX_LONG ((real)0.03)
enum { CONVEX_STEPS = 16, CONVEX_BACK = 3 };

/* Pairs of pieces, with their share of the nearest point. */
struct convex_active {
    int count;
    int a[3], b[3];
    real weight[3];
};

/* The three that weigh most, each once. */
SADMM_INLINE void convex_activate(const struct gjk_simplex *s, struct convex_active *active)
{
    int k, i;
    active->count = 0;
    for (k = 0; k < s->count; ++k) {
        const int a = s->p[k].a, b = s->p[k].b;
        const real weight = real_max(s->weight[k], 0);
        for (i = 0; i < active->count && !(active->a[i] == a && active->b[i] == b);) ++i;
        if (i == active->count) {
            if (i == 3) { /* in place of the one that weighs least */
                i = active->weight[1] < active->weight[0] ? 1 : 0;
                if (active->weight[2] < active->weight[i]) i = 2;
                if (weight <= active->weight[i]) continue;
            } else {
                ++active->count;
            }
            active->a[i] = a;
            active->b[i] = b;
            active->weight[i] = 0;
        }
        active->weight[i] += weight;
    }
}

SADMM_INLINE void convex_drop(struct convex_active *active, int k)
{
    const int last = --active->count;
    active->a[k] = active->a[last];
    active->b[k] = active->b[last];
    active->weight[k] = active->weight[last];
}

/* The second derivatives of the pair of pieces' h, along tangents t1, t2 of n. */
SADMM_INLINE void convex_pair_bend(const struct convex_pair *pair, int a, int b, vec3 n, vec3 t1, vec3 t2, real bend[3])
{
    real of_a[3], of_b[3];
    int k;
    convex_bend(&pair->a, a, m3_tmul(pair->R, n), m3_tmul(pair->R, t1), m3_tmul(pair->R, t2), of_a);
    convex_bend(&pair->b, b, v3_neg(n), t1, t2, of_b);
    for (k = 0; k < 3; ++k) bend[k] = of_a[k] + of_b[k];
}

/* What a Newton step is made of: components along two tangents. */
struct convex_plane {
    real g[3][2];  /* of each w_k */
    real h[3];     /* n . w_k */
    real m[3];     /* the Hessian: 11, 12, 22 */
};

/* A step that is too long is so where the Hessian is least: there it becomes half as long as the normal. high: the
 * larger curvature. */
SADMM_INLINE void convex_shorten(const real m[3], real high, real x[2])
{
    const bool first = real_abs(m[0] - high) >= real_abs(m[2] - high);
    const real e0 = first ? m[0] - high : m[1], e1 = first ? m[1] : m[2] - high, length2 = e0 * e0 + e1 * e1;
    real along;
    if (!(length2 > 0)) return;
    along = (x[0] * e0 + x[1] * e1) / length2;
    along *= 1 - real_min(1, (real)0.5 / (real_abs(along) * real_sqrt(length2)));
    x[0] -= along * e0;
    x[1] -= along * e1;
}

/* The step x, and the weights where it leads to. False: the Hessian says that this is no minimum; *singular: it does
 * not say that it is one. size, slack: of the pair. */
SADMM_INLINE bool convex_newton(const struct convex_plane *p, real size, real slack, struct convex_active *active,
                                real x[2], bool *singular)
{
    const real *g = p->g[0], *m = p->m;
    *singular = false;
    if (active->count == 1) { /* a corner at a rim is stiff along the rim alone, and hardly bent across it */
        const real half = (m[0] + m[2]) / 2, low = half - real_sqrt((m[0] - m[2]) * (m[0] - m[2]) / 4 + m[1] * m[1]),
                   high = 2 * half - low;
        const bool bounded = high <= 4 * size; /* not beside a rim's axis */
        const real least = (bounded ? CONVEX_SINGULAR_NEAR : CONVEX_SINGULAR) * high,
                   more = low > least ? 0 : (real)1e-3 * high - low;
        const real m0 = m[0] + more, m2 = m[2] + more, det = m0 * m2 - m[1] * m[1];
        *singular = more > 0;
        if (!(high > 0 && det > 0)) return false;
        x[0] = -(m2 * g[0] - m[1] * g[1]) / det;
        x[1] = -(m0 * g[1] - m[1] * g[0]) / det;
        if (bounded && !*singular && x[0] * x[0] + x[1] * x[1] > (real)0.25) convex_shorten(m, high, x);
        active->weight[0] = 1;
        return true;
    }
    if (active->count == 2) {
        const real u0 = p->g[1][0] - g[0], u1 = p->g[1][1] - g[1], uu = u0 * u0 + u1 * u1, c = (p->h[0] - p->h[1]) / uu,
                   bend = m[0] * u1 * u1 - 2 * m[1] * u0 * u1 + m[2] * u0 * u0; /* across u */
        real along, r0 = g[0] + c * (m[0] * u0 + m[1] * u1), r1 = g[1] + c * (m[1] * u0 + m[2] * u1);
        const real across = r0 * u1 - r1 * u0, length = real_sqrt(uu);
        if (!(uu > 0)) return false;
        *singular = !(bend > 0);
        if (real_abs(across) <= slack * length) along = 0; /* rounding: corners and rims that touch have no bend */
        else if (*singular) along = (across > 0 ? (real)0.25 : (real)-0.25) / length; /* on to what ends the slope */
        else along = across / bend;
        x[0] = c * u0 - along * u1;
        x[1] = c * u1 + along * u0;
        r0 = g[0] + m[0] * x[0] + m[1] * x[1];
        r1 = g[1] + m[1] * x[0] + m[2] * x[1];
        active->weight[1] = -(u0 * r0 + u1 * r1) / uu;
        active->weight[0] = 1 - active->weight[1];
        return true;
    } else {
        const real u0 = p->g[1][0] - g[0], u1 = p->g[1][1] - g[1], v0 = p->g[2][0] - g[0], v1 = p->g[2][1] - g[1],
                   det = u0 * v1 - u1 * v0, cu = p->h[0] - p->h[1], cv = p->h[0] - p->h[2];
        real r0, r1;
        if (!(det != 0)) return false;
        x[0] = (cu * v1 - cv * u1) / det;
        x[1] = (u0 * cv - v0 * cu) / det;
        r0 = g[0] + m[0] * x[0] + m[1] * x[1];
        r1 = g[1] + m[1] * x[0] + m[2] * x[1];
        active->weight[1] = -(r0 * v1 - r1 * v0) / det;
        active->weight[2] = -(u0 * r1 - u1 * r0) / det;
        active->weight[0] = 1 - active->weight[1] - active->weight[2];
        return true;
    }
}

/* `next`, which reaches beyond the active pairs, becomes one of them: in place of the one whose weight is the first to
 * go where its own grows and the mean of their points stays (the pivot of the simplex method). False: none gives
 * way. */
SADMM_INLINE bool convex_enter(const struct convex_plane *p, const real g[2], const struct difference_point *next,
                               struct convex_active *active)
{
    real share = 0;
    int at = active->count, k;
    if (at == 3) {
        const real u0 = p->g[1][0] - p->g[0][0], u1 = p->g[1][1] - p->g[0][1], v0 = p->g[2][0] - p->g[0][0],
                   v1 = p->g[2][1] - p->g[0][1], d0 = g[0] - p->g[0][0], d1 = g[1] - p->g[0][1],
                   det = u0 * v1 - u1 * v0;
        real of[3]; /* g as a mean of theirs */
        if (!(det != 0)) return false;
        of[1] = (d0 * v1 - d1 * v0) / det;
        of[2] = (u0 * d1 - u1 * d0) / det;
        of[0] = 1 - of[1] - of[2];
        for (k = 0; k < 3; ++k)
            if (of[k] > 0 && (at == 3 || active->weight[k] < share * of[k])) {
                at = k;
                share = active->weight[k] / of[k];
            }
        if (at == 3) return false;
        for (k = 0; k < 3; ++k) active->weight[k] -= share * of[k];
    } else {
        ++active->count;
    }
    active->a[at] = next->a;
    active->b[at] = next->b;
    active->weight[at] = share;
    return true;
}

SADMM_INLINE bool convex_is_active(const struct convex_active *active, const struct difference_point *point)
{
    int k;
    for (k = 0; k < active->count; ++k)
        if (active->a[k] == point->a && active->b[k] == point->b) return true;
    return false;
}

SADMM_INLINE vec3 convex_turned(vec3 n, real x1, vec3 t1, real x2, vec3 t2)
{
    const vec3 at = v3_madd(v3_madd(n, x1, t1), x2, t2);
    return v3_scale(at, 1 / v3_norm(at));
}

/* What h may lose beside n by what the mean of points says: off, how far that is beside n; mean, how far along n. Of
 * what is apart by any other direction, while the two overlap by those as near as the last step was long. */
SADMM_INLINE real convex_gain(real off, real mean, real length)
{
    return off * real_min(1, mean < 0 ? off / -mean : length);
}

/* Two active pairs reach equally far along a curve, which a long step along its tangent leaves; what reaches farther
 * beside the curve says nothing of what does so on it. x: the way back to it. False: here it is, or all but. */
SADMM_INLINE bool convex_back(const struct convex_plane *p, real slack, real x[2])
{
    const real u0 = p->g[1][0] - p->g[0][0], u1 = p->g[1][1] - p->g[0][1], uu = u0 * u0 + u1 * u1,
               apart = p->h[0] - p->h[1];
    if (real_abs(apart) <= slack || !(4 * apart * apart <= uu)) return false; /* of so much the tangent says nothing */
    x[0] = apart / uu * u0;
    x[1] = apart / uu * u1;
    return true;
}

/* n by Newton's method. False: it is not certain that this is the optimum, only the best that there was on the way;
 * where s has not grown, all is as it was. */
SADMM_CALLED bool convex_polish(const struct convex_pair *pair, struct convex_active *active, vec3 *n, real *separation)
{
    struct convex_active now = *active, best = *active;
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    vec3 at = *n, best_at = *n;
    real s, least_reach = -(*separation + convex_radii(pair)), length = 2, last = 2, first = 0, residual = 0;
    bool certain = false, failed = false, singular = true; /* until a step has said what the Hessian is */
    int step, ended = 0, back = 0;
    for (step = 0;; ++step) {
        const struct difference_point next = convex_support(pair, at, &zero);
        const vec3 from = at;
        struct convex_plane p;
        vec3 t1, t2;
        real x[2], mean = 0, off0 = 0, off1 = 0, off, lack, reach;
        int k, least = 0;
        v3_tangents(at, &t1, &t2);
        p.m[0] = p.m[1] = p.m[2] = 0;
        for (k = 0; k < now.count; ++k) {
            const vec3 w = v3_sub(convex_point_a(pair, now.a[k], at), convex_point_b(pair, now.b[k], at));
            real bend[3];
            int i;
            p.g[k][0] = v3_dot(t1, w);
            p.g[k][1] = v3_dot(t2, w);
            p.h[k] = v3_dot(at, w);
            convex_pair_bend(pair, now.a[k], now.b[k], at, t1, t2, bend);
            for (i = 0; i < 3; ++i) p.m[i] += now.weight[k] * bend[i];
            mean += now.weight[k] * p.h[k];
            off0 += now.weight[k] * p.g[k][0];
            off1 += now.weight[k] * p.g[k][1];
        }
        if (back > 0 && now.count == 2 && convex_back(&p, pair->slack, x)) {
            at = convex_turned(at, x[0], t1, x[1], t2);
            --back;
            --step; /* it is a part of the last one */
            continue;
        }
        back = 0;
        reach = v3_dot(at, next.w);
        if (reach < least_reach - pair->slack) {
            least_reach = reach;
            best_at = at;
            best = now;
        }
        lack = reach - mean;
        off = real_sqrt(off0 * off0 + off1 * off1);
        certain = lack + convex_gain(off, mean, length) <= 8 * pair->slack && !(singular && mean > 8 * pair->slack);
        residual = lack + off;
        if (step == 0) first = residual;
        if (step == CONVEX_STEPS || (certain && off <= pair->slack)) break;
        if (length <= 16 * SADMM_EPSILON || (length >= last / 2 && length < (real)1e-3)) { /* rounding ends it */
            if (convex_is_active(&now, &next) && (!certain || ++ended == 3)) break;
            if (!certain) length = last = 2;
        }
        if (lack > 2 * pair->slack && !convex_is_active(&now, &next)) {
            const real g[2] = {v3_dot(t1, next.w), v3_dot(t2, next.w)};
            if (!convex_enter(&p, g, &next, &now)) break;
            length = 2;
            continue;
        }
        p.m[0] -= mean;
        p.m[2] -= mean;
        last = length;
        if (!convex_newton(&p, pair->size, pair->slack, &now, x, &singular)) {
            if (now.count == 1) {
                failed = true;
                break;
            }
            for (k = 1; k < now.count; ++k)
                if (now.weight[k] < now.weight[least]) least = k;
            convex_drop(&now, least);
            singular = true;
            for (mean = 0, k = 0; k < now.count; ++k) mean += now.weight[k];
            for (k = 0; k < now.count; ++k) now.weight[k] = mean > 0 ? now.weight[k] / mean : 1 / (real)now.count;
            length = 2;
            continue;
        }
        length = real_sqrt(x[0] * x[0] + x[1] * x[1]);
        if (!(length <= 16 / CONVEX_SINGULAR)) { /* NaN as well */
            failed = true;
            break;
        }
        if (length > 1) { /* the Hessian says nothing of what is so far away */
            x[0] /= 2 * length;
            x[1] /= 2 * length;
            length = 2;
        }
        at = convex_turned(at, x[0], t1, x[1], t2);
        if (now.count == 2 && length > CONVEX_LONG) back = CONVEX_BACK;
        if (now.count == 1 && length > (real)1e-6) { /* near a rim's axis the bend is another one from place to place */
            int half;
            for (half = 0; half < 6; ++half) {
                const struct difference_point point = convex_support(pair, at, &zero);
                if (!(v3_dot(at, point.w) > mean + pair->slack) || point.a != now.a[0] || point.b != now.b[0]) break;
                at = convex_turned(from, x[0] / (real)(2 << half), t1, x[1] / (real)(2 << half), t2);
                length = 2;
            }
        }
        for (k = 1; k < now.count; ++k)
            if (now.weight[k] < now.weight[least]) least = k;
        if (now.weight[least] < 0) { /* the others alone are nearer */
            for (mean = 0, k = 0; k < now.count; ++k) mean += k == least ? 0 : real_max(now.weight[k], 0);
            convex_drop(&now, least);
            for (k = 0; k < now.count; ++k) now.weight[k] = real_max(now.weight[k], 0) / mean;
            length = 2;
        }
    }
    s = convex_separation(pair, at);
    if (failed) certain = false;
    if (failed || (!certain && !(s >= -least_reach - convex_radii(pair) - pair->slack / 4))) { /* better on the way */
        now = best;
        at = best_at;
        s = convex_separation(pair, at);
    }
    if (!(s >= *separation - pair->slack / 4)) return false;
    /* the points were better before */
    if (!certain && s <= *separation + pair->slack && residual > first) return false;
    *active = now;
    *n = at;
    *separation = s;
    return certain;
}

#endif
