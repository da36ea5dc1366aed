/* Sizes and places of shapes that are set: as if the shape had been made so; what contacts keep, and what bodies do. */
#include <float.h>
#include <math.h>

#include "fixed_work.h"
#include "scene_tools.h"
#include "subadmm/query.h"

#define REFUSED(world, part, call)                                                                             \
    do {                                                                                                       \
        ck_assert_int_eq((call), SADMM_ERROR_INVALID_ARGUMENT);                                                \
        ck_assert_msg(strstr(sadmm_world_message(world), part) != NULL, "\"%s\"", sadmm_world_message(world)); \
    } while (0)

static const double turned[4] = {0.6, 0, 0.8, 0}, straight[4] = {1, 0, 0, 0}, aside[3] = {0.02, -0.01, 0.03};

/* Shapes with sizes, and how many they have. */
static const struct {
    sadmm_shape_type type;
    int sizes;
} kinds[] = {{SADMM_SHAPE_SPHERE, 1},   {SADMM_SHAPE_CAPSULE, 2}, {SADMM_SHAPE_BOX, 3},
             {SADMM_SHAPE_CYLINDER, 2}, {SADMM_SHAPE_CONE, 2},    {SADMM_SHAPE_ELLIPSOID, 3}};
enum { KINDS = sizeof kinds / sizeof *kinds };

static void size_of(int kind, double by, double size[3])
{
    for (int k = 0; k < 3; ++k) size[k] = k < kinds[kind].sizes ? by * (0.1 + 0.02 * k) : 0;
}

static sadmm_world *empty_world(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.6);
    return world;
}

static sadmm_body_id add_mass(sadmm_world *world, double x, double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = 2;
    def.inertia[0] = 0.01, def.inertia[1] = 0.012, def.inertia[2] = 0.015;
    def.position[0] = x, def.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static sadmm_shape_id add_one(sadmm_world *world, sadmm_body_id body, const sadmm_shape_def *def)
{
    sadmm_shape_id id;
    MUST(world, sadmm_world_add_shape(world, body, def, &id));
    return id;
}

/* Two bodies of a kind on the floor, beside each other and in touch for a while. */
static sadmm_world *pair_of(int kind, double by, bool moved, sadmm_shape_id shapes[2])
{
    sadmm_world *world = empty_world();
    for (int k = 0; k < 2; ++k) {
        sadmm_shape_def def = sadmm_shape_def_default();
        def.type = kinds[kind].type;
        size_of(kind, by, def.size);
        if (moved) memcpy(def.position, aside, sizeof aside), memcpy(def.orientation, turned, sizeof turned);
        shapes[k] = add_one(world, add_mass(world, 0.15 * k, 0.3 + 0.1 * k), &def);
    }
    return world;
}

static void set_form(sadmm_world *world, const sadmm_shape_id shapes[2], int kind, double by, bool moved)
{
    static const double middle[3] = {0, 0, 0};
    double size[3];
    size_of(kind, by, size);
    for (int k = 0; k < 2; ++k) {
        MUST(world, sadmm_world_set_shape_size(world, shapes[k], size));
        MUST(world, sadmm_world_set_shape_frame(world, shapes[k], moved ? aside : middle, moved ? turned : straight));
    }
}

/* Set before the first step it is the world that was made so, to the last bit; set to others and back between steps it
 * is the world that was left alone: contacts are found again. */
START_TEST(set_is_as_made)
{
    sadmm_shape_id made_shapes[2], set_shapes[2];
    sadmm_world *made = pair_of(_i, 1, true, made_shapes), *set = pair_of(_i, 1.7, false, set_shapes);
    set_form(set, set_shapes, _i, 1, true);
    for (int k = 0; k < 2; ++k) {
        sadmm_shape_def a, b;
        MUST(made, sadmm_world_shape_def(made, made_shapes[k], &a, NULL));
        MUST(set, sadmm_world_shape_def(set, set_shapes[k], &b, NULL));
        ck_assert_mem_eq(a.size, b.size, (size_t)kinds[_i].sizes * sizeof *a.size);
        ck_assert_mem_eq(a.position, b.position, sizeof a.position);
        ck_assert_mem_eq(a.orientation, b.orientation, sizeof a.orientation);
    }
    for (int step = 0; step < 80; ++step) {
        if (step % 7 == 3) {
            set_form(set, set_shapes, _i, 0.8, false);
            set_form(set, set_shapes, _i, 1, true);
        }
        step_world(made, 1);
        step_world(set, 1);
        ck_assert_msg(state_hash(made) == state_hash(set), "step %d", step);
    }
    ck_assert_int_gt(world_report(made).contacts, 1);
    set_form(set, set_shapes, _i, 0.8, false);
    step_world(made, 1);
    step_world(set, 1);
    ck_assert(state_hash(made) != state_hash(set));
    sadmm_world_destroy(made);
    sadmm_world_destroy(set);
}
END_TEST

static sadmm_hull *make_hull(void)
{
    double points[8 * 3];
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_hull *hull = NULL;
    for (int k = 0; k < 8; ++k) {
        points[3 * k] = k & 1 ? 0.1 : -0.1;
        points[3 * k + 1] = k & 2 ? 0.12 : -0.08; /* its middle is not its origin */
        points[3 * k + 2] = k & 4 ? 0.15 : -0.1;
    }
    def.points = points, def.point_count = 8;
    (void)sadmm_hull_create(&def, &hull);
    return hull; /* NULL: the library was built without */
}

static sadmm_mesh *make_field(void)
{
    double heights[40 * 40];
    sadmm_heightfield_def def = sadmm_heightfield_def_default();
    sadmm_mesh *mesh;
    for (int r = 0; r < 40; ++r)
        for (int c = 0; c < 40; ++c) heights[40 * r + c] = 0.05 * sin(0.9 * r) * cos(0.7 * c) + 0.004 * r;
    def.heights = heights, def.rows = def.columns = 40;
    def.spacing[0] = def.spacing[1] = 0.1;
    ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
    return mesh;
}

/* A hull or a heightfield, which are in a frame of their own inside: balls fall onto it. */
static sadmm_world *over_block(const sadmm_hull *hull, const sadmm_mesh *mesh, bool moved, sadmm_shape_id *id)
{
    sadmm_world *world = empty_world();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_body_id ground;
    body.type = SADMM_BODY_STATIC;
    body.position[2] = 0.2;
    MUST(world, sadmm_world_add_body(world, &body, &ground));
    sadmm_shape_def def = sadmm_shape_def_default(), ball = sadmm_shape_def_default();
    def.type = hull ? SADMM_SHAPE_HULL : SADMM_SHAPE_MESH;
    def.hull = hull, def.mesh = mesh;
    if (moved) memcpy(def.position, aside, sizeof aside), def.orientation[0] = 0.8, def.orientation[3] = 0.6;
    *id = add_one(world, ground, &def);
    ball.size[0] = 0.05;
    for (int k = 0; k < 4; ++k) (void)add_one(world, add_mass(world, 0.11 * k - 0.12, 0.55), &ball);
    return world;
}

START_TEST(blocks_are_moved_as_made)
{
    static const double way[4] = {0.8, 0, 0, 0.6};
    sadmm_hull *hull = _i ? make_hull() : NULL;
    sadmm_mesh *mesh = _i ? NULL : make_field();
    sadmm_shape_id made_id, set_id;
    if (!hull && !mesh) return;
    sadmm_world *made = over_block(hull, mesh, true, &made_id), *set = over_block(hull, mesh, false, &set_id);
    sadmm_world *still = over_block(hull, mesh, false, &made_id);
    MUST(set, sadmm_world_set_shape_frame(set, set_id, aside, way));
    step_world(made, 120), step_world(set, 120), step_world(still, 120);
    ck_assert_uint_eq(state_hash(made), state_hash(set));
    ck_assert(state_hash(made) != state_hash(still));
    ck_assert_int_gt(world_report(made).contacts, 2);
    /* A save has it where it is. */
    size_t size;
    MUST(set, sadmm_world_save(set, NULL, 0, &size));
    void *bytes = malloc(size);
    MUST(set, sadmm_world_save(set, bytes, size, &size));
    MUST(still, sadmm_world_restore(still, bytes, size));
    step_world(made, 20), step_world(still, 20);
    ck_assert_uint_eq(state_hash(made), state_hash(still));
    free(bytes);
    sadmm_hull_destroy(hull);
    sadmm_mesh_destroy(mesh);
    sadmm_world_destroy(made), sadmm_world_destroy(set), sadmm_world_destroy(still);
}
END_TEST

/* A ball grows to twice its radius: it has its mass, and comes to rest that high; rays meet it there at once. */
START_TEST(a_ball_grows)
{
    sadmm_world *world = empty_world();
    const sadmm_body_id body = add_mass(world, 0, 0.1);
    sadmm_shape_def def = sadmm_shape_def_default();
    def.size[0] = 0.1;
    const sadmm_shape_id id = add_one(world, body, &def);
    const sadmm_body_def before = body_def(world, body);
    step_world(world, 20);
    const double size[3] = {0.2, 0, 0};
    const sadmm_ray ray = {{0, 0, 3}, {0, 0, -1}, INFINITY};
    sadmm_ray_hit hit;
    MUST(world, sadmm_world_cast_rays(world, 1, &ray, NULL, &hit));
    ck_assert_double_eq_tol(hit.distance, 2.8, 1e-4); /* what rests is in the floor by less than this */
    MUST(world, sadmm_world_set_shape_size(world, id, size));
    MUST(world, sadmm_world_cast_rays(world, 1, &ray, NULL, &hit));
    ck_assert_double_eq_tol(hit.distance, 2.7, 1e-4);
    step_world(world, 400); /* the overlap of 0.1 m at the speed of correction */
    ck_assert_double_eq_tol(body_state(world, body).position[2], 0.2, 1e-3);
    const sadmm_body_def after = body_def(world, body);
    ck_assert(after.mass == before.mass);
    ck_assert_mem_eq(after.inertia, before.inertia, sizeof after.inertia);
    /* Its shape is moved up in it: it sinks by as much. */
    const double up[3] = {0, 0, 0.05};
    MUST(world, sadmm_world_set_shape_frame(world, id, up, straight));
    step_world(world, 200);
    ck_assert_double_eq_tol(body_state(world, body).position[2], 0.15, 1e-3);
    sadmm_world_destroy(world);
}
END_TEST

/* Other sizes, by however little, and the impulses of the last step are gone: a few iterations are not enough. */
START_TEST(contacts_begin_anew)
{
    double errors[2];
    for (int anew = 0; anew < 2; ++anew) {
        struct sadmm_scene scene = open_scene("vertical_stacks:6");
        scene.def.backend = SADMM_BACKEND_CPU;
        scene.def.settings = fixed_settings();
        scene.def.settings.threads = 1;
        scene.def.settings.certify = true;
        sadmm_world *world = build_scene(&scene);
        step_world(world, 60);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.iterations = 5;
        MUST(world, sadmm_world_set_settings(world, &settings));
        for (int32_t k = 0; anew && k < sadmm_world_shape_count(world); ++k) {
            sadmm_shape_id id;
            sadmm_shape_def def;
            MUST(world, sadmm_world_shape_at(world, k, &id));
            MUST(world, sadmm_world_shape_def(world, id, &def, NULL));
            if (def.type != SADMM_SHAPE_BOX) continue;
            def.size[0] *= 1 + 4 * DBL_EPSILON;
            MUST(world, sadmm_world_set_shape_size(world, id, def.size));
        }
        step_world(world, 1);
        errors[anew] = world_report(world).certificate.ncp_max;
        sadmm_world_destroy(world);
    }
    ck_assert_double_gt(errors[1], 100 * errors[0]);
}
END_TEST

START_TEST(what_is_refused_changes_nothing)
{
    sadmm_shape_id shapes[2], plane;
    sadmm_world *world = pair_of(2, 1, true, shapes);
    MUST(world, sadmm_world_shape_at(world, 0, &plane));
    const double none[3] = {0, 0, 0}, small[3] = {0.1, 1e-7, 0.1}, wrong[3] = {0.1, 0.1, NAN}, far[3] = {0, 2e6, 0},
                 long_one[4] = {1, 0.1, 0, 0};
    sadmm_shape_def before, after;
    MUST(world, sadmm_world_shape_def(world, shapes[0], &before, NULL));
    REFUSED(world, "size[1] = 1e-07: must be in [1e-06, 1e+06] m", sadmm_world_set_shape_size(world, shapes[0], small));
    REFUSED(world, "size[2] = nan: must be in", sadmm_world_set_shape_size(world, shapes[0], wrong));
    REFUSED(world, "size[0] = 0.1: must be 0, for a shape of type", sadmm_world_set_shape_size(world, plane, small));
    MUST(world, sadmm_world_set_shape_size(world, plane, none));
    REFUSED(world, "position[1] = 2e+06: must be in [-1e+06, 1e+06]",
            sadmm_world_set_shape_frame(world, shapes[0], far, straight));
    REFUSED(world, "orientation = (1, 0.1, 0, 0)", sadmm_world_set_shape_frame(world, shapes[0], none, long_one));
    REFUSED(world, "size", sadmm_world_set_shape_size(world, shapes[0], NULL));
    MUST(world, sadmm_world_shape_def(world, shapes[0], &after, NULL));
    ck_assert_mem_eq(&before, &after, sizeof before);
    const double size[3] = {0.1, 0.1, 0.1};
    MUST(world, sadmm_world_remove_shape(world, shapes[1]));
    ck_assert_int_eq(sadmm_world_set_shape_size(world, shapes[1], size), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_shape_frame(world, shapes[1], none, straight), SADMM_ERROR_STALE_ID);
    sadmm_world_destroy(world);
}
END_TEST

/* An orientation that was read is set without a change; one that is not of unit length is normalised, once and for
 * all. */
START_TEST(orientations_come_back)
{
    sadmm_shape_id shapes[2];
    sadmm_world *world = pair_of(2, 1, true, shapes);
    for (int k = 0; k < 200; ++k) {
        sadmm_shape_def first, second;
        double q[4], length2 = 0;
        for (int j = 0; j < 4; ++j) q[j] = sin(3.7 * k + 1.3 * j + 1), length2 += q[j] * q[j];
        for (int j = 0; j < 4; ++j) q[j] *= (1 + 4e-7 * sin(k)) / sqrt(length2);
        MUST(world, sadmm_world_set_shape_frame(world, shapes[0], aside, q));
        MUST(world, sadmm_world_shape_def(world, shapes[0], &first, NULL));
        MUST(world, sadmm_world_set_shape_frame(world, shapes[0], first.position, first.orientation));
        MUST(world, sadmm_world_shape_def(world, shapes[0], &second, NULL));
        ck_assert_mem_eq(first.orientation, second.orientation, sizeof first.orientation);
        length2 = 0;
        for (int j = 0; j < 4; ++j) length2 += first.orientation[j] * first.orientation[j];
        ck_assert_double_eq_tol(length2, 1, 8 * DBL_EPSILON);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Arrays have what single calls have, and set it likewise. */
START_TEST(arrays_are_the_same)
{
    sadmm_shape_id shapes[2], other_shapes[2];
    sadmm_world *world = pair_of(1, 1, true, shapes), *other = pair_of(1, 1, true, other_shapes);
    double size[3 * 3], frame[3 * 7];
    ck_assert_str_eq(sadmm_array_name(SADMM_ARRAY_SHAPE_SIZE), "shape_size");
    ck_assert_int_eq(sadmm_world_array_rows(world, SADMM_ARRAY_SHAPE_FRAME), 3);
    MUST(world, sadmm_world_get_array(world, SADMM_ARRAY_SHAPE_SIZE, 0, 3, size));
    MUST(world, sadmm_world_get_array(world, SADMM_ARRAY_SHAPE_FRAME, 0, 3, frame));
    for (int k = 0; k < 3; ++k) ck_assert(size[k] == 0 && frame[k] == 0); /* of the floor */
    double own[3];
    size_of(1, 1, own);
    ck_assert_mem_eq(size + 3, own, sizeof own);
    ck_assert_mem_eq(frame + 7, aside, sizeof aside);
    ck_assert_mem_eq(frame + 10, turned, sizeof turned);
    step_world(world, 40), step_world(other, 40);
    set_form(other, other_shapes, 1, 1.2, false);
    for (int k = 1; k < 3; ++k) {
        size_of(1, 1.2, size + 3 * k);
        memset(frame + 7 * k, 0, 7 * sizeof *frame);
        frame[7 * k + 3] = 1;
    }
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_SHAPE_SIZE, 0, 3, size));
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_SHAPE_FRAME, 0, 3, frame));
    step_world(world, 40), step_world(other, 40);
    ck_assert_uint_eq(state_hash(world), state_hash(other));
    size[5] = 0.1, size[6] = -1;
    REFUSED(world, "values, row 1: size[2] = 0.1: must be 0",
            sadmm_world_set_array(world, SADMM_ARRAY_SHAPE_SIZE, 0, 3, size));
    size[5] = 0;
    REFUSED(world, "values, row 2: size[0] = -1: must be in",
            sadmm_world_set_array(world, SADMM_ARRAY_SHAPE_SIZE, 0, 3, size));
    frame[13] = 3;
    REFUSED(world, "values, row 1: orientation", sadmm_world_set_array(world, SADMM_ARRAY_SHAPE_FRAME, 0, 3, frame));
    sadmm_world_destroy(world), sadmm_world_destroy(other);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("shape_forms");
    TCase *cases = tcase_create("shape_forms");
    tcase_add_loop_test(cases, set_is_as_made, 0, KINDS);
    tcase_add_loop_test(cases, blocks_are_moved_as_made, 0, 2);
    tcase_add_test(cases, a_ball_grows);
    tcase_add_test(cases, contacts_begin_anew);
    tcase_add_test(cases, what_is_refused_changes_nothing);
    tcase_add_test(cases, orientations_come_back);
    tcase_add_test(cases, arrays_are_the_same);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
