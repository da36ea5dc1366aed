/* Structs of callers that grow from version to version, at their end (subadmm/status.h): taken from programs that were
 * compiled with other headers, and written to them. */
#ifndef SADMM_CORE_BASE_GROWING_H
#define SADMM_CORE_BASE_GROWING_H

#include <stddef.h>

#include "error.h"

/* A struct as this version has it. It may hold others that grow, one after the other, from `part_at` on: its own later
 * members go on behind them, wherever these end in the program. */
struct sadmm_growing {
    size_t size, least;   /* now; in the first version that had it, with the padding at its end */
    const void *defaults; /* without the sizes */
    const char *start;    /* the call that a caller starts from */
    size_t part_count, part_at, part_size, part_least;
    size_t part_size_at;  /* where the struct says what size each of them has */
    const char *part_name; /* of that member */
};

/* One with `struct_size` and without parts. The type's first version ended with the member `last`. */
#define SADMM_GROWING(type, defaults, last) \
    {sizeof(type), SADMM_SIZE_TO(type, last), defaults, #type "_default()", 0, 0, 0, 0, 0, NULL}
/* The size that a struct has, or had, that ends with `last`. All of them have numbers or pointers of 8 bytes. */
#define SADMM_SIZE_TO(type, last) ((offsetof(type, last) + sizeof((type){0}.last) + 7) / 8 * 8)

/* The defaults, in a program whose struct and parts have these sizes. */
void sadmm_growing_init(const struct sadmm_growing *type, void *out, size_t size, size_t part_size);
/* A copy as this version has it: what the program does not know has its default. INVALID_ARGUMENT: NULL, a size that is
 * none, or members set that are not known here. name: of the argument. */
sadmm_status sadmm_growing_take(const struct sadmm_growing *type, void *out, const void *given, const char *name,
                                struct sadmm_error *error);
/* `from`, as this version has it, to a program. INVALID_ARGUMENT: NULL, or a size that is none. */
sadmm_status sadmm_growing_give(const struct sadmm_growing *type, void *out, size_t size, size_t part_size,
                                const void *from, const char *name, struct sadmm_error *error);

/* The same of a struct that does not say its size, which ended with the byte before `least` in its first version. out:
 * holds the defaults. */
sadmm_status sadmm_take_bytes(void *out, size_t known, size_t least, const void *given, size_t size, const char *name,
                              struct sadmm_error *error);
sadmm_status sadmm_check_bytes(size_t size, size_t least, const char *name, struct sadmm_error *error);
sadmm_status sadmm_give_bytes(void *out, size_t size, const void *from, size_t known, size_t least, const char *name,
                              struct sadmm_error *error);

#endif
