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
 * from the leaves to the root with the inertias A and loads p, then back with the velocities. A row acts on the parent
 * as on a point of its node's body: it needs its Jacobian on that body alone. In double; kernels are compiled once per
 * instruction set (articulation_kernels.h). */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_TREE_H
#define SADMM_CORE_SOLVE_ARTICULATION_TREE_H

#include "core/model/articulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a row is to its node. */
enum articulation_role {
    ARTICULATION_NONE, ARTICULATION_LOCK, ARTICULATION_SOFT, ARTICULATION_HARD, ARTICULATION_LEFT
};

/* Six numbers of a body take eight (core/math/six.h). */
struct articulation_tree_row {
    double own[8];           /* on its node's body */
    double along[6];         /* S^T own^T; of locks 0 */
    double gain, compliance; /* its law; */
    double lo, hi, lambda;   /* its bounds, when the states of rows were found; its multiplier as it was */
    double start, residual;  /* of it, m/s or rad/s: before anything changes; by the changes so far */
    double right, found;     /* the rate past the parent that is asked for; the multiplier's change by this solve */
    int32_t r;               /* of the part */
    uint8_t role;            /* enum articulation_role; of a row outside its bounds NONE */
    uint8_t factored;        /* its state in the factor */
};

/* A hard row along what the locks leave free: a limit that is met, a motor or friction within its bounds. */
struct articulation_hard_row {
    int32_t row;
    double response[6]; /* H g before it was held; g: its direction along S */
    double inverse;     /* of g H g */
};
enum { ARTICULATION_HARD_ROWS = 12 };

struct articulation_node {
    int32_t body, parent;  /* of the part; node, -1: none */
    int32_t first, count;  /* of `joint`: constraints between it and its parent, or what is not solved for */
    int32_t row, row_end;  /* of `row` */
    bool bound;            /* there are any */
    int32_t free;          /* directions */
    int32_t locks[2], lock[6]; /* rows that lock translations, then rotations; */
    int32_t acting;            /* how many do not */
    int32_t soft, hard_rows;
    double offset[4];      /* from the parent's centre of mass */
    double A[6][8], S[6][8], U[6][8], H[6][6]; /* S, U: a direction after the other */
    double load[8], velocity[8], total[8], met[8], q[6]; /* p, v, that of all solves so far, s, q */
    struct articulation_hard_row hard[ARTICULATION_HARD_ROWS];
};

struct articulation_tree {
    int32_t nodes;                  /* 0: it is no tree */
    int32_t depth;                  /* nodes from a leaf to the root, at most */
    struct articulation_node *node; /* leaves first */
    int32_t *node_of;               /* (bodies) */
    int32_t *joint;                 /* (columns) 2 column + side of the node's body */
    struct articulation_tree_row *row; /* by nodes */
    int32_t rows;
    int32_t *row_of;                /* (rows of the part) -> `row` */
    int32_t *acting;                /* rows that are no locks; a node's from its `row` on; */
    int32_t *soft;                  /* those inside their bounds by a law with compliance, likewise */
    bool known;                     /* the factor is that of `factored` */
    bool pressed;                   /* a row outside its bounds has a load that it had not when it was loaded */
    bool refined;                   /* the rates that rows ask for are those of a refinement */
    bool unsettled;                 /* by the last solve a row may belong into another state than it is in */
};

/* Its nodes, if it is one. `queue`, `parent`: bodies of the part. All arrays have room. */
void sadmm_articulation_tree_make(const struct articulation_structure *s, int32_t *queue, int32_t *parent,
                                  struct articulation_tree *tree);

/* This call's rows and loads: v->residual = b - A v + J^T lambda + impulse. slots: as of sadmm_articulations_solve.
 * rows: of the system, to v->rows; NULL: they are there. impulse (bodies x 6): of contacts, then J^T lambda besides.
 * without (bodies x 6): b, then the residual without contacts. False, and both are what they were: the tree cannot
 * solve them. Rows are no wrenches at points of space (gears), or locks are not those of one joint. */
typedef bool sadmm_articulation_tree_load(struct articulation_tree *tree, const struct articulation_view *v,
                                          const struct sadmm_row_constraint *slots, const struct sadmm_rows *rows,
                                          double *impulse, double *without);

/* With rows in their states, inertias in v->factor; nothing where it is known for these. */
typedef void sadmm_articulation_tree_factorize(struct articulation_tree *tree, const struct articulation_view *v);

/* Changes of the velocities, and of the multipliers of rows inside their bounds, for loads v->residual and what the
 * other rows are. again: from what they are, by what is left (iterative refinement). Returns the largest residual of a
 * row inside its bounds, m/s or rad/s. */
typedef double sadmm_articulation_tree_solve(struct articulation_tree *tree, const struct articulation_view *v,
                                             bool again);

/* The node whose joint has row r. */
int32_t sadmm_articulation_tree_node(const struct articulation_tree *tree, const struct articulation_view *v,
                                     int32_t r);

#ifdef __cplusplus
}
#endif
#endif
