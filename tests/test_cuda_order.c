/* The order of convergence on the device, of a motion of some kinds. */
#include "cuda_worlds.h"
#include "fixed_work.h"
#include "known_order.h"

static int used_precision;

static void opened(sadmm_world *world) { use_device(world, used_precision, 0); }

START_TEST(errors_have_their_order)
{
    static const char *const names[] = {"a ball skids until it rolls", "a ball rolls, off centre",
                                        "a ball off centre on triangles", "a ball rocks on a ball that rocks"};
    sadmm_world_def def = fixed_world_def();
    used_precision = _i;
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)_i;
    def.settings.threads = 1;
    def.settings.iterations = 60;
    for (int kind = 0; kind < known_motion_kinds(); ++kind)
        for (size_t k = 0; k < sizeof names / sizeof *names; ++k)
            if (!strcmp(known_motion_name(kind), names[k])) expect_order(kind, 1, &def, opened, EMULATED ? 1 : 2);
}
END_TEST

int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    Suite *suite = suite_create("cuda_order");
    ADD_CASE(suite, errors_have_their_order, 0, tested_precisions());
    return run_cuda_suite(suite);
}
