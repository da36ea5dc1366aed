/* Three numbers that the same is done to: the rows of a rotation, a separation along each of three axes. Where doubles
 * come in vectors of four they are one (the fourth is nobody's), else three numbers: the operations and their bits are
 * the same.
 *
 * row3 is of `real`; row3_double, of double in every precision, is for what is rounded to `real` afterwards.
 */
#ifndef SADMM_COLLISION_BASE_ROW3_H
#define SADMM_COLLISION_BASE_ROW3_H

#include "core/math/vec3.h"

/* Of the lowest bit that is set; 0 where none is. */
SADMM_INLINE int lowest_bit(int bits)
{
#ifdef __CUDA_ARCH__
    return bits ? __ffs(bits) - 1 : 0;
#else
    return bits ? __builtin_ctz((unsigned)bits) : 0;
#endif
}

#if defined(__AVX__) && defined(SADMM_REAL_IS_DOUBLE) && !defined(__CUDACC__)

#include <immintrin.h>

enum { ROW3 = 4 }; /* numbers that a row takes in memory */
typedef double row3 __attribute__((vector_size(32)));
typedef row3 row3_double;
typedef __typeof__((row3){0} < (row3){0}) row3_mask;

SADMM_INLINE row3 r3_fill(real x) { return (row3){x, x, x, x}; }
SADMM_INLINE row3 r3_of(vec3 v) { return (row3){v.x, v.y, v.z, 0}; }
SADMM_INLINE vec3 r3_vec3(row3 a) { return v3(a[0], a[1], a[2]); }
/* ROW3 numbers, and three. */
SADMM_INLINE row3 r3_load(const real *p) { return _mm256_loadu_pd(p); }
SADMM_INLINE row3_double r3_load_three(const double *p)
{
    return _mm256_maskload_pd(p, (__m256i){-1, -1, -1, 0});
}
SADMM_INLINE void r3_store(row3 a, real *p) { _mm256_storeu_pd(p, a); }
SADMM_INLINE row3 r3_add(row3 a, row3 b) { return a + b; }
SADMM_INLINE row3 r3_sub(row3 a, row3 b) { return a - b; }
SADMM_INLINE row3 r3_mul(row3 a, row3 b) { return a * b; }
SADMM_INLINE row3 r3_scale(row3 a, real s) { return a * s; }
/* a + s b */
SADMM_INLINE row3 r3_madd(row3 a, real s, row3 b) { return a + s * b; }
SADMM_INLINE row3 r3_abs(row3 a) { return (row3)((row3_mask)a & INT64_MAX); }
/* (y, z, x) and (z, x, y) */
SADMM_INLINE row3 r3_turn(row3 a) { return __builtin_shufflevector(a, a, 1, 2, 0, 3); }
SADMM_INLINE row3 r3_turn_back(row3 a) { return __builtin_shufflevector(a, a, 2, 0, 1, 3); }
/* The parts that go down, and up (bounds.h). */
SADMM_INLINE row3 r3_downward(row3 a) { return _mm256_min_pd(a, r3_fill(0)); }
SADMM_INLINE row3 r3_upward(row3 a) { return _mm256_max_pd(a, r3_fill(0)); }
/* Bit k: where a's number k is above b's, and is not above. */
SADMM_INLINE int r3_above(row3 a, row3 b) { return _mm256_movemask_pd((row3)(a > b)) & 7; }
SADMM_INLINE int r3_not_above(row3 a, row3 b) { return _mm256_movemask_pd((row3)(a <= b)) & 7; }

/* The columns of three rows. */
SADMM_INLINE void r3_transpose(const row3 rows[3], row3 columns[3])
{
    const row3 low = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6),
               high = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7);
    columns[0] = __builtin_shufflevector(low, rows[2], 0, 1, 4, 7);
    columns[1] = __builtin_shufflevector(high, rows[2], 0, 1, 5, 7);
    columns[2] = __builtin_shufflevector(low, rows[2], 2, 3, 6, 7);
}

SADMM_INLINE row3_double r3_scale_double(row3_double a, double s) { return a * s; }
SADMM_INLINE row3_double r3_madd_double(row3_double a, double s, row3_double b) { return a + s * b; }
SADMM_INLINE row3 r3_round(row3_double a) { return a; }

#else

enum { ROW3 = 3 };
typedef vec3 row3;
typedef struct row3_double { double x, y, z; } row3_double;

SADMM_INLINE row3 r3_fill(real x) { return v3(x, x, x); }
SADMM_INLINE row3 r3_of(vec3 v) { return v; }
SADMM_INLINE vec3 r3_vec3(row3 a) { return a; }
SADMM_INLINE row3 r3_load(const real *p) { return v3(p[0], p[1], p[2]); }
SADMM_INLINE row3_double r3_load_three(const double *p)
{
    row3_double a;
    a.x = p[0];
    a.y = p[1];
    a.z = p[2];
    return a;
}
SADMM_INLINE void r3_store(row3 a, real *p) { p[0] = a.x; p[1] = a.y; p[2] = a.z; }
SADMM_INLINE row3 r3_add(row3 a, row3 b) { return v3_add(a, b); }
SADMM_INLINE row3 r3_sub(row3 a, row3 b) { return v3_sub(a, b); }
SADMM_INLINE row3 r3_mul(row3 a, row3 b) { return v3(a.x * b.x, a.y * b.y, a.z * b.z); }
SADMM_INLINE row3 r3_scale(row3 a, real s) { return v3_scale(a, s); }
SADMM_INLINE row3 r3_madd(row3 a, real s, row3 b) { return v3_madd(a, s, b); }
SADMM_INLINE row3 r3_abs(row3 a) { return v3(real_abs(a.x), real_abs(a.y), real_abs(a.z)); }
SADMM_INLINE row3 r3_turn(row3 a) { return v3(a.y, a.z, a.x); }
SADMM_INLINE row3 r3_turn_back(row3 a) { return v3(a.z, a.x, a.y); }
SADMM_INLINE row3 r3_downward(row3 a) { return v3(a.x < 0 ? a.x : 0, a.y < 0 ? a.y : 0, a.z < 0 ? a.z : 0); }
SADMM_INLINE row3 r3_upward(row3 a) { return v3(a.x > 0 ? a.x : 0, a.y > 0 ? a.y : 0, a.z > 0 ? a.z : 0); }
SADMM_INLINE int r3_above(row3 a, row3 b) { return (a.x > b.x) | (a.y > b.y) << 1 | (a.z > b.z) << 2; }
SADMM_INLINE int r3_not_above(row3 a, row3 b) { return (a.x <= b.x) | (a.y <= b.y) << 1 | (a.z <= b.z) << 2; }
SADMM_INLINE void r3_transpose(const row3 rows[3], row3 columns[3])
{
    columns[0] = v3(rows[0].x, rows[1].x, rows[2].x);
    columns[1] = v3(rows[0].y, rows[1].y, rows[2].y);
    columns[2] = v3(rows[0].z, rows[1].z, rows[2].z);
}

SADMM_INLINE row3_double r3_scale_double(row3_double a, double s)
{
    a.x *= s;
    a.y *= s;
    a.z *= s;
    return a;
}
SADMM_INLINE row3_double r3_madd_double(row3_double a, double s, row3_double b)
{
    a.x += s * b.x;
    a.y += s * b.y;
    a.z += s * b.z;
    return a;
}
SADMM_INLINE row3 r3_round(row3_double a) { return v3((real)a.x, (real)a.y, (real)a.z); }

#endif
#endif
