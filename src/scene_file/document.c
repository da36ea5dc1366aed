#include "document.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* ---- text -------------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_parse_json(const struct sadmm_reader *r, const char *text, size_t length, json_t **root)
{
    json_error_t error;
    /* All numbers are doubles, so that those beyond 64-bit integers are read as well. */
    *root = json_loadb(text, length, JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL, &error);
    if (*root) return SADMM_OK;
    if (json_error_code(&error) == json_error_out_of_memory) return sadmm_fail_memory(r->error, "a scene file");
    return sadmm_fail(r->error, SADMM_ERROR_INVALID_ARGUMENT, "%s%sline %d, column %d: %s", r->name,
                      *r->name ? ": " : "", error.line, error.column, error.text);
}

/* ---- errors ------------------------------------------------------------------------------------------------------ */

size_t sadmm_enter(struct sadmm_reader *r, const char *format, ...)
{
    const size_t before = r->length, room = sizeof r->path - before;
    va_list arguments;
    int printed = snprintf(r->path + before, room, "%s", before ? "." : "");
    va_start(arguments, format);
    printed += vsnprintf(r->path + before + printed, room - (size_t)printed, format, arguments);
    va_end(arguments);
    r->length = strlen(r->path);
    (void)printed;
    return before;
}

void sadmm_leave(struct sadmm_reader *r, size_t length)
{
    r->length = length;
    r->path[length] = 0;
}

sadmm_status sadmm_refuse(const struct sadmm_reader *r, const char *member, const char *format, ...)
{
    char what[SADMM_MESSAGE_SIZE / 2];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    const bool both = r->length > 0 && member;
    const char *end = r->length > 0 || member ? ": " : "";
    return sadmm_fail(r->error, SADMM_ERROR_INVALID_ARGUMENT, "%s%s%s%s%.60s%s%s", r->name, *r->name ? ": " : "",
                      r->path, both ? "." : "", member ? member : "", end, what);
}

/* What a message shows of a string: its beginning, without what would move a terminal's cursor. */
static void shown(const char *string, char text[48])
{
    size_t k = 0;
    for (; string[k] && k < 40; ++k) text[k] = (unsigned char)string[k] < 32 || string[k] == 127 ? '?' : string[k];
    strcpy(text + k, string[k] ? "..." : "");
}

sadmm_status sadmm_refuse_value(const struct sadmm_reader *r, const char *member, const char *what, const json_t *value)
{
    char text[48] = "";
    switch (json_typeof(value)) {
    case JSON_OBJECT: return sadmm_refuse(r, member, "must be %s, is an object", what);
    case JSON_ARRAY: return sadmm_refuse(r, member, "must be %s, is an array of %zu", what, json_array_size(value));
    case JSON_STRING:
        shown(json_string_value(value), text);
        return sadmm_refuse(r, member, "must be %s, is \"%s\"", what, text);
    case JSON_INTEGER:
    case JSON_REAL: return sadmm_refuse(r, member, "must be %s, is %.17g", what, json_number_value(value));
    case JSON_TRUE: return sadmm_refuse(r, member, "must be %s, is true", what);
    case JSON_FALSE: return sadmm_refuse(r, member, "must be %s, is false", what);
    case JSON_NULL: break;
    }
    return sadmm_refuse(r, member, "must be %s, is null", what);
}

sadmm_status sadmm_refuse_as(const struct sadmm_reader *r, sadmm_status status, const char *joint, const char *message)
{
    static const char definition[] = "def->";
    char text[SADMM_MESSAGE_SIZE];
    if (status == SADMM_OK) return status;
    const char *const dot = r->length > 0 ? "." : "", *at = message, *next = strstr(at, definition);
    int used = snprintf(text, sizeof text, "%s%s", r->name, *r->name ? ": " : "");
    if (!next && r->length > 0) used += snprintf(text + used, sizeof text - (size_t)used, "%s%s", r->path, joint);
    for (; next && used < (int)sizeof text; next = strstr(at, definition)) {
        used += snprintf(text + used, sizeof text - (size_t)used, "%.*s%s%s", (int)(next - at), at, r->path, dot);
        at = next + sizeof definition - 1;
    }
    if (used < (int)sizeof text) snprintf(text + used, sizeof text - (size_t)used, "%s", at);
    return sadmm_fail(r->error, status, "%s", text);
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

sadmm_status sadmm_read_real(const struct sadmm_reader *r, const char *member, const json_t *value, double *x)
{
    if (!json_is_number(value)) return sadmm_refuse_value(r, member, "a number", value);
    *x = json_number_value(value);
    return SADMM_OK;
}

sadmm_status sadmm_read_reals(const struct sadmm_reader *r, const char *member, const json_t *value, double *x,
                              size_t count)
{
    char element[64];
    if (!json_is_array(value) || json_array_size(value) != count) {
        snprintf(element, sizeof element, "an array of %zu number%s", count, count == 1 ? "" : "s");
        return sadmm_refuse_value(r, member, element, value);
    }
    for (size_t k = 0; k < count; ++k) {
        const json_t *each = json_array_get(value, k);
        if (json_is_number(each)) {
            x[k] = json_number_value(each);
            continue;
        }
        snprintf(element, sizeof element, "%.40s[%zu]", member, k);
        return sadmm_refuse_value(r, element, "a number", each);
    }
    return SADMM_OK;
}

sadmm_status sadmm_read_whole(const struct sadmm_reader *r, const char *member, const json_t *value, double lo,
                              double hi, int64_t *number)
{
    const double x = json_is_number(value) ? json_number_value(value) : NAN;
    char range[80];
    if (x >= lo && x <= hi && x == floor(x)) {
        *number = (int64_t)x;
        return SADMM_OK;
    }
    snprintf(range, sizeof range, "a whole number in [%.0f, %.0f]", lo, hi);
    return sadmm_refuse_value(r, member, range, value);
}

sadmm_status sadmm_read_array(const struct sadmm_reader *r, const json_t *object, const char *member, json_t **array)
{
    *array = json_object_get(object, member);
    if (!*array || json_is_array(*array)) return SADMM_OK;
    return sadmm_refuse_value(r, member, "an array", *array);
}

sadmm_status sadmm_read_string(const struct sadmm_reader *r, const json_t *object, const char *member,
                               const char **string)
{
    const json_t *value = json_object_get(object, member);
    *string = NULL;
    if (!value) return SADMM_OK;
    if (!json_is_string(value)) return sadmm_refuse_value(r, member, "a string", value);
    *string = json_string_value(value);
    return SADMM_OK;
}

/* ---- fields ------------------------------------------------------------------------------------------------------ */

static sadmm_status read_name(const struct sadmm_reader *r, const struct sadmm_field *field, const json_t *value,
                              void *at)
{
    char all[160] = "one of ";
    size_t used = strlen(all);
    for (int32_t k = 0; k < field->count; ++k) {
        if (json_is_string(value) && strcmp(json_string_value(value), field->names[k]) == 0) {
            memcpy(at, &k, sizeof k);
            return SADMM_OK;
        }
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", k ? ", " : "", field->names[k]);
    }
    return sadmm_refuse_value(r, field->name, all, value);
}

static sadmm_status read_field(const struct sadmm_reader *r, const struct sadmm_field *field, const json_t *value,
                               void *into)
{
    void *const at = (char *)into + field->offset;
    int64_t number = 0;
    int32_t whole;
    uint32_t bits;
    bool flag;
    switch (field->kind) {
    case SADMM_FIELD_REALS:
    case SADMM_FIELD_TURN:
        if (field->count == 1) return sadmm_read_real(r, field->name, value, (double *)at);
        return sadmm_read_reals(r, field->name, value, (double *)at, (size_t)field->count);
    case SADMM_FIELD_BOUND:
    case SADMM_FIELD_MEASURED:
        if (!json_is_null(value)) return sadmm_read_real(r, field->name, value, (double *)at);
        *(double *)at = field->kind == SADMM_FIELD_MEASURED ? (double)NAN : (double)INFINITY;
        return SADMM_OK;
    case SADMM_FIELD_FLAG:
        if (!json_is_boolean(value)) return sadmm_refuse_value(r, field->name, "true or false", value);
        flag = json_is_true(value);
        memcpy(at, &flag, sizeof flag);
        return SADMM_OK;
    case SADMM_FIELD_WHOLE:
        TRY(sadmm_read_whole(r, field->name, value, INT32_MIN, INT32_MAX, &number));
        whole = (int32_t)number;
        memcpy(at, &whole, sizeof whole);
        return SADMM_OK;
    case SADMM_FIELD_BITS:
        TRY(sadmm_read_whole(r, field->name, value, 0, UINT32_MAX, &number));
        bits = (uint32_t)number;
        memcpy(at, &bits, sizeof bits);
        return SADMM_OK;
    case SADMM_FIELD_NAMED: return read_name(r, field, value, at);
    case SADMM_FIELD_ID:
    case SADMM_FIELD_OTHER: break;
    }
    return SADMM_OK;
}

static sadmm_status refuse_unknown(const struct sadmm_reader *r, const char *member, const struct sadmm_fields *fields)
{
    char all[SADMM_MESSAGE_SIZE / 2], text[48];
    size_t used = 0;
    all[0] = 0;
    for (size_t k = 0; k < fields->count && used < sizeof all; ++k)
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", k ? ", " : "", fields->list[k].name);
    shown(member, text);
    return sadmm_refuse(r, text, "is no member of %s; it may have %s", fields->what, all);
}

sadmm_status sadmm_read_some(const struct sadmm_reader *r, const json_t *object, const struct sadmm_fields *fields,
                             void *into)
{
    for (size_t k = 0; k < fields->count; ++k) {
        const json_t *value = json_object_get(object, fields->list[k].name);
        if (value && fields->list[k].kind != SADMM_FIELD_OTHER) TRY(read_field(r, &fields->list[k], value, into));
    }
    return SADMM_OK;
}

sadmm_status sadmm_read_fields(const struct sadmm_reader *r, const json_t *object, const struct sadmm_fields *fields,
                               void *into)
{
    const char *member;
    json_t *value;
    if (!json_is_object(object)) return sadmm_refuse_value(r, NULL, "an object", object);
    json_object_foreach((json_t *)object, member,
                        value) if (!sadmm_find_field(fields, member)) return refuse_unknown(r, member, fields);
    return sadmm_read_some(r, object, fields, into);
}
