/* What a body may be, and what may be set of it. */
#ifndef SADMM_WORLD_OBJECTS_BODY_CHECK_H
#define SADMM_WORLD_OBJECTS_BODY_CHECK_H

#include "world/state/world_state.h"

#define SADMM_WRENCH_LIMIT 1e15 /* N, N m */

/* orientation: normalised. */
sadmm_status sadmm_world_check_body_def(const sadmm_body_def *def, sadmm_precision precision, double orientation[4],
                                        struct sadmm_error *error);
/* An orientation, normalised: what a step made stays as it is, though rounding has taken its length from 1. */
sadmm_status sadmm_world_check_turn(const char *name, const double given[4], double unit[4], struct sadmm_error *error);
/* May that be set? Else INVALID_ARGUMENT. `orientation`: the state's, normalised where it is off by more than rounding.
 * Of a wrench and a mass: of a dynamic body. */
sadmm_status sadmm_world_check_body_state(const struct sadmm_world_body *body, const sadmm_body_state *state,
                                          double orientation[4], struct sadmm_error *error);
sadmm_status sadmm_world_check_wrench(const double force[3], const double torque[3], struct sadmm_error *error);
sadmm_status sadmm_world_check_mass(const sadmm_world *world, double mass, const double inertia[3],
                                    struct sadmm_error *error);
/* INVALID_ARGUMENT where a body's moments of inertia lie further apart than the precision can resolve. */
sadmm_status sadmm_world_check_inertias(sadmm_world *world, sadmm_precision precision);

#endif
