/* What the step gives back: v and lambda (double), the moved bodies (Q), the contact wrenches (R, eq. 12). */
#include <string.h>

#include "core/math/array3.h"
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

struct integration {
    const struct sadmm_context *c;
    struct sadmm_rigid *next;
};

static void integrate_share(void *argument, int thread, int threads)
{
    const struct integration *in = (const struct integration *)argument;
    const struct sadmm_context *c = in->c;
    size_t begin, end;
    cpu_share_bodies(c, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i)
        sadmm_rigid_advance(&c->system->rigid[i], &c->system->velocity[6 * i], c->settings.dt, &in->next[i]);
}

sadmm_status CPU(integrate)(struct sadmm_context *c, struct sadmm_rigid *next, struct sadmm_error *error)
{
    (void)error;
    cpu_parallel(c, integrate_share, &(struct integration){c, next});
    return SADMM_OK;
}

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
