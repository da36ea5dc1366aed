/* A part of joined bodies (core/model/joined.h), solved by a thread block: the host's formulas in its order. */
#ifndef SADMM_CUDA_STEP_JOINED_BLOCK_H
#define SADMM_CUDA_STEP_JOINED_BLOCK_H

#include "backend_cuda/device/context.h"
#include "core/model/joined.h"

enum { JOINED_THREADS = 512 };

/* Calls f(k) for k < count, by a thread each. */
template <class F> static __device__ __forceinline__ void each(int32_t count, const F &f)
{
#pragma unroll 1
    for (int32_t k = (int32_t)threadIdx.x; k < count; k += JOINED_THREADS) f(k);
}

/* to[k] = f(k) for k < count: what waits for memory waits together. */
template <class T, class F> static __device__ __forceinline__ void copy(int32_t count, T *to, const F &f)
{
    enum { TOGETHER = 4 };
#pragma unroll 1
    for (int32_t first = (int32_t)threadIdx.x; first < count; first += TOGETHER * JOINED_THREADS) {
        T value[TOGETHER];
#pragma unroll
        for (int i = 0; i < TOGETHER; ++i) {
            const int32_t k = first + i * JOINED_THREADS;
            value[i] = f(k < count ? k : count - 1);
        }
#pragma unroll
        for (int i = 0; i < TOGETHER; ++i)
            if (first + i * JOINED_THREADS < count) to[first + i * JOINED_THREADS] = value[i];
    }
}

/* Eight lanes a body, one a component. Calls f(entry, component), also for lanes 6 and 7. */
template <class F> static __device__ __forceinline__ void each_component(const joined_view &p, const F &f)
{
    each(p.s.bodies * LANES, [&](int32_t t) { f(t / LANES, t % LANES); });
}

static __device__ __forceinline__ int32_t row_in_world(const joined_view &p, int32_t r)
{
    return p.s.constraint[r / JOINED_ROWS] * SADMM_MAX_ROWS + r % JOINED_ROWS;
}

/* The block's part. SMALL: in the block's own memory; else its structure and its work are where they are. */
template <bool SMALL> static __device__ __forceinline__ joined_view view_of_block(const cuda_view &v, double *memory)
{
    const struct cuda_joined_part part = v.joints.parts[blockIdx.x];
    const int32_t *numbers = v.joints.structures + part.first_number;
    if (SMALL) copy(part.numbers, (int32_t *)memory, [&](int32_t k) { return numbers[k]; });
    __syncthreads(); /* flags, too */
    const struct joined_structure s = joined_structure_at(SMALL ? (const int32_t *)memory : numbers);
    return joined_view_at(&s, SMALL ? memory + joined_numbers_size(part.numbers) : v.joints.work + part.first_work);
}

/* Entry (k, q) of A of a rigid body. */
static __device__ __forceinline__ double rigid_entry(const struct cuda_joined_body &body, int k, int q)
{
    const int i = k - 3, j = q - 3;
    if (k < 3 || q < 3) return k == q ? body.mass : 0;
    return body.inertia[i == j ? i : i + j + 2]; /* xx, yy, zz, xy, xz, yz */
}

static __device__ __forceinline__ void load_inertia(const cuda_view &v, const joined_view &p)
{
    each_component(p, [&](int32_t e, int k) {
        const int32_t body = p.s.body[e];
        if (k >= 6) return;
        for (int q = 0; q < 6; ++q) p.factor[36 * e + 6 * k + q] = rigid_entry(v.joints.bodies[body], k, q);
    });
}

/* ---- a pass ------------------------------------------------------------------------------------------------------ */

/* earlier: states of the part's rows after a solve of this step, by number in the world; NULL: there was none. */
static __device__ __forceinline__ void begin_part(const joined_view &p, const uint8_t *earlier)
{
    each(p.s.bodies, [&](int32_t e) {
        ldl6_factor(p.factor + 36 * e, p.factor + 36 * e);
        ldl6_solve(p.factor + 36 * e, p.missing + 6 * e, p.missing + 6 * e);
    });
    __syncthreads();
    each(p.s.places * JOINED_ROWS * 2, [&](int32_t t) { joined_respond(&p, t / 2, t % 2); });
    __syncthreads();
    each(p.s.places * JOINED_ROWS, [&](int32_t r) {
        if (p.state[r] == JOINED_ABSENT) return;
        joined_begin_row(&p, r, earlier ? earlier[row_in_world(p, r)] : (uint8_t)JOINED_ABSENT);
    });
    __syncthreads();
}

static __device__ __forceinline__ double *node_of(const joined_view &p, int32_t node)
{
    return node < p.s.places ? p.diagonal + JOINED_BLOCK * node : p.below + JOINED_BLOCK * (node - p.s.places);
}

/* All nodes before anything is taken from them: what waits for memory, side by side. */
static __device__ __forceinline__ void enter_blocks(const joined_view &p)
{
    each((p.s.places + p.s.blocks) * JOINED_TILES, [&](int32_t t) {
        const int32_t node = t / JOINED_TILES, b = node - p.s.places, tile = t % JOINED_TILES;
        if (b < 0 && joined_tile_is_above(tile)) return;
        const struct joined_tile made = joined_enter(&p, b < 0 ? node : p.s.row[b], b < 0 ? node : p.s.column[b],
                                                     b < 0 ? JOINED_OWN : p.s.common[b], tile);
        joined_store_tile(node_of(p, node), tile, &made);
    });
    __syncthreads();
}

/* Calls f(group, k) for k < share of each group of a list (core/model/joined.h: pushes, pulls), by a thread each. */
template <class F>
static __device__ __forceinline__ void each_of_group(const int32_t *list, int32_t first, int32_t end, int32_t share,
                                                     const F &f)
{
    each((end - first) * share, [&](int32_t t) { f(list + 3 * (first + t / share), t % share); });
}

/* What columns of a level take from later nodes. */
static __device__ __forceinline__ void push_level(const joined_view &p, int32_t level)
{
    const int32_t *first = p.s.first_push + 2 * level;
    each_of_group(p.s.push, first[0], first[2], JOINED_TILES, [&](const int32_t *push, int32_t tile) {
        if (push[0] < p.s.places && joined_tile_is_above(tile)) return;
        double *node = node_of(p, push[0]);
        struct joined_tile made = joined_load_tile(node, tile);
        joined_update(&p, push[1], push[2], tile, &made);
        joined_store_tile(node, tile, &made);
    });
    __syncthreads();
}

/* Each row of a column factors its diagonal node by itself, which waits for less than a factor that one thread hands to
 * the others. */
static __device__ __forceinline__ void factor_level(const joined_view &p, int32_t level)
{
    const int32_t first = p.s.first_of_level[level], end = p.s.first_of_level[level + 1],
                  first_block = p.s.first_below[first], rows = (p.s.first_below[end] - first_block) * JOINED_ROWS;
    each(rows + (end - first) * JOINED_ROWS, [&](int32_t t) {
        const bool below = t < rows;
        const int32_t at = (below ? t : t - rows) / JOINED_ROWS,
                      place = below ? p.s.column[first_block + at] : first + at;
        double L[JOINED_BLOCK];
        ldl6_factor(p.diagonal + JOINED_BLOCK * place, L);
        if (below) joined_finish_row(&p, L, first_block + at, t % JOINED_ROWS);
        else joined_invert_row(&p, L, place, t % JOINED_ROWS);
    });
    __syncthreads();
    push_level(p, level);
}

static __device__ __forceinline__ void forward_level(const joined_view &p, int32_t level)
{
    const int32_t first = p.s.first_of_level[level] * JOINED_ROWS, end = p.s.first_of_level[level + 1] * JOINED_ROWS,
                  *first_push = p.s.first_push + 2 * level;
    each(end - first, [&](int32_t k) { joined_find_forward(&p, first + k); });
    __syncthreads();
    each_of_group(p.s.push, first_push[0], first_push[1], JOINED_ROWS, [&](const int32_t *push, int32_t k) {
        joined_push_right(&p, push[0], push[1], push[2], k);
    });
    __syncthreads();
}

static __device__ __forceinline__ void backward_level(const joined_view &p, int32_t level)
{
    const int32_t first = p.s.first_of_level[level] * JOINED_ROWS, end = p.s.first_of_level[level + 1] * JOINED_ROWS,
                  *first_pull = p.s.first_pull + level;
    each(end - first, [&](int32_t k) { joined_find_backward(&p, first + k); });
    __syncthreads();
    each_of_group(p.s.pull, first_pull[0], first_pull[1], JOINED_ROWS, [&](const int32_t *pull, int32_t k) {
        joined_pull_right(&p, pull[0], pull[1], pull[2], k);
    });
    __syncthreads();
}

static __device__ __forceinline__ void move_bodies(const joined_view &p)
{
    each_component(p, [&](int32_t e, int k) {
        if (k < 6) joined_move(&p, e, k);
    });
    __syncthreads();
}

/* again: from what the multipliers are. */
static __device__ __forceinline__ void solve_rows(const joined_view &p, bool again)
{
    const int32_t rows = p.s.places * JOINED_ROWS;
#pragma unroll 1
    for (int turn = 0; turn < 2; ++turn) { /* to what the other rows say; then as all of them say */
        each(rows, [&](int32_t r) { joined_put_change(&p, r, again, turn > 0); });
        __syncthreads();
        if (turn > 0 || !again) move_bodies(p);
        if (turn > 0) return;
        each(rows, [&](int32_t r) { p.right[r] = joined_right(&p, r, again); });
        __syncthreads();
#pragma unroll 1
        for (int32_t level = 0; level < p.s.levels; ++level) forward_level(p, level);
        each(rows, [&](int32_t r) { joined_turn(&p, r); });
        __syncthreads();
#pragma unroll 1
        for (int32_t level = p.s.levels - 1; level >= 0; --level) backward_level(p, level);
    }
}

/* Is `f(row)` true of any row? */
template <class F>
static __device__ __forceinline__ bool any_row(const joined_view &p, int32_t *shared_flag, const F &f)
{
    if (threadIdx.x == 0) *shared_flag = 0;
    __syncthreads();
    each(p.s.places * JOINED_ROWS, [&](int32_t r) {
        if (f(r)) *shared_flag = 1;
    });
    __syncthreads();
    const bool any = *shared_flag != 0;
    __syncthreads();
    return any;
}

/* The most that a row inside its bounds misses. */
static __device__ __forceinline__ double most_missing(const joined_view &p, unsigned long long *shared_most)
{
    double own = 0;
    if (threadIdx.x == 0) *shared_most = 0;
    __syncthreads();
    each(p.s.places * JOINED_ROWS, [&](int32_t r) { own = max_of(own, joined_misses(&p, r)); });
    /* numbers that are not negative are in the order of their bits */
    if (own > 0) atomicMax(shared_most, (unsigned long long)__double_as_longlong(own));
    __syncthreads();
    const double most = __longlong_as_double((long long)*shared_most);
    __syncthreads();
    return most;
}

/* Are rows to be solved once more by the same factor? last: what they missed before that was done the last time. */
template <bool EXACT>
static __device__ __forceinline__ bool goes_on(const joined_view &p, int32_t *shared_flag,
                                               unsigned long long *shared_most, double *last)
{
    if (!EXACT) return any_row(p, shared_flag, [&](int32_t r) { return joined_gives_much(&p, r); });
    const double missing = most_missing(p, shared_most);
    const bool on = missing > JOINED_EXACT && missing < *last / 2;
    *last = missing;
    return on;
}

/* Until no row changes its state. Are all numbers finite then? EXACT: what rows give by is taken back as far as it can
 * be (core/solve/joined_part.h), not only where it is much. */
template <bool EXACT>
static __device__ __forceinline__ bool solve_part(const joined_view &p, const uint8_t *earlier, int32_t *shared_flag,
                                                  unsigned long long *shared_most)
{
    enum { TIMES = EXACT ? 1 + (int)JOINED_BACKS : 2 };
    bool changed = true;
    begin_part(p, earlier);
#pragma unroll 1
    for (int pass = 0; pass < JOINED_PASSES && changed; ++pass) {
        enter_blocks(p);
#pragma unroll 1
        for (int32_t level = 0; level < p.s.levels; ++level) factor_level(p, level);
        double last = INFINITY;
#pragma unroll 1
        for (int again = 0; again < TIMES; ++again) {
            if (again && !goes_on<EXACT>(p, shared_flag, shared_most, &last)) break;
            solve_rows(p, again != 0);
            if (EXACT && again) continue; /* where they have got to, at the end */
            changed = any_row(p, shared_flag, [&](int32_t r) { return joined_change_row(&p, r); });
            if (changed) break;
        }
        if (EXACT && !changed) changed = any_row(p, shared_flag, [&](int32_t r) { return joined_change_row(&p, r); });
    }
    return !changed && !any_row(p, shared_flag, [&](int32_t r) { /* a place has no more bodies than rows */
        const int32_t k = r % JOINED_ROWS, a = p.s.side[2 * (r / JOINED_ROWS)], b = p.s.side[2 * (r / JOINED_ROWS) + 1];
        double sum = p.change[r] * 0;
        if (a >= 0) sum += p.dv[6 * a + k] * 0;
        if (b >= 0) sum += p.dv[6 * b + k] * 0;
        return !(sum == 0);
    });
}

#endif
