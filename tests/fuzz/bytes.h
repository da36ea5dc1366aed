/* What a fuzzer's input is read with: bytes in, choices and numbers out. An input that has ended goes on with zeros, so
 * that every input, the empty one included, is a whole program. */
#ifndef TESTS_FUZZ_BYTES_H
#define TESTS_FUZZ_BYTES_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* A fuzzer is this function; libFuzzer or replay.c calls it. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* What must hold of every input. Ends the program, so that libFuzzer keeps the input. */
#define MUST(condition, ...)                                                       \
    do {                                                                           \
        if (!(condition)) {                                                        \
            fprintf(stderr, "%s:%d: does not hold: %s: ", __FILE__, __LINE__, #condition); \
            fprintf(stderr, __VA_ARGS__);                                          \
            fputc('\n', stderr);                                                   \
            abort();                                                               \
        }                                                                          \
    } while (0)

struct bytes {
    const uint8_t *at, *end;
};

static inline struct bytes bytes_of(const uint8_t *data, size_t size)
{
    return (struct bytes){.at = data, .end = size > 0 ? data + size : data};
}

static inline bool bytes_left(const struct bytes *in) { return in->at < in->end; }

static inline uint8_t take_byte(struct bytes *in) { return bytes_left(in) ? *in->at++ : 0; }

/* [0, n), n in [1, 256] */
static inline int take_choice(struct bytes *in, int n) { return take_byte(in) % n; }

/* True for one byte in `n`; never at the end of the input. */
static inline bool take_rarely(struct bytes *in, int n) { return bytes_left(in) && take_byte(in) >= 256 - 256 / n; }

/* True for one input in `n`, n a power of 2, by all of its bytes, so that which ones is nobody's choice: for what costs
 * many times the rest. (libFuzzer likes some bytes better than others.) */
static inline bool one_input_in(const uint8_t *data, size_t size, uint32_t n)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t k = 0; k < size; ++k) hash = (hash ^ data[k]) * UINT64_C(0x100000001b3);
    return (hash >> 40) % n == 0;
}

/* In steps of a 65535th, both ends included; bytes of zero give the middle of [-x, x]. */
static inline double take_in(struct bytes *in, double lo, double hi)
{
    int high = take_byte(in), low = take_byte(in), k = (high << 8 | low) ^ 0x8000;
    return k == 0x8000 ? 0.5 * (lo + hi) : lo + (hi - lo) * k / 65535.0;
}

/* lo to hi evenly by magnitude; both > 0 */
static inline double take_scale(struct bytes *in, double lo, double hi)
{
    return fmin(fmax(exp(take_in(in, log(lo), log(hi))), lo), hi);
}

/* Values at which code goes wrong. */
static inline double take_extreme(struct bytes *in)
{
    static const double values[] = {
        0.0, -0.0, 1.0, -1.0, NAN, INFINITY, -INFINITY, DBL_MIN, -DBL_MIN, 4.9406564584124654e-324, DBL_EPSILON,
        DBL_MAX, -DBL_MAX, 1e-300, 1e300, -1e300, 1e150, -1e150, 1e-150, FLT_MAX, FLT_MIN, 1e-45, 1e38, 1e-38,
        1e-6, 1e6, -1e6, 1e9, -1e9, 1e-9, 1e12, 1e15, -1e15, 1e24, 0.5, 1e-12, 1e3, 2.0, 1024.0, 1e5,
        1.0000000000000002, 0.99999999999999989, 1.0000005, 1e6 + 1e-9, 1e9 + 1e-6, 2147483647.0, 1e20, -1e20,
    };
    return values[take_choice(in, (int)(sizeof values / sizeof *values))];
}

/* Mostly in [lo, hi], sometimes anything. */
static inline double take_number(struct bytes *in, double lo, double hi)
{
    return take_rarely(in, 32) ? take_extreme(in) : take_in(in, lo, hi);
}

static inline void take_vector(struct bytes *in, double lo, double hi, double x[3])
{
    for (int k = 0; k < 3; ++k) x[k] = take_number(in, lo, hi);
}

/* A unit quaternion: the identity, quarter and small turns, any; sometimes what is none. */
static inline void take_orientation(struct bytes *in, double q[4])
{
    static const double half = 0.70710678118654752440;
    int kind = take_choice(in, 16), axis = take_choice(in, 3);
    q[0] = 1;
    q[1] = q[2] = q[3] = 0;
    if (kind < 4) return;
    if (kind < 7) {
        q[0] = kind == 6 ? 0 : half;
        q[1 + axis] = kind == 6 ? 1 : (kind == 5 ? half : -half);
    } else if (kind < 10) {
        double angle = take_scale(in, 1e-18, 1);
        q[0] = cos(angle);
        q[1 + axis] = sin(angle);
    } else if (kind < 15) {
        double n2 = 0;
        for (int k = 0; k < 4; ++k) {
            q[k] = take_in(in, -1, 1);
            n2 += q[k] * q[k];
        }
        if (n2 == 0) q[0] = n2 = 1;
        for (int k = 0; k < 4; ++k) q[k] /= sqrt(n2);
    } else {
        q[axis] = take_extreme(in);
    }
}

static inline bool all_finite(const double *x, int count)
{
    for (int k = 0; k < count; ++k)
        if (!isfinite(x[k])) return false;
    return true;
}

#endif
