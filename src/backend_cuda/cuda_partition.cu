/* The choice of a tier and of its parts. */
#include "cuda_partition.h"

sadmm_status CUDA(choose_partition)(struct sadmm_context *c, const struct cuda_facts *, struct cuda_partition *out,
                                    struct sadmm_error *error)
{
    if (c->wanted != SADMM_CUDA_TIER_AUTO && c->wanted != SADMM_CUDA_TIER_STREAM)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "the cuda tier asked for: only STREAM so far");
    *out = {};
    out->tier = SADMM_CUDA_TIER_STREAM;
    return SADMM_OK;
}
