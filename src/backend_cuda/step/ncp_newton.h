/* Semismooth Newton steps on the natural maps of a dense problem, by a thread block (core/solve/ncp_newton.h). */
#ifndef SADMM_CUDA_STEP_NCP_NEWTON_H
#define SADMM_CUDA_STEP_NCP_NEWTON_H

#include "ncp_island.h"

/* m/s: what is a solution, and what steps aim at. */
#define NCP_ENOUGH 1e-9
#define NCP_AIM 1e-12

/* What is added to the diagonal of a step's matrix, whose entries are shares of a law's own response: `share` of the
 * natural map, by the size of velocities, within bounds (core/solve/ncp_newton.c). */
enum { NCP_FROM_START = 20, NCP_FROM_INSIDE = 100, NCP_IN_TURN = 50 };
struct ncp_damping {
    double share, least, most;
};

/* Multiplications that a search may take, and steps that it makes at least: a matrix of 192 numbers takes a step some
 * 0.3 ms, and islands that are left are iterated. */
#define NCP_BUDGET 3e7
enum { NCP_LEAST_STEPS = 4 };
static __device__ __forceinline__ int affordable_steps(int most, int32_t numbers)
{
    const double steps = NCP_BUDGET / ((double)numbers * numbers * numbers + 1);
    return steps >= most ? most : steps > NCP_LEAST_STEPS ? (int)steps : (int)NCP_LEAST_STEPS;
}

/* Pi(y) of a law, and its derivative (core/solve/ncp_dense.c). */
static __device__ void project_law(const ncp_law &law, const double y[3], double to[3], double D[9])
{
    for (int k = 0; k < 9; ++k) D[k] = 0;
    if (law.count == 1) {
        to[0] = y[0] < law.lo ? law.lo : y[0] > law.hi ? law.hi : y[0];
        D[0] = to[0] == y[0];
        return;
    }
    to[0] = to[1] = to[2] = 0;
    if (!(y[0] > 0)) return;
    const double size = hypot(y[1], y[2]), limit = law.friction * y[0];
    to[0] = y[0], D[0] = 1;
    if (size <= limit) {
        to[1] = y[1], to[2] = y[2];
        D[4] = D[8] = 1;
        return;
    }
    const double way[2] = {y[1] / size, y[2] / size};
    for (int k = 0; k < 2; ++k) {
        to[1 + k] = limit * way[k];
        D[3 * (1 + k)] = law.friction * way[k];
        for (int q = 0; q < 2; ++q) D[3 * (1 + k) + 1 + q] = limit / size * ((k == q) - way[k] * way[q]);
    }
}

/* The natural map of a law, m/s: of y = lambda - u / response. */
static __device__ double natural_map_of(const ncp_law &law, const double *lambda, const double *u)
{
    double y[3], to[3], D[9], sum = 0;
    for (int k = 0; k < law.count; ++k) y[k] = lambda[k] - u[k] / law.response;
    project_law(law, y, to, D);
    for (int k = 0; k < law.count; ++k) sum += (lambda[k] - to[k]) * (lambda[k] - to[k]);
    return sqrt(sum) * law.response;
}

static __device__ double natural_map(const ncp_island &s, ncp_shared *shared)
{
    double own = 0;
    each(s.laws, [&](int32_t i) {
        const double map = natural_map_of(s.law[i], s.lambda + s.law[i].first, s.u + s.law[i].first);
        if (!(map <= own)) own = map;
    });
    return most_of(own, shared);
}

/* What the natural map is a share of: the largest speed, m/s, or load times response. */
static __device__ double size_of(const ncp_island &s, ncp_shared *shared)
{
    double own = 0;
    each(s.laws, [&](int32_t i) {
        for (int k = 0; k < s.law[i].count; ++k) {
            const int32_t n = s.law[i].first + k;
            own = fmax(own, fmax(fabs(s.u[n]), fabs(s.lambda[n]) * s.law[i].response));
        }
    });
    return most_of(own, shared);
}

/* Numbers that their law fixes go where it has them; the others are listed, to be solved for. */
static __device__ int32_t sort_numbers(const ncp_island &s, ncp_shared *shared)
{
    each(s.laws, [&](int32_t i) {
        const ncp_law &law = s.law[i];
        double y[3], to[3], *D = s.D + 9 * i;
        for (int k = 0; k < law.count; ++k)
            y[k] = s.lambda[law.first + k] - s.u[law.first + k] / law.response;
        project_law(law, y, to, D);
        for (int k = 0; k < law.count; ++k) {
            s.step[law.first + k] = to[k] - s.lambda[law.first + k];
            s.pivot[law.first + k] = D[3 * k] != 0 || D[3 * k + 1] != 0 || D[3 * k + 2] != 0;
        }
    });
    __syncthreads();
    if (threadIdx.x < WARP) {
        int32_t count = 0;
        for (int32_t first = 0; first < s.numbers; first += WARP) {
            const int32_t n = first + (int32_t)threadIdx.x;
            const bool is = n < s.numbers && s.pivot[n];
            const unsigned lanes = __ballot_sync((unsigned)ALL_LANES, is);
            if (is) s.list[count + __popc(lanes & ((1u << threadIdx.x) - 1))] = n;
            count += __popc(lanes);
        }
        if (threadIdx.x == 0) shared->count = count;
    }
    each(s.numbers, [&](int32_t r) { /* what those that are fixed move */
        double sum = 0;
        for (int32_t n = 0; n < s.numbers; ++n)
            if (!s.pivot[n] && s.step[n] != 0) sum += s.G[r * s.numbers + n] * s.step[n];
        s.moved[r] = sum;
    });
    __syncthreads();
    return shared->count;
}

/* Entry (i, c) of a step's matrix: (1 - D) step + D G step / response = Pi - lambda; c = count: the right side. */
static __device__ double step_entry(const ncp_island &s, int32_t count, int32_t i, int32_t c, double proximal)
{
    int k;
    const int32_t number = s.list[i], at = law_of(s, number, &k);
    const ncp_law &law = s.law[at];
    const double *D = s.D + 9 * at + 3 * k;
    double sum = c == count ? s.step[number] : 0;
    for (int h = 0; h < law.count; ++h) {
        if (D[h] == 0) continue;
        const double share = D[h] / law.response;
        if (c == count) sum -= share * s.moved[law.first + h];
        else sum += share * s.G[(law.first + h) * s.numbers + s.list[c]];
    }
    if (c == count) return sum;
    const int32_t h = s.list[c] - law.first;
    if (h >= 0 && h < law.count) sum += (h == k) - D[h];
    return c == i ? sum + proximal : sum;
}

/* The row of column k's pivot among those that have none yet, by the first warp; -1: there is none. */
static __device__ __forceinline__ void choose_pivot(const ncp_island &s, int32_t count, int32_t stride, int32_t k,
                                                    ncp_shared *shared)
{
    if (threadIdx.x >= WARP) return;
    double most = 0;
    int32_t row = -1;
    for (int32_t i = (int32_t)threadIdx.x; i < count; i += WARP) {
        const double entry = fabs(s.M[i * stride + k]);
        if (s.pivot[i] < 0 && entry > most) most = entry, row = i;
    }
    for (int o = WARP / 2; o > 0; o /= 2) {
        const double other = __shfl_xor_sync((unsigned)ALL_LANES, most, o);
        const int32_t other_row = __shfl_xor_sync((unsigned)ALL_LANES, row, o);
        if (other > most || (other == most && other_row >= 0 && (row < 0 || other_row < row)))
            most = other, row = other_row;
    }
    if (threadIdx.x == 0) {
        shared->pivot = row;
        if (row >= 0) s.pivot[row] = k;
    }
}

/* M x = right by Gauss and Jordan's elimination, to `step`. False: singular. */
static __device__ bool solve_step(const ncp_island &s, int32_t count, ncp_shared *shared)
{
    const int32_t stride = count + 1;
    each(count, [&](int32_t i) { s.pivot[i] = -1; });
    __syncthreads();
#pragma unroll 1
    for (int32_t k = 0; k < count; ++k) {
        choose_pivot(s, count, stride, k, shared);
        __syncthreads();
        const int32_t p = shared->pivot, width = count - k;
        if (p < 0) return false;
        const double inverse = 1 / s.M[p * stride + k];
        each(count * width, [&](int32_t t) {
            const int32_t i = t / width, c = k + 1 + t % width;
            if (i == p) return;
            const double share = s.M[i * stride + k] * inverse;
            if (share != 0) s.M[i * stride + c] -= share * s.M[p * stride + c];
        });
        __syncthreads();
    }
    each(count, [&](int32_t i) {
        const int32_t k = s.pivot[i];
        s.step[s.list[k]] = s.M[i * stride + count] / s.M[i * stride + k];
    });
    __syncthreads();
    return true;
}

static __device__ bool take_step(const ncp_island &s, double proximal, ncp_shared *shared)
{
    const int32_t count = sort_numbers(s, shared);
    each(count * (count + 1), [&](int32_t t) {
        const int32_t i = t / (count + 1), c = t % (count + 1);
        s.M[t] = step_entry(s, count, i, c, proximal);
    });
    __syncthreads();
    if (!solve_step(s, count, shared)) return false;
    each(s.numbers, [&](int32_t r) {
        double sum = 0;
        for (int32_t n = 0; n < s.numbers; ++n) sum += s.G[r * s.numbers + n] * s.step[n];
        s.u[r] += sum;
        s.lambda[r] += s.step[r];
    });
    __syncthreads();
    return true;
}

static __device__ __forceinline__ void keep_best(const ncp_island &s)
{
    each(s.numbers, [&](int32_t n) {
        s.best_lambda[n] = s.lambda[n];
        s.best_u[n] = s.u[n];
    });
    __syncthreads();
}

/* Full steps: on the way to the right pieces of laws the map may grow. lambda, u: the best there was; returns its
 * map. */
static __device__ double take_steps(const ncp_island &s, int steps, ncp_shared *shared)
{
    const ncp_damping damping[2] = {{100, 1e-8, 1e-5}, {1, 1e-10, 1e-3}};
    const double size = size_of(s, shared);
    double map = natural_map(s, shared), best = map;
    keep_best(s);
#pragma unroll 1
    for (int step = 0; step < steps && best > NCP_AIM && map < INFINITY; ++step) {
        const double last = best;
        const ncp_damping &by = damping[step / NCP_IN_TURN % 2];
        if (!take_step(s, fmin(by.most, fmax(by.least, by.share * map / size)), shared)) break;
        map = natural_map(s, shared);
        if (map < best) keep_best(s);
        best = fmin(best, map);
        if (best < NCP_ENOUGH / 10 && !(best < last / 2)) break; /* what is left is rounding */
    }
    each(s.numbers, [&](int32_t n) {
        s.lambda[n] = s.best_lambda[n];
        s.u[n] = s.best_u[n];
    });
    __syncthreads();
    return best;
}

#endif
