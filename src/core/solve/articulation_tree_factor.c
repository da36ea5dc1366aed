/* The factor of a tree, from the leaves to the root (articulation_tree.h). */
#include <math.h>
#include <string.h>

#include "articulation_tree_rows.h"

/* Of a hard row's response without others, the share under which it says what they say: far above rounding, far below
 * what is left of a row by others that are not along it. */
static const double DEPENDENT = 1e-10;

/* What rows that are no locks are, in their states. */
static void find_roles(const struct articulation_tree *tree, struct articulation_node *node,
                       const struct articulation_view *v)
{
    node->soft_end = node->soft;
    EACH_TREE_ROW(tree, v, node, r) {
        if (tree->role[r] == ARTICULATION_LOCK) continue;
        if (v->state[r] != ROW_INSIDE) tree->role[r] = ARTICULATION_NONE;
        else tree->role[r] = v->rows[r].compliance > 0 ? ARTICULATION_SOFT : ARTICULATION_HARD;
        if (tree->role[r] == ARTICULATION_SOFT) tree->soft[node->soft_end++] = r;
    }
}

/* H = D^-1 by L D L^T, of which the lower half of `D` is read. */
static void invert(int n, double D[6][6], double H[6][6])
{
    double inverse[6];
    if (n == 1) {
        H[0][0] = D[0][0] > 0 ? 1 / D[0][0] : 0;
        return;
    }
    for (int k = 0; k < n; ++k) {
        inverse[k] = D[k][k] > 0 ? 1 / D[k][k] : 0;
        for (int i = k + 1; i < n; ++i) {
            const double entry = D[i][k], share = entry * inverse[k];
            for (int j = k + 1; j < i; ++j) D[i][j] -= entry * D[j][k];
            D[i][i] -= entry * share;
            D[i][k] = share;
        }
    }
    for (int c = 0; c < n; ++c) {
        double x[6] = {0};
        x[c] = 1;
        for (int i = c + 1; i < n; ++i)
            for (int j = c; j < i; ++j) x[i] -= D[i][j] * x[j];
        for (int i = c; i < n; ++i) x[i] *= inverse[i];
        for (int i = n - 1; i >= 0; --i)
            for (int j = i + 1; j < n; ++j) x[i] -= D[j][i] * x[j];
        for (int i = 0; i < n; ++i) H[i][c] = x[i];
    }
}

/* A hard row leaves its direction out of H. */
static void hold(const struct articulation_tree *tree, struct articulation_node *node, int32_t r, double alone)
{
    const double *g = tree->direction + 6 * r;
    struct articulation_hard_row *hard = &node->hard[node->hard_rows];
    double response = 0;
    const int n = node->free;
    for (int i = 0; i < n; ++i) {
        hard->response[i] = 0;
        for (int j = 0; j < n; ++j) hard->response[i] += node->H[i][j] * g[j];
        response += g[i] * hard->response[i];
    }
    if (!(response > DEPENDENT * alone) || node->hard_rows == ARTICULATION_HARD_ROWS) {
        tree->role[r] = ARTICULATION_LEFT; /* others say it */
        return;
    }
    hard->r = r;
    hard->inverse = 1 / response;
    ++node->hard_rows;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) node->H[i][j] -= hard->response[i] * hard->response[j] * hard->inverse;
}

static double response_along(const struct articulation_node *node, const double *g)
{
    double sum = 0;
    for (int i = 0; i < node->free; ++i)
        for (int j = 0; j < node->free; ++j) sum += g[i] * node->H[i][j] * g[j];
    return sum;
}

static void hold_hard_rows(const struct articulation_tree *tree, struct articulation_node *node,
                           const struct articulation_view *v)
{
    double alone[ARTICULATION_HARD_ROWS];
    int count = 0, k = 0;
    node->hard_rows = 0;
    EACH_TREE_ROW(tree, v, node, r) {
        if (tree->role[r] == ARTICULATION_HARD && count < ARTICULATION_HARD_ROWS)
            alone[count++] = response_along(node, tree->direction + 6 * r);
    }
    if (count == 0) return;
    EACH_TREE_ROW(tree, v, node, r) {
        if (tree->role[r] == ARTICULATION_HARD) {
            hold(tree, node, r, k < count ? alone[k] : HUGE_VAL);
            ++k;
        }
    }
}

static void add_soft_rows(const struct articulation_tree *tree, const struct articulation_node *node,
                          const struct articulation_view *v, double D[6][6])
{
    for (int32_t at = node->soft; at < node->soft_end; ++at) {
        const int32_t r = tree->soft[at];
        const double *g = tree->direction + 6 * r, stiffness = v->rows[r].gain / v->rows[r].compliance;
        for (int i = 0; i < node->free; ++i)
            for (int j = 0; j <= i; ++j) D[i][j] += stiffness * g[i] * g[j];
    }
}

/* A_parent += X^T M X of the inertia M that its node hands on. */
static void add_shifted(const double M[6][6], const double r[3], double to[6][6])
{
    double B[3][3]; /* M_lw - M_ll [r]x */
    for (int i = 0; i < 3; ++i) {
        B[i][0] = M[i][3] - (M[i][1] * r[2] - M[i][2] * r[1]);
        B[i][1] = M[i][4] - (M[i][2] * r[0] - M[i][0] * r[2]);
        B[i][2] = M[i][5] - (M[i][0] * r[1] - M[i][1] * r[0]);
    }
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        for (int c = 0; c < 3; ++c) {
            to[i][c] += M[i][c];
            to[i][3 + c] += B[i][c];
            to[3 + c][i] += B[i][c];
        }
        /* M_ww - M_wl [r]x + [r]x B */
        const double *wl = M[3 + i];
        to[3 + i][3] += wl[3] - (wl[1] * r[2] - wl[2] * r[1]) + (r[j] * B[k][0] - r[k] * B[j][0]);
        to[3 + i][4] += wl[4] - (wl[2] * r[0] - wl[0] * r[2]) + (r[j] * B[k][1] - r[k] * B[j][1]);
        to[3 + i][5] += wl[5] - (wl[0] * r[1] - wl[1] * r[0]) + (r[j] * B[k][2] - r[k] * B[j][2]);
    }
}

/* What its node hands on: A - U H U^T. */
static void hand_on_inertia(const struct articulation_node *node, struct articulation_node *parent)
{
    double M[6][6];
    memcpy(M, node->A, sizeof M);
    for (int i = 0; i < node->free; ++i) {
        double HU[6] = {0};
        for (int j = 0; j < node->free; ++j)
            for (int c = 0; c < 6; ++c) HU[c] += node->H[i][j] * node->U[j][c];
        for (int row = 0; row < 6; ++row)
            for (int c = 0; c < 6; ++c) M[row][c] -= node->U[i][row] * HU[c];
    }
    add_shifted(M, node->offset, parent->A);
}

static void factorize_node(const struct articulation_tree *tree, struct articulation_node *node,
                           const struct articulation_view *v)
{
    double D[6][6];
    find_roles(tree, node, v);
    for (int i = 0; i < node->free; ++i) {
        for (int k = 0; k < 6; ++k) node->U[i][k] = six_product(node->A[k], node->S[i]);
        for (int j = 0; j <= i; ++j) D[i][j] = six_product(node->S[j], node->U[i]);
    }
    add_soft_rows(tree, node, v, D);
    invert(node->free, D, node->H);
    hold_hard_rows(tree, node, v);
    if (node->parent >= 0 && node->bound) hand_on_inertia(node, &tree->node[node->parent]);
}

static bool same_states(const struct articulation_tree *tree, const struct articulation_view *v)
{
    int changed = 0;
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r)
        changed |= (tree->factored[r] == ROW_INSIDE) ^ (v->state[r] == ROW_INSIDE);
    return !changed;
}

void sadmm_articulation_tree_factorize(struct articulation_tree *tree, const struct articulation_view *v)
{
    if (tree->known && same_states(tree, v)) return;
    memcpy(tree->factored, v->state, (size_t)(SADMM_MAX_ROWS * v->s.columns));
    tree->known = true;
    for (int32_t n = 0; n < tree->nodes; ++n) {
        struct articulation_node *node = &tree->node[n];
        const double *A = v->factor + 36 * (size_t)node->body;
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j <= i; ++j) node->A[i][j] = node->A[j][i] = A[6 * i + j];
    }
    for (int32_t n = 0; n < tree->nodes; ++n) factorize_node(tree, &tree->node[n], v);
}
