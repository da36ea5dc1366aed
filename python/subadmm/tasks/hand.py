"""A hand turns a cube."""

import gymnasium
import numpy as np

from .task import Task, load_text

#: Angles of a finger's joints, rad: least, as it begins, most: aside, at the root, in the middle.
LEAST, START, MOST = np.tile([-0.5, -0.3, 0.0], 4), np.tile([0.0, 0.1, 1.2], 4), np.tile([0.5, 1.2, 1.8], 4)
PALM_FRICTION = 0.25


def _finger(k):
    x, y = (0.095, 0, -0.095, 0)[k], (0, 0.095, 0, -0.095)[k]
    return f"""
      <body name="finger{k}" pos="{x} {y} 0.02" euler="0 0 {np.pi / 2 * (k + 2)}">
        <joint name="aside{k}" axis="0 0 1" range="{LEAST[0]} {MOST[0]}"/>
        <geom type="cylinder" size="0.012 0.01" mass="0.03" contype="0" conaffinity="0"/>
        <body pos="0 0 0.01">
          <joint name="root{k}" axis="0 1 0" range="{LEAST[1]} {MOST[1]}"/>
          <geom type="capsule" size="0.008" fromto="0 0 0 0 0 0.04" mass="0.03"/>
          <body pos="0 0 0.04">
            <joint name="middle{k}" axis="0 1 0" range="{LEAST[2]} {MOST[2]}"/>
            <geom type="capsule" size="0.008" fromto="0 0 0 0 0 0.05" mass="0.02"/>
          </body>
        </body>
      </body>"""


def _model():
    joints = [(f"{joint}{k}", j) for k in range(4) for j, joint in enumerate(("aside", "root", "middle"))]
    servos = "".join(f'<position joint="{name}" kp="1" kv="0.03" forcerange="-0.3 0.3" '
                     f'ctrlrange="{LEAST[j]} {MOST[j]}"/>' for name, j in joints)
    return f"""
<mujoco model="hand">
  <compiler angle="radian"/>
  <option timestep="0.005"/>
  <default><joint damping="0.01" armature="0.0001"/></default>
  <worldbody>
    <geom name="palm" type="cylinder" size="0.11 0.01"/>
    {"".join(_finger(k) for k in range(4))}
    <body name="cube" pos="0 0 0.04"><freejoint/><geom type="box" size="0.03 0.03 0.03" mass="0.17"/></body>
  </worldbody>
  <actuator>{servos}</actuator>
</mujoco>"""


class TurnCube(Task):
    """A hand of four fingers with three joints each turns a cube on its palm about the upright axis, counter-clockwise.
    The cube's size, mass, friction, place and turn are an episode's own.

    Action: 12 numbers in [-1, 1]: targets of the joints' servos within their ranges, finger by finger: aside, at the
    root, in the middle. Observation: angles and speeds of the joints, place, orientation and velocity of the cube, its
    half width, the last action. Reward a step: the angle that the cube turns, rad, less a little for actions that
    change. Over when the cube is off the palm or tips over.
    """

    def __init__(self, count, *, backend="cpu", threads=None, episode=400, **options):
        loaded = load_text(_model(), backend=backend, threads=threads)
        super().__init__(loaded, count, decimation=4, episode=episode, **options)

    def prepare(self):
        xp, count, loaded = self.xp, self.num_envs, self.robots.loaded
        world, cube = loaded.world, loaded.bodies["cube"]
        self._cube = world.bodies.index(cube)
        self._shape = next(k for k, shape in enumerate(world.shapes) if shape.body == cube)
        self._half, self._turn, self._change = xp.full(count, 0.03), xp.zeros(count), xp.zeros(count)
        self._last = xp.zeros((count, 12))
        self._middle, self._reach = xp.array((LEAST + MOST) / 2), xp.array((MOST - LEAST) / 2)
        self._size, self._material = self.robots.array("shape_size"), self.robots.array("shape_material")
        self._inertia = self.robots.array("body_inertia")
        palm = next(k for k, shape in enumerate(world.shapes) if shape.body.type == "static")
        self._material[:, palm, 0] = PALM_FRICTION

    def action_space_of(self):
        return gymnasium.spaces.Box(-1.0, 1.0, (12,), np.float64)

    def act(self, actions):
        actions = self.xp.clip(actions, -1, 1)
        self._turn = self.turn()
        self._change = self.xp.square(actions - self._last).sum(axis=1)
        self._last[:] = actions
        self.robots.ctrl[:] = self._middle + self._reach * actions

    def turn(self):
        """Of the cube about the upright axis, rad, in (-pi, pi]."""
        w, x, y, z = self.robots.q[:, 15:19].T
        return self.xp.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    def observe(self):
        q, qd = self.robots.q, self.robots.qd
        return self.xp.concatenate([q, qd, self._half[:, None], self._last], axis=1)

    def reward(self):
        way = self.turn() - self._turn
        return (way + np.pi) % (2 * np.pi) - np.pi - 0.0005 * self._change

    def done(self):
        q = self.robots.q
        upright = 1 - 2 * self.xp.square(q[:, 16:18]).sum(axis=1)
        return (self.xp.norm(q[:, 12:14])[:, 0] > 0.08) | (q[:, 14] < 0.5 * self._half) | (upright < 0.7)

    def start(self, which):
        xp, n = self.xp, len(which)
        drawn = xp.array(self.uniform(which, 18))
        half = 0.03 + 0.003 * drawn[:, 0]
        mass = 800 * (1 + 0.3 * drawn[:, 1]) * (2 * half) ** 3
        self._half[which] = half
        self._size[which, self._shape] = half[:, None]
        self._inertia[which, self._cube] = xp.stack([mass] + 3 * [mass * (2 * half) ** 2 / 6], axis=1)
        self._material[which, self._shape, 0] = 1 + 0.3 * drawn[:, 2]
        q = xp.zeros((n, 19))
        q[:, :12] = xp.array(START) + 0.05 * drawn[:, 6:]
        q[:, 12:14] = 0.005 * drawn[:, 3:5]
        q[:, 14] = 0.01 + half
        turn = 0.3 * drawn[:, 5]
        q[:, 15], q[:, 18] = xp.cos(turn / 2), xp.sin(turn / 2)
        self._last[which] = (xp.array(START) - self._middle) / self._reach
        self.robots.ctrl[which] = xp.array(START)
        self.robots.set_positions(q, which=which)
