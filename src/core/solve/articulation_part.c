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

void sadmm_articulation_part_load(struct articulation_part *part, const struct sadmm_system *system,
                                  const struct sadmm_settings *settings, const struct sadmm_row_constraint *slots)
{
    const struct articulation_view *v = &part->view;
    double energy = 0, mass = 0;
    memset(v->rows, 0, (size_t)(SADMM_MAX_ROWS * v->s.columns) * sizeof *v->rows);
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) articulation_put_row(v, r, false);
    EACH_ARTICULATION_ROW(slots, v, r, from) {
        load_row(system->rows, (size_t)from, &v->rows[r]);
        articulation_put_row(v, r, true);
    }
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        const size_t i = (size_t)v->s.body[e];
        double *A = v->factor + 36 * (size_t)e, *impulse = part->impulse + 6 * (size_t)e, b[6];
        memcpy(v->velocity + 6 * (size_t)e, system->velocity + 6 * i, 6 * sizeof *v->velocity);
        for (int32_t at = v->s.first_around[e]; at < v->s.first_around[e + 1]; ++at)
            for (int k = 0; k < 6; ++k) impulse[k] += articulation_row_load(v, v->s.around[at], k);
        sadmm_system_body(system, settings, (int32_t)i, A, b);
        for (int k = 0; k < 6; ++k) v->residual[6 * e + k] = articulation_body_residual(v, e, k, b[k], impulse[k]);
        energy += articulation_energy(A, impulse);
        mass += A[0];
    }
    part->speed = articulation_speed(energy, mass);
}

void sadmm_articulation_part_free(const struct articulation_view *v)
{
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        ldl6_factor(v->factor + 36 * (size_t)e, v->factor + 36 * (size_t)e);
        ldl6_solve(v->factor + 36 * (size_t)e, v->residual + 6 * (size_t)e, v->residual + 6 * (size_t)e);
    }
}

/* ---- its rows ---------------------------------------------------------------------------------------------------- */

void sadmm_articulation_part_begin_rows(const struct articulation_view *v, const uint8_t *earlier)
{
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
        for (int side = 0; side < 2; ++side) articulation_respond(v, r, side);
        if (v->state[r] != ROW_ABSENT) articulation_begin_row(v, r, earlier ? earlier[r] : ROW_ABSENT);
    }
}

bool sadmm_articulation_part_change_rows(const struct articulation_view *v)
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

void sadmm_articulation_part_factorize(const struct articulation_view *v)
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

void sadmm_articulation_part_solve_rows(const struct articulation_view *v, bool again)
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
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r)
        most = fmax(most, articulation_residual_size(v, r));
    return most;
}

/* Iterative refinement: each solve takes away nearly all of what the regularisation has left, but where light bodies
 * between heavy ones pass on a load. Rows that contradict each other are left: more of it would only make their
 * multipliers grow. Have they stayed in their states? */
static bool refine(const struct articulation_view *v)
{
    double residual = largest_residual(v), last = HUGE_VAL;
    for (int pass = 0; pass < ARTICULATION_REFINEMENTS && residual > ARTICULATION_EXACT && residual < last / 2;
         ++pass) {
        last = residual;
        sadmm_articulation_part_solve_rows(v, true);
        residual = largest_residual(v);
    }
    return !sadmm_articulation_part_change_rows(v);
}

bool sadmm_articulation_part_solve(const struct articulation_view *v, const uint8_t *earlier, bool exact)
{
    bool solved = false;
    sadmm_articulation_part_free(v);
    sadmm_articulation_part_begin_rows(v, earlier);
    for (int pass = 0; pass < ARTICULATION_PASSES && !solved; ++pass) {
        sadmm_articulation_part_factorize(v);
        sadmm_articulation_part_solve_rows(v, false);
        if (sadmm_articulation_part_change_rows(v)) continue;
        solved = true;
        if (exact) {
            solved = refine(v);
        } else if (needs_refinement(v)) {
            sadmm_articulation_part_solve_rows(v, true);
            solved = !sadmm_articulation_part_change_rows(v);
        }
    }
    return solved && is_finite(v);
}

void sadmm_articulation_part_store(const struct articulation_view *v, const struct sadmm_system *system,
                                   const struct sadmm_row_constraint *slots)
{
    for (int32_t e = 0; e < v->s.bodies; ++e)
        for (int k = 0; k < 6; ++k)
            system->velocity[6 * v->s.body[e] + k] = v->velocity[6 * e + k] + v->dv[6 * e + k];
    EACH_ARTICULATION_ROW(slots, v, r, from) system->rows->lambda[from] = articulation_bounded(v, r);
}
