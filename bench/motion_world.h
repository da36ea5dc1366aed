/* A scene's world as `subadmm-bench motion` sees it: poses, what is measured of them, and steps with their times. */
#ifndef BENCH_MOTION_WORLD_H
#define BENCH_MOTION_WORLD_H

#include "overlap.h"
#include "scenes/scenes.h"

/* A dynamic body. */
struct moving_body {
    sadmm_body_id id;
    double mass;
    double inertia[3]; /* kg m^2 */
};

struct motion_shape {
    sadmm_shape_def def;
    int body; /* index of the dynamic body, -1: static */
};

struct motion_world {
    const struct sadmm_scene *scene;
    sadmm_world *world;
    struct moving_body *bodies;
    sadmm_body_state *states; /* of the bodies, as last read */
    int body_count;
    struct motion_shape *shapes;
    struct solid *solids; /* of the shapes, where the bodies are as last read */
    int shape_count;
    struct sadmm_error *error;
};

/* Build the scene. Seed 0: as it is; others give every dynamic body an orientation of its own (for heaps whose bodies
 * start further apart than they are long). To be closed also after an error. */
sadmm_status motion_world_open(struct motion_world *w, const struct sadmm_scene *scene, int seed,
                               struct sadmm_error *error);
void motion_world_close(struct motion_world *w);

/* States of all dynamic bodies: body_count of them. */
sadmm_status motion_world_set_states(struct motion_world *w, const sadmm_body_state *states);
/* Into w->states and w->solids. */
sadmm_status motion_world_read(struct motion_world *w);

/* The step after `done` steps; adds its wall time, ms, where `ms` is given. */
sadmm_status motion_world_step(struct motion_world *w, int64_t done, double *ms);

/* Hand a failed world call on, with its message. */
sadmm_status motion_world_check(const struct motion_world *w, sadmm_status status);

/* Root mean square, over the body's mass, of how far two poses put its points apart, m. */
double pose_distance(const struct moving_body *body, const sadmm_body_state *a, const sadmm_body_state *b);

/* Of the states last read. Height and spread: of the centre of mass against gravity, and root mean square across it
 * about that centre, by mass. */
struct motion_moments {
    double height, spread; /* m */
    double kinetic;        /* J */
};
struct motion_moments motion_world_moments(const struct motion_world *w);

#endif
