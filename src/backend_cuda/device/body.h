/* A body by its eight lanes, in double: what runs a few times a step and sums over a body's sides. */
#ifndef SADMM_CUDA_DEVICE_BODY_H
#define SADMM_CUDA_DEVICE_BODY_H

#include "lanes.h"
#include "line.h"

#include "core/math/packed6.h"

/* Blocks of few threads: the work of a lane is long, and there are many multiprocessors. */
enum { BODY_THREADS = 64 };

static inline int64_t body_blocks(int32_t bodies)
{
    return ((int64_t)bodies * LANES + BODY_THREADS - 1) / BODY_THREADS;
}

/* Which body a thread is about. */
struct body_thread {
    int32_t slot, lane;
    bool live;
    size_t body; /* raw */
    int32_t begin, end; /* places of its sides */
};

static __device__ __forceinline__ body_thread body_of_slot(const graph_view &graph, int32_t slot, bool live)
{
    const body_thread out = {slot, (int32_t)threadIdx.x % LANES, live, live ? (size_t)graph.body_of[slot] : 0,
                             live ? graph.offsets[slot] : 0, live ? graph.offsets[slot + 1] : 0};
    return out;
}

static __device__ __forceinline__ body_thread body_of_thread(const model_view &model, const graph_view &graph)
{
    const int32_t t = (int32_t)(blockIdx.x * (unsigned)BODY_THREADS + threadIdx.x), slot = t / LANES;
    return body_of_slot(graph, slot, slot < live_bodies(model));
}

/* What a body's lane r < 6 has of it: rows r of A and A^-1, components r of v and b; 0 in the others. RIGID: of the
 * rows what is in the block of 3 x 3 on the diagonal, the rest is 0. */
template <bool RIGID> struct wide_row {
    double a[RIGID ? 3 : 6], a_inverse[RIGID ? 3 : 6], velocity, b;
};

template <bool RIGID>
static __device__ __forceinline__ wide_row<RIGID> row_of_body(const body_view &bodies, const body_thread &t)
{
    wide_row<RIGID> row = {};
    if (!t.live || t.lane >= 6) return row;
    const solver_real *line = bodies.lines + t.body * (size_t)bodies.line;
    const double *inverse = bodies.A_inverse + t.body * PACKED;
    if (RIGID) {
        const int32_t r = t.lane % 3;
#pragma unroll
        for (int k = 0; k < 3;
             ++k) { /* fetched in any case: what a lane fetches under a condition is waited for one by one */
            const bool turns = t.lane >= 3, on = turns || k == r;
            const double a = (double)line[turns ? 1 + packed_place(r, k) : 0],
                         a_inverse = inverse[turns ? packed_place(r + 3, k + 3) : 0];
            row.a[k] = on ? a : 0;
            row.a_inverse[k] = on ? a_inverse : 0;
        }
    } else {
#pragma unroll
        for (int k = 0; k < (RIGID ? 3 : 6); ++k) {
            row.a[k] = (double)line_a(line, bodies.rigid, t.lane, k);
            row.a_inverse[k] = inverse[packed_place(t.lane, k)];
        }
    }
    row.velocity = (double)bodies.state[t.body * ROW + (size_t)t.lane];
    row.b = (double)bodies.b[t.body * ROW + (size_t)t.lane];
    return row;
}

/* x[lane], of six numbers; 0 in the other lanes. */
static __device__ __forceinline__ double own_number(const double *x, int32_t lane)
{
    double own = 0;
#pragma unroll
    for (int k = 0; k < 6; ++k)
        if (k == lane) own = x[k];
    return own;
}

#endif
