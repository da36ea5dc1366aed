/* All environments make a step together. One whose step fails would keep the others from theirs: it is taken out, which
 * is to say that its place goes on from the template, where nobody looks, until it is reset. */
#include "environment_merged_step.h"

#include "core/base/memory.h"
#include "environment_arrays.h"
#include "environment_backend.h"
#include "environment_checks.h"
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
        environments->merged.unwritten[environment] = environments->merged.any_unwritten = true;
    }
    TRY(sadmm_environment_state_load(world, &environments->kept[0]));
    TRY(sadmm_environments_put(environments, world, environment));
    return sadmm_environments_give_template_inputs(environments, environment);
}

/* What input arrays have of an environment; out of range: it is taken out. */
static sadmm_status read_environment(struct sadmm_environments *environments, int32_t environment)
{
    const sadmm_world *all = environments->merged.world;
    const sadmm_status status = sadmm_environments_read_merged_inputs(environments, environment);
    const struct sadmm_error cause = all->error;
    if (status == SADMM_OK) return SADMM_OK;
    if (status != SADMM_ERROR_INVALID_ARGUMENT)
        return sadmm_fail(&environments->error, status, "environment %d: %s", environment, cause.message);
    const sadmm_status out = take_out(environments, environment, cause.message);
    if (out == SADMM_OK) return SADMM_OK;
    return sadmm_fail(&environments->error, out, "environment %d: %s", environment,
                      environments->worker[0].world->error.message);
}

/* By the host, of all. */
static sadmm_status read_all(struct sadmm_environments *environments)
{
    for (int32_t e = 0; e < environments->count; ++e)
        if (!environments->marked[e]) TRY(read_environment(environments, e));
    for (size_t k = 0; k < environments->bound_count; ++k) environments->bound[k].given_unknown = false;
    return SADMM_OK;
}

/* Arrays that the host gives to the world: of environments in which one has changed. These have all others from the
 * host, too. */
static sadmm_status read_changed(struct sadmm_environments *environments)
{
    bool pulled = false;
    for (int32_t e = 0; e < environments->count; ++e) {
        if (environments->marked[e] || !sadmm_environments_inputs_differ(environments, e)) continue;
        if (!pulled) TRY(sadmm_environments_pull_inputs(environments, true));
        pulled = true;
        TRY(read_environment(environments, e));
    }
    return SADMM_OK;
}

/* Arrays that the backend takes by itself; what it refuses the host looks at. */
static sadmm_status exchange_inputs(struct sadmm_environments *environments)
{
    bool any = false, refused;
    for (size_t k = 0; k < environments->bound_count; ++k) {
        struct sadmm_bound_array *bound = &environments->bound[k];
        if (!bound->given || !sadmm_environments_may_exchange(environments, bound)) continue;
        TRY(sadmm_environments_exchange(environments, bound));
        any = true;
    }
    if (!any) return SADMM_OK;
    TRY(sadmm_environments_find_refused(environments, &refused));
    if (!refused) return SADMM_OK;
    TRY(sadmm_environments_pull_inputs(environments, true));
    for (int32_t e = 0; e < environments->count; ++e)
        if (environments->merged.refusals[e] && !environments->marked[e]) TRY(read_environment(environments, e));
    return SADMM_OK;
}

/* A world that its backend keeps takes most inputs there; as soon as something takes it to the host all inputs are the
 * host's affair, since it has not seen what the backend has taken. */
static sadmm_status read_inputs(struct sadmm_environments *environments)
{
    const sadmm_world *all = environments->merged.world;
    if (all->resident.loaded) {
        TRY(sadmm_environments_pull_inputs(environments, false));
        TRY(read_changed(environments));
    }
    if (all->resident.loaded) TRY(exchange_inputs(environments));
    if (!all->resident.loaded) {
        TRY(sadmm_environments_pull_inputs(environments, true));
        TRY(read_all(environments));
    }
    return sadmm_environments_put_contacts(environments);
}

/* Steps that the merged world has made are those of all that are not marked. */
static void count_steps(struct sadmm_environments *environments, int64_t steps, double dt)
{
    struct sadmm_merged_world *merged = &environments->merged;
    if (steps <= 0) return;
    for (int32_t e = 0; e < environments->count; ++e) {
        struct sadmm_environment_progress *progress = &merged->progress[e];
        if (environments->marked[e]) continue;
        progress->step += steps;
        for (int64_t k = 0; k < steps; ++k) progress->time += dt; /* as a world would */
        progress->stepped = progress->moved = true;
    }
    merged->measurable = true;
    merged->measured = false;
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
        environments->merged.measurable = false; /* the backend has some of the step that failed */
        TRY(take_out(environments, environment, cause.message));
        TRY(sadmm_environments_pull_inputs(environments, true)); /* the others' go on from where the backend had them */
        TRY(read_all(environments));
        TRY(sadmm_environments_put_contacts(environments));
    }
    return SADMM_OK;
}

sadmm_status sadmm_environments_step_merged(struct sadmm_environments *environments, int32_t steps)
{
    TRY(read_inputs(environments));
    TRY(make_steps(environments, steps));
    TRY(sadmm_environments_write_merged_outputs(environments, NULL, environments->count));
    return sadmm_environments_keep_merged_contacts(environments);
}
