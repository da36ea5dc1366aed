/* Bodies joined by constraint rows, solved directly (core/solve/joined.h): the formulas, entry by entry, for a host
 * that goes through them in order and a device whose threads share them. In double. Every sum goes along a list in one
 * order, so that both give the same bits.
 *
 * A part is constraints that hang together by bodies that are solved for. It is solved in numbers of its own, from
 * copies of what it needs, and so that they lie together:
 *
 *   places     its constraints, in the order of elimination, level by level; places of a level are not coupled to each
 *              other. Row k of place p has number JOINED_ROWS p + k
 *   nodes      blocks of the factor: place p its diagonal one, places + b the b-th below the diagonal
 *   pushes     what a level does to nodes of later ones, once it is factored: node, and the range of its updates */
#ifndef SADMM_CORE_MODEL_JOINED_H
#define SADMM_CORE_MODEL_JOINED_H

#include "core/base/contact_set.h"
#include "core/math/ldl6.h"
#include "core/math/rigid.h"
#include "rows.h"

enum { JOINED_ROWS = SADMM_MAX_ROWS, JOINED_BLOCK = JOINED_ROWS * JOINED_ROWS };
/* Regularisation of the factor, a share of a row's scale (below): rows may say the same, but for rounding. */
#define JOINED_PROXIMAL 1e-11
/* Compliance of hard rows, a share of a row's scale: a load moves a lock by a billionth of what it would move the heavier
 * of its bodies by if nothing else held it. Rows of a loop that has more locks than it needs contradict each other by
 * what its joints are off, along multipliers to which nothing responds; without it these grow from step to step (scene
 * bricard: to 1e6 N where 30 are at work) until they hold the loop. */
#define JOINED_GIVE 1e-9
/* Where a row gives by more than this, m/s or rad/s, all are solved once more by the same factor, which takes back what
 * they give by: rows that can be met are, to rounding. */
#define JOINED_GIVES_MUCH 1e-5
/* Where rows are to be exact: what they may miss, m/s or rad/s; and how often what they give by is taken back. */
#define JOINED_EXACT 1e-11
enum { JOINED_BACKS = 8 };
/* Rows that come to a bound, or leave one, are found in so many passes at most; one or two do mostly, and 9 in all but
 * 16 of 14,500 solves of ragdolls that fall on each other. A row that is held against its law by less than a rounding
 * of its numbers and JOINED_SLACK, m/s or rad/s, stays where it is, or rounding would have rows come and go for good. */
enum { JOINED_PASSES = 16 };
#define JOINED_SLACK 1e-9

/* Where a row is: between its bounds, at one of them, or given: it does not depend on the motion. Or it is not there:
 * its constraint has fewer. */
enum joined_state { JOINED_INSIDE, JOINED_AT_LO, JOINED_AT_HI, JOINED_GIVEN, JOINED_ABSENT };

/* ---- the structure of a part ------------------------------------------------------------------------------------- */

struct joined_structure {
    int32_t places, blocks, levels, bodies, updates, pushes, pulls;
    const int32_t *constraint;     /* (places) of the caller's list */
    const int32_t *body;           /* (bodies) of the world */
    const int32_t *side;           /* (places x 2) bodies of the part; -1: not solved for */
    const int32_t *first_of_level; /* (levels + 1) -> places */
    const int32_t *first_below;    /* (places + 1) place of a column -> its blocks */
    const int32_t *row, *column;   /* (blocks) places */
    const int32_t *common;         /* (blocks) bodies that both have: bit 2 s + t, side s of the row, t of the column */
    const int32_t *first_update;   /* (places + blocks + 1) node -> what is taken from it: L_u L_w^T, by columns */
    const int32_t *update;         /* (updates x 2) blocks u, w; of a diagonal node its row's blocks, u = w */
    const int32_t *first_push;     /* (levels x 2 + 1) -> pushes of a level: to diagonal nodes, to blocks */
    const int32_t *push;           /* (pushes x 3) node, first and end of its updates by columns of the level */
    const int32_t *first_pull;     /* (levels + 1) -> pulls: what places of a level are taken from on the way back */
    const int32_t *pull;           /* (pulls x 3) place of a column, first and end of its blocks in rows of the level */
    const int32_t *first_around;   /* (bodies + 1) -> sides of constraints at a body */
    const int32_t *around;         /* (places x 2 at most) 2 place + side, ascending */
};

/* A structure is numbers that lie together: its counts, then its arrays. */
enum { JOINED_COUNTS = 7 };

SADMM_INLINE const int32_t *joined_take(const int32_t **at, int32_t count)
{
    const int32_t *begin = *at;
    *at += count;
    return begin;
}
SADMM_INLINE struct joined_structure joined_structure_at(const int32_t *numbers)
{
    struct joined_structure s;
    const int32_t *at = numbers + JOINED_COUNTS;
    s.places = numbers[0], s.blocks = numbers[1], s.levels = numbers[2], s.bodies = numbers[3];
    s.updates = numbers[4], s.pushes = numbers[5], s.pulls = numbers[6];
    s.constraint = joined_take(&at, s.places);
    s.body = joined_take(&at, s.bodies);
    s.side = joined_take(&at, 2 * s.places);
    s.first_of_level = joined_take(&at, s.levels + 1);
    s.first_below = joined_take(&at, s.places + 1);
    s.row = joined_take(&at, s.blocks);
    s.column = joined_take(&at, s.blocks);
    s.common = joined_take(&at, s.blocks);
    s.first_update = joined_take(&at, s.places + s.blocks + 1);
    s.update = joined_take(&at, 2 * s.updates);
    s.first_push = joined_take(&at, 2 * s.levels + 1);
    s.push = joined_take(&at, 3 * s.pushes);
    s.first_pull = joined_take(&at, s.levels + 1);
    s.pull = joined_take(&at, 3 * s.pulls);
    s.first_around = joined_take(&at, s.bodies + 1);
    s.around = joined_take(&at, 2 * s.places);
    return s;
}

/* Of so many numbers, in doubles. */
SADMM_INLINE size_t joined_numbers_size(int32_t numbers) { return ((size_t)numbers + 1) / 2; }

/* ---- a part ------------------------------------------------------------------------------------------------------ */

/* As it is given. */
struct joined_row {
    double jacobian[2][6];                 /* on (linear, angular) of a, of b */
    double gain, bias, compliance, lo, hi; /* its law */
    double lambda;                         /* its multiplier as it was */
};

/* Constraints that only hang bodies on each other, or on what is not solved for, make no loop. */
SADMM_INLINE bool joined_has_loop(const struct joined_structure *s)
{
    int32_t ground = 0, k;
    for (k = 0; k < 2 * s->places; ++k)
        if (s->side[k] < 0) ground = 1;
    return s->places >= s->bodies + ground;
}

struct joined_view {
    struct joined_structure s;
    /* by row: */
    struct joined_row *rows;
    double *answer;                   /* x 12: (A + C)^-1 J^T of either side */
    double *change;                   /* of the multiplier */
    double *give;                     /* compliance of the factor; of what is hard JOINED_GIVE */
    uint8_t *state;
    /* by body: */
    double *velocity;                 /* x 6, as it was */
    double *missing;                  /* x 6: b - A v + J^T lambda, then (A + C)^-1 of it: the free change */
    double *dv;                       /* x 6: the change of velocity */
    double *factor;                   /* x 36: A, then the factor of A + C */
    double *energy;
    /* by place: */
    double *diagonal;                 /* x 36: S_jj */
    double *inverse, *pivot;          /* x 36: L_jj^-T of its factor; x 6: D_j^-1 */
    double *right, *found;            /* x 6: right sides; what they give */
    /* by block below the diagonal: */
    double *below, *share;            /* x 36: S_ij, then L_ij D_j; L_ij */
};

/* Doubles that the arrays take; and where they lie. */
SADMM_INLINE size_t joined_work_size(const struct joined_structure *s)
{
    const size_t places = (size_t)s->places, rows = JOINED_ROWS * places;
    return rows * (sizeof(struct joined_row) / sizeof(double) + 14) + (rows + 7) / 8 + 55 * (size_t)s->bodies +
           (2 * JOINED_BLOCK + 3 * JOINED_ROWS) * places + 2 * JOINED_BLOCK * (size_t)s->blocks;
}
SADMM_INLINE struct joined_view joined_view_at(const struct joined_structure *s, double *work)
{
    const size_t places = (size_t)s->places, rows = JOINED_ROWS * places, bodies = (size_t)s->bodies;
    struct joined_view v;
    v.s = *s;
    v.rows = (struct joined_row *)work;
    v.answer = (double *)(v.rows + rows);
    v.change = v.answer + 12 * rows;
    v.give = v.change + rows;
    v.velocity = v.give + rows;
    v.missing = v.velocity + 6 * bodies;
    v.dv = v.missing + 6 * bodies;
    v.factor = v.dv + 6 * bodies;
    v.energy = v.factor + 36 * bodies;
    v.diagonal = v.energy + bodies;
    v.inverse = v.diagonal + JOINED_BLOCK * places;
    v.pivot = v.inverse + JOINED_BLOCK * places;
    v.right = v.pivot + JOINED_ROWS * places;
    v.found = v.right + JOINED_ROWS * places;
    v.below = v.found + JOINED_ROWS * places;
    v.share = v.below + JOINED_BLOCK * (size_t)s->blocks;
    v.state = (uint8_t *)(v.share + JOINED_BLOCK * (size_t)s->blocks);
    return v;
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* Component k of the (force, torque) that a contact presses its body on `side` with; f: its impulse. */
SADMM_INLINE double joined_point_load(const double arm[3], const double f[3], int side, int k)
{
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double load = k < 3 ? f[k] : arm[i] * f[j] - arm[j] * f[i];
    return side ? load : -load;
}

/* Component k of what rows at a side of a place do to its body. */
SADMM_INLINE double joined_row_load(const struct joined_view *v, int32_t around, int k)
{
    enum { STRIDE = sizeof(struct joined_row) / sizeof(double) };
    const struct joined_row *first = &v->rows[JOINED_ROWS * (around / 2)];
    return six_strided_product(&first->lambda, STRIDE, first->jacobian[around % 2] + k, STRIDE);
}

/* Twice the energy of the impulses on a body, for the speed that they change its part by (V of math/weight.h). */
SADMM_INLINE double joined_energy(const double A[36], const double impulse[6])
{
    mat3 inertia;
    vec3 turn = v3_load(impulse + 3);
    int k;
    for (k = 0; k < 3; ++k) inertia.r[k] = v3_load(A + 6 * (k + 3) + 3);
    return v3_norm2(v3_load(impulse)) / A[0] + v3_dot(turn, m3_solve(inertia, turn));
}
SADMM_INLINE double joined_speed(double energy, double mass) { return mass > 0 ? sqrt(energy / mass) : 0; }

/* Entry k, q <= k, of J_c^T J_c of a point at `arm`. */
SADMM_INLINE double joined_point_entry(const double arm[3], int k, int q)
{
    const int i = k - 3, j = q - 3;
    if (k < 3) return k == q ? 1 : 0;
    if (q < 3) return q == i ? 0 : (i + 1) % 3 == q ? -arm[(q + 1) % 3] : arm[(i + 1) % 3];
    return (i == j ? arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2] : 0) - arm[i] * arm[j];
}

/* B of a pair of `count` contacts whose impulses' sizes are `load` in all: as stiff as the mass that rests on them. */
SADMM_INLINE double joined_contact_weight(double load, int32_t count, double speed)
{
    return load > 0 && speed > 0 ? load / (count * speed) : 0;
}

/* Component k of b - A v + J^T lambda, before A becomes A + C. */
SADMM_INLINE double joined_missing(const struct joined_view *v, int32_t e, int k, double b, double impulse)
{
    return b + impulse - six_product(v->factor + 36 * (size_t)e + 6 * k, v->velocity + 6 * (size_t)e);
}

/* Component k: the free change, then what its rows change it by. */
SADMM_INLINE void joined_move(const struct joined_view *v, int32_t e, int k)
{
    double dv = v->missing[6 * (size_t)e + (size_t)k];
    int32_t at;
    for (at = v->s.first_around[e]; at < v->s.first_around[e + 1]; ++at) {
        const int32_t first = JOINED_ROWS * (v->s.around[at] / 2), side = v->s.around[at] % 2;
        dv += six_strided_product(v->change + first, 1, v->answer + 12 * (size_t)first + 6 * side + k, 12);
    }
    v->dv[6 * (size_t)e + (size_t)k] = dv;
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* Before anything else is known of a row; there: its constraint has it. Else its numbers are 0. */
SADMM_INLINE void joined_put_row(const struct joined_view *v, int32_t r, bool there)
{
    v->state[r] = there ? JOINED_INSIDE : JOINED_ABSENT;
    v->change[r] = v->give[r] = 0;
}

SADMM_INLINE void joined_respond(const struct joined_view *v, int32_t r, int side)
{
    const int32_t body = v->s.side[2 * (r / JOINED_ROWS) + side];
    double *answer = v->answer + 12 * (size_t)r + 6 * (size_t)side;
    int k;
    if (body >= 0 && v->state[r] != JOINED_ABSENT)
        ldl6_solve(v->factor + 36 * (size_t)body, v->rows[r].jacobian[side], answer);
    else
        for (k = 0; k < 6; ++k) answer[k] = 0;
}

/* gain x + bias + compliance lambda with the changes so far; moved: with dv; own: by the row's own compliance. */
SADMM_INLINE double joined_residual(const struct joined_view *v, int32_t r, bool moved, bool own)
{
    const struct joined_row *row = &v->rows[r];
    double x = 0;
    int side;
    for (side = 0; side < 2; ++side) {
        const int32_t body = v->s.side[2 * (r / JOINED_ROWS) + side];
        if (body < 0) continue;
        x += six_product(row->jacobian[side], v->velocity + 6 * (size_t)body);
        if (moved) x += six_product(row->jacobian[side], v->dv + 6 * (size_t)body);
    }
    return row->gain * x + row->bias + (own ? row->compliance : v->give[r]) * (row->lambda + v->change[r]);
}

SADMM_INLINE double joined_clamp(double x, double lo, double hi) { return x < lo ? lo : x > hi ? hi : x; }

/* It goes to a bound, or is let go. */
SADMM_INLINE void joined_put_state(const struct joined_view *v, int32_t r, uint8_t state)
{
    v->state[r] = state;
    if (state == JOINED_AT_LO) v->change[r] = v->rows[r].lo - v->rows[r].lambda;
    if (state == JOINED_AT_HI) v->change[r] = v->rows[r].hi - v->rows[r].lambda;
}

/* What a row's regularisation is a share of: its own response; between two bodies twice that of the one that responds
 * less. Else what light bodies between heavy ones pass on, carriers of joints say, would make locks soft: of 1e-4 of a
 * body's moment by ten thousand times as much. */
SADMM_INLINE double joined_scale(const struct joined_view *v, int32_t r)
{
    const double *answer = v->answer + 12 * (size_t)r;
    const double a = six_product(v->rows[r].jacobian[0], answer), b = six_product(v->rows[r].jacobian[1], answer + 6);
    return a > 0 && b > 0 ? 2 * (a < b ? a : b) : a + b;
}

/* Where a row that is there is before the first pass. earlier: where a solve of this step has left it, which is mostly
 * where it is still: iterations leave multipliers near bounds on either side. JOINED_ABSENT: there was none. */
SADMM_INLINE void joined_begin_row(const struct joined_view *v, int32_t r, uint8_t earlier)
{
    const struct joined_row *row = &v->rows[r];
    const double lambda = row->lambda, lo = row->lo, hi = row->hi;
    double missing;
    v->give[r] = sadmm_law_is_coupled(row->compliance, lo, hi) ? JOINED_GIVE * joined_scale(v, r) : row->compliance;
    v->change[r] = joined_clamp(lambda, lo, hi) - lambda;
    if (row->gain == 0 || !(hi > lo)) {
        const double given = row->compliance > 0 ? -row->bias / row->compliance : lambda;
        v->state[r] = JOINED_GIVEN;
        v->change[r] = joined_clamp(given, lo, hi) - lambda;
        return;
    }
    if (earlier == JOINED_INSIDE || earlier == JOINED_AT_LO || earlier == JOINED_AT_HI) {
        joined_put_state(v, r, earlier);
        return;
    }
    missing = lambda > lo && lambda < hi ? 0 : joined_residual(v, r, false, true);
    v->state[r] = lambda <= lo && missing >= 0   ? JOINED_AT_LO
                  : lambda >= hi && missing <= 0 ? JOINED_AT_HI
                                                 : JOINED_INSIDE;
}

/* After a pass: one that left its bounds stays at them, one that is held there against its law is let go. Did it
 * change? */
SADMM_INLINE bool joined_change_row(const struct joined_view *v, int32_t r)
{
    const struct joined_row *row = &v->rows[r];
    const uint8_t state = v->state[r];
    const double lambda = row->lambda + v->change[r];
    uint8_t next = state;
    if (state == JOINED_INSIDE) {
        next = lambda < row->lo ? JOINED_AT_LO : lambda > row->hi ? JOINED_AT_HI : JOINED_INSIDE;
    } else if (state == JOINED_AT_LO || state == JOINED_AT_HI) {
        const double missing = joined_residual(v, r, true, true), least = JOINED_SLACK * (1 + fabs(row->bias));
        if (state == JOINED_AT_LO ? missing < -least : missing > least) next = JOINED_INSIDE;
    }
    if (next == state) return false;
    joined_put_state(v, r, next);
    return true;
}

/* The share of a hard row's scale that is left of its response once all before it are met, in a part that is factored: next
 * to nothing where it says what they say. 0: the row is not held by what it is. */
SADMM_INLINE double joined_left(const struct joined_view *v, int32_t r)
{
    const struct joined_row *row = &v->rows[r];
    if (v->state[r] != JOINED_INSIDE || !sadmm_law_is_coupled(row->compliance, row->lo, row->hi)) return 0;
    const double left = JOINED_GIVE / (v->give[r] * v->pivot[r]);
    return isfinite(left) ? left : 0;
}

SADMM_INLINE double joined_bounded(const struct joined_view *v, int32_t r)
{
    return joined_clamp(v->rows[r].lambda + v->change[r], v->rows[r].lo, v->rows[r].hi);
}

/* ---- the factor -------------------------------------------------------------------------------------------------- */

/* Nodes are worked on in tiles, which fetch little for what they do. */
enum { TILE_ROWS = 2, TILE_COLUMNS = 3, JOINED_TILES = JOINED_BLOCK / (TILE_ROWS * TILE_COLUMNS) };
struct joined_tile {
    double entry[TILE_ROWS][TILE_COLUMNS];
};
SADMM_INLINE int joined_tile_row(int tile) { return TILE_ROWS * (tile / (JOINED_ROWS / TILE_COLUMNS)); }
SADMM_INLINE int joined_tile_column(int tile) { return TILE_COLUMNS * (tile % (JOINED_ROWS / TILE_COLUMNS)); }
/* Of a symmetric node: is none of it in the lower half? */
SADMM_INLINE bool joined_tile_is_above(int tile)
{
    return joined_tile_column(tile) >= joined_tile_row(tile) + TILE_ROWS;
}

SADMM_INLINE struct joined_tile joined_load_tile(const double *node, int tile)
{
    const double *at = node + JOINED_ROWS * joined_tile_row(tile) + joined_tile_column(tile);
    struct joined_tile t;
    int k, q;
    SADMM_UNROLL
    for (k = 0; k < TILE_ROWS; ++k) {
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) t.entry[k][q] = at[JOINED_ROWS * k + q];
    }
    return t;
}
SADMM_INLINE void joined_store_tile(double *node, int tile, const struct joined_tile *t)
{
    double *at = node + JOINED_ROWS * joined_tile_row(tile) + joined_tile_column(tile);
    int k, q;
    SADMM_UNROLL
    for (k = 0; k < TILE_ROWS; ++k) {
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) at[JOINED_ROWS * k + q] = t->entry[k][q];
    }
}

/* t += sign x y^T, six numbers a row of x and y, which are `x_stride` and `y_stride` apart. */
SADMM_INLINE void joined_add_products(struct joined_tile *t, double sign, const double *x, int x_stride,
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

/* A tile of a node in row and column `places` before anything is taken from it: J_i (A + C)^-1 J_j^T over the bodies
 * that both have, bits as in `common`. Rows that are not inside their bounds are 0, and 1 on the diagonal. */
SADMM_INLINE struct joined_tile joined_enter(const struct joined_view *v, int32_t row, int32_t column, int32_t common,
                                             int tile)
{
    const size_t first_row = (size_t)(JOINED_ROWS * row + joined_tile_row(tile)),
                 first_column = (size_t)(JOINED_ROWS * column + joined_tile_column(tile));
    struct joined_tile t = {{{0}}};
    int k, q;
    for (; common; common &= common - 1) { /* bit by bit of those that are set */
        const int bit = common & 1 ? 0 : common & 2 ? 1 : common & 4 ? 2 : 3;
        joined_add_products(&t, 1, v->rows[first_row].jacobian[bit / 2], sizeof(struct joined_row) / sizeof(double),
                            v->answer + 12 * first_column + 6 * (bit % 2), 12);
    }
    SADMM_UNROLL
    for (k = 0; k < TILE_ROWS; ++k) {
        SADMM_UNROLL
        for (q = 0; q < TILE_COLUMNS; ++q) {
            const size_t i = first_row + (size_t)k, j = first_column + (size_t)q;
            double *entry = &t.entry[k][q];
            if (v->state[i] != JOINED_INSIDE || v->state[j] != JOINED_INSIDE) *entry = i == j ? 1 : 0;
            else if (i == j) *entry += JOINED_PROXIMAL * joined_scale(v, (int32_t)i) + v->give[i] / v->rows[i].gain;
        }
    }
    return t;
}
enum { JOINED_OWN = 1 << 0 | 1 << 3 }; /* what a place has in common with itself: either side */

/* What updates `first` to `end` take from a tile of their node: L_u D L_w^T. */
SADMM_INLINE void joined_update(const struct joined_view *v, int32_t first, int32_t end, int tile,
                                struct joined_tile *t)
{
    int32_t at;
    for (at = first; at < end; ++at)
        joined_add_products(t, -1,
                            v->share + JOINED_BLOCK * (size_t)v->s.update[2 * at] + JOINED_ROWS * joined_tile_row(tile),
                            JOINED_ROWS,
                            v->below + JOINED_BLOCK * (size_t)v->s.update[2 * at + 1] +
                                JOINED_ROWS * joined_tile_column(tile),
                            JOINED_ROWS);
}

/* Row k of a block below the diagonal, L the factor of its column: S_ij L_jj^-T, and L_ij = S_ij L_jj^-T D_j^-1. */
SADMM_INLINE void joined_finish_row(const struct joined_view *v, const double L[36], int32_t b, int k)
{
    const size_t at = JOINED_BLOCK * (size_t)b + (size_t)(JOINED_ROWS * k);
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
SADMM_INLINE void joined_invert_row(const struct joined_view *v, const double L[36], int32_t place, int k)
{
    double *row = v->inverse + JOINED_BLOCK * (size_t)place + JOINED_ROWS * k, x[6];
    int q;
    SADMM_UNROLL
    for (q = 0; q < 6; ++q) x[q] = q == k ? 1 : 0;
    ldl6_forward(L, x);
    SADMM_UNROLL
    for (q = 0; q < 6; ++q) {
        row[q] = x[q];
        if (q == k) v->pivot[JOINED_ROWS * (size_t)place + (size_t)q] = L[7 * q];
    }
}

/* ---- solving with it --------------------------------------------------------------------------------------------- */

/* The right side of a row, moved with the rows that are not inside. again: what the give and the rounding have left. */
SADMM_INLINE double joined_right(const struct joined_view *v, int32_t r, bool again)
{
    return v->state[r] == JOINED_INSIDE ? -joined_residual(v, r, true, again) / v->rows[r].gain : 0;
}

/* Does the row give by much? */
SADMM_INLINE bool joined_gives_much(const struct joined_view *v, int32_t r)
{
    const struct joined_row *row = &v->rows[r];
    return v->state[r] == JOINED_INSIDE &&
           fabs((v->give[r] - row->compliance) * (row->lambda + v->change[r])) > JOINED_GIVES_MUCH;
}

/* What a row inside its bounds misses, m/s or rad/s. */
SADMM_INLINE double joined_misses(const struct joined_view *v, int32_t r)
{
    return v->state[r] == JOINED_INSIDE ? fabs(joined_residual(v, r, true, true)) : 0;
}

/* The change of a row's multiplier before and after it has been found. */
SADMM_INLINE void joined_put_change(const struct joined_view *v, int32_t r, bool again, bool found)
{
    if (v->state[r] == JOINED_INSIDE) v->change[r] = (again ? v->change[r] : 0) + (found ? v->found[r] : 0);
}

/* Row r of L_jj^-1 right; then of D_j^-1 of that; then, on the way back, of L_jj^-T right. */
SADMM_INLINE void joined_find_forward(const struct joined_view *v, int32_t r)
{
    const size_t place = (size_t)(r / JOINED_ROWS);
    v->found[r] = six_strided_product(v->inverse + JOINED_BLOCK * place + r % JOINED_ROWS, JOINED_ROWS,
                                         v->right + JOINED_ROWS * place, 1);
}
SADMM_INLINE void joined_turn(const struct joined_view *v, int32_t r) { v->right[r] = v->found[r] * v->pivot[r]; }
SADMM_INLINE void joined_find_backward(const struct joined_view *v, int32_t r)
{
    const size_t place = (size_t)(r / JOINED_ROWS);
    v->found[r] = six_product(v->inverse + JOINED_BLOCK * place + JOINED_ROWS * (r % JOINED_ROWS),
                                 v->right + JOINED_ROWS * place);
}

/* Forward: what columns before have found is taken from row k of a place, by the updates of its diagonal node. */
SADMM_INLINE void joined_push_right(const struct joined_view *v, int32_t place, int32_t first, int32_t end, int k)
{
    double *own = v->right + JOINED_ROWS * (size_t)place + k;
    int32_t at;
    for (at = first; at < end; ++at) {
        const int32_t b = v->s.update[2 * at];
        *own -= six_product(v->share + JOINED_BLOCK * (size_t)b + JOINED_ROWS * k,
                               v->found + JOINED_ROWS * (size_t)v->s.column[b]);
    }
}

/* Backward: what rows after it have found, by its blocks `first` to `end`. */
SADMM_INLINE void joined_pull_right(const struct joined_view *v, int32_t place, int32_t first, int32_t end, int k)
{
    double *own = v->right + JOINED_ROWS * (size_t)place + k;
    int32_t b;
    for (b = end - 1; b >= first; --b)
        *own -= six_strided_product(v->share + JOINED_BLOCK * (size_t)b + k, JOINED_ROWS,
                                       v->found + JOINED_ROWS * (size_t)v->s.row[b], 1);
}

#endif
