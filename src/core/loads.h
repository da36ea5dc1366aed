/* Loads to start a solve from where no step came before it (method `fast`). */
#ifndef SADMM_CORE_LOADS_H
#define SADMM_CORE_LOADS_H

#include "error.h"
#include "system.h"

/* Hands the motion that every body would have alone down to the ground: bodies are taken from the farthest one (in contacts)
 * to the nearest, and each is stopped by its contacts with nearer ones, which are held still meanwhile. That is a
 * solution where nothing rests on its equals (stacks, pyramids), and a first guess elsewhere; momentum balances exactly.
 * Contacts given by geometry only. Overwrites start values: the impulses of `contacts` and `velocity`. */
sadmm_status sadmm_loads_predict(struct sadmm_system *system, const struct sadmm_settings *settings,
                                 struct sadmm_error *error);

#endif
