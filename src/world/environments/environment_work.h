/* Environments' work, shared out over threads. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_WORK_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_WORK_H

#include "environment_types.h"

/* A worker's world becomes an environment, and an environment what a worker's world is. Errors: those of the steps
 * begun, OUT_OF_MEMORY. */
sadmm_status sadmm_environments_load(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                     int32_t environment);
sadmm_status sadmm_environments_store(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                      int32_t environment);

/* Work of one environment, the `place`-th of a call, by a worker. Its status is the call's where no earlier one
 * failed. */
typedef sadmm_status sadmm_environment_work(struct sadmm_environments *environments,
                                            struct sadmm_environment_worker *worker, int32_t environment, int32_t place,
                                            void *argument);
/* The work of `count` environments, of all where `which` is NULL, shared out over threads. */
sadmm_status sadmm_environments_each(struct sadmm_environments *environments, const int32_t *which, int32_t count,
                                     sadmm_environment_work *work, void *argument);

#endif
