/* Contacts that roll (core/model/rolling.h), to what bodies take along into the next (sub-)step. */
#include "core/model/joint_momentum.h"
#include "core/model/rolling.h"
#include "rolling.h"

/* A contact that rolls, to what a body takes along into the next step. */
static void keep_rolling(sadmm_world *world, const struct sadmm_contact_pair *pair, int32_t k, double dt)
{
    const struct sadmm_contact_point *point = &world->contacts.points[k];
    const struct sadmm_contact_migration *migration = &world->contacts.migrations[k];
    const struct rolling_halfway at = rolling_halfway_of(pair->normal, point, migration);
    const double push = sadmm_normal_impulse(pair, point);
    const int32_t body[2] = {pair->body_a, pair->body_b};
    for (int s = 0; s < 2; ++s) {
        if (body[s] < 0) continue;
        struct sadmm_rigid *next = &world->next[body[s]];
        const double *arm = s ? point->arm_b : point->arm_a;
        rolling_begin(next);
        if (point->migrates >= MIGRATES_SOON) next->rolls |= ROLLING_TURNS_ON; /* on a round surface */
        rolling_owe(pair->normal, arm, at.normal, s ? at.arm_b : at.arm_a, point->impulse, s ? 1 : -1, next->owed);
        rolling_stiffen(pair->normal, rolling_height(pair->normal, arm, point->separation), migration->radius, push, dt,
                        next->stiffness);
    }
}

/* Between bodies of an island whose momentum has been restored: it has what such a contact owes already, in sum. */
static bool is_restored(const sadmm_world *world, const struct sadmm_contact_pair *pair)
{
    return world->start.rows.constraint_count > 0 && pair->body_a >= 0 && pair->body_b >= 0 &&
           joint_island_is_floating(world->joint_touch[world->joint_labels[pair->body_a]]);
}

static bool is_articulated(const sadmm_world *world, int32_t body)
{
    return world->start.rows.constraint_count > 0 &&
           world->joint_touch[world->joint_labels[body]] & ISLAND_ARTICULATED;
}

void sadmm_world_keep_rolling(sadmm_world *world, double dt)
{
    const struct sadmm_contact_set *contacts = &world->contacts;
    if (contacts->migrating == 0) return;
    for (size_t p = 0; p < contacts->pair_count; ++p)
        for (int32_t k = contacts->pairs[p].first; k < contacts->pairs[p].first + contacts->pairs[p].count; ++k)
            if (contacts->points[k].migrates && !is_restored(world, &contacts->pairs[p]))
                keep_rolling(world, &contacts->pairs[p], k, dt);
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        struct sadmm_rigid *next = &world->next[i];
        if (next->rolls)
            rolling_keep(next, world->start.rigid[i].position, dt, is_articulated(world, i) || !rolling_turns_on(next),
                         next->owed, next->stiffness);
    }
}
