/* The fused iteration (resident.h) of tier CLUSTER: its instances. */
#include "resident.h"

static const resident_instance instances[] = {
    OF_MODE(CLUSTER, "cluster"),
};

resident_instances CUDA(cluster_instances)(void)
{
    const resident_instances all = {instances, sizeof instances / sizeof *instances};
    return all;
}
