/* The momentum of an island of rigid bodies along the motions that none of its static contacts feels.
 *
 * A rigid motion of the whole island, q = (u, w): body i at d_i from the origin gets G_i q = (u + w x d_i, w). Contacts
 * between bodies of the island do not feel it. Static ones do: with friction all of the velocity of their point,
 * without the normal part alone. The motions that no static contact feels are the null space of
 *
 *     gram = sum over static rows of (J G)^T J G
 *
 * and along them the momentum of a solution is known, whatever the multipliers: m . G^T (A v - b) = 0. An iteration
 * that is cut short does not reach it. With the motions m_k of that space, orthonormal by G^T A G,
 *
 *     v <- v + G sum_k m_k (m_k . G^T (b - A v))
 *
 * which changes no contact's velocity and leaves a solution as it is. sum_k (m_k . G^T A v)^2 / 2 is the energy of the
 * rigid part of v, by A orthogonal to the rest. The origin is anywhere in the island. Double in every precision. */
#ifndef SADMM_MATH_MOMENTUM_H
#define SADMM_MATH_MOMENTUM_H

#include "array3.h"
#include "packed6.h"

/* A pair anchors its island if it has friction and three points that are not on a line, by 1 % or so: no motion is left
 * then. `arms` are of the pair's points on either body. Twice the area of triangles of points, squared, against squares
 * of lengths: sums of both over all pairs of points are invariants of the points' scatter. */
#define MOMENTUM_NO_LINE 1e-4

SADMM_INLINE int momentum_is_anchored(double friction, const struct arm_sums *arms)
{
    const double *r = arms->r, *rr = arms->rr, share = arms->count > 0 ? 1 / arms->count : 0;
    const double xx = rr[0] - share * r[0] * r[0], yy = rr[1] - share * r[1] * r[1], zz = rr[2] - share * r[2] * r[2],
                 xy = rr[3] - share * r[0] * r[1], xz = rr[4] - share * r[0] * r[2], yz = rr[5] - share * r[1] * r[2];
    const double trace = xx + yy + zz, area2 = xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz;
    /* the size of what cancels: a point far from the body's centre has no scatter but rounding */
    const double least = 1e-12 * (rr[0] + rr[1] + rr[2]);
    return friction > 0 && arms->count >= 3 && trace > least && area2 > MOMENTUM_NO_LINE * trace * trace;
}

/* Sums over an island; about its origin. */
struct momentum_sums {
    double now[6], free[6];             /* G^T A v, G^T b; N s, N m s */
    double mass, moment[3], inertia[6]; /* G^T A G: kg, sum m d, xx yy zz xy xz yz */
    double gram[PACKED6 + 1];           /* then how many contacts it is of; 0: not counted */
};
enum { MOMENTUM_CONTACTS = PACKED6, MOMENTUM_SUMS = 22 + PACKED6 + 1 };

/* What a body at d adds; A = (m I, inertia). By its velocity alone, */
SADMM_INLINE void momentum_add_now(double now[6], const double d[3], const double A[PACKED6], const double v[6])
{
    const double m = A[0], momentum[3] = {m * v[0], m * v[1], m * v[2]};
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) now[k] += momentum[k];
    now[3] += A[9] * v[3] + A[13] * v[4] + A[18] * v[5];
    now[4] += A[13] * v[3] + A[14] * v[4] + A[19] * v[5];
    now[5] += A[18] * v[3] + A[19] * v[4] + A[20] * v[5];
    add_cross(d, momentum, 1, now + 3);
}

/* by what is known before any iteration, */
SADMM_INLINE void momentum_add_known(struct momentum_sums *s, const double d[3], const double A[PACKED6],
                                     const double b[6])
{
    const double m = A[0], square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        s->free[k] += b[k];
        s->free[k + 3] += b[k + 3];
        s->moment[k] += m * d[k];
    }
    add_cross(d, b, 1, s->free + 3);
    s->mass += m;
    s->inertia[0] += A[9] + m * (square - d[0] * d[0]);
    s->inertia[1] += A[14] + m * (square - d[1] * d[1]);
    s->inertia[2] += A[20] + m * (square - d[2] * d[2]);
    s->inertia[3] += A[13] - m * d[0] * d[1];
    s->inertia[4] += A[18] - m * d[0] * d[2];
    s->inertia[5] += A[19] - m * d[1] * d[2];
}

/* and both. */
SADMM_INLINE void momentum_add_body(struct momentum_sums *s, const double d[3], const double A[PACKED6],
                                    const double v[6], const double b[6])
{
    momentum_add_now(s->now, d, A, v);
    momentum_add_known(s, d, A, b);
}

/* What a static contact adds, its point at r from the origin. */
SADMM_INLINE void momentum_add_contact(double gram[PACKED6 + 1], const double normal[3], double friction,
                                       const double r[3])
{
    gram[MOMENTUM_CONTACTS] += 1;
    if (friction > 0) {
        struct arm_sums arms = {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
        add_arm(&arms, r, 1);
        add_arm_sums(gram, &arms);
    } else {
        double row[6];
        normal_row(normal, r, row);
        packed_add_row(gram, row, 1);
    }
}

/* What a row of a constraint with the static world adds: on (linear, angular) of its body, which is at d. */
SADMM_INLINE void momentum_add_row(double gram[PACKED6 + 1], const double jacobian[6], const double d[3])
{
    double row[6];
    SADMM_UNROLL
    for (int k = 0; k < 6; ++k) row[k] = jacobian[k];
    add_cross(d, jacobian, 1, row + 3);
    packed_add_row(gram, row, 1);
    gram[MOMENTUM_CONTACTS] += 2; /* it is no single point with friction, nor nothing */
}

/* The motions, and the momentum along each. */
struct momentum_motions {
    int count; /* 0: the island is anchored */
    double motion[6][6];
    double now[6], free[6]; /* m . G^T A v, m . G^T b; square roots of twice an energy */
};

SADMM_INLINE int packed_at(int r, int k) { return r > k ? r * (r + 1) / 2 + k : k * (k + 1) / 2 + r; }

/* y = G^T A G x */
SADMM_INLINE void momentum_mul(const struct momentum_sums *s, const double x[6], double y[6])
{
    const double *w = x + 3, *J = s->inertia;
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) y[k] = s->mass * x[k];
    y[3] = J[0] * w[0] + J[3] * w[1] + J[4] * w[2];
    y[4] = J[3] * w[0] + J[1] * w[1] + J[5] * w[2];
    y[5] = J[4] * w[0] + J[5] * w[1] + J[2] * w[2];
    add_cross(w, s->moment, 1, y);
    add_cross(s->moment, x, 1, y + 3);
}

/* A motion along which the static points move by less than this share of what they do otherwise, squared, is one they
 * do not feel: 1e-6, by the size of the island's rotations. The sums round at 1e-16. */
#define MOMENTUM_UNFELT 1e-12

/* Into the first rows of `basis`: a basis of the null space of the island's gram; returns how many. Symmetric
 * elimination by the largest pivot, in place; what has none left is the null space. Rows stay in their order. */
SADMM_INLINE int momentum_null_space(struct momentum_sums *s, double basis[6][6])
{
    double *K = s->gram, trace = 0, scale = sqrt(2 * s->mass / (s->inertia[0] + s->inertia[1] + s->inertia[2]));
    int left = 0, eliminated = 0;                              /* bits */
    if (K[MOMENTUM_CONTACTS] == 1 && K[0] + K[2] + K[5] > 2) { /* turns about the only point, which has friction */
        const double point[3] = {-K[12], K[8], K[10]};
        SADMM_ROLLED
        for (int r = 0; r < 3; ++r) {
            SADMM_ROLLED
            for (int k = 0; k < 6; ++k) basis[r][k] = k == r + 3 ? scale : 0;
            add_cross(basis[r] + 3, point, -1, basis[r]);
        }
        return 3;
    }
    SADMM_ROLLED
    for (int r = 0; r < 6; ++r) {
        SADMM_ROLLED
        for (int k = 0; k < 6; ++k) basis[r][k] = r != k ? 0 : r < 3 ? 1 : scale;
        SADMM_ROLLED
        for (int k = 0; k <= r; ++k) K[r * (r + 1) / 2 + k] *= (r < 3 ? 1 : scale) * (k < 3 ? 1 : scale);
        trace += K[r * (r + 1) / 2 + r];
    }
    SADMM_ROLLED
    for (int round = 0; round < 6; ++round) {
        int pivot = -1;
        double largest = MOMENTUM_UNFELT * trace;
        SADMM_ROLLED
        for (int k = 0; k < 6; ++k)
            if (!(eliminated >> k & 1) && K[k * (k + 1) / 2 + k] > largest) {
                largest = K[k * (k + 1) / 2 + k];
                pivot = k;
            }
        if (pivot < 0) break;
        eliminated |= 1 << pivot;
        SADMM_ROLLED
        for (int r = 0; r < 6; ++r) {
            if (eliminated >> r & 1) continue;
            const double share = K[packed_at(r, pivot)] / largest;
            SADMM_ROLLED
            for (int k = 0; k <= r; ++k)
                if (!(eliminated >> k & 1)) K[r * (r + 1) / 2 + k] -= share * K[packed_at(k, pivot)];
            SADMM_ROLLED
            for (int k = 0; k < 6; ++k) basis[r][k] -= share * basis[pivot][k];
        }
    }
    SADMM_ROLLED
    for (int r = 0; r < 6; ++r) {
        if (eliminated >> r & 1) continue;
        SADMM_ROLLED
        for (int k = 0; k < 6; ++k) basis[left][k] = basis[r][k];
        ++left;
    }
    return left;
}

/* A pivot of the inertia that is less than this share of what it is made of is rounding. */
#define MOMENTUM_PIVOT 1e-14

/* L^-1 of J = L L^T, J about the centre of mass: xx, yx yy, zx zy zz. False where a pivot is lost to rounding. */
SADMM_INLINE int momentum_inverse_root(const struct momentum_sums *s, const double centre[3], double inverse[6])
{
    const double *J = s->inertia, *p = s->moment, xx = J[0] - (p[1] * centre[1] + p[2] * centre[2]),
                 yy = J[1] - (p[0] * centre[0] + p[2] * centre[2]), zz = J[2] - (p[0] * centre[0] + p[1] * centre[1]),
                 xy = J[3] + p[0] * centre[1], xz = J[4] + p[0] * centre[2], yz = J[5] + p[1] * centre[2];
    if (!(xx > MOMENTUM_PIVOT * J[0])) return 0;
    const double x = 1 / sqrt(xx), yx = xy * x, zx = xz * x, y2 = yy - yx * yx;
    if (!(y2 > MOMENTUM_PIVOT * J[1])) return 0;
    const double y = 1 / sqrt(y2), zy = (yz - zx * yx) * y, z2 = zz - zx * zx - zy * zy;
    if (!(z2 > MOMENTUM_PIVOT * J[2])) return 0;
    const double z = 1 / sqrt(z2);
    inverse[0] = x, inverse[2] = y, inverse[5] = z;
    inverse[1] = -yx * x * y;
    inverse[3] = -(zx * x + zy * inverse[1]) * z;
    inverse[4] = -zy * y * z;
    return 1;
}

/* Of an island in the air, as most floating ones are: the centre of mass moves, and the island turns
 * about it, either without the other. False where the inertia is lost to rounding. */
SADMM_INLINE int momentum_find_free(const struct momentum_sums *s, struct momentum_motions *out)
{
    const double share = 1 / s->mass, root = sqrt(share),
                 centre[3] = {share * s->moment[0], share * s->moment[1], share * s->moment[2]};
    double turn[6];
    if (!momentum_inverse_root(s, centre, turn)) return 0;
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        double *move = out->motion[k], *spin = out->motion[k + 3];
        SADMM_UNROLL
        for (int j = 0; j < 3; ++j) {
            move[j] = j == k ? root : 0;
            move[j + 3] = 0;
            spin[j] = 0;
            spin[j + 3] = j <= k ? turn[k * (k + 1) / 2 + j] : 0;
        }
        add_cross(centre, spin + 3, 1, spin);
        out->now[k] = root * s->now[k];
        out->free[k] = root * s->free[k];
        out->now[k + 3] = dense6_dot(spin, s->now);
        out->free[k + 3] = dense6_dot(spin, s->free);
    }
    out->count = 6;
    return 1;
}

/* `s` loses its gram. Every static contact shows in the directions that its point does not move in; rows are
 * counted. */
SADMM_INLINE void momentum_find_motions(struct momentum_sums *s, struct momentum_motions *out)
{
    const double linear = s->gram[0] + s->gram[2] + s->gram[5];
    if (linear == 0 && s->gram[MOMENTUM_CONTACTS] == 0 && momentum_find_free(s, out)) return;
    const int left = momentum_null_space(s, out->motion);
    double y[6];
    out->count = 0;
    SADMM_ROLLED
    for (int k = 0; k < left; ++k) {
        double *x = out->motion[out->count], square, before;
        SADMM_ROLLED
        for (int j = 0; j < 6; ++j) x[j] = out->motion[k][j];
        momentum_mul(s, x, y);
        square = before = dense6_dot(x, y);
        /* Gram and Schmidt, again where much has cancelled: orthogonal to rounding then */
        SADMM_ROLLED
        for (int times = 0; times < 2 && out->count > 0 && (times == 0 || square < 0.01 * before); ++times) {
            SADMM_ROLLED
            for (int i = 0; i < out->count; ++i) {
                const double along = dense6_dot(out->motion[i], y);
                SADMM_ROLLED
                for (int j = 0; j < 6; ++j) x[j] -= along * out->motion[i][j];
            }
            momentum_mul(s, x, y);
            square = dense6_dot(x, y);
        }
        if (!(square > 0)) continue; /* rounding */
        square = 1 / sqrt(square);
        SADMM_ROLLED
        for (int j = 0; j < 6; ++j) x[j] *= square;
        out->now[out->count] = dense6_dot(x, s->now);
        out->free[out->count] = dense6_dot(x, s->free);
        ++out->count;
    }
}

/* The momentum of `now` (G^T A v) along motions that were found without it: the same bits as with it. */
SADMM_INLINE void momentum_measure(struct momentum_motions *motions, const double now[6])
{
    SADMM_ROLLED
    for (int k = 0; k < motions->count; ++k) motions->now[k] = dense6_dot(motions->motion[k], now);
}

/* Energies of the rigid part, J: of v, of A^-1 b, of both together; of the residual. */
struct momentum_energies {
    double now, free, along, residual;
};

SADMM_INLINE struct momentum_energies momentum_energies_of(const struct momentum_motions *motions)
{
    struct momentum_energies e = {0, 0, 0, 0};
    SADMM_ROLLED
    for (int k = 0; k < motions->count; ++k) {
        const double now = motions->now[k], free = motions->free[k], residual = free - now;
        e.now += now * now / 2;
        e.free += free * free / 2;
        e.along += now * free / 2;
        e.residual += residual * residual / 2;
    }
    return e;
}

/* The rigid motion q that restores the momentum of factor v: v <- factor v + G q. */
SADMM_INLINE void momentum_restoring(const struct momentum_motions *motions, double factor, double q[6])
{
    double sum[6] = {0, 0, 0, 0, 0, 0};
    SADMM_ROLLED
    for (int k = 0; k < motions->count; ++k) {
        const double share = motions->free[k] - factor * motions->now[k];
        SADMM_UNROLL
        for (int j = 0; j < 6; ++j) sum[j] += share * motions->motion[k][j];
    }
    SADMM_UNROLL
    for (int j = 0; j < 6; ++j) q[j] = sum[j];
}

/* v <- factor v + G q of a body at d. */
SADMM_INLINE void momentum_move(const double q[6], double factor, const double d[3], double v[6])
{
    SADMM_UNROLL
    for (int k = 0; k < 6; ++k) v[k] = factor * v[k] + q[k];
    add_cross(q + 3, d, 1, v);
}

#endif
