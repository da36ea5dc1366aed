/* The fused iteration (persistent.h): which instance runs, and what it takes. */
#include "iterate.h"
#include "persistent.h"

/* Rows take registers that blocks of more threads do not have. */
int CUDA(persistent_threads)(int point_slots, bool rows)
{
    return most_threads(point_slots <= 4 ? 4 : 8, rows ? (int)WITH_ROWS : (int)ANY_SIZE);
}

int CUDA(persistent_small_threads)(void) { return SMALL_THREADS; }

size_t CUDA(persistent_shared)(enum sadmm_cuda_tier tier, int row_constraints, int threads, int32_t most_bodies)
{
    part_memory unused;
    return lay_out(&unused, nullptr, tier == SADMM_CUDA_TIER_CLUSTER, row_constraints, threads, most_bodies);
}

bool CUDA(persistent_does_prologue)(const struct cuda_partition *partition)
{
    return partition->tier == SADMM_CUDA_TIER_BLOCK && partition->threads <= SMALL_THREADS;
}

static persistent_instances instances_of(enum sadmm_cuda_tier tier)
{
    const persistent_instances none = {nullptr, 0};
    switch (tier) {
    case SADMM_CUDA_TIER_BLOCK: return CUDA(block_instances)();
    case SADMM_CUDA_TIER_CLUSTER: return CUDA(cluster_instances)();
    case SADMM_CUDA_TIER_GRID: return CUDA(grid_instances)();
    default: return none;
    }
}

cuda_kernel CUDA(persistent_kernel)(int point_slots, enum sadmm_cuda_tier tier, int threads, bool rows, bool fast,
                                    const char **name)
{
    const persistent_instances all = instances_of(tier);
    for (size_t k = 0; k < all.count; ++k) {
        const persistent_instance &one = all.first[k];
        if (!one.kernel || one.points < point_slots || one.threads < threads) continue;
        if (one.rows != rows || one.fast != fast) continue;
        *name = one.name;
        return one.kernel;
    }
    return nullptr;
}

/* Let the instances of a tier use `bytes` of shared memory a block. */
static cudaError_t allow_shared(enum sadmm_cuda_tier tier, int bytes)
{
    const persistent_instances all = instances_of(tier);
    cudaError_t code = cudaSuccess;
    for (size_t k = 0; k < all.count && code == cudaSuccess; ++k) {
        const void *kernel = (const void *)all.first[k].kernel;
        if (kernel) code = cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes);
    }
    return code;
}

/* Clusters of more than 8 blocks, if the code has cluster barriers: what was compiled for earlier devices
 * (__CUDA_ARCH__ in persistent.h) has none, wherever it runs. */
static cudaError_t allow_clusters(bool *clusters)
{
    const persistent_instances all = CUDA(cluster_instances)();
    cudaError_t code = cudaSuccess;
    for (size_t k = 0; k < all.count && code == cudaSuccess && *clusters; ++k) {
        const void *kernel = (const void *)all.first[k].kernel;
        if (!kernel) continue;
        cudaFuncAttributes about = {};
        code = cudaFuncGetAttributes(&about, kernel);
        *clusters = code == cudaSuccess && about.ptxVersion >= CLUSTER_ARCH / 10;
        if (*clusters) code = cudaFuncSetAttribute(kernel, cudaFuncAttributeNonPortableClusterSizeAllowed, 1);
    }
    return code;
}

cudaError_t CUDA(persistent_allow)(int bytes, bool device_has_clusters, bool *clusters)
{
    *clusters = device_has_clusters;
    for (enum sadmm_cuda_tier tier : {SADMM_CUDA_TIER_BLOCK, SADMM_CUDA_TIER_CLUSTER, SADMM_CUDA_TIER_GRID}) {
        const cudaError_t code = allow_shared(tier, bytes);
        if (code != cudaSuccess) return code;
    }
    return allow_clusters(clusters);
}
