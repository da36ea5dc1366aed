/* Bodies: what may be set. */
#ifndef SADMM_WORLD_OBJECTS_BODY_H
#define SADMM_WORLD_OBJECTS_BODY_H

#include "world/state/world_state.h"

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
