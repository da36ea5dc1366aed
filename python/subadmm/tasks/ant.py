"""gymnasium's ant."""

from pathlib import Path

import gymnasium
import numpy as np

from ..importing import load
from ..namespace import to_numpy
from .task import Task


class Ant(Task):
    """gymnasium's ant walks along x: its model, observation (without contact forces) and reward: speed along x, 1 a
    step while its torso is between 0.2 and 1 m high, less half the squared actions."""

    def __init__(self, count, *, backend="cpu", threads=None, episode=1000, **options):
        model = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / "ant.xml"
        loaded = load(model, backend=backend, threads=threads)
        super().__init__(loaded, count, decimation=5, episode=episode, **options)

    def observe(self):
        return self.xp.concatenate([self.robots.q[:, 2:], self.robots.qd], axis=1)

    def act(self, actions):
        self._from = self.robots.q[:, 0]
        super().act(actions)

    def _is_healthy(self):
        height = self.robots.q[:, 2]
        return (height > 0.2) & (height < 1.0)

    def reward(self):
        forward = (self.robots.q[:, 0] - self._from) / self.time_step
        return forward + self._is_healthy() - 0.5 * self.xp.square(self.robots.ctrl).sum(axis=1)

    def done(self):
        return ~self._is_healthy()

    def start(self, which):
        source = self.robots.loaded.source
        noise = 0.1 * self.uniform(which, source.nq + source.nv)
        q = to_numpy(self.robots.q)[which] + noise[:, : source.nq]
        q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
        self.robots.set_positions(q, noise[:, source.nq :], which)
