/* Overlaps and closest points in worlds: by formula, and against asking shape by shape. */
#include <stddef.h>

#include "collision/query/closest.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "query_worlds.h"
#include "subadmm/query.h"
#include "world/query/query_scene.h"

static const double origin[3] = {0, 0, 0}, as_it_is[4] = {1, 0, 0, 0};

static sadmm_closest_points closest(sadmm_world *world, sadmm_shape_id a, sadmm_shape_id b)
{
    sadmm_closest_points c;
    MUST(world, sadmm_world_closest_points(world, a, b, &c));
    return c;
}

static sadmm_closest_points closest_to(sadmm_world *world, const sadmm_shape_def *def, double x, double y, double z,
                                       sadmm_shape_id b)
{
    const double position[3] = {x, y, z};
    sadmm_closest_points c;
    MUST(world, sadmm_world_closest_to_shape(world, def, position, as_it_is, b, &c));
    return c;
}

static void expect_points(sadmm_closest_points c, double distance, double nx, double ny, double nz, double ax,
                          double ay, double az)
{
    const double n[3] = {nx, ny, nz}, a[3] = {ax, ay, az};
    ck_assert_double_eq_tol(c.distance, distance, 1e-14);
    for (int k = 0; k < 3; ++k) {
        ck_assert_double_eq_tol(c.normal[k], n[k], 1e-12);
        ck_assert_double_eq_tol(c.a[k], a[k], 1e-12);
        ck_assert_double_eq_tol(c.b[k], a[k] + distance * n[k], 1e-12);
    }
}

START_TEST(closest_by_formula)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id low = add_body(world, SADMM_BODY_STATIC, 0, 0, 0),
                        high = add_body(world, SADMM_BODY_DYNAMIC, 0, 0, 5);
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0), box = shape_of(SADMM_SHAPE_BOX, 1, 2, 3),
                          plane = shape_of(SADMM_SHAPE_PLANE, 0, 0, 0), can = shape_of(SADMM_SHAPE_CYLINDER, 1, 2, 0),
                          egg = shape_of(SADMM_SHAPE_ELLIPSOID, 1, 1, 2), cone = shape_of(SADMM_SHAPE_CONE, 1, 1, 0),
                          pill = shape_of(SADMM_SHAPE_CAPSULE, 0.5, 1, 0);
    const sadmm_shape_id ground = add_shape(world, low, &plane), top = add_shape(world, high, &box);
    expect_points(closest(world, ground, top), 2, 0, 0, 1, closest(world, ground, top).b[0],
                  closest(world, ground, top).b[1], 0);
    sadmm_closest_points c = closest(world, top, ground);
    ck_assert(c.distance == 2 && c.normal[2] == -1 && c.a[2] == 2 && c.b[2] == 0 && c.triangle == -1);
    expect_points(closest_to(world, &ball, 0.5, 0.25, 10, top), 1, 0, 0, -1, 0.5, 0.25, 9);
    expect_points(closest_to(world, &ball, 0.5, 0.25, 8.5, top), -0.5, 0, 0, -1, 0.5, 0.25, 7.5);
    expect_points(closest_to(world, &ball, 3, 0.25, 5, top), 1, -1, 0, 0, 2, 0.25, 5);
    expect_points(closest_to(world, &pill, 3, 0, 9, top), hypot(2, 0) - 0.5, -1, 0, 0, 2.5, 0,
                  closest_to(world, &pill, 3, 0, 9, top).a[2]);
    expect_points(closest_to(world, &egg, 0, 0, 11, top), 1, 0, 0, -1, 0, 0, 9);
    expect_points(closest_to(world, &cone, 0, 0, 0, top), 1, 0, 0, 1, 0, 0, 1);
    c = closest_to(world, &can, 0.25, 0.5, 11, top); /* cap on face: a pair of points that face each other there */
    ck_assert_double_eq_tol(c.distance, 1, 1e-14);
    ck_assert_double_eq_tol(c.a[2], 9, 1e-12);
    ck_assert(hypot(c.a[0] - 0.25, c.a[1] - 0.5) <= 1 + 1e-12 && fabs(c.b[0]) <= 1 + 1e-12 &&
              fabs(c.b[1]) <= 2 + 1e-12);
    sadmm_shape_def placed = ball; /* the shape's own place counts, and turns with the pose */
    placed.position[0] = 4;
    const double quarter[4] = {sqrt(0.5), 0, sqrt(0.5), 0}, here[3] = {0, 0, 5};
    MUST(world, sadmm_world_closest_to_shape(world, &placed, here, quarter, ground, &c));
    ck_assert_double_eq_tol(c.distance, 0, 1e-14); /* its middle is at z = 5 - 4 */
    sadmm_world_destroy(world);
}
END_TEST

/* Slots of the world's shapes that overlap the placed one, by asking every one. */
static int32_t brute_force(sadmm_world *world, const struct sadmm_placed *shape, const struct sadmm_box3 *box,
                           uint32_t *slots)
{
    int32_t count = 0;
    for (uint32_t slot = 0; slot < world->shape_ids.slots; ++slot) {
        struct sadmm_placed other;
        struct sadmm_separation separation;
        struct sadmm_box3 own;
        if (!world->shapes[slot].alive) continue;
        sadmm_world_place_shape(world, slot, &other);
        if (shape) {
            ck_assert(sadmm_closest(shape, &other, HUGE_VAL, &separation));
            if (separation.distance > 0) continue;
        } else if (other.geometry.type == SADMM_SHAPE_PLANE) {
            if (box->lo[2] > other.x[2]) continue; /* it is level */
        } else {
            placed_box(&other, &own);
            if (!boxes_overlap(&own, box)) continue;
        }
        slots[count++] = slot;
    }
    return count;
}

static void expect_slots(const sadmm_world *world, const sadmm_shape_id *got, int32_t count, const uint32_t *slots,
                         int32_t wanted)
{
    ck_assert_int_eq(count, wanted);
    for (int32_t i = 0; i < count; ++i) {
        ck_assert_uint_eq(got[i].slot, slots[i] + 1);
        ck_assert_uint_eq(got[i].generation, world->shape_ids.generations[slots[i]]);
    }
}

static void random_turn(struct random *r, double q[4])
{
    double length = 0;
    for (int k = 0; k < 4; ++k) {
        q[k] = random_in(r, -1, 1);
        length += q[k] * q[k];
    }
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(length);
}

START_TEST(overlaps_by_brute_force)
{
    enum { MOST = 600 };
    static const sadmm_shape_type types[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,
                                             SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
    static sadmm_shape_id shapes[MOST];
    static uint32_t slots[MOST];
    struct crowd c = make_crowd(120, 14);
    int total = 0;
    for (int n = 0; n < (getenv("SADMM_TEST_SHORT") ? 6 : 90); ++n) {
        sadmm_shape_def def =
            shape_of(types[n % 6], random_in(&c.r, 0.2, 2), random_in(&c.r, 0.2, 2), random_in(&c.r, 0.2, 2));
        double position[3], q[4];
        struct sadmm_placed placed;
        struct sadmm_box3 box;
        int32_t count, few;
        if (n == 30) step_world(c.world, 2);
        if (n == 60)
            for (int k = 0; k < 20; ++k) MUST(c.world, sadmm_world_remove_body(c.world, body_at(c.world, 5 + k)));
        random_turn(&c.r, q);
        for (int k = 0; k < 3; ++k) {
            position[k] = random_in(&c.r, -8, 8);
            def.position[k] = random_in(&c.r, -1, 1);
        }
        MUST(c.world, sadmm_world_overlap_shape(c.world, &def, position, q, NULL, MOST, shapes, &count));
        memset(&placed, 0, sizeof placed);
        placed_pose(def.position, def.orientation, position, q, &placed);
        placed.geometry = geometry_of((int)def.type, def.size);
        placed.blocks = c.world->query.prelude;
        expect_slots(c.world, shapes, count, slots, brute_force(c.world, &placed, NULL, slots));
        total += count;
        MUST(c.world, sadmm_world_overlap_shape(c.world, &def, position, q, NULL, 2, shapes, &few));
        expect_slots(c.world, shapes, few < 2 ? few : 2, slots, count < 2 ? count : 2);
        ck_assert_int_eq(few, count);
        for (int k = 0; k < 3; ++k) {
            box.lo[k] = position[k];
            box.hi[k] = position[k] + random_in(&c.r, 0, 3);
            if (n % 10 == 9 && k == 1) box.hi[k] = HUGE_VAL;
        }
        MUST(c.world, sadmm_world_overlap_box(c.world, box.lo, box.hi, NULL, MOST, shapes, &count));
        expect_slots(c.world, shapes, count, slots, brute_force(c.world, NULL, &box, slots));
        total += count;
    }
    ck_assert_int_gt(total, getenv("SADMM_TEST_SHORT") ? 3 : 100);
    const double lowest[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, highest[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
    int32_t all;
    MUST(c.world, sadmm_world_overlap_box(c.world, lowest, highest, NULL, 0, NULL, &all));
    ck_assert_int_eq(all, sadmm_world_shape_count(c.world));
    free_crowd(&c);
}
END_TEST

/* Triangles have their numbers, and the pose of the mesh counts. */
START_TEST(closest_on_meshes)
{
    static const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 3, 0, 0, 2, 1, 0};
    static const int32_t corners[] = {0, 1, 1, 3, 4, 5, 0, 1, 2}; /* the first one is none */
    const sadmm_mesh_def def = {sizeof def, x, 6, corners, 3};
    sadmm_mesh *mesh;
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_STATIC, 0, 0, 1),
                        other = add_body(world, SADMM_BODY_DYNAMIC, 2.2, 0.2, 4);
    sadmm_shape_def shape = shape_of(SADMM_SHAPE_MESH, 0, 0, 0);
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 0.5, 0, 0), plane = shape_of(SADMM_SHAPE_PLANE, 0, 0, 0);
    ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
    shape.mesh = mesh;
    const sadmm_shape_id id = add_shape(world, body, &shape), second = add_shape(world, body, &shape),
                         round = add_shape(world, other, &ball);
    sadmm_closest_points c = closest(world, round, id);
    ck_assert_double_eq_tol(c.distance, 2.5, 1e-14);
    ck_assert_int_eq(c.triangle, 1);
    ck_assert_double_eq_tol(c.normal[2], -1, 1e-14);
    c = closest(world, id, round);
    ck_assert_double_eq_tol(c.normal[2], 1, 1e-14);
    ck_assert_int_eq(c.triangle, 1);
    c = closest_to(world, &ball, 0.2, 0.2, 1.4, id);
    ck_assert_double_eq_tol(c.distance, -0.1, 1e-14);
    ck_assert_int_eq(c.triangle, 2);
    c = closest_to(world, &ball, 0.2, 0.2, 0.9, id); /* from behind it goes to the front as well */
    ck_assert_double_eq_tol(c.distance, -0.6, 1e-14);
    ck_assert_double_eq_tol(c.normal[2], -1, 1e-14);
    c = closest_to(world, &plane, 0, 0, 0.5, id);
    ck_assert_double_eq_tol(c.distance, 0.5, 1e-14);
    sadmm_status status = sadmm_world_closest_points(world, id, second, &c);
    expect_refused(world, status, SADMM_ERROR_INVALID_ARGUMENT, "both shapes are meshes");
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);
}
END_TEST

START_TEST(planes_overlap)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_STATIC, 0, 0, 0);
    const sadmm_shape_def plane = shape_of(SADMM_SHAPE_PLANE, 0, 0, 0);
    const double above[3] = {0, 0, 1}, below[3] = {0, 0, -1}, over[4] = {0, 1, 0, 0}, aslant[4] = {0.6, 0.8, 0, 0};
    const sadmm_shape_id id = add_shape(world, body, &plane);
    sadmm_shape_id got;
    int32_t count;
    sadmm_closest_points c;
#define OVERLAP(position, orientation, wanted)                                                           \
    MUST(world, sadmm_world_overlap_shape(world, &plane, position, orientation, NULL, 1, &got, &count)); \
    ck_assert_int_eq(count, wanted)
    OVERLAP(above, as_it_is, 1);
    OVERLAP(below, over, 1); /* upside down, below: a layer between the two */
    OVERLAP(above, over, 0);
    OVERLAP(above, aslant, 1);
#undef OVERLAP
    expect_refused(world, sadmm_world_closest_to_shape(world, &plane, above, as_it_is, id, &c),
                   SADMM_ERROR_INVALID_ARGUMENT, "both shapes are planes");
    sadmm_world_destroy(world);
}
END_TEST

/* A hull as the question, and in the world: a box by its corners is the box. */
START_TEST(hulls)
{
    static const double corners[] = {0, 0, 0, 2, 0, 0, 0, 4, 0, 2, 4, 0, 0, 0, 6, 2, 0, 6, 0, 4, 6, 2, 4, 6};
    sadmm_hull_def points = sadmm_hull_def_default();
    sadmm_hull *hull;
    points.points = corners;
    points.point_count = 8;
    const sadmm_status made = sadmm_hull_create(&points, &hull);
    if (made == SADMM_ERROR_UNAVAILABLE) return; /* built without qhull */
    ck_assert_int_eq(made, SADMM_OK);
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_DYNAMIC, 10, 0, 0);
    const sadmm_shape_def box = shape_of(SADMM_SHAPE_BOX, 1, 2, 3);
    sadmm_shape_def def = shape_of(SADMM_SHAPE_HULL, 0, 0, 0);
    def.hull = hull;
    const sadmm_shape_id id = add_shape(world, body, &box);
    struct random r = {3};
    for (int n = 0; n < 40; ++n) {
        double position[3], q[4];
        sadmm_closest_points by_hull, by_box;
        random_turn(&r, q);
        for (int k = 0; k < 3; ++k) position[k] = (k == 0 ? 10 : 0) + random_in(&r, -8, 8);
        MUST(world, sadmm_world_closest_to_shape(world, &def, position, q, id, &by_hull));
        sadmm_shape_def same = box;
        for (int k = 0; k < 3; ++k) same.position[k] = k + 1;
        MUST(world, sadmm_world_closest_to_shape(world, &same, position, q, id, &by_box));
        ck_assert_double_eq_tol(by_hull.distance, by_box.distance, 1e-12);
    }
    /* in the world, beside a second one that takes the blocks' place when it goes */
    sadmm_hull *other;
    double bent[24];
    memcpy(bent, corners, sizeof bent);
    bent[0] = -1;
    points.points = bent;
    ck_assert_int_eq(sadmm_hull_create(&points, &other), SADMM_OK);
    const sadmm_body_id far = add_body(world, SADMM_BODY_DYNAMIC, -10, 0, 0);
    sadmm_shape_def second = def;
    second.hull = other;
    const sadmm_shape_id gone = add_shape(world, far, &second), stays = add_shape(world, far, &def);
    sadmm_hull_destroy(other);
    const sadmm_closest_points before = closest(world, stays, id);
    sadmm_ray ray = {{-15, 1, 1}, {1, 0, 0}, HUGE_VAL};
    sadmm_ray_hit hit;
    MUST(world, sadmm_world_remove_shape(world, gone));
    MUST(world, sadmm_world_cast_ray(world, &ray, NULL, &hit));
    ck_assert(same_shape(hit.shape, stays));
    ck_assert_double_eq_tol(hit.distance, 5, 1e-13);
    const sadmm_closest_points after = closest(world, stays, id);
    ck_assert(before.distance == after.distance);
    ck_assert_double_eq_tol(after.distance, 10 - 1 + 10 - 2, 1e-12);
    sadmm_hull_destroy(hull);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(filters_of_overlaps)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_DYNAMIC, 0, 0, 0),
                        other = add_body(world, SADMM_BODY_STATIC, 0, 0, 0);
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0);
    const double lowest[3] = {-1, -1, -1}, highest[3] = {1, 1, 1};
    const sadmm_shape_id first = add_shape(world, body, &ball), second = add_shape(world, other, &ball);
    sadmm_query_filter filter = sadmm_query_filter_default();
    sadmm_shape_id got[2];
    int32_t count;
    filter.ignored = body;
    MUST(world, sadmm_world_overlap_shape(world, &ball, origin, as_it_is, &filter, 2, got, &count));
    ck_assert(count == 1 && same_shape(got[0], second));
    MUST(world, sadmm_world_overlap_box(world, lowest, highest, &filter, 2, got, &count));
    ck_assert(count == 1 && same_shape(got[0], second));
    filter = sadmm_query_filter_default();
    filter.body_types = 1u << SADMM_BODY_DYNAMIC;
    MUST(world, sadmm_world_overlap_box(world, lowest, highest, &filter, 2, got, &count));
    ck_assert(count == 1 && same_shape(got[0], first));
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(bad_shapes)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_DYNAMIC, 0, 0, 0);
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0);
    const sadmm_shape_id id = add_shape(world, body, &ball), dead = add_shape(world, body, &ball);
    const double far[3] = {0, 1.01e9, 0}, none[3] = {0, 0, NAN}, loose[4] = {1, 0.1, 0, 0}, low[3] = {0, 0, 0},
                 high[3] = {1, -1, 1};
    sadmm_shape_id got = {77, 77};
    sadmm_closest_points c, before;
    int32_t count = 55;
    MUST(world, sadmm_world_remove_shape(world, dead));
    memset(&c, 0, sizeof c);
    c.distance = 4.5;
    before = c;
#define REFUSED(status, text, call) expect_refused(world, call, status, text)
#define BOTH(text, def, position, orientation)                                                    \
    REFUSED(SADMM_ERROR_INVALID_ARGUMENT, text,                                                   \
            sadmm_world_overlap_shape(world, def, position, orientation, NULL, 1, &got, &count)); \
    REFUSED(SADMM_ERROR_INVALID_ARGUMENT, text, sadmm_world_closest_to_shape(world, def, position, orientation, id, &c))
    sadmm_shape_def bad = ball;
    bad.size[0] = -1;
    BOTH("def->size[0] = -1: must be in [1e-06, 1e+06] m", &bad, origin, as_it_is);
    bad = shape_of(SADMM_SHAPE_MESH, 1, 1, 1);
    BOTH("def->type = 5: must not be a mesh", &bad, origin, as_it_is);
    bad = shape_of(SADMM_SHAPE_HULL, 1, 1, 1);
    BOTH("def->hull = NULL", &bad, origin, as_it_is);
    bad = ball;
    bad.type = (sadmm_shape_type)99;
    BOTH("def->type = 99", &bad, origin, as_it_is);
    bad = ball;
    bad.position[1] = INFINITY;
    BOTH("def->position[1] = inf", &bad, origin, as_it_is);
    bad = ball;
    bad.orientation[0] = 2;
    BOTH("def->orientation", &bad, origin, as_it_is);
    BOTH("position[1] = 1.01e+09", &ball, far, as_it_is);
    BOTH("position[2] = nan", &ball, none, as_it_is);
    BOTH("orientation = (1, 0.1, 0, 0)", &ball, origin, loose);
    REFUSED(SADMM_ERROR_INVALID_ARGUMENT, "lowest[1] = 0: must be <= highest[1] = -1",
            sadmm_world_overlap_box(world, low, high, NULL, 1, &got, &count));
    REFUSED(SADMM_ERROR_INVALID_ARGUMENT, "lowest[2] = nan",
            sadmm_world_overlap_box(world, none, far, NULL, 1, &got, &count));
    REFUSED(SADMM_ERROR_INVALID_ARGUMENT, "capacity = -1: must be >= 0",
            sadmm_world_overlap_box(world, low, low, NULL, -1, &got, &count));
    REFUSED(SADMM_ERROR_INVALID_ARGUMENT, "capacity = -1: must be >= 0",
            sadmm_world_overlap_shape(world, &ball, origin, as_it_is, NULL, -1, &got, &count));
    REFUSED(SADMM_ERROR_STALE_ID, "a = (slot 2", sadmm_world_closest_points(world, dead, id, &c));
    REFUSED(SADMM_ERROR_STALE_ID, "b = (slot 2", sadmm_world_closest_points(world, id, dead, &c));
    REFUSED(SADMM_ERROR_STALE_ID, "b = (slot 2",
            sadmm_world_closest_to_shape(world, &ball, origin, as_it_is, dead, &c));
    REFUSED(SADMM_ERROR_INVALID_ARGUMENT, "a and b are the same shape", sadmm_world_closest_points(world, id, id, &c));
    ck_assert(got.slot == 77 && count == 55 && memcmp(&c.distance, &before.distance, sizeof c.distance) == 0);
    /* a body where a state can still be set, but no distance is a number */
    sadmm_body_state state = body_state(world, body);
    state.position[0] = 1e300;
    MUST(world, sadmm_world_set_body_state(world, body, &state));
    const sadmm_status status = sadmm_world_closest_to_shape(world, &ball, origin, as_it_is, id, &c);
    ck_assert(status == SADMM_ERROR_NON_FINITE || (status == SADMM_OK && c.distance > 1e200));
    MUST(world, sadmm_world_overlap_shape(world, &ball, origin, as_it_is, NULL, 1, &got, &count));
    ck_assert_int_eq(count, 0);
    sadmm_world_destroy(world);
#undef BOTH
#undef REFUSED
}
END_TEST

START_TEST(out_of_memory)
{
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 3, 0, 0);
    for (long n = 0;; ++n) {
        struct crowd c = make_crowd(20, 3);
        sadmm_shape_id got[200], wanted[200];
        int32_t count, found;
        sadmm_test_fail_allocations_after(n);
        const sadmm_status status = sadmm_world_overlap_shape(c.world, &ball, origin, as_it_is, NULL, 200, got, &count);
        sadmm_test_fail_allocations_after(-1);
        if (status != SADMM_OK) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            MUST(c.world, sadmm_world_overlap_shape(c.world, &ball, origin, as_it_is, NULL, 200, got, &count));
        }
        MUST(c.world, sadmm_world_overlap_shape(c.world, &ball, origin, as_it_is, NULL, 200, wanted, &found));
        ck_assert(count == found && count > 0 && memcmp(got, wanted, (size_t)count * sizeof *got) == 0);
        free_crowd(&c);
        if (status == SADMM_OK) {
            ck_assert_int_gt(n, 5);
            return;
        }
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("query_shape");
    TCase *tcase = tcase_create("query_shape");
    tcase_add_test(tcase, closest_by_formula);
    tcase_add_test(tcase, overlaps_by_brute_force);
    tcase_add_test(tcase, closest_on_meshes);
    tcase_add_test(tcase, planes_overlap);
    tcase_add_test(tcase, hulls);
    tcase_add_test(tcase, filters_of_overlaps);
    tcase_add_test(tcase, bad_shapes);
    tcase_add_test(tcase, out_of_memory);
    suite_add_tcase(suite, tcase);
    return run_suite(suite);
}
