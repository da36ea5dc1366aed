/* v = A^-1 (b + J^T lambda) of a problem's current lambda (problem_set.h). */
#include "core/math/dense6.h"
#include "core/math/vec3.h"
#include "core/base/memory.h"
#include "problem_set.h"

/* b's wrench of an impulse at its contact point; a's is the opposite. */
static void add_impulse(double *wrench, int32_t body, const double arm[3], const double *impulse, double sign)
{
    if (body < 0) return;
    double *w = wrench + 6 * (size_t)body, torque[3];
    v3_store(v3_cross(v3_load(arm), v3_load(impulse)), torque);
    for (int k = 0; k < 3; ++k) {
        w[k] += sign * impulse[k];
        w[3 + k] += sign * torque[k];
    }
}

static void add_rows(double *wrench, int32_t body, const double *jacobian, int rows, const double *lambda)
{
    if (body < 0) return;
    for (int r = 0; r < rows; ++r)
        for (int k = 0; k < 6; ++k) wrench[6 * (size_t)body + (size_t)k] += jacobian[6 * r + k] * lambda[r];
}

/* `b` (bodies x 6) becomes b + J^T lambda, then v. */
static sadmm_status balance(sadmm_problem *problem, double *A, double *b, double *impulses, double *lambda)
{
    sadmm_problem_contact contact;
    sadmm_problem_block block;
    sadmm_status status = sadmm_problem_get_bodies(problem, A, b, NULL);
    if (status == SADMM_OK) status = sadmm_problem_get_solution(problem, NULL, impulses, lambda);
    for (int32_t k = 0; k < sadmm_problem_contact_count(problem) && status == SADMM_OK; ++k) {
        status = sadmm_problem_get_contact(problem, k, &contact);
        if (status != SADMM_OK) break;
        add_impulse(b, contact.body_a, contact.arm_a, impulses + 3 * (size_t)k, -1);
        add_impulse(b, contact.body_b, contact.arm_b, impulses + 3 * (size_t)k, 1);
    }
    for (int32_t k = 0; k < sadmm_problem_block_count(problem) && status == SADMM_OK; ++k) {
        status = sadmm_problem_get_block(problem, k, &block);
        if (status != SADMM_OK) break;
        add_rows(b, block.body_a, block.jacobian_a, block.rows, lambda + 6 * (size_t)k);
        add_rows(b, block.body_b, block.jacobian_b, block.rows, lambda + 6 * (size_t)k);
    }
    for (int32_t i = 0; i < sadmm_problem_body_count(problem); ++i) {
        double L[36];
        dense6_cholesky(A + 36 * (size_t)i, L);
        dense6_solve(L, b + 6 * (size_t)i, b + 6 * (size_t)i);
    }
    return status == SADMM_OK ? sadmm_problem_set_solution(problem, b, NULL, NULL) : status;
}

sadmm_status problem_set_balance(sadmm_problem *problem, struct sadmm_error *error)
{
    size_t n = (size_t)sadmm_problem_body_count(problem), contacts = (size_t)sadmm_problem_contact_count(problem),
           blocks = (size_t)sadmm_problem_block_count(problem);
    double *A = sadmm_alloc(42 * n + 3 * contacts + 6 * blocks, sizeof *A);
    if (!A) return sadmm_fail_memory(error, "the balanced velocities");
    double *b = A + 36 * n, *impulses = b + 6 * n;
    sadmm_status status = balance(problem, A, b, impulses, impulses + 3 * contacts);
    sadmm_free(A);
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
}
