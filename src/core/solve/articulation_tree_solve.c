#include <math.h>
#include <string.h>

#include "articulation_kernels.h"
#include "core/math/six.h"

static six parent_of(const struct articulation_node *node, const double velocity[SIX])
{
    return six_carry(*(const three *)node->offset, six_at(velocity));
}

/* Loads on its body: v->residual; again: less what the velocity has taken so far. */
static void begin_node(struct articulation_node *node, const struct articulation_view *v, bool again)
{
    six load = six_load(v->residual + 6 * (size_t)node->body);
    if (!again) {
        six_put(six_zero(), node->total);
    } else {
        const double *A = v->factor + 36 * (size_t)node->body;
        for (int k = 0; k < 6; ++k) load = six_madd(load, -node->total[k < 3 ? k : k + 1], six_load(A + 6 * k));
    }
    six_put(load, node->load);
}

static void add_to_parent(const struct articulation_tree *tree, const struct articulation_node *node, six load)
{
    if (node->parent < 0) return;
    double *parent = tree->node[node->parent].load;
    six_put(six_add(six_at(parent), six_hand_on(*(const three *)node->offset, load)), parent);
}

static six past_parent(const struct articulation_tree *tree, const struct articulation_node *node)
{
    const six own = six_at(node->total);
    return node->parent >= 0 ? six_sub(own, parent_of(node, tree->node[node->parent].total)) : own;
}

/* What rows inside their bounds ask for, and the loads of what rows have changed by. */
static void begin_rows(const struct articulation_tree *tree, struct articulation_node *node,
                       const struct articulation_view *v, bool again)
{
    const six past = again ? past_parent(tree, node) : six_zero();
    six load = six_zero();
    bool any = false;
    for (int32_t at = node->row; at < node->row_end; ++at) {
        struct articulation_tree_row *row = &tree->row[at];
        const double change = v->change[row->r];
        const bool inside = v->state[row->r] == ROW_INSIDE;
        if (inside) {
            double residual = row->start;
            if (again) residual += row->gain * six_dot(six_at(row->own), past) + row->compliance * change;
            row->right = -residual / row->gain;
        }
        if (change == 0 || (inside && !again)) continue;
        load = six_madd(load, change, six_at(row->own));
        any = true;
    }
    if (!any) return;
    six_put(six_add(six_at(node->load), load), node->load);
    add_to_parent(tree, node, six_sub(six_zero(), load));
}

/* s, which meets the locks. */
static six meet_locks(const struct articulation_tree *tree, const struct articulation_node *node)
{
    six s = six_zero();
    for (int i = 0; i < node->locks[1]; ++i) {
        const struct articulation_tree_row *row = &tree->row[node->lock[3 + i]];
        s.angular += three_fill(row->right) * six_at(row->own).angular;
    }
    for (int i = 0; i < node->locks[0]; ++i) {
        const struct articulation_tree_row *row = &tree->row[node->lock[i]];
        const six own = six_at(row->own);
        s.linear += three_fill(row->right - three_dot(own.angular, s.angular)) * own.linear;
    }
    return s;
}

static double along(const struct articulation_node *node, const double *g, const double *q)
{
    double sum = 0;
    for (int i = 0; i < node->free; ++i) sum += g[i] * q[i];
    return sum;
}

/* q = H t, and what hard rows ask for beside it. */
static void find_free(const struct articulation_tree *tree, const struct articulation_node *node, six met,
                      const double t[6], double q[6])
{
    for (int i = 0; i < node->free; ++i) {
        q[i] = 0;
        for (int j = 0; j < node->free; ++j) q[i] += node->H[i][j] * t[j];
    }
    if (node->hard_rows == 0) return;
    double held[6] = {0};
    for (int h = 0; h < node->hard_rows; ++h) {
        const struct articulation_hard_row *hard = &node->hard[h];
        const struct articulation_tree_row *row = &tree->row[hard->row];
        const double missing =
            (row->right - six_dot(six_at(row->own), met) - along(node, row->along, held)) * hard->inverse;
        for (int i = 0; i < node->free; ++i) held[i] += hard->response[i] * missing;
    }
    for (int i = 0; i < node->free; ++i) q[i] += held[i];
}

static double soft_change(const struct articulation_tree_row *row, double rate)
{
    return row->gain / row->compliance * (row->right - rate);
}

static void pass_down(const struct articulation_tree *tree, struct articulation_node *node,
                      const struct articulation_view *v, bool again)
{
    double t[6];
    if (again || tree->pressed || tree->refined) begin_rows(tree, node, v, again);
    const six met = meet_locks(tree, node);
    six_put(met, node->met);
    six p = six_at(node->load);
    if (node->locks[0] + node->locks[1] > 0) p = six_add_product(p, -1, node->A, node->met);
    for (int i = 0; i < node->free; ++i) t[i] = six_dot(six_at(node->S[i]), p);
    for (int32_t at = node->row; at < node->row + node->soft; ++at) {
        const struct articulation_tree_row *row = &tree->row[tree->soft[at]];
        const double change = soft_change(row, six_dot(six_at(row->own), met));
        for (int i = 0; i < node->free; ++i) t[i] += row->along[i] * change;
    }
    find_free(tree, node, met, t, node->q);
    if (node->parent < 0 || !node->bound) return;
    for (int i = 0; i < node->free; ++i) p = six_madd(p, -node->q[i], six_at(node->U[i]));
    add_to_parent(tree, node, p);
}

static void change_lock(const struct articulation_view *v, int32_t r, bool again, double found)
{
    if (v->state[r] == ROW_INSIDE) v->change[r] = again ? v->change[r] + found : found;
}

/* Multipliers of what holds it: F is what its joint does to it. */
static void find_multipliers(const struct articulation_tree *tree, const struct articulation_node *node,
                             const struct articulation_view *v, bool again, six F)
{
    const six met = six_at(node->met);
    for (int32_t at = node->row; at < node->row + node->soft; ++at) {
        struct articulation_tree_row *row = &tree->row[tree->soft[at]];
        const six own = six_at(row->own);
        row->found = soft_change(row, six_dot(own, met) + along(node, row->along, node->q));
        F = six_madd(F, -row->found, own);
    }
    for (int h = node->hard_rows; h-- > 0;) {
        const struct articulation_hard_row *hard = &node->hard[h];
        struct articulation_tree_row *row = &tree->row[hard->row];
        double sum = 0;
        for (int i = 0; i < node->free; ++i) sum += hard->response[i] * six_dot(six_at(node->S[i]), F);
        row->found = sum * hard->inverse;
        F = six_madd(F, -row->found, six_at(row->own));
    }
    for (int i = 0; i < node->locks[0]; ++i) {
        struct articulation_tree_row *row = &tree->row[node->lock[i]];
        const six own = six_at(row->own);
        const double found = three_dot(own.linear, F.linear);
        change_lock(v, row->r, again, found);
        F.angular -= three_fill(found) * own.angular;
    }
    for (int i = 0; i < node->locks[1]; ++i) {
        struct articulation_tree_row *row = &tree->row[node->lock[3 + i]];
        change_lock(v, row->r, again, three_dot(six_at(row->own).angular, F.angular));
    }
}

static void pass_up(const struct articulation_tree *tree, struct articulation_node *node,
                    const struct articulation_view *v, bool again)
{
    const bool carried = node->parent >= 0 && node->bound;
    six velocity = six_at(node->met);
    if (carried) {
        const six held = parent_of(node, tree->node[node->parent].velocity);
        double pull[6];
        for (int i = 0; i < node->free; ++i) pull[i] = six_dot(six_at(node->U[i]), held);
        for (int i = 0; i < node->free; ++i)
            for (int j = 0; j < node->free; ++j) node->q[i] -= node->H[i][j] * pull[j];
        velocity = six_add(velocity, held);
    }
    for (int i = 0; i < node->free; ++i) velocity = six_madd(velocity, node->q[i], six_at(node->S[i]));
    six_put(velocity, node->velocity);
    six_put(six_add(six_at(node->total), velocity), node->total);
    if (!node->bound) return;
    find_multipliers(tree, node, v, again,
                     six_add_product(six_sub(six_zero(), six_at(node->load)), 1, node->A, node->velocity));
}

/* Of what moves past its parent, what locks leave: no less than any of their residuals. */
static double lock_residual(const struct articulation_tree *tree, const struct articulation_node *node, six past,
                            bool again)
{
    three most = {0, 0, 0, 0};
    if (again) { /* met, q are of the last solve alone */
        double largest = 0;
        for (int kind = 0; kind < 2; ++kind)
            for (int i = 0; i < node->locks[kind]; ++i) {
                const struct articulation_tree_row *row = &tree->row[node->lock[3 * kind + i]];
                const double size = fabs(row->start + row->gain * six_dot(six_at(row->own), past));
                if (!(size <= largest)) largest = size;
            }
        return largest;
    }
    past = six_sub(past, six_at(node->met));
    for (int i = 0; i < node->free; ++i) past = six_madd(past, -node->q[i], six_at(node->S[i]));
    for (int i = 0; i < node->locks[0]; ++i) { /* the longest arm */
        const three arm = six_at(tree->row[node->lock[i]].own).angular;
        most += arm * arm;
    }
    return sqrt(three_dot(past.linear, past.linear)) +
           (1 + sqrt(three_sum(most))) * sqrt(three_dot(past.angular, past.angular));
}

/* What its rows have changed by, and are off by then. Returns the largest of those inside their bounds. */
static double end_rows(struct articulation_tree *tree, const struct articulation_node *node,
                       const struct articulation_view *v, bool again, double most)
{
    bool settled = true;
    if (node->row == node->row_end) return most;
    const six past = past_parent(tree, node);
    if (node->locks[0] + node->locks[1] > 0) {
        const double size = lock_residual(tree, node, past, again);
        if (!(size <= most)) most = size;
    }
    for (int32_t k = node->row; k < node->row + node->acting; ++k) {
        struct articulation_tree_row *row = &tree->row[tree->acting[k]];
        const uint8_t state = v->state[row->r];
        const bool inside = state == ROW_INSIDE;
        double change = v->change[row->r];
        if (inside) v->change[row->r] = change = again ? change + row->found : row->found;
        row->residual = row->start + row->gain * six_dot(six_at(row->own), past) + row->compliance * change;
        if (inside) {
            const double lambda = row->lambda + change, size = fabs(row->residual);
            if (!(size <= most)) most = size;
            settled &= (lambda >= row->lo) & (lambda <= row->hi) & (row->role != ARTICULATION_LEFT);
        } else if (state != ROW_FIXED) {
            settled &= state == ROW_AT_LO ? row->residual >= 0 : row->residual <= 0;
        }
    }
    tree->unsettled = tree->unsettled || !settled;
    return most;
}

double SADMM_KERNEL(articulation_tree_solve)(struct articulation_tree *tree,
                                             const struct articulation_view *v, bool again)
{
    double most = 0;
    tree->unsettled = false;
    for (int32_t n = 0; n < tree->nodes; ++n) begin_node(&tree->node[n], v, again);
    for (int32_t n = 0; n < tree->nodes; ++n) pass_down(tree, &tree->node[n], v, again);
    tree->refined = again;
    for (int32_t n = tree->nodes; n-- > 0;) {
        struct articulation_node *node = &tree->node[n];
        pass_up(tree, node, v, again);
        most = end_rows(tree, node, v, again, most);
        six_store(six_at(node->total), v->dv + 6 * (size_t)node->body);
    }
    return most;
}
