/* Runs of a scene in frames of its time step: with a step, a number of iterations, a backend. */
#ifndef BENCH_MOTION_RUN_H
#define BENCH_MOTION_RUN_H

#include "motion_measure.h"

/* How a row's steps are made. */
struct motion_setting {
    sadmm_backend backend;
    sadmm_precision precision;
    sadmm_method method;
    int device, threads;
    int halvings; /* of the scene's time step: 2^halvings steps a frame */
    int substeps; /* of each of them */
    int iterations;
};

struct motion_run {
    const struct sadmm_scene *scene;
    struct motion_setting setting;
    int frames;
    int seed;                      /* motion_world_open */
    const sadmm_body_state *start; /* NULL: the scene's own; else the run is led in from here */
    int lead_halvings;
    struct track *track;           /* (optional) poses of this run, as its run number `number`: equally far apart in */
    int number;                    /* time, the last at the end */
    struct motion_measure *measure; /* (optional) */
    double ms, timed;               /* out: wall time of steps, ms, of so many simulated seconds: all but the first
                                       frames, in which a world is laid out, and loaded onto a device */
    int threads;                    /* out: that worked on the last step */
    bool complete;                  /* out: not interrupted */
};

/* Runs that start from given states have no impulses to start with, unlike a step in the middle of a run. They are led
 * in: a few short steps on the CPU in double, the same for every setting, after which the setting takes over with the
 * poses and impulses that these have found. Errors: those of building and stepping. */
sadmm_status motion_run(struct motion_run *run, struct sadmm_error *error);

#endif
