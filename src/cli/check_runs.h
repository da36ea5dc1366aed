/* Comparing backends with the literal one (ref, f64) on a scene.
 *
 * Three comparisons. "Run": every table simulates the scene on its own and its states are compared with ref's after
 * every step; contact detection and everything else is included, and differences feed on themselves. "One step": the
 * contact problems of some of ref's steps are frozen and every table solves the same problem with the same number of
 * iterations, so that a difference can only come from the solver. "Kernels": of these problems every kernel from
 * assembly to Step 4 runs once, from identical inputs, so that nothing has been amplified.
 */
#ifndef SADMM_CLI_CHECK_RUNS_H
#define SADMM_CLI_CHECK_RUNS_H

#include "cli.h"
#include "scenes/scenes.h"

enum { CHECK_MOST_FROZEN = 5 };

struct check_answer {
    double *v, *impulses;          /* (bodies x 6), (contacts x 3) */
    double v_scale, impulse_scale; /* largest entry of v and A^-1 b; of impulses */
};

struct check_frozen {
    sadmm_problem *problem;
    long step;               /* 1 is the first */
    double *start_v, *start_impulses, *start_lambda; /* what the step started from */
    struct check_answer whole, once; /* ref's, after the step's iterations and after one */
};

struct check_reference {
    const struct sadmm_scene *scene;
    long steps;
    size_t bodies;           /* all of the world's */
    double *gyration;        /* (bodies) largest radius of gyration, m; 0 for static bodies */
    double *states;          /* (steps x bodies x 13) after every step: position, 2 x gyration x quaternion, velocity,
                                gyration x angular velocity; all in m and m/s */
    double speed;            /* largest entry of any velocity of the run, or what gravity gives in a step, m/s */
    size_t frozen_count;
    struct check_frozen frozen[CHECK_MOST_FROZEN];
};

/* Largest differences from ref. */
struct check_difference {
    double position;         /* m, of all steps; rotations count times the radius of gyration */
    double velocity;         /* m/s, of all steps; angular velocities count times the radius of gyration */
    double step_velocity;    /* relative to v_scale, of all frozen problems */
    double step_impulse;     /* relative to impulse_scale */
    double kernel_velocity, kernel_impulse; /* the same after one iteration */
};

/* False with `error` filled. An interrupt ends both of these early; what they give is then not to be used. */
bool check_reference_make(struct check_reference *reference, const struct sadmm_scene *scene, long steps,
                          struct sadmm_error *error);
void check_reference_free(struct check_reference *reference);

bool check_table(const struct check_reference *reference, sadmm_backend backend, sadmm_precision precision,
                 struct check_difference *difference, struct sadmm_error *error);

#endif
