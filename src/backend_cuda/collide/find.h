/* What a find on the device takes and gives (pipeline.h). */
#ifndef SADMM_CUDA_COLLIDE_FIND_H
#define SADMM_CUDA_COLLIDE_FIND_H

#include "backend_cuda/device/found.h"
#include "backend_cuda/device/kept_state.h"
#include "collision/collision.h"

struct sadmm_cuda_collision;

/* The current set. Device memory, valid until the second find from now on, an upload or destroy. */
struct sadmm_cuda_contacts {
    struct sadmm_contact_pair *pairs;
    struct sadmm_contact_point *points;
    const struct sadmm_contact_migration *migrations;
    const struct sadmm_cuda_contact_counts *device_counts; /* the same numbers, on the device */
    struct sadmm_cuda_contact_counts counts;
};

struct sadmm_cuda_collision_stats {
    int64_t finds;       /* that succeeded */
    int64_t repeats;     /* stages repeated because something did not fit */
    int64_t allocations; /* of device and pinned memory, since creation */
    int64_t candidate_capacity, point_capacity;
    int64_t visits;      /* of nodes of the tree; counted on the emulated device only */
};

/* A find that is enqueued: from one set into another. In a step of several sub-steps the first one searches for the
 * pairs that may touch in any of them, and the others take these (view.h). */
struct sadmm_cuda_find {
    int from, into;
    int substep, substeps; /* substeps 1: nothing is taken from, or left for, another find */
    bool pdl;              /* kernels are launched with PDL (device/pdl.h) */
    const struct sadmm_cuda_hits *hits; /* NULL: there are none to be taken */
    const double *threshold; /* of restitution, on the device; not NULL: is any pair faster (contact_counts.fast)? */
};
enum { SADMM_CUDA_SETS = 3 }; /* the third for what lies between two sub-steps */

/* What hits of bodies in flight change of a step (hits_view.h). Device memory. */
struct sadmm_cuda_hits {
    const struct sadmm_rigid *before;     /* dynamic bodies, as the (sub-)step begins */
    struct sadmm_rigid *start;            /* out: the same, as it begins after its hits */
    struct sadmm_collision_body *bodies;  /* by body slot */
    double *velocity;                     /* dynamic bodies x 6: the warm start */
    const struct sadmm_settings *settings; /* numbers alone count */
    int32_t body_count;                   /* dynamic */
    int32_t most;                         /* a body may have (settings.hits) */
    int32_t into;                         /* step that ends there, 0 or 1: whose hits are kept */
    int32_t substep, substeps;
    double *wrench, *kinematic_wrench;    /* bodies x 6, kinematic bodies x 6: contacts' */
};

/* For tests and measurements; 0: the default. */
struct sadmm_cuda_collision_tuning {
    int32_t tree_from;  /* shapes; below, all pairs are tested */
    int32_t group_leaves; /* up to so many shapes an environment, its own pairs are tested, no tree; < 0: never */
    int32_t by_warp_from; /* shapes; from so many on what is made of them is stored by the warp */
    int64_t radix_from; /* capacity for candidates; below, they are ranked by counting */
    int64_t
        first_capacity; /* the next find starts with this capacity for candidates and points, whatever is allocated */
};

#endif
