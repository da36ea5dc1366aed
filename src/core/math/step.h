/* Steps of different length. */
#ifndef SADMM_MATH_STEP_H
#define SADMM_MATH_STEP_H

#include "real.h"

/* How much longer a step is than the last one: what impulses and changes of velocity of that one are multiplied with.
 * Exactly 1 when it is as long, or there was none (0). */
SADMM_INLINE double step_ratio(double dt, double last_dt) 
{
    return last_dt > 0 && last_dt != dt ? dt / last_dt : 1; /* as a rule no division */
}

#endif
