/* Solver settings and reports shared by the problem level (problem.h) and the world level (world.h). */
#ifndef SUBADMM_SETTINGS_H
#define SUBADMM_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Arithmetic of the solver. Poses are kept in double in both; velocities and impulses are in this precision. */
typedef enum sadmm_precision { SADMM_F32 = 0, SADMM_F64 = 1 } sadmm_precision;

/* Where a solve runs. AUTO picks among the available ones and says why (sadmm_world_explain). */
typedef enum sadmm_backend {
    SADMM_BACKEND_AUTO = 0,
    SADMM_BACKEND_REF,  /* the paper's Steps 1-4 with x, z, u, naive, double only: the oracle */
    SADMM_BACKEND_CPU,  /* OpenMP, reduced form */
    SADMM_BACKEND_CUDA, /* NVIDIA GPUs */
    SADMM_BACKEND_COUNT
} sadmm_backend;

/* The iteration that solves the contact problem; both have the same solutions (docs/internals/algorithm.md). Default:
 * FAST. */
typedef enum sadmm_method {
    SADMM_METHOD_PAPER = 0, /* one penalty weight a body, eqs. (13) to (15) */
    SADMM_METHOD_FAST,      /* one weight a constraint, from the load it carries, and over-relaxation */
    SADMM_METHOD_COUNT
} sadmm_method;

/* What a build and this machine can do. It may grow (status.h). */
typedef struct sadmm_backend_info {
    sadmm_backend backend;
    const char *name;       /* "ref", "cpu", "cuda" */
    bool available[2];      /* by sadmm_precision */
    const char *reason;     /* why it is (partly) unavailable, or what it runs on; never NULL; static storage */
} sadmm_backend_info;

/* Describe one backend. `backend` in [SADMM_BACKEND_REF, SADMM_BACKEND_COUNT).
 * Errors: INVALID_ARGUMENT. Thread-safe. */
SADMM_API sadmm_status sadmm_backend_query_sized(sadmm_backend backend, sadmm_backend_info *info, size_t size);
static inline sadmm_status sadmm_backend_query(sadmm_backend backend, sadmm_backend_info *info)
{
    return sadmm_backend_query_sized(backend, info, sizeof *info);
}

/* The largest sadmm_settings.substeps. */
enum { SADMM_MOST_SUBSTEPS = 64 };

/* The largest sadmm_settings.ncp_points. */
enum { SADMM_MOST_NCP_POINTS = 128 };

/* The largest sadmm_settings.hits. */
enum { SADMM_MOST_HITS = 64 };

/* Settings of a solve. Start from sadmm_settings_default(); a struct is validated when it is handed over.
 * Symbols are the paper's (Sec. III-D). "kg/s^2" values are the paper's time-scaled units; the solver works
 * in impulses and converts (beta_impulse = dt^2 beta_paper, docs/internals/algorithm.md). */
typedef struct sadmm_settings {
    size_t struct_size;          /* set by sadmm_settings_default() */
    double dt;                   /* time step, s, in [1e-6, 1]; default 0.005. It may change from step to step. Joints
                                    that turn by more than 0.1 rad in a step lose energy (docs/internals/algorithm.md,
                                    "Large turns") */
    int substeps;                /* of a world's step, in [1, SADMM_MOST_SUBSTEPS = 64], dt / substeps >= 1e-6 s;
                                    default 1. A step is made of so many sub-steps of dt / substeps with a share of
                                    `iterations` each, so that bodies in motion overlap less (docs/guide/choose.md).
                                    Pairs of shapes that may touch are searched for once a step, all else is done in
                                    every sub-step: states are those of `substeps` steps of dt / substeps, for less.
                                    External wrenches act through all of them. What is read of a step: world.h. Problems
                                    have none */
    double gravity[3];           /* m/s^2, world frame, finite, norm <= 1e6; default (0, 0, -9.81) */

    sadmm_method method;         /* default SADMM_METHOD_FAST: the same solutions in fewer iterations that cost the same
                                    (docs/internals/accuracy.md). PAPER is the paper's own iteration, to compare with;
                                    it needs more iterations, below, and takes the penalty_* settings */
    double tolerance;            /* error at which a step is solved, m/s: iterations end where every island's natural
                                    map and momentum error, as a velocity, are at most this (sadmm_step_report.error).
                                    Finite, >= 0; default 1e-6. 0: all `iterations` are made. In single precision no
                                    less than rounding leaves, some 2e-6 of the speeds of an island */
    int iterations;              /* iterations a step at most, in [1, 1000000]; sub-steps do iterations / substeps each,
                                    rounded up; default 200. With tolerance 0 this is their number: 20 are enough for
                                    FAST in most worlds, where every step is warm started; PAPER: 100 to 300 */
    double relaxation;           /* FAST: over-relaxation rho, dimensionless, in [1, 2); default 1.8
                                    (docs/internals/algorithm.md, "Method fast") */
    int penalty_period;          /* PAPER, as all of penalty_*. m of eq. (15): iterations between penalty updates,
                                    0 = never; default 30 */
    double penalty_mass_factor;  /* M of eq. (13), dimensionless, in [0, 1e12]; default 16 */
    double penalty_offset;       /* c of eq. (13), kg/s^2, in [0, 1e15]; default 1e5. M and c are not both 0 */
    double penalty_ratio_limit;  /* alpha of eq. (15), in [1, 1e6]; default 4 */
    bool penalty_update_warm;    /* also update in steps that start warm (most constraints carry an impulse);
                                    default false: there (15) moves the weights of an iteration that has all but
                                    converged and keeps it from coming to rest (docs/internals/algorithm.md) */
    bool warm_start;             /* start from the previous step's impulses and velocities; default true.
                                    false: impulses start at 0 and velocities at A^-1 b. FAST, either way: problems
                                    without impulses and first steps start from initialised impulses
                                    (docs/internals/algorithm.md) */

    int ncp_points;              /* worlds: islands of at most so many contact points have a dense contact solve
                                    (docs/internals/algorithm.md, "Dense contact solve (NCP)"), contacts and rows to
                                    rounding: with joints before the iterations, which they need none of then; without,
                                    where some iterations miss the tolerance (none with tolerance 0). In [0,
                                    SADMM_MOST_NCP_POINTS = 128]; 0: none; default 64. Up to 20 ms on one core are lost
                                    on an island that nothing solves. On CUDA islands without joints have none */

    double residual_tolerance;   /* stop when |r_primal|_inf (m/s) and |r_dual|_inf (N s) are both <= this;
                                    0 = never; finite, >= 0; default 0 */
    int check_period; /* iterations between convergence checks (of the tolerances above), in [1, 1000000]; default 20 */

    bool measure_residuals;      /* report the residuals of the last iteration; default false */
    bool certify;                /* report the certificate of every step (of its last sub-step); default false */
    bool recover_wrenches;       /* compute the contact wrench of every body; default true */

    double correction_factor;    /* share of penetration beyond the slop removed a (sub-)step, in [0, 1]; default 0.2.
                                    Bodies are moved by it and get no velocity that stays (docs/internals/algorithm.md,
                                    "Pushes"), but in islands with joints, and on CUDA in worlds of more than 8,192
                                    dynamic bodies or with kinematic ones */
    double slop;                 /* penetration left alone, m, in [0, 1]; default 1e-5 */
    double correction_speed;     /* cap of the corrective speed of contacts along their normals, m/s, and of joints
                                    along each coordinate, m/s or rad/s; in [0, 1e3]; default 1 */
    double restitution_threshold;/* approach speed under which restitution is ignored, m/s, >= 0; default 0.1 */

    int hits;                    /* worlds: the largest number of hits of a body within a (sub-)step that are solved at
                                    their time of impact (continuous collision): of bodies in flight that are faster
                                    than restitution_threshold with restitution of either shape, or so fast that they
                                    would pass by their own thickness in a step. All other contacts are left to the
                                    solve: more hits, bodies that rest on something or have joints, hits on a mesh
                                    (docs/internals/algorithm.md, "Hits"), and on CUDA some more where there are very
                                    many. In [0, SADMM_MOST_HITS = 64]; 0: none; default 16 */

    int threads;                 /* largest number of CPU threads, in [0, 1024]; 0: OpenMP's default
                                    (OMP_NUM_THREADS); default 0. The number used also depends on the size of the work,
                                    the processors that the affinity of the process and the quota of its container
                                    allow, the host's thread pool (tasks.h), and which threads come in time; reports
                                    have it. Results do not depend on it */
} sadmm_settings;

/* The defaults named above. Thread-safe. */
SADMM_API void sadmm_settings_init(sadmm_settings *settings, size_t size);
static inline sadmm_settings sadmm_settings_default(void)
{
    sadmm_settings settings;
    sadmm_settings_init(&settings, sizeof settings);
    return settings;
}

/* Residuals of eqs. (16) and (17), infinity norms, at the last iteration they were measured; 0 in a step in which every
 * island was solved directly (ncp_points). */
typedef struct sadmm_residual {
    double primal; /* m/s, |x - z| */
    double dual;   /* N s (linear) and N m s (angular), |A v - b - J^T lambda| */
} sadmm_residual;

/* What the error of a step is: a velocity, m/s (or rad/s). */
typedef enum sadmm_step_error {
    SADMM_STEP_ERROR_NONE = 0,
    SADMM_STEP_ERROR_LAW,      /* contacts, joints, limits, drives miss their laws: the natural map */
    SADMM_STEP_ERROR_MOMENTUM, /* bodies do not move as forces and impulses have it: A^-1 (A v - b - J^T lambda) */
    SADMM_STEP_ERROR_LIMITER,  /* ... and the energy limiter has slowed islands down (limited) */
    SADMM_STEP_ERROR_JOINTS,   /* joints are open by more than correction_speed closes in a step: what is beyond it */
    SADMM_STEP_ERROR_COUNT
} sadmm_step_error;

/* True error of (v, lambda), computed in double from raw data, the same for every backend
 * (docs/internals/algorithm.md). */
typedef struct sadmm_certificate {
    double ncp_max;          /* natural map, largest over constraints, m/s */
    double ncp_mean;         /* the same, mean over constraints, m/s */
    int64_t ncp_worst;       /* index of the worst constraint: contacts first (in contact order), then blocks; -1:
                                none */
    double momentum_max;     /* |A v - b - J^T lambda| of the worst body over the largest |b|, |A v|, |J^T lambda|
                                of any body (infinity norms), dimensionless */
    int64_t momentum_worst;  /* index of that body among the dynamic ones; -1: none */
    double siconos;          /* Siconos' global error measure for frictional contact (gfc3d_compute_error),
                                dimensionless; -1 if the problem has soft constraints, for which it is not defined */
} sadmm_certificate;

#ifdef __cplusplus
}
#endif
#endif
