/* The fused iteration (persistent.h) of tier CLUSTER: its instances. */
#include "persistent.h"

static const persistent_instance instances[] = {
    OF_MODE(CLUSTER, "cluster"),
};

persistent_instances CUDA(cluster_instances)(void)
{
    const persistent_instances all = {instances, sizeof instances / sizeof *instances};
    return all;
}
