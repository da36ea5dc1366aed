"""Tasks with contact: random actions leave every step solved, scripts do what the tasks ask, and an environment depends
on its seed alone."""
import numpy as np
import pytest

pytest.importorskip("gymnasium", minversion="1.1")
pytest.importorskip("mujoco")

import subadmm.gym  # noqa: E402
from subadmm.tasks import hand, lift, quadruped  # noqa: E402

TASKS = [subadmm.gym.LiftCube, subadmm.gym.TurnCube, subadmm.gym.Quadruped]


# ---- scripts ---------------------------------------------------------------------------------------------------------


def lift_it(envs):
    """Over the cube with open fingers, down, close, up."""
    k, q, ctrl = envs.steps, envs.robots.q, envs.robots.ctrl
    height = np.select([k < 40, k < 95], [np.maximum(ctrl[:, 2], -0.15), -0.274], -0.094)
    place = np.where(k[:, None] < 70, q[:, 5:7], ctrl[:, :2])
    way = (np.column_stack([place, height]) - ctrl[:, :3]) / lift.RATE
    return np.clip(np.column_stack([way, np.where(k >= 75, 1.0, -1.0)]), -1, 1)


def turn_it(envs):
    """All fingers close, sweep aside, open and go back, again and again."""
    def smooth(x):
        x = np.clip(x, 0, 1)
        return x * x * (3 - 2 * x)

    t = envs.steps % 60 / 60
    closed = smooth(t / 0.15) - smooth((t - 0.6) / 0.15)
    aside = 0.35 - 0.7 * smooth((t - 0.15) / 0.45) + 0.7 * smooth((t - 0.75) / 0.25)
    target = np.tile(np.stack([aside, 0.38 * closed, 1.2 + 0.4 * closed], -1), (1, 4))
    return (target - (hand.LEAST + hand.MOST) / 2) / ((hand.MOST - hand.LEAST) / 2)


def trot(envs):
    """Two legs at a time, across from each other, 2.5 steps a second."""
    moved = np.zeros((envs.num_envs, 12))
    for leg, shift in enumerate((0, np.pi, np.pi, 0)):
        phase = 2 * np.pi * 2.5 * envs.steps * envs.time_step + shift
        folded = np.maximum(0, -np.cos(phase))
        moved[:, 3 * leg + 1] = 0.25 * np.sin(phase) + 0.25 * folded
        moved[:, 3 * leg + 2] = -0.5 * folded
    return np.clip(moved / quadruped.REACH, -1, 1)


def follow(envs, script, steps, seed=3):
    """Rewards (steps x n); every step is solved and none ends before its time."""
    envs.reset(seed=seed)
    rewards = []
    for _ in range(steps):
        _, reward, terminated, _, info = envs.step(script(envs))
        expect_solved(envs)
        assert not terminated.any() and info == {}
        rewards.append(reward)
    return np.array(rewards)


def expect_solved(envs):
    report = envs.robots.array("report")[:, 0]
    assert (report[:, 1] <= 0).all() and (report[:, 0] < 1e-6).all()  # settings.tolerance


# ---- of all ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", TASKS)
def test_random_actions(task):
    envs = task(8, autoreset_mode="SameStep")
    observations, _ = envs.reset(seed=1)
    assert observations in envs.observation_space
    envs.action_space.seed(2)
    contacts = 0
    for _ in range(200):
        observations, rewards, _, _, info = envs.step(envs.action_space.sample())
        expect_solved(envs)
        assert "failed" not in info and not envs.robots.failed.any()
        assert np.isfinite(observations).all() and np.isfinite(rewards).all()
        contacts += envs.robots.array("report")[:, 0, 4].sum()
    assert contacts > 1000


@pytest.mark.parametrize("task", TASKS)
def test_equal_seeds_are_equal_bits(task):
    """The third of four on two threads, and one alone on one; two with one seed; and other seeds are others."""
    rng = np.random.default_rng(3)
    many, one = task(4, threads=2, episode=50), task(1, threads=1, episode=50)
    twins = task(2, episode=50)
    first, _ = many.reset(seed=5)
    own, _ = one.reset(seed=7)
    both, _ = twins.reset(seed=[9, 9])
    assert (first[2] == own[0]).all() and (both[0] == both[1]).all() and (first[2] != first[1]).any()
    for _ in range(80):  # an episode, and some of the next
        action = rng.uniform(-1, 1, (1, *many.single_action_space.shape))
        seen = [envs.step(np.repeat(action, envs.num_envs, axis=0)) for envs in (many, one, twins)]
        for k in range(4):
            assert (seen[0][k][2] == seen[1][k][0]).all() and (seen[2][k][0] == seen[2][k][1]).all()


@pytest.mark.parametrize("task", TASKS)
def test_no_number_as_an_action(task):
    """It ends that episode alone, and the next one is as any other."""
    envs, untouched = task(3, autoreset_mode="SameStep"), task(3, autoreset_mode="SameStep")
    for e in (envs, untouched):
        e.reset(seed=4)
    actions = np.zeros(envs.action_space.shape)
    expected = untouched.step(actions)[0]
    actions[1, 0] = np.nan
    seen, rewards, terminated, _, info = envs.step(actions)
    assert list(terminated) == [False, True, False] and list(info["failed"]) == [False, True, False]
    assert rewards[1] == 0 and (seen[[0, 2]] == expected[[0, 2]]).all() and np.isfinite(seen).all()
    fresh, _ = untouched.reset(options={"reset_mask": [False, True, False]})
    assert (seen[1] == fresh[1]).all()
    assert np.isfinite(envs.step(np.zeros_like(actions))[0]).all() and not envs.robots.failed.any()


# ---- each ------------------------------------------------------------------------------------------------------------


def test_a_script_lifts_the_cube():
    """Every cube is lifted and held without a slip: once it is up, it stays where it is between the fingers, to within
    what the servos' springs still give: less than 1e-8 m after 0.7 s."""
    envs = subadmm.gym.LiftCube(12)
    rewards = follow(envs, lift_it, 150)
    sizes = envs.robots.array("shape_size")[:, envs._shape, 0]
    assert len(np.unique(sizes)) == 12 and 0.015 <= sizes.min() < sizes.max() <= 0.025
    held = envs.robots.q
    for _ in range(45):
        envs.step(lift_it(envs))
    q = envs.robots.q
    assert (q[:, 7] - sizes > envs.LIFT).all()
    np.testing.assert_allclose(q[:, 5:8] - q[:, :3], held[:, 5:8] - held[:, :3], atol=1e-8)
    np.testing.assert_allclose(q[:, 8:], held[:, 8:], atol=1e-8)
    still = follow(envs, lambda envs: np.zeros((12, 4)), 150)
    assert (rewards.sum(axis=0) > 2 * still.sum(axis=0)).all() and (rewards[-1] > 4.5).all()
    # Fingers that close beside it do not.
    envs.reset(seed=3)
    for _ in range(150):
        actions = lift_it(envs)
        actions[:, 1] = np.where(envs.steps < 40, 1.0, 0.0)
        envs.step(actions)
    assert (envs.robots.q[:, 7] < 0.03).all()


def test_a_script_turns_the_cube():
    envs = subadmm.gym.TurnCube(12)
    rewards = follow(envs, turn_it, 300)
    # rad, less what changes of the actions cost; without looking, one cube in ten gets out of the fingers' reach
    assert np.sort(rewards.sum(axis=0))[2] > 2 and np.median(rewards.sum(axis=0)) > 4
    still = follow(envs, lambda envs: envs._last.copy(), 60)
    assert np.abs(still.sum(axis=0)).max() < 0.01


def test_a_script_walks():
    """A trot with its eyes shut is worth far more than standing; each walks on ground of its own."""
    envs = subadmm.gym.Quadruped(12)
    rewards = follow(envs, trot, 250)
    place = envs.robots.q[:, :3]
    assert (place[:, 0] > 1.2).all() and np.abs(place[:, 1]).max() < 1  # m, in 5 s
    frames = envs.robots.array("shape_frame")[:, envs._ground, :2]
    assert len(np.unique(frames)) == 24 and np.abs(frames).max() <= quadruped.AWAY
    standing = follow(envs, lambda envs: np.zeros((12, 12)), 100)
    assert rewards.mean() > 2 * standing.mean() > 0
    height = envs.robots.q[:, 2]
    distance, _, _ = envs.robots.cast_rays(envs.robots.q[:, None, :3], [0, 0, -1.0], types=("static",))
    assert np.ptp(height) > 0.01  # of its ground
    assert (np.abs(distance[:, 0] - quadruped.HEIGHT) < 0.04).all()
    # The heights that it observes are those below it.
    seen = envs.observe()[:, -15:].reshape(-1, 3, 5)
    assert (np.abs(seen + quadruped.HEIGHT) < 0.1).all() and (np.ptp(seen.reshape(12, -1), axis=1) > 0).all()
