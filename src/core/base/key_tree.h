/* Numbers by key, in the order of keys: found, set and removed, the one at an index and the next after a key in O(log
 * n) steps each, in whatever order keys come and go. A treap whose priorities are a hash of the keys: its shape, and
 * all that is read of it, depends on the keys alone. */
#ifndef SADMM_CORE_BASE_KEY_TREE_H
#define SADMM_CORE_BASE_KEY_TREE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct sadmm_key_node {
    uint64_t key;
    double value;
    uint32_t below[2]; /* lower and higher keys; 0: none */
    uint32_t size;     /* nodes from here on down */
};

/* All 0: empty. */
struct sadmm_key_tree {
    struct sadmm_key_node *nodes; /* the first one stands for none */
    size_t used;
    uint32_t root, spare; /* spare: removed nodes, a list by below[0] */
};

static inline size_t sadmm_key_tree_count(const struct sadmm_key_tree *tree)
{
    return tree->root ? tree->nodes[tree->root].size : 0;
}

/* Its value; NULL: there is no such key. */
double *sadmm_key_tree_find(const struct sadmm_key_tree *tree, uint64_t key);
/* Room for one key more; false, with nothing changed, when memory runs out. */
bool sadmm_key_tree_reserve(struct sadmm_key_tree *tree);
/* There is room, or the key is there. */
void sadmm_key_tree_set(struct sadmm_key_tree *tree, uint64_t key, double value);
void sadmm_key_tree_remove(struct sadmm_key_tree *tree, uint64_t key);
/* index in [0, count). */
const struct sadmm_key_node *sadmm_key_tree_at(const struct sadmm_key_tree *tree, size_t index);
/* The lowest key that is `key` or more; NULL: there is none. */
const struct sadmm_key_node *sadmm_key_tree_from(const struct sadmm_key_tree *tree, uint64_t key);
void sadmm_key_tree_free(struct sadmm_key_tree *tree);

#endif
