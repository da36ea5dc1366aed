/* Threads: how many work, whose they are, and that the library gets along with what happens to the process: forks,
 * limits, unloading. That results do not depend on their number is also in test_fast, test_reduced_form, test_collision
 * and test_scenes, kernel by kernel and scene by scene. */
#define _GNU_SOURCE /* sched_getaffinity */
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "core/base/barrier.h"
#include "core/base/parallel.h"
#include "core/base/processors.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "task_pool.h"

static sadmm_world *open_world(const char *spec, int threads, const struct pool *pool)
{
    struct sadmm_scene scene = open_scene(spec);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.settings.threads = threads;
    if (pool) scene.def.tasks = pool_tasks((struct pool *)pool, threads > 0 ? threads : 1);
    return build_scene(&scene);
}

static uint64_t hash_of(const char *spec, int threads, const struct pool *pool, int steps)
{
    sadmm_world *world = open_world(spec, threads, pool);
    step_world(world, steps);
    uint64_t hash = state_hash(world);
    sadmm_world_destroy(world);
    return hash;
}

static int threads_of(const char *spec, int threads)
{
    sadmm_world *world = open_world(spec, threads, NULL);
    step_world(world, 2); /* the first one does not know yet how many contacts there will be */
    int ran = world_report(world).threads;
    sadmm_world_destroy(world);
    return ran;
}

/* ---- regions ----------------------------------------------------------------------------------------------------- */

enum { ITEMS = 1000 };
struct rounds {
    struct sadmm_barrier barrier;
    int values[2][ITEMS];
    atomic_int calls[SADMM_MOST_THREADS], members;
};

/* Every round moves values by one place, so that each member reads what its neighbour wrote the round before. */
static void go_round(void *argument, int thread, int threads)
{
    struct rounds *r = (struct rounds *)argument;
    size_t begin, end;
    sadmm_share(ITEMS, thread, threads, &begin, &end);
    for (int round = 0; round < 20; ++round) {
        for (size_t i = begin; i < end; ++i) r->values[(round + 1) % 2][i] = r->values[round % 2][(i + 1) % ITEMS];
        sadmm_barrier_wait(&r->barrier, threads);
    }
    atomic_fetch_add(&r->calls[thread], 1);
    atomic_store(&r->members, threads);
}

static int expect_region(struct sadmm_team *team, int threads)
{
    static struct rounds r;
    memset(&r, 0, sizeof r);
    for (int i = 0; i < ITEMS; ++i) r.values[0][i] = i;
    int ran = sadmm_parallel(team, threads, go_round, &r);
    ck_assert_int_ge(ran, 1);
    ck_assert_int_le(ran, threads);
    ck_assert_int_eq(atomic_load(&r.members), ran);
    for (int t = 0; t < threads; ++t) ck_assert_int_eq(atomic_load(&r.calls[t]), t < ran);
    for (int i = 0; i < ITEMS; ++i) ck_assert_int_eq(r.values[0][i], (i + 20) % ITEMS);
    return ran;
}

START_TEST(the_library_gives_what_is_forced)
{
    struct sadmm_team team = {.ran = 0};
    sadmm_test_force_threads(true);
    for (int threads = 1; threads <= 9; threads += 2) {
        expect_region(&team, threads);
        ck_assert_int_eq(team.ran, threads);
    }
    ck_assert_int_eq(expect_region(NULL, 4), 4);
    ck_assert_int_eq(team.ran, 9);
}
END_TEST

/* Otherwise it does not wait for threads that come late. That they come at all is asked for. */
START_TEST(the_library_gives_what_it_can)
{
    struct sadmm_team team = {.ran = 0};
    for (int i = 0; i < 50; ++i) expect_region(&team, 1 + i % 9);
    while (team.ran < 3) expect_region(&team, 3);
}
END_TEST

/* The workers are shared by all threads of the program, which ask for more and more of them. */
static void *regions_of_a_thread(void *argument)
{
    static _Thread_local struct rounds r;
    (void)argument;
    for (int i = 0; i < 2000; ++i) {
        memset(&r.calls, 0, sizeof r.calls);
        sadmm_test_force_threads(i % 2 == 1);
        const int threads = 2 + i / 500;
        const int ran = sadmm_parallel(NULL, threads, go_round, &r);
        for (int t = 0; t < threads; ++t) ck_assert_int_eq(atomic_load(&r.calls[t]), t < ran);
    }
    return NULL;
}

START_TEST(threads_share_the_workers)
{
    pthread_t others[3];
    for (int i = 0; i < 3; ++i) ck_assert_int_eq(pthread_create(&others[i], NULL, regions_of_a_thread, NULL), 0);
    for (int i = 0; i < 3; ++i) pthread_join(others[i], NULL);
}
END_TEST

static void sleep_as_second(void *argument, int thread, int threads)
{
    struct rounds *r = (struct rounds *)argument;
    if (thread == threads - 1) nanosleep(&(struct timespec){.tv_nsec = 200000000}, NULL);
    sadmm_barrier_wait(&r->barrier, threads);
}

static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* A member that waits for another one takes no processor meanwhile: here a fifth of a second, by three. */
START_TEST(members_that_wait_sleep)
{
    static struct rounds r;
    sadmm_test_force_threads(true);
    sadmm_parallel(NULL, 4, sleep_as_second, &r);
    const double before = cpu_seconds();
    sadmm_parallel(NULL, 4, sleep_as_second, &r);
    ck_assert_double_lt(cpu_seconds() - before, 0.1);
}
END_TEST

START_TEST(a_pool_gives_what_it_can)
{
    struct pool pool;
    struct sadmm_team team;
    pool_start(&pool, (enum pool_kind)_i, 3);
    sadmm_tasks tasks = pool_tasks(&pool, 4);
    ck_assert_int_eq(sadmm_team_init(&team, &tasks, "tasks", NULL), SADMM_OK);
    for (int i = 0; i < 50; ++i) expect_region(&team, 1 + i % 5);
    ck_assert_int_gt(pool.enqueued, 0);
    /* None of these has a thread that could come in time. */
    if (_i == POOL_INLINE || _i == POOL_QUIET || _i == POOL_REFUSING || _i == POOL_LAZY) ck_assert_int_eq(team.ran, 1);
    /* How soon threads come is the machine's to say; that they come at all is asked for. */
    for (int i = 0; _i == POOL_PROMPT && team.ran < 4; ++i) expect_region(&team, 4);
    pool_stop(&pool);
}
END_TEST

/* Two threads whose pool runs the other one's tasks while they hand out theirs: neither may wait for the other then. */
static void *many_regions(void *argument)
{
    static _Thread_local struct rounds r;
    struct sadmm_team team;
    ck_assert_int_eq(sadmm_team_init(&team, (const sadmm_tasks *)argument, "tasks", NULL), SADMM_OK);
    for (int i = 0; i < 2000; ++i) {
        memset(&r.calls, 0, sizeof r.calls);
        sadmm_parallel(&team, 4, go_round, &r);
    }
    return NULL;
}

START_TEST(handing_out_waits_for_nobody)
{
    struct pool pool;
    pthread_t other;
    pool_start(&pool, POOL_HELPFUL, 0);
    sadmm_tasks tasks = pool_tasks(&pool, 4);
    ck_assert_int_eq(pthread_create(&other, NULL, many_regions, &tasks), 0);
    many_regions(&tasks);
    pthread_join(other, NULL);
    pool_stop(&pool);
}
END_TEST

/* ---- how many ---------------------------------------------------------------------------------------------------- */

/* 500 contacts are no work for two; 9,000 are some for six. */
START_TEST(threads_are_an_upper_bound)
{
    int processors = sadmm_processors();
    ck_assert_int_ge(processors, 1);
    ck_assert_int_eq(threads_of("sliding_cubes:100", 64), 1);
    ck_assert_int_eq(threads_of("sliding_cubes:1000", 1), 1);
    ck_assert_int_le(threads_of("sliding_cubes:1000", 2), processors < 2 ? 1 : 2);
    ck_assert_int_le(threads_of("sliding_cubes:1000", 64), processors);
    sadmm_test_force_threads(true);
    ck_assert_int_eq(threads_of("sliding_cubes:100", 5), 5);
    sadmm_test_force_threads(false);
}
END_TEST

#ifdef _OPENMP

/* ---- OpenMP ------------------------------------------------------------------------------------------------------ */

struct seen {
    atomic_int levels[8], teams[8], processors[8];
};

static void look_around(void *argument, int thread, int threads)
{
    struct seen *seen = (struct seen *)argument;
    cpu_set_t allowed;
    (void)threads;
    atomic_store(&seen->levels[thread], omp_get_active_level());
    atomic_store(&seen->teams[thread], omp_get_num_threads());
    if (sched_getaffinity(0, sizeof allowed, &allowed) == 0)
        atomic_store(&seen->processors[thread], CPU_COUNT(&allowed));
}

START_TEST(workers_are_openmp_s)
{
    static struct seen seen;
    sadmm_test_force_threads(true);
    ck_assert_int_eq(sadmm_parallel(NULL, 4, look_around, &seen), 4);
    for (int t = 0; t < 4; ++t) {
        ck_assert_int_eq(atomic_load(&seen.levels[t]), t > 0);
        ck_assert_int_eq(atomic_load(&seen.teams[t]), t > 0 ? 4 : 1);
    }
}
END_TEST

/* What this program does when it is started with a question: its exit status is the answer. */
static int answer(const char *question, int threads)
{
    static struct seen seen;
    if (strcmp(question, "threads") == 0) return sadmm_team_threads(NULL, threads, 100);
    sadmm_test_force_threads(true);
    const int ran = sadmm_parallel(NULL, threads, look_around, &seen);
    return strcmp(question, "members") == 0 ? ran : atomic_load(&seen.processors[ran - 1]);
}

enum { ALL = -1, FREE = -2 }; /* processors that this process may use, without and with those that a quota forbids */
static const struct {
    const char *environment, *question, *threads;
    int answer;
} questions[] = {
    {"OMP_NUM_THREADS=1", "threads", "0", 1},
    {"OMP_NUM_THREADS=100", "threads", "0", ALL},
    {"OMP_NUM_THREADS=1", "threads", "100", ALL}, /* settings.threads is given */
    {"OMP_PROC_BIND=true", "threads", "0", ALL},  /* the thread that asks is bound to one */
    {"OMP_NUM_THREADS=2", "members", "4", 4},
    {"OMP_THREAD_LIMIT=3", "members", "4", 3},
    {"OMP_DYNAMIC=false", "processors of a worker", "2", FREE},
    {"OMP_PROC_BIND=true OMP_PLACES=threads", "processors of a worker", "2", 1},
};

START_TEST(the_environment_sets_openmp)
{
    char environment[64];
    int status, expected = questions[_i].answer;
    if (expected == ALL) expected = sadmm_processors();
    if (expected == FREE) expected = omp_get_num_procs();
    strcpy(environment, questions[_i].environment);
    const pid_t child = fork();
    ck_assert_int_ge(child, 0);
    if (child == 0) {
        for (char *name = strtok(environment, " "); name; name = strtok(NULL, " ")) putenv(name);
        execl("/proc/self/exe", "test_threads", questions[_i].question, questions[_i].threads, (char *)NULL);
        _exit(255);
    }
    ck_assert_int_eq(waitpid(child, &status, 0), child);
    ck_assert(WIFEXITED(status));
    ck_assert_int_eq(WEXITSTATUS(status), expected & 255); /* as much as an exit status has */
}
END_TEST

static const char *const nested_spec = "vertical_stacks:4";
static atomic_ullong nested_hashes[2];
static atomic_int nested_threads[2];

/* Threads of a region of the program's own step worlds on one thread each, unless regions may nest. */
START_TEST(regions_of_the_program_step_worlds)
{
    const uint64_t expected = hash_of(nested_spec, 1, NULL, 20);
    for (int levels = 1; levels <= 2; ++levels) {
        omp_set_max_active_levels(levels);
#pragma omp parallel num_threads(2)
        {
            const int t = omp_get_thread_num();
            atomic_store(&nested_threads[t], sadmm_team_threads(NULL, 2, 100));
            sadmm_test_force_threads(true);
            atomic_store(&nested_hashes[t], hash_of(nested_spec, 3, NULL, 20));
            sadmm_test_force_threads(false);
        }
        for (int t = 0; t < 2; ++t) {
            ck_assert_int_eq(atomic_load(&nested_threads[t]), levels == 2 && sadmm_processors() > 1 ? 2 : 1);
            ck_assert(atomic_load(&nested_hashes[t]) == expected);
        }
    }
}
END_TEST

#endif

static void put_file(const char *folder, const char *name, const char *text)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    for (char *slash = path + strlen(folder) + 1; (slash = strchr(slash, '/')); ++slash) {
        *slash = 0;
        ck_assert(mkdir(path, 0700) == 0 || errno == EEXIST);
        *slash = '/';
    }
    FILE *file = fopen(path, "w");
    ck_assert_ptr_nonnull(file);
    ck_assert_int_ge(fputs(text, file), 0);
    fclose(file);
}

/* What the kernel's files say, of versions 1 and 2, and how many processors that is. */
static const struct {
    const char *groups, *files[6]; /* name, text, ...; the folder is the root of the groups */
    int quota;
} quotas[] = {
    {"0::/\n", {"cpu.max", "200000 100000\n"}, 2},
    {"0::/\n", {"cpu.max", "max 100000\n"}, 0},
    {"0::/\n", {NULL}, 0},
    {"0::/\n", {"cpu.max", "250000 100000\n"}, 2},
    {"0::/\n", {"cpu.max", "20000 100000\n"}, 1},
    {"0::/\n", {"cpu.max", "nonsense\n"}, 0},
    {"0::/\n", {"cpu.max", "100000 0\n"}, 0},
    {"0::/\n", {"cpu.max", "9000000000000000000 1\n"}, 1000000},
    {"0::/a/b\n", {"a/b/cpu.max", "max 100000\n", "a/cpu.max", "300000 100000\n"}, 3},
    {"0::/a/b\n", {"a/b/cpu.max", "400000 100000\n", "a/cpu.max", "300000 100000\n"}, 3},
    {"0::/seen/from/outside\n", {"cpu.max", "500000 100000\n"}, 5},
    {"3:cpu,cpuacct:/\n", {"cpu/cpu.cfs_quota_us", "150000\n", "cpu/cpu.cfs_period_us", "50000\n"}, 3},
    {"3:cpuacct,cpu:/x\n", {"cpu/x/cpu.cfs_quota_us", "400000\n", "cpu/x/cpu.cfs_period_us", "100000\n"}, 4},
    {"3:cpu:/\n", {"cpu/cpu.cfs_quota_us", "-1\n", "cpu/cpu.cfs_period_us", "100000\n"}, 0},
    {"3:cpuset:/\n", {"cpu/cpu.cfs_quota_us", "100000\n", "cpu/cpu.cfs_period_us", "100000\n"}, 0},
    {"no groups\n", {"cpu.max", "100000 100000\n"}, 0},
};

START_TEST(the_quota_of_a_container_bounds_them)
{
    char folder[] = "/tmp/subadmm_groups_XXXXXX", groups[64], command[64];
    ck_assert_ptr_nonnull(mkdtemp(folder));
    put_file(folder, "groups", quotas[_i].groups);
    for (int k = 0; k < 6 && quotas[_i].files[k]; k += 2)
        put_file(folder, quotas[_i].files[k], quotas[_i].files[k + 1]);
    snprintf(groups, sizeof groups, "%s/groups", folder);
    const int quota = sadmm_processor_quota(groups, folder);
    snprintf(command, sizeof command, "rm -r %s", folder);
    ck_assert_int_eq(system(command), 0);
    ck_assert_int_eq(quota, quotas[_i].quota);
    ck_assert_int_eq(sadmm_processor_quota(groups, folder), 0); /* there are no such files */
}
END_TEST

START_TEST(a_pool_bounds_them_too)
{
    struct pool pool;
    pool_start(&pool, POOL_PLAIN, 2);
    const sadmm_tasks tasks = pool_tasks(&pool, 3);
    struct sadmm_team team;
    ck_assert_int_eq(sadmm_team_init(&team, &tasks, "tasks", NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_team_threads(&team, 0, 100), 3);
    ck_assert_int_eq(sadmm_team_threads(&team, 2, 100), 2);
    ck_assert_int_eq(sadmm_team_threads(&team, 8, 100), 3);
    ck_assert_int_eq(sadmm_team_threads(&team, 8, 2), 2);
    ck_assert_int_eq(sadmm_team_threads(&team, 0, SIZE_MAX), 3);
    sadmm_test_force_threads(true);
    ck_assert_int_eq(sadmm_team_threads(&team, 8, 1), 3);
    sadmm_test_force_threads(false);
    pool_stop(&pool);
}
END_TEST

/* ---- tasks of the host ------------------------------------------------------------------------------------------- */

START_TEST(any_pool_gives_the_same_bits)
{
    static const char *const specs[] = {"vertical_stacks:4", "pile:40"};
    struct pool pool;
    sadmm_test_force_threads(true);
    pool_start(&pool, (enum pool_kind)(_i % POOL_KINDS), 2);
    const char *spec = specs[_i / POOL_KINDS];
    ck_assert(hash_of(spec, 3, &pool, 40) == hash_of(spec, 1, NULL, 40));
    ck_assert_int_gt(pool.enqueued, 0);
    pool_stop(&pool);
}
END_TEST

START_TEST(the_report_counts_tasks_that_came)
{
    struct pool pool;
    sadmm_test_force_threads(true);
    pool_start(&pool, POOL_PROMPT, 2);
    sadmm_world *world = open_world("vertical_stacks:4", 3, &pool);
    do {
        step_world(world, 1);
        ck_assert_int_le(world_report(world).threads, 3);
    } while (world_report(world).threads < 3); /* that it happens is up to the machine: the test's time limit */
    sadmm_world_destroy(world);
    pool_stop(&pool);
    pool_start(&pool, POOL_LAZY, 2);
    world = open_world("vertical_stacks:4", 3, &pool);
    step_world(world, 3);
    ck_assert_int_eq(world_report(world).threads, 1);
    sadmm_world_destroy(world);
    pool_stop(&pool);
}
END_TEST

struct stepping {
    struct pool *pool;
    uint64_t hash;
};

static void step_in_task(void *argument)
{
    struct stepping *s = (struct stepping *)argument;
    sadmm_test_force_threads(true);
    s->hash = hash_of("vertical_stacks:4", 3, s->pool, 20);
}

/* Every thread of the pool is in a step that hands tasks to the same pool. */
START_TEST(tasks_may_step_worlds)
{
    enum { WORLDS = 8 };
    struct pool pool;
    struct stepping steps[WORLDS];
    void *names[WORLDS];
    pool_start(&pool, POOL_PLAIN, 3);
    for (int i = 0; i < WORLDS; ++i) {
        steps[i] = (struct stepping){&pool, 0};
        names[i] = pool_enqueue(&pool, step_in_task, &steps[i]);
    }
    for (int i = 0; i < WORLDS; ++i) pool_wait(&pool, names[i]);
    pool_stop(&pool);
    for (int i = 0; i < WORLDS; ++i) ck_assert(steps[i].hash == hash_of("vertical_stacks:4", 1, NULL, 20));
}
END_TEST

/* A problem: the same solution, and callbacks that are taken back. */
START_TEST(problems_take_tasks)
{
    struct pool pool;
    sadmm_problem *problem;
    sadmm_settings settings = fixed_settings();
    sadmm_world *world = open_world("pile:40", 1, NULL);
    step_world(world, 100);
    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    pool_start(&pool, POOL_PROMPT, 2);
    const sadmm_tasks tasks = pool_tasks(&pool, 3);
    double *velocities[3];
    settings.threads = 3;
    sadmm_test_force_threads(true);
    for (int run = 0; run < 3; ++run) {
        sadmm_solve_report report;
        ck_assert_int_eq(sadmm_world_freeze(world, problem), SADMM_OK);
        ck_assert_int_gt(sadmm_problem_contact_count(problem), 0);
        ck_assert_int_eq(sadmm_problem_set_tasks(problem, run == 1 ? &tasks : NULL), SADMM_OK);
        ck_assert_int_eq(sadmm_problem_solve(problem, SADMM_BACKEND_CPU, SADMM_F64, &settings, &report), SADMM_OK);
        if (run != 1) ck_assert_int_eq(report.threads, 3);
        velocities[run] = malloc(6 * (size_t)sadmm_problem_body_count(problem) * sizeof(double));
        ck_assert_int_eq(sadmm_problem_get_solution(problem, velocities[run], NULL, NULL), SADMM_OK);
        ck_assert((pool.enqueued > 0) == (run > 0));
        if (run == 1) pool_stop(&pool); /* whoever calls it later hangs, or worse */
    }
    for (int run = 1; run < 3; ++run)
        ck_assert_mem_eq(velocities[0], velocities[run],
                         6 * (size_t)sadmm_problem_body_count(problem) * sizeof(double));
    for (int run = 0; run < 3; ++run) free(velocities[run]);
    sadmm_problem_destroy(problem);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(bad_callbacks_are_refused)
{
    struct pool pool;
    const sadmm_tasks bad[] = {{pool_enqueue, NULL, &pool, 2},
                               {NULL, pool_wait, &pool, 2},
                               {pool_enqueue, pool_wait, &pool, 0},
                               {pool_enqueue, pool_wait, &pool, 1025}};
    static const char *const messages[] = {"wait = NULL: must be given with", "enqueue = NULL: must be given with",
                                           "threads = 0: must be in [1, 1024]", "threads = 1025: must be in [1, 1024]"};
    sadmm_problem *problem;
    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
        sadmm_world_def def = fixed_world_def();
        sadmm_world *world;
        def.tasks = bad[k];
        ck_assert_int_eq(sadmm_world_create(&def, &world), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_msg(strstr(sadmm_last_message(), messages[k]) && strstr(sadmm_last_message(), "def->tasks."), "%s",
                      sadmm_last_message());
        ck_assert_int_eq(sadmm_problem_set_tasks(problem, &bad[k]), SADMM_ERROR_INVALID_ARGUMENT);
        ck_assert_msg(strstr(sadmm_problem_message(problem), messages[k]), "%s", sadmm_problem_message(problem));
    }
    ck_assert_int_eq(sadmm_problem_set_tasks(NULL, NULL), SADMM_ERROR_INVALID_ARGUMENT);
    sadmm_problem_destroy(problem);
}
END_TEST

/* ---- what happens to a process ----------------------------------------------------------------------------------- */

/* A child's exit status. */
static int status_of(pid_t child)
{
    int status;
    ck_assert_int_eq(waitpid(child, &status, 0), child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/* 0: twenty steps on a single thread, to the state that was expected, without a word to the pool. */
static int child_steps(sadmm_world *world, const struct pool *pool, uint64_t expected)
{
    const int enqueued = pool->enqueued;
    alarm(60); /* instead of a hang */
    for (int i = 0; i < 20; ++i)
        if (sadmm_world_step(world) != SADMM_OK) return 1;
    if (state_hash(world) != expected) return 2;
    return world_report(world).threads == 1 && pool->enqueued == enqueued ? 0 : 3;
}

/* OpenMP's threads stay with the parent; so do those of a pool. */
START_TEST(a_forked_child_goes_on_alone)
{
    struct pool pool = {.enqueued = 0};
    const char *spec = "vertical_stacks:4";
    const uint64_t expected = hash_of(spec, 1, NULL, 25);
    sadmm_test_force_threads(true);
    if (_i) pool_start(&pool, POOL_PLAIN, 2);
    sadmm_world *world = open_world(spec, 3, _i ? &pool : NULL);
    step_world(world, 5);
    pid_t child = fork();
    ck_assert_int_ge(child, 0);
    if (child == 0) _exit(child_steps(world, &pool, expected));
    ck_assert_int_eq(status_of(child), 0);
    step_world(world, 20);
    ck_assert(state_hash(world) == expected);
    ck_assert(_i || world_report(world).threads == 3);
    sadmm_world_destroy(world);
    if (_i) pool_stop(&pool);
}
END_TEST

static int child_takes_new_pool(uint64_t expected)
{
    struct pool pool;
    alarm(60);
    pool_start(&pool, POOL_PLAIN, 2);
    const bool same = hash_of("vertical_stacks:4", 3, &pool, 5) == expected;
    pool_stop(&pool);
    return same && pool.enqueued > 0 ? 0 : 1;
}

/* A pool that the child made itself is as good as any. Sanitizers allow no threads after a fork with threads: the
 * parent has none here. */
START_TEST(a_forked_child_may_have_a_pool)
{
    const uint64_t expected = hash_of("vertical_stacks:4", 1, NULL, 5);
    sadmm_test_force_threads(true);
    pid_t child = fork();
    ck_assert_int_ge(child, 0);
    if (child == 0) _exit(child_takes_new_pool(expected));
    ck_assert_int_eq(status_of(child), 0);
}
END_TEST

/* The sanitizers' own memory does not fit under a limit. */
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

static int limited_steps(uint64_t expected)
{
    FILE *file = fopen("/proc/self/statm", "r");
    unsigned long pages;
    pthread_attr_t usual;
    size_t stack;
    if (!file || fscanf(file, "%lu", &pages) != 1) return 4;
    fclose(file);
    if (pthread_attr_init(&usual) != 0 || pthread_attr_getstacksize(&usual, &stack) != 0) return 4;
    rlim_t bytes = (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE) + 24 * (rlim_t)stack; /* 63 are asked for */
    const struct rlimit limit = {bytes, bytes};
    if (setrlimit(RLIMIT_AS, &limit) != 0) return 5;
    sadmm_test_force_threads(true);
    sadmm_world *world = open_world("vertical_stacks:4", 64, NULL);
    step_world(world, 20);
    if (state_hash(world) != expected) return 2;
    const int ran = world_report(world).threads;
#if defined(_OPENMP) && defined(__clang__)
    return ran == 1 ? 0 : 3; /* LLVM's threads: core/base/workers.c */
#else
    return ran > 1 && ran < 64 ? 0 : 3;
#endif
}

/* Threads that cannot be made are not waited for, and end nobody. */
START_TEST(a_limited_process_takes_fewer)
{
    const uint64_t expected = hash_of("vertical_stacks:4", 1, NULL, 20);
    pid_t child = fork();
    ck_assert_int_ge(child, 0);
    if (child == 0) _exit(limited_steps(expected));
    ck_assert_int_eq(status_of(child), 0);
}
END_TEST

#endif

/* Threads of a pool sleep in the library's code, or return to it: it stays where it is. */
START_TEST(the_library_stays_loaded)
{
    void *library = dlopen(SUBADMM_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    ck_assert_msg(library != NULL, "%s", dlerror());
    ck_assert_ptr_nonnull(dlsym(library, "sadmm_world_step"));
    ck_assert_int_eq(dlclose(library), 0);
    ck_assert_ptr_nonnull(dlopen(SUBADMM_LIBRARY, RTLD_NOW | RTLD_NOLOAD));
}
END_TEST

int main(int argc, char **argv)
{
#ifdef _OPENMP
    if (argc > 2) return answer(argv[1], atoi(argv[2]));
#else
    (void)argc, (void)argv;
#endif
    Suite *suite = suite_create("threads");
    TCase *cases = tcase_create("threads");
    suite_add_tcase(suite, cases);
    tcase_set_timeout(cases, 30);
    tcase_add_test(cases, the_library_gives_what_is_forced);
    tcase_add_test(cases, the_library_gives_what_it_can);
    tcase_add_test(cases, threads_share_the_workers);
    tcase_add_test(cases, members_that_wait_sleep);
    tcase_add_loop_test(cases, the_quota_of_a_container_bounds_them, 0, sizeof quotas / sizeof *quotas);
    tcase_add_loop_test(cases, a_pool_gives_what_it_can, 0, POOL_KINDS);
    tcase_add_test(cases, handing_out_waits_for_nobody);
    tcase_add_test(cases, threads_are_an_upper_bound);
#ifdef _OPENMP
    tcase_add_test(cases, workers_are_openmp_s);
    tcase_add_loop_test(cases, the_environment_sets_openmp, 0, sizeof questions / sizeof *questions);
    tcase_add_test(cases, regions_of_the_program_step_worlds);
#endif
    tcase_add_test(cases, a_pool_bounds_them_too);
    tcase_add_loop_test(cases, any_pool_gives_the_same_bits, 0, 2 * POOL_KINDS);
    tcase_add_test(cases, the_report_counts_tasks_that_came);
    tcase_add_test(cases, tasks_may_step_worlds);
    tcase_add_test(cases, problems_take_tasks);
    tcase_add_test(cases, bad_callbacks_are_refused);
    tcase_add_loop_test(cases, a_forked_child_goes_on_alone, 0, 2);
    tcase_add_test(cases, a_forked_child_may_have_a_pool);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    tcase_add_test(cases, a_limited_process_takes_fewer);
#endif
    tcase_add_test(cases, the_library_stays_loaded);
    return run_suite(suite);
}
