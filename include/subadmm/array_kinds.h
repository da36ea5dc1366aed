/* The arrays that there are (arrays.h, environments.h): their rows, columns and units. */
#ifndef SUBADMM_ARRAY_KINDS_H
#define SUBADMM_ARRAY_KINDS_H

#ifdef __cplusplus
extern "C" {
#endif

typedef enum sadmm_array {
    /* A row a body. */
    SADMM_ARRAY_BODY_STATE = 0,      /* 13 columns: position (m), orientation (w x y z), linear velocity (m/s), angular
                                       velocity (rad/s), as in sadmm_body_state. Set: as sadmm_world_set_body_state;
                                       unchanged rows of static bodies cost nothing */
    SADMM_ARRAY_BODY_WRENCH,         /* 6: external force (N) and torque (N m), world; 0 of bodies that are not dynamic.
                                       Set: as sadmm_world_set_body_wrench */
    SADMM_ARRAY_BODY_CONTACT_WRENCH, /* 6: as sadmm_world_body_contact_wrench; 0 of static bodies, and before the first
                                       step. Read only. UNAVAILABLE where settings.recover_wrenches is false */
    SADMM_ARRAY_BODY_INERTIA,        /* 4: mass (kg), principal moments (kg m^2); 0 of bodies that are not dynamic. Set:
                                       as sadmm_world_set_body_mass */
    /* A row a joint, a column a coordinate (joint.h): m or rad, m/s or rad/s, N or N m. */
    SADMM_ARRAY_JOINT_POSITION,    /* 6: sadmm_joint_state.position. Set: b and all that is joined to it move along, or,
                                      where the world holds them, a and what is joined to that; the other joints keep
                                      their positions and speeds. Gears do not matter. Locked coordinates are not read;
                                      those of a row that changes, or that has 0 for them, become 0. Three free
                                      rotations: at most half a turn. A joint in a loop, one that holds a distance, and
                                      one that is not enabled can only be set to what it has: INVALID_ARGUMENT */
    SADMM_ARRAY_JOINT_SPEED,       /* 6: sadmm_joint_state.speed. Set: likewise, velocities alone change */
    SADMM_ARRAY_JOINT_DRIVE_FORCE, /* 6: sadmm_joint_state.drive_force. Read only */
    SADMM_ARRAY_JOINT_WRENCH,      /* 6: sadmm_joint_state.wrench_b, world. Read only */
    SADMM_ARRAY_JOINT_TARGET_POSITION, /* 6: target_position of the drives; 0 for locked coordinates, and must be 0
                                          there. Set: as sadmm_world_set_joint_coordinate */
    SADMM_ARRAY_JOINT_TARGET_SPEED,    /* 6: likewise target_speed */
    /* A row a coupling. */
    SADMM_ARRAY_COUPLING_TARGET,   /* 13: target's position, orientation, velocity (linear, angular), in the units of
                                       SADMM_ARRAY_BODY_STATE. Set: as sadmm_world_set_coupling_target */
    SADMM_ARRAY_COUPLING_REACTION, /* 6: reaction_force (N), reaction_torque (N m) of sadmm_coupling_state. Read
                                       only */
    /* A row a body. */
    SADMM_ARRAY_BODY_GRAVITY_SCALE, /* 1: scale of gravity; 0 of bodies that are not dynamic. Set: as
                                       sadmm_world_set_body_gravity_scale */
    SADMM_ARRAY_BODY_DAMPING,       /* 2: linear, angular damping (1/s); 0 of bodies that are not dynamic. Set: as
                                       sadmm_world_set_body_damping */
    SADMM_ARRAY_BODY_ACCELERATION,  /* 6: change of the linear and angular velocity in the last (sub-)step over its
                                       length (m/s^2, rad/s^2), world; 0 of bodies that are not dynamic, and before the
                                       first step. Read only */
    /* A row a joint: members of sadmm_joint_coordinate, 6 each; of locked coordinates the defaults, and must be those
     * there. Set: as sadmm_world_set_joint_coordinate. */
    SADMM_ARRAY_JOINT_LOWER,            /* lower, m or rad: of no effect where the coordinate is not `limited` */
    SADMM_ARRAY_JOINT_UPPER,            /* upper */
    SADMM_ARRAY_JOINT_DRIVE_STIFFNESS,  /* drive_stiffness, N/m or N m/rad */
    SADMM_ARRAY_JOINT_DRIVE_DAMPING,    /* drive_damping, N s/m or N m s/rad */
    SADMM_ARRAY_JOINT_DRIVE_LIMIT,      /* drive_force, the largest, N or N m, may be infinite */
    SADMM_ARRAY_JOINT_FRICTION,         /* friction, N or N m */
    SADMM_ARRAY_JOINT_SPRING_STIFFNESS, /* spring_stiffness, N/m or N m/rad */
    SADMM_ARRAY_JOINT_SPRING_DAMPING,   /* spring_damping, N s/m or N m s/rad */
    SADMM_ARRAY_JOINT_SPRING_REST,      /* spring_rest, m or rad */
    SADMM_ARRAY_JOINT_ARMATURE,         /* armature, kg or kg m^2 */
    /* A row a shape. */
    SADMM_ARRAY_SHAPE_MATERIAL, /* 2: friction, restitution. Set: as sadmm_world_set_shape_material */
    /* One row. */
    SADMM_ARRAY_GRAVITY, /* 3: settings.gravity, m/s^2. Set: as sadmm_world_set_settings */
    SADMM_ARRAY_REPORT,  /* 8, of the last step: error (m/s, -1: not known), unsolved (-1: no tolerance),
                                       penetration_max (m), joint_drift (m), contacts, iterations, step, time (s), as in
                                       sadmm_step_report. Read only */
    /* A row a shape. */
    SADMM_ARRAY_SHAPE_SIZE,  /* 3: sadmm_shape_def.size, m; 0, and must be 0, where the type has no such size: planes,
                                hulls and meshes have none. Set: as sadmm_world_set_shape_size */
    SADMM_ARRAY_SHAPE_FRAME, /* 7: position (m), orientation (w x y z) of the shape's frame in the body's. Set: as
                                sadmm_world_set_shape_frame */
    /* A row a joint. */
    SADMM_ARRAY_JOINT_FRAME, /* 14: its frame in a, position (m, |x| <= 1e9) and orientation (w x y z, of unit length),
                                then its frame in b: position_a, orientation_a, position_b, orientation_b of
                                sadmm_joint_def. Set: bodies stay where they are, and are drawn to where the joint has
                                them from then on, at up to settings.correction_speed */
    SADMM_ARRAY_COUNT
} sadmm_array;

#ifdef __cplusplus
}
#endif
#endif
