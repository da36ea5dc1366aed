"""What all tasks have: gymnasium's VectorEnv over replicate()."""

import tempfile
from pathlib import Path

import numpy as np

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode
except ImportError as error:
    raise ImportError("subadmm.gym needs gymnasium 1.1 or later: python -m pip install gymnasium") from error

from ..copies import replicate
from ..given import whole
from ..importing import load
from ..namespace import to_numpy


def load_text(text, **options):
    """What load() makes of a model's text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.xml"
        path.write_text(text, encoding="utf-8")
        return load(path, **options)


def _mixed(x):
    """Bits of 64-bit integers mixed (splitmix64)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


class Task(gymnasium.vector.VectorEnv):
    """A task for copies of a robot.

    robot: what load() returned; count: how many; decimation: time steps a step of the task; episode: its longest, in
    steps of the task (0: no limit); autoreset_mode: as gymnasium has it.

    A subclass has `observe() -> (n, k)`, `reward() -> (n,)`, `done() -> (n,)` and `start(which)`, which puts the
    environments `which` (numbers, of numpy), whose states are the template's by then, where they are to begin; and, if
    actions are not controls between the actuators' bounds, `act(actions)` and `action_space_of()`. `prepare()` is for
    numbers of its own. `self.robots` has the robots' numbers (q, qd, ctrl, array); `self.uniform(which, n)` random ones
    that depend on the environment's seed and episode alone.

    Robots that load(..., backend="cuda") made have tensors of torch, and actions are one. A task that is to run on both
    takes its functions from `self.xp`, which is numpy or torch on the device: `self.xp.concatenate`, `self.xp.array(x)`
    of what numpy has. step() and reset() take and give arrays of numpy; `advance` is a step without copies to the host.
    """

    def __init__(self, robot, count, *, decimation=1, episode=0, autoreset_mode=AutoresetMode.NEXT_STEP):
        if not hasattr(robot, "actuators"):
            raise TypeError(f"robot = {robot!r}: must be what subadmm.load returned")
        self.robots = replicate(robot, count)
        self.xp = self.robots.xp
        self.decimation = whole("decimation", decimation, 1, 2**31 - 1)
        self.episode = whole("episode", episode, 0, 2**62)
        self.num_envs = self.robots.count
        self.mode = AutoresetMode(autoreset_mode)
        self.metadata = {"autoreset_mode": self.mode, "render_modes": []}
        #: Steps of the task since each episode began.
        self.steps = np.zeros(count, np.int64)
        self._seeds = np.arange(count, dtype=np.uint64)
        self._episodes = np.zeros(count, np.uint64)
        self._draws = np.zeros(count, np.uint64)
        self._over = np.zeros(count, bool)
        self._time = self.decimation * robot.world.settings.dt
        self.single_action_space = self.action_space_of()
        self.prepare()
        size = tuple(self.xp.array(self.observe()).shape)
        if len(size) != 2 or size[0] != count:
            raise ValueError(f"observe: must give one row each, {count} x n; gave {size}")
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, size[1:], np.float64)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, count)
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, count)

    # ---- what a task says ------------------------------------------------------------------------------------------

    def prepare(self):
        """Once, before anything is observed."""

    def observe(self):
        raise NotImplementedError

    def reward(self):
        raise NotImplementedError

    def done(self):
        raise NotImplementedError

    def start(self, which):
        """Left out: episodes begin with the template's state."""

    def act(self, actions):
        self.robots.ctrl[:] = actions

    def action_space_of(self):
        """Of one environment: controls between the bounds of the actuators."""
        bounds = np.array([a.control_range for a in self.robots.loaded.actuators.values()]).reshape(-1, 2)
        return gymnasium.spaces.Box(bounds[:, 0], bounds[:, 1], dtype=np.float64)

    # ---- what it has -----------------------------------------------------------------------------------------------

    @property
    def time_step(self):
        """Of the task, s."""
        return self._time

    def uniform(self, which, n):
        """Random numbers in [-1, 1), n for each of these environments, of numpy."""
        which = np.asarray(which)
        first = self._draws[which]
        self._draws[which] += np.uint64(n)
        golden = np.uint64(0x9E3779B97F4A7C15)
        key = _mixed(_mixed(self._seeds[which] * golden + golden) + self._episodes[which] * golden)
        at = first[:, None] + np.arange(1, n + 1, dtype=np.uint64)
        return (_mixed(key[:, None] + at * golden) >> np.uint64(11)).astype(np.float64) / 2.0**52 - 1.0

    # ---- gymnasium -------------------------------------------------------------------------------------------------

    def _begin(self, which):
        self._episodes[which] += np.uint64(1)
        self._draws[which] = self.steps[which] = 0
        self._over[which] = False
        self.robots.reset(which)
        self.start(which)

    def reset(self, *, seed=None, options=None):
        """seed: of the first environment, the others have those that follow; or one each. options: {'reset_mask': bool
        of each} begins those alone."""
        mask = (options or {}).get("reset_mask")
        if mask is not None and np.shape(mask) != (self.num_envs,):
            raise ValueError(f"options['reset_mask']: must have shape ({self.num_envs},), has {np.shape(mask)}")
        which = np.arange(self.num_envs) if mask is None else np.flatnonzero(np.asarray(mask, bool))
        if seed is not None:
            seeds = seed + np.arange(self.num_envs) if np.ndim(seed) == 0 else np.asarray(seed)
            if seeds.shape != (self.num_envs,) or seeds.dtype.kind not in "iu" or (seeds < 0).any():
                raise ValueError(f"seed: must be a whole number >= 0, or {self.num_envs} of them")
            super().reset(seed=int(seeds[0]))
            self._seeds[which] = seeds[which].astype(np.uint64)
            self._episodes[which] = 0
        self._begin(which)
        return to_numpy(self._observed()), {}

    def _observed(self):
        return self.xp.copy(self.observe())

    def advance(self, actions):
        """A step: observations, rewards, which are terminated, truncated and have failed, and observations before those
        that are over began again (SAME_STEP; None: they did not). Actions, observations and rewards are on the device
        that the robots are on, the rest is of numpy."""
        if self.mode == AutoresetMode.DISABLED and self._over.any():
            raise ValueError("step: environments are over, and must be reset first: reset(options={'reset_mask': ...})")
        over = self._over.copy()  # with next-step resets: this step begins those again
        self.act(actions)
        self.robots.step(self.decimation)
        self.steps += 1
        failed = self.robots.failed & ~over
        rewards = self.xp.copy(self.reward())
        terminated = np.asarray(to_numpy(self.done()), bool) | failed
        truncated = (self.steps >= self.episode) & ~terminated if self.episode else np.zeros_like(terminated)
        if failed.any():
            rewards[np.flatnonzero(failed)] = 0.0
        if over.any():
            self._begin(np.flatnonzero(over))
            rewards[np.flatnonzero(over)] = 0.0
            terminated[over] = truncated[over] = False
        self._over = terminated | truncated
        observations, final = self._observed(), None
        if self.mode == AutoresetMode.SAME_STEP and self._over.any():
            final = observations
            self._begin(np.flatnonzero(self._over))
            observations = self._observed()
        return observations, rewards, terminated, truncated, failed, final

    def step(self, actions):
        actions = np.asarray(to_numpy(actions))
        if actions.shape != self.action_space.shape:
            raise ValueError(f"actions: must have shape {self.action_space.shape}, and have {actions.shape}")
        observations, rewards, terminated, truncated, failed, last = self.advance(self.xp.array(actions))
        info = {"failed": failed, "_failed": failed} if failed.any() else {}
        if last is not None:
            last, ended = to_numpy(last), terminated | truncated
            final = np.full(self.num_envs, None, dtype=object)
            for k in np.flatnonzero(ended):
                final[k] = last[k].copy()
            info.update(final_obs=final, _final_obs=ended, final_info={}, _final_info=ended)
        return to_numpy(observations), to_numpy(rewards), terminated, truncated, info
