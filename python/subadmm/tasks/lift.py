"""A gripper lifts a cube."""

import gymnasium
import numpy as np

from .task import Task, load_text

#: Largest way of the gripper's targets in a step of the task, m; fingers' targets: open, closed, m.
RATE, OPEN, CLOSED = 0.01, 0.01, -0.03

MODEL = """
<mujoco model="lift">
  <option timestep="0.005"/>
  <worldbody>
    <geom type="plane" size="2 2 0.1"/>
    <body name="bridge" pos="0 0 0.3">
      <joint name="x" type="slide" axis="1 0 0" range="-0.3 0.3" damping="20"/>
      <geom type="box" size="0.03 0.03 0.03" mass="1" contype="0" conaffinity="0"/>
      <body name="cart">
        <joint name="y" type="slide" axis="0 1 0" range="-0.3 0.3" damping="20"/>
        <geom type="box" size="0.03 0.03 0.03" mass="1" contype="0" conaffinity="0"/>
        <body name="gripper">
          <joint name="z" type="slide" axis="0 0 1" range="-0.28 0.1" damping="20"/>
          <geom type="box" size="0.06 0.02 0.02" pos="0 0 0.08" mass="0.5"/>
          <body name="left" pos="-0.04 0 0.02">
            <joint name="left" type="slide" axis="-1 0 0" range="-0.04 0.03" damping="5"/>
            <geom type="box" size="0.008 0.015 0.04" mass="0.1"/>
          </body>
          <body name="right" pos="0.04 0 0.02">
            <joint name="right" type="slide" axis="1 0 0" range="-0.04 0.03" damping="5"/>
            <geom type="box" size="0.008 0.015 0.04" mass="0.1"/>
          </body>
        </body>
      </body>
    </body>
    <body name="cube" pos="0 0 0.02"><freejoint/><geom type="box" size="0.02 0.02 0.02" mass="0.1"/></body>
  </worldbody>
  <actuator>
    <position joint="x" kp="2000" kv="100" forcerange="-100 100" ctrlrange="-0.3 0.3"/>
    <position joint="y" kp="2000" kv="100" forcerange="-100 100" ctrlrange="-0.3 0.3"/>
    <position joint="z" kp="2000" kv="100" forcerange="-100 100" ctrlrange="-0.28 0.1"/>
    <position joint="left" kp="1000" kv="10" forcerange="-40 40" ctrlrange="-0.03 0.03"/>
    <position joint="right" kp="1000" kv="10" forcerange="-40 40" ctrlrange="-0.03 0.03"/>
  </actuator>
</mujoco>
"""


class LiftCube(Task):
    """A gripper with two fingers, on three slides, lifts a cube by 0.15 m. The cube's size, mass, friction, place and
    turn are an episode's own.

    Action: 4 numbers in [-1, 1]: where the gripper's target goes (0.01 m a step of the task, x, y and z), and whether
    the fingers close (> 0) or open. Observation: place and velocity of the gripper, of its fingers, place of the cube
    relative to between the fingers' tips, its orientation and velocity, its half width, and how far it is still to be
    lifted. Reward a step: how near the tips are to it, 0 to 1; and how far it is lifted, 0 to 4. Over when the cube is
    out of reach.
    """

    LIFT = 0.15  # m

    def __init__(self, count, *, backend="cpu", threads=None, episode=200, **options):
        loaded = load_text(MODEL, backend=backend, threads=threads)
        super().__init__(loaded, count, decimation=4, episode=episode, **options)

    def prepare(self):
        xp, loaded = self.xp, self.robots.loaded
        world, cube = loaded.world, loaded.bodies["cube"]
        self._cube = world.bodies.index(cube)
        self._shape = next(k for k, shape in enumerate(world.shapes) if shape.body == cube)
        self._half = xp.full(self.num_envs, 0.02)
        self._bounds = xp.array([-0.3, -0.3, -0.28]), xp.array([0.3, 0.3, 0.1])
        self._tip = xp.array([0, 0, 0.3 - 0.02])
        self._size, self._material = self.robots.array("shape_size"), self.robots.array("shape_material")
        self._inertia = self.robots.array("body_inertia")

    def action_space_of(self):
        return gymnasium.spaces.Box(-1.0, 1.0, (4,), np.float64)

    def act(self, actions):
        xp, ctrl = self.xp, self.robots.ctrl
        actions = xp.clip(actions, -1, 1)
        ctrl[:, :3] = xp.clip(ctrl[:, :3] + RATE * actions[:, :3], *self._bounds)
        ctrl[:, 3:] = xp.where(actions[:, 3:] > 0, xp.full((), CLOSED), OPEN)

    def _tips(self, q):
        """Between the fingers' tips, m."""
        return q[:, :3] + self._tip

    def observe(self):
        q, qd = self.robots.q, self.robots.qd
        left = self.LIFT - (q[:, 7] - self._half)
        return self.xp.concatenate([q[:, :5], qd[:, :5], q[:, 5:8] - self._tips(q), q[:, 8:12], qd[:, 5:11],
                                    self._half[:, None], left[:, None]], axis=1)

    def reward(self):
        xp, q = self.xp, self.robots.q
        away = xp.norm(q[:, 5:8] - self._tips(q))[:, 0]
        lifted = xp.clip((q[:, 7] - self._half) / self.LIFT, 0, 1)
        return 1 - xp.tanh(10 * away) + 4 * lifted

    def done(self):
        place = self.robots.q[:, 5:8]
        return (abs(place[:, :2]) > 0.4).any(axis=1) | (place[:, 2] < -0.01)

    def start(self, which):
        xp, n = self.xp, len(which)
        drawn = xp.array(self.uniform(which, 9))
        half = 0.02 + 0.005 * drawn[:, 0]
        density = 1500 * (1 + 0.5 * drawn[:, 1])
        mass = density * (2 * half) ** 3
        self._half[which] = half
        self._size[which, self._shape] = half[:, None]
        self._inertia[which, self._cube] = xp.stack([mass] + 3 * [mass * (2 * half) ** 2 / 6], axis=1)
        self._material[which, self._shape, 0] = 1 + 0.3 * drawn[:, 2]
        q = xp.zeros((n, 12))
        q[:, :3] = 0.1 * drawn[:, 3:6] * xp.array([1, 1, 0.5])
        q[:, 3:5] = OPEN
        q[:, 5:7] = 0.15 * drawn[:, 6:8]
        q[:, 7] = half
        turn = 0.3 * drawn[:, 8]
        q[:, 8], q[:, 11] = xp.cos(turn / 2), xp.sin(turn / 2)
        self.robots.ctrl[which] = xp.concatenate([q[:, :3], xp.full((n, 2), OPEN)], axis=1)
        self.robots.set_positions(q, which=which)
