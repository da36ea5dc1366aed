/* Geometric stiffness of jointed bodies (docs/algorithm.md, section 10): a force F that a joint gives a body at the arm r
 * makes the torque r x F, which changes as the body turns: by -K d for a turn d, with the symmetric
 *
 *     K = (F . r) 1 - (F r^T + r F^T) / 2
 *
 * (what is left of the change is made of the whole torque, which is what turns the body already). A step takes forces in
 * the directions that they have halfway by the velocities at its start. Where K dt^2 / 4 is not small beside the inertia,
 * it is added to the inertia that the change of velocity is found with: that is to take the torque halfway by the mean
 * of the velocities at both ends, the implicit midpoint rule, which is stable for any K. In double. */
#ifndef SADMM_CORE_MODEL_STIFFENING_H
#define SADMM_CORE_MODEL_STIFFENING_H

#include <math.h>
#include <stdbool.h>

#include "core/math/joint.h"
#include "core/math/principal.h"
#include "core/math/rigid.h"

#ifndef SADMM_REAL_IS_DOUBLE
#error "stiffening.h is double only: do not include it in a source compiled per precision"
#endif

/* Shares of the inertia, of K dt^2 / 4: below the first one nothing is added, from the second one on all of it. The
 * explicit rule is stable up to 1; where it resolves the motion it is the one that is nearer to it. */
#define STIFFENING_LEAST 0.05
#define STIFFENING_ALL   0.25

/* K: xx, yy, zz, xy, xz, yz. */
SADMM_INLINE void stiffening_add(double K[6], vec3 arm, vec3 force)
{
    const double size = v3_norm2(arm), along = size > 0 ? v3_dot(arm, force) / size : 0;
    K[0] += along * (size - arm.x * arm.x);
    K[1] += along * (size - arm.y * arm.y);
    K[2] += along * (size - arm.z * arm.z);
    K[3] -= along * arm.x * arm.y;
    K[4] -= along * arm.x * arm.z;
    K[5] -= along * arm.y * arm.z;
}

SADMM_INLINE double stiffening_share(double size)
{
    const double t = (size - STIFFENING_LEAST) / (STIFFENING_ALL - STIFFENING_LEAST);
    return t <= 0 ? 0 : t >= 1 ? size : size * t * t * (3 - 2 * t);
}

SADMM_INLINE bool stiffening_is_any(const double K[6]) { return K[0] != 0 || K[1] != 0 || K[2] != 0; }

/* In units of the inertia along the body's principal axes, R: K dt^2 / 4; the sum of its entries' squares. */
SADMM_INLINE double stiffening_scale(const double root[3], mat3 R, double dt, const double K[6], double share[3][3])
{
    const sym3 world = {K[0], K[1], K[2], K[3], K[4], K[5]};
    double size = 0;
    int i, j;
    for (i = 0; i < 3; ++i) {
        const vec3 row = s3_mul(world, m3_column(R, i));
        for (j = 0; j < 3; ++j) {
            share[i][j] = dt * dt / 4 * v3_dot(row, m3_column(R, j)) / (root[i] * root[j]);
            size += share[i][j] * share[i][j];
        }
    }
    return size;
}

/* Of shares that are not all small, what is added to the inertia; K is 0. Is there any? */
SADMM_RARE bool stiffening_take(const double root[3], mat3 R, double share[3][3], double K[6])
{
    double turn[4];
    mat3 axes;
    bool any = false;
    int k;
    principal_axes(share, turn);
    axes = q_matrix(q_load(turn));
    for (k = 0; k < 3; ++k) {
        const double own = stiffening_share(share[k][k]);
        const vec3 axis = m3_column(axes, k), u = m3_mul(R, v3(root[0] * axis.x, root[1] * axis.y, root[2] * axis.z));
        any = any || own > 0;
        K[0] += own * u.x * u.x, K[1] += own * u.y * u.y, K[2] += own * u.z * u.z;
        K[3] += own * u.x * u.y, K[4] += own * u.x * u.z, K[5] += own * u.y * u.z;
    }
    return any;
}

/* The sum K of a body's joints becomes what is added to its inertia, along world axes. A direction in which K pulls the
 * body away from where it is adds none: its motion grows as it should. Is there any? */
SADMM_INLINE bool stiffening_of(const double inertia[3], quat orientation, double dt, double K[6])
{
    const mat3 R = q_matrix(orientation);
    const double root[3] = {sqrt(inertia[0]), sqrt(inertia[1]), sqrt(inertia[2])};
    double share[3][3];
    const double size = stiffening_scale(root, R, dt, K, share);
    int k;
    for (k = 0; k < 6; ++k) K[k] = 0;
    return size > STIFFENING_LEAST * STIFFENING_LEAST && stiffening_take(root, R, share, K);
}

#endif
