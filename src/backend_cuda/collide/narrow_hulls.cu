/* The narrow phase of worlds with convex hulls: two kernels, apart from those of other worlds, which would be slower with
 * all that this needs of registers and stack.
 *
 * Most pairs with a hull take little: they go on as they were, or are too far apart. The few others (a twentieth in a
 * heap) take ten times as long, and a warp with one of them would wait for it: so they are listed, and done together, in
 * as many warps as run at once: no two of them go the same way for long. The list has no order; what is found does not
 * depend on it.
 */
#define SADMM_WITHOUT_SMOOTH
#include "narrow_listed.h"

template <int FOR>
static __global__ void __launch_bounds__(NARROW_THREADS, NARROW_BLOCKS)
at_once_kernel(const __grid_constant__ collision_view v)
{
    const int64_t i = collision_thread(NARROW_THREADS);
    if (i < (int64_t)v.candidate_capacity + SIZES_BEYOND && !narrow_candidate<FOR, NARROW_AT_ONCE>(v, i))
        v.listed[atomicAdd(v.candidate_count + 1, 1ull)] = (int32_t)i;
}

void COLLISION(narrow_hulls_kernels)(struct collision_kernels *kernels)
{
    kernels->hulls = {at_once_kernel<NARROW_ONE>, NARROW_THREADS, 0, "narrow phase of hulls"};
    kernels->hulls_first = {at_once_kernel<NARROW_FIRST>, NARROW_THREADS, 0, "narrow phase of hulls"};
    kernels->hulls_again = {at_once_kernel<NARROW_AGAIN>, NARROW_THREADS, 0, "narrow phase of hulls"};
    kernels->listed = {listed_kernel<NARROW_ONE>, NARROW_THREADS, 0, "narrow phase of listed pairs"};
    kernels->listed_first = {listed_kernel<NARROW_FIRST>, NARROW_THREADS, 0, "narrow phase of listed pairs"};
    kernels->listed_again = {listed_kernel<NARROW_AGAIN>, NARROW_THREADS, 0, "narrow phase of listed pairs"};
}
