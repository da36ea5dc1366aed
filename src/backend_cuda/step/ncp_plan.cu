/* Trees of articulations for the dense contact solve (ncp_island.h): their plan goes to the device. */
#include <string.h>

#include <algorithm>
#include <vector>

#include "world.h"
#include "core/base/memory.h"
#include "core/solve/articulation_order.h"

/* Memory of all islands at a time at most, and of one: by blocks these have as much however many there are. */
#define NCP_MEMORY ((size_t)512 << 20)
#define NCP_ISLAND_MEMORY ((size_t)1900 << 10)

/* In BUFFER_NCP, in this order: what the host gives; then what is the device's own. */
struct ncp_arrays {
    struct cuda_ncp_part *parts;
    struct cuda_ncp_node *nodes;
    int32_t *joints, *part_of;
    size_t given;
    int32_t *number, *solved, *islands, *left, *count, *unsolved, *missed, *left_count; /* the last four side by side */
    size_t bytes;
};

static struct ncp_arrays arrays_at(char *at, const struct cuda_step *s)
{
    const size_t n = (size_t)s->bodies;
    struct ncp_arrays a;
    a.parts = (struct cuda_ncp_part *)at;
    a.nodes = (struct cuda_ncp_node *)(a.parts + s->articulations);
    a.joints = (int32_t *)(a.nodes + n);
    a.part_of = a.joints + 2 * (size_t)s->joint_constraints;
    a.number = a.part_of + n;
    a.given = (size_t)((char *)a.number - at);
    a.solved = a.number + n;
    a.islands = a.solved + n;
    a.left = a.islands + n;
    a.count = a.left + n;
    a.unsolved = a.count + 1;
    a.missed = a.unsolved + 1;
    a.left_count = a.missed + 1;
    a.bytes = (size_t)((char *)(a.left_count + 1) - at);
    return a;
}

/* A part while its trees are made. */
struct forest {
    const struct articulation_structure *s;
    int32_t first_gear;
    std::vector<int32_t> parent, queue; /* -2: not seen; bodies, roots before their children */
};

static bool is_gear(const struct forest &f, int32_t around) { return f.s->constraint[around / 2] >= f.first_gear; }

/* Bodies that joints connect to `root`, from queue[first] on. False: some are connected twice. */
static bool list_bodies(struct forest *f, int32_t root, size_t first)
{
    f->queue.resize(first);
    f->queue.push_back(root);
    f->parent[root] = -1;
    for (size_t k = first; k < f->queue.size(); ++k) {
        const int32_t e = f->queue[k];
        for (int32_t at = f->s->first_around[e]; at < f->s->first_around[e + 1]; ++at) {
            const int32_t other = f->s->side[f->s->around[at] ^ 1];
            if (is_gear(*f, f->s->around[at]) || other < 0 || other == f->parent[e]) continue;
            if (f->parent[other] == -2) {
                f->parent[other] = e;
                f->queue.push_back(other);
            } else if (f->parent[other] != e) return false;
        }
    }
    return true;
}

/* Begin again with another root. */
static bool list_again(struct forest *f, int32_t root, size_t first)
{
    for (size_t k = first; k < f->queue.size(); ++k) f->parent[f->queue[k]] = -2;
    return list_bodies(f, root, first);
}

/* The tree that body e is in: from the body that is held by what is not solved for, or halfway along the longest path.
 * False: it is none. */
static bool add_tree(struct forest *f, int32_t e)
{
    const size_t first = f->queue.size();
    int32_t held = -1, length = 0;
    if (!list_bodies(f, e, first)) return false;
    for (size_t k = first; k < f->queue.size(); ++k)
        for (int32_t at = f->s->first_around[f->queue[k]]; at < f->s->first_around[f->queue[k] + 1]; ++at) {
            if (is_gear(*f, f->s->around[at]) || f->s->side[f->s->around[at] ^ 1] >= 0) continue;
            if (held >= 0 && held != f->queue[k]) return false;
            held = f->queue[k];
        }
    if (held >= 0) return list_again(f, held, first);
    (void)list_again(f, f->queue.back(), first);
    for (e = f->queue.back(); f->parent[e] >= 0; e = f->parent[e]) ++length;
    for (e = f->queue.back(); length > 1; length -= 2) e = f->parent[e];
    return list_again(f, e, first);
}

static bool add_trees(struct forest *f)
{
    f->parent.assign((size_t)f->s->bodies, -2);
    for (int32_t e = 0; e < f->s->bodies; ++e)
        if (f->parent[(size_t)e] == -2 && !add_tree(f, e)) return false;
    return true;
}

/* Nodes of a part: children before their parents. joints: where its joints go on from. */
static void put_nodes(const struct forest &f, struct cuda_ncp_part *part, struct cuda_ncp_node *nodes, int32_t *joint,
                      int32_t *joints)
{
    const int32_t count = f.s->bodies;
    std::vector<int32_t> node_of((size_t)count);
    for (int32_t k = 0; k < count; ++k) node_of[(size_t)f.queue[(size_t)k]] = count - 1 - k;
    for (int32_t n = 0; n < count; ++n) nodes[n].child = nodes[n].sibling = -1;
    part->nodes = count;
    part->levels = 0;
    for (int32_t k = 0; k < count; ++k) { /* parents first */
        const int32_t e = f.queue[(size_t)k], up = f.parent[(size_t)e];
        struct cuda_ncp_node *node = &nodes[count - 1 - k];
        node->body = f.s->body[e];
        node->parent = up >= 0 ? node_of[(size_t)up] : -1;
        node->level = up >= 0 ? nodes[node->parent].level + 1 : 0;
        part->levels = std::max(part->levels, node->level + 1);
        if (up >= 0) {
            node->sibling = nodes[node->parent].child;
            nodes[node->parent].child = count - 1 - k;
        }
        node->first_joint = *joints;
        for (int32_t at = f.s->first_around[e]; at < f.s->first_around[e + 1]; ++at) {
            const int32_t around = f.s->around[at], other = f.s->side[around ^ 1];
            if (is_gear(f, around) || (other >= 0 && other != up)) continue;
            joint[(*joints)++] = 2 * f.s->constraint[around / 2] + around % 2;
        }
        node->joints = *joints - node->first_joint;
    }
    part->first_gear = *joints;
    for (int32_t p = 0; p < f.s->columns; ++p)
        if (f.s->constraint[p] >= f.first_gear) joint[(*joints)++] = f.s->constraint[p];
    part->gears = *joints - part->first_gear;
}

/* Is any part a tree? */
static bool fill(const struct cuda_step *s, int32_t first_gear, const struct sadmm_articulation_order *order,
                 const struct ncp_arrays &a)
{
    int32_t nodes = 0, joints = 0;
    bool any = false;
    for (int32_t i = 0; i < s->bodies; ++i) a.part_of[i] = -1;
    for (int32_t k = 0; k < s->articulations; ++k) {
        const struct articulation_structure part = sadmm_articulation_part(order, k);
        struct forest f = {&part, first_gear, {}, {}};
        a.parts[k] = {};
        a.parts[k].first = nodes;
        if (add_trees(&f)) {
            put_nodes(f, &a.parts[k], a.nodes + nodes, a.joints, &joints);
            any = true;
        }
        for (int32_t e = 0; e < part.bodies; ++e) a.part_of[part.body[e]] = k;
        nodes += part.bodies;
    }
    return any;
}

sadmm_status CUDA(load_ncp)(struct sadmm_context *c, int32_t first_gear, const struct sadmm_articulation_order *order,
                            struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const struct ncp_arrays size = arrays_at(nullptr, s);
    TRY(CUDA(reserve)(c, BUFFER_NCP, size.bytes, error));
    char *host = (char *)sadmm_alloc(size.given, 1);
    if (!host) return sadmm_fail_memory(error, "trees of the dense contact solve");
    s->ncp_trees = fill(s, first_gear, order, arrays_at(host, s));
    const sadmm_status status = CUDA(put)(c, buffer<char>(c, BUFFER_NCP), host, size.given, error);
    sadmm_free(host);
    return status;
}

sadmm_status CUDA(reserve_ncp)(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    if (!solves_ncp(c)) return SADMM_OK;
    size_t most = 0;
    for (int large = 0; large < 2; ++large) {
        struct ncp_block_memory *blocks = &s->ncp_blocks[large];
        blocks->count = large ? std::min(s->bodies, (int)NCP_LARGE_EACH * c->multiprocessors) : c->multiprocessors;
        const size_t islands = (size_t)blocks->count * (large ? 1 : (size_t)NCP_WARPS); /* at a time */
        blocks->bytes = std::min(NCP_ISLAND_MEMORY, NCP_MEMORY / islands / 16 * 16);
        if (large || !has_large_ncp_blocks(c)) most = std::max(most, islands * blocks->bytes);
    }
    TRY(CUDA(reserve)(c, BUFFER_NCP_IMPULSE, 3 * (size_t)s->point_capacity * sizeof(double), error));
    return CUDA(reserve)(c, BUFFER_NCP_MEMORY, most, error);
}

void CUDA(view_ncp)(struct sadmm_context *c)
{
    struct ncp_view none = {};
    c->view.ncp = none;
    if (!solves_ncp(c)) return;
    const struct ncp_arrays a = arrays_at(buffer<char>(c, BUFFER_NCP), c->step);
    struct ncp_view *v = &c->view.ncp;
    v->points = c->settings.ncp_points;
    v->parts = a.parts;
    v->nodes = a.nodes;
    v->joints = a.joints;
    v->part_of = a.part_of;
    v->number = a.number;
    v->solved = a.solved;
    v->islands = a.islands;
    v->count = a.count;
    v->unsolved = a.unsolved;
    v->missed = a.missed;
    v->left = a.left;
    v->left_count = a.left_count;
    v->impulse = buffer<double>(c, BUFFER_NCP_IMPULSE);
    v->memory = buffer<char>(c, BUFFER_NCP_MEMORY);
}
