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

/* Where the loads of a law's numbers are on their way, a number a lane. */
struct way {
    int32_t node, part; /* node -1: it has ended; part -1: of a body without joints */
    three load[6];
};

static void begin_way(const struct island *s, int32_t number, double row[3][6], struct way *way)
{
    way->node = node_of(s, number, &way->part);
    for (int k = 0; k < 6; ++k) way->load[k] = (three){row[0][k], row[1][k], row[2][k], 0};
}

static void pass_free(const struct island *s, struct way *way, struct ncp_passed *to)
{
    const int32_t number = way->node - s->d->first_node[s->parts];
    to->node = way->node;
    to->free = 6;
    memcpy(to->along, way->load, sizeof to->along);
    for (int c = 0; c < 3; ++c) {
        double load[6], response[6];
        for (int k = 0; k < 6; ++k) load[k] = way->load[k][c];
        ldl6_solve(s->d->bodies[number].factor, load, response); /* there: a contact is on it */
        for (int k = 0; k < 6; ++k) to->response[k][c] = response[k];
    }
    for (int k = 0; k < 6; ++k) to->response[k][3] = 0;
    way->node = -1;
}

/* Loads on their way to the root: on the node's body, with what its child has handed on; then what it hands on to its
 * parent. along: what acts along S besides, in the first lane; NULL: nothing does. */
static void pass_tree_node(const struct articulation_node *node, three load[6], const double *along,
                           struct ncp_passed *to)
{
    three z[6], response[6];
    to->free = node->free;
    for (int i = 0; i < node->free; ++i) {
        const double *S = node->S[i];
        const three x = three_fma(three_fill(S[0]), load[0], three_fill(S[4]) * load[3]),
                    y = three_fma(three_fill(S[1]), load[1], three_fill(S[5]) * load[4]),
                    w = three_fma(three_fill(S[2]), load[2], three_fill(S[6]) * load[5]);
        z[i] = (x + w) + y;
        if (along) z[i][0] += along[i];
        *(three *)to->along[i] = z[i];
    }
    for (int i = 0; i < node->free; ++i) {
        response[i] = three_fill(0);
        for (int j = 0; j < node->free; ++j) response[i] += three_product(three_fill(node->H[i][j]), z[j]);
        *(three *)to->response[i] = response[i];
    }
    if (node->parent < 0 || !node->bound) return;
    for (int i = 0; i < node->free; ++i)
        for (int k = 0; k < 6; ++k) load[k] -= three_fill(node->U[i][k < 3 ? k : k + 1]) * response[i];
    for (int k = 0; k < 3; ++k) { /* six_hand_on */
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        load[3 + k] += three_fms(three_fill(node->offset[i]), load[j], three_fill(node->offset[j]) * load[i]);
    }
}

static void pass_node(const struct island *s, struct way *way, const double *along, struct ncp_passed *to)
{
    if (way->part < 0) {
        pass_free(s, way, to);
        return;
    }
    const struct articulation_tree *tree = &part_of(s, way->part)->tree;
    const struct articulation_node *node = &tree->node[way->node - s->d->first_node[way->part]];
    pass_tree_node(node, way->load, along, to);
    to->node = way->node;
    way->node = node->parent >= 0 && node->bound ? s->d->first_node[way->part] + node->parent : -1;
}

/* Both ways at once: children come before their parents, and what two ways have in common is one. */
static int32_t pass_all(const struct island *s, struct way way[2], const double *along, struct ncp_passed *to)
{
    int32_t count = 0;
    while (way[0].node >= 0 || way[1].node >= 0) {
        if (way[0].node == way[1].node) {
            for (int k = 0; k < 6; ++k) way[0].load[k] += way[1].load[k];
            way[1].node = -1;
        }
        const int first = way[0].node < 0 || (way[1].node >= 0 && way[1].node < way[0].node);
        pass_node(s, &way[first], along, &to[count++]);
        along = NULL;
    }
    return count;
}

static int32_t pass_law(const struct island *s, int32_t law, struct ncp_passed *to)
{
    struct way way[2];
    way[0].node = way[1].node = -1;
    if (law < s->contacts) {
        struct ncp_contact *c = &s->d->contacts[law];
        for (int k = 0; k < 2; ++k)
            if (c->body[k] >= 0) begin_way(s, c->body[k], c->row[k], &way[k]);
        return pass_all(s, way, NULL, to);
    }
    const struct ncp_active *active = &s->active_row[law - s->contacts];
    const struct articulation_part *part = part_of(s, active->part);
    const struct articulation_tree *tree = &part->tree;
    for (int k = 0; k < 6; ++k) way[0].load[k] = three_fill(0);
    way[0].part = active->part;
    way[0].node = s->d->first_node[active->part] + sadmm_articulation_tree_node(tree, &part->view, active->r);
    return pass_all(s, way, tree->row[tree->row_of[active->r]].along, to);
}

/* Nodes on the way of a law, at most. */
static int32_t longest_way(const struct island *s)
{
    int32_t most = 1;
    for (int32_t k = 0; k < s->parts; ++k)
        if (part_of(s, k)->tree.depth > most) most = part_of(s, k)->tree.depth;
    return 2 * most;
}

/* Of the numbers of two laws, G. */
static void put_block(const struct ncp_dense *d, int32_t r, int32_t c, const three block[3], double *G)
{
    const struct ncp_law *row = &d->law[r], *column = &d->law[c];
    const size_t n = (size_t)d->size;
    for (int k = 0; k < row->count; ++k)
        for (int q = 0; q < column->count; ++q) {
            const size_t at = (size_t)(row->first + k), by = (size_t)(column->first + q);
            if (r == c && q > k) break; /* symmetric to the last bit */
            G[at * n + by] = G[by * n + at] = block[k][q];
        }
}

/* What nodes that both have passed add to the numbers of two laws, in four sums, as of vectors of four directions: so
 * that what is alike comes out alike to the last bit, as in scenes that are symmetric. */
static inline void add_common(const struct ncp_passed *row, const struct ncp_passed *column, three sums[4][3])
{
    const int free = column->free;
    for (int j = 0; j < (free < 4 ? free : 4); ++j) {
        const three response = *(const three *)column->response[j];
        for (int k = 0; k < 3; ++k) {
            const three along = three_fill(row->along[j][k]);
            if (j + 4 >= free) {
                sums[j][k] += three_product(along, response);
                continue;
            }
            const three *other = (const three *)column->response[j + 4];
            sums[j][k] += three_fma(along, response, three_fill(row->along[j + 4][k]) * *other);
        }
    }
}

void SADMM_KERNEL(ncp_tree_responses)(struct island *s, double *G)
{
    const int32_t laws = s->dense.laws, room = longest_way(s), nodes = s->d->first_node[s->parts] + s->bodies;
    const struct ncp_passed **at = s->d->passed_at;
    int32_t *counts = s->d->passed_counts;
    memset(at, 0, (size_t)nodes * sizeof *at);
    s->dense.budget -= (double)s->dense.size * s->dense.size * room;
    for (int32_t k = 0; k < s->parts; ++k) sadmm_articulation_part_factorize(part_of(s, k));
    for (int32_t c = 0; c < laws; ++c) {
        struct ncp_passed *own = s->d->passed + (size_t)c * (size_t)room;
        counts[c] = pass_law(s, c, own);
        for (int32_t i = 0; i < counts[c]; ++i) at[own[i].node] = &own[i];
        for (int32_t r = 0; r <= c; ++r) {
            const struct ncp_passed *other = s->d->passed + (size_t)r * (size_t)room;
            three sums[4][3] = {{{0}, {0}, {0}}, {{0}, {0}, {0}}, {{0}, {0}, {0}}, {{0}, {0}, {0}}}, block[3];
            for (int32_t i = 0; i < counts[r]; ++i)
                if (at[other[i].node]) add_common(&other[i], at[other[i].node], sums);
            for (int k = 0; k < 3; ++k) block[k] = (sums[0][k] + sums[2][k]) + (sums[1][k] + sums[3][k]);
            put_block(&s->dense, r, c, block, G);
        }
        for (int32_t i = 0; i < counts[c]; ++i) at[own[i].node] = NULL;
    }
}
