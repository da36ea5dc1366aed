#include "environment_work.h"

#include <stdatomic.h>

#include "environment_merge.h"
#include "environment_numbers.h"

sadmm_status sadmm_environments_load(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                     int32_t environment)
{
    if (environments->merged.world && !environments->marked[environment])
        TRY(sadmm_environments_take(environments, worker->world, environment));
    else TRY(sadmm_environment_state_load(worker->world, &environments->states[environment]));
    return sadmm_environments_read_good_frames(environments, worker, environment);
}

sadmm_status sadmm_environments_store(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                                      int32_t environment)
{
    if (environments->merged.world && !environments->marked[environment])
        return sadmm_environments_put(environments, worker->world, environment);
    return sadmm_environment_state_store(worker->world, &environments->states[environment]);
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
