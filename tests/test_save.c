/* Saved worlds: restored they go on to the same bits, with every id and everything that can be read; anything else than
 * what was saved is refused, and nothing changes. */
#include <stdint.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "world/state/world_state.h"

struct saved {
    unsigned char *bytes;
    size_t size;
};

static struct saved save_world(sadmm_world *world)
{
    struct saved saved = {0};
    size_t size;
    MUST(world, sadmm_world_save(world, NULL, 0, &saved.size));
    saved.bytes = malloc(saved.size);
    ck_assert_ptr_nonnull(saved.bytes);
    MUST(world, sadmm_world_save(world, saved.bytes, saved.size, &size));
    ck_assert_uint_eq(size, saved.size);
    return saved;
}

static sadmm_world *empty_world(void)
{
    const sadmm_world_def def = fixed_world_def();
    return create_world(&def);
}

static sadmm_world *restored(const struct saved *saved)
{
    sadmm_world *world = empty_world();
    MUST(world, sadmm_world_restore(world, saved->bytes, saved->size));
    return world;
}

/* The same state gives the same bytes, so this compares all that there is. */
static void expect_same(sadmm_world *a, sadmm_world *b, const char *when)
{
    struct saved of_a = save_world(a), of_b = save_world(b);
    ck_assert_msg(of_a.size == of_b.size && memcmp(of_a.bytes, of_b.bytes, of_a.size) == 0, "%s: states differ", when);
    free(of_a.bytes);
    free(of_b.bytes);
}

static void expect_same_contacts(sadmm_world *a, sadmm_world *b)
{
    const int32_t count = sadmm_world_contact_count(a);
    ck_assert_int_eq(sadmm_world_contact_count(b), count);
    sadmm_contact *of_a = calloc((size_t)count + 1, sizeof *of_a), *of_b = calloc((size_t)count + 1, sizeof *of_b);
    MUST(a, sadmm_world_contacts(a, 0, count, of_a));
    MUST(b, sadmm_world_contacts(b, 0, count, of_b));
    ck_assert_mem_eq(of_a, of_b, (size_t)count * sizeof *of_a);
    free(of_a);
    free(of_b);
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

static const struct {
    const char *spec;
    int before, after; /* steps */
} scenes[] = {
    {"sliding_cubes:30", 8, 8}, {"vertical_stacks:2", 60, 10}, {"card_houses:1", 15, 10}, {"pile:40", 90, 15},
    {"kicked_cubes:2", 105, 10}, {"dominoes:6", 40, 10}, {"falling_chain:4", 20, 10}, {"chain:5", 30, 20},
    {"four_bar:2", 174, 20}, {"bricard", 10, 10}, {"slider_crank", 10, 20}, {"bridge", 15, 8}, {"grippers:2", 150, 20},
    {"ragdolls:2", 120, 20}, {"mixer:30", 60, 10}, {"arch:9", 15, 8}, {"mesh_pile:30", 70, 10}, {"terrain:16", 150, 15},
    {"marble_run", 60, 20}, {"nuts_and_bolts:1", 15, 5}, {"hand_demo", 12, 4}, {"rolling", 30, 10}, {"burst:2", 30, 10},
};
enum { SCENES = sizeof scenes / sizeof *scenes, WAYS = 3 };

static void run(const struct sadmm_scene *scene, sadmm_world *world, int begin, int end)
{
    struct sadmm_error error = {0};
    for (int step = begin; step < end; ++step) {
        ck_assert_msg(sadmm_scene_before_step(scene, world, step, &error) == SADMM_OK, "%s", error.message);
        MUST(world, sadmm_world_step(world));
    }
}

/* In the middle of a scene, with its joints, motors, kinematic bodies and warm starts. */
START_TEST(scenes_go_on)
{
    const int which = _i / WAYS, way = _i % WAYS, before = scenes[which].before, after = scenes[which].after;
    if (getenv("SADMM_TEST_SHORT") && way != which % WAYS) return; /* one way a scene, all of them in turn */
    struct sadmm_scene scene = open_scene(scenes[which].spec);
    if (way == 1) sadmm_scene_set_method(&scene, SADMM_METHOD_PAPER);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = way == 2 ? SADMM_F32 : SADMM_F64;
    scene.def.settings.threads = 1;
    if (lacks_hulls(&scene)) return;
    sadmm_world *world = build_scene(&scene);
    run(&scene, world, 0, before);
    struct saved saved = save_world(world);
    sadmm_world *other = restored(&saved);
    expect_same(world, other, "restored");
    ck_assert_uint_eq(state_hash(world), state_hash(other));
    expect_same_contacts(world, other);
    const sadmm_step_report a = world_report(world), b = world_report(other);
    ck_assert(a.step == b.step && a.time == b.time && a.contacts == b.contacts && a.backend == b.backend);
    run(&scene, world, before, before + after);
    run(&scene, other, before, before + after);
    ck_assert_uint_eq(state_hash(world), state_hash(other));
    expect_same(world, other, "after more steps");
    expect_same_contacts(world, other);
    sadmm_certificate same[2];
    same[0] = certified_step(world), same[1] = certified_step(other);
    ck_assert_mem_eq(&same[0], &same[1], sizeof same[0]);
    /* And back: the world is what it was. */
    MUST(world, sadmm_world_restore(world, saved.bytes, saved.size));
    run(&scene, world, before, before + after);
    sadmm_certificate again = certified_step(world);
    ck_assert_mem_eq(&same[0], &again, sizeof again);
    ck_assert_uint_eq(state_hash(world), state_hash(other));
    free(saved.bytes);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* Before the first step, after one, on the oracle. */
START_TEST(a_world_before_its_first_step)
{
    for (int backend = SADMM_BACKEND_REF; backend <= SADMM_BACKEND_CPU; ++backend) {
        struct sadmm_scene scene = open_scene("pyramid:3");
        scene.def.backend = (sadmm_backend)backend;
        sadmm_world *world = build_scene(&scene);
        for (int steps = 0; steps < 2; ++steps) {
            struct saved saved = save_world(world);
            sadmm_world *other = restored(&saved);
            expect_same(world, other, "restored");
            step_world(world, 1);
            step_world(other, 1);
            ck_assert_uint_eq(state_hash(world), state_hash(other));
            free(saved.bytes);
            sadmm_world_destroy(other);
        }
        sadmm_world_destroy(world);
    }
}
END_TEST

START_TEST(ten_thousand_steps)
{
    struct sadmm_scene scene = open_scene("chain:3:2");
    sadmm_world *world = build_scene(&scene);
    const int steps = getenv("SADMM_TEST_SHORT") ? 1000 : 10000;
    step_world(world, 100);
    struct saved saved = save_world(world);
    sadmm_world *other = restored(&saved);
    step_world(world, steps);
    step_world(other, steps);
    ck_assert_uint_eq(state_hash(world), state_hash(other));
    free(saved.bytes);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* ---- worlds that have changed ------------------------------------------------------------------------------------ */

static sadmm_body_id add_ball(sadmm_world *world, double x, double z, const char *name)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.mass = 1;
    body.name = name;
    sadmm_sphere_inertia(1, 0.1, body.inertia);
    body.position[0] = x;
    body.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.size[0] = 0.1;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* Holes among the slots, things set that no step has seen, pairs with settings of their own. */
START_TEST(what_was_changed_is_kept)
{
    sadmm_world_def def = fixed_world_def();
    sadmm_world *world = create_world(&def);
    sadmm_body_id ids[8], made[2];
    sadmm_shape_id shapes[2];
    int data[8];
    add_floor(world, 0.5);
    for (int k = 0; k < 8; ++k) {
        ids[k] = add_ball(world, 0.15 * k, 0.1 + 0.01 * k, k % 2 ? "ball" : "");
        MUST(world, sadmm_world_set_body_user_data(world, ids[k], &data[k]));
    }
    step_world(world, 20);
    const double force[3] = {1, 2, 3}, torque[3] = {0.1, 0, 0};
    sadmm_body_state state = body_state(world, ids[4]);
    state.position[2] += 0.3;
    MUST(world, sadmm_world_shape_at(world, 1, &shapes[0]));
    MUST(world, sadmm_world_shape_at(world, 3, &shapes[1]));
    MUST(world, sadmm_world_set_pair_friction(world, shapes[0], shapes[1], 0.7));
    MUST(world, sadmm_world_set_body_pair_contact(world, ids[5], ids[6], false));
    MUST(world, sadmm_world_remove_body(world, ids[1]));
    MUST(world, sadmm_world_remove_body(world, ids[7]));
    MUST(world, sadmm_world_set_body_wrench(world, ids[2], force, torque));
    MUST(world, sadmm_world_set_body_state(world, ids[4], &state));
    sadmm_settings settings = sadmm_world_settings(world);
    settings.dt = 0.004;
    settings.iterations = 33;
    MUST(world, sadmm_world_set_settings(world, &settings));

    struct saved saved = save_world(world);
    sadmm_world *other = restored(&saved);
    expect_same(world, other, "restored");
    ck_assert_int_eq(sadmm_world_contact_count(other), 0); /* something was removed */
    ck_assert_int_eq(sadmm_world_settings(other).iterations, 33);
    ck_assert_str_eq(body_def(other, ids[3]).name, "ball");
    ck_assert_ptr_null(sadmm_world_body_user_data(other, ids[3]));
    sadmm_body_state none;
    ck_assert_int_eq(sadmm_world_body_state(other, ids[1], &none), SADMM_ERROR_STALE_ID);
    /* Ids of what is added next are the same, too. */
    made[0] = add_ball(world, -1, 0.3, "new"), made[1] = add_ball(other, -1, 0.3, "new");
    ck_assert(made[0].slot == made[1].slot && made[0].generation == made[1].generation);
    made[0] = add_ball(world, -2, 0.3, "new"), made[1] = add_ball(other, -2, 0.3, "new");
    ck_assert(made[0].slot == made[1].slot && made[0].generation == made[1].generation);
    step_world(world, 30);
    step_world(other, 30);
    expect_same(world, other, "after more steps");
    /* Restored into itself, bodies keep what the caller has given them; new ones have nothing. */
    MUST(world, sadmm_world_restore(world, saved.bytes, saved.size));
    ck_assert_ptr_eq(sadmm_world_body_user_data(world, ids[3]), &data[3]);
    ck_assert_int_eq(sadmm_world_body_count(world), 7);
    free(saved.bytes);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* A body that no step has seen; a target that its velocity has carried beyond where one may be set; bodies beyond where
 * a length may be taken from them. (Any calls: test_save_calls.c.) */
START_TEST(whatever_can_be_reached_is_restored)
{
    sadmm_world_def def = fixed_world_def();
    sadmm_world *world = create_world(&def);
    sadmm_coupling_def pull = sadmm_coupling_def_default();
    sadmm_joint_def distance = sadmm_joint_def_default();
    const sadmm_body_id first = add_ball(world, 0, 0.1, "");
    pull.body = first;
    pull.target_velocity[0] = 1e9;
    MUST(world, sadmm_world_add_coupling(world, &pull, NULL));
    step_world(world, 300); /* 1.5e9 m */
    sadmm_body_state state = body_state(world, add_ball(world, 1, 0.1, ""));
    const sadmm_body_id far = add_ball(world, 2, 0.1, "");
    state.position[0] = 3e9;
    MUST(world, sadmm_world_set_body_state(world, far, &state));
    distance.kind = SADMM_JOINT_DISTANCE;
    distance.body_a = first, distance.body_b = far;
    ck_assert_int_eq(sadmm_world_add_joint(world, &distance, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(
        strstr(sadmm_world_message(world), "def->length (-1: as it is) = 3e+09: must be in [0, 1e+09]"));
    struct saved saved = save_world(world);
    sadmm_world *other = restored(&saved);
    step_world(world, 3);
    step_world(other, 3);
    expect_same(world, other, "after more steps");
    free(saved.bytes);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* ---- another process --------------------------------------------------------------------------------------------- */

static const char *program;

/* In a process of its own: read a saved world from standard input, make the steps, print the hash. */
static int go_on(int steps)
{
    static unsigned char bytes[1 << 22];
    const size_t size = fread(bytes, 1, sizeof bytes, stdin);
    const sadmm_world_def def = fixed_world_def();
    sadmm_world *world = NULL;
    uint64_t hash = 0;
    if (sadmm_world_create(&def, &world) != SADMM_OK || sadmm_world_restore(world, bytes, size) != SADMM_OK) return 1;
    for (int k = 0; k < steps; ++k)
        if (sadmm_world_step(world) != SADMM_OK) return 2;
    if (sadmm_world_state_hash(world, &hash) != SADMM_OK) return 3;
    printf("%016llx\n", (unsigned long long)hash);
    sadmm_world_destroy(world);
    return 0;
}

START_TEST(another_process_goes_on)
{
    struct sadmm_scene scene = open_scene("ragdolls:1");
    sadmm_world *world = build_scene(&scene);
    char path[] = "/tmp/saved_world_XXXXXX", command[4200], line[64] = "", wanted[64];
    step_world(world, 100);
    struct saved saved = save_world(world);
    const int file = mkstemp(path);
    ck_assert_int_ge(file, 0);
    ck_assert_int_eq(write(file, saved.bytes, saved.size), (ssize_t)saved.size);
    close(file);
    step_world(world, 50);
    snprintf(wanted, sizeof wanted, "%016llx\n", (unsigned long long)state_hash(world));
    snprintf(command, sizeof command, "'%s' --go-on 50 < %s", program, path);
    FILE *child = popen(command, "r");
    ck_assert_ptr_nonnull(child);
    ck_assert_ptr_nonnull(fgets(line, sizeof line, child));
    ck_assert_int_eq(pclose(child), 0);
    ck_assert_str_eq(line, wanted);
    unlink(path);
    free(saved.bytes);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- refusals ---------------------------------------------------------------------------------------------------- */

static void expect_refused(sadmm_world *world, const void *bytes, size_t size, const char *message)
{
    const uint64_t before = state_hash(world);
    ck_assert_int_eq(sadmm_world_restore(world, bytes, size), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(strstr(sadmm_world_message(world), message) != NULL, "%s: no \"%s\"", sadmm_world_message(world),
                  message);
    ck_assert_uint_eq(state_hash(world), before);
}

START_TEST(what_was_not_saved_is_refused)
{
    struct sadmm_scene scene = open_scene("pyramid:2");
    sadmm_world *world = build_scene(&scene);
    step_world(world, 5);
    struct saved saved = save_world(world);
    unsigned char *copy = malloc(saved.size + 1);
    size_t size;
    step_world(world, 5);
    memcpy(copy, saved.bytes, saved.size);
    copy[saved.size] = 0;
    expect_refused(world, copy, 10, "size = 10: must be at least");
    expect_refused(world, copy, saved.size + 1, "which was saved");
    for (size_t cut = 1; cut < saved.size; cut += 37) expect_refused(world, copy, saved.size - cut, "size = ");
    for (size_t at = 0; at < saved.size; at += at < 300 ? 1 : 53) {
        copy[at] ^= (unsigned char)(1 << at % 8);
        expect_refused(world, copy, saved.size, at < 8 ? "what sadmm_world_save wrote" : at < 256 ? "of another one"
                                                : at < 264 ? "which was saved" : "damaged");
        copy[at] ^= (unsigned char)(1 << at % 8);
    }
    ck_assert_int_eq(sadmm_world_save(world, copy, saved.size - 1, &size), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_uint_gt(size, saved.size - 1);
    ck_assert_int_eq(sadmm_world_save(world, NULL, 1, &size), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_save(world, NULL, 0, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_restore(world, NULL, 0), SADMM_ERROR_INVALID_ARGUMENT);
    free(copy);
    free(saved.bytes);
    sadmm_world_destroy(world);
}
END_TEST

/* Enumerations index lists of names, sizes and functions. */
START_TEST(values_of_no_name_are_refused)
{
    const sadmm_world_def def = fixed_world_def();
    sadmm_world *world = create_world(&def), *other = empty_world();
    sadmm_joint_def hinge = sadmm_joint_def_default();
    add_floor(world, 0.5);
    hinge.kind = SADMM_JOINT_REVOLUTE;
    hinge.body_b = add_ball(world, 0, 0.1, "");
    MUST(world, sadmm_world_add_joint(world, &hinge, NULL));
    step_world(world, 1);
    step_world(other, 1);
    const struct {
        void *at;
        int count;
        const char *message;
    } values[] = {
        {&world->def.backend, SADMM_BACKEND_COUNT, "(the definition of a world)"},
        {&world->def.precision, SADMM_F64 + 1, "(the definition of a world)"},
        {&world->def.settings.method, SADMM_METHOD_COUNT, "(settings)"},
        {&world->bodies[1].type, SADMM_BODY_KINEMATIC + 1, "(a body)"},
        {&world->geometries[1].type, SADMM_SHAPE_TYPE_COUNT, "(a shape)"},
        {&world->joints[0].def.kind, SADMM_JOINT_KIND_COUNT, "(a joint)"},
        {&world->joints[0].def.coordinates[5].drive, SADMM_DRIVE_COUNT, "(a joint)"},
        {&world->report.backend, SADMM_BACKEND_COUNT, "(the report of a step)"},
        {&world->report.precision, SADMM_F64 + 1, "(the report of a step)"},
        {&world->step_settings.method, SADMM_METHOD_COUNT, "(settings)"},
    };
    for (size_t k = 0; k < sizeof values / sizeof *values; ++k) {
        const int none[] = {-1, values[k].count, 1025};
        int kept;
        memcpy(&kept, values[k].at, sizeof kept);
        for (size_t i = 0; i < sizeof none / sizeof *none; ++i) {
            memcpy(values[k].at, &none[i], sizeof none[i]);
            const struct saved saved = save_world(world);
            expect_refused(other, saved.bytes, saved.size, values[k].message);
            free(saved.bytes);
        }
        memcpy(values[k].at, &kept, sizeof kept);
    }
    const struct saved saved = save_world(world);
    MUST(other, sadmm_world_restore(other, saved.bytes, saved.size));
    expect_same(world, other, "restored");
    free(saved.bytes);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* Steps are counted from what was saved; errors of contacts are those that this world has measured. */
START_TEST(counts_of_steps_go_on)
{
    const sadmm_world_def def = fixed_world_def();
    sadmm_world *world = create_world(&def), *other = empty_world();
    add_floor(world, 0.5);
    add_ball(world, 0, 0.1, "");
    step_world(world, 1);
    step_world(other, 1);
    const struct {
        int64_t *count, value;
        bool fine;
    } counts[] = {
        {&world->report.step, -1, false},           {&world->report.step, INT64_MAX, false},
        {&world->report.step, INT64_MAX / 2, true}, {&world->report.repeated, -1, false},
        {&world->report.repeated, INT64_MAX, false}, {&world->report.step, 0, true},
    };
    for (size_t k = 0; k < sizeof counts / sizeof *counts; ++k) {
        const int64_t kept = *counts[k].count;
        double error;
        *counts[k].count = counts[k].value;
        const struct saved saved = save_world(world);
        *counts[k].count = kept;
        if (counts[k].fine) {
            MUST(other, sadmm_world_restore(other, saved.bytes, saved.size));
            ck_assert_int_eq(sadmm_world_contact_count(other), 1);
            ck_assert_int_eq(sadmm_world_contact_errors(other, 0, 1, &error), SADMM_ERROR_UNAVAILABLE);
            step_world(other, 1);
            ck_assert(world_report(other).step == counts[k].value + 1);
        } else {
            expect_refused(other, saved.bytes, saved.size, "(the report of a step)");
        }
        free(saved.bytes);
    }
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* Whichever allocation fails. */
START_TEST(without_memory_nothing_changes)
{
    const char *const specs[] = {"ragdolls:1", "arch:9", "marble_run"};
    for (size_t k = 0; k < sizeof specs / sizeof *specs; ++k) {
        struct sadmm_scene scene = open_scene(specs[k]);
        if (lacks_hulls(&scene)) continue;
        sadmm_world *world = build_scene(&scene), *other = empty_world();
        step_world(world, 30);
        struct saved saved = save_world(world);
        long successes = 0;
        sadmm_status status;
        do {
            sadmm_test_fail_allocations_after(successes++);
            status = sadmm_world_restore(other, saved.bytes, saved.size);
            sadmm_test_fail_allocations_after(-1);
            ck_assert(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY);
            if (status != SADMM_OK) ck_assert_int_eq(sadmm_world_body_count(other), 0);
        } while (status != SADMM_OK && successes < 10000);
        ck_assert_int_gt(successes, 10);
        expect_same(world, other, "restored");
        free(saved.bytes);
        sadmm_world_destroy(world);
        sadmm_world_destroy(other);
    }
}
END_TEST

int main(int argc, char **argv)
{
    if (argc == 3 && strcmp(argv[1], "--go-on") == 0) return go_on(atoi(argv[2]));
    program = argv[0];
    Suite *suite = suite_create("saved worlds");
    TCase *cases = tcase_create("saved worlds");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, scenes_go_on, 0, SCENES * WAYS);
    tcase_add_test(cases, a_world_before_its_first_step);
    tcase_add_test(cases, ten_thousand_steps);
    tcase_add_test(cases, what_was_changed_is_kept);
    tcase_add_test(cases, whatever_can_be_reached_is_restored);
    tcase_add_test(cases, another_process_goes_on);
    tcase_add_test(cases, what_was_not_saved_is_refused);
    tcase_add_test(cases, values_of_no_name_are_refused);
    tcase_add_test(cases, counts_of_steps_go_on);
    tcase_add_test(cases, without_memory_nothing_changes);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
