"""Environments on a CUDA device as tensors of torch: skipped where there is none, or no torch that has one."""
import numpy as np
import pytest

torch = pytest.importorskip("torch")

import subadmm  # noqa: E402

if not torch.cuda.is_available() or not any(b["name"] == "cuda" and b["f64"] for b in subadmm.backends()):
    pytest.skip("no CUDA device", allow_module_level=True)


def walker(backend, precision="f64"):
    """A body on two legs with drives, and a crate, above a plane."""
    world = subadmm.World(backend=backend, precision=precision)
    world.settings.dt = 0.004
    ground = world.add_body(type="static", environment=-1)
    ground.add_shape(subadmm.plane())
    along_y = np.array([1, -1, 0, 0]) / 2**0.5
    trunk = world.add_solid(subadmm.box(0.15, 0.1, 0.05), density=500, position=(0, 0, 0.5))
    for side in (-1, 1):
        leg = world.add_solid(subadmm.capsule(0.03, 0.1), density=800, position=(0, 0.12 * side, 0.35))
        servo = subadmm.Coordinate(drive="position", drive_stiffness=20, drive_damping=1)
        world.add_joint("revolute", trunk, leg, position=(0, 0.12 * side, 0.48), orientation=along_y,
                        coordinates={5: servo})
    world.add_solid(subadmm.box(0.1, 0.1, 0.1), density=300, position=(-1, 0.5, 0.1))
    return world


def bits(tensor):
    return tensor.detach().cpu().numpy().tobytes()


def numbers(tensor):
    return tensor.detach().cpu().numpy()


def push(many, step):
    """Wrenches that differ by environment and step, on either side."""
    wrench = many.array("body_wrench")
    given = np.zeros(tuple(wrench.shape))
    given[:, 1:, :3] = np.random.default_rng(step).uniform(-2, 2, given[:, 1:, :3].shape)
    wrench[:] = many.xp.array(given)


def test_host_and_device_agree():
    host, device = (subadmm.replicate(walker(backend), 5) for backend in ("cpu", "cuda"))
    assert device.device >= 0 and host.device == -1
    for step in range(10):
        for many in (host, device):
            push(many, step)
            many.step(4)
        # both solve a step to 1e-6 m/s: angular velocities to that over an arm of 0.05 m
        np.testing.assert_allclose(numbers(device.array("body_state")), host.array("body_state"), atol=2e-5)
    assert not device.failed.any() and (device.error >= 0).all() and (device.error < 1e-6).all()
    for name in ("gravity", "body_inertia", "joint_position", "joint_wrench", "body_contact_wrench"):
        ours, theirs = device.get(name), host.get(name)
        # forces: 2e-6 m/s of 1 kg in a step of 4 ms are 5e-4 N
        np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=1e-3 * max(np.abs(theirs).max(), 1), err_msg=name)


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_tensors_are_where_they_lie(precision):
    many = subadmm.replicate(walker("cuda", precision), 64)
    state, single, wrench = many.array("body_state"), many.array("body_state", "f32"), many.array("body_wrench", "f32")
    places = [x.data_ptr() for x in (state, single, wrench)]
    assert state.is_cuda and state.dtype == torch.float64 and single.dtype == wrench.dtype == torch.float32
    wrench[4, 1, 0] = 30
    for _ in range(10):
        many.step(2)
    many.reset([1])
    many.step(1)
    assert [many.array(n, p).data_ptr() for n, p in (("body_state", "f64"), ("body_state", "f32"),
                                                     ("body_wrench", "f32"))] == places
    assert bits(single) == bits(state.to(torch.float32))
    assert bits(state[0]) == bits(state[63]) and state[4, 1, 0] > state[0, 1, 0] + 1e-3


def test_environments_are_what_one_alone_is():
    """To the bit, whatever the others do; a reset of some begins them as a new one begins."""
    many, one = subadmm.replicate(walker("cuda", "f32"), 33), subadmm.replicate(walker("cuda", "f32"), 1)
    state, alone = many.array("body_state"), one.array("body_state")
    many.array("body_wrench")[1::2, 1, 2] = 5
    for _ in range(20):
        many.step()
        one.step()
        assert bits(state[0]) == bits(alone[0]) == bits(state[32])
    many.reset(torch.arange(33) % 3 == 0)
    one.reset()
    many.step(7)
    one.step(7)
    assert bits(state[0]) == bits(alone[0]) == bits(state[6]) != bits(state[32 - 4])


def test_resets_and_kept_states():
    many = subadmm.replicate(walker("cuda"), 4)
    state = many.array("body_state")
    start = state.clone()
    many.step(30)
    kept, there = many.keep(2), state[2].clone()
    many.step(7)
    assert (state != start).any()
    many.reset(np.array([True, False, False, True]))
    assert bits(state[0]) == bits(start[0]) and bits(state[3]) == bits(start[3]) and bits(state[1]) != bits(start[1])
    many.reset(torch.tensor([1, 0], device="cuda"), states=[kept, 0])
    assert bits(state[1]) == bits(there) and bits(state[0]) == bits(start[0])
    many.forget(kept)
    with pytest.raises(ValueError, match="forgotten"):
        many.reset(states=kept)


def test_one_that_fails_is_alone():
    many, others = (subadmm.replicate(walker("cuda"), 3) for _ in range(2))
    many.array("body_wrench")[1, 1, 0] = float("nan")
    many.step(4)
    others.step(4)
    assert list(many.failed) == [False, True, False] and many.reason(1) and many.reason(0) == ""
    state, other = many.array("body_state"), others.array("body_state")
    assert bits(state[0]) == bits(other[0]) and bits(state[2]) == bits(other[2])
    many.array("body_wrench")[1, 1, 0] = 0
    many.reset(many.failed)
    many.step(4)
    assert not many.failed.any() and bits(state[1]) == bits(other[1])


def test_steps_wait_for_what_torch_has_begun():
    """On a stream of its own, behind work that takes far longer than a launch."""
    many, other = (subadmm.replicate(walker("cuda"), 8) for _ in range(2))
    other.array("body_wrench")[:, 1, 0] = 7.0
    other.step(3)
    stream = torch.cuda.Stream()
    with torch.cuda.stream(stream):
        wrench = many.array("body_wrench")
        work = torch.ones(2048, 2048, device="cuda")
        for _ in range(200):
            work = work @ work * 1e-4
        wrench[:, 1, 0] = 7.0 + 0 * work[0, 0].nan_to_num(0, 0, 0).double()
        many.step(3)
        copy = many.array("body_state") * 1
    stream.synchronize()
    assert bits(copy) == bits(other.array("body_state"))


def test_contacts_and_rays():
    many = subadmm.replicate(walker("cuda"), 3)
    many.record_contacts()
    many.step(200)
    one = many.contacts(1)
    crate = 300 * 0.2**3  # kg; the walker comes on top of it
    assert len(one) >= 4 and sum(one["force"][one["force"][:, 2] > 0, 2]) > 0.9 * 9.81 * crate
    distance, point, normal = many.cast_rays([[3.0, 3, 2]], [0, 0, -1.0], types=("static",))
    np.testing.assert_allclose(distance, 2, atol=1e-12)
    onto, _, _ = many.cast_rays([[-1.0, 0.5, 2]], [0, 0, -1.0])
    np.testing.assert_allclose(onto, 1.8, atol=1e-3)  # the crate, as deep in the ground as contacts leave it


@pytest.mark.parametrize("name", ["CartPole", "Ant", "LiftCube", "TurnCube", "Quadruped"])
def test_tasks_run(name):
    """Observations and rewards are those of the host's in the first steps, before contacts make more of a rounding."""
    pytest.importorskip("gymnasium", minversion="1.1")
    pytest.importorskip("mujoco")
    import subadmm.gym

    host, device = (getattr(subadmm.gym, name)(4, episode=20, backend=backend) for backend in ("cpu", "cuda"))
    seen = [numbers(torch.as_tensor(task.reset(seed=[5] * 4)[0])) for task in (host, device)]
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-5)  # no step yet: rounding, of angles from sines
    for step in range(25):
        action = np.random.default_rng(step).uniform(-1, 1, host.action_space.shape)
        given = [task.step(action) for task in (host, device)]
        ours, theirs = ([numbers(torch.as_tensor(x)) for x in g[:2]] for g in reversed(given))
        assert np.isfinite(ours[0]).all() and np.isfinite(ours[1]).all()
        if step < 2:  # steps are solved to 1e-6 m/s: what is taken from another place differs by its size
            np.testing.assert_allclose(ours[0], theirs[0], atol=1e-2, err_msg=f"{name}, step {step}")
            np.testing.assert_allclose(ours[1], theirs[1], atol=1e-2, err_msg=f"{name}, step {step}")
