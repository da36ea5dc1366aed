/* Momentum that no contact may change, and the energy limit, after the last iteration (math/momentum.h,
 * energy_limit.h), from dense matrices: G_i of every body, rows of the literal Jacobians times G_i. */
#include <string.h>

#include "literal.h"

static struct ref_body *island_of(const struct sadmm_context *c, const struct ref_constraint *constraint)
{
    const int32_t body = constraint->side[constraint->side[0].body < 0].body;
    return &c->bodies[c->bodies[body].label];
}

/* G_i, 6 x 6: what a motion of its island does to body i. Origin: the body that names the island. */
static void rigid_motion(const struct sadmm_context *c, int32_t i, double G[36])
{
    const double *at = c->system->rigid[i].position, *origin = c->system->rigid[c->bodies[i].label].position;
    const double d[3] = {at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]};
    memset(G, 0, 36 * sizeof *G);
    for (int k = 0; k < 6; ++k) G[7 * k] = 1;
    G[6 * 0 + 4] = d[2], G[6 * 0 + 5] = -d[1];
    G[6 * 1 + 3] = -d[2], G[6 * 1 + 5] = d[0];
    G[6 * 2 + 3] = d[1], G[6 * 2 + 4] = -d[0];
}

/* y += X^T x */
static void add_transposed(const double X[36], const double x[6], double y[6])
{
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k < 6; ++k) y[k] += X[6 * r + k] * x[r];
}

static void add_body(struct sadmm_context *c, int32_t i)
{
    struct momentum_sums *sums = &c->bodies[c->bodies[i].label].momentum;
    const struct ref_body *body = &c->bodies[i];
    double G[36], AG[36] = {0}, M[36] = {0}, momentum[6];
    rigid_motion(c, i, G);
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k < 6; ++k)
            for (int j = 0; j < 6; ++j) AG[6 * r + k] += body->A[6 * r + j] * G[6 * j + k];
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k < 6; ++k)
            for (int j = 0; j < 6; ++j) M[6 * r + k] += G[6 * j + r] * AG[6 * j + k];
    dense6_mul(body->A, body->v, momentum);
    add_transposed(G, momentum, sums->now);
    add_transposed(G, body->b, sums->free);
    sums->mass += M[0];
    sums->moment[0] += M[6 * 5 + 1], sums->moment[1] += M[6 * 3 + 2], sums->moment[2] += M[6 * 4 + 0];
    sums->inertia[0] += M[21], sums->inertia[1] += M[28], sums->inertia[2] += M[35];
    sums->inertia[3] += M[22], sums->inertia[4] += M[23], sums->inertia[5] += M[29];
}

/* A static contact's rows that act: without friction the normal alone. */
static void add_static_rows(struct sadmm_context *c, const struct ref_constraint *constraint)
{
    const struct ref_side *side = &constraint->side[constraint->side[0].body < 0];
    double G[36];
    rigid_motion(c, side->body, G);
    for (int r = 0; r < (constraint->mu > 0 ? constraint->rows : 1); ++r) {
        double row[6] = {0};
        add_transposed(G, side->J + 6 * r, row);
        packed_add_row(island_of(c, constraint)->momentum.gram, row, 1);
    }
}

/* Islands that have contacts and no more, none of which is known to anchor them. */
static void find_floating(struct sadmm_context *c)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    for (int32_t i = 0; i < c->system->body_count; ++i) c->bodies[i].floating = false;
    for (size_t k = 0; k < contacts->point_count; ++k) island_of(c, &c->constraints[k])->floating = true;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        struct arm_sums arms = {0};
        if (sadmm_pair_rolls(pair, &contacts->points[pair->first]))
            island_of(c, &c->constraints[pair->first])->floating = false;
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
            add_arm(&arms, pair->body_a >= 0 ? contacts->points[k].arm_a : contacts->points[k].arm_b, 1);
        if ((pair->body_a < 0 || pair->body_b < 0) && momentum_is_anchored(pair->friction, &arms))
            island_of(c, &c->constraints[pair->first])->floating = false;
    }
    for (size_t k = contacts->point_count; k < c->constraint_count; ++k)
        island_of(c, &c->constraints[k])->floating = false;
}

void sadmm_ref_find_motions(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        memset(&c->bodies[i].momentum, 0, sizeof c->bodies[i].momentum);
        c->bodies[i].motions.count = 0;
    }
    find_floating(c);
    for (int32_t i = 0; i < c->system->body_count; ++i) add_body(c, i);
    for (size_t k = 0; k < c->constraint_count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        const int32_t a = constraint->side[0].body, b = constraint->side[1].body;
        if (a < 0 || b < 0) add_static_rows(c, constraint);
    }
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        if (body->label == i && body->floating) momentum_find_motions(&body->momentum, &body->motions);
    }
}

void sadmm_ref_move_island(struct sadmm_context *c, int32_t i, double factor)
{
    struct ref_body *body = &c->bodies[i];
    const struct ref_body *island = &c->bodies[body->label];
    double G[36], q[6], step[6];
    for (int j = 0; j < 6; ++j) body->v[j] *= factor;
    if (!island->floating) return;
    rigid_motion(c, i, G);
    momentum_restoring(&island->motions, factor, q);
    dense6_mul(G, q, step);
    for (int j = 0; j < 6; ++j) body->v[j] += step[j];
}
