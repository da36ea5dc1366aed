/* Whole steps on a backend that keeps the world itself: state, contacts and impulses stay in its memory from step to
 * step, and the host only says "go on". Optional (kernels.h, `resident`); world/resident/resident.c is the caller.
 *
 * Steps are enqueued: `step` may return before the step has run. Steps run in order. A step that fails leaves the world
 * as it was before it, and those enqueued after it do not run; `wait` reports it. What a step could not know when it
 * was enqueued (how many contacts there will be) is no failure: the backend repeats the step with larger capacities.
 *
 * What may change from step to step without loading the world again are updates: a kind, a target and numbers, in the
 * backend's memory before the step that they come with. So are the settings' numbers. A step that was not done has
 * taken none of its updates: the caller gives them again.
 */
#ifndef SADMM_CORE_SOLVE_RESIDENT_H
#define SADMM_CORE_SOLVE_RESIDENT_H

#include "core/base/error.h"
#include "core/model/system.h"
#include "plan.h"

struct sadmm_context;
struct sadmm_collision_input;
struct sadmm_resident_joint; /* core/model/joint_law.h */
struct sadmm_joint_memory;
struct sadmm_coupling_memory; /* core/model/coupling_law.h */
struct sadmm_kinematic_body;  /* core/model/kinematic.h */
struct sadmm_resident_gear;   /* core/model/gear_law.h */

/* A world of many equal ones (environments): bodies, shapes and joints one world after the other. So many of each: */
struct sadmm_resident_copies {
    int32_t count;             /* worlds */
    int32_t bodies, kinematic; /* dynamic bodies, and kinematic ones; */
    int32_t shapes;            /* slots */
    int32_t joints, couplings, gears; /* joints: without those that couplings are */
};

/* A world, from the host. */
struct sadmm_resident_world {
    const struct sadmm_collision_input *input;       /* shapes, bodies by slot, overrides */
    int32_t body_count;                              /* dynamic bodies */
    const struct sadmm_rigid *rigid;                 /* (body_count) */
    const struct sadmm_extrapolation *extrapolation; /* (body_count) */
    const int32_t *slot_of;                          /* (body_count) body slot */
    int32_t kinematic_count;
    const struct sadmm_kinematic_body *kinematic; /* (kinematic_count) none with a target: these come as updates */
    const struct sadmm_contact_set *contacts;     /* of the last step, with impulses */
    int32_t joint_count;
    const struct sadmm_resident_joint *joints;      /* (joint_count) */
    const struct sadmm_joint_memory *joint_memory;  /* (joint_count) of the last step */
    size_t table_numbers;
    const double *tables;                      /* (table_numbers) of springs, as joints say */
    int32_t coupling_count;
    const struct sadmm_coupling_memory *coupling_memory; /* (coupling_count) likewise */
    int32_t gear_count;
    const struct sadmm_resident_gear *gears;   /* (gear_count) */
    const double *gear_force;                  /* (gear_count) along the first coordinate, of the last step: N or N m */
    const unsigned char *held;                 /* by body slot: joints hold it, and it is not hit at its moment
                                                  (world/hits.c) */
    double time;                               /* simulated until now, s */
    const struct sadmm_resident_copies *copies; /* not NULL: it is many equal worlds, each solved as if alone */
    const double *gravities;                    /* (copies->count x 3) of each, m/s^2; NULL: that of the settings */
};

enum sadmm_update_kind {
    SADMM_UPDATE_STATE,    /* target: a dynamic body, or a kinematic one; position (3), orientation (4), velocity (6) */
    SADMM_UPDATE_FORCES,   /* target: a dynamic body; force, torque (6), scale of gravity, damping (2) */
    SADMM_UPDATE_TARGET,   /* target: a kinematic body; 1: it is to be there after the step, 0: it goes by its velocity;
                              position (3), orientation (4), the length of the step (s) */
    SADMM_UPDATE_SETTINGS, /* sadmm_settings_numbers(): a backend's own, from what `step` is given */
    SADMM_UPDATE_JOINT,    /* target: SADMM_JOINT_TARGETS joint + k; k < 6: the numbers of that coordinate
                              (joint_coordinate_numbers); k = 6: enabled (1 or 0); k = 7: a coupling's target: position
                              (3), orientation (4), velocity (6) */
    SADMM_UPDATE_GEAR,     /* target: a gear; enabled (1 or 0) */
    SADMM_UPDATE_KINDS
};
enum { SADMM_JOINT_TARGETS = 8 }; /* a joint */
enum { SADMM_UPDATE_VALUES = 14, SADMM_BODY_UPDATES = 3 /* the kinds of a body, the first ones */ };

/* A change between two steps. There is at most one of a kind and target, so that their order does not matter. */
struct sadmm_resident_update {
    int32_t kind; /* enum sadmm_update_kind */
    int32_t target;
    double values[SADMM_UPDATE_VALUES];
};

/* The last step that was done. */
struct sadmm_resident_report {
    int64_t done;              /* steps since the world was loaded */
    double time;               /* simulated until after it, s */
    sadmm_settings settings;   /* it was made with; before the first one: those of load */
    int64_t repeats;           /* steps repeated since then because something did not fit */
    struct sadmm_plan plan;
    int iterations;            /* of the island with the most */
    double iterations_mean;    /* over islands */
    bool converged;            /* every island met the stop rule */
    double error;              /* m/s; -1: not known */
    sadmm_step_error error_kind;
    int64_t unsolved;          /* islands that miss the tolerance; -1: there is none */
    int32_t limited;           /* islands with too much energy */
    int32_t joints, couplings; /* that took part, in the last sub-step */
    double penetration_max;    /* m */
    double joint_drift;        /* m */
    struct sadmm_residual residual; /* -1: not measured */
    struct {
        double total, collide, assemble, solve, finish;
    } ms;                      /* on the backend's own clock */
    int32_t offending_body;           /* NON_FINITE: a body that is not finite (below: a kinematic one), -1: unknown */
};

/* Where a backend has bodies after the last step done: pointers of its device's memory, not to be written to. */
struct sadmm_resident_view {
    const struct sadmm_rigid *rigid; /* (bodies) */
    const double *wrench;            /* bodies x 6, of contacts, where the step recovered them */
    void *stream;                    /* what steps run on: cudaStream_t */
};

/* An array (subadmm/arrays.h) of all worlds of such a one. */
struct sadmm_resident_array {
    int32_t array;          /* sadmm_array */
    int32_t rows, columns;  /* of each */
    bool single;            /* numbers are floats, else doubles */
    void *values;           /* (worlds x rows x columns) in the backend's memory, as is: */
    double lo[2], hi[2];    /* in: ranges of numbers that the world takes: the first column's, the others' */
    const int32_t *objects; /* (rows) what a row is of: a body of the step (contact_set.h); a shape, joint, coupling */
    const void *upper;      /* in, JOINT_LOWER: numbers of JOINT_UPPER, which are taken along; NULL: these stay */
    bool upper_single;      /* they are floats */
};

/* What steps change of one of them. */
struct sadmm_resident_state {
    const struct sadmm_rigid *rigid;                 /* (bodies) */
    const struct sadmm_extrapolation *extrapolation; /* (bodies) */
    const double *wrench;                            /* (bodies x 6) of contacts */
    const struct sadmm_kinematic_body *kinematic;    /* (kinematic) */
    const double *kinematic_wrench;                  /* (kinematic x 6) */
    const struct sadmm_joint_memory *joints;         /* (joints, couplings) */
    const uint8_t *enabled;                          /* (joints) */
    const struct sadmm_coupling_memory *couplings;   /* (couplings) */
    const double *gear_force;                        /* (gears) */
    const struct sadmm_contact_set *contacts;        /* shapes and bodies numbered as in the first one */
};

/* How well one of them was solved in the last step. */
struct sadmm_copy_measures {
    double error;           /* natural map of its contacts and rows, m/s (solve_error.h) */
    double penetration_max; /* m */
    double joint_drift;     /* m */
    int32_t contacts, iterations;
    int32_t unsolved;       /* islands above the tolerance, where there is one */
    int32_t unused;
};

struct sadmm_resident_kernels {
    /* Take over a world. Everything the backend kept before is forgotten. */
    sadmm_status (*load)(struct sadmm_context *, const struct sadmm_resident_world *, const struct sadmm_settings *,
                         struct sadmm_error *);
    /* Enqueue a step, with updates before it (free again on return). An error is this step's, or an earlier one's: then
     * `wait` says how far the world has got. Numbers of the settings (settings.h) may change at every step; where the
     * rest of them does, the backend may wait for the steps before. */
    sadmm_status (*step)(struct sadmm_context *, const struct sadmm_settings *,
                         const struct sadmm_resident_update *updates, size_t count, struct sadmm_error *);
    /* Until all enqueued steps have run. The report is filled also when a step has failed; after any error but
     * SADMM_ERROR_DEVICE nothing is enqueued any more. */
    sadmm_status (*wait)(struct sadmm_context *, struct sadmm_resident_report *, struct sadmm_error *);
    /* The world after the last step done; any pointer may be NULL. Nothing may be enqueued. */
    sadmm_status (*read_bodies)(struct sadmm_context *, struct sadmm_rigid *rigid,
                                struct sadmm_extrapolation *extrapolation, double *wrench /* (bodies x 6) */,
                                struct sadmm_error *);
    /* Kinematic bodies after the last step done, what contacts gave them in it (kinematic_count x 6), and the
     * velocities that they had in it (kinematic_count x 6); any pointer may be NULL. Nothing may be enqueued. */
    sadmm_status (*read_kinematic)(struct sadmm_context *, struct sadmm_kinematic_body *, double *wrench,
                                   double *velocity, struct sadmm_error *);
    /* Until the next step, or load. Nothing may be enqueued. */
    sadmm_status (*view)(struct sadmm_context *, struct sadmm_resident_view *, struct sadmm_error *);
    /* Contacts of the last step done, with its impulses. Nothing may be enqueued. */
    sadmm_status (*read_contacts)(struct sadmm_context *, struct sadmm_contact_set *contacts, struct sadmm_error *);
    /* Which pairs of the last step done touch (base/contact_set.h): as many as its report has pairs, in the order of
     * read_contacts. Nothing may be enqueued. */
    sadmm_status (*read_touching)(struct sadmm_context *, struct sadmm_touching_shapes *, struct sadmm_error *);
    /* Hits that the last step done has taken at their moment, if there is room for them; *first: of its last sub-step.
     * Nothing may be enqueued. */
    sadmm_status (*read_hits)(struct sadmm_context *, struct sadmm_world_hit *, size_t capacity, size_t *count,
                              size_t *first, struct sadmm_error *);
    /* What the last step done started from: bodies, velocities (bodies x 6, m/s and rad/s) and impulses (points x 3, N
     * s); any pointer may be NULL. Nothing may be enqueued. */
    sadmm_status (*read_start)(struct sadmm_context *, struct sadmm_rigid *rigid, double *velocity, double *impulse,
                               struct sadmm_error *);
    /* What joints, couplings and gears keep after the last step done. Nothing may be enqueued. */
    sadmm_status (*read_joints)(struct sadmm_context *, struct sadmm_joint_memory *, struct sadmm_coupling_memory *,
                                double *gear_force, struct sadmm_error *);
    /* Rows of the joints and gears in the last step done, with the multipliers that it started from, and the solution's
     * (six a constraint that these may have, at most) and velocities (bodies x 6): where there are joints, bodies need
     * not end with these. Nothing may be enqueued. */
    sadmm_status (*read_rows)(struct sadmm_context *, struct sadmm_rows *rows, double *solution, double *velocity,
                              struct sadmm_error *);

    /* ---- worlds of many equal ones; nothing may be enqueued ---- */

    /* Memory of the backend, zeroed; NULL may be released. To the backend and from it, once nothing of the program is
     * at work there any more. */
    sadmm_status (*allocate)(struct sadmm_context *, size_t bytes, void **out, struct sadmm_error *);
    void (*release)(struct sadmm_context *, void *memory);
    size_t (*memory)(const struct sadmm_context *); /* bytes of its device for the world, without what is allocated */
    sadmm_status (*to_backend)(struct sadmm_context *, void *to, const void *from, size_t bytes, struct sadmm_error *);
    sadmm_status (*from_backend)(struct sadmm_context *, void *to, const void *from, size_t bytes,
                                 struct sadmm_error *);
    /* Can an array be read (or, `in`, written) there? */
    bool (*has_array)(int32_t array, bool in);
    /* The world's numbers into the array; or, `in`, the array's into the world. `left`: not 0: worlds whose part is
     * left alone. refused (in): 1 where a number is out of range, which is not taken. All in the backend's memory, a
     * byte a world. Before anything on `stream` (the backend's kind of one, NULL: its default) has ended nothing is
     * read. */
    sadmm_status (*exchange)(struct sadmm_context *, const struct sadmm_resident_copies *,
                             const struct sadmm_resident_array *, bool in, const uint8_t *left, uint8_t *refused,
                             void *stream, struct sadmm_error *);
    /* Of each, after a step and before anything else changes the world. */
    sadmm_status (*measure)(struct sadmm_context *, const struct sadmm_resident_copies *, struct sadmm_copy_measures *,
                            struct sadmm_error *);
    /* A state in the backend's memory, to be released. */
    sadmm_status (*keep_state)(struct sadmm_context *, const struct sadmm_resident_copies *,
                               const struct sadmm_resident_state *, void **out, struct sadmm_error *);
    /* `count` worlds, each at most once, begin with states that are kept; what their bodies are given from outside, and
     * their masses, stay. *fits: false: there is no room for so many contacts, and nothing is done. */
    sadmm_status (*put_states)(struct sadmm_context *, const struct sadmm_resident_copies *, int32_t count,
                               const int32_t *which, void *const *states, bool *fits, struct sadmm_error *);
};

#endif
