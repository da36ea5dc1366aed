/* Loads to start a solve from where no step came before it (method `fast`). */
#ifndef SADMM_CORE_SOLVE_LOADS_H
#define SADMM_CORE_SOLVE_LOADS_H

#include "core/base/error.h"
#include "core/model/system.h"

/* Hands the momentum that every body would have alone down to the ground: bodies are taken from the farthest one
 * (in contacts) to the nearest, and each is stopped by the least impulses of its contacts with nearer ones. In an
 * island where that stops every body within the friction cones (stacks, pyramids) it is a solution, and kept; other
 * islands start from impulses 0 and A^-1 b, since a guess that is no solution turned out to cost iterations. Contacts
 * given by geometry only. Overwrites start values: the impulses of `contacts` and `velocity`. */
sadmm_status sadmm_loads_predict(struct sadmm_system *system, const struct sadmm_settings *settings,
                                 struct sadmm_error *error);

#endif
