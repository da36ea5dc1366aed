/* subadmm: simulate scenes, compare backends, solve contact problems from the command line. */
#include <string.h>

#include "cli.h"
#include "interrupt.h"
#include "output.h"

static const struct cli_command *const commands[] = {&cli_scenes, &cli_backends, &cli_settings,
                                                  &cli_run,    &cli_check,    &cli_solve};
enum { COMMAND_COUNT = sizeof commands / sizeof *commands };

static void print_overview(FILE *out)
{
    fputs("usage: subadmm COMMAND [options]\n\n"
          "Rigid bodies in exact frictional contact, solved by subsystem ADMM.\n\n"
          "commands:\n",
          out);
    for (size_t k = 0; k < COMMAND_COUNT; ++k) fprintf(out, "  %-10s%s\n", commands[k]->name, commands[k]->summary);
    fputs("\n  subadmm help COMMAND     the options of a command\n"
          "  subadmm --version        version, commit and compiler\n\n"
          "exit status: 0 done; 1 the simulation, solve or comparison failed, or an output could not be written;\n"
          "2 wrong usage; 130 or 143: interrupted (SIGINT, SIGTERM), with the results of what was done until then\n",
          out);
}

static const struct cli_command *find_command(const char *name)
{
    for (size_t k = 0; k < COMMAND_COUNT; ++k)
        if (strcmp(name, commands[k]->name) == 0) return commands[k];
    fprintf(stderr, "subadmm: unknown %s '%s'; valid:", name[0] == '-' ? "option" : "command", name);
    for (size_t k = 0; k < COMMAND_COUNT; ++k) fprintf(stderr, " %s", commands[k]->name);
    fputs(" help --help --version\n", stderr);
    return NULL;
}

static bool asks_for_help(const char *text)
{
    return strcmp(text, "help") == 0 || strcmp(text, "--help") == 0 || strcmp(text, "-h") == 0;
}

static int help(const char *name)
{
    const struct cli_command *command = name && !asks_for_help(name) ? find_command(name) : NULL;
    if (command) cli_print_help(command);
    else if (!name || asks_for_help(name)) print_overview(stdout);
    else return CLI_USAGE;
    return CLI_DONE;
}

static int run_command(int argc, char **argv)
{
    if (argc < 2) {
        print_overview(stderr);
        return CLI_USAGE;
    }
    if (asks_for_help(argv[1])) return help(argc > 2 ? argv[2] : NULL);
    if (strcmp(argv[1], "--version") == 0) {
        printf("subadmm %s (%s, %s)\n", sadmm_version(), sadmm_build_commit(), sadmm_build_compiler());
        return CLI_DONE;
    }
    const struct cli_command *command = find_command(argv[1]);
    return command ? command->run(argc - 1, argv + 1) : CLI_USAGE;
}

int main(int argc, char **argv)
{
    outputs_begin("subadmm");
    interrupts_begin();
    int code = outputs_end(run_command(argc, argv));
    if (interrupted()) cli_error(code, "interrupted");
    return interrupted_status(code);
}
