/* Rims are round: a body whose centre of mass is over a round support stays, one whose is not tips, to a thousandth of
 * the radius, whichever way it is turned (collision/convex/convex_clip.h). */
#include "core/math/quat.h"
#include "fixed_work.h"
#include "scene_tools.h"

static const double INSIDE = 1e-3; /* of the radius */
enum { DRAWS = 6, STEPS = 600 };

static uint64_t state;

static double between(double low, double high)
{
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * ((double)(state >> 11) * 0x1p-53);
}

static sadmm_world *open_world(sadmm_precision precision)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = precision;
    def.settings.iterations = 40; /* the impulses' error is below the margin */
    def.settings.threads = 1;
    return create_world(&def);
}

static void turn_about_z(double angle, double q[4])
{
    q[0] = cos(angle / 2), q[3] = sin(angle / 2);
    q[1] = q[2] = 0;
}

static sadmm_shape_def solid(sadmm_shape_type type, double x, double y, double z)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = type;
    shape.size[0] = x, shape.size[1] = y, shape.size[2] = z;
    return shape;
}

/* shape: where it is in the body, whose centre of mass is at `position`. */
static sadmm_body_id add(sadmm_world *world, sadmm_body_type type, const sadmm_shape_def *shape,
                         const double position[3], double angle)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_mass mass;
    sadmm_body_id id;
    def.type = type;
    if (type == SADMM_BODY_DYNAMIC) {
        ck_assert_int_eq(sadmm_shape_mass(shape, 1000, &mass), SADMM_OK);
        def.mass = mass.mass;
        memcpy(def.inertia, mass.inertia, sizeof def.inertia);
    }
    memcpy(def.position, position, sizeof def.position);
    turn_about_z(angle, def.orientation);
    MUST(world, sadmm_world_add_body(world, &def, &id));
    MUST(world, sadmm_world_add_shape(world, id, shape, NULL));
    return id;
}

/* By how much it comes down, m. */
static double comes_down(sadmm_world *world, sadmm_body_id body)
{
    const double z = body_state(world, body).position[2];
    step_world(world, STEPS);
    return z - body_state(world, body).position[2];
}

/* ---- on a round table ------------------------------------------------------------------------------------------- */

enum { TABLE_CYLINDER, TABLE_CONE, TABLE_HEAVY, TABLES };
enum { BODY_BOX, BODY_CYLINDER, BODY_PLANK, BODY_CONE, BODIES };

static double falls_from_table(int table, int kind, double radius, double share, sadmm_precision precision)
{
    const double a = 0.1, phi = between(-M_PI, M_PI), yaw = between(-M_PI, M_PI), turn = between(-M_PI, M_PI);
    sadmm_world *world = open_world(precision);
    sadmm_shape_def top = solid(table == TABLE_CONE ? SADMM_SHAPE_CONE : SADMM_SHAPE_CYLINDER, radius, 0.25, 0);
    sadmm_shape_def shape = kind == BODY_BOX        ? solid(SADMM_SHAPE_BOX, a, a, a / 2)
                            : kind == BODY_CYLINDER ? solid(SADMM_SHAPE_CYLINDER, a, a / 2, 0)
                            : kind == BODY_PLANK    ? solid(SADMM_SHAPE_BOX, 3 * a, 0.3 * a, 0.1 * a)
                                                    : solid(SADMM_SHAPE_CONE, a, a / 2, 0);
    const double high = kind == BODY_PLANK ? 0.1 * a : a / 2, at[3] = {0, 0, -0.25},
                 place[3] = {share * radius * cos(phi), share * radius * sin(phi), high};
    if (table == TABLE_CONE) top.orientation[0] = 0, top.orientation[1] = 1; /* its base is up */
    if (table == TABLE_HEAVY) { /* it stands by itself and gives way by a share of nothing */
        sadmm_shape_def ground = solid(SADMM_SHAPE_PLANE, 0, 0, 0);
        const double below[3] = {0, 0, -0.5};
        sadmm_body_id id;
        sadmm_body_def def = sadmm_body_def_default();
        add(world, SADMM_BODY_STATIC, &ground, below, 0);
        def.mass = 1e5;
        def.inertia[0] = def.inertia[1] = def.inertia[2] = 1e4;
        def.position[2] = -0.25;
        turn_about_z(turn, def.orientation);
        MUST(world, sadmm_world_add_body(world, &def, &id));
        MUST(world, sadmm_world_add_shape(world, id, &top, NULL));
    } else {
        add(world, SADMM_BODY_STATIC, &top, at, turn);
    }
    if (kind == BODY_CONE) { /* its centre of mass is a quarter up */
        sadmm_mass mass;
        ck_assert_int_eq(sadmm_shape_mass(&shape, 1000, &mass), SADMM_OK);
        ck_assert_int_eq(sadmm_mass_pose_in_body(&mass, shape.position, shape.orientation), SADMM_OK);
    }
    const sadmm_body_id body = add(world, SADMM_BODY_DYNAMIC, &shape,
                                   (double[]){place[0], place[1], kind == BODY_CONE ? a / 4 : place[2]}, yaw);
    const double down = comes_down(world, body);
    sadmm_world_destroy(world);
    return down;
}

START_TEST(a_body_on_a_round_table)
{
    const int table = _i / BODIES, kind = _i % BODIES;
    static const double radii[] = {0.5, 0.12};
    state = (uint64_t)_i + 1;
    for (int k = 0; k < DRAWS; ++k)
        for (int out = 0; out < 2; ++out) {
            const double radius = radii[k % 2], share = out ? 1 + INSIDE : 1 - INSIDE,
                         down = falls_from_table(table, kind, radius, share, k % 4 == 3 ? SADMM_F32 : SADMM_F64);
            /* what stays does not move, but for what iterations leave; what tips has done so in 3 s */
            ck_assert_msg(out ? down > 1e-3 : fabs(down) < 1e-5, "radius %g, draw %d, %s: comes down by %g m", radius,
                          k, out ? "outside" : "inside", down);
        }
}
END_TEST

/* ---- on a round foot --------------------------------------------------------------------------------------------- */

enum { ON_PLANE, ON_BOX, ON_MESH, ON_TABLE, GROUNDS };

static double falls_on_foot(int ground, bool cone, double radius, double share, sadmm_precision precision)
{
    const double phi = between(-M_PI, M_PI), yaw = between(-M_PI, M_PI), high = radius / 2, none[3] = {0, 0, 0};
    sadmm_world *world = open_world(precision);
    sadmm_shape_def floor = solid(ground == ON_BOX     ? SADMM_SHAPE_BOX
                                  : ground == ON_TABLE ? SADMM_SHAPE_CYLINDER
                                  : ground == ON_MESH  ? SADMM_SHAPE_MESH
                                                       : SADMM_SHAPE_PLANE,
                                  5, 5, 0.5),
                    foot = solid(cone ? SADMM_SHAPE_CONE : SADMM_SHAPE_CYLINDER, radius, high, 0);
    sadmm_mesh *mesh = NULL;
    if (ground == ON_BOX) floor.position[2] = -0.5;
    if (ground == ON_TABLE) floor.size[1] = 0.5, floor.position[2] = -0.5;
    if (ground == ON_MESH) { /* a fan about a place that is not the foot's */
        static const double vertices[] = {0.03, 0.02, 0, 5, 0, 0, 0, 5, 0, -5, 0, 0, 0, -5, 0};
        static const int32_t triangles[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1};
        sadmm_mesh_def def = sadmm_mesh_def_default();
        def.vertices = vertices, def.vertex_count = 5;
        def.triangles = triangles, def.triangle_count = 4;
        ck_assert_int_eq(sadmm_mesh_create(&def, &mesh), SADMM_OK);
        floor.mesh = mesh;
    }
    add(world, SADMM_BODY_STATIC, &floor, none, 0);
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id body;
    def.mass = 1;
    def.inertia[0] = def.inertia[1] = def.inertia[2] = 0.4 * radius * radius;
    def.position[2] = high;
    turn_about_z(yaw, def.orientation);
    foot.position[0] = -share * radius * cos(phi), foot.position[1] = -share * radius * sin(phi);
    MUST(world, sadmm_world_add_body(world, &def, &body));
    MUST(world, sadmm_world_add_shape(world, body, &foot, NULL));
    const double down = comes_down(world, body);
    sadmm_world_destroy(world);
    sadmm_mesh_destroy(mesh);
    return down;
}

START_TEST(a_body_on_a_round_foot)
{
    const int ground = _i / 2;
    static const double radii[] = {0.2, 0.05};
    state = (uint64_t)_i + 100;
    for (int k = 0; k < DRAWS; ++k)
        for (int out = 0; out < 2; ++out) {
            const double radius = radii[k % 2], share = out ? 1 + INSIDE : 1 - INSIDE,
                         down = falls_on_foot(ground, _i % 2, radius, share, k % 4 == 3 ? SADMM_F32 : SADMM_F64);
            ck_assert_msg(out ? down > 1e-3 : fabs(down) < 1e-5, "radius %g, draw %d, %s: comes down by %g m", radius,
                          k, out ? "outside" : "inside", down);
        }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("rims");
    TCase *cases = tcase_create("rims");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, a_body_on_a_round_table, 0, TABLES * BODIES);
    tcase_add_loop_test(cases, a_body_on_a_round_foot, 0, 2 * GROUNDS);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
