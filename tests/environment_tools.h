/* What tests of environments on the host and on a device share. */
#ifndef SADMM_TESTS_ENVIRONMENT_TOOLS_H
#define SADMM_TESTS_ENVIRONMENT_TOOLS_H

#include <stdint.h>
#include <string.h>

#include "scene_tools.h"
#include "subadmm/environments.h"

#define MUST_ALL(environments, call) \
    ck_assert_msg((call) == SADMM_OK, #call ": %s", sadmm_environments_message(environments))

static const sadmm_array outputs[] = {
    SADMM_ARRAY_BODY_STATE,          SADMM_ARRAY_JOINT_POSITION,    SADMM_ARRAY_JOINT_SPEED,
    SADMM_ARRAY_BODY_CONTACT_WRENCH, SADMM_ARRAY_BODY_ACCELERATION, SADMM_ARRAY_JOINT_DRIVE_FORCE,
    SADMM_ARRAY_JOINT_WRENCH,        SADMM_ARRAY_BODY_WRENCH,       SADMM_ARRAY_REPORT};
enum { OUTPUTS = sizeof outputs / sizeof *outputs };

/* Between -1 and 1, the same every time. */
static inline double noise(uint32_t a, uint32_t b)
{
    uint32_t x = a * 2654435761U ^ (b + 1) * 2246822519U;
    x ^= x >> 15, x *= 2246822519U, x ^= x >> 13;
    return (double)x / 2147483647.5 - 1;
}

/* Bit for bit. */
static inline void expect_same(const double *a, const double *b, size_t count, const char *what, int32_t environment,
                               int step)
{
    for (size_t k = 0; k < count; ++k)
        ck_assert_msg(memcmp(&a[k], &b[k], sizeof *a) == 0, "%s, environment %d, step %d, number %zu: %.17g, %.17g",
                      what, environment, step, k, a[k], b[k]);
}

#endif
