/* Members of JSON objects: those of the library's definitions (core/base/fields.h), and others beside them: tables for
 * the reader and the writer. */
#ifndef SADMM_SCENE_FILE_FIELDS_H
#define SADMM_SCENE_FILE_FIELDS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "core/base/fields.h"
#include "subadmm/subadmm.h"

struct sadmm_fields {
    const char *what; /* "a body" */
    const struct sadmm_field *list;
    size_t count;
};

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

/* NULL: not in the table. */
const struct sadmm_field *sadmm_find_field(const struct sadmm_fields *fields, const char *name);

/* null for what is not a finite number (JSON has no NaN). These, and what follows: NULL or false when out of memory. */
json_t *sadmm_json_real(double x);
json_t *sadmm_json_reals(const double *x, size_t count);
/* Members of all fields, in the table's order; of those that definitions have not, null, for the caller to replace. */
bool sadmm_write_fields(json_t *object, const struct sadmm_fields *fields, const void *from);
/* The library's version, commit and compiler. */
bool sadmm_json_add_build(json_t *object);

#endif
