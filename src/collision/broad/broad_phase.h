/* Broad phases behind one small table: which boxes of the same group overlap.
 *
 * An entry is a box by shape slot. Two entries meet when their boxes overlap (touching counts), at least one of them is
 * dynamic (`moves`), and they belong to the same group; group -1 (never of a dynamic one) meets every group. Every
 * broad phase reports the same set, each pair once, in any order; the caller sorts.
 */
#ifndef SADMM_COLLISION_BROAD_BROAD_PHASE_H
#define SADMM_COLLISION_BROAD_BROAD_PHASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"
#include "collision/base/bounds.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_broad_entry {
    struct sadmm_box3 box;
    int32_t group;
    bool present, moves;
};

/* Pairs found, as (low slot << 32) | high slot. */
struct sadmm_pair_list {
    uint64_t *keys;
    size_t count;
};

struct sadmm_broad_phase; /* a kind's own */

struct sadmm_broad_phase_kind {
    const char *name;
    sadmm_status (*create)(struct sadmm_broad_phase **out, struct sadmm_error *error);
    void (*destroy)(struct sadmm_broad_phase *);
    /* Take over the entries of the `changed` slots (added, removed, moved, regrouped). After a failure the broad phase
     * is empty and wants every present slot again. */
    sadmm_status (*update)(struct sadmm_broad_phase *, const struct sadmm_broad_entry *entries, size_t entry_count,
                           const uint32_t *changed, size_t changed_count, struct sadmm_error *error);
    /* Append every pair. `entries` as in the last update. */
    sadmm_status (*pairs)(struct sadmm_broad_phase *, const struct sadmm_broad_entry *entries, size_t entry_count,
                          struct sadmm_pair_list *list, struct sadmm_error *error);
    /* (optional) Append every pair of the given slots; a pair of two of them may come twice. */
    sadmm_status (*pairs_of)(struct sadmm_broad_phase *, const struct sadmm_broad_entry *entries, size_t entry_count,
                             const uint32_t *slots, size_t slot_count, struct sadmm_pair_list *list,
                             struct sadmm_error *error);
};

extern const struct sadmm_broad_phase_kind sadmm_broad_phase_sweep;
extern const struct sadmm_broad_phase_kind sadmm_broad_phase_fcl; /* only in builds with FCL */

/* Append one pair; false when out of memory. */
bool sadmm_pair_list_add(struct sadmm_pair_list *list, uint32_t a, uint32_t b);

#ifdef __cplusplus
}
#endif
#endif
