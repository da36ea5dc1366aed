#include "key_tree.h"

#include <string.h>

#include "memory.h"

/* Finaliser of MurmurHash3; a node's is at least that of those below it. */
static uint64_t priority(uint64_t key)
{
    key ^= key >> 33;
    key *= UINT64_C(0xff51afd7ed558ccd);
    key ^= key >> 33;
    key *= UINT64_C(0xc4ceb9fe1a85ec53);
    return key ^ key >> 33;
}

static uint32_t find(const struct sadmm_key_tree *tree, uint64_t key)
{
    uint32_t at = tree->root;
    while (at && tree->nodes[at].key != key) at = tree->nodes[at].below[tree->nodes[at].key < key];
    return at;
}

double *sadmm_key_tree_find(const struct sadmm_key_tree *tree, uint64_t key)
{
    const uint32_t at = find(tree, key);
    return at ? &tree->nodes[at].value : NULL;
}

bool sadmm_key_tree_reserve(struct sadmm_key_tree *tree)
{
    const size_t used = tree->used > 0 ? tree->used : 1;
    if (tree->spare) return true;
    if (used >= UINT32_MAX || !SADMM_GROW(tree->nodes, tree->used, used + 1)) return false;
    tree->used = used;
    return true;
}

static void count_below(struct sadmm_key_tree *tree, uint32_t at)
{
    struct sadmm_key_node *node = &tree->nodes[at];
    node->size = 1 + tree->nodes[node->below[0]].size + tree->nodes[node->below[1]].size;
}

/* What is below `at` on `side` takes its place. */
static uint32_t lift(struct sadmm_key_tree *tree, uint32_t at, int side)
{
    struct sadmm_key_node *node = &tree->nodes[at];
    const uint32_t up = node->below[side];
    node->below[side] = tree->nodes[up].below[1 - side];
    tree->nodes[up].below[1 - side] = at;
    count_below(tree, at);
    count_below(tree, up);
    return up;
}

/* The subtree at `at` with one node more. */
static uint32_t insert(struct sadmm_key_tree *tree, uint32_t at, uint32_t added)
{
    if (!at) return added;
    struct sadmm_key_node *node = &tree->nodes[at];
    const int side = node->key < tree->nodes[added].key;
    node->below[side] = insert(tree, node->below[side], added);
    count_below(tree, at);
    return priority(tree->nodes[node->below[side]].key) > priority(node->key) ? lift(tree, at, side) : at;
}

/* Two subtrees, all keys of `low` before those of `high`, as one. */
static uint32_t join(struct sadmm_key_tree *tree, uint32_t low, uint32_t high)
{
    if (!low || !high) return low ? low : high;
    const bool low_first = priority(tree->nodes[low].key) > priority(tree->nodes[high].key);
    const uint32_t top = low_first ? low : high;
    uint32_t *between = &tree->nodes[top].below[low_first];
    *between = low_first ? join(tree, *between, high) : join(tree, low, *between);
    count_below(tree, top);
    return top;
}

void sadmm_key_tree_set(struct sadmm_key_tree *tree, uint64_t key, double value)
{
    double *there = sadmm_key_tree_find(tree, key);
    if (there) {
        *there = value;
        return;
    }
    const uint32_t made = tree->spare ? tree->spare : (uint32_t)tree->used++;
    if (tree->spare) tree->spare = tree->nodes[made].below[0];
    tree->nodes[made] = (struct sadmm_key_node){.key = key, .value = value, .size = 1};
    tree->root = insert(tree, tree->root, made);
}

void sadmm_key_tree_remove(struct sadmm_key_tree *tree, uint64_t key)
{
    if (!find(tree, key)) return;
    uint32_t *at = &tree->root;
    while (tree->nodes[*at].key != key) {
        struct sadmm_key_node *node = &tree->nodes[*at];
        --node->size;
        at = &node->below[node->key < key];
    }
    const uint32_t gone = *at;
    *at = join(tree, tree->nodes[gone].below[0], tree->nodes[gone].below[1]);
    tree->nodes[gone] = (struct sadmm_key_node){.below = {tree->spare, 0}};
    tree->spare = gone;
}

const struct sadmm_key_node *sadmm_key_tree_at(const struct sadmm_key_tree *tree, size_t index)
{
    const struct sadmm_key_node *node = &tree->nodes[tree->root];
    for (size_t lower; (lower = tree->nodes[node->below[0]].size) != index;) {
        const bool higher = index > lower;
        if (higher) index -= lower + 1;
        node = &tree->nodes[node->below[higher]];
    }
    return node;
}

const struct sadmm_key_node *sadmm_key_tree_from(const struct sadmm_key_tree *tree, uint64_t key)
{
    const struct sadmm_key_node *least = NULL;
    for (uint32_t at = tree->root; at;) {
        const struct sadmm_key_node *node = &tree->nodes[at];
        if (node->key >= key) least = node;
        at = node->below[node->key < key];
    }
    return least;
}

void sadmm_key_tree_free(struct sadmm_key_tree *tree)
{
    sadmm_free(tree->nodes);
    memset(tree, 0, sizeof *tree);
}
