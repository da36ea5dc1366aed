#include "ncp.h"

#include <math.h>
#include <string.h>

#include "articulation_part.h"
#include "core/base/memory.h"
#include "core/model/islands.h"
#include "core/model/system_math.h"
#include "ncp_newton.h"

/* m/s: what is left alone, of the natural map and of the momentum residual; the aim; that of Newton's steps, which
 * solve for the rows in their states. */
static const double ENOUGH = 1e-9, AIM = 1e-10, NEWTON_AIM = 1e-13;
/* m/s: regularisation of contacts in G, that of the one with the largest load, others in proportion: of all impulses
 * that are solutions the least are found. Else a car stands on two wheels across, and which two changes from step to
 * step. */
static const double REGULARISATION = 3e-12;
/* Multiplications for an island, so that one that does not come to an end takes some 10 ms. */
static const double BUDGET = 4e7;
/* Active rows, solved for together with the contacts, since they changed their states; how often it goes from contacts
 * to rows and back, in all and without coming nearer though no row changed; and passes of the inner rows. */
enum { MOST_ACTIVE = 96, MOST_ROUNDS = 40, MOST_IDLE = 4, MOST_PASSES = 6 };

struct ncp_contact {
    int32_t pair, point;
    int32_t body[2];           /* of the island; -1: not one that is solved for */
    double e;
    double row[2][3][6], response[2][3][6]; /* J, A^-1 J^T of either side: normal, tangents */
    double given[3];           /* velocity of what is not solved for */
};

/* An active row, solved for with the contacts: r of a part of the island. */
struct ncp_active {
    int32_t part, r;
};

struct ncp_body {
    int32_t body;              /* of the system */
    double factor[36], b[6];
    double velocity[6], dv[6]; /* by the impulses so far; by one of them */
};

struct sadmm_ncp {
    /* bodies of the system: island, number in it, the next one of it; islands, by their first body: */
    int32_t *label, *number, *next_body;
    int32_t *points, *first_pair; /* how many points; its pairs */
    uint8_t *kind;             /* bits of enum island_kind */
    int32_t *next_pair;
    /* one island: */
    struct ncp_body *bodies;
    struct ncp_contact *contacts;
    struct ncp_law *laws;
    int32_t *parts;            /* of the articulations */
    double *numbers;           /* lambda, u, G, Newton's work; the best */
    double *rows;              /* multipliers of the system's rows, the best */
    uint8_t *states;           /* SADMM_MAX_ROWS a column, of the parts one after the other: those that G is for */
    size_t label_capacity, number_capacity, body_list_capacity, points_capacity, first_capacity, kind_capacity,
        pair_list_capacity, body_capacity, contact_capacity, law_capacity, part_capacity, numbers_capacity, row_capacity,
        state_capacity;
};

enum island_kind { ISLAND_ARTICULATED = 1, ISLAND_LEFT = 2 };

/* The island that is solved. */
struct island {
    struct sadmm_ncp *d;
    struct sadmm_articulations *articulations;
    const struct sadmm_system *system;
    const struct sadmm_row_constraint *slots;
    const struct sadmm_settings *settings;
    int32_t bodies, contacts, parts, active;
    struct ncp_active active_row[MOST_ACTIVE];
    struct ncp_dense dense;
    double *best_lambda, *best_velocity; /* contacts x 3; bodies x 6 */
    double best;                         /* natural map, m/s */
    double regularisation;               /* of contacts, a share of their response */
};

struct sadmm_ncp *sadmm_ncp_create(void)
{
    return (struct sadmm_ncp *)sadmm_alloc(1, sizeof(struct sadmm_ncp));
}

void sadmm_ncp_destroy(struct sadmm_ncp *d)
{
    if (!d) return;
    void *blocks[] = {d->label,  d->number,   d->next_body, d->points, d->first_pair, d->kind, d->next_pair,
                      d->bodies, d->contacts, d->laws,      d->parts,  d->numbers,    d->rows, d->states};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    sadmm_free(d);
}

/* ---- an island's contacts and bodies ------------------------------------------------------------------------------ */

static void add_body(struct island *s, int32_t i)
{
    struct ncp_body *body = &s->d->bodies[s->bodies];
    double A[36];
    body->body = i;
    sadmm_system_body(s->system, s->settings, i, A, body->b);
    ldl6_factor(A, body->factor);
    memcpy(body->velocity, s->system->velocity + 6 * (size_t)i, sizeof body->velocity);
    s->d->number[i] = s->bodies++;
    const int32_t part = s->articulations->part[i];
    if (part < 0 || s->articulations->entry[i] != 0) return;
    s->d->parts[s->parts++] = part;
}

static void add_contact(struct island *s, int32_t p, int32_t k)
{
    const struct sadmm_system *system = s->system;
    const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
    const struct sadmm_contact_point *points = &system->contacts->points[pair->first];
    struct ncp_contact *c = &s->d->contacts[s->contacts];
    struct ncp_law *law = &s->d->laws[s->contacts];
    const mat3 frame = sadmm_contact_frame(pair->normal);
    const vec3 impulse = m3_mul(frame, v3_load(points[k].impulse)),
               kinematic = m3_mul(frame, sadmm_kinematic_part(system, pair, &points[k]));
    c->pair = p, c->point = pair->first + k;
    c->e = sadmm_contact_e(system, s->settings, pair, points, k);
    v3_store(kinematic, c->given);
    *law = (struct ncp_law){.first = 3 * s->contacts, .count = 3, .friction = pair->friction};
    v3_store(impulse, s->dense.lambda + law->first);
    for (int side = 0; side < 2; ++side) {
        const int32_t body = side ? pair->body_b : pair->body_a;
        c->body[side] = body >= 0 ? s->d->number[body] : -1;
    }
    for (int i = 0; i < 3; ++i) {
        double response = 0;
        for (int side = 0; side < 2; ++side) {
            sadmm_contact_row(frame.r[i], side ? points[k].arm_b : points[k].arm_a, side ? 1 : -1, c->row[side][i]);
            if (c->body[side] < 0) continue;
            ldl6_solve(s->d->bodies[c->body[side]].factor, c->row[side][i], c->response[side][i]);
            response += six_product(c->row[side][i], c->response[side][i]);
        }
        if (i == 0 || pair->friction > 0) law->response = response > law->response ? response : law->response;
    }
    ++s->contacts;
}

/* x + e of the contacts by the bodies' velocities. */
static void find_contact_velocities(struct island *s)
{
    for (int32_t i = 0; i < s->contacts; ++i) {
        const struct ncp_contact *c = &s->d->contacts[i];
        for (int k = 0; k < 3; ++k) {
            double x = c->given[k] + (k == 0 ? c->e : 0);
            for (int side = 0; side < 2; ++side)
                if (c->body[side] >= 0) x += six_product(c->row[side][k], s->d->bodies[c->body[side]].velocity);
            s->dense.u[3 * i + k] = x;
        }
    }
}

/* ---- what the iterations have left -------------------------------------------------------------------------------- */

static void add_row_loads(struct island *s, const struct articulation_view *v)
{
    const struct sadmm_rows *rows = s->system->rows;
    EACH_ARTICULATION_ROW(s->slots, v, r, from) {
        for (int side = 0; side < 2; ++side) {
            const int32_t entry = v->s.side[2 * (r / SADMM_MAX_ROWS) + side];
            const double *row = (side ? rows->jacobian_b : rows->jacobian_a) + 6 * (size_t)from;
            double *to = entry >= 0 ? s->d->bodies[s->d->number[v->s.body[entry]]].dv : NULL;
            for (int k = 0; to && k < 6; ++k) to[k] += row[k] * rows->lambda[from];
        }
    }
}

/* Loads of the contacts on bodies, to dv. */
static void add_contact_loads(struct island *s)
{
    for (int32_t i = 0; i < s->contacts; ++i) {
        const struct ncp_contact *c = &s->d->contacts[i];
        for (int side = 0; side < 2; ++side)
            for (int k = 0; c->body[side] >= 0 && k < 3; ++k)
                for (int j = 0; j < 6; ++j)
                    s->d->bodies[c->body[side]].dv[j] += c->row[side][k][j] * s->dense.lambda[3 * i + k];
    }
}

/* The residual of the momentum, by velocities: m/s or rad/s. */
static double momentum_residual(struct island *s)
{
    double most = 0, owed[6];
    for (int32_t n = 0; n < s->bodies; ++n) memcpy(s->d->bodies[n].dv, s->d->bodies[n].b, 6 * sizeof(double));
    add_contact_loads(s);
    for (int32_t k = 0; k < s->parts; ++k) add_row_loads(s, &s->articulations->parts[s->d->parts[k]].view);
    for (int32_t n = 0; n < s->bodies; ++n) {
        const struct ncp_body *body = &s->d->bodies[n];
        ldl6_solve(body->factor, body->dv, owed);
        for (int k = 0; k < 6; ++k) most = fmax(most, fabs(body->velocity[k] - owed[k]));
    }
    return most;
}

/* ---- velocities and rows for given impulses ----------------------------------------------------------------------- */

static struct articulation_part *part_of(const struct island *s, int32_t k)
{
    return &s->articulations->parts[s->d->parts[k]];
}

/* To single bodies with what acts on them besides, to parts alone: they add the rest when they are loaded. */
static void put_loads(struct island *s)
{
    for (int32_t n = 0; n < s->bodies; ++n) {
        struct ncp_body *body = &s->d->bodies[n];
        if (s->articulations->part[body->body] < 0) memcpy(body->dv, body->b, sizeof body->dv);
        else memset(body->dv, 0, sizeof body->dv);
    }
    add_contact_loads(s);
    for (int32_t k = 0; k < s->parts; ++k) {
        struct articulation_part *part = part_of(s, k);
        for (int32_t e = 0; e < part->view.s.bodies; ++e)
            memcpy(part->impulse + 6 * (size_t)e, s->d->bodies[s->d->number[part->view.s.body[e]]].dv, 6 * sizeof(double));
    }
}

/* Their multipliers are fixed for the inner rows, whatever their laws say. */
static void fix_active(const struct island *s, int32_t part)
{
    for (int32_t i = 0; i < s->active; ++i) {
        if (s->active_row[i].part != part) continue;
        struct articulation_row *row = &part_of(s, part)->view.rows[s->active_row[i].r];
        row->lo = row->hi = s->dense.lambda[3 * s->contacts + i];
    }
}

static void find_active_residuals(struct island *s)
{
    for (int32_t i = 0; i < s->active; ++i)
        s->dense.u[3 * s->contacts + i] =
            articulation_row_residual(&part_of(s, s->active_row[i].part)->view, s->active_row[i].r, true, true);
}

/* Velocities, inner rows and u for the impulses of the contacts and of active rows. states: where rows were, and are
 * then. False: some inner rows are not solved, and u is not that of their impulses. */
static bool solve_for_impulses(struct island *s, uint8_t *states)
{
    bool solved = true;
    put_loads(s);
    for (int32_t k = 0; k < s->parts; ++k) {
        struct articulation_part *part = part_of(s, k);
        const struct articulation_view *v = &part->view;
        const size_t rows = (size_t)(SADMM_MAX_ROWS * v->s.columns);
        sadmm_articulation_part_load(part, s->system, s->settings, s->slots);
        fix_active(s, k);
        solved = sadmm_articulation_part_solve(v, states, true) && solved;
        memcpy(states, v->state, rows);
        states += rows;
        for (int32_t e = 0; e < v->s.bodies; ++e) {
            double *velocity = s->d->bodies[s->d->number[v->s.body[e]]].velocity;
            for (int j = 0; j < 6; ++j) velocity[j] = v->velocity[6 * e + j] + v->dv[6 * e + j];
        }
    }
    for (int32_t n = 0; n < s->bodies; ++n) {
        struct ncp_body *body = &s->d->bodies[n];
        if (s->articulations->part[body->body] < 0) ldl6_solve(body->factor, body->dv, body->velocity);
    }
    find_contact_velocities(s);
    find_active_residuals(s);
    return solved;
}

/* Where the rows' own solve has left them. */
static void take_states(const struct island *s, uint8_t *states)
{
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        memcpy(states, v->state, (size_t)(SADMM_MAX_ROWS * v->s.columns));
        states += SADMM_MAX_ROWS * v->s.columns;
    }
}

/* Rows that changed their states become active, or all with bounds. False: too many. */
static bool activate(struct island *s, const uint8_t *before, const uint8_t *after, bool all, bool *any)
{
    *any = false;
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
            const bool bounded = v->rows[r].lo > -HUGE_VAL || v->rows[r].hi < HUGE_VAL;
            if (after[r] == ROW_FIXED || after[r] == ROW_ABSENT) continue;
            if (before[r] == after[r] && !(all && bounded)) continue;
            if (s->active == MOST_ACTIVE) return false;
            const int32_t number = 3 * s->contacts + s->active;
            s->active_row[s->active] = (struct ncp_active){k, r};
            s->d->laws[s->contacts + s->active] = (struct ncp_law){
                .first = number, .count = 1, .lo = v->rows[r].lo, .hi = v->rows[r].hi,
                .response = v->rows[r].gain * articulation_scale(v, r) + v->rows[r].compliance};
            s->dense.lambda[number] = articulation_bounded(v, r);
            s->dense.u[number] = articulation_row_residual(v, r, true, true);
            ++s->active;
            *any = true;
        }
        before += SADMM_MAX_ROWS * v->s.columns;
        after += SADMM_MAX_ROWS * v->s.columns;
    }
    s->dense.laws = s->contacts + s->active;
    s->dense.size = 3 * s->contacts + s->active;
    return true;
}

/* ---- G ------------------------------------------------------------------------------------------------------------ */

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
        /* With a refinement: along what rows resist, their regularisation is all there is. */
        sadmm_articulation_part_solve_rows(v, false);
        sadmm_articulation_part_solve_rows(v, true);
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

static void make_responses(struct island *s, double *G)
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
    for (size_t c = 0; c < n; ++c) {
        struct impulse_side by[2], on[2];
        const int sides = sides_of(s, (int32_t)c, by);
        respond(s, by, sides);
        for (size_t r = 0; r < n; ++r) {
            const int others = sides_of(s, (int32_t)r, on);
            double x = 0;
            for (int k = 0; k < others; ++k) x += six_product(on[k].row, change_of(s, on[k].number));
            if (r >= 3 * (size_t)s->contacts) {
                const struct ncp_active *active = &s->active_row[r - 3 * (size_t)s->contacts];
                const struct articulation_row *row = &part_of(s, active->part)->view.rows[active->r];
                x = row->gain * x + (r == c ? row->compliance : 0);
            }
            if (r == c && r < 3 * (size_t)s->contacts) x += s->regularisation * s->d->laws[r / 3].response;
            G[r * n + c] = x;
        }
        take_back(s, by, sides);
    }
}

/* ---- the search --------------------------------------------------------------------------------------------------- */

static void keep_best(struct island *s)
{
    const double map = ncp_natural_map(&s->dense);
    if (!(map < s->best)) return;
    s->best = map;
    memcpy(s->best_lambda, s->dense.lambda, 3 * (size_t)s->contacts * sizeof *s->best_lambda);
    for (int32_t n = 0; n < s->bodies; ++n)
        memcpy(s->best_velocity + 6 * (size_t)n, s->d->bodies[n].velocity, 6 * sizeof(double));
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        EACH_ARTICULATION_ROW(s->slots, v, r, from) s->d->rows[from] = articulation_bounded(v, r);
    }
}

/* Velocities and inner rows for the impulses as they are, where rows that change their states become active, until none
 * does: all of them, where they cycle. changed: is set where G is no longer right. False: inner rows are not solved. */
static bool solve_inner_rows(struct island *s, uint8_t *states, uint8_t *next, size_t rows, bool *changed)
{
    for (int pass = 0; pass < MOST_PASSES; ++pass) {
        bool active = false;
        memcpy(next, states, rows);
        const bool solved = solve_for_impulses(s, next);
        if (solved) keep_best(s);
        if (!activate(s, states, next, false, &active)) return false;
        if (!active && !solved && !activate(s, states, next, true, &active)) return false;
        if (!active) return solved;
        memcpy(states, next, rows);
        *changed = true;
    }
    return false;
}

static void find_regularisation(struct island *s)
{
    double most = 0;
    for (int32_t n = 0; n < 3 * s->contacts; ++n)
        most = fmax(most, s->d->laws[n / 3].response * fabs(s->dense.lambda[n]));
    s->regularisation = REGULARISATION < most ? REGULARISATION / most : 0;
}

/* The regularisation of the matrix is in their velocities, too. */
static void add_regularisation(struct island *s)
{
    for (int32_t n = 0; n < 3 * s->contacts; ++n)
        s->dense.u[n] += s->regularisation * s->d->laws[n / 3].response * s->dense.lambda[n];
}

static void search(struct island *s, double *G, uint8_t *states, uint8_t *next, size_t rows)
{
    bool changed = true;
    take_states(s, states);
    find_regularisation(s);
    if (!solve_inner_rows(s, states, next, rows, &changed)) return;
    for (int round = 0, idle = 0;
         round < MOST_ROUNDS && idle < MOST_IDLE && s->best > AIM && s->dense.budget > 0; ++round) {
        const double last = s->best;
        if (changed) make_responses(s, G);
        changed = false;
        add_regularisation(s);
        ncp_newton(&s->dense, NEWTON_AIM);
        if (!solve_inner_rows(s, states, next, rows, &changed)) return;
        if (!changed && s->best > last / 2) return; /* what is left is rounding */
        idle = !changed && s->best > 0.9 * last ? idle + 1 : 0;
    }
}

static void store_best(const struct island *s)
{
    struct sadmm_contact_set *contacts = s->system->contacts;
    for (int32_t i = 0; i < s->contacts; ++i) {
        const struct ncp_contact *c = &s->d->contacts[i];
        const double *lambda = s->best_lambda + 3 * (size_t)i;
        const mat3 frame = sadmm_contact_frame(contacts->pairs[c->pair].normal);
        const vec3 normal = v3_scale(frame.r[0], lambda[0]);
        v3_store(v3_madd(v3_madd(normal, lambda[1], frame.r[1]), lambda[2], frame.r[2]),
                 contacts->points[c->point].impulse);
    }
    for (int32_t n = 0; n < s->bodies; ++n)
        memcpy(s->system->velocity + 6 * (size_t)s->d->bodies[n].body, s->best_velocity + 6 * (size_t)n,
               6 * sizeof(double));
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        EACH_ARTICULATION_ROW(s->slots, v, r, from) {
            s->system->rows->lambda[from] = s->d->rows[from];
            (void)r;
        }
    }
}

/* ---- all islands -------------------------------------------------------------------------------------------------- */

static int32_t island_of(const struct sadmm_ncp *d, int32_t body_a, int32_t body_b)
{
    return d->label[body_a >= 0 ? body_a : body_b];
}

/* Lists by island, ascending: its bodies from the first one, which is its label, its pairs. Last ones are kept meanwhile
 * in `number` and `points`. */
static void list_islands(struct sadmm_ncp *d, const struct sadmm_system *system)
{
    const struct sadmm_contact_set *contacts = system->contacts;
    for (int32_t i = 0; i < system->body_count; ++i) {
        const int32_t label = d->label[i];
        d->next_body[i] = d->first_pair[i] = -1;
        if (label != i) d->next_body[d->number[label]] = i;
        d->number[label] = i;
    }
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const int32_t label = island_of(d, contacts->pairs[p].body_a, contacts->pairs[p].body_b);
        d->next_pair[p] = -1;
        if (d->first_pair[label] < 0) d->first_pair[label] = (int32_t)p;
        else d->next_pair[d->points[label]] = (int32_t)p;
        d->points[label] = (int32_t)p;
    }
}

/* What is known of them: how many points they have, and whether they are whole parts with rows and nothing else has rows.
 * Constraints may be left out of parts (articulation.h), and parts be connected by constraints that have no rows at the
 * time: a slack rope. Such islands are left to the iteration. Rows without a part are counted in `number`. */
static void describe_islands(struct sadmm_ncp *d, const struct sadmm_articulations *articulations,
                             const struct sadmm_system *system, const struct sadmm_row_constraint *slots)
{
    const struct sadmm_contact_set *contacts = system->contacts;
    const size_t n = (size_t)system->body_count;
    memset(d->points, 0, n * sizeof *d->points);
    memset(d->number, 0, n * sizeof *d->number);
    memset(d->kind, 0, n);
    for (size_t p = 0; p < contacts->pair_count; ++p)
        d->points[island_of(d, contacts->pairs[p].body_a, contacts->pairs[p].body_b)] += contacts->pairs[p].count;
    for (size_t k = 0; k < system->rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &system->rows->constraints[k];
        if (constraint->body_a >= 0 || constraint->body_b >= 0)
            d->number[island_of(d, constraint->body_a, constraint->body_b)] += constraint->count;
    }
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        const struct articulation_structure *s = &articulations->parts[k].view.s;
        const int32_t label = d->label[s->body[0]];
        if (d->number[label] > 0) d->kind[label] |= ISLAND_ARTICULATED;
        for (int32_t e = 1; e < s->bodies; ++e)
            if (d->label[s->body[e]] != label) d->kind[label] |= ISLAND_LEFT, d->kind[d->label[s->body[e]]] |= ISLAND_LEFT;
        for (int32_t p = 0; p < s->columns; ++p) d->number[label] -= slots[s->constraint[p]].count;
    }
    for (size_t i = 0; i < n; ++i)
        if (d->number[i] != 0) d->kind[i] |= ISLAND_LEFT;
}

static bool is_taken(const struct sadmm_ncp *d, int32_t label, const struct sadmm_settings *settings)
{
    return d->kind[label] == ISLAND_ARTICULATED && d->points[label] > 0 && d->points[label] <= settings->ncp_points;
}

/* Room for any of them. */
static bool make_room(struct sadmm_ncp *d, const struct sadmm_articulations *articulations,
                      const struct sadmm_system *system, const struct sadmm_settings *settings)
{
    const size_t n = (size_t)system->body_count;
    size_t points = 0, states = 0;
    for (size_t i = 0; i < n; ++i)
        if (is_taken(d, (int32_t)i, settings) && (size_t)d->points[i] > points) points = (size_t)d->points[i];
    for (int32_t k = 0; k < articulations->order.parts; ++k)
        states += (size_t)(SADMM_MAX_ROWS * articulations->parts[k].view.s.columns);
    const size_t size = 3 * points + MOST_ACTIVE;
    return sadmm_grow_empty(&d->bodies, &d->body_capacity, n, sizeof *d->bodies) &&
           sadmm_grow_empty(&d->contacts, &d->contact_capacity, points, sizeof *d->contacts) &&
           sadmm_grow_empty(&d->laws, &d->law_capacity, points + MOST_ACTIVE, sizeof *d->laws) &&
           sadmm_grow_empty(&d->parts, &d->part_capacity, (size_t)articulations->order.parts, sizeof *d->parts) &&
           sadmm_grow_empty(&d->numbers, &d->numbers_capacity,
                            3 * size + size * size + ncp_work_size(size) + 6 * n, sizeof *d->numbers) &&
           sadmm_grow_empty(&d->rows, &d->row_capacity, system->rows->row_count, sizeof *d->rows) &&
           sadmm_grow_empty(&d->states, &d->state_capacity, 2 * states, sizeof *d->states);
}

static bool solve_island(struct island *s, int32_t label)
{
    struct sadmm_ncp *d = s->d;
    const struct sadmm_contact_set *contacts = s->system->contacts;
    const size_t size = 3 * (size_t)d->points[label] + MOST_ACTIVE;
    double *at = d->numbers, *G;
    s->bodies = s->contacts = s->parts = s->active = 0;
    s->dense.lambda = at, at += size;
    s->dense.u = at, at += size;
    s->best_lambda = at, at += size;
    s->dense.G = G = at, at += size * size;
    s->dense.work = at, at += ncp_work_size(size);
    s->best_velocity = at;
    s->dense.law = d->laws;
    for (int32_t i = label; i >= 0; i = d->next_body[i]) add_body(s, i);
    for (int32_t p = d->first_pair[label]; p >= 0; p = d->next_pair[p])
        for (int32_t k = 0; k < contacts->pairs[p].count; ++k) add_contact(s, p, k);
    s->dense.laws = s->contacts;
    s->dense.size = 3 * s->contacts;
    find_contact_velocities(s);
    const double before = fmax(ncp_natural_map(&s->dense), momentum_residual(s));
    if (!(before > ENOUGH)) return false;
    size_t rows = 0;
    for (int32_t k = 0; k < s->parts; ++k) rows += (size_t)(SADMM_MAX_ROWS * part_of(s, k)->view.s.columns);
    s->best = before;
    s->dense.budget = BUDGET;
    search(s, G, d->states, d->states + rows, rows);
    if (!(s->best < before)) return false;
    store_best(s);
    return true;
}

sadmm_status sadmm_ncp_solve(struct sadmm_ncp *ncp, struct sadmm_articulations *articulations,
                             const struct sadmm_system *system, const struct sadmm_row_constraint *slots,
                             const struct sadmm_settings *settings, int32_t *solved, struct sadmm_error *error)
{
    struct sadmm_system down = *system;
    struct island s = {.d = ncp, .articulations = articulations, .system = &down, .slots = slots, .settings = settings};
    const size_t n = (size_t)system->body_count;
    down.support_motion = NULL;
    *solved = 0;
    if (system->contacts->pair_count == 0) return SADMM_OK;
    if (!sadmm_grow_empty(&ncp->label, &ncp->label_capacity, n, sizeof *ncp->label) ||
        !sadmm_grow_empty(&ncp->number, &ncp->number_capacity, n, sizeof *ncp->number) ||
        !sadmm_grow_empty(&ncp->next_body, &ncp->body_list_capacity, n, sizeof *ncp->next_body) ||
        !sadmm_grow_empty(&ncp->points, &ncp->points_capacity, n, sizeof *ncp->points) ||
        !sadmm_grow_empty(&ncp->first_pair, &ncp->first_capacity, n, sizeof *ncp->first_pair) ||
        !sadmm_grow_empty(&ncp->kind, &ncp->kind_capacity, n, sizeof *ncp->kind) ||
        !sadmm_grow_empty(&ncp->next_pair, &ncp->pair_list_capacity, system->contacts->pair_count,
                          sizeof *ncp->next_pair))
        return sadmm_fail_memory(error, "islands of the dense contact solve");
    sadmm_islands(&down, ncp->label);
    list_islands(ncp, &down);
    describe_islands(ncp, articulations, &down, slots);
    if (!make_room(ncp, articulations, &down, settings))
        return sadmm_fail_memory(error, "islands of the dense contact solve");
    for (int32_t i = 0; i < system->body_count; ++i)
        if (ncp->label[i] == i && is_taken(ncp, i, settings)) *solved += solve_island(&s, i);
    return SADMM_OK;
}
