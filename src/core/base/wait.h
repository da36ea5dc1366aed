/* Waiting for another thread: a word in memory that one changes and others watch.
 *
 * What is waited for takes microseconds, so a watcher spins at first. If it takes longer, the other thread is not
 * running: there are fewer free cores than threads. Then the watcher sleeps, which leaves the other one a core, and
 * spins for less time the next time. C11 atomics: a thread sanitizer sees the order that they make. */
#ifndef SADMM_CORE_WAIT_H
#define SADMM_CORE_WAIT_H

#include <stdatomic.h>

enum { SADMM_SPINS = 2000 }; /* some 40 us of pauses */

static inline void sadmm_pause(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#endif
}

struct sadmm_word {
    atomic_uint value;
    atomic_int sleepers;
};

/* Until the word is something else than `seen`; returns what it is then. */
unsigned sadmm_word_wait(struct sadmm_word *word, unsigned seen);

/* After each change of the word, which is sequentially consistent: a watcher that goes to sleep has been counted or
 * sees the change. */
void sadmm_word_wake(struct sadmm_word *word);

static inline void sadmm_word_set(struct sadmm_word *word, unsigned value)
{
    atomic_store(&word->value, value);
    sadmm_word_wake(word);
}

#endif
