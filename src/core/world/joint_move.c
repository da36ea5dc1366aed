/* Where joints let bodies go: positions after a (sub-)step in islands with joints (docs/algorithm.md, section 10), from
 * the velocities that the solve found. All bodies of such an island move by the mean of their velocities before and
 * after the step, or all by those after it (math/lead.h), or they would come apart. */
#include <string.h>

#include "core/base/memory.h"
#include "core/math/lead.h"
#include "core/math/rigid.h"
#include "core/model/islands.h"
#include "world_internal.h"

/* Of islands, at their labels. */
enum { HAS_JOINTS = 1, HAS_CONTACTS = 2, LEADS_STAY = 4 };

static const double still[6];

static const double *velocity_of(const sadmm_world *world, int32_t body)
{
    return body >= 0 ? world->velocity + 6 * (size_t)body : still;
}

static void lead_of(const sadmm_world *world, int32_t body, double lead[6])
{
    const double *before = body >= 0 ? world->start.rigid[body].velocity : still, *v = velocity_of(world, body);
    for (int k = 0; k < 6; ++k) lead[k] = (v[k] - before[k]) / 2;
}

static uint8_t *island_of(const sadmm_world *world, int32_t a, int32_t b)
{
    return &world->joint_touch[world->joint_labels[a >= 0 ? a : b]];
}

/* Of a pair of shapes in an island with joints. Leads stay where they would close a contact, and where a body rests on
 * one. */
static int touch_of(const sadmm_world *world, const struct sadmm_system *system, const struct sadmm_contact_pair *pair,
                    const sadmm_settings *settings)
{
    const int32_t bodies[2] = {pair->body_a, pair->body_b};
    struct lead_touch touch = {0, {0, 0}};
    double leads[2][6];
    if (sadmm_pair_is_driven(system, pair)) return HAS_CONTACTS | LEADS_STAY;
    for (int s = 0; s < 2; ++s) lead_of(world, bodies[s], leads[s]);
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct sadmm_contact_point *point = &world->contacts.points[k];
        double speed = 0, lead[2], size[2], moves[2] = {0, 0}, rest[2] = {0, 0};
        for (int s = 0; s < 2; ++s) {
            const double *arm = s ? point->arm_b : point->arm_a, sign = s ? 1 : -1;
            speed += sign * lead_along(pair->normal, velocity_of(world, bodies[s]), arm);
            lead[s] = sign * lead_along(pair->normal, leads[s], arm);
            size[s] = lead_size(leads[s], arm);
            if (bodies[s] < 0) continue;
            const struct sadmm_rigid *rigid = &world->start.rigid[bodies[s]];
            moves[s] = lead_speed(rigid->velocity, velocity_of(world, bodies[s]), arm);
            rest[s] = lead_rest_speed(settings->gravity, rigid->gravity_scale, rigid->wrench, rigid->mass,
                                      settings->dt);
        }
        lead_add_point(&touch, point->gap, dot3(pair->normal, point->impulse), speed, lead, size, moves, rest,
                       settings->dt, settings->slop);
    }
    const int carried = TOUCH_CARRIED | TOUCH_MOVED;
    const bool rests = (bodies[0] >= 0 && (touch.body[0] & carried) == TOUCH_CARRIED) ||
                       (bodies[1] >= 0 && (touch.body[1] & carried) == TOUCH_CARRIED);
    return touch.island & TOUCH_JOLT || rests ? HAS_CONTACTS | LEADS_STAY : HAS_CONTACTS;
}

/* Does taking leads back carry the joint beyond a limit that it has just reached? (One that presses all the time, a
 * stone on a string, is met by the mean of both velocities, too.) */
static bool limit_jolts(const sadmm_world *world, const struct sadmm_row_constraint *constraint, size_t r,
                        const sadmm_settings *settings)
{
    const struct sadmm_rows *rows = &world->start.rows;
    const struct sadmm_joint_source *source = &world->joint_sources[r];
    const int role = source->role;
    double lead = 0, speed = source->driven;
    if ((role != SADMM_ROLE_LOWER && role != SADMM_ROLE_UPPER) || !(rows->lambda[r] > 0)) return false;
    for (int s = 0; s < 2; ++s) {
        const int32_t body = s ? constraint->body_b : constraint->body_a;
        const double *row = (s ? rows->jacobian_b : rows->jacobian_a) + 6 * r, *v = velocity_of(world, body);
        double own[6];
        lead_of(world, body, own);
        for (int j = 0; j < 6; ++j) {
            lead += row[j] * own[j];
            speed += row[j] * v[j];
        }
    }
    const double end = source->gap + settings->dt * (speed - lead);
    return end < fmin(source->gap, 0) - source->slack - LEAD_SLOP * settings->slop;
}

static void find_islands(const sadmm_world *world, const struct sadmm_system *system, const sadmm_settings *settings)
{
    const struct sadmm_rows *rows = system->rows;
    sadmm_islands(system, world->joint_labels);
    memset(world->joint_touch, 0, (size_t)system->body_count);
    for (size_t k = 0; k < rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &rows->constraints[k];
        uint8_t *island = island_of(world, constraint->body_a, constraint->body_b);
        *island |= HAS_JOINTS;
        for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)
            if (limit_jolts(world, constraint, (size_t)r, settings)) *island |= LEADS_STAY;
    }
    for (size_t p = 0; p < system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
        uint8_t *island = island_of(world, pair->body_a, pair->body_b);
        if (*island & HAS_JOINTS) *island |= (uint8_t)touch_of(world, system, pair, settings);
    }
}

/* Velocities of bodies whose principal moments differ are solved for as what they are in the body's frame, which turns
 * by the mean velocity: with it turns what they are in the world. Energy and the size of the angular momentum stay. */
static void move(const struct sadmm_rigid *from, const double v[6], bool leads_stay, double dt,
                 struct sadmm_rigid *next)
{
    double mean[6];
    for (int k = 0; k < 6; ++k) mean[k] = leads_stay ? v[k] : (from->velocity[k] + v[k]) / 2;
    v3_store(rigid_move(v3_load(from->position), v3_load(mean), dt), next->position);
    q_store(rigid_turn(q_load(from->orientation), v3_load(mean + 3), dt), next->orientation);
    memcpy(next->velocity, v, sizeof next->velocity);
    if (!leads_stay && !rigid_is_isotropic(v3_load(from->inertia)))
        v3_store(q_turn(q_exp(v3_scale(v3_load(mean + 3), dt)), v3_load(v + 3)), next->velocity + 3);
}

sadmm_status sadmm_world_move_joined(sadmm_world *world, const sadmm_settings *settings)
{
    const struct sadmm_system system = sadmm_world_system(world);
    const size_t n = (size_t)system.body_count;
    if (!sadmm_grow_empty(&world->joint_labels, &world->joint_label_capacity, n, sizeof *world->joint_labels) ||
        !sadmm_grow_empty(&world->joint_touch, &world->joint_touch_capacity, n, sizeof *world->joint_touch))
        return sadmm_fail_memory(&world->error, "islands of joints");
    find_islands(world, &system, settings);
    for (size_t i = 0; i < n; ++i) {
        const uint8_t island = world->joint_touch[world->joint_labels[i]];
        if (island & HAS_JOINTS)
            move(&world->start.rigid[i], world->velocity + 6 * i, island & LEADS_STAY, settings->dt, &world->next[i]);
    }
    for (size_t k = 0; k < system.rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &system.rows->constraints[k];
        world->joints[world->joint_sources[constraint->first].joint].next.leads_stay =
            *island_of(world, constraint->body_a, constraint->body_b) & LEADS_STAY;
    }
    return SADMM_OK;
}
