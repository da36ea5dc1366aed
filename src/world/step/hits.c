/* Hits of bodies in flight, each at its moment; not those on meshes.
 *
 * A solve knows one velocity of a body in a step. What is hit within it by a body that was just hit, or hit twice, asks
 * for several. So before contacts are found, bodies that no contact supports are followed along their paths: pairs that
 * bounce and approach faster than the threshold of restitution, or pass (swept_bodies.h), are taken one after the
 * other, in the order of the time at which they first touch, each with the law of impact there (core/math/hit.h), and
 * what the two come near from then on is searched for again. A body is then given the start from which it would be
 * where it is, with the velocity that it has:
 *
 *     x~ = x(t) - t v~ - (t^2 + dt^2)/2 a,      v~ = v(t)+ - t a
 *
 * and what follows, contact finding, solve and motion, sees an ordinary state: it moves by dt times the velocity that
 * it ends with, as contacts' separations have it, and has no trapezoid correction (`was_hit`, core/model/system.h); a
 * pair's motion begins at the last hit of either (`since`, collision.h). What rests on something, or has joints, is
 * left to the solve, and so is, from the sub-step's start, what would be hit more often than settings.hits times in it;
 * what passes, which would go through then, is hit through its centre of mass once more, and is the solve's from there.
 *
 * Order: by time, then by the pair's slots: results do not depend on threads. */
#include <string.h>

#include "collision/broad/broad_phase.h"
#include "collision/flight/flight_touch.h"
#include "collision/flight/swept_bodies.h"
#include "collision/flight/swept_body.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "decide.h"
#include "gather.h"
#include "hits.h"

/* A hit that is foreseen. */
struct foreseen {
    uint64_t key; /* shapes, in the order of pairs */
    uint32_t subshape;
    int32_t swept_body[2];
    uint32_t hits[2];
    struct sadmm_flight_touch touch;
};

struct sadmm_hits {
    unsigned char *kinds; /* enum sadmm_swept_kind, by body slot */
    int32_t *index;       /* by body slot: its swept body + 1, 0: none yet */
    double *since;        /* by body slot */
    struct swept_body *list;
    struct foreseen *foreseen;
    int32_t *queue;                     /* a heap of these, the next one first */
    struct sadmm_pair_list fast, pairs; /* of the sub-step; of a shape that was hit */
    size_t count, foreseen_count, queue_count;
};

/* What a sub-step's hits are worked out with. */
struct taking {
    sadmm_world *world;
    struct sadmm_hits *hits;
    struct sadmm_collision_input input;
    sadmm_settings settings;
    sadmm_status refused; /* what went wrong, where that is not the want of memory; SADMM_OK: nothing */
};

/* ---- the queue --------------------------------------------------------------------------------------------------- */

static bool comes_first(const struct sadmm_hits *h, int32_t x, int32_t y)
{
    const struct foreseen *a = &h->foreseen[x], *b = &h->foreseen[y];
    return a->touch.time < b->touch.time || (a->touch.time == b->touch.time && a->key < b->key);
}

static bool add_to_queue(struct sadmm_hits *h, int32_t item)
{
    if (!SADMM_GROW(h->queue, h->queue_count, h->queue_count + 1)) return false;
    size_t at = h->queue_count++;
    for (; at > 0 && comes_first(h, item, h->queue[(at - 1) / 2]); at = (at - 1) / 2)
        h->queue[at] = h->queue[(at - 1) / 2];
    h->queue[at] = item;
    return true;
}

static int32_t take_from_queue(struct sadmm_hits *h)
{
    const int32_t first = h->queue[0], last = h->queue[--h->queue_count];
    size_t at = 0;
    for (size_t child; (child = 2 * at + 1) < h->queue_count; at = child) {
        if (child + 1 < h->queue_count && comes_first(h, h->queue[child + 1], h->queue[child])) ++child;
        if (!comes_first(h, h->queue[child], last)) break;
        h->queue[at] = h->queue[child];
    }
    h->queue[at] = last;
    return first;
}

/* ---- ways -------------------------------------------------------------------------------------------------------- */

/* The number of a body among the swept ones, -1: out of memory. */
static int32_t swept_body_of(struct taking *t, int32_t slot)
{
    struct sadmm_hits *h = t->hits;
    const sadmm_world *world = t->world;
    const int32_t system = world->collision_bodies[slot].system_body;
    if (h->index[slot] > 0) return h->index[slot] - 1;
    if (!SADMM_GROW(h->list, h->count, h->count + 1)) return -1;
    struct swept_body *f = &h->list[h->count];
    memset(f, 0, sizeof *f);
    f->slot = slot;
    f->dynamic = system >= 0 ? system : -1;
    f->kinematic = sadmm_body_is_kinematic(system) ? sadmm_kinematic(system) : -1;
    f->start = system >= 0                       ? world->start.rigid[system]
               : sadmm_body_is_kinematic(system) ? world->kinematic[f->kinematic].rigid
                                                 : world->bodies[slot].rigid;
    swept_body_begin(f, &t->settings);
    h->index[slot] = (int32_t)++h->count;
    return (int32_t)h->count - 1;
}

/* ---- what is foreseen -------------------------------------------------------------------------------------------- */

static struct sadmm_swept_shape shape_of(const struct taking *t, uint32_t slot, const struct swept_body *f)
{
    const struct sadmm_shape *shape = &t->world->shapes[slot];
    const struct sadmm_swept_shape out = {shape, &t->world->geometries[shape->geometry], &f->flight};
    return out;
}

/* The body is followed no further. What is not dynamic always is. */
static void give_up(struct swept_body *f)
{
    if (f->dynamic >= 0) *(f->passes ? &f->ended : &f->too_many) = true;
}

/* When do two shapes hit each other, from `from` on? False: out of memory. */
static bool foresee(struct taking *t, uint64_t key, double from)
{
    struct sadmm_hits *h = t->hits;
    const uint32_t slot[2] = {(uint32_t)(key >> 32), (uint32_t)key};
    const int32_t body[2] = {t->world->shapes[slot[0]].body, t->world->shapes[slot[1]].body};
    const int32_t number[2] = {swept_body_of(t, body[0]), swept_body_of(t, body[1])};
    if (number[0] < 0 || number[1] < 0) return false;
    const struct swept_body *a = &h->list[number[0]], *b = &h->list[number[1]];
    struct sadmm_swept_pair pair = {
        shape_of(t, slot[0], a), shape_of(t, slot[1], b), t->input.hulls, 0, t->settings.restitution_threshold, false};
    struct sadmm_flight_touch touch;
    /* What the triangles of a mesh push along depends on those around them, which one touch by itself does not see:
     * that is left to the solve. */
    if (pair.b.geometry->type == SADMM_SHAPE_MESH) return true;
    const bool found = sadmm_flight_touch(&pair, from, t->settings.dt, &touch);
    for (int side = 0; pair.lost && side < 2; ++side) give_up(&h->list[number[side]]);
    if (!found) return true;
    if (!SADMM_GROW(h->foreseen, h->foreseen_count, h->foreseen_count + 1)) return false;
    h->foreseen[h->foreseen_count] =
        (struct foreseen){key, pair.subshape, {number[0], number[1]}, {a->hits, b->hits}, touch};
    return add_to_queue(h, (int32_t)h->foreseen_count++);
}

/* The box that a shape sweeps from a hit on. False: out of memory. */
static bool set_box(struct taking *t, uint32_t slot, const struct swept_body *f)
{
    const struct sadmm_shape *shape = &t->world->shapes[slot];
    const struct sadmm_geometry *geometry = &t->world->geometries[shape->geometry];
    struct sadmm_flight_pose from, to;
    struct sadmm_box3 box;
    sadmm_flight_at(&f->flight, f->flight.since, &from);
    sadmm_flight_at(&f->flight, t->settings.dt, &to);
    swept_body_box(shape, geometry, &f->flight, t->settings.dt, &from, &to, &box);
    return sadmm_collision_set_box(t->world->collision, slot, &box);
}

/* What a body that was hit comes near from there on; `except`: a body whose pairs with it are known. */
static bool foresee_body(struct taking *t, int32_t number, int32_t except)
{
    const struct swept_body f = t->hits->list[number];
    const struct sadmm_world_body *body = &t->world->bodies[f.slot];
    for (uint32_t name = body->first_shape; name; name = t->world->shape_links[name - 1].next) {
        const uint32_t slot = name - 1;
        if (t->world->shapes[slot].sensor) continue;
        t->hits->pairs.count = 0;
        if (!set_box(t, slot, &f) ||
            !sadmm_collision_list_near(t->world->collision, &t->input, t->hits->kinds, slot, &t->hits->pairs))
            return false;
        for (size_t k = 0; k < t->hits->pairs.count; ++k) {
            const uint64_t key = t->hits->pairs.keys[k];
            const uint32_t other = (uint32_t)(key >> 32) == slot ? (uint32_t)key : (uint32_t)(key >> 32);
            if (t->world->shapes[other].body != except && !foresee(t, key, f.flight.since)) return false;
        }
    }
    return true;
}

/* ---- a hit ------------------------------------------------------------------------------------------------------- */

/* Into `start`, for those who read what has happened. False: out of memory. */
static bool record(struct taking *t, const struct foreseen *item, const struct hit *hit)
{
    struct sadmm_step_start *start = &t->world->start;
    for (int k = 0; k < hit->count; ++k) {
        if (!(hit->impulse[k].x > 0)) continue;
        if (!SADMM_GROW(start->hits, start->hit_count, start->hit_count + 1)) return false;
        struct sadmm_world_hit *out = &start->hits[start->hit_count++];
        memset(out, 0, sizeof *out);
        out->shape_a = (int32_t)(item->key >> 32);
        out->shape_b = (int32_t)(uint32_t)item->key;
        out->subshape = item->subshape;
        out->feature = item->touch.feature[k];
        memcpy(out->position, item->touch.point[k], sizeof out->position);
        memcpy(out->normal, item->touch.normal, sizeof out->normal);
        v3_store(hit_impulse(hit, k, 1), out->impulse);
        for (int side = 0; side < 2; ++side) {
            const struct swept_body *f = &t->hits->list[item->swept_body[side]];
            v3_store(hit->arm[side][k], out->arm[side]);
            out->dynamic[side] = f->dynamic;
            out->kinematic[side] = f->kinematic;
        }
        out->speed = -(double)hit_velocity(hit, k).x;
        out->friction = hit->friction;
    }
    return true;
}

/* last: neither is followed any further. */
static bool take_hit(struct taking *t, struct foreseen item, bool last)
{
    struct swept_body *f[2] = {&t->hits->list[item.swept_body[0]], &t->hits->list[item.swept_body[1]]};
    const struct swept_body *const of[2] = {f[0], f[1]};
    struct sadmm_flight_pose pose[2];
    struct hit hit;
    for (int side = 0; side < 2; ++side) sadmm_flight_at(&f[side]->flight, item.touch.time, &pose[side]);
    memset(&hit, 0, sizeof hit);
    sadmm_collision_pair_law(t->world->collision, &t->input, item.key, &hit.friction, &hit.restitution);
    swept_bodies_hit(of, &item.touch, t->settings.restitution_threshold, pose, &hit);
    if (last) swept_bodies_hit_centre(of, pose, &item.touch, &hit);
    if (sadmm_world_decides(t->world)) {
        struct sadmm_hit_decision decision = {item.key, item.subshape, (const double (*)[3])item.touch.point, true};
        t->refused = sadmm_world_decide_hit(t->world, &decision, &hit);
        if (t->refused != SADMM_OK) return false;
        if (!decision.enabled) return true;
    }
    hit_solve(&hit);
    if (!record(t, &item, &hit)) return false;
    swept_bodies_part(f, &t->settings, item.touch.time, pose, &hit);
    const int32_t slot_a = f[0]->slot;
    return (f[0]->dynamic < 0 || foresee_body(t, item.swept_body[0], -1)) &&
           (t->hits->list[item.swept_body[1]].dynamic < 0 ||
            foresee_body(t, item.swept_body[1], t->hits->list[item.swept_body[0]].dynamic < 0 ? -1 : slot_a));
}

static bool holds(const struct sadmm_hits *h, const struct foreseen *item)
{
    return h->list[item->swept_body[0]].hits == item->hits[0] && h->list[item->swept_body[1]].hits == item->hits[1];
}

/* ---- a sub-step's ------------------------------------------------------------------------------------------------ */

static bool reserve(struct sadmm_hits *h, size_t slots)
{
    return SADMM_GROW(h->kinds, 0, slots) && SADMM_GROW(h->index, 0, slots) && SADMM_GROW(h->since, 0, slots);
}

static unsigned char swept_kind(const struct sadmm_world_body *body, double dt)
{
    if (body->type != SADMM_BODY_DYNAMIC) return SADMM_SWEPT_FIXED;
    return swept_body_is_damped(&body->rigid, dt) ? SADMM_SWEPT_NONE : SADMM_SWEPT_DYNAMIC;
}

void sadmm_world_mark_held(const sadmm_world *world, unsigned char *bodies, unsigned char mark)
{
    for (size_t k = 0; k < world->step_joint_count; ++k) {
        const struct sadmm_world_joint *joint = world->step_joints[k];
        for (int side = 0; side < 2; ++side)
            if (joint->body[side] >= 0 && world->bodies[joint->body[side]].type == SADMM_BODY_DYNAMIC)
                bodies[joint->body[side]] = mark;
    }
}

static void mark_bodies(struct taking *t)
{
    const sadmm_world *world = t->world;
    unsigned char *kinds = t->hits->kinds;
    for (size_t slot = 0; slot < world->body_ids.slots; ++slot)
        kinds[slot] = sadmm_ids_has(&world->body_ids, slot) ? swept_kind(&world->bodies[slot], t->settings.dt)
                                                            : SADMM_SWEPT_FIXED;
    sadmm_world_mark_held(world, kinds, SADMM_SWEPT_NONE);
    sadmm_collision_mark_pressed(world->collision, &world->contacts, world->start.rigid, kinds);
}

/* The orientation that a body has at its last hit, from which contact finding turns it by its velocity. */
static void place_at_hit(const struct swept_body *f, struct sadmm_collision_body *out)
{
    struct sadmm_flight_pose pose;
    sadmm_flight_at(&f->flight, f->flight.since, &pose);
    memcpy(out->orientation, pose.orientation, sizeof out->orientation);
    if (f->flight.inertia[0] > 0) memcpy(out->velocity + 3, pose.spin, sizeof pose.spin);
}

/* What was hit begins the sub-step where it would have. */
static void write_back(struct taking *t)
{
    sadmm_world *world = t->world;
    const struct sadmm_hits *h = t->hits;
    bool any = false;
    for (size_t i = 0; i < h->count; ++i) {
        const struct swept_body *f = &h->list[i];
        if (f->hits == 0) continue;
        double *velocity = world->velocity + 6 * (size_t)f->dynamic;
        struct sadmm_collision_body *out = &world->collision_bodies[f->slot];
        any = true;
        world->start.rigid[f->dynamic] = f->start;
        swept_body_end_velocity(f, &t->settings, velocity);
        memcpy(world->start.velocity + 6 * (size_t)f->dynamic, velocity, 6 * sizeof *velocity);
        memcpy(out->position, f->start.position, sizeof out->position);
        memcpy(out->velocity, f->start.velocity, sizeof out->velocity);
        place_at_hit(f, out);
        h->since[f->slot] = f->flight.since;
    }
    if (!any) return;
    world->hit_since = h->since;
    sadmm_collision_drop_candidates(world->collision);
}

/* May both be hit once more? One that may not, but would go through the other one, is: `last`. */
static bool may_hit(struct taking *t, const struct foreseen *item, bool *last)
{
    bool may = true;
    *last = false;
    for (int side = 0; side < 2; ++side) {
        struct swept_body *f = &t->hits->list[item->swept_body[side]];
        if (f->hits < (uint32_t)t->settings.hits) continue;
        may = may && f->passes && f->hits == (uint32_t)t->settings.hits;
        *last = true;
        give_up(f);
    }
    return may;
}

/* Both of a pair that may go through each other. False: out of memory. */
static bool note_passing(struct taking *t, uint64_t key)
{
    if (!sadmm_collision_passes(t->world->collision, &t->input, key)) return true;
    const int32_t number[2] = {swept_body_of(t, t->world->shapes[key >> 32].body),
                               swept_body_of(t, t->world->shapes[(uint32_t)key].body)};
    if (number[0] < 0 || number[1] < 0) return false;
    t->hits->list[number[0]].passes = t->hits->list[number[1]].passes = true;
    return true;
}

static bool take_all(struct taking *t)
{
    struct sadmm_hits *h = t->hits;
    bool ok = true;
    for (size_t k = 0; ok && k < h->fast.count; ++k)
        if (sadmm_collision_may_hit(t->world->collision, h->kinds, h->fast.keys[k]))
            ok = note_passing(t, h->fast.keys[k]);
    for (size_t k = 0; ok && k < h->fast.count; ++k)
        if (sadmm_collision_may_hit(t->world->collision, h->kinds, h->fast.keys[k]))
            ok = foresee(t, h->fast.keys[k], 0);
    while (ok && h->queue_count > 0) {
        const struct foreseen *item = &h->foreseen[take_from_queue(h)];
        bool last;
        if (holds(h, item) && may_hit(t, item, &last)) ok = take_hit(t, *item, last);
    }
    return ok;
}

static void forget(sadmm_world *world)
{
    struct sadmm_hits *h = world->hits;
    if (!h) return;
    for (size_t i = 0; i < h->count; ++i) {
        h->index[h->list[i].slot] = 0;
        h->since[h->list[i].slot] = 0;
    }
    h->count = h->foreseen_count = h->queue_count = 0;
    world->hit_since = NULL;
}

/* Bodies that would be hit too often take part no more; returns whether there are any. */
static bool leave_out(struct taking *t)
{
    bool any = false;
    for (size_t i = 0; i < t->hits->count; ++i) {
        if (!t->hits->list[i].too_many) continue;
        t->hits->kinds[t->hits->list[i].slot] = SADMM_SWEPT_NONE;
        any = true;
    }
    return any;
}

/* The sub-step's candidates and which of them are fast. */
static sadmm_status find_candidates(struct taking *t)
{
    sadmm_world *world = t->world;
    TRY(sadmm_collision_find_candidates(world->collision, &t->input, &world->error));
    if (sadmm_collision_list_fast(world->collision, &t->input, t->settings.restitution_threshold,
                                  world->bouncing_count > 0, &t->hits->fast))
        return SADMM_OK;
    sadmm_collision_drop_candidates(world->collision);
    return sadmm_fail_memory(&world->error, "hits");
}

/* Its hits, again without bodies that are hit too often; what rattles on and on has none. */
enum { MOST_TIMES = 4 };
static sadmm_status take_most(struct taking *t)
{
    sadmm_world *world = t->world;
    for (int times = 0; times < MOST_TIMES; ++times) {
        world->start.hit_count = world->start.hit_first;
        TRY(find_candidates(t));
        if (t->hits->fast.count == 0) return SADMM_OK;
        if (times == 0) mark_bodies(t);
        if (!take_all(t)) {
            sadmm_collision_drop_candidates(world->collision);
            return t->refused != SADMM_OK ? t->refused : sadmm_fail_memory(&world->error, "hits");
        }
        if (!leave_out(t)) {
            write_back(t);
            return SADMM_OK;
        }
        forget(world);
    }
    world->start.hit_count = world->start.hit_first;
    sadmm_collision_drop_candidates(world->collision);
    return SADMM_OK;
}

sadmm_status sadmm_world_take_hits(sadmm_world *world, int substep)
{
    struct taking t = {.world = world, .settings = sadmm_settings_of_substep(&world->def.settings)};
    forget(world);
    if (substep == 0) world->start.hit_count = 0;
    world->start.hit_first = world->start.hit_count;
    if (t.settings.hits == 0) return SADMM_OK;
    if (!world->hits) world->hits = (struct sadmm_hits *)sadmm_alloc(1, sizeof *world->hits);
    if (!world->hits || !reserve(world->hits, world->body_ids.slots)) return sadmm_fail_memory(&world->error, "hits");
    t.hits = world->hits;
    t.input = sadmm_world_collision_input(world, substep);
    t.input.team = &world->team;
    return take_most(&t);
}

/* The swept body that a shape is of, NULL: it was not followed to the end. */
static const struct swept_body *followed_of(const sadmm_world *world, int32_t shape)
{
    const struct sadmm_hits *h = world->hits;
    const int32_t slot = world->shapes[shape].body, number = h->index[slot] - 1;
    return number < 0 || h->kinds[slot] == SADMM_SWEPT_NONE || h->list[number].ended ? NULL : &h->list[number];
}

/* Was the pair followed? */
static bool is_followed(const sadmm_world *world, const struct sadmm_contact_pair *pair, const struct swept_body *a,
                        const struct swept_body *b)
{
    return a && b && (pair->restitution > 0 || a->hits > 0 || b->hits > 0) &&
           world->geometries[world->shapes[pair->shape_b].geometry].type != SADMM_SHAPE_MESH;
}

static double thinner_of(const sadmm_world *world, const struct sadmm_contact_pair *pair)
{
    return min_of(geometry_thickness(&world->geometries[world->shapes[pair->shape_a].geometry]),
                geometry_thickness(&world->geometries[world->shapes[pair->shape_b].geometry]));
}

void sadmm_world_open_separations(sadmm_world *world)
{
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings);
    if (!world->hits || world->hits->count == 0) return;
    for (size_t p = 0; p < world->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
        const struct swept_body *a = followed_of(world, pair->shape_a), *b = followed_of(world, pair->shape_b);
        if (!is_followed(world, pair, a, b)) continue;
        const double thinner = thinner_of(world, pair);
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
            swept_bodies_open_separation(pair, &a->flight, &b->flight, thinner, &settings, &world->contacts.points[k]);
    }
}

void sadmm_world_add_hit_wrenches(sadmm_world *world, const sadmm_settings *settings)
{
    const double mean = 1 / (settings->dt * settings->substeps);
    for (size_t k = world->start.hit_first; k < world->start.hit_count; ++k) {
        const struct sadmm_world_hit *hit = &world->start.hits[k];
        for (int side = 0; side < 2; ++side) {
            const bool kinematic = hit->kinematic[side] >= 0;
            const double share = (side ? 1 : -1) * (kinematic ? mean : 1 / settings->dt);
            double *wrench = kinematic                 ? world->kinematic[hit->kinematic[side]].wrench
                             : hit->dynamic[side] >= 0 ? world->wrench + 6 * (size_t)hit->dynamic[side]
                                                       : NULL;
            if (!wrench) continue;
            for (int j = 0; j < 3; ++j) wrench[j] += share * hit->impulse[j];
            add_cross(hit->arm[side], hit->impulse, share, wrench + 3);
        }
    }
}

void sadmm_world_free_hits(sadmm_world *world)
{
    struct sadmm_hits *h = world->hits;
    sadmm_free(world->start.hits);
    sadmm_free(world->last_start.hits);
    if (!h) return;
    void *blocks[] = {h->kinds, h->index, h->since, h->list, h->foreseen, h->queue, h->fast.keys, h->pairs.keys, h};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; ++i) sadmm_free(blocks[i]);
}
