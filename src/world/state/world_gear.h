/* Gears of a world, in slots. */
#ifndef SADMM_WORLD_STATE_WORLD_GEAR_H
#define SADMM_WORLD_STATE_WORLD_GEAR_H

#include "links.h"
#include "subadmm/gear.h"

/* A gear slot. */
struct sadmm_world_gear {
    sadmm_gear_def def;
    size_t joint[2]; /* slots */
    struct sadmm_link on_joint[2]; /* their names: 2 x slot + side + 1 */
    bool acts;       /* it has a row in the (sub-)step at hand */
    struct { double force; } last, next; /* along the first coordinate, of the last step and of the one at hand */
    bool dirty;      /* its being enabled was set, and no step has taken that along yet; set_at: as in a body */
    int64_t set_at;
};

#endif
