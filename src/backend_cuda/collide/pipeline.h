/* Contact finding on a CUDA device: the interface.
 *
 * A pipeline keeps two sets of contacts on the device, in core's own structs: the current one and the one before it.
 * The solver may write impulses into the current one in place; the next find carries them over. All entries may be
 * called with any device current and leave it so. `stream` is a cudaStream_t of the pipeline's device; one after
 * another, the calls on a pipeline are ordered by the caller. There is no global state: pipelines are independent.
 */
#ifndef SADMM_CUDA_COLLIDE_PIPELINE_H
#define SADMM_CUDA_COLLIDE_PIPELINE_H

#include "find.h"

#include "entries.h"

#endif
