/* The fused iteration (persistent.h) of tier BLOCK: its instances. */
#include "persistent.h"

static const persistent_instance instances[] = {
    OF_MODE(BLOCK, "block"),
};

persistent_instances CUDA(block_instances)(void)
{
    const persistent_instances all = {instances, sizeof instances / sizeof *instances};
    return all;
}
