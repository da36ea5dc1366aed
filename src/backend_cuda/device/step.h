/* Whole steps on the device (core/solve/resident.h): what the world is there, and how the host follows.
 *
 *     edit        states, wrenches and settings' numbers set since the last step (when there are any)
 *     start       where a solve starts from; bodies as collision sees them
 *     find        contacts, from one set into the other (collide/view.h); beside it A, b of the bodies
 *     admit       do they fit? Then they are this step's (cuda_live)
 *     statistics  of the constraint graph; islands (graph/layout.cu)
 *     layout      slots, sides, parts; beside it contacts in the solver's form
 *     penalties   C, beta, factors (fast: weights, C, factors); and: is this what the step was planned for?
 *     iterate     (15), new weights where asked for (the kernel table's own kernels); fast: convergence checks
 *     limit       fast: islands that have more energy than they may
 *     finish      impulses into the contacts, moved bodies, wrenches; beside it (16), (17)
 *     commit      the report; the step counts only if nothing was aborted
 *
 * fast, small islands (c->prologue): `iterate` does penalties and limit too, and the last two check the plan.
 *
 * The host plans a step from the statistics of an earlier one: capacities, tier and partition, rows a contact, warm or
 * cold. All of it goes into a graph that is launched again and again, two of them in turn, because states and contact
 * sets change places at every step. Where a plan does not hold, the step sets cuda_live.abort_code (with c->prologue
 * only its last kernel does: what runs until then keeps to what was planned for), what was enqueued behind it does
 * nothing, and the host, when it sees the report, reads the statistics, plans again and enqueues the same steps again:
 * a repeated step starts from the same state, settings included, and gives the same bits. The settings' numbers are
 * data in device memory, so that a change of them is an edit like others: nothing is recorded again or waited for.
 * Reports and edits travel through pinned memory, a ring of STEPS_AHEAD, written and read by the device itself.
 */
#ifndef SADMM_CUDA_DEVICE_STEP_H
#define SADMM_CUDA_DEVICE_STEP_H

#include "core/solve/resident.h"
#include "found.h"
#include "layout.h"

enum { STEPS_AHEAD = 4 };

enum step_stamp { STAMP_START, STAMP_FOUND, STAMP_ASSEMBLED, STAMP_SOLVED, STAMP_END, STAMPS };

/* Written by commit, read by the host. */
struct cuda_step_report {
    int64_t sequence; /* steps enqueued before this one, failed ones included */
    int32_t abort_code;     /* enum cuda_abort */
    int32_t offending_body;  /* a body that is not finite; INT32_MAX: none */
    struct sadmm_cuda_contact_counts counts;
    struct cuda_graph_statistics statistics;
    double depth, primal, dual;
    int32_t limited; /* islands */
    int32_t unmet;   /* islands that the stop rule still waited for; -1: there is none */
    int32_t most_iterations;   /* of islands that stopped */
    int64_t sum_of_iterations; /* of all of them */
    unsigned long long stamps[STAMPS]; /* ns */
};

/* In device memory, of the step that runs. */
struct cuda_step_control {
    int64_t sequence;
    unsigned long long depth; /* bit pattern of a double >= 0 */
    unsigned long long stamps[STAMPS];
    int32_t offending_body;
};

/* What the step was planned for. */
struct cuda_step_guess {
    int32_t contact_rows; /* 0: no contacts */
    int32_t point_slots;
    int32_t warm;         /* most pairs carry an impulse; -1: does not matter */
};

struct cuda_step_view {
    const struct sadmm_rigid *before;
    struct sadmm_rigid *after;
    const struct sadmm_steady *steady_before;
    struct sadmm_steady *steady_after;
    double *wrench;                       /* of the contacts; bodies x 6 */
    double *start_impulse;                /* points x 3 */
    double *start_velocity;               /* bodies x 6 */
    struct sadmm_contact_point *points;   /* the new set's, impulses to be written */
    const int32_t *slot_of_body;          /* dynamic body -> world slot */
    struct sadmm_collision_body *bodies;  /* by world slot */
    const struct sadmm_cuda_contact_counts *counts;
    int64_t candidate_capacity, point_capacity;
    struct cuda_step_guess guess;
    struct cuda_step_control *control;
    struct cuda_step_report *reports;     /* pinned: STEPS_AHEAD */
    int32_t measured;                     /* residuals of the last iteration are in view.iteration.residual */
    int32_t limits;                       /* energies are limited: view.islands.limited */
};

#endif
