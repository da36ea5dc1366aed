/* A world on its way into a scene file. */
#ifndef SADMM_SCENE_FILE_WRITER_H
#define SADMM_SCENE_FILE_WRITER_H

#include "core/base/error.h"
#include "core/base/key_tree.h"
#include "fields.h"
#include "subadmm/subadmm.h"

/* Slots of ids in the order of creation, so that an id's number in a list is found. */
struct sadmm_slot_list {
    uint32_t *slots;
    size_t count;
};

struct sadmm_writer {
    sadmm_world *world;
    json_t *root;                    /* the file */
    json_t *bodies, *hulls, *meshes; /* in it */
    struct sadmm_slot_list body_slots, shape_slots, joint_slots;
    size_t *shape_place; /* by the number of a shape: its place in its body's list */
    int32_t *shape_body;
    struct sadmm_key_tree hull_numbers, mesh_numbers; /* by address: of those that have been written, each once */
    bool complete; /* no value was lost for want of memory */
    struct sadmm_error *error;
};

/* Set a member, append an element: `value`, which belongs to the object or array from there on, or NULL where memory
 * ran out, which is remembered in w->complete. */
json_t *sadmm_put(struct sadmm_writer *w, json_t *object, const char *name, json_t *value);
json_t *sadmm_append(struct sadmm_writer *w, json_t *array, json_t *value);
/* An element of an array with members of all fields; NULL as above. */
json_t *sadmm_append_object(struct sadmm_writer *w, json_t *array, const struct sadmm_fields *fields, const void *from);
/* The name of an object; one without has no such member. */
void sadmm_put_name(struct sadmm_writer *w, json_t *object, const char *name);
/* The number of a slot in a list; it is there. */
int32_t sadmm_slot_number(const struct sadmm_slot_list *list, uint32_t slot);
/* The world's error, if there is one. */
sadmm_status sadmm_pass_on(struct sadmm_writer *w, sadmm_status status);

#endif
