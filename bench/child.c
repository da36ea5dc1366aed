#include "child.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/interrupt.h"
#include "core/base/clock.h"

/* How many times its processor time a process is waited for, on a machine that others use. */
static const double WAIT = 8;

void child_write(int out, const void *data, size_t size)
{
    for (const char *at = data; size > 0;) {
        const ssize_t done = write(out, at, size);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) _exit(1);
        at += done;
        size -= (size_t)done;
    }
}

/* What stands on standard output and standard error is for whoever reads the benchmark. */
static void say_nothing(void)
{
    const int nowhere = open("/dev/null", O_WRONLY);
    if (nowhere < 0) return;
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
    close(nowhere);
}

/* SIGPROF ends the process, whatever program it becomes. */
static void limit_time(double seconds)
{
    const struct itimerval limit = {.it_value = {(time_t)seconds, (suseconds_t)(1e6 * (seconds - floor(seconds))) + 1}};
    signal(SIGPROF, SIG_DFL);
    setitimer(ITIMER_PROF, &limit, NULL);
}

static enum child_end receive(int in, double seconds, char *result, size_t size)
{
    const double end = sadmm_clock_ms() + 1e3 * seconds;
    while (size > 0) {
        const double left = end - sadmm_clock_ms();
        struct pollfd wait = {.fd = in, .events = POLLIN};
        if (interrupted()) return CHILD_INTERRUPTED;
        if (left <= 0) return CHILD_LATE;
        const int ready = poll(&wait, 1, left < 1e6 ? (int)left + 1 : 1000000);
        if (ready < 0 && errno != EINTR) return CHILD_LOST;
        if (ready <= 0) continue;
        const ssize_t got = read(in, result, size);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return CHILD_LOST;
        result += got;
        size -= (size_t)got;
    }
    return CHILD_DONE;
}

enum child_end child_run(void (*work)(void *argument, int out), void *argument, double seconds, void *result,
                         size_t size)
{
    int ends[2], status = 0;
    if (pipe(ends) != 0) return CHILD_IMPOSSIBLE;
    const pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        say_nothing();
        limit_time(seconds);
        work(argument, ends[1]);
        _exit(0);
    }
    close(ends[1]);
    if (child < 0) {
        close(ends[0]);
        return CHILD_IMPOSSIBLE;
    }
    const enum child_end end = receive(ends[0], 1 + WAIT * seconds, result, size);
    close(ends[0]);
    if (end == CHILD_LATE || end == CHILD_INTERRUPTED) kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {}
    return end == CHILD_LOST && WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF ? CHILD_LATE : end;
}
