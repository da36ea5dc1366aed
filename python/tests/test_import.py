"""subadmm.load against MuJoCo: bodies, joints, limits, loops, drives, contact filters, and what is not carried over."""

import sys
from pathlib import Path

import numpy as np
import pytest

import subadmm

mujoco = pytest.importorskip("mujoco")

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
import check_models  # noqa: E402


EXACT = 1e-9  # the same numbers by another way: rounding, with room for some hundred operations

ARM = """
<mujoco model="arm">
  <option timestep="0.002"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <body name="base" pos="0 0 1" quat=".9 .1 .2 .3">
      <geom type="box" size=".1 .1 .05"/>
      <body name="upper" pos=".1 .2 .05" euler="10 20 30">
        <joint name="shoulder" axis="1 2 3" pos=".01 .02 .03" ref="20" range="-60 60"/>
        <geom type="capsule" size=".04" fromto="0 0 0 .3 .1 .1"/>
        <body name="plate" pos=".2 0 .1" euler="40 0 0"><geom type="ellipsoid" size=".05 .03 .02"/></body>
        <body name="wrist" pos=".3 .1 .1">
          <joint name="wrist_x" axis="1 0 0"/>
          <joint name="wrist_y" axis="0 1 0"/>
          <geom type="cylinder" size=".03 .1"/>
          <body name="slider" pos="0 0 .1">
            <joint name="out" type="slide" axis="0 0 -2" ref=".05"/>
            <joint name="spin" axis="0 0 1"/>
            <geom type="sphere" size=".04"/>
            <body name="hip" pos="0 .1 0">
              <joint name="a" axis="0 1 0"/><joint name="b" axis="1 0 0" pos="0 0 .02"/><joint name="c" axis="1 1 1"/>
              <geom type="box" size=".03 .02 .04"/>
              <body name="ball" pos="0 .1 0"><joint name="ball" type="ball"/><geom size=".02"/></body>
            </body>
          </body>
        </body>
      </body>
    </body>
    <body name="walker" pos="2 0 1">
      <joint name="root_x" type="slide" axis="1 0 0"/><joint name="root_z" type="slide" axis="0 0 1"/>
      <joint name="root_y" axis="0 1 0"/>
      <geom type="box" size=".1 .2 .3"/>
    </body>
    <body name="free" pos="0 3 1"><freejoint name="free"/><inertial pos=".1 .2 .3" mass="2" fullinertia="3 2 2.5 .1 .2 .3"/></body>
  </worldbody>
</mujoco>
"""


def model(text):
    return mujoco.MjModel.from_xml_string(text)


def noted(loaded, name):
    """Does the report have an element whose name holds this?"""
    return [str(note) for note in loaded.report if name in note.element]


def test_masses_and_poses_at_the_start():
    source = model(ARM)
    loaded = subadmm.load(source)
    data = check_models.data_at(source, source.qpos0)
    assert max(check_models.mass_errors(loaded, data)) < EXACT
    assert max(check_models.pose_errors(loaded, data)) < EXACT
    assert check_models.lock_error(loaded.world, check_models.tree_joints(loaded)) < EXACT
    assert loaded.joints["shoulder"].position == pytest.approx(np.radians(20), abs=EXACT)
    assert loaded.joints["spin"].position == pytest.approx(0, abs=EXACT)
    assert loaded.bodies["plate"] == loaded.bodies["upper"]  # fixed to it: one body
    assert loaded.joints["wrist_x"].joint == loaded.joints["wrist_y"].joint
    assert loaded.joints["wrist_x"].joint.kind == "universal"
    assert loaded.joints["out"].joint.kind == "cylindrical"
    assert loaded.joints["root_x"].joint.kind == "planar"
    assert noted(loaded, "body 'hip'") and len(loaded.carriers) == 2


@pytest.mark.parametrize("seed", range(5))
def test_forward_kinematics_elsewhere(seed):
    source = model(ARM)
    qpos = check_models.other_pose(source, seed)
    loaded = subadmm.load(source, qpos=qpos)
    assert max(check_models.pose_errors(loaded, check_models.data_at(source, qpos))) < EXACT
    assert check_models.lock_error(loaded.world, check_models.tree_joints(loaded)) < EXACT


def test_velocities_of_bodies_and_joints():
    source = model(ARM)
    random = np.random.default_rng(3)
    qpos, qvel = check_models.other_pose(source, 2), random.normal(size=source.nv)
    loaded = subadmm.load(source, qpos=qpos, qvel=qvel)
    for index in range(source.njnt):
        if source.jnt_type[index] > 1:
            joint = loaded.joints[source.joint(index).name]
            assert joint.speed == pytest.approx(qvel[source.jnt_dofadr[index]], abs=EXACT)
    for joint in check_models.tree_joints(loaded):  # what is locked does not move, carriers included
        locked = [k for k in range(6) if joint.locks >> k & 1]
        assert np.abs(np.array(joint.speed)[locked]).max(initial=0) < EXACT


PENDULUM = """
<mujoco>
  <option timestep="{dt}" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>
    <body name="one" pos="0 0 2" euler="0 50 10">
      <joint name="j1" axis="0 1 0" damping="{damping}" stiffness="{stiffness}" springref="30" armature="{armature}"/>
      <geom type="capsule" size=".03" fromto="0 0 0 0 0 -.5" mass="1"/>
      {second}
    </body>
  </worldbody>
</mujoco>
"""
SECOND = """<body name="two" pos="0 0 -.5"><joint name="j2" axis="0 1 0"/><joint name="j3" axis="1 0 0"/>
    <geom type="box" size=".02 .05 .2" pos="0 0 -.2" mass=".7"/></body>"""
THIRD = """<body name="two" pos="0 0 -.5"><joint name="j2" axis="0 1 0"/><joint name="j3" axis="1 0 0"/><joint name="j4" axis="0 0 1"/>
    <geom type="box" size=".02 .05 .2" pos=".1 0 -.2" mass=".7"/></body>"""


@pytest.mark.parametrize(
    "second, laws, tolerance",
    [
        # measured: 1.8e-7, 4.7e-9, 3.9e-5 and 2.6e-4; a quarter of it at half the step, but first order where moments differ (third),
        # and a carrier's mass and inertia, 1e-4 of the body's (fourth)
        ("", dict(damping=0, stiffness=0, armature=0), 1e-6),
        ("", dict(damping=0.2, stiffness=3, armature=0.05), 1e-7),
        (SECOND, dict(damping=0.1, stiffness=0, armature=0), 1e-4),
        (THIRD, dict(damping=0, stiffness=1, armature=0.01), 1e-3),
    ],
)
def test_pendulums_move_as_in_mujoco(second, laws, tolerance):
    source = model(PENDULUM.format(dt=0.0005, second=second, **laws))
    loaded, data = subadmm.load(source), mujoco.MjData(source)
    loaded.world.step(1000)
    for _ in range(1000):
        mujoco.mj_step(source, data)
    assert np.abs(data.qpos - source.qpos0).max() > 0.05  # it has moved
    assert np.abs(loaded.positions() - data.qpos).max() < tolerance


def test_limits_hold_with_offsets_and_signs():
    loaded = subadmm.load(
        model("""
        <mujoco><worldbody>
          <body name="door" pos="0 0 1"><joint name="hinge" axis="0 1 0" ref="100" range="80 130"/><geom size=".05" pos=".5 0 0"/></body>
          <body name="drawer" pos="3 0 1"><joint name="slide" type="slide" axis="0 0 1" ref="-.1" range="-.3 .2"/><geom size=".05"/></body>
        </worldbody></mujoco>""")
    )
    loaded.world.step(2000)
    assert not noted(loaded, "joint")
    # what the solver leaves of a pressing limit
    assert loaded.joints["hinge"].position == pytest.approx(np.radians(130), abs=1e-5)
    assert loaded.joints["slide"].position == pytest.approx(-0.3, abs=1e-5)


FOUR_BAR = """
<mujoco><option timestep="0.001"><flag contact="disable"/></option><worldbody>
  <body name="crank"><joint name="j1" axis="0 1 0"/><geom type="capsule" size=".02" fromto="0 0 0 0 0 .5"/>
    <body name="coupler" pos="0 0 .5"><joint name="j2" axis="0 1 0"/><geom type="capsule" size=".02" fromto="0 0 0 1 0 0"/>
      <body name="rocker" pos="1 0 0"><joint name="j3" axis="0 1 0"/><geom type="capsule" size=".02" fromto="0 0 0 0 0 -.5"/></body>
    </body></body>
  <body name="ground" pos="1 0 0"><geom size=".01" contype="0" conaffinity="0"/></body></worldbody>
  <equality><connect name="loop" body1="rocker" body2="ground" anchor="0 0 -.5"/></equality></mujoco>
"""


def test_a_loop_stays_closed():
    source = model(FOUR_BAR)
    loaded = subadmm.load(source, qvel=[1.0, -1.0, 1.0])
    worst = 0.0
    for _ in range(200):
        loaded.world.step(5)
        worst = max(worst, np.abs(np.array(loaded.loops["loop"].position)[:3]).max())
    assert worst < 1e-6
    assert abs(loaded.joints["j1"].position) > 0.5


def test_ties_welds_and_sites():
    loaded = subadmm.load(
        model("""
        <mujoco><option gravity="0 0 0"/><worldbody>
          <body name="a"><joint name="ja" axis="0 0 1" ref="10"/><geom size=".1"/></body>
          <body name="b" pos="1 0 0"><joint name="jb" axis="0 0 -1"/><geom size=".1"/></body>
          <body name="c" pos="2 0 0"><joint name="jc" axis="0 0 1"/><geom size=".1"/></body>
          <body name="d" pos="3 0 0"><freejoint/><geom size=".1"/><site name="s" pos="0 .1 0"/></body>
          <body name="e" pos="4 0 0"><freejoint/><geom size=".1"/></body>
          <body name="f" pos="5 0 0"><freejoint/><geom size=".1"/></body>
          <site name="t" pos="3 .1 0"/>
        </worldbody>
        <equality>
          <joint name="tie" joint1="ja" joint2="jb" polycoef=".1 -2 0 0 0"/>
          <joint name="curved" joint1="ja" joint2="jb" polycoef="0 1 1 0 0"/>
          <joint name="held" joint1="jc" polycoef=".2 0 0 0 0"/>
          <connect name="sites" site1="s" site2="t"/>
          <weld name="weld" body1="e" body2="f"/>
        </equality>
        <actuator><motor name="m" joint="jb"/></actuator></mujoco>""")
    )
    loaded.actuators["m"].control = 0.01
    loaded.bodies["e"].apply_impulse_at([0, 1, 0], [4, 0, 0])
    loaded.world.step(200)
    turned = loaded.joints["jb"].position
    assert turned > 0.01
    assert loaded.joints["ja"].position == pytest.approx(np.radians(10) + 0.1 - 2 * turned, abs=1e-6)
    assert loaded.joints["jc"].position == pytest.approx(0.2, abs=1e-6)
    assert np.abs(loaded.loops["sites"].position[:3]).max() < 1e-9
    assert np.abs(loaded.loops["weld"].position).max() < 1e-6
    assert loaded.bodies["f"].linear_velocity[1] != 0
    assert noted(loaded, "equality 'curved'") and not noted(loaded, "equality 'tie'")


ACTUATORS = """
<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody>
  {bodies}
  </worldbody>
  <tendon><fixed name="two"><joint joint="j4" coef="1"/><joint joint="j5" coef="-2"/></fixed></tendon>
  <actuator>
    <motor name="motor" joint="j0" gear="3" ctrlrange="-1 1"/>
    <position name="position" joint="j1" kp="4" kv=".3" gear="2"/>
    <velocity name="velocity" joint="j2" kv=".5"/>
    <position name="both_p" joint="j3" kp="5"/><velocity name="both_v" joint="j3" kv=".4"/><motor name="both_m" joint="j3"/>
    <motor name="tendon" tendon="two"/>
    <position name="tendon_servo" tendon="two"/>
    <general name="weak" joint="j6" gainprm="7" biasprm=".1 -3 -.2" biastype="affine" forcerange="-.2 .2"/>
    <muscle name="muscle" joint="j7" lengthrange="0 1"/>
  </actuator></mujoco>
""".format(
    bodies="\n".join(
        f'<body name="b{k}" pos="{k} 0 0"><joint name="j{k}" axis="0 0 {1 - 2 * (k % 2)}" ref="{10 * k}" damping=".01"/>'
        '<geom type="box" size=".1 .2 .1"/></body>'
        for k in range(8)
    )
)


def test_actuators_drive_as_in_mujoco():
    source = model(ACTUATORS)
    loaded, data = subadmm.load(source), mujoco.MjData(source)
    controls = dict(motor=5.0, position=0.7, velocity=2.0, both_p=1.0, both_v=0.5, both_m=0.3, tendon=0.4, weak=0.5)
    for name, value in controls.items():
        data.ctrl[source.actuator(name).id] = value
        loaded.actuators[name].control = value
    assert loaded.actuators["motor"].control == 1.0  # clipped
    data.ctrl[source.actuator("tendon_servo").id] = 0
    source.actuator("tendon_servo").gainprm[:] = 0  # not here: nor there
    source.actuator("tendon_servo").biasprm[:] = 0
    source.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    loaded.world.step(500)
    for _ in range(500):
        mujoco.mj_step(source, data)
    moved = np.abs(data.qpos - source.qpos0)
    assert np.all(moved[:7] > 0.01)
    # second order in the step, and for 'weak' the kink where the force comes off its bound
    assert np.abs(loaded.positions() - data.qpos)[:7].max() < 1e-5
    assert (
        noted(loaded, "actuator 'muscle'")
        and noted(loaded, "actuator 'tendon_servo'")
        and noted(loaded, "tendon 'two'")
    )
    assert "muscle" not in loaded.actuators
    with pytest.raises(ValueError, match="control of actuator 'motor'"):
        loaded.actuators["motor"].control = np.nan


SHAPES = """
<mujoco><asset>
    <mesh name="tetra" vertex="0 0 0 .2 0 0 0 .2 0 0 0 .2"/>
    <hfield name="hills" nrow="2" ncol="3" size="1 1 .5 .1" elevation="0 0 0 0 0 0"/>
  </asset><worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <geom name="hills" type="hfield" hfield="hills" pos="5 0 0"/>
    {bodies}
  </worldbody></mujoco>
"""
KINDS = {
    "sphere": 'size=".1"',
    "capsule": 'size=".05 .1"',
    "cylinder": 'size=".05 .1"',
    "ellipsoid": 'size=".1 .08 .06"',
    "box": 'size=".1 .08 .06"',
    "mesh": 'mesh="tetra"',
}


def test_geoms_of_every_kind_come_to_rest_where_they_do_in_mujoco():
    bodies = "\n".join(
        f'<body name="{kind}" pos="0 {k} .3"><freejoint/><geom name="{kind}" type="{kind}" {size} friction="0.7"/></body>'
        for k, (kind, size) in enumerate(KINDS.items())
    )
    bodies += '<body name="over" pos="5 0 .3"><freejoint/><geom type="box" size=".1 .1 .1"/></body>'
    source = model(SHAPES.format(bodies=bodies))
    loaded, data = subadmm.load(source), mujoco.MjData(source)
    for _ in range(200):
        loaded.world.step(5)
    for _ in range(1000):
        mujoco.mj_step(source, data)
    for kind in list(KINDS) + ["over"]:
        height = data.body(kind).xipos[2]
        assert height < 0.2
        # MuJoCo's contacts give by some tenths of a millimetre under a load, and round bodies roll on
        assert loaded.bodies[kind].position[2] == pytest.approx(height, abs=3e-3), kind


def test_friction_of_pairs_and_filters():
    loaded = subadmm.load(
        model("""
        <mujoco><worldbody>
          <geom name="floor" type="plane" size="1 1 1" friction=".2" contype="1" conaffinity="1"/>
          <body name="slick" pos="0 0 .1"><freejoint/><geom name="slick" type="box" size=".1 .1 .1" condim="1" friction=".1"/></body>
          <geom name="pond" type="box" size=".2 .2 .1" pos="0 3 0" condim="1"/>
          <body name="ice" pos="0 3 .2"><freejoint/><geom name="ice" type="box" size=".1 .1 .1" condim="1"/></body>
          <body name="rough" pos="1 0 .1"><freejoint/><geom name="rough" type="box" size=".1 .1 .1" friction=".9"/></body>
          <body name="ghost" pos="2 0 .1"><freejoint/><geom name="ghost" type="box" size=".1 .1 .1" contype="2" conaffinity="2"/></body>
          <body name="shown" pos="3 0 .1"><freejoint/><geom name="shown" type="box" size=".1 .1 .1" contype="0" conaffinity="0"/></body>
          <body name="out" pos="4 0 .1"><freejoint/><geom name="out" type="box" size=".1 .1 .1"/></body>
          <body name="paired" pos="5 0 .1"><freejoint/><geom name="paired" type="box" size=".1 .1 .1" contype="0" conaffinity="0"/></body>
        </worldbody>
        <contact><exclude name="apart" body1="world" body2="out"/><pair name="pair" geom1="floor" geom2="paired" friction=".4 .4 .1 .1 .1"/></contact>
        </mujoco>""")
    )
    loaded.world.step(100)
    friction = {}
    contacts = loaded.world.contacts()
    by_slot = {shape.index + 1: geom for geom, shapes in loaded.shapes.items() for shape in shapes}
    for contact in contacts:
        pair = {by_slot[int(contact["shape_a"][0])], by_slot[int(contact["shape_b"][0])]}
        friction[loaded.source.geom(max(pair)).name] = float(contact["friction"])
    assert friction == {
        "slick": 0.2,
        "rough": 0.9,
        "paired": 0.4,
        "ice": 0.0,
    }  # condim is the larger one, as friction is
    for name in ("ghost", "shown", "out"):
        assert loaded.bodies[name].position[2] < 0.06, name  # 0.5 g t^2 with t = 0.2 s, less the margin


@pytest.mark.parametrize("given", ["", 'anchor=".1 .2 .3"', 'anchor=".1 .2 .3" relpose="1 0 0 .9 .1 .2 .3"'])
def test_welds_have_the_errors_that_mujoco_sees(given):
    source = model(f"""
        <mujoco><worldbody>
          <body name="a" pos="4 0 0" euler="10 20 30"><freejoint/><geom size=".1"/></body>
          <body name="b" pos="5 0 0" euler="40 0 0"><freejoint/><geom size=".1"/></body>
        </worldbody><equality><weld name="weld" body1="a" body2="b" {given}/></equality></mujoco>""")
    data = mujoco.MjData(source)
    mujoco.mj_forward(source, data)
    loaded = subadmm.load(source)
    joint = loaded.loops["weld"]
    off = np.linalg.norm(joint.position[:3])
    # (data.efc_pos has three translations in the world's axes, and sines of half of the rotation)
    assert off == pytest.approx(np.linalg.norm(data.efc_pos[:3]), abs=EXACT)
    turned = np.sin(np.linalg.norm(joint.position[3:]) / 2)
    assert turned == pytest.approx(np.linalg.norm(data.efc_pos[3:6]), abs=EXACT)
    assert (off < EXACT) == ("relpose" not in given)
    assert bool(noted(loaded, "equality 'weld'")) == ("relpose" in given)


def test_many_kinds_of_geoms_still_meet_as_they_should():
    from subadmm.importing.filters import Filter

    random = np.random.default_rng(5)
    geoms = [(int(random.integers(0, 16)), int(random.integers(0, 16))) for _ in range(60)]
    source = model(
        "<mujoco><worldbody>"
        + "".join(f'<geom size=".1" contype="{a}" conaffinity="{b}"/>' for a, b in geoms)
        + "</worldbody></mujoco>"
    )
    chosen = Filter(source)
    assert not chosen.crowded or len(set(geoms)) > 32
    for i, (a, b) in enumerate(geoms):
        for j, (c, d) in enumerate(geoms):
            want = bool(a & d or c & b)
            have = chosen.touches(i) and chosen.touches(j) and chosen.meet(i, j)
            assert have == want or (chosen.crowded and have), (i, j)


def test_links_that_overlap_are_left_out_by_name():
    text = """
        <mujoco><worldbody>
          <body name="base" pos="0 0 1"><geom name="base" type="box" size=".1 .1 .1"/>
            <body name="arm"><joint axis="0 1 0"/><geom name="arm" type="box" size=".05 .05 .3"/></body></body>
        </worldbody></mujoco>"""
    loaded = subadmm.load(model(text))
    assert [note for note in loaded.report if "base" in note.element and "overlap" in note.reason]
    loaded.world.step(1)
    assert loaded.world.report.contacts == 0
    apart = subadmm.load(
        model(
            text.replace("<worldbody>", """<worldbody><geom name="wall" type="box" size=".1 .1 .1" pos="0 0 1.3"/>""")
        )
    )
    assert any("overlap" in note.reason and "left out" not in note.reason for note in apart.report)
    apart.world.step(1)
    assert apart.world.report.contacts > 0
    kept = subadmm.load(model(text), overlaps="keep")
    kept.world.step(1)
    assert kept.world.report.contacts > 0


URDF = """
<robot name="r">
  <link name="base"><inertial><mass value="2"/><origin xyz="0 0 .1"/><inertia ixx=".1" iyy=".2" izz=".15" ixy=".01" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"><inertial><mass value="1"/><origin xyz=".1 0 0" rpy="0 0 1"/><inertia ixx=".01" iyy=".02" izz=".02" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://none/arm.dae"/></geometry></visual>
    <collision><geometry><mesh filename="package://r/meshes/arm.stl"/></geometry></collision></link>
  <link name="hand"><inertial><mass value=".5"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="elbow" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 .2" rpy=".1 .2 .3"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" effort="7" velocity="3"/><dynamics damping=".1" friction=".2"/></joint>
  <joint name="grip" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz=".3 0 0" rpy="0 .5 0"/></joint>
  <transmission name="t"/>
</robot>
"""


def test_a_urdf_with_a_mesh_of_a_package(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "urdf").mkdir()
    trimesh.creation.box((0.2, 0.1, 0.1)).export(tmp_path / "meshes" / "arm.stl")
    (tmp_path / "urdf" / "r.urdf").write_text(URDF)
    loaded = subadmm.load(tmp_path / "urdf" / "r.urdf")
    source = loaded.source
    qpos = np.array([0.7])
    moved = subadmm.load(tmp_path / "urdf" / "r.urdf", qpos=qpos)
    data = check_models.data_at(source, qpos)
    assert max(check_models.mass_errors(moved, data)) < EXACT and max(check_models.pose_errors(moved, data)) < EXACT
    assert loaded.bodies["hand"] == loaded.bodies["arm"] and loaded.bodies["arm"].mass == pytest.approx(1.5)
    elbow = loaded.joints["elbow"].joint.coordinate(5)
    assert (elbow.lower, elbow.upper, elbow.friction, elbow.spring_damping) == pytest.approx((-1, 2, 0.2, 0.1))
    assert len(loaded.shapes) == 1 and noted(loaded, "<transmission>")
    free = subadmm.load(tmp_path / "urdf" / "r.urdf", floating=True)
    assert free.joints["base_free"].type == "free" and free.bodies["base"].mass == pytest.approx(2)


def test_what_is_not_carried_over_is_named():
    loaded = subadmm.load(
        model("""
        <mujoco><option density="1.2"/><worldbody>
          <camera name="eye"/>
          <geom name="floor" type="plane" size="1 1 1"/>
          <body name="a" pos="0 0 1" gravcomp="1"><freejoint/><geom name="ball" size=".1" condim="6" margin=".01"/><site name="s1"/></body>
          <body name="b" pos="1 0 1"><joint name="j" type="ball" range="0 30"/><geom size=".1"/><site name="s2"/></body>
        </worldbody>
        <tendon><spatial name="rope"><site site="s1"/><site site="s2"/></spatial></tendon>
        <actuator><motor name="pull" tendon="rope"/><motor name="push" site="s1" gear="1 0 0 0 0 0"/></actuator>
        <sensor><accelerometer name="imu" site="s1"/></sensor></mujoco>""")
    )
    for name in (
        "density",
        "tendon 'rope'",
        "geoms ball",
        "joint 'j'",
        "actuator 'pull'",
        "actuator 'push'",
        "sensors",
        "solref",
        "what is drawn",
    ):
        assert noted(loaded, name), name
    loaded.world.step(100)
    assert loaded.bodies["a"].position[2] == pytest.approx(1, abs=1e-12)  # its weight is compensated


def test_threads_take_the_place_of_those_of_the_settings():
    settings = subadmm.Settings(threads=3)
    assert subadmm.load(model(ARM)).world.settings.threads == 0
    assert subadmm.load(model(ARM), settings=settings).world.settings.threads == 3
    assert subadmm.load(model(ARM), settings=settings, threads=1).world.settings.threads == 1 and settings.threads == 3
    with pytest.raises(subadmm.InvalidArgument, match=r"threads = -1: must be in \[0, 1024\]"):
        subadmm.load(model(ARM), threads=-1)


def test_errors_name_what_they_are_about(tmp_path):
    source = model(ARM)
    with pytest.raises(ValueError, match="keyframe: 'home'"):
        subadmm.load(source, keyframe="home")
    with pytest.raises(ValueError, match="qpos: must be"):
        subadmm.load(source, qpos=[0.0])
    with pytest.raises(FileNotFoundError, match="nothing.xml"):
        subadmm.load(tmp_path / "nothing.xml")
    (tmp_path / "other.xml").write_text("<html/>")
    with pytest.raises(ValueError, match="<html>"):
        subadmm.load(tmp_path / "other.xml")
    with pytest.raises(ValueError, match="carrier_share"):
        subadmm.load(source, carrier_share=0)
    with pytest.raises(subadmm.InvalidArgument, match="body 'mote'"):
        subadmm.load(
            model(
                '<mujoco><worldbody><body name="mote"><freejoint/><geom size=".1" mass="1e-12"/></body></worldbody></mujoco>'
            )
        )


def test_a_keyframe_is_where_it_starts():
    text = """<mujoco><worldbody><body name="a" pos="0 0 1"><joint name="j" axis="0 1 0"/><geom size=".1" pos=".5 0 0"/></body></worldbody>
        <actuator><position name="p" joint="j" kp="10"/></actuator>
        <keyframe><key name="up" qpos="4" qvel="2" ctrl="1.5"/></keyframe></mujoco>"""
    loaded = subadmm.load(model(text), keyframe="up")
    joint = loaded.joints["j"]
    assert (joint.position, joint.speed) == pytest.approx((4, 2), abs=EXACT)  # more than half a turn
    assert loaded.actuators["p"].control == 1.5
    assert joint.joint.coordinate(5).target_position + joint.offset == pytest.approx(1.5)


def test_a_mocap_body_leads_what_is_welded_to_it():
    loaded = subadmm.load(
        model("""<mujoco><option gravity="0 0 0"/><worldbody>
            <body name="lead" mocap="true" pos="0 0 1"/>
            <body name="led" pos=".2 0 1"><freejoint/><geom size=".05"/></body>
            </worldbody><equality><weld body1="lead" body2="led"/></equality></mujoco>""")
    )
    lead, led = loaded.bodies["lead"], loaded.bodies["led"]
    assert lead.type == "kinematic"
    for k in range(1, 101):
        lead.move_to([0, 0.001 * k, 1], [1, 0, 0, 0])
        loaded.world.step()
    # the joint's feedback is at most half a step's change of speed behind: 0.5 m/s x 2 ms / 2 at the first step, less after
    assert led.position == pytest.approx([0.2, 0.1, 1], abs=1e-5)


def test_without_mujoco_the_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ImportError, match="pip install mujoco"):
        subadmm.load("robot.xml")


def test_a_ball_on_a_slide_swings_as_in_mujoco():
    source = model("""<mujoco><option timestep="0.0005" integrator="RK4"><flag contact="disable"/></option><worldbody>
        <body pos="0 0 1"><joint name="x" type="slide" axis="0 1 0" damping=".5" stiffness="20"/>
          <joint name="b" type="ball" stiffness="2" damping=".05" armature=".02"/>
          <geom type="box" size=".1 .2 .05" pos=".2 .1 0" mass="1"/></body></worldbody></mujoco>""")
    loaded, data = subadmm.load(source), mujoco.MjData(source)
    loaded.world.step(1000)
    for _ in range(1000):
        mujoco.mj_step(source, data)
    # measured: 6e-5; where moments differ torques of joints turn the axis to first order in the step
    assert np.abs(loaded.positions() - data.qpos).max() < 2e-4


def test_a_mesh_without_thickness_is_named():
    loaded = subadmm.load(
        model("""<mujoco><asset><mesh name="sheet" vertex="0 0 0 1 0 0 0 1 0 .3 .3 5e-7"/></asset><worldbody>
            <geom name="sheet" type="mesh" mesh="sheet" mass="0"/><geom size=".1" pos="0 0 1"/></worldbody></mujoco>""")
    )
    assert noted(loaded, "geom 'sheet'") and len(loaded.shapes) == 1


HAND = """<mujoco><option gravity="0 0 -9.81" timestep=".002"/><worldbody><body name="arm" pos="0 0 1"><joint name="shoulder" type="hinge" axis="0 1 0" pos="-.5 0 0"/>
  <geom type="box" size=".4 .03 .03" mass="1"/>
  <body name="hand" pos=".5 0 0"><joint name="wrist" type="hinge" axis="1 0 0"/><geom type="box" size=".05 .05 .02" mass=".5"/>
   <body name="left" pos=".08 .03 0"><joint name="l" {left}/><geom type="box" size=".03 .005 .005" mass=".02"/></body>
   <body name="right" pos=".08 -.03 0"><joint name="r" {right}/><geom type="box" size=".03 .005 .005" mass=".02"/></body>
  </body></body></worldbody>
  <equality><joint name="tie" joint1="l" joint2="r" polycoef="{polycoef}"/></equality>
  <actuator><motor name="close" joint="l"/></actuator></mujoco>"""


@pytest.mark.parametrize("left, right, polycoef, wheel", [
    ('type="slide" axis="0 1 0"', 'type="slide" axis="0 -1 0"', "0 1 0 0 0", True),
    ('type="slide" axis="0 1 0"', 'type="slide" axis="0 -1 0"', "0.01 1.5 0 0 0", True),
    ('type="hinge" axis="0 0 1" pos="-.03 0 0"', 'type="hinge" axis="0 0 1" pos="-.03 0 0"', "0 -1 0 0 0", False),
    ('type="hinge" axis="1 0 0" pos="0 -.03 0"', 'type="hinge" axis="1 0 0" pos="0 .03 0"', "0 -2 0 0 0", True),
])
def test_fingers_tied_on_a_hand_that_moves(left, right, polycoef, wheel):
    text = HAND.format(left=left, right=right, polycoef=polycoef)
    a0, a1 = (float(x) for x in polycoef.split()[:2])
    robot = subadmm.load(model(text))
    notes = [n for n in robot.report if "wheel" in n.reason]
    assert bool(notes) == wheel and "tie" in robot.gears
    robot.actuators["close"].control = 0.02
    for n in range(50):
        robot.world.step(5)
        l, r = robot.joints["l"].position, robot.joints["r"].position
        if n > 20:  # what it is off at the start has been drawn in; regularised locks yield by 1e-9 of their load
            assert l == pytest.approx(a0 + a1 * r, abs=2e-6)
    assert abs(l - a0) > 1e-3 and abs(robot.joints["shoulder"].position) > 0.1  # all of it has moved


# ---- what models have that others do not ---------------------------------------------------------------------------

GRIPPER = """
<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="left"><joint name="l" axis="0 0 1" armature="0.01"/><geom type="box" size="0.1 0.01 0.01" mass="0.1"/></body>
    <body name="right" pos="1 0 0">
      <joint name="r" axis="0 0 1" armature="0.01" ref="0.3"/><geom type="box" size="0.1 0.01 0.01" mass="0.2"/>
    </body>
  </worldbody>
  <tendon><fixed name="split"><joint joint="l" coef="0.5"/><joint joint="r" coef="-0.25"/></fixed></tendon>
  <equality>TIE</equality>
  <actuator><general name="close" tendon="split" gainprm="2" biastype="affine" biasprm="0.05 -5 -0.4" ctrlrange="0 1"/></actuator>
</mujoco>
"""
TIE = '<joint joint1="r" joint2="l" polycoef="0.1 -0.8 0 0 0" solref="0.002 1"/>'


def test_servos_of_tendons_act_on_joints_that_are_tied():
    """As MuJoCo does: the tie there is soft, which is most of the difference."""
    model = mujoco.MjModel.from_xml_string(GRIPPER.replace("TIE", TIE))
    data = mujoco.MjData(model)
    robot = subadmm.load(model)
    assert not [note for note in robot.report if "actuator" in note.element]
    robot.actuators["close"].control = data.ctrl[0] = 1
    for _ in range(4):
        mujoco.mj_step(model, data, 500)
        robot.world.step(500)
        assert abs(robot.positions() - data.qpos).max() < 5e-3
    # At rest 2 ctrl + 0.05 = 5 length, and the tie holds.
    left, right = robot.positions()
    assert 0.5 * left - 0.25 * right == pytest.approx(2.05 / 5, abs=1e-6)
    assert right - np.radians(0.3) == pytest.approx(0.1 - 0.8 * left, abs=1e-6)


def test_servos_of_tendons_over_joints_that_are_not_tied_are_reported():
    robot = subadmm.load(mujoco.MjModel.from_xml_string(GRIPPER.replace("TIE", "")))
    assert "tied" in next(note.reason for note in robot.report if note.element == "actuator 'close'")
    assert not robot.actuators


def test_contact_that_no_joint_can_part_is_left_out():
    """A disc on two slides, 0.2 mm deep in the floor: less than what counts where a joint can mend it."""
    text = """
    <mujoco>
      <option timestep="0.002"/>
      <worldbody>
        <geom type="plane" size="1 1 1"/>
        <body name="disc" pos="0 0 0.0098">
          <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>JOINT
          <geom type="cylinder" size="0.1 0.01"/>
        </body>
      </worldbody>
    </mujoco>"""
    held = subadmm.load(mujoco.MjModel.from_xml_string(text.replace("JOINT", "")))
    assert [note.element for note in held.report if "overlap" in note.reason] == ["contact of body 'world' and body 'disc'"]
    settings = held.world.settings
    settings.certify = True
    held.world.settings = settings
    held.world.step(10)  # its weight times the locks' regularisation of 1e-9 is 2e-11 m/s
    assert held.world.report.contacts == 0 and held.world.report.certificate.ncp_max < 1e-10
    free = subadmm.load(mujoco.MjModel.from_xml_string(text.replace("JOINT", '<joint type="slide" axis="0 0 1"/>')))
    assert not [note for note in free.report if "overlap" in note.reason]
    free.world.step(10)
    assert free.world.report.contacts > 0


def test_urdf_moments_that_no_solid_has_are_mended_and_the_base_stays_a_body(tmp_path):
    def link(name, moments, extra=""):
        ixx, iyy, izz = moments
        return (f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" '
                f'ixz="0" iyz="0"/></inertial><collision>{extra}<geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
                "</link>")

    path = tmp_path / "robot.urdf"
    path.write_text(
        '<robot name="r"><mujoco><compiler discardvisual="true"/></mujoco>' + link("base", (1, 1, 1))
        + link("arm", (0.1, 0.1, 0.4), '<origin xyz="1 0 0"/>') + link("hand", (0.1, 0.1, 0.1))
        + '<joint name="a" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>'
        '<joint name="b" type="continuous"><parent link="arm"/><child link="hand"/><axis xyz="0 0 1"/>'
        '<origin xyz="0.15 0 0"/></joint></robot>')
    robot = subadmm.load(str(path))
    assert robot.bodies["arm"].inertia == pytest.approx([0.2] * 3)
    assert any("arm" in note.element and "moment" in note.reason for note in robot.report)
    # The hand is 50 mm deep in the base, two joints away: of one mechanism.
    assert any("'base'" in note.element and "'hand'" in note.element and "left out" in note.reason for note in robot.report)


def test_locks_of_carriers_are_regularised_as_those_of_their_bodies():
    """The second body has two hinges, with a carrier of 1e-4 of its mass: a billionth of what its weight would move the
    carrier by is 2e-7 m/s, of what it would move the bodies by 1e-11."""
    text = """
    <mujoco>
      <option timestep="0.002"/>
      <worldbody>
        <body><joint axis="0 1 0"/><geom type="capsule" size="0.05 0.2" pos="0 0 -0.25" mass="5"/>
          <body pos="0 0 -0.5">
            <joint axis="0 1 0" pos="0 0 0"/><joint axis="0.6 0.8 0" pos="0.01 0 0"/>
            <geom type="capsule" size="0.05 0.2" pos="0 0 -0.25" mass="5" contype="0"/>
          </body>
        </body>
      </worldbody>
    </mujoco>"""
    robot = subadmm.load(mujoco.MjModel.from_xml_string(text))
    assert len(robot.carriers) == 1
    settings = robot.world.settings
    settings.certify, settings.ncp_points = True, 0
    robot.world.settings = settings
    worst = 0
    for _ in range(50):
        robot.world.step()
        worst = max(worst, robot.world.report.certificate.ncp_max)
    assert worst < 5e-9


def test_feet_of_robots_are_solved_to_rounding():
    """Four bent legs with a friction of 1, which press harder when they slip more: the iteration goes round and round."""
    leg = """<body pos="{x} {y} 0"><joint axis="{a} {b} 0" range="-40 40"/><geom type="capsule" fromto="0 0 0 {u} {v} 0.1" size="0.04"/>
      <body pos="{u} {v} 0.1"><joint axis="{a} {b} 0" range="-60 60"/><geom type="capsule" fromto="0 0 0 {u} {v} -0.5" size="0.04"/></body></body>"""
    legs = "".join(leg.format(x=0.2 * x, y=0.2 * y, u=0.2 * x, v=0.2 * y, a=-y, b=x) for x in (-1, 1) for y in (-1, 1))
    text = f"""
    <mujoco>
      <option timestep="0.005"/>
      <default><geom friction="1"/><joint damping="0.1" limited="true"/></default>
      <worldbody>
        <geom type="plane" size="5 5 1"/>
        <body pos="0 0 0.6"><freejoint/><geom type="sphere" size="0.2"/>{legs}</body>
      </worldbody>
    </mujoco>"""
    largest = []
    for points in (64, 0):
        robot = subadmm.load(mujoco.MjModel.from_xml_string(text), backend="cpu")
        settings = robot.world.settings
        assert settings.ncp_points == 64 and settings.tolerance == 1e-6
        settings.certify, settings.ncp_points = True, points
        robot.world.settings = settings
        maps = []
        for _ in range(200):
            robot.world.step()
            maps.append(robot.world.report.certificate.ncp_max)
        assert robot.world.report.contacts >= 4
        largest.append(max(maps))
    # Rounding of sums of speeds around 1 m/s, by rows of up to 1e5 times the response of what they hold.
    assert largest[0] < 1e-8 and largest[1] > 1e-6, largest
