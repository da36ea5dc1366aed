/* The caller's callback for manifolds. */
#include "subadmm/manifold.h"

#include "core/base/check.h"
#include "world/resident/resident.h"

sadmm_status sadmm_world_set_manifold_callback(sadmm_world *world, sadmm_manifold_callback callback, void *context)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_world_synchronise(world));
    world->decider.call = callback;
    world->decider.context = context;
    world->decider.last.count = 0;
    return SADMM_OK;
}
