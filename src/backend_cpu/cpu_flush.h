/* Numbers too small to be normal count as 0 in a thread, for a while: x86 processors take many times as long for them,
 * and an iteration that passes on changes alone arrives there at rest. Elsewhere nothing is done: results differ by
 * numbers of that size at most. */
#ifndef SADMM_CPU_FLUSH_H
#define SADMM_CPU_FLUSH_H

#if defined(__SSE__)
#include <xmmintrin.h>

enum { CPU_FLUSH_BITS = 0x8040 }; /* of the control register: results (FTZ), operands (DAZ) */

/* Returns what cpu_flush_restore() takes back. */
static inline unsigned cpu_flush_tiny(void)
{
    unsigned before = _mm_getcsr();
    _mm_setcsr(before | CPU_FLUSH_BITS);
    return before;
}
static inline void cpu_flush_restore(unsigned before)
{
    const unsigned bits = CPU_FLUSH_BITS;
    _mm_setcsr((_mm_getcsr() & ~bits) | (before & bits));
}
#else
static inline unsigned cpu_flush_tiny(void) { return 0; }
static inline void cpu_flush_restore(unsigned before) { (void)before; }
#endif

#endif
