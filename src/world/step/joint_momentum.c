/* Momentum and energy of islands with joints (core/model/joint_momentum.h). What each body adds is summed by itself,
 * contacts before rows, then over the bodies of the island, in order: as a device does. */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/joint_momentum.h"
#include "joint_momentum.h"

static bool is_floating(const sadmm_world *world, int32_t body)
{
    return joint_island_is_floating(world->joint_touch[world->joint_labels[body]]);
}

static struct joint_momentum *sums_of(const sadmm_world *world, int32_t body)
{
    return &world->joint_momentum[world->joint_number[body]];
}

static const double *origin_of(const sadmm_world *world, int32_t body)
{
    return world->start.rigid[world->joint_labels[body]].position;
}

/* The dynamic body of two where it is the only one, and in such an island; -1: else. */
static int32_t floating_alone(const sadmm_world *world, int32_t a, int32_t b)
{
    const int32_t body = a >= 0 ? a : b;
    return (a >= 0 && b >= 0) || !is_floating(world, body) ? -1 : body;
}

static void add_pair(const sadmm_world *world, const struct sadmm_contact_pair *pair, double dt)
{
    const int32_t body = floating_alone(world, pair->body_a, pair->body_b);
    if (body < 0) return;
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct sadmm_contact_point *point = &world->contacts.points[k];
        joint_add_static_point(sums_of(world, body), pair->normal, pair->friction, &world->start.rigid[body],
                               pair->body_a >= 0 ? point->arm_a : point->arm_b, origin_of(world, body), dt);
    }
}

static void add_rows(const sadmm_world *world, const struct sadmm_row_constraint *constraint, double dt)
{
    const struct sadmm_rows *rows = &world->start.rows;
    const int32_t body = floating_alone(world, constraint->body_a, constraint->body_b);
    if (body < 0) return;
    for (size_t r = (size_t)constraint->first; r < (size_t)(constraint->first + constraint->count); ++r)
        joint_add_static_row(sums_of(world, body),
                             (constraint->body_a >= 0 ? rows->jacobian_a : rows->jacobian_b) + 6 * r, rows->lambda[r],
                             &world->start.rigid[body], origin_of(world, body), dt);
}

static void add_body(const sadmm_world *world, int32_t i, const sadmm_settings *settings)
{
    const struct sadmm_rigid *next = &world->next[i];
    const struct sadmm_rigid *start = &world->start.rigid[i];
    const int bits = world->joint_touch[world->joint_labels[i]];
    double halfway[4];
    if (!joint_island_is_floating(bits)) return;
    if (world->spins_known && !rolling_is_stiff(start)) {
        joint_add_momentum_by(sums_of(world, i), start, &world->spins[i], next->position, next->orientation,
                              next->velocity, origin_of(world, i), bits, settings);
        return;
    }
    q_store(spin_turned_halfway(start, settings->dt), halfway);
    joint_add_momentum(sums_of(world, i), start, halfway, next->position, next->orientation, next->velocity,
                       origin_of(world, i), bits, settings);
}

/* To its island's first body, which names it. */
static void add_to_island(const sadmm_world *world, int32_t i)
{
    const int32_t label = world->joint_labels[i];
    if (!is_floating(world, i) || label == i) return;
    double *to = (double *)sums_of(world, label);
    const double *from = (const double *)sums_of(world, i);
    const int gram = sums_of(world, i)->sums.gram[MOMENTUM_CONTACTS] > 0 ? 0 : PACKED6 + 1; /* most have none */
    for (int k = 0; k < MOMENTUM_SUMS - gram; ++k) to[k] += from[k];
    for (int k = MOMENTUM_SUMS; k < JOINT_MOMENTUM_SUMS; ++k) to[k] += from[k];
}

static void restore(const sadmm_world *world, int32_t i)
{
    struct sadmm_rigid *next = &world->next[i];
    joint_restore(sums_of(world, world->joint_labels[i]), next->position, origin_of(world, i), next->velocity);
}

/* Numbers the bodies of such islands; how many they are. */
static size_t number_bodies(const sadmm_world *world)
{
    size_t count = 0;
    for (int32_t i = 0; i < world->dynamic_count; ++i)
        if (is_floating(world, i)) world->joint_number[i] = (int32_t)count++;
    return count;
}

sadmm_status sadmm_world_restore_articulated(sadmm_world *world, const sadmm_settings *settings)
{
    const int32_t n = world->dynamic_count;
    if (!SADMM_GROW(world->joint_number, 0, (size_t)n)) return sadmm_fail_memory(&world->error, "islands of joints");
    const size_t count = number_bodies(world);
    if (count == 0) return SADMM_OK;
    if (!SADMM_GROW(world->joint_momentum, 0, count)) return sadmm_fail_memory(&world->error, "islands of joints");
    for (size_t k = 0; k < count; ++k) memset(&world->joint_momentum[k], 0, sizeof *world->joint_momentum);
    for (size_t k = 0; k < world->contacts.pair_count; ++k) add_pair(world, &world->contacts.pairs[k], settings->dt);
    for (size_t k = 0; k < world->start.rows.constraint_count; ++k)
        add_rows(world, &world->start.rows.constraints[k], settings->dt);
    for (int32_t i = 0; i < n; ++i) add_body(world, i, settings);
    for (int32_t i = 0; i < n; ++i) add_to_island(world, i);
    for (int32_t i = 0; i < n; ++i) {
        const int32_t label = world->joint_labels[i];
        if (!is_floating(world, i)) continue;
        if (label == i) joint_restoring(sums_of(world, i), world->joint_touch[i], settings->dt); /* comes first */
        restore(world, i);
    }
    return SADMM_OK;
}
