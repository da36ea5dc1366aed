/* Queries of worlds: what they find by formula, against asking shape by shape, whatever the order, the threads and the
 * way that bodies came to where they are. */
#include <stddef.h>

#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "query_worlds.h"
#include "subadmm/query.h"
#include "world/state/world_state.h"

static sadmm_ray ray_of(double x, double y, double z, double dx, double dy, double dz)
{
    sadmm_ray ray = {{x, y, z}, {dx, dy, dz}, HUGE_VAL};
    return ray;
}

static sadmm_ray_hit cast(sadmm_world *world, sadmm_ray ray, const sadmm_query_filter *filter)
{
    sadmm_ray_hit hit;
    memset(&hit, 0x55, sizeof hit);
    MUST(world, sadmm_world_cast_ray(world, &ray, filter, &hit));
    return hit;
}

static void expect_hit(sadmm_ray_hit hit, sadmm_shape_id shape, double distance, double nx, double ny, double nz)
{
    ck_assert_msg(same_shape(hit.shape, shape), "slot %u hit, not %u", hit.shape.slot, shape.slot);
    ck_assert_double_eq_tol(hit.distance, distance, 1e-14 + 4e-15 * distance);
    ck_assert_double_eq_tol(hit.normal[0], nx, 4e-15);
    ck_assert_double_eq_tol(hit.normal[1], ny, 4e-15);
    ck_assert_double_eq_tol(hit.normal[2], nz, 4e-15);
}

/* To the bit. */
static bool same_hit(const sadmm_ray_hit *a, const sadmm_ray_hit *b)
{
    return same_shape(a->shape, b->shape) && a->body.slot == b->body.slot && a->body.generation == b->body.generation &&
           memcmp(&a->distance, &b->distance, sizeof a->distance) == 0 &&
           memcmp(a->point, b->point, sizeof a->point) == 0 && memcmp(a->normal, b->normal, sizeof a->normal) == 0 &&
           a->triangle == b->triangle && a->inside == b->inside;
}

static bool same_hits(const sadmm_ray_hit *a, const sadmm_ray_hit *b, int32_t count)
{
    int32_t i = 0;
    while (i < count && same_hit(&a[i], &b[i])) ++i;
    return i == count;
}

static void expect_nothing(sadmm_ray_hit hit)
{
    static const sadmm_ray_hit nothing = {.triangle = -1};
    ck_assert_msg(same_hit(&hit, &nothing), "slot %u hit at %g", hit.shape.slot, hit.distance);
}

/* ---- by formula ---- */

START_TEST(rays_by_formula)
{
    const double r2 = sqrt(0.5);
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_DYNAMIC, 0, 0, 0);
    sadmm_shape_def def;
    sadmm_shape_id id;
#define WITH(...)                \
    def = shape_of(__VA_ARGS__); \
    id = add_shape(world, body, &def);
#define GONE MUST(world, sadmm_world_remove_shape(world, id))
    expect_nothing(cast(world, ray_of(0, 0, 5, 0, 0, -1), NULL)); /* no shapes at all */
    WITH(SADMM_SHAPE_SPHERE, 2, 0, 0);
    expect_hit(cast(world, ray_of(0, 0, 5, 0, 0, -1e-300), NULL), id, 3, 0, 0, 1);
    expect_hit(cast(world, ray_of(0, 0, 5, 0, 0, -1e300), NULL), id, 3, 0, 0, 1);
    expect_hit(cast(world, ray_of(sqrt(3), 0, 9, 0, 0, -1), NULL), id, 8, sqrt(3) / 2, 0, 0.5);
    expect_hit(cast(world, ray_of(2, -7, 0, 0, 1, 0), NULL), id, 7, 1, 0, 0); /* touches */
    expect_nothing(cast(world, ray_of(2.0000001, -7, 0, 0, 1, 0), NULL));
    expect_nothing(cast(world, ray_of(0, 0, 5, 0, 0, 1), NULL));
    GONE;
    WITH(SADMM_SHAPE_BOX, 1, 2, 3);
    expect_hit(cast(world, ray_of(-4, 1, 2, 1, 0, 0), NULL), id, 3, -1, 0, 0);
    expect_hit(cast(world, ray_of(-4, 2, 3, 1, 0, 0), NULL), id, 3, -1, 0, 0); /* along an edge, end on */
    expect_hit(cast(world, ray_of(1, 2, 7, 0, 0, -1), NULL), id, 4, 0, 0, 1);
    expect_hit(cast(world, ray_of(-2, -3, 0, 1, 1, 0), NULL), id, sqrt(2), -1, 0, 0); /* at an edge: one of two faces */
    expect_nothing(cast(world, ray_of(-4, 2.0000001, 3, 1, 0, 0), NULL));
    GONE;
    WITH(SADMM_SHAPE_CAPSULE, 1, 2, 0);
    expect_hit(cast(world, ray_of(5, 0, 1.5, -1, 0, 0), NULL), id, 4, 1, 0, 0);
    expect_hit(cast(world, ray_of(0, 0, 9, 0, 0, -1), NULL), id, 6, 0, 0, 1);
    expect_hit(cast(world, ray_of(5, 0, 2 + r2, -1, 0, 0), NULL), id, 5 - r2, r2, 0, r2);
    expect_hit(cast(world, ray_of(1, 0, 9, 0, 0, -1), NULL), id, 7, 1, 0, 0); /* along its side */
    GONE;
    WITH(SADMM_SHAPE_CYLINDER, 1, 2, 0);
    expect_hit(cast(world, ray_of(5, 0, 2, -1, 0, 0), NULL), id, 4, 1, 0, 0); /* along a cap */
    expect_hit(cast(world, ray_of(0.5, 0, 9, 0, 0, -1), NULL), id, 7, 0, 0, 1);
    expect_hit(cast(world, ray_of(0.5, 0, -9, 0, 0, 1), NULL), id, 7, 0, 0, -1);
    expect_hit(cast(world, ray_of(1, 0, 9, 0, 0, -1), NULL), id, 7, 0, 0, 1); /* along its side */
    expect_nothing(cast(world, ray_of(1.0000001, 0, 9, 0, 0, -1), NULL));
    GONE;
    WITH(SADMM_SHAPE_CONE, 1, 0.5, 0); /* sides at 45 degrees */
    expect_hit(cast(world, ray_of(5, 0, 0, -1, 0, 0), NULL), id, 4.5, r2, 0, r2);
    expect_hit(cast(world, ray_of(0, 0, 9, 0, 0, -1), NULL), id, 8.5, 0, 0, 1); /* at the apex, if by its axis */
    expect_hit(cast(world, ray_of(0.25, 0, 9, 0, 0, -1), NULL), id, 8.75, r2, 0, r2);
    expect_hit(cast(world, ray_of(0.25, 0, -9, 0, 0, 1), NULL), id, 8.5, 0, 0, -1);
    expect_nothing(cast(world, ray_of(5, 0, 0.5000001, -1, 0, 0), NULL)); /* above the apex */
    expect_nothing(cast(world, ray_of(0.3, 0, 1.5, 1, 0, 0.5), NULL));    /* in the cone that would be above it */
    GONE;
    WITH(SADMM_SHAPE_ELLIPSOID, 1, 2, 3);
    expect_hit(cast(world, ray_of(0, 0, 9, 0, 0, -1), NULL), id, 6, 0, 0, 1);
    expect_hit(cast(world, ray_of(0, 9, 0, 0, -1, 0), NULL), id, 7, 0, 1, 0);
    expect_hit(cast(world, ray_of(1, 5, 0, 0, -1, 0), NULL), id, 5, 1, 0, 0); /* touches */
    GONE;
    const sadmm_body_id ground = add_body(world, SADMM_BODY_STATIC, 0, 0, 1);
    def = shape_of(SADMM_SHAPE_PLANE, 0, 0, 0);
    id = add_shape(world, ground, &def);
    expect_hit(cast(world, ray_of(1e6, 0, 3, 0, 0, -1), NULL), id, 2, 0, 0, 1);
    expect_hit(cast(world, ray_of(0, 0, 3, 0.6, 0, -0.8), NULL), id, 2.5, 0, 0, 1);
    expect_hit(cast(world, ray_of(0, 0, 1, 1, 0, -1), NULL), id, 0, 0, 0, 1); /* begins on it, and goes in */
    ck_assert(!cast(world, ray_of(0, 0, 1, 1, 0, -1), NULL).inside);
    expect_nothing(cast(world, ray_of(0, 0, 1, 1, 0, 0), NULL)); /* in it */
    expect_nothing(cast(world, ray_of(0, 0, 1, 1, 0, 1), NULL));
    expect_nothing(cast(world, ray_of(0, 0, 3, 1, 0, 0), NULL));
    ck_assert(cast(world, ray_of(0, 0, -3, 1, 0, 0), NULL).inside);
    sadmm_world_destroy(world);
#undef WITH
#undef GONE
}
END_TEST

/* Where the body is turned and moved, and the shape in it; a needle. */
START_TEST(rays_at_poses)
{
    sadmm_world *world = empty_world();
    sadmm_body_def at = sadmm_body_def_default();
    sadmm_body_id body;
    sadmm_shape_def needle = shape_of(SADMM_SHAPE_CAPSULE, 1e-6, 1e3, 0);
    at.type = SADMM_BODY_STATIC;
    at.position[0] = 10;
    at.orientation[0] = at.orientation[1] = sqrt(0.5); /* the shape's z to the world's -y */
    MUST(world, sadmm_world_add_body(world, &at, &body));
    needle.position[2] = 5;
    const sadmm_shape_id id = add_shape(world, body, &needle);
    /* its ends are at y = -1005 and 995 */
    const sadmm_ray_hit side = cast(world, ray_of(0, 900, 0, 1, 0, 0), NULL);
    ck_assert(same_shape(side.shape, id));
    ck_assert_double_eq_tol(side.distance, 10 - 1e-6, 1e-12);
    expect_nothing(cast(world, ray_of(0, 900, 1.001e-6, 1, 0, 0), NULL));
    const sadmm_ray_hit end = cast(world, ray_of(10, 2000, 0, 0, -1, 0), NULL);
    ck_assert_double_eq_tol(end.distance, 1005 - 1e-6, 1e-9);
    ck_assert_double_eq_tol(end.normal[1], 1, 1e-7);
    const sadmm_ray_hit low = cast(world, ray_of(0, -1005.1, 0, 1, 0, 0), NULL);
    expect_nothing(low);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(rays_from_inside)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_DYNAMIC, 0, 0, 0),
                        next = add_body(world, SADMM_BODY_STATIC, 9, 0, 0);
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0);
    sadmm_query_filter filter = sadmm_query_filter_default();
    const sadmm_shape_id id = add_shape(world, body, &ball), far = add_shape(world, next, &ball);
    const sadmm_ray ray = ray_of(0.25, 0, 0, 3, 0, 0);
    sadmm_ray_hit hit = cast(world, ray, NULL);
    expect_hit(hit, id, 0, -1, 0, 0);
    ck_assert(hit.inside && hit.point[0] == 0.25 && hit.body.slot == body.slot);
    filter.from_inside = false;
    hit = cast(world, ray, &filter);
    expect_hit(hit, far, 7.75, -1, 0, 0);
    ck_assert(!hit.inside && hit.point[0] == 8);
    /* a ray of length 0 asks what the origin is in */
    sadmm_ray point = ray;
    point.length = 0;
    ck_assert(cast(world, point, NULL).inside);
    point.origin[0] = 1.5;
    expect_nothing(cast(world, point, NULL));
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(filters)
{
    sadmm_world *world = empty_world();
    sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 0.5, 0, 0);
    const sadmm_ray ray = ray_of(-5, 0, 0, 1, 0, 0);
    sadmm_body_id bodies[4];
    sadmm_shape_id shapes[4];
    static const sadmm_body_type types[4] = {SADMM_BODY_DYNAMIC, SADMM_BODY_STATIC, SADMM_BODY_KINEMATIC,
                                             SADMM_BODY_DYNAMIC};
    for (int i = 0; i < 4; ++i) {
        sadmm_body_def def = sadmm_body_def_default();
        def.type = types[i];
        def.mass = 1;
        for (int k = 0; k < 3; ++k) def.inertia[k] = 1;
        def.position[0] = 2 * i;
        def.environment = i == 1 ? -1 : i;
        MUST(world, sadmm_world_add_body(world, &def, &bodies[i]));
        ball.category = 1u << i;
        ball.mask = i == 3 ? 0 : ~(1u << i);
        shapes[i] = add_shape(world, bodies[i], &ball);
    }
#define NEAREST(i) ck_assert(same_shape(cast(world, ray, &filter).shape, shapes[i]))
    sadmm_query_filter filter = sadmm_query_filter_default();
    NEAREST(0);
    filter.ignored = bodies[0];
    NEAREST(1);
    filter = sadmm_query_filter_default();
    filter.body_types = 1u << SADMM_BODY_KINEMATIC;
    NEAREST(2);
    filter.body_types |= 1u << SADMM_BODY_STATIC;
    NEAREST(1);
    filter.body_types = 0;
    expect_nothing(cast(world, ray, &filter));
    filter = sadmm_query_filter_default();
    filter.environment = 2;
    NEAREST(1);
    filter.body_types = 5; /* no static ones */
    NEAREST(2);
    filter = sadmm_query_filter_default();
    filter.category = 1; /* which the first one does not meet */
    filter.mask = 5;
    NEAREST(2);
    filter.mask = 8; /* the last one meets nothing */
    expect_nothing(cast(world, ray, &filter));
#undef NEAREST
    sadmm_world_destroy(world);
}
END_TEST

/* ---- against asking shape by shape ---- */

static sadmm_ray random_ray(struct random *r)
{
    sadmm_ray ray;
    for (int k = 0; k < 3; ++k) {
        ray.origin[k] = random_in(r, -12, 12);
        ray.direction[k] = random_in(r, -6, 6) - ray.origin[k];
    }
    ray.length = random_unit(r) < 0.2 ? random_in(r, 0, 15) : HUGE_VAL;
    return ray;
}

/* By every shape of the world for itself: a filter that ignores nothing, and a list of what is hit. */
static int brute_force(sadmm_world *world, const sadmm_ray *ray, sadmm_ray_hit *hits, int most)
{
    int count = 0;
    double d[3], length = 0;
    struct sadmm_ray_line line = {.length = ray->length, .from_inside = true};
    for (int k = 0; k < 3; ++k) length += ray->direction[k] * ray->direction[k];
    for (int k = 0; k < 3; ++k) {
        d[k] = ray->direction[k] / sqrt(length);
        line.origin[k] = ray->origin[k];
        line.direction[k] = d[k];
    }
    for (int32_t i = 0; i < sadmm_world_shape_count(world); ++i) {
        sadmm_shape_id id;
        MUST(world, sadmm_world_shape_at(world, i, &id));
        const struct sadmm_shape *shape = &world->shapes[id.slot - 1];
        const struct sadmm_rigid *rigid = &world->bodies[shape->body].rigid;
        struct sadmm_placed p = {.geometry = world->geometries[shape->geometry], .blocks = world->shape_data.blocks};
        struct sadmm_ray_find find;
        placed_pose(shape->position, shape->orientation, rigid->position, rigid->orientation, &p);
        if (!sadmm_ray_cast(&line, &p, line.length, &find)) continue;
        ck_assert_int_lt(count, most);
        int at = count++;
        for (; at > 0 && find.distance < hits[at - 1].distance; --at) hits[at] = hits[at - 1];
        hits[at].shape = id;
        hits[at].distance = find.distance;
    }
    return count;
}

static void compare_with_brute_force(sadmm_world *world, struct random *r, int rays)
{
    enum { MOST = 200, ROOM = 3 };
    sadmm_ray_hit all[MOST], some[ROOM], wanted[MOST];
    int32_t count, few;
    int hit = 0;
    for (int n = 0; n < rays; ++n) {
        const sadmm_ray ray = random_ray(r);
        const int have = brute_force(world, &ray, wanted, MOST);
        const sadmm_ray_hit first = cast(world, ray, NULL);
        MUST(world, sadmm_world_cast_ray_all(world, &ray, NULL, MOST, all, &count));
        MUST(world, sadmm_world_cast_ray_all(world, &ray, NULL, ROOM, some, &few));
        ck_assert_int_eq(count, have);
        ck_assert_int_eq(few, have);
        for (int i = 0; i < have; ++i) {
            /* the ray's direction is made unit in another way here */
            ck_assert_double_eq_tol(all[i].distance, wanted[i].distance, 1e-12);
            ck_assert(same_shape(all[i].shape, wanted[i].shape));
            if (i < ROOM) ck_assert(same_hit(&all[i], &some[i]));
        }
        if (have > 0) ck_assert(same_hit(&first, &all[0]));
        else expect_nothing(first);
        hit += have;
    }
    ck_assert_int_gt(hit, rays / 2);
}

START_TEST(world_is_its_shapes)
{
    const bool brief = getenv("SADMM_TEST_SHORT") != NULL;
    const int rays = brief ? 20 : 300;
    struct crowd c = make_crowd(150, 4);
    compare_with_brute_force(c.world, &c.r, rays);
    step_world(c.world, 2); /* they move */
    compare_with_brute_force(c.world, &c.r, rays);
    for (int n = 0; n < 40; ++n) { /* far, so that the tree is made again */
        const sadmm_body_id id = body_at(c.world, 2 + 3 * n);
        sadmm_body_state state = body_state(c.world, id);
        for (int k = 0; k < 3; ++k) state.position[k] = random_in(&c.r, -8, 8);
        MUST(c.world, sadmm_world_set_body_state(c.world, id, &state));
    }
    compare_with_brute_force(c.world, &c.r, rays);
    for (int n = 0; n < 60; ++n) MUST(c.world, sadmm_world_remove_body(c.world, body_at(c.world, 1 + n)));
    compare_with_brute_force(c.world, &c.r, rays);
    for (int n = 0; n < 30; ++n) add_to_crowd(&c, n);
    compare_with_brute_force(c.world, &c.r, rays);
    free_crowd(&c);
}
END_TEST

/* A kinematic body that a step moves is where it was sent. */
START_TEST(follows_bodies)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_KINEMATIC, 0, 0, 0);
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0);
    const double there[3] = {0, 0, 4}, as_it_is[4] = {1, 0, 0, 0};
    const sadmm_shape_id id = add_shape(world, body, &ball);
    const sadmm_ray ray = ray_of(0, 0, 10, 0, 0, -1);
    expect_hit(cast(world, ray, NULL), id, 9, 0, 0, 1);
    MUST(world, sadmm_world_move_body(world, body, there, as_it_is));
    expect_hit(cast(world, ray, NULL), id, 9, 0, 0, 1);
    step_world(world, 1);
    expect_hit(cast(world, ray, NULL), id, 5, 0, 0, 1);
    sadmm_body_state state = body_state(world, body);
    state.position[2] = 1;
    MUST(world, sadmm_world_set_body_state(world, body, &state));
    expect_hit(cast(world, ray, NULL), id, 8, 0, 0, 1);
    sadmm_world_destroy(world);
}
END_TEST

/* The numbers of a heightfield's and a mesh's triangles are those of contacts. */
START_TEST(triangles_have_their_numbers)
{
    static const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 3, 0, 0, 2, 1, 0};
    static const int32_t corners[] = {0, 1, 3, 4, 5, 6, 0, 1, 2}; /* the first one is none */
    const sadmm_mesh_def def = {sizeof def, x, 7, corners, 3};
    const double flat[9] = {0};
    const sadmm_heightfield_def field_def = {sizeof field_def, flat, 3, 3, {1, 1}};
    sadmm_mesh *mesh, *field;
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_STATIC, 0, 0, 0),
                        high = add_body(world, SADMM_BODY_STATIC, 0, 0, 5);
    sadmm_shape_def shape = shape_of(SADMM_SHAPE_MESH, 0, 0, 0);
    sadmm_query_filter filter = sadmm_query_filter_default();
    ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
    ck_assert_int_eq(sadmm_heightfield_create(&field_def, &field), SADMM_OK);
    shape.mesh = mesh;
    const sadmm_shape_id id = add_shape(world, body, &shape);
    shape.mesh = field;
    const sadmm_shape_id heights = add_shape(world, high, &shape);
    sadmm_ray_hit hit = cast(world, ray_of(0.25, 0.25, 1, 0, 0, -1), NULL);
    expect_hit(hit, id, 1, 0, 0, 1);
    ck_assert_int_eq(hit.triangle, 2);
    hit = cast(world, ray_of(2.25, 0.25, 1, 0, 0, -1), NULL);
    expect_hit(hit, id, 1, 0, 0, 1);
    ck_assert_int_eq(hit.triangle, 1);
    hit = cast(world, ray_of(0.25, 0.75, 7, 0, 0, -1), NULL); /* column 1, row 1, its upper half */
    expect_hit(hit, heights, 2, 0, 0, 1);
    ck_assert_int_eq(hit.triangle, 2 * 3 + 1);
    expect_nothing(cast(world, ray_of(2.25, 0.25, -1, 0, 0, 1), NULL)); /* from behind */
    filter.from_behind = true;
    hit = cast(world, ray_of(2.25, 0.25, -1, 0, 0, 1), &filter);
    expect_hit(hit, id, 1, 0, 0, 1);
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);
    sadmm_mesh_destroy(field);
}
END_TEST

/* ---- threads, order ---- */

START_TEST(batch_is_single)
{
    enum { RAYS = 700 };
    static sadmm_ray rays[RAYS];
    static sadmm_ray_hit hits[RAYS], single[RAYS];
    struct crowd c = make_crowd(60, 9);
    sadmm_settings settings = sadmm_world_settings(c.world);
    for (int i = 0; i < RAYS; ++i) {
        rays[i] = random_ray(&c.r);
        single[i] = cast(c.world, rays[i], NULL);
    }
    sadmm_test_force_threads(true);
    static const int threads[] = {1, 2, 4};
    for (size_t t = 0; t < sizeof threads / sizeof *threads; ++t) {
        settings.threads = threads[t];
        MUST(c.world, sadmm_world_set_settings(c.world, &settings));
        memset(hits, 0x55, sizeof hits);
        c.world->query.listed = c.world->query.current = false; /* placed by so many threads, too */
        MUST(c.world, sadmm_world_cast_rays(c.world, RAYS, rays, NULL, hits));
        ck_assert(same_hits(hits, single, RAYS));
    }
    sadmm_test_force_threads(false);
    MUST(c.world, sadmm_world_cast_rays(c.world, 0, NULL, NULL, NULL));
    free_crowd(&c);
}
END_TEST

/* A tree that has followed its shapes, and one that is made anew, say the same to the bit; and what queries do shows in
 * no step. */
START_TEST(history_does_not_show)
{
    enum { RAYS = 200 };
    struct crowd a = make_crowd(80, 21), b = make_crowd(80, 21);
    struct random r = {77};
    cast(a.world, random_ray(&r), NULL);
    for (int step = 0; step < 5; ++step) {
        step_world(a.world, 1);
        step_world(b.world, 1);
        cast(a.world, random_ray(&r), NULL);
    }
    ck_assert_uint_eq(state_hash(a.world), state_hash(b.world));
    ck_assert_ptr_null(b.world->query.tree.shapes); /* who does not ask does not pay */
    for (int i = 0; i < RAYS; ++i) {
        const sadmm_ray ray = random_ray(&r);
        const sadmm_ray_hit from_a = cast(a.world, ray, NULL), from_b = cast(b.world, ray, NULL);
        ck_assert(same_hit(&from_a, &from_b));
    }
    /* the same poses in a world that never made a step */
    struct crowd c = make_crowd(80, 21);
    for (int32_t i = 0; i < sadmm_world_body_count(a.world); ++i) {
        sadmm_body_state state = body_state(a.world, body_at(a.world, i));
        MUST(c.world, sadmm_world_set_body_state(c.world, body_at(c.world, i), &state));
    }
    for (int i = 0; i < RAYS; ++i) {
        const sadmm_ray ray = random_ray(&r);
        const sadmm_ray_hit from_a = cast(a.world, ray, NULL), from_c = cast(c.world, ray, NULL);
        ck_assert(same_hit(&from_a, &from_c));
    }
    free_crowd(&a);
    free_crowd(&b);
    free_crowd(&c);
}
END_TEST

/* ---- bad input ---- */

START_TEST(bad_rays)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_body(world, SADMM_BODY_STATIC, 0, 0, 0);
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0);
    const sadmm_ray good = ray_of(0, 0, 5, 0, 0, -1);
    sadmm_ray_hit hit, before;
    sadmm_query_filter filter = sadmm_query_filter_default();
    int32_t count = 55;
    add_shape(world, body, &ball);
    memset(&before, 0, sizeof before);
    before.distance = 5.5;
    hit = before;
    static const struct {
        size_t offset;
        double value;
        const char *text;
    } bad[] = {
        {offsetof(sadmm_ray, origin[1]), NAN, "origin[1] = nan"},
        {offsetof(sadmm_ray, origin[0]), INFINITY, "origin[0] = inf"},
        {offsetof(sadmm_ray, origin[2]), -1.01e9, "origin[2] = -1.01e+09: must be in [-1e+09, 1e+09]"},
        {offsetof(sadmm_ray, direction[0]), NAN, "direction[0] = nan: must be finite"},
        {offsetof(sadmm_ray, direction[2]), -INFINITY, "direction[2] = -inf: must be finite"},
        {offsetof(sadmm_ray, direction[2]), 0, "direction = (0, 0, 0): must not be 0"},
        {offsetof(sadmm_ray, length), -1e-300, "length = -1e-300: must be >= 0 m"},
        {offsetof(sadmm_ray, length), NAN, "length = nan: must be >= 0 m"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        sadmm_ray ray = good, rays[3] = {good, good, good};
        char text[96];
        memcpy((char *)&ray + bad[i].offset, &bad[i].value, sizeof bad[i].value);
        snprintf(text, sizeof text, "ray->%s", bad[i].text);
        expect_refused(world, sadmm_world_cast_ray(world, &ray, NULL, &hit), SADMM_ERROR_INVALID_ARGUMENT, text);
        expect_refused(world, sadmm_world_cast_ray_all(world, &ray, NULL, 1, &hit, &count),
                       SADMM_ERROR_INVALID_ARGUMENT, text);
        rays[2] = ray;
        snprintf(text, sizeof text, "rays[2].%s", bad[i].text);
        sadmm_ray_hit hits[3] = {before, before, before};
        expect_refused(world, sadmm_world_cast_rays(world, 3, rays, NULL, hits), SADMM_ERROR_INVALID_ARGUMENT, text);
        for (int k = 0; k < 3; ++k) ck_assert(same_hit(&hits[k], &before));
    }
    expect_refused(world, sadmm_world_cast_ray_all(world, &good, NULL, -1, &hit, &count), SADMM_ERROR_INVALID_ARGUMENT,
                   "capacity = -1: must be >= 0");
    expect_refused(world, sadmm_world_cast_rays(world, -3, &good, NULL, &hit), SADMM_ERROR_INVALID_ARGUMENT,
                   "count = -3: must be >= 0");
    filter.body_types = 8;
    expect_refused(world, sadmm_world_cast_ray(world, &good, &filter, &hit), SADMM_ERROR_INVALID_ARGUMENT,
                   "filter->body_types = 8: must be in [0, 7]");
    filter = sadmm_query_filter_default();
    filter.environment = -2;
    expect_refused(world, sadmm_world_cast_ray(world, &good, &filter, &hit), SADMM_ERROR_INVALID_ARGUMENT,
                   "filter->environment = -2: must be >= -1");
    filter = sadmm_query_filter_default();
    filter.ignored = body;
    MUST(world, sadmm_world_remove_body(world, body));
    expect_refused(world, sadmm_world_cast_ray(world, &good, &filter, &hit), SADMM_ERROR_STALE_ID, "filter->ignored");
    expect_refused(world, sadmm_world_cast_rays(world, 1, &good, &filter, &hit), SADMM_ERROR_STALE_ID,
                   "filter->ignored");
    ck_assert(same_hit(&hit, &before) && count == 55);
    MUST(world, sadmm_world_cast_ray_all(world, &good, NULL, 0, NULL, &count));
    ck_assert_int_eq(count, 0);
    sadmm_world_destroy(world);
}
END_TEST

/* Memory may run out anywhere: the error says so, and the next query is whole. */
/* Shapes whose tops are one plane, at the poses of a world: what is hit first is decided by rounding, or by slots. */
static sadmm_world *flush_world(struct random *r, bool turned)
{
    static const double square[4][3] = {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}}, flat[9] = {0};
    static const int32_t halves[2][3] = {{0, 1, 2}, {0, 2, 3}};
    static const sadmm_shape_type types[] = {SADMM_SHAPE_PLANE, SADMM_SHAPE_MESH, SADMM_SHAPE_BOX, SADMM_SHAPE_CYLINDER,
                                             SADMM_SHAPE_MESH, SADMM_SHAPE_CONE};
    const sadmm_mesh_def mesh_def = {sizeof mesh_def, square[0], 4, halves[0], 2};
    const sadmm_heightfield_def field_def = {sizeof field_def, flat, 3, 3, {1.7, 1.7}};
    sadmm_world *world = empty_world();
    sadmm_body_def body_def = sadmm_body_def_default();
    sadmm_body_id body;
    sadmm_mesh *mesh, *field;
    double norm = 0;
    body_def.type = SADMM_BODY_STATIC;
    for (int k = 0; k < 4; ++k) body_def.orientation[k] = turned || k == 0 ? random_in(r, -1, 1) : 0;
    for (int k = 0; k < 4; ++k) norm += body_def.orientation[k] * body_def.orientation[k];
    for (int k = 0; k < 4; ++k) body_def.orientation[k] /= sqrt(norm);
    MUST(world, sadmm_world_add_body(world, &body_def, &body));
    ck_assert_int_eq(sadmm_mesh_create(&mesh_def, &mesh), SADMM_OK);
    ck_assert_int_eq(sadmm_heightfield_create(&field_def, &field), SADMM_OK);
    const int first = (int)random_in(r, 0, 6);
    for (int k = 0; k < 6; ++k) {
        const int which = (first + k) % 6;
        sadmm_shape_def def = shape_of(types[which], 1.5, 0.5, 0.5);
        if (types[which] == SADMM_SHAPE_MESH) def.mesh = which == 1 ? mesh : field;
        if (types[which] == SADMM_SHAPE_BOX) def.size[1] = 1.5, def.position[2] = -0.5;
        if (types[which] == SADMM_SHAPE_CYLINDER) def.position[2] = -0.5;
        if (types[which] == SADMM_SHAPE_CONE) { /* on its head */
            def.orientation[0] = 0, def.orientation[1] = 1;
            def.position[2] = -0.5;
        }
        add_shape(world, body, &def);
    }
    sadmm_mesh_destroy(mesh);
    sadmm_mesh_destroy(field);
    return world;
}

/* The first hit is the first of all hits, to the bit, and so are the first few. */
START_TEST(first_is_first_of_all)
{
    struct random r = {12};
    int ties = 0;
    for (int w = 0; w < 30; ++w) {
        sadmm_world *world = flush_world(&r, w % 3 > 0);
        for (int k = 0; k < 1000; ++k) {
            sadmm_ray_hit first, some[2], all[8];
            int32_t count, of_some;
            sadmm_ray ray = random_ray(&r);
            if (k % 4 == 0) /* along the surface, nearly */
                for (int i = 0; i < 3; ++i) ray.direction[i] = -ray.origin[i] * (1 + 1e-9 * random_in(&r, -1, 1));
            MUST(world, sadmm_world_cast_ray(world, &ray, NULL, &first));
            MUST(world, sadmm_world_cast_ray_all(world, &ray, NULL, 8, all, &count));
            MUST(world, sadmm_world_cast_ray_all(world, &ray, NULL, 2, some, &of_some));
            if (count == 0) {
                ck_assert_int_eq((int)first.shape.slot, 0);
                continue;
            }
            ck_assert_msg(same_hit(&first, &all[0]), "world %d, ray %d: slot %u at %.17g, of all slot %u at %.17g", w,
                          k, first.shape.slot, first.distance, all[0].shape.slot, all[0].distance);
            ck_assert_int_eq(of_some, count);
            ck_assert(same_hits(some, all, count < 2 ? count : 2));
            ties += count > 1 && all[1].distance - all[0].distance < 1e-12;
        }
        sadmm_world_destroy(world);
    }
    ck_assert_int_gt(ties, 1000);
}
END_TEST

/* Numbers as small and as large as there are: what is hit has a distance, a point and a unit normal. */
START_TEST(whatever_is_hit_has_numbers)
{
    static const double sizes[] = {0, 5e-324, 1e-310, 1e-300, 1e-160, 1e-20, 1, 1e298};
    struct random r = {3};
    int hits = 0;
    for (int w = 0; w < 16; ++w) {
        sadmm_world *world = flush_world(&r, w % 2);
        sadmm_body_state state = body_state(world, body_at(world, 0));
        if (w / 2 % 4) state.position[w / 2 % 4 - 1] = w < 8 ? -1e298 : 1e298;
        MUST(world, sadmm_world_set_body_state(world, body_at(world, 0), &state));
        for (int k = 0; k < 2000; ++k) {
            sadmm_ray ray = {.length = k % 2 ? INFINITY : 1e300};
            sadmm_ray_hit hit;
            for (int i = 0; i < 3; ++i) {
                ray.origin[i] = sizes[(int)random_in(&r, 0, 7)] * random_in(&r, -1, 1);
                ray.direction[i] = sizes[(int)random_in(&r, 0, 8)] * random_in(&r, -1, 1);
            }
            if (ray.direction[0] == 0 && ray.direction[1] == 0 && ray.direction[2] == 0) continue;
            MUST(world, sadmm_world_cast_ray(world, &ray, NULL, &hit));
            if (!hit.shape.slot) continue;
            ++hits;
            for (int i = 0; i < 3; ++i) ck_assert(isfinite(hit.point[i]));
            ck_assert(hit.distance >= 0 && isfinite(hit.distance) && fabs(v3_norm(v3_load(hit.normal)) - 1) < 1e-12);
        }
        sadmm_world_destroy(world);
    }
    ck_assert_int_gt(hits, 3000);
}
END_TEST

START_TEST(out_of_memory)
{
    struct crowd c = make_crowd(20, 3);
    const sadmm_ray ray = ray_of(0, 0, 20, 0, 0, -1);
    sadmm_ray_hit hits[4], wanted[4];
    int32_t count, found;
    MUST(c.world, sadmm_world_cast_ray_all(c.world, &ray, NULL, 4, wanted, &found));
    free_crowd(&c);
    for (long n = 0;; ++n) {
        c = make_crowd(20, 3);
        sadmm_test_fail_allocations_after(n);
        const sadmm_status status = sadmm_world_cast_ray_all(c.world, &ray, NULL, 4, hits, &count);
        sadmm_test_fail_allocations_after(-1);
        if (status != SADMM_OK) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            MUST(c.world, sadmm_world_cast_ray_all(c.world, &ray, NULL, 4, hits, &count));
        }
        ck_assert_int_eq(count, found);
        ck_assert(same_hits(hits, wanted, found < 4 ? found : 4));
        free_crowd(&c);
        if (status == SADMM_OK) {
            ck_assert_int_gt(n, 4);
            return;
        }
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("query");
    TCase *tcase = tcase_create("query");
    tcase_add_test(tcase, rays_by_formula);
    tcase_add_test(tcase, rays_at_poses);
    tcase_add_test(tcase, rays_from_inside);
    tcase_add_test(tcase, filters);
    tcase_add_test(tcase, world_is_its_shapes);
    tcase_add_test(tcase, follows_bodies);
    tcase_add_test(tcase, triangles_have_their_numbers);
    tcase_add_test(tcase, batch_is_single);
    tcase_add_test(tcase, history_does_not_show);
    tcase_add_test(tcase, bad_rays);
    tcase_add_test(tcase, first_is_first_of_all);
    tcase_add_test(tcase, whatever_is_hit_has_numbers);
    tcase_add_test(tcase, out_of_memory);
    suite_add_tcase(suite, tcase);
    return run_suite(suite);
}
