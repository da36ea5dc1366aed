/* Springs and dampers of joints at the ends of what they may be: any stiffness is stable at any step, one without bound
 * is the hard joint, none is nothing; along a line between two points, along axes, and in all six coordinates. */
#include "core/math/rigid.h"
#include "scene_tools.h"

static const double UNIT[4] = {1, 0, 0, 0};
static const sadmm_body_id WORLD = {0, 0};

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
} solvers[] = {{SADMM_BACKEND_CPU, SADMM_F64}, {SADMM_BACKEND_REF, SADMM_F64}, {SADMM_BACKEND_CPU, SADMM_F32}};
enum { SOLVERS = 3 };

static sadmm_world *new_world(int solver, double dt, int iterations)
{
    sadmm_world_def def = sadmm_world_def_default();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.iterations = iterations;
    return create_world(&def);
}

static sadmm_body_id add_body(sadmm_world *world, double x, double mass)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.mass = mass;
    def.inertia[0] = 0.01 * mass, def.inertia[1] = 0.015 * mass, def.inertia[2] = 0.02 * mass;
    def.position[0] = x;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

/* What springs can hang a body by, and the hard joint that they become. */
enum kind { POINT, AXIS, SIX, KINDS };

/* From (x, 0, 0), between a and b whose centre is 0.3 m on; stiffness INFINITY: the hard joint, < 0: none at all. */
static sadmm_joint_id hang(sadmm_world *world, enum kind kind, sadmm_body_id a, sadmm_body_id b, double x,
                           double stiffness, double damping)
{
    const bool hard = stiffness == INFINITY, none = stiffness < 0;
    const double place[3] = {x, 0, 0};
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_joint_id id = {0};
    sadmm_joint_coordinate law = def.coordinates[0];
    def.body_a = a;
    def.body_b = b;
    law.spring_stiffness = stiffness;
    law.spring_damping = damping;
    MUST(world, sadmm_world_place_joint(world, &def, place, UNIT));
    switch (kind) {
    case POINT: /* between the two centres */
        def.kind = hard ? SADMM_JOINT_DISTANCE : SADMM_JOINT_SPRING;
        for (int k = 0; k < 3; ++k) def.position_b[k] = 0;
        law.spring_rest = 0.3;
        if (!hard) def.coordinates[0] = law;
        break;
    case AXIS: /* slides along z of a's frame, else like fixed */
        def.kind = hard ? SADMM_JOINT_FIXED : SADMM_JOINT_PRISMATIC;
        if (!hard) def.coordinates[2] = law;
        break;
    default: /* the three translations, and rotations, that a fixed joint has */
        def.kind = hard ? SADMM_JOINT_FIXED : SADMM_JOINT_CUSTOM;
        for (int k = 0; !hard && k < 6; ++k) def.coordinates[k] = law;
    }
    if (!none) MUST(world, sadmm_world_add_joint(world, &def, &id));
    return id;
}

/* A chain of two: on the world, and on that; pulled to and fro. */
struct chain {
    sadmm_world *world;
    sadmm_body_id body[2];
    sadmm_joint_id joint[2];
};

static struct chain new_chain(int solver, enum kind kind, double dt, int iterations, double mass, double stiffness,
                              double damping)
{
    struct chain c = {.world = new_world(solver, dt, iterations)};
    for (int k = 0; k < 2; ++k) {
        c.body[k] = add_body(c.world, 0.3 * (k + 1), mass);
        c.joint[k] = hang(c.world, kind, k ? c.body[0] : WORLD, c.body[k], 0.3 * k, stiffness, damping);
    }
    return c;
}

/* What the chain has of kinetic and potential energy (springs left out, which have no less than 0), J. */
static double energy(struct chain *c)
{
    double sum = 0;
    for (int k = 0; k < 2; ++k) {
        const sadmm_body_def d = body_def(c->world, c->body[k]);
        const mat3 frame = q_matrix(q_load(d.orientation));
        const vec3 spin = m3_tmul(frame, v3_load(d.angular_velocity));
        sum += d.mass * (v3_norm2(v3_load(d.linear_velocity)) / 2 + 9.81 * d.position[2]) +
               (d.inertia[0] * spin.x * spin.x + d.inertia[1] * spin.y * spin.y + d.inertia[2] * spin.z * spin.z) / 2;
    }
    return sum;
}

/* 0 to 1e12 N/m on 10 g and 1 kg at 10 ms, without damping, with some, and overdamped (c = 1e6 k, as far as c goes):
 * let go, the chain never has more energy than it began with. */
START_TEST(any_stiffness_is_stable)
{
    const enum kind kind = (enum kind)(_i / SOLVERS);
    static const double stiffness[] = {0, 1e-3, 1, 1e3, 1e6, 1e9, 1e12}, dampings[] = {0, 1e-2, 1e6};
    for (int i = 0; i < 7 * 3 * 2; ++i) {
        const double k = stiffness[i / 6], c = fmin(dampings[i / 2 % 3] * fmax(k, 1e-3), 1e15), mass = i % 2 ? 1 : 0.01;
        struct chain chain = new_chain(_i % SOLVERS, kind, 0.01, 20, mass, k, c);
        double most = 0;
        for (int step = 0; step < 300; ++step) {
            step_world(chain.world, 1);
            most = fmax(most, energy(&chain));
        }
        /* of m g times the length: what 20 iterations at 10 ms leave; swings of springs by the midpoint rule, whose
         * energy goes to and fro with (w dt)^2 / 8, have none to spare at the top */
        ck_assert_msg(most < 0.02 * mass * 9.81 * 0.6, "kind %d, k %g, c %g, %g kg: %g J", (int)kind, k, c, mass, most);
        sadmm_world_destroy(chain.world);
    }
}
END_TEST

/* 1e12 N/m is the hard joint: the chain that swings (POINT), or bears its weight, is where it would be. Solved to
 * rounding; the springs give by 1e-11 m. */
START_TEST(stiffness_without_bound_is_the_hard_joint)
{
    const enum kind kind = (enum kind)(_i / SOLVERS);
    const double close = solvers[_i % SOLVERS].precision == SADMM_F32 ? 2e-5 : 1e-8; /* its rounding, over 100 steps */
    struct chain chains[2];
    for (int k = 0; k < 2; ++k) {
        chains[k] = new_chain(_i % SOLVERS, kind, 0.01, 2000, 1, k ? 1e12 : INFINITY, 0);
        step_world(chains[k].world, 100);
    }
    for (int k = 0; k < 2; ++k) {
        const double off = distance(body_state(chains[0].world, chains[0].body[k]).position,
                                    body_state(chains[1].world, chains[1].body[k]).position);
        ck_assert_msg(off < close, "kind %d: %g", (int)kind, off);
    }
    for (int k = 0; k < 2; ++k) sadmm_world_destroy(chains[k].world);
}
END_TEST

/* A spring without stiffness and damping is not there, to the last bit; what is locked beside it is another joint. */
START_TEST(no_stiffness_is_no_spring)
{
    for (int kind = 0; kind < KINDS; ++kind) {
        uint64_t hash[2];
        if (kind == AXIS) continue;
        for (int k = 0; k < 2; ++k) {
            struct chain c = new_chain(_i, (enum kind)kind, 0.01, 20, 1, k ? 0 : -1, 0);
            step_world(c.world, 50);
            hash[k] = state_hash(c.world);
            sadmm_world_destroy(c.world);
        }
        ck_assert_uint_eq(hash[0], hash[1]);
    }
}
END_TEST

/* Overdamped springs creep as x = x_0 exp(-k t / c), whatever the mass: c / m dt is 1e4 here, c / k 1 s, and 1e6 dt. */
START_TEST(overdamped_springs_creep)
{
    static const double times[2] = {1, 1e4}; /* c / k, s */
    const double dt = 0.01, mass = 0.01;
    for (int i = 0; i < 2; ++i) {
        struct chain c = {.world = new_world(_i, dt, 50)};
        sadmm_settings settings = sadmm_world_settings(c.world);
        settings.gravity[2] = 0;
        MUST(c.world, sadmm_world_set_settings(c.world, &settings));
        c.body[0] = add_body(c.world, 0.3, mass);
        c.joint[0] = hang(c.world, AXIS, WORLD, c.body[0], 0, 1e4 / times[i], 1e4);
        sadmm_body_state state = body_state(c.world, c.body[0]);
        state.position[2] = 0.1;
        MUST(c.world, sadmm_world_set_body_state(c.world, c.body[0], &state));
        step_world(c.world, 100);
        sadmm_joint_state joint;
        MUST(c.world, sadmm_world_joint_state(c.world, c.joint[0], &joint));
        /* dt / 2 of the step at the end of which it is taken, and what springs that are stiff lead by */
        ck_assert_double_eq_tol(joint.position[2], 0.1 * exp(-1 / times[i]), 0.1 * 3 * dt / times[i]);
        sadmm_world_destroy(c.world);
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("springs");
    TCase *cases = tcase_create("springs");
    tcase_set_timeout(cases, 60);
    suite_add_tcase(suite, cases);
    tcase_add_loop_test(cases, any_stiffness_is_stable, 0, SOLVERS * KINDS);
    tcase_add_loop_test(cases, stiffness_without_bound_is_the_hard_joint, 0, SOLVERS * KINDS);
    tcase_add_loop_test(cases, no_stiffness_is_no_spring, 0, SOLVERS);
    tcase_add_loop_test(cases, overdamped_springs_creep, 0, SOLVERS);
    return run_suite(suite);
}
