/* Environments on the device: each makes the same steps, bit for bit, as if it were alone, whatever the others do; what
 * fails is marked and alone; resets begin again. */
#include "cuda_worlds.h"
#include "environment_tools.h"
#include "momentum_worlds.h"
#include "world/environments/environment_types.h"

enum { FEW = 4 };

static sadmm_environments *replicate(sadmm_world *world, int32_t count)
{
    sadmm_environments *environments;
    MUST(world, sadmm_world_replicate(world, count, &environments));
    ck_assert_int_eq(sadmm_environments_count(environments), count);
    return environments;
}

static sadmm_world *template_of(const char *name, int precision)
{
    struct sadmm_scene scene = open_scene(name);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = (sadmm_precision)precision;
    sadmm_world *world = build_scene(&scene);
    world->def.backend = SADMM_BACKEND_CUDA;
    use_device(world, precision, 0);
    return world;
}

/* An array in the device's memory, and a copy of it. */
struct view {
    sadmm_environments_array in;
    double *host;
    size_t numbers; /* of an environment */
};

static struct view view_of(sadmm_environments *environments, sadmm_array array)
{
    struct view view;
    MUST_ALL(environments, sadmm_environments_bind(environments, array, SADMM_F64, &view.in));
    ck_assert_int_ge(view.in.device, 0);
    view.numbers = (size_t)(view.in.rows * view.in.columns);
    view.host = calloc((size_t)view.in.environments * view.numbers + 1, sizeof *view.host);
    ck_assert_ptr_nonnull(view.host);
    return view;
}

/* As a program does that has the pointer, by a copy from it or to it. */
static const double *look(sadmm_environments *environments, const struct view *view)
{
    sadmm_world *world = environments->merged.world;
    ck_assert_int_eq(world->kernels->resident->from_backend(world->context, view->host, view->in.values,
                                                            (size_t)view->in.environments * view->numbers *
                                                                sizeof *view->host, &world->error), SADMM_OK);
    return view->host;
}

static void destroy_both(const struct view *states, const struct view *state, sadmm_environments *all,
                         sadmm_environments *one, sadmm_world *origin)
{
    free(states->host);
    free(state->host);
    sadmm_environments_destroy(all);
    sadmm_environments_destroy(one);
    sadmm_world_destroy(origin);
}

static void give(sadmm_environments *environments, const struct view *view)
{
    sadmm_world *world = environments->merged.world;
    ck_assert_int_eq(world->kernels->resident->to_backend(world->context, view->in.values, view->host,
                                                          (size_t)view->in.environments * view->numbers *
                                                              sizeof *view->host, &world->error), SADMM_OK);
}

/* Environments together, single ones, and what they were made from. */
static void destroy_all(sadmm_environments *all, sadmm_environments *const *own, sadmm_world *origin)
{
    for (int32_t e = 0; e < FEW; ++e) sadmm_environments_destroy(own[e]);
    sadmm_environments_destroy(all);
    sadmm_world_destroy(origin);
}

static size_t numbers_of(const sadmm_environments *environments, sadmm_array array)
{
    return (size_t)sadmm_environments_rows(environments, array) * (size_t)sadmm_array_columns(array);
}

static const struct {
    const char *name;
    int warm, steps; /* of the template; of all */
} scenes[] = {{"ragdolls:1", 0, EMULATED ? 30 : 100},
              {"ragdolls:1", EMULATED ? 20 : 60, EMULATED ? 6 : 60},
              {"grippers:1", 2, EMULATED ? 6 : 60},
              {"pile:12", EMULATED ? 20 : 40, EMULATED ? 6 : 60},
              {"hand_demo", 2, EMULATED ? 2 : 30}};
enum { SCENES = sizeof scenes / sizeof *scenes };
/* Pushes that differ from environment to environment, of every body that moves; one without joints is thrown up, so
 * that nothing in it touches. */
static void push(sadmm_world *world, const double *template_state, int32_t environment, size_t count, double *state)
{
    const bool thrown = environment == 2 && sadmm_world_joint_count(world) == 0;
    memcpy(state, template_state, count * sizeof *state);
    for (int32_t i = 0; thrown && i < (int32_t)(count / 13); ++i)
        if (body_def(world, body_at(world, i)).type == SADMM_BODY_DYNAMIC) {
            state[13 * i + 2] += 1 + 0.5 * i;
            state[13 * i + 9] = 1;
        }
    for (int32_t i = 0; environment > 0 && i < (int32_t)(count / 13); ++i)
        for (size_t k = 13 * (size_t)i + 7; k < 13 * (size_t)i + 13; ++k)
            if (body_def(world, body_at(world, i)).type == SADMM_BODY_DYNAMIC)
                state[k] += 0.1 * noise((uint32_t)environment, (uint32_t)k);
}

/* Without friction: the others have contacts of as many rows as before. */
static void make_slippery(sadmm_environments *environments, int32_t environment)
{
    const size_t n = numbers_of(environments, SADMM_ARRAY_SHAPE_MATERIAL);
    double *material = calloc(n + 1, sizeof *material);
    MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_SHAPE_MATERIAL, &environment, 1, material));
    for (size_t i = 0; i < n; i += (size_t)sadmm_array_columns(SADMM_ARRAY_SHAPE_MATERIAL)) material[i] = 0;
    MUST_ALL(environments, sadmm_environments_set(environments, SADMM_ARRAY_SHAPE_MATERIAL, &environment, 1, material));
    free(material);
}

/* What the device says of the first environment is what the host says of the same world: its natural map is that of
 * the certificate, but for rounding of velocities, which the host reads after they have been through the state. */
static void expect_report(sadmm_world *world, const double *row, int precision)
{
    const sadmm_step_report report = world_report(world);
    const double rounding = precision == SADMM_F64 ? 1e-12 : 1e-6; /* of some m/s */
    ck_assert_double_eq_tol(row[0], report.certificate.ncp_max, 1e-6 * report.certificate.ncp_max + rounding);
    /* a world's is the deepest of all sub-steps, an environment's of the last one */
    ck_assert_double_ge(row[2], 0);
    ck_assert_double_le(row[2], report.penetration_max);
    ck_assert_double_eq_tol(row[3], report.joint_drift, 1e-12);
    ck_assert_double_eq(row[4], report.contacts);
}

START_TEST(environments_step_as_if_alone)
{
    const int scene = _i / 2, precision = _i % 2;
    const char *name = scenes[scene].name;
    sadmm_world *origin = template_of(name, precision);
    step_world(origin, scenes[scene].warm);
    sadmm_environments *all = replicate(origin, FEW), *own[FEW];
    sadmm_settings settings = sadmm_world_settings(origin);
    settings.certify = true; /* of the one that goes on alone */
    MUST(origin, sadmm_world_set_settings(origin, &settings));
    const size_t n = numbers_of(all, SADMM_ARRAY_BODY_STATE);
    struct view views[OUTPUTS], mine[FEW][OUTPUTS];
    double *state = calloc(FEW * n, sizeof *state);
    for (int k = 0; k < OUTPUTS; ++k) views[k] = view_of(all, outputs[k]);
    for (int32_t e = 0; e < FEW; ++e) {
        own[e] = replicate(origin, 1);
        for (int k = 0; k < OUTPUTS; ++k) mine[e][k] = view_of(own[e], outputs[k]);
        push(origin, look(own[e], &mine[e][0]), e, n, state + n * (size_t)e);
        if (e > 0) {
            MUST_ALL(own[e], sadmm_environments_set(own[e], SADMM_ARRAY_BODY_STATE, NULL, 0, state + n * (size_t)e));
            MUST_ALL(all, sadmm_environments_set(all, SADMM_ARRAY_BODY_STATE, &e, 1, state + n * (size_t)e));
        }
        if (e == FEW - 1) {
            make_slippery(own[e], 0);
            make_slippery(all, e);
        }
    }
    for (int step = 0; step < scenes[scene].steps; step += 2) {
        MUST_ALL(all, sadmm_environments_step(all, 2));
        if (scenes[scene].warm > 0) { /* the first one is the world that goes on */
            double *body = calloc(n, sizeof *body);
            step_world(origin, 2);
            MUST(origin, sadmm_world_get_array(origin, SADMM_ARRAY_BODY_STATE, 0, (int32_t)(n / 13), body));
            expect_same(look(all, &views[0]), body, n, name, 0, step);
            free(body);
            expect_report(origin, look(all, &views[OUTPUTS - 1]), precision);
        }
        for (int32_t e = 0; e < FEW; ++e) {
            MUST_ALL(own[e], sadmm_environments_step(own[e], 2));
            for (int k = 0; k < OUTPUTS; ++k) {
                const size_t count = numbers_of(all, outputs[k]);
                expect_same(look(all, &views[k]) + count * (size_t)e, look(own[e], &mine[e][k]), count,
                            sadmm_array_name(outputs[k]), e, step);
            }
        }
    }
    for (int k = 0; k < OUTPUTS; ++k) {
        free(views[k].host);
        for (int32_t e = 0; e < FEW; ++e) free(mine[e][k].host);
    }
    destroy_all(all, own, origin);
    free(state);
}
END_TEST

/* So many that the device does otherwise what it does for one: mechanisms in flight that balls run into, whose momentum
 * is restored. */
START_TEST(thousands_are_as_one)
{
    enum { MANY = EMULATED ? 36 : 1600, STEPS = 6 };
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)_i;
    sadmm_world *origin = create_world(&def);
    add_mechanism(origin, MECHANISM_FALLS, true, 0.5);
    origin->def.backend = SADMM_BACKEND_CUDA;
    use_device(origin, _i, 0);
    sadmm_environments *all = replicate(origin, MANY), *one = replicate(origin, 1);
    const struct view states = view_of(all, SADMM_ARRAY_BODY_STATE), state = view_of(one, SADMM_ARRAY_BODY_STATE);
    const size_t n = numbers_of(all, SADMM_ARRAY_BODY_STATE), without = sadmm_environments_memory(all);
    for (int step = 0; step < STEPS; ++step) {
        MUST_ALL(all, sadmm_environments_step(all, 1));
        MUST_ALL(one, sadmm_environments_step(one, 1));
        ck_assert_uint_gt(sadmm_environments_memory(all), without + 2 * n * sizeof(double)); /* both states, at least */
        const double *of_all = look(all, &states), *of_one = look(one, &state);
        for (int32_t e = 0; e < MANY; ++e) expect_same(of_all + n * (size_t)e, of_one, n, "step", e, step);
    }
    ck_assert(all->merged.world->resident.loaded); /* nothing has gone by way of the host */
    destroy_both(&states, &state, all, one, origin);
}
END_TEST

/* A random share begins again before each step, with the template's state or one that was kept: each is where a single
 * one is after as many steps from there. */
START_TEST(resets_begin_again)
{
    enum { MANY = EMULATED ? 6 : 64, STEPS = EMULATED ? 12 : 60, KEPT_AT = EMULATED ? 8 : 30 };
    sadmm_world *origin = template_of("grippers:1", _i);
    step_world(origin, EMULATED ? 2 : 20);
    sadmm_environments *all = replicate(origin, MANY), *one = replicate(origin, 1);
    const struct view states = view_of(all, SADMM_ARRAY_BODY_STATE), state = view_of(one, SADMM_ARRAY_BODY_STATE);
    const size_t n = numbers_of(all, SADMM_ARRAY_BODY_STATE);
    double *after = calloc((KEPT_AT + STEPS + 1) * n, sizeof *after);
    int32_t kept;
    for (int step = 0; step <= KEPT_AT + STEPS; ++step) {
        memcpy(after + n * (size_t)step, look(one, &state), n * sizeof *after);
        if (step < KEPT_AT + STEPS) MUST_ALL(one, sadmm_environments_step(one, 1));
    }
    MUST_ALL(all, sadmm_environments_step(all, KEPT_AT));
    MUST_ALL(all, sadmm_environments_keep(all, MANY - 1, &kept));
    MUST_ALL(all, sadmm_environments_reset(all, NULL, 0, NULL));
    int made[MANY] = {0};
    for (int step = 0; step < STEPS; ++step) {
        int32_t which[MANY], from[MANY], count = 0;
        for (int32_t e = 0; e < MANY; ++e) {
            if (noise((uint32_t)e, (uint32_t)step) < 0.6) continue;
            from[count] = noise((uint32_t)e, (uint32_t)(step + 1000)) > 0 ? kept : 0;
            made[e] = from[count] ? KEPT_AT : 0;
            which[count++] = e;
        }
        MUST_ALL(all, sadmm_environments_reset(all, which, count, from));
        for (int32_t e = 0; e < MANY; ++e)
            expect_same(look(all, &states) + n * (size_t)e, after + n * (size_t)made[e], n, "reset", e, step);
        MUST_ALL(all, sadmm_environments_step(all, 1));
        for (int32_t e = 0; e < MANY; ++e)
            expect_same(look(all, &states) + n * (size_t)e, after + n * (size_t)++made[e], n, "step", e, step);
        ck_assert(all->merged.world->resident.loaded); /* nothing has gone by way of the host */
    }
    destroy_both(&states, &state, all, one, origin);
    free(after);
}
END_TEST

/* One gets a force that is no number, one a velocity that overflows: the others have the bits that they have without.
 * Both are as they were before the step that failed, and can begin again. */
START_TEST(what_goes_wrong_stays_alone)
{
    enum { MANY = EMULATED ? 4 : 8, STEPS = EMULATED ? 6 : 30, AT = 3 };
    sadmm_world *origin = template_of("ragdolls:1", _i);
    step_world(origin, 2);
    sadmm_environments *good = replicate(origin, MANY), *bad = replicate(origin, MANY);
    const struct view views[2] = {view_of(good, SADMM_ARRAY_BODY_STATE), view_of(bad, SADMM_ARRAY_BODY_STATE)},
                      wrench = view_of(bad, SADMM_ARRAY_BODY_WRENCH);
    const double *states[2] = {look(good, &views[0]), look(bad, &views[1])};
    const size_t n = numbers_of(good, SADMM_ARRAY_BODY_STATE), wrenches = numbers_of(good, SADMM_ARRAY_BODY_WRENCH);
    double *left = calloc(n, sizeof *left);
    for (int step = 0; step < STEPS; ++step) {
        if (step == AT) {
            const int32_t flies = 2;
            double *state = calloc(n, sizeof *state);
            wrench.host[wrenches + 6 * 2 + 1] = NAN;
            give(bad, &wrench);
            memcpy(left, states[1] + n, n * sizeof *left);
            memcpy(state, states[1] + 2 * n, n * sizeof *state);
            state[13 * 3 + 8] = 1e308;
            MUST_ALL(bad, sadmm_environments_set(bad, SADMM_ARRAY_BODY_STATE, &flies, 1, state));
            free(state);
        }
        MUST_ALL(good, sadmm_environments_step(good, 1));
        MUST_ALL(bad, sadmm_environments_step(bad, 1));
        (void)look(good, &views[0]);
        (void)look(bad, &views[1]);
        for (int32_t e = 0; e < MANY; ++e)
            if (step < AT || (e != 1 && e != 2))
                expect_same(states[1] + n * (size_t)e, states[0] + n * (size_t)e, n, "alone", e, step);
    }
    const uint8_t *marked = sadmm_environments_marked(bad);
    for (int32_t e = 0; e < MANY; ++e) ck_assert_int_eq(marked[e], e == 1 || e == 2);
    expect_same(states[1] + n, left, n, "as it was", 1, STEPS);
    double *read = calloc(n, sizeof *read);
    const int32_t first = 1, both[] = {1, 2};
    MUST_ALL(bad, sadmm_environments_get(bad, SADMM_ARRAY_BODY_STATE, &first, 1, read));
    expect_same(read, left, n, "read", 1, STEPS);
    ck_assert_msg(strstr(sadmm_environments_mark(bad, 1), "body_wrench") != NULL, "\"%s\"",
                  sadmm_environments_mark(bad, 1));
    ck_assert_msg(strstr(sadmm_environments_mark(bad, 2), "not finite") != NULL, "\"%s\"",
                  sadmm_environments_mark(bad, 2));
    wrench.host[wrenches + 6 * 2 + 1] = 0;
    give(bad, &wrench);
    MUST_ALL(bad, sadmm_environments_reset(bad, both, 2, NULL));
    ck_assert_int_eq(marked[1] + marked[2], 0);
    MUST_ALL(good, sadmm_environments_reset(good, NULL, 0, NULL));
    MUST_ALL(good, sadmm_environments_step(good, 3));
    MUST_ALL(bad, sadmm_environments_step(bad, 3));
    (void)look(good, &views[0]);
    (void)look(bad, &views[1]);
    for (int32_t e = 1; e < 3; ++e)
        expect_same(states[1] + n * (size_t)e, states[0] + n * (size_t)e, n, "again", e, 3);
    free(left);
    free(read);
    free(views[0].host);
    free(views[1].host);
    free(wrench.host);
    sadmm_environments_destroy(good);
    sadmm_environments_destroy(bad);
    sadmm_world_destroy(origin);
}
END_TEST

/* Inputs of each: those of single ones. Contacts that are recorded, too. */
START_TEST(inputs_and_contacts_are_an_environments_own)
{
    static const sadmm_array inputs[] = {SADMM_ARRAY_BODY_WRENCH,  SADMM_ARRAY_JOINT_TARGET_POSITION,
                                         SADMM_ARRAY_BODY_INERTIA, SADMM_ARRAY_JOINT_DRIVE_DAMPING,
                                         SADMM_ARRAY_BODY_DAMPING, SADMM_ARRAY_SHAPE_MATERIAL,
                                         SADMM_ARRAY_JOINT_LOWER,  SADMM_ARRAY_JOINT_UPPER};
    enum { INPUTS = sizeof inputs / sizeof *inputs, STEPS = EMULATED ? 6 : 40 };
    sadmm_world *origin = template_of("grippers:1", _i);
    step_world(origin, 2);
    sadmm_environments *all = replicate(origin, FEW), *own[FEW];
    const struct view states = view_of(all, SADMM_ARRAY_BODY_STATE);
    struct view mine[FEW], views[INPUTS], given[FEW][INPUTS];
    const size_t n = states.numbers;
    MUST_ALL(all, sadmm_environments_record_contacts(all, true));
    for (int k = 0; k < INPUTS; ++k) {
        views[k] = view_of(all, inputs[k]);
        (void)look(all, &views[k]);
    }
    for (int32_t e = 0; e < FEW; ++e) {
        own[e] = replicate(origin, 1);
        MUST_ALL(own[e], sadmm_environments_record_contacts(own[e], true));
        mine[e] = view_of(own[e], SADMM_ARRAY_BODY_STATE);
        for (int k = 0; k < INPUTS; ++k) given[e][k] = view_of(own[e], inputs[k]);
    }
    int points = 0;
    for (int step = 0; step < STEPS; ++step) {
        for (int k = 0; k < INPUTS && step % 3 == 0; ++k) {
            for (int32_t e = 0; e < FEW; ++e) {
                for (size_t i = 0; i < views[k].numbers; ++i) {
                    double *number = &views[k].host[views[k].numbers * (size_t)e + i];
                    /* a row alike: moments fit each other */
                    *number *= 1 + 0.01 * noise((uint32_t)e + 7, (uint32_t)(i / (size_t)views[k].in.columns));
                    given[e][k].host[i] = *number;
                }
                give(own[e], &given[e][k]);
            }
            give(all, &views[k]);
        }
        MUST_ALL(all, sadmm_environments_step(all, 1));
        for (int32_t e = 0; e < FEW; ++e) {
            const sadmm_contact *contacts[2];
            int32_t count[2];
            ck_assert_str_eq(sadmm_environments_mark(all, e), "");
            MUST_ALL(own[e], sadmm_environments_step(own[e], 1));
            expect_same(look(all, &states) + n * (size_t)e, look(own[e], &mine[e]), n, "inputs", e, step);
            MUST_ALL(all, sadmm_environments_contacts(all, e, &contacts[0], &count[0]));
            MUST_ALL(own[e], sadmm_environments_contacts(own[e], 0, &contacts[1], &count[1]));
            ck_assert_int_eq(count[0], count[1]);
            if (count[0] > 0) ck_assert_mem_eq(contacts[0], contacts[1], (size_t)count[0] * sizeof **contacts);
            points += count[0];
        }
    }
    ck_assert_int_gt(points, 0);
    free(states.host);
    for (int k = 0; k < INPUTS; ++k) {
        free(views[k].host);
        for (int32_t e = 0; e < FEW; ++e) free(given[e][k].host);
    }
    for (int32_t e = 0; e < FEW; ++e) free(mine[e].host);
    destroy_all(all, own, origin);
}
END_TEST

/* What is set by the host is seen by all: by rows of arrays, by those of environments that are marked, by another
 * precision of an array, by contacts, by resets. */
START_TEST(what_is_set_is_seen)
{
    sadmm_world *origin = template_of("grippers:1", _i);
    step_world(origin, EMULATED ? 4 : 30);
    sadmm_environments *all = replicate(origin, FEW), *fresh = replicate(origin, 1);
    const struct view states = view_of(all, SADMM_ARRAY_BODY_STATE), wrench = view_of(all, SADMM_ARRAY_BODY_WRENCH),
                      one = view_of(fresh, SADMM_ARRAY_BODY_STATE);
    const size_t n = states.numbers;
    double *start = calloc(n, sizeof *start), *state = calloc(n, sizeof *state);
    const sadmm_contact *contacts;
    int32_t count;
    MUST_ALL(all, sadmm_environments_record_contacts(all, true));
    memcpy(start, look(all, &states), n * sizeof *start);
    MUST_ALL(all, sadmm_environments_step(all, 2));
    MUST_ALL(all, sadmm_environments_contacts(all, 2, &contacts, &count));
    ck_assert_int_gt(count, 0);

    sadmm_environments_array single;
    MUST_ALL(all, sadmm_environments_bind(all, SADMM_ARRAY_BODY_STATE, SADMM_F32, &single));
    float *rounded = calloc(FEW * n, sizeof *rounded);
    sadmm_world *merged = all->merged.world;
    ck_assert_int_eq(merged->kernels->resident->from_backend(merged->context, rounded, single.values,
                                                             FEW * n * sizeof *rounded, &merged->error), SADMM_OK);
    (void)look(all, &states);
    for (size_t k = 0; k < FEW * n; ++k) ck_assert(rounded[k] == (float)states.host[k]);
    free(rounded);

    wrench.host[wrench.numbers] = NAN; /* of environment 1 */
    give(all, &wrench);
    MUST_ALL(all, sadmm_environments_step(all, 1));
    ck_assert_int_eq(sadmm_environments_marked(all)[1], 1);
    const int32_t marked = 1, moved = 2;
    MUST_ALL(all, sadmm_environments_set(all, SADMM_ARRAY_BODY_STATE, &marked, 1, start));
    expect_same(look(all, &states) + n, start, n, "marked and set", 1, 3);
    ck_assert_int_eq(sadmm_environments_marked(all)[1], 1);

    /* all that is static is a little higher, until the environment begins again */
    MUST_ALL(all, sadmm_environments_get(all, SADMM_ARRAY_BODY_STATE, &moved, 1, state));
    int statics = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(origin); ++i)
        if (body_def(origin, body_at(origin, i)).type == SADMM_BODY_STATIC) ++statics, state[13 * i + 2] += 0.01;
    ck_assert_int_gt(statics, 0);
    MUST_ALL(all, sadmm_environments_set(all, SADMM_ARRAY_BODY_STATE, &moved, 1, state));
    MUST_ALL(all, sadmm_environments_contacts(all, 2, &contacts, &count));
    ck_assert_int_eq(count, 0);
    wrench.host[wrench.numbers] = 0;
    give(all, &wrench);
    MUST_ALL(all, sadmm_environments_step(all, 1));
    MUST_ALL(all, sadmm_environments_reset(all, NULL, 0, NULL));
    for (int step = 0; step < (EMULATED ? 4 : 30); ++step) {
        for (int32_t e = 0; e < FEW; ++e)
            expect_same(look(all, &states) + n * (size_t)e, look(fresh, &one), n, "again", e, step);
        MUST_ALL(all, sadmm_environments_step(all, 1));
        MUST_ALL(fresh, sadmm_environments_step(fresh, 1));
    }
    free(start);
    free(state);
    free(states.host);
    free(wrench.host);
    free(one.host);
    sadmm_environments_destroy(all);
    sadmm_environments_destroy(fresh);
    sadmm_world_destroy(origin);
}
END_TEST

/* An array that the host gives changes while one that the device takes has changed, too, since the host saw it. */
START_TEST(host_and_device_give_the_same)
{
    sadmm_world *origin = template_of("grippers:1", _i);
    sadmm_environments *all = replicate(origin, 2);
    const struct view stiffness = view_of(all, SADMM_ARRAY_JOINT_DRIVE_STIFFNESS),
                      size = view_of(all, SADMM_ARRAY_SHAPE_SIZE);
    double *held = calloc(stiffness.numbers, sizeof *held);
    (void)look(all, &size);
    MUST_ALL(all, sadmm_environments_step(all, 1));
    const int32_t first = 0;
    (void)look(all, &stiffness);
    for (size_t k = 0; k < 2 * stiffness.numbers; ++k) stiffness.host[k] *= 0.9;
    MUST_ALL(all, sadmm_environments_set(all, SADMM_ARRAY_JOINT_DRIVE_STIFFNESS, &first, 1, stiffness.host));
    MUST_ALL(all, sadmm_environments_step(all, 1));
    for (size_t k = 0; k < 2 * stiffness.numbers; ++k) stiffness.host[k] *= 0.9;
    give(all, &stiffness);
    for (size_t k = 0; k < 2 * size.numbers; ++k) size.host[k] *= 0.999;
    give(all, &size);
    MUST_ALL(all, sadmm_environments_step(all, 1));
    double most = 0;
    for (size_t k = 0; k < stiffness.numbers; ++k) most = fmax(most, stiffness.host[k]);
    ck_assert_double_gt(most, 0);
    ck_assert(all->merged.world->resident.loaded);
    sadmm_world *merged = all->merged.world; /* as the world has them */
    MUST(merged, sadmm_world_get_array(merged, SADMM_ARRAY_JOINT_DRIVE_STIFFNESS, 0,
                                       sadmm_environments_rows(all, SADMM_ARRAY_JOINT_DRIVE_STIFFNESS), held));
    expect_same(held, stiffness.host, stiffness.numbers, "stiffness", 0, 3);
    free(held);
    free(stiffness.host);
    free(size.host);
    sadmm_environments_destroy(all);
    sadmm_world_destroy(origin);
}
END_TEST

enum { LOWER, UPPER, INERTIA, MATERIAL, FRAME, KINDS };
static const sadmm_array kinds[KINDS] = {SADMM_ARRAY_JOINT_LOWER, SADMM_ARRAY_JOINT_UPPER, SADMM_ARRAY_BODY_INERTIA,
                                         SADMM_ARRAY_SHAPE_MATERIAL, SADMM_ARRAY_JOINT_FRAME};

/* Other numbers of environment e. Limits, which are `width` or 0, swing to where none of those before fits beside. */
static void vary(const struct view views[KINDS], const double *width, int32_t e, int step, bool bounces, bool frames)
{
    double *own[KINDS];
    for (int k = 0; k < KINDS; ++k) own[k] = views[k].host + views[k].numbers * (size_t)e;
    for (size_t i = 0; i < views[LOWER].numbers; ++i) {
        const double half = width[i] * (1 + 0.2 * noise((uint32_t)(e + 7 * step), (uint32_t)i)),
                     centre = (step % 2 ? 3 : -3) * width[i];
        if (width[i] > 0) own[LOWER][i] = centre - half, own[UPPER][i] = centre + half;
    }
    for (size_t i = 0; i < views[INERTIA].numbers; ++i) /* a row alike: moments fit each other */
        own[INERTIA][i] *= 1 + 0.02 * noise((uint32_t)(e + 7 * step), (uint32_t)(i / 4));
    for (size_t i = 0; i < views[MATERIAL].numbers; i += 2) {
        own[MATERIAL][i] = 0.6 + 0.3 * noise((uint32_t)(e + 7 * step), (uint32_t)i);
        own[MATERIAL][i + 1] = bounces && e == 1 ? 0.3 : 0;
    }
    for (size_t i = 0; frames && i < views[FRAME].numbers; i += 7)
        own[FRAME][i] += 1e-3 * noise((uint32_t)(e + 7 * step), (uint32_t)i);
}

/* Limits, masses, materials: the device takes them from arrays, and the world stays there; those of each are those of
 * single ones. Frames of joints, and restitution where there was none, go by way of the host, with the same outcome. */
START_TEST(inputs_stay_on_the_device)
{
    enum { STEPS = EMULATED ? 8 : 40, BOUNCES = STEPS / 2, FRAMES = STEPS - 2 };
    sadmm_world *origin = template_of("grippers:1", _i);
    step_world(origin, 2);
    sadmm_environments *all = replicate(origin, FEW), *own[FEW];
    const struct view states = view_of(all, SADMM_ARRAY_BODY_STATE);
    struct view views[KINDS], given[FEW][KINDS], mine[FEW];
    for (int k = 0; k < KINDS; ++k) {
        views[k] = view_of(all, kinds[k]);
        (void)look(all, &views[k]);
    }
    for (int32_t e = 0; e < FEW; ++e) {
        own[e] = replicate(origin, 1);
        mine[e] = view_of(own[e], SADMM_ARRAY_BODY_STATE);
        for (int k = 0; k < KINDS; ++k) given[e][k] = view_of(own[e], kinds[k]);
    }
    double *width = calloc(views[LOWER].numbers, sizeof *width), widest = 0;
    for (size_t i = 0; i < views[LOWER].numbers; ++i) {
        width[i] = fmax(fabs(views[LOWER].host[i]), fabs(views[UPPER].host[i]));
        if (!isfinite(width[i])) width[i] = 0;
        widest = fmax(widest, width[i]);
    }
    ck_assert_double_gt(widest, 0);
    int64_t done = 0; /* since the device took the world over */
    for (int step = 0; step < STEPS; ++step) {
        for (int32_t e = 0; e < FEW; ++e) {
            vary(views, width, e, step, step >= BOUNCES, step == FRAMES);
            for (int k = 0; k < KINDS; ++k) {
                memcpy(given[e][k].host, views[k].host + views[k].numbers * (size_t)e,
                       views[k].numbers * sizeof(double));
                give(own[e], &given[e][k]);
            }
        }
        for (int k = 0; k < KINDS; ++k) give(all, &views[k]);
        MUST_ALL(all, sadmm_environments_step(all, 1));
        done = step == BOUNCES || step == FRAMES ? 1 : done + 1;
        ck_assert_int_eq(all->merged.world->resident.done, done);
        for (int32_t e = 0; e < FEW; ++e) {
            ck_assert_str_eq(sadmm_environments_mark(all, e), "");
            MUST_ALL(own[e], sadmm_environments_step(own[e], 1));
            expect_same(look(all, &states) + states.numbers * (size_t)e, look(own[e], &mine[e]), states.numbers,
                        "inputs", e, step);
        }
    }
    free(width);
    free(states.host);
    for (int k = 0; k < KINDS; ++k) free(views[k].host);
    for (int32_t e = 0; e < FEW; ++e) {
        for (int k = 0; k < KINDS; ++k) free(given[e][k].host);
        free(mine[e].host);
        sadmm_environments_destroy(own[e]);
    }
    sadmm_environments_destroy(all);
    sadmm_world_destroy(origin);
}
END_TEST

/* What the device takes of an input it checks as the host does: the environment is marked, with what the host says. */
START_TEST(inputs_are_checked_on_the_device)
{
    static const struct {
        sadmm_array array;
        size_t column;
        double bad;
        const char *says;
    } wrong[] = {{SADMM_ARRAY_BODY_INERTIA, 0, -1, "body_inertia"},
                 {SADMM_ARRAY_BODY_INERTIA, 2, 1e9, "at most the sum"},
                 {SADMM_ARRAY_BODY_INERTIA, 1, NAN, "body_inertia"},
                 {SADMM_ARRAY_SHAPE_MATERIAL, 0, -0.1, "column 0 = -0.1"},
                 {SADMM_ARRAY_SHAPE_MATERIAL, 1, 1.5, "column 1 = 1.5"},
                 {SADMM_ARRAY_JOINT_LOWER, 0, INFINITY, "lower"},
                 {SADMM_ARRAY_JOINT_UPPER, 0, -INFINITY, "upper"},
                 {SADMM_ARRAY_GRAVITY, 1, 2e6, "gravity"}};
    enum { WRONG = sizeof wrong / sizeof *wrong };
    sadmm_world *origin = template_of("grippers:1", _i);
    sadmm_environments *all = replicate(origin, 3);
    MUST_ALL(all, sadmm_environments_step(all, 1));
    for (int k = 0; k < WRONG; ++k) {
        struct view view = view_of(all, wrong[k].array);
        (void)look(all, &view);
        MUST_ALL(all, sadmm_environments_step(all, 1)); /* with it as it is */
        size_t row = 0;
        const size_t columns = (size_t)view.in.columns, rows = (size_t)view.in.rows;
        /* a body that moves, a coordinate that is free */
        while (wrong[k].array != SADMM_ARRAY_GRAVITY && row + 1 < rows && view.host[row * columns] == 0) ++row;
        const size_t at = view.numbers + row * columns + wrong[k].column; /* of environment 1 */
        const double before = view.host[at];
        view.host[at] = wrong[k].bad;
        give(all, &view);
        MUST_ALL(all, sadmm_environments_step(all, 1));
        for (int32_t e = 0; e < 3; ++e) ck_assert_int_eq(sadmm_environments_marked(all)[e], e == 1);
        ck_assert_msg(strstr(sadmm_environments_mark(all, 1), wrong[k].says) != NULL, "\"%s\"",
                      sadmm_environments_mark(all, 1));
        view.host[at] = before;
        give(all, &view);
        const int32_t one = 1;
        MUST_ALL(all, sadmm_environments_reset(all, &one, 1, NULL));
        MUST_ALL(all, sadmm_environments_step(all, 1));
        ck_assert_int_eq(sadmm_environments_marked(all)[1], 0);
        free(view.host);
    }
    sadmm_environments_destroy(all);
    sadmm_world_destroy(origin);
}
END_TEST

/* Gravity of environments: of the first the settings', of the others more, less, and to another side. */
static const double gravities[FEW][3] = {{0, 0, -9.81}, {0.5, -0.3, -3.7}, {0, 0, -25}, {-2, 1, -9}};

/* Half of the bodies that move fall by another scale, beyond which gravity counts as a force. */
static void scale_gravity(sadmm_world *world)
{
    for (int32_t i = 0; i < sadmm_world_body_count(world); i += 2)
        if (body_def(world, body_at(world, i)).type == SADMM_BODY_DYNAMIC)
            MUST(world, sadmm_world_set_body_gravity_scale(world, body_at(world, i), 1.5));
}

static void set_gravity(sadmm_environments *environments, const double gravity[3])
{
    sadmm_settings settings = sadmm_environments_settings(environments);
    memcpy(settings.gravity, gravity, sizeof settings.gravity);
    MUST_ALL(environments, sadmm_environments_set_settings(environments, &settings));
}

/* Each is as one alone whose settings have its gravity, bit for bit, what is said of the step included; the gravity of
 * some changes while they go on. */
START_TEST(each_has_its_own_gravity)
{
    static const struct {
        const char *name;
        int warm, steps, substeps;
        double dt; /* 0: the scene's */
        bool scaled;
    } falls[] = {{"ragdolls:1", 0, EMULATED ? 30 : 100, 1, 0, false},
                 {"grippers:1", 2, EMULATED ? 6 : 60, 1, 0, true},
                 {"pile:12", EMULATED ? 20 : 40, 8, 1, 0, true},
                 {"bounce", 0, 40, 2, 0.02, false}};
    const int scene = _i / 2, changed_at = falls[scene].steps / 2;
    const char *name = falls[scene].name;
    sadmm_world *origin = template_of(name, _i % 2);
    if (falls[scene].scaled) scale_gravity(origin);
    sadmm_settings settings = sadmm_world_settings(origin);
    settings.substeps = falls[scene].substeps;
    if (falls[scene].dt > 0) settings.dt = falls[scene].dt;
    MUST(origin, sadmm_world_set_settings(origin, &settings));
    step_world(origin, falls[scene].warm);
    sadmm_environments *all = replicate(origin, FEW), *own[FEW];
    struct view views[OUTPUTS], mine[FEW][OUTPUTS], gravity = view_of(all, SADMM_ARRAY_GRAVITY);
    ck_assert_int_eq(gravity.in.rows, 1);
    ck_assert_int_eq(gravity.in.columns, 3);
    for (int32_t e = 0; e < FEW; ++e) {
        expect_same(look(all, &gravity) + 3 * e, settings.gravity, 3, "the template's", e, 0);
        own[e] = replicate(origin, 1);
        set_gravity(own[e], gravities[e]);
    }
    memcpy(gravity.host, gravities, sizeof gravities);
    give(all, &gravity);
    for (int k = 0; k < OUTPUTS; ++k) {
        views[k] = view_of(all, outputs[k]);
        for (int32_t e = 0; e < FEW; ++e) mine[e][k] = view_of(own[e], outputs[k]);
    }
    for (int step = 0; step < falls[scene].steps; step += 2) {
        if (step == changed_at || step == changed_at + 1) {
            for (int32_t e = 0; e < FEW; ++e) {
                double *to = gravity.host + 3 * e;
                if (e % 2) to[0] += 1, to[2] *= -0.5;
                set_gravity(own[e], to);
            }
            give(all, &gravity);
        }
        MUST_ALL(all, sadmm_environments_step(all, 2));
        for (int32_t e = 0; e < FEW; ++e) {
            ck_assert_str_eq(sadmm_environments_mark(all, e), "");
            MUST_ALL(own[e], sadmm_environments_step(own[e], 2));
            for (int k = 0; k < OUTPUTS; ++k) {
                const size_t count = numbers_of(all, outputs[k]);
                const double *values = look(all, &views[k]) + count * (size_t)e;
                expect_same(values, look(own[e], &mine[e][k]), count, sadmm_array_name(outputs[k]), e, step);
            }
        }
        ck_assert(all->merged.world->resident.loaded); /* without the host */
    }
    free(gravity.host);
    for (int k = 0; k < OUTPUTS; ++k) {
        free(views[k].host);
        for (int32_t e = 0; e < FEW; ++e) free(mine[e][k].host);
    }
    destroy_all(all, own, origin);
}
END_TEST

/* Gravity out of range marks the environment that has it; by the host it is set, read and refused as on the CPU, and
 * goes along with what the host sets of states. Where the host drives the steps there is one. */
START_TEST(gravity_is_checked)
{
    sadmm_world *origin = template_of("grippers:1", _i);
    sadmm_environments *all = replicate(origin, FEW), *one = replicate(origin, 1);
    const struct view states = view_of(all, SADMM_ARRAY_BODY_STATE), state = view_of(one, SADMM_ARRAY_BODY_STATE);
    const size_t n = states.numbers;
    const int32_t second = 1, third = 2;
    double read[3], *start = calloc(n, sizeof *start);
    memcpy(start, look(all, &states), n * sizeof *start);
    MUST_ALL(all, sadmm_environments_set(all, SADMM_ARRAY_GRAVITY, &second, 1, gravities[1]));
    MUST_ALL(all, sadmm_environments_get(all, SADMM_ARRAY_GRAVITY, &second, 1, read));
    expect_same(read, gravities[1], 3, "read", 1, 0);
    const double huge[3] = {0, 8e5, -8e5};
    ck_assert_int_eq(sadmm_environments_set(all, SADMM_ARRAY_GRAVITY, &second, 1, huge),
                     SADMM_ERROR_INVALID_ARGUMENT);
    const char *message = sadmm_environments_message(all);
    ck_assert_msg(strstr(message, "gravity") && strstr(message, "must be <= 1e6 m/s^2"), "\"%s\"", message);
    set_gravity(one, gravities[1]);
    for (int step = 0; step < 4; ++step) {
        struct view gravity = view_of(all, SADMM_ARRAY_GRAVITY);
        (void)look(all, &gravity);
        if (step == 1) gravity.host[3 * third + 1] = NAN, give(all, &gravity);
        if (step == 2) MUST_ALL(all, sadmm_environments_set(all, SADMM_ARRAY_BODY_STATE, &third, 1, start));
        if (step == 3) {
            gravity.host[3 * third + 1] = 0, give(all, &gravity);
            MUST_ALL(all, sadmm_environments_reset(all, &third, 1, NULL));
        }
        MUST_ALL(all, sadmm_environments_step(all, 1));
        MUST_ALL(one, sadmm_environments_step(one, 1));
        ck_assert_int_eq(sadmm_environments_marked(all)[2], step == 1 || step == 2);
        if (step == 1)
            ck_assert_msg(strstr(sadmm_environments_mark(all, 2), "gravity") != NULL, "\"%s\"",
                          sadmm_environments_mark(all, 2));
        expect_same(look(all, &states) + n, look(one, &state), n, "by the host", 1, step);
        free(gravity.host);
    }
    sadmm_settings settings = sadmm_environments_settings(all);
    settings.residual_tolerance = 1e-6;
    ck_assert_int_eq(sadmm_environments_set_settings(all, &settings), SADMM_ERROR_INVALID_ARGUMENT);
    message = sadmm_environments_message(all);
    ck_assert_msg(strstr(message, "residual_tolerance = 1e-06") != NULL, "\"%s\"", message);
    MUST_ALL(one, sadmm_environments_set_settings(one, &settings));
    sadmm_environments_array none;
    ck_assert_int_eq(sadmm_environments_bind(one, SADMM_ARRAY_GRAVITY, SADMM_F64, &none), SADMM_ERROR_UNAVAILABLE);
    free(start);
    destroy_both(&states, &state, all, one, origin);
}
END_TEST

int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    Suite *suite = suite_create("cuda_environments");
    ADD_CASE(suite, environments_step_as_if_alone, 0, SCENES * tested_precisions());
    ADD_CASE(suite, thousands_are_as_one, 0, tested_precisions());
    ADD_CASE(suite, resets_begin_again, 0, tested_precisions());
    ADD_CASE(suite, what_goes_wrong_stays_alone, 0, tested_precisions());
    ADD_CASE(suite, what_is_set_is_seen, 0, tested_precisions());
    ADD_CASE(suite, host_and_device_give_the_same, 0, tested_precisions());
    ADD_CASE(suite, inputs_and_contacts_are_an_environments_own, 0, tested_precisions());
    ADD_CASE(suite, inputs_stay_on_the_device, 0, tested_precisions());
    ADD_CASE(suite, inputs_are_checked_on_the_device, 0, tested_precisions());
    ADD_CASE(suite, each_has_its_own_gravity, 0, 4 * tested_precisions());
    ADD_CASE(suite, gravity_is_checked, 0, tested_precisions());
    return run_cuda_suite(suite);
}
