/* Geometry of joints: two frames, one on each body, and six coordinates of the second relative to the first.
 *
 * Coordinates 0 to 2 are translations: the way from the origin of a's frame to that of b's, along the axes of a's. A
 * radial joint (distance) has its length as coordinate 0 instead. Coordinates 3 to 5 are rotations; what they mean
 * depends on how many of them are locked:
 *
 *     3, 0   the rotation vector (logarithm of the quaternion) in a's frame: errors of any size below a half turn have
 *            a direction, and none has a singularity
 *     2      swing and twist: the free one is the angle about its axis, the locked ones are the rotation vector of what
 *            turns that axis away
 *     1      a universal joint's cross: of the locked axis k, i = k + 1 is an axis of a's frame and j = k + 2 one of
 *            b's (cyclic); they are to be perpendicular, and the free coordinates are the angles about them
 *
 * The rate of coordinate r is J_a v_a + J_b v_b with J_b = [n, arm_b x n], J_a = -[n, arm_a x n] of a translation along
 * n, [0, n] and -[0, n] of a rotation about n. Both arms go to b's point: what they transmit acts at one point of
 * space, and makes no angular momentum. */
#ifndef SADMM_MATH_JOINT_H
#define SADMM_MATH_JOINT_H

#include <stdbool.h>

#include "quat.h"

enum { JOINT_COORDINATES = 6, JOINT_ALL_LOCKED = 63 };

/* A joint's frame on a body, in the body's (for the static world: in the world's). */
struct joint_frame {
    vec3 position;
    quat orientation;
};

/* The same in the world; arm: from the body's centre of mass. */
struct joint_end {
    vec3 point, arm;
    quat orientation;
};

struct joint_geometry {
    vec3 axis[JOINT_COORDINATES]; /* unit, world */
    vec3 arm_a, arm_b;            /* from the centres of mass to `point` */
    vec3 point;                   /* origin of b's frame, world */
    real value[JOINT_COORDINATES]; /* m, rad; angles in (-pi, pi] */
};

SADMM_INLINE quat q_conjugate(quat q)
{
    q.x = -q.x; q.y = -q.y; q.z = -q.z;
    return q;
}

SADMM_INLINE vec3 q_turn(quat q, vec3 v) { return m3_mul(q_matrix(q), v); }

/* The rotation vector of a unit quaternion, of at most half a turn, is its vector part times this. sine: its size. */
SADMM_INLINE real q_log_scale(real w, real sine)
{
    const real sign = w < 0 ? (real)-1 : (real)1;
    /* 2 atan(s / w) / s, whose next term is under 1e-16 there */
    const double scale = sine < (real)1e-8 ? 2 : 2 * atan2((double)sine, (double)(sign * w)) / (double)sine;
    return sign * (real)scale;
}
SADMM_INLINE vec3 q_log(quat q)
{
    const vec3 v = v3(q.x, q.y, q.z);
    return v3_scale(v, q_log_scale(q.w, v3_norm(v)));
}

SADMM_INLINE real v3_part(vec3 v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }
SADMM_INLINE vec3 m3_column(mat3 m, int k)
{
    return v3(v3_part(m.r[0], k), v3_part(m.r[1], k), v3_part(m.r[2], k));
}

SADMM_INLINE struct joint_end joint_end_of(const struct joint_frame *frame, vec3 center, quat orientation)
{
    struct joint_end end;
    end.arm = q_turn(orientation, frame->position);
    end.point = v3_add(center, end.arm);
    end.orientation = q_mul(orientation, frame->orientation);
    return end;
}

SADMM_INLINE int joint_locked_rotations(uint32_t locks)
{
    return (int)(locks >> 3 & 1) + (int)(locks >> 4 & 1) + (int)(locks >> 5 & 1);
}

/* The rotation that is the only one locked, or the only one free; -1: neither. */
SADMM_INLINE int joint_odd_rotation(uint32_t locks)
{
    const uint32_t rotations = locks >> 3, odd = joint_locked_rotations(locks) == 1 ? rotations : ~rotations & 7;
    return odd == 1 ? 0 : odd == 2 ? 1 : odd == 4 ? 2 : -1;
}

/* Two rotations are locked, `free` is not: relative = swing twist, of which the twist is about its axis. Values of the
 * locked ones; returns the scalar part of the twist, and its part along the axis. */
SADMM_INLINE real joint_swing_off(quat relative, int free, real *twist, real value[3])
{
    const vec3 part = v3(relative.x, relative.y, relative.z);
    const int i = (free + 1) % 3, j = (free + 2) % 3;
    const real along = v3_part(part, free), at_i = v3_part(part, i), at_j = v3_part(part, j),
               size = real_sqrt(relative.w * relative.w + along * along), w = size > 0 ? relative.w / size : 1,
               turn = size > 0 ? along / size : 0;
    const real left = along * w - relative.w * turn, to_i = at_i * w - at_j * turn, to_j = at_j * w + at_i * turn;
    const quat swing = {relative.w * w + along * turn, free == 0 ? left : free == 1 ? to_j : to_i,
                        free == 1 ? left : free == 2 ? to_j : to_i, free == 2 ? left : free == 0 ? to_j : to_i};
    const vec3 off = q_log(swing);
    value[0] = off.x, value[1] = off.y, value[2] = off.z;
    *twist = turn;
    return w;
}
/* And of the free one. */
SADMM_INLINE void joint_swing(quat relative, int free, real value[3])
{
    real turn;
    const real w = joint_swing_off(relative, free, &turn, value);
    value[free] = turn * q_log_scale(w, real_abs(turn));
}

/* Rotation `locked` is, the other two are free: axes of `axis` that are not a's; values. */
SADMM_INLINE void joint_cross_axes(mat3 a, mat3 b, int locked, vec3 axis[3])
{
    const vec3 a_i = m3_column(a, (locked + 1) % 3), b_j = m3_column(b, (locked + 2) % 3), n = v3_cross(a_i, b_j);
    const real size = v3_norm(n);
    axis[(locked + 2) % 3] = b_j;
    axis[locked] = size > 0 ? v3_scale(n, 1 / size) : m3_column(a, locked);
}
SADMM_INLINE void joint_cross_values(mat3 a, mat3 b, int locked, real value[3])
{
    const int i = (locked + 1) % 3, j = (locked + 2) % 3;
    const vec3 a_i = m3_column(a, i), b_j = m3_column(b, j);
    value[locked] = (real)atan2((double)-v3_dot(a_i, b_j), (double)v3_norm(v3_cross(a_i, b_j)));
    value[i] = (real)atan2((double)v3_dot(b_j, m3_column(a, locked)), (double)v3_dot(b_j, m3_column(a, j)));
    value[j] = (real)atan2((double)v3_dot(a_i, m3_column(b, locked)), (double)v3_dot(a_i, m3_column(b, i)));
}

/* Rotations of b's frame past a's where not one of them alone is locked; free: of free ones, too. */
SADMM_ALWAYS_INLINE void joint_rotation_values(quat a, quat b, uint32_t locks, bool free, real value[3])
{
    const quat relative = q_mul(q_conjugate(a), b);
    vec3 turn;
    real twist;
    if (joint_locked_rotations(locks) == 2) {
        if (free) joint_swing(relative, joint_odd_rotation(locks), value);
        else joint_swing_off(relative, joint_odd_rotation(locks), &twist, value);
        return;
    }
    turn = q_log(relative);
    value[0] = turn.x, value[1] = turn.y, value[2] = turn.z;
}

/* A length below this has no direction: a's x axis stands for it. */
#define JOINT_LEAST_LENGTH 1e-12

/* values: else `value` is left as it is, for what asks where the axes are and not how far. */
SADMM_ALWAYS_INLINE struct joint_geometry joint_geometry_with(const struct joint_end *a, const struct joint_end *b,
                                                              uint32_t locks, int radial, bool values)
{
    struct joint_geometry g;
    const mat3 frame = q_matrix(a->orientation);
    const vec3 way = v3_sub(b->point, a->point);
    const int locked = joint_locked_rotations(locks), odd = joint_odd_rotation(locks);
    int k;
    g.arm_a = v3_add(a->arm, way);
    g.arm_b = b->arm;
    g.point = b->point;
    for (k = 0; k < 3; ++k) {
        g.axis[k] = g.axis[k + 3] = m3_column(frame, k);
        g.value[k] = v3_dot(g.axis[k], way);
    }
    if (radial) {
        const real length = v3_norm(way);
        if (length > (real)JOINT_LEAST_LENGTH) g.axis[0] = v3_scale(way, 1 / length);
        g.value[0] = length;
    }
    if (locked == 1) {
        const mat3 other = q_matrix(b->orientation);
        joint_cross_axes(frame, other, odd, g.axis + 3);
        if (values) joint_cross_values(frame, other, odd, g.value + 3);
        return g;
    }
    if (values) joint_rotation_values(a->orientation, b->orientation, locks, true, g.value + 3);
    return g;
}
SADMM_INLINE struct joint_geometry joint_geometry_of(const struct joint_end *a, const struct joint_end *b,
                                                     uint32_t locks, int radial)
{
    return joint_geometry_with(a, b, locks, radial, true);
}
SADMM_INLINE struct joint_geometry joint_axes_of(const struct joint_end *a, const struct joint_end *b, uint32_t locks,
                                                 int radial)
{
    return joint_geometry_with(a, b, locks, radial, false);
}

/* Is coordinate k an angle that goes on beyond a half turn? */
SADMM_INLINE int joint_winds(uint32_t locks, int k)
{
    const int locked = joint_locked_rotations(locks);
    return k >= 3 && !(locks >> k & 1) && (locked == 1 || locked == 2);
}

/* The angle nearest to `last` of those that differ from it by whole turns. */
SADMM_INLINE real joint_unwind(real angle, real last)
{
    const double turn = 6.283185307179586476925;
    return angle + (real)(turn * floor(((double)last - (double)angle) / turn + 0.5));
}

/* Row of coordinate k on b, and on a but for its sign. */
SADMM_INLINE void joint_row(const struct joint_geometry *g, int k, vec3 arm, vec3 *linear, vec3 *angular)
{
    *linear = k < 3 ? g->axis[k] : v3(0, 0, 0);
    *angular = k < 3 ? v3_cross(arm, g->axis[k]) : g->axis[k];
}

/* ---- laws -------------------------------------------------------------------------------------------------------- */

/* Positions move by the mean of the velocities before and after a step, errors are fed back by the velocity after it:
 * what is taken from an error g is split between this step and the next,
 *
 *     g'' = (1 - f/2) g' - f/2 g          z^2 - (1 - f/2) z + f/2 = 0
 *
 * whose roots are both 0.414 at f = 6 - 32^(1/2): an error is below a hundredth of itself after six steps, without
 * overshoot. */
#define JOINT_FEEDBACK 0.3431457505076198

SADMM_INLINE double joint_feedback(double error, double dt, double most)
{
    const double speed = JOINT_FEEDBACK * error / dt;
    return speed > most ? most : speed < -most ? -most : speed;
}

/* A spring and damper (or a position drive): f = -k (q* - rest) - c (x* - speed). By the implicit midpoint rule, which
 * keeps energy, where the step resolves it; what is stiffer than that is taken more and more at the end of the step,
 * so that it does not ring: `late` from 0 to 1,
 *
 *     q* = q + dt ((1 - late) (x_0 + x) / 4 + lead x),     x* = (1 - t) x_0 + t x,  t = (1 + late) / 2
 *
 * lead: `late`, but for what is stiff and has no damping to speak of, which is late / JOINT_FEEDBACK: without bound it
 * is the row of what is locked. joint_late is the share of the former, joint_lead what the latter adds.
 * with the coordinate q and its rate x_0 at the start and x at the end of the step. response: the row's J A^-1 J^T. */
SADMM_INLINE double joint_late(double stiffness, double damping, double response, double dt)
{
    const double stiff = response * dt * (damping + dt * stiffness);
    return stiff > 2 ? 1 - 2 / stiff : 0;
}

SADMM_INLINE double joint_lead(double stiffness, double damping, double late, double dt)
{
    return late > 0 ? late * (1 / JOINT_FEEDBACK - 1) * dt * stiffness / (dt * stiffness + damping) : 0;
}

/* As a row: lambda + gain x + bias = 0. */
SADMM_INLINE void joint_spring(double stiffness, double damping, double offset, double speed, double before, double dt,
                               double late, double lead, double *gain, double *bias)
{
    const double t = (1 + late) / 2;
    *gain = dt * (stiffness * dt * ((1 - late) / 4 + lead) + damping * t);
    *bias = dt * (stiffness * (offset + dt * (1 - late) / 4 * before) + damping * ((1 - t) * before - speed));
}

#endif
