/* The members of sadmm_settings, once (fields.h). */
#ifndef SADMM_CORE_BASE_SETTINGS_FIELDS_H
#define SADMM_CORE_BASE_SETTINGS_FIELDS_H

#include "fields.h"
#include "subadmm/settings.h"

#define SADMM_SETTINGS(F, X)                                                                                           \
    F(X, REAL, NUMBER, dt, 0.005, 1e-6, 1, CLOSED, "Time step, s.")                                                    \
    F(X, WHOLE, PLAN, substeps, 1, 1, 64, CLOSED, "Sub-steps of a step, which share its iterations.")                  \
    F(X, VECTOR, NUMBER, gravity, SADMM_NUMBERS(0, 0, -9.81), -1e6, 1e6, ANY,                                          \
      "m/s^2, world frame; norm <= 1e6.")                                                                              \
    F(X, METHOD, PLAN, method, SADMM_METHOD_FAST, 0, 1, ANY, "'fast' or 'paper'.")                                     \
    F(X, REAL, NUMBER, tolerance, 1e-6, 0, 0, FROM,                                                                    \
      "Error of a step, m/s, at which it is solved; 0: all iterations are made.")                                      \
    F(X, WHOLE, PLAN, iterations, 200, 1, 1000000, CLOSED, "Iterations a step, at most.")                              \
    F(X, REAL, NUMBER, relaxation, 1.8, 1, 2, BELOW, "Over-relaxation of 'fast'.")                                     \
    F(X, WHOLE, PLAN, penalty_period, 30, 0, 2147483647, CLOSED,                                                       \
      "'paper': iterations between penalty updates, 0: never.")                                                        \
    F(X, REAL, NUMBER, penalty_mass_factor, 16, 0, 1e12, CLOSED, "'paper': M of eq. (13).")                            \
    F(X, REAL, NUMBER, penalty_offset, 1e5, 0, 1e15, CLOSED, "'paper': c of eq. (13), kg/s^2.")                        \
    F(X, REAL, NUMBER, penalty_ratio_limit, 4, 1, 1e6, CLOSED, "'paper': alpha of eq. (15).")                          \
    F(X, FLAG, PLAN, penalty_update_warm, false, 0, 1, ANY, "'paper': also update in steps that start warm.")          \
    F(X, FLAG, PLAN, warm_start, true, 0, 1, ANY, "Start from the last step's impulses and velocities.")               \
    F(X, WHOLE, PLAN, ncp_points, 64, 0, 128, CLOSED,                                                                  \
      "Islands of at most so many contact points: dense contact solve (NCP); 0: none.")                                \
    F(X, REAL, PLAN, residual_tolerance, 0, 0, 0, FROM, "Stop when both residuals are at most this; 0: never.")        \
    F(X, WHOLE, PLAN, check_period, 20, 1, 1000000, CLOSED, "Iterations between convergence checks.")                  \
    F(X, FLAG, PLAN, measure_residuals, false, 0, 1, ANY, "Report the residuals of the last iteration.")               \
    F(X, FLAG, PLAN, certify, false, 0, 1, ANY, "Report the true error of every step.")                                \
    F(X, FLAG, PLAN, recover_wrenches, true, 0, 1, ANY, "Compute the contact wrench of every body.")                   \
    F(X, REAL, NUMBER, correction_factor, 0.2, 0, 1, CLOSED, "Share of penetration that a (sub-)step removes.")        \
    F(X, REAL, NUMBER, slop, 1e-5, 0, 1, CLOSED, "Penetration left alone, m.")                                         \
    F(X, REAL, NUMBER, correction_speed, 1, 0, 1e3, CLOSED, "Cap of the corrective speed, m/s.")                       \
    F(X, REAL, NUMBER, restitution_threshold, 0.1, 0, 0, FROM,                                                         \
      "Approach speed under which restitution is ignored, m/s.")                                                       \
    F(X, WHOLE, PLAN, hits, 16, 0, 64, CLOSED,                                                                         \
      "Hits of a body in flight that are taken at their moments, at most, a (sub-)step; 0: the solve has all.")        \
    F(X, WHOLE, PLAN, threads, 0, 0, 1024, CLOSED,                                                                     \
      "CPU threads at most; 0: OpenMP's default. Results do not depend on it.")

/* A number of iterations a step, 20, and nothing else: no tolerance, no dense contact solve. */
static inline void sadmm_settings_fix_work(sadmm_settings *settings)
{
    settings->tolerance = 0;
    settings->iterations = 20;
    settings->ncp_points = 0;
    settings->check_period = 10;
}

#define SADMM_DEFAULT_SETTINGS {SADMM_SETTINGS(SADMM_FIELD_DEFAULT, )}

enum { SADMM_SETTING_COUNT = 0 SADMM_SETTINGS(SADMM_FIELD_ONE, ) };
#ifdef __cplusplus
extern "C" {
#endif
extern const struct sadmm_field sadmm_settings_table[SADMM_SETTING_COUNT];
#ifdef __cplusplus
}
#endif

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

/* X(name) of every double that is data of formulas. */
#define SADMM_EACH_SETTING_NUMBER(X) SADMM_SETTINGS(SADMM_SETTING_IF_NUMBER, X)
#define SADMM_SETTING_IF_NUMBER(X, kind, role, name, ...) SADMM_SETTING_##role##_##kind(X, name)
#define SADMM_SETTING_NUMBER_REAL(X, name) X(name)
#define SADMM_SETTING_NUMBER_VECTOR(X, name) X(name[0]) X(name[1]) X(name[2])
#define SADMM_SETTING_PLAN_REAL(X, name)
#define SADMM_SETTING_PLAN_WHOLE(X, name)
#define SADMM_SETTING_PLAN_FLAG(X, name)
#define SADMM_SETTING_PLAN_METHOD(X, name)

#define SADMM_COUNT_NUMBER(name) +1
enum { SADMM_SETTING_NUMBERS = 0 SADMM_EACH_SETTING_NUMBER(SADMM_COUNT_NUMBER) };

#endif
