/* Contact finding on the CUDA device against the host pipeline: the same set, in the same order, number for number.
 *
 * Every formula is the host's, in double and without contraction, so there are no tolerances: a difference of one bit
 * in a separation or an arm is a failure. Inputs are scenes that the CPU backend steps and random soups. The same
 * checks run on the emulated device (test_cuda_collision_emulated.c, cuda_emulation/), where every build can run them;
 * here they run on a real one, or the program is skipped and says why. One file: nearly all tests run the same two
 * pipelines (`both`), most of them on the same random soups.
 */
#include "collision_soups.h"
#include "scene_tools.h"

#include "core/base/definition_fields.h"
#include "world/state/world_state.h"

/* ---- soups ----------------------------------------------------------------------------------------------------- */

static const struct soup_kind soups[] = {
    {.name = "loose, all pairs", .bodies = 120, .shapes_a_body = 1, .planes = 1, .density = 1, .size_low = 0.5,
     .size_high = 1, .static_share = 0.1, .steps = 4, .tree_from = 1000000},
    {.name = "loose, tree", .bodies = 120, .shapes_a_body = 1, .planes = 1, .density = 1, .size_low = 0.5,
     .size_high = 1, .static_share = 0.1, .steps = 4, .tree_from = 1},
    {.name = "sizes 1e-3 to 1e3, tree", .bodies = 700, .shapes_a_body = 1, .planes = 2, .density = 4, .size_low = 1e-3,
     .size_high = 1e3, .static_share = 0.2, .steps = 2, .tree_from = 1},
    {.name = "sizes 1e-3 to 1e3, all pairs", .bodies = 200, .shapes_a_body = 1, .planes = 2, .density = 4,
     .size_low = 1e-3, .size_high = 1e3, .static_share = 0.2, .steps = 3},
    {.name = "environments in one place, tree", .bodies = 400, .shapes_a_body = 1, .groups = 20, .planes = 12,
     .density = 2, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .steps = 3, .tree_from = 1},
    {.name = "environments in one place, all pairs", .bodies = 200, .shapes_a_body = 1, .groups = 5, .planes = 6,
     .density = 2, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .steps = 3},
    {.name = "several shapes a body, filters, overrides, tree", .bodies = 100, .shapes_a_body = 4, .planes = 2,
     .density = 3, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .filter_share = 0.5, .disabled_share = 1,
     .friction_share = 1, .dead_share = 0.2, .steps = 5, .tree_from = 1},
    {.name = "several shapes a body, filters, overrides, all pairs", .bodies = 60, .shapes_a_body = 4, .planes = 2,
     .density = 3, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .filter_share = 0.5, .disabled_share = 1,
     .friction_share = 1, .dead_share = 0.2, .steps = 5},
    {.name = "several manifolds a pair, tree", .bodies = 90, .shapes_a_body = 2, .groups = 3, .planes = 4, .density = 2,
     .size_low = 0.3, .size_high = 1, .static_share = 0.2, .friction_share = 1, .dead_share = 0.1, .steps = 4,
     .tree_from = 1, .subshapes = 3},
    {.name = "several manifolds a pair, all pairs", .bodies = 90, .shapes_a_body = 2, .planes = 2, .density = 2,
     .size_low = 0.3, .size_high = 1, .static_share = 0.2, .friction_share = 1, .dead_share = 0.1, .steps = 4,
     .subshapes = 3},
    {.name = "more than small tiles are for, all pairs", .bodies = 1100, .shapes_a_body = 1, .planes = 1, .density = 2,
     .size_low = 0.3, .size_high = 1, .static_share = 0.1, .steps = 1, .tree_from = 1000000},
    {.name = "hulls among others, tree", .bodies = 150, .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 0.3,
     .size_high = 1, .static_share = 0.1, .dead_share = 0.1, .steps = 4, .tree_from = 1, .hulls = 6},
    {.name = "hulls among others, all pairs", .bodies = 60, .shapes_a_body = 2, .planes = 1, .density = 3,
     .size_low = 0.3, .size_high = 1, .static_share = 0.1, .friction_share = 1, .steps = 4, .hulls = 6},
    {.name = "on meshes, tree", .bodies = 100, .shapes_a_body = 1, .groups = 3, .planes = 2, .density = 3,
     .size_low = 0.3,
     .size_high = 1, .static_share = 0.1, .dead_share = 0.1, .steps = 4, .tree_from = 1, .hulls = 5, .meshes = 4},
    {.name = "on meshes, all pairs", .bodies = 60, .shapes_a_body = 1, .planes = 1, .density = 3, .size_low = 0.3,
     .size_high = 1, .static_share = 0.1, .friction_share = 1, .steps = 4, .hulls = 5, .meshes = 4},
    {.name = "smooth bodies alone, tree", .bodies = 100, .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 0.1,
     .size_high = 1, .static_share = 0.1, .dead_share = 0.1, .steps = 4, .tree_from = 1, .smooth = 1},
    {.name = "smooth bodies among all others, all pairs", .bodies = 80, .shapes_a_body = 2, .planes = 1, .density = 3,
     .size_low = 0.2, .size_high = 1, .static_share = 0.1, .friction_share = 1, .steps = 4, .hulls = 6, .smooth = 0.5},
    {.name = "environments in one place, each by itself", .bodies = 300, .shapes_a_body = 1, .groups = 20, .planes = 12,
     .density = 2, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .steps = 3, .tree_from = BY_GROUPS},
    {.name = "several manifolds a pair, each environment by itself", .bodies = 90, .shapes_a_body = 3, .groups = 7,
     .planes = 4, .density = 2, .size_low = 0.3, .size_high = 1, .static_share = 0.2, .filter_share = 0.3,
     .disabled_share = 1, .friction_share = 1, .dead_share = 0.2, .steps = 4, .tree_from = BY_GROUPS, .subshapes = 3},
    {.name = "on meshes, each environment by itself", .bodies = 100, .shapes_a_body = 1, .groups = 3, .planes = 2,
     .density = 3, .size_low = 0.3, .size_high = 1, .static_share = 0.1, .dead_share = 0.1, .steps = 4,
     .tree_from = BY_GROUPS, .hulls = 5, .meshes = 4},
    {.name = "smooth bodies and hulls on meshes, tree", .bodies = 100, .shapes_a_body = 1, .planes = 1, .density = 3,
     .size_low = 0.3, .size_high = 1, .static_share = 0.15, .steps = 4, .tree_from = 1, .hulls = 3, .meshes = 4,
     .smooth = 0.7},
};
enum { SOUPS = sizeof soups / sizeof *soups };

/* Chained: each find starts from what the one before left where it was made. Impulses are put in after the first. */
START_TEST(soups_equal_host)
{
    const struct soup_kind *kind = &soups[_i];
    size_t pairs = 0;
    for (uint64_t number = 1; number <= 2; ++number) {
        struct shape_soup s = shape_soup_new(kind, number);
        struct both b = both_new_tuned(kind->tree_from, number == 2);
        for (int step = 0; step < kind->steps; ++step) {
            char about[128];
            snprintf(about, sizeof about, "%s, soup %d, step %d", kind->name, (int)number, step);
            both_find(&b, &s.input, about);
            pairs += b.host_set.pair_count;
            if (step == 0) {
                random_impulses(&b.host_set);
                both_start_from(&b, &b.host_set);
            }
            soup_advance(&s, kind);
        }
        both_free(&b);
        shape_soup_free(&s);
    }
    ck_assert_uint_gt(pairs, 100); /* or the soup shows little */
}
END_TEST

/* ---- scenes ---------------------------------------------------------------------------------------------------- */

static struct sadmm_collision_input world_input(const sadmm_world *world, struct sadmm_collision_body *bodies)
{
    struct sadmm_collision_input input = {
        .shapes = world->shapes,
        .shape_count = world->shape_ids.slots,
        .geometries = world->geometries,
        .geometry_count = world->shape_ids.slots,
        .bodies = bodies,
        .body_count = world->body_ids.slots,
        .dt = world->def.settings.dt,
        .margin = world->def.contact_margin,
        .threads = 1,
        .disabled_body_pairs = world->disabled_pairs.keys,
        .disabled_body_pair_count = sadmm_pair_table_count(&world->disabled_pairs),
        .friction_pairs = world->friction_pairs.keys,
        .friction_values = world->friction_pairs.values,
        .friction_pair_count = sadmm_pair_table_count(&world->friction_pairs),
    };
    int32_t dynamic = 0;
    for (size_t slot = 0; slot < world->body_ids.slots; ++slot) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        memcpy(bodies[slot].position, body->rigid.position, sizeof bodies[slot].position);
        memcpy(bodies[slot].orientation, body->rigid.orientation, sizeof bodies[slot].orientation);
        memcpy(bodies[slot].velocity, body->rigid.velocity, sizeof bodies[slot].velocity);
        bodies[slot].inertia = body->rigid.inertia[0];
        bodies[slot].environment = body->environment;
        const bool moves = sadmm_ids_has(&world->body_ids, slot) && body->type == SADMM_BODY_DYNAMIC;
        bodies[slot].system_body = moves ? dynamic++ : -1;
    }
    return input;
}

static const struct {
    const char *spec;
    int steps;
    bool resting; /* contacts from the first step on */
} scenes[] = {
    {"card_houses:3", 20, true}, {"sliding_cubes:20", 20, false}, {"pile:100", 15, false}, {"pyramid:6", 10, true},
    {"oblique_stacks:3", 10, true}, {"vertical_stacks:6", 10, true}, {"spin_plate", 10, false},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

/* The previous set is the world's, with the impulses that the solver found. */
START_TEST(scenes_equal_host)
{
    const bool tree = _i % 2;
    struct sadmm_scene scene = open_scene(scenes[_i / 2].spec);
    scene.def.backend = SADMM_BACKEND_CPU;
    sadmm_world *world = build_scene(&scene);
    struct sadmm_collision_body *bodies = calloc(world->body_ids.slots, sizeof *bodies);
    struct both b = both_new(tree ? 1 : 1000000);
    size_t points = 0, pushing = 0;
    for (int step = 0; step < scenes[_i / 2].steps; ++step) {
        char about[96];
        struct sadmm_error error = {0};
        snprintf(about, sizeof about, "%s, %s, step %d", scenes[_i / 2].spec, tree ? "tree" : "all pairs", step);
        ck_assert_int_eq(sadmm_scene_before_step(&scene, world, step, &error), SADMM_OK);
        step_world(world, 1);
        struct sadmm_collision_input input = world_input(world, bodies);
        both_start_from(&b, &world->contacts);
        both_find(&b, &input, about);
        points += b.host_set.point_count;
        for (size_t k = 0; k < b.host_set.point_count; ++k) pushing += norm3(b.host_set.points[k].impulse) > 0;
    }
    if (scenes[_i / 2].resting) {
        ck_assert_uint_gt(points, 0);
        ck_assert_uint_gt(pushing, points / 4); /* impulses were carried over */
    }
    free(bodies);
    both_free(&b);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- capacities ------------------------------------------------------------------------------------------------ */

/* A find that starts with capacities of one candidate and one point repeats until everything fits, and drops nothing;
 * then nothing is allocated any more while the numbers stay. */
START_TEST(capacities_grow)
{
    const struct soup_kind *kind = &soups[_i % SOUPS];
    struct shape_soup s = shape_soup_new(kind, 3);
    struct both b = both_new(0);
    const bool radix = _i / SOUPS;
    struct sadmm_cuda_collision_tuning tight = {.tree_from = kind->tree_from, .radix_from = radix, .first_capacity = 1};
    COLLISION(tune)(b.device, &tight);
    struct sadmm_cuda_contacts out = both_find(&b, &s.input, kind->name);
    struct sadmm_cuda_collision_stats first = COLLISION(stats)(b.device);
    ck_assert_int_gt(out.counts.points, 1);
    ck_assert_int_ge(first.repeats, 1);
    /* each capacity once, for the counts are exact; before that pairs with meshes, whose triangles nobody has counted
     * yet */
    ck_assert_int_le(first.repeats, kind->meshes ? 3 : 2);
    ck_assert_int_ge(first.candidate_capacity, out.counts.candidates);
    ck_assert_int_ge(first.point_capacity, out.counts.points);

    both_find(&b, &s.input, kind->name); /* the other set */
    struct sadmm_cuda_collision_stats second = COLLISION(stats)(b.device);
    for (int i = 0; i < 3; ++i) both_find(&b, &s.input, kind->name);
    struct sadmm_cuda_collision_stats last = COLLISION(stats)(b.device);
    ck_assert_int_eq(last.allocations, second.allocations);
    ck_assert_int_eq(last.repeats, first.repeats);
    ck_assert_int_eq(last.finds, 5);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* Capacities too small in the middle of a run: the previous step's impulses are still there for the repeated stage. */
START_TEST(capacities_grow_later)
{
    const struct soup_kind *kind = &soups[6];
    struct shape_soup s = shape_soup_new(kind, 4);
    struct both b = both_new(kind->tree_from);
    struct sadmm_cuda_collision_tuning tight = {.tree_from = kind->tree_from, .first_capacity = 2};
    both_find(&b, &s.input, "first");
    random_impulses(&b.host_set);
    both_start_from(&b, &b.host_set);
    for (int step = 0; step < 3; ++step) {
        COLLISION(tune)(b.device, &tight);
        both_find(&b, &s.input, "after the capacities were taken back");
        soup_advance(&s, kind);
    }
    ck_assert_int_ge(COLLISION(stats)(b.device).repeats, 3);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* ---- edges ----------------------------------------------------------------------------------------------------- */

static struct sadmm_geometry geometry_of(int type, double s0, double s1, double s2)
{
    struct sadmm_geometry geometry = {.type = type, .subshapes = 1, .size = {s0, s1, s2}};
    return geometry;
}

static struct sadmm_geometry ball(double radius) { return geometry_of(SADMM_SHAPE_SPHERE, radius, 0, 0); }

/* The shape of a body; of the geometry of that number. */
static struct sadmm_shape shape_of(int body)
{
    struct sadmm_shape shape = {.geometry = (uint32_t)body, .orientation = {1, 0, 0, 0}, .friction = 0.5, .category = 1,
                                .mask = UINT32_MAX, .body = body, .alive = true, .revision = (uint32_t)body + 1};
    return shape;
}

/* No shapes, planes alone, one shape, one shape on a plane, everything dead. */
START_TEST(few_shapes)
{
    struct both b = both_new(_i ? 1 : 1000000);
    struct sadmm_collision_body bodies[3] = {
        {.orientation = {1, 0, 0, 0}, .system_body = -1, .environment = -1},
        {.position = {0, 0, 0.5}, .orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0, 0, 1.4}, .orientation = {1, 0, 0, 0}, .system_body = 1},
    };
    struct sadmm_geometry geometries[3] = {geometry_of(SADMM_SHAPE_PLANE, 0, 0, 0), ball(0.5), ball(0.5)};
    struct sadmm_shape shapes[3] = {shape_of(0), shape_of(1), shape_of(2)};
    struct sadmm_collision_input input = {.shapes = shapes, .geometries = geometries, .geometry_count = 3,
                                          .bodies = bodies, .body_count = 3, .dt = 0.01, .margin = 0.02};
    for (int round = 0; round < 2; ++round)
        for (size_t count = 0; count <= 3; ++count) {
            input.shape_count = count;
            both_find(&b, &input, "few shapes");
            ck_assert_uint_eq(b.device_set.pair_count, count > 0 ? count - 1 : 0);
        }
    for (int i = 0; i < 3; ++i) {
        shapes[i].alive = false;
        ++shapes[i].revision;
    }
    both_find(&b, &input, "dead shapes");
    ck_assert_uint_eq(b.device_set.pair_count, 0);
    both_free(&b);
}
END_TEST

/* Equal Morton codes: spheres in one place, beside one body so far away that the grid would otherwise be one cell. */
START_TEST(one_place)
{
    enum { COUNT = 48 };
    struct sadmm_shape shapes[COUNT];
    struct sadmm_geometry geometries[COUNT];
    struct sadmm_collision_body bodies[COUNT];
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = COUNT, .geometries = geometries,
                                          .geometry_count = COUNT, .bodies = bodies, .body_count = COUNT, .dt = 0.01,
                                          .margin = 0.02};
    struct both b = both_new(1);
    memset(bodies, 0, sizeof bodies);
    for (int i = 0; i < COUNT; ++i) {
        shapes[i] = shape_of(i);
        geometries[i] = ball(i % 7 ? 0.1 : 20);
        bodies[i].orientation[0] = 1;
        bodies[i].system_body = i;
    }
    bodies[5].position[0] = 1e9;
    both_find(&b, &input, "one place");
    ck_assert_uint_eq(b.device_set.pair_count, (COUNT - 1) * (COUNT - 2) / 2);
    both_free(&b);
}
END_TEST

/* A shape that takes over a slot inherits nothing; one whose neighbour changed neither. */
START_TEST(slots_are_reused)
{
    struct sadmm_geometry geometries[3] = {ball(0.5), ball(0.5), ball(0.5)};
    struct sadmm_shape shapes[3] = {shape_of(0), shape_of(1), shape_of(2)};
    struct sadmm_collision_body bodies[3] = {
        {.orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0, 0, 0.95}, .orientation = {1, 0, 0, 0}, .system_body = 1},
        {.position = {0, 0, 1.9}, .orientation = {1, 0, 0, 0}, .system_body = 2},
    };
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 3, .geometries = geometries,
                                          .geometry_count = 3, .bodies = bodies, .body_count = 3, .dt = 0.01,
                                          .margin = 0.02};
    struct both b = both_new(0);
    both_find(&b, &input, "first");
    ck_assert_uint_eq(b.device_set.point_count, 2);
    for (int k = 0; k < 2; ++k) b.host_set.points[k].impulse[2] = 1 + k;
    both_start_from(&b, &b.host_set);
    geometries[2] = ball(0.49);
    shapes[2].revision = 9;
    both_find(&b, &input, "another sphere in the third slot");
    ck_assert_double_eq_tol(b.device_set.points[0].impulse[2], 1, 1e-14); /* the normal is unit to rounding */
    ck_assert(b.device_set.points[1].impulse[2] == 0);
    both_free(&b);
}
END_TEST

static double waves(double x, double y) { return 0.2 * sin(1.3 * x) + 0.1 * cos(2.1 * y); }

/* One ball that all of a large mesh is near: more of its tree waits than lanes of a warp may go through side by
 * side. */
START_TEST(a_ball_near_a_whole_mesh)
{
    struct soup *ground = soup_ground(100, 100, 0.5, 0.2, 7, waves);
    sadmm_mesh *mesh = soup_mesh(ground);
    struct test_shape_data *shape_data = test_shape_data_new();
    const size_t own = shape_data->used;
    ck_assert_uint_le(own + mesh->doubles, TEST_SHAPE_DATA);
    memcpy(shape_data->numbers + own, mesh->block, mesh->doubles * sizeof *shape_data->numbers);
    shape_data->used += mesh->doubles;
    struct sadmm_collision_body bodies[2] = {
        {.orientation = {1, 0, 0, 0}, .system_body = -1},
        {.position = {0.3, -0.2, 39.8}, .orientation = {1, 0, 0, 0}, .system_body = 0},
    };
    struct sadmm_geometry geometries[2] = {{.type = SADMM_SHAPE_MESH, .hull = (uint32_t)own}, ball(40)};
    memcpy(geometries[0].size, mesh->half, sizeof mesh->half);
    struct sadmm_shape shapes[2] = {shape_of(0), shape_of(1)};
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 2, .geometries = geometries,
                                          .geometry_count = 2, .bodies = bodies, .body_count = 2, .dt = 0.01,
                                          .margin = 0.02, .hulls = shape_data->numbers,
                                          .hull_doubles = shape_data->used, .hull_revision = 1};
    struct both b = both_new(_i ? 1 : 1000000);
    const struct sadmm_cuda_contacts out = both_find(&b, &input, "a ball near a whole mesh");
    ck_assert_int_eq(out.counts.candidates, 2 * 99 * 99);
    ck_assert_int_gt(out.counts.pairs, 0);
    both_free(&b);
    sadmm_mesh_destroy(mesh);
    free(shape_data);
    free(ground);
}
END_TEST

/* A world puts its hulls closer together when some are gone: contents stay, places change. */
START_TEST(hulls_move_in_the_shape_data)
{
    const double size[3] = {0.5, 0.4, 0.3};
    struct test_shape_data *shape_data = test_shape_data_new();
    struct test_hull h;
    struct both b = both_new(_i ? 1 : 1000000);
    struct sadmm_collision_body bodies[2] = {
        {.orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0, 0, 0.59}, .orientation = {1, 0, 0, 0}, .system_body = 1},
    };
    box_hull(size, &h);
    struct sadmm_geometry geometries[2] = {test_shape_data_add(shape_data, &h),
                                           geometry_of(SADMM_SHAPE_BOX, 0.2, 0.2, 0.3)};
    struct sadmm_shape shapes[2] = {shape_of(0), shape_of(1)};
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 2, .geometries = geometries,
                                          .geometry_count = 2, .bodies = bodies, .body_count = 2, .dt = 0.01,
                                          .margin = 0.02, .hulls = shape_data->numbers,
                                          .hull_doubles = shape_data->used, .hull_revision = 1};
    both_find(&b, &input, "first");
    ck_assert_uint_eq(b.device_set.pair_count, 1);
    ck_assert_int_eq(b.device_set.pairs[0].count, 4);
    /* another hull takes its place, and it goes behind that one: no shape's revision says so */
    const struct sadmm_geometry moved = test_shape_data_add(shape_data, &h);
    prism_hull(5, 3, &h);
    test_hull_data(&h, shape_data->numbers + geometries[0].hull);
    shape_data->used += 400; /* where the longer one reaches */
    test_hull_data(&h, shape_data->numbers + geometries[0].hull);
    box_hull(size, &h);
    geometries[0].hull = moved.hull + 400;
    test_hull_data(&h, shape_data->numbers + geometries[0].hull);
    input.hull_doubles = shape_data->used;
    ++input.hull_revision;
    both_find(&b, &input, "moved");
    ck_assert_int_eq(b.device_set.pairs[0].count, 4);
    both_free(&b);
    free(shape_data);
}
END_TEST

/* Pairs are matched by (shape, shape, subshape): of the four manifolds of two cubes the last step had all but the
 * second. Each goes on with its own impulses and its own axis (two are equally good), and the one that was not there
 * starts without. */
START_TEST(subshapes_are_matched_by_number)
{
    struct sadmm_geometry geometries[3] = {geometry_of(SADMM_SHAPE_BOX, 0.05, 0.05, 0.05),
                                           geometry_of(SADMM_SHAPE_BOX, 0.05, 0.05, 0.05), ball(0.05)};
    struct sadmm_shape shapes[3] = {shape_of(0), shape_of(1), shape_of(2)};
    struct sadmm_collision_body bodies[3] = {
        {.orientation = {1, 0, 0, 0}, .system_body = 0},
        {.position = {0.09, 0, 0.09}, .orientation = {1, 0, 0, 0}, .system_body = 1},
        {.position = {-0.09, 0, 0}, .orientation = {1, 0, 0, 0}, .system_body = 2},
    };
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 3, .geometries = geometries,
                                          .geometry_count = 3, .bodies = bodies, .body_count = 3, .dt = 0.01,
                                          .margin = 0.02};
    struct both b = both_new_tuned(_i % 2 ? 1 : 1000000, _i / 2);
    uint32_t face[2];
    for (int k = 0; k < 2; ++k) { /* what is remembered of the face that is less deep: along x, along z */
        bodies[1].position[2 * k] = 0.095;
        both_find(&b, &input, "one subshape each");
        ck_assert_uint_eq(b.device_set.pair_count, 2);
        ck_assert_int_eq(b.device_set.pairs[0].shape_a, 0);
        face[k] = b.device_set.pairs[0].cache;
        bodies[1].position[2 * k] = 0.09;
        both_start_from(&b, &(struct sadmm_contact_set){0});
    }
    ck_assert_uint_ne(face[0], face[1]);
    geometries[0].subshapes = geometries[1].subshapes = 2;
    shapes[0].revision = 10;
    shapes[1].revision = 11;
    both_find(&b, &input, "two subshapes each");
    ck_assert_uint_eq(b.device_set.pair_count, 4 + 2); /* the ball is of one piece */
    for (int i = 0; i < 4; ++i) b.host_set.pairs[i].cache = face[i % 2];
    both_start_from(&b, &b.host_set);
    both_find(&b, &input, "each with its own face");
    for (size_t i = 0; i < b.host_set.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &b.host_set.pairs[i];
        for (int32_t j = 0; j < p->count; ++j)
            for (int k = 0; k < 3; ++k) b.host_set.points[p->first + j].impulse[k] = (double)(1 + i) * p->normal[k];
    }
    for (size_t i = 2; i < b.host_set.pair_count; ++i) b.host_set.pairs[i - 1] = b.host_set.pairs[i];
    --b.host_set.pair_count;
    both_start_from(&b, &b.host_set);
    both_find(&b, &input, "without the second");
    ck_assert_uint_eq(b.device_set.pair_count, 4 + 2);
    for (size_t i = 0; i < b.device_set.pair_count; ++i) {
        const struct sadmm_contact_pair *p = &b.device_set.pairs[i];
        ck_assert_uint_eq(p->subshape, i < 4 ? i : i - 4);
        if (i < 4 && i != 1) ck_assert_uint_eq(p->cache, face[i % 2]);
        for (int32_t j = 0; j < p->count; ++j)
            for (int k = 0; k < 3; ++k) /* the normal is unit to rounding */
                ck_assert_double_eq_tol(b.device_set.points[p->first + j].impulse[k],
                                        i == 1 ? 0 : (double)(1 + i) * p->normal[k], 1e-13);
    }
    both_free(&b);
}
END_TEST

/* What collision knows nothing of is refused when it is loaded, as on the host, so that no kernel ever sees it; the
 * current set stays. */
START_TEST(shapes_without_manifolds_are_refused)
{
    enum { MANY = 70000 };
    struct sadmm_geometry geometries[2] = {geometry_of(SADMM_SHAPE_BOX, 0.5, 0.5, 0.5), ball(0.5)};
    const struct sadmm_geometry good = geometries[1];
    struct sadmm_shape *shapes = calloc(MANY, sizeof *shapes);
    struct sadmm_collision_body bodies[2] = {
        {.orientation = {1, 0, 0, 0}, .system_body = -1},
        {.position = {0, 0, 0.99}, .orientation = {1, 0, 0, 0}, .system_body = 0},
    };
    struct sadmm_collision_input input = {.shapes = shapes, .shape_count = 2, .geometries = geometries,
                                          .geometry_count = 2, .bodies = bodies, .body_count = 2, .dt = 0.01,
                                          .margin = 0.02};
    static const struct {
        int32_t type, subshapes;
        uint32_t handle;
        const char *words;
    } bad[] = {
        {SADMM_SHAPE_TYPE_COUNT, 1, 1, "shapes[1]: type = "}, {-1, 1, 1, "type = -1"},
        {SADMM_SHAPE_PLANE, 1, 1, "only static bodies"},       {SADMM_SHAPE_SPHERE, 0, 1, "subshapes = 0"},
        {SADMM_SHAPE_SPHERE, 1, 2, "geometry = 2"},            {SADMM_SHAPE_HULL, 1, 1, "hull = 0"},
        {SADMM_SHAPE_CONE, 1, 1, "type = 7: needs shape data"},
    };
    struct both b = both_new(0);
    shapes[0] = shape_of(0);
    shapes[1] = shape_of(1);
    both_find(&b, &input, "good ones");
    ck_assert_uint_eq(b.device_set.pair_count, 1);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        struct sadmm_error error = {0};
        struct sadmm_cuda_contacts out;
        geometries[1].type = bad[i].type;
        geometries[1].subshapes = bad[i].subshapes;
        shapes[1].geometry = bad[i].handle;
        ++shapes[1].revision;
        for (int time = 0; time < 2; ++time) {
            ck_assert_int_eq(COLLISION(find)(b.device, NULL, &input, &out, &error), SADMM_ERROR_INVALID_ARGUMENT);
            ck_assert_msg(strstr(error.message, bad[i].words) != NULL, "%s: does not say %s", error.message,
                          bad[i].words);
        }
        OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
        check_same(&b.host_set, &b.device_set, bad[i].words);
        geometries[1] = good;
        shapes[1].geometry = 1;
        both_find(&b, &input, "good again");
    }
    /* a candidate is one 64-bit key: slots and subshapes must fit into it */
    struct sadmm_error error = {0};
    geometries[1].subshapes = SADMM_MOST_SUBSHAPES;
    ++shapes[1].revision;
    input.shape_count = MANY; /* but for two they are dead */
    ck_assert_int_eq(COLLISION(find)(b.device, NULL, &input, NULL, &error), SADMM_ERROR_LIMIT);
    ck_assert_ptr_nonnull(strstr(error.message, "70000 shapes of up to 65535 subshapes"));
    free(shapes);
    both_free(&b);
}
END_TEST

START_TEST(a_find_can_be_undone)
{
    const struct soup_kind *kind = &soups[6];
    struct shape_soup s = shape_soup_new(kind, 5);
    struct both b = both_new(kind->tree_from);
    struct sadmm_contact_set kept = {0};
    both_find(&b, &s.input, "first");
    random_impulses(&b.host_set);
    both_start_from(&b, &b.host_set);
    COLLISION(undo)(b.device); /* nothing to undo: an upload is no find */
    copy_set(&kept, &b.host_set);

    soup_advance(&s, kind);
    both_find(&b, &s.input, "second");
    sadmm_collision_undo(b.host, &b.host_set);
    COLLISION(undo)(b.device);
    COLLISION(undo)(b.device); /* once only */
    OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
    check_same(&kept, &b.device_set, "after the undo");
    check_same(&b.host_set, &b.device_set, "after both undos");
    both_find(&b, &s.input, "second, again");
    sadmm_contact_set_free(&kept);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* Pipelines know nothing of each other. */
START_TEST(side_by_side)
{
    struct shape_soup s[2] = {shape_soup_new(&soups[0], 6), shape_soup_new(&soups[7], 7)};
    struct both b[2] = {both_new(1), both_new(0)};
    for (int step = 0; step < 3; ++step)
        for (int i = 0; i < 2; ++i) {
            both_find(&b[i], &s[i].input, "side by side");
            if (step == 0) {
                random_impulses(&b[i].host_set);
                both_start_from(&b[i], &b[i].host_set);
            }
            soup_advance(&s[i], &soups[i ? 7 : 0]);
        }
    for (int i = 0; i < 2; ++i) {
        both_free(&b[i]);
        shape_soup_free(&s[i]);
    }
}
END_TEST

START_TEST(no_such_device)
{
    struct sadmm_cuda_collision *device = NULL;
    struct sadmm_error error = {0};
    ck_assert_int_eq(COLLISION(create)(1000, &device, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_null(device);
    ck_assert_ptr_nonnull(strstr(error.message, "device = 1000"));
    COLLISION(destroy)(NULL);
}
END_TEST

/* Allocations of the host that fail: the message says so, and the current set stays. */
START_TEST(host_memory_that_lacks)
{
    const struct soup_kind *kind = &soups[7];
    struct shape_soup s = shape_soup_new(kind, 8);
    for (long successes = 0;; ++successes) {
        struct sadmm_cuda_collision *device = NULL;
        struct sadmm_contact_set set = {0};
        struct sadmm_error error = {0};
        sadmm_test_fail_allocations_after(successes);
        sadmm_status status = COLLISION(create)(0, &device, &error);
        if (status == SADMM_OK) status = COLLISION(find)(device, NULL, &s.input, NULL, &error);
        if (status == SADMM_OK) status = COLLISION(download)(device, NULL, &set, &error);
        sadmm_test_fail_allocations_after(-1);
        if (status != SADMM_OK) {
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert_str_ne(error.message, "");
            ck_assert_uint_eq(set.pair_count, 0);
        }
        COLLISION(destroy)(device);
        sadmm_contact_set_free(&set);
        if (status == SADMM_OK) {
            ck_assert_int_gt(successes, 20);
            break;
        }
    }
    shape_soup_free(&s);
}
END_TEST

#ifdef SADMM_CUDA_EMULATED
/* Every runtime call of a find fails once: a message, the current set as it was, and the next find succeeds. */
START_TEST(calls_that_fail)
{
    const struct soup_kind *kind = &soups[_i ? 1 : 7];
    struct shape_soup s = shape_soup_new(kind, 9), later;
    struct both b = both_new_tuned(kind->tree_from, _i);
    long before, calls;
    both_find(&b, &s.input, "first");
    random_impulses(&b.host_set);
    both_start_from(&b, &b.host_set);
    later = s;
    later.input.dt = 0.02;
    for (calls = 0;; ++calls) {
        struct sadmm_error error = {0};
        struct sadmm_cuda_collision_tuning tight = {
            .tree_from = kind->tree_from, .radix_from = _i, .first_capacity = 3};
        COLLISION(tune)(b.device, &tight); /* with the repeats */
        cuda_emulation_calls_left = calls;
        sadmm_status status = COLLISION(find)(b.device, NULL, &later.input, NULL, &error);
        if (status == SADMM_OK && cuda_emulation_calls_left >= 0) break; /* there is no such call any more */
        cuda_emulation_calls_left = -1;
        ck_assert_int_eq(status, SADMM_ERROR_DEVICE);
        ck_assert_ptr_nonnull(strstr(error.message, "CUDA device 0: "));
        OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
        check_same(&b.host_set, &b.device_set, "after a failure");
    }
    cuda_emulation_calls_left = -1;
    ck_assert_int_gt(calls, 10);
    OK(sadmm_collision_find(b.host, &later.input, &b.host_set, error));
    OK(COLLISION(download)(b.device, NULL, &b.device_set, error));
    check_same(&b.host_set, &b.device_set, "after the failures");

    /* no leaks, wherever it stops */
    before = cuda_emulation_allocations;
    for (calls = 0; calls < 60; ++calls) {
        struct sadmm_cuda_collision *device;
        struct sadmm_error error = {0};
        OK(COLLISION(create)(0, &device, error));
        cuda_emulation_calls_left = calls;
        (void)COLLISION(find)(device, NULL, &s.input, NULL, &error);
        cuda_emulation_calls_left = -1;
        COLLISION(destroy)(device);
        ck_assert_int_eq(cuda_emulation_allocations, before);
    }
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* The tree leaves out nearly everything: some dozen nodes a shape. A walk along the leaves would see half of all
 * shapes; the result would be the same. */
START_TEST(tree_prunes)
{
    const struct soup_kind kind = {.name = "sparse", .bodies = 1500, .shapes_a_body = 1, .density = 0.5,
                                   .size_low = 0.5, .size_high = 1};
    struct shape_soup s = shape_soup_new(&kind, 11);
    struct both b = both_new(1);
    if (_i) s.bodies[7].position[1] = 1e8; /* must not spoil the grid */
    const int64_t before = COLLISION(stats)(b.device).visits;
    both_find(&b, &s.input, kind.name);
    const double visits = (double)(COLLISION(stats)(b.device).visits - before) / kind.bodies;
    ck_assert_msg(visits > 3 && visits < 60, "%g nodes a shape", visits);
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST

/* Threads in the opposite order: candidates are found, and nodes of the tree reached, in another one. */
START_TEST(threads_in_reverse)
{
    const struct soup_kind *kind = &soups[_i];
    struct shape_soup s = shape_soup_new(kind, 10);
    struct both b = both_new_tuned(kind->tree_from, _i % 4 >= 2);
    cuda_emulation_descending = 1;
    for (int step = 0; step < 2; ++step) {
        both_find(&b, &s.input, kind->name);
        soup_advance(&s, kind);
    }
    cuda_emulation_descending = 0;
    both_free(&b);
    shape_soup_free(&s);
}
END_TEST
#endif

int main(void)
{
    struct sadmm_cuda_collision *device = NULL;
    struct sadmm_error error = {0};
    sadmm_status status = COLLISION(create)(0, &device, &error);
    if (status == SADMM_ERROR_UNAVAILABLE) {
        printf("skipped: %s\n", error.message);
        return 77;
    }
    if (status != SADMM_OK) {
        printf("%s\n", error.message);
        return EXIT_FAILURE;
    }
    COLLISION(destroy)(device);

    Suite *suite = suite_create("cuda_collision");
    TCase *tests = tcase_create("cuda_collision");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, soups_equal_host, 0, SOUPS);
    tcase_add_loop_test(tests, scenes_equal_host, 0, 2 * SCENES);
    tcase_add_loop_test(tests, capacities_grow, 0, 2 * SOUPS);
    tcase_add_test(tests, capacities_grow_later);
    tcase_add_loop_test(tests, few_shapes, 0, 2);
    tcase_add_test(tests, one_place);
    tcase_add_test(tests, slots_are_reused);
    tcase_add_loop_test(tests, a_ball_near_a_whole_mesh, 0, 2);
    tcase_add_loop_test(tests, hulls_move_in_the_shape_data, 0, 2);
    tcase_add_loop_test(tests, subshapes_are_matched_by_number, 0, 4);
    tcase_add_test(tests, shapes_without_manifolds_are_refused);
    tcase_add_test(tests, a_find_can_be_undone);
    tcase_add_test(tests, side_by_side);
    tcase_add_test(tests, no_such_device);
    tcase_add_test(tests, host_memory_that_lacks);
#ifdef SADMM_CUDA_EMULATED
    tcase_add_loop_test(tests, calls_that_fail, 0, 2);
    tcase_add_loop_test(tests, tree_prunes, 0, 2);
    tcase_add_loop_test(tests, threads_in_reverse, 0, SOUPS);
#endif
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_set_fork_status(runner, CK_NOFORK); /* a driver that was started does not survive a fork */
    srunner_run_all(runner, CK_NORMAL);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
