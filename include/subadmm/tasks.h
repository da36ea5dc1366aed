/* Threads of the host for the work of the library.
 *
 * By itself the library takes OpenMP's threads (builds without OpenMP: none but the calling one). A program that has a
 * pool of threads of its own can give that instead: to a world in its definition, to a problem by
 * sadmm_problem_set_tasks. The library then makes no thread. Results do not depend on which it is, nor on how many
 * threads come, bit for bit. */
#ifndef SUBADMM_TASKS_H
#define SUBADMM_TASKS_H

#include "status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A task: to be called once, with the argument that came with it. It may run on any thread. It returns at once where
 * the library no longer waits for it, else after some microseconds to milliseconds of work, during which it may wait
 * for tasks of the same call that run already, and for nothing else: it takes no locks and calls nothing of the
 * host. */
typedef void sadmm_task(void *argument);

/* How the library hands out tasks. Everything is called by the thread that is in sadmm_world_step, sadmm_problem_solve
 * or another call that works, while it is in there; when the call returns, all of its tasks have been waited for.
 * Objects that are used on different threads and share callbacks have them called on these threads at the same time.
 * All zero: no callbacks. */
typedef struct sadmm_tasks {
    /* Have task(argument) run, and return something not NULL to name it by; or return NULL: the task has been run
     * already, on this thread, or will not be run (the pool is full, say), and the library does without. Must not wait
     * for another task to end. The library waits a few microseconds for tasks to begin and goes on with those that
     * have. */
    void *(*enqueue)(void *user, sadmm_task *task, void *argument);
    /* Return when the named task has returned, and forget it. Called once for every name that is not NULL, in the order
     * of `enqueue`. What the task wrote must be visible then, as after joining a thread. The task may not have begun
     * yet. So where a thread of the pool may get here (a world is stepped by a task of the host), this must run tasks
     * that have not begun, or leave a thread to do so: otherwise threads that all wait here would wait for ever. The
     * tasks it runs may be anything, other steps included. */
    void (*wait)(void *user, void *name);
    void *user;  /* handed to both; may be NULL */
    int threads; /* the most threads that work at a time, the calling one included, in [1, 1024]; settings.threads,
                    where it is not 0, may lower it, and so does a scene that has too little to do for them */
} sadmm_tasks;

#ifdef __cplusplus
}
#endif
#endif
