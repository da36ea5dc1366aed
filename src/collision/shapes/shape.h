/* Shapes and bodies as contact finding knows them.
 *
 * Shapes live in slots that stay put for a shape's life; a dead slot has alive = false, and a sensor counts as one.
 */
#ifndef SADMM_COLLISION_SHAPES_SHAPE_H
#define SADMM_COLLISION_SHAPES_SHAPE_H

#include <stdbool.h>

#include "core/base/contact_set.h"
#include "core/base/inline.h"
#include "subadmm/types.h"

enum { SADMM_MOST_SUBSHAPES = 65535 }; /* the subshapes of a pair are counted in 32 bits */

/* What a shape is made of, apart from where it is and what it is like to touch. Shapes refer to it by a handle, so that
 * several may share one. A geometry has subshapes, the pieces that collide: a pair of shapes has a manifold for each
 * pair of their subshapes, at most. Most types have one subshape, the whole; where one is given more, each is the
 * whole. The subshapes of a mesh are its triangles: those of a pair are not counted out, but searched for
 * (mesh_walk.h). */
struct sadmm_geometry {
    int32_t type;      /* sadmm_shape_type */
    int32_t subshapes; /* in [1, SADMM_MOST_SUBSHAPES]; of MESH 0 */
    double size[3];    /* m, as in sadmm_shape_def; of HULL the half extents of the box around it, whose centre and axes
                          are the shape's frame; of MESH too */
    uint32_t hull;     /* of HULL and MESH: offset of its block in the input's `hulls` (hull_data.h, mesh_data.h) */
    uint32_t reserved;
};

/* How a body moves: not at all, as the caller says, by its dynamics. */
enum sadmm_motion { SADMM_MOTION_NONE, SADMM_MOTION_KINEMATIC, SADMM_MOTION_DYNAMIC };

struct sadmm_shape {
    uint32_t geometry; /* handle: its index in the input's geometries */
    double position[3], orientation[4]; /* shape frame in the body's */
    double friction, restitution;
    uint32_t category, mask;
    int32_t body;     /* world body slot */
    bool alive, sensor; /* a sensor is the world's alone: to contact finding its slot is a dead one */
    uint32_t revision; /* changes whenever the slot is reused or the shape's definition changes, geometry included */
    uint32_t formed;   /* likewise, but never the same again in a world: what is kept from step to step of a slot, other
                          than contacts, holds while it lasts */
};

/* Does this slot take part? */
static inline bool sadmm_shape_collides(const struct sadmm_shape *shape) { return shape->alive && !shape->sensor; }

/* What collision knows of a world's body slot. */
struct sadmm_collision_body {
    double position[3], orientation[4], velocity[6]; /* velocity 0 for static bodies */
    double acceleration[2]; /* sizes of what its own force and torque give it, m/s^2, rad/s^2; 0 unless it is dynamic */
    double inertia;       /* largest principal moment, kg m^2; 0: not dynamic, or all alike */
    uint32_t placed;      /* changes whenever its pose is set: pairs forget the axis they remember (contact_match.h) */
    int32_t system_body;  /* index among dynamic bodies; -1: static; below: kinematic, core/base/contact_set.h */
    int32_t environment;  /* -1: meets all */
    int32_t mean;         /* what touches it may roll (contact_migrate.h); not 0 of what is not dynamic */
};

#endif
