/* Energies of islands, and by what the method `fast` slows them down (math/limit.h). In double, from this
 * precision's data; eight lanes a body. */
#ifndef SADMM_CUDA_ITERATE_ENERGIES_H
#define SADMM_CUDA_ITERATE_ENERGIES_H

#include "backend_cuda/weight/constraint.h"
#include "slow.h"

/* Of a pair: work of its contacts that push apart, and what e adds to the drive. */
static inline __device__ void add_work(const contact_view &contacts, int32_t p, double *work, double *drive)
{
    const pair_data pair = load_pair(contacts, p);
    for (int32_t k = 0; k < pair.count; ++k) {
        const point_data point = load_point(contacts, p, k, pair);
        const double push = dot3(pair.normal, point.lambda);
        *work += fmax(0.0, -point.error) * push;
        *drive -= point.error * push;
    }
}

/* Terms of a body, one a lane: energy of v, of A^-1 b, of r = b + g - A v, g = J^T lambda; work; v . b / 2. LOOSE: the
 * third is the drive, and there is the response. A pair counts at its first dynamic body. Every lane of the warp comes
 * here. */
template <bool RIGID, bool LOOSE>
static __device__ __forceinline__ double energies_of_body(const cuda_view &v, const body_thread &t)
{
    enum { WORK = 6, DRIVE, PUSH, SUMS };
    double sums[SUMS] = {}, term[TERMS] = {};
    for (int32_t at = t.begin + t.lane; at < t.end; at += LANES) {
        const int32_t code = v.graph.incident[at], p = code / 2;
        add_side(v.contacts, v.rows, code, sums, &sums[PUSH]);
        if (p >= v.contacts.pair_capacity || (code & 1 && is_dynamic(v.model, v.contacts.bodies[p].body_a)))
            continue; /* counted there */
        add_work(v.contacts, p, &sums[WORK], &sums[DRIVE]);
    }
    sum_lanes<SUMS>(sums);
    const wide_row<RIGID> row = row_of_body<RIGID>(v.bodies, t);
    const double momentum = product(row.velocity, row.a), g = own_number(sums, t.lane);
    term[0] = dot_lanes(row.velocity, momentum) / 2;
    term[1] = t.live ? v.bodies.free_energy[t.body] : 0;
    if (LOOSE) {
        const double change = product(g, row.a_inverse);
        term[2] = sums[DRIVE] - dot_lanes(change, row.b);
        term[5] = dot_lanes(change, g);
    } else {
        const double r = row.b + g - momentum;
        term[2] = dot_lanes(r, product(r, row.a_inverse)) / 2;
    }
    term[3] = sums[WORK];
    term[4] = dot_lanes(row.velocity, row.b) / 2;
    return own_number(term, t.lane);
}

/* By what an island is slowed down. */
static __device__ __forceinline__ double factor_of(const struct limit_energies &energies, double along,
                                                   bool under_iterated)
{
    const double allowed = limit_factor(&energies, SOLVER_EPSILON);
    return under_iterated ? fmin(allowed, limit_bounce_factor(&energies, along, SOLVER_EPSILON)) : allowed;
}

/* What follows from their sums over an island that is held; !slows: it is counted, no more. One thread of it. */
static __device__ __forceinline__ void limit_island(const island_view &islands, cuda_island *island,
                                                    const double sum[TERMS], bool under_iterated, bool slows)
{
    const struct limit_energies energies = {sum[0], sum[1], sum[2], sum[3], 0, 0, 0, 0};
    const double factor = factor_of(energies, sum[4], under_iterated);
    if (island->rows) return; /* the energies are those of contacts alone; slow_down stays 1 */
    island->slow_down = slows ? factor : 1;
    if (factor != 1) atomicAdd(islands.limited, 1);
}

#endif
