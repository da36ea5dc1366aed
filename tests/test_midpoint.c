/* Where contacts are taken within a step (collision/base/midpoint.h, advance.h): halfway through it, or where what is
 * fast first touches. Separations of turning bodies, what passes by, bullets, momentum of fast impacts. */
#include "fixed_work.h"
#include "momentum_worlds.h"

static sadmm_world *empty_world(double dt, int iterations)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.iterations = iterations;
    for (int k = 0; k < 3; ++k) def.settings.gravity[k] = 0;
    return create_world(&def);
}

/* mass 0: static. size: as in the shape's definition. */
static sadmm_body_id add(sadmm_world *world, sadmm_shape_type type, const double size[3], double mass,
                         const double position[3], const double velocity[6])
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = mass > 0 ? SADMM_BODY_DYNAMIC : SADMM_BODY_STATIC;
    body.mass = mass;
    if (mass > 0 && type == SADMM_SHAPE_BOX) sadmm_box_inertia(mass, size, body.inertia);
    if (mass > 0 && type == SADMM_SHAPE_SPHERE) sadmm_sphere_inertia(mass, size[0], body.inertia);
    if (mass > 0 && type == SADMM_SHAPE_CAPSULE) sadmm_capsule_inertia(mass, size[0], size[1], body.inertia);
    shape.type = type;
    shape.friction = 0.3;
    for (int k = 0; k < 3; ++k) {
        body.position[k] = position[k];
        shape.size[k] = size[k];
        if (mass > 0) body.linear_velocity[k] = velocity[k], body.angular_velocity[k] = velocity[k + 3];
    }
    MUST(world, sadmm_world_add_body(world, &body, &id));
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* ---- separations ------------------------------------------------------------------------------------------------- */

/* A box that spins about y over a floor, alone in the air: by separation and velocity the lowest corner ends up where
 * it does, but for its centripetal acceleration w^2 z over a quarter of the time twice, dt^2/8; taken at the start of
 * the step it is off by dt^2/2. */
START_TEST(separations_at_the_end_of_the_step)
{
    static const double half[3] = {0.1, 0.1, 0.1}, spins[] = {1, 5, 20};
    /* at the end the lowest corner is 3 mm up */
    const double w = spins[_i], dt = 0.01, height = 0.1 * (cos(w * dt) + sin(w * dt)) + 0.02 + 0.003;
    const double at[3] = {0, 0, height}, v[6] = {0.5, 0, -2, 0, w, 0};
    sadmm_world *world = empty_world(dt, 20);
    const sadmm_body_id box = add(world, SADMM_SHAPE_BOX, half, 1, at, v);
    int found = 0;
    add_plane(world, 0.5);
    step_world(world, 1);
    /* nothing touches in this step */
    ck_assert(body_state(world, box).linear_velocity[2] == v[2]);
    for (int32_t i = 0; i < sadmm_world_contact_count(world); ++i) {
        sadmm_contact c;
        MUST(world, sadmm_world_contacts(world, i, 1, &c));
        const double arm[3] = {c.position[0] - at[0], 0, c.position[2] - at[2]};
        const double predicted = c.separation + dt * (v[2] - w * arm[0]);
        /* which corner: by where it is halfway through the step, to 1 cm */
        for (int x = -1; x <= 1; x += 2)
            for (int z = -1; z <= 1; z += 2) {
                const double turn[2] = {0.5 * dt * w, dt * w};
                const double half_x = 0.1 * (x * cos(turn[0]) + z * sin(turn[0]));
                const double end = at[2] + dt * v[2] + 0.1 * (z * cos(turn[1]) - x * sin(turn[1]));
                const double middle = 0.1 * (z * cos(turn[0]) - x * sin(turn[0]));
                if (fabs(half_x - (arm[0] - 0.5 * dt * v[0])) > 0.01 || z > 0) continue;
                /* the next orders: (w dt)^4 / 384 and the half angle for its tangent, (w dt)^3 / 96 */
                ck_assert_double_eq_tol(predicted - end, dt * dt / 8 * w * w * middle,
                                        0.1 * pow(w * dt, 3) / 40 + 1e-12);
                ++found;
            }
    }
    ck_assert_int_ge(found, 2); /* the two lower corners of either side of the box, or more */
    sadmm_world_destroy(world);
}
END_TEST

/* ---- what passes by -------------------------------------------------------------------------------------------- */

static const double speeds[] = {2, 5, 10, 30, 100};

/* Past the edge of a cube, 1 cm away from it, in the direction of the diagonal, from 20 places within a step's way.
 * Nothing of its velocity is lost: the contact is where both are nearest, and closes nothing there. */
START_TEST(what_passes_by_is_not_touched)
{
    static const sadmm_shape_type types[] = {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX};
    static const double cube[3] = {0.1, 0.1, 0.1}, origin[3] = {0, 0, 0};
    const double speed = speeds[_i % 5], dt = 0.005, along = speed / sqrt(2);
    const sadmm_shape_type type = types[_i / 5];
    /* how far from the centre the shape reaches across the way, at least and to its corner */
    const double across = type == SADMM_SHAPE_BOX ? 0.1 * sqrt(2) : 0.1;
    const double offset = 0.2 + (across + 0.01) * sqrt(2); /* the cube's edge reaches 0.1 sqrt(2), too */
    for (int phase = 0; phase < 20; ++phase) {
        const double back = -1 + phase / 20.0 * along * dt, at[3] = {back, back - offset, 0.01};
        const double v[6] = {along, along, 0, 0, 0, 0};
        sadmm_world *world = empty_world(dt, 20);
        add(world, SADMM_SHAPE_BOX, cube, 0, origin, NULL);
        const sadmm_body_id id = add(world, type, cube, 1, at, v);
        step_world(world, (int)(4 / speed / dt) + 2);
        const sadmm_body_state state = body_state(world, id);
        ck_assert(state.position[0] > 1);
        for (int k = 0; k < 3; ++k) ck_assert(state.linear_velocity[k] == v[k] && state.angular_velocity[k] == 0);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* ---- bullets --------------------------------------------------------------------------------------------------- */

static const struct bullet_case {
    sadmm_shape_type type;
    double plate; /* kg; 0: static */
} bullets[] = {
    {SADMM_SHAPE_SPHERE, 0}, {SADMM_SHAPE_CAPSULE, 0}, {SADMM_SHAPE_BOX, 0},
    {SADMM_SHAPE_SPHERE, 10}, {SADMM_SHAPE_CAPSULE, 10}, {SADMM_SHAPE_BOX, 10},
};

/* Bullets of 1 mm, spinning, at 500 m/s: 2.5 m a step of 5 ms. They are shot at random at a plate of 1 mm x 1 m x 1 m,
 * from 1 to 4 m away and down to 30 degrees to its plane, and stay on their side of it. Some leave over its rim later
 * on: then they are behind it, where nothing is. */
START_TEST(bullets_stop)
{
    const struct bullet_case *c = &bullets[_i];
    static const double size[3] = {0.0005, 0.0005, 0.0005}, plate[3] = {0.5, 0.5, 0.0005}, origin[3] = {0, 0, 0};
    const double speed = 500;
    uint64_t seed = 11;
    for (int shot = 0; shot < 100; ++shot) {
        double direction[3] = {random_number(&seed), random_number(&seed), -1}, at[3], v[6];
        const double length = sqrt(direction[0] * direction[0] + direction[1] * direction[1] + 1),
                     back = 2.5 + 1.5 * random_number(&seed);
        for (int k = 0; k < 3; ++k) {
            const double aim = k < 2 ? 0.4 * random_number(&seed) : 0;
            v[k] = speed * direction[k] / length;
            v[k + 3] = 10 * random_number(&seed);
            at[k] = aim - back * direction[k] / length;
        }
        /* 60 iterations: masses of 1:1e6 that met for the first time; after 20 the way is up to 1 mm off */
        sadmm_world *world = empty_world(0.005, 60);
        const double rest[6] = {0};
        const sadmm_body_id target = add(world, SADMM_SHAPE_BOX, plate, c->plate, origin, rest);
        const sadmm_body_id id = add(world, c->type, size, 1e-5, at, v);
        for (int step = 0; step < 3; ++step) {
            step_world(world, 1);
            const sadmm_body_state b = body_state(world, id), p = body_state(world, target);
            const bool over = fabs(b.position[0]) < 0.5 && fabs(b.position[1]) < 0.5;
            ck_assert_msg(!over || b.position[2] - p.position[2] > 0, "shot %d, step %d: %g m", shot, step,
                          b.position[2] - p.position[2]);
        }
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Two balls that meet at 60 m/s in one step of 5 ms, off centre: both momenta are kept, to 1e-12 of the sums of what
 * they are made of, and no energy is made. */
START_TEST(fast_impacts_keep_momentum)
{
    static const double size[3] = {0.05, 0, 0};
    const double at[2][3] = {{-0.1, 0, 0}, {0.1, 0.03, 0.02}}, v[2][6] = {{30, 0, 1, 3, 5, -7}, {-30, 2, 0, 1, 0, 9}};
    const double mass[2] = {1, 0.25 * (_i + 1)};
    sadmm_world *world = empty_world(0.005, 60);
    sadmm_body_id id[2];
    double before[7] = {0}, after[7] = {0}, size_of[7] = {0};
    for (int k = 0; k < 2; ++k) id[k] = add(world, SADMM_SHAPE_SPHERE, size, mass[k], at[k], v[k]);
    for (int step = 0; step < 2; ++step) {
        double *sums = step ? after : before;
        for (int b = 0; b < 2; ++b) {
            const sadmm_body_state s = body_state(world, id[b]);
            const double spin = 0.4 * mass[b] * size[0] * size[0];
            for (int k = 0; k < 3; ++k) {
                const int u = (k + 1) % 3, w = (k + 2) % 3;
                const double one = mass[b] * s.position[u] * s.linear_velocity[w],
                             two = mass[b] * s.position[w] * s.linear_velocity[u];
                sums[k] += mass[b] * s.linear_velocity[k];
                sums[k + 3] += one - two + spin * s.angular_velocity[k];
                sums[6] += mass[b] * s.linear_velocity[k] * s.linear_velocity[k] +
                           spin * s.angular_velocity[k] * s.angular_velocity[k];
                size_of[k] += fabs(mass[b] * s.linear_velocity[k]);
                size_of[k + 3] += fabs(one) + fabs(two) + fabs(spin * s.angular_velocity[k]);
            }
        }
        if (!step) step_world(world, 1);
    }
    ck_assert_double_gt(fabs(after[6] - before[6]), 1); /* they met */
    ck_assert_double_lt(after[6], before[6]);
    for (int k = 0; k < 6; ++k) ck_assert_double_eq_tol(after[k], before[k], 1e-12 * (size_of[k] + 1));
    sadmm_world_destroy(world);
}
END_TEST

/* ---- rocking --------------------------------------------------------------------------------------------------- */

/* A box of 1 kg rocks on a lying cylinder, from 0.2 rad. Energy is never gained, and little of it lost in 4 s
 * (docs/internals/algorithm.md, "Rolling contacts"). */
START_TEST(rocking_gains_no_energy)
{
    static const double cylinder[3] = {0.5, 1, 0}, half[3] = {0.2, 0.1, 0.05};
    const double dt = 0.005 / (1 << _i), tilt = 0.2, radius = cylinder[0], g = 9.81;
    sadmm_world_def def = fixed_world_def();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = dt;
    def.settings.iterations = 100;
    sadmm_world *world = create_world(&def);
    body.type = SADMM_BODY_STATIC;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_CAPSULE;
    shape.friction = 1;
    shape.orientation[0] = shape.orientation[1] = sqrt(0.5); /* along y */
    memcpy(shape.size, cylinder, sizeof cylinder);
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));

    body = sadmm_body_def_default();
    body.mass = 1;
    sadmm_box_inertia(1, half, body.inertia);
    body.orientation[0] = cos(tilt / 2), body.orientation[2] = sin(tilt / 2);
    /* it has rolled there from the top */
    body.position[0] = (radius + half[2]) * sin(tilt) - radius * tilt * cos(tilt);
    body.position[2] = (radius + half[2]) * cos(tilt) + radius * tilt * sin(tilt);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = 1;
    memcpy(shape.size, half, sizeof half);
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));

    const double lowest = g * (radius + half[2]), start = g * body.position[2] - lowest;
    double energy = start;
    for (int k = 0; k < (int)lround(4 / dt); ++k) {
        step_world(world, 1);
        const sadmm_body_state s = body_state(world, id);
        energy = g * s.position[2] - lowest + body.inertia[1] * s.angular_velocity[1] * s.angular_velocity[1] / 2;
        for (int axis = 0; axis < 3; ++axis) energy += s.linear_velocity[axis] * s.linear_velocity[axis] / 2;
        /* a step's own fall, g v dt / 2 with v of at most 1 m/s, may come and go */
        ck_assert_msg(energy <= start + g * dt / 2, "step %d: %g of %g J", k, energy, start);
    }
    /* what an error of second order leaves: 2 % at 5 ms, a quarter of that at half the step */
    ck_assert_double_ge(energy / start, 1 - 0.02 / (1 << 2 * _i));
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("midpoint");
    TCase *tests = tcase_create("midpoint");
    tcase_add_loop_test(tests, separations_at_the_end_of_the_step, 0, 3);
    tcase_add_loop_test(tests, what_passes_by_is_not_touched, 0, 15);
    tcase_add_loop_test(tests, bullets_stop, 0, (int)(sizeof bullets / sizeof *bullets));
    tcase_add_loop_test(tests, fast_impacts_keep_momentum, 0, 4);
    tcase_add_loop_test(tests, rocking_gains_no_energy, 0, 3);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
