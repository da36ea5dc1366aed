/* Rigid body formulas: world inertia, angular momentum, motion without torque, pose integration. */
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

SADMM_INLINE sym3 s3_add(sym3 a, sym3 b)
{
    a.xx += b.xx, a.yy += b.yy, a.zz += b.zz, a.xy += b.xy, a.xz += b.xz, a.yz += b.yz;
    return a;
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

/* A pose after dt of motion by one velocity. */
SADMM_INLINE vec3 rigid_move(vec3 x, vec3 v, real dt) { return v3_madd(x, dt, v); }
SADMM_INLINE quat rigid_turn(quat q, vec3 w, real dt) { return q_normalize(q_mul(q_exp(v3_scale(w, dt)), q)); }

/* Where a body is turned to, and its angular velocity; world frame. */
struct rigid_spin {
    quat orientation;
    vec3 angular;
};

/* R diag(inertia) R^T w */
SADMM_INLINE vec3 rigid_angular_momentum(quat q, vec3 inertia, vec3 w)
{
    mat3 R = q_matrix(q);
    vec3 body = m3_tmul(R, w);
    return m3_mul(R, v3(inertia.x * body.x, inertia.y * body.y, inertia.z * body.z));
}

/* The angular velocity of a body with this angular momentum. */
SADMM_INLINE vec3 rigid_angular_velocity(quat q, vec3 inertia, vec3 momentum)
{
    mat3 R = q_matrix(q);
    vec3 body = m3_tmul(R, momentum);
    return m3_mul(R, v3(body.x / inertia.x, body.y / inertia.y, body.z / inertia.z));
}

/* tan(x) / x of half an angle, of 1 rad at most: far from where it has none. Series below 0.1 rad: its next term is under
 * 1e-17. */
SADMM_INLINE real rigid_half_tangent(real angle)
{
    const double x = angle < 1 ? 0.5 * (double)angle : 0.5, y = x * x;
    if (x > 0.05) return (real)(tan(x) / x);
    return (real)(1 + y * (1 / 3. + y * (2 / 15. + y * (17 / 315. + y * (62 / 2835. + y * (1382 / 155925.))))));
}

/* The mean angular velocity m, in the body's frame, of h of motion without torque from angular velocity w and momentum
 * p = I w,
 *
 *     I m - p + h/2 m x I m = 0,
 *
 * by iteration, which comes near, then by Newton's method. The turn by 2 atan(h |m| / 2) about m takes p to 2 I m - p,
 * which has the same energy; longer by rigid_half_tangent, h makes it the turn of the angle that a body goes by in that
 * time about an axis that stays. */
SADMM_INLINE vec3 rigid_mean_spin(vec3 inertia, vec3 w, vec3 p, real h)
{
    const vec3 inverse = v3(1 / inertia.x, 1 / inertia.y, 1 / inertia.z);
    const real turn = h * v3_max_abs(w);
    vec3 m = w;
    int k;
    for (k = 0; k < 2; ++k) {
        const vec3 g = v3_cross(m, v3(inertia.x * m.x, inertia.y * m.y, inertia.z * m.z));
        m = v3(w.x - h / 2 * (g.x * inverse.x), w.y - h / 2 * (g.y * inverse.y), w.z - h / 2 * (g.z * inverse.z));
    }
    for (k = 0; k < 8; ++k) {
        const vec3 Im = v3(inertia.x * m.x, inertia.y * m.y, inertia.z * m.z), g = v3_cross(m, Im);
        const vec3 f = v3_madd(v3_sub(Im, p), h / 2, g);
        real step, size;
        vec3 dm;
        mat3 J; /* I + h/2 ([m]x I - [I m]x) */
        J.r[0] = v3(inertia.x, h / 2 * (-m.z * inertia.y + Im.z), h / 2 * (m.y * inertia.z - Im.y));
        J.r[1] = v3(h / 2 * (m.z * inertia.x - Im.z), inertia.y, h / 2 * (-m.x * inertia.z + Im.x));
        J.r[2] = v3(h / 2 * (-m.y * inertia.x + Im.y), h / 2 * (m.x * inertia.y - Im.x), inertia.z);
        dm = m3_solve(J, f);
        m = v3_sub(m, dm);
        step = v3_max_abs(dm), size = v3_max_abs(m);
        if (!(turn * step * step > SADMM_EPSILON * size * size)) break; /* the next one would be rounding */
    }
    return m;
}

/* dt of motion without torque of a body whose moments differ, in pieces of at most half a radian, in which Newton's
 * method closes in at once. The angular momentum in space is as it was, to rounding, and so is the energy. */
SADMM_CALLED struct rigid_spin rigid_tumble(struct rigid_spin from, vec3 inertia, real dt)
{
    const real turn = v3_norm(from.angular) * dt;
    const int pieces = turn > (real)0.5 ? (int)real_min(turn * 2 + 1, (real)4096) : 1;
    const real h = dt / (real)pieces;
    mat3 R = q_matrix(from.orientation);
    vec3 w = m3_tmul(R, from.angular), p = v3(inertia.x * w.x, inertia.y * w.y, inertia.z * w.z);
    const vec3 momentum = m3_mul(R, p);
    int k;
    for (k = 0; k < pieces; ++k) {
        const real stretched = h * rigid_half_tangent(h * v3_norm(w));
        const vec3 m = rigid_mean_spin(inertia, w, p, stretched);
        quat step;
        step.w = 1;
        step.x = stretched / 2 * m.x, step.y = stretched / 2 * m.y, step.z = stretched / 2 * m.z;
        from.orientation = q_normalize(q_mul(from.orientation, step));
        R = q_matrix(from.orientation);
        p = m3_tmul(R, momentum);
        w = v3(p.x / inertia.x, p.y / inertia.y, p.z / inertia.z);
    }
    from.angular = m3_mul(R, w);
    return from;
}

/* dt of motion without torque. */
SADMM_INLINE struct rigid_spin rigid_drift(struct rigid_spin from, vec3 inertia, real dt)
{
    if (!rigid_is_isotropic(inertia)) return rigid_tumble(from, inertia, dt);
    from.orientation = rigid_turn(from.orientation, from.angular, dt);
    return from;
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

#endif
