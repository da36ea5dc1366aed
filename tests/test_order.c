/* The order of convergence of motions with known answers: second wherever a motion is smooth, exact where forces are
 * constant and where bodies in flight hit. */
#include "../bench/known_make.h"
#include "fewer.h"
#include "fixed_work.h"
#include "known_order.h"

static const struct {
    sadmm_backend backend;
    sadmm_precision precision;
    int motions; /* of every kind */
} tables[] = {
    {SADMM_BACKEND_CPU, SADMM_F64, 3},
    {SADMM_BACKEND_REF, SADMM_F64, 1},
    {SADMM_BACKEND_CPU, SADMM_F32, 1},
};
enum { TABLES = sizeof tables / sizeof *tables };

START_TEST(errors_have_their_order)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = tables[_i].backend;
    def.precision = tables[_i].precision;
    def.settings.threads = 1;
    def.settings.iterations = 60; /* what they leave is less than the step's error */
    for (int kind = 0; kind < known_motion_kinds(); ++kind)
        for (int number = 0; number < fewer(tables[_i].motions); ++number)
            if (known_motion_order(kind) != 1) expect_order(kind, number, &def, NULL, 2);
}
END_TEST

/* What neither friction that slides nor a hit takes energy from has it all the way, to what the method of fourth order
 * makes of it in a thousand steps. */
START_TEST(the_answers_keep_their_energy)
{
    for (int kind = 0; kind < known_motion_kinds(); ++kind) {
        struct known_motion m;
        double now = 0, most = 0, kinetic;
        known_motion_make(kind, 0, &m);
        if (m.event != EVENT_NONE) continue;
        const double start = exact_energy(&m.system, &kinetic);
        for (int k = 0; k < 50; ++k) {
            known_motion_advance(&m, &now, m.seconds / 50);
            const double energy = exact_energy(&m.system, &kinetic);
            most = fmax(most, kinetic);
            ck_assert_msg(fabs(energy - start) <= 1e-6 * most, "%s: %g", known_motion_name(kind),
                          (energy - start) / most);
        }
    }
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("order");
    TCase *tests = tcase_create("order");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, errors_have_their_order, 0, TABLES);
    tcase_add_test(tests, the_answers_keep_their_energy);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
