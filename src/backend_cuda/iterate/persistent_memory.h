/* The persistent kernel (persistent.h): what instances there are, the shared memory of a thread block, and how blocks
 * meet. */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_MEMORY_H
#define SADMM_CUDA_ITERATE_PERSISTENT_MEMORY_H

#include "prologue.h"
#include "quad.h"

enum persistent_mode { BLOCK, CLUSTER, GRID };

/* Sizes of blocks an instance is made for: few threads may have all the registers they want, and a single warp needs no
 * barrier (BLOCK alone). WITH_ROWS: of whatever size, with constraints given by rows, which take registers. */
enum block_size { ANY_SIZE, SMALL, ONE_WARP, WITH_ROWS };
template <int SIZE> constexpr bool HAS_ROWS = SIZE == WITH_ROWS;
enum { SMALL_THREADS = sizeof(solver_real) == sizeof(float) ? 512 : 256 };

static constexpr int most_threads(int points, int size)
{
    if (size == ONE_WARP) return WARP;
    if (size == SMALL || (size == WITH_ROWS && sizeof(solver_real) == sizeof(float))) return SMALL_THREADS;
    return sizeof(solver_real) == sizeof(float) ? (points == 4 ? 1024 : 768) : (points == 4 ? 512 : 384);
}

/* Records of a body that are fetched at once, whether it has them or not. */
enum { FETCHED_FIRST = 4 };

/* ---- shared memory --------------------------------------------------------------------------------------------- */

/* Constraints given by rows (persistent_rows.h): rows of a lane, and numbers of a row. */
enum { ROWS_OF_LANE = 2, ROW_NUMBERS = 20 };

/* The most warps of a block that have sides of such constraints. */
static __host__ __device__ inline int most_row_warps(int constraints, int threads)
{
    const int warps = (2 * constraints + WARP / QUAD - 1) / (WARP / QUAD);
    return warps < threads / WARP ? warps : threads / WARP;
}

/* The same in every block of a launch: blocks of a cluster read each other's memory. */
struct part_memory {
    solver_real *state;      /* CLUSTER: of even, then of odd iterations; bodies x ROW each, then a row of 0 */
    solver_real *records;    /* sides x ROW, and FETCHED_FIRST rows that are read and not used */
    solver_real *lines, *b;  /* of bodies beyond one for each eight threads: (bodies - threads / LANES) x line, ROW;
                                FAST: the momentum residual in place of b */
    solver_real *rows;       /* of warps that have rows: ROWS_OF_LANE x ROW_NUMBERS x WARP each */
    int32_t *flags;          /* PART_FLAGS (iterate/prologue.h) */
    /* Before the first iteration and after the last one, over what is above (iterate/prologue.h): */
    double *terms;           /* bodies x TERMS */
    island_range *range;     /* bodies */
};

enum { SLACK = 16 }; /* the end, with what is to come there aligned */
static_assert(PART_FLAGS * sizeof(int32_t) <= SLACK, "flags are the last");

/* One description of the layout for its size and its addresses. */
static __host__ __device__ inline size_t lay_out(part_memory *m, unsigned char *base, bool cluster,
                                                 int row_constraints, int threads, int32_t bodies)
{
    size_t n = (size_t)bodies, sides = (size_t)(threads / QUAD), first = (size_t)(threads / LANES);
    size_t more = n > first ? n - first : 0;
    m->state = (solver_real *)base;
    m->records = m->state + ((cluster ? 2 * n : n) + 1) * ROW;
    m->lines = m->records + (sides + FETCHED_FIRST) * ROW;
    m->b = m->lines + more * LINE_GENERAL;
    m->rows = m->b + more * ROW;
    m->terms = (double *)base;
    m->range = (island_range *)(m->terms + n * TERMS);
    const size_t rows = (size_t)most_row_warps(row_constraints, threads) * ROWS_OF_LANE * ROW_NUMBERS * WARP;
    size_t iterating = ((size_t)(m->rows - m->state) + rows) * sizeof(solver_real),
           around = n * (TERMS * sizeof(double) + sizeof(island_range)), used = iterating > around ? iterating : around;
    m->flags = (int32_t *)(base + used);
    return used + SLACK;
}

/* ---- barriers -------------------------------------------------------------------------------------------------- */

/* Of the block's own. */
template <int SIZE> static __device__ __forceinline__ void block_barrier(void)
{
    if (SIZE == ONE_WARP) __syncwarp((unsigned)ALL_LANES);
    else __syncthreads();
}

/* Between the two sides of a barrier a thread may do what concerns nobody else. */
template <int MODE, int SIZE> static __device__ __forceinline__ void arrive(unsigned *arrivals)
{
#ifdef SADMM_CUDA_EMULATED
    (void)arrivals;
#else
    if (MODE == GRID) {
        /* One thread of a block speaks for it: its release and acquire, with the block's own barriers around them,
         * order every thread's writes before every thread's reads. */
        block_barrier<SIZE>();
        if (threadIdx.x == 0) asm volatile("red.release.gpu.global.add.u32 [%0], 1;" ::"l"(arrivals) : "memory");
    }
#if __CUDA_ARCH__ >= CLUSTER_ARCH
    if (MODE == CLUSTER) asm volatile("barrier.cluster.arrive.release.aligned;" ::: "memory");
#endif
#endif
}

/* `target`: arrivals in all when every block has come. */
template <int MODE, int SIZE> static __device__ __forceinline__ void wait(const unsigned *arrivals, unsigned target)
{
#ifdef SADMM_CUDA_EMULATED
    (void)arrivals;
    (void)target;
    if (MODE == BLOCK) block_barrier<SIZE>();
    else cuda_emulation_barrier_together();
#else
    if (MODE == GRID && threadIdx.x == 0) {
        unsigned now;
        do asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(now) : "l"(arrivals) : "memory");
        while ((int)(now - target) < 0);
    }
    if (MODE != CLUSTER) block_barrier<SIZE>();
#if __CUDA_ARCH__ >= CLUSTER_ARCH
    if (MODE == CLUSTER) asm volatile("barrier.cluster.wait.acquire.aligned;" ::: "memory");
#endif
#endif
}

/* The same address in the shared memory of another block of the cluster. */
static __device__ __forceinline__ const solver_real *in_block(const solver_real *own, unsigned rank)
{
#ifdef SADMM_CUDA_EMULATED
    return (const solver_real *)cuda_emulation_in_block(own, rank);
#elif __CUDA_ARCH__ >= CLUSTER_ARCH
    const solver_real *other;
    asm("mapa.u64 %0, %1, %2;" : "=l"(other) : "l"(own), "r"(rank));
    return other;
#else
    (void)rank;
    return own;
#endif
}

/* Blocks of ANY_SIZE have no registers to spare. */
template <int SIZE>
constexpr bool SPARES_REGISTERS = SIZE != ANY_SIZE && (SIZE != WITH_ROWS || sizeof(solver_real) == sizeof(float));

/* An address in this block's own memory, in a register: to save one the compiler makes it again from its parts in every
 * iteration, and what is loaded from there waits. */
template <int SIZE> static __device__ __forceinline__ solver_real *kept_address(solver_real *own)
{
#ifndef SADMM_CUDA_EMULATED
    if (SPARES_REGISTERS<SIZE>) {
        uint32_t at = (uint32_t)__cvta_generic_to_shared(own);
        asm volatile("" : "+r"(at));
        return (solver_real *)__cvta_shared_to_generic(at);
    }
#endif
    return own;
}

/* A number worked out here, not where it is used: the compiler may not move it past this place. */
#ifdef SADMM_CUDA_EMULATED
template <int SIZE, typename T> static void keep(T *)
{
}
#else
template <int SIZE> static __device__ __forceinline__ void keep(int32_t *number)
{
    if (SPARES_REGISTERS<SIZE>) asm volatile("" : "+r"(*number));
}
template <int SIZE> static __device__ __forceinline__ void keep(float *number)
{
    if (SPARES_REGISTERS<SIZE>) asm volatile("" : "+f"(*number));
}
template <int SIZE> static __device__ __forceinline__ void keep(double *number)
{
    if (SPARES_REGISTERS<SIZE>) asm volatile("" : "+d"(*number));
}
#endif

#endif
