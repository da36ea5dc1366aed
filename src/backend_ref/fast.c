/* The method `fast` (docs/internals/algorithm.md, "Method fast") written down plainly: a dense weight B a constraint,
 * C_i = sum J^T B J, and the relaxed iteration in (v, lambda). As the rest of this backend it takes nothing from the
 * fast ones: rows are those of the literal Jacobians, islands are found by passing labels on, inverses by dense
 * factors.
 *
 * u = -lambda is kept in the sides, where recover_wrenches reads it. */
#include <string.h>

#include "core/math/array3.h"
#include "core/math/dense6.h"
#include "core/math/contact.h"
#include "core/math/relax.h"
#include "core/math/row.h"
#include "core/math/weight.h"
#include "literal.h"

/* label of a body: the smallest one it is joined with. */
void sadmm_ref_label_islands(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->system->body_count; ++i) c->bodies[i].label = i;
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t k = 0; k < c->constraint_count; ++k) {
            int32_t a = c->constraints[k].side[0].body, b = c->constraints[k].side[1].body;
            if (a < 0 || b < 0) continue;
            int32_t *la = &c->bodies[a].label, *lb = &c->bodies[b].label;
            if (*la == *lb) continue;
            *la = *lb = *la < *lb ? *la : *lb;
            changed = true;
        }
    }
}

static double mass_of(const struct ref_body *body) { return (body->A[0] + body->A[7] + body->A[14]) / 3; }

/* x . A^-1 x */
static double inverse_form(const struct ref_body *body, const double x[6])
{
    double L[36], y[6];
    dense6_cholesky(body->A, L);
    dense6_forward(L, x, y);
    return dense6_dot(y, y);
}

/* J A^-1 J^T of a row. */
static double row_response(const struct sadmm_context *c, const struct ref_constraint *constraint, int r)
{
    double w = 0;
    for (int s = 0; s < 2; ++s) {
        const struct ref_side *side = &constraint->side[s];
        if (side->body >= 0) w += inverse_form(&c->bodies[side->body], side->J + 6 * r);
    }
    return w;
}

/* What a row's multiplier counts for in the load of its block, in N s of a push. */
static double row_scale(const struct sadmm_context *c, const struct ref_constraint *constraint, int r)
{
    double push = 0, inverse_mass = 0;
    for (int s = 0; s < 2; ++s) {
        const struct ref_side *side = &constraint->side[s];
        if (side->body < 0) continue;
        const double *J = side->J + 6 * r;
        push = fmax(push, length3(J));
        inverse_mass += 1 / mass_of(&c->bodies[side->body]);
    }
    return weight_row_scale(push, row_response(c, constraint, r), inverse_mass);
}

static struct ref_body *island_of(const struct sadmm_context *c, const struct ref_constraint *constraint)
{
    int32_t body = constraint->side[0].body >= 0 ? constraint->side[0].body : constraint->side[1].body;
    return &c->bodies[c->bodies[body].label];
}

/* Adds J^T lambda of a constraint's side to `impulse`. */
static void add_impulse(const struct ref_constraint *constraint, int side, double impulse[6])
{
    for (int r = 0; r < constraint->rows; ++r)
        for (int j = 0; j < 6; ++j) impulse[j] += constraint->side[side].J[6 * r + j] * constraint->lambda[r];
}

/* Sums over the bodies of every island, kept at the body that names it; `count` constraints from `first` on act as
 * one. */
static void add_up_group(struct sadmm_context *c, size_t first, size_t count)
{
    for (int s = 0; s < 2; ++s) {
        double impulse[6] = {0};
        int32_t body = c->constraints[first].side[s].body;
        if (body < 0) continue;
        for (size_t k = first; k < first + count; ++k) add_impulse(&c->constraints[k], s, impulse);
        for (int j = 0; j < 6; ++j) c->bodies[body].impulse[j] += impulse[j];
        c->bodies[c->bodies[body].label].sums.push += length3(impulse);
        const double share = c->constraints[first].side[1 - s].body >= 0 ? 0.5 : 1;
        c->bodies[c->bodies[body].label].balance += dense6_dot(impulse, impulse) > 0 ? share : -share;
    }
}

static void add_up_islands(struct sadmm_context *c)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        memset(&body->sums, 0, sizeof body->sums);
        body->balance = 0;
        memset(body->impulse, 0, sizeof body->impulse);
    }
    for (size_t p = 0; p < contacts->pair_count; ++p)
        add_up_group(c, (size_t)contacts->pairs[p].first, (size_t)contacts->pairs[p].count);
    for (size_t k = contacts->point_count; k < c->constraint_count; ++k) add_up_group(c, k, 1);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        const struct ref_body *body = &c->bodies[i];
        struct weight_sums *sums = &c->bodies[body->label].sums;
        double momentum[6];
        dense6_mul(body->A, body->v, momentum);
        sums->energy += inverse_form(body, body->impulse);
        sums->kinetic += dense6_dot(momentum, body->v);
        sums->mass += mass_of(body);
    }
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *island = &c->bodies[i];
        if (island->label != i) continue;
        if (c->weight_updates < 0)
            island->warm = plan_may_start_warm(c->plan, c->settings) && weight_starts_warm(island->balance);
        weight_update_speed(&island->weights, &island->sums,
                            weight_spring_iterations(island->warm, c->plan->rigid, c->settings->iterations));
    }
}

void sadmm_ref_sum_impulses(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->system->body_count; ++i) memset(c->bodies[i].impulse, 0, sizeof c->bodies[i].impulse);
    for (size_t k = 0; k < c->constraint_count; ++k)
        for (int s = 0; s < 2; ++s) {
            const int32_t body = c->constraints[k].side[s].body;
            if (body >= 0) add_impulse(&c->constraints[k], s, c->bodies[body].impulse);
        }
}

/* A v - b - sum J^T multiplier, by body, into `impulse`. */
static void momentum_residual(struct sadmm_context *c, bool seen)
{
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        dense6_mul(body->A, body->v, body->impulse);
        for (int j = 0; j < 6; ++j) body->impulse[j] -= body->b[j];
    }
    for (size_t k = 0; k < c->constraint_count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        const double *multiplier = seen ? constraint->seen : constraint->lambda;
        for (int s = 0; s < 2; ++s) {
            const struct ref_side *side = &constraint->side[s];
            if (side->body < 0) continue;
            for (int r = 0; r < constraint->rows; ++r)
                for (int j = 0; j < 6; ++j) c->bodies[side->body].impulse[j] -= side->J[6 * r + j] * multiplier[r];
        }
    }
}

/* x + e of every row. */
static void slip(const struct sadmm_context *c, const struct ref_constraint *constraint, double u[6])
{
    for (int r = 0; r < constraint->rows; ++r) u[r] = constraint->e[r] + (r < 3 ? constraint->kinematic[r] : 0);
    for (int s = 0; s < 2; ++s) {
        const struct ref_side *side = &constraint->side[s];
        if (side->body < 0) continue;
        for (int r = 0; r < constraint->rows; ++r) u[r] += dense6_dot(side->J + 6 * r, c->bodies[side->body].v);
    }
}

/* Mean response of a pair's rows. */
static double pair_response(const struct sadmm_context *c, const struct sadmm_contact_pair *pair)
{
    double w = 0;
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
        for (int r = 0; r < c->constraints[k].rows; ++r)
            w += row_response(c, &c->constraints[k], r) / c->constraints[k].rows;
    return w / pair->count;
}

/* sum w |lambda - Pi_C(lambda - (x + e n)/w)|^2 over the points of a pair. */
static double pair_violation(const struct sadmm_context *c, const struct sadmm_contact_pair *pair)
{
    double w = pair_response(c, pair), sum = 0;
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        double u[6] = {0}, residual[3];
        slip(c, constraint, u);
        contact_residual_rows(constraint->lambda, u, constraint->mu, w, residual);
        for (int r = 0; r < constraint->rows; ++r) sum += w * residual[r] * residual[r];
    }
    return sum;
}

void sadmm_ref_momentum_residual(struct sadmm_context *c) { momentum_residual(c, false); }

static void update_weight_scales(struct sadmm_context *c)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    momentum_residual(c, false);
    for (int32_t i = 0; i < c->system->body_count; ++i)
        c->bodies[c->bodies[i].label].sums.momentum_residual += inverse_form(&c->bodies[i], c->bodies[i].impulse);
    for (size_t p = 0; p < contacts->pair_count; ++p)
        island_of(c, &c->constraints[contacts->pairs[p].first])->sums.violation +=
            pair_violation(c, &contacts->pairs[p]);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *island = &c->bodies[i];
        if (island->label == i && !island->rows && !island->warm)
            island->scale_weights = weight_update_scale(&island->weights, &island->sums);
    }
}

/* Constraints of a body: pairs, and those given by rows. */
static int constraints_of(const struct sadmm_context *c, int32_t body)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    int count = 0;
    for (size_t p = 0; p < contacts->pair_count; ++p)
        count += contacts->pairs[p].body_a == body || contacts->pairs[p].body_b == body;
    for (size_t k = contacts->point_count; k < c->constraint_count; ++k)
        count += c->constraints[k].side[0].body == body || c->constraints[k].side[1].body == body;
    return count;
}

static double most_of(const struct sadmm_context *c, const struct sadmm_contact_pair *pair)
{
    const int32_t bodies[2] = {pair->body_a, pair->body_b};
    double mass[2] = {0, 0};
    int constraints[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
        if (bodies[side] < 0) continue;
        constraints[side] = constraints_of(c, bodies[side]);
        mass[side] = mass_of(&c->bodies[bodies[side]]);
    }
    return weight_most(constraints, mass, pair->count);
}

/* The points of a pair share one weight: mean load, mean response. */
static void weigh_pair(struct sadmm_context *c, const struct sadmm_contact_pair *pair)
{
    double load = 0;
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct ref_constraint *constraint = &c->constraints[k];
        double lambda2 = 0;
        for (int r = 0; r < constraint->rows; ++r) lambda2 += constraint->lambda[r] * constraint->lambda[r];
        load += sqrt(lambda2);
    }
    const struct ref_body *island = island_of(c, &c->constraints[pair->first]);
    double B = island->scale_weights > 0
                   ? c->constraints[pair->first].B[0] * island->scale_weights
                   : weight_of_pair(&island->weights, load / pair->count, most_of(c, pair), pair_response(c, pair));
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        struct ref_constraint *constraint = &c->constraints[k];
        memset(constraint->B, 0, sizeof constraint->B);
        for (int r = 0; r < constraint->rows; ++r) constraint->B[7 * r] = B;
    }
}

/* share lambda lambda^T + phi / w: of the rows that may be coupled in full, of others the diagonal, of a contact a
 * scalar. */
static void weigh_constraint(struct sadmm_context *c, struct ref_constraint *constraint)
{
    const double *lambda = constraint->lambda;
    struct weight_row_sums sums = {0};
    double w[6];
    for (int r = 0; r < constraint->rows; ++r) {
        w[r] = row_response(c, constraint, r);
        weight_add_row(&sums, lambda[r], row_scale(c, constraint, r), w[r], constraint->rows);
    }
    double share = weight_share(&island_of(c, constraint)->weights, sums.load2);
    memset(constraint->B, 0, sizeof constraint->B);
    for (int r = 0; r < constraint->rows; ++r) {
        bool coupled = !constraint->cone && constraint->coupled[r];
        for (int q = 0; q < constraint->rows && coupled; ++q)
            if (constraint->coupled[q]) constraint->B[6 * r + q] = share * lambda[r] * lambda[q];
        const struct weight_law law = {constraint->cone,          coupled,           constraint->gain[r],
                                       constraint->compliance[r], constraint->lo[r], constraint->hi[r],
                                       weight_row_floor(c->plan->rigid, c->settings->iterations)};
        constraint->B[7 * r] += weight_of_row(&sums, share, &law, lambda[r], w[r]).weight;
    }
}

/* C_i += J^T B J */
static void add_to_C(struct sadmm_context *c, const struct ref_constraint *constraint, const struct ref_side *side)
{
    double *C = c->bodies[side->body].C;
    for (int r = 0; r < constraint->rows; ++r)
        for (int q = 0; q < constraint->rows; ++q)
            for (int i = 0; i < 6; ++i)
                for (int j = 0; j < 6; ++j)
                    C[6 * i + j] += side->J[6 * r + i] * constraint->B[6 * r + q] * side->J[6 * q + j];
}

/* Weights and C of the islands that started cold; at first of all. */
sadmm_status sadmm_ref_update_weights(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    const size_t points = c->system->contacts->point_count;
    const bool first = c->weight_updates < 0;
    add_up_islands(c);
    if (++c->weight_updates >= WEIGHT_FIRST_SCALE) update_weight_scales(c);
    for (size_t p = 0; p < c->system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[p];
        if (first || !island_of(c, &c->constraints[pair->first])->warm) weigh_pair(c, pair);
    }
    for (size_t k = 0; k < points && first && c->plan->rigid; ++k) {
        struct ref_constraint *contact = &c->constraints[k];
        contact->e[0] = weight_separation_error(contact->e[0], island_of(c, contact)->weights.separation_share,
                                                c->settings->slop / c->settings->dt);
    }
    for (size_t k = points; k < c->constraint_count; ++k)
        if (first || !island_of(c, &c->constraints[k])->warm) weigh_constraint(c, &c->constraints[k]);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        memset(c->bodies[i].C, 0, sizeof c->bodies[i].C);
        c->bodies[i].beta = 1;
    }
    for (size_t k = 0; k < c->constraint_count; ++k) {
        struct ref_constraint *constraint = &c->constraints[k];
        memcpy(constraint->seen, constraint->lambda, sizeof constraint->seen);
        for (int s = 0; s < 2; ++s)
            if (constraint->side[s].body >= 0) add_to_C(c, constraint, &constraint->side[s]);
    }
    return SADMM_OK;
}

sadmm_status sadmm_ref_init_weights(struct sadmm_context *c, struct sadmm_error *error)
{
    sadmm_ref_label_islands(c);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        c->bodies[i].weights = weight_new_island();
        c->bodies[i].scale_weights = 0;
        c->bodies[i].rows = false;
    }
    for (size_t k = c->system->contacts->point_count; k < c->constraint_count; ++k)
        island_of(c, &c->constraints[k])->rows = true;
    c->weight_updates = -1; /* the first weights are none */
    c->step1_done = false;
    return sadmm_ref_update_weights(c, error);
}

/* v^ = v + (A + C)^-1 (b - A v + sum J^T (2 lambda^ - lambda)). cold: of islands that start so, for `relaxation`. */
static void step_velocity(struct sadmm_context *c, double relaxation, double cold)
{
    momentum_residual(c, true);
    for (int32_t i = 0; i < c->system->body_count; ++i) {
        struct ref_body *body = &c->bodies[i];
        double step[6];
        dense6_solve(body->factor, body->impulse, step);
        const double factor = c->bodies[body->label].warm ? relaxation : cold;
        for (int j = 0; j < 6; ++j) body->v[j] -= factor * step[j];
    }
}

/* lambda^ = Pi_C( lambda - B (x + e) / n ), n the number of dynamic bodies; of scalar rows the law of math/row.h. */
static void solve_multiplier(const struct sadmm_context *c, const struct ref_constraint *constraint, double out[6])
{
    double x[6] = {0}, n = 0;
    for (int s = 0; s < 2; ++s) {
        const struct ref_side *side = &constraint->side[s];
        if (side->body < 0) continue;
        n += 1;
        for (int r = 0; r < constraint->rows; ++r) x[r] += dense6_dot(side->J + 6 * r, c->bodies[side->body].v);
    }
    memset(out, 0, 6 * sizeof *out);
    if (constraint->cone) {
        double candidate[3] = {0, 0, 0}, projected[3];
        for (int r = 0; r < constraint->rows; ++r)
            candidate[r] = constraint->lambda[r] -
                           constraint->B[7 * r] * (x[r] + constraint->kinematic[r] + constraint->e[r]) / n;
        contact_project_rows(candidate, constraint->mu, projected);
        memcpy(out, projected, (size_t)constraint->rows * sizeof *out);
        return;
    }
    for (int r = 0; r < constraint->rows; ++r) {
        double step = 0;
        if (constraint->free_row[r]) continue;
        if (constraint->coupled[r])
            for (int q = 0; q < constraint->rows; ++q)
                step += constraint->B[6 * r + q] * (x[q] + constraint->e[q]) / n;
        else
            step = row_residual(constraint->gain[r], constraint->e[r], constraint->compliance[r], x[r],
                                constraint->lambda[r]) /
                   (constraint->compliance[r] + constraint->gain[r] * n / constraint->B[7 * r]);
        out[r] = fmin(fmax(constraint->lambda[r] - step, constraint->lo[r]), constraint->hi[r]);
    }
}

static void step_multipliers(struct sadmm_context *c, double relaxation, double cold)
{
    c->primal = 0;
    for (size_t k = 0; k < c->constraint_count; ++k) {
        struct ref_constraint *constraint = &c->constraints[k];
        const double factor = island_of(c, constraint)->warm ? relaxation : cold;
        double solved[6];
        solve_multiplier(c, constraint, solved);
        for (int r = 0; r < constraint->rows; ++r) {
            double change = solved[r] - constraint->lambda[r], B = constraint->B[7 * r];
            if (B > 0) c->primal = fmax(c->primal, fabs(change) / B);
            constraint->seen[r] = solved[r] + change;
            constraint->lambda[r] += factor * change;
            for (int s = 0; s < 2; ++s)
                if (constraint->side[s].body >= 0) constraint->side[s].u[r] = -constraint->lambda[r];
        }
    }
}

sadmm_status sadmm_ref_iterate_fast(struct sadmm_context *c, int count, bool goes_on)
{
    const double relaxation = c->settings->relaxation;
    const int batch = goes_on ? count + 1 : count;
    for (int i = 0; i < count; ++i) {
        step_multipliers(c, relax_constraints(i, batch) ? relaxation : 1, relax_constraints(i, count) ? relaxation : 1);
        step_velocity(c, relax_velocity(i, batch, c->step1_done) ? relaxation : 1,
                      relax_velocity(i, count, c->step1_done) ? relaxation : 1);
        c->step1_done = true;
    }
    return SADMM_OK;
}

sadmm_status sadmm_ref_measure_fast(struct sadmm_context *c, struct sadmm_residual *residual)
{
    momentum_residual(c, false);
    residual->primal = c->primal;
    residual->dual = 0;
    for (int32_t i = 0; i < c->system->body_count; ++i)
        for (int j = 0; j < 6; ++j) residual->dual = fmax(residual->dual, fabs(c->bodies[i].impulse[j]));
    return SADMM_OK;
}
