/* A race: the barrier between the two loops is missing. The thread sanitizer must report it (the test is registered as
 * one that fails), or its silence about the library means nothing. Vectors, because some sanitizers overlook those. */
#include <omp.h>

enum { COUNT = 1000, THREADS = 4, ITERATIONS = 400 };

typedef double vector __attribute__((vector_size(64)));
static vector a[COUNT], b[COUNT];

int main(void)
{
#pragma omp parallel num_threads(THREADS)
    {
        int first = omp_get_thread_num(), stride = omp_get_num_threads();
        for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
            for (int i = first; i < COUNT; i += stride) a[i] = b[(i + 7) % COUNT] + iteration;
            for (int i = first; i < COUNT; i += stride) b[i] = a[(i + 13) % COUNT] / 2;
#pragma omp barrier
        }
    }
    return 0;
}
