/* Bodies on meshes and heightfields: flat ground is flat however it is divided, edges hold, nothing passes. */
#include <check.h>

#include "core/base/memory.h"
#include "core/math/quat.h"
#include "fixed_work.h"
#include "hull_tools.h"
#include "mesh_tools.h"
#include "scene_tools.h"

static const double dt = 0.005, side = 0.2; /* s; of bodies, m */

static sadmm_world *make_world(void)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.iterations = 200;
    return create_world(&def);
}

static sadmm_body_id add_ground(sadmm_world *world, sadmm_body_type type)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.type = type;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

/* mesh NULL: a plane. */
static sadmm_shape_id add_surface(sadmm_world *world, sadmm_body_id body, const sadmm_mesh *mesh, double friction)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_shape_id id;
    def.type = mesh ? SADMM_SHAPE_MESH : SADMM_SHAPE_PLANE;
    def.mesh = mesh;
    def.friction = friction;
    MUST(world, sadmm_world_add_shape(world, body, &def, &id));
    return id;
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

enum form { BOX, SPHERE, LYING_CAPSULE, STANDING_CAPSULE, HULL, FORMS };

static sadmm_hull *octahedron(void)
{
    struct cloud c = {.count = 0};
    for (int k = 0; k < 6; ++k) {
        double x[3] = {0, 0, 0};
        x[k / 2] = (k % 2 ? 1 : -1) * side;
        add_point(&c, x[0], x[1], x[2]);
    }
    sadmm_hull *hull = NULL;
    ck_assert_msg(try_hull(&c, 1e-6, &hull) == SADMM_OK, "%s", sadmm_last_message());
    return hull;
}

/* A body of the form at rest on z = 0, moved up by `above`; turned about z. */
static sadmm_body_id add_form(sadmm_world *world, enum form form, double x, double y, double above, double turn,
                              double friction)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_body_id id;
    sadmm_mass mass;
    sadmm_hull *hull = form == HULL ? octahedron() : NULL;
    const double about_z[4] = {cos(turn / 2), 0, 0, sin(turn / 2)}, r = side / 2;
    double height = r, lay[4] = {1, 0, 0, 0};
    shape.friction = friction;
    switch (form) {
    case BOX:
        shape.type = SADMM_SHAPE_BOX;
        shape.size[0] = shape.size[1] = shape.size[2] = r;
        break;
    case SPHERE:
        shape.type = SADMM_SHAPE_SPHERE;
        shape.size[0] = r;
        break;
    case LYING_CAPSULE:
    case STANDING_CAPSULE:
        shape.type = SADMM_SHAPE_CAPSULE;
        shape.size[0] = r / 2;
        shape.size[1] = r;
        height = form == LYING_CAPSULE ? r / 2 : 1.5 * r;
        if (form == LYING_CAPSULE) lay[0] = lay[2] = sqrt(0.5);
        break;
    case HULL: /* a face of the octahedron, whose normal is (1, 1, 1) / sqrt(3), down */
        shape.type = SADMM_SHAPE_HULL;
        shape.hull = hull;
        height = side / sqrt(3);
        q_store(q_normalize((quat){1 - 1 / sqrt(3), -1 / sqrt(3), 1 / sqrt(3), 0}), lay);
        break;
    default: break;
    }
    ck_assert_int_eq(sadmm_shape_mass(&shape, 500, &mass), SADMM_OK);
    body.mass = mass.mass;
    memcpy(body.inertia, mass.inertia, sizeof body.inertia);
    body.position[0] = x;
    body.position[1] = y;
    body.position[2] = height + above;
    q_store(q_normalize(q_mul(q_load(about_z), q_load(lay))), body.orientation);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    sadmm_hull_destroy(hull);
    return id;
}

static void set_velocity(sadmm_world *world, sadmm_body_id id, double vx, double vy)
{
    sadmm_body_state state = body_state(world, id);
    state.linear_velocity[0] = vx;
    state.linear_velocity[1] = vy;
    MUST(world, sadmm_world_set_body_state(world, id, &state));
}

/* The contacts of the last step: how far normals are from `up`, the sum of the impulses along y. */
static void inspect_contacts(sadmm_world *world, const double up[3], double *tilt, double *sideways)
{
    const int32_t count = sadmm_world_contact_count(world);
    *tilt = *sideways = 0;
    for (int32_t i = 0; i < count; ++i) {
        sadmm_contact c;
        MUST(world, sadmm_world_contacts(world, i, 1, &c));
        /* towards the ground: from the body, a, to the mesh, b; of a plane the other way round */
        const double sign = c.normal[2] > 0 ? 1 : -1;
        for (int k = 0; k < 3; ++k) *tilt = fmax(*tilt, fabs(sign * c.normal[k] - up[k]));
        *sideways += sign * c.impulse[1];
    }
}

/* ---- flat ground ------------------------------------------------------------------------------------------------- */

enum { GROUNDS = 4 };
static sadmm_mesh *flat_ground(int kind)
{
    if (kind == 0) {
        static double z[41 * 41];
        const sadmm_heightfield_def def = {sizeof def, z, 41, 41, {0.17, 0.19}};
        sadmm_mesh *mesh = NULL;
        ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
        return mesh;
    }
    /* coarser than bodies, as they are, finer */
    struct soup *s = kind == 1   ? soup_ground(2, 2, 7, 0, 1, soup_flat)
                     : kind == 2 ? soup_ground(31, 31, 0.23, 0.24, 7, soup_flat)
                                 : soup_ground(121, 121, 0.05, 0.24, 9, soup_flat);
    sadmm_mesh *mesh = soup_mesh(s);
    free(s);
    return mesh;
}

/* Sliding, with friction and without, over flat ground in triangles: no normal but the plane's, no impulse sideways,
 * and the way that a plane would give. */
START_TEST(flat_ground_is_a_plane)
{
    const enum form form = (enum form)(_i % FORMS);
    const double friction = _i / FORMS ? 0.3 : 0, up[3] = {0, 0, 1};
    for (int kind = 0; kind < GROUNDS; ++kind) {
        sadmm_mesh *mesh = flat_ground(kind);
        sadmm_world *worlds[2] = {make_world(), make_world()};
        sadmm_body_id ids[2];
        for (int w = 0; w < 2; ++w) {
            add_surface(worlds[w], add_ground(worlds[w], SADMM_BODY_STATIC), w ? mesh : NULL, friction);
            ids[w] = add_form(worlds[w], form, -1.02, 0.013, 0, 0, friction);
            set_velocity(worlds[w], ids[w], 2, 0);
        }
        for (int i = 0; i < 200; ++i) {
            double tilt, sideways;
            step_world(worlds[0], 1);
            step_world(worlds[1], 1);
            inspect_contacts(worlds[1], up, &tilt, &sideways);
            /* the normal of a triangle is one of rounded numbers */
            ck_assert_msg(tilt <= 2e-15, "form %d on ground %d: step %d: a normal is %g off", (int)form, kind, i, tilt);
            /* a capsule that falls over from its end makes much of little */
            ck_assert_msg(fabs(sideways) < (form == STANDING_CAPSULE ? 1e-7 : 1e-9),
                          "form %d on ground %d: step %d: %g N s sideways", (int)form, kind, i, sideways);
            if (form != STANDING_CAPSULE || i < 20) ck_assert_int_gt(sadmm_world_contact_count(worlds[1]), 0);
        }
        const sadmm_body_state on_plane = body_state(worlds[0], ids[0]), on_mesh = body_state(worlds[1], ids[1]);
        /* Both solve the same contact problem, on the mesh with other points, to the solver's accuracy: 200 iterations
         * leave less than 1e-7 of the momentum. A capsule that stands on its end falls over: small causes grow. */
        const double most = form == STANDING_CAPSULE ? 1e-3 : 1e-6;
        for (int k = 0; k < 3; ++k) {
            ck_assert_double_eq_tol(on_mesh.position[k], on_plane.position[k], most);
            ck_assert_double_eq_tol(on_mesh.linear_velocity[k], on_plane.linear_velocity[k], 10 * most);
        }
        sadmm_world_destroy(worlds[0]);
        sadmm_world_destroy(worlds[1]);
        sadmm_mesh_destroy(mesh);
    }
}
END_TEST

/* All forms at once, thrown onto the ground: they bounce, tumble and roll, and stay on it. */
START_TEST(thrown_bodies_stay_on_the_ground)
{
    for (int kind = 0; kind < GROUNDS; ++kind) {
        sadmm_mesh *mesh = flat_ground(kind);
        sadmm_world *world = make_world();
        sadmm_body_id ids[25];
        add_surface(world, add_ground(world, SADMM_BODY_STATIC), mesh, 0.5);
        for (int i = 0; i < 25; ++i) {
            ids[i] = add_form(world, (enum form)(i % FORMS), 0.45 * (i % 5) - 0.9, 0.45 * (i / 5) - 0.9, 0.3 + 0.02 * i,
                              0.3 * i, 0.5);
            sadmm_body_state state = body_state(world, ids[i]);
            for (int k = 0; k < 3; ++k) state.angular_velocity[k] = 5 * sin(3.0 * i + k);
            MUST(world, sadmm_world_set_body_state(world, ids[i], &state));
        }
        double deepest = 0;
        for (int i = 0; i < 500; ++i) {
            step_world(world, 1);
            deepest = fmax(deepest, world_report(world).penetration_max);
        }
        for (int i = 0; i < 25; ++i) {
            const sadmm_body_state state = body_state(world, ids[i]);
            /* the lowest that one can be is the lying capsule, 1/4 of the side, the highest a capsule on its
             * end, 3/4 */
            ck_assert_double_gt(state.position[2], 0.24 * side);
            ck_assert_double_lt(state.position[2], 0.8 * side);
        }
        ck_assert_double_lt(deepest, 0.05 * side); /* an impact of 3 m/s goes 15 mm a step; most of that is held */
        sadmm_world_destroy(world);
        sadmm_mesh_destroy(mesh);
    }
}
END_TEST

/* ---- edges ------------------------------------------------------------------------------------------------------- */

/* A box hangs over the edge of a plate by less than half: it stays, whatever the triangles of the plate's sides, and is
 * not pushed off through them. */
START_TEST(what_hangs_over_an_edge_stays)
{
    static const int divided[] = {1, 4, 16, 40};
    static const double over[] = {0.45, 0.1, 0.01, 0.001}; /* of the side, beyond the edge */
    const double half[3] = {0.5, 0.5, 0.05};
    for (size_t d = 0; d < sizeof divided / sizeof *divided; ++d)
        for (size_t o = 0; o < sizeof over / sizeof *over; ++o) {
            struct soup *s = soup_box(half, divided[d]);
            sadmm_mesh *mesh = soup_mesh(s);
            sadmm_world *world = make_world();
            add_surface(world, add_ground(world, SADMM_BODY_STATIC), mesh, 0.5);
            const sadmm_body_id id =
                add_form(world, BOX, half[0] - side / 2 + over[o] * side, 0.07, half[2] - 2e-4 * side, 0, 0.5);
            const sadmm_body_state before = body_state(world, id);
            step_world(world, 200);
            const sadmm_body_state after = body_state(world, id);
            for (int k = 0; k < 3; ++k) /* it begins 0.04 mm in the plate, and may rise by that */
                ck_assert_msg(fabs(after.position[k] - before.position[k]) < 3e-4 * side,
                              "divided by %d, over by %g: moved by %g along %d", divided[d], over[o],
                              after.position[k] - before.position[k], k);
            ck_assert_double_lt(v3_norm(v3_load(after.linear_velocity)), 1e-8);
            sadmm_world_destroy(world);
            sadmm_mesh_destroy(mesh);
            free(s);
        }
}
END_TEST

static double roof(double x, double y)
{
    (void)y;
    return -0.5 * fabs(x);
}
static double trough(double x, double y)
{
    (void)y;
    return 0.5 * fabs(x);
}

/* On the ridge of a roof a box balances on a line, in a trough it touches both sides; both with normals that the
 * surface has there. */
START_TEST(ridges_and_troughs_hold)
{
    for (int kind = 0; kind < 2; ++kind) {
        struct soup *s = soup_ground(21, 21, 0.1, 0, 1, kind ? trough : roof);
        sadmm_mesh *mesh = soup_mesh(s);
        sadmm_world *world = make_world();
        add_surface(world, add_ground(world, SADMM_BODY_STATIC), mesh, 0.5);
        const sadmm_body_id id = add_form(world, BOX, 0, 0.03, kind ? 0.25 * side + 0.001 : 0, 0, 0.5);
        step_world(world, 300);
        const sadmm_body_state state = body_state(world, id);
        /* roof: side / 2 over the ridge; trough: the lower edges, side / 2 from the middle, at slope 1 / 2 */
        const double expected = kind ? side / 2 + 0.25 * side : side / 2;
        ck_assert_double_eq_tol(state.position[2], expected, 1e-3 * side);
        ck_assert_double_lt(v3_norm(v3_load(state.linear_velocity)), 1e-6);
        for (int32_t i = 0; i < sadmm_world_contact_count(world); ++i) {
            sadmm_contact c;
            MUST(world, sadmm_world_contacts(world, i, 1, &c));
            const double down = fabs(c.normal[2]), slope = 1 / sqrt(1.25);
            if (kind) ck_assert_double_eq_tol(down, slope, 1e-9);
            else ck_assert_double_eq_tol(down, 1, 1e-6); /* the box may lean by so much */
        }
        sadmm_world_destroy(world);
        sadmm_mesh_destroy(mesh);
        free(s);
    }
}
END_TEST

/* A ball that rolls over a ball of triangles meets its edges and corners: the path is smooth. One that slides off
 * without friction keeps its energy. */
START_TEST(a_ball_slides_over_a_ball)
{
    const double size[3] = {1, 1, 1};
    struct soup *s = soup_ball(size, 24);
    sadmm_mesh *mesh = soup_mesh(s);
    sadmm_world *world = make_world();
    add_surface(world, add_ground(world, SADMM_BODY_STATIC), mesh, 0);
    const sadmm_body_id id = add_form(world, SPHERE, 0, 0, 1, 0, 0);
    set_velocity(world, id, 1, 0.3);
    const double mass = body_def(world, id).mass;
    double last = 0;
    for (int i = 0; i < 100; ++i) {
        step_world(world, 1);
        const sadmm_body_state state = body_state(world, id);
        const vec3 x = v3_load(state.position), v = v3_load(state.linear_velocity);
        const double energy = mass * (v3_norm2(v) / 2 + 9.81 * x.z), r = v3_norm(x);
        if (i == 0) last = energy;
        /* the triangles are up to 1 - cos(half of 4 degrees) = 1e-3 inside the ball, corners are on it */
        ck_assert_double_gt(r, 1 + side / 2 - 2.5e-3);
        /* where a facet ends the velocity turns, and loses what stands on the new one: (v sin 4 degrees)^2 / 2 of
         * 1 + 4 J/kg, on about 15 facets; it never gains */
        ck_assert_double_lt(energy, last * (1 + 1e-4));
        ck_assert_double_gt(energy, last * (1 - 2e-2));
    }
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);
    free(s);
}
END_TEST

/* ---- motion ------------------------------------------------------------------------------------------------------ */

static double hilly(double x, double y) { return 0.05 * sin(2 * x) * cos(1.5 * y); }

/* Small bodies at 300 m/s do not pass: 1.5 m a step, with a surface that has no thickness. (Hills are low: what slides
 * on at 60 m/s goes 0.3 m a step along the plane that it lies on, and would be in the next hill.) */
START_TEST(nothing_fast_passes)
{
    double z[61 * 61];
    struct soup *s = soup_ground(61, 61, 0.1, 0, 1, hilly);
    for (int v = 0; v < 61 * 61; ++v) z[v] = s->x[3 * v + 2];
    const sadmm_heightfield_def def = {sizeof def, z, 61, 61, {0.1, 0.1}};
    for (int kind = 0; kind < 2; ++kind) {
        sadmm_mesh *mesh = kind ? soup_mesh(s) : NULL;
        if (!kind) ck_assert_int_eq(sadmm_heightfield_create(&def, &mesh), SADMM_OK);
        sadmm_world *world = make_world();
        add_surface(world, add_ground(world, SADMM_BODY_STATIC), mesh, 0.5);
        sadmm_body_id ids[40];
        for (int i = 0; i < 40; ++i) {
            sadmm_body_state state;
            ids[i] = add_form(world, (enum form)(i % FORMS), 1.5 * sin(i), 1.5 * cos(1.3 * i), 2 + 0.1 * i, i, 0.5);
            state = body_state(world, ids[i]);
            state.linear_velocity[0] = 60 * sin(2.0 * i);
            state.linear_velocity[1] = 60 * cos(3.0 * i);
            state.linear_velocity[2] = -300;
            state.angular_velocity[0] = 10 * sin(5.0 * i);
            MUST(world, sadmm_world_set_body_state(world, ids[i], &state));
        }
        for (int i = 0; i < 100; ++i) {
            step_world(world, 1);
            for (int b = 0; b < 40; ++b) {
                const sadmm_body_state state = body_state(world, ids[b]);
                const double *x = state.position;
                if (fabs(x[0]) > 2.9 || fabs(x[1]) > 2.9) continue; /* it has left the ground */
                ck_assert_msg(x[2] > hilly(x[0], x[1]), "body %d of form %d on ground %d, step %d: %g m below", b,
                              b % FORMS, kind, i, hilly(x[0], x[1]) - x[2]);
            }
        }
        sadmm_world_destroy(world);
        sadmm_mesh_destroy(mesh);
    }
    free(s);
}
END_TEST

/* A mesh that the caller moves carries what lies on it. */
START_TEST(a_moved_mesh_carries)
{
    const double half[3] = {1, 1, 0.1};
    struct soup *s = soup_box(half, 7);
    sadmm_mesh *mesh = soup_mesh(s);
    sadmm_world *world = make_world();
    const sadmm_body_id lift = add_ground(world, SADMM_BODY_KINEMATIC);
    add_surface(world, lift, mesh, 0.8);
    sadmm_body_id ids[FORMS - 1];
    for (int i = 0; i < FORMS - 1; ++i) { /* all but the one that falls over */
        const enum form form = (enum form)(i < STANDING_CAPSULE ? i : i + 1);
        ids[i] = add_form(world, form, 0.5 * (i % 2) - 0.25, 0.5 * (i / 2) - 0.25, half[2], 0, 0.8);
    }
    sadmm_body_state state = body_state(world, lift);
    state.linear_velocity[2] = 1;
    MUST(world, sadmm_world_set_body_state(world, lift, &state));
    step_world(world, 200);
    for (int i = 0; i < FORMS - 1; ++i) {
        state = body_state(world, ids[i]);
        /* 200 iterations a step leave less than 1e-7 of the momentum; after 1 s the lowest is 1/4 of the side above */
        ck_assert_double_eq_tol(state.linear_velocity[2], 1, 1e-6);
        ck_assert_double_gt(state.position[2], 1 + half[2] + 0.24 * side);
    }
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);
    free(s);
}
END_TEST

/* ---- definitions ------------------------------------------------------------------------------------------------- */

START_TEST(meshes_are_read_back_and_shared)
{
    sadmm_mesh *mesh = flat_ground(2);
    sadmm_world *world = make_world();
    sadmm_shape_def def = sadmm_shape_def_default(), read;
    sadmm_shape_id id;
    def.type = SADMM_SHAPE_MESH;
    def.position[0] = 0.25;
    def.orientation[0] = def.orientation[1] = sqrt(0.5);
    def.mesh = mesh;
    MUST(world, sadmm_world_add_shape(world, add_ground(world, SADMM_BODY_STATIC), &def, &id));
    ck_assert_uint_eq(mesh->uses, 2);
    sadmm_mesh_destroy(mesh);
    MUST(world, sadmm_world_shape_def(world, id, &read, NULL));
    ck_assert_ptr_eq(read.mesh, mesh);
    ck_assert_ptr_null(read.hull);
    ck_assert(read.type == SADMM_SHAPE_MESH && read.size[0] == mesh->half[0] && read.position[0] == 0.25);
    ck_assert_double_eq_tol(read.orientation[1], sqrt(0.5), 1e-15);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(meshes_where_they_cannot_be_are_refused)
{
    sadmm_mesh *mesh = flat_ground(1);
    sadmm_world *world = make_world();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_body_id dynamic, ground = add_ground(world, SADMM_BODY_STATIC);
    sadmm_mass mass;
    body.mass = body.inertia[0] = body.inertia[1] = body.inertia[2] = 1;
    MUST(world, sadmm_world_add_body(world, &body, &dynamic));
    def.type = SADMM_SHAPE_MESH;
    ck_assert_int_eq(sadmm_world_add_shape(world, ground, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), "def->mesh = NULL: must be given"));
    def.mesh = mesh;
    ck_assert_int_eq(sadmm_world_add_shape(world, dynamic, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), "only static and kinematic bodies may have it"));
    ck_assert_int_eq(sadmm_shape_mass(&def, 1000, &mass), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(sadmm_last_message(), "a plane or a mesh has no mass"));
    def.type = SADMM_SHAPE_SPHERE;
    def.size[0] = 1;
    ck_assert_int_eq(sadmm_world_add_shape(world, ground, &def, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(sadmm_world_message(world), "def->mesh: must be NULL"));
    ck_assert_uint_eq(mesh->uses, 1);
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("mesh_world");
    TCase *cases = tcase_create("mesh_world");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, flat_ground_is_a_plane, 0, 2 * FORMS);
    tcase_add_test(cases, thrown_bodies_stay_on_the_ground);
    tcase_add_test(cases, what_hangs_over_an_edge_stays);
    tcase_add_test(cases, ridges_and_troughs_hold);
    tcase_add_test(cases, a_ball_slides_over_a_ball);
    tcase_add_test(cases, nothing_fast_passes);
    tcase_add_test(cases, a_moved_mesh_carries);
    tcase_add_test(cases, meshes_are_read_back_and_shared);
    tcase_add_test(cases, meshes_where_they_cannot_be_are_refused);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
