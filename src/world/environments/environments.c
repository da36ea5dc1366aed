/* Many copies of a world. A thread has one world, its worker, which becomes one environment after the other: the state
 * of an environment is loaded, its steps are made, its state is stored. So an environment takes no more memory than
 * what steps change, its steps run in the processor's caches, and no environment can see another one. */
#include <stdio.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "core/model/settings.h"
#include "environment_arrays.h"
#include "environment_backend.h"
#include "environment_checks.h"
#include "environment_contacts.h"
#include "environment_merge.h"
#include "environment_merged_step.h"
#include "environment_work.h"
#include "subadmm/save.h"

enum { MOST_ENVIRONMENTS = 1 << 20 };

/* ---- marks ------------------------------------------------------------------------------------------------------- */

const uint8_t *sadmm_environments_marked(const sadmm_environments *environments)
{
    return environments ? environments->marked : NULL;
}

const char *sadmm_environments_mark(const sadmm_environments *environments, int32_t environment)
{
    if (!environments || environment < 0 || environment >= environments->count || !environments->marked[environment])
        return "";
    return environments->marks[environment] ? environments->marks[environment] : "no memory is left to say why";
}

/* ---- creation ---------------------------------------------------------------------------------------------------- */

/* Do all environments go into one world, which the backend keeps? */
static bool is_kept(const sadmm_world *world)
{
    return world->kernels ? world->kernels->resident != NULL : world->def.backend == SADMM_BACKEND_CUDA;
}

/* The world of the saved bytes, for one thread; steps of environments apart are the host's. */
static sadmm_status create_worker(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                  const struct sadmm_kernels *kernels, const void *bytes, size_t size,
                                  struct sadmm_error *error)
{
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_status status = sadmm_world_create(&def, &worker->world);
    if (status != SADMM_OK) return sadmm_fail(error, status, "%s", sadmm_last_message());
    sadmm_world *world = worker->world;
    world->kernels = kernels;
    status = sadmm_world_restore(world, bytes, size);
    if (status == SADMM_OK && !environments->is_merged && world->def.backend == SADMM_BACKEND_AUTO)
        status = sadmm_world_set_backend(world, SADMM_BACKEND_CPU, world->def.precision, 0);
    if (status != SADMM_OK) return sadmm_fail(error, status, "%s", world->error.message);
    world->def.settings.threads = 1;
    size_t most = 1;
    for (int array = 0; array < SADMM_ARRAY_COUNT; ++array) {
        const size_t numbers =
            (size_t)sadmm_world_array_rows(world, (sadmm_array)array) * (size_t)sadmm_array_columns((sadmm_array)array);
        most = numbers > most ? numbers : most;
    }
    worker->numbers = (double *)sadmm_alloc(most, sizeof *worker->numbers);
    return worker->numbers ? SADMM_OK : sadmm_fail_memory(error, "environments");
}

/* Environments of a merged world begin with the template's state. */
static sadmm_status begin_merged(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                 int32_t environment, int32_t place, void *argument)
{
    (void)place;
    (void)argument;
    TRY(sadmm_environment_state_load(worker->world, &environments->kept[0]));
    return sadmm_environments_store(environments, worker, environment);
}

static sadmm_status make(struct sadmm_environments *environments, const struct sadmm_kernels *kernels,
                         const void *bytes, size_t size, struct sadmm_error *error)
{
    const size_t count = (size_t)environments->count;
    const bool merged = environments->is_merged;
    environments->worker =
        (struct sadmm_environment_worker *)sadmm_alloc((size_t)environments->workers, sizeof *environments->worker);
    environments->states = (struct sadmm_environment_state *)sadmm_alloc(count, sizeof *environments->states);
    environments->marked = (uint8_t *)sadmm_alloc(count, sizeof *environments->marked);
    environments->marks = (char **)sadmm_alloc(count, sizeof *environments->marks);
    environments->seen = (uint64_t *)sadmm_alloc(count, sizeof *environments->seen);
    if (!environments->worker || !environments->states || !environments->marked || !environments->marks ||
        !environments->seen || !SADMM_GROW(environments->kept, 0, 1))
        return sadmm_fail_memory(error, "environments");
    for (int t = 0; t < environments->workers; ++t)
        TRY(create_worker(environments, &environments->worker[t], kernels, bytes, size, error));
    environments->kept_count = 1;
    sadmm_world *world = environments->worker[0].world;
    if (sadmm_environment_state_store(world, &environments->kept[0]) != SADMM_OK)
        return sadmm_fail_memory(error, "environments");
    for (size_t i = 0; i < count && !merged; ++i)
        TRY(sadmm_environment_state_copy(&environments->states[i], &environments->kept[0], error));
    if (!merged) return SADMM_OK;
    TRY(sadmm_environments_merge(environments, error));
    if (sadmm_environments_open_backend(environments) != SADMM_OK)
        return sadmm_fail(error, environments->error.status, "%s", environments->error.message);
    const sadmm_status status =
        sadmm_environments_each(environments, NULL, environments->count, begin_merged, NULL);
    return status == SADMM_OK ? status : sadmm_fail(error, status, "%s", environments->error.message);
}

static sadmm_status save_template(sadmm_world *world, unsigned char **bytes, size_t *size)
{
    *bytes = NULL;
    TRY(sadmm_world_save(world, NULL, 0, size));
    *bytes = (unsigned char *)sadmm_alloc(*size, 1);
    if (!*bytes) return sadmm_fail_memory(&world->error, "environments");
    return sadmm_world_save(world, *bytes, *size, size);
}

sadmm_status sadmm_world_replicate(sadmm_world *world, int32_t count, sadmm_environments **out)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    TRY(sadmm_check_given(out, "out", error));
    *out = NULL;
    if (count < 1 || count > MOST_ENVIRONMENTS)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "count = %d: must be in [1, %d]", count,
                          (int)MOST_ENVIRONMENTS);
    if (is_kept(world) && world->moving_surfaces > 0)
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE,
                          "environments on CUDA: a world with surfaces that move (surface_velocity of %d shapes) is "
                          "stepped by the host", world->moving_surfaces);
    unsigned char *bytes;
    size_t size;
    sadmm_status status = save_template(world, &bytes, &size);
    struct sadmm_environments *environments = (struct sadmm_environments *)sadmm_alloc(1, sizeof *environments);
    if (status == SADMM_OK && !environments) status = sadmm_fail_memory(error, "environments");
    if (status == SADMM_OK) {
        environments->team = world->team;
        environments->count = count;
        environments->settings = world->def.settings;
        environments->is_merged = is_kept(world);
        environments->workers = environments->is_merged ? 1
                                                        : sadmm_team_threads(&environments->team,
                                                                             environments->settings.threads,
                                                                             (size_t)count);
        status = make(environments, world->kernels, bytes, size, error);
    }
    sadmm_free(bytes);
    if (status == SADMM_OK) *out = environments;
    else sadmm_environments_destroy(environments);
    return status;
}

void sadmm_environments_destroy(sadmm_environments *environments)
{
    if (!environments) return;
    for (int t = 0; environments->worker && t < environments->workers; ++t) {
        sadmm_world_destroy(environments->worker[t].world);
        sadmm_free(environments->worker[t].numbers);
        sadmm_free(environments->worker[t].contacts);
    }
    for (int32_t i = 0; environments->states && i < environments->count; ++i)
        sadmm_environment_state_free(&environments->states[i]);
    for (int32_t i = 0; environments->marks && i < environments->count; ++i) sadmm_free(environments->marks[i]);
    sadmm_environments_free_contacts(environments);
    for (size_t k = 0; k < environments->kept_count; ++k) sadmm_environment_state_free(&environments->kept[k]);
    for (size_t k = 0; k < environments->bound_count; ++k)
        sadmm_environments_release_array(environments, &environments->bound[k]);
    sadmm_environments_close_backend(environments);
    sadmm_environments_free_merged(environments);
    void *blocks[] = {environments->worker, environments->states, environments->kept, environments->marked,
                      environments->marks,  environments->seen,   environments->bound};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    sadmm_free(environments);
}

const char *sadmm_environments_message(const sadmm_environments *environments)
{
    return environments ? environments->error.message : "";
}

int32_t sadmm_environments_count(const sadmm_environments *environments)
{
    return environments ? environments->count : 0;
}

size_t sadmm_environments_memory(const sadmm_environments *environments)
{
    if (!environments) return 0;
    const size_t count = (size_t)environments->count;
    size_t bytes = count * (sizeof *environments->states + sizeof *environments->marked + sizeof *environments->marks +
                            sizeof *environments->seen);
    for (size_t i = 0; i < count; ++i) bytes += SADMM_ROOM(environments->states[i].bytes);
    for (size_t i = 0; environments->contacts && i < count; ++i)
        bytes += sizeof *environments->contacts +
                 SADMM_ROOM(environments->contacts[i].list) * sizeof *environments->contacts[i].list;
    for (size_t k = 0; k < environments->kept_count; ++k) bytes += SADMM_ROOM(environments->kept[k].bytes);
    for (size_t k = 0; k < environments->bound_count; ++k) {
        const struct sadmm_bound_array *bound = &environments->bound[k];
        const size_t array = count * bound->numbers *
                             (bound->precision == SADMM_F64 ? sizeof(double) : sizeof(float));
        bytes += bound->in_backend ? 2 * array : array; /* the host has a copy */
        if (bound->given) bytes += count * bound->numbers * sizeof *bound->given;
    }
    if (environments->merged.gravities) bytes += 3 * count * sizeof *environments->merged.gravities;
    const sadmm_world *merged = environments->merged.world;
    if (merged && merged->context && merged->kernels->resident)
        bytes += merged->kernels->resident->memory(merged->context);
    return (bytes + count - 1) / count;
}

/* ---- settings ---------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_environments_set_settings(sadmm_environments *environments, const sadmm_settings *given)
{
    sadmm_settings settings;
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_settings_take(&settings, given, &environments->error));
    if (environments->merged.gravities) {
        sadmm_world *world = environments->merged.world;
        const sadmm_settings before = world->def.settings;
        world->def.settings = settings;
        const bool may = sadmm_environments_may_have_gravities(environments);
        world->def.settings = before;
        if (!may)
            return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT,
                              "settings: the host would drive the steps (residual_tolerance = %g, tolerance = %g), "
                              "and the array gravity is one on CUDA only where it does not",
                              settings.residual_tolerance, settings.tolerance);
    }
    if (settings.dt != environments->settings.dt) /* targets of kinematic bodies there are for the one before */
        for (size_t k = 0; k < environments->kept_count; ++k) sadmm_environments_forget_kept(environments, k);
    environments->settings = settings;
    settings.threads = 1;
    for (int t = 0; t < environments->workers; ++t) environments->worker[t].world->def.settings = settings;
    if (!environments->merged.world) return SADMM_OK;
    const sadmm_status status = sadmm_world_set_settings(environments->merged.world, &environments->settings);
    return status == SADMM_OK
               ? status
               : sadmm_fail(&environments->error, status, "%s", environments->merged.world->error.message);
}

void sadmm_environments_settings_sized(const sadmm_environments *environments, sadmm_settings *settings, size_t size)
{
    if (!environments) {
        sadmm_settings_init(settings, size);
        return;
    }
    (void)sadmm_growing_give(&sadmm_growing_settings, settings, size, 0, &environments->settings, "settings", NULL);
}

sadmm_status sadmm_environments_set_stream(sadmm_environments *environments, void *stream)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    environments->stream = stream;
    return SADMM_OK;
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

/* What failed is marked; memory that ran out is the call's affair, too. */
static sadmm_status take_failure(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                 int32_t environment, sadmm_status status)
{
    if (status == SADMM_OK) return SADMM_OK;
    sadmm_environments_put_mark(environments, environment, worker->world->error.message);
    return status == SADMM_ERROR_NON_FINITE || status == SADMM_ERROR_INVALID_ARGUMENT ? SADMM_OK : status;
}

static sadmm_status make_steps(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                               int32_t environment, int32_t place, void *argument)
{
    const int32_t steps = *(const int32_t *)argument;
    sadmm_world *world = worker->world;
    (void)place;
    if (environments->marked[environment]) return SADMM_OK;
    TRY(sadmm_environment_state_load(world, &environments->states[environment]));
    sadmm_status status = sadmm_environments_read_inputs(environments, worker, environment);
    if (status != SADMM_OK) return take_failure(environments, worker, environment, status);
    for (int32_t k = 0; k < steps && status == SADMM_OK; ++k) status = sadmm_world_step(world);
    status = take_failure(environments, worker, environment, status);
    TRY(take_failure(environments, worker, environment,
                     sadmm_environment_state_store(world, &environments->states[environment])));
    TRY(sadmm_environments_write_outputs(environments, worker, environment));
    return status;
}

sadmm_status sadmm_environments_step(sadmm_environments *environments, int32_t steps)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    if (steps < 1)
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "steps = %d: must be >= 1", steps);
    if (environments->merged.world) return sadmm_environments_step_merged(environments, steps);
    return sadmm_environments_each(environments, NULL, environments->count, make_steps, &steps);
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

static sadmm_status begin_again(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                int32_t environment, int32_t place, void *argument)
{
    const int32_t *states = (const int32_t *)argument;
    const struct sadmm_environment_state *from = &environments->kept[states ? states[place] : 0];
    if (environments->merged.world) {
        sadmm_environments_take_mark(environments, environment);
        TRY(sadmm_environment_state_load(worker->world, from));
        return sadmm_environments_store(environments, worker, environment);
    }
    struct sadmm_environment_state *state = &environments->states[environment];
    TRY(sadmm_environment_state_copy(state, from, &worker->world->error));
    sadmm_environments_take_mark(environments, environment);
    if (environments->bound_count == 0 && !environments->contacts) return SADMM_OK;
    TRY(sadmm_environments_load(environments, worker, environment));
    return sadmm_environments_write_outputs(environments, worker, environment);
}

/* A state that is there. place: in the call's list; -1: it is no list. */
static sadmm_status check_state(struct sadmm_environments *environments, int32_t place, int32_t state)
{
    char name[32] = "state";
    if (place >= 0) snprintf(name, sizeof name, "states[%d]", place);
    if (state < 0 || (size_t)state >= environments->kept_count)
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %d: must be in [0, %d)", name,
                          state, (int)environments->kept_count);
    if (environments->kept[state].size > 0) return SADMM_OK;
    return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %d: was forgotten", name, state);
}

/* By the merged world's backend, where it can; else by the host, which takes all of the world. */
static sadmm_status reset_merged(struct sadmm_environments *environments, const int32_t *which, int32_t count,
                                 const int32_t *states)
{
    bool done;
    if (count == 0) return SADMM_OK;
    TRY(sadmm_environments_put_kept(environments, which, count, states, &done));
    if (!done) TRY(sadmm_environments_each(environments, which, count, begin_again, (void *)states));
    sadmm_environments_forget_contacts(environments, which, count);
    return sadmm_environments_write_merged_outputs(environments, which, count);
}

sadmm_status sadmm_environments_reset(sadmm_environments *environments, const int32_t *which, int32_t count,
                                      const int32_t *states)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    TRY(sadmm_environments_check_which(environments, which, &count));
    for (int32_t k = 0; states && k < count; ++k) TRY(check_state(environments, k, states[k]));
    if (environments->merged.world) return reset_merged(environments, which, count, states);
    return sadmm_environments_each(environments, which, count, begin_again, (void *)states);
}

sadmm_status sadmm_environments_keep(sadmm_environments *environments, int32_t environment, int32_t *state)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    struct sadmm_error *error = &environments->error;
    TRY(sadmm_check_given(state, "state", error));
    TRY(sadmm_environments_check(environments, "environment", environment));
    if (environments->marked[environment])
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "environment = %d: is marked (%s)", environment,
                          sadmm_environments_mark(environments, environment));
    const size_t n = environments->kept_count;
    if (n >= INT32_MAX || !SADMM_GROW(environments->kept, n, n + 1)) return sadmm_fail_memory(error, "a state");
    if (environments->merged.world) {
        struct sadmm_environment_worker *worker = &environments->worker[0];
        sadmm_status status = sadmm_environments_load(environments, worker, environment);
        if (status == SADMM_OK) status = sadmm_environment_state_store(worker->world, &environments->kept[n]);
        if (status != SADMM_OK) return sadmm_fail(error, status, "%s", worker->world->error.message);
    } else {
        TRY(sadmm_environment_state_copy(&environments->kept[n], &environments->states[environment], error));
    }
    environments->kept_count = n + 1;
    *state = (int32_t)n;
    return SADMM_OK;
}

sadmm_status sadmm_environments_forget(sadmm_environments *environments, int32_t state)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(check_state(environments, -1, state));
    if (state == 0)
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT,
                          "state = 0: must be one that was kept, not the template's");
    sadmm_environment_state_free(&environments->kept[state]);
    sadmm_environments_forget_kept(environments, (size_t)state);
    return SADMM_OK;
}

/* The first worker's world is an environment, with what its input arrays have; of one that is marked for these, with
 * what can be had. */
static sadmm_status become(struct sadmm_environments *environments, int32_t environment)
{
    struct sadmm_environment_worker *worker = &environments->worker[0];
    TRY(sadmm_environments_pull_inputs(environments, true));
    TRY(sadmm_environments_load(environments, worker, environment));
    return sadmm_environments_read_good_inputs(environments, worker, environment);
}

sadmm_status sadmm_environments_save(sadmm_environments *environments, int32_t environment, void *buffer,
                                     size_t capacity, size_t *size)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    struct sadmm_error *error = &environments->error;
    TRY(sadmm_environments_check(environments, "environment", environment));
    TRY(sadmm_check_given(size, "size", error));
    sadmm_world *world = environments->worker[0].world;
    sadmm_status status = become(environments, environment);
    if (status == SADMM_OK) {
        const size_t kinematic = 6 * (size_t)world->kinematic_count;
        if (!SADMM_GROW(world->start.kinematic, 0, kinematic)) return sadmm_fail_memory(error, "kinematic bodies");
        if (kinematic > 0) memset(world->start.kinematic, 0, kinematic * sizeof *world->start.kinematic);
        world->start.kinematic_count = world->kinematic_count;
        world->step_settings = world->def.settings;
        world->step_settings.threads = world->def.settings.threads = environments->settings.threads;
        status = sadmm_world_save(world, buffer, capacity, size);
        world->def.settings.threads = 1;
    }
    return status == SADMM_OK ? SADMM_OK : sadmm_fail(error, status, "%s", world->error.message);
}
