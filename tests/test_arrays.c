/* Arrays of a world: the same numbers as one call a body, joint or coupling reads and sets, whatever was removed; what
 * may not be set is refused as a whole. */
#include <math.h>
#include <stdint.h>

#include "fixed_work.h"
#include "scene_tools.h"

enum { MOST = 64 * 13 };

/* Bodies of all types, joints and couplings, with holes among them. */
struct machine {
    sadmm_world *world;
    int32_t bodies, joints, couplings;
};

static sadmm_body_id add_body(sadmm_world *world, sadmm_body_type type, double x)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    def.type = type;
    def.mass = 1 + x * x;
    for (int k = 0; k < 3; ++k) def.inertia[k] = 0.01 * (2 + k);
    def.position[0] = x;
    def.position[2] = 0.11;
    if (type != SADMM_BODY_STATIC) def.linear_velocity[1] = 0.3 * x, def.angular_velocity[2] = -x;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    shape.type = SADMM_SHAPE_BOX;
    for (int k = 0; k < 3; ++k) shape.size[k] = 0.1;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

static struct machine build_machine(void)
{
    struct machine m = {0};
    sadmm_world_def def = fixed_world_def();
    def.settings.threads = 1;
    m.world = create_world(&def);
    sadmm_body_def ground = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default();
    sadmm_body_id id, ids[12];
    ground.type = SADMM_BODY_STATIC;
    ground.environment = -1;
    MUST(m.world, sadmm_world_add_body(m.world, &ground, &id));
    plane.type = SADMM_SHAPE_PLANE;
    MUST(m.world, sadmm_world_add_shape(m.world, id, &plane, NULL));
    for (int k = 0; k < 12; ++k)
        ids[k] = add_body(m.world, k == 4 ? SADMM_BODY_KINEMATIC : SADMM_BODY_DYNAMIC, 0.5 * k);
    sadmm_joint_id joints[4];
    sadmm_coupling_id couplings[3];
    for (int k = 0; k < 4; ++k) {
        sadmm_joint_def joint = sadmm_joint_def_default();
        const double at[3] = {0.5 * (5 + k) + 0.25, 0, 0.4}, along[4] = {1, 0, 0, 0};
        joint.kind = k % 2 ? SADMM_JOINT_REVOLUTE : SADMM_JOINT_SPHERICAL;
        joint.body_a = ids[5 + k];
        joint.body_b = ids[6 + k];
        MUST(m.world, sadmm_world_place_joint(m.world, &joint, at, along));
        joint.coordinates[5].drive = SADMM_DRIVE_POSITION;
        joint.coordinates[5].drive_stiffness = 10;
        joint.coordinates[5].drive_damping = 1;
        joint.coordinates[5].target_position = 0.1 * k;
        MUST(m.world, sadmm_world_add_joint(m.world, &joint, &joints[k]));
    }
    for (int k = 0; k < 3; ++k) {
        sadmm_coupling_def coupling = sadmm_coupling_def_default();
        coupling.body = ids[k];
        coupling.linear_stiffness = 100;
        coupling.linear_damping = 10;
        coupling.target_position[0] = 0.5 * k;
        coupling.target_position[2] = 0.3 + 0.1 * k;
        coupling.target_velocity[1] = 0.1 * k;
        MUST(m.world, sadmm_world_add_coupling(m.world, &coupling, &couplings[k]));
    }
    MUST(m.world, sadmm_world_remove_body(m.world, ids[3]));
    MUST(m.world, sadmm_world_remove_body(m.world, ids[10]));
    MUST(m.world, sadmm_world_remove_joint(m.world, joints[1]));
    MUST(m.world, sadmm_world_remove_coupling(m.world, couplings[1]));
    m.bodies = sadmm_world_body_count(m.world);
    m.joints = sadmm_world_joint_count(m.world);
    m.couplings = sadmm_world_coupling_count(m.world);
    ck_assert_int_eq(m.bodies, 11);
    ck_assert_int_eq(m.joints, 3);
    ck_assert_int_eq(m.couplings, 2);
    return m;
}

static void get(const struct machine *m, sadmm_array array, double *values)
{
    const int32_t rows = sadmm_world_array_rows(m->world, array);
    ck_assert_int_le(rows * sadmm_array_columns(array), MOST);
    MUST(m->world, sadmm_world_get_array(m->world, array, 0, rows, values));
}

static void expect_row(const double *row, const double *wanted, int count)
{
    ck_assert_mem_eq(row, wanted, (size_t)count * sizeof *row);
}

START_TEST(arrays_read_what_single_calls_read)
{
    const struct machine m = build_machine();
    double state[MOST], wrench[MOST], contact[MOST], inertia[MOST], position[MOST], speed[MOST], drive[MOST],
        load[MOST], target[MOST], target_speed[MOST], aim[MOST], reaction[MOST];
    const double push[3] = {1, 2, 3}, turn[3] = {0.1, 0.2, 0.3};
    sadmm_body_id second;
    MUST(m.world, sadmm_world_body_at(m.world, 1, &second));
    MUST(m.world, sadmm_world_set_body_wrench(m.world, second, push, turn));
    step_world(m.world, 10);
    get(&m, SADMM_ARRAY_BODY_STATE, state);
    get(&m, SADMM_ARRAY_BODY_WRENCH, wrench);
    get(&m, SADMM_ARRAY_BODY_CONTACT_WRENCH, contact);
    get(&m, SADMM_ARRAY_BODY_INERTIA, inertia);
    for (int32_t i = 0; i < m.bodies; ++i) {
        sadmm_body_id id;
        sadmm_body_state one;
        sadmm_body_def def;
        double touch[6] = {0};
        MUST(m.world, sadmm_world_body_at(m.world, i, &id));
        MUST(m.world, sadmm_world_body_state(m.world, id, &one));
        MUST(m.world, sadmm_world_body_def(m.world, id, &def));
        if (def.type != SADMM_BODY_STATIC) MUST(m.world, sadmm_world_body_contact_wrench(m.world, id, touch));
        expect_row(state + 13 * i, one.position, 3);
        expect_row(state + 13 * i + 3, one.orientation, 4);
        expect_row(state + 13 * i + 7, one.linear_velocity, 3);
        expect_row(state + 13 * i + 10, one.angular_velocity, 3);
        expect_row(contact + 6 * i, touch, 6);
        ck_assert_double_eq(inertia[4 * i], def.mass);
        expect_row(inertia + 4 * i + 1, def.inertia, 3);
        for (int k = 0; k < 6; ++k) ck_assert_double_eq(wrench[6 * i + k], i != 1 ? 0 : k < 3 ? push[k] : turn[k - 3]);
    }
    get(&m, SADMM_ARRAY_JOINT_POSITION, position);
    get(&m, SADMM_ARRAY_JOINT_SPEED, speed);
    get(&m, SADMM_ARRAY_JOINT_DRIVE_FORCE, drive);
    get(&m, SADMM_ARRAY_JOINT_WRENCH, load);
    get(&m, SADMM_ARRAY_JOINT_TARGET_POSITION, target);
    get(&m, SADMM_ARRAY_JOINT_TARGET_SPEED, target_speed);
    for (int32_t i = 0; i < m.joints; ++i) {
        sadmm_joint_id id;
        sadmm_joint_state one;
        sadmm_joint_def def;
        MUST(m.world, sadmm_world_joint_at(m.world, i, &id));
        MUST(m.world, sadmm_world_joint_state(m.world, id, &one));
        MUST(m.world, sadmm_world_joint_def(m.world, id, &def));
        expect_row(position + 6 * i, one.position, 6);
        expect_row(speed + 6 * i, one.speed, 6);
        expect_row(drive + 6 * i, one.drive_force, 6);
        expect_row(load + 6 * i, one.wrench_b, 6);
        for (int k = 0; k < 6; ++k) {
            ck_assert_double_eq(target[6 * i + k], def.coordinates[k].target_position);
            ck_assert_double_eq(target_speed[6 * i + k], def.coordinates[k].target_speed);
        }
    }
    get(&m, SADMM_ARRAY_COUPLING_TARGET, aim);
    get(&m, SADMM_ARRAY_COUPLING_REACTION, reaction);
    for (int32_t i = 0; i < m.couplings; ++i) {
        sadmm_coupling_id id;
        sadmm_coupling_state one;
        sadmm_coupling_def def;
        MUST(m.world, sadmm_world_coupling_at(m.world, i, &id));
        MUST(m.world, sadmm_world_coupling_state(m.world, id, &one));
        MUST(m.world, sadmm_world_coupling_def(m.world, id, &def));
        expect_row(aim + 13 * i, def.target_position, 3);
        expect_row(aim + 13 * i + 3, def.target_orientation, 4);
        expect_row(aim + 13 * i + 7, def.target_velocity, 6);
        expect_row(reaction + 6 * i, one.reaction_force, 3);
        expect_row(reaction + 6 * i + 3, one.reaction_torque, 3);
    }
    /* A range is the rows of the whole. */
    double part[3 * 13];
    MUST(m.world, sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_STATE, 5, 3, part));
    expect_row(part, state + 5 * 13, 3 * 13);
    sadmm_world_destroy(m.world);
}
END_TEST

/* One world is changed by arrays, its twin by single calls: they stay equal to the last bit. */
START_TEST(arrays_set_what_single_calls_set)
{
    const struct machine m = build_machine(), twin = build_machine();
    double state[MOST], wrench[MOST], inertia[MOST], target[MOST], aim[MOST];
    for (int round = 0; round < 6; ++round) {
        step_world(m.world, 5);
        step_world(twin.world, 5);
        get(&m, SADMM_ARRAY_BODY_STATE, state);
        get(&m, SADMM_ARRAY_BODY_WRENCH, wrench);
        get(&m, SADMM_ARRAY_BODY_INERTIA, inertia);
        get(&m, SADMM_ARRAY_JOINT_TARGET_POSITION, target);
        get(&m, SADMM_ARRAY_COUPLING_TARGET, aim);
        for (int32_t i = 0; i < m.bodies; ++i) {
            sadmm_body_id id;
            sadmm_body_def def;
            sadmm_body_state one;
            MUST(twin.world, sadmm_world_body_at(twin.world, i, &id));
            MUST(twin.world, sadmm_world_body_def(twin.world, id, &def));
            MUST(twin.world, sadmm_world_body_state(twin.world, id, &one));
            if (def.type != SADMM_BODY_STATIC) {
                if (round == 2 && i % 3 == 0) one.position[2] = state[13 * i + 2] += 0.2;
                one.linear_velocity[0] = state[13 * i + 7] += 0.01 * i;
                MUST(twin.world, sadmm_world_set_body_state(twin.world, id, &one));
            }
            if (def.type != SADMM_BODY_DYNAMIC) continue;
            const double force[3] = {wrench[6 * i] = 0.1 * i, 0, wrench[6 * i + 2] = round}, torque[3] = {0, 0, 0};
            MUST(twin.world, sadmm_world_set_body_wrench(twin.world, id, force, torque));
            inertia[4 * i] *= 1.1;
            MUST(twin.world, sadmm_world_set_body_mass(twin.world, id, inertia[4 * i], inertia + 4 * i + 1));
        }
        for (int32_t i = 0; i < m.joints; ++i) {
            sadmm_joint_id id;
            sadmm_joint_def def;
            MUST(twin.world, sadmm_world_joint_at(twin.world, i, &id));
            MUST(twin.world, sadmm_world_joint_def(twin.world, id, &def));
            def.coordinates[5].target_position = target[6 * i + 5] = 0.1 * round - 0.2;
            MUST(twin.world, sadmm_world_set_joint_coordinate(twin.world, id, 5, &def.coordinates[5]));
        }
        for (int32_t i = 0; i < m.couplings; ++i) {
            sadmm_coupling_id id;
            MUST(twin.world, sadmm_world_coupling_at(twin.world, i, &id));
            aim[13 * i] += 0.02;
            MUST(twin.world,
                 sadmm_world_set_coupling_target(twin.world, id, aim + 13 * i, aim + 13 * i + 3, aim + 13 * i + 7));
        }
        MUST(m.world, sadmm_world_set_array(m.world, SADMM_ARRAY_BODY_STATE, 0, m.bodies, state));
        MUST(m.world, sadmm_world_set_array(m.world, SADMM_ARRAY_BODY_WRENCH, 0, m.bodies, wrench));
        MUST(m.world, sadmm_world_set_array(m.world, SADMM_ARRAY_BODY_INERTIA, 0, m.bodies, inertia));
        MUST(m.world, sadmm_world_set_array(m.world, SADMM_ARRAY_JOINT_TARGET_POSITION, 0, m.joints, target));
        MUST(m.world, sadmm_world_set_array(m.world, SADMM_ARRAY_COUPLING_TARGET, 0, m.couplings, aim));
    }
    ck_assert_uint_eq(state_hash(m.world), state_hash(twin.world));
    sadmm_world_destroy(m.world);
    sadmm_world_destroy(twin.world);
}
END_TEST

/* One row that cannot be set, and none is. */
START_TEST(bad_rows_are_refused_with_all_others)
{
    const struct machine m = build_machine();
    double values[MOST];
    const uint64_t before = state_hash(m.world);
    const struct {
        sadmm_array array;
        int32_t row, column;
        double value;
        const char *message;
    } cases[] = {
        {SADMM_ARRAY_BODY_STATE, 7, 1, NAN, "values, row 7: state->position[1] = nan"},
        {SADMM_ARRAY_BODY_STATE, 3, 3, 2, "values, row 3: state->orientation"},
        {SADMM_ARRAY_BODY_STATE, 0, 7, 1,
         "values, row 0: state->linear_velocity[0] = 1: must be 0, for the body is static"},
        {SADMM_ARRAY_BODY_WRENCH, 0, 2, 1, "values, row 0: column 2 = 1: must be 0, for the body is static"},
        {SADMM_ARRAY_BODY_WRENCH, 2, 5, INFINITY, "values, row 2: torque[2] = inf"},
        {SADMM_ARRAY_BODY_INERTIA, 2, 0, -1, "values, row 2: mass = -1"},
        {SADMM_ARRAY_BODY_INERTIA, 2, 1, 5, "values, row 2: inertia[0] = 5"},
        {SADMM_ARRAY_JOINT_TARGET_POSITION, 1, 5, NAN, "values, row 1: coordinate->target_position = nan"},
        {SADMM_ARRAY_JOINT_TARGET_POSITION, 2, 0, 1, "values, row 2: index = 0: must be a free coordinate"},
        {SADMM_ARRAY_JOINT_TARGET_SPEED, 2, 5, 1e10, "values, row 2: coordinate->target_speed = 1e+10"},
        {SADMM_ARRAY_COUPLING_TARGET, 1, 2, 1e10, "values, row 1: position[2] = 1e+10"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        const int32_t rows = sadmm_world_array_rows(m.world, cases[k].array),
                      columns = sadmm_array_columns(cases[k].array);
        double old[MOST];
        get(&m, cases[k].array, old);
        memcpy(values, old, sizeof values);
        /* others would be fine */
        for (int32_t row = 1; row < rows; ++row)
            if (cases[k].array != SADMM_ARRAY_BODY_WRENCH || row != 4) values[row * columns + columns - 1] *= 0.5;
        values[cases[k].row * columns + cases[k].column] = cases[k].value;
        ck_assert_int_eq(sadmm_world_set_array(m.world, cases[k].array, 0, rows, values), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_msg(strncmp(sadmm_world_message(m.world), cases[k].message, strlen(cases[k].message)) == 0, "%s",
                      sadmm_world_message(m.world));
        get(&m, cases[k].array, values);
        ck_assert_mem_eq(values, old, (size_t)(rows * columns) * sizeof *old);
    }
    ck_assert_uint_eq(state_hash(m.world), before);
    sadmm_world_destroy(m.world);
}
END_TEST

START_TEST(bad_arguments_are_refused)
{
    const struct machine m = build_machine();
    double values[MOST] = {0};
    sadmm_device_array device;
    int32_t count;
    const int32_t ranges[][2] = {{-1, 1}, {0, 12}, {11, 1}, {12, 0}, {0, -1}, {5, INT32_MAX}, {INT32_MAX, 1}};
    for (size_t k = 0; k < sizeof ranges / sizeof *ranges; ++k) {
        ck_assert_int_eq(sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_STATE, ranges[k][0], ranges[k][1], values),
                         SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(sadmm_world_message(m.world), "which has 11"));
        ck_assert_int_eq(sadmm_world_set_array(m.world, SADMM_ARRAY_BODY_STATE, ranges[k][0], ranges[k][1], values),
                         SADMM_ERROR_INVALID_ARGUMENT);
    }
    MUST(m.world, sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_STATE, 11, 0, NULL));
    const int arrays[] = {-1, SADMM_ARRAY_COUNT};
    for (int k = 0; k < 2; ++k) {
        const sadmm_array none = (sadmm_array)arrays[k];
        ck_assert_int_eq(sadmm_array_columns(none), 0);
        ck_assert(!sadmm_array_is_settable(none));
        ck_assert_int_eq(sadmm_world_array_rows(m.world, none), 0);
        ck_assert_int_eq(sadmm_world_get_array(m.world, none, 0, 0, values), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_int_eq(sadmm_world_set_array(m.world, none, 0, 0, values), SADMM_ERROR_INVALID_ARGUMENT);
    }
    ck_assert_int_eq(sadmm_world_array_rows(NULL, SADMM_ARRAY_BODY_STATE), 0);
    ck_assert_int_eq(sadmm_world_get_array(NULL, SADMM_ARRAY_BODY_STATE, 0, 0, values), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_STATE, 0, 1, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_set_array(m.world, SADMM_ARRAY_COUPLING_REACTION, 0, 1, values),
                     SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(m.world), "must be one that can be set"));
    step_world(m.world, 1);
    ck_assert_int_eq(sadmm_world_device_array(m.world, SADMM_ARRAY_BODY_STATE, &device), SADMM_ERROR_UNAVAILABLE);
    ck_assert_int_eq(sadmm_world_device_array(m.world, SADMM_ARRAY_BODY_WRENCH, &device), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_device_array(m.world, SADMM_ARRAY_BODY_STATE, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_dynamic_bodies(m.world, NULL, 0, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    int32_t indices[16];
    ck_assert_int_eq(sadmm_world_dynamic_bodies(m.world, indices, 8, &count), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_dynamic_bodies(m.world, NULL, 9, &count), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_settings settings = sadmm_world_settings(m.world);
    settings.recover_wrenches = false;
    MUST(m.world, sadmm_world_set_settings(m.world, &settings));
    step_world(m.world, 1);
    ck_assert_int_eq(sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_CONTACT_WRENCH, 0, 1, values),
                     SADMM_ERROR_UNAVAILABLE);
    sadmm_world_destroy(m.world);
}
END_TEST

/* There and back, whatever was removed, in any order. */
START_TEST(ids_and_rows_are_each_others)
{
    const struct machine m = build_machine();
    int32_t index, indices[16], count, expected[16], dynamic = 0;
    for (int32_t n = 0; n < 40; ++n) {
        const int32_t i = n * 7 % m.bodies, s = n * 5 % sadmm_world_shape_count(m.world), j = n % m.joints, c = n % 2;
        sadmm_body_id body;
        sadmm_shape_id shape;
        sadmm_joint_id joint;
        sadmm_coupling_id coupling;
        MUST(m.world, sadmm_world_body_at(m.world, i, &body));
        MUST(m.world, sadmm_world_body_index(m.world, body, &index));
        ck_assert_int_eq(index, i);
        MUST(m.world, sadmm_world_shape_at(m.world, s, &shape));
        MUST(m.world, sadmm_world_shape_index(m.world, shape, &index));
        ck_assert_int_eq(index, s);
        MUST(m.world, sadmm_world_joint_at(m.world, j, &joint));
        MUST(m.world, sadmm_world_joint_index(m.world, joint, &index));
        ck_assert_int_eq(index, j);
        MUST(m.world, sadmm_world_coupling_at(m.world, c, &coupling));
        MUST(m.world, sadmm_world_coupling_index(m.world, coupling, &index));
        ck_assert_int_eq(index, c);
    }
    for (int32_t i = 0; i < m.bodies; ++i) {
        sadmm_body_id id;
        sadmm_body_def def;
        MUST(m.world, sadmm_world_body_at(m.world, i, &id));
        MUST(m.world, sadmm_world_body_def(m.world, id, &def));
        if (def.type == SADMM_BODY_DYNAMIC) expected[dynamic++] = i;
    }
    MUST(m.world, sadmm_world_dynamic_bodies(m.world, NULL, 0, &count));
    ck_assert_int_eq(count, dynamic);
    MUST(m.world, sadmm_world_dynamic_bodies(m.world, indices, 16, &count));
    ck_assert_mem_eq(indices, expected, (size_t)count * sizeof *indices);
    const sadmm_body_id stale = {5, 1}; /* removed */
    ck_assert_int_eq(sadmm_world_body_index(m.world, stale, &index), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_body_index(m.world, (sadmm_body_id){0}, &index), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_joint_index(m.world, (sadmm_joint_id){0}, &index), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_coupling_index(m.world, (sadmm_coupling_id){0}, &index), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_shape_index(m.world, (sadmm_shape_id){0}, &index), SADMM_ERROR_STALE_ID);
    sadmm_world_destroy(m.world);
}
END_TEST

/* A machine that moves: what velocities change by in a step, over its length. */
START_TEST(accelerations_are_changes_of_velocity)
{
    struct machine m = build_machine();
    double before[MOST], after[MOST], acceleration[MOST];
    const double dt = sadmm_world_settings(m.world).dt;
    MUST(m.world, sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_ACCELERATION, 0, m.bodies, acceleration));
    for (int k = 0; k < 6 * m.bodies; ++k) ck_assert(acceleration[k] == 0);
    step_world(m.world, 3);
    MUST(m.world, sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_STATE, 0, m.bodies, before));
    step_world(m.world, 1);
    MUST(m.world, sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_STATE, 0, m.bodies, after));
    MUST(m.world, sadmm_world_get_array(m.world, SADMM_ARRAY_BODY_ACCELERATION, 0, m.bodies, acceleration));
    double largest = 0;
    for (int i = 0; i < m.bodies; ++i)
        for (int k = 0; k < 6; ++k) {
            const double own = acceleration[6 * i + k], change = after[13 * i + 7 + k] - before[13 * i + 7 + k];
            ck_assert_double_eq_tol(own * dt, change, 1e-15 + 1e-12 * fabs(change)); /* rounding */
            largest = fmax(largest, fabs(own));
        }
    ck_assert_double_gt(largest, 1);
    sadmm_world_destroy(m.world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("arrays");
    TCase *cases = tcase_create("arrays");
    tcase_add_test(cases, arrays_read_what_single_calls_read);
    tcase_add_test(cases, arrays_set_what_single_calls_set);
    tcase_add_test(cases, bad_rows_are_refused_with_all_others);
    tcase_add_test(cases, bad_arguments_are_refused);
    tcase_add_test(cases, ids_and_rows_are_each_others);
    tcase_add_test(cases, accelerations_are_changes_of_velocity);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
