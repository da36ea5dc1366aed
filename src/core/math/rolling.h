/* Formulas of contacts that roll (core/model/rolling.h): what they owe, and how stiff they are. In double. */
#ifndef SADMM_MATH_ROLLING_H
#define SADMM_MATH_ROLLING_H

#include "array3.h"

/* Adds to `owed` of b (sign 1) or a (-1): (J - J_1)^T lambda. normal, arm: of the end; halfway: those of J. */
SADMM_INLINE void rolling_owe(const double normal[3], const double arm[3], const double normal_halfway[3],
                              const double arm_halfway[3], const double impulse[3], double sign, double owed[6])
{
    double turn[3] = {0, 0, 0}, back[3] = {0, 0, 0}, torque[3] = {0, 0, 0}, whole[3];
    int k;
    add_cross(normal, normal_halfway, 1, turn); /* from one normal to the other: the impulse turns along */
    add_cross(turn, impulse, 1, back);
    for (k = 0; k < 3; ++k) whole[k] = impulse[k] + back[k];
    add_cross(arm_halfway, whole, 1, torque);
    add_cross(arm, impulse, -1, torque);
    for (k = 0; k < 3; ++k) {
        owed[k] += sign * back[k];
        owed[k + 3] += sign * torque[k];
    }
}

/* How far the body's centre of mass is from its surface, along the normal, m: points lie halfway in an overlap. */
SADMM_INLINE double rolling_height(const double normal[3], const double arm[3], double separation)
{
    return fabs(dot3(normal, arm)) + (separation < 0 ? -separation / 2 : 0);
}

/* Adds to `stiffness` of a body at this height. push: normal impulse, N s. */
SADMM_INLINE void rolling_stiffen(const double normal[3], double height, double radius, double push, double dt,
                                  double stiffness[6])
{
    const double k = radius > height ? push * (radius - height) / dt : 0;
    if (!(k > 0)) return;
    stiffness[0] += k * (1 - normal[0] * normal[0]);
    stiffness[1] += k * (1 - normal[1] * normal[1]);
    stiffness[2] += k * (1 - normal[2] * normal[2]);
    stiffness[3] -= k * normal[0] * normal[1];
    stiffness[4] -= k * normal[0] * normal[2];
    stiffness[5] -= k * normal[1] * normal[2];
}

/* A body has moved by so much, m: what it is owed acts where it was. */
SADMM_INLINE void rolling_moved(const double from[3], const double to[3], double owed[6])
{
    double way[3];
    int k;
    for (k = 0; k < 3; ++k) way[k] = to[k] - from[k];
    add_cross(way, owed, -1, owed + 3);
}

#endif
