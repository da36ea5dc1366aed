/* subadmm-bench: one file a command, each prints a table and writes it to a file on request. */
#ifndef BENCH_BENCH_H
#define BENCH_BENCH_H

#include <stdbool.h>
#include <stdio.h>

#include "subadmm/settings.h"

int bench_kernels(int argc, char **argv);
int bench_scaling(int argc, char **argv);
int bench_convergence(int argc, char **argv);
int bench_precision(int argc, char **argv);
int bench_profile(int argc, char **argv);
int bench_ablation(int argc, char **argv);
int bench_stand(int argc, char **argv);
int bench_motion(int argc, char **argv);
int bench_rows(int argc, char **argv);
int bench_joints(int argc, char **argv);
int bench_shapes(int argc, char **argv);
int bench_queries(int argc, char **argv);
int bench_stress(int argc, char **argv);
int bench_environments(int argc, char **argv);

/* Measured bandwidth of memory with that many threads, GB/s (copy, read + write counted). */
double bench_memory_bandwidth(int threads);

/* The CPU's or the accelerator's name. */
void bench_runs_on(sadmm_backend backend, char *name, size_t size);
int bench_machine_threads(void);

/* Can a backend run in a precision? Else `notes` says why not. */
bool bench_is_available(sadmm_backend backend, sadmm_precision precision, FILE *notes);

/* Open a scene, or say on standard error why not. Returns 0, or the exit status: 2 for a name that is none, 1 for a
 * file. */
struct sadmm_scene;
int bench_open_scene(const char *command, const char *spec, struct sadmm_scene *scene);
int bench_scene_status(const char *spec); /* of one that could not be opened */
/* The same of all of them, closed again. */
int bench_check_scenes(const char *command, const char *const *scenes, int count);

/* A field of a CSV: quoted, on one line. */
void bench_write_csv_text(FILE *out, const char *text);
/* A scene: quoted where it is a path that makes it necessary. */
void bench_write_csv_scene(FILE *out, const char *spec);

int bench_compare_doubles(const void *a, const void *b);

#endif
