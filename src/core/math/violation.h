/* What a contact misses: w |lambda - Pi_C(lambda - u/w)|^2, J, with u = x + e n and w the contact's response. In the
 * world frame, in double. The weight scale rests on it (weight.h). */
#ifndef SADMM_MATH_VIOLATION_H
#define SADMM_MATH_VIOLATION_H

#include "real.h"

SADMM_INLINE double contact_violation(const double lambda[3], const double u[3], const double n[3], double friction,
                                      double w)
{
    double y[3], normal = 0, tangential2 = 0, sum = 0;
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        y[k] = lambda[k] - u[k] / w;
        normal += y[k] * n[k];
    }
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        double t = y[k] - normal * n[k];
        tangential2 += t * t;
    }
    double pushed = fmax(normal, 0.0), limit = friction * pushed;
    double shrink = tangential2 > limit * limit ? limit / sqrt(tangential2) : 1;
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        double miss = lambda[k] - pushed * n[k] - shrink * (y[k] - normal * n[k]);
        sum += miss * miss;
    }
    return w * sum;
}

/* x += sign w x r */
SADMM_INLINE void add_cross(const double w[3], const double r[3], double sign, double x[3])
{
    x[0] += sign * (w[1] * r[2] - w[2] * r[1]);
    x[1] += sign * (w[2] * r[0] - w[0] * r[2]);
    x[2] += sign * (w[0] * r[1] - w[1] * r[0]);
}

#endif
