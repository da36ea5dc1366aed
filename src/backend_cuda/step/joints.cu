/* Joints of a world on the device (docs/internals/algorithm.md, "Joints"): the host's formulas (core/model/joint_law.h,
 * joint_trapezoid.h), in double.
 *
 *   rows      a lane a side of a joint: how its body acts; a lane a joint: its geometry; then eight lanes a joint, one
 *             a coordinate: its laws as raw rows, as the host would make them. A joint has a fixed number of
 *             constraints; its rows fill the first ones, the rest join no bodies
 *   solution  a thread a joint: multipliers into what it keeps; lanes of a pair: may the bodies of its island move by
 *             the means of their velocities? Commit, or turn, moves them then (kernels.cu); or
 *   move      those that are apart (device/step.h)
 */
#include <string.h>

#include "backend_cuda/device/double.h"
#include "core/base/memory.h"

#include "backend_cuda/assemble/assemble.h"
#include "core/model/coupling_law.h"
#include "core/model/joint_trapezoid.h"
#include "joint_bodies.h"
#include "move_articulated.h"
#include "world.h"

/* What the end of a sub-step needs of a joint's geometry in its middle. */
struct cuda_joint_middle {
    vec3 axis[JOINT_COORDINATES];
    quat frame;
    vec3 arm_b;
};

/* ---- rows -------------------------------------------------------------------------------------------------------- */

enum { ROWS_THREADS = 64 }; /* a block: long work, many multiprocessors */
enum { ROWS_JOINTS = 16 };  /* of a block that makes rows: a warp of sides */

static __device__ __forceinline__ int or_lanes(int bits)
{
#pragma unroll
    for (int o = 1; o < LANES; o *= 2) bits |= __shfl_xor_sync((unsigned)ALL_LANES, bits, o);
    return bits;
}

/* Where the lane's laws begin in its joint's rows: what is locked first, coordinates ascending; *all: of the joint.
 * Every lane of the warp comes here. */
static __device__ __forceinline__ int place_laws(int count, bool locked, int lane, int *all)
{
    int at = 0, total = 0;
#pragma unroll
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        const int other = __shfl_sync((unsigned)ALL_LANES, count, k, LANES);
        const bool other_locked = __shfl_sync((unsigned)ALL_LANES, (int)locked, k, LANES) != 0;
        total += other;
        at += other_locked != locked ? (other_locked ? other : 0) : k < lane ? other : 0;
    }
    *all = total;
    return at;
}

static __device__ __forceinline__ void store_row(const cuda_view &v, const struct acting_joint &acting,
                                                 const struct joint_law &law, int32_t joint, size_t slot, double start)
{
    struct raw_row row;
    for (int s = 0; s < 2; ++s) {
        for (int j = 0; j < 6; ++j) row.jacobian[s][j] = 0;
        if (acting.side[s].system_body < 0) continue;
        joint_step_row(&acting, s, law.coordinate, row.jacobian[s]);
        for (int j = 0; j < 6; ++j) row.jacobian[s][j] *= law.sign;
    }
    row.gain = law.gain, row.bias = law.bias, row.compliance = law.compliance;
    row.lo = law.lo, row.hi = law.hi;
    row.lambda = start;
    const_cast<struct raw_row *>(v.raw.rows)[slot] = row;
    const struct sadmm_joint_source source = {joint,    (int8_t)law.role, (int8_t)law.coordinate, (int8_t)law.sign,
                                              law.separation, law.slack, law.prescribed};
    v.joints.sources[slot] = source;
}

/* What the joint will keep: as before, but for what the solution says. */
static __device__ __forceinline__ void begin_memory(const joint_view &joints, int32_t j, int lane, bool winds,
                                                    double angle, const struct joint_laws &laws, bool acts, vec3 point)
{
    const struct sadmm_joint_memory *before = &joints.before[j];
    struct sadmm_joint_memory *after = &joints.after[j];
    if (lane < JOINT_COORDINATES) {
        for (int role = 0; role < SADMM_ROLE_COUNT; ++role) after->force[role][lane] = 0;
        after->wrench[lane] = after->local[lane] = 0;
        after->angle[lane] = winds ? angle : before->angle[lane];
        after->left[lane] = before->left[lane];
        after->expected[lane] = laws.expected, after->missed[lane] = laws.missed, after->ahead[lane] = laws.ahead;
        if (lane < 3) after->point[lane] = acts ? v3_part(point, lane) : 0;
        return;
    }
    if (lane > JOINT_COORDINATES) return;
    after->trapezoid_off = before->trapezoid_off;
    after->followed = false; /* the end of the step says */
    after->broken = before->broken;
}

static __device__ __forceinline__ void store_middle(const joint_view &joints, int32_t j, int lane,
                                                    const struct acting_joint &acting)
{
    if (lane < JOINT_COORDINATES) joints.middle[j].axis[lane] = acting.middle.axis[lane];
    if (lane != JOINT_COORDINATES) return;
    joints.middle[j].frame = acting.frame;
    joints.middle[j].arm_b = acting.middle.arm_b;
}

/* Constraints of a joint with so many rows. */
static __device__ __forceinline__ void store_constraints(const cuda_view &v, const struct sadmm_resident_joint *joint,
                                                         const struct acting_joint &acting, int32_t first, int lane,
                                                         int rows)
{
    double offset[3] = {0, 0, 0};
    if (rows > 0) v3_store(v3_sub(acting.middle.arm_a, acting.middle.arm_b), offset);
    for (int c = lane; c < joint->constraints; c += LANES) {
        const int left = rows - SADMM_MAX_ROWS * c,
                  count = left < 0 ? 0 : left < SADMM_MAX_ROWS ? left : (int)SADMM_MAX_ROWS;
        const int32_t a = joint->body[0] >= 0 ? joint->body[0] : -1, b = joint->body[1] >= 0 ? joint->body[1] : -1;
        const struct sadmm_row_constraint out = {
            count > 0 ? a : -1, count > 0 ? b : -1, (first + c) * (int32_t)SADMM_MAX_ROWS, count, false, 0, true,
            {offset[0], offset[1], offset[2]}};
        const_cast<struct sadmm_row_constraint *>(v.raw.constraints)[first + c] = out;
    }
}

/* The table of the lane's spring; NULL: it has none. */
static __device__ __forceinline__ const struct joint_table *table_of(const joint_view &joints,
                                                                     const struct sadmm_resident_joint *joint, int lane,
                                                                     struct joint_table *table)
{
    const int32_t points = joint->points[lane];
    if (points == 0) return nullptr;
    table->position = joints.tables + joint->table[lane];
    table->load = table->position + points;
    table->count = points;
    return table;
}

static __device__ __forceinline__ bool is_enabled(const cuda_view &v, int32_t j)
{
    return j < v.joints.count && v.joints.joints[j].def.enabled && !v.joints.begin[j].broken;
}

/* How the joints of the block, from `first` on, act (joint_act), those that are enabled. */
static __device__ __forceinline__ void act_all(const cuda_view &v, const struct sadmm_settings &settings, int32_t first,
                                               struct acting_joint *acting)
{
    const int32_t t = (int32_t)threadIdx.x, of_side = first + t / 2, of_joint = first + t;
    if (t < 2 * ROWS_JOINTS && is_enabled(v, of_side)) {
        const struct sadmm_resident_joint *joint = &v.joints.joints[of_side];
        const struct joint_body body = t % 2 ? body_of(v, joint->body[1]) : body_a_of(v, joint);
        const struct sadmm_settings own = settings_with(settings, v.model.gravities, body.system_body);
        acting[t / 2].side[t % 2] = joint_side_of(body, &own);
    }
    __syncthreads();
    if (t < ROWS_JOINTS && is_enabled(v, of_joint)) {
        const struct sadmm_resident_joint *joint = &v.joints.joints[of_joint];
        joint_act_between(&joint->def, joint->frame, joint->coupling >= 0, &settings, &acting[t]);
    }
    __syncthreads();
}

/* TABLES: there are springs with tables. By itself: they take registers. */
template <bool TABLES>
static __global__ void __launch_bounds__(ROWS_JOINTS * LANES)
    joint_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    CUDA_DYNAMIC_SHARED(dynamic);
    struct acting_joint *const acting_of = (struct acting_joint *)dynamic;
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t first_joint = (int32_t)blockIdx.x * ROWS_JOINTS, j = first_joint + (int32_t)threadIdx.x / LANES;
    const int lane = (int)threadIdx.x % LANES;
    if (v.model.live->abort_code) return;
    const bool live = j < v.joints.count, enabled = is_enabled(v, j);
    const struct sadmm_resident_joint *joint = &v.joints.joints[live ? j : 0];
    const sadmm_joint_def *def = &joint->def;
    const bool coordinate = enabled && lane < JOINT_COORDINATES && joint_has_coordinate(def, lane);
    const struct sadmm_settings settings = *v.model.settings;
    const struct acting_joint &acting = acting_of[threadIdx.x / LANES];
    struct joint_moving moving;
    struct joint_laws laws;
    laws.count = 0;
    laws.expected = laws.missed = laws.ahead = 0;
    act_all(v, settings, first_joint, acting_of);
    if (coordinate) {
        moving = joint_moving_of(def, &v.joints.before[j], &acting, lane, &settings);
        struct joint_table table = {};
        joint_coordinate_laws(def, lane, &moving, TABLES ? table_of(v.joints, joint, lane, &table) : nullptr, &laws);
    }
    int rows;
    const int at = place_laws(laws.count, coordinate && (def->locks >> lane & 1), lane, &rows);
    const int32_t first = live ? v.joints.first[j] : 0;
    int warm = 0; /* a bit a constraint */
    for (int i = 0; i < laws.count; ++i) {
        const struct joint_law *law = &laws.law[i];
        const double start = law->sign * v.joints.before[j].force[law->role][lane] * settings.dt;
        store_row(v, acting, *law, j, (size_t)first * SADMM_MAX_ROWS + (size_t)(at + i), start);
        if (start != 0) warm |= 1 << (at + i) / SADMM_MAX_ROWS;
    }
    warm = or_lanes(warm);
    if (!live) return;
    store_constraints(v, joint, acting, first, lane, rows);
    /* Parts are of all joints, islands of those that act: they are not the same where one does not. */
    if (rows == 0 && joint->constraints > 0 && lane == 0) v.step.control->joints.together = 1;
    begin_memory(v.joints, j, lane, coordinate && joint_winds(def->locks, lane), coordinate ? moving.value : 0, laws,
                 rows > 0, enabled ? acting.middle.point : v3(0, 0, 0));
    if (rows == 0) return;
    store_middle(v.joints, j, lane, acting);
    if (lane > 0) return;
    atomicAdd(joint->coupling < 0 ? &v.step.control->joints.joints : &v.step.control->joints.couplings, 1);
    atomicAdd(&v.step.control->joints.constraints, (rows + SADMM_MAX_ROWS - 1) / SADMM_MAX_ROWS);
    atomicAdd(&v.step.control->joints.warm, __popc((unsigned)warm));
}

/* ---- the solution ------------------------------------------------------------------------------------------------ */

static __device__ __forceinline__ struct joint_trapezoid trapezoid_of(const cuda_view &v, int32_t body)
{
    double velocity[6] = {};
    if (body >= 0 && v.joints.is_articulated[body])
        for (size_t k = 0; k < 6; ++k) velocity[k] = v.joints.velocity[6 * (size_t)body + k];
    else if (body >= 0) load_end_velocity(v, body, velocity);
    return joint_trapezoid_of(body >= 0 ? &v.step.before[body] : nullptr, velocity, v.model.settings->dt);
}

static __device__ __forceinline__ int32_t *island_of(const cuda_view &v, int32_t a, int32_t b)
{
    return &v.joints.touch[articulation_label(v, a >= 0 ? a : b)];
}

/* joint: what the coupling's has given; NULL: it did not take part. */
static __device__ __forceinline__ void keep_coupling(const cuda_view &v, int32_t k,
                                                     const struct sadmm_joint_memory *joint,
                                                     const struct cuda_joint_middle *middle, double dt)
{
    struct sadmm_coupling_memory memory = v.joints.couplings_before[k];
    if (v.step.substep == 0) coupling_begin(&memory);
    if (joint) coupling_keep(&memory, joint->wrench, v3_load(joint->point), middle->arm_b, dt);
    coupling_move(&memory.target, dt);
    if (v.step.substep + 1 == v.step.substeps) coupling_end(&memory, v.step.substeps);
    v.joints.couplings_after[k] = memory;
}

/* Joint j: what its rows carry; what it says of its island. */
static __device__ __forceinline__ void keep_joint(const cuda_view &v, int32_t j)
{
    const struct sadmm_resident_joint *joint = &v.joints.joints[j];
    const struct cuda_joint_middle *middle = &v.joints.middle[j];
    const struct sadmm_settings settings = *v.model.settings;
    const int32_t first = v.joints.first[j];
    if (joint->constraints == 0 || v.raw.constraints[first].count == 0) {
        if (joint->coupling >= 0) keep_coupling(v, joint->coupling, nullptr, middle, settings.dt);
        return;
    }
    struct sadmm_joint_memory memory = v.joints.after[j];
    const struct joint_trapezoid bodies[2] = {trapezoid_of(v, joint->body[0]), trapezoid_of(v, joint->body[1])};
    int bits = ISLAND_ARTICULATED;
    double finite = 0;
    for (int32_t c = 0; c < joint->constraints; ++c) {
        int moorings = 0;
        const int32_t count = v.raw.constraints[first + c].count;
        const size_t slots = (size_t)(first + c) * SADMM_MAX_ROWS;
        const bool articulated = v.joints.is_articulated[v.model.bodies + first + c];
        /* All rows are fetched before the first is used: one wait for memory, not one a row. */
        struct sadmm_joint_source source[SADMM_MAX_ROWS];
        double lambda[SADMM_MAX_ROWS];
#pragma unroll
        for (int r = 0; r < SADMM_MAX_ROWS; ++r) {
            if (r >= count) continue;
            source[r] = v.joints.sources[slots + (size_t)r];
            lambda[r] = articulated ? v.joints.solution[slots + (size_t)r]
                                    : (double)v.rows.data[slots + (size_t)r].lambda;
        }
#pragma unroll
        for (int r = 0; r < SADMM_MAX_ROWS; ++r) {
            if (r >= count) continue;
            const struct raw_row *row = &v.raw.rows[slots + (size_t)r];
            finite += lambda[r] - lambda[r];
            if (!articulated) v.joints.solution[slots + (size_t)r] = lambda[r];
            if (joint_role_foresees(source[r].role))
                memory.expected[source[r].coordinate] += joint_solved_rate(
                    row->jacobian[0], row->jacobian[1], bodies[0].rigid ? bodies[0].velocity : nullptr,
                    bodies[1].rigid ? bodies[1].velocity : nullptr);
            joint_keep_row(&memory, middle->axis, source[r].role, source[r].coordinate,
                           source[r].sign * lambda[r] / settings.dt);
            moorings |= joint_mooring(&source[r], lambda[r], bodies);
            bits |= joint_row_touches(&source[r], lambda[r], row->jacobian[0], row->jacobian[1], bodies, &settings);
        }
        if (moorings == JOINT_MOORED_WHOLLY) bits |= ISLAND_ANCHORED;
    }
    joint_end_wrench(&memory, &joint->def, middle->frame);
    v.joints.after[j] = memory;
    if (joint->coupling >= 0) keep_coupling(v, joint->coupling, &memory, middle, settings.dt);
    for (int s = 0; s < 2; ++s)
        if (joint->body[s] >= 0 && v.joints.stiffening[joint->body[s]].any) bits |= ISLAND_STRAYS;
    atomicOr(island_of(v, joint->body[0], joint->body[1]), bits);
    const int32_t named = joint->body[1] >= 0 ? joint->body[1] : joint->body[0];
    if (!(finite == 0)) atomicMin(&v.step.control->offending_body, 2 * v.model.bodies + named);
}

/* Pair p, where its island has joints: v.contacts.lanes threads, each every so many-th point. Every lane of the warp
 * comes here. */
static __device__ __forceinline__ void inspect_pair(const cuda_view &v, int32_t p, int32_t lane)
{
    const bool live = v.step.limits && p < live_pairs(v.model);
    const struct sadmm_contact_pair *pair = &v.raw.pairs[live ? p : 0];
    const int32_t a = live ? pair->body_a : -1, b = live ? pair->body_b : -1, body = a >= 0 ? a : b;
    const bool inspects = body >= 0 && v.islands.info[v.graph.label[body]].rows;
    const struct sadmm_settings settings = settings_of(v.model, body);
    struct joint_trapezoid bodies[2] = {};
    struct trapezoid_touch touch = {0, {0, 0}};
    if (inspects) {
        bodies[0] = trapezoid_of(v, a), bodies[1] = trapezoid_of(v, b);
        for (int32_t k = lane; k < pair->count; k += v.contacts.lanes)
            joint_contact_touches(pair->normal, &v.raw.points[pair->first + k],
                                  sadmm_migration_of(v.raw.points, v.raw.migrations, pair->first + k), bodies,
                                  &settings, &touch);
    }
    for (int32_t o = 1; o < v.contacts.lanes; o *= 2) {
        touch.island |= __shfl_xor_sync((unsigned)ALL_LANES, touch.island, o);
        for (int s = 0; s < 2; ++s) touch.body[s] |= __shfl_xor_sync((unsigned)ALL_LANES, touch.body[s], o);
    }
    const bool kinematic = inspects && v.kinematic.count > 0 && sadmm_pair_is_kinematic(&v.raw.system, pair);
    if (inspects && lane == 0)
        atomicOr(island_of(v, a, b),
                 ISLAND_TOUCHED | (kinematic || joint_contacts_hold(&touch, bodies) ? ISLAND_TRAPEZOID_OFF : 0));
}

/* args.count: threads for joints; the others are for pairs. */
static __global__ void __launch_bounds__(ROWS_THREADS)
    joint_solution_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args args)
{
    const int32_t t = (int32_t)(blockIdx.x * (unsigned)ROWS_THREADS + threadIdx.x), of_pair = t - args.count;
    pdl_wait_if(all_pdl(v.model.bodies));
    if (v.model.live->abort_code) return;
    if (t < v.joints.count) keep_joint(v, t);
    if (of_pair >= 0) inspect_pair(v, of_pair / v.contacts.lanes, of_pair % v.contacts.lanes);
}

/* Where joints are apart (device/step.h): their bodies move. A thread a body; one a joint. */
static __global__ void __launch_bounds__(ROWS_THREADS)
    joint_move_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t i = (int32_t)(blockIdx.x * (unsigned)ROWS_THREADS + threadIdx.x);
    if (v.model.live->abort_code) return;
    if (i < v.model.bodies && moves_apart(v, i)) move_articulated(v, i);
    end_joints(v, i);
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

sadmm_status CUDA(launch_joint_move)(struct sadmm_context *c, struct sadmm_error *error)
{
    const cuda_args args = {};
    const int64_t bodies = c->view.model.bodies, joints = c->view.joints.count + c->view.joints.gears;
    return CUDA(launch_of)(c, joint_move_kernel, "bodies of joints",
                           ((bodies > joints ? bodies : joints) + ROWS_THREADS - 1) / ROWS_THREADS, ROWS_THREADS, &args,
                           error);
}

sadmm_status CUDA(launch_joint_rows)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    const int64_t blocks = ((int64_t)c->view.joints.count + ROWS_JOINTS - 1) / ROWS_JOINTS;
    TRY(CUDA(launch_shared)(c, c->step->tables ? joint_rows_kernel<true> : joint_rows_kernel<false>, "rows of joints",
                            blocks, ROWS_JOINTS * LANES, ROWS_JOINTS * sizeof(struct acting_joint), &args, error));
    return CUDA(launch_gear_rows)(c, error);
}

sadmm_status CUDA(launch_joint_solution)(struct sadmm_context *c, struct sadmm_error *error)
{
    cuda_args args = {};
    const int64_t blocks = (c->view.joints.count + ROWS_THREADS - 1) / ROWS_THREADS,
                  pairs = c->view.step.limits && !c->view.joints.apart
                              ? (int64_t)c->view.contacts.pair_capacity * c->view.contacts.lanes
                              : 0;
    if (blocks == 0) return SADMM_OK;
    args.count = (int32_t)(blocks * ROWS_THREADS);
    TRY(CUDA(launch_of)(c, joint_solution_kernel, "joints", blocks + (pairs + ROWS_THREADS - 1) / ROWS_THREADS,
                        ROWS_THREADS, &args, error));
    TRY(CUDA(launch_gear_solution)(c, error));
    TRY(CUDA(launch_joint_close)(c, error));
    return CUDA(launch_joint_momentum)(c, error);
}

/* ---- where they are ---------------------------------------------------------------------------------------------- */

/* In BUFFER_JOINTS: definitions, geometry, first constraints. */
static struct cuda_joint_middle *middle_of(const struct sadmm_context *c)
{
    return (struct cuda_joint_middle *)(buffer<struct sadmm_resident_joint>(c, BUFFER_JOINTS) + c->step->joints);
}
static int32_t *first_of(const struct sadmm_context *c) { return (int32_t *)(middle_of(c) + c->step->joints); }

/* In BUFFER_JOINT_ROWS, twice, by the state that the step ends in: constraints and rows; then multipliers, velocities
 * and sources. */
static size_t row_set_bytes(const struct cuda_step *s)
{
    const size_t rows = (size_t)s->joint_constraints * SADMM_MAX_ROWS;
    return CUDA(raw_row_bytes)(s->joint_constraints) + 6 * (size_t)s->bodies * sizeof(double) +
           rows * (sizeof(double) + sizeof(struct sadmm_joint_source));
}
static char *row_set(const struct sadmm_context *c, int into)
{
    return buffer<char>(c, BUFFER_JOINT_ROWS) + (size_t)into * row_set_bytes(c->step);
}

static struct sadmm_joint_memory *memory_of(const struct sadmm_context *c, int state)
{
    return buffer<struct sadmm_joint_memory>(c, BUFFER_JOINT_MEMORY) + (size_t)state * (size_t)c->step->joints;
}

static struct sadmm_coupling_memory *couplings_of(const struct sadmm_context *c, int state)
{
    return buffer<struct sadmm_coupling_memory>(c, BUFFER_COUPLING_MEMORY) + (size_t)state * (size_t)c->step->couplings;
}

void CUDA(view_joints)(struct sadmm_context *c, int into, int substep)
{
    const struct cuda_step *s = c->step;
    const int substeps = c->settings.substeps;
    struct joint_view *joints = &c->view.joints;
    joints->count = s->joints;
    joints->apart = s->apart;
    if (s->joints == 0) return;
    joints->joints = buffer<struct sadmm_resident_joint>(c, BUFFER_JOINTS);
    joints->tables = buffer<double>(c, BUFFER_TABLES);
    joints->middle = middle_of(c);
    joints->first = first_of(c);
    joints->begin = memory_of(c, step_state(into, -1, substeps));
    joints->before = memory_of(c, step_state(into, substep - 1, substeps));
    joints->after = memory_of(c, step_state(into, substep, substeps));
    joints->couplings_before = couplings_of(c, step_state(into, substep - 1, substeps));
    joints->couplings_after = couplings_of(c, step_state(into, substep, substeps));
    joints->first_at = buffer<int32_t>(c, BUFFER_JOINTS_AT);
    joints->joints_at = joints->first_at + s->bodies + 1;
    joints->closing = joints->joints_at + 2 * (size_t)s->joints;
    joints->closed = buffer<struct cuda_closed_body>(c, BUFFER_CLOSED);
    joints->stiffening = buffer<struct cuda_stiffening>(c, BUFFER_STIFFENING);
    joints->touch = buffer<int32_t>(c, BUFFER_JOINT_TOUCH);
    joints->momentum = buffer<struct joint_momentum>(c, BUFFER_JOINT_MOMENTUM);
    c->view.rows.count = s->joint_constraints;
    CUDA(bind_raw_rows)(c, row_set(c, into));
    joints->solution = (double *)(row_set(c, into) + CUDA(raw_row_bytes)(s->joint_constraints));
    joints->velocity = joints->solution + (size_t)s->joint_constraints * SADMM_MAX_ROWS;
    joints->sources = (struct sadmm_joint_source *)(joints->velocity + 6 * (size_t)s->bodies);
    CUDA(view_gears)(c, into, substep);
    if (s->apart) c->view.rows.count = 0;
}

/* ---- to the device, and back ------------------------------------------------------------------------------------- */

static sadmm_status put_first(struct sadmm_context *c, const struct sadmm_resident_world *world,
                              struct sadmm_error *error)
{
    const size_t n = (size_t)world->joint_count;
    int32_t *first = (int32_t *)sadmm_alloc(n, sizeof *first), next = 0;
    if (!first) return sadmm_fail_memory(error, "the cuda backend's joints");
    for (size_t j = 0; j < n; ++j) {
        first[j] = next;
        next += world->joints[j].constraints;
    }
    const sadmm_status status = CUDA(put)(c, first_of(c), first, n * sizeof *first, error);
    sadmm_free(first);
    return status;
}

/* Is side s of a joint of a dynamic body? */
static bool is_at_body(const struct sadmm_resident_joint *joint, int s)
{
    return joint->body[s] >= 0 && (s == 1 || joint->coupling < 0);
}

static sadmm_status put_joints_at(struct sadmm_context *c, const struct sadmm_resident_world *world,
                                  struct sadmm_error *error)
{
    const size_t n = (size_t)world->body_count, joints = (size_t)world->joint_count,
                 constraints = (size_t)c->step->joint_constraints, count = n + 1 + 2 * joints + constraints;
    int32_t *first = (int32_t *)sadmm_alloc(count, sizeof *first), *at = first + n + 1, *closing = at + 2 * joints;
    if (!first) return sadmm_fail_memory(error, "the cuda backend's joints");
    for (size_t j = 0; j < joints; ++j)
        for (int s = 0; s < 2; ++s)
            if (is_at_body(&world->joints[j], s)) ++first[world->joints[j].body[s] + 1];
    for (size_t i = 0; i < n; ++i) first[i + 1] += first[i];
    const int32_t all = first[n];
    for (size_t j = joints; j-- > 0;) /* from behind: ends of lists, one place on, become their beginnings */
        for (int s = 1; s >= 0; --s)
            if (is_at_body(&world->joints[j], s)) at[--first[world->joints[j].body[s] + 1]] = (int32_t)(2 * j) + s;
    memmove(first, first + 1, n * sizeof *first);
    first[n] = all;
    for (size_t k = 0; k < constraints; ++k) closing[k] = -1;
    for (size_t j = 0, k = 0; j < joints; k += (size_t)world->joints[j++].constraints)
        if (world->joints[j].def.locks && world->joints[j].constraints > 0) closing[k] = (int32_t)j;
    const sadmm_status status =
        CUDA(put)(c, buffer<void>(c, BUFFER_JOINTS_AT), first, count * sizeof *first, error);
    sadmm_free(first);
    return status;
}

sadmm_status CUDA(load_joints)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                               struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const size_t n = (size_t)world->joint_count;
    int64_t constraints = world->gear_count;
    for (size_t j = 0; j < n; ++j) constraints += world->joints[j].constraints;
    if (constraints > INT32_MAX / (8 * ROW))
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%lld constraints of joints: at most %d", (long long)constraints,
                          INT32_MAX / (8 * ROW));
    s->joints = c->view.joints.count = world->joint_count;
    s->joint_constraints = (int32_t)constraints;
    s->couplings = world->coupling_count;
    s->gears = c->view.joints.gears = world->gear_count;
    s->tables = world->table_numbers > 0;
    if (n == 0) return SADMM_OK;
    const cuda_capacity wanted[] = {
        {BUFFER_JOINTS,
         n * (sizeof(struct sadmm_resident_joint) + sizeof(struct cuda_joint_middle) + sizeof(int32_t))},
        {BUFFER_TABLES, world->table_numbers * sizeof *world->tables},
        {BUFFER_JOINT_MEMORY, 3 * n * sizeof(struct sadmm_joint_memory)},
        {BUFFER_COUPLING_MEMORY, 3 * (size_t)s->couplings * sizeof(struct sadmm_coupling_memory)},
        {BUFFER_JOINT_ROWS, 2 * row_set_bytes(s)},
        {BUFFER_JOINTS_AT, ((size_t)s->bodies + 1 + 2 * n + (size_t)s->joint_constraints) * sizeof(int32_t)},
        {BUFFER_STIFFENING, (size_t)s->bodies * sizeof(struct cuda_stiffening)},
        {BUFFER_CLOSED, (size_t)s->bodies * sizeof(struct cuda_closed_body)},
        {BUFFER_JOINT_TOUCH, (size_t)s->bodies * sizeof(int32_t)},
        {BUFFER_JOINT_MOMENTUM, (size_t)s->bodies * sizeof(struct joint_momentum)},
    };
    TRY(reserve_all(c, wanted, error));
    /* Rows that a constraint does not have are fetched, too, beside the number of those that it has (articulation.cu);
     * and structures are copied with what lies between their members. */
    CUDA_CALL(c, cudaMemsetAsync(buffer<void>(c, BUFFER_JOINT_ROWS), 0, 2 * row_set_bytes(s), c->stream),
              "cudaMemsetAsync(rows of joints)");
    CUDA_CALL(c, cudaMemsetAsync(memory_of(c, 0), 0, 3 * n * sizeof(struct sadmm_joint_memory), c->stream),
              "cudaMemsetAsync(what joints keep)");
    TRY(CUDA(put)(c, c->buffers[BUFFER_JOINTS].data, world->joints, n * sizeof *world->joints, error));
    TRY(CUDA(put)(c, memory_of(c, 1 - s->into), world->joint_memory, n * sizeof *world->joint_memory, error));
    if (s->couplings > 0)
        TRY(CUDA(put)(c, couplings_of(c, 1 - s->into), world->coupling_memory,
                (size_t)s->couplings * sizeof *world->coupling_memory, error));
    if (s->tables)
        TRY(CUDA(put)(c, c->buffers[BUFFER_TABLES].data, world->tables, world->table_numbers * sizeof *world->tables,
                error));
    TRY(CUDA(load_gears)(c, world, error));
    TRY(put_joints_at(c, world, error));
    return put_first(c, world, error);
}

extern "C" sadmm_status CUDA(read_joints)(struct sadmm_context *c, struct sadmm_joint_memory *memory,
                                          struct sadmm_coupling_memory *couplings, double *gear_force,
                                          struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    CUDA_ENTER(c);
    TRY(CUDA(read_gears)(c, gear_force, error));
    if (s->couplings > 0)
        TRY(CUDA(get)(c, couplings, couplings_of(c, 1 - s->into), (size_t)s->couplings * sizeof *couplings, error));
    return CUDA(get)(c, memory, memory_of(c, 1 - s->into), (size_t)s->joints * sizeof *memory, error);
}

/* One constraint from the device's form. */
static bool take_constraint(struct sadmm_rows *rows, const struct sadmm_row_constraint *from, const struct raw_row *row,
                            const double *own, double *solution)
{
    if (from->count == 0) return true;
    const int32_t first = sadmm_rows_add(rows, from->count, from->body_a, from->body_b);
    if (first < 0) return false;
    for (int32_t k = 0; k < from->count; ++k) {
        const size_t r = (size_t)(first + k);
        memcpy(rows->jacobian_a + 6 * r, row[k].jacobian[0], sizeof row[k].jacobian[0]);
        memcpy(rows->jacobian_b + 6 * r, row[k].jacobian[1], sizeof row[k].jacobian[1]);
        sadmm_row_set(rows, first + k, row[k].gain, row[k].bias, row[k].compliance, row[k].lo, row[k].hi);
        rows->lambda[r] = row[k].lambda;
        solution[r] = own[k];
    }
    return true;
}

/* Where joints are apart their velocities are kept for their bodies alone: the others' are those they have. */
static sadmm_status take_velocities(struct sadmm_context *c, double *velocity, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)s->bodies;
    if (!s->last.apart) return SADMM_OK;
    const struct sadmm_rigid *last = buffer<struct sadmm_rigid>(c, BUFFER_WORLD_BODIES) + (size_t)(1 - s->into) * n;
    struct sadmm_rigid *rigid = (struct sadmm_rigid *)sadmm_alloc(n + 1, sizeof *rigid);
    int32_t *articulated = (int32_t *)sadmm_alloc(n + 1, sizeof *articulated);
    sadmm_status status = rigid && articulated ? SADMM_OK : sadmm_fail_memory(error, "the joints' rows");
    if (status == SADMM_OK) status = CUDA(get)(c, rigid, last, n * sizeof *rigid, error);
    if (status == SADMM_OK)
        status = CUDA(get)(c, articulated, c->view.joints.is_articulated, n * sizeof *articulated, error);
    for (size_t i = 0; i < n && status == SADMM_OK; ++i)
        if (!articulated[i]) memcpy(velocity + 6 * i, rigid[i].velocity, 6 * sizeof *velocity);
    sadmm_free(rigid);
    sadmm_free(articulated);
    return status;
}

extern "C" sadmm_status CUDA(read_rows)(struct sadmm_context *c, struct sadmm_rows *rows, double *solution,
                                        double *velocity, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t count = (size_t)s->joint_constraints, bytes = row_set_bytes(s);
    CUDA_ENTER(c);
    char *all = (char *)sadmm_alloc(bytes, 1);
    if (!all) return sadmm_fail_memory(error, "the joints' rows");
    sadmm_status status = CUDA(get)(c, all, row_set(c, 1 - s->into), bytes, error);
    const struct sadmm_row_constraint *constraints = (const struct sadmm_row_constraint *)all;
    const struct raw_row *row = (const struct raw_row *)(constraints + count);
    const double *own = (const double *)(row + count * SADMM_MAX_ROWS);
    if (status == SADMM_OK && s->bodies > 0)
        memcpy(velocity, own + count * SADMM_MAX_ROWS, 6 * (size_t)s->bodies * sizeof *velocity);
    for (size_t k = 0; k < count && status == SADMM_OK; ++k)
        if (!take_constraint(rows, &constraints[k], row + k * SADMM_MAX_ROWS, own + k * SADMM_MAX_ROWS, solution))
            status = sadmm_fail_memory(error, "the joints' rows");
    sadmm_free(all);
    if (status == SADMM_OK && s->bodies > 0) status = take_velocities(c, velocity, error);
    return status;
}
