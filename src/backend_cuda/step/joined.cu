/* Bodies joined by rows on the device, solved directly (core/solve/joined.h): the host's formulas
 * (core/model/joined.h), in double, in its order. A thread block a part: constraints that hang together. Once before
 * the iterations, from what they start with, and once after them, from what they end with. */
#include <string.h>

#include <algorithm>

#include "backend_cuda/device/double.h"

#include "core/base/memory.h"
#include "core/model/joined.h"
#include "core/model/joint_law.h"
#include "core/solve/joined.h"
#include "core/solve/joined_order.h"
#include "move.h"
#include "world.h"

enum { JOINED_THREADS = 256, JOINED_WARPS = JOINED_THREADS / WARP };
enum { MOST_NUMBERS = 8192 }; /* of a structure that blocks copy */

/* What a part's threads tell each other. */
struct joined_shared {
    double speed;
    int32_t flag;
};

/* A part's factor and right side, in bytes; they are in shared memory where that is enough for every part. */
static inline size_t shared_bytes(int32_t factors, int32_t numbers)
{
    return sizeof(struct joined_shared) + (size_t)factors + ((size_t)numbers * sizeof(int32_t) + 7) / 8 * 8;
}
static __host__ __device__ inline size_t factor_bytes(int32_t places, int32_t blocks)
{
    return ((JOINED_BLOCK + JOINED_ROWS) * (size_t)places + JOINED_BLOCK * (size_t)blocks) * sizeof(double);
}

/* A part, by the block that solves it. */
struct joined_part {
    struct joined_view d;
    int32_t thread, warp, lane;
    int32_t first_level, end_level, first_place, end_place, first_body, end_body;
};

/* The structure in shared memory, whose lists are gone along again and again. */
static __device__ __forceinline__ struct joined_structure copy_structure(const struct joined_structure &from,
                                                                         int32_t *to, int32_t size)
{
    const int32_t *begin = from.constraint; /* the first array of it (core/solve/joined_order.c) */
    for (int32_t k = (int32_t)threadIdx.x; k < size; k += JOINED_THREADS) to[k] = begin[k];
    struct joined_structure s = from;
    s.constraint = to + (from.constraint - begin), s.first_level = to + (from.first_level - begin);
    s.first_of_level = to + (from.first_of_level - begin), s.first_below = to + (from.first_below - begin);
    s.row = to + (from.row - begin), s.column = to + (from.column - begin);
    s.first_update = to + (from.first_update - begin), s.update = to + (from.update - begin);
    s.first_body = to + (from.first_body - begin), s.body = to + (from.body - begin);
    s.first_around = to + (from.first_around - begin), s.around = to + (from.around - begin);
    __syncthreads();
    return s;
}

/* memory: shared, of so many bytes; before them the structure, of so many numbers (0: it is not there). */
static __device__ __forceinline__ joined_part part_of_block(const cuda_view &v, unsigned char *memory, int32_t bytes,
                                                            int32_t numbers)
{
    joined_part p;
    p.d = *v.joints.direct;
    if (numbers > 0) {
        p.d.s = copy_structure(p.d.s, (int32_t *)memory, numbers);
        memory += ((size_t)numbers * sizeof(int32_t) + 7) / 8 * 8;
    }
    const int32_t part = (int32_t)blockIdx.x;
    p.thread = (int32_t)threadIdx.x, p.warp = p.thread / WARP, p.lane = p.thread % WARP;
    p.first_level = p.d.s.first_level[part], p.end_level = p.d.s.first_level[part + 1];
    p.first_place = p.d.s.first_of_level[p.first_level], p.end_place = p.d.s.first_of_level[p.end_level];
    p.first_body = p.d.s.first_body[part], p.end_body = p.d.s.first_body[part + 1];
    const int32_t places = p.end_place - p.first_place, first_block = p.d.s.first_below[p.first_place],
                  blocks = p.d.s.first_below[p.end_place] - first_block;
    if (factor_bytes(places, blocks) > (size_t)bytes) return p;
    double *at = (double *)memory; /* numbers of places and blocks stay what they are */
    p.d.diagonal = at - JOINED_BLOCK * (size_t)p.first_place;
    p.d.right = at + JOINED_BLOCK * (size_t)places - JOINED_ROWS * (size_t)p.first_place;
    p.d.below = at + (JOINED_BLOCK + JOINED_ROWS) * (size_t)places - JOINED_BLOCK * (size_t)first_block;
    return p;
}

/* Calls f(constraint, row, k) for row k of each place, by a thread each. */
template <class F> static __device__ __forceinline__ void each_row(const joined_part &p, const F &f)
{
    for (int32_t at = p.first_place * JOINED_ROWS + p.thread; at < p.end_place * JOINED_ROWS; at += JOINED_THREADS) {
        const struct sadmm_row_constraint *constraint = joined_at(&p.d, at / JOINED_ROWS);
        const int32_t k = at % JOINED_ROWS;
        if (k < constraint->count) f(constraint, constraint->first + k, at / JOINED_ROWS, k);
    }
}

/* Calls f(entry) for each body, by a thread each. */
template <class F> static __device__ __forceinline__ void each_body(const joined_part &p, const F &f)
{
    for (int32_t e = p.first_body + p.thread; e < p.end_body; e += JOINED_THREADS) f(e);
}

/* Calls f(pair or constraint, side) for what a body is joined and touched by: pairs first, both ascending. */
template <class P, class R>
static __device__ __forceinline__ void each_side(const cuda_view &v, int32_t body, const P &of_pair, const R &of_rows)
{
    const int32_t slot = v.graph.slot_of[body];
    for (int32_t at = v.graph.offsets[slot]; at < v.graph.offsets[slot + 1]; ++at) {
        const int32_t code = v.graph.incident[at], record = code / 2, side = code & 1;
        if (record < v.contacts.pair_capacity) of_pair(&v.raw.pairs[record], side);
        else of_rows(record - v.contacts.pair_capacity, side);
    }
}

/* ---- what there is ----------------------------------------------------------------------------------------------- */

/* Velocities and multipliers: after the iterations, or before. */
static __device__ __forceinline__ void load_part(const cuda_view &v, const joined_part &p, bool after)
{
    each_body(p, [&](int32_t e) {
        const int32_t body = p.d.s.body[e];
        double *velocity = p.d.velocity + 6 * (size_t)body;
        if (after) load_end_velocity(v, body, velocity);
        else
            for (int k = 0; k < 6; ++k) velocity[k] = v.step.start_velocity[6 * (size_t)body + (size_t)k];
        each_side(v, body, [](const struct sadmm_contact_pair *, int) {},
                  [&](int32_t constraint, int) {
                      for (int32_t r = constraint * SADMM_MAX_ROWS, k = 0; k < v.raw.constraints[constraint].count;
                           ++k, ++r)
                          p.d.lambda[r] = after ? (double)v.rows.data[r].lambda : v.raw.rows[r].lambda;
                  });
    });
}

/* A, and b - A v + J^T lambda, or 0 where that is left to contacts; energies of the impulses into `dv`, which is not in
 * use yet. */
static __device__ __forceinline__ void find_missing(const cuda_view &v, const joined_part &p, bool left)
{
    const struct sadmm_settings settings = *v.model.settings;
    each_body(p, [&](int32_t e) {
        const int32_t body = p.d.s.body[e];
        double *A = p.d.A + 36 * (size_t)body, b[6], impulse[6] = {};
        each_side(v, body,
                  [&](const struct sadmm_contact_pair *pair, int side) {
                      joined_add_pair(&v.raw.points[pair->first], pair->count, side, impulse);
                  },
                  [&](int32_t constraint, int side) {
                      joined_add_rows(&p.d, &v.raw.constraints[constraint], side, impulse);
                  });
        sadmm_system_body(&v.raw.system, &settings, body, A, b);
        joined_miss(&p.d, e, b, impulse);
        for (int k = 0; left && k < 6; ++k) p.d.missing[6 * (size_t)body + (size_t)k] = 0;
        p.d.dv[6 * (size_t)body] = joined_energy(A, impulse);
    });
}

static __device__ __forceinline__ void find_speed(const joined_part &p, struct joined_shared *shared)
{
    double energy = 0, mass = 0;
    if (p.thread > 0) return;
    for (int32_t e = p.first_body; e < p.end_body; ++e) {
        const size_t body = (size_t)p.d.s.body[e];
        energy += p.d.dv[6 * body];
        mass += p.d.A[36 * body];
    }
    shared->speed = joined_speed(energy, mass);
}

static __device__ __forceinline__ void factor_bodies(const cuda_view &v, const joined_part &p, double speed)
{
    each_body(p, [&](int32_t e) {
        const int32_t body = p.d.s.body[e];
        double *factor = p.d.factor + 36 * (size_t)body;
        for (int k = 0; k < 36; ++k) factor[k] = p.d.A[36 * (size_t)body + (size_t)k];
        each_side(v, body,
                  [&](const struct sadmm_contact_pair *pair, int side) {
                      joined_add_contact(&v.raw.points[pair->first], pair->count, side, speed, factor);
                  },
                  [](int32_t, int) {});
        joined_factor_body(&p.d, e);
    });
}

/* ---- a pass ------------------------------------------------------------------------------------------------------ */

/* All nodes before anything is taken from them: what waits for memory, side by side. */
static __device__ __forceinline__ void enter_blocks(const joined_part &p)
{
    const int32_t first = p.first_place, end = p.end_place;
    for (int32_t at = first * JOINED_BLOCK + p.thread; at < end * JOINED_BLOCK; at += JOINED_THREADS) {
        const int32_t place = at / JOINED_BLOCK, k = at % JOINED_BLOCK / JOINED_ROWS, q = at % JOINED_ROWS;
        if (q <= k) p.d.diagonal[at] = joined_entry(&p.d, place, place, k, q);
    }
    const int32_t first_block = p.d.s.first_below[first], end_block = p.d.s.first_below[end];
    for (int32_t at = first_block * JOINED_BLOCK + p.thread; at < end_block * JOINED_BLOCK; at += JOINED_THREADS) {
        const int32_t b = at / JOINED_BLOCK;
        p.d.below[at] = joined_entry(&p.d, p.d.s.row[b], p.d.s.column[b], at % JOINED_BLOCK / JOINED_ROWS,
                                     at % JOINED_ROWS);
    }
    __syncthreads();
}

static __device__ __forceinline__ void factor_level(const joined_part &p, int32_t level)
{
    const int32_t first = p.d.s.first_of_level[level], end = p.d.s.first_of_level[level + 1];
    for (int32_t place = first + p.warp; place < end; place += JOINED_WARPS) {
        double *block = p.d.diagonal + JOINED_BLOCK * (size_t)place;
        for (int at = p.lane; at < JOINED_BLOCK; at += WARP) {
            const int k = at / JOINED_ROWS, q = at % JOINED_ROWS;
            if (q <= k) block[at] = joined_updated(&p.d, place, block[at], k, q);
        }
        __syncwarp((unsigned)ALL_LANES);
        if (p.lane == 0) joined_cholesky(block);
    }
    __syncthreads();
    for (int32_t b = p.d.s.first_below[first] + p.warp; b < p.d.s.first_below[end]; b += JOINED_WARPS) {
        double *block = p.d.below + JOINED_BLOCK * (size_t)b;
        const int32_t column = p.d.s.column[b];
        for (int at = p.lane; at < JOINED_BLOCK; at += WARP)
            block[at] = joined_updated(&p.d, p.d.s.count + b, block[at], at / JOINED_ROWS, at % JOINED_ROWS);
        __syncwarp((unsigned)ALL_LANES);
        if (p.lane < JOINED_ROWS) /* L_ij = S_ij L_jj^-T */
            joined_forward(p.d.diagonal + JOINED_BLOCK * (size_t)column, block + JOINED_ROWS * p.lane);
    }
    __syncthreads();
}

/* One triangular solve of a level; a warp a place. */
template <bool FORWARD> static __device__ __forceinline__ void solve_level(const joined_part &p, int32_t level)
{
    for (int32_t place = p.d.s.first_of_level[level] + p.warp; place < p.d.s.first_of_level[level + 1];
         place += JOINED_WARPS) {
        double *own = p.d.right + JOINED_ROWS * (size_t)place;
        const double *block = p.d.diagonal + JOINED_BLOCK * (size_t)place;
        if (p.lane < JOINED_ROWS)
            own[p.lane] = FORWARD ? joined_forward_row(&p.d, place, p.lane) : joined_backward_row(&p.d, place, p.lane);
        __syncwarp((unsigned)ALL_LANES);
        if (p.lane == 0) {
            if (FORWARD) joined_forward(block, own);
            else joined_backward(block, own);
        }
    }
    __syncthreads();
}

static __device__ __forceinline__ void move_bodies(const joined_part &p)
{
    each_body(p, [&](int32_t e) { joined_move(&p.d, e); });
    __syncthreads();
}

static __device__ __forceinline__ void solve_rows(const joined_part &p)
{
    each_row(p, [&](const struct sadmm_row_constraint *, int32_t r, int32_t, int) {
        if (p.d.state[r] == JOINED_INSIDE) p.d.change[r] = 0;
    });
    __syncthreads();
    move_bodies(p);
    for (int32_t at = p.first_place * JOINED_ROWS + p.thread; at < p.end_place * JOINED_ROWS; at += JOINED_THREADS)
        p.d.right[at] = joined_right(&p.d, at / JOINED_ROWS, at % JOINED_ROWS);
    __syncthreads();
    for (int32_t level = p.first_level; level < p.end_level; ++level) solve_level<true>(p, level);
    for (int32_t level = p.end_level - 1; level >= p.first_level; --level) solve_level<false>(p, level);
    each_row(p, [&](const struct sadmm_row_constraint *, int32_t r, int32_t place, int k) {
        if (p.d.state[r] == JOINED_INSIDE) p.d.change[r] = p.d.right[JOINED_ROWS * (size_t)place + (size_t)k];
    });
    __syncthreads();
    move_bodies(p);
}

/* Does any row change its state? */
static __device__ __forceinline__ bool change_rows(const joined_part &p, struct joined_shared *shared)
{
    if (p.thread == 0) shared->flag = 0;
    __syncthreads();
    each_row(p, [&](const struct sadmm_row_constraint *constraint, int32_t r, int32_t, int) {
        if (joined_change_row(&p.d, constraint, r)) shared->flag = 1;
    });
    __syncthreads();
    const bool changed = shared->flag != 0;
    __syncthreads();
    return changed;
}

/* ---- what comes of it -------------------------------------------------------------------------------------------- */

static __device__ __forceinline__ bool is_finite(const joined_part &p, struct joined_shared *shared)
{
    double sum = 0;
    if (p.thread == 0) shared->flag = 0;
    __syncthreads();
    each_body(p, [&](int32_t e) {
        for (size_t k = 0; k < 6; ++k) sum += p.d.dv[6 * (size_t)p.d.s.body[e] + k] * 0;
    });
    each_row(p, [&](const struct sadmm_row_constraint *, int32_t r, int32_t, int) { sum += p.d.change[r] * 0; });
    if (!(sum == 0)) shared->flag = 1;
    __syncthreads();
    return shared->flag == 0;
}

/* Until the solve after the iterations: NaN where the one before them has not solved the part. */
static __device__ __forceinline__ double *kept_mark(const joined_part &p)
{
    return p.d.dv + 6 * (size_t)p.d.s.body[p.first_body];
}

/* Before the iterations: what these start from. After them: what the end of the step reads. */
static __device__ __forceinline__ void store_part(const cuda_view &v, const joined_part &p, bool after, bool solved)
{
    each_body(p, [&](int32_t e) {
        const size_t body = (size_t)p.d.s.body[e];
        double *velocity = p.d.velocity + 6 * body;
        for (size_t k = 0; k < 6; ++k) {
            if (solved) velocity[k] += p.d.dv[6 * body + k];
            if (!after) v.bodies.state[body * ROW + k] = (solver_real)velocity[k];
        }
    });
    each_row(p, [&](const struct sadmm_row_constraint *, int32_t r, int32_t, int) {
        const double lambda = solved ? joined_bounded(&p.d, r) : p.d.lambda[r];
        v.joints.solution[r] = lambda;
        if (!after) v.rows.data[r].lambda = (solver_real)lambda;
    });
    __syncthreads();
    if (!after && p.thread == 0) *kept_mark(p) = solved ? 0 : NAN;
}

/* Does a contact touch one of its bodies? */
static __device__ __forceinline__ bool is_touched(const cuda_view &v, const joined_part &p,
                                                  struct joined_shared *shared)
{
    if (p.thread == 0) shared->flag = 0;
    __syncthreads();
    each_body(p, [&](int32_t e) {
        const int32_t slot = v.graph.slot_of[p.d.s.body[e]], first = v.graph.offsets[slot];
        if (first < v.graph.offsets[slot + 1] && v.graph.incident[first] / 2 < v.contacts.pair_capacity)
            shared->flag = 1; /* pairs come first */
    });
    __syncthreads();
    return shared->flag != 0;
}

/* args.count: after the iterations; args.start: it ran before them, too. */
static __global__ void __launch_bounds__(JOINED_THREADS)
    joined_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(memory);
    struct joined_shared *shared = (struct joined_shared *)memory;
    const bool after = args.count != 0;
    if (v.model.live->abort_code) return;
    const joined_part p = part_of_block(v, (unsigned char *)(shared + 1), args.bytes, args.numbers);
    const bool touched = is_touched(v, p, shared), kept = after && args.start && !isnan(*kept_mark(p));
    __syncthreads();
    /* what no contact touches is as it was solved before the iterations */
    if (kept && !touched) return;
    load_part(v, p, after);
    __syncthreads();
    find_missing(v, p, touched && v.model.settings->method == SADMM_METHOD_PAPER); /* core/solve/joined.c says why */
    __syncthreads();
    find_speed(p, shared);
    __syncthreads();
    factor_bodies(v, p, shared->speed);
    __syncthreads();
    each_row(p, [&](const struct sadmm_row_constraint *constraint, int32_t r, int32_t, int) {
        joined_respond(&p.d, constraint, r);
        joined_begin_row(&p.d, constraint, r);
    });
    __syncthreads();
    bool solved = false;
    for (int pass = 0; pass < JOINED_PASSES && !solved; ++pass) {
        enter_blocks(p);
        for (int32_t level = p.first_level; level < p.end_level; ++level) factor_level(p, level);
        solve_rows(p);
        solved = !change_rows(p, shared);
    }
    const bool finite = is_finite(p, shared);
    store_part(v, p, after, solved && finite);
}

sadmm_status CUDA(launch_joined)(struct sadmm_context *c, bool after, struct sadmm_error *error)
{
    cuda_args args = {};
    struct cuda_partition blocks = {};
    if (c->view.joints.count == 0 || c->step->joined_parts == 0) return SADMM_OK;
    blocks.parts = c->step->joined_parts;
    blocks.cluster = 1;
    blocks.threads = JOINED_THREADS;
    args.bytes = c->step->joined_bytes;
    args.numbers = c->step->joined_numbers;
    blocks.shared = shared_bytes(args.bytes, args.numbers);
    args.count = after;
    args.start = c->settings.warm_start;
    return CUDA(launch_partition)(c, joined_kernel, "joined bodies", &blocks, false, &args, error);
}

/* ---- to the device ----------------------------------------------------------------------------------------------- */

/* Of a view: its work, then a state a row. */
static size_t work_bytes(const struct cuda_step *s, const struct joined_structure *o)
{
    const size_t rows = (size_t)s->joint_constraints * SADMM_MAX_ROWS;
    return joined_work_size(o, (size_t)s->bodies, rows) * sizeof(double) + rows;
}

/* The structure where it is on the device. */
static struct joined_structure moved(const struct sadmm_joined_order *order, const int32_t *to)
{
    struct joined_structure s = order->s;
    const int32_t **arrays[] = {&s.constraint, &s.first_level, &s.first_of_level, &s.first_below, &s.row,
                                &s.column, &s.first_update, &s.update, &s.first_body, &s.body,
                                &s.first_around, &s.around};
    for (const int32_t **array : arrays) *array = to + (*array - order->memory);
    return s;
}

/* The view of a step that ends in `into`. */
static struct joined_view view_of(const struct sadmm_context *c, int into, const struct joined_structure *s,
                                  double *work)
{
    const struct cuda_step *step = c->step;
    const size_t n = (size_t)step->bodies, rows = (size_t)step->joint_constraints * SADMM_MAX_ROWS;
    const struct joint_rows set = CUDA(joint_rows_of)(c, into);
    struct joined_view d = {};
    d.s = *s;
    d.constraints = set.constraints;
    d.jacobian[0] = set.rows->jacobian[0], d.jacobian[1] = set.rows->jacobian[1];
    d.gain = &set.rows->gain, d.bias = &set.rows->bias, d.compliance = &set.rows->compliance;
    d.lo = &set.rows->lo, d.hi = &set.rows->hi;
    static_assert(sizeof(struct raw_row) % sizeof(double) == 0, "rows are strided");
    d.jacobian_stride = d.law_stride = (int32_t)(sizeof(struct raw_row) / sizeof(double));
    d.velocity = set.velocity;
    joined_bind_work(&d, work, n, rows);
    d.state = (uint8_t *)(work + joined_work_size(s, n, rows));
    return d;
}

static bool make_order(const struct sadmm_resident_world *world, int32_t constraints, struct sadmm_joined_order *order)
{
    int32_t *bodies = (int32_t *)sadmm_alloc(2 * (size_t)constraints + 1, sizeof *bodies), at = 0;
    if (!bodies) return false;
    for (int32_t j = 0; j < world->joint_count; ++j)
        for (int32_t k = 0; k < world->joints[j].constraints; ++k)
            for (int s = 0; s < 2; ++s) bodies[at++] = world->joints[j].body[s];
    const bool made = sadmm_joined_order_make(order, bodies, constraints, world->body_count, SADMM_JOINED_AROUND);
    sadmm_free(bodies);
    return made;
}

/* Which bodies and constraints are solved directly, by their numbers. */
static bool list_direct(const struct cuda_step *s, const struct joined_structure *o, int32_t **out)
{
    int32_t *direct = (int32_t *)sadmm_alloc((size_t)s->bodies + (size_t)s->joint_constraints + 1, sizeof *direct);
    *out = direct;
    if (!direct) return false;
    for (int32_t e = 0; e < o->bodies; ++e) direct[o->body[e]] = 1;
    for (int32_t p = 0; p < o->count; ++p) direct[s->bodies + o->constraint[p]] = 1;
    return true;
}

static sadmm_status load_order(struct sadmm_context *c, const struct sadmm_joined_order *order,
                               struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const size_t numbers = (size_t)s->bodies + (size_t)s->joint_constraints + 1 + order->size;
    int32_t *direct = nullptr;
    struct joined_view views[2];
    TRY(CUDA(reserve)(c, BUFFER_JOINED, 2 * sizeof *views + work_bytes(s, &order->s), error));
    TRY(CUDA(reserve)(c, BUFFER_JOINED_ORDER, numbers * sizeof(int32_t), error));
    int32_t *to = buffer<int32_t>(c, BUFFER_JOINED_ORDER), *order_at = to + (numbers - order->size);
    const struct joined_structure structure = moved(order, order_at);
    double *work = (double *)(buffer<char>(c, BUFFER_JOINED) + sizeof views);
    for (int into = 0; into < 2; ++into) views[into] = view_of(c, into, &structure, work);
    TRY(CUDA(put)(c, buffer<char>(c, BUFFER_JOINED), views, sizeof views, error));
    TRY(CUDA(put)(c, order_at, order->memory, order->size * sizeof(int32_t), error));
    if (!list_direct(s, &order->s, &direct)) return sadmm_fail_memory(error, "the cuda backend's joined bodies");
    const sadmm_status status = CUDA(put)(c, to, direct, (numbers - order->size) * sizeof(int32_t), error);
    sadmm_free(direct);
    s->joined_parts = order->s.parts;
    s->joined_bytes = 0;
    /* of what many parts share a block needs little: then it is not worth its copy */
    s->joined_numbers = order->size <= MOST_NUMBERS ? (int32_t)order->size : 0;
    for (int32_t k = 0; k < order->s.parts; ++k) {
        const int32_t first = order->s.first_of_level[order->s.first_level[k]],
                      end = order->s.first_of_level[order->s.first_level[k + 1]];
        const size_t bytes = factor_bytes(end - first, order->s.first_below[end] - order->s.first_below[first]);
        if (shared_bytes((int32_t)bytes, s->joined_numbers) <= (size_t)c->shared_limit)
            s->joined_bytes = std::max(s->joined_bytes, (int32_t)bytes);
    }
    TRY(status);
    CUDA_CALL(c,
              cudaFuncSetAttribute((const void *)joined_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                   (int)shared_bytes(s->joined_bytes, s->joined_numbers)),
              "cudaFuncSetAttribute");
    return SADMM_OK;
}

sadmm_status CUDA(load_joined)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                               struct sadmm_error *error)
{
    struct sadmm_joined_order order = {};
    c->step->joined_parts = 0;
    if (world->joint_count == 0) return SADMM_OK;
    if (!make_order(world, c->step->joint_constraints, &order))
        return sadmm_fail_memory(error, "the cuda backend's joined bodies");
    const sadmm_status status = load_order(c, &order, error);
    sadmm_joined_order_free(&order);
    return status;
}

void CUDA(view_joined)(struct sadmm_context *c, int into)
{
    c->view.joints.direct = buffer<struct joined_view>(c, BUFFER_JOINED) + into;
    c->view.joints.is_direct = buffer<int32_t>(c, BUFFER_JOINED_ORDER);
}
