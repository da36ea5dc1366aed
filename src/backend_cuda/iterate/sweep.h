/* What one thread does in Steps 1-4: shared by the stepwise and the persistent kernels, so that they agree bit for bit.
 * Pointers to states and records are to global or shared memory. */
#ifndef SADMM_CUDA_ITERATE_SWEEP_H
#define SADMM_CUDA_ITERATE_SWEEP_H

#include <string.h>

#include "core/math/contact.h"
#include "core/math/penalty.h"
#include "core/math/relax.h"
#include "backend_cuda/device/context.h"

#define CUDA_INLINE static __device__ __forceinline__

/* ---- memory --------------------------------------------------------------------------------------------------- */

CUDA_INLINE vec3 xyz(real4 a) { return v3(a.x, a.y, a.z); }
CUDA_INLINE real4 pack(vec3 a, real w)
{
    real4 out = {a.x, a.y, a.z, w};
    return out;
}

/* A value of 16 or 32 bytes, each sixteen by `load`. */
template <class T, class Load> CUDA_INLINE T load_parts(const T *from, Load load)
{
    enum { PARTS = sizeof(T) / sizeof(int4) };
    int4 parts[PARTS];
#pragma unroll
    for (int i = 0; i < PARTS; ++i) parts[i] = load((const int4 *)from + i);
    T value;
    memcpy(&value, parts, sizeof value);
    return value;
}

/* What this launch reads once: it leaves the caches before those that stay useful. */
template <class T> CUDA_INLINE T load_once(const T *from)
{
    return load_parts(from, [](const int4 *part) { return __ldcs(part); });
}

/* What is fetched before the wait of a PDL launch, and kernels before the last one have written: past the first-level
 * cache, which is not promised to know. */
template <class T> CUDA_INLINE T load_before_wait(const T *from)
{
    return load_parts(from, [](const int4 *part) { return __ldcg(part); });
}

/* v of a body. */
struct body_motion {
    vec3 linear, angular;
};

CUDA_INLINE body_motion load_motion(const solver_real *row)
{
    real4 lo = ((const real4 *)row)[0], hi = ((const real4 *)row)[1];
    body_motion m = {xyz(lo), v3(lo.w, hi.x, hi.y)};
    return m;
}

/* v and 1/beta of a body. */
struct body_row {
    body_motion motion;
    real inv_beta;
};

CUDA_INLINE body_row load_row(const solver_real *state, int32_t body)
{
    const real4 *row = (const real4 *)(state + (size_t)body * ROW);
    const real4 lo = row[0], hi = row[1];
    body_row out = {{xyz(lo), v3(lo.w, hi.x, hi.y)}, hi.z}; /* STATE_INV_BETA */
    return out;
}

CUDA_INLINE body_motion no_motion(void)
{
    body_motion m = {v3(0, 0, 0), v3(0, 0, 0)};
    return m;
}

CUDA_INLINE real inv_beta_of(const body_view &bodies, int32_t body)
{
    return bodies.state[(size_t)body * ROW + STATE_INV_BETA];
}

/* Component r < 6 of a wrench is number record_slot(r) of its record: force and torque are four apart. */
CUDA_INLINE int32_t record_slot(int32_t r) { return r < 3 ? r : r + 1; }

/* ---- fused products ------------------------------------------------------------------------------------------- */

/* a b + c, rounded once. The sources are compiled without contraction; where the iteration fuses it says so here, and
 * so does every tier. */
#ifdef SADMM_CUDA_EMULATED
CUDA_INLINE real fused(real a, real b, real c) { return a * b + c; }
#else
CUDA_INLINE float fused(float a, float b, float c) { return __fmaf_rn(a, b, c); }
CUDA_INLINE double fused(double a, double b, double c) { return __fma_rn(a, b, c); }
#endif

/* a + s b */
CUDA_INLINE vec3 fused_madd(vec3 a, real s, vec3 b)
{
    return v3(fused(s, b.x, a.x), fused(s, b.y, a.y), fused(s, b.z, a.z));
}
CUDA_INLINE real fused_dot(vec3 a, vec3 b) { return fused(a.z, b.z, fused(a.y, b.y, a.x * b.x)); }
CUDA_INLINE vec3 fused_cross(vec3 a, vec3 b)
{
    return v3(fused(a.y, b.z, -(a.z * b.y)), fused(a.z, b.x, -(a.x * b.z)), fused(a.x, b.y, -(a.y * b.x)));
}

/* ---- pairs ---------------------------------------------------------------------------------------------------- */

/* (v_b - v_a) + (w_b x r_b - w_a x r_a): with a and b changed places the same bits with the other sign. */
CUDA_INLINE vec3 relative_velocity(const body_motion &a, vec3 arm_a, const body_motion &b, vec3 arm_b)
{
    return v3_add(v3_sub(b.linear, a.linear), v3_sub(fused_cross(b.angular, arm_b), fused_cross(a.angular, arm_a)));
}

/* Multipliers of a point, a world vector. Without friction it is along the normal, since the projection's disc is a
 * point. */
CUDA_INLINE vec3 load_lambda(const contact_view &contacts, size_t slot)
{
    const solver_real *lambda = contacts.lambda + slot;
    return v3(lambda[0], lambda[contacts.lambda_stride], lambda[2 * contacts.lambda_stride]);
}

CUDA_INLINE void store_lambda(const contact_view &contacts, size_t slot, vec3 lambda)
{
    contacts.lambda[slot] = lambda.x;
    contacts.lambda[contacts.lambda_stride + slot] = lambda.y;
    contacts.lambda[2 * contacts.lambda_stride + slot] = lambda.z;
}

/* Of x > 0 that is no denormal; 2 units of rounding. */
#ifdef SADMM_CUDA_EMULATED
CUDA_INLINE float inverse_sqrt(float x) { return 1 / sqrtf(x); }
#else
CUDA_INLINE float inverse_sqrt(float x)
{
    float y;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(y) : "f"(x));
    return y;
}
#endif
CUDA_INLINE double inverse_sqrt(double x) { return rsqrt(x); }

/* What contact_project() makes of lambda: normal n + scale tangent. */
struct cone_parts {
    vec3 tangent;
    real normal, scale;
    bool slides; /* scale is not 1; so where the normal part is 0 */
};

/* With one inverse square root for a square root and a division. */
CUDA_INLINE cone_parts cone_parts_of(vec3 lambda, vec3 n, real mu)
{
    const real ln = fused_dot(n, lambda);
    cone_parts out;
    out.tangent = fused_madd(lambda, -ln, n);
    out.normal = ln > 0 ? ln : (real)0;
    const real limit = mu * out.normal, t2 = real_max(fused_dot(out.tangent, out.tangent), (real)FLT_MIN);
    out.slides = t2 > limit * limit;
    out.scale = out.slides ? limit * inverse_sqrt(t2) : (real)1;
    return out;
}

CUDA_INLINE vec3 project(vec3 lambda, vec3 n, real mu)
{
    const cone_parts parts = cone_parts_of(lambda, n, mu);
    return fused_madd(v3_scale(n, parts.normal), parts.scale, parts.tangent);
}

/* Steps 2-4 of one point: x = J v, error e. With x, error and inv_s of the other sign the same bits. */
CUDA_INLINE vec3 update_point(vec3 normal, real friction, vec3 x, real error, real inv_s, vec3 old)
{
    return project(fused_madd(old, -inv_s, fused_madd(x, error, normal)), normal, friction);
}

/* The same for the method `fast`: lambda^, and lambda^ - lambda, where the contact sticks without the rounding of
 * either. */
struct point_change {
    vec3 lambda, delta;
};
CUDA_INLINE point_change change_point(vec3 normal, real friction, vec3 x, real error, real inv_s, vec3 old)
{
    point_change out;
    const vec3 step = v3_scale(fused_madd(x, error, normal), -inv_s), y = v3_add(old, step);
    const cone_parts parts = cone_parts_of(y, normal, friction);
    out.lambda = parts.slides ? fused_madd(v3_scale(normal, parts.normal), parts.scale, parts.tangent) : y;
    /* what does not wait for the root comes first */
    out.delta =
        parts.slides ? fused_madd(fused_madd(v3_neg(old), parts.normal, normal), parts.scale, parts.tangent) : step;
    return out;
}

/* Either, by the method. */
template <bool FAST>
CUDA_INLINE point_change update(vec3 normal, real friction, vec3 x, real error, real inv_s, vec3 old)
{
    if (FAST) return change_point(normal, friction, x, error, inv_s, old);
    const vec3 lambda = update_point(normal, friction, x, error, inv_s, old);
    const point_change out = {lambda, v3_sub(lambda, old)};
    return out;
}

/* Largest |d lambda| over the rows of the contact. */
CUDA_INLINE real largest_row(vec3 normal, vec3 delta)
{
    vec3 t1, t2;
    v3_tangents(normal, &t1, &t2);
    return real_max(real_abs(v3_dot(delta, normal)),
                    real_max(real_abs(v3_dot(delta, t1)), real_abs(v3_dot(delta, t2))));
}

/* ---- relaxation of the method `fast` (math/relax.h) -------------------------------------------------------------- */

/* Multipliers that go `relaxation_factor` times as far as lambda^: rho, or 1 where an iteration is plain. */
CUDA_INLINE vec3 relaxed(vec3 old, const point_change &to, bool plain, real relaxation_factor)
{
    return plain ? to.lambda : fused_madd(old, relaxation_factor, to.delta);
}

/* 1/B of a pair from B / n. */
CUDA_INLINE real inverse_of_weight(real inv_s, bool both) { return inv_s > 0 ? 1 / ((both ? 2 : 1) * inv_s) : (real)0; }

/* ---- bodies --------------------------------------------------------------------------------------------------- */

/* Lane r's part of a body: rows r of A and H (which are symmetric), v, and b or, of the method `fast`, the momentum
 * residual; all 0 in lanes 6 and 7. */
struct body_lane {
    real A[6], H[6], b, v;
};

CUDA_INLINE body_lane load_body(bool live, int32_t r, const solver_real *line, bool rigid, const solver_real *b,
                                const solver_real *state)
{
    body_lane body = {};
    if (!live || r >= 6) return body;
    const solver_real *H = line_h(line, rigid);
    body.b = b[r];
    body.v = state[r];
#pragma unroll
    for (int k = 0; k < 6; ++k) {
        if (rigid) { /* fetched in any case, as in row_of_body */
            const bool turns = r >= 3 && k >= 3, on = turns || k == r;
            const solver_real a = line[turns ? 1 + packed_place(r - 3, k - 3) : 0];
            body.A[k] = on ? a : (solver_real)0;
        } else body.A[k] = line[packed_place(r, k)];
        body.H[k] = H[packed_place(r, k)];
    }
    return body;
}

/* b - A v. Every lane of the warp comes here. */
CUDA_INLINE real free_momentum(const body_lane &body)
{
    real g = body.b;
#pragma unroll
    for (int k = 0; k < 6; ++k) g = fused(-body.A[k], __shfl_sync((unsigned)ALL_LANES, body.v, k, LANES), g);
    return g;
}

/* A row of H times g: two chains, half as long. */
CUDA_INLINE real product_with_row(real h0, real h1, real h2, real h3, real h4, real h5, const real g[6])
{
    return fused(h4, g[4], fused(h2, g[2], h0 * g[0])) + fused(h5, g[5], fused(h3, g[3], h1 * g[1]));
}

/* H g, lane r's component of g being b - A v + J^T E. Every lane of the warp comes here. */
CUDA_INLINE real step_of(const body_lane &body, real g)
{
    real other[6];
#pragma unroll
    for (int k = 0; k < 6; ++k) other[k] = __shfl_sync((unsigned)ALL_LANES, g, k, LANES);
    const real *H = body.H;
    return product_with_row(H[0], H[1], H[2], H[3], H[4], H[5], other);
}

/* The method `fast`, with sum = J^T d lambda: v goes by rho H (r + 2 sum), and the momentum residual r with what v has
 * gone by in truth and with multipliers that have gone `multipliers` times as far as lambda^. */
CUDA_INLINE real step_fast(body_lane *body, real sum, real relaxation)
{
    const real before = body->v;
    body->v = fused(relaxation, step_of(*body, fused((real)2, sum, body->b)), before);
    return body->v - before;
}

/* Every lane of the warp comes here. */
CUDA_INLINE real residual_after(const body_lane &body, real sum, real step, real multipliers)
{
    real r = fused(multipliers, sum, body.b);
#pragma unroll
    for (int k = 0; k < 6; ++k) r = fused(-body.A[k], __shfl_sync((unsigned)ALL_LANES, step, k, LANES), r);
    return r;
}

#endif
