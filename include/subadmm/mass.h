/* Mass, centre of mass and principal axes of solids of one density, and of bodies made of several.
 *
 * A body's frame has its origin at the centre of mass and its axes along the principal axes of inertia (world.h). A
 * body that is laid out in another frame, of its points or its parts, gets there in three steps:
 *
 *   sadmm_shape_mass of every part in the frame of the layout, sadmm_mass_sum of them all;
 *   the body's mass and inertia are those of the sum; it goes where the layout's frame, moved by `centre` and turned by
 *     `orientation`, is in the world (the other way: sadmm_mass_pose_of_body);
 *   sadmm_mass_pose_in_body takes every shape's pose from the layout to the body.
 *
 * Errors are returned as a status; the message is sadmm_last_message. All functions are thread-safe.
 */
#ifndef SUBADMM_MASS_H
#define SUBADMM_MASS_H

#include "hull.h"
#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_mass {
    double mass;           /* kg */
    double centre[3];      /* centre of mass in the frame of the layout, m */
    double inertia[3];     /* principal moments about it, kg m^2, as bodies take them */
    double orientation[4]; /* principal axes to the frame of the layout, w x y z, unit */
} sadmm_mass;

/* The solid of any shape but a plane or a mesh in the frame that the definition's position and orientation refer to.
 * density: kg/m^3, in [1e-30, 1e30]; with 1 the mass is the volume. Hulls: exact integrals over the polyhedron, and
 * over what rounding adds to it. Errors:
 * INVALID_ARGUMENT (range; a plane; nothing is written). */
SADMM_API sadmm_status sadmm_shape_mass(const sadmm_shape_def *def, double density, sadmm_mass *mass);
/* The same of a hull in the frame of its points. */
SADMM_API sadmm_status sadmm_hull_mass(const sadmm_hull *hull, double density, sadmm_mass *mass);

/* Several solids in the same frame as one; where they overlap both count. parts[k]: mass in [1e-100, 1e100], inertia in
 * [0, 1e100], |centre| <= 1e9, orientation unit within 1e-6. *sum may be one of them. Errors: INVALID_ARGUMENT (range,
 * count 0; nothing is written). */
SADMM_API sadmm_status sadmm_mass_sum(const sadmm_mass *parts, size_t count, sadmm_mass *sum);

/* A pose (m, |x| <= 1e9; w x y z, unit within 1e-6) in the frame of the layout becomes that in the frame of the body
 * whose mass this is, as shapes and joints are given. Errors: INVALID_ARGUMENT (range; nothing changes). */
SADMM_API sadmm_status sadmm_mass_pose_in_body(const sadmm_mass *mass, double position[3], double orientation[4]);
/* The pose that the layout's frame has in the world (ranges as above) becomes that of the body. Errors:
 * INVALID_ARGUMENT (range; nothing changes). */
SADMM_API sadmm_status sadmm_mass_pose_of_body(const sadmm_mass *mass, double position[3], double orientation[4]);

#ifdef __cplusplus
}
#endif
#endif
