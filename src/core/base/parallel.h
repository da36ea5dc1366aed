/* Work by several threads: every parallel region of the library is one call of sadmm_parallel or
 * sadmm_parallel_open.
 *
 * The threads are OpenMP's (workers.h), or come as tasks from the host's pool (subadmm/tasks.h). The calling
 * thread waits for them some microseconds. From then on the number of members is known, and those that come late go
 * home: on a busy machine a region is done by those that are there. A region is therefore written for any number of
 * members, and gives the same result, bit for bit, for all of them.
 *
 * Threads do not survive a fork: a child of a process that has used them goes on with one thread (as do the objects in
 * it that were given a pool of the parent's). */
#ifndef SADMM_CORE_PARALLEL_H
#define SADMM_CORE_PARALLEL_H

#include <stdbool.h>
#include <stddef.h>

#include "error.h"
#include "workers.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whose threads work for a world or a problem. All 0: OpenMP's. */
struct sadmm_team {
    sadmm_tasks tasks;
    unsigned forks; /* of the process when the tasks were given */
    int ran;        /* the most members a region has had since somebody set this to 0 */
};

/* `tasks` may be NULL, for OpenMP's threads. `name` is the argument's in messages. Errors: INVALID_ARGUMENT
 * (`team` is left alone), OUT_OF_MEMORY. */
sadmm_status sadmm_team_init(struct sadmm_team *team, const sadmm_tasks *tasks, const char *name,
                             struct sadmm_error *error);

/* Threads for work that `deserved` of them have enough of: no more than `wanted` (0: any number), and than there are
 * processors or the host's pool has threads. `team` may be NULL. */
int sadmm_team_threads(const struct sadmm_team *team, int wanted, size_t deserved);

/* Work of member `thread` in [0, threads). The calling thread is member 0. */
typedef void sadmm_parallel_function(void *argument, int thread, int threads);

/* Have the function called by up to `threads` threads at a time, once by each; return when all are done. Returns how
 * many they were. The function may wait at barriers (barrier.h); it begins no region. `team`: NULL for OpenMP's
 * threads. */
int sadmm_parallel(struct sadmm_team *team, int threads, sadmm_parallel_function *function, void *argument);

/* The same for work that is taken piece by piece, whoever is free the next one: threads take part as they come, also
 * late, as long as the calling one is at it. `threads` of the function is 0: nobody knows how many come. It waits at no
 * barriers, and returns when no piece is left. */
int sadmm_parallel_open(struct sadmm_team *team, int threads, sadmm_parallel_function *function, void *argument);

/* Share `thread` of `threads` of [0, count): contiguous, sizes differ by at most one. */
static inline void sadmm_share(size_t count, int thread, int threads, size_t *begin, size_t *end)
{
    size_t base = count / (size_t)threads, extra = count % (size_t)threads, t = (size_t)thread;
    *begin = t * base + (t < extra ? t : extra);
    *end = *begin + base + (t < extra ? 1 : 0);
}

/* Tests and benchmarks: in calls of this thread take as many threads as the settings ask for, however little there is
 * to do and however few processors there are, and wait for all of the library's. */
void sadmm_test_force_threads(bool force);
bool sadmm_test_forces_threads(void);

#ifdef __cplusplus
}
#endif
#endif
