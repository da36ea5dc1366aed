#include "ncp.h"

#include <math.h>
#include <string.h>

#include "asked_energy.h"
#include "core/base/memory.h"
#include "core/math/solve_rounding.h"
#include "core/model/system_math.h"
#include "ncp_island.h"
#include "ncp_newton.h"

/* m/s: the aim; that of Newton's steps, which solve for the rows in their states. */
static const double AIM = 1e-10, NEWTON_AIM = 1e-13;
/* m/s: regularisation of contacts in G, that of the one with the largest load, others in proportion: of all impulses
 * that are solutions the least are found. Else a car stands on two wheels across, and which two changes from step to
 * step. */
static const double REGULARISATION = 3e-12;
/* Multiplications for a search, so that one that does not come to an end takes some 4 ms. Islands without joints share
 * one, no more than the iterations took or 1 ms: others keep what those have. */
static const double BUDGET = 4e7, SHARED = 1e7;
/* Contacts that cannot be met give by this share of their response: a body's own weight by 0.5 mm/s in a step of 5 ms.
 * Of 600 mechanisms that begin in overlap (python/tests/test_mechanisms.py 600) 13 end above 20 m/s, with 1e-3 11, with
 * 1e-4 46. */
static const double GIVES = 1e-2;
/* A solution of more than so many times the energy that is asked for is none: where bodies are all but wedged, or a
 * loop is near its dead point, it throws them about. */
static const double MOST_ENERGY = 10;
/* Contacts that cannot be met miss by more than this share of the speed of corrections: what is nearer is left to the
 * iterations first. */
static const double CANNOT = 0.1;
/* How many times larger than those they replace impulses may be that are no solution. */
static const double MOST_GROWTH = 4;
/* How often it goes from contacts to rows and back, in all and without coming nearer though no row changed; and passes
 * of the inner rows. */
enum { MOST_ROUNDS = 40, MOST_IDLE = 4, MOST_PASSES = 6 };

struct sadmm_ncp *sadmm_ncp_create(void)
{
    return (struct sadmm_ncp *)sadmm_alloc(1, sizeof(struct sadmm_ncp));
}

void sadmm_ncp_destroy(struct sadmm_ncp *d)
{
    if (!d) return;
    void *blocks[] = {d->label,    d->number, d->next_body, d->points, d->first_pair, d->kind,   d->error,
                      d->next_pair, d->bodies, d->contacts,  d->laws,   d->parts,      d->numbers, d->rows,
                      d->states,   d->kept,   d->first_node, d->passed, (void *)d->passed_at, d->passed_counts};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    sadmm_free(d);
}

/* ---- an island's contacts and bodies ----------------------------------------------------------------------------- */

static void add_body(struct island *s, int32_t i)
{
    struct ncp_body *body = &s->d->bodies[s->bodies];
    body->body = i;
    body->factored = false;
    memcpy(body->velocity, s->system->velocity + 6 * (size_t)i, sizeof body->velocity);
    s->d->number[i] = s->bodies++;
    const int32_t part = s->articulations->part[i];
    s->fresh = s->fresh && part >= 0 && s->articulations->parts[part].loaded;
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
            response += ldl6_inverse_product(sadmm_ncp_factor(s, c->body[side]), c->row[side][i]);
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

/* ---- what the iterations have left ------------------------------------------------------------------------------- */

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

/* The residual of the momentum, by velocities: m/s or rad/s. A tree leaves none. */
static double momentum_residual(struct island *s)
{
    double most = 0, owed[6];
    if (s->fresh) return 0;
    for (int32_t n = 0; n < s->bodies; ++n) {
        sadmm_ncp_factor(s, n);
        memcpy(s->d->bodies[n].dv, s->d->bodies[n].b, 6 * sizeof(double));
    }
    add_contact_loads(s);
    for (int32_t k = 0; k < s->parts; ++k) add_row_loads(s, &s->articulations->parts[s->d->parts[k]].view);
    for (int32_t n = 0; n < s->bodies; ++n) {
        const struct ncp_body *body = &s->d->bodies[n];
        ldl6_solve(body->factor, body->dv, owed);
        for (int k = 0; k < 6; ++k) most = fmax(most, fabs(body->velocity[k] - owed[k]));
    }
    return most;
}

/* ---- velocities and rows for given impulses ---------------------------------------------------------------------- */

/* To single bodies with what acts on them besides, to parts alone: they add the rest when they are loaded. */
static void put_loads(struct island *s)
{
    for (int32_t n = 0; n < s->bodies; ++n) {
        struct ncp_body *body = &s->d->bodies[n];
        if (s->articulations->part[body->body] < 0) {
            sadmm_ncp_factor(s, n);
            memcpy(body->dv, body->b, sizeof body->dv);
        } else memset(body->dv, 0, sizeof body->dv);
    }
    add_contact_loads(s);
    for (int32_t k = 0; k < s->parts; ++k) {
        struct articulation_part *part = part_of(s, k);
        for (int32_t e = 0; e < part->view.s.bodies; ++e)
            memcpy(part->impulse + 6 * (size_t)e, s->d->bodies[s->d->number[part->view.s.body[e]]].dv,
                   6 * sizeof(double));
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
        const bool goes_on = part->loaded && s->active == 0 && memcmp(states, v->state, rows) == 0;
        if (part->loaded) {
            sadmm_articulation_part_put_contacts(part, part->impulse);
        } else {
            sadmm_articulation_part_load(part, s->system, s->settings, s->slots);
            part->loaded = part->by_tree;
        }
        fix_active(s, k);
        solved = (goes_on ? sadmm_articulation_part_solve_on(part)
                          : sadmm_articulation_part_solve(part, states, true)) && solved;
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
                .response = v->rows[r].gain * sadmm_articulation_part_scale(part_of(s, k), r) + v->rows[r].compliance};
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

/* ---- the search -------------------------------------------------------------------------------------------------- */

static void add_regularisation(struct island *s, double sign)
{
    for (int32_t n = 0; n < 3 * s->contacts; ++n)
        s->dense.u[n] += sign * s->regularisation * s->d->laws[n / 3].response * s->dense.lambda[n];
}

/* The natural map of what is solved: of contacts that give, if they do. */
static double map_of(struct island *s)
{
    if (!s->gives) return ncp_natural_map(&s->dense);
    add_regularisation(s, 1);
    const double map = ncp_natural_map(&s->dense);
    add_regularisation(s, -1);
    return map;
}

/* The most that its parts have missed in their last solves. */
static double missed_by_parts(const struct island *s)
{
    double most = 0;
    for (int32_t k = 0; k < s->parts; ++k) most = fmax(most, part_of(s, k)->missed);
    return most;
}

static void keep_best(struct island *s)
{
    const double map = map_of(s);
    if (!(map < s->best)) return;
    s->best = map;
    s->best_hard = ncp_natural_map(&s->dense);
    s->best_missed = missed_by_parts(s);
    memcpy(s->best_lambda, s->dense.lambda, 3 * (size_t)s->contacts * sizeof *s->best_lambda);
    s->current = true;
}

/* Before bodies and parts change. */
static void save_best(struct island *s)
{
    if (!s->current) return;
    s->current = false;
    for (int32_t n = 0; n < s->bodies; ++n)
        memcpy(s->best_velocity + 6 * (size_t)n, s->d->bodies[n].velocity, 6 * sizeof(double));
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        EACH_ARTICULATION_ROW(s->slots, v, r, from) s->best_rows[from] = articulation_bounded(v, r);
    }
}

/* With another one, which is kept meanwhile. */
static void exchange_best(struct island *s)
{
    double *const lambda = s->best_lambda, *const velocity = s->best_velocity, *const rows = s->best_rows;
    s->best_lambda = s->other_lambda, s->best_velocity = s->other_velocity, s->best_rows = s->other_rows;
    s->other_lambda = lambda, s->other_velocity = velocity, s->other_rows = rows;
}

static const double *best_velocity(const struct island *s, int32_t n)
{
    return s->current ? s->d->bodies[n].velocity : s->best_velocity + 6 * (size_t)n;
}

/* Velocities and inner rows for the impulses as they are, where rows that change their states become active, until none
 * does: all of them, where they cycle. changed: is set where G is no longer right. False: inner rows are not solved. */
static bool solve_inner_rows(struct island *s, uint8_t *states, uint8_t *next, size_t rows, bool *changed)
{
    for (int pass = 0; pass < MOST_PASSES; ++pass) {
        bool active = false;
        memcpy(next, states, rows);
        save_best(s);
        const bool solved = solve_for_impulses(s, next);
        if (solved) keep_best(s);
        if (s->begins) memcpy(states, next, rows);
        s->begins = false;
        if (memcmp(states, next, rows) != 0 && !activate(s, states, next, false, &active)) return false;
        if (!active && !solved && !activate(s, states, next, true, &active)) return false;
        if (!active) return solved;
        memcpy(states, next, rows);
        *changed = true;
    }
    return false;
}

/* For the impulses as they are. */
static double regularisation_of(const struct island *s)
{
    double most = 0;
    for (int32_t n = 0; n < 3 * s->contacts; ++n)
        most = fmax(most, s->d->laws[n / 3].response * fabs(s->dense.lambda[n]));
    return REGULARISATION < most ? REGULARISATION / most : 0;
}

/* Impulses have grown: in an impact, by a thousand times. What the regularisation leaves of their laws has, too, and
 * may be too much. */
static bool is_too_regular(const struct island *s)
{
    return !s->gives && s->best > NCP_ENOUGH && regularisation_of(s) < s->regularisation / 2;
}

static void lower_regularisation(struct island *s, double *G)
{
    const double before = s->regularisation;
    s->regularisation = regularisation_of(s);
    for (int32_t n = 0; n < 3 * s->contacts; ++n)
        G[(size_t)n * (size_t)s->dense.size + (size_t)n] += (s->regularisation - before) * s->d->laws[n / 3].response;
}

/* From where the iterations are, or the last step was. */
static void begin_search(struct island *s, uint8_t *states)
{
    take_states(s, states);
    s->regularisation = regularisation_of(s);
}

/* Bounds of active rows are not their own. */
static void forget_loads(const struct island *s)
{
    for (int32_t k = 0; k < s->parts; ++k) part_of(s, k)->loaded = false;
}

/* From nothing: contacts give by a share of their response, so that there is a solution of bounded impulses. */
static void begin_giving(struct island *s, uint8_t *states, size_t rows)
{
    memset(states, ROW_ABSENT, rows);
    memset(s->dense.lambda, 0, 3 * (size_t)s->contacts * sizeof *s->dense.lambda);
    forget_loads(s);
    s->active = 0;
    s->dense.laws = s->contacts;
    s->dense.size = 3 * s->contacts;
    s->gives = s->begins = true;
    s->current = false;
    s->regularisation = GIVES;
    s->best = HUGE_VAL;
}

static void search_with(struct island *s, double *G, uint8_t *states, uint8_t *next, size_t rows)
{
    bool changed = true;
    if (!s->fresh && !solve_inner_rows(s, states, next, rows, &changed)) return;
    s->fresh = false;
    for (int round = 0, idle = 0;
         round < MOST_ROUNDS && idle < MOST_IDLE && s->best > AIM && s->dense.budget > 0; ++round) {
        const double last = s->best;
        if (changed) sadmm_ncp_find_responses(s, G);
        if (is_too_regular(s)) lower_regularisation(s, G);
        changed = false;
        add_regularisation(s, 1); /* as in the matrix */
        ncp_newton(&s->dense, NEWTON_AIM);
        if (!solve_inner_rows(s, states, next, rows, &changed)) return;
        if (!changed && s->best > last / 2 && !is_too_regular(s)) return; /* what is left is rounding */
        idle = !changed && s->best > 0.9 * last ? idle + 1 : 0;
    }
}

static void search(struct island *s, double *G, uint8_t *states, uint8_t *next, size_t rows)
{
    double own = BUDGET, *const budget = s->parts > 0 ? &own : &s->budget;
    s->dense.budget = *budget;
    search_with(s, G, states, next, rows);
    *budget = s->dense.budget;
    forget_loads(s);
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
        memcpy(s->system->velocity + 6 * (size_t)s->d->bodies[n].body, best_velocity(s, n), 6 * sizeof(double));
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        EACH_ARTICULATION_ROW(s->slots, v, r, from)
            s->system->rows->lambda[from] = s->current ? articulation_bounded(v, r) : s->best_rows[from];
    }
}

/* ---- an island --------------------------------------------------------------------------------------------------- */

/* The largest speed that an impulse of the contacts makes by itself, or that there is: m/s. */
static double size_of(const struct island *s, const double *lambda)
{
    double most = 0;
    for (int32_t n = 0; n < 3 * s->contacts; ++n)
        most = fmax(most, fmax(fabs(lambda[n]) * s->d->laws[n / 3].response, fabs(s->dense.u[n])));
    return most;
}

/* Is what is this far from the laws, m/s, a solution: is it what rounding leaves of the forces of drives, if the
 * tolerance allows that? */
static bool is_enough(const struct island *s, double map)
{
    double most = 0;
    if (!(map > NCP_ENOUGH)) return true;
    if (!(map <= s->settings->tolerance)) return false;
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_part *part = part_of(s, k);
        EACH_ARTICULATION_ROW(s->slots, &part->view, r, from)
        {
            const struct articulation_row *row = &part->view.rows[r];
            if (!isfinite(row->lo) || !isfinite(row->hi)) continue;
            const double force = articulation_clamp(row->lambda + part->view.change[r], row->lo, row->hi);
            most = fmax(most, fabs(force) * sadmm_articulation_part_scale(part, r));
            (void)from;
        }
    }
    return map <= NCP_DRIVE_ROUNDING * most;
}

/* Is what was found taken, which is no solution? Where there is none, bodies that are wedged say, impulses may grow
 * without bound and the natural map still sink a little: what is nearer to the laws has to be of impulses like those it
 * is instead of. Before the iterations it is left to what follows. */
static bool is_nearer(const struct island *s, double before, double size_before)
{
    return s->again && s->best < before && size_of(s, s->best_lambda) <= MOST_GROWTH * size_before;
}

/* A of a body that a tree has; NULL: of another one. */
static const double *tree_inertia(const struct island *s, int32_t number)
{
    const int32_t i = s->d->bodies[number].body, part = s->articulations->part[i];
    if (part < 0 || !s->articulations->parts[part].by_tree) return NULL;
    return s->articulations->parts[part].view.factor + 36 * (size_t)s->articulations->entry[i];
}

/* Twice the kinetic energy of a body, J: v^T A v. */
static double energy2(const struct island *s, int32_t number, const double v[6])
{
    const double *A = tree_inertia(s, number);
    double sum = 0;
    for (int k = 0; A && k < 6; ++k) sum += v[k] * six_product(A + 6 * k, v);
    if (A) return sum;
    const double *factor = sadmm_ncp_factor(s, number);
    for (int k = 0; k < 6; ++k) {
        double along = v[k];
        for (int i = k + 1; i < 6; ++i) along += factor[6 * i + k] * v[i];
        sum += along * along / factor[7 * k];
    }
    return sum;
}

/* That of the best that was found. */
static double best_energy2(const struct island *s)
{
    double sum = 0;
    for (int32_t n = 0; n < s->bodies; ++n) sum += energy2(s, n, best_velocity(s, n));
    return sum;
}

/* That of all at the speed of corrections, and with nothing but forces. */
static double correcting_energy2(const struct island *s)
{
    const double speed = s->settings->correction_speed;
    double mass = 0;
    for (int32_t n = 0; n < s->bodies; ++n) {
        const double *A = tree_inertia(s, n);
        mass += A ? A[0] : 1 / sadmm_ncp_factor(s, n)[0];
    }
    return speed * speed * mass;
}

/* Of all that asks for a velocity, besides corrections: joints' rows, what moves by itself, restitution. */
static double asked_energy2(const struct island *s)
{
    const struct sadmm_rows *rows = s->system->rows;
    struct asked_energy whole = asked_energy_begin();
    double sum = 0;
    for (int32_t n = 0; n < s->bodies; ++n) {
        const int32_t i = s->d->bodies[n].body;
        double A[36], b[6];
        sadmm_system_body(s->system, s->settings, i, A, b);
        asked_energy_add_body(&whole, A, s->system->rigid[i].position);
    }
    for (int32_t i = 0; i < s->contacts; ++i) {
        const struct ncp_contact *c = &s->d->contacts[i];
        const double normal = fmin(c->e, 0) + c->given[0]; /* an open contact asks for nothing */
        sum +=
            asked_energy_linear(&whole, sqrt(normal * normal + c->given[1] * c->given[1] + c->given[2] * c->given[2]));
    }
    for (int32_t k = 0; k < s->parts; ++k) {
        const struct articulation_view *v = &part_of(s, k)->view;
        EACH_ARTICULATION_ROW(s->slots, v, r, from)
        {
            double response = 0;
            for (int side = 0; side < 2; ++side) {
                const int32_t entry = v->s.side[2 * (r / SADMM_MAX_ROWS) + side];
                const double *row = (side ? rows->jacobian_b : rows->jacobian_a) + 6 * (size_t)from;
                if (entry >= 0)
                    response += ldl6_inverse_product(sadmm_ncp_factor(s, s->d->number[v->s.body[entry]]), row);
            }
            sum += asked_energy_of_row(&whole, rows, (size_t)from, response);
        }
    }
    return sum;
}

static double free_energy2(const struct island *s)
{
    double sum = 0, v[6];
    for (int32_t n = 0; n < s->bodies; ++n) {
        ldl6_solve(sadmm_ncp_factor(s, n), s->d->bodies[n].b, v);
        sum += energy2(s, n, v);
    }
    return sum;
}

/* No law makes energy: velocities are those of forces alone, and what is asked for, of which some may be asked for by
 * several. */
static bool has_too_much_energy(const struct island *s)
{
    const double energy = best_energy2(s), correcting = correcting_energy2(s);
    if (energy <= MOST_ENERGY * correcting) return false;
    const double made = sqrt(energy) - sqrt(free_energy2(s));
    return made > sqrt(MOST_ENERGY * correcting) && made > sqrt(MOST_ENERGY * (correcting + asked_energy2(s)));
}

/* Rows that contradict each other are no reason to go on: they are met as well as they can be. */
static void put_error(const struct island *s, int32_t label, double map, double missed)
{
    s->d->error[label] = map;
    sadmm_ncp_add_missed(&s->d->error[label], missed);
}

/* The island's state is the best that was found. solved: no iteration can do better. */
static bool take(struct island *s, int32_t label, bool solved)
{
    store_best(s);
    if (solved) s->d->kind[label] |= ISLAND_SOLVED;
    if (s->again && !(s->d->kind[label] & ISLAND_ARTICULATED)) s->moved = true;
    put_error(s, label, s->best_hard, s->best_missed);
    return true;
}

static bool solve_island(struct island *s, int32_t label)
{
    struct sadmm_ncp *d = s->d;
    const struct sadmm_contact_set *contacts = s->system->contacts;
    const size_t size = 3 * (size_t)d->points[label] + MOST_ACTIVE;
    double *at = d->numbers, *G;
    s->bodies = s->contacts = s->parts = s->active = 0;
    s->fresh = true;
    s->current = false;
    s->dense.lambda = at, at += size;
    s->dense.u = at, at += size;
    s->best_lambda = at, at += size;
    s->dense.G = G = at, at += size * size;
    s->dense.work = at, at += ncp_work_size(size);
    s->other_lambda = at, at += size;
    s->best_velocity = at, at += 6 * (size_t)s->system->body_count;
    s->other_velocity = at;
    s->best_rows = d->rows, s->other_rows = d->rows + s->system->rows->row_count;
    s->dense.law = d->laws;
    for (int32_t i = label; i >= 0; i = d->next_body[i]) add_body(s, i);
    for (int32_t p = d->first_pair[label]; p >= 0; p = d->next_pair[p])
        for (int32_t k = 0; k < contacts->pairs[p].count; ++k) add_contact(s, p, k);
    s->dense.laws = s->contacts;
    s->dense.size = 3 * s->contacts;
    sadmm_ncp_number_nodes(s);
    find_contact_velocities(s);
    const double before = fmax(ncp_natural_map(&s->dense), momentum_residual(s));
    put_error(s, label, before, missed_by_parts(s));
    if (is_enough(s, before)) {
        d->kind[label] |= ISLAND_SOLVED;
        return false;
    }
    const double size_before = size_of(s, s->dense.lambda);
    size_t rows = 0;
    for (int32_t k = 0; k < s->parts; ++k) rows += (size_t)(SADMM_MAX_ROWS * part_of(s, k)->view.s.columns);
    s->best = before;
    s->gives = s->begins = false;
    begin_search(s, d->states);
    search(s, G, d->states, d->states + rows, rows);
    const bool solved = is_enough(s, s->best), wild = s->best < before && has_too_much_energy(s),
               nearer = !solved && !wild && is_nearer(s, before, size_before);
    if (solved && !wild) return take(s, label, true);
    const double nearest = nearer ? s->best_hard : before, energy = solved ? best_energy2(s) : HUGE_VAL,
                 first_hard = s->best_hard, first_missed = s->best_missed;
    save_best(s);
    exchange_best(s);
    begin_giving(s, d->states, rows);
    search(s, G, d->states, d->states + rows, rows);
    const bool gives = is_enough(s, s->best) &&
                       (solved     ? best_energy2(s) <= energy / 2
                        : s->again ? s->best_hard <= nearest
                                   : s->best_hard > CANNOT * s->settings->correction_speed);
    if (gives) return take(s, label, true);
    if (!solved && !nearer) return false;
    exchange_best(s);
    s->current = false;
    s->best_hard = first_hard, s->best_missed = first_missed;
    return take(s, label, solved);
}

/* ---- all islands ------------------------------------------------------------------------------------------------- */

static int32_t solve_islands(struct sadmm_ncp *d, const struct sadmm_ncp_input *input, bool again, bool *moved)
{
    struct island s = {.d = d, .articulations = input->articulations, .system = input->system, .slots = input->slots,
                       .settings = input->settings, .again = again};
    const double iterations = NCP_POINT_WORK * (double)input->system->contacts->point_count * input->iterations;
    s.budget = fmax(SHARED, iterations);
    int32_t solved = 0;
    for (int32_t i = 0; i < input->system->body_count; ++i)
        if (d->label[i] == i && sadmm_ncp_takes(d, i, input->settings)) solved += solve_island(&s, i);
    *moved = s.moved;
    return solved;
}

sadmm_status sadmm_ncp_solve(struct sadmm_ncp *ncp, const struct sadmm_ncp_input *input, bool tries, bool *all,
                             int32_t *solved, struct sadmm_error *error)
{
    const struct sadmm_system *system = input->system;
    *solved = 0;
    *all = true;
    ncp->known = false;
    if (!sadmm_ncp_make_lists(ncp, input, system))
        return sadmm_fail_memory(error, "islands of the dense contact solve");
    if (!tries) {
        *all = false;
        sadmm_ncp_leave_to_iterations(ncp, system);
        ncp->known = true;
        return SADMM_OK;
    }
    sadmm_ncp_choose_islands(ncp, input);
    bool moved;
    *solved = solve_islands(ncp, input, false, &moved);
    for (int32_t i = 0; i < system->body_count; ++i) *all = *all && sadmm_ncp_is_solved(ncp, i, i);
    ncp->known = true;
    if (*all) return SADMM_OK;
    sadmm_ncp_leave_to_iterations(ncp, system);
    if (!sadmm_ncp_keep(ncp, system)) return sadmm_fail_memory(error, "islands of the dense contact solve");
    return SADMM_OK;
}

sadmm_status sadmm_ncp_solve_again(struct sadmm_ncp *ncp, const struct sadmm_ncp_input *input, int32_t *solved,
                                   bool *moved, struct sadmm_error *error)
{
    *solved = 0;
    *moved = false;
    if (ncp->known && input->system->rows->constraint_count > 0) sadmm_ncp_take_kept(ncp, input->system);
    if (!ncp->known && !sadmm_ncp_make_lists(ncp, input, input->system))
        return sadmm_fail_memory(error, "islands of the dense contact solve");
    sadmm_ncp_choose_later(ncp, input);
    *solved = solve_islands(ncp, input, true, moved);
    return SADMM_OK;
}

void sadmm_ncp_begin(struct sadmm_ncp *ncp) { ncp->known = false; }

const int32_t *sadmm_ncp_islands(const struct sadmm_ncp *ncp) { return ncp->label; }

bool sadmm_ncp_has_rows(const struct sadmm_ncp *ncp, int32_t body)
{
    return ncp->kind[ncp->label[body]] & ISLAND_ARTICULATED;
}
