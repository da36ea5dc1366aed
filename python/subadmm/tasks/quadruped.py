"""A robot with four legs walks over rough ground."""

import gymnasium
import numpy as np

from ..importing import load
from ..rotations import conjugate, of_vector, rotate
from .task import Task

LEGS = (("front_left", 1, 1), ("front_right", 1, -1), ("hind_left", -1, 1), ("hind_right", -1, -1))
#: Joints of a leg as it stands: outwards, thigh, knee, rad; and how far an action moves each.
STANDING, REACH = np.tile([0.0, 0.8, -1.6], 4), np.tile([0.3, 0.6, 0.6], 4)
#: Of the trunk above the feet as it stands, m.
HEIGHT = 2 * 0.18 * np.cos(0.8) + 0.02
#: Of the ground: m from side to side, m between heights, from the lowest to the highest; how far from the middle robots
#: may begin.
SIDE, SPACING, RELIEF, AWAY = 40.0, 0.1, 0.06, 8.0


def _leg(name, front, left):
    return f"""
      <body name="{name}" pos="{0.18 * front} {0.06 * left} 0">
        <joint name="{name}_out" axis="1 0 0" range="-0.6 0.6"/>
        <geom type="sphere" size="0.03" mass="0.3" contype="0" conaffinity="0"/>
        <body name="{name}_thigh" pos="0 {0.05 * left} 0">
          <joint name="{name}_thigh" axis="0 1 0" range="-0.8 2.4"/>
          <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.18" mass="0.5" contype="0" conaffinity="0"/>
          <body name="{name}_shank" pos="0 0 -0.18">
            <joint name="{name}_knee" axis="0 1 0" range="-2.6 -0.4"/>
            <geom type="capsule" size="0.012" fromto="0 0 0 0 0 -0.15" mass="0.1"/>
            <geom name="{name}_foot" type="sphere" size="0.02" pos="0 0 -0.18" mass="0.05"/>
          </body>
        </body>
      </body>"""


def _model():
    n = round(SIDE / SPACING) + 1
    servos = "".join(f'<position joint="{name}_{joint}" kp="60" kv="2" forcerange="-30 30"/>'
                     for name, _, _ in LEGS for joint in ("out", "thigh", "knee"))
    return f"""
<mujoco model="quadruped">
  <compiler angle="radian"/>
  <option timestep="0.005"/>
  <default><joint damping="0.1" armature="0.005"/></default>
  <asset><hfield name="ground" nrow="{n}" ncol="{n}" size="{SIDE / 2} {SIDE / 2} {RELIEF} 0.1"/></asset>
  <worldbody>
    <geom type="hfield" hfield="ground"/>
    <body name="trunk" pos="0 0 0.5">
      <freejoint/>
      <geom type="box" size="0.2 0.08 0.04" mass="6"/>{"".join(_leg(*leg) for leg in LEGS)}
    </body>
  </worldbody>
  <actuator>{servos}</actuator>
</mujoco>"""


def ground():
    """Heights in [0, 1]: waves of half a metre to some metres in all directions, and bumps."""
    random = np.random.default_rng(7)
    n = round(SIDE / SPACING) + 1
    x = np.linspace(-SIDE / 2, SIDE / 2, n)
    heights = 0.15 * random.uniform(-1, 1, (n, n))
    for length in np.geomspace(0.6, 5, 12):
        turn, phase = random.uniform(0, 2 * np.pi, 2)
        way = np.cos(turn) * x[None, :] + np.sin(turn) * x[:, None]
        heights += length**0.5 * np.sin(2 * np.pi * way / length + phase)
    heights -= heights.min()
    return heights / heights.max()


def robot(backend="cpu", threads=None):
    """The robot, above the middle of its ground."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(_model())
    model.hfield_data[:] = ground().ravel()
    start = np.concatenate([[0, 0, 0.5, 1, 0, 0, 0], STANDING])
    return load(model, backend=backend, threads=threads, qpos=start)


class Quadruped(Task):
    """Four legs walk along x at 0.5 m/s over rough ground, each environment on a patch of its own of one large
    heightfield, with its own friction and mass of the trunk.

    Action: 12 numbers in [-1, 1], by which the targets of the joints' servos differ from standing (0.3 rad outwards,
    0.6 rad at thigh and knee). Observation: gravity's direction, linear and angular velocity of the trunk in its frame,
    joints less standing and their speeds, the last action, and heights of the ground around it relative to the trunk
    (3 x 5 rays). Reward a step: how near to 0.5 m/s its speed along x is, 0 to 1, less a little for drifting aside,
    tilting, and for actions that change. Over when the trunk is on the ground or falls over.
    """

    SPEED = 0.5  # m/s

    def __init__(self, count, *, backend="cpu", threads=None, episode=500, **options):
        super().__init__(robot(backend, threads), count, decimation=4, episode=episode, **options)

    def prepare(self):
        xp, loaded = self.xp, self.robots.loaded
        world = loaded.world
        self._ground = next(k for k, shape in enumerate(world.shapes) if shape.definition.type == "mesh")
        self._trunk = world.bodies.index(loaded.bodies["trunk"])
        grid = np.stack(np.meshgrid(np.linspace(-0.3, 0.5, 5), np.linspace(-0.2, 0.2, 3)), -1).reshape(-1, 2)
        self._grid = xp.array(np.concatenate([grid, np.full((len(grid), 1), 1.0)], axis=1))
        self._up, self._standing, self._reach = xp.array([0.0, 0, 1]), xp.array(STANDING), xp.array(REACH)
        self._last = xp.zeros((self.num_envs, 12))
        self._change = xp.zeros(self.num_envs)
        self._frame = self.robots.array("shape_frame")
        self._material = self.robots.array("shape_material")
        self._inertia = self.robots.array("body_inertia")
        self._mass = xp.copy(self._inertia[0, self._trunk])

    def action_space_of(self):
        return gymnasium.spaces.Box(-1.0, 1.0, (12,), np.float64)

    def act(self, actions):
        actions = self.xp.clip(actions, -1, 1)
        self._change = self.xp.square(actions - self._last).sum(axis=1)
        self._last[:] = actions
        self.robots.ctrl[:] = self._standing + self._reach * actions

    def _to_ground(self, origins, which=None):
        """How far it is straight down; the host casts rays."""
        return self.xp.array(self.robots.cast_rays(origins, [0, 0, -1.0], 4.0, which, types=("static",))[0])

    def _look(self):
        """Trunk's turn, its velocity in its frame, gravity's direction there, heights of the ground relative to it."""
        xp, q, qd = self.xp, self.robots.q, self.robots.qd
        turn = q[:, 3:7]
        heading = xp.arctan2(2 * (turn[:, 0] * turn[:, 3] + turn[:, 1] * turn[:, 2]),
                             1 - 2 * (turn[:, 2] ** 2 + turn[:, 3] ** 2))
        around = rotate(of_vector(heading[:, None] * self._up)[:, None], self._grid)
        distance = self._to_ground(q[:, None, :3] + around)
        heights = xp.where(xp.isfinite(distance), 1.0 - distance, -1.0)
        back = conjugate(turn)
        down = rotate(back, -self._up)
        return q, qd, rotate(back, qd[:, :3]), down, heights

    def observe(self):
        q, qd, velocity, down, heights = self._look()
        return self.xp.concatenate([down, velocity, qd[:, 3:6], q[:, 7:] - self._standing, qd[:, 6:], self._last,
                                    heights], axis=1)

    def reward(self):
        q, qd = self.robots.q, self.robots.qd
        near = self.xp.exp(-8 * (qd[:, 0] - self.SPEED) ** 2)
        tilt = self.xp.square(q[:, 4:6]).sum(axis=1)
        return near - 0.2 * abs(qd[:, 1]) - 0.5 * tilt - 0.005 * self._change

    def done(self):
        q = self.robots.q
        distance = self._to_ground(q[:, None, :3])
        upright = 1 - 2 * self.xp.square(q[:, 4:6]).sum(axis=1)
        return (distance[:, 0] < 0.1) | (distance[:, 0] > 0.6) | (upright < 0.5)

    def start(self, which):
        xp, n = self.xp, len(which)
        drawn = xp.array(self.uniform(which, 17))
        self._frame[which, self._ground, :2] = AWAY * drawn[:, :2]
        self._material[which, :, 0] = 0.8 + 0.3 * drawn[:, 2, None]
        self._inertia[which, self._trunk] = self._mass * (1 + 0.2 * drawn[:, 3, None])
        self._last[which] = 0
        self._change[which] = 0
        self.robots.ctrl[which] = self._standing
        q = xp.zeros((n, 19))
        heading = 0.1 * drawn[:, 4]
        q[:, 3:7] = of_vector(heading[:, None] * self._up)
        q[:, 7:] = self._standing + 0.1 * drawn[:, 5:]
        corners = xp.array([[0.18, 0.11, 2], [0.18, -0.11, 2], [-0.18, 0.11, 2], [-0.18, -0.11, 2]])
        distance = self._to_ground(rotate(q[:, None, 3:7], corners), which)
        q[:, 2] = 2 - xp.amin(distance, axis=1) + HEIGHT + 0.02
        self.robots.set_positions(q, which=which)
