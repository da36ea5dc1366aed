/* Inertia of bodies made of parts, and principal axes of a symmetric 3 x 3 matrix. */
#ifndef SADMM_MATH_PRINCIPAL_H
#define SADMM_MATH_PRINCIPAL_H

#include "quat.h"

/* Add to `total` a part's inertia: principal moments `own` along its axes, turned by `orientation`, and `mass` at `arm`
 * from the point that moments are about. */
SADMM_INLINE void principal_add(double total[3][3], const double own[3], const double orientation[4], double mass,
                                vec3 arm)
{
    const mat3 r = q_matrix(q_load(orientation));
    double d[3], rows[3][3];
    v3_store(arm, d);
    for (int i = 0; i < 3; ++i) v3_store(r.r[i], rows[i]);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) total[i][j] += rows[i][k] * own[k] * rows[j][k];
            total[i][j] += mass * ((i == j ? v3_norm2(arm) : 0) - d[i] * d[j]);
        }
    }
}

/* Jacobi: leaves the eigenvalues of the symmetric `a` on its diagonal; `axes`: from their frame, unit quaternion. */
SADMM_INLINE void principal_axes(double a[3][3], double axes[4])
{
    const double unit[4] = {1, 0, 0, 0};
    quat turn = q_load(unit);
    for (int sweep = 0; sweep < 50; ++sweep) {
        for (int p = 0; p < 3; ++p) {
            const int i = (p + 1) % 3, j = (p + 2) % 3;
            if (fabs(a[i][j]) <= 1e-15 * (fabs(a[i][i]) + fabs(a[j][j]))) continue;
            /* about axis p, with c^2 - s^2 and 2 c s from the two diagonal entries */
            const double angle = 0.5 * atan2(2 * a[i][j], a[i][i] - a[j][j]), c = cos(angle), s = sin(angle);
            double half[4] = {cos(angle / 2), 0, 0, 0};
            half[1 + p] = sin(angle / 2);
            for (int k = 0; k < 3; ++k) {
                const double x = a[k][i], y = a[k][j];
                a[k][i] = c * x + s * y, a[k][j] = c * y - s * x;
            }
            for (int k = 0; k < 3; ++k) {
                const double x = a[i][k], y = a[j][k];
                a[i][k] = c * x + s * y, a[j][k] = c * y - s * x;
            }
            turn = q_normalize(q_mul(turn, q_load(half)));
        }
    }
    q_store(turn, axes);
}

#endif
