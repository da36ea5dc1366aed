/* Which pairs of the current set touch (contact_set.h), for the host: a few bytes a pair instead of all points. */
#include "memory.h"
#include "pipeline.h"

enum { TOUCHING_THREADS = 128 };

struct touching_args {
    const struct sadmm_contact_pair *pairs;
    const struct sadmm_contact_point *points;
    int32_t count;
    struct sadmm_touching_shapes *out; /* (count) */
};

static __global__ void __launch_bounds__(TOUCHING_THREADS) touching_kernel(const touching_args a, const int)
{
    const int32_t p = (int32_t)(blockIdx.x * blockDim.x + threadIdx.x);
    if (p >= a.count) return;
    const struct sadmm_contact_pair *pair = &a.pairs[p];
    a.out[p] = sadmm_touching_of(pair, a.points + pair->first);
}

static cudaError_t launch_touching(const touching_args &args, cudaStream_t stream)
{
    const unsigned blocks = ((unsigned)args.count + TOUCHING_THREADS - 1) / TOUCHING_THREADS;
#ifdef SADMM_CUDA_EMULATED
    (void)stream;
    return cuda_emulation_launch(touching_kernel, blocks, (unsigned)TOUCHING_THREADS, (size_t)0, args, 0);
#else
    int unused = 0;
    void *parameters[] = {const_cast<touching_args *>(&args), &unused};
    return cudaLaunchKernel((const void *)touching_kernel, dim3(blocks), dim3(TOUCHING_THREADS), parameters, 0, stream);
#endif
}

extern "C" sadmm_status COLLISION(touching)(struct sadmm_cuda_collision *c, void *stream,
                                            struct sadmm_touching_shapes *touching, struct sadmm_error *error)
{
    const struct collision_set set = set_of(c, c->current);
    const int32_t count = c->counts[c->current].pairs;
    const size_t bytes = (size_t)count * sizeof *touching;
    if (count == 0) return SADMM_OK;
    ENTER(c);
    TRY(begin_work(c, stream, error));
    TRY(reserve(c, TOUCHING, (size_t)count, sizeof *touching, error));
    TRY(reserve(c, PINNED_TOUCHING, (size_t)count, sizeof *touching, error));
    const touching_args args = {set.pairs, set.points, count, in<struct sadmm_touching_shapes>(c, TOUCHING)};
    c->kernel = "touching pairs";
    CUDA_CALL(c, launch_touching(args, c->stream), "touching pairs");
    TRY(copy(c, in<void>(c, PINNED_TOUCHING), in<void>(c, TOUCHING), bytes, false, error));
    TRY(wait(c, error));
    memcpy(touching, in<void>(c, PINNED_TOUCHING), bytes);
    return SADMM_OK;
}
