/* Grips, a minute each. */
#include "grip_worlds.h"

START_TEST(what_is_gripped_is_held) { hold_cubes((sadmm_precision)_i, 60); }
END_TEST

int main(void)
{
    Suite *suite = suite_create("tolerance, a minute");
    TCase *cases = tcase_create("grips");
    tcase_set_timeout(cases, 3000);
    tcase_add_loop_test(cases, what_is_gripped_is_held, SADMM_F32, SADMM_F64 + 1);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
