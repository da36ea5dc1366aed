/* Positions after a (sub-)step in islands with joints, from the velocities that the solve found
 * (core/model/joint_trapezoid.h). */
#include <string.h>

#include "core/base/memory.h"
#include "core/math/momentum.h"
#include "core/model/islands.h"
#include "core/model/joint_trapezoid.h"
#include "gather.h"
#include "joint_close.h"
#include "joint_momentum.h"
#include "joint_move.h"
#include "joint_variants.h"

static const struct joint_trapezoid *trapezoid_of(const sadmm_world *world, int32_t body, double dt)
{
    static const struct joint_trapezoid unmoved = {0};
    if (body < 0) return &unmoved;
    struct joint_trapezoid *kept = &world->joint_trapezoids[body];
    if (!kept->rigid)
        *kept = joint_trapezoid_of(&world->start.rigid[body], world->velocity + 6 * (size_t)body, dt);
    return kept;
}

static uint16_t *island_of(const sadmm_world *world, int32_t a, int32_t b)
{
    return &world->joint_touch[world->joint_labels[a >= 0 ? a : b]];
}

static void add_constraint(const sadmm_world *world, const struct sadmm_row_constraint *constraint,
                           const sadmm_settings *settings)
{
    const struct sadmm_rows *rows = &world->start.rows;
    const int32_t body[2] = {constraint->body_a, constraint->body_b};
    uint16_t *island = island_of(world, constraint->body_a, constraint->body_b);
    struct joint_trapezoid bodies[2];
    int moorings = 0, bits = ISLAND_ARTICULATED;
    const bool between = body[0] >= 0 && body[1] >= 0;
    bool known = false;
    for (int s = 0; s < 2; ++s) bodies[s].rigid = body[s] >= 0 ? &world->start.rigid[body[s]] : NULL;
    for (int32_t k = 0; k < constraint->count; ++k) {
        const size_t r = (size_t)(constraint->first + k);
        const struct sadmm_joint_source *source = &world->joint_sources[r];
        if (between && source->role == SADMM_ROLE_LOCK && source->slack < INFINITY) continue; /* as most: nothing */
        for (int s = 0; !known && joint_row_limits(source, rows->lambda[r]) && s < 2; ++s)
            bodies[s] = *trapezoid_of(world, body[s], settings->dt), known = s;
        moorings |= joint_mooring(source, rows->lambda[r], bodies);
        bits |= joint_row_touches(source, rows->lambda[r], rows->jacobian_a + 6 * r, rows->jacobian_b + 6 * r, bodies,
                                  settings);
    }
    *island |= (uint16_t)(bits | (moorings == JOINT_MOORED_WHOLLY ? ISLAND_ANCHORED : 0));
}

/* A static pair that leaves its island no motion. */
static bool anchors(const struct sadmm_contact_set *contacts, const struct sadmm_contact_pair *pair)
{
    struct arm_sums arms = {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
    if (pair->body_a >= 0 && pair->body_b >= 0) return false;
    for (int32_t p = pair->first; p < pair->first + pair->count; ++p)
        add_arm(&arms, pair->body_a >= 0 ? contacts->points[p].arm_a : contacts->points[p].arm_b, 1);
    return momentum_is_anchored(pair->friction, &arms);
}

static void find_islands(const sadmm_world *world, const struct sadmm_system *system, const sadmm_settings *settings)
{
    const struct sadmm_contact_set *contacts = system->contacts;
    sadmm_islands(system, world->joint_labels);
    for (int32_t i = 0; i < system->body_count; ++i) world->joint_trapezoids[i].rigid = NULL;
    memset(world->joint_touch, 0, (size_t)system->body_count * sizeof *world->joint_touch);
    for (size_t k = 0; k < system->rows->constraint_count; ++k)
        add_constraint(world, &system->rows->constraints[k], settings);
    for (size_t k = 0; k < contacts->pair_count; ++k) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[k];
        uint16_t *island = island_of(world, pair->body_a, pair->body_b);
        if (!(*island & ISLAND_ARTICULATED)) continue;
        *island |= ISLAND_TOUCHED | (anchors(contacts, pair) ? ISLAND_ANCHORED : 0);
        if (*island & ISLAND_TRAPEZOID_OFF) continue;
        const struct joint_trapezoid bodies[2] = {*trapezoid_of(world, pair->body_a, settings->dt),
                                                  *trapezoid_of(world, pair->body_b, settings->dt)};
        struct trapezoid_touch touch = {0, {0, 0}};
        for (int32_t p = pair->first; p < pair->first + pair->count; ++p)
            joint_contact_touches(pair->normal, &contacts->points[p],
                                  sadmm_migration_of(contacts->points, contacts->migrations, p), bodies, settings,
                                  &touch);
        if (sadmm_pair_is_kinematic(system, pair) || joint_contacts_hold(&touch, bodies))
            *island |= ISLAND_TRAPEZOID_OFF;
    }
}

static void move_bodies(sadmm_world *world, double dt)
{
    const struct sadmm_joint_kernels *kernels = sadmm_joint_kernels_best();
    struct joint_movement several[16];
    const size_t most = sizeof several / sizeof *several;
    size_t count = 0;
    for (size_t i = 0; i < (size_t)world->dynamic_count; ++i) {
        const struct sadmm_rigid *from = &world->start.rigid[i];
        struct sadmm_rigid *next = &world->next[i];
        const double *velocity = world->velocity + 6 * i;
        const uint16_t island = world->joint_touch[world->joint_labels[i]];
        const bool off = island & ISLAND_TRAPEZOID_OFF;
        if (from->rolls & ROLLING_IS_STIFFENED) world->joint_touch[world->joint_labels[i]] |= ISLAND_STRAYS;
        if (!(island & ISLAND_ARTICULATED)) continue;
        next->mean = body_moves_by_mean(from, off ? TRAPEZOID_OFF : TRAPEZOID_OWN);
        if (world->spins_known && next->mean) {
            several[count++] =
                (struct joint_movement){from, &world->spins[i].orientation.w, velocity, next};
            if (count < most) continue;
            kernels->moves(several, count, dt);
            count = 0;
            continue;
        }
        double halfway[4];
        q_store(world->spins_known ? world->spins[i].orientation : spin_turned_halfway(from, dt), halfway);
        joint_move(from, halfway, velocity, off, dt, next->position, next->orientation, next->velocity);
    }
    kernels->moves(several, count, dt);
}

sadmm_status sadmm_world_move_articulated(sadmm_world *world, const sadmm_settings *settings, const int32_t *islands,
                                          double *off)
{
    struct sadmm_system system = sadmm_world_system(world);
    system.islands = islands;
    const size_t n = (size_t)system.body_count;
    if (!SADMM_GROW(world->joint_labels, 0, n) || !SADMM_GROW(world->joint_touch, 0, n) ||
        !SADMM_GROW(world->joint_trapezoids, 0, n))
        return sadmm_fail_memory(&world->error, "islands of joints");
    find_islands(world, &system, settings);
    move_bodies(world, settings->dt);
    for (size_t k = 0; k < system.rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &system.rows->constraints[k];
        world->step_joints[world->joint_sources[constraint->first].joint]->next.trapezoid_off =
            *island_of(world, constraint->body_a, constraint->body_b) & ISLAND_TRAPEZOID_OFF;
    }
    TRY(sadmm_world_close_joints(world, settings, off));
    for (size_t k = 0; k < system.rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &system.rows->constraints[k];
        world->step_joints[world->joint_sources[constraint->first].joint]->next.followed =
            joint_island_is_followed(*island_of(world, constraint->body_a, constraint->body_b));
    }
    return sadmm_world_restore_articulated(world, settings);
}
