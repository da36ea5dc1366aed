/* Penalties, weights and factors: what other folders call. Launches only. */
#ifndef SADMM_CUDA_WEIGHT_WEIGHT_H
#define SADMM_CUDA_WEIGHT_WEIGHT_H

#include "backend_cuda/device/context.h"

/* ---- penalty.cu ---- */

/* Of a whole step: penalties and factors at once, and whether it is what was planned for. fast: islands first;
 * c->prologue: all of it is left to the iterating kernel, and to the last two. */
sadmm_status CUDA(enqueue_penalties)(struct sadmm_context *, struct sadmm_error *error);
/* fast: weights from the multipliers found so far; then C and, for `factor`, H. */
sadmm_status CUDA(enqueue_weights)(struct sadmm_context *, bool factor, struct sadmm_error *error);
/* (15) by view.iteration.residual. */
sadmm_status CUDA(enqueue_balance)(struct sadmm_context *, struct sadmm_error *error);

/* ---- weights.cu ---- */

/* fast: a solve begins: its first weights come next. */
void CUDA(begin_weights)(struct sadmm_context *);
/* fast: what weights of islands depend on beside the islands. */
cuda_args CUDA(weight_args)(const struct sadmm_context *);
/* fast: of constraints given by rows what responds to them, once a solve, when they and the bodies are assembled. */
sadmm_status CUDA(enqueue_row_responses)(struct sadmm_context *, struct sadmm_error *error);
/* fast: sums over islands, their weight scales, and B of constraints given by rows. */
sadmm_status CUDA(enqueue_islands)(struct sadmm_context *, struct sadmm_error *error);
/* fast: the loads of pairs as they are now, then islands again. */
sadmm_status CUDA(enqueue_loads)(struct sadmm_context *, struct sadmm_error *error);

#endif
