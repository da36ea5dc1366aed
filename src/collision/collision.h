/* Collision detection on the host: broad phase (FCL, or sort and sweep), pair manifolds, matching with the last step.
 *
 * Shapes live in slots that stay put for a shape's life; a dead slot has alive = false, and a sensor
 * counts as one. The result does not depend on
 * the order in which a broad phase finds pairs: pairs come out sorted by (shape_a, shape_b, subshape), where a is the
 * shape of the lower (type, slot) and the normal runs from a to b. Two shapes have a pair for each of their manifolds.
 */
#ifndef SADMM_COLLISION_COLLISION_H
#define SADMM_COLLISION_COLLISION_H

#include <stdbool.h>

#include "subadmm/world.h"
#include "core/base/error.h"
#include "core/base/contact_set.h"

#ifdef __cplusplus
extern "C" {
#endif

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

/* May a shape be of this geometry, on such a body? Else INVALID_ARGUMENT; `name`: what the message calls the geometry,
 * as "def->". Sizes are not checked. */
sadmm_status sadmm_geometry_check(const struct sadmm_geometry *geometry, enum sadmm_motion motion, const char *name,
                                  struct sadmm_error *error);

struct sadmm_shape {
    uint32_t geometry; /* handle: its index in the input's geometries */
    double position[3], orientation[4]; /* shape frame in the body's */
    double friction, restitution;
    uint32_t category, mask;
    int32_t body;     /* world body slot */
    bool alive, sensor; /* a sensor is the world's alone: to contact finding its slot is a dead one */
    uint32_t revision; /* changes whenever the slot is reused or the shape's definition changes, geometry included */
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

struct sadmm_collision_input {
    const struct sadmm_shape *shapes;
    size_t shape_count;               /* slots, dead ones included */
    const struct sadmm_geometry *geometries; /* by handle */
    size_t geometry_count;
    const double *hulls;              /* shape data (hull_data.h); NULL: none is a HULL, a MESH, or smooth
                                         (geometry.h) */
    size_t hull_doubles;
    uint32_t hull_revision;           /* changes whenever the shape data does */
    const struct sadmm_collision_body *bodies; /* by world body slot */
    size_t body_count;
    double dt;                        /* of what contacts are found for: the step, or the sub-step */
    int substeps_left;                /* so many more finds follow within the step: the list of pairs should last */
    double margin;                    /* share of the thinner shape's smallest extent (world def contact_margin) */
    int threads;                      /* at most; less than 1 counts as 1 */
    struct sadmm_team *team;          /* whose threads (parallel.h); NULL: OpenMP's */
    /* Pair overrides, both sorted by key = (low slot << 32) | high slot. */
    const uint64_t *disabled_body_pairs; size_t disabled_body_pair_count;      /* body slots */
    const uint64_t *friction_pairs; const double *friction_values; size_t friction_pair_count; /* shape slots */
    /* By body slot: a body's motion begins so long after the step's start, s: it was hit then; its orientation is the
     * one that it has at that moment. NULL: all are 0. */
    const double *since;
    double gravity; /* its size, m/s^2: a body at rest just outside the margin falls gravity x dt^2 in its first step */
};

/* Is the shape in this slot one that collision can work on? Else INVALID_ARGUMENT that names it. Asked for every shape
 * that is new or changed, by whoever takes the input over. */
sadmm_status sadmm_collision_check_shape(const struct sadmm_collision_input *input, size_t slot,
                                         struct sadmm_error *error);

struct sadmm_collision;
sadmm_status sadmm_collision_create(struct sadmm_collision **out, struct sadmm_error *error);
void sadmm_collision_destroy(struct sadmm_collision *collision);

/* Find all contacts. On entry `contacts` holds the previous step's set (with its impulses and caches; points of a new
 * pair or feature start with impulse 0); on success it holds the new one. On failure it is unchanged. */
sadmm_status sadmm_collision_find(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                  struct sadmm_contact_set *contacts, struct sadmm_error *error);

/* The same for a later sub-step of the step that the last sadmm_collision_find was for: what an undo puts back stays
 * the set from before the step. */
sadmm_status sadmm_collision_find_again(struct sadmm_collision *collision, const struct sadmm_collision_input *input,
                                        struct sadmm_contact_set *contacts, struct sadmm_error *error);

/* Put back the set that the last successful sadmm_collision_find replaced, impulses and caches included (the pipeline
 * keeps it until the next find), so that a step that fails later leaves no trace. Does nothing when the last find
 * failed or was undone already. */
void sadmm_collision_undo(struct sadmm_collision *collision, struct sadmm_contact_set *contacts);

/* "fcl" or "sweep". */
const char *sadmm_collision_broad_phase_name(void);

#ifdef __cplusplus
}
#endif
#endif
