/* Total error against run time of a scene in motion: what `subadmm-bench motion` runs, and what it finds. */
#ifndef BENCH_MOTION_STUDY_H
#define BENCH_MOTION_STUDY_H

#include "bench_options.h"
#include "motion_run.h"

enum { MOST_HALVINGS = 10, MOST_ROWS = 2 * (MOST_HALVINGS + 1) * BENCH_LIST * (BENCH_LIST + 1) };

struct motion_plan {
    const char *spec;
    struct sadmm_scene scene; /* with the base time step */
    sadmm_backend backend;
    sadmm_method method;
    int precision; /* -1: both */
    int device, threads, halvings;
    int iterations[BENCH_LIST], iteration_count, match; /* match: iterations of the base step; 0: none */
    int substeps[BENCH_LIST], substep_count;
    int frames;         /* of a run */
    int seeds, repeats; /* runs a row */
    int starts, start_frames; /* heaps: states on one run, and how far trajectories are followed from each */
    int reference_halvings, reference_iterations;
};

struct motion_row {
    struct motion_setting setting;
    double dt;
    int substep_place; /* in the plan's list */
    struct track track; /* for the errors */
    struct motion_error total, solver, step; /* to the reference; to many iterations of the same step; of those to the
                                                reference */
    struct motion_measure measure;
    double *ms; /* of a simulated second: by seed, the least of its repeats */
    int runs;   /* done */
    double ms_median;
    int threads;
    bool front, best; /* no other row is faster and closer; least product of time and error */
    bool failed;
    char status[SADMM_MESSAGE_SIZE]; /* "ok", or "failed: why" */
};

struct motion_study {
    const struct motion_plan *plan;
    struct motion_row rows[MOST_ROWS];
    int row_count;
    struct track starts, reference, coarser; /* coarser: twice the reference's step */
    struct track solved[MOST_HALVINGS + 1][BENCH_LIST]; /* by halvings, and place in the list of sub-steps */
    struct motion_error floor; /* of coarser to reference */
    bool has_errors;
};

/* Everything, until it is done or the program is asked to end: then what there is. A row whose steps fail says so in
 * its status. Errors: of the scene, the reference and memory. */
sadmm_status motion_study_run(struct motion_study *study, const struct motion_plan *plan, struct sadmm_error *error);
void motion_study_free(struct motion_study *study);

/* Number of points on a run whose errors are measured, s apart. */
int motion_study_points(const struct motion_plan *plan);

#endif
