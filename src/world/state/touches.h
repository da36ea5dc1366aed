/* What touches what. */
#ifndef SADMM_WORLD_STATE_TOUCHES_H
#define SADMM_WORLD_STATE_TOUCHES_H

#include "subadmm/types.h"

/* Two shapes that touch, or a sensor and what it sees. */
struct sadmm_touch {
    sadmm_shape_id a, b;
    sadmm_body_id body_a, body_b;
    size_t pair; /* one of theirs in the step's contacts */
};

/* By slots of a, then of b. */
struct sadmm_touches {
    struct sadmm_touch *list;
    size_t count;
};

#endif
