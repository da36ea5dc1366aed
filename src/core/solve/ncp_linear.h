/* Linear equations of the dense contact solve, for its kernels: a few to a few hundred. */
#ifndef SADMM_CORE_SOLVE_NCP_LINEAR_H
#define SADMM_CORE_SOLVE_NCP_LINEAR_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/math/six.h"

/* Rows take whole vectors of four: so many numbers, of which those behind `count` are 0. */
static inline size_t ncp_stride(int32_t count) { return ((size_t)count + 3) / 4 * 4; }

/* Products of `count` numbers, in four sums, one a lane. */
static inline double ncp_row_product(const double *row, const double *x, size_t count)
{
    three sum = {0, 0, 0, 0};
    double rest = 0;
    size_t c = 0;
    for (; c + 4 <= count; c += 4) sum += *(const three *)(row + c) * *(const three *)(x + c);
    for (; c < count; ++c) rest += row[c] * x[c];
    return three_sum(sum) + rest;
}

static inline void ncp_exchange_rows(double *a, double *b, size_t count)
{
    for (size_t c = 0; c < count; c += 4) {
        const three t = *(three *)(a + c);
        *(three *)(a + c) = *(three *)(b + c), *(three *)(b + c) = t;
    }
}

/* A vector's numbers from `first` on; others 0. */
static inline three ncp_from(three a, size_t first)
{
    typedef int64_t places __attribute__((vector_size(32)));
    const places place = {0, 1, 2, 3}, least = {(int64_t)first, (int64_t)first, (int64_t)first, (int64_t)first};
    return (three)((places)a & (place >= least));
}

/* M = P L U in place, with the largest of each column as its pivot, whose inverse is on the diagonal; rows are
 * ncp_stride(count) apart. False: singular. What is written as a number is not read as part of a vector soon after. */
static inline bool ncp_factor(double *M, int32_t *pivot, int32_t count)
{
    const size_t n = (size_t)count, stride = ncp_stride(count);
    for (size_t k = 0; k < n; ++k) {
        double *top = M + k * stride;
        size_t best = k;
        double largest = fabs(top[k]);
        for (size_t i = k + 1; i < n; ++i) {
            const double size = fabs(M[i * stride + k]);
            best = size > largest ? i : best;
            largest = size > largest ? size : largest;
        }
        pivot[k] = (int32_t)best;
        if (!(largest > 0)) return false;
        if (best != k) ncp_exchange_rows(top, M + best * stride, stride);
        const double inverse = 1 / top[k];
        const size_t first = (k + 1) / 4 * 4;
        const three head = first < stride ? ncp_from(*(const three *)(top + first), k + 1 - first) : three_fill(0);
        for (size_t i = k + 1; i < n; ++i) {
            double *row = M + i * stride;
            const double share = row[k] * inverse;
            const three shares = three_fill(share);
            *(three *)(row + first) -= shares * head; /* row i has more columns */
            for (size_t c = first + 4; c < stride; c += 4) *(three *)(row + c) -= shares * *(const three *)(top + c);
            row[k] = share;
        }
        top[k] = inverse;
    }
    return true;
}

/* M x = right, in place. */
static inline void ncp_substitute(const double *M, const int32_t *pivot, int32_t count, double *x)
{
    const size_t n = (size_t)count, stride = ncp_stride(count);
    for (size_t k = 0; k < n; ++k) {
        const double at = x[k];
        x[k] = x[pivot[k]], x[pivot[k]] = at;
    }
    for (size_t k = 0; k + 1 < n; ++k)
        for (size_t i = k + 1; i < n; ++i) x[i] -= M[i * stride + k] * x[k];
    for (size_t k = n; k-- > 0;) {
        x[k] *= M[k * stride + k];
        for (size_t i = 0; i < k; ++i) x[i] -= M[i * stride + k] * x[k];
    }
}

#endif
