/* All environments make a step together. One whose step fails would keep the others from theirs: it is taken out, which
 * is to say that its place goes on from the template, where nobody looks, until it is reset. */
#include "environment_merged_step.h"

#include "core/base/memory.h"
#include "environment_arrays.h"
#include "environment_contacts.h"
#include "environment_merge.h"
#include "world/resident/resident.h"

/* The environment is left as it is, and marked; in its place goes on the template. */
static sadmm_status take_out(struct sadmm_environments *environments, int32_t environment, const char *why)
{
    sadmm_world *world = environments->worker[0].world;
    if (!environments->marked[environment]) {
        TRY(sadmm_environments_take(environments, world, environment));
        TRY(sadmm_environment_state_store(world, &environments->states[environment]));
        sadmm_environments_put_mark(environments, environment, why);
    }
    TRY(sadmm_environment_state_load(world, &environments->kept[0]));
    TRY(sadmm_environments_put(environments, world, environment));
    return sadmm_environments_give_template_inputs(environments, environment);
}

static sadmm_status read_inputs(struct sadmm_environments *environments)
{
    sadmm_world *all = environments->merged.world;
    for (int32_t e = 0; e < environments->count; ++e) {
        if (environments->marked[e]) continue;
        const sadmm_status status = sadmm_environments_read_merged_inputs(environments, e);
        if (status == SADMM_OK) continue;
        const struct sadmm_error cause = all->error;
        if (status != SADMM_ERROR_INVALID_ARGUMENT)
            return sadmm_fail(&environments->error, status, "environment %d: %s", e, cause.message);
        const sadmm_status out = take_out(environments, e, cause.message);
        if (out != SADMM_OK)
            return sadmm_fail(&environments->error, out, "environment %d: %s", e,
                              environments->worker[0].world->error.message);
    }
    return sadmm_environments_put_contacts(environments);
}

/* Steps that the merged world has made are those of all that are not marked. */
static void count_steps(struct sadmm_environments *environments, int64_t steps, double dt)
{
    const sadmm_step_report *report = &environments->merged.world->report;
    if (steps <= 0) return;
    for (int32_t e = 0; e < environments->count; ++e) {
        struct sadmm_environment_progress *progress = &environments->merged.progress[e];
        if (environments->marked[e]) continue;
        const int64_t step = progress->report.step + steps;
        double time = progress->report.time;
        for (int64_t k = 0; k < steps; ++k) time += dt; /* as a world would */
        progress->report = *report;
        progress->report.step = step;
        progress->report.time = time;
        progress->stepped = progress->moved = true;
    }
}

/* As many as there are left, or until one fails. */
static sadmm_status run(sadmm_world *all, int64_t steps)
{
    sadmm_status status = SADMM_OK;
    for (int64_t k = 0; k < steps && status == SADMM_OK; ++k) status = sadmm_world_step_async(all);
    const sadmm_status waited = sadmm_world_wait(all);
    return status != SADMM_OK ? status : waited;
}

static sadmm_status make_steps(struct sadmm_environments *environments, int32_t steps)
{
    sadmm_world *all = environments->merged.world;
    const double dt = all->def.settings.dt;
    int64_t left = steps, last_failed = -1;
    int32_t out = -1;
    while (left > 0) {
        const int64_t before = all->report.step;
        all->not_finite = -1;
        const sadmm_status status = run(all, left);
        const struct sadmm_error cause = all->error;
        count_steps(environments, all->report.step - before, dt);
        left -= all->report.step - before;
        if (status == SADMM_OK) continue;
        const int32_t environment =
            all->not_finite < 0 ? -1 : sadmm_environments_of_body(environments, (size_t)all->not_finite);
        const bool again = environment == out && all->report.step == last_failed; /* the template fails, too */
        if (status != SADMM_ERROR_NON_FINITE || environment < 0 || again)
            return sadmm_fail(&environments->error, status, "%s", cause.message);
        out = environment;
        last_failed = all->report.step;
        TRY(take_out(environments, environment, cause.message));
        TRY(sadmm_environments_put_contacts(environments));
    }
    return SADMM_OK;
}

static sadmm_status write_outputs(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                  int32_t environment, int32_t place, void *argument)
{
    (void)place;
    (void)argument;
    if (environments->marked[environment]) return SADMM_OK;
    TRY(sadmm_environments_load(environments, worker, environment));
    return sadmm_environments_write_outputs(environments, worker, environment);
}

static bool has_outputs(const struct sadmm_environments *environments)
{
    for (size_t k = 0; k < environments->bound_count; ++k)
        if (!sadmm_environments_is_input(environments->bound[k].array)) return true;
    return false;
}

sadmm_status sadmm_environments_step_merged(struct sadmm_environments *environments, int32_t steps)
{
    TRY(read_inputs(environments));
    TRY(make_steps(environments, steps));
    if (has_outputs(environments))
        TRY(sadmm_environments_each(environments, NULL, environments->count, write_outputs, NULL));
    return sadmm_environments_keep_merged_contacts(environments);
}
