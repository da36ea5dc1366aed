#include "environment_work.h"

#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

#include "core/base/memory.h"
#include "environment_merge.h"

int32_t sadmm_environments_rows(const sadmm_environments *environments, sadmm_array array)
{
    return environments ? sadmm_world_array_rows(environments->worker[0].world, array) : 0;
}

bool sadmm_environments_is_input(sadmm_array array)
{
    const bool is_state = array == SADMM_ARRAY_BODY_STATE || array == SADMM_ARRAY_JOINT_POSITION ||
                          array == SADMM_ARRAY_JOINT_SPEED || array == SADMM_ARRAY_COUPLING_TARGET;
    return sadmm_array_is_settable(array) && !is_state;
}

sadmm_status sadmm_environments_load(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                     int32_t environment)
{
    if (environments->merged.world && !environments->marked[environment])
        return sadmm_environments_take(environments, worker->world, environment);
    return sadmm_environment_state_load(worker->world, &environments->states[environment]);
}

sadmm_status sadmm_environments_store(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                      int32_t environment)
{
    if (environments->merged.world && !environments->marked[environment])
        return sadmm_environments_put(environments, worker->world, environment);
    return sadmm_environment_state_store(worker->world, &environments->states[environment]);
}

void sadmm_environments_take_mark(struct sadmm_environments *environments, int32_t environment)
{
    sadmm_free(environments->marks[environment]);
    environments->marks[environment] = NULL;
    environments->marks_changed = environments->marks_changed || environments->marked[environment];
    environments->marked[environment] = 0;
}

void sadmm_environments_put_mark(struct sadmm_environments *environments, int32_t environment, const char *why)
{
    const size_t size = strlen(why) + 1;
    sadmm_environments_take_mark(environments, environment);
    environments->marked[environment] = 1;
    environments->marks_changed = true;
    environments->marks[environment] = (char *)sadmm_alloc(size, 1);
    if (environments->marks[environment]) memcpy(environments->marks[environment], why, size);
}

struct sharing {
    struct sadmm_environments *environments;
    const int32_t *which;
    int32_t end;
    _Atomic int32_t next; /* whoever is free takes the next one: results do not depend on who it is */
    sadmm_environment_work *work;
    void *argument;
};

static void share(void *argument, int thread, int threads)
{
    struct sharing *sharing = (struct sharing *)argument;
    struct sadmm_environment_worker *worker = &sharing->environments->worker[thread];
    (void)threads;
    for (int32_t k; (k = atomic_fetch_add(&sharing->next, 1)) < sharing->end;) {
        const sadmm_status status =
            sharing->work(sharing->environments, worker, sharing->which ? sharing->which[k] : k, k, sharing->argument);
        if (status == SADMM_OK || (worker->failed_at >= 0 && worker->failed_at < k)) continue;
        worker->failed_at = k;
        worker->failed = worker->world->error;
    }
}

sadmm_status sadmm_environments_each(struct sadmm_environments *environments, const int32_t *which, int32_t count,
                                     sadmm_environment_work *work, void *argument)
{
    const struct sadmm_environment_worker *first = NULL;
    for (int t = 0; t < environments->workers; ++t) environments->worker[t].failed_at = -1;
    const int asked = environments->settings.threads,
              wanted = asked > 0 && asked < environments->workers ? asked : environments->workers;
    const int threads = sadmm_team_threads(&environments->team, wanted, (size_t)count);
    struct sharing sharing = {
        .environments = environments, .which = which, .end = count, .work = work, .argument = argument};
    atomic_init(&sharing.next, 0);
    sadmm_parallel_open(&environments->team, threads, share, &sharing);
    for (int t = 0; t < environments->workers; ++t) {
        const struct sadmm_environment_worker *worker = &environments->worker[t];
        if (worker->failed_at >= 0 && (!first || worker->failed_at < first->failed_at)) first = worker;
    }
    const sadmm_status put = sadmm_environments_put_contacts(environments);
    if (!first) return put;
    return sadmm_fail(&environments->error, first->failed.status, "environment %d: %s",
                      which ? which[first->failed_at] : first->failed_at, first->failed.message);
}

sadmm_status sadmm_environments_check(struct sadmm_environments *environments, const char *name, int32_t environment)
{
    if (environment >= 0 && environment < environments->count) return SADMM_OK;
    return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %d: must be in [0, %d)", name,
                      environment, environments->count);
}

sadmm_status sadmm_environments_check_which(struct sadmm_environments *environments, const int32_t *which,
                                            int32_t *count)
{
    char name[32];
    if (!which) {
        *count = environments->count;
        return SADMM_OK;
    }
    if (*count < 0 || *count > environments->count)
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "count = %d: must be in [0, %d]", *count,
                          environments->count);
    const uint64_t call = ++environments->calls;
    for (int32_t k = 0; k < *count; ++k) {
        const bool there = which[k] >= 0 && which[k] < environments->count;
        if (there && environments->seen[which[k]] != call) {
            environments->seen[which[k]] = call;
            continue;
        }
        snprintf(name, sizeof name, "which[%d]", k);
        TRY(sadmm_environments_check(environments, name, which[k]));
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %d: is there twice", name,
                          which[k]);
    }
    return SADMM_OK;
}
