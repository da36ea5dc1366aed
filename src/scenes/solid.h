/* Bodies of convex hulls and other solids of one density; ground of meshes. */
#ifndef SADMM_SCENES_SOLID_H
#define SADMM_SCENES_SOLID_H

#include "place.h"
#include "subadmm/hull.h"

/* A hull around `count` points (3 numbers each, m). *hull belongs to the caller, NULL after an error: UNAVAILABLE in a
 * library that cannot make hulls. */
sadmm_status sadmm_scene_hull(const double *points, int count, sadmm_hull **hull, struct sadmm_error *error);

/* A mesh of triangles, and one of heights. *mesh belongs to the caller, NULL after an error. */
sadmm_status sadmm_scene_mesh(const sadmm_mesh_def *def, sadmm_mesh **mesh, struct sadmm_error *error);
sadmm_status sadmm_scene_heights(const sadmm_heightfield_def *def, sadmm_mesh **mesh, struct sadmm_error *error);

/* The shape of a hull, where its points are, with a friction; it may be moved and turned. */
sadmm_shape_def sadmm_hull_shape(const sadmm_hull *hull, double friction);
/* The same of a mesh, for bodies that are not dynamic. */
sadmm_shape_def sadmm_mesh_shape(const sadmm_mesh *mesh, double friction);

/* A body of `count` >= 1 shapes laid out in `frame` (shape.position and orientation are in that frame). density
 * (kg/m^3) > 0: it is dynamic, its mass, centre and axes those of the solids together; 0: it is static. `id` may be
 * NULL. */
sadmm_status sadmm_place_solids(sadmm_world *world, struct sadmm_frame frame, const sadmm_shape_def *shapes, int count,
                                double density, const char *name, sadmm_body_id *id, struct sadmm_error *error);

#endif
