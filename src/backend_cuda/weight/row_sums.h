/* Constraints given by rows, in double from this precision's data: what they add to C, to wrenches, and their natural
 * map. */
#ifndef SADMM_CUDA_WEIGHT_ROW_SUMS_H
#define SADMM_CUDA_WEIGHT_ROW_SUMS_H

#include "backend_cuda/device/view.h"

static inline __device__ const row_data *rows_of(const row_view &rows, int32_t k)
{
    return rows.data + (size_t)k * SADMM_MAX_ROWS;
}

static inline __device__ void load_jacobian(const row_data &row, int32_t side, double out[6])
{
    for (int j = 0; j < 6; ++j) out[j] = (double)row.jacobian[side][j];
}

/* J^T lambda on side a or b. */
static inline __device__ void wrench_of_rows(const row_view &rows, int32_t k, int32_t side, double wrench[6])
{
    const row_data *row = rows_of(rows, k);
    for (int j = 0; j < 6; ++j) wrench[j] = 0;
    for (int r = 0; r < rows.constraints[k].rows; ++r)
        for (int j = 0; j < 6; ++j) wrench[j] += (double)row[r].jacobian[side][j] * (double)row[r].lambda;
}

/* C of a body += J^T J. */
static inline __device__ void add_rows(const row_view &rows, int32_t k, int32_t side, double C[PACKED])
{
    double J[6];
    for (int r = 0; r < rows.constraints[k].rows; ++r) {
        load_jacobian(rows_of(rows, k)[r], side, J);
        packed_add_row(C, J, 1);
    }
}

/* C += J^T B J, B = diag(weight) + along along^T. */
static inline __device__ void add_weighted_rows(const row_view &rows, int32_t k, int32_t side, double C[PACKED])
{
    double J[6], along[6] = {};
    for (int r = 0; r < rows.constraints[k].rows; ++r) {
        const row_data &row = rows_of(rows, k)[r];
        load_jacobian(row, side, J);
        packed_add_row(C, J, (double)row.weight);
        for (int j = 0; j < 6; ++j) along[j] += (double)row.along * J[j];
    }
    packed_add_row(C, along, 1);
}

#endif
