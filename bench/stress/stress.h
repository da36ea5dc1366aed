/* Extreme cases, each judged by physics: a known answer, or what no motion may break. A case is one entry of the table
 * of its subject (stress_rest.c, ...): the values of its parameter, a function that builds worlds by the public
 * interface, steps them and says how far each measure is from its bound, and what is known to limit it.
 *
 * A row, a case at one value, passes if every measure is within its bound. A measure beyond it is a limit if the case's
 * table says so, with the reason and a weaker bound that still holds; else the row fails, as it does if a step fails or
 * a measure is not a number. */
#ifndef BENCH_STRESS_STRESS_H
#define BENCH_STRESS_STRESS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "subadmm/joint.h"
#include "subadmm/world.h"

enum { STRESS_VALUES = 16, STRESS_LIMITS = 8, STRESS_CHECKS = 8 };
enum { STRESS_F32 = 1 << SADMM_F32, STRESS_F64 = 1 << SADMM_F64, STRESS_BOTH = STRESS_F32 | STRESS_F64 };

/* ---- cases and verdicts ---------------------------------------------------------------------------------------- */

/* What is known to keep a measure from its bound at some values. */
struct stress_limit {
    const char *check;  /* the measure */
    double from, to;    /* values of the parameter, both included */
    unsigned variants;  /* bits; 0: all */
    int precisions;     /* STRESS_F32 and STRESS_F64 */
    double bound;       /* that it keeps all the same */
    const char *reason; /* one line: what limits it */
};

struct stress;

struct stress_case {
    const char *name, *about; /* one line: what happens, and what must hold */
    const char *parameter;    /* what the values are, with the unit */
    double values[STRESS_VALUES];
    int value_count;
    unsigned quick;              /* bits of the values that --quick takes */
    const char *const *variants; /* names of a second parameter, or NULL */
    int variant_count;
    void (*run)(struct stress *s);
    struct stress_limit limits[STRESS_LIMITS]; /* the first without a name ends them */
};

struct stress_group {
    const struct stress_case *cases;
    size_t count;
};

/* The table, by subject. */
extern const struct stress_group stress_rest, stress_piles, stress_impacts, stress_friction, stress_springs,
    stress_joints, stress_spins, stress_energy, stress_momentum, stress_far;
const struct stress_case *stress_case_at(size_t index); /* NULL: no more */

struct stress_check {
    const char *what; /* with its unit */
    double worst, bound;
};

enum stress_verdict { STRESS_PASS, STRESS_LIMIT, STRESS_FAIL };

/* ---- a row ------------------------------------------------------------------------------------------------------ */

struct stress {
    const struct stress_case *about;
    double value;
    int variant;
    bool quick;             /* as short as shows it */
    sadmm_world_def def;    /* of the worlds to come: a case may change it */
    double origin[3];       /* where the case's (0, 0, 0) is in the world, m */
    sadmm_world *world;     /* NULL until something is added */
    double time;            /* simulated by this world, s */
    long steps, unsolved;   /* of all worlds; unsolved: where the report says that it misses the tolerance */
    sadmm_step_report last; /* of the last step */
    double overlap, drift;  /* largest of this world's steps, m: penetration_max, joint_drift */
    struct stress_check checks[STRESS_CHECKS];
    int check_count;
    char message[256]; /* what broke the row off; "": nothing */
};

/* Run a case at a value; def: backend, precision and device. */
void stress_run(struct stress *s, const struct stress_case *about, double value, int variant, bool quick,
                const sadmm_world_def *def);
/* *decisive: the measure that the verdict is of, NULL if there is none; *limit: why, of a limit. */
enum stress_verdict stress_judge(const struct stress *s, const struct stress_check **decisive,
                                 const struct stress_limit **limit);

/* A measure: the largest of all calls counts. What is not a number is infinite. */
void stress_check(struct stress *s, const char *what, double measured, double bound);
/* After the first failure nothing more is done. */
bool stress_ok(const struct stress *s);
void stress_fail(struct stress *s, const char *format, ...);
void stress_must(struct stress *s, sadmm_status status); /* what a call on the world returned */
static inline bool stress_single(const struct stress *s) { return s->def.precision == SADMM_F32; }
/* One of two bounds, by precision. */
static inline double stress_by(const struct stress *s, double f64, double f32) { return stress_single(s) ? f32 : f64; }
/* Way that rounding may add up to, where each step's change of a speed is rounded by it, m. */
static inline double stress_rounding(const struct stress *s, double speed, double seconds)
{
    return stress_by(s, 1e-16, 6e-8) * speed * (seconds / s->def.settings.dt) * seconds / 2;
}
/* The length of a run, s. */
static inline double stress_seconds(const struct stress *s, double quick, double full)
{
    return s->quick ? quick : full;
}

/* ---- worlds ----------------------------------------------------------------------------------------------------- */

#define STRESS_G 9.81

/* A body of one shape. Members that are 0 are left at the library's defaults, but friction and restitution. */
struct stress_body {
    sadmm_shape_type shape;
    double size[3], mass; /* mass 0: a static body */
    double position[3], orientation[4], velocity[3], spin[3];
    double friction, restitution;
    double inertia[3]; /* in place of a solid's */
    const sadmm_hull *hull;
    const sadmm_mesh *mesh;
    bool kinematic, ghost; /* ghost: without its shape, that only gives the inertia */
    int environment;
};

/* A new world, without gravity or with it; the one before is gone. */
void stress_open(struct stress *s, double gravity);
sadmm_body_id stress_add(struct stress *s, const struct stress_body *body);
/* The half-space below the plane through the case's origin with this orientation (NULL: level). */
void stress_add_plane(struct stress *s, const double orientation[4], double friction, double restitution);
/* A joint at a point of the case's frame; orientation NULL: the world's axes. */
sadmm_joint_id stress_join(struct stress *s, sadmm_joint_def *def, double x, double y, double z,
                           const double orientation[4]);
bool stress_step(struct stress *s); /* false: it failed */
/* Positions are in the case's frame. */
sadmm_body_state stress_state(struct stress *s, sadmm_body_id id);
sadmm_joint_state stress_joint_state(struct stress *s, sadmm_joint_id id);
void stress_move(struct stress *s, sadmm_body_id id, double x, double y, double z); /* a kinematic body */
double stress_dt(const struct stress *s);

/* ---- measures --------------------------------------------------------------------------------------------------- */

struct stress_sums {
    double kinetic, potential;            /* J; potential: of gravity, from the case's origin */
    double momentum[3], turning[3];       /* N s; N m s about the case's origin */
    double momentum_scale, turning_scale; /* sums of the bodies' norms */
    double fastest;                       /* m/s, rad/s */
};
struct stress_sums stress_sum(struct stress *s);
double stress_distance(const double a[3], const double b[3]);
double stress_norm(const double a[3]);
void stress_turn(int axis, double angle, double orientation[4]); /* about x, y or z */
double stress_random(uint64_t *seed);                            /* in [-1, 1) */

#endif
