/* Unit quaternions (w, x, y, z), body to world. */
#ifndef SADMM_MATH_QUAT_H
#define SADMM_MATH_QUAT_H

#include "vec3.h"

typedef struct quat { real w, x, y, z; } quat;

SADMM_INLINE quat q_load(const double *p)
{
    quat q; q.w = (real)p[0]; q.x = (real)p[1]; q.y = (real)p[2]; q.z = (real)p[3]; return q;
}
SADMM_INLINE void q_store(quat q, double *p)
{
    p[0] = (double)q.w; p[1] = (double)q.x; p[2] = (double)q.y; p[3] = (double)q.z;
}
SADMM_INLINE quat q_mul(quat a, quat b)
{
    quat q;
    q.w = a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z;
    q.x = a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y;
    q.y = a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x;
    q.z = a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w;
    return q;
}
SADMM_INLINE quat q_normalize(quat q)
{
    real s = 1 / real_sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    q.w *= s; q.x *= s; q.y *= s; q.z *= s;
    return q;
}
/* Rotation matrix; its columns are the body axes in the world. */
SADMM_INLINE mat3 q_matrix(quat q)
{
    mat3 m;
    real xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
    real xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
    real wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
    m.r[0] = v3(1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy));
    m.r[1] = v3(2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx));
    m.r[2] = v3(2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy));
    return m;
}
/* cos x and sin x / x by y = x^2 <= QUAT_SERIES: their series, whose next terms are under 1e-17. By sums and products
 * alone, so that hosts and devices give the same bits. */
#define QUAT_SERIES 0.62
SADMM_INLINE void q_series(double y, double *cosine, double *sine_over_x)
{
    *cosine = 1 - y * (1. / 2 - y * (1. / 24 - y * (1. / 720 - y * (1. / 40320 - y * (1. / 3628800 -
              y * (1. / 479001600 - y * (1. / 87178291200 - y * (1. / 20922789888000))))))));
    *sine_over_x = 1 - y * (1. / 6 - y * (1. / 120 - y * (1. / 5040 - y * (1. / 362880 - y * (1. / 39916800 -
                   y * (1. / 6227020800 - y * (1. / 1307674368000 - y * (1. / 355687428096000))))))));
}

/* The same by any y: of x halved until the series does, doubled as often. */
SADMM_RARE void q_long_series(double y, double *cosine, double *sine_over_x)
{
    const double x = sqrt(y);
    double s;
    int halved = 0, k;
    for (; y > QUAT_SERIES && y <= DBL_MAX; y *= 0.25) ++halved;
    q_series(y, cosine, sine_over_x);
    s = *sine_over_x * sqrt(y);
    for (k = 0; k < halved; ++k) { /* each time of norm 1, which rounding would take further from it */
        const double c = *cosine * *cosine - s * s, twice = 2 * *cosine * s, norm = sqrt(c * c + twice * twice);
        *cosine = c / norm, s = twice / norm;
    }
    *sine_over_x = s / x;
}

/* exp of a rotation vector (world frame). */
SADMM_INLINE quat q_exp(vec3 w)
{
    const double y = 0.25 * (double)v3_norm2(w);
    double c, s;
    quat q;
    if (y <= QUAT_SERIES) q_series(y, &c, &s);
    else q_long_series(y, &c, &s);
    s *= 0.5;
    q.w = (real)c; q.x = (real)s * w.x; q.y = (real)s * w.y; q.z = (real)s * w.z;
    return q;
}

#endif
