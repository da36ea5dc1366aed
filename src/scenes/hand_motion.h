/* The recorded motion of the hand demo. */
#ifndef SADMM_SCENES_HAND_MOTION_H
#define SADMM_SCENES_HAND_MOTION_H

#include "hand.h"

/* What the hand does at time t (s); it rests before the recording's begin and after its end. */
struct sadmm_grip sadmm_hand_motion(double t);

/* Where things are that the motion reaches for (m, on the table, whose top is z = 0; x is forward), and when (s): an
 * object is in the hand and off the table from `lifted` to `held`, and let go at `released`. */
struct sadmm_hand_task {
    double at[2];
    double lifted, held, released;
};

extern const struct sadmm_hand_task sadmm_golden_task, sadmm_heavy_task, sadmm_spoon_task, sadmm_stack_task;
extern const double sadmm_stack_on[2];  /* m: where the cube is that the other one is put on */
extern const double sadmm_car_at[2];    /* m: the middle of the car, which is pushed along x */
extern const double sadmm_motion_end;   /* s */

#endif
