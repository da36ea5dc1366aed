/* The layout of the constraint graph (device/layout.h): what other folders call. Counts and capacities in the view,
 * then reserve_layout (it allocates); then per step, by enqueueing only: statistics and layout of what view.raw points
 * to. */
#ifndef SADMM_CUDA_GRAPH_GRAPH_H
#define SADMM_CUDA_GRAPH_GRAPH_H

#include "backend_cuda/device/context.h"
#include "layout_kernels.h"

sadmm_status CUDA(reserve_layout)(struct sadmm_context *, struct sadmm_error *error);
/* The statistics; islands: also which bodies hang together (what BLOCK and CLUSTER need). */
sadmm_status CUDA(enqueue_statistics)(struct sadmm_context *, bool islands, struct sadmm_error *error);
/* Slots, offsets, incident, parts. A part that exceeds what the partition allows sets live->abort_code =
 * ABORT_PARTITION. */
sadmm_status CUDA(enqueue_layout)(struct sadmm_context *, const struct cuda_partition *, struct sadmm_error *error);
/* Both in one go; small scenes: in one kernel. */
sadmm_status CUDA(enqueue_statistics_and_layout)(struct sadmm_context *, bool islands, const struct cuda_partition *,
                                                 struct sadmm_error *error);
/* The plan's counts to the device. */
sadmm_status CUDA(upload_live)(struct sadmm_context *, enum cuda_abort, struct sadmm_error *error);
/* Wait for what the device knows now. */
sadmm_status CUDA(download_known)(struct sadmm_context *, struct cuda_known *out, struct sadmm_error *error);

#endif
