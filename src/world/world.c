/* World level: creation, settings. Bodies, shapes, the step and its read-outs are in the files beside this one. */
#include "subadmm/world.h"

#include <string.h>

#include "core/base/check.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/solve/registry.h"
#include "world/objects/body_check.h"
#include "world/objects/events.h"
#include "world/objects/joint_slots.h"
#include "world/resident/resident.h"
#include "world/step/hits.h"

static const sadmm_world_def defaults = {
    .backend = SADMM_BACKEND_AUTO,
    .precision = SADMM_F64,
    .device = 0,
    .contact_margin = 0.02,
    .settings = SADMM_DEFAULT_SETTINGS,
};
static const struct sadmm_growing growing = {
    .size = sizeof(sadmm_world_def),
    .least = SADMM_SIZE_TO(sadmm_world_def, tasks) + SADMM_SETTINGS_LEAST,
    .defaults = &defaults,
    .start = "sadmm_world_def_default()",
    .part_count = 1,
    .part_at = offsetof(sadmm_world_def, settings),
    .part_size = sizeof(sadmm_settings),
    .part_least = SADMM_SETTINGS_LEAST,
    .part_size_at = offsetof(sadmm_world_def, settings.struct_size),
    .part_name = "settings.struct_size",
};

void sadmm_world_def_init(sadmm_world_def *def, size_t size, size_t settings_size)
{
    sadmm_growing_init(&growing, def, size, settings_size);
}

sadmm_status sadmm_world_create(const sadmm_world_def *given, sadmm_world **out)
{
    sadmm_world_def def;
    struct sadmm_team team;
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    TRY(sadmm_growing_take(&growing, &def, given, "def", NULL));
    TRY(sadmm_settings_validate(&def.settings, NULL));
    TRY(sadmm_check_range("def->contact_margin", def.contact_margin, 0, 1, NULL));
    TRY(sadmm_team_init(&team, &def.tasks, "def->tasks", NULL));
    if (def.device < 0)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->device = %d: must be >= 0", def.device);
    /* AUTO is decided at the first step, when the size of the scene is known; unavailable choices fail here. */
    const struct sadmm_kernels *kernels = NULL;
    TRY(sadmm_backend_choose(def.backend, def.precision, 0, &kernels, NULL, 0, NULL));

    sadmm_world *world = (sadmm_world *)sadmm_alloc(1, sizeof *world);
    if (!world) return sadmm_fail_memory(NULL, "the world");
    world->def = def;
    world->team = team;
    world->certified_step = -1;
    world->body_ids = (struct sadmm_id_pool){.object = "body", .objects = "bodies", .most = 27};
    world->shape_ids = (struct sadmm_id_pool){.object = "shape", .objects = "shapes", .most = 28};
    world->joint_ids = (struct sadmm_id_pool){.object = "joint", .objects = "joints", .most = 24};
    world->gear_ids = (struct sadmm_id_pool){.object = "gear", .objects = "gears", .most = 24};
    world->coupling_ids = (struct sadmm_id_pool){.object = "coupling", .objects = "couplings", .most = 24};
    const sadmm_status status = sadmm_collision_create(&world->collision, NULL);
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
    sadmm_solve_errors_free(&world->errors);
    sadmm_articulations_destroy(world->articulations);
    sadmm_ncp_destroy(world->ncp);
    sadmm_push_destroy(world->push);
    sadmm_rows_free(&world->start.rows);
    sadmm_rows_free(&world->last_start.rows);
    sadmm_rows_free(&world->closing);
    sadmm_world_free_tables(world);
    sadmm_shape_data_free(&world->shape_data);
    sadmm_query_tree_free(&world->query.tree);
    sadmm_world_free_events(world);
    struct sadmm_id_pool *const ids[] = {&world->body_ids, &world->shape_ids, &world->joint_ids, &world->gear_ids,
                                         &world->coupling_ids};
    struct sadmm_pair_table *const pairs[] = {&world->disabled_pairs, &world->jointed_pairs, &world->friction_pairs};
    for (size_t i = 0; i < sizeof ids / sizeof *ids; ++i) sadmm_ids_free(ids[i]);
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; ++i) sadmm_pair_table_free(pairs[i]);
    sadmm_world_free_hits(world);
    sadmm_decider_free(&world->decider);
    void *blocks[] = {world->bodies, world->shapes, world->geometries, world->block_shapes,
                      world->shape_links, world->surfaces, world->filtered_pairs,
                      world->joints, world->couplings, world->gears,
                      world->joint_sources, world->joint_load, world->stiffening, world->stiffened,
                      world->opened, world->folding, world->row_left, world->closing_costs, world->closing_slots,
                      world->openings,
                      world->trapezoids, world->touch, world->acting_joints, world->joint_sides,
                      world->spins, world->joint_trapezoids,
                      world->joint_labels, world->joint_touch, world->joint_number,
                      world->joint_momentum, world->joint_constraints,
                      world->start.multiplier, world->last_start.multiplier,
                      world->collision_bodies, world->start.rigid, world->start.velocity,
                      world->start.impulse, world->last_start.rigid, world->last_start.velocity,
                      world->last_start.impulse, world->start.kinematic, world->last_start.kinematic, world->kinematic,
                      world->kinematic_slots, world->support_motion, world->supports, world->support_labels,
                      world->next, world->velocity, world->wrench, world->extrapolation, world->wrench_sum,
                      world->slot_of, world->resident.extrapolation, world->resident.kinematic,
                      world->resident.kinematic_wrench, world->resident.gears, world->resident.gear_force,
                      world->resident.tables, world->resident.dirty, world->resident.updates, world->resident.held,
                      world->resident.joints, world->resident.memory, world->step_joints,
                      world->resident.solution, world->resident.dirty_joints,
                      world->resident.coupling_memory, world->query.prelude, world->query.hits,
                      world->query.slots, world->query.spare, world->placing.seen, world->placing.bodies,
                      world->placing.changes};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; ++i) sadmm_free(blocks[i]);
    sadmm_free(world);
}

const char *sadmm_world_message(const sadmm_world *world)
{
    return world ? world->error.message : "";
}

sadmm_status sadmm_world_set_settings(sadmm_world *world, const sadmm_settings *settings)
{
    sadmm_settings taken;
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_settings_take(&taken, settings, &world->error));
    world->def.settings = taken;
    return SADMM_OK;
}

sadmm_status sadmm_world_set_backend(sadmm_world *world, sadmm_backend backend, sadmm_precision precision, int device)
{
    const struct sadmm_kernels *kernels = NULL;
    TRY(sadmm_check_given(world, "world", NULL));
    if (device < 0) return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT, "device = %d: must be >= 0", device);
    TRY(sadmm_backend_choose(backend, precision, 0, &kernels, NULL, 0, &world->error));
    TRY(sadmm_world_check_inertias(world, precision));
    TRY(sadmm_world_detach(world));
    if (world->context) world->kernels->destroy(world->context);
    world->context = NULL;
    world->kernels = NULL; /* chosen at the next step */
    world->why[0] = 0;
    world->def.backend = backend;
    world->def.precision = precision;
    world->def.device = device;
    return SADMM_OK;
}

void sadmm_world_settings_sized(const sadmm_world *world, sadmm_settings *settings, size_t size)
{
    if (world)
        (void)sadmm_growing_give(&sadmm_growing_settings, settings, size, 0, &world->def.settings, "settings", NULL);
    else sadmm_settings_init(settings, size);
}
