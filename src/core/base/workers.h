/* The library's own threads: members of an OpenMP team that stays open for the life of the process. OpenMP makes them,
 * places them (OMP_PLACES, OMP_PROC_BIND) and says how many there are by default (OMP_NUM_THREADS). Waiting is the
 * library's (wait.h): OpenMP's barriers spin, and on a busy machine that keeps those that are waited for from running.
 *
 * The team belongs to a thread of its own, so that it is shared by all threads of the program. A call that asks for
 * more workers than there are closes it, when none of them is at work, and opens a larger one. Workers take no signals.
 * Builds without OpenMP make plain threads. */
#ifndef SADMM_CORE_WORKERS_H
#define SADMM_CORE_WORKERS_H

#include "subadmm/tasks.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SADMM_MOST_THREADS = 1024 };

/* The most threads for a region of the calling thread, itself included: one for each processor and, if none are
 * `wanted` (0), no more than OpenMP's default. In a parallel region of the program's own, one, unless OpenMP is set to
 * nest them. */
int sadmm_workers_offered(int wanted);

/* Make workers, so that there are `count`, if the process can have them and the others are idle. */
void sadmm_workers_gather(int count);

/* Have a worker run task(argument). NULL: none is idle. */
void *sadmm_worker_call(void *unused, sadmm_task *task, void *argument);

/* Until the task has run; a worker that has not begun yet will not do it. Once for each call. */
void sadmm_worker_release(void *unused, void *worker);

#ifdef __cplusplus
}
#endif

#endif
