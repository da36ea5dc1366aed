#include "save_joints.h"

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "save_parts.h"
#include "world/objects/coupling.h"
#include "world/objects/gear.h"
#include "world/objects/joint.h"
#include "world/objects/joint_slots.h"

LISTED(struct sadmm_joint_memory, 704);

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
    SADMM_ARCHIVE(archive, m->expected);
    SADMM_ARCHIVE(archive, m->missed);
    sadmm_archive_flag(archive, &m->trapezoid_off);
    sadmm_archive_flag(archive, &m->followed);
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

static bool memory_fits(const struct sadmm_joint_memory *m)
{
    return sadmm_all_finite(m->force[0], SADMM_ROLE_COUNT * JOINT_COORDINATES) &&
           sadmm_all_finite(m->angle, JOINT_COORDINATES) && sadmm_all_finite(m->wrench, 6) &&
           sadmm_all_finite(m->point, 3) && sadmm_all_finite(m->local, 6) &&
           sadmm_all_finite(m->left, JOINT_COORDINATES) && sadmm_all_finite(m->expected, JOINT_COORDINATES) &&
           sadmm_all_finite(m->missed, JOINT_COORDINATES);
}

static bool joint_fits(const sadmm_world *world, struct sadmm_world_joint *joint, struct sadmm_error *error)
{
    return sadmm_world_read_joint(world, joint, error) == SADMM_OK && memory_fits(&joint->last);
}

static void archive_joint(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_joint *joint = &world->joints[slot];
    archive_joint_def(archive, &joint->def);
    for (int k = 0; k < JOINT_COORDINATES; ++k) archive_table(archive, world, joint, k);
    archive_joint_memory(archive, &joint->last);
    if (archive->reading && archive->status == SADMM_OK &&
        sadmm_archive_expect(archive, joint_fits(world, joint, archive->error), "a joint"))
        sadmm_world_link_joint(world, slot);
}

/* ---- gears and couplings ----------------------------------------------------------------------------------------- */

static bool gear_fits(const sadmm_world *world, struct sadmm_world_gear *gear, struct sadmm_error *error)
{
    return sadmm_world_read_gear(world, gear, error) == SADMM_OK && sadmm_all_finite(&gear->def.offset, 1) &&
           sadmm_all_finite(&gear->last.force, 1);
}

static void archive_gear(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_gear *gear = &world->gears[slot];
    sadmm_archive_fields(archive, sadmm_gear_table, SADMM_GEAR_FIELDS_COUNT, &gear->def);
    SADMM_ARCHIVE(archive, gear->last);
    if (archive->reading && archive->status == SADMM_OK &&
        sadmm_archive_expect(archive, gear_fits(world, gear, archive->error), "a gear"))
        sadmm_world_link_gear(world, slot);
}

/* A target moves on by its velocity, beyond where one may be set. */
static bool target_fits(const struct sadmm_rigid *target, struct sadmm_error *error)
{
    double ignored[4];
    return sadmm_all_finite(target->position, 3) && sadmm_all_finite(target->velocity, 6) &&
           sadmm_check_orientation("orientation", target->orientation, ignored, error) == SADMM_OK;
}

static bool coupling_fits(const sadmm_world *world, struct sadmm_world_coupling *coupling, struct sadmm_error *error)
{
    return sadmm_world_read_coupling(world, coupling, error) == SADMM_OK && memory_fits(&coupling->joint.last) &&
           target_fits(&coupling->last.target, error) && sadmm_all_finite(coupling->last.reaction, 6) &&
           sadmm_all_finite(coupling->last.body, 6);
}

static void archive_coupling(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_coupling *coupling = &world->couplings[slot];
    sadmm_archive_fields(archive, sadmm_coupling_table, SADMM_COUPLING_FIELDS_COUNT, &coupling->def);
    archive_joint_memory(archive, &coupling->joint.last);
    SADMM_ARCHIVE(archive, coupling->last.target.position);
    SADMM_ARCHIVE(archive, coupling->last.target.orientation);
    SADMM_ARCHIVE(archive, coupling->last.target.velocity);
    SADMM_ARCHIVE(archive, coupling->last.reaction);
    SADMM_ARCHIVE(archive, coupling->last.body);
    if (archive->reading && archive->status == SADMM_OK &&
        sadmm_archive_expect(archive, coupling_fits(world, coupling, archive->error), "a coupling"))
        sadmm_world_link_coupling(world, slot);
}

#define LIST(object, objects)                                                                                       \
    sadmm_archive_list(archive, world, &world->object##_ids, &world->objects, sizeof *world->objects, archive_##object)

void sadmm_archive_joints(struct sadmm_archive *archive, sadmm_world *world)
{
    LIST(joint, joints);
    sadmm_archive_pairs(archive, &world->jointed_pairs, world->body_ids.slots);
    LIST(gear, gears);
    LIST(coupling, couplings);
}
