/* The members of definitions, once (fields.h): in the order of the structs, without their sizes. */
#ifndef SADMM_CORE_BASE_DEFINITION_FIELDS_H
#define SADMM_CORE_BASE_DEFINITION_FIELDS_H

#include <math.h>

#include "fields.h"
#include "subadmm/coupling.h"
#include "subadmm/gear.h"
#include "subadmm/hull.h"
#include "subadmm/joint.h"
#include "subadmm/types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Moments of all solids within the ranges of mass and size are 4e-22 (a ball of 1e-9 kg, 1e-6 m) to 7e23 kg m^2; an arm
 * of 1e6 m on the smallest, 1e12 / 1e-24, is still a number in single precision. */
#define SADMM_BODY_FIELDS(F, X)                                                                                       \
    F(X, OTHER, OWN, name, NULL, 0, 0, ANY, "The name, up to 63 bytes of UTF-8.")                                     \
    F(X, BODY_TYPE, PLAIN, type, SADMM_BODY_DYNAMIC, 0, 0, ANY, "'dynamic', 'static' or 'kinematic'.")                \
    F(X, REAL, DYNAMIC, mass, 0, 1e-9, 1e12, CLOSED, "kg.")                                                           \
    F(X, VECTOR, DYNAMIC, inertia, SADMM_NUMBERS(0, 0, 0), 1e-24, 1e24, ANY, "Principal moments, kg m^2.")            \
    F(X, VECTOR, PLAIN, position, SADMM_NUMBERS(0, 0, 0), -1e9, 1e9, CLOSED, "Centre of mass, m.")                    \
    F(X, TURN, PLAIN, orientation, SADMM_NUMBERS(1, 0, 0, 0), -1, 1, ANY, "w x y z, body to world.")                  \
    F(X, VECTOR, PLAIN, linear_velocity, SADMM_NUMBERS(0, 0, 0), -1e6, 1e6, CLOSED, "m/s.")                           \
    F(X, VECTOR, PLAIN, angular_velocity, SADMM_NUMBERS(0, 0, 0), -1e6, 1e6, CLOSED, "rad/s, world frame.")           \
    F(X, WHOLE, PLAIN, environment, 0, -1, 2147483647, CLOSED, "Bodies of different ones never collide; -1: of all.") \
    F(X, REAL, DYNAMIC, gravity_scale, 1, -1e6, 1e6, CLOSED, "The body's gravity over settings.gravity.")             \
    F(X, REAL, DYNAMIC, linear_damping, 0, 0, 1e6, CLOSED, "1/s.")                                                    \
    F(X, REAL, DYNAMIC, angular_damping, 0, 0, 1e6, CLOSED, "1/s.")                                                   \
    F(X, OTHER, HIDDEN, user_data, NULL, 0, 0, ANY, "")

#define SADMM_SHAPE_FIELDS(F, X)                                                                           \
    F(X, SHAPE_TYPE, PLAIN, type, SADMM_SHAPE_SPHERE, 0, 0, ANY, "What it is.")                            \
    F(X, VECTOR, OWN, size, SADMM_NUMBERS(0, 0, 0), 1e-6, 1e6, ANY, "m, as sadmm_shape_def.size.")         \
    F(X, VECTOR, PLAIN, position, SADMM_NUMBERS(0, 0, 0), -1e6, 1e6, CLOSED, "In the body's frame, m.")    \
    F(X, TURN, PLAIN, orientation, SADMM_NUMBERS(1, 0, 0, 0), -1, 1, ANY, "To the body's frame, w x y z.") \
    F(X, REAL, PLAIN, friction, 0.5, 0, 1e6, CLOSED, "mu; a pair has the geometric mean.")                 \
    F(X, REAL, PLAIN, restitution, 0, 0, 1, CLOSED, "A pair has the larger one.")                          \
    F(X, BITS, PLAIN, category, 1, 0, 4294967295, CLOSED, "Bits of its own categories.")                   \
    F(X, BITS, PLAIN, mask, 4294967295, 0, 4294967295, CLOSED, "Categories that it collides with.")        \
    F(X, FLAG, PLAIN, sensor, false, 0, 1, ANY,                                                            \
      "A sensor has no contacts and reports overlaps: World.record_events, World.sensor_overlaps.")        \
    F(X, OTHER, OWN, hull, NULL, 0, 0, ANY, "")                                                            \
    F(X, OTHER, OWN, mesh, NULL, 0, 0, ANY, "")                                                            \
    F(X, VECTOR, PLAIN, surface_velocity, SADMM_NUMBERS(0, 0, 0), -1e6, 1e6, CLOSED,                       \
      "How its surface moves while it stays, as a belt's, in its own frame, m/s.")                               \
    F(X, OTHER, OWN, name, NULL, 0, 0, ANY, "The name, up to 63 bytes of UTF-8.")                          \
    F(X, OTHER, HIDDEN, user_data, NULL, 0, 0, ANY, "")

/* m and N; of rotations rad and N m. */
#define SADMM_COORDINATE_FIELDS(F, X)                                                                \
    F(X, FLAG, HIDDEN, limited, false, 0, 1, ANY, "Whether lower and upper hold.")                   \
    F(X, REAL, HIDDEN, lower, 0, 0, 0, ANY, "Least position; may be infinite.")                      \
    F(X, REAL, HIDDEN, upper, 0, 0, 0, ANY, "Largest position; may be infinite.")                    \
    F(X, DRIVE, PLAIN, drive, SADMM_DRIVE_OFF, 0, 0, ANY, "'off', 'speed' or 'position'.")           \
    F(X, REAL, PLAIN, target_position, 0, -1e9, 1e9, CLOSED, "Of the drive.")                        \
    F(X, REAL, PLAIN, target_speed, 0, -1e9, 1e9, CLOSED, "Of the drive.")                           \
    F(X, REAL, PLAIN, drive_stiffness, 0, 0, 1e15, CLOSED, "Of a drive to a position, N/m.")         \
    F(X, REAL, PLAIN, drive_damping, 0, 0, 1e15, CLOSED, "Of a drive to a position, N s/m.")         \
    F(X, BOUND, PLAIN, drive_force, INFINITY, 0, INFINITY, CLOSED, "Largest force of the drive, N.") \
    F(X, REAL, PLAIN, friction, 0, 0, 1e15, CLOSED, "Dry friction: force against motion, N.")        \
    F(X, REAL, PLAIN, spring_stiffness, 0, 0, 1e15, CLOSED, "N/m.")                                  \
    F(X, REAL, PLAIN, spring_damping, 0, 0, 1e15, CLOSED, "N s/m.")                                  \
    F(X, REAL, PLAIN, spring_rest, 0, -1e9, 1e9, CLOSED, "Where the spring has no force, m.")        \
    F(X, REAL, PLAIN, armature, 0, 0, 1e15, CLOSED, "Reflected inertia, kg.")

#define SADMM_JOINT_FIELDS(F, X)                                                                                      \
    F(X, JOINT_KIND, PLAIN, kind, SADMM_JOINT_FIXED, 0, 0, ANY, "What it locks.")                                     \
    F(X, BITS, PLAIN, locks, 0, 0, 63, ANY, "Of 'custom': bit k locks coordinate k.")                                 \
    F(X, ID, OWN, body_a, SADMM_NUMBERS(0, 0), 0, 0, ANY, "")                                                         \
    F(X, ID, OWN, body_b, SADMM_NUMBERS(0, 0), 0, 0, ANY, "")                                                         \
    F(X, VECTOR, PLAIN, position_a, SADMM_NUMBERS(0, 0, 0), -1e9, 1e9, CLOSED, "Of the frame on a, in its frame, m.") \
    F(X, TURN, PLAIN, orientation_a, SADMM_NUMBERS(1, 0, 0, 0), -1, 1, ANY, "Of the frame on a, to its frame.")       \
    F(X, VECTOR, PLAIN, position_b, SADMM_NUMBERS(0, 0, 0), -1e9, 1e9, CLOSED, "The same on b.")                      \
    F(X, TURN, PLAIN, orientation_b, SADMM_NUMBERS(1, 0, 0, 0), -1, 1, ANY, "The same on b.")                         \
    F(X, REAL, PLAIN, length, -1, 0, 1e9, ANY, "Of 'distance' and 'link', m; -1: as it is.")                          \
    F(X, FLAG, PLAIN, collide, false, 0, 1, ANY, "Whether the two bodies collide.")                                   \
    F(X, FLAG, PLAIN, enabled, true, 0, 1, ANY, "Whether it does anything.")                                          \
    F(X, BOUND, PLAIN, break_force, INFINITY, 0, INFINITY, CLOSED, "It breaks beyond this force, N.")                 \
    F(X, BOUND, PLAIN, break_torque, INFINITY, 0, INFINITY, CLOSED, "It breaks beyond this torque, N m.")             \
    F(X, OTHER, OWN, coordinates, SADMM_DEFAULT_COORDINATES, 0, 0, ANY, "What acts along each.")                      \
    F(X, OTHER, OWN, name, NULL, 0, 0, ANY, "The name, up to 63 bytes of UTF-8.")                                     \
    F(X, OTHER, HIDDEN, user_data, NULL, 0, 0, ANY, "")
#define SADMM_DEFAULT_COORDINATE {SADMM_COORDINATE_FIELDS(SADMM_FIELD_DEFAULT, )}
#define SADMM_DEFAULT_COORDINATES                                                                            \
    {SADMM_DEFAULT_COORDINATE, SADMM_DEFAULT_COORDINATE, SADMM_DEFAULT_COORDINATE, SADMM_DEFAULT_COORDINATE, \
     SADMM_DEFAULT_COORDINATE, SADMM_DEFAULT_COORDINATE}

#define SADMM_COUPLING_FIELDS(F, X)                                                                          \
    F(X, ID, OWN, body, SADMM_NUMBERS(0, 0), 0, 0, ANY, "")                                                  \
    F(X, VECTOR, PLAIN, position, SADMM_NUMBERS(0, 0, 0), -1e9, 1e9, CLOSED, "Of the frame on the body, m.") \
    F(X, TURN, PLAIN, orientation, SADMM_NUMBERS(1, 0, 0, 0), -1, 1, ANY, "Of the frame, to the body's.")    \
    F(X, VECTOR, PLAIN, target_position, SADMM_NUMBERS(0, 0, 0), -1e9, 1e9, CLOSED, "World, m.")             \
    F(X, TURN, PLAIN, target_orientation, SADMM_NUMBERS(1, 0, 0, 0), -1, 1, ANY, "World.")                   \
    F(X, TWIST, PLAIN, target_velocity, SADMM_NUMBERS(0, 0, 0, 0, 0, 0), -1e9, 1e9, CLOSED,                  \
      "Linear (m/s), angular (rad/s), world.")                                                               \
    F(X, REAL, PLAIN, linear_stiffness, 0, 0, 1e15, CLOSED, "N/m.")                                          \
    F(X, REAL, PLAIN, linear_damping, 0, 0, 1e15, CLOSED, "N s/m.")                                          \
    F(X, REAL, PLAIN, angular_stiffness, 0, 0, 1e15, CLOSED, "N m/rad.")                                     \
    F(X, REAL, PLAIN, angular_damping, 0, 0, 1e15, CLOSED, "N m s/rad.")                                     \
    F(X, BOUND, PLAIN, max_force, INFINITY, 0, INFINITY, CLOSED, "N, along each axis of the target.")        \
    F(X, BOUND, PLAIN, max_torque, INFINITY, 0, INFINITY, CLOSED, "N m, likewise.")                          \
    F(X, FLAG, PLAIN, enabled, true, 0, 1, ANY, "Whether its force acts.")                                   \
    F(X, OTHER, OWN, name, NULL, 0, 0, ANY, "The name, up to 63 bytes of UTF-8.")                            \
    F(X, OTHER, HIDDEN, user_data, NULL, 0, 0, ANY, "")

#define SADMM_GEAR_FIELDS(F, X)                                                   \
    F(X, ID, OWN, joint_1, SADMM_NUMBERS(0, 0), 0, 0, ANY, "")                    \
    F(X, WHOLE, PLAIN, coordinate_1, -1, 0, 5, ANY, "Of joint_1.")                \
    F(X, ID, OWN, joint_2, SADMM_NUMBERS(0, 0), 0, 0, ANY, "")                    \
    F(X, WHOLE, PLAIN, coordinate_2, -1, 0, 5, ANY, "Of joint_2.")                \
    F(X, REAL, PLAIN, ratio, 1, 0, 0, ANY, "Its size is in [1e-9, 1e9].")         \
    F(X, MEASURED, PLAIN, offset, NAN, -1e9, 1e9, ANY, "NaN: as it is.")          \
    F(X, FLAG, PLAIN, enabled, true, 0, 1, ANY, "Whether it acts.")               \
    F(X, OTHER, OWN, name, NULL, 0, 0, ANY, "The name, up to 63 bytes of UTF-8.") \
    F(X, OTHER, HIDDEN, user_data, NULL, 0, 0, ANY, "")

#define SADMM_HULL_FIELDS(F, X)                                                                          \
    F(X, OTHER, HIDDEN, points, NULL, 0, 0, ANY, "")                                                     \
    F(X, OTHER, HIDDEN, point_count, 0, 0, 0, ANY, "")                                                   \
    F(X, REAL, PLAIN, merge, 1e-6, 0, 1e-2, CLOSED, "Faces that are flat to within this share are one.") \
    F(X, REAL, PLAIN, convex_radius, 0, 0, 1e6, CLOSED, "Edges are rounded by this, m.")

/* As tables, and where in them a member is: SADMM_BODY_FIELD(mass). */
#define SADMM_TABLE(of, NAME)                                                 \
    enum { NAME##_FIELDS_COUNT = 0 NAME##_FIELDS(SADMM_FIELD_ONE, ) };        \
    extern const struct sadmm_field sadmm_##of##_table[NAME##_FIELDS_COUNT];  \
    enum { NAME##_FIELDS(SADMM_FIELD_PLACE, NAME##_PLACE_) NAME##_NO_PLACE };
#define SADMM_FIELD_PLACE(X, kind, role, name, ...) SADMM_FIELD_PLACE_OF(X, name)
#define SADMM_FIELD_PLACE_OF(X, name) X##name,
SADMM_TABLE(body, SADMM_BODY)
SADMM_TABLE(shape, SADMM_SHAPE)
SADMM_TABLE(coordinate, SADMM_COORDINATE)
SADMM_TABLE(joint, SADMM_JOINT)
SADMM_TABLE(coupling, SADMM_COUPLING)
SADMM_TABLE(gear, SADMM_GEAR)
SADMM_TABLE(hull, SADMM_HULL)

#define SADMM_BODY_FIELD(name) (&sadmm_body_table[SADMM_BODY_PLACE_##name])
#define SADMM_SHAPE_FIELD(name) (&sadmm_shape_table[SADMM_SHAPE_PLACE_##name])
#define SADMM_JOINT_FIELD(name) (&sadmm_joint_table[SADMM_JOINT_PLACE_##name])
#define SADMM_COORDINATE_FIELD(name) (&sadmm_coordinate_table[SADMM_COORDINATE_PLACE_##name])
#define SADMM_COUPLING_FIELD(name) (&sadmm_coupling_table[SADMM_COUPLING_PLACE_##name])
#define SADMM_GEAR_FIELD(name) (&sadmm_gear_table[SADMM_GEAR_PLACE_##name])

#ifdef __cplusplus
}
#endif
#endif
