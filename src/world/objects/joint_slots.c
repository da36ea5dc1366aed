#include "joint_slots.h"

#include "core/base/memory.h"
#include "world/state/ids.h"

/* The pair that does not meet for this joint. */
static bool leaves_out(const struct sadmm_world_joint *joint, uint64_t *key)
{
    if (joint->def.collide || joint->body[0] < 0 || joint->body[1] < 0) return false;
    *key = sadmm_pair_key((size_t)joint->body[0], (size_t)joint->body[1]);
    return true;
}

static sadmm_status add_pair(sadmm_world *world, const struct sadmm_world_joint *joint)
{
    uint64_t key;
    if (!leaves_out(joint, &key)) return SADMM_OK;
    const double *before = sadmm_pair_table_find(&world->jointed_pairs, key);
    return sadmm_pair_table_set(&world->jointed_pairs, key, (before ? *before : 0) + 1, &world->error);
}

static void remove_pair(sadmm_world *world, const struct sadmm_world_joint *joint)
{
    uint64_t key;
    if (leaves_out(joint, &key)) sadmm_pair_table_lower(&world->jointed_pairs, key);
}

static struct sadmm_link *joint_link(sadmm_world *world, uint32_t name)
{
    return &world->joints[(name - 1) / 2].on_body[(name - 1) % 2];
}

static struct sadmm_link *gear_link(sadmm_world *world, uint32_t name)
{
    return &world->gears[(name - 1) / 2].on_joint[(name - 1) % 2];
}

static uint32_t link_name(size_t slot, int side) { return 2 * (uint32_t)slot + (uint32_t)side + 1; }

void sadmm_world_link_joint(sadmm_world *world, size_t slot)
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    for (int s = 0; s < 2; ++s)
        if (joint->body[s] >= 0)
            sadmm_link_add(world, joint_link, &world->bodies[joint->body[s]].first_joint, link_name(slot, s));
}

static void unlink_joint(sadmm_world *world, size_t slot)
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    for (int s = 0; s < 2; ++s)
        if (joint->body[s] >= 0)
            sadmm_link_remove(world, joint_link, &world->bodies[joint->body[s]].first_joint, link_name(slot, s));
}

void sadmm_world_link_gear(sadmm_world *world, size_t slot)
{
    for (int s = 0; s < 2; ++s)
        sadmm_link_add(world, gear_link, &world->joints[world->gears[slot].joint[s]].first_gear, link_name(slot, s));
}

sadmm_status sadmm_world_insert_joint(sadmm_world *world, const struct sadmm_world_joint *joint, size_t *slot)
{
    TRY(sadmm_ids_next(&world->joint_ids, slot, &world->error));
    if (!SADMM_GROW(world->joints, world->joint_ids.slots, *slot + 1))
        return sadmm_fail_memory(&world->error, "a joint");
    TRY(sadmm_tags_set(&world->joint_ids.tags, *slot, joint->def.name, joint->def.user_data, &world->error));
    TRY(add_pair(world, joint));
    sadmm_ids_take(&world->joint_ids, *slot);
    world->joints[*slot] = *joint;
    world->joints[*slot].def.name = NULL; /* both are in the tags */
    world->joints[*slot].def.user_data = NULL;
    sadmm_world_link_joint(world, *slot);
    return SADMM_OK;
}

void sadmm_world_put_table(sadmm_world *world, size_t slot, int index, double *table, int32_t count)
{
    struct sadmm_world_joint *joint = &world->joints[slot];
    world->table_count += (count > 0) - (joint->table_count[index] > 0);
    sadmm_free(joint->table[index]);
    joint->table[index] = table;
    joint->table_count[index] = count;
}

void sadmm_world_free_tables(sadmm_world *world)
{
    for (size_t slot = 0; slot < world->joint_ids.slots; ++slot)
        for (int k = 0; k < JOINT_COORDINATES; ++k) sadmm_world_put_table(world, slot, k, NULL, 0);
}

void sadmm_world_kill_gear(sadmm_world *world, size_t slot)
{
    const struct sadmm_world_gear *gear = &world->gears[slot];
    for (int s = 0; s < 2; ++s)
        sadmm_link_remove(world, gear_link, &world->joints[gear->joint[s]].first_gear, link_name(slot, s));
    sadmm_ids_release(&world->gear_ids, slot);
}

void sadmm_world_kill_joint(sadmm_world *world, size_t slot)
{
    struct sadmm_world_joint *joint = &world->joints[slot];
    remove_pair(world, joint);
    while (joint->first_gear) sadmm_world_kill_gear(world, (joint->first_gear - 1) / 2);
    unlink_joint(world, slot);
    for (int k = 0; k < JOINT_COORDINATES; ++k) sadmm_world_put_table(world, slot, k, NULL, 0);
    sadmm_ids_release(&world->joint_ids, slot);
}

void sadmm_world_kill_joints_of(sadmm_world *world, int32_t body)
{
    const uint32_t *first = &world->bodies[body].first_joint;
    while (*first) sadmm_world_kill_joint(world, (*first - 1) / 2);
}
