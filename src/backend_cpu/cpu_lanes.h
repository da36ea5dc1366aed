/* SIMD lanes by compiler vector extensions (gcc, clang): arithmetic, 3-vectors a lane, and the transposition between
 * rows (a body's or wrench's eight numbers in a row) and lanes (one number of LANES bodies). */
#ifndef SADMM_CPU_LANES_H
#define SADMM_CPU_LANES_H

#include <stddef.h>
#include <stdint.h>

#ifdef __AVX__
#include <immintrin.h>
#endif

#include "core/math/contact.h"

enum { LANES = SADMM_VECTOR_BYTES / (int)sizeof(real) };
/* may_alias: memory is seen as numbers, rows and lanes in turn. */
typedef real lanes __attribute__((vector_size(SADMM_VECTOR_BYTES), may_alias));
typedef __typeof__((lanes){0} < (lanes){0}) lane_mask;

/* Eight numbers of one body or wrench: six used, 32 bytes in f32. */
enum { ROW = 8 };
typedef real row8 __attribute__((vector_size(8 * sizeof(real)), may_alias));

typedef struct vec {
    lanes x, y, z;
} vec;
typedef struct lane_sym3 { /* symmetric 3x3 */
    lanes xx, yy, zz, xy, xz, yz;
} lane_sym3;

static inline lanes fill(real x) { return x - (lanes){0}; }
static inline lanes pick(lane_mask mask, lanes yes, lanes no)
{
    return (lanes)((mask & (lane_mask)yes) | (~mask & (lane_mask)no));
}
static inline lanes larger(lanes a, lanes b) { return pick(a > b, a, b); }
static inline lanes magnitude(lanes a) { return larger(a, -a); }
static inline lanes root(lanes a)
{
    lanes out;
    for (int l = 0; l < LANES; ++l) out[l] = real_sqrt(a[l]);
    return out;
}
static inline real horizontal_max(lanes a)
{
    real m = a[0];
    for (int l = 1; l < LANES; ++l) m = real_max(m, a[l]);
    return m;
}

CONTACT_LAW(lane_law, lanes, lane_mask, fill, pick, root) /* math/contact.h */

static inline vec pick_vec(lane_mask mask, vec yes, vec no)
{
    return (vec){pick(mask, yes.x, no.x), pick(mask, yes.y, no.y), pick(mask, yes.z, no.z)};
}
static inline vec add(vec a, vec b) { return (vec){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline vec sub(vec a, vec b) { return (vec){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline vec scale(vec a, lanes s) { return (vec){a.x * s, a.y * s, a.z * s}; }
static inline lanes dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline vec cross(vec a, vec b)
{
    return (vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline vec sym3_times(lane_sym3 s, vec v)
{
    return (vec){s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
                 s.xz * v.x + s.yz * v.y + s.zz * v.z};
}

/* ---- 3-vectors in double, whatever the precision: one in a vector ---------------------------------------------- */

typedef double vec3d __attribute__((vector_size(4 * sizeof(double))));

/* A row in double. */
typedef double row8d __attribute__((vector_size(8 * sizeof(double))));

static inline vec3d vec3d_load(const double x[3])
{
#ifdef __AVX__
    return _mm256_maskload_pd(x, (__m256i){-1, -1, -1, 0});
#else
    return (vec3d){x[0], x[1], x[2], 0};
#endif
}
static inline void vec3d_store(vec3d v, double x[3]) { x[0] = v[0], x[1] = v[1], x[2] = v[2]; }
static inline vec3d vec3d_yzx(vec3d v) { return __builtin_shufflevector(v, v, 1, 2, 0, 3); }
static inline vec3d vec3d_zxy(vec3d v) { return __builtin_shufflevector(v, v, 2, 0, 1, 3); }
/* a x b as z, x, y, which is how torques are added up: it needs the fewest shuffles. */
static inline vec3d vec3d_cross_zxy(vec3d a, vec3d b) { return a * vec3d_yzx(b) - vec3d_yzx(a) * b; }

static inline vec3d vec3d_of_lane(const vec *v, size_t l)
{
    typedef real numbers __attribute__((vector_size(4 * sizeof(real))));
    return __builtin_convertvector(((numbers){v->x[l], v->y[l], v->z[l], 0}), vec3d);
}
/* Of a velocity or a momentum. */
typedef struct vec6d {
    vec3d linear, angular;
} vec6d;
static inline void vec6d_store(vec6d v, double x[6])
{
    vec3d_store(v.linear, x);
    vec3d_store(v.angular, x + 3);
}

/* ---- rows <-> lanes ------------------------------------------------------------------------------------------- */

/* LANES rows of ROW numbers are ROW vectors of LANES numbers, element (row l, number c) at 8 l + c. Splitting all
 * neighbouring vectors into their even and odd elements rotates that index right by one bit; three times bring c to the
 * top: vector c then holds number c of every row. Interleaving undoes it. */

#if SADMM_VECTOR_BYTES == 64
#define EVENS_F32 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30
#define ODDS_F32 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31
#define LOW_F32 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23
#define HIGH_F32 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31
#define EVENS_F64 0, 2, 4, 6, 8, 10, 12, 14
#define ODDS_F64 1, 3, 5, 7, 9, 11, 13, 15
#define LOW_F64 0, 8, 1, 9, 2, 10, 3, 11
#define HIGH_F64 4, 12, 5, 13, 6, 14, 7, 15
#elif SADMM_VECTOR_BYTES == 32
#define EVENS_F32 0, 2, 4, 6, 8, 10, 12, 14
#define ODDS_F32 1, 3, 5, 7, 9, 11, 13, 15
#define LOW_F32 0, 8, 1, 9, 2, 10, 3, 11
#define HIGH_F32 4, 12, 5, 13, 6, 14, 7, 15
#define EVENS_F64 0, 2, 4, 6
#define ODDS_F64 1, 3, 5, 7
#define LOW_F64 0, 4, 1, 5
#define HIGH_F64 2, 6, 3, 7
#else
#define EVENS_F32 0, 2, 4, 6
#define ODDS_F32 1, 3, 5, 7
#define LOW_F32 0, 4, 1, 5
#define HIGH_F32 2, 6, 3, 7
#define EVENS_F64 0, 2
#define ODDS_F64 1, 3
#define LOW_F64 0, 2
#define HIGH_F64 1, 3
#endif
#ifdef SADMM_REAL_F32
#define LANE_SHUFFLE(a, b, name) __builtin_shufflevector(a, b, name##_F32)
#else
#define LANE_SHUFFLE(a, b, name) __builtin_shufflevector(a, b, name##_F64)
#endif

static inline void rows_to_lanes(lanes v[ROW])
{
#pragma GCC unroll 3
    for (int stage = 0; stage < 3; ++stage) {
        lanes w[ROW];
#pragma GCC unroll 4
        for (int i = 0; i < ROW / 2; ++i) {
            w[i] = LANE_SHUFFLE(v[2 * i], v[2 * i + 1], EVENS);
            w[i + ROW / 2] = LANE_SHUFFLE(v[2 * i], v[2 * i + 1], ODDS);
        }
#pragma GCC unroll 8
        for (int i = 0; i < ROW; ++i) v[i] = w[i];
    }
}

static inline void lanes_to_rows(lanes v[ROW])
{
#pragma GCC unroll 3
    for (int stage = 0; stage < 3; ++stage) {
        lanes w[ROW];
#pragma GCC unroll 4
        for (int i = 0; i < ROW / 2; ++i) {
            w[2 * i] = LANE_SHUFFLE(v[i], v[i + ROW / 2], LOW);
            w[2 * i + 1] = LANE_SHUFFLE(v[i], v[i + ROW / 2], HIGH);
        }
#pragma GCC unroll 8
        for (int i = 0; i < ROW; ++i) v[i] = w[i];
    }
}

/* v[c] = number c of LANES rows that `row(l)` gives as row8. */
#if SADMM_VECTOR_BYTES == 64 && defined(SADMM_REAL_F32)
#define LOAD_ROWS(v, row)                                                                                      \
    do {                                                                                                       \
        _Pragma("GCC unroll 8") for (int pair = 0; pair < ROW; ++pair)                                         \
            (v)[pair] = __builtin_shufflevector(row(2 * pair), row(2 * pair + 1), 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, \
                                                10, 11, 12, 13, 14, 15);                                       \
        rows_to_lanes(v);                                                                                      \
    } while (0)
#else
/* A row is one vector or several: vector j holds part j % PARTS of row j / PARTS. */
enum { ROW_PARTS = ROW / LANES };
#define LOAD_ROWS(v, row)                                                   \
    do {                                                                    \
        _Pragma("GCC unroll 8") for (int j = 0; j < ROW; ++j) {             \
            row8 whole = row(j / ROW_PARTS);                                \
            (v)[j] = *((const lanes *)&whole + j % ROW_PARTS);              \
        }                                                                   \
        rows_to_lanes(v);                                                   \
    } while (0)
#endif

/* Rows from lanes, stored one after the other at `out` (aligned). */
static inline void store_rows(real *out, const lanes in[ROW])
{
    lanes v[ROW];
#pragma GCC unroll 8
    for (int c = 0; c < ROW; ++c) v[c] = in[c];
    lanes_to_rows(v);
#pragma GCC unroll 8
    for (int j = 0; j < ROW; ++j) *(lanes *)(out + j * LANES) = v[j];
}

#endif
