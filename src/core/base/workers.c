#include "workers.h"

#include <pthread.h>
#include <signal.h>
#include <stdbool.h>

#include "wait.h"

enum { IDLE, CALLED, WORKING, ENDING };

struct worker {
    _Alignas(64) struct sadmm_word state;
    sadmm_task *task;
    void *argument;
    struct worker *next; /* idle one */
    pthread_t thread;
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; /* of all below, but for states */
static struct worker workers[SADMM_MOST_THREADS], *idle;
static int made, most = SADMM_MOST_THREADS;

static void *work(void *argument)
{
    struct worker *worker = argument;
    for (;;) {
        unsigned state = sadmm_word_wait(&worker->state, IDLE);
        if (state == ENDING) return NULL;
        /* If that fails, the task was taken back. */
        if (!atomic_compare_exchange_strong(&worker->state.value, &state, WORKING)) continue;
        worker->task(worker->argument);
        sadmm_word_set(&worker->state, IDLE);
    }
}

static struct worker *make_worker(void)
{
    if (made >= most) return NULL;
    struct worker *worker = &workers[made];
    sigset_t all, before;
    sigfillset(&all);
    if (pthread_sigmask(SIG_SETMASK, &all, &before) != 0) return NULL;
    const bool runs = pthread_create(&worker->thread, NULL, work, worker) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    /* A process that cannot have more keeps half of them: the rest of its address space is for what it works on. */
    if (runs) ++made;
    else most = made / 2;
    return runs ? worker : NULL;
}

void *sadmm_worker_call(void *unused, sadmm_task *task, void *argument)
{
    (void)unused;
    pthread_mutex_lock(&lock);
    struct worker *worker = idle;
    if (worker) idle = worker->next;
    else worker = make_worker();
    pthread_mutex_unlock(&lock);
    if (!worker) return NULL;
    worker->task = task;
    worker->argument = argument;
    sadmm_word_set(&worker->state, CALLED);
    return worker;
}

void sadmm_worker_release(void *unused, void *called)
{
    struct worker *worker = called;
    unsigned state = CALLED;
    (void)unused;
    if (!atomic_compare_exchange_strong(&worker->state.value, &state, IDLE))
        while (state != IDLE) state = sadmm_word_wait(&worker->state, state);
    pthread_mutex_lock(&lock);
    const bool stays = worker - workers < most;
    if (stays) {
        worker->next = idle;
        idle = worker;
    }
    pthread_mutex_unlock(&lock);
    if (stays) return;
    sadmm_word_set(&worker->state, ENDING);
    pthread_join(worker->thread, NULL);
}
