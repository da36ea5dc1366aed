/* What the joints of a tree lock, and what they leave free (articulation_tree.h). */
#include <math.h>
#include <string.h>

#include "articulation_kernels.h"
#include "core/math/six.h"

/* How far the axes of locks may be off being unit and perpendicular: their multipliers, by projection, are off by as
 * much, and refined. Those of one joint are not off by more than rounding. */
static const double PERPENDICULAR = 1e-9;

/* A lock of a translation, or of a rotation. Is there room for it, and is its axis perpendicular to those of earlier
 * joints, the first `others` of either kind? */
static bool add_lock(struct articulation_tree_row *rows, struct articulation_node *node, int32_t at,
                     const int others[2])
{
    const six row = six_at(rows[at].own);
    const int kind = three_dot(row.linear, row.linear) > 0.5 ? 0 : 1;
    if (node->locks[kind] == 3) return false;
    for (int i = 0; i < others[kind]; ++i) {
        const three axis = kind == 0 ? row.linear : row.angular,
                    other = *(const three *)(rows[node->lock[3 * kind + i]].own + SIX_HALF * kind);
        if (!(fabs(three_dot(axis, other)) < PERPENDICULAR)) return false;
    }
    node->lock[3 * kind + node->locks[kind]++] = at;
    rows[at].role = ARTICULATION_LOCK;
    memset(rows[at].along, 0, sizeof rows[at].along);
    return true;
}

/* Unit axes perpendicular to `count` given ones; how many. */
static int complete(three axis[3], int count)
{
    if (count == 0) {
        for (int k = 0; k < 3; ++k) axis[k] = (three){k == 0, k == 1, k == 2, 0};
        return 3;
    }
    if (count == 1) {
        vec3 t, b;
        v3_tangents(v3(axis[0][0], axis[0][1], axis[0][2]), &t, &b);
        axis[0] = (three){t.x, t.y, t.z, 0};
        axis[1] = (three){b.x, b.y, b.z, 0};
        return 2;
    }
    if (count == 2) {
        axis[0] = three_cross(axis[0], axis[1]);
        return 1;
    }
    return 0;
}

/* Free directions: translations that no lock forbids; rotations likewise, about the point where the locked translations
 * are. */
static void find_directions(const struct articulation_tree *tree, struct articulation_node *node)
{
    three axis[3];
    node->free = 0;
    for (int kind = 0; kind < 2; ++kind) {
        for (int i = 0; i < node->locks[kind]; ++i)
            axis[i] = *(const three *)(tree->row[node->lock[3 * kind + i]].own + SIX_HALF * kind);
        const int count = complete(axis, node->locks[kind]);
        for (int i = 0; i < count; ++i) {
            six S = six_zero();
            if (kind == 0) S.linear = axis[i];
            else S.angular = axis[i];
            for (int k = 0; kind == 1 && k < node->locks[0]; ++k) {
                const six row = six_at(tree->row[node->lock[k]].own);
                S.linear -= three_fill(three_dot(row.angular, axis[i])) * row.linear;
            }
            six_put(S, node->S[node->free++]);
        }
    }
}

static six start_past_parent(const struct articulation_tree *tree, const struct articulation_node *node,
                             const struct articulation_view *v)
{
    const six own = six_load(v->velocity + 6 * (size_t)node->body);
    if (node->parent < 0) return own;
    const six parent = six_load(v->velocity + 6 * (size_t)tree->node[node->parent].body);
    return six_sub(own, six_carry(*(const three *)node->offset, parent));
}

/* Row `from` of the system. */
static void load_row(const struct sadmm_rows *rows, size_t from, struct articulation_row *to)
{
    memcpy(to->jacobian[0], rows->jacobian_a + 6 * from, sizeof to->jacobian[0]);
    memcpy(to->jacobian[1], rows->jacobian_b + 6 * from, sizeof to->jacobian[1]);
    to->gain = rows->gain[from], to->bias = rows->bias[from], to->compliance = rows->compliance[from];
    to->lo = rows->lo[from], to->hi = rows->hi[from], to->lambda = rows->lambda[from];
}

static void put_row(const struct articulation_row *from, int side, six past, int32_t r,
                    struct articulation_tree_row *row)
{
    const six own = six_load(from->jacobian[side]);
    const double start = from->gain * six_dot(own, past) + from->bias + from->compliance * from->lambda;
    six_put(own, row->own);
    row->r = r;
    row->role = ARTICULATION_NONE;
    row->gain = from->gain, row->compliance = from->compliance;
    row->lo = from->lo, row->hi = from->hi, row->lambda = from->lambda;
    row->start = start;
    row->right = -start / from->gain;
    row->found = 0;
}

/* Where it is from its parent, and its rows. False: they are no wrenches at points of space, or not locks of one joint:
 * those of two joints between the same bodies say the same, and share their loads by the regularisation of the sparse
 * factor. */
static bool add_rows(struct articulation_tree *tree, struct articulation_node *node, const struct articulation_view *v,
                     const struct sadmm_row_constraint *slots, const struct sadmm_rows *rows)
{
    /* bytes are written below, which may be anything to a compiler: it would fetch these again */
    struct articulation_row *const given = v->rows;
    struct articulation_tree_row *const all = tree->row;
    int32_t *const acting = tree->acting + tree->rows, *const row_of = tree->row_of;
    int32_t at = tree->rows, act = 0;
    node->bound = false;
    node->locks[0] = node->locks[1] = 0;
    node->row = at;
    six past = six_zero();
    for (int32_t j = node->first; j < node->first + node->count; ++j) {
        const int32_t column = tree->joint[j] / 2, side = tree->joint[j] % 2, first = SADMM_MAX_ROWS * column;
        const struct sadmm_row_constraint *slot = &slots[v->s.constraint[column]];
        const int others[2] = {node->locks[0], node->locks[1]};
        if (slot->count == 0) continue;
        if (!slot->rigid) return false;
        if (!node->bound) {
            for (int k = 0; k < 3; ++k) node->offset[k] = side ? slot->offset[k] : -slot->offset[k];
            past = start_past_parent(tree, node, v);
        }
        node->bound = true;
        const int32_t count = slot->count, from_row = slot->first;
        memset(v->state + first, ROW_INSIDE, (size_t)count);
        for (int32_t i = 0; i < count; ++i, ++at) {
            struct articulation_row *from = &given[first + i];
            if (rows) load_row(rows, (size_t)(from_row + i), from);
            row_of[first + i] = at;
            put_row(from, side, past, first + i, &all[at]);
            if (!sadmm_law_is_coupled(from->compliance, from->lo, from->hi)) acting[act++] = at;
            else if (!add_lock(all, node, at, others)) return false;
        }
    }
    tree->rows = node->row_end = at;
    node->acting = act;
    return true;
}

static void find_along(const struct articulation_tree *tree, const struct articulation_node *node)
{
    for (int32_t k = node->row; k < node->row + node->acting; ++k) {
        struct articulation_tree_row *row = &tree->row[tree->acting[k]];
        for (int i = 0; i < node->free; ++i) row->along[i] = six_dot(six_at(row->own), six_at(node->S[i]));
    }
}

/* J^T lambda of its rows, on its body and on its parent's. */
static void add_row_loads(const struct articulation_tree *tree, struct articulation_node *node)
{
    six load = six_zero();
    if (!node->bound) return;
    for (int32_t at = node->row; at < node->row_end; ++at)
        load = six_madd(load, tree->row[at].lambda, six_at(tree->row[at].own));
    six_put(six_add(six_at(node->load), load), node->load);
    if (node->parent < 0) return;
    double *parent = tree->node[node->parent].load;
    six_put(six_sub(six_at(parent), six_hand_on(*(const three *)node->offset, load)), parent);
}

static void add_loads(const struct articulation_node *node, const struct articulation_view *v, double *impulse,
                      double *without)
{
    const size_t e = (size_t)node->body;
    const double *A = v->factor + 36 * e, *velocity = v->velocity + 6 * e;
    const six rows = six_at(node->load), contacts = six_load(impulse + 6 * e);
    six residual = six_add(six_load(without + 6 * e), rows);
    for (int k = 0; k < 6; ++k) residual = six_madd(residual, -velocity[k], six_load(A + 6 * k));
    six_store(residual, without + 6 * e);
    six_store(six_add(residual, contacts), v->residual + 6 * e);
    six_store(six_add(contacts, rows), impulse + 6 * e);
}

bool SADMM_KERNEL(articulation_tree_load)(struct articulation_tree *tree,
                                          const struct articulation_view *v,
                                          const struct sadmm_row_constraint *slots, const struct sadmm_rows *rows,
                                          double *impulse, double *without)
{
    const size_t count = (size_t)(SADMM_MAX_ROWS * v->s.columns);
    tree->known = tree->refined = false;
    tree->rows = 0;
    memset(v->state, ROW_ABSENT, count);
    memset(v->change, 0, count * sizeof *v->change);
    for (int32_t n = 0; n < tree->nodes; ++n) {
        struct articulation_node *node = &tree->node[n];
        if (!add_rows(tree, node, v, slots, rows)) return false;
        find_directions(tree, node);
        find_along(tree, node);
        six_put(six_zero(), node->load);
    }
    for (int32_t n = 0; n < tree->nodes; ++n) add_row_loads(tree, &tree->node[n]);
    for (int32_t n = 0; n < tree->nodes; ++n) add_loads(&tree->node[n], v, impulse, without);
    return true;
}
