/* The text of a file: a member a line, a row of numbers a line, and every number in as few digits as bring it back. */
#include <locale.h>
#include <stdlib.h>
#include <string.h>

#include "write_text.h"

static bool is_flat(const json_t *array)
{
    json_t *value;
    size_t k;
    json_array_foreach((json_t *)array, k, value) if (json_is_array(value) || json_is_object(value)) return false;
    return true;
}

static bool line(FILE *stream, const char *before, int depth)
{
    return fprintf(stream, "%s\n%*s", before, 2 * depth, "") >= 0;
}

/* 17 digits always do, mostly 15. With a point or an exponent, as a number that need not be whole; the point is one in
 * any locale. */
static bool write_real(double x, FILE *stream)
{
    char text[40];
    int digits = 14;
    do snprintf(text, sizeof text, "%.*g", ++digits, x);
    while (digits < 17 && strtod(text, NULL) != x);
    const char *const point = localeconv()->decimal_point;
    char *const at = strstr(text, point);
    if (!at) return fprintf(stream, "%s%s", text, strchr(text, 'e') ? "" : ".0") >= 0;
    return fprintf(stream, "%.*s.%s", (int)(at - text), text, at + strlen(point)) >= 0;
}

static bool write_value(const json_t *value, FILE *stream, int depth);

static bool write_array(const json_t *array, FILE *stream, int depth)
{
    const bool flat = is_flat(array);
    const char *between = "";
    json_t *each;
    size_t k;
    if (fputc('[', stream) == EOF) return false;
    json_array_foreach((json_t *)array, k, each)
    {
        const bool begun =
            flat ? fprintf(stream, "%s%s", between, k ? " " : "") >= 0 : line(stream, between, depth + 1);
        if (!begun || !write_value(each, stream, depth + 1)) return false;
        between = ",";
    }
    return (flat || line(stream, "", depth)) && fputc(']', stream) != EOF;
}

static bool write_object(const json_t *object, FILE *stream, int depth)
{
    const char *name, *between = "";
    json_t *each;
    if (fputc('{', stream) == EOF) return false;
    json_object_foreach((json_t *)object, name, each)
    {
        if (!line(stream, between, depth + 1) || fprintf(stream, "\"%s\": ", name) < 0 ||
            !write_value(each, stream, depth + 1))
            return false;
        between = ",";
    }
    return line(stream, "", depth) && fputc('}', stream) != EOF;
}

static bool write_value(const json_t *value, FILE *stream, int depth)
{
    if (json_is_array(value)) return write_array(value, stream, depth);
    if (json_is_object(value)) return write_object(value, stream, depth);
    if (json_is_real(value)) return write_real(json_real_value(value), stream);
    return json_dumpf(value, stream, JSON_ENCODE_ANY) == 0;
}

bool sadmm_write_text(const json_t *root, FILE *stream)
{
    return write_value(root, stream, 0) && fputc('\n', stream) != EOF && !ferror(stream);
}
