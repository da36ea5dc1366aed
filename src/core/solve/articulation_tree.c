#include "articulation_tree.h"

#include <math.h>
#include <string.h>

/* How far the axes of locks may be off being unit and perpendicular: their multipliers, by projection, are off by as
 * much, and refined. */
static const double PERPENDICULAR = 1e-9;
/* Of a hard row's response without others, the share under which they say what it says. */
static const double DEPENDENT = 1e-10;

/* ---- structure --------------------------------------------------------------------------------------------------- */

static int32_t other_side(const struct articulation_structure *s, int32_t around) { return s->side[around ^ 1]; }

/* Bodies from `root` on, breadth first, and their parents, -1: the root's. False: some are connected twice. */
static bool list_bodies(const struct articulation_structure *s, int32_t root, int32_t *queue, int32_t *parent)
{
    int32_t listed = 1;
    for (int32_t e = 0; e < s->bodies; ++e) parent[e] = -2;
    queue[0] = root;
    parent[root] = -1;
    for (int32_t k = 0; k < listed; ++k) {
        const int32_t e = queue[k];
        for (int32_t at = s->first_around[e]; at < s->first_around[e + 1]; ++at) {
            const int32_t other = other_side(s, s->around[at]);
            if (other < 0 || other == parent[e]) continue;
            if (parent[other] == -2) {
                parent[other] = e;
                queue[listed++] = other;
            } else if (parent[other] != e) return false;
        }
    }
    return listed == s->bodies;
}

/* The one that is connected to what is not solved for, -1: none; *more: there are others. */
static int32_t anchored_body(const struct articulation_structure *s, bool *more)
{
    int32_t anchored = -1;
    *more = false;
    for (int32_t e = 0; e < s->bodies; ++e)
        for (int32_t at = s->first_around[e]; at < s->first_around[e + 1]; ++at) {
            if (other_side(s, s->around[at]) >= 0) continue;
            *more = *more || (anchored >= 0 && anchored != e);
            anchored = e;
        }
    return anchored;
}

/* Halfway along the longest path. */
static int32_t middle_body(const struct articulation_structure *s, int32_t *queue, int32_t *parent)
{
    int32_t length = 0, e;
    if (!list_bodies(s, 0, queue, parent)) return -1;
    if (!list_bodies(s, queue[s->bodies - 1], queue, parent)) return -1;
    for (e = queue[s->bodies - 1]; parent[e] >= 0; e = parent[e]) ++length;
    for (e = queue[s->bodies - 1]; length > 1; length -= 2) e = parent[e];
    return e;
}

static void put_node(const struct articulation_structure *s, int32_t e, const int32_t *parent,
                     struct articulation_tree *tree, int32_t n, int32_t *joints)
{
    struct articulation_node *node = &tree->node[n];
    node->body = e;
    node->parent = parent[e] >= 0 ? tree->node_of[parent[e]] : -1;
    node->first = *joints;
    for (int32_t at = s->first_around[e]; at < s->first_around[e + 1]; ++at) {
        const int32_t other = other_side(s, s->around[at]);
        if (other >= 0 && other != parent[e]) continue;
        tree->joint[(*joints)++] = s->around[at];
        memset(tree->own + SADMM_MAX_ROWS * (s->around[at] / 2), s->around[at] % 2, SADMM_MAX_ROWS);
    }
    node->count = *joints - node->first;
}

void sadmm_articulation_tree_make(const struct articulation_structure *s, int32_t *queue, int32_t *parent,
                                  struct articulation_tree *tree)
{
    bool more;
    int32_t joints = 0, root = anchored_body(s, &more);
    tree->nodes = tree->depth = 0;
    if (more) return;
    if (root < 0) root = middle_body(s, queue, parent);
    if (root < 0 || !list_bodies(s, root, queue, parent)) return;
    tree->nodes = s->bodies;
    for (int32_t k = 0; k < s->bodies; ++k) tree->node_of[queue[k]] = s->bodies - 1 - k;
    for (int32_t k = s->bodies; k-- > 0;) {
        struct articulation_node *node = &tree->node[tree->node_of[queue[k]]];
        put_node(s, queue[k], parent, tree, tree->node_of[queue[k]], &joints);
        node->soft = SADMM_MAX_ROWS * node->first;
    }
    for (int32_t n = 0; n < tree->nodes; ++n) {
        int32_t depth = 1;
        for (int32_t up = tree->node[n].parent; up >= 0; up = tree->node[up].parent) ++depth;
        if (depth > tree->depth) tree->depth = depth;
    }
}

/* ---- a node's joint ---------------------------------------------------------------------------------------------- */

/* Rows r of a node's joint, on `side` of which its body is. */
#define EACH_ROW(tree, v, node, r, side_)                                                                          \
    for (int32_t j_ = (node)->first, side_ = 0; j_ < (node)->first + (node)->count; ++j_)                            \
        for (int32_t r = SADMM_MAX_ROWS * ((tree)->joint[j_] / 2), last_ = r + SADMM_MAX_ROWS;                         \
             side_ = (tree)->joint[j_] % 2, r < last_ && (v)->state[r] != ROW_ABSENT; ++r)

bool sadmm_articulation_tree_begin(struct articulation_tree *tree, const struct articulation_view *v,
                                   const struct sadmm_row_constraint *slots)
{
    tree->known = false;
    for (int32_t n = 0; n < tree->nodes; ++n) {
        struct articulation_node *node = &tree->node[n];
        node->bound = false;
        for (int32_t j = node->first; j < node->first + node->count; ++j) {
            const struct sadmm_row_constraint *slot = &slots[v->s.constraint[tree->joint[j] / 2]];
            if (slot->count == 0) continue;
            if (!slot->rigid) return false;
            node->bound = true;
            for (int k = 0; k < 3; ++k) node->offset[k] = tree->joint[j] % 2 ? slot->offset[k] : -slot->offset[k];
        }
    }
    return true;
}

static double dot(const double *x, const double *y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; }
static void cross(const double *x, const double *y, double to[3])
{
    to[0] = x[1] * y[2] - x[2] * y[1];
    to[1] = x[2] * y[0] - x[0] * y[2];
    to[2] = x[0] * y[1] - x[1] * y[0];
}

/* Where a lock's axis is in its row: 0: it locks a translation, 3: a rotation. */
static int axis_at(const double *row) { return dot(row, row) > 0.5 ? 0 : 3; }

/* A row inside its bounds that nothing gives way to is a lock, if its axis is perpendicular to those of the others. */
static bool add_lock(struct articulation_node *node, const struct articulation_view *v, int32_t r, int32_t side)
{
    const double *row = v->rows[r].jacobian[side];
    const int at = axis_at(row), kind = at / 3;
    if (!sadmm_law_is_coupled(v->rows[r].compliance, v->rows[r].lo, v->rows[r].hi) || node->locks[kind] == 3 ||
        !(fabs(dot(row + at, row + at) - 1) < PERPENDICULAR) || (kind == 1 && dot(row, row) != 0))
        return false;
    for (int i = 0; i < node->locks[kind]; ++i)
        if (!(fabs(dot(row + at, v->rows[node->lock[3 * kind + i]].jacobian[side] + at)) < PERPENDICULAR)) return false;
    node->lock[3 * kind + node->locks[kind]++] = r;
    return true;
}

/* A row on its node's body. */
static const double *own_row(const struct articulation_tree *tree, const struct articulation_view *v, int32_t r)
{
    return v->rows[r].jacobian[tree->own[r]];
}
static const double *lock_row(const struct articulation_tree *tree, const struct articulation_node *node,
                              const struct articulation_view *v, int kind, int i)
{
    return own_row(tree, v, node->lock[3 * kind + i]);
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
        double n[3];
        cross(axis[0], axis[1], n);
        memcpy(axis[0], n, sizeof n);
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
            memcpy(axis[i], lock_row(tree, node, v, kind, i) + 3 * kind, sizeof axis[i]);
        const int count = complete(axis, node->locks[kind]);
        for (int i = 0; i < count; ++i) {
            double *S = node->S[node->free++];
            memset(S, 0, 6 * sizeof *S);
            memcpy(S + 3 * kind, axis[i], 3 * sizeof *S);
            for (int k = 0; kind == 1 && k < node->locks[0]; ++k) {
                const double *row = lock_row(tree, node, v, 0, k), way = dot(row + 3, axis[i]);
                for (int c = 0; c < 3; ++c) S[c] -= way * row[c];
            }
        }
    }
}

static void find_roles(const struct articulation_tree *tree, struct articulation_node *node,
                       const struct articulation_view *v)
{
    node->locks[0] = node->locks[1] = 0;
    node->soft_end = node->soft;
    EACH_ROW(tree, v, node, r, side) {
        tree->role[r] = ARTICULATION_NONE;
        if (v->state[r] != ROW_INSIDE) continue;
        if (add_lock(node, v, r, side)) tree->role[r] = ARTICULATION_LOCK;
        else tree->role[r] = v->rows[r].compliance > 0 ? ARTICULATION_SOFT : ARTICULATION_HARD;
        if (tree->role[r] == ARTICULATION_SOFT) tree->soft[node->soft_end++] = r;
    }
}

/* S^T J^T of rows that are no locks. */
static void find_row_directions(const struct articulation_tree *tree, const struct articulation_node *node,
                                const struct articulation_view *v)
{
    EACH_ROW(tree, v, node, r, side) {
        if (tree->role[r] == ARTICULATION_LOCK) continue;
        for (int i = 0; i < node->free; ++i)
            tree->direction[6 * r + i] = six_product(v->rows[r].jacobian[side], node->S[i]);
    }
}

/* ---- the factor -------------------------------------------------------------------------------------------------- */

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
    EACH_ROW(tree, v, node, r, side) {
        (void)side;
        if (tree->role[r] == ARTICULATION_HARD && count < ARTICULATION_HARD_ROWS)
            alone[count++] = response_along(node, tree->direction + 6 * r);
    }
    if (count == 0) return;
    EACH_ROW(tree, v, node, r, side) {
        (void)side;
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
    find_directions(tree, node, v);
    find_row_directions(tree, node, v);
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

/* y -= A x, A symmetric. */
static void subtract_product(const double A[6][6], const double x[6], double y[6])
{
    for (int k = 0; k < 6; ++k)
        for (int c = 0; c < 6; ++c) y[c] -= A[k][c] * x[k];
}

/* ---- solving with it --------------------------------------------------------------------------------------------- */

/* X v of a parent's velocity; p_parent += X^T p. */
static void carry(const double r[3], const double v[6], double to[6])
{
    double turned[3];
    cross(v + 3, r, turned);
    for (int k = 0; k < 3; ++k) to[k] = v[k] + turned[k], to[3 + k] = v[3 + k];
}
static void add_load(const double r[3], const double p[6], double to[6])
{
    double moment[3];
    cross(r, p, moment);
    for (int k = 0; k < 3; ++k) to[k] += p[k], to[3 + k] += p[3 + k] + moment[k];
}

/* s, which meets the locks: a target each is in v->right. */
static void meet_locks(const struct articulation_tree *tree, struct articulation_node *node,
                       const struct articulation_view *v)
{
    double *s = node->met;
    memset(s, 0, 6 * sizeof *s);
    for (int i = 0; i < node->locks[1]; ++i) {
        const double *row = lock_row(tree, node, v, 1, i), target = v->right[node->lock[3 + i]];
        for (int k = 3; k < 6; ++k) s[k] += target * row[k];
    }
    for (int i = 0; i < node->locks[0]; ++i) {
        const double *row = lock_row(tree, node, v, 0, i), target = v->right[node->lock[i]] - dot(row + 3, s + 3);
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
        const double *row = own_row(tree, v, r);
        const double missing =
            (v->right[r] - six_product(row, node->met) - along(node, tree->direction + 6 * r, held)) * hard->inverse;
        for (int i = 0; i < node->free; ++i) held[i] += hard->response[i] * missing;
    }
    for (int i = 0; i < node->free && node->hard_rows > 0; ++i) q[i] += held[i];
}

static double soft_change(const struct articulation_tree *tree, const struct articulation_node *node,
                          const struct articulation_view *v, int32_t r, const double *q)
{
    const double rate = six_product(own_row(tree, v, r), node->met) +
                        (q ? along(node, tree->direction + 6 * r, q) : 0);
    return v->rows[r].gain / v->rows[r].compliance * (v->right[r] - rate);
}

static void pass_down(const struct articulation_tree *tree, struct articulation_node *node,
                      const struct articulation_view *v)
{
    double p[6], t[6];
    meet_locks(tree, node, v);
    memcpy(p, node->load, sizeof p);
    subtract_product(node->A, node->met, p);
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
        const double *row = own_row(tree, v, r), found = soft_change(tree, node, v, r, node->q);
        v->found[r] = found;
        for (int k = 0; k < 6; ++k) F[k] -= row[k] * found;
    }
    for (int h = node->hard_rows; h-- > 0;) {
        const struct articulation_hard_row *hard = &node->hard[h];
        const int32_t r = hard->r;
        const double *row = own_row(tree, v, r);
        double sum = 0;
        for (int i = 0; i < node->free; ++i) sum += hard->response[i] * six_product(node->S[i], F);
        v->found[r] = sum * hard->inverse;
        for (int k = 0; k < 6; ++k) F[k] -= row[k] * v->found[r];
    }
    for (int kind = 0; kind < 2; ++kind)
        for (int i = 0; i < node->locks[kind]; ++i) {
            const double *row = lock_row(tree, node, v, kind, i);
            const double found = dot(row + 3 * kind, F + 3 * kind);
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
    for (int k = 0; k < 6; ++k)
        for (int c = 0; c < 6; ++c) F[c] += node->A[k][c] * velocity[k];
    find_multipliers(tree, node, v, F);
}

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

struct articulation_step sadmm_articulation_tree_pass(const struct articulation_node *node, double load[6],
                                                      const double *along_joint)
{
    struct articulation_step step;
    for (int i = 0; i < node->free; ++i)
        step.along[i] = six_product(node->S[i], load) + (along_joint ? along_joint[i] : 0);
    for (int i = 0; i < node->free; ++i) {
        step.response[i] = 0;
        for (int j = 0; j < node->free; ++j) step.response[i] += node->H[i][j] * step.along[j];
    }
    if (node->parent < 0 || !node->bound) return step;
    double p[6], up[6] = {0};
    for (int k = 0; k < 6; ++k) p[k] = load[k];
    for (int i = 0; i < node->free; ++i)
        for (int k = 0; k < 6; ++k) p[k] -= node->U[i][k] * step.response[i];
    add_load(node->offset, p, up);
    memcpy(load, up, sizeof up);
    return step;
}

int32_t sadmm_articulation_tree_node(const struct articulation_tree *tree, const struct articulation_view *v, int32_t r)
{
    const int32_t *side = v->s.side + 2 * (r / SADMM_MAX_ROWS);
    if (side[0] < 0 || side[1] < 0) return tree->node_of[side[0] < 0 ? side[1] : side[0]];
    const int32_t a = tree->node_of[side[0]], b = tree->node_of[side[1]];
    return a < b ? a : b; /* children come before their parents */
}
