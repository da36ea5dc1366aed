/* World level: virtual couplings, which pull a body to a pose that the caller sets: a tracked hand, a haptic device, a
 * recorded motion.
 *
 * A coupling is a frame on a body and a target: a pose in the world with a velocity. A spring and a damper with six
 * degrees of freedom pull the frame to the target: with d from the target's origin to the frame's, phi the rotation
 * vector from the target's axes to the frame's, and v, w the velocity of the frame's origin and its angular velocity,
 * less the target's,
 *
 *     force = -linear_stiffness d - linear_damping v          torque = -angular_stiffness phi - angular_damping w
 *
 * They are solved implicitly together with all contacts and joints, so any gains are stable with any mass and time
 * step; their bounds hold exactly. Method: docs/internals/algorithm.md, "Gears and couplings".
 *
 * The pose of the target is that at the current time of the world; it moves with its velocity in every (sub-)step until
 * it is set again. The reaction on the user is sadmm_coupling_state.reaction_*. On CUDA targets are sent with the next
 * step, without waiting.
 *
 * Couplings are not joints: they have counts and ids of their own. Threads and errors: as world.h says. Ids are values
 * with a generation, as bodies' are. */
#ifndef SUBADMM_COUPLING_H
#define SUBADMM_COUPLING_H

#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_coupling_def {
    size_t struct_size;          /* set by sadmm_coupling_def_default() */
    sadmm_body_id body;          /* dynamic. No default */
    double position[3];          /* origin of the frame on the body, in its body frame, m, |x| <= 1e9; default 0 */
    double orientation[4];       /* the frame to the body, w x y z, | |q| - 1 | <= 1e-6 (then normalised); default
                                    identity */
    double target_position[3];   /* world, m, |x| <= 1e9; default 0. Read back: as it is now */
    double target_orientation[4]; /* target to world, as above; default identity. Read back: as it is now */
    double target_velocity[6];   /* linear (m/s), angular (rad/s), world, |x| <= 1e9; default 0 */
    double linear_stiffness;     /* N/m, in [0, 1e15]; default 0 */
    double linear_damping;       /* N s/m, in [0, 1e15]; default 0 */
    double angular_stiffness;    /* N m/rad, in [0, 1e15]; default 0 */
    double angular_damping;      /* N m s/rad, in [0, 1e15]; default 0 */
    double max_force;            /* N, >= 0, may be infinite: largest force along each axis of the target (at the
                                    midpoint of the step), so at most sqrt(3) times that in total; default infinite */
    double max_torque;           /* N m, likewise */
    bool enabled;                /* default true. If false, no force acts, but the target moves on */
    const char *name;            /* UTF-8; copied, as many whole characters as fit into 63 bytes; NULL = "" */
    void *user_data;             /* the caller's, never used by the library; default NULL */
} sadmm_coupling_def;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_coupling_def_init(sadmm_coupling_def *def, size_t size);
static inline sadmm_coupling_def sadmm_coupling_def_default(void)
{
    sadmm_coupling_def def;
    sadmm_coupling_def_init(&def, sizeof def);
    return def;
}

/* *id: the new coupling, until it or its body is removed. Errors: STALE_ID, INVALID_ARGUMENT (range; the body is
 * static; nothing changes), LIMIT (2^24 couplings), OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_add_coupling(sadmm_world *world, const sadmm_coupling_def *def,
                                                sadmm_coupling_id *id /* may be NULL */);
/* Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_remove_coupling(sadmm_world *world, sadmm_coupling_id id);
SADMM_API int32_t sadmm_world_coupling_count(const sadmm_world *world); /* also those not enabled; of NULL: 0 */
/* The index-th live coupling in order of creation slot, index in [0, coupling_count). Errors: INVALID_ARGUMENT
 * (range). */
SADMM_API sadmm_status sadmm_world_coupling_at(sadmm_world *world, int32_t index, sadmm_coupling_id *id);
/* Read back the definition as it is now. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_coupling_def_sized(sadmm_world *world, sadmm_coupling_id id,
                                                      sadmm_coupling_def *def, size_t size);
static inline sadmm_status sadmm_world_coupling_def(sadmm_world *world, sadmm_coupling_id id, sadmm_coupling_def *def)
{
    return sadmm_world_coupling_def_sized(world, id, def, sizeof *def);
}

/* The coupling that has this name, as sadmm_world_body_named. Errors: INVALID_ARGUMENT (none has it, or several). */
SADMM_API sadmm_status sadmm_world_coupling_named(sadmm_world *world, const char *name, sadmm_coupling_id *id);
/* Its name; "" as of sadmm_world_body_name. */
SADMM_API const char *sadmm_world_coupling_name(const sadmm_world *world, sadmm_coupling_id id);
/* The user_data of its definition, or what was set since; as of sadmm_world_set_body_user_data. Errors: STALE_ID,
 * OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_set_coupling_user_data(sadmm_world *world, sadmm_coupling_id id, void *data);
SADMM_API void *sadmm_world_coupling_user_data(const sadmm_world *world, sadmm_coupling_id id);
/* Set the target at the current time of the world, from the next step on: position (m, world), orientation (target to
 * world, w x y z, unit within 1e-6), velocity (linear, angular, world; NULL: 0). May be called before every step (some
 * ten nanoseconds). Jumps are allowed. Errors: STALE_ID, INVALID_ARGUMENT (range; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_coupling_target(sadmm_world *world, sadmm_coupling_id id,
                                                       const double position[3], const double orientation[4],
                                                       const double velocity[6] /* may be NULL */);
/* From the next step on; units and ranges as in sadmm_coupling_def. Errors: STALE_ID, INVALID_ARGUMENT (range; nothing
 * changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_coupling_gains(sadmm_world *world, sadmm_coupling_id id, double linear_stiffness,
                                                      double linear_damping, double angular_stiffness,
                                                      double angular_damping);
/* The same for max_force and max_torque. */
SADMM_API sadmm_status sadmm_world_set_coupling_limits(sadmm_world *world, sadmm_coupling_id id, double max_force,
                                                       double max_torque);
/* From the next step on. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_set_coupling_enabled(sadmm_world *world, sadmm_coupling_id id, bool enabled);

/* Errors are at the current poses. Forces are means over the last step, all sub-steps included, at the geometry of its
 * midpoint; 0 before the first step and where the coupling did not take part. All in the world frame. */
typedef struct sadmm_coupling_state {
    double reaction_force[3], reaction_torque[3]; /* on the user, the reaction to the force on the body: N, and N m
                                                     about the target's origin */
    double body_force[3], body_torque[3];         /* on the body: N, and N m about its centre of mass */
    double position_error[3];    /* from the frame's origin to the target's, m */
    double rotation_error[3];    /* rotation vector that turns the frame's axes to the target's, rad, of at most pi */
} sadmm_coupling_state;

/* Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_coupling_state(sadmm_world *world, sadmm_coupling_id id,
                                                  sadmm_coupling_state *state);

#ifdef __cplusplus
}
#endif
#endif
