/* Bodies of a step into the solver's form (assemble.cu), and with what joints stiffen them by. */
#ifndef SADMM_CUDA_ASSEMBLE_BODY_H
#define SADMM_CUDA_ASSEMBLE_BODY_H

#include "backend_cuda/device/body.h"
#include "backend_cuda/device/view.h"
#include "backend_cuda/device/wide.h"
#include "core/model/joint_law.h"
#include "core/model/system_math.h"
#include "stiffened.h"

/* A^-1, packed. */
static __device__ void invert(bool rigid, const double A[36], double out[PACKED])
{
    double packed[PACKED];
    for (int r = 0; r < 6; ++r)
        for (int k = 0; k <= r; ++k) packed[r * (r + 1) / 2 + k] = A[6 * r + k];
    if (rigid) packed_invert_rigid(packed, out);
    else packed_invert(A, out);
}

/* x . M x */
static __device__ double form(const double M[PACKED], const solver_real x[6])
{
    double wide[6];
    for (int k = 0; k < 6; ++k) wide[k] = (double)x[k];
    return packed_form(M, wide);
}

static_assert((int)ROW == 8 && (int)LINE_RIGID_A == 8, "each in a whole row");

/* A and b of body i, and where its solve starts from. ENERGIES: A^-1 and the energy of A^-1 b too. */
template <bool ENERGIES>
static __device__ __forceinline__ void put_body(const cuda_view &v, int32_t i, const double A[36], const double b[6])
{
    double x[6], factor[36];
    if (v.model.warm_start || !dense6_cholesky(A, factor)) {
        for (int k = 0; k < 6; ++k) x[k] = v.raw.system.velocity[6 * (size_t)i + (size_t)k];
    } else {
        dense6_solve(factor, b, x);
    }
    solver_real *line = v.bodies.lines + (size_t)i * (size_t)v.bodies.line;
    eight_numbers<solver_real> state = {}, row = {};
    for (int k = 0; k < 6; ++k) {
        state.of[k] = (solver_real)x[k];
        row.of[k] = (solver_real)b[k];
    }
    store_row(state, v.bodies.state, (size_t)i);
    store_row(row, v.bodies.b, (size_t)i);
    if (v.bodies.rigid) {
        eight_numbers<solver_real> own = {{(solver_real)A[0]}};
        for (int r = 0; r < 3; ++r)
            for (int k = 0; k <= r; ++k) own.of[1 + packed_place(r, k)] = (solver_real)A[6 * (r + 3) + k + 3];
        store_row(own, line, 0);
    } else {
        for (int r = 0; r < 6; ++r)
            for (int k = 0; k <= r; ++k) line[packed_place(r, k)] = (solver_real)A[6 * r + k];
        for (int k = PACKED; k < LINE_GENERAL_A; ++k) line[k] = 0;
    }
    if (ENERGIES) {
        double inverse[PACKED];
        invert(v.bodies.rigid, A, inverse);
        for (int k = 0; k < PACKED; ++k) v.bodies.A_inverse[PACKED * (size_t)i + (size_t)k] = inverse[k];
        v.bodies.free_energy[i] = form(inverse, row.of) / 2;
    }
}

/* ---- of bodies with joints --------------------------------------------------------------------------------------- */

static __device__ __forceinline__ struct cuda_articulation_body articulation_body_of(const double A[36],
                                                                                     const double b[6])
{
    const struct cuda_articulation_body body = {A[0],  {A[21], A[28], A[35], A[22], A[23], A[29]},
                                                {b[0], b[1], b[2], b[3], b[4], b[5]}};
    return body;
}
static __device__ __forceinline__ void take_articulation_body(const struct cuda_articulation_body &body, double A[36],
                                                              double b[6])
{
    for (int k = 0; k < 36; ++k) A[k] = 0;
    A[0] = A[7] = A[14] = body.mass;
    A[21] = body.inertia[0], A[28] = body.inertia[1], A[35] = body.inertia[2];
    A[22] = A[27] = body.inertia[3], A[23] = A[33] = body.inertia[4], A[29] = A[34] = body.inertia[5];
    for (int k = 0; k < 6; ++k) b[k] = body.b[k];
}

/* A and b of body i with what joints stiffen it by. */
static __device__ __noinline__ struct cuda_articulation_body stiffened_body(const cuda_view &v, int32_t i)
{
    const struct sadmm_settings settings = settings_of(v.model, i);
    const struct sadmm_rigid body = stiffened_rigid(v, i);
    const struct spin_system spin = spin_of_system(&body, settings.dt);
    double A[36], b[6];
    sadmm_system_rigid(&v.raw.system, &settings, &body, &spin, i, A, b);
    return articulation_body_of(A, b);
}

/* Force of joint j on the body at its side s. found: by the multipliers of the block direct solve, else by those that
 * the step starts with. All that is asked of a constraint's rows is asked for together. */
static __device__ __forceinline__ vec3 joint_force(const cuda_view &v, int32_t j, int s, bool found, double dt)
{
    const int32_t first = v.joints.first[j], constraints = v.joints.joints[j].constraints;
    vec3 force = v3(0, 0, 0);
    for (int32_t c = first; c < first + constraints; ++c) {
        const int32_t count = v.raw.constraints[c].count;
        double jacobian[SADMM_MAX_ROWS][3], lambda[SADMM_MAX_ROWS];
        int coordinate[SADMM_MAX_ROWS];
#pragma unroll
        for (int32_t r = 0; r < SADMM_MAX_ROWS; ++r) {
            const size_t slot = (size_t)c * SADMM_MAX_ROWS + (size_t)(r < count ? r : 0);
            coordinate[r] = v.joints.sources[slot].coordinate;
            lambda[r] = found ? v.joints.solution[slot] : v.raw.rows[slot].lambda;
            for (int k = 0; k < 3; ++k) jacobian[r][k] = v.raw.rows[slot].jacobian[s][k];
        }
#pragma unroll
        for (int32_t r = 0; r < SADMM_MAX_ROWS; ++r)
            if (r < count) force = stiffening_add_row(force, coordinate[r], jacobian[r], lambda[r], dt);
    }
    return force;
}

/* Calls f(place, force) for joints of body i, ascending. The target of a coupling is no body of it. */
template <class F>
static __device__ __forceinline__ void each_force(const cuda_view &v, int32_t i, bool found, double dt, const F &f)
{
    for (int32_t at = v.joints.first_at[i]; at < v.joints.first_at[i + 1]; ++at) {
        const int32_t j = v.joints.joints_at[at] / 2, s = v.joints.joints_at[at] % 2;
        f(v.joints.joints[j].frame[s].position, joint_force(v, j, s, found, dt));
    }
}

/* What joints stiffen body i by (world/step/joint_stiffen.c); is it another inertia than before? found: as above; else
 * the (sub-)step begins. */
static __device__ __noinline__ bool stiffen_body(const cuda_view &v, int32_t i, bool found)
{
    const struct sadmm_rigid *body = &v.step.before[i];
    const double dt = v.model.settings->dt;
    struct cuda_stiffening *own = &v.joints.stiffening[i];
    double most[3] = {0, 0, 0}, K[6] = {0, 0, 0, 0, 0, 0};
    if (!found) {
        const struct cuda_stiffening none = {};
        *own = none;
    }
    each_force(v, i, found, dt,
               [&](vec3 place, vec3 force) { stiffening_add_most(most, place, v3_norm(force)); });
    if (!own->any && !stiffening_may_be(body->inertia, dt, most)) return false;
    const mat3 frame = stiffening_frame(body, dt);
    each_force(v, i, found, dt,
               [&](vec3 place, vec3 force) { stiffening_add(K, place, m3_tmul(frame, force)); });
    if (!stiffening_renew(body->inertia, frame, dt, K, own->any != 0, own->more)) return false;
    own->any = 1;
    return true;
}

#endif
