/* The fused iteration (iterate/resident.h) of the method `fast`. */
#include "resident.h"

static const resident_instance instances[] = {METHOD(true, "fast, ")};

const resident_instance *CUDA(fast_instances)(size_t *count)
{
    *count = sizeof instances / sizeof *instances;
    return instances;
}
