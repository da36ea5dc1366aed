#include "parallel.h"

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>

#include "wait.h"

static _Thread_local bool forced;

void sadmm_test_force_threads(bool force) { forced = force; }
bool sadmm_test_forces_threads(void) { return forced; }

/* ---- forks ------------------------------------------------------------------------------------------------------- */

static atomic_uint forks; /* between the process that began to watch and this one */

static void in_child(void) { atomic_fetch_add(&forks, 1); }

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

int sadmm_team_threads(const struct sadmm_team *team, int wanted, size_t deserved)
{
    const bool tasks = team && team->tasks.enqueue;
    if (forced && wanted > 0) return tasks && team->tasks.threads < wanted ? team->tasks.threads : wanted;
    int threads = deserved < SADMM_MOST_THREADS ? (int)deserved : SADMM_MOST_THREADS;
    if (wanted > 0 && wanted < threads) threads = wanted;
    if (threads <= 1) return 1;
    int offered = tasks ? team->tasks.threads : sadmm_workers_offered(wanted);
    return offered < threads ? offered : threads;
}

/* ---- regions ----------------------------------------------------------------------------------------------------- */

/* Members check in at a door. The caller waits a little for them and shuts it; from then on their number is known, and
 * whoever comes later goes home. So a region never waits for a task that has not begun. */
enum { SHUT = 1 << 16 };

struct region {
    sadmm_parallel_function *function;
    void *argument;
    bool open;              /* its members begin as they come */
    struct sadmm_word door; /* members; + SHUT */
};

/* This thread is handing out tasks. Should a pool run one right then, on this thread, it must not wait for a door: the
 * one it would wait for may be this thread's. */
static _Thread_local bool hands_out;

static void join_region(void *argument)
{
    struct region *region = argument;
    unsigned door = atomic_load_explicit(&region->door.value, memory_order_relaxed);
    if (hands_out) return;
    do {
        if (door & SHUT) return;
    } while (!atomic_compare_exchange_weak(&region->door.value, &door, door + 1));
    sadmm_word_wake(&region->door);
    const int thread = (int)door;
    while (!region->open && !(door & SHUT)) door = sadmm_word_wait(&region->door, door);
    if (region->open) door = SHUT; /* how many there are is not known */
    region->function(region->argument, thread, (int)(door - SHUT));
}

static int run_region(const sadmm_tasks *tasks, int threads, bool wait_for_all, bool open,
                      sadmm_parallel_function *function, void *argument)
{
    struct region region = {.function = function, .argument = argument, .open = open, .door = {.value = 1}};
    void *names[SADMM_MOST_THREADS];
    const bool outer = hands_out;
    unsigned count = 0, door = 1;
    hands_out = true;
    for (int i = 1; i < threads; ++i) {
        names[count] = tasks->enqueue(tasks->user, join_region, &region);
        count += names[count] != NULL;
    }
    hands_out = outer;
    while (wait_for_all && door <= count) door = sadmm_word_wait(&region.door, door);
    if (open) function(argument, 0, 0);
    for (int spin = 0; !open && spin < SADMM_SPINS && door <= count; ++spin) {
        sadmm_pause();
        door = atomic_load_explicit(&region.door.value, memory_order_relaxed);
    }
    const int members = (int)atomic_fetch_or(&region.door.value, SHUT);
    sadmm_word_wake(&region.door);
    if (!open) function(argument, 0, members);
    for (unsigned i = 0; i < count; ++i) tasks->wait(tasks->user, names[i]);
    return members;
}

static const sadmm_tasks own = {sadmm_worker_call, sadmm_worker_release, NULL, SADMM_MOST_THREADS};
static atomic_uint own_forks = UINT_MAX; /* `forks` when they were first used */

/* Are the threads of this team in this process? */
static bool are_here(const struct sadmm_team *team)
{
    if (!watch_forks()) return false;
    const unsigned now = atomic_load(&forks);
    unsigned never = UINT_MAX;
    if (team && team->tasks.enqueue) return team->forks == now;
    return atomic_compare_exchange_strong(&own_forks, &never, now) || never == now;
}

static int run(struct sadmm_team *team, int threads, bool open, sadmm_parallel_function *function, void *argument)
{
    const bool hosts = team && team->tasks.enqueue;
    int ran = 1;
    if (threads > 1 && are_here(team)) {
        if (!hosts) sadmm_workers_gather(threads - 1);
        ran = run_region(hosts ? &team->tasks : &own, threads, forced && !hosts, open, function, argument);
    } else {
        function(argument, 0, open ? 0 : 1);
    }
    if (team && ran > team->ran) team->ran = ran;
    return ran;
}

int sadmm_parallel(struct sadmm_team *team, int threads, sadmm_parallel_function *function, void *argument)
{
    return run(team, threads, false, function, argument);
}

int sadmm_parallel_open(struct sadmm_team *team, int threads, sadmm_parallel_function *function, void *argument)
{
    return run(team, threads, true, function, argument);
}
