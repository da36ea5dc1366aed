/* Broad phases against all pairs by brute force: the same set, for boxes of sizes over six decades, after every kind of
 * change, and whatever the order of insertion. Then the list of candidates on top: complete at every step although the
 * broad phase runs on larger boxes and seldom. One file: both make the same promise, that no pair is missing, and most
 * of the tests run on every kind of broad phase.
 */
#include <check.h>
#include <stdlib.h>
#include <string.h>

#include "collision/base/radix_sort.h"
#include "collision/find/find_candidates.h"
#include "collision/find/pipeline.h"
#include "config.h"
#include "core/base/memory.h"
#include "manifold_tools.h"

static const struct sadmm_broad_phase_kind *const kinds[] = {
    &sadmm_broad_phase_sweep,
#ifdef SADMM_HAVE_FCL
    &sadmm_broad_phase_fcl,
#endif
};
enum { KINDS = sizeof kinds / sizeof kinds[0], COUNT = 400 };

static int compare_keys(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

static void sort_unique(struct sadmm_pair_list *list)
{
    size_t n = 0;
    if (list->count) qsort(list->keys, list->count, sizeof *list->keys, compare_keys);
    for (size_t i = 0; i < list->count; ++i)
        if (n == 0 || list->keys[i] != list->keys[n - 1]) list->keys[n++] = list->keys[i];
    list->count = n;
}

static bool meet(const struct sadmm_broad_entry *a, const struct sadmm_broad_entry *b)
{
    if (!a->present || !b->present || (!a->moves && !b->moves)) return false;
    if (a->group != b->group && a->group >= 0 && b->group >= 0) return false;
    return boxes_overlap(&a->box, &b->box);
}

static struct sadmm_pair_list brute_force(const struct sadmm_broad_entry *entries, size_t count)
{
    struct sadmm_pair_list list = {0};
    for (size_t i = 0; i < count; ++i)
        for (size_t j = i + 1; j < count; ++j)
            if (meet(&entries[i], &entries[j])) ck_assert(sadmm_pair_list_add(&list, (uint32_t)i, (uint32_t)j));
    return list;
}

static void expect_equal(const struct sadmm_pair_list *a, const struct sadmm_pair_list *b)
{
    ck_assert_uint_eq(a->count, b->count);
    for (size_t i = 0; i < a->count; ++i) ck_assert_uint_eq(a->keys[i], b->keys[i]);
}

/* The broad phase's pairs equal brute force; none comes twice. */
static void expect_complete(const struct sadmm_broad_phase_kind *kind, struct sadmm_broad_phase *bp,
                            const struct sadmm_broad_entry *entries, size_t count)
{
    struct sadmm_pair_list found = {0}, expected = brute_force(entries, count);
    struct sadmm_error error = {0};
    ck_assert_int_eq(kind->pairs(bp, entries, count, &found, &error), SADMM_OK);
    size_t reported = found.count;
    sort_unique(&found);
    ck_assert_uint_eq(reported, found.count);
    sort_unique(&expected);
    expect_equal(&found, &expected);
    sadmm_free(found.keys);
    sadmm_free(expected.keys);
}

/* Sizes from 1e-3 to 1e3, log-uniform: large boxes hold thousands of small ones. Most in the unit cube. */
static void random_entry(struct random *r, struct sadmm_broad_entry *e, int groups)
{
    double size = pow(10, random_in(r, -3, random_unit(r) < 0.05 ? 3 : -0.5));
    e->present = true;
    e->moves = random_unit(r) < 0.8;
    e->group = !e->moves && random_unit(r) < 0.5 ? -1 : (int32_t)(random_unit(r) * groups);
    for (int k = 0; k < 3; ++k) {
        double c = random_in(r, -1, 1), h = size * random_in(r, 0.2, 1);
        e->box.lo[k] = c - h;
        e->box.hi[k] = c + h;
    }
}

START_TEST(every_broad_phase_finds_what_brute_force_finds)
{
    const struct sadmm_broad_phase_kind *kind = kinds[_i];
    static struct sadmm_broad_entry entries[COUNT];
    uint32_t changed[COUNT];
    for (int groups = 1; groups <= 5; groups += 2) {
        struct random r = {17 + (uint64_t)groups};
        struct sadmm_broad_phase *bp;
        struct sadmm_error error = {0};
        ck_assert_int_eq(kind->create(&bp, &error), SADMM_OK);
        memset(entries, 0, sizeof entries);
        for (int round = 0; round < 60; ++round) {
            size_t n = 0;
            /* all, a few, none, most: each takes another path; some leave, some come back, some change group or rest */
            double share = (const double[]){1, 0.05, 0, 0.7}[round % 4];
            for (uint32_t i = 0; i < COUNT; ++i) {
                if (random_unit(&r) >= share && round > 0) continue;
                changed[n++] = i;
                double what = random_unit(&r);
                if (round == 0 || !entries[i].present || what < 0.1) random_entry(&r, &entries[i], groups);
                else if (what < 0.2) entries[i].present = false;
                else
                    for (int k = 0; k < 3; ++k) {
                        double d = random_in(&r, -0.1, 0.1);
                        entries[i].box.lo[k] += d;
                        entries[i].box.hi[k] += d;
                        /* also boxes that shrink: a tree that keeps the larger one must not report more */
                        if (what < 0.4) entries[i].box.hi[k] -= 0.3 * (entries[i].box.hi[k] - entries[i].box.lo[k]);
                    }
            }
            ck_assert_int_eq(kind->update(bp, entries, COUNT, changed, n, &error), SADMM_OK);
            expect_complete(kind, bp, entries, COUNT);
        }
        kind->destroy(bp);
    }
}
END_TEST

START_TEST(boxes_that_touch_or_coincide_meet)
{
    const struct sadmm_broad_phase_kind *kind = kinds[_i];
    struct sadmm_broad_entry entries[30];
    uint32_t changed[30];
    struct sadmm_broad_phase *bp;
    struct sadmm_error error = {0};
    /* a 3 x 3 x 3 grid of unit boxes that share faces, edges and corners: all 351 pairs of the middle's neighbourhood
     * that touch; and three equal boxes at one place */
    for (int i = 0; i < 30; ++i) {
        changed[i] = (uint32_t)i;
        entries[i].present = entries[i].moves = true;
        entries[i].group = 0;
        for (int k = 0; k < 3; ++k) {
            int cell = i < 27 ? (k == 0 ? i % 3 : (k == 1 ? i / 3 % 3 : i / 9)) : 10;
            entries[i].box.lo[k] = cell;
            entries[i].box.hi[k] = cell + 1;
        }
    }
    ck_assert_int_eq(kind->create(&bp, &error), SADMM_OK);
    ck_assert_int_eq(kind->update(bp, entries, 30, changed, 30, &error), SADMM_OK);
    expect_complete(kind, bp, entries, 30);
    struct sadmm_pair_list found = {0};
    ck_assert_int_eq(kind->pairs(bp, entries, 30, &found, &error), SADMM_OK);
    /* 54 face, 72 edge and 32 corner neighbours, and 3 pairs of the equal ones */
    ck_assert_uint_eq(found.count, 54 + 72 + 32 + 3);
    sadmm_free(found.keys);
    kind->destroy(bp);
}
END_TEST

START_TEST(pairs_of_a_few_are_their_share_of_all)
{
    const struct sadmm_broad_phase_kind *kind = kinds[_i];
    static struct sadmm_broad_entry entries[COUNT];
    uint32_t changed[COUNT], few[COUNT];
    bool asked[COUNT] = {false};
    struct random r = {90};
    struct sadmm_broad_phase *bp;
    struct sadmm_error error = {0};
    struct sadmm_pair_list found = {0}, expected;
    size_t n = 0;
    ck_assert(kind->pairs_of != NULL);
    ck_assert_int_eq(kind->create(&bp, &error), SADMM_OK);
    for (uint32_t i = 0; i < COUNT; ++i) {
        changed[i] = i;
        random_entry(&r, &entries[i], 3);
        if (random_unit(&r) < 0.1) {
            few[n++] = i;
            asked[i] = true;
        }
    }
    ck_assert_int_eq(kind->update(bp, entries, COUNT, changed, COUNT, &error), SADMM_OK);
    ck_assert_int_eq(kind->pairs_of(bp, entries, COUNT, few, n, &found, &error), SADMM_OK);
    expected = brute_force(entries, COUNT);
    sort_unique(&expected);
    sort_unique(&found);
    n = 0;
    for (size_t i = 0; i < expected.count; ++i)
        if (asked[expected.keys[i] >> 32] || asked[expected.keys[i] & UINT32_MAX])
            expected.keys[n++] = expected.keys[i];
    ck_assert_uint_gt(n, 50);
    expected.count = n;
    expect_equal(&found, &expected);
    sadmm_free(found.keys);
    sadmm_free(expected.keys);
    kind->destroy(bp);
}
END_TEST

/* The same boxes registered in another order, in one go or one by one, give the same set. */
START_TEST(the_order_of_insertion_does_not_matter)
{
    const struct sadmm_broad_phase_kind *kind = kinds[_i];
    static struct sadmm_broad_entry entries[COUNT], partial[COUNT];
    uint32_t order[COUNT];
    struct random r = {33};
    struct sadmm_error error = {0};
    for (uint32_t i = 0; i < COUNT; ++i) {
        random_entry(&r, &entries[i], 2);
        order[i] = i;
    }
    for (int round = 0; round < 4; ++round) {
        struct sadmm_broad_phase *bp;
        for (uint32_t i = COUNT - 1; i > 0; --i) {
            uint32_t j = (uint32_t)(random_unit(&r) * (i + 1)), swap = order[i];
            order[i] = order[j];
            order[j] = swap;
        }
        ck_assert_int_eq(kind->create(&bp, &error), SADMM_OK);
        memset(partial, 0, sizeof partial);
        for (uint32_t i = 0; i < COUNT; ++i) {
            partial[order[i]] = entries[order[i]];
            if (round % 2 == 0) ck_assert_int_eq(kind->update(bp, partial, COUNT, &order[i], 1, &error), SADMM_OK);
        }
        if (round % 2) ck_assert_int_eq(kind->update(bp, entries, COUNT, order, COUNT, &error), SADMM_OK);
        expect_complete(kind, bp, entries, COUNT);
        kind->destroy(bp);
    }
}
END_TEST

/* Memory runs out at every place in turn: an error each time, and after it the broad phase takes everything again. */
START_TEST(broad_phases_survive_lack_of_memory)
{
    const struct sadmm_broad_phase_kind *kind = kinds[_i];
    static struct sadmm_broad_entry entries[COUNT];
    uint32_t changed[COUNT];
    struct random r = {71};
    int failures = 0;
    for (uint32_t i = 0; i < COUNT; ++i) {
        random_entry(&r, &entries[i], 2);
        changed[i] = i;
    }
    for (long n = 0;; ++n) {
        struct sadmm_broad_phase *bp = NULL;
        struct sadmm_pair_list list = {0};
        struct sadmm_error error = {0};
        sadmm_status status;
        sadmm_test_fail_allocations_after(n);
        status = kind->create(&bp, &error);
        if (status == SADMM_OK) status = kind->update(bp, entries, COUNT, changed, COUNT, &error);
        if (status == SADMM_OK) status = kind->pairs(bp, entries, COUNT, &list, &error);
        sadmm_test_fail_allocations_after(-1);
        if (status != SADMM_OK) {
            ++failures;
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            if (bp) {
                ck_assert_int_eq(kind->update(bp, entries, COUNT, changed, COUNT, &error), SADMM_OK);
                expect_complete(kind, bp, entries, COUNT);
            }
        }
        if (bp) kind->destroy(bp);
        sadmm_free(list.keys);
        if (status == SADMM_OK) break;
        ck_assert_int_lt(n, 1000);
    }
    ck_assert_int_gt(failures, 3);
}
END_TEST

START_TEST(radix_sort_sorts)
{
    struct random r = {3};
    static uint64_t keys[5000], expected[5000], scratch[5000];
    for (int bits = 1; bits <= 64; bits += 7)
        for (size_t count = 0; count <= 5000; count = count * 3 + 1) {
            for (size_t i = 0; i < count; ++i)
                expected[i] = keys[i] = (uint64_t)(random_unit(&r) * 0x1p53) << 11 >> (64 - bits);
            if (count) qsort(expected, count, sizeof *expected, compare_keys);
            sadmm_radix_sort(keys, scratch, count, bits);
            for (size_t i = 0; i < count; ++i) ck_assert_uint_eq(keys[i], expected[i]);
        }
}
END_TEST

/* ---- candidates -------------------------------------------------------------------------------------------------- */

struct scene {
    struct sadmm_shape shapes[COUNT];
    struct sadmm_geometry geometries[COUNT]; /* by shape */
    struct sadmm_collision_body bodies[COUNT];
    struct sadmm_collision_input input;
};

/* Two shapes a body, planes among them, several environments; sizes over three decades. */
static void fill_scene(struct scene *s, struct random *r, int environments)
{
    int32_t dynamic = 0;
    memset(s, 0, sizeof *s);
    for (int i = 0; i < COUNT; ++i) {
        struct sadmm_shape *shape = &s->shapes[i];
        struct sadmm_collision_body *body = &s->bodies[i / 2];
        bool plane = i % 98 == 0, still = i % 98 < 2 || i / 2 % 7 == 0;
        double R[9], size = pow(10, random_in(r, -3, -0.5));
        shape->alive = true;
        shape->geometry = (uint32_t)i;
        shape->body = i / 2;
        shape->revision = (uint32_t)i + 1;
        shape->category = 1u << i % 3;
        shape->mask = i % 5 ? ~0u : 5u;
        shape->orientation[0] = 1;
        s->geometries[i] = (struct sadmm_geometry){.type = plane ? SADMM_SHAPE_PLANE : 1 + i % 3, .subshapes = 1};
        for (int k = 0; k < 3; ++k) {
            s->geometries[i].size[k] = size * random_in(r, 0.3, 1);
            shape->position[k] = random_in(r, -0.1, 0.1);
        }
        if (i % 2 == 0) {
            body->system_body = still ? -1 : dynamic++;
            body->environment = still && i % 4 == 0 ? -1 : (int32_t)(random_unit(r) * environments);
            random_rotation(r, R);
            body->orientation[0] = cos(0.5 * i);
            body->orientation[1] = sin(0.5 * i) * R[0];
            body->orientation[2] = sin(0.5 * i) * R[3];
            body->orientation[3] = sin(0.5 * i) * R[6];
            for (int k = 0; k < 3; ++k) body->position[k] = random_in(r, -0.5, 0.5);
            for (int k = 0; k < 6; ++k) body->velocity[k] = still ? 0 : random_in(r, -1, 1);
            for (int k = 0; k < 2; ++k) body->acceleration[k] = still || i % 3 ? 0 : random_in(r, 0, 200);
        }
    }
    s->input = (struct sadmm_collision_input){
        .shapes = s->shapes,
        .shape_count = COUNT,
        .geometries = s->geometries,
        .geometry_count = COUNT,
        .bodies = s->bodies,
        .body_count = COUNT / 2,
        .dt = 0.005,
        .margin = 0.02,
        .threads = 1,
        .gravity = 9.81,
    };
}

static bool may_touch(const struct scene *s, const struct sadmm_candidates *c, uint32_t i, uint32_t j)
{
    const struct sadmm_shape *a = &s->shapes[i], *b = &s->shapes[j];
    const struct sadmm_collision_body *p = &s->bodies[a->body], *q = &s->bodies[b->body];
    if (!a->alive || !b->alive || a->body == b->body) return false;
    if (p->system_body < 0 && q->system_body < 0) return false;
    if (p->environment != q->environment && p->environment >= 0 && q->environment >= 0) return false;
    if (!(a->category & b->mask) || !(b->category & a->mask)) return false;
    return sadmm_candidate_meets(c, &s->input, i, j);
}

/* Boxes in straight motion against 400 moments of the step: what overlaps at one of them meets; and of two that move
 * alike only what overlaps at rest does, however fast they are. */
START_TEST(boxes_meet_when_they_come_together)
{
    const double dt = 0.01;
    struct random r = {7};
    int together = 0, apart = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        struct sadmm_box3 box[2];
        double centre[2][3], half[2][3], velocity[2][3];
        for (int s = 0; s < 2; ++s) {
            double extent[3];
            for (int k = 0; k < 3; ++k) {
                centre[s][k] = s ? centre[0][k] + random_in(&r, -1, 1) : 5;
                extent[k] = random_in(&r, 0.05, 0.3);
                velocity[s][k] = s && trial % 2 ? velocity[0][k] : random_in(&r, -100, 100);
            }
            shape_box(centre[s], extent, 0, velocity[s], 0, dt, &box[s]);
            memcpy(half[s], extent, sizeof extent);
        }
        bool touch = false;
        for (int moment = 0; moment <= 400 && !touch; ++moment) {
            double t = dt * moment / 400;
            touch = true;
            for (int k = 0; k < 3; ++k)
                touch = touch && fabs(centre[1][k] - centre[0][k] + t * (velocity[1][k] - velocity[0][k])) <=
                                     half[0][k] + half[1][k];
        }
        bool found = boxes_overlap(&box[0], &box[1]) &&
                     boxes_meet(&box[0], velocity[0], &box[1], velocity[1], dt);
        if (touch) ck_assert(found);
        /* The same velocity: the moment does not matter. */
        if (trial % 2) ck_assert_int_eq(found, touch);
        together += touch;
        apart += trial % 2 && !touch && boxes_overlap(&box[0], &box[1]);
    }
    ck_assert_int_gt(together, 300);
    ck_assert_int_gt(apart, 300); /* what the relative velocity leaves out */
}
END_TEST

static void random_direction(struct random *r, double size, double out[3])
{
    double R[9];
    random_rotation(r, R);
    for (int k = 0; k < 3; ++k) out[k] = size * R[k];
}

/* Balls of all sizes, and a plane now and then, with velocities, forces of their own and gravity. Each is held against
 * gravity and against its force, or not, and goes as far within the step as it then does: what touches on the way is
 * within the limit of the pair, and its boxes meet. */
START_TEST(what_accelerations_bring_together_is_foreseen)
{
    struct random r = {11};
    int touches = 0, by_acceleration = 0;
    for (int trial = 0; trial < 40000; ++trial) {
        const double dt = random_in(&r, 0.001, 0.02), margin = trial % 3 ? 0.02 : 0;
        const double gravity = trial % 5 ? random_in(&r, 0, 20) : 0;
        const bool plane = trial % 4 == 0;
        struct sadmm_geometry geometry[2] = {{.type = plane ? SADMM_SHAPE_PLANE : SADMM_SHAPE_SPHERE, .subshapes = 1},
                                             {.type = SADMM_SHAPE_SPHERE, .subshapes = 1}};
        struct sadmm_shape shape[2] = {{.geometry = 0}, {.geometry = 1}};
        struct sadmm_collision_body body[2] = {{.system_body = plane ? -1 : 0}, {.system_body = 1}};
        struct sadmm_proxy proxy[2];
        struct sadmm_box3 box[2];
        double g[3], way[3] = {0, 0, 0}, velocity[3], gap = random_in(&r, 0, 1) * dt * dt * 20, height = gap;
        random_direction(&r, gravity, g);
        for (int s = 0; s < 2; ++s) {
            const double force[3] = {random_in(&r, -1, 1), random_in(&r, -1, 1),
                                     trial % 2 ? random_in(&r, -20, 20) : 0};
            const bool moves = body[s].system_body >= 0, falls = random_unit(&r) < 0.7, driven = random_unit(&r) < 0.7;
            geometry[s].size[0] = pow(10, random_in(&r, -4, -1));
            shape[s].orientation[0] = body[s].orientation[0] = 1;
            body[s].acceleration[0] = moves ? sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]) : 0;
            for (int k = 0; k < 3; ++k) {
                body[s].velocity[k] = moves && trial % 2 ? random_in(&r, -0.02, 0.02) : 0;
                velocity[k] = body[s].velocity[k] + (moves ? (falls ? g[k] : 0) + (driven ? force[k] : 0) : 0) * dt;
                way[k] = velocity[k] * dt - way[k];
            }
            height += s || !plane ? geometry[s].size[0] : 0;
        }
        body[1].position[2] = height; /* above, as seen from the first */
        for (int s = 0; s < 2; ++s) {
            const struct proxy_turn turn = proxy_turn_of(&shape[s], &body[s], dt);
            proxy_place(&shape[s], &geometry[s], &body[s], &turn, dt, margin, gravity, &proxy[s], &box[s]);
        }

        bool touch = false, touch_without = false;
        for (int moment = 0; moment <= 50 && !touch; ++moment) {
            const double t = moment / 50.0, x = t * way[0], y = t * way[1], z = height + t * way[2];
            const double sum = height - gap;
            touch = plane ? z <= sum : x * x + y * y + z * z <= sum * sum;
            const double w = height + t * dt * (body[1].velocity[2] - body[0].velocity[2]);
            touch_without = touch_without || w <= sum + margin * fmin(proxy[0].thin, proxy[1].thin);
        }
        if (!touch) continue;
        ck_assert_double_le(gap, proxy_limit(&proxy[0], &proxy[1], relative_speed(proxy[0].velocity, proxy[1].velocity),
                                             margin, gravity, dt));
        if (plane)
            ck_assert(
                proxy_plane_meets(&proxy[0], &box[1], proxy_plane_reach(&proxy[1], margin, fall_of(gravity, dt))));
        else
            ck_assert(boxes_overlap(&box[0], &box[1]) &&
                      boxes_meet(&box[0], proxy[0].velocity, &box[1], proxy[1].velocity, dt));
        ++touches;
        by_acceleration += !touch_without;
    }
    ck_assert_int_gt(touches, 3000);
    ck_assert_int_gt(by_acceleration, 1000);
}
END_TEST

/* Over many steps with moves small and large, other forces, another gravity and time step, deaths, births and changes
 * of shapes: the list holds every pair that meets, in order, once. */
START_TEST(the_list_of_candidates_is_complete_at_every_step)
{
    struct random r = {400};
    static struct scene s;
    struct sadmm_candidates c;
    struct sadmm_error error = {0};
    uint32_t revision = 10 * COUNT;
    size_t pairs = 0;
    fill_scene(&s, &r, 1 + 2 * (_i / KINDS));
    ck_assert_int_eq(sadmm_candidates_init(&c, kinds[_i % KINDS], &error), SADMM_OK);
    for (int step = 0; step < 60; ++step) {
        double stride = (const double[]){1e-5, 1e-3, 0, 0.02}[step % 4];
        for (int i = 0; i < COUNT / 2; ++i) {
            struct sadmm_collision_body *body = &s.bodies[i];
            if (body->system_body < 0 && random_unit(&r) > 0.01) continue; /* static bodies may be placed again */
            if (step % 8 > 5 && i % 50) continue;                          /* steps in which little moves */
            for (int k = 0; k < 3; ++k) body->position[k] += stride * random_in(&r, -1, 1);
            if (body->system_body >= 0 && random_unit(&r) < 0.05) body->acceleration[step % 2] = random_in(&r, 0, 1000);
        }
        s.input.gravity = (const double[]){9.81, 9.81, 400, 0, 9.81, 9.81, 9.81}[step % 7];
        s.input.dt = step % 16 < 11 ? 0.005 : 0.01;
        for (int i = 0; i < COUNT; ++i) {
            struct sadmm_shape *shape = &s.shapes[i];
            if (random_unit(&r) > 0.005 || step % 4 == 2) continue;
            shape->revision = revision++;
            if (random_unit(&r) < 0.5) shape->alive = !shape->alive;
            else s.geometries[shape->geometry].size[0] *= 1.5;
        }
        ck_assert_int_eq(sadmm_candidates_update(&c, &s.input, 1, &error), SADMM_OK);
        for (size_t i = 1; i < c.list.count; ++i) ck_assert(c.list.keys[i - 1] < c.list.keys[i]);
        for (uint32_t i = 0; i < COUNT; ++i)
            for (uint32_t j = i + 1; j < COUNT; ++j) {
                bool swap = s.geometries[j].type < s.geometries[i].type;
                uint32_t a = swap ? j : i, b = swap ? i : j;
                uint64_t key = (uint64_t)a << 32 | b;
                if (s.geometries[a].type == SADMM_SHAPE_PLANE && s.geometries[b].type == SADMM_SHAPE_PLANE) continue;
                if (!may_touch(&s, &c, a, b)) continue;
                ck_assert_msg(bsearch(&key, c.list.keys, c.list.count, sizeof key, compare_keys) != NULL,
                              "step %d: pair %u %u is missing", step, a, b);
                ++pairs;
            }
    }
    ck_assert_uint_gt(pairs, 10000);
    sadmm_candidates_free(&c);
}
END_TEST

/* A scene at rest asks nothing of the broad phase, allocates nothing and keeps its list. */
START_TEST(rest_costs_no_broad_phase)
{
    struct random r = {2};
    static struct scene s;
    struct sadmm_candidates c;
    struct sadmm_error error = {0};
    size_t count;
    fill_scene(&s, &r, 1);
    for (int i = 0; i < COUNT / 2; ++i) memset(s.bodies[i].velocity, 0, sizeof s.bodies[i].velocity);
    ck_assert_int_eq(sadmm_candidates_init(&c, kinds[_i], &error), SADMM_OK);
    ck_assert_int_eq(sadmm_candidates_update(&c, &s.input, 1, &error), SADMM_OK);
    count = c.list.count;
    ck_assert_uint_gt(count, 100);
    for (int step = 0; step < 100; ++step) {
        for (int i = 0; i < COUNT / 2; ++i)
            for (int k = 0; k < 3; ++k)
                if (s.bodies[i].system_body >= 0) s.bodies[i].position[k] += random_in(&r, -1e-7, 1e-7);
        sadmm_test_fail_allocations_after(0);
        sadmm_status status = sadmm_candidates_update(&c, &s.input, 1, &error);
        sadmm_test_fail_allocations_after(-1);
        ck_assert_int_eq(status, SADMM_OK);
        ck_assert_uint_eq(c.changed_count, 0);
        ck_assert_uint_eq(c.list.count, count);
    }
    sadmm_candidates_free(&c);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("broad phase");
    TCase *trees = tcase_create("broad phases"), *candidates = tcase_create("candidates");
    SRunner *runner;
    int failed;

    tcase_set_timeout(trees, 60);
    tcase_add_loop_test(trees, every_broad_phase_finds_what_brute_force_finds, 0, KINDS);
    tcase_add_loop_test(trees, boxes_that_touch_or_coincide_meet, 0, KINDS);
    for (int k = 0; k < KINDS; ++k) /* an optional entry */
        if (kinds[k]->pairs_of) tcase_add_loop_test(trees, pairs_of_a_few_are_their_share_of_all, k, k + 1);
    tcase_add_loop_test(trees, the_order_of_insertion_does_not_matter, 0, KINDS);
    tcase_add_loop_test(trees, broad_phases_survive_lack_of_memory, 0, KINDS);
    tcase_add_test(trees, radix_sort_sorts);
    suite_add_tcase(suite, trees);
    tcase_set_timeout(candidates, 60);
    tcase_add_test(candidates, boxes_meet_when_they_come_together);
    tcase_add_test(candidates, what_accelerations_bring_together_is_foreseen);
    tcase_add_loop_test(candidates, the_list_of_candidates_is_complete_at_every_step, 0, 2 * KINDS);
    tcase_add_loop_test(candidates, rest_costs_no_broad_phase, 0, KINDS);
    suite_add_tcase(suite, candidates);

    runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
