/* What the joints of a tree lock, and what they leave free (articulation_tree.h). */
#include <math.h>
#include <string.h>

#include "articulation_tree_rows.h"
#include "core/math/array3.h"

/* How far the axes of locks may be off being unit and perpendicular: their multipliers, by projection, are off by as
 * much, and refined. */
static const double PERPENDICULAR = 1e-9;

/* Where a lock's axis is in its row: 0: it locks a translation, 3: a rotation. */
static int axis_at(const double *row) { return dot3(row, row) > 0.5 ? 0 : 3; }

/* Is the axis of lock r unit, and perpendicular to those before it? */
static bool add_lock(const struct articulation_tree *tree, struct articulation_node *node,
                     const struct articulation_view *v, int32_t r)
{
    const double *row = tree_own_row(tree, v, r);
    const int at = axis_at(row), kind = at / 3;
    if (node->locks[kind] == 3 || !(fabs(dot3(row + at, row + at) - 1) < PERPENDICULAR) ||
        (kind == 1 && dot3(row, row) != 0))
        return false;
    for (int i = 0; i < node->locks[kind]; ++i)
        if (!(fabs(dot3(row + at, tree_lock_row(tree, node, v, kind, i) + at)) < PERPENDICULAR)) return false;
    node->lock[3 * kind + node->locks[kind]++] = r;
    return true;
}

/* Rows that nothing gives way to. False: some are no locks of one joint. Those of two joints between the same bodies
 * say the same, and share their loads by the regularisation of the sparse factor. */
static bool find_locks(const struct articulation_tree *tree, struct articulation_node *node,
                       const struct articulation_view *v)
{
    node->locks[0] = node->locks[1] = 0;
    EACH_TREE_ROW(tree, v, node, r) {
        tree->role[r] = ARTICULATION_NONE;
        if (!sadmm_law_is_coupled(v->rows[r].compliance, v->rows[r].lo, v->rows[r].hi)) continue;
        if (!add_lock(tree, node, v, r)) return false;
        tree->role[r] = ARTICULATION_LOCK;
    }
    return true;
}

/* Unit axes perpendicular to `count` given ones; how many. */
static int complete(double axis[3][3], int count)
{
    if (count == 0) {
        memset(axis, 0, 9 * sizeof(double));
        axis[0][0] = axis[1][1] = axis[2][2] = 1;
        return 3;
    }
    if (count == 1) {
        const vec3 n = v3_load(axis[0]);
        vec3 t, b;
        v3_tangents(n, &t, &b);
        v3_store(t, axis[0]);
        v3_store(b, axis[1]);
        return 2;
    }
    if (count == 2) {
        v3_store(v3_cross(v3_load(axis[0]), v3_load(axis[1])), axis[0]);
        return 1;
    }
    return 0;
}

/* Free directions: translations that no lock forbids; rotations likewise, about the point where the locked translations
 * are. */
static void find_directions(const struct articulation_tree *tree, struct articulation_node *node,
                            const struct articulation_view *v)
{
    double axis[3][3];
    node->free = 0;
    for (int kind = 0; kind < 2; ++kind) {
        for (int i = 0; i < node->locks[kind]; ++i)
            memcpy(axis[i], tree_lock_row(tree, node, v, kind, i) + 3 * kind, sizeof axis[i]);
        const int count = complete(axis, node->locks[kind]);
        for (int i = 0; i < count; ++i) {
            double *S = node->S[node->free++];
            memset(S, 0, 6 * sizeof *S);
            memcpy(S + 3 * kind, axis[i], 3 * sizeof *S);
            for (int k = 0; kind == 1 && k < node->locks[0]; ++k) {
                const double *row = tree_lock_row(tree, node, v, 0, k), way = dot3(row + 3, axis[i]);
                for (int c = 0; c < 3; ++c) S[c] -= way * row[c];
            }
        }
    }
}

/* S^T J^T of rows that are no locks. */
static void find_row_directions(const struct articulation_tree *tree, const struct articulation_node *node,
                                const struct articulation_view *v)
{
    EACH_TREE_ROW(tree, v, node, r) {
        if (tree->role[r] == ARTICULATION_LOCK) continue;
        for (int i = 0; i < node->free; ++i)
            tree->direction[6 * r + i] = six_product(tree_own_row(tree, v, r), node->S[i]);
    }
}

/* Has it any rows, and where is it from its parent? False: they are no wrenches at points of space. */
static bool find_offset(const struct articulation_tree *tree, struct articulation_node *node,
                        const struct articulation_view *v, const struct sadmm_row_constraint *slots)
{
    node->bound = false;
    for (int32_t j = node->first; j < node->first + node->count; ++j) {
        const struct sadmm_row_constraint *slot = &slots[v->s.constraint[tree->joint[j] / 2]];
        if (slot->count == 0) continue;
        if (!slot->rigid) return false;
        node->bound = true;
        for (int k = 0; k < 3; ++k) node->offset[k] = tree->joint[j] % 2 ? slot->offset[k] : -slot->offset[k];
    }
    return true;
}

bool sadmm_articulation_tree_begin(struct articulation_tree *tree, const struct articulation_view *v,
                                   const struct sadmm_row_constraint *slots)
{
    tree->known = false;
    for (int32_t n = 0; n < tree->nodes; ++n) {
        struct articulation_node *node = &tree->node[n];
        if (!find_offset(tree, node, v, slots) || !find_locks(tree, node, v)) return false;
        find_directions(tree, node, v);
        find_row_directions(tree, node, v);
    }
    return true;
}

