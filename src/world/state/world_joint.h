/* Joints of a world, in slots. */
#ifndef SADMM_WORLD_STATE_WORLD_JOINT_H
#define SADMM_WORLD_STATE_WORLD_JOINT_H

#include "core/model/joint_law.h"
#include "core/solve/resident.h"
#include "links.h"
#include "subadmm/joint.h"

/* What may be set of a joint without loading the world again: its coordinates, 0 to 5, and (TARGET: of a coupling) */
enum sadmm_joint_update { SADMM_JOINT_ENABLED = JOINT_COORDINATES, SADMM_JOINT_TARGET, SADMM_JOINT_UPDATES };

/* A joint slot; or what a coupling has of a joint, for a step (world_coupling.h). */
struct sadmm_world_joint {
    int32_t coupling;    /* the slot of its coupling + 1; 0: it is a joint */
    sadmm_joint_def def; /* locks: what is locked */
    int32_t body[2];     /* slots of a and b, -1: the static world */
    struct joint_frame frame[2];
    double *table[JOINT_COORDINATES];     /* of a coordinate's spring: positions, then loads; NULL: none */
    int32_t table_count[JOINT_COORDINATES]; /* points */
    struct sadmm_joint_memory last, next; /* of the last step; of the one at hand, or a sub-step of it */
    struct sadmm_link on_body[2];         /* their names: 2 x slot + side + 1; of a coupling, on b: slot + 1 */
    uint32_t first_gear;
    int32_t number;               /* in world->step_joints */
    int32_t first_row, end_row;   /* in the (sub-)step at hand, if a host makes it */
    int32_t resident_constraints; /* that its rows may take in the backend that keeps the world */
    uint32_t dirty;               /* bits of enum sadmm_joint_update, as in a body */
    int64_t set_at[SADMM_JOINT_UPDATES];
};

/* A dynamic body as joints have it in a (sub-)step, and in which one. */
struct sadmm_world_joint_side {
    struct joint_side side;
    int64_t of;
};

/* K of a body's joints in its frame (model/stiffening.h); what they add to its inertia, kg m^2, world; its own
 * stiffness. */
struct joint_stiffening {
    mat3 frame;
    double K[6], more[6], own[6];
};

#endif
