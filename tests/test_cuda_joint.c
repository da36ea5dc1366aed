/* Joints on the device: the same motion as on the CPU, for every law; and steps that the device makes alone against the
 * same kernels driven by the host. The emulated device (test_cuda_joint_emulated.c) has the host's sines: equal to the
 * last bit. A GPU's own differ by rounding. */
#include "cuda_worlds.h"
#include "fixed_work.h"

static sadmm_body_id add_link(sadmm_world *world, double x)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = 1;
    def.inertia[0] = 0.01, def.inertia[1] = 0.02, def.inertia[2] = 0.015;
    def.position[0] = x;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

/* A chain from the static world, each joint with a law of its own on its free coordinate. */
static sadmm_world *chain(int precision)
{
    static const sadmm_joint_coordinate laws[] = {
        {.friction = 0.5, .drive_force = INFINITY},
        {.spring_stiffness = 30, .spring_damping = 0.2, .drive_force = INFINITY},
        {.limited = true, .lower = -0.1, .upper = 0.05, .drive_force = INFINITY},
        {.drive = SADMM_DRIVE_SPEED, .target_speed = 2, .drive_force = 0.3},
    };
    static const double quarter[4] = {0.70710678118654752, 0.70710678118654752, 0, 0};
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.iterations = 300;
    def.settings.threads = 1;
    sadmm_world *world = create_world(&def);
    sadmm_body_id last = {0, 0};
    for (int k = 0; k < 4; ++k) {
        const double place[3] = {0.2 * k, 0, 0};
        sadmm_joint_def joint = sadmm_joint_def_default();
        joint.kind = SADMM_JOINT_REVOLUTE;
        joint.body_a = last;
        joint.body_b = last = add_link(world, 0.2 * k + 0.1);
        joint.coordinates[5] = laws[k];
        MUST(world, sadmm_world_place_joint(world, &joint, place, quarter));
        MUST(world, sadmm_world_add_joint(world, &joint, NULL));
    }
    return world;
}

START_TEST(joints_are_solved_on_the_device)
{
    sadmm_world *host = chain(_i), *device = chain(_i);
    const double close = _i == SADMM_F32 ? 2e-4 : 1e-8; /* rounding of 30 steps of a chain that swings */
    char text[4000];
    use_device(device, _i, 0);
    for (int step = 0; step < 30; ++step) {
        step_world(host, 1);
        step_world(device, 1);
        for (int k = 0; k < 4; ++k) {
            const sadmm_body_state a = body_state(host, body_at(host, k)), b = body_state(device, body_at(device, k));
            ck_assert_msg(distance(a.position, b.position) < close, "step %d, body %d: %g", step, k,
                          distance(a.position, b.position));
        }
    }
    sadmm_world_explain(device, text, sizeof text);
    ck_assert_ptr_nonnull(strstr(text, "of 4 joints"));
    sadmm_world_destroy(host);
    sadmm_world_destroy(device);
}
END_TEST

/* A table and a gear come and go while the device has the world. */
START_TEST(tables_and_gears_come_and_go)
{
    static const double positions[3] = {-1, 0, 1}, forces[3] = {-40, 0, 10};
    sadmm_world *worlds[2] = {chain(_i), chain(_i)};
    const double close = _i == SADMM_F32 ? 2e-4 : 1e-8; /* as above */
    use_device(worlds[1], _i, 0);
    for (int step = 0; step < 30; ++step) {
        for (int w = 0; w < 2; ++w) {
            sadmm_joint_id joints[3];
            sadmm_gear_def gear = sadmm_gear_def_default();
            for (int k = 0; k < 3; ++k) MUST(worlds[w], sadmm_world_joint_at(worlds[w], k, &joints[k]));
            gear.joint_1 = joints[0], gear.joint_2 = joints[1];
            gear.coordinate_1 = gear.coordinate_2 = 5;
            gear.ratio = 0.5;
            if (step == 8)
                MUST(worlds[w], sadmm_world_set_joint_spring_table(worlds[w], joints[2], 5, positions, forces, 3));
            if (step == 12) MUST(worlds[w], sadmm_world_add_gear(worlds[w], &gear, NULL));
            if (step == 22)
                MUST(worlds[w], sadmm_world_set_joint_spring_table(worlds[w], joints[2], 5, NULL, NULL, 0));
            step_world(worlds[w], 1);
        }
        ck_assert(worlds[1]->resident.loaded == (step > 0));
        for (int k = 0; k < 4; ++k) {
            const sadmm_body_state a = body_state(worlds[0], body_at(worlds[0], k)),
                                   b = body_state(worlds[1], body_at(worlds[1], k));
            ck_assert_msg(distance(a.position, b.position) < close, "step %d, body %d: %g", step, k,
                          distance(a.position, b.position));
        }
    }
    for (int w = 0; w < 2; ++w) {
        sadmm_gear_id gear;
        sadmm_gear_state state;
        MUST(worlds[w], sadmm_world_gear_at(worlds[w], 0, &gear));
        MUST(worlds[w], sadmm_world_gear_state(worlds[w], gear, &state));
        ck_assert(fabs(state.error) < 1e-4 && state.force_1 != 0); /* rad: what a step leaves of it is fed back */
        sadmm_world_destroy(worlds[w]);
    }
}
END_TEST


/* ---- steps by the device ----------------------------------------------------------------------------------------- */

enum { YARD_JOINTS = 10, DOOR = 4, MOTOR = 5, GLUE = 6, COUPLINGS = 2 };

static sadmm_joint_id join(sadmm_world *world, sadmm_joint_def *def, sadmm_body_id a, sadmm_body_id b, double x,
                           double y, double z)
{
    static const double upright[4] = {1, 0, 0, 0};
    const double place[3] = {x, y, z};
    sadmm_joint_id id;
    def->body_a = a;
    def->body_b = b;
    MUST(world, sadmm_world_place_joint(world, def, place, upright));
    MUST(world, sadmm_world_add_joint(world, def, &id));
    return id;
}

static void throw_body(sadmm_world *world, sadmm_body_id id, double vx, double wz)
{
    sadmm_body_state state = body_state(world, id);
    state.linear_velocity[0] = vx;
    state.angular_velocity[2] = wz;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
}

/* Joints of all sorts among boxes that fall, land and hit them: a chain with a law a link, a door on a static post with
 * limits and a box thrown at it, a motor that pushes a box, glue that a landing breaks, a spring, a universal and a
 * ball joint in the air; couplings; a tower of boxes by itself. */
static sadmm_world *yard(int precision, sadmm_method method, int substeps)
{
    static const sadmm_joint_coordinate laws[] = {
        {.friction = 0.05, .armature = 0.002, .drive_force = INFINITY},
        {.spring_stiffness = 3, .spring_damping = 0.02, .drive_force = INFINITY},
        {.limited = true, .lower = -0.1, .upper = 0.05, .drive_force = INFINITY},
        {.drive = SADMM_DRIVE_POSITION, .target_position = 0.5, .drive_stiffness = 2, .drive_damping = 0.1,
         .drive_force = 0.3},
    };
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = method;
    def.settings.iterations = method == SADMM_METHOD_PAPER ? 23 : 24;
    def.settings.penalty_period = 10;
    def.settings.substeps = substeps;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    sadmm_body_id last = {0, 0};
    for (int k = 0; k < 4; ++k) {
        sadmm_joint_def joint = sadmm_joint_def_default();
        const sadmm_body_id link = add_box(world, 0.12 * k + 0.06, 0, 0.15, 0.05, 0.3, 0.5);
        static const double about_y[4] = {0.70710678118654752, -0.70710678118654752, 0, 0};
        const double place[3] = {0.12 * k, 0, 0.15};
        joint.kind = SADMM_JOINT_REVOLUTE;
        joint.coordinates[5] = laws[k];
        joint.body_a = last, joint.body_b = link;
        MUST(world, sadmm_world_place_joint(world, &joint, place, about_y));
        MUST(world, sadmm_world_add_joint(world, &joint, NULL));
        last = link;
    }
    sadmm_body_def post = sadmm_body_def_default();
    sadmm_body_id post_id;
    post.type = SADMM_BODY_STATIC;
    post.position[0] = 2, post.position[2] = 0.2;
    post.orientation[0] = 0.8, post.orientation[1] = 0.6;
    MUST(world, sadmm_world_add_body(world, &post, &post_id));
    sadmm_joint_def door = sadmm_joint_def_default();
    door.kind = SADMM_JOINT_REVOLUTE;
    door.coordinates[5].limited = true, door.coordinates[5].lower = -0.02, door.coordinates[5].upper = 0.04;
    const sadmm_body_id leaf = add_box(world, 2.2, 0, 0.2, 0.1, 1, 0.5);
    join(world, &door, post_id, leaf, 2, 0, 0.2);
    throw_body(world, add_box(world, 1.95, 0.05, 0.2, 0.08, 0.5, 0.5), 2, 0);
    sadmm_joint_def motor = sadmm_joint_def_default();
    motor.kind = SADMM_JOINT_PRISMATIC;
    motor.coordinates[2].drive = SADMM_DRIVE_SPEED, motor.coordinates[2].target_speed = 1;
    motor.coordinates[2].drive_force = 60;
    const sadmm_body_id plate = add_box(world, 4, 0, 0.1, 0.1, 2, 0.5);
    join(world, &motor, (sadmm_body_id){0, 0}, plate, 4, 0, 0.1);
    add_box(world, 4, 0.02, 0.302, 0.1, 1, 0.5);
    sadmm_joint_def glue = sadmm_joint_def_default();
    glue.break_force = 30;
    const sadmm_body_id lower = add_box(world, 6, 0, 0.12, 0.1, 1, 0.5),
                        upper = add_box(world, 6.1, 0, 0.4, 0.1, 3, 0.5);
    join(world, &glue, lower, upper, 6, 0, 0.2);
    sadmm_joint_def spring = sadmm_joint_def_default();
    spring.kind = SADMM_JOINT_SPRING;
    spring.coordinates[0].spring_stiffness = 50, spring.coordinates[0].spring_damping = 0.5;
    spring.coordinates[0].spring_rest = 0.3;
    const sadmm_body_id first = add_box(world, 8, 0, 1, 0.05, 0.2, 0.5),
                        second = add_box(world, 8.5, 0, 1, 0.05, 1, 0.5);
    join(world, &spring, first, second, 8.1, 0, 1);
    sadmm_joint_def cross = sadmm_joint_def_default(), ball = sadmm_joint_def_default();
    cross.kind = SADMM_JOINT_UNIVERSAL, ball.kind = SADMM_JOINT_SPHERICAL;
    ball.coordinates[4].friction = 0.01;
    const sadmm_body_id third = add_link(world, 9), fourth = add_link(world, 9.2);
    throw_body(world, third, 0.3, 5);
    join(world, &cross, second, third, 8.8, 0, 0.5);
    join(world, &ball, third, fourth, 9.1, 0, 0);
    for (int k = 0; k < COUPLINGS;
         ++k) { /* one lifts a box from another, the other turns one in the air and can do little */
        sadmm_coupling_def coupling = sadmm_coupling_def_default();
        if (k == 0) add_box(world, 10, 0, 0.1, 0.1, 1, 0.5);
        coupling.body = add_box(world, 10 + k, 0, 0.302, 0.1, 0.5, 0.5);
        coupling.target_position[0] = 10 + k, coupling.target_position[2] = 0.35;
        coupling.target_velocity[2] = 0.2, coupling.target_velocity[3] = k ? 4 : 0;
        coupling.position[1] = 0.02;
        coupling.linear_stiffness = 800, coupling.linear_damping = 20;
        coupling.angular_stiffness = k ? 5 : 0, coupling.angular_damping = 0.02;
        coupling.max_force = k ? 3 : INFINITY;
        MUST(world, sadmm_world_add_coupling(world, &coupling, NULL));
    }
    for (int i = 0; i < 2; ++i) add_box(world, -2, 0.01 * i, 0.102 + 0.201 * i, 0.1, 1 + i, 0.5);
    use_device(world, precision, 0);
    return world;
}

static sadmm_joint_id joint_at(sadmm_world *world, int32_t index)
{
    sadmm_joint_id id;
    MUST(world, sadmm_world_joint_at(world, index, &id));
    return id;
}

static sadmm_joint_state joint_state(sadmm_world *world, int32_t index)
{
    sadmm_joint_state state;
    MUST(world, sadmm_world_joint_state(world, joint_at(world, index), &state));
    return state;
}

/* What rounding of sines makes of so short a run: contacts may begin a step apart, joints do not. */
static void expect_close_states(const sadmm_joint_state *a, const sadmm_joint_state *b, const char *what, int32_t j)
{
    if (EMULATED) {
        ck_assert_msg(memcmp(a, b, sizeof *a) == 0, "%s: joint %d differs: %g %g", what, j, a->position[5],
                      b->position[5]);
        return;
    }
    for (int k = 0; k < 6; ++k)
        ck_assert_msg(fabs(a->position[k] - b->position[k]) < 1e-3, "%s: joint %d, coordinate %d: %g %g", what, j, k,
                      a->position[k], b->position[k]);
}

static sadmm_coupling_id coupling_at(sadmm_world *world, int32_t index)
{
    sadmm_coupling_id id;
    MUST(world, sadmm_world_coupling_at(world, index, &id));
    return id;
}

static void expect_same_couplings(sadmm_world *a, sadmm_world *b, const char *what)
{
    for (int32_t k = 0; k < sadmm_world_coupling_count(a); ++k) {
        sadmm_coupling_state x, y;
        sadmm_coupling_def dx, dy;
        MUST(a, sadmm_world_coupling_state(a, coupling_at(a, k), &x));
        MUST(b, sadmm_world_coupling_state(b, coupling_at(b, k), &y));
        MUST(a, sadmm_world_coupling_def(a, coupling_at(a, k), &dx));
        MUST(b, sadmm_world_coupling_def(b, coupling_at(b, k), &dy));
        if (EMULATED) ck_assert_msg(memcmp(&x, &y, sizeof x) == 0, "%s: coupling %d", what, k);
        for (int i = 0; i < 3; ++i) {
            ck_assert_double_le(fabs(x.position_error[i] - y.position_error[i]), 1e-3);
            ck_assert_double_le(fabs(dx.target_position[i] - dy.target_position[i]), EMULATED ? 0 : 1e-12);
        }
    }
}

static void expect_same_joints(sadmm_world *a, sadmm_world *b, const char *what)
{
    if (EMULATED) expect_same_world(a, b, what);
    ck_assert_int_eq(world_report(a).joints, world_report(b).joints);
    ck_assert_int_eq(world_report(a).couplings, world_report(b).couplings);
    expect_same_couplings(a, b, what);
    for (int32_t j = 0; j < sadmm_world_joint_count(a); ++j) {
        const sadmm_joint_state x = joint_state(a, j), y = joint_state(b, j);
        sadmm_joint_def da, db;
        expect_close_states(&x, &y, what, j);
        MUST(a, sadmm_world_joint_def(a, joint_at(a, j), &da));
        MUST(b, sadmm_world_joint_def(b, joint_at(b, j), &db));
        ck_assert_msg(da.enabled == db.enabled, "%s: joint %d", what, j);
    }
}

static const struct {
    sadmm_method method;
    int substeps, tier;
} ways[] = {{SADMM_METHOD_FAST, 1, SADMM_CUDA_TIER_AUTO},   {SADMM_METHOD_FAST, 3, SADMM_CUDA_TIER_AUTO},
            {SADMM_METHOD_PAPER, 1, SADMM_CUDA_TIER_AUTO},  {SADMM_METHOD_PAPER, 2, SADMM_CUDA_TIER_GRID},
            {SADMM_METHOD_FAST, 1, SADMM_CUDA_TIER_GRID},   {SADMM_METHOD_FAST, 2, SADMM_CUDA_TIER_STREAM},
            {SADMM_METHOD_PAPER, 1, SADMM_CUDA_TIER_STREAM}};
enum { WAYS = sizeof ways / sizeof *ways };

/* What is set between two steps, in either world. */
static void change(sadmm_world *world, int step)
{
    sadmm_joint_def def;
    if (step == 6) {
        MUST(world, sadmm_world_joint_def(world, joint_at(world, MOTOR), &def));
        def.coordinates[2].target_speed = -2;
        MUST(world, sadmm_world_set_joint_coordinate(world, joint_at(world, MOTOR), 2, &def.coordinates[2]));
        MUST(world, sadmm_world_set_joint_enabled(world, joint_at(world, 1), false));
    }
    if (step == 9) { /* more rows than the joint had */
        MUST(world, sadmm_world_joint_def(world, joint_at(world, DOOR), &def));
        def.coordinates[5].friction = 0.1;
        def.coordinates[5].spring_stiffness = 4;
        def.coordinates[5].drive = SADMM_DRIVE_SPEED;
        def.coordinates[5].drive_force = 0.01;
        MUST(world, sadmm_world_set_joint_coordinate(world, joint_at(world, DOOR), 5, &def.coordinates[5]));
    }
    if (step == 14) MUST(world, sadmm_world_set_joint_enabled(world, joint_at(world, 1), true));
    if (step == 3 || step == 15) {
        const double place[3] = {10.02, 0, 0.4}, way[6] = {0.1, 0, -0.3, 0, 0, 2}, turn[4] = {0.8, 0, 0.6, 0};
        MUST(world, sadmm_world_set_coupling_target(world, coupling_at(world, 0), place, turn, step == 3 ? way : NULL));
    }
    if (step == 5) MUST(world, sadmm_world_set_coupling_gains(world, coupling_at(world, 0), 500, 10, 3, 0.1));
    if (step == 10) MUST(world, sadmm_world_set_coupling_enabled(world, coupling_at(world, 1), false));
    if (step == 16) MUST(world, sadmm_world_set_coupling_enabled(world, coupling_at(world, 1), true));
}

/* The same world twice: its first one's steps are by the host. */
typedef sadmm_world *make_world(int precision, sadmm_method, int substeps);
static void make_pair(make_world *make, int precision, int way, sadmm_world *worlds[2])
{
    for (int k = 0; k < 2; ++k) {
        worlds[k] = make(precision, ways[way].method, ways[way].substeps);
        if (ways[way].tier != SADMM_CUDA_TIER_AUTO)
            force_tier(tables[precision], worlds[k]->context, (enum sadmm_cuda_tier)ways[way].tier);
    }
    by_host(worlds[0]);
}

/* A step of both, after what is set in either; the second one is kept by the device from the first step that it may. */
static void step_both(sadmm_world *worlds[2], void (*change_world)(sadmm_world *, int), int i, int step, char what[80])
{
    const int precision = i / WAYS, way = i % WAYS;
    for (int k = 0; k < 2; ++k) {
        change_world(worlds[k], step);
        MUST(worlds[k], step % 4 == 2 ? sadmm_world_step_async(worlds[k]) : sadmm_world_step(worlds[k]));
    }
    ck_assert(worlds[1]->resident.loaded == (step > 0 || ways[way].method == SADMM_METHOD_PAPER));
    ck_assert(!worlds[0]->resident.loaded);
    snprintf(what, 80, "way %d, %s, step %d", way, precision ? "f64" : "f32", step);
}

START_TEST(resident_joints_equal_those_by_host)
{
    const int precision = _i / WAYS, way = _i % WAYS;
    bool broke = false;
    sadmm_world *worlds[2];
    char what[80];
    make_pair(yard, precision, way, worlds);
    ck_assert_int_eq(sadmm_world_joint_count(worlds[0]), YARD_JOINTS);
    for (int step = 0; step < 20; ++step) {
        step_both(worlds, change, _i, step, what);
        if (step % 4 != 2) expect_same_joints(worlds[0], worlds[1], what);
        broke = broke || joint_state(worlds[1], GLUE).broken;
    }
    ck_assert(broke); /* and came apart in both worlds */
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* ---- gears, tables of springs ------------------------------------------------------------------------------------ */

enum { TRAIN, FINGER, RACK, GEARS, FIRST_TABLE = 6, TABLES = 3 };

static sadmm_gear_id gear_at(sadmm_world *world, int32_t index)
{
    sadmm_gear_id id;
    MUST(world, sadmm_world_gear_at(world, index, &id));
    return id;
}

static sadmm_joint_id hinge(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, double x)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_REVOLUTE;
    return join(world, &def, a, b, x, 0, 1);
}

static void add_gear(sadmm_world *world, sadmm_joint_id one, int first, sadmm_joint_id two, int second, double ratio)
{
    sadmm_gear_def def = sadmm_gear_def_default();
    def.joint_1 = one, def.joint_2 = two;
    def.coordinate_1 = first, def.coordinate_2 = second;
    def.ratio = ratio;
    MUST(world, sadmm_world_add_gear(world, &def, NULL));
}

/* A weight that swings on a spring as stiff as a stop beyond its slack, a slide that snaps through, and a spring
 * between two bodies that pulls ever more. */
static void add_tables(sadmm_world *world)
{
    static const double stop[2][4] = {{-0.1, -0.02, 0.02, 0.03}, {-5, 0, 0, 4000}},
                        snap[2][4] = {{-0.2, -0.05, 0.05, 0.2}, {-20, 15, -15, 20}},
                        pull[2][3] = {{0.1, 0.2, 0.4}, {-3, 0, 30}};
    static const sadmm_body_id ground = {0, 0};
    sadmm_joint_def slide = sadmm_joint_def_default(), spring = sadmm_joint_def_default();
    const sadmm_body_id weight = add_link(world, 8);
    const sadmm_joint_id swing = hinge(world, ground, weight, 7.8);
    throw_body(world, weight, 0, 3);
    MUST(world, sadmm_world_set_joint_spring_table(world, swing, 5, stop[0], stop[1], 4));
    slide.kind = SADMM_JOINT_PRISMATIC;
    const sadmm_joint_id snaps = join(world, &slide, ground, add_link(world, 9), 9, 0, 0.04);
    MUST(world, sadmm_world_set_joint_spring_table(world, snaps, 2, snap[0], snap[1], 4));
    spring.kind = SADMM_JOINT_SPRING;
    spring.coordinates[0].spring_damping = 0.2;
    const sadmm_joint_id pulls =
        join(world, &spring, weight, add_box(world, 8.3, 0, 0.2, 0.1, 0.5, 0.5), 8.1, 0, 0);
    MUST(world, sadmm_world_set_joint_spring_table(world, pulls, 0, pull[0], pull[1], 3));
}

/* Two wheels on a carrier that falls onto the floor, a finger of three links whose middle one is of both joints, about
 * axes at an angle, and a rack that a wheel drives against a box; then springs with tables. */
static sadmm_world *works(int precision, sadmm_method method, int substeps)
{
    static const sadmm_body_id ground = {0, 0};
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = method;
    def.settings.iterations = method == SADMM_METHOD_PAPER ? 23 : 24;
    def.settings.penalty_period = 10;
    def.settings.substeps = substeps;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    const sadmm_body_id carrier = add_box(world, 0, 0, 0.102, 0.1, 2, 0.5);
    const sadmm_joint_id one = hinge(world, carrier, add_link(world, 0.3), 0.3),
                         two = hinge(world, add_link(world, -0.3), carrier, -0.3);
    throw_body(world, body_at(world, 2), 0, 3);
    add_gear(world, one, 5, two, 5, 0.6);
    const sadmm_body_id links[3] = {add_link(world, 3), add_link(world, 3.2), add_link(world, 3.4)};
    sadmm_joint_id joints[2];
    for (int k = 0; k < 2; ++k) {
        const double place[3] = {3.1 + 0.2 * k, 0, 0}, turn[4] = {cos(0.3 * k), sin(0.3 * k), 0, 0};
        sadmm_joint_def knuckle = sadmm_joint_def_default();
        knuckle.kind = SADMM_JOINT_REVOLUTE;
        knuckle.body_a = links[k], knuckle.body_b = links[k + 1];
        MUST(world, sadmm_world_place_joint(world, &knuckle, place, turn));
        MUST(world, sadmm_world_add_joint(world, &knuckle, &joints[k]));
        throw_body(world, links[k], 0.2, 2 + k);
    }
    add_gear(world, joints[1], 5, joints[0], 5, -0.7);
    sadmm_joint_def slide = sadmm_joint_def_default();
    slide.kind = SADMM_JOINT_PRISMATIC;
    const double way[3] = {6, 0, 0.1}, along[4] = {sqrt(0.5), 0, sqrt(0.5), 0};
    slide.body_b = add_box(world, 6, 0, 0.11, 0.1, 1, 0.5);
    MUST(world, sadmm_world_place_joint(world, &slide, way, along));
    sadmm_joint_id rail;
    MUST(world, sadmm_world_add_joint(world, &slide, &rail));
    const sadmm_body_id pinion = add_link(world, 6.5);
    add_gear(world, rail, 2, hinge(world, ground, pinion, 6.5), 5, -0.1);
    throw_body(world, pinion, 0, 8);
    add_box(world, 6.21, 0.02, 0.1, 0.1, 1, 0.5);
    add_tables(world);
    use_device(world, precision, 0);
    return world;
}

static void expect_same_gears(sadmm_world *a, sadmm_world *b, const char *what)
{
    for (int32_t g = 0; g < sadmm_world_gear_count(a); ++g) {
        sadmm_gear_state x, y;
        MUST(a, sadmm_world_gear_state(a, gear_at(a, g), &x));
        MUST(b, sadmm_world_gear_state(b, gear_at(b, g), &y));
        if (EMULATED) ck_assert_msg(memcmp(&x, &y, sizeof x) == 0, "%s: gear %d: %g %g", what, g, x.force_1, y.force_1);
        ck_assert_double_le(fabs(x.error - y.error), 1e-4);
    }
}

/* What is set between two steps, in either world. */
static void change_gears(sadmm_world *world, int step)
{
    if (step == 6) MUST(world, sadmm_world_set_gear_enabled(world, gear_at(world, RACK), false));
    if (step == 8) MUST(world, sadmm_world_set_gear_enabled(world, gear_at(world, FINGER), false));
    if (step == 9) MUST(world, sadmm_world_set_joint_enabled(world, joint_at(world, 1), false));
    if (step == 11) MUST(world, sadmm_world_set_gear_enabled(world, gear_at(world, RACK), true));
    if (step == 12) MUST(world, sadmm_world_set_gear_enabled(world, gear_at(world, FINGER), true));
    if (step == 13) MUST(world, sadmm_world_set_joint_enabled(world, joint_at(world, 1), true));
}

START_TEST(resident_gears_and_tables_equal_those_by_host)
{
    const int precision = _i / WAYS, way = _i % WAYS;
    sadmm_world *worlds[2];
    char what[80];
    bool worked = false, sprung[TABLES] = {false};
    make_pair(works, precision, way, worlds);
    ck_assert_int_eq(sadmm_world_gear_count(worlds[1]), GEARS);
    for (int step = 0; step < 18; ++step) {
        step_both(worlds, change_gears, _i, step, what);
        if (step % 4 == 2) continue;
        expect_same_joints(worlds[0], worlds[1], what);
        expect_same_gears(worlds[0], worlds[1], what);
        sadmm_gear_state state;
        MUST(worlds[1], sadmm_world_gear_state(worlds[1], gear_at(worlds[1], RACK), &state));
        worked = worked || state.force_1 != 0;
        for (int k = 0; k < TABLES; ++k)
            sprung[k] = sprung[k] ||
                        joint_state(worlds[1], FIRST_TABLE + k).spring_force[k == 0 ? 5 : k == 1 ? 2 : 0] != 0;
        const bool off = step >= 6 && step < 11;
        if (off) ck_assert(state.force_1 == 0);
    }
    ck_assert(worked && sprung[0] && sprung[1] && sprung[2]);
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Saved and restored, mid-run, with a change that no step has taken along. */
START_TEST(geared_worlds_are_saved)
{
    sadmm_world *worlds[2];
    size_t size;
    make_pair(works, _i, 0, worlds);
    step_world(worlds[1], 5);
    MUST(worlds[1], sadmm_world_set_gear_enabled(worlds[1], gear_at(worlds[1], TRAIN), false));
    worlds[1]->def.backend = SADMM_BACKEND_AUTO; /* use_device has chosen */
    MUST(worlds[1], sadmm_world_save(worlds[1], NULL, 0, &size));
    void *bytes = malloc(size);
    MUST(worlds[1], sadmm_world_save(worlds[1], bytes, size, &size));
    MUST(worlds[0], sadmm_world_restore(worlds[0], bytes, size));
    for (int k = 0; k < 2; ++k) step_world(worlds[k], 4);
    ck_assert(worlds[0]->resident.loaded && worlds[1]->resident.loaded);
    expect_same_world(worlds[0], worlds[1], "restored");
    expect_same_gears(worlds[0], worlds[1], "restored");
    free(bytes);
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* ---- what is read ------------------------------------------------------------------------------------------------ */

/* The certificate and the frozen problem of a step by the device are those of the step by the host. */
START_TEST(rows_of_a_resident_step_are_read)
{
    sadmm_world *worlds[2];
    sadmm_certificate certificates[2];
    sadmm_problem *problems[2];
    for (int k = 0; k < 2; ++k) {
        worlds[k] = yard(_i, SADMM_METHOD_FAST, 1 + _i);
        if (k == 0) by_host(worlds[k]);
        step_world(worlds[k], 4);
        certificates[k] = certified_step(worlds[k]);
        MUST(worlds[k], sadmm_problem_create(&problems[k]));
        MUST(worlds[k], sadmm_world_freeze(worlds[k], problems[k]));
    }
    ck_assert(worlds[1]->resident.loaded);
    ck_assert(certificates[0].ncp_max > 0);
    /* on a GPU: sines of the device's own, and the host's rows are not its rows to the bit */
    const double close = EMULATED ? 0 : 1e-6 * certificates[0].ncp_max + (_i == SADMM_F32 ? 1e-4 : 1e-9);
    ck_assert_double_le(fabs(certificates[0].ncp_max - certificates[1].ncp_max), close);
    ck_assert_double_le(fabs(certificates[0].momentum_max - certificates[1].momentum_max), EMULATED ? 0 : 1e-3);
    ck_assert_int_eq(sadmm_problem_block_count(problems[0]), sadmm_problem_block_count(problems[1]));
    ck_assert_int_gt(sadmm_problem_block_count(problems[0]), YARD_JOINTS - 3);
    for (int k = 0; k < 2; ++k) {
        sadmm_problem_destroy(problems[k]);
        sadmm_world_destroy(worlds[k]);
    }
}
END_TEST

/* Joints that nothing touches, for a while: a door, a chain with a limit and friction, a ball joint in the air; a tower
 * beside them. A box comes to the door, and goes. */
static sadmm_world *quiet_yard(int precision, sadmm_method method, int substeps)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = method;
    def.settings.iterations = 10;
    def.settings.substeps = substeps;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    for (int i = 0; i < 3; ++i) add_box(world, -2, 0.01 * i, 0.102 + 0.201 * i, 0.1, 1 + i, 0.5);
    const sadmm_body_id leaf = add_box(world, 0.2, 0, 0.8, 0.1, 1, 0.5);
    sadmm_joint_def door = sadmm_joint_def_default();
    door.kind = SADMM_JOINT_REVOLUTE;
    join(world, &door, (sadmm_body_id){0, 0}, leaf, 0, 0, 0.8);
    sadmm_body_id last = {0, 0};
    for (int k = 0; k < 3; ++k) {
        sadmm_joint_def joint = sadmm_joint_def_default();
        const sadmm_body_id link = add_box(world, 4.1 + 0.3 * k, 0, 2, 0.05, 0.3, 0.5);
        static const double about_y[4] = {0.70710678118654752, -0.70710678118654752, 0, 0};
        const double place[3] = {4 + 0.3 * k, 0, 2};
        joint.kind = SADMM_JOINT_REVOLUTE;
        joint.coordinates[5].friction = 0.02;
        joint.coordinates[5].limited = k == 2, joint.coordinates[5].lower = -0.05, joint.coordinates[5].upper = 0.05;
        joint.body_a = last, joint.body_b = link;
        MUST(world, sadmm_world_place_joint(world, &joint, place, about_y));
        MUST(world, sadmm_world_add_joint(world, &joint, NULL));
        last = link;
    }
    sadmm_joint_def ball = sadmm_joint_def_default();
    ball.kind = SADMM_JOINT_SPHERICAL;
    const sadmm_body_id first = add_box(world, 8, 0, 3, 0.05, 0.2, 0.5),
                        second = add_box(world, 8.3, 0, 3, 0.05, 1, 0.5);
    join(world, &ball, first, second, 8.15, 0, 3);
    throw_body(world, first, 0.5, 3);
    const sadmm_body_id box = add_box(world, 0.3, -0.6, 0.8, 0.08, 0.5, 0.5);
    sadmm_body_state state = body_state(world, box);
    state.linear_velocity[1] = 3.5, state.linear_velocity[2] = 0.6; /* it is there after 0.12 s */
    MUST(world, sadmm_world_set_body_state(world, box, &state));
    use_device(world, precision, 0);
    return world;
}

START_TEST(joints_that_nothing_touches_are_solved_apart)
{
    const int precision = _i % tested_precisions(), way = _i; /* either precision, each in every other way */
    int changes = 0;
    bool last = false;
    sadmm_world *worlds[2];
    char what[80];
    make_pair(quiet_yard, precision, way, worlds);
    for (int step = 0; step < 96; ++step) {
        snprintf(what, sizeof what, "way %d, %s, step %d", way, precision ? "f64" : "f32", step);
        for (int k = 0; k < 2; ++k) {
            if (step == 90 || step == 93)
                MUST(worlds[k], sadmm_world_set_joint_enabled(worlds[k], joint_at(worlds[k], 2), step == 93));
            step_world(worlds[k], 1);
        }
        expect_same_joints(worlds[0], worlds[1], what);
        const bool apart = worlds[1]->plan.rows_apart;
        changes += apart != last;
        last = apart;
        ck_assert(!worlds[0]->plan.rows_apart);
        /* from step 16 until the box comes; 32 steps after it has gone; not with a joint that has no rows */
        if (step == 18) ck_assert_msg(apart && changes == 1, "%s", what);
        if (step == 89) ck_assert_msg(apart && changes == 3, "%s: %d changes", what, changes);
        if (step >= 90) ck_assert_msg(!apart, "%s", what);
        if (step != 89) continue;
        /* what is read of such a step is the same; on a GPU but for the reasons of rows_of_a_resident_step_are_read */
        const sadmm_certificate a = certified_step(worlds[0]), b = certified_step(worlds[1]);
        ck_assert(worlds[1]->plan.rows_apart);
        ck_assert_double_le(fabs(a.ncp_max - b.ncp_max), EMULATED ? 0 : 1e-4);
        ck_assert_double_le(fabs(a.momentum_max - b.momentum_max), EMULATED ? 0 : 1e-3);
    }
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* More than a thread block has room for: links of a chain that comes down on a floor; and contacts, of many boxes that
 * lie on one jointed body. */
static sadmm_world *large_yard(bool chain, int precision)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.iterations = 6;
    sadmm_world *world = create_world(&def);
    add_floor(world, 0.5);
    sadmm_body_id last = {0, 0};
    for (int k = 0; chain && k < 120; ++k) {
        sadmm_joint_def joint = sadmm_joint_def_default();
        const sadmm_body_id link = add_box(world, 0.12 * k + 0.06, 0, 0.049 + 0.001 * (k % 5), 0.05, 0.3, 0.5);
        joint.kind = k % 3 ? SADMM_JOINT_REVOLUTE : SADMM_JOINT_SPHERICAL;
        join(world, &joint, last, link, 0.12 * k, 0, 0.05);
        last = link;
    }
    if (!chain) {
        sadmm_joint_def hinge = sadmm_joint_def_default();
        const sadmm_body_id plate = add_box(world, 0, 0, 2, 1, 5, 0.5);
        hinge.kind = SADMM_JOINT_FIXED;
        join(world, &hinge, (sadmm_body_id){0, 0}, plate, 0, 0, 2);
        for (int k = 0; k < 289; ++k) add_box(world, 0.11 * (k % 17 - 8), 0.11 * (k / 17 - 8), 3.048, 0.05, 0.01, 0.5);
    }
    use_device(world, precision, 0);
    return world;
}

START_TEST(parts_of_any_size_are_solved)
{
    const int precision = _i % tested_precisions();
    sadmm_world *worlds[2];
    for (int k = 0; k < 2; ++k) worlds[k] = large_yard(_i < 2, precision);
    by_host(worlds[0]);
    for (int step = 0; step < 6; ++step) {
        for (int k = 0; k < 2; ++k) step_world(worlds[k], 1);
        expect_same_joints(worlds[0], worlds[1], _i < 2 ? "chain" : "plate");
    }
    ck_assert_int_gt(world_report(worlds[1]).contacts, _i < 2 ? 120 : 1000); /* a link's one; four of 289 boxes, or it
                                                                                is no test of many */
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(worlds[k]);
}
END_TEST

/* Two welds that disagree, on the device: as on the host (tests/test_articulation.c), by part solves that are exact and
 * by those that are not. */
START_TEST(locks_that_disagree_do_not_press_against_each_other)
{
    const int precision = _i % tested_precisions(), points = _i < tested_precisions() ? 0 : 64;
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.ncp_points = points;
    sadmm_world *world = create_world(&def);
    const sadmm_body_id a = add_box(world, 0, 0, 1, 0.1, 1, 0.5), b = add_box(world, 1, 0, 1, 0.1, 1, 0.5);
    sadmm_joint_def weld = sadmm_joint_def_default();
    sadmm_joint_id joints[2];
    weld.body_a = a, weld.body_b = b;
    for (int j = 0; j < 2; ++j) {
        weld.position_a[0] = 1 + 0.01 * j;
        MUST(world, sadmm_world_add_joint(world, &weld, &joints[j]));
    }
    use_device(world, precision, 0);
    for (int step = 0; step < 20; ++step) {
        step_world(world, 1);
        ck_assert(world->resident.loaded || step == 0);
        for (int j = 0; j < 2; ++j) {
            sadmm_joint_state state;
            MUST(world, sadmm_world_joint_state(world, joints[j], &state));
            for (int r = 0; r < 6; ++r)
                ck_assert_msg(fabs(state.wrench_b[r]) * def.settings.dt <= def.settings.correction_speed,
                              "ncp_points %d, step %d: %g N s", points, step, state.wrench_b[r] * def.settings.dt);
        }
    }
    sadmm_world_destroy(world);
}
END_TEST

/* A step that fails leaves joints as they were, and what was set goes along with the next one. */
START_TEST(joints_survive_a_step_that_fails)
{
    sadmm_world *world = yard(_i, SADMM_METHOD_FAST, 1);
    step_world(world, 5);
    const sadmm_joint_state before = joint_state(world, MOTOR);
    sadmm_joint_def def;
    MUST(world, sadmm_world_joint_def(world, joint_at(world, MOTOR), &def));
    def.coordinates[2].target_speed = 0;
    MUST(world, sadmm_world_set_joint_coordinate(world, joint_at(world, MOTOR), 2, &def.coordinates[2]));
    const sadmm_body_id link = body_at(world, 1);
    const sadmm_body_state state = body_state(world, link);
    sadmm_body_state fast = state;
    fast.angular_velocity[0] = 1e200; /* its square is no number */
    MUST(world, sadmm_world_set_body_state(world, link, &fast));
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
    const sadmm_joint_state after = joint_state(world, MOTOR);
    ck_assert(memcmp(&before, &after, sizeof before) == 0);
    MUST(world, sadmm_world_set_body_state(world, link, &state));
    step_world(world, 8);
    ck_assert_double_lt(fabs(joint_state(world, MOTOR).speed[2]), 0.1); /* 60 N stop 3 kg from 1 m/s in 50 ms, less
                                                                         what the load on it drags */
    sadmm_world_destroy(world);
}
END_TEST

static bool is_dynamic(sadmm_world *world, sadmm_body_id id)
{
    sadmm_body_def def;
    MUST(world, sadmm_world_body_def(world, id, &def));
    return def.type == SADMM_BODY_DYNAMIC;
}

/* Islands of the dense contact solve are solved in every step, with impulses that are those of the wrenches; and
 * iterate where nobody asks for it any more. */
START_TEST(islands_take_the_dense_contact_solve)
{
    struct sadmm_scene scene = open_scene("ragdolls:1");
    sadmm_world *world = build_scene(&scene);
    sadmm_settings settings = scene.def.settings;
    const int steps = EMULATED ? 110 : 200; /* it falls for 90 of them */
    int above = 0, pressed = 0;
    use_device(world, _i, 0);
    if (EMULATED) settings.iterations = 4;
    settings.certify = true;
    settings.ncp_points = 128;
    settings.residual_tolerance = 1e-300; /* never met: sends the world through the host */
    MUST(world, sadmm_world_set_settings(world, &settings));
    for (int step = 0; step < steps; ++step) {
        step_world(world, 1);
        above += world_report(world).certificate.ncp_max > 1e-8; /* some rows pass on 1e3 times what they hold by */
        const int32_t contacts = sadmm_world_contact_count(world), bodies = sadmm_world_body_count(world);
        double up = 0, most = 1;
        for (int32_t k = 0; k < contacts; ++k) {
            sadmm_contact contact;
            MUST(world, sadmm_world_contacts(world, k, 1, &contact));
            const bool on_floor = contact.body_a.slot == 0 || !is_dynamic(world, contact.body_a);
            up += on_floor ? contact.force[2] : 0; /* others are between two bodies */
            most = fmax(most, norm3(contact.force));
        }
        for (int32_t k = 0; k < bodies; ++k) {
            double wrench[6];
            if (!is_dynamic(world, body_at(world, k))) continue;
            MUST(world, sadmm_world_body_contact_wrench(world, body_at(world, k), wrench));
            up -= wrench[2];
        }
        /* wrenches are sums of impulses in the solver's precision */
        ck_assert_double_lt(fabs(up), (_i == 0 ? 1e-6 : 1e-9) * most);
        pressed += contacts > 0;
    }
    ck_assert_int_le(above, 2);
    ck_assert_int_gt(pressed, EMULATED ? 10 : 50);
    settings.ncp_points = 0;
    settings.residual_tolerance = 0;
    MUST(world, sadmm_world_set_settings(world, &settings));
    step_world(world, EMULATED ? 2 : 20);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("cuda_joint");
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    ADD_CASE(suite, joints_are_solved_on_the_device, 0, tested_precisions());
    ADD_CASE(suite, tables_and_gears_come_and_go, 0, tested_precisions());
    ADD_CASE(suite, resident_joints_equal_those_by_host, 0, tested_precisions() * WAYS);
    ADD_CASE(suite, resident_gears_and_tables_equal_those_by_host, 0, tested_precisions() * WAYS);
    ADD_CASE(suite, locks_that_disagree_do_not_press_against_each_other, 0, tested_precisions() * 2);
    ADD_CASE(suite, geared_worlds_are_saved, 0, tested_precisions());
    ADD_CASE(suite, joints_that_nothing_touches_are_solved_apart, 0, WAYS);
    ADD_CASE(suite, parts_of_any_size_are_solved, 0, 4);
    ADD_CASE(suite, rows_of_a_resident_step_are_read, 0, tested_precisions());
    ADD_CASE(suite, joints_survive_a_step_that_fails, 0, tested_precisions());
    ADD_CASE(suite, islands_take_the_dense_contact_solve, 0, tested_precisions());
    return run_cuda_suite(suite);
}
