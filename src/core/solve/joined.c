#include "joined.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/dense6.h"
#include "core/model/system_math.h"
#include "joined_order.h"

enum { ROWS = SADMM_MAX_ROWS, BLOCK = ROWS * ROWS, SIDES = 2 };
/* Constraints at one body; more of them are left to the iteration, since all are coupled to each other. */
enum { MOST_AROUND = 64 };
/* Regularisation of the factor, a share of a row's own response: rows may say the same, but for rounding. */
#define PROXIMAL 1e-11
/* Rows that come to a bound, or leave one, are found in so many passes at most. */
enum { MOST_PASSES = 6 };

struct sadmm_joined {
    struct sadmm_joined_order order;
    int32_t *bodies;         /* two a constraint: what the order was made for */
    size_t constraints;
    int32_t body_count;

    double *A, *factor;      /* bodies x 36: A, Cholesky factor of A + C */
    double *missing, *dv;    /* bodies x 6: b - A v + J^T lambda, the change of velocity */
    uint8_t *joined;         /* bodies: 1: it has rows that are solved directly */
    double *answer;          /* (constraint, side, row) x 6: (A + C)^-1 J^T */
    double *diagonal, *below; /* BLOCK each */
    double *right;           /* ROWS each, by place: right side, then the change of multipliers */
    double *change;          /* rows: of multipliers */
    uint8_t *state;          /* rows: enum row_state */
    size_t bodies_capacity, body_capacity, answer_capacity, block_capacity, right_capacity, row_capacity;
};

enum row_state { INSIDE, AT_LO, AT_HI, GIVEN /* it does not depend on the motion */ };

/* One call. */
struct solving {
    struct sadmm_joined *j;
    const struct sadmm_system *system;
    const struct sadmm_settings *settings;
    struct sadmm_rows *rows;
};

struct sadmm_joined *sadmm_joined_create(void)
{
    return (struct sadmm_joined *)sadmm_alloc(1, sizeof(struct sadmm_joined));
}

void sadmm_joined_destroy(struct sadmm_joined *j)
{
    if (!j) return;
    sadmm_joined_order_free(&j->order);
    void *blocks[] = {j->bodies, j->A, j->factor, j->missing, j->dv, j->joined, j->answer, j->diagonal, j->below,
                      j->right, j->change, j->state};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    sadmm_free(j);
}

/* ---- structure ------------------------------------------------------------------------------------------------------ */

static bool same_graph(const struct sadmm_joined *j, const struct sadmm_system *system)
{
    const struct sadmm_rows *rows = system->rows;
    if (j->constraints != rows->constraint_count || j->body_count != system->body_count) return false;
    for (size_t k = 0; k < rows->constraint_count; ++k)
        if (j->bodies[2 * k] != rows->constraints[k].body_a || j->bodies[2 * k + 1] != rows->constraints[k].body_b)
            return false;
    return true;
}

static bool find_order(struct sadmm_joined *j, const struct sadmm_system *system)
{
    const struct sadmm_rows *rows = system->rows;
    const size_t n = rows->constraint_count;
    if (same_graph(j, system)) return true;
    j->constraints = 0;
    if (!sadmm_grow_empty(&j->bodies, &j->bodies_capacity, 2 * n, sizeof *j->bodies)) return false;
    for (size_t k = 0; k < n; ++k) {
        j->bodies[2 * k] = rows->constraints[k].body_a;
        j->bodies[2 * k + 1] = rows->constraints[k].body_b;
    }
    if (!sadmm_joined_order_make(&j->order, j->bodies, (int32_t)n, system->body_count, MOST_AROUND)) return false;
    j->constraints = n;
    j->body_count = system->body_count;
    return true;
}

static bool grow_bodies(struct sadmm_joined *j, size_t n)
{
    const struct {
        void *array;
        size_t size;
    } arrays[] = {{&j->A, 36 * sizeof *j->A}, {&j->factor, 36 * sizeof *j->factor},
                  {&j->missing, 6 * sizeof *j->missing}, {&j->dv, 6 * sizeof *j->dv}, {&j->joined, sizeof *j->joined}};
    const size_t before = j->body_capacity;
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; ++k) {
        size_t capacity = before;
        if (!sadmm_grow_empty(arrays[k].array, &capacity, n, arrays[k].size)) return false;
        j->body_capacity = capacity;
    }
    return true;
}

static bool reserve(struct sadmm_joined *j, const struct sadmm_system *system)
{
    const size_t places = (size_t)j->order.count, rows = system->rows->row_count;
    size_t capacity = j->row_capacity;
    if (!sadmm_grow_empty(&j->change, &capacity, rows, sizeof *j->change)) return false;
    if (!sadmm_grow_empty(&j->state, &j->row_capacity, rows, sizeof *j->state)) return false;
    capacity = j->right_capacity;
    if (!sadmm_grow_empty(&j->diagonal, &capacity, BLOCK * places, sizeof *j->diagonal)) return false;
    if (!sadmm_grow_empty(&j->right, &j->right_capacity, BLOCK * places, sizeof *j->right)) return false;
    return grow_bodies(j, (size_t)system->body_count) &&
           sadmm_grow_empty(&j->answer, &j->answer_capacity, 6 * SIDES * rows, sizeof *j->answer) &&
           sadmm_grow_empty(&j->below, &j->block_capacity, BLOCK * (size_t)j->order.blocks, sizeof *j->below);
}

/* ---- bodies ---------------------------------------------------------------------------------------------------------- */

static const struct sadmm_row_constraint *constraint_at(const struct solving *s, int32_t place)
{
    return &s->rows->constraints[s->j->order.constraint[place]];
}

static int32_t body_of(const struct sadmm_row_constraint *constraint, int side)
{
    return side ? constraint->body_b : constraint->body_a;
}

static const double *jacobian(const struct solving *s, size_t r, int side)
{
    return (side ? s->rows->jacobian_b : s->rows->jacobian_a) + 6 * r;
}

static double product(const double *x, const double *y)
{
    double sum = 0;
    for (int k = 0; k < 6; ++k) sum += x[k] * y[k];
    return sum;
}

static void add(double *to, double scale, const double *x)
{
    for (int k = 0; k < 6; ++k) to[k] += scale * x[k];
}

static void find_joined(struct solving *s)
{
    memset(s->j->joined, 0, (size_t)s->system->body_count);
    for (int32_t p = 0; p < s->j->order.count; ++p)
        for (int side = 0; side < SIDES; ++side) {
            const int32_t body = body_of(constraint_at(s, p), side);
            if (body >= 0) s->j->joined[body] = 1;
        }
}

/* What pairs and rows press joined bodies with, into `missing`. */
static void add_impulses(struct solving *s)
{
    const struct sadmm_contact_set *contacts = s->system->contacts;
    double *missing = s->j->missing;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        const int32_t bodies[SIDES] = {pair->body_a, pair->body_b};
        for (int side = 0; side < SIDES; ++side) {
            if (bodies[side] < 0 || !s->j->joined[bodies[side]]) continue;
            double *to = missing + 6 * (size_t)bodies[side];
            for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
                const struct sadmm_contact_point *point = &contacts->points[k];
                const vec3 push = v3_scale(v3_load(point->impulse), side ? 1 : -1);
                const vec3 turn = v3_cross(v3_load(side ? point->arm_b : point->arm_a), push);
                to[0] += push.x, to[1] += push.y, to[2] += push.z;
                to[3] += turn.x, to[4] += turn.y, to[5] += turn.z;
            }
        }
    }
    for (size_t k = 0; k < s->rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &s->rows->constraints[k];
        for (int side = 0; side < SIDES; ++side) {
            const int32_t body = body_of(constraint, side);
            if (body < 0 || !s->j->joined[body]) continue;
            for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)
                add(missing + 6 * (size_t)body, s->rows->lambda[r], jacobian(s, (size_t)r, side));
        }
    }
}

/* The speed that impulses of this size change joined bodies by, as V of the method `fast` (math/weight.h). */
static double speed_of_impulses(const struct solving *s)
{
    double energy = 0, mass = 0;
    for (int32_t i = 0; i < s->system->body_count; ++i) {
        double factor[36], x[6];
        if (!s->j->joined[i] || !dense6_cholesky(s->j->A + 36 * (size_t)i, factor)) continue;
        dense6_solve(factor, s->j->missing + 6 * (size_t)i, x);
        energy += product(x, s->j->missing + 6 * (size_t)i);
        mass += s->j->A[36 * (size_t)i];
    }
    return mass > 0 ? sqrt(energy / mass) : 0;
}

/* B J_c^T J_c of a point at `arm`. */
static void add_stiffness(double *A, double B, const double arm[3])
{
    const double x = arm[0], y = arm[1], z = arm[2];
    const double skew[9] = {0, z, -y, -z, 0, x, y, -x, 0}; /* -[arm]x */
    for (int i = 0; i < 3; ++i) A[7 * i] += B;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            A[6 * i + k + 3] += B * skew[3 * i + k];
            A[6 * (k + 3) + i] += B * skew[3 * i + k];
        }
    const double square = x * x + y * y + z * z;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) A[6 * (i + 3) + k + 3] += B * ((i == k ? square : 0) - arm[i] * arm[k]);
}

/* A + C into `factor`. */
static void add_contacts(struct solving *s, double speed)
{
    const struct sadmm_contact_set *contacts = s->system->contacts;
    for (size_t p = 0; speed > 0 && p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        const int32_t bodies[SIDES] = {pair->body_a, pair->body_b};
        double load = 0;
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
            load += v3_norm(v3_load(contacts->points[k].impulse)) / pair->count;
        for (int side = 0; side < SIDES && load > 0; ++side) {
            if (bodies[side] < 0 || !s->j->joined[bodies[side]]) continue;
            for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
                add_stiffness(s->j->factor + 36 * (size_t)bodies[side], load / speed,
                              side ? contacts->points[k].arm_b : contacts->points[k].arm_a);
        }
    }
}

static bool prepare_bodies(struct solving *s)
{
    struct sadmm_joined *j = s->j;
    const size_t n = (size_t)s->system->body_count;
    memset(j->missing, 0, 6 * n * sizeof *j->missing);
    add_impulses(s);
    for (size_t i = 0; i < n; ++i)
        if (j->joined[i]) sadmm_system_body(s->system, s->settings, (int32_t)i, j->A + 36 * i, j->dv + 6 * i);
    const double speed = speed_of_impulses(s);
    for (size_t i = 0; i < n; ++i) {
        if (!j->joined[i]) continue;
        add(j->missing + 6 * i, 1, j->dv + 6 * i); /* b */
        for (int r = 0; r < 6; ++r)
            j->missing[6 * i + (size_t)r] -= product(j->A + 36 * i + 6 * r, s->system->velocity + 6 * i);
        memcpy(j->factor + 36 * i, j->A + 36 * i, 36 * sizeof *j->factor);
    }
    add_contacts(s, speed);
    for (size_t i = 0; i < n; ++i) {
        double sum[36];
        if (!j->joined[i]) continue;
        memcpy(sum, j->factor + 36 * i, sizeof sum);
        if (!dense6_cholesky(sum, j->factor + 36 * i)) return false;
    }
    return true;
}

/* ---- rows ------------------------------------------------------------------------------------------------------------ */

static bool respond(struct solving *s)
{
    for (int32_t p = 0; p < s->j->order.count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int side = 0; side < SIDES; ++side) {
            const int32_t body = body_of(constraint, side);
            for (int32_t r = constraint->first; body >= 0 && r < constraint->first + constraint->count; ++r)
                dense6_solve(s->j->factor + 36 * (size_t)body, jacobian(s, (size_t)r, side),
                             s->j->answer + 6 * (2 * (size_t)r + (size_t)side));
        }
    }
    return true;
}

static const double *answer(const struct solving *s, size_t r, int side)
{
    return s->j->answer + 6 * (2 * r + (size_t)side);
}

/* gain x + bias + compliance lambda with the changes so far. */
static double residual(const struct solving *s, const struct sadmm_row_constraint *constraint, size_t r)
{
    double x = 0;
    for (int side = 0; side < SIDES; ++side) {
        const int32_t body = body_of(constraint, side);
        if (body < 0) continue;
        x += product(jacobian(s, r, side), s->system->velocity + 6 * (size_t)body) +
             product(jacobian(s, r, side), s->j->dv + 6 * (size_t)body);
    }
    return s->rows->gain[r] * x + s->rows->bias[r] + s->rows->compliance[r] * (s->rows->lambda[r] + s->j->change[r]);
}

/* Where a row is before the first pass. */
static void begin_row(struct solving *s, const struct sadmm_row_constraint *constraint, size_t r)
{
    const struct sadmm_rows *rows = s->rows;
    const double lambda = rows->lambda[r], lo = rows->lo[r], hi = rows->hi[r];
    s->j->change[r] = real_clamp(lambda, lo, hi) - lambda;
    if (rows->gain[r] == 0 || !(hi > lo)) {
        const double given = rows->compliance[r] > 0 ? -rows->bias[r] / rows->compliance[r] : lambda;
        s->j->state[r] = GIVEN;
        s->j->change[r] = real_clamp(given, lo, hi) - lambda;
        return;
    }
    const double missing = lambda > lo && lambda < hi ? 0 : residual(s, constraint, r);
    s->j->state[r] = lambda <= lo && missing >= 0 ? AT_LO : lambda >= hi && missing <= 0 ? AT_HI : INSIDE;
}

static void begin_rows(struct solving *s)
{
    memset(s->j->dv, 0, 6 * (size_t)s->system->body_count * sizeof *s->j->dv);
    for (int32_t p = 0; p < s->j->order.count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)
            begin_row(s, constraint, (size_t)r);
    }
}

/* ---- the factor ------------------------------------------------------------------------------------------------------ */

static bool is_inside(const struct solving *s, const struct sadmm_row_constraint *constraint, int k)
{
    return k < constraint->count && s->j->state[constraint->first + k] == INSIDE;
}

/* J_i (A + C)^-1 J_j^T over the bodies that two constraints have in common. Rows that are not inside their bounds are
 * 0, and 1 on the diagonal. */
static void couple(const struct solving *s, const struct sadmm_row_constraint *i, const struct sadmm_row_constraint *j,
                   double *block)
{
    memset(block, 0, BLOCK * sizeof *block);
    for (int a = 0; a < SIDES; ++a)
        for (int b = 0; b < SIDES; ++b) {
            if (body_of(i, a) < 0 || body_of(i, a) != body_of(j, b)) continue;
            for (int r = 0; r < i->count; ++r)
                for (int q = 0; q < j->count; ++q)
                    if (is_inside(s, i, r) && is_inside(s, j, q))
                        block[ROWS * r + q] +=
                            product(jacobian(s, (size_t)(i->first + r), a), answer(s, (size_t)(j->first + q), b));
        }
}

static void finish_diagonal(const struct solving *s, const struct sadmm_row_constraint *constraint, double *block)
{
    for (int r = 0; r < ROWS; ++r) {
        double *own = &block[(ROWS + 1) * r];
        if (!is_inside(s, constraint, r)) {
            *own = 1;
            continue;
        }
        const size_t row = (size_t)(constraint->first + r);
        *own += PROXIMAL * *own + s->rows->compliance[row] / s->rows->gain[row];
    }
}

/* S -= L_u L_w^T */
static void take(double *block, const double *u, const double *w)
{
    for (int r = 0; r < ROWS; ++r)
        for (int q = 0; q < ROWS; ++q) {
            double sum = 0;
            for (int k = 0; k < ROWS; ++k) sum += u[ROWS * r + k] * w[ROWS * q + k];
            block[ROWS * r + q] -= sum;
        }
}

static void update(const struct sadmm_joined *j, int32_t node, double *block)
{
    const struct sadmm_joined_order *o = &j->order;
    for (int32_t k = o->first_update[node]; k < o->first_update[node + 1]; ++k)
        take(block, j->below + BLOCK * (size_t)o->update[2 * k], j->below + BLOCK * (size_t)o->update[2 * k + 1]);
}

/* A pivot that is lost to rounding: the row says what others say; it stays as it is. */
static void factor_diagonal(double *block)
{
    for (int k = 0; k < ROWS; ++k) {
        double d = block[(ROWS + 1) * k];
        for (int i = 0; i < k; ++i) d -= block[ROWS * k + i] * block[ROWS * k + i];
        const bool lost = !(d > 0) || isinf(d);
        d = lost ? INFINITY : sqrt(d);
        block[(ROWS + 1) * k] = d;
        for (int r = k + 1; r < ROWS; ++r) {
            double sum = block[ROWS * r + k];
            for (int i = 0; i < k; ++i) sum -= block[ROWS * r + i] * block[ROWS * k + i];
            block[ROWS * r + k] = lost ? 0 : sum / d;
        }
    }
}

/* L_ij = S_ij L_jj^-T */
static void factor_below(double *block, const double *diagonal)
{
    for (int r = 0; r < ROWS; ++r)
        for (int k = 0; k < ROWS; ++k) {
            double sum = block[ROWS * r + k];
            for (int i = 0; i < k; ++i) sum -= block[ROWS * r + i] * diagonal[ROWS * k + i];
            block[ROWS * r + k] = sum / diagonal[(ROWS + 1) * k];
        }
}

static void factorize(struct solving *s)
{
    struct sadmm_joined *j = s->j;
    const struct sadmm_joined_order *o = &j->order;
    for (int32_t p = 0; p < o->count; ++p) {
        double *diagonal = j->diagonal + BLOCK * (size_t)p;
        couple(s, constraint_at(s, p), constraint_at(s, p), diagonal);
        finish_diagonal(s, constraint_at(s, p), diagonal);
        update(j, p, diagonal);
        factor_diagonal(diagonal);
        for (int32_t b = o->first_below[p]; b < o->first_below[p + 1]; ++b) {
            double *block = j->below + BLOCK * (size_t)b;
            couple(s, constraint_at(s, o->row[b]), constraint_at(s, p), block);
            update(j, o->count + b, block);
            factor_below(block, diagonal);
        }
    }
}

/* ---- a pass ---------------------------------------------------------------------------------------------------------- */

/* dv = (A + C)^-1 (missing + J^T change), of joined bodies. */
static void move_bodies(struct solving *s)
{
    struct sadmm_joined *j = s->j;
    const size_t n = (size_t)s->system->body_count;
    for (size_t i = 0; i < n; ++i)
        if (j->joined[i]) dense6_solve(j->factor + 36 * i, j->missing + 6 * i, j->dv + 6 * i);
    for (int32_t p = 0; p < j->order.count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int side = 0; side < SIDES; ++side) {
            const int32_t body = body_of(constraint, side);
            for (int32_t r = constraint->first; body >= 0 && r < constraint->first + constraint->count; ++r)
                add(j->dv + 6 * (size_t)body, j->change[r], answer(s, (size_t)r, side));
        }
    }
}

/* Multipliers of rows inside their bounds, for what the others are. */
static void solve_rows(struct solving *s)
{
    struct sadmm_joined *j = s->j;
    const struct sadmm_joined_order *o = &j->order;
    for (int32_t p = 0; p < o->count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int k = 0; k < constraint->count; ++k)
            if (is_inside(s, constraint, k)) j->change[constraint->first + k] = 0;
    }
    move_bodies(s);
    for (int32_t p = 0; p < o->count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int k = 0; k < ROWS; ++k) {
            const size_t r = (size_t)(constraint->first + k);
            j->right[ROWS * (size_t)p + (size_t)k] =
                is_inside(s, constraint, k) ? -residual(s, constraint, r) / s->rows->gain[r] : 0;
        }
    }
    for (int32_t p = 0; p < o->count; ++p) {
        double *own = j->right + ROWS * (size_t)p;
        const double *diagonal = j->diagonal + BLOCK * (size_t)p;
        for (int32_t u = o->first_update[p]; u < o->first_update[p + 1]; ++u) {
            const int32_t b = o->update[2 * u];
            const double *block = j->below + BLOCK * (size_t)b, *other = j->right + ROWS * (size_t)o->column[b];
            for (int r = 0; r < ROWS; ++r)
                for (int k = 0; k < ROWS; ++k) own[r] -= block[ROWS * r + k] * other[k];
        }
        dense6_forward(diagonal, own, own);
    }
    for (int32_t p = o->count - 1; p >= 0; --p) {
        double *own = j->right + ROWS * (size_t)p;
        for (int32_t b = o->first_below[p]; b < o->first_below[p + 1]; ++b) {
            const double *block = j->below + BLOCK * (size_t)b, *other = j->right + ROWS * (size_t)o->row[b];
            for (int r = 0; r < ROWS; ++r)
                for (int k = 0; k < ROWS; ++k) own[k] -= block[ROWS * r + k] * other[r];
        }
        dense6_backward(j->diagonal + BLOCK * (size_t)p, own, own);
    }
    for (int32_t p = 0; p < o->count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int k = 0; k < constraint->count; ++k)
            if (is_inside(s, constraint, k))
                j->change[constraint->first + k] = j->right[ROWS * (size_t)p + (size_t)k];
    }
    move_bodies(s);
}

/* Rows that left their bounds stay at them, rows that are held there against their law are let go. False: none. */
static bool change_states(struct solving *s)
{
    const struct sadmm_rows *rows = s->rows;
    bool changed = false;
    for (int32_t p = 0; p < s->j->order.count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int32_t k = constraint->first; k < constraint->first + constraint->count; ++k) {
            const size_t r = (size_t)k;
            const uint8_t state = s->j->state[r];
            const double lambda = rows->lambda[r] + s->j->change[r];
            uint8_t next = state;
            if (state == INSIDE) next = lambda < rows->lo[r] ? AT_LO : lambda > rows->hi[r] ? AT_HI : INSIDE;
            else if (state == AT_LO || state == AT_HI) {
                const double missing = residual(s, constraint, r), least = 1e-12 * fabs(rows->bias[r]);
                if (state == AT_LO ? missing < -least : missing > least) next = INSIDE;
            }
            if (next == state) continue;
            s->j->state[r] = next;
            changed = true;
            if (next == AT_LO) s->j->change[r] = rows->lo[r] - rows->lambda[r];
            if (next == AT_HI) s->j->change[r] = rows->hi[r] - rows->lambda[r];
        }
    }
    return changed;
}

static bool is_finite(const struct solving *s)
{
    double sum = 0;
    for (int32_t i = 0; i < s->system->body_count; ++i)
        for (size_t k = 0; s->j->joined[i] && k < 6; ++k) sum += s->j->dv[6 * (size_t)i + k] * 0;
    for (int32_t p = 0; p < s->j->order.count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)
            sum += s->j->change[r] * 0;
    }
    return sum == 0;
}

static void store(struct solving *s)
{
    struct sadmm_rows *rows = s->rows;
    for (int32_t i = 0; i < s->system->body_count; ++i)
        if (s->j->joined[i]) add(s->system->velocity + 6 * (size_t)i, 1, s->j->dv + 6 * (size_t)i);
    for (int32_t p = 0; p < s->j->order.count; ++p) {
        const struct sadmm_row_constraint *constraint = constraint_at(s, p);
        for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)
            rows->lambda[r] = real_clamp(rows->lambda[r] + s->j->change[r], rows->lo[r], rows->hi[r]);
    }
}

sadmm_status sadmm_joined_solve(struct sadmm_joined *joined, const struct sadmm_system *system,
                                const struct sadmm_settings *settings, struct sadmm_error *error)
{
    struct solving s = {joined, system, settings, system->rows};
    if (!system->rows || system->rows->constraint_count == 0) return SADMM_OK;
    if (!find_order(joined, system) || !reserve(joined, system))
        return sadmm_fail_memory(error, "joined bodies");
    if (joined->order.count == 0) return SADMM_OK;
    find_joined(&s);
    if (!prepare_bodies(&s) || !respond(&s)) return SADMM_OK; /* left to the iteration */
    begin_rows(&s);
    for (int pass = 0; pass < MOST_PASSES; ++pass) {
        factorize(&s);
        solve_rows(&s);
        if (!change_states(&s)) break;
    }
    if (is_finite(&s)) store(&s);
    return SADMM_OK;
}
