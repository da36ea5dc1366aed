/* What the step gives back: v and lambda (double), the moved bodies (Q), the contact wrenches (R, eq. 12). */
#include <stdatomic.h>
#include <string.h>

#include "core/math/array3.h"
#include "core/model/pair_touch.h"
#include "core/model/system_terms.h"
#include "cpu_rows.h"

static void read_pair(struct sadmm_context *c, const struct pair_block *block, int l)
{
    struct sadmm_contact_set *contacts = c->system->contacts;
    const struct sadmm_contact_pair *pair = &contacts->pairs[block->pair[l]];
    for (int k = 0; k < pair->count; ++k) {
        double *impulse = contacts->points[pair->first + k].impulse;
        if (c->plan.contact_rows == 3) {
            const vec *lambda = &((const struct point_slot *)c->slots + block->first + k)->lambda;
            impulse[0] = (double)lambda->x[l], impulse[1] = (double)lambda->y[l], impulse[2] = (double)lambda->z[l];
        } else {
            double normal = (double)((const struct normal_slot *)c->slots + block->first + k)->lambda[l];
            for (int j = 0; j < 3; ++j) impulse[j] = normal * pair->normal[j];
        }
    }
}

static void read_rows(struct sadmm_context *c, const struct row_block *block, int l)
{
    const struct sadmm_row_constraint *constraint = &c->system->rows->constraints[block->constraint[l]];
    for (int r = 0; r < constraint->count; ++r)
        c->system->rows->lambda[constraint->first + r] = (double)c->row_slots[block->first + (size_t)r].lambda[l];
}

static void read_share(void *context, int thread, int threads)
{
    struct sadmm_context *c = (struct sadmm_context *)context;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i)
        for (int k = 0; k < 6; ++k) c->system->velocity[6 * i + (size_t)k] = (double)c->state[i * ROW + (size_t)k];
    sadmm_share(c->pair_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k)
        for (int l = 0; l < LANES; ++l)
            if (c->pair_blocks[k].pair[l] >= 0) read_pair(c, &c->pair_blocks[k], l);
    sadmm_share(c->row_block_count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end; ++k)
        for (int l = 0; l < LANES; ++l)
            if (c->row_blocks[k].constraint[l] >= 0) read_rows(c, &c->row_blocks[k], l);
}

sadmm_status CPU(read_solution)(struct sadmm_context *c, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, read_share, c);
    return SADMM_OK;
}

/* ---- Q ----------------------------------------------------------------------------------------------------------- */

/* Bits of a body or an island. Threads may add some at once, in any order: the same ones are there in the end. */
static void add_bits(_Atomic int32_t *to, int bits, bool alone)
{
    const int32_t before = atomic_load_explicit(to, memory_order_relaxed);
    if (!(bits & ~before)) return;
    if (alone) atomic_store_explicit(to, before | bits, memory_order_relaxed);
    else atomic_fetch_or_explicit(to, bits, memory_order_relaxed);
}

/* Bits of a body so far. */
static int bits_of_body(const struct sadmm_context *c, int32_t body)
{
    return body >= 0 ? atomic_load_explicit(&c->touch[body], memory_order_relaxed) : TOUCH_OF_STATIC;
}

/* What a pair's points touch, and what other pairs have found of that so far: bits that are known are not looked for
 * again. */
static struct trapezoid_touch touch_of(const struct sadmm_context *c, const struct sadmm_contact_pair *pair,
                                       int32_t label)
{
    const struct trapezoid_touch known = {atomic_load_explicit(&c->touch[label], memory_order_relaxed),
                                          {bits_of_body(c, pair->body_a), bits_of_body(c, pair->body_b)}};
    return sadmm_pair_touch(c->system, &c->settings, pair, &c->trapezoids[cpu_body(c, pair->body_a)],
                            &c->trapezoids[cpu_body(c, pair->body_b)], known);
}

/* Bodies have bits of their own, islands theirs at their labels: no bit means both. */
static void touch_pair(struct sadmm_context *c, const struct sadmm_contact_pair *pair, bool alone)
{
    const int32_t label = c->label[pair->body_a >= 0 ? pair->body_a : pair->body_b];
    const struct trapezoid_touch touch = touch_of(c, pair, label);
    add_bits(&c->touch[label], touch.island, alone);
    if (pair->body_a >= 0) add_bits(&c->touch[pair->body_a], touch.body[0], alone);
    if (pair->body_b >= 0) add_bits(&c->touch[pair->body_b], touch.body[1], alone);
}

static void choose_trapezoid(const struct sadmm_context *c, size_t i, struct sadmm_trapezoid *trapezoid)
{
    sadmm_choose_trapezoid(&c->system->rigid[i], &c->settings,
                           atomic_load_explicit(&c->touch[c->label[i]], memory_order_relaxed),
                           atomic_load_explicit(&c->touch[i], memory_order_relaxed), trapezoid);
}

struct integration {
    struct sadmm_context *c;
    struct sadmm_rigid *next;
};

static void integrate_share(void *argument, int thread, int threads)
{
    const struct integration *in = (const struct integration *)argument;
    struct sadmm_context *c = in->c;
    const struct sadmm_rigid *bodies = c->system->rigid;
    const double *velocity = c->system->velocity;
    size_t first, past, begin, end;
    cpu_share_bodies(c, thread, threads, &first, &past);
    sadmm_find_trapezoids(past - first, bodies + first, velocity + 6 * first, &c->settings, c->trapezoids + first);
    if (c->plan.momentum) {
        for (size_t i = first; i < past; ++i) atomic_store_explicit(&c->touch[i], 0, memory_order_relaxed);
        sadmm_barrier_wait(&c->barrier, threads);
        sadmm_share(c->system->contacts->pair_count, thread, threads, &begin, &end);
        for (size_t p = begin; p < end; ++p) touch_pair(c, &c->system->contacts->pairs[p], threads == 1);
        sadmm_barrier_wait(&c->barrier, threads);
        for (size_t i = first; i < past; ++i) choose_trapezoid(c, i, &c->trapezoids[i]);
    }
    sadmm_advance(past - first, bodies + first, velocity + 6 * first, c->trapezoids + first, c->settings.dt,
                  in->next + first);
}

sadmm_status CPU(integrate)(struct sadmm_context *c, struct sadmm_rigid *next, struct sadmm_error *error)
{
    (void)error;
    memset(&c->trapezoids[c->bodies], 0, sizeof *c->trapezoids);
    cpu_parallel(c, integrate_share, &(struct integration){c, next});
    return SADMM_OK;
}

/* ---- R ----------------------------------------------------------------------------------------------------------- */

/* Eq. (12) with lambda = -u: J^T lambda / dt, summed over a body's contacts in their fixed order. */
static void body_wrench(const struct sadmm_context *c, size_t i, const double per_dt[2], double wrench[6])
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    vec3d force = {0}, torque_zxy = {0};
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
        int side;
        const size_t record = cpu_record(c, at, &side);
        if (record >= cpu_pair_records(c)) continue; /* contact wrenches only */
        const struct sadmm_contact_pair *pair = cpu_pair(c, record);
        const double share = per_dt[side];
        for (int k = 0; k < pair->count; ++k) {
            const struct sadmm_contact_point *point = &contacts->points[pair->first + k];
            const vec3d f = vec3d_load(point->impulse);
            force += share * f;
            torque_zxy += share * vec3d_cross_zxy(vec3d_load(side ? point->arm_b : point->arm_a), f);
        }
    }
    vec3d_store(force, wrench);
    vec3d_store(vec3d_yzx(torque_zxy), wrench + 3);
}

struct recovery {
    const struct sadmm_context *c;
    double *wrench;
};

static void recover_share(void *argument, int thread, int threads)
{
    const struct recovery *r = (const struct recovery *)argument;
    size_t begin, end;
    cpu_share_bodies(r->c, thread, threads, &begin, &end);
    const double per_dt[2] = {-1 / r->c->settings.dt, 1 / r->c->settings.dt}; /* on a, on b */
    for (size_t i = begin; i < end; ++i) body_wrench(r->c, i, per_dt, r->wrench + 6 * i);
}

sadmm_status CPU(recover_wrenches)(struct sadmm_context *c, double *wrench, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, recover_share, &(struct recovery){c, wrench});
    return SADMM_OK;
}
