/* Putting bodies into a scene: boxes, spheres and ground planes laid out in a local frame. */
#ifndef SADMM_SCENES_PLACE_H
#define SADMM_SCENES_PLACE_H

#include "core/base/error.h"
#include "subadmm/world.h"

/* A frame in the world that a part of a scene is laid out in (a slope, a turned house). */
struct sadmm_frame {
    double origin[3];      /* m */
    double orientation[4]; /* w x y z, frame to world */
};

struct sadmm_frame sadmm_frame_world(void);
/* The frame rotated by `angle` (rad) about its own x (0), y (1) or z (2) axis. */
struct sadmm_frame sadmm_frame_turned(struct sadmm_frame frame, int axis, double angle);
/* The frame moved by (x, y, z) along its own axes. */
struct sadmm_frame sadmm_frame_moved(struct sadmm_frame frame, double x, double y, double z);

/* What a body placed in a frame is made of. */
struct sadmm_piece {
    double half_extents[3]; /* box, m; for spheres [0] is the radius */
    double mass;            /* kg */
    double friction, restitution;
    const char *name; /* of the body; NULL: none */
};

/* A static half-space z <= 0 of the frame. */
sadmm_status sadmm_place_plane(sadmm_world *world, struct sadmm_frame frame, double friction,
                               struct sadmm_error *error);

/* A box with its centre at the frame's origin and its axes along the frame's; `id` may be NULL. */
sadmm_status sadmm_place_box(sadmm_world *world, struct sadmm_frame frame, const struct sadmm_piece *piece,
                             sadmm_body_id *id, struct sadmm_error *error);
sadmm_status sadmm_place_sphere(sadmm_world *world, struct sadmm_frame frame, const struct sadmm_piece *piece,
                                sadmm_body_id *id, struct sadmm_error *error);

/* Hand a failed world call's status and message on as a scene's error. */
sadmm_status sadmm_scene_world_error(const sadmm_world *world, sadmm_status status, struct sadmm_error *error);

#endif
