/* Boxes E-P of the paper's Fig. 4: penalty weights, Steps 1-4, residuals. Numbers in brackets are its equations. */
#include <string.h>

#include "core/math/dense6.h"
#include "core/math/contact.h"
#include "core/math/penalty.h"
#include "literal.h"

/* (14): C_i = sum_k J_{i,k}^T J_{i,k}, and (13): beta_i = M Tr(A_i) / Tr(C_i) + c. */
sadmm_status sadmm_ref_init_penalty(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    for (int32_t i = 0; i < c->system->body_count; ++i) memset(c->bodies[i].C, 0, sizeof c->bodies[i].C);

    for (size_t k = 0; k < c->constraint_count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        for (int s = 0; s < 2; ++s) {
            const struct ref_side *side = &constraint->side[s];
            if (side->body < 0) continue;
            double *C = c->bodies[side->body].C;
            for (int r = 0; r < constraint->rows; ++r)
                for (int i = 0; i < 6; ++i)
                    for (int j = 0; j < 6; ++j) C[6 * i + j] += side->J[6 * r + i] * side->J[6 * r + j];
        }
    }

    const struct sadmm_settings *settings = c->settings;
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        double trace_A = 0, trace_C = 0;
        for (int j = 0; j < 6; ++j) {
            trace_A += body->A[7 * j];
            trace_C += body->C[7 * j];
        }
        body->beta = penalty_of_body(trace_A, trace_C, settings->penalty_mass_factor, settings->penalty_offset,
                                     settings->dt);
    }
    return SADMM_OK;
}

sadmm_status sadmm_ref_factorize(struct sadmm_context *c, struct sadmm_error *error)
{
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        double matrix[36];
        for (int j = 0; j < 36; ++j) matrix[j] = body->A[j] + body->beta * body->C[j];
        if (!dense6_cholesky(matrix, body->factor))
            return sadmm_fail(error, SADMM_ERROR_NON_FINITE,
                              "A + beta C of body %d (beta = %g kg): not positive definite to double precision", i,
                              body->beta);
    }
    return SADMM_OK;
}

/* Step 1, (6): (A_i + beta_i C_i) v_i = b_i + sum_k J_{i,k}^T (beta_i z_{i,k} - u_{i,k}). */
sadmm_status sadmm_ref_update_velocity(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    for (int32_t i = 0; i < c->system->body_count; ++i)
        memcpy(c->bodies[i].v, c->bodies[i].b, sizeof c->bodies[i].v); /* v holds the right-hand side until solved */

    for (size_t k = 0; k < c->constraint_count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        for (int s = 0; s < 2; ++s) {
            const struct ref_side *side = &constraint->side[s];
            if (side->body < 0) continue;
            struct ref_body *body = &c->bodies[side->body];
            for (int r = 0; r < constraint->rows; ++r)
                for (int j = 0; j < 6; ++j)
                    body->v[j] += side->J[6 * r + j] * (body->beta * side->z[r] - side->u[r]);
        }
    }
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        double rhs[6];
        memcpy(rhs, body->v, sizeof rhs);
        dense6_solve(body->factor, rhs, body->v);
    }
    return SADMM_OK;
}

/* lambda of Step 3, below (9): sum = y_i/beta_i + y_j/beta_j, s = 1/beta_i + 1/beta_j. */
static void solve_lambda(struct ref_constraint *constraint, const double sum[6], double s)
{
    double *lambda = constraint->lambda;
    if (constraint->cone) {
        double candidate[3] = {0, 0, 0}, projected[3];
        for (int r = 0; r < constraint->rows; ++r)
            candidate[r] = -(constraint->e[r] + constraint->kinematic[r] + sum[r]) / s;
        contact_project_rows(candidate, constraint->mu, projected);
        for (int r = 0; r < constraint->rows; ++r) lambda[r] = projected[r];
        return;
    }
    for (int r = 0; r < constraint->rows; ++r) { /* math/row.h with x = sum + s lambda */
        double alone =
            -(constraint->e[r] + constraint->gain[r] * sum[r]) / (constraint->compliance[r] + constraint->gain[r] * s);
        lambda[r] = constraint->free_row[r] ? 0 : fmin(fmax(alone, constraint->lo[r]), constraint->hi[r]);
    }
}

/* Steps 2-4 for every constraint. z of the iteration before is always kept: measure_residuals needs it for (17). */
sadmm_status sadmm_ref_update_constraints(struct sadmm_context *c, bool measure, struct sadmm_error *error)
{
    (void)measure;
    (void)error;
    for (size_t k = 0; k < c->constraint_count; ++k) {
        struct ref_constraint *constraint = &c->constraints[k];
        double y[2][6], sum[6] = {0}, s = 0;
        for (int i = 0; i < 2; ++i) {
            struct ref_side *side = &constraint->side[i];
            if (side->body < 0) continue;
            const struct ref_body *body = &c->bodies[side->body];
            s += 1 / body->beta;
            for (int r = 0; r < constraint->rows; ++r) {
                side->x[r] = dense6_dot(side->J + 6 * r, body->v);       /* Step 2, (7) */
                y[i][r] = body->beta * side->x[r] + side->u[r];          /* (9) */
                sum[r] += y[i][r] / body->beta;
            }
        }
        solve_lambda(constraint, sum, s);                                /* Step 3, (8) */
        for (int i = 0; i < 2; ++i) {
            struct ref_side *side = &constraint->side[i];
            if (side->body < 0) continue;
            double beta = c->bodies[side->body].beta;
            for (int r = 0; r < constraint->rows; ++r) {
                side->z_before[r] = side->z[r];
                side->z[r] = (y[i][r] + constraint->lambda[r]) / beta;   /* (9) */
                side->u[r] += beta * (side->x[r] - side->z[r]);          /* Step 4, (10) */
            }
        }
    }
    return SADMM_OK;
}

/* (16): x - z. (17): beta_i sum_k J_{i,k}^T (z^l - z^{l+1}). Infinity norms. */
sadmm_status sadmm_ref_measure_residuals(struct sadmm_context *c, struct sadmm_residual *residual,
                                         struct sadmm_error *error)
{
    (void)error;
    residual->primal = residual->dual = 0;
    for (int32_t i = 0; i < c->system->body_count; ++i) memset(c->bodies[i].dual, 0, sizeof c->bodies[i].dual);

    for (size_t k = 0; k < c->constraint_count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        for (int s = 0; s < 2; ++s) {
            const struct ref_side *side = &constraint->side[s];
            if (side->body < 0) continue;
            struct ref_body *body = &c->bodies[side->body];
            for (int r = 0; r < constraint->rows; ++r) {
                residual->primal = fmax(residual->primal, fabs(side->x[r] - side->z[r]));
                for (int j = 0; j < 6; ++j)
                    body->dual[j] += body->beta * side->J[6 * r + j] * (side->z_before[r] - side->z[r]);
            }
        }
    }
    for (int32_t i = 0; i < c->system->body_count; ++i)
        for (int j = 0; j < 6; ++j) residual->dual = fmax(residual->dual, fabs(c->bodies[i].dual[j]));
    return SADMM_OK;
}

/* (15), the ratio clamped by the schedule. z and u are unscaled and stay. */
sadmm_status sadmm_ref_update_penalty(struct sadmm_context *c, double ratio, struct sadmm_error *error)
{
    (void)error;
    for (int32_t i = 0; i < c->system->body_count; ++i) c->bodies[i].beta *= ratio;
    return SADMM_OK;
}
