/* Rigid body formulas: world inertia, dynamics vector, gyroscopic term, pose integration. */
#ifndef SADMM_MATH_RIGID_H
#define SADMM_MATH_RIGID_H

#include "quat.h"

/* Symmetric 3x3: xx, yy, zz, xy, xz, yz. */
typedef struct sym3 { real xx, yy, zz, xy, xz, yz; } sym3;

SADMM_INLINE vec3 s3_mul(sym3 s, vec3 v)
{
    return v3(s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
              s.xz * v.x + s.yz * v.y + s.zz * v.z);
}

/* R diag(inertia) R^T */
SADMM_INLINE sym3 rigid_world_inertia(mat3 R, vec3 inertia)
{
    sym3 s;
    vec3 a = v3(R.r[0].x * inertia.x, R.r[0].y * inertia.y, R.r[0].z * inertia.z);
    vec3 b = v3(R.r[1].x * inertia.x, R.r[1].y * inertia.y, R.r[1].z * inertia.z);
    vec3 c = v3(R.r[2].x * inertia.x, R.r[2].y * inertia.y, R.r[2].z * inertia.z);
    s.xx = v3_dot(a, R.r[0]); s.yy = v3_dot(b, R.r[1]); s.zz = v3_dot(c, R.r[2]);
    s.xy = v3_dot(a, R.r[1]); s.xz = v3_dot(a, R.r[2]); s.yz = v3_dot(b, R.r[2]);
    return s;
}

/* Principal moments that differ by no more than rounding need no gyroscopic term. */
SADMM_INLINE int rigid_is_isotropic(vec3 inertia)
{
    real lo = real_min(inertia.x, real_min(inertia.y, inertia.z));
    real hi = real_max(inertia.x, real_max(inertia.y, inertia.z));
    return hi - lo <= 4 * SADMM_EPSILON * hi;
}

/* Solve M x = r for a general 3x3 M (rows) by Cramer's rule. */
SADMM_INLINE vec3 m3_solve(mat3 m, vec3 r)
{
    vec3 c0 = v3_cross(m.r[1], m.r[2]), c1 = v3_cross(m.r[2], m.r[0]), c2 = v3_cross(m.r[0], m.r[1]);
    real inv = 1 / v3_dot(m.r[0], c0);
    return v3_scale(v3_madd(v3_madd(v3_scale(c0, r.x), r.y, c1), r.z, c2), inv);
}

/* Angular velocity (body frame) after dt of torque-free motion by the implicit midpoint rule,
 *   I (w' - w) + dt m x I m = 0,  m = (w + w') / 2,
 * which conserves the energy w.Iw and the angular momentum |Iw| exactly once solved, at any speed. Newton from w; the
 * step is cut so that no piece turns more than half a radian, where Newton converges to rounding in a few steps. */
SADMM_INLINE vec3 rigid_gyroscopic(vec3 inertia, vec3 w, real dt)
{
    real turn = v3_norm(w) * real_abs(dt);
    int pieces = turn > (real)0.5 ? (int)real_min(turn * 2 + 1, (real)4096) : 1;
    real h = dt / (real)pieces;
    int p, k;
    for (p = 0; p < pieces; ++p) {
        vec3 x = w;
        for (k = 0; k < 5; ++k) {
            vec3 m = v3_scale(v3_add(w, x), (real)0.5);
            vec3 Im = v3(inertia.x * m.x, inertia.y * m.y, inertia.z * m.z);
            vec3 d = v3_sub(x, w), g = v3_cross(m, Im), f, dx;
            mat3 J;
            f = v3(inertia.x * d.x + h * g.x, inertia.y * d.y + h * g.y, inertia.z * d.z + h * g.z);
            /* J = I + h/2 ([m]x I - [I m]x) */
            J.r[0] = v3(inertia.x, h / 2 * (-m.z * inertia.y + Im.z), h / 2 * (m.y * inertia.z - Im.y));
            J.r[1] = v3(h / 2 * (m.z * inertia.x - Im.z), inertia.y, h / 2 * (-m.x * inertia.z + Im.x));
            J.r[2] = v3(h / 2 * (-m.y * inertia.x + Im.y), h / 2 * (m.x * inertia.y - Im.x), inertia.z);
            dx = m3_solve(J, f);
            x = v3_sub(x, dx);
            if (v3_max_abs(dx) <= 2 * SADMM_EPSILON * v3_max_abs(x)) break;
        }
        w = x;
    }
    return w;
}

/* Angular part of b without external torque: world inertia times the angular velocity after the gyroscopic term. */
SADMM_INLINE vec3 rigid_angular_momentum(quat q, vec3 inertia, vec3 w_world, real dt)
{
    mat3 R = q_matrix(q);
    vec3 w = m3_tmul(R, w_world);
    if (!rigid_is_isotropic(inertia)) w = rigid_gyroscopic(inertia, w, dt);
    return m3_mul(R, v3(inertia.x * w.x, inertia.y * w.y, inertia.z * w.z));
}

/* Sizes of the accelerations that a force (N) and a torque (N m, world frame) give by themselves, m/s^2 and rad/s^2. */
SADMM_INLINE real rigid_acceleration(real mass, vec3 force)
{
    return v3_max_abs(force) == 0 ? 0 : v3_norm(force) / mass; /* most bodies have none */
}
SADMM_INLINE real rigid_angular_acceleration(quat q, vec3 inertia, vec3 torque)
{
    vec3 t;
    if (v3_max_abs(torque) == 0) return 0;
    t = m3_tmul(q_matrix(q), torque);
    return v3_norm(v3(t.x / inertia.x, t.y / inertia.y, t.z / inertia.z));
}

/* A pose after dt of motion by one velocity. */
SADMM_INLINE vec3 rigid_move(vec3 x, vec3 v, real dt) { return v3_madd(x, dt, v); }
SADMM_INLINE quat rigid_turn(quat q, vec3 w, real dt) { return q_normalize(q_mul(q_exp(v3_scale(w, dt)), q)); }

#endif
