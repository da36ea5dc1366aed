/* What kernels that run a few times a step read of the layout, in double. */
#ifndef SADMM_CPU_ROWS_H
#define SADMM_CPU_ROWS_H

#include <string.h>

#include "core/math/contact.h"
#include "cpu.h"

/* Records of pairs; those of constraints given by rows follow. */
static inline size_t cpu_pair_records(const struct sadmm_context *c) { return c->pair_block_count * (size_t)LANES; }

/* The record at a place of a body's list, and on which side of it the body is. */
static inline size_t cpu_record(const struct sadmm_context *c, int32_t at, int *side)
{
    const size_t row = (size_t)c->incident[at];
    *side = row >= c->record_count;
    return *side ? row - c->record_count : row;
}

/* 1/beta of a body. */
static inline real cpu_inv_beta(const struct sadmm_context *c, int32_t body)
{
    return c->state[(size_t)body * ROW + STATE_INV_BETA];
}

/* Point k of a pair's lane: the impulse on b, its arm about a (b where a is static), e. */
struct cpu_point {
    double impulse[3], arm[3], error;
};

static inline struct cpu_point cpu_load_point(const struct sadmm_context *c, const struct pair_block *block, size_t l,
                                              int k)
{
    const size_t at = block->first + (size_t)k;
    struct cpu_point out;
    const vec *arm;
    if (c->plan.contact_rows == 3) {
        const struct point_slot *slot = (const struct point_slot *)c->slots + at;
        arm = &slot->arm;
        out.error = (double)slot->error[l];
        out.impulse[0] = (double)slot->lambda.x[l], out.impulse[1] = (double)slot->lambda.y[l];
        out.impulse[2] = (double)slot->lambda.z[l];
    } else {
        const struct normal_slot *slot = (const struct normal_slot *)c->slots + at;
        const double push = (double)slot->lambda[l];
        arm = &slot->arm;
        out.error = (double)slot->error[l];
        out.impulse[0] = push * (double)block->normal.x[l], out.impulse[1] = push * (double)block->normal.y[l];
        out.impulse[2] = push * (double)block->normal.z[l];
    }
    out.arm[0] = (double)arm->x[l], out.arm[1] = (double)arm->y[l], out.arm[2] = (double)arm->z[l];
    return out;
}

/* The block of a record of rows, and its lane. */
static inline const struct row_block *cpu_row_block(const struct sadmm_context *c, size_t record, int *lane)
{
    const size_t at = record - cpu_pair_records(c);
    *lane = (int)(at % (size_t)LANES);
    return &c->row_blocks[at / (size_t)LANES];
}

/* Rows of a lane's constraint, which there is. */
static inline int cpu_row_count(const struct sadmm_context *c, const struct row_block *block, int l)
{
    return c->system->rows->constraints[block->constraint[l]].count;
}

/* Jacobian row r of a lane on a side, as this precision has it. */
static inline void cpu_load_row(const struct sadmm_context *c, const struct row_block *block, int l, int side, int r,
                                double row[6])
{
    const struct row_slot *slot = &c->row_slots[block->first + (size_t)r];
    for (int j = 0; j < 6; ++j) row[j] = (double)(side ? slot->jacobian_b : slot->jacobian_a)[j][l];
}

/* mu as the method takes it. */
static inline real cpu_friction(const struct sadmm_context *c, double mu)
{
    return (real)(c->fast ? contact_friction_inside(mu, (double)SADMM_EPSILON) : mu);
}

/* The pair of a record that is one. */
static inline const struct sadmm_contact_pair *cpu_pair(const struct sadmm_context *c, size_t record)
{
    return &c->system->contacts->pairs[c->pair_blocks[record / (size_t)LANES].pair[record % (size_t)LANES]];
}

/* b and v of a body. */
static inline void cpu_load_b(const struct sadmm_context *c, size_t i, double b[6])
{
    const int32_t general = cpu_general(c, i);
    if (general >= 0) {
        for (int k = 0; k < 6; ++k) b[k] = (double)c->b[(size_t)general * ROW + (size_t)k];
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

/* Has a body's A the structure of a rigid one's? */
static inline bool cpu_is_rigid(const struct sadmm_context *c, size_t i)
{
    return c->plan.rigid || cpu_general(c, i) < 0;
}

/* x . M x, M a body's A or A^-1 */
static inline double cpu_form(const struct sadmm_context *c, size_t i, const double M[PACKED6], const double x[6])
{
    return cpu_is_rigid(c, i) ? packed_form_rigid(M, x) : packed_form(M, x);
}

/* r -= A v */
static inline void cpu_take_momentum(const double A[PACKED6], const double v[6], double r[6])
{
    for (int j = 0, at = 0; j < 6; ++j)
        for (int k = 0; k <= j; ++k, ++at) {
            r[j] -= A[at] * v[k];
            if (k < j) r[k] -= A[at] * v[j];
        }
}

/* b - A v */
static inline vec6d cpu_free_momentum(const struct sadmm_context *c, size_t i)
{
    const double *A = &c->A[i * PACKED6];
    const real *v = &c->state[i * ROW];
    double r[6], velocity[6];
    vec6d out;
    if (cpu_general(c, i) < 0) {
        const struct body_block *block = &c->body_blocks[i / (size_t)LANES];
        out.linear = vec3d_of_lane(&block->b_linear, i % (size_t)LANES);
        out.angular = vec3d_of_lane(&block->b_angular, i % (size_t)LANES);
        out.linear -= A[0] * (vec3d){(double)v[0], (double)v[1], (double)v[2], 0};
        out.angular -= (vec3d){A[9], A[13], A[18], 0} * (double)v[3];
        out.angular -= (vec3d){A[13], A[14], A[19], 0} * (double)v[4];
        out.angular -= (vec3d){A[18], A[19], A[20], 0} * (double)v[5];
        return out;
    }
    cpu_load_b(c, i, r);
    cpu_load_v(c, i, velocity);
    cpu_take_momentum(A, velocity, r);
    out.linear = vec3d_load(r);
    out.angular = vec3d_load(r + 3);
    return out;
}

/* Are both bodies of a record's constraint dynamic? */
static inline bool cpu_is_shared(const struct sadmm_context *c, size_t record)
{
    int l = (int)(record % (size_t)LANES);
    if (record < cpu_pair_records(c)) {
        const struct pair_block *block = &c->pair_blocks[record / (size_t)LANES];
        return block->body_a[l] < c->bodies && block->body_b[l] < c->bodies;
    }
    const struct row_block *block = cpu_row_block(c, record, &l);
    return block->body_a[l] < c->bodies && block->body_b[l] < c->bodies;
}

/* A wrench row in double. */
static inline row8d cpu_wrench(const struct sadmm_context *c, int32_t row)
{
    return __builtin_convertvector(*(const row8 *)&c->wrenches[(size_t)row * ROW], row8d);
}

/* r . A^-1 r, r = b + J^T lambda - A v; `wrenches` hold J^T lambda. */
static inline double cpu_residual_energy(const struct sadmm_context *c, size_t i)
{
    double r[8] = {0};
    vec6d_store(cpu_free_momentum(c, i), r);
    row8d sum = {r[0], r[1], r[2], r[3], r[4], r[5], 0, 0};
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) sum += cpu_wrench(c, c->incident[at]);
    for (int k = 0; k < 6; ++k) r[k] = sum[k];
    return cpu_form(c, i, &c->A_inverse[i * PACKED6], r);
}

/* The island of a constraint between two bodies, one of which may be the static world. */
static inline struct cpu_island *cpu_island_of(const struct sadmm_context *c, int32_t body_a, int32_t body_b)
{
    return &c->islands[c->label[body_a >= 0 && body_a < c->bodies ? body_a : body_b]];
}

/* How far multipliers of a block's constraints go where islands that start warm go `relaxation` times as far. */
static inline lanes cpu_relaxation_if_warm(const struct sadmm_context *c, const int32_t *body_a, const int32_t *body_b)
{
    lanes out = fill(1);
    for (int l = 0; l < LANES; ++l)
        if ((body_a[l] < c->bodies || body_b[l] < c->bodies) && cpu_island_of(c, body_a[l], body_b[l])->warm)
            out[l] = (real)c->settings.relaxation;
    return out;
}

/* Are there new weights for its constraints: the first ones, or updates? */
static inline bool cpu_is_weighed(const struct sadmm_context *c, const struct cpu_island *island)
{
    return c->weight_updates <= 0 || !island->warm;
}

static inline double cpu_body_mass(const struct sadmm_context *c, int32_t i)
{
    const double *A = &c->A[(size_t)i * PACKED6];
    return (A[0] + A[2] + A[5]) / 3;
}

#endif
