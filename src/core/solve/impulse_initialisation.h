/* Initial impulses of a solve that no step came before (method `fast`). */
#ifndef SADMM_CORE_SOLVE_IMPULSE_INITIALISATION_H
#define SADMM_CORE_SOLVE_IMPULSE_INITIALISATION_H

#include "core/base/error.h"
#include "core/model/system.h"

/* Hands the momentum that every body would have alone down to the ground: bodies are taken from the farthest one
 * (in contacts) to the nearest, and each is stopped by the least impulses of its contacts with nearer ones. In an
 * island where that stops every body within the friction cones (stacks, pyramids) it is a solution, and kept; other
 * islands start from impulses 0 and A^-1 b, since initial impulses that are no solution cost iterations. Contacts
 * given by geometry only. Overwrites start values: the impulses of `contacts` and `velocity`. */
sadmm_status sadmm_impulses_initialise(struct sadmm_system *system, const struct sadmm_settings *settings,
                                       struct sadmm_error *error);

#endif
