/* Text of a file, byte by byte: lines, and the words in them. Lines end by \n, \r\n or \r. Nothing depends on the
 * locale, provided that the thread's is "C" while numbers are read. */
#ifndef SADMM_MESH_FILE_TEXT_H
#define SADMM_MESH_FILE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct text {
    const char *at, *end;
    size_t line;   /* the current one, from 1 */
    bool begun;    /* a word of it has been found */
    bool comments; /* a word that begins with # ends its line */
    bool continues;  /* a backslash at its end joins a line to the next */
};

struct word {
    const char *at;
    size_t length;
};

enum { QUOTE_SIZE = 44 };

/* Behind the mark of UTF-8, if there is one. */
struct text sadmm_text(const void *bytes, size_t size);
/* Leave what is left of a line that is begun, and begin the next that has a word. False: there is none. */
bool sadmm_text_next_line(struct text *text);
/* The next word of the line. False: it has no more. */
bool sadmm_text_word(struct text *text, struct word *word);
/* To the first byte behind the line; `cr`: a \n behind its \r is that. */
void sadmm_text_end_line(struct text *text, bool cr);

bool sadmm_word_is(struct word word, const char *text);
/* The same, in capitals or not; `text` in small letters. */
bool sadmm_word_is_any_case(struct word word, const char *text);
/* A finite decimal number ("nan", "inf", hexadecimal numbers and those of more than 255 characters are none). Those
 * beyond a double's range are infinite. */
bool sadmm_word_number(struct word word, double *value);
/* A decimal integer; those beyond the range of *value are its ends. */
bool sadmm_word_integer(struct word word, int64_t *value);
/* For messages: its beginning, with ? for what cannot be printed. Returns `quote`. */
const char *sadmm_word_quote(struct word word, char quote[QUOTE_SIZE]);

#endif
