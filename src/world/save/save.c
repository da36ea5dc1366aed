#include "subadmm/save.h"

#include <stdio.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/solve/registry.h"
#include "save.h"
#include "save_objects.h"
#include "save_step.h"
#include "world/objects/events.h"
#include "world/resident/resident.h"

/* Raised with every change of what is written. */
enum { FORMAT = 8 };

struct header {
    char magic[8];
    uint32_t byte_order, format;
    char build[240]; /* 0 up to its end */
    uint64_t size;   /* of the buffer */
    uint64_t checksum; /* of what follows */
};
static const char MAGIC[8] = "SADMMWLD";
static const uint32_t BYTE_ORDER_MARK = 0x01020304;

static void describe_build(char build[240])
{
    memset(build, 0, 240);
    snprintf(build, 240, "subadmm %s, commit %s, %s", sadmm_version(), sadmm_build_commit(), sadmm_build_compiler());
}

/* Changes whenever one word does: multiplication by an odd number and xor can be undone. */
static uint64_t checksum(const unsigned char *bytes, size_t size)
{
    uint64_t sum = UINT64_C(0xcbf29ce484222325) ^ size;
    for (size_t at = 0; at < size; at += sizeof(uint64_t)) {
        uint64_t word = 0;
        memcpy(&word, bytes + at, size - at < sizeof word ? size - at : sizeof word);
        sum = (sum ^ word) * UINT64_C(0x9e3779b97f4a7c15);
        sum ^= sum >> 29;
    }
    return sum;
}

/* Who makes the steps; without its memory. Reading: world->kernels are those at hand, which are taken where they are
 * the ones. */
static void archive_backend(struct sadmm_archive *archive, sadmm_world *world)
{
    const struct sadmm_kernels *at_hand = archive->reading ? world->kernels : NULL;
    int32_t chosen = world->kernels ? (int32_t)world->kernels->backend : -1;
    world->kernels = archive->reading ? NULL : world->kernels;
    SADMM_ARCHIVE(archive, chosen);
    if (!archive->reading || archive->status != SADMM_OK) return;
    const sadmm_backend asked = world->def.backend;
    if (!sadmm_archive_expect(archive,
                              chosen >= -1 && chosen < SADMM_BACKEND_COUNT && chosen != (int32_t)SADMM_BACKEND_AUTO &&
                                  (asked == SADMM_BACKEND_AUTO || chosen == -1 || chosen == (int32_t)asked),
                              "a backend"))
        return;
    if (at_hand && (int32_t)at_hand->backend == chosen && at_hand->precision == world->def.precision) {
        world->kernels = at_hand;
        return;
    }
    const struct sadmm_kernels *unused = NULL;
    const sadmm_backend backend = chosen >= 0 ? (sadmm_backend)chosen : asked;
    archive->status = sadmm_backend_choose(backend, world->def.precision, 0, chosen >= 0 ? &world->kernels : &unused,
                                           world->why, sizeof world->why, archive->error);
    if (chosen < 0) world->why[0] = 0;
}

static void archive_world(struct sadmm_archive *archive, sadmm_world *world)
{
    sadmm_archive_objects(archive, world);
    if (archive->status == SADMM_OK) archive_backend(archive, world);
    if (archive->status == SADMM_OK) sadmm_archive_step(archive, world);
}

sadmm_status sadmm_world_save(sadmm_world *world, void *buffer, size_t capacity, size_t *size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_check_given(size, "size", &world->error));
    if (capacity > 0) TRY(sadmm_check_given(buffer, "buffer", &world->error));
    TRY(sadmm_world_download_bodies(world));
    TRY(sadmm_world_download_contacts(world));
    TRY(sadmm_world_download_joints(world));
    struct sadmm_archive counting = {.error = &world->error};
    archive_world(&counting, world);
    TRY(counting.status);
    *size = sizeof(struct header) + counting.at;
    if (!buffer) return SADMM_OK;
    if (capacity < *size)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT, "capacity = %zu: must be at least %zu", capacity,
                          *size);
    unsigned char *body = (unsigned char *)buffer + sizeof(struct header);
    struct sadmm_archive writing = {.out = body, .size = counting.at, .error = &world->error};
    archive_world(&writing, world);
    TRY(writing.status);
    struct header header = {.byte_order = BYTE_ORDER_MARK, .format = FORMAT, .size = *size};
    memcpy(header.magic, MAGIC, sizeof header.magic);
    describe_build(header.build);
    header.checksum = checksum(body, counting.at);
    memcpy(buffer, &header, sizeof header);
    return SADMM_OK;
}

void sadmm_save_repair(void *buffer, size_t size)
{
    struct header header;
    if (size < sizeof header) return;
    memcpy(&header, buffer, sizeof header);
    header.size = size;
    header.checksum = checksum((const unsigned char *)buffer + sizeof header, size - sizeof header);
    memcpy(buffer, &header, sizeof header);
}

static sadmm_status check_header(const void *buffer, size_t size, struct sadmm_error *error)
{
    struct header header;
    char build[240];
    if (size < sizeof header)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "size = %zu: must be at least %zu, a header's", size,
                          sizeof header);
    memcpy(&header, buffer, sizeof header);
    describe_build(build);
    if (memcmp(header.magic, MAGIC, sizeof MAGIC) != 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "buffer: must be what sadmm_world_save wrote");
    if (header.byte_order != BYTE_ORDER_MARK || header.format != FORMAT ||
        memcmp(header.build, build, sizeof build) != 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "buffer: must be of this build (%s), and is of another one (%.*s)", build,
                          (int)sizeof header.build - 1, header.build);
    if (header.size != size)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "size = %zu: must be %llu, which was saved", size,
                          (unsigned long long)header.size);
    if (header.checksum != checksum((const unsigned char *)buffer + sizeof header, size - sizeof header))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "buffer: is damaged, its checksum is another one");
    return SADMM_OK;
}

/* Objects that are there before and after keep what the caller gave them. Errors: OUT_OF_MEMORY. */
static sadmm_status keep_user_data(struct sadmm_id_pool *fresh, const struct sadmm_id_pool *own,
                                   struct sadmm_error *error)
{
    for (size_t slot = 0; slot < own->tags.slots; ++slot)
        if (sadmm_ids_has(own, slot) && sadmm_ids_has(fresh, slot) &&
            fresh->generations[slot] == own->generations[slot])
            TRY(sadmm_tags_set_data(&fresh->tags, slot, sadmm_tags_data(&own->tags, slot), error));
    return SADMM_OK;
}

static sadmm_status keep_all_user_data(sadmm_world *fresh, const sadmm_world *world, struct sadmm_error *error)
{
    TRY(keep_user_data(&fresh->body_ids, &world->body_ids, error));
    TRY(keep_user_data(&fresh->shape_ids, &world->shape_ids, error));
    TRY(keep_user_data(&fresh->joint_ids, &world->joint_ids, error));
    TRY(keep_user_data(&fresh->gear_ids, &world->gear_ids, error));
    return keep_user_data(&fresh->coupling_ids, &world->coupling_ids, error);
}

/* The world that was read becomes `world`, and the other way round. What is the caller's stays, and so does a backend's
 * context that can be used again. */
static void exchange(sadmm_world *world, sadmm_world *fresh)
{
    fresh->def.tasks = world->def.tasks;
    fresh->team = world->team;
    sadmm_world_hand_events_on(world, fresh);
    sadmm_decider_hand_on(&world->decider, &fresh->decider);
    if (fresh->kernels && fresh->kernels == world->kernels && fresh->def.device == world->def.device) {
        fresh->context = world->context;
        world->context = NULL;
    }
    const sadmm_world old = *world;
    *world = *fresh;
    *fresh = old;
}

sadmm_status sadmm_world_restore(sadmm_world *world, const void *buffer, size_t size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    sadmm_world *fresh;
    TRY(sadmm_check_given(buffer, "buffer", error));
    TRY(check_header(buffer, size, error));
    const sadmm_world_def def = sadmm_world_def_default();
    const sadmm_status created = sadmm_world_create(&def, &fresh);
    if (created != SADMM_OK) return sadmm_fail(error, created, "%s", sadmm_last_message());
    struct sadmm_archive reading = {.reading = true,
                                    .in = (const unsigned char *)buffer + sizeof(struct header),
                                    .size = size - sizeof(struct header),
                                    .error = error};
    fresh->kernels = world->kernels;
    memcpy(fresh->why, world->why, sizeof fresh->why);
    archive_world(&reading, fresh);
    if (reading.status == SADMM_OK)
        sadmm_archive_expect(&reading, reading.at == reading.size, "something follows its end");
    if (reading.status == SADMM_OK) reading.status = keep_all_user_data(fresh, world, error);
    /* Steps begun have nothing to end in; what they say is of no use any more. */
    if (reading.status == SADMM_OK) {
        (void)sadmm_world_synchronise(world);
        exchange(world, fresh);
    }
    sadmm_world_destroy(fresh);
    return reading.status;
}
