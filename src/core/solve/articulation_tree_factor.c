/* The factor of a tree, from the leaves to the root (articulation_tree.h). */
#include <math.h>
#include <string.h>

#include "articulation_kernels.h"
#include "core/math/six.h"

/* Of a hard row's response without others, the share under which it says what they say: far above rounding, far below
 * what is left of a row by others that are not along it. */
static const double DEPENDENT = 1e-10;

/* What rows that are no locks are, in their states. Returns how many are hard. */
static int find_roles(const struct articulation_tree *tree, struct articulation_node *node,
                      const struct articulation_view *v)
{
    int hard = 0;
    node->soft = node->hard_rows = 0;
    for (int32_t k = node->row; k < node->row + node->acting; ++k) {
        const int32_t at = tree->acting[k];
        struct articulation_tree_row *row = &tree->row[at];
        row->factored = v->state[row->r];
        if (row->factored != ROW_INSIDE) row->role = ARTICULATION_NONE;
        else if (row->compliance > 0) {
            row->role = ARTICULATION_SOFT;
            tree->soft[node->row + node->soft++] = at;
        } else {
            row->role = ARTICULATION_HARD;
            ++hard;
        }
    }
    return hard;
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
        for (int i = n - 1; i >= c; --i)
            for (int j = i + 1; j < n; ++j) x[i] -= D[j][i] * x[j];
        for (int i = c; i < n; ++i) H[i][c] = H[c][i] = x[i];
    }
}

static double response_along(const struct articulation_node *node, const double *g)
{
    double sum = 0;
    for (int i = 0; i < node->free; ++i)
        for (int j = 0; j < node->free; ++j) sum += g[i] * node->H[i][j] * g[j];
    return sum;
}

/* A hard row leaves its direction out of H. alone: its response without others. */
static void hold(const struct articulation_tree *tree, struct articulation_node *node, int32_t at, double alone)
{
    struct articulation_tree_row *row = &tree->row[at];
    struct articulation_hard_row *hard = &node->hard[node->hard_rows];
    double response = 0;
    const int n = node->free;
    const bool room = node->hard_rows < ARTICULATION_HARD_ROWS;
    for (int i = 0; room && i < n; ++i) {
        hard->response[i] = 0;
        for (int j = 0; j < n; ++j) hard->response[i] += node->H[i][j] * row->along[j];
        response += row->along[i] * hard->response[i];
    }
    if (!(response > DEPENDENT * alone)) {
        row->role = ARTICULATION_LEFT; /* others say it */
        row->found = 0;
        return;
    }
    hard->row = at;
    hard->inverse = 1 / response;
    ++node->hard_rows;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) node->H[i][j] -= hard->response[i] * hard->response[j] * hard->inverse;
}

static void hold_hard_rows(const struct articulation_tree *tree, struct articulation_node *node)
{
    double alone[ARTICULATION_HARD_ROWS];
    int count = 0, k = 0;
    const int32_t *acting = tree->acting + node->row;
    for (int32_t i = 0; i < node->acting && count < ARTICULATION_HARD_ROWS; ++i)
        if (tree->row[acting[i]].role == ARTICULATION_HARD)
            alone[count++] = response_along(node, tree->row[acting[i]].along);
    for (int32_t i = 0; i < node->acting; ++i) {
        if (tree->row[acting[i]].role != ARTICULATION_HARD) continue;
        hold(tree, node, acting[i], k < count ? alone[k] : HUGE_VAL);
        ++k;
    }
}

static void add_soft_rows(const struct articulation_tree *tree, const struct articulation_node *node, double D[6][6])
{
    for (int32_t at = node->row; at < node->row + node->soft; ++at) {
        const struct articulation_tree_row *row = &tree->row[tree->soft[at]];
        const double *g = row->along, stiffness = row->gain / row->compliance;
        for (int i = 0; i < node->free; ++i)
            for (int j = 0; j <= i; ++j) D[i][j] += stiffness * g[i] * g[j];
    }
}

/* A_parent += X^T M X of the inertia M = A - U H U^T that its node hands on. */
static void hand_on_inertia(const struct articulation_node *node, struct articulation_node *parent)
{
    const three r = *(const three *)node->offset;
    six M[6];
    for (int k = 0; k < 6; ++k) M[k] = six_at(node->A[k]);
    for (int i = 0; i < node->free; ++i) {
        six HU = six_zero();
        for (int j = 0; j < node->free; ++j) HU = six_madd(HU, node->H[i][j], six_at(node->U[j]));
        for (int k = 0; k < 6; ++k) M[k] = six_madd(M[k], -node->U[i][k < 3 ? k : k + 1], HU);
    }
    for (int k = 0; k < 6; ++k) M[k].angular += three_cross(r, M[k].linear); /* M X */
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        M[3 + k] = six_madd(six_madd(M[3 + k], r[i], M[j]), -r[j], M[i]);
    }
    for (int k = 0; k < 6; ++k) six_put(six_add(six_at(parent->A[k]), M[k]), parent->A[k]);
}

static void factorize_node(const struct articulation_tree *tree, struct articulation_node *node,
                           const struct articulation_view *v)
{
    double D[6][6];
    const int hard = find_roles(tree, node, v);
    for (int i = 0; i < node->free; ++i) {
        six_put(six_add_product(six_zero(), 1, node->A, node->S[i]), node->U[i]);
        for (int j = 0; j <= i; ++j) D[i][j] = six_dot(six_at(node->S[j]), six_at(node->U[i]));
    }
    add_soft_rows(tree, node, D);
    invert(node->free, D, node->H);
    if (hard > 0) hold_hard_rows(tree, node);
    if (node->parent >= 0 && node->bound) hand_on_inertia(node, &tree->node[node->parent]);
}

static bool same_states(const struct articulation_tree *tree, const struct articulation_view *v)
{
    int changed = 0;
    for (int32_t n = 0; n < tree->nodes; ++n)
        for (int32_t k = tree->node[n].row; k < tree->node[n].row + tree->node[n].acting; ++k) {
            const struct articulation_tree_row *row = &tree->row[tree->acting[k]];
            changed |= (row->factored == ROW_INSIDE) ^ (v->state[row->r] == ROW_INSIDE);
        }
    return !changed;
}

void SADMM_KERNEL(articulation_tree_factorize)(struct articulation_tree *tree,
                                               const struct articulation_view *v)
{
    if (tree->known && same_states(tree, v)) return;
    tree->known = true;
    for (int32_t n = 0; n < tree->nodes; ++n) {
        struct articulation_node *node = &tree->node[n];
        const double *A = v->factor + 36 * (size_t)node->body;
        for (int i = 0; i < 6; ++i) six_put(six_load(A + 6 * i), node->A[i]);
    }
    for (int32_t n = 0; n < tree->nodes; ++n) factorize_node(tree, &tree->node[n], v);
}
