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

static void set_rigid_lane(struct body_block *block, int l, const double A[PACKED6], const double b[6])
{
    set_lane(&block->b_linear, l, b);
    set_lane(&block->b_angular, l, b + 3);
    block->mass[l] = (real)A[0];
    block->inertia.xx[l] = (real)A[9], block->inertia.yy[l] = (real)A[14], block->inertia.zz[l] = (real)A[20];
    block->inertia.xy[l] = (real)A[13], block->inertia.xz[l] = (real)A[18], block->inertia.yz[l] = (real)A[19];
}

/* Of a general body: it stays where it is. */
static void clear_lane(struct body_block *block, int l)
{
    lanes *numbers = (lanes *)block;
    for (size_t k = 0; k < sizeof *block / sizeof *numbers; ++k) numbers[k][l] = 0;
}

static void set_general(struct sadmm_context *c, size_t i, const double M[36], const double b[6])
{
    for (int k = 0; k < ROW; ++k) {
        c->b[i * ROW + (size_t)k] = k < 6 ? (real)b[k] : 0;
        for (int j = 0; j < 6; ++j)
            c->A_columns[(i * 6 + (size_t)j) * ROW + (size_t)k] = k < 6 ? (real)M[6 * k + j] : 0;
    }
}

/* Without a warm start v = A^-1 b. */
static void set_velocity(struct sadmm_context *c, size_t i, const double M[36], const double b[6])
{
    const double *v = &c->system->velocity[6 * i];
    double factor[36], free[6];
    if (!c->plan.warm_start && dense6_cholesky(M, factor)) {
        dense6_solve(factor, b, free);
        v = free;
    }
    for (int k = 0; k < ROW; ++k) c->state[i * ROW + (size_t)k] = k < 6 ? (real)v[k] : 0;
}

static void assemble_body(struct sadmm_context *c, size_t i, const double A[PACKED6], const double b[6])
{
    const int32_t general = cpu_general(c, i);
    double M[36];
    if (general >= 0 || !c->plan.warm_start)
        for (int r = 0, at = 0; r < 6; ++r)
            for (int k = 0; k <= r; ++k, ++at) M[6 * r + k] = M[6 * k + r] = A[at];
    set_velocity(c, i, M, b);
    if (general >= 0) set_general(c, (size_t)general, M, b);
    if (c->general_count == (size_t)c->bodies) return;
    if (general >= 0) clear_lane(&c->body_blocks[i / (size_t)LANES], (int)(i % (size_t)LANES));
    else set_rigid_lane(&c->body_blocks[i / (size_t)LANES], (int)(i % (size_t)LANES), A, b);
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
    for (size_t first = begin; first < end; first += LANES) {
        const size_t count = end - first < (size_t)LANES ? end - first : (size_t)LANES;
        double b[6 * LANES], *A = &c->A[first * PACKED6];
        sadmm_body_terms(c->system, &c->settings, first, count, A, b, c->trapezoids);
        for (size_t l = 0; l < count; ++l) assemble_body(c, first + l, A + PACKED6 * l, b + 6 * l);
    }
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

/* Row of a pair's body in `state`; `at`: the pair's record. */
static int32_t row_of(struct sadmm_context *c, const struct sadmm_contact_pair *pair, int32_t body, size_t at)
{
    const size_t row = c->kinematic_row + at;
    double motion[6];
    if (!sadmm_body_is_kinematic(body)) return cpu_body(c, body);
    sadmm_kinematic_motion(c->system, pair, motion);
    for (int k = 0; k < ROW; ++k) c->state[row * ROW + (size_t)k] = k < 6 ? (real)motion[k] : 0;
    return (int32_t)row;
}

/* Point k of a lane; NULL: the slot is empty. Its e comes later. */
static void assemble_point(const struct sadmm_context *c, const struct sadmm_contact_pair *pair,
                           const struct sadmm_contact_point *point, size_t at, int l)
{
    static const double zero[3];
    const double *arm = !point ? zero : pair->body_a >= 0 ? point->arm_a : point->arm_b;
    const double *impulse = point && c->plan.warm_start ? point->impulse : zero;
    if (c->plan.contact_rows == 1) {
        struct normal_slot *slot = (struct normal_slot *)c->slots + at;
        set_lane(&slot->arm, l, arm);
        slot->lambda[l] = point ? (real)(pair->normal[0] * impulse[0] + pair->normal[1] * impulse[1] +
                                         pair->normal[2] * impulse[2]) : 0;
    } else {
        struct point_slot *slot = (struct point_slot *)c->slots + at;
        set_lane(&slot->arm, l, arm);
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
    const size_t at = (size_t)(block - c->pair_blocks) * (size_t)LANES + (size_t)l;
    block->body_a[l] = pair ? row_of(c, pair, pair->body_a, at) : c->bodies;
    block->body_b[l] = pair ? row_of(c, pair, pair->body_b, at) : c->bodies;
    for (int k = 0; k < block->slots; ++k)
        assemble_point(c, pair, pair && k < pair->count ? &contacts->points[pair->first + k] : NULL,
                       block->first + (size_t)k, l);
}

/* e of a pair's points where it depends on how fast its bodies approach. */
static void bounce(const struct sadmm_context *c, const struct sadmm_contact_pair *pair, int l,
                   double errors[SADMM_MAX_POINTS][LANES])
{
    for (int k = 0; k < pair->count; ++k)
        errors[k][l] = sadmm_point_error(c->system, &c->settings, pair, &c->system->contacts->points[pair->first], k);
}

/* e of a block's points, all lanes of a slot at once. */
static void assemble_errors(struct sadmm_context *c, const struct pair_block *block)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    const struct sadmm_settings settings = c->settings;
    double errors[SADMM_MAX_POINTS][LANES], held[SADMM_MAX_POINTS][LANES]; /* what is added to the former */
    int32_t count[LANES];
    for (int l = 0; l < LANES; ++l) {
        const struct sadmm_contact_pair *pair = block->pair[l] >= 0 ? &contacts->pairs[block->pair[l]] : NULL;
        count[l] = pair ? pair->count : 0;
        for (int k = 0; k < count[l]; ++k) {
            const struct sadmm_contact_point *point = &contacts->points[pair->first + k];
            errors[k][l] = c->system->errors_given ? point->error : point->separation;
            held[k][l] = point->error;
        }
        for (int k = count[l]; k < block->slots; ++k) errors[k][l] = held[k][l] = 0;
    }
    for (int k = 0; k < block->slots && !c->system->errors_given; ++k)
        for (int l = 0; l < LANES; ++l)
            errors[k][l] = contact_error(errors[k][l], settings.dt, settings.correction_factor, settings.slop,
                                         settings.correction_speed) +
                           held[k][l];
    for (int l = 0; l < LANES; ++l)
        if (count[l] > 0 && sadmm_pair_bounces(c->system, &contacts->pairs[block->pair[l]]))
            bounce(c, &contacts->pairs[block->pair[l]], l, errors);
    for (int k = 0; k < block->slots; ++k) {
        const size_t at = block->first + (size_t)k;
        lanes *error = c->plan.contact_rows == 1 ? &((struct normal_slot *)c->slots + at)->error
                                                 : &((struct point_slot *)c->slots + at)->error;
        for (int l = 0; l < LANES; ++l) (*error)[l] = k < count[l] ? (real)errors[k][l] : EMPTY_ERROR;
    }
}

static void assemble_pair_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    sadmm_share(c->pair_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k) {
        for (int l = 0; l < LANES; ++l) assemble_lane(c, &c->pair_blocks[k], l);
        assemble_errors(c, &c->pair_blocks[k]);
    }
}

sadmm_status CPU(assemble_contacts)(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, assemble_pair_share, c);
    return SADMM_OK;
}
