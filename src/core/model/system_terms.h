/* system_math.h behind functions, in double, for sources that are compiled per precision. */
#ifndef SADMM_CORE_MODEL_SYSTEM_TERMS_H
#define SADMM_CORE_MODEL_SYSTEM_TERMS_H

#include "system.h"

/* A_i (6 x 6, row-major) and b_i of eq. (1). */
void sadmm_body_terms(const struct sadmm_system *system, const struct sadmm_settings *settings, int32_t body,
                      double A[36], double b[6]);

/* e of a pair's k-th point, m/s; points: the pair's. */
double sadmm_point_error(const struct sadmm_system *system, const struct sadmm_settings *settings,
                         const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points, int32_t k);

/* The lead of a body by itself (math/lead.h), which ends the step with `velocity`. */
void sadmm_body_lead(const struct sadmm_rigid *body, const double velocity[6], double lead[6]);

/* The state after dt: `next` is `body` with `velocity` (end-of-step, 6), moved with that less its lead. */
void sadmm_rigid_advance(const struct sadmm_rigid *body, const double velocity[6], const double lead[6], double dt,
                         struct sadmm_rigid *next);

#endif
