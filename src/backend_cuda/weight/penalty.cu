/* Kernels E-H and P: C_i (14), beta_i (13), (15), and H = (A_i + beta_i C_i)^-1. In double: they run a few times
 * a step, and H only preconditions (the fixed point of Step 1 does not depend on it). */
#include "backend_cuda/device/double.h"
#include "factor.h"
#include "weigh.h"
#include "weight.h"
#include "backend_cuda/device/plan_check.h"
#include "backend_cuda/device/wide.h"

#include "core/math/momentum.h"
#include "core/math/penalty.h"
#include "core/model/push_law.h"

/* ---- C ----------------------------------------------------------------------------------------------------------- */

static __device__ void add_pair(const model_view &model, const raw_view &raw, const struct sadmm_contact_pair *pair,
                                int side, arm_sums *sums, double C[PACKED])
{
    const int32_t count = pair->count;
    const struct sadmm_contact_point *points = wide_at(raw.points, (size_t)pair->first);
    for (int32_t first = 0; first < count; first += POINTS_AT_ONCE) {
        double arms[POINTS_AT_ONCE][3] = {};
#pragma unroll
        for (int32_t j = 0; j < POINTS_AT_ONCE; ++j) {
            const double *r = side ? points[first + j].arm_b : points[first + j].arm_a;
            for (int i = 0; i < 3 && first + j < count; ++i) arms[j][i] = r[i];
        }
#pragma unroll
        for (int32_t j = 0; j < POINTS_AT_ONCE; ++j) {
            if (first + j >= count) continue;
            if (model.contact_rows == 3) {
                add_arm(sums, arms[j], 1);
            } else {
                double row[6];
                sadmm_contact_row(v3_load(pair->normal), arms[j], 1, row);
                packed_add_row(C, row, 1);
            }
        }
    }
}

/* Does a pair anchor the island of its body on `side`? Few pairs are static; the others should not pay in registers. */
static __device__ __noinline__ bool static_pair_anchors(const raw_view &raw, const struct sadmm_contact_pair *pair,
                                                        int side)
{
    arm_sums arms = {};
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
        add_arm(&arms, side ? raw.points[k].arm_b : raw.points[k].arm_a, 1);
    return momentum_is_anchored(pair->friction, &arms);
}

/* C of a body with B = 1, in all lanes: each adds up every eighth side. From the raw contacts. Marks islands that are
 * anchored. Every lane of the warp comes here. */
static __device__ __forceinline__ void penalty_matrix(const cuda_view &v, const body_thread &t, double C[PACKED])
{
    arm_sums sums = {};
    bool anchors = t.begin == t.end, rolls = false; /* nothing touches it */
    for (int k = 0; k < PACKED; ++k) C[k] = 0;
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) {
        const int32_t record = v.graph.incident[at] / 2, side = v.graph.incident[at] & 1;
        if (record < v.contacts.pair_capacity) {
            const struct sadmm_contact_pair *pair = wide_at(v.raw.pairs, (size_t)record);
            add_pair(v.model, v.raw, pair, side, &sums, C);
            if (anchors || !v.islands.info) continue;
            if ((side ? pair->body_a : pair->body_b) < 0) anchors = static_pair_anchors(v.raw, pair, side);
            else rolls = rolls || sadmm_pair_rolls(pair, &v.raw.points[pair->first]);
        } else {
            add_rows(v.rows, record - v.contacts.pair_capacity, side, C);
            anchors = true; /* left alone */
            if (v.islands.info) v.islands.info[v.graph.label[t.body]].rows = 1;
            if (v.push.bits) v.push.bits[v.graph.label[t.body]] = PUSH_ROWS;
        }
    }
    if (t.live && (anchors || rolls) && v.islands.info) v.islands.info[v.graph.label[t.body]].anchored = 1;
    if (t.live && anchors && v.islands.info) v.islands.info[v.graph.label[t.body]].anchored_outside = 1;
    if (v.model.contact_rows == 1 || v.rows.count > 0) sum_lanes<PACKED>(C);
    sum_lanes<sizeof sums / sizeof(double)>(&sums.count);
    add_arm_sums(C, &sums);
}

/* (13) */
static __device__ __forceinline__ double penalty_of(const model_view &model, const body_view &bodies,
                                                    const solver_real *line, const double C[PACKED])
{
    const struct sadmm_settings *s = model.settings;
    double trace_A = 0, trace_C = C[0] + C[2] + C[5] + C[9] + C[14] + C[20];
#pragma unroll
    for (int k = 0; k < 6; ++k) trace_A += (double)line_a(line, bodies.rigid, k, k);
    return penalty_of_body(trace_A, trace_C, s->penalty_mass_factor, s->penalty_offset, s->dt);
}

/* Is a body's inertia less than what C is rounded by? */
static __device__ __forceinline__ bool inertia_drowns(const body_view &bodies, size_t body, double beta,
                                                      const double C[PACKED])
{
    const solver_real *line = bodies.lines + body * (size_t)bodies.line;
    double A[PACKED] = {};
#pragma unroll
    for (int r = 3; r < 6; ++r)
#pragma unroll
        for (int k = 3; k <= r; ++k) A[r * (r + 1) / 2 + k] = (double)line_a(line, bodies.rigid, r, k);
    return packed_inertia_drowns(A, beta, C, SOLVER_EPSILON);
}

/* ---- kernels ----------------------------------------------------------------------------------------------------- */

/* By which B C is made, and how H is: that of `paper`; the weights of `fast`; those, and every body's H in closed
 * form. */
enum penalty_form { PLAIN, WEIGHTED, CLOSED };

/* PENALTY: C and beta; FACTOR: H from them. The iterations are not let begin while it runs: clusters of blocks that are
 * placed then are slower (card_houses, `paper`: 3 %). */
template <bool PENALTY, bool FACTOR, int FORM>
static __global__ void __launch_bounds__(BODY_THREADS)
    penalty_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait();
    const body_thread t = body_of_thread(v.model, v.graph);
    const cuda_island none = {};
    double C[PACKED], beta = 1;
    bool live = t.live;
    if (PENALTY) {
        if (FORM == PLAIN) {
            penalty_matrix(v, t, C);
        } else {
            const cuda_island island = t.live ? v.islands.info[v.graph.label[t.body]] : none;
            weighted_matrix<FORM == CLOSED>(v, t, fetch_sides(v.model, v.graph, v.contacts, v.weights, t, t.begin),
                                            island, args.start, C);
            live = t.live && is_weighed(&island, args);
        }
        if (live) {
            if (FORM == PLAIN) beta = penalty_of(v.model, v.bodies, v.bodies.lines + t.body * (size_t)v.bodies.line, C);
            if (t.lane == 0) v.bodies.beta[t.body] = beta;
#pragma unroll
            for (int k = 0; k < PACKED; ++k)
                if (k % LANES == t.lane) v.bodies.C[t.body * PACKED + (size_t)k] = C[k];
        }
    } else if (t.live) {
        beta = v.bodies.beta[t.body];
        for (int k = 0; k < PACKED; ++k) C[k] = v.bodies.C[t.body * PACKED + (size_t)k];
    }
    if (FACTOR && live && FORM == PLAIN && inertia_drowns(v.bodies, t.body, beta, C))
        packed_round_up(C, SOLVER_EPSILON); /* `fast`: its C is */
    if (FACTOR && live && (FORM == CLOSED || (FORM == WEIGHTED && body_has_closed_form(v, t))))
        factor_rigid(v.bodies, t.body, t.lane, C);
    else if (FACTOR && live) factor_body(v.bodies, t.body, t.lane, beta, C);
    if (args.planned) check_plan(v.model, v.iteration, v.step);
}

static __global__ void scale_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait();
    pdl_trigger(v.model.bodies);
    int32_t i = thread_index();
    if (i >= live_bodies(v.model)) return;
    double ratio = args.factor;
    if (args.measure) /* by the residuals */
        ratio = penalty_ratio(__longlong_as_double((long long)v.iteration.residual[0]),
                              __longlong_as_double((long long)v.iteration.residual[1]),
                              v.model.settings->penalty_ratio_limit);
    v.bodies.beta[i] *= ratio;
    if (i == 0) *v.iteration.ratio = ratio;
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

static bool closed_form(const struct sadmm_context *c)
{
    return c->fast && has_closed_form(c->view.model, c->view.bodies, c->view.rows);
}

static sadmm_status launch_bodies(struct sadmm_context *c, cuda_kernel kernel, const char *name, const cuda_args *args,
                                  struct sadmm_error *error)
{
    const int64_t blocks = body_blocks(c->view.model.bodies);
    return CUDA(launch_pdl)(c, kernel, name, args->planned && blocks == 0 ? 1 : blocks, BODY_THREADS, args, error);
}

/* fast: B, C and, for `factor`, H. first: of the solve; planned: compare with the plan. */
static sadmm_status enqueue_weighted_penalties(struct sadmm_context *c, bool first, bool factor, bool planned,
                                               struct sadmm_error *error)
{
    cuda_args args = {};
    args.start = first;
    args.planned = planned;
    const cuda_kernel kernel =
        closed_form(c) ? (factor ? penalty_kernel<true, true, CLOSED> : penalty_kernel<true, false, CLOSED>)
                       : (factor ? penalty_kernel<true, true, WEIGHTED> : penalty_kernel<true, false, WEIGHTED>);
    return launch_bodies(c, kernel, "penalties", &args, error);
}

extern "C" sadmm_status CUDA(init_penalty)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    c->starting = true;
    c->checks = 0;
    c->cleared = 0;
    c->placed = false;
    c->measured = false;
    c->rescaled = false;
    if (c->fast) {
        CUDA(begin_weights)(c);
        TRY(CUDA(enqueue_row_responses)(c, error));
        TRY(CUDA(enqueue_islands)(c, error));
        return enqueue_weighted_penalties(c, true, false, false, error);
    }
    return launch_bodies(c, penalty_kernel<true, false, PLAIN>, "init_penalty", &args, error);
}

extern "C" sadmm_status CUDA(factorize)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    const cuda_kernel kernel = closed_form(c) ? penalty_kernel<false, true, CLOSED>
                               : c->fast      ? penalty_kernel<false, true, WEIGHTED>
                                              : penalty_kernel<false, true, PLAIN>;
    return launch_bodies(c, kernel, "factorize", &args, error);
}

extern "C" sadmm_status CUDA(update_penalty)(struct sadmm_context *c, double ratio, struct sadmm_error *error)
{
    cuda_args args = {};
    args.factor = ratio;
    CUDA_ENTER(c);
    TRY(CUDA(launch)(c, scale_kernel, "update_penalty", blocks_for(c->view.model.bodies), &args, error));
    c->rescaled = true;
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_penalties)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    args.planned = true;
    c->starting = !c->fast;
    c->checks = 0;
    c->cleared = c->prologue ? 0 : SCALAR_PRIMAL | SCALAR_DUAL | SCALAR_BARRIER; /* device/plan_check.h */
    c->placed = c->measured = c->rescaled = false;
    if (!c->fast) return launch_bodies(c, penalty_kernel<true, true, PLAIN>, "penalties", &args, error);
    CUDA(begin_weights)(c);
    if (c->prologue) return SADMM_OK;
    TRY(CUDA(enqueue_islands)(c, error));
    return enqueue_weighted_penalties(c, true, true, true, error);
}

sadmm_status CUDA(enqueue_balance)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    args.measure = 1;
    TRY(CUDA(launch)(c, scale_kernel, "update_penalty", blocks_for(c->view.model.bodies), &args, error));
    c->rescaled = true;
    return SADMM_OK;
}

sadmm_status CUDA(enqueue_weights)(struct sadmm_context *c, bool factor, struct sadmm_error *error)
{
    TRY(CUDA(enqueue_loads)(c, error));
    return enqueue_weighted_penalties(c, false, factor, false, error);
}

extern "C" sadmm_status CUDA(update_weights)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    return CUDA(enqueue_weights)(c, false, error);
}
