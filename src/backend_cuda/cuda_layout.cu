/* begin: room for the step, islands and slots, the body -> record list, the tier and its parts (cuda_internal.h). */
#include <string.h>

#include "../core/memory.h"
#include "cuda_internal.h"

/* ---- islands --------------------------------------------------------------------------------------------------- */

/* First body, pair and row block of an island in slot order, and the list entries before it. */
struct island {
    int32_t body, pair, row, incident;
};

static int32_t find_root(int32_t *parent, int32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

static void join_bodies(int32_t *parent, int32_t a, int32_t b)
{
    if (a < 0 || b < 0) return;
    a = find_root(parent, a);
    b = find_root(parent, b);
    if (a < b) parent[b] = a; /* the root is the island's first body */
    else parent[a] = b;
}

static int32_t island_with(const struct cuda_scratch *s, int32_t a, int32_t b)
{
    return a >= 0 ? s->island_of[a] : b >= 0 ? s->island_of[b] : 0;
}

/* Where the layout's arrays are in its one buffer, in order. */
struct layout {
    int32_t *body_of, *slot_of, *pair_of, *row_of, *offsets, *incident;
    struct part *parts;
    size_t bytes;
};

static struct layout lay_out(void *base, size_t n, size_t pairs, size_t rows, size_t parts)
{
    struct layout l;
    l.body_of = (int32_t *)base;
    l.slot_of = l.body_of + n;
    l.pair_of = l.slot_of + n;
    l.row_of = l.pair_of + pairs;
    l.offsets = l.row_of + rows;
    l.incident = l.offsets + n + 1;
    l.parts = (struct part *)(l.incident + 2 * (pairs + rows));
    l.bytes = (3 * n + 1 + 3 * (pairs + rows)) * sizeof(int32_t) + (parts + 1) * sizeof(struct part);
    return l;
}

/* Number the islands by their first body; counts per island go to islands[island + 1], then become offsets. */
static int32_t count_islands(struct sadmm_context *c)
{
    struct cuda_scratch *s = &c->scratch;
    const struct sadmm_system *system = c->system;
    const struct sadmm_contact_set *contacts = system->contacts;
    int32_t n = c->plan.bodies, islands = 0;
    for (int32_t i = 0; i < n; ++i) s->parent[i] = i;
    for (size_t p = 0; p < contacts->pair_count; ++p)
        join_bodies(s->parent, contacts->pairs[p].body_a, contacts->pairs[p].body_b);
    for (int32_t k = 0; k < system->block_count; ++k)
        join_bodies(s->parent, system->blocks[k].body_a, system->blocks[k].body_b);
    memset(s->islands, 0, ((size_t)n + 2) * sizeof *s->islands);
    for (int32_t i = 0; i < n; ++i) {
        int32_t root = find_root(s->parent, i);
        s->island_of[i] = root == i ? islands++ : s->island_of[root];
        ++s->islands[s->island_of[i] + 1].body;
    }
    if (islands == 0) islands = 1;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        int32_t a = contacts->pairs[p].body_a, b = contacts->pairs[p].body_b;
        struct island *one = &s->islands[island_with(s, a, b) + 1];
        ++one->pair;
        one->incident += (a >= 0) + (b >= 0);
    }
    for (int32_t k = 0; k < system->block_count; ++k) {
        int32_t a = system->blocks[k].body_a, b = system->blocks[k].body_b;
        struct island *one = &s->islands[island_with(s, a, b) + 1];
        ++one->row;
        one->incident += (a >= 0) + (b >= 0);
    }
    for (int32_t i = 0; i < islands; ++i) {
        s->islands[i + 1].body += s->islands[i].body;
        s->islands[i + 1].pair += s->islands[i].pair;
        s->islands[i + 1].row += s->islands[i].row;
        s->islands[i + 1].incident += s->islands[i].incident;
    }
    return islands;
}

/* Slots by island, in raw order within each (stable counting sorts). */
static void number_slots(struct sadmm_context *c, const struct layout *l, int32_t islands)
{
    struct cuda_scratch *s = &c->scratch;
    const struct sadmm_system *system = c->system;
    const struct sadmm_contact_set *contacts = system->contacts;
    for (int32_t i = 0; i < islands; ++i) s->cursor[i] = s->islands[i].body;
    for (int32_t i = 0; i < c->plan.bodies; ++i) {
        int32_t slot = s->cursor[s->island_of[i]]++;
        l->body_of[slot] = i;
        l->slot_of[i] = slot;
    }
    for (int32_t i = 0; i < islands; ++i) s->cursor[i] = s->islands[i].pair;
    for (size_t p = 0; p < contacts->pair_count; ++p)
        l->pair_of[s->cursor[island_with(s, contacts->pairs[p].body_a, contacts->pairs[p].body_b)]++] = (int32_t)p;
    for (int32_t i = 0; i < islands; ++i) s->cursor[i] = s->islands[i].row;
    for (int32_t k = 0; k < system->block_count; ++k)
        l->row_of[s->cursor[island_with(s, system->blocks[k].body_a, system->blocks[k].body_b)]++] = k;
}

static void record_bodies(const struct sadmm_context *c, const struct layout *l, size_t record, int32_t bodies[2])
{
    size_t pairs = c->system->contacts->pair_count;
    if (record < pairs) {
        const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[l->pair_of[record]];
        bodies[0] = pair->body_a;
        bodies[1] = pair->body_b;
    } else {
        const struct sadmm_problem_block *block = &c->system->blocks[l->row_of[record - pairs]];
        bodies[0] = block->body_a;
        bodies[1] = block->body_b;
    }
}

/* Counting sort of record halves by body; records ascend within a body. */
static void list_incident(struct sadmm_context *c, const struct layout *l)
{
    size_t n = (size_t)c->plan.bodies, records = c->system->contacts->pair_count + (size_t)c->system->block_count;
    int32_t *cursor = c->scratch.cursor, bodies[2];
    memset(l->offsets, 0, (n + 1) * sizeof *l->offsets);
    for (size_t r = 0; r < records; ++r) {
        record_bodies(c, l, r, bodies);
        for (int side = 0; side < 2; ++side)
            if (bodies[side] >= 0) ++l->offsets[l->slot_of[bodies[side]] + 1];
    }
    for (size_t i = 0; i < n; ++i) l->offsets[i + 1] += l->offsets[i];
    memcpy(cursor, l->offsets, n * sizeof *cursor);
    for (size_t r = 0; r < records; ++r) {
        record_bodies(c, l, r, bodies);
        for (int side = 0; side < 2; ++side)
            if (bodies[side] >= 0) l->incident[cursor[l->slot_of[bodies[side]]]++] = (int32_t)(2 * r) + side;
    }
}

/* ---- tiers ------------------------------------------------------------------------------------------------------ */

static const char TOO_MANY[] = "an island does not fit a thread block";

static int64_t larger(int64_t a, int64_t b) { return a > b ? a : b; }

/* More never run at once: a multiprocessor has 2048 threads. */
static int64_t most_grid_blocks(const struct sadmm_context *c)
{
    return (int64_t)c->multiprocessors * (2048 / THREADS);
}
/* Islands are at most as many as bodies, and at least one. */
static size_t most_parts(const struct sadmm_context *c)
{
    return (size_t)larger((int64_t)c->plan.bodies + 1, most_grid_blocks(c));
}

/* Pack islands, in order, into as many parts as there are multiprocessors to run them, each within a block's means.
 * Returns why it cannot be done, or NULL. */
static const char *pack_islands(struct sadmm_context *c, int32_t islands)
{
    struct cuda_scratch *s = &c->scratch;
    const struct island *all = &s->islands[islands];
    /* A pair is a thread; a body is eight, of less work. */
    int64_t cost = (int64_t)all->pair + all->row + all->body,
            target = (cost + c->multiprocessors - 1) / c->multiprocessors;
    int32_t count = 0;
    int64_t shared_max = 0;
    for (int32_t i = 0; i < islands;) {
        const struct island *begin = &s->islands[i];
        int64_t shared = 0;
        int32_t next = i;
        while (next < islands) {
            const struct island *end = &s->islands[next + 1];
            int32_t bodies = end->body - begin->body, pairs = end->pair - begin->pair, rows = end->row - begin->row;
            int64_t grown =
                (int64_t)CUDA(resident_shared)(bodies, pairs, rows, end->incident - begin->incident, false);
            bool fits = pairs <= THREADS && grown <= c->shared_limit;
            bool full = (int64_t)pairs + rows + bodies > target;
            if (!fits || (full && next > i)) break;
            shared = grown;
            ++next;
        }
        if (next == i) return TOO_MANY;
        struct part part = {begin->body, begin->pair, begin->row};
        s->parts[count++] = part;
        shared_max = larger(shared_max, shared);
        i = next;
    }
    struct part end = {all->body, all->pair, all->row};
    s->parts[count] = end;
    c->part_count = count;
    c->part_shared = (size_t)shared_max;
    return nullptr;
}

/* Even shares of everything, in as few blocks as keep the threads busy; NULL, or why the grid does not fit. */
static const char *share_evenly(struct sadmm_context *c, const struct layout *l, const char **failed, cudaError_t *code)
{
    int64_t n = c->plan.bodies, pairs = c->plan.pairs, rows = c->system->block_count;
    if (!c->cooperative) return "the device has no cooperative launch";
    /* Two warps of pairs a block until every multiprocessor has one, then more warps. */
    int64_t blocks = (pairs + 2 * WARP - 1) / (2 * WARP);
    blocks = larger(blocks, (rows + 2 * WARP - 1) / (2 * WARP));
    blocks = larger(blocks, blocks_for(n * LANES));
    if (blocks > c->multiprocessors) blocks = c->multiprocessors;
    blocks = larger(larger(blocks, blocks_for(pairs)), 1);
    if (blocks > most_grid_blocks(c)) return "more pairs than threads the device can hold at once";

    int64_t shared = 0;
    c->part_count = (int32_t)blocks;
    for (int64_t i = 0; i <= blocks; ++i) {
        struct part part = {(int32_t)(n * i / blocks), (int32_t)(pairs * i / blocks), (int32_t)(rows * i / blocks)};
        c->scratch.parts[i] = part;
        if (i == 0) continue;
        int32_t first = c->scratch.parts[i - 1].body;
        int32_t incident = l->offsets[part.body] - l->offsets[first];
        shared = larger(shared, (int64_t)CUDA(resident_shared)(part.body - first, 0, 0, incident, true));
    }
    c->part_shared = (size_t)shared;
    if (shared > c->shared_limit) return "a block's share of the bodies does not fit its shared memory";
    int resident = 0;
    cuda_kernel kernel = CUDA(resident_kernel)(c->plan.contact_rows, c->point_slots, true, failed);
    *code = cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, (const void *)kernel, THREADS, c->part_shared);
    if (*code != cudaSuccess) return nullptr;
    if (blocks > (int64_t)resident * c->multiprocessors) return "more pairs than threads the device can hold at once";
    return nullptr;
}

static sadmm_status choose_tier(struct sadmm_context *c, const struct layout *l, int32_t islands,
                                struct sadmm_error *error)
{
    const char *why = nullptr, *name = nullptr;
    c->part_count = 0;
    c->part_shared = 0;
    c->tier = SADMM_CUDA_TIER_STREAM;
    if (c->wanted == SADMM_CUDA_TIER_AUTO || c->wanted == SADMM_CUDA_TIER_BLOCK) {
        why = pack_islands(c, islands);
        if (!why) c->tier = SADMM_CUDA_TIER_BLOCK;
    }
    if (c->tier == SADMM_CUDA_TIER_STREAM && (c->wanted == SADMM_CUDA_TIER_AUTO || c->wanted == SADMM_CUDA_TIER_GRID)) {
        cudaError_t code = cudaSuccess;
        why = share_evenly(c, l, &name, &code);
        if (code != cudaSuccess) return CUDA(fail)(c, code, "cudaOccupancyMaxActiveBlocksPerMultiprocessor", error);
        if (!why) c->tier = SADMM_CUDA_TIER_GRID;
    }
    if (c->wanted != SADMM_CUDA_TIER_AUTO && c->tier != c->wanted)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "the cuda tier asked for: %s", why);
    if (c->tier == SADMM_CUDA_TIER_STREAM) c->part_count = 0;
    else
        c->resident = CUDA(resident_kernel)(c->plan.contact_rows, c->point_slots, c->tier == SADMM_CUDA_TIER_GRID,
                                            &c->resident_name);
    return SADMM_OK;
}

/* ---- room ------------------------------------------------------------------------------------------------------- */

static sadmm_status device_room(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    size_t n = (size_t)v->bodies, pairs = (size_t)v->pairs, rows = (size_t)v->row_stride,
           real_size = sizeof(solver_real);
    size_t slots = (size_t)c->point_slots * (size_t)v->stride, records = (pairs + (size_t)v->rows) * RECORD * real_size;
    size_t points = (size_t)v->points;
    bool three = v->contact_rows != 1;
    size_t raw_body = c->plan.rigid ? sizeof(struct sadmm_rigid) : 42 * sizeof(double);
    size_t raw_bodies = n * (raw_body + 6 * sizeof(double)), raw_pairs = pairs * sizeof(struct sadmm_contact_pair);
    size_t raw_points = points * sizeof(struct sadmm_contact_point);
    size_t raw_blocks = (size_t)v->rows * (sizeof(struct sadmm_problem_block) + 6 * sizeof(double));
    size_t out = (13 * n + 3 * points + 6 * (size_t)v->rows + 2) * sizeof(double);
    const struct {
        enum cuda_buffer_name name;
        size_t bytes;
    } wanted[] = {
        {BUFFER_STATE, (n + 1) * ROW * real_size},
        {BUFFER_B, n * ROW * real_size},
        {BUFFER_A, n * MATRIX * real_size},
        {BUFFER_H, n * MATRIX * real_size},
        {BUFFER_C, n * PACKED * sizeof(double)},
        {BUFFER_BETA, n * sizeof(double)},
        {BUFFER_NORMAL, pairs * sizeof(real4)},
        {BUFFER_DIFFERENCE, pairs * sizeof(real4)},
        {BUFFER_PAIR_BODIES, pairs * sizeof(int2)},
        {BUFFER_PAIR_COUNT, pairs * sizeof(int32_t)},
        {BUFFER_ARM, slots * sizeof(real4)},
        {BUFFER_LAMBDA, slots * (three ? sizeof(real4) : real_size)},
        {BUFFER_ROW_INFO, rows * sizeof(row_about)},
        {BUFFER_ROW_DATA, rows * ROW_PLANES * real_size},
        {BUFFER_RECORDS, records},
        {BUFFER_CHANGE, c->plan.residuals ? records : 0},
        {BUFFER_SCALARS, 64},
        {BUFFER_RAW_BODIES, raw_bodies},
        {BUFFER_RAW_PAIRS, raw_pairs},
        {BUFFER_RAW_POINTS, raw_points},
        {BUFFER_RAW_BLOCKS, raw_blocks},
        {BUFFER_OUT, out},
        {PINNED_BODIES, raw_bodies},
        {PINNED_PAIRS, raw_pairs},
        {PINNED_POINTS, raw_points},
        {PINNED_BLOCKS, raw_blocks},
        {PINNED_OUT, out},
    };
    for (const auto &one : wanted) CUDA_TRY(CUDA(room)(c, one.name, one.bytes, error));

    void *const none = nullptr;
    cuda_buffer *b = c->buffers;
    v->state = (solver_real *)b[BUFFER_STATE].data;
    v->b = (solver_real *)b[BUFFER_B].data;
    v->A = (solver_real *)b[BUFFER_A].data;
    v->H = (solver_real *)b[BUFFER_H].data;
    v->C = (double *)b[BUFFER_C].data;
    v->beta = (double *)b[BUFFER_BETA].data;
    v->normal = (real4 *)b[BUFFER_NORMAL].data;
    v->difference = (real4 *)b[BUFFER_DIFFERENCE].data;
    v->pair_bodies = (int2 *)b[BUFFER_PAIR_BODIES].data;
    v->pair_count = (int32_t *)b[BUFFER_PAIR_COUNT].data;
    v->arm = (real4 *)b[BUFFER_ARM].data;
    v->lambda = (real4 *)(three ? b[BUFFER_LAMBDA].data : none);
    v->lambda_n = (solver_real *)(three ? none : b[BUFFER_LAMBDA].data);
    v->row_info = (row_about *)b[BUFFER_ROW_INFO].data;
    v->row_data = (solver_real *)b[BUFFER_ROW_DATA].data;
    v->records = (solver_real *)b[BUFFER_RECORDS].data;
    v->change = (solver_real *)(c->plan.residuals ? b[BUFFER_CHANGE].data : none);
    v->residual = (unsigned long long *)b[BUFFER_SCALARS].data;
    v->barrier = (unsigned *)(v->residual + 4); /* a sector of its own */
    v->raw_pairs = (struct sadmm_contact_pair *)b[BUFFER_RAW_PAIRS].data;
    v->raw_points = (struct sadmm_contact_point *)b[BUFFER_RAW_POINTS].data;
    v->out = (double *)b[BUFFER_OUT].data;

    /* Raw bodies: rigid, or A then b; then velocities. Raw blocks: blocks, then multipliers. */
    v->raw = *c->system;
    v->raw.contacts = nullptr;
    char *raw = (char *)b[BUFFER_RAW_BODIES].data;
    v->raw.rigid = (const struct sadmm_rigid *)(c->plan.rigid ? raw : none);
    v->raw.A = (const double *)(c->plan.rigid ? none : raw);
    v->raw.b = c->plan.rigid ? nullptr : v->raw.A + 36 * n;
    v->raw.velocity = (double *)(raw + n * raw_body);
    raw = (char *)b[BUFFER_RAW_BLOCKS].data;
    v->raw.blocks = (const struct sadmm_problem_block *)raw;
    v->raw.block_lambda = (double *)(raw + (size_t)v->rows * sizeof(struct sadmm_problem_block));
    return SADMM_OK;
}

static sadmm_status host_room(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_scratch *s = &c->scratch;
    size_t n = (size_t)c->plan.bodies;
    bool ok = sadmm_grow((void **)&s->parent, &s->parent_capacity, 0, n, sizeof *s->parent) &&
              sadmm_grow((void **)&s->island_of, &s->island_of_capacity, 0, n, sizeof *s->island_of) &&
              sadmm_grow((void **)&s->islands, &s->islands_capacity, 0, n + 2, sizeof *s->islands) &&
              sadmm_grow((void **)&s->cursor, &s->cursor_capacity, 0, n + 1, sizeof *s->cursor) &&
              sadmm_grow((void **)&s->parts, &s->parts_capacity, 0, most_parts(c) + 1, sizeof *s->parts);
    return ok ? SADMM_OK : sadmm_fail_memory(error, "the cuda backend's step");
}

/* The view's counts; the graph stays valid only while nothing in the view moves. */
static void count(struct sadmm_context *c)
{
    const struct sadmm_contact_set *contacts = c->system->contacts;
    cuda_view *v = &c->view;
    c->point_slots = 0;
    for (size_t p = 0; p < contacts->pair_count; ++p)
        if (contacts->pairs[p].count > c->point_slots) c->point_slots = contacts->pairs[p].count;
    v->bodies = c->plan.bodies;
    v->pairs = c->plan.pairs;
    v->points = c->plan.points;
    v->rows = c->system->block_count;
    v->stride = (v->pairs + WARP - 1) / WARP * WARP;
    v->row_stride = (v->rows + WARP - 1) / WARP * WARP;
    v->contact_rows = c->plan.contact_rows;
    v->warm_start = c->plan.warm_start;
    v->settings = c->settings;
}

static sadmm_status lay_out_step(struct sadmm_context *c, struct sadmm_error *error)
{
    size_t n = (size_t)c->view.bodies, pairs = (size_t)c->view.pairs, rows = (size_t)c->view.rows;
    size_t parts = most_parts(c), bytes = lay_out(nullptr, n, pairs, rows, parts).bytes;
    CUDA_TRY(CUDA(room)(c, PINNED_LAYOUT, bytes, error));
    CUDA_TRY(CUDA(room)(c, BUFFER_LAYOUT, bytes, error));
    struct layout host = lay_out(c->buffers[PINNED_LAYOUT].data, n, pairs, rows, parts);
    int32_t islands = count_islands(c);
    number_slots(c, &host, islands);
    list_incident(c, &host);
    CUDA_TRY(choose_tier(c, &host, islands, error));
    if (c->part_count > 0) memcpy(host.parts, c->scratch.parts, ((size_t)c->part_count + 1) * sizeof *host.parts);

    struct layout device = lay_out(c->buffers[BUFFER_LAYOUT].data, n, pairs, rows, parts);
    size_t used = bytes - (parts - (size_t)c->part_count) * sizeof *host.parts;
    CUDA_CALL(c, cudaMemcpyAsync(device.body_of, host.body_of, used, cudaMemcpyHostToDevice, c->stream),
              "cudaMemcpyAsync(layout)");
    c->view.body_of = device.body_of;
    c->view.slot_of = device.slot_of;
    c->view.pair_of = device.pair_of;
    c->view.row_of = device.row_of;
    c->view.offsets = device.offsets;
    c->view.incident = device.incident;
    c->view.parts = device.parts;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(begin)(struct sadmm_context *c, const struct sadmm_system *system,
                                    const struct sadmm_plan *plan, const struct sadmm_settings *settings,
                                    struct sadmm_error *error)
{
    int64_t records = (int64_t)plan->pairs + system->block_count;
    if (records > INT32_MAX / (2 * RECORD))
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld constraints: at most %d", (long long)records,
                          INT32_MAX / (2 * RECORD));
    if (plan->bodies > INT32_MAX / MATRIX - 1)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%d bodies: at most %d", plan->bodies, INT32_MAX / MATRIX - 1);
    CUDA_ENTER(c);
    CUDA_TRY(CUDA(wait)(c, error)); /* the staging buffers are about to be written */
    c->system = system;
    c->plan = *plan;
    c->settings = *settings;
    c->blocks_uploaded = false;
    c->measured = false;
    c->ratio = 1;
    c->graph_valid = false;
    count(c);
    CUDA_TRY(host_room(c, error));
    CUDA_TRY(lay_out_step(c, error));
    CUDA_TRY(device_room(c, error));
    CUDA_CALL(c, cudaMemsetAsync(c->view.residual, 0, 64, c->stream), "cudaMemsetAsync(scalars)");
    CUDA_CALL(c, cudaMemsetAsync(c->view.state + (size_t)plan->bodies * ROW, 0, ROW * sizeof(solver_real), c->stream),
              "cudaMemsetAsync(static world)");
    return SADMM_OK;
}
