/* Mass, centre of mass and principal axes of solids of uniform density, and of bodies made of several solids.
 *
 * A body's frame has its origin at the centre of mass and its axes along the principal axes of inertia (world.h). A
 * body that is designed in another frame (the layout) is converted in three steps:
 *
 *   sadmm_shape_mass of every part in the frame of the layout, sadmm_mass_sum of them all;
 *   the body has the mass and inertia of the sum; its pose is that of the layout's frame, moved by `centre` and rotated
 *   by `orientation` (sadmm_mass_pose_of_body); sadmm_mass_pose_in_body converts the pose of every shape from the
 *   layout to the body.
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

/* The solid of a shape (not a plane or mesh), in the frame that position and orientation of the definition refer to.
 * density: kg/m^3, in [1e-30, 1e30]; with 1 the mass is the volume. Hulls: exact integrals, convex radius included.
 * Errors: INVALID_ARGUMENT (range; a plane; nothing is written). */
SADMM_API sadmm_status sadmm_shape_mass(const sadmm_shape_def *def, double density, sadmm_mass *mass);
/* The same for a hull, in the frame of its points. */
SADMM_API sadmm_status sadmm_hull_mass(const sadmm_hull *hull, double density, sadmm_mass *mass);

/* The sum of several solids in the same frame; overlaps count twice. parts[k]: mass in [1e-100, 1e100], inertia in [0,
 * 1e100], |centre| <= 1e9, orientation unit within 1e-6. *sum may be one of them. Errors: INVALID_ARGUMENT (range,
 * count 0; nothing is written). */
SADMM_API sadmm_status sadmm_mass_sum(const sadmm_mass *parts, size_t count, sadmm_mass *sum);

/* Convert a pose (m, |x| <= 1e9; w x y z, unit within 1e-6) from the frame of the layout to that of the body, as shapes
 * and joints need it. Errors: INVALID_ARGUMENT (range; nothing changes). */
SADMM_API sadmm_status sadmm_mass_pose_in_body(const sadmm_mass *mass, double position[3], double orientation[4]);
/* Convert the pose of the layout's frame in the world (ranges as above) to that of the body. Errors: INVALID_ARGUMENT
 * (range; nothing changes). */
SADMM_API sadmm_status sadmm_mass_pose_of_body(const sadmm_mass *mass, double position[3], double orientation[4]);

#ifdef __cplusplus
}
#endif
#endif
