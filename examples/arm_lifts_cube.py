"""A Panda arm picks up a cube: it reaches down, closes its fingers, and lifts the cube by friction alone.

    pip install mujoco gymnasium-robotics      # the arm's model is a part of gymnasium-robotics
    python arm_lifts_cube.py [--mass 0.2]

The arm is led by velocities of its hand: what turns its joints so (the Jacobian, damped least squares) is added up to
the targets of its servos, which are what moves it. The cube is held by nothing but contact.
"""

import argparse
import importlib.util
from pathlib import Path

import numpy as np

import subadmm
from subadmm.rotations import multiply, rotate

ARM = [f"robot:panda0_joint{k}" for k in range(1, 8)]
SERVOS = [f"panda0_joint{k}" for k in range(1, 8)]
FINGERS = ["r_gripper_finger_joint", "l_gripper_finger_joint"]
OPEN = 0.04  # m, of a finger
GRIP = np.array([0, 0, 0.247])  # m, where the finger tips meet, in the frame of the last link
HALF = 0.02  # m, of the cube
CUBE, HIGH = np.array([0.5, 0.1, HALF]), 0.25  # m: where it stands, how far it is lifted
READY = [0, 0.1, 0, -2.2, 0, 0.75, 0, OPEN, OPEN]  # rad and m
GAIN, DAMPING = 4.0, 0.02  # 1/s, of what the hand is off by; m, of the least squares


def scene_of(mass):
    """The arm on the ground, and the cube: MJCF around the files of the package."""
    package = importlib.util.find_spec("gymnasium_robotics")
    if package is None:
        raise SystemExit("the arm's model is in the package gymnasium-robotics: pip install gymnasium-robotics")
    folder = Path(package.submodule_search_locations[0]) / "envs" / "assets" / "kitchen_franka" / "franka_assets"
    return f"""
    <mujoco>
      <include file="{folder / "assets.xml"}"/>
      <compiler angle="radian" meshdir="{folder / "meshes"}"/>
      <option timestep="0.002"/>
      <include file="{folder / "actuator.xml"}"/>
      <worldbody>
        <geom name="floor" type="plane" size="2 2 .1"/>
        <include file="{folder / "chain.xml"}"/>
        <body name="cube" pos="{CUBE[0]} {CUBE[1]} {CUBE[2]}"><freejoint/>
          <geom name="cube" type="box" size="{HALF} {HALF} {HALF}" mass="{mass}" friction="0.8"/></body>
      </worldbody>
    </mujoco>"""


def smooth(x):
    x = min(max(x, 0.0), 1.0)
    return x * x * (3 - 2 * x)


class Arm:
    def __init__(self, mass=0.2):
        import mujoco

        model = mujoco.MjModel.from_xml_string(scene_of(mass))
        model.body_gravcomp[1 : model.body("panda0_rightfinger").id + 1] = 1  # as the real arm does by itself
        qpos = np.array(model.qpos0)
        qpos[: len(READY)] = READY
        self.robot = subadmm.load(model, qpos=qpos)
        self.world = self.robot.world
        self.commands = np.array(READY[:7])
        # s: a servo that moves lags by its joint's damping over its stiffness
        damping = [model.dof_damping[model.joint(name).dofadr[0]] for name in ARM]
        self.lag = np.array([d / model.actuator(name).gainprm[0] for d, name in zip(damping, SERVOS)])
        self.turn = np.array([0.0, 1, 0, 0])  # of the hand: its z axis down
        # fingers move along y of a frame that is turned by -45 degrees on the last link
        self.turn = multiply(self.turn, [np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8)])

    def hand(self):
        """Where the grip is (m) and how the last link is turned (w x y z)."""
        position, turn = self.robot.frame("panda0_link7")
        return position + rotate(turn, GRIP), turn

    def jacobian(self, at):
        """Velocity of the grip (m/s) and its rate of turning (rad/s), by the rates of the joints: 6 x 7."""
        columns = []
        for name in ARM:
            joint = self.robot.joints[name].joint
            body, (origin, turn) = joint.body_b, joint.frame_b
            axis = self.robot.joints[name].sign * rotate(multiply(body.orientation, turn), [0, 0, 1])
            arm = at - (np.array(body.position) + rotate(body.orientation, origin))
            columns.append(np.concatenate([np.cross(axis, arm), axis]))
        return np.array(columns).T

    def step(self, goal, velocity, fingers):
        """One step in which the grip goes to `goal` (m) with `velocity` (m/s), and fingers to `fingers` (m)."""
        at, turn = self.hand()
        off = multiply(self.turn, turn * [1, -1, -1, -1])
        off = 2 * off[1:] * np.sign(off[0])  # the turn that is missing, for small ones
        wanted = np.concatenate([velocity + GAIN * (goal - at), GAIN * off])
        j = self.jacobian(at)
        rates = j.T @ np.linalg.solve(j @ j.T + DAMPING**2 * np.eye(6), wanted)
        self.commands += rates * self.world.settings.dt
        for name, command in zip(SERVOS, self.commands + self.lag * rates):
            self.robot.actuators[name].control = command
        for name in FINGERS:
            self.robot.actuators[name].control = fingers
        self.world.step()

    def move(self, goal, seconds, fingers):
        """The grip goes to `goal` on a straight line; fingers: their target, or a pair: from, to."""
        begin, _ = self.hand()
        goal, dt = np.asarray(goal), self.world.settings.dt
        first, last = fingers if isinstance(fingers, tuple) else (fingers, fingers)
        steps = round(seconds / dt)
        for k in range(steps):
            share, next_share = smooth(k / steps), smooth((k + 1) / steps)
            velocity = (next_share - share) / dt * (goal - begin)
            self.step(begin + next_share * (goal - begin), velocity, first + next_share * (last - first))

    def cube_in_hand(self):
        at, turn = self.hand()
        return rotate(turn * [1, -1, -1, -1], np.array(self.robot.bodies["cube"].position) - at)


def main(arguments=None):
    parser = argparse.ArgumentParser(description="A Panda arm picks up a cube.")
    parser.add_argument("--mass", type=float, default=0.2, help="of the cube, kg")
    given = parser.parse_args(arguments)
    arm = Arm(given.mass)
    cube = arm.robot.bodies["cube"]
    arm.move(CUBE + [0, 0, 0.12], 1.2, OPEN)
    arm.move(CUBE, 1.0, OPEN)
    arm.move(CUBE, 0.8, (OPEN, 0.0))
    closed = arm.cube_in_hand()
    arm.move(CUBE + [0, 0, HIGH], 1.2, 0.0)
    arm.move(CUBE + [0, 0, HIGH], 0.5, 0.0)
    height, moved = cube.position[2] - CUBE[2], arm.cube_in_hand() - closed
    slip = float(np.linalg.norm(moved))
    off = np.linalg.norm(arm.hand()[0] - CUBE - [0, 0, HIGH])
    print(f"the grip is {1e3 * off:.2f} mm off, at {arm.world.report.time:.1f} s")
    lifted = height > 0.9 * HIGH and slip < 0.005
    print(
        f"the cube is {'' if lifted else 'not '}lifted: {1e3 * height:.1f} mm up, "
        f"slip {1e3 * slip:.3f} mm since the fingers closed"
    )
    return lifted, height, moved


if __name__ == "__main__":
    main()
