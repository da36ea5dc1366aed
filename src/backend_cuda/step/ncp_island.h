/* The dense contact solve (core/solve/ncp.h) on the device: an island by a thread block, in double.
 *
 *     bodies are nodes of trees (core/solve/articulation_tree.h), those without joints by themselves
 *     locks and laws with compliance and without bounds are part of the trees' factor (ncp_tree.h)
 *     contacts and all other rows are numbers of a dense problem: u = G lambda + u_free, by how the trees respond
 *     (ncp_response.h), and laws of theirs; semismooth Newton steps find them (ncp_newton.h)
 *
 * Rows with bounds have numbers once their law is not met without. Every sum is made by one thread, in one order:
 * results do not depend on how many threads an island has. Few islands have a block each (ncp_block.cu); where there
 * are thousands, a warp each does (ncp_warp.cu). */
#ifndef SADMM_CUDA_STEP_NCP_ISLAND_H
#define SADMM_CUDA_STEP_NCP_ISLAND_H

#include "backend_cuda/device/double.h"
#include "core/math/contact.h"
#include "core/math/ldl6.h"
#include "ncp_bodies.h"
#include "world.h"

/* Islands of a block at a time, and threads of each. Is what a few steps do not solve left to a block of its own?
 * Thousands of islands would wait for it. */
#ifdef NCP_BY_WARP
enum { NCP_ISLANDS = NCP_WARPS, NCP_THREADS = 32, NCP_LEAVES_HARD = true };
#else
enum { NCP_ISLANDS = 1, NCP_THREADS = NCP_LARGE_BLOCK, NCP_LEAVES_HARD = false };
#endif
static __device__ __forceinline__ int32_t ncp_thread(void) { return (int32_t)threadIdx.x % (int32_t)NCP_THREADS; }
static __device__ __forceinline__ int32_t ncp_threads(void) { return NCP_THREADS; }

/* A barrier of an island's threads; */
static __device__ __forceinline__ void ncp_barrier(void)
{
    if ((int)NCP_THREADS > (int)WARP) __syncthreads();
    else __syncwarp((unsigned)ALL_LANES);
}

/* of all threads of the block. Its warps begin each phase together: what thousands of warps run, each somewhere else,
 * does not fit the caches for instructions. */
static __device__ __forceinline__ void ncp_together(void)
{
    if ((int)NCP_ISLANDS > 1) __syncthreads();
}

/* A node while velocities are found: loads on the way to the root, what is handed on, and in between. */
struct ncp_passing {
    double load[6], up[6], q[6], p[6], t[6];
};

/* What its joint leaves of a body's motion past its parent's. In the island's `pool` are directions S, U = A S, H and
 * what it is the inverse of, and what rows with compliance add to t. */
struct ncp_node {
    int32_t body, parent;      /* raw; node, -1: none */
    int32_t child, sibling;    /* nodes, -1: none */
    int32_t level;             /* joints to the root */
    int32_t bound;             /* its joint has rows */
    int32_t free, pool;        /* directions; where they are in the pool: 6 free, 6 free, free^2, free^2, free */
    int32_t first_row, rows;   /* but for locks */
    int32_t loads;             /* of its rows have multipliers that act as loads */
    int32_t first_joint, joints; /* of v.ncp.joints */
    int32_t locks[2], lock[6]; /* translations, then rotations; 2 slot + side of v.raw.rows */
    int8_t place[6];           /* where they are in M and `held`, at first */
    double offset[3];          /* from the parent's centre of mass */
    struct cuda_articulation_body own;
    double met[6], held[6];    /* s, which meets the locks; A s */
    double velocity[6];
    union {
        double M[36];          /* locks' Jacobians; then, while it is factorized, what it hands on to its parent */
        struct ncp_passing now; /* then */
    };
};

struct ncp_contact {
    int32_t pair, point;
    int32_t node[2];    /* -1: not dynamic */
    double frame[9];    /* normal, tangents */
    double arm[2][3];
    double given[3];    /* velocity of what is not dynamic, and e */
};

enum ncp_role { NCP_LOCK, NCP_SOFT, NCP_BOUNDED, NCP_FIXED }; /* locks are no ncp_row */

struct ncp_row {
    int32_t slot, side; /* in v.raw.rows; of the node's body */
    int32_t node;       /* whose joint it is of, -1: it acts by its Jacobians on both sides (gears) */
    int32_t role;
    int32_t along;      /* where S^T J^T is in the pool */
    int32_t number;     /* of the dense problem; -1: none */
    double jacobian[6]; /* on the node's body */
    double gain, bias, compliance, lo, hi;
    double lambda, u;   /* multiplier; gain x + bias + compliance lambda */
    double response;    /* what the natural map takes u to lambda by */
};

/* A law of the dense problem: a contact's three numbers, or a row's one. */
struct ncp_law {
    int32_t first, count;
    int32_t of;         /* contact, or row */
    double response, friction, lo, hi;
    double gain, compliance; /* of its numbers in G: 1, 0 of contacts */
};

/* Memory: the island's share of the block's first, then what is far. */
struct ncp_memory {
    char *at, *end, *far_at, *far_end;
    bool full;
};
template <class T> static __device__ __forceinline__ T *take(ncp_memory *memory, size_t count)
{
    const size_t bytes = (count * sizeof(T) + 15) / 16 * 16;
    char *out = memory->at;
    if (out + bytes <= memory->end) {
        memory->at += bytes;
        return (T *)out;
    }
    out = memory->far_at;
    if (out + bytes > memory->far_end) {
        memory->full = true;
        return (T *)memory->far_end; /* nobody uses it */
    }
    memory->far_at += bytes;
    return (T *)out;
}

/* What is large and used little: the nearer memory is for the rest, if that would take most of it. */
template <class T> static __device__ __forceinline__ T *take_large(ncp_memory *memory, size_t count)
{
    ncp_memory far = *memory;
    if (2 * count * sizeof(T) <= (size_t)(memory->end - memory->at)) return take<T>(memory, count);
    far.at = far.end;
    T *out = take<T>(&far, count);
    memory->far_at = far.far_at;
    memory->full |= far.full;
    return out;
}

/* A node that a load has passed (ncp_response.h): where z and H z are, one behind the other. */
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
    double (*p)[6]; /* by eight lanes: a load where it is on its way */
};

/* Once for all its threads: each reads what the first one writes (put). */
struct ncp_island {
    int32_t label, first_slot, bodies, contacts, rows, first_gear, levels; /* rows of gears come last */
    ncp_node *node;
    int32_t *of, *at;             /* of nodes, to be added up; the sums */
    int32_t *order, *level_first; /* nodes by level; where levels begin among them, and where the last ends */
    ncp_contact *contact;
    ncp_row *row;
    int32_t bounded, *bounded_row; /* rows that may have numbers */
    double *pool;
    /* of contacts x 3: impulses along their frames */
    double *impulse, *kept; /* kept: with multipliers of rows, a solution that is held against another one */
    bool missed; /* its contacts give, by more than the tolerance */
    /* the dense problem */
    int32_t laws, numbers, stride; /* stride: of G's rows; odd, as M's: columns are read without conflicts */
    ncp_law *law;
    double *lambda, *u, *step, *moved, *best_lambda, *best_u, *D;
    int32_t *list, *pivot;
    double *G, *M;
    ncp_ways ways;
};

/* What its threads share. */
struct ncp_shared {
    unsigned long long most;
    int32_t flag, count, pivot;
    int32_t parts, part[NCP_PARTS];         /* of the island */
    ncp_island island;
};

/* What every thread has found alike. The others read it after a barrier, and have read what was there before one. */
template <class T> static __device__ __forceinline__ void put(T &to, const T &value)
{
    if (ncp_thread() == 0) to = value;
}

/* Calls f(k) for k < count, by a thread each. */
template <class F> static __device__ __forceinline__ void each(int32_t count, const F &f)
{
#pragma unroll 1
    for (int32_t k = ncp_thread(); k < count; k += ncp_threads()) f(k);
}

/* Eight lanes for each of `count`: f(k, lane), k = -1 for those beyond. Every lane of a warp comes there. */
template <class F> static __device__ __forceinline__ void each_eight(int32_t count, const F &f)
{
#pragma unroll 1
    for (int32_t first = ncp_thread() / WARP * (WARP / LANES); first < count;
         first += ncp_threads() / LANES) {
        const int32_t k = first + ncp_thread() % WARP / LANES;
        f(k < count ? k : -1, ncp_thread() % LANES);
    }
}

/* Nodes of a level: f(node, lane, live), six lanes of each live. Every lane of a warp comes there. */
template <class F> static __device__ __forceinline__ void each_node(const ncp_island &s, int32_t level, const F &f)
{
    const int32_t first = s.level_first[level];
    each_eight(s.level_first[level + 1] - first, [&](int32_t k, int lane) {
        f(&s.node[k < 0 ? 0 : s.order[first + k]], lane, k >= 0 && lane < 6);
    });
    ncp_barrier();
}

/* f(i, k) for i < rows and k < columns, by a thread each: columns side by side. */
template <class F> static __device__ __forceinline__ void each_entry(int32_t rows, int32_t columns, const F &f)
{
    int32_t width = 1, bits = 0;
    while (width < columns && width < ncp_threads()) width *= 2, ++bits;
    const int32_t t = ncp_thread();
#pragma unroll 1
    for (int32_t k = t & (width - 1); k < columns; k += width)
#pragma unroll 1
        for (int32_t i = t >> bits; i < rows; i += ncp_threads() >> bits) f(i, k);
}

/* *at = of[0] + ... before each of `count`; returns the sum. */
static __device__ __noinline__ int32_t add_up(int32_t count, const int32_t *of, int32_t *at, int32_t *sum)
{
    ncp_barrier();
    if (ncp_thread() < WARP) {
        int32_t total = 0;
        for (int32_t first = 0; first < count; first += WARP) {
            const int32_t k = first + ncp_thread(), own = k < count ? of[k] : 0;
            int32_t up = own;
#pragma unroll
            for (int32_t o = 1; o < WARP; o *= 2) {
                const int32_t before = __shfl_up_sync((unsigned)ALL_LANES, up, (unsigned)o);
                if (ncp_thread() >= o) up += before;
            }
            if (k < count) at[k] = total + up - own;
            total += __shfl_sync((unsigned)ALL_LANES, up, WARP - 1, WARP);
        }
        if (ncp_thread() == 0) *sum = total;
    }
    ncp_barrier();
    const int32_t out = *sum;
    ncp_barrier();
    return out;
}

/* Those k of `count` that f(k) says, ascending: to *list, by the first warp; returns how many. */
template <class F>
static __device__ __forceinline__ int32_t make_list(int32_t count, int32_t *list, int32_t *sum, const F &f)
{
    if (ncp_thread() < WARP) {
        int32_t total = 0;
        for (int32_t first = 0; first < count; first += WARP) {
            const int32_t k = first + ncp_thread();
            const bool is = k < count && f(k);
            const unsigned lanes = __ballot_sync((unsigned)ALL_LANES, is);
            if (is) list[total + __popc(lanes & ((1u << ncp_thread()) - 1))] = k;
            total += __popc(lanes);
        }
        if (ncp_thread() == 0) *sum = total;
    }
    ncp_barrier();
    const int32_t out = *sum;
    ncp_barrier();
    return out;
}

/* The largest of all threads' numbers, none of which is negative; what is not a number is the most. Every thread sees
 * then what others have written. */
static __device__ __noinline__ double most_of(double own, ncp_shared *shared)
{
    unsigned long long bits = own <= 0 ? 0 : (unsigned long long)__double_as_longlong(fabs(own));
    ncp_barrier();
#pragma unroll
    for (int o = WARP / 2; o > 0; o /= 2) {
        const unsigned long long other = __shfl_xor_sync((unsigned)ALL_LANES, bits, o);
        bits = other > bits ? other : bits;
    }
    if (ncp_threads() > WARP) {
        if (ncp_thread() == 0) shared->most = 0;
        ncp_barrier();
        if (ncp_thread() % WARP == 0) atomicMax(&shared->most, bits);
        ncp_barrier();
        bits = shared->most;
    }
    return __longlong_as_double((long long)bits);
}
static __device__ __noinline__ bool any_of(bool own, ncp_shared *shared)
{
    ncp_barrier();
    const bool any = __ballot_sync((unsigned)ALL_LANES, own) != 0;
    if (ncp_threads() <= WARP) return any;
    if (ncp_thread() == 0) shared->flag = 0;
    ncp_barrier();
    if (any && ncp_thread() % WARP == 0) shared->flag = 1;
    ncp_barrier();
    return shared->flag != 0;
}

/* ---- small products ---------------------------------------------------------------------------------------------- */

static __device__ __forceinline__ double along(int n, const double *a, const double *b)
{
    double sum = 0;
#pragma unroll 1
    for (int k = 0; k < n; ++k) sum += a[k] * b[k];
    return sum;
}

/* X v: a velocity at a place r further on. */
static __device__ __forceinline__ void carry(const double r[3], const double v[6], double to[6])
{
    for (int k = 0; k < 6; ++k) to[k] = v[k];
    add_cross(v + 3, r, 1, to);
}

static __device__ __forceinline__ double *directions_of(const ncp_island &s, const ncp_node &node)
{
    return s.pool + node.pool;
}
static __device__ __forceinline__ double *forces_of(const ncp_island &s, const ncp_node &node)
{
    return s.pool + node.pool + 6 * node.free;
}
static __device__ __forceinline__ double *inverse_of(const ncp_island &s, const ncp_node &node)
{
    return s.pool + node.pool + 12 * node.free;
}
static __device__ __forceinline__ double *stiffness_of(const ncp_island &s, const ncp_node &node)
{
    return s.pool + node.pool + node.free * (12 + node.free);
}

static __device__ __forceinline__ double *soft_of(const ncp_island &s, const ncp_node &node)
{
    return s.pool + node.pool + node.free * (12 + 2 * node.free);
}

/* Does it hand anything on? */
static __device__ __forceinline__ bool is_carried(const ncp_node &node) { return node.parent >= 0 && node.bound; }

/* The node of a body; of a side of a gear. */
static __device__ __forceinline__ int32_t node_of_body(const cuda_view &v, int32_t body)
{
    return body >= 0 ? v.ncp.number[body] : -1;
}
static __device__ __forceinline__ int32_t side_of_gear(const cuda_view &v, int32_t slot, int side)
{
    const struct sadmm_row_constraint *constraint = &v.raw.constraints[slot / SADMM_MAX_ROWS];
    return node_of_body(v, side ? constraint->body_b : constraint->body_a);
}

/* ---- bodies and rows --------------------------------------------------------------------------------------------- */

/* Of a row: J A^-1 J^T. */
static __device__ __forceinline__ double own_response(const struct cuda_articulation_body &body, const double row[6])
{
    const vec3 turn = v3_load(row + 3);
    return v3_norm2(v3_load(row)) / body.mass + v3_dot(turn, m3_solve(inertia_of(body), turn));
}

/* x of a row: its body's velocity less what its parent takes it along with, or both sides'. */
static __device__ __forceinline__ double rate_of(const cuda_view &v, const ncp_island &s, const ncp_row &row)
{
    double held[6] = {0, 0, 0, 0, 0, 0}, x = 0;
    if (row.node >= 0) {
        const ncp_node &node = s.node[row.node];
        if (node.parent >= 0) carry(node.offset, s.node[node.parent].velocity, held);
        for (int k = 0; k < 6; ++k) held[k] = node.velocity[k] - held[k];
        return six_product(row.jacobian, held);
    }
    for (int side = 0; side < 2; ++side) {
        const int32_t n = side_of_gear(v, row.slot, side);
        if (n >= 0) x += six_product(v.raw.rows[row.slot].jacobian[side], s.node[n].velocity);
    }
    return x;
}

static __device__ __forceinline__ void contact_row(const ncp_contact &c, int i, int side, double row[6])
{
    sadmm_contact_row(v3_load(c.frame + 3 * i), c.arm[side], side ? 1 : -1, row);
}

/* The law of a number, and which of its numbers it is. */
static __device__ __forceinline__ int32_t law_of(const ncp_island &s, int32_t number, int *k)
{
    *k = number < 3 * s.contacts ? number % 3 : 0;
    return number < 3 * s.contacts ? number / 3 : number - 2 * s.contacts;
}

#endif
