"""Environments whose arrays are tensors of torch, as on CUDA, here on the host: one code makes the numbers, so they are
those that numpy has but for the rounding of its functions."""
import sys
import types

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mujoco")

import subadmm  # noqa: E402
from subadmm import namespace, rotations  # noqa: E402
from subadmm.environments import Environments  # noqa: E402

ROBOT = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.004"/>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <body name="torso" pos="0 0 1.1" quat="0.9 0.1 0.2 -0.3">
      <freejoint name="root"/>
      <geom type="capsule" size="0.07" fromto="0 -0.07 0 0 0.07 0" mass="5"/>
      <geom type="sphere" size="0.09" pos="0 0 0.19" mass="2"/>
      <body name="waist" pos="-0.01 0 -0.26">
        <joint name="abdomen" type="ball" damping="1"/>
        <geom type="capsule" size="0.06" fromto="0 -0.06 0 0 0.06 0" mass="3"/>
        <body name="thigh" pos="0 -0.1 -0.04">
          <joint name="hip" axis="0 1 0" ref="0.2" damping="0.5" armature="0.01"/>
          <joint name="hip_aside" axis="1 0 0" pos="0.01 0 0.02" damping="0.5"/>
          <geom type="capsule" size="0.05" fromto="0 0 0 0 0.01 -0.34" mass="3"/>
          <body name="shin" pos="0 0.01 -0.4">
            <joint name="knee" axis="0 -1 0" range="-0.1 2.5" damping="0.5"/>
            <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -0.3" mass="2"/>
            <body name="foot" pos="0 0 -0.35">
              <joint name="slide" type="slide" axis="0 0.2 1" range="-0.05 0.05" damping="20"/>
              <geom type="sphere" size="0.05" mass="0.5"/>
            </body>
          </body>
        </body>
      </body>
    </body>
    <body name="crate" pos="-1 0.5 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body>
  </worldbody>
  <actuator>
    <motor name="hip" joint="hip" gear="20" ctrllimited="true" ctrlrange="-1 1"/>
    <position name="knee" joint="knee" kp="50" kv="2"/>
    <velocity name="hip_aside" joint="hip_aside" kv="3"/>
    <motor name="slide" joint="slide" forcelimited="true" forcerange="-5 5"/>
  </actuator>
</mujoco>
"""
ROUNDING = 1e-15  # of the largest number: a few of float64's


class Tensors(subadmm.Robots):
    """On the host, as tensors."""

    _tensors = True


class AsOnADevice(Tensors):
    """Does what robots on a device do, with memory of the host."""

    device = 0
    xp = property(lambda self: namespace.of_torch("cpu"))


@pytest.fixture
def make(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(ROBOT)
    return lambda kind, count=6: kind(subadmm.load(path, backend="cpu"), count)


def expect_equal(tensor, array, rounding=ROUNDING):
    assert isinstance(tensor, torch.Tensor) and tensor.dtype == torch.float64
    np.testing.assert_allclose(tensor.numpy(), array, rtol=0, atol=rounding * max(np.abs(array).max(initial=0), 1))


@pytest.mark.parametrize("kind", [Tensors, AsOnADevice])
def test_robots_are_those_of_numpy(make, kind):
    robots, tensors = make(subadmm.Robots), make(kind)
    mount = "shin", (0.1, 0, 0.2), (0.9, 0.1, 0, 0.3)
    random = np.random.default_rng(1)
    for step in range(12):
        ctrl = random.uniform(-1.5, 1.5, robots.ctrl.shape)
        robots.ctrl[:] = ctrl
        tensors.ctrl[:] = torch.from_numpy(ctrl)
        robots.step(5)
        tensors.step(5)
        expect_equal(tensors.array("joint_target_position"), robots.array("joint_target_position"))
        expect_equal(tensors.array("body_state"), robots.array("body_state"))
        expect_equal(tensors.q, robots.q)
        expect_equal(tensors.qd, robots.qd)
        for ours, theirs in ((tensors.frame(*mount), robots.frame(*mount)), (tensors.imu(*mount), robots.imu(*mount))):
            for tensor, array in zip(ours, theirs):
                expect_equal(tensor, array)
        assert (tensors.error == robots.error).all()
    assert np.ptp(robots.q, axis=0).max() > 0.1 and not robots.failed.any() and (robots.error < 1e-6).all()
    # Sums along the tree: some more roundings.
    for which in (None, [1, 3]):
        expect_equal(tensors.mass_matrix(which), robots.mass_matrix(which), 1e-14)
        expect_equal(tensors.bias(which), robots.bias(which), 1e-14)
        expect_equal(tensors.jacobian("foot", (0.1, 0, 0), which), robots.jacobian("foot", (0.1, 0, 0), which), 1e-14)


def test_dynamics_have_the_inputs_of_each(make):
    """Where they are on a device, too, which has no array of these until it is asked for."""
    robots, tensors = make(subadmm.Robots), make(AsOnADevice)
    scale = np.linspace(0.5, 2, 6)[:, None, None]
    for many in (robots, tensors):
        many.step(3)
        inertia = many.array("body_inertia", "f32")
        inertia[:] = many.xp.array(scale.astype(np.float32)) * inertia
        many.set("joint_armature", scale * many.get("joint_armature"))
        many.set("body_gravity_scale", scale * many.get("body_gravity_scale"))
    assert np.ptp(robots.mass_matrix(), axis=0).max() > 0.1 and np.ptp(robots.bias(), axis=0).max() > 1
    expect_equal(tensors.mass_matrix(), robots.mass_matrix(), 1e-14)
    expect_equal(tensors.bias([4, 2]), robots.bias([4, 2]), 1e-14)
    settings = tensors.settings
    settings.gravity = (0, 0, -3.7)
    for many in (robots, tensors):
        many.settings = settings
    expect_equal(tensors.bias(), robots.bias(), 1e-14)
    expect_equal(tensors.imu("foot")[1], robots.imu("foot")[1])
    for many in (robots, tensors):
        many.set("gravity", scale * np.array([0.3, 0, -3.7]))
    assert np.ptp(robots.bias(), axis=0).max() > 1
    expect_equal(tensors.bias(), robots.bias(), 1e-14)
    expect_equal(tensors.bias([4, 2]), robots.bias([4, 2]), 1e-14)
    expect_equal(tensors.imu("foot")[1], robots.imu("foot")[1])


def test_tensors_share_the_memory(make):
    robots = make(Tensors)
    state, wrench = robots.array("body_state"), robots.array("body_wrench")
    at = state.data_ptr(), wrench.data_ptr(), robots.array("body_state", "f32").data_ptr()
    crate = robots.loaded.world.bodies.index(robots.loaded.bodies["crate"])
    robots.step(20)
    wrench[4, crate, 0] = 15  # N: more than friction holds
    robots.step(10)
    assert (state[:4] == state[5]).all() and state[4, crate, 0] > state[5, crate, 0] + 1e-3
    again = robots.array("body_state"), robots.array("body_wrench"), robots.array("body_state", "f32")
    assert at == tuple(x.data_ptr() for x in again) and (again[2] == state.to(torch.float32)).all()
    robots.reset()
    del robots
    assert torch.isfinite(state).all() and (state == state[0]).all()  # kept by the tensor


def test_tensors_are_taken_wherever_numbers_are(make):
    """Positions, masks, states and values; gradients are no affair of a step's."""
    robots, tensors = make(subadmm.Robots), make(Tensors)
    q, qd = robots.q, np.linspace(-1, 1, 6)[:, None] * np.ones(robots.loaded.source.nv)
    q[:, 2] += np.linspace(0, 1, 6)
    robots.set_positions(q, qd)
    tensors.set_positions(torch.from_numpy(q), torch.from_numpy(qd))
    kept = [many.keep(3) for many in (robots, tensors)]
    tensors.ctrl = torch.zeros(6, 4, requires_grad=True) + 0.5
    robots.ctrl[:] = 0.5
    for many in (robots, tensors):
        many.step(4)
    mask = robots.q[:, 2] > 1.5
    assert 0 < mask.sum() < 6
    robots.reset(mask, [kept[0]] * mask.sum())
    tensors.reset(tensors.q[:, 2] > 1.5, torch.tensor([kept[1]] * int(mask.sum())))
    values = 2 * robots.get("body_gravity_scale", [0, 2])
    robots.set("body_gravity_scale", values, [0, 2])
    tensors.set("body_gravity_scale", torch.from_numpy(values), torch.tensor([0, 2]))
    for many in (robots, tensors):
        many.step(2)
    assert not tensors.array("joint_target_position").requires_grad
    expect_equal(tensors.array("body_state"), robots.array("body_state"))
    up = tensors.q[:, None, :3] + torch.tensor([0, 0, 1.0])
    distance, _, _ = tensors.cast_rays(up, torch.tensor([0, 0, -1.0]), types=("static",))
    np.testing.assert_allclose(distance[:, 0], up[:, 0, 2].numpy(), rtol=1e-12)
    assert isinstance(tensors.get("body_state"), np.ndarray) and isinstance(tensors.error, np.ndarray)
    with pytest.raises(ValueError, match="a mask must have shape"):
        tensors.reset(torch.tensor([True]))


def test_one_with_a_control_that_is_no_number_is_alone(make):
    tensors = make(Tensors, 3)
    tensors.ctrl[1, 0] = torch.nan
    tensors.step(2)
    assert list(tensors.failed) == [False, True, False] and "nan" in tensors.reason(1)
    tensors.ctrl[1] = 0
    tensors.reset(torch.from_numpy(tensors.failed))
    tensors.step(2)
    assert not tensors.failed.any()
    tensors.ctrl = torch.zeros(3, 5)
    with pytest.raises(ValueError, match="ctrl: must have shape"):
        tensors.step()


def test_quaternions():
    """Products, turns and vectors of both, and of one of each."""
    random = np.random.default_rng(2)
    a, b, v = random.normal(size=(5, 1, 4)), random.normal(size=(3, 4)), random.normal(size=(5, 3, 3))
    v[0, 0] = 0
    a = a / np.linalg.norm(a, axis=-1, keepdims=True)
    for name, given in (("multiply", (a, b)), ("rotate", (a, v)), ("conjugate", (b,)), ("unit", (b,)),
                        ("of_vector", (v,)), ("to_vector", (a,))):
        function = getattr(rotations, name)
        expect_equal(function(*(torch.from_numpy(x) for x in given)), function(*given))
        expect_equal(function(torch.from_numpy(given[0]), *given[1:]), function(*given))


def test_without_torch(make, monkeypatch):
    """On a device, or without CUDA in it: what to install is said."""
    robots = make(subadmm.Robots, 2)
    robots._library = types.SimpleNamespace(bind=lambda name, precision: object())  # for DLPack
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(torch.cuda, "is_available", lambda: False)
        with pytest.raises(ImportError, match="this torch has no CUDA device: install"):
            robots.array("joint_wrench")
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(ImportError, match="are tensors of torch: python -m pip install torch"):
        robots.array("joint_wrench")


def test_calls_wait_for_torch(make):
    """What is on its stream is done before the library reads or writes an array."""
    robots, calls = make(Tensors, 2), []
    stream = types.SimpleNamespace(cuda_stream=0, synchronize=lambda: calls.append(robots.array("body_wrench").sum()))
    wrench = robots.array("body_wrench")
    robots._stream = lambda: stream
    for call in (robots.step, robots.reset, lambda: robots.set("body_wrench", 0.0), lambda: robots.get("body_wrench"),
                 lambda: robots.world(1), lambda: robots.keep(1)):
        calls.clear()
        wrench[:] = 1
        call()
        assert calls and calls[0] == wrench.numel()


# ---- tasks -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def gym():
    pytest.importorskip("gymnasium", minversion="1.1")
    import subadmm.gym

    return subadmm.gym


def pair(gym, monkeypatch, name):
    """The task with arrays, and with tensors."""
    plain = getattr(gym, name)(4, episode=3, autoreset_mode="SameStep")
    monkeypatch.setattr(Environments, "_tensors", True)
    task = getattr(gym, name)(4, episode=3, autoreset_mode="SameStep")
    assert isinstance(task.robots.q, torch.Tensor) and isinstance(plain.robots.q, np.ndarray)
    return plain, task


@pytest.mark.parametrize("name", ["CartPole", "Ant", "LiftCube", "TurnCube", "Quadruped"])
def test_tasks_see_what_those_of_numpy_see(gym, monkeypatch, name):
    """In the same states, since contacts make more of a rounding: controls, observations, rewards and ends."""
    plain, task = pair(gym, monkeypatch, name)
    random = np.random.default_rng(3)
    for seed in (2, 3):
        np.testing.assert_allclose(task.reset(seed=seed)[0], plain.reset(seed=seed)[0], rtol=0, atol=1e-15)
        for _ in range(5):
            actions = random.uniform(-1, 1, plain.action_space.shape)
            plain.act(actions)
            task.act(torch.from_numpy(actions))
            expect_equal(task.robots.ctrl, plain.robots.ctrl)
            plain.robots.step(10)
            task.robots.step(1)
            task.robots.set("body_state", plain.robots.get("body_state"))
            expect_equal(task.observe(), plain.observe(), 1e-12)  # states pass through the joints
            expect_equal(task.reward(), plain.reward(), 1e-10)  # with rates over a time step
            assert (task.done().numpy() == plain.done()).all()


@pytest.mark.parametrize("name", ["CartPole", "Ant"])
def test_steps_of_tasks_are_those_of_numpy(gym, monkeypatch, name):
    """With resets in between."""
    plain, task = pair(gym, monkeypatch, name)
    random = np.random.default_rng(3)
    for envs in (plain, task):
        envs.reset(seed=2)
    ended = 0
    for _ in range(7):
        actions = random.uniform(-1, 1, plain.action_space.shape)
        seen, expected = task.step(actions), plain.step(actions)
        assert all(isinstance(x, np.ndarray) for x in seen[:4]) and seen[0] in task.observation_space
        for ours, theirs in zip(seen[:4], expected[:4]):
            np.testing.assert_allclose(ours.astype(float), theirs.astype(float), rtol=0, atol=1e-9)
        assert seen[4].keys() == expected[4].keys()
        if seen[3].any():
            np.testing.assert_allclose(np.stack(seen[4]["final_obs"]), np.stack(expected[4]["final_obs"]), atol=1e-9)
        ended += seen[3].sum()
    assert ended == 8
    observations, rewards, terminated, *_ = task.advance(torch.zeros(plain.action_space.shape))
    assert isinstance(observations, torch.Tensor) and isinstance(rewards, torch.Tensor)
    assert observations.dtype == rewards.dtype == torch.float64 and isinstance(terminated, np.ndarray)


def test_rsl_rl_has_them_as_they_are(gym, monkeypatch):
    pytest.importorskip("tensordict")
    plain = gym.RslRl(gym.Ant(3, episode=4), seed=5)
    monkeypatch.setattr(Environments, "_tensors", True)
    envs = gym.RslRl(gym.Ant(3, episode=4), seed=5)
    assert envs.device == torch.device("cpu")
    random = np.random.default_rng(4)
    for _ in range(6):  # with ends of episodes
        actions = torch.from_numpy(random.uniform(-1.2, 1.2, (3, 8)).astype(np.float32))
        with torch.inference_mode():
            seen, rewards, dones, extras = envs.step(actions)
            expected, wanted, done, _ = plain.step(actions)
        assert torch.allclose(seen["policy"], expected["policy"], rtol=1e-6, atol=1e-6)
        assert torch.allclose(rewards, wanted, rtol=1e-6, atol=1e-6) and (dones == done).all()
        assert isinstance(envs._now, torch.Tensor) and seen["policy"].dtype == rewards.dtype == torch.float32
