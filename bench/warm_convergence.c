#include "warm_convergence.h"

#include <math.h>
#include <stdlib.h>

#include "bench.h"
#include "cli/interrupt.h"
#include "core/base/clock.h"
#include "core/math/quat.h"
#include "core/base/memory.h"
#include "core/solve/schedule.h"
#include "problem_set.h"
#include "scenes/scenes.h"

static const double settled = 1e-5; /* m/s */

/* A dynamic body and what does not change of it. */
struct weighed {
    sadmm_body_id id;
    double mass, inertia[3];
};

struct warm {
    const struct sadmm_scene *scene;
    sadmm_world *world;
    struct weighed *bodies;
    double *ncp, *balanced, *momentum, *ms; /* by step; balanced: 0 outside the window */
    int window;                             /* the first step of the last quarter */
    sadmm_problem *frozen;
    int body_count, steps, done, landed; /* landed: step, -1: not yet */
    int limited;                         /* steps in which an island was slowed down */
    double mass, start, work, excess, penetration;
    struct sadmm_error *error;
};

static sadmm_status check(struct warm *w, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(w->error, status, "%s", sadmm_world_message(w->world));
}

static sadmm_status weigh(struct warm *w)
{
    int32_t count = sadmm_world_body_count(w->world);
    w->bodies = sadmm_alloc((size_t)count, sizeof *w->bodies);
    if (!w->bodies) return sadmm_fail_memory(w->error, "the bodies");
    for (int32_t i = 0; i < count; ++i) {
        sadmm_body_id id;
        sadmm_body_def def;
        TRY(check(w, sadmm_world_body_at(w->world, i, &id)));
        TRY(check(w, sadmm_world_body_def(w->world, id, &def)));
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        w->bodies[w->body_count++] = (struct weighed){id, def.mass, {def.inertia[0], def.inertia[1], def.inertia[2]}};
        w->mass += def.mass;
    }
    return SADMM_OK;
}

/* Kinetic and potential, J. */
static sadmm_status energy(struct warm *w, double *out)
{
    vec3 gravity = v3_load(w->scene->def.settings.gravity);
    *out = 0;
    for (int i = 0; i < w->body_count; ++i) {
        const struct weighed *body = &w->bodies[i];
        sadmm_body_state s;
        TRY(check(w, sadmm_world_body_state(w->world, body->id, &s)));
        vec3 v = v3_load(s.linear_velocity);
        vec3 spin = m3_tmul(q_matrix(q_load(s.orientation)), v3_load(s.angular_velocity));
        double turning = body->inertia[0] * spin.x * spin.x + body->inertia[1] * spin.y * spin.y +
                         body->inertia[2] * spin.z * spin.z;
        *out += body->mass * (0.5 * v3_norm2(v) - v3_dot(gravity, v3_load(s.position))) + 0.5 * turning;
    }
    return SADMM_OK;
}

/* The natural map at v = A^-1 (b + J^T lambda) of the last step's contact problem with its impulses. */
static sadmm_status balanced_error(struct warm *w, double *out)
{
    sadmm_certificate certificate;
    TRY(check(w, sadmm_world_freeze(w->world, w->frozen)));
    int32_t count = sadmm_world_contact_count(w->world);
    sadmm_contact *contacts = sadmm_alloc((size_t)count, sizeof *contacts);
    double *impulses = sadmm_alloc(3 * (size_t)count, sizeof *impulses);
    sadmm_status status = contacts && impulses ? SADMM_OK : sadmm_fail_memory(w->error, "the impulses");
    if (status == SADMM_OK) status = check(w, sadmm_world_contacts(w->world, 0, count, contacts));
    for (size_t k = 0; k < (size_t)count && status == SADMM_OK; ++k)
        v3_store(v3_load(contacts[k].impulse), impulses + 3 * k);
    if (status == SADMM_OK) status = sadmm_problem_set_solution(w->frozen, NULL, impulses, NULL);
    if (status == SADMM_OK) status = problem_set_balance(w->frozen, w->error);
    if (status == SADMM_OK) status = sadmm_problem_certify(w->frozen, &certificate);
    if (status == SADMM_OK) *out = certificate.ncp_max;
    sadmm_free(contacts);
    sadmm_free(impulses);
    return status;
}

static sadmm_status step(struct warm *w)
{
    sadmm_step_report report;
    double before, after;
    TRY(energy(w, &before));
    TRY(sadmm_scene_before_step(w->scene, w->world, w->done, w->error));
    TRY(energy(w, &after));
    if (w->done == 0) w->start = before;
    w->work += after - before;
    if (after != before) w->landed = w->done;
    TRY(check(w, sadmm_world_step(w->world)));
    TRY(check(w, sadmm_world_report(w->world, &report)));
    TRY(energy(w, &after));
    if (w->landed < 0 && report.contacts > 0) w->landed = w->done;
    w->excess = fmax(w->excess, after - w->start - w->work);
    w->limited += report.limited > 0;
    w->penetration = fmax(w->penetration, report.penetration_max);
    w->ncp[w->done] = report.certificate.ncp_max;
    if (w->done >= w->window) TRY(balanced_error(w, &w->balanced[w->done]));
    w->momentum[w->done] = report.certificate.momentum_max;
    w->ms[w->done] = report.ms.total;
    ++w->done;
    return SADMM_OK;
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, bench_compare_doubles);
    return values[count / 2];
}

static void summarize(struct warm *w, struct row *row)
{
    double dt = w->scene->def.settings.dt;
    int last = w->done; /* the first of the steps that stay below */
    if (w->done == 0) return;
    while (last > 0 && w->ncp[last - 1] <= settled) --last;
    if (w->landed >= 0 && last < w->done) row->settle_s = dt * (last > w->landed ? last - w->landed : 0);
    row->ncp_last = w->ncp[w->done - 1];
    int window = w->done - w->window;
    row->ms = median(w->ms, w->done); /* sorts them: nobody needs their order any more */
    row->energy_excess = w->excess / (w->mass * v3_norm(v3_load(w->scene->def.settings.gravity)));
    row->penetration = w->penetration;
    row->limited = (double)w->limited / w->done;
    if (window <= 0) return;
    row->ncp_median = median(w->ncp + w->window, window);
    row->ncp_balanced = median(w->balanced + w->window, window);
    row->momentum_max = median(w->momentum + w->window, window);
}

/* A run that blows up or takes too long ends early, with a status in the row. */
static sadmm_status run(struct warm *w, const struct warm_plan *plan, struct row *row)
{
    double begin = sadmm_clock_ms();
    TRY(weigh(w));
    w->window = w->steps * 3 / 4;
    if (sadmm_problem_create(&w->frozen) != SADMM_OK) return sadmm_fail_memory(w->error, "a problem");
    w->ncp = sadmm_alloc((size_t)w->steps, sizeof *w->ncp);
    w->balanced = sadmm_alloc((size_t)w->steps, sizeof *w->balanced);
    w->momentum = sadmm_alloc((size_t)w->steps, sizeof *w->momentum);
    w->ms = sadmm_alloc((size_t)w->steps, sizeof *w->ms);
    if (!w->ncp || !w->balanced || !w->momentum || !w->ms) return sadmm_fail_memory(w->error, "the steps");
    while (w->done < w->steps && !interrupted()) {
        sadmm_status status = step(w);
        if (status == SADMM_ERROR_NON_FINITE || status == SADMM_ERROR_LIMIT) {
            snprintf(row->status, sizeof row->status, "failed at step %d: %.250s", w->done + 1, w->error->message);
            return SADMM_OK;
        }
        if (status != SADMM_OK) return status;
        if (sadmm_clock_ms() - begin > 1e3 * plan->max_seconds && w->done < w->steps) {
            snprintf(row->status, sizeof row->status, "broken off after %d of %d steps: --max-seconds %g", w->done,
                     w->steps, plan->max_seconds);
            break;
        }
    }
    summarize(w, row);
    return SADMM_OK;
}

sadmm_status warm_convergence(const struct warm_plan *plan, sadmm_method method, const struct series *series,
                              int device, struct rows *rows, struct sadmm_error *error)
{
    struct sadmm_scene scene;
    struct warm w = {.scene = &scene, .landed = -1, .error = error};
    struct row row = row_start(ROW_WARM, plan->scene, method, series);
    TRY(sadmm_scene_open(plan->scene, &scene, error));
    sadmm_settings *settings = &scene.def.settings;
    scene.def.backend = series->backend;
    scene.def.precision = series->precision;
    scene.def.device = device;
    settings->threads = series->threads;
    settings->method = method;
    settings->iterations = plan->iterations;
    settings->substeps = 1; /* a budget a step: what sub-steps do is a matter of the time step */
    settings->certify = true;
    if (plan->dt > 0) settings->dt = plan->dt;
    w.steps = (int)lround(plan->seconds / settings->dt);
    if (w.steps < 4) w.steps = 4;
    row.iterations = plan->iterations;
    sadmm_status status = sadmm_scene_build(&scene, &w.world, error);
    if (status == SADMM_OK) status = run(&w, plan, &row);
    sadmm_step_report report;
    if (status == SADMM_OK && sadmm_world_report(w.world, &report) == SADMM_OK) {
        row.bodies = report.bodies;
        row.contacts = report.contacts;
    }
    if (status == SADMM_OK && !interrupted() && !rows_add(rows, &row)) status = sadmm_fail_memory(error, "the rows");
    sadmm_world_destroy(w.world);
    sadmm_free(w.bodies);
    sadmm_free(w.ncp);
    sadmm_free(w.balanced);
    sadmm_free(w.momentum);
    sadmm_problem_destroy(w.frozen);
    sadmm_free(w.ms);
    sadmm_scene_close(&scene);
    return status;
}
