"""Robots and scenes from MJCF and URDF files, read by MuJoCo's compiler (the extra `import` of the package).

    robot = subadmm.load("robot.xml")
    robot.world.step(100)
    print(robot.joints["elbow"].position, robot.report)

docs/import.md says what is carried over, and how. What is not is in `report`, element by element.
"""

import os

from .actuators import add_actuators
from .equality import add_equalities
from .model import Loaded, LoadedActuator, LoadedJoint, Note, Report
from .options import report_options, settings_of
from .shapes import add_shapes
from .start import start_of
from .tree import add_tree

__all__ = ["Loaded", "LoadedActuator", "LoadedJoint", "Note", "Report", "load"]


def load(
    path,
    *,
    floating=False,
    keyframe=None,
    qpos=None,
    qvel=None,
    settings=None,
    backend="auto",
    precision="f64",
    device=0,
    carrier_share=1e-4,
    overlaps="ignore",
):
    """Build a world from an MJCF or URDF file, compiled by the package `mujoco` (pip install subadmm[import]).

    path: the file, or a mujoco.MjModel that is compiled already.
    floating: of URDF files: the base is free. Default: it is fixed to the world, as MuJoCo has it.
    keyframe: name or index of the keyframe to start from; qpos (nq), qvel (nv): the start itself, in MuJoCo's
        coordinates (m, rad, quaternions w x y z). Default: qpos0, at rest.
    settings: a subadmm.Settings; default: the file's time step and gravity. backend, precision, device: as of World.
    carrier_share: where several joints of one body do not fit one joint here, a carrier is put between them, with
        this share of the body's mass and inertia on top of the body's own; in [1e-6, 1e-1].
    overlaps: 'ignore' leaves out contact between bodies of one mechanism that overlap where they start, which hard
        contacts cannot undo; 'keep' does not.

    Returns a Loaded: world, bodies, joints, actuators, report. Raises ImportError (no mujoco), ValueError (what
    MuJoCo does not compile; an argument out of range), subadmm.Error (a body that the world does not take, named).
    """
    try:
        import mujoco
    except ImportError as error:
        raise ImportError("subadmm.load needs the package mujoco: pip install subadmm[import]") from error
    from .compile import compile_file

    if not 1e-6 <= carrier_share <= 1e-1:
        raise ValueError(f"carrier_share: {carrier_share} is not in [1e-6, 1e-1]")
    if overlaps not in ("ignore", "keep"):
        raise ValueError(f"overlaps: {overlaps!r} is neither 'ignore' nor 'keep'")
    report = Report()
    source = path if isinstance(path, mujoco.MjModel) else compile_file(os.fspath(path), report, floating)
    data = start_of(source, keyframe, qpos, qvel)
    from .. import World

    world = World(
        backend=backend,
        precision=precision,
        device=device,
        settings=settings if settings is not None else settings_of(source),
    )
    loaded = Loaded(world, source, report)
    report_options(source, report)
    add_tree(loaded, data, carrier_share)
    add_shapes(loaded, data, overlaps)
    add_equalities(loaded)
    add_actuators(loaded, data)
    return loaded
