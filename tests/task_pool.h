/* A host's pool of threads, as the callbacks of subadmm/tasks.h ask for one, in the ways that pools differ. */
#ifndef TESTS_TASK_POOL_H
#define TESTS_TASK_POOL_H

#include <check.h>
#include <pthread.h>
#include <stdbool.h>
#include <string.h>
#include <time.h>

#include "subadmm/tasks.h"

enum pool_kind {
    POOL_PLAIN,
    POOL_PROMPT,   /* gives its threads up to a millisecond to take a task before `enqueue` returns */
    POOL_INLINE,   /* runs every task right away and says so */
    POOL_QUIET,    /* the same, but names it */
    POOL_REFUSING, /* takes no task */
    POOL_LAZY,     /* runs tasks when they are waited for */
    POOL_HELPFUL,  /* runs a queued task, whosever it is, before it takes the next one */
    POOL_KINDS
};

enum pool_state { JOB_FREE, JOB_QUEUED, JOB_RUNNING, JOB_DONE };
struct pool_job {
    sadmm_task *task;
    void *argument;
    enum pool_state state;
};

enum { POOL_JOBS = 128, POOL_WORKERS = 8 };
struct pool {
    enum pool_kind kind;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    struct pool_job jobs[POOL_JOBS];
    pthread_t workers[POOL_WORKERS];
    int worker_count, enqueued;
    bool ends;
};

/* Holding the lock, which is let go meanwhile. */
static void pool_run(struct pool *pool, struct pool_job *job)
{
    job->state = JOB_RUNNING;
    pthread_cond_broadcast(&pool->changed);
    pthread_mutex_unlock(&pool->lock);
    job->task(job->argument);
    pthread_mutex_lock(&pool->lock);
    job->state = JOB_DONE;
    pthread_cond_broadcast(&pool->changed);
}

static struct pool_job *pool_find(struct pool *pool, enum pool_state state)
{
    for (int i = 0; i < POOL_JOBS; ++i)
        if (pool->jobs[i].state == state) return &pool->jobs[i];
    return NULL;
}

static void *pool_work(void *argument)
{
    struct pool *pool = (struct pool *)argument;
    pthread_mutex_lock(&pool->lock);
    while (!pool->ends) {
        struct pool_job *job = pool->kind == POOL_LAZY ? NULL : pool_find(pool, JOB_QUEUED);
        if (job) pool_run(pool, job);
        else pthread_cond_wait(&pool->changed, &pool->lock);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

static void *pool_enqueue(void *user, sadmm_task *task, void *argument)
{
    struct pool *pool = (struct pool *)user;
    pthread_mutex_lock(&pool->lock);
    ++pool->enqueued;
    if (pool->kind == POOL_HELPFUL) {
        struct pool_job *other = pool_find(pool, JOB_QUEUED);
        if (other) pool_run(pool, other);
    }
    struct pool_job *job = pool->kind == POOL_REFUSING ? NULL : pool_find(pool, JOB_FREE);
    if (job) {
        *job = (struct pool_job){task, argument, JOB_QUEUED};
        pthread_cond_broadcast(&pool->changed);
        if (pool->kind == POOL_INLINE || pool->kind == POOL_QUIET) pool_run(pool, job);
        if (pool->kind == POOL_INLINE) {
            job->state = JOB_FREE;
            job = NULL;
        }
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += 1000000;
        if (until.tv_nsec >= 1000000000) until.tv_sec += 1, until.tv_nsec -= 1000000000;
        while (pool->kind == POOL_PROMPT && job->state == JOB_QUEUED)
            if (pthread_cond_timedwait(&pool->changed, &pool->lock, &until) != 0) break;
    }
    pthread_mutex_unlock(&pool->lock);
    return job;
}

static void pool_wait(void *user, void *name)
{
    struct pool *pool = (struct pool *)user;
    struct pool_job *job = (struct pool_job *)name;
    pthread_mutex_lock(&pool->lock);
    if (job->state == JOB_QUEUED) pool_run(pool, job);
    while (job->state != JOB_DONE) pthread_cond_wait(&pool->changed, &pool->lock);
    job->state = JOB_FREE;
    pthread_mutex_unlock(&pool->lock);
}

static void pool_start(struct pool *pool, enum pool_kind kind, int workers)
{
    memset(pool, 0, sizeof *pool);
    pool->kind = kind;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->changed, NULL);
    for (pool->worker_count = 0; pool->worker_count < workers; ++pool->worker_count)
        ck_assert_int_eq(pthread_create(&pool->workers[pool->worker_count], NULL, pool_work, pool), 0);
}

/* The threads end; nothing may be left in the queue. */
static void pool_stop(struct pool *pool)
{
    pthread_mutex_lock(&pool->lock);
    pool->ends = true;
    pthread_cond_broadcast(&pool->changed);
    pthread_mutex_unlock(&pool->lock);
    for (int i = 0; i < pool->worker_count; ++i) pthread_join(pool->workers[i], NULL);
    for (int i = 0; i < POOL_JOBS; ++i) ck_assert_int_eq(pool->jobs[i].state, JOB_FREE);
    pthread_cond_destroy(&pool->changed);
    pthread_mutex_destroy(&pool->lock);
}

static sadmm_tasks pool_tasks(struct pool *pool, int threads)
{
    return (sadmm_tasks){pool_enqueue, pool_wait, pool, threads};
}

#endif
