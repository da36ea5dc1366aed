#include "joined_order.h"

#include <string.h>

#include "core/base/memory.h"

/* Larger parts than this are left to the iteration: the sets below are bits. */
enum { MOST_OF_PART = 8192, WORD = 64 };
/* A level takes constraints of up to so many neighbours more than the fewest: chains are halved, level by level. */
enum { DEGREE_SLACK = 1 };

struct maker {
    const int32_t *bodies;
    int32_t constraints, body_count;
    int32_t *first, *around; /* body -> its constraints */
    int32_t *part;           /* constraint -> the part it is of; -1: of none */
    int32_t *member;         /* constraints, part by part */
    int32_t *first_member;   /* parts + 1 */
    int32_t parts;
};

static void free_maker(struct maker *m)
{
    sadmm_free(m->first);
    sadmm_free(m->around);
    sadmm_free(m->part);
    sadmm_free(m->member);
    sadmm_free(m->first_member);
}

static bool list_around(struct maker *m)
{
    m->first = (int32_t *)sadmm_alloc((size_t)m->body_count + 2, sizeof *m->first);
    m->around = (int32_t *)sadmm_alloc(2 * (size_t)m->constraints + 1, sizeof *m->around);
    m->part = (int32_t *)sadmm_alloc((size_t)m->constraints + 1, sizeof *m->part);
    m->member = (int32_t *)sadmm_alloc((size_t)m->constraints + 1, sizeof *m->member);
    m->first_member = (int32_t *)sadmm_alloc((size_t)m->constraints + 2, sizeof *m->first_member);
    if (!m->first || !m->around || !m->part || !m->member || !m->first_member) return false;
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

/* Constraints that hang together, breadth first from the lowest number. */
static void find_parts(struct maker *m, int32_t most_around)
{
    int32_t taken = 0;
    m->parts = 0;
    for (int32_t k = 0; k < m->constraints; ++k) m->part[k] = -2;
    for (int32_t k = 0; k < m->constraints; ++k)
        for (int s = 0; s < 2; ++s) {
            const int32_t body = m->bodies[2 * k + s];
            if (body >= 0 && m->first[body + 1] - m->first[body] > most_around) m->part[k] = -1;
        }
    for (int32_t k = 0; k < m->constraints; ++k) {
        const int32_t begin = taken;
        if (m->part[k] != -2 || (m->bodies[2 * k] < 0 && m->bodies[2 * k + 1] < 0)) continue;
        m->part[k] = m->parts;
        m->member[taken++] = k;
        for (int32_t at = begin; at < taken; ++at)
            for (int s = 0; s < 2; ++s) {
                const int32_t body = m->bodies[2 * m->member[at] + s];
                for (int32_t j = body < 0 ? 0 : m->first[body]; body >= 0 && j < m->first[body + 1]; ++j) {
                    const int32_t other = m->around[j];
                    if (m->part[other] != -2) continue;
                    m->part[other] = m->parts;
                    m->member[taken++] = other;
                }
            }
        if (taken - begin > MOST_OF_PART) {
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
    uint8_t *gone, *held; /* eliminated; a neighbour is being so in this level */
};

static uint64_t *near_of(const struct graph *g, int32_t i) { return g->near + (size_t)i * (size_t)g->words; }

static int32_t count_near(const struct graph *g, int32_t i)
{
    int32_t count = 0;
    for (int32_t w = 0; w < g->words; ++w) count += (int32_t)__builtin_popcountll(near_of(g, i)[w]);
    return count;
}

/* Calls `visit` for each neighbour, ascending. */
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
    g->held = g->gone + g->count;
    for (int32_t i = 0; i < g->count; ++i) number[member[i]] = i;
    for (int32_t i = 0; i < g->count; ++i)
        for (int s = 0; s < 2; ++s) {
            const int32_t body = m->bodies[2 * member[i] + s];
            for (int32_t j = body < 0 ? 0 : m->first[body]; body >= 0 && j < m->first[body + 1]; ++j) {
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
    memset(g->held, 0, (size_t)g->count);
    for (int32_t i = 0; i < g->count; ++i) {
        if (g->gone[i] || g->held[i] || g->degree[i] > least + DEGREE_SLACK) continue;
        order[(*taken)++] = i;
        EACH_NEAR(g, i, j) g->held[j] = 1;
    }
    for (int32_t at = begin; at < *taken; ++at) eliminate(g, order[at]);
}

/* ---- all of it --------------------------------------------------------------------------------------------------- */

/* Columns as they are found, part by part and level by level. */
struct column {
    int32_t constraint;
    int32_t first, count; /* its rows, constraints, in `rows` */
};

struct columns {
    struct column *column;
    int32_t *rows, *first_level, *first_of_level;
    int32_t count, levels;
    size_t row_count, row_capacity;
};

static bool add_columns(const int32_t *member, const struct graph *g, const int32_t *order, int32_t begin, int32_t end,
                        struct columns *all)
{
    all->first_of_level[all->levels++] = all->count;
    for (int32_t at = begin; at < end; ++at) {
        struct column *column = &all->column[all->count++];
        if (!sadmm_grow(&all->rows, &all->row_capacity, all->row_count, all->row_count + (size_t)g->count,
                        sizeof *all->rows))
            return false;
        *column = (struct column){member[order[at]], (int32_t)all->row_count, 0};
        EACH_NEAR(g, order[at], j) all->rows[all->row_count++] = member[j];
        column->count = (int32_t)all->row_count - column->first;
    }
    return true;
}

static bool order_part(const struct maker *m, int32_t part, int32_t *number, int32_t *order, struct columns *all)
{
    struct graph g = {0};
    int32_t taken = 0;
    bool fits = make_graph(m, part, number, &g);
    all->first_level[part] = all->levels;
    while (fits && taken < g.count) {
        const int32_t begin = taken;
        take_level(&g, order, &taken);
        fits = add_columns(m->member + m->first_member[part], &g, order, begin, taken, all);
    }
    free_graph(&g);
    return fits;
}

static size_t count_updates(const struct columns *all)
{
    size_t count = 0;
    for (int32_t k = 0; k < all->count; ++k) {
        const size_t rows = (size_t)all->column[k].count;
        count += rows * (rows + 1) / 2;
    }
    return count;
}

/* The arrays while they are filled. */
struct arrays {
    int32_t *constraint, *first_level, *first_of_level, *first_below, *row, *column, *first_update, *update;
    int32_t *first_body, *body, *first_around, *around;
    int32_t count, blocks, parts, bodies;
};

static int32_t *take(int32_t **memory, size_t count)
{
    int32_t *at = *memory;
    *memory += count;
    return at;
}

static bool reserve(struct arrays *o, const struct maker *m, const struct columns *all,
                    struct sadmm_joined_order *order)
{
    const size_t n = (size_t)all->count, b = all->row_count, updates = count_updates(all), parts = (size_t)m->parts,
                 levels = (size_t)all->levels, bodies = 2 * n;
    order->size = n + parts + 1 + levels + 1 + n + 1 + 2 * b + n + b + 1 + 2 * updates; /* as they are taken below */
    order->size += parts + 1 + bodies + bodies + 1 + 2 * n;
    int32_t *memory = order->memory = (int32_t *)sadmm_alloc(order->size, sizeof *memory);
    if (!memory) return false;
    o->count = all->count, o->blocks = (int32_t)b, o->parts = m->parts;
    o->constraint = take(&memory, n);
    o->first_level = take(&memory, parts + 1);
    o->first_of_level = take(&memory, levels + 1);
    o->first_below = take(&memory, n + 1);
    o->row = take(&memory, b);
    o->column = take(&memory, b);
    o->first_update = take(&memory, n + b + 1);
    o->update = take(&memory, 2 * updates);
    o->first_body = take(&memory, parts + 1);
    o->body = take(&memory, bodies);
    o->first_around = take(&memory, bodies + 1);
    o->around = take(&memory, 2 * n);
    return true;
}

/* Places as columns were found; rows of a column by their places. */
static void place_columns(struct arrays *o, const struct columns *all, int32_t parts, int32_t *place)
{
    int32_t block = 0;
    memcpy(o->first_level, all->first_level, (size_t)parts * sizeof *o->first_level);
    memcpy(o->first_of_level, all->first_of_level, (size_t)all->levels * sizeof *o->first_of_level);
    o->first_level[parts] = all->levels;
    o->first_of_level[all->levels] = all->count;
    for (int32_t j = 0; j < o->count; ++j) {
        o->constraint[j] = all->column[j].constraint;
        place[o->constraint[j]] = j;
    }
    for (int32_t j = 0; j < o->count; ++j) {
        const struct column *column = &all->column[j];
        o->first_below[j] = block;
        for (int32_t i = 0; i < column->count; ++i) {
            const int32_t row = place[all->rows[column->first + i]];
            int32_t to = block++;
            for (; to > o->first_below[j] && o->row[to - 1] > row; --to) o->row[to] = o->row[to - 1];
            o->row[to] = row;
        }
        for (int32_t b = o->first_below[j]; b < block; ++b) o->column[b] = j;
    }
    o->first_below[o->count] = block;
}

static int32_t find_block(const struct arrays *o, int32_t row, int32_t column)
{
    int32_t low = o->first_below[column], high = o->first_below[column + 1] - 1;
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;
        if (o->row[middle] < row) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Every column takes from each pair of its rows. Into `next` how many a node has, or (list) into `update`. */
static void each_update(const struct arrays *o, int32_t *next, bool list)
{
    for (int32_t k = 0; k < o->count; ++k)
        for (int32_t w = o->first_below[k]; w < o->first_below[k + 1]; ++w)
            for (int32_t u = w; u < o->first_below[k + 1]; ++u) {
                const int32_t node = u == w ? o->row[w] : o->count + find_block(o, o->row[u], o->row[w]);
                if (list) {
                    o->update[2 * next[node]] = u;
                    o->update[2 * next[node] + 1] = w;
                }
                ++next[node];
            }
}

static bool list_updates(struct arrays *o)
{
    const size_t nodes = (size_t)o->count + (size_t)o->blocks;
    int32_t *next = (int32_t *)sadmm_alloc(nodes + 1, sizeof *next);
    if (!next) return false;
    each_update(o, o->first_update + 1, false);
    for (size_t node = 0; node < nodes; ++node) o->first_update[node + 1] += o->first_update[node];
    memcpy(next, o->first_update, nodes * sizeof *next);
    each_update(o, next, true);
    sadmm_free(next);
    return true;
}

/* Bodies of each part as they come, and the sides of constraints at each. entry: bodies -> entry, -1 before. */
static void list_bodies(struct arrays *o, const int32_t *bodies, int32_t parts, int32_t *entry)
{
    for (int32_t part = 0; part < parts; ++part) {
        o->first_body[part] = o->bodies;
        for (int32_t p = o->first_of_level[o->first_level[part]]; p < o->first_of_level[o->first_level[part + 1]]; ++p)
            for (int s = 0; s < 2; ++s) {
                const int32_t body = bodies[2 * o->constraint[p] + s];
                if (body < 0) continue;
                if (entry[body] < 0) {
                    entry[body] = o->bodies;
                    o->body[o->bodies++] = body;
                }
                ++o->first_around[entry[body] + 1];
            }
    }
    o->first_body[parts] = o->bodies;
    for (int32_t e = 0; e < o->bodies; ++e) o->first_around[e + 1] += o->first_around[e];
    const int32_t total = o->first_around[o->bodies];
    for (int32_t p = o->count - 1; p >= 0; --p)
        for (int s = 1; s >= 0; --s) {
            const int32_t body = bodies[2 * o->constraint[p] + s];
            if (body >= 0) o->around[--o->first_around[entry[body] + 1]] = 2 * p + s;
        }
    for (int32_t e = 0; e < o->bodies; ++e) o->first_around[e] = o->first_around[e + 1];
    o->first_around[o->bodies] = total;
}

static bool finish(const struct maker *m, const struct columns *all, int32_t *place, int32_t *entry,
                   struct sadmm_joined_order *order)
{
    struct arrays o = {0};
    if (!reserve(&o, m, all, order)) return false;
    place_columns(&o, all, m->parts, place);
    if (!list_updates(&o)) return false;
    for (int32_t i = 0; i < m->body_count; ++i) entry[i] = -1;
    list_bodies(&o, m->bodies, m->parts, entry);
    order->s = (struct joined_structure){
        .count = o.count, .blocks = o.blocks, .parts = o.parts, .bodies = o.bodies, .constraint = o.constraint,
        .first_level = o.first_level, .first_of_level = o.first_of_level, .first_below = o.first_below, .row = o.row,
        .column = o.column, .first_update = o.first_update, .update = o.update, .first_body = o.first_body,
        .body = o.body, .first_around = o.first_around, .around = o.around};
    return true;
}

static bool make(struct maker *m, int32_t most_around, struct sadmm_joined_order *order)
{
    const size_t n = (size_t)m->constraints + 1;
    struct columns all = {.column = (struct column *)sadmm_alloc(n, sizeof *all.column)};
    int32_t *numbers = (int32_t *)sadmm_alloc(5 * n + (size_t)m->body_count, sizeof *numbers);
    bool fits = all.column && numbers && list_around(m);
    if (fits) {
        find_parts(m, most_around);
        all.first_level = numbers + 3 * n;
        all.first_of_level = numbers + 4 * n;
    }
    for (int32_t part = 0; fits && part < m->parts; ++part) fits = order_part(m, part, numbers, numbers + n, &all);
    fits = fits && finish(m, &all, numbers + 2 * n, numbers + 5 * n, order);
    sadmm_free(all.column);
    sadmm_free(all.rows);
    sadmm_free(numbers);
    return fits;
}

bool sadmm_joined_order_make(struct sadmm_joined_order *order, const int32_t *bodies, int32_t constraints,
                             int32_t body_count, int32_t most_around)
{
    struct maker m = {.bodies = bodies, .constraints = constraints, .body_count = body_count};
    struct sadmm_joined_order made = {0};
    const bool fits = make(&m, most_around, &made);
    free_maker(&m);
    if (!fits) {
        sadmm_free(made.memory);
        return false;
    }
    sadmm_joined_order_free(order);
    *order = made;
    return true;
}

void sadmm_joined_order_free(struct sadmm_joined_order *order)
{
    sadmm_free(order->memory);
    *order = (struct sadmm_joined_order){0};
}
