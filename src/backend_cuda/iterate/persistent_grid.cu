/* The fused iteration (persistent.h) of tier GRID: its instances. */
#include "persistent.h"

static const persistent_instance instances[] = {
    OF_MODE(GRID, "grid"),
};

persistent_instances CUDA(grid_instances)(void)
{
    const persistent_instances all = {instances, sizeof instances / sizeof *instances};
    return all;
}
