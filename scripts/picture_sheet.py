#!/usr/bin/env python3
"""A sheet of pictures of robots' files: each as subadmm draws it, and beside it as MuJoCo does.

    pip install '.[import,usd]' pillow
    scripts/picture_sheet.py --out sheet.png                       # models of the installed gymnasium and dm_control
    scripts/picture_sheet.py --out sheet.png FOLDER FILE.xml ...   # all that can be loaded in folders, and files
    scripts/picture_sheet.py --out sheet.png --columns 4 --size 320x240

Each model is drawn in its first pose by the same camera. MuJoCo's picture is left out where MuJoCo has no OpenGL
(MUJOCO_GL=egl or osmesa gives it one without a window), and of USD stages. What cannot be loaded has its error instead.
Exit status 0: all models were loaded.
"""
import argparse
import importlib.util
import pathlib
import sys
import textwrap

import numpy as np
from PIL import Image, ImageDraw

import subadmm
from subadmm import show

SUFFIXES = (".xml", ".mjcf", ".urdf", ".usd", ".usda", ".usdc", ".usdz")
INSTALLED = {"gymnasium": "envs/mujoco/assets", "dm_control": "suite"}
BAR = 18  # rows of text


def is_model(path):
    """Is it a file that load() reads, rather than a part of one?"""
    if path.suffix.lower() not in SUFFIXES:
        return False
    if path.suffix.lower() not in (".xml", ".mjcf"):
        return True
    text = path.read_text(encoding="utf-8", errors="replace")
    return ("<mujoco" in text and "<worldbody" in text) or "<robot" in text


def models(given):
    """Paths of all models of files and folders; without any those of installed packages."""
    places = [pathlib.Path(place) for place in given]
    if not places:
        for package, folder in INSTALLED.items():
            spec = importlib.util.find_spec(package)
            if spec is None:
                print(f"{package} is not installed: its models are left out", file=sys.stderr)
                continue
            places.append(pathlib.Path(spec.origin).parent / folder)
    for place in places:
        if place.is_dir():
            yield from (path for path in sorted(place.rglob("*")) if path.is_file() and is_model(path))
        else:
            yield place


def by_mujoco(source, robot, camera, width, height):
    """MuJoCo's picture by our camera; None where it has no OpenGL."""
    import mujoco

    source.vis.global_.offwidth, source.vis.global_.offheight = max(width, 640), max(height, 480)
    source.vis.global_.fovy = np.degrees(camera.field)
    data = mujoco.MjData(source)
    data.qpos[:] = robot.q
    mujoco.mj_forward(source, data)
    eye = mujoco.MjvCamera()
    toward = camera.target - camera.eye
    eye.distance = float(np.linalg.norm(toward))
    eye.lookat[:] = camera.target
    eye.azimuth = float(np.degrees(np.arctan2(toward[1], toward[0])))
    eye.elevation = float(np.degrees(np.arcsin(toward[2] / eye.distance)))
    source.vis.map.znear, source.vis.map.zfar = 0.01, 100 * eye.distance / max(source.stat.extent, 1e-6)
    renderer = mujoco.Renderer(source, height, width)
    try:
        renderer.update_scene(data, eye)
        return renderer.render().copy()
    finally:
        renderer.close()


def cell(path, width, height, with_mujoco):
    """(two pictures side by side with a name above, error or '')"""
    out = Image.new("RGB", (2 * width, height + BAR), (255, 255, 255))
    pen, said = ImageDraw.Draw(out), ""
    try:
        robot = subadmm.load(path)
        description = show.describe(robot)
        camera = show.looking_at(description, azimuth=-60, elevation=20, field=0.7)
        out.paste(Image.fromarray(show.picture(robot, width, height, camera, description=description)), (0, BAR))
        if with_mujoco and hasattr(robot.source, "ngeom"):
            try:
                out.paste(Image.fromarray(by_mujoco(robot.source, robot, camera, width, height)), (width, BAR))
            except Exception as error:  # no OpenGL, in as many ways as there are libraries of it
                text = textwrap.fill(f"MuJoCo: {error}", width // 7)
                pen.multiline_text((width + 6, BAR + 6), text, fill=(120, 120, 120))
    except (subadmm.Error, ValueError, OSError, ImportError) as error:
        said = str(error)
        pen.multiline_text((6, BAR + 6), textwrap.fill(said, width // 7), fill=(180, 30, 30))
    pen.text((6, 3), f"{path.parent.name}/{path.name}" + ("" if said else "   subadmm | MuJoCo"), fill=(30, 30, 30))
    return out, said


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("models", nargs="*", help="files and folders; default: those of installed packages")
    parser.add_argument("--out", required=True, help="the picture to write, .png")
    parser.add_argument("--columns", type=int, default=3, help="models a row (3)")
    parser.add_argument("--size", default="320x240", help="WIDTHxHEIGHT of each picture (320x240)")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    with_mujoco = importlib.util.find_spec("mujoco") is not None
    cells, failed = [], 0
    for path in models(given.models):
        made, said = cell(path, width, height, with_mujoco)
        print(f"{path}: {said or 'drawn'}", flush=True)
        failed += bool(said)
        cells.append(made)
    if not cells:
        sys.exit("there are no models: give files or folders")
    columns = min(max(given.columns, 1), len(cells))
    rows = -(-len(cells) // columns)
    sheet = Image.new("RGB", (columns * 2 * width, rows * (height + BAR)), (255, 255, 255))
    for k, made in enumerate(cells):
        sheet.paste(made, (k % columns * 2 * width, k // columns * (height + BAR)))
    sheet.save(given.out)
    print(f"{len(cells)} models, {failed} not loaded: {given.out}")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
