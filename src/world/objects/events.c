/* What begins and ends: which shapes touch after a step, compared with those after the step before. */
#include "subadmm/events.h"

#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "events.h"
#include "sensor.h"
#include "world/resident/resident.h"
#include "world/state/contact_place.h"
#include "world/state/ids.h"

enum { MOST_EVENTS = 1 << 24 };

/* ---- events that wait -------------------------------------------------------------------------------------------- */

static bool allocate(sadmm_event **waiting, int32_t capacity)
{
    *waiting = capacity > 0 ? (sadmm_event *)sadmm_alloc((size_t)capacity, sizeof **waiting) : NULL;
    return *waiting || capacity == 0;
}

static void begin_anew(sadmm_world *world)
{
    world->events.first = world->events.count = 0;
    world->events.dropped = 0;
    world->events.touching.count = world->events.inside.count = 0;
}

sadmm_status sadmm_world_record_events(sadmm_world *world, int32_t capacity)
{
    TRY(sadmm_check_given(world, "world", NULL));
    sadmm_event *waiting;
    if (capacity < 0 || capacity > MOST_EVENTS)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT, "capacity = %d: must be in [0, %d]", capacity,
                          MOST_EVENTS);
    if (!allocate(&waiting, capacity)) return sadmm_fail_memory(&world->error, "events");
    sadmm_free(world->events.waiting);
    world->events.waiting = waiting;
    world->events.capacity = capacity;
    begin_anew(world);
    return SADMM_OK;
}

int32_t sadmm_world_event_capacity(const sadmm_world *world) { return world ? world->events.capacity : 0; }

int32_t sadmm_world_event_count(const sadmm_world *world) { return world ? world->events.count : 0; }

sadmm_status sadmm_world_take_events(sadmm_world *world, int32_t capacity, sadmm_event *events, int32_t *count,
                                     int64_t *dropped)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    TRY(sadmm_check_given(count, "count", error));
    if (capacity < 0) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "capacity = %d: must be >= 0", capacity);
    if (capacity > 0) TRY(sadmm_check_given(events, "events", error));
    const int32_t taken = capacity < world->events.count ? capacity : world->events.count;
    for (int32_t k = 0; k < taken; ++k) {
        events[k] = world->events.waiting[world->events.first];
        world->events.first = world->events.first + 1 < world->events.capacity ? world->events.first + 1 : 0;
    }
    world->events.count -= taken;
    *count = taken;
    if (!dropped) return SADMM_OK;
    *dropped = world->events.dropped;
    world->events.dropped = 0;
    return SADMM_OK;
}

/* One more at the end; where there is no room the oldest goes. */
static sadmm_event *push(sadmm_world *world, sadmm_event_type type, const struct sadmm_touch *touch)
{
    const int64_t capacity = world->events.capacity;
    if (world->events.count == capacity) {
        world->events.first = (int32_t)((world->events.first + 1) % capacity);
        --world->events.count;
        ++world->events.dropped;
    }
    sadmm_event *event = &world->events.waiting[((int64_t)world->events.first + world->events.count++) % capacity];
    memset(event, 0, sizeof *event);
    event->step = world->report.step;
    event->type = type;
    event->shape_a = touch->a;
    event->shape_b = touch->b;
    event->body_a = touch->body_a;
    event->body_b = touch->body_b;
    return event;
}

/* ---- what touches after a step ----------------------------------------------------------------------------------- */

static bool add(sadmm_world *world, struct sadmm_touches *touches, int32_t a, int32_t b, size_t pair)
{
    if (!SADMM_GROW(touches->list, touches->count, touches->count + 1)) return false;
    touches->list[touches->count++] =
        (struct sadmm_touch){sadmm_world_shape_id(world, (size_t)a), sadmm_world_shape_id(world, (size_t)b),
                             sadmm_world_body_of(world, a), sadmm_world_body_of(world, b), pair};
    return true;
}

/* The pairs of the step's contacts, which of them touch: from where the contacts are. */
static sadmm_status list_pairs(sadmm_world *world, size_t *count)
{
    const struct sadmm_contact_set *contacts = &world->contacts;
    const bool behind = world->resident.contacts_behind;
    *count = behind ? (size_t)world->report.pairs : contacts->pair_count;
    if (!SADMM_GROW(world->events.pairs, 0, *count)) return sadmm_fail_memory(&world->error, "events");
    if (behind) return sadmm_world_read_touching(world, world->events.pairs);
    for (size_t p = 0; p < *count; ++p)
        world->events.pairs[p] = sadmm_touching_of(&contacts->pairs[p], contacts->points + contacts->pairs[p].first);
    return SADMM_OK;
}

static int compare_shapes(const struct sadmm_touch *touch, int32_t a, int32_t b)
{
    const uint32_t slot_a = (uint32_t)a + 1, slot_b = (uint32_t)b + 1;
    if (touch->a.slot != slot_a) return touch->a.slot < slot_a ? -1 : 1;
    return touch->b.slot == slot_b ? 0 : touch->b.slot < slot_b ? -1 : 1;
}

/* Hits taken at their moment, where no contact says that the two touch: into their place. */
static bool add_hits(sadmm_world *world, struct sadmm_touches *touching)
{
    for (size_t k = 0; k < world->start.hit_count; ++k) {
        const struct sadmm_world_hit *hit = &world->start.hits[k];
        size_t low = 0, high = touching->count;
        while (low < high) {
            const size_t middle = low + (high - low) / 2;
            if (compare_shapes(&touching->list[middle], hit->shape_a, hit->shape_b) < 0) low = middle + 1;
            else high = middle;
        }
        if (low < touching->count && compare_shapes(&touching->list[low], hit->shape_a, hit->shape_b) == 0) continue;
        if (!add(world, touching, hit->shape_a, hit->shape_b, world->contacts.pair_count)) return false;
        const struct sadmm_touch last = touching->list[touching->count - 1];
        memmove(touching->list + low + 1, touching->list + low, (touching->count - 1 - low) * sizeof last);
        touching->list[low] = last;
    }
    return true;
}

static sadmm_status list_touching(sadmm_world *world)
{
    struct sadmm_touches *touching = &world->events.touching_now;
    size_t count;
    touching->count = 0;
    TRY(list_pairs(world, &count));
    for (size_t p = 0; p < count; ++p) {
        const struct sadmm_touching_shapes shapes = world->events.pairs[p];
        const struct sadmm_touch *last = touching->count > 0 ? &touching->list[touching->count - 1] : NULL;
        if (shapes.a < 0 || (last && last->a.slot == (uint32_t)shapes.a + 1 && last->b.slot == (uint32_t)shapes.b + 1))
            continue; /* two shapes may have several pairs, one after the other */
        if (!add(world, touching, shapes.a, shapes.b, p)) return sadmm_fail_memory(&world->error, "events");
    }
    return add_hits(world, touching) ? SADMM_OK : sadmm_fail_memory(&world->error, "events");
}

static sadmm_status list_inside(sadmm_world *world)
{
    world->events.inside_now.count = 0;
    if (world->sensor_count == 0) return SADMM_OK;
    for (SADMM_OBJECTS(slot, &world->shape_ids)) {
        size_t seen;
        if (!world->shapes[slot].sensor) continue;
        TRY(sadmm_world_list_seen(world, slot, &seen));
        for (size_t k = 0; k < seen; ++k)
            if (!add(world, &world->events.inside_now, (int32_t)slot, (int32_t)world->query.slots[k], 0))
                return sadmm_fail_memory(&world->error, "events");
    }
    return SADMM_OK;
}

/* ---- the comparison ---------------------------------------------------------------------------------------------- */

static bool same_shapes(const struct sadmm_contact_pair *x, const struct sadmm_contact_pair *y)
{
    return x->shape_a == y->shape_a && x->shape_b == y->shape_b;
}

/* Where two shapes have begun to touch, and how hard. at: one of their pairs. */
static void describe(const sadmm_world *world, size_t at, sadmm_event *event)
{
    const struct sadmm_contact_set *contacts = &world->contacts;
    const struct sadmm_contact_pair *pairs = contacts->pairs;
    const struct sadmm_contact_point *strongest = NULL;
    const struct sadmm_contact_pair *of = NULL;
    size_t first = at, last = at + 1;
    double most = 0;
    while (first > 0 && same_shapes(&pairs[first - 1], &pairs[at])) --first;
    while (last < contacts->pair_count && same_shapes(&pairs[last], &pairs[at])) ++last;
    for (size_t p = first; p < last; ++p) {
        const struct sadmm_contact_pair *pair = &pairs[p];
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const struct sadmm_contact_point *point = &contacts->points[k];
            const double impulse = sadmm_normal_impulse(pair, point);
            for (int i = 0; i < 3; ++i) event->impulse[i] += point->impulse[i];
            if (strongest && !(impulse > most || (impulse == most && point->separation < strongest->separation)))
                continue;
            strongest = point;
            most = impulse;
            of = pair;
        }
    }
    sadmm_world_contact_position(world, of, strongest, event->position);
    event->speed = sadmm_world_contact_speed(world, of, strongest);
    memcpy(event->normal, of->normal, sizeof event->normal);
}

/* Of the slots of a and b. */
static int compare(const struct sadmm_touch *x, const struct sadmm_touch *y)
{
    if (x->a.slot != y->a.slot) return x->a.slot < y->a.slot ? -1 : 1;
    return x->b.slot == y->b.slot ? 0 : x->b.slot < y->b.slot ? -1 : 1;
}

static bool same(const struct sadmm_touch *x, const struct sadmm_touch *y)
{
    return x->a.generation == y->a.generation && x->b.generation == y->b.generation;
}

/* Anything that has begun? */
static bool any_begun(const struct sadmm_touches *before, const struct sadmm_touches *now)
{
    size_t old = 0;
    for (size_t k = 0; k < now->count; ++k) {
        while (old < before->count && compare(&before->list[old], &now->list[k]) < 0) ++old;
        if (old == before->count || compare(&before->list[old], &now->list[k]) != 0 ||
            !same(&before->list[old], &now->list[k]))
            return true;
    }
    return false;
}

/* The same of their hits in the step: the first one is where they have begun to touch. */
static void describe_hits(const sadmm_world *world, const struct sadmm_touch *touch, sadmm_event *event)
{
    bool first = true;
    for (size_t k = 0; k < world->start.hit_count; ++k) {
        const struct sadmm_world_hit *hit = &world->start.hits[k];
        if (compare_shapes(touch, hit->shape_a, hit->shape_b) != 0) continue;
        for (int i = 0; i < 3; ++i) event->impulse[i] += hit->impulse[i];
        if (!first) continue;
        first = false;
        memcpy(event->position, hit->position, sizeof event->position);
        memcpy(event->normal, hit->normal, sizeof event->normal);
        event->speed = hit->speed;
    }
}

static void push_begun(sadmm_world *world, sadmm_event_type type, const struct sadmm_touch *touch)
{
    sadmm_event *event = push(world, type, touch);
    if (type != SADMM_EVENT_CONTACT_BEGUN) return;
    if (touch->pair < world->contacts.pair_count) describe(world, touch->pair, event);
    describe_hits(world, touch, event);
}

/* Both lists are in order; `before` becomes `now`. */
static void push_changes(sadmm_world *world, struct sadmm_touches *before, struct sadmm_touches *now,
                         sadmm_event_type begun, sadmm_event_type ended)
{
    size_t i = 0, j = 0;
    while (i < before->count || j < now->count) {
        const int order = i == before->count ? 1 : j == now->count ? -1 : compare(&before->list[i], &now->list[j]);
        const bool goes_on = order == 0 && same(&before->list[i], &now->list[j]);
        if (order <= 0 && !goes_on) push(world, ended, &before->list[i]);
        if (order >= 0 && !goes_on) push_begun(world, begun, &now->list[j]);
        i += order <= 0;
        j += order >= 0;
    }
    const struct sadmm_touches old = *before;
    *before = *now;
    *now = old;
}

static sadmm_status compare_with_last(sadmm_world *world)
{
    TRY(list_touching(world));
    if (any_begun(&world->events.touching, &world->events.touching_now)) TRY(sadmm_world_download_contacts(world));
    TRY(list_inside(world));
    push_changes(world, &world->events.touching, &world->events.touching_now, SADMM_EVENT_CONTACT_BEGUN,
                 SADMM_EVENT_CONTACT_ENDED);
    push_changes(world, &world->events.inside, &world->events.inside_now, SADMM_EVENT_SENSOR_BEGUN,
                 SADMM_EVENT_SENSOR_ENDED);
    return SADMM_OK;
}

sadmm_status sadmm_world_note_events(sadmm_world *world)
{
    if (world->events.capacity == 0) return SADMM_OK;
    const struct sadmm_error before = world->error;
    const sadmm_status status = compare_with_last(world);
    if (status != SADMM_ERROR_OUT_OF_MEMORY) return status;
    world->error = before; /* the step has been made, and the next one compares with the one before it */
    return SADMM_OK;
}

void sadmm_world_hand_events_on(sadmm_world *from, sadmm_world *to)
{
    to->events = from->events;
    memset(&from->events, 0, sizeof from->events);
    begin_anew(to);
}

void sadmm_world_free_events(sadmm_world *world)
{
    void *blocks[] = {world->events.waiting, world->events.touching.list, world->events.inside.list,
                      world->events.touching_now.list, world->events.inside_now.list, world->events.pairs};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; ++i) sadmm_free(blocks[i]);
}
