/* World level: bodies with shapes, stepped through time. What they are made of is in types.h.
 *
 * SI units. World frame for positions, orientations (unit quaternion w x y z, body to world), linear velocity
 * (of the centre of mass) and angular velocity. A body's own frame has its origin at the centre of mass and its
 * axes along the principal axes of inertia.
 *
 * Threads: use a world from one thread at a time, also to read it: calls that read may wait for steps, copy data from a
 * device and set the message, so they take a world that is not const. Calls that take a const world only read, and may
 * run on several threads at once while no other call is made on it. Different worlds are independent.
 *
 * Errors that every call has besides its own: INVALID_ARGUMENT where a pointer is NULL that must not be. Calls that
 * wait for steps (all that read what a step changes) also return the error of a step begun with sadmm_world_step_async,
 * once. Ids are small values with a generation: the id of a destroyed object gives SADMM_ERROR_STALE_ID, and never
 * names another object.
 *
 * A process may fork while no call is running: parent and child then have a copy of the world each. CUDA devices do not
 * survive a fork, and neither do threads: if the parent has used OpenMP's, the child steps and solves on one
 * thread, with the same results; so do worlds and problems with the parent's `tasks`.
 */
#ifndef SUBADMM_WORLD_H
#define SUBADMM_WORLD_H

#include "problem.h"
#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- world ------------------------------------------------------------------------------------------------- */

/* Errors: INVALID_ARGUMENT, UNAVAILABLE, OUT_OF_MEMORY (message: sadmm_last_message). */
SADMM_API sadmm_status sadmm_world_create(const sadmm_world_def *def, sadmm_world **out);
SADMM_API void sadmm_world_destroy(sadmm_world *world); /* NULL is fine */
/* The message of the last failed call on this world, "" when none failed or world is NULL; valid until the next
 * call. */
SADMM_API const char *sadmm_world_message(const sadmm_world *world);

/* Replace or read the settings; they take effect at the next step. If dt changes, the next step warm starts from the
 * same forces. Numbers (dt, gravity, relaxation, penalties, tolerances, error correction) may change at every step;
 * while asynchronous steps are running (sadmm_world_step_async), a change of anything else, e.g. of iterations, waits
 * for them. Errors: INVALID_ARGUMENT (nothing changes). The settings of NULL are the default ones. */
SADMM_API sadmm_status sadmm_world_set_settings(sadmm_world *world, const sadmm_settings *settings);
SADMM_API void sadmm_world_settings_sized(const sadmm_world *world, sadmm_settings *settings, size_t size);
static inline sadmm_settings sadmm_world_settings(const sadmm_world *world)
{
    sadmm_settings settings;
    sadmm_world_settings_sized(world, &settings, sizeof settings);
    return settings;
}

/* Change backend, precision or device (as in sadmm_world_def) from the next step on; the state and the impulses for
 * warm starting are kept. Waits for steps begun. Errors: as sadmm_world_create, and those of the steps begun (nothing
 * changes; after DEVICE for a lost device, call again). */
SADMM_API sadmm_status sadmm_world_set_backend(sadmm_world *world, sadmm_backend backend, sadmm_precision precision,
                                               int device);

/* ---- bodies ------------------------------------------------------------------------------------------------ */

/* *id: the new body. Errors: INVALID_ARGUMENT (range; nothing changes), LIMIT (2^27 bodies), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_add_body(sadmm_world *world, const sadmm_body_def *def, sadmm_body_id *id);
/* Destroys its shapes too, its joints (joint.h) and its couplings (coupling.h). Errors: STALE_ID. */
SADMM_API sadmm_status sadmm_world_remove_body(sadmm_world *world, sadmm_body_id id);
SADMM_API int32_t sadmm_world_body_count(const sadmm_world *world);      /* all, static ones included; of NULL: 0 */
/* The index-th live body in order of creation slot, index in [0, body_count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_world_body_at(sadmm_world *world, int32_t index, sadmm_body_id *id);

/* The state after the steps begun so far. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_body_state(sadmm_world *world, sadmm_body_id id, sadmm_body_state *state);
/* Position and velocity may be any finite numbers, so that every state that was read can be set again; the orientation
 * is as in the definition, and velocities are 0 for static bodies. Contacts lose accuracy beyond the ranges of the
 * definition. A new pose is a teleport: the contacts of the body start anew, without the memory of which side it came
 * from. To set velocities alone, pass the pose that was read. A kinematic body moves on with the velocity until it is
 * set again. A conveyor belt is a shape with a surface velocity (sadmm_shape_def). Errors: STALE_ID,
 * INVALID_ARGUMENT (nothing changes). */
SADMM_API sadmm_status sadmm_world_set_body_state(sadmm_world *world, sadmm_body_id id, const sadmm_body_state *state);
/* Move a kinematic body to a pose (m, |x| <= 1e9; w x y z, as in the definition) within the next step, with the
 * constant velocity that takes it there, rotating the shorter way; contacts and joints see that velocity. After the
 * step it has exactly that pose and is at rest. Setting its state before the step cancels the move. Errors: STALE_ID,
 * INVALID_ARGUMENT (range; a body that is not kinematic; nothing changes). */
SADMM_API sadmm_status sadmm_world_move_body(sadmm_world *world, sadmm_body_id id, const double position[3],
                                             const double orientation[4]);
/* *pending: whether the next step moves the kinematic body to a pose (sadmm_world_move_body); if so, position (m) and
 * orientation (w x y z) are written. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_body_move(sadmm_world *world, sadmm_body_id id, bool *pending, double position[3],
                                             double orientation[4]);
/* Read back the definition (mass, inertia, type, name, user data, scale of gravity, damping) with the current state.
 * The name is the world's copy, as of sadmm_world_body_name. Errors: STALE_ID, DEVICE. */
SADMM_API sadmm_status sadmm_world_body_def_sized(sadmm_world *world, sadmm_body_id id, sadmm_body_def *def,
                                                  size_t size);
static inline sadmm_status sadmm_world_body_def(sadmm_world *world, sadmm_body_id id, sadmm_body_def *def)
{
    return sadmm_world_body_def_sized(world, id, def, sizeof *def);
}
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
/* The body that has this name: names are those of definitions, cut as they are. Looks through all names of bodies.
 * Errors: INVALID_ARGUMENT (no body has it, several have it, or it is ""; the message says how many). */
SADMM_API sadmm_status sadmm_world_body_named(sadmm_world *world, const char *name, sadmm_body_id *id);
/* Its name, "" where it has none, for a stale id and for NULL: the world's copy, valid until the body is removed, or
 * the world restored or destroyed. */
SADMM_API const char *sadmm_world_body_name(const sadmm_world *world, sadmm_body_id id);
/* A pointer of the caller's that is stored with the body and never used by the library: the user_data of its
 * definition, or what was set since; NULL for a stale id and for a NULL world. A number of up to 64 bits goes through
 * uintptr_t. It is not saved: sadmm_world_restore (save.h) keeps it with bodies that had the same id before. Errors:
 * STALE_ID, OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_set_body_user_data(sadmm_world *world, sadmm_body_id id, void *data);
SADMM_API void *sadmm_world_body_user_data(const sadmm_world *world, sadmm_body_id id);
/* Sum of the contact wrenches of the last step on the body: force (N), then torque about its centre of mass
 * (N m), world frame (eq. 12). With sub-steps: the mean over them, so that dt times the wrench is the impulse of the
 * whole step. For dynamic and kinematic bodies. Errors: STALE_ID, UNAVAILABLE when settings.recover_wrenches was false,
 * and of static bodies. */
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
SADMM_API sadmm_status sadmm_world_shape_def_sized(sadmm_world *world, sadmm_shape_id id, sadmm_shape_def *def,
                                                   size_t size, sadmm_body_id *body /* may be NULL */);
static inline sadmm_status sadmm_world_shape_def(sadmm_world *world, sadmm_shape_id id, sadmm_shape_def *def,
                                                 sadmm_body_id *body /* may be NULL */)
{
    return sadmm_world_shape_def_sized(world, id, def, sizeof *def, body);
}
/* Replace friction and restitution of a shape, ranges as in the definition, from the next step on. Errors: STALE_ID,
 * INVALID_ARGUMENT (range; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_shape_material(sadmm_world *world, sadmm_shape_id id, double friction,
                                                      double restitution);
/* Replace the surface velocity of a shape (m/s, in its frame; meaning and range as in the definition) from the next
 * step on. Steps of a world with such a shape are made by the host, on CUDA too (docs/guide/contacts.md). Errors:
 * STALE_ID, INVALID_ARGUMENT (range; other than 0 on a dynamic body; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_shape_surface_velocity(sadmm_world *world, sadmm_shape_id id,
                                                              const double velocity[3]);
/* Replace the sizes of a shape (m, meaning and range as in the definition; those that its type does not use must be 0)
 * from the next step on. Of a sphere, capsule, box, cylinder, cone or ellipsoid; planes, hulls and meshes have none.
 * The body keeps its mass, its inertia and its centre of mass: see sadmm_world_set_body_mass. Contacts of the shape
 * begin anew, without their impulses and without the memory of which side they came from. What a shape grows into it
 * overlaps: position correction parts them. Numbers that are what the shape has cost nothing. Errors: STALE_ID,
 * INVALID_ARGUMENT (range; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_shape_size(sadmm_world *world, sadmm_shape_id id, const double size[3]);
/* Replace the pose of a shape of any type in its body's frame (m; w x y z; ranges as in the definition) from the next
 * step on; mass and contacts as above. Of a mesh on a static body this moves the terrain. An orientation that is of
 * unit length to rounding is taken as it is. Errors: STALE_ID, INVALID_ARGUMENT (range; nothing changes), DEVICE. */
SADMM_API sadmm_status sadmm_world_set_shape_frame(sadmm_world *world, sadmm_shape_id id, const double position[3],
                                                   const double orientation[4]);
/* The shape that has this name, as sadmm_world_body_named. Errors: INVALID_ARGUMENT (none has it, or several). */
SADMM_API sadmm_status sadmm_world_shape_named(sadmm_world *world, const char *name, sadmm_shape_id *id);
/* Its name; "" as of sadmm_world_body_name. */
SADMM_API const char *sadmm_world_shape_name(const sadmm_world *world, sadmm_shape_id id);
/* The user_data of its definition, or what was set since; as of sadmm_world_set_body_user_data. Errors: STALE_ID,
 * OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_set_shape_user_data(sadmm_world *world, sadmm_shape_id id, void *data);
SADMM_API void *sadmm_world_shape_user_data(const sadmm_world *world, sadmm_shape_id id);
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

/* Besides bodies, shapes and joints a world keeps data from step to step for warm starting: the impulse of every
 * contact (by shapes and feature), the axis and side of every pair of shapes, the forces and full turns of every joint,
 * and the recent accelerations of every body. Setting the same states again therefore gives similar steps, but not the
 * same bits; to repeat a run bit for bit, begin with a new world (or save.h). */

/* One time step of settings.dt, with all of its sub-steps (settings.substeps); after an error nothing of it has been
 * done. Under constant forces, sliding friction included, the motion is exact, x + v t + a t^2 / 2, between the steps
 * in which contacts begin or end. Errors: OUT_OF_MEMORY, NON_FINITE (state rolled back to before the step, message
 * names the body), DEVICE, LIMIT. After an error the world is as before the step and stays usable. NON_FINITE is also
 * returned if the certificate (settings.certify) overflows; on CUDA that step counts as done.
 *
 * DEVICE: a device call failed; any function that waits for steps may return it, once. All device memory of the world
 * is released, and the next step uploads the world to a new context. If the device still works, nothing is lost: the
 * world is as after the last step done. If it does not, the host's copy is used: bodies as they were when a function
 * that reads states (sadmm_world_body_state, _body_def, _body_contact_wrench, _state_hash) was called last, impulses as
 * when contacts were read last, and every state and wrench set since; time and sadmm_step_report.step go back to that
 * step, which the message names. All functions but steps work on; steps return DEVICE until the device works again
 * (CUDA, after a kernel fault: until the program resets the device, once every world on it has returned the error, or
 * the process ends). sadmm_world_set_backend moves the world to another backend. */
SADMM_API sadmm_status sadmm_world_step(sadmm_world *world);

/* Begin a step and return without waiting for it, if the backend can: CUDA, with the method FAST, from the second step
 * on; not with a residual_tolerance, nor with a tolerance in the method PAPER or with more than 64 convergence checks a
 * step. Otherwise the same as sadmm_world_step. A few steps are queued and run in order; states,
 * wrenches and settings set in between take effect at the next one. Getters wait for the steps begun so far. Errors: as
 * sadmm_world_step; they may be those of an earlier step; no step after that one has been done then
 * (sadmm_step_report.step counts the steps done). With settings.certify, or where events are recorded (events.h), the
 * step is waited for. Use a world from one thread at a time; different worlds are independent, also on one device. */
SADMM_API sadmm_status sadmm_world_step_async(sadmm_world *world);
/* Wait until all steps begun are done; returns at once if there are none. Errors: the first error of a step, see
 * above. */
SADMM_API sadmm_status sadmm_world_wait(sadmm_world *world);

/* ms. Wall time on the host; where the backend keeps the world (CUDA), the phases are on the device's clock, and so is
 * the total of a step begun with sadmm_world_step_async. */
typedef struct sadmm_phase_times { double total, collide, assemble, solve, finish; } sadmm_phase_times;

/* With sub-steps: error and unsolved are the largest of any; contacts, pairs, residual and certificate are those of the
 * last sub-step; iterations, iterations_mean and times are sums over all, converged holds for all, and the other counts
 * and penetration_max are the largest of any. It may grow (status.h). */
typedef struct sadmm_step_report {
    sadmm_backend backend;
    sadmm_precision precision;
    int threads;                   /* CPU threads that worked on the step: the most at a time */
    int64_t step;                  /* steps done since creation */
    double time;                   /* simulated time after the step, s */
    int32_t bodies;                /* dynamic bodies */
    int32_t joints;                /* joints that took part (joint.h): enabled, with something locked or acting */
    int32_t couplings;             /* couplings that took part (coupling.h): enabled, with gains */
    int32_t contacts;              /* contact points of the solve, without hits within the step (settings.hits) */
    int32_t pairs;                 /* shape pairs with at least one contact */
    int iterations;                /* iterations done, 0 where every island was solved without (settings.ncp_points);
                                      with a tolerance on CUDA (below): the largest number of any island */
    double iterations_mean;        /* mean over islands. Differs from `iterations` only on CUDA with a tolerance (method
                                      FAST, at most 64 convergence checks a step), where every island stops on its
                                      own */
    double error;                  /* how far the step is from the laws, m/s: the largest of what error_kind names. -1:
                                      not known: tolerance 0 without settings.certify, or made on CUDA, where islands
                                      are counted alone (unsolved) */
    sadmm_step_error error_kind;   /* what the largest is */
    int64_t unsolved;              /* islands that miss settings.tolerance; -1: it is 0 */
    bool converged;                /* a stop rule was met, by every island */
    int32_t limited;               /* islands that ended the iterations with more kinetic energy than contacts can
                                      leave them with. FAST: they were slowed down; and so were those counted here that,
                                      with fewer than 60 iterations and a warm start, were in a bounce that they
                                      cannot make. PAPER: they are left as they are. In a few steps after an
                                      impact that is no reason for more iterations; in many it is */
    int64_t repeated;              /* steps since creation that an asynchronous backend (CUDA) began with too little
                                      capacity or the wrong plan, and repeated; this only costs time */
    double penetration_max;        /* deepest overlap at the start of the step, m, >= 0: of sadmm_contact.separation */
    double joint_drift;            /* largest error of a locked translation of a joint after the step, m, >= 0; 0
                                      without joints */
    sadmm_phase_times ms;          /* the certificate's own time is in `certify_ms`, not in here */
    double certify_ms;             /* wall time of the certificate on the host, ms; 0: there is none */
    sadmm_residual residual;       /* valid if measured (for settings.measure_residuals, a penalty update or a
                                      tolerance), else -1. Not measured where islands stop on their own */
    sadmm_certificate certificate; /* valid if settings.certify; else ncp_max = -1 */
} sadmm_step_report;

/* The report of the last step (zeroed before the first). Waits for steps; errors: those of the steps waited for. */
SADMM_API sadmm_status sadmm_world_report_sized(sadmm_world *world, sadmm_step_report *report, size_t size);
static inline sadmm_status sadmm_world_report(sadmm_world *world, sadmm_step_report *report)
{
    return sadmm_world_report_sized(world, report, sizeof *report);
}

/* Contacts are found where the bodies are halfway through the step by their velocities at its start, or where what is
 * fast first touches; impulses, separations and the certificate are those of that geometry
 * (docs/internals/contact-geometry.md, "Midpoint and first touch"). With sub-steps: of the last one, and so are the
 * length of the step and its start. */
typedef struct sadmm_contact {
    sadmm_body_id body_a, body_b;
    sadmm_shape_id shape_a, shape_b;
    double position[3];   /* m, world, halfway between the two surfaces at the midpoint of the step; between two dynamic
                             bodies, moved back to the start of the step by their mean velocity */
    double normal[3];     /* unit, world, from a to b, at the midpoint of the step */
    double separation;    /* m, negative: penetration; at the start of the step, extrapolated back from the midpoint by
                             the velocities along this normal, so that separation + dt x relative velocity is the
                             separation at the end. It differs from the distance at the start by second order terms of
                             the rotation in half a step */
    double friction;      /* mu of the pair */
    double impulse[3];    /* on b, world, N s */
    double force[3];      /* impulse / dt, on b, world, N (eq. 12) */
    uint32_t feature;     /* id of the touching features, stable from step to step within a shape pair, and of a mesh
                             within a triangle */
    int32_t triangle;     /* index of the triangle of a mesh (mesh.h) in its definition; of a heightfield: 2 x cell (row
                             x (columns - 1) + column), + 1 for the triangle with the larger y. -1: neither shape is a
                             mesh */
} sadmm_contact;

/* Number of contacts of the last step done; 0 before the first step, after a removal, and for NULL. A step that failed
 * changes nothing here, but on CUDA contacts that were not read before it are lost (0). Waits for steps; an error of a
 * step is returned by the next call that returns a status. */
SADMM_API int32_t sadmm_world_contact_count(sadmm_world *world);
/* Copy contacts [first, first + count) of the last step. Hits within the step (settings.hits) come last, one point
 * each, with separation 0 and the impulse of the hit. Errors: INVALID_ARGUMENT (range), OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_contacts(sadmm_world *world, int32_t first, int32_t count, sadmm_contact *contacts);
/* Of the same contacts the natural map, m/s (docs/internals/algorithm.md, "Certificate and stop rules"): how far each
 * is from its law. The largest of them and of the joints' is the certificate's ncp_max. Errors: INVALID_ARGUMENT
 * (range), UNAVAILABLE (the last step was made without settings.certify, or the world was restored since), DEVICE. */
SADMM_API sadmm_status sadmm_world_contact_errors(sadmm_world *world, int32_t first, int32_t count, double *errors);

/* 64-bit hash of all live bodies' poses and velocities (bit patterns, in slot order). Nothing is written after an
 * error. Errors: those of the steps waited for, OUT_OF_MEMORY, DEVICE. */
SADMM_API sadmm_status sadmm_world_state_hash(sadmm_world *world, uint64_t *hash);

/* Text lines that say what the last step ran, what it left out, and why. Writes at most `size` bytes with the final 0
 * and returns the full length; `text` may be NULL with a size of 0. Before the first step: the choice of backend only.
 * For a NULL world: "", 0. Waits for steps; an error of a step is returned by the next call that returns a status. */
SADMM_API size_t sadmm_world_explain(sadmm_world *world, char *text, size_t size);

/* Copy the contact problem of the last step or sub-step (bodies, contacts, rows of joints, initial values) into
 * `problem`. Body k is the k-th dynamic body in slot order. Kinematic bodies have the index -1, and their contacts a
 * velocity. Errors: UNAVAILABLE before the first step, after a removal, and if the contacts were lost with a failed
 * step (sadmm_world_contact_count); OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_world_freeze(sadmm_world *world, sadmm_problem *problem);

#ifdef __cplusplus
}
#endif
#endif
