/* How fast a joint's coordinates change, all six at once: what joint_moving_of (core/model/joint_law.h) asks of its
 * geometry, with the same bits. A kernel, compiled once per instruction set. */
#ifndef SADMM_WORLD_STEP_JOINT_RATES_H
#define SADMM_WORLD_STEP_JOINT_RATES_H

#include "core/model/joint_law.h"

/* By coordinate; SIX_RATES: whole vectors. */
enum { SIX_RATES = 8 };
struct joint_rates {
    double before[SIX_RATES];        /* joint_rate at the step's start */
    double start[SIX_RATES];         /* of the step's rows, by velocities at the start, */
    double middle[SIX_RATES];        /* halfway, */
    double prescribed[SIX_RATES];    /* and of sides of prescribed motion */
    double row[2][JOINT_COORDINATES][6]; /* joint_step_row of sides that move */
};

typedef void sadmm_joint_rates(const struct acting_joint *acting, struct joint_rates *rates);

extern sadmm_joint_rates sadmm_joint_rates_baseline, sadmm_joint_rates_avx2;

#endif
