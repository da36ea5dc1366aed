/* G of the dense contact solve where all parts of the island are solved by their trees (ncp_island.h). */
#include <string.h>

#include "core/math/six.h"
#include "ncp_island.h"
#include "ncp_kernels.h"

static int32_t node_of(const struct island *s, int32_t number, int32_t *part)
{
    const int32_t i = s->d->bodies[number].body;
    *part = s->articulations->part[i];
    if (*part < 0) return s->d->first_node[s->parts] + number;
    for (*part = 0; s->d->parts[*part] != s->articulations->part[i];) ++*part;
    return s->d->first_node[*part] + part_of(s, *part)->tree.node_of[s->articulations->entry[i]];
}

/* Where a load is on its way. */
struct way {
    int32_t node, part; /* node -1: it has ended; part -1: of a body without joints */
    double load[SIX];
};

static void begin_way(const struct island *s, int32_t number, const double *row, struct way *way)
{
    way->node = node_of(s, number, &way->part);
    six_put(six_load(row), way->load);
}

static void pass_free(const struct island *s, struct way *way, struct ncp_passed *to)
{
    const int32_t number = way->node - s->d->first_node[s->parts];
    to->node = way->node;
    six_store(six_at(way->load), to->along);
    to->along[6] = to->along[7] = to->response[6] = to->response[7] = 0;
    ldl6_solve(s->d->bodies[number].factor, to->along, to->response); /* there: a contact is on it */
    way->node = -1;
}

/* A load on its way to the root: on the node's body, with what its child has handed on; then what it hands on to its
 * parent. along: what acts along S besides, NULL: nothing does. z, response: S^T p, and H S^T p. */
static void pass_tree_node(const struct articulation_node *node, double load[SIX], const double *along, double z[8],
                           double response[8])
{
    six p = six_at(load);
    six_put(six_zero(), z);
    six_put(six_zero(), response);
    for (int i = 0; i < node->free; ++i) z[i] = six_dot(six_at(node->S[i]), p) + (along ? along[i] : 0);
    for (int i = 0; i < node->free; ++i) {
        double sum = 0;
        for (int j = 0; j < node->free; ++j) sum += node->H[i][j] * z[j];
        response[i] = sum;
    }
    if (node->parent < 0 || !node->bound) return;
    for (int i = 0; i < node->free; ++i) p = six_madd(p, -response[i], six_at(node->U[i]));
    six_put(six_hand_on(*(const three *)node->offset, p), load);
}

static void pass_node(const struct island *s, struct way *way, const double *along, struct ncp_passed *to)
{
    if (way->part < 0) {
        pass_free(s, way, to);
        return;
    }
    const struct articulation_tree *tree = &part_of(s, way->part)->tree;
    const struct articulation_node *node = &tree->node[way->node - s->d->first_node[way->part]];
    pass_tree_node(node, way->load, along, to->along, to->response);
    to->node = way->node;
    way->node = node->parent >= 0 && node->bound ? s->d->first_node[way->part] + node->parent : -1;
}

/* Both ways at once: children come before their parents, and what two ways have in common is one. */
static int32_t pass_all(const struct island *s, struct way way[2], const double *along, struct ncp_passed *to)
{
    int32_t count = 0;
    while (way[0].node >= 0 || way[1].node >= 0) {
        if (way[0].node == way[1].node) {
            six_put(six_add(six_at(way[0].load), six_at(way[1].load)), way[0].load);
            way[1].node = -1;
        }
        const int first = way[0].node < 0 || (way[1].node >= 0 && way[1].node < way[0].node);
        pass_node(s, &way[first], along, &to[count++]);
        along = NULL;
    }
    return count;
}

static int32_t pass_column(const struct island *s, int32_t number, struct ncp_passed *to)
{
    struct way way[2] = {{.node = -1}, {.node = -1}};
    if (number < 3 * s->contacts) {
        const struct ncp_contact *c = &s->d->contacts[number / 3];
        for (int k = 0; k < 2; ++k)
            if (c->body[k] >= 0) begin_way(s, c->body[k], c->row[k][number % 3], &way[k]);
        return pass_all(s, way, NULL, to);
    }
    const struct ncp_active *active = &s->active_row[number - 3 * s->contacts];
    const struct articulation_part *part = part_of(s, active->part);
    const struct articulation_tree *tree = &part->tree;
    way[0].part = active->part;
    way[0].node = s->d->first_node[active->part] + sadmm_articulation_tree_node(tree, &part->view, active->r);
    return pass_all(s, way, tree->row[tree->row_of[active->r]].along, to);
}

/* Nodes on the way of a number, at most. */
static int32_t longest_way(const struct island *s)
{
    int32_t most = 1;
    for (int32_t k = 0; k < s->parts; ++k)
        if (part_of(s, k)->tree.depth > most) most = part_of(s, k)->tree.depth;
    return 2 * most;
}

void SADMM_KERNEL(ncp_tree_responses)(struct island *s, double *G)
{
    const int32_t n = s->dense.size, room = longest_way(s), nodes = s->d->first_node[s->parts] + s->bodies;
    const struct ncp_passed **at = s->d->passed_at;
    int32_t *counts = s->d->passed_counts;
    memset(at, 0, (size_t)nodes * sizeof *at);
    s->dense.budget -= (double)n * n * room;
    for (int32_t k = 0; k < s->parts; ++k) sadmm_articulation_part_factorize(part_of(s, k));
    for (int32_t c = 0; c < n; ++c) {
        struct ncp_passed *own = s->d->passed + (size_t)c * (size_t)room;
        counts[c] = pass_column(s, c, own);
        for (int32_t i = 0; i < counts[c]; ++i) at[own[i].node] = &own[i];
        for (int32_t r = 0; r <= c; ++r) {
            const struct ncp_passed *other = s->d->passed + (size_t)r * (size_t)room;
            three sum = {0, 0, 0, 0};
            for (int32_t i = 0; i < counts[r]; ++i) {
                const struct ncp_passed *common = at[other[i].node];
                if (!common) continue;
                const six z = six_at(other[i].along), response = six_at(common->response);
                sum += z.linear * response.linear + z.angular * response.angular;
            }
            const double entry = three_sum(sum);
            G[(size_t)r * (size_t)n + (size_t)c] = G[(size_t)c * (size_t)n + (size_t)r] = entry;
        }
        for (int32_t i = 0; i < counts[c]; ++i) at[own[i].node] = NULL;
    }
}
