#include "writer.h"

#include <stdlib.h>

/* ---- values ------------------------------------------------------------------------------------------------------ */

json_t *sadmm_put(struct sadmm_writer *w, json_t *object, const char *name, json_t *value)
{
    if (json_object_set_new(object, name, value) == 0) return value;
    w->complete = false;
    return NULL;
}

json_t *sadmm_append(struct sadmm_writer *w, json_t *array, json_t *value)
{
    if (json_array_append_new(array, value) == 0) return value;
    w->complete = false;
    return NULL;
}

json_t *sadmm_append_object(struct sadmm_writer *w, json_t *array, const struct sadmm_fields *fields, const void *from)
{
    json_t *object = sadmm_append(w, array, json_object());
    if (!sadmm_write_fields(object, fields, from)) w->complete = false;
    return object;
}

void sadmm_put_name(struct sadmm_writer *w, json_t *object, const char *name)
{
    json_object_del(object, "name");
    if (*name) sadmm_put(w, object, "name", json_string(name));
}

sadmm_status sadmm_pass_on(struct sadmm_writer *w, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(w->error, status, "%s", sadmm_world_message(w->world));
}

/* ---- numbers of bodies, shapes and joints ------------------------------------------------------------------------ */

static int compare_slots(const void *left, const void *right)
{
    const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
    return (a > b) - (a < b);
}

int32_t sadmm_slot_number(const struct sadmm_slot_list *list, uint32_t slot)
{
    const uint32_t *found = (const uint32_t *)bsearch(&slot, list->slots, list->count, sizeof slot, compare_slots);
    return found ? (int32_t)(found - list->slots) : -1;
}
