/* The CUDA backend's two tables, and whether this machine can run them. */
#include "core/solve/backends.h"
#include "tables.h"
#include "backend_cuda/device/tier.h"

#define CUDA(name) sadmm_cuda_##name##_f32
#include "backend_cuda/device/entries.h"
#undef CUDA
#define CUDA(name) sadmm_cuda_##name##_f64
#include "backend_cuda/device/entries.h"
#undef CUDA

static const struct sadmm_kernels tables[2] = {
    [SADMM_F32] = CUDA_TABLE(_f32, SADMM_F32),
    [SADMM_F64] = CUDA_TABLE(_f64, SADMM_F64),
};

const struct sadmm_kernels *sadmm_cuda_find(sadmm_precision precision, const char **reason)
{
    bool found = precision == SADMM_F32 ? sadmm_cuda_probe_f32(reason) : sadmm_cuda_probe_f64(reason);
    return found ? &tables[precision] : NULL;
}

void sadmm_cuda_force_tier(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                           enum sadmm_cuda_tier tier)
{
    if (kernels->precision == SADMM_F32) sadmm_cuda_set_tier_f32(context, tier);
    else sadmm_cuda_set_tier_f64(context, tier);
}

void sadmm_cuda_force_cluster(const struct sadmm_kernels *kernels, struct sadmm_context *context, int blocks)
{
    if (kernels->precision == SADMM_F32) sadmm_cuda_set_cluster_f32(context, blocks);
    else sadmm_cuda_set_cluster_f64(context, blocks);
}

enum sadmm_cuda_tier sadmm_cuda_tier_of(const struct sadmm_kernels *kernels, const struct sadmm_context *context,
                                        int32_t *blocks)
{
    return kernels->precision == SADMM_F32 ? sadmm_cuda_get_tier_f32(context, blocks)
                                           : sadmm_cuda_get_tier_f64(context, blocks);
}

void sadmm_cuda_tune_capacities(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                int64_t first_capacity)
{
    if (kernels->precision == SADMM_F32) sadmm_cuda_tune_capacities_f32(context, first_capacity);
    else sadmm_cuda_tune_capacities_f64(context, first_capacity);
}
