/* Events and sensors by every solver: against formulas, against what contacts and distances say step by step, and that
 * nobody who does not ask for them sees any of it. */
#include "core/base/memory.h"
#include "body_worlds.h"
#include "fewer.h"

enum { MOST = 4096 };

/* The emulated device takes milliseconds a step: fewer of them there, of fewer bodies. */
#ifdef CUDA_EMULATED
enum { HEAP = 12, HEAP_STEPS = 60 };
static const double SHORT_STEP = 0.004;
#else
enum { HEAP = 30, HEAP_STEPS = 150 };
static const double SHORT_STEP = 0.001;
#endif

static sadmm_event events[MOST];

/* Take all of them. */
static int32_t take(sadmm_world *world)
{
    int32_t count = -1;
    int64_t dropped = -1;
    const int32_t waiting = sadmm_world_event_count(world);
    MUST(world, sadmm_world_take_events(world, MOST, events, &count, &dropped));
    ck_assert_int_eq(count, waiting);
    ck_assert_int_eq(dropped, 0);
    ck_assert_int_eq(sadmm_world_event_count(world), 0);
    return count;
}

static int32_t step_and_take(sadmm_world *world)
{
    step_world(world, 1);
    return take(world);
}

static void expect_event(const sadmm_event *event, sadmm_event_type type, sadmm_shape_id a, sadmm_shape_id b)
{
    ck_assert_int_eq(event->type, type);
    ck_assert_uint_eq(event->shape_a.slot, a.slot);
    ck_assert_uint_eq(event->shape_a.generation, a.generation);
    ck_assert_uint_eq(event->shape_b.slot, b.slot);
    ck_assert_uint_eq(event->shape_b.generation, b.generation);
}

static sadmm_shape_id give(sadmm_world *world, sadmm_body_id body, sadmm_shape_type type, double size,
                           bool sensor)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_shape_id id;
    def.type = type;
    for (int k = 0; k < 3; ++k) def.size[k] = size;
    def.sensor = sensor;
    MUST(world, sadmm_world_add_shape(world, body, &def, &id));
    return id;
}

static sadmm_body_id add_still(sadmm_world *world, sadmm_body_type type, double x, double y, double z)
{
    sadmm_body_def def = point_def(x, y, z);
    def.type = type;
    return add_defined(world, &def);
}

/* ---- contacts ---------------------------------------------------------------------------------------------------- */

/* A ball of 2 kg that falls 0.5 m onto a floor and bounces. */
START_TEST(ball_bounces)
{
    const double dt = SHORT_STEP, e = 0.8, height = 0.5;
    sadmm_world_def def = bodies_def();
    def.settings.dt = dt;
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id ground = add_still(world, SADMM_BODY_STATIC, 0, 0, 0),
                        ball = add_still(world, SADMM_BODY_DYNAMIC, 0, 0, 0.1 + height);
    const sadmm_shape_id floor = give(world, ground, SADMM_SHAPE_PLANE, 0, false),
                         round = give(world, ball, SADMM_SHAPE_SPHERE, 0.1, false);
    MUST(world, sadmm_world_set_shape_material(world, round, 0.5, e));
    MUST(world, sadmm_world_record_events(world, 100));
    const double fall = sqrt(2 * height / G), speed = G * fall; /* until, and at the first touch */
    const double flight = 2 * e * speed / G;
    for (int step = 1; step <= (int)((fall + flight) / dt) + 5; ++step) {
        const int32_t count = step_and_take(world);
        const double time = step * dt;
        for (int32_t k = 0; k < count; ++k) {
            const bool begun = events[k].type == SADMM_EVENT_CONTACT_BEGUN;
            expect_event(&events[k], begun ? SADMM_EVENT_CONTACT_BEGUN : SADMM_EVENT_CONTACT_ENDED, floor, round);
            ck_assert_int_eq(events[k].step, step);
            ck_assert(memcmp(&events[k].body_a, &ground, sizeof ground) == 0);
            ck_assert(memcmp(&events[k].body_b, &ball, sizeof ball) == 0);
            const bool first = time < fall + 0.5 * flight;
            /* A touch is found in the step that it falls into, and lasts for one or two. */
            expect_near(time, (first ? fall : fall + flight) + (begun ? 0 : dt), 3 * dt, "time");
            if (!begun) continue;
            expect_near(events[k].normal[2], 1, 1e-12, "normal");
            expect_near(events[k].position[0], 0, 1e-9, "position");
            expect_near(events[k].position[2], 0, speed * dt, "position"); /* a step's way from the floor */
            expect_near(events[k].speed, first ? speed : e * speed, 4 * G * dt, "speed"); /* of two steps at most */
            if (first) /* to what gravity adds in the step, and single precision */
                expect_near(events[k].impulse[2], 2 * (1 + e) * speed, 2 * 2 * G * dt + 1e-4, "impulse");
            expect_near(events[k].impulse[0], 0, 1e-4, "impulse");
        }
        if (step == (int)(fall / dt) - 3) ck_assert_int_eq(count, 0); /* foreseen, and no touch */
    }
    sadmm_world_destroy(world);
}
END_TEST

/* At rest a touch goes on; it ends when one of the shapes is removed, whoever takes its slot. */
START_TEST(rests_and_goes)
{
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id ground = add_still(world, SADMM_BODY_STATIC, 0, 0, 0);
    const sadmm_body_def cube = cube_def(0, 0, 0.1);
    const sadmm_body_id body = add_defined(world, &cube);
    const sadmm_shape_id floor = give(world, ground, SADMM_SHAPE_PLANE, 0, false),
                         box = give(world, body, SADMM_SHAPE_BOX, 0.1, false);
    int32_t begun = 0;
    MUST(world, sadmm_world_record_events(world, 100));
    for (int step = 0; step < 200; ++step) begun += step_and_take(world);
    ck_assert_int_eq(begun, 1);
    MUST(world, sadmm_world_remove_shape(world, box));
    const sadmm_shape_id other = give(world, body, SADMM_SHAPE_BOX, 0.1, false);
    ck_assert_uint_eq(other.slot, box.slot);
    ck_assert_int_eq(step_and_take(world), 2);
    expect_event(&events[0], SADMM_EVENT_CONTACT_ENDED, floor, box);
    expect_event(&events[1], SADMM_EVENT_CONTACT_BEGUN, floor, other);
    MUST(world, sadmm_world_remove_body(world, body));
    ck_assert_int_eq(step_and_take(world), 1);
    expect_event(&events[0], SADMM_EVENT_CONTACT_ENDED, floor, other);
    ck_assert(memcmp(&events[0].body_b, &body, sizeof body) == 0);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- against what contacts and distances say --------------------------------------------------------------------- */

/* Which shapes touch, by slots: what the events say, and what the world says. */
enum { SHAPES = 120 };
struct pairs {
    bool touch[SHAPES + 1][SHAPES + 1], sees[SHAPES + 1][SHAPES + 1];
};

static void follow(struct pairs *pairs, int32_t count)
{
    for (int32_t k = 0; k < count; ++k) {
        const sadmm_event_type type = events[k].type;
        const bool sensor = type == SADMM_EVENT_SENSOR_BEGUN || type == SADMM_EVENT_SENSOR_ENDED;
        const bool begun = type == SADMM_EVENT_SENSOR_BEGUN || type == SADMM_EVENT_CONTACT_BEGUN;
        bool *at = (sensor ? pairs->sees : pairs->touch)[events[k].shape_a.slot] + events[k].shape_b.slot;
        ck_assert_msg(*at != begun, "a touch of %u and %u ended, or began, twice", events[k].shape_a.slot,
                      events[k].shape_b.slot);
        *at = begun;
    }
}

static void inspect(sadmm_world *world, struct pairs *pairs)
{
    static sadmm_contact contacts[MOST];
    const int32_t count = sadmm_world_contact_count(world), shapes = sadmm_world_shape_count(world);
    memset(pairs, 0, sizeof *pairs);
    ck_assert_int_le(count, MOST);
    ck_assert_int_le(shapes, SHAPES);
    MUST(world, sadmm_world_contacts(world, 0, count, contacts));
    for (int32_t k = 0; k < count; ++k) {
        const sadmm_contact *c = &contacts[k];
        double along = 0;
        for (int i = 0; i < 3; ++i) along += c->impulse[i] * c->normal[i];
        if (along > 0 || c->separation <= 0) pairs->touch[c->shape_a.slot][c->shape_b.slot] = true;
    }
    for (int32_t i = 0; i < shapes; ++i) {
        sadmm_shape_id a, b;
        sadmm_body_id body_a, body_b;
        sadmm_shape_def def_a, def_b;
        MUST(world, sadmm_world_shape_at(world, i, &a));
        MUST(world, sadmm_world_shape_def(world, a, &def_a, &body_a));
        for (int32_t j = 0; def_a.sensor && j < shapes; ++j) {
            sadmm_closest_points closest;
            MUST(world, sadmm_world_shape_at(world, j, &b));
            MUST(world, sadmm_world_shape_def(world, b, &def_b, &body_b));
            if (def_b.sensor || body_a.slot == body_b.slot) continue;
            if (body_def(world, body_a).type == SADMM_BODY_STATIC && body_def(world, body_b).type == SADMM_BODY_STATIC)
                continue;
            if (!(def_a.category & def_b.mask) || !(def_b.category & def_a.mask)) continue;
            MUST(world, sadmm_world_closest_points(world, a, b, &closest));
            pairs->sees[a.slot][b.slot] = closest.distance <= 0;
        }
    }
}

/* A heap of boxes that falls onto a floor, with sensors on it, in it and around it. */
static sadmm_world *heap(int solver, int threads, bool sensors)
{
    sadmm_world_def def = bodies_def();
    def.settings.threads = threads;
    def.settings.iterations = 20;
    sadmm_world *world = bodies_world(&def, solver);
    const sadmm_body_id ground = add_still(world, SADMM_BODY_STATIC, 0, 0, 0);
    give(world, ground, SADMM_SHAPE_PLANE, 0, false);
    for (int n = 0; n < HEAP; ++n) {
        sadmm_body_def cube = cube_def(0.13 * (n % 3), 0.11 * (n / 3 % 2), 0.3 + 0.23 * (n / 2));
        cube.angular_velocity[n % 3] = 3;
        const sadmm_body_id body = add_defined(world, &cube);
        give(world, body,
             n % 4 == 1   ? SADMM_SHAPE_CYLINDER
             : n % 4 == 3 ? SADMM_SHAPE_SPHERE
                          : SADMM_SHAPE_BOX,
             0.1, false);
    }
    if (!sensors) return world;
    for (int n = 0; n < HEAP; n += 3) give(world, body_at(world, n + 1), SADMM_SHAPE_SPHERE, 0.16, true);
    give(world, ground, SADMM_SHAPE_BOX, 0.4, true);
    give(world, add_still(world, SADMM_BODY_STATIC, 0, 0, 2), SADMM_SHAPE_ELLIPSOID, 0.3, true);
    give(world, add_still(world, SADMM_BODY_STATIC, 0, 0, 1), SADMM_SHAPE_PLANE, 0, true);
    return world;
}

START_TEST(heap_is_followed)
{
    static struct pairs reported, seen;
    sadmm_world *world = heap(_i, 1, true);
    int32_t count = 0;
    memset(&reported, 0, sizeof reported);
    MUST(world, sadmm_world_record_events(world, MOST));
    for (int step = 0; step < HEAP_STEPS; ++step) {
        const int32_t taken = step_and_take(world);
        count += taken;
        follow(&reported, taken);
        inspect(world, &seen);
        ck_assert_msg(memcmp(&reported, &seen, sizeof reported) == 0, "step %d: events and world disagree", step);
    }
    ck_assert_int_gt(count, HEAP);
    sadmm_world_destroy(world);
}
END_TEST

/* The same events to the bit, on any number of threads, in one step or several between two readings, waited for or
 * not. */
START_TEST(same_on_any_thread)
{
    static sadmm_event wanted[MOST];
    int32_t counts[3];
    for (int run = 0; run < 3; ++run) {
        sadmm_world *world = heap(_i, run == 1 ? 4 : 1, true);
        MUST(world, sadmm_world_record_events(world, MOST));
        for (int step = 0; step < HEAP_STEPS; ++step)
            MUST(world, run == 2 ? sadmm_world_step_async(world) : sadmm_world_step(world));
        counts[run] = take(world);
        if (run == 0) memcpy(wanted, events, sizeof wanted);
        ck_assert_int_eq(counts[run], counts[0]);
        for (int32_t k = 0; k < counts[run]; ++k) {
            ck_assert_int_eq(events[k].step, wanted[k].step);
            expect_event(&events[k], wanted[k].type, wanted[k].shape_a, wanted[k].shape_b);
            ck_assert(memcmp(events[k].position, wanted[k].position, sizeof wanted[k].position) == 0);
            ck_assert(memcmp(events[k].normal, wanted[k].normal, sizeof wanted[k].normal) == 0);
            ck_assert(memcmp(events[k].impulse, wanted[k].impulse, sizeof wanted[k].impulse) == 0);
        }
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Sensors, and recording, leave the motion as it is. */
START_TEST(changes_nothing)
{
    uint64_t hashes[3];
    for (int run = 0; run < 3; ++run) {
        sadmm_world *world = heap(_i, 1, false);
        if (run > 0)
            for (int n = 0; n < HEAP; ++n) give(world, body_at(world, n + 1), SADMM_SHAPE_BOX, 0.3, true);
        if (run > 1) MUST(world, sadmm_world_record_events(world, 10));
        step_world(world, HEAP_STEPS);
        hashes[run] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hashes[0], hashes[1]);
    ck_assert_uint_eq(hashes[0], hashes[2]);
}
END_TEST

/* ---- sensors ----------------------------------------------------------------------------------------------------- */

static int32_t seen_by(sadmm_world *world, sadmm_shape_id sensor, sadmm_shape_id *shapes)
{
    int32_t count = -1;
    MUST(world, sadmm_world_sensor_overlaps(world, sensor, 8, shapes, &count));
    return count;
}

/* A ball falls through a sensor: when it comes and goes, and whom sensors see. */
START_TEST(sensor_by_formula)
{
    const double dt = SHORT_STEP;
    sadmm_world_def def = bodies_def();
    def.settings.dt = dt;
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id still = add_still(world, SADMM_BODY_STATIC, 0, 0, 0),
                        ball = add_still(world, SADMM_BODY_DYNAMIC, 0, 0, 1);
    const sadmm_shape_id sensor = give(world, still, SADMM_SHAPE_SPHERE, 0.2, true),
                         round = give(world, ball, SADMM_SHAPE_SPHERE, 0.1, false);
    int32_t count = 0;
    sadmm_shape_id shapes[8];
    MUST(world, sadmm_world_record_events(world, 100));
    step_world(world, (int)(0.7 / dt));
    count = take(world);
    ck_assert_int_eq(count, 2);
    expect_event(&events[0], SADMM_EVENT_SENSOR_BEGUN, sensor, round);
    expect_event(&events[1], SADMM_EVENT_SENSOR_ENDED, sensor, round);
    ck_assert_int_eq(events[0].step, (int64_t)ceil(sqrt(2 * 0.7 / G) / dt)); /* the centre is 0.3 above, and below */
    ck_assert_int_eq(events[1].step, (int64_t)ceil(sqrt(2 * 1.3 / G) / dt));
    ck_assert_int_eq(seen_by(world, sensor, shapes), 0);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(who_is_seen)
{
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id still = add_still(world, SADMM_BODY_STATIC, 0, 0, 0),
                        wall = add_still(world, SADMM_BODY_STATIC, 0, 0, 0),
                        kinematic = add_still(world, SADMM_BODY_KINEMATIC, 0, 0, 0),
                        a = add_still(world, SADMM_BODY_DYNAMIC, 0, 0, 0),
                        b = add_still(world, SADMM_BODY_DYNAMIC, 0, 0, 0);
    const sadmm_shape_id eye = give(world, still, SADMM_SHAPE_SPHERE, 1, true),
                         moving_eye = give(world, a, SADMM_SHAPE_BOX, 1, true);
    const sadmm_shape_id of_still = give(world, still, SADMM_SHAPE_SPHERE, 1, false),
                         of_wall = give(world, wall, SADMM_SHAPE_SPHERE, 1, false),
                         of_kinematic = give(world, kinematic, SADMM_SHAPE_SPHERE, 1, false),
                         of_a = give(world, a, SADMM_SHAPE_SPHERE, 1, false),
                         of_b = give(world, b, SADMM_SHAPE_SPHERE, 1, false);
    sadmm_shape_id s[8];
    ck_assert_int_eq(seen_by(world, eye, s), 3); /* what moves */
    ck_assert(s[0].slot == of_kinematic.slot && s[1].slot == of_a.slot && s[2].slot == of_b.slot);
    ck_assert_int_eq(seen_by(world, moving_eye, s), 4); /* all but its own */
    ck_assert(s[0].slot == of_still.slot && s[1].slot == of_wall.slot && s[2].slot == of_kinematic.slot &&
              s[3].slot == of_b.slot);
    /* Bodies that do not meet. */
    MUST(world, sadmm_world_set_body_pair_contact(world, still, a, false));
    ck_assert_int_eq(seen_by(world, eye, s), 2);
    ck_assert_int_eq(seen_by(world, moving_eye, s), 3);
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_joint_id id;
    joint.body_a = a, joint.body_b = b;
    MUST(world, sadmm_world_add_joint(world, &joint, &id));
    ck_assert_int_eq(seen_by(world, moving_eye, s), 2);
    MUST(world, sadmm_world_remove_joint(world, id));
    ck_assert_int_eq(seen_by(world, moving_eye, s), 3);
    /* Categories and environments. */
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.size[0] = 1;
    shape.sensor = true;
    shape.category = 2, shape.mask = 4;
    sadmm_shape_id picky;
    MUST(world, sadmm_world_add_shape(world, still, &shape, &picky));
    ck_assert_int_eq(seen_by(world, picky, s), 0);
    shape.sensor = false;
    shape.category = 4, shape.mask = 2;
    sadmm_shape_id wanted;
    MUST(world, sadmm_world_add_shape(world, b, &shape, &wanted));
    ck_assert_int_eq(seen_by(world, picky, s), 1);
    ck_assert_uint_eq(s[0].slot, wanted.slot);
    shape.sensor = true;
    shape.category = shape.mask = 0;
    MUST(world, sadmm_world_add_shape(world, still, &shape, &picky));
    ck_assert_int_eq(seen_by(world, picky, s), 0);
    /* `still` is of environment 0, and a static body of -1 meets all. */
    sadmm_body_def elsewhere = point_def(0, 0, 0);
    elsewhere.environment = 1;
    give(world, add_defined(world, &elsewhere), SADMM_SHAPE_SPHERE, 1, false);
    ck_assert_int_eq(seen_by(world, eye, s), 2); /* the kinematic body, and b's shape that it would meet */
    sadmm_body_def of_all = point_def(0, 0, 0);
    of_all.type = SADMM_BODY_STATIC;
    of_all.environment = -1;
    ck_assert_int_eq(seen_by(world, give(world, add_defined(world, &of_all), SADMM_SHAPE_SPHERE, 1, true), s), 4);
    sadmm_world_destroy(world);
}
END_TEST

/* Queries look through sensors unless they are asked not to. */
START_TEST(queries_look_through)
{
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id body = add_still(world, SADMM_BODY_DYNAMIC, 0, 0, 0);
    const sadmm_shape_id sensor = give(world, body, SADMM_SHAPE_SPHERE, 1, true),
                         solid = give(world, body, SADMM_SHAPE_SPHERE, 0.5, false);
    const sadmm_ray ray = {{0, 0, 5}, {0, 0, -1}, HUGE_VAL};
    sadmm_query_filter filter = sadmm_query_filter_default();
    sadmm_ray_hit hit;
    MUST(world, sadmm_world_cast_ray(world, &ray, &filter, &hit));
    ck_assert_uint_eq(hit.shape.slot, solid.slot);
    filter.sensors = true;
    MUST(world, sadmm_world_cast_ray(world, &ray, &filter, &hit));
    ck_assert_uint_eq(hit.shape.slot, sensor.slot);
    sadmm_shape_def read;
    MUST(world, sadmm_world_shape_def(world, sensor, &read, NULL));
    ck_assert(read.sensor);
    MUST(world, sadmm_world_shape_def(world, solid, &read, NULL));
    ck_assert(!read.sensor);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- keeping and losing ------------------------------------------------------------------------------------------ */

/* The oldest go where there is no room; what is left comes in order. */
START_TEST(oldest_are_dropped)
{
    static sadmm_event all[MOST];
    sadmm_world *whole = heap(_i, 1, true), *narrow = heap(_i, 1, true);
    MUST(whole, sadmm_world_record_events(whole, MOST));
    MUST(narrow, sadmm_world_record_events(narrow, 7));
    ck_assert_int_eq(sadmm_world_event_capacity(narrow), 7);
    step_world(whole, HEAP_STEPS);
    step_world(narrow, HEAP_STEPS);
    const int32_t total = take(whole);
    memcpy(all, events, sizeof all);
    ck_assert_int_eq(sadmm_world_event_count(narrow), 7);
    int32_t count;
    int64_t dropped;
    MUST(narrow, sadmm_world_take_events(narrow, 3, events, &count, NULL));
    ck_assert_int_eq(count, 3);
    MUST(narrow, sadmm_world_take_events(narrow, MOST, events + 3, &count, &dropped));
    ck_assert_int_eq(count, 4);
    ck_assert_int_eq(dropped, total - 7);
    for (int32_t k = 0; k < 7; ++k)
        expect_event(&events[k], all[total - 7 + k].type, all[total - 7 + k].shape_a, all[total - 7 + k].shape_b);
    MUST(narrow, sadmm_world_take_events(narrow, 0, NULL, &count, &dropped));
    ck_assert_int_eq(count, 0);
    ck_assert_int_eq(dropped, 0);
    MUST(narrow, sadmm_world_record_events(narrow, 0));
    step_world(narrow, 3);
    ck_assert_int_eq(sadmm_world_event_count(narrow), 0);
    sadmm_world_destroy(whole);
    sadmm_world_destroy(narrow);
}
END_TEST

/* A world restored reports once more what touches in it, then what a new one does that had all of it reported. */
START_TEST(restored_begins_anew)
{
    static struct pairs reported, seen;
    sadmm_world *world = heap(_i, 1, true);
    size_t size;
#ifdef BODIES_ON_CUDA
    world->def.backend = SADMM_BACKEND_AUTO; /* it was made for the CPU, and given the device's kernels */
#endif
    MUST(world, sadmm_world_record_events(world, MOST));
    step_world(world, HEAP_STEPS / 2);
    MUST(world, sadmm_world_save(world, NULL, 0, &size));
    void *buffer = malloc(size);
    ck_assert_ptr_nonnull(buffer);
    MUST(world, sadmm_world_save(world, buffer, size, &size));
    step_world(world, 30);
    const uint64_t hash = state_hash(world);
    inspect(world, &seen);
    MUST(world, sadmm_world_restore(world, buffer, size));
    ck_assert_int_eq(sadmm_world_event_capacity(world), MOST);
    ck_assert_int_eq(sadmm_world_event_count(world), 0);
    step_world(world, 30);
    ck_assert_uint_eq(state_hash(world), hash);
    memset(&reported, 0, sizeof reported);
    follow(&reported, take(world));
    ck_assert(memcmp(&reported, &seen, sizeof reported) == 0);
    free(buffer);
    sadmm_world_destroy(world);
}
END_TEST

#ifndef BODIES_ON_CUDA
/* Whatever allocation fails: a step is made or not, and events catch up. */
START_TEST(out_of_memory)
{
    static struct pairs reported, seen;
    for (long n = 0; n < 15; ++n) {
        sadmm_world *world = heap(_i, 1, true);
        MUST(world, sadmm_world_record_events(world, MOST));
        memset(&reported, 0, sizeof reported);
        step_world(world, 15);
        follow(&reported, take(world));
        for (int step = 0; step < 10; ++step) {
            sadmm_test_fail_allocations_after(n);
            const sadmm_status status = sadmm_world_step(world);
            sadmm_test_fail_allocations_after(-1);
            ck_assert(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY);
            follow(&reported, take(world));
        }
        step_world(world, 1);
        follow(&reported, take(world));
        inspect(world, &seen);
        ck_assert(memcmp(&reported, &seen, sizeof reported) == 0);
        sadmm_world_destroy(world);
    }
}
END_TEST
#endif

static void refused(sadmm_world *world, sadmm_status got, sadmm_status wanted, const char *text)
{
    ck_assert_int_eq(got, wanted);
    ck_assert_msg(strstr(sadmm_world_message(world), text), "no \"%s\" in: %s", text, sadmm_world_message(world));
}

START_TEST(bad_input)
{
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, _i);
    const sadmm_body_id body = add_still(world, SADMM_BODY_STATIC, 0, 0, 0);
    const sadmm_shape_id solid = give(world, body, SADMM_SHAPE_SPHERE, 1, false);
    const double corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const int32_t triangle[3] = {0, 1, 2};
    sadmm_mesh_def mesh_def = sadmm_mesh_def_default();
    mesh_def.vertices = corners, mesh_def.vertex_count = 3;
    mesh_def.triangles = triangle, mesh_def.triangle_count = 1;
    sadmm_mesh *mesh;
    MUST(world, sadmm_mesh_create(&mesh_def, &mesh));
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_MESH;
    shape.mesh = mesh;
    shape.sensor = true;
    int32_t count = 77;
    sadmm_shape_id shapes[1];
    const sadmm_shape_id stale = {9, 9};
    refused(world, sadmm_world_add_shape(world, body, &shape, NULL), SADMM_ERROR_INVALID_ARGUMENT, "def->sensor");
    refused(world, sadmm_world_record_events(world, -1), SADMM_ERROR_INVALID_ARGUMENT, "capacity = -1");
    refused(world, sadmm_world_record_events(world, (1 << 24) + 1), SADMM_ERROR_INVALID_ARGUMENT, "16777216");
    refused(world, sadmm_world_take_events(world, -1, events, &count, NULL), SADMM_ERROR_INVALID_ARGUMENT,
            "capacity = -1");
    refused(world, sadmm_world_take_events(world, 1, NULL, &count, NULL), SADMM_ERROR_INVALID_ARGUMENT, "events");
    refused(world, sadmm_world_take_events(world, 1, events, NULL, NULL), SADMM_ERROR_INVALID_ARGUMENT, "count");
    refused(world, sadmm_world_sensor_overlaps(world, solid, 1, shapes, &count), SADMM_ERROR_INVALID_ARGUMENT,
            "sensor");
    refused(world, sadmm_world_sensor_overlaps(world, stale, 1, shapes, &count), SADMM_ERROR_STALE_ID, "sensor");
    const sadmm_shape_id sensor = give(world, body, SADMM_SHAPE_SPHERE, 1, true);
    refused(world, sadmm_world_sensor_overlaps(world, sensor, -1, shapes, &count), SADMM_ERROR_INVALID_ARGUMENT,
            "capacity");
    refused(world, sadmm_world_sensor_overlaps(world, sensor, 1, NULL, &count), SADMM_ERROR_INVALID_ARGUMENT, "shapes");
    ck_assert_int_eq(count, 77);
    sadmm_mesh_destroy(mesh);
    sadmm_world_destroy(world);
}
END_TEST

static int tested_solvers(void)
{
#ifdef BODIES_ON_CUDA
    return tested_precisions();
#else
    return SOLVERS;
#endif
}

int main(void)
{
    Suite *suite = suite_create("events");
    TCase *tcase = tcase_create("events");
    tcase_set_timeout(tcase, 600);
#ifdef BODIES_ON_CUDA
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
#endif
    tcase_add_loop_test(tcase, ball_bounces, 0, tested_solvers());
    tcase_add_loop_test(tcase, rests_and_goes, 0, tested_solvers());
    tcase_add_loop_test(tcase, same_on_any_thread, 0, tested_solvers());
    tcase_add_loop_test(tcase, sensor_by_formula, 0, tested_solvers());
    tcase_add_loop_test(tcase, who_is_seen, 0, tested_solvers());
    tcase_add_loop_test(tcase, queries_look_through, 0, tested_solvers());
    if (!races_are_looked_for()) {
        tcase_add_loop_test(tcase, heap_is_followed, 0, tested_solvers());
        tcase_add_loop_test(tcase, changes_nothing, 0, tested_solvers());
        tcase_add_loop_test(tcase, oldest_are_dropped, 0, tested_solvers());
        tcase_add_loop_test(tcase, restored_begins_anew, 0, tested_solvers());
#ifndef BODIES_ON_CUDA
        tcase_add_loop_test(tcase, out_of_memory, 0, tested_solvers());
#endif
    }
    tcase_add_loop_test(tcase, bad_input, 0, tested_solvers());
    suite_add_tcase(suite, tcase);
    return RUN_BODIES_SUITE(suite);
}
