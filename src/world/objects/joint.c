/* Joints of a world: what callers see of them, and change. */
#include "subadmm/joint.h"

#include <math.h>
#include <string.h>

#include "body_check.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/math/rigid.h"
#include "joint.h"
#include "joint_place.h"
#include "joint_slots.h"
#include "world/resident/resident.h"
#include "world/resident/resident_joints.h"
#include "world/state/ids.h"

static const double FRAME_LIMIT = 1e9, FORCE_LIMIT = 1e15;

static const sadmm_joint_coordinate default_coordinate = SADMM_DEFAULT_COORDINATE;
static const sadmm_joint_def defaults = {SADMM_JOINT_FIELDS(SADMM_FIELD_DEFAULT, )};
enum { LEAST_COORDINATE = SADMM_SIZE_TO(sadmm_joint_coordinate, armature) };
static const struct sadmm_growing growing = {
    .size = sizeof(sadmm_joint_def),
    .least = SADMM_SIZE_TO(sadmm_joint_def, break_torque) + JOINT_COORDINATES * LEAST_COORDINATE,
    .defaults = &defaults,
    .start = "sadmm_joint_def_default()",
    .part_count = JOINT_COORDINATES,
    .part_at = offsetof(sadmm_joint_def, coordinates),
    .part_size = sizeof(sadmm_joint_coordinate),
    .part_least = LEAST_COORDINATE,
    .part_size_at = offsetof(sadmm_joint_def, coordinate_size),
    .part_name = "coordinate_size",
};

void sadmm_joint_def_init(sadmm_joint_def *def, size_t size, size_t coordinate_size)
{
    sadmm_growing_init(&growing, def, size, coordinate_size);
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static bool acts(const sadmm_joint_coordinate *c)
{
    return c->limited || c->drive != SADMM_DRIVE_OFF || c->friction != 0 || c->spring_stiffness != 0 ||
           c->spring_damping != 0 || c->armature != 0;
}

static sadmm_status check_limits(const char *name, const sadmm_joint_coordinate *c, struct sadmm_error *error)
{
    if (!joint_limits_fit(c->lower, c->upper))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "%slower = %g, upper = %g: must be numbers, lower in [-inf, upper], upper in [lower, inf]",
                          name, c->lower, c->upper);
    return SADMM_OK;
}

/* name: what stands before the fields, "coordinate->" say. */
static sadmm_status check_coordinate(const char *name, const sadmm_joint_coordinate *c, struct sadmm_error *error)
{
    TRY(check_limits(name, c, error));
    return sadmm_fields_check(sadmm_coordinate_table, SADMM_COORDINATE_FIELDS_COUNT, c, name, error);
}

static bool has_coordinate(const sadmm_joint_def *def, int k) { return k == 0 || !joint_is_radial(def->kind); }

static sadmm_status check_coordinates(const sadmm_joint_def *def, uint32_t locks, struct sadmm_error *error)
{
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        const sadmm_joint_coordinate *c = &def->coordinates[k];
        char name[32] = "def->coordinates[0].";
        name[17] = (char)('0' + k);
        TRY(check_coordinate(name, c, error));
        if (acts(c) && (locks >> k & 1 || !has_coordinate(def, k)))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "def->coordinates[%d]: must be the default, for the joint %s that coordinate", k,
                              locks >> k & 1 ? "locks" : "does not have");
    }
    return SADMM_OK;
}

/* The slot of a joint's body, -1: the static world. */
static sadmm_status find_side(const sadmm_world *world, sadmm_body_id id, const char *name, int32_t *slot,
                              struct sadmm_error *error)
{
    *slot = -1;
    if (id.slot == 0 && id.generation == 0) return SADMM_OK;
    if (!sadmm_world_find_body(world, id, name, error)) return SADMM_ERROR_STALE_ID;
    *slot = (int32_t)id.slot - 1;
    return SADMM_OK;
}

static bool moves(const sadmm_world *world, int32_t slot)
{
    return slot >= 0 && world->bodies[slot].type == SADMM_BODY_DYNAMIC;
}

static sadmm_status find_sides(const sadmm_world *world, const sadmm_joint_def *def, int32_t slots[2],
                               struct sadmm_error *error)
{
    TRY(find_side(world, def->body_a, "def->body_a", &slots[0], error));
    TRY(find_side(world, def->body_b, "def->body_b", &slots[1], error));
    if (slots[0] == slots[1] && slots[0] >= 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->body_a = def->body_b = (slot %u, generation %u, \"%s\"): must be two bodies",
                          def->body_a.slot, def->body_a.generation, sadmm_world_body_name(world, def->body_a));
    if (!moves(world, slots[0]) && !moves(world, slots[1]))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->body_a = (slot %u, generation %u, \"%s\"), def->body_b = (slot %u, generation %u, "
                          "\"%s\"): one at least must be dynamic", def->body_a.slot, def->body_a.generation,
                          sadmm_world_body_name(world, def->body_a), def->body_b.slot, def->body_b.generation,
                          sadmm_world_body_name(world, def->body_b));
    return SADMM_OK;
}

static void set_frames(struct sadmm_world_joint *joint)
{
    const sadmm_joint_def *def = &joint->def;
    joint->frame[0] = (struct joint_frame){v3_load(def->position_a), q_load(def->orientation_a)};
    joint->frame[1] = (struct joint_frame){v3_load(def->position_b), q_load(def->orientation_b)};
}

static sadmm_status check_length(const char *name, double length, struct sadmm_error *error)
{
    const struct sadmm_field *const range = SADMM_JOINT_FIELD(length);
    return sadmm_check_range(name, length, range->lo, range->hi, error);
}

static sadmm_status check_def(const sadmm_joint_def *def, uint32_t *locks, struct sadmm_error *error)
{
    TRY(sadmm_fields_check(sadmm_joint_table, SADMM_JOINT_FIELDS_COUNT, def, "def->", error));
    *locks = def->kind == SADMM_JOINT_CUSTOM ? def->locks : sadmm_joint_locks[def->kind];
    if (*locks > JOINT_ALL_LOCKED)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->locks = %u: must be in [0, %d]", def->locks,
                          JOINT_ALL_LOCKED);
    if (def->length != -1) TRY(check_length("def->length (or -1: as it is)", def->length, error));
    return check_coordinates(def, *locks, error);
}

sadmm_status sadmm_world_read_joint(const sadmm_world *world, struct sadmm_world_joint *joint,
                                    struct sadmm_error *error)
{
    uint32_t locks = 0;
    TRY(check_def(&joint->def, &locks, error));
    if (locks != joint->def.locks)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->locks = %u: must be %u, by its kind",
                          joint->def.locks, locks);
    set_frames(joint);
    return find_sides(world, &joint->def, joint->body, error);
}

/* ---- life -------------------------------------------------------------------------------------------------------- */

static const struct sadmm_rigid *pose_of(const sadmm_world *world, int32_t slot)
{
    return slot >= 0 ? &world->bodies[slot].rigid : NULL;
}

sadmm_status sadmm_world_add_joint(sadmm_world *world, const sadmm_joint_def *given, sadmm_joint_id *id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_joint made = {.coupling = 0};
    sadmm_joint_def taken;
    const sadmm_joint_def *const def = &taken;
    size_t slot;
    TRY(sadmm_growing_take(&growing, &taken, given, "def", error));
    made.def = *def;
    TRY(check_def(def, &made.def.locks, error));
    TRY(find_sides(world, def, made.body, error));
    TRY(sadmm_check_orientation("def->orientation_a", def->orientation_a, made.def.orientation_a, error));
    TRY(sadmm_check_orientation("def->orientation_b", def->orientation_b, made.def.orientation_b, error));
    TRY(sadmm_world_detach(world));
    set_frames(&made);
    if (def->length == -1 && joint_is_radial(def->kind)) {
        made.def.length = sadmm_world_joint_geometry(world, &made).value[0];
        TRY(check_length("def->length (-1: as it is)", made.def.length, error));
    }
    TRY(sadmm_world_insert_joint(world, &made, &slot));
    if (id) *id = sadmm_world_joint_id(world, slot);
    return SADMM_OK;
}

sadmm_status sadmm_world_remove_joint(sadmm_world *world, sadmm_joint_id id)
{
    TRY(sadmm_check_given(world, "world", NULL));
    if (!sadmm_world_find_joint(world, id, "id", &world->error)) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_world_detach(world));
    sadmm_world_kill_joint(world, id.slot - 1);
    return SADMM_OK;
}

/* ---- what it is, and what is set --------------------------------------------------------------------------------- */

sadmm_status sadmm_world_joint_def_sized(sadmm_world *world, sadmm_joint_id id, sadmm_joint_def *out, size_t size,
                                         size_t coordinate_size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    const struct sadmm_world_joint *joint = sadmm_world_find_joint(world, id, "id", &world->error);
    if (!joint) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(out, "def", &world->error));
    TRY(sadmm_world_download_joints(world));
    sadmm_joint_def def = joint->def;
    def.name = sadmm_tags_name(&world->joint_ids.tags, id.slot - 1);
    def.user_data = sadmm_tags_data(&world->joint_ids.tags, id.slot - 1);
    return sadmm_growing_give(&growing, out, size, coordinate_size, &def, "def", &world->error);
}

sadmm_status sadmm_world_take_update(sadmm_world *world, struct sadmm_world_joint *joint,
                                     enum sadmm_joint_update update)
{
    return sadmm_world_update_joint(world, joint, update) ? SADMM_OK : sadmm_world_detach(world);
}

sadmm_status sadmm_world_set_joint_enabled(sadmm_world *world, sadmm_joint_id id, bool enabled)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_world_joint *joint = sadmm_world_find_joint(world, id, "id", &world->error);
    if (!joint) return SADMM_ERROR_STALE_ID;
    joint->def.enabled = enabled;
    joint->last.broken = joint->last.broken && !enabled;
    return sadmm_world_take_update(world, joint, SADMM_JOINT_ENABLED);
}

static sadmm_status check_free(const struct sadmm_world_joint *joint, int32_t index, struct sadmm_error *error)
{
    if (index < 0 || index >= JOINT_COORDINATES || joint->def.locks >> index & 1 || !has_coordinate(&joint->def, index))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "index = %d: must be a free coordinate of the joint, in [0, 6) (locked: mask %u)", index,
                          joint->def.locks);
    return SADMM_OK;
}

sadmm_status sadmm_world_check_coordinate(const struct sadmm_world_joint *joint, int32_t index,
                                          const sadmm_joint_coordinate *coordinate, struct sadmm_error *error)
{
    TRY(check_free(joint, index, error));
    return check_coordinate("coordinate->", coordinate, error);
}

sadmm_status sadmm_world_set_joint_coordinate_sized(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                    const sadmm_joint_coordinate *given, size_t size)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_joint *joint = sadmm_world_find_joint(world, id, "id", error);
    if (!joint) return SADMM_ERROR_STALE_ID;
    sadmm_joint_coordinate coordinate = default_coordinate;
    TRY(sadmm_take_bytes(&coordinate, sizeof coordinate, LEAST_COORDINATE, given, size, "coordinate", error));
    TRY(sadmm_world_check_coordinate(joint, index, &coordinate, error));
    joint->def.coordinates[index] = coordinate;
    return sadmm_world_take_update(world, joint, (enum sadmm_joint_update)index);
}

void sadmm_world_read_joint_frames(const struct sadmm_world_joint *joint, double *row)
{
    const sadmm_joint_def *def = &joint->def;
    memcpy(row, def->position_a, sizeof def->position_a);
    memcpy(row + 3, def->orientation_a, sizeof def->orientation_a);
    memcpy(row + 7, def->position_b, sizeof def->position_b);
    memcpy(row + 10, def->orientation_b, sizeof def->orientation_b);
}

/* unit: the same, orientations of unit length. */
static sadmm_status take_frames(const double *row, double *unit, struct sadmm_error *error)
{
    static const char *const names[2][2] = {{"position_a", "orientation_a"}, {"position_b", "orientation_b"}};
    memcpy(unit, row, SADMM_JOINT_FRAME_NUMBERS * sizeof *unit);
    for (int s = 0; s < 2; ++s) {
        TRY(sadmm_check_vector(names[s][0], row + 7 * s, 3, FRAME_LIMIT, error));
        TRY(sadmm_world_check_turn(names[s][1], row + 7 * s + 3, unit + 7 * s + 3, error));
    }
    return SADMM_OK;
}

sadmm_status sadmm_world_check_joint_frames(const double *row, struct sadmm_error *error)
{
    double ignored[SADMM_JOINT_FRAME_NUMBERS];
    return take_frames(row, ignored, error);
}

sadmm_status sadmm_world_set_joint_frames(sadmm_world *world, struct sadmm_world_joint *joint, const double *row)
{
    double now[SADMM_JOINT_FRAME_NUMBERS], unit[SADMM_JOINT_FRAME_NUMBERS];
    sadmm_joint_def *def = &joint->def;
    TRY(take_frames(row, unit, &world->error));
    sadmm_world_read_joint_frames(joint, now);
    if (memcmp(now, unit, sizeof now) == 0) return SADMM_OK;
    TRY(sadmm_world_detach(world));
    memcpy(def->position_a, unit, sizeof def->position_a);
    memcpy(def->orientation_a, unit + 3, sizeof def->orientation_a);
    memcpy(def->position_b, unit + 7, sizeof def->position_b);
    memcpy(def->orientation_b, unit + 10, sizeof def->orientation_b);
    set_frames(joint);
    return SADMM_OK;
}

sadmm_status sadmm_world_check_table(const double *positions, const double *forces, int32_t count,
                                     struct sadmm_error *error)
{
    if (count != 0 && (count < 2 || count > SADMM_MOST_SPRING_POINTS))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "count = %d: must be 0 or in [2, %d]", count,
                          SADMM_MOST_SPRING_POINTS);
    if (count == 0) return SADMM_OK;
    TRY(sadmm_check_given(positions, "positions", error));
    TRY(sadmm_check_given(forces, "forces", error));
    TRY(sadmm_check_vector("positions", positions, count, FRAME_LIMIT, error));
    TRY(sadmm_check_vector("forces", forces, count, FORCE_LIMIT, error));
    for (int32_t i = 1; i < count; ++i) {
        const double way = positions[i] - positions[i - 1];
        if (!(way > 0))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "positions[%d] = %.17g after positions[%d] = %.17g: must increase", i, positions[i],
                              i - 1, positions[i - 1]);
        if (!(fabs(forces[i] - forces[i - 1]) <= FORCE_LIMIT * way))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "forces[%d] = %g after forces[%d] = %g, %g farther: must be within 1e15 a unit of way", i,
                              forces[i], i - 1, forces[i - 1], way);
    }
    return SADMM_OK;
}

sadmm_status sadmm_world_set_joint_spring_table(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                const double *positions, const double *forces, int32_t count)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_world_joint *joint = sadmm_world_find_joint(world, id, "id", error);
    if (!joint) return SADMM_ERROR_STALE_ID;
    TRY(check_free(joint, index, error));
    TRY(sadmm_world_check_table(positions, forces, count, error));
    TRY(sadmm_world_detach(world));
    const size_t n = (size_t)count;
    double *table = n ? (double *)sadmm_alloc(2 * n, sizeof *table) : NULL;
    if (n && !table) return sadmm_fail_memory(error, "a spring's table");
    if (n) {
        memcpy(table, positions, n * sizeof *table);
        memcpy(table + n, forces, n * sizeof *table);
    }
    sadmm_world_put_table(world, id.slot - 1, index, table, count);
    return SADMM_OK;
}

sadmm_status sadmm_world_joint_spring_table(sadmm_world *world, sadmm_joint_id id, int32_t index, double *positions,
                                            double *forces, int32_t *count)
{
    TRY(sadmm_check_given(world, "world", NULL));
    const struct sadmm_world_joint *joint = sadmm_world_find_joint(world, id, "id", &world->error);
    if (!joint) return SADMM_ERROR_STALE_ID;
    if (index < 0 || index >= JOINT_COORDINATES)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT, "index = %d: must be in [0, 6)", index);
    TRY(sadmm_check_given(count, "count", &world->error));
    const size_t n = (size_t)joint->table_count[index];
    *count = joint->table_count[index];
    if (n && positions) memcpy(positions, joint->table[index], n * sizeof *positions);
    if (n && forces) memcpy(forces, joint->table[index] + n, n * sizeof *forces);
    return SADMM_OK;
}

sadmm_status sadmm_world_place_joint(sadmm_world *world, sadmm_joint_def *def, const double position[3],
                                     const double orientation[4])
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    double unit[4];
    int32_t slots[2];
    sadmm_joint_def taken;
    TRY(sadmm_growing_take(&growing, &taken, def, "def", error)); /* its frames have the same place in all versions */
    TRY(sadmm_check_given(position, "position", error));
    TRY(sadmm_check_given(orientation, "orientation", error));
    TRY(find_sides(world, &taken, slots, error));
    TRY(sadmm_check_vector("position", position, 3, FRAME_LIMIT, error));
    TRY(sadmm_check_orientation("orientation", orientation, unit, error));
    TRY(sadmm_world_download_bodies(world));
    for (int s = 0; s < 2; ++s) {
        static const struct sadmm_rigid origin = {.orientation = {1, 0, 0, 0}};
        const struct sadmm_rigid *body = slots[s] >= 0 ? pose_of(world, slots[s]) : &origin;
        const quat back = q_conjugate(q_load(body->orientation));
        v3_store(q_turn(back, v3_sub(v3_load(position), v3_load(body->position))),
                 s ? def->position_b : def->position_a);
        q_store(q_normalize(q_mul(back, q_load(unit))), s ? def->orientation_b : def->orientation_a);
    }
    return SADMM_OK;
}

/* ---- state ------------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_joint_state(sadmm_world *world, sadmm_joint_id id, sadmm_joint_state *state)
{
    TRY(sadmm_check_given(world, "world", NULL));
    const struct sadmm_world_joint *joint = sadmm_world_find_joint(world, id, "id", &world->error);
    if (!joint) return SADMM_ERROR_STALE_ID;
    TRY(sadmm_check_given(state, "state", &world->error));
    TRY(sadmm_world_download_bodies(world));
    TRY(sadmm_world_download_joints(world));
    const struct sadmm_joint_memory *last = &joint->last;
    memset(state, 0, sizeof *state);
    sadmm_world_read_joint_motion(world, joint, state->position, state->speed);
    memcpy(state->point, last->point, sizeof state->point);
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        state->wrench_b[k] = last->wrench[k];
        state->wrench_a[k] = 0 - last->wrench[k];
        state->wrench_joint[k] = last->local[k];
        state->lock_force[k] = last->force[SADMM_ROLE_LOCK][k];
        state->limit_force[k] = last->force[SADMM_ROLE_LOWER][k] + last->force[SADMM_ROLE_UPPER][k];
        state->drive_force[k] = last->force[SADMM_ROLE_DRIVE][k];
        state->friction_force[k] = last->force[SADMM_ROLE_FRICTION][k];
        state->spring_force[k] = last->force[SADMM_ROLE_SPRING][k];
        state->armature_force[k] = last->force[SADMM_ROLE_ARMATURE][k];
    }
    state->broken = last->broken;
    return SADMM_OK;
}
