/* The CUDA backend's layout (device/layout.h) against a plain construction on the host: statistics, slots, lists of
 * sides and every boundary of every part, number for number. On a real device, or skipped; test_cuda_layout_emulated.c
 * runs the same on the emulated one. One file: more than half of it, the graphs and the plain construction, is used by
 * nearly every test. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cuda_suite.h"
#include "fixed_work.h"
#include "runner.h"

#ifdef CUDA_EMULATED
#include "emulation_control.h"
#define CUDA(name) sadmm_cuda_##name##_emulated_f32
#include "backend_cuda/device/entries.h"
#undef CUDA
#define CUDA(name) sadmm_cuda_##name##_emulated_f64
#include "backend_cuda/device/entries.h"
#undef CUDA
#define LAY_OUT_F32 sadmm_cuda_lay_out_again_emulated_f32
#define LAY_OUT_F64 sadmm_cuda_lay_out_again_emulated_f64
#else
#define CUDA(name) sadmm_cuda_##name##_f32
#include "backend_cuda/device/entries.h"
#undef CUDA
#define CUDA(name) sadmm_cuda_##name##_f64
#include "backend_cuda/device/entries.h"
#undef CUDA
#define LAY_OUT_F32 sadmm_cuda_lay_out_again_f32
#define LAY_OUT_F64 sadmm_cuda_lay_out_again_f64
#endif

static const struct sadmm_kernels *tables[2]; /* by precision */

enum { MOST_PARTS = 200 };

static void *numbers(size_t count)
{
    int32_t *all = malloc((count + 1) * sizeof *all);
    ck_assert_ptr_nonnull(all);
    memset(all, 0xee, (count + 1) * sizeof *all);
    return all;
}

/* ---- graphs ---------------------------------------------------------------------------------------------------- */

static int32_t pick(int32_t count) { return (int32_t)((contact_problem_random() + 1) / 2 * count); }

static struct contact_problem *bodies(int32_t count)
{
    struct contact_problem *p = contact_problem_new();
    for (int32_t i = 0; i < count; ++i) contact_problem_box(p, 1, 0.1, 0.1, 0.1, 0, 0, i);
    contact_problem_seed(3);
    return p;
}

/* A pair of 1 to `most` points; every third one slips, every fifth one has an impulse in its last point. */
static void touch(struct contact_problem *p, int32_t a, int32_t b, int32_t most)
{
    int32_t points = 1 + pick(most), index = (int32_t)p->contacts.pair_count;
    for (int32_t k = 0; k < points; ++k)
        contact_problem_touch(p, a, b, (double[3]){k, 0, 0}, (double[3]){0, 0, 1}, 0, index % 3 ? 0.5 : 0, 0);
    if (index % 5 == 0) p->contacts.points[p->contacts.point_count - 1].impulse[1] = -1e-30;
}

static void join(struct contact_problem *p, int32_t a, int32_t b)
{
    sadmm_problem_block *block = contact_problem_block(p, SADMM_BLOCK_HARD, 1, a, b);
    block->jacobian_a[0] = -1;
    block->jacobian_b[0] = 1;
}

static struct contact_problem *scattered(int32_t n, int32_t pairs, int32_t blocks, int32_t most)
{
    struct contact_problem *p = bodies(n);
    for (int32_t k = 0; k < pairs + blocks; ++k) {
        int32_t a = pick(n + n / 8 + 1), b = pick(n + n / 8 + 1);
        if (a >= n) a = -1; /* sometimes the static world, on either side */
        if (b >= n) b = -1;
        if (a == b) continue;
        if (k < pairs) touch(p, a, b, most);
        else join(p, a, b);
    }
    contact_problem_rows(p);
    return p;
}

static int32_t *shuffled(int32_t n)
{
    int32_t *place = numbers((size_t)n);
    for (int32_t i = 0; i < n; ++i) {
        int32_t other = pick(i + 1);
        place[i] = place[other];
        place[other] = i;
    }
    return place;
}

static struct contact_problem *empty(void) { return bodies(0); }
static struct contact_problem *one(void) { return bodies(1); }
static struct contact_problem *no_pairs(void) { return bodies(700); }
static struct contact_problem *sparse(void) { return scattered(600, 250, 20, 4); }
static struct contact_problem *dense(void) { return scattered(300, 2500, 0, 8); }
static struct contact_problem *joined(void) { return scattered(90, 0, 70, 1); }
/* More than the emulated device runs at once: its threads take several records and bodies each. */
static struct contact_problem *wide(void) { return scattered(9000, 8300, 100, 2); }

static struct contact_problem *on_ground(void)
{
    struct contact_problem *p = bodies(300);
    for (int32_t i = 0; i < 300; ++i) touch(p, i % 2 ? i : -1, i % 2 ? -1 : i, 4);
    return p;
}

/* Towers of 1 to 40 boxes, in an order that has nothing to do with them. */
static struct contact_problem *towers(void)
{
    const int32_t n = 400;
    struct contact_problem *p = bodies(n);
    int32_t *place = shuffled(n);
    for (int32_t i = 0, height = 1; i < n; i += height, height = 1 + pick(40))
        for (int32_t k = 0; k < height && i + k < n; ++k) touch(p, k ? place[i + k - 1] : -1, place[i + k], 4);
    free(place);
    return p;
}

/* One island through all bodies in any order: the longest way for a union-find forest. */
static struct contact_problem *chain(bool any_order)
{
    const int32_t n = 1500;
    struct contact_problem *p = bodies(n);
    int32_t *place = shuffled(n);
    for (int32_t i = 1; i < n; ++i) touch(p, any_order ? place[i] : n - i - 1, any_order ? place[i - 1] : n - i, 2);
    free(place);
    return p;
}
static struct contact_problem *shuffled_chain(void) { return chain(true); }
static struct contact_problem *falling_chain(void) { return chain(false); }

/* One body that touches all the others. */
static struct contact_problem *star(void)
{
    struct contact_problem *p = bodies(1200);
    for (int32_t i = 0; i < 1200; ++i)
        if (i != 700) touch(p, i % 2 ? 700 : i, i % 2 ? i : 700, 4);
    return p;
}

static const struct graph {
    const char *name;
    struct contact_problem *(*make)(void);
    bool warm;
    bool small; /* one block can do it */
} graphs[] = {
    {"empty", empty, true, true},
    {"one body", one, true, true},
    {"no pairs", no_pairs, true, true},
    {"static contacts", on_ground, true, true},
    {"sparse", sparse, true, true},
    {"dense", dense, false, true},
    {"blocks alone", joined, true, true},
    {"towers", towers, false, true},
    {"shuffled chain", shuffled_chain, true, true},
    {"falling chain", falling_chain, true, true},
    {"star", star, true, true},
    {"wide", wide, true, false},
};
enum { GRAPHS = sizeof graphs / sizeof *graphs };

/* ---- the plain construction ------------------------------------------------------------------------------------ */

struct host_layout {
    const struct contact_problem *p;
    int32_t n, records, pair_capacity; /* pair_capacity: records of pairs, before those of blocks */
    int32_t *label;                    /* raw body -> smallest body of its island */
    struct cuda_layout_copy wanted;
};

static void record_bodies(const struct host_layout *h, int32_t record, int32_t body[2])
{
    body[0] = body[1] = -1;
    if (record < (int32_t)h->p->contacts.pair_count) {
        body[0] = h->p->contacts.pairs[record].body_a;
        body[1] = h->p->contacts.pairs[record].body_b;
    } else if (record >= h->pair_capacity) {
        body[0] = h->p->blocks[record - h->pair_capacity].body_a;
        body[1] = h->p->blocks[record - h->pair_capacity].body_b;
    }
}

static struct cuda_layout_copy copy_new(const struct host_layout *h)
{
    struct cuda_layout_copy copy;
    memset(&copy, 0, sizeof copy);
    copy.body_of = numbers((size_t)h->n);
    copy.slot_of = numbers((size_t)h->n);
    copy.offsets = numbers((size_t)h->n + 1);
    copy.incident = numbers(2 * (size_t)h->records);
    copy.parts = numbers(MOST_PARTS + 1);
    return copy;
}

static void copy_free(struct cuda_layout_copy *copy)
{
    free(copy->body_of);
    free(copy->slot_of);
    free(copy->offsets);
    free(copy->incident);
    free(copy->parts);
}

static void label_bodies(struct host_layout *h)
{
    int32_t body[2];
    for (int32_t i = 0; i < h->n; ++i) h->label[i] = i;
    for (bool changed = true; changed;) {
        changed = false;
        for (int32_t r = 0; r < h->records; ++r) {
            record_bodies(h, r, body);
            if (body[0] < 0 || body[1] < 0) continue;
            int32_t *a = &h->label[body[0]], *b = &h->label[body[1]], low = *a < *b ? *a : *b;
            low = h->label[low];
            changed = changed || *a != low || *b != low;
            *a = *b = low;
        }
        for (int32_t r = h->records - 1; r >= 0; --r) { /* and back, or a chain takes as many rounds as it is long */
            record_bodies(h, r, body);
            if (body[0] < 0 || body[1] < 0) continue;
            int32_t *a = &h->label[body[0]], *b = &h->label[body[1]], low = *a < *b ? *a : *b;
            *a = *b = low;
        }
    }
}

static int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }

static void find_statistics(struct host_layout *h, bool warm_start)
{
    struct cuda_graph_statistics *f = &h->wanted.statistics;
    int32_t *island_bodies = calloc((size_t)h->n + 1, sizeof(int32_t)), body[2];
    int32_t *island_sides = calloc((size_t)h->n + 1, sizeof(int32_t));
    int32_t *degree = calloc((size_t)h->n + 1, sizeof(int32_t));
    const struct sadmm_contact_set *set = &h->p->contacts;
    for (int32_t i = 0; i < h->n; ++i) ++island_bodies[h->label[i]];
    for (int32_t r = 0; r < h->records; ++r) {
        record_bodies(h, r, body);
        for (int side = 0; side < 2; ++side) {
            if (body[side] < 0) continue;
            ++f->sides;
            ++degree[body[side]];
            ++island_sides[h->label[body[side]]];
        }
    }
    for (int32_t i = 0; i < h->n; ++i) {
        f->islands += h->label[i] == i;
        f->island_bodies = larger(f->island_bodies, island_bodies[i]);
        f->island_sides = larger(f->island_sides, island_sides[i]);
        f->degree = larger(f->degree, degree[i]);
    }
    for (size_t p = 0; p < set->pair_count; ++p) {
        bool warm = false;
        f->point_slots = larger(f->point_slots, set->pairs[p].count);
        f->rough += set->pairs[p].friction > 0;
        for (int32_t k = 0; k < 3 * set->pairs[p].count; ++k)
            warm = warm || set->points[set->pairs[p].first + k / 3].impulse[k % 3] != 0;
        f->warm += warm && warm_start;
    }
    free(island_bodies);
    free(island_sides);
    free(degree);
}

static struct host_layout host_new(const struct contact_problem *p, bool warm_start)
{
    struct host_layout h;
    memset(&h, 0, sizeof h);
    h.p = p;
    h.n = p->system.body_count;
    h.pair_capacity = (int32_t)(p->contacts.pair_count + 31) / 32 * 32;
    h.records = h.pair_capacity + p->block_count;
    h.label = numbers((size_t)h.n);
    h.wanted = copy_new(&h);
    label_bodies(&h);
    find_statistics(&h, warm_start);
    return h;
}

static void host_free(struct host_layout *h)
{
    copy_free(&h->wanted);
    free(h->label);
}

/* Bodies by label when wanted, lists of sides by going through the records once. */
static void host_slots(struct host_layout *h, bool by_island)
{
    struct cuda_layout_copy *w = &h->wanted;
    int32_t next = 0, body[2], *used = calloc((size_t)h->n + 1, sizeof *used);
    for (int32_t label = 0; label < h->n; ++label) {
        if (by_island && h->label[label] != label) continue;
        for (int32_t i = label; i < h->n; ++i) {
            if (by_island ? h->label[i] != label : i != label) continue;
            w->slot_of[i] = next;
            w->body_of[next++] = i;
            if (!by_island) break;
        }
    }
    memset(w->offsets, 0, ((size_t)h->n + 1) * sizeof *w->offsets);
    for (int pass = 0; pass < 2; ++pass) {
        for (int32_t r = 0; r < h->records; ++r) {
            record_bodies(h, r, body);
            for (int side = 0; side < 2; ++side) {
                if (body[side] < 0) continue;
                int32_t slot = w->slot_of[body[side]];
                if (pass == 0) ++w->offsets[slot + 1];
                else w->incident[w->offsets[slot] + used[slot]++] = 2 * r + side;
            }
        }
        for (int32_t i = 0; pass == 0 && i < h->n; ++i) w->offsets[i + 1] += w->offsets[i];
    }
    free(used);
}

/* The first slot >= first with its cost at least share p of P of [first, last) and, if wanted, an island's first. */
static int32_t host_share(const struct host_layout *h, int32_t first, int32_t last, int32_t p, int32_t P, bool head)
{
    const struct cuda_layout_copy *w = &h->wanted;
    const int64_t all = (int64_t)w->offsets[last] - w->offsets[first] + last - first;
    for (int32_t i = first; i < last; ++i) {
        const int64_t cost = (int64_t)w->offsets[i] - w->offsets[first] + i - first;
        const bool begins = h->label[w->body_of[i]] == w->body_of[i];
        if (cost * P >= p * all && (!head || begins)) return i;
    }
    return last;
}

static void host_parts(struct host_layout *h, const struct cuda_partition *partition)
{
    struct cuda_layout_copy *w = &h->wanted;
    w->statistics.part_bodies = w->statistics.part_sides = 0;
    if (partition->tier == SADMM_CUDA_TIER_STREAM) return;
    const int32_t n = h->n, each = partition->cluster, clusters = partition->parts / each;
    const bool islands = partition->tier != SADMM_CUDA_TIER_GRID;
    for (int32_t g = 0; g < clusters; ++g) {
        const int32_t first = host_share(h, 0, n, g, clusters, islands);
        const int32_t last = host_share(h, 0, n, g + 1, clusters, islands);
        for (int32_t q = 0; q < each; ++q) w->parts[g * each + q] = host_share(h, first, last, q, each, false);
    }
    w->parts[partition->parts] = n;
    for (int32_t p = 0; p < partition->parts; ++p) {
        w->statistics.part_bodies = larger(w->statistics.part_bodies, w->parts[p + 1] - w->parts[p]);
        w->statistics.part_sides =
            larger(w->statistics.part_sides, w->offsets[w->parts[p + 1]] - w->offsets[w->parts[p]]);
    }
}

/* ---- comparing ------------------------------------------------------------------------------------------------- */

static void same_numbers(const int32_t *got, const int32_t *wanted, int32_t count, const char *what, const char *about)
{
    for (int32_t i = 0; i < count; ++i)
        ck_assert_msg(got[i] == wanted[i], "%s: %s[%d] = %d instead of %d", about, what, i, got[i], wanted[i]);
}

static void same_statistics(const struct cuda_graph_statistics *got, const struct cuda_graph_statistics *wanted,
                            const char *about)
{
    static const char *const names[] = {"islands",     "island_bodies", "island_sides", "sides",      "degree",
                                        "point_slots", "rough",         "warm",          "cold",       "part_sides",
                                        "part_bodies"};
    const int32_t *a = (const int32_t *)got, *b = (const int32_t *)wanted;
    ck_assert_uint_eq(sizeof *got, sizeof names / sizeof *names * sizeof *a);
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        ck_assert_msg(a[i] == b[i], "%s: %s = %d instead of %d", about, names[i], a[i], b[i]);
}

static void same_layout(const struct host_layout *h, const struct cuda_layout_copy *got, int32_t parts,
                        const char *about)
{
    const struct cuda_layout_copy *w = &h->wanted;
    same_statistics(&got->statistics, &w->statistics, about);
    same_numbers(got->body_of, w->body_of, h->n, "body_of", about);
    same_numbers(got->slot_of, w->slot_of, h->n, "slot_of", about);
    same_numbers(got->offsets, w->offsets, h->n + 1, "offsets", about);
    same_numbers(got->incident, w->incident, w->statistics.sides, "incident", about);
    if (parts > 0) same_numbers(got->parts, w->parts, parts + 1, "parts", about);
}

/* ---- the device ------------------------------------------------------------------------------------------------ */

struct device {
    const struct sadmm_kernels *k;
    struct sadmm_context *c;
    sadmm_settings settings;
    struct sadmm_plan plan;
    struct sadmm_error error;
};

static void device_begin(struct device *d, struct contact_problem *p, bool warm)
{
    d->settings = fixed_settings();
    d->settings.method = SADMM_METHOD_PAPER; /* fast asks for islands everywhere; here the partition does */
    d->settings.iterations = 100;
    d->settings.warm_start = warm;
    d->plan = sadmm_plan_make(&p->system, &d->settings);
    CALL(d, d->k->begin(d->c, &p->system, &d->plan, &d->settings, &d->error));
}

static void device_new(struct device *d, int precision)
{
    memset(d, 0, sizeof *d);
    d->k = tables[precision];
    CALL(d, d->k->create(0, &d->c, &d->error));
}

static sadmm_status lay_out(struct device *d, const struct cuda_partition *partition, enum cuda_abort abort_code,
                            int way, struct cuda_layout_copy *out)
{
    return (d->k->precision == SADMM_F32 ? LAY_OUT_F32 : LAY_OUT_F64)(d->c, partition, abort_code, way, out, &d->error);
}

/* ---- tests ----------------------------------------------------------------------------------------------------- */

static const struct cuda_partition partitions[] = {
    {.tier = SADMM_CUDA_TIER_STREAM},
    {.tier = SADMM_CUDA_TIER_STREAM, .islands = true},
    {.tier = SADMM_CUDA_TIER_GRID, .parts = 1, .cluster = 1},
    {.tier = SADMM_CUDA_TIER_GRID, .parts = 7, .cluster = 1},
    {.tier = SADMM_CUDA_TIER_GRID, .parts = 7, .cluster = 1, .islands = true},
    {.tier = SADMM_CUDA_TIER_BLOCK, .parts = 1, .cluster = 1},
    {.tier = SADMM_CUDA_TIER_BLOCK, .parts = 5, .cluster = 1},
    {.tier = SADMM_CUDA_TIER_BLOCK, .parts = 131, .cluster = 1},
    {.tier = SADMM_CUDA_TIER_CLUSTER, .parts = 16, .cluster = 16},
    {.tier = SADMM_CUDA_TIER_CLUSTER, .parts = 12, .cluster = 4},
    {.tier = SADMM_CUDA_TIER_CLUSTER, .parts = 120, .cluster = 2},
    {.tier = SADMM_CUDA_TIER_GRID, .parts = 167, .cluster = 1},
};
enum { PARTITIONS = sizeof partitions / sizeof *partitions };

static bool by_island(const struct cuda_partition *partition)
{
    return partition->islands || partition->tier == SADMM_CUDA_TIER_BLOCK || partition->tier == SADMM_CUDA_TIER_CLUSTER;
}

/* One context goes through all graphs, every layout by all ways, some with threads in the other order. */
START_TEST(equals_host)
{
    struct device d;
    device_new(&d, _i);
    for (size_t g = (size_t)_i; g < GRAPHS; g += 1 + 3 * (size_t)_i) {
        struct contact_problem *p = graphs[g].make();
        struct host_layout h = host_new(p, graphs[g].warm);
        struct cuda_layout_copy got = copy_new(&h);
        device_begin(&d, p, graphs[g].warm);
        for (size_t k = 0; k < PARTITIONS; ++k) {
            struct cuda_partition partition = partitions[k];
            char about[128];
            host_slots(&h, by_island(&partition));
            host_parts(&h, &partition);
            partition.most_bodies = h.wanted.statistics.part_bodies;
            partition.most_sides = h.wanted.statistics.part_sides;
            for (int way = 0; way < 4; ++way) {
#ifdef CUDA_EMULATED
                if (way != (int)(k + g) % 4) continue; /* slow: every way is somebody's turn */
                cuda_emulation_descending = (int)(k + g / 2) & 1;
#endif
                snprintf(about, sizeof about, "%s, partition %zu, way %d", graphs[g].name, k, way);
                CALL(&d, lay_out(&d, &partition, ABORT_NONE, way, &got));
                ck_assert_msg(got.one_block == (graphs[g].small && !(way & CUDA_LAYOUT_GENERAL)), "%s", about);
                ck_assert_int_eq(got.live.abort_code, ABORT_NONE);
                ck_assert_int_eq(got.live.pairs, (int32_t)p->contacts.pair_count);
                same_layout(&h, &got, partition.parts, about);
            }
#ifdef CUDA_EMULATED
            cuda_emulation_descending = 0;
#endif
        }
        copy_free(&got);
        host_free(&h);
        contact_problem_free(p);
    }
    d.k->destroy(d.c);
}
END_TEST

/* A part with one side or one body too many aborts the step, and the statistics still say how large it is. */
START_TEST(too_large_parts_abort)
{
    struct device d;
    struct contact_problem *p = towers();
    struct host_layout h = host_new(p, true);
    struct cuda_layout_copy got = copy_new(&h);
    device_new(&d, _i);
    device_begin(&d, p, true);
    for (size_t k = 0; k < PARTITIONS; ++k) {
        struct cuda_partition partition = partitions[k];
        if (partition.tier == SADMM_CUDA_TIER_STREAM) continue;
        host_slots(&h, by_island(&partition));
        host_parts(&h, &partition);
        for (int which = 0; which < 4; ++which) {
            const int way = which / 2 * CUDA_LAYOUT_GENERAL;
            partition.most_bodies = h.wanted.statistics.part_bodies - which % 2;
            partition.most_sides = h.wanted.statistics.part_sides - !(which % 2);
            CALL(&d, lay_out(&d, &partition, ABORT_NONE, way, &got));
            ck_assert_int_eq(got.live.abort_code, ABORT_PARTITION);
            same_layout(&h, &got, partition.parts, "too large");
        }
    }
    copy_free(&got);
    host_free(&h);
    contact_problem_free(p);
    d.k->destroy(d.c);
}
END_TEST

/* After an abort nothing changes what the queue's last good step left. */
START_TEST(aborted_does_nothing)
{
    struct device d;
    struct contact_problem *p = towers();
    struct host_layout h = host_new(p, true);
    struct cuda_layout_copy got = copy_new(&h);
    struct cuda_partition partition = partitions[4];
    device_new(&d, _i);
    device_begin(&d, p, true);
    host_slots(&h, true);
    host_parts(&h, &partition);
    for (int way = 0; way < 4; ++way) {
        partition = partitions[4];
        partition.most_bodies = partition.most_sides = INT32_MAX;
        CALL(&d, lay_out(&d, &partition, ABORT_NONE, way, &got));
        same_layout(&h, &got, partition.parts, "before");
        partition.parts = 2;
        partition.most_bodies = 1;
        CALL(&d, lay_out(&d, &partition, ABORT_NON_FINITE, way, &got));
        ck_assert_int_eq(got.live.abort_code, ABORT_NON_FINITE);
        same_statistics(&got.statistics, &h.wanted.statistics, "aborted");
        same_numbers(got.offsets, h.wanted.offsets, h.n + 1, "offsets", "aborted");
        same_numbers(got.slot_of, h.wanted.slot_of, h.n, "slot_of", "aborted");
        same_numbers(got.parts, h.wanted.parts, 3, "parts", "aborted");
    }
    copy_free(&got);
    host_free(&h);
    contact_problem_free(p);
    d.k->destroy(d.c);
}
END_TEST

START_TEST(partitions_refused)
{
    static const struct cuda_partition bad[] = {
        {.tier = SADMM_CUDA_TIER_GRID, .parts = 0, .cluster = 1},
        {.tier = SADMM_CUDA_TIER_GRID, .parts = 1 << 30, .cluster = 1},
        {.tier = SADMM_CUDA_TIER_BLOCK, .parts = 4, .cluster = 0},
        {.tier = SADMM_CUDA_TIER_CLUSTER, .parts = 9, .cluster = 4},
    };
    struct device d;
    struct contact_problem *p = towers();
    struct cuda_layout_copy none = {0};
    device_new(&d, _i);
    device_begin(&d, p, true);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        ck_assert_int_eq(lay_out(&d, &bad[k], ABORT_NONE, 0, &none), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(d.error.message, "partition: parts = "));
    }
    contact_problem_free(p);
    d.k->destroy(d.c);
}
END_TEST

/* ---------------------------------------------------------------------------------------------------------------- */

int main(void)
{
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
    Suite *suite = suite_create("cuda_layout");
    ADD_CASE(suite, equals_host, 0, 2);
    ADD_CASE(suite, too_large_parts_abort, 0, 2);
    ADD_CASE(suite, aborted_does_nothing, 0, 2);
    ADD_CASE(suite, partitions_refused, 0, 2);
    return run_cuda_suite(suite);
}
