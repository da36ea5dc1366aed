/* Sums of J^T J over a body's constraints, in double: packed lower triangles, rows first. */
#ifndef SADMM_CPU_ROWS_H
#define SADMM_CPU_ROWS_H

#include <string.h>

#include "cpu.h"

/* C += row^T row, packed lower triangle. */
static inline void add_row(double C[PACKED6], const double row[6])
{
    int at = 0;
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j <= i; ++j) C[at++] += row[i] * row[j];
}

/* Sums over a body's three-row points: J^T J = [ I, -[r]x; [r]x, |r|^2 I - r r^T ] does not depend on the frame. */
struct arm_sums {
    double count, r[3], rr[6]; /* rr: xx yy zz xy xz yz */
};

static inline void add_arm(struct arm_sums *s, const double r[3])
{
    s->count += 1;
    for (int k = 0; k < 3; ++k) {
        s->r[k] += r[k];
        s->rr[k] += r[k] * r[k];
    }
    s->rr[3] += r[0] * r[1];
    s->rr[4] += r[0] * r[2];
    s->rr[5] += r[1] * r[2];
}

static inline void add_arm_sums(double C[PACKED6], const struct arm_sums *s)
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

/* Row of a contact's normal on either body, up to its sign. */
static inline void normal_row(const double n[3], const double r[3], double row[6])
{
    row[0] = n[0], row[1] = n[1], row[2] = n[2];
    row[3] = r[1] * n[2] - r[2] * n[1], row[4] = r[2] * n[0] - r[0] * n[2], row[5] = r[0] * n[1] - r[1] * n[0];
}

static inline void block_row(const struct row_block *block, int side, int r, double row[6])
{
    const real *J = (side ? block->jacobian_b : block->jacobian_a) + 6 * r;
    for (int j = 0; j < 6; ++j) row[j] = (double)J[j];
}

/* The pair of a record that is one. */
static inline const struct sadmm_contact_pair *cpu_pair(const struct sadmm_context *c, size_t record)
{
    return &c->system->contacts->pairs[c->pair_blocks[record / (size_t)LANES].pair[record % (size_t)LANES]];
}

/* b and v of a body. */
static inline void cpu_load_b(const struct sadmm_context *c, size_t i, double b[6])
{
    if (!c->rigid_bodies) {
        for (int k = 0; k < 6; ++k) b[k] = (double)c->b[i * ROW + (size_t)k];
        return;
    }
    const struct body_block *block = &c->body_blocks[i / (size_t)LANES];
    size_t l = i % (size_t)LANES;
    b[0] = (double)block->b_linear.x[l], b[1] = (double)block->b_linear.y[l], b[2] = (double)block->b_linear.z[l];
    b[3] = (double)block->b_angular.x[l], b[4] = (double)block->b_angular.y[l], b[5] = (double)block->b_angular.z[l];
}

static inline void cpu_load_v(const struct sadmm_context *c, size_t i, double v[6])
{
    for (int k = 0; k < 6; ++k) v[k] = (double)c->state[i * ROW + (size_t)k];
}

/* x . M x */
static inline double packed_form(const double M[PACKED6], const double x[6])
{
    double sum = 0;
    for (int r = 0, at = 0; r < 6; ++r)
        for (int k = 0; k <= r; ++k, ++at) sum += (r == k ? 1 : 2) * M[at] * x[r] * x[k];
    return sum;
}

/* r . A^-1 r, r = b + J^T lambda - A v; `wrenches` hold J^T lambda. */
static inline double cpu_defect_energy(const struct sadmm_context *c, size_t i)
{
    const double *A = &c->A[i * PACKED6];
    double r[6], v[6];
    cpu_load_b(c, i, r);
    cpu_load_v(c, i, v);
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at)
        for (int k = 0; k < 6; ++k) r[k] += (double)c->wrenches[(size_t)c->incident[at] * ROW + (size_t)k];
    for (int j = 0, at = 0; j < 6; ++j)
        for (int k = 0; k <= j; ++k, ++at) {
            r[j] -= A[at] * v[k];
            if (k < j) r[k] -= A[at] * v[j];
        }
    return packed_form(&c->A_inverse[i * PACKED6], r);
}

/* The island of a constraint between two bodies, one of which may be the static world. */
static inline struct cpu_island *cpu_island_of(const struct sadmm_context *c, int32_t body_a, int32_t body_b)
{
    return &c->islands[c->label[body_a >= 0 && body_a < c->bodies ? body_a : body_b]];
}

static inline double cpu_body_mass(const struct sadmm_context *c, int32_t i)
{
    const double *A = &c->A[(size_t)i * PACKED6];
    return (A[0] + A[2] + A[5]) / 3;
}

#endif
