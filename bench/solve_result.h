/* What a process that solves a problem (profile_solvers.h) writes ahead of the solution, and its clock. */
#ifndef BENCH_SOLVE_RESULT_H
#define BENCH_SOLVE_RESULT_H

#include <stdbool.h>
#include <stdint.h>
#include <time.h>

struct solve_head {
    double seconds;
    int32_t iterations, unsolved; /* unsolved: the solver's own stop rule is not met */
};

/* Wall time, and processor time of all threads, s. */
struct solve_clock {
    double wall, processor;
};

static inline double solve_clock_read(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline struct solve_clock solve_clock_now(void)
{
    const struct solve_clock now = {solve_clock_read(CLOCK_MONOTONIC), solve_clock_read(CLOCK_PROCESS_CPUTIME_ID)};
    return now;
}

/* Since `begin`, s. Of what takes long enough for the clock of a processor, which may tick a hundred times a second,
 * the time that it ran: a machine that others use made it wait. */
static inline double solve_clock_since(struct solve_clock begin)
{
    const struct solve_clock now = solve_clock_now();
    const double wall = now.wall - begin.wall, processor = now.processor - begin.processor;
    return processor > 0.3 && processor < wall ? processor : wall;
}

enum { SOLVE_MOST_REPEATS = 15 };

/* Is there time, s, for a solve besides the first one? */
static inline bool solve_again(int done, struct solve_clock begin, double best, double time)
{
    return done == 0 || (done < SOLVE_MOST_REPEATS && solve_clock_since(begin) + best < time);
}

#endif
