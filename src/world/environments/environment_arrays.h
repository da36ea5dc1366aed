/* Arrays that are bound, in steps. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_ARRAYS_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_ARRAYS_H

#include "environment_work.h"

/* The worker's world, which is an environment already, has what its input arrays have. Errors: those of
 * sadmm_world_set_array. */
sadmm_status sadmm_environments_read_inputs(struct sadmm_environments *environments,
                                            struct sadmm_environment_worker *worker, int32_t environment);
/* The same; an array that is refused is the template's. */
sadmm_status sadmm_environments_read_good_inputs(struct sadmm_environments *environments,
                                                 struct sadmm_environment_worker *worker, int32_t environment);
/* The same of sizes and places of shapes alone: what rays see besides the state. */
sadmm_status sadmm_environments_read_good_forms(struct sadmm_environments *environments,
                                                struct sadmm_environment_worker *worker, int32_t environment);
/* The other arrays that are bound, and contacts where they are recorded, are those of the worker's world. */
sadmm_status sadmm_environments_write_outputs(struct sadmm_environments *environments,
                                              struct sadmm_environment_worker *worker, int32_t environment);

#endif
