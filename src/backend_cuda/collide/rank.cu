/* Few candidates in order: a key's place is the number of smaller keys (keys are unique). RANK_KEYS keys a block; the
 * others come through shared memory, where every thread of a warp reads the same one, and each warp counts a share of
 * them. The work grows with the square of the number, but it is one launch, and the whole chip's.
 */
#include "view.h"

struct ranking {
    uint64_t keys[RANK_CHUNK];
    int32_t smaller[RANK_SHARES][RANK_KEYS];
};

/* A thread's share of the keys from `base` on. */
enum { RANK_STAGED = RANK_CHUNK / (RANK_KEYS * RANK_SHARES) };
static __device__ __forceinline__ void stage(const collision_view &v, int32_t base, uint64_t staged[RANK_STAGED])
{
    for (int k = 0; k < RANK_STAGED; ++k) {
        const int32_t at = base + (int32_t)threadIdx.x + k * RANK_KEYS * RANK_SHARES;
        staged[k] = v.found[at < v.candidate_capacity ? at : 0];
    }
}

static __global__ void __launch_bounds__(RANK_KEYS *RANK_SHARES) rank_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(ranking, shared);
    const int32_t t = (int32_t)threadIdx.x, lane = t % RANK_KEYS, share = t / RANK_KEYS;
    const int32_t first = (int32_t)blockIdx.x * RANK_KEYS, own = first + lane;
    uint64_t staged[RANK_STAGED];
    int32_t smaller = 0;
    /* the first keys before it is known how many there are: what lies beyond them may be anything */
    stage(v, 0, staged);
    const uint64_t key = v.found[own < v.candidate_capacity ? own : 0];
    const int32_t found = usable_candidates(v);
    if (first >= found) return;
    for (int32_t base = 0; base < found; base += RANK_CHUNK) {
        const int32_t left = found - base < RANK_CHUNK ? found - base : RANK_CHUNK;
        const int32_t each = (left + RANK_SHARES - 1) / RANK_SHARES;
        if (base > 0) stage(v, base, staged);
        for (int k = 0; k < RANK_STAGED; ++k) {
            const int32_t at = t + k * RANK_KEYS * RANK_SHARES;
            shared.keys[at] = at < left ? staged[k] : ~UINT64_C(0);
        }
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
