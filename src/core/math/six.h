/* Six numbers of a body, linear and angular, as two vectors of three: for host kernels that are compiled once per
 * instruction set. In memory SIX doubles, of which the fourth of each half is 0. In double. */
#ifndef SADMM_CORE_MATH_SIX_H
#define SADMM_CORE_MATH_SIX_H

#ifdef __AVX__
#include <immintrin.h>
#endif

enum { SIX = 8, SIX_HALF = SIX / 2 };

/* Unaligned: memory of this library is aligned for doubles. */
typedef double three __attribute__((vector_size(32), aligned(8), may_alias));
typedef double two_numbers __attribute__((vector_size(16)));
typedef struct six {
    three linear, angular;
} six;

static inline three three_fill(double x) { return (three){x, x, x, x}; }
static inline three three_load(const double x[3])
{
#ifdef __AVX__
    return _mm256_maskload_pd(x, (__m256i){-1, -1, -1, 0});
#else
    return (three){x[0], x[1], x[2], 0};
#endif
}
static inline void three_store(three a, double x[3])
{
#ifdef __AVX__
    _mm256_maskstore_pd(x, (__m256i){-1, -1, -1, 0}, a);
#else
    x[0] = a[0], x[1] = a[1], x[2] = a[2];
#endif
}
static inline three three_cross(three a, three b)
{
    const three a_yzx = __builtin_shufflevector(a, a, 1, 2, 0, 3), b_yzx = __builtin_shufflevector(b, b, 1, 2, 0, 3),
                zxy = a * b_yzx - a_yzx * b;
    return __builtin_shufflevector(zxy, zxy, 1, 2, 0, 3);
}
static inline double three_sum(three a)
{
    const two_numbers pair = __builtin_shufflevector(a, a, 0, 1) + __builtin_shufflevector(a, a, 2, 3);
    return pair[0] + pair[1];
}
/* a b + c and a b - c, fused where c is no product that the compiler might fuse instead. */
static inline three three_fma(three a, three b, three c)
{
#ifdef __FMA__
    return _mm256_fmadd_pd(a, b, c);
#else
    return a * b + c;
#endif
}
static inline three three_fms(three a, three b, three c)
{
#ifdef __FMA__
    return _mm256_fmsub_pd(a, b, c);
#else
    return a * b - c;
#endif
}
/* A product that is rounded, whatever it is added to. */
static inline three three_product(three a, three b)
{
    three p = a * b;
#ifdef __FMA__
    __asm__("" : "+x"(p));
#endif
    return p;
}
static inline double three_dot(three a, three b) { return three_sum(a * b); }

static inline six six_zero(void) { return (six){{0, 0, 0, 0}, {0, 0, 0, 0}}; }
/* Of SIX doubles, and of six. */
static inline six six_at(const double x[SIX]) { return (six){*(const three *)x, *(const three *)(x + SIX_HALF)}; }
static inline void six_put(six a, double x[SIX]) { *(three *)x = a.linear, *(three *)(x + SIX_HALF) = a.angular; }
static inline six six_load(const double x[6]) { return (six){three_load(x), three_load(x + 3)}; }
static inline void six_store(six a, double x[6]) { three_store(a.linear, x), three_store(a.angular, x + 3); }

static inline six six_add(six a, six b) { return (six){a.linear + b.linear, a.angular + b.angular}; }
static inline six six_sub(six a, six b) { return (six){a.linear - b.linear, a.angular - b.angular}; }
/* a + x b */
static inline six six_madd(six a, double x, six b)
{
    const three every = three_fill(x);
    return (six){a.linear + every * b.linear, a.angular + every * b.angular};
}
static inline double six_dot(six a, six b) { return three_sum(a.linear * b.linear + a.angular * b.angular); }

/* y + sign A x, of a symmetric A. */
static inline six six_add_product(six y, double sign, const double A[6][SIX], const double x[SIX])
{
    for (int k = 0; k < 6; ++k) y = six_madd(y, sign * x[k < 3 ? k : k + 1], six_at(A[k]));
    return y;
}

/* Of a body at r from another one that it goes rigidly along with: its velocity by the other's; what a load on it is on
 * the other one. */
static inline six six_carry(three r, six v) { return (six){v.linear + three_cross(v.angular, r), v.angular}; }
static inline six six_hand_on(three r, six load)
{
    return (six){load.linear, load.angular + three_cross(r, load.linear)};
}

#endif
