/* What the files that fill a world share: refusals, and references to what has been read. */
#include "filler.h"

#include <stdio.h>
#include <string.h>

sadmm_status sadmm_refuse_world(const struct sadmm_filler *f, sadmm_status status, const char *joint)
{
    return sadmm_refuse_as(&f->reader, status, joint, sadmm_world_message(f->world));
}

sadmm_status sadmm_refuse_last(const struct sadmm_filler *f, sadmm_status status, const char *joint)
{
    char message[SADMM_MESSAGE_SIZE]; /* the buffer that sadmm_last_message shows is written anew */
    if (status == SADMM_OK) return status;
    snprintf(message, sizeof message, "%s", sadmm_last_message());
    return sadmm_refuse_as(&f->reader, status, joint, message);
}

/* ---- references -------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_read_number_in(const struct sadmm_filler *f, const json_t *object, const char *member, size_t count,
                                  int64_t *number)
{
    const json_t *value = json_object_get(object, member);
    if (!value) return sadmm_refuse(&f->reader, member, "is missing");
    if (count == 0) return sadmm_refuse(&f->reader, member, "names one of a list that is empty");
    return sadmm_read_whole(&f->reader, member, value, 0, (double)(count - 1), number);
}

sadmm_status sadmm_read_object_name(const struct sadmm_filler *f, const json_t *object, const char **name)
{
    enum { LONGEST_NAME = 63 };
    TRY(sadmm_read_string(&f->reader, object, "name", name));
    if (*name && strlen(*name) > LONGEST_NAME)
        return sadmm_refuse(&f->reader, "name", "must have at most %d bytes, has %zu", LONGEST_NAME, strlen(*name));
    return SADMM_OK;
}

/* Numbers of bodies by their names, -1 of a name that several have. */
static sadmm_status list_names(struct sadmm_filler *f)
{
    const json_t *list = json_object_get(f->root, "bodies");
    f->names = json_object();
    for (size_t k = 0; k < f->body_count; ++k) {
        const char *name = json_string_value(json_object_get(json_array_get(list, k), "name"));
        const bool known = name && json_object_get(f->names, name);
        if (name && json_object_set_new(f->names, name, json_integer(known ? -1 : (json_int_t)k)) != 0)
            return sadmm_fail_memory(f->reader.error, "the names of a scene file");
    }
    return f->names ? SADMM_OK : sadmm_fail_memory(f->reader.error, "the names of a scene file");
}

static sadmm_status find_name(struct sadmm_filler *f, const char *member, const json_t *value, int64_t *number)
{
    if (!f->names) TRY(list_names(f));
    const json_t *found = json_object_get(f->names, json_string_value(value));
    *number = found ? json_integer_value(found) : -1;
    if (*number >= 0) return SADMM_OK;
    return sadmm_refuse_value(&f->reader, member, found ? "the name of one body only" : "the name of a body", value);
}

sadmm_status sadmm_read_body(struct sadmm_filler *f, const json_t *object, const char *member, int64_t *number)
{
    const json_t *value = json_object_get(object, member);
    *number = -1;
    if (!value || json_is_null(value)) return SADMM_OK;
    if (json_is_string(value)) return find_name(f, member, value, number);
    return sadmm_read_number_in(f, object, member, f->body_count, number);
}
