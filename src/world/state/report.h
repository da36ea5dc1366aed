/* The report of a step. */
#ifndef SADMM_WORLD_STATE_REPORT_H
#define SADMM_WORLD_STATE_REPORT_H

#include "world_state.h"

/* `steps` more steps have been done; `done` is what the last of them was like. */
void sadmm_world_report_steps(sadmm_world *world, int64_t steps, const struct sadmm_resident_report *done);

/* As a row of SADMM_ARRAY_REPORT, eight numbers. */
void sadmm_report_numbers(const sadmm_step_report *report, double *row);

#endif
