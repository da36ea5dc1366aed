/* Contact formulas: constraint error, and the law of a contact: the strict projection on the friction cone. */
#ifndef SADMM_MATH_CONTACT_H
#define SADMM_MATH_CONTACT_H

#include "vec3.h"

/* e of a contact from its separation (m), in m/s. Apart: the bodies may close the separation in one step and no more.
 * Overlapping beyond the slop: each step removes a share of it (Baumgarte), with a capped speed. */
SADMM_INLINE double contact_error(double separation, double dt, double correction_factor, double slop,
                                  double correction_speed)
{
    const double depth = -separation - slop;
    const double speed = (separation >= 0 ? separation : correction_factor * depth) / dt; /* one division: which one is
                                                                                             not known before */
    const double pushed = depth > 0 ? -min_of(speed, correction_speed) : 0.0;
    return separation >= 0 ? speed : pushed;
}

/* How much of gravity, which gives `pull` m/s a step, takes back the velocity that a push of this speed leaves. The
 * push shrinks by a share of itself each step, as the overlap does. Up to 1 gravity slows bodies down by as much: they
 * follow it, and have no velocity when nothing overlaps any more; what friction alone slows down ends within d / (2
 * mu), d the overlap. */
SADMM_INLINE double contact_push_takes(double speed, double correction_factor, double pull)
{
    return pull > 0 ? correction_factor * speed / pull : INFINITY;
}

/* Does a contact that approaches (negative) touch within the step, faster than the threshold of restitution? */
SADMM_INLINE int contact_hits(double separation, double approach, double dt, double threshold)
{
    return approach < -threshold && separation + approach * dt <= 0;
}

/* ---- the law ------------------------------------------------------------------------------------------------------
 *
 * Strict projection of the paper's Step 3 [its ref. 19]: the normal part is clamped at 0, then the tangential part is
 * scaled into the disc of radius mu lambda_n. With one scalar weight a contact this is the exact solution of the local
 * Signorini-Coulomb problem (5), not the Euclidean projection on the cone (which siconos' error is made of:
 * core/solve/certificate.c). From the normal part of lambda and the square of its tangential part t,
 *
 *     Pi_C(lambda) = push n + shrink t
 *
 * and Pi_C(lambda) = lambda unless the contact `moves`.
 *
 * CONTACT_LAW defines this for any type of `number`: scalars below, SIMD lanes in backend_cpu/cpu_lanes.h. `condition`
 * is the type of a comparison; `constant`, `pick` and `root` make a constant, choose by a condition, and take a root.
 *
 * The iteration on GPUs has a form of its own with the same meaning (cone_parts_of in backend_cuda/iterate/sweep.h),
 * for speed: fused products, and one inverse root in place of a root and a division. */
#define CONTACT_LAW(law, number, condition, constant, pick, root)                               \
    struct law {                                                                                \
        number push, shrink;                                                                    \
        condition moves;                                                                        \
    };                                                                                          \
    SADMM_ALWAYS_INLINE struct law law##_of(number normal, number tangential2, number mu)       \
    {                                                                                           \
        const number push = pick(normal > constant(0), normal, constant(0)), limit = mu * push; \
        const condition slides = tangential2 > limit * limit;                                   \
        const struct law out = {push, pick(slides, limit / root(tangential2), constant(1)),     \
                                slides | (normal <= constant(0))};                              \
        return out;                                                                             \
    }

#define CONTACT_PICK(condition, yes, no) ((condition) ? (yes) : (no))
CONTACT_LAW(contact_law, real, int, (real), CONTACT_PICK, real_sqrt)
CONTACT_LAW(contact_law_double, double, int, (double), CONTACT_PICK, sqrt)

/* Frame-free: lambda in any frame with n in it. */
SADMM_INLINE vec3 contact_project(vec3 lambda, vec3 n, real mu)
{
    const real normal = v3_dot(n, lambda);
    const vec3 t = v3_madd(lambda, -normal, n);
    const struct contact_law law = contact_law_of(normal, v3_norm2(t), mu);
    return v3_madd(v3_scale(n, law.push), law.shrink, t);
}

/* The same in the contact's frame (n, t1, t2). Does it move? */
SADMM_INLINE int contact_project_rows(const real in[3], real mu, real out[3])
{
    const struct contact_law law = contact_law_of(in[0], in[1] * in[1] + in[2] * in[2], mu);
    out[0] = law.push;
    out[1] = law.shrink * in[1];
    out[2] = law.shrink * in[2];
    return law.moves;
}

/* The residual of a contact, in its frame: lambda - Pi_C(lambda - u/w), with u = x + e n and w its response. Its size
 * times w is the natural map, m/s. */
SADMM_INLINE void contact_residual_rows(const real lambda[3], const real u[3], real mu, real w, real residual[3])
{
    real y[3], projected[3];
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) y[k] = lambda[k] - u[k] / w;
    contact_project_rows(y, mu, projected);
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) residual[k] = lambda[k] - projected[k];
}

/* The same as an energy, w |lambda - Pi_C(lambda - u/w)|^2, J. In the world frame, and in double in every precision:
 * the weight scale rests on it (weight.h). */
SADMM_INLINE double contact_violation(const double lambda[3], const double u[3], const double n[3], double mu, double w)
{
    struct contact_law_double law;
    double y[3], tangential[3], normal = 0, tangential2 = 0, sum = 0;
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        y[k] = lambda[k] - u[k] / w;
        normal += y[k] * n[k];
    }
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        tangential[k] = y[k] - normal * n[k];
        tangential2 += tangential[k] * tangential[k];
    }
    law = contact_law_double_of(normal, tangential2, mu);
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        const double residual = lambda[k] - law.push * n[k] - law.shrink * tangential[k];
        sum += residual * residual;
    }
    return w * sum;
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
    const int moves = contact_project_rows(y, mu, projected);
    int k;
    for (k = 0; k < 3; ++k) change[k] = moves ? projected[k] - lambda[k] : -step[k];
}

#endif
