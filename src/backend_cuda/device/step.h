/* Whole steps on the device (core/solve/resident.h): what the world is there, and how the host follows.
 *
 *     update      states, wrenches, targets and settings' numbers set since the last step (where there are any)
 *     start       where a solve starts from; bodies as collision sees them
 *     find        contacts, from one set into the other (collide/view.h); beside it A, b of the bodies, rows of joints
 *                 (where there are kinematic bodies A and b wait for the layout: step/kinematic.cu)
 *     admit       do they fit? Then they are this step's (cuda_live)
 *     statistics  of the constraint graph; islands (graph/layout.cu)
 *     layout      slots, sides, parts; beside it contacts in the solver's form (fast: behind articulations)
 *     penalties   C, beta, factors (fast: weights, C, factors); and: is this what the step was planned for?
 *     iterate     (15), new weights where asked for (the kernel table's own kernels); fast: convergence checks
 *     limit       fast: islands that have more energy than they may
 *     finish      impulses into the contacts, moved bodies, wrenches; beside it (16), (17); then what joints keep
 *     commit      bodies whose island turns out to be another than they were taken for, again (step/move.h); the
 *                 report; the step counts only if nothing was aborted
 *
 * A step of several sub-steps (sadmm_settings.substeps) goes through `find` to `finish` for each of them, all in one
 * graph, with `turn` between two: what `commit` does for the one that has ended, and `start` of the next. The step's
 * start is not written to: there is a third state, and a third set of contacts, for what lies between two sub-steps
 * (step_state). Each sub-step has a plan of its own; the first one's is known beforehand, those of others are taken to
 * be like it until the report of a step that failed says what they are.
 *
 * Articulations (step/articulation.cu) are solved beside `layout`, or behind it where parts are large, and once more
 * beside `finish`. Where they are apart (cuda_step_speculation) all about joints is a branch from `start` to `finish`,
 * and whether the step was one for that is known when it has come to its end.
 *
 * Whether an island is pushed apart without a velocity (core/solve/push.h) is known when the step has been solved: its
 * contacts say so in `finish`. A step in which one is has a graph of its own: there they say so behind the layout, e of
 * what overlaps is made without its push, and behind `finish`, if there is one, the second problem is gathered and
 * solved, in a context of its own, and bodies are moved by it (step/push.cu); else its kernels leave at once.
 *
 * Hits of bodies in flight (collide/hits_view.h) come between the candidates and the narrow phase of steps that are
 * planned to have some: the narrow phase of others says whether any pair is fast.
 *
 * fast, small islands (c->prologue): `iterate` does penalties and limit too, and the last two check the plan.
 *
 * The host plans a step from the statistics of an earlier one: capacities, tier and partition, rows a contact, whether
 * any island starts cold. All of it goes into a graph that is launched again and again, two of them in turn, because
 * states and contact sets change places at every step; where updates come often steps with them have two of their own.
 * Where a plan does not hold, the step sets cuda_live.abort_code (with c->prologue only its last kernel does: what
 * runs until then keeps to what was planned for), what was enqueued behind it does nothing, and the host, when it sees
 * the report, reads the statistics, plans again and enqueues the same steps again: a repeated step starts from the
 * same state, settings included, and gives the same bits. The settings' numbers are data in device memory, so that a
 * change of them is an update like others: nothing is recorded again or waited for.
 * Reports and updates travel through pinned memory, a ring of STEPS_AHEAD, written and read by the device itself.
 */
#ifndef SADMM_CUDA_DEVICE_STEP_H
#define SADMM_CUDA_DEVICE_STEP_H

#include "core/solve/resident.h"
#include "found.h"
#include "layout.h"

enum { STEPS_AHEAD = 4 };

enum step_stamp { STAMP_START, STAMP_FOUND, STAMP_ASSEMBLED, STAMP_SOLVED, STAMP_END, STAMPS };

/* What the sub-steps made so far were like. */
struct cuda_step_totals {
    int32_t limited, unmet;  /* most of any; unmet: -1: no stop rule */
    int32_t met;             /* sub-steps that met theirs */
    int32_t constrained;     /* sub-steps with contacts, or rows; */
    int32_t spared;          /* of which every island was solved before any iteration */
    int32_t cold;            /* sub-steps in which some island starts cold; */
    int32_t unsolved;        /* in which one is not solved before the iterations, where islands are */
    int32_t pushed;          /* sub-steps in which some island is pushed apart (step/push.h); -1: one did not fit */
    int32_t most_iterations; /* sums: of islands that stopped, the most; */
    double iterations_mean;  /* and of all */
    unsigned long long stamps[STAMPS]; /* ns since the first sub-step began, without what comes between them */
};

/* Joints and couplings that take part, constraints of their rows, those that start with a multiplier other than 0. */
struct cuda_joint_counts {
    int32_t joints, couplings, constraints, warm;
    int32_t together; /* not 0: bodies that they join have to iterate with the others: a contact touches them, an
                         articulation could not be solved, or a joint has no rows at the time */
    int32_t sides;    /* of pairs, at such bodies, that are listed */
    unsigned long long drift; /* bits of the largest error of a locked translation that is left, m */
};

/* Written by commit, read by the host. */
struct cuda_step_report {
    int64_t sequence; /* steps enqueued before this one, failed ones included */
    int32_t abort_code;     /* enum cuda_abort */
    int32_t offending_body;  /* a body that is not finite; INT32_MAX: none; INT32_MIN + k: kinematic body k */
    int32_t substep; /* the last one that found contacts: that of `counts` and `statistics` */
    struct sadmm_cuda_contact_counts counts;
    struct cuda_graph_statistics statistics;
    double depth, primal, dual;
    struct cuda_joint_counts joints; /* of the sub-step that contacts were found for last */
    int32_t apart;      /* as in cuda_step_speculation */
    struct cuda_step_totals totals;
    int64_t ready;      /* sequence + 1, once all else is there; the host sets 0 before the step. What follows in the
                           stream finds the step done; its last blocks may still move bodies when this is seen */
};

/* Written by the host: the updates of a step, which follow. */
struct cuda_updates {
    int64_t count;
};

/* In device memory, of the step that runs. */
struct cuda_step_control {
    int64_t sequence;
    unsigned long long depth; /* bit pattern of a double >= 0 */
    unsigned long long stamps[STAMPS]; /* of the sub-step */
    int32_t offending_body;
    int32_t substep;
    struct cuda_joint_counts joints; /* of the sub-step */
    struct sadmm_cuda_contact_counts counts; /* of the last find that was not aborted */
    struct cuda_step_totals totals;
};

/* What the step was planned for. */
struct cuda_step_speculation {
    int32_t contact_rows; /* 0: no contacts */
    int32_t copies;       /* of equal worlds (PLAN_CONTACT_ROWS_OF_COPIES) */
    int32_t point_slots;
    int32_t warm;         /* most pairs, and constraints of joints, carry an impulse; -1: does not matter */
    int32_t cold;         /* fast: some islands may start cold: weights are updated */
    int32_t unsolved;     /* some islands may not be solved before the iterations: these are made */
    int32_t rows;         /* there are constraints of joints; -1: there are no joints */
    int32_t apart;        /* articulations do not iterate: their block direct solve runs beside what else the step
                             does */
};

struct cuda_step_view {
    const struct sadmm_rigid *before;
    struct sadmm_rigid *after;
    const struct sadmm_extrapolation *extrapolation_before;
    struct sadmm_extrapolation *extrapolation_after;
    double *wrench;                       /* of the contacts; bodies x 6 */
    double *start_impulse;                /* points x 3 */
    double *start_velocity;               /* bodies x 6 */
    struct sadmm_contact_point *points;   /* the new set's, impulses to be written */
    const int32_t *slot_of_body;          /* dynamic body -> world slot */
    struct sadmm_collision_body *bodies;  /* by world slot */
    const struct sadmm_cuda_contact_counts *counts;
    int64_t candidate_capacity, point_capacity;
    struct cuda_step_speculation speculation;
    struct cuda_step_control *control;
    struct cuda_step_report *reports;     /* pinned: STEPS_AHEAD */
    const struct cuda_updates *updates;   /* likewise, each with update_capacity places behind it (updates_of_step) */
    int32_t update_capacity;
    int32_t measured;                     /* residuals of the last iteration are in view.iteration.residual */
    int32_t limits;                       /* there are contacts: momentum is restored, energies are limited
                                             (view.islands) */
    int32_t leaves_hits;                  /* none are searched for: a step in which some pair is fast is made again */
    int32_t substep, substeps;
};

/* Of the three states, and sets of contacts, the one that sub-step `substep` writes; -1: the one that the step begins
 * with. into: 0 or 1, where the step ends; it begins with the other one. */
static inline int step_state(int into, int substep, int substeps)
{
    if (substep < 0) return 1 - into;
    return (substeps - 1 - substep) % 2 == 0 ? into : 2;
}

#endif
