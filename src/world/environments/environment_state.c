#include "environment_state.h"

#include <string.h>

#include "core/base/archive.h"
#include "core/base/memory.h"

/* The same list for both directions. It is read by the library that has written it, so that nothing is checked. */

static void archive_bodies(struct sadmm_archive *archive, sadmm_world *world)
{
    for (SADMM_OBJECTS(slot, &world->body_ids)) {
        struct sadmm_world_body *body = &world->bodies[slot];
        SADMM_ARCHIVE(archive, body->rigid);
        SADMM_ARCHIVE(archive, body->extrapolation);
        if (body->type == SADMM_BODY_STATIC) continue;
        SADMM_ARCHIVE(archive, body->contact_wrench);
        if (body->type == SADMM_BODY_KINEMATIC) SADMM_ARCHIVE(archive, body->target);
    }
}

static void archive_joints(struct sadmm_archive *archive, sadmm_world *world)
{
    for (SADMM_OBJECTS(slot, &world->joint_ids)) {
        struct sadmm_world_joint *joint = &world->joints[slot];
        SADMM_ARCHIVE(archive, joint->last);
        sadmm_archive_flag(archive, &joint->def.enabled); /* it may break */
    }
    for (SADMM_OBJECTS(slot, &world->gear_ids)) SADMM_ARCHIVE(archive, world->gears[slot].last);
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) {
        struct sadmm_world_coupling *coupling = &world->couplings[slot];
        SADMM_ARCHIVE(archive, coupling->last);
        SADMM_ARCHIVE(archive, coupling->joint.last);
    }
}

static void archive_contacts(struct sadmm_archive *archive, struct sadmm_contact_set *set)
{
    sadmm_archive_array(archive, &set->pairs, &set->pair_count, sizeof *set->pairs, INT32_MAX);
    sadmm_archive_array(archive, &set->points, &set->point_count, sizeof *set->points, INT32_MAX);
    SADMM_ARCHIVE(archive, set->dt);
    SADMM_ARCHIVE(archive, set->migrating);
    if (set->migrating == 0 || archive->status != SADMM_OK) return;
    if (archive->reading && !sadmm_contact_set_reserve_migrations(set, set->point_count)) {
        archive->status = sadmm_fail_memory(archive->error, "the state of an environment");
        return;
    }
    for (size_t k = 0; k < set->point_count; ++k)
        if (set->points[k].migrates) SADMM_ARCHIVE(archive, set->migrations[k]);
}

static void archive_state(struct sadmm_archive *archive, sadmm_world *world)
{
    sadmm_archive_flag(archive, &world->stepped);
    SADMM_ARCHIVE(archive, world->report);
    SADMM_ARCHIVE(archive, world->plan);
    archive_bodies(archive, world);
    archive_joints(archive, world);
    archive_contacts(archive, &world->contacts);
}

sadmm_status sadmm_environment_state_store(sadmm_world *world, struct sadmm_environment_state *state)
{
    struct sadmm_archive counting = {.error = &world->error};
    archive_state(&counting, world);
    if (!SADMM_GROW(state->bytes, state->size, counting.at))
        return sadmm_fail_memory(&world->error, "the state of an environment");
    struct sadmm_archive writing = {.out = state->bytes, .size = counting.at, .error = &world->error};
    archive_state(&writing, world);
    state->size = writing.at;
    return SADMM_OK;
}

void sadmm_environment_state_taken(sadmm_world *world)
{
    world->contacts_readable = false;
    world->start.hit_count = world->start.hit_first = 0;
    world->certified_step = -1;
    sadmm_world_moved(world);
}

sadmm_status sadmm_environment_state_load(sadmm_world *world, const struct sadmm_environment_state *state)
{
    struct sadmm_archive reading = {.reading = true, .in = state->bytes, .size = state->size, .error = &world->error};
    archive_state(&reading, world);
    sadmm_environment_state_taken(world);
    return reading.status;
}

sadmm_status sadmm_environment_state_copy(struct sadmm_environment_state *to,
                                          const struct sadmm_environment_state *from, struct sadmm_error *error)
{
    if (!SADMM_GROW(to->bytes, to->size, from->size)) return sadmm_fail_memory(error, "the state of an environment");
    memcpy(to->bytes, from->bytes, from->size);
    to->size = from->size;
    return SADMM_OK;
}

void sadmm_environment_state_free(struct sadmm_environment_state *state)
{
    sadmm_free(state->bytes);
    *state = (struct sadmm_environment_state){0};
}
