/* The method `fast`: weights of the constraints (kernels E-G; math/weight.h) and weight scales of the islands. In
 * double, from this precision's data; a few times a step.
 *
 *   pairs    four threads a pair, or one: records of its sides (assemble/side_sums.h). The first ones come with the
 * contacts   terms    eight lanes a body: its momentum residual, what it adds to the sums over its island, the sums
 * (weight/island_sums.h), and what            follows for the island
 *   rows     a thread a row block: B
 *   then C and H (weight/penalty.cu), where each side of a pair works out B for itself
 *
 * The first time, persistent kernels of tier BLOCK do this themselves (iterate/prologue.h). */
#include "backend_cuda/device/double.h"
#include "island_sums.h"
#include "backend_cuda/assemble/side_sums.h"
#include "weigh.h"

/* ---- pairs ------------------------------------------------------------------------------------------------------- */

/* Records of sides again, but for what depends on arms alone. */
static __global__ void __launch_bounds__(BODY_THREADS)
    pairs_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    const int32_t t = (int32_t)(blockIdx.x * (unsigned)BODY_THREADS + threadIdx.x), p = t / v.contacts.lanes,
                  lane = t % v.contacts.lanes;
    const bool live = p < live_pairs(v.model);
    const real4 none = {};
    const pair_ends nobody = {v.model.bodies, v.model.bodies, -1, -1}, ends = live ? v.contacts.ends[p] : nobody;
    const real4 about = live ? v.contacts.normal[p] : none, difference = live ? v.contacts.difference[p] : none;
    const int32_t count = (int32_t)difference.w;
    const rigid_inverse no_inverse = {};
    struct pair_sums sums = {};
    for (int32_t k = lane; k < count; k += v.contacts.lanes) {
        const point_numbers point = fetch_point(v.contacts, p, k);
        add_point(v.model, v.bodies, ends, about, difference, point.arm, point.lambda, false, &sums);
    }
    store_sides(v.model, v.bodies, v.contacts, v.weights, live, p, lane, count, ends, difference, false, no_inverse,
                &sums);
}

/* ---- terms and islands --------------------------------------------------------------------------------------------- */

template <bool LEVELS>
static __global__ void __launch_bounds__(BODY_THREADS)
    terms_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    wait_for_stream();
    const body_thread t = body_of_thread(v.model, v.graph);
    double total[TERMS];
    const double term =
        v.bodies.rigid ? terms_of_body<LEVELS, true, true>(v, t) : terms_of_body<LEVELS, false, true>(v, t);
    if (add_up_island<add_terms>(v.graph, v.islands, t, term, total) && t.lane == 0)
        weigh_island<LEVELS>(&v.islands.info[v.graph.label[t.body]], total, args);
}

/* ---- row blocks -------------------------------------------------------------------------------------------------- */

static __device__ void store_row(const row_view &rows, int32_t plane, int32_t k, double value)
{
    rows.data[(size_t)plane * (size_t)rows.stride + (size_t)k] = (solver_real)value;
}

/* Of every row of a block, and what its multiplier counts for in the load: a row that pushes by how much, a row that
 * only turns by the push that would take as much energy. */
static __device__ void respond_row_block(const model_view &model, const body_view &bodies, const row_view &rows,
                                         int32_t k, const row_about &about)
{
    const int32_t joined[2] = {about.body_a, about.body_b};
    double inverse_mass = 0;
    for (int side = 0; side < 2; ++side)
        if (is_dynamic(model, joined[side])) inverse_mass += 1 / mass_of(bodies, (size_t)joined[side]);
    for (int r = 0; r < about.rows; ++r) {
        double w = 0, push = 0, row[6];
        for (int side = 0; side < 2; ++side) {
            if (!is_dynamic(model, joined[side])) continue;
            for (int j = 0; j < 6; ++j) row[j] = row_number(rows, (side ? ROW_J_B : ROW_J_A) + 6 * r + j, k);
            w += packed_form(bodies.A_inverse + (size_t)joined[side] * PACKED, row);
            push = fmax(push, sqrt(dot3(row, row)));
        }
        store_row(rows, ROW_RESPONSE + r, k, w);
        store_row(rows, ROW_SCALE + r, k, push > 0 ? push : sqrt(w / inverse_mass));
    }
}

/* B = diag(weight) + along along^T */
static __device__ void weigh_row_block(const cuda_view &v, int32_t k, bool first)
{
    const row_about about = v.rows.info[k];
    cuda_island *island =
        &v.islands.info[v.graph.label[is_dynamic(v.model, about.body_a) ? about.body_a : about.body_b]];
    double load2 = 0, lambda2 = 0, mean = 0;
    if (first) {
        respond_row_block(v.model, v.bodies, v.rows, k, about);
        island->blocks = 1;
    }
    for (int r = 0; r < about.rows; ++r) {
        const double lambda = row_number(v.rows, ROW_LAMBDA + r, k),
                     load = row_number(v.rows, ROW_SCALE + r, k) * lambda;
        load2 += load * load;
        lambda2 += lambda * lambda;
        mean += row_number(v.rows, ROW_RESPONSE + r, k) / about.rows;
    }
    const double share = weight_share(load2, island->speed, island->mass);
    for (int r = 0; r < about.rows; ++r) {
        const double lambda = row_number(v.rows, ROW_LAMBDA + r, k), response = row_number(v.rows, ROW_RESPONSE + r, k);
        const bool hard = about.kind == SADMM_BLOCK_HARD;
        store_row(v.rows, ROW_WEIGHT + r, k,
                  hard                                ? weight_of_coupled_row(response)
                  : about.kind == SADMM_BLOCK_CONTACT ? weight_of_cone(share, lambda2, mean)
                                                      : weight_of_single_row(share, lambda, response));
        store_row(v.rows, ROW_ALONG + r, k, hard ? sqrt(share) * lambda : 0);
    }
}

static __global__ void weigh_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t k = thread_index();
    if (k < live_rows(v.model, v.rows)) weigh_row_block(v, k, args.start);
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

void CUDA(begin_weights)(struct sadmm_context *c)
{
    c->refreshes = c->exact_since = 0;
    c->starting = c->settled = false;
}

cuda_args CUDA(weight_args)(const struct sadmm_context *c)
{
    cuda_args args = {};
    args.start = c->refreshes == 0;
    args.warm = c->plan.warm;
    args.factor = weight_under_iterated(c->plan.rigid, c->settings.iterations);
    return args;
}

sadmm_status CUDA(enqueue_islands)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = CUDA(weight_args)(c);
    const cuda_kernel kernel = c->refreshes >= WEIGHT_FIRST_SCALE ? terms_kernel<true> : terms_kernel<false>;
    CUDA_TRY(CUDA(launch_early)(c, kernel, "sums over islands", body_blocks(c->view.model.bodies), BODY_THREADS, &args,
                                error));
    return CUDA(launch)(c, weigh_rows_kernel, "weights of row blocks", blocks_for(c->view.rows.count), &args, error);
}

sadmm_status CUDA(enqueue_weights)(struct sadmm_context *c, bool factor, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t blocks =
        ((int64_t)c->view.contacts.pair_capacity * c->view.contacts.lanes + BODY_THREADS - 1) / BODY_THREADS;
    ++c->refreshes;
    c->exact_since = 0;
    CUDA_TRY(CUDA(launch_of)(c, pairs_kernel, "loads of pairs", blocks, BODY_THREADS, &args, error));
    CUDA_TRY(CUDA(enqueue_islands)(c, error));
    return CUDA(enqueue_weighted_penalties)(c, false, factor, false, error);
}

/* ---- entries ----------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(update_weights)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_ENTER(c);
    return CUDA(enqueue_weights)(c, false, error);
}
