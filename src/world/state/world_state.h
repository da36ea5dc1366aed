/* All that a world is. What is done with it is declared beside each file that does it. */
#ifndef SADMM_WORLD_STATE_WORLD_STATE_H
#define SADMM_WORLD_STATE_WORLD_STATE_H

#include "collision/collision.h"
#include "collision/query/query_tree.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/model/settings.h"
#include "core/solve/articulation.h"
#include "core/solve/certificate.h"
#include "core/solve/kernels.h"
#include "core/solve/ncp.h"
#include "core/solve/push.h"
#include "core/solve/schedule.h"
#include "id_pool.h"
#include "decider.h"
#include "pair_table.h"
#include "shape_data.h"
#include "step_start.h"
#include "subadmm/events.h"
#include "subadmm/world.h"
#include "touches.h"
#include "world_body.h"
#include "world_coupling.h"
#include "world_gear.h"
#include "world_joint.h"

enum { SADMM_WHY_SIZE = 256 };

struct sadmm_hits;

struct sadmm_world {
    sadmm_world_def def; /* settings inside are the current ones */
    struct sadmm_error error;
    int32_t not_finite; /* the slot of the body that the last NON_FINITE was about */
    struct sadmm_team team;

    /* Objects, by the slots of their ids. */
    struct sadmm_id_pool body_ids, shape_ids, joint_ids, gear_ids, coupling_ids;
    struct sadmm_world_body *bodies;
    struct sadmm_shape *shapes;
    struct sadmm_world_joint *joints;
    struct sadmm_world_gear *gears;
    struct sadmm_world_coupling *couplings;

    int32_t dynamic_count, kinematic_count;
    bool uneven_masses; /* of dynamic bodies (math/weight.h), as of the step */
    int32_t *kinematic_slots; /* of these, ascending, as of the last step */
    bool kinematic_listed;    /* none has come or gone since */
    struct sadmm_geometry *geometries; /* every shape has one of its own, by the number of its slot */
    int32_t sensor_count;              /* shapes that are sensors */
    int32_t bouncing_count;            /* shapes with restitution */
    double *surfaces;                  /* (x 3) by slot: how a shape's surface moves, in its frame, m/s; */
    int32_t moving_surfaces;           /* shapes where that is not 0 */
    struct sadmm_decider decider;      /* what the caller decides of contacts */
    struct sadmm_link *shape_links; /* by slot: the shapes of a body */
    uint32_t shape_revisions, shape_changes; /* counts: new shapes; these, and new sizes, places and materials */
    struct sadmm_shape_data shape_data;
    struct sadmm_world_block_shape *block_shapes; /* by slot, as far as there are hulls or meshes */
    size_t block_shape_slots;
    struct sadmm_pair_table disabled_pairs, friction_pairs;

    int32_t table_count;                   /* tables of springs, of all joints */
    size_t joint_rows;                     /* of the step's rows: the first ones; those of gears follow */
    struct sadmm_pair_table jointed_pairs; /* bodies that do not meet for their joints; values: how many joints */
    uint64_t *filtered_pairs;             /* these and `disabled_pairs`, as of the last step */
    size_t filtered_count;
    struct sadmm_joint_source *joint_sources; /* of the step's rows */
    double *joint_load;                       /* dynamic bodies x 3: what joints may stiffen them by, N m; */
    struct joint_stiffening *stiffening;      /* by what they do, those that may be; */
    uint8_t *stiffened;                       /* it is another one than before it was found last */
    struct sadmm_rows closing;                /* locks, where the step has moved bodies to; their places in it; */
    struct sadmm_row_constraint *closing_slots;
    struct joint_opened *openings;            /* joints that are to stay closed, as the step ends; */
    size_t opening_count;
    uint8_t *opened;                          /* dynamic bodies: of parts with joints that are to be closed */
    uint8_t *folding;                         /* dynamic bodies: of joints that fold; */
    double *row_left;                         /* rows: what is left of them */
    struct joint_closing_cost *closing_costs; /* dynamic bodies: what that costs (joint_close.c) */
    struct sadmm_row_constraint *joint_constraints; /* all that joints may have, in order; most have rows in the step */
    size_t joint_constraint_count;
    struct sadmm_world_joint **step_joints; /* of a step: joints, then those of couplings, in slot order */
    size_t step_joint_count;
    struct acting_joint *acting_joints;         /* these, in the (sub-)step at hand; */
    struct sadmm_world_joint_side *joint_sides; /* dynamic bodies: theirs, if it is of this number */
    int64_t joint_sides_made;
    struct spin_system *spins;                /* dynamic bodies: spin_of_system, in a (sub-)step where spins_known */
    bool spins_known;
    struct joint_trapezoid *joint_trapezoids; /* dynamic bodies, as the step ends; rigid NULL: not found yet */
    struct sadmm_trapezoid *trapezoids;       /* dynamic bodies, in steps without a solve, and one more; */
    int32_t *touch;                           /* what their contacts say of them */
    int32_t *joint_labels;                    /* dynamic bodies: islands, at the end of a step with joints */
    uint16_t *joint_touch;                    /* of islands, at their labels (joint_move.c) */
    int32_t *joint_number;                    /* of bodies of islands whose momentum is restored (joint_momentum.c) */
    struct joint_momentum *joint_momentum;    /* at these numbers */
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
    struct sadmm_world_kinematic *kinematic;       /* in slot order; then surfaces that move (step/decide.c) */
    double *support_motion;                        /* dynamic bodies x 6: of their support */
    int32_t *supports, *support_labels;            /* islands, and at their labels what supports them */
    double *wrench_sum;                            /* dynamic bodies x 6, of these; both only where there are several */
    int32_t *slot_of;                              /* dynamic body -> slot */
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
        size_t dirty_count;
        struct sadmm_resident_joint *joints; /* as they were loaded; */
        struct sadmm_joint_memory *memory;   /* likewise, and as they are read; */
        struct sadmm_coupling_memory *coupling_memory; /* of those that are of couplings, in their order */
        double *solution;                    /* of their rows */
        int32_t *dirty_joints;               /* step_joints with `dirty`; capacity: all */
        double *tables;                      /* of springs, joint by joint */
        size_t table_numbers;
        struct sadmm_resident_gear *gears;   /* in slot order */
        double *gear_force;                  /* likewise */
        bool gears_dirty;                    /* some of them */
        const struct sadmm_resident_copies *copies; /* not NULL: it is many equal worlds (environments), each solved
                                                       as if alone */
        const double *gravities;                    /* (copies->count x 3) of each; NULL: that of the settings */
        int32_t joint_count, joint_constraints, coupling_count, gear_count;
        size_t dirty_joint_count;
    } resident;

    /* Bodies on one side of a joint (joint_place.c). */
    struct {
        uint32_t *seen; /* by body slot, `marks` of them: the call that reached it last */
        size_t marks;
        uint32_t call;
        int32_t *bodies; /* slots, `count` of them */
        size_t count;
        bool *changes; /* by joint slot: as it was checked last, its row was to be set */
    } placing;

    /* What queries search (query_scene.c). */
    struct {
        bool listed;  /* the tree has the world's shapes, and */
        bool current; /* has them where they are */
        struct sadmm_query_tree tree;
        double *prelude; /* what boxes and the like are to a hull (hull_data.h) */
        struct sadmm_query_hit *hits; /* of a ray */
        uint64_t *slots, *spare;      /* of an overlap */
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
    struct sadmm_solve_errors errors; /* of islands, of the step at hand */
    struct sadmm_push *push;     /* made with the first overlap */
    sadmm_step_report report;
};

/* Bodies have moved; shapes have come or gone: what queries search is no longer up to date. */
static inline void sadmm_world_moved(sadmm_world *world) { world->query.current = false; }
static inline void sadmm_world_reshaped(sadmm_world *world) { world->query.listed = world->query.current = false; }

#endif
