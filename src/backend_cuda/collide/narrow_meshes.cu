/* The narrow phase of worlds with meshes and without smooth bodies. */
#define SADMM_WITHOUT_SMOOTH
#include "narrow_listed.h"

void COLLISION(narrow_meshes_kernels)(struct collision_kernels *kernels)
{
    struct narrow_kernels *k = &kernels->with_meshes;
    k->at_once = k->at_once_first = k->at_once_again = {at_once_kernel<NARROW_ANY, NARROW_MESHES_AT_ONCE>,
                                                        NARROW_THREADS, 0, "narrow phase of meshes"};
    k->listed = {listed_kernel<NARROW_ANY, NARROW_MESHES_LISTED>, NARROW_THREADS, 0, "narrow phase of listed pairs"};
}
