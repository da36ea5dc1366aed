/* The `subadmm` command: what its subcommands share. A subcommand is one file, cmd_<name>.c, that fills a
 * struct cli_command. Messages go to stderr as "subadmm: ..."; results go to stdout.
 */
#ifndef SADMM_CLI_H
#define SADMM_CLI_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/base/error.h"
#include "output.h"
#include "subadmm/subadmm.h"

/* Exit codes; an interrupted run has its own (interrupt.h). */
enum { CLI_DONE = 0, CLI_FAILED = 1, CLI_USAGE = 2 };

/* ---- subcommands and their options (options.c) ------------------------------------------------------------------- */

struct cli_option {
    const char *name;
    const char *value; /* what --help shows: NULL for a flag, "[FILE|-]" (in brackets) when it may be left out */
    const char *help;
};

struct cli_command {
    const char *name;
    const char *operands;     /* "SCENE" */
    const char *summary;      /* one line */
    const char *text;         /* more for --help; may be NULL */
    const struct cli_option *options;
    size_t option_count;
    size_t operands_min, operands_max;
    int (*run)(int argc, char **argv);
};

extern const struct cli_command cli_scenes, cli_backends, cli_settings, cli_run, cli_check, cli_solve;

/* Called for every option, `index` into command->options; value NULL where none was given. CLI_DONE to go on. */
typedef int (*cli_set_option)(void *target, size_t index, const char *value);

/* Parse argv after the subcommand. Returns -1 to go on, else the exit code (after --help or a mistake).
 * operands[0 .. operands_max) are filled, NULL where not given. */
int cli_parse(const struct cli_command *command, int argc, char **argv, cli_set_option set, void *target,
              const char **operands);

void cli_print_help(const struct cli_command *command);

/* Whole strings only, no blanks; a message that names the option and the range. False: CLI_USAGE. */
bool cli_read_int(const char *option, const char *text, long lo, long hi, long *out);
bool cli_read_real(const char *option, const char *text, double lo, double hi, double *out);
/* One of `count` names: its number. */
bool cli_read_name(const char *option, const char *text, const char *const *names, int count, int *out);
bool cli_read_backend(const char *option, const char *text, sadmm_backend *out);
bool cli_read_precision(const char *option, const char *text, sadmm_precision *out);
bool cli_read_method(const char *option, const char *text, sadmm_method *out);

/* NAME=VALUE of any setting into `settings`, which a world checks (cmd_settings.c). */
bool cli_read_setting(const char *text, sadmm_settings *settings);

/* The name of an output, "-" where none is given. False when the option was given before: nothing is dropped in
 * silence. */
bool cli_read_output(const char *option, const char *text, const char **out);

const char *cli_backend_name(sadmm_backend backend);
const char *cli_precision_name(sadmm_precision precision);
const char *cli_method_name(sadmm_method method);

/* "subadmm: message" on stderr; returns `code` for `return cli_error(...)`. */
__attribute__((format(printf, 2, 3))) int cli_error(int code, const char *format, ...);

/* ---- JSON (json.c) ----------------------------------------------------------------------------------------------- */

/* null for what is not a finite number (JSON has no NaN), and for what was not measured. */
json_t *cli_json_real(double x);
json_t *cli_json_reals(const double *x, size_t count);
/* "cpu: Intel ...": what a table of that backend runs on; null when it is unknown. */
json_t *cli_json_device(sadmm_backend backend);
/* commit, compiler and version of the library. */
void cli_json_add_build(json_t *object);
json_t *cli_json_settings(const sadmm_settings *settings);

/* The output of --json; NULL where `name` is. Returns an exit code. */
int cli_open_json(const char *name, struct output **output);
/* Write, close the output and release `object`. Returns an exit code. */
int cli_write_json(json_t *object, struct output *output);

#endif
