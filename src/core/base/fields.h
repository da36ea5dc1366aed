/* Members of settings and definitions as lists (settings_fields.h, definition_fields.h): defaults, ranges and their
 * messages, what is saved, read from and written to files, Python's properties and arguments, the schema of scene files
 * (scripts/lists.py) are made of these. What a member means in full is said in the public headers; the text in a list
 * is one line of it.
 *
 * F(X, kind, role, name, value, lo, hi, ends, text), X passed through:
 *   kind   REAL (double), VECTOR (double[3]), TURN (double[4], a unit quaternion), TWIST (double[6]);
 *          BOUND (double that may be infinite: in files null), MEASURED (double; NaN, in files null: what is measured);
 *          WHOLE (int), BITS (uint32_t), FLAG (bool); METHOD, BODY_TYPE, SHAPE_TYPE, JOINT_KIND, DRIVE (names.h);
 *          ID (of an object); BODY_NAME, POINTS, ..., whatever else: C code alone knows these
 *   role   of settings:    NUMBER: data of formulas, may change from step to step without another plan; PLAN: what a
 *                          step consists of
 *          of definitions: PLAIN; DYNAMIC: of dynamic bodies alone, in files null for others; OWN: files have it in
 *                          another form under this name; HIDDEN: under another one
 *   value  the default
 *   ends   CLOSED: in [lo, hi], the numbers of a vector each; BELOW: in [lo, hi); FROM: finite, >= lo; ABOVE: finite, >
 *          lo; ANY: any value, or a rule of its own beside those of the list
 */
#ifndef SADMM_CORE_BASE_FIELDS_H
#define SADMM_CORE_BASE_FIELDS_H

#include <stddef.h>

#include "error.h"
#include "names.h"

#ifdef __cplusplus
extern "C" {
#endif

enum sadmm_field_kind {
    SADMM_FIELD_REALS, /* `count` doubles */
    SADMM_FIELD_BOUND,
    SADMM_FIELD_TURN,
    SADMM_FIELD_MEASURED,
    SADMM_FIELD_WHOLE,
    SADMM_FIELD_BITS,
    SADMM_FIELD_FLAG,
    SADMM_FIELD_NAMED, /* one of `count` names */
    SADMM_FIELD_ID,
    SADMM_FIELD_OTHER
};
enum sadmm_field_ends {
    SADMM_ENDS_ANY,
    SADMM_ENDS_CLOSED,
    SADMM_ENDS_BELOW,
    SADMM_ENDS_FROM,
    SADMM_ENDS_ABOVE
};

enum sadmm_field_role {
    SADMM_IS_NUMBER,
    SADMM_IS_PLAN,
    SADMM_IS_PLAIN,
    SADMM_IS_DYNAMIC,
    SADMM_IS_OWN,
    SADMM_IS_HIDDEN
};

struct sadmm_field {
    const char *name;
    enum sadmm_field_kind kind;
    int count;
    const char *const *names;
    enum sadmm_field_role role;
    size_t offset; /* in the struct */
    double lo, hi;
    enum sadmm_field_ends ends;
    const char *text;
};

/* A list of a struct's type as rows of a table. */
#define SADMM_FIELD_ROW(type, kind, role, name, value, lo, hi, ends, text) \
    {#name, SADMM_KIND_##kind, SADMM_IS_##role, offsetof(type, name), lo, hi, SADMM_ENDS_##ends, text},
#define SADMM_KIND_REAL SADMM_FIELD_REALS, 1, NULL
#define SADMM_KIND_VECTOR SADMM_FIELD_REALS, 3, NULL
#define SADMM_KIND_TWIST SADMM_FIELD_REALS, 6, NULL
#define SADMM_KIND_TURN SADMM_FIELD_TURN, 4, NULL
#define SADMM_KIND_BOUND SADMM_FIELD_BOUND, 1, NULL
#define SADMM_KIND_MEASURED SADMM_FIELD_MEASURED, 1, NULL
#define SADMM_KIND_WHOLE SADMM_FIELD_WHOLE, 1, NULL
#define SADMM_KIND_BITS SADMM_FIELD_BITS, 1, NULL
#define SADMM_KIND_FLAG SADMM_FIELD_FLAG, 1, NULL
#define SADMM_KIND_METHOD SADMM_FIELD_NAMED, SADMM_METHOD_COUNT, sadmm_method_names
#define SADMM_KIND_BODY_TYPE SADMM_FIELD_NAMED, SADMM_BODY_TYPE_COUNT, sadmm_body_type_names
#define SADMM_KIND_SHAPE_TYPE SADMM_FIELD_NAMED, SADMM_SHAPE_TYPE_COUNT, sadmm_shape_type_names
#define SADMM_KIND_JOINT_KIND SADMM_FIELD_NAMED, SADMM_JOINT_KIND_COUNT, sadmm_joint_kind_names
#define SADMM_KIND_DRIVE SADMM_FIELD_NAMED, SADMM_DRIVE_COUNT, sadmm_drive_names
#define SADMM_KIND_ID SADMM_FIELD_ID, 1, NULL
#define SADMM_KIND_OTHER SADMM_FIELD_OTHER, 0, NULL

/* Parts of a list: its defaults, as an initialiser without braces; how many there are. */
#define SADMM_FIELD_DEFAULT(X, kind, role, name, value, ...) .name = value,
#define SADMM_FIELD_ONE(X, ...) +1
/* Values of more than one number. */
#define SADMM_NUMBERS(...) {__VA_ARGS__}

/* That a list has every member of a struct, in its order, behind its sizes: a struct with too few initialisers is an
 * error, and so is one of another form. */
#define SADMM_EVERY_FIELD_IS_LISTED(type, list, sizes)                                                         \
    _Pragma("GCC diagnostic push") _Pragma("GCC diagnostic error \"-Wmissing-field-initializers\"")            \
    _Static_assert(sizeof((type){sizes list(SADMM_FIELD_VALUE, )}) == sizeof(type), "every member is listed"); \
    _Pragma("GCC diagnostic pop")
#define SADMM_NO_SIZE
#define SADMM_ONE_SIZE 0,
#define SADMM_TWO_SIZES 0, 0,
#define SADMM_FIELD_VALUE(X, kind, role, name, value, ...) value,

/* Is a member of an object in its range? Else INVALID_ARGUMENT with its name behind `prefix`, its value and the
 * range. */
sadmm_status sadmm_field_check(const struct sadmm_field *field, const void *object, const char *prefix,
                               struct sadmm_error *error);
sadmm_status sadmm_fields_check(const struct sadmm_field *fields, size_t count, const void *object, const char *prefix,
                                struct sadmm_error *error);
/* The same of numbers (doubles, `count` of them) that are in no object yet, with a name of their own. */
sadmm_status sadmm_numbers_check(const struct sadmm_field *field, const double *x, const char *name,
                                 struct sadmm_error *error);

#ifdef __cplusplus
}
#endif
#endif
