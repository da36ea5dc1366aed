/* Members of JSON objects that are fields of the library's definitions: one table for the reader and the writer. */
#ifndef SADMM_SCENE_FILE_FIELDS_H
#define SADMM_SCENE_FILE_FIELDS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "subadmm/subadmm.h"

enum sadmm_field_kind {
    FIELD_REALS,       /* `count` doubles: a number where that is 1, else an array */
    FIELD_OR_INFINITY, /* a double; null: infinite */
    FIELD_OR_NAN,      /* a double; null: NaN */
    FIELD_BOOL,
    FIELD_INT32,
    FIELD_UINT32,
    FIELD_NAME, /* an enumeration: one of `count` names */
    FIELD_OTHER /* a member that is no field: its readers and writers are elsewhere */
};

struct sadmm_field {
    const char *name;
    enum sadmm_field_kind kind;
    size_t offset;
    int count;
    const char *const *names;
};

struct sadmm_fields {
    const char *what; /* "a body" */
    const struct sadmm_field *list;
    size_t count;
};

extern const char *const sadmm_shape_names[SADMM_SHAPE_TYPE_COUNT];
extern const char *const sadmm_method_names[SADMM_METHOD_COUNT];

/* Forces on a body, which its definition does not have. */
struct sadmm_body_load {
    double force[3], torque[3];
};

/* A pair of shapes, by their places in the lists of two bodies, with a friction of its own. */
struct sadmm_shape_pair {
    int32_t shape_a, shape_b;
    double friction;
};

extern const struct sadmm_fields sadmm_file_fields;       /* of sadmm_world_def: the file itself */
extern const struct sadmm_fields sadmm_method_fields;     /* of int[SADMM_METHOD_COUNT], by method */
extern const struct sadmm_fields sadmm_settings_fields;   /* of sadmm_settings */
extern const struct sadmm_fields sadmm_body_fields;       /* of sadmm_body_def */
extern const struct sadmm_fields sadmm_dynamic_fields;    /* of it: what dynamic bodies have, and others null */
extern const struct sadmm_fields sadmm_load_fields;       /* of struct sadmm_body_load: the same */
extern const struct sadmm_fields sadmm_move_fields;       /* of sadmm_body_state */
extern const struct sadmm_fields sadmm_shape_fields;      /* of sadmm_shape_def */
extern const struct sadmm_fields sadmm_hull_fields;       /* of sadmm_hull_def */
extern const struct sadmm_fields sadmm_mesh_fields;       /* none */
extern const struct sadmm_fields sadmm_joint_fields;      /* of sadmm_joint_def */
extern const struct sadmm_fields sadmm_coordinate_fields; /* of sadmm_joint_coordinate */
extern const struct sadmm_fields sadmm_table_fields;      /* none */
extern const struct sadmm_fields sadmm_coupling_fields;   /* of sadmm_coupling_def */
extern const struct sadmm_fields sadmm_gear_fields;       /* of sadmm_gear_def */
extern const struct sadmm_fields sadmm_friction_fields;   /* of struct sadmm_shape_pair */
extern const struct sadmm_fields sadmm_off_fields;        /* none */

/* Numbers that `size` of a shape has. */
size_t sadmm_shape_sizes(sadmm_shape_type type);

/* NULL: not in the table. */
const struct sadmm_field *sadmm_find_field(const struct sadmm_fields *fields, const char *name);

/* null for what is not a finite number (JSON has no NaN). These, and what follows: NULL or false when out of memory. */
json_t *sadmm_json_real(double x);
json_t *sadmm_json_reals(const double *x, size_t count);
/* Members of all fields, in the table's order; of those that are none, null, for the caller to replace. */
bool sadmm_write_fields(json_t *object, const struct sadmm_fields *fields, const void *from);
/* The library's version, commit and compiler. */
bool sadmm_json_add_build(json_t *object);

#endif
