/* The barrier between the sweeps of an iteration.
 *
 * A sweep takes microseconds, so threads wait spinning; on a machine with fewer free cores than threads the spin gives way
 * soon, or every barrier would cost a scheduler's time slice. C11 atomics: a thread sanitizer sees the order it makes. */
#ifndef SADMM_CPU_BARRIER_H
#define SADMM_CPU_BARRIER_H

#include <sched.h>
#include <stdatomic.h>

struct cpu_barrier {
    _Alignas(64) atomic_int arrived;
    _Alignas(64) atomic_uint phase;
};

static inline void cpu_barrier_pause(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#endif
}

static inline void cpu_barrier_wait(struct cpu_barrier *barrier, int threads)
{
    enum { SPINS = 2000 }; /* some 40 us of pauses */
    if (threads == 1) return;
    unsigned phase = atomic_load_explicit(&barrier->phase, memory_order_relaxed);
    if (atomic_fetch_add_explicit(&barrier->arrived, 1, memory_order_acq_rel) + 1 == threads) {
        atomic_store_explicit(&barrier->arrived, 0, memory_order_relaxed);
        atomic_store_explicit(&barrier->phase, phase + 1, memory_order_release);
        return;
    }
    for (int spin = 0; atomic_load_explicit(&barrier->phase, memory_order_acquire) == phase; ++spin) {
        if (spin < SPINS) cpu_barrier_pause();
        else sched_yield();
    }
}

#endif
