/* system_math.h behind functions, in double, for sources that are compiled per precision. */
#ifndef SADMM_CORE_MODEL_SYSTEM_TERMS_H
#define SADMM_CORE_MODEL_SYSTEM_TERMS_H

#include "core/math/lead.h"
#include "system.h"

/* e of a pair's k-th point, m/s; points: the pair's. */
double sadmm_point_error(const struct sadmm_system *system, const struct sadmm_settings *settings,
                         const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points, int32_t k);

/* sadmm_driven_about_other (system_math.h). */
void sadmm_driven_motion(const struct sadmm_system *system, const struct sadmm_contact_pair *pair, double motion[6]);

/* What contacts ask of a body's lead (math/lead.h). World frame. */
struct sadmm_lead {
    double lead[6];                     /* m/s, rad/s */
    double linear, angular;             /* size3 of its parts */
    double moves_linear, moves_angular; /* lead_speed_part: m/s, rad/s */
    double rest;                        /* lead_rest_speed, m/s */
    double halfway[4], spin[3];         /* what A and b are of (spin.h): sadmm_body_terms */
    enum lead_kind kind;                /* what becomes of it: LEAD_OWN, until contacts are known */
    int touch;                          /* forces_touch (forces.h) */
};

/* A (count x PACKED6: lower triangles) and b (count x 6) of eq. (1), of bodies [first, first + count); leads: of those with
 * a state. */
void sadmm_body_terms(const struct sadmm_system *system, const struct sadmm_settings *settings, size_t first,
                      size_t count, double *A, double *b, struct sadmm_lead *leads);

/* Leads of `count` bodies, each by itself, which end the step with `velocity` (count x 6). */
void sadmm_find_leads(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                      const struct sadmm_settings *settings, struct sadmm_lead *leads);

/* States after dt: `next` are `bodies` with `velocity` (end-of-step, count x 6), moved with that less their leads. */
void sadmm_advance(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                   const struct sadmm_lead *leads, double dt, struct sadmm_rigid *next);

#endif
