/* Shapes that move through worlds: by formula, against where shapes are on their way, and against rays. */
#include "collision/query/closest.h"
#include "query_worlds.h"
#include "subadmm/query.h"
#include "world/query/query_scene.h"

static const double as_it_is[4] = {1, 0, 0, 0};

static sadmm_ray_hit cast(sadmm_world *world, const sadmm_shape_def *def, const double from[3], double dx, double dy,
                          double dz, double length)
{
    const double direction[3] = {dx, dy, dz};
    sadmm_ray_hit hit;
    MUST(world, sadmm_world_cast_shape(world, def, from, as_it_is, direction, length, NULL, &hit));
    return hit;
}

static void expect_hit(sadmm_ray_hit hit, sadmm_shape_id shape, double distance, double nx, double ny, double nz)
{
    ck_assert(same_shape(hit.shape, shape));
    ck_assert_double_eq_tol(hit.distance, distance, 1e-11 * (10 + distance));
    ck_assert_double_eq_tol(hit.normal[0], nx, 1e-6); /* of a sphere's way: the square root of the distance's */
    ck_assert_double_eq_tol(hit.normal[1], ny, 1e-6);
    ck_assert_double_eq_tol(hit.normal[2], nz, 1e-6);
    ck_assert(!hit.inside);
}

static void expect_nothing(sadmm_ray_hit hit)
{
    ck_assert_msg(hit.shape.slot == 0 && hit.triangle == -1 && hit.distance == 0, "shape %u after %g m", hit.shape.slot,
                  hit.distance);
}

START_TEST(by_formula)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id ground = add_body(world, SADMM_BODY_STATIC, 0, 0, 0),
                        body = add_body(world, SADMM_BODY_DYNAMIC, 10, 0, 3);
    const sadmm_shape_def plane = shape_of(SADMM_SHAPE_PLANE, 0, 0, 0), ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0),
                          box = shape_of(SADMM_SHAPE_BOX, 1, 1, 1), small = shape_of(SADMM_SHAPE_SPHERE, 0.5, 0, 0),
                          pill = shape_of(SADMM_SHAPE_CAPSULE, 0.5, 1, 0),
                          can = shape_of(SADMM_SHAPE_CYLINDER, 0.5, 1, 0),
                          cone = shape_of(SADMM_SHAPE_CONE, 0.5, 1, 0),
                          egg = shape_of(SADMM_SHAPE_ELLIPSOID, 0.5, 0.5, 1);
    const sadmm_shape_id low = add_shape(world, ground, &plane), round = add_shape(world, body, &ball);
    const double at[3] = {0, 0, 3}, aside[3] = {0, 0.9, 3}, off[3] = {0, 1.5 + 1e-6, 3}, on[3] = {0, 1.5 - 1e-6, 3};
    expect_hit(cast(world, &small, at, 1, 0, 0, INFINITY), round, 8.5, -1, 0, 0);
    expect_hit(cast(world, &small, at, 2, 0, 0, 8.5), round, 8.5, -1, 0, 0); /* whatever its length */
    expect_nothing(cast(world, &small, at, 1, 0, 0, 8.499999));
    expect_hit(cast(world, &small, aside, 1, 0, 0, 20), round, 10 - sqrt(1.5 * 1.5 - 0.81), -sqrt(1 - 0.36), 0.6, 0);
    expect_nothing(cast(world, &small, off, 1, 0, 0, INFINITY));
    const sadmm_ray_hit grazed = cast(world, &small, on, 1, 0, 0, INFINITY);
    ck_assert(same_shape(grazed.shape, round));
    ck_assert_double_eq_tol(grazed.distance, 10 - sqrt(1.5 * 1.5 - on[1] * on[1]), 1e-5);
    expect_hit(cast(world, &box, at, 1, 0, 0, INFINITY), round, 8, -1, 0, 0);
    expect_hit(cast(world, &small, at, 0, 0, -1, INFINITY), low, 2.5, 0, 0, 1);
    expect_hit(cast(world, &pill, at, 0, 0, -1, INFINITY), low, 1.5, 0, 0, 1);
    expect_hit(cast(world, &can, at, 0, 0, -1, INFINITY), low, 2, 0, 0, 1);
    expect_hit(cast(world, &cone, at, 0, 0, -1, INFINITY), low, 2, 0, 0, 1);
    expect_hit(cast(world, &egg, at, 0, 0, -1, INFINITY), low, 2, 0, 0, 1);
    expect_hit(cast(world, &egg, at, 3, 0, -4, INFINITY), low, 2 / 0.8, 0, 0, 1);
    expect_nothing(cast(world, &egg, at, 0, 0, 1, INFINITY));
    sadmm_world_destroy(world);
}
END_TEST

/* What it touches or overlaps where it begins. */
START_TEST(from_a_touch)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id floor_body = add_body(world, SADMM_BODY_STATIC, 0, 0, -1),
                        wall_body = add_body(world, SADMM_BODY_STATIC, 5, 0, 0);
    const sadmm_shape_def floor_box = shape_of(SADMM_SHAPE_BOX, 10, 10, 1), wall = shape_of(SADMM_SHAPE_BOX, 1, 10, 8),
                          box = shape_of(SADMM_SHAPE_BOX, 0.5, 0.5, 0.5),
                          ball = shape_of(SADMM_SHAPE_SPHERE, 0.5, 0, 0);
    const sadmm_shape_id low = add_shape(world, floor_body, &floor_box), high = add_shape(world, wall_body, &wall);
    const double on[3] = {0, 0, 0.5}, sunk[3] = {0, 0, 0.4}, direction[3] = {1, 0, 0};
    const sadmm_shape_def *both[] = {&box, &ball};
    for (int k = 0; k < 2; ++k) {
        const sadmm_shape_def *def = both[k];
        expect_hit(cast(world, def, on, 1, 0, 0, 10), high, 3.5, -1, 0, 0);
        expect_hit(cast(world, def, on, 1, 0, 1, 10), high, 3.5 * sqrt(2), -1, 0, 0);
        expect_hit(cast(world, def, on, 0, 0, -1, 10), low, 0, 0, 0, 1);
        expect_nothing(cast(world, def, on, 0, 0, 1, 10));
        const sadmm_ray_hit in = cast(world, def, sunk, 1, 0, 0, 10);
        ck_assert(same_shape(in.shape, low) && in.inside && in.distance == 0);
        ck_assert_double_eq_tol(in.normal[2], 1, 1e-9);
        sadmm_query_filter filter = sadmm_query_filter_default();
        sadmm_ray_hit out;
        filter.from_inside = false;
        MUST(world, sadmm_world_cast_shape(world, def, sunk, as_it_is, direction, 10, &filter, &out));
        expect_hit(out, high, 3.5, -1, 0, 0);
        filter.ignored = wall_body;
        MUST(world, sadmm_world_cast_shape(world, def, sunk, as_it_is, direction, 10, &filter, &out));
        expect_nothing(out);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A floor of triangles has no edges inside of it, whichever way it is turned; it is met from its front. */
START_TEST(on_meshes)
{
    double heights[21 * 21] = {0};
    sadmm_heightfield_def field = sadmm_heightfield_def_default();
    sadmm_mesh *mesh;
    field.heights = heights;
    field.rows = field.columns = 21;
    field.spacing[0] = field.spacing[1] = 0.5;
    ck_assert_int_eq(sadmm_heightfield_create(&field, &mesh), SADMM_OK);
    struct random r = {7};
    for (int n = 0; n < 40; ++n) {
        sadmm_world *world = empty_world();
        const sadmm_body_id body = add_body(world, SADMM_BODY_STATIC, 0, 0, 0);
        sadmm_shape_def ground = shape_of(SADMM_SHAPE_MESH, 0, 0, 0);
        const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 0.3, 0, 0);
        double q[4], length = 0;
        for (int k = 0; k < 4; ++k) q[k] = n == 0 ? k == 0 : random_in(&r, -1, 1), length += q[k] * q[k];
        for (int k = 0; k < 4; ++k) ground.orientation[k] = q[k] / sqrt(length);
        ground.mesh = mesh;
        const sadmm_shape_id id = add_shape(world, body, &ground);
        const mat3 R = q_matrix(q_load(ground.orientation));
        double from[3], along[3], down[3], up[3];
        v3_store(m3_mul(R, v3(-2, 0.1, 0.3)), from);
        v3_store(m3_mul(R, v3(1, 0.3, 0)), along);
        v3_store(m3_mul(R, v3(0.6, 0, -0.8)), down);
        v3_store(m3_mul(R, v3(0, 0, 1)), up);
        expect_nothing(cast(world, &ball, from, along[0], along[1], along[2], 3));
        v3_store(m3_mul(R, v3(-2, 0.1, 2.3)), from);
        sadmm_ray_hit hit = cast(world, &ball, from, down[0], down[1], down[2], INFINITY);
        expect_hit(hit, id, 2.5, up[0], up[1], up[2]);
        ck_assert_int_ge(hit.triangle, 0);
        const double below[3] = {-from[0], -from[1], -from[2]};
        expect_nothing(cast(world, &ball, below, -down[0], -down[1], -down[2], INFINITY));
        sadmm_query_filter filter = sadmm_query_filter_default();
        const double back[3] = {-down[0], -down[1], -down[2]};
        filter.from_behind = true;
        MUST(world, sadmm_world_cast_shape(world, &ball, below, as_it_is, back, INFINITY, &filter, &hit));
        expect_hit(hit, id, 2.5, -up[0], -up[1], -up[2]);
        sadmm_world_destroy(world);
    }
    sadmm_mesh_destroy(mesh);
}
END_TEST

/* ---- at random --------------------------------------------------------------------------------------------------- */

struct question {
    sadmm_shape_def def;
    double position[3], orientation[4], direction[3], length;
    sadmm_query_filter filter;
};

static struct question ask(struct crowd *c, int n, double smallest, double largest)
{
    static const sadmm_shape_type types[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,
                                             SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
    struct question q = {.filter = sadmm_query_filter_default()};
    double turn2 = 0, way2 = 0;
    q.def = shape_of(types[n % 6], random_in(&c->r, smallest, largest), random_in(&c->r, smallest, largest),
                     random_in(&c->r, smallest, largest));
    for (int k = 0; k < 4; ++k) {
        q.orientation[k] = random_in(&c->r, -1, 1);
        turn2 += q.orientation[k] * q.orientation[k];
    }
    for (int k = 0; k < 4; ++k) q.orientation[k] /= sqrt(turn2);
    for (int k = 0; k < 3; ++k) {
        q.position[k] = random_in(&c->r, -9, 9);
        q.direction[k] = n % 11 == 3 && k != n % 3 ? 0 : random_in(&c->r, -1, 1);
        way2 += q.direction[k] * q.direction[k];
    }
    for (int k = 0; k < 3; ++k) q.direction[k] /= sqrt(way2);
    q.length = n % 4 ? random_in(&c->r, 0, 20) : INFINITY;
    q.filter.from_inside = n % 3 == 0;
    q.filter.from_behind = true; /* so that whatever it overlaps on its way is hit */
    return q;
}

static sadmm_ray_hit answer(sadmm_world *world, const struct question *q)
{
    sadmm_ray_hit hit;
    MUST(world, sadmm_world_cast_shape(world, &q->def, q->position, q->orientation, q->direction, q->length, &q->filter,
                                       &hit));
    return hit;
}

static double apart(sadmm_world *world, const struct question *q, double way, sadmm_shape_id other)
{
    double x[3];
    sadmm_closest_points c;
    for (int k = 0; k < 3; ++k) x[k] = q->position[k] + way * q->direction[k];
    MUST(world, sadmm_world_closest_to_shape(world, &q->def, x, q->orientation, other, &c));
    return c.distance;
}

/* It touches what it hits, there and no sooner, and overlaps nothing else on its way. */
START_TEST(on_their_way)
{
    enum { MOST = 400, SAMPLES = 24 };
    struct crowd c = make_crowd(100, 5 + (uint64_t)_i);
    int hits = 0;
    for (int n = 0; n < (getenv("SADMM_TEST_SHORT") ? 20 : 120); ++n) {
        const struct question q = ask(&c, n, 0.1, 1);
        const sadmm_ray_hit hit = answer(c.world, &q);
        const bool found = hit.shape.slot != 0;
        bool began[MOST] = {false};
        if (hit.inside) {
            ck_assert(q.filter.from_inside && apart(c.world, &q, 0, hit.shape) < 0);
            continue;
        }
        hits += found;
        /* a little before it, since what is in a triangle from behind is as deep as the way to its front */
        if (found) ck_assert_double_lt(fabs(apart(c.world, &q, fmax(hit.distance - 1e-7, 0), hit.shape)), 1.1e-7);
        const double end = found ? hit.distance : fmin(q.length, 30);
        for (uint32_t slot = 0; slot < c.world->shape_ids.slots; ++slot) {
            const sadmm_shape_id id = {slot + 1, c.world->shape_ids.generations[slot]};
            ck_assert_uint_lt(slot, MOST);
            began[slot] = apart(c.world, &q, 0, id) <= 0;
            for (int k = 0; k < SAMPLES && !began[slot]; ++k) {
                const double way = end * random_in(&c.r, 0, 1), distance = apart(c.world, &q, way, id);
                ck_assert_msg(distance > -1e-9 * (1 + way), "%d: shape %u is overlapped by %g m after %g of %g m", n,
                              slot, -distance, way, end);
            }
        }
    }
    ck_assert_int_gt(hits, 5);
    free_crowd(&c);
}
END_TEST

/* A ball of a micrometre is a ray. */
START_TEST(as_rays)
{
    struct crowd c = make_crowd(100, 50);
    int same = 0;
    for (int n = 0; n < 600; ++n) {
        struct question q = ask(&c, 0, 1e-6, 1e-6);
        sadmm_ray ray = {.length = q.length};
        sadmm_ray_hit by_ray, hit;
        memcpy(ray.origin, q.position, sizeof ray.origin);
        memcpy(ray.direction, q.direction, sizeof ray.direction);
        q.filter.from_behind = n % 2;
        q.filter.from_inside = n % 4 > 1;
        MUST(c.world, sadmm_world_cast_ray(c.world, &ray, &q.filter, &by_ray));
        hit = answer(c.world, &q);
        const double falls = -(by_ray.normal[0] * ray.direction[0] + by_ray.normal[1] * ray.direction[1] +
                               by_ray.normal[2] * ray.direction[2]);
        if (by_ray.shape.slot == 0 || falls < 0.1) continue;
        ck_assert(same_shape(hit.shape, by_ray.shape) && hit.inside == by_ray.inside);
        ck_assert_double_eq_tol(hit.distance, by_ray.distance, 2e-5);
        ++same;
    }
    ck_assert_int_gt(same, 200);
    free_crowd(&c);
}
END_TEST

START_TEST(bad_casts)
{
    sadmm_world *world = empty_world();
    const sadmm_shape_def ball = shape_of(SADMM_SHAPE_SPHERE, 1, 0, 0), plane = shape_of(SADMM_SHAPE_PLANE, 0, 0, 0);
    const double here[3] = {0, 0, 0}, none[3] = {0, 0, 0}, x[3] = {1, 0, 0}, nan[3] = {0, NAN, 0};
    sadmm_ray_hit hit, before;
    memset(&hit, 0x5a, sizeof hit);
    before = hit;
#define REFUSED(def, from, way, length, text)                                                                    \
    expect_refused(world, sadmm_world_cast_shape(world, def, from, as_it_is, way, length, NULL, &hit),           \
                   SADMM_ERROR_INVALID_ARGUMENT, text)
    REFUSED(&ball, here, none, 1, "direction = (0, 0, 0): must not be 0");
    REFUSED(&ball, here, nan, 1, "direction");
    REFUSED(&ball, nan, x, 1, "position");
    REFUSED(&ball, here, x, -1, "length = -1: must be >= 0 m");
    REFUSED(&ball, here, x, NAN, "length = nan");
    REFUSED(&plane, here, x, 1, "must not be a plane");
    REFUSED(NULL, here, x, 1, "def");
#undef REFUSED
    ck_assert_mem_eq(&hit, &before, sizeof hit); /* nothing is written */
    MUST(world, sadmm_world_cast_shape(world, &ball, here, as_it_is, x, 1, NULL, &hit));
    expect_nothing(hit);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("shape casts");
    TCase *cases = tcase_create("shape casts");
    tcase_set_timeout(cases, 60);
    tcase_add_test(cases, by_formula);
    tcase_add_test(cases, from_a_touch);
    tcase_add_test(cases, on_meshes);
    tcase_add_loop_test(cases, on_their_way, 0, 4);
    tcase_add_test(cases, as_rays);
    tcase_add_test(cases, bad_casts);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
