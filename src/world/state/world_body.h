/* Bodies of a world, in slots. */
#ifndef SADMM_WORLD_STATE_WORLD_BODY_H
#define SADMM_WORLD_STATE_WORLD_BODY_H

#include "core/model/system.h"
#include "core/solve/resident.h"
#include "subadmm/hull.h"
#include "subadmm/mesh.h"
#include "subadmm/types.h"

/* A body slot. Dynamic bodies are numbered in slot order for the solver at every step. */
struct sadmm_world_body {
    sadmm_body_type type;
    int32_t environment;
    int32_t system_body; /* in the last step, -1: static or not there, below: kinematic (core/base/contact_set.h) */
    struct sadmm_rigid rigid;
    uint32_t first_shape, first_coupling; /* links: their names are slot + 1; */
    uint32_t first_joint;                 /* of a joint (world_joint.h) */
    double contact_wrench[6];
    struct sadmm_extrapolation extrapolation;
    struct {
        bool set; /* a kinematic body is to be there after the next step */
        double position[3], orientation[4];
    } target;
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
    int32_t bearer;                 /* whose wrench has what it feels: its own number, or -1: that of no one */
    struct sadmm_rigid rigid, next; /* as the (sub-)step begins and ends */
    double wrench[6];               /* of contacts, of the sub-steps made so far */
};

#endif
