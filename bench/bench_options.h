/* Options of the benchmarks: a command has one table of them, from which come its --help, the parsing and the
 * messages. */
#ifndef BENCH_OPTIONS_H
#define BENCH_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>

#include "subadmm/settings.h"

enum { BENCH_LIST = 16 }; /* most numbers of a list, and most times an option is given */

/* A word and what it stands for. */
struct bench_word {
    const char *word;
    int value;
};

/* ref, cpu, cuda, all (SADMM_BACKEND_AUTO); the first three alone: BENCH_ONE_BACKEND words. */
extern const struct bench_word bench_backends[4];
/* f32, f64, both (-1); the first two alone: BENCH_ONE_PRECISION words. */
extern const struct bench_word bench_precisions[3];
/* paper, fast, both (-1); the first two alone: BENCH_ONE_METHOD words. */
extern const struct bench_word bench_methods[3];
enum { BENCH_ONE_BACKEND = 3, BENCH_ONE_PRECISION = 2, BENCH_ONE_METHOD = 2 };

enum bench_kind {
    BENCH_IS_FLAG, BENCH_IS_TEXT, BENCH_IS_TEXTS, BENCH_IS_NUMBER, BENCH_IS_NUMBERS, BENCH_IS_REAL, BENCH_IS_WORD
};

struct bench_option {
    const char *name, *value, *help; /* value: what --help calls it; NULL: the words, or none */
    enum bench_kind kind;
    void *to;                        /* where the value goes */
    int *count;                      /* of texts and numbers */
    double low, high;                /* of numbers; of reals (0, high] */
    const struct bench_word *words;
    int word_count;
};

#define BENCH_FLAG(name, to, help) {name, NULL, help, BENCH_IS_FLAG, to, NULL, 0, 0, NULL, 0}
#define BENCH_TEXT(name, value, to, help) {name, value, help, BENCH_IS_TEXT, to, NULL, 0, 0, NULL, 0}
#define BENCH_TEXTS(name, value, to, count, help) {name, value, help, BENCH_IS_TEXTS, to, count, 0, 0, NULL, 0}
#define BENCH_NUMBER(name, to, low, high, help) {name, "N", help, BENCH_IS_NUMBER, to, NULL, low, high, NULL, 0}
#define BENCH_NUMBERS(name, to, count, low, high, help) \
    {name, "N[,N...]", help, BENCH_IS_NUMBERS, to, count, low, high, NULL, 0}
#define BENCH_REAL(name, value, to, high, help) {name, value, help, BENCH_IS_REAL, to, NULL, 0, high, NULL, 0}
#define BENCH_WORD(name, to, words, word_count, help) \
    {name, NULL, help, BENCH_IS_WORD, to, NULL, 0, 0, words, word_count}

/* Read a command's arguments into where its options point to: bool, const char * (texts: BENCH_LIST of them), long
 * (numbers: BENCH_LIST of them), double, int. Where there is an option "scene", words without an option are scenes,
 * too; the files of these and of "fclib" are protected from outputs. `more`: what --help says after the options, or
 * NULL. Returns 0 to go on, -1 after --help, 2 after wrong usage, which was named on standard error. */
int bench_parse(const char *command, const struct bench_option *options, size_t option_count, const char *more,
                int argc, char **argv);

/* The word for a value: "cpu", "f32", "fast". */
const char *bench_word_of(const struct bench_word *words, int value);
const char *bench_precision_name(sadmm_precision precision);

/* Says on standard error what the value must be; returns the exit status of wrong usage. */
int bench_bad_option(const char *command, const char *option, const char *value, const char *allowed);

#endif
