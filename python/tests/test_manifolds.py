"""The callback for manifolds, and surfaces that move."""
import gc
import threading
import weakref

import numpy as np
import pytest

import subadmm

G = 9.81


def sliding(mu=0.5):
    """A world with a box that slides at 1 m/s along x on a plane, and the box."""
    world = subadmm.World()
    world.add_body(type="static", shapes=[subadmm.plane(friction=mu)])
    box = world.add_solid(subadmm.box(0.1, 0.1, 0.1, friction=mu), mass=1, position=(0, 0, 0.1))
    box.linear_velocity = (1, 0, 0)
    return world, box


def test_belts_drag():
    world = subadmm.World()
    belt = subadmm.box(5, 5, 0.1, position=(0, 0, -0.1), surface_velocity=(0, 0.5, 0))
    assert belt.surface_velocity == pytest.approx((0, 0.5, 0))
    world.add_body(type="static", shapes=[belt])
    box = world.add_solid(subadmm.box(0.1, 0.1, 0.1), mass=1, position=(0, 0, 0.1))
    world.step(60)
    assert box.linear_velocity == pytest.approx((0, 0.5, 0), abs=1e-6)  # the step's tolerance
    world.shapes[0].set_surface_velocity((-0.25, 0, 0))
    world.step(60)
    assert box.linear_velocity == pytest.approx((-0.25, 0, 0), abs=1e-6)
    with pytest.raises(subadmm.InvalidArgument, match="must be 0 on a dynamic body"):
        world.shapes[1].set_surface_velocity((1, 0, 0))


def test_callbacks_decide():
    world, box = sliding()
    seen = []

    def decide(manifold):
        assert box in (manifold.body_a, manifold.body_b) and not manifold.hit and manifold.triangle == -1
        assert manifold.shape_a != manifold.shape_b and abs(manifold.normal[2]) == 1
        assert manifold.positions.shape == (4, 3) and manifold.separations.shape == (4,)
        assert manifold.enabled and manifold.restitution == 0 and manifold.friction == 0.5
        seen.append(manifold.begun)
        manifold.friction = 0.2

    world.set_manifold_callback(decide)
    world.step(10)
    dt = world.settings.dt
    assert box.linear_velocity[0] == pytest.approx(1 - 0.2 * G * 10 * dt, abs=1e-6)
    assert seen == [True] + 9 * [False]
    world.set_manifold_callback(None)
    world.step(5)
    assert len(seen) == 10
    assert box.linear_velocity[0] == pytest.approx(1 - 0.2 * G * 10 * dt - 0.5 * G * 5 * dt, abs=1e-6)


def test_callbacks_leave_out_and_carry():
    world, box = sliding()

    def carry(manifold):
        sign = 1 if manifold.body_a == box else -1
        manifold.surface_velocity = (0, sign * 0.5, 0)

    world.set_manifold_callback(carry)
    world.step(60)
    assert box.linear_velocity[1] == pytest.approx(0.5, abs=1e-6)
    world.set_manifold_callback(lambda manifold: setattr(manifold, "enabled", False))
    before = world.report.time
    world.step(20)
    fallen = world.report.time - before
    assert box.position[2] == pytest.approx(0.1 - G * fallen ** 2 / 2, abs=1e-6)


def test_what_a_callback_raises_ends_the_step():
    world, box = sliding()
    world.step(3)
    state = np.concatenate([box.position, box.linear_velocity])

    def fail(manifold):
        raise KeyError("mine")

    world.set_manifold_callback(fail)
    with pytest.raises(KeyError, match="mine"):
        world.step(2)
    assert np.array_equal(state, np.concatenate([box.position, box.linear_velocity]))
    world.set_manifold_callback(lambda manifold: setattr(manifold, "friction", -2))
    with pytest.raises(subadmm.InvalidArgument, match=r"manifold->friction = -2"):
        world.step()
    world.set_manifold_callback(None)
    world.step()
    assert world.report.step == 4


def test_callbacks_do_not_call_the_world():
    world, box = sliding()
    world.set_manifold_callback(lambda manifold: world.step())
    with pytest.raises(RuntimeError, match="must not call the world"):
        world.step()
    world.set_manifold_callback(lambda manifold: box.position)
    with pytest.raises(RuntimeError, match="must not call the world"):
        world.step()
    kept = []
    world.set_manifold_callback(kept.append)
    world.step()
    with pytest.raises(RuntimeError, match="within its callback"):
        kept[0].friction
    with pytest.raises(TypeError, match="callback = 3"):
        world.set_manifold_callback(3)


def test_other_threads_wait_for_a_step_with_a_callback():
    world, box = sliding()
    calls = []
    world.set_manifold_callback(lambda manifold: calls.append(threading.get_ident()))
    threads = [threading.Thread(target=lambda: [world.report for _ in range(200)]) for _ in range(2)]
    for thread in threads:
        thread.start()
    world.step(100)
    for thread in threads:
        thread.join(30)
        assert not thread.is_alive()
    assert set(calls) == {threading.get_ident()}


def test_a_callback_that_holds_its_world_is_collected():
    world, _ = sliding()
    world.set_manifold_callback(lambda manifold, world=world: None)
    world.step()
    gone = weakref.ref(world)
    del world, _
    gc.collect()
    assert gone() is None
