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
/* exp of a rotation vector (world frame). Series below 1e-4 rad: its next term is under 1e-19. */
SADMM_INLINE quat q_exp(vec3 w)
{
    double t2 = (double)v3_norm2(w), t = sqrt(t2), half = 0.5 * t;
    double s = t < 1e-4 ? 0.5 - t2 / 48.0 : sin(half) / t;
    quat q;
    q.w = (real)cos(half); q.x = (real)s * w.x; q.y = (real)s * w.y; q.z = (real)s * w.z;
    return q;
}

#endif
