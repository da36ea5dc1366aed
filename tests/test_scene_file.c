/* Scene files: what is written of a world is read to the same world, bit for bit, and written again to the same text.
 * What is refused, and the schema: test_scene_files.py. */
#include "config.h"
#include "core/base/memory.h"
#include "core/math/quat.h"
#include "core/model/settings.h"
#include "scene_tools.h"

/* ---- texts ------------------------------------------------------------------------------------------------------- */

/* The caller frees it. */
static char *text_of(const struct sadmm_scene *scene, const char *spec, sadmm_world *world, size_t *length)
{
    char *text = NULL;
    struct sadmm_error error = {0};
    FILE *stream = open_memstream(&text, length);
    const sadmm_status status = sadmm_scene_write(scene, spec, world, stream, &error);
    ck_assert_msg(status == SADMM_OK, "%s: %s", spec, error.message);
    ck_assert_int_eq(fclose(stream), 0);
    return text;
}

static struct sadmm_scene open_text(const char *text, size_t length)
{
    struct sadmm_scene scene;
    struct sadmm_error error = {0};
    const sadmm_status status = sadmm_scene_open_text(text, length, "file", &scene, &error);
    ck_assert_msg(status == SADMM_OK, "%s\n%.2000s", error.message, text);
    return scene;
}

static void expect_same(const char *text, size_t length, const char *again, size_t again_length)
{
    size_t at = 0;
    while (at < length && at < again_length && text[at] == again[at]) ++at;
    const size_t from = at < 60 ? 0 : at - 60;
    ck_assert_msg(length == again_length && at == length, "byte %zu: \"%.120s\" and \"%.120s\"", at, text + from,
                  again + from);
}

/* A world, its file, and the world of that: the same text, and the same states to the last bit, now and after steps. */
static void expect_comes_back(const struct sadmm_scene *scene, const char *spec, sadmm_world *world, int steps)
{
    size_t length, again_length;
    char *text = text_of(scene, spec, world, &length);
    struct sadmm_scene file = open_text(text, length);
    file.def.backend = scene->def.backend;
    sadmm_world *copy = build_scene(&file);
    char *again = text_of(&file, "not this one", copy, &again_length);
    expect_same(text, length, again, again_length);
    for (int step = 0; step <= steps; ++step) {
        ck_assert_msg(state_hash(world) == state_hash(copy), "%s: other states after %d steps", spec, step);
        if (step == steps) break;
        step_world(world, 1);
        step_world(copy, 1);
    }
    sadmm_world_destroy(copy);
    sadmm_scene_close(&file);
    free(text);
    free(again);
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

/* Every scene of the library, small, without its script; on the literal backend where that is quick. */
START_TEST(every_scene_comes_back)
{
    const struct sadmm_scene_info *info = sadmm_scene_at((size_t)_i);
    const bool least = !strcmp(info->name, "arch") || !strcmp(info->name, "peg_in_hole");
    char spec[64];
    snprintf(spec, sizeof spec, "%s%s", info->name, !*info->arguments ? "" : least ? ":20" : ":2");
    struct sadmm_scene scene = open_scene(spec);
    if (lacks_hulls(&scene)) return;
    for (int precision = SADMM_F32; precision <= SADMM_F64; ++precision) {
        scene.def.precision = (sadmm_precision)precision;
        scene.def.backend = SADMM_BACKEND_CPU;
        sadmm_scene_set_method(&scene, precision == SADMM_F32 ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST);
        sadmm_world *world = build_scene(&scene);
        expect_comes_back(&scene, spec, world, 3);
        const bool quick = sadmm_world_body_count(world) < 20;
        sadmm_world_destroy(world);
        if (precision != SADMM_F64 || !quick) continue;
        scene.def.backend = SADMM_BACKEND_REF;
        world = build_scene(&scene);
        expect_comes_back(&scene, spec, world, 1);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* ---- a world with everything ------------------------------------------------------------------------------------- */

static double next_number(uint64_t *state) /* splitmix64, in [-1, 1) */
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return (double)((z ^ z >> 31) >> 11) * 0x1p-52 - 1;
}

static void any_turn(uint64_t *state, double q[4])
{
    double norm2 = 0;
    for (int k = 0; k < 4; ++k) q[k] = next_number(state);
    for (int k = 0; k < 4; ++k) norm2 += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(norm2);
}

static sadmm_body_id add_ball(sadmm_world *world, double x, double z, uint64_t *state)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = 1 + 0.1 * x;
    def.position[0] = x;
    def.position[2] = z;
    def.name = "ball";
    any_turn(state, def.orientation);
    sadmm_sphere_inertia(def.mass, 0.3, def.inertia);
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static sadmm_shape_id add_shape(sadmm_world *world, sadmm_body_id body, sadmm_shape_type type, double size,
                                uint64_t *state)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_shape_id id;
    def.type = type;
    for (int k = 0; k < 3; ++k) def.size[k] = size * (1 + 0.25 * k);
    for (int k = 0; k < 3; ++k) def.position[k] = 0.05 * next_number(state);
    any_turn(state, def.orientation);
    def.friction = 0.3 + 0.1 * size;
    def.restitution = 0.125;
    def.category = 0x80000001;
    def.mask = 0xfffffffe | 1;
    def.sensor = type == SADMM_SHAPE_CONE;
    MUST(world, sadmm_world_add_shape(world, body, &def, &id));
    return id;
}

static void add_ground(sadmm_world *world, uint64_t *state)
{
    static double heights[4 * 5];
    sadmm_heightfield_def field = sadmm_heightfield_def_default();
    sadmm_mesh_def triangles = sadmm_mesh_def_default();
    static const double corners[5 * 3] = {0.1, 0, 0.7, 1.3, 0.1, 0, 0.2, 1.7, 0, 7, 7, 7, -0.9, -0.8, 0.3};
    static const int32_t faces[3 * 3] = {0, 1, 2, 0, 0, 1, 0, 2, 4};
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id body;
    sadmm_mesh *mesh;
    for (int k = 0; k < 20; ++k) heights[k] = 0.1 * next_number(state) + 1.0 / 3;
    field.heights = heights;
    field.columns = 4;
    field.rows = 5;
    field.spacing[0] = 3;
    field.spacing[1] = 0.7;
    triangles.vertices = corners;
    triangles.vertex_count = 5;
    triangles.triangles = faces;
    triangles.triangle_count = 3;
    def.type = SADMM_BODY_STATIC;
    def.environment = -1;
    def.position[2] = -2;
    MUST(world, sadmm_world_add_body(world, &def, &body));
    add_shape(world, body, SADMM_SHAPE_PLANE, 1, state);
    for (int k = 0; k < 2; ++k) {
        sadmm_shape_def shape = sadmm_shape_def_default();
        ck_assert_int_eq(k ? sadmm_mesh_create(&triangles, &mesh) : sadmm_heightfield_create(&field, &mesh), SADMM_OK);
        shape.type = SADMM_SHAPE_MESH;
        shape.mesh = mesh;
        any_turn(state, shape.orientation);
        MUST(world, sadmm_world_add_shape(world, body, &shape, NULL));
        MUST(world, sadmm_world_add_shape(world, body, &shape, NULL));
        sadmm_mesh_destroy(mesh);
    }
}

/* Two hulls that differ in what they are rounded and merged by alone; nothing where there are no hulls. */
static void add_hulls(sadmm_world *world, sadmm_body_id body, uint64_t *state)
{
    double points[3 * 40];
    sadmm_hull_def def = sadmm_hull_def_default();
    for (int k = 0; k < 120; ++k) points[k] = 0.2 * next_number(state);
    def.points = points;
    def.point_count = 40;
    for (int k = 0; k < 2; ++k) {
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_hull *hull;
        def.merge = k ? 1e-2 : 0;
        def.convex_radius = k ? 0 : 0.03;
        const sadmm_status status = sadmm_hull_create(&def, &hull);
        if (status == SADMM_ERROR_UNAVAILABLE) return;
        ck_assert_int_eq(status, SADMM_OK);
        shape.type = SADMM_SHAPE_HULL;
        shape.hull = hull;
        any_turn(state, shape.orientation);
        MUST(world, sadmm_world_add_shape(world, body, &shape, NULL));
        sadmm_hull_destroy(hull);
    }
}

static void add_joints(sadmm_world *world, const sadmm_body_id *balls, uint64_t *state)
{
    static const double positions[3] = {-0.1, 0, 1.0 / 3}, forces[3] = {-2, 0.1, 7};
    sadmm_joint_id hinges[2], id;
    for (int kind = 0; kind < SADMM_JOINT_KIND_COUNT; ++kind) {
        sadmm_joint_def def = sadmm_joint_def_default();
        def.kind = (sadmm_joint_kind)kind;
        def.locks = kind == SADMM_JOINT_CUSTOM ? 21 : 0;
        def.body_a = kind % 3 ? balls[kind % 4] : (sadmm_body_id){0, 0};
        def.body_b = balls[4 + kind % 4];
        for (int k = 0; k < 3; ++k) def.position_a[k] = next_number(state), def.position_b[k] = next_number(state);
        any_turn(state, def.orientation_a);
        any_turn(state, def.orientation_b);
        def.collide = kind % 2;
        def.enabled = kind != SADMM_JOINT_PLANAR;
        if (kind == SADMM_JOINT_LINK) def.length = 0.75;
        if (kind % 4 == 1) def.break_force = 1e4;
        if (kind == SADMM_JOINT_REVOLUTE)
            def.coordinates[5] = (sadmm_joint_coordinate){.limited = true,
                                                          .lower = -INFINITY,
                                                          .upper = 2.5,
                                                          .drive = SADMM_DRIVE_SPEED,
                                                          .target_speed = 0.1,
                                                          .drive_force = 20,
                                                          .friction = 0.01,
                                                          .spring_stiffness = 3,
                                                          .spring_damping = 0.5,
                                                          .spring_rest = 0.2,
                                                          .armature = 1e-3};
        if (kind == SADMM_JOINT_PRISMATIC)
            def.coordinates[2] = (sadmm_joint_coordinate){.limited = true,
                                                          .lower = -1,
                                                          .upper = 1,
                                                          .drive = SADMM_DRIVE_POSITION,
                                                          .target_position = 0.1,
                                                          .drive_stiffness = 100,
                                                          .drive_damping = 10,
                                                          .drive_force = INFINITY};
        MUST(world, sadmm_world_add_joint(world, &def, &id));
        if (kind == SADMM_JOINT_SPRING)
            MUST(world, sadmm_world_set_joint_spring_table(world, id, 0, positions, forces, 3));
    }
    for (int k = 0; k < 2; ++k) {
        sadmm_joint_def def = sadmm_joint_def_default();
        def.kind = SADMM_JOINT_CYLINDRICAL;
        def.name = k ? "hinge \"B\"" : NULL;
        def.body_b = balls[8 + k];
        MUST(world, sadmm_world_add_joint(world, &def, &hinges[k]));
    }
    for (int k = 0; k < 2; ++k) {
        sadmm_gear_def def = sadmm_gear_def_default();
        def.joint_1 = hinges[0];
        def.joint_2 = hinges[1];
        def.coordinate_1 = k ? 2 : 5;
        def.coordinate_2 = 5;
        def.ratio = k ? -0.3 : 1.0 / 7;
        def.enabled = k == 0;
        def.name = k ? "screw" : NULL;
        MUST(world, sadmm_world_add_gear(world, &def, NULL));
    }
}

static void add_coupling(sadmm_world *world, sadmm_body_id body, uint64_t *state)
{
    sadmm_coupling_def def = sadmm_coupling_def_default();
    def.body = body;
    any_turn(state, def.orientation);
    any_turn(state, def.target_orientation);
    def.target_position[0] = 1.0 / 3;
    def.target_velocity[5] = -0.1;
    def.linear_stiffness = 1e3;
    def.linear_damping = 11;
    def.angular_stiffness = 7;
    def.angular_damping = 0.7;
    def.max_force = 50;
    MUST(world, sadmm_world_add_coupling(world, &def, NULL));
    def.enabled = false;
    def.name = "h\xc3\xa4nd";
    MUST(world, sadmm_world_add_coupling(world, &def, NULL));
}

/* Bodies 0 to 11 are balls, others were removed; shapes were not made body by body. */
static sadmm_world *world_with_everything(struct sadmm_scene *scene)
{
    uint64_t state = 1;
    const double force[3] = {0.1, -2, 1.0 / 3}, torque[3] = {0, 1e-3, -1e15};
    sadmm_body_id balls[12], gone;
    sadmm_shape_id shapes[12];
    *scene = open_scene("incline");
    scene->def.settings.gravity[0] = 1e-300;
    scene->def.settings.certify = true;
    scene->def.settings.threads = 2;
    scene->def.settings.iterations = 37;
    scene->def.contact_margin = 1.0 / 3;
    sadmm_world *world = create_world(&scene->def);
    gone = add_ball(world, -3, 5, &state);
    add_ground(world, &state);
    for (int k = 0; k < 12; ++k) balls[k] = add_ball(world, k, 2 + 0.1 * k, &state);
    MUST(world, sadmm_world_remove_body(world, gone));
    static const sadmm_shape_type types[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,
                                             SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
    for (int k = 11; k >= 0; --k) shapes[k] = add_shape(world, balls[k], types[k % 6], 0.2, &state);
    add_shape(world, balls[5], SADMM_SHAPE_BOX, 0.1, &state);
    add_hulls(world, balls[3], &state);
    sadmm_body_def kinematic = sadmm_body_def_default();
    kinematic.type = SADMM_BODY_KINEMATIC;
    kinematic.angular_velocity[1] = 0.3;
    kinematic.position[1] = 20;
    sadmm_body_id belt;
    MUST(world, sadmm_world_add_body(world, &kinematic, &belt)); /* in the first slot */
    any_turn(&state, kinematic.orientation);
    MUST(world, sadmm_world_move_body(world, belt, force, kinematic.orientation));
    add_shape(world, belt, SADMM_SHAPE_BOX, 0.4, &state);
    MUST(world, sadmm_world_set_body_wrench(world, balls[1], force, torque));
    MUST(world, sadmm_world_set_body_gravity_scale(world, balls[2], -0.5));
    MUST(world, sadmm_world_set_body_damping(world, balls[2], 0.1, 1.0 / 3));
    MUST(world, sadmm_world_set_pair_friction(world, shapes[7], shapes[2], 0.77));
    MUST(world, sadmm_world_set_pair_friction(world, shapes[0], shapes[2], 0));
    MUST(world, sadmm_world_set_body_pair_contact(world, balls[6], balls[7], false));
    add_joints(world, balls, &state);
    add_coupling(world, balls[10], &state);
    return world;
}

START_TEST(everything_comes_back)
{
    struct sadmm_scene scene;
    sadmm_world *world = world_with_everything(&scene);
    expect_comes_back(&scene, "\"every\" thing\\\n", world, 0);
    sadmm_world_destroy(world);
    scene.def.settings.certify = false; /* its joints do not fit: nothing to be exact about */
    world = world_with_everything(&scene);
    MUST(world, sadmm_world_set_body_wrench(world, body_at(world, 3), (double[3]){0}, (double[3]){0}));
    for (int32_t k = sadmm_world_joint_count(world); k-- > 0;) {
        sadmm_joint_id id;
        MUST(world, sadmm_world_joint_at(world, k, &id));
        if (k < 12) MUST(world, sadmm_world_remove_joint(world, id));
    }
    expect_comes_back(&scene, "steps", world, 3);
    sadmm_world_destroy(world);
}
END_TEST

/* What the text says is what the calls said. */
START_TEST(everything_is_reported)
{
    static const char *const said[] = {
        "\"force\": [0.1, -2.0, 0.3333333333333333]",
        "\"torque\": [0.0, 0.001, -1e+15]",
        "\"gravity_scale\": -0.5",
        "\"linear_damping\": 0.1",
        "\"category\": 2147483649",
        "\"sensor\": true",
        "\"certify\": true",
        "\"threads\": 2",
        "\"iterations\": 37",
        "\"contact_margin\": 0.3333333333333333",
        "\"limits\": [null, 2.5]",
        "\"limits\": [-1.0, 1.0]",
        "\"break_force\": 10000.0",
        "\"break_force\": null",
        "\"drive\": \"position\"",
        "\"positions\": [-0.1, 0.0, 0.3333333333333333]",
        "\"forces\": [-2.0, 0.1, 7.0]",
        "\"length\": 0.75",
        "\"ratio\": -0.3",
        "\"max_force\": 50.0",
        "\"max_torque\": null",
        "\"friction\": 0.77",
        "\"armature\": 0.001",
        "\"spacing\": [3.0, 0.7]",
        "\"type\": \"kinematic\"",
        "\"locks\": 21",
        "\"enabled\": false",
        "\"index\": 17",
        "\"contact_off\": [\n    {\n      \"body_a\": 8,\n      \"body_b\": 9\n    }\n  ]",
        "\"gravity\": [1e-300, 0.0, -9.81]",
        "\"m\": null",
    };
    struct sadmm_scene scene;
    sadmm_world *world = world_with_everything(&scene);
    size_t length;
    char *text = text_of(&scene, "everything", world, &length);
    for (size_t k = 0; k < sizeof said / sizeof *said; ++k)
        ck_assert_msg(strstr(text, said[k]) != NULL, "%s is not there", said[k]);
    free(text);
    sadmm_world_destroy(world);
}
END_TEST

/* A world that has made steps: as it is, which is not what a definition would make of it. */
START_TEST(a_state_of_a_run_comes_back)
{
    struct sadmm_scene scene = open_scene("pile:8");
    scene.def.backend = SADMM_BACKEND_CPU;
    sadmm_world *world = build_scene(&scene);
    step_world(world, 40);
    expect_comes_back(&scene, "pile:8", world, 0);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- what is left out -------------------------------------------------------------------------------------------- */

#define HEAD "{\"format\": \"subadmm scene\", \"format_version\": 1"

static struct sadmm_scene open_words(const char *text) { return open_text(text, strlen(text)); }

START_TEST(what_is_left_out_is_the_default)
{
    struct sadmm_scene scene = open_words(HEAD "}");
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_settings settings = scene.def.settings;
    settings.threads = def.settings.threads;
    ck_assert(sadmm_settings_equal(&settings, &def.settings));
    ck_assert(scene.def.precision == def.precision && scene.def.contact_margin == def.contact_margin);
    ck_assert(scene.duration == 1 && scene.n == 0 && scene.m == 0 && *scene.info->name == 0);
    sadmm_world *world = build_scene(&scene);
    ck_assert_int_eq(sadmm_world_body_count(world), 0);
    step_world(world, 1);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);

    scene = open_words(HEAD ", \"bodies\": [{\"mass\": 1, \"inertia\": [1, 1, 1], \"shapes\": [{\"type\": \"sphere\", "
                            "\"size\": [1e0]}]}, {\"type\": \"static\"}], \"joints\": [{\"body_b\": 0}], "
                            "\"couplings\": [{\"body\": 0}]}");
    world = build_scene(&scene);
    sadmm_body_def body = body_def(world, body_at(world, 0)), plain = sadmm_body_def_default();
    ck_assert(body.gravity_scale == 1 && body.environment == 0 && body.orientation[0] == 1 && *body.name == 0);
    ck_assert_mem_eq(body.position, plain.position, sizeof plain.position);
    sadmm_shape_id shape;
    sadmm_shape_def shape_def, plain_shape = sadmm_shape_def_default();
    MUST(world, sadmm_world_shape_at(world, 0, &shape));
    MUST(world, sadmm_world_shape_def(world, shape, &shape_def, NULL));
    ck_assert(shape_def.friction == plain_shape.friction && shape_def.mask == plain_shape.mask);
    sadmm_joint_id joint;
    sadmm_joint_def joint_def;
    MUST(world, sadmm_world_joint_at(world, 0, &joint));
    MUST(world, sadmm_world_joint_def(world, joint, &joint_def));
    ck_assert(joint_def.kind == SADMM_JOINT_FIXED && isinf(joint_def.break_force) && joint_def.enabled);
    ck_assert(!joint_def.coordinates[3].limited && isinf(joint_def.coordinates[3].drive_force));
    sadmm_coupling_id coupling;
    sadmm_coupling_def coupling_def;
    MUST(world, sadmm_world_coupling_at(world, 0, &coupling));
    MUST(world, sadmm_world_coupling_def(world, coupling, &coupling_def));
    ck_assert(isinf(coupling_def.max_force) && coupling_def.enabled && coupling_def.target_orientation[0] == 1);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
}
END_TEST

/* Bodies by their names; coordinates that are null. */
START_TEST(names_stand_for_bodies)
{
    struct sadmm_scene scene = open_words(
        HEAD
        ", \"bodies\": [{\"name\": \"frame\", \"type\": \"static\"}, {\"mass\": 1, \"inertia\": [1, 1, 1], \"name\": "
        "\"arm\"}], \"joints\": [{\"kind\": \"revolute\", \"body_a\": \"frame\", \"body_b\": \"arm\", "
        "\"coordinates\": [null, null, null, null, null, {\"limits\": [-1, null]}]}]}");
    sadmm_world *world = build_scene(&scene);
    sadmm_joint_id id;
    sadmm_joint_def def;
    MUST(world, sadmm_world_joint_at(world, 0, &id));
    MUST(world, sadmm_world_joint_def(world, id, &def));
    ck_assert_uint_eq(def.body_a.slot, body_at(world, 0).slot);
    ck_assert_uint_eq(def.body_b.slot, body_at(world, 1).slot);
    ck_assert(def.coordinates[5].limited && def.coordinates[5].lower == -1 && def.coordinates[5].upper == INFINITY);
    ck_assert(!def.coordinates[4].limited);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
}
END_TEST

/* Of shapes, joints, gears and couplings; a gear's joints by theirs. */
START_TEST(all_objects_have_names)
{
    struct sadmm_scene scene = open_words(
        HEAD ", \"bodies\": [{\"mass\": 1, \"inertia\": [1, 1, 1], \"shapes\": [{\"type\": \"sphere\", \"size\": [1], "
             "\"name\": \"tip\"}]}, {\"mass\": 1, \"inertia\": [1, 1, 1]}], \"joints\": [{\"kind\": \"revolute\", "
             "\"body_b\": 0, \"name\": \"left\"}, {\"kind\": \"revolute\", \"body_b\": 1, \"name\": \"right\"}], "
             "\"gears\": [{\"joint_1\": \"right\", \"coordinate_1\": 5, \"joint_2\": 0, \"coordinate_2\": 5, "
             "\"name\": \"pair\"}], \"couplings\": [{\"body\": 1, \"name\": \"hand\"}]}");
    sadmm_world *world = build_scene(&scene);
    sadmm_shape_id shape;
    sadmm_joint_id right;
    sadmm_gear_id gear;
    sadmm_coupling_id coupling;
    sadmm_gear_def def;
    MUST(world, sadmm_world_shape_named(world, "tip", &shape));
    MUST(world, sadmm_world_joint_named(world, "right", &right));
    MUST(world, sadmm_world_gear_named(world, "pair", &gear));
    MUST(world, sadmm_world_coupling_named(world, "hand", &coupling));
    MUST(world, sadmm_world_gear_def(world, gear, &def));
    ck_assert_uint_eq(def.joint_1.slot, right.slot);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);

    scene = open_words(HEAD ", \"bodies\": [{\"mass\": 1, \"inertia\": [1, 1, 1]}], \"joints\": [{\"kind\": "
                            "\"cylindrical\", \"body_b\": 0}], \"gears\": [{\"joint_1\": \"none\", "
                            "\"coordinate_1\": 5, \"joint_2\": 0, \"coordinate_2\": 2}]}");
    struct sadmm_error error = {0};
    ck_assert_int_eq(sadmm_scene_build(&scene, &world, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(strstr(error.message, "gears[0]") && strstr(error.message, "the name of one joint"), "%s",
                  error.message);
    sadmm_scene_close(&scene);
}
END_TEST

/* ---- density ----------------------------------------------------------------------------------------------------- */

static void expect_vector(const double *a, const double *b, int count, double tolerance)
{
    for (int k = 0; k < count; ++k) ck_assert_double_eq_tol(a[k], b[k], tolerance);
}

/* A point on a body, in the world. */
static void place_of(sadmm_world *world, sadmm_body_id id, const double local[3], double out[3])
{
    const sadmm_body_def def = body_def(world, id);
    v3_store(v3_add(v3_load(def.position), m3_mul(q_matrix(q_load(def.orientation)), v3_load(local))), out);
}

/* A box about the origin is the one with its mass and moments, bit for bit. */
START_TEST(density_is_mass_and_inertia)
{
    static const char *const texts[] = {
        HEAD ", \"bodies\": [{\"density\": 3, \"orientation\": [0.6, 0, 0.8, 0], \"shapes\": [{\"type\": \"box\", "
             "\"size\": [1, 1, 1]}, {\"type\": \"sphere\", \"size\": [9], \"sensor\": true}]}]}",
        HEAD ", \"bodies\": [{\"mass\": 24, \"inertia\": [16, 16, 16], \"orientation\": [0.6, 0, 0.8, 0], \"shapes\": ["
             "{\"type\": \"box\", \"size\": [1, 1, 1]}, {\"type\": \"sphere\", \"size\": [9], \"sensor\": true}]}]}",
    };
    char *written[2];
    size_t lengths[2];
    for (int k = 0; k < 2; ++k) {
        struct sadmm_scene scene = open_words(texts[k]);
        sadmm_world *world = build_scene(&scene);
        expect_comes_back(&scene, "file", world, 3);
        written[k] = text_of(&scene, "file", world, &lengths[k]);
        sadmm_world_destroy(world);
        sadmm_scene_close(&scene);
    }
    ck_assert_ptr_null(strstr(written[0], "density")); /* mass and inertia say it */
    expect_same(written[0], lengths[0], written[1], lengths[1]);
    free(written[0]);
    free(written[1]);
}
END_TEST

/* A hammer: a head across the end of a handle, in the frame that it was drawn in. The handle, half lengths 0.1 x 0.1 x
 * 1, is at the origin; the head, 0.5 x 0.1 x 0.1, around x = 0.2, z = 1. Where its shapes, a joint and a coupling are
 * in the world stays as drawn, while the body's own frame is that of its principal axes. */
static const char hammer[] =
    HEAD ", \"bodies\": [{\"name\": \"hammer\", \"density\": 1000, \"position\": [1, 2, 3], \"orientation\": "
         "[0.6, 0, 0, 0.8], \"shapes\": [{\"type\": \"box\", \"size\": [0.1, 0.1, 1]}, {\"type\": \"box\", "
         "\"size\": [0.5, 0.1, 0.1], \"position\": [0.2, 0, 1]}]}], "
         "\"joints\": [{\"kind\": \"spherical\", \"body_b\": 0, \"position_b\": [0, 0, -1]}], "
         "\"couplings\": [{\"body\": 0, \"position\": [0.7, 0, 1], \"orientation\": [0, 1, 0, 0]}]}";

START_TEST(density_turns_what_is_on_a_body)
{
    static const double at[3] = {1, 2, 3}, turn[4] = {0.6, 0, 0, 0.8}, tolerance = 1e-12; /* rounding */
    static const double drawn[][3] = {{0, 0, 0}, {0.2, 0, 1}, {0, 0, -1}, {0.7, 0, 1}};
    struct sadmm_scene scene = open_words(hammer);
    sadmm_world *world = build_scene(&scene);
    const sadmm_body_id id = body_at(world, 0);
    const sadmm_body_def body = body_def(world, id);
    /* 1000 x (0.2 x 0.2 x 2 + 1 x 0.2 x 0.2) */
    ck_assert_double_eq_tol(body.mass, 80 + 40, 1e-10);
    /* the centre: (0.2, 0, 1) x 40 / 120, turned about z by the cosine 0.6^2 - 0.8^2 and the sine 2 x 0.6 x 0.8 */
    const double x = 0.2 / 3;
    const double centre[3] = {1 - 0.28 * x, 2 + 0.96 * x, 3 + 1.0 / 3};
    expect_vector(body.position, centre, 3, tolerance);
    /* the trace of the moments: of both, and twice the mass times the square of the arm */
    const double own = 2 * 80.0 / 3 * (0.01 + 0.01 + 1) + 2 * 40.0 / 3 * (0.25 + 0.01 + 0.01);
    const double arms = 2 * (80.0 * 40 / 120) * (0.2 * 0.2 + 1);
    ck_assert_double_eq_tol(body.inertia[0] + body.inertia[1] + body.inertia[2], own + arms, 1e-10);
    const mat3 frame = q_matrix(q_load(turn));
    sadmm_joint_id joint;
    sadmm_joint_def joint_def;
    sadmm_coupling_id coupling;
    sadmm_coupling_def coupling_def;
    MUST(world, sadmm_world_joint_at(world, 0, &joint));
    MUST(world, sadmm_world_joint_def(world, joint, &joint_def));
    MUST(world, sadmm_world_coupling_at(world, 0, &coupling));
    MUST(world, sadmm_world_coupling_def(world, coupling, &coupling_def));
    for (int k = 0; k < 4; ++k) {
        double wanted[3], got[3];
        sadmm_shape_id shape;
        sadmm_shape_def shape_def;
        v3_store(v3_add(v3_load(at), m3_mul(frame, v3_load(drawn[k]))), wanted);
        if (k < 2) {
            MUST(world, sadmm_world_shape_at(world, k, &shape));
            MUST(world, sadmm_world_shape_def(world, shape, &shape_def, NULL));
            /* and turned back: the boxes have the orientation of the drawing's frame */
            const quat both = q_mul(q_load(body.orientation), q_load(shape_def.orientation));
            const double sign = both.w < 0 ? -1 : 1, got_turn[4] = {both.w, both.x, both.y, both.z};
            for (int i = 0; i < 4; ++i) ck_assert_double_eq_tol(sign * got_turn[i], turn[i], tolerance);
        }
        place_of(world, id, k < 2 ? shape_def.position : k == 2 ? joint_def.position_b : coupling_def.position, got);
        expect_vector(got, wanted, 3, tolerance);
    }
    expect_comes_back(&scene, "file", world, 3);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
}
END_TEST

#ifdef SADMM_HAVE_QHULL
/* A hull has the mass of the box that it is, in a frame away from its middle. */
START_TEST(density_of_hulls)
{
    struct sadmm_scene scene = open_words(
        HEAD ", \"bodies\": [{\"density\": 1000, \"shapes\": [{\"type\": \"hull\", \"hull\": 0}]}], \"hulls\": ["
             "{\"points\": [[0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 2, 0], [0, 0, 3], [1, 0, 3], [0, 2, 3], "
             "[1, 2, 3]]}]}");
    sadmm_world *world = build_scene(&scene);
    const sadmm_body_def body = body_def(world, body_at(world, 0));
    static const double middle[3] = {0.5, 1, 1.5};
    double sum = 0;
    ck_assert_double_eq_tol(body.mass, 6000, 1e-9);
    expect_vector(body.position, middle, 3, 1e-12);
    for (int k = 0; k < 3; ++k) sum += body.inertia[k];
    ck_assert_double_eq_tol(sum, 6000.0 / 6 * (1 + 4 + 9), 1e-8); /* twice the mass over 12 times the edges' squares */
    expect_comes_back(&scene, "file", world, 2);
    sadmm_world_destroy(world);
    sadmm_scene_close(&scene);
}
END_TEST
#endif

/* The numbers of a method: those of settings for their own, and what the file says of others. */
START_TEST(methods_have_their_numbers)
{
    static const struct {
        const char *text;
        int fast, paper, fast_substeps, paper_substeps;
    } cases[] = {
        {HEAD "}", 200, 100, 1, 1},
        {HEAD ", \"iterations\": {\"fast\": 7, \"paper\": 8}, \"substeps\": {\"fast\": 2}}", 7, 8, 2, 1},
        {HEAD ", \"iterations\": {\"fast\": 7}, \"settings\": {\"iterations\": 9, \"substeps\": 3}}", 9, 100, 3, 1},
        {HEAD
         ", \"iterations\": {\"fast\": 7}, \"settings\": {\"method\": \"paper\", \"iterations\": 9, \"substeps\": 2}}",
         7, 9, 1, 2},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        struct sadmm_scene scene = open_words(cases[k].text);
        const sadmm_settings own = scene.def.settings;
        const bool fast = own.method == SADMM_METHOD_FAST;
        ck_assert_int_eq(own.iterations, fast ? cases[k].fast : cases[k].paper);
        ck_assert_int_eq(own.substeps, fast ? cases[k].fast_substeps : cases[k].paper_substeps);
        sadmm_scene_set_method(&scene, SADMM_METHOD_FAST);
        ck_assert_int_eq(scene.def.settings.iterations, cases[k].fast);
        ck_assert_int_eq(scene.def.settings.substeps, cases[k].fast_substeps);
        sadmm_scene_set_method(&scene, SADMM_METHOD_PAPER);
        ck_assert_int_eq(scene.def.settings.iterations, cases[k].paper);
        ck_assert_int_eq(scene.def.settings.substeps, cases[k].paper_substeps);
        sadmm_scene_close(&scene);
    }
}
END_TEST

/* A file of a scene with a script and a measure of success has neither. */
START_TEST(files_have_no_script)
{
    struct sadmm_scene scene = open_scene("jenga"), file;
    sadmm_world *world = build_scene(&scene);
    struct sadmm_scene_result result = {0};
    size_t length;
    char *text = text_of(&scene, "jenga", world, &length);
    file = open_text(text, length);
    ck_assert_str_eq(file.info->name, "jenga");
    ck_assert_int_eq(sadmm_scene_observe(&file, world, 0, &result, NULL), SADMM_OK);
    ck_assert_int_eq(result.task_count, 0);
    const uint64_t before = state_hash(world);
    ck_assert_int_eq(sadmm_scene_before_step(&file, world, 300, NULL), SADMM_OK);
    ck_assert_uint_eq(state_hash(world), before);
    sadmm_scene_close(&file);
    sadmm_scene_close(&file); /* once more is fine, as is one of the library */
    sadmm_scene_close(&scene);
    sadmm_scene_close(NULL);
    sadmm_world_destroy(world);
    ck_assert_int_eq(sadmm_scene_build(&file, &world, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    free(text);
}
END_TEST

/* ---- what is refused --------------------------------------------------------------------------------------------- */

static void expect_refused(sadmm_status got, sadmm_status wanted, const struct sadmm_error *error, const char *says)
{
    ck_assert_msg(got == wanted && strstr(error->message, says), "%s, \"%s\": expected %s, \"%s\"",
                  sadmm_status_name(got), error->message, sadmm_status_name(wanted), says);
}

START_TEST(arguments_are_checked)
{
    struct sadmm_scene scene, plain = open_scene("incline");
    struct sadmm_error error;
    sadmm_world *world = build_scene(&plain);
    expect_refused(sadmm_scene_open_file(NULL, &scene, &error), SADMM_ERROR_INVALID_ARGUMENT, &error, "path = NULL");
    expect_refused(sadmm_scene_open_file("x", NULL, &error), SADMM_ERROR_INVALID_ARGUMENT, &error, "out = NULL");
    expect_refused(sadmm_scene_open_file("/no/such.json", &scene, &error), SADMM_ERROR_IO, &error,
                   "/no/such.json: could not be opened: No such file");
    expect_refused(sadmm_scene_open("/tmp/", &scene, &error), SADMM_ERROR_IO, &error, "/tmp/: could not be read: Is a");
    expect_refused(sadmm_scene_open("no.json", &scene, &error), SADMM_ERROR_IO, &error, "no.json: could not be opened");
    expect_refused(sadmm_scene_open("json", &scene, &error), SADMM_ERROR_INVALID_ARGUMENT, &error, "must be one of");
    expect_refused(sadmm_scene_open_text(NULL, 0, "x", &scene, &error), SADMM_ERROR_INVALID_ARGUMENT, &error,
                   "text = NULL");
    expect_refused(sadmm_scene_open_text("", 0, NULL, NULL, &error), SADMM_ERROR_INVALID_ARGUMENT, &error,
                   "out = NULL");
    expect_refused(sadmm_scene_open_text("", 0, NULL, &scene, &error), SADMM_ERROR_INVALID_ARGUMENT, &error,
                   "line 1, column 0: '[' or '{' expected");
    expect_refused(sadmm_scene_open_text("{\n1", 3, "x", &scene, &error), SADMM_ERROR_INVALID_ARGUMENT, &error,
                   "x: line 2, column 1: ");
    expect_refused(sadmm_scene_write(NULL, "x", world, stdout, &error), SADMM_ERROR_INVALID_ARGUMENT, &error,
                   "scene: must");
    expect_refused(sadmm_scene_write(&plain, "x", NULL, stdout, &error), SADMM_ERROR_INVALID_ARGUMENT, &error,
                   "world =");
    expect_refused(sadmm_scene_write(&plain, "x", world, NULL, &error), SADMM_ERROR_INVALID_ARGUMENT, &error,
                   "stream =");
    FILE *full = fopen("/dev/full", "w");
    if (full) {
        setvbuf(full, NULL, _IONBF, 0);
        expect_refused(sadmm_scene_write(&plain, "x", world, full, &error), SADMM_ERROR_IO, &error,
                       "could not be written");
        fclose(full);
    }
    sadmm_world_destroy(world);
}
END_TEST

/* Each allocation of the library fails once: nothing is lost, and nothing is left in hand. */
/* Wherever it runs out as the text is read and a world built. */
static void expect_said_without_memory(const char *text, size_t length)
{
    struct sadmm_scene file;
    struct sadmm_error error;
    sadmm_world *copy;
    bool built = false;
    for (long allocations = 0; !built; ++allocations) {
        ck_assert_int_lt(allocations, 5000);
        sadmm_test_fail_allocations_after(allocations);
        sadmm_status status = sadmm_scene_open_text(text, length, "file", &file, &error);
        const bool opened = status == SADMM_OK;
        if (opened) status = sadmm_scene_build(&file, &copy, &error);
        sadmm_test_fail_allocations_after(-1);
        ck_assert_msg(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY, "%s", error.message);
        built = status == SADMM_OK;
        if (built) sadmm_world_destroy(copy);
        if (opened) sadmm_scene_close(&file);
    }
}

START_TEST(memory_may_run_out)
{
    struct sadmm_scene scene;
    sadmm_world *world = world_with_everything(&scene);
    size_t length;
    char *text = text_of(&scene, "everything", world, &length);
    struct sadmm_error error;
    expect_said_without_memory(text, length);
    expect_said_without_memory(hammer, strlen(hammer));
    bool written = false;
    for (long allocations = 0; !written; ++allocations) {
        ck_assert_int_lt(allocations, 100);
        FILE *stream = fopen("/dev/null", "w");
        sadmm_test_fail_allocations_after(allocations);
        const sadmm_status status = sadmm_scene_write(&scene, "x", world, stream, &error);
        sadmm_test_fail_allocations_after(-1);
        ck_assert_msg(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY, "%s", error.message);
        written = status == SADMM_OK;
        fclose(stream);
    }
    free(text);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("scene_file");
    TCase *tests = tcase_create("scene_file");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, every_scene_comes_back, 0, (int)sadmm_scene_count());
    tcase_add_test(tests, everything_comes_back);
    tcase_add_test(tests, everything_is_reported);
    tcase_add_test(tests, a_state_of_a_run_comes_back);
    tcase_add_test(tests, what_is_left_out_is_the_default);
    tcase_add_test(tests, names_stand_for_bodies);
    tcase_add_test(tests, all_objects_have_names);
    tcase_add_test(tests, density_is_mass_and_inertia);
    tcase_add_test(tests, density_turns_what_is_on_a_body);
#ifdef SADMM_HAVE_QHULL
    tcase_add_test(tests, density_of_hulls);
#endif
    tcase_add_test(tests, methods_have_their_numbers);
    tcase_add_test(tests, files_have_no_script);
    tcase_add_test(tests, arguments_are_checked);
    tcase_add_test(tests, memory_may_run_out);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
