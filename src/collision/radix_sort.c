#include "radix_sort.h"

#include <string.h>

enum { DIGIT_BITS = 11, DIGITS = 1 << DIGIT_BITS };

void sadmm_radix_sort(uint64_t *keys, uint64_t *scratch, size_t count, int bits)
{
    uint64_t *from = keys, *to = scratch;
    for (int shift = 0; shift < bits; shift += DIGIT_BITS) {
        size_t start[DIGITS] = {0}, sum = 0;
        for (size_t i = 0; i < count; ++i) ++start[from[i] >> shift & (DIGITS - 1)];
        for (int d = 0; d < DIGITS; ++d) {
            size_t n = start[d];
            start[d] = sum;
            sum += n;
        }
        for (size_t i = 0; i < count; ++i) to[start[from[i] >> shift & (DIGITS - 1)]++] = from[i];
        uint64_t *swap = from;
        from = to;
        to = swap;
    }
    if (from != keys && count) memcpy(keys, from, count * sizeof *keys);
}
