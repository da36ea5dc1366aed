"""Pictures of a world without a window or a GPU: triangles with a sun, its shadows and ambient occlusion. The work is
done in module/draw.cpp."""
from __future__ import annotations

import weakref
from typing import Any

import numpy as np

from .. import _core
from ..given import whole
from ..output import Output
from .camera import Camera, camera_of, looking_at
from .description import describe, extent_of, world_of
from .png import png_of

SUN = np.array([-0.42, -0.5, 0.76]) / np.linalg.norm([-0.42, -0.5, 0.76])   # towards it
#: Light of the sun, of the sky above, of the ground below, and what is behind all: linear.
_LIGHT = np.array([np.array([1.0, 0.95, 0.86]) * 0.82, np.array([0.86, 0.93, 1.0]) * 0.62,
                   np.array([0.92, 0.88, 0.82]) * 0.3, np.array([0.93, 0.945, 0.965]) ** 2.2])
_FINE = {"smooth": 2, "shadow": 2048, "neighbours": 28}
_QUICK = {"smooth": 1, "shadow": 1024, "neighbours": 8}


def check_size(width, height, prefix=""):
    """(width, height) of a picture, or an error; prefix: of their names in it."""
    return whole(f"{prefix}width", width, 16, 8192), whole(f"{prefix}height", height, 16, 8192)


def _canvas_of(description):
    """The module's copy of the meshes, made once."""
    canvas = vars(description).get("_canvas")
    if canvas is None:
        canvas = _core._Canvas()
        for group in description.groups:
            mesh, n = group.mesh, len(group.body)
            uv = None if mesh.uv is None else np.ascontiguousarray(mesh.uv, np.float32).reshape(-1, 6)
            canvas.add(
                np.ascontiguousarray(mesh.vertices, np.float32), np.ascontiguousarray(mesh.triangles, np.int32),
                np.ascontiguousarray(mesh.corner_normals().reshape(-1, 9), np.float32),
                np.ascontiguousarray(group.body, np.int32),
                *(np.ascontiguousarray(values, float) for values in (group.position, group.orientation, group.scale)),
                np.ascontiguousarray(np.column_stack([group.colour.reshape(n, 3), group.opacity]), np.float32),
                group.is_ground, uv, mesh.image)
        description._canvas = canvas
    return canvas


def drawn(description, positions, orientations, camera, width, height, *, smooth, shadow, neighbours, threads=0):
    """A description at poses of its rows: height x width x 3, uint8."""
    hidden = description.hidden_from(camera.eye)
    focal = height * smooth / 2 / np.tan(camera.field / 2)
    return _canvas_of(description).draw(
        np.ascontiguousarray(positions, float), np.ascontiguousarray(orientations, float),
        np.concatenate([np.zeros(0, bool), *hidden]).astype(np.uint8), description.centre.tolist(), camera.eye.tolist(),
        camera.target.tolist(), np.ascontiguousarray(camera.axes()), focal, 1e-2 * description.radius,
        description.radius, SUN.tolist(), _LIGHT, width, height, smooth, shadow, neighbours, threads)


def _as_camera(source, camera, description):
    if camera is None:
        return looking_at(description)
    if isinstance(camera, str):
        return camera_of(source, camera)
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: {camera!r}; must be a Camera, or the name of one in the file")
    return camera


def picture(world: Any, width: int = 960, height: int = 600, camera: Any = None, smooth: int = 2,
            description: Any = None) -> Any:
    """A world, or what load() returned, as it is now: height x width x 3, uint8, sRGB. The same world gives the same
    picture.

    width, height: in [16, 8192]; camera: Camera, or None: all that moves in view, or the name of a camera of a loaded
    MJCF file; smooth: samples along a pixel's side, 1 to 4."""
    width, height = check_size(width, height)
    smooth = whole("smooth", smooth, 1, 4)
    description = description or describe(world)
    camera = _as_camera(world, camera, description)
    poses = description.poses(world_of(world)[0].get("body_state"))
    return drawn(description, *poses, camera, width, height, **{**_FINE, "smooth": smooth})


def render(world: Any, width: int = 640, height: int = 480, camera: Any = None) -> Any:
    """The same, quicker: one sample a pixel, fewer of shadows and of ambient occlusion. See World.render."""
    width, height = check_size(width, height)
    if camera is not None and not isinstance(camera, (Camera, str)):
        _as_camera(world, camera, None)
    plain, _ = world_of(world)
    description = _described(world, plain)
    poses = description.poses(plain.get("body_state"))
    return drawn(description, *poses, _as_camera(world, camera, description), width, height, **_QUICK,
                 threads=plain.settings.threads)


_known = weakref.WeakKeyDictionary()    # of worlds: what describe() was called for, and what it gave


def _described(source, world):
    """describe(source), or what it gave before, as long as bodies and shapes are the same ones and near where they
    were."""
    marks = [world._body_ids().tobytes(), world._shape_ids().tobytes(), len(world.joints), source is world,
             *(world.get(name).tobytes() for name in ("shape_size", "shape_frame"))]
    state = world.get("body_state")
    if world in _known:
        old, description = _known[world]
        if old == marks:
            low, high = extent_of(description, *description.poses(state))
            centre, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-3)
            moved = np.linalg.norm(centre - description.drawn_at[0])
            if moved < description.drawn_at[1] and 0.5 < radius / description.drawn_at[1] < 2:
                description.centre, description.radius, description.half = centre, radius, (high - low) / 2
                return description
    description = describe(source)
    description.drawn_at = description.centre, description.radius
    _known[world] = marks, description
    return description


def save_picture(path: Any, world: Any, **options: Any) -> None:
    """Write picture(world, ...) as a PNG file, which is complete or as it was."""
    with Output("path", path) as file:
        file.write(png_of(picture(world, **options)))
