/* Structures of boxes that are built at rest and have to stay as they are. */
#ifndef SADMM_SCENES_BUILT_H
#define SADMM_SCENES_BUILT_H

#include "place.h"
#include "scenes.h"

/* Where box `i` of a structure was put. */
typedef struct sadmm_frame (*sadmm_built_at)(int32_t i);

/* Bodies [first, first + count) of the world are boxes 0 to count - 1 of the structure: how far any of them is from
 * where it was put (m), and the fastest one's speed (m/s). `skip`: a box that is left out, or -1. NaN stays NaN. */
sadmm_status sadmm_measure_built(sadmm_world *world, int32_t first, int32_t count, int32_t skip, sadmm_built_at at,
                                 double *moved, double *speed, struct sadmm_error *error);

/* A task of the figures "moved" (m) and "speed" (m/s), measured of such a structure ten times a second. It has passed
 * if at `end` (s) no box is farther than `most` (m) from where it was put. */
sadmm_status sadmm_observe_built(const struct sadmm_scene *scene, sadmm_world *world, int64_t step, int32_t first,
                                 int32_t count, int32_t skip, sadmm_built_at at, double end, double most,
                                 struct sadmm_scene_task *task, struct sadmm_error *error);

#endif
