"""Nothing that is read of a world changes a copy in silence: it is written through, or refused with what sets it."""
import copy
import gc
import pickle
import subprocess
import sys
import weakref

import numpy as np
import pytest

import subadmm


def falling():
    world = subadmm.World(settings=subadmm.Settings(threads=1))
    world.add_ground()
    return world, world.add_solid(subadmm.sphere(0.1), density=1000, position=(0, 0, 1), name="torso")


# ---- numbers of objects ---------------------------------------------------------------------------------------------


def test_numbers_are_not_written_to():
    world, body = falling()
    joint = world.add_joint("spherical", body, position=(0, 0, 1))
    coupling = world.add_coupling(body, linear_stiffness=1)
    shape = subadmm.box(1, 2, 3)
    world.step()
    before = world.save()
    for read, said in (
        (lambda: body.position, "x.position = "),
        (lambda: body.linear_velocity, "x.linear_velocity = "),
        (lambda: body.angular_velocity, "x.angular_velocity = "),
        (lambda: body.orientation, "x.orientation = "),
        (lambda: shape.position, "x.position = "),
        (lambda: world.settings.gravity, "x.gravity = "),
        (lambda: body.inertia, "is a copy"),
        (lambda: body.contact_wrench, "is a copy"),
        (lambda: joint.position, "is a copy"),
        (lambda: joint.frame_a[0], "is a copy"),
        (lambda: coupling.target[1], "is a copy"),
        (lambda: coupling.reaction_force, "is a copy"),
        (lambda: world.positions, r"World.set\(\"body_state\", states\)"),
        (lambda: world.velocities, r"World.set\(\"body_state\", states\)"),
    ):
        with pytest.raises(ValueError, match=said):
            read()[0] = 5
        with pytest.raises(ValueError):
            read()[...] += 1
        with pytest.raises(ValueError):
            np.add(read(), 1, out=read())
        with pytest.raises(ValueError):
            read().flat[0] = 5
    assert world.save() == before


def test_numbers_are_arrays():
    _, body = falling()
    x = body.position
    assert type(x + 1) is np.ndarray and type(x.copy()) is np.ndarray and type(copy.deepcopy(x)) is np.ndarray
    assert isinstance(x.sum(), float) and isinstance(x[2], float) and x.shape == (3,) and x.dtype == np.float64
    assert x == [0, 0, 1] and x == (0, 0, 1) and x != [0, 0, 2] and x == body.position and (x == [0, 0, 1]).all()
    assert (x == np.array([0, 0, 2])).tolist() == [True, True, False]
    assert pickle.loads(pickle.dumps(x)).tolist() == [0, 0, 1]
    own = np.array(x)
    own[2] = 3
    assert body.position == [0, 0, 1] and x == [0, 0, 1]
    body.position += (0, 0, 1)
    body.linear_velocity -= np.ones(3)
    body.linear_velocity *= 2
    body.angular_velocity = body.angular_velocity + [0, 0, 3]
    assert body.position == [0, 0, 2] and body.linear_velocity == [-2, -2, -2] and body.angular_velocity == [0, 0, 3]


def test_definitions_of_shapes_are_not_written_to():
    world, _ = falling()
    shape = world.shapes[1]
    with pytest.raises(ValueError, match="set_material, set_frame and set_size"):
        shape.definition.friction = 0.1
    own = shape.definition.copy()
    own.friction = 0.1
    assert copy.copy(own).friction == 0.1 and shape.definition.friction == 0.5


def test_coordinates_of_joints_are_not_written_to():
    world, body = falling()
    joint = world.add_joint("revolute", None, body, position=(0, 0, 2), coordinates={5: subadmm.Coordinate(friction=1)})
    with pytest.raises(ValueError, match="copy.. and give that to set_coordinate, or use set_target"):
        joint.coordinate(5).target_speed = 3
    own = joint.coordinate(5).copy()
    own.drive, own.target_speed, own.drive_force = "speed", 3, 4
    joint.set_coordinate(5, own)
    joint.set_target(5, speed=2)
    now = joint.coordinate(5)
    assert (now.drive, now.target_speed, now.drive_force, now.friction) == ("speed", 2, 4, 1) and own.target_speed == 3
    with pytest.raises(TypeError, match=r"coordinates\[5\] = 3: must be a subadmm.Coordinate"):
        world.add_joint("revolute", None, body, coordinates={5: 3})


# ---- settings -------------------------------------------------------------------------------------------------------


def test_settings_of_a_world_write_through():
    world, _ = falling()
    now = world.settings
    now.dt, now.method = 0.002, "paper"
    world.settings.gravity = (0, 0, -1)
    assert world.settings.dt == 0.002 and world.settings.method == "paper" and world.settings.gravity == [0, 0, -1]
    world.settings.gravity *= 2
    assert world.settings.gravity == [0, 0, -2]
    assert now.gravity == [0, 0, -9.81]  # as they were read
    now.iterations = 33  # that alone
    assert world.settings.iterations == 33 and world.settings.gravity == [0, 0, -2]
    for name, value, said in (("dt", -1, r"settings.dt = -1: must be in \[1e-06, 1\]"),
                              ("iterations", 0, "settings.iterations = 0")):
        with pytest.raises(subadmm.InvalidArgument, match=said):
            setattr(now, name, value)
        assert getattr(now, name) == getattr(world.settings, name) != value
    own = world.settings.copy()
    own.dt = -1  # of nobody: checked where it is set
    with pytest.raises(subadmm.InvalidArgument, match="settings.dt"):
        world.settings = own


def test_settings_of_environments_write_through():
    world, _ = falling()
    many = subadmm.replicate(world, 2)
    many.settings.dt = 0.003
    assert many.settings.dt == 0.003 and world.settings.dt == 0.005


def test_settings_are_values():
    settings = subadmm.Settings(dt=0.002, gravity=(0, 0, -1.62), method="paper", certify=True)
    for other in (settings.copy(), copy.copy(settings), copy.deepcopy(settings), pickle.loads(pickle.dumps(settings))):
        assert other == settings and other is not settings
        other.dt = 0.004
        assert other != settings and settings.dt == 0.002
    assert repr(settings) == ("subadmm.Settings(dt=0.002, gravity=(0.0, 0.0, -1.62), method='paper', certify=True)")
    assert eval(repr(settings)) == settings and settings != 3
    world, _ = falling()
    own = pickle.loads(pickle.dumps(world.settings))
    own.dt = 0.1
    assert world.settings.dt == 0.005 and own == subadmm.Settings(dt=0.1, threads=1)
    coordinate = subadmm.Coordinate(limited=True, lower=-1, upper=1)
    assert pickle.loads(pickle.dumps(coordinate)) == coordinate != subadmm.Coordinate()
    assert eval(repr(coordinate)) == coordinate


def test_settings_do_not_keep_a_world_in_a_cycle():
    class Env(subadmm.World):
        pass

    def make():
        world = Env()
        world.kept = world.settings
        return weakref.ref(world)

    ref = make()
    gc.collect()
    assert ref() is None
    world = Env()
    now, ref = world.settings, weakref.ref(world)
    del world
    gc.collect()
    assert ref() is not None  # settings keep what they are of, as bodies do
    now.dt = 0.001
    assert ref().settings.dt == 0.001


# ---- worlds ---------------------------------------------------------------------------------------------------------


def test_clones_make_the_same_steps():
    world, body = falling()
    body.angular_velocity = (3, 2, 1)
    world.step(100)
    other = world.clone()
    assert other.report.step == 100 and other.settings == world.settings and other["torso"].mass == body.mass
    before = world.state_hash()
    other.step(50)
    assert world.state_hash() == before
    world.step(50)
    assert world.state_hash() == other.state_hash() != before
    with pytest.raises(subadmm.InvalidArgument, match="must be of this world"):
        other.add_coupling(body)


def test_clones_of_scenes_go_on_with_their_script():
    world = subadmm.scene("kicked_cubes:20")
    world.step(30)
    other = world.clone()
    assert other.has_script and other.duration == world.duration
    world.step(150), other.step(150)  # past a kick: half a second
    assert world.state_hash() == other.state_hash() and world.velocities.any()


def test_names():
    world, body = falling()
    world.add_body(name="twin", mass=1, inertia=(1, 1, 1)), world.add_body(name="twin", mass=1, inertia=(1, 1, 1))
    world.add_body(mass=1, inertia=(1, 1, 1))
    assert world["torso"] == body and "torso" in world and "tors" not in world
    assert world.names == ["ground", "torso", "twin", "twin", ""]
    with pytest.raises(KeyError, match="'torzo': no body has this name; is it 'torso'"):
        world["torzo"]
    with pytest.raises(ValueError, match="'twin': 2 bodies have it, rows 2, 3"):
        world["twin"]
    with pytest.raises(TypeError, match="name = 0: must be a string"):
        world[0]
    with pytest.raises(KeyError):
        world[""]


def test_rows_of_contacts_and_events():
    world, body = falling()
    gone = world.add_solid(subadmm.sphere(0.1), density=1000, position=(1, 0, 0.1))
    last = world.add_solid(subadmm.sphere(0.1), density=1000, position=(2, 0, 0.1))
    world.record_events()
    world.step(10)
    contacts, events = world.contacts(), world.events()
    assert contacts["body_b"].shape == (2, 2)
    rows = np.stack([world.body_rows(contacts["body_a"]), world.body_rows(contacts["body_b"])], axis=1)
    assert np.sort(rows, axis=1).tolist() == [[0, gone.index], [0, last.index]]
    assert world.body_rows(np.stack([contacts["body_a"], contacts["body_b"]], axis=1)).tolist() == rows.tolist()
    shapes = world.shapes
    for contact in contacts:
        assert shapes[world.shape_rows(contact["shape_a"])].id == tuple(contact["shape_a"])
    assert set(world.body_rows(events["body_b"]).tolist() + world.body_rows(events["body_a"]).tolist()) == {0, 2, 3}
    ids = [body.id, gone.id, last.id]
    gone.remove()
    assert world.body_rows(ids).tolist() == [1, -1, 2] and world.body_rows(body.id) == 1
    assert world.body_rows(np.zeros((0, 2), np.uint32)).shape == (0,)
    for wrong in ([0.5, 1.0], 3, [[1, 2, 3]]):
        with pytest.raises(TypeError, match="ids: must be ids"):
            world.body_rows(wrong)


def test_how_things_are_shown():
    world, body = falling()
    joint = world.add_joint("spherical", body, position=(0, 0, 1))
    coupling = world.add_coupling(body, linear_stiffness=1)
    world.step()
    assert repr(world) == "<subadmm.World: 2 bodies, 2 shapes, 1 joints>"
    assert repr(body) == f"<subadmm.Body {body.id[0]}.{body.id[1]} 'torso', dynamic>"
    assert "sphere on <subadmm.Body" in repr(world.shapes[1])
    assert repr(joint).startswith("<subadmm.Joint 0, spherical, between ") and "the world" in repr(joint)
    assert repr(coupling).startswith("<subadmm.Coupling 0, of <subadmm.Body")
    assert repr(world.report).startswith("<subadmm.Report of step 1 on cpu f64: ")
    assert repr(subadmm.box(1, 2, 3)) == "<subadmm.Shape box, size [1.0, 2.0, 3.0] m>"
    assert repr(subadmm.mass_of([subadmm.box(1, 1, 1)], 1)).startswith("<subadmm.Mass 8 kg")
    joint.remove(), body.remove()
    assert repr(joint) == "<subadmm.Joint, removed>" and repr(body) == "<subadmm.Body, removed>"


def test_version():
    said = subprocess.run([sys.executable, "-m", "subadmm", "--version"], capture_output=True, text=True, check=True)
    assert said.stdout == f"subadmm {subadmm.__version__} ({subadmm.build_commit()})\n"


# ---- loaded robots --------------------------------------------------------------------------------------------------

ROBOT = """
<mujoco>
  <worldbody>
    <body name="torso" pos="0 0 1">
      <freejoint name="root"/>
      <geom size=".1"/>
      <site name="tip" pos=".1 .2 .3" quat="0 1 0 0"/>
      <body name="arm" pos=".2 0 0"><joint name="elbow" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/>
        <body name="ball" pos=".3 0 0"><joint name="wrist" type="ball"/><geom size=".05" mass=".1"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="elbow" ctrlrange="-1 1" ctrllimited="true"/></actuator>
  <keyframe>
    <key name="bent" qpos="1 0 2 1 0 0 0 .5 .6 .8 0 0" qvel="0 1 0 0 0 1 2 0 .1 0" ctrl=".25"/>
  </keyframe>
</mujoco>
"""


def test_robots_have_mujocos_numbers():
    mujoco = pytest.importorskip("mujoco")
    source = mujoco.MjModel.from_xml_string(ROBOT)
    robot = subadmm.load(source)
    data = mujoco.MjData(source)
    assert robot.q == pytest.approx(data.qpos, abs=1e-12) and robot.qd == pytest.approx(data.qvel, abs=1e-12)
    rng = np.random.default_rng(1)
    data.qpos[:] = rng.normal(size=source.nq)
    for at in (3, 8):
        data.qpos[at : at + 4] /= np.linalg.norm(data.qpos[at : at + 4]) * (1 if data.qpos[at] > 0 else -1)
    data.qpos[7], data.qvel[:] = 0.7, rng.normal(size=source.nv)
    robot.set_positions(data.qpos, data.qvel)
    assert robot.q == pytest.approx(data.qpos, abs=1e-9) and robot.qd == pytest.approx(data.qvel, abs=1e-9)
    mujoco.mj_kinematics(source, data)
    for name in ("torso", "arm", "ball"):
        x, turn = robot.frame(name)
        assert x == pytest.approx(data.body(name).xpos, abs=1e-9)
        assert abs(np.dot(turn, data.body(name).xquat)) == pytest.approx(1, abs=1e-9)
    x, turn = robot.site("tip")
    assert x == pytest.approx(data.site("tip").xpos, abs=1e-9)
    with pytest.raises(KeyError, match="'tap': no site has this name; is it 'tip'"):
        robot.site("tap")

    robot.reset("bent")
    assert robot.q == pytest.approx(source.key("bent").qpos, abs=1e-9) and robot.ctrl == [0.25]
    assert robot.qd == pytest.approx(source.key("bent").qvel, abs=1e-9)
    robot.ctrl = [7]
    assert robot.ctrl == [1]  # in its range
    robot.reset()
    assert robot.q == pytest.approx(source.qpos0, abs=1e-9) and robot.ctrl == [0] and not robot.qd.any()
    robot.qd = np.arange(10.0)
    robot.q = source.key("bent").qpos
    assert robot.qd == pytest.approx(np.arange(10.0), abs=1e-9) and robot.positions() == pytest.approx(robot.q)
    before = robot.world.save()
    for call, error, said in (
        (lambda: robot.set_positions(np.zeros(3)), TypeError, "q: .*must be 12 numbers"),
        (lambda: robot.set_positions(np.zeros(12)), ValueError, "q: numbers 3 to 6 are a quaternion"),
        (lambda: robot.set_positions(robot.q, np.full(10, np.nan)), ValueError, "qd: .*must be 10 finite numbers"),
        (lambda: robot.reset("bend"), ValueError, "keyframe: 'bend' is none of the file's: bent"),
        (lambda: setattr(robot, "ctrl", [1, 2]), TypeError, "ctrl: .*must be 1 numbers"),
        (lambda: robot.q.__setitem__(0, 1), ValueError, r"set_positions\(q, qd\) sets it"),
        (lambda: robot.ctrl.__setitem__(0, 1), ValueError, r"robot.ctrl = \(...\) sets it"),
    ):
        with pytest.raises(error, match=said):
            call()
    assert robot.world.save() == before


def test_robots_by_name():
    mujoco = pytest.importorskip("mujoco")
    robot = subadmm.load(mujoco.MjModel.from_xml_string(ROBOT))
    assert robot["arm"] is robot.bodies["arm"] and robot["elbow"] is robot.joints["elbow"]
    assert robot["push"] is robot.actuators["push"] and robot.world["torso"] == robot["torso"]
    with pytest.raises(KeyError, match="'elbo': no body, joint or actuator has this name; is it 'elbow'"):
        robot["elbo"]
