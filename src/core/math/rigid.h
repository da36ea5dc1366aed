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

/* Principal moments that differ by no more than rounding are equal. */
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

/* tan(x) / x by y = x^2: that of half an angle of 0.5 rad at most, to rounding (its continued fraction). */
SADMM_INLINE real rigid_half_tangent(real y)
{
    const real z = y < (real)0.0625 ? y : (real)0.0625;
    return (10395 - z * (1260 - 21 * z)) / (10395 - z * (4725 - z * (210 - z)));
}

/* The mean angular velocity m, in the body's frame, of h of motion without torque from angular velocity w:
 *
 *     I m - I w + h/2 m x I m = 0,    c = h/2 ((I_z - I_y) / I_x, (I_x - I_z) / I_y, (I_y - I_x) / I_z)
 *
 * By sweeps over the equations, two of which take the error down by (|c| |w|)^3: in a piece of a motion |c| |w| is 1/3
 * at most. */
SADMM_INLINE vec3 rigid_mean_spin(vec3 w, vec3 c)
{
    const real rate = v3_max_abs(c) * v3_max_abs(w), faster = rate * rate * rate;
    real error = 1;
    vec3 m = w;
    int k;
    do {
        for (k = 0; k < 2; ++k) {
            m.x = w.x - c.x * (m.y * m.z);
            m.y = w.y - c.y * (m.z * m.x);
            m.z = w.z - c.z * (m.x * m.y);
        }
        error *= faster;
    } while (error > SADMM_EPSILON && rate < (real)0.5);
    return m;
}

/* Of a body whose moments differ, in its own frame: where it is turned to, that as a matrix, how fast it turns. */
struct rigid_tumbling {
    quat orientation;
    mat3 R;
    vec3 own;
};

/* No less than the square of a body's angular velocity at any time of its motion without torque, times `scale`: by w.Iw
 * and |Iw|^2, which stay. Of a turn about the axis of the least or the largest moment it is that square. */
SADMM_INLINE real rigid_rate2_scaled(vec3 inertia, real energy2, real momentum2, real *scale)
{
    const real lo = real_min(inertia.x, real_min(inertia.y, inertia.z)),
               hi = real_max(inertia.x, real_max(inertia.y, inertia.z));
    *scale = lo * hi;
    return (lo + hi) * energy2 - momentum2;
}
/* By the angular velocity at one time, in the body's frame. */
SADMM_INLINE real rigid_rate2(vec3 inertia, vec3 own)
{
    const vec3 p = v3(inertia.x * own.x, inertia.y * own.y, inertia.z * own.z);
    real scale, rate2 = rigid_rate2_scaled(inertia, v3_dot(p, own), v3_norm2(p), &scale);
    return rate2 / scale;
}

/* In how many pieces of half a radian at most, in which the mean spin is soon found, a motion without torque goes.
 * The way back goes in as many. */
SADMM_INLINE real rigid_pieces(vec3 inertia, real energy2, real momentum2, real dt)
{
    real scale, square = dt * dt * rigid_rate2_scaled(inertia, energy2, momentum2, &scale);
    return 4 * square > scale ? 2 * real_sqrt(square / scale) + 1 : 1;
}
/* The most that are made: what turns by more than that in a step has gone round too often to ask where it is by then,
 * but its energy and its angular momentum stay. */
enum { RIGID_PIECES = 4096 };

/* A piece of twice `half`: turned about the mean by 2 atan(half |m|). */
SADMM_INLINE struct rigid_tumbling rigid_tumble_piece(struct rigid_tumbling from, vec3 c, real half)
{
    const vec3 m = rigid_mean_spin(from.own, c);
    quat step;
    step.w = 1, step.x = half * m.x, step.y = half * m.y, step.z = half * m.z;
    from.orientation = q_normalize(q_mul(from.orientation, step));
    from.own = v3_sub(v3_scale(m, 2), from.own);
    return from;
}
SADMM_RARE struct rigid_tumbling rigid_tumble_pieces(struct rigid_tumbling from, vec3 c, real half, int pieces)
{
    int k;
    for (k = 0; k < pieces; ++k) from = rigid_tumble_piece(from, c, half);
    return from;
}

/* dt of motion without torque by the midpoint rule: the turn by 2 atan(h |m| / 2) about the mean m takes w to 2 m - w,
 * which has the same energy and in space the same angular momentum, to rounding. h is longer than the time by as much
 * as makes that the turn of the angle by which a body goes about a principal axis. By -dt it goes back to where it
 * was. */
SADMM_ALWAYS_INLINE struct rigid_tumbling rigid_tumble_on(struct rigid_tumbling from, vec3 inertia, real dt)
{
    const vec3 p = v3(inertia.x * from.own.x, inertia.y * from.own.y, inertia.z * from.own.z);
    const real energy2 = v3_dot(p, from.own), momentum2 = v3_norm2(p);
    const real all = rigid_pieces(inertia, energy2, momentum2, dt);
    const int pieces = all < RIGID_PIECES ? (int)all : RIGID_PIECES;
    const real half = all > RIGID_PIECES ? dt / (2 * all)
                      : pieces > 1       ? dt / (real)(2 * pieces)
                                         : dt / 2,
               rate2 = energy2 / momentum2 * energy2, stretched = half * rigid_half_tangent(half * half * rate2);
    const vec3 c = v3(stretched * ((inertia.z - inertia.y) / inertia.x),
                      stretched * ((inertia.x - inertia.z) / inertia.y),
                      stretched * ((inertia.y - inertia.x) / inertia.z));
    from = pieces > 1 ? rigid_tumble_pieces(from, c, stretched, pieces) : rigid_tumble_piece(from, c, stretched);
    from.R = q_matrix(from.orientation);
    return from;
}

/* The same in the world's frame; what does not turn stays as it is. */
SADMM_CALLED struct rigid_spin rigid_tumble(struct rigid_spin from, vec3 inertia, real dt)
{
    struct rigid_tumbling t;
    if (v3_max_abs(from.angular) == 0) return from;
    t.orientation = from.orientation;
    t.R = q_matrix(from.orientation);
    t.own = m3_tmul(t.R, from.angular);
    t = rigid_tumble_on(t, inertia, dt);
    from.orientation = t.orientation;
    from.angular = m3_mul(t.R, t.own);
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
