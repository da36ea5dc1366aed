/* Steps of a merged world (environment_merge.h). */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_MERGED_STEP_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_MERGED_STEP_H

#include "environment_types.h"

/* sadmm_environments_step. */
sadmm_status sadmm_environments_step_merged(struct sadmm_environments *environments, int32_t steps);

#endif
