/* What a caller gives to objects beside what steps need: names, and pointers of its own. By slot, as far as one has
 * been given any: worlds without have none of this, and no step looks here. */
#ifndef SADMM_WORLD_STATE_TAGS_H
#define SADMM_WORLD_STATE_TAGS_H

#include <stddef.h>

#include "core/base/error.h"

enum { SADMM_NAME_SIZE = 64 }; /* a name is cut to what fits, with its final 0 */

struct sadmm_tag {
    char *name; /* a block of its own, so that it stays where it is when slots are added; NULL: none */
    void *user_data;
};

/* All 0: none. */
struct sadmm_tags {
    struct sadmm_tag *list;
    size_t slots; /* that it has */
};

/* Of a new object in a slot; it may still fail to come into it. name: of the caller, NULL: none. Errors:
 * INVALID_ARGUMENT (not UTF-8), OUT_OF_MEMORY; nothing changes. */
sadmm_status sadmm_tags_set(struct sadmm_tags *tags, size_t slot, const char *name, void *user_data,
                            struct sadmm_error *error);
/* Errors: OUT_OF_MEMORY; nothing changes. */
sadmm_status sadmm_tags_set_data(struct sadmm_tags *tags, size_t slot, void *user_data, struct sadmm_error *error);
void sadmm_tags_clear(struct sadmm_tags *tags, size_t slot);
void sadmm_tags_free(struct sadmm_tags *tags);

/* "" where it has none. */
static inline const char *sadmm_tags_name(const struct sadmm_tags *tags, size_t slot)
{
    return slot < tags->slots && tags->list[slot].name ? tags->list[slot].name : "";
}
static inline void *sadmm_tags_data(const struct sadmm_tags *tags, size_t slot)
{
    return slot < tags->slots ? tags->list[slot].user_data : NULL;
}

#endif
