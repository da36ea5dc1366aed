#include "joined.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/system_math.h"
#include "joined_order.h"

/* A part, and what is known of it from call to call. */
struct part {
    struct joined_view view; /* arrays in `work` */
    double *impulse;         /* bodies x 6, in lists of all parts: J^T lambda; */
    double *kept_velocity;   /* that before the iterations */
    double speed;            /* that its impulses change it by; 0: it is not solved */
    bool touched;            /* by a contact */
    bool kept;               /* solved before the iterations: */
    uint8_t *kept_state;     /* rows; in `kept_states` */
};

struct sadmm_joined {
    struct sadmm_joined_order order;
    int32_t *bodies;        /* two a constraint: what the order was made for */
    size_t constraints;
    int32_t body_count;
    struct part *parts;
    int32_t *part, *entry;  /* bodies: the part, -1: not joined; number in it */
    double *work;           /* of all views */
    double *impulse;        /* joined bodies x 6 */
    bool kept;              /* velocities and multipliers from before the iterations are in: */
    double *kept_velocity, *kept_lambda; /* joined bodies x 6; rows */
    uint8_t *kept_states;                /* places x JOINED_ROWS of all parts */
    size_t bodies_capacity, part_capacity, entry_capacity, parts_capacity, work_capacity, impulse_capacity,
        kept_velocity_capacity, kept_lambda_capacity, kept_states_capacity;
};

/* One call. */
struct solving {
    struct sadmm_joined *j;
    const struct sadmm_system *system;
    const struct sadmm_row_constraint *slots;
    size_t slot_count;
    const struct sadmm_settings *settings;
};

struct sadmm_joined *sadmm_joined_create(void)
{
    return (struct sadmm_joined *)sadmm_alloc(1, sizeof(struct sadmm_joined));
}

void sadmm_joined_destroy(struct sadmm_joined *j)
{
    if (!j) return;
    sadmm_joined_order_free(&j->order);
    void *blocks[] = {j->bodies,  j->parts,         j->part,        j->entry,      j->work,
                      j->impulse, j->kept_velocity, j->kept_lambda, j->kept_states};
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

/* Views, and which bodies they have. */
static bool make_parts(struct sadmm_joined *j, size_t bodies)
{
    const size_t parts = (size_t)j->order.parts;
    size_t work = 0, joined = 0, places = 0;
    for (int32_t k = 0; k < j->order.parts; ++k) {
        const struct joined_structure s = sadmm_joined_part(&j->order, k);
        work += joined_work_size(&s);
        joined += (size_t)s.bodies;
        places += (size_t)s.places;
    }
    if (!sadmm_grow_empty(&j->parts, &j->parts_capacity, parts, sizeof *j->parts) ||
        !sadmm_grow_empty(&j->work, &j->work_capacity, work, sizeof *j->work) ||
        !sadmm_grow_empty(&j->kept_states, &j->kept_states_capacity, JOINED_ROWS * places, sizeof *j->kept_states) ||
        !sadmm_grow_empty(&j->impulse, &j->impulse_capacity, 6 * joined, sizeof *j->impulse) ||
        !sadmm_grow_empty(&j->kept_velocity, &j->kept_velocity_capacity, 6 * joined, sizeof *j->kept_velocity))
        return false;
    for (size_t i = 0; i < bodies; ++i) j->part[i] = -1;
    work = joined = places = 0;
    for (int32_t k = 0; k < j->order.parts; ++k) {
        const struct joined_structure s = sadmm_joined_part(&j->order, k);
        j->parts[k] = (struct part){.view = joined_view_at(&s, j->work + work), .impulse = j->impulse + 6 * joined,
                                    .kept_velocity = j->kept_velocity + 6 * joined,
                                    .kept_state = j->kept_states + JOINED_ROWS * places};
        for (int32_t e = 0; e < s.bodies; ++e) {
            j->part[s.body[e]] = k;
            j->entry[s.body[e]] = e;
        }
        work += joined_work_size(&s);
        joined += (size_t)s.bodies;
        places += (size_t)s.places;
    }
    return true;
}

static bool find_order(const struct solving *s)
{
    struct sadmm_joined *j = s->j;
    const size_t n = s->slot_count, bodies = (size_t)s->system->body_count;
    if (same_graph(s)) return true;
    j->constraints = 0;
    if (!sadmm_grow_empty(&j->bodies, &j->bodies_capacity, 2 * n, sizeof *j->bodies) ||
        !sadmm_grow_empty(&j->part, &j->part_capacity, bodies, sizeof *j->part) ||
        !sadmm_grow_empty(&j->entry, &j->entry_capacity, bodies, sizeof *j->entry))
        return false;
    for (size_t k = 0; k < n; ++k) {
        j->bodies[2 * k] = s->slots[k].body_a;
        j->bodies[2 * k + 1] = s->slots[k].body_b;
    }
    if (!sadmm_joined_order_make(&j->order, j->bodies, (int32_t)n, s->system->body_count, SADMM_JOINED_AROUND))
        return false;
    if (!make_parts(j, bodies)) {
        sadmm_joined_order_free(&j->order); /* no parts without their views */
        return false;
    }
    j->constraints = n;
    j->body_count = s->system->body_count;
    return true;
}

/* ---- what there is ----------------------------------------------------------------------------------------------- */

/* What is done with a side of a pair at a joined body, number `entry` of its part. */
typedef void on_side(struct part *, const struct sadmm_contact_point *, int32_t count, int side, size_t entry);

static void each_contact(const struct solving *s, on_side *f)
{
    const struct sadmm_contact_set *contacts = s->system->contacts;
    const struct sadmm_joined *j = s->j;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        for (int side = 0; side < 2; ++side) {
            const int32_t body = side ? pair->body_b : pair->body_a;
            if (body < 0 || j->part[body] < 0) continue;
            f(&j->parts[j->part[body]], &contacts->points[pair->first], pair->count, side, (size_t)j->entry[body]);
        }
    }
}

static const double *arm_of(const struct sadmm_contact_point *point, int side)
{
    return side ? point->arm_b : point->arm_a;
}

static void add_impulse(struct part *part, const struct sadmm_contact_point *points, int32_t count, int side,
                        size_t entry)
{
    part->touched = true;
    for (int32_t p = 0; p < count; ++p)
        for (size_t k = 0; k < 6; ++k)
            part->impulse[6 * entry + k] +=
                joined_point_load(arm_of(&points[p], side), points[p].impulse, side, (int)k);
}

/* C, to A where the part is solved. */
static void add_weight(struct part *part, const struct sadmm_contact_point *points, int32_t count, int side,
                       size_t entry)
{
    double *A = part->view.factor + 36 * entry, load = 0;
    for (int32_t p = 0; p < count; ++p) load += v3_norm(v3_load(points[p].impulse));
    const double B = joined_contact_weight(load, count, part->speed);
    for (int32_t p = 0; B > 0 && p < count; ++p)
        for (int k = 0; k < 6; ++k)
            for (int q = 0; q <= k; ++q)
                A[6 * k + q] += B * joined_point_entry(arm_of(&points[p], side), k, q);
}

static void find_impulses(const struct solving *s)
{
    struct sadmm_joined *j = s->j;
    for (int32_t k = 0; k < j->order.parts; ++k) {
        struct part *part = &j->parts[k];
        part->touched = false;
        memset(part->impulse, 0, 6 * (size_t)part->view.s.bodies * sizeof *part->impulse);
    }
    each_contact(s, add_impulse);
}

static void load_row(const struct solving *s, size_t from, struct joined_row *to)
{
    const struct sadmm_rows *rows = s->system->rows;
    memcpy(to->jacobian[0], rows->jacobian_a + 6 * from, sizeof to->jacobian[0]);
    memcpy(to->jacobian[1], rows->jacobian_b + 6 * from, sizeof to->jacobian[1]);
    to->gain = rows->gain[from], to->bias = rows->bias[from], to->compliance = rows->compliance[from];
    to->lo = rows->lo[from], to->hi = rows->hi[from], to->lambda = rows->lambda[from];
}

/* Goes through the rows of a part: r, which is row `from` of the system. */
#define EACH_ROW(s, v, r, from)                                                                         \
    for (int32_t p_ = 0; p_ < (v)->s.places; ++p_)                                                      \
        for (int32_t r = JOINED_ROWS * p_, from = (s)->slots[(v)->s.constraint[p_]].first,              \
                     end_ = r + (s)->slots[(v)->s.constraint[p_]].count;                                \
             r < end_; ++r, ++from)

/* Rows; velocities; A, and b - A v + J^T lambda; the speed that its impulses change the part by. */
static void load_part(const struct solving *s, struct part *part)
{
    const struct joined_view *v = &part->view;
    double energy = 0, mass = 0;
    memset(v->rows, 0, (size_t)(JOINED_ROWS * v->s.places) * sizeof *v->rows);
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r) joined_put_row(v, r, false);
    EACH_ROW(s, v, r, from) {
        load_row(s, (size_t)from, &v->rows[r]);
        joined_put_row(v, r, true);
    }
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        const size_t i = (size_t)v->s.body[e];
        double *A = v->factor + 36 * (size_t)e, *impulse = part->impulse + 6 * (size_t)e, b[6];
        memcpy(v->velocity + 6 * (size_t)e, s->system->velocity + 6 * i, 6 * sizeof *v->velocity);
        for (int32_t at = v->s.first_around[e]; at < v->s.first_around[e + 1]; ++at)
            for (int k = 0; k < 6; ++k) impulse[k] += joined_row_load(v, v->s.around[at], k);
        sadmm_system_body(s->system, s->settings, (int32_t)i, A, b);
        for (int k = 0; k < 6; ++k) v->missing[6 * e + k] = joined_missing(v, e, k, b[k], impulse[k]);
        energy += joined_energy(A, impulse);
        mass += A[0];
    }
    part->speed = joined_speed(energy, mass);
}

/* ---- a part ------------------------------------------------------------------------------------------------------ */

/* earlier: states of a solve of this step; NULL: none. */
static void begin_rows(const struct joined_view *v, const uint8_t *earlier)
{
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r) {
        for (int side = 0; side < 2; ++side) joined_respond(v, r, side);
        if (v->state[r] != JOINED_ABSENT) joined_begin_row(v, r, earlier ? earlier[r] : JOINED_ABSENT);
    }
}

static bool change_rows(const struct joined_view *v)
{
    bool changed = false;
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r) changed = joined_change_row(v, r) || changed;
    return changed;
}

/* A node with all that is taken from it. */
static void make_node(const struct joined_view *v, int32_t node, int32_t row, int32_t column, int32_t common,
                      double *to)
{
    for (int tile = 0; tile < JOINED_TILES; ++tile) {
        if (row == column && joined_tile_is_above(tile)) continue;
        struct joined_tile t = joined_enter(v, row, column, common, tile);
        joined_update(v, v->s.first_update[node], v->s.first_update[node + 1], tile, &t);
        joined_store_tile(to, tile, &t);
    }
}

static void factorize(const struct joined_view *v)
{
    for (int32_t p = 0; p < v->s.places; ++p) {
        double *diagonal = v->diagonal + JOINED_BLOCK * (size_t)p, L[JOINED_BLOCK];
        make_node(v, p, p, p, JOINED_OWN, diagonal);
        ldl6_factor(diagonal, L);
        for (int k = 0; k < JOINED_ROWS; ++k) joined_invert_row(v, L, p, k);
        for (int32_t b = v->s.first_below[p]; b < v->s.first_below[p + 1]; ++b) {
            make_node(v, v->s.places + b, v->s.row[b], p, v->s.common[b], v->below + JOINED_BLOCK * (size_t)b);
            for (int k = 0; k < JOINED_ROWS; ++k) joined_finish_row(v, L, b, k);
        }
    }
}

static void move_bodies(const struct joined_view *v)
{
    for (int32_t e = 0; e < v->s.bodies; ++e)
        for (int k = 0; k < 6; ++k) joined_move(v, e, k);
}

/* Multipliers of rows inside their bounds, for what the others are. again: from what they are. */
static void solve_rows(const struct joined_view *v, bool again)
{
    const int32_t rows = JOINED_ROWS * v->s.places;
    for (int32_t r = 0; r < rows; ++r) joined_put_change(v, r, again, false);
    if (!again) move_bodies(v);
    for (int32_t r = 0; r < rows; ++r) v->right[r] = joined_right(v, r, again);
    for (int32_t p = 0; p < v->s.places; ++p) {
        for (int k = 0; k < JOINED_ROWS; ++k)
            joined_push_right(v, p, v->s.first_update[p], v->s.first_update[p + 1], k);
        for (int k = 0; k < JOINED_ROWS; ++k) joined_find_forward(v, JOINED_ROWS * p + k);
    }
    for (int32_t r = 0; r < rows; ++r) joined_turn(v, r);
    for (int32_t p = v->s.places - 1; p >= 0; --p) {
        for (int k = 0; k < JOINED_ROWS; ++k)
            joined_pull_right(v, p, v->s.first_below[p], v->s.first_below[p + 1], k);
        for (int k = 0; k < JOINED_ROWS; ++k) joined_find_backward(v, JOINED_ROWS * p + k);
    }
    for (int32_t r = 0; r < rows; ++r) joined_put_change(v, r, again, true);
    move_bodies(v);
}

static bool give_much(const struct joined_view *v)
{
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r)
        if (joined_gives_much(v, r)) return true;
    return false;
}

static bool is_finite(const struct joined_view *v)
{
    double sum = 0;
    for (int32_t k = 0; k < 6 * v->s.bodies; ++k) sum += v->dv[k] * 0;
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r) sum += v->change[r] * 0;
    return sum == 0;
}

/* Is it solved? A part whose rows have not settled is left as it is: velocities that go with multipliers beyond their
 * bounds have energy from nowhere. */
static bool solve_part(const struct solving *s, const struct part *part, const uint8_t *earlier)
{
    const struct joined_view *v = &part->view;
    bool solved = false;
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        ldl6_factor(v->factor + 36 * (size_t)e, v->factor + 36 * (size_t)e);
        ldl6_solve(v->factor + 36 * (size_t)e, v->missing + 6 * (size_t)e, v->missing + 6 * (size_t)e);
    }
    begin_rows(v, earlier);
    for (int pass = 0; pass < JOINED_PASSES && !solved; ++pass) {
        factorize(v);
        solve_rows(v, false);
        if (change_rows(v)) continue;
        solved = true;
        if (!give_much(v)) continue;
        solve_rows(v, true);
        solved = !change_rows(v);
    }
    if (!solved || !is_finite(v)) return false;
    for (int32_t e = 0; e < v->s.bodies; ++e)
        for (int k = 0; k < 6; ++k)
            s->system->velocity[6 * v->s.body[e] + k] = v->velocity[6 * e + k] + v->dv[6 * e + k];
    EACH_ROW(s, v, r, from) s->system->rows->lambda[from] = joined_bounded(v, r);
    return true;
}

/* ---- before and after the iterations ----------------------------------------------------------------------------- */

/* What the momentum misses is the contacts' to mend in the paper's method: its velocity is not the one that goes with
 * the impulses (docs/algorithm.md, section 6), and rows alone would have to carry the difference. */
static void leave_to_contacts(const struct joined_view *v)
{
    memset(v->missing, 0, 6 * (size_t)v->s.bodies * sizeof *v->missing);
}

/* solved: else the iterations' end is better than what they began with. */
static void keep_part(const struct solving *s, struct part *part, bool solved)
{
    const struct joined_view *v = &part->view;
    part->kept = solved;
    memcpy(part->kept_state, v->state, (size_t)(JOINED_ROWS * v->s.places));
    for (int32_t e = 0; e < v->s.bodies; ++e)
        memcpy(part->kept_velocity + 6 * e, s->system->velocity + 6 * v->s.body[e], 6 * sizeof(double));
    EACH_ROW(s, v, r, from) s->j->kept_lambda[from] = s->system->rows->lambda[from];
}

static void take_kept(const struct solving *s, const struct part *part)
{
    const struct joined_view *v = &part->view;
    for (int32_t e = 0; e < v->s.bodies; ++e)
        memcpy(s->system->velocity + 6 * v->s.body[e], part->kept_velocity + 6 * e, 6 * sizeof(double));
    EACH_ROW(s, v, r, from) s->system->rows->lambda[from] = s->j->kept_lambda[from];
}

/* Is it as it was solved before the iterations? No contact touches it. */
static bool is_solved(const struct part *part) { return part->kept && !part->touched; }

sadmm_status sadmm_joined_solve(struct sadmm_joined *joined, const struct sadmm_system *system,
                                const struct sadmm_row_constraint *slots, size_t slot_count,
                                const struct sadmm_settings *settings, bool after, struct sadmm_error *error)
{
    const struct solving s = {joined, system, slots, slot_count, settings};
    if (!find_order(&s) || !sadmm_grow_empty(&joined->kept_lambda, &joined->kept_lambda_capacity,
                                             system->rows->row_count, sizeof *joined->kept_lambda))
        return sadmm_fail_memory(error, "joined bodies");
    const bool kept = after && joined->kept; /* by the same contacts */
    bool solves = !kept;
    for (int32_t k = 0; k < joined->order.parts; ++k) {
        struct part *part = &joined->parts[k];
        part->speed = 0;
        part->kept = kept && part->kept;
        solves = solves || !is_solved(part);
    }
    if (solves) find_impulses(&s);
    for (int32_t k = 0; k < joined->order.parts; ++k)
        if (!is_solved(&joined->parts[k])) load_part(&s, &joined->parts[k]);
    if (solves) each_contact(&s, add_weight);
    for (int32_t k = 0; k < joined->order.parts; ++k) {
        struct part *part = &joined->parts[k];
        if (is_solved(part)) {
            take_kept(&s, part);
            continue;
        }
        if (part->touched && settings->method == SADMM_METHOD_PAPER) leave_to_contacts(&part->view);
        const bool solved = solve_part(&s, part, part->kept ? part->kept_state : NULL);
        if (!after) keep_part(&s, part, solved);
    }
    joined->kept = !after;
    return SADMM_OK;
}
