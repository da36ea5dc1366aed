#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "core/base/names.h"

enum { MOST_OPTIONS = 32, HELP_COLUMN = 28, FIRST_VALUE = 1000 /* of an option, for getopt: no character */ };

int cli_error(int code, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fputs("subadmm: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    return code;
}

/* ---- help -------------------------------------------------------------------------------------------------------- */

static bool value_is_optional(const struct cli_option *option)
{
    return option->value && option->value[0] == '[';
}

void cli_print_help(const struct cli_command *command)
{
    printf("usage: subadmm %s%s%s [options]\n\n%s\n", command->name, *command->operands ? " " : "", command->operands,
           command->summary);
    if (command->text) printf("\n%s", command->text);
    printf("\noptions:\n");
    for (size_t k = 0; k < command->option_count; ++k) {
        const struct cli_option *o = &command->options[k];
        int width = printf("  --%s%s%s", o->name, o->value ? " " : "", o->value ? o->value : "");
        printf("%*s%s\n", width < HELP_COLUMN ? HELP_COLUMN - width : 1, "", o->help);
    }
    printf("  -h, --help%*sthis text\n", HELP_COLUMN - 12, "");
}

/* ---- parsing ----------------------------------------------------------------------------------------------------- */

static int unknown_option(const struct cli_command *command, const char *text)
{
    fprintf(stderr, "subadmm: %s: unknown option '%s'; valid:", command->name, text);
    for (size_t k = 0; k < command->option_count; ++k) fprintf(stderr, " --%s", command->options[k].name);
    fprintf(stderr, " --help\n");
    return CLI_USAGE;
}

static void fill_getopt(const struct cli_command *command, struct option *options)
{
    for (size_t k = 0; k < command->option_count; ++k) {
        const struct cli_option *o = &command->options[k];
        options[k].name = o->name;
        options[k].has_arg = !o->value ? no_argument : value_is_optional(o) ? optional_argument : required_argument;
    }
    options[command->option_count].name = "help";
    for (size_t k = 0; k <= command->option_count; ++k) options[k].val = FIRST_VALUE + (int)k;
}

static int take_operands(const struct cli_command *command, int argc, char **argv, const char **operands)
{
    size_t count = (size_t)(argc - optind);
    for (size_t k = 0; k < command->operands_max; ++k) operands[k] = k < count ? argv[optind + (int)k] : NULL;
    if (count < command->operands_min)
        return cli_error(CLI_USAGE, "%s: %s is missing (subadmm %s --help)", command->name, command->operands,
                         command->name);
    if (count > command->operands_max)
        return cli_error(CLI_USAGE, "%s: unexpected argument '%s' (subadmm %s --help)", command->name,
                         argv[optind + (int)command->operands_max], command->name);
    return -1;
}

int cli_parse(const struct cli_command *command, int argc, char **argv, cli_set_option set, void *target,
              const char **operands)
{
    struct option options[MOST_OPTIONS + 2] = {{0}};
    int code;
    fill_getopt(command, options);
    optind = 1;
    opterr = 0;
    for (;;) {
        int at = optind;
        int found = getopt_long(argc, argv, ":h", options, NULL);
        if (found == -1) break;
        if (found == ':')
            return cli_error(CLI_USAGE, "%s: option '%s' needs a value, %s", command->name, argv[optind - 1],
                             command->options[optopt - FIRST_VALUE].value);
        if (found == '?' && optopt >= FIRST_VALUE)
            return cli_error(CLI_USAGE, "%s: option '%s' takes no value", command->name, argv[optind - 1]);
        if (found == '?') /* a bad short option leaves optind on its word until the word is used up */
            return unknown_option(command, optopt && optind == at ? argv[at] : argv[optind - 1]);
        size_t index = found == 'h' ? command->option_count : (size_t)(found - FIRST_VALUE);
        if (index == command->option_count) {
            cli_print_help(command);
            return CLI_DONE;
        }
        const char *value = optarg;
        /* "--json FILE" as well as "--json=FILE" and a bare "--json". */
        if (!value && value_is_optional(&command->options[index]) && optind < argc &&
            (argv[optind][0] != '-' || argv[optind][1] == 0))
            value = argv[optind++];
        if ((code = set(target, index, value)) != CLI_DONE) return code;
    }
    return take_operands(command, argc, argv, operands);
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* strtol and strtod skip blanks; a number starts with a digit, a sign or a point. */
static bool starts_like_a_number(const char *text)
{
    return *text && strchr("+-.0123456789", *text);
}

bool cli_read_int(const char *option, const char *text, long lo, long hi, long *out)
{
    char *end = NULL;
    errno = 0;
    long value = starts_like_a_number(text) ? strtol(text, &end, 10) : 0;
    if (end && end != text && *end == 0 && errno == 0 && value >= lo && value <= hi) {
        *out = value;
        return true;
    }
    cli_error(CLI_USAGE, "%s '%s': must be an integer in [%ld, %ld]", option, text, lo, hi);
    return false;
}

bool cli_read_real(const char *option, const char *text, double lo, double hi, double *out)
{
    char *end = NULL;
    double value = starts_like_a_number(text) ? strtod(text, &end) : 0;
    if (end && end != text && *end == 0 && isfinite(value) && value >= lo && value <= hi) {
        *out = value;
        return true;
    }
    cli_error(CLI_USAGE, "%s '%s': must be a number in [%g, %g]", option, text, lo, hi);
    return false;
}

bool cli_read_output(const char *option, const char *text, const char **out)
{
    const char *before = *out;
    *out = text ? text : "-";
    if (before) cli_error(CLI_USAGE, "%s '%s': must be given once, and was before with '%s'", option, *out, before);
    return !before;
}

const char *cli_backend_name(sadmm_backend backend)
{
    return (unsigned)backend < SADMM_BACKEND_COUNT ? sadmm_backend_names[backend] : "?";
}

const char *cli_precision_name(sadmm_precision precision)
{
    return (unsigned)precision < SADMM_PRECISION_COUNT ? sadmm_precision_names[precision] : "?";
}

const char *cli_method_name(sadmm_method method)
{
    return (unsigned)method < SADMM_METHOD_COUNT ? sadmm_method_names[method] : "?";
}

bool cli_read_name(const char *option, const char *text, const char *const *names, int count, int *out)
{
    char all[160] = "";
    size_t used = 0;
    for (int k = 0; k < count; ++k) {
        if (strcmp(text, names[k]) == 0) {
            *out = k;
            return true;
        }
        const char *const between = k == 0 ? "" : k < count - 1 ? ", " : " or ";
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", between, names[k]);
    }
    cli_error(CLI_USAGE, "%s '%s': must be %s", option, text, all);
    return false;
}

bool cli_read_backend(const char *option, const char *text, sadmm_backend *out)
{
    int k;
    if (!cli_read_name(option, text, sadmm_backend_names, SADMM_BACKEND_COUNT, &k)) return false;
    *out = (sadmm_backend)k;
    return true;
}

bool cli_read_precision(const char *option, const char *text, sadmm_precision *out)
{
    int k;
    if (!cli_read_name(option, text, sadmm_precision_names, SADMM_PRECISION_COUNT, &k)) return false;
    *out = (sadmm_precision)k;
    return true;
}

bool cli_read_method(const char *option, const char *text, sadmm_method *out)
{
    int k;
    if (!cli_read_name(option, text, sadmm_method_names, SADMM_METHOD_COUNT, &k)) return false;
    *out = (sadmm_method)k;
    return true;
}
