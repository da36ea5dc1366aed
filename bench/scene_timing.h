/* The steps of a scene, timed one by one. */
#ifndef BENCH_SCENE_TIMING_H
#define BENCH_SCENE_TIMING_H

#include "scenes/scenes.h"

struct scene_timing_plan {
    int warm_up;    /* steps before the timed ones */
    int steps;      /* timed steps */
    int certified;  /* further steps, not timed, whose certificates are measured */
    double seconds; /* no timed step is begun after that much time, the building of the world included */
    sadmm_status (*change)(sadmm_world *); /* of the world before its first step; NULL: none */
};

struct scene_timing {
    sadmm_step_report last; /* of the last timed step */
    int steps;              /* timed ones; fewer than planned when time ran out, 0: it ran out before the first */
    sadmm_phase_times ms;   /* medians over the timed steps, each by itself */
    double solver_ms;       /* median of all but finding contacts: what the paper's Table I calls solving */
    double build_s, slowest_step_s; /* of making the world; of all steps */
    uint64_t state_hash;            /* after the last timed step */
    int certified;                  /* steps whose worst errors follow */
    double ncp_max, momentum_max;
};

/* Build the scene and step it, until all is done or the program is asked to end (cli/interrupt.h). Errors: those of
 * building and stepping. */
sadmm_status scene_timing_run(const struct sadmm_scene *scene, const struct scene_timing_plan *plan,
                              struct scene_timing *timing, struct sadmm_error *error);

#endif
