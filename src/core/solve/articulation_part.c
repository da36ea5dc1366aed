#include "articulation_part.h"

#include <math.h>
#include <string.h>

#include "core/model/system_math.h"

/* ---- what there is ----------------------------------------------------------------------------------------------- */

static void load_row(const struct sadmm_rows *rows, size_t from, struct articulation_row *to)
{
    memcpy(to->jacobian[0], rows->jacobian_a + 6 * from, sizeof to->jacobian[0]);
    memcpy(to->jacobian[1], rows->jacobian_b + 6 * from, sizeof to->jacobian[1]);
    to->gain = rows->gain[from], to->bias = rows->bias[from], to->compliance = rows->compliance[from];
    to->lo = rows->lo[from], to->hi = rows->hi[from], to->lambda = rows->lambda[from];
}

static void load_rows(const struct articulation_view *v, const struct sadmm_rows *rows,
                      const struct sadmm_row_constraint *slots)
{
    const size_t count = (size_t)(SADMM_MAX_ROWS * v->s.columns);
    memset(v->state, ROW_ABSENT, count);
    memset(v->change, 0, count * sizeof *v->change);
    EACH_ARTICULATION_ROW(slots, v, r, from) {
        load_row(rows, (size_t)from, &v->rows[r]);
        v->state[r] = ROW_INSIDE;
    }
}

/* Numbers of rows that are not there are 0 for the sparse factor. */
static void clear_absent_rows(const struct articulation_view *v)
{
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
        if (v->state[r] == ROW_ABSENT) memset(&v->rows[r], 0, sizeof v->rows[r]);
        v->regularisation[r] = 0;
    }
}

static void add_row_loads(const struct articulation_part *part, int32_t e)
{
    const struct articulation_view *v = &part->view;
    double *impulse = part->impulse + 6 * (size_t)e, contacts[6];
    memcpy(contacts, impulse, sizeof contacts);
    for (int32_t at = v->s.first_around[e]; at < v->s.first_around[e + 1]; ++at)
        for (int k = 0; k < 6; ++k) impulse[k] += articulation_row_load(v, v->s.around[at], k);
    for (int k = 0; k < 6; ++k)
        v->residual[6 * e + k] = articulation_body_residual(v, e, k, part->without[6 * e + k], impulse[k]);
    for (int k = 0; k < 6; ++k) part->without[6 * e + k] = v->residual[6 * e + k] - contacts[k];
}

void sadmm_articulation_part_load(struct articulation_part *part, const struct sadmm_system *system,
                                  const struct sadmm_settings *settings, const struct sadmm_row_constraint *slots)
{
    const struct articulation_view *v = &part->view;
    for (int32_t e = 0; e < v->s.bodies; ++e)
        memcpy(v->velocity + 6 * (size_t)e, system->velocity + 6 * v->s.body[e], 6 * sizeof *v->velocity);
    sadmm_articulation_part_load_at(part, system, settings, slots);
}

/* How a row's rate responds to its multiplier, by the bodies' A. */
static double scale_by_inertia(const struct articulation_view *v, int32_t r)
{
    double own[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
        const int32_t e = v->s.side[2 * (r / SADMM_MAX_ROWS) + side];
        double L[36], response[6];
        if (e < 0) continue;
        ldl6_factor(v->factor + 36 * (size_t)e, L);
        ldl6_solve(L, v->rows[r].jacobian[side], response);
        own[side] = six_product(v->rows[r].jacobian[side], response);
    }
    return articulation_scale_of(own[0], own[1]);
}

/* Limits that a loop near its dead point cannot get to, say, get there as far as they can. */
static void let_rows_give(const struct articulation_view *v)
{
    static const double share = 1e-2;
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
        struct articulation_row *row = &v->rows[r];
        if (v->state[r] == ROW_ABSENT || (row->lo == -HUGE_VAL && row->hi == HUGE_VAL)) continue;
        row->compliance += share * row->gain * scale_by_inertia(v, r);
    }
}

void sadmm_articulation_part_load_at(struct articulation_part *part, const struct sadmm_system *system,
                                     const struct sadmm_settings *settings, const struct sadmm_row_constraint *slots)
{
    const struct articulation_view *v = &part->view;
    for (int32_t e = 0; e < v->s.bodies; ++e)
        sadmm_system_body(system, settings, v->s.body[e], v->factor + 36 * (size_t)e, part->without + 6 * (size_t)e);
    if (part->gives) {
        load_rows(v, system->rows, slots);
        let_rows_give(v);
    }
    part->loaded = false;
    part->by_tree = settings->ncp_points > 0 && part->tree.nodes > 0 &&
                    part->kernels->load(&part->tree, v, slots, part->gives ? NULL : system->rows, part->impulse,
                                        part->without);
    if (part->by_tree) return;
    load_rows(v, system->rows, slots);
    if (part->gives) let_rows_give(v);
    clear_absent_rows(v);
    for (int32_t e = 0; e < v->s.bodies; ++e) add_row_loads(part, e);
}

void sadmm_articulation_part_renew(struct articulation_part *part, const struct sadmm_system *system,
                                   const struct sadmm_settings *settings, const uint8_t *changed)
{
    const struct articulation_view *v = &part->view;
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        double *A = v->factor + 36 * (size_t)e, *residual = v->residual + 6 * (size_t)e,
               *without = part->without + 6 * (size_t)e, b[6];
        if (!changed[v->s.body[e]]) continue;
        sadmm_system_body(system, settings, v->s.body[e], A, b);
        for (int k = 0; k < 6; ++k) {
            const double contacts = residual[k] - without[k];
            residual[k] = articulation_body_residual(v, e, k, b[k], part->impulse[6 * e + k]);
            without[k] = residual[k] - contacts;
        }
    }
    part->tree.known = false;
}

void sadmm_articulation_part_find_speed(struct articulation_part *part)
{
    const struct articulation_view *v = &part->view;
    double energy = 0, mass = 0;
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        const double *A = v->factor + 36 * (size_t)e;
        energy += articulation_energy(A, part->impulse + 6 * (size_t)e);
        mass += A[0];
    }
    part->speed = articulation_speed(energy, mass);
}

void sadmm_articulation_part_put_contacts(const struct articulation_part *part, const double *loads)
{
    for (int32_t k = 0; k < 6 * part->view.s.bodies; ++k) part->view.residual[k] = part->without[k] + loads[k];
}

/* The factors of the bodies' A + C, and their response to the residual: the free change. */
static void free_bodies(const struct articulation_view *v)
{
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        ldl6_factor(v->factor + 36 * (size_t)e, v->factor + 36 * (size_t)e);
        ldl6_solve(v->factor + 36 * (size_t)e, v->residual + 6 * (size_t)e, v->residual + 6 * (size_t)e);
    }
}

/* ---- its rows ---------------------------------------------------------------------------------------------------- */

/* Where rows are before the first pass. */
static void begin_rows(const struct articulation_part *part, const uint8_t *earlier)
{
    const struct articulation_view *v = &part->view;
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
        for (int side = 0; side < 2; ++side) articulation_respond(v, r, side);
        const double hard = articulation_regularisation(v, r);
        if (v->state[r] != ROW_ABSENT) articulation_begin_row(v, r, earlier ? earlier[r] : ROW_ABSENT, hard);
    }
}

double sadmm_articulation_part_scale(const struct articulation_part *part, int32_t r)
{
    return part->by_tree ? scale_by_inertia(&part->view, r) : articulation_scale(&part->view, r);
}

/* Rows that left their bounds, or are at them against their law: did any change its state? */
static bool change_rows(const struct articulation_view *v)
{
    bool changed = false;
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) changed = articulation_change_row(v, r) || changed;
    return changed;
}

/* A node with all that is taken from it. */
static void make_node(const struct articulation_view *v, int32_t node, int32_t row, int32_t column, int32_t common,
                      double *to)
{
    for (int tile = 0; tile < ARTICULATION_TILES; ++tile) {
        if (row == column && articulation_tile_is_above(tile)) continue;
        struct articulation_tile t = articulation_enter(v, row, column, common, tile);
        articulation_update(v, v->s.first_update[node], v->s.first_update[node + 1], tile, &t);
        articulation_store_tile(to, tile, &t);
    }
}

static void factorize(const struct articulation_view *v)
{
    for (int32_t p = 0; p < v->s.columns; ++p) {
        double *diagonal = v->diagonal + ARTICULATION_BLOCK * (size_t)p, L[ARTICULATION_BLOCK];
        make_node(v, p, p, p, ARTICULATION_OWN, diagonal);
        ldl6_factor(diagonal, L);
        for (int k = 0; k < SADMM_MAX_ROWS; ++k) articulation_invert_row(v, L, p, k);
        for (int32_t b = v->s.first_below[p]; b < v->s.first_below[p + 1]; ++b) {
            make_node(v, v->s.columns + b, v->s.row[b], p, v->s.common[b], v->below + ARTICULATION_BLOCK * (size_t)b);
            for (int k = 0; k < SADMM_MAX_ROWS; ++k) articulation_finish_row(v, L, b, k);
        }
    }
}

static void move_bodies(const struct articulation_view *v)
{
    for (int32_t e = 0; e < v->s.bodies; ++e)
        for (int k = 0; k < 6; ++k) articulation_move(v, e, k);
}

static void solve_rows(const struct articulation_view *v, bool again)
{
    const int32_t rows = SADMM_MAX_ROWS * v->s.columns;
    for (int32_t r = 0; r < rows; ++r) articulation_put_change(v, r, again, false);
    if (!again) move_bodies(v);
    for (int32_t r = 0; r < rows; ++r) v->right[r] = articulation_right(v, r, again);
    for (int32_t p = 0; p < v->s.columns; ++p) {
        for (int k = 0; k < SADMM_MAX_ROWS; ++k)
            articulation_scatter_right(v, p, v->s.first_update[p], v->s.first_update[p + 1], k);
        for (int k = 0; k < SADMM_MAX_ROWS; ++k) articulation_find_forward(v, SADMM_MAX_ROWS * p + k);
    }
    for (int32_t r = 0; r < rows; ++r) articulation_turn(v, r);
    for (int32_t p = v->s.columns - 1; p >= 0; --p) {
        for (int k = 0; k < SADMM_MAX_ROWS; ++k)
            articulation_gather_right(v, p, v->s.first_below[p], v->s.first_below[p + 1], k);
        for (int k = 0; k < SADMM_MAX_ROWS; ++k) articulation_find_backward(v, SADMM_MAX_ROWS * p + k);
    }
    for (int32_t r = 0; r < rows; ++r) articulation_put_change(v, r, again, true);
    move_bodies(v);
}

void sadmm_articulation_part_factorize(struct articulation_part *part)
{
    if (part->by_tree) part->kernels->factorize(&part->tree, &part->view);
    else factorize(&part->view);
}

void sadmm_articulation_part_solve_rows(struct articulation_part *part, bool again)
{
    if (part->by_tree) (void)part->kernels->solve(&part->tree, &part->view, again);
    else solve_rows(&part->view, again);
}

static bool needs_refinement(const struct articulation_view *v)
{
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r)
        if (articulation_needs_refinement(v, r)) return true;
    return false;
}

static bool is_finite(const struct articulation_view *v)
{
    double sum = 0;
    for (int32_t k = 0; k < 6 * v->s.bodies; ++k) sum += v->dv[k] * 0;
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) sum += v->change[r] * 0;
    return sum == 0;
}

/* The largest residual of a row inside its bounds, m/s or rad/s. */
static double largest_residual(const struct articulation_view *v)
{
    double most = 0;
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) most = fmax(most, articulation_residual_size(v, r));
    return most;
}

/* Of inconsistent rows, which are solved once more. */
static void drop_residuals(const struct articulation_view *v)
{
    const int32_t rows = SADMM_MAX_ROWS * v->s.columns;
    for (int32_t r = 0; r < rows; ++r) articulation_drop_residual(v, r);
    solve_rows(v, false);
}

/* Iterative refinement: each solve takes away nearly all of what the regularisation has left, but where light bodies
 * between heavy ones pass on a load. Where it does not, they are inconsistent. Have rows stayed in their states? */
static bool refine(struct articulation_part *part)
{
    const struct articulation_view *v = &part->view;
    double residual = largest_residual(v), last = HUGE_VAL;
    for (int pass = 0; pass < ARTICULATION_REFINEMENTS && residual > ARTICULATION_EXACT && residual < last / 2;
         ++pass) {
        last = residual;
        solve_rows(v, true);
        residual = largest_residual(v);
    }
    const bool drops = articulation_is_inconsistent(residual, last);
    if (drops) drop_residuals(v);
    if (drops) part->missed = HUGE_VAL;
    else if (part->missed < HUGE_VAL) part->missed = residual;
    return !change_rows(v);
}

static bool solve_sparse(struct articulation_part *part, const uint8_t *earlier, bool exact)
{
    const struct articulation_view *v = &part->view;
    bool solved = false;
    free_bodies(v);
    begin_rows(part, earlier);
    for (int pass = 0; pass < ARTICULATION_PASSES && !solved; ++pass) {
        factorize(v);
        solve_rows(v, false);
        if (change_rows(v)) continue;
        solved = true;
        if (exact) {
            solved = refine(part);
        } else if (needs_refinement(v)) {
            const double before = largest_residual(v);
            solve_rows(v, true);
            if (articulation_is_inconsistent(largest_residual(v), before)) drop_residuals(v);
            solved = !change_rows(v);
        }
    }
    return solved && is_finite(v);
}

/* ---- by its tree ------------------------------------------------------------------------------------------------- */

static void begin_tree_rows(struct articulation_part *part, const uint8_t *earlier)
{
    const struct articulation_view *v = &part->view;
    bool pressed = false;
    for (int32_t at = 0; at < part->tree.rows; ++at) {
        struct articulation_tree_row *row = &part->tree.row[at];
        const struct articulation_row *from = &v->rows[row->r];
        const double lo = from->lo, hi = from->hi;
        const uint8_t before = earlier ? earlier[row->r] : ROW_ABSENT;
        row->lo = lo, row->hi = hi;
        if (row->role == ARTICULATION_LOCK && lo == -HUGE_VAL && hi == HUGE_VAL) {
            v->change[row->r] = 0;
            v->state[row->r] = ROW_INSIDE;
            continue;
        }
        const double change = articulation_clamp(row->lambda, lo, hi) - row->lambda;
        v->change[row->r] = change;
        if (row->gain != 0 && before == ROW_INSIDE && hi > lo) {
            v->state[row->r] = ROW_INSIDE;
            continue;
        }
        articulation_place_row(v, row->r, before, row->start + row->compliance * change);
        pressed = pressed || (v->state[row->r] != ROW_INSIDE && v->change[row->r] != 0);
    }
    part->tree.pressed = pressed;
}

/* change_rows. one: the first of them alone, which comes to an end where all at once go round in circles (Murty,
 * 1974). */
static bool change_tree_rows(struct articulation_part *part, bool one)
{
    bool changed = false;
    if (!part->tree.unsettled) return false;
    for (int32_t at = 0; at < part->tree.rows && !(changed && one); ++at) {
        const struct articulation_tree_row *row = &part->tree.row[at];
        if (row->role != ARTICULATION_LOCK)
            changed = articulation_settle_row(&part->view, row->r, row->residual) || changed;
    }
    part->tree.pressed = part->tree.pressed || changed;
    return changed;
}

/* A row that says what another one says has no multiplier. If it asks for another rate, it goes to the bound that pulls
 * there: friction that a motor moves against. Did any? */
static bool yield_rows(struct articulation_part *part)
{
    bool changed = false;
    if (!part->tree.unsettled) return false;
    for (int32_t at = 0; at < part->tree.rows; ++at) {
        const struct articulation_tree_row *row = &part->tree.row[at];
        if (row->role == ARTICULATION_LEFT && part->view.state[row->r] == ROW_INSIDE)
            changed = articulation_yield_row(&part->view, row->r, row->residual) || changed;
    }
    part->tree.pressed = part->tree.pressed || changed;
    return changed;
}

static bool solve_tree(struct articulation_part *part)
{
    const struct articulation_view *v = &part->view;
    const struct sadmm_articulation_kernels *by = part->kernels;
    double residual = 0, last = HUGE_VAL;
    for (int pass = 0; pass < ARTICULATION_TREE_PASSES; ++pass) {
        by->factorize(&part->tree, v);
        residual = by->solve(&part->tree, v, false);
        if (yield_rows(part)) residual = by->solve(&part->tree, v, false);
        if (change_tree_rows(part, pass >= ARTICULATION_TOGETHER)) continue;
        for (int again = 0; again < ARTICULATION_REFINEMENTS && residual > ARTICULATION_EXACT && residual < last / 2;
             ++again) {
            last = residual;
            residual = by->solve(&part->tree, v, true);
        }
        if (last == HUGE_VAL || !change_tree_rows(part, false)) {
            part->missed = residual;
            return is_finite(v);
        }
        last = HUGE_VAL;
    }
    return false;
}

bool sadmm_articulation_part_solve(struct articulation_part *part, const uint8_t *earlier, bool exact)
{
    bool solved;
    part->missed = 0;
    if (part->by_tree) {
        begin_tree_rows(part, earlier);
        solved = solve_tree(part);
    } else solved = solve_sparse(part, earlier, exact);
    if (!solved || part->gives) part->missed = HUGE_VAL;
    return solved;
}

bool sadmm_articulation_part_solve_on(struct articulation_part *part)
{
    const bool solved = solve_tree(part);
    if (!solved) part->missed = HUGE_VAL;
    return solved;
}

void sadmm_articulation_part_store(const struct articulation_view *v, const struct sadmm_system *system,
                                   const struct sadmm_row_constraint *slots)
{
    for (int32_t e = 0; e < v->s.bodies; ++e)
        for (int k = 0; k < 6; ++k)
            system->velocity[6 * v->s.body[e] + k] = v->velocity[6 * e + k] + v->dv[6 * e + k];
    EACH_ARTICULATION_ROW(slots, v, r, from) system->rows->lambda[from] = articulation_bounded(v, r);
}
