/* Articulations: bodies connected by constraint rows, and their block direct solve (core/solve/articulation.h). The
 * formulas, entry by entry, for a host that goes through them in order and a device whose threads share them. In
 * double. Every sum goes along a list in one order, so that both give the same bits.
 *
 * A part is one articulation: constraints connected by bodies that are solved for. It is solved in numbers of its own,
 * from copies of what it needs, side by side in memory:
 *
 *   columns    its constraints, in the order of elimination, level by level; columns of a level are not coupled to each
 *              other. Row k of column p has number SADMM_MAX_ROWS p + k
 *   nodes      blocks of the factor: column p its diagonal one, columns + b the b-th below the diagonal
 *   scatters   the updates of later nodes by a level, once it is factored: node, and the range of its updates
 *   gathers    what columns of earlier levels take from a level in the back substitution: column, and the range of its
 *              blocks */
#ifndef SADMM_CORE_MODEL_ARTICULATION_H
#define SADMM_CORE_MODEL_ARTICULATION_H

#include "core/base/contact_set.h"
#include "core/math/ldl6.h"
#include "core/math/rigid.h"
#include "rows.h"

enum { ARTICULATION_BLOCK = SADMM_MAX_ROWS * SADMM_MAX_ROWS };
/* Regularisation of the factor, a share of a row's scale (below): rows may say the same, but for rounding. */
#define ARTICULATION_PROXIMAL 1e-11
/* Regularisation of hard rows: a compliance, a share of a row's scale. A load moves a lock by a billionth of what it
 * would move the heavier of its bodies by, alone. Rows of an overconstrained loop contradict each other by the errors
 * of its joints, along multipliers without a response; unregularised these grow from step to step (scene bricard: to
 * 1e6 N instead of 30) until they lock the loop. */
#define ARTICULATION_REGULARISATION 1e-9 /* measured: bench/constants.py, mechanisms motion */
/* Where the regularisation leaves more than this of a row, m/s or rad/s, all rows are solved once more with the same
 * factor (iterative refinement): rows that can be met are, to rounding. */
#define ARTICULATION_REFINE_ABOVE 1e-5 /* measured: bench/constants.py, mechanisms motion */
/* Where rows are to be exact: their largest residual, m/s or rad/s, and the most refinements. */
#define ARTICULATION_EXACT 1e-11
enum { ARTICULATION_REFINEMENTS = 8 };
/* The rows at bounds are found in so many passes at most; one or two do mostly, and 9 in all but of ragdolls that fall
 * on each other. A row that is at a bound against its law by less than the rounding of its numbers and
 * ARTICULATION_SLACK, m/s or rad/s, stays there, or rounding would let rows change for good. */
enum { ARTICULATION_PASSES = 16 };
/* In trees a pass costs little, and after 8 one row changes at a time: of the 3,000 random trees of
 * tests/test_articulation_tree.c 87 need more than 16, 39 more than these. */
enum { ARTICULATION_TOGETHER = 8, ARTICULATION_TREE_PASSES = 64 };
#define ARTICULATION_SLACK 1e-9 /* measured: bench/constants.py, mechanisms motion */

/* Where a row is: between its bounds, at one of them, or fixed: it does not depend on the motion. Or it is absent: its
 * constraint has fewer. */
enum row_state { ROW_INSIDE, ROW_AT_LO, ROW_AT_HI, ROW_FIXED, ROW_ABSENT };

/* ---- the structure of a part ------------------------------------------------------------------------------------- */

struct articulation_structure {
    int32_t columns, blocks, levels, bodies, updates, scatters, gathers;
    const int32_t *constraint;     /* (columns) of the caller's list */
    const int32_t *body;           /* (bodies) of the world */
    const int32_t *side;           /* (columns x 2) bodies of the part; -1: not solved for */
    const int32_t *first_of_level; /* (levels + 1) -> columns */
    const int32_t *first_below;    /* (columns + 1) -> its blocks */
    const int32_t *row, *column;   /* (blocks) columns of both constraints */
    const int32_t *common;         /* (blocks) bodies that both have: bit 2 s + t, side s of the row, t of the column */
    const int32_t *first_update;   /* (columns + blocks + 1) node -> what is taken from it: L_u L_w^T, by columns */
    const int32_t *update;         /* (updates x 2) blocks u, w; of a diagonal node its row's blocks, u = w */
    const int32_t *first_scatter;  /* (levels x 2 + 1) -> scatters of a level: to diagonal nodes, to blocks */
    const int32_t *scatter;        /* (scatters x 3) node, first and end of its updates by columns of the level */
    const int32_t *first_gather;   /* (levels + 1) -> gathers: what is taken from a level on the way back */
    const int32_t *gather;         /* (gathers x 3) column, first and end of its blocks in rows of the level */
    const int32_t *first_around;   /* (bodies + 1) -> sides of constraints at a body */
    const int32_t *around;         /* (columns x 2 at most) 2 column + side, ascending */
};

/* A structure is numbers that lie together: its counts, then its arrays. */
enum { ARTICULATION_COUNTS = 7 };

SADMM_INLINE const int32_t *articulation_take(const int32_t **at, int32_t count)
{
    const int32_t *begin = *at;
    *at += count;
    return begin;
}
SADMM_INLINE struct articulation_structure articulation_structure_at(const int32_t *numbers)
{
    struct articulation_structure s;
    const int32_t *at = numbers + ARTICULATION_COUNTS;
    s.columns = numbers[0], s.blocks = numbers[1], s.levels = numbers[2], s.bodies = numbers[3];
    s.updates = numbers[4], s.scatters = numbers[5], s.gathers = numbers[6];
    s.constraint = articulation_take(&at, s.columns);
    s.body = articulation_take(&at, s.bodies);
    s.side = articulation_take(&at, 2 * s.columns);
    s.first_of_level = articulation_take(&at, s.levels + 1);
    s.first_below = articulation_take(&at, s.columns + 1);
    s.row = articulation_take(&at, s.blocks);
    s.column = articulation_take(&at, s.blocks);
    s.common = articulation_take(&at, s.blocks);
    s.first_update = articulation_take(&at, s.columns + s.blocks + 1);
    s.update = articulation_take(&at, 2 * s.updates);
    s.first_scatter = articulation_take(&at, 2 * s.levels + 1);
    s.scatter = articulation_take(&at, 3 * s.scatters);
    s.first_gather = articulation_take(&at, s.levels + 1);
    s.gather = articulation_take(&at, 3 * s.gathers);
    s.first_around = articulation_take(&at, s.bodies + 1);
    s.around = articulation_take(&at, 2 * s.columns);
    return s;
}

/* Of so many numbers, in doubles. */
SADMM_INLINE size_t articulation_numbers_size(int32_t numbers) { return ((size_t)numbers + 1) / 2; }

/* ---- a part ------------------------------------------------------------------------------------------------------ */

/* As it is given. */
struct articulation_row {
    double jacobian[2][6];                 /* on (linear, angular) of a, of b */
    double gain, bias, compliance, lo, hi; /* its law */
    double lambda;                         /* its multiplier as it was */
};

/* Constraints that only hang bodies on each other, or on what is not solved for, make no loop. */
SADMM_INLINE bool articulation_has_loop(const struct articulation_structure *s)
{
    int32_t ground = 0, k;
    for (k = 0; k < 2 * s->columns; ++k)
        if (s->side[k] < 0) ground = 1;
    return s->columns >= s->bodies + ground;
}

struct articulation_view {
    struct articulation_structure s;
    /* by row: */
    struct articulation_row *rows;
    double *response;                 /* x 12: (A + C)^-1 J^T of either side */
    double *change;                   /* of the multiplier */
    double *regularisation;           /* compliance in the factor; of hard rows ARTICULATION_REGULARISATION */
    uint8_t *state;
    /* by body: */
    double *velocity;                 /* x 6, as it was */
    double *residual;                 /* x 6: b - A v + J^T lambda, then its response: the free change */
    double *dv;                       /* x 6: the change of velocity */
    double *factor;                   /* x 36: A, then the factor of A + C */
    double *energy;
    /* by column: */
    double *diagonal;                 /* x 36: S_jj */
    double *inverse, *pivot;          /* x 36: L_jj^-T of its factor; x 6: D_j^-1 */
    double *right, *found;            /* x 6: right sides; what they give */
    /* by block below the diagonal: */
    double *below, *share;            /* x 36: S_ij, then L_ij D_j; L_ij */
};

/* Doubles that the arrays take; and where they lie. */
SADMM_INLINE size_t articulation_work_size(const struct articulation_structure *s)
{
    const size_t columns = (size_t)s->columns, rows = SADMM_MAX_ROWS * columns;
    return rows * (sizeof(struct articulation_row) / sizeof(double) + 14) + (rows + 7) / 8 + 55 * (size_t)s->bodies +
           (2 * ARTICULATION_BLOCK + 3 * SADMM_MAX_ROWS) * columns + 2 * ARTICULATION_BLOCK * (size_t)s->blocks;
}
SADMM_INLINE struct articulation_view articulation_view_at(const struct articulation_structure *s, double *work)
{
    const size_t columns = (size_t)s->columns, rows = SADMM_MAX_ROWS * columns, bodies = (size_t)s->bodies;
    struct articulation_view v;
    v.s = *s;
    v.rows = (struct articulation_row *)work;
    v.response = (double *)(v.rows + rows);
    v.change = v.response + 12 * rows;
    v.regularisation = v.change + rows;
    v.velocity = v.regularisation + rows;
    v.residual = v.velocity + 6 * bodies;
    v.dv = v.residual + 6 * bodies;
    v.factor = v.dv + 6 * bodies;
    v.energy = v.factor + 36 * bodies;
    v.diagonal = v.energy + bodies;
    v.inverse = v.diagonal + ARTICULATION_BLOCK * columns;
    v.pivot = v.inverse + ARTICULATION_BLOCK * columns;
    v.right = v.pivot + SADMM_MAX_ROWS * columns;
    v.found = v.right + SADMM_MAX_ROWS * columns;
    v.below = v.found + SADMM_MAX_ROWS * columns;
    v.share = v.below + ARTICULATION_BLOCK * (size_t)s->blocks;
    v.state = (uint8_t *)(v.share + ARTICULATION_BLOCK * (size_t)s->blocks);
    return v;
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* Component k of the (force, torque) that a contact presses its body on `side` with; f: its impulse. */
SADMM_INLINE double articulation_point_load(const double arm[3], const double f[3], int side, int k)
{
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double load = k < 3 ? f[k] : arm[i] * f[j] - arm[j] * f[i];
    return side ? load : -load;
}

/* Component k of what rows at a side of a column do to its body. */
SADMM_INLINE double articulation_row_load(const struct articulation_view *v, int32_t around, int k)
{
    enum { STRIDE = sizeof(struct articulation_row) / sizeof(double) };
    const struct articulation_row *first = &v->rows[SADMM_MAX_ROWS * (around / 2)];
    return six_strided_product(&first->lambda, STRIDE, first->jacobian[around % 2] + k, STRIDE);
}

/* Twice the energy of the impulses on a body, for the speed that they change its part by (V of math/weight.h). */
SADMM_INLINE double articulation_energy(const double A[36], const double impulse[6])
{
    mat3 inertia;
    vec3 turn = v3_load(impulse + 3);
    int k;
    for (k = 0; k < 3; ++k) inertia.r[k] = v3_load(A + 6 * (k + 3) + 3);
    return v3_norm2(v3_load(impulse)) / A[0] + v3_dot(turn, m3_solve(inertia, turn));
}
SADMM_INLINE double articulation_speed(double energy, double mass) { return mass > 0 ? sqrt(energy / mass) : 0; }

/* Entry k, q <= k, of J_c^T J_c of a point at `arm`. */
SADMM_INLINE double articulation_point_entry(const double arm[3], int k, int q)
{
    const int i = k - 3, j = q - 3;
    if (k < 3) return k == q ? 1 : 0;
    if (q < 3) return q == i ? 0 : (i + 1) % 3 == q ? -arm[(q + 1) % 3] : arm[(i + 1) % 3];
    return (i == j ? arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2] : 0) - arm[i] * arm[j];
}

/* B of a pair of `count` contacts whose impulses' sizes are `load` in all: as stiff as the mass that rests on them. */
SADMM_INLINE double articulation_contact_weight(double load, int32_t count, double speed)
{
    return load > 0 && speed > 0 ? load / (count * speed) : 0;
}

/* Component k of b - A v + J^T lambda, before A becomes A + C. */
SADMM_INLINE double articulation_body_residual(const struct articulation_view *v, int32_t e, int k, double b,
                                               double impulse)
{
    return b + impulse - six_product(v->factor + 36 * (size_t)e + 6 * k, v->velocity + 6 * (size_t)e);
}

/* Component k: the free change, then what its rows change it by. */
SADMM_INLINE void articulation_move(const struct articulation_view *v, int32_t e, int k)
{
    double dv = v->residual[6 * (size_t)e + (size_t)k];
    int32_t at;
    for (at = v->s.first_around[e]; at < v->s.first_around[e + 1]; ++at) {
        const int32_t first = SADMM_MAX_ROWS * (v->s.around[at] / 2), side = v->s.around[at] % 2;
        dv += six_strided_product(v->change + first, 1, v->response + 12 * (size_t)first + 6 * side + k, 12);
    }
    v->dv[6 * (size_t)e + (size_t)k] = dv;
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* Before anything else is known of a row; there: its constraint has it. Else its numbers are 0. */
SADMM_INLINE void articulation_put_row(const struct articulation_view *v, int32_t r, bool there)
{
    v->state[r] = there ? ROW_INSIDE : ROW_ABSENT;
    v->change[r] = v->regularisation[r] = 0;
}

SADMM_INLINE void articulation_respond(const struct articulation_view *v, int32_t r, int side)
{
    const int32_t body = v->s.side[2 * (r / SADMM_MAX_ROWS) + side];
    double *response = v->response + 12 * (size_t)r + 6 * (size_t)side;
    int k;
    if (body >= 0 && v->state[r] != ROW_ABSENT)
        ldl6_solve(v->factor + 36 * (size_t)body, v->rows[r].jacobian[side], response);
    else
        for (k = 0; k < 6; ++k) response[k] = 0;
}

/* gain x + bias + compliance lambda with the changes so far; moved: with dv; own: by the row's own compliance. */
SADMM_INLINE double articulation_row_residual(const struct articulation_view *v, int32_t r, bool moved, bool own)
{
    const struct articulation_row *row = &v->rows[r];
    double x = 0;
    int side;
    for (side = 0; side < 2; ++side) {
        const int32_t body = v->s.side[2 * (r / SADMM_MAX_ROWS) + side];
        if (body < 0) continue;
        x += six_product(row->jacobian[side], v->velocity + 6 * (size_t)body);
        if (moved) x += six_product(row->jacobian[side], v->dv + 6 * (size_t)body);
    }
    return row->gain * x + row->bias + (own ? row->compliance : v->regularisation[r]) * (row->lambda + v->change[r]);
}

SADMM_INLINE double articulation_clamp(double x, double lo, double hi) { return x < lo ? lo : x > hi ? hi : x; }

/* It goes to a bound, or is released. */
SADMM_INLINE void articulation_put_state(const struct articulation_view *v, int32_t r, uint8_t state)
{
    v->state[r] = state;
    if (state == ROW_AT_LO) v->change[r] = v->rows[r].lo - v->rows[r].lambda;
    if (state == ROW_AT_HI) v->change[r] = v->rows[r].hi - v->rows[r].lambda;
}

/* What a row's regularisation is a share of: its own response; between two bodies twice that of the one that responds
 * less. Else what light bodies between heavy ones pass on, carriers of joints say, would make locks soft: of 1e-4 of a
 * body's moment by ten thousand times as much. */
SADMM_INLINE double articulation_scale_of(double a, double b) { return a > 0 && b > 0 ? 2 * (a < b ? a : b) : a + b; }
SADMM_INLINE double articulation_scale(const struct articulation_view *v, int32_t r)
{
    const double *response = v->response + 12 * (size_t)r;
    const double a = six_product(v->rows[r].jacobian[0], response),
                 b = six_product(v->rows[r].jacobian[1], response + 6);
    return articulation_scale_of(a, b);
}

SADMM_INLINE double articulation_regularisation(const struct articulation_view *v, int32_t r)
{
    return ARTICULATION_REGULARISATION * articulation_scale(v, r);
}

/* Where a row that is there is before the first pass, its change to its bounds made. earlier: where a solve of this
 * step has left it, which is mostly where it is still: iterations leave multipliers near bounds on either side.
 * ROW_ABSENT: there was none. residual: of the row, read where its multiplier is at a bound. */
SADMM_INLINE void articulation_place_row(const struct articulation_view *v, int32_t r, uint8_t earlier, double residual)
{
    const struct articulation_row *row = &v->rows[r];
    const double lambda = row->lambda, lo = row->lo, hi = row->hi;
    if (row->gain == 0 || !(hi > lo)) {
        const double fixed = row->compliance > 0 ? -row->bias / row->compliance : lambda;
        v->state[r] = ROW_FIXED;
        v->change[r] = articulation_clamp(fixed, lo, hi) - lambda;
        return;
    }
    if (earlier == ROW_INSIDE || earlier == ROW_AT_LO || earlier == ROW_AT_HI) {
        articulation_put_state(v, r, earlier);
        return;
    }
    v->state[r] = lambda <= lo && residual >= 0   ? ROW_AT_LO
                  : lambda >= hi && residual <= 0 ? ROW_AT_HI
                                                  : ROW_INSIDE;
}

/* hard: the regularisation, if it is a hard one. */
SADMM_INLINE void articulation_begin_row(const struct articulation_view *v, int32_t r, uint8_t earlier, double hard)
{
    const struct articulation_row *row = &v->rows[r];
    const double lambda = row->lambda;
    v->regularisation[r] = sadmm_law_is_coupled(row->compliance, row->lo, row->hi) ? hard : row->compliance;
    v->change[r] = articulation_clamp(lambda, row->lo, row->hi) - lambda;
    articulation_place_row(v, r, earlier,
                           lambda > row->lo && lambda < row->hi ? 0 : articulation_row_residual(v, r, false, true));
}

/* After a pass: a row that left its bounds stays at them, one that is at them against its law is released. residual: of
 * the row, read where it is at a bound. Did it change? */
SADMM_INLINE bool articulation_settle_row(const struct articulation_view *v, int32_t r, double residual)
{
    const struct articulation_row *row = &v->rows[r];
    const uint8_t state = v->state[r];
    const double lambda = row->lambda + v->change[r];
    uint8_t next = state;
    if (state == ROW_INSIDE) {
        next = lambda < row->lo ? ROW_AT_LO : lambda > row->hi ? ROW_AT_HI : ROW_INSIDE;
    } else if (state == ROW_AT_LO || state == ROW_AT_HI) {
        const double least = ARTICULATION_SLACK * (1 + fabs(row->bias));
        if (state == ROW_AT_LO ? residual < -least : residual > least) next = ROW_INSIDE;
    }
    if (next == state) return false;
    articulation_put_state(v, r, next);
    return true;
}
SADMM_INLINE bool articulation_change_row(const struct articulation_view *v, int32_t r)
{
    const bool at_bound = v->state[r] == ROW_AT_LO || v->state[r] == ROW_AT_HI;
    return articulation_settle_row(v, r, at_bound ? articulation_row_residual(v, r, true, true) : 0);
}

/* A row without a multiplier of its own that is not met: it goes to the bound that would meet it. Did it? */
SADMM_INLINE bool articulation_yield_row(const struct articulation_view *v, int32_t r, double residual)
{
    const struct articulation_row *row = &v->rows[r];
    const bool down = residual > 0;
    if (!(fabs(residual) > ARTICULATION_SLACK * (1 + fabs(row->bias))) || !isfinite(down ? row->lo : row->hi))
        return false;
    articulation_put_state(v, r, down ? ROW_AT_LO : ROW_AT_HI);
    return true;
}

/* The share of a hard row's scale that is left of its response once all before it are met, in a part that is factored:
 * next to nothing where it says what they say. 0: it is not hard, or not inside its bounds. */
SADMM_INLINE double articulation_left(const struct articulation_view *v, int32_t r)
{
    const struct articulation_row *row = &v->rows[r];
    if (v->state[r] != ROW_INSIDE || !sadmm_law_is_coupled(row->compliance, row->lo, row->hi)) return 0;
    const double left = ARTICULATION_REGULARISATION / (v->regularisation[r] * v->pivot[r]);
    return isfinite(left) ? left : 0;
}

SADMM_INLINE double articulation_bounded(const struct articulation_view *v, int32_t r)
{
    return articulation_clamp(v->rows[r].lambda + v->change[r], v->rows[r].lo, v->rows[r].hi);
}

/* ---- the factor -------------------------------------------------------------------------------------------------- */

/* Nodes are worked on in tiles, which fetch little for what they do. */
enum { TILE_ROWS = 2, TILE_COLUMNS = 3, ARTICULATION_TILES = ARTICULATION_BLOCK / (TILE_ROWS * TILE_COLUMNS) };
struct articulation_tile {
    double entry[TILE_ROWS][TILE_COLUMNS];
};
SADMM_INLINE int articulation_tile_row(int tile) { return TILE_ROWS * (tile / (SADMM_MAX_ROWS / TILE_COLUMNS)); }
SADMM_INLINE int articulation_tile_column(int tile) { return TILE_COLUMNS * (tile % (SADMM_MAX_ROWS / TILE_COLUMNS)); }
/* Of a symmetric node: is none of it in the lower half? */
SADMM_INLINE bool articulation_tile_is_above(int tile)
{
    return articulation_tile_column(tile) >= articulation_tile_row(tile) + TILE_ROWS;
}

SADMM_INLINE struct articulation_tile articulation_load_tile(const double *node, int tile)
{
    const double *at = node + SADMM_MAX_ROWS * articulation_tile_row(tile) + articulation_tile_column(tile);
    struct articulation_tile t;
    int k, q;
    SADMM_UNROLL
    for (k = 0; k < TILE_ROWS; ++k) {
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) t.entry[k][q] = at[SADMM_MAX_ROWS * k + q];
    }
    return t;
}
SADMM_INLINE void articulation_store_tile(double *node, int tile, const struct articulation_tile *t)
{
    double *at = node + SADMM_MAX_ROWS * articulation_tile_row(tile) + articulation_tile_column(tile);
    int k, q;
    SADMM_UNROLL
    for (k = 0; k < TILE_ROWS; ++k) {
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) at[SADMM_MAX_ROWS * k + q] = t->entry[k][q];
    }
}

/* t += sign x y^T, six numbers a row of x and y, which are `x_stride` and `y_stride` apart. */
SADMM_INLINE void articulation_add_products(struct articulation_tile *t, double sign, const double *x, int x_stride,
                                            const double *y, int y_stride)
{
    double own[TILE_ROWS][6], other[TILE_COLUMNS][6];
    int k, q, i;
    SADMM_UNROLL
    for (i = 0; i < 6; ++i) {
        SADMM_UNROLL
        for (k = 0; k < TILE_ROWS; ++k) own[k][i] = x[x_stride * k + i];
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) other[q][i] = y[y_stride * q + i];
    }
    SADMM_UNROLL
    for (k = 0; k < TILE_ROWS; ++k) {
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) {
            t->entry[k][q] += sign * six_product(own[k], other[q]);
        }
    }
}

/* A tile of the node of these rows and columns before its updates: J_i (A + C)^-1 J_j^T over the bodies
 * that both have, bits as in `common`. Rows that are not inside their bounds are 0, and 1 on the diagonal. */
SADMM_INLINE struct articulation_tile articulation_enter(const struct articulation_view *v, int32_t row, int32_t column,
                                                         int32_t common, int tile)
{
    const size_t first_row = (size_t)(SADMM_MAX_ROWS * row + articulation_tile_row(tile)),
                 first_column = (size_t)(SADMM_MAX_ROWS * column + articulation_tile_column(tile));
    struct articulation_tile t = {{{0}}};
    int k, q;
    for (; common; common &= common - 1) { /* bit by bit of those that are set */
        const int bit = common & 1 ? 0 : common & 2 ? 1 : common & 4 ? 2 : 3;
        articulation_add_products(&t, 1, v->rows[first_row].jacobian[bit / 2],
                                  sizeof(struct articulation_row) / sizeof(double),
                                      v->response + 12 * first_column + 6 * (bit % 2), 12);
    }
    SADMM_UNROLL
    for (k = 0; k < TILE_ROWS; ++k) {
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) {
            const size_t i = first_row + (size_t)k, j = first_column + (size_t)q;
            double *entry = &t.entry[k][q];
            if (v->state[i] != ROW_INSIDE || v->state[j] != ROW_INSIDE) *entry = i == j ? 1 : 0;
            else if (i == j)
                *entry += ARTICULATION_PROXIMAL * articulation_scale(v, (int32_t)i) + v->regularisation[i] /
                    v->rows[i].gain;
        }
    }
    return t;
}
enum { ARTICULATION_OWN = 1 << 0 | 1 << 3 }; /* what a column has in common with itself: either side */

/* What updates `first` to `end` take from a tile of their node: L_u D L_w^T. */
SADMM_INLINE void articulation_update(const struct articulation_view *v, int32_t first, int32_t end, int tile,
                                      struct articulation_tile *t)
{
    int32_t at;
    for (at = first; at < end; ++at)
        articulation_add_products(t, -1,
                                  v->share + ARTICULATION_BLOCK * (size_t)v->s.update[2 * at] + SADMM_MAX_ROWS *
                                      articulation_tile_row(tile),
                                  SADMM_MAX_ROWS,
                                  v->below + ARTICULATION_BLOCK * (size_t)v->s.update[2 * at + 1] +
                                      SADMM_MAX_ROWS * articulation_tile_column(tile),
                                  SADMM_MAX_ROWS);
}

/* Row k of a block below the diagonal, L the factor of its column: S_ij L_jj^-T, and L_ij = S_ij L_jj^-T D_j^-1. */
SADMM_INLINE void articulation_finish_row(const struct articulation_view *v, const double L[36], int32_t b, int k)
{
    const size_t at = ARTICULATION_BLOCK * (size_t)b + (size_t)(SADMM_MAX_ROWS * k);
    double x[6];
    int q;
    SADMM_UNROLL
    for (q = 0; q < 6; ++q) x[q] = v->below[at + (size_t)q];
    ldl6_forward(L, x);
    SADMM_UNROLL
    for (q = 0; q < 6; ++q) v->below[at + (size_t)q] = x[q];
    ldl6_scale(L, x);
    SADMM_UNROLL
    for (q = 0; q < 6; ++q) v->share[at + (size_t)q] = x[q];
}

/* Row k of L_jj^-T, products with which wait for less than a substitution; and of D_j^-1. */
SADMM_INLINE void articulation_invert_row(const struct articulation_view *v, const double L[36], int32_t column, int k)
{
    double *row = v->inverse + ARTICULATION_BLOCK * (size_t)column + SADMM_MAX_ROWS * k, x[6];
    int q;
    SADMM_UNROLL
    for (q = 0; q < 6; ++q) x[q] = q == k ? 1 : 0;
    ldl6_forward(L, x);
    SADMM_UNROLL
    for (q = 0; q < 6; ++q) {
        row[q] = x[q];
        if (q == k) v->pivot[SADMM_MAX_ROWS * (size_t)column + (size_t)q] = L[7 * q];
    }
}

/* ---- solving with it --------------------------------------------------------------------------------------------- */

/* The right side of a row, moved with the rows that are not inside. again: what regularisation and rounding have
 * left. */
SADMM_INLINE double articulation_right(const struct articulation_view *v, int32_t r, bool again)
{
    return v->state[r] == ROW_INSIDE ? -articulation_row_residual(v, r, true, again) / v->rows[r].gain : 0;
}

/* Does the regularisation leave much of the row? */
SADMM_INLINE bool articulation_needs_refinement(const struct articulation_view *v, int32_t r)
{
    const struct articulation_row *row = &v->rows[r];
    return v->state[r] == ROW_INSIDE &&
           fabs((v->regularisation[r] - row->compliance) * (row->lambda + v->change[r])) > ARTICULATION_REFINE_ABOVE;
}

/* Size of the residual of a row inside its bounds, m/s or rad/s; else 0. */
SADMM_INLINE double articulation_residual_size(const struct articulation_view *v, int32_t r)
{
    return v->state[r] == ROW_INSIDE ? fabs(articulation_row_residual(v, r, true, true)) : 0;
}

/* Are rows inconsistent: have they a residual that a refinement does not make half of what it was `before`? */
SADMM_INLINE bool articulation_is_inconsistent(double residual, double before)
{
    return residual > ARTICULATION_REFINE_ABOVE && !(residual < before / 2);
}

/* What is left of an inconsistent row is dropped from its law. All rows can be met then, at the velocities there are,
 * without multipliers that only press rows against each other: the least-squares solution of least multipliers. */
SADMM_INLINE void articulation_drop_residual(const struct articulation_view *v, int32_t r)
{
    if (v->state[r] == ROW_INSIDE) v->rows[r].bias -= articulation_row_residual(v, r, true, true);
}

/* The change of a row's multiplier before and after it has been found. */
SADMM_INLINE void articulation_put_change(const struct articulation_view *v, int32_t r, bool again, bool found)
{
    if (v->state[r] == ROW_INSIDE) v->change[r] = (again ? v->change[r] : 0) + (found ? v->found[r] : 0);
}

/* Row r of L_jj^-1 right; then of D_j^-1 of that; then, on the way back, of L_jj^-T right. */
SADMM_INLINE void articulation_find_forward(const struct articulation_view *v, int32_t r)
{
    const size_t column = (size_t)(r / SADMM_MAX_ROWS);
    v->found[r] = six_strided_product(v->inverse + ARTICULATION_BLOCK * column + r % SADMM_MAX_ROWS, SADMM_MAX_ROWS,
                                         v->right + SADMM_MAX_ROWS * column, 1);
}
SADMM_INLINE void articulation_turn(const struct articulation_view *v, int32_t r)
{
    v->right[r] = v->found[r] * v->pivot[r];
}
SADMM_INLINE void articulation_find_backward(const struct articulation_view *v, int32_t r)
{
    const size_t column = (size_t)(r / SADMM_MAX_ROWS);
    v->found[r] = six_product(v->inverse + ARTICULATION_BLOCK * column + SADMM_MAX_ROWS * (r % SADMM_MAX_ROWS),
                                 v->right + SADMM_MAX_ROWS * column);
}

/* Forward: what earlier columns have found is taken from row k of this one, by the updates of its diagonal node. */
SADMM_INLINE void articulation_scatter_right(const struct articulation_view *v, int32_t column, int32_t first,
                                             int32_t end, int k)
{
    double *own = v->right + SADMM_MAX_ROWS * (size_t)column + k;
    int32_t at;
    for (at = first; at < end; ++at) {
        const int32_t b = v->s.update[2 * at];
        *own -= six_product(v->share + ARTICULATION_BLOCK * (size_t)b + SADMM_MAX_ROWS * k,
                               v->found + SADMM_MAX_ROWS * (size_t)v->s.column[b]);
    }
}

/* Backward: what later columns have found, by its blocks `first` to `end`. */
SADMM_INLINE void articulation_gather_right(const struct articulation_view *v, int32_t column, int32_t first,
                                            int32_t end, int k)
{
    double *own = v->right + SADMM_MAX_ROWS * (size_t)column + k;
    int32_t b;
    for (b = end - 1; b >= first; --b)
        *own -= six_strided_product(v->share + ARTICULATION_BLOCK * (size_t)b + k, SADMM_MAX_ROWS,
                                       v->found + SADMM_MAX_ROWS * (size_t)v->s.row[b], 1);
}

#endif
