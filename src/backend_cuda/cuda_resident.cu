/* The fused iteration as one kernel whose state stays on the chip: tiers BLOCK and GRID (cuda_internal.h).
 *
 * A thread block owns a part: bodies, pairs (at most one a thread) and row blocks. Through all iterations a thread
 * keeps its pair in registers, and shared memory holds the bodies' factors and their lists. What parts exchange
 * differs:
 *   BLOCK  parts are whole islands and exchange nothing: velocities and records are in shared memory too;
 *   GRID   velocities and records are in global memory, and a barrier over the grid ends each half of an iteration. The
 *          launch is cooperative, so that every block runs and the spinning ends.
 * Row blocks read their Jacobians from memory (six rows on two bodies are more than registers hold).
 *
 * On entry and exit everything is in global memory as the stepwise kernels leave it.
 */
#include "cuda_sweep.h"

/* Where a part begins; it ends where the next one begins. */
struct part {
    int32_t body, pair, row;
};

/* ---- shared memory --------------------------------------------------------------------------------------------- */

struct part_memory {
    solver_real *A, *H, *b;       /* bodies x MATRIX, MATRIX, ROW */
    solver_real *state, *records; /* BLOCK: (bodies + 1) x ROW, (pairs + rows) x RECORD */
    int32_t *offsets, *incident;  /* bodies + 1; BLOCK: records count from the part's first */
};

/* One description of the layout for its size and its addresses. */
static __host__ __device__ inline size_t lay_out(part_memory *m, unsigned char *base, int32_t bodies, int32_t pairs,
                                                 int32_t rows, int32_t incident, bool grid)
{
    size_t n = (size_t)bodies, records = grid ? 0 : (size_t)(pairs + rows) * RECORD, state = grid ? 0 : (n + 1) * ROW;
    solver_real *next = (solver_real *)base;
    m->A = next;
    m->H = m->A + n * MATRIX;
    m->b = m->H + n * MATRIX;
    m->state = m->b + n * ROW;
    m->records = m->state + state;
    m->offsets = (int32_t *)(m->records + records);
    m->incident = m->offsets + n + 1;
    return (n * (2 * MATRIX + ROW) + state + records) * sizeof(solver_real) +
           (n + 1 + (size_t)incident) * sizeof(int32_t);
}

size_t CUDA(resident_shared)(int32_t bodies, int32_t pairs, int32_t rows, int32_t incident, bool grid)
{
    part_memory unused;
    return lay_out(&unused, nullptr, bodies, pairs, rows, incident, grid);
}

/* ---- barrier --------------------------------------------------------------------------------------------------- */

/* Every block arrives `target` / blocks times. One thread of a block speaks for it: its release and acquire, with the
 * block's own barriers around them, order every thread's writes before every thread's reads. */
static __device__ __forceinline__ void grid_barrier(unsigned *arrivals, unsigned target)
{
#ifdef SADMM_CUDA_EMULATED
    (void)arrivals;
    (void)target;
    cuda_emulation_grid_barrier();
#else
    __syncthreads();
    if (threadIdx.x == 0) {
        unsigned now;
        __threadfence();
        asm volatile("red.release.gpu.global.add.u32 [%0], 1;" ::"l"(arrivals) : "memory");
        do asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(now) : "l"(arrivals) : "memory");
        while ((int)(now - target) < 0);
        __threadfence();
    }
    __syncthreads();
#endif
}

/* ---- pairs in registers ---------------------------------------------------------------------------------------- */

template <int POINTS> struct resident_pair {
    pair_data pair;
    vec3 arm[POINTS], lambda[POINTS];
    real error[POINTS];
};

template <int CONTACT_ROWS, int POINTS>
static __device__ __forceinline__ void load_resident(resident_pair<POINTS> *own, const cuda_view &v, int32_t p)
{
    own->pair = load_pair(v, p);
#pragma unroll
    for (int k = 0; k < POINTS; ++k) {
        if (k >= own->pair.count) continue;
        size_t slot = (size_t)k * (size_t)v.pair_room + (size_t)p;
        real4 arm = v.arm[slot];
        own->arm[k] = xyz(arm);
        own->error[k] = arm.w;
        own->lambda[k] = load_lambda<CONTACT_ROWS>(v, slot);
    }
}

template <int CONTACT_ROWS, int POINTS>
static __device__ __forceinline__ void store_resident(const resident_pair<POINTS> &own, const cuda_view &v, int32_t p)
{
#pragma unroll
    for (int k = 0; k < POINTS; ++k)
        if (k < own.pair.count) store_lambda<CONTACT_ROWS>(v, (size_t)k * (size_t)v.pair_room + (size_t)p, own.lambda[k]);
}

template <int CONTACT_ROWS, int POINTS, bool MEASURE>
static __device__ __forceinline__ void sweep_resident(resident_pair<POINTS> *own, const solver_real *state,
                                                      solver_real *record, solver_real *change, double *primal)
{
    pair_motion motion = relative_motion(own->pair, state);
    pair_sums sums = no_sums();
#pragma unroll
    for (int k = 0; k < POINTS; ++k) {
        if (k >= own->pair.count) continue;
        vec3 old = own->lambda[k];
        vec3 lambda = update_point<CONTACT_ROWS>(own->pair, motion, own->arm[k], own->error[k], old);
        own->lambda[k] = lambda;
        add_point<CONTACT_ROWS, MEASURE>(own->pair, own->arm[k], lambda, old, &sums);
    }
    store_record(record, sums.next, own->pair.difference);
    if (MEASURE) {
        store_record(change, sums.change, own->pair.difference);
        *primal = (double)(sums.largest * motion.inv_beta);
    }
}

/* ---- the kernel ------------------------------------------------------------------------------------------------ */

template <int CONTACT_ROWS, int POINTS, bool GRID>
static __global__ void __launch_bounds__(THREADS)
    resident_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    CUDA_DYNAMIC_SHARED(memory);
    const part begin = ((const part *)v.parts)[blockIdx.x], end = ((const part *)v.parts)[blockIdx.x + 1];
    const int32_t bodies = end.body - begin.body, pairs = end.pair - begin.pair, rows = end.row - begin.row;
    const int32_t first_incident = v.offsets[begin.body], incident = v.offsets[end.body] - first_incident;
    const int32_t t = (int32_t)threadIdx.x;
    part_memory m;
    lay_out(&m, memory, bodies, pairs, rows, incident, GRID);

    /* Where velocities and records are, and how this part's bodies are numbered there. */
    solver_real *const state = GRID ? v.state : m.state;
    solver_real *const own_records = GRID ? v.records + (size_t)begin.pair * RECORD : m.records;
    solver_real *const row_records = GRID ? v.records + ((size_t)v.pair_room + (size_t)begin.row) * RECORD
                                          : m.records + (size_t)pairs * RECORD;
    const solver_real *const records = GRID ? v.records : m.records;
    solver_real *const own_state = GRID ? v.state + (size_t)begin.body * ROW : m.state;
    unsigned arrivals = 0;

    for (int32_t i = t; i < bodies * MATRIX; i += THREADS) {
        m.A[i] = v.A[(size_t)begin.body * MATRIX + (size_t)i];
        m.H[i] = v.H[(size_t)begin.body * MATRIX + (size_t)i];
    }
    for (int32_t i = t; i < bodies * ROW; i += THREADS) m.b[i] = v.b[(size_t)begin.body * ROW + (size_t)i];
    for (int32_t i = t; i <= bodies; i += THREADS) m.offsets[i] = v.offsets[begin.body + i] - first_incident;
    for (int32_t i = t; i < incident; i += THREADS) {
        int32_t half = v.incident[first_incident + i];
        if (!GRID) half -= half < 2 * v.pair_room ? 2 * begin.pair : 2 * (v.pair_room - pairs + begin.row);
        m.incident[i] = half;
    }
    if (!GRID) {
        for (int32_t i = t; i < (bodies + 1) * ROW; i += THREADS)
            m.state[i] = i < bodies * ROW ? v.state[(size_t)begin.body * ROW + (size_t)i] : (solver_real)0;
    }
    /* The records of this part: copied (BLOCK), and joined after a measured iteration. */
    if (!GRID || args.join) {
        for (int32_t i = t; i < (pairs + rows) * RECORD; i += THREADS) {
            bool of_pair = i < pairs * RECORD;
            size_t from = of_pair ? (size_t)begin.pair * RECORD + (size_t)i
                                  : ((size_t)v.pair_room + (size_t)begin.row) * RECORD + (size_t)(i - pairs * RECORD);
            solver_real value = v.records[from];
            if (args.join) value += args.ratio * v.change[from];
            (of_pair ? own_records : row_records - pairs * RECORD)[i] = value;
        }
        if (GRID) grid_barrier(v.barrier, arrivals += gridDim.x);
    }

    resident_pair<POINTS> own = {};
    const int32_t p = begin.pair + t;
    if (t < pairs) {
        load_resident<CONTACT_ROWS, POINTS>(&own, v, p);
        if (!GRID) {
            own.pair.body_a = own.pair.body_a == v.bodies ? bodies : own.pair.body_a - begin.body;
            own.pair.body_b = own.pair.body_b == v.bodies ? bodies : own.pair.body_b - begin.body;
        }
    }
    __syncthreads();

    const int32_t r = t % LANES;
    for (int32_t iteration = 1;; ++iteration) {
        for (int32_t first = 0; first < bodies; first += THREADS / LANES) {
            int32_t i = first + t / LANES;
            bool live = i < bodies;
            int32_t at = live ? i : 0;
            update_body<false>(live, r, m.b + at * ROW, m.A + at * MATRIX, m.H + at * MATRIX, records, nullptr, 0,
                               m.incident, m.offsets[at], m.offsets[at + 1], own_state + at * ROW);
        }
        if (GRID) grid_barrier(v.barrier, arrivals += gridDim.x);
        else __syncthreads();

        const bool last = iteration == args.count;
        if (last && args.measure) {
            double primal = 0;
            if (t < pairs)
                sweep_resident<CONTACT_ROWS, POINTS, true>(&own, state, own_records + t * RECORD,
                                                           v.change + (size_t)p * RECORD, &primal);
            for (int32_t k = t; k < rows; k += THREADS) {
                row_about about = v.row_info[begin.row + k];
                if (!GRID) {
                    about.body_a = about.body_a == v.bodies ? bodies : about.body_a - begin.body;
                    about.body_b = about.body_b == v.bodies ? bodies : about.body_b - begin.body;
                }
                sweep_row_block<true>(v, begin.row + k, about, state, about.body_a, about.body_b,
                                      row_records + k * RECORD,
                                      v.change + ((size_t)v.pair_room + (size_t)(begin.row + k)) * RECORD, &primal);
            }
            reduce_max(primal, v.residual);
        } else {
            if (t < pairs)
                sweep_resident<CONTACT_ROWS, POINTS, false>(&own, state, own_records + t * RECORD, nullptr, nullptr);
            for (int32_t k = t; k < rows; k += THREADS) {
                row_about about = v.row_info[begin.row + k];
                if (!GRID) {
                    about.body_a = about.body_a == v.bodies ? bodies : about.body_a - begin.body;
                    about.body_b = about.body_b == v.bodies ? bodies : about.body_b - begin.body;
                }
                sweep_row_block<false>(v, begin.row + k, about, state, about.body_a, about.body_b,
                                       row_records + k * RECORD, nullptr, nullptr);
            }
        }
        if (last) break;
        if (GRID) grid_barrier(v.barrier, arrivals += gridDim.x);
        else __syncthreads();
    }

    if (t < pairs) store_resident<CONTACT_ROWS, POINTS>(own, v, p);
    if (!GRID) {
        __syncthreads();
        for (int32_t i = t; i < bodies * ROW; i += THREADS) v.state[(size_t)begin.body * ROW + (size_t)i] = m.state[i];
        for (int32_t i = t; i < (pairs + rows) * RECORD; i += THREADS) {
            size_t to = i < pairs * RECORD
                            ? (size_t)begin.pair * RECORD + (size_t)i
                            : ((size_t)v.pair_room + (size_t)begin.row) * RECORD + (size_t)(i - pairs * RECORD);
            v.records[to] = m.records[i];
        }
    }
}

/* ---- instances ------------------------------------------------------------------------------------------------- */

struct instance {
    int contact_rows, points;
    bool grid;
    cuda_kernel kernel;
    const char *name;
};

#define INSTANCE(rows, points, grid, name) {rows, points, grid, resident_kernel<rows, points, grid>, name}
/* Boxes on boxes touch in up to 8 points, mostly 4: with 4 a thread needs half the registers. */
static const instance instances[] = {
    INSTANCE(3, 4, false, "iterate (block, 3 rows, 4 points)"),
    INSTANCE(3, 8, false, "iterate (block, 3 rows, 8 points)"),
    INSTANCE(1, 4, false, "iterate (block, 1 row, 4 points)"),
    INSTANCE(1, 8, false, "iterate (block, 1 row, 8 points)"),
    INSTANCE(3, 4, true, "iterate (grid, 3 rows, 4 points)"),
    INSTANCE(3, 8, true, "iterate (grid, 3 rows, 8 points)"),
    INSTANCE(1, 4, true, "iterate (grid, 1 row, 4 points)"),
    INSTANCE(1, 8, true, "iterate (grid, 1 row, 8 points)"),
};

cuda_kernel CUDA(resident_kernel)(int contact_rows, int point_slots, bool grid, const char **name)
{
    int rows = contact_rows == 1 ? 1 : 3, points = point_slots <= 4 ? 4 : 8;
    for (const instance &one : instances)
        if (one.contact_rows == rows && one.points == points && one.grid == grid) {
            *name = one.name;
            return one.kernel;
        }
    return nullptr;
}

cudaError_t CUDA(resident_allow)(int bytes)
{
    for (const instance &one : instances) {
        cudaError_t code =
            cudaFuncSetAttribute((const void *)one.kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes);
        if (code != cudaSuccess) return code;
    }
    return cudaSuccess;
}
