/* What both commands write: complete files or none, nothing over a file that is read or another output, links and modes
 * kept, a full disk said. */
#include <fcntl.h>
#include <stdbool.h>
#include <sys/stat.h>

#include "commands.h"

/* ---- what must not be written ------------------------------------------------------------------------------------ */

#ifdef SADMM_HAVE_HDF5
/* The same file under any name, of any option, of both commands. */
static const char *const over_inputs[] = {
    "$S solve p.hdf5 --json p.hdf5",
    "$S solve --json p.hdf5 p.hdf5",
    "$S solve p.hdf5 --json ./p.hdf5",
    "$S solve p.hdf5 --json hard.hdf5",
    "$S solve p.hdf5 --json soft.hdf5",
    "$S solve soft.hdf5 --json hard.hdf5",
    "$S solve p.hdf5 --solution p.hdf5",
    "$S solve p.hdf5 --solution soft.hdf5",
    "$S solve soft.hdf5 --solution p.hdf5",
    "$B convergence --only cold --problem none --fclib p.hdf5 --csv p.hdf5",
    "$B convergence --only cold --problem none --fclib soft.hdf5 --csv hard.hdf5",
};

START_TEST(no_output_is_an_input)
{
    ck_assert_int_eq(sh("$S run incline --steps 3 --quiet --dump-problem 3:p.hdf5"), 0);
    ck_assert_int_eq(sh("cp p.hdf5 kept && ln p.hdf5 hard.hdf5 && ln -s p.hdf5 soft.hdf5"), 0);
    for (size_t k = 0; k < sizeof over_inputs / sizeof *over_inputs; ++k) {
        int code = sh("%s" LOGGED, over_inputs[k]);
        ck_assert_msg(code == 2, "%s: exit status %d", over_inputs[k], code);
        expect_in("log.err", "is a file that is read: must be another");
        expect_text("log.out", "");
        ck_assert_msg(sh("cmp -s p.hdf5 kept") == 0, "%s: the problem is gone", over_inputs[k]);
    }
    ck_assert_int_eq(files_here(), 4);
}
END_TEST
#endif

static const struct {
    const char *script, *says;
} doubles[] = {
    {"$S run incline --steps 1 --json x --trace x", "--trace x: is the same as --json x: must be another"},
    {"$S run incline --steps 1 --trace x --contacts-csv x", "--contacts-csv x: is the same as --trace x"},
    {"$S run incline --steps 1 --error-csv to_x --contacts-csv x", "--error-csv to_x: is the same as --contacts-csv x"},
    {"$S run incline --steps 1 --error-csv - --contacts-csv -", "--error-csv -: is the same as --contacts-csv -"},
    {"$S run incline --steps 1 --error-csv a --error-csv b", "--error-csv 'b': must be given once"},
    {"$S run incline --steps 1 --json x --trace ./x", "--trace ./x: is the same as --json x"},
    {"$S run incline --steps 1 --json d/x --trace e/x", "--trace e/x: is the same as --json d/x"},
    {"$S run incline --steps 1 --json x --trace to_x", "--trace to_x: is the same as --json x"},
    {"$S run incline --steps 1 --json old --trace hard", "--trace hard: is the same as --json old"},
    {"$S run incline --steps 1 --json fifo --trace ./fifo", "is the same as"},
    {"$S run incline --steps 1 --json - --trace -", "--trace -: is the same as --json -"},
    {"$S run incline --steps 1 --json --trace /dev/stdout", "--trace /dev/stdout: is the same as --json -"},
    {"$S run incline --steps 1 --json a --json b", "--json 'b': must be given once, and was before with 'a'"},
    {"$S run incline --steps 1 --trace a --trace b", "--trace 'b': must be given once"},
    {"$S solve p.hdf5 --solution a --solution b", "--solution 'b': must be given once"},
    {"$S scenes --json a --json b", "--json 'b': must be given once"},
    {"$S run incline --steps 1 --json log.out", "--json log.out: is where standard output goes"},
    {"$S run incline --steps 1 --trace log.err", "--trace log.err: is where standard error goes"},
    {"$B scaling --sizes 10 --csv log.out", "--csv log.out: is where standard output goes"},
#ifdef SADMM_HAVE_HDF5
    {"$S run incline --steps 2 --json x --dump-problem 1:x", "--dump-problem x: is the same as --json x"},
    {"$S run incline --steps 2 --dump-problem 1:x --dump-problem 2:x", "is the same as --dump-problem x"},
    {"$S run incline --steps 2 --dump-problem 1:/dev/null", "/dev/null: is not a file"},
#endif
};
enum { DOUBLES = sizeof doubles / sizeof *doubles };

START_TEST(no_two_outputs_are_alike)
{
    ck_assert_int_eq(sh("mkdir d && ln -s d e && ln -s x to_x && echo text >old && ln old hard && mkfifo fifo"), 0);
    /* the pipe would wait for a reader: there is one */
    int pipe = open("fifo", O_RDONLY | O_NONBLOCK);
    int code = sh("%s" LOGGED, doubles[_i].script);
    bool refused = code == 2 || (code == 1 && strstr(doubles[_i].says, "/dev/null"));
    ck_assert_msg(refused, "%s: exit status %d", doubles[_i].script, code);
    expect_in("log.err", doubles[_i].says);
    expect_text("old", "text\n");
    ck_assert_int_eq(files_here(), 6);
    close(pipe);
}
END_TEST

#ifdef SADMM_HAVE_HDF5
START_TEST(every_dump_is_written)
{
    ck_assert_int_eq(sh("$S run incline --steps 9 --quiet --dump-problem 3:a.hdf5 --dump-problem 7:b.hdf5 "
                        "--dump-problem 7:c.hdf5"),
                     0);
    ck_assert_int_eq(files_here(), 3);
    ck_assert_int_eq(sh("cmp -s a.hdf5 b.hdf5"), 1);
    for (const char *name = "abc"; *name; ++name) ck_assert_int_eq(sh("$S solve %c.hdf5" LOGGED, *name), 0);
}
END_TEST
#endif

/* ---- what cannot be written -------------------------------------------------------------------------------------- */

static const struct {
    const char *script, *says;
} unwritable[] = {
    {"$S run pile:300 --steps 100000000 --json no/x", "--json no/x: No such file or directory"},
    {"$S run pile:300 --steps 100000000 --json old/x", "--json old/x: Not a directory"},
    {"$S run pile:300 --steps 100000000 --json d", "--json d: Is a directory"},
    {"$S run pile:300 --steps 100000000 --json ''", "--json '': must be the name of a file"},
    {"$S run pile:300 --steps 100000000 --json loop", "--json loop: Too many levels of symbolic links"},
    {"$S run pile:300 --steps 100000000 --json a --trace no/x", "--trace no/x: No such file or directory"},
    {"$S run pile:300 --steps 100000000 --json a --contacts-csv no/x", "--contacts-csv no/x: No such file"},
    {"$S run pile:300 --steps 100000000 --trace a --error-csv d", "--error-csv d: Is a directory"},
    {"$S run settled_pile:300000 --steps 100000000 --json no/x", "--json no/x: No such file or directory"},
    {"$S scenes settled_pile:300000 --json no/x", "--json no/x: No such file or directory"},
    {"$S check pile:300 --steps 100000 --json no/x", "--json no/x: No such file or directory"},
    {"$B scaling --csv no/x", "--csv no/x: No such file or directory"},
    {"$B convergence --csv no/x", "--csv no/x: No such file or directory"},
    {"$B kernels --json no/x", "--json no/x: No such file or directory"},
#ifdef SADMM_HAVE_HDF5
    {"$S run pile:300 --steps 100000000 --trace a --dump-problem 1:no/x", "--dump-problem no/x: No such file"},
#endif
};
enum { UNWRITABLE = sizeof unwritable / sizeof *unwritable };

/* Before the run, which would take hours, and nothing else is begun. */
START_TEST(is_said_before_the_run)
{
    ck_assert_int_eq(sh("mkdir d && echo text >old && ln -s loop loop"), 0);
    int code = sh("timeout 60 %s" LOGGED, unwritable[_i].script);
    ck_assert_msg(code == 1 || (code == 2 && strstr(unwritable[_i].says, "''")), "%s: exit status %d",
                  unwritable[_i].script, code);
    expect_in("log.err", unwritable[_i].says);
    expect_text("log.out", "");
    ck_assert_int_eq(files_here(), 3);
}
END_TEST

/* A disk that gets full is a limit of 2 blocks here: the file that was there stays, and nothing is left beside it. */
START_TEST(complete_or_not_there)
{
    static const char *const scripts[] = {
        "$S run incline --steps 200 --quiet --trace old",
        "$S run incline --steps 200 --quiet --contacts-csv old",
        "$S run incline --steps 200 --quiet --error-csv old",
        "$S run incline --steps 200 --quiet --json old",
        "$S scenes pile:100 --json old",
        "$B scaling --sizes 10,20,30,40,50 --steps 1 --threads 1 --backend cpu --precision both --csv old",
#ifdef SADMM_HAVE_HDF5
        "$S run pile:20 --steps 1 --quiet --dump-problem 1:old",
#endif
    };
    for (size_t k = 0; k < sizeof scripts / sizeof *scripts; ++k) {
        ck_assert_int_eq(sh("echo text >old"), 0);
        int code = sh("trap '' XFSZ; ulimit -f 2; exec %s >/dev/null 2>log.err", scripts[k]);
        ck_assert_msg(code == 1, "%s: exit status %d", scripts[k], code);
        expect_in("log.err", strstr(scripts[k], "dump") ? "(File too large)" : "could not be written");
        expect_text("old", "text\n");
        ck_assert_int_eq(files_here(), 1);
    }
    /* a run that fails for another reason */
    ck_assert_int_eq(sh("$S run incline --precision f32 --backend ref --json old --trace t.csv" LOGGED), 1);
    expect_text("old", "text\n");
    ck_assert_int_eq(files_here(), 1);
}
END_TEST

static const char *const says_something[] = {
    "$S --version",
    "$S --help",
    "$S -h",
    "$S help",
    "$S help run",
    "$S run -h",
    "$S scenes",
    "$S backends",
    "$S run incline --steps 1",
    "$S run incline --steps 1 --json",
    "$S run incline --steps 1 --trace -",
    "$S run incline --steps 1 --json /dev/stdout",
    "$S run incline --steps 100 --quiet --trace /dev/full",
    "$S run incline --steps 1 --quiet --json /dev/full",
    "$S run incline --steps 1 --error-csv -",
    "$S run incline --steps 100 --quiet --contacts-csv /dev/full",
    "$S check incline --steps 1",
    "$B --help",
    "$B -h",
    "$B help",
    "$B help scaling",
    "$B scaling -h",
    "$B scaling --sizes 10 --steps 1 --threads 1 --backend cpu",
    "$B scaling --sizes 10 --steps 1 --threads 1 --backend cpu --csv -",
    "$B scaling --sizes 10 --steps 1 --threads 1 --backend cpu --csv /dev/full",
    "$B kernels --contacts 1000 --seconds 0.01 --backend ref --json -",
    "$B convergence --only cold --problem cards --limit 1 --csv -",
    "$B stand --scene incline --steps 1 --threads 1",
};
enum { SAYINGS = sizeof says_something / sizeof *says_something };

START_TEST(a_full_disk_is_a_failure)
{
    static const char *const full[] = {">/dev/full", ">&-"};
    for (int k = 0; k < 2; ++k) {
        int code = sh("%s %s 2>log.err", says_something[_i], full[k]);
        bool other = strstr(says_something[_i], "/dev/full") || strstr(says_something[_i], "/dev/stdout");
        if (k == 1 && other) continue; /* closed, it has no such name, or it is not what the run writes to */
        ck_assert_msg(code == 1, "%s %s: exit status %d", says_something[_i], full[k], code);
        expect_in("log.err", "could not be written");
    }
    ck_assert_int_eq(sh("%s >log.out 2>log.err", strstr(says_something[_i], "/dev/full") ? "true" : says_something[_i]),
                     0);
}
END_TEST

/* ---- where it goes ----------------------------------------------------------------------------------------------- */

static mode_t mode_of(const char *path)
{
    struct stat info;
    ck_assert_msg(stat(path, &info) == 0, "%s is missing", path);
    return info.st_mode & 07777;
}

static bool is_link(const char *path)
{
    struct stat info;
    return lstat(path, &info) == 0 && S_ISLNK(info.st_mode);
}

START_TEST(links_and_modes_are_kept)
{
    ck_assert_int_eq(sh("mkdir d && ln -s d/far near && ln -s ../other d/far && echo old >other && chmod 640 other && "
                        "ln -s d/new dangling"),
                     0);
    /* through two links, in folders of their own, onto a file that is there */
    ck_assert_int_eq(sh("umask 022; $S run incline --steps 1 --quiet --json near"), 0);
    ck_assert(is_link("near") && is_link("d/far") && !is_link("other"));
    ck_assert_uint_eq(mode_of("other"), 0640);
    json_decref(read_json("other"));
    /* through a link to nothing yet: as the umask says */
    ck_assert_int_eq(sh("umask 027; $S run incline --steps 1 --quiet --trace dangling"), 0);
    ck_assert(is_link("dangling"));
    ck_assert_uint_eq(mode_of("d/new"), 0640);
    ck_assert_int_eq(
        sh("chmod 600 d/new && $B scaling --sizes 10 --steps 1 --threads 1 --backend cpu --csv dangling" LOGGED), 0);
    ck_assert(is_link("dangling"));
    ck_assert_uint_eq(mode_of("d/new"), 0600);
    expect_in("d/new", "sliding_cubes:10,cpu");
    ck_assert_int_eq(files_here(), 4);
#ifdef SADMM_HAVE_HDF5
    ck_assert_int_eq(sh("$S run incline --steps 1 --quiet --dump-problem 1:near"), 0);
    ck_assert_int_eq(sh("$S solve other --quiet --solution dangling"), 0);
    ck_assert(is_link("near") && is_link("dangling"));
    ck_assert_uint_eq(mode_of("other"), 0640);
    ck_assert_uint_eq(mode_of("d/new"), 0600);
    ck_assert_int_eq(sh("$S solve dangling --quiet"), 0);
#endif
}
END_TEST

/* Pipes, devices and standard output are written to as they are, and tables keep out of the latter. */
START_TEST(what_is_no_file_is_written_directly)
{
    ck_assert_int_eq(sh("mkfifo fifo && (cat fifo >got & $S run incline --steps 2 --quiet --json fifo; wait)"), 0);
    json_decref(read_json("got"));
    static const char *const names[] = {"-", "/dev/stdout", "/proc/self/fd/1", "/dev/fd/1"};
    for (size_t k = 0; k < sizeof names / sizeof *names; ++k) {
        ck_assert_int_eq(sh("$S run incline --steps 2 --json %s | cat >got", names[k]), 0);
        json_decref(read_json("got"));
        ck_assert_int_eq(sh("$S run incline --steps 2 --trace %s >got", names[k]), 0);
        ck_assert_int_eq(sh("$S run incline --steps 2 --trace t.csv --quiet && cmp t.csv got && rm t.csv"), 0);
        ck_assert_int_eq(sh("(echo first; $S scenes --json %s) >got", names[k]), 0); /* where the output is */
        expect_in("got", "first\n[");
    }
    ck_assert_int_eq(sh("$B scaling --sizes 10 --steps 1 --threads 1 --backend cpu --csv /dev/stdout >got 2>log.err"),
                     0);
    ck_assert_int_eq(sh("test $(wc -l <got) = 2"), 0);
    ck_assert_int_eq(sh("$B environments chain:1 --environments 1 --steps 1 --warm-up 1 --csv - >got 2>log.err"), 0);
    ck_assert_int_eq(sh("test $(wc -l <got) = 2"), 0);
    /* one that takes anything takes two */
    ck_assert_int_eq(sh("$S run incline --steps 2 --json /dev/null --trace /dev/null" LOGGED), 0);
    expect_in("log.out", "final state");
    ck_assert_int_eq(files_here(), 2);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("outputs");
    TCase *tests = tcase_create("outputs");
    tcase_set_timeout(tests, 120);
    tcase_add_checked_fixture(tests, make_folder, remove_folder);
    tcase_add_loop_test(tests, no_two_outputs_are_alike, 0, DOUBLES);
    tcase_add_loop_test(tests, is_said_before_the_run, 0, UNWRITABLE);
    tcase_add_test(tests, complete_or_not_there);
    tcase_add_loop_test(tests, a_full_disk_is_a_failure, 0, SAYINGS);
    tcase_add_test(tests, links_and_modes_are_kept);
    tcase_add_test(tests, what_is_no_file_is_written_directly);
#ifdef SADMM_HAVE_HDF5
    tcase_add_test(tests, no_output_is_an_input);
    tcase_add_test(tests, every_dump_is_written);
#endif
    suite_add_tcase(suite, tests);
    return run_commands_suite(suite);
}
