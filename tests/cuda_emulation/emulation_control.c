#include "emulation_control.h"

#include "backend_cuda/table/tables.h"

#define CUDA(name) sadmm_cuda_##name##_emulated_f32
#include "backend_cuda/device/entries.h"
#undef CUDA
#define CUDA(name) sadmm_cuda_##name##_emulated_f64
#include "backend_cuda/device/entries.h"
#undef CUDA

int cuda_emulation_descending;
long cuda_emulation_calls_left = -1;
int cuda_emulation_lost;
long cuda_emulation_allocations;
long cuda_emulation_graphs_made, cuda_emulation_waits;

const struct sadmm_kernels cuda_emulation_tables[2] = {
    [SADMM_F32] = CUDA_TABLE(_emulated_f32, SADMM_F32),
    [SADMM_F64] = CUDA_TABLE(_emulated_f64, SADMM_F64),
};

void cuda_emulation_force_tier(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                               enum sadmm_cuda_tier tier)
{
    if (kernels->precision == SADMM_F32) sadmm_cuda_set_tier_emulated_f32(context, tier);
    else sadmm_cuda_set_tier_emulated_f64(context, tier);
}

void cuda_emulation_force_cluster(const struct sadmm_kernels *kernels, struct sadmm_context *context, int blocks)
{
    if (kernels->precision == SADMM_F32) sadmm_cuda_set_cluster_emulated_f32(context, blocks);
    else sadmm_cuda_set_cluster_emulated_f64(context, blocks);
}

enum sadmm_cuda_tier cuda_emulation_tier_of(const struct sadmm_kernels *kernels, const struct sadmm_context *context,
                                            int32_t *blocks)
{
    return kernels->precision == SADMM_F32 ? sadmm_cuda_get_tier_emulated_f32(context, blocks)
                                           : sadmm_cuda_get_tier_emulated_f64(context, blocks);
}

void cuda_emulation_tune_capacities(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                    int64_t first_capacity)
{
    if (kernels->precision == SADMM_F32) sadmm_cuda_tune_capacities_emulated_f32(context, first_capacity);
    else sadmm_cuda_tune_capacities_emulated_f64(context, first_capacity);
}
