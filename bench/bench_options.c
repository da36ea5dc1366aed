#include "bench_options.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/output.h"
#include "scenes/scenes.h"

enum { MOST_OPTIONS = 32, HELP_COLUMN = 30, FIRST_VALUE = 1000 /* of an option, for getopt: no character */ };

const struct bench_word bench_backends[4] = {
    {"ref", SADMM_BACKEND_REF}, {"cpu", SADMM_BACKEND_CPU}, {"cuda", SADMM_BACKEND_CUDA}, {"all", SADMM_BACKEND_AUTO}};
const struct bench_word bench_precisions[3] = {{"f32", SADMM_F32}, {"f64", SADMM_F64}, {"both", -1}};
const struct bench_word bench_methods[3] = {{"paper", SADMM_METHOD_PAPER}, {"fast", SADMM_METHOD_FAST}, {"both", -1}};

const char *bench_word_of(const struct bench_word *words, int value)
{
    while (words->value != value) ++words;
    return words->word;
}

const char *bench_precision_name(sadmm_precision precision) { return bench_word_of(bench_precisions, (int)precision); }

int bench_bad_option(const char *command, const char *option, const char *value, const char *allowed)
{
    fprintf(stderr, "subadmm-bench %s: --%s %s: must be %s\n", command, option, value, allowed);
    return 2;
}

/* ---- values ---------------------------------------------------------------------------------------------------- */

static bool starts_like_a_number(const char *text) { return *text && strchr("+-.0123456789", *text); }

/* A whole number of the option's range up to `stop`, or the end of the text. */
static bool read_number(const struct bench_option *o, const char **text, char stop, long *to)
{
    char *end;
    if (!starts_like_a_number(*text)) return false;
    *to = strtol(*text, &end, 10);
    if (end == *text || (*end && *end != stop) || (double)*to < o->low || (double)*to > o->high) return false;
    *text = end;
    return true;
}

static bool read_numbers(const struct bench_option *o, const char *text)
{
    long *to = o->to;
    for (*o->count = 0; *o->count < BENCH_LIST; ++text) {
        if (!read_number(o, &text, ',', &to[*o->count])) return false;
        ++*o->count;
        if (!*text) return true;
    }
    return false;
}

static bool read_real(const struct bench_option *o, const char *text)
{
    char *end = NULL;
    const double number = starts_like_a_number(text) ? strtod(text, &end) : 0;
    if (!end || end == text || *end || !(number > 0 && number <= o->high)) return false;
    *(double *)o->to = number;
    return true;
}

static bool read_word(const struct bench_option *o, const char *text)
{
    for (int k = 0; k < o->word_count; ++k)
        if (!strcmp(text, o->words[k].word)) {
            *(int *)o->to = o->words[k].value;
            return true;
        }
    return false;
}

static bool read_value(const struct bench_option *o, const char *text)
{
    switch (o->kind) {
    case BENCH_IS_FLAG: *(bool *)o->to = true; return true;
    case BENCH_IS_TEXT: *(const char **)o->to = text; return true;
    case BENCH_IS_TEXTS:
        if (*o->count == BENCH_LIST) return false;
        ((const char **)o->to)[(*o->count)++] = text;
        return true;
    case BENCH_IS_NUMBER: return read_number(o, &text, 0, o->to);
    case BENCH_IS_NUMBERS: return read_numbers(o, text);
    case BENCH_IS_REAL: return read_real(o, text);
    case BENCH_IS_WORD: return read_word(o, text);
    }
    return false;
}

/* ---- what they may be ------------------------------------------------------------------------------------------ */

/* "ref, cpu or cuda", or with one separator everywhere: "ref|cpu|cuda". */
static void join_words(const struct bench_option *o, const char *between, const char *last, char *out, size_t size)
{
    size_t used = 0;
    out[0] = 0;
    for (int k = 0; k < o->word_count && used < size; ++k)
        used += (size_t)snprintf(out + used, size - used, "%s%s", k == 0 ? "" : k + 1 == o->word_count ? last : between,
                                 o->words[k].word);
}

static int refuse(const char *command, const struct bench_option *o, const char *text)
{
    char allowed[128] = "";
    switch (o->kind) {
    case BENCH_IS_FLAG:
    case BENCH_IS_TEXT: break;
    case BENCH_IS_TEXTS: snprintf(allowed, sizeof allowed, "given %d times at most", (int)BENCH_LIST); break;
    case BENCH_IS_NUMBER: snprintf(allowed, sizeof allowed, "in [%.0f, %.0f]", o->low, o->high); break;
    case BENCH_IS_NUMBERS:
        snprintf(allowed, sizeof allowed, "up to %d numbers in [%.0f, %.0f]", (int)BENCH_LIST, o->low, o->high);
        break;
    case BENCH_IS_REAL: snprintf(allowed, sizeof allowed, "in (0, %g]", o->high); break;
    case BENCH_IS_WORD: join_words(o, ", ", " or ", allowed, sizeof allowed); break;
    }
    return bench_bad_option(command, o->name, text, allowed);
}

/* The option that words without one are taken for; NULL: the command takes none. */
static const struct bench_option *find_scene(const struct bench_option *options, size_t count)
{
    for (size_t k = 0; k < count; ++k)
        if (!strcmp(options[k].name, "scene")) return &options[k];
    return NULL;
}

/* No output may be a file that is read: scene files, problem files. */
static void protect(const struct bench_option *o, const char *text)
{
    if ((!strcmp(o->name, "scene") && sadmm_scene_is_file(text)) || !strcmp(o->name, "fclib")) outputs_protect(text);
}

static int take_scenes(const char *command, const struct bench_option *scene, bool given, int argc, char **argv)
{
    for (int k = optind; k < argc; ++k, given = true) {
        if (!scene || (scene->kind == BENCH_IS_TEXT && given)) {
            fprintf(stderr, "subadmm-bench %s: unexpected argument \"%s\"\n", command, argv[k]);
            return 2;
        }
        if (!read_value(scene, argv[k])) return refuse(command, scene, argv[k]);
        protect(scene, argv[k]);
    }
    return 0;
}

static void usage(FILE *out, const char *command, const struct bench_option *options, size_t count, const char *more)
{
    const struct bench_option *scene = find_scene(options, count);
    const char *const operands = !scene ? "" : scene->kind == BENCH_IS_TEXT ? " [SCENE]" : " [SCENE...]";
    fprintf(out, "usage: subadmm-bench %s%s [options]\n\n", command, operands);
    for (size_t k = 0; k < count; ++k) {
        const struct bench_option *o = &options[k];
        char words[64];
        join_words(o, "|", "|", words, sizeof words);
        const char *value = o->value ? o->value : words;
        const int width = fprintf(out, "  --%s%s%s", o->name, *value ? " " : "", value);
        fprintf(out, "%*s%s\n", width < HELP_COLUMN ? HELP_COLUMN - width : 1, "", o->help);
    }
    if (scene)
        fprintf(out,
                "\nSCENE, the same as --scene: a name (subadmm scenes lists them), name:N or name:N:M; what ends in "
                ".json\nor has a / in it is a scene file.\n");
    if (more) fprintf(out, "\n%s", more);
}

int bench_parse(const char *command, const struct bench_option *options, size_t option_count, const char *more,
                int argc, char **argv)
{
    const struct bench_option *const scene = find_scene(options, option_count);
    struct option longs[MOST_OPTIONS + 2] = {{0}};
    bool scene_given = false;
    for (size_t k = 0; k < option_count; ++k)
        longs[k] = (struct option){options[k].name, options[k].kind != BENCH_IS_FLAG, NULL, FIRST_VALUE + (int)k};
    longs[option_count] = (struct option){"help", no_argument, NULL, 'h'};
    for (int found; (found = getopt_long(argc, argv, "h", longs, NULL)) != -1;) {
        if (found < FIRST_VALUE) {
            usage(found == 'h' ? stdout : stderr, command, options, option_count, more);
            return found == 'h' ? -1 : 2;
        }
        const struct bench_option *o = &options[found - FIRST_VALUE];
        if (!read_value(o, optarg)) return refuse(command, o, optarg);
        if (optarg) protect(o, optarg);
        scene_given = scene_given || o == scene;
    }
    return take_scenes(command, scene, scene_given, argc, argv);
}
