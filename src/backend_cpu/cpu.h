/* The CPU backend: reduced form (docs/internals/algorithm.md) on threads (core/base/parallel.h) and SIMD lanes.
 *
 * These sources are compiled once per precision (SADMM_REAL) and instruction set (SADMM_VARIANT, SADMM_VECTOR_BYTES);
 * cpu_find.c picks the best table the machine can run.
 *
 * Layout. A contact pair shares normal, friction and bodies among its points, so the pair is the unit:
 *   - pairs go into blocks of LANES pairs, one pair a lane; a point slot holds one point of each of its pairs;
 *   - with d = x_a - x_b (difference of the centres of mass) r_b = r_a + d, so that a point's relative velocity is
 *         x = u + w x r_a,   u = v_b - v_a + w_b x d,   w = w_b - w_a,
 *     and the pair's wrench needs only f = sum E_k and tau = sum r_k x E_k (E = 2 lambda - lambda_prev):
 *         on a: (-f, -tau)      on b: (f, tau + d x f);
 *   - the pair writes two wrench rows, bodies gather their rows over a CSR list: E is never stored, nothing is added
 *     atomically, and the order of a body's sum does not depend on the threads.
 * Constraints given by rows go into blocks of LANES as well, a row of each of them in a slot, and write the same wrench
 * rows, after the pairs'.
 *
 * Bodies have one of two forms, each by itself (cpu_forms.c): where A is (m I, inertia) and all constraints on it are
 * three-row contacts, A + beta C has the 3x3 structure of one rigid body and LANES bodies are updated at once from 23
 * numbers each; any other body is a general one, with a full 6x6 inverse. Its lane is idle, and it is updated after the
 * lanes by itself.
 *
 * An iteration is two sweeps with a barrier after each: bodies (Step 1), constraints (Steps 2-4).
 *
 * The method `fast` has one weight B a constraint in place of beta: it comes in through inv_s and C_i (cpu_weights.c),
 * with beta = 1. Its sweeps pass on changes alone: wrench rows hold J^T d lambda, bodies keep their momentum residual b
 * - A v + J^T lambda up to date (docs/internals/algorithm.md), and both go `relaxation` times as far.
 */
#ifndef SADMM_CPU_H
#define SADMM_CPU_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/barrier.h"
#include "core/base/parallel.h"
#include "core/solve/kernels.h"
#include "core/math/energy_limit.h"
#include "core/math/packed6.h"
#include "core/model/system_terms.h"
#include "cpu_lanes.h"

#define SADMM_JOIN2(a, b) a##b
#define SADMM_JOIN(a, b) SADMM_JOIN2(a, b)
/* A symbol of this variant, e.g. sadmm_cpu_iterate_f32_avx2. */
#define CPU(name) SADMM_JOIN(sadmm_cpu_##name, SADMM_VARIANT)

enum { STATE_INV_BETA = 6 }; /* slot of a state row */
/* Of weights: energy, kinetic, push, momentum residual; of the energy limit: now, free, along; then momentum
 * residual, drive, response. */
enum { BODY_SUMS = 4 };

/* LANES contact pairs; points of all of them in `slots` slots from `first` on. Lanes without a pair point at the
 * static body; slots without a point have an error so large that lambda stays 0. */
struct pair_block {
    vec normal, d;
    lanes friction, inv_s; /* mu, 1 / (1/beta_a + 1/beta_b); fast: B / number of dynamic bodies */
    int32_t body_a[LANES], body_b[LANES];
    int32_t pair[LANES];   /* index in the system, -1 for an empty lane */
    int32_t slots;
    size_t first;          /* in units of slots */
};

struct point_slot { /* 3 rows a contact */
    vec arm;
    lanes error;
    vec lambda;
};
struct normal_slot { /* 1 row a contact (no friction anywhere) */
    vec arm;
    lanes error, lambda;
};

/* LANES rigid bodies under three-row contacts only; lanes of general bodies are 0 throughout. With n points, S = sum r,
 * Q = sum (|r|^2 I - r r^T):
 *     A + beta C = [ alpha I, -beta [S]x; beta [S]x, I + beta Q ],  alpha = m + beta n,
 * and eliminating the linear part leaves K = I + beta Q + beta^2/alpha [S]x[S]x. */
enum { ALL_LANES = (1 << LANES) - 1 };
struct body_block {
    vec b_linear, b_angular;
    lanes mass;
    lane_sym3 inertia;
    lanes inv_alpha;
    vec sigma;       /* beta/alpha S */
    lane_sym3 K_inverse;
    vec residual_linear, residual_angular; /* fast: b - A v + J^T lambda */
};

/* LANES constraints given by rows, all cones or all of scalar rows; rows of all of them in `slots` slots from `first`
 * on. What is not there (a lane without a constraint, a row that is zero on both bodies) has an equation that 0
 * solves. */
struct row_block {
    lanes friction, inv_s; /* of cones, as in pair_block */
    int32_t body_a[LANES], body_b[LANES];
    int32_t constraint[LANES]; /* index in the system, -1 for an empty lane */
    int32_t slots;
    bool cone;
    size_t first;
};

struct row_slot { /* math/row.h */
    lanes jacobian_a[6], jacobian_b[6];
    lanes gain, bias, compliance, lo, hi, lambda;
    lanes step;  /* row_step() */
    lanes along; /* fast: with n dynamic bodies, B / n has the part along along^T */
};

/* fast: of a row of the system. B = diag(weight) + along along^T; J A^-1 J^T, and what its multiplier counts for in the
 * load */
struct row_weight {
    double weight, along, response, scale;
};

/* A floating island: under contacts, none of whose static pairs is known to anchor it (math/momentum.h). */
struct cpu_floating {
    int32_t first_body, end_body, first_pair, end_pair; /* in floating_bodies, floating_pairs */
    struct momentum_motions motions;
    double slow_down; /* the factor of its velocities, but for those motions */
};

/* fast: sums over an island. */
struct cpu_island {
    struct weight_sums sums;
    struct weight_island weights;
    double scale_weights;       /* not 0: the weights of pairs stay, times this */
    bool rows;                  /* there are constraints by rows: no energy limit, the weight scale stays 1 */
    double balance;             /* as in weight_starts_warm: */
    bool warm;                  /* it starts warm, and has no weight updates */
    struct island_energies energies;
    double along; /* v . A v_f / 2 */
};

struct sadmm_context {
    const struct sadmm_system *system;
    struct sadmm_plan plan;
    struct sadmm_settings settings;
    struct sadmm_barrier barrier;

    /* Bodies; index `bodies` is the static world: state and 1/beta 0, never written. Rows are padded to whole
     * blocks. Where there are kinematic bodies a row a pair record follows, from `kinematic_row` on: the kinematic
     * body's motion about the centre of mass of the other one, whose arms the pair has (sadmm_kinematic_motion). */
    int32_t bodies;
    size_t body_block_count, kinematic_row;
    real *state;                        /* rows: v, w, 1/beta, 0 */
    double *A, *C;                      /* bodies x PACKED6 */
    double *beta;                       /* bodies, kg */
    struct sadmm_trapezoid *trapezoids; /* of bodies with a state, at the end of a step; the static world's is 0 */
    struct body_block *body_blocks;     /* unless all bodies are general */
    /* Of each body its index among the general ones or -1; the general ones, ascending. Of each body block which lanes
     * are general (bits); where there are some, those behind the last body, too. */
    size_t general_count;
    int32_t *general_of, *general_bodies;
    uint32_t *general_lanes;
    real *b, *A_columns, *H_columns; /* of general bodies: rows; 6 rows (columns of A, of (A + beta C)^-1) a body */
    real *momentum_residuals;        /* and rows, fast */

    /* Geometric contacts */
    struct pair_block *pair_blocks;
    void *slots; /* point_slot or normal_slot */
    size_t pair_block_count, slot_count;
    int32_t *pair_order; /* scratch */

    /* Constraints given by rows: blocks of cones first */
    struct row_block *row_blocks;
    struct row_slot *row_slots;
    int32_t *row_order;             /* scratch */
    struct row_weight *row_weights; /* fast; rows of the system */
    size_t row_block_count, row_slot_count;

    /* Wrench rows: record_count rows on a, then as many on b; record: pair lane, or row lane after all pair lanes.
     * `change` holds J^T (lambda - lambda_prev) after a measured iteration, when `wrenches` holds J^T lambda. */
    real *wrenches, *change;
    size_t record_count;
    bool step1_done;   /* Step 1 ran: bodies without constraints are at A^-1 b and need no more */
    bool measured;     /* wrenches are split: the next Step 1 uses wrenches + ratio * change */
    double ratio;
    struct sadmm_residual residual; /* primal part of a measured iteration */

    /* Body -> its wrench rows: offsets (bodies + 2), incident: row index */
    int32_t *offsets, *incident;

    /* Islands; without constraints and limits of worlds in the method `paper`: none */
    int32_t *label;             /* bodies: the smallest body of its island */
    _Atomic int32_t *touch;     /* bodies: bits (math/trapezoid.h), of the body and, at labels, of the island */
    int32_t *floating_of;       /* bodies, used at labels: index in `floating`, negative: anchored */
    struct cpu_floating *floating;
    int32_t *floating_bodies, *floating_pairs; /* by island, ascending; of pairs the static ones */
    int32_t floating_count;

    /* fast */
    bool fast;
    struct cpu_island *islands; /* bodies, used at labels */
    double *A_inverse;          /* bodies x PACKED6 */
    double *pair_response, *pair_weight; /* pair records: J A^-1 J^T, B in kg */
    double *pair_violation;     /* pair records: terms of the islands' sums */
    struct arm_sums *pair_arms; /* where contacts have three rows: of pair records on a and b, once a step */
    int weight_updates;         /* in this solve */
    bool any_cold, any_warm;    /* some island starts so */
    int exact_since;            /* iterations since the momentum residuals were taken */
    double *body_sums;          /* bodies x BODY_SUMS: terms of the islands' sums */

    double *thread_max; /* one cache line a thread */
};

enum { THREAD_MAX_STRIDE = 8 };

/* The function's work on the context, or on an argument that holds it, by the plan's threads. */
static inline void cpu_parallel(const struct sadmm_context *c, sadmm_parallel_function *function, void *argument)
{
    sadmm_parallel(c->system->team, c->plan.threads, function, argument);
}

/* A thread's share of the bodies: whole blocks. A lane of a block is written by loading and storing the whole vector,
 * by clang for one: two threads must not have bodies of one block. */
static inline void cpu_share_bodies(const struct sadmm_context *c, int thread, int threads, size_t *begin, size_t *end)
{
    const size_t bodies = (size_t)c->bodies;
    sadmm_share(c->body_block_count, thread, threads, begin, end);
    *begin *= (size_t)LANES, *end *= (size_t)LANES;
    if (*begin > bodies) *begin = bodies;
    if (*end > bodies) *end = bodies;
}

/* The largest of the threads' maxima: 0 of those that did not run. */
static inline double cpu_reduce_max(const struct sadmm_context *c)
{
    double largest = 0;
    for (int t = 0; t < c->plan.threads; ++t) largest = fmax(largest, c->thread_max[t * THREAD_MAX_STRIDE]);
    return largest;
}

/* Index among the general bodies, -1: a rigid one. */
static inline int32_t cpu_general(const struct sadmm_context *c, size_t body)
{
    return c->general_of[body];
}

/* Row of a body in `state`: the static world is the last one. */
static inline int32_t cpu_body(const struct sadmm_context *c, int32_t body) { return body < 0 ? c->bodies : body; }

sadmm_status CPU(create)(int device, struct sadmm_context **out, struct sadmm_error *error);
void CPU(destroy)(struct sadmm_context *context);
sadmm_status CPU(begin)(struct sadmm_context *, const struct sadmm_system *, const struct sadmm_plan *,
                        const struct sadmm_settings *, struct sadmm_error *);
sadmm_status CPU(assemble_bodies)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(assemble_contacts)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(assemble_rows)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(init_penalty)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(init_weights)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(update_weights)(struct sadmm_context *, struct sadmm_error *);
/* A thread's share of what the weight scales of the islands need; then the weight scales (cpu_weight_scale.c).
 * `wrenches` hold J^T lambda. */
void CPU(add_up_imbalance)(struct sadmm_context *, int thread, int threads);
void CPU(update_weight_scales)(struct sadmm_context *);
sadmm_status CPU(limit_energy)(struct sadmm_context *, int32_t *limited, struct sadmm_error *);
/* begin: islands, and which are floating (cpu_islands.c); false when memory runs out. */
bool CPU(find_islands)(struct sadmm_context *);
/* Motions of the floating islands; then their velocities, slowed down but for these (cpu_momentum.c). */
void CPU(find_motions)(struct sadmm_context *);
void CPU(move_floating)(struct sadmm_context *);
sadmm_status CPU(factorize)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(update_velocity)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(update_constraints)(struct sadmm_context *, bool measure, struct sadmm_error *);
sadmm_status CPU(iterate)(struct sadmm_context *, int count, bool goes_on, bool measure, struct sadmm_error *);
sadmm_status CPU(measure_residuals)(struct sadmm_context *, struct sadmm_residual *, struct sadmm_error *);
sadmm_status CPU(update_penalty)(struct sadmm_context *, double ratio, struct sadmm_error *);
sadmm_status CPU(read_solution)(struct sadmm_context *, struct sadmm_error *);
sadmm_status CPU(read_penalty)(struct sadmm_context *, double *beta, struct sadmm_error *);
sadmm_status CPU(integrate)(struct sadmm_context *, struct sadmm_rigid *next, struct sadmm_error *);
sadmm_status CPU(recover_wrenches)(struct sadmm_context *, double *wrench, struct sadmm_error *);

/* Sweeps: a thread's share, used by the stepwise entries and by iterate alike. */
enum cpu_sweep {
    CPU_SWEEP_START,   /* wrenches = J^T lambda of the start values */
    CPU_SWEEP_ITERATE, /* Steps 2-4; wrenches = J^T (2 lambda - lambda_prev) */
    CPU_SWEEP_MEASURE, /* Steps 2-4; wrenches = J^T lambda, change = J^T (lambda - lambda_prev); *primal: eq. (16) */
    /* fast: Steps 2-4; wrenches = J^T (lambda^ - lambda) */
    CPU_SWEEP_RELAX,   /* lambda goes `relaxation` times as far as lambda^ */
    CPU_SWEEP_PLAIN,   /* as far */
    CPU_SWEEP_RELAX_WARM, /* RELAX in islands that start warm, PLAIN in others */
    CPU_SWEEP_PLAIN_MEASURE /* and *primal: eq. (16) */
};
static inline bool cpu_sweep_passes_changes(enum cpu_sweep sweep) { return sweep >= CPU_SWEEP_RELAX; }
static inline bool cpu_sweep_measures(enum cpu_sweep sweep)
{
    return sweep == CPU_SWEEP_MEASURE || sweep == CPU_SWEEP_PLAIN_MEASURE;
}
void CPU(sweep_pairs)(struct sadmm_context *, size_t begin, size_t end, enum cpu_sweep sweep, double *primal);
void CPU(sweep_rows)(struct sadmm_context *, size_t begin, size_t end, enum cpu_sweep sweep, double *primal);
/* Step 1 of a thread's share of the bodies; `step1_done`: all but the bodies without constraints. */
void CPU(sweep_bodies)(struct sadmm_context *, int thread, int threads, bool step1_done);
/* The same for the method `fast`: velocities go `velocity` times as far, multipliers have gone `multipliers` times;
 * warm: so in islands that start warm, in others once. */
void CPU(sweep_bodies_fast)(struct sadmm_context *, int thread, int threads, bool step1_done, double velocity,
                            double multipliers, bool warm);
/* fast: the momentum residuals of bodies [begin, end), recomputed, in double from v and lambda (cpu_residuals.c). */
void CPU(recompute_residuals)(struct sadmm_context *, size_t begin, size_t end);
/* Largest entry of A v - b - (sum of wrenches), eq. (17), over a thread's share of the bodies. */
double CPU(dual_residual)(const struct sadmm_context *, int thread, int threads);
/* Is a packed A (m I, symmetric inertia), and can the inertia be inverted by its cofactors? World bodies always count
 * as such. */
bool CPU(has_rigid_mass)(const struct sadmm_context *, const double A[PACKED6]);
/* Which bodies are general (cpu_forms.c); false when memory runs out. */
bool CPU(find_forms)(struct sadmm_context *);
/* Constraints given by rows: their lanes (before their number of blocks is used), and their slots. False when memory
 * runs out. */
bool CPU(lay_out_rows)(struct sadmm_context *);
/* The steps of a row block, by beta. */
void CPU(set_row_steps)(struct sadmm_context *, size_t block);
/* fast: responses of a row block, once a step; its weights. */
void CPU(respond_rows)(struct sadmm_context *, size_t block);
void CPU(weigh_rows)(struct sadmm_context *, size_t block);
/* A^-1 of a body. */
void CPU(invert)(const struct sadmm_context *, const double A[PACKED6], double inverse[PACKED6]);
/* wrenches = J^T lambda; and at the start of a solve. */
void CPU(sum_wrenches)(struct sadmm_context *);
void CPU(start_wrenches)(struct sadmm_context *);

#endif
