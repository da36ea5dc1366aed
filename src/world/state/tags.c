#include "tags.h"

#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/base/utf8.h"

static sadmm_status make_room(struct sadmm_tags *tags, size_t slot, struct sadmm_error *error)
{
    if (slot < tags->slots) return SADMM_OK;
    if (!SADMM_GROW(tags->list, tags->slots, slot + 1)) return sadmm_fail_memory(error, "names and user data");
    for (; tags->slots <= slot; ++tags->slots) tags->list[tags->slots] = (struct sadmm_tag){NULL, NULL};
    return SADMM_OK;
}

/* A copy of `given`, cut to the characters that fit. */
static sadmm_status copy_name(const char *given, char **name, struct sadmm_error *error)
{
    const size_t length = given ? sadmm_utf8_fit(given, SADMM_NAME_SIZE - 1) : 0;
    *name = NULL;
    if (given && given[length] && sadmm_utf8_character(given + length) == 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->name: must be UTF-8, its byte %zu (0x%02x) is not",
                          length, (unsigned char)given[length]);
    if (length == 0) return SADMM_OK;
    *name = (char *)sadmm_alloc(length + 1, 1);
    if (!*name) return sadmm_fail_memory(error, "a name");
    memcpy(*name, given, length);
    return SADMM_OK;
}

sadmm_status sadmm_tags_set(struct sadmm_tags *tags, size_t slot, const char *name, void *user_data,
                            struct sadmm_error *error)
{
    struct sadmm_tag made = {NULL, user_data};
    TRY(copy_name(name, &made.name, error));
    const sadmm_status status = made.name || user_data ? make_room(tags, slot, error) : SADMM_OK;
    if (status != SADMM_OK) {
        sadmm_free(made.name);
        return status;
    }
    sadmm_tags_clear(tags, slot);
    if (slot < tags->slots) tags->list[slot] = made;
    return SADMM_OK;
}

sadmm_status sadmm_tags_set_data(struct sadmm_tags *tags, size_t slot, void *user_data, struct sadmm_error *error)
{
    if (user_data) TRY(make_room(tags, slot, error));
    if (slot < tags->slots) tags->list[slot].user_data = user_data;
    return SADMM_OK;
}

void sadmm_tags_clear(struct sadmm_tags *tags, size_t slot)
{
    if (slot >= tags->slots) return;
    sadmm_free(tags->list[slot].name);
    tags->list[slot] = (struct sadmm_tag){NULL, NULL};
}

void sadmm_tags_free(struct sadmm_tags *tags)
{
    for (size_t slot = 0; slot < tags->slots; ++slot) sadmm_free(tags->list[slot].name);
    sadmm_free(tags->list);
    *tags = (struct sadmm_tags){NULL, 0};
}
