/* The schedule of a solve: the order of the kernel table's entries, penalty updates and stop rules. */
#ifndef SADMM_CORE_SCHEDULE_H
#define SADMM_CORE_SCHEDULE_H

#include "kernels.h"
#include "subadmm/world.h"

/* Solve `system` with one backend: assembly, iterations, solution back into `system`. Fills report->iterations,
 * converged, residual (-1 when not measured), solve_ms (assembly and iterations), certificate (only when a certificate
 * tolerance made it necessary, else ncp_max = -1). `ms` (may be NULL) receives assemble and solve, in ms.
 * A solution that is not finite gives SADMM_ERROR_NON_FINITE; the system's start values are gone then: callers that
 * promise to keep them keep a copy. */
sadmm_status sadmm_schedule_solve(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                  struct sadmm_system *system, const struct sadmm_settings *settings,
                                  const struct sadmm_plan *plan, struct sadmm_solve_report *report,
                                  struct sadmm_phase_times *ms, struct sadmm_error *error);

/* Monotonic wall clock, ms. */
double sadmm_clock_ms(void);

#endif
