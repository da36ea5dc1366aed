/* An interior point of a dense problem, by a thread block (core/solve/ncp_interior.h has the method): where Newton's
 * steps do not come to an end from where they began. */
#ifndef SADMM_CUDA_STEP_NCP_INTERIOR_H
#define SADMM_CUDA_STEP_NCP_INTERIOR_H

#include "ncp_newton.h"

#include "core/math/cone.h"

enum { NCP_MOST_STEPS = 40, NCP_MOST_SHORT = 4 };
/* How much of the way to the boundary is gone. Steps shorter than NCP_SHORT turn to the middle of the cones instead. */
#define NCP_SHARE 0.95
#define NCP_SHORT 0.1
/* Of the size of scaled velocities, squared: a smaller complementarity is rounding. */
#define NCP_LEAST_PRODUCT 1e-18

/* A law in scaled numbers x = lambda / scale, y = scale u. */
struct ncp_cone {
    int32_t at, count; /* of its numbers; 3: a contact's cone, 1: a row; 0: nothing is to be found */
    double lo, hi;
    double dual[3], step[3], second[3], scaled[3], product; /* of x and the dual */
    struct cone_scaling by;
};

struct ncp_interior {
    ncp_cone *cone; /* by law */
    int32_t *number, *row; /* of the problem, (count); rows of pivots, by column */
    double *free, *scale, *x, *y, *off, *dx, *right;
    int32_t count, degree;
    double complementarity; /* of x and the duals, by the degree */
};

static __device__ bool take_interior(const ncp_island &s, ncp_memory *memory, ncp_interior *p)
{
    const size_t n = (size_t)s.numbers;
    p->cone = take<ncp_cone>(memory, (size_t)s.laws);
    p->number = take<int32_t>(memory, n);
    p->row = take<int32_t>(memory, n);
    p->free = take<double>(memory, n);
    p->scale = take<double>(memory, n);
    p->x = take<double>(memory, n);
    p->y = take<double>(memory, n);
    p->off = take<double>(memory, n);
    p->dx = take<double>(memory, n);
    p->right = take<double>(memory, n);
    return !memory->full;
}

/* Tangents without friction are left out, and rows whose bounds are one. */
static __device__ __noinline__ void list_cones(const ncp_island &s, ncp_interior *p, ncp_shared *shared)
{
    each(s.laws, [&](int32_t i) {
        const ncp_law &law = s.law[i];
        ncp_cone *c = &p->cone[i];
        const double scale = 1 / sqrt(law.response);
        c->count = law.count == 1 ? law.lo < law.hi : law.friction > 0 ? 3 : 1;
        c->lo = law.count == 1 ? law.lo / scale : 0;
        c->hi = law.count == 1 ? law.hi / scale : INFINITY;
        for (int k = 0; k < 3; ++k) c->dual[k] = c->step[k] = c->second[k] = 0;
    });
    ncp_barrier();
    if (ncp_thread() == 0) {
        int32_t count = 0, degree = 0;
        for (int32_t i = 0; i < s.laws; ++i) {
            ncp_cone *c = &p->cone[i];
            c->at = count;
            count += c->count;
            degree += c->count == 3 ? 1 : c->count == 0 ? 0 : (c->lo > -INFINITY) + (c->hi < INFINITY);
        }
        shared->count = count;
        shared->pivot = degree;
    }
    ncp_barrier();
    p->count = shared->count;
    p->degree = shared->pivot;
    each(s.laws, [&](int32_t i) {
        const ncp_law &law = s.law[i];
        const ncp_cone *c = &p->cone[i];
        const double scale = 1 / sqrt(law.response);
        for (int k = 0; k < law.count; ++k) s.lambda[law.first + k] = c->count == 0 ? law.lo : 0;
        for (int k = 0; k < c->count; ++k) {
            p->number[c->at + k] = law.first + k;
            p->scale[c->at + k] = c->count == 3 && k == 0 ? scale / law.friction : scale;
        }
    });
    ncp_barrier();
}

static __device__ __noinline__ void find_velocities(const ncp_island &s, const ncp_interior &p)
{
    each(s.numbers, [&](int32_t r) {
        double sum = p.free[r];
        for (int32_t c = 0; c < s.numbers; ++c) sum += s.G[r * s.stride + c] * s.lambda[c];
        s.u[r] = sum;
    });
    ncp_barrier();
}

/* Well inside, by `size`. */
static __device__ void begin_inside(const ncp_island &s, const ncp_interior &p, double size)
{
    each(s.laws, [&](int32_t i) {
        ncp_cone *c = &p.cone[i];
        double *x = p.x + c->at;
        if (c->count == 0) return;
        const bool low = c->lo > -INFINITY, high = c->hi < INFINITY;
        c->dual[0] = low ? size : 0;
        if (c->count == 3) {
            x[0] = size, x[1] = x[2] = 0;
            return;
        }
        x[0] = low && high ? c->lo + (c->hi - c->lo) / 2 : low ? c->lo + size : high ? c->hi - size : 0;
        c->dual[1] = high ? size : 0;
    });
    ncp_barrier();
}

/* y, what it is off by from the duals, and the complementarity. */
static __device__ __noinline__ void measure_interior(const ncp_island &s, ncp_interior *p, ncp_shared *shared)
{
    each(p->count, [&](int32_t i) { s.lambda[p->number[i]] = p->scale[i] * p->x[i]; });
    ncp_barrier();
    find_velocities(s, *p);
    each(p->count, [&](int32_t i) { p->y[i] = p->off[i] = p->scale[i] * s.u[p->number[i]]; });
    ncp_barrier();
    each(s.laws, [&](int32_t i) {
        ncp_cone *c = &p->cone[i];
        const double *x = p->x + c->at;
        double *off = p->off + c->at;
        c->product = 0;
        if (c->count == 3) {
            off[0] += hypot(p->y[c->at + 1], p->y[c->at + 2]);
            for (int k = 0; k < 3; ++k) off[k] -= c->dual[k];
            c->product = cone_product(x, c->dual);
        } else if (c->count == 1) {
            off[0] -= c->dual[0] - c->dual[1];
            if (c->lo > -INFINITY) c->product += (x[0] - c->lo) * c->dual[0];
            if (c->hi < INFINITY) c->product += (c->hi - x[0]) * c->dual[1];
        }
    });
    ncp_barrier();
    double sum = 0;
    for (int32_t i = 0; i < s.laws; ++i) sum += p->cone[i].product; /* by every thread alike */
    p->complementarity = sum / (p->degree > 0 ? p->degree : 1);
    (void)shared;
}

/* M^-1 in place, by Gauss and Jordan: entry (k, row[c]) of it is at (row[k], c). False: singular. */
static __device__ __noinline__ bool invert_matrix(const ncp_island &s, const ncp_interior &p, ncp_shared *shared)
{
    const int32_t n = p.count, stride = stride_of(n);
    each(n, [&](int32_t i) { s.pivot[i] = -1; });
    ncp_barrier();
#pragma unroll 1
    for (int32_t k = 0; k < n; ++k) {
        choose_pivot(s, n, stride, k, shared);
        ncp_barrier();
        const int32_t row = shared->pivot;
        if (row < 0) return false;
        const double inverse = 1 / s.M[row * stride + k];
        if (ncp_thread() == 0) p.row[k] = row;
        each_entry(n, n, [&](int32_t i, int32_t c) {
            if (i != row && c != k)
                s.M[i * stride + c] -= s.M[i * stride + k] * inverse * s.M[row * stride + c];
        });
        ncp_barrier();
        each(n, [&](int32_t i) {
            if (i != row) s.M[i * stride + k] *= -inverse;
            if (i != k) s.M[row * stride + i] *= inverse;
        });
        if (ncp_thread() == 0) s.M[row * stride + k] = inverse;
        ncp_barrier();
    }
    return true;
}

/* The inverse of G + the slip speeds' derivative + W^-2. */
static __device__ __noinline__ bool make_inverse(const ncp_island &s, const ncp_interior &p, ncp_shared *shared)
{
    const int32_t n = p.count, stride = stride_of(n);
    bool inside = true;
    each_entry(n, n, [&](int32_t r, int32_t c) {
        s.M[r * stride + c] = p.scale[r] * p.scale[c] * s.G[p.number[r] * s.stride + p.number[c]];
    });
    each(s.laws, [&](int32_t i) {
        ncp_cone *c = &p.cone[i];
        if (c->count == 3 && !cone_find_scaling(p.x + c->at, c->dual, &c->by, c->scaled)) inside = false;
    });
    if (any_of(!inside, shared)) return false;
    each_entry(s.laws, n, [&](int32_t i, int32_t t) { /* the normals' rows */
        const ncp_cone *c = &p.cone[i];
        if (c->count != 3) return;
        double *M = s.M + c->at * stride + t;
        const double *y = p.y + c->at, speed = hypot(y[1], y[2]);
        if (speed > 0) M[0] += (y[1] * M[stride] + y[2] * M[2 * stride]) / speed;
    });
    ncp_barrier();
    each(s.laws, [&](int32_t i) {
        const ncp_cone *c = &p.cone[i];
        double *M = s.M + c->at * stride + c->at;
        const double x = p.x[c->at];
        if (c->count == 1) {
            if (c->lo > -INFINITY) M[0] += c->dual[0] / (x - c->lo);
            if (c->hi < INFINITY) M[0] += c->dual[1] / (c->hi - x);
        }
        for (int r = 0; c->count == 3 && r < 3; ++r)
            for (int k = 0; k < 3; ++k) {
                const double sign = (r > 0) == (k > 0) ? 1 : -1, J = r != k ? 0 : r == 0 ? 1 : -1;
                M[r * stride + k] +=
                    (2 * sign * c->by.middle[r] * c->by.middle[k] - J) / (c->by.size * c->by.size);
            }
    });
    ncp_barrier();
    return invert_matrix(s, p, shared);
}

/* dx and the duals' steps towards products `aim`. Returns how much of them leads to the boundary; 0: they are no
 * numbers. */
static __device__ __noinline__ double find_step(const ncp_island &s, const ncp_interior &p, double aim, bool second,
                                   ncp_shared *shared)
{
    const int32_t n = p.count, stride = stride_of(n);
    each(s.laws, [&](int32_t i) {
        const ncp_cone *c = &p.cone[i];
        const double *off = p.off + c->at, x = p.x[c->at];
        double *right = p.right + c->at, want[3], back[3];
        for (int k = 0; k < c->count; ++k) right[k] = -off[k];
        if (c->count == 3) {
            cone_wanted(c->scaled, aim, second ? c->second : nullptr, want);
            cone_scale(&c->by, true, want, back);
            for (int k = 0; k < 3; ++k) right[k] += back[k];
        } else if (c->count == 1) {
            if (c->lo > -INFINITY) right[0] += bound_step(aim, second ? c->second[0] : 0, x - c->lo, c->dual[0], 0);
            if (c->hi < INFINITY) right[0] -= bound_step(aim, second ? c->second[1] : 0, c->hi - x, c->dual[1], 0);
        }
    });
    ncp_barrier();
    bool finite = true;
    each(n, [&](int32_t k) {
        double sum = 0;
        for (int32_t c = 0; c < n; ++c) sum += s.M[p.row[k] * stride + c] * p.right[p.row[c]];
        p.dx[k] = sum;
        if (!(fabs(sum) < INFINITY)) finite = false;
    });
    if (any_of(!finite, shared)) return 0;
    double most = 0; /* of 1 / way */
    each(s.laws, [&](int32_t i) {
        ncp_cone *c = &p.cone[i];
        const double *x = p.x + c->at, *dx = p.dx + c->at;
        double way = INFINITY;
        if (c->count == 3) {
            double want[3], changed[3];
            cone_wanted(c->scaled, aim, second ? c->second : nullptr, want);
            cone_scale(&c->by, true, dx, changed);
            for (int k = 0; k < 3; ++k) want[k] -= changed[k];
            cone_scale(&c->by, true, want, c->step);
            way = fmin(cone_way_to_boundary(x, dx), cone_way_to_boundary(c->dual, c->step));
        }
        for (int side = 0; c->count == 1 && side < 2; ++side) {
            const double nearer = side ? dx[0] : -dx[0], away = side ? c->hi - x[0] : x[0] - c->lo;
            if (!(away < INFINITY)) continue;
            c->step[side] = bound_step(aim, second ? c->second[side] : 0, away, c->dual[side], nearer);
            if (nearer > 0) way = fmin(way, away / nearer);
            if (c->step[side] < 0) way = fmin(way, -c->dual[side] / c->step[side]);
        }
        if (!(1 / way <= most)) most = 1 / way;
    });
    most = most_of(most, shared);
    return most > 0 ? 1 / most : INFINITY;
}

/* What the whole step would leave of products. */
static __device__ __noinline__ void find_second_order(const ncp_island &s, const ncp_interior &p)
{
    each(s.laws, [&](int32_t i) {
        ncp_cone *c = &p.cone[i];
        const double *dx = p.dx + c->at;
        double a[3], b[3];
        if (c->count == 1) c->second[0] = dx[0] * c->step[0], c->second[1] = -dx[0] * c->step[1];
        if (c->count != 3) return;
        cone_scale(&c->by, true, dx, a);
        cone_scale(&c->by, false, c->step, b);
        cone_multiply(a, b, c->second);
    });
    ncp_barrier();
}

/* Returns the share of the step that was gone; 0: there is none. */
static __device__ __noinline__ double step_inside(const ncp_island &s, const ncp_interior &p, ncp_shared *shared)
{
    if (!make_inverse(s, p, shared)) return 0;
    const double left = 1 - fmin(1.0, find_step(s, p, 0, false, shared));
    find_second_order(s, p);
    double way = find_step(s, p, left * left * left * p.complementarity, true, shared);
    if (way < NCP_SHORT) way = find_step(s, p, p.complementarity, false, shared);
    way = fmin(1.0, NCP_SHARE * way);
    if (!(way > 0)) return 0;
    each(p.count, [&](int32_t i) { p.x[i] += way * p.dx[i]; });
    each(s.laws, [&](int32_t i) {
        for (int k = 0; k < 3; ++k) p.cone[i].dual[k] += way * p.cone[i].step[k];
    });
    ncp_barrier();
    return way;
}

/* From u alone. lambda and u are those that it ends with; returns their natural map. */
static __device__ __noinline__ double go_inside(const ncp_island &s, ncp_memory memory, double *budget,
                                                ncp_shared *shared)
{
    ncp_interior p;
    if (!take_interior(s, &memory, &p)) return INFINITY;
    each(s.numbers, [&](int32_t r) {
        double sum = s.u[r];
        for (int32_t c = 0; c < s.numbers; ++c) sum -= s.G[r * s.stride + c] * s.lambda[c];
        p.free[r] = sum;
    });
    ncp_barrier();
    list_cones(s, &p, shared);
    find_velocities(s, p);
    double own = 0;
    each(p.count, [&](int32_t i) { own = fmax(own, fabs(p.scale[i] * s.u[p.number[i]])); });
    const double size = most_of(own, shared);
    begin_inside(s, p, size);
#pragma unroll 1
    for (int step = 0, brief = 0;; ++step) {
        measure_interior(s, &p, shared);
        const double map = look_at_laws(s, shared);
        if (!(map > NCP_AIM && map < INFINITY) || step == NCP_MOST_STEPS ||
            brief == NCP_MOST_SHORT || p.complementarity < NCP_LEAST_PRODUCT * size * size)
            return map;
        if (!affords(budget, 2 * elimination_of(p.count))) return map;
        const double way = step_inside(s, p, shared);
        if (way == 0) return map;
        brief = way < NCP_SHORT / 10 ? brief + 1 : 0;
    }
}

#endif
