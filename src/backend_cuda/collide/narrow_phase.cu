/* Candidates to manifolds: the last step's pair, for its cache, then the pair's manifold in the frame of b. */
#define SADMM_WITHOUT_SMOOTH
#include "narrow.h"

template <int FOR>
static __global__ void __launch_bounds__(NARROW_THREADS, NARROW_BLOCKS)
narrow_kernel(const __grid_constant__ collision_view v)
{
    follow_if(v.early);
    const int64_t i = collision_thread(NARROW_THREADS);
    if (i < (int64_t)v.candidate_capacity + SIZES_BEYOND) narrow_candidate<FOR, NARROW_PLAIN>(v, i, nullptr);
}

void COLLISION(narrow_phase_kernels)(struct collision_kernels *kernels)
{
    kernels->narrow = {narrow_kernel<NARROW_ONE>, NARROW_THREADS, 0, "narrow phase"};
    kernels->narrow_first = {narrow_kernel<NARROW_FIRST>, NARROW_THREADS, 0, "narrow phase"};
    kernels->narrow_again = {narrow_kernel<NARROW_AGAIN>, NARROW_THREADS, 0, "narrow phase"};
}
