/* How much kinetic energy constraints may make, so that a solution that throws bodies about is known (ncp.h,
 * articulation.h): a rate that a row asks for is given to all of the island's bodies, as one; or the impulse that it is
 * bounded by to its own, as if they were free, if that is less: of a drive that is a force, say. Doubled: v^T A v. */
#ifndef SADMM_CORE_SOLVE_ASKED_ENERGY_H
#define SADMM_CORE_SOLVE_ASKED_ENERGY_H

#include <math.h>

#include "core/model/rows.h"

/* Of the bodies: mass, first and second moments about the origin, inertia. */
struct asked_energy {
    double mass, moment[3], square, inertia;
};

static inline struct asked_energy asked_energy_begin(void)
{
    const struct asked_energy none = {0, {0, 0, 0}, 0, 0};
    return none;
}

static inline void asked_energy_add_body(struct asked_energy *whole, const double A[36], const double position[3])
{
    const double mass = A[0];
    whole->mass += mass;
    for (int k = 0; k < 3; ++k)
        whole->moment[k] += mass * position[k], whole->square += mass * position[k] * position[k];
    whole->inertia += fmax(A[21], fmax(A[28], A[35]));
}

/* At so many m/s; at so many rad/s about the centre. */
static inline double asked_energy_linear(const struct asked_energy *whole, double speed)
{
    return whole->mass * speed * speed;
}
static inline double asked_energy_angular(const struct asked_energy *whole, double speed)
{
    double moment2 = 0;
    for (int k = 0; k < 3; ++k) moment2 += whole->moment[k] * whole->moment[k];
    return (whole->inertia + fmax(0, whole->square - moment2 / whole->mass)) * speed * speed;
}

/* The most impulse that a row gives to what is at rest; a limit that is not met gives none. */
static inline double asked_impulse_of_row(double bias, double compliance, double lo, double hi)
{
    const double most = bias < 0 ? fmax(hi, 0) : bias > 0 ? fmax(-lo, 0) : 0;
    return compliance > 0 ? fmin(most, fabs(bias) / compliance) : most;
}

/* A row that asks for a rate: of translations where it has any, else of turns. */
static inline double asked_energy_of_rate(const struct asked_energy *whole, const double a[6], const double b[6],
                                          double rate)
{
    double linear = 0, angular = 0;
    for (int k = 0; k < 3; ++k) {
        linear += fmax(a[k] * a[k], b[k] * b[k]);
        angular += fmax(a[3 + k] * a[3 + k], b[3 + k] * b[3 + k]);
    }
    if (linear > 0) return asked_energy_linear(whole, rate / sqrt(linear));
    return angular > 0 ? asked_energy_angular(whole, rate / sqrt(angular)) : 0;
}

/* Row `at`, to whose multiplier its bodies respond by `response` when they are free. */
static inline double asked_energy_of_row(const struct asked_energy *whole, const struct sadmm_rows *rows, size_t at,
                                         double response)
{
    const double bias = rows->bias[at], gain = rows->gain[at],
                 impulse = asked_impulse_of_row(bias, rows->compliance[at], rows->lo[at], rows->hi[at]);
    if (!(impulse > 0)) return 0;
    const double given = impulse * impulse * response;
    if (!(gain > 0)) return given;
    return fmin(given, asked_energy_of_rate(whole, rows->jacobian_a + 6 * at, rows->jacobian_b + 6 * at, bias / gain));
}

#endif
