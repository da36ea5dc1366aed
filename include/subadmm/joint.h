/* World level: joints between two bodies, or a body and the static world.
 *
 * A joint is two frames, one on each body, and six coordinates of b's frame relative to a's: translations 0 to 2 along
 * the axes of a's frame (m), rotations 3 to 5 about x, y, z (rad). Each is locked or free. The solver holds locked ones
 * at 0 exactly, together with all contacts. A free one may have limits, a drive, dry friction, a spring with a damper
 * and armature, all at once.
 *
 * Free rotations: a single one is the angle about its axis. If two are free and k is locked, they are the angles about
 * axis k + 1 of a's frame and axis k + 2 of b's (cyclic; the cross of a universal joint). Both count full turns. If
 * three are free, they are the rotation vector from a's frame to b's, in a's frame. Speeds are the components of the
 * relative angular velocity along these axes. Formulas: src/core/math/joint.h; method: docs/internals/algorithm.md,
 * "Joints".
 *
 * Forces are along a coordinate, N for translations, N m for rotations; positive ones push b in the positive direction
 * and a in the negative one.
 *
 * Threads and errors: as world.h says. Ids are values with a generation, as bodies' are.
 */
#ifndef SUBADMM_JOINT_H
#define SUBADMM_JOINT_H

#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

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
    SADMM_JOINT_CUSTOM,     /* locked: by sadmm_joint_def.locks */
    SADMM_JOINT_DISTANCE,   /* coordinate 0 is the distance of the frames' origins (>= 0), locked at `length`; the
                               others are unused */
    SADMM_JOINT_SPRING,     /* the same with coordinate 0 free: for a spring, a rope (upper limit), or an actuator
                               between two points */
    SADMM_JOINT_LINK,       /* a bar between a hinge about a's z axis and a ball on b (revolute-spherical): distance
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

/* What acts along one free coordinate (position q, speed dq/dt). Default: nothing. Units are those of translations; for
 * rotations read rad for m, and N m for N. It may grow; its size in the program is sadmm_joint_def.coordinate_size. */
typedef struct sadmm_joint_coordinate {
    bool limited;                /* lower <= q <= upper; default false */
    double lower, upper;         /* m, lower <= upper, either may be infinite (no limit on that side); default 0 */
    sadmm_drive drive;           /* default OFF */
    double target_position;      /* m, |x| <= 1e9; default 0 */
    double target_speed;         /* m/s, |x| <= 1e9; default 0 */
    double drive_stiffness;      /* N/m, in [0, 1e15]; default 0 */
    double drive_damping;        /* N s/m, in [0, 1e15]; default 0 */
    double drive_force;          /* largest force of the drive, N, >= 0, may be infinite; default infinite */
    double friction;             /* dry friction: largest holding force, or the force against motion, N, in [0, 1e15];
                                    default 0 */
    double spring_stiffness;     /* N/m, in [0, 1e15]; force = -stiffness (q - spring_rest) - damping dq/dt, implicit;
                                    default 0 */
    double spring_damping;       /* N s/m, in [0, 1e15]; default 0 */
    double spring_rest;          /* m, |x| <= 1e9; default 0 */
    double armature;             /* reflected inertia along the coordinate, e.g. of a rotor behind its gear, kg (kg
                                    m^2), in [0, 1e15]; force = -armature d2q/dt2; default 0 */
} sadmm_joint_coordinate;

typedef struct sadmm_joint_def {
    size_t struct_size;          /* set by sadmm_joint_def_default() */
    size_t coordinate_size;      /* of a sadmm_joint_coordinate in the program, bytes; likewise */
    sadmm_joint_kind kind;       /* default FIXED */
    uint32_t locks;              /* CUSTOM: bit k locks coordinate k, in [0, 63]; default 0. Ignored for other kinds.
                                    Read back: the locks of the kind */
    sadmm_body_id body_a, body_b; /* two bodies, at least one dynamic; one may be all zero: the static world. No
                                     default */
    double position_a[3];        /* origin of a's frame, in a's body frame (static world: the world's), m,
                                    |x| <= 1e9; default 0 */
    double orientation_a[4];     /* a's frame to the body's, w x y z, | |q| - 1 | <= 1e-6 (then normalised); default
                                    identity */
    double position_b[3];        /* the same of b */
    double orientation_b[4];
    double length;               /* DISTANCE and LINK: m, in [0, 1e9], or -1: the distance when the joint is added (in
                                    the same range, and read back); default -1. If it is 0, or less than the points move
                                    in a step, it is not held exactly and costs energy: use SPHERICAL to hold two points
                                    together */
    bool collide;                /* whether the two bodies collide with each other; default false (has no effect for the
                                    static world, which is not a body) */
    bool enabled;                /* default true. If false, the joint does nothing, but `collide` still holds */
    double break_force, break_torque; /* N, N m, >= 0, may be infinite; default infinite. A joint whose force or torque
                                         (norms of the parts of wrench_b) exceeds them in a (sub-)step is disabled from
                                         the next step on */
    sadmm_joint_coordinate coordinates[6]; /* locked ones: all default but for drive_force, which is ignored */
    const char *name;            /* UTF-8; copied, as many whole characters as fit into 63 bytes; NULL = "" */
    void *user_data;             /* the caller's, never used by the library; default NULL */
} sadmm_joint_def;

/* The defaults named above. coordinate_size: of a sadmm_joint_coordinate. Thread-safe. */
SADMM_API void sadmm_joint_def_init(sadmm_joint_def *def, size_t size, size_t coordinate_size);
static inline sadmm_joint_def sadmm_joint_def_default(void)
{
    sadmm_joint_def def;
    sadmm_joint_def_init(&def, sizeof def, sizeof *def.coordinates);
    return def;
}

/* Set both frames of `def` (position_a, orientation_a, position_b, orientation_b) to the pose `position` (m, |x| <=
 * 1e9) and `orientation` (joint to world, w x y z, unit within 1e-6) in the world, by the current poses of its bodies.
 * Errors: STALE_ID, INVALID_ARGUMENT (nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_place_joint(sadmm_world *world, sadmm_joint_def *def, const double position[3],
                                               const double orientation[4]);

/* *id: the new joint, until it or one of its bodies is removed. Locked coordinates that are not 0 are corrected in the
 * following steps by at most settings.correction_speed (m/s, rad/s). Errors: STALE_ID, INVALID_ARGUMENT (range; a body
 * with itself; two that are not dynamic; nothing changes), LIMIT (2^24 joints), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_add_joint(sadmm_world *world, const sadmm_joint_def *def,
                                             sadmm_joint_id *id /* may be NULL */);
/* Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_remove_joint(sadmm_world *world, sadmm_joint_id id);
SADMM_API int32_t sadmm_world_joint_count(const sadmm_world *world); /* also those not enabled; of NULL: 0 */
/* The index-th live joint in order of creation slot, index in [0, joint_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_joint_at(sadmm_world *world, int32_t index, sadmm_joint_id *id);
/* Read back the definition as it is now. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_joint_def_sized(sadmm_world *world, sadmm_joint_id id, sadmm_joint_def *def,
                                                   size_t size, size_t coordinate_size);
static inline sadmm_status sadmm_world_joint_def(sadmm_world *world, sadmm_joint_id id, sadmm_joint_def *def)
{
    return sadmm_world_joint_def_sized(world, id, def, sizeof *def, sizeof *def->coordinates);
}
/* The joint that has this name, as sadmm_world_body_named. Errors: INVALID_ARGUMENT (none has it, or several). */
SADMM_API sadmm_status sadmm_world_joint_named(sadmm_world *world, const char *name, sadmm_joint_id *id);
/* Its name; "" as of sadmm_world_body_name. */
SADMM_API const char *sadmm_world_joint_name(const sadmm_world *world, sadmm_joint_id id);
/* The user_data of its definition, or what was set since; as of sadmm_world_set_body_user_data. Errors: STALE_ID,
 * OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_set_joint_user_data(sadmm_world *world, sadmm_joint_id id, void *data);
SADMM_API void *sadmm_world_joint_user_data(const sadmm_world *world, sadmm_joint_id id);
/* From the next step on; enabling a broken joint repairs it. On CUDA, here and below: sent with the next step, without
 * waiting. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_set_joint_enabled(sadmm_world *world, sadmm_joint_id id, bool enabled);
/* Replace what acts along a free coordinate, index in [0, 6), from the next step on. Errors: STALE_ID, INVALID_ARGUMENT
 * (range; the coordinate is locked, or the joint has none of that index; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_joint_coordinate_sized(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                              const sadmm_joint_coordinate *coordinate, size_t size);
static inline sadmm_status sadmm_world_set_joint_coordinate(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                            const sadmm_joint_coordinate *coordinate)
{
    return sadmm_world_set_joint_coordinate_sized(world, id, index, coordinate, sizeof *coordinate);
}

enum { SADMM_MOST_SPRING_POINTS = 64 };

/* A nonlinear spring along a free coordinate, index in [0, 6), from the next step on: forces[i] (N; N m) is the load
 * that holds it at positions[i] (m; rad), so the force on b is -forces[i] there; linear in between and beyond the ends.
 * It is added to spring_stiffness and spring_damping, is part of spring_force, and stays when the coordinate is set.
 * count in [2, SADMM_MOST_SPRING_POINTS], copied; 0 removes it (both pointers may be NULL then). |positions| <= 1e9,
 * strictly increasing; |forces| <= 1e15, slopes within +-1e15 N/m.
 *
 * Implicit and of second order in the step, kinks included. Where the load rises with the position it is stable with
 * any mass and step, like linear springs. Where it falls (a spring that snaps through) the force is that at the
 * predicted position; keep the step short there, e.g. (1 / mass) |slope| dt^2 < 1.
 *
 * Errors: STALE_ID, INVALID_ARGUMENT (range; the coordinate is locked or not there; nothing changes), OUT_OF_MEMORY,
 * DEVICE. */
SADMM_API sadmm_status sadmm_world_set_joint_spring_table(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                          const double *positions, const double *forces, int32_t count);
/* Read it back: *count points, 0 where there is none, into positions and forces, each for SADMM_MOST_SPRING_POINTS
 * numbers, or NULL. Errors: STALE_ID, INVALID_ARGUMENT (index). */
SADMM_API sadmm_status sadmm_world_joint_spring_table(sadmm_world *world, sadmm_joint_id id, int32_t index,
                                                      double *positions, double *forces, int32_t *count);

/* Positions and speeds are at the current states of the bodies. Everything else is the mean over the last (sub-)step at
 * the geometry of its midpoint; 0 before the first step and where the joint did not take part. */
typedef struct sadmm_joint_state {
    double position[6];          /* m, rad; of locked coordinates: the error (a locked distance: distance - `length`) */
    double speed[6];             /* m/s, rad/s */
    double point[3];             /* origin of b's frame, m, world */
    double wrench_a[6], wrench_b[6]; /* total wrench of the joint on the body: force (N), then torque about `point` (N
                                        m), world frame; wrench_a = -wrench_b */
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
