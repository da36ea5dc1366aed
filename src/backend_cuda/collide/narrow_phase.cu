/* The narrow phase of worlds without convex hulls, meshes and smooth bodies. */
#define SADMM_WITHOUT_SMOOTH
#include "narrow_listed.h"

void COLLISION(narrow_phase_kernels)(struct collision_kernels *kernels)
{
    struct narrow_kernels *k = &kernels->plain;
    k->at_once = {at_once_kernel<NARROW_ONE, NARROW_PLAIN_AT_ONCE>, NARROW_THREADS, 0, "narrow phase"};
    k->at_once_first = {at_once_kernel<NARROW_FIRST, NARROW_PLAIN_AT_ONCE>, NARROW_THREADS, 0, "narrow phase"};
    k->at_once_again = {at_once_kernel<NARROW_AGAIN, NARROW_PLAIN_AT_ONCE>, NARROW_THREADS, 0, "narrow phase"};
}
