/* Records that lie one behind the other, a lane each: every access of a warp is then to as many sectors as it has
 * lanes, whatever its size. So records are read and written in the largest pieces that there are. */
#ifndef SADMM_CUDA_DEVICE_WIDE_H
#define SADMM_CUDA_DEVICE_WIDE_H

#include <string.h>

#include <cuda_runtime.h>

struct alignas(16) wide_piece {
    unsigned long long word[2];
};

/* All below is of memory whose arrays begin at multiples of a piece, as all device buffers do. */

/* Record i, of which a part is wanted: a compiler that is given pieces asks for two numbers at a time. */
template <class T> static __device__ __forceinline__ T *wide_at(T *records, size_t i)
{
    static_assert(sizeof(T) % sizeof(wide_piece) == 0, "whole pieces");
    return (T *)__builtin_assume_aligned(records + i, sizeof(wide_piece));
}

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

/* The first BYTES of a record. */
template <size_t BYTES, class T> static __device__ __forceinline__ void store_first(const T &from, T *to)
{
    enum { PIECES = BYTES / sizeof(wide_piece) };
    static_assert(BYTES % sizeof(wide_piece) == 0 && BYTES <= sizeof(T), "whole pieces");
    wide_piece pieces[PIECES];
    memcpy(pieces, &from, BYTES);
#pragma unroll
    for (int k = 0; k < (int)PIECES; ++k) ((wide_piece *)to)[k] = pieces[k];
}
template <class T> static __device__ __forceinline__ void store_wide(const T &from, T *to)
{
    store_first<sizeof(T)>(from, to);
}

/* Rows of eight numbers: of a body's velocity, its b, a rigid one's A. */
template <class Real> struct eight_numbers {
    Real of[8];
};
template <class Real> static __device__ __forceinline__ const Real *row_at(const Real *rows, size_t i)
{
    return wide_at((const eight_numbers<Real> *)rows, i)->of;
}
template <class Real>
static __device__ __forceinline__ void store_row(const eight_numbers<Real> &row, Real *rows, size_t i)
{
    store_wide(row, (eight_numbers<Real> *)rows + i);
}

/* A record a lane, to its place (nullptr: it has none), through shared memory of the warp: what lies side by side goes
 * out together, AT_ONCE pieces of each lane at a time. Every lane of the warp comes here. */
template <int AT_ONCE> struct warp_pieces {
    void *to[32];
    wide_piece of[32][AT_ONCE];
};
template <class T, int AT_ONCE>
static __device__ __forceinline__ void store_of_warp(const T &from, T *to, warp_pieces<AT_ONCE> *shared)
{
    enum { PIECES = sizeof(T) / sizeof(wide_piece) };
    static_assert(sizeof(T) % sizeof(wide_piece) == 0, "whole pieces");
    const int lane = (int)(threadIdx.x % 32);
    wide_piece pieces[PIECES];
    if (to) memcpy(pieces, &from, sizeof from);
    shared->to[lane] = to;
#pragma unroll
    for (int first = 0; first < (int)PIECES; first += AT_ONCE) {
        const int count = (int)PIECES - first < AT_ONCE ? (int)PIECES - first : AT_ONCE;
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
