/* A piece of work in a process of its own: one that crashes, hangs or uses all memory takes nothing else with it. */
#ifndef BENCH_CHILD_H
#define BENCH_CHILD_H

#include <stddef.h>

enum child_end {
    CHILD_DONE,        /* the whole result has come */
    CHILD_LATE,        /* it was ended after `seconds` of processor time, or many more of waiting */
    CHILD_LOST,        /* it ended without the whole result */
    CHILD_INTERRUPTED, /* SIGINT or SIGTERM came: it was ended */
    CHILD_IMPOSSIBLE   /* no process could be made */
};

/* Runs `work` in a child, which writes `size` bytes to `out` and returns (or becomes another program that does). What
 * it prints is lost. Not while threads of this process hold locks. */
enum child_end child_run(void (*work)(void *argument, int out), void *argument, double seconds, void *result,
                         size_t size);

/* All of them; a write that fails ends the process: for children. */
void child_write(int out, const void *data, size_t size);

#endif
