"""A task as rsl_rl's VecEnv (rsl_rl 5). torch and tensordict are imported when one is made."""

import numpy as np
from gymnasium.vector import AutoresetMode

from ..namespace import is_tensor
from .task import Task


class RslRl:
    """A task for rsl_rl's runners: num_envs, num_actions, max_episode_length, episode_length_buf, device, cfg,
    get_observations() and step().

    task: a Task whose episodes end (episode > 0); from here on this is what steps and resets it, and its environments
    that are over begin again in the same step. device: of all tensors; None: that of the task's robots, so that
    nothing but what is over goes by way of the host where they are on CUDA. seed: of the first environment. Actions
    in [-1, 1] go over the range of the task's, where that is bounded, and are clipped to it. Observations are the
    group "policy", float32.
    """

    def __init__(self, task, *, device=None, seed=0):
        try:
            import torch
            from tensordict import TensorDict
        except ImportError as error:
            raise ImportError("RslRl needs torch and tensordict: python -m pip install rsl-rl-lib") from error
        if not isinstance(task, Task):
            raise TypeError(f"task = {task!r}: must be a subadmm.gym.Task")
        if task.episode < 1:
            raise ValueError("task: its episodes must end (episode > 0)")
        if len(task.single_action_space.shape) != 1:
            raise ValueError("task: its actions must be one row of numbers")
        self._torch, self._dict = torch, TensorDict
        task.mode = task.metadata["autoreset_mode"] = AutoresetMode.SAME_STEP
        self.task = task
        self.device = torch.device(device or task.xp.device or "cpu")
        self.num_envs = task.num_envs
        self.num_actions = task.single_action_space.shape[0]
        self.max_episode_length = task.episode
        self.cfg = {"task": type(task).__name__, "num_envs": task.num_envs, "step_dt": task.time_step,
                    "decimation": task.decimation, "episode": task.episode, "seed": seed}
        low, high = task.single_action_space.low.astype(float), task.single_action_space.high.astype(float)
        bounded = np.isfinite(low) & np.isfinite(high)
        middle = np.where(bounded, (np.where(bounded, low, 0) + np.where(bounded, high, 0)) / 2, 0.0)
        half = np.where(bounded, (np.where(bounded, high, 0) - np.where(bounded, low, 0)) / 2, 1.0)
        self._bounded, self._middle, self._half = (task.xp.array(x) for x in (bounded, middle, half))
        self._now, _ = task.reset(seed=seed)

    @property
    def unwrapped(self):
        return self

    @property
    def step_dt(self):
        """Of the task, s."""
        return self.task.time_step

    @property
    def episode_length_buf(self):
        """Steps since each episode began; it can be set."""
        return self._torch.from_numpy(self.task.steps).to(self.device)

    @episode_length_buf.setter
    def episode_length_buf(self, steps):
        self.task.steps[:] = steps.cpu().numpy()

    def _tensor(self, values):
        if not is_tensor(values):
            values = np.asarray(values, np.float32)
        return self._torch.as_tensor(values, dtype=self._torch.float32, device=self.device)

    def _observed(self):
        return self._dict({"policy": self._tensor(self._now)}, batch_size=[self.num_envs], device=self.device)

    def get_observations(self):
        """A TensorDict of what is observed now."""
        return self._observed()

    def reset(self):
        """All begin again, each with its next episode. Runners do without."""
        self._now, _ = self.task.reset()
        return self._observed(), {}

    def step(self, actions):
        """(observations, rewards, dones, extras). extras: "time_outs" says which were cut off, "log" the share of those
        that ended whose state had failed."""
        xp = self.task.xp
        actions = xp.copy(actions.detach())
        actions = xp.where(self._bounded, xp.clip(actions, -1, 1), actions)
        self._now, rewards, terminated, truncated, failed, _ = self.task.advance(self._middle + self._half * actions)
        done = terminated | truncated
        extras = {"time_outs": self._torch.as_tensor(truncated, device=self.device)}
        if done.any():
            extras["log"] = {"/episode/failed": float(failed[done].mean())}
        dones = self._torch.as_tensor(done, device=self.device).to(self._torch.long)
        return self._observed(), self._tensor(rewards), dones, extras

    def close(self):
        self.task.close()
