/* What the header says about calls on a world: what stays valid, what a failed step leaves, what may be set. */
#include <malloc.h>

#include "core/base/settings_fields.h"
#include "core/math/rigid.h"
#include "core/model/settings.h"
#include "fixed_work.h"
#include "scene_tools.h"

static const double ZERO[3] = {0, 0, 0};

static sadmm_body_def ball_def(double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    def.mass = 1;
    sadmm_sphere_inertia(1, 0.1, def.inertia);
    def.position[2] = z;
    return def;
}

static sadmm_body_id add_ball(sadmm_world *world, const sadmm_body_def *def)
{
    sadmm_shape_def sphere = sadmm_shape_def_default();
    sadmm_body_id id;
    sphere.size[0] = 0.1;
    MUST(world, sadmm_world_add_body(world, def, &id));
    MUST(world, sadmm_world_add_shape(world, id, &sphere, NULL));
    return id;
}

/* A plane, and a ball that rests on it. */
static sadmm_world *ground_and_ball(sadmm_backend backend, sadmm_precision precision, sadmm_body_id *ground,
                                    sadmm_body_id *ball)
{
    sadmm_world_def def = fixed_world_def();
    sadmm_body_def floor = sadmm_body_def_default(), resting = ball_def(0.1);
    sadmm_shape_def plane = sadmm_shape_def_default();
    def.backend = backend;
    def.precision = precision;
    floor.type = SADMM_BODY_STATIC;
    floor.environment = -1;
    plane.type = SADMM_SHAPE_PLANE;
    sadmm_world *world = create_world(&def);
    MUST(world, sadmm_world_add_body(world, &floor, ground));
    MUST(world, sadmm_world_add_shape(world, *ground, &plane, NULL));
    *ball = add_ball(world, &resting);
    return world;
}

#define REFUSED(world, call, part)                                                                    \
    do {                                                                                              \
        ck_assert_int_eq(call, SADMM_ERROR_INVALID_ARGUMENT);                                         \
        ck_assert_msg(strstr(sadmm_world_message(world), part), "%s", sadmm_world_message(world));    \
    } while (0)

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* Read once, and good while bodies come by the thousand, also as the name of others. */
START_TEST(names_stay_where_they_are)
{
    sadmm_world_def def = fixed_world_def();
    sadmm_world *world = create_world(&def);
    sadmm_body_def first = ball_def(0), read;
    sadmm_body_id id, other;
    first.name = "the first of many";
    MUST(world, sadmm_world_add_body(world, &first, &id));
    MUST(world, sadmm_world_body_def(world, id, &read));
    const char *name = read.name;
    for (int k = 0; k < 3000; ++k) {
        MUST(world, sadmm_world_add_body(world, &read, &other)); /* with the world's own pointer */
        if (k % 3 == 0) MUST(world, sadmm_world_remove_body(world, other));
    }
    ck_assert_str_eq(name, "the first of many");
    MUST(world, sadmm_world_body_def(world, id, &read));
    ck_assert_ptr_eq(name, read.name);
    ck_assert_str_eq(body_def(world, body_at(world, 2000)).name, "the first of many");
    first.name = NULL;
    MUST(world, sadmm_world_add_body(world, &first, &other));
    ck_assert_str_eq(body_def(world, other).name, "");
    sadmm_world_destroy(world);
}
END_TEST

/* ---- a step that fails ------------------------------------------------------------------------------------------- */

/* Contacts, the frozen problem, the plan and the report are those of the last step that was done. */
START_TEST(a_failed_step_leaves_what_can_be_read)
{
    sadmm_body_id ground, ball;
    sadmm_world *world = ground_and_ball(_i ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    sadmm_contact contacts[2][4];
    sadmm_problem *frozen[2];
    char text[2][2000];
    double A[2][36], b[2][6], v[2][6];
    step_world(world, 3);
    sadmm_settings settings = sadmm_world_settings(world);
    for (int pass = 0; pass < 2; ++pass) {
        if (pass) { /* another body, other settings, and a spin whose square is no number */
            sadmm_body_def spinning = ball_def(5);
            spinning.name = "top";
            sadmm_body_id top = add_ball(world, &spinning);
            sadmm_body_state state = body_state(world, top);
            state.angular_velocity[1] = 1e200;
            MUST(world, sadmm_world_set_body_state(world, top, &state));
            settings.dt *= 2;
            MUST(world, sadmm_world_set_settings(world, &settings));
            ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_NON_FINITE);
        }
        ck_assert_int_eq(sadmm_problem_create(&frozen[pass]), SADMM_OK);
        ck_assert_int_eq(sadmm_world_contact_count(world), 1);
        memset(contacts[pass], 0, sizeof contacts[pass]);
        MUST(world, sadmm_world_contacts(world, 0, 1, contacts[pass]));
        MUST(world, sadmm_world_freeze(world, frozen[pass]));
        ck_assert_int_eq(sadmm_problem_body_count(frozen[pass]), 1);
        ck_assert_int_eq(sadmm_problem_get_bodies(frozen[pass], A[pass], b[pass], v[pass]), SADMM_OK);
        sadmm_world_explain(world, text[pass], sizeof text[pass]);
        ck_assert_int_eq(world_report(world).contacts, 1);
        ck_assert_int_eq(world_report(world).step, 3);
    }
    ck_assert_int_eq(memcmp(contacts[0], contacts[1], sizeof contacts[0]), 0);
    ck_assert(contacts[0][0].impulse[2] > 0);
    ck_assert(memcmp(A[0], A[1], sizeof A[0]) == 0 && memcmp(b[0], b[1], sizeof b[0]) == 0 &&
              memcmp(v[0], v[1], sizeof v[0]) == 0);
    ck_assert_str_eq(text[0], text[1]);
    for (int pass = 0; pass < 2; ++pass) sadmm_problem_destroy(frozen[pass]);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- states, wrenches, inertias ---------------------------------------------------------------------------------- */

/* What a step made can be set, however far and fast it is, and gives the same next step. */
START_TEST(what_was_read_can_be_set)
{
    sadmm_body_id ground, ball;
    const double push[3] = {1e15, 0, 0};
    sadmm_world *world = ground_and_ball(_i ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    MUST(world, sadmm_world_set_body_wrench(world, ball, push, ZERO));
    step_world(world, 3);
    MUST(world, sadmm_world_set_body_wrench(world, ball, ZERO, ZERO));
    sadmm_body_state state = body_state(world, ball);
    ck_assert(state.linear_velocity[0] > 1e6 && state.position[0] > 1e9); /* beyond what a definition may have */
    uint64_t before = state_hash(world);
    MUST(world, sadmm_world_set_body_state(world, ball, &state));
    ck_assert_uint_eq(state_hash(world), before);
    step_world(world, 1);

    /* The largest numbers there are: taken, and a step with them succeeds or says so. */
    state.position[1] = state.linear_velocity[1] = state.angular_velocity[2] = 1.7e308;
    MUST(world, sadmm_world_set_body_state(world, ball, &state));
    before = state_hash(world);
    sadmm_status status = sadmm_world_step(world);
    ck_assert(status == SADMM_OK || (status == SADMM_ERROR_NON_FINITE && state_hash(world) == before));
    state.position[1] = INFINITY;
    REFUSED(world, sadmm_world_set_body_state(world, ball, &state), "state->position[1] = inf: must be finite");
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(wrenches_on_static_bodies_are_refused)
{
    sadmm_body_id ground, ball;
    const double push[3] = {1, 0, 0};
    sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    REFUSED(world, sadmm_world_set_body_wrench(world, ground, push, ZERO), "is static, and must be dynamic");
    REFUSED(world, sadmm_world_set_body_wrench(world, ground, ZERO, ZERO), "static");
    MUST(world, sadmm_world_set_body_wrench(world, ball, push, ZERO));
    sadmm_world_destroy(world);
}
END_TEST

/* A force and an impulse at a point are what they are at the centre, and a moment about it. */
START_TEST(forces_and_impulses_at_a_point)
{
    const double force[3] = {1, -2, 3}, far[3] = {1e300, 0, 0}, turned[4] = {0.5, 0.5, -0.5, 0.5};
    const double moments[3] = {0.1, 0.2, 0.25};
    sadmm_body_id ground, ball;
    sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    sadmm_world *other = ground_and_ball(SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    sadmm_body_state state = body_state(world, ball);
    state.position[2] = 10; /* in the air */
    memcpy(state.orientation, turned, sizeof turned);
    const double *x = state.position, point[3] = {x[0] + 0.5, x[1], x[2] + 1};
    const double moment[3] = {0 * 3 - 1 * -2, 1 * 1 - 0.5 * 3, 0.5 * -2}; /* (0.5, 0, 1) x force */
    MUST(world, sadmm_world_set_body_state(world, ball, &state));
    MUST(other, sadmm_world_set_body_state(other, ball, &state));
    MUST(world, sadmm_world_set_body_mass(world, ball, 1, moments));
    MUST(other, sadmm_world_set_body_mass(other, ball, 1, moments));
    for (int k = 0; k < 2; ++k) MUST(world, sadmm_world_add_body_force_at(world, ball, force, point)); /* they add up */
    const double twice[3] = {2, -4, 6}, turn[3] = {2 * moment[0], 2 * moment[1], 2 * moment[2]};
    MUST(other, sadmm_world_set_body_wrench(other, ball, twice, turn));
    step_world(world, 5);
    step_world(other, 5);
    ck_assert_uint_eq(state_hash(world), state_hash(other)); /* halves and small integers are exact */

    /* The same impulse as a force that acts for one step without gravity. */
    sadmm_settings settings = sadmm_world_settings(world);
    memset(settings.gravity, 0, sizeof settings.gravity);
    sadmm_world *worlds[2] = {world, other};
    for (int k = 0; k < 2; ++k) {
        MUST(worlds[k], sadmm_world_set_settings(worlds[k], &settings));
        MUST(worlds[k], sadmm_world_set_body_wrench(worlds[k], ball, ZERO, ZERO));
        memset(state.linear_velocity, 0, sizeof state.linear_velocity);
        memset(state.angular_velocity, 0, sizeof state.angular_velocity);
        MUST(worlds[k], sadmm_world_set_body_state(worlds[k], ball, &state));
    }
    MUST(world, sadmm_world_apply_body_impulse_at(world, ball, force, point));
    const double push[3] = {force[0] / settings.dt, force[1] / settings.dt, force[2] / settings.dt};
    MUST(other, sadmm_world_add_body_force_at(other, ball, push, point));
    step_world(other, 1);
    const sadmm_body_state now = body_state(world, ball), then = body_state(other, ball);
    /* it turns in that step, by different moments: what it has got is its angular momentum */
    const vec3 got = rigid_angular_momentum(q_load(now.orientation), v3_load(moments), v3_load(now.angular_velocity)),
               wanted =
                   rigid_angular_momentum(q_load(then.orientation), v3_load(moments), v3_load(then.angular_velocity));
    ck_assert_double_lt(v3_norm(v3_sub(got, wanted)), 1e-9);
    for (int k = 0; k < 3; ++k) { /* a few roundings of numbers of 1 to 1000 */
        ck_assert_double_eq_tol(now.linear_velocity[k], then.linear_velocity[k], 1e-12);
        ck_assert(now.position[k] == state.position[k]);
    }
    ck_assert_double_gt(fabs(now.angular_velocity[0]), 1);

    REFUSED(world, sadmm_world_add_body_force_at(world, ground, force, point), "is static, and must be dynamic");
    REFUSED(world, sadmm_world_apply_body_impulse_at(world, ground, force, point), "is static, and must be dynamic");
    REFUSED(world, sadmm_world_add_body_force_at(world, ball, far, point), "force[0] = 1e+300");
    REFUSED(world, sadmm_world_add_body_force_at(world, ball, force, far), "point[0] = 1e+300");
    const double nothing[3] = {NAN, 0, 0};
    REFUSED(world, sadmm_world_apply_body_impulse_at(world, ball, nothing, point), "impulse[0] = ");
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

/* A body that weighs more takes longer to speed up, and one that is rough to slide. */
START_TEST(mass_and_material_can_be_set)
{
    const double push[3] = {6, 0, 0}, inertia[3] = {0.03, 0.03, 0.03}, wrong[3] = {1, 1, 3};
    sadmm_body_id ground, ball;
    sadmm_world *world = ground_and_ball(_i ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    sadmm_settings settings = sadmm_world_settings(world);
    sadmm_body_def def;
    sadmm_shape_def shape_def;
    sadmm_shape_id shape;
    memset(settings.gravity, 0, sizeof settings.gravity);
    MUST(world, sadmm_world_set_settings(world, &settings));
    sadmm_body_state state = body_state(world, ball);
    state.position[2] = 10;
    MUST(world, sadmm_world_set_body_state(world, ball, &state));
    MUST(world, sadmm_world_set_body_wrench(world, ball, push, ZERO));
    MUST(world, sadmm_world_set_body_mass(world, ball, 3, inertia));
    step_world(world, 10);
    ck_assert_double_eq_tol(body_state(world, ball).linear_velocity[0], 2 * 10 * settings.dt, 1e-12);
    MUST(world, sadmm_world_body_def(world, ball, &def));
    ck_assert(def.mass == 3 && memcmp(def.inertia, inertia, sizeof inertia) == 0);
    REFUSED(world, sadmm_world_set_body_mass(world, ball, 0, inertia), "mass = 0: must be in [1e-09, 1e+12]");
    REFUSED(world, sadmm_world_set_body_mass(world, ball, 1, wrong), "inertia[2] = 3: must be at most");
    REFUSED(world, sadmm_world_set_body_mass(world, ground, 1, inertia), "is static");

    /* On the ground, 1 m/s, held back by mu g m once there is friction: it slides and rolls at 5/7 of its speed. */
    settings = fixed_settings();
    MUST(world, sadmm_world_set_settings(world, &settings));
    MUST(world, sadmm_world_set_body_wrench(world, ball, ZERO, ZERO));
    for (int32_t k = 0; k < sadmm_world_shape_count(world); ++k) {
        MUST(world, sadmm_world_shape_at(world, k, &shape));
        MUST(world, sadmm_world_set_shape_material(world, shape, 0, 0));
    }
    MUST(world, sadmm_world_shape_def(world, shape, &shape_def, NULL));
    const double r = shape_def.size[0], solid[3] = {1.2 * r * r, 1.2 * r * r, 1.2 * r * r};
    MUST(world, sadmm_world_set_body_mass(world, ball, 3, solid));
    memset(&state, 0, sizeof state);
    state.orientation[0] = 1, state.position[2] = r, state.linear_velocity[0] = 1;
    MUST(world, sadmm_world_set_body_state(world, ball, &state));
    step_world(world, 100);
    ck_assert_double_eq_tol(body_state(world, ball).linear_velocity[0], 1, 1e-9); /* nothing holds it */
    for (int32_t k = 0; k < sadmm_world_shape_count(world); ++k) {
        MUST(world, sadmm_world_shape_at(world, k, &shape));
        MUST(world, sadmm_world_set_shape_material(world, shape, 0.5, 0.25));
    }
    MUST(world, sadmm_world_shape_def(world, shape, &shape_def, NULL));
    ck_assert(shape_def.friction == 0.5 && shape_def.restitution == 0.25);
    step_world(world, 200);
    ck_assert_double_eq_tol(body_state(world, ball).linear_velocity[0], 5.0 / 7, 1e-3); /* 20 iterations a step */
    REFUSED(world, sadmm_world_set_shape_material(world, shape, -1, 0), "friction = -1: must be in [0, 1e+06]");
    REFUSED(world, sadmm_world_set_shape_material(world, shape, 0, 2), "restitution = 2: must be in [0, 1]");
    sadmm_world_destroy(world);
}
END_TEST

/* Wrenches, moves and pairs are read back as they are now, and go with what they are of. */
START_TEST(what_was_set_is_reported)
{
    const double force[3] = {1, -2, 1.0 / 3}, torque[3] = {0, 0, 7}, there[3] = {0, 3, 1}, turned[4] = {0.6, 0, 0.8, 0};
    sadmm_body_id ground, ball, belt, a, b;
    sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    sadmm_body_def kinematic = sadmm_body_def_default();
    sadmm_shape_id shapes[2], first, second;
    double x[3], y[4], friction;
    bool pending;
    kinematic.type = SADMM_BODY_KINEMATIC;
    MUST(world, sadmm_world_add_body(world, &kinematic, &belt));
    MUST(world, sadmm_world_set_body_wrench(world, ball, force, torque));
    MUST(world, sadmm_world_add_body_force_at(world, ball, force, body_def(world, ball).position));
    MUST(world, sadmm_world_body_wrench(world, ball, x, y));
    for (int k = 0; k < 3; ++k) ck_assert(x[k] == 2 * force[k] && y[k] == torque[k]);
    MUST(world, sadmm_world_body_wrench(world, ground, x, y));
    ck_assert_mem_eq(x, ZERO, sizeof ZERO);
    ck_assert_mem_eq(y, ZERO, sizeof ZERO);

    MUST(world, sadmm_world_body_move(world, belt, &pending, x, y));
    ck_assert(!pending);
    MUST(world, sadmm_world_move_body(world, belt, there, turned));
    MUST(world, sadmm_world_body_move(world, belt, &pending, x, y));
    ck_assert(pending);
    ck_assert_mem_eq(x, there, sizeof there);
    ck_assert_mem_eq(y, turned, sizeof turned);
    step_world(world, 1);
    MUST(world, sadmm_world_body_move(world, belt, &pending, x, y));
    ck_assert(!pending);

    for (int k = 0; k < 2; ++k) MUST(world, sadmm_world_shape_at(world, k, &shapes[k]));
    ck_assert(sadmm_world_pair_friction_count(world) == 0 && sadmm_world_body_pair_off_count(world) == 0);
    MUST(world, sadmm_world_set_pair_friction(world, shapes[1], shapes[0], 0.25));
    MUST(world, sadmm_world_set_body_pair_contact(world, belt, ball, false));
    ck_assert(sadmm_world_pair_friction_count(world) == 1 && sadmm_world_body_pair_off_count(world) == 1);
    MUST(world, sadmm_world_pair_friction_at(world, 0, &first, &second, &friction));
    ck_assert(friction == 0.25 && first.slot == shapes[0].slot && second.slot == shapes[1].slot &&
              second.generation == shapes[1].generation);
    MUST(world, sadmm_world_body_pair_off_at(world, 0, &a, &b));
    ck_assert(a.slot == ball.slot && b.slot == belt.slot && b.generation == belt.generation);
    REFUSED(world, sadmm_world_pair_friction_at(world, 1, &first, &second, &friction), "index = 1: must be in [0, 1)");
    REFUSED(world, sadmm_world_body_pair_off_at(world, -1, &a, &b), "index = -1: must be in [0, 1)");
    MUST(world, sadmm_world_remove_body(world, ball));
    ck_assert(sadmm_world_pair_friction_count(world) == 0 && sadmm_world_body_pair_off_count(world) == 0);
    ck_assert_int_eq(sadmm_world_body_wrench(world, ball, x, y), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_world_body_move(world, ball, &pending, x, y), SADMM_ERROR_STALE_ID);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(user_data_goes_with_the_body)
{
    sadmm_body_id ground, ball;
    int own = 0;
    sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    ck_assert_ptr_null(sadmm_world_body_user_data(world, ball));
    MUST(world, sadmm_world_set_body_user_data(world, ball, &own));
    ck_assert(sadmm_world_body_user_data(world, ball) == &own && !sadmm_world_body_user_data(world, ground));
    MUST(world, sadmm_world_remove_body(world, ball));
    ck_assert_ptr_null(sadmm_world_body_user_data(world, ball));
    ck_assert_int_eq(sadmm_world_set_body_user_data(world, ball, &own), SADMM_ERROR_STALE_ID);
    sadmm_world_destroy(world);
}
END_TEST

/* Inertias at the ends of their ranges make steps, in both methods and with a certificate; beyond they are refused. */
START_TEST(inertias_that_are_taken_can_be_stepped)
{
    const sadmm_precision precision = _i % 2 ? SADMM_F32 : SADMM_F64;
    const double ratio = precision == SADMM_F32 ? 1e6 : 1e12;
    const struct {
        double scale, ratio;
    } ends[] = {{1, ratio}, {1e-24 * ratio, ratio}, {1e-24, 1}, {1e24, 1}, {1e24, ratio}};
    for (size_t k = 0; k < sizeof ends / sizeof *ends; ++k)
        for (int method = 0; method < SADMM_METHOD_COUNT; ++method) {
            sadmm_body_id ground, ball, thin;
            sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, precision, &ground, &ball);
            sadmm_settings settings = sadmm_world_settings(world);
            settings.method = (sadmm_method)method;
            settings.certify = true;
            MUST(world, sadmm_world_set_settings(world, &settings));
            sadmm_body_def def = ball_def(0.5);
            for (int j = 0; j < 3; ++j) def.inertia[j] = ends[k].scale;
            def.inertia[2] /= ends[k].ratio;
            const double turned[4] = {0.56771830021180747, -0.18190050800876933, 0.56771830021180747,
                                      0.56771830021180747};
            memcpy(def.orientation, turned, sizeof turned);
            MUST(world, sadmm_world_add_body(world, &def, &thin));
            step_world(world, 2);
            sadmm_certificate certificate = world_report(world).certificate;
            ck_assert(isfinite(certificate.ncp_max) && isfinite(certificate.momentum_max));
            sadmm_world_destroy(world);
        }
    sadmm_body_id ground, ball, id;
    sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, precision, &ground, &ball);
    sadmm_body_def def = ball_def(0.5);
    def.inertia[0] = def.inertia[1] = 1, def.inertia[2] = 0.99 / ratio;
    REFUSED(world, sadmm_world_add_body(world, &def, &id), "times the smallest");
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), precision == SADMM_F32 ? "1e+06" : "1e+12"));
    for (int j = 0; j < 3; ++j) def.inertia[j] = 5e-324;
    REFUSED(world, sadmm_world_add_body(world, &def, &id), "must be in [1e-24, 1e+24] kg m^2");
    sadmm_world_destroy(world);
}
END_TEST

/* ---- reports ----------------------------------------------------------------------------------------------------- */

/* Errors of contacts are what the certificate is the largest of; there are none where it was not asked for, nor after
 * the world is another one. */
START_TEST(errors_of_contacts_are_the_certificates)
{
    struct sadmm_scene scene = open_scene("pile:10");
    scene.def.settings.certify = true;
    scene.def.settings.iterations = 4; /* so that there are errors */
    sadmm_world *world = build_scene(&scene);
    step_world(world, 200);
    const int32_t count = sadmm_world_contact_count(world);
    double errors[256] = {0}, largest = 0, sum = 0;
    ck_assert(count > 10 && count <= 256);
    MUST(world, sadmm_world_contact_errors(world, 0, count, errors));
    for (int32_t k = 0; k < count; ++k) largest = fmax(largest, errors[k]), sum += errors[k];
    const sadmm_certificate certificate = world_report(world).certificate;
    ck_assert(largest > 0 && largest == certificate.ncp_max); /* there are no joints */
    ck_assert(errors[certificate.ncp_worst] == largest);
    ck_assert_double_eq_tol(sum, certificate.ncp_mean * count, 1e-14 * count * sum); /* a quotient, rounded */
    double last = -1;
    MUST(world, sadmm_world_contact_errors(world, count - 1, 1, &last));
    ck_assert(last == errors[count - 1]);
    REFUSED(world, sadmm_world_contact_errors(world, 1, count, errors), "must be contacts of the last step");

    size_t size;
    MUST(world, sadmm_world_save(world, NULL, 0, &size));
    void *saved = malloc(size);
    MUST(world, sadmm_world_save(world, saved, size, &size));
    MUST(world, sadmm_world_restore(world, saved, size));
    ck_assert_int_eq(sadmm_world_contact_errors(world, 0, count, errors), SADMM_ERROR_UNAVAILABLE);
    free(saved);
    sadmm_settings settings = sadmm_world_settings(world);
    settings.certify = false;
    step_world(world, 1);
    MUST(world, sadmm_world_contact_errors(world, 0, 1, errors));
    MUST(world, sadmm_world_set_settings(world, &settings));
    step_world(world, 1);
    ck_assert_int_eq(sadmm_world_contact_errors(world, 0, 1, errors), SADMM_ERROR_UNAVAILABLE);
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), "settings.certify"));
    sadmm_world_destroy(world);
}
END_TEST

/* Asked for, the residuals are those of the last iteration, whatever ended it; and nothing else changes. */
START_TEST(residuals_are_measured_when_a_stop_rule_ends_the_step)
{
    uint64_t hashes[2];
    for (int measured = 0; measured < 2; ++measured) {
        sadmm_body_id ground, ball;
        sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
        sadmm_settings settings = sadmm_world_settings(world);
        settings.method = _i ? SADMM_METHOD_PAPER : SADMM_METHOD_FAST;
        settings.iterations = 500;
        settings.measure_residuals = measured;
        settings.tolerance = 1e-3;
        MUST(world, sadmm_world_set_settings(world, &settings));
        step_world(world, 1);
        sadmm_step_report report = world_report(world);
        ck_assert(report.converged && report.iterations < settings.iterations);
        if (measured) ck_assert(report.residual.primal >= 0 && report.residual.dual >= 0);
        else ck_assert(report.residual.primal == -1 && report.residual.dual == -1);
        hashes[measured] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hashes[0], hashes[1]);
}
END_TEST

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static size_t bytes_in_use(void) { return mallinfo2().uordblks; }

/* Environments come and go, each id used once: what is kept does not grow with the ids. */
START_TEST(environments_leave_nothing_behind)
{
    sadmm_body_id ground, ball;
    sadmm_world *world = ground_and_ball(SADMM_BACKEND_CPU, SADMM_F64, &ground, &ball);
    sadmm_body_def def = ball_def(0.1);
    size_t after_some = 0;
    const int32_t some = 50, many = 1050;
    for (int32_t k = 1; k <= many; ++k) {
        def.environment = k;
        sadmm_body_id id = add_ball(world, &def);
        step_world(world, 1);
        ck_assert_int_eq(sadmm_world_contact_count(world), 2);
        MUST(world, sadmm_world_remove_body(world, id));
        if (k == some) after_some = bytes_in_use();
    }
    /* A thousand of the smallest conceivable leaks are 16 kB. */
    if (after_some > 0)
        ck_assert_msg(bytes_in_use() < after_some + 8192, "%zu bytes, then %zu", after_some, bytes_in_use());
    sadmm_world_destroy(world);
}
END_TEST

/* ---- settings ---------------------------------------------------------------------------------------------------- */

/* Members count, padding does not. */
START_TEST(settings_are_compared_by_their_members)
{
    const sadmm_settings given = fixed_settings();
    sadmm_settings a, b;
    memset(&a, 0x00, sizeof a);
    memset(&b, 0xff, sizeof b);
#define BOTH(X, kind, role, member, ...) \
    memcpy(&a.member, &given.member, sizeof given.member), memcpy(&b.member, &given.member, sizeof given.member);
    SADMM_SETTINGS(BOTH, )
    ck_assert(memcmp(&a, &b, sizeof a) != 0); /* there is padding */
    ck_assert(sadmm_settings_equal(&a, &b));
    /* Every other byte belongs to a member, and one changed bit of it makes a difference. */
    for (size_t byte = 0; byte < sizeof a; ++byte) {
        if (((unsigned char *)&a)[byte] != ((unsigned char *)&b)[byte]) continue;
        sadmm_settings c = a;
        memcpy(&c, &a, sizeof c);
        ((unsigned char *)&c)[byte] ^= 1;
        ck_assert_msg(!sadmm_settings_equal(&a, &c), "byte %zu", byte);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("world_contract");
    TCase *cases = tcase_create("world_contract");
    tcase_add_test(cases, names_stay_where_they_are);
    tcase_add_loop_test(cases, a_failed_step_leaves_what_can_be_read, 0, 2);
    tcase_add_loop_test(cases, what_was_read_can_be_set, 0, 2);
    tcase_add_test(cases, wrenches_on_static_bodies_are_refused);
    tcase_add_test(cases, forces_and_impulses_at_a_point);
    tcase_add_loop_test(cases, mass_and_material_can_be_set, 0, 2);
    tcase_add_test(cases, what_was_set_is_reported);
    tcase_add_test(cases, user_data_goes_with_the_body);
    tcase_add_loop_test(cases, inertias_that_are_taken_can_be_stepped, 0, 2);
    tcase_add_loop_test(cases, residuals_are_measured_when_a_stop_rule_ends_the_step, 0, 2);
    tcase_add_test(cases, errors_of_contacts_are_the_certificates);
    tcase_add_test(cases, environments_leave_nothing_behind);
    tcase_add_test(cases, settings_are_compared_by_their_members);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
