/* A haptic loop: a thousand times a second it reads where the user's hand is, moves the target of a virtual coupling
 * there, makes a step and gives the user the reaction. At its end it prints how long steps took.
 *
 *     haptic_loop [SECONDS [ITERATIONS]]
 *
 * SECONDS in (0, 3600], 10; ITERATIONS of the solver in a step, in [1, 1000], 20: with fewer the reaction is rough.
 * The scene is `hand_demo`. The part of the user is played by its recorded motion, with a hand's tremor on it: a loop
 * with a device has another read_device() and send_force(). On a machine that others use as well, give the loop a core
 * and the right to it: `taskset -c 1 chrt -f 50 haptic_loop`. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <subadmm/scenes.h>
#include <subadmm/subadmm.h>

static const int64_t period = 1000000; /* ns */

struct loop {
    sadmm_scene *scene;
    sadmm_world *world;
    sadmm_coupling_id palm;
    int64_t script_steps;        /* steps of the scene's own length that its script has made */
    double script_dt, script_at; /* s: that length; when the script was last run */
    sadmm_coupling_def intended; /* the target by the script */
    double largest;              /* N, of what the user felt */
};

/* ---- the device -------------------------------------------------------------------------------------------------- */

/* Where the user's hand is at time t (s), and its velocity: the recorded motion, of which the script says every few
 * milliseconds where it is and how it goes on, and a tremor of 9 Hz and 0.2 mm. */
static sadmm_status read_device(struct loop *loop, double t, double position[3], double velocity[6])
{
    const double rate = 2 * 3.14159265358979 * 9, tremor = 2e-4; /* rad/s, m */
    sadmm_status status = SADMM_OK;
    if (t >= (double)loop->script_steps * loop->script_dt - 1e-9) {
        status = sadmm_scene_run_script(loop->scene, loop->world, loop->script_steps++);
        if (status == SADMM_OK) status = sadmm_world_coupling_def(loop->world, loop->palm, &loop->intended);
        loop->script_at = t;
    }
    memcpy(velocity, loop->intended.target_velocity, sizeof loop->intended.target_velocity);
    for (int k = 0; k < 3; ++k)
        position[k] = loop->intended.target_position[k] + velocity[k] * (t - loop->script_at);
    position[2] += tremor * sin(rate * t);
    velocity[2] += tremor * rate * cos(rate * t);
    return status;
}

static void send_force(struct loop *loop, const double force[3])
{
    loop->largest = fmax(loop->largest, hypot(hypot(force[0], force[1]), force[2]));
}

/* ---- the loop ---------------------------------------------------------------------------------------------------- */

static sadmm_status haptic_step(struct loop *loop, double t)
{
    double position[3], velocity[6];
    sadmm_coupling_state state;
    sadmm_status status = read_device(loop, t, position, velocity);
    if (status == SADMM_OK)
        status = sadmm_world_set_coupling_target(loop->world, loop->palm, position, loop->intended.target_orientation,
                                                 velocity);
    if (status == SADMM_OK) status = sadmm_world_step(loop->world);
    if (status == SADMM_OK) status = sadmm_world_coupling_state(loop->world, loop->palm, &state);
    if (status == SADMM_OK) send_force(loop, state.reaction_force);
    return status;
}

/* ns */
static int64_t read_clock(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* Until an absolute time, ns: unlike waits of a given length, these do not add up what the loop itself takes. */
static void sleep_until(int64_t when)
{
    const struct timespec t = {.tv_sec = (time_t)(when / 1000000000), .tv_nsec = (long)(when % 1000000000)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) != 0) {} /* a signal came */
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The smallest value that a share of all of them does not exceed. `sorted` is. */
static double quantile(const double *sorted, long count, double share)
{
    const long k = (long)ceil(share * (double)count) - 1;
    return sorted[k < 0 ? 0 : k];
}

static void print_times(const char *what, double *times, long count)
{
    qsort(times, (size_t)count, sizeof *times, compare);
    printf("%s: p50 %.3f ms, p99 %.3f ms, p99.9 %.3f ms, worst %.3f ms\n", what, quantile(times, count, 0.5),
           quantile(times, count, 0.99), quantile(times, count, 0.999), times[count - 1]);
}

/* ms, of each step: how long it took, for how much of that it had the core, how late it began. */
struct times {
    double *took, *worked, *woke;
};

static sadmm_status run(struct loop *loop, long count, const struct times *times)
{
    long missed = 0;
    int64_t due = read_clock(CLOCK_MONOTONIC) + period;
    for (long step = 0; step < count; ++step) {
        sleep_until(due);
        const int64_t begun = read_clock(CLOCK_MONOTONIC), worked = read_clock(CLOCK_THREAD_CPUTIME_ID);
        const sadmm_status status = haptic_step(loop, 1e-9 * (double)(step * period));
        if (status != SADMM_OK) return status;
        const int64_t ended = read_clock(CLOCK_MONOTONIC);
        times->took[step] = 1e-6 * (double)(ended - begun);
        times->worked[step] = 1e-6 * (double)(read_clock(CLOCK_THREAD_CPUTIME_ID) - worked);
        times->woke[step] = 1e-6 * (double)(begun - due);
        due += period;
        if (ended > due) { /* time that was lost is not made up for: the world's motion would jump */
            ++missed;
            due = ended;
        }
    }
    sadmm_step_report report;
    const sadmm_status status = sadmm_world_report(loop->world, &report);
    if (status != SADMM_OK) return status;
    printf("%ld steps of 1 ms on %d thread, %d contacts, %d iterations, largest reaction %.1f N\n", count,
           report.threads, report.contacts, report.iterations, loop->largest);
    print_times("step", times->took, count);
    print_times("of which at work", times->worked, count);
    print_times("begun late by", times->woke, count);
    printf("%ld steps (%.2f %%) missed their deadline\n", missed, 100.0 * (double)missed / (double)count);
    return SADMM_OK;
}

static sadmm_status begin(struct loop *loop, int iterations)
{
    sadmm_world_def def;
    sadmm_status status = sadmm_scene_create("hand_demo", &loop->scene);
    if (status == SADMM_OK) status = sadmm_scene_world_def(loop->scene, &def);
    if (status != SADMM_OK) return status;
    loop->script_dt = def.settings.dt;
    def.backend = SADMM_BACKEND_CPU;
    def.precision = SADMM_F32; /* what a hand feels needs no more, and steps take less */
    def.settings.dt = 1e-9 * (double)period;
    def.settings.threads = 1;
    def.settings.tolerance = 0;             /* all iterations in every step: times that can be relied on */
    def.settings.iterations = iterations;
    def.settings.recover_wrenches = false;  /* nobody reads those of single bodies */
    status = sadmm_scene_create_world(loop->scene, &def, &loop->world);
    if (status == SADMM_OK) status = sadmm_world_coupling_at(loop->world, 0, &loop->palm);
    return status;
}

int main(int argc, char **argv)
{
    const double seconds = argc > 1 ? strtod(argv[1], NULL) : 10;
    const long iterations = argc > 2 ? strtol(argv[2], NULL, 10) : 20;
    if (argc > 3 || !(seconds > 0 && seconds <= 3600) || iterations < 1 || iterations > 1000) {
        fprintf(stderr, "usage: haptic_loop [SECONDS [ITERATIONS]], SECONDS in (0, 3600], ITERATIONS in [1, 1000]\n");
        return 2;
    }
    const long count = (long)ceil(1e9 * seconds / (double)period);
    double *room = calloc((size_t)(3 * count), sizeof *room); /* now: the loop itself asks for no memory */
    const struct times times = {room, room + count, room + 2 * count};
    if (room == NULL) {
        fprintf(stderr, "out of memory\n");
        return 1;
    }
    struct loop loop = {0};
    sadmm_status status = begin(&loop, (int)iterations);
    if (status == SADMM_OK) status = run(&loop, count, &times);
    if (status != SADMM_OK) fprintf(stderr, "%s\n", sadmm_last_message());
    sadmm_world_destroy(loop.world);
    sadmm_scene_destroy(loop.scene);
    free(room);
    return status == SADMM_OK ? 0 : 1;
}
