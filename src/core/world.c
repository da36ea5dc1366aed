/* World level: creation, settings, slots and pair tables. Bodies, shapes, the step and its read-outs are in world_*.c. */
#include "subadmm/world.h"

#include <string.h>

#include "memory.h"
#include "registry.h"
#include "settings.h"
#include "world_internal.h"

sadmm_world_def sadmm_world_def_default(void)
{
    sadmm_world_def def = {
        .backend = SADMM_BACKEND_AUTO,
        .precision = SADMM_F64,
        .device = 0,
        .contact_margin = 0.02,
        .settings = sadmm_settings_default(),
    };
    return def;
}

sadmm_status sadmm_world_create(const sadmm_world_def *def, sadmm_world **out)
{
    if (!out) return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "out is NULL");
    *out = NULL;
    if (!def) return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def is NULL");
    sadmm_status status = sadmm_settings_validate(&def->settings, NULL);
    if (status == SADMM_OK) status = sadmm_check_range("def->contact_margin", def->contact_margin, 0, 1, NULL);
    if (status != SADMM_OK) return status;
    if (def->device < 0)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->device = %d: must be >= 0", def->device);
    /* AUTO is decided at the first step, when the size of the scene is known; unavailable choices fail here. */
    const struct sadmm_kernels *kernels = NULL;
    status = sadmm_backend_choose(def->backend, def->precision, 0, &kernels, NULL, 0, NULL);
    if (status != SADMM_OK) return status;

    sadmm_world *world = (sadmm_world *)sadmm_alloc(1, sizeof *world);
    if (!world) return sadmm_fail_memory(NULL, "the world");
    world->def = *def;
    status = sadmm_collision_create(&world->collision, NULL);
    if (status != SADMM_OK) {
        sadmm_free(world);
        return status;
    }
    *out = world;
    return SADMM_OK;
}

void sadmm_world_destroy(sadmm_world *world)
{
    if (!world) return;
    if (world->context) world->kernels->destroy(world->context);
    sadmm_collision_destroy(world->collision);
    sadmm_contact_set_free(&world->contacts);
    sadmm_certificate_workspace_free(&world->certificate_workspace);
    void *blocks[] = {world->bodies, world->shapes, world->shape_generations, world->disabled_pairs.keys,
                      world->disabled_pairs.values, world->friction_pairs.keys, world->friction_pairs.values,
                      world->collision_bodies, world->start, world->next, world->velocity, world->wrench,
                      world->start_velocity, world->start_impulse, world->slot_of,
                      world->resident.steady, world->resident.edits};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; ++i) sadmm_free(blocks[i]);
    sadmm_free(world);
}

const char *sadmm_world_message(const sadmm_world *world)
{
    return world ? world->error.message : "";
}

sadmm_status sadmm_world_set_settings(sadmm_world *world, const sadmm_settings *settings)
{
    sadmm_status status = sadmm_settings_validate(settings, &world->error);
    if (status == SADMM_OK) world->def.settings = *settings;
    return status;
}

sadmm_settings sadmm_world_settings(const sadmm_world *world)
{
    return world->def.settings;
}

/* ---- slots ---------------------------------------------------------------------------------------------------- */

size_t sadmm_slot_free(struct sadmm_slot_marks *marks, const sadmm_world *world,
                       bool (*alive)(const sadmm_world *world, size_t slot))
{
    while (alive(world, marks->free)) ++marks->free;
    return marks->free;
}

size_t sadmm_slot_at(struct sadmm_slot_marks *marks, int32_t index, const sadmm_world *world,
                     bool (*alive)(const sadmm_world *world, size_t slot))
{
    while (marks->below > index) marks->below -= alive(world, --marks->at);
    while (marks->below < index || !alive(world, marks->at)) marks->below += alive(world, marks->at++);
    return marks->at;
}

void sadmm_slot_taken(struct sadmm_slot_marks *marks, size_t slot)
{
    if (slot < marks->at) ++marks->below;
}

void sadmm_slot_freed(struct sadmm_slot_marks *marks, size_t slot)
{
    if (slot < marks->at) --marks->below;
    if (slot < marks->free) marks->free = slot;
}

/* ---- pair tables ---------------------------------------------------------------------------------------------- */

uint64_t sadmm_pair_key(size_t a, size_t b)
{
    return a < b ? (uint64_t)a << 32 | (uint64_t)b : (uint64_t)b << 32 | (uint64_t)a;
}

bool sadmm_pair_table_find(const struct sadmm_pair_table *table, uint64_t key, size_t *at)
{
    size_t low = 0, high = table->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (table->keys[middle] < key)
            low = middle + 1;
        else
            high = middle;
    }
    *at = low;
    return low < table->count && table->keys[low] == key;
}

sadmm_status sadmm_pair_table_set(struct sadmm_pair_table *table, uint64_t key, double value, struct sadmm_error *error)
{
    size_t at, count = table->count;
    if (!sadmm_pair_table_find(table, key, &at)) {
        if (!sadmm_grow((void **)&table->keys, &table->key_capacity, count, count + 1, sizeof *table->keys) ||
            !sadmm_grow((void **)&table->values, &table->value_capacity, count, count + 1, sizeof *table->values))
            return sadmm_fail_memory(error, "a pair override");
        memmove(table->keys + at + 1, table->keys + at, (count - at) * sizeof *table->keys);
        memmove(table->values + at + 1, table->values + at, (count - at) * sizeof *table->values);
        table->keys[at] = key;
        ++table->count;
    }
    table->values[at] = value;
    return SADMM_OK;
}

static void remove_at(struct sadmm_pair_table *table, size_t at)
{
    size_t rest = --table->count - at;
    memmove(table->keys + at, table->keys + at + 1, rest * sizeof *table->keys);
    memmove(table->values + at, table->values + at + 1, rest * sizeof *table->values);
}

void sadmm_pair_table_remove(struct sadmm_pair_table *table, uint64_t key)
{
    size_t at;
    if (sadmm_pair_table_find(table, key, &at)) remove_at(table, at);
}

void sadmm_pair_table_forget(struct sadmm_pair_table *table, uint32_t slot)
{
    for (size_t k = table->count; k-- > 0;)
        if (table->keys[k] >> 32 == slot || (uint32_t)table->keys[k] == slot) remove_at(table, k);
}
