/* Hulls in worlds: shapes of them come and go, the shape data that contact finding reads follows, definitions are read
 * back bit for bit, and memory that runs out changes nothing. */
#include <check.h>

#include "collision/hull/hull_write.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "fixed_work.h"
#include "hull_tools.h"
#include "scene_tools.h"
#include "world/step/gather.h"

static sadmm_hull *make_hull(int corners)
{
    const struct cloud c = prism_cloud(corners, 0.1 + 0.01 * corners, 0.2);
    sadmm_hull *hull = NULL;
    ck_assert_msg(try_hull(&c, 1e-6, &hull) == SADMM_OK, "%s", sadmm_last_message());
    return hull;
}

static sadmm_world *make_world(void)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1; /* failures are injected into the calling thread */
    return create_world(&def);
}

static sadmm_body_id add_body(sadmm_world *world, double x)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = def.inertia[0] = def.inertia[1] = def.inertia[2] = 1;
    def.position[0] = x;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static sadmm_shape_def shape_of(const sadmm_hull *hull)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    def.type = SADMM_SHAPE_HULL;
    def.hull = hull;
    return def;
}

static sadmm_shape_id add_shape(sadmm_world *world, sadmm_body_id body, const sadmm_hull *hull)
{
    const sadmm_shape_def def = shape_of(hull);
    sadmm_shape_id id;
    MUST(world, sadmm_world_add_shape(world, body, &def, &id));
    return id;
}

/* Every live hull's shape finds its hull's block in the shape data, between the first blocks and the end, and no more
 * than half of what follows these is nobody's (a hull has more numbers than these worlds have shapes). */
static void check_shape_data(sadmm_world *world)
{
    const struct sadmm_collision_input input = sadmm_world_collision_input(world, 0);
    const struct sadmm_shape_data *data = &world->shape_data;
    double first[HULL_FIRST_OWN];
    size_t used = 0, uses = 0, shapes = 0;
    ck_assert((input.hulls == NULL) == (data->count == 0));
    if (!input.hulls) {
        ck_assert_uint_eq(input.hull_doubles, 0);
        return;
    }
    sadmm_hull_prelude(first);
    ck_assert_mem_eq(input.hulls, first, sizeof first);
    for (size_t k = 0; k < data->count; ++k) {
        const struct sadmm_shape_data_entry *entry = &data->entries[k];
        ck_assert_mem_eq(input.hulls + entry->offset, entry->of.block, entry->of.doubles * sizeof *first);
        const double *place = sadmm_key_tree_find(&data->places, (uintptr_t)entry->of.owner);
        ck_assert(place && (size_t)*place == k);
        used += entry->of.doubles;
        uses += entry->uses;
    }
    for (size_t slot = 0; slot < world->shape_ids.slots; ++slot) {
        const struct sadmm_geometry *geometry = &world->geometries[slot];
        if (!world->shapes[slot].alive || geometry->type != SADMM_SHAPE_HULL) continue;
        const sadmm_hull *hull = world->block_shapes[slot].hull;
        ck_assert_mem_eq(input.hulls + geometry->hull, hull->block, hull->doubles * sizeof *first);
        ck_assert_mem_eq(geometry->size, hull->half, sizeof hull->half);
        ++shapes;
    }
    ck_assert_uint_eq(sadmm_key_tree_count(&data->places), data->count);
    ck_assert_uint_eq(uses, shapes);
    ck_assert_uint_eq(input.hull_doubles, HULL_FIRST_OWN + used + data->unused);
    ck_assert_uint_le(2 * data->unused, input.hull_doubles);
}

START_TEST(a_hull_lives_as_long_as_it_is_used)
{
    sadmm_hull *hull = make_hull(5);
    sadmm_world *one = make_world(), *two = make_world();
    const sadmm_body_id a = add_body(one, 0), b = add_body(two, 0);
    sadmm_shape_id first = add_shape(one, a, hull), second = add_shape(one, a, hull);
    ck_assert_uint_eq(hull->uses, 2);
    add_shape(two, b, hull);
    ck_assert_uint_eq(hull->uses, 3);
    sadmm_hull_destroy(hull);
    ck_assert_uint_eq(hull->uses, 2);
    MUST(one, sadmm_world_remove_shape(one, first));
    ck_assert_uint_eq(hull->uses, 2);
    check_shape_data(one);
    MUST(one, sadmm_world_remove_shape(one, second));
    ck_assert_uint_eq(hull->uses, 1);
    check_shape_data(one);
    ck_assert_ptr_null(sadmm_world_collision_input(one, 0).hulls);
    sadmm_world_destroy(one);
    check_shape_data(two);
    /* Read back, it goes on to the next world. */
    sadmm_shape_def def;
    sadmm_shape_id id;
    one = make_world();
    MUST(two, sadmm_world_shape_at(two, 0, &id));
    MUST(two, sadmm_world_shape_def(two, id, &def, NULL));
    MUST(one, sadmm_world_add_shape(one, add_body(one, 0), &def, NULL));
    MUST(two, sadmm_world_remove_body(two, b));
    sadmm_world_destroy(two);
    ck_assert_uint_eq(hull->uses, 1);
    check_shape_data(one);
    sadmm_world_destroy(one);
}
END_TEST

/* Shapes of 12 hulls come and go, with others between; blocks move, and nothing but offsets and the shape data's
 * revision with them. */
START_TEST(shape_data_follows)
{
    enum { HULLS = 12, SHAPES = 60 };
    sadmm_hull *hulls[HULLS];
    sadmm_world *world = make_world();
    sadmm_body_id body = add_body(world, 0), other = add_body(world, 5);
    sadmm_shape_id ids[SHAPES] = {{0, 0}};
    uint64_t seed = 1;
    int moved = 0;
    for (int k = 0; k < HULLS; ++k) hulls[k] = make_hull(3 + 5 * k);
    for (int step = 0; step < 3000; ++step) {
        const int i = (int)((next_number(&seed) + 1) / 2 * SHAPES), k = (int)((next_number(&seed) + 1) / 2 * HULLS);
        const uint32_t revision = world->shape_data.revision, shapes = world->shape_revisions;
        const size_t doubles = world->shape_data.doubles;
        if (ids[i].slot) {
            MUST(world, sadmm_world_remove_shape(world, ids[i]));
            ids[i].slot = 0;
            ck_assert_uint_eq(world->shape_revisions, shapes);
            if (world->shape_data.doubles != doubles) {
                ck_assert_uint_ne(world->shape_data.revision, revision);
                ck_assert_uint_eq(world->shape_data.unused, 0);
                ++moved;
            }
        } else if (k == 0 && step % 7 != 0) {
            sadmm_shape_def box = sadmm_shape_def_default();
            box.type = SADMM_SHAPE_BOX;
            for (int d = 0; d < 3; ++d) box.size[d] = 0.1;
            MUST(world, sadmm_world_add_shape(world, other, &box, &ids[i]));
        } else {
            /* Now and then many of one kind, so that others go. */
            ids[i] = add_shape(world, i % 2 ? body : other, hulls[step / 300 % 2 ? k % 2 : k]);
        }
        check_shape_data(world);
        if (step % 500 == 499) {
            MUST(world, sadmm_world_remove_body(world, other));
            for (int s = 0; s < SHAPES; ++s) {
                sadmm_shape_def def;
                if (ids[s].slot && sadmm_world_shape_def(world, ids[s], &def, NULL) != SADMM_OK) ids[s].slot = 0;
            }
            other = add_body(world, 5);
            check_shape_data(world);
        }
    }
    ck_assert_int_gt(moved, 10);
    sadmm_world_destroy(world);
    for (int k = 0; k < HULLS; ++k) {
        ck_assert_uint_eq(hulls[k]->uses, 1);
        sadmm_hull_destroy(hulls[k]);
    }
}
END_TEST

START_TEST(a_definition_is_read_back)
{
    static const double turn[4] = {0.36, -0.48, 0.64, 0.48};
    struct cloud c = prism_cloud(7, 0.01, 0.5);
    sadmm_hull *hull = NULL;
    sadmm_world *world = make_world();
    const sadmm_body_id body = add_body(world, 0);
    place_cloud(&c, turn, 1, 2, 3); /* the frame of its box is another */
    ck_assert_int_eq(try_hull(&c, 1e-6, &hull), SADMM_OK);
    ck_assert_double_ne(hull->orientation[0], 1);
    sadmm_shape_def def = shape_of(hull), read, again;
    sadmm_shape_id id;
    sadmm_body_id of;
    def.size[0] = NAN; /* ignored */
    def.position[0] = 0.1, def.position[1] = -0.7, def.position[2] = 1e-9;
    def.orientation[0] = 0.6, def.orientation[2] = -0.8;
    def.friction = 0.3, def.restitution = 0.1, def.category = 5, def.mask = 9;
    MUST(world, sadmm_world_add_shape(world, body, &def, &id));
    MUST(world, sadmm_world_shape_def(world, id, &read, &of));
    ck_assert_uint_eq(of.slot, body.slot);
    ck_assert(read.type == SADMM_SHAPE_HULL && read.hull == hull);
    ck_assert_mem_eq(read.position, def.position, sizeof def.position);
    ck_assert_mem_eq(read.orientation, def.orientation, sizeof def.orientation);
    ck_assert_mem_eq(read.size, hull->half, sizeof read.size);
    ck_assert(read.friction == 0.3 && read.restitution == 0.1 && read.category == 5 && read.mask == 9);
    MUST(world, sadmm_world_add_shape(world, body, &read, &id));
    MUST(world, sadmm_world_shape_def(world, id, &again, NULL));
    ck_assert_mem_eq(&again, &read, sizeof read);
    /* Where contact finding has it: every vertex where the definition says. */
    const struct sadmm_shape *shape = &world->shapes[0];
    struct polytope p;
    polytope_at(hull->block, 0, &p);
    for (int v = 0; v < p.vertices; ++v) {
        const vec3 there = v3_add(v3_load(shape->position),
                                  m3_mul(q_matrix(q_load(shape->orientation)), v3(p.x[v], p.y[v], p.z[v])));
        const vec3 given = v3_load(sadmm_hull_vertices(hull) + 3 * v);
        const vec3 wanted = v3_add(v3_load(def.position), m3_mul(q_matrix(q_load(def.orientation)), given));
        ck_assert_double_le(v3_norm(v3_sub(there, wanted)), 1e-14);
    }
    sadmm_world_destroy(world);
    sadmm_hull_destroy(hull);
}
END_TEST

START_TEST(bad_hulls_are_refused)
{
    sadmm_hull *hull = make_hull(4);
    sadmm_world *world = make_world();
    const sadmm_body_id body = add_body(world, 0);
    sadmm_shape_def def = shape_of(NULL);
    ck_assert_int_eq(sadmm_world_add_shape(world, body, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), "def->hull = NULL: must be given where def->type is 4"));
    for (int type = SADMM_SHAPE_PLANE; type < SADMM_SHAPE_HULL; ++type) {
        def = shape_of(hull);
        def.type = (sadmm_shape_type)type;
        for (int k = 0; k < 3; ++k) def.size[k] = 0.1;
        ck_assert_int_eq(sadmm_world_add_shape(world, body, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), "def->hull: must be NULL where def->type is"));
    }
    def = shape_of(hull);
    def.friction = -1; /* the hull is not taken before all is checked */
    ck_assert_int_eq(sadmm_world_add_shape(world, body, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    def.type = (sadmm_shape_type)(65536 + SADMM_SHAPE_BOX);
    ck_assert_int_eq(sadmm_world_add_shape(world, body, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), "def->type = 65539: must be in [0, "));
    ck_assert_uint_eq(hull->uses, 1);
    ck_assert_int_eq(sadmm_world_shape_count(world), 0);
    check_shape_data(world);
    sadmm_world_destroy(world);
    sadmm_hull_destroy(hull);
}
END_TEST

START_TEST(memory_runs_out)
{
    enum { HULLS = 40 };
    sadmm_hull *hulls[HULLS];
    sadmm_world *world = make_world();
    const sadmm_body_id body = add_body(world, 0);
    long failures = 0;
    for (int k = 0; k < HULLS; ++k) hulls[k] = make_hull(3 + k);
    for (int k = 0; k < HULLS; ++k) {
        const sadmm_shape_def def = shape_of(hulls[k]);
        for (long n = 0;; ++n, ++failures) {
            const struct sadmm_shape_data before = world->shape_data;
            sadmm_test_fail_allocations_after(n);
            const sadmm_status status = sadmm_world_add_shape(world, body, &def, NULL);
            sadmm_test_fail_allocations_after(-1);
            if (status == SADMM_OK) break;
            ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
            ck_assert_int_eq(sadmm_world_shape_count(world), k);
            ck_assert_uint_eq(hulls[k]->uses, 1);
            ck_assert_uint_eq(world->shape_data.revision, before.revision);
            ck_assert_uint_eq(world->shape_data.doubles, before.doubles);
            check_shape_data(world);
        }
        check_shape_data(world);
    }
    ck_assert_int_gt(failures, 15);
    /* What goes needs no memory. */
    sadmm_test_fail_allocations_after(0);
    MUST(world, sadmm_world_remove_body(world, body));
    sadmm_test_fail_allocations_after(-1);
    check_shape_data(world);
    sadmm_world_destroy(world);
    for (int k = 0; k < HULLS; ++k) {
        ck_assert_uint_eq(hulls[k]->uses, 1);
        sadmm_hull_destroy(hulls[k]);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("hull_world");
    TCase *cases = tcase_create("hull_world");
    tcase_add_test(cases, a_hull_lives_as_long_as_it_is_used);
    tcase_add_test(cases, shape_data_follows);
    tcase_add_test(cases, a_definition_is_read_back);
    tcase_add_test(cases, bad_hulls_are_refused);
    tcase_add_test(cases, memory_runs_out);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
