/* How many of many: a quarter under sanitizers. */
#ifndef SADMM_TESTS_FEWER_H
#define SADMM_TESTS_FEWER_H

#include <stdlib.h>

static inline int fewer(int count) { return getenv("SADMM_TEST_SHORT") ? (count + 3) / 4 : count; }

#endif
