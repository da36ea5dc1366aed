/* What an iteration takes in each tier on the device at hand: iterate/partition.cu chooses by it.
 *
 * A probe stands for the persistent kernel (persistent.h): sides and bodies with its arithmetic, accesses and barriers,
 * and numbers that are all 0. Its times with few sides and with many, in clusters of two sizes and on the whole grid
 * give floors and slopes. How they compare to the same on an H200 is by how much the kernel's own times, which were
 * found there by runs of scenes, differ on this device. That takes 10 ms, once a process, device and precision. */
#include <algorithm>
#include <mutex>

#include "iterate.h"
#include "persistent_memory.h"

/* On an H200: of the kernel, in f32, which stands where nothing can be measured; below, of the probe. */
static const cuda_timings of_kernel = {350, 580, 8, 1900, 3, 1375};

#ifndef SADMM_CUDA_EMULATED

static const cuda_timings of_probe = sizeof(solver_real) == sizeof(float)
                                         ? cuda_timings{217, 419, 8, 1309, 2.5, 1192}
                                         : cuda_timings{377, 595, 5.8, 1465, 4, 1194};

enum { FEW_THREADS = 64, CLUSTER_THREADS = 256, FEW_BLOCKS = 2, MANY_BLOCKS = 16 };
enum { PROBE_BODIES = SMALL_THREADS / LANES };
enum { SHORT = 100, LONG = 500, REPEATS = 3, KERNELS = 40 };

/* Each body has two sides; on their other sides are bodies of the next block, or of this one. */
template <int MODE>
static __global__ void __launch_bounds__(SMALL_THREADS, 1)
    probe_kernel(solver_real *exchange, unsigned *arrivals, int iterations, unsigned cluster)
{
    __shared__ __align__(16) solver_real state[2 * PROBE_BODIES * ROW],
        records[(2 * PROBE_BODIES + FETCHED_FIRST) * ROW];
    const int32_t t = (int32_t)threadIdx.x, r = t % LANES, lane = t % QUAD, side = t / QUAD, body = t / LANES;
    const int32_t bodies = (int32_t)blockDim.x / LANES, next = (body + 1) % bodies;
    const size_t blocks = gridDim.x, here = blockIdx.x;
    const size_t half = blocks * PROBE_BODIES * ROW;
    for (int32_t i = t; i < 2 * PROBE_BODIES * ROW; i += (int32_t)blockDim.x) state[i] = exchange[i];
    for (int32_t i = t; i < (2 * PROBE_BODIES + FETCHED_FIRST) * ROW; i += (int32_t)blockDim.x)
        records[i] = exchange[i % ROW];
    /* All 0, which the compiler does not know. */
    const solver_real *numbers = exchange + t % WARP * ROW;
    const vec3 normal = v3(numbers[0], numbers[1], numbers[2]), own_arm = v3(numbers[3], numbers[4], numbers[5]),
               other_arm = v3(numbers[6], numbers[7], numbers[8]);
    const real friction = numbers[9], error = numbers[10], inv_s = numbers[11];
    /* As in a world, neighbours are in several blocks. */
    const size_t there = (here + 1 + (size_t)body) % blocks;
    const solver_real *other = state + next * ROW;
    if (MODE == CLUSTER) other = in_block(other, (unsigned)(there % cluster));
    if (MODE == GRID) other = exchange + (there * PROBE_BODIES + (size_t)next) * ROW;
    body_lane own = {};
    for (int k = 0; k < 6; ++k) {
        own.A[k] = numbers[12 + k];
        own.H[k] = numbers[18 + k];
    }
    const int32_t count = 2 + (int32_t)friction; /* records of the body, of those fetched */
    vec3 lambda = normal;
    unsigned target = 0;
    if (MODE == CLUSTER) {
        arrive<MODE, SMALL>(arrivals);
        wait<MODE, SMALL>(arrivals, 0);
    }
    block_barrier<SMALL>();
    for (int i = 0; i < iterations; ++i) {
        const int32_t odd = i & 1;
        const body_motion mine = load_motion(state + ((MODE == CLUSTER && odd ? PROBE_BODIES : 0) + body) * ROW),
                          others = load_motion(other + (MODE == BLOCK || !odd ? (size_t)0
                                                        : MODE == CLUSTER     ? (size_t)PROBE_BODIES * ROW
                                                                              : half));
        const vec3 x = relative_velocity(others, other_arm, mine, own_arm);
        const point_change to = update<true>(normal, friction, x, error, inv_s, lambda);
        lambda = relaxed(lambda, to, odd != 0, friction);
        *(real2_pair *)(records + side * ROW + quad_slot(lane)) =
            sum_quad(lane, to.delta, fused_cross(own_arm, to.delta));
        block_barrier<SMALL>();
        real first[FETCHED_FIRST], sum = 0;
        for (int k = 0; k < FETCHED_FIRST; ++k)
            first[k] = records[(2 * body + k) * ROW + record_slot(r < 6 ? r : 0)];
        for (int k = 0; k < FETCHED_FIRST; ++k)
            if (k < count) sum += first[k];
        const real gone = step_fast(&own, sum, friction);
        if (r < 6) {
            state[((MODE == CLUSTER && !odd ? PROBE_BODIES : 0) + body) * ROW + r] = own.v;
            if (MODE == GRID)
                exchange[(odd ? 0 : half) + (here * PROBE_BODIES + (size_t)body) * ROW + (size_t)r] = own.v;
        }
        arrive<MODE, SMALL>(arrivals);
        own.b = residual_after(own, sum, gone, friction);
        wait<MODE, SMALL>(arrivals, target += gridDim.x);
    }
    if (MODE == CLUSTER) { /* no block may read this one's memory once it is gone */
        arrive<MODE, SMALL>(arrivals);
        wait<MODE, SMALL>(arrivals, 0);
    }
    /* All 0: nobody writes, and the compiler has to work it out. */
    if (lambda.x + lambda.y + lambda.z + own.b + own.v != 0) exchange[t] = lambda.x;
}

/* A kernel of STREAM finds a body's records through the graph: loads that wait for each other. */
static __global__ void chain_kernel(solver_real *exchange, const unsigned *arrivals)
{
    unsigned at = arrivals[0];
    at = ((const volatile unsigned *)exchange)[at];
    at = ((const volatile unsigned *)exchange)[at];
    if (at == 0) exchange[threadIdx.x] = 0;
}

struct probe {
    cudaStream_t stream;
    cudaEvent_t from, to;
    solver_real *exchange;
    unsigned *arrivals;
    cudaError_t code; /* the first one that is no success */

    void call(cudaError_t result)
    {
        if (code == cudaSuccess) code = result;
    }

    /* Nanoseconds of what is enqueued. */
    template <class Enqueue> double time(Enqueue enqueue)
    {
        float milliseconds = 0;
        call(cudaEventRecord(from, stream));
        call(enqueue());
        call(cudaEventRecord(to, stream));
        if (code == cudaSuccess) call(cudaEventSynchronize(to));
        if (code == cudaSuccess) call(cudaEventElapsedTime(&milliseconds, from, to));
        return 1e6 * (double)milliseconds;
    }

    /* Nanoseconds of an iteration. */
    template <int MODE> double iteration(int blocks, int threads)
    {
        cudaLaunchAttribute attribute = {};
        cudaLaunchConfig_t launch = {};
        launch.gridDim = dim3((unsigned)blocks);
        launch.blockDim = dim3((unsigned)threads);
        launch.stream = stream;
        launch.attrs = &attribute;
        launch.numAttrs = MODE == BLOCK ? 0 : 1;
        if (MODE == CLUSTER) {
            attribute.id = cudaLaunchAttributeClusterDimension;
            attribute.val.clusterDim.x = (unsigned)blocks;
            attribute.val.clusterDim.y = attribute.val.clusterDim.z = 1;
        } else {
            attribute.id = cudaLaunchAttributeCooperative;
            attribute.val.cooperative = 1;
        }
        double best[2] = {INFINITY, INFINITY};
        for (int k = 0; k < 2 * (1 + REPEATS); ++k) { /* the first of each loads the kernel */
            call(cudaMemsetAsync(arrivals, 0, sizeof *arrivals, stream));
            const double took = time([&] {
                return cudaLaunchKernelEx(&launch, probe_kernel<MODE>, exchange, arrivals,
                                          k % 2 ? (int)LONG : (int)SHORT, (unsigned)blocks);
            });
            if (k >= 2) best[k % 2] = std::min(best[k % 2], took);
        }
        return (best[1] - best[0]) / (LONG - SHORT);
    }

    /* Nanoseconds of a kernel of a graph that waits for the one before. */
    double kernel(void)
    {
        cudaGraph_t graph = nullptr;
        cudaGraphExec_t ready = nullptr;
        call(cudaMemsetAsync(arrivals, 0, sizeof *arrivals, stream));
        call(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
        if (code != cudaSuccess) return 0;
        for (int k = 0; k < KERNELS; ++k) chain_kernel<<<1, WARP, 0, stream>>>(exchange, arrivals);
        call(cudaStreamEndCapture(stream, &graph));
        if (code == cudaSuccess) call(cudaGraphInstantiate(&ready, graph, 0));
        double best = INFINITY;
        for (int k = 0; code == cudaSuccess && k < 1 + REPEATS; ++k) {
            const double took = time([&] { return cudaGraphLaunch(ready, stream); });
            if (k > 0) best = std::min(best, took);
        }
        if (ready) (void)cudaGraphExecDestroy(ready);
        if (graph) (void)cudaGraphDestroy(graph);
        return best / KERNELS;
    }
};

/* What the probe takes. false: something failed. */
static bool measure(const struct sadmm_context *c, cuda_timings *out)
{
    const int blocks = std::max(c->multiprocessors, (int)MANY_BLOCKS);
    const size_t bytes = 2 * (size_t)blocks * PROBE_BODIES * ROW * sizeof(solver_real);
    probe p = {c->stream, nullptr, nullptr, nullptr, nullptr, cudaSuccess};
    p.call(cudaEventCreate(&p.from));
    p.call(cudaEventCreate(&p.to));
    p.call(cudaMalloc(&p.exchange, bytes));
    p.call(cudaMalloc(&p.arrivals, sizeof *p.arrivals));
    if (p.code == cudaSuccess) p.call(cudaMemsetAsync(p.exchange, 0, bytes, c->stream));
    if (p.code == cudaSuccess) {
        const double few = p.iteration<BLOCK>(1, FEW_THREADS), many = p.iteration<BLOCK>(1, SMALL_THREADS),
                     sides = FEW_THREADS / QUAD;
        out->side = (many - few) / ((SMALL_THREADS - FEW_THREADS) / QUAD);
        out->block = few - out->side * sides;
        if (c->clusters) {
            p.call(cudaFuncSetAttribute(probe_kernel<CLUSTER>, cudaFuncAttributeNonPortableClusterSizeAllowed, 1));
            /* With tens of sides a block, as clusters have them: what blocks read of each other takes its time, too. */
            const double small = p.iteration<CLUSTER>(FEW_BLOCKS, CLUSTER_THREADS),
                         large = p.iteration<CLUSTER>(MANY_BLOCKS, CLUSTER_THREADS);
            out->member = std::max((large - small) / (MANY_BLOCKS - FEW_BLOCKS), 0.0);
            out->cluster = small - FEW_BLOCKS * out->member - out->side * (CLUSTER_THREADS / QUAD);
        }
        if (c->cooperative)
            out->grid = p.iteration<GRID>(c->multiprocessors, FEW_THREADS) - out->side * sides;
        out->kernel = p.kernel();
    }
    if (p.exchange) (void)cudaFree(p.exchange);
    if (p.arrivals) (void)cudaFree(p.arrivals);
    if (p.from) (void)cudaEventDestroy(p.from);
    if (p.to) (void)cudaEventDestroy(p.to);
    (void)cudaGetLastError();
    return p.code == cudaSuccess && out->side > 0 && out->block > 0 && out->cluster > 0 && out->grid > 0 &&
           out->kernel > 0;
}

static cuda_timings timings_of(const struct sadmm_context *c)
{
    cuda_timings probed = of_probe, out = of_kernel;
    if (!measure(c, &probed)) return out;
    out.block *= probed.block / of_probe.block;
    out.cluster *= probed.cluster / of_probe.cluster;
    out.member *= probed.member / of_probe.member;
    out.grid *= probed.grid / of_probe.grid;
    out.side *= probed.side / of_probe.side;
    out.kernel *= probed.kernel / of_probe.kernel;
    return out;
}

cuda_timings CUDA(timings)(const struct sadmm_context *c)
{
    enum { MOST_DEVICES = 64 };
    static std::mutex lock;
    static struct {
        bool done;
        cuda_timings times;
    } cache[MOST_DEVICES];
    if (c->device >= MOST_DEVICES) return of_kernel;
    const std::lock_guard<std::mutex> guard(lock);
    if (!cache[c->device].done) {
        cache[c->device].times = timings_of(c);
        cache[c->device].done = true;
    }
    return cache[c->device].times;
}

#else

cuda_timings CUDA(timings)(const struct sadmm_context *) { return of_kernel; }

#endif
