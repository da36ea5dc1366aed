/* The shapes of a world as queries find them: those that have a box in a tree, planes beside it. It is made when it is
 * asked for, follows shapes that move, and nothing of it shows in a result.
 */
#ifndef SADMM_COLLISION_QUERY_QUERY_TREE_H
#define SADMM_COLLISION_QUERY_QUERY_TREE_H

#include "collision/mesh/box_tree.h"
#include "core/base/error.h"
#include "ray.h"

struct sadmm_query_tree {
    struct sadmm_placed *shapes; /* as the tree comes to them, then planes */
    int32_t count, planes;
    struct box_tree tree;
    double cost;             /* of walks through it, when it was made */
    struct float_box *boxes; /* of the shapes in it, in their order */
};

void sadmm_query_tree_free(struct sadmm_query_tree *tree);

/* Room for so many shapes, which the caller then fills in, in any order. OUT_OF_MEMORY. */
sadmm_status sadmm_query_tree_reserve(struct sadmm_query_tree *tree, size_t shapes, struct sadmm_error *error);
/* Make the tree over the first `shapes` of them. OUT_OF_MEMORY: it is empty. */
sadmm_status sadmm_query_tree_make(struct sadmm_query_tree *tree, size_t shapes, struct sadmm_error *error);
/* The shapes have been placed anew, each where it was in the list: boxes follow. False: the tree is no good any more,
 * and is to be made again. */
bool sadmm_query_tree_follow(struct sadmm_query_tree *tree);

/* Which shapes a query sees. */
struct sadmm_shape_filter {
    uint32_t body_types;     /* bits */
    int32_t ignored;         /* body, -1: none */
    int32_t environment;     /* -1: all */
    uint32_t category, mask; /* both 0: all */
    bool sensors;            /* these too */
};

static inline bool sadmm_query_sees(const struct sadmm_shape_filter *f, const struct sadmm_placed *s)
{
    return (f->body_types & s->body_type) != 0 && s->body != f->ignored && (f->sensors || !s->sensor) &&
           (f->environment < 0 || s->environment < 0 || f->environment == s->environment) &&
           ((f->category | f->mask) == 0 || ((f->category & s->mask) != 0 && (s->category & f->mask) != 0));
}

/* A shape that a ray meets. */
struct sadmm_query_hit {
    uint32_t slot;
    int32_t body;
    struct sadmm_ray_find find;
};

/* The hits of a ray that come first, by distance, of equal ones by slot: at most `capacity` of them, in order; returns
 * how many there are of all. `first`: nobody asks for that number; it is at most `capacity` then, which makes it
 * quick. */
int32_t sadmm_query_tree_cast(const struct sadmm_query_tree *tree, const struct sadmm_ray_line *ray,
                              const struct sadmm_shape_filter *filter, bool first, int32_t capacity,
                              struct sadmm_query_hit *hits);

/* Where a walk over shapes is; all 0 before the first one. */
struct sadmm_query_walk {
    int32_t node, shape, last, plane;
};

/* The next of the shapes whose boxes meet a box, and of the planes whose solids do, in the tree's order; NULL: there
 * are no more. */
const struct sadmm_placed *sadmm_query_tree_next(const struct sadmm_query_tree *tree, const struct sadmm_box3 *box,
                                                 const struct sadmm_shape_filter *filter,
                                                 struct sadmm_query_walk *walk);

#endif
