/* Springs and dampers of joints at the ends of what they may be: any stiffness is stable at any step, one without bound
 * is the hard joint, none is nothing; along a line between two points, along axes, and in all six coordinates. */
#include "core/base/memory.h"
#include "core/math/rigid.h"
#include "fixed_work.h"
#include "scene_tools.h"

#ifndef M_PI
#define M_PI 3.14159265358979323846
#endif

static const double UNIT[4] = {1, 0, 0, 0};
static const sadmm_body_id WORLD = {0, 0};

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
} solvers[] = {{SADMM_BACKEND_CPU, SADMM_F64}, {SADMM_BACKEND_REF, SADMM_F64}, {SADMM_BACKEND_CPU, SADMM_F32}};
enum { SOLVERS = 3 };

static sadmm_world *new_world(int solver, double dt, int iterations)
{
    sadmm_world_def def = fixed_world_def();
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

/* 1e12 N/m is the hard joint: the chain that swings (POINT), or bears its weight, is where it would be; the springs
 * yield 1e-11 m, and the joints as little. */
START_TEST(stiffness_without_bound_is_the_hard_joint)
{
    const enum kind kind = (enum kind)(_i / SOLVERS);
    const double close = solvers[_i % SOLVERS].precision == SADMM_F32 ? 2e-5 : 1e-8; /* its rounding, over 100 steps */
    struct chain chains[2];
    for (int k = 0; k < 2; ++k) {
        chains[k] = new_chain(_i % SOLVERS, kind, 0.01, 20, 1, k ? 1e12 : INFINITY, 0);
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

/* ---- tables ------------------------------------------------------------------------------------------------------ */

struct table {
    int32_t count;
    double positions[SADMM_MOST_SPRING_POINTS], forces[SADMM_MOST_SPRING_POINTS];
};

/* A body that slides along z on a spring with that table, `push` N against it. */
static struct chain new_slider(int solver, double dt, double mass, const struct table *table, double push)
{
    struct chain c = {.world = new_world(solver, dt, 10)};
    sadmm_settings settings = sadmm_world_settings(c.world);
    settings.gravity[2] = push / mass;
    MUST(c.world, sadmm_world_set_settings(c.world, &settings));
    c.body[0] = add_body(c.world, 0.3, mass);
    c.joint[0] = hang(c.world, AXIS, WORLD, c.body[0], 0, 0, 0);
    MUST(c.world, sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, table->positions, table->forces,
                                                     table->count));
    return c;
}

static void start_at(struct chain *c, double z, double speed)
{
    sadmm_body_state state = body_state(c->world, c->body[0]);
    state.position[2] = z;
    state.linear_velocity[2] = speed;
    MUST(c->world, sadmm_world_set_body_state(c->world, c->body[0], &state));
}

static double load_at(const struct table *t, double q)
{
    int i = 0;
    while (i < t->count - 2 && q > t->positions[i + 1]) ++i;
    return t->forces[i] +
           (t->forces[i + 1] - t->forces[i]) / (t->positions[i + 1] - t->positions[i]) * (q - t->positions[i]);
}

/* The spring's energy from position 0 on, J: by trapezoids from kink to kink, which are exact. */
static double stored_at(const struct table *t, double q)
{
    const double sign = q < 0 ? -1 : 1;
    double from = 0, sum = 0;
    while (from != q) {
        double to = q;
        for (int i = 0; i < t->count; ++i)
            if (sign * (t->positions[i] - from) > 0 && sign * (to - t->positions[i]) > 0) to = t->positions[i];
        sum += (load_at(t, from) + load_at(t, to)) / 2 * (to - from);
        from = to;
    }
    return sum;
}

static double slider_energy(struct chain *c, const struct table *t, double mass, double push)
{
    const sadmm_body_state s = body_state(c->world, c->body[0]);
    return mass * s.linear_velocity[2] * s.linear_velocity[2] / 2 + stored_at(t, s.position[2]) - push * s.position[2];
}

START_TEST(tables_come_and_go)
{
    const struct table good = {3, {-1, 0, 2}, {-5, 0, 40}};
    struct chain c = new_slider(0, 0.005, 1, &good, 0);
    double positions[SADMM_MOST_SPRING_POINTS], forces[SADMM_MOST_SPRING_POINTS];
    const double same[2] = {1, 1}, steep[2] = {1, 1 + 1e-12}, load[2] = {0, 1e6}, bad[2] = {0, NAN};
    int32_t count;
    uint64_t hash[2];
    static const struct {
        int32_t index, count;
        const char *part;
    } refused[] = {{0, 2, "index = 0: must be a free"},          {6, 2, "index = 6"},
                   {2, 1, "count = 1: must be 0 or in [2, 64]"}, {2, 65, "count = 65"},
                   {2, -1, "count = -1"},                        {2, 2, "positions[1] = 1 after positions[0] = 1"}};
    for (size_t k = 0; k < sizeof refused / sizeof *refused; ++k) {
        ck_assert_int_eq(sadmm_world_set_joint_spring_table(c.world, c.joint[0], refused[k].index, same, load,
                                                            refused[k].count), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_msg(strstr(sadmm_world_message(c.world), refused[k].part) != NULL, "%s",
                      sadmm_world_message(c.world));
    }
    ck_assert_int_eq(sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, steep, load, 2),
                     SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, load, bad, 2),
                     SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, NULL, load, 2),
                     SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_test_fail_allocations_after(0);
    ck_assert_int_eq(sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, load, load, 2),
                     SADMM_ERROR_OUT_OF_MEMORY);
    sadmm_test_fail_allocations_after(-1);
    MUST(c.world, sadmm_world_joint_spring_table(c.world, c.joint[0], 2, positions, forces, &count));
    ck_assert(count == 3 && positions[2] == 2 && forces[0] == -5);
    MUST(c.world, sadmm_world_joint_spring_table(c.world, c.joint[0], 5, NULL, NULL, &count));
    ck_assert_int_eq(count, 0);
    start_at(&c, 0.5, 0);
    step_world(c.world, 1);
    sadmm_joint_state state;
    MUST(c.world, sadmm_world_joint_state(c.world, c.joint[0], &state));
    ck_assert_double_eq_tol(state.spring_force[2], -10, 0.1); /* of a step's way, 2e-4 m */

    /* removed it is not there, to the last bit; nor is it in a new joint of the slot */
    sadmm_world_destroy(c.world);
    for (int k = 0; k < 2; ++k) {
        c = new_slider(0, 0.005, 1, &good, 0);
        MUST(c.world, sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, NULL, NULL, 0));
        if (k) {
            MUST(c.world, sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, good.positions, good.forces, 3));
            MUST(c.world, sadmm_world_remove_joint(c.world, c.joint[0]));
            c.joint[0] = hang(c.world, AXIS, WORLD, c.body[0], 0, 0, 0);
        }
        start_at(&c, 0.5, 1);
        step_world(c.world, 5);
        hash[k] = state_hash(c.world);
        ck_assert_double_eq_tol(body_state(c.world, c.body[0]).linear_velocity[2], 1, 1e-12);
        sadmm_world_destroy(c.world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

/* A line is the spring of its slope, in any pieces: to the rounding of its stiffness while nothing is stiff. */
START_TEST(a_straight_table_is_the_linear_spring)
{
    struct table line = {9, {0}, {0}};
    double z[2];
    for (int i = 0; i < 9; ++i) line.positions[i] = 0.02 * i - 0.07, line.forces[i] = 300 * (line.positions[i] - 0.01);
    for (int k = 0; k < 2; ++k) {
        struct chain c = new_slider(_i, 0.005, 1, &line, 0);
        sadmm_joint_coordinate law = {.drive_force = INFINITY, .spring_damping = 2};
        law.spring_stiffness = k ? 300 : 0;
        law.spring_rest = k ? 0.01 : 0;
        if (k) MUST(c.world, sadmm_world_set_joint_spring_table(c.world, c.joint[0], 2, NULL, NULL, 0));
        MUST(c.world, sadmm_world_set_joint_coordinate(c.world, c.joint[0], 2, &law));
        start_at(&c, 0.1, 0);
        step_world(c.world, 137);
        z[k] = body_state(c.world, c.body[0]).position[2];
        sadmm_world_destroy(c.world);
    }
    ck_assert_double_eq_tol(z[0], z[1], solvers[_i].precision == SADMM_F32 ? 1e-5 : 1e-11);
}
END_TEST

/* 100 N/m on one side and 900 on the other, 1 kg: half periods pi / 10 and pi / 30, amplitudes 0.3 and 0.1 m. */
static double kinked_position(double t)
{
    const double half[2] = {M_PI / 10, M_PI / 30};
    t = fmod(t + half[0] / 2, half[0] + half[1]); /* begins at the top of the soft side */
    return t < half[0] ? 0.3 * sin(10 * t) : -0.1 * sin(30 * (t - half[0]));
}

static double kinked_error(int solver, double dt, double *energy)
{
    const struct table kinked = {3, {-1, 0, 1}, {-900, 0, 100}};
    struct chain c = new_slider(solver, dt, 1, &kinked, 0);
    double worst = 0;
    start_at(&c, 0.3, 0);
    *energy = 0;
    for (int step = 1; step * dt < 4; ++step) {
        step_world(c.world, 1);
        worst = fmax(worst, fabs(body_state(c.world, c.body[0]).position[2] - kinked_position(step * dt)));
        *energy = fmax(*energy, slider_energy(&c, &kinked, 1, 0) / 4.5 - 1);
    }
    sadmm_world_destroy(c.world);
    return worst;
}

START_TEST(kinks_are_of_second_order)
{
    double energy[2];
    const double coarse = kinked_error(_i, 0.004, &energy[0]), fine = kinked_error(_i, 0.001, &energy[1]);
    /* a sixteenth with a quarter of the step; errors of kinks depend on where steps meet them, so that it scatters */
    ck_assert_msg(fine < 2e-3 && coarse / fine > 11 && coarse / fine < 22, "%g %g", coarse, fine);
    ck_assert_msg(energy[0] < 5e-3 && energy[1] < 1e-3, "%g %g", energy[0], energy[1]); /* never gained */
}
END_TEST

/* Loads that rise, from flat to 1e9 N/m, on 10 g at 10 ms: no motion has more energy than the spring began with,
 * whatever the table. */
START_TEST(rising_tables_are_stable)
{
    uint32_t random = 1;
    for (int n = 0; n < 60; ++n) {
        struct table t = {2 + n % 12, {-0.1}, {0}};
        double steepness = 0;
        for (int i = 1; i < t.count; ++i) {
            random = random * 1664525u + 1013904223u;
            t.positions[i] = t.positions[i - 1] + 0.2 / (t.count - 1) * (0.1 + 1.8 * (random >> 8) / (1 << 24));
            random = random * 1664525u + 1013904223u;
            const double slope = (random >> 8) % 4 == 0 ? 0 : pow(10, 9.0 * (random >> 8) / (1 << 24));
            t.forces[i] = t.forces[i - 1] + slope * (t.positions[i] - t.positions[i - 1]);
            steepness = fmax(steepness, slope);
        }
        const double middle = load_at(&t, 0), mass = 0.01;
        for (int i = 0; i < t.count; ++i) t.forces[i] -= middle; /* none at 0 */
        struct chain c = new_slider(_i, 0.01, mass, &t, 0);
        start_at(&c, 0.09, 0);
        const double before = slider_energy(&c, &t, mass, 0);
        double most = 0, size = 1e-3 * before;
        for (int step = 0; step < 200; ++step) {
            step_world(c.world, 1);
            const double v = body_state(c.world, c.body[0]).linear_velocity[2];
            most = fmax(most, mass * v * v / 2);
        }
        ck_assert_msg(most <= before + size, "table %d: %g J of %g", n, most, before);
        sadmm_world_destroy(c.world);
    }
}
END_TEST

/* A stop of 1e9 N/m at 0.05 m: what falls onto it stays there, 10 g at 10 ms, at rest where it bears the weight. */
START_TEST(stops_of_tables_hold)
{
    const struct table stop = {3, {0, 0.05, 0.051}, {0, 0, 1e6}};
    struct chain c = new_slider(_i, 0.01, 0.01, &stop, 0.1);
    double most = 0;
    start_at(&c, 0, 1);
    for (int step = 0; step < 200; ++step) {
        step_world(c.world, 1);
        most = fmax(most, body_state(c.world, c.body[0]).position[2]);
    }
    /* m: an undamped spring of that stiffness would give v (m / k)^1/2 = 3e-6. At rest it is 0.1 N / 1e9 N/m deep,
     * where a stop of 1e7 N/m would be 1e-8; and the force is the weight, to single precision */
    ck_assert_double_lt(most, 0.05 + 1e-6);
    ck_assert_double_eq_tol(body_state(c.world, c.body[0]).position[2], 0.05 + 1e-10, 1e-8);
    sadmm_joint_state state;
    MUST(c.world, sadmm_world_joint_state(c.world, c.joint[0], &state));
    ck_assert_double_eq_tol(state.spring_force[2], -0.1, 1e-6);
    sadmm_world_destroy(c.world);
}
END_TEST

/* A spring that snaps through: of the three places where it bears the push, the middle one is on a falling part. With a
 * damper it comes to rest at one of the others, on the side of the push. */
START_TEST(falling_tables_snap_through)
{
    const struct table snap = {4, {-0.2, -0.1, 0.1, 0.2}, {0, -10, 10, 0}},
                       other = {4, {-0.2, -0.1, 0.1, 0.2}, {-50, 10, -10, 50}};
    const sadmm_joint_coordinate damper = {.drive_force = INFINITY, .spring_damping = 5};
    for (int side = -1; side <= 1; side += 2) {
        struct chain c = new_slider(_i, 0.005, 1, &other, side);
        MUST(c.world, sadmm_world_set_joint_coordinate(c.world, c.joint[0], 2, &damper));
        step_world(c.world, 2000);
        /* 600 N/m from (0.1, -10): -10 + 600 (z - 0.1) = 1 */
        ck_assert_double_eq_tol(body_state(c.world, c.body[0]).position[2], side * (0.1 + 11.0 / 600),
                                solvers[_i].precision == SADMM_F32 ? 1e-5 : 1e-7);
        sadmm_world_destroy(c.world);
    }
    /* and one whose ends fall lets go of what is beyond them: no place to rest, no number that is none */
    struct chain c = new_slider(_i, 0.005, 1, &snap, 11);
    MUST(c.world, sadmm_world_set_joint_coordinate(c.world, c.joint[0], 2, &damper));
    step_world(c.world, 400);
    ck_assert_double_gt(body_state(c.world, c.body[0]).position[2], 0.2);
    sadmm_world_destroy(c.world);
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
    tcase_add_test(cases, tables_come_and_go);
    tcase_add_loop_test(cases, a_straight_table_is_the_linear_spring, 0, SOLVERS);
    tcase_add_loop_test(cases, kinks_are_of_second_order, 0, SOLVERS);
    tcase_add_loop_test(cases, rising_tables_are_stable, 0, SOLVERS);
    tcase_add_loop_test(cases, stops_of_tables_hold, 0, SOLVERS);
    tcase_add_loop_test(cases, falling_tables_snap_through, 0, SOLVERS);
    return run_suite(suite);
}
