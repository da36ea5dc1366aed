/* The order and the structure of sparse factors L D L^T whose blocks are constraints, coupled where they have a body
 * in common: a factor a part (core/model/articulation.h). */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_ORDER_H
#define SADMM_CORE_SOLVE_ARTICULATION_ORDER_H

#include "core/model/articulation.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_articulation_order {
    int32_t parts;
    size_t *first;    /* (parts + 1) where a part's structure begins in */
    int32_t *numbers; /* structures */
};

/* bodies: two a constraint, < 0: not solved for. Left out, so that the iteration alone solves them, are constraints of
 * no body, and parts that have more than `most_around` of them at a body, are large or whose factor fills up. False:
 * no memory, nothing has changed. */
bool sadmm_articulation_order_make(struct sadmm_articulation_order *order, const int32_t *bodies, int32_t constraints,
                                   int32_t body_count, int32_t most_around);
void sadmm_articulation_order_free(struct sadmm_articulation_order *order);

static inline struct articulation_structure sadmm_articulation_part(const struct sadmm_articulation_order *order,
                                                                    int32_t part)
{
    return articulation_structure_at(order->numbers + order->first[part]);
}

#ifdef __cplusplus
}
#endif
#endif
