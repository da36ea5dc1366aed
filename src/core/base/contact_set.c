#include "contact_set.h"

#include <string.h>

#include "memory.h"

void sadmm_contact_set_free(struct sadmm_contact_set *contacts)
{
    if (!contacts) return;
    sadmm_free(contacts->pairs);
    sadmm_free(contacts->points);
    memset(contacts, 0, sizeof *contacts);
}
