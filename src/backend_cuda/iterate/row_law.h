/* Steps 2-4 of constraints given by Jacobian rows (math/row.h), for the stepwise and the persistent kernels. Sums over
 * rows have the order of a quad: lane q has the rows q and q + 4, and lanes are added as (0 + 1) + (2 + 3). */
#ifndef SADMM_CUDA_ITERATE_ROW_LAW_H
#define SADMM_CUDA_ITERATE_ROW_LAW_H

#include "core/math/contact.h"
#include "core/math/row.h"
#include "quad.h"

struct row_law {
    real gain, bias, compliance, lo, hi;
    real step;  /* what the residual of its equation is multiplied with for the change of lambda (less its sign) */
    real along; /* fast: of the weights, with those of the other rows */
};

/* weight: 1/s, fast: B / n without its `along` part. A row whose denominator is 0 does not move. */
CUDA_INLINE row_law law_of_row(const row_data &row, real weight)
{
    const real denominator = fused(row.compliance, weight, row.gain);
    row_law law = {row.gain, row.bias, row.compliance, row.lo, row.hi, 0, row.along};
    if (denominator > 0) law.step = weight / denominator;
    return law;
}

/* fast: 1 / number of dynamic bodies. */
CUDA_INLINE real share_of_body(bool both) { return both ? (real)0.5 : (real)1; }

CUDA_INLINE vec3 linear_of(const real row[6]) { return v3(row[0], row[1], row[2]); }
CUDA_INLINE vec3 angular_of(const real row[6]) { return v3(row[3], row[4], row[5]); }

/* One body's share of a row's velocity. */
CUDA_INLINE real row_velocity(const real row[6], const body_motion &motion)
{
    return fused_dot(linear_of(row), motion.linear) + fused_dot(angular_of(row), motion.angular);
}

/* The residual of the row's equation. */
CUDA_INLINE real law_residual(const row_law &law, real x, real lambda)
{
    return fused(law.gain, x, fused(law.compliance, lambda, law.bias));
}

/* lambda^ and lambda^ - lambda of a scalar row. push: of all rows of the constraint, the sum of along times the
 * residual, over the number of dynamic bodies. */
struct row_change {
    real lambda, delta;
};
CUDA_INLINE row_change change_row(const row_law &law, real residual, real push, real old)
{
    row_change out;
    out.delta = -fused(law.along, push, law.step * residual);
    out.lambda = row_bounded(old, law.lo, law.hi, &out.delta);
    return out;
}

/* The same of a contact's three rows; step: law.step times the residual. */
template <bool FAST>
CUDA_INLINE void change_cone(const real old[3], const real step[3], real friction, real lambda[3], real delta[3])
{
    if (FAST) {
        contact_change_rows(old, step, friction, delta, lambda);
        return;
    }
    const real y[3] = {old[0] - step[0], old[1] - step[1], old[2] - step[2]};
    contact_project_rows(y, friction, lambda);
    for (int r = 0; r < 3; ++r) delta[r] = lambda[r] - old[r];
}

/* What a lane's rows push with: `impulse` of row 0, then of row 1. */
CUDA_INLINE void add_row(const real row[6], real impulse, bool first, vec3 *force, vec3 *torque)
{
    const vec3 linear = linear_of(row), angular = angular_of(row);
    *force = first ? v3_scale(linear, impulse) : fused_madd(*force, impulse, linear);
    *torque = first ? v3_scale(angular, impulse) : fused_madd(*torque, impulse, angular);
}

/* ---- by one thread ----------------------------------------------------------------------------------------------- */

/* All of a constraint's rows, for the velocities of its bodies. `weight`: paper: 1/s. */
template <bool FAST>
CUDA_INLINE void update_rows(const row_data *rows, const row_constraint &constraint, bool both, real weight,
                             const body_motion &a, const body_motion &b, real lambda[SADMM_MAX_ROWS],
                             real delta[SADMM_MAX_ROWS])
{
    const real share = share_of_body(both);
    row_law law[SADMM_MAX_ROWS];
    real residual[SADMM_MAX_ROWS], push[QUAD];
    for (int r = 0; r < SADMM_MAX_ROWS; ++r) {
        const row_data row = rows[r];
        law[r] = law_of_row(row, FAST ? share * row.weight : weight);
        residual[r] =
            law_residual(law[r], row_velocity(row.jacobian[0], a) + row_velocity(row.jacobian[1], b), row.lambda);
    }
    for (int q = 0; q < QUAD; ++q) {
        push[q] = law[q].along * residual[q];
        if (q + QUAD < SADMM_MAX_ROWS) push[q] = fused(law[q + QUAD].along, residual[q + QUAD], push[q]);
    }
    const real pushed = FAST ? share * ((push[0] + push[1]) + (push[2] + push[3])) : (real)0;
    for (int r = 0; r < SADMM_MAX_ROWS; ++r) {
        const row_change change = change_row(law[r], residual[r], pushed, rows[r].lambda);
        lambda[r] = change.lambda;
        delta[r] = change.delta;
    }
    if (!constraint.cone) return;
    const real old[3] = {rows[0].lambda, rows[1].lambda, rows[2].lambda},
               step[3] = {law[0].step * residual[0], law[1].step * residual[1], law[2].step * residual[2]};
    change_cone<FAST>(old, step, constraint.friction, lambda, delta);
}

/* J^T impulse on a body, into its record. */
CUDA_INLINE void store_row_record(const row_data *rows, int32_t side, const real impulse[SADMM_MAX_ROWS],
                                  solver_real *record)
{
    vec3 force[QUAD], torque[QUAD];
    for (int q = 0; q < QUAD; ++q) {
        add_row(rows[q].jacobian[side], impulse[q], true, &force[q], &torque[q]);
        if (q + QUAD < SADMM_MAX_ROWS)
            add_row(rows[q + QUAD].jacobian[side], impulse[q + QUAD], false, &force[q], &torque[q]);
    }
    const vec3 sum = v3_add(v3_add(force[0], force[1]), v3_add(force[2], force[3])),
               turn = v3_add(v3_add(torque[0], torque[1]), v3_add(torque[2], torque[3]));
    const real all[ROW] = {sum.x, sum.y, sum.z, 0, turn.x, turn.y, turn.z, 0};
    for (int j = 0; j < ROW; ++j) record[j] = all[j];
}

/* A row's share of the primal residual: |d lambda| times the larger 1/beta; fast: / B. */
CUDA_INLINE real row_primal(real delta, real inv_beta) { return real_abs(delta) * inv_beta; }
CUDA_INLINE real row_primal_fast(real delta, real weight, real along)
{
    const real B = fused(along, along, weight);
    return B > 0 ? real_abs(delta) * (1 / B) : (real)0;
}

#endif
