#include <ctype.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "bench_options.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "core/base/clock.h"
#include "core/base/parallel.h"
#include "core/base/processors.h"
#include "core/solve/schedule.h"
#include "scenes/scenes.h"

static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *description;
} commands[] = {
    {"kernels", bench_kernels, "ns per contact per iteration by backend, precision, threads and size"},
    {"scaling", bench_scaling, "ms per step of growing scenes, CPU by threads against GPU"},
    {"convergence", bench_convergence,
     "iterations and time to a tolerance, errors of warm steps: method against method"},
    {"precision", bench_precision, "error against run time of frozen problems, by backend, precision and method"},
    {"profile", bench_profile, "performance profiles over problem files, beside the solvers of siconos"},
    {"ablation", bench_ablation, "what each thing costs that a step does or leaves out, and what it gives"},
    {"stand", bench_stand, "does a structure stand for many steps, and what does a step cost"},
    {"motion", bench_motion, "total error against run time of scenes in motion, and how deep bodies overlap"},
    {"rows", bench_rows, "what one constraint given by rows costs an iteration of a scene"},
    {"shapes", bench_shapes, "what the manifold of a pair costs one core, by types of shapes"},
    {"queries", bench_queries, "what rays, overlaps and closest points of a scene cost"},
    {"joints", bench_joints, "motions and reactions of joints against reference tables"},
    {"environments", bench_environments, "many copies of a scene stepped together: time, error and memory of one"},
    {"stress", bench_stress, "extreme cases judged by physics: pass, or what limits them"},
};

static void usage(FILE *out)
{
    fprintf(out, "usage: subadmm-bench COMMAND [options]\n\n");
    for (size_t k = 0; k < sizeof commands / sizeof *commands; ++k)
        fprintf(out, "  %-12s %s\n", commands[k].name, commands[k].description);
    fprintf(out, "\nsubadmm-bench help COMMAND lists the options of one.\n"
                 "Exit status: 0 done; 1 something failed or could not be written; 2 wrong usage; 130 or 143:\n"
                 "interrupted (SIGINT, SIGTERM), with what was measured until then.\n");
}

static bool asks_for_help(const char *text)
{
    return !strcmp(text, "help") || !strcmp(text, "--help") || !strcmp(text, "-h");
}

static int run_command(int argc, char **argv)
{
    static char option[] = "--help";
    if (argc > 2 && asks_for_help(argv[1]) && !asks_for_help(argv[2])) /* help COMMAND: COMMAND --help */
        return run_command(3, (char *[]){argv[0], argv[2], option, NULL});
    if (argc >= 2 && asks_for_help(argv[1])) {
        usage(stdout);
        return 0;
    }
    for (size_t k = 0; argc >= 2 && k < sizeof commands / sizeof *commands; ++k)
        if (!strcmp(argv[1], commands[k].name)) {
            char name[64]; /* getopt's messages begin with it */
            snprintf(name, sizeof name, "subadmm-bench %s", commands[k].name);
            argv[1] = name;
            return commands[k].run(argc - 1, argv + 1);
        }
    if (argc >= 2) fprintf(stderr, "subadmm-bench: unknown command \"%s\"\n", argv[1]);
    usage(stderr);
    return 2;
}

int main(int argc, char **argv)
{
    outputs_begin("subadmm-bench");
    interrupts_expect(); /* every command checks for them */
    interrupts_begin();
    int code = outputs_end(run_command(argc, argv));
    if (interrupted()) fprintf(stderr, "subadmm-bench: interrupted\n");
    return interrupted_status(code);
}

void bench_write_csv_text(FILE *out, const char *text)
{
    putc('"', out);
    for (; *text; ++text) {
        if (*text == '"') putc('"', out);
        putc(*text == '\n' ? ' ' : *text, out);
    }
    putc('"', out);
}

void bench_write_csv_scene(FILE *out, const char *spec)
{
    if (strpbrk(spec, ",\"\r\n")) bench_write_csv_text(out, spec);
    else fputs(spec, out);
}

int bench_compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

struct copy {
    double *from, *to;
    size_t count;
    bool first; /* of the repeats: pages are touched by the thread that uses them */
};

static void copy_share(void *argument, int thread, int threads)
{
    const struct copy *c = argument;
    double *from = c->from, *to = c->to;
    size_t begin, end;
    sadmm_share(c->count, thread, threads, &begin, &end);
    for (size_t k = begin; k < end && c->first; ++k) from[k] = (double)k;
    for (size_t k = begin; k < end; ++k) to[k] = from[k];
}

double bench_memory_bandwidth(int threads)
{
    size_t count = (size_t)1 << 25; /* 256 MB each: out of every cache */
    struct copy copy = {malloc(count * sizeof(double)), malloc(count * sizeof(double)), count, true};
    double best = 0;
    if (copy.from && copy.to) {
        for (int repeat = 0; repeat < 5; ++repeat) {
            double begin = sadmm_clock_ms();
            copy.first = repeat == 0;
            sadmm_parallel(NULL, threads, copy_share, &copy);
            double rate = 16e-6 * (double)count / (sadmm_clock_ms() - begin);
            if (!copy.first && rate > best) best = rate;
        }
    }
    free(copy.from);
    free(copy.to);
    return best;
}

/* "model name" of the first core, else "CPU". */
static void cpu_name(char *name, size_t size)
{
    char line[256];
    snprintf(name, size, "CPU");
    FILE *file = fopen("/proc/cpuinfo", "r");
    if (!file) return;
    while (fgets(line, sizeof line, file)) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) || !colon) continue;
        for (++colon; isspace((unsigned char)*colon); ++colon) {}
        snprintf(name, size, "%.*s", (int)strcspn(colon, "\n"), colon);
        break;
    }
    fclose(file);
}

bool bench_is_available(sadmm_backend backend, sadmm_precision precision, FILE *notes)
{
    sadmm_backend_info info;
    if (sadmm_backend_query(backend, &info) == SADMM_OK && info.available[precision]) return true;
    fprintf(notes, "%s in %s: not available: %s\n", info.name, bench_precision_name(precision), info.reason);
    return false;
}

int bench_scene_status(const char *spec) { return sadmm_scene_is_file(spec) || sadmm_scene_is_model(spec) ? 1 : 2; }

int bench_open_scene(const char *command, const char *spec, struct sadmm_scene *scene)
{
    struct sadmm_error error;
    if (sadmm_scene_open(spec, scene, &error) == SADMM_OK) return 0;
    fprintf(stderr, "subadmm-bench %s: %s\n", command, error.message);
    return bench_scene_status(spec);
}

int bench_check_scenes(const char *command, const char *const *scenes, int count)
{
    struct sadmm_scene scene;
    for (int k = 0; k < count; ++k) {
        const int code = bench_open_scene(command, scenes[k], &scene);
        if (code) return code;
        sadmm_scene_close(&scene);
    }
    return 0;
}

int bench_machine_threads(void) { return sadmm_processors(); }

void bench_runs_on(sadmm_backend backend, char *name, size_t size)
{
    sadmm_backend_info info;
    if (backend != SADMM_BACKEND_CUDA) cpu_name(name, size);
    else snprintf(name, size, "%.100s", sadmm_backend_query(backend, &info) == SADMM_OK ? info.reason : "?");
}
