#include "contact_set.h"

#include <string.h>

#include "memory.h"

bool sadmm_contact_set_reserve_migrations(struct sadmm_contact_set *contacts, size_t points)
{
    const size_t room = SADMM_ROOM(contacts->migrations),
                 there = contacts->point_count < room ? contacts->point_count : room;
    return SADMM_GROW(contacts->migrations, contacts->migrating > 0 ? there : 0, points);
}

void sadmm_contact_set_free(struct sadmm_contact_set *contacts)
{
    if (!contacts) return;
    sadmm_free(contacts->pairs);
    sadmm_free(contacts->points);
    sadmm_free(contacts->migrations);
    memset(contacts, 0, sizeof *contacts);
}
