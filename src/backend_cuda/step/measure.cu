/* How well each of many equal worlds (core/solve/resident.h) was solved in the last step, in double: the natural map of
 * its contacts and rows at the multipliers and velocities that came of it (core/solve/solve_error.c), what is deepest,
 * and which joints are open. A thread a body, a pair, a constraint, a joint. */
#include <string.h>

#include <algorithm>

#include "backend_cuda/device/double.h"

#include "core/math/contact.h"
#include "core/math/ldl6.h"
#include "core/math/row.h"
#include "core/model/joint_close.h"
#include "core/model/stiffening.h"
#include "core/model/system_math.h"
#include "joint_bodies.h"
#include "move.h" /* is_solved */
#include "world.h"

enum { MEASURE_THREADS = 128, FACTOR = 36 };

struct measure_args {
    struct sadmm_resident_copies copies;
    double *velocity;                     /* bodies x 6 */
    double *factor;                       /* bodies x FACTOR: L D L^T of A */
    unsigned long long *law;              /* bodies: at labels of islands, bits of the largest natural map, m/s */
    struct sadmm_copy_measures *measures; /* worlds; of errors and lengths bits of numbers >= 0 */
    int32_t pairs;
    bool checked;                         /* there was a stop rule */
};

static __device__ __forceinline__ int32_t thread_of(void)
{
    return (int32_t)(blockIdx.x * MEASURE_THREADS + threadIdx.x);
}

/* Bits of numbers >= 0 order as these do, and those of what is no number come last. */
static __device__ __forceinline__ void raise(void *number, double x)
{
    const unsigned long long bits = x == 0 ? 0 : (unsigned long long)__double_as_longlong(x);
    if (bits != 0) atomicMax((unsigned long long *)number, bits);
}

static __global__ void __launch_bounds__(MEASURE_THREADS)
    bodies_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ measure_args a)
{
    const int32_t i = thread_of();
    if (i >= v.model.bodies) return;
    double *velocity = a.velocity + 6 * (size_t)i, A[36], b[6];
    /* Bodies that joints move need not end with what was solved for. */
    const bool joints = v.joints.count > 0 && (!v.joints.apart || v.joints.is_articulated[i]);
    for (size_t k = 0; k < 6; ++k)
        velocity[k] = joints ? v.joints.velocity[6 * (size_t)i + k] : v.step.after[i].velocity[k];
    const struct sadmm_settings settings = settings_of(v.model, i);
    struct sadmm_rigid body = v.raw.system.rigid[i];
    if (v.joints.count > 0 && v.joints.stiffening[i].any) {
        const struct sadmm_rigid own = body;
        stiffening_set(&body, own.stiffness, settings.dt, v.joints.stiffening[i].more);
    }
    const struct spin_system spin = spin_of_system(&body, settings.dt);
    struct sadmm_system system = v.raw.system;
    system.support_motion = nullptr;
    sadmm_system_rigid(&system, &settings, &body, &spin, i, A, b);
    ldl6_factor(A, a.factor + FACTOR * (size_t)i);
    a.law[i] = 0;
}

static __device__ __forceinline__ double response_of(const double *factor, const double row[6])
{
    double y[6], sum = 0;
    for (int k = 0; k < 6; ++k) y[k] = row[k];
    ldl6_forward(factor, y);
    for (int k = 0; k < 6; ++k) sum += y[k] * y[k] * factor[7 * k];
    return sum;
}

static __device__ __forceinline__ double natural_map(const double lambda[3], const double u[3], double friction,
                                                     const double response[3])
{
    const double w = friction > 0 ? fmax(response[0], fmax(response[1], response[2])) : response[0];
    double residual[3];
    contact_residual_rows(lambda, u, friction, w, residual);
    return sqrt(residual[0] * residual[0] + residual[1] * residual[1] + residual[2] * residual[2]) * w;
}

/* Of point k of a pair. */
static __device__ __noinline__ double point_map(const cuda_view &v, const measure_args &a, const sadmm_system &system,
                                                const sadmm_settings &settings, const sadmm_contact_pair &pair,
                                                int32_t k)
{
    const struct sadmm_contact_point *points = &v.raw.points[pair.first], *point = &points[k];
    const mat3 frame = sadmm_contact_frame(pair.normal);
    const vec3 lambda = m3_mul(frame, v3_load(point->impulse)),
               x = m3_mul(frame, sadmm_contact_velocity(&system, &pair, point));
    const double l[3] = {lambda.x, lambda.y, lambda.z},
                 u[3] = {x.x + sadmm_contact_e(&system, &settings, &pair, points, k), x.y, x.z};
    double response[3] = {0, 0, 0};
    for (int side = 0; side < 2; ++side) {
        const int32_t body = side ? pair.body_b : pair.body_a;
        if (body < 0) continue;
        const vec3 arm = v3_load(side ? point->arm_b : point->arm_a);
        for (int i = 0; i < (pair.friction > 0 ? 3 : 1); ++i) {
            double row[6];
            v3_store(frame.r[i], row);
            v3_store(v3_cross(arm, frame.r[i]), row + 3);
            response[i] += response_of(a.factor + FACTOR * (size_t)body, row);
        }
    }
    return natural_map(l, u, pair.friction, response);
}

static __global__ void __launch_bounds__(MEASURE_THREADS)
    pairs_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ measure_args a)
{
    const int32_t p = thread_of();
    if (p >= a.pairs) return;
    const struct sadmm_contact_pair pair = v.raw.pairs[p];
    const int32_t body = pair.body_a >= 0 ? pair.body_a : pair.body_b;
    const struct sadmm_settings settings = *v.model.settings;
    struct sadmm_system system = v.raw.system;
    system.velocity = a.velocity;
    system.support_motion = nullptr;
    double worst = 0, deepest = 0;
    for (int32_t k = 0; k < pair.count; ++k) {
        const double map = point_map(v, a, system, settings, pair, k),
                     depth = -v.raw.points[pair.first + k].separation;
        worst = !(map <= worst) ? map : worst;
        deepest = depth > deepest ? depth : deepest;
    }
    struct sadmm_copy_measures *measures = &a.measures[body / a.copies.bodies];
    atomicAdd(&measures->contacts, pair.count);
    raise(&measures->penetration_max, deepest);
    raise(&a.law[v.graph.label[body]], worst);
}

static __global__ void __launch_bounds__(MEASURE_THREADS)
    rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ measure_args a)
{
    const int32_t c = thread_of();
    if (c >= v.joints.first_gear + v.joints.gears) return;
    const struct sadmm_row_constraint constraint = v.raw.constraints[c];
    if (constraint.count == 0 || (constraint.body_a < 0 && constraint.body_b < 0)) return;
    double worst = 0;
    for (int32_t r = 0; r < constraint.count; ++r) {
        const size_t at = (size_t)c * SADMM_MAX_ROWS + (size_t)r;
        const struct raw_row row = v.raw.rows[at];
        double x = 0, response = 0;
        for (int side = 0; side < 2; ++side) {
            const int32_t body = side ? constraint.body_b : constraint.body_a;
            if (body < 0) continue;
            x += six_product(row.jacobian[side], a.velocity + 6 * (size_t)body);
            response += response_of(a.factor + FACTOR * (size_t)body, row.jacobian[side]);
        }
        if (response == 0) continue;
        const double map = row_natural_map(row.gain, row.bias, row.compliance, row.lo, row.hi, x,
                                           v.joints.solution[at], response);
        worst = !(map <= worst) ? map : worst;
    }
    raise(&a.law[v.graph.label[constraint.body_a >= 0 ? constraint.body_a : constraint.body_b]], worst);
}

/* Joints as they are after the step. */
static __global__ void __launch_bounds__(MEASURE_THREADS)
    openings_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ measure_args a)
{
    const int32_t j = thread_of();
    if (j >= a.copies.count * a.copies.joints) return;
    const struct sadmm_resident_joint *joint = &v.joints.joints[j];
    if (!joint_closes(v.joints, j)) return;
    struct joint_end ends[2];
    for (int s = 0; s < 2; ++s) {
        const int32_t body = joint->body[s];
        const struct sadmm_rigid *rigid = body >= 0    ? &v.step.after[body]
                                          : body == -1 ? nullptr
                                                       : &v.kinematic.after[sadmm_kinematic(body)].rigid;
        ends[s] = joint_end_on(&joint->frame[s], rigid);
    }
    raise(&a.measures[j / a.copies.joints].joint_drift, joint_opening(&joint->def, ends));
}

/* Islands, at their labels. */
static __global__ void __launch_bounds__(MEASURE_THREADS)
    islands_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ measure_args a)
{
    const int32_t i = thread_of();
    if (i >= v.model.bodies || v.graph.label[i] != i) return;
    const struct sadmm_settings settings = *v.model.settings;
    const double law = __longlong_as_double((long long)a.law[i]);
    struct sadmm_copy_measures *measures = &a.measures[i / a.copies.bodies];
    const bool direct = v.ncp.points && is_solved(v, i);
    const int32_t stopped = v.islands.info ? v.islands.info[i].stopped : 0;
    atomicMax(&measures->iterations, direct ? 0 : a.checked && stopped > 0 ? stopped : settings.iterations);
    raise(&measures->error, law);
    if (a.checked && !(law <= settings.tolerance)) atomicAdd(&measures->unsolved, 1);
}

static sadmm_status run(struct sadmm_context *c, void (*kernel)(const cuda_view, const measure_args), int64_t threads,
                        const measure_args &args, struct sadmm_error *error)
{
    const unsigned blocks = (unsigned)((threads + MEASURE_THREADS - 1) / MEASURE_THREADS);
    if (blocks == 0) return SADMM_OK;
    c->kernel = "measures of environments";
#ifdef SADMM_CUDA_EMULATED
    CUDA_CALL(c, cuda_emulation_launch(kernel, blocks, (unsigned)MEASURE_THREADS, (size_t)0, c->view, args), c->kernel);
#else
    void *parameters[] = {&c->view, const_cast<measure_args *>(&args)};
    CUDA_CALL(c, cudaLaunchKernel((const void *)kernel, dim3(blocks), dim3(MEASURE_THREADS), parameters, 0, c->stream),
              c->kernel);
#endif
    return SADMM_OK;
}

/* The last (sub-)step's view, contacts as it has left them. */
static void view_last(struct sadmm_context *c)
{
    const struct cuda_step *s = c->step;
    const int into = 1 - s->into, substeps = s->last_settings.substeps;
    CUDA(view_into)(c, into, substeps - 1);
    if (s->last_hits)
        c->view.raw.system.rigid =
            buffer<struct sadmm_rigid>(c, BUFFER_WORLD_HIT) + (size_t)into * (size_t)s->bodies; /* after them */
}

extern "C" sadmm_status CUDA(measure)(struct sadmm_context *c, const struct sadmm_resident_copies *copies,
                                      struct sadmm_copy_measures *out, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)copies->count, bodies = (size_t)s->bodies;
    memset(out, 0, n * sizeof *out);
    if (s->done == 0) return SADMM_OK;
    CUDA_ENTER(c);
    TRY(CUDA(reserve)(c, BUFFER_MEASURES,
                      (bodies * (6 + FACTOR + 1)) * sizeof(double) + n * sizeof(struct sadmm_copy_measures), error));
    double *numbers = buffer<double>(c, BUFFER_MEASURES);
    const measure_args args = {*copies,
                               numbers,
                               numbers + 6 * bodies,
                               (unsigned long long *)(numbers + (6 + FACTOR) * bodies),
                               (struct sadmm_copy_measures *)(numbers + (6 + FACTOR + 1) * bodies),
                               s->last.counts.pairs,
                               stop_rule_checked(c)};
    CUDA_CALL(c, cudaMemsetAsync(args.measures, 0, n * sizeof *out, c->stream), "cudaMemsetAsync(measures)");
    view_last(c);
    TRY(run(c, bodies_kernel, (int64_t)bodies, args, error));
    TRY(run(c, pairs_kernel, args.pairs, args, error));
    if (s->joints + s->gears > 0) TRY(run(c, rows_kernel, s->joint_constraints, args, error));
    if (s->joints > 0) TRY(run(c, openings_kernel, (int64_t)n * copies->joints, args, error));
    TRY(run(c, islands_kernel, (int64_t)bodies, args, error));
    CUDA(view_into)(c, s->into, 0);
    return CUDA(get)(c, out, args.measures, n * sizeof *out, error);
}
