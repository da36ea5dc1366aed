/* Contacts, as they are read. */
#ifndef SADMM_WORLD_OBJECTS_CONTACTS_H
#define SADMM_WORLD_OBJECTS_CONTACTS_H

#include "world/state/world_state.h"

/* How many contacts of the last step can be read; and these, first to first + count - 1, once the host has them. */
int32_t sadmm_world_readable_contacts(const sadmm_world *world);
void sadmm_world_copy_contacts(const sadmm_world *world, int32_t first, int32_t count, sadmm_contact *contacts);

#endif
