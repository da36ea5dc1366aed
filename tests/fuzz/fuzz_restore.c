/* Saved worlds with some of their bytes changed, cut short or added to: the input says which world, and how. With its
 * checksum as it was it is refused, and nothing changes. With the checksum put right it is refused likewise, or it is
 * the state of some world: all of that can be read and stepped, and saved to the same bytes. */
#include <stdlib.h>
#include <string.h>

#include "bytes.h"
#include "subadmm/subadmm.h"
#include "world/save/save.h"

enum { WORLDS = 4, MOST_CHANGES = 8 };

static struct {
    unsigned char *bytes;
    size_t size;
} saved[WORLDS];

static sadmm_body_id add(sadmm_world *world, sadmm_body_type type, sadmm_shape_type shape_type, double x, double z)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = type;
    body.mass = 1;
    body.inertia[0] = body.inertia[1] = body.inertia[2] = 0.01;
    body.position[0] = x;
    body.position[2] = z;
    body.name = "body";
    MUST(sadmm_world_add_body(world, &body, &id) == SADMM_OK, "a body");
    shape.type = shape_type;
    for (int k = 0; k < 3; ++k) shape.size[k] = 0.1;
    MUST(sadmm_world_add_shape(world, id, &shape, NULL) == SADMM_OK, "a shape");
    return id;
}

static void add_hull(sadmm_world *world, sadmm_body_id body)
{
    const double corners[5][3] = {{0, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0}, {0, 0, 0.2}, {0.15, 0.15, 0.15}};
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_hull *hull;
    def.points = corners[0];
    def.point_count = 5;
    if (sadmm_hull_create(&def, &hull) != SADMM_OK) return; /* built without what makes them */
    shape.type = SADMM_SHAPE_HULL;
    shape.hull = hull;
    MUST(sadmm_world_add_shape(world, body, &shape, NULL) == SADMM_OK, "a hull");
    sadmm_hull_destroy(hull);
}

static void add_mesh(sadmm_world *world, bool heights)
{
    static const double corners[5][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0.05}};
    static const int32_t triangles[4][3] = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    static const double grid[9] = {0, 0.1, 0, 0.1, 0, 0.1, 0, 0.1, 0};
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    sadmm_mesh *mesh;
    if (heights) {
        sadmm_heightfield_def def = sadmm_heightfield_def_default();
        def.heights = grid, def.columns = def.rows = 3;
        def.spacing[0] = def.spacing[1] = 1;
        MUST(sadmm_heightfield_create(&def, &mesh) == SADMM_OK, "a heightfield");
    } else {
        sadmm_mesh_def def = sadmm_mesh_def_default();
        def.vertices = corners[0], def.vertex_count = 5;
        def.triangles = triangles[0], def.triangle_count = 4;
        MUST(sadmm_mesh_create(&def, &mesh) == SADMM_OK, "a mesh");
    }
    body.type = SADMM_BODY_STATIC;
    body.environment = -1;
    MUST(sadmm_world_add_body(world, &body, &id) == SADMM_OK, "ground");
    shape.type = SADMM_SHAPE_MESH;
    shape.mesh = mesh;
    MUST(sadmm_world_add_shape(world, id, &shape, NULL) == SADMM_OK, "a mesh");
    sadmm_mesh_destroy(mesh);
}

static void join(sadmm_world *world, sadmm_body_id a, sadmm_body_id b)
{
    static const double position[2] = {-1, 1}, force[2] = {-5, 5};
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_joint_id hinge;
    sadmm_joint_id slider;
    sadmm_coupling_def pull = sadmm_coupling_def_default();
    sadmm_gear_def gear = sadmm_gear_def_default();
    def.kind = SADMM_JOINT_REVOLUTE;
    def.body_a = a, def.body_b = b;
    def.position_a[0] = 0.15, def.position_b[0] = -0.15;
    def.coordinates[5].limited = true;
    def.coordinates[5].upper = 0.1;
    MUST(sadmm_world_add_joint(world, &def, &hinge) == SADMM_OK, "a hinge");
    def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_PRISMATIC;
    def.body_b = b;
    def.position_a[0] = 0.3;
    def.coordinates[2].drive = SADMM_DRIVE_POSITION;
    def.coordinates[2].drive_stiffness = 10;
    MUST(sadmm_world_add_joint(world, &def, &slider) == SADMM_OK, "a slider");
    MUST(sadmm_world_set_joint_spring_table(world, slider, 2, position, force, 2) == SADMM_OK, "a table");
    gear.joint_1 = hinge, gear.coordinate_1 = 5;
    gear.joint_2 = slider, gear.coordinate_2 = 2;
    MUST(sadmm_world_add_gear(world, &gear, NULL) == SADMM_OK, "a gear");
    pull.body = a;
    pull.linear_stiffness = 10;
    MUST(sadmm_world_add_coupling(world, &pull, NULL) == SADMM_OK, "a coupling");
}

static sadmm_world *create(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world;
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.iterations = 5;
    MUST(sadmm_world_create(&def, &world) == SADMM_OK, "a world");
    return world;
}

static void save(sadmm_world *world, unsigned char **bytes, size_t *size)
{
    MUST(sadmm_world_save(world, NULL, 0, size) == SADMM_OK, "size");
    *bytes = malloc(*size);
    MUST(*bytes && sadmm_world_save(world, *bytes, *size, size) == SADMM_OK, "save");
}

static void make_worlds(void)
{
    for (int k = 0; k < WORLDS; ++k) {
        sadmm_world *world = create();
        if (k == 0) add(world, SADMM_BODY_STATIC, SADMM_SHAPE_PLANE, 0, 0);
        else add_mesh(world, k == 2);
        const sadmm_body_id a = add(world, SADMM_BODY_DYNAMIC, k == 3 ? SADMM_SHAPE_CONE : SADMM_SHAPE_BOX, 0, 0.14),
                            b = add(world, SADMM_BODY_DYNAMIC, SADMM_SHAPE_CAPSULE, 0.25, 0.3);
        if (k == 3) add(world, SADMM_BODY_KINEMATIC, SADMM_SHAPE_CYLINDER, 0.5, 0.3);
        if (k == 0 || k == 3) join(world, a, b);
        if (k == 1) add_hull(world, b);
        for (int step = 0; step < 8; ++step)
            MUST(sadmm_world_step(world) == SADMM_OK, "a step: %s", sadmm_world_message(world));
        save(world, &saved[k].bytes, &saved[k].size);
        sadmm_world_destroy(world);
    }
}

/* [0, n) */
static size_t take_below(struct bytes *in, size_t n)
{
    size_t k = 0;
    for (int byte = 0; byte < 3; ++byte) k = k << 8 | take_byte(in);
    return k % n;
}

/* Change some bytes: to anything, or to a number that is likely to matter. */
static void change(struct bytes *in, unsigned char *bytes, size_t size)
{
    static const double numbers[] = {0, -0.0, 1, -1, 1e300, -1e300, 1e-300, 0.5, 1e9};
    static const int32_t counts[] = {-1, 0, 1, 2, 3, 7, 8, 255, 65535, INT32_MAX, INT32_MIN, 1 << 20};
    const size_t at = take_below(in, size);
    switch (take_choice(in, 5)) {
    case 0: bytes[at] = take_byte(in); break;
    case 1: bytes[at] ^= (unsigned char)(1u << take_choice(in, 8)); break;
    case 2: {
        const double x = numbers[take_choice(in, (int)(sizeof numbers / sizeof *numbers))];
        if (at / 8 * 8 + 8 <= size) memcpy(bytes + at / 8 * 8, &x, 8);
        break;
    }
    default: {
        const int32_t x = counts[take_choice(in, (int)(sizeof counts / sizeof *counts))];
        if (at / 4 * 4 + 4 <= size) memcpy(bytes + at / 4 * 4, &x, 4);
    }
    }
}

/* All that arrays have of it. */
static void read_arrays(sadmm_world *world)
{
    for (int k = 0; k < SADMM_ARRAY_COUNT; ++k) {
        const sadmm_array array = (sadmm_array)k;
        const int32_t rows = sadmm_world_array_rows(world, array);
        double *values = malloc(((size_t)rows * (size_t)sadmm_array_columns(array) + 1) * sizeof *values);
        MUST(values, "memory");
        const sadmm_status status = sadmm_world_get_array(world, array, 0, rows, values);
        MUST(status == SADMM_OK || (status == SADMM_ERROR_UNAVAILABLE && array == SADMM_ARRAY_BODY_CONTACT_WRENCH),
             "array %d: %s", k, sadmm_world_message(world));
        free(values);
    }
}

/* Whatever was restored is a world. */
static void use(sadmm_world *world)
{
    sadmm_contact contacts[16];
    double errors[16];
    sadmm_joint_id joint;
    sadmm_joint_state joint_state;
    sadmm_body_id body;
    sadmm_body_def def;
    sadmm_problem *problem;
    unsigned char *bytes, *again;
    size_t size, size_again;
    char text[4096];
    const int32_t count = sadmm_world_contact_count(world);
    (void)sadmm_world_contacts(world, 0, count < 16 ? count : 16, contacts);
    (void)sadmm_world_contact_errors(world, 0, count < 16 ? count : 16, errors);
    for (int32_t k = 0; k < sadmm_world_body_count(world); ++k) {
        MUST(sadmm_world_body_at(world, k, &body) == SADMM_OK, "body_at");
        MUST(sadmm_world_body_def(world, body, &def) == SADMM_OK, "body_def");
    }
    for (int32_t k = 0; k < sadmm_world_joint_count(world); ++k) {
        MUST(sadmm_world_joint_at(world, k, &joint) == SADMM_OK, "joint_at");
        (void)sadmm_world_joint_state(world, joint, &joint_state);
    }
    MUST(sadmm_problem_create(&problem) == SADMM_OK, "a problem");
    (void)sadmm_world_freeze(world, problem);
    sadmm_problem_destroy(problem);
    (void)sadmm_world_explain(world, text, sizeof text);
    read_arrays(world);
    save(world, &bytes, &size);
    sadmm_world *other = create();
    MUST(sadmm_world_restore(other, bytes, size) == SADMM_OK, "restored again: %s", sadmm_world_message(other));
    save(other, &again, &size_again);
    MUST(size == size_again && memcmp(bytes, again, size) == 0, "the same bytes");
    sadmm_world_destroy(other);
    free(bytes);
    free(again);
    /* Some numbers are allowed that make a step long. */
    sadmm_settings settings = sadmm_world_settings(world);
    settings.iterations = 3;
    settings.substeps = 1;
    settings.threads = 1;
    settings.check_period = 1;
    if (sadmm_world_set_settings(world, &settings) != SADMM_OK) return;
    for (int step = 0; step < 2; ++step) (void)sadmm_world_step(world);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static sadmm_world *world; /* one that is something else */
    if (!world) {
        make_worlds();
        world = create();
        add(world, SADMM_BODY_STATIC, SADMM_SHAPE_PLANE, 0, 0);
        add(world, SADMM_BODY_DYNAMIC, SADMM_SHAPE_SPHERE, 0, 0.1);
        MUST(sadmm_world_step(world) == SADMM_OK, "a step: %s", sadmm_world_message(world));
    }
    struct bytes in = bytes_of(data, size);
    const int which = take_choice(&in, WORLDS);
    size_t length = saved[which].size;
    unsigned char *bytes = malloc(length + 8);
    uint64_t before, after;
    MUST(bytes, "memory");
    memcpy(bytes, saved[which].bytes, length);
    memset(bytes + length, 0, 8);
    const bool repaired = take_choice(&in, 4) > 0;
    const int cut = take_choice(&in, 30);
    if (cut == 1) length -= 1 + take_below(&in, length - 1);
    if (cut == 2) length += 1 + take_below(&in, 8);
    for (int k = take_choice(&in, MOST_CHANGES + 1); k > 0; --k) change(&in, bytes, length);
    if (repaired) sadmm_save_repair(bytes, length);
    MUST(sadmm_world_state_hash(world, &before) == SADMM_OK, "hash");
    const sadmm_status status = sadmm_world_restore(world, bytes, length);
    MUST(repaired || status != SADMM_OK || memcmp(bytes, saved[which].bytes, saved[which].size) == 0,
         "damage is found");
    if (status == SADMM_OK) {
        use(world);
        sadmm_world_destroy(world);
        world = create();
        add(world, SADMM_BODY_DYNAMIC, SADMM_SHAPE_SPHERE, 0, 0.1);
        MUST(sadmm_world_step(world) == SADMM_OK, "a step: %s", sadmm_world_message(world));
    } else {
        MUST(status == SADMM_ERROR_INVALID_ARGUMENT || status == SADMM_ERROR_UNAVAILABLE, "a refusal");
        MUST(sadmm_world_message(world)[0] != 0, "a reason");
        MUST(sadmm_world_state_hash(world, &after) == SADMM_OK && before == after, "nothing changes");
    }
    free(bytes);
    return 0;
}
