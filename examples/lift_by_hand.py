"""A recorded hand closes around a cube and lifts it: nothing but friction holds it. The recording is made up here and
written as CSV, as one of a tracked hand would be."""

import argparse

import numpy as np

import subadmm
from subadmm import hands

HALF = 0.025                         # m, of the cube
SQUEEZE = 0.006                      # m, that each side would go into the cube
TOUCH = 2 * (HALF + hands.TIP_RADIUS)  # m, that tips are apart when they touch it
# Keyframes: time (s), height of the tips (m), how far thumb and fingers are apart (m).
KEYS = np.array([(0.0, 0.12, 0.095), (0.6, 0.025, 0.095), (1.2, 0.025, TOUCH - 2 * SQUEEZE),
                 (2.0, 0.145, TOUCH - 2 * SQUEEZE), (3.0, 0.145, TOUCH - 2 * SQUEEZE)])
RATE = 60                            # Hz, of the recording


def smooth(x):
    return x * x * x * (10 + x * (6 * x - 15))


def record(side="right"):
    """The motion, as a camera that sees the joints would have it."""
    times = np.arange(0, KEYS[-1, 0] + 0.5 / RATE, 1 / RATE)
    frames = []
    for time in times:
        k = min(np.searchsorted(KEYS[:, 0], time, side="right") - 1, len(KEYS) - 2)
        share = smooth(np.clip((time - KEYS[k, 0]) / (KEYS[k + 1, 0] - KEYS[k, 0]), 0, 1))
        _, height, opening = KEYS[k] + share * (KEYS[k + 1] - KEYS[k])
        frames.append(hands.grasping(side, (0, 0, height), opening=opening))
    return hands.Motion(times, frames, side)


def lift(motion, mass=0.3, backend="auto"):
    """(the cube after the motion; what each part of the hand feels, N: the mean over the last half second)."""
    world = subadmm.World(backend=backend, settings=subadmm.Settings(dt=0.002))
    world.add_ground(friction=0.8)
    cube = world.add_solid(subadmm.box(HALF, HALF, HALF, friction=1), mass=mass, position=(0, 0, HALF), name="cube")
    hand = hands.Hand(world, motion.side, motion.at(0))
    dt, felt = world.settings.dt, []
    for k in range(round(motion.duration / dt)):
        hand.follow(motion, k * dt)
        world.step()
        hand.after_step()
        if (k + 1) * dt > motion.duration - 0.5:
            felt.append(hand.forces)
    return cube, np.mean(felt, axis=0)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mass", type=float, default=0.3, help="of the cube, kg (0.3)")
    parser.add_argument("--side", choices=("left", "right"), default="right")
    parser.add_argument("--file", default="lift.csv", help="the recording (lift.csv)")
    given = parser.parse_args(arguments)
    record(given.side).save(given.file)
    cube, forces = lift(hands.Motion.load(given.file, given.side), given.mass)
    print(f"the cube is {cube.position[2] - HALF:.3f} m above the ground")
    for part, force in zip(hands.PARTS, forces):
        print(f"{part:6} feels ({force[0]:7.3f}, {force[1]:7.3f}, {force[2]:7.3f}) N")
    print(f"together {-forces[:, 2].sum():.3f} N; the cube weighs {9.81 * given.mass:.3f} N")
    return cube, forces


if __name__ == "__main__":
    main()
