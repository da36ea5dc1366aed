/* Allocation: blocks and growable arrays, 64-byte aligned, with failure injection for the tests. */
#ifndef SADMM_CORE_BASE_MEMORY_H
#define SADMM_CORE_BASE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

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

/* A growable array is a pointer, NULL at first: its block knows how large it is. Room is what it may hold. */
static inline size_t sadmm_room(const void *block, size_t size)
{
    return block ? ((const size_t *)block)[-1] / size : 0; /* bytes, in front of what was given out */
}

/* Room for at least `needed` elements of `size` bytes in *array (`array`: the address of a pointer of any type). Where
 * the block has to be another one, `used` elements are kept and the rest is zeroed. False, with nothing changed, when
 * memory runs out. */
bool sadmm_grow_block(void *array, size_t used, size_t needed, size_t size);
static inline bool sadmm_grow(void *array, size_t used, size_t needed, size_t size)
{
    void *block;
    memcpy(&block, array, sizeof block);
    return needed <= sadmm_room(block, size) || sadmm_grow_block(array, used, needed, size);
}

#define SADMM_ROOM(array)               sadmm_room(array, sizeof *(array))
#define SADMM_GROW(array, used, needed) sadmm_grow(&(array), used, needed, sizeof *(array))

/* Tests: on this thread, let `successes` allocations pass and fail the following ones; negative: never fail. */
void sadmm_test_fail_allocations_after(long successes);
/* True if the next allocation of this thread is to fail; counts down. C++ code that allocates asks this first. */
bool sadmm_test_allocation_fails(void);

#ifdef __cplusplus
}
#endif
#endif
