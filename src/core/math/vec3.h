/* 3-vectors and 3x3 matrices on registers. */
#ifndef SADMM_MATH_VEC3_H
#define SADMM_MATH_VEC3_H

#include "real.h"

typedef struct vec3 { real x, y, z; } vec3;
/* Rows r[0..2]. */
typedef struct mat3 { vec3 r[3]; } mat3;

SADMM_INLINE vec3 v3(real x, real y, real z) { vec3 v; v.x = x; v.y = y; v.z = z; return v; }
/* Along axis k. */
SADMM_INLINE vec3 v3_axis(int k, real s) { return v3(k == 0 ? s : 0, k == 1 ? s : 0, k == 2 ? s : 0); }
SADMM_INLINE vec3 v3_load(const double *p) { return v3((real)p[0], (real)p[1], (real)p[2]); }
SADMM_INLINE void v3_store(vec3 v, double *p) { p[0] = (double)v.x; p[1] = (double)v.y; p[2] = (double)v.z; }
SADMM_INLINE vec3 v3_add(vec3 a, vec3 b) { return v3(a.x + b.x, a.y + b.y, a.z + b.z); }
SADMM_INLINE vec3 v3_sub(vec3 a, vec3 b) { return v3(a.x - b.x, a.y - b.y, a.z - b.z); }
SADMM_INLINE vec3 v3_neg(vec3 a) { return v3(-a.x, -a.y, -a.z); }
SADMM_INLINE vec3 v3_scale(vec3 a, real s) { return v3(a.x * s, a.y * s, a.z * s); }
/* a + s b */
SADMM_INLINE vec3 v3_madd(vec3 a, real s, vec3 b) { return v3(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z); }
SADMM_INLINE real v3_dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
SADMM_INLINE vec3 v3_cross(vec3 a, vec3 b)
{
    return v3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
SADMM_INLINE real v3_norm2(vec3 a) { return v3_dot(a, a); }
SADMM_INLINE real v3_norm(vec3 a) { return real_sqrt(v3_dot(a, a)); }
SADMM_INLINE real v3_max_abs(vec3 a) { return real_max(real_abs(a.x), real_max(real_abs(a.y), real_abs(a.z))); }

/* M v and M^T v. */
SADMM_INLINE vec3 m3_mul(mat3 m, vec3 v) { return v3(v3_dot(m.r[0], v), v3_dot(m.r[1], v), v3_dot(m.r[2], v)); }
SADMM_INLINE vec3 m3_tmul(mat3 m, vec3 v)
{
    return v3_madd(v3_madd(v3_scale(m.r[0], v.x), v.y, m.r[1]), v.z, m.r[2]);
}

/* Right-handed tangents of a unit normal, branchless (Duff et al., Building an Orthonormal Basis, Revisited,
 * JCGT 2017): n x t1 = t2. */
SADMM_INLINE void v3_tangents(vec3 n, vec3 *t1, vec3 *t2)
{
    real sign = n.z < 0 ? (real)-1 : (real)1;
    real a = -1 / (sign + n.z);
    real b = n.x * n.y * a;
    *t1 = v3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    *t2 = v3(b, sign + n.y * n.y * a, -n.y);
}

#endif
