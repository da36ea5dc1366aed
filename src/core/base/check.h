/* Checks of input values: the message names the argument, its value and the allowed range. */
#ifndef SADMM_CORE_BASE_CHECK_H
#define SADMM_CORE_BASE_CHECK_H

#include <stdbool.h>
#include <stddef.h>

#include "error.h"

sadmm_status sadmm_check_given(const void *pointer, const char *name, struct sadmm_error *error);
/* Finite and within +-limit, which may be infinite. */
sadmm_status sadmm_check_vector(const char *name, const double *x, int count, double limit, struct sadmm_error *error);
sadmm_status sadmm_check_range(const char *name, double x, double low, double high, struct sadmm_error *error);
/* Unit within 1e-6; normalised into `out`. */
sadmm_status sadmm_check_orientation(const char *name, const double q[4], double out[4], struct sadmm_error *error);

bool sadmm_all_finite(const double *x, size_t count);

#endif
