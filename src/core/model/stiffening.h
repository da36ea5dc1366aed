/* Geometric stiffness of jointed bodies (docs/internals/algorithm.md, "Geometric stiffness"): a force F that a joint
 * gives a body at the arm r makes the torque r x F, which changes as the body turns: by -K d for a turn d, with the
 * symmetric
 *
 *     K = (F . r) (1 - r r^T / |r|^2)
 *
 * for what of F is along r. A step takes forces in the directions that they have halfway by the velocities at its
 * start. Where K dt^2 / 4 is not small beside the inertia, it is added to the inertia that the change of velocity is
 * found with: that is to take the torque halfway by the mean of the velocities at both ends, the implicit midpoint
 * rule, which is stable for any K that is known. In double. */
#ifndef SADMM_CORE_MODEL_STIFFENING_H
#define SADMM_CORE_MODEL_STIFFENING_H

#include <math.h>
#include <stdbool.h>

#include "core/math/joint.h"
#include "core/math/max.h"
#include "core/math/principal.h"
#include "core/math/rigid.h"
#include "rolling.h"

/* Shares of the inertia, of K dt^2 / 4: below the first one nothing is added, from the second one on all of it. The
 * explicit rule is stable up to 1; where it resolves the motion it is the one that is nearer to it.
 *
 * K is of a force that the step itself may find to be another one: a chain that swings pulls harder from step to step.
 * With a share s added, a step is stable for K dt^2 / 4 <= 1 + s where bodies move by the mean of their velocities, and
 * for half of that where they move by those of its end (joint_trapezoid.h). So s = K dt^2 / 4 is hardly stable where it
 * is large: at 100 the force may be larger by 1 %. Twice as much bears twice the force, and what there is where the
 * trapezoid correction is off. A kick swings further by that, but by no more than it moves the body freely in half a
 * step. */
#define STIFFENING_LEAST 0.25 /* measured: bench/constants.py, mechanisms motion */
#define STIFFENING_ALL   0.75 /* measured: bench/constants.py, mechanisms motion */
#define STIFFENING_ROOM  2

/* Once forces are known better, a body is stiffened again if that changes its inertia by more than this share. */
#define STIFFENING_CHANGE 0.05 /* measured: bench/constants.py, mechanisms motion */

/* A joint's force on a body with that of one more of its rows, of this coordinate. */
SADMM_INLINE vec3 stiffening_add_row(vec3 force, int coordinate, const double along[3], double lambda, double dt)
{
    return coordinate < 3 ? v3_madd(force, lambda / dt, v3_load(along)) : force;
}

/* K along a body's principal axes: xx, yy, zz, xy, xz, yz. force: along them, too; place: the arm. */
SADMM_INLINE void stiffening_add(double K[6], vec3 place, vec3 force)
{
    const double size = v3_norm2(place), along = size > 0 ? v3_dot(place, force) / size : 0;
    K[0] += along * (size - place.x * place.x);
    K[1] += along * (size - place.y * place.y);
    K[2] += along * (size - place.z * place.z);
    K[3] -= along * place.x * place.y;
    K[4] -= along * place.x * place.z;
    K[5] -= along * place.y * place.z;
}

/* The most that a force of this size may add to the diagonal of K; */
SADMM_INLINE void stiffening_add_most(double most[3], vec3 place, double force)
{
    const double size = v3_norm2(place), along = size > 0 ? force / sqrt(size) : 0;
    most[0] += along * (size - place.x * place.x);
    most[1] += along * (size - place.y * place.y);
    most[2] += along * (size - place.z * place.z);
}

/* by the sum of these, may the body be stiffened? No direction of K has more than its trace. */
SADMM_INLINE bool stiffening_may_be(const double inertia[3], double dt, const double most[3])
{
    return dt * dt / 4 * (most[0] / inertia[0] + most[1] / inertia[1] + most[2] / inertia[2]) > STIFFENING_LEAST;
}

SADMM_INLINE double stiffening_share(double size)
{
    const double t = (size - STIFFENING_LEAST) / (STIFFENING_ALL - STIFFENING_LEAST);
    const double all = max_of(size, STIFFENING_ROOM * size - 1); /* the explicit part bears 1 */
    return t <= 0 ? 0 : t >= 1 ? all : all * t * t * (3 - 2 * t);
}

/* Axes in which the symmetric `share` is its diagonal: those it has, or others. */
SADMM_RARE mat3 stiffening_axes(double share[3][3])
{
    double turn[4];
    principal_axes(share, turn);
    return q_matrix(q_load(turn));
}

/* What is added to the inertia, along world axes, for K of a body, R. A direction in which K pulls the body away from
 * where it is adds nothing: its motion grows as it should. Is there any? */
SADMM_INLINE bool stiffening_of(const double inertia[3], mat3 R, double dt, const double K[6], double more[6])
{
    const double root[3] = {sqrt(inertia[0]), sqrt(inertia[1]), sqrt(inertia[2])}, s = dt * dt / 4;
    const double xy = s * K[3] / (root[0] * root[1]), xz = s * K[4] / (root[0] * root[2]),
                 yz = s * K[5] / (root[1] * root[2]);
    double share[3][3] = {
        {s * K[0] / inertia[0], xy, xz}, {xy, s * K[1] / inertia[1], yz}, {xz, yz, s * K[2] / inertia[2]}};
    const bool turned = xy != 0 || xz != 0 || yz != 0;
    mat3 axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const double norm2 = share[0][0] * share[0][0] + share[1][1] * share[1][1] + share[2][2] * share[2][2] +
                         2 * (xy * xy + xz * xz + yz * yz);
    bool any = false;
    int k;
    for (k = 0; k < 6; ++k) more[k] = 0;
    /* no eigenvalue is above the norm; a little less, for their rounding */
    if (norm2 < (1 - 1e-9) * STIFFENING_LEAST * STIFFENING_LEAST) return false;
    if (turned) axes = stiffening_axes(share);
    for (k = 0; k < 3; ++k) {
        const double own = stiffening_share(share[k][k]);
        const vec3 axis = m3_column(axes, k);
        if (own == 0) continue;
        const vec3 u = m3_mul(R, v3(root[0] * axis.x, root[1] * axis.y, root[2] * axis.z));
        more[0] += own * u.x * u.x, more[1] += own * u.y * u.y, more[2] += own * u.z * u.z;
        more[3] += own * u.x * u.y, more[4] += own * u.x * u.z, more[5] += own * u.y * u.z;
        any = true;
    }
    return any;
}

/* The body halfway, as near as the directions of forces need it. */
SADMM_INLINE mat3 stiffening_frame(const struct sadmm_rigid *body, double dt)
{
    return q_matrix(rigid_turn(q_load(body->orientation), v3_load(body->velocity + 3), dt / 2));
}

/* Is `now`, added to the inertia, another one than `before`? */
SADMM_INLINE bool stiffening_differs(const double inertia[3], const double before[6], const double now[6])
{
    double change = 0, size = 0;
    int k;
    for (k = 0; k < 3; ++k) {
        change += fabs(now[k] - before[k]);
        size += inertia[k] + before[k];
    }
    return change > STIFFENING_CHANGE * size;
}

/* `more`, what is added to the inertia of a body, by K; is it another one than before? stiffened: there was some. */
SADMM_INLINE bool stiffening_renew(const double inertia[3], mat3 R, double dt, const double K[6], bool stiffened,
                                   double more[6])
{
    double now[6];
    int k;
    const bool any = stiffening_of(inertia, R, dt, K, now);
    if (!(any || stiffened) || !stiffening_differs(inertia, more, now)) return false;
    for (k = 0; k < 6; ++k) more[k] = now[k];
    return true;
}

/* More of it in the inertia of a body than `own` stiffness, which is of account if it rocks (rolling.h): the step takes
 * half of dt^2 times what there is. */
SADMM_INLINE void stiffening_set(struct sadmm_rigid *body, const double own[6], double dt, const double more[6])
{
    int k;
    for (k = 0; k < 6; ++k) body->stiffness[k] = (rolling_is_stiff(body) ? own[k] : 0) + 2 / (dt * dt) * more[k];
    body->rolls |= ROLLING_IS_STIFFENED;
}

#endif
