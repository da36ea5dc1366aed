/* How far from the solution the steps of a scene are when they do few iterations and start from the step before. */
#ifndef BENCH_WARM_CONVERGENCE_H
#define BENCH_WARM_CONVERGENCE_H

#include "convergence_rows.h"

struct warm_plan {
    const char *scene;  /* spec */
    double seconds;     /* simulated */
    double dt;          /* s, 0: the scene's */
    int iterations;     /* a step */
    double max_seconds; /* of wall time; a run that takes longer is broken off, and its row says so */
};

/* Adds a ROW_WARM. Every step is certified. Landing is the first step with a contact, or the last step before which
 * scripted input (a kick) changed the energy.
 *   ncp_median, ncp_last  natural map over the last quarter of the run, m/s
 *   ncp_balanced          the same of the step's impulses with the velocities that balance momentum
 *                         (cold_convergence.h)
 *   momentum_max          relative momentum error, median over the same quarter
 *   settle_s              from landing until the natural map stays below 1e-5 m/s; NAN: it does not
 *   energy_excess         the most that kinetic + potential energy exceed those at the start plus what scripted input
 *                         brought in, as a height of all bodies together: energy / (total mass x g), m
 *   limited               share of all steps in which the method slowed an island down
 * A run that ends in what is not finite is a row with a status that says so, not an error. */
sadmm_status warm_convergence(const struct warm_plan *plan, sadmm_method method, const struct series *series,
                              int device, struct rows *rows, struct sadmm_error *error);

#endif
