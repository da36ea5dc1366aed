/* Vectors of four doubles for the kernels of joints: a number of three coordinates, or of both ends of a joint as the
 * step starts and halfway. Each lane goes through the sums and products of core/math in their order. */
#ifndef SADMM_WORLD_STEP_JOINT_LANES_H
#define SADMM_WORLD_STEP_JOINT_LANES_H

#include "core/math/quat.h"

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

static inline lanes lanes_fill(double x) { return (lanes){x, x, x, x}; }
static inline lanes lanes_at(const double *x) { return *(const lanes *)x; }
static inline void lanes_put(lanes a, double *x) { *(lanes *)x = a; }

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
static inline struct lanes3 lanes_columns3(lanes a, lanes b, lanes c, lanes d)
{
    lanes rows[4] = {a, b, c, d};
    lanes_transpose(rows);
    return (struct lanes3){rows[0], rows[1], rows[2]};
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
/* q_mul */
static inline struct lanes_quat lanes_quat_mul(struct lanes_quat a, struct lanes_quat b)
{
    return (struct lanes_quat){a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
                               a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                               a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                               a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

#endif
