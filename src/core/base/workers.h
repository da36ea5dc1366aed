/* The library's own threads. One is made when it is needed and all others are at work; then it stays for the life of
 * the process, asleep where there is nothing to do. It takes no signals. They work for all threads of the program. */
#ifndef SADMM_CORE_WORKERS_H
#define SADMM_CORE_WORKERS_H

#include "subadmm/tasks.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SADMM_MOST_THREADS = 1024 };

/* Have a worker run task(argument). NULL: there is none left, and no more can be made. */
void *sadmm_worker_call(void *unused, sadmm_task *task, void *argument);

/* Until the task has run; a worker that has not begun yet will not do it. Once for each call. */
void sadmm_worker_release(void *unused, void *worker);

#ifdef __cplusplus
}
#endif

#endif
