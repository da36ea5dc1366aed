#include "parallel.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "barrier.h"

#ifdef _OPENMP
#include <omp.h>
#endif

static _Thread_local bool forced;

void sadmm_test_force_threads(bool force) { forced = force; }
bool sadmm_test_forces_threads(void) { return forced; }

/* ---- forks ------------------------------------------------------------------------------------------------------- */

static atomic_uint forks;       /* between the process that began to watch and this one */
static atomic_bool openmp_used; /* there is a pool of OpenMP's, */
static atomic_bool openmp_lost; /* and it is in a parent of this process */

static void in_child(void)
{
    atomic_fetch_add(&forks, 1);
    if (atomic_load(&openmp_used)) atomic_store(&openmp_lost, true);
}

static pthread_once_t once = PTHREAD_ONCE_INIT;
static bool watching;

static void watch(void) { watching = pthread_atfork(NULL, NULL, in_child) == 0; }

static bool watch_forks(void) { return pthread_once(&once, watch) == 0 && watching; }

/* ---- teams ------------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_team_init(struct sadmm_team *team, const sadmm_tasks *tasks, const char *name,
                             struct sadmm_error *error)
{
    static const sadmm_tasks none;
    if (!tasks) tasks = &none;
    if (!tasks->enqueue != !tasks->wait)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s.%s = NULL: must be given with %s.%s", name,
                          tasks->enqueue ? "wait" : "enqueue", name, tasks->enqueue ? "enqueue" : "wait");
    if (tasks->enqueue && (tasks->threads < 1 || tasks->threads > SADMM_MOST_THREADS))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s.threads = %d: must be in [1, %d]", name,
                          tasks->threads, (int)SADMM_MOST_THREADS);
    if (tasks->enqueue && !watch_forks()) return sadmm_fail_memory(error, "the callbacks for tasks");
    *team = (struct sadmm_team){.tasks = *tasks, .forks = atomic_load(&forks)};
    return SADMM_OK;
}

int sadmm_processors(void)
{
#ifdef _OPENMP
    return omp_get_num_procs();
#else
    return 1;
#endif
}

/* The most threads of OpenMP's by the environment's and the machine's word. */
static int openmp_threads(int wanted)
{
#ifdef _OPENMP
    return wanted > 0 ? omp_get_num_procs() : omp_get_max_threads();
#else
    (void)wanted;
    return 1;
#endif
}

int sadmm_team_threads(const struct sadmm_team *team, int wanted, size_t deserved)
{
    const bool tasks = team && team->tasks.enqueue;
    if (forced && wanted > 0) return tasks && team->tasks.threads < wanted ? team->tasks.threads : wanted;
    int threads = deserved < SADMM_MOST_THREADS ? (int)deserved : SADMM_MOST_THREADS;
    if (wanted > 0 && wanted < threads) threads = wanted;
    if (threads <= 1) return 1;
    int offered = tasks ? team->tasks.threads : openmp_threads(wanted);
    return offered < threads ? offered : threads;
}

/* ---- OpenMP ------------------------------------------------------------------------------------------------------ */

#ifdef _OPENMP

static void *pass_gate(void *gate)
{
    pthread_mutex_lock(gate);
    pthread_mutex_unlock(gate);
    return NULL;
}

/* The stack that OMP_STACKSIZE asks for, "8M" for example (kilobytes without a unit); 0: the system's. */
static size_t stack_size(void)
{
    static const char units[] = "BKMG";
    const char *text = getenv("OMP_STACKSIZE");
    char *end;
    if (!text) return 0;
    unsigned long long size = strtoull(text, &end, 10);
    while (*end == ' ') ++end;
    const char *unit = *end ? strchr(units, *end & ~0x20) : units + 1; /* in capitals */
    if (end == text || !unit || size > SIZE_MAX >> 30) return 0;
    return (size_t)size << 10 * (unit - units);
}

/* How many threads, up to `count`, this process can have besides those it has. */
static int try_threads(int count)
{
    pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER; /* all of them are there before the first one ends */
    pthread_t made[SADMM_MOST_THREADS];
    pthread_attr_t like_openmp;
    int n = 0;
    if (pthread_attr_init(&like_openmp) != 0) return 0;
    if (stack_size() > 0)
        pthread_attr_setstacksize(&like_openmp, stack_size()); /* too small a size is OpenMP's to refuse */
    pthread_mutex_lock(&gate);
    while (n < count && pthread_create(&made[n], &like_openmp, pass_gate, &gate) == 0) ++n;
    pthread_mutex_unlock(&gate);
    for (int i = 0; i < n; ++i) pthread_join(made[i], NULL);
    pthread_mutex_destroy(&gate);
    pthread_attr_destroy(&like_openmp);
    return n;
}

/* LLVM's workers allocate when they begin. What malloc sets aside for each of them (64 MB of addresses with glibc, and
 * for a moment twice that) is not there for the next, and the runtime ends the process where one cannot be made: how
 * many it can make in a process that is short of addresses cannot be foreseen. */
#ifdef __clang__
enum { RUNTIME_ENDS_PROCESS = true };
#else
enum { RUNTIME_ENDS_PROCESS = false };
#endif

/* Threads for a region that wants that many. */
static int allowed(int threads)
{
    /* OpenMP keeps a pool for every thread that begins regions. */
    static _Thread_local int tried = 1, most = SADMM_MOST_THREADS;
    if (atomic_load_explicit(&openmp_lost, memory_order_relaxed)) return 1;
    if (threads > most) threads = most;
    if (threads <= tried) return threads;
    if (!watch_forks()) return 1;
    atomic_store(&openmp_used, true);
    /* One more than it makes, for the runtime's own memory. Where the process has not enough for all, half of what it
     * has: the other half of its address space is for what the step works on. */
    int made = try_threads(threads);
    if (made < threads) most = threads = made < 2 || RUNTIME_ENDS_PROCESS ? 1 : made / 2;
    tried = threads;
    return threads;
}

static int run_openmp(int threads, sadmm_parallel_function *function, void *argument)
{
    int ran = 1;
    threads = allowed(threads);
    if (threads == 1) {
        function(argument, 0, 1);
        return 1;
    }
#pragma omp parallel num_threads(threads)
    {
        const int thread = omp_get_thread_num(), members = omp_get_num_threads();
        if (thread == 0) ran = members;
        function(argument, thread, members);
    }
    return ran;
}

#else

static int run_openmp(int threads, sadmm_parallel_function *function, void *argument)
{
    (void)threads;
    function(argument, 0, 1);
    return 1;
}

#endif

/* ---- tasks of the host ------------------------------------------------------------------------------------------- */

/* Members check in at a door. The caller waits a little for them and shuts it; from then on their number is known, and
 * whoever comes later goes home. So a region never waits for a task that has not begun. */
enum { SHUT = 1 << 16 };

struct region {
    sadmm_parallel_function *function;
    void *argument;
    atomic_int door; /* members; + SHUT */
};

/* This thread is handing out tasks. Should a pool run one right then, on this thread, it must not wait for a door: the
 * one it would wait for may be this thread's. */
static _Thread_local bool hands_out;

static void join_region(void *argument)
{
    struct region *region = argument;
    int door = atomic_load_explicit(&region->door, memory_order_relaxed);
    if (hands_out) return;
    do {
        if (door & SHUT) return;
    } while (!atomic_compare_exchange_weak_explicit(&region->door, &door, door + 1, memory_order_acq_rel,
                                                    memory_order_relaxed));
    const int thread = door;
    for (int spin = 0; !((door = atomic_load_explicit(&region->door, memory_order_acquire)) & SHUT); ++spin) {
        if (spin < SADMM_SPINS) sadmm_pause();
        else sched_yield();
    }
    region->function(region->argument, thread, door - SHUT);
}

static int run_tasks(const sadmm_tasks *tasks, int threads, sadmm_parallel_function *function, void *argument)
{
    struct region region = {.function = function, .argument = argument, .door = 1};
    void *names[SADMM_MOST_THREADS];
    const bool outer = hands_out;
    int count = 0;
    hands_out = true;
    for (int i = 1; i < threads; ++i) {
        names[count] = tasks->enqueue(tasks->user, join_region, &region);
        count += names[count] != NULL;
    }
    hands_out = outer;
    for (int spin = 0; spin < SADMM_SPINS && atomic_load_explicit(&region.door, memory_order_relaxed) <= count; ++spin)
        sadmm_pause();
    const int members = atomic_fetch_or_explicit(&region.door, SHUT, memory_order_acq_rel);
    function(argument, 0, members);
    for (int i = 0; i < count; ++i) tasks->wait(tasks->user, names[i]);
    return members;
}

/* ------------------------------------------------------------------------------------------------------------------ */

int sadmm_parallel(struct sadmm_team *team, int threads, sadmm_parallel_function *function, void *argument)
{
    int ran = 1;
    if (threads <= 1) function(argument, 0, 1);
    else if (!team || !team->tasks.enqueue) ran = run_openmp(threads, function, argument);
    else if (team->forks == atomic_load(&forks)) ran = run_tasks(&team->tasks, threads, function, argument);
    else function(argument, 0, 1);
    if (team && ran > team->ran) team->ran = ran;
    return ran;
}
