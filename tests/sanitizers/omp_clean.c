/* Correct OpenMP in the forms the CPU backend uses. The thread sanitizer must be silent: it knows barriers, regions and
 * reductions of the OpenMP runtime only if that runtime tells it (presets/tsan.ini). */
#include <omp.h>

enum { COUNT = 1000, THREADS = 4, REPEATS = 20, ITERATIONS = 20 };

typedef double vector __attribute__((vector_size(64)));
static vector a[COUNT], b[COUNT];

int main(void)
{
    for (int repeat = 0; repeat < REPEATS; ++repeat) {
#pragma omp parallel num_threads(THREADS)
        {
            int first = omp_get_thread_num(), stride = omp_get_num_threads();
            for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
                for (int i = first; i < COUNT; i += stride) a[i] = b[(i + 7) % COUNT] + iteration;
#pragma omp barrier
                for (int i = first; i < COUNT; i += stride) b[i] = a[(i + 13) % COUNT] / 2;
#pragma omp barrier
            }
        }
#pragma omp parallel for num_threads(THREADS) schedule(dynamic, 16)
        for (int i = 0; i < COUNT; ++i) a[i] = b[COUNT - 1 - i];

        double largest = 0;
#pragma omp parallel for num_threads(THREADS) reduction(max : largest)
        for (int i = 0; i < COUNT; ++i) largest = a[i][0] > largest ? a[i][0] : largest;
        b[0][0] = largest;
    }
    return 0;
}
