/* Constraints given by Jacobian rows (core/model/rows.h, math/row.h) on the device. Constraint k has the slots
 * SADMM_MAX_ROWS k, ... for its rows; slots beyond its count hold a row of zeros whose multiplier stays 0. */
#ifndef SADMM_CUDA_DEVICE_ROW_H
#define SADMM_CUDA_DEVICE_ROW_H

#include "core/model/rows.h"

/* As the host gives it. */
struct raw_row {
    double jacobian[2][6];               /* on (linear, angular) of a, of b */
    double gain, bias, compliance, lo, hi; /* its law */
    double lambda;
};

/* As it iterates; a multiple of 16 bytes, so that a row is fetched by wide loads. */
struct alignas(16) row_data {
    solver_real jacobian[2][6];
    solver_real gain, bias, compliance, lo, hi;
    solver_real weight, along; /* fast: B = diag(weight) + along along^T, kg */
    solver_real lambda;
};

struct row_constraint {
    int32_t body_a, body_b; /* raw; the static world: `bodies` */
    int32_t side_a, side_b; /* as in pair_bodies */
    int32_t rows;
    int32_t cone;           /* rows 0 to 2 are a contact's normal and tangents */
    solver_real friction;
};

/* fast: J A^-1 J^T of a row, and what its multiplier counts for in the load of its constraint. */
struct row_response {
    double response, scale;
};

#endif
