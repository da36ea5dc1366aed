/* What the step gives back: v and lambda (double), the moved bodies (Q), the contact wrenches (R, eq. 12). */
#include <string.h>

#include "core/math/array3.h"
#include "core/math/lead.h"
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

/* What a pair's points touch (math/lead.h), into `out`. */
static void touch_pair(const struct sadmm_context *c, const struct sadmm_contact_pair *pair, struct lead_touch *out)
{
    const int32_t body[2] = {pair->body_a, pair->body_b};
    double velocity[2][6] = {{0}}, lead[2][6] = {{0}};
    const struct lead_touch none = {body[0] >= 0 && body[1] >= 0 ? TOUCH_INNER
                                    : pair->friction > 0         ? TOUCH_FRICTION
                                                                 : TOUCH_SMOOTH, {0, 0}};
    *out = none;
    for (int s = 0; s < 2; ++s) {
        if (body[s] < 0) continue;
        memcpy(velocity[s], &c->system->velocity[6 * (size_t)body[s]], sizeof velocity[s]);
        sadmm_body_lead(&c->system->rigid[body[s]], velocity[s], lead[s]);
    }
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct sadmm_contact_point *point = &c->system->contacts->points[k];
        const double *n = pair->normal, *arm_a = point->arm_a, *arm_b = point->arm_b;
        const double size[2] = {lead_size(lead[0], arm_a), lead_size(lead[1], arm_b)};
        lead_add_push(out, dot3(n, point->impulse), size, c->settings.dt, c->settings.slop);
        if (lead_is_still(size, c->settings.dt, c->settings.slop)) continue;
        const double leads[2] = {-lead_along(n, lead[0], arm_a), lead_along(n, lead[1], arm_b)};
        const double speed = lead_along(n, velocity[1], arm_b) - lead_along(n, velocity[0], arm_a);
        lead_add_way(out, point->gap, speed, leads, size, c->settings.dt, c->settings.slop);
    }
}

/* Of each body the bits of its pairs. */
static void touch_bodies(struct sadmm_context *c, int thread, int threads)
{
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) {
        c->touch[i] = 0;
        for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
            int side;
            const size_t record = cpu_record(c, at, &side);
            if (record >= cpu_pair_records(c)) continue;
            const struct lead_touch *touch = &c->pair_touch[record];
            c->touch[i] |= touch->island | touch->body[side];
        }
    }
}

/* Islands have the bits of their bodies, at their labels, but for what is each body's own. */
static void touch_islands(struct sadmm_context *c)
{
    for (int32_t i = 0; i < c->bodies; ++i) c->touch[c->label[i]] |= c->touch[i] & ~(TOUCH_CARRIED | TOUCH_MOVED);
}

struct integration {
    struct sadmm_context *c;
    struct sadmm_rigid *next;
};

static void integrate_share(void *argument, int thread, int threads)
{
    const struct integration *in = (const struct integration *)argument;
    struct sadmm_context *c = in->c;
    size_t begin, end;
    if (c->plan.momentum) {
        sadmm_share(cpu_pair_records(c), thread, threads, &begin, &end);
        for (size_t k = begin; k < end; ++k)
            if (c->pair_blocks[k / (size_t)LANES].pair[k % (size_t)LANES] >= 0)
                touch_pair(c, cpu_pair(c, k), &c->pair_touch[k]);
        sadmm_barrier_wait(&c->barrier, threads);
        touch_bodies(c, thread, threads);
        sadmm_barrier_wait(&c->barrier, threads);
        if (thread == 0) touch_islands(c);
        sadmm_barrier_wait(&c->barrier, threads);
    }
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) {
        const struct sadmm_rigid *body = &c->system->rigid[i];
        const double *velocity = &c->system->velocity[6 * i];
        const int touch = c->plan.momentum ? c->touch[i] : 0, island = c->plan.momentum ? c->touch[c->label[i]] : 0;
        double lead[6] = {0};
        switch (lead_kind_of(island, touch)) {
        case LEAD_STAYS: break;
        case LEAD_SHARED: lead_shared(c->settings.gravity, c->settings.dt, lead); break;
        case LEAD_OWN: sadmm_body_lead(body, velocity, lead); break;
        }
        sadmm_rigid_advance(body, velocity, lead, c->settings.dt, &in->next[i]);
    }
}

sadmm_status CPU(integrate)(struct sadmm_context *c, struct sadmm_rigid *next, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, integrate_share, &(struct integration){c, next});
    return SADMM_OK;
}

/* ---- R ----------------------------------------------------------------------------------------------------------- */

/* Eq. (12) with lambda = -u: J^T lambda / dt, summed over a body's contacts in their fixed order. */
static void body_wrench(const struct sadmm_context *c, size_t i, double wrench[6])
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    memset(wrench, 0, 6 * sizeof *wrench);
    for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) {
        int side;
        const size_t record = cpu_record(c, at, &side);
        if (record >= cpu_pair_records(c)) continue; /* contact wrenches only */
        const struct sadmm_contact_pair *pair = cpu_pair(c, record);
        double per_dt = (side ? 1 : -1) / c->settings.dt;
        for (int k = 0; k < pair->count; ++k) {
            const struct sadmm_contact_point *point = &contacts->points[pair->first + k];
            const double *r = side ? point->arm_b : point->arm_a, *f = point->impulse;
            for (int j = 0; j < 3; ++j) wrench[j] += per_dt * f[j];
            add_cross(r, f, per_dt, wrench + 3);
        }
    }
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
    for (size_t i = begin; i < end; ++i) body_wrench(r->c, i, r->wrench + 6 * i);
}

sadmm_status CPU(recover_wrenches)(struct sadmm_context *c, double *wrench, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, recover_share, &(struct recovery){c, wrench});
    return SADMM_OK;
}
