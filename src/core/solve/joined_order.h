/* The order and the structure of sparse factors L D L^T whose blocks are constraints, coupled where they have a body
 * in common: a factor a part (core/model/joined.h). */
#ifndef SADMM_CORE_SOLVE_JOINED_ORDER_H
#define SADMM_CORE_SOLVE_JOINED_ORDER_H

#include "core/model/joined.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_joined_order {
    int32_t parts;
    size_t *first;    /* (parts + 1) where a part's structure begins in */
    int32_t *numbers; /* structures */
    size_t numbers_capacity;
};

/* bodies: two a constraint, < 0: not solved for. Left out, so that the iteration alone solves them, are constraints of
 * no body, and parts that have more than `most_around` of them at a body, are large or whose factor fills up. False:
 * no memory, nothing has changed. */
bool sadmm_joined_order_make(struct sadmm_joined_order *order, const int32_t *bodies, int32_t constraints,
                             int32_t body_count, int32_t most_around);
void sadmm_joined_order_free(struct sadmm_joined_order *order);

static inline struct joined_structure sadmm_joined_part(const struct sadmm_joined_order *order, int32_t part)
{
    return joined_structure_at(order->numbers + order->first[part]);
}

#ifdef __cplusplus
}
#endif
#endif
