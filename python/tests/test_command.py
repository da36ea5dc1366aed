"""The same scene by the command, where it is installed beside this package or named by SUBADMM, ends in the same
bits."""
import os
import re
import shutil
import subprocess

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
