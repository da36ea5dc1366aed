/* Boxes A-D of the paper's Fig. 4: A_i, b_i, dense Jacobian rows, errors, and the start of the iteration. */
#include <string.h>

#include "core/math/dense6.h"
#include "core/model/system_math.h"
#include "literal.h"

sadmm_status sadmm_ref_assemble_bodies(struct sadmm_context *c, struct sadmm_error *error)
{
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        sadmm_system_body(c->system, c->settings, i, body->A, body->b);
        if (c->plan->warm_start) {
            memcpy(body->v, c->system->velocity + 6 * (size_t)i, sizeof body->v);
        } else {
            double L[36];
            if (!dense6_cholesky(body->A, L))
                return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "mass matrix of body %d: not positive definite",
                                  i);
            dense6_solve(L, body->b, body->v); /* v0 = A^-1 b */
        }
    }
    return SADMM_OK;
}

/* z = J v0, u = -lambda0 on both sides. */
static void start(struct sadmm_context *c, struct ref_constraint *constraint)
{
    for (int s = 0; s < 2; ++s) {
        struct ref_side *side = &constraint->side[s];
        for (int r = 0; r < constraint->rows; ++r) {
            bool dynamic = side->body >= 0;
            side->z[r] = dynamic ? dense6_dot(side->J + 6 * r, c->bodies[side->body].v) : 0;
            side->x[r] = side->z_before[r] = side->z[r];
            side->u[r] = dynamic ? -constraint->lambda[r] : 0;
        }
    }
}

static void clear(struct ref_constraint *constraint, sadmm_block_kind kind, int rows, int32_t a, int32_t b)
{
    memset(constraint, 0, sizeof *constraint);
    constraint->kind = kind;
    constraint->rows = rows;
    constraint->side[0].body = a;
    constraint->side[1].body = b;
}

static void assemble_block(struct sadmm_context *c, int32_t index)
{
    const struct sadmm_problem_block *block = &c->system->blocks[index];
    struct ref_constraint *constraint = &c->constraints[c->system->contacts->point_count + (size_t)index];
    size_t rows = (size_t)block->rows;

    clear(constraint, block->kind, block->rows, block->body_a, block->body_b);
    if (block->body_a >= 0) memcpy(constraint->side[0].J, block->jacobian_a, 6 * rows * sizeof(double));
    if (block->body_b >= 0) memcpy(constraint->side[1].J, block->jacobian_b, 6 * rows * sizeof(double));
    constraint->mu = block->friction;
    for (int r = 0; r < block->rows; ++r) {
        constraint->e[r] = block->error[r];
        constraint->k[r] = block->stiffness[r];
        constraint->c[r] = block->damping[r];
        if (block->kind == SADMM_BLOCK_HARD) {
            constraint->free_row[r] = true;
            for (int s = 0; s < 2; ++s)
                for (int j = 0; j < 6; ++j)
                    if (constraint->side[s].J[6 * r + j] != 0) constraint->free_row[r] = false;
        }
        if (c->plan->warm_start && !constraint->free_row[r])
            constraint->lambda[r] = c->system->block_lambda[6 * (size_t)index + (size_t)r];
    }
    start(c, constraint);
}

static void assemble_blocks(struct sadmm_context *c, sadmm_block_kind kind)
{
    for (int32_t k = 0; k < c->system->block_count; ++k)
        if (c->system->blocks[k].kind == kind) assemble_block(c, k);
}

sadmm_status sadmm_ref_assemble_contacts(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    const struct sadmm_contact_set *contacts = c->system->contacts;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        mat3 frame = sadmm_contact_frame(pair->normal);
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const struct sadmm_contact_point *point = &contacts->points[k];
            struct ref_constraint *constraint = &c->constraints[k];
            clear(constraint, SADMM_BLOCK_CONTACT, c->plan->contact_rows, pair->body_a, pair->body_b);
            constraint->mu = pair->friction;
            constraint->e[0] = sadmm_contact_e(c->system, c->settings, pair, point);
            for (int r = 0; r < constraint->rows; ++r) {
                if (pair->body_a >= 0)
                    sadmm_contact_row(frame.r[r], point->arm_a, -1, constraint->side[0].J + 6 * r);
                if (pair->body_b >= 0)
                    sadmm_contact_row(frame.r[r], point->arm_b, +1, constraint->side[1].J + 6 * r);
                if (c->plan->warm_start)
                    constraint->lambda[r] = v3_dot(frame.r[r], v3_load(point->impulse));
            }
            start(c, constraint);
        }
    }
    assemble_blocks(c, SADMM_BLOCK_CONTACT);
    return SADMM_OK;
}

sadmm_status sadmm_ref_assemble_joints(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    assemble_blocks(c, SADMM_BLOCK_HARD);
    return SADMM_OK;
}

sadmm_status sadmm_ref_assemble_springs(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    assemble_blocks(c, SADMM_BLOCK_SOFT);
    return SADMM_OK;
}
