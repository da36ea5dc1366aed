"""What an installed package must be able to do where there is no compiler: scripts/wheel.sh and cibuildwheel run it.

    python try_wheel.py [--cuda]

It runs in an empty folder. --cuda: the CUDA backend must be inside; it need not find a GPU.
"""
import importlib.metadata
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

import subadmm


def stack(backend, precision):
    world = subadmm.World(backend=backend, precision=precision)
    world.add_ground()
    for k in range(8):
        world.add_solid(subadmm.box(0.1, 0.1, 0.1), density=500, position=(0, 0, 0.1 + 0.2 * k))
    return world


def stacks_stand():
    """Cubes on each other for a second, on every backend that is here."""
    for backend in subadmm.backends():
        for precision in ("f32", "f64"):
            if not backend[precision] or backend["name"] == "auto":
                continue
            world = stack(backend["name"], precision)
            before = world.positions
            world.step(round(1 / world.settings.dt))
            moved = np.abs(world.positions - before).max()
            assert moved < 1e-3, f"{backend['name']} {precision}: moved by {moved} m within a second"
            print(f"{backend['name']} {precision}: {len(before)} bodies, moved by at most {moved:.1e} m in a second")


def libraries_are_inside(folder):
    """Convex hulls need qhull, scene files jansson."""
    world = subadmm.World()
    world.add_ground()
    corners = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)]
    world.add_solid(subadmm.hull(corners), density=500, position=(0, 0, 0.1))
    path = folder / "hull.json"
    path.write_text(world.to_json())
    again = subadmm.scene(path)
    again.step(200)
    assert abs(again.positions[:, 2].max() - 0.1) < 1e-3, again.positions
    print("a convex hull, from a scene file, rests where it was put")


def commands_work(folder):
    version = subprocess.run([sys.executable, "-m", "subadmm", "--version"], check=True, capture_output=True, text=True)
    assert version.stdout.startswith(f"subadmm {subadmm.__version__} "), version.stdout
    page = folder / "stacks.html"
    subprocess.run([sys.executable, "-m", "subadmm", "record", "hand_demo", "--seconds", "1", "-o", str(page)],
                   check=True)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>") and "hand_demo" in text, text[:200]
    print(f"{version.stdout.strip()}; hand_demo is recorded: {len(text)} bytes")


def licences_are_inside():
    names = [path.parts[-2:] for path in importlib.metadata.files("subadmm") if "licenses" in path.parts]
    assert ("licenses", "LICENSE") in names, names
    print(f"licences: {', '.join('/'.join(name) for name in names)}")


def main():
    backends = {backend["name"]: backend for backend in subadmm.backends()}
    for name, backend in backends.items():
        print(f"{name}: {backend['reason']}")
    if "--cuda" in sys.argv:
        reason = backends["cuda"]["reason"]
        assert "was built" not in reason, f"no CUDA backend inside: {reason}"
    licences_are_inside()
    stacks_stand()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        libraries_are_inside(pathlib.Path(folder))
        commands_work(pathlib.Path(folder))


if __name__ == "__main__":
    main()
