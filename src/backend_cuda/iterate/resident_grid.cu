/* The fused iteration (resident.h) of tier GRID: its instances. */
#include "resident.h"

static const resident_instance instances[] = {
    OF_MODE(GRID, "grid"),
};

resident_instances CUDA(grid_instances)(void)
{
    const resident_instances all = {instances, sizeof instances / sizeof *instances};
    return all;
}
