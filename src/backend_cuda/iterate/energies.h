/* The method `fast`: energies of islands, and by what they are slowed down (math/limit.h). In double, from this
 * precision's data; eight lanes a body. */
#ifndef SADMM_CUDA_ITERATE_ENERGIES_H
#define SADMM_CUDA_ITERATE_ENERGIES_H

#include "backend_cuda/weight/constraint.h"
#include "slow.h"

/* Work of a pair's contacts that push apart. */
static inline __device__ double work_of(const contact_view &contacts, int32_t p)
{
    const pair_data pair = load_pair(contacts, p);
    double work = 0;
    for (int32_t k = 0; k < pair.count; ++k) {
        const point_data point = load_point(contacts, p, k, pair);
        work += fmax(0.0, -point.error) * dot3(pair.normal, point.lambda);
    }
    return work;
}

/* Terms of a body, one a lane: energy of v, of A^-1 b, of r = b + g - A v, g = J^T lambda; work; v . b / 2. A pair
 * counts at its first dynamic body. Every lane of the warp comes here. */
template <bool RIGID>
static __device__ __forceinline__ double energies_of_body(const cuda_view &v, const body_thread &t)
{
    enum { WORK = 6, PUSH, SUMS };
    double sums[SUMS] = {}, term[TERMS] = {};
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) {
        const int32_t code = v.graph.incident[at], p = code / 2;
        add_side(v.contacts, v.rows, code, sums, &sums[PUSH]);
        if (p >= v.contacts.pair_capacity || (code & 1 && is_dynamic(v.model, v.contacts.bodies[p].body_a)))
            continue; /* counted there */
        sums[WORK] += work_of(v.contacts, p);
    }
    sum_lanes<SUMS>(sums);
    const wide_row<RIGID> row = row_of_body<RIGID>(v.bodies, t);
    const double momentum = product(row.velocity, row.a), r = row.b + own_number(sums, t.lane) - momentum;
    term[0] = dot_lanes(row.velocity, momentum) / 2;
    term[1] = t.live ? v.bodies.free_energy[t.body] : 0;
    term[2] = dot_lanes(r, product(r, row.a_inverse)) / 2;
    term[3] = sums[WORK];
    term[4] = dot_lanes(row.velocity, row.b) / 2;
    return own_number(term, t.lane);
}

/* What follows from their sums over an island. One thread of it. */
static __device__ __forceinline__ void limit_island(const island_view &islands, cuda_island *island,
                                                    const double sum[TERMS], bool under_iterated)
{
    const struct limit_energies energies = {sum[0], sum[1], sum[2], sum[3]};
    const double allowed = limit_factor(&energies),
                 factor =
                     under_iterated ? fmin(allowed, limit_bounce_factor(&energies, sum[4], SOLVER_EPSILON)) : allowed;
    if (island->rows) return; /* the energies are those of contacts alone; slow_down stays 1 */
    island->slow_down = factor;
    if (factor != 1) atomicAdd(islands.limited, 1);
}

#endif
