/* World level: bodies with shapes, stepped through time.
 *
 * SI units. World frame for positions, orientations (unit quaternion w x y z, body to world), linear velocity
 * (of the centre of mass) and angular velocity. A body's own frame has its origin at the centre of mass and its
 * axes along the principal axes of inertia.
 *
 * Threads: a world is used by one thread at a time, also where it is only read, because calls that read it may wait for
 * steps, fetch what a device holds and leave a message: they take a world that is not const. The few that take a const
 * one only read it, and may run on several threads at once while no other call is made on it. Different worlds are
 * independent.
 *
 * Errors, of every call besides its own: INVALID_ARGUMENT where a pointer is NULL that may not be. Calls that wait for
 * steps (all that read what a step changes) also return the error of a step begun with sadmm_world_step_async, once.
 * Ids are small values with a generation: an id of a destroyed object gives SADMM_ERROR_STALE_ID, never another object.
 *
 * After a fork, while no call was running, parent and child each have a world of their own (not on CUDA, whose devices
 * do not survive one). Threads do not survive it either: a child of a process that has stepped or solved on OpenMP's
 * threads steps and solves on one, with the same results, and so do worlds and problems in it that have the parent's
 * `tasks`.
 */
#ifndef SUBADMM_WORLD_H
#define SUBADMM_WORLD_H

#include "hull.h"
#include "mesh.h"
#include "problem.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_world sadmm_world;

/* index + 1 in `slot`, so that a zeroed id is never valid. */
typedef struct sadmm_body_id { uint32_t slot, generation; } sadmm_body_id;
typedef struct sadmm_shape_id { uint32_t slot, generation; } sadmm_shape_id;

/* ---- world ------------------------------------------------------------------------------------------------- */

typedef struct sadmm_world_def {
    sadmm_backend backend;      /* default AUTO */
    sadmm_precision precision;  /* default F64 */
    int device;                 /* accelerator index, >= 0; default 0 */
    double contact_margin;      /* speculative margin as a share of the thinner shape's smallest extent, in [0, 1];
                                   default 0.02. Contacts are made within the margin, or what gravity and the wrenches
                                   on the two bodies can close in one step (acceleration x dt^2) where that is more, +
                                   the distance that their velocities close in it */
    sadmm_tasks tasks;          /* threads of the host to work on steps; default all zero: OpenMP's (tasks.h) */
    sadmm_settings settings;
} sadmm_world_def;

/* The defaults named above. Thread-safe. */
SADMM_API sadmm_world_def sadmm_world_def_default(void);

/* Errors: INVALID_ARGUMENT, UNAVAILABLE, OUT_OF_MEMORY (message: sadmm_last_message). */
SADMM_API sadmm_status sadmm_world_create(const sadmm_world_def *def, sadmm_world **out);
SADMM_API void sadmm_world_destroy(sadmm_world *world); /* NULL is fine */
/* The message of the last failed call on this world, "" when none failed or world is NULL; valid until the next
 * call. */
SADMM_API const char *sadmm_world_message(const sadmm_world *world);

/* Replace or read the settings; they take effect at the next step. (Sub-)steps of another length go on with the forces
 * of the last one. Numbers (dt, gravity, relaxation, penalties, tolerances, error correction) may change at every step;
 * where steps run ahead (sadmm_world_step_async), a change of anything else, e.g. of iterations, waits for the steps
 * begun. Errors: INVALID_ARGUMENT (nothing changes). The settings of NULL are the default ones. */
SADMM_API sadmm_status sadmm_world_set_settings(sadmm_world *world, const sadmm_settings *settings);
SADMM_API sadmm_settings sadmm_world_settings(const sadmm_world *world);

/* Let another backend, precision or device (as in sadmm_world_def) make the steps from the next one on; the world goes
 * on from where it is, with its impulses. Steps begun are waited for. Errors: as sadmm_world_create, and those of the
 * steps begun (nothing changes; after a lost device's DEVICE, ask once more). */
SADMM_API sadmm_status sadmm_world_set_backend(sadmm_world *world, sadmm_backend backend, sadmm_precision precision,
                                               int device);

/* ---- bodies ------------------------------------------------------------------------------------------------ */

typedef enum sadmm_body_type {
    SADMM_BODY_DYNAMIC = 0,
    SADMM_BODY_STATIC,
    SADMM_BODY_KINEMATIC /* goes by its velocity, which nothing changes but the caller (sadmm_world_set_body_state,
                            sadmm_world_move_body), and pushes dynamic bodies as what has an infinite mass does; joints
                            may hold on to it. It meets neither static nor kinematic bodies. On CUDA worlds with
                            kinematic bodies are kept by the device as others are: what is set of them goes along with
                            the next step */
} sadmm_body_type;

typedef struct sadmm_body_def {
    sadmm_body_type type;        /* default DYNAMIC */
    double mass;                 /* kg, in [1e-9, 1e12]; of dynamic bodies, ignored for others; no default */
    double inertia[3]; /* principal moments, kg m^2, in [1e-24, 1e24], each <= the sum of the other two (relative
                                    1e-9), the largest <= 1e6 (F32) or 1e12 (F64) times the smallest */
    double position[3];          /* centre of mass, m, |x| <= 1e9 */
    double orientation[4];       /* w x y z, | |q| - 1 | <= 1e-6 (then normalised); default identity */
    double linear_velocity[3];   /* m/s, |v| <= 1e6; 0 for static bodies */
    double angular_velocity[3];  /* rad/s, |w| <= 1e6; 0 for static bodies */
    int32_t environment;         /* bodies of different environments never meet; >= 0, or -1 (not dynamic): meets all;
                                    default 0 (static: -1 is the usual choice) */
    const char *name;            /* UTF-8; copied, as many whole characters as fit into 63 bytes; NULL = "" */
    /* Of dynamic bodies, ignored for others: */
    double gravity_scale;        /* the body's gravity over settings.gravity, in [-1e6, 1e6]; default 1 */
    double linear_damping;       /* 1/s, in [0, 1e6]; default 0. c: a force -c mass velocity, so that free motion decays
                                    as exp(-c t), exactly and at any dt */
    double angular_damping;      /* the same of the angular velocity: a torque -c inertia velocity */
} sadmm_body_def;

/* The defaults named above. Thread-safe. */
SADMM_API sadmm_body_def sadmm_body_def_default(void);
/* *id: the new body. Errors: INVALID_ARGUMENT (range; nothing changes), LIMIT (2^27 bodies), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_add_body(sadmm_world *world, const sadmm_body_def *def, sadmm_body_id *id);
/* Destroys its shapes too, its joints (joint.h) and its couplings (coupling.h). Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_remove_body(sadmm_world *world, sadmm_body_id id);
SADMM_API int32_t sadmm_world_body_count(const sadmm_world *world);      /* all, static ones included; of NULL: 0 */
/* The index-th live body in order of creation slot, index in [0, body_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_body_at(sadmm_world *world, int32_t index, sadmm_body_id *id);

typedef struct sadmm_body_state {
    double position[3];          /* m */
    double orientation[4];       /* w x y z */
    double linear_velocity[3];   /* m/s */
    double angular_velocity[3];  /* rad/s, world frame */
} sadmm_body_state;

/* The state after the steps begun so far. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_body_state(sadmm_world *world, sadmm_body_id id, sadmm_body_state *state);
/* Any finite position and velocity is taken, so that what a step made can be set again; the orientation as in the
 * definition, velocities 0 for static bodies. Contacts lose accuracy beyond the ranges of the definition.
 * A pose other than the body has is a jump: the body's contacts are found as those of bodies that never touched before,
 * without what was known of the side they came from. Velocities may be set with the pose that was read.
 * Of a kinematic body: where it is, and how it moves from then on, until set again. A belt that stays where it is has
 * its pose set back before every step; what lies on it goes by the velocity.
 * Errors: STALE_ID, INVALID_ARGUMENT (nothing changes). */
SADMM_API sadmm_status sadmm_world_set_body_state(sadmm_world *world, sadmm_body_id id, const sadmm_body_state *state);
/* Let a kinematic body go to a pose (m, |x| <= 1e9; w x y z, as in the definition) within the next step, by the
 * constant velocity that brings it there, a turn by the shorter way; contacts and joints feel that velocity. Then it is
 * there, to the last bit, and at rest. Setting its state first takes that back. Errors: STALE_ID, INVALID_ARGUMENT
 * (range; a body that is not kinematic; nothing changes). */
SADMM_API sadmm_status sadmm_world_move_body(sadmm_world *world, sadmm_body_id id, const double position[3],
                                             const double orientation[4]);
/* Is a kinematic body to go to a pose within the next step (sadmm_world_move_body)? *pending: whether; position (m)
 * and orientation (w x y z) are written where it is. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_body_move(sadmm_world *world, sadmm_body_id id, bool *pending, double position[3],
                                             double orientation[4]);
/* Read back the definition (mass, inertia, type, name, scale of gravity, damping) with the current state. The name is
 * the world's own: it stays where it is, and valid, until the body is removed or the world destroyed. Errors: STALE_ID,
 * DEVICE. */
SADMM_API sadmm_status sadmm_world_body_def(sadmm_world *world, sadmm_body_id id, sadmm_body_def *def);
/* External force (N) at the centre of mass and torque (N m), world frame, each component within +-1e15; kept until set
 * again. Errors: STALE_ID, INVALID_ARGUMENT (range; a body that is not dynamic). */
SADMM_API sadmm_status sadmm_world_set_body_wrench(sadmm_world *world, sadmm_body_id id, const double force[3],
                                                   const double torque[3]);
/* Read back the external force (N) and torque (N m) as they are now; 0 of bodies that are not dynamic. Errors:
 * STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_body_wrench(sadmm_world *world, sadmm_body_id id, double force[3], double torque[3]);
/* Replace the scale of gravity, or damping (1/s), of a body, ranges and meaning as in the definition, from the next
 * step on. Errors: STALE_ID, INVALID_ARGUMENT (range; a body that is not dynamic; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_body_gravity_scale(sadmm_world *world, sadmm_body_id id, double scale);
SADMM_API sadmm_status sadmm_world_set_body_damping(sadmm_world *world, sadmm_body_id id, double linear,
                                                    double angular);
/* Add a force (N, each component within +-1e15) that acts at `point` (m, world, as the body is now, |x| <= 1e9) to the
 * body's external wrench, which is kept until set again: force, and (point - centre of mass) x force. Errors: STALE_ID,
 * INVALID_ARGUMENT (range, also of the sum; a body that is not dynamic; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_add_body_force_at(sadmm_world *world, sadmm_body_id id, const double force[3],
                                                     const double point[3]);
/* Change the body's velocities at once by an impulse (N s, each component finite) at `point` (as above): impulse /
 * mass, and I^-1 ((point - centre of mass) x impulse). Errors: STALE_ID, INVALID_ARGUMENT (a velocity that would not be
 * finite; a body that is not dynamic; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_apply_body_impulse_at(sadmm_world *world, sadmm_body_id id, const double impulse[3],
                                                         const double point[3]);
/* Replace mass (kg) and principal moments (kg m^2), ranges as in the definition, from the next step on; velocities
 * stay. Errors: STALE_ID, INVALID_ARGUMENT (range; a body that is not dynamic; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_body_mass(sadmm_world *world, sadmm_body_id id, double mass,
                                                 const double inertia[3]);
/* A pointer of the caller's that goes with the body and that the library never looks behind; NULL until set. Of a stale
 * id or a NULL world it is NULL. Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_set_body_user_data(sadmm_world *world, sadmm_body_id id, void *data);
SADMM_API void *sadmm_world_body_user_data(const sadmm_world *world, sadmm_body_id id);
/* Sum of the contact wrenches of the last step on the body: force (N), then torque about its centre of mass
 * (N m), world frame (eq. 12). With sub-steps their mean, so that dt times it is what contacts gave the body in the
 * step. Of dynamic and kinematic bodies. Errors: STALE_ID, UNAVAILABLE when settings.recover_wrenches was false, and of
 * static bodies. */
SADMM_API sadmm_status sadmm_world_body_contact_wrench(sadmm_world *world, sadmm_body_id id, double wrench[6]);
/* Turn contact between two bodies off or on again (default on). Errors: STALE_ID, INVALID_ARGUMENT (a and b the same),
 * OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_set_body_pair_contact(sadmm_world *world, sadmm_body_id a, sadmm_body_id b,
                                                         bool enabled);
/* Pairs of bodies whose contact is off; of NULL: 0. */
SADMM_API int32_t sadmm_world_body_pair_off_count(const sadmm_world *world);
/* The index-th of them in order of creation slots, the lower slot first, index in [0, body_pair_off_count). Errors:
 * INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_body_pair_off_at(sadmm_world *world, int32_t index, sadmm_body_id *a,
                                                    sadmm_body_id *b);

/* Principal inertia of solid bodies with their axes along the shape's, kg m^2. With a NULL pointer nothing is done.
 * box: half extents (m). capsule: radius and half length of the segment (m), axis z. */
SADMM_API void sadmm_box_inertia(double mass, const double half_extents[3], double inertia[3]);
SADMM_API void sadmm_sphere_inertia(double mass, double radius, double inertia[3]);
SADMM_API void sadmm_capsule_inertia(double mass, double radius, double half_length, double inertia[3]);

/* ---- shapes ------------------------------------------------------------------------------------------------ */

typedef enum sadmm_shape_type {
    SADMM_SHAPE_PLANE = 0, /* half-space z <= 0 of the shape's frame; static bodies only. size unused */
    SADMM_SHAPE_SPHERE,    /* size[0] radius */
    SADMM_SHAPE_CAPSULE,   /* size[0] radius, size[1] half length of the segment along the shape's z */
    SADMM_SHAPE_BOX,       /* size: half extents */
    SADMM_SHAPE_HULL,      /* convex hull (hull.h) in the frame of its points. size ignored; read back: the half extents
                              of the box that contacts are found with, in m */
    SADMM_SHAPE_MESH,      /* triangle mesh or heightfield (mesh.h) in the frame of its vertices, or of its grid; static
                              and kinematic bodies only. size ignored; read back: the half extents of the box around it,
                              in m */
    SADMM_SHAPE_CYLINDER,  /* size[0] radius, size[1] half height along the shape's z, m; its origin is the centre */
    SADMM_SHAPE_CONE,      /* size[0] radius of the base, size[1] half height along the shape's z, m: apex at +size[1],
                              base at -size[1]. The shape's origin is halfway up the axis, the centre of mass
                              size[1] / 2 below it (sadmm_shape_mass) */
    SADMM_SHAPE_ELLIPSOID, /* size: semi-axes along the shape's x, y and z, m; its origin is the centre */
    SADMM_SHAPE_TYPE_COUNT
} sadmm_shape_type;

typedef struct sadmm_shape_def {
    sadmm_shape_type type;
    double size[3];              /* m, each used entry in [1e-6, 1e6] */
    double position[3];          /* of the shape's frame in the body's, m; default 0 */
    double orientation[4];       /* shape to body, w x y z; default identity */
    double friction;             /* mu >= 0, <= 1e6; a pair uses the geometric mean; default 0.5 */
    double restitution;          /* in [0, 1]; a pair uses the larger; default 0 */
    uint32_t category, mask; /* two shapes meet if (a.category & b.mask) and (b.category & a.mask); default 1, all */
    const sadmm_hull *hull;      /* of HULL; NULL, the default, for all others. The world keeps it while it has shapes
                                    of it, so that the caller may destroy it at once. Read back: the same pointer, which
                                    is the world's own then */
    const sadmm_mesh *mesh;      /* of MESH; the same for it */
    bool sensor;                 /* touches nothing and reports what overlaps it (events.h); not of a MESH, which has no
                                    inside; default false */
} sadmm_shape_def;

/* The defaults named above. Thread-safe. */
SADMM_API sadmm_shape_def sadmm_shape_def_default(void);
/* *id: the new shape, on `body` until that is removed. Errors: STALE_ID, INVALID_ARGUMENT (range; a plane on a dynamic
 * body; nothing changes), LIMIT (2^28 shapes), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_add_shape(sadmm_world *world, sadmm_body_id body, const sadmm_shape_def *def,
                                             sadmm_shape_id *id /* may be NULL */);
/* Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_remove_shape(sadmm_world *world, sadmm_shape_id id);
SADMM_API int32_t sadmm_world_shape_count(const sadmm_world *world); /* of NULL: 0 */
/* The index-th live shape in order of creation slot, index in [0, shape_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_shape_at(sadmm_world *world, int32_t index, sadmm_shape_id *id);
/* Read back the definition, and the body that has the shape. Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_shape_def(sadmm_world *world, sadmm_shape_id id, sadmm_shape_def *def,
                                             sadmm_body_id *body /* may be NULL */);
/* Replace friction and restitution of a shape, ranges as in the definition, from the next step on. Errors: STALE_ID,
 * INVALID_ARGUMENT (range; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_shape_material(sadmm_world *world, sadmm_shape_id id, double friction,
                                                      double restitution);
/* Override the pair's friction (mu in [0, 1e6]), or give -1 to return to the geometric mean. Errors: STALE_ID,
 * INVALID_ARGUMENT (range; a and b the same), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_set_pair_friction(sadmm_world *world, sadmm_shape_id a, sadmm_shape_id b,
                                                     double friction);
/* Pairs of shapes with a friction of their own; of NULL: 0. */
SADMM_API int32_t sadmm_world_pair_friction_count(const sadmm_world *world);
/* The index-th of them in order of creation slots, the lower slot first, index in [0, pair_friction_count). Errors:
 * INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_pair_friction_at(sadmm_world *world, int32_t index, sadmm_shape_id *a,
                                                    sadmm_shape_id *b, double *friction);

/* ---- stepping ---------------------------------------------------------------------------------------------- */

/* Beside bodies, shapes and joints a world keeps from step to step: the impulse of every contact (by shapes and
 * feature), the axis and side of every pair of shapes, the forces of every joint and how often it has gone round, and
 * how steadily each body accelerates. The next step starts there, a world's
 * first step from nothing. So the same states, reached in another way or set again, go on alike but not bit for bit; a
 * run that is to be repeated bit for bit begins with a new world. */

/* One time step of settings.dt, with all of its sub-steps (settings.substeps), or none of it. Constant forces, friction
 * of what slides included, move bodies exactly, to x + v t + a t^2 / 2, until a contact begins or ends (which it does
 * at the beginning or end of a step). Errors: OUT_OF_MEMORY,
 * NON_FINITE (state rolled back to before the step, message names the body), DEVICE, LIMIT. After an error the world is
 * as before the step and stays usable. NON_FINITE also where settings.certify asks for a certificate of numbers whose
 * products overflow; on CUDA that step counts as done.
 *
 * DEVICE: a call of the device failed; any function that waits for steps begun may return it, once. Everything the
 * world had on the device is given up, and the next step loads the world into a new context. Where the device still
 * answers (a call failed, not the device) nothing is lost: the world is as after the last step done. Where it does not,
 * the host's copy counts: bodies as they were when a function that reads states (sadmm_world_body_state, _body_def,
 * _body_contact_wrench, _state_hash) was called last, impulses to start from as when contacts were, and every state and
 * wrench set since; time and sadmm_step_report.step go back to that step, which the message names. All functions but
 * steps go on with it; a step says DEVICE as long as the device does not answer (CUDA: after a fault of a kernel, until
 * the process ends or resets the device, which is for the program to do, once every world of the device has returned
 * the error). sadmm_world_set_backend takes the world elsewhere. */
SADMM_API sadmm_status sadmm_world_step(sadmm_world *world);

/* Begin a step and return without waiting for it, where the backend can: CUDA, in the method FAST from the second
 * step on; not with a residual_tolerance, nor with a certificate_tolerance in the method PAPER or with more than 64
 * convergence checks a step. Elsewhere the same as sadmm_world_step. Steps run in order, a few of them at a time;
 * states, wrenches and settings set in between take effect at the next one. Getters wait for the steps begun so far. Errors: as
 * sadmm_world_step; they may be those of an earlier step, and then nothing after that step has been done
 * (sadmm_step_report.step counts what has). With settings.certify, or where events are recorded (events.h), the step is
 * waited for. One thread at a time a world; different worlds are independent, also on one device. */
SADMM_API sadmm_status sadmm_world_step_async(sadmm_world *world);
/* Wait until all steps begun are done; at once when there are none. Errors: the first one of a step, see above. One
 * thread at a time a world. */
SADMM_API sadmm_status sadmm_world_wait(sadmm_world *world);

/* ms. Wall time on the host; where the backend keeps the world (CUDA), the phases are on the device's clock, and so is
 * the total of a step begun with sadmm_world_step_async. */
typedef struct sadmm_phase_times { double total, collide, assemble, solve, finish; } sadmm_phase_times;

/* With sub-steps: contacts, pairs, residual and certificate are the last one's; iterations, iterations_mean and times
 * sums over all of them; limited, penetration_max and certificate.islands_above the most of any; converged: all. */
typedef struct sadmm_step_report {
    sadmm_backend backend;
    sadmm_precision precision;
    int threads;                   /* CPU threads that worked on the step: the most at a time */
    int64_t step;                  /* steps done since creation */
    double time;                   /* simulated time after the step, s */
    int32_t bodies;                /* dynamic bodies */
    int32_t joints;                /* joints that took part (joint.h): enabled, with something locked or acting */
    int32_t couplings;             /* couplings that took part (coupling.h): enabled, with gains */
    int32_t contacts;              /* contact points of the solve; hits taken at their moment are none */
    int32_t pairs;                 /* shape pairs with at least one contact */
    int iterations;                /* done; with a stop rule on CUDA (below): by the island that did most */
    double iterations_mean;        /* over islands. The same, but where whole steps are made on CUDA with a stop rule
                                      (method FAST, settings.certificate_tolerance, at most 64 convergence checks
                                      a step): there every island is checked and stops by itself */
    bool converged;                /* a stop rule was met, by every island */
    int32_t limited;               /* islands that ended the iterations with more kinetic energy than contacts can
                                      leave them with. FAST: they were slowed down; and so were those counted here that,
                                      with fewer than 60 iterations in a step that starts warm, were in a bounce that
                                      they cannot make. PAPER: they are left as they are. In a few steps after an
                                      impact that is no reason for more iterations; in many it is */
    int64_t repeated;              /* steps since creation that a backend which runs ahead (CUDA) began with too small
                                      capacities or another plan than they needed, and repeated: nothing is lost but
                                      time */
    double penetration_max;        /* deepest overlap at the start of the step, m, >= 0: of sadmm_contact.gap */
    double joint_drift;            /* largest error of a locked translation of a joint after the step, m, >= 0; 0: there
                                      are none */
    sadmm_phase_times ms;          /* the certificate's own time is in `certify_ms`, not in here */
    double certify_ms;             /* wall time of the certificate on the host, ms; 0: there is none */
    sadmm_residual residual;       /* valid if measured (settings or penalty update or tolerance); else -1. Not measured
                                      where islands stop by themselves */
    sadmm_certificate
        certificate; /* valid if settings.certify or a certificate tolerance; else ncp_max = -1. Steps made
                                      on CUDA with a tolerance and without settings.certify: islands_above alone */
} sadmm_step_report;

/* The report of the last step (zeroed before the first). Waits for steps; errors: those of the steps waited for. */
SADMM_API sadmm_status sadmm_world_report(sadmm_world *world, sadmm_step_report *report);

/* Contacts are found where the bodies are halfway through the step by their velocities at its start, or where what is
 * fast first touches; impulses, gaps and the certificate are those of that geometry
 * (docs/internals/contact-geometry.md, "Midpoint and first touch"). With sub-steps: of the last one, and so are the
 * length of the step and its start. */
typedef struct sadmm_contact {
    sadmm_body_id body_a, body_b;
    sadmm_shape_id shape_a, shape_b;
    double position[3];   /* m, world, midway between the surfaces where they are halfway through the step; with two
                             dynamic bodies, less what their mean velocity moves it until then */
    double normal[3];     /* unit, world, from a to b, halfway through the step */
    double gap;           /* m, negative: penetration; at the start of the step: taken back from its middle by the
                             velocities along this normal, so that gap + dt x relative velocity is the one at its
                             end. It differs from the distance at the start by what bodies turn within half a
                             step, to second order */
    double friction;      /* mu of the pair */
    double impulse[3];    /* on b, world, N s */
    double force[3];      /* impulse / dt, on b, world, N (eq. 12) */
    uint32_t feature;     /* id of the touching features, stable from step to step within a shape pair, and of a mesh
                             within a triangle */
    int32_t triangle;     /* of a mesh (mesh.h), as its definition numbers them; of a heightfield twice the cell (row x
                             (columns - 1) + column), + 1 in its upper half of y. -1: neither shape is a mesh */
} sadmm_contact;

/* Contacts of the last step that was done, 0 where there was none, world is NULL, or something was removed since. A
 * step that failed changes nothing here; but where a backend keeps the world (CUDA) and the contacts were not read
 * before it, they are lost with it (0). Waits for steps; the error of one is left for the next call that returns a
 * status. */
SADMM_API int32_t sadmm_world_contact_count(sadmm_world *world);
/* Copy contacts [first, first + count) of the last step. Hits taken at their moment (settings.hits) are the last ones, a
 * point each, with a gap of 0 and the impulse of the hit. Errors: INVALID_ARGUMENT (range), OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_contacts(sadmm_world *world, int32_t first, int32_t count, sadmm_contact *contacts);
/* Of the same contacts the natural map, m/s (docs/internals/algorithm.md, "Certificate and stop rules"): how far each
 * is from its law. The largest of them and of the joints' is the certificate's ncp_max. Errors: INVALID_ARGUMENT
 * (range), UNAVAILABLE (the last step was made without settings.certify, or the world was restored since), DEVICE. */
SADMM_API sadmm_status sadmm_world_contact_errors(sadmm_world *world, int32_t first, int32_t count, double *errors);

/* 64-bit hash of all live bodies' poses and velocities (bit patterns, in slot order). Nothing is written after an
 * error. Errors: those of the steps waited for, OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_state_hash(sadmm_world *world, uint64_t *hash);

/* What the last step ran, what it left out and why, as text lines. Writes at most `size` bytes with the final 0 and
 * returns the full length; `text` may be NULL with a size of 0. Before the first step: the choice of backend only. Of
 * a NULL world: "", 0. Waits for steps; the error of one is left for the next call that returns a status. */
SADMM_API size_t sadmm_world_explain(sadmm_world *world, char *text, size_t size);

/* Freeze the contact problem of the last step, or sub-step (bodies, contacts, rows of joints, its starting values),
 * into `problem`. The k-th dynamic body in slot order is body k. Kinematic bodies are -1 there, their contacts have a
 * velocity. Errors: UNAVAILABLE before the first step, after a removal, and where a failed step took the last one's
 * contacts along (sadmm_world_contact_count); OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_freeze(sadmm_world *world, sadmm_problem *problem);

#ifdef __cplusplus
}
#endif
#endif
