/* Gears of a world: what callers see of them, and change. */
#include "subadmm/gear.h"

#include <math.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "gear.h"
#include "joint_slots.h"
#include "world/resident/resident.h"
#include "world/resident/resident_joints.h"
#include "world/state/ids.h"
#include "world/step/gear_rows.h"

static const double RATIO_LEAST = 1e-9, RATIO_MOST = 1e9;

static const sadmm_gear_def defaults = {SADMM_GEAR_FIELDS(SADMM_FIELD_DEFAULT, )};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_gear_def, &defaults, enabled);

void sadmm_gear_def_init(sadmm_gear_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static sadmm_status check_coordinate(const sadmm_joint_def *joint, const char *name, int32_t k,
                                     struct sadmm_error *error)
{
    const bool free = k >= 0 && k < JOINT_COORDINATES && !(joint->locks >> k & 1) && joint_has_coordinate(joint, k);
    if (free && (k < 3 || joint_winds(joint->locks, k))) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                      "def->%s = %d: must be in [0, 6), free (locked: mask %u), and no rotation of three that are free",
                      name, k, joint->locks);
}

static sadmm_status check_offset(const char *name, double offset, struct sadmm_error *error)
{
    const struct sadmm_field *const range = SADMM_GEAR_FIELD(offset);
    return sadmm_check_range(name, offset, range->lo, range->hi, error);
}

/* Dynamic bodies that the two joints are between; *shared: how many of them are of both. */
static int count_bodies(const sadmm_world *world, const struct sadmm_world_joint *const joints[2], int *shared)
{
    int32_t bodies[4];
    int count = 0;
    *shared = 0;
    for (int i = 0; i < 4; ++i) {
        const int32_t body = joints[i / 2]->body[i % 2];
        if (body < 0 || world->bodies[body].type != SADMM_BODY_DYNAMIC) continue;
        int j = 0;
        while (j < count && bodies[j] != body) ++j;
        *shared += j < count;
        if (j == count) bodies[count++] = body;
    }
    return count;
}

sadmm_status sadmm_world_read_gear(const sadmm_world *world, struct sadmm_world_gear *gear, struct sadmm_error *error)
{
    const sadmm_gear_def *def = &gear->def;
    const struct sadmm_world_joint *const joints[2] = {
        sadmm_world_find_joint(world, def->joint_1, "def->joint_1", error),
        sadmm_world_find_joint(world, def->joint_2, "def->joint_2", error)};
    if (!joints[0] || !joints[1]) return SADMM_ERROR_STALE_ID;
    TRY(check_coordinate(&joints[0]->def, "coordinate_1", def->coordinate_1, error));
    TRY(check_coordinate(&joints[1]->def, "coordinate_2", def->coordinate_2, error));
    if (joints[0] == joints[1] && def->coordinate_1 == def->coordinate_2)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->coordinate_1 = def->coordinate_2 = %d of one joint: must be two", def->coordinate_1);
    if (!(fabs(def->ratio) >= RATIO_LEAST && fabs(def->ratio) <= RATIO_MOST))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->ratio = %g: its size must be in [%g, %g]",
                          def->ratio, RATIO_LEAST, RATIO_MOST);
    if (!isnan(def->offset)) TRY(check_offset("def->offset (or NaN: as it is)", def->offset, error));
    int shared;
    const int bodies = count_bodies(world, joints, &shared);
    if (bodies > 3 || (bodies == 3 && shared == 0))
        return sadmm_fail(
            error, SADMM_ERROR_INVALID_ARGUMENT,
            "def->joint_1, def->joint_2: between %d dynamic bodies, must be 2 at most, or 3 of which one is "
            "of both joints",
            bodies);
    gear->joint[0] = def->joint_1.slot - 1;
    gear->joint[1] = def->joint_2.slot - 1;
    return SADMM_OK;
}

/* ---- life -------------------------------------------------------------------------------------------------------- */

static sadmm_status measure(sadmm_world *world, const sadmm_gear_def *def, double *sum)
{
    sadmm_joint_state states[2];
    TRY(sadmm_world_joint_state(world, def->joint_1, &states[0]));
    TRY(sadmm_world_joint_state(world, def->joint_2, &states[1]));
    *sum = states[0].position[def->coordinate_1] + def->ratio * states[1].position[def->coordinate_2];
    return SADMM_OK;
}

sadmm_status sadmm_world_add_gear(sadmm_world *world, const sadmm_gear_def *given, sadmm_gear_id *id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_gear made = {.acts = false};
    size_t slot;
    TRY(sadmm_growing_take(&growing, &made.def, given, "def", error));
    TRY(sadmm_world_read_gear(world, &made, error));
    TRY(sadmm_world_detach(world));
    if (!sadmm_world_gear_reaches(world, &made))
        return sadmm_fail(
            error, SADMM_ERROR_INVALID_ARGUMENT,
            "def->joint_1, def->joint_2: on a dynamic body, with the same axis or the same direction: no force "
            "between the other two bodies moves both (a wheel in between, with two gears, does)");
    if (isnan(made.def.offset)) {
        TRY(measure(world, &made.def, &made.def.offset));
        TRY(check_offset("def->offset (NaN: as it is)", made.def.offset, error));
    }
    TRY(sadmm_ids_next(&world->gear_ids, &slot, error));
    if (!SADMM_GROW(world->gears, world->gear_ids.slots, slot + 1)) return sadmm_fail_memory(error, "a gear");
    TRY(sadmm_tags_set(&world->gear_ids.tags, slot, made.def.name, made.def.user_data, error));
    made.def.name = NULL; /* both are in the tags */
    made.def.user_data = NULL;
    sadmm_ids_take(&world->gear_ids, slot);
    world->gears[slot] = made;
    sadmm_world_link_gear(world, slot);
    if (id) *id = sadmm_world_gear_id(world, slot);
    return SADMM_OK;
}

sadmm_status sadmm_world_remove_gear(sadmm_world *world, sadmm_gear_id id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    if (!sadmm_world_find_gear(world, id, "id", &world->error)) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_world_detach(world));
    sadmm_world_kill_gear(world, id.slot - 1);
    return SADMM_OK;
}

/* ---- what it is, and what is set --------------------------------------------------------------------------------- */

sadmm_status sadmm_world_gear_def_sized(sadmm_world *world, sadmm_gear_id id, sadmm_gear_def *out, size_t size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    const struct sadmm_world_gear *gear = sadmm_world_find_gear(world, id, "id", &world->error);
    if (!gear) return SADMM_ERROR_STALE_ID;
    sadmm_gear_def def = gear->def;
    def.name = sadmm_tags_name(&world->gear_ids.tags, id.slot - 1);
    def.user_data = sadmm_tags_data(&world->gear_ids.tags, id.slot - 1);
    return sadmm_growing_give(&growing, out, size, 0, &def, "def", &world->error);
}

sadmm_status sadmm_world_set_gear_enabled(sadmm_world *world, sadmm_gear_id id, bool enabled)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_world_gear *gear = sadmm_world_find_gear(world, id, "id", &world->error);
    if (!gear) return SADMM_ERROR_STALE_ID;
    gear->def.enabled = enabled;
    sadmm_world_update_gear(world, gear);
    return SADMM_OK;
}

sadmm_status sadmm_world_gear_state(sadmm_world *world, sadmm_gear_id id, sadmm_gear_state *state)
{
    TRY(sadmm_check_given(world, "world", NULL));
    const struct sadmm_world_gear *gear = sadmm_world_find_gear(world, id, "id", &world->error);
    double sum;
    if (!gear) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(state, "state", &world->error));
    TRY(measure(world, &gear->def, &sum));
    *state = (sadmm_gear_state){sum - gear->def.offset, gear->last.force, gear->def.ratio * gear->last.force};
    return SADMM_OK;
}
