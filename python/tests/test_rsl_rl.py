"""A task as rsl_rl's VecEnv: what its runners ask for, and that one of them learns."""
import inspect

import numpy as np
import pytest

pytest.importorskip("gymnasium", minversion="1.1")
pytest.importorskip("mujoco")
torch = pytest.importorskip("torch")
tensordict = pytest.importorskip("tensordict")

import subadmm.gym  # noqa: E402


def test_it_is_the_task():
    """Observations, rewards and ends are the task's, with resets in the same step; actions go over its range."""
    envs = subadmm.gym.RslRl(subadmm.gym.CartPole(4, episode=25), seed=7)
    task = subadmm.gym.CartPole(4, episode=25, autoreset_mode="SameStep")
    expected, _ = task.reset(seed=7)
    assert (envs.num_envs, envs.num_actions, envs.max_episode_length) == (4, 1, 25)
    assert envs.device == torch.device("cpu") and envs.cfg["task"] == "CartPole" and envs.unwrapped.step_dt == 0.02
    cut = fell = 0
    for step in range(60):
        seen = envs.get_observations()
        assert isinstance(seen, tensordict.TensorDict) and seen.batch_size == torch.Size([4])
        assert seen["policy"].dtype == torch.float32 and (seen["policy"].numpy() == expected.astype(np.float32)).all()
        assert (envs.episode_length_buf.numpy() == task.steps).all()
        actions = torch.tensor([[3.0], [0.02 * (-1) ** step], [0.0], [-0.3]])  # beyond 1: as 1
        seen, rewards, dones, extras = envs.step(actions)
        expected, wanted, terminated, truncated, _ = task.step(10 * np.clip(actions.numpy().astype(float), -1, 1))
        assert (rewards.numpy() == wanted.astype(np.float32)).all() and rewards.shape == (4,)
        assert dones.dtype == torch.long and (dones.numpy() == (terminated | truncated)).all()
        assert (extras["time_outs"].numpy() == truncated).all()
        assert ("log" in extras) == bool(dones.any())
        cut, fell = cut + truncated.sum(), fell + terminated.sum()
    assert cut > 1 and fell > 1
    again, extras = envs.reset()
    assert extras == {} and (envs.episode_length_buf == 0).all() and not (again["policy"] == seen["policy"]).any()


def test_lengths_can_be_set():
    """As runners do, so that episodes do not all end at once."""
    envs = subadmm.gym.RslRl(subadmm.gym.CartPole(3, episode=20))
    envs.episode_length_buf = torch.tensor([0, 10, 18])
    ended = [envs.step(torch.zeros(3, 1))[3]["time_outs"].tolist() for _ in range(10)]
    assert ended[1] == [False, False, True] and ended[9] == [False, True, False] and sum(map(sum, ended)) == 2


def test_one_that_fails_is_logged():
    envs = subadmm.gym.RslRl(subadmm.gym.CartPole(2))
    _, rewards, dones, extras = envs.step(torch.tensor([[0.0], [float("nan")]]))
    assert dones.tolist() == [0, 1] and rewards.tolist() == [1, 0] and extras["log"] == {"/episode/failed": 1.0}
    assert torch.isfinite(envs.get_observations()["policy"]).all()


def test_what_is_refused():
    with pytest.raises(TypeError, match="task = 3"):
        subadmm.gym.RslRl(3)
    with pytest.raises(ValueError, match="episode > 0"):
        subadmm.gym.RslRl(subadmm.gym.CartPole(2, episode=0))


def test_a_runner_learns(tmp_path):
    """PPO: after some iterations poles stay up for longer than random forces keep them."""
    pytest.importorskip("rsl_rl")
    from rsl_rl.env import VecEnv
    from rsl_rl.runners import OnPolicyRunner

    for name in VecEnv.__abstractmethods__:
        assert list(inspect.signature(getattr(subadmm.gym.RslRl, name)).parameters) == \
            list(inspect.signature(getattr(VecEnv, name)).parameters)
    torch.manual_seed(1)
    envs = subadmm.gym.RslRl(subadmm.gym.CartPole(32, episode=100))
    network = {"class_name": "MLPModel", "hidden_dims": [32, 32], "activation": "elu", "obs_normalization": False}
    runner = OnPolicyRunner(envs, {
        "num_steps_per_env": 24, "save_interval": 1000, "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "actor": dict(network, distribution_cfg={"class_name": "GaussianDistribution", "init_std": 1.0}),
        "critic": network,
        "algorithm": {"class_name": "PPO", "learning_rate": 1e-2, "schedule": "fixed", "rnd_cfg": None, "gamma": 0.98,
                      "num_learning_epochs": 5, "num_mini_batches": 4, "entropy_coef": 0.0}}, log_dir=None)
    policy = runner.get_inference_policy()

    def upright():
        """Steps until the first fall or the end, by the policy's means."""
        envs.reset()
        alive, total = np.ones(32, bool), 0
        for _ in range(100):
            with torch.inference_mode():
                _, _, dones, _ = envs.step(policy(envs.get_observations()))
            total += alive.sum()
            alive &= dones.numpy() == 0
        return total / 32

    before = upright()
    runner.learn(25, init_at_random_ep_len=True)
    assert upright() > 2 * before
