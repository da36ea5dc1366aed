"""A pole on a cart."""

import numpy as np

from .task import Task, load_text

MODEL = """
<mujoco model="cartpole">
  <option timestep="0.01"/>
  <worldbody>
    <body name="cart" pos="0 0 1">
      <joint name="slide" type="slide" axis="1 0 0" damping="0.01"/>
      <geom type="box" size="0.15 0.1 0.05" mass="1" contype="0" conaffinity="0"/>
      <body name="pole">
        <joint name="hinge" axis="0 1 0" damping="0.001"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.6" mass="0.1" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="slide" ctrllimited="true" ctrlrange="-10 10"/></actuator>
</mujoco>
"""


class CartPole(Task):
    """A pole on a cart stays up: the action is a force on the cart, N; a reward of 1 a step, until the pole leans by
    more than 0.2 rad or the cart leaves +-2.4 m. Observation: place, angle and their rates."""

    def __init__(self, count, *, backend="cpu", threads=None, episode=500, **options):
        loaded = load_text(MODEL, backend=backend, threads=threads)
        super().__init__(loaded, count, decimation=2, episode=episode, **options)

    def observe(self):
        return self.xp.concatenate([self.robots.q, self.robots.qd], axis=1)

    def reward(self):
        return self.xp.full(self.num_envs, 1.0)

    def done(self):
        place, angle = self.robots.q.T
        return (abs(place) > 2.4) | (abs(angle) > 0.2)

    def start(self, which):
        self.robots.set_positions(*np.split(0.05 * self.uniform(which, 4), 2, axis=1), which)
