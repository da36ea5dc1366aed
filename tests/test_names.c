/* Names and user data of bodies, shapes, joints, gears and couplings: given in definitions, found and read by ids, kept
 * by saved worlds, gone with their objects. */
#include <stdint.h>

#include "core/base/memory.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "world/state/world_state.h"

/* Two wheels on hinges that mesh, and a hand that pulls the first. */
struct machine {
    sadmm_world *world;
    sadmm_body_id bodies[2];
    sadmm_shape_id shapes[2];
    sadmm_joint_id joints[2];
    sadmm_gear_id gear;
    sadmm_coupling_id coupling;
};
enum { OBJECTS = 8 };
static int own[OBJECTS]; /* what pointers point to */

/* Without names and pointers, or with. */
static struct machine build(bool tagged)
{
    static const char *const body_names[2] = {"wheel", "pinion"}, *const shape_names[2] = {"rim", "teeth"},
                             *const joint_names[2] = {"axle", "shaft"};
    const sadmm_world_def def = fixed_world_def();
    struct machine m = {.world = create_world(&def)};
    for (int k = 0; k < 2; ++k) {
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_joint_def joint = sadmm_joint_def_default();
        body.mass = 1;
        sadmm_sphere_inertia(1, 0.1, body.inertia);
        body.position[0] = k;
        body.name = tagged ? body_names[k] : NULL;
        body.user_data = tagged ? &own[k] : NULL;
        MUST(m.world, sadmm_world_add_body(m.world, &body, &m.bodies[k]));
        shape.size[0] = 0.1;
        shape.name = tagged ? shape_names[k] : NULL;
        shape.user_data = tagged ? &own[2 + k] : NULL;
        MUST(m.world, sadmm_world_add_shape(m.world, m.bodies[k], &shape, &m.shapes[k]));
        joint.kind = SADMM_JOINT_REVOLUTE;
        joint.body_b = m.bodies[k];
        joint.position_a[0] = k;
        joint.name = tagged ? joint_names[k] : NULL;
        joint.user_data = tagged ? &own[4 + k] : NULL;
        MUST(m.world, sadmm_world_add_joint(m.world, &joint, &m.joints[k]));
    }
    sadmm_gear_def gear = sadmm_gear_def_default();
    gear.joint_1 = m.joints[0], gear.coordinate_1 = 5;
    gear.joint_2 = m.joints[1], gear.coordinate_2 = 5;
    gear.name = tagged ? "mesh" : NULL;
    gear.user_data = tagged ? &own[6] : NULL;
    MUST(m.world, sadmm_world_add_gear(m.world, &gear, &m.gear));
    sadmm_coupling_def coupling = sadmm_coupling_def_default();
    coupling.body = m.bodies[0];
    coupling.angular_stiffness = 1;
    coupling.name = tagged ? "hand" : NULL;
    coupling.user_data = tagged ? &own[7] : NULL;
    MUST(m.world, sadmm_world_add_coupling(m.world, &coupling, &m.coupling));
    return m;
}

/* The name of every object, and that the name leads back to it. */
#define NAMED(m, of, object, expected)                                                       \
    do {                                                                                     \
        sadmm_##object##_id found = {0, 0};                                                  \
        ck_assert_str_eq(sadmm_world_##object##_name((m)->world, (m)->of), expected);        \
        MUST((m)->world, sadmm_world_##object##_named((m)->world, expected, &found));        \
        ck_assert(found.slot == (m)->of.slot && found.generation == (m)->of.generation);     \
    } while (0)

static void expect_names(const struct machine *m)
{
    NAMED(m, bodies[0], body, "wheel");
    NAMED(m, bodies[1], body, "pinion");
    NAMED(m, shapes[0], shape, "rim");
    NAMED(m, shapes[1], shape, "teeth");
    NAMED(m, joints[0], joint, "axle");
    NAMED(m, joints[1], joint, "shaft");
    NAMED(m, gear, gear, "mesh");
    NAMED(m, coupling, coupling, "hand");
}

/* first: of the pointers; NULL: there is none. */
static void expect_data(const struct machine *m, int *first)
{
#define POINTS(of, object, k) \
    ck_assert_ptr_eq(sadmm_world_##object##_user_data(m->world, m->of), first ? first + (k) : NULL)
    POINTS(bodies[0], body, 0);
    POINTS(bodies[1], body, 1);
    POINTS(shapes[0], shape, 2);
    POINTS(shapes[1], shape, 3);
    POINTS(joints[0], joint, 4);
    POINTS(joints[1], joint, 5);
    POINTS(gear, gear, 6);
    POINTS(coupling, coupling, 7);
#undef POINTS
}

START_TEST(definitions_give_them)
{
    const struct machine m = build(true);
    sadmm_body_def body;
    sadmm_shape_def shape;
    sadmm_joint_def joint;
    sadmm_gear_def gear;
    sadmm_coupling_def coupling;
    expect_names(&m);
    expect_data(&m, own);
    step_world(m.world, 3);
    expect_names(&m);
    expect_data(&m, own);
    MUST(m.world, sadmm_world_body_def(m.world, m.bodies[1], &body));
    ck_assert(strcmp(body.name, "pinion") == 0 && body.user_data == &own[1]);
    MUST(m.world, sadmm_world_shape_def(m.world, m.shapes[1], &shape, NULL));
    ck_assert(strcmp(shape.name, "teeth") == 0 && shape.user_data == &own[3]);
    MUST(m.world, sadmm_world_joint_def(m.world, m.joints[1], &joint));
    ck_assert(strcmp(joint.name, "shaft") == 0 && joint.user_data == &own[5]);
    MUST(m.world, sadmm_world_gear_def(m.world, m.gear, &gear));
    ck_assert(strcmp(gear.name, "mesh") == 0 && gear.user_data == &own[6]);
    MUST(m.world, sadmm_world_coupling_def(m.world, m.coupling, &coupling));
    ck_assert(strcmp(coupling.name, "hand") == 0 && coupling.user_data == &own[7]);
    sadmm_world_destroy(m.world);
}
END_TEST

#define SET(of, object) MUST(m.world, sadmm_world_set_##object##_user_data(m.world, m.of, &other[n++]))
START_TEST(user_data_is_set)
{
    const struct machine m = build(true);
    int other[OBJECTS], n = 0;
    SET(bodies[0], body);
    SET(bodies[1], body);
    SET(shapes[0], shape);
    SET(shapes[1], shape);
    SET(joints[0], joint);
    SET(joints[1], joint);
    SET(gear, gear);
    SET(coupling, coupling);
    expect_data(&m, other);
    expect_names(&m);
    sadmm_world_destroy(m.world);
}
END_TEST

/* The ids of what a query and a contact name. */
START_TEST(contacts_and_queries_lead_to_them)
{
    const struct machine m = build(true);
    const sadmm_ray ray = {.origin = {1, 0, 5}, .direction = {0, 0, -1}, .length = 10};
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default();
    sadmm_ray_hit hit;
    sadmm_contact contact;
    sadmm_body_id ground;
    MUST(m.world, sadmm_world_cast_ray(m.world, &ray, NULL, &hit));
    ck_assert_str_eq(sadmm_world_shape_name(m.world, hit.shape), "teeth");
    ck_assert_ptr_eq(sadmm_world_shape_user_data(m.world, hit.shape), &own[3]);
    body.type = SADMM_BODY_STATIC;
    body.environment = -1;
    plane.type = SADMM_SHAPE_PLANE;
    plane.position[2] = -0.1;
    plane.name = "floor";
    MUST(m.world, sadmm_world_add_body(m.world, &body, &ground));
    MUST(m.world, sadmm_world_add_shape(m.world, ground, &plane, NULL));
    step_world(m.world, 1);
    ck_assert_int_gt(sadmm_world_contact_count(m.world), 0);
    MUST(m.world, sadmm_world_contacts(m.world, 0, 1, &contact));
    const char *a = sadmm_world_shape_name(m.world, contact.shape_a),
               *b = sadmm_world_shape_name(m.world, contact.shape_b);
    ck_assert_msg((strcmp(a, "floor") == 0) != (strcmp(b, "floor") == 0), "between \"%s\" and \"%s\"", a, b);
    sadmm_world_destroy(m.world);
}
END_TEST

/* With its body go the names of its shapes, joints, their gears and couplings; the next ones in these slots have
 * none. */
START_TEST(they_go_with_their_objects)
{
    const struct machine m = build(true);
    sadmm_body_id id;
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_shape_id made;
    sadmm_joint_id joint;
    sadmm_gear_id gear;
    sadmm_coupling_id coupling;
    MUST(m.world, sadmm_world_remove_body(m.world, m.bodies[0]));
    ck_assert_str_eq(sadmm_world_body_name(m.world, m.bodies[0]), "");
    ck_assert_str_eq(sadmm_world_shape_name(m.world, m.shapes[0]), "");
    ck_assert_str_eq(sadmm_world_joint_name(m.world, m.joints[0]), "");
    ck_assert_str_eq(sadmm_world_gear_name(m.world, m.gear), "");
    ck_assert_str_eq(sadmm_world_coupling_name(m.world, m.coupling), "");
    ck_assert_ptr_null(sadmm_world_coupling_user_data(m.world, m.coupling));
    ck_assert_int_eq(sadmm_world_body_named(m.world, "wheel", &id), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_joint_named(m.world, "axle", &joint), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_gear_named(m.world, "mesh", &gear), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_coupling_named(m.world, "hand", &coupling), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_set_shape_user_data(m.world, m.shapes[0], &own), SADMM_ERROR_STALE_ID);
    body.mass = 1;
    sadmm_sphere_inertia(1, 0.1, body.inertia);
    MUST(m.world, sadmm_world_add_body(m.world, &body, &id));
    shape.size[0] = 0.1;
    MUST(m.world, sadmm_world_add_shape(m.world, id, &shape, &made));
    ck_assert(id.slot == m.bodies[0].slot && made.slot == m.shapes[0].slot);
    ck_assert_str_eq(sadmm_world_body_name(m.world, id), "");
    ck_assert_str_eq(sadmm_world_shape_name(m.world, made), "");
    ck_assert_ptr_null(sadmm_world_shape_user_data(m.world, made));
    NAMED(&m, bodies[1], body, "pinion");
    sadmm_world_destroy(m.world);
}
END_TEST

static sadmm_status add_named(sadmm_world *world, const char *name, sadmm_body_id *id)
{
    sadmm_body_def body = sadmm_body_def_default();
    body.type = SADMM_BODY_STATIC;
    body.name = name;
    return sadmm_world_add_body(world, &body, id);
}

START_TEST(a_name_is_of_one_object)
{
    const sadmm_world_def def = fixed_world_def();
    sadmm_world *world = create_world(&def);
    sadmm_body_id ids[3], found = {7, 7};
    /* 62 letters and one of two bytes: it does not fit, and is not cut in the middle */
    const char *const longest = "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\xc3\xa9";
    MUST(world, add_named(world, "twin", &ids[0]));
    MUST(world, add_named(world, "twin", &ids[1]));
    MUST(world, add_named(world, longest, &ids[2]));
    ck_assert_int_eq(sadmm_world_body_named(world, "twin", &found), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(world), "name = \"twin\": must be the name of one body, 2 of 3 have it");
    ck_assert_int_eq(sadmm_world_body_named(world, "twi", &found), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(world), "name = \"twi\": must be the name of one body, 0 of 3 have it");
    ck_assert_int_eq(sadmm_world_body_named(world, "twins", &found), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_body_named(world, "", &found), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(world), "name = \"\": must be the name of a body");
    ck_assert(found.slot == 7 && found.generation == 7);
    ck_assert_uint_eq(strlen(sadmm_world_body_name(world, ids[2])), 62);
    MUST(world, sadmm_world_body_named(world, longest, &found));
    ck_assert_uint_eq(found.slot, ids[2].slot);
    MUST(world, sadmm_world_remove_body(world, ids[0]));
    MUST(world, sadmm_world_body_named(world, "twin", &found));
    ck_assert_uint_eq(found.slot, ids[1].slot);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(names_are_utf8)
{
    const struct machine m = build(true);
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_joint_def joint = sadmm_joint_def_default();
    shape.size[0] = 0.1;
    shape.name = "a\xff";
    joint.body_b = m.bodies[0];
    joint.name = "\x80";
    ck_assert_int_eq(sadmm_world_add_shape(m.world, m.bodies[0], &shape, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(m.world), "def->name: must be UTF-8, its byte 1 (0xff) is not");
    ck_assert_int_eq(sadmm_world_add_joint(m.world, &joint, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(m.world), "def->name: must be UTF-8, its byte 0 (0x80) is not");
    ck_assert_int_eq(sadmm_world_shape_count(m.world), 2);
    ck_assert_int_eq(sadmm_world_joint_count(m.world), 2);
    step_world(m.world, 1);
    sadmm_world_destroy(m.world);
}
END_TEST

/* Names go into saved worlds, pointers do not; those of a world that is restored stay with its objects. */
START_TEST(saved_worlds_have_names)
{
    struct machine m = build(true), other = build(false);
    size_t size;
    MUST(m.world, sadmm_world_save(m.world, NULL, 0, &size));
    void *bytes = malloc(size);
    MUST(m.world, sadmm_world_save(m.world, bytes, size, &size));
    MUST(other.world, sadmm_world_restore(other.world, bytes, size)); /* the same ids */
    expect_names(&other);
    expect_data(&other, NULL);
    step_world(m.world, 2);
    MUST(m.world, sadmm_world_restore(m.world, bytes, size));
    expect_names(&m);
    expect_data(&m, own);
    free(bytes);
    sadmm_world_destroy(m.world);
    sadmm_world_destroy(other.world);
}
END_TEST

/* Errors about an object say its name. */
START_TEST(errors_name_objects)
{
    const struct machine m = build(true);
    const double x[3] = {0}, q[4] = {1, 0, 0, 0};
    sadmm_body_id gate;
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_coupling_def coupling = sadmm_coupling_def_default();
    int32_t count;
    MUST(m.world, add_named(m.world, "gate", &gate));
#define NAMES(call, named)                                                                                           \
    do {                                                                                                             \
        ck_assert_int_eq(call, SADMM_ERROR_INVALID_ARGUMENT);                                                        \
        ck_assert_msg(strstr(sadmm_world_message(m.world), named) != NULL, "%s", sadmm_world_message(m.world));      \
    } while (0)
    NAMES(sadmm_world_set_body_wrench(m.world, gate, x, x), "generation 1, \"gate\"): is static, and must be dynamic");
    NAMES(sadmm_world_move_body(m.world, m.bodies[1], x, q), "\"pinion\"): must be kinematic");
    joint.body_a = gate;
    NAMES(sadmm_world_add_joint(m.world, &joint, NULL), "\"gate\"), def->body_b = (slot 0, generation 0, \"\")");
    joint.body_b = gate;
    NAMES(sadmm_world_add_joint(m.world, &joint, NULL), "\"gate\"): must be two bodies");
    coupling.body = gate;
    NAMES(sadmm_world_add_coupling(m.world, &coupling, NULL), "\"gate\"): must be dynamic, it is static");
    NAMES(sadmm_world_sensor_overlaps(m.world, m.shapes[1], 0, NULL, &count), "\"teeth\"): must be a shape defined as");
#undef NAMES
    sadmm_world_destroy(m.world);
}
END_TEST

START_TEST(worlds_without_pay_nothing)
{
    const struct machine plain = build(false), named = build(true);
    const struct sadmm_id_pool *const pools[] = {&plain.world->body_ids, &plain.world->shape_ids,
                                                 &plain.world->joint_ids, &plain.world->gear_ids,
                                                 &plain.world->coupling_ids};
    MUST(plain.world, sadmm_world_set_body_user_data(plain.world, plain.bodies[0], NULL));
    for (size_t k = 0; k < sizeof pools / sizeof *pools; ++k) ck_assert_ptr_null(pools[k]->tags.list);
    step_world(plain.world, 20);
    step_world(named.world, 20);
    ck_assert_uint_eq(state_hash(plain.world), state_hash(named.world));
    expect_data(&plain, NULL);
    sadmm_world_destroy(plain.world);
    sadmm_world_destroy(named.world);
}
END_TEST

/* However early memory runs out: the object is not there, or it is, with its name. */
START_TEST(memory_may_run_out)
{
    long successes = 0;
    sadmm_status status;
    do {
        const struct machine m = build(false);
        sadmm_coupling_def coupling = sadmm_coupling_def_default();
        sadmm_coupling_id id, found;
        coupling.body = m.bodies[1];
        coupling.name = "late";
        coupling.user_data = own;
        sadmm_test_fail_allocations_after(successes++);
        status = sadmm_world_add_coupling(m.world, &coupling, &id);
        sadmm_test_fail_allocations_after(-1);
        ck_assert(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY);
        ck_assert_int_eq(sadmm_world_coupling_count(m.world), status == SADMM_OK ? 2 : 1);
        const sadmm_status named = sadmm_world_coupling_named(m.world, "late", &found);
        ck_assert_int_eq(named == SADMM_OK, status == SADMM_OK);
        if (status != SADMM_OK) { /* what is added later has another name */
            coupling.name = "later";
            MUST(m.world, sadmm_world_add_coupling(m.world, &coupling, &id));
            ck_assert_str_eq(sadmm_world_coupling_name(m.world, id), "later");
        }
        sadmm_world_destroy(m.world);
    } while (status != SADMM_OK && successes < 100);
    ck_assert_int_ge(successes, 3); /* the name and the room for it are blocks of their own */
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("names");
    TCase *cases = tcase_create("names");
    tcase_add_test(cases, definitions_give_them);
    tcase_add_test(cases, user_data_is_set);
    tcase_add_test(cases, contacts_and_queries_lead_to_them);
    tcase_add_test(cases, they_go_with_their_objects);
    tcase_add_test(cases, a_name_is_of_one_object);
    tcase_add_test(cases, names_are_utf8);
    tcase_add_test(cases, saved_worlds_have_names);
    tcase_add_test(cases, errors_name_objects);
    tcase_add_test(cases, worlds_without_pay_nothing);
    tcase_add_test(cases, memory_may_run_out);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
