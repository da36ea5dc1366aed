/* Vectors of four doubles for kernels of the host that are compiled once per instruction set: a number of three
 * coordinates, or of four bodies, shapes or ends of joints. Each lane goes through the sums and products of vec3.h and
 * quat.h in their order, for the same bits. */
#ifndef SADMM_CORE_MATH_LANES_H
#define SADMM_CORE_MATH_LANES_H

#ifdef __AVX__
#include <immintrin.h>
#endif

#include "quat.h"

typedef double lanes __attribute__((vector_size(32), aligned(8), may_alias));
struct lanes3 {
    lanes x, y, z;
};
struct lanes_quat {
    lanes w, x, y, z;
};
struct lanes_matrix {
    struct lanes3 r[3];
};

/* Of comparisons: all bits of a lane or none. */
typedef int64_t lanes_mask __attribute__((vector_size(32)));

static inline lanes lanes_fill(double x) { return (lanes){x, x, x, x}; }
static inline lanes lanes_at(const double *x) { return *(const lanes *)x; }
static inline void lanes_put(lanes a, double *x) { *(lanes *)x = a; }

static inline lanes lanes_root(lanes a)
{
#ifdef __AVX__
    return _mm256_sqrt_pd(a);
#else
    return (lanes){sqrt(a[0]), sqrt(a[1]), sqrt(a[2]), sqrt(a[3])};
#endif
}
static inline lanes lanes_choose(lanes_mask which, lanes a, lanes b)
{
    return (lanes)((which & (lanes_mask)a) | (~which & (lanes_mask)b));
}

/* Columns of four rows, and back. */
static inline void lanes_transpose(lanes a[4])
{
    const lanes even = __builtin_shufflevector(a[0], a[1], 0, 4, 2, 6),
                odd = __builtin_shufflevector(a[0], a[1], 1, 5, 3, 7),
                more = __builtin_shufflevector(a[2], a[3], 0, 4, 2, 6),
                other = __builtin_shufflevector(a[2], a[3], 1, 5, 3, 7);
    a[0] = __builtin_shufflevector(even, more, 0, 1, 4, 5);
    a[1] = __builtin_shufflevector(odd, other, 0, 1, 4, 5);
    a[2] = __builtin_shufflevector(even, more, 2, 3, 6, 7);
    a[3] = __builtin_shufflevector(odd, other, 2, 3, 6, 7);
}
/* Four numbers each of four places, as lanes; and back. */
static inline void lanes_gather(const double *const from[4], lanes to[4])
{
    for (int k = 0; k < 4; ++k) to[k] = lanes_at(from[k]);
    lanes_transpose(to);
}
static inline void lanes_scatter(lanes a, lanes b, lanes c, lanes d, double *const to[4], int at)
{
    lanes rows[4] = {a, b, c, d};
    lanes_transpose(rows);
    for (int k = 0; k < 4; ++k) lanes_put(rows[k], to[k] + at);
}

static inline struct lanes3 lanes3_add(struct lanes3 a, struct lanes3 b)
{
    return (struct lanes3){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline lanes lanes3_dot(struct lanes3 a, struct lanes3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/* q_matrix */
static inline struct lanes_matrix lanes_matrix_of(struct lanes_quat q)
{
    const lanes one = lanes_fill(1), two = lanes_fill(2);
    const lanes xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z, xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z,
                wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
    return (struct lanes_matrix){{{one - two * (yy + zz), two * (xy - wz), two * (xz + wy)},
                                  {two * (xy + wz), one - two * (xx + zz), two * (yz - wx)},
                                  {two * (xz - wy), two * (yz + wx), one - two * (xx + yy)}}};
}
/* m3_mul */
static inline struct lanes3 lanes_turn(const struct lanes_matrix *R, struct lanes3 v)
{
    return (struct lanes3){lanes3_dot(R->r[0], v), lanes3_dot(R->r[1], v), lanes3_dot(R->r[2], v)};
}
/* q_mul */
static inline struct lanes_quat lanes_quat_mul(struct lanes_quat a, struct lanes_quat b)
{
    return (struct lanes_quat){a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
                               a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                               a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                               a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

/* q_normalize */
static inline struct lanes_quat lanes_quat_normalize(struct lanes_quat q)
{
    const lanes s = lanes_fill(1) / lanes_root(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return (struct lanes_quat){q.w * s, q.x * s, q.y * s, q.z * s};
}

#endif
