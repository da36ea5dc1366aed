/* From an id to the live object it names, and what to call it. */
#include "ids.h"

#include "core/base/check.h"

sadmm_shape_id sadmm_world_shape_id(const sadmm_world *world, int32_t slot)
{
    return (sadmm_shape_id){(uint32_t)slot + 1, world->shape_generations[slot]};
}

sadmm_body_id sadmm_world_body_id(const sadmm_world *world, int32_t slot)
{
    return (sadmm_body_id){(uint32_t)slot + 1, world->bodies[slot].generation};
}

const char *sadmm_world_body_name(const struct sadmm_world_body *body) { return body->name ? body->name : ""; }

struct sadmm_world_body *sadmm_world_find_body(const sadmm_world *world, sadmm_body_id id, const char *argument,
                                               struct sadmm_error *error)
{
    if (id.slot >= 1 && id.slot <= world->body_slots) {
        struct sadmm_world_body *body = &world->bodies[id.slot - 1];
        if (body->alive && body->generation == id.generation) return body;
    }
    sadmm_fail(error, SADMM_ERROR_STALE_ID, "%s = (slot %u, generation %u): no such body (any more)", argument, id.slot,
               id.generation);
    return NULL;
}

struct sadmm_shape *sadmm_world_find_shape(const sadmm_world *world, sadmm_shape_id id, const char *argument,
                                           struct sadmm_error *error)
{
    if (id.slot >= 1 && id.slot <= world->shape_slots && world->shapes[id.slot - 1].alive &&
        world->shape_generations[id.slot - 1] == id.generation)
        return &world->shapes[id.slot - 1];
    sadmm_fail(error, SADMM_ERROR_STALE_ID, "%s = (slot %u, generation %u): no such shape (any more)", argument,
               id.slot, id.generation);
    return NULL;
}

struct sadmm_world_joint *sadmm_world_find_joint(const sadmm_world *world, sadmm_joint_id id, const char *argument,
                                                 struct sadmm_error *error)
{
    if (id.slot >= 1 && id.slot <= world->joint_slots) {
        struct sadmm_world_joint *joint = &world->joints[id.slot - 1];
        if (joint->alive && !joint->coupling && joint->generation == id.generation) return joint;
    }
    sadmm_fail(error, SADMM_ERROR_STALE_ID, "%s = (slot %u, generation %u): no such joint (any more)", argument,
               id.slot, id.generation);
    return NULL;
}

struct sadmm_world_coupling *sadmm_world_find_coupling(const sadmm_world *world, sadmm_coupling_id id,
                                                       const char *argument, struct sadmm_error *error)
{
    if (id.slot >= 1 && id.slot <= world->coupling_slots) {
        struct sadmm_world_coupling *coupling = &world->couplings[id.slot - 1];
        if (coupling->alive && coupling->generation == id.generation) return coupling;
    }
    sadmm_fail(error, SADMM_ERROR_STALE_ID, "%s = (slot %u, generation %u): no such coupling (any more)", argument,
               id.slot, id.generation);
    return NULL;
}

struct sadmm_world_gear *sadmm_world_find_gear(const sadmm_world *world, sadmm_gear_id id, const char *argument,
                                               struct sadmm_error *error)
{
    if (id.slot >= 1 && id.slot <= world->gear_slots) {
        struct sadmm_world_gear *gear = &world->gears[id.slot - 1];
        if (gear->alive && gear->generation == id.generation) return gear;
    }
    sadmm_fail(error, SADMM_ERROR_STALE_ID, "%s = (slot %u, generation %u): no such gear (any more)", argument, id.slot,
               id.generation);
    return NULL;
}

sadmm_status sadmm_world_slot_at(const struct sadmm_slot_set *taken, int32_t count, int32_t index, const void *id,
                                 size_t *slot, struct sadmm_error *error)
{
    TRY(sadmm_check_given(id, "id", error));
    if (index < 0 || index >= count)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "index = %d: must be in [0, %d)", index, count);
    *slot = sadmm_slots_at(taken, index);
    return SADMM_OK;
}
