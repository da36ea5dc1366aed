/* JSON values of a scene file, and errors with the path of a member. Strings and numbers are checked here for what they
 * are; ranges by the library, whose messages get the path. */
#ifndef SADMM_SCENE_FILE_DOCUMENT_H
#define SADMM_SCENE_FILE_DOCUMENT_H

#include "core/base/error.h"
#include "fields.h"

enum { SADMM_PATH_SIZE = 160 };

struct sadmm_reader {
    const char *name;           /* of the file, for messages; "": none */
    char path[SADMM_PATH_SIZE]; /* of the object at hand: "bodies[3].shapes[0]"; "": the file */
    size_t length;              /* of the path */
    struct sadmm_error *error;
};

/* Text to values: *root belongs to the caller. INVALID_ARGUMENT, OUT_OF_MEMORY. */
sadmm_status sadmm_parse_json(const struct sadmm_reader *r, const char *text, size_t length, json_t **root);

/* Go into a member or an element, "bodies[%zu]"; returns where to come back to. */
#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
size_t
sadmm_enter(struct sadmm_reader *r, const char *format, ...);
void sadmm_leave(struct sadmm_reader *r, size_t length);

/* INVALID_ARGUMENT: a member of the object at hand (NULL: the object itself), and what of it. */
#ifdef __GNUC__
__attribute__((format(printf, 3, 4)))
#endif
sadmm_status
sadmm_refuse(const struct sadmm_reader *r, const char *member, const char *format, ...);
/* "must be `what`, is a string" */
sadmm_status sadmm_refuse_value(const struct sadmm_reader *r, const char *member, const char *what,
                                const json_t *value);
/* A failed call's own status and message: its "def->" is the path of the object at hand. A message without one comes
 * behind the path and `joint` ("." before a member, ": " before anything else). OK is passed on. */
sadmm_status sadmm_refuse_as(const struct sadmm_reader *r, sadmm_status status, const char *joint, const char *message);

/* Members of an object that are fields; those that are not there are left as they are. INVALID_ARGUMENT, also where
 * it is no object or has other members. */
sadmm_status sadmm_read_fields(const struct sadmm_reader *r, const json_t *object, const struct sadmm_fields *fields,
                               void *into);
/* The same of some of an object's members: others are not looked at. */
sadmm_status sadmm_read_some(const struct sadmm_reader *r, const json_t *object, const struct sadmm_fields *fields,
                             void *into);

/* A number; `count` numbers; a whole number in [lo, hi]. */
sadmm_status sadmm_read_real(const struct sadmm_reader *r, const char *member, const json_t *value, double *x);
sadmm_status sadmm_read_reals(const struct sadmm_reader *r, const char *member, const json_t *value, double *x,
                              size_t count);
sadmm_status sadmm_read_whole(const struct sadmm_reader *r, const char *member, const json_t *value, double lo,
                              double hi, int64_t *number);
/* Members of an object: NULL where one is not there, INVALID_ARGUMENT where it is of another type. */
sadmm_status sadmm_read_array(const struct sadmm_reader *r, const json_t *object, const char *member, json_t **array);
sadmm_status sadmm_read_string(const struct sadmm_reader *r, const json_t *object, const char *member,
                               const char **string);

#endif
