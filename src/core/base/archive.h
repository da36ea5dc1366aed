/* State as bytes and back, by the same list of members for both directions, so that what is written and what is read
 * cannot part. What is read may be anything: counts are held against what is left, and once something does not fit all
 * that follows is read as 0. */
#ifndef SADMM_CORE_BASE_ARCHIVE_H
#define SADMM_CORE_BASE_ARCHIVE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "error.h"

struct sadmm_archive {
    bool reading;
    unsigned char *out;      /* writing: NULL: bytes are counted alone */
    const unsigned char *in; /* reading */
    size_t size;             /* reading: of `in`; writing: of `out` */
    size_t at;               /* bytes so far */
    sadmm_status status;     /* of reading: INVALID_ARGUMENT, OUT_OF_MEMORY; the first one */
    struct sadmm_error *error;
};

/* The bytes of x, which has no padding, no pointers and no bool. */
#define SADMM_ARCHIVE(archive, x) sadmm_archive_bytes(archive, &(x), sizeof(x))

void sadmm_archive_bytes(struct sadmm_archive *archive, void *x, size_t size);
void sadmm_archive_flag(struct sadmm_archive *archive, bool *x);
/* A count of things that take `unit` bytes or more each, in [0, most]. */
void sadmm_archive_count(struct sadmm_archive *archive, size_t *count, size_t unit, size_t most);
/* The same of a count that is an int32_t in memory. */
void sadmm_archive_count32(struct sadmm_archive *archive, int32_t *count, size_t unit, int32_t most);
/* A growable array of *count elements of `size` bytes, as of SADMM_ARCHIVE; `array`: the address of its pointer. */
void sadmm_archive_array(struct sadmm_archive *archive, void *array, size_t *count, size_t size, size_t most);
/* What was read is not what can have been written, unless `fine`. Returns `fine` and no earlier failure. */
bool sadmm_archive_expect(struct sadmm_archive *archive, bool fine, const char *what);
/* Room for `count` elements, zeroed, of an array that is empty; false after a failure. */
bool sadmm_archive_room(struct sadmm_archive *archive, void *array, size_t count, size_t size);

#endif
