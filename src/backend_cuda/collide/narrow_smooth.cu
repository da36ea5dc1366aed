/* The narrow phase of worlds with smooth bodies (cylinders, cones, ellipsoids), beside whatever else there is. */
#include "narrow_listed.h"
#include "touch.h"

void COLLISION(narrow_smooth_kernels)(struct collision_kernels *kernels)
{
    struct narrow_kernels *k = &kernels->with_smooth;
    touch_kernels(k);
    k->at_once = k->at_once_first = k->at_once_again = {at_once_kernel<NARROW_ANY, NARROW_ALL_AT_ONCE>, NARROW_THREADS,
                                                        0, "narrow phase of smooth bodies"};
    k->listed = {listed_kernel<NARROW_ANY, NARROW_ALL_LISTED>, NARROW_THREADS, 0, "narrow phase of listed pairs"};
}
