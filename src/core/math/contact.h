/* Contact formulas: constraint error, and the strict projection on the friction cone. */
#ifndef SADMM_MATH_CONTACT_H
#define SADMM_MATH_CONTACT_H

#include "vec3.h"

/* e of a contact from its gap (m), in m/s. Apart: the bodies may close the gap in one step and no more. Overlapping
 * beyond the slop: Baumgarte's share of it is pushed out each step, with a capped speed. Restitution: an approach
 * faster than the threshold that would touch within the step leaves with `restitution` times its speed.
 * `approach` is the normal velocity at the start of the step (negative: closing). */
SADMM_INLINE double contact_error(double gap, double approach, double restitution, double dt, double baumgarte,
                                  double slop, double correction_speed, double restitution_threshold)
{
    double e;
    if (gap >= 0) {
        e = gap / dt;
    } else {
        double depth = -gap - slop;
        e = depth > 0 ? -fmin(baumgarte * depth / dt, correction_speed) : 0.0;
    }
    if (restitution > 0 && approach < -restitution_threshold && gap + approach * dt <= 0)
        e = fmin(e, restitution * approach);
    return e;
}

/* Strict projection of the paper's Step 3 [its ref. 19]: the normal part is clamped at 0, then the tangential part is
 * scaled into the disc of radius mu lambda_n. With one scalar weight a contact this is the exact solution of the local
 * Signorini-Coulomb problem (5), not the Euclidean projection on the cone. Frame-free: lambda in any frame with n in
 * it. */
SADMM_INLINE vec3 contact_project(vec3 lambda, vec3 n, real mu)
{
    real ln = v3_dot(n, lambda);
    vec3 t = v3_madd(lambda, -ln, n);
    real limit, t2 = v3_norm2(t), scale;
    ln = ln > 0 ? ln : (real)0;
    limit = mu * ln;
    scale = t2 > limit * limit ? limit / real_sqrt(t2) : (real)1;
    return v3_madd(v3_scale(n, ln), scale, t);
}

/* The same in the contact's frame (n, t1, t2). */
SADMM_INLINE void contact_project_rows(const real in[3], real mu, real out[3])
{
    real n = in[0] > 0 ? in[0] : (real)0, limit = mu * n;
    real t2 = in[1] * in[1] + in[2] * in[2];
    real scale = t2 > limit * limit ? limit / real_sqrt(t2) : (real)1;
    out[0] = n;
    out[1] = scale * in[1];
    out[2] = scale * in[2];
}

/* mu as the method `fast` takes it, for a precision's epsilon: less by some rounding, so that an impulse at the edge of
 * the cone is inside whoever computes it, and a contact that sticks there is not off by rounding. */
#define CONTACT_CONE_ROUNDING 4.0
SADMM_INLINE double contact_friction_inside(double mu, double epsilon)
{
    return mu * (1 - CONTACT_CONE_ROUNDING * epsilon);
}

/* lambda^ = Pi_C(lambda - step) and lambda^ - lambda, where the contact sticks without the rounding of either: the
 * method `fast` passes on changes alone. In the contact's frame. */
SADMM_INLINE void contact_change_rows(const real lambda[3], const real step[3], real mu, real change[3],
                                      real projected[3])
{
    const real y[3] = {lambda[0] - step[0], lambda[1] - step[1], lambda[2] - step[2]};
    real limit = mu * y[0];
    int k, sticks = y[0] > 0 && y[1] * y[1] + y[2] * y[2] <= limit * limit;
    contact_project_rows(y, mu, projected);
    for (k = 0; k < 3; ++k) change[k] = sticks ? -step[k] : projected[k] - lambda[k];
}

#endif
