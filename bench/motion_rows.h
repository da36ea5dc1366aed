/* The rows of `subadmm-bench motion` as a table and as JSON. */
#ifndef BENCH_MOTION_ROWS_H
#define BENCH_MOTION_ROWS_H

#include <jansson.h>
#include <stdio.h>

#include "motion_study.h"

void motion_print(const struct motion_study *study, const char *runs_on, FILE *out);
/* NULL: out of memory. */
json_t *motion_json(const struct motion_study *study, const char *runs_on);

#endif
