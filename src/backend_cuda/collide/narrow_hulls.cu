/* The narrow phase of worlds with convex hulls, without meshes and smooth bodies. */
#define SADMM_WITHOUT_SMOOTH
#define SADMM_WITHOUT_MESHES
#include "narrow_listed.h"

void COLLISION(narrow_hulls_kernels)(struct collision_kernels *kernels)
{
    struct narrow_kernels *k = &kernels->with_hulls;
    k->at_once = k->at_once_first = k->at_once_again = {at_once_kernel<NARROW_ANY, NARROW_HULLS_AT_ONCE>,
                                                        NARROW_THREADS, 0, "narrow phase of hulls"};
    k->listed = {listed_kernel<NARROW_ANY, NARROW_HULLS_LISTED>, NARROW_THREADS, 0, "narrow phase of listed pairs"};
}
