/* Seams by a kernel of their own (narrow_seams.h): with hulls and meshes, and where hits come between them and the
 * narrow phase. */
#include "narrow_seams.h"

static __global__ void __launch_bounds__(NARROW_THREADS) seam_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_only_if(v.pdl);
    const int64_t i = collision_thread(NARROW_THREADS);
    if (i < usable_candidates(v)) hide_seams(v, i);
}

void COLLISION(seam_kernels)(struct collision_kernels *kernels)
{
    kernels->seams = {seam_kernel, NARROW_THREADS, 0, "seams"};
}
