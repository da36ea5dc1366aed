/* Errors inside the library: a status and a message that travel together. */
#ifndef SADMM_CORE_BASE_ERROR_H
#define SADMM_CORE_BASE_ERROR_H

#include "subadmm/status.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { SADMM_MESSAGE_SIZE = 768 };

struct sadmm_error {
    sadmm_status status;
    char message[SADMM_MESSAGE_SIZE];
};

/* Fill `error` (may be NULL) and this thread's last message, which are UTF-8 whatever they quote; returns `status` for
 * `return sadmm_fail(...)`. */
#ifdef __GNUC__
__attribute__((format(printf, 3, 4)))
#endif
sadmm_status sadmm_fail(struct sadmm_error *error, sadmm_status status, const char *format, ...);

/* The usual message of a failed allocation. */
sadmm_status sadmm_fail_memory(struct sadmm_error *error, const char *what);

/* Leave the function with the call's status unless it is OK. */
#define TRY(call)                                      \
    do {                                               \
        sadmm_status try_status = (call);              \
        if (try_status != SADMM_OK) return try_status; \
    } while (0)

#ifdef __cplusplus
}
#endif
#endif
