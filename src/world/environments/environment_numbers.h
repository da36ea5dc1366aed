/* Numbers of arrays that are bound, of one environment. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_NUMBERS_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_NUMBERS_H

#include "environment_types.h"

/* The first that is bound of an array, in any precision where it is -1; NULL: none. */
struct sadmm_bound_array *sadmm_environments_bound(const struct sadmm_environments *environments, sadmm_array array,
                                                   int precision);

/* The host's numbers, in double. */
void sadmm_bound_load(const struct sadmm_bound_array *bound, int32_t environment, double *out);
void sadmm_bound_store(const struct sadmm_bound_array *bound, int32_t environment, const double *numbers);

/* Numbers that were rounded to the array's precision, and out of their range by that, become what they were meant to
 * be. */
void sadmm_bound_mend(const struct sadmm_bound_array *bound, double *numbers);

/* All rows of a world. What one without the numbers has none of is 0; the message of a set names the array. */
sadmm_status sadmm_bound_get_all(sadmm_world *world, sadmm_array array, double *values);
sadmm_status sadmm_bound_set_all(sadmm_world *world, sadmm_array array, const double *values);

/* The worker's world has what an input array has of an environment. good: one that is refused is the template's. */
sadmm_status sadmm_bound_read(struct sadmm_environment_worker *worker, const struct sadmm_bound_array *bound,
                              int32_t environment, bool good);
/* The same of frames of joints, which joints' positions are by, where they are an array; of a merged world, as its last
 * step had them. */
sadmm_status sadmm_environments_read_good_frames(struct sadmm_environments *environments,
                                                 struct sadmm_environment_worker *worker, int32_t environment);

#endif
