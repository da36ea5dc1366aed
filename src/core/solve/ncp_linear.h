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

/* M = P L U in place, with the largest of each column as its pivot; rows are ncp_stride(count) apart. False:
 * singular. */
static inline bool ncp_factor(double *M, int32_t *pivot, int32_t count)
{
    const size_t n = (size_t)count, stride = ncp_stride(count);
    for (size_t k = 0; k < n; ++k) {
        double *top = M + k * stride;
        size_t best = k;
        double largest = fabs(top[k]);
        for (size_t i = k + 1; i < n; ++i)
            if (fabs(M[i * stride + k]) > largest) best = i, largest = fabs(M[i * stride + k]);
        pivot[k] = (int32_t)best;
        if (!(largest > 0)) return false;
        if (best != k) ncp_exchange_rows(top, M + best * stride, stride);
        const double inverse = 1 / top[k];
        const size_t first = (k + 1) / 4 * 4;
        three head = {0, 0, 0, 0}; /* the first vector, without what is on the diagonal or before it */
        for (size_t c = k + 1; c < first + 4 && c < stride; ++c) head[c - first] = top[c];
        for (size_t i = k + 1; i < n; ++i) {
            double *row = M + i * stride;
            const double share = row[k] *= inverse;
            const three shares = {share, share, share, share};
            if (first < stride) *(three *)(row + first) -= shares * head;
            for (size_t c = first + 4; c < stride; c += 4) *(three *)(row + c) -= shares * *(const three *)(top + c);
        }
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
    for (size_t k = 1; k < n; ++k) x[k] -= ncp_row_product(M + k * stride, x, k);
    for (size_t k = n; k-- > 0;)
        x[k] = (x[k] - ncp_row_product(M + k * stride + k + 1, x + k + 1, n - k - 1)) / M[k * stride + k];
}

#endif
