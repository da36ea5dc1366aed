"""Recordings of a world: the poses of all bodies at times, kept as small whole numbers."""
from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..given import real, whole
from ..output import Output
from .camera import Camera
from .description import Description, describe, world_of
from .forces import forces_of
from .measures import MEASURES, measure
from .packing import TURN_STEP

#: Frames of a recording.
MOST_FRAMES = 10**7


@dataclass
class Recording:
    """position_step: positions are whole multiples of it, m. times: s. positions: frames x bodies x 3, orientations:
    frames x bodies x 4, whole numbers of position_step and TURN_STEP. measures: name: one figure a frame. forces: of
    each frame the Forces kept, or none at all."""
    description: Description
    title: str
    position_step: float
    times: np.ndarray
    positions: np.ndarray
    orientations: np.ndarray
    measures: dict = field(default_factory=dict)
    forces: list = field(default_factory=list)

    def poses(self, frame: int) -> Any:
        """(positions n x 3 in m, orientations n x 4, unit) of all bodies, as they are played. Off by half a
        position_step along an axis and 2.5e-4 in a component of the quaternion, an angle of 5e-4 rad, at most."""
        turns = self.orientations[frame] * TURN_STEP
        return self.positions[frame] * self.position_step, turns / np.linalg.norm(turns, axis=1, keepdims=True)

    def save(self, path: Any, **options: Any) -> None:
        """Write a file that its ending says: .html, a page that plays by itself; .glb, glTF with animation; .mp4, a
        video (needs the extra `video`); .usd, .usda, .usdc, a stage with poses over time (needs the extra `usd`). It is
        complete, or as it was.

        Of .mp4: width and height, even, pixels, in [16, 8192] (1280 x 720); camera: a Camera, or None: what moves in
        view."""
        data = self._maker(path, options)
        with Output("path", path) as file:
            file.write(data())

    def data(self, path: Any, **options: Any) -> bytes:
        """What save() writes, text or bytes."""
        return self._maker(path, options)()

    def _maker(self, path, options):
        check_ending("path", path)
        ending = Path(path).suffix
        if ending == ".mp4":
            options = check_video(**options)
            from .video import mp4_of
            return lambda: mp4_of(self, **options)
        if options:
            raise ValueError(f"{next(iter(options))}: only .mp4 files have one")
        if ending == ".html":
            from .page import page_of
            return lambda: page_of(self)
        if ending == ".glb":
            from .glb import glb_of
            return lambda: glb_of(self)
        from .usd_file import usd_of
        return lambda: usd_of(self, ending)


ENDINGS = (".html", ".glb", ".mp4", ".usd", ".usda", ".usdc")


def check_ending(name, path):
    """Is it the name of a file that a recording can be, with what is there to write it?"""
    ending = Path(path).suffix
    if ending not in ENDINGS:
        raise ValueError(f"{name}: {path}; must end in {', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}")
    package, module = {".mp4": ("imageio-ffmpeg", "imageio_ffmpeg"), ".html": (None, None),
                       ".glb": (None, None)}.get(ending, ("usd-core", "pxr"))
    if module and importlib.util.find_spec(module) is None:
        raise ImportError(f"{name}: {path}; {ending} files need the package {package}: pip install {package}")


def check_video(width=1280, height=720, camera=None):
    """What mp4_of takes, or an error."""
    for name, value in (("width", whole("width", width, 16, 8192)), ("height", whole("height", height, 16, 8192))):
        if value % 2:
            raise ValueError(f"{name}: {value}; must be even, as H.264 has it")
    if camera is not None and not isinstance(camera, Camera):
        raise TypeError(f"camera: {camera!r}; must be a Camera")
    return {"width": width, "height": height, "camera": camera}


def position_step(description):
    """A power of two in m, 1/2000 to 1/1000 of the smallest extent that is usual among what moves."""
    sizes = [np.abs(group.scale * np.ptp(group.mesh.vertices, axis=0) / 2).min(axis=1)[description.dynamic[group.body]]
             for group in description.groups]
    sizes = np.concatenate(sizes) if sizes else np.zeros(0)
    size = np.quantile(sizes, 0.1) if len(sizes) else description.radius / 10
    return float(2.0 ** np.floor(np.log2(max(size, 1e-9) / 1000)))


def check_frames(fps, contacts, prefix=""):
    """(fps, contacts) as record() takes them, or an error; prefix: of their names in it."""
    return real(f"{prefix}fps", fps, 0, 1000, above=True), whole(f"{prefix}contacts", contacts, 0, 2**31 - 1)


def count_frames(seconds, fps, prefix=""):
    """Frames of so many seconds, the first at their beginning; or an error, with the prefix before its names."""
    frames = int(np.floor(seconds * fps + 1e-9)) + 1
    if frames > MOST_FRAMES:
        raise ValueError(f"{prefix}seconds: {seconds:g}; with {fps:g} frames a second that is {frames} frames, and "
                         f"must be {MOST_FRAMES} at most")
    return frames


def step_until(world, steps, ended=None):
    """Make steps, and between them, ten times a second and more, ask ended(); true: enough. Are all of them made?"""
    some = 1
    while steps > 0 and not (ended and ended()):
        some, begun = min(some, steps) if ended else steps, time.perf_counter()
        world.step(some)
        steps -= some
        if time.perf_counter() - begun < 0.03:
            some *= 2
    return steps == 0


def record(world: Any, seconds: float, fps: float = 30.0, title: str = "", contacts: int = 0,
           after_frame: Callable[[int, int], None] | None = None,
           ended: Callable[[], bool] | None = None) -> Recording:
    """Step a world, or what load() returned, for a time (s, simulated) and keep its poses `fps` times a second, at the
    nearest step; the first frame is the world as it is. contacts: so many of the largest contact forces are
    kept a frame, with their errors
    where settings ask for certificates. seconds: in (0, 1e9], fps: in (0, 1000], MOST_FRAMES frames at most.
    after_frame(frame, frames): called after each. ended(): asked between steps; true ends the recording with the
    frames before."""
    seconds = real("seconds", seconds, 0, 1e9, above=True)
    fps, contacts = check_frames(fps, contacts)
    source = world
    world, _ = world_of(source)
    dt = world.settings.dt
    frames = count_frames(seconds, fps)
    at = np.unique(np.rint(np.arange(frames) / (fps * dt)).astype(np.int64))
    description = describe(source)
    step = position_step(description)
    inertia = world.get("body_inertia")
    shape = (len(at), description.bodies)
    positions, turns = np.empty(shape + (3,), np.int32), np.empty(shape + (4,), np.int16)
    measures = {name: np.full(len(at), np.nan) for name in MEASURES}
    before, forces = None, []
    for k, steps in enumerate(at):
        if k and not step_until(world, int(steps - at[k - 1]), ended):
            at = at[:k]
            break
        state = world.get("body_state")
        place, turn = description.poses(state)
        place = np.rint(place / step)
        if np.abs(place).max(initial=0) > 2 ** 30:
            raise ValueError(
                f"world: a body is {np.abs(place).max() * step:.3g} m away, farther than a recording can tell; "
                f"it must be less than {2**30 * step:.3g} m"
            )
        positions[k] = place
        # q and -q are the same orientation; the one nearer to the last frame's makes small differences.
        turn = turn * np.where(np.einsum("ij,ij->i", turn, turn if before is None else before) < 0, -1, 1)[:, None]
        turns[k] = np.rint(turn / TURN_STEP)
        before = turn
        if k:
            for name, value in measure(world, state, inertia).items():
                measures[name][k] = value
        else:
            measures["kinetic"][0] = measure(world, state, inertia)["kinetic"]
        if contacts:
            forces.append(forces_of(world, contacts))
        if after_frame:
            after_frame(k, len(at))
    made = len(at)
    measures = {name: values[:made] for name, values in measures.items() if np.isfinite(values[1:made]).any()}
    return Recording(description, title, step, at * dt, positions[:made], turns[:made], measures, forces)
