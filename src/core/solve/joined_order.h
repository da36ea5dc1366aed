/* The order and the structure of a sparse Cholesky factor whose blocks are constraints, coupled where they have a body
 * in common. */
#ifndef SADMM_CORE_SOLVE_JOINED_ORDER_H
#define SADMM_CORE_SOLVE_JOINED_ORDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Places are the order of elimination. A node is a block of the factor: place j its diagonal one, count + b the b-th
 * below the diagonal. All lists ascend, and every sum goes along one. */
struct sadmm_joined_order {
    int32_t count;             /* places: constraints that are solved directly */
    int32_t blocks;            /* below the diagonal */
    int32_t levels;            /* places of a level are not coupled: [first_of_level[l], first_of_level[l + 1]) */
    int32_t *constraint;       /* (count) */
    int32_t *first_of_level;   /* (levels + 1) */
    int32_t *first_below;      /* (count + 1) place of a column -> its blocks */
    int32_t *row, *column;     /* (blocks) places */
    int32_t *first_update;     /* (count + blocks + 1) node -> what is taken from it: L_u L_w^T */
    int32_t *update;           /* 2 each: blocks u, w; those of a diagonal node are its row's blocks, u = w */
    void *memory;
};

/* bodies: two a constraint, < 0: not solved for. Constraints that are not to be solved directly are not in the order:
 * those at a body of more than `most_around`. false: no memory, nothing has changed. */
bool sadmm_joined_order_make(struct sadmm_joined_order *order, const int32_t *bodies, int32_t constraints,
                             int32_t body_count, int32_t most_around);
void sadmm_joined_order_free(struct sadmm_joined_order *order);

#endif
