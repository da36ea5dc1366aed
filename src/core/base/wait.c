#include "wait.h"

#ifdef __linux__
#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>
#else
#include <sched.h>
#endif

enum { FEWEST_SPINS = 100 };

static void sleep_on(struct sadmm_word *word, unsigned seen)
{
#ifdef __linux__
    syscall(SYS_futex, &word->value, FUTEX_WAIT_PRIVATE, seen, NULL, NULL, 0);
#else
    (void)word, (void)seen;
    sched_yield();
#endif
}

unsigned sadmm_word_wait(struct sadmm_word *word, unsigned seen)
{
    static _Thread_local int spins = SADMM_SPINS;
    unsigned value;
    for (int spin = 0; spin < spins; ++spin) {
        value = atomic_load_explicit(&word->value, memory_order_acquire);
        if (value != seen) {
            spins = spins < SADMM_SPINS / 2 ? 2 * spins : SADMM_SPINS;
            return value;
        }
        sadmm_pause();
    }
    spins = spins > 2 * FEWEST_SPINS ? spins / 2 : FEWEST_SPINS;
    atomic_fetch_add(&word->sleepers, 1);
    while ((value = atomic_load(&word->value)) == seen) sleep_on(word, seen);
    atomic_fetch_sub(&word->sleepers, 1);
    return value;
}

void sadmm_word_wake(struct sadmm_word *word)
{
    if (atomic_load(&word->sleepers) == 0) return;
#ifdef __linux__
    syscall(SYS_futex, &word->value, FUTEX_WAKE_PRIVATE, 1 << 30, NULL, NULL, 0);
#endif
}
