#include "query_tree.h"

#include <string.h>

#include "collision/mesh/mesh_walk.h"
#include "core/base/memory.h"
#include "ray_box.h"

/* A tree that shapes have moved in is made again when a walk through it costs so much more than it did. */
#define WORN 1.5

void sadmm_query_tree_free(struct sadmm_query_tree *tree)
{
    sadmm_box_tree_free(&tree->tree);
    sadmm_free(tree->shapes);
    sadmm_free(tree->boxes);
    memset(tree, 0, sizeof *tree);
}

sadmm_status sadmm_query_tree_reserve(struct sadmm_query_tree *tree, size_t shapes, struct sadmm_error *error)
{
    /* one at least, so that there is an array */
    if (!SADMM_GROW(tree->shapes, 0, 2 * shapes + 1) || !SADMM_GROW(tree->boxes, 0, shapes + 1))
        return sadmm_fail_memory(error, "a query");
    return SADMM_OK;
}

/* Bodies are within 1e9 m of the origin as a rule. What is farther away by far has a box whose sizes are numbers. */
static double kept(double x) { return x > 1e18 ? 1e18 : x < -1e18 ? -1e18 : x; }

static void box_of(const struct sadmm_placed *shape, struct float_box *box)
{
    struct sadmm_box3 exact;
    placed_box(shape, &exact);
    for (int k = 0; k < 3; ++k) float_box_set(kept(exact.lo[k]), kept(exact.hi[k]), k, box);
}

/* The areas of all nodes over the root's: what a walk costs, as the surface area heuristic has it. */
static double cost_of(const struct box_tree *tree)
{
    double sum = 0, root = 0;
    for (int32_t i = 0; i < tree->count; ++i) {
        const struct mesh_node *n = &tree->nodes[i];
        const double x = (double)n->hi[0] - (double)n->lo[0], y = (double)n->hi[1] - (double)n->lo[1],
                     z = (double)n->hi[2] - (double)n->lo[2], area = x * y + y * z + z * x;
        if (i == 0) root = area;
        sum += area;
    }
    return root > 0 ? sum / root : 0;
}

sadmm_status sadmm_query_tree_make(struct sadmm_query_tree *tree, size_t shapes, struct sadmm_error *error)
{
    /* from the second half of the room to its first: those of the tree in its order, then planes */
    struct sadmm_placed *from = tree->shapes + shapes;
    size_t with_box = 0;
    memcpy(from, tree->shapes, shapes * sizeof *from);
    tree->count = tree->planes = 0;
    sadmm_box_tree_free(&tree->tree);
    for (size_t i = 0; i < shapes; ++i) {
        if (from[i].geometry.type == SADMM_SHAPE_PLANE) continue;
        if (with_box < i) {
            const struct sadmm_placed swap = from[i]; /* planes wander to the end */
            from[i] = from[with_box];
            from[with_box] = swap;
        }
        box_of(&from[with_box], &tree->boxes[with_box]);
        ++with_box;
    }
    if (!sadmm_box_tree_make(tree->boxes, (int32_t)with_box, &tree->tree)) return sadmm_fail_memory(error, "a query");
    for (size_t i = 0; i < with_box; ++i) {
        tree->shapes[i] = from[tree->tree.order[i]];
        box_of(&tree->shapes[i], &tree->boxes[i]);
    }
    memcpy(tree->shapes + with_box, from + with_box, (shapes - with_box) * sizeof *from);
    tree->count = (int32_t)with_box;
    tree->planes = (int32_t)(shapes - with_box);
    tree->cost = cost_of(&tree->tree);
    return SADMM_OK;
}

static void include(struct mesh_node *node, const float lo[3], const float hi[3])
{
    for (int k = 0; k < 3; ++k) {
        node->lo[k] = lo[k] < node->lo[k] ? lo[k] : node->lo[k];
        node->hi[k] = hi[k] > node->hi[k] ? hi[k] : node->hi[k];
    }
}

bool sadmm_query_tree_follow(struct sadmm_query_tree *tree)
{
    struct mesh_node *nodes = tree->tree.nodes;
    for (int32_t i = tree->tree.count - 1; i >= 0; --i) { /* what is below a node comes after it */
        struct mesh_node *node = &nodes[i];
        for (int k = 0; k < 3; ++k) {
            node->lo[k] = HUGE_VALF;
            node->hi[k] = -HUGE_VALF;
        }
        if (node->first < 0) {
            const struct mesh_node *left = node + 1, *right = &nodes[left->next];
            include(node, left->lo, left->hi);
            include(node, right->lo, right->hi);
            continue;
        }
        for (int32_t s = node->first >> 3; s < (node->first >> 3) + (node->first & 7); ++s) {
            struct float_box *box = &tree->boxes[s];
            box_of(&tree->shapes[s], box);
            include(node, box->lo, box->hi);
        }
    }
    return cost_of(&tree->tree) <= WORN * tree->cost;
}

/* ---- rays -------------------------------------------------------------------------------------------------------- */

struct cast {
    const struct sadmm_ray_line *ray;
    const struct sadmm_shape_filter *filter;
    struct sadmm_query_hit *hits;
    int32_t capacity, kept, all;
    bool first;
    double limit; /* what is farther is not asked for */
};

static bool comes_before(const struct sadmm_query_hit *a, const struct sadmm_query_hit *b)
{
    return a->find.distance < b->find.distance || (a->find.distance == b->find.distance && a->slot < b->slot);
}

/* enter: where the ray enters its box. */
static void try_shape(struct cast *c, const struct sadmm_placed *shape, double enter)
{
    struct sadmm_query_hit hit;
    if (!sadmm_query_sees(c->filter, shape) || !sadmm_ray_cast(c->ray, shape, c->limit, &hit.find)) return;
    if (hit.find.distance < enter) { /* by rounding (ray_box.h) */
        hit.find.distance = enter;
        hit.find.inside = false;
    }
    if (hit.find.distance > c->limit) return;
    hit.slot = shape->slot;
    hit.body = shape->body;
    if (c->all < INT32_MAX) ++c->all;
    int32_t place = c->kept;
    while (place > 0 && comes_before(&hit, &c->hits[place - 1])) --place;
    if (place == c->capacity) return;
    const int32_t last = c->kept < c->capacity ? c->kept++ : c->kept - 1;
    memmove(c->hits + place + 1, c->hits + place, (size_t)(last - place) * sizeof hit);
    c->hits[place] = hit;
    if (c->first && c->kept == c->capacity) c->limit = c->hits[c->kept - 1].find.distance;
}

int32_t sadmm_query_tree_cast(const struct sadmm_query_tree *tree, const struct sadmm_ray_line *ray,
                              const struct sadmm_shape_filter *filter, bool first, int32_t capacity,
                              struct sadmm_query_hit *hits)
{
    struct cast c = {
        .ray = ray, .filter = filter, .hits = hits, .capacity = capacity, .first = first, .limit = ray->length};
    const struct mesh_node *leaf;
    struct ray_walk walk;
    for (int32_t i = 0; i < tree->planes; ++i) try_shape(&c, &tree->shapes[tree->count + i], 0);
    ray_walk_begin(&walk, tree->tree.nodes, tree->tree.count, ray->origin, ray->direction);
    while ((leaf = ray_walk_next(&walk, c.limit)))
        for (int32_t s = leaf->first >> 3; s < (leaf->first >> 3) + (leaf->first & 7); ++s) {
            double enter;
            if (ray_meets_box(&walk.slabs, tree->boxes[s].lo, tree->boxes[s].hi, c.limit, &enter))
                try_shape(&c, &tree->shapes[s], enter);
        }
    return first ? c.kept : c.all;
}

/* ---- boxes ------------------------------------------------------------------------------------------------------- */

static bool plane_meets(const struct sadmm_placed *plane, const struct sadmm_box3 *box)
{
    double lowest = 0;
    for (int k = 0; k < 3; ++k) {
        const double n = plane->R[3 * k + 2];
        if (n == 0) continue; /* the box may have no end that way */
        lowest += n * ((n > 0 ? box->lo[k] : box->hi[k]) - plane->x[k]);
    }
    return lowest <= 0;
}

const struct sadmm_placed *sadmm_query_tree_next(const struct sadmm_query_tree *tree, const struct sadmm_box3 *box,
                                                 const struct sadmm_shape_filter *filter, struct sadmm_query_walk *walk)
{
    for (;;) {
        while (walk->shape < walk->last) {
            const struct sadmm_placed *shape = &tree->shapes[walk->shape++];
            struct sadmm_box3 own;
            if (!sadmm_query_sees(filter, shape)) continue;
            placed_box(shape, &own);
            if (boxes_overlap(&own, box)) return shape;
        }
        if (walk->node == tree->tree.count) break;
        const struct mesh_node *node = &tree->tree.nodes[walk->node];
        const bool meets = mesh_node_near(node, box);
        walk->node = meets ? walk->node + 1 : node->next;
        if (!meets || node->first < 0) continue;
        walk->shape = node->first >> 3;
        walk->last = walk->shape + (node->first & 7);
    }
    while (walk->plane < tree->planes) {
        const struct sadmm_placed *plane = &tree->shapes[tree->count + walk->plane++];
        if (sadmm_query_sees(filter, plane) && plane_meets(plane, box)) return plane;
    }
    return NULL;
}
