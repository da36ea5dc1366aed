/* Allocation: growable arrays, 64-byte aligned, with failure injection for the tests. */
#ifndef SADMM_CORE_BASE_MEMORY_H
#define SADMM_CORE_BASE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* count x size bytes, 64-byte aligned, zeroed; NULL when out of memory or on overflow. count 0 gives a valid block. */
void *sadmm_alloc(size_t count, size_t size);
void sadmm_free(void *block);

/* Grow *array (elements of `size` bytes) to hold at least `needed`, keeping `used` elements and doubling
 * *capacity; false, with nothing changed, when memory runs out. */
bool sadmm_grow(void **array, size_t *capacity, size_t used, size_t needed, size_t size);

/* Tests: on this thread, let `successes` allocations pass and fail the following ones; negative: never fail. */
void sadmm_test_fail_allocations_after(long successes);
/* True if the next allocation of this thread is to fail; counts down. C++ code that allocates asks this first. */
bool sadmm_test_allocation_fails(void);

#ifdef __cplusplus
}
#endif
#endif
