/* Which body of a tree hangs on which (articulation_tree.h). */
#include "articulation_tree.h"

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
    node->offset[3] = 0;
    for (int32_t at = s->first_around[e]; at < s->first_around[e + 1]; ++at) {
        const int32_t other = other_side(s, s->around[at]);
        if (other >= 0 && other != parent[e]) continue;
        tree->joint[(*joints)++] = s->around[at];
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
    for (int32_t k = s->bodies; k-- > 0;) put_node(s, queue[k], parent, tree, tree->node_of[queue[k]], &joints);
    for (int32_t n = 0; n < tree->nodes; ++n) {
        int32_t depth = 1;
        for (int32_t up = tree->node[n].parent; up >= 0; up = tree->node[up].parent) ++depth;
        if (depth > tree->depth) tree->depth = depth;
    }
}

int32_t sadmm_articulation_tree_node(const struct articulation_tree *tree, const struct articulation_view *v, int32_t r)
{
    const int32_t *side = v->s.side + 2 * (r / SADMM_MAX_ROWS);
    if (side[0] < 0 || side[1] < 0) return tree->node_of[side[0] < 0 ? side[1] : side[0]];
    const int32_t a = tree->node_of[side[0]], b = tree->node_of[side[1]];
    return a < b ? a : b; /* children come before their parents */
}
