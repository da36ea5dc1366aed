/* Problem level: one contact problem, solved once.
 *
 *   A_i v_i = b_i + sum_k J_{i,k}^T lambda_k                      (eq. 1 of the paper, impulse form)
 *   (J_a v_a + J_b v_b, lambda_k) in C(e_k)                       (eqs. 2-5)
 *
 * Velocities are (linear, angular) in the world frame, m/s and rad/s. Impulses are N s (rows that act on rotation: N m
 * s). A body index of -1 means the static world. lambda acts with +J_b^T on body b and with J_a^T on body a (for
 * contacts J_a = -[I, -[r_a]x]): a positive normal impulse pushes b along the normal and a against it.
 *
 * Threads: use a problem from one thread at a time; calls that take a const problem only read, and may run on several
 * threads at once while no other call is made on it. Different problems are independent.
 *
 * Data of bodies and constraints must be finite and within +-1e60, so that the certificate does not overflow; initial
 * values and solutions must be finite. Errors that every call has besides its own: INVALID_ARGUMENT where a pointer is
 * NULL that must not be.
 */
#ifndef SUBADMM_PROBLEM_H
#define SUBADMM_PROBLEM_H

#include "settings.h"
#include "tasks.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct sadmm_problem sadmm_problem;

/* A contact point given by geometry. Contacts of a pair of bodies with the same normal and friction are solved
 * together; pass them consecutively for speed (the solution does not depend on it). */
typedef struct sadmm_problem_contact {
    int32_t body_a, body_b; /* in [-1, body count), not both -1, not equal */
    double normal[3];       /* unit vector from a to b, world frame */
    double arm_a[3];        /* contact point relative to a's centre of mass, m, world frame; ignored when a is -1 */
    double arm_b[3];        /* the same for b */
    double error;           /* e of eq. (5) along the normal, m/s: separation/dt, or the stabilised penetration
                               (negative) */
    double friction;        /* mu, in [0, 1e60] */
    double velocity[3];     /* surface velocity of a static side that moves, m/s, world frame: x of eq. (5) is J_a v_a +
                               J_b v_b + velocity; 0 where a and b are bodies */
} sadmm_problem_contact;

/* A constraint given by its Jacobian rows. */
typedef enum sadmm_block_kind {
    SADMM_BLOCK_CONTACT = 0, /* 3 rows (normal, tangent, tangent), eq. (5) */
    SADMM_BLOCK_HARD,        /* 1..6 rows, eq. (4) */
    SADMM_BLOCK_SOFT,        /* 1..6 rows, eq. (3) with a gain and a damping a row */
    SADMM_BLOCK_ROWS         /* 1..6 rows, each a law with bounds (docs/internals/algorithm.md, "The problem"): limits,
                                drives, dry friction:
                                gain x + error + compliance lambda = 0 where lower < lambda < upper, >= 0 at lower,
                                <= 0 at upper */
} sadmm_block_kind;

typedef struct sadmm_problem_block {
    sadmm_block_kind kind;
    int32_t rows;            /* 3 for CONTACT, else in [1, 6] */
    int32_t body_a, body_b;  /* in [-1, body count), not both -1, not equal */
    double jacobian_a[36];   /* (rows x 6) row-major, acts on (linear, angular) of a; ignored when a is -1 */
    double jacobian_b[36];   /* the same for b */
    double error[6];         /* CONTACT and HARD: e, m/s. SOFT: e, m or rad. ROWS: the law's constant, gain x m/s */
    double friction;         /* CONTACT: mu, in [0, 1e60] */
    double stiffness[6];     /* SOFT: k of lambda = -(k e + c x), N s/m, i.e. dt times the spring constant; >= 0 */
    double damping[6];       /* SOFT: c, kg (use c = dt (damping + dt stiffness) for an implicit spring); >= 0 */
    double gain[6], compliance[6]; /* ROWS: either may be 0, not both; >= 0. With compliance 1 the gain is in kg */
    double lower[6], upper[6];     /* ROWS: of lambda, N s, lower <= upper, either may be infinite */
} sadmm_problem_block;

/* What a solve did. It may grow (status.h). */
typedef struct sadmm_solve_report {
    sadmm_backend backend;      /* the one that ran */
    sadmm_precision precision;
    int iterations;             /* done */
    bool converged;             /* a stop rule was met (false when none was asked for) */
    int32_t limited;            /* islands slowed down, see sadmm_step_report; 0 at the problem level */
    sadmm_residual residual;    /* of the last iteration; -1 where it was not measured */
    sadmm_certificate certificate; /* of the solution */
    double solve_ms;            /* wall time of the solve without the certificate, ms */
    int threads;                /* CPU threads that worked on the solve: the most at a time */
} sadmm_solve_report;

/* Create an empty problem. Errors: OUT_OF_MEMORY, INVALID_ARGUMENT (out NULL). */
SADMM_API sadmm_status sadmm_problem_create(sadmm_problem **out);
SADMM_API void sadmm_problem_destroy(sadmm_problem *problem); /* NULL is fine */

/* The message of the last failed call on this problem, "" when none failed or problem is NULL; valid until the next
 * call. */
SADMM_API const char *sadmm_problem_message(const sadmm_problem *problem);

/* Set all bodies. A: (count x 6 x 6), symmetric positive definite, kg, kg m, kg m^2. b: (count x 6), N s, N m s.
 * v0: (count x 6) initial velocities for a warm start, or NULL for A^-1 b. Replaces earlier bodies and drops
 * every constraint. count in [0, 2^27]. Errors: INVALID_ARGUMENT, LIMIT, OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_problem_set_bodies(sadmm_problem *problem, int32_t count, const double *A,
                                                const double *b, const double *v0);

/* Set all contacts given by geometry. impulses0: (count x 3) initial impulses on b, world frame, N s, or NULL
 * for 0. Errors: INVALID_ARGUMENT, LIMIT (count > 2^28), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_problem_set_contacts(sadmm_problem *problem, int32_t count,
                                                  const sadmm_problem_contact *contacts, const double *impulses0);

/* Set all constraints given by Jacobians. lambda0: (count x 6) initial multipliers or NULL for 0. Errors as above. */
SADMM_API sadmm_status sadmm_problem_set_blocks(sadmm_problem *problem, int32_t count,
                                                const sadmm_problem_block *blocks, const double *lambda0);

/* Of NULL: 0. */
SADMM_API int32_t sadmm_problem_body_count(const sadmm_problem *problem);
SADMM_API int32_t sadmm_problem_contact_count(const sadmm_problem *problem);
SADMM_API int32_t sadmm_problem_block_count(const sadmm_problem *problem);

/* Read back what was set (or what sadmm_world_freeze put in). A, b as in set_bodies, v0 (count x 6); any may be
 * NULL. index in [0, contact count) or [0, block count). Errors: INVALID_ARGUMENT (range). */
SADMM_API sadmm_status sadmm_problem_get_bodies(const sadmm_problem *problem, double *A, double *b, double *v0);
SADMM_API sadmm_status sadmm_problem_get_contact(sadmm_problem *problem, int32_t index, sadmm_problem_contact *contact);
SADMM_API sadmm_status sadmm_problem_get_block(sadmm_problem *problem, int32_t index, sadmm_problem_block *block);

/* The accelerator for later solves, index >= 0; default 0. Memory on another one is released. Errors: INVALID_ARGUMENT
 * (negative; sadmm_problem_solve refuses an index that the machine lacks). */
SADMM_API sadmm_status sadmm_problem_set_device(sadmm_problem *problem, int device);

/* Threads of the host to work on solves (tasks.h); NULL or all zero: OpenMP's, the default. Errors: INVALID_ARGUMENT
 * (nothing changes), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_problem_set_tasks(sadmm_problem *problem, const sadmm_tasks *tasks);

/* Solve. The solution replaces the initial values, so solving again continues from there (with settings->warm_start).
 * gravity, dt (except for the unit of penalty_offset) and stabilisation are not used: A, b and e contain them. report
 * may be NULL. Errors: INVALID_ARGUMENT, UNAVAILABLE, OUT_OF_MEMORY, NON_FINITE (the solution, or the certificate that
 * a report asks for; the problem keeps its previous values), DEVICE. report->converged is false where the report's
 * residual is not finite. */
SADMM_API sadmm_status sadmm_problem_solve_sized(sadmm_problem *problem, sadmm_backend backend,
                                                 sadmm_precision precision, const sadmm_settings *settings,
                                                 sadmm_solve_report *report, size_t report_size);
static inline sadmm_status sadmm_problem_solve(sadmm_problem *problem, sadmm_backend backend, sadmm_precision precision,
                                               const sadmm_settings *settings, sadmm_solve_report *report)
{
    return sadmm_problem_solve_sized(problem, backend, precision, settings, report, sizeof *report);
}

/* The solution. velocities: (bodies x 6). impulses: (contacts x 3) on b, world frame, N s. block_lambda:
 * (blocks x 6), unused rows 0. Any may be NULL. */
SADMM_API sadmm_status sadmm_problem_get_solution(const sadmm_problem *problem, double *velocities, double *impulses,
                                                  double *block_lambda);

/* Set (v, lambda), e.g. to certify the result of another solver. Array shapes as above; NULL leaves a part unchanged.
 * Errors: INVALID_ARGUMENT (a number that is not finite; nothing changes). */
SADMM_API sadmm_status sadmm_problem_set_solution(sadmm_problem *problem, const double *velocities,
                                                  const double *impulses, const double *block_lambda);

/* The error of the current (v, lambda), computed in double from the raw data, without a solve. Errors: NON_FINITE where
 * a product overflows (then *certificate is unchanged), OUT_OF_MEMORY. */
SADMM_API sadmm_status sadmm_problem_certify(sadmm_problem *problem, sadmm_certificate *certificate);

#ifdef __cplusplus
}
#endif
#endif
