/* All that contacts are found from. */
#ifndef SADMM_COLLISION_SHAPES_INPUT_H
#define SADMM_COLLISION_SHAPES_INPUT_H

#include "shape.h"

struct sadmm_collision_input {
    const struct sadmm_shape *shapes;
    size_t shape_count;               /* slots, dead ones included */
    const struct sadmm_geometry *geometries; /* by handle */
    size_t geometry_count;
    const double *hulls;              /* shape data (hull_data.h); NULL: none is a HULL, a MESH, or smooth
                                         (geometry.h) */
    size_t hull_doubles;
    uint32_t hull_revision;           /* changes whenever the shape data does, or anything of a shape */
    const struct sadmm_collision_body *bodies; /* by world body slot */
    size_t body_count;
    double dt;                        /* of what contacts are found for: the step, or the sub-step */
    int substeps_left;                /* so many more finds follow within the step: the list of pairs should last */
    double margin;                    /* share of the thinner shape's smallest extent (world def contact_margin) */
    int threads;                      /* at most; less than 1 counts as 1 */
    struct sadmm_team *team;          /* whose threads (parallel.h); NULL: OpenMP's */
    /* Pair overrides, both sorted by key = (low slot << 32) | high slot. */
    const uint64_t *disabled_body_pairs; size_t disabled_body_pair_count;      /* body slots */
    const uint64_t *friction_pairs; const double *friction_values; size_t friction_pair_count; /* shape slots */
    /* By body slot: a body's motion begins so long after the step's start, s: it was hit then; its orientation is the
     * one that it has at that moment. NULL: all are 0. */
    const double *since;
    double gravity; /* its size, m/s^2: a body at rest just outside the margin falls gravity x dt^2 in its first step */
};

#endif
