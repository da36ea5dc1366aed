"""Blocks of Python in the user's guide run as they stand: each by itself, in an empty folder. Those that name a program
of examples in their first line are part of it (tests/test_docs.py) and are run with it; those that say what they need
are run where it is there."""

import importlib.util
import re
from pathlib import Path

import pytest

import subadmm

GUIDE = Path(__file__).parents[2] / "docs" / "guide"
NEEDS = re.compile(r"# needs (.+)")


def blocks():
    for page in sorted(GUIDE.glob("*.md")):
        for k, code in enumerate(re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)):
            if not code.startswith("# examples/"):
                yield pytest.param(code, id=f"{page.stem}-{k}")


def missing(need):
    """What is missing of what a block needs: "a GPU", and packages by the names they are imported by."""
    def is_there(name):
        if name == "a GPU":
            return any(b["name"] == "cuda" and b["f32"] for b in subadmm.backends())
        return importlib.util.find_spec(name) is not None

    return next((name for name in need.split(", ") if not is_there(name)), None)


assert list(blocks()), "no guide"


@pytest.mark.parametrize("code", list(blocks()))
def test_block(code, tmp_path, monkeypatch):
    needs = NEEDS.match(code)
    if needs and missing(needs[1]):
        pytest.skip(f"needs {missing(needs[1])}")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "block", "exec"), {"__name__": "__main__"})
