/* Contacts of environments that are recorded. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_CONTACTS_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_CONTACTS_H

#include "environment_types.h"

/* Where they are recorded, those of the worker's world; none after a state was loaded. */
sadmm_status sadmm_environments_keep_contacts(struct sadmm_environments *environments,
                                              struct sadmm_environment_worker *worker, int32_t environment);
/* The same of all of a merged world that are not marked. */
sadmm_status sadmm_environments_keep_merged_contacts(struct sadmm_environments *environments);
/* There are none of these environments, which have new states. which NULL: of the first `count`. */
void sadmm_environments_forget_contacts(struct sadmm_environments *environments, const int32_t *which, int32_t count);
/* No contacts are recorded any more. */
void sadmm_environments_free_contacts(struct sadmm_environments *environments);

#endif
