/* A scene file on its way into a world: what has been made of its lists so far. */
#ifndef SADMM_SCENE_FILE_FILLER_H
#define SADMM_SCENE_FILE_FILLER_H

#include "document.h"
#include "subadmm/subadmm.h"

/* What has been made of a file's lists. */
struct sadmm_filler {
    struct sadmm_reader reader;
    const json_t *root;
    json_t *names; /* of bodies, their numbers; NULL: not yet needed */
    sadmm_world *world;
    sadmm_body_id *bodies;
    sadmm_body_type *body_types;
    sadmm_mass *masses; /* by body: of its shapes, in the frame of the file; mass 0: it has no density */
    size_t body_count;
    sadmm_shape_id *shapes; /* body by body */
    size_t *first_shape;    /* by body: its first one there; body_count + 1 */
    sadmm_joint_id *joints;
    size_t joint_count;
    sadmm_hull **hulls;
    size_t hull_count;
    sadmm_mesh **meshes;
    size_t mesh_count;
};

/* The name of the object at hand; NULL: it has none. */
sadmm_status sadmm_read_object_name(const struct sadmm_filler *f, const json_t *object, const char **name);
/* A failed call of the world, as sadmm_refuse_as. */
sadmm_status sadmm_refuse_world(const struct sadmm_filler *f, sadmm_status status, const char *joint);
/* A failed call without a world: its message is sadmm_last_message. */
sadmm_status sadmm_refuse_last(const struct sadmm_filler *f, sadmm_status status, const char *joint);
/* The number of an element of a list of `count`, of member `member` of the object at hand. */
sadmm_status sadmm_read_number_in(const struct sadmm_filler *f, const json_t *object, const char *member, size_t count,
                                  int64_t *number);
/* A body, by its number or its name; null or not there: -1, the static world. */
sadmm_status sadmm_read_body(struct sadmm_filler *f, const json_t *object, const char *member, int64_t *number);

#endif
