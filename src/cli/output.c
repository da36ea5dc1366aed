#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOST = 40, MOST_HOPS = 40 };

struct output {
    const char *option, *name;
    FILE *stream;               /* NULL: a library writes, or nobody any more */
    bool used, standard;        /* standard: stdout or stderr, which stay open */
    bool exists;                /* then `old` is what was there */
    struct stat old, folder;    /* of the target and its folder */
    const char *base;           /* the target's name in its folder */
    volatile sig_atomic_t part; /* `temporary` is, or may be, there */
    char target[PATH_MAX];      /* what is replaced; written directly where there is no part */
    char temporary[PATH_MAX];
};

static const char *program = "";
static struct output outputs[MOST];
static struct {
    dev_t device;
    ino_t inode;
} inputs[MOST];
static size_t input_count;

/* ---- messages ---------------------------------------------------------------------------------------------------- */

__attribute__((format(printf, 2, 3))) static int say(int code, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "%s: ", program);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    return code;
}

static int fail(const struct output *o, int why) { return say(1, "%s %s: %s", o->option, o->name, strerror(why)); }

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* Another name of an open file, which has a position of its own and may have no name: not to be replaced. */
static bool is_descriptor(const char *path)
{
    return strncmp(path, "/proc/", 6) == 0 || strncmp(path, "/dev/fd/", 8) == 0;
}

/* Where `name` leads through symbolic links, whether something is there or not; false with errno. */
static bool follow(const char *name, char path[PATH_MAX])
{
    char link[PATH_MAX];
    if (snprintf(path, PATH_MAX, "%s", name) >= PATH_MAX) {
        errno = ENAMETOOLONG;
        return false;
    }
    for (int hop = 0; hop < MOST_HOPS; ++hop) {
        if (is_descriptor(path)) return true;
        ssize_t length = readlink(path, link, sizeof link);
        if (length < 0) return errno == EINVAL || errno == ENOENT; /* no link, or not there yet */
        const char *slash = strrchr(path, '/');
        size_t head = link[0] == '/' || !slash ? 0 : (size_t)(slash - path) + 1;
        if (head + (size_t)length >= PATH_MAX) {
            errno = ENAMETOOLONG;
            return false;
        }
        memcpy(path + head, link, (size_t)length);
        path[head + (size_t)length] = 0;
    }
    errno = ELOOP;
    return false;
}

static bool same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

/* Would one overwrite the other, or be mixed with it? A device (/dev/null) takes what comes. */
static bool alike(const struct output *a, const struct output *b)
{
    if (a->standard || b->standard) return a->stream == b->stream;
    if (a->exists && b->exists && same(&a->old, &b->old)) return !S_ISCHR(a->old.st_mode);
    return a->part && b->part && same(&a->folder, &b->folder) && strcmp(a->base, b->base) == 0;
}

/* Everything the run reads or writes is known by device and inode where it is there, else by folder and name. */
static int check_others(const struct output *o)
{
    for (size_t k = 0; o->exists && k < input_count; ++k)
        if (o->old.st_dev == inputs[k].device && o->old.st_ino == inputs[k].inode)
            return say(2, "%s %s: is a file that is read: must be another", o->option, o->name);
    for (const struct output *p = outputs; p < outputs + MOST; ++p)
        if (p->used && p != o && alike(o, p))
            return say(2, "%s %s: is the same as %s %s: must be another", o->option, o->name, p->option, p->name);
    for (int fd = STDOUT_FILENO; o->part && o->exists && fd <= STDERR_FILENO; ++fd) {
        struct stat info;
        if (fstat(fd, &info) == 0 && same(&info, &o->old))
            return say(2, "%s %s: is where standard %s goes: must be another", o->option, o->name,
                       fd == STDOUT_FILENO ? "output" : "error");
    }
    return 0;
}

/* ---- opening ----------------------------------------------------------------------------------------------------- */

/* A pipe or a device, or a descriptor by its name: standard output where it is that. */
static int open_direct(struct output *o)
{
    struct stat info;
    FILE *const standard[] = {stdout, stderr};
    for (int k = 0; k < 2 && is_descriptor(o->target) && !o->stream; ++k)
        if (fstat(STDOUT_FILENO + k, &info) == 0 && same(&info, &o->old)) o->stream = standard[k];
    o->standard = o->stream != NULL;
    int code = check_others(o);
    if (code == 0 && !o->stream && !(o->stream = fopen(o->target, "ae"))) return fail(o, errno);
    return code;
}

/* A new file in the target's folder, with the mode that the target has or would get. */
static int open_part(struct output *o)
{
    const char *slash = strrchr(o->target, '/');
    int head = slash ? (int)(slash - o->target) + 1 : 0, file = -1;
    o->base = o->target + head;
    snprintf(o->temporary, sizeof o->temporary, "%.*s", head > 0 ? head : 1, head > 0 ? o->target : ".");
    if (stat(o->temporary, &o->folder) != 0) return fail(o, errno);
    if (o->exists && access(o->target, W_OK) != 0) return fail(o, errno);
    for (int attempt = 0; attempt < 100 && file < 0; ++attempt) {
        if (snprintf(o->temporary, sizeof o->temporary, "%.*s.subadmm-%ld-%d.part", head, o->target, (long)getpid(),
                     attempt) >= (int)sizeof o->temporary)
            return fail(o, ENAMETOOLONG);
        o->part = 1; /* before it is there: a signal may come between */
        file = open(o->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (file >= 0) break;
        o->part = 0;
        if (errno != EEXIST) break;
    }
    if (file < 0) return fail(o, errno);
    bool moded = !o->exists || fchmod(file, o->old.st_mode & 07777) == 0;
    if (moded && (o->stream = fdopen(file, "w"))) return check_others(o);
    int why = errno;
    close(file);
    return fail(o, why);
}

static int open_file(struct output *o, enum output_kind kind)
{
    if (!*o->name) return say(2, "%s '': must be the name of a file", o->option);
    if (kind == OUTPUT_STREAM && strcmp(o->name, "-") == 0) {
        o->standard = true;
        o->stream = stdout;
        return check_others(o);
    }
    if (!follow(o->name, o->target)) return fail(o, errno);
    o->exists = stat(o->target, &o->old) == 0;
    if (!o->exists && errno != ENOENT) return fail(o, errno);
    if (o->exists && S_ISDIR(o->old.st_mode)) return fail(o, EISDIR);
    bool direct = o->exists && (!S_ISREG(o->old.st_mode) || is_descriptor(o->target));
    if (direct && kind == OUTPUT_FILE)
        return say(1, "%s %s: is not a file: HDF5 cannot be written there", o->option, o->name);
    return direct ? open_direct(o) : open_part(o);
}

void output_drop(struct output *o)
{
    if (o->stream && !o->standard) fclose(o->stream);
    if (o->part) unlink(o->temporary);
    o->part = 0;
    memset(o, 0, sizeof *o);
}

int output_open(const char *option, const char *name, enum output_kind kind, struct output **out)
{
    struct output *o = outputs;
    *out = NULL;
    while (o < outputs + MOST && o->used) ++o;
    if (o == outputs + MOST) return say(2, "%s %s: must be one of %d outputs at most", option, name, MOST);
    *o = (struct output){.option = option, .name = name, .used = true};
    int code = open_file(o, kind);
    if (code == 0 && kind == OUTPUT_FILE) {
        int closed = fclose(o->stream);
        o->stream = NULL;
        if (closed != 0) code = fail(o, errno);
    }
    if (code == 0) *out = o;
    else output_drop(o);
    return code;
}

/* ---- writing and closing ----------------------------------------------------------------------------------------- */

FILE *output_stream(const struct output *o) { return o->stream; }

const char *output_path(const struct output *o) { return o->temporary; }

int output_close(struct output *o)
{
    if (!o) return 0;
    int code = 0;
    errno = 0; /* of a write that failed long ago nothing is known but that */
    if (o->stream) {
        bool good = fflush(o->stream) == 0 && !ferror(o->stream);
        if (!o->standard && fclose(o->stream) != 0) good = false;
        if (o->standard) clearerr(o->stream); /* said here, and not again at the end */
        o->stream = NULL;
        if (!good)
            code = say(1, "%s %s: could not be written%s%s", o->option, o->name, errno ? ": " : "",
                       errno ? strerror(errno) : "");
    }
    if (code == 0 && o->part) {
        if (rename(o->temporary, o->target) == 0) o->part = 0;
        else code = fail(o, errno);
    }
    output_drop(o);
    return code;
}

bool outputs_on_stdout(void)
{
    for (const struct output *o = outputs; o < outputs + MOST; ++o)
        if (o->used && o->stream == stdout) return true;
    return false;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

void outputs_begin(const char *name)
{
    program = name;
    /* A standard descriptor that is closed must not be given to the next file that is opened. Nothing can be written
     * to this one: what should have been is noticed at the end. */
    for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; ++fd)
        if (fcntl(fd, F_GETFD) < 0) (void)!open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

void outputs_protect(const char *path)
{
    struct stat info;
    if (input_count == MOST || stat(path, &info) != 0) return;
    inputs[input_count].device = info.st_dev;
    inputs[input_count++].inode = info.st_ino;
}

int outputs_end(int code)
{
    for (struct output *o = outputs; o < outputs + MOST; ++o)
        if (o->used) output_drop(o);
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout)) return code;
    say(1, "standard output could not be written%s%s", errno ? ": " : "", errno ? strerror(errno) : "");
    return code != 0 ? code : 1;
}

void outputs_abandon(void)
{
    for (const struct output *o = outputs; o < outputs + MOST; ++o)
        if (o->part) unlink(o->temporary);
}
