"""Many copies of worlds and robots: the numbers of worlds of their own, MuJoCo's order and frames, arrays without a
copy.

Bounds without a reason beside them are rounding's: 1e-12 of numbers of size 1, 1e-10 through a tree of joints, 1e-9 and
1e-8 of forces, which are sums of products of such numbers."""
import numpy as np
import pytest

import subadmm

ROBOT = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.004"/>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <body name="trunk" pos="0.2 -0.1 0.6" quat="0.9 0.1 0.2 -0.3">
      <freejoint name="root"/>
      <geom type="box" size="0.15 0.1 0.05" pos="0.02 0.01 0" mass="3"/>
      <body name="arm" pos="0.1 0.1 0.1">
        <joint name="ball" type="ball" damping="0.1"/>
        <geom type="capsule" size="0.03" fromto="0 0 0 0.2 0.05 0.1" mass="0.5"/>
        <body name="hand" pos="0.2 0.05 0.1" euler="0.3 0.2 0.1">
          <joint name="hinge" axis="0 1 1" ref="0.2" damping="0.05"/>
          <joint name="turn" axis="1 0 0" pos="0.01 0 0.02" damping="0.05"/>
          <geom type="box" size="0.04 0.03 0.02" pos="0.03 0 0" mass="0.3"/>
        </body>
      </body>
      <body name="slider" pos="-0.1 0 -0.06">
        <joint name="slide" type="slide" axis="0 0.2 1" range="-0.05 0.05" damping="2"/>
        <geom type="sphere" size="0.05" mass="0.4"/>
      </body>
    </body>
    <body name="post" pos="1.5 0 0.5">
      <joint name="post" axis="0 0 1" damping="0.1"/>
      <geom type="box" size="0.2 0.02 0.02" pos="0.15 0 0" mass="1"/>
      <body name="lid" pos="0.3 0 0.05">
        <joint name="lid" axis="0 1 0" damping="0.02"/>
        <geom type="box" size="0.1 0.05 0.01" pos="0.1 0 0" mass="0.2"/>
      </body>
    </body>
    <body name="crate" pos="-1 0.5 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body>
  </worldbody>
  <actuator>
    <motor name="motor" joint="hinge" gear="2" ctrllimited="true" ctrlrange="-1 1"/>
    <position name="servo" joint="slide" kp="200" kv="5"/>
    <velocity name="wheel" joint="post" kv="3"/>
    <motor name="lid" joint="lid" forcelimited="true" forcerange="-0.1 0.1"/>
  </actuator>
</mujoco>
"""


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(ROBOT)
    return path


@pytest.fixture
def robot(path):
    return subadmm.load(path, backend="cpu")


def controls(environment, step):
    return np.random.default_rng(100 * environment + step).uniform(-1.5, 1.5, 4)


def test_robots_step_as_each_by_itself(robot, path):
    """With controls that change, that are 0 for a while, and that are beyond their range."""
    single = [subadmm.load(path, backend="cpu") for _ in range(3)]
    robots = subadmm.replicate(robot, 3)
    state = robots.array("body_state")
    for step in range(12):
        for e, own in enumerate(single):
            robots.ctrl[e] = controls(e, step) if step % 4 else 0.0
            for actuator, value in zip(own.actuators.values(), robots.ctrl[e]):
                actuator.control = value
            own.world.step(5)
        robots.step(5)
        for e, own in enumerate(single):
            # A drive of no force is there in the one, and not in the other: both to the tolerance of a step.
            np.testing.assert_allclose(state[e], own.world.get("body_state"), atol=2e-6)
            np.testing.assert_allclose(robots.q[e], own.positions(), atol=2e-6)
    assert not robots.failed.any() and (robots.error >= 0).all() and (robots.error < 1e-6).all()
    assert np.abs(state[0] - state[1]).max() > 1e-3


def test_template_is_left_alone(robot):
    before = robot.world.save()
    robots = subadmm.replicate(robot, 2)
    robots.step(3)
    assert robot.world.save() == before


def test_positions_and_velocities_are_mujocos(robot):
    """Set for each, read back, and frames and velocities as MuJoCo has them."""
    import mujoco

    robots = subadmm.replicate(robot, 5)
    source, rng = robot.source, np.random.default_rng(3)
    robots.step(20)  # wherever they are
    q = rng.uniform(-1, 1, (5, source.nq))
    for k in range(source.njnt):
        at = source.jnt_qposadr[k]
        for kind, first in ((mujoco.mjtJoint.mjJNT_FREE, at + 3), (mujoco.mjtJoint.mjJNT_BALL, at)):
            if source.jnt_type[k] == kind:
                q[:, first : first + 4] /= np.linalg.norm(q[:, first : first + 4], axis=1, keepdims=True)
    qd = rng.uniform(-2, 2, (5, source.nv))
    robots.set_positions(q, qd)
    rows = {body: k for k, body in enumerate(robot.world.bodies)}
    state = robots.array("body_state")
    for e in range(5):
        data = mujoco.MjData(source)
        data.qpos[:], data.qvel[:] = q[e], qd[e]
        mujoco.mj_forward(source, data)
        for name in ("trunk", "arm", "hand", "slider", "post", "lid", "crate"):
            index, row = source.body(name).id, rows[robot.bodies[name]]
            own = np.zeros(6)
            mujoco.mj_objectVelocity(source, data, mujoco.mjtObj.mjOBJ_BODY, index, own, 0)
            np.testing.assert_allclose(state[e, row, :3], data.xipos[index], atol=1e-10, err_msg=name)
            np.testing.assert_allclose(state[e, row, 7:], np.roll(own, 3), atol=1e-10, err_msg=name)
    same = np.sign((robots.q * q).sum(axis=1)).min()  # of quaternions either sign is one
    assert same > 0
    for k in range(source.njnt):
        at, kind = source.jnt_qposadr[k], int(source.jnt_type[k])
        if kind in (2, 3):
            np.testing.assert_allclose(robots.q[:, at], q[:, at], atol=1e-10)
    np.testing.assert_allclose(robots.qd, qd, atol=1e-10)
    # One row for some of them; the others stay.
    before = state.copy()
    robots.set_positions(q[0], which=[1, 3])
    np.testing.assert_allclose(robots.qd[[1, 3]], 0, atol=1e-12)
    assert (state[[0, 2, 4]] == before[[0, 2, 4]]).all()
    with pytest.raises(ValueError, match="q: must be finite numbers"):
        robots.set_positions(q * np.nan)
    with pytest.raises(ValueError, match="1 row or 5, and has 2"):
        robots.set_positions(q[:2])
    with pytest.raises(ValueError, match="columns of real numbers"):
        robots.set_positions(q[:, 1:])


def test_refused_positions_change_nothing(robot):
    """Not even the turns that a joint has made."""
    robots = subadmm.replicate(robot, 2)
    q = robots.q
    q[:, 7 + 4] = 13.0  # the hinge: two turns and some
    robots.set_positions(q)
    before, state = robots.q, robots.array("body_state").copy()
    for wrong in ({"qd": np.full(robot.source.nv, 1e12)}, {"qd": np.full(robot.source.nv, np.nan)}):
        with pytest.raises(ValueError, match="qd: must be finite numbers within"):
            robots.set_positions(np.zeros_like(q) + 0.1, **wrong)
    with pytest.raises(ValueError, match="a quaternion, and must not be 0"):
        robots.set_positions(np.zeros_like(q))
    assert (robots.q == before).all() and (robots.array("body_state") == state).all()
    assert before[0, 7 + 4] == pytest.approx(13.0, abs=1e-9)


def test_equalities_do_not_carry_robots_along(tmp_path):
    """Bodies that are free each by itself are placed each by itself; a weld that is not active holds nothing."""
    model = """<mujoco><worldbody>
    <body name="a" pos="0 0 1"><freejoint/><geom size="0.1"/></body>
    <body name="b" pos="0.5 0 1"><freejoint/><geom size="0.1"/></body>
    <body name="c" pos="2 0 1"><joint name="hinge" axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body>
    </worldbody><equality><connect body1="a" body2="b" anchor="0.25 0 0"/>
    <weld body1="c" body2="a" active="false"/></equality></mujoco>"""
    path = tmp_path / "two.xml"
    path.write_text(model)
    robots = subadmm.replicate(subadmm.load(path, backend="cpu"), 2)
    q = np.array([[0, 0, 1, 1, 0, 0, 0, 0.5, 0, 1, 1, 0, 0, 0, 0.5], [3, 1, 2, 0, 1, 0, 0, -1, 0, 5, 0, 0, 1, 0, -0.4]])
    robots.set_positions(q)
    np.testing.assert_allclose(robots.q, q, atol=1e-12)


def test_scripts_are_not_lost_in_silence():
    world = subadmm.scene("grippers:2", backend="cpu")
    with pytest.raises(ValueError, match="script"):
        subadmm.replicate(world, 2)
    world.script = False
    assert len(subadmm.replicate(world, 2)) == 2


def test_resets_and_kept_states(robot):
    robots = subadmm.replicate(robot, 4)
    state, start = robots.array("body_state"), robots.array("body_state").copy()
    robots.step(30)
    kept, there = robots.keep(2), state[2].copy()
    robots.step(7)
    assert (state != start).any(axis=(1, 2)).all()
    robots.reset(np.array([True, False, False, True]))
    assert (state[[0, 3]] == start[[0, 3]]).all() and (state[1] != start[1]).any()
    robots.reset([1, 0], states=[kept, 0])
    assert (state[1] == there).all() and (state[0] == start[0]).all()
    robots.reset(states=kept)
    assert (state == there).all()
    robots.forget(kept)
    with pytest.raises(ValueError, match="forgotten"):
        robots.reset(states=kept)
    one = robots.world(3)
    one.step(11)
    robots.step(11)
    assert (one.get("body_state") == state[3]).all()


def test_arrays_are_where_they_lie(robot):
    robots = subadmm.replicate(robot.world, 6)
    crate = robot.world.bodies.index(robot.bodies["crate"])
    state, again = robots.array("body_state"), robots.array("body_state")
    assert state.__array_interface__["data"][0] == again.__array_interface__["data"][0]
    assert state.shape == (6, len(robot.world.bodies), 13) and not state.flags.writeable
    wrench, single = robots.array("body_wrench", "f32"), robots.array("body_state", "f32")
    assert wrench.dtype == single.dtype == np.float32 and wrench.flags.writeable
    at = state.__array_interface__["data"][0]
    wrench[4, crate, 0] = 8
    robots.step(10)
    assert robots.array("body_state").__array_interface__["data"][0] == at
    assert (single == state.astype(np.float32)).all()
    assert (state[:4] == state[5]).all() and state[4, crate, 0] > state[5, crate, 0]
    with pytest.raises(ValueError, match="precision"):
        robots.array("body_wrench", "f64")
    gravity = np.broadcast_to([0, 0, -3.0], (6, 1, 3)) * np.arange(6)[:, None, None]
    robots.set("gravity", gravity)
    robots.reset()
    robots.step(1)
    trunk = robot.world.bodies.index(robot.bodies["trunk"])
    falls = state[:, trunk, 9]  # of the first moment: in proportion to gravity, other forces are the same
    np.testing.assert_allclose(np.diff(falls), np.diff(falls)[0], rtol=1e-3)  # contacts of the slider begin
    assert falls[5] < falls[0] - 0.01
    del robots
    assert np.isfinite(state).all()  # kept by the array


def test_one_that_fails_is_alone(robot):
    robots, others = subadmm.replicate(robot, 3), subadmm.replicate(robot, 3)
    robots.ctrl[1, 0] = np.nan
    robots.step(4)
    others.step(4)
    assert list(robots.failed) == [False, True, False] and "nan" in robots.reason(1) and robots.reason(0) == ""
    state, other = robots.array("body_state"), others.array("body_state")
    assert (state[[0, 2]] == other[[0, 2]]).all()
    with pytest.raises(ValueError, match="marked"):
        robots.keep(1)
    robots.ctrl[1, 0] = 0
    robots.reset(robots.failed)
    robots.step(4)
    assert not robots.failed.any() and (state[1] == other[1]).all()


def test_sizes_and_terrain_of_each():
    """Balls of their own sizes, each on its own patch of one heightfield: at rest as high as a ray says that it is."""
    random = np.random.default_rng(4)
    world = subadmm.World(backend="cpu")
    ground = world.add_body(type="static", environment=-1)
    x = np.linspace(-8, 8, 161)
    steps = np.round(2 * np.sin(1.1 * x[:, None]) * np.cos(0.8 * x)) * 0.02  # flat between its edges
    ground.add_shape(subadmm.heightfield(steps, spacing=(0.1, 0.1)))
    ball = world.add_solid(subadmm.sphere(0.05), density=500, position=(0, 0, 0.4))
    ball.set_damping(2, 2)
    many = subadmm.replicate(world, 12)
    frame, size = many.array("shape_frame"), many.array("shape_size")
    frame[:, 0, :2] = random.uniform(-6, 6, (12, 2))
    size[:, 1, 0] = np.linspace(0.03, 0.08, 12)
    many.step(300)
    place = many.array("body_state")[:, 1, :3]
    distance, _, normal = many.cast_rays(place[:, None] + [0, 0, 1.0], [0, 0, -1.0], types=("static",))
    assert not many.failed.any() and len(np.unique(np.round(place[:, 2] - size[:, 1, 0], 4))) > 2
    flat = normal[:, 0, 2] > 1 - 1e-12
    assert flat.sum() > 6
    np.testing.assert_allclose((distance[:, 0] - 1)[flat], size[flat, 1, 0], atol=1e-3)  # what contacts leave
    many.reset()
    assert (size[:, 1, 0] == np.linspace(0.03, 0.08, 12)).all()
    alone = many.world(7)
    alone.step(50)
    many.step(50)
    assert (alone.get("body_state") == many.array("body_state")[7]).all()


def test_contacts_and_rays(robot):
    robots = subadmm.replicate(robot, 3)
    with pytest.raises(subadmm.Unavailable):
        robots.contacts(0)
    robots.record_contacts()
    robots.step(200)
    one = robots.contacts(1)
    assert len(one) >= 4 and (one["separation"] < 0.02).all()
    lifted = sum(one["force"][one["force"][:, 2] > 0, 2])
    assert lifted > 9.81  # the crate alone weighs so much
    # A scan of heights: the plane is below everything, what is above it nearer.
    grid = np.stack(np.meshgrid([-1.0, 0, 3], [0.5, 4]), -1).reshape(-1, 2)
    origins = np.concatenate([grid, np.full((6, 1), 2.0)], axis=1)
    distance, point, normal = robots.cast_rays(origins, [0, 0, -1.0], types=("static",))
    assert distance.shape == (3, 6) and point.shape == normal.shape == (3, 6, 3)
    np.testing.assert_allclose(distance, 2, atol=1e-12)
    np.testing.assert_allclose(normal, np.broadcast_to([0, 0, 1.0], normal.shape), atol=1e-12)
    onto, _, _ = robots.cast_rays(origins, [0, 0, -1.0], which=[2])
    assert onto.shape == (1, 6) and onto[0, 0] == pytest.approx(1.8, abs=1e-3) and onto[0, 2] == pytest.approx(2)
    assert np.isinf(robots.cast_rays(origins, [0, 0, -1.0], length=0.5)[0]).all()
    with pytest.raises(ValueError, match="must have shape"):
        robots.cast_rays(np.zeros((2, 6, 3)), [0, 0, -1.0])


def test_what_is_refused(robot):
    robots = subadmm.replicate(robot, 3)
    for given, error, match in ((lambda: subadmm.replicate(robot, 0), ValueError, "count = 0"),
                                (lambda: subadmm.replicate(3, 1), TypeError, "template = 3"),
                                (lambda: robots.step(0), ValueError, "steps = 0"),
                                (lambda: robots.reset([0, 0]), ValueError, "twice"),
                                (lambda: robots.reset([5]), ValueError, r"which\[0\] = 5"),
                                (lambda: robots.reset([0.5]), TypeError, "which: must be a mask or whole"),
                                (lambda: robots.reset([True]), ValueError, "a mask must have shape"),
                                (lambda: robots.reset([0], states=4), ValueError, r"states\[0\] = 4"),
                                (lambda: robots.array("nothing"), ValueError, "array = 'nothing'"),
                                (lambda: robots.set("body_state", np.zeros((2, 2))), ValueError, "must have shape"),
                                (lambda: robots.set("joint_wrench", 0.0), ValueError, "one that can be set"),
                                (lambda: robots.set("body_state", "x"), TypeError, "real numbers"),
                                (lambda: robots.reason(3), ValueError, "environment: 3")):
        with pytest.raises(error, match=match):
            given()
    settings = robots.settings
    settings.dt = 0.001
    robots.settings = settings
    assert robots.settings.dt == 0.001 and robot.world.settings.dt == 0.004
    assert len(robots) == 3 and repr(robots) == "<subadmm robots: 3>" and robots.memory > 1000


def test_dynamics_are_mujocos(robot):
    """Mass matrix, bias and Jacobians of random states, and inverse dynamics by both; with masses of one's own the
    energy is that of the bodies."""
    import mujoco

    robots = subadmm.replicate(robot, 4)
    source, rng = robot.source, np.random.default_rng(5)
    q, qd, qdd = rng.uniform(-1, 1, (4, source.nq)), rng.uniform(-2, 2, (4, source.nv)), rng.uniform(-5, 5, (4, source.nv))
    for at in (3, 7):
        q[:, at : at + 4] /= np.linalg.norm(q[:, at : at + 4], axis=1, keepdims=True)
    robots.set_positions(q, qd)
    q = robots.q  # of all joints: free ones have a unit quaternion now
    mass, bias, inverse = robots.mass_matrix(), robots.bias(), robots.inverse_dynamics(qdd)
    point = np.array([0.03, -0.02, 0.05])
    jacobian = robots.jacobian("hand", point)
    for e in range(4):
        data = mujoco.MjData(source)
        data.qpos[:], data.qvel[:] = q[e], robots.qd[e]
        mujoco.mj_forward(source, data)
        full = np.zeros((source.nv, source.nv))
        mujoco.mj_fullM(source, full, data.qM) if hasattr(data, "qM") else mujoco.mj_fullM(source, data, full)
        np.testing.assert_allclose(mass[e], full, atol=1e-10)
        np.testing.assert_allclose(bias[e], data.qfrc_bias, atol=1e-9)
        np.testing.assert_allclose(inverse[e], full @ qdd[e] + data.qfrc_bias, atol=1e-8)
        linear, angular = np.zeros((3, source.nv)), np.zeros((3, source.nv))
        at = data.xpos[source.body("hand").id] + data.xmat[source.body("hand").id].reshape(3, 3) @ point
        mujoco.mj_jac(source, data, linear, angular, at, source.body("hand").id)
        np.testing.assert_allclose(jacobian[e], np.concatenate([linear, angular]), atol=1e-12)
    armature = robots.array("joint_armature")
    hinge = robot.joints["post"]
    armature[1, robot.world.joints.index(hinge.joint), hinge.coordinate] = 7
    at = robot.source.jnt_dofadr[robot.source.joint("post").id]
    assert robots.mass_matrix()[1, at, at] == pytest.approx(mass[1, at, at] + 7)
    armature[:] = 0
    inertia = robots.array("body_inertia")
    inertia[:] *= rng.uniform(0.5, 2, (4, 1, 1))
    state = robots.array("body_state")
    named = [robot.world.bodies.index(body) for body in set(robot.bodies.values())]  # no carriers between two hinges
    turned = np.zeros((4, state.shape[1], 3))
    for e in range(4):
        for b in named:
            w, x, y, z = state[e, b, 3:7]
            matrix = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                               [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                               [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
            turned[e, b] = matrix.T @ state[e, b, 10:]
    energy = inertia[..., 0] * (state[..., 7:10] ** 2).sum(-1) + (inertia[..., 1:] * turned**2).sum(-1)
    velocity = robots.qd
    np.testing.assert_allclose(np.einsum("ni,nij,nj->n", velocity, robots.mass_matrix(), velocity), energy[:, named].sum(-1),
                               rtol=1e-9)
    assert robots.mass_matrix([2]).shape == (1, source.nv, source.nv)
    with pytest.raises(KeyError, match="nobody"):
        robots.jacobian("nobody")


def test_sensors(robot):
    """At rest an accelerometer reads gravity upwards; while it falls 0; on a turning arm the centripetal acceleration.
    Frames are those of the loaded robot."""
    robots = subadmm.replicate(robot, 2)
    for body in ("trunk", "hand", "lid"):
        place, turn = robots.frame(body)
        own = robot.frame(body)
        np.testing.assert_allclose(place, np.broadcast_to(own[0], (2, 3)), atol=1e-12)
        np.testing.assert_allclose(np.abs((turn * own[1]).sum(axis=1)), 1, atol=1e-12)
    robots.step(3)  # all but the post fall
    gyro, acceleration = robots.imu("crate", place=(0.3, 0.2, 0.1))
    np.testing.assert_allclose(gyro, 0, atol=1e-9)
    np.testing.assert_allclose(acceleration, [[0, 0, 9.81]] * 2, atol=1e-6)  # the crate stands on the plane
    q, qd = robots.q, np.zeros((2, robot.source.nv))
    q[:, 2] = 3.0
    qd[:, 3:6] = [[0, 0, 2.0], [0, 0, 0]]  # one turns about its axis as it falls
    robots.set_positions(q, qd)
    robots.step(1)
    gyro, acceleration = robots.imu("trunk", place=(0.5, 0, 0))
    assert abs(gyro[0, 2] - 2) < 0.1 and np.linalg.norm(acceleration[1]) < 1  # its arms pull a little
    assert acceleration[0, 0] - acceleration[1, 0] == pytest.approx(-2, abs=0.5)  # the turning one: -2^2 x 0.5
    with pytest.raises(KeyError):
        robots.imu("nobody")
    with pytest.raises(ValueError, match="does not move"):
        robots.frame("world")
