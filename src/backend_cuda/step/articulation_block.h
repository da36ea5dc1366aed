/* An articulation (core/model/articulation.h), a part, solved by a thread block: the host's formulas in its order. */
#ifndef SADMM_CUDA_STEP_ARTICULATION_BLOCK_H
#define SADMM_CUDA_STEP_ARTICULATION_BLOCK_H

#include "backend_cuda/device/context.h"
#include "core/model/articulation.h"

enum { ARTICULATION_THREADS = 512 };

/* Calls f(k) for k < count, by a thread each. */
template <class F> static __device__ __forceinline__ void each(int32_t count, const F &f)
{
#pragma unroll 1
    for (int32_t k = (int32_t)threadIdx.x; k < count; k += ARTICULATION_THREADS) f(k);
}

/* to[k] = f(k) for k < count: what waits for memory waits together. */
template <class T, class F> static __device__ __forceinline__ void copy(int32_t count, T *to, const F &f)
{
    enum { TOGETHER = 4 };
#pragma unroll 1
    for (int32_t first = (int32_t)threadIdx.x; first < count; first += TOGETHER * ARTICULATION_THREADS) {
        T value[TOGETHER];
#pragma unroll
        for (int i = 0; i < TOGETHER; ++i) {
            const int32_t k = first + i * ARTICULATION_THREADS;
            value[i] = f(k < count ? k : count - 1);
        }
#pragma unroll
        for (int i = 0; i < TOGETHER; ++i)
            if (first + i * ARTICULATION_THREADS < count) to[first + i * ARTICULATION_THREADS] = value[i];
    }
}

/* Eight lanes a body, one a component. Calls f(entry, component), also for lanes 6 and 7. */
template <class F> static __device__ __forceinline__ void each_component(const articulation_view &p, const F &f)
{
    each(p.s.bodies * LANES, [&](int32_t t) { f(t / LANES, t % LANES); });
}

static __device__ __forceinline__ int32_t row_in_world(const articulation_view &p, int32_t r)
{
    return p.s.constraint[r / SADMM_MAX_ROWS] * SADMM_MAX_ROWS + r % SADMM_MAX_ROWS;
}

/* A part. SMALL: in the block's own memory; else its structure and its work are where they are. */
template <bool SMALL>
static __device__ __forceinline__ articulation_view view_of_part(const cuda_view &v, int32_t which, double *memory)
{
    const struct cuda_articulation_part part = v.joints.parts[which];
    const int32_t *numbers = v.joints.structures + part.first_number;
    if (SMALL) copy(part.numbers, (int32_t *)memory, [&](int32_t k) { return numbers[k]; });
    __syncthreads(); /* flags, too */
    const struct articulation_structure s = articulation_structure_at(SMALL ? (const int32_t *)memory : numbers);
    return articulation_view_at(&s,
                                SMALL ? memory + articulation_numbers_size(part.numbers)
                                      : v.joints.work + part.first_work);
}

/* Entry (k, q) of A of a rigid body. */
static __device__ __forceinline__ double rigid_entry(const struct cuda_articulation_body &body, int k, int q)
{
    const int i = k - 3, j = q - 3;
    if (k < 3 || q < 3) return k == q ? body.mass : 0;
    return body.inertia[i == j ? i : i + j + 2]; /* xx, yy, zz, xy, xz, yz */
}

static __device__ __forceinline__ void load_inertia(const cuda_view &v, const articulation_view &p)
{
    each_component(p, [&](int32_t e, int k) {
        const int32_t body = p.s.body[e];
        if (k >= 6) return;
        for (int q = 0; q < 6; ++q) p.factor[36 * e + 6 * k + q] = rigid_entry(v.joints.bodies[body], k, q);
    });
}

/* ---- a pass ------------------------------------------------------------------------------------------------------ */

/* earlier: states of the part's rows after a solve of this step, by number in the world; NULL: there was none. */
static __device__ __forceinline__ void begin_part(const articulation_view &p, const uint8_t *earlier)
{
    each(p.s.bodies, [&](int32_t e) {
        ldl6_factor(p.factor + 36 * e, p.factor + 36 * e);
        ldl6_solve(p.factor + 36 * e, p.residual + 6 * e, p.residual + 6 * e);
    });
    __syncthreads();
    each(p.s.columns * SADMM_MAX_ROWS * 2, [&](int32_t t) { articulation_respond(&p, t / 2, t % 2); });
    __syncthreads();
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) {
        if (p.state[r] == ROW_ABSENT) return;
        articulation_begin_row(&p, r, earlier ? earlier[row_in_world(p, r)] : (uint8_t)ROW_ABSENT,
                               articulation_regularisation(&p, r));
    });
    __syncthreads();
}

static __device__ __forceinline__ double *node_of(const articulation_view &p, int32_t node)
{
    return node < p.s.columns ? p.diagonal + ARTICULATION_BLOCK * node
                              : p.below + ARTICULATION_BLOCK * (node - p.s.columns);
}

/* All nodes before anything is taken from them: what waits for memory, side by side. */
static __device__ __forceinline__ void enter_blocks(const articulation_view &p)
{
    each((p.s.columns + p.s.blocks) * ARTICULATION_TILES, [&](int32_t t) {
        const int32_t node = t / ARTICULATION_TILES, b = node - p.s.columns, tile = t % ARTICULATION_TILES;
        if (b < 0 && articulation_tile_is_above(tile)) return;
        const struct articulation_tile made = articulation_enter(&p, b < 0 ? node : p.s.row[b],
                                                                 b < 0 ? node : p.s.column[b],
                                                                     b < 0 ? ARTICULATION_OWN : p.s.common[b], tile);
        articulation_store_tile(node_of(p, node), tile, &made);
    });
    __syncthreads();
}

/* Calls f(group, k) for k < share of each group of a list (core/model/articulation.h: scatters, gathers), by a thread
 * each. */
template <class F>
static __device__ __forceinline__ void each_of_group(const int32_t *list, int32_t first, int32_t end, int32_t share,
                                                     const F &f)
{
    each((end - first) * share, [&](int32_t t) { f(list + 3 * (first + t / share), t % share); });
}

/* The updates of later nodes by columns of a level. */
static __device__ __forceinline__ void scatter_level(const articulation_view &p, int32_t level)
{
    const int32_t *first = p.s.first_scatter + 2 * level;
    each_of_group(p.s.scatter, first[0], first[2], ARTICULATION_TILES, [&](const int32_t *scatter, int32_t tile) {
        if (scatter[0] < p.s.columns && articulation_tile_is_above(tile)) return;
        double *node = node_of(p, scatter[0]);
        struct articulation_tile made = articulation_load_tile(node, tile);
        articulation_update(&p, scatter[1], scatter[2], tile, &made);
        articulation_store_tile(node, tile, &made);
    });
    __syncthreads();
}

/* Each row of a column factors its diagonal node by itself, which waits for less than a factor that one thread hands to
 * the others. */
static __device__ __forceinline__ void factor_level(const articulation_view &p, int32_t level)
{
    const int32_t first = p.s.first_of_level[level], end = p.s.first_of_level[level + 1],
                  first_block = p.s.first_below[first], rows = (p.s.first_below[end] - first_block) * SADMM_MAX_ROWS;
    each(rows + (end - first) * SADMM_MAX_ROWS, [&](int32_t t) {
        const bool below = t < rows;
        const int32_t at = (below ? t : t - rows) / SADMM_MAX_ROWS,
                      column = below ? p.s.column[first_block + at] : first + at;
        double L[ARTICULATION_BLOCK];
        ldl6_factor(p.diagonal + ARTICULATION_BLOCK * column, L);
        if (below) articulation_finish_row(&p, L, first_block + at, t % SADMM_MAX_ROWS);
        else articulation_invert_row(&p, L, column, t % SADMM_MAX_ROWS);
    });
    __syncthreads();
    scatter_level(p, level);
}

static __device__ __forceinline__ void forward_level(const articulation_view &p, int32_t level)
{
    const int32_t first = p.s.first_of_level[level] * SADMM_MAX_ROWS,
                  end = p.s.first_of_level[level + 1] * SADMM_MAX_ROWS,
                  *first_scatter = p.s.first_scatter + 2 * level;
    each(end - first, [&](int32_t k) { articulation_find_forward(&p, first + k); });
    __syncthreads();
    each_of_group(p.s.scatter, first_scatter[0], first_scatter[1], SADMM_MAX_ROWS,
                  [&](const int32_t *scatter, int32_t k) {
        articulation_scatter_right(&p, scatter[0], scatter[1], scatter[2], k);
    });
    __syncthreads();
}

static __device__ __forceinline__ void backward_level(const articulation_view &p, int32_t level)
{
    const int32_t first = p.s.first_of_level[level] * SADMM_MAX_ROWS,
                  end = p.s.first_of_level[level + 1] * SADMM_MAX_ROWS,
                  *first_gather = p.s.first_gather + level;
    each(end - first, [&](int32_t k) { articulation_find_backward(&p, first + k); });
    __syncthreads();
    each_of_group(p.s.gather, first_gather[0], first_gather[1], SADMM_MAX_ROWS, [&](const int32_t *gather, int32_t k) {
        articulation_gather_right(&p, gather[0], gather[1], gather[2], k);
    });
    __syncthreads();
}

static __device__ __forceinline__ void move_bodies(const articulation_view &p)
{
    each_component(p, [&](int32_t e, int k) {
        if (k < 6) articulation_move(&p, e, k);
    });
    __syncthreads();
}

/* again: from what the multipliers are. */
static __device__ __forceinline__ void solve_rows(const articulation_view &p, bool again)
{
    const int32_t rows = p.s.columns * SADMM_MAX_ROWS;
#pragma unroll 1
    for (int turn = 0; turn < 2; ++turn) { /* to what the other rows say; then as all of them say */
        each(rows, [&](int32_t r) { articulation_put_change(&p, r, again, turn > 0); });
        __syncthreads();
        if (turn > 0 || !again) move_bodies(p);
        if (turn > 0) return;
        each(rows, [&](int32_t r) { p.right[r] = articulation_right(&p, r, again); });
        __syncthreads();
#pragma unroll 1
        for (int32_t level = 0; level < p.s.levels; ++level) forward_level(p, level);
        each(rows, [&](int32_t r) { articulation_turn(&p, r); });
        __syncthreads();
#pragma unroll 1
        for (int32_t level = p.s.levels - 1; level >= 0; --level) backward_level(p, level);
    }
}

/* Is `f(row)` true of any row? */
template <class F>
static __device__ __forceinline__ bool any_row(const articulation_view &p, int32_t *shared_flag, const F &f)
{
    if (threadIdx.x == 0) *shared_flag = 0;
    __syncthreads();
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) {
        if (f(r)) *shared_flag = 1;
    });
    __syncthreads();
    const bool any = *shared_flag != 0;
    __syncthreads();
    return any;
}

/* The largest residual of a row inside its bounds. */
static __device__ __forceinline__ double largest_residual(const articulation_view &p, unsigned long long *shared_most)
{
    double own = 0;
    if (threadIdx.x == 0) *shared_most = 0;
    __syncthreads();
    each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) { own = max_of(own, articulation_residual_size(&p, r)); });
    /* numbers that are not negative are in the order of their bits */
    if (own > 0) atomicMax(shared_most, (unsigned long long)__double_as_longlong(own));
    __syncthreads();
    const double most = __longlong_as_double((long long)*shared_most);
    __syncthreads();
    return most;
}

/* Until no row changes its state. Are all numbers finite then? EXACT: rows are refined as far as they can be
 * (core/solve/articulation_part.h), not only where their regularisation leaves much. */
template <bool EXACT>
static __device__ __forceinline__ bool solve_part(const articulation_view &p, const uint8_t *earlier,
                                                  int32_t *shared_flag, unsigned long long *shared_most)
{
    enum { TIMES = EXACT ? 1 + (int)ARTICULATION_REFINEMENTS : 2 };
    bool changed = true;
    begin_part(p, earlier);
#pragma unroll 1
    for (int pass = 0; pass < ARTICULATION_PASSES && changed; ++pass) {
        enter_blocks(p);
#pragma unroll 1
        for (int32_t level = 0; level < p.s.levels; ++level) factor_level(p, level);
        double last = INFINITY;
        int again = 0;
        bool dropped = false;
#pragma unroll 1
        for (;;) {
            solve_rows(p, again > 0 && !dropped);
            if (again == 0) {
                changed = any_row(p, shared_flag, [&](int32_t r) { return articulation_change_row(&p, r); });
                if (changed) break;
            }
            if (dropped) break;
            if (!EXACT && again == 0 &&
                !any_row(p, shared_flag, [&](int32_t r) { return articulation_needs_refinement(&p, r); }))
                break;
            const double residual = largest_residual(p, shared_most);
            if (again + 1 < TIMES && residual < last / 2 && (!EXACT || residual > ARTICULATION_EXACT)) {
                last = residual;
                ++again;
                continue;
            }
            if (again == 0 || !articulation_is_inconsistent(residual, last)) break;
            each(p.s.columns * SADMM_MAX_ROWS, [&](int32_t r) { articulation_drop_residual(&p, r); });
            __syncthreads();
            dropped = true;
        }
        if (again > 0) changed = any_row(p, shared_flag, [&](int32_t r) { return articulation_change_row(&p, r); });
    }
    return !changed && !any_row(p, shared_flag, [&](int32_t r) { /* a column has no more bodies than rows */
        const int32_t k = r % SADMM_MAX_ROWS, a = p.s.side[2 * (r / SADMM_MAX_ROWS)],
                      b = p.s.side[2 * (r / SADMM_MAX_ROWS) + 1];
        double sum = p.change[r] * 0;
        if (a >= 0) sum += p.dv[6 * a + k] * 0;
        if (b >= 0) sum += p.dv[6 * b + k] * 0;
        return !(sum == 0);
    });
}

#endif
