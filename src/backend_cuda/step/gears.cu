/* Gears of a world on the device (core/model/gear_law.h), in double: a thread a gear. Each has a constraint of its own,
 * after those of joints, whose rows are made before. */
#include "backend_cuda/device/double.h"

#include "backend_cuda/assemble/assemble.h"
#include "core/model/gear_law.h"
#include "core/model/joint_trapezoid.h"
#include "joint_bodies.h"
#include "move.h"
#include "world.h"

enum { GEAR_THREADS = 64 }; /* a block: long work, many multiprocessors */

static __device__ __forceinline__ bool joint_acts(const joint_view &joints, int32_t j)
{
    return joints.joints[j].def.enabled && !joints.begin[j].broken;
}

/* The row of a gear; false: it can not turn its wheels where they are. */
static __device__ __noinline__ bool act(const cuda_view &v, const struct sadmm_resident_gear *gear,
                                        const struct sadmm_settings *settings, struct acting_gear *acting)
{
    struct gear_joint joints[GEAR_JOINTS];
    for (int i = 0; i < GEAR_JOINTS; ++i) {
        const struct sadmm_resident_joint *joint = &v.joints.joints[gear->joint[i]];
        const struct joint_body bodies[2] = {body_a_of(v, joint), body_of(v, joint->body[1])};
        const int32_t dynamic = bodies[0].system_body > bodies[1].system_body ? bodies[0].system_body
                                                                              : bodies[1].system_body;
        const struct sadmm_settings own = settings_with(*settings, v.model.gravities, dynamic);
        acting->joint[i] = joint_act(&joint->def, joint->frame, bodies, &own);
        joints[i].def = &joint->def;
        joints[i].memory = &v.joints.after[gear->joint[i]];
        joints[i].coordinate = gear->coordinate[i];
        joints[i].factor = i ? gear->ratio : 1;
    }
    gear_act(joints, gear->offset, settings, acting);
    return acting->count < GEAR_BODIES || gear_leave_carrier(joints, settings, acting);
}

static __device__ __forceinline__ void store_row(const cuda_view &v, const struct acting_gear &acting, size_t slot,
                                                 double start)
{
    struct raw_row row;
    int side[2];
    gear_sides(&acting, &side[0], &side[1]);
    for (int s = 0; s < 2; ++s)
        for (int j = 0; j < 6; ++j) row.jacobian[s][j] = acting.body[side[s]] >= 0 ? acting.row[side[s]][j] : 0;
    row.gain = 1, row.bias = acting.bias, row.compliance = 0;
    row.lo = -INFINITY, row.hi = INFINITY;
    row.lambda = start;
    const_cast<struct raw_row *>(v.raw.rows)[slot] = row;
}

static __global__ void __launch_bounds__(GEAR_THREADS)
    gear_rows_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t g = (int32_t)(blockIdx.x * (unsigned)GEAR_THREADS + threadIdx.x);
    if (g >= v.joints.gears || v.model.live->abort_code) return;
    const struct sadmm_resident_gear *gear = &v.joints.gear[g];
    const struct sadmm_settings settings = *v.model.settings;
    const int32_t constraint = v.joints.first_gear + g;
    const size_t slot = (size_t)constraint * SADMM_MAX_ROWS;
    struct acting_gear acting;
    const bool acts = gear->enabled && joint_acts(v.joints, gear->joint[0]) && joint_acts(v.joints, gear->joint[1]) &&
                      act(v, gear, &settings, &acting);
    const struct sadmm_row_constraint out = {acts ? gear->body[0] : -1, acts ? gear->body[1] : -1, (int32_t)slot, acts,
                                             false, 0, false, {0, 0, 0}};
    const_cast<struct sadmm_row_constraint *>(v.raw.constraints)[constraint] = out;
    v.joints.gear_after[g] = 0; /* the solution says */
    if (!acts) { /* as a joint without rows */
        v.step.control->joints.together = 1;
        return;
    }
    const double start = v.joints.gear_before[g] * settings.dt;
    const struct sadmm_joint_source source = {gear->joint[0], SADMM_ROLE_LOCK, 0, 1, 0, 0, 0};
    store_row(v, acting, slot, start);
    v.joints.sources[slot] = source;
    atomicAdd(&v.step.control->joints.constraints, 1);
    if (start != 0) atomicAdd(&v.step.control->joints.warm, 1);
}

static __global__ void __launch_bounds__(GEAR_THREADS)
    gear_solution_kernel(const __grid_constant__ cuda_view v, const __grid_constant__ cuda_args)
{
    pdl_wait_if(all_pdl(v.model.bodies));
    const int32_t g = (int32_t)(blockIdx.x * (unsigned)GEAR_THREADS + threadIdx.x);
    if (g >= v.joints.gears || v.model.live->abort_code) return;
    const int32_t constraint = v.joints.first_gear + g;
    const struct sadmm_row_constraint *row = &v.raw.constraints[constraint];
    const size_t slot = (size_t)constraint * SADMM_MAX_ROWS;
    if (row->count == 0) return;
    const bool articulated = v.joints.is_articulated[v.model.bodies + constraint];
    const double lambda = articulated ? v.joints.solution[slot] : (double)v.rows.data[slot].lambda;
    const int32_t named = row->body_b;
    v.joints.solution[slot] = lambda;
    v.joints.gear_after[g] = lambda / v.model.settings->dt;
    atomicOr(&v.joints.touch[articulation_label(v, named)],
             ISLAND_ARTICULATED | (row->body_a < 0 || row->body_b < 0 ? ISLAND_MOORED : 0));
    if (!(lambda - lambda == 0)) atomicMin(&v.step.control->offending_body, 2 * v.model.bodies + named);
}

/* ---- launches ---------------------------------------------------------------------------------------------------- */

static sadmm_status launch(struct sadmm_context *c, cuda_kernel kernel, const char *name, struct sadmm_error *error)
{
    const cuda_args args = {};
    return CUDA(launch_of)(c, kernel, name, ((int64_t)c->view.joints.gears + GEAR_THREADS - 1) / GEAR_THREADS,
                           GEAR_THREADS, &args, error);
}

sadmm_status CUDA(launch_gear_rows)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch(c, gear_rows_kernel, "rows of gears", error);
}

sadmm_status CUDA(launch_gear_solution)(struct sadmm_context *c, struct sadmm_error *error)
{
    return launch(c, gear_solution_kernel, "gears", error);
}

/* ---- where they are ---------------------------------------------------------------------------------------------- */

/* In BUFFER_GEARS: gears; then three states of their forces. */
static double *forces_of(const struct sadmm_context *c, int state)
{
    const size_t n = (size_t)c->step->gears;
    return (double *)(buffer<struct sadmm_resident_gear>(c, BUFFER_GEARS) + n) + (size_t)state * n;
}

void CUDA(view_gears)(struct sadmm_context *c, int into, int substep)
{
    const struct cuda_step *s = c->step;
    const int substeps = c->settings.substeps;
    struct joint_view *joints = &c->view.joints;
    joints->gears = s->gears;
    joints->first_gear = s->joint_constraints - s->gears;
    if (s->gears == 0) return;
    joints->gear = buffer<struct sadmm_resident_gear>(c, BUFFER_GEARS);
    joints->gear_before = forces_of(c, step_state(into, substep - 1, substeps));
    joints->gear_after = forces_of(c, step_state(into, substep, substeps));
}

sadmm_status CUDA(load_gears)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                              struct sadmm_error *error)
{
    const size_t n = (size_t)world->gear_count;
    if (n == 0) return SADMM_OK;
    TRY(CUDA(reserve)(c, BUFFER_GEARS, n * (sizeof *world->gears + 3 * sizeof(double)), error));
    TRY(CUDA(put)(c, c->buffers[BUFFER_GEARS].data, world->gears, n * sizeof *world->gears, error));
    return CUDA(put)(c, forces_of(c, 1 - c->step->into), world->gear_force, n * sizeof(double), error);
}

sadmm_status CUDA(read_gears)(struct sadmm_context *c, double *force, struct sadmm_error *error)
{
    const size_t n = (size_t)c->step->gears;
    if (n == 0) return SADMM_OK;
    return CUDA(get)(c, force, forces_of(c, 1 - c->step->into), n * sizeof *force, error);
}
