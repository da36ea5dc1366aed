/* Environments: each makes the same steps, bit for bit, as a world of its own, whatever the others do, on however many
 * threads; what fails is marked and alone; resets begin again; errors change nothing. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "environment_tools.h"
#include "fixed_work.h"
#include "subadmm/save.h"

#define REFUSED(environments, part, call)                                                       \
    do {                                                                                        \
        ck_assert_int_ne((call), SADMM_OK);                                                     \
        ck_assert_msg(strstr(sadmm_environments_message(environments), part) != NULL, "\"%s\"", \
                      sadmm_environments_message(environments));                                \
    } while (0)

static sadmm_world *template_of(const char *name, int precision, int threads)
{
    struct sadmm_scene scene = open_scene(name);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = (sadmm_precision)precision;
    scene.def.settings.threads = threads;
    return build_scene(&scene);
}

static sadmm_environments *replicate(sadmm_world *world, int32_t count)
{
    sadmm_environments *environments;
    MUST(world, sadmm_world_replicate(world, count, &environments));
    ck_assert_int_eq(sadmm_environments_count(environments), count);
    return environments;
}

/* A world of its own, as the template is. */
static sadmm_world *alone(sadmm_world *from)
{
    size_t size;
    MUST(from, sadmm_world_save(from, NULL, 0, &size));
    void *bytes = malloc(size);
    ck_assert_ptr_nonnull(bytes);
    MUST(from, sadmm_world_save(from, bytes, size, &size));
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = create_world(&def);
    MUST(world, sadmm_world_restore(world, bytes, size));
    free(bytes);
    return world;
}

static double *array_of(sadmm_environments *environments, sadmm_array array)
{
    sadmm_environments_array out;
    MUST_ALL(environments, sadmm_environments_bind(environments, array, SADMM_F64, &out));
    return (double *)out.values;
}

static size_t numbers_of(sadmm_world *world, sadmm_array array)
{
    return (size_t)sadmm_world_array_rows(world, array) * (size_t)sadmm_array_columns(array);
}

static double *read_array(sadmm_world *world, sadmm_array array)
{
    double *numbers = calloc(numbers_of(world, array) + 1, sizeof *numbers);
    ck_assert_ptr_nonnull(numbers);
    MUST(world, sadmm_world_get_array(world, array, 0, sadmm_world_array_rows(world, array), numbers));
    return numbers;
}

static void write_array(sadmm_world *world, sadmm_array array, const double *numbers)
{
    MUST(world, sadmm_world_set_array(world, array, 0, sadmm_world_array_rows(world, array), numbers));
}

/* ---- as worlds of their own -------------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    int warm, steps; /* of the template; of all */
} scenes[] = {{"ragdolls:1", 0, 120}, {"ragdolls:1", 60, 40},    {"grippers:1", 30, 60},
              {"pile:12", 0, 80},     {"card_houses:1", 20, 20}, {"vertical_stacks:3", 5, 40},
              {"chain:6", 0, 40},     {"mixed_pile:20", 0, 60}};
enum { SCENES = sizeof scenes / sizeof *scenes, FEW = 5 };
/* Velocities differ from environment to environment, of dynamic bodies: others take none. */
static void push_bodies(sadmm_world *world, int32_t environment, double *state)
{
    const int32_t bodies = sadmm_world_body_count(world);
    for (int32_t i = 0; i < bodies; ++i) {
        sadmm_body_def def;
        MUST(world, sadmm_world_body_def(world, body_at(world, i), &def));
        for (int k = 7; k < 13 && def.type == SADMM_BODY_DYNAMIC; ++k)
            state[13 * i + k] += 0.1 * noise((uint32_t)environment, (uint32_t)(13 * i + k));
    }
}

START_TEST(environments_step_as_worlds_of_their_own)
{
    const int scene = _i / 4, precision = _i % 2 ? SADMM_F64 : SADMM_F32, threads = _i % 4 / 2 ? 3 : 1;
    const char *name = scenes[scene].name;
    sadmm_world *origin = template_of(name, precision, threads), *worlds[FEW];
    step_world(origin, scenes[scene].warm);
    sadmm_test_force_threads(true);
    sadmm_environments *environments = replicate(origin, FEW);
    sadmm_test_force_threads(false);
    double *views[OUTPUTS];
    const size_t bodies = numbers_of(origin, SADMM_ARRAY_BODY_STATE);
    double *starts = calloc(FEW * bodies, sizeof *starts);
    for (int32_t e = 0; e < FEW; ++e) {
        worlds[e] = alone(origin);
        double *state = read_array(worlds[e], SADMM_ARRAY_BODY_STATE);
        push_bodies(worlds[e], e, state);
        memcpy(starts + bodies * (size_t)e, state, bodies * sizeof *state);
        write_array(worlds[e], SADMM_ARRAY_BODY_STATE, state);
        free(state);
    }
    for (int k = 0; k < OUTPUTS; ++k) views[k] = array_of(environments, outputs[k]);
    MUST_ALL(environments, sadmm_environments_set(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, starts));
    for (int step = 0; step < scenes[scene].steps; step += 2) {
        sadmm_test_force_threads(true); /* as many as asked for, of these calls */
        MUST_ALL(environments, sadmm_environments_step(environments, 2));
        sadmm_test_force_threads(false);
        for (int32_t e = 0; e < FEW; ++e) {
            step_world(worlds[e], 2);
            for (int k = 0; k < OUTPUTS; ++k) {
                const size_t n = numbers_of(origin, outputs[k]);
                double *own = read_array(worlds[e], outputs[k]);
                expect_same(views[k] + n * (size_t)e, own, n, name, e, step);
                free(own);
            }
        }
    }
    for (int32_t e = 0; e < FEW; ++e) sadmm_world_destroy(worlds[e]);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(origin);
    free(starts);
}
END_TEST

/* ---- a machine with everything ----------------------------------------------------------------------------------- */

/* A kinematic floor that moves, a driven arm with a gear and a joint that breaks, a coupling, boxes that fall. */
struct machine {
    sadmm_world *world;
    sadmm_body_id lift;
};

static sadmm_body_id add_part(sadmm_world *world, sadmm_body_type type, double x, double z, double half)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    def.type = type;
    def.mass = 1;
    for (int k = 0; k < 3; ++k) def.inertia[k] = 0.01 * (1 + 0.2 * k);
    def.position[0] = x, def.position[2] = z;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    shape.type = SADMM_SHAPE_BOX;
    for (int k = 0; k < 3; ++k) shape.size[k] = half;
    if (type == SADMM_BODY_KINEMATIC) shape.size[2] = 0.05;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

static struct machine build_machine(void)
{
    static const double straight[4] = {1, 0, 0, 0};
    struct machine m;
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_joint_id hinges[2];
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.substeps = 2;
    m.world = create_world(&def);
    m.lift = add_part(m.world, SADMM_BODY_KINEMATIC, 0, 0, 3);
    const sadmm_body_id base = add_part(m.world, SADMM_BODY_DYNAMIC, 0, 0.16, 0.1);
    for (int k = 0; k < 2; ++k) {
        const sadmm_body_id arm = add_part(m.world, SADMM_BODY_DYNAMIC, 0.3 * (k ? 1 : -1), 0.5, 0.1);
        const double at[3] = {0.15 * (k ? 1 : -1), 0, 0.5};
        sadmm_joint_def joint = sadmm_joint_def_default();
        joint.kind = SADMM_JOINT_REVOLUTE;
        joint.body_a = base, joint.body_b = arm;
        MUST(m.world, sadmm_world_place_joint(m.world, &joint, at, straight));
        joint.coordinates[5].drive = SADMM_DRIVE_POSITION;
        joint.coordinates[5].drive_stiffness = 50;
        joint.coordinates[5].drive_damping = 2;
        MUST(m.world, sadmm_world_add_joint(m.world, &joint, &hinges[k]));
    }
    sadmm_gear_def gear = sadmm_gear_def_default();
    gear.joint_1 = hinges[0], gear.joint_2 = hinges[1];
    gear.coordinate_1 = gear.coordinate_2 = 5;
    gear.ratio = -1;
    MUST(m.world, sadmm_world_add_gear(m.world, &gear, NULL));
    sadmm_joint_def weak = sadmm_joint_def_default();
    const double hung[3] = {1, 0, 0.6};
    weak.body_b = add_part(m.world, SADMM_BODY_DYNAMIC, 1, 0.5, 0.1);
    weak.break_force = 12; /* its weight is 9.81 N: some environments break it */
    MUST(m.world, sadmm_world_place_joint(m.world, &weak, hung, straight));
    MUST(m.world, sadmm_world_add_joint(m.world, &weak, NULL));
    sadmm_coupling_def coupling = sadmm_coupling_def_default();
    coupling.body = add_part(m.world, SADMM_BODY_DYNAMIC, -1, 0.5, 0.1);
    coupling.linear_stiffness = 500, coupling.linear_damping = 20;
    coupling.target_position[0] = -1, coupling.target_position[2] = 0.5;
    coupling.target_velocity[1] = 0.2;
    MUST(m.world, sadmm_world_add_coupling(m.world, &coupling, NULL));
    for (int k = 0; k < 3; ++k) (void)add_part(m.world, SADMM_BODY_DYNAMIC, 0.02 * k, 0.9 + 0.25 * k, 0.1);
    return m;
}

static struct machine machine_on(int threads)
{
    sadmm_test_force_threads(threads > 1);
    const struct machine m = build_machine();
    sadmm_settings settings = sadmm_world_settings(m.world);
    settings.threads = threads;
    MUST(m.world, sadmm_world_set_settings(m.world, &settings));
    return m;
}

static const sadmm_array inputs[] = {SADMM_ARRAY_BODY_WRENCH,
                                     SADMM_ARRAY_BODY_INERTIA,
                                     SADMM_ARRAY_JOINT_TARGET_POSITION,
                                     SADMM_ARRAY_JOINT_FRICTION,
                                     SADMM_ARRAY_JOINT_ARMATURE,
                                     SADMM_ARRAY_SHAPE_MATERIAL,
                                     SADMM_ARRAY_GRAVITY,
                                     SADMM_ARRAY_BODY_DAMPING,
                                     SADMM_ARRAY_JOINT_DRIVE_STIFFNESS,
                                     SADMM_ARRAY_JOINT_DRIVE_DAMPING,
                                     SADMM_ARRAY_BODY_GRAVITY_SCALE,
                                     SADMM_ARRAY_JOINT_DRIVE_LIMIT,
                                     SADMM_ARRAY_SHAPE_SIZE,
                                     SADMM_ARRAY_SHAPE_FRAME};
enum { INPUTS = sizeof inputs / sizeof *inputs };

/* Every number that is not 0 becomes another one; those of joints' free coordinates, too. */
static void vary(sadmm_world *world, sadmm_array array, int32_t environment, int step, double *numbers)
{
    const size_t n = numbers_of(world, array);
    const int32_t columns = sadmm_array_columns(array);
    double *own = read_array(world, array);
    for (size_t k = 0; k < n; ++k) {
        const double x = noise((uint32_t)(environment + 100 * step), (uint32_t)(k + 31 * array));
        numbers[k] = isfinite(own[k]) ? own[k] * (1 + 0.1 * x) : own[k];
        if (array == SADMM_ARRAY_JOINT_TARGET_POSITION && k / (size_t)columns < 2 && k % (size_t)columns == 5)
            numbers[k] = 0.5 * x;
        if (array == SADMM_ARRAY_JOINT_FRICTION && k / (size_t)columns < 2 && k % (size_t)columns == 5)
            numbers[k] = 0.1 + 0.1 * x;
        if (array == SADMM_ARRAY_BODY_WRENCH && k / (size_t)columns > 0 && k % (size_t)columns < 3) numbers[k] = 3 * x;
    }
    for (size_t k = 0; array == SADMM_ARRAY_SHAPE_FRAME && k < n; k += 7) {
        for (size_t j = k; j < k + 3; ++j) numbers[j] = 0.01 * noise((uint32_t)(environment + 100 * step), (uint32_t)j);
        numbers[k + 3] = 0.96, numbers[k + 6] = environment % 2 ? 0.28 : -0.28; /* about z; of unit length */
    }
    if (array == SADMM_ARRAY_SHAPE_MATERIAL)
        for (size_t k = 1; k < n; k += 2) numbers[k] = environment % 2 ? 0.3 : 0;
    free(own);
}

START_TEST(inputs_are_an_environments_own)
{
    struct machine m = machine_on(_i ? 2 : 1);
    static const double up[3] = {0.1, 0, 0.05}, straight[4] = {1, 0, 0, 0};
    MUST(m.world, sadmm_world_move_body(m.world, m.lift, up, straight)); /* in the first step */
    sadmm_environments *environments = replicate(m.world, FEW);
    const double *state = array_of(environments, SADMM_ARRAY_BODY_STATE),
                 *reaction = array_of(environments, SADMM_ARRAY_COUPLING_REACTION),
                 *wrench = array_of(environments, SADMM_ARRAY_BODY_CONTACT_WRENCH);
    double *views[INPUTS];
    for (int k = 0; k < INPUTS; ++k) views[k] = array_of(environments, inputs[k]);
    sadmm_world *worlds[FEW];
    for (int32_t e = 0; e < FEW; ++e) worlds[e] = alone(m.world);
    int broken = 0;
    for (int step = 0; step < 60; ++step) {
        for (int32_t e = 0; e < FEW; ++e)
            for (int k = 0; k < INPUTS && step % 20 == 0; ++k) {
                double *of = views[k] + numbers_of(m.world, inputs[k]) * (size_t)e;
                vary(m.world, inputs[k], e, step, of);
                write_array(worlds[e], inputs[k], of);
            }
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
        for (int32_t e = 0; e < FEW; ++e) {
            ck_assert_str_eq(sadmm_environments_mark(environments, e), "");
            step_world(worlds[e], 1);
            const struct {
                sadmm_array array;
                const double *values;
            } compared[] = {{SADMM_ARRAY_BODY_STATE, state},
                            {SADMM_ARRAY_COUPLING_REACTION, reaction},
                            {SADMM_ARRAY_BODY_CONTACT_WRENCH, wrench}};
            for (size_t k = 0; k < sizeof compared / sizeof *compared; ++k) {
                const size_t n = numbers_of(m.world, compared[k].array);
                double *own = read_array(worlds[e], compared[k].array);
                expect_same(compared[k].values + n * (size_t)e, own, n, "machine", e, step);
                free(own);
            }
        }
    }
    for (int32_t e = 0; e < FEW; ++e) {
        sadmm_joint_id id;
        sadmm_joint_state joint;
        MUST(worlds[e], sadmm_world_joint_at(worlds[e], 2, &id));
        MUST(worlds[e], sadmm_world_joint_state(worlds[e], id, &joint));
        broken += joint.broken;
        sadmm_world_destroy(worlds[e]);
    }
    ck_assert_int_gt(broken, 0);   /* of some, so that environments do differ in it, */
    ck_assert_int_lt(broken, FEW); /* not of all */
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
    sadmm_test_force_threads(false);
}
END_TEST

/* ---- resets ------------------------------------------------------------------------------------------------------ */

/* A random share of the environments begins again after every step; each is where a world of its own is after as many
 * steps as it has made since. */
START_TEST(resets_begin_again)
{
    enum { MANY = 24, STEPS = 40 };
    struct machine m = build_machine();
    sadmm_environments *environments = replicate(m.world, MANY);
    const double *state = array_of(environments, SADMM_ARRAY_BODY_STATE);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_BODY_STATE);
    double *after[STEPS + 1];
    sadmm_world *world = alone(m.world);
    for (int step = 0; step <= STEPS; ++step) {
        after[step] = read_array(world, SADMM_ARRAY_BODY_STATE);
        step_world(world, 1);
    }
    int made[MANY] = {0};
    for (int step = 0; step < STEPS; ++step) {
        int32_t which[MANY], count = 0;
        for (int32_t e = 0; e < MANY; ++e)
            if (noise((uint32_t)e, (uint32_t)step) > 0.8) which[count++] = e, made[e] = 0;
        MUST_ALL(environments, sadmm_environments_reset(environments, which, count, NULL));
        for (int32_t e = 0; e < MANY; ++e) expect_same(state + n * (size_t)e, after[made[e]], n, "reset", e, step);
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
        for (int32_t e = 0; e < MANY; ++e) expect_same(state + n * (size_t)e, after[++made[e]], n, "step", e, step);
    }
    for (int step = 0; step <= STEPS; ++step) free(after[step]);
    sadmm_world_destroy(world);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

START_TEST(kept_states_are_begun_with)
{
    struct machine m = build_machine();
    sadmm_environments *environments = replicate(m.world, 3);
    double *state = array_of(environments, SADMM_ARRAY_BODY_STATE);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_BODY_STATE);
    int32_t kept;
    MUST_ALL(environments, sadmm_environments_step(environments, 25));
    MUST_ALL(environments, sadmm_environments_keep(environments, 1, &kept));
    ck_assert_int_eq(kept, 1);
    MUST_ALL(environments, sadmm_environments_step(environments, 20));
    double *later = malloc(n * sizeof *later);
    memcpy(later, state + n, n * sizeof *later);
    const int32_t which[] = {2, 0}, states[] = {1, 0};
    MUST_ALL(environments, sadmm_environments_reset(environments, which, 2, states));
    MUST_ALL(environments, sadmm_environments_step(environments, 20));
    expect_same(state + 2 * n, later, n, "kept", 2, 20);
    /* A world that is made of an environment goes on as it does. */
    size_t size;
    MUST_ALL(environments, sadmm_environments_save(environments, 2, NULL, 0, &size));
    void *bytes = malloc(size);
    MUST_ALL(environments, sadmm_environments_save(environments, 2, bytes, size, &size));
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = create_world(&def);
    MUST(world, sadmm_world_restore(world, bytes, size));
    ck_assert_int_eq(sadmm_world_settings(world).threads, 1);
    step_world(world, 10);
    MUST_ALL(environments, sadmm_environments_step(environments, 10));
    double *own = read_array(world, SADMM_ARRAY_BODY_STATE);
    expect_same(state + 2 * n, own, n, "saved", 2, 10);
    free(own);
    free(bytes);
    free(later);
    sadmm_world_destroy(world);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

/* ---- one that goes wrong ----------------------------------------------------------------------------------------- */

/* One gets a force that is no number, one bodies that overlap, one a velocity that overflows: the others have the bits
 * that they have without. */
START_TEST(what_goes_wrong_stays_alone)
{
    enum { MANY = 8 };
    struct machine m = build_machine();
    sadmm_environments *good = replicate(m.world, MANY), *bad = replicate(m.world, MANY);
    double *states[2] = {array_of(good, SADMM_ARRAY_BODY_STATE), array_of(bad, SADMM_ARRAY_BODY_STATE)};
    double *wrench = array_of(bad, SADMM_ARRAY_BODY_WRENCH);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_BODY_STATE),
                 wrenches = numbers_of(m.world, SADMM_ARRAY_BODY_WRENCH);
    for (int step = 0; step < 30; ++step) {
        if (step == 5) {
            wrench[3 * wrenches + 6 * 2 + 1] = NAN;
            double *state = malloc(n * sizeof *state);
            const int32_t overlaps = 1, flies = 6;
            memcpy(state, states[1] + n, n * sizeof *state);
            memcpy(state + 13 * 7, state + 13 * 6, 3 * sizeof *state);
            MUST_ALL(bad, sadmm_environments_set(bad, SADMM_ARRAY_BODY_STATE, &overlaps, 1, state));
            memcpy(state, states[1] + 6 * n, n * sizeof *state);
            state[13 * 7 + 9] = 1e308;
            MUST_ALL(bad, sadmm_environments_set(bad, SADMM_ARRAY_BODY_STATE, &flies, 1, state));
            free(state);
        }
        MUST_ALL(good, sadmm_environments_step(good, 1));
        MUST_ALL(bad, sadmm_environments_step(bad, 1));
        for (int32_t e = 0; e < MANY; ++e)
            if (step < 5 || (e != 1 && e != 3 && e != 6))
                expect_same(states[1] + n * (size_t)e, states[0] + n * (size_t)e, n, "alone", e, step);
    }
    const uint8_t *marked = sadmm_environments_marked(bad);
    for (int32_t e = 0; e < MANY; ++e) ck_assert_int_eq(marked[e], e == 3 || e == 6);
    ck_assert_msg(strstr(sadmm_environments_mark(bad, 3), "body_wrench") != NULL, "\"%s\"",
                  sadmm_environments_mark(bad, 3));
    ck_assert_msg(strstr(sadmm_environments_mark(bad, 6), "not finite") != NULL, "\"%s\"",
                  sadmm_environments_mark(bad, 6));
    int32_t kept;
    REFUSED(bad, "marked", sadmm_environments_keep(bad, 3, &kept));
    wrench[3 * wrenches + 6 * 2 + 1] = 0;
    const int32_t both[] = {3, 6};
    MUST_ALL(bad, sadmm_environments_reset(bad, both, 2, NULL));
    ck_assert_int_eq(marked[3] + marked[6], 0);
    MUST_ALL(good, sadmm_environments_reset(good, NULL, 0, NULL));
    MUST_ALL(good, sadmm_environments_step(good, 10));
    MUST_ALL(bad, sadmm_environments_step(bad, 10));
    expect_same(states[1] + 3 * n, states[0] + 3 * n, n, "again", 3, 10);
    sadmm_environments_destroy(good);
    sadmm_environments_destroy(bad);
    sadmm_world_destroy(m.world);
}
END_TEST

/* ---- calls ------------------------------------------------------------------------------------------------------- */

START_TEST(single_precision_arrays_are_rounded)
{
    struct machine m = build_machine();
    sadmm_environments *environments = replicate(m.world, 2);
    sadmm_environments_array single, input;
    const double *state = array_of(environments, SADMM_ARRAY_BODY_STATE);
    MUST_ALL(environments, sadmm_environments_bind(environments, SADMM_ARRAY_BODY_STATE, SADMM_F32, &single));
    MUST_ALL(environments, sadmm_environments_bind(environments, SADMM_ARRAY_JOINT_TARGET_POSITION, SADMM_F32, &input));
    ck_assert_int_eq(single.environments, 2);
    ck_assert_int_eq(single.rows, sadmm_world_body_count(m.world));
    ck_assert_int_eq(single.columns, 13);
    ((float *)input.values)[6 * input.rows + 5] = 0.3F; /* of environment 1 */
    MUST_ALL(environments, sadmm_environments_step(environments, 20));
    for (size_t k = 0; k < 2 * numbers_of(m.world, SADMM_ARRAY_BODY_STATE); ++k)
        ck_assert(((const float *)single.values)[k] == (float)state[k]);
    double targets[2 * 3 * 6];
    MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_JOINT_TARGET_POSITION, NULL, 0, targets));
    ck_assert(targets[5] == 0 && targets[18 + 5] == (double)0.3F);
    ck_assert(memcmp(state, state + numbers_of(m.world, SADMM_ARRAY_BODY_STATE),
                     numbers_of(m.world, SADMM_ARRAY_BODY_STATE) * sizeof *state) != 0);
    sadmm_environments_array again;
    REFUSED(environments, "precision",
            sadmm_environments_bind(environments, SADMM_ARRAY_JOINT_TARGET_POSITION, SADMM_F64, &again));
    MUST_ALL(environments, sadmm_environments_bind(environments, SADMM_ARRAY_BODY_STATE, SADMM_F32, &again));
    ck_assert_ptr_eq(again.values, single.values);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

/* Contacts and rays of each are those of a world of its own; a reset empties the list. */
START_TEST(contacts_and_rays_are_an_environments_own)
{
    struct machine m = build_machine();
    sadmm_environments *environments = replicate(m.world, FEW);
    sadmm_world *worlds[FEW];
    sadmm_ray rays[FEW * 4];
    sadmm_ray_hit hits[FEW * 4], own[4];
    double *wrench = array_of(environments, SADMM_ARRAY_BODY_WRENCH);
    int points = 0;
    for (int32_t e = 0; e < FEW; ++e) {
        double *of = wrench + numbers_of(m.world, SADMM_ARRAY_BODY_WRENCH) * (size_t)e;
        worlds[e] = alone(m.world);
        vary(m.world, SADMM_ARRAY_BODY_WRENCH, e, 0, of);
        write_array(worlds[e], SADMM_ARRAY_BODY_WRENCH, of);
        for (int k = 0; k < 4; ++k) rays[4 * e + k] = (sadmm_ray){{0.3 * k - 0.5, 0.01 * e, 3}, {0, 0, -1}, INFINITY};
    }
    MUST_ALL(environments, sadmm_environments_record_contacts(environments, true));
    for (int step = 0; step < 40; ++step) {
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
        MUST_ALL(environments, sadmm_environments_cast_rays(environments, NULL, 0, 4, rays, NULL, hits));
        for (int32_t e = 0; e < FEW; ++e) {
            const sadmm_contact *contacts;
            int32_t count;
            step_world(worlds[e], 1);
            MUST_ALL(environments, sadmm_environments_contacts(environments, e, &contacts, &count));
            ck_assert_int_eq(count, sadmm_world_contact_count(worlds[e]));
            sadmm_contact *mine = calloc((size_t)count + 1, sizeof *mine);
            MUST(worlds[e], sadmm_world_contacts(worlds[e], 0, count, mine));
            if (count > 0) ck_assert_mem_eq(contacts, mine, (size_t)count * sizeof *mine);
            free(mine);
            points += count;
            MUST(worlds[e], sadmm_world_cast_rays(worlds[e], 4, rays + 4 * e, NULL, own));
            ck_assert_mem_eq(own, hits + 4 * e, sizeof own);
        }
    }
    ck_assert_int_gt(points, 100);
    const sadmm_contact *contacts;
    const int32_t two = 2;
    int32_t count;
    MUST_ALL(environments, sadmm_environments_reset(environments, &two, 1, NULL));
    MUST_ALL(environments, sadmm_environments_contacts(environments, 2, &contacts, &count));
    ck_assert_int_eq(count, 0);
    MUST_ALL(environments, sadmm_environments_contacts(environments, 1, &contacts, &count));
    ck_assert_int_gt(count, 0);
    rays[4 * 3].direction[2] = 0; /* the whole of it is */
    REFUSED(environments, "environment 3: rays[0].direction",
            sadmm_environments_cast_rays(environments, NULL, 0, 4, rays, NULL, hits));
    for (int32_t e = 0; e < FEW; ++e) sadmm_world_destroy(worlds[e]);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

static void *save_of(sadmm_environments *environments, int32_t environment, size_t *size)
{
    MUST_ALL(environments, sadmm_environments_save(environments, environment, NULL, 0, size));
    void *bytes = malloc(*size);
    ck_assert_ptr_nonnull(bytes);
    MUST_ALL(environments, sadmm_environments_save(environments, environment, bytes, *size, size));
    return bytes;
}

/* Boxes slide and balls roll over a heightfield and over two flush slabs. */
static sadmm_world *build_ground(int threads)
{
    enum { SIDE = 60 };
    double heights[SIDE * SIDE];
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_heightfield_def field = sadmm_heightfield_def_default();
    sadmm_mesh *mesh;
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = threads;
    sadmm_world *world = create_world(&def);
    for (int r = 0; r < SIDE; ++r)
        for (int c = 0; c < SIDE; ++c) heights[SIDE * r + c] = 0.05 * sin(0.7 * r) * sin(0.9 * c + 0.01 * r * r);
    field.heights = heights, field.rows = field.columns = SIDE;
    field.spacing[0] = field.spacing[1] = 0.1;
    ck_assert_int_eq(sadmm_heightfield_create(&field, &mesh), SADMM_OK);
    for (int k = 0; k < 3; ++k) {
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id id;
        body.type = SADMM_BODY_STATIC;
        body.environment = -1;
        if (k > 0) body.position[0] = k == 1 ? 9 : 11, body.position[2] = -0.1;
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = k > 0 ? SADMM_SHAPE_BOX : SADMM_SHAPE_MESH;
        if (k == 0) shape.mesh = mesh;
        else shape.size[0] = shape.size[1] = 1, shape.size[2] = 0.1;
        MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    }
    sadmm_mesh_destroy(mesh);
    for (int k = 0; k < 6; ++k) {
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id id;
        body.mass = 1;
        for (int j = 0; j < 3; ++j) body.inertia[j] = 0.004 + 0.001 * j;
        body.position[0] = k < 4 ? 0.3 * k - 1 : 9.6, body.position[1] = k < 4 ? 0.2 : 0.5 * k - 2.3;
        body.position[2] = k < 4 ? 0.25 : 0.1;
        body.linear_velocity[0] = 2;
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = k % 2 ? SADMM_SHAPE_BOX : SADMM_SHAPE_SPHERE;
        for (int j = 0; j < 3; ++j) shape.size[j] = 0.1;
        MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    }
    return world;
}

/* Each begins elsewhere on the heightfield, and between its slabs there is another gap: the steps of a world that has
 * it so, whoever had the worker before. */
START_TEST(ground_is_an_environments_own)
{
    enum { MANY = 7 };
    const int threads = _i ? 2 : 1;
    sadmm_test_force_threads(threads > 1);
    sadmm_world *origin = build_ground(threads), *worlds[MANY];
    sadmm_environments *environments = replicate(origin, MANY);
    const size_t n = numbers_of(origin, SADMM_ARRAY_SHAPE_FRAME), bodies = numbers_of(origin, SADMM_ARRAY_BODY_STATE);
    double *frames = array_of(environments, SADMM_ARRAY_SHAPE_FRAME), heights[MANY];
    const double *state = array_of(environments, SADMM_ARRAY_BODY_STATE);
    sadmm_ray rays[MANY];
    sadmm_ray_hit hits[MANY], own;
    for (int32_t e = 0; e < MANY; ++e) {
        double *frame = frames + n * (size_t)e;
        frame[0] = -0.17 * e, frame[1] = -0.23 * e;
        frame[14] = 0.02 * (e % 3); /* of the second slab, along x */
        worlds[e] = alone(origin);
        write_array(worlds[e], SADMM_ARRAY_SHAPE_FRAME, frame);
        rays[e] = (sadmm_ray){{0.33, 0.12, 3}, {0, 0, -1}, INFINITY};
    }
    MUST_ALL(environments, sadmm_environments_cast_rays(environments, NULL, 0, 1, rays, NULL, hits));
    for (int32_t e = 0; e < MANY; ++e) {
        MUST(worlds[e], sadmm_world_cast_rays(worlds[e], 1, rays, NULL, &own));
        ck_assert_mem_eq(&own, &hits[e], sizeof own);
        heights[e] = hits[e].point[2];
        for (int32_t other = 0; other < e; ++other) ck_assert(heights[e] != heights[other]);
    }
    for (int step = 0; step < 60; ++step) {
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
        for (int32_t e = 0; e < MANY; ++e) {
            step_world(worlds[e], 1);
            double *mine = read_array(worlds[e], SADMM_ARRAY_BODY_STATE);
            expect_same(state + bodies * (size_t)e, mine, bodies, "ground", e, step);
            free(mine);
        }
    }
    for (int32_t e = 1; e < MANY; ++e) {
        ck_assert_int_gt(world_report(worlds[e]).contacts, 4);
        ck_assert(memcmp(state, state + bodies * (size_t)e, bodies * sizeof *state) != 0);
    }
    for (int32_t e = 0; e < MANY; ++e) sadmm_world_destroy(worlds[e]);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(origin);
    sadmm_test_force_threads(false);
}
END_TEST

/* Resets keep sizes, and begin again as a world does that is given them at its start; one that is refused is marked and
 * has the template's when it is looked at. */
START_TEST(sizes_outlast_resets)
{
    struct machine m = build_machine();
    step_world(m.world, 30);
    sadmm_environments *environments = replicate(m.world, 3);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_SHAPE_SIZE), bodies = numbers_of(m.world, SADMM_ARRAY_BODY_STATE);
    double *sizes = array_of(environments, SADMM_ARRAY_SHAPE_SIZE), grown[64];
    const double *state = array_of(environments, SADMM_ARRAY_BODY_STATE);
    ck_assert_uint_le(n, 64);
    for (size_t k = 0; k < n; ++k) grown[k] = sizes[n + k] *= k < 3 ? 1 : 1.05;
    sadmm_world *world = alone(m.world);
    write_array(world, SADMM_ARRAY_SHAPE_SIZE, grown);
    for (int episode = 0; episode < 3; ++episode) {
        if (episode > 0) MUST_ALL(environments, sadmm_environments_reset(environments, NULL, 0, NULL));
        MUST_ALL(environments, sadmm_environments_step(environments, 25));
        if (episode == 0) step_world(world, 25);
        double *own = read_array(world, SADMM_ARRAY_BODY_STATE);
        expect_same(state + bodies, own, bodies, "grown", 1, episode);
        expect_same(state, state + 2 * bodies, bodies, "others", 2, episode);
        ck_assert(memcmp(state, state + bodies, bodies * sizeof *state) != 0);
        free(own);
    }
    sizes[n + 4] = -1;
    MUST_ALL(environments, sadmm_environments_step(environments, 1));
    ck_assert_msg(strstr(sadmm_environments_mark(environments, 1), "shape_size: values, row 1: size[1] = -1") != NULL,
                  "\"%s\"", sadmm_environments_mark(environments, 1));
    size_t size;
    void *bytes = save_of(environments, 1, &size);
    MUST(world, sadmm_world_restore(world, bytes, size));
    double *own = read_array(world, SADMM_ARRAY_SHAPE_SIZE), *first = read_array(m.world, SADMM_ARRAY_SHAPE_SIZE);
    ck_assert_mem_eq(own, first, n * sizeof *own);
    free(own), free(first), free(bytes);
    sadmm_world_destroy(world);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

/* Frames of joints: steps, positions of joints as they are read and set, and resets go by each one's own, whichever the
 * worker had before. */
START_TEST(frames_of_joints_are_an_environments_own)
{
    enum { MANY = 6, STEPS = 40 };
    struct machine m = machine_on(_i ? 2 : 1);
    sadmm_environments *environments = replicate(m.world, MANY);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_JOINT_FRAME), bodies = numbers_of(m.world, SADMM_ARRAY_BODY_STATE),
                 joints = numbers_of(m.world, SADMM_ARRAY_JOINT_POSITION);
    ck_assert(sadmm_environments_is_input(SADMM_ARRAY_JOINT_FRAME));
    double *frames = array_of(environments, SADMM_ARRAY_JOINT_FRAME);
    const double *state = array_of(environments, SADMM_ARRAY_BODY_STATE),
                 *position = array_of(environments, SADMM_ARRAY_JOINT_POSITION);
    sadmm_joint_id id;
    sadmm_joint_def def;
    MUST(m.world, sadmm_world_joint_at(m.world, 1, &id));
    MUST(m.world, sadmm_world_joint_def(m.world, id, &def));
    ck_assert_mem_eq(frames + 14, def.position_a, sizeof def.position_a);
    ck_assert_mem_eq(frames + 14 + 10, def.orientation_b, sizeof def.orientation_b);
    sadmm_world *worlds[MANY];
    double *turned[MANY];
    for (int32_t e = 0; e < MANY; ++e) {
        double *frame = frames + n * (size_t)e, shift = 0.004 * e;
        for (size_t k = 0; k < n; k += 14) {
            frame[k + 1] += shift, frame[k + 9] -= shift; /* of a along y, of b along z */
            if (e > 0) frame[k + 10] = 0.96, frame[k + 13] = 0.28; /* b's turned about z */
        }
        worlds[e] = alone(m.world);
        write_array(worlds[e], SADMM_ARRAY_JOINT_FRAME, frame);
    }
    MUST_ALL(environments, sadmm_environments_step(environments, 1));
    for (int32_t e = 0; e < MANY; ++e) { /* a hinge is turned */
        step_world(worlds[e], 1);
        turned[e] = read_array(worlds[e], SADMM_ARRAY_JOINT_POSITION);
        turned[e][5] += 0.1;
        write_array(worlds[e], SADMM_ARRAY_JOINT_POSITION, turned[e]);
        MUST_ALL(environments, sadmm_environments_set(environments, SADMM_ARRAY_JOINT_POSITION, &e, 1, turned[e]));
        free(turned[e]);
    }
    for (int step = 0; step < STEPS; ++step) {
        for (int32_t e = 0; e < MANY; ++e) {
            double *own = read_array(worlds[e], SADMM_ARRAY_BODY_STATE),
                   *turns = read_array(worlds[e], SADMM_ARRAY_JOINT_POSITION), *read = calloc(joints, sizeof *read);
            expect_same(state + bodies * (size_t)e, own, bodies, "frames", e, step);
            expect_same(position + joints * (size_t)e, turns, joints, "positions", e, step);
            MUST_ALL(environments,
                     sadmm_environments_get(environments, SADMM_ARRAY_JOINT_POSITION, &e, 1, read));
            expect_same(read, turns, joints, "positions as read", e, step);
            free(own), free(turns), free(read);
            step_world(worlds[e], 1);
        }
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
    }
    ck_assert(memcmp(state, state + bodies * (MANY - 1), bodies * sizeof *state) != 0);
    MUST_ALL(environments, sadmm_environments_reset(environments, NULL, 0, NULL));
    for (int32_t e = 0; e < MANY; ++e) {
        sadmm_world *fresh = alone(m.world);
        write_array(fresh, SADMM_ARRAY_JOINT_FRAME, frames + n * (size_t)e);
        double *turns = read_array(fresh, SADMM_ARRAY_JOINT_POSITION);
        expect_same(position + joints * (size_t)e, turns, joints, "positions after a reset", e, 0);
        free(turns);
        sadmm_world_destroy(fresh);
    }
    const int32_t last = MANY - 1;
    double *bad = calloc(n, sizeof *bad);
    memcpy(bad, frames, n * sizeof *bad);
    bad[14 + 3] = 2;
    ck_assert_int_eq(sadmm_environments_set(environments, SADMM_ARRAY_JOINT_FRAME, &last, 1, bad),
                     SADMM_ERROR_INVALID_ARGUMENT);
    const char *message = sadmm_environments_message(environments);
    ck_assert_msg(strstr(message, "row 1: orientation_a = (2, 0, 0, 0)") != NULL, "\"%s\"", message);
    frames[n * (size_t)last + 7] = 2e9;
    MUST_ALL(environments, sadmm_environments_step(environments, 1));
    message = sadmm_environments_mark(environments, last);
    ck_assert_msg(strstr(message, "joint_frame: values, row 0: position_b[0] = 2e+09") != NULL, "\"%s\"", message);
    ck_assert_str_eq(sadmm_environments_mark(environments, 0), "");
    free(bad);
    for (int32_t e = 0; e < MANY; ++e) sadmm_world_destroy(worlds[e]);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
    sadmm_test_force_threads(false);
}
END_TEST

/* Limits of each, which no other one's bounds fit, whoever was stepped before by the same worker. */
START_TEST(limits_are_an_environments_own)
{
    enum { MANY = 32 };
    struct machine m = build_machine();
    sadmm_joint_id hinge;
    sadmm_joint_def def;
    MUST(m.world, sadmm_world_joint_at(m.world, 0, &hinge));
    MUST(m.world, sadmm_world_joint_def(m.world, hinge, &def));
    def.coordinates[5].limited = true;
    def.coordinates[5].lower = -1, def.coordinates[5].upper = 1;
    MUST(m.world, sadmm_world_set_joint_coordinate(m.world, hinge, 5, &def.coordinates[5]));
    sadmm_environments *environments = replicate(m.world, MANY);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_JOINT_LOWER);
    double *lower = array_of(environments, SADMM_ARRAY_JOINT_LOWER), *ends = calloc(MANY * n, sizeof *ends);
    memcpy(ends, lower, MANY * n * sizeof *ends);
    for (int e = 0; e < MANY; ++e) ends[n * (size_t)e + 5] = e % 2 ? 0.5 : -3;
    const int32_t one = 1;
    /* Against the template's upper ones, while nothing else is there. */
    MUST_ALL(environments, sadmm_environments_set(environments, SADMM_ARRAY_JOINT_LOWER, NULL, 0, ends));
    double *upper = array_of(environments, SADMM_ARRAY_JOINT_UPPER);
    for (int e = 0; e < MANY; ++e) upper[n * (size_t)e + 5] = e % 2 ? 3 : -0.5;
    for (int step = 0; step < 3; ++step) {
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
        for (int e = 0; e < MANY; ++e) ck_assert_str_eq(sadmm_environments_mark(environments, e), "");
    }
    ends[5] = 2; /* within its own ones, and beyond those of the one before it */
    MUST_ALL(environments, sadmm_environments_set(environments, SADMM_ARRAY_JOINT_LOWER, &one, 1, ends));
    ends[5] = 4;
    REFUSED(environments, "environment 1: joint_lower",
            sadmm_environments_set(environments, SADMM_ARRAY_JOINT_LOWER, &one, 1, ends));
    ck_assert(lower[n + 5] == 2);
    free(ends);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

/* A worker that has made no step reads what another one has stepped; without wrenches they are 0. */
START_TEST(any_worker_reads_any_environment)
{
    enum { MANY = 64 };
    struct machine m = build_machine();
    sadmm_settings settings = sadmm_world_settings(m.world);
    settings.threads = 2;
    MUST(m.world, sadmm_world_set_settings(m.world, &settings));
    sadmm_test_force_threads(true);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_BODY_CONTACT_WRENCH);
    double *wrench = calloc(MANY * n, sizeof *wrench), largest = 0;
    for (int k = 0; k < 5; ++k) {
        sadmm_environments *environments = replicate(m.world, MANY);
        sadmm_test_force_threads(false); /* the first one alone */
        settings.threads = 1;
        MUST_ALL(environments, sadmm_environments_set_settings(environments, &settings));
        MUST_ALL(environments, sadmm_environments_step(environments, 40));
        settings.threads = 2;
        MUST_ALL(environments, sadmm_environments_set_settings(environments, &settings));
        sadmm_test_force_threads(true);
        MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_BODY_CONTACT_WRENCH, NULL, 0, wrench));
        for (size_t i = 0; i < n; ++i) largest = fmax(largest, fabs(wrench[i]));
        for (int e = 1; e < MANY; ++e) expect_same(wrench, wrench + n * (size_t)e, n, "wrench", e, 40);
        const double *bound = array_of(environments, SADMM_ARRAY_BODY_CONTACT_WRENCH);
        settings.recover_wrenches = false;
        MUST_ALL(environments, sadmm_environments_set_settings(environments, &settings));
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
        for (size_t i = 0; i < MANY * n; ++i) ck_assert(bound[i] == 0);
        settings.recover_wrenches = true;
        sadmm_environments_destroy(environments);
    }
    ck_assert_double_gt(largest, 1);
    sadmm_test_force_threads(false);
    free(wrench);
    sadmm_world_destroy(m.world);
}
END_TEST

/* A save says nothing of other environments, and there is one of an environment that is marked. Settings are those of
 * all, whatever gravity the last one had. */
START_TEST(saves_and_settings_are_of_one_and_of_all)
{
    struct machine m = build_machine();
    size_t sizes[2];
    void *bytes[2];
    for (int k = 0; k < 2; ++k) {
        sadmm_environments *environments = replicate(m.world, 4);
        double *wrench = array_of(environments, SADMM_ARRAY_BODY_WRENCH),
               *gravity = array_of(environments, SADMM_ARRAY_GRAVITY);
        const size_t n = numbers_of(m.world, SADMM_ARRAY_BODY_WRENCH);
        for (int e = 0; e < 3; ++e) wrench[n * (size_t)e + 6] = 3 * k + e, gravity[3 * e + 2] = -e - k;
        MUST_ALL(environments, sadmm_environments_step(environments, 20));
        bytes[k] = save_of(environments, 3, &sizes[k]);
        ck_assert(sadmm_environments_settings(environments).gravity[2] == sadmm_settings_default().gravity[2]);
        wrench[3 * n + 6] = NAN;
        MUST_ALL(environments, sadmm_environments_step(environments, 1));
        ck_assert_int_eq(sadmm_environments_marked(environments)[3], 1);
        size_t size;
        free(save_of(environments, 3, &size));
        sadmm_environments_destroy(environments);
    }
    ck_assert_uint_eq(sizes[0], sizes[1]);
    ck_assert_mem_eq(bytes[0], bytes[1], sizes[0]);
    free(bytes[0]), free(bytes[1]);
    sadmm_world_destroy(m.world);
}
END_TEST

/* Moments a, b and a + b, the least mass and the least size are not within their ranges once they are rounded to single
 * precision. */
START_TEST(single_precision_takes_nothing_away)
{
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = create_world(&def);
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_environments_array inertia, sizes, frames;
    body.mass = 1e-9;
    body.inertia[0] = 0.1e-9, body.inertia[1] = 0.2e-9, body.inertia[2] = 0.1e-9 + 0.2e-9;
    sadmm_body_id id;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.size[0] = 1e-6; /* of a sphere; the nearest float is less */
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    sadmm_environments *environments = replicate(world, 3);
    MUST_ALL(environments, sadmm_environments_bind(environments, SADMM_ARRAY_SHAPE_SIZE, SADMM_F32, &sizes));
    MUST_ALL(environments, sadmm_environments_bind(environments, SADMM_ARRAY_SHAPE_FRAME, SADMM_F32, &frames));
    MUST_ALL(environments, sadmm_environments_bind(environments, SADMM_ARRAY_BODY_INERTIA, SADMM_F32, &inertia));
    MUST_ALL(environments, sadmm_environments_step(environments, 2));
    for (int e = 0; e < 3; ++e) ck_assert_str_eq(sadmm_environments_mark(environments, e), "");
    ((float *)inertia.values)[2] *= 1.01F; /* what is wrong by more is */
    ((float *)inertia.values)[3] *= 1.05F;
    MUST_ALL(environments, sadmm_environments_step(environments, 1));
    ck_assert_int_eq(sadmm_environments_marked(environments)[0], 1);
    ck_assert_int_eq(sadmm_environments_marked(environments)[1], 0);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(what_is_refused_changes_nothing)
{
    struct machine m = build_machine();
    sadmm_environments *environments = replicate(m.world, 3), *none = environments;
    const size_t n = numbers_of(m.world, SADMM_ARRAY_JOINT_TARGET_POSITION),
                 bodies = numbers_of(m.world, SADMM_ARRAY_BODY_STATE);
    double *targets = calloc(3 * n, sizeof *targets), *now = calloc(3 * bodies, sizeof *now),
           *before = calloc(3 * bodies, sizeof *before);
    const int32_t twice[] = {1, 1}, far[] = {3}, ways[] = {1};
    ck_assert_int_eq(sadmm_world_replicate(m.world, 0, &none), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_null(none);
    ck_assert(strstr(sadmm_world_message(m.world), "count = 0: must be in [1, 1048576]") != NULL);
    REFUSED(environments, "steps = 0: must be >= 1", sadmm_environments_step(environments, 0));
    REFUSED(environments, "which[1] = 1: is there twice", sadmm_environments_reset(environments, twice, 2, NULL));
    REFUSED(environments, "which[0] = 3: must be in [0, 3)", sadmm_environments_reset(environments, far, 1, NULL));
    REFUSED(environments, "states[0] = 1: must be in [0, 1)", sadmm_environments_reset(environments, ways, 1, ways));
    int32_t kept;
    const size_t memory = sadmm_environments_memory(environments);
    MUST_ALL(environments, sadmm_environments_keep(environments, 1, &kept));
    ck_assert_uint_gt(sadmm_environments_memory(environments), memory);
    MUST_ALL(environments, sadmm_environments_forget(environments, kept));
    ck_assert_uint_eq(sadmm_environments_memory(environments), memory);
    REFUSED(environments, "states[0] = 1: was forgotten", sadmm_environments_reset(environments, ways, 1, ways));
    REFUSED(environments, "state = 1: was forgotten", sadmm_environments_forget(environments, kept));
    REFUSED(environments, "state = 0: must be one that was kept", sadmm_environments_forget(environments, 0));
    REFUSED(environments, "count = 4: must be in [0, 3]", sadmm_environments_reset(environments, far, 4, NULL));
    REFUSED(environments, "array = joint_wrench: must be one that can be set",
            sadmm_environments_set(environments, SADMM_ARRAY_JOINT_WRENCH, NULL, 0, targets));
    REFUSED(environments, "array = 99", sadmm_environments_get(environments, (sadmm_array)99, NULL, 0, targets));
    /* The last of them is refused, and none is set. */
    targets[5] = 0.7, targets[2 * n + 5] = NAN;
    REFUSED(environments, "environment 2: joint_target_position: values, row 0",
            sadmm_environments_set(environments, SADMM_ARRAY_JOINT_TARGET_POSITION, NULL, 0, targets));
    MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_JOINT_TARGET_POSITION, NULL, 0, targets));
    for (size_t k = 0; k < 3 * n; ++k) ck_assert(targets[k] == 0);
    MUST_ALL(environments, sadmm_environments_step(environments, 3));
    MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, before));
    expect_same(before, before + bodies, bodies, "as before", 1, 3);
    memcpy(now, before, 3 * bodies * sizeof *now);
    now[bodies + 13 + 2] += 0.1, now[2 * bodies + 13 + 3] = 7; /* no unit quaternion */
    REFUSED(environments, "environment 2: body_state: values, row 1",
            sadmm_environments_set(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, now));
    MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, now));
    expect_same(now, before, 3 * bodies, "states", 0, 3);
    sadmm_settings settings = sadmm_environments_settings(environments);
    settings.dt = -1;
    REFUSED(environments, "settings.dt", sadmm_environments_set_settings(environments, &settings));
    settings.dt = 0.002;
    MUST_ALL(environments, sadmm_environments_set_settings(environments, &settings));
    ck_assert(sadmm_environments_settings(environments).dt == 0.002);
    ck_assert_int_eq(sadmm_environments_count(NULL), 0);
    ck_assert_int_eq((int)sadmm_environments_memory(NULL), 0);
    ck_assert_ptr_null(sadmm_environments_marked(NULL));
    ck_assert_str_eq(sadmm_environments_mark(environments, 7), "");
    ck_assert_str_eq(sadmm_environments_message(NULL), "");
    sadmm_environments_destroy(NULL);
    free(targets), free(now), free(before);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

/* Calls that need memory, on what the last ones left. */
static sadmm_status ask(sadmm_environments *environments, int call, double *numbers, void *bytes, size_t size)
{
    const sadmm_ray ray = {{0, 0, 3}, {0, 0, -1}, INFINITY};
    sadmm_environments_array out;
    sadmm_ray_hit hit;
    int32_t kept;
    const int32_t one = 1;
    switch (call) {
    case 0: return sadmm_environments_bind(environments, SADMM_ARRAY_JOINT_WRENCH, SADMM_F32, &out);
    case 1: return sadmm_environments_set(environments, SADMM_ARRAY_BODY_WRENCH, &one, 1, numbers);
    case 2: return sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, &one, 1, numbers);
    case 3: return sadmm_environments_set(environments, SADMM_ARRAY_BODY_STATE, &one, 1, numbers);
    case 4: return sadmm_environments_record_contacts(environments, true);
    case 5: return sadmm_environments_keep(environments, 0, &kept);
    case 6: return sadmm_environments_save(environments, 0, bytes, size, &size);
    case 7: return sadmm_environments_cast_rays(environments, &one, 1, 1, &ray, NULL, &hit);
    case 8: return sadmm_environments_get(environments, SADMM_ARRAY_JOINT_POSITION, &one, 1, numbers);
    case 9: return sadmm_environments_set(environments, SADMM_ARRAY_JOINT_POSITION, &one, 1, numbers);
    default: return sadmm_environments_reset(environments, NULL, 0, NULL);
    }
}

/* Each of them, at each of its allocations: it fails and says so, or it is done; in the end all is as it was. */
START_TEST(calls_survive_a_lack_of_memory)
{
    enum { CALLS = 11 };
    struct machine m = build_machine();
    sadmm_environments *environments = replicate(m.world, 2);
    const size_t n = numbers_of(m.world, SADMM_ARRAY_BODY_STATE);
    double *numbers = calloc(n + 6 * 64, sizeof *numbers), *states = calloc(4 * n, sizeof *states);
    size_t size;
    int failures = 0;
    MUST_ALL(environments, sadmm_environments_step(environments, 30));
    MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, states));
    MUST_ALL(environments, sadmm_environments_save(environments, 0, NULL, 0, &size));
    void *bytes = malloc(size);
    for (int call = 0; call < CALLS - 1; ++call) {
        sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
        for (long allowed = 0; status != SADMM_OK; ++allowed) {
            sadmm_test_fail_allocations_after(allowed);
            status = ask(environments, call, numbers, bytes, size);
            sadmm_test_fail_allocations_after(-1);
            if (status == SADMM_OK) break;
            ck_assert_msg(status == SADMM_ERROR_OUT_OF_MEMORY, "call %d: %s", call,
                          sadmm_environments_message(environments));
            ++failures;
        }
        if (call == 1) memset(numbers, 0, n * sizeof *numbers);
    }
    ck_assert_int_gt(failures, 5);
    MUST_ALL(environments, sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, NULL, 0, states + 2 * n));
    expect_same(states, states + 2 * n, 2 * n, "after all", 0, 30);
    MUST_ALL(environments, ask(environments, CALLS - 1, numbers, bytes, size));
    free(numbers), free(states), free(bytes);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

/* Wherever memory runs out the call says so, nothing leaks, and with memory again all is as if it had not been called,
 * or as after a call that was right. */
START_TEST(memory_may_run_out)
{
    struct machine m = build_machine();
    step_world(m.world, 5);
    int failures = 0;
    for (long allowed = 0;; ++allowed) {
        sadmm_environments *environments;
        sadmm_test_fail_allocations_after(allowed);
        const sadmm_status status = sadmm_world_replicate(m.world, 2, &environments);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) {
            sadmm_environments_destroy(environments);
            break;
        }
        ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
        ck_assert_ptr_null(environments);
        ++failures;
    }
    ck_assert_int_gt(failures, 20);
    sadmm_environments *environments = replicate(m.world, 2);
    sadmm_environments_array out;
    sadmm_status status = SADMM_ERROR_OUT_OF_MEMORY;
    for (long allowed = 0; status != SADMM_OK; ++allowed) {
        sadmm_test_fail_allocations_after(allowed);
        status = sadmm_environments_bind(environments, SADMM_ARRAY_BODY_STATE, SADMM_F64, &out);
        sadmm_test_fail_allocations_after(-1);
        if (status != SADMM_OK) ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
    }
    status = SADMM_ERROR_OUT_OF_MEMORY;
    for (long allowed = 0; status != SADMM_OK; ++allowed) {
        sadmm_test_fail_allocations_after(allowed);
        status = sadmm_environments_step(environments, 1);
        sadmm_test_fail_allocations_after(-1);
        MUST_ALL(environments, sadmm_environments_reset(environments, NULL, 0, NULL));
    }
    MUST_ALL(environments, sadmm_environments_step(environments, 10));
    step_world(m.world, 10);
    double *own = read_array(m.world, SADMM_ARRAY_BODY_STATE);
    expect_same((const double *)out.values, own, numbers_of(m.world, SADMM_ARRAY_BODY_STATE), "after all", 0, 10);
    free(own);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(m.world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("environments");
    TCase *cases = tcase_create("environments");
    tcase_add_loop_test(cases, environments_step_as_worlds_of_their_own, 0, 4 * SCENES);
    tcase_add_loop_test(cases, inputs_are_an_environments_own, 0, 2);
    tcase_add_test(cases, resets_begin_again);
    tcase_add_test(cases, kept_states_are_begun_with);
    tcase_add_test(cases, what_goes_wrong_stays_alone);
    tcase_add_test(cases, single_precision_arrays_are_rounded);
    tcase_add_test(cases, contacts_and_rays_are_an_environments_own);
    tcase_add_loop_test(cases, ground_is_an_environments_own, 0, 2);
    tcase_add_test(cases, sizes_outlast_resets);
    tcase_add_loop_test(cases, frames_of_joints_are_an_environments_own, 0, 2);
    tcase_add_test(cases, limits_are_an_environments_own);
    tcase_add_test(cases, any_worker_reads_any_environment);
    tcase_add_test(cases, saves_and_settings_are_of_one_and_of_all);
    tcase_add_test(cases, single_precision_takes_nothing_away);
    tcase_add_test(cases, what_is_refused_changes_nothing);
    tcase_add_test(cases, calls_survive_a_lack_of_memory);
    tcase_add_test(cases, memory_may_run_out);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
