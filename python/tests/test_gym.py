"""Tasks of subadmm.gym: gymnasium's rules for resets, and what an environment does depends on itself alone."""
import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", minversion="1.1")
from gymnasium.vector import AutoresetMode  # noqa: E402

import subadmm.gym  # noqa: E402
from subadmm.tasks.cartpole import MODEL  # noqa: E402
from subadmm.tasks.task import load_text  # noqa: E402


def run(envs, steps, seed=3, actions=None):
    """Everything that comes out, with actions that are an environment's own."""
    observations, _ = envs.reset(seed=seed)
    out = [observations]
    for step in range(steps):
        forces = 10 * np.sin(0.3 * step + np.arange(envs.num_envs)) if actions is None else actions(step)
        out.append(envs.step(np.resize(forces, envs.num_envs)[:, None])[:4])
    return out


def flat(out):
    return [np.asarray(x, float) for step in out[1:] for x in step]


def test_spaces_and_shapes():
    envs = subadmm.gym.CartPole(5)
    observations, info = envs.reset(seed=1)
    assert observations.shape == (5, 4) and observations in envs.observation_space and info == {}
    assert envs.single_action_space.shape == (1,) and envs.single_action_space.high == [10]
    got = envs.step(envs.action_space.sample())
    assert [x.shape for x in got[:4]] == [(5, 4), (5,), (5,), (5,)] and got[4] == {}
    assert isinstance(envs, gymnasium.vector.VectorEnv) and envs.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    with pytest.raises(ValueError, match="actions: must have shape"):
        envs.step(np.zeros((5, 2)))


def test_what_is_refused():
    with pytest.raises(ValueError, match="decimation"):
        subadmm.gym.Task(load_text(MODEL), 2, decimation=0)
    with pytest.raises(TypeError, match="robot"):
        subadmm.gym.Task(subadmm.World(), 2)
    envs = subadmm.gym.CartPole(3)
    for seed in (-5, [1, 2], [1, -2, 3], [0.5, 1, 2]):
        with pytest.raises(ValueError, match="seed|Seed"):
            envs.reset(seed=seed)
    with pytest.raises(ValueError, match="reset_mask"):
        envs.reset(options={"reset_mask": [True]})


def test_an_environment_depends_on_itself_alone():
    """The third of seven is that of its seed alone; equal seeds are equal; threads do not matter."""
    seven = run(subadmm.gym.CartPole(7, threads=2), 60, actions=lambda step: 8 * np.sin(0.4 * step) * np.ones(7))
    one = run(subadmm.gym.CartPole(1, threads=1), 60, seed=5, actions=lambda step: np.array([8 * np.sin(0.4 * step)]))
    for many, single in zip(flat(seven), flat(one)):
        assert (many[2] == single[0]).all()
    equal = run(subadmm.gym.CartPole(4), 60, seed=[9] * 4, actions=lambda step: 8 * np.sin(0.4 * step) * np.ones(4))
    for many in flat(equal):
        assert (many == many[0]).all()
    assert any(step[2].any() for step in seven[1:])  # episodes ended on the way


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP, AutoresetMode.DISABLED])
def test_resets(mode):
    envs = subadmm.gym.CartPole(3, episode=30, autoreset_mode=mode)
    observations, _ = envs.reset(seed=2)
    begun = np.abs(observations).max()
    assert 0 < begun <= 0.05
    ended = False
    for step in range(80):
        pushed = np.array([[10.0], [0.0], [0.0]])  # the first falls soon, the others are cut off or fall
        if mode == AutoresetMode.DISABLED and ended:
            with pytest.raises(ValueError, match="must be reset first"):
                envs.step(pushed)
            mask = terminated | truncated
            before = observations.copy()
            observations, _ = envs.reset(options={"reset_mask": mask})
            assert (observations[~mask] == before[~mask]).all() and np.abs(observations[mask]).max() <= 0.05
            assert (envs.steps[mask] == 0).all()
        over = np.zeros(3, bool) if not ended else terminated | truncated
        observations, rewards, terminated, truncated, info = envs.step(pushed)
        if mode == AutoresetMode.NEXT_STEP and over.any():
            assert (rewards[over] == 0).all() and not (terminated | truncated)[over].any()
            assert np.abs(observations[over]).max() <= 0.05
        now = terminated | truncated
        if mode == AutoresetMode.SAME_STEP and now.any():
            assert (info["_final_obs"] == now).all() and np.abs(observations[now]).max() <= 0.05
            for k in np.flatnonzero(terminated):
                assert abs(info["final_obs"][k][1]) > 0.2
        ended = now.any()
        assert not (terminated & truncated).any()


def test_one_that_fails_ends_its_episode():
    envs = subadmm.gym.CartPole(3)
    envs.reset(seed=1)
    _, rewards, terminated, _, info = envs.step(np.array([[0.0], [np.nan], [0.0]]))
    assert list(terminated) == [False, True, False] and list(info["failed"]) == [False, True, False]
    assert list(rewards) == [1, 0, 1]
    observations, _, terminated, _, info = envs.step(np.zeros((3, 1)))
    assert not terminated.any() and info == {} and np.abs(observations[1]).max() <= 0.05


def test_ant():
    """It stands, its observation is MuJoCo's, and pushing pays nothing."""
    envs = subadmm.gym.Ant(3)
    observations, _ = envs.reset(seed=4)
    assert observations.shape == (3, 13 + 14) and np.ptp(observations, axis=0).max() > 0.01
    total = np.zeros(3)
    for _ in range(20):
        observations, rewards, terminated, truncated, _ = envs.step(np.zeros((3, 8)))
        total += rewards
        assert not terminated.any()
    assert (total > 10).all() and (observations[:, 0] > 0.3).all()
    still = envs.step(np.zeros((3, 8)))[1]
    costly = envs.step(np.ones((3, 8)))[1]
    assert (costly < still - 2).all()  # 0.5 x 8 for the actions


def test_random_numbers_are_even():
    envs = subadmm.gym.CartPole(64)
    envs.reset(seed=0)
    drawn = envs.uniform(np.arange(64), 500)
    assert abs(drawn.mean()) < 0.02 and abs(drawn.std() - 1 / np.sqrt(3)) < 0.01  # 32,000 numbers
    assert drawn.min() >= -1 and drawn.max() < 1 and len(np.unique(drawn)) == drawn.size
