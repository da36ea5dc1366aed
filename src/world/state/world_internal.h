/* A world's insides, shared by the files of this folder. Each calls those before it alone:
 *
 *   slots, links, pair_table, shape_data, ids, report   lists and names
 *   kinematic                        kinematic bodies in a step
 *   gather                           what a step reads
 *   hits                             hits of bodies in flight, each at its moment
 *   coupling_step                    what couplings keep from step to step
 *   joint_act                        a joint in a step
 *   gear_rows, joint_rows            gears and joints as constraint rows
 *   joint_momentum, joint_move       where joints let bodies go, with what momentum
 *   resident_joints, resident_kinematic, resident   where a backend keeps the world
 *   query_scene                      what queries search
 *   shape_form, shape, mass, joint, coupling, gear, body, contacts,
 *   query_ray, query_shape, explain  what callers see of it, and change
 *   arrays                           the same, of many at once
 *   sensor, events                   what sensors see; what begins and ends
 *   step, world                      steps; settings, the whole
 */
#ifndef SADMM_WORLD_STATE_WORLD_INTERNAL_H
#define SADMM_WORLD_STATE_WORLD_INTERNAL_H

#include "collision/collision.h"
#include "collision/query/query_tree.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/error.h"
#include "core/base/growing.h"
#include "core/base/parallel.h"
#include "core/model/coupling_law.h"
#include "core/model/joint_law.h"
#include "core/model/settings.h"
#include "core/solve/articulation.h"
#include "core/solve/certificate.h"
#include "core/solve/kernels.h"
#include "core/solve/ncp.h"
#include "core/solve/push.h"
#include "core/solve/schedule.h"
#include "links.h"
#include "pair_table.h"
#include "shape_data.h"
#include "slots.h"
#include "subadmm/arrays.h"
#include "subadmm/coupling.h"
#include "subadmm/events.h"
#include "subadmm/gear.h"
#include "subadmm/joint.h"
#include "subadmm/query.h"
#include "subadmm/world.h"

enum { SADMM_NAME_SIZE = 64, SADMM_WHY_SIZE = 256 }; /* a name is cut to what fits, with its final 0 */

/* A body slot. Dynamic bodies are numbered in slot order for the solver at every step. */
struct sadmm_world_body {
    bool alive;
    uint32_t generation; /* of the next id when dead, of the current one when alive */
    sadmm_body_type type;
    int32_t environment;
    int32_t system_body; /* in the last step, -1: static or not there, below: kinematic (core/base/contact_set.h) */
    struct sadmm_rigid rigid;
    uint32_t first_shape, first_joint; /* links: names of a shape are its slot + 1, of a joint below */
    double contact_wrench[6];
    struct sadmm_extrapolation extrapolation;
    struct {
        bool set; /* a kinematic body is to be there after the next step */
        double position[3], orientation[4];
    } target;
    void *user_data;     /* the caller's */
    char *name;          /* a block of its own, so that it stays where it is when slots are added; NULL: none */
    uint32_t dirty;                     /* bit of enum sadmm_update_kind: no step has taken that along yet */
    int64_t set_at[SADMM_BODY_UPDATES]; /* steps enqueued since the world was loaded, when that was set; -1: before */
};

/* What the definition of a hull's shape had, or a mesh's; contact finding has the shape in another frame. */
struct sadmm_world_block_shape {
    const sadmm_hull *hull; /* NULL: of a mesh */
    const sadmm_mesh *mesh;
    double position[3], orientation[4];
};

/* A kinematic body in a step. */
struct sadmm_world_kinematic {
    int32_t slot;
    struct sadmm_rigid rigid, next; /* as the (sub-)step begins and ends */
    double wrench[6];               /* of contacts, of the sub-steps made so far */
};

/* What may be set of a joint without loading the world again: its coordinates, 0 to 5, and (TARGET: of a coupling) */
enum sadmm_joint_update { SADMM_JOINT_ENABLED = JOINT_COORDINATES, SADMM_JOINT_TARGET, SADMM_JOINT_UPDATES };

/* A joint slot. That of a coupling is out of callers' sight: its frame a is the target, whose motion is prescribed, and
 * what acts are position drives of all coordinates. */
struct sadmm_world_joint {
    bool alive;
    uint32_t generation;
    int32_t coupling;       /* number of the coupling that it is of, from 1; 0: of none */
    sadmm_joint_def def;    /* locks: what is locked */
    int32_t body[2];        /* slots of a and b, -1: the static world */
    struct joint_frame frame[2];
    double *table[JOINT_COORDINATES];     /* of a coordinate's spring: positions, then loads; NULL: none */
    int32_t table_count[JOINT_COORDINATES]; /* points */
    struct sadmm_joint_memory last, next; /* of the last step; of the one at hand, or a sub-step of it */
    struct sadmm_link on_body[2]; /* their names: 2 x slot + side + 1 */
    uint32_t first_gear;
    int32_t resident;       /* its number in the backend that keeps the world */
    int32_t resident_constraints; /* that its rows may take there */
    uint32_t dirty;         /* bits of enum sadmm_joint_update, as in a body */
    int64_t set_at[SADMM_JOINT_UPDATES];
};

/* A coupling slot. */
struct sadmm_world_coupling {
    bool alive;
    uint32_t generation;
    sadmm_coupling_def def; /* its target is that in `last` */
    size_t joint;           /* slot */
    struct sadmm_coupling_memory last, next;
};

/* A gear slot. */
struct sadmm_world_gear {
    bool alive;
    uint32_t generation;
    sadmm_gear_def def;
    size_t joint[2]; /* slots */
    struct sadmm_link on_joint[2]; /* their names: 2 x slot + side + 1 */
    bool acts;       /* it has a row in the (sub-)step at hand */
    struct { double force; } last, next; /* along the first coordinate, of the last step and of the one at hand */
    bool dirty;      /* its being enabled was set, and no step has taken that along yet; set_at: as in a body */
    int64_t set_at;
};

struct sadmm_hits;

/* K of a body's joints in its frame (model/stiffening.h); what they add to its inertia, kg m^2, world; its own stiffness. */
struct joint_stiffening {
    mat3 frame;
    double K[6], more[6], own[6];
};

/* What the last step started from, for contacts, freeze and the certificate. Bodies that were hit: from where they would
 * have started with the velocity that they have after it. */
struct sadmm_step_start {
    struct sadmm_world_hit *hits;              /* of the step, in the order of time within each sub-step */
    size_t hit_count, hit_capacity, hit_first; /* hit_first: the first one of the last sub-step */
    struct sadmm_rigid *rigid; /* dynamic bodies */
    double *velocity;          /* dynamic bodies x 6: the warm start */
    double *impulse;           /* points x 3: the warm start */
    struct sadmm_rows rows;    /* of joints; their multipliers are the solution */
    double *multiplier;        /* rows: the warm start */
    double *kinematic;         /* kinematic bodies x 6: velocities, m/s, rad/s */
    int32_t kinematic_count;
    size_t kinematic_capacity, rigid_capacity, velocity_capacity, impulse_capacity, multiplier_capacity;
};

/* Two shapes that touch, or a sensor and what it sees. */
struct sadmm_touch {
    sadmm_shape_id a, b;
    sadmm_body_id body_a, body_b;
    size_t pair; /* one of theirs in the step's contacts */
};

/* By slots of a, then of b. */
struct sadmm_touches {
    struct sadmm_touch *list;
    size_t count, capacity;
};

struct sadmm_world {
    sadmm_world_def def; /* settings inside are the current ones */
    struct sadmm_error error;
    struct sadmm_team team;

    struct sadmm_world_body *bodies;
    size_t body_slots, body_capacity;
    int32_t body_count, dynamic_count, kinematic_count;
    int32_t *kinematic_slots; /* of these, ascending, as of the last step */
    bool kinematic_listed;    /* none has come or gone since */
    struct sadmm_slot_set bodies_taken;
    struct sadmm_shape *shapes;
    uint32_t *shape_generations;
    struct sadmm_geometry *geometries; /* every shape has one of its own, by the number of its slot */
    size_t shape_slots, shape_capacity, shape_generation_capacity, geometry_capacity;
    int32_t shape_count, sensor_count; /* sensors: of these */
    int32_t bouncing_count; /* shapes with restitution */
    struct sadmm_slot_set shapes_taken;
    struct sadmm_link *shape_links;    /* by slot: the shapes of a body */
    size_t shape_link_capacity;
    uint32_t shape_revisions;
    struct sadmm_shape_data shape_data;
    struct sadmm_world_block_shape *block_shapes; /* by slot, as far as there are hulls or meshes */
    size_t block_shape_slots, block_shape_capacity;
    struct sadmm_pair_table disabled_pairs, friction_pairs;

    struct sadmm_world_joint *joints;
    size_t joint_slots, joint_capacity;
    int32_t joint_count;                  /* live slots, those of couplings among them */
    struct sadmm_slot_set joints_taken, own_joints; /* all; those that are of no coupling */
    int32_t table_count;                  /* tables of springs, of all joints */
    struct sadmm_world_gear *gears;
    size_t gear_slots, gear_capacity;
    int32_t gear_count;
    struct sadmm_slot_set gears_taken;
    size_t joint_rows;                    /* of the step's rows: the first ones; those of gears follow */
    struct sadmm_world_coupling *couplings;
    size_t coupling_slots, coupling_capacity;
    int32_t coupling_count;
    struct sadmm_slot_set couplings_taken;
    struct sadmm_pair_table jointed_pairs; /* bodies that do not meet for their joints; values: how many joints */
    uint64_t *filtered_pairs;             /* these and `disabled_pairs`, as of the last step */
    size_t filtered_count, filtered_capacity;
    struct sadmm_joint_source *joint_sources; /* of the step's rows */
    double *joint_load;                       /* dynamic bodies x 3: what joints may stiffen them by, N m; */
    struct joint_stiffening *stiffening;      /* by what they do, those that may be; */
    uint8_t *stiffened;                       /* it is another one than before it was found last */
    struct sadmm_rows closing;                /* locks, where the step has moved bodies to; their places in it; */
    struct sadmm_row_constraint *closing_slots;
    uint8_t *opened;                          /* dynamic bodies: of parts with joints that are to be closed */
    uint8_t *folding;                         /* dynamic bodies: of joints that fold; */
    double *row_left;                         /* rows: what is left of them */
    struct joint_closing_cost *closing_costs; /* dynamic bodies: what that costs (joint_close.c) */
    size_t joint_load_capacity, stiffening_capacity, stiffened_capacity, closing_slot_capacity, opened_capacity,
        closing_cost_capacity, folding_capacity, row_left_capacity;
    struct sadmm_row_constraint *joint_constraints; /* all that joints may have, in order; most have rows in the step */
    size_t joint_constraint_count, joint_constraint_capacity;
    int32_t *joint_labels;                    /* dynamic bodies: islands, at the end of a step with joints */
    uint16_t *joint_touch;                    /* of islands, at their labels (joint_move.c) */
    int32_t *joint_number;                    /* of bodies of islands whose momentum is restored (joint_momentum.c) */
    struct joint_momentum *joint_momentum;    /* at these numbers */
    size_t joint_source_capacity, joint_label_capacity, joint_touch_capacity, joint_number_capacity,
        joint_momentum_capacity;
    int32_t joints_acting, couplings_acting;  /* in the step at hand */

    /* The last step: everything freeze, contacts and the next warm start need. */
    struct sadmm_collision *collision;
    struct sadmm_contact_set contacts;
    bool contacts_readable;
    struct sadmm_collision_body *collision_bodies; /* by slot */
    struct sadmm_step_start start, last_start;     /* of the step at hand; a failing step swaps it back */
    struct sadmm_rigid *next;                      /* dynamic bodies after the step */
    double *velocity, *wrench;                     /* dynamic bodies x 6 */
    struct sadmm_extrapolation *extrapolation;     /* dynamic bodies, after the sub-steps made so far */
    struct sadmm_world_kinematic *kinematic;       /* in slot order */
    double *support_motion;                        /* dynamic bodies x 6: of their support */
    int32_t *supports, *support_labels;            /* islands, and at their labels what supports them */
    double *wrench_sum;                            /* dynamic bodies x 6, of these; both only where there are several */
    int32_t *slot_of;                              /* dynamic body -> slot */
    size_t collision_body_capacity, next_capacity, velocity_capacity, wrench_capacity, slot_of_capacity,
        extrapolation_capacity, wrench_sum_capacity, kinematic_capacity, kinematic_slot_capacity,
        support_motion_capacity, support_capacity, support_label_capacity;
    struct sadmm_plan plan;
    sadmm_settings step_settings;                  /* of the whole step */
    bool stepped;

    /* Where a backend keeps the world (resident.c). */
    struct {
        bool loaded;         /* the backend has the world; nothing but states and wrenches has changed since */
        bool running;        /* steps were enqueued and not waited for */
        struct sadmm_error failed; /* of a step that a call without a status waited for; SADMM_OK: none */
        bool bodies_behind;  /* the bodies above are older than the backend's */
        bool contacts_behind;
        bool joints_behind;
        int64_t enqueued, done, repeats; /* steps since it was loaded: begun, done as far as known, repeated */
        int64_t kept_step;   /* steps and time of the bodies above */
        double kept_time;
        struct sadmm_extrapolation *extrapolation; /* dynamic bodies */
        struct sadmm_kinematic_body *kinematic; /* kinematic bodies, as they are loaded, and as they are read; */
        double *kinematic_wrench;    /* (x 6) likewise */
        uint32_t *dirty;     /* slots of bodies with `dirty`; capacity: all that move */
        struct sadmm_resident_update *updates; /* for the backend, when a step is enqueued */
        unsigned char *held; /* by body slot: joints hold it (hits.c) */
        bool hits_behind;    /* those of the last step are not here yet */
        size_t held_capacity, extrapolation_capacity, kinematic_capacity, kinematic_wrench_capacity, dirty_count,
            dirty_capacity, update_capacity;
        struct sadmm_resident_joint *joints; /* as they were loaded; */
        struct sadmm_joint_memory *memory;   /* likewise, and as they are read; */
        int32_t *joint_slots;                /* their slots */
        struct sadmm_coupling_memory *coupling_memory; /* of those that are of couplings, in their order */
        double *solution;                    /* of their rows */
        uint32_t *dirty_joints;              /* slots of joints with `dirty`; capacity: all */
        double *tables;                      /* of springs, joint by joint */
        size_t table_numbers, table_capacity;
        struct sadmm_resident_gear *gears;   /* in slot order */
        double *gear_force;                  /* likewise */
        bool gears_dirty;                    /* some of them */
        size_t gear_capacity, gear_force_capacity;
        int32_t joint_count, joint_constraints, coupling_count, gear_count;
        size_t joint_capacity, memory_capacity, coupling_memory_capacity, joint_slot_capacity, solution_capacity,
            dirty_joint_count,
            dirty_joint_capacity;
    } resident;

    /* What queries search (query_scene.c). */
    struct {
        bool listed;  /* the tree has the world's shapes, and */
        bool current; /* has them where they are */
        struct sadmm_query_tree tree;
        double *prelude; /* what boxes and the like are to a hull (hull_data.h) */
        struct sadmm_query_hit *hits; /* of a ray */
        uint64_t *slots, *spare;      /* of an overlap */
        size_t hit_capacity, slot_capacity, spare_capacity;
    } query;

    /* What has begun and ended (events.c). */
    struct {
        sadmm_event *waiting; /* (capacity) a ring, `count` from `first` on */
        int32_t capacity;     /* 0: nothing is recorded */
        int32_t first, count;
        int64_t dropped;
        struct sadmm_touches touching, inside;         /* contacts, sensors, of the last step recorded */
        struct sadmm_touches touching_now, inside_now; /* of the step at hand */
        struct sadmm_touching_shapes *pairs;           /* of its contacts, which of them touch */
        size_t pair_capacity;
    } events;

    struct sadmm_hits *hits; /* made with the first pair that is fast */
    const double *hit_since; /* by body slot: when it was hit last in the (sub-)step at hand, s; NULL: none was */

    const struct sadmm_kernels *kernels; /* chosen at the first step */
    struct sadmm_context *context;
    char why[SADMM_WHY_SIZE];
    struct sadmm_certificate_workspace certificate_workspace;
    int64_t certified_step; /* the step that the workspace's contacts are of, as report.step counts; -1: of none */
    struct sadmm_articulations *articulations; /* made with the first joint */
    struct sadmm_ncp *ncp;       /* made with the first dense contact solve */
    struct sadmm_push *push;     /* made with the first overlap */
    sadmm_step_report report;
};

/* ---- kinematic.c ---- */

/* Kinematic bodies in slot order into `kinematic` and `start`, and numbers of theirs for collision, which has their
 * poses. */
sadmm_status sadmm_world_gather_kinematic(sadmm_world *world);
/* A kinematic body has come (change 1) or gone (-1). */
static inline void sadmm_world_count_kinematic(sadmm_world *world, int32_t change)
{
    world->kinematic_count += change;
    world->kinematic_listed = false;
}
/* Islands that a kinematic body supports are solved relative to its motion: system->support_motion, and
 * system->velocity less that; and back. */
sadmm_status sadmm_world_enter_support_frame(sadmm_world *world, struct sadmm_system *system);
void sadmm_world_leave_support_frame(sadmm_world *world, const struct sadmm_system *system);
/* Where they are after the (sub-)step. NON_FINITE. */
sadmm_status sadmm_world_move_kinematic(sadmm_world *world, const sadmm_settings *settings);
/* The next sub-step begins there. */
void sadmm_world_turn_kinematic(sadmm_world *world);
/* What the (sub-)step's contacts give them. */
/* Contact wrenches of dynamic bodies, eq. (12), by the points' impulses as they are. */
void sadmm_world_find_wrenches(sadmm_world *world, const sadmm_settings *settings);
void sadmm_world_add_kinematic_wrenches(sadmm_world *world, const sadmm_settings *settings);
/* The step is done. */
void sadmm_world_commit_kinematic(sadmm_world *world);
/* SADMM_ERROR_NON_FINITE that names the body of a slot. */
sadmm_status sadmm_world_slot_not_finite(sadmm_world *world, int32_t slot);

/* ---- gather.c ---- */

/* Dynamic bodies in slot order into `start` and what else a step works on, and all bodies as collision sees them. */
sadmm_status sadmm_world_gather(sadmm_world *world);
/* The same from one sub-step to the next: from `next`, and without the bodies' slots. substep: the one that
 * has ended. */
void sadmm_world_turn(sadmm_world *world, int substep);
/* Exchange `start` and `last_start`. */
void sadmm_world_swap_starts(sadmm_world *world);
/* substep: the one that contacts are to be found for. */
struct sadmm_collision_input sadmm_world_collision_input(const sadmm_world *world, int substep);
struct sadmm_system sadmm_world_system(sadmm_world *world);
/* SADMM_ERROR_NON_FINITE that names a dynamic body. */
sadmm_status sadmm_world_not_finite(sadmm_world *world, int32_t body);

/* ---- hits.c ---- */

/* Hits of bodies in flight in the sub-step at hand, each at its moment: `start` and the bodies as collision sees them
 * become what they are after them. */
sadmm_status sadmm_world_take_hits(sadmm_world *world, int substep);
/* Dynamic bodies, by slot, that joints hold. */
void sadmm_world_mark_held(const sadmm_world *world, unsigned char *bodies, unsigned char mark);
/* Pairs that were followed to the end of the sub-step touch no more in it: planes laid through their contacts may say
 * that they do, where surfaces are round or turn. Their separations are what the bodies close by themselves, at least,
 * so that such contacts act only on what others push together. After contacts are found. */
void sadmm_world_open_separations(sadmm_world *world);
/* What the (sub-)step's hits give bodies, beside its contacts. */
void sadmm_world_add_hit_wrenches(sadmm_world *world, const sadmm_settings *settings);

/* What contacts that roll leave their bodies for the next (sub-)step (rolling.c). */
void sadmm_world_keep_rolling(sadmm_world *world, double dt);
void sadmm_world_free_hits(sadmm_world *world);

/* ---- coupling_step.c ---- */

/* What couplings kept of the last step into what they keep of this one. */
void sadmm_world_begin_couplings(sadmm_world *world);
/* A (sub-)step of dt is over: targets move on. */
void sadmm_world_move_targets(sadmm_world *world, double dt);
/* The step of so many sub-steps is done. */
void sadmm_world_commit_couplings(sadmm_world *world, int substeps);

/* ---- gear_rows.c ---- */

void sadmm_world_begin_gears(sadmm_world *world);
/* Can it turn its wheels where they are? Asked of one whose joints are among up to three dynamic bodies. */
bool sadmm_world_gear_reaches(const sadmm_world *world, const struct sadmm_world_gear *gear);
/* After those of joints. */
sadmm_status sadmm_world_make_gear_rows(sadmm_world *world, const sadmm_settings *settings);
void sadmm_world_keep_gear_rows(sadmm_world *world, double dt);
void sadmm_world_commit_gears(sadmm_world *world);

/* ---- joint_act.c ---- */

/* The body of a slot, or (-1) the static world, as a joint has it in the (sub-)step at hand. */
struct joint_body sadmm_world_joint_body(const sadmm_world *world, int32_t slot);
/* A joint in it. */
struct acting_joint sadmm_world_act_joint(const sadmm_world *world, const struct sadmm_world_joint *joint,
                                          const sadmm_settings *settings);

/* ---- joint_rows.c ---- */

/* Pairs of bodies that are not to meet, into `filtered_pairs`, and frictions of pairs as lists; and what joints kept of the last step into what they
 * keep of this one. */
sadmm_status sadmm_world_begin_joints(sadmm_world *world);
/* The most constraints that a joint's rows may take; those of couplings have room for all of their drives. */
int32_t sadmm_joint_constraints(const struct sadmm_world_joint *joint);
/* Rows of the (sub-)step's joints into `start`, from the bodies there. */
sadmm_status sadmm_world_make_rows(sadmm_world *world, const sadmm_settings *settings);
/* The solution's multipliers into what joints keep. */
void sadmm_world_keep_rows(sadmm_world *world, const sadmm_settings *settings);
/* The step is done. */
void sadmm_world_commit_joints(sadmm_world *world);

/* ---- joint_move.c ---- */

/* Bodies of islands with joints as they are after the step, in the place of what the backend made of them, once the
 * others have moved. off: the largest error of a locked translation that is left, m. */
sadmm_status sadmm_world_move_articulated(sadmm_world *world, const sadmm_settings *settings, double *off);

/* ---- joint_stiffen.c ---- */

/* Stiffness of joints into the bodies of `start`, by the multipliers that rows have. any: bodies whose inertia this
 * changes, by body world->stiffened. */
sadmm_status sadmm_world_stiffen(sadmm_world *world, const sadmm_settings *settings, bool *any);

/* ---- joint_close.c ---- */

/* Closes what is locked in world->next, where it is off by much; off: the largest error that is left, m. */
sadmm_status sadmm_world_close_joints(sadmm_world *world, const sadmm_settings *settings, double *off);

/* ---- joint_momentum.c ---- */

/* In `next`: islands with joints that contacts touch, once they have been moved. */
sadmm_status sadmm_world_restore_articulated(sadmm_world *world, const sadmm_settings *settings);

/* ---- report.c ---- */

/* `steps` more steps have been done; `done` is what the last of them was like. */
void sadmm_world_report_steps(sadmm_world *world, int64_t steps, const struct sadmm_resident_report *done);

/* ---- step.c ---- */

/* The choice of the kernels, at the first step. */
sadmm_status sadmm_world_choose_backend(sadmm_world *world);

/* ---- resident_kinematic.c ---- */

/* Kinematic bodies of a world that is about to be loaded, into resident.kinematic. */
sadmm_status sadmm_world_list_kinematic(sadmm_world *world);
/* After the last step done; the velocities that they had in it, into `start`. Nothing is enqueued. */
sadmm_status sadmm_world_read_kinematic(sadmm_world *world);
sadmm_status sadmm_world_read_kinematic_start(sadmm_world *world);

/* ---- resident.c ---- */

/* Can this step be made by a backend that keeps the world? */
bool sadmm_world_may_reside(const sadmm_world *world);
/* Enqueue a step; `wait`: until it is done, with its report. */
sadmm_status sadmm_world_resident_step(sadmm_world *world, bool wait);
/* Until every enqueued step is done. The error of a step that failed is returned once. */
sadmm_status sadmm_world_synchronise(sadmm_world *world);
/* The same for calls that return no status: the error stays for the next one that does. */
void sadmm_world_synchronise_quietly(sadmm_world *world);
/* Download the bodies (or contacts and everything else) of the last step, where the backend is ahead. */
sadmm_status sadmm_world_download_bodies(sadmm_world *world);
sadmm_status sadmm_world_download_contacts(sadmm_world *world);
/* Which pairs of the last step touch, where the contacts are behind and no step is running: of every one of the report's
 * pairs. */
sadmm_status sadmm_world_read_touching(sadmm_world *world, struct sadmm_touching_shapes *touching);
sadmm_status sadmm_world_download_joints(sadmm_world *world);
/* All of it, and from here on the host's world is the one that counts: before anything but a state or a wrench is
 * changed. */
sadmm_status sadmm_world_detach(sadmm_world *world);
/* A dynamic body's state or wrench has been set, or a kinematic one's state or target: the next step takes it along. */
void sadmm_world_update(sadmm_world *world, struct sadmm_world_body *body, enum sadmm_update_kind kind);
/* Passes `status` on. After SADMM_ERROR_DEVICE the backend's context is given up, the host's world counts again, and
 * the next step begins with a new context. */
sadmm_status sadmm_world_contain(sadmm_world *world, sadmm_status status);

/* ---- resident_joints.c ---- */

/* Joints of a world that is about to be loaded, into resident.joints and what is beside it. */
sadmm_status sadmm_world_list_joints(sadmm_world *world);
/* A joint's coordinate, whether it is enabled, or its target has been set: the next step takes it along. False: the
 * backend has no room for its rows, the world is to be detached. */
bool sadmm_world_update_joint(sadmm_world *world, struct sadmm_world_joint *joint, enum sadmm_joint_update update);
/* Gears, once joints are listed. */
sadmm_status sadmm_world_list_gears(sadmm_world *world);
void sadmm_world_update_gear(sadmm_world *world, struct sadmm_world_gear *gear);
/* Updates into resident.updates, from *count on. */
sadmm_status sadmm_world_list_joint_updates(sadmm_world *world, size_t *count);
void sadmm_world_forget_joint_updates(sadmm_world *world);
/* As of bodies: what was set for steps that have not been done. */
void sadmm_world_update_joints_again(sadmm_world *world);
/* What joints keep; the last step's rows. Nothing is enqueued. */
sadmm_status sadmm_world_read_joints(sadmm_world *world);
sadmm_status sadmm_world_read_rows(sadmm_world *world);

/* ---- query_scene.c ---- */

/* Bodies have moved; shapes have come or gone. */
static inline void sadmm_world_moved(sadmm_world *world) { world->query.current = false; }
static inline void sadmm_world_reshaped(sadmm_world *world) { world->query.listed = world->query.current = false; }
enum { SADMM_ALL_BODY_TYPES = 1 << SADMM_BODY_DYNAMIC | 1 << SADMM_BODY_STATIC | 1 << SADMM_BODY_KINEMATIC };
/* The bodies of the last step, and what queries need besides: before shapes are placed. */
sadmm_status sadmm_world_begin_query(sadmm_world *world);
/* A shape where it is. */
void sadmm_world_place_shape(const sadmm_world *world, uint32_t slot, struct sadmm_placed *placed);
/* All of it, and the tree up to date. */
sadmm_status sadmm_world_place_shapes(sadmm_world *world);
/* `filter`: the caller's, NULL: the defaults. */
sadmm_status sadmm_world_take_filter(sadmm_world *world, const sadmm_query_filter *filter,
                                     struct sadmm_shape_filter *taken, sadmm_query_filter *given);

/* ---- query_shape.c ---- */

/* What meets a box (shape: NULL), or overlaps a shape in that box: its slots into query.slots, ascending. The tree is
 * brought up to date. */
sadmm_status sadmm_world_list_overlaps(sadmm_world *world, const struct sadmm_box3 *box,
                                       const struct sadmm_placed *shape, const struct sadmm_shape_filter *filter,
                                       size_t *count);
/* To the caller, who has room for `capacity` of them. */
sadmm_status sadmm_world_check_overlap_room(int32_t capacity, const sadmm_shape_id *shapes, const int32_t *count,
                                            struct sadmm_error *error);
void sadmm_world_give_overlaps(const sadmm_world *world, size_t found, int32_t capacity, sadmm_shape_id *shapes,
                               int32_t *count);

/* ---- contacts.c ---- */

/* A point of the last step: where sadmm_contact says it is. */
void sadmm_world_contact_position(const sadmm_world *world, const struct sadmm_contact_pair *pair,
                                  const struct sadmm_contact_point *point, double position[3]);

/* How fast the surfaces come closer there before the step, m/s. */
double sadmm_world_contact_speed(const sadmm_world *world, const struct sadmm_contact_pair *pair,
                                 const struct sadmm_contact_point *point);

/* ---- sensor.c ---- */

/* What the sensor in a slot sees: its slots into query.slots, ascending. */
sadmm_status sadmm_world_list_seen(sadmm_world *world, size_t slot, size_t *count);

/* ---- events.c ---- */

/* A step has been made: what has begun and ended in it. */
sadmm_status sadmm_world_note_events(sadmm_world *world);
/* Recording goes on in a world that has been restored, which has none of its own. */
void sadmm_world_hand_events_on(sadmm_world *from, sadmm_world *to);
void sadmm_world_free_events(sadmm_world *world);

/* ---- ids.c ---- */

sadmm_shape_id sadmm_world_shape_id(const sadmm_world *world, int32_t slot);
sadmm_body_id sadmm_world_body_id(const sadmm_world *world, int32_t slot);

/* "" where it has none. */
const char *sadmm_world_body_name(const struct sadmm_world_body *body);
/* The slot of a live object, or NULL with SADMM_ERROR_STALE_ID set on `error`. */
struct sadmm_world_body *sadmm_world_find_body(const sadmm_world *world, sadmm_body_id id, const char *argument,
                                               struct sadmm_error *error);
struct sadmm_shape *sadmm_world_find_shape(const sadmm_world *world, sadmm_shape_id id, const char *argument,
                                           struct sadmm_error *error);
struct sadmm_world_joint *sadmm_world_find_joint(const sadmm_world *world, sadmm_joint_id id, const char *argument,
                                                 struct sadmm_error *error);
struct sadmm_world_gear *sadmm_world_find_gear(const sadmm_world *world, sadmm_gear_id id, const char *argument,
                                               struct sadmm_error *error);
struct sadmm_world_coupling *sadmm_world_find_coupling(const sadmm_world *world, sadmm_coupling_id id,
                                                       const char *argument, struct sadmm_error *error);

/* ---- body.c ---- */

/* May that be set? Else INVALID_ARGUMENT. `orientation`: the state's, normalised where it is off by more than rounding.
 * Of a wrench and a mass: of a dynamic body. */
sadmm_status sadmm_world_check_body_state(const struct sadmm_world_body *body, const sadmm_body_state *state,
                                          double orientation[4], struct sadmm_error *error);
sadmm_status sadmm_world_check_wrench(const double force[3], const double torque[3], struct sadmm_error *error);
sadmm_status sadmm_world_check_mass(const sadmm_world *world, double mass, const double inertia[3],
                                    struct sadmm_error *error);
/* INVALID_ARGUMENT where a body's moments of inertia lie further apart than the precision can resolve. */
sadmm_status sadmm_world_check_inertias(sadmm_world *world, sadmm_precision precision);

/* ---- gear.c ---- */

/* May there be such a gear? Else INVALID_ARGUMENT, STALE_ID. */
sadmm_status sadmm_world_check_gear(const sadmm_world *world, const sadmm_gear_def *def, struct sadmm_error *error);

/* ---- coupling.c ---- */

/* The numbers of a definition; not its body. */
sadmm_status sadmm_world_check_coupling(const sadmm_coupling_def *def, struct sadmm_error *error);
/* A target that may be set, else INVALID_ARGUMENT, into the pose and velocity of `target`. velocity: NULL is 0. */
sadmm_status sadmm_world_check_target(const double position[3], const double orientation[4], const double velocity[6],
                                      struct sadmm_rigid *target, struct sadmm_error *error);

/* ---- shape.c ---- */

/* Room for so many slots of shapes; false when memory runs out. */
bool sadmm_world_reserve_shapes(sadmm_world *world, size_t slots);
/* A shape into a slot that there is room for and that has a generation. body: the slot of a live one. Errors as of
 * sadmm_world_add_shape, with nothing changed. */
sadmm_status sadmm_world_put_shape(sadmm_world *world, size_t slot, int32_t body, const sadmm_shape_def *def,
                                   struct sadmm_error *error);
void sadmm_world_kill_shape(sadmm_world *world, size_t slot);

/* ---- joint.c ---- */

/* Definitions as they are kept: may they be? Else INVALID_ARGUMENT. */
sadmm_status sadmm_world_check_joint_def(const sadmm_joint_def *def, struct sadmm_error *error);
sadmm_status sadmm_world_check_table(const double *positions, const double *forces, int32_t count,
                                     struct sadmm_error *error);
/* May that be set of a joint's coordinate? Else INVALID_ARGUMENT. */
sadmm_status sadmm_world_check_coordinate(const struct sadmm_world_joint *joint, int32_t index,
                                          const sadmm_joint_coordinate *coordinate, struct sadmm_error *error);
/* What joints have beside their slots. */
void sadmm_world_free_tables(sadmm_world *world);
/* Something of a joint has been set: the next step of the backend that keeps the world takes it along. */
sadmm_status sadmm_world_take_update(sadmm_world *world, struct sadmm_world_joint *joint,
                                     enum sadmm_joint_update update);
/* Room for so many slots of joints; false when memory runs out. */
bool sadmm_world_reserve_joints(sadmm_world *world, size_t slots);
/* A joint in a slot is on its bodies' lists, a gear on its joints', from here on. */
void sadmm_world_link_joint(sadmm_world *world, size_t slot);
void sadmm_world_link_gear(sadmm_world *world, size_t slot);
/* Put a joint that has been checked into a slot. */
sadmm_status sadmm_world_insert_joint(sadmm_world *world, const struct sadmm_world_joint *joint, size_t *slot);
/* With its coupling, if it is of one, and the gears on it. */
void sadmm_world_kill_joint(sadmm_world *world, size_t slot);
void sadmm_world_kill_gear(sadmm_world *world, size_t slot);
/* The joints and couplings of a body that is removed. */
void sadmm_world_kill_joints_of(sadmm_world *world, int32_t body);

#endif
