/* The order and the structure of a sparse Cholesky factor whose blocks are constraints, coupled where they have a body
 * in common (core/model/joined.h). */
#ifndef SADMM_CORE_SOLVE_JOINED_ORDER_H
#define SADMM_CORE_SOLVE_JOINED_ORDER_H

#include "core/model/joined.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_joined_order {
    struct joined_structure s;
    int32_t *memory; /* all arrays of it */
    size_t size;     /* numbers there */
};

/* bodies: two a constraint, < 0: not solved for. Left out, so that the iteration alone solves them, are constraints of
 * no body, those at a body that has more than `most_around`, and parts of thousands. False: no memory, nothing has
 * changed. */
bool sadmm_joined_order_make(struct sadmm_joined_order *order, const int32_t *bodies, int32_t constraints,
                             int32_t body_count, int32_t most_around);
void sadmm_joined_order_free(struct sadmm_joined_order *order);

#ifdef __cplusplus
}
#endif
#endif
