/* Values of command-line options that several benchmarks take. Each returns false for text it does not understand. */
#ifndef BENCH_OPTIONS_H
#define BENCH_OPTIONS_H

#include <stdbool.h>

#include "subadmm/settings.h"

enum { BENCH_LIST = 16 }; /* most numbers of a list */

/* "1,2,4": up to BENCH_LIST whole numbers in [low, high]. */
bool bench_parse_list(const char *text, long low, long high, long *values, int *count);
bool bench_parse_number(const char *text, long low, long high, long *value);
/* In (0, high]. */
bool bench_parse_seconds(const char *text, double high, double *seconds);
/* ref, cpu, cuda or all (SADMM_BACKEND_AUTO). */
bool bench_parse_backend(const char *text, sadmm_backend *backend);
/* f32, f64 or both (-1). */
bool bench_parse_precision(const char *text, int *precision);

/* paper or fast. */
bool bench_parse_method(const char *text, sadmm_method *method);

const char *bench_precision_name(sadmm_precision precision);

/* Says on standard error what the value must be; returns the exit status of wrong usage. */
int bench_bad_option(const char *command, const char *option, const char *value, const char *allowed);

#endif
