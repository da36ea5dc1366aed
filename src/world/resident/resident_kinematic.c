/* Kinematic bodies of a world that a backend keeps (resident.h). */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/extrapolation.h"
#include "core/model/kinematic.h"
#include "resident_kinematic.h"

sadmm_status sadmm_world_list_kinematic(sadmm_world *world)
{
    const size_t n = (size_t)world->kinematic_count;
    if (!SADMM_GROW(world->resident.kinematic, 0, n) || !SADMM_GROW(world->resident.kinematic_wrench, 0, 6 * n))
        return sadmm_fail_memory(&world->error, "kinematic bodies");
    for (size_t k = 0; k < n; ++k) {
        const struct sadmm_world_body *body = &world->bodies[world->kinematic_slots[k]];
        world->resident.kinematic[k] = (struct sadmm_kinematic_body){
            .rigid = body->rigid, .extrapolation = body->extrapolation, .slot = world->kinematic_slots[k]};
    }
    return SADMM_OK;
}

/* A target is done with by the step that it was set for; what the backend has then is none, or that of a state that was
 * put there since. Neither a target nor a state that was set after the last step is older than what the backend has. */
static void take_kinematic(sadmm_world *world, size_t k, const struct sadmm_kinematic_body *read)
{
    struct sadmm_world_body *body = &world->bodies[world->kinematic_slots[k]];
    body->extrapolation = read->extrapolation;
    if (body->set_at[SADMM_UPDATE_STATE] < world->resident.done) body->rigid = read->rigid;
    else extrapolation_place(&body->extrapolation, &read->rigid, body->rigid.position, body->rigid.orientation);
    if (body->set_at[SADMM_UPDATE_TARGET] < world->resident.done) {
        body->target.set = read->target != 0;
        memcpy(body->target.position, read->position, sizeof read->position);
        memcpy(body->target.orientation, read->orientation, sizeof read->orientation);
    }
    if (world->plan.wrenches)
        memcpy(body->contact_wrench, world->resident.kinematic_wrench + 6 * k, sizeof body->contact_wrench);
}

sadmm_status sadmm_world_read_kinematic(sadmm_world *world)
{
    if (world->kinematic_count == 0) return SADMM_OK;
    TRY(world->kernels->resident->read_kinematic(world->context, world->resident.kinematic,
                                                 world->plan.wrenches ? world->resident.kinematic_wrench : NULL, NULL,
                                                 &world->error));
    for (int32_t k = 0; k < world->kinematic_count; ++k)
        take_kinematic(world, (size_t)k, &world->resident.kinematic[k]);
    return SADMM_OK;
}

sadmm_status sadmm_world_read_kinematic_start(sadmm_world *world)
{
    struct sadmm_step_start *start = &world->start;
    const size_t n = (size_t)world->kinematic_count;
    start->kinematic_count = 0;
    if (n == 0) return SADMM_OK;
    if (!SADMM_GROW(start->kinematic, 0, 6 * n)) return sadmm_fail_memory(&world->error, "kinematic bodies");
    TRY(world->kernels->resident->read_kinematic(world->context, NULL, NULL, start->kinematic, &world->error));
    start->kinematic_count = world->kinematic_count;
    return SADMM_OK;
}
