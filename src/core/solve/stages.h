/* The schedule of a step: the paper's Fig. 4 as a list of stages, in order. It exists once.
 *
 *     step = GATHER  sub-step { TURN sub-step } *  CERTIFY COMMIT           (world level)
 *     sub-step = HITS FIND JOINT_ROWS PLAN PUSH_CHOICE BLOCK_SOLVE NCP_SOLVE  solve  PUSH_SOLVE INTEGRATE
 *                BLOCK_SOLVE_AGAIN NCP_SOLVE_AGAIN REACTIONS KINEMATIC JOINT_MOTION PUSH_MOTION KEEP WRENCHES
 *     solve = INITIALISE BODIES CONTACTS ROWS PENALTY  iterations  ENERGY_LIMIT SOLUTION
 *     iterations = { ITERATE RESIDUALS CHECK WEIGHTS BALANCE } until the budget is spent or a check is met
 *
 * What the plan and the settings do not ask for is not in the list: no solve where BLOCK_SOLVE and NCP_SOLVE have
 * solved all islands. Whoever executes it goes through it one stage after
 * the other: hosts run each stage (schedule.c, world/step.c), the CUDA backend records it into its graph. An executor
 * may begin a stage before its turn where all that the stage reads is there.
 */
#ifndef SADMM_CORE_SOLVE_STAGES_H
#define SADMM_CORE_SOLVE_STAGES_H

#include "plan.h"

#ifdef __cplusplus
extern "C" {
#endif

enum sadmm_stage_kind {
    SADMM_STAGE_GATHER,            /* -    bodies and start values of the step */
    SADMM_STAGE_HITS,              /* -    bodies in flight hit each other at their moments (world/step/hits.c) */
    SADMM_STAGE_FIND,              /* -    contacts */
    SADMM_STAGE_JOINT_ROWS,        /* -    rows of joints, gears and couplings */
    SADMM_STAGE_PLAN,              /* -    what this sub-step needs, found from its contacts and rows */
    SADMM_STAGE_PUSH_CHOICE,       /* -    islands that are pushed apart without a velocity (push.h) */
    SADMM_STAGE_BLOCK_SOLVE,       /* -    bodies with joints, directly (articulation.h), and what stiffens them */
    SADMM_STAGE_NCP_SOLVE,         /* -    contacts of small islands, exactly (ncp.h) */
    SADMM_STAGE_INITIALISE,        /* -    FAST: initial impulses (impulse_initialisation.h) */
    SADMM_STAGE_BODIES,            /* A    A_i, b_i */
    SADMM_STAGE_CONTACTS,          /* B    contacts in the solver's form */
    SADMM_STAGE_ROWS,              /* C, D constraints given by rows */
    SADMM_STAGE_PENALTY,           /* E-H  C_i, beta_i (FAST: weights) and the factors of A_i + beta_i C_i */
    SADMM_STAGE_ITERATE,           /* I-O  Steps 1-4, `count` times */
    SADMM_STAGE_RESIDUALS,         /* N    eqs. (16), (17) of the last iteration */
    SADMM_STAGE_CHECK,             /* -    convergence: where the stop rule is met, no iteration follows */
    SADMM_STAGE_WEIGHTS,           /* -    FAST: weights from the multipliers found so far, where cold; factors */
    SADMM_STAGE_BALANCE,           /* P    eq. (15), and where it changes the penalty factors */
    SADMM_STAGE_ENERGY_LIMIT,      /* - momentum that no contact may change (math/momentum.h); FAST: energy
                                       (math/energy_limit.h) */
    SADMM_STAGE_SOLUTION,          /* -    velocities and multipliers to where the caller reads them */
    SADMM_STAGE_PUSH_SOLVE,        /* -    the second problem: velocities that push apart */
    SADMM_STAGE_INTEGRATE,         /* Q states after dt, each body's position correction included (math/trapezoid.h) */
    SADMM_STAGE_BLOCK_SOLVE_AGAIN, /* -    bodies with joints, beside the contact impulses found */
    SADMM_STAGE_NCP_SOLVE_AGAIN,   /* -    ... of those that were not solved before */
    SADMM_STAGE_REACTIONS,         /* -    what joints keep and report */
    SADMM_STAGE_KINEMATIC,         /* -    kinematic bodies and the targets of couplings go on */
    SADMM_STAGE_JOINT_MOTION,      /* -    states of bodies with joints after dt: correction, closing, momentum */
    SADMM_STAGE_PUSH_MOTION,       /* -    pushed bodies move by the second problem's velocities */
    SADMM_STAGE_KEEP,              /* -    what goes along into the next (sub-)step; is it finite? */
    SADMM_STAGE_WRENCHES,          /* R    eq. (12) */
    SADMM_STAGE_TURN,              /* -    the next sub-step starts from where this one has ended */
    SADMM_STAGE_CERTIFY,           /* -    the true error, from the raw data */
    SADMM_STAGE_COMMIT,            /* -    the step is made; nothing before changes the world */
    SADMM_STAGE_COUNT
};

struct sadmm_stage {
    enum sadmm_stage_kind kind;
    int count;    /* ITERATE: iterations */
    bool measure; /* ITERATE: the last of them keeps what RESIDUALS and BALANCE need */
    int done;     /* iterations that are done after this stage */
    bool goes_on; /* ITERATE: nothing but WEIGHTS comes before the next iteration */
    bool last;    /* ITERATE to BALANCE: the budget is spent, no iteration follows */
    bool checked; /* ITERATE: a CHECK follows before any other iteration */
};

/* Where in the list an executor is. */
struct sadmm_stages {
    const struct sadmm_plan *plan;         /* read after PLAN */
    const struct sadmm_settings *settings; /* of a sub-step */
    bool world;                            /* a step; else a solve alone */
    bool stopped;                          /* set by the executor: a check was met; */
    bool solved;                           /* all islands are, before any iteration */
    int substep;                           /* from 0; after TURN: of the one that comes */
    int next;                              /* enum sadmm_stage_kind */
    struct {                               /* the iterations up to the next stage that needs their result */
        int done;
        bool goes_on, last, measure, check, weights, balance;
    } batch;
};

struct sadmm_stages sadmm_stages_of(const struct sadmm_plan *plan, const struct sadmm_settings *settings, bool world);

/* Is this the sub-step that ends the step? */
bool sadmm_stages_in_last_substep(const struct sadmm_stages *stages);

/* The next stage; false: there is none. */
bool sadmm_stages_next(struct sadmm_stages *stages, struct sadmm_stage *stage);

/* What a stage's time counts as. */
enum sadmm_phase { SADMM_PHASE_COLLIDE, SADMM_PHASE_ASSEMBLE, SADMM_PHASE_SOLVE, SADMM_PHASE_FINISH,
                   SADMM_PHASE_CERTIFY, SADMM_PHASE_OTHER, SADMM_PHASE_COUNT };
enum sadmm_phase sadmm_stage_phase(enum sadmm_stage_kind kind);

/* Iterations of a solve that nobody stops: without constraints Step 1 is exact at once, v = A^-1 b. */
int sadmm_stages_budget(const struct sadmm_plan *plan, const struct sadmm_settings *settings);

#ifdef __cplusplus
}
#endif
#endif
