#include "memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

static _Thread_local long allocations_left = -1;

void sadmm_test_fail_allocations_after(long successes)
{
    allocations_left = successes;
}

bool sadmm_test_allocation_fails(void)
{
    if (allocations_left < 0) return false;
    if (allocations_left == 0) return true;
    --allocations_left;
    return false;
}

/* FRONT: what lies in front of a block, its size in bytes. */
enum { ALIGNMENT = 64, HUGE_PAGE = 2 << 20, FRONT = ALIGNMENT };

static void *allocate(size_t count, size_t size)
{
    if (size && count > (SIZE_MAX / 2 - HUGE_PAGE) / size) return NULL;
    if (sadmm_test_allocation_fails()) return NULL;
    /* Large arrays are swept in order but gathered from at random: huge pages save the address lookups. */
    size_t alignment = count * size >= 2 * HUGE_PAGE ? HUGE_PAGE : ALIGNMENT;
    size_t bytes = (FRONT + count * size + alignment - 1) / alignment * alignment;
    char *whole = (char *)aligned_alloc(alignment, bytes);
    if (!whole) return NULL;
#ifdef MADV_HUGEPAGE
    if (alignment == HUGE_PAGE) madvise(whole, bytes, MADV_HUGEPAGE); /* a hint: failing changes nothing */
#endif
    void *block = whole + FRONT;
    ((size_t *)block)[-1] = count * size;
    return block;
}

void *sadmm_alloc(size_t count, size_t size)
{
    void *block = allocate(count, size);
    if (block) memset(block, 0, count * size);
    return block;
}

void sadmm_free(void *block)
{
    if (block) free((char *)block - FRONT);
}

bool sadmm_grow_block(void *array, size_t used, size_t needed, size_t size)
{
    void *old;
    memcpy(&old, array, sizeof old);
    const size_t wanted = sadmm_grown_capacity(sadmm_room(old, size), needed, 16);
    char *block = (char *)allocate(wanted, size);
    if (!block) return false;
    if (used) memcpy(block, old, used * size);
    memset(block + used * size, 0, (wanted - used) * size);
    sadmm_free(old);
    memcpy(array, &block, sizeof block);
    return true;
}
