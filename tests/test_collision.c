/* The collision pipeline: what it promises about pairs, points, filters, warm start, failures and repeatability.
 * One file: all of its tests put together the same small scene (make_scene, add_body, add_shape) and find contacts in
 * it. */
#include <check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "collision/collision.h"
#include "collision/find/variants.h"
#include "collision/find/pipeline.h"
#include "config.h"
#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "fewer.h"
#include "manifold_tools.h"

enum { MAX_SHAPES = 4000 };

/* Shapes, one a body unless said otherwise, and everything a find needs. */
struct scene {
    struct sadmm_shape shapes[MAX_SHAPES];
    struct sadmm_geometry geometries[MAX_SHAPES]; /* one a shape, unless a test says otherwise */
    struct sadmm_collision_body bodies[MAX_SHAPES];
    struct sadmm_collision_input input;
    struct sadmm_collision *collision;
    struct sadmm_contact_set contacts;
    struct sadmm_error error;
    int32_t shape_count, body_count, dynamic_count;
};

static struct scene *make_scene(const struct sadmm_broad_phase_kind *kind)
{
    struct scene *s = calloc(1, sizeof *s);
    ck_assert_ptr_nonnull(s);
    ck_assert_int_eq(sadmm_collision_create_with(kind ? kind : sadmm_broad_phase_default(), &s->collision, &s->error),
                     SADMM_OK);
    s->input = (struct sadmm_collision_input){
        .shapes = s->shapes,
        .geometries = s->geometries,
        .geometry_count = MAX_SHAPES,
        .bodies = s->bodies,
        .dt = 0.005,
        .margin = 0.02,
        .threads = 1,
    };
    return s;
}

static void free_scene(struct scene *s)
{
    sadmm_contact_set_free(&s->contacts);
    sadmm_collision_destroy(s->collision);
    free(s);
}

static int32_t add_body(struct scene *s, bool moves, double x, double y, double z)
{
    struct sadmm_collision_body *body = &s->bodies[s->body_count];
    body->position[0] = x;
    body->position[1] = y;
    body->position[2] = z;
    body->orientation[0] = 1;
    body->system_body = moves ? s->dynamic_count++ : -1;
    body->environment = moves ? 0 : -1;
    body->inertia = moves ? 1 : 0;
    return s->body_count++;
}

static int32_t add_shape(struct scene *s, int32_t body, sadmm_shape_type type, double s0, double s1, double s2)
{
    struct sadmm_shape *shape = &s->shapes[s->shape_count];
    ck_assert_int_lt(s->shape_count, MAX_SHAPES);
    shape->geometry = (uint32_t)s->shape_count;
    s->geometries[shape->geometry] = geometry_of((int)type, (double[]){s0, s1, s2});
    shape->orientation[0] = 1;
    shape->friction = 0.5;
    shape->category = 1;
    shape->mask = UINT32_MAX;
    shape->body = body;
    shape->alive = true;
    shape->revision = (uint32_t)s->shape_count + 1;
    return s->shape_count++;
}

static int32_t add_box(struct scene *s, double h, double x, double y, double z)
{
    return add_shape(s, add_body(s, true, x, y, z), SADMM_SHAPE_BOX, h, h, h);
}

static int32_t add_ground(struct scene *s)
{
    return add_shape(s, add_body(s, false, 0, 0, 0), SADMM_SHAPE_PLANE, 0, 0, 0);
}

static void turn_body(struct scene *s, int32_t body, double ax, double ay, double az, double angle)
{
    double n = sqrt(ax * ax + ay * ay + az * az), h = sin(angle / 2) / n;
    s->bodies[body].orientation[0] = cos(angle / 2);
    s->bodies[body].orientation[1] = ax * h;
    s->bodies[body].orientation[2] = ay * h;
    s->bodies[body].orientation[3] = az * h;
}

static sadmm_status try_find(struct scene *s)
{
    s->input.shape_count = (size_t)s->shape_count;
    s->input.body_count = (size_t)s->body_count;
    return sadmm_collision_find(s->collision, &s->input, &s->contacts, &s->error);
}

static void find(struct scene *s) { ck_assert_msg(try_find(s) == SADMM_OK, "%s", s->error.message); }

static const struct sadmm_contact_pair *pair_of(const struct scene *s, int32_t a, int32_t b)
{
    for (size_t i = 0; i < s->contacts.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &s->contacts.pairs[i];
        if ((p->shape_a == a && p->shape_b == b) || (p->shape_a == b && p->shape_b == a)) return p;
    }
    return NULL;
}

static void copy_set(struct sadmm_contact_set *to, const struct sadmm_contact_set *from)
{
    memset(to, 0, sizeof *to);
    ck_assert(SADMM_GROW(to->pairs, 0, from->pair_count + 1));
    ck_assert(SADMM_GROW(to->points, 0, from->point_count + 1));
    if (from->pair_count) memcpy(to->pairs, from->pairs, from->pair_count * sizeof *to->pairs);
    if (from->point_count) memcpy(to->points, from->points, from->point_count * sizeof *to->points);
    to->pair_count = from->pair_count;
    to->point_count = from->point_count;
    ck_assert(SADMM_GROW(to->migrations, 0, from->point_count + 1));
    for (size_t k = 0; k < from->point_count; ++k)
        if (from->points[k].migrates) to->migrations[k] = from->migrations[k];
    to->migrating = from->migrating;
    to->dt = from->dt;
}

/* Bit for bit. */
static void expect_equal_sets(const struct sadmm_contact_set *a, const struct sadmm_contact_set *b)
{
    ck_assert_uint_eq(a->pair_count, b->pair_count);
    ck_assert_uint_eq(a->point_count, b->point_count);
    ck_assert(a->pair_count == 0 || memcmp(a->pairs, b->pairs, a->pair_count * sizeof *a->pairs) == 0);
    ck_assert(a->point_count == 0 || memcmp(a->points, b->points, a->point_count * sizeof *a->points) == 0);
}

/* A pile of all kinds of shapes on a plane, some bodies static, some of two shapes. */
static void fill_pile(struct scene *s, int bodies, uint64_t seed, int environments)
{
    struct random r = {seed};
    double side = 0.085 * cbrt(bodies / environments + 1.0);
    add_ground(s);
    for (int i = 0; i < bodies; ++i) {
        int32_t body =
            add_body(s, i % 11 != 0, random_in(&r, 0, side), random_in(&r, 0, side), random_in(&r, 0.03, side));
        double a = random_in(&r, 0.02, 0.06), b = random_in(&r, 0.02, 0.06), c = random_in(&r, 0.0005, 0.06);
        if (s->bodies[body].system_body >= 0) s->bodies[body].environment = i % environments;
        turn_body(s, body, random_in(&r, -1, 1), random_in(&r, -1, 1), 1, random_in(&r, -3, 3));
        add_shape(s, body, (sadmm_shape_type)(1 + i % 3), a, b, c);
        if (i % 5 == 0) s->shapes[add_shape(s, body, SADMM_SHAPE_SPHERE, a, 0, 0)].position[0] = 0.08;
        for (int k = 0; k < 6; ++k)
            if (s->bodies[body].system_body >= 0) s->bodies[body].velocity[k] = random_in(&r, -0.2, 0.2);
    }
}

static void stir(struct scene *s, struct random *r, double stride)
{
    for (int32_t i = 0; i < s->body_count; ++i)
        for (int k = 0; k < 3; ++k)
            if (s->bodies[i].system_body >= 0) s->bodies[i].position[k] += random_in(r, -stride, stride);
}

/* Impulses as a solver would leave them: a push along the normal and some friction. */
static void put_impulses(struct scene *s)
{
    for (size_t i = 0; i < s->contacts.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &s->contacts.pairs[i];
        for (int32_t j = 0; j < p->count; ++j)
            for (int k = 0; k < 3; ++k)
                s->contacts.points[p->first + j].impulse[k] = (1 + j) * p->normal[k] + 0.01 * (k + 1) * (double)(i % 7);
    }
}

/* ---- what a contact is ------------------------------------------------------------------------------------------- */

START_TEST(a_box_on_the_ground)
{
    struct scene *s = make_scene(NULL);
    int32_t ground = add_ground(s), box = add_box(s, 0.05, 1, 2, 0.0495);
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count, 1);
    ck_assert_uint_eq(s->contacts.point_count, 4);
    const struct sadmm_contact_pair *p = &s->contacts.pairs[0];
    ck_assert_int_eq(p->shape_a, ground);
    ck_assert_int_eq(p->shape_b, box);
    ck_assert_int_eq(p->body_a, -1);
    ck_assert_int_eq(p->body_b, 0);
    ck_assert_int_eq(p->first, 0);
    ck_assert_int_eq(p->count, 4);
    ck_assert_double_eq_tol(p->normal[2], 1, 1e-15);
    for (int i = 0; i < 4; ++i) {
        const struct sadmm_contact_point *c = &s->contacts.points[i];
        ck_assert_double_eq_tol(c->separation, -0.0005, 1e-15);
        ck_assert_double_eq(dot3(c->arm_a, c->arm_a), 0); /* the static side has no arm */
        ck_assert_double_eq_tol(fabs(c->arm_b[0]), 0.05, 1e-15);
        ck_assert_double_eq_tol(fabs(c->arm_b[1]), 0.05, 1e-15);
        ck_assert_double_eq_tol(c->arm_b[2], -0.04975, 1e-15); /* halfway: a quarter of a millimetre above the corner */
        ck_assert_double_eq(dot3(c->impulse, c->impulse), 0);
    }
    free_scene(s);
}
END_TEST

/* The shape sits off its body's centre of mass and turned: arms start at the centre of mass all the same, and both arms
 * of a point name one place in the world. */
START_TEST(arms_start_at_the_centre_of_mass)
{
    struct scene *s = make_scene(NULL);
    struct random r = {12};
    for (int i = 0; i < 40; ++i) {
        int32_t body = add_body(s, true, random_in(&r, 0, 0.3), random_in(&r, 0, 0.3), random_in(&r, 0, 0.3));
        int32_t shape = add_shape(s, body, (sadmm_shape_type)(1 + i % 3), 0.05, 0.04, 0.03);
        turn_body(s, body, 1, random_in(&r, -1, 1), random_in(&r, -1, 1), random_in(&r, -3, 3));
        for (int k = 0; k < 3; ++k) s->shapes[shape].position[k] = random_in(&r, -0.1, 0.1);
        s->shapes[shape].orientation[0] = cos(1.0 * i);
        s->shapes[shape].orientation[2] = sin(1.0 * i);
    }
    find(s);
    ck_assert_uint_gt(s->contacts.pair_count, 30);
    for (size_t i = 0; i < s->contacts.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &s->contacts.pairs[i];
        struct solid solids[2];
        for (int side = 0; side < 2; ++side) {
            const struct sadmm_proxy *proxy = &s->collision->candidates.proxies[side ? p->shape_b : p->shape_a];
            solids[side].type = proxy->geometry.type;
            memcpy(solids[side].size, proxy->geometry.size, sizeof proxy->geometry.size);
            memcpy(solids[side].R, proxy->R, sizeof proxy->R);
            memcpy(solids[side].x, proxy->x, sizeof proxy->x);
        }
        for (int32_t j = p->first; j < p->first + p->count; ++j) {
            const struct sadmm_contact_point *c = &s->contacts.points[j];
            double place[3];
            for (int k = 0; k < 3; ++k) {
                place[k] = s->bodies[p->body_a].position[k] + c->arm_a[k];
                ck_assert_double_eq_tol(place[k], s->bodies[p->body_b].position[k] + c->arm_b[k], 1e-12);
            }
            /* halfway between the surfaces: from neither farther than the overlap (2 % of the size: line contacts) */
            ck_assert_double_le(outside(&solids[0], place), fabs(c->separation) + 0.002);
            ck_assert_double_le(outside(&solids[1], place), fabs(c->separation) + 0.002);
        }
        /* b moved along the normal gets away from a */
        ck_assert_double_gt(separation_along(&solids[0], &solids[1], p->normal), -0.2);
        double back[3] = {-p->normal[0], -p->normal[1], -p->normal[2]};
        ck_assert_double_ge(separation_along(&solids[0], &solids[1], p->normal) + 0.01,
                            separation_along(&solids[0], &solids[1], back));
    }
    free_scene(s);
}
END_TEST

START_TEST(pairs_come_sorted_by_type_and_slot)
{
    struct scene *s = make_scene(NULL);
    fill_pile(s, 400, 5, 1);
    find(s);
    ck_assert_uint_gt(s->contacts.pair_count, 500);
    int32_t next = 0;
    for (size_t i = 0; i < s->contacts.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &s->contacts.pairs[i];
        const struct sadmm_shape *a = &s->shapes[p->shape_a], *b = &s->shapes[p->shape_b];
        const int type_a = s->geometries[a->geometry].type, type_b = s->geometries[b->geometry].type;
        ck_assert(type_a < type_b || (type_a == type_b && p->shape_a < p->shape_b));
        ck_assert_int_eq(p->first, next);
        ck_assert_int_ge(p->count, 1);
        ck_assert_int_le(p->count, SADMM_MAX_POINTS);
        next += p->count;
        ck_assert(p->body_a >= 0 || p->body_b >= 0);
        ck_assert_int_eq(p->body_a, s->bodies[a->body].system_body);
        ck_assert_int_eq(p->body_b, s->bodies[b->body].system_body);
        if (i == 0) continue;
        const struct sadmm_contact_pair *q = p - 1;
        ck_assert(q->shape_a < p->shape_a || (q->shape_a == p->shape_a && q->shape_b < p->shape_b));
        ck_assert_uint_eq(p->subshape, 0); /* a type of one piece */
    }
    ck_assert_uint_eq((size_t)next, s->contacts.point_count);
    free_scene(s);
}
END_TEST

START_TEST(friction_and_restitution_of_a_pair)
{
    struct scene *s = make_scene(NULL);
    int32_t ground = add_ground(s), low = add_box(s, 0.05, 0, 0, 0.05), high = add_box(s, 0.05, 0, 0, 0.15);
    const uint64_t key = (uint64_t)low << 32 | (uint32_t)high;
    const double value = 0.123;
    s->shapes[ground].friction = 0.9;
    s->shapes[low].friction = 0.4;
    s->shapes[high].friction = 0.1;
    s->shapes[low].restitution = 0.3;
    s->shapes[high].restitution = 0.7;
    find(s);
    ck_assert_double_eq_tol(pair_of(s, ground, low)->friction, sqrt(0.9 * 0.4), 1e-15);
    ck_assert_double_eq_tol(pair_of(s, low, high)->friction, sqrt(0.4 * 0.1), 1e-15);
    ck_assert_double_eq(pair_of(s, ground, low)->restitution, 0.3);
    ck_assert_double_eq(pair_of(s, low, high)->restitution, 0.7);
    s->input.friction_pairs = &key;
    s->input.friction_values = &value;
    s->input.friction_pair_count = 1;
    find(s);
    ck_assert_double_eq_tol(pair_of(s, ground, low)->friction, sqrt(0.9 * 0.4), 1e-15);
    ck_assert_double_eq(pair_of(s, low, high)->friction, value);
    free_scene(s);
}
END_TEST

/* ---- geometries and their subshapes ------------------------------------------------------------------------------ */

/* A shape is what its handle says: the same contacts, bit for bit, whether equal boxes have a geometry each or share
 * one. */
START_TEST(shapes_may_share_a_geometry)
{
    struct scene *s = make_scene(NULL), *t = make_scene(NULL);
    struct random r = {3}, r2 = {3};
    for (int which = 0; which < 2; ++which) {
        struct scene *scene = which ? t : s;
        add_ground(scene);
        for (int i = 0; i < 27; ++i) add_box(scene, 0.05, 0.09 * (i % 3), 0.09 * (i / 3 % 3), 0.05 + 0.09 * (i / 9));
    }
    /* the one of all boxes is the last of the array; the others mean nothing */
    for (int32_t i = 1; i < t->shape_count; ++i) t->shapes[i].geometry = MAX_SHAPES - 1;
    t->geometries[MAX_SHAPES - 1] = t->geometries[1];
    for (int32_t i = 1; i < t->shape_count; ++i)
        t->geometries[i] = geometry_of(SADMM_SHAPE_SPHERE, (double[]){1, 1, 1});
    for (int step = 0; step < 3; ++step) {
        find(s);
        find(t);
        ck_assert_uint_gt(s->contacts.point_count, 200);
        expect_equal_sets(&s->contacts, &t->contacts);
        put_impulses(s);
        put_impulses(t);
        stir(s, &r, 1e-3);
        stir(t, &r2, 1e-3);
    }
    free_scene(s);
    free_scene(t);
}
END_TEST

/* Two shapes of two and three pieces have six manifolds: pairs of their own, in order, each as of the whole. */
START_TEST(a_pair_has_a_manifold_for_each_subshape)
{
    struct scene *s = make_scene(NULL), *t = make_scene(NULL);
    for (int which = 0; which < 2; ++which) {
        struct scene *scene = which ? t : s;
        add_ground(scene);
        for (int i = 0; i < 2; ++i) add_box(scene, 0.05, 0.01 * i, 0, 0.05 + 0.0999 * i);
    }
    t->geometries[1].subshapes = 2;
    t->geometries[2].subshapes = 3;
    find(s);
    find(t);
    ck_assert_uint_eq(s->contacts.pair_count, 2);
    ck_assert_uint_eq(t->contacts.pair_count, 2 + 6); /* on the ground, and on each other */
    for (size_t i = 0; i < t->contacts.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &t->contacts.pairs[i], *whole = pair_of(s, p->shape_a, p->shape_b);
        ck_assert_uint_eq(p->subshape, i < 2 ? i : i - 2);
        ck_assert_int_eq(p->shape_b, i < 2 ? 1 : 2);
        ck_assert_int_eq(p->first, i == 0 ? 0 : t->contacts.pairs[i - 1].first + t->contacts.pairs[i - 1].count);
        ck_assert_int_eq(p->count, whole->count);
        ck_assert_mem_eq(&t->contacts.points[p->first], &s->contacts.points[whole->first],
                         (size_t)p->count * sizeof *t->contacts.points);
    }
    free_scene(s);
    free_scene(t);
}
END_TEST

/* Impulses belong to (shape, shape, subshape). Of the four subshapes of a pair the last step had three;
 * each goes on with what was its own, and the one that was not there starts without. */
START_TEST(what_is_kept_is_kept_by_subshape)
{
    struct scene *s = make_scene(NULL);
    struct sadmm_contact_set *set = &s->contacts;
    int32_t low = add_shape(s, add_body(s, true, 0, 0, 0), SADMM_SHAPE_BOX, 0.05, 0.05, 0.05);
    int32_t high = add_shape(s, add_body(s, true, 0, 0, 0.0999), SADMM_SHAPE_BOX, 0.05, 0.05, 0.05);
    add_box(s, 0.05, 0.5, 0, 0); /* pairs before and after */
    add_box(s, 0.05, 0.5, 0, 0.0999);
    s->geometries[low].subshapes = s->geometries[high].subshapes = 2;
    find(s);
    ck_assert_uint_eq(set->pair_count, 4 + 1);
    for (size_t i = 0; i < set->pair_count; ++i)
        for (int32_t j = 0; j < set->pairs[i].count; ++j)
            for (int k = 0; k < 3; ++k)
                set->points[set->pairs[i].first + j].impulse[k] = (double)(1 + i) * set->pairs[i].normal[k];
    /* without subshape 1 */
    memmove(&set->pairs[1], &set->pairs[2], 3 * sizeof *set->pairs);
    --set->pair_count;
    find(s);
    ck_assert_uint_eq(set->pair_count, 4 + 1);
    for (size_t i = 0; i < set->pair_count; ++i) {
        const struct sadmm_contact_pair *p = &set->pairs[i];
        ck_assert_uint_eq(p->subshape, i < 4 ? i : 0);
        for (int32_t j = 0; j < p->count; ++j)
            for (int k = 0; k < 3; ++k) /* the normal is unit to rounding */
                ck_assert_double_eq_tol(set->points[p->first + j].impulse[k],
                                        i == 1 ? 0 : (double)(1 + i) * p->normal[k], 1e-13);
    }
    free_scene(s);
}
END_TEST

/* A cube has gone so far into another that two faces are equally near: each subshape stays with the face that it
 * had. */
START_TEST(the_axis_is_kept_by_subshape)
{
    struct scene *s = make_scene(NULL);
    int32_t a = add_box(s, 0.05, 0, 0, 0);
    add_box(s, 0.05, 0.09, 0, 0.09);
    s->geometries[a].subshapes = 2;
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count, 2);
    uint32_t x, z;
    s->contacts.pair_count = s->contacts.point_count = 0;
    s->bodies[1].position[0] = 0.095;
    find(s);
    x = s->contacts.pairs[0].cache; /* overlaps by 5 mm along x and by 10 mm along z */
    s->contacts.pair_count = s->contacts.point_count = 0;
    s->bodies[1].position[0] = 0.09;
    s->bodies[1].position[2] = 0.095;
    find(s);
    z = s->contacts.pairs[0].cache;
    ck_assert_uint_ne(x, z);
    s->bodies[1].position[2] = 0.09;
    s->contacts.pairs[0].cache = x;
    s->contacts.pairs[1].cache = z;
    find(s);
    ck_assert_uint_eq(s->contacts.pairs[0].cache, x);
    ck_assert_uint_eq(s->contacts.pairs[1].cache, z);
    ck_assert_double_gt(fabs(s->contacts.pairs[0].normal[0]), 0.9);
    ck_assert_double_gt(fabs(s->contacts.pairs[1].normal[2]), 0.9);
    free_scene(s);
}
END_TEST

static void expect_refused(struct scene *s, const char *word)
{
    const struct sadmm_contact_pair *before = s->contacts.pairs;
    const size_t count = s->contacts.pair_count;
    for (int time = 0; time < 2; ++time) { /* and again, as long as it is there */
        ck_assert_int_eq(try_find(s), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_msg(strstr(s->error.message, word) != NULL, "%s: does not say %s", s->error.message, word);
    }
    ck_assert_ptr_eq(s->contacts.pairs, before);
    ck_assert_uint_eq(s->contacts.pair_count, count);
}

/* A shape that collision knows nothing of is an error, wherever it is, and no capsule. */
START_TEST(shapes_without_manifolds_are_refused)
{
    struct scene *s = make_scene(NULL);
    add_ground(s);
    int32_t box = add_box(s, 0.05, 0, 0, 0.05), far = add_box(s, 0.05, 1000, 0, 1000);
    const struct sadmm_geometry good = s->geometries[box];
    s->input.threads = 1 + 2 * _i;
    sadmm_test_force_threads(_i);
    find(s);
    for (int which = 0; which < 2; ++which) {
        const int32_t shape = which ? far : box;
        struct sadmm_geometry *geometry = &s->geometries[shape];
        for (int type = -1; type <= SADMM_SHAPE_TYPE_COUNT; type += SADMM_SHAPE_TYPE_COUNT + 1) {
            ++s->shapes[shape].revision;
            geometry->type = type;
            expect_refused(s, which ? "shapes[2]: type" : "shapes[1]: type");
        }
        geometry->type = SADMM_SHAPE_PLANE; /* on a body that moves, where it might meet another plane */
        expect_refused(s, "only static bodies");
        *geometry = good;
        geometry->subshapes = 0;
        expect_refused(s, "subshapes = 0");
        geometry->subshapes = SADMM_MOST_SUBSHAPES + 1;
        expect_refused(s, "subshapes = 65536");
        *geometry = good;
        geometry->type = SADMM_SHAPE_HULL; /* without shape data */
        expect_refused(s, "hull = 0");
        *geometry = good;
        s->shapes[shape].geometry = MAX_SHAPES;
        expect_refused(s, "geometry = 4000");
        s->shapes[shape].geometry = (uint32_t)shape;
        find(s);
        ck_assert_uint_eq(s->contacts.point_count, 4);
    }
    sadmm_test_force_threads(false);
    free_scene(s);
}
END_TEST

/* ---- who meets whom ---------------------------------------------------------------------------------------------- */

START_TEST(filters)
{
    struct scene *s = make_scene(NULL);
    /* all at one place: without filters everything meets */
    int32_t a = add_box(s, 0.05, 0, 0, 0), b = add_box(s, 0.05, 0.01, 0, 0), c = add_box(s, 0.05, 0, 0.01, 0);
    int32_t still = add_shape(s, add_body(s, false, 0, 0, 0.01), SADMM_SHAPE_BOX, 0.05, 0.05, 0.05);
    int32_t still2 = add_shape(s, add_body(s, false, 0, 0, 0.02), SADMM_SHAPE_SPHERE, 0.05, 0, 0);
    int32_t second = add_shape(s, s->shapes[a].body, SADMM_SHAPE_SPHERE, 0.03, 0, 0);
    /* shapes of other categories do not hide each other's contacts (seam.h) */
    s->shapes[second].category = s->shapes[still2].category = 1 | 4;
    find(s);
    ck_assert_ptr_nonnull(pair_of(s, a, b));
    ck_assert_ptr_nonnull(pair_of(s, second, b));
    ck_assert_ptr_nonnull(pair_of(s, a, still));
    ck_assert_ptr_nonnull(pair_of(s, a, still2));
    ck_assert_ptr_null(pair_of(s, still, still2));            /* both static */
    ck_assert_ptr_null(pair_of(s, a, second));                /* same body */
    ck_assert_uint_eq(s->contacts.pair_count, 3 + 2 + 2 * 4); /* a b c; the second of a; static ones with all four */

    /* pairs of bodies turned off, at once and on again */
    uint64_t off = (uint64_t)s->shapes[a].body << 32 | (uint32_t)s->shapes[b].body;
    s->input.disabled_body_pairs = &off;
    s->input.disabled_body_pair_count = 1;
    find(s);
    ck_assert_ptr_null(pair_of(s, a, b));
    ck_assert_ptr_null(pair_of(s, second, b));
    ck_assert_ptr_nonnull(pair_of(s, a, c));
    s->input.disabled_body_pair_count = 0;
    find(s);
    ck_assert_ptr_nonnull(pair_of(s, a, b));

    /* categories: both sides must agree */
    s->shapes[b].category = 2;
    s->shapes[a].mask = 1;
    s->shapes[a].revision = 100;
    s->shapes[b].revision = 101;
    find(s);
    ck_assert_ptr_null(pair_of(s, a, b));
    ck_assert_ptr_nonnull(pair_of(s, c, b));

    /* environments: static -1 meets all, static 1 meets only those of 1 */
    s->bodies[s->shapes[b].body].environment = 1;
    s->bodies[s->shapes[still2].body].environment = 1;
    find(s);
    ck_assert_ptr_null(pair_of(s, c, b));
    ck_assert_ptr_nonnull(pair_of(s, b, still));
    ck_assert_ptr_nonnull(pair_of(s, b, still2));
    ck_assert_ptr_null(pair_of(s, c, still2));

    /* dead shapes */
    s->shapes[still].alive = false;
    find(s);
    ck_assert_ptr_null(pair_of(s, b, still));
    free_scene(s);
}
END_TEST

/* Many copies at one place, with a plane of their own at a height of their own and one for all. */
START_TEST(environments_share_space_without_meeting)
{
    enum { COPIES = 300 };
    struct scene *s = make_scene(_i ? &sadmm_broad_phase_sweep : NULL);
    int32_t ground = add_ground(s), planes[COPIES], boxes[COPIES][2];
    for (int e = 0; e < COPIES; ++e) {
        planes[e] = add_shape(s, add_body(s, false, 0, 0, e % 2 ? 0.01 : -0.01), SADMM_SHAPE_PLANE, 0, 0, 0);
        s->bodies[s->body_count - 1].environment = e;
        for (int k = 0; k < 2; ++k) {
            boxes[e][k] = add_box(s, 0.05, 0, 0, 0.05 + 0.1 * k);
            s->bodies[s->body_count - 1].environment = e;
        }
    }
    find(s);
    for (int e = 0; e < COPIES; ++e) {
        ck_assert_ptr_nonnull(pair_of(s, ground, boxes[e][0]));
        ck_assert_ptr_nonnull(pair_of(s, boxes[e][0], boxes[e][1]));
        ck_assert_int_eq(pair_of(s, planes[e], boxes[e][0]) != NULL, e % 2);
    }
    ck_assert_uint_eq(s->contacts.pair_count, COPIES * 2 + COPIES / 2);
    free_scene(s);
}
END_TEST

START_TEST(a_plane_that_is_moved_takes_its_contacts_along)
{
    struct scene *s = make_scene(NULL);
    int32_t ground = add_ground(s), box = add_box(s, 0.05, 0, 0, 0.05), far = add_box(s, 0.05, 0, 0, 1);
    find(s);
    ck_assert_ptr_nonnull(pair_of(s, ground, box));
    s->bodies[s->shapes[ground].body].position[2] = 0.95;
    find(s);
    ck_assert_ptr_nonnull(pair_of(s, ground, far));
    ck_assert_double_eq_tol(s->contacts.points[pair_of(s, ground, far)->first].separation, 0, 1e-12);
    s->bodies[s->shapes[ground].body].position[2] = -1;
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count, 0);
    turn_body(s, s->shapes[ground].body, 1, 0, 0, 1.0);
    s->bodies[s->shapes[ground].body].position[2] = 0;
    find(s);
    ck_assert_ptr_nonnull(pair_of(s, ground, box));
    free_scene(s);
}
END_TEST

/* ---- reach ------------------------------------------------------------------------------------------------------- */

/* A ball flies at a card a millimetre thick, ten times as far in a step as it is large. Whatever its start, there is a
 * step in which the contact is known before the ball has passed. */
START_TEST(nothing_fast_is_missed)
{
    const double speed = 40; /* 0.2 m a step */
    for (int i = 0; i < 200; ++i) {
        struct scene *s = make_scene(NULL);
        int32_t card = add_shape(s, add_body(s, false, 0, 0, 0), SADMM_SHAPE_BOX, 0.1, 0.1, 0.0005);
        int32_t ball = add_shape(s, add_body(s, true, 0.02, 0.01, 1 + 0.001 * i), SADMM_SHAPE_SPHERE, 0.01, 0, 0);
        double *x = s->bodies[s->shapes[ball].body].position;
        bool known = false;
        s->bodies[s->shapes[ball].body].velocity[2] = -speed;
        while (x[2] > 0) {
            find(s);
            known = known || pair_of(s, card, ball);
            x[2] -= speed * s->input.dt;
        }
        ck_assert_msg(known, "from %g", 1 + 0.001 * i);
        free_scene(s);
    }
    /* the tip of a spinning rod: centre at rest */
    struct scene *s = make_scene(NULL);
    int32_t rod = add_shape(s, add_body(s, true, 0, 0, 0), SADMM_SHAPE_CAPSULE, 0.01, 1, 0);
    int32_t card = add_shape(s, add_body(s, false, 0.15, 0, 0.9), SADMM_SHAPE_BOX, 0.0005, 0.1, 0.1);
    s->bodies[0].velocity[4] = 50; /* 0.25 rad a step: the tip covers 0.25 m */
    find(s);
    ck_assert_ptr_nonnull(pair_of(s, rod, card));
    s->bodies[0].velocity[4] = 5;
    find(s);
    ck_assert_ptr_null(pair_of(s, rod, card));
    free_scene(s);
}
END_TEST

START_TEST(rest_gets_no_useless_contacts)
{
    struct scene *s = make_scene(NULL);
    /* a grid of cubes with separations just above the margin (2 mm): nothing but the ground */
    add_ground(s);
    for (int x = 0; x < 5; ++x)
        for (int y = 0; y < 5; ++y)
            for (int z = 0; z < 2; ++z) add_box(s, 0.05, 0.1021 * x, 0.1021 * y, 0.05 + 0.1021 * z);
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count, 25);
    ck_assert_uint_eq(s->contacts.point_count, 100);
    /* all falling together at 10 m/s: relative velocities are what counts, but for the ground */
    for (int i = 0; i < s->body_count; ++i)
        if (s->bodies[i].system_body >= 0) s->bodies[i].velocity[2] = -10;
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count, 25);
    free_scene(s);
}
END_TEST

/* At rest just outside the margin of a thin card: gravity closes g dt^2 = 0.25 mm in the first step, ten times the
 * margin. */
START_TEST(a_fall_from_rest_is_foreseen)
{
    struct scene *s = make_scene(NULL);
    add_ground(s);
    add_shape(s, add_body(s, true, 0, 0, 0.0005 + 0.0001), SADMM_SHAPE_BOX, 0.05, 0.03, 0.0005);
    find(s);
    ck_assert_uint_eq(s->contacts.point_count, 0);
    s->input.gravity = 9.81;
    find(s);
    ck_assert_uint_eq(s->contacts.point_count, 4);
    free_scene(s);
}
END_TEST

START_TEST(separations_are_exact_far_from_the_origin)
{
    for (int i = 0; i < 2; ++i) {
        const double far = 1048576; /* 2^20: coordinates keep 2^-32 m */
        struct scene *s = make_scene(NULL);
        if (i == 0) add_ground(s);
        else add_shape(s, add_body(s, false, far, -far, -0.5), SADMM_SHAPE_BOX, 1, 1, 0.5);
        int32_t box = add_box(s, 0.0625, far, -far, 0.0625 - 0x1p-12);
        find(s);
        ck_assert_uint_eq(s->contacts.point_count, 4);
        ck_assert_ptr_nonnull(pair_of(s, 0, box));
        for (int k = 0; k < 4; ++k) ck_assert_double_eq_tol(s->contacts.points[k].separation, -0x1p-12, 1e-15);
        free_scene(s);
    }
}
END_TEST

/* ---- from step to step ------------------------------------------------------------------------------------------- */

START_TEST(impulses_carry_over_by_feature)
{
    struct scene *s = make_scene(NULL);
    struct random r = {8};
    int32_t ground = add_ground(s), low = add_box(s, 0.05, 0, 0, 0.05), high = add_box(s, 0.05, 0.02, 0.01, 0.15);
    turn_body(s, s->shapes[high].body, 0, 0, 1, 0.3);
    find(s);
    ck_assert_uint_gt(s->contacts.point_count, 8);
    for (int step = 0; step < 50; ++step) {
        struct sadmm_contact_set before;
        put_impulses(s);
        copy_set(&before, &s->contacts);
        stir(s, &r, 1e-6);
        find(s);
        ck_assert_uint_eq(s->contacts.point_count, before.point_count);
        for (size_t i = 0; i < s->contacts.pair_count; ++i) {
            const struct sadmm_contact_pair *p = &s->contacts.pairs[i], *q = &before.pairs[i];
            for (int32_t j = 0; j < p->count; ++j) {
                const struct sadmm_contact_point *c = &s->contacts.points[p->first + j], *old = NULL;
                for (int32_t l = 0; l < q->count; ++l)
                    if (before.points[q->first + l].feature == c->feature) old = &before.points[q->first + l];
                ck_assert_ptr_nonnull(old);
                /* the normal turns by up to 1 um over 0.1 m */
                for (int k = 0; k < 3; ++k) ck_assert_double_eq_tol(c->impulse[k], old->impulse[k], 1e-4);
            }
        }
        sadmm_contact_set_free(&before);
    }
    /* apart for a step: nothing is left */
    s->bodies[s->shapes[high].body].position[2] += 1;
    find(s);
    ck_assert_ptr_null(pair_of(s, low, high));
    ck_assert_double_gt(s->contacts.points[pair_of(s, ground, low)->first].impulse[2], 0.5);
    s->bodies[s->shapes[high].body].position[2] -= 1;
    find(s);
    for (int32_t j = 0; j < pair_of(s, low, high)->count; ++j) {
        const double *impulse = s->contacts.points[pair_of(s, low, high)->first + j].impulse;
        ck_assert_double_eq(dot3(impulse, impulse), 0);
    }
    free_scene(s);
}
END_TEST

/* The normal turns by a finite angle: the push follows the normal, friction stays tangential and within its disc. */
START_TEST(impulses_follow_the_normal)
{
    struct scene *s = make_scene(NULL);
    int32_t ball = add_shape(s, add_body(s, true, 0, 0, 0), SADMM_SHAPE_SPHERE, 0.05, 0, 0);
    int32_t other = add_shape(s, add_body(s, true, 0.0999, 0, 0), SADMM_SHAPE_SPHERE, 0.05, 0, 0);
    find(s);
    struct sadmm_contact_point *c = &s->contacts.points[0];
    c->impulse[0] = 2;
    c->impulse[1] = 0.8;
    c->impulse[2] = -0.9; /* friction beyond its disc of 0.5 x 2 */
    s->bodies[s->shapes[other].body].position[0] = 0.0999 * cos(0.7);
    s->bodies[s->shapes[other].body].position[1] = 0.0999 * sin(0.7);
    find(s);
    const struct sadmm_contact_pair *p = pair_of(s, ball, other);
    double push, slide[3];
    c = &s->contacts.points[0];
    push = dot3(c->impulse, p->normal);
    ck_assert_double_eq_tol(push, 2, 1e-12);
    for (int k = 0; k < 3; ++k) slide[k] = c->impulse[k] - push * p->normal[k];
    ck_assert_double_le(sqrt(dot3(slide, slide)), 0.5 * push + 1e-12);
    ck_assert_double_gt(dot3(slide, slide), 0.1);
    ck_assert_double_lt(slide[2], 0);
    /* turned past a right angle in one step: another contact altogether */
    s->bodies[s->shapes[other].body].position[0] = -0.0999;
    s->bodies[s->shapes[other].body].position[1] = 0.01;
    find(s);
    ck_assert_double_eq(dot3(s->contacts.points[0].impulse, s->contacts.points[0].impulse), 0);
    free_scene(s);
}
END_TEST

/* A slot that holds another shape now starts from nothing, whichever side of the pair it is on. */
START_TEST(a_reused_slot_inherits_nothing)
{
    for (int which = 0; which < 3; ++which) {
        struct scene *s = make_scene(NULL);
        int32_t low = add_box(s, 0.05, 0, 0, 0.05), high = add_box(s, 0.05, 0, 0, 0.15);
        find(s);
        put_impulses(s);
        find(s);
        ck_assert_double_gt(fabs(s->contacts.points[0].impulse[2]), 0.5); /* without reuse they stay */
        if (which != 1) s->shapes[low].revision = 50;
        if (which != 0) s->shapes[high].revision = 51;
        find(s);
        ck_assert_uint_eq(s->contacts.point_count, 4);
        for (int i = 0; i < 4; ++i)
            ck_assert_double_eq(dot3(s->contacts.points[i].impulse, s->contacts.points[i].impulse), 0);
        free_scene(s);
    }
}
END_TEST

/* A cube that has sunk into a thin slab until its centre is below the slab's is still pushed up; one that was put there
 * is not. */
START_TEST(a_pose_that_is_set_forgets_the_axis)
{
    for (int which = 0; which < 3; ++which) {
        struct scene *s = make_scene(NULL);
        int32_t slab = add_shape(s, add_body(s, false, 0, 0, 0), SADMM_SHAPE_BOX, 0.5, 0.5, 0.002);
        int32_t cube = add_box(s, 0.05, 0, 0, 0.0515);
        for (int step = 0; step < 4; ++step) {
            find(s);
            s->bodies[s->shapes[cube].body].position[2] -= 0.0171;
        }
        find(s);
        ck_assert_double_gt(pair_of(s, slab, cube)->normal[2], 0.9);
        put_impulses(s);
        if (which != 1) s->bodies[s->shapes[slab].body].placed += 1;
        if (which != 0) s->bodies[s->shapes[cube].body].placed += 3;
        find(s);
        ck_assert_double_lt(pair_of(s, slab, cube)->normal[2], -0.9);
        free_scene(s);
    }
}
END_TEST

/* What carries over are forces: impulses go with the length of the step, and are the same bits where it stays. */
START_TEST(impulses_go_with_the_time_step)
{
    struct scene *s = make_scene(NULL);
    add_ground(s);
    add_box(s, 0.05, 0, 0, 0.05);
    find(s);
    put_impulses(s);
    for (int step = 0; step < 4; ++step) {
        const double ratio = (const double[]){1, 2, 0.1, 1}[step];
        struct sadmm_contact_set before;
        copy_set(&before, &s->contacts);
        s->input.dt *= ratio;
        find(s);
        ck_assert_uint_eq(s->contacts.point_count, 4);
        for (int i = 0; i < 4; ++i)
            for (int k = 0; k < 3; ++k) {
                const double now = s->contacts.points[i].impulse[k], old = before.points[i].impulse[k];
                if (ratio == 1) ck_assert_double_eq(now, old);
                ck_assert_double_eq_tol(now, ratio * old, 1e-15); /* rounding */
            }
        sadmm_contact_set_free(&before);
    }
    free_scene(s);
}
END_TEST

START_TEST(a_find_can_be_undone)
{
    struct scene *s = make_scene(NULL);
    struct sadmm_contact_set before, after;
    struct random r = {40};
    fill_pile(s, 200, 9, 1);
    find(s);
    put_impulses(s);
    copy_set(&before, &s->contacts);
    stir(s, &r, 1e-3);
    find(s);
    copy_set(&after, &s->contacts);
    put_impulses(s);
    sadmm_collision_undo(s->collision, &s->contacts);
    expect_equal_sets(&s->contacts, &before);
    sadmm_collision_undo(s->collision, &s->contacts); /* only once */
    expect_equal_sets(&s->contacts, &before);
    find(s);
    expect_equal_sets(&s->contacts, &after);
    sadmm_contact_set_free(&before);
    sadmm_contact_set_free(&after);
    free_scene(s);
}
END_TEST

/* ---- failures ---------------------------------------------------------------------------------------------------- */

START_TEST(lack_of_memory_changes_nothing)
{
    struct scene *s = make_scene(_i ? &sadmm_broad_phase_sweep : NULL),
                 *other = make_scene(_i ? &sadmm_broad_phase_sweep : NULL);
    struct random r = {3}, r2 = {3};
    int failures = 0;
    fill_pile(s, 60, 21, 2);
    fill_pile(other, 60, 21, 2);
    for (int step = 0; step < 12; ++step) {
        struct sadmm_contact_set before;
        copy_set(&before, &s->contacts);
        for (long n = 0;; ++n) {
            sadmm_test_fail_allocations_after(n);
            sadmm_status status = try_find(s);
            sadmm_test_fail_allocations_after(-1);
            if (status == SADMM_OK) break;
            ++failures;
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert_int_eq(s->error.status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert_uint_gt(strlen(s->error.message), 0);
            expect_equal_sets(&s->contacts, &before);
            sadmm_collision_undo(s->collision, &s->contacts); /* a failed find has nothing to undo */
            expect_equal_sets(&s->contacts, &before);
            ck_assert_int_lt(n, 10000);
        }
        find(other);
        expect_equal_sets(&s->contacts, &other->contacts);
        put_impulses(s);
        put_impulses(other);
        stir(s, &r, 0.01);
        stir(other, &r2, 0.01);
        if (step == 5) { /* more of everything */
            fill_pile(s, 150, 22, 2);
            fill_pile(other, 150, 22, 2);
        }
        sadmm_contact_set_free(&before);
    }
    ck_assert_int_gt(failures, 20);
    free_scene(s);
    free_scene(other);
}
END_TEST

START_TEST(the_steady_state_allocates_nothing)
{
    struct scene *s = make_scene(_i ? &sadmm_broad_phase_sweep : NULL);
    struct random r = {6};
    add_ground(s);
    for (int i = 0; i < 125; ++i) add_box(s, 0.05, 0.105 * (i % 5), 0.105 * (i / 5 % 5), 0.05 + 0.1 * (i / 25));
    for (int step = 0; step < 3; ++step) find(s); /* both sets have grown */
    for (int step = 0; step < 50; ++step) {
        stir(s, &r, 1e-7);
        sadmm_test_fail_allocations_after(0);
        sadmm_status status = try_find(s);
        sadmm_test_fail_allocations_after(-1);
        ck_assert_int_eq(status, SADMM_OK);
        ck_assert_uint_eq(s->contacts.point_count, 500);
    }
    free_scene(s);
}
END_TEST

/* ---- repeatability ----------------------------------------------------------------------------------------------- */

/* A run of steps with impulses carried along, on any broad phase, with any number of threads, with bodies added at
 * once or one by one, with or without finds in between that leave other boxes behind: bit for bit the same contacts. */
START_TEST(contacts_depend_on_the_present_alone)
{
    struct scene *reference = make_scene(&sadmm_broad_phase_sweep);
    struct scene *others[] = {
        make_scene(&sadmm_broad_phase_sweep),
#ifdef SADMM_HAVE_FCL
        make_scene(&sadmm_broad_phase_fcl),
        make_scene(&sadmm_broad_phase_fcl),
        make_scene(&sadmm_broad_phase_fcl),
#endif
    };
    enum { OTHERS = sizeof others / sizeof others[0] };
    const int threads[] = {7, 1, 2, 3};
    struct random r = {1000};
    sadmm_test_force_threads(true);
    fill_pile(reference, 1500, 77, 1 + 2 * _i);
    for (int o = 0; o < OTHERS; ++o) {
        fill_pile(others[o], 1500, 77, 1 + 2 * _i);
        others[o]->input.threads = threads[o];
    }
    for (int32_t alive = reference->shape_count, o = OTHERS - 1; alive > 0; alive -= 301) {
        /* the last one grows up: shapes appear from the end of the list */
        for (int32_t i = 0; i < others[o]->shape_count; ++i) others[o]->shapes[i].alive = i >= alive;
        find(others[o]);
    }
    sadmm_contact_set_free(&others[OTHERS - 1]->contacts);
    for (int32_t i = 0; i < reference->shape_count; ++i) others[OTHERS - 1]->shapes[i].alive = true;
    for (int step = 0; step < 12; ++step) {
        find(reference);
        ck_assert_uint_gt(reference->contacts.point_count, 3000);
        for (int o = 0; o < OTHERS; ++o) {
            memcpy(others[o]->bodies, reference->bodies, sizeof reference->bodies);
            if (step % 3 == 2) { /* a find elsewhere, undone: the larger boxes stay behind */
                struct random elsewhere = {5 + (uint64_t)o};
                stir(others[o], &elsewhere, 0.03);
                find(others[o]);
                sadmm_collision_undo(others[o]->collision, &others[o]->contacts);
                memcpy(others[o]->bodies, reference->bodies, sizeof reference->bodies);
            }
            find(others[o]);
            expect_equal_sets(&others[o]->contacts, &reference->contacts);
            put_impulses(others[o]);
        }
        put_impulses(reference);
        stir(reference, &r, step % 2 ? 1e-5 : 3e-3);
    }
    for (int o = 0; o < OTHERS; ++o) free_scene(others[o]);
    free_scene(reference);
}
END_TEST

/* Boxes on a grid, turned by quarters or a little: faces, edges and corners that coincide. */
static void fill_grid(struct scene *s, uint64_t seed)
{
    struct random r = {seed};
    for (int i = 0; i < 343; ++i) {
        const double tilt = i % 3 ? 0 : random_in(&r, -1e-3, 1e-3), quarter = acos(0) * (i % 4);
        const int32_t box = add_box(s, 0.05, 2 + 0.0999 * (i % 7), 0.0999 * (i / 7 % 7), 0.05 + 0.0999 * (i / 49));
        turn_body(s, s->shapes[box].body, i % 2, i % 5 == 0, 1, quarter + tilt);
    }
}

/* Each variant of the code, of those that this machine can run: bit for bit the same contacts over a run of steps. */
START_TEST(every_instruction_set_finds_the_same)
{
    struct scene *reference = make_scene(NULL), *other = make_scene(NULL);
    const struct sadmm_collision_kernels *kernels = sadmm_collision_kernels_at(_i);
    struct random r = {2000};
    if (kernels) {
        other->collision->candidates.kernels = kernels;
        for (int k = 0; k < 2; ++k) {
            fill_pile(k ? other : reference, 1000, 78, 1);
            fill_grid(k ? other : reference, 79);
        }
    }
    for (int step = 0; kernels && step < 12; ++step) {
        for (int32_t i = step; i < reference->body_count; i += 7)
            if (reference->bodies[i].system_body >= 0)
                for (int k = 0; k < 6; ++k) reference->bodies[i].velocity[k] = random_in(&r, -1, 1) * (i % 2 ? 1 : 30);
        memcpy(other->bodies, reference->bodies, sizeof reference->bodies);
        find(reference);
        find(other);
        ck_assert_uint_gt(reference->contacts.point_count, 3000);
        expect_equal_sets(&other->contacts, &reference->contacts);
        put_impulses(reference);
        put_impulses(other);
        stir(reference, &r, step % 2 ? 1e-5 : 2e-3);
    }
    free_scene(other);
    free_scene(reference);
}
END_TEST

/* The same bodies in other slots: the same contacts, with a and b exchanged where the slots say so. */
START_TEST(slots_do_not_change_the_contacts)
{
    enum { N = 60 };
    struct scene *s = make_scene(NULL), *t = make_scene(NULL);
    struct random r = {50};
    double x[N][3], axis[N][3];
    for (int i = 0; i < N; ++i)
        for (int k = 0; k < 3; ++k) {
            x[i][k] = random_in(&r, 0, 0.35);
            axis[i][k] = random_in(&r, -1, 1);
        }
    for (int i = 0; i < N; ++i) {
        int j = N - 1 - i;
        add_box(s, 0.05, x[i][0], x[i][1], x[i][2]);
        turn_body(s, s->body_count - 1, axis[i][0], axis[i][1], axis[i][2], 1 + 0.1 * i);
        add_box(t, 0.05, x[j][0], x[j][1], x[j][2]);
        turn_body(t, t->body_count - 1, axis[j][0], axis[j][1], axis[j][2], 1 + 0.1 * j);
    }
    find(s);
    find(t);
    ck_assert_uint_gt(s->contacts.pair_count, 60);
    ck_assert_uint_eq(s->contacts.pair_count, t->contacts.pair_count);
    for (size_t i = 0; i < s->contacts.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &s->contacts.pairs[i],
                                        *q = pair_of(t, N - 1 - p->shape_a, N - 1 - p->shape_b);
        ck_assert_ptr_nonnull(q);
        ck_assert_int_eq(p->count, q->count);
        ck_assert_double_lt(dot3(p->normal, q->normal), -1 + 1e-9); /* the slots are reversed, so is the pair */
        for (int32_t j = 0; j < p->count; ++j) {
            double nearest = HUGE_VAL;
            for (int32_t k = 0; k < q->count; ++k) {
                const struct sadmm_contact_point *c = &s->contacts.points[p->first + j],
                                                 *d = &t->contacts.points[q->first + k];
                double off = fabs(c->separation - d->separation);
                for (int l = 0; l < 3; ++l) off = fmax(off, fabs(c->arm_a[l] - d->arm_b[l]));
                nearest = fmin(nearest, off);
            }
            ck_assert_double_lt(nearest, 1e-9); /* rounding over the sine of edges' angles */
        }
    }
    free_scene(s);
    free_scene(t);
}
END_TEST

START_TEST(an_empty_input_gives_an_empty_set)
{
    struct scene *s = make_scene(NULL);
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count + s->contacts.point_count, 0);
    add_ground(s);
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count, 0);
    add_box(s, 0.05, 0, 0, 0.05);
    find(s);
    ck_assert_uint_eq(s->contacts.point_count, 4);
    /* slots that a caller takes away count as dead */
    s->shape_count = 1;
    find(s);
    ck_assert_uint_eq(s->contacts.pair_count, 0);
    ck_assert_str_eq(sadmm_collision_broad_phase_name(), sadmm_broad_phase_default()->name);
    free_scene(s);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("collision");
    TCase *cases = tcase_create("collision");
    SRunner *runner;
    int failed;

    tcase_set_timeout(cases, 100);
    tcase_add_test(cases, a_box_on_the_ground);
    tcase_add_test(cases, arms_start_at_the_centre_of_mass);
    tcase_add_test(cases, pairs_come_sorted_by_type_and_slot);
    tcase_add_test(cases, friction_and_restitution_of_a_pair);
    tcase_add_test(cases, shapes_may_share_a_geometry);
    tcase_add_test(cases, a_pair_has_a_manifold_for_each_subshape);
    tcase_add_test(cases, what_is_kept_is_kept_by_subshape);
    tcase_add_test(cases, the_axis_is_kept_by_subshape);
    tcase_add_loop_test(cases, shapes_without_manifolds_are_refused, 0, 2);
    tcase_add_test(cases, filters);
    tcase_add_loop_test(cases, environments_share_space_without_meeting, 0, 2);
    tcase_add_test(cases, a_plane_that_is_moved_takes_its_contacts_along);
    tcase_add_test(cases, nothing_fast_is_missed);
    tcase_add_test(cases, rest_gets_no_useless_contacts);
    tcase_add_test(cases, a_fall_from_rest_is_foreseen);
    tcase_add_test(cases, separations_are_exact_far_from_the_origin);
    tcase_add_test(cases, impulses_carry_over_by_feature);
    tcase_add_test(cases, impulses_follow_the_normal);
    tcase_add_test(cases, a_reused_slot_inherits_nothing);
    tcase_add_test(cases, a_pose_that_is_set_forgets_the_axis);
    tcase_add_test(cases, impulses_go_with_the_time_step);
    tcase_add_test(cases, a_find_can_be_undone);
    tcase_add_loop_test(cases, lack_of_memory_changes_nothing, 0, 2);
    tcase_add_loop_test(cases, the_steady_state_allocates_nothing, 0, 2);
    tcase_add_loop_test(cases, contacts_depend_on_the_present_alone, 0, 2);
    if (!races_are_looked_for()) tcase_add_loop_test(cases, every_instruction_set_finds_the_same, 1, 2);
    tcase_add_test(cases, slots_do_not_change_the_contacts);
    tcase_add_test(cases, an_empty_input_gives_an_empty_set);
    suite_add_tcase(suite, cases);

    runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
