#include "fields.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

/* Comparisons are written so that NaN fails them. */
static bool in_range(const struct sadmm_field *of, double x)
{
    switch (of->ends) {
    case SADMM_ENDS_CLOSED: return x >= of->lo && x <= of->hi;
    case SADMM_ENDS_BELOW: return x >= of->lo && x < of->hi;
    case SADMM_ENDS_FROM: return x >= of->lo && x < (double)INFINITY;
    case SADMM_ENDS_ABOVE: return x > of->lo && x < (double)INFINITY;
    case SADMM_ENDS_ANY: break;
    }
    return true;
}

enum { NUMBER_SIZE = 32 };

/* As short as says it: 2e+09, 1.0000001; counts in full. */
static const char *number(const struct sadmm_field *of, double x, char text[NUMBER_SIZE])
{
    const bool whole = of->kind == SADMM_FIELD_WHOLE || of->kind == SADMM_FIELD_BITS;
    snprintf(text, NUMBER_SIZE, "%g", x);
    if (whole || strtod(text, NULL) != x) snprintf(text, NUMBER_SIZE, "%.10g", x);
    return text;
}

static sadmm_status check(const struct sadmm_field *of, double x, const char *prefix, const char *name,
                          struct sadmm_error *error)
{
    const bool to_hi = of->ends == SADMM_ENDS_CLOSED || of->ends == SADMM_ENDS_BELOW;
    char value[NUMBER_SIZE], lo[NUMBER_SIZE], hi[NUMBER_SIZE];
    if (in_range(of, x)) return SADMM_OK;
    number(of, x, value);
    number(of, of->lo, lo);
    if (to_hi)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s%s = %s: must be in [%s, %s%c", prefix, name, value,
                          lo, number(of, of->hi, hi), of->ends == SADMM_ENDS_BELOW ? ')' : ']');
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s%s = %s: must be finite and %s %s", prefix, name, value,
                      of->ends == SADMM_ENDS_ABOVE ? ">" : ">=", lo);
}

static sadmm_status check_each(const struct sadmm_field *field, const double *x, const char *prefix, const char *name,
                               struct sadmm_error *error)
{
    if (field->count == 1) return check(field, *x, prefix, name, error);
    for (int k = 0; k < field->count; ++k) {
        char element[64];
        if (in_range(field, x[k])) continue;
        snprintf(element, sizeof element, "%s[%d]", name, k);
        return check(field, x[k], prefix, element, error);
    }
    return SADMM_OK;
}

sadmm_status sadmm_numbers_check(const struct sadmm_field *field, const double *x, const char *name,
                                 struct sadmm_error *error)
{
    return check_each(field, x, "", name, error);
}

static sadmm_status check_turn(const struct sadmm_field *field, const double *q, const char *prefix,
                               struct sadmm_error *error)
{
    char name[96];
    double ignored[4];
    snprintf(name, sizeof name, "%s%s", prefix, field->name);
    return sadmm_check_orientation(name, q, ignored, error);
}

static sadmm_status check_name(const struct sadmm_field *field, const void *at, const char *prefix,
                               struct sadmm_error *error)
{
    int32_t value;
    memcpy(&value, at, sizeof value);
    if (value >= 0 && value < field->count) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s%s = %d: must be in [0, %d]", prefix, field->name, value,
                      field->count - 1);
}

sadmm_status sadmm_field_check(const struct sadmm_field *field, const void *object, const char *prefix,
                               struct sadmm_error *error)
{
    const void *const at = (const char *)object + field->offset;
    uint32_t bits;
    switch (field->kind) {
    case SADMM_FIELD_REALS:
    case SADMM_FIELD_BOUND:
    case SADMM_FIELD_MEASURED: return check_each(field, (const double *)at, prefix, field->name, error);
    case SADMM_FIELD_TURN: return check_turn(field, (const double *)at, prefix, error);
    case SADMM_FIELD_WHOLE: return check(field, *(const int *)at, prefix, field->name, error);
    case SADMM_FIELD_BITS:
        memcpy(&bits, at, sizeof bits);
        return check(field, bits, prefix, field->name, error);
    case SADMM_FIELD_NAMED: return check_name(field, at, prefix, error);
    case SADMM_FIELD_FLAG:
    case SADMM_FIELD_ID:
    case SADMM_FIELD_OTHER: break;
    }
    return SADMM_OK;
}

sadmm_status sadmm_fields_check(const struct sadmm_field *fields, size_t count, const void *object, const char *prefix,
                                struct sadmm_error *error)
{
    for (size_t k = 0; k < count; ++k) {
        const struct sadmm_field *const f = &fields[k];
        /* Most are one number within its range; joints' targets are checked at every step. */
        if (f->ends == SADMM_ENDS_CLOSED && f->count == 1 &&
            (f->kind == SADMM_FIELD_REALS || f->kind == SADMM_FIELD_BOUND)) {
            const double x = *(const double *)(const void *)((const char *)object + f->offset);
            if (x >= f->lo && x <= f->hi) continue;
        }
        TRY(sadmm_field_check(f, object, prefix, error));
    }
    return SADMM_OK;
}
