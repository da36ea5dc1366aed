/* A ray against the boxes of a tree (box_tree.h). */
#ifndef SADMM_COLLISION_QUERY_RAY_BOX_H
#define SADMM_COLLISION_QUERY_RAY_BOX_H

#include <stdbool.h>

#include "collision/mesh/mesh_data.h"

struct ray_slabs {
    double x[3], per[3]; /* per: 1 / direction; where that is 0, or nearly, a number as good as infinite */
};

static inline struct ray_slabs ray_slabs_of(const double x[3], const double d[3])
{
    struct ray_slabs s;
    for (int k = 0; k < 3; ++k) {
        s.x[k] = x[k];
        s.per[k] = fabs(d[k]) > 1e-300 ? 1 / d[k] : d[k] < 0 ? -1e300 : 1e300;
    }
    return s;
}

/* Does it meet the box within the limit? *enter: where. Rounding favours meeting: of both ends of a slab each is off by
 * up to 3 units of itself. A box around another one is not entered later, rounding included: where what is in a box is
 * hit at `enter` or later (a distance that is less by rounding is put there), nothing that counts is left out for a
 * limit. */
static inline bool ray_meets_box(const struct ray_slabs *s, const float lo[3], const float hi[3], double limit,
                                 double *enter)
{
    double in = 0, out = limit;
    for (int k = 0; k < 3; ++k) {
        const double a = ((double)lo[k] - s->x[k]) * s->per[k], b = ((double)hi[k] - s->x[k]) * s->per[k],
                     near = a < b ? a : b, far = (a > b ? a : b) * (1 + 8 * DBL_EPSILON);
        in = near > in ? near : in;
        out = far < out ? far : out;
    }
    *enter = in;
    return in <= out;
}

static inline bool ray_meets_node(const struct ray_slabs *s, const struct mesh_node *node, double limit, double *enter)
{
    return ray_meets_box(s, node->lo, node->hi, limit, enter);
}

/* A walk through the nodes, the nearer of two first. What does not fit the stack is walked in the nodes' order. */
enum { RAY_STACK = 64 };
struct ray_walk {
    struct ray_slabs slabs;
    const struct mesh_node *nodes;
    struct {
        double enter;
        int32_t node;
    } stack[RAY_STACK];
    int waiting;
    int32_t at, end; /* nodes to be walked in order */
    double enter;    /* where the leaf's box is entered that came last */
};

static inline void ray_walk_begin(struct ray_walk *w, const struct mesh_node *nodes, int32_t count, const double x[3],
                                  const double d[3])
{
    w->slabs = ray_slabs_of(x, d);
    w->nodes = nodes;
    w->waiting = 0;
    w->at = w->end = 0;
    if (count == 0) return;
    w->stack[0].enter = 0;
    w->stack[0].node = 0;
    w->waiting = 1;
}

/* The next leaf that the ray meets within the limit, which may shrink from call to call; NULL: there is none. */
static inline const struct mesh_node *ray_walk_next(struct ray_walk *w, double limit)
{
    double enter, other;
    while (w->at < w->end) {
        const struct mesh_node *node = &w->nodes[w->at];
        const bool meets = ray_meets_node(&w->slabs, node, limit, &enter);
        w->enter = enter;
        w->at = meets ? w->at + 1 : node->next;
        if (meets && node->first >= 0) return node;
    }
    while (w->waiting > 0) {
        int32_t at = w->stack[--w->waiting].node;
        enter = w->stack[w->waiting].enter;
        if (enter > limit) continue;
        if (at == 0 && !ray_meets_node(&w->slabs, w->nodes, limit, &enter)) continue;
        while (w->nodes[at].first < 0) { /* inner: its children are the next node, and the one after that's subtree */
            int32_t near = at + 1, far = w->nodes[at + 1].next;
            bool to_near = ray_meets_node(&w->slabs, &w->nodes[near], limit, &enter),
                 to_far = ray_meets_node(&w->slabs, &w->nodes[far], limit, &other);
            at = -1;
            if (!to_near && !to_far) break;
            if (to_near && to_far) {
                if (other < enter) {
                    const int32_t swap = near;
                    const double later = enter;
                    near = far;
                    far = swap;
                    enter = other;
                    other = later;
                }
                if (w->waiting == RAY_STACK) {
                    /* nowhere to wait: this node's subtree, in order; what is on the stack comes after it */
                    w->at = near < far ? near : far;
                    w->end = w->nodes[near < far ? far : near].next;
                    return ray_walk_next(w, limit);
                }
                w->stack[w->waiting].enter = other;
                w->stack[w->waiting++].node = far;
                at = near;
            } else {
                at = to_near ? near : far;
                enter = to_near ? enter : other;
            }
        }
        w->enter = enter;
        if (at >= 0) return &w->nodes[at];
    }
    return NULL;
}

#endif
