/* Structures of blocks that are built at rest and have to stay as they are. */
#ifndef SADMM_SCENES_BUILT_H
#define SADMM_SCENES_BUILT_H

#include "place.h"
#include "scene.h"

/* Where block `i` of a structure was put: the frame of its shape. */
typedef struct sadmm_frame (*sadmm_built_at)(const struct sadmm_scene *scene, int32_t i);

/* A structure of blocks of one shape each, which are shapes [first, first + count) of the world. */
struct sadmm_built {
    int32_t first, count, skip; /* skip: a block that is left out, or -1 */
    sadmm_built_at at;
    double end, most; /* s, m: it has passed if at `end` no block is farther than `most` from where it was put */
};

/* How far any of the blocks is from where it was put, by the origin of its shape (m), and the fastest one's speed
 * (m/s). NaN stays NaN. */
sadmm_status sadmm_measure_built(const struct sadmm_scene *scene, sadmm_world *world, const struct sadmm_built *built,
                                 double *moved, double *speed, struct sadmm_error *error);

/* A task of the figures "moved" (m) and "speed" (m/s), measured ten times a second. */
sadmm_status sadmm_observe_built(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                 const struct sadmm_built *built, struct sadmm_scene_task *task,
                                 struct sadmm_error *error);

#endif
