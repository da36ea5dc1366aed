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

static void clear(struct ref_constraint *constraint, bool cone, int rows, int32_t a, int32_t b)
{
    memset(constraint, 0, sizeof *constraint);
    constraint->cone = cone;
    constraint->rows = rows;
    constraint->side[0].body = a;
    constraint->side[1].body = b;
}

static void assemble_constraint(struct sadmm_context *c, size_t index)
{
    const struct sadmm_rows *in = c->system->rows;
    const struct sadmm_row_constraint *about = &in->constraints[index];
    struct ref_constraint *constraint = &c->constraints[c->system->contacts->point_count + index];
    size_t first = (size_t)about->first, count = (size_t)about->count;

    clear(constraint, about->cone, about->count, about->body_a, about->body_b);
    if (about->body_a >= 0) memcpy(constraint->side[0].J, in->jacobian_a + 6 * first, 6 * count * sizeof(double));
    if (about->body_b >= 0) memcpy(constraint->side[1].J, in->jacobian_b + 6 * first, 6 * count * sizeof(double));
    constraint->mu = about->friction;
    for (size_t r = 0; r < count; ++r) {
        constraint->e[r] = in->bias[first + r];
        constraint->gain[r] = in->gain[first + r];
        constraint->compliance[r] = in->compliance[first + r];
        constraint->lo[r] = in->lo[first + r];
        constraint->hi[r] = in->hi[first + r];
        constraint->coupled[r] = sadmm_row_is_coupled(in, first + r);
        constraint->free_row[r] = !about->cone && in->compliance[first + r] == 0 && !sadmm_row_acts(in, first + r);
        if (c->plan->warm_start && !constraint->free_row[r]) constraint->lambda[r] = in->lambda[first + r];
    }
    start(c, constraint);
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
            clear(constraint, true, c->plan->contact_rows, pair->body_a, pair->body_b);
            constraint->mu = pair->friction;
            constraint->e[0] = sadmm_contact_e(c->system, c->settings, pair, &contacts->points[pair->first],
                                               k - pair->first);
            const vec3 kinematic = m3_mul(frame, sadmm_kinematic_part(c->system, pair, point));
            v3_store(kinematic, constraint->kinematic);
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
    return SADMM_OK;
}

sadmm_status sadmm_ref_assemble_rows(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    for (size_t k = 0; k < sadmm_row_constraint_count(c->system); ++k) assemble_constraint(c, k);
    return SADMM_OK;
}
