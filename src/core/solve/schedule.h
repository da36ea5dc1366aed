/* A solve by the host: the stages of stages.h, through a backend's kernel table. */
#ifndef SADMM_CORE_SOLVE_SCHEDULE_H
#define SADMM_CORE_SOLVE_SCHEDULE_H

#include "kernels.h"
#include "ncp.h"
#include "solve_error.h"
#include "stages.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the stages of one solve work on. */
struct sadmm_solve {
    const struct sadmm_kernels *kernels;
    struct sadmm_context *context;
    struct sadmm_system *system;
    const struct sadmm_settings *settings;
    const struct sadmm_plan *plan;
    struct sadmm_solve_report *report;
    struct sadmm_error *error;
    struct sadmm_residual residual;    /* measured last */
    struct sadmm_solve_errors *errors; /* of the last check that looked at islands */
    const struct sadmm_ncp *ncp;       /* NULL: none; its islands need no iterations */
    bool errors_known;                 /* errors are those of the solution */
    bool ncp_missed;                   /* some of its islands missed the tolerance then */
};

/* What a solve's report says before the first stage: not converged, residuals -1, ncp_max -1. */
sadmm_solve_report sadmm_solve_report_empty(const struct sadmm_kernels *kernels);

/* One stage of a solve; nothing for those of a world. A solution that is not finite gives SADMM_ERROR_NON_FINITE; the
 * system's start values are gone then: callers that promise to keep them keep a copy. */
sadmm_status sadmm_solve_stage(struct sadmm_solve *solve, struct sadmm_stages *stages, const struct sadmm_stage *stage);

/* All stages of a solve. Fills `report` but for the final certificate: iterations, converged, residual (-1 when not
 * measured), solve_ms (assembly and iterations). errors: memory, for a tolerance; may be NULL. */
sadmm_status sadmm_schedule_solve(const struct sadmm_kernels *kernels, struct sadmm_context *context,
                                  struct sadmm_system *system, const struct sadmm_settings *settings,
                                  const struct sadmm_plan *plan, struct sadmm_solve_errors *errors,
                                  struct sadmm_solve_report *report, struct sadmm_error *error);

#ifdef __cplusplus
}
#endif
#endif
