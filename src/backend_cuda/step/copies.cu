/* Worlds of many equal ones, environments (core/solve/resident.h): arrays of all of them, in this device's memory, in
 * and out; states that some of them begin with. Numbers of arrays are read and written by a thread a row. */
#include <string.h>

#include <algorithm>

#include "backend_cuda/device/double.h"

#include "backend_cuda/device/kept_state.h"
#include "collision/base/bounds.h"
#include "core/base/memory.h"
#include "core/model/coupling_law.h"
#include "core/model/forces.h"
#include "core/model/joint_law.h"
#include "core/model/kinematic.h"
#include "core/model/moments.h"
#include "subadmm/array_kinds.h"
#include "world.h"

enum { COPIES_THREADS = 128 };

/* ---- memory ------------------------------------------------------------------------------------------------------ */

extern "C" sadmm_status CUDA(allocate)(struct sadmm_context *c, size_t bytes, void **out, struct sadmm_error *error)
{
    *out = nullptr;
    CUDA_ENTER(c);
    CUDA_CALL(c, cudaMalloc(out, bytes > 0 ? bytes : 1), "allocation for environments");
    CUDA_CALL(c, cudaMemsetAsync(*out, 0, bytes, c->stream), "cudaMemsetAsync(environments)");
    return CUDA(wait)(c, error);
}

extern "C" void CUDA(release)(struct sadmm_context *c, void *memory)
{
    device_scope scope(c->device);
    if (memory && scope.code == cudaSuccess) (void)cudaFree(memory);
    (void)cudaGetLastError();
}

extern "C" size_t CUDA(memory)(const struct sadmm_context *c)
{
    size_t bytes = 0;
    for (const cuda_buffer &buffer : c->buffers) bytes += buffer.pinned ? 0 : buffer.capacity;
    if (!c->step) return bytes;
    if (c->step->collision) bytes += COLLISION(memory)(c->step->collision);
    if (c->step->push) bytes += CUDA(memory)(c->step->push);
    return bytes;
}

/* Whatever may be at work on what the host reads or writes has ended. */
static cudaError_t wait_for_all(void)
{
#ifdef SADMM_CUDA_EMULATED
    return cudaSuccess;
#else
    return cudaDeviceSynchronize();
#endif
}

extern "C" sadmm_status CUDA(to_backend)(struct sadmm_context *c, void *to, const void *from, size_t bytes,
                                         struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_CALL(c, wait_for_all(), "cudaDeviceSynchronize");
    return bytes > 0 ? CUDA(put)(c, to, from, bytes, error) : SADMM_OK;
}

extern "C" sadmm_status CUDA(from_backend)(struct sadmm_context *c, void *to, const void *from, size_t bytes,
                                           struct sadmm_error *error)
{
    CUDA_ENTER(c);
    CUDA_CALL(c, wait_for_all(), "cudaDeviceSynchronize");
    return bytes > 0 ? CUDA(get)(c, to, from, bytes, error) : SADMM_OK;
}

/* ---- arrays ------------------------------------------------------------------------------------------------------ */

struct copies_args {
    struct sadmm_resident_copies copies;
    struct sadmm_resident_array array;
    const uint8_t *left;
    uint8_t *refused;
    const double *wrench, *kinematic_wrench; /* of the last step; NULL: it recovered none */
    struct sadmm_shape *shapes;              /* by slot, where materials are set */
    bool bounces;                            /* steps expect restitution */
};

static __device__ __forceinline__ double number_of(const void *values, bool single, int64_t k)
{
    return single ? (double)((const float *)values)[k] : ((const double *)values)[k];
}

static __device__ __forceinline__ void put_numbers(const sadmm_resident_array &array, int64_t row,
                                                   const double *numbers)
{
    const int64_t first = row * array.columns;
    for (int k = 0; k < array.columns; ++k) {
        if (array.single) ((float *)array.values)[first + k] = (float)numbers[k];
        else ((double *)array.values)[first + k] = numbers[k];
    }
}

/* Of a world, a body as contacts name it; NULL: the static world. */
static __device__ __forceinline__ const struct sadmm_rigid *rigid_of(const cuda_view &v, int32_t body)
{
    if (body >= 0) return &v.step.before[body];
    return body == -1 ? nullptr : &v.kinematic.before[sadmm_kinematic(body)].rigid;
}

static __device__ __forceinline__ int32_t body_in(const sadmm_resident_copies &copies, int32_t world, int32_t body)
{
    if (body >= 0) return world * copies.bodies + body;
    return body == -1 ? -1 : body - world * copies.kinematic;
}

enum { MOST_COLUMNS = 13 };

/* Position, orientation, velocity are the first members, in this order. */
static __device__ __forceinline__ void motion_of(const struct sadmm_rigid *rigid, double *numbers)
{
    for (int k = 0; k < 3; ++k) numbers[k] = rigid->position[k];
    for (int k = 0; k < 4; ++k) numbers[3 + k] = rigid->orientation[k];
    for (int k = 0; k < 6; ++k) numbers[7 + k] = rigid->velocity[k];
}

/* A row of bodies; false: nobody's, whose numbers stay. */
static __device__ __forceinline__ bool body_numbers(const cuda_view &v, const copies_args &a, int32_t body,
                                                    double *numbers)
{
    if (body == -1) return false;
    if (a.array.array == SADMM_ARRAY_BODY_STATE) {
        motion_of(rigid_of(v, body), numbers);
        return true;
    }
    if (a.array.array == SADMM_ARRAY_BODY_CONTACT_WRENCH) {
        const double *wrench = body >= 0 ? a.wrench : a.kinematic_wrench;
        const size_t at = 6 * (size_t)(body >= 0 ? body : sadmm_kinematic(body));
        for (int k = 0; k < 6; ++k) numbers[k] = wrench ? wrench[at + (size_t)k] : 0;
        return true;
    }
    if (body < 0) return false; /* accelerations: of dynamic bodies */
    const struct sadmm_extrapolation *last = &v.step.extrapolation_before[body];
    for (int k = 0; k < 6; ++k) numbers[k] = last->dt > 0 ? last->change[k] / last->dt : 0;
    return true;
}

/* As sadmm_world_read_joint_motion. */
static __device__ __noinline__ void joint_motion(const cuda_view &v, int32_t j, double *position, double *speed)
{
    const struct sadmm_resident_joint *joint = &v.joints.joints[j];
    const bool radial = joint_is_radial(joint->def.kind);
    struct joint_end ends[2];
    double velocity[2][6] = {};
    for (int s = 0; s < 2; ++s) {
        const struct sadmm_rigid *rigid = rigid_of(v, joint->body[s]);
        ends[s] = joint_end_on(&joint->frame[s], rigid);
        for (int k = 0; k < 6 && rigid; ++k) velocity[s][k] = rigid->velocity[k];
    }
    const struct joint_geometry geometry = joint_geometry_of(&ends[0], &ends[1], joint->def.locks, radial);
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        position[k] = joint_winds(joint->def.locks, k) ? joint_unwind(geometry.value[k], v.joints.before[j].angle[k])
                                                       : geometry.value[k];
        speed[k] = joint_rate(&geometry, k, velocity[0], velocity[1]);
    }
    if (radial && joint->def.locks & 1) position[0] -= joint->def.length;
}

static __device__ __forceinline__ void joint_numbers(const cuda_view &v, const copies_args &a, int32_t j,
                                                     double *numbers)
{
    double other[JOINT_COORDINATES];
    const struct sadmm_joint_memory *memory = &v.joints.before[j];
    switch (a.array.array) {
    case SADMM_ARRAY_JOINT_POSITION: joint_motion(v, j, numbers, other); break;
    case SADMM_ARRAY_JOINT_SPEED: joint_motion(v, j, other, numbers); break;
    case SADMM_ARRAY_JOINT_DRIVE_FORCE:
        for (int k = 0; k < JOINT_COORDINATES; ++k) numbers[k] = memory->force[SADMM_ROLE_DRIVE][k];
        break;
    default:
        for (int k = 0; k < JOINT_COORDINATES; ++k) numbers[k] = memory->wrench[k];
    }
}

static __device__ __forceinline__ void coupling_numbers(const cuda_view &v, const copies_args &a, int32_t k,
                                                        double *numbers)
{
    const struct sadmm_coupling_memory *memory = &v.joints.couplings_before[k];
    if (a.array.array == SADMM_ARRAY_COUPLING_TARGET) return motion_of(&memory->target, numbers);
    for (int i = 0; i < 6; ++i) numbers[i] = memory->reaction[i];
}

enum row_kind { ROW_OF_BODY, ROW_OF_JOINT, ROW_OF_COUPLING, NO_ROW };

static __host__ __device__ inline enum row_kind row_kind_of(int32_t array)
{
    switch (array) {
    case SADMM_ARRAY_BODY_STATE:
    case SADMM_ARRAY_BODY_CONTACT_WRENCH:
    case SADMM_ARRAY_BODY_ACCELERATION: return ROW_OF_BODY;
    case SADMM_ARRAY_JOINT_POSITION:
    case SADMM_ARRAY_JOINT_SPEED:
    case SADMM_ARRAY_JOINT_DRIVE_FORCE:
    case SADMM_ARRAY_JOINT_WRENCH: return ROW_OF_JOINT;
    case SADMM_ARRAY_COUPLING_TARGET:
    case SADMM_ARRAY_COUPLING_REACTION: return ROW_OF_COUPLING;
    default: return NO_ROW;
    }
}

static __global__ void __launch_bounds__(COPIES_THREADS)
    out_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ copies_args a)
{
    const int64_t row = (int64_t)blockIdx.x * COPIES_THREADS + threadIdx.x;
    const int32_t e = (int32_t)(row / a.array.rows);
    if (e >= a.copies.count || (a.left && a.left[e])) return;
    const int32_t object = a.array.objects[row % a.array.rows];
    double numbers[MOST_COLUMNS];
    const enum row_kind kind = row_kind_of(a.array.array);
    if (kind == ROW_OF_BODY) {
        if (!body_numbers(v, a, body_in(a.copies, e, object), numbers)) return;
    } else if (kind == ROW_OF_JOINT) {
        joint_numbers(v, a, e * a.copies.joints + object, numbers);
    } else {
        coupling_numbers(v, a, e * a.copies.couplings + object, numbers);
    }
    put_numbers(a.array, row, numbers);
}

/* ---- in ---------------------------------------------------------------------------------------------------------- */

/* What an array sets of a joint's coordinate; NULL: it is none of these. */
static __host__ __device__ inline double *member_of(sadmm_joint_coordinate *c, int32_t array)
{
    switch (array) {
    case SADMM_ARRAY_JOINT_TARGET_POSITION: return &c->target_position;
    case SADMM_ARRAY_JOINT_TARGET_SPEED: return &c->target_speed;
    case SADMM_ARRAY_JOINT_DRIVE_STIFFNESS: return &c->drive_stiffness;
    case SADMM_ARRAY_JOINT_DRIVE_DAMPING: return &c->drive_damping;
    case SADMM_ARRAY_JOINT_DRIVE_LIMIT: return &c->drive_force;
    case SADMM_ARRAY_JOINT_FRICTION: return &c->friction;
    case SADMM_ARRAY_JOINT_SPRING_STIFFNESS: return &c->spring_stiffness;
    case SADMM_ARRAY_JOINT_SPRING_DAMPING: return &c->spring_damping;
    case SADMM_ARRAY_JOINT_SPRING_REST: return &c->spring_rest;
    case SADMM_ARRAY_JOINT_ARMATURE: return &c->armature;
    default: return nullptr;
    }
}

static __host__ __device__ inline bool is_input_of_joints(int32_t array)
{
    sadmm_joint_coordinate any;
    return member_of(&any, array) != nullptr;
}

static __host__ __device__ inline bool is_input(int32_t array)
{
    return array == SADMM_ARRAY_GRAVITY || array == SADMM_ARRAY_BODY_INERTIA || array == SADMM_ARRAY_SHAPE_MATERIAL ||
           array == SADMM_ARRAY_JOINT_LOWER || array == SADMM_ARRAY_JOINT_UPPER || array == SADMM_ARRAY_BODY_WRENCH ||
           array == SADMM_ARRAY_BODY_GRAVITY_SCALE || array == SADMM_ARRAY_BODY_DAMPING || is_input_of_joints(array);
}

/* A number that is not finite is in no range. */
static __device__ __forceinline__ bool is_taken(const sadmm_resident_array &array, int column, double x)
{
    return x >= array.lo[column > 0] && x <= array.hi[column > 0];
}
static __device__ __forceinline__ bool are_taken(const sadmm_resident_array &array, const double *x)
{
    for (int k = 0; k < array.columns; ++k)
        if (!is_taken(array, k, x[k])) return false;
    return true;
}

/* The largest moment is what contacts know of a body's inertia. */
static __device__ __forceinline__ bool take_inertia(const cuda_view &v, int32_t body, const double *x)
{
    struct sadmm_rigid *rigid = const_cast<struct sadmm_rigid *>(&v.step.before[body]);
    for (int k = 0; k < 3; ++k)
        if (!moments_sum_fits(x + 1, k)) return false;
    if (!moments_ratio_fits(x + 1, sizeof(solver_real) == sizeof(float))) return false;
    rigid->mass = x[0];
    for (int k = 0; k < 3; ++k) rigid->inertia[k] = x[1 + k];
    v.step.bodies[v.step.slot_of_body[body]].inertia = v3_max_abs(v3_load(x + 1));
    return true;
}

static __device__ __forceinline__ bool take_body(const cuda_view &v, const copies_args &a, int32_t body,
                                                 double *x)
{
    struct sadmm_rigid *rigid = const_cast<struct sadmm_rigid *>(&v.step.before[body < 0 ? 0 : body]);
    const int columns = a.array.columns;
    const bool inertia = a.array.array == SADMM_ARRAY_BODY_INERTIA,
               wrench = a.array.array == SADMM_ARRAY_BODY_WRENCH,
               scale = a.array.array == SADMM_ARRAY_BODY_GRAVITY_SCALE;
    if (body < 0) { /* as it is read */
        for (int k = 0; k < columns; ++k)
            if (!(x[k] == 0)) return false;
        return true;
    }
    if (inertia && a.array.single) moments_mend(x);
    if (!are_taken(a.array, x)) return false;
    if (inertia) return take_inertia(v, body, x);
    for (int k = 0; k < columns; ++k) {
        if (wrench) rigid->wrench[k] = x[k];
        else if (scale) rigid->gravity_scale = x[k];
        else rigid->damping[k] = x[k];
    }
    return true;
}

/* As sadmm_settings_validate. */
static __device__ __forceinline__ bool take_gravity(const cuda_view &v, const copies_args &a, int32_t e,
                                                    const double *x)
{
    double *to = const_cast<double *>(v.model.gravities.of) + GRAVITY_NUMBERS * (size_t)e;
    if (!(hypot(hypot(x[0], x[1]), x[2]) <= a.array.hi[0])) return false;
    for (int k = 0; k < 3; ++k) to[k] = x[k];
    to[GRAVITY_SIZE] = gravity_size(x);
    return true;
}

/* Where none had restitution steps do not look for it: the host begins others. */
static __device__ __forceinline__ bool take_material(const copies_args &a, int32_t slot, const double *x)
{
    struct sadmm_shape *shape = &a.shapes[slot];
    if (!are_taken(a.array, x) || (x[1] > 0 && x[1] != shape->restitution && !a.bounces)) return false;
    shape->friction = x[0];
    shape->restitution = x[1];
    return true;
}

/* Lower limits, or upper ones, or both. */
static __device__ __forceinline__ bool take_limits(const cuda_view &v, const copies_args &a, int32_t j, int64_t row,
                                                   const double *x)
{
    sadmm_joint_def *def = &v.joints.joints[j].def;
    const bool is_upper = a.array.array == SADMM_ARRAY_JOINT_UPPER;
    double lower[JOINT_COORDINATES], upper[JOINT_COORDINATES];
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        const sadmm_joint_coordinate *c = &def->coordinates[k];
        lower[k] = is_upper ? c->lower : x[k];
        upper[k] = is_upper         ? x[k]
                   : a.array.upper ? number_of(a.array.upper, a.array.upper_single, row * JOINT_COORDINATES + k)
                                   : c->upper;
        if (lower[k] == c->lower && upper[k] == c->upper) continue;
        if (def->locks >> k & 1 || !joint_has_coordinate(def, k) || !joint_limits_fit(lower[k], upper[k])) return false;
    }
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        def->coordinates[k].lower = lower[k];
        def->coordinates[k].upper = upper[k];
    }
    return true;
}

/* Constraints that the joint may have rows in. */
static __device__ __forceinline__ int constraints_of(const struct sadmm_resident_joint *joint)
{
    int laws = joint_most_laws(&joint->def);
    for (int k = 0; k < JOINT_COORDINATES; ++k) { /* a spring that has nothing but its table */
        const sadmm_joint_coordinate *c = &joint->def.coordinates[k];
        laws += joint->points[k] > 0 && !(c->spring_stiffness > 0 || c->spring_damping > 0);
    }
    return (laws + SADMM_MAX_ROWS - 1) / SADMM_MAX_ROWS;
}

static __device__ __forceinline__ bool take_joint(const cuda_view &v, const copies_args &a, int32_t j, const double *x)
{
    struct sadmm_resident_joint *joint = &v.joints.joints[j];
    sadmm_joint_def *def = &joint->def;
    double before[JOINT_COORDINATES];
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        before[k] = *member_of(&def->coordinates[k], a.array.array);
        if (x[k] == before[k]) continue;
        if (!is_taken(a.array, k, x[k]) || def->locks >> k & 1 || !joint_has_coordinate(def, k)) return false;
    }
    for (int k = 0; k < JOINT_COORDINATES; ++k) *member_of(&def->coordinates[k], a.array.array) = x[k];
    if (constraints_of(joint) <= joint->constraints) return true;
    for (int k = 0; k < JOINT_COORDINATES; ++k) *member_of(&def->coordinates[k], a.array.array) = before[k];
    return false; /* the host makes room for more */
}

static __device__ __forceinline__ bool take_row(const cuda_view &v, const copies_args &a, int32_t e, int64_t row,
                                                double *x)
{
    const int32_t array = a.array.array;
    if (array == SADMM_ARRAY_GRAVITY) return take_gravity(v, a, e, x);
    const int32_t object = a.array.objects[row % a.array.rows];
    if (array == SADMM_ARRAY_SHAPE_MATERIAL) return take_material(a, e * a.copies.shapes + object, x);
    if (array == SADMM_ARRAY_JOINT_LOWER || array == SADMM_ARRAY_JOINT_UPPER)
        return take_limits(v, a, e * a.copies.joints + object, row, x);
    return is_input_of_joints(array) ? take_joint(v, a, e * a.copies.joints + object, x)
                                     : take_body(v, a, body_in(a.copies, e, object), x);
}

static __global__ void __launch_bounds__(COPIES_THREADS)
    in_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ copies_args a)
{
    const int64_t row = (int64_t)blockIdx.x * COPIES_THREADS + threadIdx.x;
    const int32_t e = (int32_t)(row / a.array.rows);
    if (e >= a.copies.count || (a.left && a.left[e])) return;
    double x[MOST_COLUMNS];
    for (int k = 0; k < a.array.columns; ++k)
        x[k] = number_of(a.array.values, a.array.single, row * a.array.columns + k);
    if (!take_row(v, a, e, row, x)) a.refused[e] = 1; /* whoever says so says the same */
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

struct states_args {
    struct sadmm_resident_copies copies;
    const struct cuda_kept_state *const *states; /* (worlds) NULL: it stays as it is */
    double *wrench, *kinematic_wrench;           /* of the last step */
    int32_t width;                               /* threads a world: the most that it has of anything */
};

/* What it is given from outside stays, and what it weighs. */
static __device__ __forceinline__ void begin_body(const cuda_view &v, const states_args &a,
                                                  const struct cuda_kept_state *state, int32_t e, int32_t k)
{
    const int32_t i = e * a.copies.bodies + k;
    struct sadmm_rigid *to = const_cast<struct sadmm_rigid *>(&v.step.before[i]);
    struct sadmm_rigid rigid = state->rigid[k];
    rigid.mass = to->mass;
    for (int j = 0; j < 3; ++j) rigid.inertia[j] = to->inertia[j];
    forces_copy(&rigid, to);
    *to = rigid;
    const_cast<struct sadmm_extrapolation *>(v.step.extrapolation_before)[i] = state->extrapolation[k];
    for (size_t j = 0; j < 6; ++j) a.wrench[6 * (size_t)i + j] = state->wrench[6 * (size_t)k + j];
}

static __device__ __forceinline__ void begin_kinematic(const cuda_view &v, const states_args &a,
                                                       const struct cuda_kept_state *state, int32_t e, int32_t k)
{
    const int32_t i = e * a.copies.kinematic + k;
    struct sadmm_kinematic_body *to = const_cast<struct sadmm_kinematic_body *>(&v.kinematic.before[i]);
    const int32_t slot = to->slot;
    *to = state->kinematic[k];
    to->slot = slot;
    for (size_t j = 0; j < 6; ++j) a.kinematic_wrench[6 * (size_t)i + j] = state->kinematic_wrench[6 * (size_t)k + j];
}

static __device__ __forceinline__ void begin_joint(const cuda_view &v, const states_args &a,
                                                   const struct cuda_kept_state *state, int32_t e, int32_t k)
{
    const struct sadmm_resident_copies &n = a.copies;
    const bool coupling = k >= n.joints;
    const int32_t i = coupling ? n.count * n.joints + e * n.couplings + k - n.joints : e * n.joints + k;
    const_cast<struct sadmm_joint_memory *>(v.joints.begin)[i] = state->joints[k];
    if (!coupling) v.joints.joints[i].def.enabled = state->enabled[k] != 0;
    else const_cast<struct sadmm_coupling_memory *>(
             v.joints.couplings_before)[e * n.couplings + k - n.joints] = state->couplings[k - n.joints];
}

static __global__ void __launch_bounds__(COPIES_THREADS)
    begin_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ states_args a)
{
    const int64_t t = (int64_t)blockIdx.x * COPIES_THREADS + threadIdx.x;
    const int32_t e = (int32_t)(t / a.width), k = (int32_t)(t % a.width);
    if (e >= a.copies.count) return;
    const struct cuda_kept_state *state = a.states[e];
    if (!state) return;
    if (k < a.copies.bodies) begin_body(v, a, state, e, k);
    if (k < a.copies.kinematic) begin_kinematic(v, a, state, e, k);
    if (k < a.copies.joints + a.copies.couplings) begin_joint(v, a, state, e, k);
    if (k < a.copies.gears) const_cast<double *>(v.joints.gear_before)[e * a.copies.gears + k] = state->gear_force[k];
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

template <class Args>
static sadmm_status run(struct sadmm_context *c, void (*kernel)(const cuda_view, const Args), const char *name,
                        int64_t threads, const Args &args, struct sadmm_error *error)
{
    const unsigned blocks = (unsigned)((threads + COPIES_THREADS - 1) / COPIES_THREADS);
    if (blocks == 0) return SADMM_OK;
    c->kernel = name;
#ifdef SADMM_CUDA_EMULATED
    CUDA_CALL(c, cuda_emulation_launch(kernel, blocks, (unsigned)COPIES_THREADS, (size_t)0, c->view, args), name);
#else
    void *parameters[] = {&c->view, const_cast<Args *>(&args)};
    CUDA_CALL(c, cudaLaunchKernel((const void *)kernel, dim3(blocks), dim3(COPIES_THREADS), parameters, 0, c->stream),
              name);
#endif
    return SADMM_OK;
}

/* The view of the world as it is now; what contacts gave bodies is where the last step has put it. */
static void view_now(struct sadmm_context *c, double **wrench, double **kinematic_wrench)
{
    const struct cuda_step *s = c->step;
    CUDA(view_into)(c, 1 - s->into, 0);
    *kinematic_wrench = s->kinematic > 0 ? c->view.kinematic.wrench : nullptr;
    CUDA(view_into)(c, s->into, 0);
    *wrench = buffer<double>(c, BUFFER_WORLD_WRENCH) + (size_t)(1 - s->into) * 6 * (size_t)s->bodies;
}

extern "C" bool CUDA(has_array)(int32_t array, bool in) { return in ? is_input(array) : row_kind_of(array) != NO_ROW; }

extern "C" sadmm_status CUDA(exchange)(struct sadmm_context *c, const struct sadmm_resident_copies *copies,
                                       const struct sadmm_resident_array *array, bool in, const uint8_t *left,
                                       uint8_t *refused, void *stream, struct sadmm_error *error)
{
    const int64_t rows = (int64_t)copies->count * array->rows;
    double *wrench, *kinematic_wrench;
    CUDA_ENTER(c);
    CUDA_CALL(c, cudaEventRecord(c->fork, (cudaStream_t)stream), "cudaEventRecord");
    CUDA_CALL(c, cudaStreamWaitEvent(c->stream, c->fork, 0), "cudaStreamWaitEvent");
    view_now(c, &wrench, &kinematic_wrench);
    const bool wrenches = c->plan.wrenches;
    copies_args args = {*copies, *array,  left,      refused, wrenches ? wrench : nullptr,
                        wrenches ? kinematic_wrench : nullptr, nullptr, c->bounces};
    if (in && array->array == SADMM_ARRAY_SHAPE_MATERIAL) args.shapes = COLLISION(shapes_to_set)(c->step->collision);
    return in ? run(c, in_kernel, "inputs of environments", rows, args, error)
              : run(c, out_kernel, "arrays of environments", rows, args, error);
}

/* ---- states that are kept ---------------------------------------------------------------------------------------- */

namespace {
/* Parts of a block, one behind the other. */
struct block_of_parts {
    char *host, *device; /* NULL: they are counted alone */
    size_t bytes;
    template <class T> T *add(const T *from, size_t count)
    {
        const size_t at = bytes;
        bytes += (count * sizeof(T) + 63) / 64 * 64;
        if (host && count > 0) memcpy(host + at, from, count * sizeof(T));
        return (T *)(device + at);
    }
};
} // namespace

static struct cuda_kept_state list_parts(const struct sadmm_resident_copies *n, const struct sadmm_resident_state *from,
                                         struct block_of_parts *block)
{
    const size_t bodies = (size_t)n->bodies, kinematic = (size_t)n->kinematic, joints = (size_t)n->joints,
                 couplings = (size_t)n->couplings;
    const struct sadmm_contact_set *set = from->contacts;
    struct cuda_kept_state out = {};
    (void)block->add(&out, 1);
    out.rigid = block->add(from->rigid, bodies);
    out.extrapolation = block->add(from->extrapolation, bodies);
    out.wrench = block->add(from->wrench, 6 * bodies);
    out.kinematic = block->add(from->kinematic, kinematic);
    out.kinematic_wrench = block->add(from->kinematic_wrench, 6 * kinematic);
    out.joints = block->add(from->joints, joints + couplings);
    out.enabled = block->add(from->enabled, joints);
    out.couplings = block->add(from->couplings, couplings);
    out.gear_force = block->add(from->gear_force, (size_t)n->gears);
    out.pairs = block->add(set->pairs, set->pair_count);
    out.points = block->add(set->points, set->point_count);
    out.migrations = block->add(set->migrations, set->migrating > 0 ? set->point_count : 0);
    out.pair_count = (int32_t)set->pair_count;
    out.point_count = (int32_t)set->point_count;
    out.dt = set->dt;
    return out;
}

extern "C" sadmm_status CUDA(keep_state)(struct sadmm_context *c, const struct sadmm_resident_copies *copies,
                                         const struct sadmm_resident_state *from, void **out,
                                         struct sadmm_error *error)
{
    struct block_of_parts counted = {nullptr, nullptr, 0};
    *out = nullptr;
    (void)list_parts(copies, from, &counted);
    TRY(CUDA(allocate)(c, counted.bytes, out, error));
    char *host = (char *)sadmm_alloc(counted.bytes, 1);
    if (!host) {
        CUDA(release)(c, *out);
        *out = nullptr;
        return sadmm_fail_memory(error, "the state of an environment");
    }
    struct block_of_parts block = {host, (char *)*out, 0};
    const struct cuda_kept_state state = list_parts(copies, from, &block);
    memcpy(host, &state, sizeof state);
    const sadmm_status status = CUDA(to_backend)(c, *out, host, counted.bytes, error);
    sadmm_free(host);
    if (status == SADMM_OK) return SADMM_OK;
    CUDA(release)(c, *out);
    *out = nullptr;
    return status;
}

/* How many contacts worlds begin with; each kept state is read once in a row of equal ones. */
static sadmm_status count_contacts(struct sadmm_context *c, int32_t count, void *const *states,
                                   struct sadmm_cuda_contact_counts *most, struct sadmm_error *error)
{
    struct cuda_kept_state state = {};
    for (int32_t k = 0; k < count; ++k) {
        if (k == 0 || states[k] != states[k - 1]) TRY(CUDA(get)(c, &state, states[k], sizeof state, error));
        most->pairs += state.pair_count;
        most->points += state.point_count;
    }
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(put_states)(struct sadmm_context *c, const struct sadmm_resident_copies *copies,
                                         int32_t count, const int32_t *which, void *const *states, bool *fits,
                                         struct sadmm_error *error)
{
    struct cuda_step *s = c->step;
    const size_t n = (size_t)copies->count;
    struct sadmm_cuda_contact_counts counts = {};
    CUDA_ENTER(c);
    TRY(CUDA(wait)(c, error));
    TRY(count_contacts(c, count, states, &counts, error));
    TRY(CUDA(reserve)(c, BUFFER_COPIES, n * sizeof *states, error));
    const void **listed = (const void **)sadmm_alloc(n, sizeof *listed);
    if (!listed) return sadmm_fail_memory(error, "states of environments");
    for (int32_t k = 0; k < count; ++k) listed[which[k]] = states[k];
    const sadmm_status status = CUDA(put)(c, buffer<void>(c, BUFFER_COPIES), listed, n * sizeof *listed, error);
    sadmm_free(listed);
    TRY(status);
    struct states_args args = {*copies, buffer<const struct cuda_kept_state *>(c, BUFFER_COPIES), nullptr, nullptr, 1};
    TRY(COLLISION(put_contacts)(s->collision, c->stream, copies, args.states, &counts, fits, error));
    if (!*fits) return SADMM_OK;
    s->now = counts;
    const int32_t widths[] = {copies->bodies, copies->kinematic, copies->joints + copies->couplings, copies->gears};
    for (int32_t width : widths) args.width = std::max(args.width, width);
    view_now(c, &args.wrench, &args.kinematic_wrench);
    TRY(run(c, begin_kernel, "environments that begin again", (int64_t)n * args.width, args, error));
    return CUDA(wait)(c, error);
}
