#ifndef SADMM_CORE_BASE_CLOCK_H
#define SADMM_CORE_BASE_CLOCK_H

#ifdef __cplusplus
extern "C" {
#endif

/* Monotonic wall clock, ms. */
double sadmm_clock_ms(void);

#ifdef __cplusplus
}
#endif
#endif
