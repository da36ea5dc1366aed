/* system_math.h behind functions, in double, for sources that are compiled per precision. */
#ifndef SADMM_CORE_MODEL_SYSTEM_TERMS_H
#define SADMM_CORE_MODEL_SYSTEM_TERMS_H

#include "core/math/trapezoid.h"
#include "system.h"

/* e of a pair's k-th point, m/s; points: the pair's. */
double sadmm_point_error(const struct sadmm_system *system, const struct sadmm_settings *settings,
                         const struct sadmm_contact_pair *pair, const struct sadmm_contact_point *points, int32_t k);

/* sadmm_kinematic_about_other (system_math.h). */
void sadmm_kinematic_motion(const struct sadmm_system *system, const struct sadmm_contact_pair *pair, double motion[6]);

/* A body's trapezoid correction (math/trapezoid.h), and what contacts compare it with. World frame. */
struct sadmm_trapezoid {
    double correction[6];               /* m/s, rad/s */
    double linear, angular;             /* size3 of its parts */
    double moves_linear, moves_angular; /* trapezoid_speed_part: m/s, rad/s */
    double rest;                        /* trapezoid_rest_speed, m/s */
    double halfway[4], spin[3];         /* what A and b are of (spin.h): sadmm_body_terms */
    enum trapezoid_kind kind;           /* what becomes of it: TRAPEZOID_OWN, until contacts are known */
    int touch;                          /* forces_touch (forces.h) */
};

/* A (count x PACKED6: lower triangles) and b (count x 6) of eq. (1), of bodies [first, first + count); trapezoids: of
 * those with a state. */
void sadmm_body_terms(const struct sadmm_system *system, const struct sadmm_settings *settings, size_t first,
                      size_t count, double *A, double *b, struct sadmm_trapezoid *trapezoids);

/* Trapezoid corrections of `count` bodies, each by itself, which end the step with `velocity` (count x 6). */
void sadmm_find_trapezoids(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                           const struct sadmm_settings *settings, struct sadmm_trapezoid *trapezoids);

/* States after dt: `next` are `bodies` with `velocity` (end-of-step, count x 6), moved with that less their
 * corrections. */
void sadmm_advance(size_t count, const struct sadmm_rigid *bodies, const double *velocity,
                   const struct sadmm_trapezoid *trapezoids, double dt, struct sadmm_rigid *next);

/* Of a body whose pose and velocity are found later (joint_trapezoid.h): the rest. */
void sadmm_advance_later(const struct sadmm_rigid *body, struct sadmm_rigid *next);

#endif
