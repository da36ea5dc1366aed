/* Kernels E-H and P: C_i (14), beta_i (13), (15), and H = (A_i + beta_i C_i)^-1. One thread a body, in double: they run
 * a few times a step, and H only preconditions (the fixed point of Step 1 does not depend on it). */
#include "cuda_double.h"

/* C += row^T row, packed lower triangle. */
static __device__ __forceinline__ void add_row(double C[PACKED], const double row[6])
{
    int at = 0;
#pragma unroll
    for (int i = 0; i < 6; ++i)
#pragma unroll
        for (int j = 0; j <= i; ++j) C[at++] += row[i] * row[j];
}

/* Sums over a body's three-row points: J^T J = [ I, -[r]x; [r]x, |r|^2 I - r r^T ] does not depend on the frame. */
struct arm_sums {
    double count, rx, ry, rz, xx, yy, zz, xy, xz, yz;
};

static __device__ __forceinline__ void add_arm(arm_sums *s, const double r[3])
{
    double x = r[0], y = r[1], z = r[2];
    s->count += 1;
    s->rx += x, s->ry += y, s->rz += z;
    s->xx += x * x, s->yy += y * y, s->zz += z * z;
    s->xy += x * y, s->xz += x * z, s->yz += y * z;
}

static __device__ __forceinline__ void add_arm_sums(double C[PACKED], const arm_sums *s)
{
    C[0] += s->count, C[2] += s->count, C[5] += s->count;
    /* Rows 3-5, columns 0-2: [r]x */
    C[7] -= s->rz, C[8] += s->ry;
    C[10] += s->rz, C[12] -= s->rx;
    C[15] -= s->ry, C[16] += s->rx;
    C[9] += s->yy + s->zz;
    C[13] -= s->xy, C[14] += s->xx + s->zz;
    C[18] -= s->xz, C[19] -= s->yz, C[20] += s->xx + s->yy;
}

static __device__ void add_pair(const cuda_view &v, int32_t p, int side, arm_sums *sums, double C[PACKED])
{
    const struct sadmm_contact_pair *pair = &v.raw_pairs[p];
    for (int32_t k = 0; k < pair->count; ++k) {
        const struct sadmm_contact_point *point = &v.raw_points[pair->first + k];
        const double *r = side ? point->arm_b : point->arm_a;
        if (v.contact_rows == 3) {
            add_arm(sums, r);
        } else {
            double row[6];
            sadmm_contact_row(v3_load(pair->normal), r, 1, row);
            add_row(C, row);
        }
    }
}

static __device__ void add_block(const struct sadmm_problem_block *block, int side, double C[PACKED])
{
    const double *J = side ? block->jacobian_b : block->jacobian_a;
    for (int32_t r = 0; r < block->rows; ++r) {
        double row[6];
        for (int j = 0; j < 6; ++j) row[j] = J[6 * r + j];
        add_row(C, row);
    }
}

static __global__ void penalty_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index();
    if (i >= live_bodies(v)) return;
    double C[PACKED] = {0};
    arm_sums sums = {};
    for (int32_t at = v.offsets[i]; at < v.offsets[i + 1]; ++at) {
        int32_t record = v.incident[at] / 2, side = v.incident[at] & 1;
        if (record < v.pair_room) add_pair(v, record, side, &sums, C);
        else add_block(&v.raw.blocks[record - v.pair_room], side, C);
    }
    add_arm_sums(C, &sums);

    double trace_A = 0, trace_C = C[0] + C[2] + C[5] + C[9] + C[14] + C[20];
    for (int k = 0; k < 6; ++k) trace_A += (double)v.A[(size_t)i * MATRIX + (size_t)(7 * k)];
    const struct sadmm_settings *s = &v.settings;
    /* dt^2: c is given in the paper's time-scaled units. Without constraints beta does not matter. */
    v.beta[i] = trace_C > 0 ? s->penalty_mass_factor * trace_A / trace_C + s->penalty_offset * s->dt * s->dt : 1;
    for (int k = 0; k < PACKED; ++k) v.C[(size_t)i * PACKED + (size_t)k] = C[k];
}

static __global__ void factorize_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    int32_t i = thread_index();
    if (i >= live_bodies(v)) return;
    double M[36], L[36];
    const double *C = v.C + (size_t)i * PACKED, beta = v.beta[i];
    const solver_real *A = v.A + (size_t)i * MATRIX;
    solver_real *H = v.H + (size_t)i * MATRIX;
    int at = 0;
#pragma unroll
    for (int r = 0; r < 6; ++r)
#pragma unroll
        for (int k = 0; k <= r; ++k, ++at) M[6 * r + k] = M[6 * k + r] = (double)A[6 * r + k] + beta * C[at];
    /* A rounded to f32 stays positive definite unless the problem is beyond f32: then keep the diagonal. */
    if (!dense6_cholesky(M, L))
        for (int k = 0; k < 36; ++k) L[k] = k % 7 == 0 ? sqrt(M[k]) : 0;
    for (int k = 0; k < 6; ++k) {
        double unit[6], column[6];
        for (int r = 0; r < 6; ++r) unit[r] = r == k ? 1 : 0;
        dense6_solve(L, unit, column);
        for (int r = 0; r < 6; ++r) H[6 * k + r] = (solver_real)column[r];
    }
    for (int k = 36; k < MATRIX; ++k) H[k] = 0;
    v.state[(size_t)i * ROW + STATE_INV_BETA] = (solver_real)(1 / beta);
}

static __global__ void scale_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    int32_t i = thread_index();
    if (i >= live_bodies(v)) return;
    double ratio = args.factor;
    if (args.measure) /* by the residuals */
        ratio = sadmm_penalty_ratio(__longlong_as_double((long long)v.residual[0]),
                                    __longlong_as_double((long long)v.residual[1]), v.settings.penalty_ratio_limit);
    v.beta[i] *= ratio;
    if (i == 0) *v.ratio = ratio;
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(init_penalty)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    c->starting = true;
    c->placed = false;
    c->measured = false;
    c->rescaled = false;
    return CUDA(launch)(c, penalty_kernel, "init_penalty", blocks_for(c->view.bodies), &args, error);
}

extern "C" sadmm_status CUDA(factorize)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    return CUDA(launch)(c, factorize_kernel, "factorize", blocks_for(c->view.bodies), &args, error);
}

extern "C" sadmm_status CUDA(update_penalty)(struct sadmm_context *c, double ratio, struct sadmm_error *error)
{
    cuda_args args = {};
    args.factor = ratio;
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(launch)(c, scale_kernel, "update_penalty", blocks_for(c->view.bodies), &args, error));
    c->rescaled = true;
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_balance)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    args.measure = 1;
    CUDA_TRY(CUDA(launch)(c, scale_kernel, "update_penalty", blocks_for(c->view.bodies), &args, error));
    c->rescaled = true;
    return SADMM_OK;
}
