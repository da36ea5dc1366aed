/* Kernels E-H and P: C_i (14), beta_i (13), (15), and the factor of A_i + beta_i C_i.
 *
 * In double whatever the precision, from the system's raw data: it runs a few times a step, and H only preconditions
 * (the fixed point of Step 1 does not depend on it). Each body gathers over its own constraints. */
#include <string.h>

#include "core/math/dense6.h"
#include "core/math/penalty.h"
#include "cpu_rows.h"

static void add_pair(const struct sadmm_context *c, size_t record, int side, struct arm_sums *sums, double C[PACKED6])
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    const struct sadmm_contact_pair *pair = cpu_pair(c, record);
    for (int k = 0; k < pair->count; ++k) {
        const struct sadmm_contact_point *point = &contacts->points[pair->first + k];
        const double *r = side ? point->arm_b : point->arm_a;
        if (c->plan.contact_rows == 3) {
            add_arm(sums, r, 1);
        } else {
            double row[6];
            normal_row(pair->normal, r, row);
            packed_add_row(C, row, 1);
        }
    }
}

static void add_rows(const struct sadmm_context *c, size_t record, int side, double C[PACKED6])
{
    int lane;
    const struct row_block *block = cpu_row_block(c, record, &lane);
    for (int r = 0; r < cpu_row_count(c, block, lane); ++r) {
        double row[6];
        cpu_load_row(c, block, lane, side, r, row);
        packed_add_row(C, row, 1);
    }
}

static double packed_trace(const double M[PACKED6]) { return M[0] + M[2] + M[5] + M[9] + M[14] + M[20]; }

static void assemble_C(struct sadmm_context *c, int32_t i)
{
    double *C = &c->C[(size_t)i * PACKED6];
    struct arm_sums sums = {0};
    memset(C, 0, PACKED6 * sizeof *C);
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
        int side;
        const size_t record = cpu_record(c, at, &side);
        if (record < cpu_pair_records(c)) add_pair(c, record, side, &sums, C);
        else add_rows(c, record, side, C);
    }
    add_arm_sums(C, &sums);

    double trace_A = packed_trace(&c->A[(size_t)i * PACKED6]), trace_C = packed_trace(C);
    const struct sadmm_settings *s = &c->settings;
    c->beta[i] = penalty_of_body(trace_A, trace_C, s->penalty_mass_factor, s->penalty_offset, s->dt);
}

static void assemble_C_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) assemble_C(c, (int32_t)i);
}

sadmm_status CPU(init_penalty)(struct sadmm_context *c, struct sadmm_error *error)
{
    if (c->fast) return CPU(init_weights)(c, error);
    cpu_parallel(c, assemble_C_share, c);
    CPU(start_wrenches)(c);
    return SADMM_OK;
}

/* C of a body, as its factor has it; `rounded` is room for one that is not what it was. */
static const double *load_C(const struct sadmm_context *c, size_t i, double rounded[PACKED6])
{
    const double *C = &c->C[i * PACKED6];
    if (!packed_inertia_drowns(&c->A[i * PACKED6], c->beta[i], C, (double)SADMM_EPSILON)) return C;
    memcpy(rounded, C, PACKED6 * sizeof *rounded);
    packed_round_up(rounded, (double)SADMM_EPSILON);
    return rounded;
}

/* The factor of a rigid body (struct body_block). */
static void factorize_rigid(struct sadmm_context *c, size_t i)
{
    double rounded[PACKED6];
    const double *A = &c->A[i * PACKED6], *C = load_C(c, i, rounded);
    double beta = c->beta[i], alpha = A[0] + beta * C[0], ratio = beta / alpha;
    double S[3] = {C[16], C[8], C[10]}; /* [S]x is the lower left block */
    double S2 = S[0] * S[0] + S[1] * S[1] + S[2] * S[2], q = beta * ratio;
    /* K = I + beta Q + beta^2/alpha (S S^T - |S|^2 I) */
    double xx = A[9] + beta * C[9] + q * (S[0] * S[0] - S2), yy = A[14] + beta * C[14] + q * (S[1] * S[1] - S2);
    double zz = A[20] + beta * C[20] + q * (S[2] * S[2] - S2), xy = A[13] + beta * C[13] + q * S[0] * S[1];
    double xz = A[18] + beta * C[18] + q * S[0] * S[2], yz = A[19] + beta * C[19] + q * S[1] * S[2];
    double inverse[6];
    invert_symmetric3(xx, yy, zz, xy, xz, yz, inverse);

    struct body_block *block = &c->body_blocks[i / (size_t)LANES];
    int l = (int)(i % (size_t)LANES);
    block->inv_alpha[l] = (real)(1 / alpha);
    block->sigma.x[l] = (real)(ratio * S[0]), block->sigma.y[l] = (real)(ratio * S[1]);
    block->sigma.z[l] = (real)(ratio * S[2]);
    lane_sym3 *K = &block->K_inverse;
    K->xx[l] = (real)inverse[0], K->yy[l] = (real)inverse[1], K->zz[l] = (real)inverse[2];
    K->xy[l] = (real)inverse[3], K->xz[l] = (real)inverse[4], K->yz[l] = (real)inverse[5];
}

/* (A + beta C)^-1 in full, of general body `general`. */
static void factorize_general(struct sadmm_context *c, size_t i, size_t general)
{
    double M[36], L[36], rounded[PACKED6], column[6];
    const double *A = &c->A[i * PACKED6], *C = load_C(c, i, rounded);
    int at = 0;
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k <= r; ++k, ++at) M[6 * r + k] = M[6 * k + r] = A[at] + c->beta[i] * C[at];
    /* A is positive definite; only a beta C some 1e15 times larger can lose it to rounding: precondition by the
     * diagonal. */
    if (!dense6_cholesky(M, L)) {
        memset(L, 0, sizeof L);
        for (int k = 0; k < 6; ++k) L[7 * k] = sqrt(M[7 * k]);
    }
    for (int k = 0; k < 6; ++k) {
        double unit[6] = {0};
        unit[k] = 1;
        dense6_solve(L, unit, column);
        real *out = &c->H_columns[(6 * general + (size_t)k) * ROW];
        for (int r = 0; r < ROW; ++r) out[r] = r < 6 ? (real)column[r] : 0;
    }
}

static void factorize_body(struct sadmm_context *c, size_t i)
{
    c->state[i * ROW + STATE_INV_BETA] = (real)(1 / c->beta[i]);
    const int32_t general = cpu_general(c, i);
    if (general >= 0) factorize_general(c, i, (size_t)general);
    else factorize_rigid(c, i);
}

static void weigh_pair_block(struct sadmm_context *c, struct pair_block *block)
{
    for (int l = 0; l < LANES; ++l)
        block->inv_s[l] = penalty_inverse_s(cpu_inv_beta(c, block->body_a[l]), cpu_inv_beta(c, block->body_b[l]));
}

static void factorize_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) factorize_body(c, i);
    if (c->fast) return; /* the weights are the constraints' own */
    sadmm_barrier_wait(&c->barrier, threads);
    sadmm_share(c->pair_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) weigh_pair_block(c, &c->pair_blocks[k]);
    sadmm_share(c->row_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) CPU(set_row_steps)(c, k);
}

sadmm_status CPU(factorize)(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, factorize_share, c);
    return SADMM_OK;
}

sadmm_status CPU(update_penalty)(struct sadmm_context *c, double ratio, struct sadmm_error *error)
{
    (void)error;
    for (int32_t i = 0; i < c->bodies; ++i) c->beta[i] *= ratio;
    c->ratio = ratio;
    return SADMM_OK;
}

sadmm_status CPU(read_penalty)(struct sadmm_context *c, double *beta, struct sadmm_error *error)
{
    (void)error;
    if (c->bodies) memcpy(beta, c->beta, (size_t)c->bodies * sizeof *beta);
    return SADMM_OK;
}
