"""Environments for reinforcement learning: gymnasium's VectorEnv over replicate(). Needs gymnasium 1.1 or later, and
mujoco to read the models.

    import subadmm.gym

    envs = subadmm.gym.CartPole(64)
    observations, info = envs.reset(seed=1)
    observations, rewards, terminated, truncated, info = envs.step(envs.action_space.sample())

Tasks: CartPole, Ant, Quadruped, LiftCube, TurnCube. A task of your own is a subclass of Task with four short functions.
What an environment does depends on its seed, its actions and nothing else: not on the others, not on their number, not
on the threads. RslRl is a task for rsl_rl.
"""

from .tasks.ant import Ant
from .tasks.cartpole import CartPole
from .tasks.hand import TurnCube
from .tasks.lift import LiftCube
from .tasks.quadruped import Quadruped
from .tasks.rsl_rl import RslRl
from .tasks.task import Task

__all__ = ["Ant", "CartPole", "LiftCube", "Quadruped", "RslRl", "Task", "TurnCube"]
