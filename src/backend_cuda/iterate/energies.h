/* Energies of islands, and by what the method `fast` slows them down (math/energy_limit.h). In double, from this
 * precision's data; eight lanes a body. */
#ifndef SADMM_CUDA_ITERATE_ENERGIES_H
#define SADMM_CUDA_ITERATE_ENERGIES_H

#include "backend_cuda/weight/constraint.h"
#include "slow.h"

/* Sums over a body's sides: J^T lambda, then these. */
enum { WORK = 6, DRIVE, SIDE_SUMS };

/* Of a side of a pair: J^T lambda; where the pair is `counted`, too, work of its contacts that push apart, and what e
 * adds to the drive. */
static __device__ __forceinline__ void add_contacts(const contact_view &contacts, int32_t p, bool second, bool counted,
                                                    double sums[SIDE_SUMS])
{
    const pair_data pair = load_pair(contacts, p);
    const double sign = second ? 1 : -1;
    double force[3] = {};
    for_each_point(contacts, p, pair, [&](const point_data &point) {
        const double push = counted ? dot3(pair.normal, point.lambda) : 0;
        double arm[3];
#pragma unroll
        for (int j = 0; j < 3; ++j) {
            arm[j] = second ? point.arm[1][j] : point.arm[0][j];
            force[j] += point.lambda[j];
        }
        add_cross(arm, point.lambda, sign, sums + 3);
        sums[WORK] += max_of(0.0, -point.error) * push;
        sums[DRIVE] -= point.error * push;
    });
#pragma unroll
    for (int j = 0; j < 3; ++j) sums[j] += sign * force[j];
}

/* Terms of a body, one a lane: energy of v, of A^-1 b; drive; work; v . b / 2; response. A pair counts at its first
 * dynamic body. Of bodies that are `on`. Every lane of the warp comes here. */
template <bool RIGID>
static __device__ __forceinline__ double energies_of_body(const cuda_view &v, const body_thread &t, bool on)
{
    double sums[SIDE_SUMS] = {}, term[TERMS] = {};
    for (int32_t at = t.begin + t.lane; on && at < t.end; at += LANES) {
        const int32_t code = v.graph.incident[at], p = code / 2;
        double wrench[6];
        if (p < v.contacts.pair_capacity) {
            const bool counted = !(code & 1) || !is_dynamic(v.model, v.contacts.bodies[p].body_a); /* or there */
            add_contacts(v.contacts, p, code & 1, counted, sums);
            continue;
        }
        wrench_of_rows(v.rows, p - v.contacts.pair_capacity, code & 1, wrench);
        for (int j = 0; j < 6; ++j) sums[j] += wrench[j];
    }
    sum_lanes<SIDE_SUMS>(sums);
    const wide_row<RIGID> row = row_of_body<RIGID>(v.bodies, t);
    const double momentum = product(row.velocity, row.a), g = own_number(sums, t.lane);
    term[0] = dot_lanes(row.velocity, momentum) / 2;
    term[1] = t.live ? v.bodies.free_energy[t.body] : 0;
    const double change = product(g, row.a_inverse);
    term[2] = sums[DRIVE] - dot_lanes(change, row.b);
    term[5] = dot_lanes(g, change);
    term[3] = sums[WORK];
    term[4] = dot_lanes(row.velocity, row.b) / 2;
    return own_number(term, t.lane);
}

/* From its terms. */
static __device__ __forceinline__ struct island_energies energies_of(const double term[TERMS])
{
    const struct island_energies energies = {term[0], term[1], term[3], term[2], term[5], 0, 0};
    return energies;
}

/* By what an island is slowed down. */
static __device__ __forceinline__ double factor_of(const struct island_energies &energies, double along, bool rebounds)
{
    const double allowed = energy_limit_factor(&energies, SOLVER_EPSILON);
    return rebounds ? min_of(allowed, energy_limit_rebound_factor(&energies, along, SOLVER_EPSILON)) : allowed;
}

/* What follows from their sums over an anchored island; !slows: it is counted, no more. One thread of it. */
static __device__ __forceinline__ void limit_island(const island_view &islands, cuda_island *island,
                                                    const double sum[TERMS], bool rebounds, bool slows)
{
    const struct island_energies energies = energies_of(sum);
    const double factor = factor_of(energies, sum[4], rebounds && island->warm);
    if (island->rows) return; /* the energies are those of contacts alone; slow_down stays 1 */
    island->slow_down = slows ? factor : 1;
    if (factor != 1) atomicAdd(islands.limited, 1);
}

#endif
