/* Arrays that are bound, in steps. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_ARRAYS_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_ARRAYS_H

#include "environment_types.h"

/* The worker's world, which is an environment already, has what its input arrays have. Errors: those of
 * sadmm_world_set_array. */
sadmm_status sadmm_environments_read_inputs(struct sadmm_environments *environments,
                                            struct sadmm_environment_worker *worker, int32_t environment);
/* The same; an array that is refused is the template's. */
sadmm_status sadmm_environments_read_good_inputs(struct sadmm_environments *environments,
                                                 struct sadmm_environment_worker *worker, int32_t environment);
/* An environment of the merged world has what its input arrays have; what the template has. */
sadmm_status sadmm_environments_read_merged_inputs(struct sadmm_environments *environments, int32_t environment);
sadmm_status sadmm_environments_give_template_inputs(struct sadmm_environments *environments, int32_t environment);
/* Has an input array, which the merged world's backend does not take in by itself, other numbers than the world? */
bool sadmm_environments_inputs_differ(const struct sadmm_environments *environments, int32_t environment);
/* Input arrays of a merged world, where the backend has them: those that it does not take in by itself, or all. */
sadmm_status sadmm_environments_pull_inputs(struct sadmm_environments *environments, bool all);
/* The other arrays that are bound are those of the merged world, of the environments `which` that are not marked. */
sadmm_status sadmm_environments_write_merged_outputs(struct sadmm_environments *environments, const int32_t *which,
                                                     int32_t count);
/* The same of sizes and places of shapes alone: what rays see besides the state. */
sadmm_status sadmm_environments_read_good_forms(struct sadmm_environments *environments,
                                                struct sadmm_environment_worker *worker, int32_t environment);
/* The other arrays that are bound, and contacts where they are recorded, are those of the worker's world. */
sadmm_status sadmm_environments_write_outputs(struct sadmm_environments *environments,
                                              struct sadmm_environment_worker *worker, int32_t environment);

#endif
