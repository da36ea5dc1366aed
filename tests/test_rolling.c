/* Bodies that roll and rock on curved surfaces: energy stays, what no step resolves dies away. */
#include "fixed_work.h"
#include "rolling_worlds.h"
#include "runner.h"

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_method method;
    int iterations;
} solvers[] = {{SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_FAST, 20},
               {SADMM_BACKEND_CPU, SADMM_F32, SADMM_METHOD_FAST, 20},
               {SADMM_BACKEND_CPU, SADMM_F64, SADMM_METHOD_PAPER, 200},
               {SADMM_BACKEND_REF, SADMM_F64, SADMM_METHOD_FAST, 20}};
enum { SOLVERS = sizeof solvers / sizeof *solvers };

static sadmm_world *new_world(int solver, double dt)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = solvers[solver].backend;
    def.precision = solvers[solver].precision;
    def.settings.method = solvers[solver].method;
    def.settings.iterations = solvers[solver].iterations;
    def.settings.threads = 1;
    def.settings.dt = dt;
    return create_world(&def);
}

/* No force does work on a ball that rolls, or slides without friction. At 5 ms a hundredth of the energy may be gone
 * after 5 s; at half the step less than a quarter of that, which is what an error of second order leaves. */
START_TEST(rocking_keeps_its_energy)
{
    const double steps[] = {0.005, 0.0025};
    for (int kind = 0; kind < ROLL_SHAPES; ++kind)
        for (int slides = 0; slides < 2; ++slides) {
            double lost[2];
            for (int k = 0; k < 2; ++k) {
                sadmm_world *world = new_world(_i, steps[k]);
                double most;
                lost[k] = 1 - rock(world, kind, slides ? 0 : 10, 5, &most);
                /* rounding of single precision, in 2,000 steps */
                ck_assert_double_le(most, 1 + 1e-6);
                sadmm_world_destroy(world);
            }
            ck_assert_msg(lost[0] < 0.01, "shape %d, friction %d: %g lost", kind, !slides, lost[0]);
            ck_assert_msg(lost[1] < lost[0] / 4 && lost[1] > -1e-6, "shape %d, friction %d: %g and %g lost", kind,
                          !slides, lost[0], lost[1]);
        }
}
END_TEST

/* In the long run, with steps of any length: never more than there was. */
START_TEST(rocking_gains_nothing)
{
    static const double steps[] = {0.01, 0.005, 0.002, 0.001};
    for (int slides = 0; slides < 2; ++slides) {
        sadmm_world *world = new_world(0, steps[_i]);
        double most;
        const double left = rock(world, ROLL_SPHERE, slides ? 0 : 10, 60, &most);
        ck_assert_double_le(most, 1 + 1e-4); /* what a user would call a gain; measured: below 1 */
        ck_assert_double_gt(left, -0.01);    /* it lies, in the slop at most */
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Lenses so flat that they rock faster than the step resolves, omega dt from 0.8 to 3.4: their rocking dies away, and
 * they lie where they were put, but for the slop. */
START_TEST(flat_lenses_come_to_rest)
{
    static const double lenses[][2] = {{0.05, 0.002}, {0.05, 0.0005}, {0.02, 0.0005}, {0.01, 0.0002}, {0.001, 0.0001}};
    const double dt = 0.005;
    for (int k = 0; k < (int)(sizeof lenses / sizeof *lenses); ++k) {
        const double a = lenses[k][0], c = lenses[k][1], omega = lens_frequency(a, c);
        sadmm_world *world = new_world(_i, dt);
        const sadmm_body_id id = add_lens(world, a, c);
        double spin = 0;
        for (int step = 0; step < 400; ++step) {
            step_world(world, 1);
            spin = norm3(body_state(world, id).angular_velocity);
            /* one step of free motion turns it by omega dt times what it is tilted by; twice that, by its own weight */
            ck_assert_msg(spin < 2 * omega * 1e-3 * fmax(1, omega * dt * omega * dt), "lens %d, step %d: %g rad/s", k,
                          step, spin);
        }
        ck_assert_double_lt(spin, 1e-9);
        ck_assert_double_eq_tol(body_state(world, id).position[2], c, 2 * sadmm_world_settings(world).slop);
        sadmm_world_destroy(world);
    }
}
END_TEST

/* Setting the state that a body has changes nothing; another one forgets what the last step's contacts owe. */
START_TEST(a_state_set_again_changes_nothing)
{
    uint64_t hash[2];
    for (int sets = 0; sets < 2; ++sets) {
        sadmm_world *world = new_world(0, 0.005);
        const sadmm_body_id id = add_rocking_ball(world, ROLL_SPHERE, 1);
        for (int step = 0; step < 40; ++step) {
            step_world(world, 1);
            const sadmm_body_state state = body_state(world, id);
            if (sets) MUST(world, sadmm_world_set_body_state(world, id, &state));
        }
        MUST(world, sadmm_world_state_hash(world, &hash[sets]));
        sadmm_world_destroy(world);
    }
    ck_assert_uint_eq(hash[0], hash[1]);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("rolling");
    TCase *tests = tcase_create("rolling");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, rocking_keeps_its_energy, 0, SOLVERS);
    tcase_add_loop_test(tests, rocking_gains_nothing, 0, 4);
    tcase_add_loop_test(tests, flat_lenses_come_to_rest, 0, SOLVERS);
    tcase_add_test(tests, a_state_set_again_changes_nothing);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
