#include "joined_part.h"

#include <math.h>
#include <string.h>

#include "core/model/system_math.h"

/* ---- what there is ----------------------------------------------------------------------------------------------- */

static void load_row(const struct sadmm_rows *rows, size_t from, struct joined_row *to)
{
    memcpy(to->jacobian[0], rows->jacobian_a + 6 * from, sizeof to->jacobian[0]);
    memcpy(to->jacobian[1], rows->jacobian_b + 6 * from, sizeof to->jacobian[1]);
    to->gain = rows->gain[from], to->bias = rows->bias[from], to->compliance = rows->compliance[from];
    to->lo = rows->lo[from], to->hi = rows->hi[from], to->lambda = rows->lambda[from];
}

void sadmm_joined_part_load(struct joined_part *part, const struct sadmm_system *system,
                            const struct sadmm_settings *settings, const struct sadmm_row_constraint *slots)
{
    const struct joined_view *v = &part->view;
    double energy = 0, mass = 0;
    memset(v->rows, 0, (size_t)(JOINED_ROWS * v->s.places) * sizeof *v->rows);
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r) joined_put_row(v, r, false);
    EACH_JOINED_ROW(slots, v, r, from) {
        load_row(system->rows, (size_t)from, &v->rows[r]);
        joined_put_row(v, r, true);
    }
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        const size_t i = (size_t)v->s.body[e];
        double *A = v->factor + 36 * (size_t)e, *impulse = part->impulse + 6 * (size_t)e, b[6];
        memcpy(v->velocity + 6 * (size_t)e, system->velocity + 6 * i, 6 * sizeof *v->velocity);
        for (int32_t at = v->s.first_around[e]; at < v->s.first_around[e + 1]; ++at)
            for (int k = 0; k < 6; ++k) impulse[k] += joined_row_load(v, v->s.around[at], k);
        sadmm_system_body(system, settings, (int32_t)i, A, b);
        for (int k = 0; k < 6; ++k) v->missing[6 * e + k] = joined_missing(v, e, k, b[k], impulse[k]);
        energy += joined_energy(A, impulse);
        mass += A[0];
    }
    part->speed = joined_speed(energy, mass);
}

void sadmm_joined_part_free(const struct joined_view *v)
{
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        ldl6_factor(v->factor + 36 * (size_t)e, v->factor + 36 * (size_t)e);
        ldl6_solve(v->factor + 36 * (size_t)e, v->missing + 6 * (size_t)e, v->missing + 6 * (size_t)e);
    }
}

/* ---- its rows ---------------------------------------------------------------------------------------------------- */

void sadmm_joined_part_begin_rows(const struct joined_view *v, const uint8_t *earlier)
{
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r) {
        for (int side = 0; side < 2; ++side) joined_respond(v, r, side);
        if (v->state[r] != JOINED_ABSENT) joined_begin_row(v, r, earlier ? earlier[r] : JOINED_ABSENT);
    }
}

bool sadmm_joined_part_change_rows(const struct joined_view *v)
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

void sadmm_joined_part_factorize(const struct joined_view *v)
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

void sadmm_joined_part_solve_rows(const struct joined_view *v, bool again)
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

/* The most that a row inside its bounds misses, m/s or rad/s. */
static double most_missing(const struct joined_view *v)
{
    double most = 0;
    for (int32_t r = 0; r < JOINED_ROWS * v->s.places; ++r)
        most = fmax(most, joined_misses(v, r));
    return most;
}

/* What rows give by is taken back, by a share each time: nearly all of it, but where light bodies between heavy ones
 * pass on a load. Rows that contradict each other are left: more of it would only make their multipliers grow. Have
 * they stayed in their states? */
static bool take_back_give(const struct joined_view *v)
{
    double missing = most_missing(v), last = HUGE_VAL;
    for (int pass = 0; pass < JOINED_BACKS && missing > JOINED_EXACT && missing < last / 2; ++pass) {
        last = missing;
        sadmm_joined_part_solve_rows(v, true);
        missing = most_missing(v);
    }
    return !sadmm_joined_part_change_rows(v);
}

bool sadmm_joined_part_solve(const struct joined_view *v, const uint8_t *earlier, bool exact)
{
    bool solved = false;
    sadmm_joined_part_free(v);
    sadmm_joined_part_begin_rows(v, earlier);
    for (int pass = 0; pass < JOINED_PASSES && !solved; ++pass) {
        sadmm_joined_part_factorize(v);
        sadmm_joined_part_solve_rows(v, false);
        if (sadmm_joined_part_change_rows(v)) continue;
        solved = true;
        if (exact) {
            solved = take_back_give(v);
        } else if (give_much(v)) {
            sadmm_joined_part_solve_rows(v, true);
            solved = !sadmm_joined_part_change_rows(v);
        }
    }
    return solved && is_finite(v);
}

void sadmm_joined_part_store(const struct joined_view *v, const struct sadmm_system *system,
                             const struct sadmm_row_constraint *slots)
{
    for (int32_t e = 0; e < v->s.bodies; ++e)
        for (int k = 0; k < 6; ++k)
            system->velocity[6 * v->s.body[e] + k] = v->velocity[6 * e + k] + v->dv[6 * e + k];
    EACH_JOINED_ROW(slots, v, r, from) system->rows->lambda[from] = joined_bounded(v, r);
}
