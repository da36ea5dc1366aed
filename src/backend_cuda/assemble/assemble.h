/* Bodies, contacts and rows into the solver's form: what other folders call. Launches only, but for the memory of
 * rows. */
#ifndef SADMM_CUDA_ASSEMBLE_ASSEMBLE_H
#define SADMM_CUDA_ASSEMBLE_ASSEMBLE_H

#include "backend_cuda/device/context.h"

/* assemble.cu: A, b and the start velocities: they need no contacts. */
sadmm_status CUDA(enqueue_bodies)(struct sadmm_context *, struct sadmm_error *error);

/* rows.cu: constraints given by rows, as core has them: bytes of `count` constraints; where they are; to the device. */
size_t CUDA(raw_row_bytes)(int32_t count);
void CUDA(bind_raw_rows)(struct sadmm_context *, void *memory);
sadmm_status CUDA(upload_rows)(struct sadmm_context *, struct sadmm_error *error);

#endif
