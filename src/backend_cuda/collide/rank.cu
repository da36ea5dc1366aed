/* Few candidates in order: a key's place is the number of smaller keys (keys are unique). RANK_KEYS keys a block; the
 * others come through shared memory, where every thread of a warp reads the same one, and each warp counts a share of
 * them. The work grows with the square of the number, but it is one launch, and the whole chip's.
 */
#include "view.h"

struct ranking {
    uint64_t keys[RANK_CHUNK];
    int32_t smaller[RANK_SHARES][RANK_KEYS];
};

static __global__ void __launch_bounds__(RANK_KEYS *RANK_SHARES) rank_kernel(const __grid_constant__ collision_view v)
{
    COLLISION_SHARED(ranking, shared);
    const int32_t found = usable_candidates(v), t = (int32_t)threadIdx.x;
    const int32_t lane = t % RANK_KEYS, share = t / RANK_KEYS;
    const int32_t first = (int32_t)blockIdx.x * RANK_KEYS, own = first + lane;
    int32_t smaller = 0;
    if (first >= found) return;
    const uint64_t key = own < found ? v.found[own] : 0;
    for (int32_t base = 0; base < found; base += RANK_CHUNK) {
        const int32_t left = found - base < RANK_CHUNK ? found - base : RANK_CHUNK;
        const int32_t each = (left + RANK_SHARES - 1) / RANK_SHARES;
        for (int32_t k = t; k < each * RANK_SHARES; k += RANK_KEYS * RANK_SHARES)
            shared.keys[k] = k < left ? v.found[base + k] : ~UINT64_C(0);
        __syncthreads();
        for (int32_t k = share * each; k < (share + 1) * each; ++k) smaller += shared.keys[k] < key;
        __syncthreads();
    }
    shared.smaller[share][lane] = smaller;
    __syncthreads();
    if (share > 0 || own >= found) return;
    for (int k = 1; k < RANK_SHARES; ++k) smaller += shared.smaller[k][lane];
    v.candidates[smaller] = key;
}

void COLLISION(sort_kernels)(struct collision_kernels *kernels)
{
    kernels->rank = {rank_kernel, RANK_KEYS * RANK_SHARES, sizeof(struct ranking), "ranking of the candidates"};
}
