#include "joined.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/system_math.h"
#include "joined_order.h"

struct sadmm_joined {
    struct sadmm_joined_order order;
    int32_t *bodies;        /* two a constraint: what the order was made for */
    size_t constraints;
    int32_t body_count;
    int32_t *entry;         /* bodies: entry in the order's list, -1: not joined */
    double *work;           /* the arrays of a view */
    uint8_t *state;
    double *impulse;        /* entries x 6: J^T lambda */
    double *speed;          /* entries: that its part's impulses change it by; 0: the part is not solved */
    uint8_t *touched;       /* entries: by a contact */
    uint8_t *kept_part;     /* entries, a part's first: was it solved before the iterations? */
    bool kept;              /* velocities and multipliers from before the iterations are in: */
    double *kept_velocity, *kept_lambda; /* entries x 6; rows */
    size_t bodies_capacity, entry_capacity, work_capacity, state_capacity, impulse_capacity, speed_capacity,
        touched_capacity, kept_part_capacity, kept_velocity_capacity, kept_lambda_capacity;
};

/* One call. */
struct solving {
    struct sadmm_joined *j;
    const struct sadmm_system *system;
    const struct sadmm_row_constraint *slots;
    size_t slot_count;
    const struct sadmm_settings *settings;
    struct joined_view view;
};

struct sadmm_joined *sadmm_joined_create(void)
{
    return (struct sadmm_joined *)sadmm_alloc(1, sizeof(struct sadmm_joined));
}

void sadmm_joined_destroy(struct sadmm_joined *j)
{
    if (!j) return;
    sadmm_joined_order_free(&j->order);
    void *blocks[] = {j->bodies, j->entry,   j->work,      j->state,         j->impulse,
                      j->speed,  j->touched, j->kept_part, j->kept_velocity, j->kept_lambda};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    sadmm_free(j);
}

void sadmm_joined_begin(struct sadmm_joined *j) { j->kept = false; }

/* ---- structure --------------------------------------------------------------------------------------------------- */

static bool same_graph(const struct solving *s)
{
    const struct sadmm_joined *j = s->j;
    if (j->constraints != s->slot_count || j->body_count != s->system->body_count) return false;
    for (size_t k = 0; k < s->slot_count; ++k)
        if (j->bodies[2 * k] != s->slots[k].body_a || j->bodies[2 * k + 1] != s->slots[k].body_b) return false;
    return true;
}

static bool find_order(const struct solving *s)
{
    struct sadmm_joined *j = s->j;
    const size_t n = s->slot_count, bodies = (size_t)s->system->body_count;
    if (same_graph(s)) return true;
    j->constraints = 0;
    if (!sadmm_grow_empty(&j->bodies, &j->bodies_capacity, 2 * n, sizeof *j->bodies) ||
        !sadmm_grow_empty(&j->entry, &j->entry_capacity, bodies, sizeof *j->entry))
        return false;
    for (size_t k = 0; k < n; ++k) {
        j->bodies[2 * k] = s->slots[k].body_a;
        j->bodies[2 * k + 1] = s->slots[k].body_b;
    }
    if (!sadmm_joined_order_make(&j->order, j->bodies, (int32_t)n, s->system->body_count, SADMM_JOINED_AROUND))
        return false;
    for (size_t i = 0; i < bodies; ++i) j->entry[i] = -1;
    for (int32_t e = 0; e < j->order.s.bodies; ++e) j->entry[j->order.s.body[e]] = e;
    j->constraints = n;
    j->body_count = s->system->body_count;
    return true;
}

static bool make_view(struct solving *s)
{
    struct sadmm_joined *j = s->j;
    struct sadmm_rows *rows = s->system->rows;
    const struct joined_structure *o = &j->order.s;
    const size_t n = (size_t)s->system->body_count, r = rows->row_count;
    if (!sadmm_grow_empty(&j->work, &j->work_capacity, joined_work_size(o, n, r), sizeof *j->work) ||
        !sadmm_grow_empty(&j->state, &j->state_capacity, r, sizeof *j->state) ||
        !sadmm_grow_empty(&j->impulse, &j->impulse_capacity, 6 * (size_t)o->bodies, sizeof *j->impulse) ||
        !sadmm_grow_empty(&j->speed, &j->speed_capacity, (size_t)o->bodies, sizeof *j->speed) ||
        !sadmm_grow_empty(&j->touched, &j->touched_capacity, (size_t)o->bodies, sizeof *j->touched) ||
        !sadmm_grow_empty(&j->kept_part, &j->kept_part_capacity, (size_t)o->bodies, sizeof *j->kept_part) ||
        !sadmm_grow_empty(&j->kept_velocity, &j->kept_velocity_capacity, 6 * (size_t)o->bodies,
                          sizeof *j->kept_velocity) ||
        !sadmm_grow_empty(&j->kept_lambda, &j->kept_lambda_capacity, r, sizeof *j->kept_lambda))
        return false;
    s->view = (struct joined_view){
        .s = *o, .constraints = s->slots, .jacobian = {rows->jacobian_a, rows->jacobian_b}, .gain = rows->gain,
        .bias = rows->bias, .compliance = rows->compliance, .lo = rows->lo, .hi = rows->hi, .jacobian_stride = 6,
        .law_stride = 1, .velocity = s->system->velocity, .state = j->state};
    joined_bind_work(&s->view, j->work, n, r);
    memcpy(s->view.lambda, rows->lambda, r * sizeof *rows->lambda);
    return true;
}

struct part {
    int32_t place, end_place, entry, end_entry;
};

static struct part part_of(const struct joined_structure *o, int32_t k)
{
    return (struct part){o->first_of_level[o->first_level[k]], o->first_of_level[o->first_level[k + 1]],
                         o->first_body[k], o->first_body[k + 1]};
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static int32_t pair_body(const struct sadmm_contact_pair *pair, int side) { return side ? pair->body_b : pair->body_a; }

static void find_impulses(struct solving *s)
{
    const struct sadmm_contact_set *contacts = s->system->contacts;
    const int32_t *entry = s->j->entry;
    memset(s->j->impulse, 0, 6 * (size_t)s->view.s.bodies * sizeof *s->j->impulse);
    memset(s->j->touched, 0, (size_t)s->view.s.bodies);
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        for (int side = 0; side < 2; ++side) {
            const int32_t body = pair_body(pair, side), e = body >= 0 ? entry[body] : -1;
            if (e < 0) continue;
            joined_add_pair(&contacts->points[pair->first], pair->count, side, s->j->impulse + 6 * (size_t)e);
            s->j->touched[e] = 1;
        }
    }
    for (size_t k = 0; k < s->slot_count; ++k) {
        const struct sadmm_row_constraint *constraint = &s->slots[k];
        for (int side = 0; side < 2; ++side) {
            const int32_t body = joined_body(constraint, side), e = body >= 0 ? entry[body] : -1;
            if (e >= 0) joined_add_rows(&s->view, constraint, side, s->j->impulse + 6 * (size_t)e);
        }
    }
}

/* A, and b - A v + J^T lambda. */
static void find_missing(const struct solving *s, const struct part *part)
{
    for (int32_t e = part->entry; e < part->end_entry; ++e) {
        const size_t i = (size_t)s->view.s.body[e];
        double *A = s->view.A + 36 * i, b[6];
        sadmm_system_body(s->system, s->settings, (int32_t)i, A, b);
        joined_miss(&s->view, e, b, s->j->impulse + 6 * (size_t)e);
        memcpy(s->view.factor + 36 * i, A, 36 * sizeof *A);
    }
}

/* The speed that its impulses change a part by. */
static double speed_of(const struct solving *s, const struct part *part)
{
    double energy = 0, mass = 0;
    for (int32_t e = part->entry; e < part->end_entry; ++e) {
        const double *A = s->view.A + 36 * (size_t)s->view.s.body[e];
        energy += joined_energy(A, s->j->impulse + 6 * (size_t)e);
        mass += A[0];
    }
    return joined_speed(energy, mass);
}

/* C, to every part's A that is factored. */
static void add_contacts(const struct solving *s)
{
    const struct sadmm_contact_set *contacts = s->system->contacts;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        for (int side = 0; side < 2; ++side) {
            const int32_t body = pair_body(pair, side), e = body >= 0 ? s->j->entry[body] : -1;
            if (e >= 0)
                joined_add_contact(&contacts->points[pair->first], pair->count, side, s->j->speed[e],
                                   s->view.factor + 36 * (size_t)body);
        }
    }
}

/* ---- a part ------------------------------------------------------------------------------------------------------ */

/* Every row of every place. */
#define EACH_ROW(view, part, p, constraint, r)                                                        \
    for (int32_t p = (part)->place; p < (part)->end_place; ++p)                                       \
        for (const struct sadmm_row_constraint *constraint = joined_at(view, p), *end_ = constraint + 1; \
             constraint < end_; ++constraint)                                                         \
            for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)

static void begin_rows(const struct joined_view *v, const struct part *part)
{
    EACH_ROW(v, part, p, constraint, r) {
        joined_respond(v, constraint, r);
        joined_begin_row(v, constraint, r);
    }
}

static bool change_rows(const struct joined_view *v, const struct part *part)
{
    bool changed = false;
    EACH_ROW(v, part, p, constraint, r) changed = joined_change_row(v, constraint, r) || changed;
    return changed;
}

static void factorize(const struct joined_view *v, const struct part *part)
{
    for (int32_t p = part->place; p < part->end_place; ++p) {
        double *diagonal = v->diagonal + JOINED_BLOCK * (size_t)p;
        for (int k = 0; k < JOINED_ROWS; ++k)
            for (int q = 0; q <= k; ++q)
                diagonal[JOINED_ROWS * k + q] = joined_updated(v, p, joined_entry(v, p, p, k, q), k, q);
        joined_cholesky(diagonal);
        for (int32_t b = v->s.first_below[p]; b < v->s.first_below[p + 1]; ++b) {
            double *block = v->below + JOINED_BLOCK * (size_t)b;
            for (int k = 0; k < JOINED_ROWS; ++k) {
                for (int q = 0; q < JOINED_ROWS; ++q)
                    block[JOINED_ROWS * k + q] =
                        joined_updated(v, v->s.count + b, joined_entry(v, v->s.row[b], p, k, q), k, q);
                joined_forward(diagonal, block + JOINED_ROWS * k); /* L_ij = S_ij L_jj^-T */
            }
        }
    }
}

static void move_bodies(const struct joined_view *v, const struct part *part)
{
    for (int32_t e = part->entry; e < part->end_entry; ++e) joined_move(v, e);
}

/* Multipliers of rows inside their bounds, for what the others are. */
static void solve_rows(const struct joined_view *v, const struct part *part)
{
    EACH_ROW(v, part, p, constraint, r)
        if (v->state[r] == JOINED_INSIDE) v->change[r] = 0;
    move_bodies(v, part);
    for (int32_t p = part->place; p < part->end_place; ++p)
        for (int k = 0; k < JOINED_ROWS; ++k) v->right[JOINED_ROWS * (size_t)p + (size_t)k] = joined_right(v, p, k);
    for (int32_t p = part->place; p < part->end_place; ++p) {
        double *own = v->right + JOINED_ROWS * (size_t)p;
        for (int k = 0; k < JOINED_ROWS; ++k) own[k] = joined_forward_row(v, p, k);
        joined_forward(v->diagonal + JOINED_BLOCK * (size_t)p, own);
    }
    for (int32_t p = part->end_place - 1; p >= part->place; --p) {
        double *own = v->right + JOINED_ROWS * (size_t)p;
        for (int k = 0; k < JOINED_ROWS; ++k) own[k] = joined_backward_row(v, p, k);
        joined_backward(v->diagonal + JOINED_BLOCK * (size_t)p, own);
    }
    EACH_ROW(v, part, p, constraint, r)
        if (v->state[r] == JOINED_INSIDE)
            v->change[r] = v->right[JOINED_ROWS * (size_t)p + (size_t)(r - constraint->first)];
    move_bodies(v, part);
}

static bool is_finite(const struct joined_view *v, const struct part *part)
{
    double sum = 0;
    for (int32_t e = part->entry; e < part->end_entry; ++e)
        for (size_t k = 0; k < 6; ++k) sum += v->dv[6 * (size_t)v->s.body[e] + k] * 0;
    EACH_ROW(v, part, p, constraint, r) sum += v->change[r] * 0;
    return sum == 0;
}

/* Is it solved? A part whose rows have not settled is left as it is: velocities that go with multipliers beyond their
 * bounds have energy from nowhere. */
static bool solve_part(const struct solving *s, const struct part *part)
{
    const struct joined_view *v = &s->view;
    bool solved = false;
    for (int32_t e = part->entry; e < part->end_entry; ++e) joined_factor_body(v, e);
    begin_rows(v, part);
    for (int pass = 0; pass < JOINED_PASSES && !solved; ++pass) {
        factorize(v, part);
        solve_rows(v, part);
        solved = !change_rows(v, part);
    }
    solved = solved && is_finite(v, part);
    for (int32_t e = part->entry; solved && e < part->end_entry; ++e)
        for (size_t k = 0; k < 6; ++k) v->velocity[6 * (size_t)v->s.body[e] + k] += v->dv[6 * (size_t)v->s.body[e] + k];
    EACH_ROW(v, part, p, constraint, r) s->system->rows->lambda[r] = solved ? joined_bounded(v, r) : v->lambda[r];
    return solved;
}

/* ---- before and after the iterations ----------------------------------------------------------------------------- */

static bool is_touched(const struct sadmm_joined *j, const struct part *part)
{
    for (int32_t e = part->entry; e < part->end_entry; ++e)
        if (j->touched[e]) return true;
    return false;
}

/* Is it after the iterations as it was solved before them? No contact touches it. */
static bool is_kept(const struct sadmm_joined *j, const struct part *part)
{
    return j->kept_part[part->entry] && !is_touched(j, part);
}

/* What the momentum misses is the contacts' to mend in the paper's method: its velocity is not the one that goes with
 * the impulses (docs/algorithm.md, section 6), and rows alone would have to carry the difference. */
static void leave_to_contacts(const struct joined_view *v, const struct part *part)
{
    for (int32_t e = part->entry; e < part->end_entry; ++e)
        memset(v->missing + 6 * (size_t)v->s.body[e], 0, 6 * sizeof(double));
}

/* solved: else the iterations' end is better than what they began with. */
static void keep_part(const struct solving *s, const struct part *part, bool solved)
{
    const struct joined_view *v = &s->view;
    s->j->kept_part[part->entry] = solved;
    for (int32_t e = part->entry; e < part->end_entry; ++e)
        memcpy(s->j->kept_velocity + 6 * (size_t)e, v->velocity + 6 * (size_t)v->s.body[e], 6 * sizeof(double));
    EACH_ROW(v, part, p, constraint, r) s->j->kept_lambda[r] = s->system->rows->lambda[r];
}

static void take_kept(const struct solving *s, const struct part *part)
{
    const struct joined_view *v = &s->view;
    for (int32_t e = part->entry; e < part->end_entry; ++e)
        memcpy(v->velocity + 6 * (size_t)v->s.body[e], s->j->kept_velocity + 6 * (size_t)e, 6 * sizeof(double));
    EACH_ROW(v, part, p, constraint, r) s->system->rows->lambda[r] = s->j->kept_lambda[r];
}

sadmm_status sadmm_joined_solve(struct sadmm_joined *joined, const struct sadmm_system *system,
                                const struct sadmm_row_constraint *slots, size_t slot_count,
                                const struct sadmm_settings *settings, bool after, struct sadmm_error *error)
{
    struct solving s = {
        .j = joined, .system = system, .slots = slots, .slot_count = slot_count, .settings = settings};
    if (!find_order(&s) || !make_view(&s)) return sadmm_fail_memory(error, "joined bodies");
    const bool kept = after && joined->kept; /* by the same contacts */
    bool all_kept = kept;
    for (int32_t k = 0; k < s.view.s.parts && all_kept; ++k) {
        const struct part part = part_of(&s.view.s, k);
        all_kept = is_kept(joined, &part);
    }
    if (!all_kept) find_impulses(&s);
    for (int32_t k = 0; k < s.view.s.parts; ++k) {
        const struct part part = part_of(&s.view.s, k);
        const bool solves = !(kept && is_kept(joined, &part));
        if (solves) find_missing(&s, &part);
        const double speed = solves ? speed_of(&s, &part) : 0;
        for (int32_t e = part.entry; e < part.end_entry; ++e) joined->speed[e] = speed;
    }
    if (!all_kept) add_contacts(&s);
    for (int32_t k = 0; k < s.view.s.parts; ++k) {
        const struct part part = part_of(&s.view.s, k);
        if (kept && is_kept(joined, &part)) {
            take_kept(&s, &part);
            continue;
        }
        if (is_touched(joined, &part) && settings->method == SADMM_METHOD_PAPER) leave_to_contacts(&s.view, &part);
        const bool solved = solve_part(&s, &part);
        if (!after) keep_part(&s, &part, solved);
    }
    joined->kept = !after;
    return SADMM_OK;
}
