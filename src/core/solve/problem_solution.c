/* What a problem holds, read back; and its solution, read and set. */
#include <string.h>

#include "problem_internal.h"

const struct sadmm_contact_set *sadmm_problem_contact_set(const sadmm_problem *problem)
{
    return &problem->contacts;
}

int32_t sadmm_problem_body_count(const sadmm_problem *problem) { return problem ? problem->body_count : 0; }
int32_t sadmm_problem_contact_count(const sadmm_problem *problem)
{
    return problem ? (int32_t)problem->contacts.point_count : 0;
}
int32_t sadmm_problem_block_count(const sadmm_problem *problem) { return problem ? problem->block_count : 0; }

static void copy_values(double *to, const double *from, size_t count)
{
    if (to && count) memcpy(to, from, count * sizeof *to);
}

sadmm_status sadmm_problem_get_bodies(const sadmm_problem *problem, double *A, double *b, double *v0)
{
    TRY(sadmm_check_problem(problem));
    size_t n = (size_t)problem->body_count;
    copy_values(A, problem->A, 36 * n);
    copy_values(b, problem->b, 6 * n);
    copy_values(v0, problem->velocity, 6 * n);
    return SADMM_OK;
}

static sadmm_status check_index(sadmm_problem *problem, int32_t index, int32_t count, const char *name, const void *out)
{
    struct sadmm_error *error = &problem->error;
    if (index < 0 || index >= count) REFUSE("index = %d: must be in [0, %d]", index, count - 1);
    return sadmm_check_given(out, name, error);
}

sadmm_status sadmm_problem_get_contact(sadmm_problem *problem, int32_t index, sadmm_problem_contact *contact)
{
    TRY(sadmm_check_problem(problem));
    const struct sadmm_contact_set *set = &problem->contacts;
    TRY(check_index(problem, index, (int32_t)set->point_count, "contact", contact));

    size_t low = 0, high = set->pair_count; /* the last pair whose first point is <= index */
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        if (set->pairs[middle].first <= index) low = middle;
        else high = middle;
    }
    const struct sadmm_contact_pair *pair = &set->pairs[low];
    const struct sadmm_contact_point *point = &set->points[index];
    contact->body_a = pair->body_a >= 0 ? pair->body_a : -1;
    contact->body_b = pair->body_b >= 0 ? pair->body_b : -1;
    const bool on_a = sadmm_body_is_kinematic(pair->body_a), on_b = sadmm_body_is_kinematic(pair->body_b);
    for (int k = 0; k < 3; ++k)
        contact->velocity[k] = on_a   ? -problem->kinematic[6 * (size_t)sadmm_kinematic(pair->body_a) + (size_t)k]
                               : on_b ? problem->kinematic[6 * (size_t)sadmm_kinematic(pair->body_b) + (size_t)k]
                                      : 0;
    memcpy(contact->normal, pair->normal, sizeof contact->normal);
    memcpy(contact->arm_a, point->arm_a, sizeof contact->arm_a);
    memcpy(contact->arm_b, point->arm_b, sizeof contact->arm_b);
    contact->error = point->error;
    contact->friction = pair->friction;
    return SADMM_OK;
}

sadmm_status sadmm_problem_get_block(sadmm_problem *problem, int32_t index, sadmm_problem_block *block)
{
    TRY(sadmm_check_problem(problem));
    TRY(check_index(problem, index, problem->block_count, "block", block));
    *block = problem->blocks[index];
    return SADMM_OK;
}

/* Multipliers by rows from and to (blocks x 6); entries of rows that do not exist are 0. */
static void load_lambda(sadmm_problem *problem, const double *given)
{
    for (size_t k = 0; k < problem->rows.constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &problem->rows.constraints[k];
        memcpy(problem->rows.lambda + constraint->first, given + 6 * k, (size_t)constraint->count * sizeof *given);
    }
}

static void store_lambda(const sadmm_problem *problem, double *out)
{
    if (problem->rows.constraint_count) memset(out, 0, 6 * problem->rows.constraint_count * sizeof *out);
    for (size_t k = 0; k < problem->rows.constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &problem->rows.constraints[k];
        memcpy(out + 6 * k, problem->rows.lambda + constraint->first, (size_t)constraint->count * sizeof *out);
    }
}

sadmm_status sadmm_problem_get_solution(const sadmm_problem *problem, double *velocities, double *impulses,
                                        double *block_lambda)
{
    TRY(sadmm_check_problem(problem));
    copy_values(velocities, problem->velocity, 6 * (size_t)problem->body_count);
    if (block_lambda) store_lambda(problem, block_lambda);
    for (size_t k = 0; impulses && k < problem->contacts.point_count; ++k)
        memcpy(impulses + 3 * k, problem->contacts.points[k].impulse, 3 * sizeof(double));
    return SADMM_OK;
}

sadmm_status sadmm_problem_set_solution(sadmm_problem *problem, const double *velocities, const double *impulses,
                                        const double *block_lambda)
{
    TRY(sadmm_check_problem(problem));
    struct sadmm_error *error = &problem->error;
    int32_t points = (int32_t)problem->contacts.point_count;
    TRY(sadmm_check_values("velocities", velocities, problem->body_count, 6, error));
    TRY(sadmm_check_values("impulses", impulses, points, 3, error));
    TRY(sadmm_check_lambda("block_lambda", problem->blocks, problem->block_count, block_lambda, error));

    if (velocities) copy_values(problem->velocity, velocities, 6 * (size_t)problem->body_count);
    for (int32_t k = 0; impulses && k < points; ++k)
        memcpy(problem->contacts.points[k].impulse, impulses + 3 * (size_t)k, 3 * sizeof(double));
    if (block_lambda) load_lambda(problem, block_lambda);
    return SADMM_OK;
}

