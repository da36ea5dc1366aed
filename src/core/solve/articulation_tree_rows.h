/* Rows of a tree's nodes, for the files that make its factor and solve with it. */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_TREE_ROWS_H
#define SADMM_CORE_SOLVE_ARTICULATION_TREE_ROWS_H

#include "articulation_tree.h"

/* Rows r of a node's joint. */
#define EACH_TREE_ROW(tree, v, node, r)                                                                              \
    for (int32_t j_ = (node)->first; j_ < (node)->first + (node)->count; ++j_)                                       \
        for (int32_t r = SADMM_MAX_ROWS * ((tree)->joint[j_] / 2), last_ = r + SADMM_MAX_ROWS;                       \
             r < last_ && (v)->state[r] != ROW_ABSENT; ++r)

/* A row on its node's body; the i-th that locks a translation (kind 0) or a rotation. */
static inline const double *tree_own_row(const struct articulation_tree *tree, const struct articulation_view *v,
                                         int32_t r)
{
    return v->rows[r].jacobian[tree->own[r]];
}
static inline const double *tree_lock_row(const struct articulation_tree *tree, const struct articulation_node *node,
                                          const struct articulation_view *v, int kind, int i)
{
    return tree_own_row(tree, v, node->lock[3 * kind + i]);
}

#endif
