/* Every dynamic body's state after every step (and before the first), as CSV. */
#ifndef SADMM_CLI_RUN_TRACE_H
#define SADMM_CLI_RUN_TRACE_H

#include "run_record.h"

/* NULL, with a message on stderr, when the file cannot be made. */
FILE *run_trace_open(const char *path);
bool run_trace_step(FILE *trace, const struct run_record *record, const sadmm_world *world, double time);
/* False when something could not be written. */
bool run_trace_close(FILE *trace, const char *path);

#endif
