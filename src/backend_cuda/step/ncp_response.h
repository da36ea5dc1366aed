/* G of an island's dense problem: how its contacts, and rows that have numbers, respond to each other.
 *
 * A number's load goes to the roots. With its shares z along the joints on the way, and H z of each,
 *
 *     G_rc = sum z_r H z_c over the nodes that both have passed
 */
#ifndef SADMM_CUDA_STEP_NCP_RESPONSE_H
#define SADMM_CUDA_STEP_NCP_RESPONSE_H

#include "ncp_tree.h"

static __device__ __forceinline__ int32_t next_node(const ncp_node &node)
{
    return is_carried(node) ? node.parent : -1;
}

/* Calls f(node) for what the loads that begin at a and b pass. */
template <class F>
static __device__ __forceinline__ void each_passed(const ncp_island &s, int32_t a, int32_t b, const F &f)
{
    while (a >= 0 || b >= 0) {
        const int32_t n = a < 0 || (b >= 0 && b < a) ? b : a;
        f(n);
        if (a == n) a = next_node(s.node[n]);
        if (b == n) b = next_node(s.node[n]);
    }
}

/* Where loads of a law begin. */
static __device__ __forceinline__ void begin_nodes(const cuda_view &v, const ncp_island &s, const ncp_law &law,
                                                   int32_t node[2])
{
    if (law.count == 3) {
        node[0] = s.contact[law.of].node[0], node[1] = s.contact[law.of].node[1];
    } else if (s.row[law.of].node >= 0) {
        node[0] = s.row[law.of].node, node[1] = -1;
    } else {
        for (int side = 0; side < 2; ++side) node[side] = side_of_gear(v, s.row[law.of].slot, side);
    }
}

/* Component c of the load that number k of a law is at a side. */
static __device__ __forceinline__ double load_of_number(const cuda_view &v, const ncp_island &s, const ncp_law &law,
                                                        int k, int side, int c)
{
    if (law.count < 3)
        return s.row[law.of].node >= 0 ? 0 : v.raw.rows[s.row[law.of].slot].jacobian[side][c];
    double row[6];
    contact_row(s.contact[law.of], k, side, row);
    return c == 0 ? row[0] : c == 1 ? row[1] : c == 2 ? row[2] : c == 3 ? row[3] : c == 4 ? row[4] : row[5];
}

/* Number k of a law, by six lanes: c. What loads from two sides have in common they pass as one, since parents come
 * after children. live: there is such a number. Every lane of the warp comes here. */
static __device__ __forceinline__ void pass_number(const cuda_view &v, const ncp_island &s, const ncp_law &law, int k,
                                                   const ncp_ways &ways, const ncp_way &way, int c, bool live)
{
    int32_t node[2] = {-1, -1}, at = way.first, share = way.at;
    const double *extra = nullptr; /* along the first joint */
    double load[2] = {0, 0}, *exchange = ways.p[ncp_thread() / LANES];
    if (live) {
        begin_nodes(v, s, law, node);
        if (law.count < 3 && s.row[law.of].node >= 0) extra = s.pool + s.row[law.of].along;
        if (node[0] >= 0) load[0] = load_of_number(v, s, law, k, 0, c);
        if (node[1] >= 0) load[1] = load_of_number(v, s, law, k, 1, c);
    }
    while (__ballot_sync((unsigned)ALL_LANES, node[0] >= 0 || node[1] >= 0) != 0) {
        const int32_t n = node[0] < 0 || (node[1] >= 0 && node[1] < node[0]) ? node[1] : node[0];
        const bool is = n >= 0;
        const ncp_node &own = s.node[is ? n : 0];
        const bool first = node[0] == n, second = node[1] == n, free = is && c < own.free;
        double p = (first ? load[0] : 0) + (second ? load[1] : 0), *z = ways.shares + share, *Hz = z + own.free;
        if (is) exchange[c] = p;
        __syncwarp((unsigned)ALL_LANES);
        if (free) z[c] = six_product(directions_of(s, own) + 6 * c, exchange) + (extra ? extra[c] : 0);
        __syncwarp((unsigned)ALL_LANES);
        if (free) Hz[c] = along(own.free, inverse_of(s, own) + c * own.free, z);
        __syncwarp((unsigned)ALL_LANES);
        if (is) {
            const double *U = forces_of(s, own) + c;
#pragma unroll 1
            for (int i = 0; i < own.free; ++i) p -= U[6 * i] * Hz[i];
            exchange[c] = p;
            if (c == 0) ways.passed[at].node = n, ways.passed[at].at = share;
        }
        __syncwarp((unsigned)ALL_LANES);
        if (is) {
            const int32_t next = next_node(own);
            if (next >= 0) p = carried(own.offset, exchange, c);
            if (first) node[0] = next, load[0] = p;
            if (second) node[1] = first ? -1 : next, load[1] = p;
            extra = nullptr;
            ++at;
            share += 2 * own.free;
        }
        __syncwarp((unsigned)ALL_LANES);
    }
}

/* Of numbers r and c, without what their laws take them by. */
static __device__ __forceinline__ double respond(const ncp_island &s, const ncp_ways &ways, int32_t r, int32_t c)
{
    const ncp_way &a = ways.way[r], &b = ways.way[c];
    double sum = 0;
    for (int32_t i = 0, k = 0; i < a.count && k < b.count;) {
        const ncp_passed &one = ways.passed[a.first + i], &other = ways.passed[b.first + k];
        if (one.node == other.node) {
            const int free = s.node[one.node].free;
            sum += along(free, ways.shares + one.at, ways.shares + other.at + free);
        }
        const bool on = one.node <= other.node;
        k += other.node <= one.node;
        i += on;
    }
    return sum;
}

/* Where the ways of all numbers are. False: there is no room. */
static __device__ __noinline__ bool lay_ways(const cuda_view &v, ncp_island *island, ncp_memory *memory,
                                             ncp_shared *shared)
{
    const ncp_island &s = *island;
    int32_t *count = (int32_t *)s.list, *first = s.pivot; /* as many as numbers; not in use yet */
    ncp_way *const way = take<ncp_way>(memory, (size_t)s.numbers);
    if (memory->full) return false;
    each(s.numbers, [&](int32_t n) {
        int32_t node[2], nodes = 0, numbers = 0;
        int k;
        begin_nodes(v, s, s.law[law_of(s, n, &k)], node);
        each_passed(s, node[0], node[1], [&](int32_t at) {
            ++nodes;
            numbers += 2 * s.node[at].free;
        });
        way[n].count = nodes;
        way[n].numbers = numbers;
        count[n] = nodes;
    });
    const int32_t nodes = add_up(s.numbers, count, first, &shared->count);
    each(s.numbers, [&](int32_t n) {
        way[n].first = first[n];
        count[n] = way[n].numbers;
    });
    const int32_t numbers = add_up(s.numbers, count, first, &shared->count);
    each(s.numbers, [&](int32_t n) { way[n].at = first[n]; });
    ncp_passed *const passed = take<ncp_passed>(memory, (size_t)nodes);
    double *const shares = take<double>(memory, (size_t)numbers);
    put(island->ways,
        ncp_ways{way, passed, shares, (double(*)[6])take<double>(memory, 6 * (size_t)ncp_threads() / LANES)});
    ncp_barrier();
    return !memory->full;
}

/* G. regularisation: of contacts, a share of their response. */
static __device__ __noinline__ void find_responses(const cuda_view &v, const ncp_island &s)
{
    const ncp_ways &ways = s.ways;
    each_eight(s.numbers, [&](int32_t n, int c) {
        int k;
        const int32_t number = n < 0 ? 0 : n, law = law_of(s, number, &k);
        pass_number(v, s, s.law[law], k, ways, ways.way[number], c < 6 ? c : 0, n >= 0 && c < 6);
    });
    ncp_barrier();
    each_entry(s.numbers, s.numbers, [&](int32_t r, int32_t c) {
        if (r > c) return;
        const double G = respond(s, ways, r, c);
        int k;
        const ncp_law &row = s.law[law_of(s, r, &k)], &column = s.law[law_of(s, c, &k)];
        s.G[r * s.stride + c] = row.gain * G + (r == c ? row.compliance : 0);
        if (r != c) s.G[c * s.stride + r] = column.gain * G;
    });
    ncp_barrier();
}

#endif
