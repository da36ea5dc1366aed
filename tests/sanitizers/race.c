/* Members of a region that pass values to each other. With the argument `race` a barrier is missing, which the thread
 * sanitizer must report (the test is registered as one that fails), or its silence about the library means nothing.
 * Vectors, because some sanitizers overlook those. */
#include <stdbool.h>

#include "core/base/barrier.h"
#include "core/base/parallel.h"

enum { COUNT = 1000, THREADS = 4, REPEATS = 20, ITERATIONS = 20 };

typedef double vector __attribute__((vector_size(64)));
static vector a[COUNT], b[COUNT];
static struct sadmm_barrier barrier;
static bool race;

static void pass_on(void *argument, int thread, int threads)
{
    (void)argument;
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        for (int i = thread; i < COUNT; i += threads) a[i] = b[(i + 7) % COUNT] + iteration;
        if (!race) sadmm_barrier_wait(&barrier, threads);
        for (int i = thread; i < COUNT; i += threads) b[i] = a[(i + 13) % COUNT] / 2;
        sadmm_barrier_wait(&barrier, threads);
    }
}

int main(int argc, char **argv)
{
    (void)argv;
    race = argc > 1;
    sadmm_test_force_threads(true);
    for (int repeat = 0; repeat < REPEATS; ++repeat) {
        sadmm_parallel(NULL, THREADS, pass_on, NULL);
        b[0] = a[COUNT - 1];
    }
    return 0;
}
