/* Bodies of several solid parts. */
#ifndef SADMM_SCENES_COMPOUND_H
#define SADMM_SCENES_COMPOUND_H

#include "place.h"

enum { SADMM_COMPOUND_MOST = 16 };

/* A part: its shape, where it is in the layout's frame (shape.position, shape.orientation), and its own mass. */
struct sadmm_part {
    sadmm_shape_def shape; /* sphere, capsule or box */
    double mass;           /* kg */
};

/* A part at (x, y, z), of size a, b, c (sadmm_shape_def.size; 0 where its type has none), not turned. */
struct sadmm_part sadmm_part_at(sadmm_shape_type type, double x, double y, double z, double a, double b, double c,
                                double mass);

/* A body of `count` in [1, SADMM_COMPOUND_MOST] parts, laid out in `frame`: its centre of mass, principal axes and
 * moments are those of the parts together (parts that overlap count twice). `id` may be NULL. */
sadmm_status sadmm_place_compound(sadmm_world *world, struct sadmm_frame frame, const struct sadmm_part *parts,
                                  int count, const char *name, sadmm_body_id *id, struct sadmm_error *error);

/* The principal moments of one part about its shape's axes, kg m^2. */
void sadmm_part_inertia(const struct sadmm_part *part, double inertia[3]);

#endif
