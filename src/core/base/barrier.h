/* The barrier of a parallel region (parallel.h), between the sweeps of an iteration above all.
 *
 * A sweep takes microseconds, so threads wait spinning; on a machine with fewer free cores than threads the spin gives
 * way soon, or every barrier would cost a scheduler's time slice. C11 atomics: a thread sanitizer sees the order it
 * makes. */
#ifndef SADMM_CORE_BARRIER_H
#define SADMM_CORE_BARRIER_H

#include <sched.h>
#include <stdatomic.h>

enum { SADMM_SPINS = 2000 }; /* some 40 us of pauses */

static inline void sadmm_pause(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#endif
}

/* All 0 at first; used by the members of one region at a time, whatever their number. */
struct sadmm_barrier {
    _Alignas(64) atomic_int arrived;
    _Alignas(64) atomic_uint phase;
};

/* Until all `threads` members have come. */
static inline void sadmm_barrier_wait(struct sadmm_barrier *barrier, int threads)
{
    if (threads == 1) return;
    unsigned phase = atomic_load_explicit(&barrier->phase, memory_order_relaxed);
    if (atomic_fetch_add_explicit(&barrier->arrived, 1, memory_order_acq_rel) + 1 == threads) {
        atomic_store_explicit(&barrier->arrived, 0, memory_order_relaxed);
        atomic_store_explicit(&barrier->phase, phase + 1, memory_order_release);
        return;
    }
    for (int spin = 0; atomic_load_explicit(&barrier->phase, memory_order_acquire) == phase; ++spin) {
        if (spin < SADMM_SPINS) sadmm_pause();
        else sched_yield();
    }
}

#endif
