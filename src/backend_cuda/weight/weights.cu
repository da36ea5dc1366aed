/* The method `fast`: weights of the constraints (kernels E-G; math/weight.h) and weight scales of the islands. In
 * double, from this precision's data; a few times a step.
 *
 *   pairs    four threads a pair, or one: records of its sides (assemble/side_sums.h). The first ones come with the
 *            contacts
 *   terms    eight lanes a body: its momentum residual, what it adds to the sums over its island, the sums
 *            (weight/island_sums.h), and what follows for the island
 *   rows     a thread a row: what responds to it, which nothing in the solve changes; a thread a constraint: B
 *   then C and H (weight/penalty.cu), where each side of a pair works out B for itself
 *
 * The first time, persistent kernels of tier BLOCK do this themselves (iterate/prologue.h). */
#include "backend_cuda/device/double.h"
#include "island_sums.h"
#include "backend_cuda/assemble/side_sums.h"
#include "weigh.h"
#include "weight.h"

#include "core/model/push_law.h"

/* ---- pairs ------------------------------------------------------------------------------------------------------- */

/* Records of sides again, but for what depends on arms alone. */
static __global__ void __launch_bounds__(BODY_THREADS)
    pairs_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait();
    pdl_trigger(v.model.bodies);
    const int32_t t = (int32_t)(blockIdx.x * (unsigned)BODY_THREADS + threadIdx.x), p = t / v.contacts.lanes,
                  lane = t % v.contacts.lanes;
    const bool live = p < live_pairs(v.model);
    const real4 none = {};
    const pair_bodies nobody = {v.model.bodies, v.model.bodies, -1, -1}, ends = live ? v.contacts.bodies[p] : nobody;
    const real4 about = live ? v.contacts.normal[p] : none, difference = live ? v.contacts.difference[p] : none;
    const int32_t count = (int32_t)difference.w;
    const rigid_inverse no_inverse = {};
    struct pair_sums sums = {};
    for (int32_t k = lane; k < count; k += v.contacts.lanes) {
        const point_numbers point = fetch_point(v.contacts, p, k);
        add_point(v.model, v.bodies, ends, about, difference, point.arm, point.lambda, false, &sums);
    }
    store_sides(v.model, v.bodies, v.contacts, v.weights, live, p, lane, count, ends, (double)about.w, difference,
                false, false, no_inverse, &sums);
}

/* ---- terms and islands ------------------------------------------------------------------------------------------- */

/* ROWS: there may be constraints given by rows. */
template <bool SCALES, bool ROWS>
static __global__ void __launch_bounds__(BODY_THREADS)
    terms_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait();
    pdl_trigger(v.model.bodies);
    const body_thread t = body_of_thread(v.model, v.graph);
    double total[TERMS];
    const double term =
        v.bodies.rigid ? terms_of_body<SCALES, true, ROWS>(v, args, t) : terms_of_body<SCALES, false, ROWS>(v, args, t);
    if (add_up_island<add_terms>(v.graph, v.islands, t, t.live, term, total) && t.lane == 0) {
        cuda_island *island = &v.islands.info[v.graph.label[t.body]];
        if (!SCALES && args.start) *island = new_island(total, args);
        if (weigh_island<SCALES>(island, total, args)) v.model.statistics->cold = 1;
        if (!SCALES && args.start && !island->anchored) *v.islands.floating = 1;
    }
}

/* ---- row blocks -------------------------------------------------------------------------------------------------- */

/* J A^-1 J^T; and what its multiplier counts for in the load of its constraint. A thread a row. */
static __global__ void respond_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait();
    pdl_trigger(v.model.bodies);
    const int32_t slot = thread_index(), k = slot / SADMM_MAX_ROWS, r = slot % SADMM_MAX_ROWS;
    if (k >= live_rows(v.model, v.rows) || r >= v.rows.constraints[k].rows) return;
    const int32_t ends[2] = {v.rows.constraints[k].body_a, v.rows.constraints[k].body_b};
    double inverse_mass = 0, w = 0, push = 0, J[6];
    for (int side = 0; side < 2; ++side) {
        if (!is_dynamic(v.model, ends[side])) continue;
        inverse_mass += 1 / mass_of(v.bodies, (size_t)ends[side]);
        load_jacobian(rows_of(v.rows, k)[r], side, J);
        w += packed_form(v.bodies.A_inverse + (size_t)ends[side] * PACKED, J);
        push = max_of(push, length3(J));
    }
    const row_response out = {w, weight_row_scale(push, w, inverse_mass)};
    v.rows.responses[slot] = out;
}

/* B = diag(weight) + along along^T. A thread a constraint. What the islands' sums do not say is fetched before the
 * kernel that makes them has ended. */
static __global__ void weigh_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t k = thread_index();
    const bool live = k < live_rows(v.model, v.rows);
    row_constraint about = {};
    if (live) about = v.rows.constraints[k];
    row_data *rows = v.rows.data + (size_t)k * SADMM_MAX_ROWS;
    const row_response *responses = v.rows.responses + (size_t)k * SADMM_MAX_ROWS;
    struct weight_row_sums sums = {0, 0, 0};
    for (int r = 0; r < about.rows; ++r)
        weight_add_row(&sums, (double)rows[r].lambda, responses[r].scale, responses[r].response, about.rows);
    const int32_t label =
        about.rows > 0 ? v.graph.label[is_dynamic(v.model, about.body_a) ? about.body_a : about.body_b] : 0;
    pdl_wait();
    pdl_trigger(v.model.bodies);
    if (about.rows == 0) return; /* a joint may have fewer than there is room for */
    cuda_island *island = &v.islands.info[label];
    if (!is_weighed(island, args)) return;
    if (args.start) island->rows = island->anchored = island->anchored_outside = 1; /* left alone */
    if (args.start && v.push.bits) v.push.bits[label] = PUSH_ROWS;
    const double share = weight_share(&island->weights, sums.load2);
    for (int r = 0; r < about.rows; ++r) {
        const struct weight_law law = {
            about.cone, sadmm_law_is_coupled((double)rows[r].compliance, (double)rows[r].lo, (double)rows[r].hi),
            (double)rows[r].gain, (double)rows[r].compliance, (double)rows[r].lo, (double)rows[r].hi, args.row_floor};
        const struct weight_row B = weight_of_row(&sums, share, &law, (double)rows[r].lambda, responses[r].response);
        rows[r].weight = (solver_real)B.weight;
        rows[r].along = (solver_real)B.along;
    }
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

void CUDA(begin_weights)(struct sadmm_context *c)
{
    c->weight_updates = c->exact_since = 0;
    c->starting = c->step1_done = false;
}

cuda_args CUDA(weight_args)(const struct sadmm_context *c)
{
    cuda_args args = {};
    args.start = c->weight_updates == 0;
    args.may_be_warm = plan_may_start_warm(&c->plan, &c->settings);
    args.spring_iterations = weight_spring_iterations(true, c->plan.rigid, c->settings.iterations);
    args.row_floor = weight_row_floor(c->plan.rigid, c->settings.iterations);
    return args;
}

sadmm_status CUDA(enqueue_row_responses)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    return CUDA(launch)(c, respond_rows_kernel, "responses of rows",
                        blocks_for((int64_t)c->view.rows.count * SADMM_MAX_ROWS), &args, error);
}

sadmm_status CUDA(enqueue_islands)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = CUDA(weight_args)(c);
    const bool scales = c->weight_updates >= WEIGHT_FIRST_SCALE, rows = c->view.rows.count > 0;
    const cuda_kernel kernel = scales ? (rows ? terms_kernel<true, true> : terms_kernel<true, false>)
                                      : (rows ? terms_kernel<false, true> : terms_kernel<false, false>);
    TRY(CUDA(launch_pdl)(c, kernel, "sums over islands", body_blocks(c->view.model.bodies), BODY_THREADS, &args,
                         error));
    return CUDA(launch_pdl)(c, weigh_rows_kernel, "weights of rows", blocks_for(c->view.rows.count), THREADS, &args,
                            error);
}

sadmm_status CUDA(enqueue_loads)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t blocks =
        ((int64_t)c->view.contacts.pair_capacity * c->view.contacts.lanes + BODY_THREADS - 1) / BODY_THREADS;
    ++c->weight_updates;
    TRY(CUDA(launch_of)(c, pairs_kernel, "loads of pairs", blocks, BODY_THREADS, &args, error));
    return CUDA(enqueue_islands)(c, error);
}
