/* The barrier of a parallel region (parallel.h), between the sweeps of an iteration above all. */
#ifndef SADMM_CORE_BARRIER_H
#define SADMM_CORE_BARRIER_H

#include "wait.h"

/* All 0 at first; used by the members of one region at a time, whatever their number. */
struct sadmm_barrier {
    _Alignas(64) atomic_int arrived;
    _Alignas(64) struct sadmm_word phase;
};

/* Until all `threads` members have come. */
static inline void sadmm_barrier_wait(struct sadmm_barrier *barrier, int threads)
{
    if (threads == 1) return;
    const unsigned phase = atomic_load_explicit(&barrier->phase.value, memory_order_relaxed);
    if (atomic_fetch_add_explicit(&barrier->arrived, 1, memory_order_acq_rel) + 1 == threads) {
        atomic_store_explicit(&barrier->arrived, 0, memory_order_relaxed);
        sadmm_word_set(&barrier->phase, phase + 1);
    } else {
        sadmm_word_wait(&barrier->phase, phase);
    }
}

#endif
