/* Sort and sweep along one axis, in plain C: the broad phase of builds without FCL and the oracle of the tests.
 *
 * Intervals are sorted by (group, low end) along the axis in which the boxes are spread most relative to their size.
 * Static boxes of group -1 meet every group, so they are kept apart, sorted on their own, and each group is swept
 * together with them. In a pile one axis leaves about n^(2/3) candidates a body: fine to a few thousand bodies, FCL
 * beyond.
 */
#include "broad_phase.h"

#include "core/base/memory.h"

struct interval {
    double lo, hi;
    int32_t group;
    uint32_t slot;
};

struct sadmm_broad_phase {
    struct interval *own, *shared; /* groups >= 0; group -1 */
    size_t own_count, shared_count;
    struct interval *scratch;
};

static sadmm_status sweep_create(struct sadmm_broad_phase **out, struct sadmm_error *error)
{
    *out = sadmm_alloc(1, sizeof **out);
    if (!*out) return sadmm_fail_memory(error, "sort-and-sweep broad phase");
    return SADMM_OK;
}

static void sweep_destroy(struct sadmm_broad_phase *bp)
{
    if (!bp) return;
    sadmm_free(bp->own);
    sadmm_free(bp->shared);
    sadmm_free(bp->scratch);
    sadmm_free(bp);
}

static sadmm_status sweep_update(struct sadmm_broad_phase *bp, const struct sadmm_broad_entry *entries,
                                 size_t entry_count, const uint32_t *changed, size_t changed_count,
                                 struct sadmm_error *error)
{
    size_t i, own = 0, shared = 0;
    (void)changed;
    (void)changed_count;
    for (i = 0; i < entry_count; ++i)
        if (entries[i].present) {
            if (entries[i].group < 0) ++shared;
            else ++own;
        }
    bp->own_count = bp->shared_count = 0;
    if (!SADMM_GROW(bp->own, 0, own) || !SADMM_GROW(bp->shared, 0, shared) ||
        !SADMM_GROW(bp->scratch, 0, own > shared ? own : shared))
        return sadmm_fail_memory(error, "sort-and-sweep intervals");
    for (i = 0; i < entry_count; ++i)
        if (entries[i].present) {
            struct interval *t = entries[i].group < 0 ? &bp->shared[bp->shared_count++] : &bp->own[bp->own_count++];
            t->group = entries[i].group;
            t->slot = (uint32_t)i;
        }
    return SADMM_OK;
}

/* Axis along which the centres are spread most (variance), world. */
static int widest_axis(const struct sadmm_broad_entry *entries, size_t entry_count)
{
    double mean[3] = {0, 0, 0}, spread[3] = {0, 0, 0};
    size_t i, n = 0;
    int k;
    for (i = 0; i < entry_count; ++i)
        if (entries[i].present) {
            ++n;
            for (k = 0; k < 3; ++k) {
                double c = 0.5 * (entries[i].box.lo[k] + entries[i].box.hi[k]), d = c - mean[k];
                mean[k] += d / (double)n;
                spread[k] += d * (c - mean[k]);
            }
        }
    k = spread[1] > spread[0];
    return spread[2] > spread[k] ? 2 : k;
}

static bool before(const struct interval *a, const struct interval *b)
{
    if (a->group != b->group) return a->group < b->group;
    if (a->lo < b->lo || a->lo > b->lo) return a->lo < b->lo;
    return a->slot < b->slot;
}

/* Bottom-up merge sort. */
static void sort_intervals(struct interval *items, struct interval *scratch, size_t count)
{
    size_t width, i;
    struct interval *from = items, *to = scratch;
    for (width = 1; width < count; width *= 2) {
        struct interval *swap;
        for (i = 0; i < count; i += 2 * width) {
            size_t a = i, b = i + width < count ? i + width : count, a_end = b;
            size_t b_end = i + 2 * width < count ? i + 2 * width : count, k;
            for (k = i; k < b_end; ++k)
                to[k] = a < a_end && (b >= b_end || !before(&from[b], &from[a])) ? from[a++] : from[b++];
        }
        swap = from;
        from = to;
        to = swap;
    }
    if (from != items)
        for (i = 0; i < count; ++i) items[i] = from[i];
}

static bool report(const struct sadmm_broad_entry *entries, uint32_t a, uint32_t b, struct sadmm_pair_list *list)
{
    if (!entries[a].moves && !entries[b].moves) return true;
    if (!boxes_overlap(&entries[a].box, &entries[b].box)) return true;
    return sadmm_pair_list_add(list, a, b);
}

static sadmm_status sweep_pairs(struct sadmm_broad_phase *bp, const struct sadmm_broad_entry *entries,
                                size_t entry_count, struct sadmm_pair_list *list, struct sadmm_error *error)
{
    int axis = widest_axis(entries, entry_count);
    size_t i, j, s = 0;
    bool ok = true;

    for (i = 0; i < bp->own_count; ++i) {
        bp->own[i].lo = entries[bp->own[i].slot].box.lo[axis];
        bp->own[i].hi = entries[bp->own[i].slot].box.hi[axis];
    }
    for (i = 0; i < bp->shared_count; ++i) {
        bp->shared[i].lo = entries[bp->shared[i].slot].box.lo[axis];
        bp->shared[i].hi = entries[bp->shared[i].slot].box.hi[axis];
    }
    sort_intervals(bp->own, bp->scratch, bp->own_count);
    sort_intervals(bp->shared, bp->scratch, bp->shared_count);

    for (i = 0; ok && i < bp->own_count; ++i) {
        const struct interval *a = &bp->own[i];
        for (j = i + 1; ok && j < bp->own_count && bp->own[j].group == a->group && bp->own[j].lo <= a->hi; ++j)
            ok = report(entries, a->slot, bp->own[j].slot, list);
        /* shared boxes that start inside a; then those inside which a starts */
        if (i == 0 || bp->own[i - 1].group != a->group) s = 0;
        while (s < bp->shared_count && bp->shared[s].lo < a->lo) ++s;
        for (j = s; ok && j < bp->shared_count && bp->shared[j].lo <= a->hi; ++j)
            ok = report(entries, a->slot, bp->shared[j].slot, list);
    }
    for (i = 0; ok && i < bp->shared_count; ++i) {
        const struct interval *b = &bp->shared[i];
        size_t start = 0;
        while (ok && start < bp->own_count) {
            /* first interval of the group that starts after b does, by bisection */
            int32_t group = bp->own[start].group;
            size_t low = start, high = bp->own_count;
            while (low < high) {
                size_t mid = low + (high - low) / 2;
                if (bp->own[mid].group == group && bp->own[mid].lo <= b->lo) low = mid + 1;
                else high = mid;
            }
            for (j = low; ok && j < bp->own_count && bp->own[j].group == group && bp->own[j].lo <= b->hi; ++j)
                ok = report(entries, bp->own[j].slot, b->slot, list);
            while (j < bp->own_count && bp->own[j].group == group) ++j; /* next group */
            start = j;
        }
    }
    return ok ? SADMM_OK : sadmm_fail_memory(error, "broad-phase pairs");
}

const struct sadmm_broad_phase_kind sadmm_broad_phase_sweep = {
    .name = "sweep",
    .create = sweep_create,
    .destroy = sweep_destroy,
    .update = sweep_update,
    .pairs = sweep_pairs,
    .pairs_of = NULL,
};
