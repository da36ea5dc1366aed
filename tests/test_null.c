/* Every exported function takes NULL for every pointer: refused by name where the pointer is needed, a documented
 * answer where there is no status to return. The list of functions is the shared library's own, so that none can be
 * left out. */
#include <check.h>
#include <stdio.h>
#include <string.h>

#include "run_suite.h"
#include "subadmm/scenes.h"
#include "subadmm/subadmm.h"

static sadmm_world *world;
static sadmm_problem *problem;
static sadmm_body_id body;
static sadmm_shape_id shape;
static sadmm_joint_id joint;
static sadmm_coupling_id coupling;
static sadmm_gear_id gear;

/* The call is refused, and the message names the argument. */
#define REFUSES(name, call)                                                                                     \
    do {                                                                                                        \
        ck_assert_msg((call) == SADMM_ERROR_INVALID_ARGUMENT, "%s: not refused", #call);                        \
        ck_assert_msg(strstr(sadmm_last_message(), name " = NULL: must be given") != NULL, "%s: \"%s\"", #call, \
                      sadmm_last_message());                                                                    \
    } while (0)

static void on_worlds(void)
{
    sadmm_world *out;
    sadmm_world_def def = sadmm_world_def_default();
    REFUSES("out", sadmm_world_create(&def, NULL));
    REFUSES("def", sadmm_world_create(NULL, &out));
    ck_assert_ptr_null(out);
    sadmm_world_destroy(NULL);
    ck_assert_str_eq(sadmm_world_message(NULL), "");
    sadmm_settings settings = sadmm_world_settings(NULL);
    ck_assert(settings.dt == sadmm_settings_default().dt && settings.iterations == sadmm_settings_default().iterations);
    REFUSES("world", sadmm_world_set_settings(NULL, &settings));
    REFUSES("settings", sadmm_world_set_settings(world, NULL));
    REFUSES("world", sadmm_world_set_backend(NULL, SADMM_BACKEND_CPU, SADMM_F64, 0));
}

static void on_arrays(void)
{
    double values[13];
    int32_t index;
    sadmm_device_array device;
    ck_assert_int_eq(sadmm_array_columns(SADMM_ARRAY_BODY_STATE), 13);
    ck_assert(sadmm_array_is_settable(SADMM_ARRAY_BODY_STATE));
    ck_assert_int_eq(sadmm_world_array_rows(NULL, SADMM_ARRAY_BODY_STATE), 0);
    REFUSES("world", sadmm_world_get_array(NULL, SADMM_ARRAY_BODY_STATE, 0, 1, values));
    REFUSES("values", sadmm_world_get_array(world, SADMM_ARRAY_BODY_STATE, 0, 1, NULL));
    REFUSES("world", sadmm_world_set_array(NULL, SADMM_ARRAY_BODY_STATE, 0, 1, values));
    REFUSES("values", sadmm_world_set_array(world, SADMM_ARRAY_BODY_STATE, 0, 1, NULL));
    REFUSES("world", sadmm_world_body_index(NULL, body, &index));
    REFUSES("index", sadmm_world_body_index(world, body, NULL));
    REFUSES("world", sadmm_world_shape_index(NULL, shape, &index));
    REFUSES("index", sadmm_world_shape_index(world, shape, NULL));
    REFUSES("world", sadmm_world_joint_index(NULL, joint, &index));
    REFUSES("index", sadmm_world_joint_index(world, joint, NULL));
    REFUSES("world", sadmm_world_coupling_index(NULL, coupling, &index));
    REFUSES("index", sadmm_world_coupling_index(world, coupling, NULL));
    REFUSES("world", sadmm_world_device_array(NULL, SADMM_ARRAY_BODY_STATE, &device));
    REFUSES("out", sadmm_world_device_array(world, SADMM_ARRAY_BODY_STATE, NULL));
    REFUSES("world", sadmm_world_dynamic_bodies(NULL, &index, 1, &index));
    REFUSES("count", sadmm_world_dynamic_bodies(world, &index, 1, NULL));
    REFUSES("indices", sadmm_world_dynamic_bodies(world, NULL, 1, &index));
}

static void on_environments(void)
{
    sadmm_environments *environments, *none;
    sadmm_environments_array array;
    double values[64] = {0};
    char bytes[16];
    size_t size;
    int32_t state;
    REFUSES("world", sadmm_world_replicate(NULL, 1, &none));
    REFUSES("out", sadmm_world_replicate(world, 1, NULL));
    ck_assert_int_eq(sadmm_world_replicate(world, 1, &environments), SADMM_OK);
    sadmm_environments_destroy(NULL);
    ck_assert_str_eq(sadmm_environments_message(NULL), "");
    ck_assert_int_eq(sadmm_environments_count(NULL), 0);
    ck_assert_uint_eq(sadmm_environments_memory(NULL), 0);
    REFUSES("environments", sadmm_environments_step(NULL, 1));
    sadmm_settings settings = sadmm_environments_settings(NULL);
    ck_assert(settings.dt == sadmm_settings_default().dt);
    REFUSES("environments", sadmm_environments_set_settings(NULL, &settings));
    REFUSES("settings", sadmm_environments_set_settings(environments, NULL));
    REFUSES("environments", sadmm_environments_reset(NULL, NULL, 0, NULL));
    ck_assert_int_eq(sadmm_environments_reset(environments, NULL, 0, NULL), SADMM_OK); /* all */
    REFUSES("environments", sadmm_environments_keep(NULL, 0, &state));
    REFUSES("state", sadmm_environments_keep(environments, 0, NULL));
    REFUSES("environments", sadmm_environments_forget(NULL, 1));
    REFUSES("environments", sadmm_environments_save(NULL, 0, bytes, sizeof bytes, &size));
    REFUSES("size", sadmm_environments_save(environments, 0, bytes, sizeof bytes, NULL));
    REFUSES("buffer", sadmm_environments_save(environments, 0, NULL, sizeof bytes, &size));
    ck_assert_int_eq(sadmm_environments_rows(NULL, SADMM_ARRAY_BODY_STATE), 0);
    REFUSES("environments", sadmm_environments_get(NULL, SADMM_ARRAY_BODY_STATE, NULL, 0, values));
    REFUSES("values", sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, NULL));
    REFUSES("environments", sadmm_environments_set(NULL, SADMM_ARRAY_BODY_STATE, NULL, 0, values));
    REFUSES("values", sadmm_environments_set(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, NULL));
    REFUSES("environments", sadmm_environments_bind(NULL, SADMM_ARRAY_BODY_STATE, SADMM_F64, &array));
    REFUSES("out", sadmm_environments_bind(environments, SADMM_ARRAY_BODY_STATE, SADMM_F64, NULL));
    REFUSES("environments", sadmm_environments_set_stream(NULL, NULL));
    ck_assert_int_eq(sadmm_environments_set_stream(environments, NULL), SADMM_OK); /* the default one */
    ck_assert_ptr_null(sadmm_environments_marked(NULL));
    ck_assert_str_eq(sadmm_environments_mark(NULL, 0), "");
    const sadmm_contact *contacts;
    const sadmm_ray ray = {{0, 0, 1}, {0, 0, -1}, 10};
    sadmm_ray_hit hit;
    int32_t count;
    REFUSES("environments", sadmm_environments_record_contacts(NULL, true));
    ck_assert_int_eq(sadmm_environments_contacts(environments, 0, &contacts, &count), SADMM_ERROR_UNAVAILABLE);
    REFUSES("environments", sadmm_environments_contacts(NULL, 0, &contacts, &count));
    REFUSES("contacts", sadmm_environments_contacts(environments, 0, NULL, &count));
    REFUSES("count", sadmm_environments_contacts(environments, 0, &contacts, NULL));
    REFUSES("environments", sadmm_environments_cast_rays(NULL, NULL, 0, 1, &ray, NULL, &hit));
    REFUSES("rays", sadmm_environments_cast_rays(environments, NULL, 0, 1, NULL, NULL, &hit));
    REFUSES("hits", sadmm_environments_cast_rays(environments, NULL, 0, 1, &ray, NULL, NULL));
    sadmm_environments_destroy(environments);
}

static void on_saves(void)
{
    char bytes[16] = {0};
    size_t size;
    REFUSES("world", sadmm_world_save(NULL, bytes, sizeof bytes, &size));
    REFUSES("size", sadmm_world_save(world, bytes, sizeof bytes, NULL));
    REFUSES("buffer", sadmm_world_save(world, NULL, sizeof bytes, &size));
    REFUSES("world", sadmm_world_restore(NULL, bytes, sizeof bytes));
    REFUSES("buffer", sadmm_world_restore(world, NULL, 0));
}

/* Of what is alike for objects of all kinds. */
#define ON_TAGS(object)                                                          \
    do {                                                                         \
        sadmm_##object##_id found;                                               \
        REFUSES("world", sadmm_world_set_##object##_user_data(NULL, object, NULL)); \
        ck_assert_ptr_null(sadmm_world_##object##_user_data(NULL, object));      \
        ck_assert_str_eq(sadmm_world_##object##_name(NULL, object), "");         \
        REFUSES("world", sadmm_world_##object##_named(NULL, "a", &found));       \
        REFUSES("name", sadmm_world_##object##_named(world, NULL, &found));      \
        REFUSES("id", sadmm_world_##object##_named(world, "a", NULL));           \
    } while (0)
#define TAGS(object) W(object##_name), W(object##_named), W(object##_user_data), W(set_##object##_user_data)

static void on_bodies(void)
{
    const double three[3] = {0};
    double six[6];
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_state state;
    sadmm_body_id id;
    def.type = SADMM_BODY_STATIC;
    REFUSES("world", sadmm_world_add_body(NULL, &def, &id));
    REFUSES("def", sadmm_world_add_body(world, NULL, &id));
    REFUSES("id", sadmm_world_add_body(world, &def, NULL));
    REFUSES("world", sadmm_world_remove_body(NULL, body));
    ck_assert_int_eq(sadmm_world_body_count(NULL), 0);
    REFUSES("world", sadmm_world_body_at(NULL, 0, &id));
    REFUSES("id", sadmm_world_body_at(world, 0, NULL));
    REFUSES("world", sadmm_world_body_state(NULL, body, &state));
    REFUSES("state", sadmm_world_body_state(world, body, NULL));
    REFUSES("world", sadmm_world_set_body_state(NULL, body, &state));
    REFUSES("state", sadmm_world_set_body_state(world, body, NULL));
    REFUSES("world", sadmm_world_body_def(NULL, body, &def));
    REFUSES("def", sadmm_world_body_def(world, body, NULL));
    REFUSES("world", sadmm_world_set_body_wrench(NULL, body, three, three));
    REFUSES("force", sadmm_world_set_body_wrench(world, body, NULL, three));
    REFUSES("torque", sadmm_world_set_body_wrench(world, body, three, NULL));
    REFUSES("world", sadmm_world_add_body_force_at(NULL, body, three, three));
    REFUSES("force", sadmm_world_add_body_force_at(world, body, NULL, three));
    REFUSES("point", sadmm_world_add_body_force_at(world, body, three, NULL));
    REFUSES("world", sadmm_world_apply_body_impulse_at(NULL, body, three, three));
    REFUSES("impulse", sadmm_world_apply_body_impulse_at(world, body, NULL, three));
    REFUSES("point", sadmm_world_apply_body_impulse_at(world, body, three, NULL));
    REFUSES("world", sadmm_world_set_body_mass(NULL, body, 1, three));
    REFUSES("inertia", sadmm_world_set_body_mass(world, body, 1, NULL));
    ON_TAGS(body);
    REFUSES("world", sadmm_world_set_body_gravity_scale(NULL, body, 1));
    REFUSES("world", sadmm_world_set_body_damping(NULL, body, 0, 0));
    REFUSES("world", sadmm_world_move_body(NULL, body, three, six));
    REFUSES("position", sadmm_world_move_body(world, body, NULL, six));
    REFUSES("orientation", sadmm_world_move_body(world, body, three, NULL));
    REFUSES("world", sadmm_world_body_contact_wrench(NULL, body, six));
    REFUSES("wrench", sadmm_world_body_contact_wrench(world, body, NULL));
    REFUSES("world", sadmm_world_set_body_pair_contact(NULL, body, body, true));
    bool pending;
    REFUSES("world", sadmm_world_body_wrench(NULL, body, six, six + 3));
    REFUSES("force", sadmm_world_body_wrench(world, body, NULL, six));
    REFUSES("torque", sadmm_world_body_wrench(world, body, six, NULL));
    REFUSES("world", sadmm_world_body_move(NULL, body, &pending, six, six));
    REFUSES("pending", sadmm_world_body_move(world, body, NULL, six, six));
    REFUSES("position", sadmm_world_body_move(world, body, &pending, NULL, six));
    REFUSES("orientation", sadmm_world_body_move(world, body, &pending, six, NULL));
    ck_assert_int_eq(sadmm_world_body_pair_off_count(NULL), 0);
    REFUSES("world", sadmm_world_body_pair_off_at(NULL, 0, &id, &id));
    REFUSES("a", sadmm_world_body_pair_off_at(world, 0, NULL, &id));
    REFUSES("b", sadmm_world_body_pair_off_at(world, 0, &id, NULL));
}

static void on_shapes(void)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_shape_id id;
    REFUSES("world", sadmm_world_add_shape(NULL, body, &def, &id));
    REFUSES("def", sadmm_world_add_shape(world, body, NULL, &id));
    REFUSES("world", sadmm_world_remove_shape(NULL, shape));
    ON_TAGS(shape);
    ck_assert_int_eq(sadmm_world_shape_count(NULL), 0);
    REFUSES("world", sadmm_world_shape_at(NULL, 0, &id));
    REFUSES("id", sadmm_world_shape_at(world, 0, NULL));
    REFUSES("world", sadmm_world_shape_def(NULL, shape, &def, NULL));
    REFUSES("def", sadmm_world_shape_def(world, shape, NULL, NULL));
    ck_assert_int_eq(sadmm_world_shape_def(world, shape, &def, NULL), SADMM_OK); /* body may be NULL */
    REFUSES("world", sadmm_world_set_shape_material(NULL, shape, 0.5, 0));
    const double unit[4] = {1, 0, 0, 0};
    REFUSES("world", sadmm_world_set_shape_surface_velocity(NULL, shape, unit));
    REFUSES("velocity", sadmm_world_set_shape_surface_velocity(world, shape, NULL));
    REFUSES("world", sadmm_world_set_manifold_callback(NULL, NULL, NULL));
    REFUSES("world", sadmm_world_set_shape_size(NULL, shape, unit));
    REFUSES("size", sadmm_world_set_shape_size(world, shape, NULL));
    REFUSES("world", sadmm_world_set_shape_frame(NULL, shape, unit, unit));
    REFUSES("position", sadmm_world_set_shape_frame(world, shape, NULL, unit));
    REFUSES("orientation", sadmm_world_set_shape_frame(world, shape, unit, NULL));
    REFUSES("world", sadmm_world_set_pair_friction(NULL, shape, shape, 1));
    double friction;
    ck_assert_int_eq(sadmm_world_pair_friction_count(NULL), 0);
    REFUSES("world", sadmm_world_pair_friction_at(NULL, 0, &id, &id, &friction));
    REFUSES("a", sadmm_world_pair_friction_at(world, 0, NULL, &id, &friction));
    REFUSES("b", sadmm_world_pair_friction_at(world, 0, &id, NULL, &friction));
    REFUSES("friction", sadmm_world_pair_friction_at(world, 0, &id, &id, NULL));
}

static void on_joints(void)
{
    const double zero[3] = {0}, unit[4] = {1, 0, 0, 0};
    const sadmm_joint_coordinate coordinate = {0};
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_joint_state state;
    sadmm_joint_id id;
    REFUSES("world", sadmm_world_place_joint(NULL, &def, zero, unit));
    REFUSES("def", sadmm_world_place_joint(world, NULL, zero, unit));
    REFUSES("position", sadmm_world_place_joint(world, &def, NULL, unit));
    REFUSES("orientation", sadmm_world_place_joint(world, &def, zero, NULL));
    REFUSES("world", sadmm_world_add_joint(NULL, &def, &id));
    REFUSES("def", sadmm_world_add_joint(world, NULL, &id));
    REFUSES("world", sadmm_world_remove_joint(NULL, joint));
    ON_TAGS(joint);
    ck_assert_int_eq(sadmm_world_joint_count(NULL), 0);
    REFUSES("world", sadmm_world_joint_at(NULL, 0, &id));
    REFUSES("id", sadmm_world_joint_at(world, 0, NULL));
    REFUSES("world", sadmm_world_joint_def(NULL, joint, &def));
    REFUSES("def", sadmm_world_joint_def(world, joint, NULL));
    REFUSES("world", sadmm_world_set_joint_enabled(NULL, joint, false));
    REFUSES("world", sadmm_world_set_joint_coordinate(NULL, joint, 2, &coordinate));
    REFUSES("coordinate", sadmm_world_set_joint_coordinate(world, joint, 2, NULL));
    REFUSES("world", sadmm_world_joint_state(NULL, joint, &state));
    REFUSES("state", sadmm_world_joint_state(world, joint, NULL));
    const double two[2] = {0, 1};
    int32_t count;
    REFUSES("world", sadmm_world_set_joint_spring_table(NULL, joint, 2, two, two, 2));
    REFUSES("positions", sadmm_world_set_joint_spring_table(world, joint, 2, NULL, two, 2));
    REFUSES("forces", sadmm_world_set_joint_spring_table(world, joint, 2, two, NULL, 2));
    REFUSES("world", sadmm_world_joint_spring_table(NULL, joint, 2, NULL, NULL, &count));
    REFUSES("count", sadmm_world_joint_spring_table(world, joint, 2, NULL, NULL, NULL));
    ck_assert_int_eq(sadmm_world_joint_spring_table(world, joint, 2, NULL, NULL, &count), SADMM_OK);
}

static void on_couplings(void)
{
    const double zero[3] = {0}, unit[4] = {1, 0, 0, 0};
    sadmm_coupling_def def = sadmm_coupling_def_default();
    sadmm_coupling_state state;
    sadmm_coupling_id id;
    REFUSES("world", sadmm_world_add_coupling(NULL, &def, &id));
    REFUSES("def", sadmm_world_add_coupling(world, NULL, &id));
    REFUSES("world", sadmm_world_remove_coupling(NULL, coupling));
    ON_TAGS(coupling);
    ck_assert_int_eq(sadmm_world_coupling_count(NULL), 0);
    REFUSES("world", sadmm_world_coupling_at(NULL, 0, &id));
    REFUSES("id", sadmm_world_coupling_at(world, 0, NULL));
    REFUSES("world", sadmm_world_coupling_def(NULL, coupling, &def));
    REFUSES("def", sadmm_world_coupling_def(world, coupling, NULL));
    REFUSES("world", sadmm_world_set_coupling_target(NULL, coupling, zero, unit, NULL));
    REFUSES("position", sadmm_world_set_coupling_target(world, coupling, NULL, unit, NULL));
    REFUSES("orientation", sadmm_world_set_coupling_target(world, coupling, zero, NULL, NULL));
    REFUSES("world", sadmm_world_set_coupling_gains(NULL, coupling, 1, 1, 1, 1));
    REFUSES("world", sadmm_world_set_coupling_limits(NULL, coupling, 1, 1));
    REFUSES("world", sadmm_world_set_coupling_enabled(NULL, coupling, false));
    REFUSES("world", sadmm_world_coupling_state(NULL, coupling, &state));
    REFUSES("state", sadmm_world_coupling_state(world, coupling, NULL));
}

static void on_gears(void)
{
    sadmm_gear_def def = sadmm_gear_def_default();
    sadmm_gear_state state;
    sadmm_gear_id id;
    REFUSES("world", sadmm_world_add_gear(NULL, &def, &id));
    REFUSES("def", sadmm_world_add_gear(world, NULL, &id));
    REFUSES("world", sadmm_world_remove_gear(NULL, gear));
    ON_TAGS(gear);
    ck_assert_int_eq(sadmm_world_gear_count(NULL), 0);
    REFUSES("world", sadmm_world_gear_at(NULL, 0, &id));
    REFUSES("id", sadmm_world_gear_at(world, 0, NULL));
    REFUSES("world", sadmm_world_gear_def(NULL, gear, &def));
    REFUSES("def", sadmm_world_gear_def(world, gear, NULL));
    REFUSES("world", sadmm_world_set_gear_enabled(NULL, gear, false));
    REFUSES("world", sadmm_world_gear_state(NULL, gear, &state));
    REFUSES("state", sadmm_world_gear_state(world, gear, NULL));
}

static void on_queries(void)
{
    const double zero[3] = {0}, unit[4] = {1, 0, 0, 0};
    const sadmm_ray ray = {{0, 0, 0}, {0, 0, 1}, 1};
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_closest_points closest;
    sadmm_shape_id id;
    sadmm_ray_hit hit;
    int32_t count;
    def.size[0] = 1;
    REFUSES("world", sadmm_world_cast_ray(NULL, &ray, NULL, &hit));
    REFUSES("ray", sadmm_world_cast_ray(world, NULL, NULL, &hit));
    REFUSES("hit", sadmm_world_cast_ray(world, &ray, NULL, NULL));
    ck_assert_int_eq(sadmm_world_cast_ray(world, &ray, NULL, &hit), SADMM_OK); /* filter may be NULL */
    REFUSES("world", sadmm_world_cast_ray_all(NULL, &ray, NULL, 1, &hit, &count));
    REFUSES("ray", sadmm_world_cast_ray_all(world, NULL, NULL, 1, &hit, &count));
    REFUSES("hits", sadmm_world_cast_ray_all(world, &ray, NULL, 1, NULL, &count));
    REFUSES("count", sadmm_world_cast_ray_all(world, &ray, NULL, 1, &hit, NULL));
    ck_assert_int_eq(sadmm_world_cast_ray_all(world, &ray, NULL, 0, NULL, &count), SADMM_OK);
    REFUSES("world", sadmm_world_cast_rays(NULL, 1, &ray, NULL, &hit));
    REFUSES("rays", sadmm_world_cast_rays(world, 1, NULL, NULL, &hit));
    REFUSES("hits", sadmm_world_cast_rays(world, 1, &ray, NULL, NULL));
    ck_assert_int_eq(sadmm_world_cast_rays(world, 0, NULL, NULL, NULL), SADMM_OK);
    REFUSES("world", sadmm_world_cast_shape(NULL, &def, zero, unit, ray.direction, 1, NULL, &hit));
    REFUSES("def", sadmm_world_cast_shape(world, NULL, zero, unit, ray.direction, 1, NULL, &hit));
    REFUSES("position", sadmm_world_cast_shape(world, &def, NULL, unit, ray.direction, 1, NULL, &hit));
    REFUSES("orientation", sadmm_world_cast_shape(world, &def, zero, NULL, ray.direction, 1, NULL, &hit));
    REFUSES("direction", sadmm_world_cast_shape(world, &def, zero, unit, NULL, 1, NULL, &hit));
    REFUSES("hit", sadmm_world_cast_shape(world, &def, zero, unit, ray.direction, 1, NULL, NULL));
    ck_assert_int_eq(sadmm_world_cast_shape(world, &def, zero, unit, ray.direction, 1, NULL, &hit), SADMM_OK);
    REFUSES("world", sadmm_world_overlap_box(NULL, zero, zero, NULL, 1, &id, &count));
    REFUSES("lowest", sadmm_world_overlap_box(world, NULL, zero, NULL, 1, &id, &count));
    REFUSES("highest", sadmm_world_overlap_box(world, zero, NULL, NULL, 1, &id, &count));
    REFUSES("shapes", sadmm_world_overlap_box(world, zero, zero, NULL, 1, NULL, &count));
    REFUSES("count", sadmm_world_overlap_box(world, zero, zero, NULL, 1, &id, NULL));
    ck_assert_int_eq(sadmm_world_overlap_box(world, zero, zero, NULL, 0, NULL, &count), SADMM_OK);
    REFUSES("world", sadmm_world_overlap_shape(NULL, &def, zero, unit, NULL, 1, &id, &count));
    REFUSES("def", sadmm_world_overlap_shape(world, NULL, zero, unit, NULL, 1, &id, &count));
    REFUSES("position", sadmm_world_overlap_shape(world, &def, NULL, unit, NULL, 1, &id, &count));
    REFUSES("orientation", sadmm_world_overlap_shape(world, &def, zero, NULL, NULL, 1, &id, &count));
    REFUSES("shapes", sadmm_world_overlap_shape(world, &def, zero, unit, NULL, 1, NULL, &count));
    REFUSES("count", sadmm_world_overlap_shape(world, &def, zero, unit, NULL, 1, &id, NULL));
    ck_assert_int_eq(sadmm_world_overlap_shape(world, &def, zero, unit, NULL, 0, NULL, &count), SADMM_OK);
    REFUSES("world", sadmm_world_closest_points(NULL, shape, shape, &closest));
    for (int32_t i = 0; i < 2; ++i) {
        ck_assert_int_eq(sadmm_world_shape_at(world, i, &id), SADMM_OK);
        if (id.slot != shape.slot) REFUSES("closest", sadmm_world_closest_points(world, shape, id, NULL));
    }
    REFUSES("world", sadmm_world_closest_to_shape(NULL, &def, zero, unit, shape, &closest));
    REFUSES("def", sadmm_world_closest_to_shape(world, NULL, zero, unit, shape, &closest));
    REFUSES("position", sadmm_world_closest_to_shape(world, &def, NULL, unit, shape, &closest));
    REFUSES("orientation", sadmm_world_closest_to_shape(world, &def, zero, NULL, shape, &closest));
    REFUSES("closest", sadmm_world_closest_to_shape(world, &def, zero, unit, shape, NULL));
    ck_assert(sadmm_query_filter_default().body_types == 7);
}

static void on_drawing(void)
{
    const sadmm_draw draw = sadmm_draw_default(); /* all callbacks are NULL: nothing is drawn */
    REFUSES("world", sadmm_world_debug_draw(NULL, &draw));
    ck_assert_int_eq(sadmm_world_debug_draw(world, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_debug_draw(world, &draw), SADMM_OK);
    REFUSES("world", sadmm_world_prepare_draw(NULL));
}

static void on_events(void)
{
    sadmm_event event;
    sadmm_shape_id id, sensor;
    sadmm_shape_def def = sadmm_shape_def_default();
    int32_t count;
    def.size[0] = 1;
    def.sensor = true;
    ck_assert_int_eq(sadmm_world_add_shape(world, body, &def, &sensor), SADMM_OK);
    REFUSES("world", sadmm_world_record_events(NULL, 1));
    ck_assert_int_eq(sadmm_world_event_capacity(NULL), 0);
    ck_assert_int_eq(sadmm_world_event_count(NULL), 0);
    REFUSES("world", sadmm_world_take_events(NULL, 1, &event, &count, NULL));
    REFUSES("events", sadmm_world_take_events(world, 1, NULL, &count, NULL));
    REFUSES("count", sadmm_world_take_events(world, 1, &event, NULL, NULL));
    ck_assert_int_eq(sadmm_world_take_events(world, 0, NULL, &count, NULL), SADMM_OK);
    REFUSES("world", sadmm_world_sensor_overlaps(NULL, sensor, 1, &id, &count));
    REFUSES("shapes", sadmm_world_sensor_overlaps(world, sensor, 1, NULL, &count));
    REFUSES("count", sadmm_world_sensor_overlaps(world, sensor, 1, &id, NULL));
    ck_assert_int_eq(sadmm_world_sensor_overlaps(world, sensor, 0, NULL, &count), SADMM_OK);
}

static void on_steps(void)
{
    sadmm_step_report report;
    sadmm_contact contact;
    uint64_t hash;
    char text[4] = "abc";
    REFUSES("world", sadmm_world_step(NULL));
    REFUSES("world", sadmm_world_step_async(NULL));
    REFUSES("world", sadmm_world_wait(NULL));
    REFUSES("world", sadmm_world_report(NULL, &report));
    REFUSES("report", sadmm_world_report(world, NULL));
    ck_assert_int_eq(sadmm_world_contact_count(NULL), 0);
    REFUSES("world", sadmm_world_contacts(NULL, 0, 1, &contact));
    ck_assert_int_gt(sadmm_world_contact_count(world), 0);
    REFUSES("contacts", sadmm_world_contacts(world, 0, 1, NULL));
    REFUSES("world", sadmm_world_contact_errors(NULL, 0, 1, &contact.separation));
    REFUSES("errors", sadmm_world_contact_errors(world, 0, 1, NULL));
    REFUSES("world", sadmm_world_state_hash(NULL, &hash));
    REFUSES("hash", sadmm_world_state_hash(world, NULL));
    ck_assert_uint_eq(sadmm_world_explain(NULL, text, sizeof text), 0);
    ck_assert_str_eq(text, "");
    ck_assert_uint_eq(sadmm_world_explain(NULL, NULL, 0), 0);
    ck_assert_uint_gt(sadmm_world_explain(world, NULL, 0), 100);
    ck_assert_uint_gt(sadmm_world_explain(world, NULL, 100), 100); /* no text: nothing is written, whatever the size */
    REFUSES("world", sadmm_world_freeze(NULL, problem));
    REFUSES("problem", sadmm_world_freeze(world, NULL));
}

static void on_problems(void)
{
    double x[36] = {0};
    sadmm_problem_contact contact = {.body_a = -1, .normal = {1, 0, 0}};
    sadmm_problem_block block = {.kind = SADMM_BLOCK_HARD, .rows = 1, .body_a = -1, .jacobian_b = {1}};
    sadmm_certificate certificate;
    sadmm_settings settings = sadmm_settings_default();
    REFUSES("out", sadmm_problem_create(NULL));
    sadmm_problem_destroy(NULL);
    ck_assert_str_eq(sadmm_problem_message(NULL), "");
    for (int i = 0; i < 6; ++i) x[7 * i] = 1;
    REFUSES("problem", sadmm_problem_set_bodies(NULL, 1, x, x, x));
    REFUSES("A", sadmm_problem_set_bodies(problem, 1, NULL, x, x));
    REFUSES("b", sadmm_problem_set_bodies(problem, 1, x, NULL, x));
    ck_assert_int_eq(sadmm_problem_set_bodies(problem, 1, x, x, NULL), SADMM_OK);
    REFUSES("problem", sadmm_problem_set_contacts(NULL, 1, &contact, x));
    REFUSES("contacts", sadmm_problem_set_contacts(problem, 1, NULL, x));
    ck_assert_int_eq(sadmm_problem_set_contacts(problem, 1, &contact, NULL), SADMM_OK);
    REFUSES("problem", sadmm_problem_set_blocks(NULL, 1, &block, x));
    REFUSES("blocks", sadmm_problem_set_blocks(problem, 1, NULL, x));
    ck_assert_int_eq(sadmm_problem_set_blocks(problem, 1, &block, NULL), SADMM_OK);
    ck_assert(sadmm_problem_body_count(NULL) == 0 && sadmm_problem_contact_count(NULL) == 0 &&
              sadmm_problem_block_count(NULL) == 0);
    REFUSES("problem", sadmm_problem_get_bodies(NULL, x, x, x));
    ck_assert_int_eq(sadmm_problem_get_bodies(problem, NULL, NULL, NULL), SADMM_OK);
    REFUSES("problem", sadmm_problem_get_contact(NULL, 0, &contact));
    REFUSES("contact", sadmm_problem_get_contact(problem, 0, NULL));
    REFUSES("problem", sadmm_problem_get_block(NULL, 0, &block));
    REFUSES("block", sadmm_problem_get_block(problem, 0, NULL));
    REFUSES("problem", sadmm_problem_set_device(NULL, 0));
    REFUSES("problem", sadmm_problem_set_tasks(NULL, NULL));
    ck_assert_int_eq(sadmm_problem_set_tasks(problem, NULL), SADMM_OK); /* the default */
    REFUSES("problem", sadmm_problem_solve(NULL, SADMM_BACKEND_CPU, SADMM_F64, &settings, NULL));
    REFUSES("settings", sadmm_problem_solve(problem, SADMM_BACKEND_CPU, SADMM_F64, NULL, NULL));
    ck_assert_int_eq(sadmm_problem_solve(problem, SADMM_BACKEND_CPU, SADMM_F64, &settings, NULL), SADMM_OK);
    REFUSES("problem", sadmm_problem_get_solution(NULL, x, x, x));
    ck_assert_int_eq(sadmm_problem_get_solution(problem, NULL, NULL, NULL), SADMM_OK);
    REFUSES("problem", sadmm_problem_set_solution(NULL, x, x, x));
    ck_assert_int_eq(sadmm_problem_set_solution(problem, NULL, NULL, NULL), SADMM_OK);
    REFUSES("problem", sadmm_problem_certify(NULL, &certificate));
    REFUSES("certificate", sadmm_problem_certify(problem, NULL));
}

static void on_others(void)
{
    double inertia[3] = {7, 7, 7};
    const double half[3] = {1, 1, 1};
    REFUSES("info", sadmm_backend_query(SADMM_BACKEND_REF, NULL));
    sadmm_box_inertia(1, NULL, inertia);
    sadmm_box_inertia(1, half, NULL);
    sadmm_sphere_inertia(1, 1, NULL);
    sadmm_capsule_inertia(1, 1, 1, NULL);
    for (int k = 0; k < 3; ++k) ck_assert(inertia[k] == 7);
}

/* Where hulls can be made; elsewhere that is said. */
static void on_hulls(void)
{
    static const double corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_hull *hull;
    sadmm_hull_face face;
    sadmm_mass mass;
    def.point_count = 4;
    REFUSES("out", sadmm_hull_create(&def, NULL));
    REFUSES("def", sadmm_hull_create(NULL, &hull));
    REFUSES("def->points", sadmm_hull_create(&def, &hull));
    ck_assert_ptr_null(hull);
    sadmm_hull_destroy(NULL);
    ck_assert_int_eq(sadmm_hull_vertex_count(NULL), 0);
    ck_assert_int_eq(sadmm_hull_edge_count(NULL), 0);
    ck_assert_int_eq(sadmm_hull_face_count(NULL), 0);
    ck_assert_ptr_null(sadmm_hull_vertices(NULL));
    ck_assert_double_eq(sadmm_hull_convex_radius(NULL), 0);
    ck_assert_double_eq(sadmm_hull_merge(NULL), 0);
    REFUSES("hull", sadmm_hull_face_at(NULL, 0, &face));
    REFUSES("hull", sadmm_hull_mass(NULL, 1, &mass));
    def.points = corners;
    const sadmm_status status = sadmm_hull_create(&def, &hull);
    if (status != SADMM_OK) {
        ck_assert_int_eq(status, SADMM_ERROR_UNAVAILABLE);
        ck_assert_ptr_nonnull(strstr(sadmm_last_message(), "qhull"));
        return;
    }
    REFUSES("out", sadmm_hull_face_at(hull, 0, NULL));
    REFUSES("mass", sadmm_hull_mass(hull, 1, NULL));
    sadmm_hull_destroy(hull);
}

static void on_meshes(void)
{
    const double zeros[4] = {0};
    const int32_t corners[3] = {0, 1, 2};
    const sadmm_mesh_def def = sadmm_mesh_def_default(), no_triangles = {sizeof def, zeros, 3, NULL, 1},
                         no_vertices = {sizeof def, NULL, 3, corners, 1};
    const sadmm_heightfield_def field = sadmm_heightfield_def_default();
    sadmm_mesh *mesh = NULL;
    double lowest[3], highest[3];
    int32_t corner[3], number;
    REFUSES("out", sadmm_mesh_create(&def, NULL));
    REFUSES("def", sadmm_mesh_create(NULL, &mesh));
    REFUSES("def->vertices", sadmm_mesh_create(&no_vertices, &mesh));
    REFUSES("def->triangles", sadmm_mesh_create(&no_triangles, &mesh));
    REFUSES("out", sadmm_heightfield_create(&field, NULL));
    REFUSES("def", sadmm_heightfield_create(NULL, &mesh));
    REFUSES("def->heights", sadmm_heightfield_create(&field, &mesh));
    ck_assert_ptr_null(mesh);
    REFUSES("mesh", sadmm_mesh_bounds(NULL, lowest, highest));
    REFUSES("mesh", sadmm_mesh_vertex_at(NULL, 0, lowest));
    REFUSES("mesh", sadmm_mesh_triangle_at(NULL, 0, corner, &number));
    REFUSES("mesh", sadmm_mesh_grid(NULL, &number, &number, lowest));
    ck_assert_int_eq(sadmm_mesh_vertex_count(NULL), 0);
    sadmm_mesh_destroy(NULL);
    ck_assert_int_eq(sadmm_mesh_triangle_count(NULL), 0);
    ck_assert_int_eq(sadmm_mesh_left_out(NULL), 0);
    ck_assert_int_eq(sadmm_mesh_open_edges(NULL), 0);
    ck_assert_uint_eq(sadmm_mesh_bytes(NULL), 0);
}

static void on_mesh_files(void)
{
    sadmm_mesh_file_def def = sadmm_mesh_file_def_default();
    sadmm_mesh_file *file;
    sadmm_mesh_file_info info;
    def.bytes = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    def.size = strlen((const char *)def.bytes);
    REFUSES("out", sadmm_mesh_file_read(&def, NULL));
    REFUSES("def", sadmm_mesh_file_read(NULL, &file));
    ck_assert_ptr_null(file);
    sadmm_mesh_file_destroy(NULL);
    ck_assert_int_eq(sadmm_mesh_file_vertex_count(NULL), 0);
    ck_assert_int_eq(sadmm_mesh_file_triangle_count(NULL), 0);
    ck_assert_ptr_null(sadmm_mesh_file_vertices(NULL));
    ck_assert_ptr_null(sadmm_mesh_file_triangles(NULL));
    REFUSES("file", sadmm_mesh_file_describe(NULL, &info));
    ck_assert_int_eq(sadmm_mesh_file_read(&def, &file), SADMM_OK);
    REFUSES("info", sadmm_mesh_file_describe(file, NULL));
    sadmm_mesh_file_destroy(file);
}

static void on_masses(void)
{
    double position[3] = {0}, orientation[4] = {1};
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_mass mass = {.mass = 1, .orientation = {1}};
    def.size[0] = 1;
    REFUSES("def", sadmm_shape_mass(NULL, 1, &mass));
    REFUSES("mass", sadmm_shape_mass(&def, 1, NULL));
    REFUSES("parts", sadmm_mass_sum(NULL, 1, &mass));
    REFUSES("sum", sadmm_mass_sum(&mass, 1, NULL));
    REFUSES("mass", sadmm_mass_pose_in_body(NULL, position, orientation));
    REFUSES("position", sadmm_mass_pose_in_body(&mass, NULL, orientation));
    REFUSES("orientation", sadmm_mass_pose_in_body(&mass, position, NULL));
    REFUSES("mass", sadmm_mass_pose_of_body(NULL, position, orientation));
    REFUSES("position", sadmm_mass_pose_of_body(&mass, NULL, orientation));
    REFUSES("orientation", sadmm_mass_pose_of_body(&mass, position, NULL));
}

static void on_scenes(void)
{
    sadmm_scene *scene;
    sadmm_world_def def;
    sadmm_world *made;
    size_t size;
    ck_assert_int_ge(sadmm_scene_library_count(), 0);
    if (sadmm_scene_library_count() == 0) return; /* a build without scenes: all calls are refused as such */
    ck_assert_int_eq(sadmm_scene_library_at(0, NULL, NULL, NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_scene_create(NULL, &scene), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_last_message(), "scene = NULL: must be a string");
    REFUSES("out", sadmm_scene_create("incline", NULL));
    REFUSES("text", sadmm_scene_create_from_text(NULL, 1, "a text", &scene));
    REFUSES("out", sadmm_scene_create_from_text("{}", 2, NULL, NULL));
    sadmm_scene_destroy(NULL);
    ck_assert_ptr_null(sadmm_scene_name(NULL));
    ck_assert_ptr_null(sadmm_scene_description(NULL));
    ck_assert_double_eq(sadmm_scene_duration(NULL), 0);
    REFUSES("scene", sadmm_scene_choose_method(NULL, SADMM_METHOD_FAST));
    REFUSES("scene", sadmm_scene_world_def(NULL, &def));
    REFUSES("scene", sadmm_scene_create_world(NULL, NULL, &made));
    REFUSES("scene", sadmm_scene_run_script(NULL, world, 0));
    ck_assert(!sadmm_scene_is_scripted(NULL));
    REFUSES("world", sadmm_scene_write_text(NULL, NULL, NULL, 0, &size));
    ck_assert_int_eq(sadmm_scene_create("incline", &scene), SADMM_OK);
    REFUSES("def", sadmm_scene_world_def(scene, NULL));
    REFUSES("out", sadmm_scene_create_world(scene, NULL, NULL));
    REFUSES("world", sadmm_scene_run_script(scene, NULL, 0));
    REFUSES("size", sadmm_scene_write_text(scene, world, NULL, 0, NULL));
    sadmm_scene_destroy(scene);
}

/* Nothing is written. */
static void on_defaults(void)
{
    sadmm_settings_init(NULL, sizeof(sadmm_settings));
    sadmm_world_def_init(NULL, sizeof(sadmm_world_def), sizeof(sadmm_settings));
    sadmm_body_def_init(NULL, sizeof(sadmm_body_def));
    sadmm_shape_def_init(NULL, sizeof(sadmm_shape_def));
    sadmm_hull_def_init(NULL, sizeof(sadmm_hull_def));
    sadmm_joint_def_init(NULL, sizeof(sadmm_joint_def), sizeof(sadmm_joint_coordinate));
    sadmm_coupling_def_init(NULL, sizeof(sadmm_coupling_def));
    sadmm_gear_def_init(NULL, sizeof(sadmm_gear_def));
    sadmm_mesh_def_init(NULL, sizeof(sadmm_mesh_def));
    sadmm_heightfield_def_init(NULL, sizeof(sadmm_heightfield_def));
    sadmm_mesh_file_def_init(NULL, sizeof(sadmm_mesh_file_def));
    sadmm_query_filter_init(NULL, sizeof(sadmm_query_filter));
    sadmm_draw_init(NULL, sizeof(sadmm_draw));
}

/* By the function that passes NULL to them; those without a pointer have none. */
#define P(name) "sadmm_problem_" #name
#define W(name) "sadmm_world_" #name
static const struct {
    void (*pass_null)(void);
    const char *names[26];
} functions[] = {
    {on_worlds, {W(create), W(destroy), W(message), W(settings_sized), W(set_settings), W(set_backend)}},
    {on_bodies,
     {W(add_body),
      W(remove_body),
      W(body_count),
      W(body_at),
      W(body_state),
      W(set_body_state),
      W(body_def_sized),
      W(set_body_wrench),
      W(add_body_force_at),
      W(apply_body_impulse_at),
      W(set_body_mass),
      TAGS(body),
      W(set_body_gravity_scale),
      W(set_body_damping),
      W(move_body),
      W(body_contact_wrench),
      W(set_body_pair_contact),
      W(body_wrench),
      W(body_move),
      W(body_pair_off_count),
      W(body_pair_off_at)}},
    {on_shapes,
     {W(add_shape), W(remove_shape), W(shape_count), W(shape_at), W(shape_def_sized), W(set_shape_material),
      W(set_shape_surface_velocity), W(set_manifold_callback), W(set_shape_size), W(set_shape_frame),
      W(set_pair_friction), W(pair_friction_count), W(pair_friction_at),
      TAGS(shape)}},
    {on_joints,
     {W(place_joint), W(add_joint), W(remove_joint), W(joint_count), W(joint_at), W(joint_def_sized),
      W(set_joint_enabled), W(set_joint_coordinate_sized), W(joint_state), W(set_joint_spring_table),
      W(joint_spring_table), TAGS(joint)}},
    {on_couplings,
     {W(add_coupling), W(remove_coupling), W(coupling_count), W(coupling_at), W(coupling_def_sized),
      W(set_coupling_target), W(set_coupling_gains), W(set_coupling_limits), W(set_coupling_enabled),
      W(coupling_state), TAGS(coupling)}},
    {on_arrays,
     {"sadmm_array_columns", "sadmm_array_is_settable", W(array_rows), W(get_array), W(set_array), W(body_index),
      W(shape_index), W(joint_index), W(coupling_index), W(device_array), W(dynamic_bodies)}},
    {on_saves, {W(save), W(restore)}},
    {on_gears,
     {W(add_gear), W(remove_gear), W(gear_count), W(gear_at), W(gear_def_sized), W(set_gear_enabled), W(gear_state),
      TAGS(gear)}},
    {on_queries,
     {W(cast_ray), W(cast_ray_all), W(cast_rays), W(cast_shape), W(overlap_box), W(overlap_shape),
      W(closest_points), W(closest_to_shape)}},
    {on_drawing, {W(debug_draw), W(prepare_draw)}},
    {on_events, {W(record_events), W(event_capacity), W(event_count), W(take_events), W(sensor_overlaps)}},
    {on_steps,
     {W(step), W(step_async), W(wait), W(report_sized), W(contact_count), W(contacts), W(contact_errors), W(state_hash),
      W(explain), W(freeze)}},
    {on_problems,
     {P(create), P(destroy), P(message), P(set_bodies), P(set_contacts), P(set_blocks), P(body_count), P(contact_count),
      P(block_count), P(get_bodies), P(get_contact), P(get_block), P(set_device), P(set_tasks), P(solve_sized),
      P(get_solution), P(set_solution), P(certify)}},
    {on_hulls,
     {"sadmm_hull_create", "sadmm_hull_destroy", "sadmm_hull_vertex_count", "sadmm_hull_edge_count",
      "sadmm_hull_face_count", "sadmm_hull_vertices", "sadmm_hull_convex_radius", "sadmm_hull_merge",
      "sadmm_hull_face_at", "sadmm_hull_mass"}},
    {on_meshes,
     {"sadmm_mesh_create", "sadmm_heightfield_create", "sadmm_mesh_destroy", "sadmm_mesh_triangle_count",
      "sadmm_mesh_left_out", "sadmm_mesh_open_edges", "sadmm_mesh_bytes", "sadmm_mesh_bounds",
      "sadmm_mesh_vertex_count", "sadmm_mesh_vertex_at", "sadmm_mesh_triangle_at", "sadmm_mesh_grid"}},
    {on_environments,
     {"sadmm_world_replicate",
      "sadmm_environments_destroy",
      "sadmm_environments_message",
      "sadmm_environments_count",
      "sadmm_environments_memory",
      "sadmm_environments_step",
      "sadmm_environments_set_settings",
      "sadmm_environments_settings_sized",
      "sadmm_environments_reset",
      "sadmm_environments_keep",
      "sadmm_environments_forget",
      "sadmm_environments_save",
      "sadmm_environments_rows",
      "sadmm_environments_get",
      "sadmm_environments_set",
      "sadmm_environments_bind",
      "sadmm_environments_set_stream",
      "sadmm_environments_marked",
      "sadmm_environments_mark",
      "sadmm_environments_record_contacts",
      "sadmm_environments_contacts",
      "sadmm_environments_cast_rays"}},
    {on_mesh_files,
     {"sadmm_mesh_file_read", "sadmm_mesh_file_destroy", "sadmm_mesh_file_vertex_count",
      "sadmm_mesh_file_triangle_count", "sadmm_mesh_file_vertices", "sadmm_mesh_file_triangles",
      "sadmm_mesh_file_describe_sized"}},
    {on_masses, {"sadmm_shape_mass", "sadmm_mass_sum", "sadmm_mass_pose_in_body", "sadmm_mass_pose_of_body"}},
    {on_scenes,
     {"sadmm_scene_library_count", "sadmm_scene_library_at", "sadmm_scene_create", "sadmm_scene_create_from_text",
      "sadmm_scene_destroy", "sadmm_scene_name", "sadmm_scene_description", "sadmm_scene_duration",
      "sadmm_scene_choose_method", "sadmm_scene_world_def_sized", "sadmm_scene_create_world",
      "sadmm_scene_run_script", "sadmm_scene_is_scripted", "sadmm_scene_write_text"}},
    {on_others, {"sadmm_backend_query_sized", "sadmm_box_inertia", "sadmm_sphere_inertia", "sadmm_capsule_inertia"}},
    {on_defaults,
     {"sadmm_settings_init", W(def_init), "sadmm_body_def_init", "sadmm_shape_def_init", "sadmm_hull_def_init",
      "sadmm_joint_def_init", "sadmm_coupling_def_init", "sadmm_gear_def_init", "sadmm_mesh_def_init",
      "sadmm_heightfield_def_init", "sadmm_mesh_file_def_init", "sadmm_query_filter_init", "sadmm_draw_init"}},
    {NULL,
     {"sadmm_array_name", "sadmm_environments_is_input", "sadmm_status_name", "sadmm_last_message", "sadmm_version",
      "sadmm_version_number", "sadmm_build_commit", "sadmm_build_compiler"}},
};
enum { GROUPS = sizeof functions / sizeof *functions };

static void start(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_body_def ball = sadmm_body_def_default(), floor = ball;
    sadmm_shape_def sphere = sadmm_shape_def_default(), plane = sphere;
    sadmm_body_id ground;
    def.backend = SADMM_BACKEND_CPU;
    ball.mass = 1;
    sadmm_sphere_inertia(1, 0.1, ball.inertia);
    ball.position[2] = 0.1;
    floor.type = SADMM_BODY_STATIC;
    floor.environment = -1;
    sphere.size[0] = 0.1;
    plane.type = SADMM_SHAPE_PLANE;
    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    ck_assert_int_eq(sadmm_world_create(&def, &world), SADMM_OK);
    ck_assert_int_eq(sadmm_world_add_body(world, &floor, &ground), SADMM_OK);
    ck_assert_int_eq(sadmm_world_add_shape(world, ground, &plane, NULL), SADMM_OK); /* id may be NULL */
    ck_assert_int_eq(sadmm_world_add_body(world, &ball, &body), SADMM_OK);
    ck_assert_int_eq(sadmm_world_add_shape(world, body, &sphere, &shape), SADMM_OK);
    sadmm_joint_def slider = sadmm_joint_def_default();
    slider.kind = SADMM_JOINT_CYLINDRICAL;
    slider.body_b = body;
    slider.position_a[2] = 0.1;
    ck_assert_int_eq(sadmm_world_add_joint(world, &slider, &joint), SADMM_OK);
    sadmm_coupling_def pull = sadmm_coupling_def_default();
    sadmm_gear_def screw = sadmm_gear_def_default();
    pull.body = body;
    pull.linear_stiffness = 10;
    screw.joint_1 = screw.joint_2 = joint;
    screw.coordinate_1 = 2, screw.coordinate_2 = 5;
    ck_assert_int_eq(sadmm_world_add_coupling(world, &pull, &coupling), SADMM_OK);
    ck_assert_int_eq(sadmm_world_add_gear(world, &screw, &gear), SADMM_OK);
    ck_assert_int_eq(sadmm_world_step(world), SADMM_OK);
}

/* And nothing has changed: a world that was asked nothing goes on to the same state. */
START_TEST(null_is_refused)
{
    uint64_t hash, other;
    start();
    if (functions[_i].pass_null) functions[_i].pass_null();
    ck_assert_int_eq(sadmm_world_step(world), SADMM_OK);
    ck_assert_int_eq(sadmm_world_state_hash(world, &hash), SADMM_OK);
    sadmm_world_destroy(world);
    sadmm_problem_destroy(problem);
    start();
    ck_assert_int_eq(sadmm_world_step(world), SADMM_OK);
    ck_assert_int_eq(sadmm_world_state_hash(world, &other), SADMM_OK);
    ck_assert_uint_eq(hash, other);
    sadmm_world_destroy(world);
    sadmm_problem_destroy(problem);
}
END_TEST

static bool is_listed(const char *name)
{
    for (int g = 0; g < GROUPS; ++g)
        for (int k = 0; k < 24 && functions[g].names[k]; ++k)
            if (strcmp(functions[g].names[k], name) == 0) return true;
    return false;
}

START_TEST(every_exported_function_is_listed)
{
    char line[256], name[200], type;
    int exported = 0, listed = 0;
    FILE *symbols = popen("nm -D --defined-only '" SUBADMM_LIBRARY "'", "r");
    ck_assert_ptr_nonnull(symbols);
    while (fgets(line, sizeof line, symbols))
        if (sscanf(line, "%*s %c %199[^@\n]", &type, name) == 2 && strncmp(name, "sadmm_", 6) == 0) {
            ck_assert_msg(strstr(line, "@@SUBADMM_") != NULL, "%s: without a version", name);
            ck_assert_msg(is_listed(name), "%s: exported, and nothing here passes NULL to it", name);
            ++exported;
        }
    pclose(symbols);
    for (int g = 0; g < GROUPS; ++g)
        for (int k = 0; k < 24 && functions[g].names[k]; ++k) ++listed;
    ck_assert_int_eq(exported, listed);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("null");
    TCase *cases = tcase_create("null");
    tcase_add_loop_test(cases, null_is_refused, 0, GROUPS);
    tcase_add_test(cases, every_exported_function_is_listed);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
