/* Iterations in any tier, and what is measured of them: what other sources call. Launches only. */
#ifndef SADMM_CUDA_ITERATE_ITERATE_H
#define SADMM_CUDA_ITERATE_ITERATE_H

#include "backend_cuda/device/context.h"

/* ---- iterate.cu, residuals.cu, stop_rule.cu, energy_limit.cu ---- */

/* Iterations, as the entry; limit: what is wanted for the energy limit after the last. */
sadmm_status CUDA(enqueue_iterations)(struct sadmm_context *, int count, bool goes_on, bool measure,
                                      enum cuda_energy_limit limit, struct sadmm_error *error);
/* (16) and (17) of the iteration that was measured, into view.iteration.residual. */
sadmm_status CUDA(enqueue_residuals)(struct sadmm_context *, struct sadmm_error *error);
/* fast: the bodies' momentum residuals, recomputed. */
sadmm_status CUDA(enqueue_momentum_residuals)(struct sadmm_context *, struct sadmm_error *error);
/* fast: (17), as a maximum with what view.iteration.residual[1] is. */
sadmm_status CUDA(enqueue_momentum_residual)(struct sadmm_context *, struct sadmm_error *error);
/* fast: a convergence check after `done` iterations of a step. */
sadmm_status CUDA(enqueue_convergence_check)(struct sadmm_context *, int done, struct sadmm_error *error);
/* fast: by what islands are to be slowed down (slow.h), and how many, in *view.islands.limited. `candidates`: the
 * iterations have found whether there are any. */
/* Before the energy limit: islands that kinematic bodies push are left alone, if there are any. */
sadmm_status CUDA(enqueue_pushed)(struct sadmm_context *, struct sadmm_error *error);
/* motions: once it is known what is anchored; before the energy limit. */
sadmm_status CUDA(enqueue_motions)(struct sadmm_context *, struct sadmm_error *error);
sadmm_status CUDA(enqueue_energy_limit)(struct sadmm_context *, bool candidates, struct sadmm_error *error);

/* ---- streamed.cu ---- */

/* STREAM. fast, goes_on: none of them is the batch's last. */
sadmm_status CUDA(stream_iterations)(struct sadmm_context *, int count, bool measure, bool goes_on,
                                     struct sadmm_error *error);
/* Before weight updates: the last iteration of a batch that goes on for islands that start warm. */
sadmm_status CUDA(parting_iteration)(struct sadmm_context *, struct sadmm_error *error);
/* Before a measured iteration: its primal residual. */
sadmm_status CUDA(clear_primal)(struct sadmm_context *, bool measure, struct sadmm_error *error);

/* ---- persistent.cu ---- */

/* The instance of the persistent kernel for a tier (rows: there are constraints given by rows); the most threads of a
 * block, and of one whose threads have all the registers they want; bytes of shared memory. */
cuda_kernel CUDA(persistent_kernel)(int point_slots, enum sadmm_cuda_tier tier, int threads, bool rows, bool fast,
                                    const char **name);
int CUDA(persistent_threads)(int point_slots, bool rows);
int CUDA(persistent_small_threads)(void);
size_t CUDA(persistent_shared)(enum sadmm_cuda_tier tier, int row_constraints, int threads, int32_t most_bodies);
/* Whether the instance for a partition, without constraints given by rows, does the prologue and the epilogue of a
 * step of `fast`, too. */
bool CUDA(persistent_does_prologue)(const struct cuda_partition *);
/* Let every instance use `bytes` of shared memory a block, and clusters of more than 8 blocks. *clusters: whether both
 * the device and the code that was loaded for it know clusters. */
cudaError_t CUDA(persistent_allow)(int bytes, bool device_has_clusters, bool *clusters);

/* ---- timings.cu ---- */

/* Of the context's device: measured by the first context that asks, then kept. */
cuda_timings CUDA(timings)(const struct sadmm_context *);

/* ---- partition.cu ---- */

/* The tier and its thread blocks, from the statistics of this step (or of one like it), the plan and the device. */
sadmm_status CUDA(choose_partition)(struct sadmm_context *, const struct cuda_graph_statistics *statistics,
                                    struct cuda_partition *partition, struct sadmm_error *error);
/* Fewer threads, where the layout made for it has smaller parts (statistics->part_sides, part_bodies) than could be
 * known. */
void CUDA(tighten_partition)(const struct sadmm_context *, const struct cuda_graph_statistics *statistics,
                             struct cuda_partition *partition);

#endif
