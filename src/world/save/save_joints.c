#include "save_joints.h"

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "save_parts.h"
#include "world/objects/coupling.h"
#include "world/objects/gear.h"
#include "world/objects/joint.h"
#include "world/objects/joint_slots.h"

LISTED(struct sadmm_joint_memory, 560);

static void archive_joint_def(struct sadmm_archive *archive, sadmm_joint_def *def)
{
    sadmm_archive_fields(archive, sadmm_joint_table, SADMM_JOINT_FIELDS_COUNT, def);
    for (int k = 0; k < JOINT_COORDINATES; ++k)
        sadmm_archive_fields(archive, sadmm_coordinate_table, SADMM_COORDINATE_FIELDS_COUNT, &def->coordinates[k]);
}

static void archive_joint_memory(struct sadmm_archive *archive, struct sadmm_joint_memory *m)
{
    SADMM_ARCHIVE(archive, m->force);
    SADMM_ARCHIVE(archive, m->angle);
    SADMM_ARCHIVE(archive, m->wrench);
    SADMM_ARCHIVE(archive, m->point);
    SADMM_ARCHIVE(archive, m->local);
    SADMM_ARCHIVE(archive, m->left);
    sadmm_archive_flag(archive, &m->trapezoid_off);
    sadmm_archive_flag(archive, &m->broken);
}

static void archive_table(struct sadmm_archive *archive, sadmm_world *world, struct sadmm_world_joint *joint, int k)
{
    int32_t *count = &joint->table_count[k];
    sadmm_archive_count32(archive, count, 2 * sizeof(double), SADMM_MOST_SPRING_POINTS);
    const size_t numbers = 2 * (size_t)*count;
    if (archive->reading && (numbers == 0 || !sadmm_archive_room(archive, &joint->table[k], numbers, sizeof(double)))) {
        *count = 0;
        return;
    }
    if (numbers > 0) sadmm_archive_bytes(archive, joint->table[k], numbers * sizeof(double));
    if (!archive->reading) return;
    world->table_count += *count > 0;
    sadmm_archive_expect(archive,
                         sadmm_world_check_table(joint->table[k], joint->table[k] + *count, *count, archive->error) ==
                             SADMM_OK,
                         "a spring's table");
}

/* The body that a joint is on, and its id. */
static bool side_fits(const sadmm_world *world, int32_t slot, sadmm_body_id id)
{
    if (slot == -1) return id.slot == 0;
    return slot >= 0 && (size_t)slot < world->body_slots && world->bodies[slot].alive &&
           id.slot == (uint32_t)slot + 1 && id.generation == world->bodies[slot].generation;
}

static bool joint_fits(const sadmm_world *world, const struct sadmm_world_joint *joint, struct sadmm_error *error)
{
    const sadmm_joint_def *def = &joint->def;
    const struct joint_frame *frame = joint->frame;
    int dynamic = 0;
    for (int s = 0; s < 2; ++s) {
        if (!side_fits(world, joint->body[s], s ? def->body_b : def->body_a)) return false;
        dynamic += joint->body[s] >= 0 && world->bodies[joint->body[s]].type == SADMM_BODY_DYNAMIC;
        const double numbers[] = {frame[s].position.x,    frame[s].position.y,    frame[s].position.z,
                                  frame[s].orientation.w, frame[s].orientation.x, frame[s].orientation.y,
                                  frame[s].orientation.z};
        if (!sadmm_all_finite(numbers, 7)) return false;
    }
    if (dynamic == 0 || joint->body[0] == joint->body[1]) return false;
    if (sadmm_world_check_joint_def(def, error) != SADMM_OK) return false;
    for (int role = 0; role < SADMM_ROLE_COUNT; ++role)
        if (!sadmm_all_finite(joint->last.force[role], JOINT_COORDINATES)) return false;
    return sadmm_all_finite(joint->last.angle, JOINT_COORDINATES) && sadmm_all_finite(joint->last.wrench, 6) &&
           sadmm_all_finite(joint->last.point, 3) && sadmm_all_finite(joint->last.local, 6) &&
           sadmm_all_finite(joint->last.left, JOINT_COORDINATES);
}

static void archive_joint(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_joint *joint = &world->joints[slot];
    sadmm_archive_flag(archive, &joint->alive);
    SADMM_ARCHIVE(archive, joint->generation);
    if (!joint->alive) return;
    SADMM_ARCHIVE(archive, joint->coupling);
    archive_joint_def(archive, &joint->def);
    SADMM_ARCHIVE(archive, joint->body);
    SADMM_ARCHIVE(archive, joint->frame);
    for (int k = 0; k < JOINT_COORDINATES; ++k) archive_table(archive, world, joint, k);
    archive_joint_memory(archive, &joint->last);
    if (!archive->reading) return;
    ++world->joint_count;
    if (archive->status == SADMM_OK &&
        sadmm_archive_expect(archive, joint_fits(world, joint, archive->error), "a joint"))
        sadmm_world_link_joint(world, slot);
}

static void archive_joint_list(struct sadmm_archive *archive, sadmm_world *world)
{
    size_t slots = world->joint_slots;
    sadmm_archive_count(archive, &slots, 5, SADMM_MOST_SLOTS);
    if (archive->reading && !sadmm_world_reserve_joints(world, slots)) {
        sadmm_archive_fail_memory(archive);
        return;
    }
    world->joint_slots = slots;
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) archive_joint(archive, world, slot);
    sadmm_archive_pairs(archive, &world->jointed_pairs, world->body_slots);
}

/* ---- gears and couplings ----------------------------------------------------------------------------------------- */

static bool gear_fits(const sadmm_world *world, const struct sadmm_world_gear *gear, struct sadmm_error *error)
{
    const sadmm_gear_def *def = &gear->def;
    return sadmm_world_check_gear(world, def, error) == SADMM_OK && gear->joint[0] == def->joint_1.slot - 1 &&
           gear->joint[1] == def->joint_2.slot - 1 && sadmm_all_finite(&def->offset, 1) &&
           sadmm_all_finite(&gear->last.force, 1);
}

static void archive_gear(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_gear *gear = &world->gears[slot];
    uint64_t joint[2] = {gear->joint[0], gear->joint[1]};
    sadmm_archive_flag(archive, &gear->alive);
    SADMM_ARCHIVE(archive, gear->generation);
    if (!gear->alive) return;
    sadmm_archive_fields(archive, sadmm_gear_table, SADMM_GEAR_FIELDS_COUNT, &gear->def);
    SADMM_ARCHIVE(archive, joint);
    SADMM_ARCHIVE(archive, gear->last);
    if (!archive->reading) return;
    for (int s = 0; s < 2; ++s) gear->joint[s] = (size_t)joint[s];
    ++world->gear_count;
    if (archive->status == SADMM_OK && sadmm_archive_expect(archive, gear_fits(world, gear, archive->error), "a gear"))
        sadmm_world_link_gear(world, slot);
}

static void archive_gears(struct sadmm_archive *archive, sadmm_world *world)
{
    size_t slots = world->gear_slots;
    sadmm_archive_count(archive, &slots, 5, SADMM_MOST_SLOTS);
    if (archive->reading && !(sadmm_archive_room(archive, &world->gears, slots, sizeof *world->gears) &&
                              sadmm_slots_reserve(&world->gears_taken, slots))) {
        sadmm_archive_fail_memory(archive);
        return;
    }
    world->gear_slots = slots;
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) archive_gear(archive, world, slot);
}

/* A target moves on by its velocity, beyond where one may be set. */
static bool target_fits(const struct sadmm_rigid *target, struct sadmm_error *error)
{
    double ignored[4];
    return sadmm_all_finite(target->position, 3) && sadmm_all_finite(target->velocity, 6) &&
           sadmm_check_orientation("orientation", target->orientation, ignored, error) == SADMM_OK;
}

static bool coupling_fits(const sadmm_world *world, size_t slot, struct sadmm_error *error)
{
    const struct sadmm_world_coupling *coupling = &world->couplings[slot];
    if (coupling->joint >= world->joint_slots) return false;
    const struct sadmm_world_joint *joint = &world->joints[coupling->joint];
    return joint->alive && joint->coupling == (int32_t)slot + 1 && joint->body[0] == -1 &&
           side_fits(world, joint->body[1], coupling->def.body) &&
           sadmm_world_check_coupling(&coupling->def, error) == SADMM_OK &&
           target_fits(&coupling->last.target, error) && sadmm_all_finite(coupling->last.reaction, 6) &&
           sadmm_all_finite(coupling->last.body, 6);
}

static void archive_coupling(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_coupling *coupling = &world->couplings[slot];
    uint64_t joint = coupling->joint;
    sadmm_archive_flag(archive, &coupling->alive);
    SADMM_ARCHIVE(archive, coupling->generation);
    if (!coupling->alive) return;
    sadmm_archive_fields(archive, sadmm_coupling_table, SADMM_COUPLING_FIELDS_COUNT, &coupling->def);
    SADMM_ARCHIVE(archive, joint);
    SADMM_ARCHIVE(archive, coupling->last.target.position);
    SADMM_ARCHIVE(archive, coupling->last.target.orientation);
    SADMM_ARCHIVE(archive, coupling->last.target.velocity);
    SADMM_ARCHIVE(archive, coupling->last.reaction);
    SADMM_ARCHIVE(archive, coupling->last.body);
    if (!archive->reading) return;
    coupling->joint = (size_t)joint;
    ++world->coupling_count;
    sadmm_slots_take(&world->couplings_taken, slot);
    if (archive->status == SADMM_OK)
        sadmm_archive_expect(archive, coupling_fits(world, slot, archive->error), "a coupling");
}

static void archive_couplings(struct sadmm_archive *archive, sadmm_world *world)
{
    size_t slots = world->coupling_slots, of_couplings = 0;
    sadmm_archive_count(archive, &slots, 5, SADMM_MOST_SLOTS);
    if (archive->reading && !(sadmm_archive_room(archive, &world->couplings, slots, sizeof *world->couplings) &&
                              sadmm_slots_reserve(&world->couplings_taken, slots))) {
        sadmm_archive_fail_memory(archive);
        return;
    }
    world->coupling_slots = slots;
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) archive_coupling(archive, world, slot);
    for (size_t slot = 0; slot < world->joint_slots; ++slot)
        of_couplings += world->joints[slot].alive && world->joints[slot].coupling;
    if (archive->reading)
        sadmm_archive_expect(archive, of_couplings == (size_t)world->coupling_count, "the joints of couplings");
}

void sadmm_archive_joints(struct sadmm_archive *archive, sadmm_world *world)
{
    archive_joint_list(archive, world);
    archive_gears(archive, world);
    archive_couplings(archive, world);
}
