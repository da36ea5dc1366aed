/* A scene, and what is known of how it went. */
#ifndef SADMM_SCENES_SCENE_H
#define SADMM_SCENES_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "subadmm/world.h"

struct sadmm_scene_info {
    const char *name;
    const char *arguments;   /* what may follow the name: "[:N]", "[:N[:M]]", or "" */
    const char *description; /* one line */
    double duration;         /* s, simulated time the scene is meant to be run for */
    int iterations[SADMM_METHOD_COUNT]; /* a step, by method */
    int substeps;            /* of a step of `fast`, which share its iterations; 0: one, as in `paper` */
    bool chaotic; /* trajectories that differ by rounding part within the duration: only statistics can be compared */
};

struct sadmm_scene_loaded; /* what a scene has that was read from a file */

/* An opened spec, or file. */
struct sadmm_scene {
    sadmm_world_def def;                /* the scene's settings; the caller may change them before building */
    double duration;                    /* s */
    const struct sadmm_scene_info *info;
    long n;                             /* the N of "name:N", or the scene's default */
    long m;                             /* the M of "name:N:M", or the scene's default; 0: the scene takes none */
    struct sadmm_scene_loaded *loaded;  /* NULL: a scene of the library */
};

enum { SADMM_SCENE_MOST_TASKS = 8, SADMM_SCENE_MOST_FIGURES = 4, SADMM_SCENE_MEMORY = 64 };

struct sadmm_scene_figure {
    const char *name, *unit; /* static storage */
    double value;
};

struct sadmm_scene_task {
    const char *name; /* static storage */
    struct sadmm_scene_figure figures[SADMM_SCENE_MOST_FIGURES];
    int figure_count;
    bool finished; /* the run has come to where the task is judged */
    bool passed;   /* finished, and as it should be */
};

/* Belongs to one run of one world; zeroed before its first step. */
struct sadmm_scene_result {
    struct sadmm_scene_task tasks[SADMM_SCENE_MOST_TASKS];
    int task_count; /* 0: the scene has no measure of success */
    double memory[SADMM_SCENE_MEMORY]; /* what the scene has to remember from one step to another; its own */
};

#endif
