#include "articulation_tree.h"

#include <math.h>
#include <string.h>

#include "articulation_tree_rows.h"
#include "core/math/array3.h"

/* y += sign A x, A symmetric. */
static void add_product(const double A[6][6], double sign, const double x[6], double y[6])
{
    for (int k = 0; k < 6; ++k)
        for (int c = 0; c < 6; ++c) y[c] += sign * A[k][c] * x[k];
}

/* X v of a parent's velocity; p_parent += X^T p. */
static void carry(const double r[3], const double v[6], double to[6])
{
    memcpy(to, v, 6 * sizeof *to);
    add_cross(v + 3, r, 1, to);
}
static void add_load(const double r[3], const double p[6], double to[6])
{
    for (int k = 0; k < 6; ++k) to[k] += p[k];
    add_cross(r, p, 1, to + 3);
}

/* s, which meets the locks: a target each is in v->right. */
static void meet_locks(const struct articulation_tree *tree, struct articulation_node *node,
                       const struct articulation_view *v)
{
    double *s = node->met;
    memset(s, 0, 6 * sizeof *s);
    for (int i = 0; i < node->locks[1]; ++i) {
        const double *row = tree_lock_row(tree, node, v, 1, i), target = v->right[node->lock[3 + i]];
        for (int k = 3; k < 6; ++k) s[k] += target * row[k];
    }
    for (int i = 0; i < node->locks[0]; ++i) {
        const double *row = tree_lock_row(tree, node, v, 0, i), target = v->right[node->lock[i]] - dot3(row + 3, s + 3);
        for (int k = 0; k < 3; ++k) s[k] += target * row[k];
    }
}

static double along(const struct articulation_node *node, const double *g, const double *q)
{
    double sum = 0;
    for (int i = 0; i < node->free; ++i) sum += g[i] * q[i];
    return sum;
}

/* q = H t, and what hard rows ask for beside it. */
static void find_free(const struct articulation_tree *tree, const struct articulation_node *node,
                      const struct articulation_view *v, const double t[6], double q[6])
{
    for (int i = 0; i < node->free; ++i) {
        q[i] = 0;
        for (int j = 0; j < node->free; ++j) q[i] += node->H[i][j] * t[j];
    }
    double held[6] = {0};
    for (int h = 0; h < node->hard_rows; ++h) {
        const struct articulation_hard_row *hard = &node->hard[h];
        const int32_t r = hard->r;
        const double *row = tree_own_row(tree, v, r);
        const double missing =
            (v->right[r] - six_product(row, node->met) - along(node, tree->direction + 6 * r, held)) * hard->inverse;
        for (int i = 0; i < node->free; ++i) held[i] += hard->response[i] * missing;
    }
    for (int i = 0; i < node->free && node->hard_rows > 0; ++i) q[i] += held[i];
}

static double soft_change(const struct articulation_tree *tree, const struct articulation_node *node,
                          const struct articulation_view *v, int32_t r, const double *q)
{
    const double rate = six_product(tree_own_row(tree, v, r), node->met) +
                        (q ? along(node, tree->direction + 6 * r, q) : 0);
    return v->rows[r].gain / v->rows[r].compliance * (v->right[r] - rate);
}

static void pass_down(const struct articulation_tree *tree, struct articulation_node *node,
                      const struct articulation_view *v)
{
    double p[6], t[6];
    meet_locks(tree, node, v);
    memcpy(p, node->load, sizeof p);
    add_product(node->A, -1, node->met, p);
    for (int i = 0; i < node->free; ++i) t[i] = six_product(node->S[i], p);
    for (int32_t at = node->soft; at < node->soft_end; ++at) {
        const int32_t r = tree->soft[at];
        const double change = soft_change(tree, node, v, r, NULL);
        for (int i = 0; i < node->free; ++i) t[i] += tree->direction[6 * r + i] * change;
    }
    find_free(tree, node, v, t, node->q);
    if (node->parent < 0 || !node->bound) return;
    for (int i = 0; i < node->free; ++i)
        for (int k = 0; k < 6; ++k) p[k] -= node->U[i][k] * node->q[i];
    add_load(node->offset, p, tree->node[node->parent].load);
}

/* Multipliers of what holds it: F is what its joint does to it. */
static void find_multipliers(const struct articulation_tree *tree, const struct articulation_node *node,
                             const struct articulation_view *v, double F[6])
{
    for (int32_t at = node->soft; at < node->soft_end; ++at) {
        const int32_t r = tree->soft[at];
        const double *row = tree_own_row(tree, v, r), found = soft_change(tree, node, v, r, node->q);
        v->found[r] = found;
        for (int k = 0; k < 6; ++k) F[k] -= row[k] * found;
    }
    for (int h = node->hard_rows; h-- > 0;) {
        const struct articulation_hard_row *hard = &node->hard[h];
        const int32_t r = hard->r;
        const double *row = tree_own_row(tree, v, r);
        double sum = 0;
        for (int i = 0; i < node->free; ++i) sum += hard->response[i] * six_product(node->S[i], F);
        v->found[r] = sum * hard->inverse;
        for (int k = 0; k < 6; ++k) F[k] -= row[k] * v->found[r];
    }
    for (int kind = 0; kind < 2; ++kind)
        for (int i = 0; i < node->locks[kind]; ++i) {
            const double *row = tree_lock_row(tree, node, v, kind, i);
            const double found = dot3(row + 3 * kind, F + 3 * kind);
            v->found[node->lock[3 * kind + i]] = found;
            for (int k = 3; k < 6; ++k) F[k] -= found * row[k];
        }
}

static void pass_up(const struct articulation_tree *tree, struct articulation_node *node,
                    const struct articulation_view *v)
{
    double *velocity = node->velocity, F[6], held[6] = {0}, pull[6];
    const bool carried = node->parent >= 0 && node->bound;
    if (carried) {
        carry(node->offset, tree->node[node->parent].velocity, held);
        for (int i = 0; i < node->free; ++i) pull[i] = six_product(node->U[i], held);
        for (int i = 0; i < node->free; ++i)
            for (int j = 0; j < node->free; ++j) node->q[i] -= node->H[i][j] * pull[j];
    }
    for (int k = 0; k < 6; ++k) velocity[k] = held[k] + node->met[k];
    for (int i = 0; i < node->free; ++i)
        for (int k = 0; k < 6; ++k) velocity[k] += node->S[i][k] * node->q[i];
    if (!node->bound) return;
    for (int k = 0; k < 6; ++k) F[k] = -node->load[k];
    add_product(node->A, 1, velocity, F);
    find_multipliers(tree, node, v, F);
}

/* articulation_row_residual with what the bodies' velocities are so far. */
static double residual_of(const struct articulation_tree *tree, const struct articulation_view *v, int32_t r)
{
    const struct articulation_row *row = &v->rows[r];
    const int32_t *side = v->s.side + 2 * (r / SADMM_MAX_ROWS);
    double rate = 0;
    for (int k = 0; k < 2; ++k)
        if (side[k] >= 0) rate += six_product(row->jacobian[k], tree->total + 6 * side[k]);
    return row->gain * rate + row->bias + row->compliance * (row->lambda + v->change[r]);
}

double sadmm_articulation_tree_residual(const struct articulation_tree *tree, const struct articulation_view *v)
{
    double most = 0;
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
        if (v->state[r] != ROW_INSIDE) continue;
        const double residual = fabs(residual_of(tree, v, r));
        if (!(residual <= most)) most = residual;
    }
    return most;
}

/* Loads of what rows have changed by so far. */
static void add_changes(const struct articulation_tree *tree, const struct articulation_view *v)
{
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r) {
        const double change = v->change[r];
        if (change == 0) continue;
        const int32_t *side = v->s.side + 2 * (r / SADMM_MAX_ROWS);
        for (int s = 0; s < 2; ++s)
            for (int k = 0; side[s] >= 0 && k < 6; ++k)
                tree->node[tree->node_of[side[s]]].load[k] += v->rows[r].jacobian[s][k] * change;
    }
}

/* What acts on the bodies, and what rows inside their bounds ask for: of what is left again. */
static void put_loads(const struct articulation_tree *tree, const struct articulation_view *v, bool again)
{
    const int32_t numbers = 6 * v->s.bodies;
    for (int32_t k = 0; k < numbers; ++k) {
        if (!again) v->dv[k] = 0;
        tree->total[k] = v->velocity[k] + v->dv[k];
    }
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r)
        if (v->state[r] == ROW_INSIDE) {
            if (!again) v->change[r] = 0;
            v->found[r] = 0;
            v->right[r] = -residual_of(tree, v, r) / v->rows[r].gain;
        } else if (v->state[r] == ROW_ABSENT) v->change[r] = 0;
    for (int32_t n = 0; n < tree->nodes; ++n) {
        struct articulation_node *node = &tree->node[n];
        const double *A = v->factor + 36 * (size_t)node->body, *dv = v->dv + 6 * (size_t)node->body;
        memcpy(node->load, v->residual + 6 * (size_t)node->body, sizeof node->load);
        for (int k = 0; again && k < 6; ++k)
            for (int j = 0; j < 6; ++j) node->load[k] -= A[j <= k ? 6 * k + j : 6 * j + k] * dv[j];
    }
    add_changes(tree, v);
}

void sadmm_articulation_tree_solve(const struct articulation_tree *tree, const struct articulation_view *v, bool again)
{
    put_loads(tree, v, again);
    for (int32_t n = 0; n < tree->nodes; ++n) pass_down(tree, &tree->node[n], v);
    for (int32_t n = tree->nodes; n-- > 0;) {
        struct articulation_node *node = &tree->node[n];
        const size_t first = 6 * (size_t)node->body;
        pass_up(tree, node, v);
        for (size_t k = 0; k < 6; ++k) {
            v->dv[first + k] += node->velocity[k];
            tree->total[first + k] = v->velocity[first + k] + v->dv[first + k];
        }
    }
    for (int32_t r = 0; r < SADMM_MAX_ROWS * v->s.columns; ++r)
        if (v->state[r] == ROW_INSIDE) v->change[r] += v->found[r];
}

void sadmm_articulation_tree_pass(const struct articulation_node *node, double load[6], const double *along_joint,
                                  double z[6], double response[6])
{
    double up[6] = {0};
    for (int i = 0; i < node->free; ++i) z[i] = six_product(node->S[i], load) + (along_joint ? along_joint[i] : 0);
    for (int i = 0; i < node->free; ++i) {
        response[i] = 0;
        for (int j = 0; j < node->free; ++j) response[i] += node->H[i][j] * z[j];
    }
    if (node->parent < 0 || !node->bound) return;
    for (int i = 0; i < node->free; ++i)
        for (int k = 0; k < 6; ++k) load[k] -= node->U[i][k] * response[i];
    add_load(node->offset, load, up);
    memcpy(load, up, sizeof up);
}
