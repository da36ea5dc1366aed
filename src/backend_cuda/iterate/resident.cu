/* The fused iteration (iterate/resident.h) of the method `paper`, and which instance runs. */
#include "resident.h"

int CUDA(resident_threads)(int point_slots) { return most_threads(point_slots <= 4 ? 4 : 8, ANY_SIZE); }

size_t CUDA(resident_shared)(enum sadmm_cuda_tier tier, int threads, int32_t most_bodies, bool row_blocks)
{
    part_memory unused;
    return lay_out(&unused, nullptr, tier == SADMM_CUDA_TIER_CLUSTER, threads, most_bodies, row_blocks);
}

static const resident_instance paper_instances[] = {METHOD(false, "")};

bool CUDA(resident_does_ends)(const struct cuda_partition *partition)
{
    return partition->tier == SADMM_CUDA_TIER_BLOCK && partition->threads <= SMALL_THREADS;
}

struct instances {
    const resident_instance *first;
    size_t count;
};

static instances instances_of(bool fast)
{
    instances all = {paper_instances, sizeof paper_instances / sizeof *paper_instances};
    if (fast) all.first = CUDA(fast_instances)(&all.count);
    return all;
}

cuda_kernel CUDA(resident_kernel)(int contact_rows, int point_slots, enum sadmm_cuda_tier tier, int threads,
                                  bool full, bool fast, const char **name)
{
    int rows = contact_rows == 1 ? 1 : 3, points = point_slots <= 4 ? 4 : 8;
    int size = full || threads > SMALL_THREADS             ? ANY_SIZE
               : tier == SADMM_CUDA_TIER_BLOCK && threads == WARP ? ONE_WARP
                                                                 : SMALL;
    const instances all = instances_of(fast);
    for (size_t k = 0; k < all.count; ++k) {
        const resident_instance &one = all.first[k];
        if (one.contact_rows != rows || one.points != points || one.tier != tier || one.full != full ||
            one.size != size)
            continue;
        *name = one.name;
        return one.kernel;
    }
    return nullptr;
}

/* One instance, as below. */
static cudaError_t allow(const resident_instance &one, int bytes, bool *clusters)
{
    const void *kernel = (const void *)one.kernel;
    cudaError_t code = cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes);
    if (code != cudaSuccess || one.tier != SADMM_CUDA_TIER_CLUSTER || !*clusters) return code;
    /* What was compiled for earlier devices (__CUDA_ARCH__ in iterate/resident.h) has no cluster barriers, wherever it
     * runs. */
    cudaFuncAttributes about = {};
    code = cudaFuncGetAttributes(&about, kernel);
    if (code != cudaSuccess) return code;
    *clusters = about.ptxVersion >= CLUSTER_ARCH / 10;
    return *clusters ? cudaFuncSetAttribute(kernel, cudaFuncAttributeNonPortableClusterSizeAllowed, 1) : cudaSuccess;
}

cudaError_t CUDA(resident_allow)(int bytes, bool device_has_clusters, bool *clusters)
{
    cudaError_t code = cudaSuccess;
    *clusters = device_has_clusters;
    for (int fast = 0; fast < 2; ++fast) {
        const instances all = instances_of(fast);
        for (size_t k = 0; k < all.count && code == cudaSuccess; ++k) code = allow(all.first[k], bytes, clusters);
    }
    return code;
}
