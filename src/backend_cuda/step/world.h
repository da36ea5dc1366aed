/* The world on the device, the host's side: what the sources of whole steps (device/step.h) share.
 *
 *   world.cu        take over a world and let it go; where its arrays are
 *   speculation.cu  plan a step from the statistics of an earlier one
 *   record.cu       a step as a graph
 *   queue.cu        run steps and see what became of them; repeat those whose plan did not hold
 *   read.cu         bring the world and the report back
 *   push.cu         islands that are pushed apart by a second problem
 *   ncp_*           small islands, solved to rounding
 *   kinematic.cu, joints.cu, gears.cu, articulation.cu   kinematic bodies, joints, gears, and articulations
 */
#ifndef SADMM_CUDA_STEP_WORLD_H
#define SADMM_CUDA_STEP_WORLD_H

#include "backend_cuda/collide/pipeline.h"
#include "backend_cuda/device/context.h"
#include "core/model/settings.h"
#include "core/solve/push.h"

/* Of a step that was enqueued, until its report has been seen. */
struct queued_step {
    cudaEvent_t done;
    struct sadmm_settings settings;
    size_t update_count;
    bool hits; /* are searched for (takes_hits) */
};

/* A step's graphs, by the set that is written. */
struct step_graphs {
    bool recorded; /* for the world as it is, and as it is planned */
    cudaGraphExec_t into[2];
};

/* What a sub-step is planned to be. */
struct substep_plan {
    struct sadmm_plan plan;
    int32_t contact_rows, warm, rows; /* as in cuda_step_speculation */
};

/* From the reports of a step that failed in a later sub-step. */
struct learned {
    int64_t step;    /* of the queue; -1: none */
    int substep;     /* the plans up to this one are known */
    int64_t pairs;   /* the most that one of them has */
    struct cuda_graph_statistics statistics; /* the most of any */
};

/* Steps that articulations are left alone, or all islands solved before the iterations, until it is planned that they
 * are; twice as many each time they were not. */
enum { LEAST_BACKOFF = 16, MOST_BACKOFF = 1 << 16 };
/* Steps without a push until they are planned to have none: to plan takes what a second problem's empty kernels do in
 * as many. */
enum { QUIET_STEPS = 32 };
/* The same of islands that start cold: their weight updates part the iterations. */
enum { WARM_STEPS = 32 };
/* The same of hits, whose empty kernels take less. */
enum { CALM_STEPS = 256 };

/* Blocks of the dense contact solve of a size. */
struct ncp_block_memory {
    int32_t count;
    size_t bytes; /* of each, in device memory */
};

struct cuda_step {
    struct sadmm_cuda_collision *collision;
    int32_t bodies, slots, kinematic;
    bool uneven;                /* their masses are, since load (math/weight.h) */
    int32_t copies;             /* equal worlds that it is; 0: none of these */
    int32_t joints, joint_constraints, couplings, gears;
    bool tables;                /* some joint has one of a spring */
    int32_t articulations;      /* how many (articulation.cu); */
    size_t articulation_numbers, articulation_work; /* of all their structures and work, */
    size_t articulation_bytes;  /* the most that one has of both, where blocks have that in their own memory; else 0 */

    bool all_articulated;       /* all constraints are of articulations */
    bool apart;                 /* they are planned to be solved beside the rest (cuda_step_speculation) */
    int32_t untouched,
        backoff; /* steps that could have been so since one could not; that it takes for it to be tried */

    bool ncp_trees;             /* some of them are trees (ncp_plan.cu); */
    struct ncp_block_memory ncp_blocks[2]; /* that solve islands: by their warps, by themselves */
    bool unsolved;              /* planned: some islands are not solved before the iterations, which are made; */
    int32_t solved, solved_backoff; /* steps since one was; that it takes until it is planned that all are */

    bool pushes;                /* planned: islands are pushed apart, in a second problem (push.cu), */
    bool push_streams;          /* which has not fitted its partition once: tier STREAM */
    int32_t quiet;              /* but none has been for so many steps */
    struct sadmm_context *push; /* of that; made with the first one */

    bool cold;                  /* planned: some islands may start cold, and their weights are updated; */
    int32_t warm;               /* but none has for so many steps */

    bool hits_planned;          /* hits are searched for, where the world has any (takes_hits), */
    int32_t calm;               /* but no pair has been fast for so many steps */

    bool planned;               /* capacities, partition and speculation are for the world as it is */
    struct step_graphs graphs[2]; /* of steps without updates, and with (queue.cu) */
    struct cuda_step_speculation speculation;
    int64_t candidate_capacity, point_capacity;

    struct substep_plan plans[SADMM_MOST_SUBSTEPS];
    struct learned learned;
    struct sadmm_cuda_hits hits; /* of the (sub-)step that is being enqueued (takes_hits) */
    int64_t conservative;       /* so many steps more search for candidates in every sub-step: shapes left their
                                   reach */

    /* The queue: steps [seen, enqueued), at most STEPS_AHEAD. */
    struct queued_step queue[STEPS_AHEAD];
    int32_t update_capacity;    /* of each step, in PINNED_UPDATES */
    int64_t updated_steps;      /* steps with updates so far */
    int64_t enqueued, seen;
    int into;                   /* set and state the next step writes */

    struct cuda_step_report last; /* of the last step that was done, */
    struct sadmm_cuda_contact_counts now; /* contacts after it, or those that were put there since, */
    struct sadmm_settings last_settings;
    bool last_hits;               /* queued_step */
    double time;                  /* simulated until after it, s */
    int64_t done, repeats;
    int64_t mispredicted;       /* the last step that its partition did not fit; -1: none */
    int32_t offending_body;
};

template <class T> static inline T *buffer(const struct sadmm_context *c, enum cuda_buffer_name name)
{
    return (T *)c->buffers[name].data;
}

static inline struct cuda_step_report *step_reports(const struct sadmm_context *c)
{
    return buffer<struct cuda_step_report>(c, PINNED_REPORTS);
}

/* The next step is planned anew: there are no graphs of it. */
static inline void forget_graphs(struct cuda_step *s) { s->graphs[false].recorded = s->graphs[true].recorded = false; }

/* May hits of bodies in flight be taken at their moment (collide/hits_view.h)? Is that planned? */
static inline bool may_take_hits(const struct sadmm_context *c)
{
    return c->settings.hits > 0 && COLLISION(takes_hits)(c->step->collision);
}
static inline bool takes_hits(const struct sadmm_context *c) { return c->step->hits_planned && may_take_hits(c); }

/* Is there a stop rule to check? Then residuals say nothing: islands end at different times. */
static inline bool stop_rule_checked(const struct sadmm_context *c) { return c->fast && c->settings.tolerance > 0; }

/* The dense contact solve: an island by each block, where there are few; where there are more mechanisms than such
 * blocks, by each warp of a block, one a multiprocessor. Threads, or warps; blocks on a multiprocessor; bytes of their
 * memory there. Islands without joints are small work: of so many bodies a mechanism such blocks are still as fast. */
enum { NCP_LARGE_BLOCK = 256, NCP_LARGE_EACH = 2, NCP_LARGE_SHARED = 104 * 1024, NCP_LARGE_BODIES = 16 };
enum { NCP_WARPS = 16, NCP_WARPS_SHARED = 216 * 1024 };
cuda_kernel CUDA(ncp_block_kernel)(void); /* ncp_block.cu */
cuda_kernel CUDA(ncp_warp_kernel)(void);  /* ncp_warp.cu */
static inline bool has_large_ncp_blocks(const struct sadmm_context *c)
{
    const int32_t blocks = NCP_LARGE_EACH * c->multiprocessors;
    return c->step->articulations <= blocks && c->step->bodies / NCP_LARGE_BODIES <= blocks;
}

/* Are weights of islands that start cold updated? */
static inline bool updates_weights(const struct sadmm_context *c)
{
    return c->fast && plan_updates_weights(&c->settings, true, false, c->step->uneven);
}

/* Are small islands of worlds with joints solved before the iterations (ncp_island.h)? Where every constraint is of a
 * part. */
static inline bool solves_ncp(const struct sadmm_context *c)
{
    return c->fast && c->settings.warm_start && c->settings.ncp_points > 0 && c->step->articulations > 0 &&
           c->step->all_articulated && c->step->ncp_trees;
}

/* world.cu */
void CUDA(step_destroy)(struct sadmm_context *);
/* world.cu: what of the view depends on which state and set is written: by a sub-step of the step that ends in
 * `into`. */
void CUDA(view_into)(struct sadmm_context *, int into, int substep);
/* world.cu: counts and settings of the view; pairs: capacity. */
void CUDA(view_counts)(struct sadmm_context *, int64_t pairs);
/* world.cu */
sadmm_status CUDA(clear_abort)(struct sadmm_context *, struct sadmm_error *error);
/* speculation.cu: what the next step and those like it need. Nothing is running. */
sadmm_status CUDA(speculate)(struct sadmm_context *, struct sadmm_error *error);
/* speculation.cu: some pair is fast. */
void CUDA(plan_hits)(struct sadmm_context *);
/* speculation.cu: the plan of a step, of this many pairs and points with these statistics, or a sub-step. */
struct substep_plan CUDA(plan_of)(const struct sadmm_context *, int32_t pairs, int32_t points,
                                  const struct cuda_graph_statistics *statistics,
                                  const struct cuda_joint_counts *joints);
/* speculation.cu: may bodies that joints join be solved beside the rest, if nothing touches them? By settings and
 * plan. */
bool CUDA(may_be_apart)(const struct sadmm_context *);
/* speculation.cu: *a becomes what a partition for both needs. */
void CUDA(merge_statistics)(struct cuda_graph_statistics *a, const struct cuda_graph_statistics *b);
/* record.cu: where there are hits, what a (sub-)step begins with after them is what it begins with from here on; */
sadmm_status CUDA(enqueue_hits)(struct sadmm_context *, int substep, struct sadmm_error *error);
/* record.cu: contacts, up to the gate. */
sadmm_status CUDA(enqueue_find)(struct sadmm_context *, int substep, struct sadmm_error *error);
/* record.cu: the graph of a step that writes state and set `into`; with_updates: its updates come first. */
sadmm_status CUDA(record_step)(struct sadmm_context *, bool with_updates, int into, struct sadmm_error *error);
/* read.cu: the report of the last step that was done. */
void CUDA(report_step)(const struct sadmm_context *, struct sadmm_resident_report *out);

/* kernels.cu, finish.cu: launches of the step's own kernels. */
sadmm_status CUDA(launch_updates)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_start)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_turn)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_admit)(struct sadmm_context *, struct sadmm_error *error);
/* first: of the kernels behind the iterations. */
sadmm_status CUDA(launch_finish)(struct sadmm_context *, bool first, struct sadmm_error *error);
sadmm_status CUDA(launch_commit)(struct sadmm_context *, struct sadmm_error *error);

/* kinematic.cu: take over a world's kinematic bodies; where they are; */
sadmm_status CUDA(load_kinematic)(struct sadmm_context *, const struct sadmm_resident_world *,
                                  struct sadmm_error *error);
void CUDA(view_kinematic)(struct sadmm_context *, int into);
/* their velocities and poses as the step begins; once islands are known, what these ride on; */
sadmm_status CUDA(launch_kinematic_start)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_support)(struct sadmm_context *, struct sadmm_error *error);
/* and the end of a (sub-)step: poses, and what contacts give them. */
sadmm_status CUDA(launch_kinematic_finish)(struct sadmm_context *, struct sadmm_error *error);

/* push_view.due: not 0: some island is pushed; not 0: the second problem does not fit its partition; its pairs that
 * carry an impulse; bits of enum push_kind, 0: there is none. */
enum push_number { PUSH_DUE, PUSH_MISPREDICTED, PUSH_WARM_PAIRS, PUSH_KIND, PUSH_NUMBERS };
/* The second problem is a cold one or a warm one, which its contacts say: it is recorded as both. */
enum push_kind { PUSH_COLD = 1, PUSH_WARM = 2, PUSH_ANY = PUSH_COLD | PUSH_WARM };

/* push.cu: memory; where it is, once the plan of the sub-step is made; that of the second problem, by it; */
sadmm_status CUDA(reserve_push)(struct sadmm_context *, struct sadmm_error *error);
void CUDA(view_push)(struct sadmm_context *);
void CUDA(plan_second)(struct sadmm_context *, bool warm);
/* of what kind it is (first: gathered just now); its kernels from here on work if it is one of these; */
sadmm_status CUDA(launch_push_kind)(struct sadmm_context *, bool first, int kinds, struct sadmm_error *error);
/* which islands are pushed, once A and b and the layout are made, before contacts are;
 * the second problem, after finish and the launch of move_again; and what bodies move by when it is solved. */
sadmm_status CUDA(launch_push_choice)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_push_gather)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_push_move)(struct sadmm_context *, struct sadmm_error *error);
/* kernels.cu: bodies that have to be moved again, where some are pushed, before commit or turn would. */
sadmm_status CUDA(launch_move_again)(struct sadmm_context *, struct sadmm_error *error);

/* gears.cu: the same for gears, of which joints.cu sees to all of this: */
sadmm_status CUDA(load_gears)(struct sadmm_context *, const struct sadmm_resident_world *, struct sadmm_error *error);
void CUDA(view_gears)(struct sadmm_context *, int into, int substep);
sadmm_status CUDA(launch_gear_rows)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_gear_solution)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(read_gears)(struct sadmm_context *, double *force, struct sadmm_error *error);

/* joints.cu: take over a world's joints; where they are in a sub-step of the step that ends in `into`. */
sadmm_status CUDA(load_joints)(struct sadmm_context *, const struct sadmm_resident_world *, struct sadmm_error *error);
void CUDA(view_joints)(struct sadmm_context *, int into, int substep);
/* joints.cu: rows of the (sub-)step; what its solution says of joints. */
sadmm_status CUDA(launch_joint_rows)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_joint_solution)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_joint_momentum)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(launch_joint_move)(struct sadmm_context *, struct sadmm_error *error);
/* articulation_memory.cu: the same for articulations; what depends on the number of pairs. */
sadmm_status CUDA(load_articulations)(struct sadmm_context *, const struct sadmm_resident_world *,
                                      struct sadmm_error *error);
void CUDA(view_articulations)(struct sadmm_context *);
sadmm_status CUDA(reserve_articulations)(struct sadmm_context *, struct sadmm_error *error);
/* articulation.cu: their block direct solve, before the iterations and after them. Where parts are small they find
 * their contacts themselves, once pair_parts has run; else by the layout. */
sadmm_status CUDA(launch_articulations)(struct sadmm_context *, bool after, struct sadmm_error *error);
sadmm_status CUDA(launch_pair_parts)(struct sadmm_context *, struct sadmm_error *error);
cudaError_t CUDA(articulation_allow)(int shared_limit); /* once a device */
/* joint_close.cu: parts whose joints are off by more than they may be are closed, once their islands are known. */
sadmm_status CUDA(launch_joint_close)(struct sadmm_context *, struct sadmm_error *error);
cudaError_t CUDA(joint_close_allow)(int shared_limit);
size_t CUDA(articulation_shared_size)(void); /* of a block, beside the part's own */
static inline bool articulations_are_small(const struct sadmm_context *c) { return c->step->articulation_bytes > 0; }

struct sadmm_articulation_order;
/* ncp_plan.cu: trees of articulations; memory; where it is. */
sadmm_status CUDA(load_ncp)(struct sadmm_context *, int32_t first_gear, const struct sadmm_articulation_order *order,
                            struct sadmm_error *error);
sadmm_status CUDA(reserve_ncp)(struct sadmm_context *, struct sadmm_error *error);
void CUDA(view_ncp)(struct sadmm_context *);
/* ncp_solve.cu: islands, before the iterations and what is left after them; whether there are such, if it was planned
 * that there are none; and what is solved is put where iterations begin and where the end of the step reads it. */
sadmm_status CUDA(launch_ncp)(struct sadmm_context *, bool after, struct sadmm_error *error);
sadmm_status CUDA(launch_ncp_check)(struct sadmm_context *, bool after, struct sadmm_error *error);
sadmm_status CUDA(launch_ncp_put)(struct sadmm_context *, struct sadmm_error *error);
cudaError_t CUDA(ncp_allow)(int shared_limit); /* once a device */

#endif
