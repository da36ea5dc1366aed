/* A hand of 34 links and 33 revolute joints: a palm, a wrist of three axes with a forearm behind, and five fingers of
 * six links, the last of which is a pad of 10 g. The palm is drawn to a pose by a virtual coupling; drives in the
 * joints, of limited torque, are its muscles. It grasps by the friction of its pads.
 *
 * Palm frame: x to where the fingers point, y away from the thumb's root, z out of the back of the hand. Finger 0 is
 * the thumb. */
#ifndef SADMM_SCENES_HAND_H
#define SADMM_SCENES_HAND_H

#include "place.h"

enum { SADMM_HAND_FINGERS = 5, SADMM_FINGER_LINKS = 6, SADMM_WRIST_LINKS = 3 };
enum { SADMM_HAND_LINKS = 1 + SADMM_WRIST_LINKS + SADMM_HAND_FINGERS * SADMM_FINGER_LINKS };
enum { SADMM_HAND_JOINTS = SADMM_HAND_LINKS - 1 };

/* What the hand does: where the middle between thumb and fingers is, the hand's turn about the vertical, and how far
 * the pads are apart. Pads point downwards and face each other along the hand's x. */
struct sadmm_grip {
    double position[3]; /* m, world */
    double yaw;         /* rad */
    double opening;     /* m, between thumb and fingers, in [-0.03, 0.12]; less than an object's width squeezes it */
};

/* Add the hand in the pose of `grip`: SADMM_HAND_LINKS bodies, the palm first, SADMM_HAND_JOINTS joints and one
 * coupling. */
sadmm_status sadmm_add_hand(sadmm_world *world, const struct sadmm_grip *grip, struct sadmm_error *error);

/* Lead the hand whose joints begin with the world's joint `first_joint`, and whose coupling is `coupling` (indices in
 * order of creation), from `now` to `next` in dt (s). */
sadmm_status sadmm_move_hand(sadmm_world *world, int32_t first_joint, int32_t coupling, const struct sadmm_grip *now,
                             const struct sadmm_grip *next, double dt, struct sadmm_error *error);

#endif
