/* The schedule of a solve: the order of the kernel table's entries, penalty updates and stop rules. */
#ifndef SADMM_CORE_SOLVE_SCHEDULE_H
#define SADMM_CORE_SOLVE_SCHEDULE_H

#include "kernels.h"
#include "subadmm/world.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Solve `system` with one backend: assembly, iterations, solution back into `system`. Fills report->iterations,
 * converged, residual (-1 when not measured), solve_ms (assembly and iterations), certificate (only when a certificate
 * tolerance made it necessary, else ncp_max = -1). `ms` (may be NULL) receives assemble and solve, in ms.
 * A solution that is not finite gives SADMM_ERROR_NON_FINITE; the system's start values are gone then: callers that
 * promise to keep them keep a copy. */
sadmm_status sadmm_schedule_solve(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                  struct sadmm_system *system, const struct sadmm_settings *settings,
                                  const struct sadmm_plan *plan, struct sadmm_solve_report *report,
                                  struct sadmm_phase_times *ms, struct sadmm_error *error);

/* Iterations into which nobody has to look, and what comes after them. */
struct sadmm_stretch {
    int count;
    bool last;    /* the budget is spent then */
    bool look;    /* the stop rule looks */
    bool update;  /* eq. (15) */
    bool refresh; /* the weights of method fast are taken anew */
    bool measure; /* the last of them is measured */
};
/* The stretch that begins after `done` iterations, done < sadmm_schedule_budget(). */
struct sadmm_stretch sadmm_schedule_stretch(const struct sadmm_plan *plan, const struct sadmm_settings *settings, int done);
/* Iterations of a solve that nobody stops: without constraints Step 1 is exact at once, v = A^-1 b. */
int sadmm_schedule_budget(const struct sadmm_plan *plan, const struct sadmm_settings *settings);

#ifdef __cplusplus
}
#endif
#endif
