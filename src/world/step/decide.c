/* Between finding contacts and solving them: what the caller decides of them, and surfaces that move.
 *
 * A static or kinematic body whose surface moves is, to the solver, one that moves: a pair with it is given a kinematic
 * body of its own, whose velocity is the body's and what of the surface's velocity is across the normal. The body stays
 * where it is, and feels what that one feels. */
#include "decide.h"

#include <math.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "core/math/rigid.h"
#include "world/state/contact_place.h"
#include "world/state/ids.h"
#include "world/state/shape_form.h"

/* A normal that is across the surface's velocity to rounding: what is left would make each contact's velocity another
 * one, where all of an island's should be one support's. */
static const double ACROSS = 1e-9;

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

/* How the surface of a shape moves, m/s, world, at the middle of the (sub-)step, as contacts are. */
static vec3 surface_of(const sadmm_world *world, int32_t slot, double dt)
{
    const double *own = world->surfaces + 3 * (size_t)slot;
    if (own[0] == 0 && own[1] == 0 && own[2] == 0) return v3(0, 0, 0);
    const struct sadmm_collision_body *body = &world->collision_bodies[world->shapes[slot].body];
    double frame[7];
    sadmm_world_read_shape_frame(world, (size_t)slot, frame);
    const quat turned = rigid_turn(q_load(body->orientation), v3_load(body->velocity + 3), dt / 2);
    return m3_mul(q_matrix(turned), m3_mul(q_matrix(q_load(frame + 3)), v3_load(own)));
}

/* Of b's against a's. */
static vec3 surfaces_of(const sadmm_world *world, int32_t shape_a, int32_t shape_b)
{
    const double dt = sadmm_settings_of_substep(&world->def.settings).dt;
    if (world->moving_surfaces == 0) return v3(0, 0, 0);
    return v3_sub(surface_of(world, shape_b, dt), surface_of(world, shape_a, dt));
}

static vec3 across(vec3 velocity, vec3 normal)
{
    const double along = v3_dot(velocity, normal);
    return fabs(along) <= ACROSS * v3_norm(velocity) ? velocity : v3_madd(velocity, -along, normal);
}

/* A kinematic body for the pair's static or kinematic one: the last one, if that is such a one. */
static sadmm_status add_surface(sadmm_world *world, struct sadmm_contact_pair *pair, vec3 velocity)
{
    struct sadmm_step_start *start = &world->start;
    const bool on_b = pair->body_b < 0;
    int32_t *body = on_b ? &pair->body_b : &pair->body_a;
    const int32_t slot = world->shapes[on_b ? pair->shape_b : pair->shape_a].body,
                  bearer = sadmm_body_is_kinematic(*body) ? sadmm_kinematic(*body) : -1;
    const size_t n = (size_t)start->kinematic_count;
    struct sadmm_world_kinematic made;
    memset(&made, 0, sizeof made);
    made.slot = slot;
    made.bearer = bearer;
    made.rigid = bearer >= 0 ? world->kinematic[bearer].rigid : world->bodies[slot].rigid;
    v3_store(v3_madd(v3_load(made.rigid.velocity), on_b ? 1 : -1, velocity), made.rigid.velocity);
    if ((int32_t)n > world->kinematic_count && world->kinematic[n - 1].slot == slot &&
        memcmp(start->kinematic + 6 * (n - 1), made.rigid.velocity, 6 * sizeof *made.rigid.velocity) == 0) {
        *body = sadmm_kinematic((int32_t)n - 1);
        return SADMM_OK;
    }
    if (!SADMM_GROW(start->kinematic, 6 * n, 6 * (n + 1)) || !SADMM_GROW(world->kinematic, n, n + 1))
        return sadmm_fail_memory(&world->error, "surfaces that move");
    memcpy(start->kinematic + 6 * n, made.rigid.velocity, 6 * sizeof *made.rigid.velocity);
    world->kinematic[n] = made;
    start->kinematic_count = (int32_t)n + 1;
    *body = sadmm_kinematic((int32_t)n);
    return SADMM_OK;
}

/* ---- the callback ------------------------------------------------------------------------------------------------ */

static uint64_t key_of(int32_t shape_a, int32_t shape_b)
{
    return (uint64_t)(uint32_t)shape_a << 32 | (uint32_t)shape_b;
}

static bool had_manifold(const struct sadmm_decided_pairs *pairs, uint64_t key)
{
    size_t low = 0, high = pairs->count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (pairs->keys[middle] < key) low = middle + 1;
        else high = middle;
    }
    return low < pairs->count && pairs->keys[low] == key;
}

/* What a pair of shapes has, apart from points and speed. */
static sadmm_manifold manifold_of(const sadmm_world *world, uint64_t key, uint32_t subshape, const double normal[3],
                                  double friction, double restitution, vec3 surface)
{
    const int32_t shape_a = (int32_t)(key >> 32), shape_b = (int32_t)(uint32_t)key;
    sadmm_manifold manifold;
    memset(&manifold, 0, sizeof manifold);
    manifold.shape_a = sadmm_world_shape_id(world, (size_t)shape_a);
    manifold.shape_b = sadmm_world_shape_id(world, (size_t)shape_b);
    manifold.body_a = sadmm_world_body_of(world, shape_a);
    manifold.body_b = sadmm_world_body_of(world, shape_b);
    manifold.triangle = sadmm_world_contact_triangle(world, shape_b, subshape);
    manifold.begun = !had_manifold(&world->decider.last, key);
    memcpy(manifold.normal, normal, sizeof manifold.normal);
    manifold.enabled = true;
    manifold.friction = friction;
    manifold.restitution = restitution;
    v3_store(surface, manifold.surface_velocity);
    return manifold;
}

/* Calls back. dynamic: both bodies are. */
static sadmm_status ask(sadmm_world *world, sadmm_manifold *manifold, bool dynamic)
{
    struct sadmm_error *error = &world->error;
    const double *v = manifold->surface_velocity;
    world->decider.call(world->decider.context, manifold);
    if (!manifold->enabled) return SADMM_OK;
    TRY(sadmm_numbers_check(SADMM_SHAPE_FIELD(friction), &manifold->friction, "manifold->friction", error));
    TRY(sadmm_numbers_check(SADMM_SHAPE_FIELD(restitution), &manifold->restitution, "manifold->restitution", error));
    TRY(sadmm_check_vector("manifold->surface_velocity", v, 3, SADMM_SHAPE_FIELD(surface_velocity)->hi, error));
    if (dynamic && !(v[0] == 0 && v[1] == 0 && v[2] == 0))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "manifold->surface_velocity = (%g, %g, %g): must be 0 between two dynamic bodies", v[0], v[1],
                          v[2]);
    return SADMM_OK;
}

static sadmm_status decide_pair(sadmm_world *world, struct sadmm_contact_pair *pair, vec3 *surface, bool *enabled)
{
    const struct sadmm_contact_point *points = world->contacts.points + pair->first;
    struct sadmm_decided_pairs *now = &world->decider.now;
    const uint64_t key = key_of(pair->shape_a, pair->shape_b);
    sadmm_manifold manifold = manifold_of(world, key, pair->subshape, pair->normal, pair->friction, pair->restitution,
                                          *surface);
    manifold.count = pair->count;
    manifold.speed = -HUGE_VAL;
    for (int32_t k = 0; k < pair->count; ++k) {
        sadmm_world_contact_position(world, pair, &points[k], manifold.positions[k]);
        manifold.separations[k] = points[k].separation;
        manifold.speed = max_of(manifold.speed, sadmm_world_contact_speed(world, pair, &points[k]));
    }
    if (now->count == 0 || now->keys[now->count - 1] != key) {
        if (!SADMM_GROW(now->keys, now->count, now->count + 1)) return sadmm_fail_memory(&world->error, "manifolds");
        now->keys[now->count++] = key;
    }
    TRY(ask(world, &manifold, pair->body_a >= 0 && pair->body_b >= 0));
    pair->friction = manifold.friction;
    pair->restitution = manifold.restitution;
    *surface = v3_load(manifold.surface_velocity);
    *enabled = manifold.enabled;
    return SADMM_OK;
}

/* The pair's points to where those of the pairs before it end. */
static void keep_pair(struct sadmm_contact_set *contacts, const struct sadmm_contact_pair *pair, size_t *pairs,
                      size_t *points)
{
    struct sadmm_contact_pair kept = *pair;
    kept.first = (int32_t)*points;
    for (int32_t k = 0; k < pair->count; ++k) {
        const size_t from = (size_t)(pair->first + k), to = *points + (size_t)k;
        if (from == to) continue;
        contacts->points[to] = contacts->points[from];
        if (contacts->points[to].migrates) contacts->migrations[to] = contacts->migrations[from];
    }
    contacts->pairs[(*pairs)++] = kept;
    *points += (size_t)pair->count;
}

static void count_migrating(struct sadmm_contact_set *contacts)
{
    contacts->migrating = 0;
    for (size_t k = 0; k < contacts->point_count; ++k) contacts->migrating += contacts->points[k].migrates != 0;
}

sadmm_status sadmm_world_decide(sadmm_world *world)
{
    struct sadmm_contact_set *contacts = &world->contacts;
    size_t pairs = 0, points = 0;
    world->start.kinematic_count = world->kinematic_count;
    world->decider.now.count = 0;
    if (!sadmm_world_decides(world)) return SADMM_OK;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        struct sadmm_contact_pair *pair = &contacts->pairs[p];
        vec3 surface = surfaces_of(world, pair->shape_a, pair->shape_b);
        bool enabled = true;
        if (world->decider.call) TRY(decide_pair(world, pair, &surface, &enabled));
        if (!enabled) continue;
        surface = across(surface, v3_load(pair->normal));
        if (surface.x != 0 || surface.y != 0 || surface.z != 0) TRY(add_surface(world, pair, surface));
        keep_pair(contacts, pair, &pairs, &points);
    }
    if (pairs == contacts->pair_count) return SADMM_OK;
    contacts->pair_count = pairs;
    contacts->point_count = points;
    count_migrating(contacts);
    return SADMM_OK;
}

/* ---- hits within the step ---------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_decide_hit(sadmm_world *world, struct sadmm_hit_decision *decision, struct hit *hit)
{
    vec3 surface = surfaces_of(world, (int32_t)(decision->key >> 32), (int32_t)(uint32_t)decision->key);
    const bool fixed_b = hit->body[1].inverse_mass == 0, dynamic = !fixed_b && hit->body[0].inverse_mass != 0;
    decision->enabled = true;
    if (world->decider.call) {
        double normal[3];
        v3_store(hit->frame.r[0], normal);
        sadmm_manifold manifold = manifold_of(world, decision->key, decision->subshape, normal, hit->friction,
                                              hit->restitution, surface);
        manifold.hit = true;
        manifold.count = hit->count;
        manifold.speed = -HUGE_VAL;
        memcpy(manifold.positions, decision->points, (size_t)hit->count * sizeof *manifold.positions);
        for (int k = 0; k < hit->count; ++k) manifold.speed = max_of(manifold.speed, -(double)hit_velocity(hit, k).x);
        TRY(ask(world, &manifold, dynamic));
        hit->friction = manifold.friction;
        hit->restitution = manifold.restitution;
        surface = v3_load(manifold.surface_velocity);
        decision->enabled = manifold.enabled;
    }
    struct hit_body *body = &hit->body[fixed_b ? 1 : 0];
    body->linear = v3_madd(body->linear, fixed_b ? 1 : -1, across(surface, hit->frame.r[0]));
    return SADMM_OK;
}
