#include "growing.h"

#include <string.h>

#include "check.h"

/* No struct is larger: a number beyond was never a size. */
enum { LARGEST = 1 << 16 };

static void set_size(void *at, size_t size) { memcpy(at, &size, sizeof size); }

static size_t size_at(const void *at)
{
    size_t size;
    memcpy(&size, at, sizeof size);
    return size;
}

/* What both know; the rest is 0. */
static void copy_to(unsigned char *out, size_t size, const unsigned char *from, size_t known)
{
    memcpy(out, from, size < known ? size : known);
    if (size > known) memset(out + known, 0, size - known);
}

/* The program's parts begin where the library's do. What is behind them has moved on by how much they have grown. */
static void write_out(const struct sadmm_growing *type, void *to, size_t size, size_t part_size, const void *of)
{
    const size_t head = type->part_count ? type->part_at : type->size, end = head + type->part_count * type->part_size,
                 end_out = head + type->part_count * part_size;
    const unsigned char *from = (const unsigned char *)of;
    unsigned char *out = (unsigned char *)to;
    if (!type->part_count || size < end_out) {
        copy_to(out, size, from, head);
        return;
    }
    memcpy(out, from, head);
    for (size_t k = 0; k < type->part_count; ++k)
        copy_to(out + head + k * part_size, part_size, from + head + k * type->part_size, type->part_size);
    copy_to(out + end_out, size - end_out, from + end, type->size - end);
    if (part_size >= sizeof(size_t)) set_size(out + type->part_size_at, part_size);
}

void sadmm_growing_init(const struct sadmm_growing *type, void *out, size_t size, size_t part_size)
{
    if (!out || size < sizeof size) return;
    write_out(type, out, size, part_size, type->defaults);
    set_size(out, size);
}

static sadmm_status check_size(const struct sadmm_growing *type, const char *name, const char *member, size_t size,
                               size_t least, struct sadmm_error *error)
{
    if (size >= least && size <= LARGEST) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s->%s = %zu: must be in [%zu, %d]; start from %s", name,
                      member, size, least, LARGEST, type->start);
}

/* `given` may be longer than what is known here, as far as nothing is set there. */
static sadmm_status take_known(unsigned char *out, size_t known, const unsigned char *given, size_t size,
                               const char *name, size_t at, struct sadmm_error *error)
{
    memcpy(out, given, size < known ? size : known);
    for (size_t k = known; k < size; ++k)
        if (given[k])
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "%s: a member at byte %zu is set, and must be 0: this library (version %s) is older than "
                              "the program, and does not have it",
                              name, at + k, sadmm_version());
    return SADMM_OK;
}

static sadmm_status check_end(const struct sadmm_growing *type, const char *name, size_t size, size_t end,
                              struct sadmm_error *error)
{
    if (size >= end) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s->struct_size = %zu: must be at least %zu with %s->%s; "
                      "start from %s", name, size, end, name, type->part_name, type->start);
}

sadmm_status sadmm_growing_take(const struct sadmm_growing *type, void *out, const void *given, const char *name,
                                struct sadmm_error *error)
{
    const unsigned char *from = (const unsigned char *)given;
    unsigned char *to = (unsigned char *)out;
    TRY(sadmm_check_given(given, name, error));
    const size_t size = size_at(given);
    TRY(check_size(type, name, "struct_size", size, type->least, error));
    memcpy(out, type->defaults, type->size);
    if (!type->part_count) {
        TRY(take_known(to, type->size, from, size, name, 0, error));
        set_size(out, type->size);
        return SADMM_OK;
    }
    const size_t part_size = size_at(from + type->part_size_at), head = type->part_at;
    TRY(check_size(type, name, type->part_name, part_size, type->part_least, error));
    const size_t end = head + type->part_count * type->part_size, end_given = head + type->part_count * part_size;
    TRY(check_end(type, name, size, end_given, error));
    memcpy(to, from, head);
    for (size_t k = 0; k < type->part_count; ++k)
        TRY(take_known(to + head + k * type->part_size, type->part_size, from + head + k * part_size, part_size, name,
                       head + k * part_size, error));
    TRY(take_known(to + end, type->size - end, from + end_given, size - end_given, name, end_given, error));
    set_size(out, type->size);
    set_size(to + type->part_size_at, type->part_size);
    return SADMM_OK;
}

sadmm_status sadmm_growing_give(const struct sadmm_growing *type, void *out, size_t size, size_t part_size,
                                const void *from, const char *name, struct sadmm_error *error)
{
    TRY(sadmm_check_given(out, name, error));
    if (size < type->least || size > LARGEST)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "size = %zu: must be in [%zu, %d], that of %s", size,
                          type->least, LARGEST, name);
    if (type->part_count && (part_size < type->part_least || size < type->part_at + type->part_count * part_size))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %zu: must be in [%zu, %zu] with size = %zu",
                          type->part_name, part_size, type->part_least, (size - type->part_at) / type->part_count,
                          size);
    write_out(type, out, size, part_size, from);
    set_size(out, size);
    return SADMM_OK;
}

sadmm_status sadmm_check_bytes(size_t size, size_t least, const char *name, struct sadmm_error *error)
{
    if (size >= least && size <= LARGEST) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "size = %zu: must be in [%zu, %d], that of %s", size, least,
                      LARGEST, name);
}

sadmm_status sadmm_take_bytes(void *out, size_t known, size_t least, const void *given, size_t size, const char *name,
                              struct sadmm_error *error)
{
    TRY(sadmm_check_given(given, name, error));
    TRY(sadmm_check_bytes(size, least, name, error));
    return take_known((unsigned char *)out, known, (const unsigned char *)given, size, name, 0, error);
}

sadmm_status sadmm_give_bytes(void *out, size_t size, const void *from, size_t known, size_t least, const char *name,
                              struct sadmm_error *error)
{
    TRY(sadmm_check_given(out, name, error));
    TRY(sadmm_check_bytes(size, least, name, error));
    copy_to((unsigned char *)out, size, (const unsigned char *)from, known);
    return SADMM_OK;
}
