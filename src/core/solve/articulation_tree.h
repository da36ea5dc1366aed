/* The block direct solve of an articulation that is a tree: Featherstone's articulated bodies (Rigid Body Dynamics
 * Algorithms, 2008, chapter 7), in velocities of the bodies. Work and memory grow with the bodies, nothing fills in,
 * and locks need no regularisation.
 *
 * A node is a body with the joint to its parent, which is nearer to the root. What the joint locks leaves free
 * directions S of the motion past the parent:
 *
 *     v = X v_parent + S q + s         X: rigidly along with the parent; s: what meets the locks
 *     D q = S^T (p - A (X v_parent + s)) + the laws of other rows        D = S^T A S + those laws; H: its inverse, with
 *                                                                        what hard rows hold left out
 *     A_parent += X^T (A - U H U^T) X,   p_parent += X^T (p - A s - U q)        U = A S
 *
 * from the leaves to the root with the inertias A and loads p, then back with the velocities. In double. */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_TREE_H
#define SADMM_CORE_SOLVE_ARTICULATION_TREE_H

#include "core/model/articulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A hard row along what the locks leave free: a limit that is met, a motor or friction within its bounds. */
struct articulation_hard_row {
    int32_t r;
    double response[6]; /* H g before it was held; g: its direction along S */
    double inverse;     /* of g H g */
};
enum { ARTICULATION_HARD_ROWS = 12 };

struct articulation_node {
    int32_t body, parent;  /* of the part; node, -1: none */
    int32_t first, count;  /* of `joint`: constraints between it and its parent, or what is not solved for */
    bool bound;            /* they have rows */
    int32_t free;          /* directions */
    int32_t locks[2], lock[6]; /* rows that lock translations, then rotations */
    int32_t soft, soft_end; /* of `soft` */
    int32_t hard_rows;
    double offset[3];      /* from the parent's centre of mass */
    double A[6][6], S[6][6], U[6][6], H[6][6]; /* S, U: a direction after the other */
    double load[6], velocity[6], met[6], q[6]; /* p, v, s, q */
    struct articulation_hard_row hard[ARTICULATION_HARD_ROWS];
};

/* What a row is to its node. */
enum articulation_role {
    ARTICULATION_NONE, ARTICULATION_LOCK, ARTICULATION_SOFT, ARTICULATION_HARD, ARTICULATION_LEFT
};

struct articulation_tree {
    int32_t nodes;                  /* 0: it is no tree */
    int32_t depth;                  /* nodes from a leaf to the root, at most */
    struct articulation_node *node; /* leaves first */
    int32_t *node_of;               /* (bodies) */
    int32_t *joint;                 /* (columns) 2 column + side of the node's body */
    int32_t *soft;                  /* rows that act along free directions by a law with compliance, by nodes */
    double *total;                  /* (bodies x 6) velocities with their changes so far */
    uint8_t *role;                  /* (rows) enum articulation_role */
    uint8_t *own;                   /* (rows) side of the node's body */
    uint8_t *factored;              /* (rows) their states in the factor, where it is known */
    bool known;
    double *direction;              /* (rows x 6) S^T J^T */
};

/* Its nodes, if it is one. `queue`, `parent`: bodies of the part. All arrays have room. */
void sadmm_articulation_tree_make(const struct articulation_structure *s, int32_t *queue, int32_t *parent,
                                  struct articulation_tree *tree);

/* Of this call's rows. slots: as of sadmm_articulations_solve. False: the tree cannot solve them. Rows are no wrenches
 * at points of space (gears), or locks are not those of one joint. */
bool sadmm_articulation_tree_begin(struct articulation_tree *tree, const struct articulation_view *v,
                                   const struct sadmm_row_constraint *slots);

/* With rows in their states, inertias in v->factor; nothing where it is known for these. */
void sadmm_articulation_tree_factorize(struct articulation_tree *tree, const struct articulation_view *v);

/* Is row r inside its bounds, but without a multiplier of its own, since others say what it says? */
static inline bool sadmm_articulation_tree_leaves(const struct articulation_tree *tree,
                                                  const struct articulation_view *v, int32_t r)
{
    return v->state[r] == ROW_INSIDE && tree->role[r] == ARTICULATION_LEFT;
}

/* Changes of the velocities, and of the multipliers of rows inside their bounds, for loads v->residual and what the
 * other rows are. again: from what they are, by what is left (iterative refinement). */
void sadmm_articulation_tree_solve(const struct articulation_tree *tree, const struct articulation_view *v, bool again);

/* The node whose joint has row r. */
int32_t sadmm_articulation_tree_node(const struct articulation_tree *tree, const struct articulation_view *v,
                                     int32_t r);

/* The largest residual of a row inside its bounds after that, m/s or rad/s. */
double sadmm_articulation_tree_residual(const struct articulation_tree *tree, const struct articulation_view *v);

/* A load on its way to the root, at a node. load (6): on its body, with what its child has handed on; then what it
 * hands on to its parent. along: what acts along S besides, NULL: nothing does. z, response: S^T p, and H S^T p. */
void sadmm_articulation_tree_pass(const struct articulation_node *node, double load[6], const double *along,
                                  double z[6], double response[6]);

#ifdef __cplusplus
}
#endif
#endif
