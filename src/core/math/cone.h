/* The cone |t| <= n of x = (n, t_1, t_2), as interior points need it (core/solve/ncp_interior.c): Jordan's product, and
 * Nesterov and Todd's scaling. In double. */
#ifndef SADMM_CORE_MATH_CONE_H
#define SADMM_CORE_MATH_CONE_H

#include <math.h>
#include <stdbool.h>

#include "core/base/inline.h"

SADMM_INLINE double cone_product(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* n^2 - |t|^2, without cancellation. */
SADMM_INLINE double cone_determinant(const double a[3])
{
    const double t = hypot(a[1], a[2]);
    return (a[0] - t) * (a[0] + t);
}

/* Jordan's product. */
SADMM_INLINE void cone_multiply(const double a[3], const double b[3], double to[3])
{
    to[0] = cone_product(a, b);
    to[1] = a[0] * b[1] + b[0] * a[1];
    to[2] = a[0] * b[2] + b[0] * a[2];
}

/* a times what is b? */
SADMM_INLINE void cone_divide(const double a[3], const double b[3], double to[3])
{
    to[0] = (a[0] * b[0] - a[1] * b[1] - a[2] * b[2]) / cone_determinant(a);
    to[1] = (b[1] - a[1] * to[0]) / a[0];
    to[2] = (b[2] - a[2] * to[0]) / a[0];
}

/* The least t > 0 at which x + t dx is on the boundary. */
SADMM_INLINE double cone_way_to_boundary(const double x[3], const double dx[3])
{
    const double a = cone_determinant(dx), b = x[0] * dx[0] - x[1] * dx[1] - x[2] * dx[2], c = cone_determinant(x),
                 under = b * b - a * c;
    double way = dx[0] < 0 ? -x[0] / dx[0] : HUGE_VAL, q;
    if (under < 0) return way;
    q = -(b + copysign(sqrt(under), b));
    if (a != 0 && q / a > 0) way = fmin(way, q / a);
    if (q != 0 && c / q > 0) way = fmin(way, c / q);
    return way;
}

/* W = size [w_0, t^T; t, 1 + t t^T / (1 + w_0)], w = (w_0, t) the middle: W^2 = size^2 (2 w w^T - J), J = diag(1, -1,
 * -1). */
struct cone_scaling {
    double middle[3], size;
};

/* W a, or W^-1 a: t of the other sign. */
SADMM_INLINE void cone_scale(const struct cone_scaling *c, bool inverse, const double a[3], double to[3])
{
    const double sign = inverse ? -1 : 1, *w = c->middle, t = sign * (w[1] * a[1] + w[2] * a[2]),
                 along = a[0] + t / (1 + w[0]), size = inverse ? 1 / c->size : c->size;
    to[0] = size * (w[0] * a[0] + t);
    to[1] = size * (a[1] + sign * w[1] * along);
    to[2] = size * (a[2] + sign * w[2] * along);
}

/* W^-1 x = W dual = scaled. False: one of the two is not inside. */
SADMM_INLINE bool cone_find_scaling(const double x[3], const double dual[3], struct cone_scaling *c, double scaled[3])
{
    const double a = cone_determinant(x), b = cone_determinant(dual);
    double in_x, in_dual, twice;
    int k;
    if (!(a > 0 && b > 0 && a < HUGE_VAL && b < HUGE_VAL)) return false;
    in_x = 1 / sqrt(a), in_dual = 1 / sqrt(b);
    twice = 2 * sqrt((1 + cone_product(x, dual) * in_x * in_dual) / 2);
    for (k = 0; k < 3; ++k) c->middle[k] = (x[k] * in_x + (k == 0 ? 1 : -1) * dual[k] * in_dual) / twice;
    c->size = sqrt(sqrt(a / b));
    cone_scale(c, true, x, scaled);
    return true;
}

/* What W^-1 dx + W dstep is to be, to make the product of the two `aim`; second: what the whole step leaves of it in
 * the second order. */
SADMM_INLINE void cone_wanted(const double scaled[3], double aim, const double second[3], double to[3])
{
    double residual[3];
    int k;
    cone_multiply(scaled, scaled, residual);
    for (k = 0; k < 3; ++k) residual[k] = (k == 0 ? aim : 0) - residual[k] - (second ? second[k] : 0);
    cone_divide(scaled, residual, to);
}

/* Of a bound, so far away: its dual's step for a step `nearer` to it. */
SADMM_INLINE double bound_step(double aim, double second, double away, double dual, double nearer)
{
    return (aim - second) / away - dual + dual / away * nearer;
}

#endif
