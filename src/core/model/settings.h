/* Defaults and validation of sadmm_settings. */
#ifndef SADMM_CORE_MODEL_SETTINGS_H
#define SADMM_CORE_MODEL_SETTINGS_H

#include <stdbool.h>

#include "core/base/error.h"
#include "core/base/growing.h"
#include "core/base/settings_fields.h"
#include "subadmm/settings.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SADMM_GRAVITY_LIMIT 1e6 /* m/s^2, of its size */

/* The first version's end with `threads`. */
#define SADMM_SETTINGS_LEAST SADMM_SIZE_TO(sadmm_settings, threads)
extern const struct sadmm_growing sadmm_growing_settings;

/* A caller's: taken, and validated. */
sadmm_status sadmm_settings_take(sadmm_settings *settings, const sadmm_settings *given, struct sadmm_error *error);
/* INVALID_ARGUMENT with the first field out of range, its value and the range. */
sadmm_status sadmm_settings_validate(const struct sadmm_settings *settings, struct sadmm_error *error);

/* A sub-step's share of a step of a world: of its time and its iterations. (`substeps` still says how many there
 * are.) */
sadmm_settings sadmm_settings_of_substep(const struct sadmm_settings *whole);

/* Are all members the same, bit for bit? Padding between them does not count. */
bool sadmm_settings_equal(const struct sadmm_settings *a, const struct sadmm_settings *b);

/* Settings are of two kinds (core/base/settings_fields.h). Numbers are what formulas read: they may change from step to
 * step, and a backend keeps them as data. The rest says what a step consists of: how many iterations in which order,
 * what is checked, measured, kept. */
void sadmm_settings_numbers(const struct sadmm_settings *settings, double numbers[SADMM_SETTING_NUMBERS]);
/* Do steps of both consist of the same? (A tolerance, or a limit of the penalty's update, counts by whether there is
 * one.) */
bool sadmm_settings_same_but_numbers(const struct sadmm_settings *a, const struct sadmm_settings *b);

#ifdef __cplusplus
}
#endif
#endif
