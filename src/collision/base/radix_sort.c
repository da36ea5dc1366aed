#include "radix_sort.h"

#include <stdbool.h>
#include <string.h>

enum { MOST_DIGIT_BITS = 11 };

static bool is_sorted(const uint64_t *keys, size_t count)
{
    for (size_t i = 1; i < count; ++i)
        if (keys[i - 1] > keys[i]) return false;
    return true;
}

/* By insertion: counts of digits are not worth it. */
enum { FEW_KEYS = 48 };
static void sort_few(uint64_t *keys, size_t count)
{
    for (size_t i = 1; i < count; ++i) {
        const uint64_t key = keys[i];
        size_t at = i;
        for (; at > 0 && keys[at - 1] > key; --at) keys[at] = keys[at - 1];
        keys[at] = key;
    }
}

void sadmm_radix_sort(uint64_t *keys, uint64_t *scratch, size_t count, int bits)
{
    if (count <= FEW_KEYS) {
        sort_few(keys, count);
        return;
    }
    if (is_sorted(keys, count)) return;
    /* Digits as narrow as the number of passes allows: counts are cleared and added up in each. */
    const int passes = (bits + MOST_DIGIT_BITS - 1) / MOST_DIGIT_BITS, digit_bits = (bits + passes - 1) / passes;
    const size_t digits = (size_t)1 << digit_bits;
    uint64_t *from = keys, *to = scratch;
    for (int shift = 0; shift < bits; shift += digit_bits) {
        size_t start[1 << MOST_DIGIT_BITS], sum = 0;
        memset(start, 0, digits * sizeof *start);
        for (size_t i = 0; i < count; ++i) ++start[from[i] >> shift & (digits - 1)];
        for (size_t d = 0; d < digits; ++d) {
            size_t n = start[d];
            start[d] = sum;
            sum += n;
        }
        for (size_t i = 0; i < count; ++i) to[start[from[i] >> shift & (digits - 1)]++] = from[i];
        uint64_t *swap = from;
        from = to;
        to = swap;
    }
    if (from != keys) memcpy(keys, from, count * sizeof *keys);
}
