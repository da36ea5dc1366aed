/* How much restitution an impact may have (docs/internals/algorithm.md, "Restitution").
 *
 * Newton's law gives every contact of a pair that hits x_n+ = -epsilon x_n-, with x- the velocity that the step would
 * end with but for contacts and forces. An impact changes the kinetic energy by
 *
 *     sum lambda . (x+ + x-) / 2,      x+ = x- + G lambda
 *
 * Without friction that is <= 0 if e >= epsilon x_n- at every contact, those that part (x_n- > 0) included: it is at
 * most sum lambda_n (epsilon x_n- - e) / (1 + epsilon), from lambda . G lambda >= 0. Friction can make it positive for
 * any epsilon > 0 (Kane's paradox): where it stops or turns the sliding it pushes along x_t-, and through the coupling
 * of G against the normal as well. So epsilon is lowered to the largest that leaves the energy where it is, for the
 * pair by itself and held at the middle of its contacts that hit.
 *
 * Forces act in the step as well, half of their push before and half after: in the sum, x- has the half, and x+ lacks
 * it. */
#ifndef SADMM_MATH_IMPACT_H
#define SADMM_MATH_IMPACT_H

#include "contact.h"

/* One contact at a time is solved by sweeps over normal and tangent, each with its own response; a share of the impulse
 * that is left, and the most sweeps. Halvings of epsilon's interval: the lower end counts. */
#define IMPACT_ROUNDING 1e-9
/* A gain that is rounding, as a share of what the impulses and velocities could make: what comes straight on with
 * epsilon 1 keeps its energy exactly. */
#define IMPACT_NOTHING 1e-12
enum { IMPACT_SWEEPS = 100, IMPACT_HALVINGS = 12 };

/* Twice the energy that a contact alone leaves with for e = -bounce, over that it has: lambda . (x+ + x-), less what
 * may be rounding. G: its response, rows in the frame (n, t1, t2), as x and lambda; lambda: start in, solution out. */
SADMM_INLINE real impact_gain(const mat3 *G, vec3 x, real mu, real bounce, real lambda[3])
{
    const real half = (G->r[1].y - G->r[2].z) / 2,
               tangent = (G->r[1].y + G->r[2].z) / 2 + real_sqrt(half * half + G->r[1].z * G->r[1].z);
    vec3 after = x;
    int k;
    for (k = 0; k < IMPACT_SWEEPS; ++k) {
        const real old[3] = {lambda[0], lambda[1], lambda[2]};
        real size, change;
        after = v3_add(x, m3_mul(*G, v3(lambda[0], lambda[1], lambda[2])));
        lambda[0] = real_max(lambda[0] - (after.x - bounce) / G->r[0].x, 0);
        after = v3_add(x, m3_mul(*G, v3(lambda[0], lambda[1], lambda[2])));
        {
            const real y[3] = {lambda[0], lambda[1] - after.y / tangent, lambda[2] - after.z / tangent};
            contact_project_rows(y, mu, lambda);
        }
        size = real_abs(lambda[0]) + real_abs(lambda[1]) + real_abs(lambda[2]);
        change = real_abs(lambda[0] - old[0]) + real_abs(lambda[1] - old[1]) + real_abs(lambda[2] - old[2]);
        if (change <= (real)IMPACT_ROUNDING * size) break;
    }
    after = v3_add(x, m3_mul(*G, v3(lambda[0], lambda[1], lambda[2])));
    return lambda[0] * (after.x + x.x) + lambda[1] * (after.y + x.y) + lambda[2] * (after.z + x.z) -
           (real)IMPACT_NOTHING * (real_abs(lambda[0]) + real_abs(lambda[1]) + real_abs(lambda[2])) *
               (real_abs(x.x) + real_abs(x.y) + real_abs(x.z));
}

/* epsilon of a contact that approaches with x (x.x < 0), at most `restitution`; push: half of what forces add to x. */
SADMM_INLINE real impact_restitution(const mat3 *G, vec3 x, vec3 push, real mu, real restitution)
{
    const vec3 before = v3_add(x, push);
    real lambda[3] = {0, 0, 0}, low = 0, high = restitution;
    int k;
    if (impact_gain(G, before, mu, -high * x.x - push.x, lambda) <= 0) return restitution;
    for (k = 0; k < IMPACT_HALVINGS; ++k) {
        const real middle = (low + high) / 2;
        if (impact_gain(G, before, mu, -middle * x.x - push.x, lambda) <= 0) low = middle;
        else high = middle;
    }
    return low;
}

#endif
