/* Split, from the root down, where the surface area heuristic (MacDonald and Booth, "Heuristics for ray tracing using
 * space subdivision", The Visual Computer 1990) is least over a few planes across the longest axis (Wald, "On fast
 * construction of SAH-based bounding volume hierarchies", 2007).
 */
#include "box_tree.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"

enum {
    BINS = 16,
    MORE_TASKS = 32,                      /* no 2^28 boxes are split in the middle more often, ... */
    TASKS = BOX_TREE_WAITING - MORE_TASKS /* ... which is done from so many ranges that wait on */
};

struct range {
    int32_t begin, end;
};

struct making {
    const struct float_box *boxes; /* as they are numbered */
    int32_t *order, *spare;
    struct box_tree *tree;
    int32_t *first_node; /* by place in the order: the first node whose range begins there, -1 */
};

static const struct float_box nothing = {{HUGE_VALF, HUGE_VALF, HUGE_VALF}, {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF}};

static void include(struct float_box *box, const struct float_box *other)
{
    for (int k = 0; k < 3; ++k) {
        if (other->lo[k] < box->lo[k]) box->lo[k] = other->lo[k];
        if (other->hi[k] > box->hi[k]) box->hi[k] = other->hi[k];
    }
}

/* Twice the middle: only compared. */
static float middle_of(const struct float_box *box, int axis) { return box->lo[axis] + box->hi[axis]; }

static float area_of(const struct float_box *box)
{
    const float x = box->hi[0] - box->lo[0], y = box->hi[1] - box->lo[1], z = box->hi[2] - box->lo[2];
    return x * y + y * z + z * x;
}

/* Which bin a box is in, of a range whose middles are in [low, high]. */
static int bin_of(const struct float_box *box, int axis, float low, float high)
{
    const int bin = (int)((float)BINS * ((middle_of(box, axis) - low) / (high - low)));
    return bin < BINS - 1 ? bin : BINS - 1;
}

/* The first bin of the second part. */
static int best_bin(const struct making *m, struct range r, int axis, float low, float high)
{
    struct float_box bins[BINS], from_left = nothing, from_right = nothing;
    int32_t counts[BINS] = {0}, left = 0, right = 0;
    float right_costs[BINS] = {0}, least = HUGE_VALF;
    int best = BINS / 2;
    for (int b = 0; b < BINS; ++b) bins[b] = nothing;
    for (int32_t i = r.begin; i < r.end; ++i) {
        const struct float_box *box = &m->boxes[m->order[i]];
        const int b = bin_of(box, axis, low, high);
        include(&bins[b], box);
        ++counts[b];
    }
    for (int b = BINS - 1; b > 0; --b) {
        include(&from_right, &bins[b]);
        right += counts[b];
        right_costs[b] = right > 0 ? (float)right * area_of(&from_right) : HUGE_VALF;
    }
    for (int b = 1; b < BINS; ++b) {
        include(&from_left, &bins[b - 1]);
        left += counts[b - 1];
        const float cost = left > 0 ? (float)left * area_of(&from_left) + right_costs[b] : HUGE_VALF;
        if (cost < least) {
            least = cost;
            best = b;
        }
    }
    return best;
}

/* Order the range by its two parts, each as it was; where the second one begins. */
static int32_t split(struct making *m, struct range r)
{
    struct float_box middles = nothing;
    int axis = 0;
    for (int32_t i = r.begin; i < r.end; ++i)
        for (int k = 0; k < 3; ++k) {
            const float x = middle_of(&m->boxes[m->order[i]], k);
            if (x < middles.lo[k]) middles.lo[k] = x;
            if (x > middles.hi[k]) middles.hi[k] = x;
        }
    for (int k = 1; k < 3; ++k)
        if (middles.hi[k] - middles.lo[k] > middles.hi[axis] - middles.lo[axis]) axis = k;
    const float low = middles.lo[axis], high = middles.hi[axis];
    if (!(high > low)) return r.begin + (r.end - r.begin) / 2;
    const int first = best_bin(m, r, axis, low, high);
    int32_t to = r.begin, rest = 0;
    for (int32_t i = r.begin; i < r.end; ++i) {
        const int32_t box = m->order[i];
        if (bin_of(&m->boxes[box], axis, low, high) < first) m->order[to++] = box;
        else m->spare[rest++] = box;
    }
    memcpy(m->order + to, m->spare, (size_t)rest * sizeof *m->spare);
    return to > r.begin && to < r.end ? to : r.begin + (r.end - r.begin) / 2;
}

static void add_node(struct making *m, struct range r)
{
    struct mesh_node *node = &m->tree->nodes[m->tree->count];
    struct float_box box = nothing;
    const bool leaf = r.end - r.begin <= MESH_LEAF;
    for (int32_t i = r.begin; i < r.end; ++i) include(&box, &m->boxes[m->order[i]]);
    memcpy(node->lo, box.lo, sizeof node->lo);
    memcpy(node->hi, box.hi, sizeof node->hi);
    node->first = leaf ? r.begin << 3 | (r.end - r.begin) : -1;
    node->next = r.end; /* for now */
    if (m->first_node[r.begin] < 0) m->first_node[r.begin] = m->tree->count;
    ++m->tree->count;
}

/* Depth first: the second part of each range waits on a stack while the first one is worked on. */
static void make_nodes(struct making *m, int32_t count)
{
    struct range stack[TASKS + MORE_TASKS];
    int waiting = 1;
    stack[0] = (struct range){0, count};
    while (waiting > 0) {
        const struct range r = stack[--waiting];
        add_node(m, r);
        if (r.end - r.begin <= MESH_LEAF) continue;
        const int32_t middle = waiting < TASKS ? split(m, r) : r.begin + (r.end - r.begin) / 2;
        stack[waiting++] = (struct range){middle, r.end};
        stack[waiting++] = (struct range){r.begin, middle};
    }
    /* the node after a subtree is the first one of what comes after its range */
    for (int32_t i = 0; i < m->tree->count; ++i) {
        const int32_t end = m->tree->nodes[i].next;
        m->tree->nodes[i].next = end < count ? m->first_node[end] : m->tree->count;
    }
}

bool sadmm_box_tree_make(const struct float_box *boxes, int32_t count, struct box_tree *tree)
{
    const size_t n = (size_t)count;
    struct making m = {.boxes = boxes, .tree = tree};
    m.spare = (int32_t *)sadmm_alloc(n, sizeof *m.spare);
    m.first_node = (int32_t *)sadmm_alloc(n, sizeof *m.first_node);
    m.order = (int32_t *)sadmm_alloc(n, sizeof *m.order);
    memset(tree, 0, sizeof *tree);
    tree->order = m.order;
    tree->nodes = (struct mesh_node *)sadmm_alloc(2 * n, sizeof *tree->nodes);
    const bool made = m.spare && m.first_node && m.order && tree->nodes;
    if (made && count > 0) {
        for (int32_t i = 0; i < count; ++i) {
            m.order[i] = i;
            m.first_node[i] = -1;
        }
        make_nodes(&m, count);
    }
    sadmm_free(m.spare);
    sadmm_free(m.first_node);
    if (!made) sadmm_box_tree_free(tree);
    return made;
}

void sadmm_box_tree_free(struct box_tree *tree)
{
    sadmm_free(tree->order);
    sadmm_free(tree->nodes);
    memset(tree, 0, sizeof *tree);
}
