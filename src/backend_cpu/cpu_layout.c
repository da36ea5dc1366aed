/* begin: memory for the step, pairs into lane blocks, and the body -> record list. */
#include <string.h>

#include "core/base/memory.h"
#include "cpu_rows.h"

/* Pairs are sorted by point count inside windows of this many blocks: a block is as deep as its deepest pair, so equal
 * counts waste no slots, while a window keeps neighbours in memory together. */
enum { WINDOW_BLOCKS = 32 };

static int32_t points_of(const struct sadmm_context *c, int32_t pair) { return c->system->contacts->pairs[pair].count; }

/* Stable counting sort of each window by point count, most first. */
static void order_pairs(struct sadmm_context *c)
{
    size_t count = (size_t)c->plan.pairs, window = (size_t)WINDOW_BLOCKS * LANES;
    for (size_t begin = 0; begin < count; begin += window) {
        size_t end = begin + window < count ? begin + window : count, at[SADMM_MAX_POINTS + 2] = {0};
        for (size_t p = begin; p < end; ++p) ++at[SADMM_MAX_POINTS - points_of(c, (int32_t)p) + 1];
        for (int k = 0; k <= SADMM_MAX_POINTS; ++k) at[k + 1] += at[k];
        for (size_t p = begin; p < end; ++p)
            c->pair_order[begin + at[SADMM_MAX_POINTS - points_of(c, (int32_t)p)]++] = (int32_t)p;
    }
}

static void count_slots(struct sadmm_context *c)
{
    size_t slots = 0;
    for (size_t k = 0; k < c->pair_block_count; ++k) {
        struct pair_block *block = &c->pair_blocks[k];
        block->first = slots;
        block->slots = 0;
        for (int l = 0; l < LANES; ++l) {
            size_t at = k * (size_t)LANES + (size_t)l;
            block->pair[l] = at < (size_t)c->plan.pairs ? c->pair_order[at] : -1;
            if (block->pair[l] >= 0 && points_of(c, block->pair[l]) > block->slots)
                block->slots = points_of(c, block->pair[l]);
        }
        slots += (size_t)block->slots;
    }
    c->slot_count = slots;
}

/* The bodies of a record, -1: static, or there is none. */
static inline void pair_bodies(const struct sadmm_context *c, size_t record, int32_t bodies[2])
{
    const int32_t index = c->pair_order[record];
    bodies[0] = c->system->contacts->pairs[index].body_a;
    bodies[1] = c->system->contacts->pairs[index].body_b;
}

static inline void row_bodies(const struct sadmm_context *c, size_t record, int32_t bodies[2])
{
    int lane;
    const int32_t constraint = cpu_row_block(c, record, &lane)->constraint[lane];
    bodies[0] = constraint < 0 ? -1 : c->system->rows->constraints[constraint].body_a;
    bodies[1] = constraint < 0 ? -1 : c->system->rows->constraints[constraint].body_b;
}

static inline void count_record(const struct sadmm_context *c, const int32_t bodies[2])
{
    for (int side = 0; side < 2; ++side)
        if (bodies[side] >= 0) ++c->offsets[bodies[side] + 2];
}

static inline void list_record(const struct sadmm_context *c, size_t record, const int32_t bodies[2])
{
    for (int side = 0; side < 2; ++side)
        if (bodies[side] >= 0)
            c->incident[c->offsets[bodies[side] + 1]++] = (int32_t)(record + (side ? c->record_count : 0));
}

/* Counting sort by body; records ascend within a body, so a body's sum has one order whatever the threads. */
static void list_incident(struct sadmm_context *c)
{
    const size_t pairs = (size_t)c->plan.pairs, rows = cpu_pair_records(c);
    int32_t *offsets = c->offsets, bodies[2];
    memset(offsets, 0, ((size_t)c->bodies + 2) * sizeof *offsets);
    for (size_t r = 0; r < pairs; ++r) pair_bodies(c, r, bodies), count_record(c, bodies);
    for (size_t r = rows; r < c->record_count; ++r) row_bodies(c, r, bodies), count_record(c, bodies);
    for (int32_t i = 0; i < c->bodies; ++i) offsets[i + 2] += offsets[i + 1];
    for (size_t r = 0; r < pairs; ++r) pair_bodies(c, r, bodies), list_record(c, r, bodies);
    for (size_t r = rows; r < c->record_count; ++r) row_bodies(c, r, bodies), list_record(c, r, bodies);
}

sadmm_status CPU(begin)(struct sadmm_context *c, const struct sadmm_system *system, const struct sadmm_plan *plan,
                        const struct sadmm_settings *settings, struct sadmm_error *error)
{
    size_t n = (size_t)plan->bodies;
    c->system = system;
    c->plan = *plan;
    c->settings = *settings;
    c->bodies = plan->bodies;
    c->fast = settings->method == SADMM_METHOD_FAST;
    c->measured = false;
    c->ratio = 1;
    c->pair_block_count = ((size_t)plan->pairs + LANES - 1) / LANES;
    if (!CPU(lay_out_rows)(c)) return sadmm_fail_memory(error, "the cpu backend's rows");
    /* Whole vectors of rows on either side, so that they are stored aligned. */
    c->record_count = (c->pair_block_count + c->row_block_count) * (size_t)LANES;
    if (c->record_count > INT32_MAX / 2)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu constraints: at most %d", c->record_count, INT32_MAX / 2);

    c->body_block_count = (n + LANES - 1) / LANES;
    if (!CPU(find_forms)(c)) return sadmm_fail_memory(error, "the cpu backend's bodies");
    size_t rows = c->body_block_count * (size_t)LANES + 1, general = c->general_count;
    c->kinematic_row = rows;
    if (system->kinematic_count > 0) rows += c->pair_block_count * (size_t)LANES;
    bool ok =
        SADMM_GROW(c->state, 0, rows * ROW) && SADMM_GROW(c->A, 0, n * PACKED6) && SADMM_GROW(c->C, 0, n * PACKED6) &&
        SADMM_GROW(c->beta, 0, n) && SADMM_GROW(c->trapezoids, 0, plan->rigid ? n + 1 : 0) &&
        SADMM_GROW(c->body_blocks, 0, general < n ? c->body_block_count : 0) && SADMM_GROW(c->b, 0, general * ROW) &&
        SADMM_GROW(c->A_columns, 0, general * 6 * ROW) && SADMM_GROW(c->H_columns, 0, general * 6 * ROW) &&
        SADMM_GROW(c->momentum_residuals, 0, c->fast ? general * ROW : 0) &&
        SADMM_GROW(c->pair_order, 0, (size_t)plan->pairs) && SADMM_GROW(c->pair_blocks, 0, c->pair_block_count) &&
        SADMM_GROW(c->wrenches, 0, 2 * c->record_count * ROW) &&
        (!plan->residuals || c->fast || SADMM_GROW(c->change, 0, 2 * c->record_count * ROW)) &&
        SADMM_GROW(c->offsets, 0, n + 2) && SADMM_GROW(c->incident, 0, 2 * c->record_count) &&
        (!(c->fast || plan->momentum) || (SADMM_GROW(c->islands, 0, n) && SADMM_GROW(c->body_sums, 0, BODY_SUMS * n) &&
                                          SADMM_GROW(c->A_inverse, 0, n * PACKED6))) &&
        (!c->fast ||
         (SADMM_GROW(c->pair_response, 0, c->record_count) && SADMM_GROW(c->pair_weight, 0, c->record_count) &&
          SADMM_GROW(c->pair_violation, 0, c->record_count) &&
          SADMM_GROW(c->pair_arms, 0, plan->contact_rows == 3 ? 2 * cpu_pair_records(c) : 0))) &&
        SADMM_GROW(c->thread_max, 0, (size_t)plan->threads * THREAD_MAX_STRIDE);
    if (!ok) return sadmm_fail_memory(error, "the cpu backend's step");
    order_pairs(c);
    count_slots(c);
    size_t slot_size = plan->contact_rows == 1 ? sizeof(struct normal_slot) : sizeof(struct point_slot);
    size_t slot_bytes = c->slot_count * slot_size;
    if (!sadmm_grow(&c->slots, 0, slot_bytes, 1)) return sadmm_fail_memory(error, "the cpu backend's contacts");
    list_incident(c);
    if (!CPU(find_islands)(c)) return sadmm_fail_memory(error, "the cpu backend's islands");
    return SADMM_OK;
}
