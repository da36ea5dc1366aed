/* Constraints of the method `fast` in double, from this precision's data: what weights, weight scales and energies are
 * made of. */
#ifndef SADMM_CUDA_WEIGHT_CONSTRAINT_H
#define SADMM_CUDA_WEIGHT_CONSTRAINT_H

#include "backend_cuda/device/body.h"
#include "row_sums.h"

#include "core/math/array3.h"
#include "core/math/contact.h"

struct pair_data {
    double normal[3], difference[3], friction;
    int32_t count;
};

static __device__ __forceinline__ pair_data load_pair(const contact_view &contacts, int32_t p)
{
    const real4 about = contacts.normal[p], between = contacts.difference[p];
    const pair_data pair = {{(double)about.x, (double)about.y, (double)about.z},
                            {(double)between.x, (double)between.y, (double)between.z},
                            (double)about.w,
                            (int32_t)between.w};
    return pair;
}

/* Arms are of use on dynamic sides only. */
struct point_data {
    double arm[2][3], lambda[3], error;
};

/* The same in this precision, as it is in memory. */
struct point_numbers {
    real4 arm;
    solver_real lambda[3];
};

static __device__ __forceinline__ point_numbers fetch_point(const contact_view &contacts, int32_t p, int32_t k)
{
    const size_t slot = point_slot(contacts, p, k);
    point_numbers point;
    point.arm = contacts.arm[slot];
    point.lambda[0] = contacts.lambda[slot];
    point.lambda[1] = contacts.lambda[contacts.lambda_stride + slot];
    point.lambda[2] = contacts.lambda[2 * contacts.lambda_stride + slot];
    return point;
}

static __device__ __forceinline__ point_data point_of(const point_numbers &numbers, const pair_data &pair)
{
    const double r[3] = {(double)numbers.arm.x, (double)numbers.arm.y, (double)numbers.arm.z};
    point_data point;
    point.error = (double)numbers.arm.w;
#pragma unroll
    for (int j = 0; j < 3; ++j) {
        point.arm[0][j] = r[j];
        point.arm[1][j] = r[j] + pair.difference[j];
        point.lambda[j] = (double)numbers.lambda[j];
    }
    return point;
}

static __device__ __forceinline__ point_data load_point(const contact_view &contacts, int32_t p, int32_t k,
                                                        const pair_data &pair)
{
    return point_of(fetch_point(contacts, p, k), pair);
}

/* use(point) for each point of a pair, in order. */
template <class Use>
static __device__ __forceinline__ void for_each_point(const contact_view &contacts, int32_t p, const pair_data &pair,
                                                      Use use)
{
    for (int32_t first = 0; first < pair.count; first += POINTS_AT_ONCE) {
        point_numbers numbers[POINTS_AT_ONCE] = {};
#pragma unroll
        for (int32_t j = 0; j < POINTS_AT_ONCE; ++j)
            if (first + j < pair.count) numbers[j] = fetch_point(contacts, p, first + j);
#pragma unroll
        for (int32_t j = 0; j < POINTS_AT_ONCE; ++j)
            if (first + j < pair.count) use(point_of(numbers[j], pair));
    }
}

static __device__ __forceinline__ bool is_dynamic(const model_view &model, int32_t body) { return body < model.bodies; }

/* (A_0 + A_1 + A_2) / 3 */
static __device__ __forceinline__ double mass_of(const body_view &bodies, size_t body)
{
    const solver_real *line = bodies.lines + body * (size_t)bodies.line;
    if (bodies.rigid) return (double)line[0];
    return ((double)line_a(line, bodies.rigid, 0, 0) + (double)line_a(line, bodies.rigid, 1, 1) +
            (double)line_a(line, bodies.rigid, 2, 2)) /
           3;
}

/* g += J^T lambda of a side; *push += the size of its force. */
static inline __device__ void add_side(const contact_view &contacts, const row_view &rows, int32_t code, double g[6],
                                       double *push)
{
    const int32_t side = code & 1, p = code / 2;
    if (p >= contacts.pair_capacity) {
        double wrench[6];
        wrench_of_rows(rows, p - contacts.pair_capacity, side, wrench);
        for (int j = 0; j < 6; ++j) g[j] += wrench[j];
        *push += length3(wrench);
        return;
    }
    const pair_data pair = load_pair(contacts, p);
    const double sign = side ? 1 : -1;
    double force[3] = {};
    for_each_point(contacts, p, pair, [&](const point_data &point) {
        double arm[3];
        for (int j = 0; j < 3; ++j) {
            arm[j] = side ? point.arm[1][j] : point.arm[0][j];
            force[j] += point.lambda[j];
        }
        add_cross(arm, point.lambda, sign, g + 3);
    });
    for (int j = 0; j < 3; ++j) g[j] += sign * force[j];
    *push += length3(force);
}

#endif
