/* The method `fast`: the stop rule of whole steps. A convergence check finds each island's part of the certificate
 * errors (core/solve/solve_error.h), the natural map of its contacts and the velocity that it owes. An island that
 * meets the tolerance has stopped, in every tier after as many iterations as if it were alone: nothing is written to it
 * any more. Tier BLOCK leaves a block out whose islands have all stopped; the other tiers have nothing left to do once
 * the last island has. In double, eight lanes a body. */
#include <string.h>

#include "backend_cuda/device/double.h"
#include "backend_cuda/weight/constraint.h"
#include "backend_cuda/weight/island_sums.h"
#include "iterate.h"
#include "stop_rule.h"

#include "core/math/row.h"
#include "core/math/solve_rounding.h"
#include "solution.h"

/* Of a contact in its frame, with u = x + e and the response w. */
static __device__ double map_of_contact(const double lambda[3], const double u[3], double friction, double w)
{
    double residual[3], residual2 = 0;
    contact_residual_rows(lambda, u, friction, w, residual);
    for (int i = 0; i < 3; ++i) residual2 += residual[i] * residual[i];
    return w * sqrt(residual2);
}

/* The largest natural map of a pair's points, m/s. BOUNCES: it may have restitution. */
template <bool BOUNCES>
static __device__ double natural_map(const model_view &model, const body_view &bodies, const contact_view &contacts,
                                     const raw_view &raw, int32_t p)
{
    const struct sadmm_contact_pair *pair = &raw.pairs[p];
    const mat3 frame = sadmm_contact_frame(pair->normal);
    const int32_t ends[2] = {pair->body_a, pair->body_b};
    const int rows = pair->friction > 0 ? 3 : 1;
    const struct sadmm_settings settings = *model.settings;
    /* As planned for, should the pair have more: nothing has checked that yet. */
    const int32_t count = (int32_t)contacts.difference[p].w;
    double worst = 0;
    for (int32_t k = 0; k < count; ++k) {
        const struct sadmm_contact_point *point = &raw.points[pair->first + k];
        vec3 velocity = v3(0, 0, 0);
        double weight[3] = {};
        for (int side = 0; side < 2; ++side) {
            if (ends[side] < 0) continue;
            const solver_real *state = bodies.state + (size_t)ends[side] * ROW;
            const double *arm = side ? point->arm_b : point->arm_a,
                         *inverse = bodies.A_inverse + (size_t)ends[side] * PACKED;
            const vec3 turn = v3((double)state[3], (double)state[4], (double)state[5]),
                       at_point = v3_add(v3((double)state[0], (double)state[1], (double)state[2]),
                                         v3_cross(turn, v3_load(arm)));
            velocity = side ? v3_add(velocity, at_point) : v3_sub(velocity, at_point);
            for (int i = 0; i < rows; ++i) {
                double row[6];
                sadmm_contact_row(frame.r[i], arm, 1, row);
                weight[i] += packed_form(inverse, row);
            }
        }
        const vec3 impulse = m3_mul(frame, point_impulse(contacts, p, k)), x = m3_mul(frame, velocity);
        const double w = max_of(weight[0], max_of(weight[1], weight[2])),
                     e = BOUNCES ? sadmm_contact_e(&raw.system, &settings, pair, &raw.points[pair->first], k)
                                 : sadmm_contact_e_plain(&raw.system, &settings, point),
                     lambda[3] = {impulse.x, impulse.y, impulse.z}, u[3] = {x.x + e, x.y, x.z};
        worst = keep_max(worst, map_of_contact(lambda, u, pair->friction, w));
    }
    return worst;
}

/* The same of a constraint given by rows (the map of a row: core/solve/certificate.c). */
static __device__ double natural_map_of_rows(const body_view &bodies, const row_view &rows, const raw_view &raw,
                                             int32_t k)
{
    const struct sadmm_row_constraint constraint = raw.constraints[k];
    const struct raw_row *row = raw.rows + (size_t)k * SADMM_MAX_ROWS;
    const int32_t ends[2] = {constraint.body_a, constraint.body_b};
    double x[SADMM_MAX_ROWS] = {}, weight[SADMM_MAX_ROWS] = {}, lambda[SADMM_MAX_ROWS] = {}, worst = 0;
    for (int r = 0; r < constraint.count; ++r) {
        lambda[r] = (double)rows.data[(size_t)k * SADMM_MAX_ROWS + (size_t)r].lambda;
        for (int side = 0; side < 2; ++side) {
            if (ends[side] < 0) continue;
            const solver_real *state = bodies.state + (size_t)ends[side] * ROW;
            for (int j = 0; j < 6; ++j) x[r] += row[r].jacobian[side][j] * (double)state[j];
            weight[r] += packed_form(bodies.A_inverse + (size_t)ends[side] * PACKED, row[r].jacobian[side]);
        }
    }
    if (constraint.cone) {
        const double u[3] = {x[0] + row[0].bias, x[1] + row[1].bias, x[2] + row[2].bias},
                     w = constraint.friction > 0 ? max_of(weight[0], max_of(weight[1], weight[2])) : weight[0];
        return map_of_contact(lambda, u, constraint.friction, w);
    }
    for (int r = 0; r < constraint.count; ++r)
        if (weight[r] != 0)
            worst = keep_max(worst, row_natural_map(row[r].gain, row[r].bias, row[r].compliance, row[r].lo,
                                                              row[r].hi, x[r], lambda[r], weight[r]));
    return worst;
}

/* Terms of a body: natural map of the constraints that count here (at their first dynamic body); the velocity that it
 * owes; its speed, of which rounding is a share. args.checks: this check's number, from 1; args.count: iterations
 * done. */
template <bool RIGID, bool BOUNCES>
static __global__ void __launch_bounds__(BODY_THREADS)
    convergence_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    if (blockIdx.x == 0 && threadIdx.x == 0) v.islands.stop->unmet[(args.checks + 1) % CHECKS_KEPT] = 0;
    if (args.checks > 1 && all_stopped(v.islands, args.checks - 1)) return;
    const body_thread t = body_of_thread(v.model, v.graph);
    enum { MAP = 6, PUSH, SUMS };
    double sums[SUMS] = {}, map = 0, term[TERMS] = {}, largest[TERMS];
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) {
        const int32_t code = v.graph.incident[at], p = code / 2;
        add_side(v.contacts, v.rows, code, sums, &sums[PUSH]);
        const int32_t k = p - v.contacts.pair_capacity; /* a block of rows, or a pair */
        if (code & 1 && is_dynamic(v.model, k < 0 ? v.contacts.bodies[p].body_a : v.rows.constraints[k].body_a))
            continue; /* counted there */
        map = keep_max(map, k < 0 ? natural_map<BOUNCES>(v.model, v.bodies, v.contacts, v.raw, p)
                                            : natural_map_of_rows(v.bodies, v.rows, v.raw, k));
    }
    sum_lanes<SUMS>(sums);
    const wide_row<RIGID> row = row_of_body<RIGID>(v.bodies, t);
    const double g = own_number(sums, t.lane), momentum = product(row.velocity, row.a);
    term[0] = largest_of_lanes(map);
    const double mass = t.live ? mass_of(v.bodies, t.body) : 1, owed = momentum - row.b - g,
                 moving = max_of(dot_lanes(row.velocity, momentum), dot_lanes(row.b, product(row.b, row.a_inverse)));
    term[1] = sqrt(dot_lanes(owed, product(owed, row.a_inverse)) / mass);
    term[2] = sqrt(moving / mass);
    if (!add_up_island<largest_term>(v.graph, v.islands, t, t.live, own_number(term, t.lane), largest) ||
        t.lane != 0)
        return;
    const double enough = max_of(v.model.settings->tolerance, SOLVE_ROUNDING * SOLVER_EPSILON * largest[2]);
    const bool met = largest[0] <= enough && largest[1] <= enough;
    int32_t *stopped = &v.islands.info[v.graph.label[t.body]].stopped;
    if (!met) atomicAdd(&v.islands.stop->unmet[args.checks % CHECKS_KEPT], 1);
    if (!met || *stopped > 0) return;
    *stopped = args.count;
    atomicAdd(&v.islands.stop->sum, (unsigned long long)args.count);
    atomicMax(&v.islands.stop->last, args.count);
}

sadmm_status CUDA(enqueue_convergence_check)(struct sadmm_context *c, int done, struct sadmm_error *error)
{
    cuda_args args = {};
    args.checks = ++c->checks;
    args.count = done;
    const cuda_kernel kernel = !c->view.bodies.rigid ? convergence_kernel<false, false>
                               : c->bounces          ? convergence_kernel<true, true>
                                                     : convergence_kernel<true, false>;
    return CUDA(launch_of)(c, kernel, "convergence check", body_blocks(c->view.model.bodies), BODY_THREADS, &args,
                           error);
}

extern "C" sadmm_status CUDA(check_convergence)(struct sadmm_context *c, int done, int32_t *unmet,
                                                struct sadmm_error *error)
{
    CUDA_ENTER(c);
    TRY(CUDA(enqueue_convergence_check)(c, done, error));
    TRY(CUDA(download)(c, &c->view.islands.stop->unmet[c->checks % CHECKS_KEPT], sizeof *unmet, error));
    memcpy(unmet, c->buffers[PINNED_OUT].data, sizeof *unmet);
    return SADMM_OK;
}
