/* Costs that grow no faster than the work: so many calls on a world of so many objects, in the orders that are worst
 * for lists, are counted in operations, not in time. The library's sources are compiled once more for this program with
 * a call at every branch (-fsanitize-coverage=trace-pc), and what it copies and clears counts by the cache line. */
#include <stdint.h>

#include "fixed_work.h"
#include "scene_tools.h"

/* ---- counting ---------------------------------------------------------------------------------------------------- */

static uint64_t operations;

enum { LINE = 64 };

void __sanitizer_cov_trace_pc(void);
void *__real_memmove(void *to, const void *from, size_t size);
void *__wrap_memmove(void *to, const void *from, size_t size);
void *__real_memcpy(void *to, const void *from, size_t size);
void *__wrap_memcpy(void *to, const void *from, size_t size);
void *__real_memset(void *to, int byte, size_t size);
void *__wrap_memset(void *to, int byte, size_t size);

void __sanitizer_cov_trace_pc(void) { ++operations; }

void *__wrap_memmove(void *to, const void *from, size_t size)
{
    operations += size / LINE;
    return __real_memmove(to, from, size);
}

void *__wrap_memcpy(void *to, const void *from, size_t size)
{
    operations += size / LINE;
    return __real_memcpy(to, from, size);
}

void *__wrap_memset(void *to, int byte, size_t size)
{
    operations += size / LINE;
    return __real_memset(to, byte, size);
}

/* ---- worlds ------------------------------------------------------------------------------------------------------ */

/* n bodies and what belongs to them; id k is that of the k-th that was added. */
struct many {
    sadmm_world *world;
    int n;
    sadmm_body_id *bodies;
    sadmm_shape_id *shapes;
};

/* k-th of 0 to n - 1 in an order without order; n: a power of two. */
static int shuffled(const struct many *m, int k) { return (int)((unsigned)k * 40503u + 977u) & (m->n - 1); }

static sadmm_body_def body_of(sadmm_body_type type, int k)
{
    sadmm_body_def def = sadmm_body_def_default();
    def.type = type;
    def.mass = def.inertia[0] = def.inertia[1] = def.inertia[2] = 1;
    def.position[0] = k % 64, def.position[1] = k / 64;
    return def;
}

static sadmm_shape_id add_sphere(const struct many *m, int k, bool sensor)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_shape_id id;
    def.size[0] = 0.1;
    def.sensor = sensor;
    MUST(m->world, sadmm_world_add_shape(m->world, m->bodies[k], &def, &id));
    return id;
}

static void add_bodies(struct many *m, sadmm_body_type type, bool with_shapes)
{
    for (int k = 0; k < m->n; ++k) {
        const sadmm_body_def def = body_of(type, k);
        MUST(m->world, sadmm_world_add_body(m->world, &def, &m->bodies[k]));
        if (with_shapes) m->shapes[k] = add_sphere(m, k, false);
    }
}

static void add_balls(struct many *m) { add_bodies(m, SADMM_BODY_DYNAMIC, true); }
static void add_points(struct many *m) { add_bodies(m, SADMM_BODY_DYNAMIC, false); }
static void add_kinematic(struct many *m) { add_bodies(m, SADMM_BODY_KINEMATIC, false); }

/* Not one after the other: with a hole among the first. */
static void add_balls_with_a_hole(struct many *m)
{
    sadmm_body_def def = body_of(SADMM_BODY_STATIC, -1);
    sadmm_body_id first;
    MUST(m->world, sadmm_world_add_body(m->world, &def, &first));
    add_balls(m);
    MUST(m->world, sadmm_world_remove_body(m->world, first));
}

/* A chain, each link with a servo of its own (a coupling), neighbours with gears. */
static void add_chain(struct many *m)
{
    sadmm_joint_id before = {0, 0}, id;
    add_balls(m);
    for (int k = 1; k < m->n; ++k) {
        sadmm_joint_def joint = sadmm_joint_def_default();
        sadmm_coupling_def pull = sadmm_coupling_def_default();
        sadmm_gear_def gear = sadmm_gear_def_default();
        joint.kind = SADMM_JOINT_REVOLUTE;
        joint.body_a = m->bodies[k - 1], joint.body_b = m->bodies[k];
        joint.position_a[0] = k;
        joint.position_a[1] = -k;
        MUST(m->world, sadmm_world_add_joint(m->world, &joint, &id));
        pull.body = m->bodies[k];
        MUST(m->world, sadmm_world_add_coupling(m->world, &pull, NULL));
        gear.joint_1 = before, gear.joint_2 = id;
        gear.coordinate_1 = gear.coordinate_2 = 5;
        if (k > 1) MUST(m->world, sadmm_world_add_gear(m->world, &gear, NULL));
        before = id;
    }
}

static void set_pairs(const struct many *m, bool meet)
{
    for (int k = m->n - 1; k > 0; --k)
        MUST(m->world, sadmm_world_set_body_pair_contact(m->world, m->bodies[0], m->bodies[k], meet));
}

static void add_pairs(struct many *m)
{
    add_balls(m);
    set_pairs(m, false);
    for (int k = m->n - 1; k > 0; --k)
        MUST(m->world, sadmm_world_set_pair_friction(m->world, m->shapes[0], m->shapes[k], 0.3));
}

static sadmm_mesh *triangle(void)
{
    static const double corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const int32_t numbers[3] = {0, 1, 2};
    const sadmm_mesh_def def = {sizeof def, corners[0], 3, numbers, 1};
    sadmm_mesh *mesh;
    ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
    return mesh;
}

static sadmm_shape_id add_mesh(const struct many *m, int k)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_shape_id id;
    sadmm_mesh *mesh = triangle();
    def.type = SADMM_SHAPE_MESH;
    def.mesh = mesh;
    MUST(m->world, sadmm_world_add_shape(m->world, m->bodies[k], &def, &id));
    sadmm_mesh_destroy(mesh);
    return id;
}

static void add_static(struct many *m) { add_bodies(m, SADMM_BODY_STATIC, false); }
static void add_static_balls(struct many *m) { add_bodies(m, SADMM_BODY_STATIC, true); }

/* Each of a mesh of its own. */
static void add_meshes(struct many *m)
{
    add_static(m);
    for (int k = 0; k < m->n; ++k) m->shapes[k] = add_mesh(m, k);
}

/* ---- what is done with them -------------------------------------------------------------------------------------- */

static void look_up(struct many *m)
{
    for (int k = 0; k < m->n; ++k) {
        sadmm_body_id body;
        sadmm_shape_id shape;
        int32_t index;
        MUST(m->world, sadmm_world_body_at(m->world, shuffled(m, k), &body));
        MUST(m->world, sadmm_world_shape_at(m->world, shuffled(m, k), &shape));
        MUST(m->world, sadmm_world_body_index(m->world, m->bodies[shuffled(m, 2 * k)], &index));
        MUST(m->world, sadmm_world_shape_index(m->world, m->shapes[shuffled(m, 2 * k)], &index));
    }
}

/* Of joints, whose slots are among those of couplings. */
static void look_up_joints(struct many *m)
{
    for (int k = 0; k < m->n; ++k) {
        const int32_t at = shuffled(m, k) % (m->n - 2);
        sadmm_joint_id joint;
        sadmm_coupling_id coupling;
        sadmm_gear_id gear;
        int32_t index;
        MUST(m->world, sadmm_world_joint_at(m->world, at, &joint));
        MUST(m->world, sadmm_world_joint_index(m->world, joint, &index));
        ck_assert_int_eq(index, at);
        MUST(m->world, sadmm_world_coupling_at(m->world, at, &coupling));
        MUST(m->world, sadmm_world_coupling_index(m->world, coupling, &index));
        ck_assert_int_eq(index, at);
        MUST(m->world, sadmm_world_gear_at(m->world, at, &gear));
    }
}

static void read_rows(struct many *m)
{
    for (int k = 0; k < m->n; ++k) {
        double row[13];
        MUST(m->world, sadmm_world_get_array(m->world, SADMM_ARRAY_BODY_STATE, shuffled(m, k), 1, row));
    }
}

/* The first and the last, again and again. */
static void change_ends(struct many *m)
{
    for (int k = 0; k < m->n; ++k) {
        const int ends[2] = {0, m->n - 1};
        for (int e = 0; e < 2; ++e) MUST(m->world, sadmm_world_remove_body(m->world, m->bodies[ends[e]]));
        for (int e = 0; e < 2; ++e) {
            const sadmm_body_def def = body_of(SADMM_BODY_DYNAMIC, k);
            MUST(m->world, sadmm_world_add_body(m->world, &def, &m->bodies[ends[e]]));
        }
    }
}

static void remove_up(struct many *m)
{
    for (int k = 0; k < m->n; ++k) MUST(m->world, sadmm_world_remove_body(m->world, m->bodies[k]));
}

static void remove_down(struct many *m)
{
    for (int k = m->n - 1; k >= 0; --k) MUST(m->world, sadmm_world_remove_body(m->world, m->bodies[k]));
}

static void remove_shapes(struct many *m)
{
    for (int k = 0; k < m->n; ++k) MUST(m->world, sadmm_world_remove_shape(m->world, m->shapes[k]));
}

static void remove_joints(struct many *m)
{
    while (sadmm_world_joint_count(m->world) > 0) {
        sadmm_joint_id id;
        MUST(m->world, sadmm_world_joint_at(m->world, 0, &id));
        MUST(m->world, sadmm_world_remove_joint(m->world, id));
    }
    while (sadmm_world_coupling_count(m->world) > 0) {
        sadmm_coupling_id id;
        MUST(m->world, sadmm_world_coupling_at(m->world, sadmm_world_coupling_count(m->world) - 1, &id));
        MUST(m->world, sadmm_world_remove_coupling(m->world, id));
    }
}

static void turn_pairs_off_and_on(struct many *m)
{
    set_pairs(m, false);
    while (sadmm_world_body_pair_off_count(m->world) > 0) {
        sadmm_body_id a, b;
        MUST(m->world, sadmm_world_body_pair_off_at(m->world, 0, &a, &b));
        MUST(m->world, sadmm_world_set_body_pair_contact(m->world, a, b, true));
    }
}

/* One mesh comes and goes among spheres. */
static void change_mesh(struct many *m)
{
    for (int k = 0; k < m->n; ++k) MUST(m->world, sadmm_world_remove_shape(m->world, add_mesh(m, k)));
}

static void save_and_restore(struct many *m)
{
    size_t size;
    MUST(m->world, sadmm_world_save(m->world, NULL, 0, &size));
    void *bytes = malloc(size);
    MUST(m->world, sadmm_world_save(m->world, bytes, size, &size));
    MUST(m->world, sadmm_world_restore(m->world, bytes, size));
    free(bytes);
}

static void cast_rays(struct many *m)
{
    sadmm_ray *rays = calloc((size_t)m->n, sizeof *rays);
    sadmm_ray_hit *hits = calloc((size_t)m->n, sizeof *hits);
    for (int k = 0; k < m->n; ++k) rays[k] = (sadmm_ray){{k % 64, (double)(k / 64), 5}, {0, 0, -1}, INFINITY};
    MUST(m->world, sadmm_world_cast_rays(m->world, m->n, rays, NULL, hits));
    for (int k = 0; k < m->n; ++k) {
        int32_t index;
        ck_assert(hits[k].distance > 0);
        MUST(m->world, sadmm_world_body_index(m->world, hits[k].body, &index));
    }
    free(rays);
    free(hits);
}

/* Steps in which nothing meets, with events and as many sensors. */
static void make_steps(struct many *m)
{
    for (int k = 0; k < m->n; ++k) add_sphere(m, k, true);
    MUST(m->world, sadmm_world_record_events(m->world, 2 * m->n));
    step_world(m->world, 2);
}

/* Every body with a shape far from its first one among the slots. */
static void add_second_shapes(struct many *m)
{
    add_balls(m);
    for (int k = 0; k < m->n; ++k) add_sphere(m, k, false);
}

static void add_more(struct many *m)
{
    remove_down(m);
    add_kinematic(m);
}

/* ---- how costs grow ---------------------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    void (*make)(struct many *m), (*work)(struct many *m);
} cases[] = {
    {"indices and slots, with a hole", add_balls_with_a_hole, look_up},
    {"indices of joints, couplings, gears", add_chain, look_up_joints},
    {"rows of arrays, with a hole", add_balls_with_a_hole, read_rows},
    {"bodies at both ends come and go", add_points, change_ends},
    {"bodies", add_balls, remove_up},
    {"bodies, the last first", add_balls, remove_down},
    {"bodies with shapes far apart", add_second_shapes, remove_up},
    {"kinematic bodies", add_kinematic, remove_up},
    {"kinematic bodies again", add_kinematic, add_more},
    {"jointed bodies", add_chain, remove_up},
    {"jointed bodies, the last first", add_chain, remove_down},
    {"joints, gears, couplings", add_chain, remove_joints},
    {"pairs off and on", add_points, turn_pairs_off_and_on},
    {"bodies with pairs", add_pairs, remove_up},
    {"bodies with pairs, the last first", add_pairs, remove_down},
    {"shapes with pairs", add_pairs, remove_shapes},
    {"meshes", add_static, add_meshes},
    {"removed meshes", add_meshes, remove_shapes},
    {"one mesh", add_static_balls, change_mesh},
    {"saved meshes", add_meshes, save_and_restore},
    {"saved chain", add_chain, save_and_restore},
    {"saved pairs", add_pairs, save_and_restore},
    {"rays, with a hole", add_balls_with_a_hole, cast_rays},
    {"steps with sensors", add_kinematic, make_steps},
};

static double cost(int which, int n)
{
    sadmm_world_def def = fixed_world_def();
    def.settings.threads = 1;
    def.settings.gravity[2] = 0;
    struct many m = {create_world(&def), n, calloc((size_t)n, sizeof *m.bodies), calloc((size_t)n, sizeof *m.shapes)};
    cases[which].make(&m);
    const uint64_t before = operations;
    cases[which].work(&m);
    const double count = (double)(operations - before);
    sadmm_world_destroy(m.world);
    free(m.bodies);
    free(m.shapes);
    return count;
}

/* Four times the objects: 4 times the cost where it is linear, 4 log(4 n) / log(n) = 5.0 where it is n log n at n =
 * 512, 8 where it is n^1.5, 16 where it is quadratic. */
START_TEST(costs_grow_as_the_work)
{
    const double few = cost(_i, 512), many = cost(_i, 2048);
    ck_assert_msg(few >= 512, "%s: nothing was counted", cases[_i].name);
    ck_assert_msg(many <= 6 * few, "%s: %.0f operations for 512, %.0f for 2048", cases[_i].name, few, many);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("costs");
    TCase *tests = tcase_create("costs");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, costs_grow_as_the_work, 0, (int)(sizeof cases / sizeof *cases));
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
