/* G of the dense contact solve: how the contacts of an island, and its active rows, respond to each other. */
#include <math.h>
#include <string.h>

#include "ncp_island.h"
#include "ncp_variants.h"

void sadmm_ncp_number_nodes(struct island *s)
{
    int32_t first = 0;
    for (int32_t k = 0; k < s->parts; ++k) {
        s->d->first_node[k] = first;
        first += part_of(s, k)->tree.nodes;
    }
    s->d->first_node[s->parts] = first;
}

/* ---- by the sparse factor
 * ------------------------------------------------------------------------------------------ */

/* Rows of a part respond to impulses alone, from rest, in their present states. */
static void make_linear(const struct articulation_view *v)
{
    memset(v->velocity, 0, 6 * (size_t)v->s.bodies * sizeof *v->velocity);
    memset(v->residual, 0, 6 * (size_t)v->s.bodies * sizeof *v->residual);
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
        v->rows[r].bias = v->rows[r].lambda = v->change[r] = 0;
    }
}

/* A number's impulse 1 on its sides: a body's response. */
struct impulse_side {
    int32_t number;
    const double *row, *response;
};
static int sides_of(const struct island *s, int32_t number, struct impulse_side side[2])
{
    int sides = 0;
    if (number < 3 * s->contacts) {
        const struct ncp_contact *c = &s->d->contacts[number / 3];
        for (int k = 0; k < 2; ++k)
            if (c->body[k] >= 0)
                side[sides++] = (struct impulse_side){c->body[k], c->row[k][number % 3], c->response[k][number % 3]};
        return sides;
    }
    const struct ncp_active *active = &s->active_row[number - 3 * s->contacts];
    const struct articulation_view *v = &part_of(s, active->part)->view;
    for (int k = 0; k < 2; ++k) {
        const int32_t entry = v->s.side[2 * (active->r / SADMM_MAX_ROWS) + k];
        if (entry >= 0)
            side[sides++] = (struct impulse_side){s->d->number[v->s.body[entry]], v->rows[active->r].jacobian[k],
                                                  v->response + 12 * (size_t)active->r + 6 * k};
    }
    return sides;
}

static const double *change_of(const struct island *s, int32_t number)
{
    const struct ncp_body *body = &s->d->bodies[number];
    const int32_t part = s->articulations->part[body->body];
    return part < 0 ? body->dv
                    : s->articulations->parts[part].view.dv + 6 * (size_t)s->articulations->entry[body->body];
}

/* NULL: of a body without rows. */
static const struct articulation_view *view_of(const struct island *s, const struct impulse_side *side)
{
    const int32_t part = s->articulations->part[s->d->bodies[side->number].body];
    return part < 0 ? NULL : &s->articulations->parts[part].view;
}

/* Where it is put: of bodies with rows, the residual that these respond to. */
static double *change_at(const struct island *s, const struct impulse_side *side)
{
    struct ncp_body *body = &s->d->bodies[side->number];
    const struct articulation_view *v = view_of(s, side);
    return v ? v->residual + 6 * (size_t)s->articulations->entry[body->body] : body->dv;
}

/* The response to an impulse of 1: changes of the velocities of its bodies and of those that rows connect to them; of
 * others dv is 0, as before and after. */
static void respond(const struct island *s, const struct impulse_side side[2], int sides)
{
    for (int k = 0; k < sides; ++k) {
        double *to = change_at(s, &side[k]);
        for (int j = 0; j < 6; ++j) to[j] += side[k].response[j];
    }
    for (int k = 0; k < sides; ++k) {
        const struct articulation_view *v = view_of(s, &side[k]);
        if (!v || (k == 1 && view_of(s, &side[0]) == v)) continue;
        struct articulation_part *part =
            &s->articulations->parts[s->articulations->part[s->d->bodies[side[k].number].body]];
        /* With a refinement: along what rows resist, their regularisation is all there is. */
        sadmm_articulation_part_solve_rows(part, false);
        sadmm_articulation_part_solve_rows(part, true);
    }
}

static void take_back(const struct island *s, const struct impulse_side side[2], int sides)
{
    for (int k = 0; k < sides; ++k) {
        const struct articulation_view *v = view_of(s, &side[k]);
        memset(change_at(s, &side[k]), 0, 6 * sizeof(double));
        if (v) memset(v->dv, 0, 6 * (size_t)v->s.bodies * sizeof *v->dv);
    }
}

static void make_sparse_responses(struct island *s, double *G)
{
    const size_t n = (size_t)s->dense.size;
    int32_t columns = 0;
    for (int32_t k = 0; k < s->parts; ++k) columns += part_of(s, k)->view.s.columns;
    /* columns of G, solves of a part */
    s->dense.budget -= (double)n * (20 * (double)n + 1000 * columns / fmax(1, s->parts));
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        make_linear(v);
        memset(v->dv, 0, 6 * (size_t)v->s.bodies * sizeof *v->dv);
    }
    for (int32_t i = 0; i < s->bodies; ++i) memset(s->d->bodies[i].dv, 0, sizeof s->d->bodies[i].dv);
    for (int32_t i = 0; i < s->contacts; ++i) {
        struct ncp_contact *contact = &s->d->contacts[i];
        for (int side = 0; side < 2; ++side)
            for (int k = 0; contact->body[side] >= 0 && k < 3; ++k)
                ldl6_solve(sadmm_ncp_factor(s, contact->body[side]), contact->row[side][k], contact->response[side][k]);
    }
    for (size_t c = 0; c < n; ++c) {
        struct impulse_side by[2], on[2];
        const int sides = sides_of(s, (int32_t)c, by);
        respond(s, by, sides);
        for (size_t r = 0; r < n; ++r) {
            const int others = sides_of(s, (int32_t)r, on);
            double x = 0;
            for (int k = 0; k < others; ++k) x += six_product(on[k].row, change_of(s, on[k].number));
            G[r * n + c] = x;
        }
        take_back(s, by, sides);
    }
}

/* ---- of an island ------------------------------------------------------------------------------------------------ */

static bool are_trees(const struct island *s)
{
    for (int32_t k = 0; k < s->parts; ++k)
        if (!part_of(s, k)->by_tree) return false;
    return true;
}

/* An active row's velocities are its residuals: gain x + compliance lambda; contacts have their regularisation. */
static void finish_rows(const struct island *s, double *G)
{
    const size_t n = (size_t)s->dense.size, first = 3 * (size_t)s->contacts;
    for (size_t r = 0; r < first; ++r) G[r * n + r] += s->regularisation * s->d->laws[r / 3].response;
    for (size_t r = first; r < n; ++r) {
        const struct ncp_active *active = &s->active_row[r - first];
        const struct articulation_row *row = &part_of(s, active->part)->view.rows[active->r];
        for (size_t c = 0; c < n; ++c) G[r * n + c] *= row->gain;
        G[r * n + r] += row->compliance;
    }
}

void sadmm_ncp_find_responses(struct island *s, double *G)
{
    if (are_trees(s)) sadmm_ncp_kernels_best()->responses(s, G);
    else make_sparse_responses(s, G);
    finish_rows(s, G);
}
