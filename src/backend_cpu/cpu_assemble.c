/* Kernels A and B: bodies and contacts from the system's doubles into this precision's layout. */
#include <string.h>

#include "core/math/dense6.h"
#include "core/math/contact.h"
#include "core/model/system_terms.h"
#include "cpu_rows.h"

static void set_lane(vec *v, int l, const double value[3])
{
    v->x[l] = (real)value[0];
    v->y[l] = (real)value[1];
    v->z[l] = (real)value[2];
}

static void set_rigid_lane(struct body_block *block, int l, const double A[36], const double b[6])
{
    set_lane(&block->b_linear, l, b);
    set_lane(&block->b_angular, l, b + 3);
    block->mass[l] = (real)A[0];
    block->inertia.xx[l] = (real)A[21], block->inertia.yy[l] = (real)A[28], block->inertia.zz[l] = (real)A[35];
    block->inertia.xy[l] = (real)A[22], block->inertia.xz[l] = (real)A[23], block->inertia.yz[l] = (real)A[29];
}

/* Of a general body: it stays where it is. */
static void clear_lane(struct body_block *block, int l)
{
    lanes *numbers = (lanes *)block;
    for (size_t k = 0; k < sizeof *block / sizeof *numbers; ++k) numbers[k][l] = 0;
}

static void set_general(struct sadmm_context *c, size_t i, const double A[36], const double b[6])
{
    for (int k = 0; k < ROW; ++k) {
        c->b[i * ROW + (size_t)k] = k < 6 ? (real)b[k] : 0;
        for (int j = 0; j < 6; ++j)
            c->A_columns[(i * 6 + (size_t)j) * ROW + (size_t)k] = k < 6 ? (real)A[6 * k + j] : 0;
    }
}

static void assemble_body(struct sadmm_context *c, int32_t i)
{
    double A[36], b[6], v[6];
    sadmm_body_terms(c->system, &c->settings, i, A, b);
    double factor[36];
    if (c->plan.warm_start || !dense6_cholesky(A, factor))
        memcpy(v, &c->system->velocity[6 * (size_t)i], sizeof v);
    else
        dense6_solve(factor, b, v);
    real *state = &c->state[(size_t)i * ROW];
    for (int k = 0; k < ROW; ++k) state[k] = k < 6 ? (real)v[k] : 0;
    double *packed = &c->A[(size_t)i * PACKED6];
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k <= r; ++k) *packed++ = A[6 * r + k];
    const int32_t general = cpu_general(c, (size_t)i);
    if (general >= 0) set_general(c, (size_t)general, A, b);
    if (c->general_count == (size_t)c->bodies) return;
    if (general >= 0) clear_lane(&c->body_blocks[i / LANES], i % LANES);
    else set_rigid_lane(&c->body_blocks[i / LANES], i % LANES, A, b);
}

/* Lanes and the row behind the last body: no mass, no motion. */
static void clear_padding(struct sadmm_context *c)
{
    size_t rows = c->body_block_count * (size_t)LANES + 1, n = (size_t)c->bodies;
    memset(&c->state[n * ROW], 0, (rows - n) * ROW * sizeof(real));
    if (c->general_count < n)
        memset(&c->body_blocks[c->body_block_count - 1], 0, sizeof *c->body_blocks);
}

static void assemble_body_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) assemble_body(c, (int32_t)i);
}

sadmm_status CPU(assemble_bodies)(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    clear_padding(c);
    cpu_parallel(c, assemble_body_share, c);
    return SADMM_OK;
}

/* Larger than any velocity: an empty slot's multiplier stays 0. */
static const real EMPTY_ERROR = (real)1e9;

/* points: the pair's; NULL: the slot is empty. */
static void assemble_point(const struct sadmm_context *c, const struct sadmm_contact_pair *pair, int k,
                           const struct sadmm_contact_point *points, struct pair_block *block, int l)
{
    static const double zero[3];
    bool used = points != NULL;
    const struct sadmm_contact_point *point = used ? &points[k] : NULL;
    const double *arm = !used ? zero : pair->body_a >= 0 ? point->arm_a : point->arm_b;
    const double *impulse = used && c->plan.warm_start ? point->impulse : zero;
    real error = used ? (real)sadmm_point_error(c->system, &c->settings, pair, points, k) : EMPTY_ERROR;
    size_t at = block->first + (size_t)k;
    if (c->plan.contact_rows == 1) {
        struct normal_slot *slot = (struct normal_slot *)c->slots + at;
        set_lane(&slot->arm, l, arm);
        slot->error[l] = error;
        slot->lambda[l] = used ? (real)(pair->normal[0] * impulse[0] + pair->normal[1] * impulse[1] +
                                        pair->normal[2] * impulse[2]) : 0;
    } else {
        struct point_slot *slot = (struct point_slot *)c->slots + at;
        set_lane(&slot->arm, l, arm);
        slot->error[l] = error;
        set_lane(&slot->lambda, l, impulse);
    }
}

static void assemble_lane(struct sadmm_context *c, struct pair_block *block, int l)
{
    static const double zero[3], up[3] = {0, 0, 1};
    const struct sadmm_contact_set *contacts = c->system->contacts;
    const struct sadmm_contact_pair *pair = block->pair[l] >= 0 ? &contacts->pairs[block->pair[l]] : NULL;
    double d[3] = {0, 0, 0};
    if (pair && pair->body_a >= 0 && pair->body_b >= 0 && pair->count > 0) {
        const struct sadmm_contact_point *point = &contacts->points[pair->first];
        for (int j = 0; j < 3; ++j) d[j] = point->arm_b[j] - point->arm_a[j];
    }
    set_lane(&block->normal, l, pair ? pair->normal : up);
    set_lane(&block->d, l, pair ? d : zero);
    block->friction[l] = pair ? cpu_friction(c, pair->friction) : 0;
    block->inv_s[l] = 0;
    block->body_a[l] = pair ? cpu_body(c, pair->body_a) : c->bodies;
    block->body_b[l] = pair ? cpu_body(c, pair->body_b) : c->bodies;
    for (int k = 0; k < block->slots; ++k)
        assemble_point(c, pair, k, pair && k < pair->count ? &contacts->points[pair->first] : NULL, block, l);
}

static void assemble_pair_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    sadmm_share(c->pair_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k)
        for (int l = 0; l < LANES; ++l) assemble_lane(c, &c->pair_blocks[k], l);
}

sadmm_status CPU(assemble_contacts)(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, assemble_pair_share, c);
    return SADMM_OK;
}
