/* Step 1 (kernels I-K), eq. (6) in the reduced form: v <- v + (A + beta C)^-1 (b - A v + sum of wrenches).
 *
 * The method `fast` keeps r = b - A v + J^T lambda of each body, and its wrenches are J^T d lambda, d lambda = lambda^
 * - lambda:
 *     d v = (A + C)^-1 (r + 2 sum of wrenches),   v += rho d v,   r += rho (sum of wrenches) - A (what v has gone by)
 * Everything on the right goes to 0, and so does its rounding. */
#include "cpu.h"

/* ---- rigid bodies under three-row contacts: LANES at a time ---------------------------------------------------- */

/* Sum of a body's wrench rows, in list order; rows beyond the last body are 0. */
static inline row8 wrench_sum(const struct sadmm_context *c, size_t i)
{
    const row8 *wrenches = (const row8 *)c->wrenches;
    row8 sum = {0};
    if (i < (size_t)c->bodies)
        for (int32_t at = c->offsets[i]; at < c->offsets[i + 1]; ++at) sum += wrenches[c->incident[at]];
    return sum;
}

/* The wrench rows of a block to come. */
static inline void prefetch_wrenches(const struct sadmm_context *c, size_t index)
{
    size_t begin = index * (size_t)LANES, end = begin + (size_t)LANES;
    if (end > (size_t)c->bodies) return;
    for (int32_t at = c->offsets[begin]; at < c->offsets[end]; ++at)
        __builtin_prefetch(c->wrenches + (size_t)c->incident[at] * ROW);
}

/* States and sums of a block, by number. */
static inline __attribute__((always_inline)) void load_block(const row8 *rows, const row8 *sums, lanes state[ROW],
                                                             lanes g[ROW])
{
#define STATE_ROW(l) rows[l]
#define SUM_ROW(l) sums[l]
    LOAD_ROWS(state, STATE_ROW);
    LOAD_ROWS(g, SUM_ROW);
#undef STATE_ROW
#undef SUM_ROW
}

/* Sums of a block some of whose lanes are general bodies', which are updated by themselves: 0 there. Not inlined: what
 * follows the sums must be one piece of code for all blocks, or compilers may fuse products differently in two. */
static __attribute__((noinline)) void mixed_block_sums(const struct sadmm_context *c, size_t index, row8 sums[LANES])
{
    const uint32_t general = c->general_lanes[index];
    for (int l = 0; l < LANES; ++l)
        sums[l] = general >> l & 1 ? (row8){0} : wrench_sum(c, index * (size_t)LANES + (size_t)l);
}

/* Sums of a block's bodies. */
static inline __attribute__((always_inline)) void block_sums(const struct sadmm_context *c, size_t index,
                                                             row8 sums[LANES])
{
    if (c->general_lanes[index]) mixed_block_sums(c, index, sums);
    else
        for (int l = 0; l < LANES; ++l) sums[l] = wrench_sum(c, index * (size_t)LANES + (size_t)l);
}

/* b - A v + sum of wrenches of a block; `state` gets the block's state by number. */
static inline __attribute__((always_inline)) void block_momentum_residual(const struct sadmm_context *c, size_t index,
                                                               lanes state[ROW], vec *linear, vec *angular)
{
    const struct body_block *block = &c->body_blocks[index];
    const row8 *rows = (const row8 *)c->state + index * (size_t)LANES;
    row8 sums[LANES];
    lanes g[ROW];
    prefetch_wrenches(c, index + 1);
    block_sums(c, index, sums);
    load_block(rows, sums, state, g);
    vec v = {state[0], state[1], state[2]}, w = {state[3], state[4], state[5]};
    *linear = add(sub(block->b_linear, scale(v, block->mass)), (vec){g[0], g[1], g[2]});
    *angular = add(sub(block->b_angular, sym3_times(block->inertia, w)), (vec){g[3], g[4], g[5]});
}

static size_t first_body(const struct sadmm_context *c, size_t block)
{
    size_t body = block * (size_t)LANES;
    return body < (size_t)c->bodies ? body : (size_t)c->bodies;
}

static void update_rigid(struct sadmm_context *c, size_t begin, size_t end, bool step1_done)
{
    for (size_t index = begin; index < end; ++index) {
        if (c->general_lanes[index] == ALL_LANES) continue;
        if (step1_done && c->offsets[first_body(c, index)] == c->offsets[first_body(c, index + 1)]) continue;
        const struct body_block *block = &c->body_blocks[index];
        lanes state[ROW];
        vec linear, angular;
        block_momentum_residual(c, index, state, &linear, &angular);
        vec dw = sym3_times(block->K_inverse, sub(angular, cross(block->sigma, linear)));
        vec dv = add(scale(linear, block->inv_alpha), cross(block->sigma, dw));
        state[0] += dv.x, state[1] += dv.y, state[2] += dv.z;
        state[3] += dw.x, state[4] += dw.y, state[5] += dw.z;
        store_rows(c->state + index * (size_t)LANES * ROW, state);
    }
}

/* v + step, rounded; what v has gone by in truth. */
static inline vec move_by(lanes v[3], vec step)
{
    vec before = {v[0], v[1], v[2]};
    v[0] += step.x, v[1] += step.y, v[2] += step.z;
    return (vec){v[0] - before.x, v[1] - before.y, v[2] - before.z};
}

/* How far what belongs to the bodies of a block goes. */
struct body_factors {
    lanes velocity, multipliers;
};

/* Of a block where islands that start cold go once. */
static struct body_factors factors_if_warm(const struct sadmm_context *c, size_t index, struct body_factors all)
{
    for (int l = 0; l < LANES; ++l) {
        const size_t i = index * (size_t)LANES + (size_t)l;
        if (i < (size_t)c->bodies && c->islands[c->label[i]].warm) continue;
        all.velocity[l] = all.multipliers[l] = 1;
    }
    return all;
}

static inline __attribute__((always_inline)) void update_rigid_fast(struct sadmm_context *c, size_t begin, size_t end,
                                                                    bool step1_done, struct body_factors all, bool warm)
{
    for (size_t index = begin; index < end; ++index) {
        if (c->general_lanes[index] == ALL_LANES) continue;
        if (step1_done && c->offsets[first_body(c, index)] == c->offsets[first_body(c, index + 1)]) continue;
        struct body_block *block = &c->body_blocks[index];
        const struct body_factors factors = warm ? factors_if_warm(c, index, all) : all;
        const lanes velocity = factors.velocity, multipliers = factors.multipliers;
        const row8 *rows = (const row8 *)c->state + index * (size_t)LANES;
        lanes state[ROW], g[ROW];
        row8 sums[LANES];
        prefetch_wrenches(c, index + 1);
        block_sums(c, index, sums);
        load_block(rows, sums, state, g);
        vec force = {g[0], g[1], g[2]}, torque = {g[3], g[4], g[5]};
        vec linear = add(block->residual_linear, add(force, force));
        vec angular = add(block->residual_angular, add(torque, torque));
        vec dw = sym3_times(block->K_inverse, sub(angular, cross(block->sigma, linear)));
        vec dv = add(scale(linear, block->inv_alpha), cross(block->sigma, dw));
        dv = move_by(state, scale(dv, velocity));
        dw = move_by(state + 3, scale(dw, velocity));
        store_rows(c->state + index * (size_t)LANES * ROW, state);
        block->residual_linear = add(block->residual_linear, sub(scale(force, multipliers), scale(dv, block->mass)));
        block->residual_angular =
            add(block->residual_angular, sub(scale(torque, multipliers), sym3_times(block->inertia, dw)));
    }
}

static double rigid_residual(const struct sadmm_context *c, size_t begin, size_t end)
{
    lanes largest = {0};
    for (size_t index = begin; index < end; ++index) {
        lanes state[ROW];
        vec r[2];
        block_momentum_residual(c, index, state, &r[0], &r[1]);
        for (int part = 0; part < 2; ++part)
            largest = larger(largest, larger(magnitude(r[part].x), larger(magnitude(r[part].y), magnitude(r[part].z))));
    }
    return (double)horizontal_max(largest);
}

/* ---- general bodies: full 6x6 ---------------------------------------------------------------------------------- */

static inline row8 general_momentum_residual(const struct sadmm_context *c, size_t k, size_t i)
{
    const row8 *A = (const row8 *)c->A_columns + 6 * k;
    row8 v = ((const row8 *)c->state)[i], g = ((const row8 *)c->b)[k] + wrench_sum(c, i);
    for (int j = 0; j < 6; ++j) g -= A[j] * v[j];
    return g;
}

static void update_general(struct sadmm_context *c, size_t begin, size_t end, bool step1_done)
{
    for (size_t k = begin; k < end; ++k) {
        const size_t i = (size_t)c->general_bodies[k];
        if (step1_done && c->offsets[i] == c->offsets[i + 1]) continue;
        const row8 *H = (const row8 *)c->H_columns + 6 * k;
        row8 g = general_momentum_residual(c, k, i), step = {0};
        for (int j = 0; j < 6; ++j) step += H[j] * g[j];
        ((row8 *)c->state)[i] += step; /* number 6 of step is 0: 1/beta stays */
    }
}

static void update_general_fast(struct sadmm_context *c, size_t begin, size_t end, bool step1_done, real all_velocity,
                                real all_multipliers, bool warm)
{
    for (size_t k = begin; k < end; ++k) {
        const size_t i = (size_t)c->general_bodies[k];
        const bool once = warm && !c->islands[c->label[i]].warm;
        const real velocity = once ? 1 : all_velocity, multipliers = once ? 1 : all_multipliers;
        if (step1_done && c->offsets[i] == c->offsets[i + 1]) continue;
        const row8 *A = (const row8 *)c->A_columns + 6 * k, *H = (const row8 *)c->H_columns + 6 * k;
        row8 *momentum_residual = (row8 *)c->momentum_residuals + k;
        row8 sum = wrench_sum(c, i), g = *momentum_residual + 2 * sum, step = {0};
        for (int j = 0; j < 6; ++j) step += H[j] * g[j];
        row8 *state = (row8 *)c->state + i, before = *state;
        *state += velocity * step;
        step = *state - before;
        *momentum_residual += multipliers * sum;
        for (int j = 0; j < 6; ++j) *momentum_residual -= A[j] * step[j];
    }
}

static double general_residual(const struct sadmm_context *c, size_t begin, size_t end)
{
    double largest = 0;
    for (size_t k = begin; k < end; ++k) {
        row8 g = general_momentum_residual(c, k, (size_t)c->general_bodies[k]);
        for (int j = 0; j < 6; ++j) largest = fmax(largest, fabs((double)g[j]));
    }
    return largest;
}

/* ---- a thread's share of both ------------------------------------------------------------------------------------ */

/* Whole blocks and the general bodies in them: a block's rows are stored together. */
struct body_share {
    size_t begin, end, general_begin, general_end;
};

/* The first general body from `body` on, by its index among them. */
static size_t first_general(const struct sadmm_context *c, size_t body)
{
    size_t low = 0, high = c->general_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if ((size_t)c->general_bodies[middle] < body) low = middle + 1;
        else high = middle;
    }
    return low;
}

static struct body_share share_of(const struct sadmm_context *c, int thread, int threads)
{
    struct body_share s = {0};
    sadmm_share(c->body_block_count, thread, threads, &s.begin, &s.end);
    s.general_begin = first_general(c, s.begin * (size_t)LANES);
    s.general_end = first_general(c, s.end * (size_t)LANES);
    if (c->general_count == (size_t)c->bodies) s.begin = s.end; /* there are no other lanes */
    return s;
}

void CPU(sweep_bodies)(struct sadmm_context *c, int thread, int threads, bool step1_done)
{
    const struct body_share s = share_of(c, thread, threads);
    update_rigid(c, s.begin, s.end, step1_done);
    update_general(c, s.general_begin, s.general_end, step1_done);
}

void CPU(sweep_bodies_fast)(struct sadmm_context *c, int thread, int threads, bool step1_done, double velocity,
                            double multipliers, bool warm)
{
    const struct body_share s = share_of(c, thread, threads);
    const struct body_factors all = {fill((real)velocity), fill((real)multipliers)};
    if (warm) update_rigid_fast(c, s.begin, s.end, step1_done, all, true);
    else update_rigid_fast(c, s.begin, s.end, step1_done, all, false);
    update_general_fast(c, s.general_begin, s.general_end, step1_done, (real)velocity, (real)multipliers, warm);
}

double CPU(dual_residual)(const struct sadmm_context *c, int thread, int threads)
{
    const struct body_share s = share_of(c, thread, threads);
    return fmax(rigid_residual(c, s.begin, s.end), general_residual(c, s.general_begin, s.general_end));
}
