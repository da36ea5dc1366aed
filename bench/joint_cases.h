/* One body joined to the ground: the set-ups of Project Chrono's unit tests of joints, constraints and springs
 * (utest_JOINT_*, BSD-3), whose reference solutions are ADAMS'. Motion and reactions at instants of a run. */
#ifndef BENCH_JOINT_CASES_H
#define BENCH_JOINT_CASES_H

#include <stdbool.h>
#include <stddef.h>

#include "subadmm/joint.h"

/* What is compared, in the order of a sample's numbers. */
enum joint_quantity {
    JOINT_POSITION,             /* of the centre of mass, m */
    JOINT_VELOCITY,             /* m/s */
    JOINT_ACCELERATION,         /* m/s^2 */
    JOINT_ORIENTATION,          /* w x y z */
    JOINT_ANGULAR_VELOCITY,     /* rad/s, world */
    JOINT_ANGULAR_ACCELERATION, /* rad/s^2, world */
    JOINT_FORCE,                /* on the ground, N */
    JOINT_TORQUE,               /* on the ground, about the joint's place at t = 0, N m */
    JOINT_QUANTITIES
};

struct joint_sample {
    double value[JOINT_QUANTITIES][4]; /* orientation has four, others three */
    double violation;                  /* largest error of a locked coordinate, m or rad */
    double energy;                     /* J */
};

struct joint_case {
    const char *name, *folder, *force; /* of the reference's tables; force: their suffix, "" as a rule */
    double step;                       /* s, the one that Chrono takes */
    double tolerance[JOINT_QUANTITIES]; /* that Chrono accepts, root mean square; 0: not compared */
    sadmm_joint_kind kind;
    double place[3];                   /* the joint's, or the link's end in the ground, m */
    double frame[4];                   /* of the joint */
    double position[3], orientation[4], velocity[3]; /* of the body at t = 0 */
    double end[3];                     /* radial joints: the other end in the body's frame */
    double inertia[3];
    int coordinate;                    /* that `law` is about */
    sadmm_joint_coordinate law;
    double progressive;                /* N/m^2 or N m/rad^2: a spring's stiffness grows by that times its stretch */
};

size_t joint_case_count(void);
const struct joint_case *joint_case_at(size_t index);

/* A case in a world of its own. *world is NULL after an error. */
sadmm_status joint_case_build(const struct joint_case *which, const sadmm_world_def *def, sadmm_world **world);

/* Run a new world of the case by steps of its settings' dt and sample it at multiples 0, 1, .. count - 1 of
 * `every` steps (>= 2). Accelerations and reactions at an instant are the mean of those of the steps before and after
 * it. */
sadmm_status joint_case_run(const struct joint_case *which, sadmm_world *world, int every, int count,
                            struct joint_sample *samples);

#endif
