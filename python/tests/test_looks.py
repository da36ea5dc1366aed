"""What is seen: visuals and colours of files, quick pictures, videos and stages, environments side by side."""
import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import subadmm
from subadmm import show
from subadmm.show.colours import NAMED, named_colour
from subadmm.show.description import tiled
from subadmm.show.picture import SUN, drawn
from subadmm.show.png import png_of
from subadmm.show.session import Session

ABOVE = show.Camera((0.0, -0.001, 6), (0.0, 0, 0), 0.6)
SHEET = Path(__file__).resolve().parents[2] / "scripts" / "picture_sheet.py"


def seen(source, camera=ABOVE, **options):
    """A picture, 80 x 80."""
    return show.picture(source, 80, 80, camera, **options).astype(int)


def strongest(pixels):
    """Which of red, green and blue a pixel has most of; -1: it is grey."""
    return int(np.argmax(pixels)) if np.ptp(pixels) > 40 else -1


# ---- colours -------------------------------------------------------------------------------------------------------


def test_bodies_that_are_named_after_a_colour_have_it():
    assert (named_colour("golden cube") == np.array(NAMED["gold"]) / 255).all()
    assert (named_colour("left_Red-wheel2") == np.array(NAMED["red"]) / 255).all() and named_colour("goldfish") is None
    world = subadmm.World(backend="cpu")
    for k, name in enumerate(("red ball", "blue ball", "green ball")):
        world.add_solid(subadmm.sphere(0.4), mass=1, position=(k - 1, 0, 0), name=name)
    image = seen(world)
    assert [strongest(image[40, column]) for column in (16, 40, 64)] == [0, 2, 1]


def test_the_golden_cube_is_golden():
    hand = subadmm.scene("hand_demo", backend="cpu")
    row = hand["golden cube"].index
    colours = np.concatenate([group.colour[group.body == row] for group in show.describe(hand).groups])
    assert (colours * 255).round().tolist() == [list(NAMED["gold"])]
    assert hand["golden cube"].mass == 1


# ---- pictures ------------------------------------------------------------------------------------------------------


def test_worlds_render_and_follow_what_changes():
    world = subadmm.World(backend="cpu")
    world.add_ground()
    ball = world.add_solid(subadmm.sphere(0.3), mass=1, position=(0, 0, 0.3), name="red")
    image = world.render(64, 48)
    assert image.shape == (48, 64, 3) and image.dtype == np.uint8 and (world.render(64, 48) == image).all()
    assert strongest(image[24, 32].astype(int)) == 0
    camera = show.Camera((0.0, -0.001, 6), (0.0, 0, 0), 0.6)
    before = world.render(64, 64, camera)
    ball.position = (0.8, 0, 0.3)
    moved = world.render(64, 64, camera).astype(int)
    assert strongest(before[32, 32].astype(int)) == 0
    assert strongest(moved[32, 32]) == -1 and strongest(moved[32, 46]) == 0
    world.add_solid(subadmm.box(0.2, 0.2, 0.2), mass=1, position=(-0.8, 0, 0.2), name="blue")
    assert strongest(world.render(64, 64, camera)[32, 18].astype(int)) == 2
    world.settings.threads = 1
    one = world.render(160, 120)
    world.settings.threads = 3
    assert (world.render(160, 120) == one).all()
    for call, error in ((lambda: world.render(4), ValueError), (lambda: world.render(64.0), TypeError),
                        (lambda: world.render(camera=3), TypeError), (lambda: world.render(camera="top"), TypeError)):
        with pytest.raises(error, match="width|camera"):
            call()


def test_there_is_no_acne_on_what_the_sun_shines_on():
    """Round shapes are of flat triangles, and shadows are kept in squares: neither may be seen as stripes."""
    world = subadmm.World(backend="cpu")
    world.add_ground()
    world.add_solid(subadmm.sphere(1.0), mass=1, position=(0, 0, 1), name="white")
    aside = np.cross(SUN, [0, 0, 1.0])
    aside /= np.linalg.norm(aside)
    for place, across in (((-1.2, -1.2, 0), (0, 0, 1.0)), ((0, 0, 1), SUN), ((0, 0, 1), SUN + aside)):
        across = np.array(across) / np.linalg.norm(across)
        at = np.array(place, float) + (across if place[2] else 0)
        # So near that a square of the shadows' is some pixels.
        image = world.render(120, 120, show.Camera(at + 0.3 * across + (0, 1e-3, 0), at, 0.3)).astype(int).sum(axis=2) / 3
        for way in (image, image.T):
            middle = (way[:-2] + way[2:]) / 2
            assert np.abs(middle - way[1:-1]).max() <= 4 and np.ptp(way) < 40


# ---- files ---------------------------------------------------------------------------------------------------------

MJCF = """
<mujoco>
  <asset>
    <material name="green" rgba="0.1 0.8 0.1 1"/>
    <texture name="half" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="64" height="64"/>
    <material name="tiles" texture="half" texrepeat="1 1" texuniform="true"/>
  </asset>
  <worldbody>
    <camera name="top" pos="0 0 6" xyaxes="1 0 0 0 1 0" fovy="34"/>
    <geom name="post" type="box" size=".2 .2 .2" pos="-0.8 0 0" rgba="1 0.1 0.1 1" contype="0" conaffinity="0"/>
    <body name="link" pos="0.8 0 0">
      <joint name="turn" type="hinge" axis="0 0 1"/>
      <geom name="shell" type="sphere" size=".3" material="green" contype="0" conaffinity="0" group="2"/>
      <geom name="core" type="box" size=".4 .4 .1" rgba="0 0 1 1" group="3"/>
    </body>
  </worldbody>
  <actuator><motor name="m" joint="turn" ctrlrange="-2 3"/><position name="p" joint="turn" kp="5"/></actuator>
</mujoco>"""


@pytest.fixture
def robot(tmp_path):
    pytest.importorskip("mujoco")
    (tmp_path / "robot.xml").write_text(MJCF)
    return subadmm.load(tmp_path / "robot.xml", backend="cpu")


def test_mjcf_is_seen_by_its_visual_geoms_and_materials(robot):
    image = seen(robot)
    assert [strongest(image[40, column]) for column in (22, 57)] == [0, 1]
    names = {name: group.colour[k] for group in show.describe(robot).groups for k, name in enumerate(group.names)}
    assert set(names) == {"post", "shell"} and np.allclose(names["shell"], [0.1, 0.8, 0.1])
    collision = show.describe(robot, collision=True)
    assert sum(len(group.body) for group in collision.groups) == 1
    # It moves with its body, and a file's camera sees the same.
    top = robot.render(80, 80, camera="top").astype(int)
    assert [strongest(top[40, column]) for column in (22, 57)] == [0, 1]
    with pytest.raises(KeyError, match="no camera"):
        robot.render(camera="no such")
    # What is fixed in the world is in recordings, too.
    taken = show.record(robot, 0.1)
    assert taken.positions.shape[1] == robot.world.body_count + 1 and (taken.positions[:, -1] == 0).all()


def test_textures_of_planes_are_repeated_as_the_file_says(tmp_path):
    pytest.importorskip("mujoco")
    floor = '<geom type="plane" size="0 0 1" pos="0 0 -1" material="tiles"/>'
    text = MJCF.replace('<geom name="post"', floor + '<geom name="post"')
    (tmp_path / "floor.xml").write_text(text)
    floor = subadmm.load(tmp_path / "floor.xml", backend="cpu")
    image = seen(floor, show.Camera((0.0, -0.001, 5), (0, 0, -1.0), 0.8))
    # One repetition is 2 m: squares of 1 m, red and blue, until the floor goes over into the backdrop.
    metre = 40 / (6 * np.tan(0.4))      # in pixels
    row = [strongest(image[8, column]) for column in range(80)]
    assert set(row[41:int(40 + metre)]) == {2} and set(row[int(41 + metre):int(45 + metre)]) == {0}


def test_boxes_have_the_sides_of_a_cube_texture(tmp_path):
    pytest.importorskip("mujoco")
    sides = {"right": (255, 0, 0), "front": (0, 255, 0), "back": (9, 9, 9), "left": (9, 9, 9), "up": (0, 0, 255)}
    for name, colour in (*sides.items(), ("down", (9, 9, 9))):
        (tmp_path / f"{name}.png").write_bytes(png_of(np.full((16, 16, 3), colour, np.uint8)))
    files = " ".join(f'file{name}="{name}.png"' for name in (*sides, "down"))
    (tmp_path / "die.xml").write_text(f"""<mujoco><asset><texture name="die" type="cube" {files}/>
      <material name="die" texture="die"/></asset>
      <worldbody><body><freejoint/><geom type="box" size=".4 .4 .4" material="die"/></body></worldbody></mujoco>""")
    die = subadmm.load(tmp_path / "die.xml", backend="cpu")
    for eye, side in (((4, 0, 0.01), 0), ((0, 0.01, 4), 1), ((0, 4, 0.01), 2)):
        image = seen(die, show.Camera(eye, (0, 0, 0), 0.3))
        assert strongest(image[40, 40]) == side and strongest(image[14, 66]) == side


def test_urdf_is_seen_by_its_visuals(tmp_path):
    pytest.importorskip("mujoco")
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((0.5, 0.5, 0.5)).export(tmp_path / "box.obj")
    (tmp_path / "robot.urdf").write_text("""<robot name="r">
      <material name="sky"><color rgba="0.1 0.2 0.9 1"/></material>
      <link name="base"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><origin xyz="-0.8 0 0"/><geometry><mesh filename="package://r/box.obj"/></geometry>
          <material name="sky"/></visual>
        <visual><geometry><mesh filename="package://r/none.dae"/></geometry></visual></link>
      <link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><origin xyz="0 0 0" rpy="0 1.5708 0"/><geometry><cylinder radius="0.2" length="0.8"/></geometry>
          <material name="own"><color rgba="0.9 0.1 0.1 1"/></material></visual>
        <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
      <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0.8 0 0"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>""")
    robot = subadmm.load(tmp_path / "robot.urdf", backend="cpu")
    image = seen(robot)
    assert [strongest(image[40, column]) for column in (22, 48, 57, 66)] == [2, 0, 0, 0]
    assert strongest(image[28, 57]) == -1
    assert any("is not shown" in note.reason for note in robot.report)


def test_usd_is_seen_by_its_prims(tmp_path):
    pytest.importorskip("pxr")
    (tmp_path / "stage.usda").write_text("""#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
)
def PhysicsScene "scene" {}
def Xform "body" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{
    float physics:mass = 1
    double3 xformOp:translate = (0.8, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Cube "hull" (prepend apiSchemas = ["PhysicsCollisionAPI"]) { double size = 0.9
        uniform token purpose = "guide"
    }
    def Sphere "shell" { double radius = 0.3
        color3f[] primvars:displayColor = [(0.02, 0.6, 0.02)]
    }
}
def Cube "post" (prepend apiSchemas = ["MaterialBindingAPI"]) { double size = 0.4
    double3 xformOp:translate = (-0.8, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel material:binding = </red>
}
def Material "red"
{
    token outputs:surface.connect = </red/surface.outputs:surface>
    def Shader "surface" { uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.7, 0.02, 0.02)
        token outputs:surface
    }
}
""")
    stage = subadmm.load(tmp_path / "stage.usda", backend="cpu")
    image = seen(stage)
    assert [strongest(image[40, column]) for column in (22, 57)] == [0, 1] and strongest(image[28, 68]) == -1
    assert {name for group in show.describe(stage).groups for name in group.names} == {"/body/shell", "/post"}


# ---- recordings ----------------------------------------------------------------------------------------------------


def test_recordings_are_videos(tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    world = subadmm.World(backend="cpu")
    ball = world.add_solid(subadmm.sphere(0.5), mass=1, name="red")
    ball.linear_velocity = (1, 0, 0)
    world.settings.gravity = (0, 0, 0)
    taken = show.record(world, 0.5)
    taken.save(tmp_path / "a.mp4", width=96, height=64, camera=ABOVE)
    frames = ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    about = next(frames)
    images = [np.frombuffer(frame, np.uint8).reshape(64, 96, 3).astype(int) for frame in frames]
    assert about["size"] == (96, 64) and about["fps"] == pytest.approx(30, abs=0.5) and len(images) == len(taken.times)
    middles = [np.nonzero(image[..., 0] - image[..., 2] > 60)[1].mean() for image in (images[0], images[-1])]
    assert middles[1] - middles[0] == pytest.approx(0.5 * 32 / (6 * np.tan(0.3)), abs=2)
    for options, said in (({"width": 95}, "width: 95; must be even"), ({"height": 8}, "height: 8")):
        with pytest.raises(ValueError, match=said):
            taken.save(tmp_path / "b.mp4", **options)
    with pytest.raises(ValueError, match="width: only .mp4 files have one"):
        taken.save(tmp_path / "b.html", width=96)
    assert not (tmp_path / "b.mp4").exists() and not (tmp_path / "b.html").exists()


@pytest.mark.parametrize("ending", [".usda", ".usdc"])
def test_recordings_are_stages(tmp_path, ending):
    pxr = pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    taken = show.record(subadmm.scene("ragdolls:2", backend="cpu"), 0.3, title="dolls")
    taken.save(tmp_path / f"dolls{ending}")
    stage = Usd.Stage.Open(str(tmp_path / f"dolls{ending}"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1 and pxr
    codes = taken.times * stage.GetTimeCodesPerSecond()
    for frame in (0, 5, len(codes) - 1):
        places, _ = taken.poses(frame)
        for body in (1, 7, 22):
            moved = UsdGeom.Xformable(stage.GetPrimAtPath(f"/world/body_{body}")).GetLocalTransformation(codes[frame])
            assert np.allclose(moved.ExtractTranslation(), places[body], atol=1e-5)
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert len(meshes) == sum(len(group.body) for group in taken.description.groups)


def test_endings_say_what_they_need(tmp_path, monkeypatch):
    taken = show.record(subadmm.World(), 0.05)
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec",
                        lambda name: None if name in ("imageio_ffmpeg", "pxr") else find(name))
    for ending, said in (("mp4", "pip install imageio-ffmpeg"), ("usda", "pip install usd-core")):
        with pytest.raises(ImportError, match=said):
            taken.save(tmp_path / f"a.{ending}")


# ---- environments --------------------------------------------------------------------------------------------------


def two_balls():
    world = subadmm.World(backend="cpu")
    world.add_ground()
    world.add_solid(subadmm.sphere(0.2), mass=1, position=(0, 0, 0.2), name="red")
    return subadmm.replicate(world, 4)


def test_environments_are_side_by_side():
    session = Session(two_balls)
    description = session.describe()
    places, _ = description.poses(session.state())
    balls = places[1::2]
    assert description.bodies == 8 and len(np.unique(balls.round(6), axis=0)) == 4
    assert min(np.linalg.norm(a - b) for k, a in enumerate(balls) for b in balls[:k]) > 0.4      # apart
    states = session.environments.get("body_state")
    states[2, 1, 2] = 1.0
    session.environments.set("body_state", states)
    lifted, _ = description.poses(session.state())
    assert (lifted - places)[5] == pytest.approx([0, 0, 0.8]) and np.abs(np.delete(lifted - places, 5, 0)).max() < 1e-9
    image = drawn(description, *description.poses(session.state()), show.looking_at(description), 160, 120, smooth=1,
                  shadow=256, neighbours=0)
    assert (image[..., 0].astype(int) - image[..., 2] > 60).mean() > 0.01
    session.step(3)
    assert session.steps == 3 and not session.grab(1, (0, 0, 0)) and session.history["kinetic"][-1] > 0
    session.reset()
    assert session.state()[5, 2] == pytest.approx(0.2)
    assert tiled(description, 1) is description


# ---- the sheet of pictures -----------------------------------------------------------------------------------------


def test_sheets_have_all_models_of_a_folder(tmp_path):
    pytest.importorskip("mujoco")
    Image = pytest.importorskip("PIL.Image")
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "a.xml").write_text(MJCF)
    (tmp_path / "models" / "broken.xml").write_text("<mujoco><worldbody><geom type='none'/></worldbody></mujoco>")
    (tmp_path / "models" / "part.xml").write_text("<mujocoinclude/>")
    ran = subprocess.run([sys.executable, SHEET, "--out", tmp_path / "sheet.png", "--size", "80x60", "--columns", "2",
                          tmp_path / "models"], capture_output=True, text=True)
    assert "2 models, 1 not loaded" in ran.stdout and ran.returncode == 1, ran.stdout + ran.stderr
    with Image.open(tmp_path / "sheet.png") as sheet:
        pixels = np.array(sheet)
    assert pixels.shape == (78, 320, 3) and len(np.unique(pixels[18:, :80].reshape(-1, 3), axis=0)) > 50
