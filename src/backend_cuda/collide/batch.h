/* Candidates on their way from a thread to memory. */
#ifndef SADMM_CUDA_COLLIDE_BATCH_H
#define SADMM_CUDA_COLLIDE_BATCH_H

#include "backend_cuda/device/parallel.h"
#include "view.h"

static __device__ __forceinline__ void store_candidate(const collision_view &v, unsigned long long at, uint64_t key)
{
    if (at < (unsigned)v.candidate_capacity) v.found[at] = key;
}

/* Candidates of a thread on their way to memory. */
enum { BATCH = 16 };
struct batch {
    uint64_t keys[BATCH];
    unsigned count;
};

static __device__ void write_batch(const collision_view &v, const struct batch &out, unsigned long long first)
{
    for (unsigned i = 0; i < out.count; ++i) store_candidate(v, first + i, out.keys[i]);
}

/* The candidates of a pair. */
static __device__ void add(const collision_view &v, struct batch *out, uint64_t first, uint32_t count)
{
    for (uint32_t subshape = 0; subshape < count; ++subshape) {
        if (out->count == BATCH) {
            write_batch(v, *out, reserve(v.candidate_count + COUNT_FOUND, out->count));
            out->count = 0;
        }
        out->keys[out->count++] = first + subshape;
    }
}

/* What is left, by all threads of a warp together. */
static __device__ void finish_batches(const collision_view &v, const struct batch &out)
{
    write_batch(v, out, reserve_by_warp(v.candidate_count + COUNT_FOUND, out.count));
}

#endif
