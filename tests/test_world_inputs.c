/* Bad input to a world: every call names what is wrong and changes nothing, memory may run out anywhere, and a step
 * that fails leaves the world as it was. "Changes nothing" is tested by stepping on beside a world that never saw the
 * bad call: the states must stay equal bit for bit.
 * One file: the tests share that comparison and the small world it is made with.
 */
#include <stddef.h>

#include "core/base/memory.h"
#include "scene_tools.h"

/* A box on the ground with a pitched one falling onto it: contacts, warm start, an id to spare. */
struct small_world {
    sadmm_world *world;
    sadmm_body_id ground, low, high;
    sadmm_shape_id ground_shape, low_shape, high_shape;
};

static sadmm_body_def box_body(double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    const double half[3] = { 0.1, 0.1, 0.1 };
    def.mass = 1;
    sadmm_box_inertia(def.mass, half, def.inertia);
    def.position[2] = z;
    def.name = "box";
    return def;
}

static sadmm_shape_def box_shape(void)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    def.type = SADMM_SHAPE_BOX;
    for (int i = 0; i < 3; ++i) def.size[i] = 0.1;
    return def;
}

static sadmm_world_def small_def(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.iterations = 50;
    def.settings.threads = 1; /* failures are injected into the calling thread */
    return def;
}

static sadmm_status fill(struct small_world *w)
{
    sadmm_body_def ground = sadmm_body_def_default(), low = box_body(0.1), high = box_body(0.305);
    sadmm_shape_def plane = sadmm_shape_def_default(), box = box_shape();
    sadmm_status status;

    ground.type = SADMM_BODY_STATIC;
    ground.environment = -1;
    plane.type = SADMM_SHAPE_PLANE;
    high.position[0] = 0.03;
    high.orientation[0] = cos(0.01);
    high.orientation[2] = sin(0.01);
    status = sadmm_world_add_body(w->world, &ground, &w->ground);
    if (status == SADMM_OK) status = sadmm_world_add_shape(w->world, w->ground, &plane, &w->ground_shape);
    if (status == SADMM_OK) status = sadmm_world_add_body(w->world, &low, &w->low);
    if (status == SADMM_OK) status = sadmm_world_add_shape(w->world, w->low, &box, &w->low_shape);
    if (status == SADMM_OK) status = sadmm_world_add_body(w->world, &high, &w->high);
    if (status == SADMM_OK) status = sadmm_world_add_shape(w->world, w->high, &box, &w->high_shape);
    return status;
}

static struct small_world make_small(void)
{
    struct small_world w;
    sadmm_world_def def = small_def();
    w.world = create_world(&def);
    MUST(w.world, fill(&w));
    return w;
}

/* Both worlds go on for 30 steps (through the landing) and stay equal. */
static void expect_equal_future(sadmm_world *a, sadmm_world *b)
{
    for (int i = 0; i < 30; ++i) {
        step_world(a, 1);
        step_world(b, 1);
        ck_assert_uint_eq(state_hash(a), state_hash(b));
        ck_assert_int_eq(world_report(a).contacts, world_report(b).contacts);
    }
    ck_assert_int_gt(world_report(a).contacts, 0);
}

/* A refused call: the status, and a message that holds `text`. */
static void expect_refused(const sadmm_world *world, sadmm_status got, sadmm_status wanted, const char *text)
{
    const char *message = world ? sadmm_world_message(world) : sadmm_last_message();
    ck_assert_msg(got == wanted, "%s for %s (message: %s)", sadmm_status_name(got), text, message);
    ck_assert_msg(strstr(message, text), "the message names no \"%s\": %s", text, message);
    ck_assert_str_eq(message, sadmm_last_message());
}

/* ---- numbers that must be refused, by field ---- */

struct bad_number {
    const char *field; /* must be in the message */
    size_t offset;
    double values[6]; /* ends at a 0 after the first */
};

#define BODY(field, ...) { #field, offsetof(sadmm_body_def, field), { __VA_ARGS__ } }
static const struct bad_number bad_body[] = {
    BODY(mass, 0), BODY(mass, NAN, INFINITY, -INFINITY, -1, 0.99e-9), BODY(mass, 1.01e12),
    BODY(inertia[0], 0), BODY(inertia[1], NAN, INFINITY, -1, 5e-324, 0.99e-24),
    BODY(inertia[2], 1, 1e300), /* 1: more than the other two */
    BODY(position[0], NAN, INFINITY, -INFINITY, 1.01e9, -1e300), BODY(position[2], NAN),
    BODY(orientation, 0), /* all 0 */
    BODY(orientation[0], NAN, INFINITY, 1.00001, 0.99999, -2), BODY(orientation[3], 1e-2, NAN),
    BODY(gravity_scale, NAN, INFINITY, 1.01e6, -1.01e6), BODY(linear_damping, NAN, INFINITY, -1e-9, 1.01e6),
    BODY(angular_damping, NAN, INFINITY, -1e-9, 1.01e6),
    BODY(linear_velocity[1], NAN, INFINITY, 1.01e6, -1.01e6), BODY(angular_velocity[2], NAN, -INFINITY, 1.01e6),
};
#undef BODY

#define SHAPE(field, ...) { #field, offsetof(sadmm_shape_def, field), { __VA_ARGS__ } }
static const struct bad_number bad_shape[] = {
    SHAPE(size[0], 0), SHAPE(size[0], NAN, INFINITY, -0.1, 0.99e-6, 1.01e6), SHAPE(size[2], 1e300, NAN),
    SHAPE(position[1], NAN, INFINITY, 1e10), SHAPE(orientation, 0), SHAPE(orientation[1], NAN, 0.5, INFINITY),
    SHAPE(friction, NAN, INFINITY, -0.1, -1, 1.01e6), SHAPE(restitution, NAN, -0.1, 1.01),
};
#undef SHAPE

#define SETTING(field, ...) { #field, offsetof(sadmm_settings, field), { __VA_ARGS__ } }
static const struct bad_number bad_settings[] = {
    SETTING(dt, 0), SETTING(dt, NAN, INFINITY, -0.005, 0.99e-6, 1.01), SETTING(gravity[0], NAN, INFINITY, 1.01e6),
    SETTING(penalty_mass_factor, NAN, -1, 1.01e12), SETTING(penalty_offset, NAN, -1, 1.01e15),
    SETTING(penalty_ratio_limit, 0), SETTING(penalty_ratio_limit, NAN, 0.99, 1.01e6),
    SETTING(residual_tolerance, NAN, INFINITY, -1), SETTING(tolerance, NAN, INFINITY, -1),
    SETTING(correction_factor, NAN, -0.1, 1.01), SETTING(slop, NAN, -1, 1.01),
    SETTING(correction_speed, NAN, -1, 1.01e3), SETTING(restitution_threshold, NAN, INFINITY, -1),
};
#undef SETTING

#define COUNT(array) (sizeof(array) / sizeof *(array))

static void put(void *object, const struct bad_number *bad, double value)
{
    memcpy((char *)object + bad->offset, &value, sizeof value);
}

/* Number of values of an entry: the first may be 0, a later 0 ends the list. */
static int value_count(const struct bad_number *bad)
{
    int count = 1;
    while (count < 6 && bad->values[count] != 0) ++count;
    return count;
}

/* "inertia[2]" -> "inertia": which of the components is named does not matter. */
static const char *field_name(const struct bad_number *bad)
{
    static char name[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(bad->field, "["), bad->field);
    return name;
}

START_TEST(bad_bodies_are_refused)
{
    struct small_world w = make_small(), other = make_small();
    for (size_t i = 0; i < COUNT(bad_body); ++i) {
        for (int k = 0; k < value_count(&bad_body[i]); ++k) {
            sadmm_body_def def = box_body(5);
            sadmm_body_id id = { 7, 7 };
            put(&def, &bad_body[i], bad_body[i].values[k]);
            expect_refused(w.world, sadmm_world_add_body(w.world, &def, &id), SADMM_ERROR_INVALID_ARGUMENT,
                           field_name(&bad_body[i]));
            ck_assert(id.slot == 7 && id.generation == 7);
        }
    }
    sadmm_body_def def = box_body(5);
    sadmm_body_id id;
    def.type = (sadmm_body_type)7;
    expect_refused(w.world, sadmm_world_add_body(w.world, &def, &id), SADMM_ERROR_INVALID_ARGUMENT, "type");
    def = box_body(5), def.environment = -1;
    expect_refused(w.world, sadmm_world_add_body(w.world, &def, &id), SADMM_ERROR_INVALID_ARGUMENT, "environment");
    def = box_body(5), def.type = SADMM_BODY_STATIC, def.environment = -2;
    expect_refused(w.world, sadmm_world_add_body(w.world, &def, &id), SADMM_ERROR_INVALID_ARGUMENT, "environment");
    def = box_body(5), def.angular_velocity[0] = -1.01e6;
    expect_refused(w.world, sadmm_world_add_body(w.world, &def, &id), SADMM_ERROR_INVALID_ARGUMENT,
                   "def->angular_velocity[0] = -1.01e+06: must be in [-1e+06, 1e+06]");
    def = box_body(5), def.type = SADMM_BODY_STATIC, def.linear_velocity[0] = 1;
    expect_refused(w.world, sadmm_world_add_body(w.world, &def, &id), SADMM_ERROR_INVALID_ARGUMENT, "velocity");
    expect_refused(w.world, sadmm_world_add_body(w.world, NULL, &id), SADMM_ERROR_INVALID_ARGUMENT, "def");
    expect_refused(w.world, sadmm_world_add_body(w.world, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT, "id");
    ck_assert_int_eq(sadmm_world_body_count(w.world), 3);
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

/* What is just inside the limits is taken: the checks above do not refuse too much. */
START_TEST(limits_are_inclusive)
{
    struct small_world w = make_small();
    sadmm_body_def def = box_body(5);
    sadmm_body_id id;

    def.mass = 1e-9;
    MUST(w.world, sadmm_world_add_body(w.world, &def, &id));
    def.mass = 1e12;
    def.inertia[0] = 1, def.inertia[1] = 2, def.inertia[2] = 3; /* a flat body: the sum of the other two */
    def.orientation[0] = 1 + 0.9e-6;                            /* normalised on the way in */
    def.position[0] = -1e9;
    def.linear_velocity[0] = 1e6;
    MUST(w.world, sadmm_world_add_body(w.world, &def, &id));
    ck_assert_double_eq(body_state(w.world, id).orientation[0], 1.0);
    def = sadmm_body_def_default();
    def.type = SADMM_BODY_STATIC; /* needs no mass */
    MUST(w.world, sadmm_world_add_body(w.world, &def, &id));

    sadmm_settings settings = sadmm_world_settings(w.world);
    settings.dt = 1;
    settings.penalty_offset = 0;
    settings.correction_factor = settings.slop = 0;
    MUST(w.world, sadmm_world_set_settings(w.world, &settings));
    sadmm_world_destroy(w.world);
}
END_TEST

START_TEST(bad_shapes_are_refused)
{
    struct small_world w = make_small(), other = make_small();
    for (size_t i = 0; i < COUNT(bad_shape); ++i) {
        for (int k = 0; k < value_count(&bad_shape[i]); ++k) {
            sadmm_shape_def def = box_shape();
            put(&def, &bad_shape[i], bad_shape[i].values[k]);
            expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT,
                           field_name(&bad_shape[i]));
        }
    }
    sadmm_shape_def def = box_shape();
    def.type = SADMM_SHAPE_PLANE;
    expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT, "type");
    def.type = SADMM_SHAPE_TYPE_COUNT;
    expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT, "type");
    def.type = (sadmm_shape_type)-1;
    expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT, "type");
    def.type = (sadmm_shape_type)(65536 + SADMM_SHAPE_BOX); /* a box in 16 bits */
    expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT, "type");
    def.type = SADMM_SHAPE_HULL;
    expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT,
                   "def->hull = NULL: must be given");
    def.type = SADMM_SHAPE_BOX;
    def.hull = (const sadmm_hull *)&def; /* never looked behind */
    expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT,
                   "def->hull: must be NULL");
    expect_refused(w.world, sadmm_world_add_shape(w.world, w.low, NULL, NULL), SADMM_ERROR_INVALID_ARGUMENT, "def");
    ck_assert_int_eq(sadmm_world_shape_count(w.world), 3);
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

START_TEST(bad_settings_are_refused)
{
    struct small_world w = make_small(), other = make_small();
    for (size_t i = 0; i < COUNT(bad_settings); ++i) {
        for (int k = 0; k < value_count(&bad_settings[i]); ++k) {
            sadmm_world_def def = small_def();
            sadmm_world *made = w.world;
            put(&def.settings, &bad_settings[i], bad_settings[i].values[k]);
            expect_refused(w.world, sadmm_world_set_settings(w.world, &def.settings), SADMM_ERROR_INVALID_ARGUMENT,
                           field_name(&bad_settings[i]));
            expect_refused(NULL, sadmm_world_create(&def, &made), SADMM_ERROR_INVALID_ARGUMENT,
                           field_name(&bad_settings[i]));
            ck_assert_ptr_null(made);
        }
    }

    static const struct {
        const char *field;
        size_t offset;
        int value;
    } bad[] = {
        { "substeps", offsetof(sadmm_settings, substeps), 0 },
        { "substeps", offsetof(sadmm_settings, substeps), 65 },
        { "iterations", offsetof(sadmm_settings, iterations), 0 },
        { "iterations", offsetof(sadmm_settings, iterations), -5 },
        { "iterations", offsetof(sadmm_settings, iterations), 1000001 },
        { "penalty_period", offsetof(sadmm_settings, penalty_period), -1 },
        { "check_period", offsetof(sadmm_settings, check_period), 0 },
        { "check_period", offsetof(sadmm_settings, check_period), 1000001 },
        { "threads", offsetof(sadmm_settings, threads), -1 },
        { "threads", offsetof(sadmm_settings, threads), 1025 },
    };
    for (size_t i = 0; i < COUNT(bad); ++i) {
        sadmm_settings settings = small_def().settings;
        memcpy((char *)&settings + bad[i].offset, &bad[i].value, sizeof bad[i].value);
        expect_refused(w.world, sadmm_world_set_settings(w.world, &settings), SADMM_ERROR_INVALID_ARGUMENT,
                       bad[i].field);
    }
    sadmm_settings settings = small_def().settings;
    settings.penalty_mass_factor = settings.penalty_offset = 0;
    expect_refused(w.world, sadmm_world_set_settings(w.world, &settings), SADMM_ERROR_INVALID_ARGUMENT,
                   "penalty_offset");
    expect_refused(w.world, sadmm_world_set_settings(w.world, NULL), SADMM_ERROR_INVALID_ARGUMENT, "settings");
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

START_TEST(bad_worlds_are_refused)
{
    sadmm_world_def def = small_def();
    sadmm_world *world;
    const double margins[] = { NAN, INFINITY, -0.01, 1.01 };

    for (size_t i = 0; i < COUNT(margins); ++i) {
        def.contact_margin = margins[i];
        expect_refused(NULL, sadmm_world_create(&def, &world), SADMM_ERROR_INVALID_ARGUMENT, "contact_margin");
    }
    def = small_def(), def.backend = (sadmm_backend)99;
    expect_refused(NULL, sadmm_world_create(&def, &world), SADMM_ERROR_INVALID_ARGUMENT, "backend");
    ck_assert_ptr_null(world);
    def = small_def(), def.backend = SADMM_BACKEND_COUNT;
    expect_refused(NULL, sadmm_world_create(&def, &world), SADMM_ERROR_INVALID_ARGUMENT, "backend");
    def = small_def(), def.precision = (sadmm_precision)2;
    expect_refused(NULL, sadmm_world_create(&def, &world), SADMM_ERROR_INVALID_ARGUMENT, "precision");
    def = small_def(), def.device = -1;
    expect_refused(NULL, sadmm_world_create(&def, &world), SADMM_ERROR_INVALID_ARGUMENT, "device");
    def = small_def(), def.backend = SADMM_BACKEND_REF, def.precision = SADMM_F32; /* the oracle is double only */
    expect_refused(NULL, sadmm_world_create(&def, &world), SADMM_ERROR_UNAVAILABLE, "ref");
    expect_refused(NULL, sadmm_world_create(NULL, &world), SADMM_ERROR_INVALID_ARGUMENT, "def");
    expect_refused(NULL, sadmm_world_create(&def, NULL), SADMM_ERROR_INVALID_ARGUMENT, "out");

    sadmm_backend_info info;
    ck_assert_int_eq(sadmm_backend_query(SADMM_BACKEND_AUTO, &info), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_backend_query(SADMM_BACKEND_COUNT, &info), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_backend_query((sadmm_backend)99, &info), SADMM_ERROR_INVALID_ARGUMENT);
}
END_TEST

/* ---- calls on live objects ---- */

START_TEST(bad_states_and_wrenches_are_refused)
{
    struct small_world w = make_small(), other = make_small();
    const sadmm_body_state good = body_state(w.world, w.high);
    const double zero[3] = { 0 }, nan[3] = { 0, NAN, 0 }, infinite[3] = { 0, 0, INFINITY }, one[3] = { 1, 0, 0 };
    sadmm_body_state state;

    state = good, state.position[1] = NAN;
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.high, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "position");
    state = good, state.position[1] = -INFINITY;
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.high, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "position");
    state = good, memset(state.orientation, 0, sizeof state.orientation);
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.high, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "orientation");
    state = good, state.orientation[0] *= 1.0001;
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.high, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "orientation");
    state = good, state.linear_velocity[2] = INFINITY;
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.high, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "linear_velocity");
    state = good, state.angular_velocity[0] = NAN;
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.high, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "state->angular_velocity[0] = nan: must be finite");
    state = body_state(w.world, w.ground), state.linear_velocity[0] = 1; /* static */
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.ground, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "state->linear_velocity[0] = 1: must be 0, for the body is static");
    state.linear_velocity[0] = 0, state.angular_velocity[2] = -2;
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.ground, &state), SADMM_ERROR_INVALID_ARGUMENT,
                   "state->angular_velocity[2] = -2: must be 0, for the body is static");
    expect_refused(w.world, sadmm_world_set_body_state(w.world, w.high, NULL), SADMM_ERROR_INVALID_ARGUMENT, "state");

    expect_refused(w.world, sadmm_world_set_body_wrench(w.world, w.high, nan, zero), SADMM_ERROR_INVALID_ARGUMENT,
                   "force");
    expect_refused(w.world, sadmm_world_set_body_wrench(w.world, w.high, one, infinite), SADMM_ERROR_INVALID_ARGUMENT,
                   "torque");
    expect_refused(w.world, sadmm_world_set_body_wrench(w.world, w.high, NULL, zero), SADMM_ERROR_INVALID_ARGUMENT,
                   "force");

    const double frictions[] = { NAN, INFINITY, -0.5, -2, 1.01e6 };
    for (size_t i = 0; i < COUNT(frictions); ++i)
        expect_refused(w.world, sadmm_world_set_pair_friction(w.world, w.low_shape, w.high_shape, frictions[i]),
                       SADMM_ERROR_INVALID_ARGUMENT, "friction");
    expect_refused(w.world, sadmm_world_set_pair_friction(w.world, w.low_shape, w.low_shape, 1),
                   SADMM_ERROR_INVALID_ARGUMENT, "same");
    expect_refused(w.world, sadmm_world_set_body_pair_contact(w.world, w.low, w.low, false),
                   SADMM_ERROR_INVALID_ARGUMENT, "same");
    MUST(w.world, sadmm_world_set_pair_friction(w.world, w.low_shape, w.high_shape, 2));
    MUST(w.world, sadmm_world_set_pair_friction(w.world, w.high_shape, w.low_shape, -1)); /* takes it back */
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

/* Every call that takes an id, with one that names nothing. */
static void expect_stale(sadmm_world *world, sadmm_body_id body, sadmm_shape_id shape, const struct small_world *live)
{
    const double zero[3] = { 0 };
    sadmm_body_state state = body_state(world, live->low);
    sadmm_body_def def;
    sadmm_shape_def box = box_shape(), shape_def;
    double wrench[6];

    ck_assert_int_eq(sadmm_world_remove_body(world, body), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_body_state(world, body, &state), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_body_state(world, body, &state), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_body_def(world, body, &def), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_body_wrench(world, body, zero, zero), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_body_contact_wrench(world, body, wrench), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_body_pair_contact(world, live->low, body, false), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_body_pair_contact(world, body, live->low, false), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_add_shape(world, body, &box, NULL), SADMM_ERROR_STALE_ID);
    expect_refused(world, sadmm_world_body_state(world, body, &state), SADMM_ERROR_STALE_ID, "id");

    ck_assert_int_eq(sadmm_world_remove_shape(world, shape), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_shape_def(world, shape, &shape_def, NULL), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_pair_friction(world, shape, live->low_shape, 1), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_set_pair_friction(world, live->low_shape, shape, 1), SADMM_ERROR_STALE_ID);
    expect_refused(world, sadmm_world_remove_shape(world, shape), SADMM_ERROR_STALE_ID, "id");
}

START_TEST(stale_ids_are_refused)
{
    struct small_world w = make_small(), other = make_small();
    sadmm_body_def def = box_body(5);
    sadmm_shape_def box = box_shape();
    sadmm_body_id body, again;
    sadmm_shape_id shape;

    expect_stale(w.world, (sadmm_body_id){ 0, 0 }, (sadmm_shape_id){ 0, 0 }, &w);
    expect_stale(w.world, (sadmm_body_id){ 4, 1 }, (sadmm_shape_id){ 4, 1 }, &w); /* one past the end */
    expect_stale(w.world, (sadmm_body_id){ UINT32_MAX, 1 }, (sadmm_shape_id){ UINT32_MAX, 1 }, &w);
    expect_stale(w.world, (sadmm_body_id){ w.low.slot, w.low.generation + 1 },
                 (sadmm_shape_id){ w.low_shape.slot, w.low_shape.generation + 1 }, &w);

    MUST(w.world, sadmm_world_add_body(w.world, &def, &body));
    MUST(w.world, sadmm_world_add_shape(w.world, body, &box, &shape));
    MUST(w.world, sadmm_world_set_pair_friction(w.world, shape, w.low_shape, 0.3));
    MUST(w.world, sadmm_world_set_body_pair_contact(w.world, body, w.low, false));
    MUST(w.world, sadmm_world_remove_body(w.world, body)); /* takes its shape along */
    expect_stale(w.world, body, shape, &w);
    MUST(w.world, sadmm_world_add_body(w.world, &def, &again)); /* the slot lives again, the old id does not */
    ck_assert_uint_eq(again.slot, body.slot);
    expect_stale(w.world, body, shape, &w);
    MUST(w.world, sadmm_world_remove_body(w.world, again));
    ck_assert_int_eq(sadmm_world_body_count(w.world), 3);
    ck_assert_int_eq(sadmm_world_shape_count(w.world), 3);
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

START_TEST(bad_ranges_and_early_calls_are_refused)
{
    struct small_world w = make_small();
    sadmm_body_id body;
    sadmm_shape_id shape;
    sadmm_contact contacts[64];
    sadmm_problem *problem;
    double wrench[6];

    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    expect_refused(w.world, sadmm_world_body_at(w.world, -1, &body), SADMM_ERROR_INVALID_ARGUMENT, "index");
    expect_refused(w.world, sadmm_world_body_at(w.world, 3, &body), SADMM_ERROR_INVALID_ARGUMENT, "index");
    expect_refused(w.world, sadmm_world_shape_at(w.world, 3, &shape), SADMM_ERROR_INVALID_ARGUMENT, "index");
    expect_refused(w.world, sadmm_world_freeze(w.world, problem), SADMM_ERROR_UNAVAILABLE, "step");
    expect_refused(w.world, sadmm_world_body_contact_wrench(w.world, w.low, wrench), SADMM_ERROR_UNAVAILABLE, "wrench");
    ck_assert_int_eq(sadmm_world_contact_count(w.world), 0);
    ck_assert_int_eq(world_report(w.world).step, 0);

    step_world(w.world, 1);
    int32_t count = sadmm_world_contact_count(w.world);
    ck_assert(count > 0 && count <= 64);
    MUST(w.world, sadmm_world_contacts(w.world, 0, count, contacts));
    MUST(w.world, sadmm_world_contacts(w.world, count, 0, NULL));
    expect_refused(w.world, sadmm_world_contacts(w.world, 0, count + 1, contacts), SADMM_ERROR_INVALID_ARGUMENT,
                   "first");
    expect_refused(w.world, sadmm_world_contacts(w.world, -1, 1, contacts), SADMM_ERROR_INVALID_ARGUMENT, "first");
    expect_refused(w.world, sadmm_world_contacts(w.world, 0, -1, contacts), SADMM_ERROR_INVALID_ARGUMENT, "count");
    expect_refused(w.world, sadmm_world_contacts(w.world, INT32_MAX, INT32_MAX, contacts), SADMM_ERROR_INVALID_ARGUMENT,
                   "first");
    expect_refused(w.world, sadmm_world_freeze(w.world, NULL), SADMM_ERROR_INVALID_ARGUMENT, "problem");
    expect_refused(w.world, sadmm_world_report(w.world, NULL), SADMM_ERROR_INVALID_ARGUMENT, "report");
    MUST(w.world, sadmm_world_body_contact_wrench(w.world, w.low, wrench));

    sadmm_settings settings = sadmm_world_settings(w.world);
    settings.recover_wrenches = false;
    MUST(w.world, sadmm_world_set_settings(w.world, &settings));
    step_world(w.world, 1);
    expect_refused(w.world, sadmm_world_body_contact_wrench(w.world, w.low, wrench), SADMM_ERROR_UNAVAILABLE, "wrench");

    /* What was removed is not reported as touching. */
    MUST(w.world, sadmm_world_remove_body(w.world, w.high));
    ck_assert_int_eq(sadmm_world_contact_count(w.world), 0);
    sadmm_problem_destroy(problem);
    sadmm_world_destroy(w.world);
}
END_TEST

/* Each names the argument, and the world goes on as if nothing had been asked. */
START_TEST(missing_outputs_are_refused)
{
    struct small_world w = make_small(), other = make_small();
    const sadmm_status invalid = SADMM_ERROR_INVALID_ARGUMENT;
    sadmm_body_id body = { 7, 7 };
    step_world(w.world, 1);
    step_world(other.world, 1);
    expect_refused(w.world, sadmm_world_body_at(w.world, 0, NULL), invalid, "id = NULL");
    expect_refused(w.world, sadmm_world_shape_at(w.world, 0, NULL), invalid, "id = NULL");
    expect_refused(w.world, sadmm_world_body_state(w.world, w.low, NULL), invalid, "state = NULL");
    expect_refused(w.world, sadmm_world_body_def(w.world, w.low, NULL), invalid, "def = NULL");
    expect_refused(w.world, sadmm_world_body_contact_wrench(w.world, w.low, NULL), invalid, "wrench = NULL");
    expect_refused(w.world, sadmm_world_shape_def(w.world, w.low_shape, NULL, &body), invalid, "def = NULL");
    ck_assert(body.slot == 7 && body.generation == 7);
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

START_TEST(long_names_are_cut)
{
    struct small_world w = make_small();
    char name[200];
    sadmm_body_def def = box_body(5), read;
    sadmm_body_id id;

    memset(name, 'x', sizeof name);
    name[sizeof name - 1] = 0;
    def.name = name;
    MUST(w.world, sadmm_world_add_body(w.world, &def, &id));
    MUST(w.world, sadmm_world_body_def(w.world, id, &read));
    ck_assert_uint_eq(strlen(read.name), 63);
    sadmm_world_destroy(w.world);
}
END_TEST

/* Bodies that come and go by the hundred thousand, inspected one by one: work in proportion to their number. Any loop
 * over all slots in one of these calls takes minutes here (the test's time limit). */
START_TEST(many_bodies_come_and_go)
{
    enum { COUNT = 200000 };
    sadmm_world_def def = small_def();
    sadmm_world *world = create_world(&def);
    sadmm_body_def body = box_body(0);
    sadmm_body_state state;
    sadmm_shape_def box = box_shape();
    sadmm_body_id *ids = malloc(COUNT * sizeof *ids), id;
    sadmm_shape_id shape;
    long failed = 0, wrong = 0; /* counted: a million assertions take longer than what they check */
    for (int32_t i = 0; i < COUNT; ++i) {
        body.position[0] = i;
        failed += sadmm_world_add_body(world, &body, &ids[i]) != SADMM_OK;
        for (int k = 0; k <= (i % 5 == 0); ++k) failed += sadmm_world_add_shape(world, ids[i], &box, NULL) != SADMM_OK;
    }
    /* The last shape of all belongs to the first body: it has to be found too. */
    MUST(world, sadmm_world_add_shape(world, ids[0], &box, &shape));

    for (int32_t i = 0; i < COUNT; i += 2) failed += sadmm_world_remove_body(world, ids[i]) != SADMM_OK;
    ck_assert_int_eq(sadmm_world_body_count(world), COUNT / 2);
    ck_assert_int_eq(sadmm_world_shape_count(world), COUNT / 2 + COUNT / 10);
    ck_assert_int_eq(sadmm_world_shape_def(world, shape, &box, NULL), SADMM_ERROR_STALE_ID);
    for (int32_t i = 0; i < COUNT / 2; ++i) {
        failed += sadmm_world_body_at(world, i, &id) != SADMM_OK || sadmm_world_shape_at(world, i, &shape) != SADMM_OK;
        wrong += id.slot != ids[2 * i + 1].slot;
    }
    ck_assert_uint_eq(body_at(world, 7).slot, ids[15].slot); /* back again */
    ck_assert_uint_eq(body_at(world, 5).slot, ids[11].slot);

    /* Free slots are filled from the lowest on; the old ids stay stale. */
    for (int32_t i = 0; i < COUNT; i += 2) {
        body.position[0] = -i;
        failed += sadmm_world_add_body(world, &body, &id) != SADMM_OK;
        wrong += id.slot != ids[i].slot || id.generation == ids[i].generation;
        failed += sadmm_world_add_shape(world, id, &box, NULL) != SADMM_OK;
        ids[i] = id;
        if (i % 1000 == 0) { /* the order of creation slots holds at every moment */
            ck_assert_uint_eq(body_at(world, i).slot, ids[i].slot);
            ck_assert_uint_eq(body_at(world, i + 2).slot, ids[i + 3].slot);
        }
    }
    ck_assert_int_eq(sadmm_world_body_count(world), COUNT);
    for (int32_t i = 0; i < COUNT; ++i) {
        failed += sadmm_world_body_at(world, i, &id) != SADMM_OK;
        wrong += id.slot != ids[i].slot || id.generation != ids[i].generation;
        failed += sadmm_world_body_state(world, id, &state) != SADMM_OK;
        wrong += state.position[0] != (i % 2 ? i : -i);
    }
    for (int32_t i = COUNT; i-- > 0;) failed += sadmm_world_remove_body(world, ids[i]) != SADMM_OK;
    ck_assert_msg(failed == 0 && wrong == 0, "%ld calls failed (%s), %ld answers are wrong", failed,
                  sadmm_world_message(world), wrong);
    ck_assert_int_eq(sadmm_world_body_count(world), 0);
    ck_assert_int_eq(sadmm_world_shape_count(world), 0);
    sadmm_world_destroy(world);
    free(ids);
}
END_TEST

START_TEST(an_empty_world_steps)
{
    sadmm_world_def def = small_def();
    def.backend = _i ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU;
    sadmm_world *world = create_world(&def);
    step_world(world, 3);
    sadmm_step_report report = world_report(world);
    ck_assert_int_eq(report.step, 3);
    ck_assert_int_eq(report.contacts, 0);
    ck_assert_double_eq_tol(report.time, 0.015, 1e-15);
    ck_assert_int_eq(sadmm_world_step(world), SADMM_OK);
    sadmm_world_destroy(world);
    sadmm_world_destroy(NULL);
}
END_TEST

/* ---- a step that fails ---- */

/* A body is set to turn at 1e200 rad/s, the square of which is no number; the other two must not suffer. */
START_TEST(a_step_that_is_not_finite_is_rolled_back)
{
    struct small_world w = make_small(), other = make_small();
    sadmm_body_def def = box_body(9);
    sadmm_body_id feather;
    sadmm_body_state state;

    step_world(w.world, 5);
    step_world(other.world, 5);
    def.name = "feather";
    MUST(w.world, sadmm_world_add_body(w.world, &def, &feather));
    state = body_state(w.world, feather);
    state.angular_velocity[0] = 1e200;
    MUST(w.world, sadmm_world_set_body_state(w.world, feather, &state));
    uint64_t before = state_hash(w.world);
    for (int i = 0; i < 3; ++i) {
        expect_refused(w.world, sadmm_world_step(w.world), SADMM_ERROR_NON_FINITE, "feather");
        ck_assert_uint_eq(state_hash(w.world), before);
        ck_assert_int_eq(world_report(w.world).step, 5);
    }
    MUST(w.world, sadmm_world_remove_body(w.world, feather));
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

/* Any finite velocity is taken: one that leads nowhere fails, or makes a step, and is over. */
START_TEST(the_largest_velocities)
{
    for (int k = 0; k < 2; ++k) {
        sadmm_world_def def = small_def();
        def.settings.substeps = k ? 4 : 1;
        sadmm_world *world = create_world(&def);
        for (int i = 0; i < 2; ++i) {
            sadmm_body_def body = box_body(1 + i);
            sadmm_shape_def box = box_shape();
            sadmm_body_id id;
            MUST(world, sadmm_world_add_body(world, &body, &id));
            MUST(world, sadmm_world_add_shape(world, id, &box, NULL));
            sadmm_body_state state = body_state(world, id);
            state.linear_velocity[1] = DBL_MAX;
            MUST(world, sadmm_world_set_body_state(world, id, &state));
        }
        for (int step = 0; step < 3; ++step) {
            const sadmm_status status = sadmm_world_step(world);
            ck_assert_msg(status == SADMM_OK || status == SADMM_ERROR_NON_FINITE, "%s", sadmm_status_name(status));
        }
        sadmm_world_destroy(world);
    }
}
END_TEST

/* ---- memory that runs out, at every allocation in turn ---- */

static void expect_out_of_memory(const sadmm_world *world, sadmm_status status)
{
    expect_refused(world, status, SADMM_ERROR_OUT_OF_MEMORY, "out of memory");
}

START_TEST(creation_without_memory)
{
    sadmm_world_def def = small_def();
    sadmm_world *world = NULL;
    long n = 0;

    for (;; ++n) {
        world = (sadmm_world *)&def;
        sadmm_test_fail_allocations_after(n);
        sadmm_status status = sadmm_world_create(&def, &world);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) break;
        expect_out_of_memory(NULL, status);
        ck_assert_ptr_null(world);
    }
    ck_assert_int_gt(n, 0); /* it does allocate */
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(scenes_without_memory)
{
    struct sadmm_scene scene = open_scene(_i ? "sliding_cubes:100" : "vertical_stacks:2"), same = scene;
    sadmm_world *world = NULL, *other = build_scene(&same);
    struct sadmm_error error;
    long n = 0;

    for (;; ++n) {
        sadmm_test_fail_allocations_after(n);
        sadmm_status status = sadmm_scene_build(&scene, &world, &error);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) break;
        ck_assert_int_eq(status, SADMM_ERROR_OUT_OF_MEMORY);
        ck_assert_msg(strstr(error.message, "out of memory"), "%s", error.message);
        ck_assert_ptr_null(world);
    }
    ck_assert_int_gt(n, 3);
    ck_assert_uint_eq(state_hash(world), state_hash(other));
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* A call repeated with ever more memory until it passes. */
#define UNTIL_MEMORY_LASTS(world, n, call)                                                       \
    for ((n) = 0;; ++(n)) {                                                                      \
        uint64_t hash_before = state_hash(world);                                    \
        sadmm_test_fail_allocations_after(n);                                                    \
        sadmm_status memory_status = (call);                                                     \
        sadmm_test_fail_allocations_after(-1);                                                   \
        if (memory_status == SADMM_OK) break;                                                    \
        expect_out_of_memory(world, memory_status);                                              \
        ck_assert_uint_eq(state_hash(world), hash_before);                           \
        ck_assert_msg((n) < 10000, "%s: never succeeds", #call);                                 \
    }

START_TEST(adding_without_memory)
{
    struct small_world w = make_small(), other = make_small();
    long n, failures = 0;

    for (int i = 0; i < 40; ++i) { /* past several doublings */
        sadmm_body_def def = box_body(1 + 0.3 * i);
        sadmm_shape_def box = box_shape();
        sadmm_body_id id;
        sadmm_shape_id shape;
        UNTIL_MEMORY_LASTS(w.world, n, sadmm_world_add_body(w.world, &def, &id));
        failures += n;
        UNTIL_MEMORY_LASTS(w.world, n, sadmm_world_add_shape(w.world, id, &box, &shape));
        failures += n;
        UNTIL_MEMORY_LASTS(w.world, n, sadmm_world_set_pair_friction(w.world, shape, w.low_shape, 0.7));
        failures += n;
        UNTIL_MEMORY_LASTS(w.world, n, sadmm_world_set_body_pair_contact(w.world, id, w.low, false));
        failures += n;
        MUST(other.world, sadmm_world_add_body(other.world, &def, &id));
        MUST(other.world, sadmm_world_add_shape(other.world, id, &box, &shape));
        MUST(other.world, sadmm_world_set_pair_friction(other.world, shape, other.low_shape, 0.7));
        MUST(other.world, sadmm_world_set_body_pair_contact(other.world, id, other.low, false));
    }
    ck_assert_int_gt(failures, 8);
    ck_assert_int_eq(sadmm_world_body_count(w.world), 43);
    ck_assert_int_eq(sadmm_world_shape_count(w.world), 43);
    expect_equal_future(w.world, other.world);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

START_TEST(steps_without_memory)
{
    struct small_world w = make_small(), other = make_small();
    sadmm_settings settings = sadmm_world_settings(w.world);
    long n, failures = 0;

    if (_i == 1) settings.certify = settings.measure_residuals = true; /* with their own workspaces */
    if (_i == 2) settings.substeps = 3; /* memory runs out in any of them */
    MUST(w.world, sadmm_world_set_settings(w.world, &settings));
    MUST(other.world, sadmm_world_set_settings(other.world, &settings));
    for (int i = 0; i < 30; ++i) {
        UNTIL_MEMORY_LASTS(w.world, n, sadmm_world_step(w.world));
        failures += n;
        step_world(other.world, 1);
        ck_assert_uint_eq(state_hash(w.world), state_hash(other.world));
        ck_assert_int_eq(world_report(w.world).step, i + 1);
        if (i == 10) { /* more bodies: everything has to grow in the middle of the run */
            for (int k = 0; k < 50; ++k) {
                sadmm_body_def def = box_body(0.1);
                sadmm_shape_def box = box_shape();
                sadmm_body_id id;
                def.position[0] = 0.25 * (k + 1);
                MUST(w.world, sadmm_world_add_body(w.world, &def, &id));
                MUST(w.world, sadmm_world_add_shape(w.world, id, &box, NULL));
                MUST(other.world, sadmm_world_add_body(other.world, &def, &id));
                MUST(other.world, sadmm_world_add_shape(other.world, id, &box, NULL));
            }
        }
    }
    ck_assert_int_gt(failures, 20);
    ck_assert_int_gt(world_report(w.world).contacts, 200);
    sadmm_world_destroy(w.world);
    sadmm_world_destroy(other.world);
}
END_TEST

START_TEST(freezing_without_memory)
{
    struct small_world w = make_small();
    sadmm_problem *problem;
    long n;

    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    step_world(w.world, 10);
    UNTIL_MEMORY_LASTS(w.world, n, sadmm_world_freeze(w.world, problem));
    ck_assert_int_gt(n, 1);
    ck_assert_int_eq(sadmm_problem_body_count(problem), 2);
    ck_assert_int_eq(sadmm_problem_contact_count(problem), world_report(w.world).contacts);
    sadmm_problem_destroy(problem);
    sadmm_world_destroy(w.world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("world_inputs");
    TCase *values = tcase_create("values"), *memory = tcase_create("memory");

    tcase_add_test(values, bad_bodies_are_refused);
    tcase_add_test(values, limits_are_inclusive);
    tcase_add_test(values, bad_shapes_are_refused);
    tcase_add_test(values, bad_settings_are_refused);
    tcase_add_test(values, bad_worlds_are_refused);
    tcase_add_test(values, bad_states_and_wrenches_are_refused);
    tcase_add_test(values, stale_ids_are_refused);
    tcase_add_test(values, bad_ranges_and_early_calls_are_refused);
    tcase_add_test(values, missing_outputs_are_refused);
    tcase_add_test(values, long_names_are_cut);
    tcase_add_test(values, many_bodies_come_and_go);
    tcase_add_loop_test(values, an_empty_world_steps, 0, 2);
    tcase_add_test(values, a_step_that_is_not_finite_is_rolled_back);
    tcase_add_test(values, the_largest_velocities);
    tcase_add_test(memory, creation_without_memory);
    tcase_add_loop_test(memory, scenes_without_memory, 0, 2);
    tcase_add_test(memory, adding_without_memory);
    tcase_add_loop_test(memory, steps_without_memory, 0, 3);
    tcase_add_test(memory, freezing_without_memory);
    tcase_set_timeout(memory, 60);
    suite_add_tcase(suite, values);
    suite_add_tcase(suite, memory);
    return run_suite(suite);
}
