/* What the test programs of the CUDA backend share: its tables, on a device or emulated (CUDA_EMULATED), and a case a
 * test, so that CK_RUN_CASE=<name> runs one of them: sanitizers of devices are slow, and run them side by side. */
#ifndef TESTS_CUDA_SUITE_H
#define TESTS_CUDA_SUITE_H

#include <stdio.h>
#include <stdlib.h>

#include <check.h>

#include "core/solve/backends.h"
#include "core/solve/kernels.h"
#ifdef CUDA_EMULATED
#include "emulation_control.h"
#endif

enum { TEST_SKIPPED = 77 }; /* meson's exit status */

static const char *const precision_names[] = {"f32", "f64"};

/* Both tables; false: said why there are none. */
static inline bool find_cuda_tables(const struct sadmm_kernels *tables[2])
{
#ifdef CUDA_EMULATED
    for (int p = 0; p < 2; ++p) tables[p] = &cuda_emulation_tables[p];
#else
    const char *reason = "";
    for (int p = 0; p < 2; ++p) {
        tables[p] = sadmm_cuda_find((sadmm_precision)p, &reason);
        if (!tables[p]) {
            printf("skipped: %s: %s\n", precision_names[p], reason);
            return false;
        }
    }
    printf("on %s\n", reason);
#endif
    return true;
}

/* Precisions to test: with SADMM_TEST_SHORT the first one alone. */
static inline int tested_precisions(void) { return getenv("SADMM_TEST_SHORT") ? 1 : 2; }

static inline void add_case(Suite *suite, const char *name, const TTest *test, int first, int end)
{
    TCase *tests = tcase_create(name);
    tcase_set_timeout(tests, 600);
    tcase_add_loop_test(tests, test, first, end);
    suite_add_tcase(suite, tests);
}
/* Loops [first, end) of a test, as a case of its name. */
#define ADD_CASE(suite, test, first, end) add_case(suite, #test, test, first, end)

static inline int run_cuda_suite(Suite *suite)
{
    SRunner *runner = srunner_create(suite);
    srunner_set_fork_status(runner, CK_NOFORK); /* a driver that was started does not survive a fork */
    srunner_run_all(runner, CK_ENV);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}

#endif
