/* Arrays and kept states of a merged world in its backend's memory, where that has any for them: steps, resets and
 * arrays then do without the host. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_BACKEND_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_BACKEND_H

#include "environment_types.h"

/* What the merged world's backend is to know of environments. Errors: OUT_OF_MEMORY, DEVICE. */
sadmm_status sadmm_environments_open_backend(struct sadmm_environments *environments);
void sadmm_environments_close_backend(struct sadmm_environments *environments);

/* DEVICE where the device has failed, and what it had of environments is lost. */
sadmm_status sadmm_environments_check_backend(struct sadmm_environments *environments);

/* Memory of a bound array, where the backend has it; without, it is the host's. Errors: OUT_OF_MEMORY, DEVICE. */
sadmm_status sadmm_environments_place_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound);
void sadmm_environments_release_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound);
/* The host's numbers of an array become the backend's; and the other way round, where these may be newer. */
sadmm_status sadmm_environments_push_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound);
sadmm_status sadmm_environments_pull_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound);

/* Can the backend do that with the array, as the merged world is now? */
bool sadmm_environments_may_exchange(const struct sadmm_environments *environments,
                                     const struct sadmm_bound_array *bound);
/* Numbers of all that are not marked: of the world into the array, or (an input array) the array's into the world. It
 * is enqueued. */
sadmm_status sadmm_environments_exchange(struct sadmm_environments *environments, struct sadmm_bound_array *bound);
/* Can each have its own gravity, with the settings that there are? From then on each has, the settings' at first.
 * Errors: OUT_OF_MEMORY, those of steps begun. */
bool sadmm_environments_may_have_gravities(const struct sadmm_environments *environments);
sadmm_status sadmm_environments_open_gravities(struct sadmm_environments *environments);
/* Until that has been done. */
sadmm_status sadmm_environments_wait_backend(struct sadmm_environments *environments);
/* And were any numbers since that was asked last out of range, and not taken? merged.refusals says of which. */
sadmm_status sadmm_environments_find_refused(struct sadmm_environments *environments, bool *any);

/* Reports of all that are not marked say how well the last step was solved. */
sadmm_status sadmm_environments_measure(struct sadmm_environments *environments);

/* Environments begin with kept states, if the backend has all that it takes; else *done is false. */
sadmm_status sadmm_environments_put_kept(struct sadmm_environments *environments, const int32_t *which, int32_t count,
                                         const int32_t *states, bool *done);
/* A state that is kept is no more. */
void sadmm_environments_forget_kept(struct sadmm_environments *environments, size_t state);

#endif
