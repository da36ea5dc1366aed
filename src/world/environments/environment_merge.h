/* All environments of a backend that keeps its worlds (CUDA) in one world: objects environment by environment, each
 * with all of the template's, so that rows of arrays, and contacts, are in this order, too. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_MERGE_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_MERGE_H

#include "environment_types.h"

/* *environments have a merged world, of copies of their first worker's. Errors: LIMIT, OUT_OF_MEMORY, UNAVAILABLE (what
 * cannot be copied so); those of worlds. */
sadmm_status sadmm_environments_merge(struct sadmm_environments *environments, struct sadmm_error *error);
void sadmm_environments_free_merged(struct sadmm_environments *environments);

/* A worker's world becomes an environment as it is in the merged world; an environment there becomes what the worker's
 * world is, but for its input numbers, which stay. Contacts come with sadmm_environments_put_contacts, which must
 * follow. Errors: OUT_OF_MEMORY, DEVICE; those of steps begun. */
sadmm_status sadmm_environments_take(struct sadmm_environments *environments, sadmm_world *world, int32_t environment);
sadmm_status sadmm_environments_put(struct sadmm_environments *environments, sadmm_world *world, int32_t environment);
sadmm_status sadmm_environments_put_contacts(struct sadmm_environments *environments);

/* The report of an environment that is not marked; false: nothing has measured its last step, and what would say how
 * well it was solved is not known. Its pairs are not told. */
bool sadmm_environments_report(const struct sadmm_environments *environments, int32_t environment,
                               sadmm_step_report *report);

/* The environment of a body of the merged world, by its slot. */
int32_t sadmm_environments_of_body(const struct sadmm_environments *environments, size_t slot);
/* Contacts of the merged world, an environment's as the template would have them. `all`: of sadmm_world_contacts. */
void sadmm_environments_rename_contact(const struct sadmm_environments *environments, sadmm_contact *contact,
                                       int32_t *environment);

#endif
