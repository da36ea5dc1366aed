/* Numbers too small to be normal count as 0 in a thread, for a while: processors take many times as long for them, and an
 * iteration that passes on changes alone arrives there at rest. */
#ifndef SADMM_CPU_FLUSH_H
#define SADMM_CPU_FLUSH_H

#if defined(__SSE__)
#include <xmmintrin.h>

enum { CPU_FLUSH_RESULTS = 0x8000, CPU_FLUSH_OPERANDS = 0x0040 }; /* FTZ and DAZ of the control register */

/* Returns what cpu_flush_restore() takes back. */
static inline unsigned cpu_flush_tiny(void)
{
    unsigned before = _mm_getcsr();
    _mm_setcsr(before | CPU_FLUSH_RESULTS | CPU_FLUSH_OPERANDS);
    return before;
}
static inline void cpu_flush_restore(unsigned before) { _mm_setcsr(before); }
#else
static inline unsigned cpu_flush_tiny(void) { return 0; }
static inline void cpu_flush_restore(unsigned before) { (void)before; }
#endif

#endif
