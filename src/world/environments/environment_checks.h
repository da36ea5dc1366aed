/* What there is of environments to be asked for, and which of them are marked. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_CHECKS_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_CHECKS_H

#include "environment_types.h"

/* Marks: an environment makes no further steps, and why; it does again. */
void sadmm_environments_put_mark(struct sadmm_environments *environments, int32_t environment, const char *why);
void sadmm_environments_take_mark(struct sadmm_environments *environments, int32_t environment);

/* Are these environments, none of them twice? NULL: all; *count is their number. Else INVALID_ARGUMENT. */
sadmm_status sadmm_environments_check_which(struct sadmm_environments *environments, const int32_t *which,
                                            int32_t *count);
/* INVALID_ARGUMENT, with the argument's name, of a number that is no environment's. */
sadmm_status sadmm_environments_check(struct sadmm_environments *environments, const char *name, int32_t environment);

#endif
