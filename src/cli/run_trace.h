/* Every dynamic body's state after every step (and before the first), as CSV. */
#ifndef SADMM_CLI_RUN_TRACE_H
#define SADMM_CLI_RUN_TRACE_H

#include "run_record.h"

void run_trace_begin(FILE *trace);
/* False, with a message on stderr, when a state cannot be read. */
bool run_trace_step(FILE *trace, const struct run_record *record, sadmm_world *world, double time);

#endif
