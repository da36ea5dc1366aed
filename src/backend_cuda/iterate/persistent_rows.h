/* The persistent kernel (persistent.h): sides of row blocks, out of line: few systems have them. */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_ROWS_H
#define SADMM_CUDA_ITERATE_PERSISTENT_ROWS_H

#include "sweep.h"

/* Steps 2-4 of side `code` of a row block, of the method `fast`, into this side's record. */
static __device__ __noinline__ double update_row_side_fast(const cuda_view &v, int32_t code, const solver_real *own,
                                                           const solver_real *other, solver_real *kept,
                                                           solver_real *record, real relaxation_factor)
{
    const int32_t k = code / 2 - v.contacts.pair_capacity, side = code & 1;
    const row_about about = v.rows.info[k];
    real lambda[6], delta[6];
    for (int j = 0; j < 6; ++j) lambda[j] = kept[j];
    update_row_block_fast(v.model, v.rows, k, about, side ? other : own, side ? own : other, lambda, delta);
    for (int j = 0; j < 6; ++j) kept[j] = relaxed(kept[j], lambda[j], delta[j], relaxation_factor);
    store_row_record(v.rows, k, about.rows, side, delta, record);
    return row_block_primal_fast(v.rows, k, about, delta);
}

/* Steps 2-4 of side `code` of a row block, into this side's record; `change`: as after a measured iteration. */
static __device__ __noinline__ double update_row_side(const cuda_view &v, int32_t code, const solver_real *own,
                                                      const solver_real *other, solver_real *kept, solver_real *record,
                                                      solver_real *change)
{
    const int32_t k = code / 2 - v.contacts.pair_capacity, side = code & 1;
    const row_about about = v.rows.info[k];
    real lambda[6], delta[6];
    for (int j = 0; j < 6; ++j) lambda[j] = kept[j];
    update_row_block(v.bodies, v.rows, k, about, side ? other : own, side ? own : other, lambda, delta);
    for (int j = 0; j < 6; ++j) kept[j] = lambda[j];
    if (!change)
        for (int j = 0; j < 6; ++j) lambda[j] += delta[j];
    store_row_record(v.rows, k, about.rows, side, lambda, record);
    if (!change) return 0;
    store_row_record(v.rows, k, about.rows, side, delta, change);
    return row_block_primal(v.bodies, about, delta);
}

static __device__ __noinline__ void start_row_side(const cuda_view &v, int32_t code, solver_real *kept,
                                                   solver_real *record, bool start)
{
    const int32_t k = code / 2 - v.contacts.pair_capacity;
    real lambda[6];
    load_row_lambda(v.rows, k, lambda);
    for (int j = 0; j < 6; ++j) kept[j] = lambda[j];
    if (start) store_row_record(v.rows, k, v.rows.info[k].rows, code & 1, lambda, record);
}

#endif
