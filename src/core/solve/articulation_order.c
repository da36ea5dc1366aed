#include "articulation_order.h"

#include <string.h>

#include "core/base/memory.h"

/* Larger parts than this are left to the iteration: the sets below are bits. */
enum { MOST_OF_PART = 8192, WORD = 64 };
/* And parts whose factor takes more updates, each a product of blocks: a tenth of a second on a core, 8 MB of lists. */
enum { MOST_UPDATES = 1 << 20 };
/* A level takes constraints of up to so many neighbours more than the fewest: chains are halved, level by level. */
enum { DEGREE_SLACK = 1 };

struct maker {
    const int32_t *bodies;
    int32_t constraints, body_count;
    int32_t *first, *around; /* body -> its constraints */
    int32_t *part;           /* constraint -> the part it is of; -1: of none */
    int32_t *member;         /* constraints, part by part */
    int32_t *first_member;   /* parts + 1 */
    uint8_t *seen;           /* bodies whose constraints have been listed */
    int32_t parts;
};

static void free_maker(struct maker *m)
{
    sadmm_free(m->first);
    sadmm_free(m->around);
    sadmm_free(m->part);
    sadmm_free(m->member);
    sadmm_free(m->first_member);
    sadmm_free(m->seen);
}

static bool list_around(struct maker *m)
{
    m->first = (int32_t *)sadmm_alloc((size_t)m->body_count + 2, sizeof *m->first);
    m->around = (int32_t *)sadmm_alloc(2 * (size_t)m->constraints + 1, sizeof *m->around);
    m->part = (int32_t *)sadmm_alloc((size_t)m->constraints + 1, sizeof *m->part);
    m->member = (int32_t *)sadmm_alloc((size_t)m->constraints + 1, sizeof *m->member);
    m->first_member = (int32_t *)sadmm_alloc((size_t)m->constraints + 2, sizeof *m->first_member);
    m->seen = (uint8_t *)sadmm_alloc((size_t)m->body_count + 1, sizeof *m->seen);
    if (!m->first || !m->around || !m->part || !m->member || !m->first_member || !m->seen) return false;
    for (int32_t s = 0; s < 2 * m->constraints; ++s)
        if (m->bodies[s] >= 0) ++m->first[m->bodies[s] + 1];
    for (int32_t i = 0; i < m->body_count; ++i) m->first[i + 1] += m->first[i];
    const int32_t total = m->first[m->body_count];
    for (int32_t s = 2 * m->constraints - 1; s >= 0; --s) /* from its end, which becomes its beginning */
        if (m->bodies[s] >= 0) m->around[--m->first[m->bodies[s] + 1]] = s / 2;
    for (int32_t i = 0; i < m->body_count; ++i) m->first[i] = m->first[i + 1];
    m->first[m->body_count] = total;
    return true;
}

/* Adds what is at a body to the part that is found; once. Is it more than may be at one? */
static bool add_around(struct maker *m, int32_t body, int32_t most_around, int32_t *taken)
{
    if (body < 0 || m->seen[body]) return false;
    m->seen[body] = 1;
    for (int32_t j = m->first[body]; j < m->first[body + 1]; ++j) {
        const int32_t other = m->around[j];
        if (m->part[other] != -2) continue;
        m->part[other] = m->parts;
        m->member[(*taken)++] = other;
    }
    return m->first[body + 1] - m->first[body] > most_around;
}

/* Connected constraints, breadth first from the lowest number. They are solved together or not at all: what is left out
 * acts on bodies, too, and a part knows nothing of it. */
static void find_parts(struct maker *m, int32_t most_around)
{
    int32_t taken = 0;
    m->parts = 0;
    for (int32_t k = 0; k < m->constraints; ++k) m->part[k] = -2;
    for (int32_t k = 0; k < m->constraints; ++k) {
        const int32_t begin = taken;
        bool crowded = false;
        if (m->part[k] != -2 || (m->bodies[2 * k] < 0 && m->bodies[2 * k + 1] < 0)) continue;
        m->part[k] = m->parts;
        m->member[taken++] = k;
        for (int32_t at = begin; at < taken; ++at)
            for (int s = 0; s < 2; ++s)
                crowded = add_around(m, m->bodies[2 * m->member[at] + s], most_around, &taken) || crowded;
        if (crowded || taken - begin > MOST_OF_PART) {
            for (int32_t at = begin; at < taken; ++at) m->part[m->member[at]] = -1;
            taken = begin;
            continue;
        }
        m->first_member[m->parts++] = begin;
    }
    m->first_member[m->parts] = taken;
}

/* ---- the order of a part ----------------------------------------------------------------------------------------- */

/* Neighbours of its constraints as bits, by their number in the part. */
struct graph {
    int32_t count, words;
    uint64_t *near;
    int32_t *degree;
    uint8_t *gone, *adjacent; /* eliminated; a neighbour is being so in this level */
};

static uint64_t *near_of(const struct graph *g, int32_t i) { return g->near + (size_t)i * (size_t)g->words; }

static int32_t count_near(const struct graph *g, int32_t i)
{
    int32_t count = 0;
    for (int32_t w = 0; w < g->words; ++w) count += (int32_t)__builtin_popcountll(near_of(g, i)[w]);
    return count;
}

/* Goes through the neighbours, ascending. */
#define EACH_NEAR(g, i, j)                                                            \
    for (int32_t w_ = 0; w_ < (g)->words; ++w_)                                        \
        for (uint64_t bits_ = near_of(g, i)[w_]; bits_; bits_ &= bits_ - 1)            \
            for (int32_t j = w_ * WORD + (int32_t)__builtin_ctzll(bits_), once_ = 1; once_; once_ = 0)

static bool make_graph(const struct maker *m, int32_t part, int32_t *number, struct graph *g)
{
    const int32_t *member = m->member + m->first_member[part];
    g->count = m->first_member[part + 1] - m->first_member[part];
    g->words = (g->count + WORD - 1) / WORD;
    g->near = (uint64_t *)sadmm_alloc((size_t)g->count * (size_t)g->words + 1, sizeof *g->near);
    g->degree = (int32_t *)sadmm_alloc((size_t)g->count + 1, sizeof *g->degree);
    g->gone = (uint8_t *)sadmm_alloc(2 * (size_t)g->count + 1, 1);
    if (!g->near || !g->degree || !g->gone) return false;
    g->adjacent = g->gone + g->count;
    for (int32_t i = 0; i < g->count; ++i) number[member[i]] = i;
    for (int32_t i = 0; i < g->count; ++i)
        for (int s = 0; s < 2; ++s) {
            const int32_t body = m->bodies[2 * member[i] + s];
            for (int32_t j = body < 0 ? 0 : m->first[body]; body >= 0 && j < m->first[body + 1]; ++j) {
                if (m->part[m->around[j]] != part) continue; /* left out of any */
                const int32_t other = number[m->around[j]];
                if (other != i) near_of(g, i)[other / WORD] |= UINT64_C(1) << (other % WORD);
            }
        }
    for (int32_t i = 0; i < g->count; ++i) g->degree[i] = count_near(g, i);
    return true;
}

static void free_graph(struct graph *g)
{
    sadmm_free(g->near);
    sadmm_free(g->degree);
    sadmm_free(g->gone);
}

/* What is left of the part without i: its neighbours are coupled to each other. `near` of i itself stays: its
 * column. */
static void eliminate(struct graph *g, int32_t i)
{
    g->gone[i] = 1;
    EACH_NEAR(g, i, j) {
        uint64_t *near = near_of(g, j);
        for (int32_t w = 0; w < g->words; ++w) near[w] |= near_of(g, i)[w];
        near[j / WORD] &= ~(UINT64_C(1) << (j % WORD));
        near[i / WORD] &= ~(UINT64_C(1) << (i % WORD));
        g->degree[j] = count_near(g, j);
    }
}

/* A level: of few neighbours, none next to another. Into `order` from *taken on, by their number in the part. */
static void take_level(struct graph *g, int32_t *order, int32_t *taken)
{
    const int32_t begin = *taken;
    int32_t least = INT32_MAX;
    for (int32_t i = 0; i < g->count; ++i)
        if (!g->gone[i] && g->degree[i] < least) least = g->degree[i];
    memset(g->adjacent, 0, (size_t)g->count);
    for (int32_t i = 0; i < g->count; ++i) {
        if (g->gone[i] || g->adjacent[i] || g->degree[i] > least + DEGREE_SLACK) continue;
        order[(*taken)++] = i;
        EACH_NEAR(g, i, j) g->adjacent[j] = 1;
    }
    for (int32_t at = begin; at < *taken; ++at) eliminate(g, order[at]);
}

/* ---- the structure of a part ------------------------------------------------------------------------------------- */

/* While it is made: the order of elimination, and of each column its level and its rows. */
struct columns {
    int32_t *order, *column, *level; /* column -> constraint of the part, and back; column -> its level */
    int32_t *first, *rows;          /* columns + 1; as they were found: constraints of the part */
    size_t row_count;
    int32_t columns, levels;
    int64_t updates;
};

static void free_columns(struct columns *c)
{
    sadmm_free(c->order);
    sadmm_free(c->rows);
}

static bool find_columns(struct graph *g, struct columns *c)
{
    const size_t n = (size_t)g->count;
    int32_t taken = 0;
    c->order = (int32_t *)sadmm_alloc(4 * n + 1, sizeof *c->order);
    if (!c->order) return false;
    c->column = c->order + n, c->level = c->column + n, c->first = c->level + n;
    c->columns = g->count;
    while (taken < g->count && c->updates <= MOST_UPDATES) {
        const int32_t begin = taken;
        take_level(g, c->order, &taken);
        for (int32_t at = begin; at < taken; ++at) {
            if (!SADMM_GROW(c->rows, c->row_count, c->row_count + n)) return false;
            c->column[c->order[at]] = at;
            c->level[at] = c->levels;
            EACH_NEAR(g, c->order[at], j) c->rows[c->row_count++] = j;
            c->first[at + 1] = (int32_t)c->row_count;
            const int64_t rows = c->first[at + 1] - c->first[at];
            c->updates += rows * (rows + 1) / 2;
        }
        ++c->levels;
    }
    return true;
}

/* The numbers of a structure as they grow: arrays are added in the order of articulation_structure_at(). */
struct writer {
    struct sadmm_articulation_order *order;
    size_t begin, end; /* of this structure */
};

static int32_t *add(struct writer *w, size_t count)
{
    struct sadmm_articulation_order *o = w->order;
    if (!SADMM_GROW(o->numbers, w->end, w->end + count + 1)) return NULL;
    int32_t *to = o->numbers + w->end;
    memset(to, 0, count * sizeof *to);
    w->end += count;
    return to;
}

/* What there is of it so far. */
static struct articulation_structure written(const struct writer *w)
{
    return articulation_structure_at(w->order->numbers + w->begin);
}
static int32_t *counts(const struct writer *w) { return w->order->numbers + w->begin; }

/* Constraints by column; bodies as they come, and the sides of columns. entry: bodies -> -1, before and after. */
static bool write_bodies(struct writer *w, const struct maker *m, const int32_t *member, const struct columns *c,
                         int32_t *entry)
{
    const size_t n = (size_t)c->columns;
    if (!add(w, ARTICULATION_COUNTS)) return false;
    counts(w)[0] = c->columns, counts(w)[1] = c->first[n], counts(w)[2] = c->levels;
    int32_t *constraint = add(w, n), count = 0;
    if (!constraint) return false;
    for (int32_t p = 0; p < c->columns; ++p) constraint[p] = member[c->order[p]];
    int32_t *body = add(w, 2 * n); /* more than there are */
    if (!body) return false;
    for (int32_t p = 0; p < c->columns; ++p)
        for (int s = 0; s < 2; ++s) {
            const int32_t i = m->bodies[2 * member[c->order[p]] + s];
            if (i < 0 || entry[i] >= 0) continue;
            entry[i] = count;
            body[count++] = i;
        }
    w->end -= 2 * n - (size_t)count;
    counts(w)[3] = count;
    int32_t *side = add(w, 2 * n);
    if (!side) return false;
    for (int32_t p = 0; p < c->columns; ++p)
        for (int s = 0; s < 2; ++s) {
            const int32_t i = m->bodies[2 * member[c->order[p]] + s];
            side[2 * p + s] = i < 0 ? -1 : entry[i];
        }
    const struct articulation_structure made = written(w);
    for (int32_t e = 0; e < count; ++e) entry[made.body[e]] = -1;
    return true;
}

static int32_t common_of(const int32_t *row_sides, const int32_t *column_sides)
{
    int32_t bits = 0;
    for (int s = 0; s < 2; ++s)
        for (int t = 0; t < 2; ++t)
            if (row_sides[s] >= 0 && row_sides[s] == column_sides[t]) bits |= 1 << (2 * s + t);
    return bits;
}

/* Rows of a column, ascending. */
static bool write_blocks(struct writer *w, const struct columns *c)
{
    const size_t n = (size_t)c->columns, blocks = (size_t)c->first[n];
    int32_t *first_of_level = add(w, (size_t)c->levels + 1);
    if (!first_of_level) return false;
    for (int32_t p = c->columns - 1; p >= 0; --p) first_of_level[c->level[p]] = p;
    first_of_level[c->levels] = c->columns;
    int32_t *first_below = add(w, n + 1 + 3 * blocks);
    if (!first_below) return false;
    int32_t *row = first_below + n + 1, *column = row + blocks, *common = column + blocks;
    const int32_t *side = written(w).side;
    memcpy(first_below, c->first, (n + 1) * sizeof *first_below);
    for (int32_t j = 0; j < c->columns; ++j)
        for (int32_t k = c->first[j]; k < c->first[j + 1]; ++k) {
            const int32_t number = c->column[c->rows[k]];
            int32_t to = k;
            for (; to > c->first[j] && row[to - 1] > number; --to) row[to] = row[to - 1];
            row[to] = number;
            column[k] = j;
        }
    for (size_t b = 0; b < blocks; ++b) common[b] = common_of(side + 2 * row[b], side + 2 * column[b]);
    return true;
}

static int32_t find_block(const struct articulation_structure *s, int32_t row, int32_t column)
{
    int32_t low = s->first_below[column], high = s->first_below[column + 1] - 1;
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;
        if (s->row[middle] < row) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Every column takes from each pair of its rows. Into `next` how many a node has, or (update) into the list. */
static void each_update(const struct articulation_structure *s, int32_t *next, int32_t *update)
{
    for (int32_t k = 0; k < s->columns; ++k)
        for (int32_t w = s->first_below[k]; w < s->first_below[k + 1]; ++w)
            for (int32_t u = w; u < s->first_below[k + 1]; ++u) {
                const int32_t node = u == w ? s->row[w] : s->columns + find_block(s, s->row[u], s->row[w]);
                if (update) {
                    update[2 * next[node]] = u;
                    update[2 * next[node] + 1] = w;
                }
                ++next[node];
            }
}

static bool write_updates(struct writer *w)
{
    struct articulation_structure s = written(w);
    const size_t nodes = (size_t)s.columns + (size_t)s.blocks;
    int32_t *first = add(w, nodes + 1);
    if (!first) return false;
    s = written(w);
    each_update(&s, first + 1, NULL);
    for (size_t node = 0; node < nodes; ++node) first[node + 1] += first[node];
    const int32_t updates = counts(w)[4] = first[nodes];
    int32_t *update = add(w, 2 * (size_t)updates), *next = (int32_t *)sadmm_alloc(nodes + 1, sizeof *next);
    if (update && next) {
        s = written(w);
        memcpy(next, s.first_update, nodes * sizeof *next);
        each_update(&s, next, update);
    }
    sadmm_free(next);
    return update && next;
}

/* Groups of a list by level, each of which `first` to `end` of something that is `of`. Into `next` how many a level
 * has, or (list) into the list. */
static void put_group(int32_t *next, int32_t *list, int32_t level, int32_t of, int32_t first, int32_t end)
{
    int32_t *to = list ? list + 3 * next[level] : NULL;
    ++next[level];
    if (to) to[0] = of, to[1] = first, to[2] = end;
}

/* Updates of nodes by the level of the column that they come from: 2 level, + 1 for blocks below the diagonal. */
static void each_scatter(const struct articulation_structure *s, const int32_t *level, int32_t *next, int32_t *list)
{
    for (int32_t node = 0; node < s->columns + s->blocks; ++node)
        for (int32_t at = s->first_update[node], end; at < s->first_update[node + 1]; at = end) {
            const int32_t from = level[s->column[s->update[2 * at]]];
            for (end = at + 1; end < s->first_update[node + 1]; ++end)
                if (level[s->column[s->update[2 * end]]] != from) break;
            put_group(next, list, 2 * from + (node >= s->columns), node, at, end);
        }
}

/* Blocks of columns by the level of their row. */
static void each_gather(const struct articulation_structure *s, const int32_t *level, int32_t *next, int32_t *list)
{
    for (int32_t p = 0; p < s->columns; ++p)
        for (int32_t b = s->first_below[p], end; b < s->first_below[p + 1]; b = end) {
            for (end = b + 1; end < s->first_below[p + 1]; ++end)
                if (level[s->row[end]] != level[s->row[b]]) break;
            put_group(next, list, level[s->row[b]], p, b, end);
        }
}

typedef void each_group(const struct articulation_structure *, const int32_t *level, int32_t *next, int32_t *list);

/* Where the groups of each begin, then the groups. */
static bool write_groups(struct writer *w, each_group *each, const int32_t *level, size_t groups, int count_at)
{
    int32_t *first = add(w, groups + 1);
    if (!first) return false;
    struct articulation_structure s = written(w);
    each(&s, level, first + 1, NULL);
    for (size_t k = 0; k < groups; ++k) first[k + 1] += first[k];
    const size_t at = (size_t)(first - w->order->numbers), total = (size_t)first[groups];
    counts(w)[count_at] = (int32_t)total;
    int32_t *list = add(w, 3 * total), *next = (int32_t *)sadmm_alloc(groups + 1, sizeof *next);
    if (list && next) {
        s = written(w);
        memcpy(next, w->order->numbers + at, groups * sizeof *next);
        each(&s, level, next, list);
    }
    sadmm_free(next);
    return list && next;
}

static bool write_around(struct writer *w)
{
    struct articulation_structure s = written(w);
    int32_t *first = add(w, (size_t)s.bodies + 1 + 2 * (size_t)s.columns);
    if (!first) return false;
    int32_t *around = first + s.bodies + 1;
    s = written(w);
    for (int32_t k = 0; k < 2 * s.columns; ++k)
        if (s.side[k] >= 0) ++first[s.side[k] + 1];
    for (int32_t e = 0; e < s.bodies; ++e) first[e + 1] += first[e];
    const int32_t total = first[s.bodies];
    for (int32_t k = 2 * s.columns - 1; k >= 0; --k) /* from its end, which becomes its beginning */
        if (s.side[k] >= 0) around[--first[s.side[k] + 1]] = k;
    for (int32_t e = 0; e < s.bodies; ++e) first[e] = first[e + 1];
    first[s.bodies] = total;
    return true;
}

static bool write_part(struct writer *w, const struct maker *m, const int32_t *member, const struct columns *c,
                       int32_t *entry)
{
    return write_bodies(w, m, member, c, entry) && write_blocks(w, c) && write_updates(w) &&
           write_groups(w, each_scatter, c->level, 2 * (size_t)c->levels, 5) &&
           write_groups(w, each_gather, c->level, (size_t)c->levels, 6) && write_around(w);
}

/* number: constraints -> number in their part. *left_out: its factor would be too large. */
static bool make_part(const struct maker *m, int32_t part, int32_t *number, int32_t *entry, struct writer *w,
                      bool *left_out)
{
    struct graph g = {0};
    struct columns c = {0};
    bool fits = make_graph(m, part, number, &g) && find_columns(&g, &c);
    *left_out = fits && c.updates > MOST_UPDATES;
    fits = fits && (*left_out || write_part(w, m, m->member + m->first_member[part], &c, entry));
    free_columns(&c);
    free_graph(&g);
    return fits;
}

static bool make(struct maker *m, int32_t most_around, struct sadmm_articulation_order *order)
{
    const size_t n = (size_t)m->constraints + 1;
    int32_t *numbers = (int32_t *)sadmm_alloc(n + (size_t)m->body_count, sizeof *numbers),
            *entry = numbers ? numbers + n : NULL;
    struct writer w = {order, 0, 0};
    bool fits = numbers && list_around(m);
    if (fits) {
        find_parts(m, most_around);
        for (int32_t i = 0; i < m->body_count; ++i) entry[i] = -1;
        order->first = (size_t *)sadmm_alloc((size_t)m->parts + 1, sizeof *order->first);
        fits = order->first != NULL;
    }
    for (int32_t part = 0; fits && part < m->parts; ++part) {
        bool left_out = false;
        w.begin = w.end;
        fits = make_part(m, part, numbers, entry, &w, &left_out);
        if (fits && !left_out) order->first[++order->parts] = w.end;
    }
    sadmm_free(numbers);
    return fits;
}

bool sadmm_articulation_order_make(struct sadmm_articulation_order *order, const int32_t *bodies, int32_t constraints,
                                   int32_t body_count, int32_t most_around)
{
    struct maker m = {.bodies = bodies, .constraints = constraints, .body_count = body_count};
    struct sadmm_articulation_order made = {0};
    const bool fits = make(&m, most_around, &made);
    free_maker(&m);
    sadmm_articulation_order_free(fits ? order : &made);
    if (fits) *order = made;
    return fits;
}

void sadmm_articulation_order_free(struct sadmm_articulation_order *order)
{
    sadmm_free(order->first);
    sadmm_free(order->numbers);
    *order = (struct sadmm_articulation_order){0};
}
