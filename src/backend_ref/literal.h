/* The paper's SubADMM written down literally: Steps 1-4 with x, z and u for every constraint and both of its sides.
 *
 * This is the oracle the fast backends are compared with, so it takes nothing from them: every constraint is a dense
 * (rows x 6) Jacobian a side (a geometric contact becomes rows n, t1, t2, or n alone when no contact has friction),
 * every body a dense 6x6 system, all loops are plain, all numbers double. It is never meant to be fast.
 *
 * Units are the library's: J is not scaled by dt, x is a velocity, e = error/dt, lambda an impulse, beta in kg. The
 * paper's c (kg/s^2) enters (13) as c dt^2. The static world is a side with 1/beta = 0: x, z and u stay 0 there.
 *
 * Start: z = J v0 and u = -lambda0, the state in which an earlier iteration would have left (v0, lambda0).
 */
#ifndef SADMM_BACKEND_REF_LITERAL_H
#define SADMM_BACKEND_REF_LITERAL_H

#include "core/solve/kernels.h"
#include "core/math/trapezoid.h"
#include "core/math/energy_limit.h"

/* One side of a constraint: the paper's subscript (i,k) or (j,k). */
struct ref_side {
    int32_t body;                    /* -1: static */
    double J[36];                    /* (rows x 6) row-major */
    double x[6], z[6], u[6];         /* at l+1, once Steps 2-4 ran */
    double z_before[6];              /* z at l, for (17) */
};

struct ref_constraint {
    bool cone;                       /* a contact, (5); else each row is a law of its own, math/row.h */
    int rows;
    struct ref_side side[2];
    double e[6];                     /* contact; of other rows the bias */
    double kinematic[3];             /* contact: what a kinematic body adds to x, which has no side */
    double mu;                       /* contact */
    double gain[6], compliance[6], lo[6], hi[6];
    bool coupled[6];                 /* fast: may share a dense weight with other rows (core/model/rows.h) */
    bool free_row[6];                /* zero on both bodies (Sec. III-C): carries nothing */
    double lambda[6];
    double B[36], seen[6];           /* fast: weight (6 x 6), the multiplier that the next Step 1 sees */
};

struct ref_body {
    double A[36], b[6];              /* (1) */
    double C[36];                    /* (14) */
    double beta;                     /* (13), (15), kg */
    double factor[36];               /* Cholesky of A + beta C */
    double v[6];
    double dual[6];                  /* (17), this body's part */
    /* fast */
    int32_t label;                   /* the smallest body of its island; that one keeps the island's sums */
    struct weight_sums sums;
    struct weight_island weights;
    double scale_weights;            /* not 0: the weights of pairs stay, times this */
    bool rows;                       /* the island has constraints given by rows */
    double balance;                  /* of its sides (weight_starts_warm), of which follows */
    bool warm;                       /* that it has no weight updates */
    struct island_energies energies;
    double along; /* v . A v_f / 2 of the island */
    /* of the island that it names, in either method */
    struct momentum_sums momentum;
    struct momentum_motions motions;
    bool floating;                   /* it has contacts, and none is known to anchor it */
    double slow_down;                /* the factor of its velocities, but for those motions */
    double impulse[6];               /* sums over the body's constraints */
    double correction[6];            /* its own correction (math/trapezoid.h) */
    int touch, island_touch;         /* bits: of the body; of the island that it names */
};

struct sadmm_context {
    const struct sadmm_system *system;
    const struct sadmm_plan *plan;
    const struct sadmm_settings *settings;
    struct ref_body *bodies;
    struct ref_constraint *constraints; /* contact points in order, then constraints given by rows */
    size_t constraint_count;
    bool step1_done;                 /* fast: Step 1 ran */
    int weight_updates;              /* fast: in this solve */
    double primal;                   /* fast: of the last iteration */
};

/* assemble.c */
sadmm_status sadmm_ref_assemble_bodies(struct sadmm_context *, struct sadmm_error *);
sadmm_status sadmm_ref_assemble_contacts(struct sadmm_context *, struct sadmm_error *);
sadmm_status sadmm_ref_assemble_rows(struct sadmm_context *, struct sadmm_error *);

/* iterate.c */
sadmm_status sadmm_ref_init_penalty(struct sadmm_context *, struct sadmm_error *);
sadmm_status sadmm_ref_factorize(struct sadmm_context *, struct sadmm_error *);
sadmm_status sadmm_ref_update_velocity(struct sadmm_context *, struct sadmm_error *);
sadmm_status sadmm_ref_update_constraints(struct sadmm_context *, bool measure, struct sadmm_error *);
sadmm_status sadmm_ref_measure_residuals(struct sadmm_context *, struct sadmm_residual *, struct sadmm_error *);
sadmm_status sadmm_ref_update_penalty(struct sadmm_context *, double ratio, struct sadmm_error *);

/* fast.c */
sadmm_status sadmm_ref_init_weights(struct sadmm_context *, struct sadmm_error *);
sadmm_status sadmm_ref_update_weights(struct sadmm_context *, struct sadmm_error *);
sadmm_status sadmm_ref_iterate_fast(struct sadmm_context *, int count, bool goes_on);
sadmm_status sadmm_ref_measure_fast(struct sadmm_context *, struct sadmm_residual *);
void sadmm_ref_label_islands(struct sadmm_context *);
/* A v - b - sum J^T lambda, by body, into `impulse`; and sum J^T lambda alone. */
void sadmm_ref_momentum_residual(struct sadmm_context *);
void sadmm_ref_sum_impulses(struct sadmm_context *);

/* momentum.c */
/* Of every island the motions that no static contact feels; at the body that names it. */
void sadmm_ref_find_motions(struct sadmm_context *);
/* Body i of an island that is slowed down to `factor`, but for those motions, in which it keeps its momentum. */
void sadmm_ref_move_island(struct sadmm_context *, int32_t i, double factor);

/* energy_limit.c */
sadmm_status sadmm_ref_limit_energy(struct sadmm_context *, int32_t *limited, struct sadmm_error *);

#endif
