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
/* Contacts that cannot be met give by this share of their response: a weight of 5 ms by 0.5 mm/s. Of 90,000 steps of 600
 * random mechanisms with masses over three decades that begin in overlap, 1e-4 leaves 87 unsolved and a speed above
 * 20 m/s in 22 mechanisms, 1e-3 7 and 11, 1e-2 1 and 8. */
static const double GIVES = 1e-2;
/* A solution of so many times the energy that is expected is held against that of contacts that give: where bodies are all
 * but wedged, the one throws them about, and the other has less than half its energy. */
static const double MOST_ENERGY = 10;
/* How many times larger impulses may be that are no solution. */
static const double MOST_GROWTH = 4;
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
    int32_t *first_node;       /* (parts + 1) of trees (below); the last: of bodies without joints */
    struct ncp_passed *passed; /* of each number */
    const struct ncp_passed **passed_at; /* by node: of one number */
    int32_t *passed_counts;
    bool known;                /* the lists are of this (sub-)step, from before its iterations; then */
    double *kept;              /* velocities, multipliers of rows, impulses at that time */
    size_t kept_capacity, first_node_capacity, passed_capacity, passed_at_capacity, passed_count_capacity;
    uint8_t *states;           /* SADMM_MAX_ROWS a column, of the parts one after the other: those that G is for */
    size_t label_capacity, number_capacity, body_list_capacity, points_capacity, first_capacity, kind_capacity,
        pair_list_capacity, body_capacity, contact_capacity, law_capacity, part_capacity, numbers_capacity, row_capacity,
        state_capacity;
};

enum island_kind { ISLAND_ARTICULATED = 1, ISLAND_LEFT = 2, ISLAND_SOLVED = 4 };

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
    double best, best_hard;              /* natural map, m/s, of what is solved; of contacts that do not give */
    bool gives;
    bool again;                          /* after the iterations */
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
                      d->bodies, d->contacts, d->laws,      d->parts,  d->numbers,    d->rows, d->states,
                      d->kept, d->first_node, d->passed, (void *)d->passed_at, d->passed_counts};
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
        if (part->loaded) {
            sadmm_articulation_part_put_contacts(part, part->impulse);
        } else {
            sadmm_articulation_part_load(part, s->system, s->settings, s->slots);
            part->loaded = part->by_tree;
        }
        fix_active(s, k);
        solved = sadmm_articulation_part_solve(part, states, true) && solved;
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

/* ---- G of trees --------------------------------------------------------------------------------------------------- */

/* A column of G as its load goes to the roots: with a load's shares z along the joints on its way, and H z of each,
 *
 *     G_rc = sum z_r H z_c over the nodes that both have passed
 *
 * Nodes have numbers of their own in the island: those of its parts' trees one after the other, then bodies without
 * joints, which are roots. */
struct ncp_passed {
    int32_t node, free;
    double along[6], response[6];
};

static int32_t node_of(const struct island *s, int32_t number, int32_t *part)
{
    const int32_t i = s->d->bodies[number].body;
    *part = s->articulations->part[i];
    if (*part < 0) return s->d->first_node[s->parts] + number;
    for (int32_t k = 0; k < s->parts; ++k)
        if (s->d->parts[k] == *part) {
            *part = k;
            break;
        }
    return s->d->first_node[*part] + part_of(s, *part)->tree.node_of[s->articulations->entry[i]];
}

/* From a node's load, in: and its number -1 where nothing acts on it, to what comes next on its way. */
struct way {
    int32_t node, part; /* -1: at its end */
    double load[6];
};

static void begin_way(const struct island *s, int32_t number, const double *row, struct way *way)
{
    way->node = node_of(s, number, &way->part);
    memcpy(way->load, row, sizeof way->load);
}

static void pass_free(const struct island *s, struct way *way, struct ncp_passed *to)
{
    const struct ncp_body *body = &s->d->bodies[way->node - s->d->first_node[s->parts]];
    to->node = way->node, to->free = 6;
    memcpy(to->along, way->load, sizeof to->along);
    ldl6_solve(body->factor, way->load, to->response);
    way->node = -1;
}

static void pass_node(const struct island *s, struct way *way, const double *along, struct ncp_passed *to)
{
    if (way->part < 0) {
        pass_free(s, way, to);
        return;
    }
    const struct articulation_tree *tree = &part_of(s, way->part)->tree;
    const struct articulation_node *node = &tree->node[way->node - s->d->first_node[way->part]];
    const struct articulation_step step = sadmm_articulation_tree_pass(node, way->load, along);
    to->node = way->node, to->free = node->free;
    memcpy(to->along, step.along, sizeof to->along);
    memcpy(to->response, step.response, sizeof to->response);
    way->node = node->parent >= 0 && node->bound ? s->d->first_node[way->part] + node->parent : -1;
}

/* Both ways at once: children come before their parents, and what two ways have in common is one. */
static int32_t pass_all(const struct island *s, struct way way[2], const double *along, struct ncp_passed *to)
{
    int32_t count = 0;
    while (way[0].node >= 0 || way[1].node >= 0) {
        if (way[0].node == way[1].node) {
            for (int k = 0; k < 6; ++k) way[0].load[k] += way[1].load[k];
            way[1].node = -1;
        }
        const int first = way[0].node < 0 || (way[1].node >= 0 && way[1].node < way[0].node);
        pass_node(s, &way[first], along, &to[count++]);
        along = NULL;
    }
    return count;
}

static int32_t pass_column(const struct island *s, int32_t number, struct ncp_passed *to)
{
    struct way way[2] = {{.node = -1}, {.node = -1}};
    if (number < 3 * s->contacts) {
        const struct ncp_contact *c = &s->d->contacts[number / 3];
        for (int k = 0; k < 2; ++k)
            if (c->body[k] >= 0) begin_way(s, c->body[k], c->row[k][number % 3], &way[k]);
        return pass_all(s, way, NULL, to);
    }
    const struct ncp_active *active = &s->active_row[number - 3 * s->contacts];
    const struct articulation_tree *tree = &part_of(s, active->part)->tree;
    way[0].part = active->part;
    way[0].node = s->d->first_node[active->part] + sadmm_articulation_tree_node(tree, &part_of(s, active->part)->view, active->r);
    return pass_all(s, way, tree->direction + 6 * active->r, to);
}

static double gain_of(const struct island *s, int32_t number)
{
    if (number < 3 * s->contacts) return 1;
    const struct ncp_active *active = &s->active_row[number - 3 * s->contacts];
    return part_of(s, active->part)->view.rows[active->r].gain;
}

static double add_own(const struct island *s, int32_t number)
{
    if (number < 3 * s->contacts) return s->regularisation * s->d->laws[number / 3].response;
    const struct ncp_active *active = &s->active_row[number - 3 * s->contacts];
    return part_of(s, active->part)->view.rows[active->r].compliance;
}

static void find_first_nodes(struct island *s)
{
    int32_t first = 0;
    for (int32_t k = 0; k < s->parts; ++k) {
        s->d->first_node[k] = first;
        first += part_of(s, k)->tree.nodes;
    }
    s->d->first_node[s->parts] = first;
}

/* Nodes on the way of a number, at most. */
static int32_t longest_way(const struct island *s)
{
    int32_t most = 1;
    for (int32_t k = 0; k < s->parts; ++k)
        if (part_of(s, k)->tree.depth > most) most = part_of(s, k)->tree.depth;
    return 2 * most;
}

static void make_tree_responses(struct island *s, double *G)
{
    const int32_t n = s->dense.size, room = longest_way(s), nodes = s->d->first_node[s->parts] + s->bodies;
    const struct ncp_passed **at = s->d->passed_at;
    int32_t *counts = s->d->passed_counts;
    memset(at, 0, (size_t)nodes * sizeof *at);
    s->dense.budget -= (double)n * n * room;
    for (int32_t k = 0; k < s->parts; ++k) sadmm_articulation_part_factorize(part_of(s, k));
    for (int32_t c = 0; c < n; ++c) {
        struct ncp_passed *own = s->d->passed + (size_t)c * (size_t)room;
        counts[c] = pass_column(s, c, own);
        for (int32_t i = 0; i < counts[c]; ++i) at[own[i].node] = &own[i];
        for (int32_t r = 0; r <= c; ++r) {
            const struct ncp_passed *other = s->d->passed + (size_t)r * (size_t)room;
            double sum = 0;
            for (int32_t i = 0; i < counts[r]; ++i) {
                const struct ncp_passed *common = at[other[i].node];
                for (int j = 0; common && j < common->free; ++j) sum += other[i].along[j] * common->response[j];
            }
            G[(size_t)r * (size_t)n + (size_t)c] = gain_of(s, r) * sum;
            G[(size_t)c * (size_t)n + (size_t)r] = gain_of(s, c) * sum;
        }
        G[(size_t)c * (size_t)n + (size_t)c] += add_own(s, c);
        for (int32_t i = 0; i < counts[c]; ++i) at[own[i].node] = NULL;
    }
}

static bool are_trees(const struct island *s)
{
    for (int32_t k = 0; k < s->parts; ++k)
        if (!part_of(s, k)->by_tree) return false;
    return true;
}

/* ---- G otherwise -------------------------------------------------------------------------------------------------- */

static void make_responses(struct island *s, double *G)
{
    if (are_trees(s)) {
        make_tree_responses(s, G);
        return;
    }
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

static void keep_best(struct island *s)
{
    const double map = map_of(s);
    if (!(map < s->best)) return;
    s->best = map;
    s->best_hard = ncp_natural_map(&s->dense);
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

/* From where the iterations are, or the last step was. */
static void begin_search(struct island *s, uint8_t *states)
{
    take_states(s, states);
    find_regularisation(s);
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
    s->gives = true;
    s->regularisation = GIVES;
    s->best = HUGE_VAL;
}

static void search(struct island *s, double *G, uint8_t *states, uint8_t *next, size_t rows)
{
    bool changed = true;
    if (!solve_inner_rows(s, states, next, rows, &changed)) return;
    for (int round = 0, idle = 0;
         round < MOST_ROUNDS && idle < MOST_IDLE && s->best > AIM && s->dense.budget > 0; ++round) {
        const double last = s->best;
        if (changed) make_responses(s, G);
        changed = false;
        add_regularisation(s, 1); /* as in the matrix */
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
    return !(d->kind[label] & (ISLAND_LEFT | ISLAND_SOLVED)) && d->points[label] > 0 &&
           d->points[label] <= settings->ncp_points;
}

/* Room for any of them. */
static bool make_room(struct sadmm_ncp *d, const struct sadmm_articulations *articulations,
                      const struct sadmm_system *system, const struct sadmm_settings *settings)
{
    const size_t n = (size_t)system->body_count;
    size_t points = 0, states = 0, depth = 1;
    for (size_t i = 0; i < n; ++i)
        if (is_taken(d, (int32_t)i, settings) && (size_t)d->points[i] > points) points = (size_t)d->points[i];
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        states += (size_t)(SADMM_MAX_ROWS * articulations->parts[k].view.s.columns);
        if ((size_t)articulations->parts[k].tree.depth > depth) depth = (size_t)articulations->parts[k].tree.depth;
    }
    const size_t size = 3 * points + MOST_ACTIVE;
    return sadmm_grow_empty(&d->bodies, &d->body_capacity, n, sizeof *d->bodies) &&
           sadmm_grow_empty(&d->contacts, &d->contact_capacity, points, sizeof *d->contacts) &&
           sadmm_grow_empty(&d->laws, &d->law_capacity, points + MOST_ACTIVE, sizeof *d->laws) &&
           sadmm_grow_empty(&d->parts, &d->part_capacity, (size_t)articulations->order.parts, sizeof *d->parts) &&
           sadmm_grow_empty(&d->numbers, &d->numbers_capacity,
                            3 * size + size * size + ncp_work_size(size) + 6 * n, sizeof *d->numbers) &&
           sadmm_grow_empty(&d->first_node, &d->first_node_capacity, (size_t)articulations->order.parts + 1,
                            sizeof *d->first_node) &&
           sadmm_grow_empty(&d->passed, &d->passed_capacity, 2 * depth * size, sizeof *d->passed) &&
           sadmm_grow_empty(&d->passed_at, &d->passed_at_capacity, 2 * n, sizeof *d->passed_at) &&
           sadmm_grow_empty(&d->passed_counts, &d->passed_count_capacity, size, sizeof *d->passed_counts) &&
           sadmm_grow_empty(&d->rows, &d->row_capacity, system->rows->row_count, sizeof *d->rows) &&
           sadmm_grow_empty(&d->states, &d->state_capacity, 2 * states, sizeof *d->states);
}

/* The largest speed that an impulse of the contacts makes by itself, or that there is: m/s. */
static double size_of(const struct island *s, const double *lambda)
{
    double most = 0;
    for (int32_t n = 0; n < 3 * s->contacts; ++n)
        most = fmax(most, fmax(fabs(lambda[n]) * s->d->laws[n / 3].response, fabs(s->dense.u[n])));
    return most;
}

/* Is what was found taken, which is no solution? Where there is none, bodies that are wedged say, impulses may grow
 * without bound and the natural map still sink a little: what is nearer to the laws has to be of impulses like those it
 * is instead of. Before the iterations it is left to what follows. */
static bool is_nearer(const struct island *s, double before, double size_before)
{
    return s->again && s->best < before && size_of(s, s->best_lambda) <= MOST_GROWTH * size_before;
}

/* Twice the kinetic energy of a body, J: v^T A v. */
static double energy2(const struct ncp_body *body, const double v[6])
{
    double sum = 0;
    for (int k = 0; k < 6; ++k) {
        double along = v[k];
        for (int i = k + 1; i < 6; ++i) along += body->factor[6 * i + k] * v[i];
        sum += along * along / body->factor[7 * k];
    }
    return sum;
}

/* That of the best that was found. */
static double best_energy2(const struct island *s)
{
    double sum = 0;
    for (int32_t n = 0; n < s->bodies; ++n) sum += energy2(&s->d->bodies[n], s->best_velocity + 6 * (size_t)n);
    return sum;
}

/* That with nothing but forces, and of all at the speed of corrections. */
static double expected_energy2(const struct island *s)
{
    const double speed = s->settings->correction_speed;
    double sum = 0, v[6];
    for (int32_t n = 0; n < s->bodies; ++n) {
        const struct ncp_body *body = &s->d->bodies[n];
        ldl6_solve(body->factor, body->b, v);
        sum += energy2(body, v) + speed * speed / body->factor[0];
    }
    return sum;
}

/* The island's state is the best that was found. solved: no iteration can do better. */
static bool take(struct island *s, int32_t label, bool solved)
{
    store_best(s);
    if (solved) s->d->kind[label] |= ISLAND_SOLVED;
    return true;
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
    find_first_nodes(s);
    find_contact_velocities(s);
    const double before = fmax(ncp_natural_map(&s->dense), momentum_residual(s));
    if (!(before > ENOUGH)) {
        d->kind[label] |= ISLAND_SOLVED;
        return false;
    }
    const double size_before = size_of(s, s->dense.lambda);
    size_t rows = 0;
    for (int32_t k = 0; k < s->parts; ++k) rows += (size_t)(SADMM_MAX_ROWS * part_of(s, k)->view.s.columns);
    s->best = before;
    s->gives = false;
    s->dense.budget = BUDGET;
    begin_search(s, d->states);
    search(s, G, d->states, d->states + rows, rows);
    forget_loads(s);
    const bool solved = !(s->best > ENOUGH);
    const double energy = solved ? best_energy2(s) : HUGE_VAL;
    const bool taken = (solved || is_nearer(s, before, size_before)) && take(s, label, solved);
    if (taken && !(solved && energy > MOST_ENERGY * expected_energy2(s))) return true;
    s->dense.budget = BUDGET;
    begin_giving(s, d->states, rows);
    search(s, G, d->states, d->states + rows, rows);
    forget_loads(s);
    if (s->best > ENOUGH || (solved ? best_energy2(s) > energy / 2 : s->again && s->best_hard > before)) return taken;
    return take(s, label, true);
}

static bool make_lists(struct sadmm_ncp *d, const struct sadmm_ncp_input *input, const struct sadmm_system *system)
{
    const size_t n = (size_t)system->body_count, pairs = system->contacts->pair_count;
    if (!sadmm_grow_empty(&d->label, &d->label_capacity, n, sizeof *d->label) ||
        !sadmm_grow_empty(&d->number, &d->number_capacity, n, sizeof *d->number) ||
        !sadmm_grow_empty(&d->next_body, &d->body_list_capacity, n, sizeof *d->next_body) ||
        !sadmm_grow_empty(&d->points, &d->points_capacity, n, sizeof *d->points) ||
        !sadmm_grow_empty(&d->first_pair, &d->first_capacity, n, sizeof *d->first_pair) ||
        !sadmm_grow_empty(&d->kind, &d->kind_capacity, n, sizeof *d->kind) ||
        !sadmm_grow_empty(&d->next_pair, &d->pair_list_capacity, pairs, sizeof *d->next_pair))
        return false;
    sadmm_islands(system, d->label);
    list_islands(d, system);
    describe_islands(d, input->articulations, system, input->slots);
    return make_room(d, input->articulations, system, input->settings);
}

/* Islands without contacts whose rows the block solve has solved, and bodies without either, which are given A^-1 b. */
static void find_solved_without_contacts(struct sadmm_ncp *d, const struct sadmm_ncp_input *input)
{
    const struct sadmm_articulations *articulations = input->articulations;
    const struct sadmm_system *system = input->system;
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        const int32_t label = d->label[articulations->parts[k].view.s.body[0]];
        if (!articulations->parts[k].kept && d->points[label] == 0) d->kind[label] |= ISLAND_LEFT;
    }
    for (int32_t i = 0; i < system->body_count; ++i) {
        const int32_t label = d->label[i];
        if (d->points[label] > 0 || (d->kind[label] & ISLAND_LEFT)) continue;
        d->kind[label] |= ISLAND_SOLVED;
        if (articulations->part[i] >= 0 || d->kind[label] & ISLAND_ARTICULATED) continue;
        double A[36], b[6];
        sadmm_system_body(system, input->settings, i, A, b);
        ldl6_factor(A, A);
        ldl6_solve(A, b, system->velocity + 6 * (size_t)i);
    }
}

/* May every island be solved? Else those without joints are left to the iterations: they would not be spared. */
static void choose_islands(struct sadmm_ncp *d, const struct sadmm_ncp_input *input)
{
    bool all = true;
    for (int32_t i = 0; i < input->system->body_count; ++i)
        all = all && (d->kind[d->label[i]] & ISLAND_SOLVED || is_taken(d, d->label[i], input->settings));
    for (int32_t i = 0; !all && i < input->system->body_count; ++i)
        if (!(d->kind[i] & (ISLAND_ARTICULATED | ISLAND_SOLVED))) d->kind[i] |= ISLAND_LEFT;
}

/* Backends move bodies without joints by what their iterations end with. */
static void leave_to_iterations(struct sadmm_ncp *d, const struct sadmm_system *system)
{
    for (int32_t i = 0; i < system->body_count; ++i)
        if (!(d->kind[i] & ISLAND_ARTICULATED)) d->kind[i] = ISLAND_LEFT;
}

static int32_t solve_islands(struct sadmm_ncp *d, const struct sadmm_ncp_input *input, bool again)
{
    struct island s = {.d = d, .articulations = input->articulations, .system = input->system, .slots = input->slots,
                       .settings = input->settings, .again = again};
    int32_t solved = 0;
    for (int32_t i = 0; i < input->system->body_count; ++i)
        if (d->label[i] == i && is_taken(d, i, input->settings)) solved += solve_island(&s, i);
    return solved;
}

/* What solved islands are is kept while the iterations go on with others. */
static bool keep(struct sadmm_ncp *d, const struct sadmm_system *system)
{
    const size_t numbers = 6 * (size_t)system->body_count, rows = system->rows->row_count,
                 points = system->contacts->point_count;
    if (!sadmm_grow_empty(&d->kept, &d->kept_capacity, numbers + rows + 3 * points, sizeof *d->kept)) return false;
    memcpy(d->kept, system->velocity, numbers * sizeof *d->kept);
    memcpy(d->kept + numbers, system->rows->lambda, rows * sizeof *d->kept);
    for (size_t k = 0; k < points; ++k)
        memcpy(d->kept + numbers + rows + 3 * k, system->contacts->points[k].impulse, 3 * sizeof *d->kept);
    return true;
}

static bool is_solved(const struct sadmm_ncp *d, int32_t body_a, int32_t body_b)
{
    return (body_a >= 0 || body_b >= 0) && d->kind[island_of(d, body_a, body_b)] & ISLAND_SOLVED;
}

static void take_kept(const struct sadmm_ncp *d, const struct sadmm_system *system)
{
    const size_t numbers = 6 * (size_t)system->body_count, rows = system->rows->row_count;
    for (int32_t i = 0; i < system->body_count; ++i)
        if (is_solved(d, i, i)) memcpy(system->velocity + 6 * (size_t)i, d->kept + 6 * (size_t)i, 6 * sizeof *d->kept);
    for (size_t k = 0; k < system->rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *c = &system->rows->constraints[k];
        if (is_solved(d, c->body_a, c->body_b))
            memcpy(system->rows->lambda + c->first, d->kept + numbers + (size_t)c->first,
                   (size_t)c->count * sizeof *d->kept);
    }
    for (size_t p = 0; p < system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
        for (int32_t k = pair->first; is_solved(d, pair->body_a, pair->body_b) && k < pair->first + pair->count; ++k)
            memcpy(system->contacts->points[k].impulse, d->kept + numbers + rows + 3 * (size_t)k,
                   3 * sizeof *d->kept);
    }
}

sadmm_status sadmm_ncp_solve(struct sadmm_ncp *ncp, const struct sadmm_ncp_input *input, bool *all, int32_t *solved,
                             struct sadmm_error *error)
{
    const struct sadmm_system *system = input->system;
    *solved = 0;
    *all = true;
    ncp->known = false;
    if (!make_lists(ncp, input, system)) return sadmm_fail_memory(error, "islands of the dense contact solve");
    find_solved_without_contacts(ncp, input);
    choose_islands(ncp, input);
    *solved = solve_islands(ncp, input, false);
    for (int32_t i = 0; i < system->body_count; ++i) *all = *all && is_solved(ncp, i, i);
    ncp->known = true;
    if (*all) return SADMM_OK;
    leave_to_iterations(ncp, system);
    if (!keep(ncp, system)) return sadmm_fail_memory(error, "islands of the dense contact solve");
    return SADMM_OK;
}

sadmm_status sadmm_ncp_solve_again(struct sadmm_ncp *ncp, const struct sadmm_ncp_input *input, int32_t *solved,
                                   struct sadmm_error *error)
{
    *solved = 0;
    if (ncp->known) take_kept(ncp, input->system);
    else if (!make_lists(ncp, input, input->system))
        return sadmm_fail_memory(error, "islands of the dense contact solve");
    leave_to_iterations(ncp, input->system);
    *solved = solve_islands(ncp, input, true);
    return SADMM_OK;
}

void sadmm_ncp_begin(struct sadmm_ncp *ncp) { ncp->known = false; }

const int32_t *sadmm_ncp_islands(const struct sadmm_ncp *ncp) { return ncp->label; }
