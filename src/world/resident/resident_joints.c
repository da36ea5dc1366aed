/* Joints and gears of a world that a backend keeps (resident.h): what it is given, what changes, what comes back. */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/gear_law.h"
#include "resident_joints.h"
#include "world/step/joint_rows.h"

/* ---- to the backend ---------------------------------------------------------------------------------------------- */

static struct sadmm_resident_joint joint_for_backend(const sadmm_world *world, const struct sadmm_world_joint *joint)
{
    struct sadmm_resident_joint out = {
        .def = joint->def, .constraints = sadmm_joint_constraints(joint), .coupling = -1};
    for (int s = 0; s < 2; ++s) {
        const struct sadmm_world_body *body = joint->body[s] >= 0 ? &world->bodies[joint->body[s]] : NULL;
        out.body[s] = body ? body->system_body : -1;
        out.frame[s] = joint->frame[s];
        if (!body || sadmm_body_moves(out.body[s])) continue;
        const struct joint_end end = joint_end_on(&joint->frame[s], &body->rigid);
        out.frame[s] = (struct joint_frame){end.point, end.orientation};
    }
    return out;
}

/* Tables of a joint's springs, after those that are listed. */
static bool list_tables(sadmm_world *world, const struct sadmm_world_joint *joint, struct sadmm_resident_joint *out)
{
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        const size_t at = world->resident.table_numbers, numbers = 2 * (size_t)joint->table_count[k];
        if (!joint->table[k]) continue;
        if (!SADMM_GROW(world->resident.tables, at, at + numbers)) return false;
        memcpy(world->resident.tables + at, joint->table[k], numbers * sizeof *world->resident.tables);
        out->table[k] = (int32_t)at;
        out->points[k] = joint->table_count[k];
        world->resident.table_numbers += numbers;
    }
    return true;
}

sadmm_status sadmm_world_list_joints(sadmm_world *world)
{
    const size_t count = world->step_joint_count;
    world->resident.joint_count = world->resident.joint_constraints = world->resident.coupling_count = 0;
    world->resident.dirty_joint_count = 0;
    world->resident.table_numbers = 0;
    if (world->table_count > INT32_MAX / (2 * SADMM_MOST_SPRING_POINTS))
        return sadmm_fail(&world->error, SADMM_ERROR_LIMIT, "%d tables of springs: a backend holds at most %d",
                          world->table_count, INT32_MAX / (2 * SADMM_MOST_SPRING_POINTS));
    if (!SADMM_GROW(world->resident.joints, 0, count) || !SADMM_GROW(world->resident.memory, 0, count) ||
        !SADMM_GROW(world->resident.coupling_memory, 0, (size_t)world->coupling_ids.count) ||
        !SADMM_GROW(world->resident.dirty_joints, 0, count))
        return sadmm_fail_memory(&world->error, "joints for the backend");
    for (size_t i = 0; i < count; ++i) {
        struct sadmm_world_joint *joint = world->step_joints[i];
        world->resident.joints[i] = joint_for_backend(world, joint);
        if (!list_tables(world, joint, &world->resident.joints[i]))
            return sadmm_fail_memory(&world->error, "joints for the backend");
        world->resident.memory[i] = joint->last;
        if (joint->coupling) {
            world->resident.joints[i].coupling = world->resident.coupling_count;
            world->resident.coupling_memory[world->resident.coupling_count++] =
                world->couplings[joint->coupling - 1].last;
        }
        joint->resident_constraints = world->resident.joints[i].constraints;
        world->resident.joint_constraints += joint->resident_constraints;
        joint->dirty = 0;
        for (int update = 0; update < SADMM_JOINT_UPDATES; ++update) joint->set_at[update] = -1;
    }
    world->resident.joint_count = (int32_t)count;
    return SADMM_OK;
}

static struct sadmm_resident_gear gear_for_backend(const sadmm_world *world, const struct sadmm_world_gear *gear)
{
    const sadmm_gear_def *def = &gear->def;
    struct sadmm_resident_gear out = {.coordinate = {def->coordinate_1, def->coordinate_2},
                                      .ratio = def->ratio,
                                      .offset = def->offset,
                                      .enabled = def->enabled};
    int32_t side[GEAR_JOINTS][2];
    for (int i = 0; i < GEAR_JOINTS; ++i) {
        out.joint[i] = world->joints[gear->joint[i]].number;
        for (int s = 0; s < 2; ++s) {
            const int32_t body = world->resident.joints[out.joint[i]].body[s];
            side[i][s] = body >= 0 ? body : -1;
        }
    }
    gear_row_bodies(side, out.body);
    return out;
}

sadmm_status sadmm_world_list_gears(sadmm_world *world)
{
    const size_t count = (size_t)world->gear_ids.count;
    size_t g = 0;
    if (!SADMM_GROW(world->resident.gears, 0, count) || !SADMM_GROW(world->resident.gear_force, 0, count))
        return sadmm_fail_memory(&world->error, "gears for the backend");
    for (SADMM_OBJECTS(slot, &world->gear_ids)) {
        struct sadmm_world_gear *gear = &world->gears[slot];
        world->resident.gears[g] = gear_for_backend(world, gear);
        world->resident.gear_force[g++] = gear->last.force;
        gear->dirty = false;
        gear->set_at = -1;
    }
    world->resident.gear_count = (int32_t)g;
    world->resident.gears_dirty = false;
    world->resident.joint_constraints += (int32_t)g;
    return SADMM_OK;
}

/* ---- updates ----------------------------------------------------------------------------------------------------- */

void sadmm_world_update_gear(sadmm_world *world, struct sadmm_world_gear *gear)
{
    if (!world->resident.loaded) return;
    gear->dirty = world->resident.gears_dirty = true;
    gear->set_at = world->resident.enqueued;
}

static void update_gears_again(sadmm_world *world)
{
    for (SADMM_OBJECTS(slot, &world->gear_ids)) {
        struct sadmm_world_gear *gear = &world->gears[slot];
        if (gear->set_at < world->resident.done) continue;
        gear->dirty = world->resident.gears_dirty = true;
        gear->set_at = world->resident.done;
    }
}

static void forget_gear_updates(sadmm_world *world)
{
    for (SADMM_OBJECTS(slot, &world->gear_ids)) world->gears[slot].dirty = false;
    world->resident.gears_dirty = false;
}

/* Room is there. */
static void list_gear_updates(sadmm_world *world, size_t *count)
{
    int32_t g = 0;
    if (!world->resident.gears_dirty) return;
    for (SADMM_OBJECTS(slot, &world->gear_ids)) {
        const struct sadmm_world_gear *gear = &world->gears[slot];
        if (gear->dirty)
            world->resident.updates[(*count)++] =
                (struct sadmm_resident_update){SADMM_UPDATE_GEAR, g, {gear->def.enabled}};
        ++g;
    }
}

static void mark(sadmm_world *world, struct sadmm_world_joint *joint, uint32_t updates)
{
    if (updates && !joint->dirty) world->resident.dirty_joints[world->resident.dirty_joint_count++] = joint->number;
    joint->dirty |= updates;
}

bool sadmm_world_update_joint(sadmm_world *world, struct sadmm_world_joint *joint, enum sadmm_joint_update update)
{
    if (!world->resident.loaded) return true;
    if (sadmm_joint_constraints(joint) > joint->resident_constraints) return false;
    mark(world, joint, UINT32_C(1) << update);
    joint->set_at[update] = world->resident.enqueued;
    return true;
}

void sadmm_world_update_joints_again(sadmm_world *world)
{
    for (int32_t i = 0; i < world->resident.joint_count; ++i) {
        struct sadmm_world_joint *joint = world->step_joints[i];
        for (int update = 0; update < SADMM_JOINT_UPDATES; ++update) {
            if (joint->set_at[update] < world->resident.done) continue;
            mark(world, joint, UINT32_C(1) << update);
            joint->set_at[update] = world->resident.done;
        }
    }
    update_gears_again(world);
}

void sadmm_world_forget_joint_updates(sadmm_world *world)
{
    for (size_t k = 0; k < world->resident.dirty_joint_count; ++k)
        world->step_joints[world->resident.dirty_joints[k]]->dirty = 0;
    world->resident.dirty_joint_count = 0;
    forget_gear_updates(world);
}

static void put_target(const struct sadmm_rigid *target, double values[SADMM_UPDATE_VALUES])
{
    memcpy(values, target->position, sizeof target->position);
    memcpy(values + 3, target->orientation, sizeof target->orientation);
    memcpy(values + 7, target->velocity, sizeof target->velocity);
}

sadmm_status sadmm_world_list_joint_updates(sadmm_world *world, size_t *count)
{
    const size_t gears = world->resident.gears_dirty ? (size_t)world->resident.gear_count : 0;
    if (!SADMM_GROW(world->resident.updates, *count,
                    *count + SADMM_JOINT_UPDATES * world->resident.dirty_joint_count + gears))
        return sadmm_fail_memory(&world->error, "changes of joints");
    for (size_t k = 0; k < world->resident.dirty_joint_count; ++k) {
        const struct sadmm_world_joint *joint = world->step_joints[world->resident.dirty_joints[k]];
        for (int update = 0; update < SADMM_JOINT_UPDATES; ++update) {
            if (!(joint->dirty >> update & 1)) continue;
            struct sadmm_resident_update *out = &world->resident.updates[(*count)++];
            memset(out, 0, sizeof *out);
            out->kind = SADMM_UPDATE_JOINT;
            out->target = SADMM_JOINT_TARGETS * joint->number + update;
            if (update == SADMM_JOINT_TARGET)
                put_target(&world->couplings[joint->coupling - 1].last.target, out->values);
            else if (update == SADMM_JOINT_ENABLED) out->values[0] = joint->def.enabled;
            else joint_coordinate_numbers(&joint->def.coordinates[update], out->values);
        }
    }
    list_gear_updates(world, count);
    return SADMM_OK;
}

/* ---- from the backend -------------------------------------------------------------------------------------------- */

/* A target that was set after the last step is newer than what the backend has. */
static void take_coupling(struct sadmm_world_coupling *coupling, bool target_set,
                          const struct sadmm_coupling_memory *memory)
{
    const struct sadmm_rigid target = coupling->last.target;
    coupling->last = *memory;
    if (target_set) coupling->last.target = target;
}

/* Whether a joint is enabled may have been set since the last step was done. */
sadmm_status sadmm_world_read_joints(sadmm_world *world)
{
    int32_t coupling = 0;
    size_t g = 0;
    TRY(world->kernels->resident->read_joints(world->context, world->resident.memory, world->resident.coupling_memory,
                                              world->resident.gear_force, &world->error));
    for (SADMM_OBJECTS(slot, &world->gear_ids)) world->gears[slot].last.force = world->resident.gear_force[g++];
    for (int32_t i = 0; i < world->resident.joint_count; ++i) {
        struct sadmm_world_joint *joint = world->step_joints[i];
        joint->last = world->resident.memory[i];
        if (joint->set_at[SADMM_JOINT_ENABLED] < world->resident.done)
            joint->def.enabled = joint->def.enabled && !joint->last.broken;
        else joint->last.broken = joint->last.broken && !joint->def.enabled;
        if (joint->coupling)
            take_coupling(&world->couplings[joint->coupling - 1],
                          joint->set_at[SADMM_JOINT_TARGET] >= world->resident.done,
                          &world->resident.coupling_memory[coupling++]);
    }
    return SADMM_OK;
}

sadmm_status sadmm_world_read_rows(sadmm_world *world)
{
    struct sadmm_rows *rows = &world->start.rows;
    const size_t constraints = (size_t)world->resident.joint_constraints, most = SADMM_MAX_ROWS * constraints;
    sadmm_rows_clear(rows);
    if (world->resident.joint_count == 0) return SADMM_OK;
    if (!sadmm_rows_reserve(rows, constraints, most) || !SADMM_GROW(world->resident.solution, 0, most) ||
        !SADMM_GROW(world->start.multiplier, 0, most))
        return sadmm_fail_memory(&world->error, "the joints' rows");
    TRY(world->kernels->resident->read_rows(world->context, rows, world->resident.solution, world->velocity,
                                              &world->error));
    memcpy(world->start.multiplier, rows->lambda, rows->row_count * sizeof *rows->lambda);
    memcpy(rows->lambda, world->resident.solution, rows->row_count * sizeof *rows->lambda);
    return SADMM_OK;
}
