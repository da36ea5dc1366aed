/* Between finding contacts and solving them: surfaces that move, and the callback for manifolds, against formulas, on
 * every CPU backend. */
#include "body_worlds.h"

#include "core/base/memory.h"

enum { BOX, PLANE, MESH, KINDS };
static const double TURNED = 0.6; /* rad, of a belt's shape about z */

static double solved(int solver) { return solvers[solver].precision == SADMM_F32 ? 2e-5 : 1e-8; }

static sadmm_mesh *square_mesh(void)
{
    static const double corners[12] = {-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9, 0};
    static const int32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    sadmm_mesh_def def = sadmm_mesh_def_default();
    sadmm_mesh *mesh = NULL;
    def.vertices = corners;
    def.vertex_count = 4;
    def.triangles = triangles;
    def.triangle_count = 2;
    ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
    return mesh;
}

/* A body whose surface, at z = 0, moves along the x of a shape that is turned about z by TURNED. */
static sadmm_body_id add_belt(sadmm_world *world, sadmm_body_type type, int kind, double mu, double speed)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_mesh *mesh = kind == MESH ? square_mesh() : NULL;
    body.type = type;
    const sadmm_body_id id = add_defined(world, &body);
    shape.type = kind == BOX ? SADMM_SHAPE_BOX : kind == PLANE ? SADMM_SHAPE_PLANE : SADMM_SHAPE_MESH;
    shape.mesh = mesh;
    if (kind == BOX) shape.size[0] = shape.size[1] = 9, shape.size[2] = 0.1, shape.position[2] = -0.1;
    shape.orientation[0] = cos(TURNED / 2);
    shape.orientation[3] = sin(TURNED / 2);
    shape.friction = mu;
    shape.surface_velocity[0] = speed;
    shape.surface_velocity[2] = kind == PLANE ? 3 : 0; /* along the normal: nobody sees it */
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    sadmm_mesh_destroy(mesh);
    return id;
}

static sadmm_shape_id shape_of(sadmm_world *world, int32_t index)
{
    sadmm_shape_id id;
    MUST(world, sadmm_world_shape_at(world, index, &id));
    return id;
}

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

/* It drags a cube by mu g until that is as fast, in its own direction, and a kinematic one feels that. */
START_TEST(a_surface_drags_by_friction)
{
    enum { STEPS = 40 };
    const double mu = 0.4, speed = 0.8, mass = 2;
    const int solver = _i % SOLVERS, kind = _i / SOLVERS % KINDS, kinematic = _i / SOLVERS / KINDS;
    if (kinematic && kind == PLANE) return; /* planes are on static bodies */
    const sadmm_world_def def = bodies_def();
    const double dt = def.settings.dt;
    sadmm_world *world = bodies_world(&def, solver);
    const sadmm_body_id belt =
        add_belt(world, kinematic ? SADMM_BODY_KINEMATIC : SADMM_BODY_STATIC, kind, mu, speed);
    const sadmm_body_def cube = cube_def(0, 0, 0.1);
    const sadmm_body_id id = add_cube(world, &cube, mu);
    /* each step leaves what the solve does, and rounds */
    const double tolerance = solved(solver) + 8 * STEPS * epsilon_of(solver) * speed;
    for (int step = 1; step <= STEPS; ++step) {
        step_world(world, 1);
        const sadmm_body_state s = body_state(world, id);
        const double along = fmin(mu * G * step * dt, speed);
        expect_near(s.linear_velocity[0], along * cos(TURNED), tolerance, "speed, x");
        expect_near(s.linear_velocity[1], along * sin(TURNED), tolerance, "speed, y");
        expect_near(s.linear_velocity[2], 0, tolerance, "speed, z");
        ck_assert_int_eq(world_report(world).limited, 0);
        if (!kinematic) continue;
        double wrench[6];
        MUST(world, sadmm_world_body_contact_wrench(world, belt, wrench));
        expect_near(wrench[2], -mass * G, 2e-4 * mass * G, "weight on the belt");
        if (mu * G * step * dt < speed) expect_near(wrench[0], -mu * mass * G * cos(TURNED), 2e-3, "drag on the belt");
    }
    const sadmm_body_state rest = body_state(world, belt);
    for (int k = 0; k < 3; ++k) ck_assert(rest.position[k] == 0 && rest.linear_velocity[k] == 0);
    sadmm_world_destroy(world);
}
END_TEST

/* As a kinematic body does whose velocity is set before every step, at the same pose: to what that one moves on by
 * within half a step. */
START_TEST(a_surface_is_a_body_that_is_set_back)
{
    const int solver = _i;
    sadmm_world_def def = bodies_def();
    double found[2][7];
    for (int way = 0; way < 2; ++way) {
        sadmm_world *world = bodies_world(&def, solver);
        sadmm_body_def belt = sadmm_body_def_default();
        belt.type = SADMM_BODY_KINEMATIC;
        belt.position[2] = -0.1;
        const sadmm_body_id id = add_defined(world, &belt);
        give_box(world, id, 9, 9, 0.1, 0.6);
        const double velocity[3] = {1, -0.4, 0};
        if (way) MUST(world, sadmm_world_set_shape_surface_velocity(world, shape_of(world, 0), velocity));
        sadmm_body_state place = body_state(world, id);
        memcpy(place.linear_velocity, velocity, sizeof velocity);
        sadmm_body_id top = {0, 0};
        for (int k = 0; k < 4; ++k) {
            const sadmm_body_def cube = cube_def(0.03 * k, 0, 0.1 + 0.2 * k);
            top = add_cube(world, &cube, 0.6);
        }
        for (int step = 0; step < 50; ++step) {
            if (!way) MUST(world, sadmm_world_set_body_state(world, id, &place));
            step_world(world, 1);
        }
        const sadmm_body_state s = body_state(world, top);
        memcpy(found[way], s.position, sizeof s.position);
        memcpy(found[way] + 3, s.linear_velocity, sizeof s.linear_velocity);
        found[way][6] = s.orientation[0];
        sadmm_world_destroy(world);
    }
    for (int k = 0; k < 7; ++k) expect_near(found[1][k], found[0][k], 1e-4, "state of the top cube");
}
END_TEST

/* The certificate measures from raw data: the solver solves for the surface's velocity, and sub-steps are steps. */
START_TEST(what_rides_is_solved)
{
    const int solver = _i;
    sadmm_world_def def = bodies_def();
    def.settings.iterations = 400;
    def.settings.certify = true;
    def.settings.substeps = 2;
    sadmm_world *world = bodies_world(&def, solver);
    add_belt(world, SADMM_BODY_STATIC, BOX, 0.5, 2);
    for (int k = 0; k < 9; ++k) {
        const sadmm_body_def cube = cube_def(0.21 * (k % 3), 0.21 * (k / 3), 0.1);
        add_cube(world, &cube, 0.1 + 0.1 * k);
    }
    double error = 0;
    for (int step = 0; step < 60; ++step) {
        step_world(world, 1);
        error = fmax(error, world_report(world).certificate.ncp_max);
    }
    /* f32: velocities of 2 m/s round to 1e-7, in every of some ten products */
    ck_assert_msg(error <= (solvers[solver].precision == SADMM_F32 ? 1e-5 : 1e-6), "error %g m/s", error);
    sadmm_world_destroy(world);
}
END_TEST

/* A ball that bounces on a belt: each hit changes its speed along the belt by mu (1 + e) of what it comes down with. */
START_TEST(hits_feel_the_surface)
{
    const int solver = _i;
    const double mu = 0.2, e = 0.5, speed = 5, fall = 2;
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, solver);
    add_belt(world, SADMM_BODY_STATIC, BOX, mu, speed);
    sadmm_body_def ball = point_def(0, 0, 0.1 + 1e-3);
    ball.linear_velocity[2] = -fall;
    const sadmm_body_id id = add_defined(world, &ball);
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.size[0] = 0.1;
    shape.friction = mu;
    shape.restitution = e;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    step_world(world, 1);
    const sadmm_body_state s = body_state(world, id);
    const double at = sqrt(fall * fall + 2 * G * 1e-3), dragged = mu * (1 + e) * at;
    /* what it meets with is known to the rounding of its own arithmetic, in double on every precision */
    expect_near(s.linear_velocity[0], dragged * cos(TURNED), 1e-6, "x");
    expect_near(s.linear_velocity[1], dragged * sin(TURNED), 1e-6, "y");
    ck_assert(s.linear_velocity[2] > 0.9 * e * fall);
    sadmm_world_destroy(world);
}
END_TEST

/* Read back, changed, refused, saved: a world that was restored makes the same steps. */
START_TEST(a_surface_is_a_part_of_the_definition)
{
    const int solver = _i;
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, solver), *again = bodies_world(&def, solver);
    add_belt(world, SADMM_BODY_STATIC, BOX, 0.5, 1);
    const sadmm_body_def cube = cube_def(0, 0, 0.1);
    const sadmm_body_id id = add_cube(world, &cube, 0.5);
    const sadmm_shape_id belt = shape_of(world, 0), own = shape_of(world, 1);
    const double other[3] = {-0.5, 0.25, 0}, wrong[3] = {0, 2e6, 0}, none[3] = {0, 0, 0};
    sadmm_shape_def read;
    MUST(world, sadmm_world_shape_def(world, belt, &read, NULL));
    ck_assert(read.surface_velocity[0] == 1);
    step_world(world, 3);
    MUST(world, sadmm_world_set_shape_surface_velocity(world, belt, other));
    MUST(world, sadmm_world_set_shape_surface_velocity(world, own, none));
    ck_assert_int_eq(sadmm_world_set_shape_surface_velocity(world, belt, wrong), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(world), "velocity[1] = 2e+06: must be in [-1e+06, 1e+06]");
    ck_assert_int_eq(sadmm_world_set_shape_surface_velocity(world, own, other), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(world), "velocity = (-0.5, 0.25, 0): must be 0 on a dynamic body");
    read.surface_velocity[1] = 1;
    ck_assert_int_eq(sadmm_world_add_shape(world, id, &read, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    MUST(world, sadmm_world_shape_def(world, belt, &read, NULL));
    ck_assert(memcmp(read.surface_velocity, other, sizeof other) == 0);

    size_t size = 0;
    MUST(world, sadmm_world_save(world, NULL, 0, &size));
    void *buffer = malloc(size);
    MUST(world, sadmm_world_save(world, buffer, size, &size));
    MUST(again, sadmm_world_restore(again, buffer, size));
    step_world(world, 20);
    step_world(again, 20);
    ck_assert(state_hash(world) == state_hash(again));
    ck_assert(body_state(world, id).linear_velocity[0] < 0);
    free(buffer);
    sadmm_world_destroy(world);
    sadmm_world_destroy(again);
}
END_TEST

/* Environments begin with the template's surfaces, and make its steps. */
START_TEST(environments_have_it)
{
    const int solver = _i;
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, solver);
    add_belt(world, SADMM_BODY_STATIC, BOX, 0.5, 1);
    const sadmm_body_def cube = cube_def(0, 0, 0.1);
    add_cube(world, &cube, 0.5);
    step_world(world, 2);
    sadmm_environments *environments = NULL;
    MUST(world, sadmm_world_replicate(world, 3, &environments));
    ck_assert_int_eq(sadmm_environments_step(environments, 10), SADMM_OK);
    step_world(world, 10);
    double states[3 * 2 * 13], own[2 * 13];
    ck_assert_int_eq(sadmm_environments_get(environments, SADMM_ARRAY_BODY_STATE, NULL, 3, states), SADMM_OK);
    MUST(world, sadmm_world_get_array(world, SADMM_ARRAY_BODY_STATE, 0, 2, own));
    for (int k = 0; k < 3; ++k) ck_assert(memcmp(states + (size_t)k * 26, own, sizeof own) == 0);
    sadmm_environments_destroy(environments);
    sadmm_world_destroy(world);
}
END_TEST

/* ---- the callback ------------------------------------------------------------------------------------------------ */

/* What a callback does, and what it has seen. */
struct decider {
    double friction, restitution, surface[3]; /* < 0: as they are */
    bool off;                /* no contact */
    uint32_t platform;       /* slot of a body that has none from below; 0: of none */
    int calls, begun, hits, points;
    double speed;
};

static void decide(void *context, sadmm_manifold *manifold)
{
    struct decider *d = context;
    ++d->calls;
    d->begun += manifold->begun;
    d->hits += manifold->hit;
    d->points += manifold->count;
    d->speed = fmax(d->speed, manifold->speed);
    if (d->friction >= 0) manifold->friction = d->friction;
    if (d->restitution >= 0) manifold->restitution = d->restitution;
    memcpy(manifold->surface_velocity, d->surface, sizeof d->surface);
    const double up = manifold->body_a.slot == d->platform ? manifold->normal[2] : -manifold->normal[2];
    manifold->enabled = !d->off && !(d->platform && up < 0.7);
}

static const struct decider AS_IT_IS = {.friction = -1, .restitution = -1};

/* A cube on a floor, which the callback is asked about. */
static sadmm_world *asked_world(int solver, struct decider *d, double height, double mu, double e)
{
    const sadmm_world_def def = bodies_def();
    sadmm_world *world = bodies_world(&def, solver);
    add_floor(world, mu);
    const sadmm_body_def cube = cube_def(0, 0, 0.1 + height);
    const sadmm_body_id id = add_cube(world, &cube, mu);
    MUST(world, sadmm_world_set_shape_material(world, shape_of(world, 1), mu, e));
    sadmm_body_state s = body_state(world, id);
    s.linear_velocity[0] = 1;
    MUST(world, sadmm_world_set_body_state(world, id, &s));
    MUST(world, sadmm_world_set_manifold_callback(world, decide, d));
    return world;
}

static sadmm_body_id cube_of(sadmm_world *world) { return body_at(world, 1); }

START_TEST(it_sets_friction)
{
    const int solver = _i;
    struct decider d = AS_IT_IS;
    d.friction = 0.1;
    sadmm_world *world = asked_world(solver, &d, 0, 0.8, 0);
    step_world(world, 10);
    const double dt = sadmm_world_settings(world).dt;
    expect_near(body_state(world, cube_of(world)).linear_velocity[0], 1 - 0.1 * G * 10 * dt,
                solved(solver) + 80 * epsilon_of(solver), "speed");
    ck_assert_int_eq(d.calls, 10);
    ck_assert_int_eq(d.begun, 1);
    ck_assert_int_eq(d.points, 40);
    sadmm_contact contact;
    MUST(world, sadmm_world_contacts(world, 0, 1, &contact));
    ck_assert(contact.friction == 0.1);
    d.friction = -1; /* for one step alone */
    step_world(world, 1);
    MUST(world, sadmm_world_contacts(world, 0, 1, &contact));
    ck_assert(contact.friction == 0.8);
    sadmm_world_destroy(world);
}
END_TEST

/* From rest to the surface's speed, and back without one. */
START_TEST(it_sets_the_surface_velocity)
{
    const int solver = _i;
    struct decider d = AS_IT_IS;
    sadmm_world *world = asked_world(solver, &d, 0, 0.8, 0);
    sadmm_contact contact;
    d.surface[1] = 0.5;
    d.surface[2] = 7; /* along the normal: it is left out */
    step_world(world, 1);
    MUST(world, sadmm_world_contacts(world, 0, 1, &contact));
    /* b's surface against a's: where the cube is b it is pushed the other way */
    const double sign = contact.body_a.slot == cube_of(world).slot ? 1 : -1;
    step_world(world, 60);
    expect_near(body_state(world, cube_of(world)).linear_velocity[1], sign * 0.5, 2 * solved(solver), "speed");
    memset(d.surface, 0, sizeof d.surface);
    step_world(world, 60);
    expect_near(body_state(world, cube_of(world)).linear_velocity[1], 0, 2 * solved(solver), "speed");
    sadmm_world_destroy(world);
}
END_TEST

/* A callback that changes nothing changes no bit; one that leaves contacts out lets bodies fall. */
START_TEST(it_leaves_contacts_out)
{
    const int solver = _i;
    struct decider d = AS_IT_IS;
    uint64_t hash[2];
    for (int way = 0; way < 2; ++way) {
        sadmm_world *world = asked_world(solver, &d, 0.05, 0.5, 0.3);
        if (way) MUST(world, sadmm_world_set_manifold_callback(world, NULL, NULL));
        step_world(world, 60);
        hash[way] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert(hash[0] == hash[1]);
    d = AS_IT_IS;
    d.off = true;
    sadmm_world *world = asked_world(solver, &d, 0, 0.5, 0);
    const double dt = sadmm_world_settings(world).dt;
    step_world(world, 30);
    expect_near(body_state(world, cube_of(world)).position[2], 0.1 - G * pow(30 * dt, 2) / 2,
                1e-9 + 30 * epsilon_of(solver), "fall");
    ck_assert_int_eq(sadmm_world_contact_count(world), 0);
    ck_assert_int_eq(d.begun, 1);
    sadmm_world_destroy(world);
}
END_TEST

/* A ball passes a platform from below, fast or slowly, and lands on it. */
START_TEST(platforms_have_one_way)
{
    const int solver = _i % SOLVERS;
    const double up = _i / SOLVERS ? 60 : 6;
    struct decider d = AS_IT_IS;
    sadmm_world_def def = bodies_def();
    if (_i / SOLVERS) def.settings.gravity[2] = -400; /* 60 m/s are a metre a step: it is hit within one */
    sadmm_world *world = bodies_world(&def, solver);
    sadmm_body_def body = sadmm_body_def_default();
    body.type = SADMM_BODY_STATIC;
    const sadmm_body_id platform = add_defined(world, &body);
    give_box(world, platform, 3, 3, 0.02, 0.5);
    d.platform = platform.slot;
    sadmm_body_def ball = point_def(0, 0, -0.5);
    ball.linear_velocity[2] = up;
    const sadmm_body_id id = add_defined(world, &ball);
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.size[0] = 0.1;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    MUST(world, sadmm_world_set_manifold_callback(world, decide, &d));
    double top = 0;
    for (int step = 0; step < 300; ++step) {
        step_world(world, 1);
        top = fmax(top, body_state(world, id).position[2]);
    }
    const double dt = def.settings.dt; /* the top is between two steps, and the last one before it half a step's fall */
    expect_near(top, -0.5 - up * up / (2 * def.settings.gravity[2]), -def.settings.gravity[2] * dt * dt / 8 + 1e-3,
                "height");
    expect_near(body_state(world, id).position[2], 0.12, 1e-3, "it rests on top");
    if (_i / SOLVERS) ck_assert_int_gt(d.hits, 0);
    sadmm_world_destroy(world);
}
END_TEST

/* Restitution of a step's contacts, and of hits within a step. */
START_TEST(it_sets_restitution)
{
    const int solver = _i % SOLVERS, within = _i / SOLVERS;
    struct decider d = AS_IT_IS;
    d.restitution = 0.5;
    sadmm_world *world = asked_world(solver, &d, 0.2, 0, within ? 1 : 0);
    const sadmm_body_id id = cube_of(world);
    const double down = sqrt(2 * G * 0.2);
    double up = 0;
    for (int step = 0; step < 60; ++step) {
        step_world(world, 1);
        up = fmax(up, body_state(world, id).linear_velocity[2]);
    }
    ck_assert_int_eq(d.hits > 0, within);
    /* within a step exact, up to what it loses by the step's end; else met a step's fall before or after */
    expect_near(up, 0.5 * down, G * sadmm_world_settings(world).dt * 1.5, "speed after the bounce");
    expect_near(d.speed, down, 2 * G * sadmm_world_settings(world).dt, "speed of approach");
    sadmm_world_destroy(world);
}
END_TEST

/* Numbers out of range end the step, which changes nothing. */
START_TEST(it_is_held_to_ranges)
{
    const int solver = _i;
    struct decider d = AS_IT_IS;
    sadmm_world *world = asked_world(solver, &d, 0, 0.5, 0);
    step_world(world, 2);
    const uint64_t before = state_hash(world);
    const int32_t contacts = sadmm_world_contact_count(world);
    static const struct {
        struct decider d;
        const char *message;
    } wrong[] = {
        {{.friction = 2e6, .restitution = -1}, "manifold->friction = 2e+06: must be in [0, 1e+06]"},
        {{.friction = -1, .restitution = 1.5}, "manifold->restitution = 1.5: must be in [0, 1]"},
        {{.friction = -1, .restitution = -1, .surface = {0, -2e6, 0}},
         "manifold->surface_velocity[1] = -2e+06: must be in [-1e+06, 1e+06]"},
    };
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; ++k) {
        d = wrong[k].d;
        ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_str_eq(sadmm_world_message(world), wrong[k].message);
        ck_assert(state_hash(world) == before);
        ck_assert_int_eq(sadmm_world_contact_count(world), contacts);
    }
    d = AS_IT_IS;
    step_world(world, 1);
    ck_assert_int_eq(d.begun, 0);

    /* between dynamic bodies */
    const sadmm_body_def cube = cube_def(0, 0, 0.3);
    add_cube(world, &cube, 0.5);
    sadmm_body_state s = body_state(world, cube_of(world));
    memset(s.linear_velocity, 0, sizeof s.linear_velocity);
    s.position[0] = 0;
    MUST(world, sadmm_world_set_body_state(world, cube_of(world), &s));
    d.surface[0] = 1;
    ck_assert_int_eq(sadmm_world_step(world), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_str_eq(sadmm_world_message(world),
                     "manifold->surface_velocity = (1, 0, 0): must be 0 between two dynamic bodies");
    sadmm_world_destroy(world);
}
END_TEST

/* A pair begins once; again after its shape has gone and another one has come. */
START_TEST(manifolds_begin)
{
    const int solver = _i;
    struct decider d = AS_IT_IS;
    sadmm_world *world = asked_world(solver, &d, 0, 0.5, 0);
    step_world(world, 3);
    ck_assert_int_eq(d.begun, 1);
    MUST(world, sadmm_world_remove_shape(world, shape_of(world, 1)));
    give_box(world, cube_of(world), 0.1, 0.1, 0.1, 0.5);
    step_world(world, 3);
    ck_assert_int_eq(d.begun, 2);
    size_t size = 0;
    MUST(world, sadmm_world_save(world, NULL, 0, &size));
    void *buffer = malloc(size);
    MUST(world, sadmm_world_save(world, buffer, size, &size));
    MUST(world, sadmm_world_restore(world, buffer, size));
    free(buffer);
    step_world(world, 2); /* the callback stays, and begins anew */
    ck_assert_int_eq(d.begun, 3);
    ck_assert_int_eq(d.calls, 8);
    sadmm_world_destroy(world);
}
END_TEST

/* Where memory runs out the step fails, and the next one goes on as if nothing had been. */
START_TEST(memory_may_run_out)
{
    const int solver = _i;
    struct decider d = AS_IT_IS;
    uint64_t hash[2];
    int failures = 0;
    for (int way = 0; way < 2; ++way) {
        const sadmm_world_def def = bodies_def();
        sadmm_world *world = bodies_world(&def, solver);
        add_belt(world, SADMM_BODY_STATIC, BOX, 0.5, 1);
        const sadmm_body_def cube = cube_def(0, 0, 0.1);
        add_cube(world, &cube, 0.5);
        d = AS_IT_IS;
        d.surface[0] = 1;
        MUST(world, sadmm_world_set_manifold_callback(world, decide, &d));
        bool done = false;
        for (long at = 0; way && !done; ++at) {
            sadmm_test_fail_allocations_after(at);
            const sadmm_status status = sadmm_world_step(world);
            sadmm_test_fail_allocations_after(-1);
            ck_assert(status == SADMM_OK || status == SADMM_ERROR_OUT_OF_MEMORY);
            done = status == SADMM_OK;
            failures += !done;
        }
        step_world(world, way ? 9 : 10);
        hash[way] = state_hash(world);
        sadmm_world_destroy(world);
    }
    ck_assert_int_ge(failures, 5);
    ck_assert(hash[0] == hash[1]);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("decide");
    TCase *cases = tcase_create("decide");
    tcase_set_timeout(cases, 120);
    tcase_add_loop_test(cases, a_surface_drags_by_friction, 0, 2 * KINDS * SOLVERS);
    tcase_add_loop_test(cases, a_surface_is_a_body_that_is_set_back, 0, SOLVERS);
    tcase_add_loop_test(cases, what_rides_is_solved, 0, SOLVERS);
    tcase_add_loop_test(cases, hits_feel_the_surface, 0, SOLVERS);
    tcase_add_loop_test(cases, a_surface_is_a_part_of_the_definition, 0, SOLVERS);
    tcase_add_loop_test(cases, environments_have_it, 0, SOLVERS);
    tcase_add_loop_test(cases, it_sets_friction, 0, SOLVERS);
    tcase_add_loop_test(cases, it_sets_the_surface_velocity, 0, SOLVERS);
    tcase_add_loop_test(cases, it_leaves_contacts_out, 0, SOLVERS);
    tcase_add_loop_test(cases, platforms_have_one_way, 0, 2 * SOLVERS);
    tcase_add_loop_test(cases, it_sets_restitution, 0, 2 * SOLVERS);
    tcase_add_loop_test(cases, it_is_held_to_ranges, 0, SOLVERS);
    tcase_add_loop_test(cases, manifolds_begin, 0, SOLVERS);
    tcase_add_loop_test(cases, memory_may_run_out, 0, SOLVERS);
    suite_add_tcase(suite, cases);
    return RUN_BODIES_SUITE(suite);
}
