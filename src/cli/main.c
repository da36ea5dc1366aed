/* subadmm: simulate scenes, compare backends, solve contact problems from the command line. */
#include <string.h>

#include "cli.h"

static const struct cli_command *const commands[] = {&cli_scenes, &cli_backends, &cli_run, &cli_check, &cli_solve};
enum { COMMAND_COUNT = sizeof commands / sizeof *commands };

static void print_overview(FILE *out)
{
    fputs("usage: subadmm COMMAND [options]\n\n"
          "Rigid bodies in exact frictional contact, solved by subsystem ADMM.\n\n"
          "commands:\n",
          out);
    for (size_t k = 0; k < COMMAND_COUNT; ++k) fprintf(out, "  %-10s%s\n", commands[k]->name, commands[k]->summary);
    fputs("\n  subadmm COMMAND --help   the options of a command\n"
          "  subadmm --version        version, commit and compiler\n\n"
          "exit status: 0 done; 1 the simulation, solve or comparison failed; 2 wrong usage\n",
          out);
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : NULL;
    if (!name) {
        print_overview(stderr);
        return CLI_USAGE;
    }
    if (strcmp(name, "--help") == 0 || strcmp(name, "help") == 0) {
        print_overview(stdout);
        return CLI_DONE;
    }
    if (strcmp(name, "--version") == 0) {
        printf("subadmm %s (%s, %s)\n", sadmm_version(), sadmm_build_commit(), sadmm_build_compiler());
        return CLI_DONE;
    }
    for (size_t k = 0; k < COMMAND_COUNT; ++k)
        if (strcmp(name, commands[k]->name) == 0) {
            int code = commands[k]->run(argc - 1, argv + 1);
            /* A full disk behind a pipe or a redirection is a failure, not a shorter answer. */
            if (fflush(stdout) != 0 || ferror(stdout))
                return cli_error(CLI_FAILED, "standard output could not be written");
            return code;
        }
    fprintf(stderr, "subadmm: unknown %s '%s'; valid:", name[0] == '-' ? "option" : "command", name);
    for (size_t k = 0; k < COMMAND_COUNT; ++k) fprintf(stderr, " %s", commands[k]->name);
    fputs(" --help --version\n", stderr);
    return CLI_USAGE;
}
