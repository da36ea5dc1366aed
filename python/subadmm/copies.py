"""Many copies of a world or of a loaded robot, stepped together."""
from __future__ import annotations


from . import _core
from .environments import Environments
from .importing.model import Loaded
from .robots import Robots


def replicate(template: _core.World | Loaded, count: int) -> Environments:
    """`count` environments, each a copy of `template` as it is now: a World, or what load() returned. They do not see
    each other, and make the same steps as worlds of their own, bit for bit, on settings.threads threads (0: all cores).
    The template does not change. Of a robot (MJCF or URDF) a Robots, else an Environments.

    They are where the template's backend has it. On CUDA (World(backend="cuda"), load(..., backend="cuda")) all are in
    the memory of the device and make a step together; arrays are tensors of torch there, which share that memory.

    A motor whose control is 0 is a drive in a Robots, and none in the loaded robot: their steps are equal to rounding.
    The script of a scene's world is not copied: turn it off first (World.script)."""
    if isinstance(template, Loaded):
        if hasattr(template, "positions"):
            return Robots(template, count)
        template = template.world
    if not isinstance(template, _core.World):
        raise TypeError(f"template = {template!r}: must be a subadmm.World or what subadmm.load returned")
    if template.has_script and template.script:
        raise ValueError("template: its scene has a script, which copies do not: set its `script` to False first")
    return Environments(template, count)
