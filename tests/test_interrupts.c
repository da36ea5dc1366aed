/* What is left of a run that is asked to end, or ended. */
#include <signal.h>

#include "commands.h"

/* A command in the background, its standard output and error in log.out and log.err. */
static pid_t start(const char *script)
{
    pid_t child = fork();
    ck_assert_int_ge(child, 0);
    if (child > 0) return child;
    char text[1024];
    snprintf(text, sizeof text, "exec %s" LOGGED, script);
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
    signal(SIGHUP, SIG_DFL); /* whoever started the tests may ignore it (nohup) */
    signal(SIGPIPE, SIG_DFL);
    execl("/bin/sh", "sh", "-c", text, (char *)NULL);
    _exit(127);
}

/* Until a condition of the shell holds. */
static void wait_until(pid_t child, const char *condition)
{
    int status;
    for (int k = 0; k < 6000; ++k) {
        if (sh("%s", condition) == 0) return;
        ck_assert_msg(waitpid(child, &status, WNOHANG) == 0, "it ended by itself, with status %d", status);
        usleep(10000);
    }
    ck_abort_msg("never: %s", condition);
}

/* Something is being written: from then on it listens. */
static void wait_for_part(pid_t child) { wait_until(child, "test -n \"$(find . -name '.*.part')\""); }

#ifdef SADMM_HAVE_HDF5
/* No signal waits for the process any more. */
static void wait_until_taken(pid_t child)
{
    char condition[80];
    snprintf(condition, sizeof condition, "! grep -q '^ShdPnd:.*[1-9a-f]' /proc/%d/status", (int)child);
    wait_until(child, condition);
}
#endif

static int end(pid_t child)
{
    int status;
    ck_assert_int_eq(waitpid(child, &status, 0), child);
    return status;
}

static void expect_exit(int status, int code)
{
    ck_assert_msg(WIFEXITED(status) && WEXITSTATUS(status) == code, "status %d, exit %d expected", status, code);
}

START_TEST(an_interrupted_run_reports)
{
    const int number = _i ? SIGTERM : SIGINT;
    pid_t child = start("$S run pile:300 --steps 100000000 --threads 1 --json r.json --trace t.csv "
                        "--contacts-csv c.csv --error-csv e.csv"
#ifdef SADMM_HAVE_HDF5
                        " --dump-problem 90000000:p.hdf5"
#endif
    );
    /* a step is 300 rows of some 200 bytes: after a few of them */
    wait_until(child, "test -n \"$(find . -name '.*.part' -size +300k)\"");
    kill(child, number);
    expect_exit(end(child), 128 + number);
    expect_in("log.err", "subadmm: interrupted");
    expect_in("log.out", "interrupted");
    json_t *r = read_json("r.json");
    long steps = (long)json_integer_value(json_object_get(r, "steps"));
    ck_assert(json_is_true(json_object_get(r, "interrupted")));
    ck_assert(json_is_null(json_object_get(r, "error")));
    ck_assert_int_gt(steps, 0);
    /* whole lines of whole steps */
    char *text = read_text("t.csv");
    long rows = -1, commas = 0;
    for (const char *c = text; *c; ++c) {
        commas += *c == ',';
        if (*c != '\n') continue;
        ck_assert_int_eq(commas, 15);
        commas = 0;
        ++rows;
    }
    ck_assert_int_eq(commas, 0);
    ck_assert_int_eq(rows, (steps + 1) * 300);
    ck_assert_int_eq(sh("test $(wc -l <e.csv) = %ld && tail -1 e.csv | grep -q '^%ld,'", steps + 1, steps), 0);
    ck_assert_int_eq(sh("test -z \"$(tail -c 1 c.csv)\" && ! grep -qv '^[^,]*\\(,[^,]*\\)\\{15\\}$' c.csv"), 0);
    ck_assert_int_eq(files_here(), 4); /* the step to dump was never reached */
#ifdef SADMM_HAVE_HDF5
    expect_in("log.err", "p.hdf5: not written");
#endif
    free(text);
    json_decref(r);
}
END_TEST

/* Wherever they are. */
START_TEST(other_runs_report_too)
{
    static const struct {
        const char *script, *result;
    } runs[] = {
        {"$S check pile:200 --steps 100000 --json r.json", "r.json"},
        {"$B kernels --seconds 600 --backend ref --contacts 1000 --json r.json", "r.json"},
        {"$B scaling --scene pile --sizes 300 --steps 100000 --max-seconds 80000 --backend cpu --csv r.csv", "r.csv"},
        {"$B convergence --only warm --scene pile:300 --seconds 3600 --max-seconds 80000 --csv r.csv", "r.csv"},
        {"$B motion --scene pile:300 --seconds 3600 --json r.json", "r.json"},
#ifdef SADMM_HAVE_HDF5
        {"$S solve p.hdf5 --tolerance 0 --max-iterations 1000000000 --json r.json --solution s.hdf5", "r.json"},
#endif
    };
#ifdef SADMM_HAVE_HDF5
    ck_assert_int_eq(sh("$S run pile:20 --steps 300 --quiet --dump-problem 300:p.hdf5"), 0);
#endif
    for (size_t k = 0; k < sizeof runs / sizeof *runs; ++k) {
        pid_t child = start(runs[k].script);
        wait_for_part(child);
        usleep(200000); /* some way into it; how far is all the same */
        ck_assert_int_eq(kill(child, SIGTERM), 0);
        int status = end(child);
        ck_assert_msg(WIFEXITED(status) && WEXITSTATUS(status) == 128 + SIGTERM, "%s: status %d", runs[k].script,
                      status);
        expect_in("log.err", "interrupted");
        if (strstr(runs[k].result, "json")) {
            json_t *r = read_json("r.json");
            ck_assert_msg(json_is_true(json_object_get(r, "interrupted")), "%s does not say so", runs[k].script);
            json_decref(r);
        }
        char *text = read_text(runs[k].result);
        ck_assert_int_eq(text[strlen(text) - 1], '\n');
        free(text);
    }
#ifdef SADMM_HAVE_HDF5
    ck_assert_int_eq(sh("$S solve s.hdf5 --tolerance 1 --quiet"), 0); /* what it has is a file */
#endif
    ck_assert_int_eq(sh("test -z \"$(find . -name '.*.part')\""), 0);
}
END_TEST

#ifdef SADMM_HAVE_HDF5
/* At once, in the middle of something long: a million iterations of the literal backend, which take minutes. */
START_TEST(a_second_signal_ends_at_once)
{
    int status;
    ck_assert_int_eq(sh("echo text >r.json && $S run pile:60 --steps 200 --quiet --dump-problem 200:p.hdf5"), 0);
    pid_t child = start("$S solve p.hdf5 --backend ref --tolerance 0 --check-period 1000000 --max-iterations 1000000 "
                        "--json r.json --solution s.hdf5");
    wait_for_part(child);
    kill(child, SIGINT);
    wait_until_taken(child); /* two that are pending would be one */
    ck_assert_int_eq(waitpid(child, &status, WNOHANG), 0); /* asked to end, it goes on to the next poll */
    kill(child, SIGINT);
    status = end(child);
    ck_assert_msg(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT, "status %d", status);
    expect_text("r.json", "text\n");
    ck_assert_int_eq(files_here(), 2);
}
END_TEST
#endif

/* Nobody reads any more; the terminal is gone. */
START_TEST(other_signals_leave_nothing)
{
    ck_assert_int_eq(sh("$S run pile:300 --steps 100000000 --trace - --json r.json 2>log.err | head -1 >log.out"), 0);
    ck_assert_int_eq(files_here(), 0);
    pid_t child = start("$S run pile:300 --steps 100000000 --trace t.csv");
    wait_for_part(child);
    kill(child, SIGHUP);
    int status = end(child);
    ck_assert(WIFSIGNALED(status) && WTERMSIG(status) == SIGHUP);
    ck_assert_int_eq(files_here(), 0);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("interrupts");
    TCase *tests = tcase_create("interrupts");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, make_folder, remove_folder);
    tcase_add_loop_test(tests, an_interrupted_run_reports, 0, 2);
    tcase_add_test(tests, other_runs_report_too);
    tcase_add_test(tests, other_signals_leave_nothing);
#ifdef SADMM_HAVE_HDF5
    tcase_add_test(tests, a_second_signal_ends_at_once);
#endif
    suite_add_tcase(suite, tests);
    return run_commands_suite(suite);
}
