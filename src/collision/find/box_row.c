#include "box_row.h"

#include <string.h>

#include "candidates.h"
#include "collision/base/radix_sort.h"
#include "collision/mesh/box_tree.h"
#include "core/base/memory.h"

/* What is so many times as wide as what moves is on the whole would make all of the row near to everything. */
#define WIDE 4.0

void sadmm_box_row_free(struct sadmm_box_row *row)
{
    sadmm_free(row->keys);
    sadmm_free(row->beside);
    sadmm_free(row->out);
    memset(row, 0, sizeof *row);
}

/* Numbers that are in the order of x rounded down. */
static uint32_t rank_of(double x)
{
    struct float_box box;
    uint32_t bits;
    float_box_set(x, x, 0, &box);
    memcpy(&bits, &box.lo[0], sizeof bits);
    return bits & UINT32_C(0x80000000) ? ~bits : bits | UINT32_C(0x80000000);
}

static double width(const struct sadmm_box3 *box, int axis) { return box->hi[axis] - box->lo[axis]; }

/* Is it one of those that are in the row unless they are wide? */
static bool has_box(const struct sadmm_candidates *c, size_t slot)
{
    return (c->state[slot] & SLOT_PRESENT) && !c->boxes[slot].of_plane;
}

/* The axis along which what moves is spread most, and how wide it is along it. False: nothing moves. */
static bool choose_axis(struct sadmm_box_row *row, const struct sadmm_candidates *c, double *wide)
{
    struct sadmm_box3 all = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    double sum[3] = {0, 0, 0};
    size_t count = 0;
    for (size_t slot = 0; slot < c->slot_count; ++slot) {
        const struct sadmm_box3 *box = &c->boxes[slot].box;
        if (!has_box(c, slot) || !c->seen[slot].moves) continue;
        ++count;
        for (int k = 0; k < 3; ++k) {
            sum[k] += width(box, k);
            all.lo[k] = box->lo[k] < all.lo[k] ? box->lo[k] : all.lo[k];
            all.hi[k] = box->hi[k] > all.hi[k] ? box->hi[k] : all.hi[k];
        }
    }
    row->axis = 0;
    for (int k = 1; k < 3; ++k)
        if (width(&all, k) > width(&all, row->axis)) row->axis = k;
    *wide = count > 0 ? WIDE * sum[row->axis] / (double)count : 0;
    return count > 0;
}

static bool reserve(struct sadmm_box_row *row, size_t slots)
{
    return SADMM_GROW(row->keys, 0, 2 * slots) && SADMM_GROW(row->beside, 0, slots) && SADMM_GROW(row->out, 0, slots);
}

bool sadmm_box_row_make(struct sadmm_box_row *row, const struct sadmm_candidates *c)
{
    double wide;
    row->made = false;
    if (!reserve(row, c->slot_count)) return false;
    row->count = row->beside_count = 0;
    row->widest = 0;
    memset(row->out, 0, c->slot_count);
    row->made = true;
    if (!choose_axis(row, c, &wide)) return true;
    for (uint32_t slot = 0; slot < c->slot_count; ++slot) {
        const struct sadmm_box3 *box = &c->boxes[slot].box;
        if (!(c->state[slot] & SLOT_PRESENT)) continue;
        if (!has_box(c, slot) || !(width(box, row->axis) <= wide)) {
            sadmm_box_row_move(row, slot);
            continue;
        }
        if (width(box, row->axis) > row->widest) row->widest = width(box, row->axis);
        row->keys[row->count++] = ordered_key(rank_of(box->lo[row->axis]), slot);
    }
    sadmm_radix_sort(row->keys, row->keys + row->count, row->count, 64);
    return true;
}

void sadmm_box_row_move(struct sadmm_box_row *row, uint32_t slot)
{
    if (row->out[slot]) return;
    row->out[slot] = 1;
    row->beside[row->beside_count++] = slot;
}

void sadmm_box_row_find(const struct sadmm_box_row *row, const struct sadmm_box3 *box, size_t *first, size_t *last)
{
    /* a box that begins with another's end touches it, and a sum may be rounded up */
    const double lo = box->lo[row->axis], low = lo - row->widest - 4 * DBL_EPSILON * (fabs(lo) + row->widest);
    const int64_t count = (int64_t)row->count;
    *first = (size_t)lower_bound(row->keys, count, ordered_key(rank_of(low), 0));
    *last = (size_t)lower_bound(row->keys, count, ordered_key(rank_of(box->hi[row->axis]), UINT32_MAX));
}
