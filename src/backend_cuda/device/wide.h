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

#endif
