/* Semismooth Newton steps on the natural maps of a dense problem, by a thread block (core/solve/ncp_newton.h). */
#ifndef SADMM_CUDA_STEP_NCP_NEWTON_H
#define SADMM_CUDA_STEP_NCP_NEWTON_H

#include "core/math/solve_rounding.h"
#include "ncp_island.h"

/* m/s: what steps aim at. */
#define NCP_AIM 1e-12

/* What is added to the diagonal of a step's matrix, whose entries are shares of a law's own response: `share` of the
 * natural map, by the size of velocities, within bounds (core/solve/ncp_newton.c). */
enum { NCP_FROM_START = 20, NCP_FROM_INSIDE = 100, NCP_IN_TURN = 50 };
struct ncp_damping {
    double share, least, most;
};

/* Multiplications that a thread may do for an island in search of its solution: what takes more is iterated, which is
 * cheaper then. Without so many steps a search is not begun. */
#define NCP_BUDGET 6e4
enum { NCP_LEAST_STEPS = 8 }; /* and so many a warp makes at most */
static __device__ __forceinline__ double elimination_of(int32_t numbers)
{
    return (double)numbers * numbers * numbers / 2 / ncp_threads();
}
static __device__ __forceinline__ bool affords(double *budget, double multiplications)
{
    *budget -= multiplications;
    return *budget >= 0;
}

/* Pi(y) of a law, and its derivative (core/solve/ncp_dense.c). */
static __device__ __noinline__ void project_law(const ncp_law &law, const double y[3], double to[3], double D[9])
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
static __device__ __noinline__ double natural_map_of(const ncp_law &law, const double *lambda, const double *u)
{
    double y[3] = {0, 0, 0}, to[3], D[9], sum = 0;
    for (int k = 0; k < law.count; ++k) y[k] = lambda[k] - u[k] / law.response;
    project_law(law, y, to, D);
    for (int k = 0; k < law.count; ++k) sum += (lambda[k] - to[k]) * (lambda[k] - to[k]);
    return sqrt(sum) * law.response;
}

/* Where laws have their numbers: how far that is, to s.step; which are not fixed by them, to s.pivot; derivatives.
 * Returns the natural map. */
static __device__ __noinline__ double look_at_laws(const ncp_island &s, ncp_shared *shared)
{
    double own = 0;
    each(s.laws, [&](int32_t i) {
        const ncp_law &law = s.law[i];
        double y[3] = {0, 0, 0}, to[3], D[9], sum = 0;
        for (int k = 0; k < law.count; ++k)
            y[k] = s.lambda[law.first + k] - s.u[law.first + k] / law.response;
        project_law(law, y, to, D);
#pragma unroll
        for (int k = 0; k < 3; ++k) {
            if (k >= law.count) continue;
            const double step = to[k] - s.lambda[law.first + k];
            sum += step * step;
            s.step[law.first + k] = step;
            s.pivot[law.first + k] = D[3 * k] != 0 || D[3 * k + 1] != 0 || D[3 * k + 2] != 0;
        }
        for (int k = 0; k < 9; ++k) s.D[9 * i + k] = D[k];
        const double map = sqrt(sum) * law.response;
        if (!(map <= own)) own = map;
    });
    return most_of(own, shared);
}

/* What the natural map is a share of: the largest speed, m/s, or load times response. */
static __device__ __noinline__ double size_of(const ncp_island &s, ncp_shared *shared)
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

/* Numbers that their law fixes go where it has them (look_at_laws); the others are listed, to be solved for. */
static __device__ __noinline__ int32_t sort_numbers(const ncp_island &s, ncp_shared *shared)
{
    const int32_t count = make_list(s.numbers, s.list, &shared->count, [&](int32_t n) { return s.pivot[n] != 0; });
    each(s.numbers, [&](int32_t r) { /* what those that are fixed move */
        double sum = 0;
        for (int32_t n = 0; n < s.numbers; ++n)
            if (!s.pivot[n]) sum += s.G[r * s.stride + n] * s.step[n];
        s.moved[r] = sum;
    });
    ncp_barrier();
    return count;
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
        else sum += share * s.G[(law.first + h) * s.stride + s.list[c]];
    }
    if (c == count) return sum;
    const int32_t h = s.list[c] - law.first;
    if (h >= 0 && h < law.count) sum += (h == k) - D[h];
    return c == i ? sum + proximal : sum;
}

/* The row of column k's pivot among those that have none yet, by the first warp; -1: there is none. The largest entry,
 * but for what its first bits do not tell. */
enum { NCP_ROW_BITS = 9 };
static_assert(NCP_NUMBERS < 1 << NCP_ROW_BITS, "a row is a part of a key");
static __device__ __forceinline__ void choose_pivot(const ncp_island &s, int32_t count, int32_t stride, int32_t k,
                                                    ncp_shared *shared)
{
    const unsigned rows = (1u << NCP_ROW_BITS) - 1;
    if (ncp_thread() >= WARP) return;
    unsigned key = 0;
    for (int32_t i = ncp_thread(); i < count; i += WARP) {
        const double entry = fabs(s.M[i * stride + k]);
        const unsigned size = (unsigned)((unsigned long long)__double_as_longlong(entry) >> 32) & ~rows,
                       own = size | (rows - (unsigned)i);
        if (s.pivot[i] < 0 && entry > 0 && own > key) key = own;
    }
#pragma unroll
    for (int o = WARP / 2; o > 0; o /= 2) {
        const unsigned other = __shfl_xor_sync((unsigned)ALL_LANES, key, o);
        key = other > key ? other : key;
    }
    if (ncp_thread() == 0) {
        const int32_t row = key == 0 ? -1 : (int32_t)(rows - (key & rows));
        shared->pivot = row;
        if (row >= 0) s.pivot[row] = k;
    }
}

/* Rows of a step's matrix, and their right sides. */
static __device__ __forceinline__ int32_t stride_of(int32_t count) { return (count + 1) | 1; }

/* M x = right by Gauss and Jordan's elimination, to `step`. False: singular. */
static __device__ __noinline__ bool solve_step(const ncp_island &s, int32_t count, ncp_shared *shared)
{
    const int32_t stride = stride_of(count);
    each(count, [&](int32_t i) { s.pivot[i] = -1; });
    ncp_barrier();
#pragma unroll 1
    for (int32_t k = 0; k < count; ++k) {
        choose_pivot(s, count, stride, k, shared);
        ncp_barrier();
        const int32_t p = shared->pivot;
        if (p < 0) return false;
        const double inverse = 1 / s.M[p * stride + k];
        each_entry(count, count - k, [&](int32_t i, int32_t c) {
            if (i != p) s.M[i * stride + k + 1 + c] -= s.M[i * stride + k] * inverse * s.M[p * stride + k + 1 + c];
        });
        ncp_barrier();
    }
    each(count, [&](int32_t i) {
        const int32_t k = s.pivot[i];
        s.step[s.list[k]] = s.M[i * stride + count] / s.M[i * stride + k];
    });
    ncp_barrier();
    return true;
}

/* budget: multiplications of a thread that are left. */
static __device__ __noinline__ bool take_step(const ncp_island &s, double proximal, double *budget, ncp_shared *shared)
{
    const int32_t count = sort_numbers(s, shared), stride = stride_of(count);
    if (!affords(budget, elimination_of(count))) return false;
    each_entry(count, count + 1,
               [&](int32_t i, int32_t c) { s.M[i * stride + c] = step_entry(s, count, i, c, proximal); });
    ncp_barrier();
    if (!solve_step(s, count, shared)) return false;
    each(s.numbers, [&](int32_t r) {
        double sum = 0;
        for (int32_t n = 0; n < s.numbers; ++n) sum += s.G[r * s.stride + n] * s.step[n];
        s.u[r] += sum;
        s.lambda[r] += s.step[r];
    });
    ncp_barrier();
    return true;
}

static __device__ __forceinline__ void keep_best(const ncp_island &s)
{
    each(s.numbers, [&](int32_t n) {
        s.best_lambda[n] = s.lambda[n];
        s.best_u[n] = s.u[n];
    });
    ncp_barrier();
}

/* Full steps: on the way to the right pieces of laws the map may grow. lambda, u: the best there was; returns its
 * map. *ended: no more steps would be made, if there were some left. */
static __device__ __noinline__ double take_steps(const ncp_island &s, int steps, double *budget, ncp_shared *shared,
                                                 bool *ended)
{
    const ncp_damping damping[2] = {{100, 1e-8, 1e-5}, {1, 1e-10, 1e-3}};
    const double size = size_of(s, shared);
    double map = look_at_laws(s, shared), best = map;
    keep_best(s);
    int step = 0;
#pragma unroll 1
    for (; step < steps && best > NCP_AIM && map < INFINITY; ++step) {
        const double last = best;
        const ncp_damping &by = damping[step / NCP_IN_TURN % 2];
        if (!take_step(s, fmin(by.most, fmax(by.least, by.share * map / size)), budget, shared)) {
            if (*budget < 0) step = steps;
            break;
        }
        map = look_at_laws(s, shared);
        if (map < best) keep_best(s);
        best = fmin(best, map);
        if (best < NCP_ENOUGH / 10 && !(best < last / 2)) break; /* what is left is rounding */
    }
    each(s.numbers, [&](int32_t n) {
        s.lambda[n] = s.best_lambda[n];
        s.u[n] = s.best_u[n];
    });
    ncp_barrier();
    *ended = step < steps;
    return best;
}

#endif
