/* Status codes, the version of the library, and how its structs may grow.
 *
 * Every call that can fail returns a sadmm_status. The object it was made on keeps a message that names
 * the argument, its value and the allowed range (sadmm_world_message, sadmm_problem_message); calls that
 * have no object yet (creation) leave it in sadmm_last_message. The library never prints, aborts or exits.
 *
 * A program runs with a library that is newer or older than the headers it was compiled with, as long as both have the
 * same major version. Of these structs, and no others, later versions have more members, at the end:
 *
 *   Definitions, settings, filters, sadmm_draw: they begin with `struct_size`, their size in the program. The _default
 *       functions set it; a struct with another value there is refused. What the program does not know keeps its
 *       default. What the library does not know must be 0.
 *   Reports and infos: functions that write them, or definitions that are read back, are given the size in the program
 *       (their names end in _sized; the functions without it are inline and pass it on). What the program does not know
 *       is not written, what the library does not know is 0. A size below that of the first version: INVALID_ARGUMENT.
 *
 * Everything else stays as it is: ids, states, contacts, events, rays and their hits, masses, tasks, elements of
 * arrays, and the parts of reports (sadmm_residual, sadmm_certificate, sadmm_phase_times). Other languages call the
 * functions with a size (_init, _sized): inline ones are in no library.
 */
#ifndef SUBADMM_STATUS_H
#define SUBADMM_STATUS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of these headers; SADMM_VERSION orders versions: 10000 major + 100 minor + patch. */
#define SADMM_VERSION_MAJOR 0
#define SADMM_VERSION_MINOR 1
#define SADMM_VERSION_PATCH 0
#define SADMM_VERSION (10000 * SADMM_VERSION_MAJOR + 100 * SADMM_VERSION_MINOR + SADMM_VERSION_PATCH)

#if defined(__GNUC__) && !defined(SADMM_STATIC)
#define SADMM_API __attribute__((visibility("default")))
#else
#define SADMM_API
#endif

typedef enum sadmm_status {
    SADMM_OK = 0,
    SADMM_ERROR_INVALID_ARGUMENT, /* an argument is out of range, not finite or inconsistent; nothing changed */
    SADMM_ERROR_STALE_ID,         /* an id names an object that was destroyed or never existed; nothing changed */
    SADMM_ERROR_OUT_OF_MEMORY,    /* an allocation failed; the object is as it was before the call */
    SADMM_ERROR_UNAVAILABLE,      /* this build or this machine lacks the backend, precision or feature */
    SADMM_ERROR_UNSUPPORTED,      /* the input is valid but asks for something this library does not do */
    SADMM_ERROR_LIMIT,            /* a size exceeds what the library can index (stated in the message) */
    SADMM_ERROR_NON_FINITE,       /* a step produced NaN or infinity; the state was rolled back */
    SADMM_ERROR_DEVICE,           /* the accelerator failed; the message names the kernel */
    SADMM_ERROR_IO,               /* a file could not be read or written */
    SADMM_STATUS_COUNT
} sadmm_status;

/* The name of a status, e.g. "SADMM_ERROR_STALE_ID"; "SADMM_STATUS_UNKNOWN" for other values. Thread-safe. */
SADMM_API const char *sadmm_status_name(sadmm_status status);

/* The message of the last failed call on this thread, "" when none failed yet. Thread-local; valid until
 * the next failing call on the same thread. */
SADMM_API const char *sadmm_last_message(void);

/* The version of the library: "major.minor.patch"; and as SADMM_VERSION has it. Thread-safe. */
SADMM_API const char *sadmm_version(void);
SADMM_API int sadmm_version_number(void);

/* Commit the library was built from ("unknown" outside a checkout) and the compiler that built it. Thread-safe. */
SADMM_API const char *sadmm_build_commit(void);
SADMM_API const char *sadmm_build_compiler(void);

#ifdef __cplusplus
}
#endif
#endif
