/* Couplings of a world in a step by the host (core/model/coupling_law.h). */
#include "coupling_step.h"

void sadmm_world_begin_couplings(sadmm_world *world)
{
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) {
        struct sadmm_world_coupling *coupling = &world->couplings[slot];
        coupling->next = coupling->last;
        coupling_begin(&coupling->next);
    }
}

void sadmm_world_move_targets(sadmm_world *world, double dt)
{
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) coupling_move(&world->couplings[slot].next.target, dt);
}

void sadmm_world_commit_couplings(sadmm_world *world, int substeps)
{
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) {
        struct sadmm_world_coupling *coupling = &world->couplings[slot];
        coupling->last = coupling->next;
        coupling_end(&coupling->last, substeps);
    }
}
