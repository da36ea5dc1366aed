/* Kernels A-D: raw bodies, contacts and blocks, as core has them, into this precision's layout. */
#include "backend_cuda/device/double.h"
#include "backend_cuda/device/wide.h"

#include "assemble.h"
#include "body.h"
#include "side_sums.h"

/* ---- bodies --------------------------------------------------------------------------------------------------- */

/* ENERGIES: as of put_body. JOINTS: of a step of a world with joints, whose rows are made. */
template <bool ENERGIES, bool JOINTS>
static __global__ void __launch_bounds__(BODY_THREADS)
    assemble_bodies_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    int32_t i = (int32_t)(blockIdx.x * (unsigned)BODY_THREADS + threadIdx.x);
    if (i >= v.model.bodies || v.model.live->abort_code) return; /* may run before the step's contacts are known */
    if (i == 0) clear_counts(v.islands);
    if (v.islands.touch) v.islands.touch[i] = 0;
    if (JOINTS) v.joints.touch[i] = v.joints.closed[i].closed = 0;
    if (v.push.bits) {
        if (i == 0) v.push.due[0] = v.push.due[1] = v.push.due[2] = 0; /* enum push_number */
        v.push.bits[i] = 0;
        v.push.units[i] = 0;
    }
    if (args.paper && ENERGIES) {
        v.islands.info[i].anchored = v.islands.info[i].anchored_outside = v.islands.info[i].rows = 0;
        v.islands.info[i].slow_down = 1;
    }
    const bool stiffened = JOINTS && stiffen_body(v, i, false);
    double A[36], b[6];
    const struct sadmm_settings settings = settings_of(v.model, i);
    if (v.raw.system.rigid) {
        const struct sadmm_rigid *state = wide_at(v.raw.system.rigid, (size_t)i);
        const struct spin_system spin = spin_of_system(state, settings.dt);
        eight_numbers<double> halfway = {};
        q_store(spin.orientation, halfway.of);
        v3_store(spin.angular, halfway.of + HALFWAY_ANGULAR);
        store_row(halfway, v.bodies.halfway, (size_t)i);
        sadmm_system_rigid(&v.raw.system, &settings, state, &spin, i, A, b);
    } else {
        sadmm_system_body(&v.raw.system, &settings, i, A, b);
    }
    if (stiffened) take_articulation_body(stiffened_body(v, i), A, b);
    if (JOINTS && (v.joints.is_articulated[i] || v.ncp.points)) v.joints.bodies[i] = articulation_body_of(A, b);
    put_body<ENERGIES>(v, i, A, b);
}

static sadmm_status launch_bodies(struct sadmm_context *c, struct sadmm_error *error)
{
    const bool energies = c->fast || c->plan.momentum;
    const cuda_kernel kernel =
        c->view.joints.count > 0
            ? (energies ? assemble_bodies_kernel<true, true> : assemble_bodies_kernel<false, true>)
            : (energies ? assemble_bodies_kernel<true, false> : assemble_bodies_kernel<false, false>);
    cuda_args args = {};
    args.paper = !c->fast;
    return CUDA(launch_of)(c, kernel, "assemble_bodies",
                           ((int64_t)c->view.model.bodies + BODY_THREADS - 1) / BODY_THREADS, BODY_THREADS, &args,
                           error);
}

extern "C" sadmm_status CUDA(assemble_bodies)(struct sadmm_context *c, struct sadmm_error *error)
{
    const struct sadmm_system *system = c->system;
    const cuda_view *v = &c->view;
    size_t n = (size_t)v->model.bodies, at = 0;
    CUDA_ENTER(c);
    if (c->plan.rigid) {
        at = n * sizeof *system->rigid;
        TRY(CUDA(upload)(c, (void *)v->raw.system.rigid, PINNED_BODIES, 0, system->rigid, at, error));
    } else {
        size_t bytes = 36 * n * sizeof(double);
        TRY(CUDA(upload)(c, (void *)v->raw.system.A, PINNED_BODIES, 0, system->A, bytes, error));
        TRY(
            CUDA(upload)(c, (void *)v->raw.system.b, PINNED_BODIES, bytes, system->b, 6 * n * sizeof(double), error));
        at = 42 * n * sizeof(double);
    }
    TRY(
        CUDA(upload)(c, v->raw.system.velocity, PINNED_BODIES, at, system->velocity, 6 * n * sizeof(double), error));
    const size_t kinematic = 6 * (size_t)system->kinematic_count * sizeof(double);
    at += 6 * n * sizeof(double);
    TRY(CUDA(upload)(c, (void *)v->raw.system.kinematic, PINNED_BODIES, at, system->kinematic, kinematic, error));
    if (system->support_motion)
        TRY(CUDA(upload)(c, (void *)v->raw.system.support_motion, PINNED_BODIES, at + kinematic, system->support_motion,
                         6 * n * sizeof(double), error));
    return launch_bodies(c, error);
}

/* ---- contacts given by geometry -------------------------------------------------------------------------------- */

static __device__ real4 pack(vec3 a, double w)
{
    real4 out = {(solver_real)a.x, (solver_real)a.y, (solver_real)a.z, (solver_real)w};
    return out;
}

/* Row of a pair's kinematic body in the states: its motion about the other one's centre of mass, whose arms the pair
 * has. */
static __device__ __noinline__ int32_t store_kinematic(const cuda_view &v, const struct sadmm_contact_pair *pair,
                                                       int32_t p)
{
    const int32_t row = v.model.bodies + 1 + p;
    solver_real *state = v.bodies.state + (size_t)row * ROW;
    double motion[6];
    sadmm_kinematic_about_other(&v.raw.system, pair, v.raw.points + pair->first, motion);
    for (int k = 0; k < ROW; ++k) state[k] = k < 6 ? (solver_real)motion[k] : (solver_real)0;
    return row;
}

static __device__ __forceinline__ bool touches_articulation(const joint_view &joints,
                                                            const struct sadmm_contact_pair *pair)
{
    return (pair->body_a >= 0 && joints.is_articulated[pair->body_a]) ||
           (pair->body_b >= 0 && joints.is_articulated[pair->body_b]);
}

/* contacts.lanes threads a pair, each every contacts.lanes-th point; the first also what the points share. FAST:
 * records of sides, too. BOUNCES: a pair may have restitution. */
template <bool FAST, bool BOUNCES>
static __global__ void __launch_bounds__(BODY_THREADS)
    assemble_contacts_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t t = (int32_t)(blockIdx.x * (unsigned)BODY_THREADS + threadIdx.x), p = t / v.contacts.lanes,
                  lane = t % v.contacts.lanes;
    const bool live = p < live_pairs(v.model);
    const struct sadmm_contact_pair *pair = wide_at(v.raw.pairs, live ? (size_t)p : 0);
    if (v.joints.count > 0 && live && lane == 0 && touches_articulation(v.joints, pair))
        v.step.control->joints.together = 1;
    if (!FAST && !live) return;
    /* Those that count are fetched here, not where they are needed. */
    const struct sadmm_settings settings = *v.model.settings;
    const struct sadmm_contact_point *points = wide_at(v.raw.points, live ? (size_t)pair->first : 0);
    const vec3 normal = live ? v3_load(pair->normal) : v3(0, 0, 0);
    const bool a = live && pair->body_a >= 0, b = live && pair->body_b >= 0;
    /* A pair of more points than the step was planned for aborts it (device/step.h), but later: until then it has as
     * many. */
    const int32_t count = !live ? 0 : pair->count <= v.contacts.point_slots ? pair->count : v.contacts.point_slots;
    vec3 between = v3(0, 0, 0);
    if (a && b && count > 0 && (FAST || lane == 0))
        between = v3_sub(v3_load(points[0].arm_b), v3_load(points[0].arm_a));
    pair_bodies ends = {a ? pair->body_a : v.model.bodies, b ? pair->body_b : v.model.bodies, -1, -1};
    if (v.raw.system.kinematic_count > 0 && live && sadmm_body_is_kinematic(a ? pair->body_b : pair->body_a))
        *(a ? &ends.body_b : &ends.body_a) = store_kinematic(v, pair, p);
    const real4 about = pack(normal, live ? solver_friction(v.model, pair->friction) : 0),
                difference = pack(between, count);
    if (live && lane == 0) {
        v.contacts.normal[p] = about;
        v.contacts.difference[p] = difference;
        v.contacts.bodies[p] = ends;
    }
    struct pair_sums sums = {};
    rigid_inverse inverse = {};
    if (FAST && v.bodies.rigid && side_of_lane(v.contacts, lane) >= 0) { /* asked for early: it is from far away */
        const int32_t body = lane == 0 ? ends.body_a : lane == 1 ? ends.body_b : v.model.bodies;
        if (body < v.model.bodies) inverse = inverse_of_body(v.bodies, body);
    }
    for (int32_t k = lane; k < count; k += v.contacts.lanes) {
        const size_t slot = point_slot(v.contacts, p, k);
        vec3 impulse = v.model.warm_start ? v3_load(points[k].impulse) : v3(0, 0, 0);
        if (v.model.contact_rows == 1) impulse = v3_scale(normal, v3_dot(normal, impulse)); /* the row there is */
        const double error = BOUNCES ? sadmm_contact_e(&v.raw.system, &settings, pair, points, k)
                                     : sadmm_contact_e_plain(&v.raw.system, &settings, &points[k]);
        const real4 arm = pack(v3_load(a ? points[k].arm_a : points[k].arm_b), error);
        const solver_real lambda[3] = {(solver_real)impulse.x, (solver_real)impulse.y, (solver_real)impulse.z};
        v.contacts.arm[slot] = arm;
        for (int j = 0; j < 3; ++j) v.contacts.lambda[(size_t)j * v.contacts.lambda_stride + slot] = lambda[j];
        if (FAST) add_point(v.model, v.bodies, ends, about, difference, arm, lambda, true, &sums);
    }
    if (FAST)
        store_sides(v.model, v.bodies, v.contacts, v.weights, live, p, lane, count, ends, (double)about.w, difference,
                    true, live && sadmm_pair_rolls(pair, points), inverse, &sums);
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(assemble_contacts)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    CUDA_ENTER(c);
    const cuda_kernel kernel =
        c->fast ? (c->bounces ? assemble_contacts_kernel<true, true> : assemble_contacts_kernel<true, false>)
                : (c->bounces ? assemble_contacts_kernel<false, true> : assemble_contacts_kernel<false, false>);
    return CUDA(launch_of)(
        c, kernel, "assemble_contacts",
        ((int64_t)c->view.contacts.pair_capacity * c->view.contacts.lanes + BODY_THREADS - 1) / BODY_THREADS,
        BODY_THREADS, &args, error);
}

sadmm_status CUDA(enqueue_bodies)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch_bodies(c, error);
}
