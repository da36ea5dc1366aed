/* Contacts of environments that are recorded. */
#ifndef SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_CONTACTS_H
#define SADMM_WORLD_ENVIRONMENTS_ENVIRONMENT_CONTACTS_H

#include "environment_types.h"

/* Where they are recorded, those of the worker's world; none after a state was loaded. */
sadmm_status sadmm_environments_keep_contacts(struct sadmm_environments *environments,
                                              struct sadmm_environment_worker *worker, int32_t environment);
/* The same of all of a merged world that are not marked. */
sadmm_status sadmm_environments_keep_merged_contacts(struct sadmm_environments *environments);
/* No contacts are recorded any more. */
void sadmm_environments_free_contacts(struct sadmm_environments *environments);

#endif
