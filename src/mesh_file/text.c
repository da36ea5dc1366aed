#include "text.h"

#include <stdlib.h>
#include <string.h>

enum { LONGEST_NUMBER = 255 };

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

static bool is_newline(char c) { return c == '\n' || c == '\r'; }

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

static char lower(char c) { return (char)(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c); }

struct text sadmm_text(const void *bytes, size_t size)
{
    const char *const begin = (const char *)bytes;
    const bool marked = size >= 3 && memcmp(begin, "\xEF\xBB\xBF", 3) == 0;
    return (struct text){.at = begin + (marked ? 3 : 0), .end = begin + size, .line = 1};
}

static size_t newline_length(const struct text *text, const char *at)
{
    return at[0] == '\r' && text->end - at > 1 && at[1] == '\n' ? 2 : 1;
}

/* Where a line that is joined to the next one goes on; NULL: it is not. */
static const char *continued_at(const struct text *text)
{
    if (!text->continues || *text->at != '\\' || text->end - text->at < 2 || !is_newline(text->at[1])) return NULL;
    return text->at + 1 + newline_length(text, text->at + 1);
}

static void skip_blanks(struct text *text)
{
    while (text->at < text->end) {
        const char *const next = continued_at(text);
        if (!next && !is_blank(*text->at)) return;
        text->line += next != NULL;
        text->at = next ? next : text->at + 1;
    }
}

bool sadmm_text_word(struct text *text, struct word *word)
{
    skip_blanks(text);
    if (text->at == text->end || is_newline(*text->at) || (text->comments && *text->at == '#')) return false;
    word->at = text->at;
    while (text->at < text->end && !is_blank(*text->at) && !is_newline(*text->at) && !continued_at(text)) ++text->at;
    word->length = (size_t)(text->at - word->at);
    return true;
}

bool sadmm_text_next_line(struct text *text)
{
    struct word word;
    if (text->begun) {
        while (sadmm_text_word(text, &word)) {}
        sadmm_text_end_line(text, false);
    }
    for (; text->at < text->end; sadmm_text_end_line(text, false)) {
        skip_blanks(text);
        text->begun = text->at < text->end && !is_newline(*text->at) && !(text->comments && *text->at == '#');
        if (text->begun) return true;
    }
    return false;
}

void sadmm_text_end_line(struct text *text, bool cr)
{
    text->begun = false;
    while (text->at < text->end && !is_newline(*text->at)) ++text->at;
    if (text->at == text->end) return;
    text->at += cr && *text->at == '\r' ? 1 : newline_length(text, text->at);
    ++text->line;
}

bool sadmm_word_is(struct word word, const char *text)
{
    return strlen(text) == word.length && memcmp(word.at, text, word.length) == 0;
}

bool sadmm_word_is_any_case(struct word word, const char *text)
{
    if (strlen(text) != word.length) return false;
    for (size_t k = 0; k < word.length; ++k)
        if (lower(word.at[k]) != text[k]) return false;
    return true;
}

/* How many digits there are from *k on; *k: behind them. */
static size_t skip_digits(struct word word, size_t *k)
{
    const size_t from = *k;
    while (*k < word.length && is_digit(word.at[*k])) ++*k;
    return *k - from;
}

static void skip_sign(struct word word, size_t *k)
{
    *k += *k < word.length && (word.at[*k] == '-' || word.at[*k] == '+');
}

static bool looks_like_number(struct word word)
{
    size_t k = 0, digits;
    skip_sign(word, &k);
    digits = skip_digits(word, &k);
    if (k < word.length && word.at[k] == '.') {
        ++k;
        digits += skip_digits(word, &k);
    }
    if (digits == 0) return false;
    if (k < word.length && lower(word.at[k]) == 'e') {
        ++k;
        skip_sign(word, &k);
        if (skip_digits(word, &k) == 0) return false;
    }
    return k == word.length;
}

bool sadmm_word_number(struct word word, double *value)
{
    char copy[LONGEST_NUMBER + 1];
    if (word.length > LONGEST_NUMBER || !looks_like_number(word)) return false;
    memcpy(copy, word.at, word.length);
    copy[word.length] = 0;
    *value = strtod(copy, NULL);
    return true;
}

bool sadmm_word_integer(struct word word, int64_t *value)
{
    size_t k = 0;
    skip_sign(word, &k);
    const size_t from = k;
    if (skip_digits(word, &k) == 0 || k != word.length) return false;
    const bool negative = word.at[0] == '-';
    *value = 0;
    for (k = from; k < word.length; ++k) {
        const int digit = word.at[k] - '0';
        if (*value > (INT64_MAX - digit) / 10) {
            *value = negative ? INT64_MIN : INT64_MAX;
            return true;
        }
        *value = 10 * *value + digit;
    }
    if (negative) *value = -*value;
    return true;
}

const char *sadmm_word_quote(struct word word, char quote[QUOTE_SIZE])
{
    const size_t most = QUOTE_SIZE - 4, length = word.length < most ? word.length : most;
    for (size_t k = 0; k < length; ++k) quote[k] = (char)(word.at[k] >= ' ' && word.at[k] <= '~' ? word.at[k] : '?');
    memcpy(quote + length, word.length > most ? "..." : "", word.length > most ? 4 : 1);
    return quote;
}
