"""Robots and scenes as scene files, which the subadmm command and other programs read (docs/guide/scene-files.md)."""

import json
import os
import xml.etree.ElementTree as tree
from contextlib import ExitStack

from .importing import load
from .importing.model import Report
from .output import Output

#: Suffixes of files that are loaded; all else is a scene's name, or the path of a scene file.
MODELS = (".xml", ".mjcf", ".urdf", ".usd", ".usda", ".usdc", ".usdz")


def is_model(source):
    """Does it end as a robot's file does?"""
    return os.path.splitext(source)[1].lower() in MODELS


def _collect(path, files, folders, names):
    """Of an MJCF or URDF file: itself and what it includes, the folders that it gives, the files that it names."""
    if path in files:
        return
    files.append(path)
    try:
        root = tree.parse(path).getroot()
    except (OSError, tree.ParseError):
        return
    for one in root.iter():
        folders += [one.get(kind) for kind in ("assetdir", "meshdir", "texturedir") if one.get(kind)]
        name = (one.get("file") or one.get("filename") or "").rpartition("://")[2]
        if name and one.tag == "include":
            _collect(os.path.join(os.path.dirname(files[0]), name), files, folders, names)
        elif name:
            names.append(name)


def read_by(source):
    """Paths of the files that a robot's file or a scene is read from; some of them may not be there."""
    source, seen = os.fspath(source), []
    suffix = os.path.splitext(source)[1].lower()
    if suffix in (".xml", ".mjcf", ".urdf"):
        folders, names = [""], []
        _collect(source, seen, folders, names)
        seen += [os.path.join(os.path.dirname(source), folder, name) for folder in folders for name in names]
    elif suffix in MODELS:
        try:
            from pxr import UsdUtils

            layers, assets, _ = UsdUtils.ComputeAllDependencies(source)
            seen = [layer.realPath for layer in layers] + list(assets)
        except Exception:  # no usd-core, or no stage: what reads it says so
            pass
    return [source, *seen]


def open_source(source, **options):
    """(world, report, joints) of a robot's file, a scene's name or a scene file. options: as of load(), for robots
    only.

    report: what of the source is not in the world, or will not be in a scene file of it. joints: {name: place in the
    file's list of joints and coordinate}: a joint there may be several of the source.
    """
    from . import scene

    if not is_model(source):
        given = [name for name, value in options.items() if value]
        if given:
            raise ValueError(f"{given[0]}: a scene has none; it is of MJCF, URDF or USD files")
        world, report = scene(source), Report()
        if world.has_script:
            report.add(f"scene {source}", "its script, which moves things as it runs, is not in the file")
        if world.tasks:
            report.add(f"scene {source}", "what it measures of its own success is not in the file")
        return world, report, {}
    loaded = load(source, **options)
    report = Report(loaded.report)
    if loaded.actuators:
        report.add("actuators", "are drives of joints in the file, with the controls that they have now")
    return loaded.world, report, joints_of(loaded)


def joints_of(loaded):
    """{name: {"joint": place in the world's list, "coordinate": index or None}} of what was loaded."""
    out = {}
    for name, joint in loaded.joints.items():
        if not hasattr(joint, "joint"):  # a stage's are the world's own
            out[name] = {"joint": joint.index, "coordinate": None}
        elif joint.joint is not None:  # a free body's is none
            out[name] = {"joint": joint.joint.index, "coordinate": joint.coordinate}
    return out


def convert(source, path, *, report=None, duration=None, **options):
    """Write a robot, or a scene, as a scene file at `path`, and return the report (a list of (element, reason)).

    source: an MJCF, URDF or USD file, a scene's name ("pile:300") or a scene file. report: a file to write the report
    to, as JSON, with the joints' places in the scene file. duration: how long the scene is meant to be run for, s, in
    [0, 1e9] (default: the scene's, 10). Other options: as of load(). Both files are complete, or as they were.
    """
    with ExitStack() as files:
        reads, said = read_by(source), None
        file = files.enter_context(Output("path", path, reads))
        if report is not None:
            said = files.enter_context(Output("report", report, reads, [file]))
        return _convert(source, file, said, duration, options)


def _convert(source, file, said, duration, options):
    world, notes, joints = open_source(os.fspath(source), **options)
    named = {}
    if world.duration is None:  # no scene of the library and no scene file
        named = {
            "name": os.path.splitext(os.path.basename(source))[0],
            "description": f"from {os.path.basename(source)}",
        }
    text = world.to_json(duration=duration, **named)
    file.write(text)
    if said is not None:
        reported = {"not_carried_over": [note._asdict() for note in notes], "joints": joints}
        said.write(json.dumps(reported, indent=1, ensure_ascii=False) + "\n")
    return notes
