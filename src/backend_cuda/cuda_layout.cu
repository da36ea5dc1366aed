/* begin: room for the step, facts, the partition, slots, the body -> record list and the parts (cuda_internal.h). */
#include <string.h>

#include "../core/memory.h"
#include "cuda_internal.h"

/* ---- islands --------------------------------------------------------------------------------------------------- */

/* Bodies and halves of an island, then those before it. */
struct island {
    int32_t body, half;
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

/* Where the layout's arrays are in its one buffer, in order. */
struct layout {
    int32_t *body_of, *slot_of, *offsets, *incident, *parts;
    size_t bytes;
};

static struct layout lay_out(void *base, size_t n, size_t records, size_t parts)
{
    struct layout l;
    l.body_of = (int32_t *)base;
    l.slot_of = l.body_of + n;
    l.offsets = l.slot_of + n;
    l.incident = l.offsets + n + 1;
    l.parts = l.incident + 2 * records;
    l.bytes = (3 * n + 1 + 2 * records + parts + 1) * sizeof(int32_t);
    return l;
}

/* ---- the constraint graph --------------------------------------------------------------------------------------- */

static int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }

/* The bodies of constraint i, pairs first, then row blocks; its record. */
static int32_t bodies_of(const struct sadmm_context *c, size_t i, int32_t bodies[2])
{
    size_t pairs = c->system->contacts->pair_count;
    if (i < pairs) {
        bodies[0] = c->system->contacts->pairs[i].body_a;
        bodies[1] = c->system->contacts->pairs[i].body_b;
        return (int32_t)i;
    }
    bodies[0] = c->system->blocks[i - pairs].body_a;
    bodies[1] = c->system->blocks[i - pairs].body_b;
    return c->view.pair_room + (int32_t)(i - pairs);
}

static size_t constraints(const struct sadmm_context *c)
{
    return c->system->contacts->pair_count + (size_t)c->system->block_count;
}

static bool is_warm(const struct sadmm_contact_set *contacts, const struct sadmm_contact_pair *pair)
{
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
        for (int i = 0; i < 3; ++i)
            if (contacts->points[k].impulse[i] != 0) return true;
    return false;
}

/* Facts, and the islands, numbered by their first body: counts in islands[island + 1]. */
static void survey(struct sadmm_context *c)
{
    struct cuda_scratch *s = &c->scratch;
    struct cuda_facts *facts = &c->facts;
    const struct sadmm_contact_set *contacts = c->system->contacts;
    int32_t n = c->plan.bodies, bodies[2], part_halves = facts->part_halves, part_bodies = facts->part_bodies;
    memset(facts, 0, sizeof *facts);
    facts->part_halves = part_halves;
    facts->part_bodies = part_bodies;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        facts->point_slots = larger(facts->point_slots, contacts->pairs[p].count);
        facts->rough += contacts->pairs[p].friction > 0;
        facts->warm += is_warm(contacts, &contacts->pairs[p]);
    }
    for (int32_t i = 0; i < n; ++i) s->parent[i] = i;
    memset(s->cursor, 0, ((size_t)n + 1) * sizeof *s->cursor);
    for (size_t k = 0; k < constraints(c); ++k) {
        bodies_of(c, k, bodies);
        join_bodies(s->parent, bodies[0], bodies[1]);
        for (int side = 0; side < 2; ++side)
            if (bodies[side] >= 0) ++s->cursor[bodies[side]];
    }
    memset(s->islands, 0, ((size_t)n + 2) * sizeof *s->islands);
    for (int32_t i = 0; i < n; ++i) {
        int32_t root = find_root(s->parent, i);
        s->island_of[i] = root == i ? facts->islands++ : s->island_of[root];
        struct island *one = &s->islands[s->island_of[i] + 1];
        ++one->body;
        one->half += s->cursor[i];
        facts->degree = larger(facts->degree, s->cursor[i]);
        facts->halves += s->cursor[i];
        facts->island_bodies = larger(facts->island_bodies, one->body);
        facts->island_halves = larger(facts->island_halves, one->half);
    }
    for (int32_t i = 0; i < facts->islands; ++i) {
        s->islands[i + 1].body += s->islands[i].body;
        s->islands[i + 1].half += s->islands[i].half;
    }
}

/* ---- slots, lists and parts ------------------------------------------------------------------------------------- */

static bool by_island(enum sadmm_cuda_tier tier)
{
    return tier == SADMM_CUDA_TIER_BLOCK || tier == SADMM_CUDA_TIER_CLUSTER;
}

/* Slots by island, in raw order within each (a stable counting sort), or in raw order. */
static void number_slots(struct sadmm_context *c, const struct layout *l)
{
    struct cuda_scratch *s = &c->scratch;
    bool islands = by_island(c->partition.tier);
    for (int32_t i = 0; i < c->facts.islands; ++i) s->cursor[i] = s->islands[i].body;
    for (int32_t i = 0; i < c->plan.bodies; ++i) {
        int32_t slot = islands ? s->cursor[s->island_of[i]]++ : i;
        l->body_of[slot] = i;
        l->slot_of[i] = slot;
    }
}

/* Counting sort of record halves by body; records ascend within a body. */
static void list_incident(struct sadmm_context *c, const struct layout *l)
{
    size_t n = (size_t)c->plan.bodies;
    int32_t *cursor = c->scratch.cursor, bodies[2];
    memset(l->offsets, 0, (n + 1) * sizeof *l->offsets);
    for (size_t k = 0; k < constraints(c); ++k) {
        bodies_of(c, k, bodies);
        for (int side = 0; side < 2; ++side)
            if (bodies[side] >= 0) ++l->offsets[l->slot_of[bodies[side]] + 1];
    }
    for (size_t i = 0; i < n; ++i) l->offsets[i + 1] += l->offsets[i];
    memcpy(cursor, l->offsets, n * sizeof *cursor);
    for (size_t k = 0; k < constraints(c); ++k) {
        int32_t record = bodies_of(c, k, bodies);
        for (int side = 0; side < 2; ++side)
            if (bodies[side] >= 0) l->incident[cursor[l->slot_of[bodies[side]]]++] = 2 * record + side;
    }
}

/* First slot from `slot` on, an island's first one when `heads`, whose cost before it is at least share / shares of all. */
static int32_t boundary(const struct sadmm_context *c, const struct layout *l, bool heads, int32_t slot, int32_t share,
                        int32_t shares)
{
    int32_t n = c->plan.bodies;
    const int32_t *island_of = c->scratch.island_of, *body_of = l->body_of;
    int64_t total = (int64_t)l->offsets[n] + n, target = (total * share + shares - 1) / shares;
    while (slot < n && (l->offsets[slot] + (int64_t)slot < target ||
                        (heads && slot > 0 && island_of[body_of[slot]] == island_of[body_of[slot - 1]])))
        ++slot;
    return slot;
}

/* Parts by cost, halves + bodies: BLOCK islands in even shares, GRID bodies in even shares; CLUSTER shares of islands, each
 * in even shares of its bodies. */
static void divide(struct sadmm_context *c, const struct layout *l)
{
    const struct cuda_partition *partition = &c->partition;
    int32_t parts = partition->parts, cluster = partition->cluster, clusters = parts / cluster, n = c->plan.bodies;
    c->facts.part_halves = c->facts.part_bodies = 0;
    l->parts[0] = 0;
    for (int32_t k = 0; k < clusters; ++k) {
        int32_t *of = l->parts + k * cluster, begin = of[0];
        int32_t end = k + 1 == clusters ? n : boundary(c, l, by_island(partition->tier), begin, k + 1, clusters);
        int64_t before = (int64_t)l->offsets[begin] + begin, total = (int64_t)l->offsets[end] + end - before;
        of[cluster] = end;
        for (int32_t j = 1; j < cluster; ++j) {
            int64_t target = before + (total * j + cluster - 1) / cluster;
            of[j] = of[j - 1];
            while (of[j] < end && (int64_t)l->offsets[of[j]] + of[j] < target) ++of[j];
        }
    }
    for (int32_t p = 0; p < parts; ++p) {
        int32_t halves = l->offsets[l->parts[p + 1]] - l->offsets[l->parts[p]], bodies = l->parts[p + 1] - l->parts[p];
        c->facts.part_halves = larger(c->facts.part_halves, halves);
        c->facts.part_bodies = larger(c->facts.part_bodies, bodies);
    }
}

/* ---- room ------------------------------------------------------------------------------------------------------- */

enum { SCALARS = 128 }; /* bytes: residuals, barrier, live */

static sadmm_status device_room(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_view *v = &c->view;
    size_t n = (size_t)v->bodies, pairs = (size_t)v->pair_room, rows = (size_t)v->row_stride,
           real_size = sizeof(solver_real);
    size_t slots = (size_t)c->facts.point_slots * pairs, records = (pairs + (size_t)v->rows) * RECORD * real_size;
    size_t points = (size_t)c->plan.points;
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
        {BUFFER_EXCHANGE, c->partition.tier == SADMM_CUDA_TIER_GRID ? 2 * n * ROW * real_size : 0},
        {BUFFER_SCALARS, SCALARS},
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
    v->live = (struct cuda_live *)(v->residual + 8);
    v->exchange = (solver_real *)b[BUFFER_EXCHANGE].data;
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
              sadmm_grow((void **)&s->cursor, &s->cursor_capacity, 0, n + 1, sizeof *s->cursor);
    return ok ? SADMM_OK : sadmm_fail_memory(error, "the cuda backend's step");
}

/* The view's counts; the graph stays valid only while nothing in the view moves. */
static void count(struct sadmm_context *c)
{
    cuda_view *v = &c->view;
    v->bodies = c->plan.bodies;
    v->pair_room = (c->plan.pairs + WARP - 1) / WARP * WARP;
    v->rows = c->system->block_count;
    v->row_stride = (v->rows + WARP - 1) / WARP * WARP;
    v->contact_rows = c->plan.contact_rows;
    v->warm_start = c->plan.warm_start;
    v->settings = c->settings;
}

static sadmm_status lay_out_step(struct sadmm_context *c, struct sadmm_error *error)
{
    size_t n = (size_t)c->view.bodies;
    survey(c);
    CUDA_TRY(CUDA(choose_partition)(c, &c->facts, &c->partition, error));
    size_t bytes = lay_out(nullptr, n, constraints(c), (size_t)c->partition.parts).bytes;
    CUDA_TRY(CUDA(room)(c, PINNED_LAYOUT, bytes + sizeof(struct cuda_live), error));
    CUDA_TRY(CUDA(room)(c, BUFFER_LAYOUT, bytes, error));
    struct layout host = lay_out(c->buffers[PINNED_LAYOUT].data, n, constraints(c), (size_t)c->partition.parts);
    number_slots(c, &host);
    list_incident(c, &host);
    if (c->partition.parts > 0) divide(c, &host);

    struct layout device = lay_out(c->buffers[BUFFER_LAYOUT].data, n, constraints(c), (size_t)c->partition.parts);
    CUDA_CALL(c, cudaMemcpyAsync(device.body_of, host.body_of, bytes, cudaMemcpyHostToDevice, c->stream),
              "cudaMemcpyAsync(layout)");
    c->view.body_of = device.body_of;
    c->view.slot_of = device.slot_of;
    c->view.offsets = device.offsets;
    c->view.incident = device.incident;
    c->view.parts = device.parts;
    return SADMM_OK;
}

static sadmm_status upload_live(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_live live = {HALT_NONE, c->plan.bodies, c->plan.pairs, c->plan.points};
    if (c->facts.part_halves > c->partition.most_halves || c->facts.part_bodies > c->partition.most_bodies)
        live.halt = HALT_PARTITION;
    size_t at = c->buffers[PINNED_LAYOUT].capacity - sizeof live; /* beyond the layout */
    return CUDA(upload)(c, c->view.live, PINNED_LAYOUT, at, &live, sizeof live, error);
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
    c->starting = true;
    c->weighed = false;
    c->measured = false;
    c->ratio = 1;
    c->graph_valid = false;
    count(c);
    CUDA_TRY(host_room(c, error));
    CUDA_TRY(lay_out_step(c, error));
    CUDA_TRY(device_room(c, error));
    CUDA_CALL(c, cudaMemsetAsync(c->view.residual, 0, SCALARS, c->stream), "cudaMemsetAsync(scalars)");
    CUDA_CALL(c, cudaMemsetAsync(c->view.state + (size_t)plan->bodies * ROW, 0, ROW * sizeof(solver_real), c->stream),
              "cudaMemsetAsync(static world)");
    return upload_live(c, error);
}
