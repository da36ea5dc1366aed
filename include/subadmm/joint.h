/* World level: joints between two bodies, or a body and the static world.
 *
 * A joint is two frames, one on each body, and six coordinates of b's frame relative to a's: translations 0 to 2 along
 * the axes of a's frame (m), rotations 3 to 5 about x, y, z (rad). Each is locked or free. Locked ones are held at 0 by
 * the solver, exactly, together with all contacts. A free one may have limits, a drive, dry friction, a spring with a
 * damper, armature, all at once.
 *
 * Free rotations: where one is free it is the angle about its axis; where two are free and k is locked they are angles
 * about an axis k + 1 of a's frame and an axis k + 2 of b's (cyclic; a universal joint's cross); these count on beyond
 * full turns. Where three are free they are the rotation vector from a's frame to b's, in a's frame. Rates of all of
 * them are components of the relative angular velocity along these axes. Formulas: src/core/math/joint.h; method:
 * docs/internals/algorithm.md, "Joints".
 *
 * Forces are along a coordinate, N for translations, N m for rotations; positive ones push b along the coordinate and a
 * against it.
 *
 * Threads and errors: as world.h says. Ids are values with a generation, as bodies' are.
 */
#ifndef SUBADMM_JOINT_H
#define SUBADMM_JOINT_H

#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_joint_id { uint32_t slot, generation; } sadmm_joint_id;

/* Names of lock masks: bit k locks coordinate k. */
typedef enum sadmm_joint_kind {
    SADMM_JOINT_FIXED = 0,  /* all locked */
    SADMM_JOINT_REVOLUTE,   /* free: rotation about z */
    SADMM_JOINT_PRISMATIC,  /* free: translation along z */
    SADMM_JOINT_CYLINDRICAL, /* free: both about and along z */
    SADMM_JOINT_SPHERICAL,  /* free: all rotations */
    SADMM_JOINT_UNIVERSAL,  /* free: rotations about a's x and b's y, which stay perpendicular */
    SADMM_JOINT_PLANAR,     /* free: translations along x and y, rotation about z */
    SADMM_JOINT_CARTESIAN,  /* free: all translations; the orientation is locked */
    SADMM_JOINT_CUSTOM,     /* locked: what sadmm_joint_def.locks says */
    SADMM_JOINT_DISTANCE,   /* coordinate 0 is the distance of the frames' origins (>= 0), locked at `length`; no other
                               coordinate is */
    SADMM_JOINT_SPRING,     /* the same, and coordinate 0 is free: for a spring, a rope (upper limit), an actuator
                               between two points */
    SADMM_JOINT_LINK,       /* a bar that turns about a's z axis and ends in a ball on b (revolute-spherical): distance
                               locked at `length`, translation 2 at 0 */
    SADMM_JOINT_KIND_COUNT
} sadmm_joint_kind;

typedef enum sadmm_drive {
    SADMM_DRIVE_OFF = 0,
    SADMM_DRIVE_SPEED,      /* holds target_speed, with a force of at most drive_force */
    SADMM_DRIVE_POSITION,   /* force = drive_stiffness (target_position - position) + drive_damping (target_speed -
                               speed), implicit (any gains are stable), at most drive_force */
    SADMM_DRIVE_COUNT
} sadmm_drive;

/* What acts along one free coordinate (position q, rate dq/dt). Default: nothing. Units for translations; for rotations
 * read rad for m and N m for N. */
typedef struct sadmm_joint_coordinate {
    bool limited;                /* lower <= q <= upper; default false */
    double lower, upper;         /* m, lower <= upper, either may be infinite (no limit on that side); default 0 */
    sadmm_drive drive;           /* default OFF */
    double target_position;      /* m, |x| <= 1e9; default 0 */
    double target_speed;         /* m/s, |x| <= 1e9; default 0 */
    double drive_stiffness;      /* N/m, in [0, 1e15]; default 0 */
    double drive_damping;        /* N s/m, in [0, 1e15]; default 0 */
    double drive_force;          /* most that the drive gives, N, >= 0, may be infinite; default infinite */
    double friction;             /* dry: force that holds, or acts against motion, N, in [0, 1e15]; default 0 */
    double spring_stiffness;     /* N/m, in [0, 1e15]; force = -stiffness (q - spring_rest) - damping dq/dt, implicit;
                                    default 0 */
    double spring_damping;       /* N s/m, in [0, 1e15]; default 0 */
    double spring_rest;          /* m, |x| <= 1e9; default 0 */
    double armature;             /* inertia of what moves along with the coordinate, say a rotor behind its gear,
                                    kg (kg m^2), in [0, 1e15]; force = -armature d2q/dt2; default 0 */
} sadmm_joint_coordinate;

typedef struct sadmm_joint_def {
    sadmm_joint_kind kind;       /* default FIXED */
    uint32_t locks;              /* CUSTOM: bit k locks coordinate k, in [0, 63]; default 0. Other kinds ignore it; read
                                    back it is what is locked */
    sadmm_body_id body_a, body_b; /* two bodies, one at least dynamic; all zero: the static world (one of them). No
                                    default */
    double position_a[3];        /* origin of a's frame, in a's body frame (static world: the world's), m,
                                    |x| <= 1e9; default 0 */
    double orientation_a[4];     /* a's frame to the body's, w x y z, | |q| - 1 | <= 1e-6 (then normalised); default
                                    identity */
    double position_b[3];        /* the same of b */
    double orientation_b[4];
    double length;               /* DISTANCE and LINK: m, in [0, 1e9], or -1: the distance when the joint is added (in
                                    that range; what is read back); default -1. One of 0, or less than what the points
                                    move in a step, is held to a share of that way, at the cost of energy: a SPHERICAL
                                    joint holds two points together */
    bool collide;                /* do the two bodies meet each other? Default false. (With a static body only that one
                                    is left out; the static world is no body and leaves none out) */
    bool enabled;                /* default true. A joint that is not does nothing, but for `collide` */
    double break_force, break_torque; /* N, N m, >= 0, may be infinite; default infinite. A joint that gave more than
                                    one of them in a (sub-)step (sizes of wrench_b's parts) is not enabled from the next
                                    step on */
    sadmm_joint_coordinate coordinates[6]; /* locked ones: all default but for drive_force, which is ignored */
} sadmm_joint_def;

/* The defaults named above. Thread-safe. */
SADMM_API sadmm_joint_def sadmm_joint_def_default(void);

/* Put both frames where `position` (m, |x| <= 1e9) and `orientation` (joint to world, w x y z, unit within 1e-6) are in
 * the world now, from the poses of def's bodies: sets position_a, orientation_a, position_b, orientation_b of `def`.
 * Errors: STALE_ID, INVALID_ARGUMENT (nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_place_joint(sadmm_world *world, sadmm_joint_def *def, const double position[3],
                                               const double orientation[4]);

/* *id: the new joint, until it or one of its bodies is removed. Frames that do not fit are drawn together in the steps
 * that follow, each coordinate by at most settings.correction_speed (m/s, rad/s). Errors: STALE_ID, INVALID_ARGUMENT
 * (range; a body with itself; two that are not dynamic; nothing changes), LIMIT (2^24 joints), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_add_joint(sadmm_world *world, const sadmm_joint_def *def,
                                             sadmm_joint_id *id /* may be NULL */);
/* Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_remove_joint(sadmm_world *world, sadmm_joint_id id);
SADMM_API int32_t sadmm_world_joint_count(const sadmm_world *world); /* also those not enabled; of NULL: 0 */
/* The index-th live joint in order of creation slot, index in [0, joint_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_joint_at(sadmm_world *world, int32_t index, sadmm_joint_id *id);
/* Read back the definition as it is now. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_joint_def(sadmm_world *world, sadmm_joint_id id, sadmm_joint_def *def);
/* From the next step on; what was broken is whole again when enabled. On CUDA, here and below: goes along with the next
 * step, which is not waited for. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_set_joint_enabled(sadmm_world *world, sadmm_joint_id id, bool enabled);
/* Replace what acts along a free coordinate, index in [0, 6), from the next step on. Errors: STALE_ID, INVALID_ARGUMENT
 * (range; the coordinate is locked, or the joint has none of that index; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_joint_coordinate(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                        const sadmm_joint_coordinate *coordinate);

enum { SADMM_MOST_SPRING_POINTS = 64 };

/* A spring with a characteristic of its own along a free coordinate, index in [0, 6), from the next step on: forces[i]
 * (N; N m) is the load that holds it at positions[i] (m; rad), so that the force on b is -forces[i] there; straight
 * lines in between, going on beyond the ends. It acts beside spring_stiffness and spring_damping, is part of
 * spring_force, and stays when the coordinate is set. count in [2, SADMM_MOST_SPRING_POINTS], copied; 0: none again
 * (both pointers may be NULL then). |positions| <= 1e9, strictly increasing; |forces| <= 1e15, slopes within +-1e15
 * N/m.
 *
 * Implicit and of second order in the step, kinks included. Where loads rise with the position any table is stable
 * with any mass and step, as springs are. Where they fall (a spring that snaps through) the force is the one predicted
 * for the way of the step: a step should not take it far then, (1 / mass) |slope| dt^2 < 1 say.
 *
 * Errors: STALE_ID, INVALID_ARGUMENT (range; the coordinate is locked or not there; nothing changes), OUT_OF_MEMORY,
 * DEVICE. */
SADMM_API sadmm_status sadmm_world_set_joint_spring_table(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                          const double *positions, const double *forces, int32_t count);
/* Read it back: *count points, 0 where there is none, into positions and forces, each for SADMM_MOST_SPRING_POINTS
 * numbers, or NULL. Errors: STALE_ID, INVALID_ARGUMENT (index). */
SADMM_API sadmm_status sadmm_world_joint_spring_table(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                      double *positions, double *forces, int32_t *count);

/* Positions and speeds are those of the bodies' present states; everything else is of the last step (with sub-steps: of
 * the last one), the mean over its length, at the geometry of its middle: all 0 before the first one, and where the
 * joint did not take part. */
typedef struct sadmm_joint_state {
    double position[6];          /* m, rad; of locked coordinates: what they are off by (a locked distance: less
                                    `length`) */
    double speed[6];             /* m/s, rad/s */
    double point[3];             /* origin of b's frame, m, world */
    double wrench_a[6], wrench_b[6]; /* all that the joint does to the body: force (N), then torque about `point` (N m),
                                    world frame; wrench_a = -wrench_b */
    double wrench_joint[6];      /* wrench_b along the axes of a's frame */
    /* by coordinate, N, N m */
    double lock_force[6], limit_force[6], drive_force[6], friction_force[6], spring_force[6], armature_force[6];
    bool broken;                 /* by break_force or break_torque */
} sadmm_joint_state;

/* Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_joint_state(sadmm_world *world, sadmm_joint_id id, sadmm_joint_state *state);

#ifdef __cplusplus
}
#endif
#endif
