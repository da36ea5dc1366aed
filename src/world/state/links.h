/* Lists of slots that belong to a body or a joint, through links that lie with the slots: in and out of them is O(1). A
 * link has a name, 1 and up; 0 is none. */
#ifndef SADMM_WORLD_STATE_LINKS_H
#define SADMM_WORLD_STATE_LINKS_H

#include <stdint.h>

#include "subadmm/types.h"

struct sadmm_link {
    uint32_t previous, next;
};

typedef struct sadmm_link *(*sadmm_link_at)(sadmm_world *world, uint32_t name);

static inline void sadmm_link_add(sadmm_world *world, sadmm_link_at at, uint32_t *first, uint32_t name)
{
    *at(world, name) = (struct sadmm_link){0, *first};
    if (*first) at(world, *first)->previous = name;
    *first = name;
}

static inline void sadmm_link_remove(sadmm_world *world, sadmm_link_at at, uint32_t *first, uint32_t name)
{
    const struct sadmm_link link = *at(world, name);
    if (link.previous) at(world, link.previous)->next = link.next;
    else *first = link.next;
    if (link.next) at(world, link.next)->previous = link.previous;
}

#endif
