/* What takes long is shorter under sanitizers (SADMM_TEST_SHORT). */
#ifndef SADMM_TESTS_FEWER_H
#define SADMM_TESTS_FEWER_H

#include <stdbool.h>
#include <stdlib.h>

/* How many of many: a quarter. */
static inline int fewer(int count) { return getenv("SADMM_TEST_SHORT") ? (count + 3) / 4 : count; }

/* Of the ways to run something (methods, precisions) every other one, the first or the second in turn. */
static inline bool is_its_turn(int subject, int way)
{
    return !getenv("SADMM_TEST_SHORT") || (subject + way) % 2 == 0;
}

/* Is this a run for the thread sanitizer? What takes long and works on one thread shows it nothing. */
static inline bool races_are_looked_for(void)
{
#ifdef __SANITIZE_THREAD__
    return true;
#else
    return false;
#endif
}

#endif
