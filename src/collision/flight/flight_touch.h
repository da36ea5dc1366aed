/* When two shapes in flight first touch within a step, by their own motions, rotation included.
 *
 * By conservative advancement: no point of either comes closer along the normal of the distance than the centres of
 * mass and the rotations allow, so that the pair is moved on by what that takes, and again from there. Near the touch
 * the points that approach are followed to where their separation is 0. In double; flight_touch_math.h is for devices
 * as well.
 *
 * For hits (world/step/hits.c), along ways that bend. What contact finding moves on by is advance.h, along straight
 * ones of the whole step, and not as far as a touch. */
#ifndef SADMM_COLLISION_FLIGHT_FLIGHT_TOUCH_H
#define SADMM_COLLISION_FLIGHT_FLIGHT_TOUCH_H

#include "flight.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of the body, t s after the step's start. */
void sadmm_flight_at(const struct sadmm_flight *flight, double t, struct sadmm_flight_pose *pose);

/* False: no point of the pair, none of which is a mesh, touches in [from, to] that approaches fast enough. Points of
 * the result: all that touch then; `subshape`: of which of its subshapes, the first one that touches. */
bool sadmm_flight_touch(struct sadmm_swept_pair *pair, double from, double to, struct sadmm_flight_touch *touch);

#ifdef __cplusplus
}
#endif
#endif
