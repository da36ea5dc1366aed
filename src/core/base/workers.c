#include "workers.h"

#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "processors.h"
#include "wait.h"

enum { IDLE, CALLED, WORKING, ENDING };

struct worker {
    _Alignas(64) struct sadmm_word state;
    sadmm_task *task;
    void *argument;
    struct worker *next; /* idle one */
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; /* of all below, but for states */
static struct worker workers[SADMM_MOST_THREADS], *idle;
static int made, idle_count;
static int asked; /* for so many; a request for no more is not tried again */

/* ---- members of the team ----------------------------------------------------------------------------------------- */

enum { CLOSED, OPEN };
static struct sadmm_word team;
static int size; /* workers of the next team */

static void work(struct worker *worker)
{
    for (;;) {
        unsigned state = sadmm_word_wait(&worker->state, IDLE);
        if (state == ENDING) return;
        /* If that fails, the task was taken back. */
        if (!atomic_compare_exchange_strong(&worker->state.value, &state, WORKING)) continue;
        worker->task(worker->argument);
        sadmm_word_set(&worker->state, IDLE);
    }
}

/* The first member stands for the thread that calls the workers: OpenMP counts and places it, and it sleeps. */
static void be_member(int member, int members)
{
    if (member > 0) {
        work(&workers[member - 1]);
        return;
    }
    made = members - 1;
    sadmm_word_set(&team, OPEN);
    sadmm_word_wait(&team, OPEN);
}

#ifdef _OPENMP

/* Members share no variable of this function: what they know of each other goes through words, which a thread sanitizer
 * sees, as it does not see OpenMP's barriers. */
static void run_team(void)
{
    omp_set_dynamic(false); /* how many come is seen at each region, not when the team is opened */
#pragma omp parallel num_threads(size + 1)
    be_member(omp_get_thread_num(), omp_get_num_threads());
}

#else

static void *run_worker(void *worker)
{
    work(worker);
    return NULL;
}

static void run_team(void)
{
    pthread_t threads[SADMM_MOST_THREADS];
    int n = 0;
    while (n < size && pthread_create(&threads[n], NULL, run_worker, &workers[n]) == 0) ++n;
    be_member(0, n + 1);
    for (int i = 0; i < n; ++i) pthread_join(threads[i], NULL);
}

#endif

static void *run_teams(void *unused)
{
    (void)unused;
    for (;;) {
        for (int i = 0; i < size; ++i) atomic_store(&workers[i].state.value, IDLE);
        run_team();
    }
    return NULL;
}

/* ---- how many there can be --------------------------------------------------------------------------------------- */

static void *pass_gate(void *gate)
{
    pthread_mutex_lock(gate);
    pthread_mutex_unlock(gate);
    return NULL;
}

/* The stack that OMP_STACKSIZE asks for, "8M" for example (kilobytes without a unit); 0: the system's. */
static size_t stack_size(void)
{
#ifdef _OPENMP
    static const char units[] = "BKMG";
    const char *text = getenv("OMP_STACKSIZE");
    char *end;
    if (!text) return 0;
    unsigned long long bytes = strtoull(text, &end, 10);
    while (*end == ' ') ++end;
    const char *unit = *end ? strchr(units, *end & ~0x20) : units + 1; /* in capitals */
    if (end == text || !unit || bytes > SIZE_MAX >> 30) return 0;
    return (size_t)bytes << 10 * (unit - units);
#else
    return 0;
#endif
}

/* How many threads, up to `count`, this process can have besides those it has. */
static int try_threads(int count)
{
    pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER; /* all of them are there before the first one ends */
    pthread_t threads[SADMM_MOST_THREADS + 2];
    pthread_attr_t attributes;
    int n = 0;
    if (pthread_attr_init(&attributes) != 0) return 0;
    if (stack_size() > 0) pthread_attr_setstacksize(&attributes, stack_size()); /* too small a size is refused later */
    pthread_mutex_lock(&gate);
    while (n < count && pthread_create(&threads[n], &attributes, pass_gate, &gate) == 0) ++n;
    pthread_mutex_unlock(&gate);
    for (int i = 0; i < n; ++i) pthread_join(threads[i], NULL);
    pthread_mutex_destroy(&gate);
    pthread_attr_destroy(&attributes);
    return n;
}

/* LLVM's threads allocate when they begin. What malloc sets aside for each of them (64 MB of addresses with glibc, and
 * for a moment twice that) is not there for the next: how many it can make in a process that is short of addresses
 * cannot be foreseen. */
#if defined(_OPENMP) && defined(__clang__)
enum { ALL_OR_NONE = true };
#else
enum { ALL_OR_NONE = false };
#endif

/* OpenMP's runtimes end the process where they cannot make a thread, so threads are tried before: those that are
 * missing, the one that opens teams, and one more for the runtime's own memory. */
static void grow_to(int count)
{
    static bool opened;
    const int missing = count - made, spare = 2, can = try_threads(missing + spare);
    asked = count;
    size = count;
    if (can < missing + spare) {
        /* It keeps half of them: the rest of its address space is for what it works on. */
        asked = SADMM_MOST_THREADS;
        size = ALL_OR_NONE ? made : made + can / 2;
        if (size == made) return;
    }
    if (opened) {
        for (int i = 0; i < made; ++i) sadmm_word_set(&workers[i].state, ENDING);
        sadmm_word_set(&team, CLOSED);
    } else {
        pthread_t thread;
        if (pthread_create(&thread, NULL, run_teams, NULL) != 0) return;
        pthread_detach(thread);
        opened = true;
    }
    sadmm_word_wait(&team, CLOSED);
    idle = NULL;
    idle_count = made;
    for (int i = made; i-- > 0;) {
        workers[i].next = idle;
        idle = &workers[i];
    }
}

/* ------------------------------------------------------------------------------------------------------------------ */

int sadmm_workers_offered(int wanted)
{
    const int processors = sadmm_processors();
#ifdef _OPENMP
    if (omp_get_active_level() >= omp_get_max_active_levels()) return 1;
    if (wanted == 0 && omp_get_max_threads() < processors) return omp_get_max_threads();
#else
    (void)wanted;
#endif
    return processors;
}

void sadmm_workers_gather(int count)
{
    sigset_t all, before;
    pthread_mutex_lock(&lock);
    if (count > asked && idle_count == made && sigfillset(&all) == 0 &&
        pthread_sigmask(SIG_SETMASK, &all, &before) == 0) {
        grow_to(count);
        pthread_sigmask(SIG_SETMASK, &before, NULL);
    }
    pthread_mutex_unlock(&lock);
}

void *sadmm_worker_call(void *unused, sadmm_task *task, void *argument)
{
    (void)unused;
    pthread_mutex_lock(&lock);
    struct worker *worker = idle;
    if (worker) {
        idle = worker->next;
        --idle_count;
    }
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
    worker->next = idle;
    idle = worker;
    ++idle_count;
    pthread_mutex_unlock(&lock);
}
