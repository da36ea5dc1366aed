"""Settings of the file, and what of it has no counterpart as a whole."""

import numpy as np

from .model import element


def disabled(source, flag):
    """Is a flag of the file's <option><flag> off? As 'CONTACT'."""
    import mujoco

    return bool(source.opt.disableflags & int(getattr(mujoco.mjtDisableBit, "mjDSBL_" + flag, 0)))


def settings_of(source):
    """The file's."""
    from .. import Settings

    gravity = [0.0, 0, 0] if disabled(source, "GRAVITY") else list(source.opt.gravity)
    return Settings(dt=float(np.clip(source.opt.timestep, 1e-6, 1)), gravity=gravity)


def report_options(source, report):
    """Notes on what concerns all of the file."""
    option = source.opt
    if source.ngeom or source.neq or source.njnt:
        report.add("solref, solimp", "not carried over: contacts, limits, friction and loops are hard here")
    if option.density or option.viscosity:
        report.add("option density, viscosity", "not carried over: there is no medium")
    if np.any(option.wind):
        report.add("option wind", "not carried over")
    if option.disableactuator:
        report.add("option actuatorgroupdisable", "not carried over: all actuators act")
    if disabled(source, "CONSTRAINT"):
        report.add("option flag constraint", "not carried over: constraints hold")
    for index in range(source.ntendon):
        report.add(element(source, "tendon", index), "not carried over (its limits, springs and friction)")
    for index in range(getattr(source, "nflex", 0)):
        report.add(f"flex #{index}", "not carried over: there are no deformable bodies")
    if source.nplugin:
        report.add("plugins", f"not carried over: {source.nplugin}")
    if source.nsensor:
        report.add("sensors", f"not carried over: {source.nsensor}")
    drawn = [
        f"{count} {name}"
        for count, name in (
            (source.ncam, "cameras"),
            (source.nlight, "lights"),
            (source.nmat, "materials"),
            (source.ntex, "textures"),
            (source.nskin, "skins"),
            (source.nsite, "sites"),
        )
        if count
    ]
    if drawn:
        report.add("what is drawn", "not carried over: " + ", ".join(drawn))
