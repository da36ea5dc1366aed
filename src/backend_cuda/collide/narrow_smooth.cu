/* Listed candidates of worlds with smooth bodies (cylinders, cones, ellipsoids): all pairs with one are listed, beside
 * those of hulls that are (narrow_hulls.cu), whose own kernel stays without what these need of registers and stack. */
#include "narrow_listed.h"

void COLLISION(narrow_smooth_kernels)(struct collision_kernels *kernels)
{
    kernels->smooth = {listed_kernel<NARROW_ONE>, NARROW_THREADS, 0, "narrow phase of smooth bodies"};
    kernels->smooth_first = {listed_kernel<NARROW_FIRST>, NARROW_THREADS, 0, "narrow phase of smooth bodies"};
    kernels->smooth_again = {listed_kernel<NARROW_AGAIN>, NARROW_THREADS, 0, "narrow phase of smooth bodies"};
}
