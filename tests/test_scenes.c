/* The scene library: what it promises about bodies and contacts, repeatability, bad specs. */
#include "core/base/parallel.h"
#include "fewer.h"
#include "fixed_work.h"
#include "scene_tools.h"

static int32_t dynamic_bodies(sadmm_world *world)
{
    int32_t count = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i)
        count += body_def(world, body_at(world, i)).type == SADMM_BODY_DYNAMIC;
    return count;
}

START_TEST(every_scene_builds_and_steps)
{
    const struct sadmm_scene_info *info = sadmm_scene_at((size_t)_i);
    struct sadmm_scene scene = open_scene(info->name);
    if (lacks_hulls(&scene)) return;
    sadmm_world *world = build_scene(&scene);
    struct sadmm_error error = { 0 };
    uint64_t start = state_hash(world);

    ck_assert_str_eq(scene.info->name, info->name);
    ck_assert(info->description[0] && info->duration > 0 && scene.duration == info->duration);
    ck_assert_int_eq(scene.def.settings.method, fixed_settings().method);
    for (int method = 0; method < SADMM_METHOD_COUNT; ++method) {
        struct sadmm_scene other = scene;
        sadmm_scene_set_method(&other, (sadmm_method)method);
        ck_assert_int_eq(other.def.settings.method, method);
        ck_assert_int_eq(other.def.settings.iterations, info->iterations[method]);
        ck_assert_int_ge(other.def.settings.iterations, 1);
        const bool shares = method == SADMM_METHOD_FAST && info->substeps > 0;
        ck_assert_int_eq(other.def.settings.substeps, shares ? info->substeps : 1);
    }
    ck_assert_int_gt(dynamic_bodies(world), 0);
    ck_assert_int_eq(sadmm_scene_before_step(&scene, world, 0, &error), SADMM_OK);
    step_world(world, 1);
    ck_assert(state_hash(world) != start);
    /* Scenes are laid out without overlaps: touching faces may overlap by rounding only. Gaps at the start of a step
     * are taken back from its middle: where a domino is pushed they are off by what half a step's turn differs from a
     * straight line, 0.05 m x (5 rad/s x 0.0025 s)^2 / 2. */
    ck_assert_double_lt(world_report(world).penetration_max, 4e-6);
    sadmm_world_destroy(world);
}
END_TEST

/* Table I, by the paper's method: bodies = DoFs / 6, dt, iterations, m (beside the name in the table), contacts on
 * average. */
static const struct table_row {
    const char *spec;
    int bodies, dt_ms, iterations, m;
    double contacts;
    int settle, steps; /* the part of the run that this test inspects; the whole run: test_standing_slow */
} table[] = {
    { "sliding_cubes:100", 600 / 6, 5, 120, 30, 488, 0, 20 },
    { "sliding_cubes:500", 3000 / 6, 5, 120, 30, 3864, 0, 20 },
    { "sliding_cubes:1000", 6000 / 6, 5, 120, 30, 8961, 0, 10 },
    { "sliding_cubes:1500", 9000 / 6, 5, 120, 30, 14813, 0, 5 },
    { "sliding_cubes:2000", 12000 / 6, 5, 120, 30, 21156, 0, 5 },
    { "vertical_stacks", 2160 / 6, 5, 200, 50, 1438, 20, 20 },
    { "oblique_stacks", 840 / 6, 5, 150, 30, 1087, 0, 20 },
    { "card_houses", 2376 / 6, 1, 300, 100, 2551, 0, 20 },
};

START_TEST(table_one)
{
    const struct table_row *row = &table[_i];
    if (!is_its_turn(1, _i)) return;
    struct sadmm_scene scene = open_scene(row->spec);
    sadmm_scene_set_method(&scene, SADMM_METHOD_PAPER);
    scene.def.settings.threads = 1; /* others run beside this one */
    sadmm_world *world = build_scene(&scene);
    double sum = 0;

    ck_assert_int_eq(dynamic_bodies(world), row->bodies);
    ck_assert_double_eq_tol(scene.def.settings.dt, 1e-3 * row->dt_ms, 1e-12);
    ck_assert_int_eq(scene.def.settings.iterations, row->iterations);
    ck_assert_int_eq(scene.def.settings.penalty_period, row->m);
    step_world(world, row->settle);
    for (int i = 0; i < row->steps; ++i) {
        step_world(world, 1);
        sum += world_report(world).contacts;
    }
    /* 15 %: what the scenes promise; the paper gives counts but no geometry. */
    ck_assert_double_eq_tol(sum / row->steps / row->contacts, 1.0, 0.15);
    sadmm_world_destroy(world);
}
END_TEST

/* Sizes around the turns of the layout: one cube, no upper layer, full and partly filled layers. */
START_TEST(sliding_cubes_have_n_cubes)
{
    static const char *const sizes[] = {"1",   "2",   "3",   "64",  "65",   "66",   "99",
                                        "101", "400", "441", "484", "3000", "20000"};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        char spec[32];
        snprintf(spec, sizeof spec, "sliding_cubes:%s", sizes[i]);
        struct sadmm_scene scene = open_scene(spec);
        sadmm_world *world = build_scene(&scene);
        ck_assert_int_eq(scene.n, atol(sizes[i]));
        ck_assert_int_eq(dynamic_bodies(world), scene.n);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Contacts of the next step, from the geometry alone: every pair of bodies is inspected. For cubes that are not turned,
 * above a ground at z = 0 (body 0): faces that lie over each other within reach make four. */
static int32_t count_by_hand(sadmm_world *world, const sadmm_world_def *def)
{
    int32_t n = sadmm_world_body_count(world), count = 0;
    sadmm_body_state *states = all_states(world);
    double *half = malloc((size_t)n * sizeof *half);
    for (int32_t i = 1; i < n; ++i) {
        sadmm_shape_def shape;
        sadmm_shape_id id;
        MUST(world, sadmm_world_shape_at(world, i, &id)); /* every body has one */
        MUST(world, sadmm_world_shape_def(world, id, &shape, NULL));
        half[i] = shape.size[2];
        ck_assert_double_eq_tol(fabs(states[i].orientation[0]), 1, 1e-12);
    }
    for (int32_t i = 1; i < n; ++i) {
        double reach = def->contact_margin * 2 * half[i] + def->settings.dt * norm3(states[i].linear_velocity);
        if (states[i].position[2] - half[i] <= reach) count += 4;
        for (int32_t j = i + 1; j < n; ++j) {
            const double *a = states[i].position, *b = states[j].position, sum = half[i] + half[j];
            if (fabs(a[0] - b[0]) >= sum || fabs(a[1] - b[1]) >= sum) continue;
            reach = def->contact_margin * 2 * fmin(half[i], half[j]) +
                    def->settings.dt * distance(states[i].linear_velocity, states[j].linear_velocity);
            if (fabs(a[2] - b[2]) - sum <= reach) count += 4;
        }
    }
    free(states);
    free(half);
    return count;
}

/* Heaps of one layer, of few, of all ten, and with a top layer that is not full. */
START_TEST(settled_piles_have_their_contacts)
{
    static const struct {
        const char *spec;
        int32_t bodies;
        double low, high; /* contacts a body */
    } piles[] = {
        { "settled_pile:1", 1, 4, 4 },        { "settled_pile:7", 7, 4, 8 },
        { "settled_pile:300", 300, 6, 9 },    { "settled_pile:1001", 1001, 8, 10 },
        { "settled_pile:10000", 10000, 9, 10 },
    };
    struct sadmm_scene scene = open_scene(piles[_i].spec);
    scene.def.settings.threads = 1;
    sadmm_world *world = build_scene(&scene);

    ck_assert_int_eq(dynamic_bodies(world), piles[_i].bodies);
    int32_t expected = count_by_hand(world, &scene.def);
    step_world(world, 1);
    sadmm_step_report report = world_report(world);
    ck_assert_int_eq(report.contacts, expected);
    double each = (double)report.contacts / report.bodies;
    ck_assert_msg(each >= piles[_i].low && each <= piles[_i].high, "%s: %g contacts a body", piles[_i].spec, each);
    sadmm_world_destroy(world);
}
END_TEST

/* Ten times as many contacts in one step, each of them where it belongs, and everything lands. */
START_TEST(burst_grows_in_one_step)
{
    static const int sizes[] = { 1, 2, 6 };
    int n = sizes[_i / 2], small = 4 * n - 1, over = 5 * n - 2;
    char spec[32];
    snprintf(spec, sizeof spec, "burst:%d", n);
    struct sadmm_scene scene = open_scene(spec);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.settings.threads = 1;
    if (_i % 2) scene.def.settings.dt = 0.001; /* the caller's own: the scene starts closer */
    sadmm_world *world = build_scene(&scene);

    ck_assert_int_eq(dynamic_bodies(world), n * n + small * small);
    ck_assert_int_eq(count_by_hand(world, &scene.def), 4 * n * n);
    step_world(world, 1);
    ck_assert_int_eq(world_report(world).contacts, 4 * n * n);
    ck_assert_int_eq(count_by_hand(world, &scene.def), 4 * n * n + 4 * over * over);
    step_world(world, 1);
    ck_assert_int_eq(world_report(world).contacts, 4 * n * n + 4 * over * over);
    ck_assert_int_ge(world_report(world).contacts, 10 * 4 * n * n);

    step_world(world, 40);
    ck_assert_int_eq(world_report(world).contacts, 4 * n * n + 4 * over * over);
    /* Contacts carry all of the weight but a thousandth, and sink by the slop and no more. */
    ck_assert_double_lt(top_speed(world), 1e-3 * 9.81 * scene.def.settings.dt);
    for (int32_t i = 1; i < sadmm_world_body_count(world); ++i) {
        const int layer = i <= n * n ? 1 : 2;
        double z = body_state(world, body_at(world, i)).position[2];
        ck_assert_double_eq_tol(z, layer == 1 ? 0.21 : 0.42 + 0.05, layer * scene.def.settings.slop);
    }
    sadmm_world_destroy(world);
}
END_TEST

static const struct {
    const char *spec;
    int steps;
} repeatable[] = {
    { "sliding_cubes:100", 20 },
    { "sliding_cubes:1000", 3 }, /* large enough that two threads really share the work */
    { "vertical_stacks:4", 60 }, /* through the landing */
    { "oblique_stacks:2", 20 },
    { "card_houses:1", 20 },
    { "pyramid:6", 20 },
    { "pile:100", 120 }, /* through the first impacts */
    { "mixed_pile:60", 120 },
    { "sliding_pile:60", 120 },
    { "settled_pile:1000", 5 },
    { "burst:3", 30 }, /* through the landing */
    { "kicked_cubes:3", 110 }, /* through the first kick */
    { "incline", 20 },
    { "bounce", 500 }, /* through the first bounce */
    { "spin_plate", 100 },
    { "rolling", 20 },
    { "rocking", 50 }, /* through the first landing */
    { "two_balls", 260 }, /* through the collision */
    { "dominoes:8", 40 }, /* through the first collision */
    { "falling_chain:5", 20 }, /* through the first landing */
    { "chain:5", 40 },
    { "four_bar:2", 40 },
    { "slider_crank", 40 },
    { "bricard", 10 },
    { "grippers:3", 150 }, /* through the grasp */
    { "hand_demo", 60 },
    { "kapla_tower", 20 },
    { "jenga", 250 }, /* a block is on its way out */
    { "bridge", 40 }, /* through the first crate's landing */
    { "ragdolls:2", 150 },
    { "mixer:60", 100 },
    { "arch:9", 20 },
    { "dry_stone:3", 20 },
    { "mesh_pile:60", 60 }, /* through the first impacts */
    { "peg_in_hole", 50 }, /* through the lead-in */
    { "terrain:16", 140 }, /* through the first impacts */
    { "marble_run", 60 },
    { "nuts_and_bolts:2", 15 }, /* through the first touch */
};

/* *before: the hash before the last step. */
static uint64_t hash_after(const char *spec, sadmm_method method, int threads, int steps, uint64_t *before)
{
    struct sadmm_scene scene = open_scene(spec);
    sadmm_scene_set_method(&scene, method);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.settings.threads = threads;
    sadmm_test_force_threads(true); /* also where so many do not pay */
    sadmm_world *world = build_scene(&scene);
    for (int i = 0; i < steps; ++i) {
        struct sadmm_error error = { 0 };
        *before = state_hash(world);
        ck_assert_int_eq(sadmm_scene_before_step(&scene, world, i, &error), SADMM_OK);
        step_world(world, 1);
    }
    uint64_t hash = state_hash(world);
    sadmm_world_destroy(world);
    return hash;
}

START_TEST(runs_repeat_bit_for_bit)
{
    const sadmm_method method = (sadmm_method)(_i % SADMM_METHOD_COUNT);
    const char *spec = repeatable[_i / SADMM_METHOD_COUNT].spec;
    const int steps = repeatable[_i / SADMM_METHOD_COUNT].steps,
              threads = 2 + (_i / SADMM_METHOD_COUNT + _i) % 2; /* each method with two and with three */
    const struct sadmm_scene scene = open_scene(spec);
    uint64_t before, unused;
    if (lacks_hulls(&scene) || !is_its_turn(_i / SADMM_METHOD_COUNT, (int)method)) return;
    const uint64_t once = hash_after(spec, method, 1, steps, &before);

    ck_assert_msg(once == hash_after(spec, method, threads, steps, &unused), "%s: one and %d threads differ", spec,
                  threads);
    ck_assert_msg(once != before, "%s: the hash does not see the last step", spec);
}
END_TEST

START_TEST(bad_specs_are_refused)
{
    static const struct {
        const char *spec, *message;
    } bad[] = {
        { "", "must be one of sliding_cubes[:N[:doors]], vertical_stacks" },
        { "sliding_cube", "must be one of" },
        { "sliding_cubesx", "must be one of" },
        { "a name that is so long that it must be cut for the list to fit", "peg_in_hole[:um]" },
        { ":5", "must be one of" },
        { "sliding_cubes:", "must be a whole number in [1, 1000000]" },
        { "sliding_cubes:abc", "\"sliding_cubes:abc\": N must be a whole number" },
        { "sliding_cubes:5x", "whole number" },
        { "sliding_cubes:-5", "whole number" },
        { "sliding_cubes:+5", "whole number" },
        { "sliding_cubes: 5", "whole number" },
        { "sliding_cubes:1e3", "whole number" },
        { "sliding_cubes:99999999999999999999999", "whole number" },
        { "sliding_cubes:0", "N must be in [1, 1000000]" },
        { "sliding_cubes:1000001", "\"sliding_cubes:1000001\": N must be in [1, 1000000]" },
        { "pyramid:301", "N must be in [1, 300]" },
        { "settled_pile:0", "N must be in [1, 1000000]" },
        { "burst:251", "N must be in [1, 250]" },
        { "incline:3", "incline takes no size" },
        { "chain:1001", "N must be in [1, 1000]" },
        { "chain:10:", "\"chain:10:\": M must be a whole number in [1, 50000]" },
        { "chain:10:0", "M must be in [1, 50000]" },
        { "chain:10:50001", "M must be in [1, 50000]" },
        { "chain:10:5x", "M must be a whole number" },
        { "chain::5", "N must be a whole number" },
        { "arch:15:501", "M must be in [20, 500]" },
        { "chain:10:5:1", "M must be a whole number" },
        { "pyramid:3:4", "\"pyramid:3:4\": N must be a whole number" }, /* it takes no M */
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        struct sadmm_scene scene = { .n = 77 };
        struct sadmm_error error = { 0 };
        ck_assert_int_eq(sadmm_scene_open(bad[i].spec, &scene, &error), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_msg(strstr(error.message, bad[i].message), "\"%s\": %s", bad[i].spec, error.message);
        ck_assert_int_eq(scene.n, 77); /* untouched */
    }
    ck_assert_int_eq(sadmm_scene_open(NULL, &(struct sadmm_scene){ 0 }, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_scene_open("incline", NULL, NULL), SADMM_ERROR_INVALID_ARGUMENT);
}
END_TEST

/* The second number of a spec. */
START_TEST(a_chain_has_its_weight)
{
    static const struct {
        const char *spec;
        long links, mass;
    } chains[] = {{"chain", 10, 10}, {"chain:3", 3, 10}, {"chain:3:777", 3, 777}, {"chain:1000:50000", 1000, 50000}};
    for (size_t i = 0; i < sizeof chains / sizeof *chains; ++i) {
        struct sadmm_scene scene = open_scene(chains[i].spec);
        sadmm_world *world = build_scene(&scene);
        ck_assert_int_eq(scene.n, chains[i].links);
        ck_assert_int_eq(scene.m, chains[i].mass);
        ck_assert_int_eq(sadmm_world_body_count(world), chains[i].links + 1);
        const double mass = body_def(world, body_at(world, (int32_t)chains[i].links)).mass;
        ck_assert_double_eq_tol(mass, (double)chains[i].mass, 1e-12);
        sadmm_world_destroy(world);
    }
    ck_assert_int_eq(open_scene("pyramid:3").m, 0);
}
END_TEST

/* Doors swing, and the raft slides as without them: to the same bits, since they are islands of their own. */
START_TEST(doors_leave_the_raft_alone)
{
    double at[2][3];
    for (int doors = 0; doors < 2; ++doors) {
        struct sadmm_scene scene = open_scene(doors ? "sliding_cubes:30:3" : "sliding_cubes:30");
        sadmm_world *world = build_scene(&scene);
        ck_assert_int_eq(sadmm_world_joint_count(world), 3 * doors);
        step_world(world, 200);
        const sadmm_body_id last = body_at(world, sadmm_world_body_count(world) - 1);
        memcpy(at[doors], body_state(world, last).position, sizeof at[doors]);
        if (doors) {
            sadmm_joint_id hinge;
            sadmm_joint_state state;
            MUST(world, sadmm_world_joint_at(world, 2, &hinge));
            MUST(world, sadmm_world_joint_state(world, hinge, &state));
            ck_assert_double_gt(fabs(state.position[5]), 0.1); /* it began to swing from an angle of 0 */
            ck_assert_int_eq(world_report(world).joints, 3);
        }
        sadmm_world_destroy(world);
    }
    ck_assert_int_eq(memcmp(at[0], at[1], sizeof at[0]), 0);
}
END_TEST

START_TEST(bad_builds_are_refused)
{
    struct sadmm_scene scene = open_scene("incline");
    sadmm_world *world = (sadmm_world *)&scene;
    struct sadmm_error error = { 0 };

    scene.def.settings.dt = -1; /* the caller's own change */
    ck_assert_int_eq(sadmm_scene_build(&scene, &world, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_null(world);
    ck_assert_msg(strstr(error.message, "dt"), "%s", error.message);
    ck_assert_int_eq(sadmm_scene_build(&(struct sadmm_scene){ 0 }, &world, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_scene_build(&scene, NULL, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_scene_before_step(NULL, NULL, 0, &error), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert(!sadmm_scene_has_script(NULL) && !sadmm_scene_has_script(&scene));
    scene = open_scene("grippers:2");
    ck_assert(sadmm_scene_has_script(&scene));
}
END_TEST

START_TEST(the_list_has_no_twins)
{
    ck_assert_uint_eq(sadmm_scene_count(), 37);
    ck_assert_ptr_null(sadmm_scene_at(sadmm_scene_count()));
    for (size_t i = 0; i < sadmm_scene_count(); ++i) {
        for (size_t j = 0; j < i; ++j) ck_assert_str_ne(sadmm_scene_at(i)->name, sadmm_scene_at(j)->name);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("scenes");
    TCase *cases = tcase_create("scenes");

    tcase_set_timeout(cases, 100);
    tcase_add_test(cases, the_list_has_no_twins);
    tcase_add_test(cases, bad_specs_are_refused);
    tcase_add_test(cases, a_chain_has_its_weight);
    tcase_add_test(cases, doors_leave_the_raft_alone);
    tcase_add_test(cases, bad_builds_are_refused);
    tcase_add_loop_test(cases, every_scene_builds_and_steps, 0, (int)sadmm_scene_count());
    tcase_add_test(cases, sliding_cubes_have_n_cubes);
    tcase_add_loop_test(cases, settled_piles_have_their_contacts, 0, 5);
    tcase_add_loop_test(cases, burst_grows_in_one_step, 0, 6);
    tcase_add_loop_test(cases, table_one, 0, sizeof table / sizeof table[0]);
    tcase_add_loop_test(cases, runs_repeat_bit_for_bit, 0,
                         SADMM_METHOD_COUNT * (int)(sizeof repeatable / sizeof repeatable[0]));
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
