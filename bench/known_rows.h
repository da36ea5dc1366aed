/* The table of `subadmm-bench motion --known`. */
#ifndef BENCH_KNOWN_ROWS_H
#define BENCH_KNOWN_ROWS_H

#include <stdio.h>

#include "known_motions.h"

/* `count` motions of every kind by dt, dt/2, ... (levels of them), as a table of Markdown, until all are done or the
 * program is asked to end. */
sadmm_status known_print(const sadmm_world_def *def, int count, int levels, FILE *out, struct sadmm_error *error);

#endif
