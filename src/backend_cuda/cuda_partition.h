/* How a step is split among thread blocks. */
#ifndef SADMM_CUDA_PARTITION_H
#define SADMM_CUDA_PARTITION_H

#include "cuda_internal.h"

/* The tier and its parts, from the facts of this step's constraint graph (or of the one before). */
sadmm_status CUDA(choose_partition)(struct sadmm_context *, const struct cuda_facts *facts, struct cuda_partition *out,
                                    struct sadmm_error *error);

#endif
