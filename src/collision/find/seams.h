/* Which shapes are neighbours at seams (seam.h), found when shapes change. */
#ifndef SADMM_COLLISION_FIND_SEAMS_H
#define SADMM_COLLISION_FIND_SEAMS_H

#include "collision/shapes/input.h"
#include "seam.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_seams {
    uint32_t *first;                   /* slots + 1, where `neighbour_count` is not 0 */
    struct seam_neighbour *neighbours; /* of a slot by lo along its seam_axis, then by slot */
    size_t slot_count, neighbour_count;
    struct seam_entry *entries; /* scratch */
    uint64_t disabled; /* of which pairs of bodies the neighbours know that they do not meet */
};

/* Find the neighbours. changed: a shape has, or what is on a body that does not move has been set; else what is known
 * is kept where it can be. False: out of memory, and what is known is not kept. */
bool sadmm_seams_find(struct sadmm_seams *seams, const struct sadmm_collision_input *input, bool changed);
void sadmm_seams_free(struct sadmm_seams *seams);

/* As contact finding reads them. */
static inline struct seam_view sadmm_seams_view(const struct sadmm_seams *seams)
{
    const struct seam_view none = {NULL, NULL}, view = {seams->first, seams->neighbours};
    return seams->neighbour_count > 0 ? view : none;
}

#ifdef __cplusplus
}
#endif
#endif
