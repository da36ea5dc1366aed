/* The CUDA backend: reduced form (docs/internals/algorithm.md), one source for both precisions (SADMM_REAL,
 * SADMM_VARIANT).
 *
 * Units of work
 *   - Points of a contact pair share normal, friction and bodies. With r_a, r_b = r_a + (x_a - x_b) a point's relative
 *     velocity is (v_b - v_a) + (w_b x r_b - w_a x r_a), and the pair's wrench on b is f = sum E_k, tau = sum r_b x E_k
 *     (E = 2 lambda - lambda_prev), on a -f, -sum r_a x E_k.
 *   - A "side" is one constraint as seen by one of its dynamic bodies: 2 record + side (0: on a, 1: on b); its
 *     record is the wrench on that body. Bodies gather the records of their sides over a CSR list in a fixed order. No
 *     float atomics: a result does not depend on timing, thread count, grid size or tier, bit for bit (the sources are
 *     compiled without contraction of a * b + c for the same reason).
 *   - Sums over a pair's points, p_0 to p_7: q_j = p_j + p_{j+4} (p_j alone where there is no p_{j+4}, 0 where there is
 *     no p_j), then (q_0 + q_1) + (q_2 + q_3): four lanes of a warp make it in two exchanges.
 *   - Records are in the order of the bodies' lists, so that a body reads its own one after the other; whoever writes
 *     them knows where they go. Points are stored pair by pair, four lanes a pair (point_slot).
 *   - Eight lanes take a body: lane r < 6 owns component r of A v, of the gathered sum and of H g, H = (A + beta C)^-1.
 *
 * Order. Bodies are numbered by island, stably, where islands matter: "slots" (device/layout.h). Pairs and row blocks
 * keep their raw order. Static bodies join nothing and share the state row after the last body, which is 0. Within a
 * body's list records ascend, so that the sums are the same in every tier.
 *
 * Tiers of the fused entry
 *   BLOCK    islands packed into thread blocks, everything on the chip; only __syncthreads
 *   CLUSTER  islands packed into clusters of thread blocks, which read each other's velocities from shared memory
 *   GRID     one cooperative launch; velocities go through L2, with a grid barrier an iteration
 *   STREAM   two kernels an iteration, in a CUDA graph: any size
 * BLOCK, CLUSTER and GRID are one kernel (iterate/persistent.h) over a partition into `parts` (iterate/partition.cu).
 *
 * The method `fast` has a weight B of its own for each constraint (weight/weights.cu) in place of beta, which is 1
 * then. Its iteration is Steps 2-4 and then Step 1, relaxed (math/relax.h), by instances of its own of the same
 * kernels; slots are by island in every tier, since weights rest on sums over islands. It passes on changes alone:
 * records are J^T d lambda, and bodies keep their momentum residual b - A v + J^T lambda (docs/internals/algorithm.md).
 * It begins with the multipliers: records are not kept.
 *
 * Launch sizes follow from what the host knows (capacities, tier); kernels read the true counts from `live`, and do
 * nothing once it says abort_code.
 *
 * Raw data (bodies, contact pairs and points, blocks as core has them, in double) is turned into this layout on the
 * device. In a whole step contact finding leaves it there; for a solve alone the host copies it.
 */
#ifndef SADMM_CUDA_DEVICE_VIEW_H
#define SADMM_CUDA_DEVICE_VIEW_H

#include <float.h>
#include <stddef.h>
#include <stdint.h>

#include <cuda_runtime.h>

#include "core/math/weight.h"
#include "core/solve/kernels.h"
#include "gravity.h"
#include "layout.h"
#include "line.h"
#include "pdl.h"
#include "step.h"

typedef SADMM_REAL solver_real;

#include "row.h"

/* Of this precision. */
#define SOLVER_EPSILON (sizeof(solver_real) == sizeof(float) ? (double)FLT_EPSILON : DBL_EPSILON)

#define SADMM_JOIN2(a, b) a##b
#define SADMM_JOIN(a, b) SADMM_JOIN2(a, b)
/* A symbol of this precision, e.g. sadmm_cuda_begin_f32. */
#define CUDA(name) SADMM_JOIN(sadmm_cuda_##name, SADMM_VARIANT)

enum {
    ROW = 8,              /* a wrench or a body's state: 6 used, 32 bytes in f32 */
    STATE_INV_BETA = 6,   /* slot of a state row */
    RESIDUAL_STAYS = 7,   /* slot of a row of momentum residuals: not 0 where iterations change nothing any more of a
                             body that nothing touches (iterate/streamed.cu) */
    PACKED = 21,          /* lower triangle, rows first */
    THREADS = 256,        /* a block, everywhere */
    WARP = 32,
    LANES = 8             /* threads a body */
};

struct alignas(16) real4 {
    solver_real x, y, z, w;
};

/* Of an island, at its label. paper: slow_down and anchored alone, in worlds. */
struct cuda_island {
    struct weight_island weights;
    double scale_weights; /* not 0: weights of pairs are those taken last, times this */
    double slow_down;     /* math/energy_limit.h: the factor of its velocities */
    int32_t anchored;     /* not floating (math/momentum.h): some pair anchors it, nothing touches it, or there are
                             rows */
    int32_t rows;         /* there are constraints given by rows: the weight scale stays 1, energies have no limit; and,
                             once iterations have ended, a kinematic body pushes */
    int32_t stopped;      /* iterations after which a check found the tolerances met; 0: not yet */
    int32_t warm;         /* it starts warm: no weight updates */
    int32_t anchored_outside; /* anchored, and not just by bodies of its own that roll on each other (sadmm_pair_rolls):
                                 what touches it is as step/move.h has it as a rule */
};

/* fast: of a step's stop rule (iterate/stop_rule.h). */
enum { CHECKS_KEPT = 3 };     /* the last check's, this one's, the next one's */
struct cuda_stop {
    unsigned long long sum;    /* of the iterations of islands that have stopped */
    int32_t unmet[CHECKS_KEPT]; /* islands that had not, by the number of the check */
    int32_t last;              /* the most iterations of those that have */
};

/* Of the first devices with clusters of thread blocks. */
#define CLUSTER_ARCH 900

enum { TERMS = 6 }; /* of a body, in sums over islands */
/* The same of floating islands (iterate/motions.h): seven numbers a lane. */
enum { MOTION_NUMBERS = 7, MOTION_TERMS = MOTION_NUMBERS * LANES };

/* Numbers of a side in side_arms (assemble/side_sums.h): sums over arms, as in arm_sums, then these. */
enum { SIDE_ARMS = 10, SIDE_LOAD = SIDE_ARMS, SIDE_RESPONSE, SIDE_NUMBERS };

/* What a pair joins. */
struct alignas(16) pair_bodies {
    int32_t body_a, body_b; /* raw; the static world: `bodies`; above: a row of a kinematic one */
    int32_t side_a, side_b; /* places of its sides in `incident`, and of their records; of the static world: -1.
                               For the stepwise kernels alone (streamed.cu) */
};

/* What BUFFER_SETTINGS holds. */
struct cuda_settings {
    struct sadmm_settings settings; /* numbers alone count */
    double gravity;                 /* size of it, m/s^2 */
};

/* ---- what kernels see --------------------------------------------------------------------------------------------
 * A view a subject. Functions take those they read or write; kernels, and functions that need most of them, take
 * all together (cuda_view). Pointers are device memory. Arrays over bodies are in raw order but where it says slots
 * (device/layout.h). */

/* The step's size, and what is the same for all of it. */
struct model_view {
    struct cuda_live *live;
    struct cuda_graph_statistics *statistics;
    const struct sadmm_settings *settings; /* its numbers alone (core/model/settings.h), which may change at every step.
                                              Kernels fetch them early: they are in memory */
    int32_t bodies;       /* exact, known to the host (state row `bodies` is the static world) */
    int32_t points;       /* capacity */
    int32_t contact_rows; /* of C, B and the response: 1 where no contact has friction (the iteration always has 3) */
    int32_t warm_start;
    int32_t fast, wrenches; /* of the settings that are no numbers: the method; recover_wrenches */
    struct cuda_gravities gravities; /* in the place of the settings' gravity (gravity_of) */
};

/* m/s^2, of the world that a dynamic body is in. */
static __device__ __forceinline__ const double *gravity_of(const model_view &model, int32_t body)
{
    if (!model.gravities.of) return model.settings->gravity;
    return own_gravity(model.gravities, body);
}

/* The settings' numbers with that; a body that is not dynamic says nothing. */
static __device__ __forceinline__ struct sadmm_settings settings_with(const struct sadmm_settings &all,
                                                                      const cuda_gravities &gravities, int32_t body)
{
    struct sadmm_settings settings = all;
    if (!gravities.of || body < 0) return settings;
    for (int k = 0; k < 3; ++k) settings.gravity[k] = own_gravity(gravities, body)[k];
    return settings;
}
static __device__ __forceinline__ struct sadmm_settings settings_of(const model_view &model, int32_t body)
{
    return settings_with(*model.settings, model.gravities, body);
}

enum { HALFWAY = 8, HALFWAY_ANGULAR = 4 }; /* orientation, angular velocity, 0 */

/* Bodies in the solver's form. */
struct body_view {
    solver_real *state; /* (bodies + 1) x ROW: v, w, 1/beta, 0; the last row is the static world, all 0. Where there
                           are kinematic bodies a row a pair follows (assemble/assemble.cu); tier STREAM reads these */
    solver_real *b;     /* bodies x ROW */
    solver_real *momentum_residual; /* fast: bodies x ROW: b - A v + J^T lambda, two zeros; RESIDUAL_STAYS */
    solver_real *lines; /* bodies x line: A and H (device/line.h) */
    int32_t line;
    int32_t rigid;       /* how lines are packed */
    double *halfway;     /* bodies x HALFWAY: what A and b are of (core/model/spin.h) */
    double *C;           /* bodies x PACKED */
    double *beta;        /* bodies, kg */
    double *A_inverse;   /* fast: bodies x PACKED */
    double *free_energy; /* fast: bodies: of A^-1 b, J */
};

/* The constraint graph as it is laid out (device/layout.h). */
struct graph_view {
    const int32_t *offsets, *incident; /* slot -> places of its sides; place -> side, ascending for each body */
    const int32_t *body_of, *slot_of;  /* slot -> raw body, raw body -> slot */
    const int32_t *parts;              /* first body slot of each part, and the end */
    const int32_t *label, *island_bodies; /* body -> its island's smallest body; at labels: bodies of the island */
};

/* Contact pairs and their points in the solver's form. */
struct contact_view {
    int32_t pair_capacity; /* multiple of 32. As a constraint pair p has number p, row block k pair_capacity + k */
    int32_t lanes;         /* threads a pair: 4, or 1 where no pair has more than one point */
    int32_t point_slots;   /* a pair has memory for */
    real4 *normal;         /* pairs: n, mu */
    real4 *difference;     /* pairs: x_a - x_b, number of points */
    pair_bodies *bodies;      /* pairs */
    solver_real *inv_s;    /* fast: pairs: B / number of dynamic bodies */
    real4 *arm;            /* points: r_a (r_b when a is static), e */
    solver_real *lambda;   /* points: a plane for each of x, y, z */
    size_t lambda_stride; /* from plane to plane */
};

/* Constraints given by rows in the solver's form (device/row.h). */
struct row_view {
    int32_t count; /* of constraints: exact, known to the host */
    row_constraint *constraints;
    row_data *data;          /* count x SADMM_MAX_ROWS */
    row_response *responses; /* fast: likewise */
};

/* fast: what weights are made of. */
struct weight_view {
    double *weight, *response; /* pairs: B as taken last, kg; mean of J A^-1 J^T over points and rows, 1/kg */
    double *side_wrench;       /* sides of pairs x ROW (assemble/side_sums.h) */
    solver_real *side_arms;    /* sides of pairs x SIDE_NUMBERS */
};

/* Islands and sums over them; fast: their energies and the stop rule. */
struct island_view {
    cuda_island *info;            /* bodies, used at labels; NULL: neither `fast` nor a world with contacts */
    double *motions;              /* worlds: slots x MOTION_TERMS, as `terms`; then at an island's first slot the rigid
                                     motion that restores its momentum */
    unsigned long long *motion_arrivals; /* of these */
    int32_t *moved;               /* not 0: there are such motions */
    double *terms;                /* slots x TERMS: of bodies, then added up in place (weight/island_sums.h) */
    unsigned long long *arrivals; /* slots: of terms at places they are added up at; 0 between kernels */
    int32_t *limited;             /* islands slowed down */
    int32_t *touch;               /* worlds with contacts: bodies: bits (math/trapezoid.h), of the body and, at labels,
                                     of the island; else NULL */
    int32_t *again;               /* worlds: whether bodies have to be moved again; enum cuda_again */
    int32_t *candidates;          /* not 0: some anchored island may need slowing down */
    int32_t *floating;            /* fast: not 0: there are floating islands */
    cuda_stop *stop;
};

/* Why bodies may have to be moved again (step/move.h): an island is not as it is as a rule; some body's trapezoid
 * correction closes a contact, and nothing presses on some body, which may be that one. */
enum cuda_again { AGAIN, AGAIN_CLOSED, AGAIN_UNPRESSED, AGAIN_ROLLS, AGAIN_WHYS };

/* What passes from sweep to sweep, and what was measured of them. */
struct iteration_view {
    /* sides x ROW: a force, 0, torque, 0. After a measured iteration `records` holds J^T lambda and `change`
     * J^T (lambda - lambda_prev), else `records` holds J^T (2 lambda - lambda_prev). fast: J^T (lambda^ - lambda). */
    solver_real *records, *change;
    solver_real *exchange;        /* GRID: velocities of even and of odd iterations, bodies x ROW each, in slots */
    unsigned *barrier;            /* arrivals at the grid barrier since launch */
    unsigned long long *residual; /* primal, dual: bit patterns of doubles >= 0, which order like the numbers */
    double *ratio;                /* of (15), the last time */
};

/* Core's own data, in double and in its order: where a step begins, and results. */
struct raw_view {
    struct sadmm_system system; /* rigid, A, b, velocity */
    const struct sadmm_row_constraint *constraints;
    const struct raw_row *rows; /* constraints x SADMM_MAX_ROWS */
    const struct sadmm_contact_pair *pairs;
    const struct sadmm_contact_point *points;
    const struct sadmm_contact_migration *migrations; /* as points */
    double *out; /* results */
};

/* A and b of a body of an articulation. */
struct cuda_articulation_body {
    double mass, inertia[6], b[6]; /* xx, yy, zz, xy, xz, yz */
};

/* What joints add to the inertia of a body (core/model/stiffening.h), along world axes; is there any? */
struct cuda_stiffening {
    double more[6];
    int32_t any, unused;
};

/* Where joints that have been closed let a body go: position, orientation and velocity; twice the energies that this
 * has given it and that it moves with (core/model/joint_close.h); at labels of islands what is left of their
 * velocities. closed: by its own part. */
struct cuda_closed_body {
    double place[13], gained, moving, keep;
    int32_t closed, unused;
};

/* An articulation, a part: where the numbers of its structure begin, how many these are, and its work. */
struct cuda_articulation_part {
    int64_t first_number, first_work;
    int32_t numbers, label; /* label: as in joint_view.is_articulated */
    int32_t first_body, body_count; /* in joint_view.members */
    int32_t loop, unused;           /* articulation_has_loop */
};

/* A side of a pair: code 2 pair + side, the number of its body in its part, points of the pair; and those of a part. */
struct cuda_articulation_side {
    int32_t code, entry, first, count;
};
struct cuda_articulation_range {
    int32_t first, count;
};

/* Joints of a world (step/joints.cu). */
struct joint_view {
    int32_t count;
    struct sadmm_resident_joint *joints;
    const int32_t *first;           /* count: a joint's first constraint */
    struct cuda_joint_middle *middle;
    struct sadmm_joint_source *sources; /* constraints x SADMM_MAX_ROWS, as rows are; */
    double *solution;                   /* likewise: multipliers */
    double *velocity;                   /* bodies x 6: the solution's */
    const struct sadmm_joint_memory *begin, *before; /* count: as the step began, the sub-step; */
    struct sadmm_joint_memory *after;                /* as it ends */
    const struct sadmm_coupling_memory *couplings_before; /* couplings: as the sub-step began; */
    struct sadmm_coupling_memory *couplings_after;        /* as it ends */
    const double *tables;           /* of springs */
    int32_t gears, first_gear;      /* how many, and the constraint of the first one: one each, after those of joints */
    struct sadmm_resident_gear *gear;
    const double *gear_before;      /* gears: force along the first coordinate, of the last (sub-)step; */
    double *gear_after;             /* of this one */
    int32_t apart;                  /* as in cuda_step_speculation */
    const int32_t *is_articulated;  /* bodies: of articulations (step/articulation.cu) 1 + the first body of its part;
                                       else 0. Then constraints: not 0. Those: */
    struct cuda_articulation_body *bodies; /* bodies */
    const struct cuda_articulation_part *parts;
    const int32_t *structures;      /* (core/model/articulation.h) */
    double *work;
    int32_t *folds;                 /* parts: a loop may fold (core/model/joint_close.h); */
    int32_t *kept;                  /* solved before the iterations; */
    uint8_t *kept_state;            /* rows: their state then */
    const int32_t *entry;           /* bodies: number in their part */
    const int32_t *members;         /* bodies of parts, ascending */
    int32_t *pair_parts;            /* sides of pairs: as is_articulated of the body. By it small parts find their
                                       contacts: */
    struct cuda_articulation_range *ranges; /* parts, into */
    struct cuda_articulation_side *sides; /* part by part, ascending in a part; parts as they come */
    const int32_t *first_at, *joints_at; /* bodies + 1: joints at a body, ascending: 2 joint + its side */
    struct cuda_stiffening *stiffening; /* bodies: in the (sub-)step at hand */
    const int32_t *closing;         /* constraints: the joint whose locks are closed by its rows; -1: none */
    struct cuda_closed_body *closed; /* bodies: of islands that have been closed in this (sub-)step */
    int32_t *touch;                 /* bodies: at labels of islands bits (core/model/joint_trapezoid.h) */
    struct joint_momentum *momentum; /* bodies; at labels then of islands, and what restores it (joint_momentum.h) */
};

/* Kinematic bodies of a world (step/kinematic.cu), and what islands they support. What the solve sees of both is in
 * raw_view.system. */
struct kinematic_view {
    int32_t count;
    const struct sadmm_kinematic_body *before; /* as the step began; */
    struct sadmm_kinematic_body *after;        /* as it ends */
    struct sadmm_rigid *moving;                /* as the sub-step at hand begins, with the velocities of the step */
    double *wrench;                            /* x 6: what contacts give them, the mean over the step */
    double *velocity;                          /* bodies x 6: where the solve starts, less the motion of their
                                                  support */
    int32_t *support;                          /* bodies: at labels of islands the first pair with what does not feel
                                                  it; */
    int32_t *several;                          /* not 0: there is something else that holds the island */
    int32_t *moves;                            /* not 0: a kinematic body of a pair is in motion; */
    int32_t *supports;                         /* and one supports some island */
};

/* Islands that are pushed apart without a velocity (core/solve/push.h, step/push.h). In worlds alone. */
struct push_view {
    int32_t planned;           /* the (sub-)step has a second problem */
    int32_t *due;              /* enum push_number: of the sub-step */
    int32_t *bits;             /* bodies: at labels of islands what pairs say (core/model/push_law.h); else NULL */
    unsigned long long *units; /* likewise: int64_t */
    /* where it is planned: */
    uint8_t *points;           /* pairs: points of those that are pushed, else 0; */
    uint64_t *places;          /* such pairs and their points before it (size_of in device/parallel.h) */
    double *start;             /* bodies x 6: v_0, where the second problem begins, less the motion of their support */
    double *way;               /* bodies x 6: v_1 - v_0 */
    struct cuda_live *live;    /* the second problem's: aborted where there is none; */
    struct sadmm_contact_pair *pairs; /* and its contacts */
    struct sadmm_contact_point *contacts;
};

/* Trees of a part (step/ncp_plan.cu): its nodes, 0: it is none; where they begin in ncp_view.nodes. Its gears'
 * constraints are in ncp_view.joints. */
struct cuda_ncp_part {
    int32_t nodes, first, levels, first_gear, gears;
};
/* A body with its joint to its parent; nodes are numbered in their part, children before their parents, -1: none. */
struct cuda_ncp_node {
    int32_t body, parent, child, sibling, level; /* level: joints to the root */
    int32_t first_joint, joints;                 /* of ncp_view.joints */
};

/* The dense contact solve (step/ncp_island.h). In worlds with joints alone. */
struct ncp_view {
    int32_t points;                     /* settings.ncp_points; 0: there is none */
    const struct cuda_ncp_part *parts;  /* articulations */
    const struct cuda_ncp_node *nodes;
    const int32_t *joints;              /* of nodes: 2 constraint + the side of the node's body */
    const int32_t *part_of;             /* bodies; -1: of none */
    int32_t *number;                    /* bodies: their node, while their island is solved */
    int32_t *solved;                    /* bodies: at labels of islands */
    int32_t *count, *islands;           /* labels of those that are to be solved */
    int32_t *unsolved;                  /* not 0: some island is left to the iterations */
    int32_t *missed;                    /* how many others have contacts that give by more than the tolerance */
    double *impulse;                    /* points x 3: of solved islands; their velocities and multipliers are in
                                           joint_view */
    int32_t *left, *left_count;         /* labels of those that warps have left to blocks */
    char *memory;                       /* of islands at a time */
};

struct cuda_view {
    struct model_view model;
    struct body_view bodies;
    struct graph_view graph;
    struct contact_view contacts;
    struct row_view rows;
    struct weight_view weights;
    struct island_view islands;
    struct iteration_view iteration;
    struct raw_view raw;
    struct cuda_step_view step;      /* whole steps alone; */
    struct joint_view joints;        /* likewise; */
    struct kinematic_view kinematic; /* likewise; */
    struct push_view push;           /* likewise; */
    struct ncp_view ncp;             /* likewise */
};

/* In pinned memory: the updates of step `sequence`; and them, one after the other. */
static __host__ __device__ inline const struct cuda_updates *updates_of_step(const struct cuda_updates *ring,
                                                                             int32_t capacity, int64_t sequence)
{
    const size_t bytes = sizeof *ring + (size_t)capacity * sizeof(struct sadmm_resident_update);
    return (const struct cuda_updates *)((const char *)ring + (size_t)(sequence % STEPS_AHEAD) * bytes);
}
static __host__ __device__ inline const struct sadmm_resident_update *first_update(const struct cuda_updates *updates)
{
    return (const struct sadmm_resident_update *)(updates + 1);
}

/* In a whole step: is what the solve gives relative to the motion of the bodies' support? */
static __device__ __forceinline__ bool is_supported(const cuda_view &v)
{
    return v.kinematic.count > 0 && *v.kinematic.supports;
}

/* Where the data of point k of pair p is. */
template <int LANES_A_PAIR>
static __device__ __forceinline__ size_t point_slot(const contact_view &contacts, int32_t p, int32_t k)
{
    return (size_t)(k / LANES_A_PAIR * LANES_A_PAIR) * (size_t)contacts.pair_capacity + (size_t)p * LANES_A_PAIR +
           (size_t)(k % LANES_A_PAIR);
}
static __device__ __forceinline__ size_t point_slot(const contact_view &contacts, int32_t p, int32_t k)
{
    return contacts.lanes == 1 ? point_slot<1>(contacts, p, k) : point_slot<4>(contacts, p, k);
}

/* Points of a pair that are fetched before the first of them is used: a thread that waits for memory point by point
 * waits longest of all. */
enum { POINTS_AT_ONCE = 4 };

/* This step's counts; 0 when it is aborted. Both are in one load. */
static __device__ __forceinline__ int32_t live_pairs(const model_view &model)
{
    const int4 live = *(const int4 *)model.live;
    static_assert(sizeof(struct cuda_live) == sizeof(int4), "abort_code, bodies, pairs, points");
    return live.x ? 0 : live.z;
}
static __device__ __forceinline__ int32_t live_bodies(const model_view &model)
{
    return model.live->abort_code ? 0 : model.bodies;
}
static __device__ __forceinline__ int32_t live_rows(const model_view &model, const row_view &rows)
{
    return model.live->abort_code ? 0 : rows.count;
}

/* Before the first kernel of a solve that counts islands: those slowed down, moved, those that have stopped. */
static __device__ __forceinline__ void clear_counts(const island_view &islands)
{
    const cuda_stop none = {};
    *islands.limited = *islands.candidates = *islands.floating = *islands.moved = 0;
    for (int k = 0; k < AGAIN_WHYS; ++k) islands.again[k] = 0;
    *islands.stop = none;
}

/* What an iterating kernel does about energies after its last iteration: it says whether an island may have too much,
 * or it sees to everything (BLOCK). */
enum cuda_energy_limit { LIMIT_NONE, LIMIT_CANDIDATES, LIMIT_WHOLE };

/* What differs between launches of a kernel. */
struct cuda_args {
    int32_t count;      /* iterations, or a kind of block */
    int32_t measure;
    int32_t join;       /* the first Step 1 takes records + ratio change */
    int32_t start;      /* the first Step 1 takes J^T lambda^0, whatever the records are */
    int32_t most_bodies, cluster; /* of the partition */
    int32_t planned;    /* a whole step: compare with the plan */
    int32_t rescaled;   /* ratio is iteration.ratio, else 1 */
    int32_t backward;   /* thread blocks in descending order */
    int32_t in_order;   /* slots are raw indices */
    int32_t step1_done; /* fast: Step 1 ran before in this solve */
    int32_t goes_on;    /* fast: the batch does not end with these iterations */
    int32_t may_be_warm; /* fast: plan_may_start_warm */
    int32_t spring_iterations; /* fast: weight_spring_iterations of an island that is */
    int32_t checks;      /* fast: of the stop rule, in this step so far */
    int32_t begin;      /* fast, BLOCK: weights, C and factors first */
    int32_t energy_limit; /* fast; enum cuda_energy_limit */
    int32_t rebounds;   /* fast: islands that start warm are tested for a rebound, too (math/energy_limit.h) */
    int32_t paper;      /* the method: energies are compared, nothing is slowed down */
    int32_t left;       /* NCP: islands that warps have left are solved; or (LEAVES) may be left */
    size_t memory;      /* NCP: bytes of an island in ncp_view.memory */
    int32_t relax;      /* fast, STREAM: bits of enum cuda_relax */
    double factor;
    double row_floor;   /* fast: weight_row_floor */
};

/* Of the dense contact solve: all islands are solved, or left to the iterations; some are left by warps to blocks;
 * these are solved. */
enum cuda_ncp_pass { NCP_ALL, NCP_LEAVES, NCP_LEFT };

/* fast: what goes as many times as far as the settings' relaxation says; else once. RELAX_WARM: so of islands that
 * start warm alone. */
enum cuda_relax { RELAX_VELOCITY = 1, RELAX_MULTIPLIERS = 2, RELAX_WARM = 4 };

typedef void (*cuda_kernel)(const cuda_view, const cuda_args);

/* Shared memory of a block, sized at launch. */
#ifdef SADMM_CUDA_EMULATED
#define CUDA_DYNAMIC_SHARED(name) unsigned char *const name = cuda_emulation_shared()
#else
#define CUDA_DYNAMIC_SHARED(name) extern __shared__ __align__(16) unsigned char name[]
#endif

enum { ALL_LANES = -1 }; /* of a warp */

/* *out = max(*out, values of the warp). Every lane of the warp comes here. Bit patterns of non-negative doubles order
 * like the numbers, and a maximum does not depend on the order it is taken in; a NaN survives as the largest
 * pattern. */
static __device__ __forceinline__ void reduce_max(double value, unsigned long long *out)
{
    /* -0 (what real_abs may give) has the largest pattern but one: it counts as 0. */
    unsigned long long bits = value == 0 ? 0 : (unsigned long long)__double_as_longlong(value);
    for (int o = WARP / 2; o > 0; o /= 2) {
        unsigned long long other = __shfl_xor_sync((unsigned)ALL_LANES, bits, o);
        bits = other > bits ? other : bits;
    }
    if (threadIdx.x % WARP == 0 && bits != 0) atomicMax(out, bits);
}

#endif
