/* A body's matrices in memory: one packed "line", lower triangles row by row.
 *
 *   rigid    m, then the world inertia's 6 and 1 unused; H's 21 and 3 unused      LINE_RIGID numbers, 128 bytes in f32
 *   general  A's 21 and 3 unused; H's 21 and 3 unused                             LINE_GENERAL numbers
 *
 * H is stored once and read as both sides, so that it is symmetric to the last bit.
 */
#ifndef SADMM_CUDA_DEVICE_LINE_H
#define SADMM_CUDA_DEVICE_LINE_H

enum { LINE_H = 24, LINE_RIGID_A = 8, LINE_GENERAL_A = 24, LINE_RIGID = LINE_RIGID_A + LINE_H,
       LINE_GENERAL = LINE_GENERAL_A + LINE_H };

/* Place of entry (r, k) in a packed lower triangle. */
static __device__ __forceinline__ int32_t packed_place(int32_t r, int32_t k)
{
    return r >= k ? r * (r + 1) / 2 + k : k * (k + 1) / 2 + r;
}

/* Entry (r, k) of A. */
template <class Real>
static __device__ __forceinline__ Real line_a(const Real *line, bool rigid, int32_t r, int32_t k)
{
    if (!rigid) return line[packed_place(r, k)];
    if (r < 3 || k < 3) return r == k ? line[0] : (Real)0;
    return line[1 + packed_place(r - 3, k - 3)];
}

/* H's triangle. */
template <class Real> static __device__ __forceinline__ Real *line_h(Real *line, bool rigid)
{
    return line + (rigid ? LINE_RIGID_A : LINE_GENERAL_A);
}

#endif
