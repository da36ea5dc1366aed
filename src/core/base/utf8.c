#include "utf8.h"

#include <stdint.h>

/* The smallest code point that needs so many bytes: shorter ones written longer are no characters. */
static const uint32_t least[5] = {0, 0, 0x80, 0x800, 0x10000};

static size_t length_by(unsigned char first)
{
    if (first < 0x80) return first ? 1 : 0;
    if (first < 0xC0) return 0;
    if (first < 0xE0) return 2;
    return first < 0xF0 ? 3 : first < 0xF8 ? 4 : 0;
}

size_t sadmm_utf8_character(const char *at)
{
    const unsigned char *byte = (const unsigned char *)at;
    const size_t length = length_by(byte[0]);
    if (length < 2) return length;
    uint32_t point = byte[0] & (0x7Fu >> length);
    for (size_t k = 1; k < length; ++k) {
        if ((byte[k] & 0xC0) != 0x80) return 0; /* the final 0 as well */
        point = point << 6 | (byte[k] & 0x3Fu);
    }
    const int is_surrogate = point >= 0xD800 && point < 0xE000;
    return point < least[length] || point > 0x10FFFF || is_surrogate ? 0 : length;
}

size_t sadmm_utf8_fit(const char *text, size_t most)
{
    size_t used = 0;
    for (size_t next = sadmm_utf8_character(text); next > 0 && used + next <= most;
         next = sadmm_utf8_character(text + used))
        used += next;
    return used;
}

void sadmm_utf8_mend(char *text)
{
    while (*text) {
        const size_t next = sadmm_utf8_character(text);
        if (next == 0) *text = '?';
        text += next > 0 ? next : 1;
    }
}
