/* Defaults and validation of sadmm_settings. */
#ifndef SADMM_CORE_MODEL_SETTINGS_H
#define SADMM_CORE_MODEL_SETTINGS_H

#include <stdbool.h>

#include "core/base/error.h"
#include "subadmm/settings.h"

#ifdef __cplusplus
extern "C" {
#endif

/* INVALID_ARGUMENT with the first field out of range, its value and the range; NULL is refused too. */
sadmm_status sadmm_settings_validate(const struct sadmm_settings *settings, struct sadmm_error *error);

/* Are all members the same, bit for bit? Padding between them does not count. */
bool sadmm_settings_equal(const struct sadmm_settings *a, const struct sadmm_settings *b);

#ifdef __cplusplus
}
#endif
#endif
