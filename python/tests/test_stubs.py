"""The types for editors and checkers are those of the module: nothing is missing, nothing is left over, and programs are
checked by them (mypy --strict)."""
import ast
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

import subadmm
from subadmm import _core

STUBS = Path(_core.__file__).with_name("_core.pyi")
PROJECT = Path(__file__).resolve().parents[2]


def stubbed():
    """Names of the module's stubs, of each class the members."""
    out = {}
    for node in ast.parse(STUBS.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef):
            members = set()
            for member in node.body:
                if isinstance(member, (ast.FunctionDef, ast.ClassDef)):
                    members.add(member.name)
                elif isinstance(member, ast.AnnAssign):
                    members.add(member.target.id)
            out[node.name] = members
        elif isinstance(node, ast.FunctionDef):
            out[node.name] = None
        elif isinstance(node, ast.AnnAssign):
            out[node.target.id] = None
    return out


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_every_name_has_a_stub_and_the_other_way_round():
    stubs = stubbed()
    assert public(stubs) == public(vars(_core))
    for name, members in stubs.items():
        if members is None or issubclass(getattr(_core, name), Exception):
            continue
        here = vars(getattr(_core, name))
        assert public(members) == public(here), name
        dunders = {"__getitem__", "__contains__", "__copy__", "__deepcopy__"} & set(here)
        assert dunders <= members | ({"__copy__", "__deepcopy__"} if name == "Shape" else set()), name


def test_what_the_package_exports_has_types():
    for name in subadmm.__all__:
        assert hasattr(subadmm, name), name
        member = getattr(subadmm, name)
        if isinstance(member, types.FunctionType):
            assert "return" in member.__annotations__, f"{name} says no types"


def blocks():
    """Python of the README and the guide that is a program by itself."""
    for page in [PROJECT / "README.md", *sorted((PROJECT / "docs/guide").glob("*.md"))]:
        found = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
        for k, block in enumerate(found):
            needs_more = re.search(r"import (torch|gymnasium|mujoco|rsl_rl)|subadmm[.]gym", block)
            if block.startswith("#") or "import" not in block or needs_more:
                continue
            yield f"{page.stem}_{k}", block


def test_programs_of_the_documents_are_checked(tmp_path):
    pytest.importorskip("mypy")
    names = []
    for name, block in blocks():
        names.append(f"{name.replace('-', '_')}.py")
        (tmp_path / names[-1]).write_text(block, encoding="utf-8")
    names.append("values.py")
    (tmp_path / names[-1]).write_text("""
import numpy as np
import subadmm

world = subadmm.World(settings=subadmm.Settings(dt=0.002))
world.add_ground(friction=0.4)
body = world.add_solid(subadmm.box(0.1, 0.1, 0.1, friction=0.3), density=1000, position=np.array([0, 0, 1]))
body.linear_velocity += np.ones(3)
world.settings.gravity = (0, 0, -1)
copied: subadmm.Settings = world.settings.copy()
other: subadmm.World = world.clone()
named: subadmm.Body = world["box"]
heights: float = world.positions[:, 2].max()
world.set("body_state", world.get("body_state"))
rows = world.body_rows(world.contacts()["body_a"])
version: str = subadmm.__version__
try:
    world.step(3)
except subadmm.NonFinite as error:
    print(error.status)
""", encoding="utf-8")
    assert len(names) > 10
    mypy = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache")]
    checked = subprocess.run([*mypy, *names], cwd=tmp_path, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    # What is wrong is found.
    (tmp_path / "wrong.py").write_text("import subadmm\nsubadmm.World().no_such_method()\nsubadmm.sphere('a')\n")
    checked = subprocess.run([*mypy, "wrong.py"], cwd=tmp_path, capture_output=True, text=True)
    assert checked.returncode == 1 and "no_such_method" in checked.stdout and "Found 2 errors" in checked.stdout
