"""A hand of one's own in a world: palm and fingertips on couplings, led by tracked joints or a recording.

    from subadmm import hands

    motion = hands.Motion.load("lift.csv")
    hand = hands.Hand(world, motion.side, motion.at(0))
    for k in range(1000):
        hand.follow(motion, k * world.settings.dt)
        world.step()
        hand.after_step()
        print(hand.forces)

Units are SI; joints are in the frame of the world. docs/guide/hand.md.
"""
from .grasp import WIDEST, grasping
from .hand import TIP_RADIUS, Hand, Touch
from .joints import FINGERS, JOINTS, PARTS, XR_JOINTS, as_joints, parts_of
from .motion import Motion

__all__ = [
    "FINGERS",
    "Hand",
    "JOINTS",
    "Motion",
    "PARTS",
    "TIP_RADIUS",
    "Touch",
    "WIDEST",
    "XR_JOINTS",
    "as_joints",
    "grasping",
    "parts_of",
]
