"""The same scene by the command, where it is installed beside this package or named by SUBADMM, ends in the same
bits."""
import os
import re
import shutil
import subprocess
import sys

import pytest

import subadmm

COMMAND = os.environ.get("SUBADMM") or shutil.which("subadmm")


@pytest.mark.skipif(not COMMAND, reason="there is no subadmm command")
@pytest.mark.parametrize("spec, steps, precision, method", [
    ("pile:40", 60, "f64", "fast"), ("grippers:2", 200, "f32", "fast"), ("mixer:30", 40, "f64", "paper"),
    ("kicked_cubes:2", 110, "f64", "fast"),
])
def test_results_are_those_of_the_command(spec, steps, precision, method):
    out = subprocess.run([COMMAND, "run", spec, "--steps", str(steps), "--backend", "cpu", "--precision", precision,
                          "--method", method], capture_output=True, text=True).stdout
    world = subadmm.scene(spec, backend="cpu", precision=precision, method=method)
    world.step(steps)
    assert re.search(r"hash ([0-9a-f]{16})", out).group(1) == f"{world.state_hash():016x}"


ARM = """<robot name="arm"><link name="base"><collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
<link name="upper"><inertial><origin xyz="0 0 0.25"/><mass value="2"/>
<inertia ixx="0.04" ixy="0" ixz="0" iyy="0.04" iyz="0" izz="0.002"/></inertial>
<collision><origin xyz="0 0 0.25"/><geometry><cylinder radius="0.04" length="0.4"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.1" rpy="0.3 0 0"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="10" velocity="2"/></joint></robot>"""

HOPPER = """<mujoco><worldbody><geom type="plane" size="5 5 .1"/><body name="ball" pos="0 0 1"><freejoint/>
<geom type="sphere" size="0.1"/></body><body name="pole" pos="1 0 1" euler="0 40 0"><joint type="hinge" axis="0 1 0"/>
<geom type="capsule" size="0.05 0.3" pos="0 0 -0.3"/></body></worldbody></mujoco>"""


@pytest.mark.skipif(not COMMAND, reason="there is no subadmm command")
@pytest.mark.parametrize("name, text", [("arm.urdf", ARM), ("hopper.xml", HOPPER)])
def test_robots_run_by_way_of_convert(name, text, tmp_path):
    """The command names what makes a scene file of a robot, and runs that file to the bits of the robot itself."""
    pytest.importorskip("mujoco")
    (tmp_path / name).write_text(text)
    refused = subprocess.run([COMMAND, "run", name], cwd=tmp_path, capture_output=True, text=True)
    made = f"{name.partition('.')[0]}.json"
    assert refused.returncode == 1 and f'"python -m subadmm convert {name} {made}"' in refused.stderr
    subprocess.run([sys.executable, "-m", "subadmm", "convert", name, made], cwd=tmp_path, check=True,
                   capture_output=True)
    out = subprocess.run([COMMAND, "run", made, "--steps", "100", "--backend", "cpu"], cwd=tmp_path, check=True,
                         capture_output=True, text=True).stdout
    world = subadmm.load(tmp_path / name, backend="cpu").world
    world.step(100)
    assert re.search(r"hash ([0-9a-f]{16})", out).group(1) == f"{world.state_hash():016x}"
    assert float(re.search(r"moved ([0-9.e-]+) m", out).group(1)) > 0.01
