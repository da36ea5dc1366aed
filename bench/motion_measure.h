/* What is measured of runs in motion: overlaps of all pairs at all frames, moments of the whole at a few times, and
 * distances between trajectories. */
#ifndef BENCH_MOTION_MEASURE_H
#define BENCH_MOTION_MEASURE_H

#include <stdint.h>

#include "depth_counts.h"
#include "motion_world.h"

enum { COURSE_POINTS = 12 };

/* Sums over the runs that were added. */
struct motion_measure {
    struct depth_counts depths;
    int64_t frames;
    struct motion_moments course[COURSE_POINTS]; /* the k-th at (k + 1) / COURSE_POINTS of the run */
    int runs[COURSE_POINTS];                     /* that got there */
    struct overlaps overlaps;
};
/* The world after frame `frame` of `frames` (1, 2, ...). */
sadmm_status motion_measure_frame(struct motion_measure *m, const struct motion_world *w, int frame, int frames);
void motion_measure_free(struct motion_measure *m);

/* Distances between poses (pose_distance), m; NAN: nothing to compare. */
struct motion_error {
    double median, largest;
};
struct motion_error motion_error_none(void);
/* m: bodies that move by less are not in the median. */
extern const double motion_least;

/* Poses along runs of the same scene: `points` times a run, body_count states each, `runs` of them. Starts with these
 * two numbers and the rest zero; motion_run does what else there is to do. */
struct track {
    int runs, points, body_count;
    struct moving_body *bodies;
    sadmm_body_state *start;  /* of each run */
    sadmm_body_state *states; /* [run][point][body] */
};
/* Memory for the bodies of that world. */
sadmm_status track_create(struct track *track, const struct motion_world *w);
void track_free(struct track *track);
sadmm_body_state *track_states(const struct track *track, int run, int point);

/* A body's error is the largest at any point of a run. Median of the bodies that `reference` moves by more than a
 * millimetre between the run's start and any point, largest of all; over all runs. */
sadmm_status track_compare(const struct track *track, const struct track *reference, struct motion_error *out,
                           struct sadmm_error *error);

#endif
