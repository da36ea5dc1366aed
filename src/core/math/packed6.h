/* Symmetric 6 x 6 matrices as packed lower triangles, rows first. Double in every precision: penalties, weights and
 * energies are made of them a few times a step. */
#ifndef SADMM_MATH_PACKED6_H
#define SADMM_MATH_PACKED6_H

#include "dense6.h"

enum { PACKED6 = 21 };

/* <M, S> */
SADMM_INLINE double packed_dot(const double M[PACKED6], const double S[PACKED6])
{
    double sum = 0;
    int at = 0;
    SADMM_UNROLL
    for (int r = 0; r < 6; ++r)
        SADMM_UNROLL
        for (int k = 0; k <= r; ++k, ++at) sum += (r == k ? 1 : 2) * M[at] * S[at];
    return sum;
}

/* x . M x */
SADMM_INLINE double packed_form(const double M[PACKED6], const double x[6])
{
    double sum = 0;
    int at = 0;
    SADMM_UNROLL
    for (int r = 0; r < 6; ++r)
        SADMM_UNROLL
        for (int k = 0; k <= r; ++k, ++at) sum += (r == k ? 1 : 2) * M[at] * x[r] * x[k];
    return sum;
}

/* The same of a rigid body's M, in the same order without what is 0 there: to the same bits. */
SADMM_INLINE double packed_form_rigid(const double M[PACKED6], const double x[6])
{
    double sum = 0;
    sum += M[0] * x[0] * x[0];
    sum += M[2] * x[1] * x[1];
    sum += M[5] * x[2] * x[2];
    sum += M[9] * x[3] * x[3];
    sum += 2 * M[13] * x[4] * x[3];
    sum += M[14] * x[4] * x[4];
    sum += 2 * M[18] * x[5] * x[3];
    sum += 2 * M[19] * x[5] * x[4];
    sum += M[20] * x[5] * x[5];
    return sum;
}

/* C += weight row^T row */
SADMM_INLINE void packed_add_row(double C[PACKED6], const double row[6], double weight)
{
    int at = 0;
    SADMM_UNROLL
    for (int i = 0; i < 6; ++i)
        SADMM_UNROLL
        for (int j = 0; j <= i; ++j) C[at++] += weight * row[i] * row[j];
}

/* Weighted sums over a body's three-row points: J^T J = [ I, -[r]x; [r]x, |r|^2 I - r r^T ] does not depend on the
 * frame. */
struct arm_sums {
    double count, r[3], rr[6]; /* rr: xx yy zz xy xz yz */
};

SADMM_INLINE void add_arm(struct arm_sums *s, const double r[3], double weight)
{
    s->count += weight;
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        s->r[k] += weight * r[k];
        s->rr[k] += weight * (r[k] * r[k]);
    }
    s->rr[3] += weight * (r[0] * r[1]);
    s->rr[4] += weight * (r[0] * r[2]);
    s->rr[5] += weight * (r[1] * r[2]);
}

SADMM_INLINE void add_arm_sums(double C[PACKED6], const struct arm_sums *s)
{
    C[0] += s->count, C[2] += s->count, C[5] += s->count;
    /* Rows 3-5, columns 0-2: [r]x */
    C[7] -= s->r[2], C[8] += s->r[1];
    C[10] += s->r[2], C[12] -= s->r[0];
    C[15] -= s->r[1], C[16] += s->r[0];
    C[9] += s->rr[1] + s->rr[2];
    C[13] -= s->rr[3], C[14] += s->rr[0] + s->rr[2];
    C[18] -= s->rr[4], C[19] -= s->rr[5], C[20] += s->rr[0] + s->rr[1];
}

/* C so that what (A + C)^-1 is rounded by cannot make an iteration diverge; epsilon: of the precision that it is kept
 * in. Along axes that contacts do not turn about C is 0 and A + C the inertia, which may be less than the rounding of
 * C: a lever of 1e4 m on a small inertia, a light body under heavy ones. Its inverse is so large there that its
 * rounding outweighs what it is along the others. A C that is more only slows. Units: a diagonal number's own
 * rounding, three entries a row, and those of q q^T / p where the linear part is eliminated. */
#define C_ROUNDING 8.0
SADMM_INLINE void packed_round_up(double C[PACKED6], double epsilon)
{
    C[9] += C_ROUNDING * epsilon * C[9];
    C[14] += C_ROUNDING * epsilon * C[14];
    C[20] += C_ROUNDING * epsilon * C[20];
}

/* Is the least principal inertia (at least 4 det / trace^2) less than this many times what is added above? Else the
 * inverse's rounding is at most a sixteenth of what it is along any axis, and C stays as it is, to the bit. */
#define INERTIA_ROUNDINGS 2.0
SADMM_INLINE int packed_inertia_drowns(const double A[PACKED6], double beta, const double C[PACKED6], double epsilon)
{
    const double largest = max_of(C[9], max_of(C[14], C[20])), trace = A[9] + A[14] + A[20];
    const double det = A[9] * (A[14] * A[20] - A[19] * A[19]) - A[13] * (A[13] * A[20] - A[19] * A[18]) +
                       A[18] * (A[13] * A[19] - A[14] * A[18]);
    return INERTIA_ROUNDINGS * C_ROUNDING * epsilon * beta * largest * trace * trace > 4 * det;
}

/* <A^-1, sum J^T J> of a rigid body, whose A^-1 has no mixed part. */
SADMM_INLINE double packed_dot_arms(const double inverse[PACKED6], const struct arm_sums *s)
{
    const double *rr = s->rr;
    return (inverse[0] + inverse[2] + inverse[5]) * s->count + inverse[9] * (rr[1] + rr[2]) +
           inverse[14] * (rr[0] + rr[2]) + inverse[20] * (rr[0] + rr[1]) -
           2 * (inverse[13] * rr[3] + inverse[18] * rr[4] + inverse[19] * rr[5]);
}

/* Row of a contact's normal on either body, up to its sign. */
SADMM_INLINE void normal_row(const double n[3], const double r[3], double row[6])
{
    row[0] = n[0], row[1] = n[1], row[2] = n[2];
    row[3] = r[1] * n[2] - r[2] * n[1], row[4] = r[2] * n[0] - r[0] * n[2], row[5] = r[0] * n[1] - r[1] * n[0];
}

/* Of a symmetric 3 x 3 matrix, by its cofactors: xx yy zz xy xz yz. */
SADMM_INLINE void invert_symmetric3(double xx, double yy, double zz, double xy, double xz, double yz, double out[6])
{
    const double c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
    const double inv = 1 / (xx * c00 + xy * c01 + xz * c02);
    out[0] = inv * c00, out[1] = inv * (xx * zz - xz * xz), out[2] = inv * (xx * yy - xy * xy);
    out[3] = inv * c01, out[4] = inv * c02, out[5] = inv * (xy * xz - xx * yz);
}

/* A^-1 of a rigid body, by blocks. */
SADMM_INLINE void packed_invert_rigid(const double A[PACKED6], double out[PACKED6])
{
    double inertia[6];
    invert_symmetric3(A[9], A[14], A[20], A[13], A[18], A[19], inertia);
    SADMM_UNROLL
    for (int k = 0; k < PACKED6; ++k) out[k] = 0;
    out[0] = out[2] = out[5] = 1 / A[0];
    out[9] = inertia[0], out[14] = inertia[1], out[20] = inertia[2];
    out[13] = inertia[3], out[18] = inertia[4], out[19] = inertia[5];
}

/* A^-1 of any body, from its lower half. 0 where A is not positive definite: problems refuse such an A, and weights
 * without a response would be no use. */
SADMM_INLINE void packed_invert(const double A[36], double out[PACKED6])
{
    double L[36];
    for (int k = 0; k < PACKED6; ++k) out[k] = 0;
    if (!dense6_cholesky(A, L)) return;
    for (int k = 0; k < 6; ++k) {
        double unit[6] = {0}, column[6];
        unit[k] = 1;
        dense6_solve(L, unit, column);
        for (int r = k; r < 6; ++r) out[r * (r + 1) / 2 + k] = column[r];
    }
}

#endif
