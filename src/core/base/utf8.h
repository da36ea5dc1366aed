/* Texts in UTF-8: where a character ends, so that none is cut. */
#ifndef SADMM_CORE_UTF8_H
#define SADMM_CORE_UTF8_H

#include <stddef.h>

/* Bytes of the character that `at` (with a final 0) begins with, 1 to 4; 0: it is the end, or no character. */
size_t sadmm_utf8_character(const char *at);

/* Bytes of the whole characters that `text` begins with and that fit into `most` bytes. */
size_t sadmm_utf8_fit(const char *text, size_t most);

/* Every byte that is of no character becomes '?'. */
void sadmm_utf8_mend(char *text);

#endif
