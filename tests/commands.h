/* Both commands, run by the shell in a folder of its own, and what they leave there. */
#ifndef TESTS_COMMANDS_H
#define TESTS_COMMANDS_H

#include <check.h>
#include <jansson.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "config.h"
#include "text_file.h"

static char folder[64];

static inline void make_folder(void)
{
    strcpy(folder, "/tmp/test_commands_XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
    ck_assert_int_eq(chdir(folder), 0);
    ck_assert_int_eq(setenv("S", SUBADMM_COMMAND, 1), 0);
    ck_assert_int_eq(setenv("B", SUBADMM_BENCH, 1), 0);
}

static inline void remove_folder(void)
{
    char text[128];
    snprintf(text, sizeof text, "rm -rf %s", folder);
    ck_assert_int_eq(chdir("/"), 0);
    ck_assert_int_eq(system(text), 0);
}

/* The shell has the commands in $S and $B. Returns the exit status of the script. */
__attribute__((format(printf, 1, 2))) static inline int sh(const char *format, ...)
{
    char text[2048];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    int status = system(text);
    ck_assert_msg(WIFEXITED(status), "%s: status %d", text, status);
    return WEXITSTATUS(status);
}

static inline char *read_text(const char *path)
{
    char *text = read_text_if_there(path);
    ck_assert_msg(text != NULL, "%s: cannot be read", path);
    return text;
}

static inline void expect_text(const char *path, const char *wanted)
{
    char *text = read_text(path);
    ck_assert_str_eq(text, wanted);
    free(text);
}

static inline void expect_in(const char *path, const char *part)
{
    char *text = read_text(path);
    ck_assert_msg(strstr(text, part) != NULL, "no '%s' in %s:\n%s", part, path, text);
    free(text);
}

static inline json_t *read_json(const char *path)
{
    json_error_t error;
    json_t *root = json_load_file(path, 0, &error);
    ck_assert_msg(root != NULL, "%s, line %d: %s", path, error.line, error.text);
    return root;
}

/* Hidden ones too: what is half written has a name of its own. */
static inline int files_here(void)
{
    ck_assert_int_eq(sh("ls -A | grep -v '^log\\.' | wc -l >log.count"), 0);
    char *text = read_text("log.count");
    int count = atoi(text);
    free(text);
    return count;
}

#define LOGGED " >log.out 2>log.err"

/* The main of such a program. */
static inline int run_commands_suite(Suite *suite)
{
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}

#endif
