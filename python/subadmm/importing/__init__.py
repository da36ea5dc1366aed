"""Robots and scenes from files: MJCF and URDF, read by MuJoCo's compiler (the extra `import` of the package), and
USD, read by usd-core (the extra `usd`).

    robot = subadmm.load("robot.xml")
    robot.world.step(100)
    print(robot.joints["elbow"].position, robot.report)

docs/guide/importing.md says what is carried over, and how. What is not is in `report`, element by element.
"""
from __future__ import annotations


import os
from typing import Any

from ..decomposition import THRESHOLD
from ..given import real
from .actuators import add_actuators
from .equality import add_equalities
from .model import Loaded, LoadedActuator, LoadedJoint, LoadedModel, LoadedStage, Note, Report
from .options import report_options, settings_of
from .shapes import add_shapes
from .start import start_of
from .tree import add_tree

__all__ = ["Loaded", "LoadedActuator", "LoadedJoint", "LoadedModel", "LoadedStage", "Note", "Report", "load"]

USD = (".usd", ".usda", ".usdc", ".usdz")


def _threshold_of(decompose):
    """Of decompose=: coacd's threshold, or None."""
    if decompose is False or decompose is None:
        return None
    return THRESHOLD if decompose is True else real("decompose", decompose, 0.01, 1)


def _take_threads(world, threads):
    if threads is not None:
        settings = world.settings
        settings.threads = threads
        world.settings = settings


def _is_stage(path):
    """Is it a USD stage, or the name of one?"""
    if isinstance(path, (str, os.PathLike)):
        return os.path.splitext(os.fspath(path))[1].lower() in USD
    return type(path).__module__.startswith("pxr")


def load(
    path: Any,
    *,
    floating: bool = False,
    keyframe: str | int | None = None,
    qpos: Any = None,
    qvel: Any = None,
    settings: Any = None,
    backend: str = "auto",
    precision: str = "f64",
    device: int = 0,
    threads: int | None = None,
    carrier_share: float = 1e-4,
    overlaps: str = "ignore",
    decompose: bool | float = False,
) -> Any:
    """Build a world from an MJCF or URDF file, compiled by the package `mujoco` (pip install mujoco), or
    from a USD stage (.usd, .usda, .usdc, .usdz), read by `usd-core` (pip install usd-core).

    path: the file; or a mujoco.MjModel that is compiled already, or a pxr.Usd.Stage that is open.
    settings: a subadmm.Settings; default: the file's time step and gravity. backend, precision, device: as of World.
    threads: in place of settings.threads.
    decompose: True makes several hulls of each mesh of a body that moves, by coacd (pip install coacd); a
        number in [0.01, 1] is the concavity that may remain (True: 0.05). Default: one hull, which is in the report
        where it is much larger than the mesh.

    Of MJCF and URDF alone:
    floating: of URDF files: the base is free. Default: it is fixed to the world, as MuJoCo has it.
    keyframe: name or index of the keyframe to start from; qpos (nq), qvel (nv): the start itself, in MuJoCo's
        coordinates (m, rad, quaternions w x y z). Default: qpos0, at rest.
    carrier_share: where several joints of one body do not fit one joint here, a carrier is put between them, with
        this share of the body's mass and inertia on top of the body's own; in [1e-6, 1e-1].
    overlaps: 'ignore' leaves out contact between bodies of one mechanism that overlap where they start, which hard
        contacts cannot undo; 'keep' does not.

    Returns a LoadedModel or a LoadedStage: world, bodies, joints, report. Raises ImportError (a package that is not
    there), ValueError (what MuJoCo does not compile or USD does not open; an argument out of range), subadmm.Error (a
    body that the world does not take, named).
    """
    from .. import Settings

    threshold = _threshold_of(decompose)
    if settings is not None and not isinstance(settings, Settings):
        raise TypeError(f"settings = {settings!r}: must be a subadmm.Settings")
    if _is_stage(path):
        given = dict(floating=floating, keyframe=keyframe, qpos=qpos, qvel=qvel)
        for name, value in given.items():
            if value is not None and value is not False:
                raise ValueError(f"{name}: a USD stage has none; it starts as it is")
        from .usd import load_stage

        loaded = load_stage(path, settings, threshold, backend=backend, precision=precision, device=device)
        _take_threads(loaded.world, threads)
        return loaded
    try:
        import mujoco
    except ImportError as error:
        raise ImportError("subadmm.load needs the package mujoco: pip install mujoco") from error
    from .compile import compile_file

    carrier_share = real("carrier_share", carrier_share, 1e-6, 1e-1)
    if overlaps not in ("ignore", "keep"):
        raise ValueError(f"overlaps: {overlaps!r} is neither 'ignore' nor 'keep'")
    report = Report()
    compiled = isinstance(path, mujoco.MjModel)
    source, links = (path, None) if compiled else compile_file(os.fspath(path), report, floating)
    data = start_of(source, keyframe, qpos, qvel)
    from .. import World

    world = World(
        backend=backend,
        precision=precision,
        device=device,
        settings=settings if settings is not None else settings_of(source),
    )
    _take_threads(world, threads)
    loaded = LoadedModel(world, source, report)
    loaded.links = links or None
    report_options(source, report)
    add_tree(loaded, data, carrier_share)
    add_shapes(loaded, data, overlaps, threshold)
    add_equalities(loaded)
    add_actuators(loaded, data)
    loaded._start = data.qpos.copy(), data.qvel.copy(), loaded.ctrl
    return loaded
