#include "error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "utf8.h"

static _Thread_local char last_message[SADMM_MESSAGE_SIZE];

sadmm_status sadmm_fail(struct sadmm_error *error, sadmm_status status, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(last_message, sizeof last_message, format, arguments);
    va_end(arguments);
    sadmm_utf8_mend(last_message); /* of names that were cut, or are none */
    if (error) {
        error->status = status;
        memcpy(error->message, last_message, sizeof last_message);
    }
    return status;
}

sadmm_status sadmm_fail_memory(struct sadmm_error *error, const char *what)
{
    return sadmm_fail(error, SADMM_ERROR_OUT_OF_MEMORY, "out of memory for %s", what);
}

const char *sadmm_last_message(void)
{
    return last_message;
}

const char *sadmm_status_name(sadmm_status status)
{
    static const char *const names[SADMM_STATUS_COUNT] = {
        [SADMM_OK] = "SADMM_OK",
        [SADMM_ERROR_INVALID_ARGUMENT] = "SADMM_ERROR_INVALID_ARGUMENT",
        [SADMM_ERROR_STALE_ID] = "SADMM_ERROR_STALE_ID",
        [SADMM_ERROR_OUT_OF_MEMORY] = "SADMM_ERROR_OUT_OF_MEMORY",
        [SADMM_ERROR_UNAVAILABLE] = "SADMM_ERROR_UNAVAILABLE",
        [SADMM_ERROR_UNSUPPORTED] = "SADMM_ERROR_UNSUPPORTED",
        [SADMM_ERROR_LIMIT] = "SADMM_ERROR_LIMIT",
        [SADMM_ERROR_NON_FINITE] = "SADMM_ERROR_NON_FINITE",
        [SADMM_ERROR_DEVICE] = "SADMM_ERROR_DEVICE",
        [SADMM_ERROR_IO] = "SADMM_ERROR_IO",
    };
    return (unsigned)status < SADMM_STATUS_COUNT ? names[status] : "SADMM_STATUS_UNKNOWN";
}
