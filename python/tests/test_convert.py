"""Robots and scenes as scene files: what is written makes the same steps, also by the command."""

import json
import os
import re
import shutil
import subprocess

import pytest

import subadmm
from subadmm.__main__ import main
from subadmm.convert import convert

COMMAND = os.environ.get("SUBADMM") or shutil.which("subadmm")
STEPS = 200

ROBOT = """
<mujoco><option timestep="0.002"/><worldbody>
  <geom name="floor" type="plane" size="1 1 1"/>
  <body name="base" pos="0 0 .5"><joint name="slide" type="slide" axis="1 0 0" range="-.1 .3" damping="5"/>
    <geom type="box" size=".1 .1 .05" mass="3"/>
    <body name="arm" pos="0 0 .1"><joint name="a" axis="0 1 0" armature=".01"/>
      <joint name="b" axis="1 0 0" range="-40 40"/>
      <geom type="capsule" size=".03" fromto="0 0 0 .3 0 0" mass="1"/>
      <body name="finger" pos=".3 0 0"><joint name="c" axis="0 1 0"/>
        <geom type="cylinder" size=".02 .05" mass=".2"/></body>
      <body name="thumb" pos=".3 .1 0"><joint name="d" axis="0 1 0"/>
        <geom type="mesh" mesh="wedge" mass=".2"/></body></body></body>
  <body name="ball" pos=".4 0 .3"><freejoint/><geom size=".06" friction=".9"/></body>
</worldbody>
<asset><mesh name="wedge" vertex="0 0 0 .1 0 0 0 .04 0 0 0 .05"/></asset>
<equality><joint joint1="c" joint2="d" polycoef="0 1 0 0 0"/></equality>
<actuator><position name="servo" joint="a" kp="30" kv="2" ctrlrange="-2 2"/>
  <motor name="push" joint="slide"/></actuator>
<keyframe><key name="up" qpos="0 .1 0 0 0 .4 0 .3 1 0 0 0" ctrl=".5 2"/></keyframe></mujoco>
"""


def run(path):
    """The command's hash of a scene file; where there is no command, the package's own."""
    if COMMAND:
        out = subprocess.run(
            [COMMAND, "run", path, "--steps", str(STEPS), "--backend", "cpu"], capture_output=True, text=True
        ).stdout
        return re.search(r"hash ([0-9a-f]{16})", out).group(1)
    world = subadmm.scene(path, backend="cpu")
    world.step(STEPS)
    return f"{world.state_hash():016x}"


def test_a_robot_runs_as_it_does_here(tmp_path, capsys):
    pytest.importorskip("mujoco")
    (tmp_path / "robot.xml").write_text(ROBOT)
    out, report = tmp_path / "robot.json", tmp_path / "report.json"
    options = ["--report", str(report), "--keyframe", "up", "--duration", "3"]
    assert main(["convert", str(tmp_path / "robot.xml"), str(out), *options]) == 0
    printed = capsys.readouterr().out
    loaded = subadmm.load(tmp_path / "robot.xml", keyframe="up", backend="cpu")
    loaded.world.step(STEPS)
    assert loaded.world.report.contacts > 0 and run(str(out)) == f"{loaded.world.state_hash():016x}"
    file, said = json.loads(out.read_text()), json.loads(report.read_text())
    assert (file["name"], file["duration"]) == ("robot", 3)
    assert {"base", "arm", "finger", "thumb", "ball"} <= {one["name"] for one in file["bodies"]}
    named = {note["element"] for note in said["not_carried_over"]}
    assert named == {note.element for note in loaded.report} | {"actuators"}
    assert all(note["element"] in printed and note["reason"] in printed for note in said["not_carried_over"])
    # joints by their places, as gears and arrays have them
    joint = said["joints"]["b"]
    assert file["joints"][joint["joint"]]["coordinates"][joint["coordinate"]]["limits"] is not None
    assert said["joints"]["c"]["joint"] == loaded.joints["c"].joint.index


def test_a_stage_runs_as_it_does_here(tmp_path):
    pytest.importorskip("pxr")
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    UsdGeom.SetStageUpAxis(stage, "Z")
    UsdPhysics.CollisionAPI.Apply(UsdGeom.Plane.Define(stage, "/ground").GetPrim())
    for k, kind in enumerate(("Cube", "Sphere", "Cone", "Cylinder")):
        prim = getattr(UsdGeom, kind).Define(stage, f"/{'long_' * 20}{kind}").GetPrim()
        UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(0.3 * k, 0, 4 * k + 4))
        UsdPhysics.CollisionAPI.Apply(prim), UsdPhysics.RigidBodyAPI.Apply(prim)
    hinge = UsdPhysics.RevoluteJoint.Define(stage, "/hinge")
    hinge.CreateBody1Rel().SetTargets([f"/{'long_' * 20}Cone"]), hinge.CreateLocalPos0Attr(Gf.Vec3f(0.6, 3, 12))
    hinge.CreateLocalPos1Attr(Gf.Vec3f(0, 3, 0))
    stage.Save()
    convert(tmp_path / "a.usda", tmp_path / "a.json")
    loaded = subadmm.load(tmp_path / "a.usda", backend="cpu")
    names = [one["name"] for one in json.loads((tmp_path / "a.json").read_text())["bodies"]]
    assert names[1].endswith("long_Cube") and len(names[1]) == 63  # the end of a path that is too long
    loaded.world.step(STEPS)
    assert loaded.world.report.contacts > 0 and run(str(tmp_path / "a.json")) == f"{loaded.world.state_hash():016x}"


@pytest.mark.parametrize("spec", ["pile:5", "grippers:2", "arch:5:100"])
def test_a_scene_is_what_the_command_writes(spec, tmp_path, capsys):
    path = str(tmp_path / "scene.json")
    assert main(["convert", spec, path]) == 0
    said = capsys.readouterr().out
    assert ("script" in said) == spec.startswith("grippers") and ("success" in said) == (not spec.startswith("pile"))
    world = subadmm.scene(spec, backend="cpu")
    if spec.startswith("pile"):  # the others move by a script, or are the same
        world.step(STEPS)
        assert run(path) == f"{world.state_hash():016x}"
    if COMMAND:
        out = subprocess.run([COMMAND, "scenes", spec, "--json"], capture_output=True, text=True).stdout
        assert open(path, encoding="utf-8").read() == out
    again = str(tmp_path / "again.json")  # a scene file, too
    assert convert(path, again) == [] and open(again, encoding="utf-8").read() == open(path, encoding="utf-8").read()


def test_errors_are_one_line(tmp_path, capsys):
    for arguments, status, words in (
        (["none.xml", str(tmp_path / "a.json")], 1, "no file none.xml"),
        (["no_such_scene", str(tmp_path / "a.json")], 2, "must be one of"),
        (["pile:3", str(tmp_path / "a.txt")], 2, "must end in .json"),
        (["pile:3", str(tmp_path / "a.json"), "--keyframe", "up"], 2, "keyframe: a scene has none"),
        (["pile:3", str(tmp_path / "a.json"), "--duration", "-1"], 2, "--duration: -1"),
        (["pile:3", str(tmp_path / "none" / "a.json")], 1, "a.json"),
    ):
        assert main(["convert", *arguments]) == status
        said = capsys.readouterr().err
        assert words in said and said.count("\n") == 1, said
