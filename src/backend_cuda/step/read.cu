/* Whole steps on the device: the world and the report come back (step/world.h). */

#include <string.h>

#include "backend_cuda/device/double.h"

#include "collision/collision.h"
#include "core/base/memory.h"
#include "core/model/kinematic.h"
#include "core/model/stiffening.h"
#include "world.h"

/* ---- the report ------------------------------------------------------------------------------------------------ */

static double milliseconds(const struct cuda_step_report *report, enum step_stamp from, enum step_stamp to)
{
    return 1e-6 * (double)(report->totals.stamps[to] - report->totals.stamps[from]);
}

void CUDA(report_step)(const struct sadmm_context *c, struct sadmm_resident_report *out)
{
    const struct cuda_step *s = c->step;
    const struct cuda_step_report *last = &s->last;
    const struct sadmm_settings *settings = &s->last_settings;
    out->done = s->done;
    out->time = s->time;
    out->settings = *settings;
    out->repeats = s->repeats;
    out->offending_body = s->offending_body;
    out->plan = c->plan;
    out->plan.pairs = last->counts.pairs;
    out->plan.points = last->counts.points;
    const struct sadmm_settings share = sadmm_settings_of_substep(settings);
    const struct cuda_step_totals *totals = &last->totals;
    out->iterations =
        (totals->constrained - totals->spared) * share.iterations + (share.substeps - totals->constrained);
    out->iterations_mean = totals->iterations_mean;
    out->error = -1;
    out->error_kind = SADMM_STEP_ERROR_NONE;
    out->unsolved = totals->unmet;
    out->converged = totals->met == share.substeps;
    if (out->converged) out->iterations = totals->most_iterations;
    out->limited = totals->limited;
    out->joints = last->joints.joints;
    out->couplings = last->joints.couplings;
    out->plan.row_constraints = last->joints.constraints;
    out->plan.rows_apart = last->apart;
    out->penetration_max = last->depth;
    memcpy(&out->joint_drift, &last->joints.drift, sizeof out->joint_drift);
    out->residual.primal = last->primal;
    out->residual.dual = last->dual;
    out->ms.collide = milliseconds(last, STAMP_START, STAMP_FOUND);
    out->ms.assemble = milliseconds(last, STAMP_FOUND, STAMP_ASSEMBLED);
    out->ms.solve = milliseconds(last, STAMP_ASSEMBLED, STAMP_SOLVED);
    out->ms.finish = milliseconds(last, STAMP_SOLVED, STAMP_END);
    out->ms.total = milliseconds(last, STAMP_START, STAMP_END);
}

/* ---- entries --------------------------------------------------------------------------------------------------- */

extern "C" sadmm_status CUDA(read_bodies)(struct sadmm_context *c, struct sadmm_rigid *rigid,
                                          struct sadmm_extrapolation *extrapolation, double *wrench,
                                          struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)s->bodies;
    CUDA_ENTER(c);
    CUDA(view_into)(c, s->into, 0);
    TRY(CUDA(get)(c, rigid, c->view.step.before, n * sizeof *rigid, error));
    TRY(CUDA(get)(c, extrapolation, c->view.step.extrapolation_before, n * sizeof *extrapolation, error));
    return CUDA(get)(c, wrench, buffer<double>(c, BUFFER_WORLD_WRENCH) + (size_t)(1 - s->into) * 6 * n,
                     6 * n * sizeof *wrench, error);
}

extern "C" sadmm_status CUDA(read_kinematic)(struct sadmm_context *c, struct sadmm_kinematic_body *kinematic,
                                             double *wrench, double *velocity, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)s->kinematic;
    CUDA_ENTER(c);
    CUDA(view_into)(c, 1 - s->into, 0); /* of the last step */
    const struct kinematic_view last = c->view.kinematic;
    const double *velocities = c->view.raw.system.kinematic;
    CUDA(view_into)(c, s->into, 0);
    TRY(CUDA(get)(c, kinematic, last.after, n * sizeof *kinematic, error));
    TRY(CUDA(get)(c, wrench, last.wrench, 6 * n * sizeof *wrench, error));
    return CUDA(get)(c, velocity, velocities, 6 * n * sizeof *velocity, error);
}

extern "C" sadmm_status CUDA(view_world)(struct sadmm_context *c, struct sadmm_resident_view *out,
                                         struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    CUDA_ENTER(c);
    TRY(CUDA(wait)(c, error)); /* whoever reads it may do so on another stream */
    CUDA(view_into)(c, s->into, 0);
    out->rigid = c->view.step.before;
    out->wrench = buffer<double>(c, BUFFER_WORLD_WRENCH) + (size_t)(1 - s->into) * 6 * (size_t)s->bodies;
    out->stream = c->stream;
    return SADMM_OK;
}

extern "C" sadmm_status CUDA(read_contacts)(struct sadmm_context *c, struct sadmm_contact_set *contacts,
                                            struct sadmm_error *error)
{
    return COLLISION(download)(c->step->collision, c->stream, contacts, error);
}

extern "C" sadmm_status CUDA(read_touching)(struct sadmm_context *c, struct sadmm_touching_shapes *touching,
                                            struct sadmm_error *error)
{
    return COLLISION(touching)(c->step->collision, c->stream, touching, error);
}

/* What joints stiffened bodies by, which is beside them on the device. */
static sadmm_status stiffen_start(struct sadmm_context *c, struct sadmm_rigid *rigid, struct sadmm_error *error)
{
    const size_t n = (size_t)c->step->bodies;
    const double dt = sadmm_settings_of_substep(&c->step->last_settings).dt;
    if (c->step->joints == 0) return SADMM_OK;
    struct cuda_stiffening *stiffening = (struct cuda_stiffening *)sadmm_alloc(n + 1, sizeof *stiffening);
    if (!stiffening) return sadmm_fail_memory(error, "the step's starting bodies");
    const sadmm_status status =
        CUDA(get)(c, stiffening, buffer<void>(c, BUFFER_STIFFENING), n * sizeof *stiffening, error);
    for (size_t i = 0; status == SADMM_OK && i < n; ++i) {
        const struct sadmm_rigid before = rigid[i];
        if (stiffening[i].any) stiffening_set(&rigid[i], before.stiffness, dt, stiffening[i].more);
    }
    sadmm_free(stiffening);
    return status;
}

extern "C" sadmm_status CUDA(read_hits)(struct sadmm_context *c, struct sadmm_world_hit *hits, size_t capacity,
                                        size_t *count, size_t *first, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    *count = *first = 0;
    if (s->done == 0 || !s->last_hits) return SADMM_OK;
    return COLLISION(read_hits)(s->collision, c->stream, 1 - s->into, hits, capacity, count, first, error);
}

extern "C" sadmm_status CUDA(read_start)(struct sadmm_context *c, struct sadmm_rigid *rigid, double *velocity,
                                         double *impulse, struct sadmm_error *error)
{
    const struct cuda_step *s = c->step;
    const size_t n = (size_t)s->bodies, points = (size_t)s->last.counts.points;
    CUDA_ENTER(c);
    const int substeps = s->last_settings.substeps, /* of the last one */
              from = step_state(1 - s->into, substeps - 2, substeps);
    TRY(CUDA(get)(c, rigid,
                  s->last_hits
                      ? buffer<struct sadmm_rigid>(c, BUFFER_WORLD_HIT) + (size_t)(1 - s->into) * n /* after them */
                      : buffer<struct sadmm_rigid>(c, BUFFER_WORLD_BODIES) + (size_t)from * n,
                  n * sizeof *rigid, error));
    TRY(stiffen_start(c, rigid, error));
    TRY(CUDA(get)(c, velocity, buffer<double>(c, BUFFER_WORLD_VELOCITY), 6 * n * sizeof *velocity, error));
    return CUDA(get)(c, impulse, buffer<double>(c, BUFFER_WORLD_IMPULSE), 3 * points * sizeof *impulse, error);
}
