/* Constraints given by Jacobian rows: from core's store (core/model/rows.h) to the device, and there into the solver's
 * form. */
#include <string.h>

#include "backend_cuda/device/double.h"
#include "assemble.h"
#include "core/base/memory.h"

/* ---- upload ---------------------------------------------------------------------------------------------------- */

size_t CUDA(raw_row_bytes)(int32_t count)
{
    return (size_t)count * (sizeof(struct sadmm_row_constraint) + SADMM_MAX_ROWS * sizeof(struct raw_row));
}

void CUDA(bind_raw_rows)(struct sadmm_context *c, void *memory)
{
    struct sadmm_row_constraint *constraints = (struct sadmm_row_constraint *)memory;
    c->view.raw.constraints = constraints;
    c->view.raw.rows = (const struct raw_row *)(constraints + c->view.rows.count);
}

static void copy_row(const struct sadmm_rows *rows, size_t r, struct raw_row *out)
{
    for (int j = 0; j < 6; ++j) {
        out->jacobian[0][j] = rows->jacobian_a[6 * r + (size_t)j];
        out->jacobian[1][j] = rows->jacobian_b[6 * r + (size_t)j];
    }
    out->gain = rows->gain[r];
    out->bias = rows->bias[r];
    out->compliance = rows->compliance[r];
    out->lo = rows->lo[r];
    out->hi = rows->hi[r];
    out->lambda = rows->lambda[r];
}

sadmm_status CUDA(upload_rows)(struct sadmm_context *c, struct sadmm_error *error)
{
    const struct sadmm_rows *rows = c->system->rows;
    const size_t count = (size_t)c->view.rows.count, size = CUDA(raw_row_bytes)(c->view.rows.count);
    if (count == 0) return SADMM_OK;
    char *all = (char *)sadmm_alloc(size, 1);
    if (!all) return sadmm_fail_memory(error, "the cuda backend's rows");
    memset(all, 0, size);
    memcpy(all, rows->constraints, count * sizeof *rows->constraints);
    struct raw_row *slots = (struct raw_row *)(all + count * sizeof *rows->constraints);
    for (size_t k = 0; k < count; ++k)
        for (int32_t r = 0; r < rows->constraints[k].count; ++r)
            copy_row(rows, (size_t)(rows->constraints[k].first + r), &slots[k * SADMM_MAX_ROWS + (size_t)r]);
    const sadmm_status status = CUDA(upload)(c, (void *)c->view.raw.constraints, PINNED_ROWS, 0, all, size, error);
    sadmm_free(all);
    return status;
}

/* ---- assembly -------------------------------------------------------------------------------------------------- */

/* A row of zeros is no constraint (Sec. III-C of the paper): where it has no compliance its multiplier stays 0. */
static __device__ row_data solver_row(const struct raw_row &raw, bool cone, bool warm)
{
    row_data row = {};
    bool acts = cone || raw.compliance != 0;
    for (int side = 0; side < 2; ++side)
        for (int j = 0; j < 6; ++j) {
            row.jacobian[side][j] = (solver_real)raw.jacobian[side][j];
            acts = acts || raw.jacobian[side][j] != 0;
        }
    if (!acts) return row;
    row.gain = (solver_real)raw.gain;
    row.bias = (solver_real)raw.bias;
    row.compliance = (solver_real)raw.compliance;
    row.lo = (solver_real)raw.lo;
    row.hi = (solver_real)raw.hi;
    row.lambda = warm ? (solver_real)raw.lambda : (solver_real)0;
    return row;
}

static __global__ void assemble_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t k = thread_index();
    if (k >= live_rows(v.model, v.rows)) return;
    const struct sadmm_row_constraint from = v.raw.constraints[k];
    row_constraint to = {};
    to.body_a = from.body_a >= 0 ? from.body_a : v.model.bodies;
    to.body_b = from.body_b >= 0 ? from.body_b : v.model.bodies;
    to.side_a = to.side_b = -1;
    to.rows = from.count;
    to.cone = from.cone;
    to.friction = (solver_real)solver_friction(v.model, from.friction);
    v.rows.constraints[k] = to;
    for (int r = 0; r < SADMM_MAX_ROWS; ++r) {
        const size_t slot = (size_t)k * SADMM_MAX_ROWS + (size_t)r;
        const row_data none = {};
        v.rows.data[slot] = r < from.count ? solver_row(v.raw.rows[slot], from.cone, v.model.warm_start) : none;
    }
}

extern "C" sadmm_status CUDA(assemble_rows)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    return CUDA(launch)(c, assemble_rows_kernel, "assemble_rows", blocks_for(c->view.rows.count), &args, error);
}
