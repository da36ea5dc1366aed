/* What the host's test of a pair of boxes needs of a shape, side by side: bounds.h tests the same, axis by axis. */
#ifndef SADMM_COLLISION_BROAD_SWEPT_BOX_H
#define SADMM_COLLISION_BROAD_SWEPT_BOX_H

#include <stdbool.h>

#include "collision/base/bounds.h"
#include "collision/base/row3.h"

/* Rows of three, one after the other; a row is read with what follows it (row3.h). */
struct sadmm_swept_box {
    struct sadmm_box3 box, still; /* still: without its sweep */
    double sweep[3];
    int64_t of_plane; /* planes have no box */
};

SADMM_INLINE void swept_box_make(const double velocity[3], double dt, struct sadmm_swept_box *s)
{
    int k;
    for (k = 0; k < 3; ++k) {
        s->sweep[k] = velocity[k] * dt;
        s->still.lo[k] = s->box.lo[k] - downward(s->sweep[k]);
        s->still.hi[k] = s->box.hi[k] - upward(s->sweep[k]);
    }
}

/* boxes_overlap and boxes_meet, all axes at once and without a branch. */
SADMM_INLINE bool swept_boxes_meet(const struct sadmm_swept_box *a, const struct sadmm_swept_box *b)
{
    const row3 way = r3_sub(r3_load(b->sweep), r3_load(a->sweep)),
               highest = r3_add(r3_load(b->still.hi), r3_upward(way)),
               lowest = r3_add(r3_load(b->still.lo), r3_downward(way));
    return (r3_not_above(r3_load(a->box.lo), r3_load(b->box.hi)) &
            r3_not_above(r3_load(b->box.lo), r3_load(a->box.hi)) & r3_not_above(r3_load(a->still.lo), highest) &
            r3_not_above(lowest, r3_load(a->still.hi))) == 7;
}

#endif
