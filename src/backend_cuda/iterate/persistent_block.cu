/* The fused iteration (persistent.h) of tier BLOCK: its instances. */
#include "persistent.h"

static const persistent_instance instances[] = {
    INSTANCE(4, BLOCK, false, ONE_WARP, false, "warp, 4 points"),
    INSTANCE(8, BLOCK, false, ONE_WARP, false, "warp, 8 points"),
    INSTANCE(4, BLOCK, false, ONE_WARP, true, "fast, warp, 4 points"),
    INSTANCE(8, BLOCK, false, ONE_WARP, true, "fast, warp, 8 points"),
    OF_MODE(BLOCK, "block"),
};

persistent_instances CUDA(block_instances)(void)
{
    const persistent_instances all = {instances, sizeof instances / sizeof *instances};
    return all;
}
