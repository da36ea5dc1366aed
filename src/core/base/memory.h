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

/* What a capacity that is less than `needed` grows to, whatever the memory: half as much again, so that a size that
 * creeps up asks for memory seldom; at least `needed` and `least`. */
static inline size_t sadmm_grown_capacity(size_t capacity, size_t needed, size_t least)
{
    const size_t grown = capacity + capacity / 2, wanted = grown > needed ? grown : needed;
    return wanted > least ? wanted : least;
}

/* Grow *array (`array`: the address of a pointer of any type; elements of `size` bytes) to hold at least `needed`,
 * keeping `used` elements and zeroing the rest; false, with nothing changed, when memory runs out. */
bool sadmm_grow(void *array, size_t *capacity, size_t used, size_t needed, size_t size);
/* The same where nothing is kept. */
static inline bool sadmm_grow_empty(void *array, size_t *capacity, size_t needed, size_t size)
{
    return sadmm_grow(array, capacity, 0, needed, size);
}

/* Tests: on this thread, let `successes` allocations pass and fail the following ones; negative: never fail. */
void sadmm_test_fail_allocations_after(long successes);
/* True if the next allocation of this thread is to fail; counts down. C++ code that allocates asks this first. */
bool sadmm_test_allocation_fails(void);

#ifdef __cplusplus
}
#endif
#endif
