/* Joints whose axes and arms turn by more in a step than a step resolves: long steps, fast bodies, distances of next to no
 * length. No mechanism gains energy, whatever its bodies begin with, and none comes to numbers that are not finite. */
#include "core/math/rigid.h"
#include "scene_tools.h"

enum { MOST_BODIES = 8, STEPS = 300, BEGINNINGS = 2 };
static const double dts[] = {0.005, 0.05, 0.2, 0.5, 1};
enum { DTS = sizeof dts / sizeof *dts };

struct mechanism {
    sadmm_world *world;
    sadmm_body_id bodies[MOST_BODIES];
    int count;
    double gravity;
};

static uint64_t state;

/* [-1, 1) */
static double number(void)
{
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(state >> 11) * 0x1p-52 - 1;
}

static void add_body(struct mechanism *m, double x, double moment)
{
    sadmm_body_def def = sadmm_body_def_default();
    def.mass = 1;
    def.inertia[0] = moment, def.inertia[1] = def.inertia[2] = 2 * moment;
    def.position[0] = x;
    MUST(m->world, sadmm_world_add_body(m->world, &def, &m->bodies[m->count++]));
}

static void set_in_motion(struct mechanism *m, double linear, double angular)
{
    for (int b = 0; b < m->count; ++b) {
        sadmm_body_state s = body_state(m->world, m->bodies[b]);
        for (int k = 0; k < 3; ++k)
            s.linear_velocity[k] = linear * number(), s.angular_velocity[k] = angular * number();
        MUST(m->world, sadmm_world_set_body_state(m->world, m->bodies[b], &s));
    }
}

/* a -1: the static world. */
static void join(struct mechanism *m, sadmm_joint_kind kind, int a, int b, double x)
{
    const double place[3] = {x, 0, 0}, along_y[4] = {sqrt(0.5), -sqrt(0.5), 0, 0};
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = kind;
    if (a >= 0) def.body_a = m->bodies[a];
    def.body_b = m->bodies[b];
    MUST(m->world, sadmm_world_place_joint(m->world, &def, place, along_y));
    MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
}

/* Between two bodies, from 0.5 m off the one to as far off the other, whose ends are `length` apart. */
static void connect(struct mechanism *m, double length)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    add_body(m, 0, 0.004);
    add_body(m, 1 + length, 0.004);
    def.kind = SADMM_JOINT_DISTANCE;
    def.body_a = m->bodies[0], def.body_b = m->bodies[1];
    def.position_a[0] = 0.5, def.position_b[0] = -0.5;
    MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
}

static void pendulum(struct mechanism *m, sadmm_joint_kind kind)
{
    add_body(m, 0.5, 0.01);
    join(m, kind, -1, 0, 0);
}

static void chain(struct mechanism *m, sadmm_joint_kind kind, int links)
{
    for (int k = 0; k < links; ++k) {
        add_body(m, 0.1 + 0.2 * k, 0.002);
        join(m, kind, k - 1, k, 0.2 * k);
    }
}

/* In the air. */
static void pair(struct mechanism *m)
{
    add_body(m, 0, 0.01);
    add_body(m, 1, 0.01);
    join(m, SADMM_JOINT_SPHERICAL, 0, 1, 0.5);
}

/* A point of a body in a plane. */
static void in_plane(struct mechanism *m)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    add_body(m, 0.5, 0.01);
    def.kind = SADMM_JOINT_CUSTOM;
    def.locks = 1;
    def.body_b = m->bodies[0];
    def.position_b[0] = -0.5, def.position_b[1] = 0.2;
    MUST(m->world, sadmm_world_add_joint(m->world, &def, NULL));
}

static void make(struct mechanism *m, int which)
{
    switch (which) {
    case 0: pendulum(m, SADMM_JOINT_REVOLUTE); break;
    case 1: pendulum(m, SADMM_JOINT_SPHERICAL); break;
    case 2: pendulum(m, SADMM_JOINT_UNIVERSAL); break;
    case 3: chain(m, SADMM_JOINT_REVOLUTE, 2); break;
    case 4: chain(m, SADMM_JOINT_SPHERICAL, MOST_BODIES); break;
    case 5: pair(m); break;
    case 6: in_plane(m); break;
    case 7: connect(m, 0.1); break;
    case 8: connect(m, 1e-3); break;
    case 9: connect(m, 1e-9); break;
    default: connect(m, 0); break;
    }
}
enum { MECHANISMS = 11 };

static double energy(struct mechanism *m)
{
    double sum = 0;
    for (int b = 0; b < m->count; ++b) {
        const sadmm_body_def d = body_def(m->world, m->bodies[b]);
        const vec3 spin = m3_tmul(q_matrix(q_load(d.orientation)), v3_load(d.angular_velocity));
        sum += d.mass * (v3_norm2(v3_load(d.linear_velocity)) / 2 + m->gravity * d.position[2]) +
               (d.inertia[0] * spin.x * spin.x + d.inertia[1] * spin.y * spin.y + d.inertia[2] * spin.z * spin.z) / 2;
    }
    return sum;
}

/* Of the energy that there is in motion, or to fall by a link's metre. */
static double gain(int which, double dt, bool heavy, int beginning)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.gravity[2] = heavy ? -9.81 : 0;
    struct mechanism m = {.world = create_world(&def), .gravity = -def.settings.gravity[2]};
    state = (uint64_t)(100 * which + beginning);
    make(&m, which);
    set_in_motion(&m, 1, 3);
    const double first = energy(&m), size = first + m.gravity * m.count;
    double most = first;
    for (int step = 0; step < STEPS; ++step) {
        step_world(m.world, 1);
        most = fmax(most, energy(&m));
    }
    sadmm_world_destroy(m.world);
    return (most - first) / size;
}

/* What there is left: at 5 ms rows turn by less than a step resolves, and the error of the step may be either way; a fall in
 * long steps is off by half a step's, m g^2 dt^2 / 8 a body, once. */
START_TEST(no_mechanism_gains_energy)
{
    for (int d = 0; d < DTS; ++d)
        for (int heavy = 0; heavy < 2; ++heavy)
            for (int beginning = 0; beginning < BEGINNINGS; ++beginning) {
                const double most = gain(_i, dts[d], heavy, beginning),
                             allowed = 0.05 + (heavy ? 9.81 * dts[d] * dts[d] / 8 : 0);
                ck_assert_msg(most < allowed, "mechanism %d, dt %g, gravity %d, beginning %d: gains %g of its energy",
                              _i, dts[d], heavy, beginning, most);
            }
}
END_TEST

/* A wheel turns about its own axle: nothing is off its axis, and it goes on for ever, by whatever angle a step. */
START_TEST(a_balanced_wheel_goes_on)
{
    for (int d = 0; d < DTS; ++d) {
        sadmm_world_def def = sadmm_world_def_default();
        def.settings.dt = dts[d];
        def.settings.gravity[2] = 0;
        struct mechanism m = {.world = create_world(&def)};
        add_body(&m, 0, 0.01);
        MUST(m.world, sadmm_world_set_body_mass(m.world, m.bodies[0], 1, (double[]){0.01, 0.01, 0.01}));
        join(&m, SADMM_JOINT_REVOLUTE, -1, 0, 0);
        sadmm_body_state s = body_state(m.world, m.bodies[0]);
        s.angular_velocity[1] = 40;
        MUST(m.world, sadmm_world_set_body_state(m.world, m.bodies[0], &s));
        step_world(m.world, STEPS);
        ck_assert_double_eq_tol(body_state(m.world, m.bodies[0]).angular_velocity[1], 40, 1e-9); /* rounding */
        sadmm_world_destroy(m.world);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("turning");
    TCase *cases = tcase_create("turning");
    tcase_set_timeout(cases, 60);
    tcase_add_loop_test(cases, no_mechanism_gains_energy, 0, MECHANISMS);
    tcase_add_test(cases, a_balanced_wheel_goes_on);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
