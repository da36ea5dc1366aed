/* Whole steps on the device: take over a world, let it go; where its arrays are (step/world.h). */
#include <string.h>

#include "backend_cuda/device/double.h"

#include "backend_cuda/graph/graph.h"
#include "collision/base/bounds.h"
#include "collision/collision.h"
#include "core/base/memory.h"
#include "world.h"

/* ---- the view of a step ---------------------------------------------------------------------------------------- */

void CUDA(view_into)(struct sadmm_context *c, int into, int substep)
{
    const struct cuda_step *s = c->step;
    const int substeps = c->settings.substeps;
    const size_t from = (size_t)step_state(into, substep - 1, substeps),
                 to = (size_t)step_state(into, substep, substeps);
    const struct sadmm_cuda_contacts set = COLLISION(set)(s->collision, (int)to);
    const size_t n = (size_t)s->bodies;
    struct cuda_step_view *step = &c->view.step;
    struct sadmm_rigid *rigid = buffer<struct sadmm_rigid>(c, BUFFER_WORLD_BODIES);
    struct sadmm_extrapolation *extrapolation = buffer<struct sadmm_extrapolation>(c, BUFFER_WORLD_EXTRAPOLATION);
    step->before = rigid + from * n;
    step->after = rigid + to * n;
    step->extrapolation_before = extrapolation + from * n;
    step->extrapolation_after = extrapolation + to * n;
    step->wrench = buffer<double>(c, BUFFER_WORLD_WRENCH) + (size_t)into * 6 * n;
    step->start_velocity = buffer<double>(c, BUFFER_WORLD_VELOCITY);
    step->start_impulse = buffer<double>(c, BUFFER_WORLD_IMPULSE);
    step->points = set.points;
    step->slot_of_body = buffer<int32_t>(c, BUFFER_WORLD_SLOTS);
    step->bodies = buffer<struct sadmm_collision_body>(c, BUFFER_WORLD_PLACES);
    step->counts = set.device_counts;
    step->candidate_capacity = s->candidate_capacity;
    step->point_capacity = s->point_capacity;
    step->speculation = s->speculation;
    step->control = buffer<struct cuda_step_control>(c, BUFFER_WORLD_CONTROL);
    step->reports = step_reports(c);
    step->updates = buffer<struct cuda_updates>(c, PINNED_UPDATES);
    step->update_capacity = s->update_capacity;
    step->measured = c->plan.residuals && !stop_rule_checked(c);
    step->limits = c->plan.momentum;
    step->leaves_hits = may_take_hits(c) && !s->hits_planned;
    step->substep = substep;
    step->substeps = substeps;
    c->view.raw.system.rigid = step->before;
    c->view.raw.system.velocity = step->start_velocity;
    c->view.raw.pairs = set.pairs;
    c->view.raw.points = set.points;
    c->view.raw.migrations = set.migrations;
    CUDA(view_kinematic)(c, into);
    CUDA(view_joints)(c, into, substep);
    CUDA(view_articulations)(c);
    CUDA(view_ncp)(c);
    CUDA(view_push)(c);
}

/* Counts and settings of the view; pairs: their capacity. */
void CUDA(view_counts)(struct sadmm_context *c, int64_t pairs)
{
    struct cuda_step *s = c->step;
    cuda_view *v = &c->view;
    struct sadmm_system none = {};
    c->system = nullptr;
    v->raw.system = none;
    v->raw.system.body_count = s->bodies;
    v->raw.system.kinematic_count = s->kinematic;
    v->model.bodies = s->bodies;
    v->contacts.pair_capacity = (int32_t)((pairs + WARP - 1) / WARP * WARP);
    v->rows.count = s->apart ? 0 : s->joint_constraints;
    v->model.contact_rows = s->speculation.contact_rows == 1 ? 1 : 3;
    v->model.warm_start = c->settings.warm_start;
}

sadmm_status CUDA(clear_abort)(struct sadmm_context *c, struct sadmm_error *error)
{
    CUDA_CALL(c, cudaMemsetAsync(c->view.model.live, 0, sizeof *c->view.model.live, c->stream),
              "cudaMemsetAsync(live)");
    return SADMM_OK;
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

void CUDA(step_destroy)(struct sadmm_context *c)
{
    struct cuda_step *s = c->step;
    if (!s) return;
    for (struct queued_step &q : s->queue) {
        if (q.done) (void)cudaEventDestroy(q.done);
    }
    for (const struct step_graphs &graphs : s->graphs)
        for (cudaGraphExec_t graph : graphs.into)
            if (graph) (void)cudaGraphExecDestroy(graph);
    CUDA(destroy)(s->push);
    COLLISION(destroy)(s->collision);
    sadmm_free(s);
    c->step = nullptr;
}

static sadmm_status step_create(struct sadmm_context *c, struct sadmm_error *error)
{
    struct cuda_step *s = (struct cuda_step *)sadmm_alloc(1, sizeof *s);
    if (!s) return sadmm_fail_memory(error, "the cuda backend's world");
    c->step = s;
    TRY(COLLISION(create)(c->device, &s->collision, error));
    for (struct queued_step &q : s->queue)
        CUDA_CALL(c, cudaEventCreateWithFlags(&q.done, cudaEventDisableTiming), "cudaEventCreate");
    return SADMM_OK;
}

/* Where each of many equal worlds has its own. */
static sadmm_status load_gravities(struct sadmm_context *c, const struct sadmm_resident_world *world,
                                   struct sadmm_error *error)
{
    struct cuda_gravities *view = &c->view.model.gravities;
    *view = {};
    if (!world->gravities) return SADMM_OK;
    const size_t count = (size_t)world->copies->count;
    double *numbers = (double *)sadmm_alloc(count, GRAVITY_NUMBERS * sizeof *numbers);
    if (!numbers) return sadmm_fail_memory(error, "gravity of environments");
    for (size_t k = 0; k < count; ++k) {
        memcpy(numbers + GRAVITY_NUMBERS * k, world->gravities + 3 * k, 3 * sizeof *numbers);
        numbers[GRAVITY_NUMBERS * k + GRAVITY_SIZE] = gravity_size(world->gravities + 3 * k);
    }
    const size_t bytes = count * GRAVITY_NUMBERS * sizeof *numbers;
    sadmm_status status = CUDA(reserve)(c, BUFFER_GRAVITY, bytes, error);
    if (status == SADMM_OK) status = CUDA(put)(c, buffer<void>(c, BUFFER_GRAVITY), numbers, bytes, error);
    sadmm_free(numbers);
    if (status == SADMM_OK) *view = {buffer<double>(c, BUFFER_GRAVITY), world->copies->bodies, world->copies->shapes};
    return status;
}

extern "C" sadmm_status CUDA(load_world)(struct sadmm_context *c, const struct sadmm_resident_world *world,
                                         const struct sadmm_settings *settings, struct sadmm_error *error)
{
    const size_t n = (size_t)world->body_count, slots = world->input->body_count;
    if (n > (size_t)INT32_MAX / 64)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%d bodies: at most %d", world->body_count, INT32_MAX / 64);
    CUDA_ENTER(c);
    TRY(CUDA(wait)(c, error));
    if (!c->step) {
        sadmm_status status = step_create(c, error);
        if (status != SADMM_OK) {
            CUDA(step_destroy)(c);
            return status;
        }
    }
    struct cuda_step *s = c->step;
    s->bodies = (int32_t)n;
    s->copies = world->copies ? world->copies->count : 0;
    s->slots = (int32_t)slots;
    const struct sadmm_settings share = sadmm_settings_of_substep(settings);
    s->last_settings = *settings;
    s->time = world->time;
    s->planned = false;
    forget_graphs(s);
    s->enqueued = s->seen = s->done = s->repeats = 0;
    s->offending_body = -1;
    s->learned.step = -1;
    s->conservative = 0;
    s->updated_steps = 0;
    s->apart = false;
    s->quiet = s->warm = 0;
    s->cold = s->push_streams = false;
    s->hits_planned = s->last_hits = false;
    s->calm = 0;
    s->untouched = 0;
    s->backoff = s->solved_backoff = LEAST_BACKOFF;
    s->unsolved = false;
    s->solved = 0;
    for (struct queued_step &q : s->queue) q.update_count = 0;
    memset(&s->last, 0, sizeof s->last);
    memset(&s->now, 0, sizeof s->now);
    TRY(CUDA(use_settings)(c, &share, error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_BODIES, 3 * n * sizeof *world->rigid, error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_EXTRAPOLATION, 3 * n * sizeof *world->extrapolation, error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_WRENCH, 12 * n * sizeof(double), error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_VELOCITY, 6 * n * sizeof(double), error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_SLOTS, n * sizeof *world->slot_of, error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_PLACES, slots * sizeof(struct sadmm_collision_body), error));
    TRY(CUDA(reserve)(c, BUFFER_WORLD_CONTROL, sizeof(struct cuda_step_control), error));
    TRY(CUDA(reserve)(c, PINNED_REPORTS, STEPS_AHEAD * sizeof(struct cuda_step_report), error));
    CUDA_CALL(c, cudaMemsetAsync(buffer<void>(c, BUFFER_WORLD_CONTROL), 0, sizeof(struct cuda_step_control), c->stream),
              "cudaMemsetAsync(control)");
    /* steps do not write what is not of account (core/model/rolling.h) */
    if (n > 0)
        CUDA_CALL(c, cudaMemsetAsync(buffer<void>(c, BUFFER_WORLD_BODIES), 0, 3 * n * sizeof *world->rigid, c->stream),
                  "cudaMemsetAsync(bodies)");

    c->bounces = false;
    for (size_t k = 0; k < world->input->shape_count; ++k)
        c->bounces = c->bounces ||
                     (sadmm_shape_collides(&world->input->shapes[k]) && world->input->shapes[k].restitution > 0);
    c->plan.gyroscopic = sadmm_plan_is_gyroscopic(world->rigid, world->body_count);
    s->uneven = sadmm_plan_is_uneven(world->rigid, world->body_count);
    /* The state before the first step is the one that is not written by it. */
    TRY(COLLISION(upload)(s->collision, c->stream, world->contacts, error));
    s->into = 1 - COLLISION(current)(s->collision);
    const size_t before = (size_t)(1 - s->into);
    TRY(CUDA(put)(c, c->buffers[BUFFER_WORLD_SLOTS].data, world->slot_of, n * sizeof *world->slot_of, error));
    TRY(CUDA(put)(c, c->buffers[BUFFER_WORLD_PLACES].data, world->input->bodies, slots * sizeof *world->input->bodies,
                  error));
    TRY(CUDA(reserve)(c, PINNED_BODIES, n * sizeof *world->rigid, error));
    TRY(CUDA(upload)(c, buffer<struct sadmm_rigid>(c, BUFFER_WORLD_BODIES) + before * n, PINNED_BODIES, 0,
                     world->rigid, n * sizeof *world->rigid, error));
    TRY(CUDA(wait)(c, error));
    TRY(CUDA(upload)(c, buffer<struct sadmm_extrapolation>(c, BUFFER_WORLD_EXTRAPOLATION) + before * n, PINNED_BODIES,
                     0, world->extrapolation, n * sizeof *world->extrapolation, error));
    TRY(CUDA(wait)(c, error));
    TRY(CUDA(load_kinematic)(c, world, error));
    TRY(CUDA(load_joints)(c, world, error));
    TRY(CUDA(load_articulations)(c, world, error));
    CUDA(view_counts)(c, 0);
    TRY(CUDA(reserve_layout)(c, error)); /* live is needed from here on */
    TRY(CUDA(clear_abort)(c, error));
    s->candidate_capacity = s->point_capacity = c->first_capacity;
    c->refused = 0;
    s->mispredicted = -1;
    const struct cuda_settings *kept = buffer<struct cuda_settings>(c, BUFFER_SETTINGS);
    TRY(COLLISION(attach)(s->collision, c->stream, world->input,
                          buffer<struct sadmm_collision_body>(c, BUFFER_WORLD_PLACES),
                          &c->view.model.live->abort_code, &kept->settings.dt, &kept->gravity, error));
    TRY(load_gravities(c, world, error));
    COLLISION(use_gravities)(s->collision, &c->view.model.gravities);
    TRY(COLLISION(load_hits)(s->collision, world->input, world->held, error));
    CUDA(view_into)(c, s->into, 0);
    return CUDA(wait)(c, error);
}
