/* G of an island's dense problem: how its contacts, and rows that have numbers, respond to each other.
 *
 * A number's load goes to the roots. With its shares z along the joints on the way, and H z of each,
 *
 *     G_rc = sum z_r H z_c over the nodes that both have passed
 */
#ifndef SADMM_CUDA_STEP_NCP_RESPONSE_H
#define SADMM_CUDA_STEP_NCP_RESPONSE_H

#include "ncp_island.h"

/* A node that a load has passed: where z and H z are, one behind the other. */
struct ncp_passed {
    int32_t node, at;
};

/* Of a number: nodes of `passed` from first on, ascending, and numbers of `shares` from `at` on. */
struct ncp_way {
    int32_t first, count, at, numbers;
};

struct ncp_ways {
    ncp_way *way;
    ncp_passed *passed;
    double *shares;
};

/* A load that goes to the root. Two of a number: what they have in common is one, since parents come after children. */
struct ncp_load {
    int32_t node; /* -1: it has come to its end */
    double p[6];
};

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

/* Number k of a law. */
static __device__ void pass_number(const cuda_view &v, const ncp_island &s, const ncp_law &law, int k,
                                   const ncp_ways &ways, const ncp_way &way)
{
    ncp_load load[2] = {};
    int32_t node[2], at = way.first, share = way.at;
    const double *extra = nullptr; /* along the first joint */
    begin_nodes(v, s, law, node);
    for (int side = 0; side < 2; ++side) {
        load[side].node = node[side];
        if (node[side] < 0) continue;
        if (law.count == 3) {
            contact_row(s.contact[law.of], k, side, load[side].p);
        } else if (s.row[law.of].node >= 0) {
            extra = s.pool + s.row[law.of].along;
        } else {
            for (int c = 0; c < 6; ++c) load[side].p[c] = v.raw.rows[s.row[law.of].slot].jacobian[side][c];
        }
    }
    each_passed(s, node[0], node[1], [&](int32_t n) {
        const ncp_node &own = s.node[n];
        const double *S = directions_of(s, own), *U = forces_of(s, own), *H = inverse_of(s, own);
        double p[6] = {0, 0, 0, 0, 0, 0}, up[6] = {0, 0, 0, 0, 0, 0}, *z = ways.shares + share, *Hz = z + own.free;
        for (int side = 0; side < 2; ++side)
            for (int c = 0; load[side].node == n && c < 6; ++c) p[c] += load[side].p[c];
        for (int i = 0; i < own.free; ++i) z[i] = six_product(S + 6 * i, p) + (extra ? extra[i] : 0);
        extra = nullptr;
        for (int i = 0; i < own.free; ++i) Hz[i] = along(own.free, H + i * own.free, z);
        ways.passed[at].node = n;
        ways.passed[at++].at = share;
        share += 2 * own.free;
        const int32_t next = next_node(own);
        for (int c = 0; c < 6; ++c)
            for (int i = 0; i < own.free; ++i) p[c] -= U[6 * i + c] * Hz[i];
        if (next >= 0) add_load(own.offset, p, up);
        const bool both = load[0].node == n && load[1].node == n;
        for (int side = 0; side < 2; ++side) {
            if (load[side].node != n) continue;
            load[side].node = next;
            for (int c = 0; c < 6; ++c) load[side].p[c] = side && both ? 0 : up[c];
        }
    });
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
static __device__ bool lay_ways(const cuda_view &v, const ncp_island &s, ncp_memory *memory, ncp_ways *ways,
                                ncp_shared *shared)
{
    int32_t *count = (int32_t *)s.list, *first = s.pivot; /* as many as numbers; not in use yet */
    ways->way = take<ncp_way>(memory, (size_t)s.numbers);
    if (memory->full) return false;
    each(s.numbers, [&](int32_t n) {
        int32_t node[2], nodes = 0, numbers = 0;
        int k;
        begin_nodes(v, s, s.law[law_of(s, n, &k)], node);
        each_passed(s, node[0], node[1], [&](int32_t at) {
            ++nodes;
            numbers += 2 * s.node[at].free;
        });
        ways->way[n].count = nodes;
        ways->way[n].numbers = numbers;
        count[n] = nodes;
    });
    const int32_t nodes = add_up(s.numbers, count, first, &shared->count);
    each(s.numbers, [&](int32_t n) {
        ways->way[n].first = first[n];
        count[n] = ways->way[n].numbers;
    });
    const int32_t numbers = add_up(s.numbers, count, first, &shared->count);
    each(s.numbers, [&](int32_t n) { ways->way[n].at = first[n]; });
    ways->passed = take<ncp_passed>(memory, (size_t)nodes);
    ways->shares = take<double>(memory, (size_t)numbers);
    __syncthreads();
    return !memory->full;
}

/* G. regularisation: of contacts, a share of their response. */
static __device__ void find_responses(const cuda_view &v, const ncp_island &s, const ncp_ways &ways)
{
    each(s.numbers, [&](int32_t n) {
        int k;
        const int32_t law = law_of(s, n, &k);
        pass_number(v, s, s.law[law], k, ways, ways.way[n]);
    });
    __syncthreads();
    const int32_t n = s.numbers;
    each(n * n, [&](int32_t t) {
        const int32_t r = t / n, c = t % n;
        if (r > c) return;
        const double G = respond(s, ways, r, c);
        int k;
        const ncp_law &row = s.law[law_of(s, r, &k)], &column = s.law[law_of(s, c, &k)];
        s.G[r * n + c] = row.gain * G + (r == c ? row.compliance : 0);
        if (r != c) s.G[c * n + r] = column.gain * G;
    });
    __syncthreads();
}

#endif
