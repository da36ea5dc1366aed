/* Records that lie one behind the other, a lane each: every access of a warp is then to as many sectors as it has lanes,
 * whatever its size. So records are read and written in the largest pieces that there are. */
#ifndef SADMM_CUDA_DEVICE_WIDE_H
#define SADMM_CUDA_DEVICE_WIDE_H

#include <string.h>

#include <cuda_runtime.h>

struct alignas(16) wide_piece {
    unsigned long long word[2];
};

/* Both are of memory whose arrays begin at multiples of a piece, as all device buffers do. */
template <class T> static __device__ __forceinline__ T load_wide(const T *from)
{
    enum { PIECES = sizeof(T) / sizeof(wide_piece) };
    static_assert(sizeof(T) % sizeof(wide_piece) == 0, "whole pieces");
    wide_piece pieces[PIECES];
    T out;
#pragma unroll
    for (int k = 0; k < (int)PIECES; ++k) pieces[k] = ((const wide_piece *)from)[k];
    memcpy(&out, pieces, sizeof out);
    return out;
}

template <class T> static __device__ __forceinline__ void store_wide(const T &from, T *to)
{
    enum { PIECES = sizeof(T) / sizeof(wide_piece) };
    static_assert(sizeof(T) % sizeof(wide_piece) == 0, "whole pieces");
    wide_piece pieces[PIECES];
    memcpy(pieces, &from, sizeof from);
#pragma unroll
    for (int k = 0; k < (int)PIECES; ++k) ((wide_piece *)to)[k] = pieces[k];
}

/* A record a lane, to its place (nullptr: it has none), through shared memory of the warp: what lies side by side goes
 * out together. Every lane of the warp comes here. */
enum { WARP_PIECES = 10 }; /* of each lane, at a time */
struct warp_pieces {
    void *to[32];
    wide_piece of[32][WARP_PIECES];
};
template <class T>
static __device__ __forceinline__ void store_of_warp(const T &from, T *to, struct warp_pieces *shared)
{
    enum { PIECES = sizeof(T) / sizeof(wide_piece) };
    static_assert(sizeof(T) % sizeof(wide_piece) == 0, "whole pieces");
    const int lane = (int)(threadIdx.x % 32);
    wide_piece pieces[PIECES];
    if (to) memcpy(pieces, &from, sizeof from);
    shared->to[lane] = to;
#pragma unroll
    for (int first = 0; first < (int)PIECES; first += WARP_PIECES) {
        const int count = (int)PIECES - first < WARP_PIECES ? (int)PIECES - first : (int)WARP_PIECES;
#pragma unroll
        for (int k = 0; to && k < count; ++k) shared->of[lane][k] = pieces[first + k];
        __syncwarp(0xffffffffu);
#pragma unroll
        for (int i = 0; i < count; ++i) {
            const int at = i * 32 + lane, owner = at / count, k = at % count;
            if (shared->to[owner]) ((wide_piece *)shared->to[owner])[first + k] = shared->of[owner][k];
        }
        __syncwarp(0xffffffffu);
    }
}

#endif
