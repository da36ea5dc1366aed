/* Functions that nvcc compiles for the device, too. */
#ifndef SADMM_CORE_BASE_INLINE_H
#define SADMM_CORE_BASE_INLINE_H

#ifdef __CUDACC__
#define SADMM_INLINE static inline __host__ __device__
#else
#define SADMM_INLINE static inline
#endif
/* What is rare and long: kept out of the functions that call it, and out of their registers. */
#ifdef __CUDACC__
#define SADMM_RARE static __host__ __device__ __noinline__ __attribute__((unused))
#else
#define SADMM_RARE static __attribute__((noinline, unused))
#endif
/* What is long and called from many places: inline on the host, a call on a device, whose compiler would take
 * minutes. */
#ifdef __CUDACC__
#define SADMM_CALLED SADMM_RARE
#else
#define SADMM_CALLED SADMM_INLINE
#endif
/* What a compiler for the host is not left to choose about, as one for a device is: inline, or a function by itself. */
#ifdef __CUDACC__
#define SADMM_HOST_INLINE SADMM_INLINE
#define SADMM_HOST_CALL SADMM_INLINE
#else
#define SADMM_HOST_INLINE static inline __attribute__((always_inline))
#define SADMM_HOST_CALL static __attribute__((noinline, unused))
#endif
/* Where a call would cost more than the function. */
#define SADMM_ALWAYS_INLINE SADMM_INLINE __attribute__((always_inline))

#endif
