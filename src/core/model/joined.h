/* Bodies joined by constraint rows, solved directly (core/solve/joined.h): the formulas, entry by entry, for a host
 * that goes through them in order and a device whose threads share them. In double. Every sum goes along a list that
 * ascends, so that both give the same bits.
 *
 *   parts      constraints that hang together by bodies that are solved for
 *   places     their constraints, in the order of elimination: part by part, level by level; places of a level are not
 *              coupled to each other
 *   nodes      blocks of the factor: place j its diagonal one, count + b the b-th below the diagonal */
#ifndef SADMM_CORE_MODEL_JOINED_H
#define SADMM_CORE_MODEL_JOINED_H

#include "core/base/contact_set.h"
#include "core/math/rigid.h"
#include "rows.h"

enum { JOINED_ROWS = SADMM_MAX_ROWS, JOINED_BLOCK = JOINED_ROWS * JOINED_ROWS };
/* Regularisation of the factor, a share of a row's own response: rows may say the same, but for rounding. */
#define JOINED_PROXIMAL 1e-11
/* Compliance of hard rows, a share of a row's own response: a load moves a lock by a billionth of what it would move
 * the bodies by if nothing else held them. Rows of a loop that has more locks than it needs contradict each other by
 * what its joints are off, along multipliers to which nothing responds; without it these grow from step to step (scene
 * bricard: to 1e6 N where 30 are at work) until they hold the loop. */
#define JOINED_GIVE 1e-9
/* Rows that come to a bound, or leave one, are found in so many passes at most; one or two do mostly, and 9 in all but
 * 6 of 8,000 solves of ragdolls that fall on each other. A row that is held against its law by less than a rounding of
 * its numbers and JOINED_SLACK, m/s or rad/s, stays where it is, or rounding would have rows come and go for good. */
enum { JOINED_PASSES = 16 };
#define JOINED_SLACK 1e-9

/* Where a row is: between its bounds, at one of them, or given: it does not depend on the motion. */
enum joined_state { JOINED_INSIDE, JOINED_AT_LO, JOINED_AT_HI, JOINED_GIVEN };

struct joined_structure {
    int32_t count, blocks, parts, bodies; /* bodies: that have rows solved directly */
    const int32_t *constraint;     /* (count) place -> constraint */
    const int32_t *first_level;    /* (parts + 1) part -> its levels */
    const int32_t *first_of_level; /* (levels + 1) level -> its places */
    const int32_t *first_below;    /* (count + 1) place of a column -> its blocks */
    const int32_t *row, *column;   /* (blocks) places */
    const int32_t *first_update;   /* (count + blocks + 1) node -> what is taken from it: L_u L_w^T */
    const int32_t *update;         /* 2 each: blocks u, w; of a diagonal node its row's blocks, u = w */
    const int32_t *first_body;     /* (parts + 1) part -> its bodies in `body` */
    const int32_t *body;           /* (bodies) */
    const int32_t *first_around;   /* (bodies + 1) entry of `body` -> its constraints' sides */
    const int32_t *around;         /* 2 place + side */
};

struct joined_view {
    struct joined_structure s;
    /* The rows, as they lie: number r of a row begins at `first` of its constraint. */
    const struct sadmm_row_constraint *constraints;
    const double *jacobian[2], *gain, *bias, *compliance, *lo, *hi;
    int32_t jacobian_stride, law_stride;
    /* Work. By body of the system: */
    double *velocity;                       /* x 6 */
    double *A, *factor;                     /* x 36: A; Cholesky factor of A + C */
    double *missing, *dv;                   /* x 6: b - A v + J^T lambda; the change of velocity */
    /* by row: */
    double *lambda, *change;                /* multipliers as they were, what they change by */
    double *answer;                         /* 2 x 6: (A + C)^-1 J^T of either side */
    uint8_t *state;
    /* by place, by block: */
    double *diagonal, *below, *right;       /* JOINED_BLOCK, JOINED_BLOCK, JOINED_ROWS */
};

/* Numbers that the work on so many bodies and rows takes, without `velocity` and `state`; and where they lie. */
SADMM_INLINE size_t joined_work_size(const struct joined_structure *s, size_t bodies, size_t rows)
{
    return (2 * 36 + 2 * 6) * bodies + (2 + 2 * 6) * rows + (JOINED_BLOCK + JOINED_ROWS) * (size_t)s->count +
           JOINED_BLOCK * (size_t)s->blocks;
}
SADMM_INLINE void joined_bind_work(struct joined_view *v, double *work, size_t bodies, size_t rows)
{
    v->A = work;
    v->factor = v->A + 36 * bodies;
    v->missing = v->factor + 36 * bodies;
    v->dv = v->missing + 6 * bodies;
    v->lambda = v->dv + 6 * bodies;
    v->change = v->lambda + rows;
    v->answer = v->change + rows;
    v->diagonal = v->answer + 2 * 6 * rows;
    v->right = v->diagonal + JOINED_BLOCK * (size_t)v->s.count;
    v->below = v->right + JOINED_ROWS * (size_t)v->s.count;
}

SADMM_INLINE const struct sadmm_row_constraint *joined_at(const struct joined_view *v, int32_t place)
{
    return &v->constraints[v->s.constraint[place]];
}
SADMM_INLINE int32_t joined_body(const struct sadmm_row_constraint *constraint, int side)
{
    return side ? constraint->body_b : constraint->body_a;
}
SADMM_INLINE const double *joined_jacobian(const struct joined_view *v, int32_t r, int side)
{
    /* not by an index that varies: the view stays in registers */
    return (side ? v->jacobian[1] : v->jacobian[0]) + (size_t)v->jacobian_stride * (size_t)r;
}
SADMM_INLINE size_t joined_law(const struct joined_view *v, int32_t r) { return (size_t)v->law_stride * (size_t)r; }
SADMM_INLINE double *joined_answer(const struct joined_view *v, int32_t r, int side)
{
    return v->answer + 6 * (2 * (size_t)r + (size_t)side);
}
SADMM_INLINE double joined_product(const double *x, const double *y)
{
    double sum = 0;
    int k;
    for (k = 0; k < 6; ++k) sum += x[k] * y[k];
    return sum;
}

/* ---- six by six -------------------------------------------------------------------------------------------------- */

/* Cholesky factor of a symmetric matrix, of which the lower half is read, in the same place; on the diagonal are the
 * inverses of its own. A pivot that is lost to rounding: the row says what others say, and its solution is 0. In
 * registers: what waits for memory waits longest here. */
SADMM_INLINE void joined_cholesky(double matrix[36])
{
    double L[6][6];
    int r, k, i;
    SADMM_UNROLL
    for (r = 0; r < 6; ++r) {
        SADMM_UNROLL
        for (k = 0; k <= r; ++k) L[r][k] = matrix[6 * r + k];
    }
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) {
        double d = L[k][k], inverse;
        SADMM_UNROLL
        for (i = 0; i < k; ++i) d -= L[k][i] * L[k][i];
        inverse = d > 0 ? 1 / sqrt(d) : 0;
        L[k][k] = inverse;
        SADMM_UNROLL
        for (r = k + 1; r < 6; ++r) {
            double sum = L[r][k];
            SADMM_UNROLL
            for (i = 0; i < k; ++i) sum -= L[r][i] * L[k][i];
            L[r][k] = sum * inverse;
        }
    }
    SADMM_UNROLL
    for (r = 0; r < 6; ++r) {
        SADMM_UNROLL
        for (k = 0; k <= r; ++k) matrix[6 * r + k] = L[r][k];
    }
}

/* L^-1 x, L^-T x in place; x = A^-1 b by both. */
SADMM_INLINE void joined_forward(const double L[36], double x[6])
{
    double y[6];
    int r, i;
    SADMM_UNROLL
    for (r = 0; r < 6; ++r) {
        double sum = x[r];
        SADMM_UNROLL
        for (i = 0; i < r; ++i) sum -= L[6 * r + i] * y[i];
        y[r] = sum * L[7 * r];
    }
    SADMM_UNROLL
    for (r = 0; r < 6; ++r) x[r] = y[r];
}
SADMM_INLINE void joined_backward(const double L[36], double x[6])
{
    double y[6];
    int r, i;
    SADMM_UNROLL
    for (r = 5; r >= 0; --r) {
        double sum = x[r];
        SADMM_UNROLL
        for (i = r + 1; i < 6; ++i) sum -= L[6 * i + r] * y[i];
        y[r] = sum * L[7 * r];
    }
    SADMM_UNROLL
    for (r = 0; r < 6; ++r) x[r] = y[r];
}
SADMM_INLINE void joined_solve(const double L[36], const double b[6], double x[6])
{
    double y[6];
    int k;
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) y[k] = b[k];
    joined_forward(L, y);
    joined_backward(L, y);
    SADMM_UNROLL
    for (k = 0; k < 6; ++k) x[k] = y[k];
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* What the points of a pair press its body on `side` with. */
SADMM_INLINE void joined_add_pair(const struct sadmm_contact_point *points, int32_t count, int side, double to[6])
{
    int32_t k;
    for (k = 0; k < count; ++k) {
        const struct sadmm_contact_point *point = &points[k];
        const double *arm = side ? point->arm_b : point->arm_a, sign = side ? 1 : -1;
        const double x = sign * point->impulse[0], y = sign * point->impulse[1], z = sign * point->impulse[2];
        to[0] += x, to[1] += y, to[2] += z;
        to[3] += arm[1] * z - arm[2] * y;
        to[4] += arm[2] * x - arm[0] * z;
        to[5] += arm[0] * y - arm[1] * x;
    }
}
SADMM_INLINE void joined_add_rows(const struct joined_view *v, const struct sadmm_row_constraint *constraint, int side,
                                  double to[6])
{
    int32_t r;
    int k;
    for (r = constraint->first; r < constraint->first + constraint->count; ++r)
        for (k = 0; k < 6; ++k) to[k] += v->lambda[r] * joined_jacobian(v, r, side)[k];
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

/* B J_c^T J_c of a point at `arm`. */
SADMM_INLINE void joined_add_point(double A[36], double B, const double arm[3])
{
    const double x = arm[0], y = arm[1], z = arm[2], square = x * x + y * y + z * z;
    const double skew[9] = {0, z, -y, -z, 0, x, y, -x, 0}; /* -[arm]x */
    int i, k;
    for (i = 0; i < 3; ++i) A[7 * i] += B;
    for (i = 0; i < 3; ++i)
        for (k = 0; k < 3; ++k) {
            A[6 * i + k + 3] += B * skew[3 * i + k];
            A[6 * (k + 3) + i] += B * skew[3 * i + k];
            A[6 * (i + 3) + k + 3] += B * ((i == k ? square : 0) - arm[i] * arm[k]);
        }
}
/* The same of a pair, whose contacts are as stiff as the mass that rests on them. */
SADMM_INLINE void joined_add_contact(const struct sadmm_contact_point *points, int32_t count, int side, double speed,
                                     double A[36])
{
    double load = 0;
    int32_t k;
    for (k = 0; k < count; ++k) load += v3_norm(v3_load(points[k].impulse)) / count;
    for (k = 0; load > 0 && speed > 0 && k < count; ++k)
        joined_add_point(A, load / speed, side ? points[k].arm_b : points[k].arm_a);
}

SADMM_INLINE double joined_speed(double energy, double mass) { return mass > 0 ? sqrt(energy / mass) : 0; }

/* Entry e of `body`: b - A v + J^T lambda. */
SADMM_INLINE void joined_miss(const struct joined_view *v, int32_t e, const double b[6], const double impulse[6])
{
    const size_t i = (size_t)v->s.body[e];
    int k;
    for (k = 0; k < 6; ++k)
        v->missing[6 * i + (size_t)k] =
            b[k] + impulse[k] - joined_product(v->A + 36 * i + 6 * k, v->velocity + 6 * i);
}

/* A + C becomes its factor. */
SADMM_INLINE void joined_factor_body(const struct joined_view *v, int32_t e)
{
    joined_cholesky(v->factor + 36 * (size_t)v->s.body[e]);
}

/* Entry e of `body`: the free change of velocity, then what its rows change it by. */
SADMM_INLINE void joined_move(const struct joined_view *v, int32_t e)
{
    const size_t i = (size_t)v->s.body[e];
    double *dv = v->dv + 6 * i;
    int32_t at, r;
    int k;
    joined_solve(v->factor + 36 * i, v->missing + 6 * i, dv);
    for (at = v->s.first_around[e]; at < v->s.first_around[e + 1]; ++at) {
        const struct sadmm_row_constraint *constraint = joined_at(v, v->s.around[at] / 2);
        for (r = constraint->first; r < constraint->first + constraint->count; ++r)
            for (k = 0; k < 6; ++k) dv[k] += v->change[r] * joined_answer(v, r, v->s.around[at] % 2)[k];
    }
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

SADMM_INLINE void joined_respond(const struct joined_view *v, const struct sadmm_row_constraint *constraint, int32_t r)
{
    int side;
    for (side = 0; side < 2; ++side) {
        const int32_t body = joined_body(constraint, side);
        if (body >= 0)
            joined_solve(v->factor + 36 * (size_t)body, joined_jacobian(v, r, side), joined_answer(v, r, side));
    }
}

/* That of the row's law; what is hard gives by JOINED_GIVE. */
SADMM_INLINE double joined_compliance(const struct joined_view *v, const struct sadmm_row_constraint *constraint,
                                      int32_t r)
{
    const size_t law = joined_law(v, r);
    double response = 0;
    int side;
    if (!sadmm_law_is_coupled(v->compliance[law], v->lo[law], v->hi[law])) return v->compliance[law];
    for (side = 0; side < 2; ++side)
        if (joined_body(constraint, side) >= 0)
            response += joined_product(joined_jacobian(v, r, side), joined_answer(v, r, side));
    return JOINED_GIVE * response;
}

/* gain x + bias + compliance lambda with the changes so far; moved: with dv. */
SADMM_INLINE double joined_residual(const struct joined_view *v, const struct sadmm_row_constraint *constraint,
                                    int32_t r, bool moved)
{
    const size_t law = joined_law(v, r);
    double x = 0;
    int side;
    for (side = 0; side < 2; ++side) {
        const int32_t body = joined_body(constraint, side);
        if (body < 0) continue;
        x += joined_product(joined_jacobian(v, r, side), v->velocity + 6 * (size_t)body);
        if (moved) x += joined_product(joined_jacobian(v, r, side), v->dv + 6 * (size_t)body);
    }
    return v->gain[law] * x + v->bias[law] +
           joined_compliance(v, constraint, r) * (v->lambda[r] + v->change[r]);
}

SADMM_INLINE double joined_clamp(double x, double lo, double hi) { return x < lo ? lo : x > hi ? hi : x; }

/* Where a row is before the first pass. */
SADMM_INLINE void joined_begin_row(const struct joined_view *v, const struct sadmm_row_constraint *constraint,
                                   int32_t r)
{
    const size_t law = joined_law(v, r);
    const double lambda = v->lambda[r], lo = v->lo[law], hi = v->hi[law];
    double missing;
    v->change[r] = joined_clamp(lambda, lo, hi) - lambda;
    if (v->gain[law] == 0 || !(hi > lo)) {
        const double given = v->compliance[law] > 0 ? -v->bias[law] / v->compliance[law] : lambda;
        v->state[r] = JOINED_GIVEN;
        v->change[r] = joined_clamp(given, lo, hi) - lambda;
        return;
    }
    missing = lambda > lo && lambda < hi ? 0 : joined_residual(v, constraint, r, false);
    v->state[r] = lambda <= lo && missing >= 0   ? JOINED_AT_LO
                  : lambda >= hi && missing <= 0 ? JOINED_AT_HI
                                                 : JOINED_INSIDE;
}

/* After a pass: one that left its bounds stays at them, one that is held there against its law is let go. Did it
 * change? */
SADMM_INLINE bool joined_change_row(const struct joined_view *v, const struct sadmm_row_constraint *constraint,
                                    int32_t r)
{
    const size_t law = joined_law(v, r);
    const uint8_t state = v->state[r];
    const double lambda = v->lambda[r] + v->change[r];
    uint8_t next = state;
    if (state == JOINED_INSIDE) {
        next = lambda < v->lo[law] ? JOINED_AT_LO : lambda > v->hi[law] ? JOINED_AT_HI : JOINED_INSIDE;
    } else if (state != JOINED_GIVEN) {
        const double missing = joined_residual(v, constraint, r, true), least = JOINED_SLACK * (1 + fabs(v->bias[law]));
        if (state == JOINED_AT_LO ? missing < -least : missing > least) next = JOINED_INSIDE;
    }
    if (next == state) return false;
    v->state[r] = next;
    if (next == JOINED_AT_LO) v->change[r] = v->lo[law] - v->lambda[r];
    if (next == JOINED_AT_HI) v->change[r] = v->hi[law] - v->lambda[r];
    return true;
}

SADMM_INLINE bool joined_is_inside(const struct joined_view *v, const struct sadmm_row_constraint *constraint, int k)
{
    return k < constraint->count && v->state[constraint->first + k] == JOINED_INSIDE;
}

SADMM_INLINE double joined_bounded(const struct joined_view *v, int32_t r)
{
    const size_t law = joined_law(v, r);
    return joined_clamp(v->lambda[r] + v->change[r], v->lo[law], v->hi[law]);
}

/* ---- the factor -------------------------------------------------------------------------------------------------- */

/* Entry (k, q) of a node before anything is taken from it: J_i (A + C)^-1 J_j^T over the bodies that two constraints
 * have in common. Rows that are not inside their bounds are 0, and 1 on the diagonal. */
SADMM_INLINE double joined_entry(const struct joined_view *v, int32_t row, int32_t column, int k, int q)
{
    const struct sadmm_row_constraint *i = joined_at(v, row), *j = joined_at(v, column);
    const bool diagonal = row == column && k == q;
    double sum = 0;
    int a, b;
    if (!joined_is_inside(v, i, k) || !joined_is_inside(v, j, q)) return diagonal ? 1 : 0;
    for (a = 0; a < 2; ++a)
        for (b = 0; b < 2; ++b)
            if (joined_body(i, a) >= 0 && joined_body(i, a) == joined_body(j, b))
                sum += joined_product(joined_jacobian(v, i->first + k, a), joined_answer(v, j->first + q, b));
    if (diagonal) {
        const size_t law = joined_law(v, i->first + k);
        sum += JOINED_PROXIMAL * sum + joined_compliance(v, i, i->first + k) / v->gain[law];
    }
    return sum;
}

/* The same with all that is taken from it; entry: before. */
SADMM_INLINE double joined_updated(const struct joined_view *v, int32_t node, double entry, int k, int q)
{
    int32_t at;
    int i;
    for (at = v->s.first_update[node]; at < v->s.first_update[node + 1]; ++at) {
        const double *u = v->below + JOINED_BLOCK * (size_t)v->s.update[2 * at] + JOINED_ROWS * k,
                     *w = v->below + JOINED_BLOCK * (size_t)v->s.update[2 * at + 1] + JOINED_ROWS * q;
        double sum = 0;
        for (i = 0; i < JOINED_ROWS; ++i) sum += u[i] * w[i];
        entry -= sum;
    }
    return entry;
}

/* ---- solving with it --------------------------------------------------------------------------------------------- */

/* The right side of row k of a place, moved with the rows that are not inside. */
SADMM_INLINE double joined_right(const struct joined_view *v, int32_t place, int k)
{
    const struct sadmm_row_constraint *constraint = joined_at(v, place);
    const int32_t r = constraint->first + k;
    if (!joined_is_inside(v, constraint, k)) return 0;
    return -joined_residual(v, constraint, r, true) / v->gain[joined_law(v, r)];
}

/* Forward: less what the columns before have found. */
SADMM_INLINE double joined_forward_row(const struct joined_view *v, int32_t place, int k)
{
    double own = v->right[JOINED_ROWS * (size_t)place + (size_t)k];
    int32_t at;
    int i;
    for (at = v->s.first_update[place]; at < v->s.first_update[place + 1]; ++at) {
        const int32_t b = v->s.update[2 * at];
        const double *block = v->below + JOINED_BLOCK * (size_t)b + JOINED_ROWS * k,
                     *other = v->right + JOINED_ROWS * (size_t)v->s.column[b];
        for (i = 0; i < JOINED_ROWS; ++i) own -= block[i] * other[i];
    }
    return own;
}

SADMM_INLINE double joined_backward_row(const struct joined_view *v, int32_t place, int k)
{
    double own = v->right[JOINED_ROWS * (size_t)place + (size_t)k];
    int32_t b;
    int i;
    for (b = v->s.first_below[place]; b < v->s.first_below[place + 1]; ++b) {
        const double *block = v->below + JOINED_BLOCK * (size_t)b,
                     *other = v->right + JOINED_ROWS * (size_t)v->s.row[b];
        for (i = 0; i < JOINED_ROWS; ++i) own -= block[JOINED_ROWS * i + k] * other[i];
    }
    return own;
}

#endif
