/* The main of a test program. */
#ifndef TESTS_RUN_SUITE_H
#define TESTS_RUN_SUITE_H

#include <stdlib.h>

#include <check.h>

#include "subadmm/settings.h"

/* Check runs every test in a fork of its own, so that a crash is one failed test. A CUDA driver that was started does
 * not survive a fork: where a device is present the tests run in one process. */
static inline int run_suite(Suite *suite)
{
    sadmm_backend_info info;
    SRunner *runner = srunner_create(suite);
    if (sadmm_backend_query(SADMM_BACKEND_CUDA, &info) == SADMM_OK &&
        (info.available[SADMM_F32] || info.available[SADMM_F64]))
        srunner_set_fork_status(runner, CK_NOFORK);
    srunner_run_all(runner, CK_ENV);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

#endif
