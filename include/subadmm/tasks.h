/* Threads of the host for the work of the library.
 *
 * By default the library uses OpenMP's threads (builds without OpenMP: plain ones). A program with its own thread pool
 * can provide that instead: to a world in its definition, to a problem by sadmm_problem_set_tasks. The library then
 * creates no threads. Results do not depend on the pool or the number of threads, bit for bit. */
#ifndef SUBADMM_TASKS_H
#define SUBADMM_TASKS_H

#include "status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A task: call it once, with its argument, on any thread. It returns at once if the library no longer waits for it,
 * else after microseconds to milliseconds of work. Meanwhile it may wait for tasks of the same call that are already
 * running, and for nothing else: it takes no locks and calls no function of the host. */
typedef void sadmm_task(void *argument);

/* How the library hands out tasks. The callbacks run on the thread that calls sadmm_world_step, sadmm_problem_solve or
 * another working function, before it returns; all tasks of the call have then been waited for. If objects used on
 * different threads share callbacks, these run on those threads at the same time. All zero: no callbacks. */
typedef struct sadmm_tasks {
    /* Schedule task(argument) and return a handle that is not NULL; or return NULL if the task has already been run on
     * this thread, or will not be run (e.g. the pool is full): the library does without it. Must not wait for another
     * task to end. The library waits a few microseconds for tasks to begin and continues with those that have. */
    void *(*enqueue)(void *user, sadmm_task *task, void *argument);
    /* Wait for the task and release its handle. Called once for every handle that is not NULL, in the order of
     * `enqueue`. What the task wrote must be visible then, as after joining a thread. The task may not have begun yet.
     * If a thread of the pool may get here (a task of the host steps a world), this must run tasks that have not begun,
     * of any kind, or leave a thread to do so; otherwise all threads could wait here for ever. */
    void (*wait)(void *user, void *name);
    void *user;  /* passed to both; may be NULL */
    int threads; /* largest number of threads at work, the calling one included, in [1, 1024]; fewer by
                    settings.threads, if that is not 0, and in small scenes */
} sadmm_tasks;

#ifdef __cplusplus
}
#endif
#endif
