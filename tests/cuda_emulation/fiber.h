/* Flows of control with stacks of their own. Fibers change millions of times in a test: on the machines below a change
 * is a few instructions; elsewhere it is swapcontext, which asks the kernel for the signal mask twice a change and is
 * some ten times slower.
 *
 * The address sanitizer is told of every change, so that it watches the stacks of fibers too (and need not guess, as it
 * must for swapcontext: it then forgets a whole stack at every change). */
#ifndef SADMM_CUDA_EMULATION_FIBER_H
#define SADMM_CUDA_EMULATION_FIBER_H

#include <stddef.h>
#include <stdint.h>

#if defined __has_feature
#if __has_feature(address_sanitizer)
#define FIBER_WATCHED
#elif __has_feature(memory_sanitizer) || __has_feature(thread_sanitizer)
#define FIBER_PORTABLE
#endif
#endif
#ifdef __SANITIZE_ADDRESS__
#define FIBER_WATCHED
#endif
#if defined __SANITIZE_THREAD__ || !defined __ELF__ || !(defined __x86_64__ || defined __aarch64__) || defined __ILP32__
#define FIBER_PORTABLE
#endif

#ifdef FIBER_PORTABLE
#include <ucontext.h>
#elif defined FIBER_WATCHED
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#endif

/* fiber_switch.c: keep what a call must preserve on the stack in use and the stack's pointer in *from; take both from
 * `to`. */
extern "C" void cuda_emulation_switch(void **from, void *to);

namespace cuda_emulation {

/* One that runs, or is to go on. */
struct flow {
#ifdef FIBER_PORTABLE
    ucontext_t context = {}; /* the scheduler's stack is nobody's to fill in, and sanitizers look at it */
#else
    void *pointer = nullptr;
#ifdef FIBER_WATCHED
    const void *bottom = nullptr;
    size_t bytes = 0;
    void *frames = nullptr; /* the sanitizer's */
#endif
#endif
};

/* On a stack whose last fiber came to its end only the frames of that are left; a whole stack takes the sanitizer
 * longer than most threads run. */
enum { LAST_FRAMES = 4096 };

/* Make one that begins with entry(), which must not return, on a stack that nothing uses any more. */
inline void flow_prepare(flow *f, char *stack, size_t bytes, void (*entry)(void))
{
#ifdef FIBER_PORTABLE
    getcontext(&f->context);
    f->context.uc_stack.ss_sp = stack;
    f->context.uc_stack.ss_size = bytes;
    f->context.uc_link = nullptr;
    makecontext(&f->context, entry, 0);
#else
    /* What cuda_emulation_switch() takes from a stack. Then the pointer is what it is where a function begins. */
    void **top = (void **)(((uintptr_t)stack + bytes) & ~(uintptr_t)15);
#ifdef __x86_64__
    enum { KEPT = 8, RETURN = 6 }; /* six registers, the return address, and nothing to return to for entry() */
#else
    enum { KEPT = 20, RETURN = 11 };
#endif
    top -= KEPT;
    for (int i = 0; i < KEPT; ++i) top[i] = nullptr;
    top[RETURN] = (void *)entry;
    f->pointer = top;
#ifdef FIBER_WATCHED
    f->bottom = stack;
    f->bytes = bytes;
    f->frames = nullptr;
    __asan_unpoison_memory_region(stack + bytes - LAST_FRAMES, LAST_FRAMES);
#endif
#endif
}

/* What ran on this stack has come to its end, and another one goes on there. */
inline void flow_hand_over(const flow *last, flow *next)
{
#if defined FIBER_WATCHED && !defined FIBER_PORTABLE
    next->bottom = last->bottom;
    next->bytes = last->bytes;
#else
    (void)last;
    (void)next;
#endif
}

/* A stack whose fiber will not come to its end. */
inline void flow_abandon(char *stack, size_t bytes)
{
#if defined FIBER_WATCHED && !defined FIBER_PORTABLE
    __asan_unpoison_memory_region(stack, bytes);
#else
    (void)stack;
    (void)bytes;
#endif
}

/* The first thing entry() does; from: who switched to it. */
inline void flow_begin(flow *from)
{
#if defined FIBER_WATCHED && !defined FIBER_PORTABLE
    __sanitizer_finish_switch_fiber(nullptr, &from->bottom, &from->bytes);
#else
    (void)from;
#endif
}

/* last: `from` is not gone back to. */
inline void flow_switch(flow *from, flow *to, bool last = false)
{
#ifdef FIBER_PORTABLE
    (void)last;
    swapcontext(&from->context, &to->context);
#else
#ifdef FIBER_WATCHED
    __sanitizer_start_switch_fiber(last ? nullptr : &from->frames, to->bottom, to->bytes);
#else
    (void)last;
#endif
    cuda_emulation_switch(&from->pointer, to->pointer);
#ifdef FIBER_WATCHED
    __sanitizer_finish_switch_fiber(from->frames, nullptr, nullptr);
#endif
#endif
}

} // namespace cuda_emulation

#endif
